//! What the matrix of a map does to points.

use crate::random::Ratchet;
use crate::random::basic::{log_between, mixture, unit};
use crate::random::measure::{Scene, box_about, extent, ndc, product_rounding, project, sizes};
use crate::random::scenes::{each_kind, each_map, rule};
use crate::{CASES, allowance};
use approx::assert_abs_diff_eq;
use proptest::prelude::*;
use shadow_warp::glam::{DMat3, DVec3, DVec4};
use shadow_warp::{Axes, ClipSpace, LightSpaceRule, NearDepth, Rule, ShadowMap, Warp};

/// The directions that the texture's axes follow.
fn texture_axes(scene: &Scene, map: &ShadowMap) -> [DVec3; 2] {
    let space = map.light_space();
    if scene.axes == Axes::LightFixed { space.fixed_axes() } else { [space.x, space.z] }
}

/// LSP-1, LSP-2: receivers fill the four sides and reach the far plane; casters reach the near
/// plane.
#[test]
fn contains_and_touches() {
    let (mut inside, mut touch) = (Ratchet::new("LSP-1"), Ratchet::new("LSP-2"));
    let (mut touched, mut by_casters) = (0, 0);
    each_map("LSP-1", CASES, Just(()), |scene, map, receivers, ()| {
        let allowed = allowance(map.warp().excess());
        let points: Vec<_> = receivers.iter().map(|q| ndc(map, *q)).collect();
        let casters = scene.caster_points(map.origin());
        // Casters may be far beyond the receivers, where the product itself rounds.
        let far_allowed = allowed + extent(casters.iter().map(|q| product_rounding(map, *q)))[1].max(0.0);
        let casters: Vec<_> = casters.iter().map(|q| ndc(map, *q)).collect();
        let [low, high] = [0, 1, 2].map(|a| extent(points.iter().map(|p| p[a]))).map_ends();
        let [above, _] = extent(casters.iter().map(|p| p.z));
        for axis in [0, 1] {
            inside.note((-1.0 - low[axis]).max(high[axis] - 1.0), allowed, map);
        }
        inside.note((-low.z).max(high.z - 1.0), allowed, map);
        inside.note(-above, far_allowed, map);
        for caster in &casters {
            inside.note(caster.x.abs().max(caster.y.abs()) - 1.0, far_allowed, map);
        }
        // A body that is flat along an axis is fitted as if it were thicker.
        let [_, height, _] = sizes(receivers, map);
        let [across, along] = texture_axes(scene, map).map(|axis| {
            let [low, high] = extent(receivers.iter().map(|q| axis.dot(*q)));
            high - low
        });
        let thick = 1e-5 * across.max(height).max(along);
        if across.min(along) > thick {
            touch.note((low.x + 1.0).abs().max((high.x - 1.0).abs()), allowed, map);
            touch.note((low.y + 1.0).abs().max((high.y - 1.0).abs()), allowed, map);
            touched += 1;
        }
        if height > thick && !scene.is_edge_on() {
            touch.note((high.z - 1.0).abs(), allowed, map);
            touch.note(low.z.min(above).abs(), far_allowed, map);
            by_casters += usize::from(above < low.z - 0.01);
        }
    });
    inside.finish();
    touch.finish();
    assert!(touched > 700 && by_casters > 200, "{touched} {by_casters}");
}

trait Ends {
    fn map_ends(self) -> [DVec3; 2];
}

impl Ends for [[f64; 2]; 3] {
    fn map_ends(self) -> [DVec3; 2] {
        [DVec3::from_array(self.map(|e| e[0])), DVec3::from_array(self.map(|e| e[1]))]
    }
}

