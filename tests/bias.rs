//! Depth slopes and least biases, against derivatives of the matrix and against brute force over a filter's texels.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]
#![expect(clippy::float_cmp, reason = "what is compared is exact")]

mod scenes;

use scenes::random::Random;
use scenes::{Scene, box_about, moderate, product_rounding, project, rules};
use shadow_warp::glam::{DMat2, DMat3, DVec2, DVec3, DVec4};
use shadow_warp::{
    Axes, ClipSpace, DepthFormat, Error, Filter, Fit, NearDepth, Rule, ShadowMap, Sides, View, Warp, vertex_depth_error,
};

const CASES: u64 = 500;
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

/// Every scene with every rule, not square.
fn each_map(mut check: impl FnMut(&Scene, &ShadowMap, &[DVec3], u64)) {
    for case in 0..CASES {
        let (scene, _) = moderate(case);
        let fit = Fit { map_size: [512, 1024], ..scene.fit() };
        for rule in rules(&mut Random::new(case)) {
            let map = fit.solve(rule).unwrap();
            check(&scene, &map, &scene.receivers(map.origin()), case);
        }
    }
}

/// Column and row in texels, and stored depth, of a point relative to the map's origin.
fn place(map: &ShadowMap, space: ClipSpace, q: DVec3) -> DVec3 {
    let [width, height] = map.size().map(f64::from);
    project(map.texture_from_world_at(map.origin(), space) * q.extend(1.0)) * DVec3::new(width, height, 1.0)
}

/// Where the ray of a place in the map, in texels, meets the plane through `q`: by solving for the point.
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

/// A random receiver, relative to the map's origin, that its position in world space still tells.
fn settled(random: &mut Random, map: &ShadowMap, receivers: &[DVec3]) -> DVec3 {
    (random.mixed(receivers) + map.origin()) - map.origin()
}

/// How far the rounding of a world position moves a receiver, as a share of the map, times `w`.
fn world_rounding(map: &ShadowMap, q: DVec3) -> f64 {
    let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
    let steep = [0, 1, 2, 3].map(|i| matrix.row(i).truncate().length()).into_iter().fold(0.0, f64::max);
    4.0 * f64::EPSILON * (q.length() + map.origin().length()) * steep
}

/// A normal at most some 84 degrees from the light, to either side; sometimes exactly along it.
fn tilted(random: &mut Random, map: &ShadowMap) -> DVec3 {
    let space = map.light_space();
    let turn = random.inside(1.0);
    let tilt = if random.below(5) == 0 { 0.0 } else { random.log_between(1e-3, 10.0) };
    let across = (space.x * turn.x + space.z * turn.z).normalize_or_zero();
    (space.y + across * tilt) * if random.below(2) == 0 { -1.0 } else { random.log_between(1e-3, 1e3) }
}

/// The slopes in a plane by central differences of the matrix along two lines in it, of hyperbolic depth and of the
/// linear one. Along a line the differences of all fractions over `w` have one common factor, so that those of depth
/// are exact but for rounding; those of linear depth lack the factor, `1/(1 - part^2)` for the returned part by which
/// `w` changes.
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

/// Within ten times 6e-11, the worst of a plain program, in depth per size of the map, plus the rounding of the differences.
#[test]
fn slopes_are_the_derivatives_of_the_matrix() {
    let mut random = Random::new(36);
    let (mut sharp, mut worst, mut worst_linear) = (0, 0.0_f64, 0.0_f64);
    each_map(|scene, map, receivers, case| {
        let q = settled(&mut random, map, receivers);
        let normal = tilted(&mut random, map);
        let space = SPACES[case as usize % SPACES.len()];
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
        let rounding = 2.0 * product_rounding(map, q) / step;
        let ([depth, linear_depth], part) = differences(map, space, linear, q, normal, step);
        let off = (depth * size - slope).abs().max_element() / scale;
        let allowed = 6e-10 + rounding;
        assert!(off <= allowed, "{case}: {off:e} > {allowed:e}, {slope} {depth} {map:?}");
        let off_linear = (linear_depth * size - linear_slope).abs().max_element() / linear_scale;
        let own = 64.0 * f64::EPSILON * (linear.truncate().length() * q.length() + linear.w.abs()) / step;
        let allowed_linear = 2e-10 + rounding + own + 2.0 * part * part;
        assert!(
            off_linear <= allowed_linear,
            "{case}: {off_linear:e} > {allowed_linear:e}, {linear_slope} {linear_depth}"
        );
        if allowed.max(allowed_linear) < 1e-7 {
            sharp += 1;
            worst = worst.max(off);
            worst_linear = worst_linear.max(off_linear);
        }
    });
    println!("{sharp} sharp; worst {worst:e}, linear {worst_linear:e}");
    assert!(sharp > CASES, "{sharp}");
}

