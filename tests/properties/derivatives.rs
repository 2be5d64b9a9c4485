//! Closed forms against the derivative of the matrix, and against dense sampling.

use crate::CASES;
use crate::random::Ratchet;
use crate::random::basic::{Mixture, mixture};
use crate::random::measure::{Scene, extent, ndc, sizes, world_rounding};
use crate::random::scenes::{each_kind, rule};
use proptest::prelude::*;
use shadow_warp::aliasing::pixels_per_texel;
use shadow_warp::glam::{DMat2, DVec2, DVec3};
use shadow_warp::{Axes, ClipSpace, ShadowMap};

/// As `scenes::each_map`, with some axes, and with a point of the receivers.
fn each_map(name: &str, axes: Axes, mut property: impl FnMut(&Scene, &ShadowMap, &[DVec3], Mixture)) {
    each_kind(name, CASES, (rule(), mixture()), |scene, _, (rule, q)| {
        let scene = Scene { axes, ..scene };
        let map = scene.fit().solve(rule).unwrap();
        property(&scene, &map, &scene.receivers(map.origin()), q);
    });
}

/// LSP-18: `ds/dz = density/d`, by a central difference.
#[test]
fn density_along_the_warp() {
    let mut worst = Ratchet::new("LSP-18");
    each_map("LSP-18", Axes::View, |_, map, receivers, q| {
        let z = map.light_space().z;
        let [z0, z1] = extent(receivers.iter().map(|p| z.dot(*p)));
        let d = z1 - z0;
        let [across, height, _] = sizes(receivers, map);
        let eta = map.warp().excess();
        if d < 1e-4 * across.max(height) || eta > 1e4 {
            return;
        }
        let q = q.of(receivers);
        let t = ((z.dot(q) - z0) / d).clamp(0.0, 1.0);
        // A step of 1e-5 of the distance to where w vanishes.
        let step = 1e-5 * (t + 1.0 / eta.max(1.0));
        let [after, before] = [q + z * (step * d), q - z * (step * d)].map(|p| 0.5 * (ndc(map, p).y + 1.0));
        let slope = (after - before) / (2.0 * step);
        worst.note((slope / map.warp().density(t) - 1.0).abs(), 1.5e-10 + 1e-10 * eta, (map, t));
    });
    worst.finish();
}

/// The derivative of the map's plane by the place in light space, from the matrix alone; inverted:
/// how far a step of one texel along each of the map's axes goes along light space's x and z.
fn texel_steps(map: &ShadowMap, q: DVec3) -> [DVec2; 2] {
    let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
    let [x, y, w] = [0, 1, 3].map(|i| matrix.row(i));
    let at = matrix * q.extend(1.0);
    let by = |axis: DVec3| {
        let along = axis.extend(0.0);
        DVec2::new(x.dot(along) - at.x / at.w * w.dot(along), y.dot(along) - at.y / at.w * w.dot(along)) / at.w
    };
    let space = map.light_space();
    let inverse = DMat2::from_cols(by(space.x), by(space.z)).inverse();
    let [width, height] = map.size().map(f64::from);
    [inverse.x_axis * (2.0 / width), inverse.y_axis * (2.0 / height)]
}

