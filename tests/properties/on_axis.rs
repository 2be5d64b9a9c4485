//! The least error at the two ends of the line of sight, the view's middle, and chosen depths.

use crate::CASES;
use crate::random::Ratchet;
use crate::random::basic::{log_between, unit};
use crate::random::lamps::each_lamp;
use crate::random::measure::{LIGHT_SPACE_RULES, Scene, box_about, extent, lit, lit_between, ndc, rounding};
use crate::random::scenes::each_kind;
use approx::assert_relative_eq;
use proptest::prelude::*;
use proptest::sample::select;
use shadow_warp::glam::DVec3;
use shadow_warp::{Axes, ClipSpace, Fit, Rule, ShadowMap, Sides, Slab, TrapezoidalRule, View, Warp};

/// All that a camera along z sees, under a light at an angle to it.
fn tilted(depth: [f64; 2], sides: Sides, gamma: f64) -> Scene {
    let [near, far] = depth;
    let view = View::perspective_off_centre(DVec3::ZERO, DVec3::Z, DVec3::Y, sides, near..far).unwrap();
    let all = box_about(DVec3::ZERO, DVec3::splat(4.0 * far));
    Scene::new(view, DVec3::new(0.0, gamma.sin(), gamma.cos()), &[all], all)
}

/// `t` of a depth on the line of sight, from the corners of the body; the light is in the plane of
/// y and z.
fn place(scene: &Scene, gamma: f64, depth: f64) -> f64 {
    let z = DVec3::new(0.0, -gamma.cos(), gamma.sin());
    let [low, high] = extent(scene.receivers(DVec3::ZERO).iter().map(|q| z.dot(*q)));
    (z.z * depth - low) / (high - low)
}

/// `max(q (1 + eta t_n)^2, (1 + eta t_f)^2/q)/(1 + eta)`.
fn worst_end(q: f64, [t_n, t_f]: [f64; 2], eta: f64) -> f64 {
    let [near, far] = [1.0 + eta * t_n, 1.0 + eta * t_f];
    (q * near * near).max(far * far / q) / (1.0 + eta)
}

/// LSP-38: by a search in steps of a thousandth, and then for the least between them.
fn brute_force(error: impl Fn(f64) -> f64) -> f64 {
    let steps = 20_000;
    let eta = |step: f64| (step / f64::from(steps) * 1e6_f64.ln()).exp() - 1.0;
    let best = (0..=steps).min_by(|a, b| error(eta(f64::from(*a))).total_cmp(&error(eta(f64::from(*b))))).unwrap();
    let [mut low, mut high] = [f64::from(best - 1).max(0.0), f64::from(best + 1)];
    for _ in 0..80 {
        let [a, b] = [low + 0.382 * (high - low), low + 0.618 * (high - low)];
        if error(eta(a)) <= error(eta(b)) { high = b } else { low = a }
    }
    eta(0.5 * (low + high))
}

/// LSP-38.
#[test]
fn least_error_at_the_ends_by_brute_force() {
    let mut worst = Ratchet::new("LSP-38");
    for (depth, half) in [([1.0, 100.0], 0.5), ([0.1, 70.0], 0.3), ([1.0, 1e4], 1.0)] {
        for degrees in [90.0_f64, 80.0, 70.0, 60.0, 50.0, 40.0, 30.0, 25.0, 20.0, 15.0, 10.0, 5.0] {
            let gamma = degrees.to_radians();
            let scene = tilted(depth, Sides::centred(2.0 * half, 2.0 * half), gamma);
            let (q, t) = ((depth[1] / depth[0]).sqrt(), depth.map(|z| place(&scene, gamma, z)));
            let map = scene.fit().solve(Rule::OnAxis).unwrap();
            let eta = map.warp().excess();
            let best = brute_force(|eta| worst_end(q, t, eta));
            let [found, expected] = [eta, best].map(|eta| worst_end(q, t, eta));
            // At a corner of the function the place is as good as the value; in a valley by its
            // root.
            worst.note((found / expected - 1.0).abs(), 1e-14, (degrees, eta, best));
            worst.note((eta - best).abs() / (1.0 + best), 1e-7, (degrees, eta, best));
            assert!(found <= worst_end(q, t, 0.0), "{degrees}");
            // And on the map itself, against all other rules.
            let on_map = |map: &ShadowMap| {
                let at = |z: f64| map.texel_extent(DVec3::Z * z)[1] / z;
                at(depth[0]).max(at(depth[1]))
            };
            let others = LIGHT_SPACE_RULES.map(Rule::LightSpace).into_iter().chain([Rule::TSM, Rule::Uniform]);
            for rule in others {
                let other = scene.fit().solve(rule).unwrap();
                assert!(on_map(&map) <= on_map(&other) * (1.0 + 1e-12), "{degrees} {rule:?}");
            }
        }
    }
    worst.finish();
}

