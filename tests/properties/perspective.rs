//! Perspective shadow maps: what the one matrix does for lights before, beside and behind the eye.

use crate::CASES;
use crate::random::basic::{log_between, mixture};
use crate::random::lamps::{Place, assert_casters_are_shown, each_lamp, probes};
use crate::random::measure::{Scene, box_about, extent, lit, ndc, product_rounding, sizes};
use crate::random::scenes::{Kind, each_kind, moderate};
use crate::random::{Ratchet, check};
use proptest::prelude::*;
use proptest::sample::select;
use shadow_warp::glam::{DVec2, DVec3};
use shadow_warp::{Aim, ClipSpace, Error, Fit, Lens, PerspectiveRule, Rule, ShadowMap, View};

pub(crate) fn rule(aim: Aim, shift: f64) -> Rule {
    Rule::Perspective(PerspectiveRule { aim, shift })
}

pub(crate) fn unsupported(result: &Result<ShadowMap, Error>) -> bool {
    matches!(result, Err(Error::Unsupported { .. }))
}

/// Scenes under a sun and under lamps, with their maps, some of them shifted; points are relative
/// to the map's origin.
fn each_map<E: Strategy + Clone>(
    name: &str,
    more: E,
    mut property: impl FnMut(&Scene, &ShadowMap, &[DVec3], E::Value),
) {
    let (mut suns, mut refused) = (0, 0);
    each_kind(name, CASES, (select(vec![0.0, 0.0, 1.0]), more.clone()), |scene, _, (shift, more)| {
        // What this camera sees is out of its picture once it has moved back only where a side
        // leans inward.
        let widens = match scene.view.lens() {
            Lens::Perspective(s) => s.left.max(s.bottom) < 0.0 && s.right.min(s.top) > 0.0,
            Lens::Orthographic(_) => false,
        };
        let shift = if widens { shift * scene.view.near() } else { 0.0 };
        suns += 1;
        let found = scene.fit().solve(rule(Aim::Closest, shift));
        let Ok(map) = found else {
            // With far/near of 1e6 and more the light may come too close in the camera's space.
            assert!(unsupported(&found) && scene.view.far() > 1e5 * scene.view.near());
            refused += 1;
            return;
        };
        property(&scene, &map, &scene.receivers(map.origin()), more);
    });
    assert!(refused * 100 < suns, "{refused} of {suns}");
    let mut solved = Vec::new();
    each_lamp(name, CASES, more, |scene, place, more| {
        let found = scene.fit().solve(Rule::PSM);
        match found {
            Ok(map) => {
                solved.push(place);
                property(&scene, &map, &lit(&scene, map.origin()), more);
            }
            Err(Error::NothingLit) => {}
            Err(error) => {
                assert!(unsupported(&found) || error.to_string().starts_with("near"), "{place:?} {error}");
            }
        }
    });
    for place in [Place::Anywhere, Place::Beside, Place::BehindEye, Place::AtEye] {
        let count = solved.iter().filter(|p| **p == place).count();
        assert!(count > 30, "{place:?} {count}");
    }
}

/// No box without width, which may look flat to the light in the camera's space too.
fn is_solid(scene: &Scene) -> bool {
    scene.boxes.iter().all(|b| (b.max() - b.min()).min_element() > 0.0)
}

