//! Spot and point lights.

use crate::CASES;
use crate::oracle::{HalfSpaces, assert_closed, support};
use crate::random::Ratchet;
use crate::random::basic::{direction, log_between, mixture};
use crate::random::lamps::{PLACES, assert_casters_are_shown, each_lamp, probes};
use crate::random::measure::{Scene, extent, lit, ndc, rounding, spot};
use proptest::prelude::*;
use proptest::sample::select;
use shadow_warp::glam::{DVec2, DVec3};
use shadow_warp::{Axes, Body, ClipSpace, Error, LightSpace, NearDepth, Plane, Rule, ShadowMap, Spot, View, Warp};

const RULES: [Rule; 5] = [Rule::Uniform, Rule::LISPSM, Rule::TSM, Rule::OPTIMAL, Rule::PSM];

fn rule() -> impl Strategy<Value = Rule> + Clone {
    let explicit = log_between(1e-3, 1e4).prop_map(|excess| Rule::Explicit(Warp::new(excess).unwrap()));
    prop_oneof![5 => select(RULES.to_vec()), 1 => explicit]
}

/// The lamps, each with some rule; points are relative to the map's origin.
fn each_map<E: Strategy + Clone>(
    name: &str,
    more: E,
    mut property: impl FnMut(&Scene, Rule, &ShadowMap, &[DVec3], E::Value),
) {
    let (mut seen, mut dark, mut refused, mut too_near) = ([0; PLACES.len()], 0, 0, 0);
    let axes = select(vec![Axes::View, Axes::LightFixed, Axes::Middle, Axes::VertexMean]);
    let options = (axes, select(vec![NearDepth::Casters, NearDepth::Receivers]));
    each_lamp(name, 2 * CASES, (rule(), options, more), |scene, place, (rule, (axes, near_depth), more)| {
        let scene = Scene { axes, near_depth, ..scene };
        match scene.fit().solve(rule) {
            Ok(map) => {
                seen[place as usize] += 1;
                property(&scene, rule, &map, &lit(&scene, map.origin()), more);
            }
            Err(Error::NothingLit) => {
                dark += 1;
                assert!(lit(&scene, DVec3::ZERO).is_empty());
            }
            Err(Error::Unsupported { .. }) if rule == Rule::PSM => refused += 1,
            Err(Error::Invalid { argument: "near", .. }) => too_near += 1,
            Err(error) => unreachable!("{error}"),
        }
    });
    println!("{seen:?}, dark {dark}, refused {refused}, too near {too_near}");
    let all = 2 * CASES * crate::random::multiplier();
    assert!(seen.iter().all(|n| *n > all / 4), "{seen:?}");
    assert!(refused + too_near < all / 2, "{refused} {too_near}");
}

/// LSP-33.
#[test]
fn contains_and_touches() {
    let (mut inside, mut touch) = (Ratchet::new("LSP-33 inside"), Ratchet::new("LSP-33 touch"));
    let (mut touched, mut by_casters) = (0, 0);
    each_map("LSP-33", probes(), |scene, rule, map, points, probes| {
        let allowed = 1e-14 + 0.5 * extent(points.iter().map(|q| rounding(scene, map, *q)))[1];
        let places: Vec<_> = points.iter().map(|q| ndc(map, *q)).collect();
        let [x, y, z] = [0, 1, 2].map(|a| extent(places.iter().map(|p| p[a])));
        for [low, high] in [x, y, z.map(|z| 2.0 * z - 1.0)] {
            inside.note((-1.0 - low).max(high - 1.0), allowed, (rule, map));
        }
        let nearest =
            if scene.near_depth == NearDepth::Casters { assert_casters_are_shown(scene, map, &probes) } else { 1.0 };
        by_casters += usize::from(nearest < z[0] - 0.01);
        // A part that is flat, seen from the lamp, is fitted as if it were not.
        let extents = |axis: DVec3| {
            let to_lamp = spot(&scene.light).position() - map.origin();
            let [low, high] = extent(points.iter().map(|q| {
                let q = *q - to_lamp;
                axis.dot(q) / spot(&scene.light).direction().dot(q)
            }));
            high - low
        };
        let space = map.light_space();
        let [across, along] = [space.x, space.z].map(extents);
        if across.min(along) > 1e-5 * across.max(along) {
            touched += 1;
            for [low, high] in [x, y] {
                touch.note((low + 1.0).abs().max((high - 1.0).abs()), allowed, (rule, map));
            }
            // Flat against its distance, too.
            let light = spot(&scene.light);
            let [near, far] =
                extent(points.iter().map(|q| light.direction().dot(*q + map.origin() - light.position())));
            let flat = scene.boxes.iter().any(|b| (b.max() - b.min()).min_element() <= 0.0);
            if !flat && far > near * (1.0 + 1e-5) && allowed < 1e-7 {
                touch.note((z[1] - 1.0).abs(), allowed, (rule, map));
                if scene.near_depth == NearDepth::Receivers {
                    touch.note(z[0].abs(), allowed, (rule, map));
                }
            }
        }
    });
    inside.finish();
    touch.finish();
    println!("{touched} {by_casters}");
    assert!(touched > 800 && by_casters > 30, "{touched} {by_casters}");
}