/// With the near plane at the receivers, they fill all six bounds.
#[test]
fn receivers_touch_the_near_plane_if_asked_to() {
    let mut touch = Ratchet::new("near depth of receivers");
    each_kind("near-depth", CASES, rule(), |mut scene, _, rule| {
        scene.near_depth = NearDepth::Receivers;
        let map = scene.fit().solve(rule).unwrap();
        let receivers = scene.receivers(map.origin());
        let [low, high] = extent(receivers.iter().map(|q| ndc(&map, *q).z));
        let allowed = 0.3 * allowance(map.warp().excess());
        let [across, height, along] = sizes(&receivers, &map);
        touch.note((-low).max(high - 1.0), allowed, map);
        if height > 1e-5 * across.max(along) {
            touch.note(low.abs().max((high - 1.0).abs()), allowed, map);
        }
    });
    touch.finish();
}

/// LSP-3, LSP-4, over way as long as the body is large, both ways.
#[test]
fn light_rays_stay_in_their_texel() {
    let mut sideways = Ratchet::new("LSP-3");
    let mut strict = 0;
    each_map("LSP-3", CASES, (mixture(), log_between(1e-3, 1.0)), |scene, map, receivers, (q, share)| {
        let q = q.of(receivers);
        let [across, height, along] = sizes(receivers, map);
        let way = scene.to_light() * across.max(height).max(along).max(1e-3) * share;
        let row = map.clip_from_world_at(map.origin(), ClipSpace::WGPU).row(2);
        let fall = row.truncate().dot(way) / map.w(q + map.origin());
        let [here, towards, away] = [q, q + way, q - way].map(|p| ndc(map, p));
        let thin = 1.0 + (across.max(height).max(along) / across.min(along)).min(1e6);
        for there in [towards, away] {
            let moved = (here - there).truncate().abs().max_element();
            sideways.note(moved, 0.04 * allowance(map.warp().excess()) * thin + 1.5e-14, map);
        }
        // What rounding hides at the far end of a strong warp need not show.
        if fall < -1e-13 * map.warp().ratio() {
            assert!(towards.z < here.z && here.z < away.z, "LSP-4 {towards} {here} {away}");
            strict += 1;
        }
        assert!(fall < 0.0, "LSP-4 {fall}");
    });
    sideways.finish();
    assert!(strict > 700, "{strict}");
}

/// LSP-5.
#[test]
fn w_runs_from_one_to_the_ratio() {
    let mut worst = Ratchet::new("LSP-5");
    each_map("LSP-5", CASES, Just(()), |_, map, receivers, ()| {
        let w = |q: &DVec3| map.w(*q + map.origin());
        let row = map.clip_from_world_at(map.origin(), ClipSpace::WGPU).row(3);
        let [low, high] = extent(receivers.iter().map(|q| row.dot(q.extend(1.0))));
        let [across, height, along] = sizes(receivers, map);
        let ratio = map.warp().ratio();
        let allowed = 2e-13 + 8.0 * f64::EPSILON * ratio;
        worst.note(1.0 - low, allowed, map);
        worst.note(high / ratio - 1.0, 2e-13, map);
        if along > 1e-5 * across.max(height) {
            worst.note((low - 1.0).abs(), allowed, map);
            worst.note((high / ratio - 1.0).abs(), 2e-13, map);
            // It is 1 at the near end: the other way round would give the texels to what is far.
            let z = map.light_space().z;
            let nearest = receivers.iter().copied().reduce(|a, b| if z.dot(b) < z.dot(a) { b } else { a }).unwrap();
            worst.note((row.dot(nearest.extend(1.0)) - 1.0).abs(), allowed, map);
        }
        // The same by the map's own function, which takes points in the world.
        let world = 1e3 * f64::EPSILON * 1e4 / along.max(1e-6);
        worst.note((w(&receivers[0]) - row.dot(receivers[0].extend(1.0))).abs(), (world + 1e-12) * ratio, map);
    });
    worst.finish();
}

