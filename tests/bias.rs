//! Depth slopes and least biases, against derivatives of the matrix and against brute force over a
//! filter's texels.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]
#![expect(clippy::float_cmp, reason = "what is compared is exact")]
#![expect(clippy::disallowed_methods, reason = "tests may call what the library must not")]

mod random;

#[path = "bias/filters.rs"]
mod filters;

use approx::assert_relative_eq;
use proptest::prelude::*;
use proptest::sample::select;
use random::basic::{inside, log_between, mixture};
use random::lamps::each_lamp;
use random::measure::{Scene, box_about, lit, product_rounding, project, rounding};
use random::scenes::each_map;
use random::{Ratchet, check};
use shadow_warp::glam::{DMat2, DMat3, DVec2, DVec3, DVec4};
use shadow_warp::{
    Axes, ClipSpace, DepthFormat, Error, Filter, Fit, Light, NearDepth, Rule, ShadowMap, Sides, View, Warp,
    vertex_depth_error,
};

/// How many maps of each class.
const CASES: u32 = 200;
const SPACES: [ClipSpace; 5] = [
    ClipSpace::WGPU,
    ClipSpace::VULKAN,
    ClipSpace::OPENGL,
    ClipSpace::WGPU.reversed(),
    ClipSpace::OPENGL_ZERO_TO_ONE.reversed(),
];
const FILTERS: [Filter; 6] = [
    Filter::Nearest(1),
    Filter::Nearest(3),
    Filter::Nearest(4),
    Filter::Bilinear(1),
    Filter::Bilinear(2),
    Filter::Bilinear(3),
];

fn space() -> impl Strategy<Value = ClipSpace> + Clone {
    select(SPACES.to_vec())
}

/// Column and row in texels, and stored depth, of a point relative to the map's origin.
fn place(map: &ShadowMap, space: ClipSpace, q: DVec3) -> DVec3 {
    let [width, height] = map.size().map(f64::from);
    project(map.texture_from_world_at(map.origin(), space) * q.extend(1.0)) * DVec3::new(width, height, 1.0)
}

/// Where the ray of a place in the map, in texels, meets the plane through `q`: by solving for the
/// point.
fn on_plane(map: &ShadowMap, space: ClipSpace, [column, row]: [f64; 2], q: DVec3, normal: DVec3) -> DVec3 {
    let [width, height] = map.size().map(f64::from);
    let m = map.texture_from_world_at(map.origin(), space);
    let [x, y] = [m.row(0) - m.row(3) * (column / width), m.row(1) - m.row(3) * (row / height)];
    // Rows of one size, for the inverse's sake.
    let [x, y] = [x, y].map(|row| row / row.truncate().length());
    let rows = DMat3::from_cols(x.truncate(), y.truncate(), normal).transpose();
    let first = rows.inverse() * DVec3::new(-x.w, -y.w, normal.dot(q));
    // Once more from there, for the rounding.
    let miss = |row: DVec4| row.truncate().dot(first) + row.w;
    first - rows.inverse() * DVec3::new(miss(x), miss(y), normal.dot(first - q))
}

/// A receiver, relative to the map's origin, that its position in world space still tells.
fn settled(q: DVec3, map: &ShadowMap) -> DVec3 {
    (q + map.origin()) - map.origin()
}

/// How far the rounding of a world position moves a receiver, as a share of the map, times `w`.
fn world_rounding(map: &ShadowMap, q: DVec3) -> f64 {
    let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
    let steep = [0, 1, 2, 3].map(|i| matrix.row(i).truncate().length()).into_iter().fold(0.0, f64::max);
    4.0 * f64::EPSILON * (q.length() + map.origin().length()) * steep
}

/// A normal, as its light has it.
#[derive(Clone, Copy, Debug)]
struct Normal {
    turn: f64,
    tilt: f64,
    length: f64,
}

impl Normal {
    fn of(self, map: &ShadowMap) -> DVec3 {
        let space = map.light_space();
        (space.y + (space.x * self.turn.cos() + space.z * self.turn.sin()) * self.tilt) * self.length
    }
}

/// A normal at most some 84 degrees from the light, to either side; sometimes exactly along it.
fn tilted() -> impl Strategy<Value = Normal> + Clone {
    let tilt = prop_oneof![1 => Just(0.0), 4 => log_between(1e-3, 10.0)];
    let length = prop_oneof![log_between(1e-3, 1e3), Just(-1.0)];
    (0.0..core::f64::consts::TAU, tilt, length).prop_map(|(turn, tilt, length)| Normal { turn, tilt, length })
}