/// LSP-34.
#[test]
fn light_rays_stay_in_their_texel() {
    let mut sideways = Ratchet::new("LSP-34");
    // Away from the lamp as far again, or towards it a part of the way.
    let way = prop_oneof![2 => log_between(1e-3, 0.99), 1 => Just(-1.0)];
    each_map("LSP-34", (mixture(), way), |scene, rule, map, points, (q, way)| {
        let q = q.of(points);
        let to_lamp = spot(&scene.light).position() - map.origin() - q;
        let way = to_lamp * way;
        let [here, there] = [q, q + way].map(|p| ndc(map, p));
        let allowed = 1e-14 + 0.3 * (rounding(scene, map, q) + rounding(scene, map, q + way));
        let moved = (here - there).truncate().abs().max_element();
        sideways.note(moved, allowed, (rule, map));
        let forth = way.dot(to_lamp).signum();
        assert!((here.z - there.z) * forth > -allowed, "{here} {there}");
        // z/w falls towards the lamp by its rows, whatever rounding hides.
        let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
        let [z, w] = [2, 3].map(|row| matrix.row(row));
        let change = z.truncate().dot(way) * w.dot(q.extend(1.0)) - z.dot(q.extend(1.0)) * w.truncate().dot(way);
        assert!(change * forth < 0.0, "{change} {map:?}");
    });
    sideways.finish();
}