/// LSP-7.
#[test]
fn no_excess_is_uniform() {
    each_kind("LSP-7", CASES, Just(()), |scene, _, ()| {
        let solve = |rule| scene.fit().solve(rule).unwrap();
        let nothing = solve(Rule::Explicit(Warp::new(1e-300).unwrap()));
        let uniform = solve(Rule::Uniform);
        let matrix = |map: &ShadowMap| map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
        assert_abs_diff_eq!(matrix(&nothing), matrix(&uniform), epsilon = 1e-280);
        assert_eq!(matrix(&uniform).row(3), DVec4::W);
    });
}

/// LSP-8: `v_perp/(z_n (1 + sqrt(1 + d |v_perp|/z_n)))`, with no division by the sine.
#[test]
fn w_gradient_is_the_view_across_the_light() {
    let mut worst = Ratchet::new("LSP-8");
    each_kind("LSP-8", CASES, Just(()), |scene, _, ()| {
        let map = scene.fit().solve(Rule::LightSpace(LightSpaceRule::Extent)).unwrap();
        let (v, l) = (scene.view.forward(), scene.to_light());
        let receivers = scene.receivers(map.origin());
        let [across, height, along] = sizes(&receivers, &map);
        if along < 1e-5 * across.max(height) {
            return;
        }
        let perpendicular = l.cross((if v.dot(l) >= 0.0 { v - l } else { v + l }).cross(l));
        let delta = extent(receivers.iter().map(|q| perpendicular.dot(*q)));
        let eye_depth = v.dot(scene.view.eye() - map.origin());
        let near = (extent(receivers.iter().map(|q| v.dot(*q)))[0] - eye_depth).max(scene.view.near());
        let expected = perpendicular / (near * (1.0 + (1.0 + (delta[1] - delta[0]) / near).sqrt()));
        let row = map.clip_from_world_at(map.origin(), ClipSpace::WGPU).row(3).truncate();
        // The near depth is that of a vertex, which is rounded like the body.
        let size = receivers.iter().map(|q| q.length()).fold(eye_depth.abs(), f64::max);
        let allowed = 1e-15 + f64::EPSILON * size / near;
        worst.note((row - expected).length(), allowed * expected.length(), map);
    });
    worst.finish();
}

/// LSP-9.
#[test]
fn y_multiplies_the_odds() {
    let mut worst = Ratchet::new("LSP-9");
    each_map("LSP-9", CASES, mixture(), |scene, map, receivers, q| {
        let [across, height, along] = sizes(receivers, map);
        if scene.axes == Axes::LightFixed || along < 1e-3 * across.max(height) {
            return;
        }
        let z = map.light_space().z;
        let q = q.of(receivers);
        let [z0, z1] = extent(receivers.iter().map(|p| z.dot(*p)));
        let t = ((z.dot(q) - z0) / (z1 - z0)).clamp(0.0, 1.0);
        let s = 0.5 * (ndc(map, q).y + 1.0);
        let allowed = 1e-14 + f64::EPSILON * map.warp().ratio();
        worst.note((s - map.warp().map_from_body(t)).abs(), allowed, map);
        // s/(1 - s) = rho t/(1 - t), multiplied out so that both ends count.
        let rho = map.warp().ratio();
        worst.note((s * (1.0 - t) - rho * t * (1.0 - s)).abs() / rho.max(1.0), allowed, map);
    });
    worst.finish();
}

/// LSP-11.
#[test]
fn conventions_of_depth() {
    let mut worst = Ratchet::new("LSP-11");
    each_map("LSP-11", CASES, mixture(), |_, map, receivers, q| {
        let q = q.of(receivers);
        let at = |space: ClipSpace| project(map.clip_from_world_at(map.origin(), space) * q.extend(1.0));
        let [d, gl, reversed] = [ClipSpace::WGPU, ClipSpace::OPENGL, ClipSpace::WGPU.reversed()].map(at);
        let allowed = 3e-15 * map.warp().ratio();
        worst.note((gl.z - (2.0 * d.z - 1.0)).abs(), allowed, map);
        worst.note((reversed.z - (1.0 - d.z)).abs(), allowed, map);
        assert_eq!((gl.truncate(), reversed.truncate()), (d.truncate(), d.truncate()));
    });
    worst.finish();
}