/// Hyperbolic depth has one slope all over a plane; linear depth has not.
#[test]
fn slope_is_constant_over_a_plane() {
    let mut random = Random::new(37);
    let (mut sharp, mut varied) = (0, 0);
    each_map(|scene, map, receivers, case| {
        let linear = scene.fit().linear_depth(DVec3::ZERO).unwrap();
        let (q, target) = (settled(&mut random, map, receivers), random.mixed(receivers));
        let normal = tilted(&mut random, map);
        let light = map.light_space();
        // Below or above the other point, in the plane.
        let other = target - light.y * (normal.dot(target - q) / normal.dot(light.y));
        let [here, there] = [q, other].map(|q| map.depth_slope(ClipSpace::WGPU, q + map.origin(), normal).unwrap());
        let [here, there] = [here, there].map(|s| DVec2::from_array(s) * DVec2::new(512.0, 1024.0));
        let off = (here - there).abs().max_element() / (1.0 + here.abs().element_sum());
        let ratio = map.warp().ratio();
        let rounding = [q, other].map(|q| product_rounding(map, q) * map.w(q + map.origin()) + world_rounding(map, q));
        let allowed = 1e-12 + 2.0 * rounding[0].max(rounding[1]);
        assert!(off <= allowed, "{case}: {off:e} > {allowed:e} {here} {there} {map:?}");
        sharp += usize::from(allowed < 1e-9);

        let slope = |q| map.linear_depth_slope(ClipSpace::WGPU, linear, q + map.origin(), normal).unwrap();
        let [here, there] = [q, other].map(slope).map(DVec2::from_array);
        varied += usize::from(ratio > 2.0 && here.distance(there) > 0.1 * here.length());
    });
    println!("{sharp} sharp, {varied} varied");
    assert!(sharp > CASES as usize && varied > 300, "{sharp} {varied}");
}

/// The warp projects about the middle height of the receivers, so a plane that faces the light has the greatest
/// slope at their two ends, equal and opposite. Nothing else but a whole matrix tells a wrong middle.
#[test]
fn facing_planes_at_both_ends_have_opposite_slopes() {
    let (mut steep, mut worst) = (0, 0.0_f64);
    each_map(|scene, map, receivers, case| {
        let y = map.light_space().y;
        let by_height = |a: &&DVec3, b: &&DVec3| y.dot(**a).total_cmp(&y.dot(**b));
        let ends = [receivers.iter().min_by(by_height).unwrap(), receivers.iter().max_by(by_height).unwrap()];
        let space = SPACES[case as usize % SPACES.len()];
        let slope = |q: &DVec3| DVec2::from_array(map.depth_slope(space, *q + map.origin(), y).unwrap());
        let size = DVec2::new(512.0, 1024.0);
        let [low, high] = ends.map(|q| slope(q) * size);
        let rounding = ends.map(|q| product_rounding(map, *q) * map.w(*q + map.origin()) + world_rounding(map, *q));
        let allowed = 1e-12 + 4.0 * rounding[0].max(rounding[1]);
        let off = (low + high).abs().max_element();
        assert!(off <= allowed, "{case}: {off:e} > {allowed:e} {low} {high}");
        if map.warp().excess() > 0.5 && allowed < 1e-9 && low.abs().max_element() > 0.01 {
            steep += 1;
            worst = worst.max(off);
        }
        // And linear depth has none.
        let linear = scene.fit().linear_depth(DVec3::ZERO).unwrap();
        for q in ends {
            let slope = map.linear_depth_slope(space, linear, *q + map.origin(), y).unwrap();
            assert!(DVec2::from_array(slope).abs().max_element() <= allowed, "{case}: {slope:?}");
        }
    });
    println!("{steep} steep, worst {worst:e}");
    assert!(steep > 300, "{steep}");
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
    let mut random = Random::new(5);
    let mut worst = 0.0_f64;
    for _ in 0..2000 {
        let eta = random.log_between(1e-6, 1e6);
        let (_, map) = plain_box(eta, Axes::View);
        // Light space's x may be the world's x or its opposite.
        let (p_x, p_y, z0, d, k_y) = (0.5, 1.0, 2.0, 50.0, 1.0 / 40.0);
        let sign = map.light_space().x.x.signum();
        let [a, b] = [0, 1].map(|_| random.between(-3.0, 3.0));
        let [x, y, z] = [random.between(-1.5, 2.5), random.between(-19.0, 21.0), random.between(2.0, 52.0)];
        let w = 1.0 + eta * (z - z0) / d;
        let (ux, us) = (4.0 / 512.0 * sign, 1.0 / 1024.0);
        let d_x = -k_y * a * ux;
        let lift = w * b * d + eta * a * (x - p_x);
        let d_s = -k_y * (lift - eta * (y - p_y)) / (1.0 + eta) * us;
        let (point, normal) = (DVec3::new(x, y, z), DVec3::new(-a, 1.0, -b));
        let slope = map.depth_slope(ClipSpace::OPENGL, point, normal).unwrap();
        let scale = (d_x / ux).abs().max((d_s / us).abs()).max(k_y);
        let off = ((slope[0] - d_x) / ux).abs().max(((slope[1] - d_s) / us).abs()) / scale;
        worst = worst.max(off / (1.0 + eta));
        assert!(off <= 1e-14 * (1.0 + eta), "{eta}: {off:e} {slope:?} {d_x} {d_s}");
        // In world units, downwards.
        let linear = DVec4::new(0.0, -1.0, 0.0, 0.0);
        let slope = map.linear_depth_slope(ClipSpace::OPENGL, linear, point, normal).unwrap();
        let (y_x, y_s) = (-a * w * ux, -w * lift / (1.0 + eta) * us);
        let off = ((slope[0] - y_x) / ux).abs().max(((slope[1] - y_s) / us).abs());
        let scale = (y_x / ux).abs().max((y_s / us).abs()).max(1.0);
        assert!(off <= 1e-14 * (1.0 + eta) * scale, "{eta}: {off:e} {slope:?} {y_x} {y_s}");
    }
    println!("worst {worst:e} (1 + eta)");
}