/// LSP-35: the errors of an edge along the line of sight at its two ends; no other warp has a
/// smaller worst one.
#[test]
fn errors_on_the_line_of_sight_are_equal() {
    let mut equal = Ratchet::new("LSP-35");
    let (mut compared, mut met) = (0, 0);
    let others = prop::array::uniform4(log_between(1e-6, 1e6));
    each_lamp("LSP-35", 2 * CASES, others, |scene, _, others| {
        let Ok(map) = scene.fit().solve(Rule::OnAxis) else { return };
        assert_eq!(map, scene.fit().solve(Rule::LISPSM).unwrap());
        let view = &scene.view;
        let [near, far] =
            extent(lit(&scene, view.eye()).iter().map(|q| view.forward().dot(*q))).map(|z| z.max(view.near()));
        let base = |z: f64| {
            let lamp = spot(&scene.light);
            lamp.direction().dot(view.eye() + view.forward() * z - lamp.position())
        };
        let least = base(near).min(base(far)) / (base(near) - base(far)).abs();
        if least <= 1e-9 {
            // To rounding, an end is behind the lamp, where there is no best warp.
            assert!(least >= -1e-9 || map.warp().excess() == 0.0);
            return;
        }
        // The way along the line of sight of a step in the map, seen from the eye.
        let errors = |map: &ShadowMap| {
            let matrix = map.clip_from_world_at(view.eye(), ClipSpace::WGPU);
            [near, far].map(|z| {
                let (v, p) = (view.forward(), (view.forward() * z).extend(1.0));
                let [y, w] = [1, 3].map(|row| matrix.row(row));
                let step = y.truncate().dot(v) * w.dot(p) - y.dot(p) * w.truncate().dot(v);
                if w.dot(p) > 0.0 { w.dot(p) * w.dot(p) / step.abs() / z } else { f64::INFINITY }
            })
        };
        let place = |p: DVec3| {
            let q = p - spot(&scene.light).position();
            map.light_space().z.dot(q) / spot(&scene.light).direction().dot(q)
        };
        let worst = |map: &ShadowMap| errors(map)[0].max(errors(map)[1]);
        let best = worst(&map);
        let explicit = |eta: f64| scene.fit().solve(Rule::Explicit(Warp::new(eta).unwrap())).unwrap();
        let most = explicit(Warp::MAX_EXCESS).warp().excess();
        let eta = map.warp().excess();
        if eta >= 0.999 * most || far < near * 1.001 || map.light_space().sin_gamma < 1e-9 {
            return;
        }
        assert!(best.is_finite(), "{eta}");
        // Ends that lie behind where the body begins have no best warp.
        let starts = extent(lit(&scene, map.origin()).iter().map(|q| place(map.origin() + *q)))[0];
        if [near, far].iter().any(|z| place(view.eye() + view.forward() * *z) < starts) {
            return;
        }
        for other in others.into_iter().chain([0.0]) {
            let other = worst(&explicit(other.min(most)));
            assert!(other >= best * (1.0 - 1e-9), "{eta} {other} {best}");
        }
        compared += 1;
        let [a, b] = errors(&map);
        // The warp's pole is at -sqrt(z_n z_f) then.
        let pole = view.eye() - view.forward() * (near * far).sqrt();
        let [w, w_near] = [pole, view.eye() + view.forward() * near].map(|p| map.w(p));
        if eta > 0.0 && w.abs() < 1e-6 * w_near {
            met += 1;
            let thin = rounding(&scene, &map, lit(&scene, map.origin())[0]);
            equal.note((a / b - 1.0).abs(), 1e-14 * (1.0 + eta) + thin, (eta, a, b));
        }
    });
    equal.finish();
    println!("{compared} compared, {met} with equal ends");
    assert!(compared > 120 && met > 30, "{compared} {met}");
}

/// The picture of the line of sight runs along z, ahead, wherever the lamp shines; the direction
/// does not depend on where on the line the eye is.
#[test]
fn axes_follow_the_picture_of_the_line_of_sight() {
    let (mut same, mut straight) = (Ratchet::new("Plücker direction"), Ratchet::new("picture of the line of sight"));
    let mut seen = 0;
    let step = (-3.0..3.0, log_between(0.1, 10.0));
    each_lamp("axes-of-lamps", CASES, prop::array::uniform4(step), |scene, _, steps| {
        let (view, lamp) = (&scene.view, spot(&scene.light));
        let space = LightSpace::new(view, &scene.light).unwrap();
        assert_eq!(space.y, -lamp.direction());
        assert!((space.y.cross(space.x) - space.z).length() < 3.3e-15 && space.x.dot(space.y).abs() < 3.3e-15);
        assert!((space.x.length() - 1.0).abs() < 3.3e-15);
        let to_lamp = lamp.position() - view.eye();
        // The sine of the angle between the line and the way to the lamp, by what rounds.
        if space.sin_gamma < 1e-6 {
            return;
        }
        seen += 1;
        for (step, further) in steps {
            let step = to_lamp.length() * step;
            let eye = view.eye() + view.forward() * step;
            let other = View::perspective_off_centre(
                eye,
                view.forward(),
                view.up(),
                shadow_warp::Sides::centred(1.0, 1.0),
                1.0..2.0,
            );
            let moved = LightSpace::new(&other.unwrap(), &scene.light).unwrap();
            let rounding = f64::EPSILON * (1.0 + (eye.length() + lamp.position().length()) / to_lamp.length());
            let rounding = rounding * (1.0 + to_lamp.length() / eye.distance(lamp.position())) / space.sin_gamma;
            same.note(moved.z.distance(space.z), 4e-15 + rounding, step);
            // Two places on the line that the lamp shines towards.
            let place = |p: DVec3| {
                let q = p - lamp.position();
                let base = lamp.direction().dot(q);
                (base > 0.1 * q.length()).then(|| DVec2::new(space.x.dot(q), space.z.dot(q)) / base)
            };
            let ahead = eye + view.forward() * to_lamp.length() * further;
            if let (Some(a), Some(b)) = (place(eye), place(ahead)) {
                straight.note((a.x - b.x).abs(), 1e-15 + 2.0 * rounding, step);
                assert!(b.y > a.y - 1e-12 - 10.0 * rounding, "{a} {b}");
            }
        }
    });
    same.finish();
    straight.finish();
    assert!(seen > 500, "{seen}");
}

