//! Values of perspective and trapezoidal maps, of spot lights, and of the middle vector.

use super::{Row, close, frustum, near, near_relative, numbers, vector};
use crate::random::measure::{Scene, box_about, project};
use crate::random::trapezoid::eight_matrices;
use shadow_warp::glam::{DVec2, DVec3, DVec4};
use shadow_warp::{
    Aim, Axes, Body, Bounds, ClipSpace, Light, NearDepth, PerspectiveRule, Rule, Sides, Slab, TrapezoidalRule, View,
    ViewAxis,
};

fn psm(aim: Aim, shift: f64) -> Rule {
    Rule::Perspective(PerspectiveRule { aim, shift })
}

/// A camera with these reciprocals of its tangents, and all that it sees.
fn camera(row: &Row, light: DVec3) -> Scene {
    frustum(DVec3::ZERO, [1.0 / row.input("cx"), 1.0 / row.input("cy")], row.input("n")..row.input("f"), light)
}

/// The light in OpenGL's clip space: with the point of the cube that is closest to it, it decides on the row of `w`.
pub(super) fn light_in_the_camera_space(row: &Row) {
    let l = vector(&row.0["inputs"]["l"]);
    let [n, f] = [row.input("n"), row.input("f")];
    let mut scene = camera(row, l);
    if row.input("w") > 0.0 {
        let forward = DVec3::new(0.0, 0.0, 1.0);
        scene.light = Light::spot(l, forward, 1.55, 1e-2, 1e4).unwrap();
    }
    let [x, y, z, w] = numbers(&row.0["output"]).try_into().unwrap();
    let (light, place) = (DVec3::new(x, y, z), DVec3::new(x, y, z) / w);
    let map = scene.fit().solve(Rule::PSM).unwrap();
    let closest = place.clamp(DVec3::NEG_ONE, DVec3::ONE);
    let aim = light - w * closest;
    let row = |p: DVec3| {
        let q = DVec3::new(row.input("cx") * p.x, row.input("cy") * p.y, ((f + n) * p.z - 2.0 * f * n) / (f - n));
        aim.dot(light * p.z - w * q)
    };
    let reference = DVec3::new(0.0, 0.0, n);
    for point in [DVec3::new(0.5, 0.25, 2.0), DVec3::new(3.0, -4.0, 30.0), DVec3::new(-20.0, 20.0, 90.0)] {
        near_relative(map.w(point) / map.w(reference), row(point) / row(reference), 1e-13);
    }
}

/// What does not depend on the axes across the light: `w`, its change with depth (`1/w` is linear in depth, by the
/// curvature `kappa` of the light), and depth.
pub(super) fn perspective_matrix(row: &Row) {
    let inputs = &row.0["inputs"];
    let mut scene = camera(row, vector(&inputs["l"]));
    scene.near_depth = NearDepth::Receivers;
    let map = scene.fit().solve(psm(Aim::Centre, 0.0)).unwrap();
    let expected = &row.0["output"];
    let ws = numbers(&expected["w_corners"]);
    let corners: Vec<_> = inputs["body"].as_array().unwrap().iter().map(vector).collect();
    for (corner, w) in corners.iter().zip(&ws) {
        near_relative(map.w(*corner) / map.w(corners[0]), w / ws[0], 1e-13);
    }
    let kappa = expected["kappa_L"].as_f64().unwrap();
    let matrix = map.clip_from_world_at(DVec3::ZERO, ClipSpace::WGPU);
    let depth = |p: DVec3| project(matrix * p.extend(1.0)).z;
    // h/w, by w/z = 1 - kappa h.
    let heights: Vec<_> =
        corners.iter().zip(&ws).map(|(corner, w)| (1.0 - w / corner.z) / kappa / (w / corner.z)).collect();
    let [low, high] = crate::random::measure::extent(heights.iter().copied());
    for (corner, height) in corners.iter().zip(&heights) {
        near(depth(*corner), (high - height) / (high - low), 1e-13, "depth of a corner");
    }
    for (probe, expected) in inputs["probe"].as_array().unwrap().iter().zip(expected["probe_ndc"].as_array().unwrap()) {
        near(depth(vector(probe)), vector(expected).z, 1e-14, "depth of a probe");
    }
}

pub(super) fn perspective_pole(row: &Row) {
    let [n, f, tangent, gamma] = ["n", "f", "tan_theta", "tan_gamma"].map(|name| row.input(name));
    for light in [DVec3::new(0.0, gamma, 1.0), DVec3::new(0.0, -gamma, -1.0)] {
        let scene = frustum(DVec3::ZERO, [tangent, tangent], n..f, light);
        let map = scene.fit().solve(psm(Aim::Centre, 0.0)).unwrap();
        let [at_near, at_far] = [n, f].map(|z| map.w(DVec3::Z * z));
        near_relative(n - (f - n) * at_near / (at_far - at_near), row.output(), 1e-13);
    }
}

/// By a camera so wide that its near plane alone counts.
pub(super) fn least_shift(row: &Row) {
    let inputs = &row.0["inputs"];
    let (eye, forward) = (vector(&inputs["e"]), vector(&inputs["v"]));
    let sides = Sides::centred(2e3, 2e3);
    let view = View::perspective_off_centre(eye, forward, DVec3::Y, sides, row.input("n")..100.0).unwrap();
    let points: Vec<_> = inputs["H"].as_array().unwrap().iter().map(vector).collect();
    let low = points.iter().fold(DVec3::MAX, |a, b| a.min(*b));
    let high = points.iter().fold(DVec3::MIN, |a, b| a.max(*b));
    let body: Body = Body::from_box(&Bounds::new(low, high).unwrap(), eye).unwrap();
    row.expect(PerspectiveRule::least_shift(&view, &body).unwrap());
}