/// The slopes in a plane by central differences of the matrix along two lines in it, of hyperbolic
/// depth and of the linear one. Along a line the differences of all fractions over `w` have one
/// common factor, so that those of depth are exact but for rounding; those of linear depth lack the
/// factor, `1/(1 - part^2)` for the returned part by which `w` changes.
fn differences(
    map: &ShadowMap,
    space: ClipSpace,
    linear: DVec4,
    q: DVec3,
    normal: DVec3,
    step: f64,
) -> ([DVec2; 2], f64) {
    let light = map.light_space();
    let axes = [light.x, light.z];
    let [width, height] = map.size().map(f64::from);
    let [across, along] = map.texel_extent(q + map.origin());
    let scales = [step * width * across, step * height * along];
    let mut part = 0.0_f64;
    let ends = [0, 1].map(|i| {
        // Lifted along the light into the plane.
        let line = (axes[i] - light.y * (normal.dot(axes[i]) / normal.dot(light.y))) * scales[i];
        let [after, before] = [q + line, q - line].map(|p| (place(map, space, p), linear.dot(p.extend(1.0))));
        part = part.max((map.w(map.origin() + q + line) / map.w(map.origin() + q) - 1.0).abs());
        (after.0 - before.0, after.1 - before.1)
    });
    let by_place = DMat2::from_cols(ends[0].0.truncate(), ends[1].0.truncate()).transpose().inverse();
    let slopes = [DVec2::new(ends[0].0.z, ends[1].0.z), DVec2::new(ends[0].1, ends[1].1)].map(|d| by_place * d);
    (slopes, part)
}

/// In depth per size of the map, to the rounding of the differences.
#[test]
fn slopes_are_the_derivatives_of_the_matrix() {
    let (mut hyperbolic, mut of_linear) = (Ratchet::new("depth slopes"), Ratchet::new("linear depth slopes"));
    let mut sharp = 0;
    each_map("slopes", CASES, (mixture(), tilted(), space()), |scene, map, receivers, (q, normal, space)| {
        let (q, normal) = (settled(q.of(receivers), map), normal.of(map));
        let linear = scene.fit().linear_depth(map.origin()).unwrap();
        let size = DVec2::from_array(map.size().map(f64::from));
        let p = q + map.origin();
        let slope = DVec2::from_array(map.depth_slope(space, p, normal).unwrap()) * size;
        let linear_slope = DVec2::from_array(map.linear_depth_slope(space, linear, p, normal).unwrap()) * size;
        let scale = 1.0 + slope.abs().element_sum();
        let linear_scale = 1.0 + linear_slope.abs().element_sum();

        // A part of the map; along the warp w changes by about 1e-4 of itself.
        let step = 1e-4 / map.w(p);
        // Two differences, of place and depth, each of two roundings over twice the step.
        let rounding = 6.0 * product_rounding(map, q) / step;
        let ([depth, linear_depth], part) = differences(map, space, linear, q, normal, step);
        let off = (depth * size - slope).abs().max_element() / scale;
        if rounding > 1e-5 || map.warp().excess() > 1e4 {
            return;
        }
        let allowed = 6e-10 + rounding;
        hyperbolic.note(off, allowed, (slope, depth));
        let off_linear = (linear_depth * size - linear_slope).abs().max_element() / linear_scale;
        let own = 64.0 * f64::EPSILON * (linear.truncate().length() * q.length() + linear.w.abs()) / step;
        let allowed_linear = 2e-10 + rounding + own + 2.0 * part * part;
        of_linear.note(off_linear, allowed_linear, (linear_slope, linear_depth));
        sharp += usize::from(allowed.max(allowed_linear) < 1e-7);
    });
    hyperbolic.finish();
    of_linear.finish();
    assert!(sharp > 100, "{sharp}");
}