/// The pyramid of eight sides about the cone, written down by itself.
fn half_spaces(scene: &Scene, space: &LightSpace, lamp: &Spot, body: &Body, bounds: usize) -> HalfSpaces {
    let mut all = HalfSpaces::of_view(&scene.view, &scene.boxes[bounds], body.origin());
    let (apex, axis) = (lamp.position() - body.origin(), lamp.direction());
    let (sin, cos) = lamp.outer_angle().sin_cos();
    let mut add = |normal: DVec3, point: DVec3| all.add(&Plane::new(normal, point).unwrap());
    add(-axis, apex + axis * lamp.near());
    add(axis, apex + axis * lamp.range());
    for eighth in 0..8 {
        let turn = f64::from(eighth) * core::f64::consts::FRAC_PI_4;
        add((space.x * turn.cos() + space.z * turn.sin()) * cos - axis * sin, apex);
    }
    all
}

/// What a lamp shines on, against brute force.
#[test]
fn lit_bodies_are_their_half_spaces() {
    let (mut cut, mut dark) = (0, 0);
    let more = (prop::array::uniform8(direction()), prop::array::uniform8((mixture(), direction())));
    each_lamp("lit-bodies", 70, more, |scene, _, (directions, samples)| {
        let space = LightSpace::new(&scene.view, &scene.light).unwrap();
        for (i, body) in scene.bodies.iter().enumerate().filter(|(_, body)| !body.is_empty()) {
            let lit = body.lit_by(&scene.light, &space);
            assert_closed(&lit);
            let lamp = spot(&scene.light);
            let oracle = half_spaces(&scene, &space, lamp, body, i);
            let size =
                oracle.size() + lamp.position().distance(body.origin()) + scene.view.eye().distance(body.origin());
            let tolerance = 16.0 * f64::EPSILON * size;
            for q in lit.vertices() {
                assert!(oracle.beyond(*q) <= tolerance, "{} {size}", oracle.beyond(*q));
            }
            let deep = oracle.shrunk(1e-8 * size).vertices(0.0);
            dark += usize::from(lit.is_empty());
            cut += usize::from(lit.vertices().len() != body.vertices().len() && !deep.is_empty());
            for direction in directions {
                let reach = support(lit.vertices(), direction).unwrap_or(f64::NEG_INFINITY);
                let needed = support(&deep, direction).unwrap_or(f64::NEG_INFINITY);
                assert!(needed <= reach, "{needed} {reach}");
            }
            // All of the cone is in.
            for (q, needed) in samples {
                let q = q.of(body.vertices());
                let from = q + body.origin() - lamp.position();
                let along = lamp.direction().dot(from);
                let in_range = along > lamp.near() * (1.0 + 1e-9) && along < lamp.range() * (1.0 - 1e-9);
                if in_range && along > from.length() * lamp.outer_angle().cos() * (1.0 + 1e-9) {
                    assert!(!lit.is_empty());
                    assert!(support(lit.vertices(), needed).unwrap() >= needed.dot(q) - tolerance);
                }
            }
        }
    });
    println!("{cut} cut, {dark} dark");
    assert!(cut > 100 && dark > 50, "{cut} {dark}");
}