/// On random scenes: never worse than without a warp, and the poles of equal ends at `-sqrt(z_n
/// z_f)`.
#[test]
fn never_worse_than_uniform_on_the_line_of_sight() {
    let (mut warped, mut met) = (0, 0);
    each_kind("on-axis", CASES, Just(()), |scene, _, ()| {
        let scene = Scene { axes: Axes::View, ..scene };
        let [map, plain] = [Rule::OnAxis, Rule::Uniform].map(|rule| scene.fit().solve(rule).unwrap());
        let view = &scene.view;
        let ends =
            extent(scene.receivers(view.eye()).iter().map(|q| view.forward().dot(*q))).map(|z| z.max(view.near()));
        let at = |map: &ShadowMap, z: f64| {
            let w = map.w(view.eye() + view.forward() * z);
            w * w / z / map.warp().ratio()
        };
        let worst = |map: &ShadowMap| at(map, ends[0]).max(at(map, ends[1]));
        assert!(worst(&map) <= worst(&plain) * (1.0 + 1e-9), "{map:?}");
        if map.warp().excess() > 0.1 {
            warped += 1;
            assert!(ends.iter().all(|z| map.w(view.eye() + view.forward() * *z) > 0.0));
            let [a, b] = ends.map(|z| at(&map, z));
            met += usize::from((a / b - 1.0).abs() < 1e-9);
        }
        if map.light_space().sin_gamma <= 0.0 {
            assert_eq!(map, plain);
        }
    });
    println!("{warped} warped, {met} with equal ends");
    assert!(warped > 200 && met > 100, "{warped} {met}");
}

/// The direction from the eye to the mean of the vertices (Wimmer and Scherzer 2005), or to the
/// centroid of the volume, for the axes and for the sine alike.
#[test]
fn middle_vector_makes_the_axes() {
    let mut worst = Ratchet::new("middle vector");
    let mut turned = [0; 2];
    let axes = select(vec![Axes::VertexMean, Axes::Middle]);
    each_kind("middle", CASES, axes, |scene, _, axes| {
        let scene = Scene { axes, ..scene };
        let eye = scene.view.eye();
        let is_mean = axes == Axes::VertexMean;
        let points = scene.receivers(eye);
        // A body that is thin has its surface count a little: 2^-26 of its size, the area, over the
        // volume.
        let (sum, unsure) = if is_mean {
            (points.into_iter().sum(), 0.0)
        } else {
            let (volume, area, moment) = centroid(&scene, eye);
            let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|a| extent(points.iter().map(|q| a.dot(*q))));
            let size = [x, y, z].iter().fold(0.0_f64, |size, [low, high]| size.max(high - low));
            (moment, size * size * area / moment.length() / (1 << 26) as f64 * f64::from(u8::from(volume > 0.0)))
        };
        if unsure > 1e-3 {
            return;
        }
        let Some((middle, light)) = sum.try_normalize().map(|middle| (middle, scene.to_light())) else { return };
        let map = scene.fit().solve(Rule::LISPSM).unwrap();
        let space = map.light_space();
        let across = middle.cross(light);
        worst.note((space.sin_gamma - across.length()).abs(), 1e-13 + unsure, &scene);
        if across.length() > 1e-3 {
            worst.note((space.x - across.normalize()).length(), (1e-12 + unsure) / across.length(), &scene);
            worst.note((space.z.dot(middle) - space.sin_gamma).abs(), 1e-13 + unsure, &scene);
            turned[usize::from(is_mean)] += u32::from(space.x.dot(scene.view.forward()).abs() > 0.1);
        }
        // All the receivers are inside, as with other axes.
        let [low, high] = extent(scene.receivers(map.origin()).iter().map(|q| ndc(&map, *q).y));
        assert!(low > -1.0 - 1e-6 && high < 1.0 + 1e-6, "{low} {high}");
    });
    worst.finish();
    assert!(turned.iter().all(|n| *n > 50), "{turned:?}");
    // With all of it behind the view's middle plane the view itself counts: an orthographic camera
    // may look back.
    let view = View::orthographic(DVec3::ZERO, DVec3::Z, DVec3::Y, Sides::centred(4.0, 4.0), -10.0..1.0).unwrap();
    let behind = box_about(DVec3::new(1.0, 0.0, -5.0), DVec3::splat(0.5));
    let scene = Scene::new(view, DVec3::Y, &[behind], behind);
    let plain = scene.fit().solve(Rule::Uniform).unwrap();
    for axes in [Axes::VertexMean, Axes::Middle] {
        let scene = Scene { axes, ..scene.clone() };
        assert_eq!(scene.fit().solve(Rule::Uniform).unwrap(), plain);
    }
}