/// Hyperbolic depth has one slope all over a plane; linear depth has not.
#[test]
fn slope_is_constant_over_a_plane() {
    let mut worst = Ratchet::new("slope over a plane");
    let (mut sharp, mut varied) = (0, 0);
    each_map("one-slope", CASES, (mixture(), mixture(), tilted()), |scene, map, receivers, (q, target, normal)| {
        let linear = scene.fit().linear_depth(DVec3::ZERO).unwrap();
        let (q, target, normal) = (settled(q.of(receivers), map), target.of(receivers), normal.of(map));
        let (light, size) = (map.light_space(), DVec2::from_array(map.size().map(f64::from)));
        // Below or above the other point, in the plane.
        let other = target - light.y * (normal.dot(target - q) / normal.dot(light.y));
        let [here, there] = [q, other].map(|q| map.depth_slope(ClipSpace::WGPU, q + map.origin(), normal).unwrap());
        let [here, there] = [here, there].map(|s| DVec2::from_array(s) * size);
        let off = (here - there).abs().max_element() / (1.0 + here.abs().element_sum());
        let ratio = map.warp().ratio();
        let rounding = [q, other].map(|q| product_rounding(map, q) * map.w(q + map.origin()) + world_rounding(map, q));
        let allowed = 1e-14 + 0.3 * rounding[0].max(rounding[1]);
        worst.note(off, allowed, (here, there));
        sharp += usize::from(allowed < 1e-9);

        let slope = |q| map.linear_depth_slope(ClipSpace::WGPU, linear, q + map.origin(), normal).unwrap();
        let [here, there] = [q, other].map(slope).map(DVec2::from_array);
        varied += usize::from(ratio > 2.0 && here.distance(there) > 0.1 * here.length());
    });
    worst.finish();
    println!("{sharp} sharp, {varied} varied");
    assert!(sharp > 200 && varied > 50, "{sharp} {varied}");
}

/// The warp projects about the middle height of the receivers, so a plane that faces the light has
/// the greatest slope at their two ends, equal and opposite. Nothing else but a whole matrix tells
/// a wrong middle.
#[test]
fn facing_planes_at_both_ends_have_opposite_slopes() {
    let (mut hyperbolic, mut none) =
        (Ratchet::new("slopes at both ends"), Ratchet::new("linear slopes of facing planes"));
    let mut steep = 0;
    each_map("both-ends", CASES, space(), |scene, map, receivers, space| {
        let y = map.light_space().y;
        let by_height = |a: &&DVec3, b: &&DVec3| y.dot(**a).total_cmp(&y.dot(**b));
        let ends = [receivers.iter().min_by(by_height).unwrap(), receivers.iter().max_by(by_height).unwrap()];
        let slope = |q: &DVec3| DVec2::from_array(map.depth_slope(space, *q + map.origin(), y).unwrap());
        let size = DVec2::from_array(map.size().map(f64::from));
        let [low, high] = ends.map(|q| slope(q) * size);
        let rounding = ends.map(|q| product_rounding(map, *q) * map.w(*q + map.origin()) + world_rounding(map, *q));
        // A strong warp's w is known to so much of itself, and the slope with it.
        let steepness = f64::EPSILON * map.warp().ratio() * low.abs().max_element();
        let allowed = 1e-14 + 24.0 * rounding[0].max(rounding[1]) + steepness;
        let off = (low + high).abs().max_element();
        hyperbolic.note(off, allowed, (low, high));
        if map.warp().excess() > 0.5 && allowed < 1e-9 && low.abs().max_element() > 0.01 {
            steep += 1;
        }
        // And linear depth has none. (Of receivers that are edge-on to the light one side of the map is rounding.)
        if scene.is_edge_on() {
            return;
        }
        let linear = scene.fit().linear_depth(DVec3::ZERO).unwrap();
        for q in ends {
            let slope = map.linear_depth_slope(space, linear, *q + map.origin(), y).unwrap();
            let texels = map.texel_extent(*q + map.origin());
            let width = DVec2::from_array(texels) * size * linear.truncate().length();
            none.note(
                (DVec2::from_array(slope) * size).abs().max_element(),
                f64::EPSILON * width.max_element() * map.warp().ratio(),
                slope,
            );
        }
    });
    hyperbolic.finish();
    none.finish();
    assert!(steep > 80, "{steep}");
}

/// A box along z under light from above, seen whole from before it.
fn plain_box(eta: f64, axes: Axes) -> (Scene, ShadowMap) {
    let all = box_about(DVec3::new(0.5, 1.0, 27.0), DVec3::new(2.0, 20.0, 25.0));
    let eye = DVec3::new(0.5, 1.0, -100.0);
    let view = View::perspective_off_centre(eye, DVec3::Z, DVec3::Y, Sides::centred(1.0, 1.0), 1.0..200.0).unwrap();
    let mut scene = Scene::new(view, DVec3::Y, &[all], all);
    (scene.axes, scene.near_depth) = (axes, NearDepth::Receivers);
    let fit = Fit { map_size: [512, 1024], ..scene.fit() };
    let map = fit.solve(Rule::Explicit(Warp::new(eta).unwrap())).unwrap();
    (scene, map)
}