/// Reversed depth falls where the other grows. OpenGL's clip depth changes twice as fast as what is stored; v points
/// where the texture's rows go.
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

/// The texels that a lookup compares with: centres, for a place in texels.
fn texels(filter: Filter, place: [f64; 2]) -> Vec<[f64; 2]> {
    let (taps, bilinear) = match filter {
        Filter::Nearest(n) => (n, false),
        Filter::Bilinear(n) => (n, true),
        _ => unreachable!("a new kind of filter"),
    };
    let along = |x: f64| {
        let tap = |i: u32| x + f64::from(i) - 0.5 * f64::from(taps - 1);
        let centres = move |x: f64| {
            if bilinear { vec![(x - 0.5).floor() + 0.5, (x - 0.5).floor() + 1.5] } else { vec![x.floor() + 0.5] }
        };
        (0..taps).flat_map(|i| centres(tap(i))).collect::<Vec<_>>()
    };
    let rows = along(place[1]);
    along(place[0]).into_iter().flat_map(|x| rows.iter().map(move |y| [x, *y])).collect()
}

/// No lookup needs more than the least bias, and the worst needs all of it: the depths of the texels it compares with
/// come from rays that meet the plane, by solving for the points. In linear depth, as much more as `w` grows.
#[test]
fn least_bias_by_brute_force() {
    let mut random = Random::new(2);
    let mut least_share = [f64::INFINITY; 2];
    for _ in 0..150 {
        let axes = if random.below(2) == 0 { Axes::View } else { Axes::LightFixed };
        let (scene, map) = plain_box(random.log_between(1e-3, 100.0), axes);
        let linear = scene.fit().linear_depth(map.origin()).unwrap();
        let q = settled(&mut random, &map, &scene.receivers(map.origin()));
        let normal = tilted(&mut random, &map);
        let space = SPACES[random.below(SPACES.len())];
        let p = q + map.origin();
        let slope = map.depth_slope(space, p, normal).unwrap();
        let linear_slope = map.linear_depth_slope(space, linear, p, normal).unwrap();
        let at = place(&map, space, q);
        for filter in FILTERS {
            let bias = filter.least_bias(slope);
            let linear_bias = filter.least_bias(linear_slope);
            let mut worst = 0.0_f64;
            // Lookups all over a texel; the grid, not the point, is moved, and its corners are approached.
            let shifts = [1e-9, 0.3, 0.5 - 1e-9, 0.5 + 1e-9, 0.8, 1.0 - 1e-9];
            for shift in shifts.iter().flat_map(|x| shifts.map(|y| [*x, y])) {
                for centre in texels(filter, shift) {
                    let texel = [at.x + centre[0] - shift[0], at.y + centre[1] - shift[1]];
                    let other = on_plane(&map, space, texel, q, normal);
                    let lack = (at.z - place(&map, space, other).z) * space.away_from_light();
                    assert!(lack <= bias * (1.0 + 1e-9) + 1e-12, "{filter:?} {lack} {bias}");
                    worst = worst.max(lack);
                    let lack = linear.dot((q - other).extend(0.0));
                    let growth = map.w(other + map.origin()) / map.w(p);
                    assert!(lack <= linear_bias * growth * (1.0 + 1e-9) + 1e-12, "{filter:?} {lack} {linear_bias}");
                    let height = f64::from(map.size()[1]);
                    let h = map.w(p) * map.warp().excess() / map.warp().ratio() * filter.reach() / height;
                    assert!(axes != Axes::View || growth <= (1.0 + 1e-9) / (1.0 - h), "{growth} {h}");
                }
            }
            assert!(worst >= bias * (1.0 - 1e-7) - 1e-12, "{filter:?} {worst} {bias}");
            // The corners.
            let mut worst = [0.0_f64; 2];
            for corner in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
                let texel = [at.x + corner[0] * filter.reach(), at.y + corner[1] * filter.reach()];
                let other = on_plane(&map, space, texel, q, normal);
                let growth = map.w(other + map.origin()) / map.w(p);
                worst[0] = worst[0].max((at.z - place(&map, space, other).z) * space.away_from_light());
                worst[1] = worst[1].max(linear.dot((q - other).extend(0.0)) / growth);
            }
            for (i, bias) in [bias, linear_bias].into_iter().enumerate() {
                assert!((worst[i] - bias).abs() <= 1e-9 * bias + 1e-12, "{filter:?} {i} {worst:?} {bias}");
                if bias > 1e-6 {
                    least_share[i] = least_share[i].min(worst[i] / bias);
                }
            }
        }
    }
    println!("least shares {least_share:?}");
}