/// Volume, area, and the volume times the centroid relative to a point: the sum over all receivers
/// of the tetrahedra between a vertex of the body and the triangles of its faces.
fn centroid(scene: &Scene, origin: DVec3) -> (f64, f64, DVec3) {
    let (mut volume, mut area, mut moment) = (0.0, 0.0, DVec3::ZERO);
    for body in scene.bodies.iter().filter(|body| !body.is_empty()) {
        let apex = body.vertices()[0] + (body.origin() - origin);
        for triangle in body.faces().flat_map(|face| face.triangles()) {
            let [a, b, c] = triangle.map(|corner| corner + (body.origin() - origin));
            let part = (a - apex).dot((b - apex).cross(c - apex)).abs() / 6.0;
            volume += part;
            area += 0.5 * (b - a).cross(c - a).length();
            moment += part * 0.25 * (apex + a + b + c);
        }
    }
    (volume, area, moment)
}

/// The part of the body between two depths decides on the warp, as if it were all there is; the map
/// covers all the same.
#[test]
fn chosen_depths_change_the_warp_alone() {
    let mut worst = Ratchet::new("chosen depths");
    let (mut changed, mut lamps) = (0, 0);
    let rules = select(vec![Rule::LISPSM, Rule::OnAxis, Rule::TSM, Rule::OPTIMAL, Rule::Uniform]);
    let more = (rules, [unit(), unit()]);
    let mut property = |scene: &Scene, rule: Rule, shares: [f64; 2]| {
        let is_lamp = scene.light.as_directional().is_err();
        let view = &scene.view;
        let points = lit(scene, view.eye());
        let [low, high] = extent(points.iter().map(|q| view.forward().dot(*q)));
        let a = low.min(high) + (high - low.min(high)) * shares[0];
        let chosen = [a, a + (high - a) * shares[1]];
        let fit = Fit { warp_depths: Some(chosen), ..scene.fit() };
        let Ok(map) = fit.solve(rule) else {
            assert!(is_lamp);
            return;
        };
        let explicit = scene.fit().solve(Rule::Explicit(map.warp())).unwrap();
        assert_eq!(map, explicit);
        // What is beyond the body is no choice.
        let wide = Fit { warp_depths: Some([0.0, 2.0 * high]), ..scene.fit() }.solve(rule).unwrap();
        let plain = scene.fit().solve(rule).unwrap();
        // The best warp may have a neighbour that is as good.
        let [a, b] = [&wide, &plain].map(|map| {
            let errors = scene.fit().errors(map.warp()).unwrap();
            if matches!(rule, Rule::Optimal(_)) { errors.along.max(errors.across) } else { map.warp().ratio() }
        });
        assert_relative_eq!(a, b, max_relative = 1e-6);
        if map.warp() != plain.warp() {
            changed += 1;
            lamps += u32::from(is_lamp);
        }
        // LiSPSM's own numbers: near, far and extent of the part, for the warp's near distance
        // d/eta.
        if rule == Rule::LISPSM && !is_lamp {
            let space = map.light_space();
            let part = lit_between(scene, chosen);
            let [z_0, z_1] = extent(part.iter().map(|q| space.z.dot(*q)));
            let [all_0, all_1] = extent(points.iter().map(|q| space.z.dot(*q)));
            let near = chosen[0].max(view.near());
            let slab = Slab { near, far: chosen[1], extent: z_1 - z_0, sin_gamma: space.sin_gamma };
            let size = points.iter().fold(0.0_f64, |s, q| s.max(q.length()));
            if slab.extent > 1e-3 * size && all_1 - all_0 > 1e-3 * size {
                let expected = shadow_warp::LightSpaceRule::Damped.excess(&slab) * (all_1 - all_0) / slab.extent;
                worst.note((map.warp().excess() - expected).abs(), 2e-15 * (1.0 + expected), expected);
            }
        }
    };
    each_kind("chosen-depths", CASES, more.clone(), |scene, _, (rule, shares)| {
        property(&Scene { axes: Axes::View, ..scene }, rule, shares);
    });
    each_lamp("chosen-depths", CASES, more, |scene, _, (rule, shares)| property(&scene, rule, shares));
    worst.finish();
    println!("{changed} changed, {lamps} of lamps");
    assert!(changed > 500 && lamps > 100, "{changed} {lamps}");
}