/// LSP-24.
#[test]
fn contains_and_touches() {
    let (mut inside, mut touch) = (Ratchet::new("LSP-24 inside"), Ratchet::new("LSP-24 touch"));
    let (mut touched, mut by_casters) = (0, 0);
    each_map("LSP-24", probes(), |scene, map, receivers, probes| {
        let allowed = 4e-13 + 2.0 * extent(receivers.iter().map(|q| product_rounding(map, *q)))[1];
        let points: Vec<_> = receivers.iter().map(|q| ndc(map, *q)).collect();
        let [x, y, z] = [0, 1, 2].map(|a| extent(points.iter().map(|p| p[a])));
        for [low, high] in [x, y, z.map(|z| 2.0 * z - 1.0)] {
            inside.note((-1.0 - low).max(high - 1.0), allowed, map);
        }
        let [across, height, along] = sizes(receivers, map);
        let thick = 1e-5 * across.max(height).max(along);
        if across.min(along) > thick {
            for [low, high] in [x, y] {
                touch.note((low + 1.0).abs().max((high - 1.0).abs()), allowed, map);
            }
            touched += 1;
        }
        if is_solid(scene) && height > thick {
            touch.note((z[1] - 1.0).abs(), allowed, map);
        }
        let nearest = if scene.light.as_directional().is_ok() {
            let casters = scene.caster_points(map.origin());
            let rounding = extent(casters.iter().map(|q| product_rounding(map, *q)))[1].max(0.0);
            let nearest = extent(casters.iter().map(|q| ndc(map, *q).z))[0];
            inside.note(-nearest, allowed + rounding, map);
            if is_solid(scene) && height > thick {
                touch.note(nearest.min(z[0]).abs(), allowed + rounding, map);
            }
            nearest
        } else {
            assert_casters_are_shown(scene, map, &probes)
        };
        by_casters += usize::from(nearest < z[0] - 0.01);
    });
    inside.finish();
    touch.finish();
    println!("{touched} {by_casters}");
    assert!(touched > 500 && by_casters > 200, "{touched} {by_casters}");
}

/// LSP-25: whatever its side of the camera plane, and with the ordinary depth test.
#[test]
fn light_rays_stay_in_their_texel() {
    let mut sideways = Ratchet::new("LSP-25");
    let (mut before, mut behind, mut on_plane) = (0, 0, 0);
    each_map("LSP-25", (mixture(), log_between(1e-3, 0.9)), |scene, map, receivers, (q, share)| {
        let q = q.of(receivers);
        let light = scene.light.homogeneous();
        // Towards a lamp a part of the way; towards the sun over as much as the body is large.
        let way = if light.w == 0.0 {
            let size = sizes(receivers, map).into_iter().fold(1e-3, f64::max);
            light.truncate() * size * share
        } else {
            (light.truncate() - map.origin() - q) * share
        };
        let [here, there] = [q, q + way].map(|p| ndc(map, p));
        let moved = (here - there).truncate().abs().max_element();
        // The direction itself is rounded: over the way, and for a lamp over its distance.
        let rounding = product_rounding(map, q) + product_rounding(map, q + way);
        sideways.note(moved, 1e-15 + 0.5 * rounding, map);
        let row = map.clip_from_world_at(map.origin(), ClipSpace::WGPU).row(2);
        if here.z - there.z < 1e-13 + rounding {
            assert!(here.z > there.z - 1e-13 - rounding, "{here} {there}");
        }
        let w = |q: DVec3| map.w(q + map.origin());
        // z/w falls: z' w - z w' along the way, with z as it is about the point itself.
        let (z, w_here) = (row.dot(q.extend(1.0)), w(q));
        let fall = row.truncate().dot(way) * w_here - z * (w(q + way) - w_here);
        assert!(fall < 0.0, "{fall} {map:?}");
        let depth = scene.view.forward().dot(light.truncate() - scene.view.eye() * light.w);
        let size = if light.w == 0.0 { 1.0 } else { scene.view.eye().length() };
        if depth.abs() <= 1e-12 * size {
            on_plane += 1;
        } else if depth > 0.0 {
            before += 1;
        } else {
            behind += 1;
        }
    });
    sideways.finish();
    println!("{before} before the eye, {behind} behind it, {on_plane} on its plane");
    assert!(before.min(behind) > 300 && on_plane > 100, "{before} {behind} {on_plane}");
}

/// A camera along z from near to far, symmetric, and all that it sees.
pub(crate) fn plain(near: f64, far: f64, [x, y]: [f64; 2], to_light: DVec3) -> Scene {
    let view = View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, 2.0 * y.atan(), x / y, near..far).unwrap();
    let all = box_about(DVec3::ZERO, DVec3::splat(2.0 * far * x.max(y).max(1.0)));
    Scene::new(view, to_light, &[all], all)
}

