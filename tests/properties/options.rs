//! What each option of a fit means.

use crate::CASES;
use crate::random::basic::{log_between, mixture};
use crate::random::check;
use crate::random::measure::{Scene, extent, ndc, sizes};
use crate::random::scenes::{MODERATE, each_kind, rule, view};
use crate::random::{Ratchet, scenes};
use approx::assert_relative_eq;
use shadow_warp::glam::DVec3;
use shadow_warp::{Axes, ClipSpace, Fit, Lens, NearDepth, Rule};

/// The size of the map decides on the size of its texels, and on nothing else, unless the warp is
/// the best for it.
#[test]
fn map_size_is_the_number_of_texels() {
    each_kind("map-size", CASES, (rule(), mixture(), [1..5000_u32, 1..5000]), |scene, _, (rule, q, size)| {
        let [one, other] = [[1, 1], size].map(|map_size| Fit { map_size, ..scene.fit() }.solve(rule).unwrap());
        assert_eq!(other.size(), size);
        let matrix = one.clip_from_world_at(one.origin(), ClipSpace::WGPU);
        assert_eq!(matrix, other.clip_from_world_at(one.origin(), ClipSpace::WGPU));
        assert_eq!(one.warp(), other.warp());
        let p = q.of(&scene.receivers(DVec3::ZERO));
        let [whole, texel] = [&one, &other].map(|map| map.texel_extent(p));
        for axis in [0, 1] {
            assert_relative_eq!(texel[axis] * f64::from(size[axis]), whole[axis], max_relative = 4.0 * f64::EPSILON);
        }
    });
}

/// Pixels per unit: the larger of both directions of the picture. No map depends on it.
#[test]
fn viewport_is_the_number_of_pixels() {
    each_kind("viewport", CASES, (rule(), [1..5000_u32, 1..5000]), |scene, _, (rule, viewport)| {
        let Lens::Perspective(sides) = scene.view.lens() else { unreachable!("these cameras are perspective") };
        let [one, other] = [[1, 1], viewport].map(|viewport| Fit { viewport, ..scene.fit() });
        let map = one.solve(rule).unwrap();
        assert_eq!(map, other.solve(rule).unwrap());
        let (width, height) = (sides.right - sides.left, sides.top - sides.bottom);
        let [w, h] = viewport.map(f64::from);
        let expected = (w / width).max(h / height) / (1.0 / width).max(1.0 / height);
        let gained = other.worst_texel(&map) / one.worst_texel(&map);
        assert_relative_eq!(gained, expected, max_relative = 8.0 * f64::EPSILON);
        let [before, after] = [&one, &other].map(|fit| fit.errors(map.warp()).unwrap());
        assert_relative_eq!(after.along / before.along, expected, max_relative = 8.0 * f64::EPSILON);
        assert_relative_eq!(after.across / before.across, expected, max_relative = 8.0 * f64::EPSILON);
    });
}

/// The near plane alone moves: from the highest caster to the highest receiver, which is lower or
/// the same.
#[test]
fn near_depth_moves_the_near_plane_alone() {
    let mut lowered = 0;
    each_kind("near-plane", CASES, rule(), |scene, _, rule| {
        let [casters, receivers] = [NearDepth::Casters, NearDepth::Receivers]
            .map(|near_depth| Fit { near_depth, ..scene.fit() }.solve(rule).unwrap());
        let [all, tight] = [&casters, &receivers].map(|map| map.clip_from_world_at(casters.origin(), ClipSpace::WGPU));
        for row in [0, 1, 3] {
            assert_eq!(all.row(row), tight.row(row));
        }
        let points = scene.receivers(casters.origin());
        let lowest = |map| extent(points.iter().map(|q| ndc(map, *q).z))[0];
        assert!(lowest(&receivers) <= lowest(&casters) + 1e-12 * casters.warp().ratio());
        lowered += u32::from(lowest(&casters) > 0.01);
    });
    assert!(lowered > 300, "{lowered}");
}

/// With axes of the light alone the map's columns and rows have the same direction for all cameras:
/// those of [`LightSpace::fixed_axes`](shadow_warp::LightSpace::fixed_axes). With the others its
/// rows lie across the direction that they follow.
#[test]
fn axes_are_the_directions_of_the_texture() {
    let mut worst = Ratchet::new("directions of the texture");
    let cameras = (view(MODERATE), view(MODERATE));
    let strategy = (cameras, crate::random::basic::direction());
    check("axes/LightFixed", 3 * CASES, strategy, |((one, other), to_light)| {
        let rows = [one, other].map(|view| {
            let all = scenes::Region::All.of(&view);
            let scene = Scene { axes: Axes::LightFixed, ..Scene::new(view, to_light, &[all], all) };
            let map = scene.fit().solve(Rule::Uniform).unwrap();
            let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
            let rows = [0, 1].map(|row| matrix.row(row).truncate().normalize());
            for (row, axis) in rows.into_iter().zip(map.light_space().fixed_axes()) {
                worst.note(row.distance(axis), 1e-15, &scene);
            }
            rows
        });
        worst.note(rows[0][0].distance(rows[1][0]), 1e-15, to_light);
    });
    each_kind("axes/View", CASES, log_between(1e-3, 1e3), |scene, _, _| {
        let scene = Scene { axes: Axes::View, ..scene };
        let map = scene.fit().solve(Rule::LISPSM).unwrap();
        let (space, row) = (map.light_space(), map.clip_from_world_at(map.origin(), ClipSpace::WGPU).row(0));
        // Across the view: no point of the line of sight leaves its column.
        let [across, _, along] = sizes(&scene.receivers(map.origin()), &map);
        if space.sin_gamma > 1e-3 && map.warp().excess() < 1.0 && across > 1e-3 * along {
            worst.note(row.truncate().normalize().dot(space.y).abs(), 1e-15, &scene);
        }
    });
    worst.finish();
}
