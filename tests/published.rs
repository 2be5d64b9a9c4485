//! Values of the papers' formulas, with their misprints mended, against the public functions.
//!
//! `tests/data/values.json` holds exact inputs and the nearest f64 to a result with 50 digits. Every row has a check
//! here.

#![expect(clippy::unwrap_used, reason = "a row that does not have its fields is a broken test")]
#![expect(clippy::disallowed_methods, reason = "tests may call what the library must not")]

mod random;
#[path = "published/rules.rs"]
mod rules;

use random::measure::{Scene, box_about, project};
use serde_json::Value;
use shadow_warp::glam::{DVec3, DVec4};
use shadow_warp::{
    Body, ClipSpace, Filter, Fit, Light, LightSpace, LightSpaceRule, NearDepth, Rule, ShadowMap, Sides, Slab, View,
    Warp, vertex_depth_error,
};

type Check = fn(&Row);

const CHECKS: [(&str, Check); 38] = [
    ("lispsm.eq2.s.hard_ratio", place),
    ("lispsm.eq2.s.n_inf", place),
    ("lispsm.dsdz", density),
    ("lispsm.eq3.b", error),
    ("lispsm.eq3.psm", error),
    ("lispsm.nopt.1_100", best_near_distance),
    ("lispsm.nopt.1_400", best_near_distance),
    ("lispsm.emax", greatest_error),
    ("lispsm.elog", mean_error),
    ("lispsm.eta_opt", best_excess),
    ("lispsm.dpdt.exact", error_across),
    ("lispsm.general_edge", slanted_edge),
    ("warp.odds", odds),
    ("warp.kappa_ndc", kappa),
    ("tilt.eta.dz", extent_rule),
    ("tilt.eta.scherzer_literal", depth_rule),
    ("tilt.eta.sample_k2", damped_rule),
    ("tilt.eta.dz.tiniest", extent_rule),
    ("tilt.eta.minimax.60", best_on_axis),
    ("tilt.eta.minimax.10", best_on_axis),
    ("basis.neg", axes),
    ("warp.wgrad", w_gradient),
    ("lispsm.matrix.tilt", matrix),
    ("lispsm.matrix.far_world", matrix),
    ("bias.facing", bias),
    ("bias.chord", chord),
    ("psm.light.dir_behind", rules::light_in_the_camera_space),
    ("psm.light.pt_behind", rules::light_in_the_camera_space),
    ("psm.matrix.behind", rules::perspective_matrix),
    ("psm.pole", rules::perspective_pole),
    ("psm.shift", rules::least_shift),
    ("psm.shift.error", rules::shifted_error),
    ("tsm.eta", rules::trapezoid),
    ("tsm.omega", rules::trapezoid),
    ("tsm.lispsm_equiv", rules::focus_of_lispsm),
    ("tsm.8step", rules::eight_steps),
    ("spot.matrix", rules::spot_matrix),
    ("scherzer.middle", rules::middle_vector),
];

struct Row(Value);

impl Row {
    fn input(&self, name: &str) -> f64 {
        self.0["inputs"][name].as_f64().unwrap()
    }

    fn has(&self, name: &str) -> bool {
        !self.0["inputs"][name].is_null()
    }

    fn output(&self) -> f64 {
        self.0["output"].as_f64().unwrap()
    }

    fn outputs(&self) -> Vec<f64> {
        numbers(&self.0["output"])
    }