pub(crate) fn tangents() -> impl Strategy<Value = [f64; 2]> + Clone {
    [log_between(0.1, 2.0), log_between(0.1, 2.0)]
}

/// LSP-26.
#[test]
fn continuous_where_the_light_passes_the_camera_plane() {
    let mut worst = Ratchet::new("LSP-26");
    let strategy = (0.0..core::f64::consts::TAU, tangents(), log_between(2.0, 100.0));
    check("LSP-26", 2 * CASES, strategy, |(turn, size, far)| {
        // First order: by the light's move in the camera's space.
        let allowed = 4.4e-9 * (1.0 + size[0].max(size[1]) * (1.0 + 1.0 / (1.0 - 1.0 / far)));
        for aim in [Aim::Closest, Aim::Centre] {
            let [on, before, behind] = [0.0, 1e-9, -1e-9].map(|z| {
                let scene = plain(1.0, far, size, DVec3::new(turn.cos(), turn.sin(), z));
                let map = scene.fit().solve(rule(aim, 0.0)).unwrap();
                let points = scene.receivers(map.origin());
                let places: Vec<_> = points.iter().map(|q| ndc(&map, *q)).collect();
                (places, map.warp().excess())
            });
            for side in [before, behind] {
                for (a, b) in on.0.iter().zip(&side.0) {
                    worst.note((*a - *b).abs().max_element(), allowed, (a, b));
                }
                worst.note((on.1 / side.1 - 1.0).abs(), allowed, aim);
            }
        }
    });
    worst.finish();
}

/// LSP-27, for any sun in the picture, or opposite.
#[test]
fn a_sun_in_the_picture_makes_a_uniform_map() {
    let place = [-0.999..0.999, -0.999..0.999];
    let sun = prop_oneof![Just([0.0; 2]), place];
    let strategy = (log_between(1e-4, 10.0), log_between(1.5, 1e7), tangents(), sun, any::<bool>());
    check("LSP-27", 2 * CASES, strategy, |(near, far, [x, y], [a, b], opposite)| {
        let sun = DVec3::new(a * x, b * y, 1.0);
        let scene = plain(near, near * far, [x, y], if opposite { -sun } else { sun });
        let map = scene.fit().solve(Rule::PSM).unwrap();
        assert_eq!(map.warp().excess().to_bits(), 0);
        let w = map.clip_from_world_at(map.origin(), ClipSpace::WGPU).row(3);
        assert_eq!(w.truncate(), DVec3::ZERO);
    });
    // And of random scenes, those with light and view parallel.
    let mut seen = 0;
    for kind in [Kind::Parallel, Kind::Opposite] {
        check(&format!("LSP-27/{kind:?}"), CASES, moderate(kind), |scene| {
            if matches!(scene.view.lens(), Lens::Perspective(s) if s.left + s.right == 0.0) {
                seen += 1;
                let map = scene.fit().solve(Rule::PSM).unwrap();
                assert_eq!(map.warp().excess().to_bits(), 0);
            }
        });
    }
    assert!(seen > 100, "{seen}");
}

