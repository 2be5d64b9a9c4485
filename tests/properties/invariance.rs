//! What may change about a scene without changing its map.

use crate::random::basic::{direction, inside, log_between};
use crate::random::measure::{Scene, box_about, box_between, extent, ndc, product_rounding, project, sizes};
use crate::random::scenes::{Cameras, KINDS, each_kind, rule, settled_direction, sun, view};
use crate::random::{Ratchet, check};
use crate::{CASES, allowance};
use proptest::prelude::*;
use proptest::sample::select;
use shadow_warp::glam::{DMat3, DMat4, DQuat, DVec3};
use shadow_warp::{Axes, Body, Bounds, ClipSpace, Lens, NearDepth, Rule, ShadowMap, Sides, View};

/// A view in a world that is turned, scaled and then moved.
fn transformed(view: &View, turn: DMat3, scale: f64, shift: DVec3) -> View {
    let Lens::Perspective(sides) = view.lens() else { unreachable!() };
    let (forward, up) = (turn * view.forward(), turn * view.up());
    let depth = view.near() * scale..view.far() * scale;
    View::perspective_off_centre(turn * view.eye() * scale + shift, forward, up, sides, depth).unwrap()
}

/// What is near the eye is known to the rounding of the bodies' origins, and the rules that look at the nearest depth with it.
fn near_rounding(scene: &Scene, map: &ShadowMap) -> f64 {
    let away = |origin: DVec3| (origin - map.origin()).length() + (origin - scene.view.eye()).length();
    let farthest = scene.bodies.iter().map(|body| away(body.origin())).fold(0.0, f64::max);
    0.1 * f64::EPSILON * farthest / scene.view.near()
}

/// LSP-10 for whole frusta and any rotation. Casters are left out: their box would have to turn
/// with the world.
#[test]
fn move_turn_and_scale_the_world() {
    let mut worst = Ratchet::new("LSP-10, any turn");
    let cameras =
        Cameras { world: 1e3, near: [1e-2, 1.0], ratio: [1.5, 1e5], far: f64::INFINITY, tangent: [0.05, 2.0] };
    for kind in KINDS {
        let change = (direction(), direction(), log_between(1e-2, 1e2), inside(1e3));
        let strategy = (view(cameras), sun(kind, 1e-3), rule(), change);
        check(&format!("LSP-10/{kind:?}"), CASES, strategy, |(view, sun, rule, (from, to, scale, shift))| {
            let to_light = sun.to_light(&view);
            let far = view.far();
            let whole = |view: View, to_light: DVec3, size: f64| {
                let all = box_about(view.eye(), DVec3::splat(size));
                Scene { near_depth: NearDepth::Receivers, ..Scene::new(view, to_light, &[all], all) }
            };
            // Exactly parallel stays so only by luck.
            if view.forward().cross(to_light).length() < 1e-4 {
                return;
            }
            let turn = DMat3::from_quat(DQuat::from_rotation_arc(from, to));
            let scene = whole(view, to_light, 8.0 * far);
            let other = whole(transformed(&view, turn, scale, shift), turn * to_light, 8.0 * far * scale);
            let [map, turned] = [&scene, &other].map(|s| s.fit().solve(rule).unwrap());
            let eta = map.warp().excess();
            worst.note((turned.warp().excess() / eta.max(1e-300) - 1.0).abs() * eta.min(1.0), 3e-12, rule);
            for q in scene.receivers(view.eye()) {
                let [a, b] = [(&map, &scene, q), (&turned, &other, turn * q * scale)].map(|(map, scene, q)| {
                    project(map.clip_from_world_at(scene.view.eye(), ClipSpace::WGPU) * q.extend(1.0))
                });
                worst.note((a - b).abs().max_element(), 3e-12 + allowance(eta), (a, b));
            }
        });
    }
    worst.finish();
}

