//! What a filter needs, biases as lengths, depths per vertex, formats, and wrong arguments.

use super::*;

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

/// No lookup needs more than the least bias, and the worst needs all of it: the depths of the
/// texels it compares with come from rays that meet the plane, by solving for the points. In linear
/// depth, as much more as `w` grows.
#[test]
fn least_bias_by_brute_force() {
    let mut least_share = [f64::INFINITY; 2];
    let axes = select(vec![Axes::View, Axes::LightFixed]);
    let strategy = (axes, log_between(1e-3, 100.0), mixture(), tilted(), space());
    check("least-bias", 120, strategy, |(axes, eta, q, normal, space)| {
        let (scene, map) = plain_box(eta, axes);
        let linear = scene.fit().linear_depth(map.origin()).unwrap();
        let (q, normal) = (settled(q.of(&scene.receivers(map.origin())), &map), normal.of(&map));
        let p = q + map.origin();
        let slope = map.depth_slope(space, p, normal).unwrap();
        let linear_slope = map.linear_depth_slope(space, linear, p, normal).unwrap();
        let at = place(&map, space, q);
        for filter in FILTERS {
            let bias = filter.least_bias(slope);
            let linear_bias = filter.least_bias(linear_slope);
            let mut worst = 0.0_f64;
            // Lookups all over a texel; the grid, not the point, is moved, and its corners are
            // approached.
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
    });
    println!("least shares {least_share:?}");
}

/// Twice the reach, in units of the larger slope, is never too little, and all of it is needed on a
/// diagonal.
#[test]
fn slope_factor_serves_every_plane() {
    for filter in FILTERS {
        let factor = filter.least_slope_factor();
        let needed = |slope: [f64; 2]| filter.least_bias(slope) / slope[0].abs().max(slope[1].abs());
        assert_relative_eq!(needed([0.3, -0.3]), factor, max_relative = f64::EPSILON);
        check("slope-factor", CASES, [-1.0..1.0, -1.0..1.0], |slope| {
            assert!(slope == [0.0; 2] || needed(slope) <= factor * (1.0 + f64::EPSILON), "{factor}");
        });
    }
    let reaches = FILTERS.map(Filter::reach);
    assert_eq!(reaches, [0.5, 1.5, 2.0, 1.0, 1.5, 2.0]);
    assert_eq!([Filter::Nearest(0), Filter::Bilinear(0)].map(Filter::reach), [0.5, 1.0]);
}

/// A point moved by the length has its stored depth changed by the bias; and back.
#[test]
fn lengths_and_biases_are_inverse() {
    let (mut inverse, mut moves) = (Ratchet::new("length and bias"), Ratchet::new("depth of what is moved"));
    let mut sharp = 0;
    let more = (mixture(), space(), log_between(1e-6, 0.5), any::<bool>());
    each_map("lengths", CASES, more, |_, map, receivers, (q, space, bias, negative)| {
        let q = settled(q.of(receivers), map);
        let p = q + map.origin();
        let bias = if negative { -bias } else { bias };
        let length = map.length_of_bias(space, p, bias).unwrap();
        assert!(length.is_finite() && length * bias * space.away_from_light() > 0.0, "{length}");
        let back = map.bias_of_length(space, p, length).unwrap();
        inverse.note((back / bias - 1.0).abs(), 4.0 * f64::EPSILON, (back, bias));
        let moved = q - map.light_space().y * length;
        let change = place(map, space, moved).z - place(map, space, q).z;
        let allowed = 1e-15 + 0.25 * (product_rounding(map, q) + product_rounding(map, moved));
        moves.note((change - bias).abs(), allowed, (change, bias));
        sharp += usize::from(allowed < 1e-3 * bias.abs());
    });
    inverse.finish();
    moves.finish();
    assert!(sharp > 300, "{sharp}");

    // The same bias is longer where w is greater.
    let (_, map) = plain_box(9.0, Axes::View);
    let length = |z: f64| map.length_of_bias(ClipSpace::WGPU, DVec3::new(0.0, 3.0, z), 0.1).unwrap();
    assert_relative_eq!(length(2.0), 4.0, max_relative = 1e-14);
    assert_relative_eq!(length(52.0), 40.0, max_relative = 1e-14);
}

/// The greatest distance between what the rasteriser interpolates and the truth, sampled along an
/// edge.
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
    assert_relative_eq!(vertex_depth_error(2.0).unwrap(), 0.171_572_875_253_809_9, max_relative = f64::EPSILON);
    // (sqrt r - 1)/(sqrt r + 1) has half its digits here.
    let small = 1.0 / (1_u64 << 40) as f64;
    let share = vertex_depth_error(1.0 + small).unwrap() / (small / 4.0);
    assert_relative_eq!(share, 1.0 - 0.5 * small, max_relative = 2.0 * f64::EPSILON);
    assert_relative_eq!(vertex_depth_error(f64::MAX).unwrap(), 1.0, max_relative = f64::EPSILON);
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
    check("quanta", 50 * CASES, log_between(1e-3, 0.999), |depth| {
        assert!((depth + ulp(depth)) as f32 > depth as f32);
    });
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
    let turn = prop_oneof![Just(DVec2::X), Just(DVec2::Y), inside(1.0).prop_map(DVec3::truncate)];
    each_map("edge-on", CASES, (mixture(), turn), |scene, map, receivers, (q, turn)| {
        let p = q.of(receivers) + map.origin();
        let light = map.light_space();
        let normal = light.x * turn.x + light.z * turn.y;
        // Of the strongest warps rounding leaves no edge-on plane.
        if normal.length() < 1e-3 || map.warp().excess() > 1e6 {
            return;
        }
        let size = map.size().map(f64::from);
        let linear = scene.fit().linear_depth(map.origin()).unwrap();
        for slope in [
            map.depth_slope(ClipSpace::WGPU, p, normal).unwrap(),
            map.linear_depth_slope(ClipSpace::WGPU, linear, p, normal).unwrap(),
        ] {
            let per_map = size[0] * slope[0].abs() + size[1] * slope[1].abs();
            assert!(!slope[0].is_nan() && !slope[1].is_nan() && per_map > 1e3, "{slope:?} {normal}");
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
    check("tiny", 20, random::basic::direction(), |to_light| {
        let scene = Scene::new(view, to_light, &[all], all);
        let map = scene.fit().solve(Rule::Explicit(Warp::new(1e3).unwrap())).unwrap();
        for x in [-f64::MAX, f64::MAX] {
            assert!(!map.length_of_bias(space, DVec3::Z * 1e-90, x).unwrap().is_nan());
            assert!(!map.bias_of_length(space, DVec3::Z * 1e-90, x).unwrap().is_nan());
        }
    });
}

/// Along the rays of a spot light, which come from a point: the stored depth of the point that is
/// moved, from the matrix.
#[test]
fn lengths_under_spot_lights() {
    let (mut worst, mut inverse) = (Ratchet::new("depth under a lamp"), Ratchet::new("length under a lamp"));
    let mut count = 0;
    let more = (mixture(), space(), -0.3..0.3);
    each_lamp("lengths", CASES, more, |scene, _, (q, space, share)| {
        let Ok(map) = scene.fit().solve(Rule::OnAxis) else { return };
        let q = q.of(&lit(&scene, map.origin()));
        let away = -map.to_light(q + map.origin());
        let Light::Spot(spot) = &scene.light else { unreachable!() };
        let length = share * (q + map.origin() - spot.position()).length();
        let bias = map.bias_of_length(space, q + map.origin(), length).unwrap();
        let [here, there] = [q, q + away * length].map(|q| place(&map, space, q).z);
        let rounding = 1e-15 + 8.0 * (rounding(&scene, &map, q) + rounding(&scene, &map, q + away * length));
        if rounding > 1e-6 {
            return;
        }
        worst.note((there - here - bias).abs(), rounding, (here, there, bias));
        let back = map.length_of_bias(space, q + map.origin(), bias).unwrap();
        inverse.note((back - length).abs(), 2e-15 * length.abs(), (back, length));
        count += 1;
    });
    worst.finish();
    inverse.finish();
    assert!(count > 300, "{count}");
}