/// A rule that sees where the line of sight is sees it from a camera off its centre too.
#[test]
fn line_of_sight_of_a_camera_off_its_centre() {
    for shift in [-0.4, 0.0, 0.4, 2.0] {
        for degrees in [80.0_f64, 40.0, 20.0] {
            let gamma = degrees.to_radians();
            let sides = Sides { left: -0.5, right: 0.5, bottom: shift - 0.5, top: shift + 0.5 };
            let scene = tilted([1.0, 100.0], sides, gamma);
            let t = [1.0, 100.0].map(|z| place(&scene, gamma, z));
            let eta = scene.fit().solve(Rule::OnAxis).unwrap().warp().excess();
            if t[0] >= 0.0 {
                let best = brute_force(|eta| worst_end(10.0, t, eta));
                assert!((eta - best).abs() <= 1e-6 * (1.0 + best), "{shift} {degrees} {eta} {best}");
            }
            let focus = TrapezoidalRule { focus: 0.5, line: 0.9, fade: false };
            let map = scene.fit().solve(Rule::Trapezoidal(focus)).unwrap();
            let t = place(&scene, gamma, 50.5);
            if t > 0.0 && t < 0.9 {
                let expected = (0.9 - t) / (0.1 * t);
                assert!((map.warp().excess() / expected - 1.0).abs() < 1e-10, "{shift} {degrees}");
                assert!((Warp::new(expected).unwrap().map_from_body(t) - 0.9).abs() < 1e-12);
            }
        }
    }
}

/// The warp's centre across it is the eye's place, so that the line of sight, or that through the
/// view's middle, runs straight up the map, unless the receivers are all beside it.
#[test]
fn line_of_sight_runs_straight_up_the_map() {
    let mut worst = Ratchet::new("line of sight on the map");
    let mut seen = [0; 4];
    let more = (log_between(0.1, 100.0), select(vec![Axes::View, Axes::VertexMean]));
    let mut property = |scene: Scene, (excess, axes): (f64, Axes)| {
        let is_lamp = scene.light.as_directional().is_err();
        let is_middle = axes != Axes::View;
        let scene = Scene { axes, ..scene };
        let Ok(map) = scene.fit().solve(Rule::Explicit(Warp::new(excess).unwrap())) else { return };
        let (space, eye, light) = (map.light_space(), scene.view.eye(), scene.light.homogeneous());
        let base = |p: DVec3| if light.w == 0.0 { 1.0 } else { space.y.dot(light.truncate() - p) };
        let across = |p: DVec3| space.x.dot(p - light.truncate() * light.w) / base(p);
        let points = lit(&scene, DVec3::ZERO);
        let [low, high] = extent(points.iter().map(|p| across(*p)));
        let ahead =
            if is_middle { scene.receivers(eye).into_iter().sum::<DVec3>().normalize() } else { scene.view.forward() };
        let length = extent(points.iter().map(|p| p.distance(eye)))[1];
        let line = [0.1, 0.5, 0.9].map(|s| eye + ahead * (length * s));
        let line: Vec<_> = line.into_iter().filter(|p| base(*p) > 0.01 * length && map.w(*p) > 0.0).collect();
        let is_wide = high - low > 1e-3 * across(eye).abs().max(length / base(points[0]).max(length));
        if line.len() < 2 || space.sin_gamma < 1e-3 || !is_wide {
            return;
        }
        let places: Vec<_> = line.iter().map(|p| ndc(&map, *p - map.origin()).x).collect();
        let at = across(line[0]);
        if at < low || at > high {
            return;
        }
        seen[2 * usize::from(is_lamp) + usize::from(is_middle)] += 1;
        let slack = extent(line.iter().map(|p| rounding(&scene, &map, *p - map.origin())))[1];
        // The line is rounded where it is in the world.
        let row = map.clip_from_world_at(map.origin(), ClipSpace::WGPU).row(0).truncate().length();
        let world = extent(line.iter().map(|p| f64::EPSILON * (p.length() + eye.length()) * row / map.w(*p)))[1];
        let [left, right] = extent(places);
        worst.note(right - left, 1e-13 + 50.0 * slack + world, (left, right));
    };
    each_kind("line-of-sight", CASES, more.clone(), |scene, _, more| property(scene, more));
    each_lamp("line-of-sight", CASES, more, |scene, _, more| property(scene, more));
    worst.finish();
    println!("{seen:?}");
    assert!(seen.iter().all(|n| *n > 30), "{seen:?}");
}