/// LSP-10 for boxes and casters, with the turns that leave boxes along the axes, and a scale that
/// rounds nothing.
#[test]
fn move_quarter_turn_and_scale_the_world() {
    let mut worst = Ratchet::new("LSP-10, quarter turns");
    let axis = || select(vec![0, 1, 2_usize]);
    let change = ((axis(), any::<bool>()), any::<[bool; 2]>(), select(vec![1.0, 0.25, 8.0]), inside(1e3));
    let mut compared = 0;
    each_kind("LSP-10-quarters", CASES, (rule(), change), |scene, _, (rule, ((first, other), signs, scale, shift))| {
        let scene = Scene { axes: Axes::View, ..scene };
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let (a, b) = (axes[first], axes[(first + 1 + usize::from(other)) % 3]);
        let [a, b] = [(a, signs[0]), (b, signs[1])].map(|(axis, negative)| if negative { -axis } else { axis });
        let (turn, shift) = (DMat3::from_cols(a, b, a.cross(b)), shift.round());
        let place = |b: &Bounds| box_between(turn * b.min() * scale + shift, turn * b.max() * scale + shift);
        let boxes: Vec<_> = scene.boxes.iter().map(place).collect();
        let view = transformed(&scene.view, turn, scale, shift);
        let other = Scene::new(view, turn * scene.to_light(), &boxes, place(&scene.casters));
        let [map, turned] = [&scene, &other].map(|scene| scene.fit().solve(rule).unwrap());
        let receivers = scene.receivers(map.origin());
        // Positions in the world are rounded; a thin or distant body shows it.
        let [x, y, z] = sizes(&receivers, &map);
        let least = x.min(z).min(y);
        // The turn of the axes about the light is known to one rounding over the angle.
        let turning = map.light_space().sin_gamma < 1e-3;
        if turning || least < 1e-5 * x.max(y).max(z) || map.warp().excess() > 1e4 {
            return;
        }
        compared += 1;
        let far = scene.view.eye().distance(map.origin());
        let rounding = 1e4 * f64::EPSILON * (1.0 + far * 1e-3) / (least / map.warp().ratio());
        for q in receivers {
            let other_q = turn * (q + map.origin() - scene.view.eye()) * scale;
            let a = ndc(&map, q);
            let b = project(turned.clip_from_world_at(view.eye(), ClipSpace::WGPU) * other_q.extend(1.0));
            worst.note((a - b).abs().max_element(), 3e-12 + rounding, (a, b));
        }
    });
    worst.finish();
    assert!(compared > 300, "{compared}");
}

/// A centred camera sees the same through a mirror.
#[test]
fn mirrored_cameras_see_the_same() {
    let mut worst = Ratchet::new("mirrored");
    each_kind("mirrored", CASES, rule(), |scene, _, rule| {
        let Lens::Perspective(s) = scene.view.lens() else { unreachable!() };
        let centred = Sides::centred(s.right - s.left, s.top - s.bottom);
        let v = scene.view;
        let view = View::perspective_off_centre(v.eye(), v.forward(), v.up(), centred, v.near()..v.far()).unwrap();
        assert_eq!(view.mirrored().right(), -view.right());
        let [plain, mirrored] = [view, view.mirrored()].map(|view| {
            let same = Scene::new(view, scene.to_light(), &scene.boxes, scene.casters);
            Scene { axes: scene.axes, ..same }
        });
        assert_eq!(plain.is_visible(), mirrored.is_visible());
        let (Ok(a), Ok(b)) = (plain.fit().solve(rule), mirrored.fit().solve(rule)) else { return };
        let eta = a.warp().excess();
        let [x, y, z] = sizes(&plain.receivers(a.origin()), &a);
        let thin = (x.max(y).max(z) / x.min(y).min(z)).clamp(1.0, 1e6);
        let of_near = near_rounding(&plain, &a);
        worst.note((a.warp().ratio() / b.warp().ratio() - 1.0).abs(), 1e-14 * thin + of_near, a);
        for q in plain.receivers(a.origin()) {
            let allowed = 0.3 * allowance(eta) * thin + of_near + product_rounding(&a, q);
            worst.note((ndc(&a, q) - ndc(&b, q)).abs().max_element(), allowed, rule);
        }
    });
    worst.finish();
}

/// A box and its two halves are the same receivers.
#[test]
fn halves_are_the_whole() {
    let mut worst = Ratchet::new("halves");
    let mut used = 0;
    let axis = select(vec![DVec3::X, DVec3::Y, DVec3::Z]);
    each_kind("halves", CASES, (rule(), axis, 0.2..0.8), |scene, _, (rule, axis, share)| {
        let whole = scene.boxes[0];
        let cut = whole.min() + (whole.max() - whole.min()) * share;
        let lower = box_between(whole.min(), DVec3::select(axis.cmpgt(DVec3::ZERO), cut, whole.max()));
        let upper = box_between(DVec3::select(axis.cmpgt(DVec3::ZERO), cut, whole.min()), whole.max());
        let [one, two] = [&[whole][..], &[lower, upper]].map(|boxes| {
            let same = Scene::new(scene.view, scene.to_light(), boxes, scene.casters);
            Scene { axes: scene.axes, ..same }
        });
        let [a, b] = [&one, &two].map(|scene| scene.fit().solve(rule).unwrap());
        let receivers = one.receivers(a.origin());
        let [x, y, z] = sizes(&receivers, &a);
        let least = x.min(y).min(z);
        if least < 1e-5 * x.max(y).max(z) || a.warp().excess() > 1e4 {
            return;
        }
        used += 1;
        let shift = a.origin() - b.origin();
        let size = shift.length() + a.origin().length();
        for q in receivers {
            let allowed = 0.5 * allowance(a.warp().excess())
                + 4.0 * f64::EPSILON * size * a.warp().ratio() / least
                + near_rounding(&one, &a).max(near_rounding(&two, &b));
            worst.note((ndc(&a, q) - ndc(&b, q + shift)).abs().max_element(), allowed, rule);
        }
    });
    worst.finish();
    assert!(used > 500, "{used}");
}