/// Twice the reach, in units of the larger slope, is never too little, and all of it is needed on a diagonal.
#[test]
fn slope_factor_serves_every_plane() {
    let mut random = Random::new(3);
    for filter in FILTERS {
        let factor = filter.least_slope_factor();
        let mut worst = 0.0_f64;
        for i in 0..1000 {
            let slope = if i == 0 { [0.3, -0.3] } else { [random.between(-1.0, 1.0), random.between(-1.0, 1.0)] };
            worst = worst.max(filter.least_bias(slope) / slope[0].abs().max(slope[1].abs()));
        }
        assert!(worst <= factor && worst >= factor * (1.0 - 1e-15), "{filter:?} {worst} {factor}");
    }
    let reaches = FILTERS.map(Filter::reach);
    assert_eq!(reaches, [0.5, 1.5, 2.0, 1.0, 1.5, 2.0]);
    assert_eq!([Filter::Nearest(0), Filter::Bilinear(0)].map(Filter::reach), [0.5, 1.0]);
}

/// A point moved by the length has its stored depth changed by the bias; and back.
#[test]
fn lengths_and_biases_are_inverse() {
    let mut random = Random::new(4);
    let mut sharp = 0;
    each_map(|_, map, receivers, case| {
        let q = settled(&mut random, map, receivers);
        let p = q + map.origin();
        let space = SPACES[case as usize % SPACES.len()];
        let bias = random.log_between(1e-6, 0.5) * if random.below(2) == 0 { -1.0 } else { 1.0 };
        let length = map.length_of_bias(space, p, bias).unwrap();
        assert!(length.is_finite() && length * bias * space.away_from_light() > 0.0, "{case} {length}");
        let back = map.bias_of_length(space, p, length).unwrap();
        assert!((back / bias - 1.0).abs() < 1e-14, "{case} {back} {bias}");
        let moved = q - map.light_space().y * length;
        let change = place(map, space, moved).z - place(map, space, q).z;
        let allowed = 1e-14 + product_rounding(map, q) + product_rounding(map, moved);
        assert!((change - bias).abs() <= allowed, "{case} {change} {bias} {allowed:e}");
        sharp += usize::from(allowed < 1e-3 * bias.abs());
    });
    assert!(sharp > 2000, "{sharp}");

    // The same bias is longer where w is greater.
    let (_, map) = plain_box(9.0, Axes::View);
    let length = |z: f64| map.length_of_bias(ClipSpace::WGPU, DVec3::new(0.0, 3.0, z), 0.1).unwrap();
    assert!((length(2.0) - 4.0).abs() < 1e-13 && (length(52.0) - 40.0).abs() < 1e-12);
}