/// The formulas in light space, for planes `y = a x + b z`: hyperbolic and linear.
#[test]
fn slopes_in_light_space() {
    let mut worst = Ratchet::new("slopes in light space");
    let point = [-1.5..2.5, -19.0..21.0, 2.0..52.0];
    check(
        "light-space",
        4 * CASES,
        (log_between(1e-6, 1e6), [-3.0..3.0, -3.0..3.0], point),
        |(eta, [a, b], [x, y, z]): (f64, [f64; 2], [f64; 3])| {
            let (_, map) = plain_box(eta, Axes::View);
            // Light space's x may be the world's x or its opposite.
            let (p_x, p_y, z0, d, k_y) = (0.5, 1.0, 2.0, 50.0, 1.0 / 40.0);
            let sign = map.light_space().x.x.signum();
            let w = 1.0 + eta * (z - z0) / d;
            let (ux, us) = (4.0 / 512.0 * sign, 1.0 / 1024.0);
            let d_x = -k_y * a * ux;
            let lift = w * b * d + eta * a * (x - p_x);
            let d_s = -k_y * (lift - eta * (y - p_y)) / (1.0 + eta) * us;
            let (point, normal) = (DVec3::new(x, y, z), DVec3::new(-a, 1.0, -b));
            let slope = map.depth_slope(ClipSpace::OPENGL, point, normal).unwrap();
            let scale = (d_x / ux).abs().max((d_s / us).abs()).max(k_y);
            let off = ((slope[0] - d_x) / ux).abs().max(((slope[1] - d_s) / us).abs()) / scale;
            worst.note(off, 1e-14 * (1.0 + eta), (slope, d_x, d_s));
            // In world units, downwards.
            let linear = DVec4::new(0.0, -1.0, 0.0, 0.0);
            let slope = map.linear_depth_slope(ClipSpace::OPENGL, linear, point, normal).unwrap();
            let (y_x, y_s) = (-a * w * ux, -w * lift / (1.0 + eta) * us);
            let off = ((slope[0] - y_x) / ux).abs().max(((slope[1] - y_s) / us).abs());
            let scale = (y_x / ux).abs().max((y_s / us).abs()).max(1.0);
            worst.note(off, 1e-14 * (1.0 + eta) * scale, (slope, y_x, y_s));
        },
    );
    worst.finish();
}

/// Reversed depth falls where the other grows. OpenGL's clip depth changes twice as fast as what is
/// stored; v points where the texture's rows go.
#[test]
fn signs_follow_the_conventions() {
    let (_, map) = plain_box(9.0, Axes::View);
    let (point, normal) = (DVec3::new(1.0, 4.0, 12.0), DVec3::new(0.3, 1.0, -0.4));
    let slope = |space| DVec2::from_array(map.depth_slope(space, point, normal).unwrap());
    let wgpu = slope(ClipSpace::WGPU);
    let same = |a: DVec2, b: DVec2| assert!(a.distance(b) < 1e-16, "{a} {b}");
    assert!(wgpu.abs().min_element() > 1e-5, "{wgpu}");
    same(slope(ClipSpace::WGPU.reversed()), -wgpu);
    same(slope(ClipSpace::VULKAN), wgpu);
    same(slope(ClipSpace::OPENGL), wgpu * DVec2::new(1.0, -1.0));
    same(slope(ClipSpace::OPENGL_ZERO_TO_ONE), wgpu * DVec2::new(1.0, -1.0));
    // What the clip matrix itself says, one texel of OpenGL's apart.
    let place = |texel: [f64; 2]| {
        let q = on_plane(&map, ClipSpace::OPENGL, texel, point - map.origin(), normal);
        project(map.clip_from_world_at(map.origin(), ClipSpace::OPENGL) * q.extend(1.0)).z
    };
    let change = DVec2::new(place([101.0, 200.0]), place([100.0, 201.0])) - place([100.0, 200.0]);
    assert!(change.distance(2.0 * slope(ClipSpace::OPENGL)) < 1e-13, "{change}");

    for space in SPACES {
        let deeper = point - map.light_space().y * 0.1;
        let [before, after] = [point, deeper].map(|p| self::place(&map, space, p - map.origin()).z);
        assert!((after - before) * space.away_from_light() > 1e-4);
    }
}