/// With axes of the light alone, no entry of the matrix jumps as the view turns through the light's
/// direction, nor through its opposite.
#[test]
fn fixed_axes_are_continuous_through_parallel() {
    let mut moved = Ratchet::new("fixed axes through parallel light");
    let mut least_change = f64::INFINITY;
    let strategy = (settled_direction(), inside(100.0), any::<bool>(), 1.0..60.0);
    check("through-parallel", CASES, strategy, |(to_light, eye, opposite, size)| {
        let across = to_light.any_orthonormal_vector();
        let up = to_light.cross(across);
        let sign = if opposite { -1.0 } else { 1.0 };
        let box_of_all = box_about(eye + sign * to_light * 20.0, DVec3::splat(size));
        let solve = |gamma: f64| {
            let forward = sign * to_light + across * gamma;
            let view = View::perspective(eye, forward, up, 1.2, 1.5, 0.5..40.0).unwrap();
            let scene = Scene::new(view, to_light, &[box_of_all], box_of_all);
            let scene = Scene { axes: Axes::LightFixed, ..scene };
            scene.fit().solve(Rule::default()).unwrap().clip_from_world_at(eye, ClipSpace::WGPU)
        };
        let change = |a: DMat4, b: DMat4| (a - b).to_cols_array().iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let at = solve(0.0);
        for exponent in 3..13 {
            let gamma = 10_f64.powi(-exponent);
            for gamma in [gamma, -gamma] {
                let step = change(solve(gamma), at);
                moved.note(step, 2.0 * gamma.abs() + 1e-13, gamma);
                if exponent == 3 {
                    least_change = least_change.min(step);
                }
            }
        }
    });
    moved.finish();
    assert!(least_change > 1e-9, "the view matters: {least_change:e}");
}

/// The row for linear depth: 0 at the casters, 1 at the receivers, from any origin.
#[test]
fn linear_depth_runs_from_casters_to_receivers() {
    let mut worst = Ratchet::new("linear depth");
    let near_depth = select(vec![NearDepth::Casters, NearDepth::Receivers]);
    each_kind("linear-depth", CASES, near_depth, |scene, _, near_depth| {
        let scene = Scene { near_depth, ..scene };
        let origin = scene.bodies.iter().find(|b| !b.is_empty()).map(Body::origin).unwrap();
        let row = scene.fit().linear_depth(origin).unwrap();
        let receivers = extent(scene.receivers(origin).iter().map(|q| row.dot(q.extend(1.0))));
        let casters = extent(scene.caster_points(origin).iter().map(|q| row.dot(q.extend(1.0))));
        let near = if near_depth == NearDepth::Casters { receivers[0].min(casters[0]) } else { receivers[0] };
        let map: ShadowMap = scene.fit().solve(Rule::Uniform).unwrap();
        let [x, y, z] = sizes(&scene.receivers(origin), &map);
        // A body that is flat along the light is fitted as if it were thicker.
        let thick = 1e-5 * x.max(z);
        if y > thick && !scene.is_edge_on() {
            // The casters count out to the rounding of the bodies.
            worst.note(near.abs().max((receivers[1] - 1.0).abs()), 5e-14, map);
        }
        worst.note((-near).max(receivers[1] - 1.0), 1e-14, map);
        // The uniform map's depth is linear, so it is the same row.
        let depth = map.clip_from_world_at(origin, ClipSpace::WGPU).row(2);
        let point = scene.receivers(origin)[0].extend(1.0);
        if y > thick {
            worst.note((row.dot(point) - depth.dot(point)).abs(), 1e-15 * (x.max(z) / y + 1.0), map);
        }
        let there = scene.view.eye();
        let from_eye = scene.fit().linear_depth(there).unwrap().dot((point.truncate() + origin - there).extend(1.0));
        let size = origin.length() + there.length() + 1e3;
        worst.note((from_eye - row.dot(point)).abs(), 1e-15 + f64::EPSILON * size / y.max(thick), map);
    });
    worst.finish();
}