    #[track_caller]
    fn expect(&self, value: f64) {
        close(value, self.output(), &self.0["id"]);
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn vector(value: &Value) -> DVec3 {
    DVec3::from_slice(&numbers(value))
}

/// To four roundings.
#[track_caller]
fn close(value: f64, expected: f64, what: impl std::fmt::Display) {
    let deviation = (value / expected - 1.0).abs();
    assert!(deviation <= 4.0 * f64::EPSILON, "{what}: {value} is not {expected}, off by {deviation:e}");
}

/// To so much of 1.
#[track_caller]
fn near(value: f64, expected: f64, allowed: f64, what: impl std::fmt::Display) {
    let deviation = (value - expected).abs();
    assert!(deviation <= allowed, "{what}: {value} is not {expected}, off by {deviation:e}");
}

#[test]
fn every_row_has_a_check_and_holds() {
    let rows: Vec<Value> = serde_json::from_str(include_str!("data/values.json")).unwrap();
    let mut checked = Vec::new();
    for row in rows {
        let id = row["id"].as_str().unwrap().to_owned();
        let check = CHECKS.iter().find(|(name, _)| *name == id);
        assert!(check.is_some(), "no check for row {id}");
        (check.unwrap().1)(&Row(row));
        assert!(!checked.contains(&id), "row {id} stands twice");
        checked.push(id);
    }
    assert_eq!(checked.len(), CHECKS.len(), "a check has no row");
}

fn warp(n: f64, d: f64) -> Warp {
    Warp::new(d / n).unwrap()
}

/// LiSPSM, Eq. 2, with the sign mended.
fn place(row: &Row) {
    let (u, d) = (row.input("u"), row.input("d"));
    let warp = if row.has("n") { warp(row.input("n"), d) } else { Warp::UNIFORM };
    row.expect(warp.map_from_body(u / d));
    near(warp.body_from_map(row.output()), u / d, 2e-16, "inverse");
}

fn density(row: &Row) {
    let d = row.input("d");
    let t = (row.input("z") - row.input("zn")) / d;
    row.expect(warp(row.input("n"), d).density(t) / d);
}

/// LiSPSM, Eq. 3: `dp/ds = (z_n/z) dz/ds`; the near distance of the warp is the camera's for PSM.
fn error_at(warp: Warp, near: f64, far: f64, z: f64) -> f64 {
    let d = far - near;
    near / z * d / warp.density((z - near) / d)
}

fn error(row: &Row) {
    let (near, far) = (row.input("zn"), row.input("zf"));
    let n = if row.has("n") { row.input("n") } else { near };
    row.expect(error_at(warp(n, far - near), near, far, row.input("z")));
}

fn head_on(row: &Row) -> Slab {
    let (near, far) = (row.input("zn"), row.input("zf"));
    Slab { near, far, extent: far - near, sin_gamma: 1.0 }
}

const ALL_RULES: [LightSpaceRule; 4] = random::measure::LIGHT_SPACE_RULES;

/// LiSPSM, Sec. 4.3: `n = z_n + sqrt(z_n z_f)`, by all four rules.
fn best_near_distance(row: &Row) {
    let slab = head_on(row);
    for rule in ALL_RULES {
        row.expect(slab.extent / rule.excess(&slab));
    }
}

fn greatest_error(row: &Row) {
    let slab = head_on(row);
    let warp = Warp::new(LightSpaceRule::Damped.excess(&slab)).unwrap();
    for z in [slab.near, slab.far] {
        row.expect(error_at(warp, slab.near, slab.far, z));
    }
}

/// The constant error of the logarithmic map, `z_n ln(z_f/z_n)`, is the mean over the map of every warp's error.
fn mean_error(row: &Row) {
    let (near, far) = (row.input("zn"), row.input("zf"));
    for eta in [3.0, (far / near).sqrt() - 1.0, 200.0] {
        let warp = Warp::new(eta).unwrap();
        let at = |s: f64| error_at(warp, near, far, near + (far - near) * warp.body_from_map(s));
        // Simpson's rule.
        let steps = 40_000;
        let weight = |i: u32| if i == 0 || i == steps { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
        let sum: f64 = (0..=steps).map(|i| weight(i) * at(f64::from(i) / f64::from(steps))).sum();
        near_relative(sum / (3.0 * f64::from(steps)), row.output(), 1e-9);
    }
}

/// `[eta, rho, kappa]`.
fn best_excess(row: &Row) {
    let expected = row.outputs();
    for rule in ALL_RULES {
        let warp = Warp::new(rule.excess(&head_on(row))).unwrap();
        close(warp.excess(), expected[0], "eta");
        close(warp.ratio(), expected[1], "rho");
        close(warp.excess() / (2.0 + warp.excess()), expected[2], "kappa");
    }
}

/// A camera along z at a point, with tangents up to 3/4, and a box that holds all it sees.
fn frustum(eye: DVec3, tangents: [f64; 2], depth: std::ops::Range<f64>, to_light: DVec3) -> Scene {
    let sides = Sides::centred(2.0 * tangents[0], 2.0 * tangents[1]);
    let all = box_about(eye, DVec3::splat(depth.end));
    let view = View::perspective_off_centre(eye, DVec3::Z, DVec3::Y, sides, depth).unwrap();
    let mut scene = Scene::new(view, to_light, &[all], all);
    scene.near_depth = NearDepth::Receivers;
    scene
}

/// LiSPSM, Sec. 4.3, across the warp, with its constants.
fn error_across(row: &Row) {
    let (near, far, z) = (row.input("zn"), row.input("zf"), row.input("z"));
    let scene = frustum(DVec3::ZERO, [row.input("tan_x"), 0.25], near..far, DVec3::Y);
    let map = scene.fit().solve(Rule::LISPSM).unwrap();
    let across = map.texel_extent(DVec3::Z * z)[0] * f64::from(map.size()[0]);
    near_relative(across * near / z, row.output(), 1e-13);
}

#[track_caller]
fn near_relative(value: f64, expected: f64, allowed: f64) {
    near(value / expected, 1.0, allowed, "ratio");
}

/// LiSPSM, Sec. 4.5: the picture of the edge `y = k z - y_0` moves by `z_n y_0/z^2` per depth.
fn slanted_edge(row: &Row) {
    let (near, z) = (row.input("zn"), row.input("z"));
    let view = frustum(DVec3::ZERO, [1.0, 1.0], near..100.0, DVec3::Y).view;
    let scale = |z: f64| view.pixels_per_unit([800, 800], z) / view.pixels_per_unit([800, 800], near);
    let picture = |z: f64| (row.input("k") * z - row.input("y0")) * scale(z);
    let step = 1e-4;
    near_relative((picture(z + step) - picture(z - step)) / (2.0 * step), row.output(), 1e-9);
}

fn odds(row: &Row) {
    row.expect(Warp::new(row.input("eta")).unwrap().map_from_body(row.input("t")));
}

fn kappa(row: &Row) {
    let s = Warp::new(row.input("eta")).unwrap().map_from_body(0.5 + 0.5 * row.input("tau"));
    row.expect(2.0 * s - 1.0);
}

fn tilted(row: &Row) -> Slab {
    Slab { near: row.input("zn"), far: 100.0, extent: row.input("d"), sin_gamma: row.input("s") }
}

fn extent_rule(row: &Row) {
    row.expect(LightSpaceRule::Extent.excess(&tilted(row)));
}

fn depth_rule(row: &Row) {
    row.expect(LightSpaceRule::Depth.excess(&tilted(row)));
}

fn damped_rule(row: &Row) {
    row.expect(LightSpaceRule::Damped.excess(&tilted(row)));
}

/// The extents of a frustum along a tilted light's z axis, and the excess with the least worst error on the view axis:
/// its neighbours are worse.
fn best_on_axis(row: &Row) {
    let (near_depth, far, tangent, gamma) = (row.input("zn"), row.input("zf"), row.input("T"), row.input("gamma"));
    let expected = row.outputs();
    let to_light = DVec3::new(0.0, gamma.sin(), gamma.cos());
    let scene = frustum(DVec3::ZERO, [tangent, tangent], near_depth..far, to_light);
    let solve = |eta: f64| scene.fit().solve(Rule::Explicit(Warp::new(eta).unwrap())).unwrap();
    let map = solve(expected[2]);
    let [z0, z1] = scene.bodies[0].bounds_along(map.light_space().z).unwrap();
    near_relative(z0 + map.light_space().z.dot(scene.bodies[0].origin()), expected[0], 1e-14);
    near_relative(z1 - z0, expected[1], 1e-14);
    let worst = |map: &ShadowMap| {
        let at = |z: f64| map.texel_extent(DVec3::Z * z)[1] / z;
        at(near_depth).max(at(far))
    };
    let best = worst(&map);
    for step in [1e-6, 1e-3, 0.1, 0.5] {
        for eta in [expected[2] * (1.0 + step), expected[2] * (1.0 - step)] {
            assert!(worst(&solve(eta)) > best, "{eta}");
        }
    }
    for rule in ALL_RULES {
        assert!(worst(&scene.fit().solve(Rule::LightSpace(rule)).unwrap()) >= best);
    }
    near_relative(scene.fit().solve(Rule::OnAxis).unwrap().warp().excess(), expected[2], 1e-13);
}

fn light_space(row: &Row) -> LightSpace {
    let [l, v] = ["l", "v"].map(|name| vector(&row.0["inputs"][name]));
    let view = View::perspective(DVec3::ZERO, v, DVec3::new(0.1, 0.2, 0.9), 1.0, 1.0, 1.0..2.0).unwrap();
    LightSpace::new(&view, &Light::directional(l).unwrap()).unwrap()
}

fn axes(row: &Row) {
    let space = light_space(row);
    let expected = &row.0["output"];
    for (axis, name) in [(space.x, "X"), (space.y, "Y"), (space.z, "Z")] {
        near((axis - vector(&expected[name])).length(), 0.0, 4e-16, name);
    }
    close(space.sin_gamma, expected["sin_gamma"].as_f64().unwrap(), "sin gamma");
}

fn w_gradient(row: &Row) {
    let space = light_space(row);
    let (near_depth, d) = (row.input("zn"), row.input("d"));
    let slab = Slab { near: near_depth, far: 1e3, extent: d, sin_gamma: space.sin_gamma };
    let gradient = space.z * (LightSpaceRule::Extent.excess(&slab) / d);
    near((gradient - DVec3::from_slice(&row.outputs())).length() / gradient.length(), 0.0, 6e-16, "gradient");
}

/// A whole matrix. Its depth row alone tells whether the warp projects about the middle height.
fn matrix(row: &Row) {
    let inputs = &row.0["inputs"];
    let expected = &row.0["output"];
    let eye = vector(&inputs["eye"]);
    let scene = frustum(eye, [0.75, 0.5], row.input("zn")..64.0, vector(&inputs["l"]));
    let body = &scene.bodies[0];
    for corner in inputs["body"].as_array().unwrap() {
        let corner = vector(corner) - eye;
        assert!(vertices(body, eye).any(|v| v.distance(corner) < 1e-14 * corner.length()), "{corner}");
    }
    let map = scene.fit().solve(Rule::LightSpace(LightSpaceRule::Extent)).unwrap();
    near_relative(map.warp().excess(), expected["eta"].as_f64().unwrap(), 1e-15);
    near_relative(map.light_space().sin_gamma, expected["sin_gamma"].as_f64().unwrap(), 1e-15);
    let z = map.light_space().z;
    let [z0, z1] = body.bounds_along(z).unwrap().map(|end| end + z.dot(body.origin() - eye));
    near_relative(z0, expected["z0"].as_f64().unwrap(), 1e-14);
    near_relative(z1 - z0, expected["d"].as_f64().unwrap(), 1e-15);
    let extents = numbers(&expected["X0X1Y0Y1"]);
    let unit = map.texel_extent(eye + z * z0)[0] * f64::from(map.size()[0]);
    near_relative(unit, extents[1] - extents[0], if eye == DVec3::ZERO { 1e-14 } else { 1e-8 });

    let relative = map.clip_from_world_at(eye, ClipSpace::WGPU);
    for (i, expected) in expected["M"].as_array().unwrap().iter().enumerate() {
        for (entry, expected) in relative.row(i).to_array().into_iter().zip(numbers(expected)) {
            near(entry, expected, 2e-15, format!("row {i}"));
        }
    }
    let probes = inputs["probe"].as_array().unwrap().iter().zip(expected["probe_ndc"].as_array().unwrap());
    for (probe, expected) in probes {
        let ndc = project(relative * (vector(probe) - eye).extend(1.0));
        near(ndc.distance(vector(expected)), 0.0, 2e-15, "probe");
    }
}

fn vertices(body: &Body, eye: DVec3) -> impl Iterator<Item = DVec3> + '_ {
    body.vertices().iter().map(move |v| *v + (body.origin() - eye))
}

/// A box of the row's extents, seen whole from before it, under light from above; the map's axes and its depth range
/// follow from it.
fn bias(row: &Row) {
    let expected = |name: &str| row.0["output"][name].as_f64().unwrap();
    let (z0, d, k_y) = (row.input("z0"), row.input("d"), row.input("ky"));
    let middle = DVec3::new(row.input("px"), row.input("py"), z0 + 0.5 * d);
    let half = DVec3::new(2.0, 0.5 / k_y, 0.5 * d);
    let all = box_about(middle, half);
    let eye = middle.with_z(-100.0);
    let view = View::perspective_off_centre(eye, DVec3::Z, DVec3::Y, Sides::centred(1.0, 1.0), 1.0..200.0).unwrap();
    let mut scene = Scene::new(view, DVec3::Y, &[all], all);
    scene.near_depth = NearDepth::Receivers;
    let [width, height] = [2.0 * half.x / row.input("dX"), 1.0 / row.input("ds")];
    let fit = Fit { map_size: [width as u32, height as u32], ..scene.fit() };
    let map = fit.solve(Rule::Explicit(Warp::new(row.input("eta")).unwrap())).unwrap();

    let point = DVec3::new(row.input("x"), row.input("y"), row.input("z"));
    let normal = DVec3::new(-row.input("a"), 1.0, -row.input("b"));
    close(map.w(point), expected("w"), "w");
    // The row's s grows away from the eye, as OpenGL's v does; X grows with light space's x.
    let space = ClipSpace::OPENGL;
    let slope = map.depth_slope(space, point, normal).unwrap();
    near(slope[0], expected("dD_dX") * row.input("dX"), 1e-18, "across");
    near_relative(slope[1], expected("dD_ds") * row.input("ds"), 1e-14);
    let filter = Filter::Bilinear(1);
    close(filter.reach(), row.input("reach"), "reach");
    let bias = filter.least_bias(slope);
    near_relative(bias, expected("min_bias_depth"), 1e-14);
    near_relative(map.length_of_bias(space, point, bias).unwrap(), expected("min_bias_world_hyp"), 1e-14);
    close(map.length_of_bias(space, point, 0.25).unwrap(), 0.25 * expected("world_per_depth"), "length");
    // In world units: the height itself, downwards.
    let slope = map.linear_depth_slope(space, DVec4::new(0.0, -1.0, 0.0, 0.0), point, normal).unwrap();
    near(slope[0], expected("dy_dX") * row.input("dX"), 1e-18, "across");
    near(slope[1], expected("dy_ds") * row.input("ds"), 1e-18, "along");
    near(filter.least_bias(slope), expected("min_bias_world_lin"), 1e-18, "bias");
}

fn chord(row: &Row) {
    row.expect(vertex_depth_error(row.input("rho")).unwrap());
}