/// LSP-28: moved back by `sqrt(n f)`, under a light across the view, this is LiSPSM; not moved, its
/// ratio is `f/n`.
#[test]
fn moved_back_by_the_mean_depth_it_is_lispsm() {
    let (mut excess, mut same) = (Ratchet::new("LSP-28 excess"), Ratchet::new("LSP-28 map"));
    let to_light = select(vec![DVec3::Y, DVec3::X, DVec3::NEG_Y]);
    let strategy = (log_between(1e-3, 10.0), log_between(1.01, 1e6), tangents(), to_light);
    check("LSP-28", 4 * CASES, strategy, |(near, far, tangents, to_light)| {
        let far = near * far;
        let scene = plain(near, far, tangents, to_light);
        let mean = (near * far).sqrt();
        let lispsm = scene.fit().solve(Rule::LISPSM).unwrap();
        for aim in [Aim::Closest, Aim::Centre] {
            let map = scene.fit().solve(rule(aim, mean)).unwrap();
            let [a, b] = [&map, &lispsm].map(|map| map.warp().excess());
            // The excess is a difference of ratios.
            excess.note((a - b).abs(), 4e-15 * (1.0 + b), (a, b));
            excess.note((b - ((far / near).sqrt() - 1.0)).abs(), 4e-15 * (1.0 + b), b);
            for q in scene.receivers(map.origin()) {
                let [p, expected] = [&map, &lispsm].map(|map| ndc(map, q));
                same.note((p - expected).abs().max_element(), 1e-13 * (1.0 + b), (p, expected));
            }
            let [p, q] = [&map, &lispsm].map(|m| m.texel_extent(DVec3::Z * mean));
            same.note((p[0] / q[0] - 1.0).abs().max((p[1] / q[1] - 1.0).abs()), 1e-12, aim);
            let whole = scene.fit().solve(rule(aim, 0.0)).unwrap().warp().ratio();
            excess.note((whole / (far / near) - 1.0).abs(), 1e-14, aim);
        }
    });
    excess.finish();
    same.finish();
}

/// A texel's extent, from the matrix by differences, where the picture of the eye lies.
#[test]
fn texels_are_as_large_as_the_matrix_says() {
    let mut worst = Ratchet::new("texels of a perspective map");
    each_map("texels-of-PSM", any::<prop::sample::Index>(), |scene, map, receivers, index| {
        let light = map.light_space();
        let fit = Fit { map_size: [512, 2048], ..scene.fit() };
        let Ok(map) = fit.solve(Rule::PSM) else { return };
        if scene.light.as_directional().is_err() || map.warp().ratio() > 1e4 || !is_solid(scene) {
            return;
        }
        let [across, height, along] = sizes(receivers, &map);
        if across.min(along) < 1e-3 * height.max(across).max(along) {
            return;
        }
        // On the line along the warp through the place of the body's extents that is nearest to the
        // eye there is no shear.
        let space = map.light_space();
        assert!((space.y - light.y).length() < 1e-15);
        let of_view = shadow_warp::LightSpace::new(&scene.view, &scene.light).unwrap();
        let nearest = |axis: DVec3| {
            let [low, high] = extent(receivers.iter().map(|q| axis.dot(*q)));
            axis * axis.dot(scene.view.eye() - map.origin()).clamp(low, high)
        };
        let at = space.x.dot(nearest(of_view.x) + nearest(of_view.z));
        let q = *index.get(receivers);
        let q = q + space.x * (at - space.x.dot(q));
        let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
        let (w, p) = (matrix.row(3), q.extend(1.0));
        let derivative = |row: usize, axis: DVec3| {
            let row = matrix.row(row);
            (row.truncate().dot(axis) * w.dot(p) - row.dot(p) * w.truncate().dot(axis)) / (w.dot(p) * w.dot(p))
        };
        let [x_x, x_z, y_x, y_z] =
            [(0, space.x), (0, space.z), (1, space.x), (1, space.z)].map(|(row, axis)| derivative(row, axis));
        let determinant = x_x * y_z - x_z * y_x;
        let expected = [DVec2::new(y_z, y_x) * (2.0 / 512.0), DVec2::new(x_z, x_x) * (2.0 / 2048.0)]
            .map(|v| v.length() / determinant.abs());
        let found = map.texel_extent(q + map.origin());
        let rounding = 8.0 * f64::EPSILON * map.origin().length() * map.warp().ratio() / across.min(along);
        let conditioning = (x_x.abs() + x_z.abs()) * (y_x.abs() + y_z.abs()) / determinant.abs();
        for (a, b) in found.into_iter().zip(expected) {
            worst.note((a / b - 1.0).abs(), 0.5 * (1e-14 + rounding) * conditioning, (a, b, map));
        }
    });
    worst.finish();
}