/// The greatest distance between what the rasteriser interpolates and the truth, sampled along an edge.
#[test]
fn vertex_linear_depth_by_sampling() {
    for ratio in [1.0, 1.0 + 1e-9, 1.01, 2.0, 10.0, 1e4] {
        let steps = 200_000;
        let error = |i: u32| {
            // Depth times w at the vertices, and w, both interpolated evenly over the map.
            let s = f64::from(i) / f64::from(steps);
            let [near_per_w, far_per_w] = [1.0, 1.0 / ratio];
            let per_w = near_per_w + s * (far_per_w - near_per_w);
            let true_depth = s * far_per_w / per_w;
            (s - true_depth).abs()
        };
        let worst = (0..=steps).map(error).fold(0.0, f64::max);
        let closed = vertex_depth_error(ratio).unwrap();
        assert!(worst <= closed + 1e-15 && worst >= closed * (1.0 - 1e-6) - 1e-15, "{ratio} {worst} {closed}");
    }
    assert!((vertex_depth_error(2.0).unwrap() - 0.171_572_875_253_809_9).abs() < 1e-16);
    // (sqrt r - 1)/(sqrt r + 1) has half its digits here.
    let small = 1.0 / (1_u64 << 40) as f64;
    let share = vertex_depth_error(1.0 + small).unwrap() / (small / 4.0);
    assert!((share - (1.0 - 0.5 * small)).abs() < 1e-15, "{share}");
    assert!((vertex_depth_error(f64::MAX).unwrap() - 1.0).abs() < 1e-15);
    for ratio in [f64::NAN, 0.99, -2.0, f64::INFINITY] {
        assert!(matches!(vertex_depth_error(ratio), Err(Error::Invalid { argument: "w_ratio", .. })));
    }
}

/// Neighbours of stored depths.
#[test]
fn quanta_of_the_formats() {
    assert_eq!(DepthFormat::Unorm16.quantum(0.3) * 65535.0, 1.0);
    assert_eq!(DepthFormat::Unorm24.quantum(f64::NAN) * 16_777_215.0, 1.0);
    let ulp = |depth| DepthFormat::Float32.quantum(depth);
    for (depth, exponent) in [(1.0, 23), (0.99, 24), (0.5, 24), (0.49, 25), (0.125, 26), (-0.125, 26)] {
        assert_eq!(ulp(depth), 1.0 / (1_u64 << exponent) as f64, "{depth}");
    }
    let least = f64::from(f32::from_bits(1));
    assert_eq!([ulp(0.0), ulp(1e-320), ulp(f64::from(f32::MIN_POSITIVE))], [least; 3]);
    for depth in [f64::NAN, 7.0, f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(ulp(depth), ulp(1.0), "{depth}");
    }
    // Two depths a quantum apart, each rounded, do not change places.
    let mut random = Random::new(24);
    for _ in 0..10_000 {
        let depth = random.log_between(1e-3, 0.999);
        assert!((depth + ulp(depth)) as f32 > depth as f32);
    }
}

