//! Trapezoidal shadow maps: the focus on its line, and the paper's eight matrices.

use crate::CASES;
use crate::random::basic::{direction, log_between, mixture};
use crate::random::lamps::each_lamp;
use crate::random::measure::{Scene, box_about, extent, lit, ndc, product_rounding, rounding, sizes};
use crate::random::scenes::each_kind;
use crate::random::trapezoid::eight_matrices;
use crate::random::{Ratchet, check};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use proptest::option::weighted;
use proptest::prelude::*;
use shadow_warp::glam::{DVec2, DVec3, DVec4};
use shadow_warp::{Axes, ClipSpace, Fit, Light, Rule, ShadowMap, Slab, TrapezoidalRule, View, ViewAxis, Warp};

const PLAIN: TrapezoidalRule = TrapezoidalRule { focus: 0.2, line: 0.8, fade: false };

fn some_rule() -> impl Strategy<Value = TrapezoidalRule> + Clone {
    let other = (log_between(1e-4, 1.0), 0.05..0.95, weighted(0.33, Just(())))
        .prop_map(|(focus, line, fade)| TrapezoidalRule { focus, line, fade: fade.is_some() });
    prop_oneof![Just(TrapezoidalRule::default()), other]
}

/// Scenes under a sun and under lamps, with maps of several rules; points are relative to the map's
/// origin.
fn each_map<E: Strategy + Clone>(
    name: &str,
    more: E,
    mut property: impl FnMut(&Scene, TrapezoidalRule, &ShadowMap, &[DVec3], E::Value),
) {
    each_kind(name, 2 * CASES, (some_rule(), more.clone()), |scene, _, (rule, more)| {
        let scene = Scene { axes: Axes::View, ..scene };
        let map = scene.fit().solve(Rule::Trapezoidal(rule)).unwrap();
        property(&scene, rule, &map, &lit(&scene, map.origin()), more);
    });
    each_lamp(name, CASES, (some_rule(), more), |scene, _, (rule, more)| {
        let Ok(map) = scene.fit().solve(Rule::Trapezoidal(rule)) else { return };
        property(&scene, rule, &map, &lit(&scene, map.origin()), more);
    });
}

/// The least and greatest depth of what is lit, as the rules take it.
fn depths(scene: &Scene, map: &ShadowMap, points: &[DVec3]) -> [f64; 2] {
    let (view, to_eye) = (&scene.view, scene.view.eye() - map.origin());
    let [low, high] = extent(points.iter().map(|q| view.forward().dot(*q - to_eye)));
    [low.max(view.near()), high.max(view.near())]
}

/// The distance along the axis of a lamp; 1 under a sun.
fn base(scene: &Scene, point: DVec3) -> f64 {
    match &scene.light {
        Light::Spot(spot) => spot.direction().dot(point - spot.position()),
        _ => 1.0,
    }
}

/// LSP-29, LSP-30, LSP-32.
#[test]
fn focus_lands_on_its_line() {
    let (mut inside, mut ends) = (Ratchet::new("LSP-29"), Ratchet::new("LSP-30 ends"));
    let mut focus = Ratchet::new("LSP-30 focus");
    let (mut suns, mut lamps) = (0, 0);
    each_map("LSP-29", Just(()), |scene, rule, map, points, ()| {
        let rounding = extent(points.iter().map(|q| rounding(scene, map, *q)))[1];
        let allowed = 1e-15 + rounding;
        let places: Vec<_> = points.iter().map(|q| ndc(map, *q)).collect();
        let [x, y] = [0, 1].map(|a| extent(places.iter().map(|p| p[a])));
        for [low, high] in [x, y] {
            inside.note((-1.0 - low).max(high - 1.0), allowed, map);
        }
        let [across, height, along] = sizes(points, map);
        if along > 1e-5 * across.max(height) {
            ends.note((y[0] + 1.0).abs().max((y[1] - 1.0).abs()), 1e-15 + 0.7 * rounding, map);
        }
        // The map is the one of the family with this warp.
        let same = scene.fit().solve(Rule::Explicit(map.warp())).unwrap();
        for (q, place) in points.iter().zip(&places) {
            assert_eq!(ndc(&same, *q), *place);
        }

        let [near, far] = depths(scene, map, points);
        let q = scene.view.eye() - map.origin() + scene.view.forward() * (near + rule.focus.min(1.0) * (far - near));
        let eta = map.warp().excess();
        // Where it is before the lamp, the warp is not faded, and not as strong as f64 carries
        // here.
        let most = scene.fit().solve(Rule::Explicit(Warp::new(Warp::MAX_EXCESS).unwrap())).unwrap().warp().excess();
        let is_free = eta > 0.0 && eta < 0.999 * most.min(far / near - 1.0);
        if rule.fade || base(scene, q + map.origin()) <= 0.0 || !is_free || along <= 1e-5 * across.max(height) {
            return;
        }
        let place = ndc(map, q);
        let t = Warp::new(eta).unwrap().body_from_map(rule.line);
        // Its place in the body is known to so much, and moves on the map by the density.
        let slack = 2.0 * f64::EPSILON * (q.length() + far) / along.min(across.max(1e-300)) * eta.max(1.0);
        let off = (place.y - (2.0 * rule.line - 1.0)).abs();
        focus.note(off, 0.6 * (1e-15 + product_rounding(map, q) + slack), (rule, t, map));
        if scene.light.as_directional().is_ok() { suns += 1 } else { lamps += 1 }
    });
    for ratchet in [inside, ends, focus] {
        ratchet.finish();
    }
    println!("{suns} {lamps}");
    assert!(suns > 150 && lamps > 2, "{suns} {lamps}");
}