/// With axes of the view a step in x stays across, and a step in y goes along and, by the shear,
/// across.
#[test]
fn texel_extent_is_the_derivative() {
    let mut worst = Ratchet::new("texel extent");
    let mut sheared = 0;
    each_map("texel-extent", Axes::View, |scene, map, receivers, q| {
        let eta = map.warp().excess();
        let [across, height, along] = sizes(receivers, map);
        if across.min(along) < 1e-4 * across.max(height).max(along) || eta > 1e4 {
            return;
        }
        let q = q.of(receivers);
        let [extent_x, extent_y] = map.texel_extent(q + map.origin());
        let [step_x, step_y] = texel_steps(map, q);
        let space = map.light_space();
        let world = 1e3 * f64::EPSILON * eta / along;
        let allowed = 1e-11 + world;
        worst.note((step_x.x.abs() / extent_x - 1.0).abs(), allowed, map);
        worst.note(step_x.y.abs() / extent_x, allowed, map);
        worst.note((step_y.y.abs() / extent_y - 1.0).abs(), allowed, map);
        let [low, high] = extent(receivers.iter().map(|p| space.x.dot(*p)));
        let offset = space.x.dot(q) - space.x.dot(scene.view.eye() - map.origin()).clamp(low, high);
        let shear = offset * eta / along * step_y.y / map.w(q + map.origin());
        worst.note((step_y.x - shear).abs() / step_y.length(), allowed, map);
        sheared += usize::from(shear.abs() > 0.1 * step_y.y.abs());
    });
    worst.finish();
    assert!(sheared > 100, "{sheared}");
}

/// With axes of the light alone each step goes askew. Its part along the warp, and its part across
/// without the shear (the offset from the middle of the receivers' rectangle times the slope of w),
/// are the two parts of the closed form.
#[test]
fn texel_extent_of_fixed_axes_is_the_derivative() {
    let mut worst = Ratchet::new("texel extent, fixed axes");
    let mut askew = 0;
    each_map("texel-extent-fixed", Axes::LightFixed, |_, map, receivers, q| {
        let eta = map.warp().excess();
        let space = map.light_space();
        let axes = space.fixed_axes();
        let middle =
            axes.map(|a| (a, extent(receivers.iter().map(|p| a.dot(*p))))).map(|(a, [l, h])| a * (0.5 * (l + h)));
        let [across, height, along] = sizes(receivers, map);
        if across.min(along) < 1e-3 * across.max(height).max(along) || eta > 1e3 {
            return;
        }
        let q = q.of(receivers);
        let w = map.w(q + map.origin());
        let offset = space.x.dot(q - middle[0] - middle[1]);
        let closed = map.texel_extent(q + map.origin());
        for (step, closed) in texel_steps(map, q).into_iter().zip(closed) {
            let shear = offset * eta / along * step.y / w;
            let parts = DVec2::new(step.x - shear, step.y);
            let allowed = (1e-11 + 4e2 * f64::EPSILON * eta / along) * (1.0 + step.length() / closed);
            worst.note((parts.length() / closed - 1.0).abs(), allowed, map);
            askew += usize::from(parts.x.abs().min(parts.y.abs()) > 0.1 * closed);
        }
    });
    worst.finish();
    assert!(askew > 100, "{askew}");
}

/// No point of the receivers is worse than the worst, and one of their vertices is as bad.
#[test]
fn worst_texel_bounds_every_sample() {
    let mut at_vertex = Ratchet::new("worst texel at a vertex");
    let more = (rule(), any::<bool>(), prop::array::uniform12(mixture()));
    each_kind("worst-texel", CASES, more, |scene, _, (rule, is_fixed, points)| {
        let scene = Scene { axes: if is_fixed { Axes::LightFixed } else { Axes::View }, ..scene };
        let fit = scene.fit();
        let map = fit.solve(rule).unwrap();
        let worst = fit.worst_texel(&map);
        let at = |p: DVec3| pixels_per_texel(&map, &scene.view, fit.viewport, p);
        let slack = |p: DVec3| 2e-16 + 0.5 * world_rounding(&map, &scene, p);
        let vertices = scene.receivers(DVec3::ZERO);
        let (attained, rounding) =
            vertices.iter().map(|p| (at(*p), slack(*p))).fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a });
        at_vertex.note((attained / worst - 1.0).abs(), rounding, map);
        for body in scene.bodies.iter().filter(|body| !body.is_empty()) {
            for q in &points {
                let p = q.of(body.vertices()) + body.origin();
                assert!(at(p) <= worst * (1.0 + slack(p)), "{p} {} {worst}", at(p));
            }
        }
    });
    at_vertex.finish();
}