/// LSP-12: sweeping the receivers towards the light changes neither of the other two extents.
#[test]
fn casters_change_depth_alone() {
    let rule = rule().prop_filter("casters far away limit a warp that is as strong", |rule| match rule {
        Rule::Explicit(warp) => warp.excess() < 1e4,
        _ => true,
    });
    each_kind("LSP-12", CASES, rule, |mut scene, _, rule| {
        let with = scene.fit().solve(rule).unwrap();
        let low = with.clip_from_world_at(with.origin(), ClipSpace::WGPU);
        scene.casters = box_about(scene.view.eye(), DVec3::splat(100.0 * scene.view.far()));
        let high = scene.fit().solve(rule).unwrap().clip_from_world_at(with.origin(), ClipSpace::WGPU);
        for row in [0, 1, 3] {
            assert_eq!(low.row(row), high.row(row));
        }
        assert_ne!(low.row(2), high.row(2));
    });
}

/// LSP-13: the winding of an ordinary camera, whose matrix has a negative determinant.
#[test]
fn winding() {
    let mut worst = Ratchet::new("LSP-13");
    each_map("LSP-13", CASES, Just(()), |_, map, _, ()| {
        let space = map.light_space();
        worst.note((DMat3::from_cols(space.x, space.z, -space.y).determinant() + 1.0).abs(), 2e-15, map);
        // The rows of a strong warp are so nearly dependent that f64 does not tell the sign.
        if map.warp().excess() < 1e4 {
            let of = |space| map.clip_from_world_at(map.origin(), space).determinant();
            assert!(of(ClipSpace::WGPU) < 0.0 && of(ClipSpace::OPENGL) < 0.0);
            assert!(of(ClipSpace::WGPU.reversed()) > 0.0 && of(ClipSpace::VULKAN) > 0.0);
        }
    });
    worst.finish();
}

/// LSP-19, LSP-20: the map is projective.
#[test]
fn cross_ratios_and_planes_are_kept() {
    let (mut ratio, mut flat) = (Ratchet::new("LSP-19"), Ratchet::new("LSP-20"));
    let points = [mixture(), mixture(), mixture()];
    let more = (points, 0.1..0.4, 0.5..0.7, (unit(), unit()));
    let (mut compared, mut bent) = (0, 0);
    each_map("LSP-19", 2 * CASES, more, |_, map, receivers, (points, second, third, (u, v))| {
        let eta = map.warp().excess();
        let [across, height, along] = sizes(receivers, map);
        if along < 1e-3 * across.max(height) || eta > 1e4 {
            return;
        }
        let [a, b, c] = points.map(|p| p.of(receivers));
        let z = map.light_space().z;
        if z.dot(b - a).abs() < 1e-2 * along {
            return;
        }
        let places = [0.0, second, third, 1.0];
        let image = places.map(|t| ndc(map, a.lerp(b, t)));
        let direction = (image[3] - image[0]).normalize();
        let mapped = image.map(|p| direction.dot(p - image[0]));
        if mapped.windows(2).any(|pair| pair[1] - pair[0] < 1e-3) {
            return;
        }
        let cross = |[p, q, r, s]: [f64; 4]| (p - r) * (q - s) / ((p - s) * (q - r));
        ratio.note((cross(mapped) / cross(places) - 1.0).abs(), 1e-13 + f64::EPSILON * eta, map);

        let fourth = a + (b - a) * u + (c - a) * 0.5 * v;
        let [p, q, r, s] = [a, b, c, fourth].map(|c| ndc(map, c));
        let volume = (q - p).cross(r - p).dot(s - p);
        flat.note(volume.abs(), 1e-14 * (1.0 + (s - p).length()), map);
        compared += 1;
        bent += u32::from((mapped[1] - second).abs() > 0.1);
    });
    ratio.finish();
    flat.finish();
    assert!(compared > 500, "{compared} {bent}");
}