/// `[E(z_n), E(z_f)]` of a camera moved back.
pub(super) fn shifted_error(row: &Row) {
    let [n, f] = [row.input("zn"), row.input("zf")];
    let scene = frustum(DVec3::ZERO, [0.5, 0.25], n..f, DVec3::Y);
    let map = scene.fit().solve(psm(Aim::Closest, row.input("D"))).unwrap();
    for (z, expected) in [n, f].into_iter().zip(row.outputs()) {
        near_relative(map.texel_extent(DVec3::Z * z)[1] * f64::from(map.size()[1]) * n / z, expected, 1e-13);
    }
}

fn excess(t: f64, line: f64) -> f64 {
    let slab = Slab { near: 0.0, far: 1.0, extent: 1.0, sin_gamma: 1.0 };
    TrapezoidalRule { focus: 1.0, line, fade: true }.excess(&slab, &ViewAxis { t: [0.0, t], w: [1.0, 0.0] })
}

/// `eta`, or its reciprocal over `lambda`, near the uniform map with the rounding of `delta'/lambda` itself.
pub(super) fn trapezoid(row: &Row) {
    let t = row.input("dp") / row.input("lam");
    if row.has("xi") {
        near_relative(row.input("lam") / excess(t, 0.5 * (1.0 - row.input("xi"))), row.output(), 4e-15);
    } else {
        near_relative(excess(t, row.input("S")), row.output(), 2e-11);
    }
}

pub(super) fn focus_of_lispsm(row: &Row) {
    let [n, f] = [row.input("zn"), row.input("zf")];
    near_relative(1.0 + excess(row.output(), 0.8), (f / n).sqrt(), 4e-15);
    let scene = frustum(DVec3::ZERO, [0.5, 0.25], n..f, DVec3::Y);
    let rule = TrapezoidalRule { focus: row.output(), ..TrapezoidalRule::default() };
    let [a, b] = [Rule::Trapezoidal(rule), Rule::LISPSM].map(|rule| scene.fit().solve(rule).unwrap().warp().ratio());
    near_relative(a, b, 4e-15);
}

/// The eight matrices that other tests compare maps with.
pub(super) fn eight_steps(row: &Row) {
    let corner = |name: &str| DVec2::from_slice(&numbers(&row.0["inputs"][name]));
    let t = ["t0", "t1", "t2", "t3"].map(corner);
    let found = eight_matrices(t);
    let found = found * (1.0 / (found * t[3].extend(1.0)).z);
    for (i, expected) in row.0["output"].as_array().unwrap().iter().enumerate() {
        near((found.row(i) - vector(expected)).length(), 0.0, 2e-15, format!("row {i}"));
    }
}

/// The row's light matrix is that of a lamp at (4, 48, 40) that shines down from 8 to 128.
pub(super) fn spot_matrix(row: &Row) {
    let [n, f] = [row.input("zn"), row.input("zf")];
    let mut scene = frustum(DVec3::ZERO, [0.5, 0.25], n..f, DVec3::Y);
    scene.light = Light::spot(DVec3::new(4.0, 48.0, 40.0), DVec3::NEG_Y, 1.3, 8.0, 128.0).unwrap();
    let map = scene.fit().solve(Rule::OnAxis).unwrap();
    let expected = &row.0["output"];
    near_relative(map.warp().excess(), expected["eta"].as_f64().unwrap(), 1e-14);
    let rows: Vec<_> = expected["M"].as_array().unwrap().iter().map(|r| DVec4::from_slice(&numbers(r))).collect();
    let matrix = map.clip_from_world_at(DVec3::ZERO, ClipSpace::WGPU);
    let scale = rows[3].length() / matrix.row(3).length();
    // X may run the other way.
    let across = (matrix.row(0).dot(rows[0])).signum();
    for (i, expected) in rows.iter().enumerate() {
        let sign = if i == 0 { across } else { 1.0 };
        near((matrix.row(i) * (scale * sign) - *expected).length() / expected.length(), 0.0, 1e-14, format!("row {i}"));
    }
    let inputs = &row.0["inputs"];
    for (probe, expected) in inputs["probe"].as_array().unwrap().iter().zip(expected["probe_ndc"].as_array().unwrap()) {
        let place = project(matrix * vector(probe).extend(1.0)) * DVec3::new(across, 1.0, 1.0);
        near((place - vector(expected)).length(), 0.0, 1e-14, "probe");
    }
}

/// From the axes of maps for boxes that are the row's points, under two lights.
pub(super) fn middle_vector(row: &Row) {
    let inputs = &row.0["inputs"];
    let eye = vector(&inputs["C"]);
    let points: Vec<_> = inputs["B"].as_array().unwrap().iter().map(vector).collect();
    let boxes: Vec<_> = points.iter().map(|p| Bounds::new(*p, *p).unwrap()).collect();
    let view = View::perspective_off_centre(eye, DVec3::Z, DVec3::Y, Sides::centred(4.0, 4.0), 0.5..100.0).unwrap();
    let all = box_about(eye, DVec3::splat(100.0));
    let across = |light: DVec3| {
        let mut scene = Scene::new(view, light, &boxes, all);
        scene.axes = Axes::Middle;
        let space = scene.fit().solve(Rule::Uniform).unwrap().light_space();
        space.x * space.sin_gamma
    };
    // m x Y = (-m_z, 0, m_x), m x X = (0, m_z, -m_y).
    let [by_y, by_x] = [DVec3::Y, DVec3::X].map(across);
    let expected = numbers(&row.0["output"]);
    close(by_y.z, expected[0], "x");
    close(-by_x.z, expected[1], "y");
    close(-by_y.x, expected[2], "z");
    close(by_x.y, expected[2], "z");
}