/// LSP-31: the corners of the map, seen along the light, are the paper's trapezoid; its eight
/// matrices make the same map.
#[test]
fn eight_matrices_make_the_same_map() {
    let mut worst = Ratchet::new("LSP-31");
    let mut compared = 0;
    each_map("LSP-31", prop::array::uniform4(mixture()), |scene, _, map, points, samples| {
        let eta = map.warp().excess();
        let [across, height, along] = sizes(points, map);
        let thin = along.min(across) < 1e-3 * along.max(across).max(height);
        if scene.light.as_directional().is_err() || eta <= 0.1 || eta > 100.0 || thin {
            return;
        }
        let space = map.light_space();
        let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
        let back = matrix.inverse();
        // The paper's top line is the near one, at its y = 1; this map has it at y = -1.
        let corner = |x: f64, y: f64| {
            let p = back * DVec4::new(x, -y, 0.5, 1.0);
            let p = p.truncate() / p.w;
            DVec2::new(space.x.dot(p), space.z.dot(p))
        };
        let eight = eight_matrices([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
        // The inverse, and the meeting of the side lines far away for a weak warp.
        let distance = extent(points.iter().map(|q| q.length()))[1] + scene.view.eye().distance(map.origin());
        let allowed = 2e-14 * (1.0 + 1.0 / eta) * (1.0 + eta) * (1.0 + distance / along.min(across));
        for q in samples {
            let q = q.of(points);
            let place = ndc(map, q);
            let p = eight * DVec3::new(space.x.dot(q), space.z.dot(q), 1.0);
            let p = p.truncate() / p.z;
            worst.note((p - DVec2::new(place.x, -place.y)).abs().max_element(), allowed, (eta, p, place));
        }
        compared += usize::from(allowed < 1e-8);
    });
    worst.finish();
    assert!(compared > 150, "{compared}");
}

/// The paper's `eta = (lambda delta' + lambda delta' xi)/(lambda - 2 delta' - lambda xi)`, where it
/// is a number, and the map as near to the uniform one as it gets, where it is not.
#[test]
fn excess_is_the_reciprocal_of_the_papers() {
    let mut worst = Ratchet::new("the excess of the trapezoidal rule");
    let slab = Slab { near: 1e-12, far: 1.0, extent: 1.0, sin_gamma: 1.0 };
    let strategy = (log_between(1e-3, 1e6), 0.01..0.99, log_between(1e-3, 0.999));
    check("TSM-excess", 20 * CASES, strategy, |(lambda, line, share)| {
        let delta = lambda * line * share;
        let xi = 1.0 - 2.0 * line;
        let paper = (lambda * delta + lambda * delta * xi) / (lambda - 2.0 * delta - lambda * xi);
        let rule = TrapezoidalRule { focus: 1.0, line, fade: true };
        let axis = ViewAxis { t: [0.0, delta / lambda], w: [1.0, 0.0] };
        let excess = rule.excess(&slab, &axis);
        // The paper's own difference, and 1 - (1 - 2 S).
        worst.note(
            (excess * paper / lambda - 1.0).abs(),
            1e-14 * (1.0 + line / (line - delta / lambda)) / line,
            excess,
        );
    });
    worst.finish();
    let at = |t: f64, line: f64| {
        TrapezoidalRule { focus: 1.0, line, fade: false }.excess(&slab, &ViewAxis { t: [0.0, t], w: [1.0, 0.0] })
    };
    for below in [1e-3, 1e-9, 1e-15] {
        let t = 0.8 - below;
        assert_relative_eq!(at(t, 0.8), (0.8 - t) / (0.2 * t), max_relative = 1e-15);
    }
    // Beyond the line, and on it, nothing; at the top line or before it, the camera's own
    // perspective.
    let most = slab.far / slab.near - 1.0;
    for (t, line, expected) in [
        (0.8, 0.8, 0.0),
        (0.9, 0.8, 0.0),
        (1.5, 0.8, 0.0),
        (0.0, 0.8, most),
        (-0.5, 0.8, most),
        (1e-300, 0.8, most),
        (0.5, 1.0, most),
        (1.0, f64::INFINITY, most),
        (0.5, f64::INFINITY, most),
        (0.5, f64::NEG_INFINITY, 0.0),
        (0.5, f64::NAN, 0.0),
        (0.5, 0.0, 0.0),
        (0.5, -1.0, 0.0),
    ] {
        assert_eq!(at(t, line).to_bits(), expected.to_bits(), "{t} {line}");
    }
    // A focus that is no share of the depths is at one of their ends, and behind a lamp there is
    // none.
    let along = ViewAxis { t: [0.1, 0.5], w: [1.0, 0.0] };
    let with = |focus: f64| TrapezoidalRule { focus, ..PLAIN }.excess(&slab, &along).to_bits();
    for (focus, same) in
        [(f64::NAN, 0.0), (-1.0, 0.0), (f64::NEG_INFINITY, 0.0), (2.0, 1.0), (f64::INFINITY, 1.0), (-0.0, 0.0)]
    {
        assert_eq!(with(focus), with(same), "{focus}");
    }
    assert_eq!(PLAIN.excess(&slab, &ViewAxis { t: [0.1, 0.5], w: [-1.0, 0.5] }).to_bits(), 0);
}

/// All that a centred camera along z sees, under a light at an angle to it.
fn plain(gamma: f64) -> Scene {
    let view = View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, 1.0, 1.0, 1.0..100.0).unwrap();
    let all = box_about(DVec3::ZERO, DVec3::splat(200.0));
    Scene::new(view, DVec3::new(0.0, gamma.sin(), gamma.cos()), &[all], all)
}

/// The paper's ratio tends to 4 as light and view become parallel; faded, to 1, and without a jump
/// anywhere.
#[test]
fn fades_as_light_and_view_become_parallel() {
    let ratio = |gamma: f64, fade: bool| {
        let rule = TrapezoidalRule { fade, focus: 0.2, line: 0.8 };
        plain(gamma).fit().solve(Rule::Trapezoidal(rule)).unwrap().warp().ratio()
    };
    assert_abs_diff_eq!(ratio(1e-6, false), 4.0, epsilon = 1e-4);
    assert_abs_diff_eq!(ratio(1e-9, false), 4.0, epsilon = 1e-7);
    let across = core::f64::consts::FRAC_PI_2;
    assert_eq!(ratio(across, false).to_bits(), ratio(across, true).to_bits());
    assert_eq!(ratio(0.0, true).to_bits(), 1.0_f64.to_bits());
    let mut last = 1.0;
    for step in 1..=1000 {
        let gamma = across * f64::from(step) / 1000.0;
        let (faded, sine) = (ratio(gamma, true), gamma.sin());
        let expected = (ratio(gamma, false) - 1.0) * (sine * sine * (3.0 - 2.0 * sine));
        assert_abs_diff_eq!(faded - 1.0, expected, epsilon = 1e-13 * (1.0 + expected));
        assert!((faded - last).abs() < 0.03 * faded, "{gamma} {last} {faded}");
        last = faded;
    }
}

/// Lines, points and rectangles, from which the paper's trapezoid cannot be made.
#[test]
fn flat_bodies_have_maps() {
    let mut inside = Ratchet::new("flat bodies");
    let halves = [DVec3::ZERO, DVec3::X, DVec3::Z, DVec3::new(1.0, 0.0, 1.0), DVec3::new(0.0, 1.0, 1.0)];
    for (name, half) in ["point", "x", "z", "xz", "yz"].into_iter().zip(halves) {
        let light = prop_oneof![Just(DVec3::Y), direction()];
        let rule = prop_oneof![some_rule(), Just(TrapezoidalRule { focus: 0.0, ..PLAIN })];
        let strategy = (1.0..50.0, log_between(1e-6, 10.0), light, rule);
        check(&format!("TSM-flat/{name}"), CASES, strategy, |(depth, size, light, rule)| {
            let view = View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, 1.0, 1.0, 0.1..100.0).unwrap();
            let boxes = [box_about(DVec3::Z * depth, half * size)];
            let scene = Scene::new(view, light, &boxes, boxes[0]);
            let fit = Fit { map_size: [512, 512], ..scene.fit() };
            let map = fit.solve(Rule::Trapezoidal(rule)).unwrap();
            assert!(map.clip_from_world_at(map.origin(), ClipSpace::WGPU).is_finite());
            for q in scene.receivers(map.origin()) {
                let place = ndc(&map, q);
                let out = (place.truncate().abs().max_element() - 1.0).max(-place.z).max(place.z - 1.0);
                inside.note(out, 1e-15 + 0.1 * product_rounding(&map, q), place);
            }
        });
    }
}