#[test]
fn edge_on_planes_and_wrong_arguments() {
    // The light's axis is exact here, so these planes are edge-on exactly.
    for (eta, axes) in [(0.0, Axes::View), (9.0, Axes::View), (9.0, Axes::LightFixed)] {
        let (scene, map) = plain_box(eta, axes);
        let linear = scene.fit().linear_depth(DVec3::ZERO).unwrap();
        for normal in [DVec3::X, DVec3::Z, DVec3::new(3.0, 0.0, -4.0), DVec3::NEG_X * 1e-90] {
            for point in [DVec3::new(1.0, 4.0, 12.0), DVec3::new(0.5, 1.0, 52.0)] {
                for space in SPACES {
                    assert_eq!(map.depth_slope(space, point, normal), Ok([f64::INFINITY; 2]));
                    assert_eq!(map.linear_depth_slope(space, linear, point, normal), Ok([f64::INFINITY; 2]));
                }
            }
        }
    }
    // Elsewhere rounding tilts them: no number is NaN, and no bias serves.
    let mut random = Random::new(6);
    each_map(|scene, map, receivers, case| {
        let (p, turn) = (random.mixed(receivers) + map.origin(), random.inside(1.0));
        let light = map.light_space();
        let normal = [light.x, light.z, light.x * turn.x + light.z * turn.z][random.below(3)];
        let linear = scene.fit().linear_depth(map.origin()).unwrap();
        for slope in [
            map.depth_slope(ClipSpace::WGPU, p, normal).unwrap(),
            map.linear_depth_slope(ClipSpace::WGPU, linear, p, normal).unwrap(),
        ] {
            let per_map = 512.0 * slope[0].abs() + 1024.0 * slope[1].abs();
            assert!(!slope[0].is_nan() && !slope[1].is_nan() && per_map > 1e3, "{case} {slope:?} {normal}");
        }
    });

    let (_, map) = plain_box(9.0, Axes::View);
    let (space, p, n) = (ClipSpace::WGPU, DVec3::new(1.0, 4.0, 12.0), DVec3::Y);
    let row = DVec4::new(0.0, -1.0, 0.0, 0.0);
    let invalid = |result: Result<[f64; 2], Error>, name| {
        assert!(matches!(result, Err(Error::Invalid { argument, .. }) if argument == name), "{result:?}");
    };
    for normal in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY, DVec3::X * 1e-120, DVec3::Y * 1e120] {
        invalid(map.depth_slope(space, p, normal), "normal");
        invalid(map.linear_depth_slope(space, row, p, normal), "normal");
    }
    for point in [DVec3::NAN, DVec3::INFINITY, DVec3::X * 1e120] {
        invalid(map.depth_slope(space, point, n), "point");
        invalid(map.linear_depth_slope(space, row, point, n), "point");
        invalid(map.length_of_bias(space, point, 0.1).map(|x| [x; 2]), "point");
        invalid(map.bias_of_length(space, point, 0.1).map(|x| [x; 2]), "point");
    }
    for x in [f64::NAN, f64::INFINITY] {
        invalid(map.linear_depth_slope(space, row.with_w(x), p, n), "linear");
        invalid(map.length_of_bias(space, p, x).map(|x| [x; 2]), "bias");
        invalid(map.bias_of_length(space, p, x).map(|x| [x; 2]), "length");
    }
    // The length of the normal, and its side, do not count.
    let tilted = DVec3::new(0.3, 1.0, -0.4);
    let slope = |n| DVec2::from_array(map.depth_slope(space, p, n).unwrap());
    for factor in [-1.0, 1e90, -1e-90] {
        assert!(slope(tilted * factor).distance(slope(tilted)) < 1e-17);
    }
    let steep = DVec4::new(1e308, -1e308, 1e308, 0.0);
    assert_eq!(map.linear_depth_slope(space, steep, p, tilted), Ok([f64::INFINITY; 2]));
    // Behind the warp's pole, and far away, where numbers overflow.
    let behind = DVec3::new(0.0, 0.0, -1e3);
    assert!(map.w(behind) < 0.0);
    assert_eq!(map.depth_slope(space, behind, n), Ok([f64::INFINITY; 2]));
    assert_eq!(map.length_of_bias(space, behind, 0.1), Ok(f64::INFINITY));
    assert_eq!(map.bias_of_length(space, behind, -0.1), Ok(f64::NEG_INFINITY));
    for far in [DVec3::new(1e100, -1e100, 1e100), DVec3::new(0.0, 1e100, 0.0)] {
        for x in map.depth_slope(space, far, tilted).unwrap() {
            assert!(!x.is_nan());
        }
        for x in [0.0, -f64::MAX, f64::MAX] {
            assert!(!map.length_of_bias(space, far, x).unwrap().is_nan());
            assert!(!map.bias_of_length(space, far, x).unwrap().is_nan());
        }
    }
    // A scene so small that lengths overflow in its units.
    let all = box_about(DVec3::Z * 1e-90, DVec3::splat(0.5e-90));
    let view = View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, 1.0, 1.0, 1e-91..1e-89).unwrap();
    for _ in 0..20 {
        let scene = Scene::new(view, random.direction(), &[all], all);
        let map = scene.fit().solve(Rule::Explicit(Warp::new(1e3).unwrap())).unwrap();
        for x in [-f64::MAX, f64::MAX] {
            assert!(!map.length_of_bias(space, DVec3::Z * 1e-90, x).unwrap().is_nan());
            assert!(!map.bias_of_length(space, DVec3::Z * 1e-90, x).unwrap().is_nan());
        }
    }
}
