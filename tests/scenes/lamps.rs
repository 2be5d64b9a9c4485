//! Random scenes under a light with a position.

use super::random::Random;
use super::{Scene, caster_box, ndc, product_rounding, receiver_box, view};
use shadow_warp::glam::DVec3;
use shadow_warp::{ClipSpace, Light, ShadowMap, Spot};

/// Where a lamp hangs. Each place must turn up in every run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    Anywhere,
    /// In the view volume.
    InView,
    /// On the line of sight, to a rounding, before the eye or behind it.
    OnAxis,
    AtEye,
    /// In the plane through the eye across the view.
    Beside,
    BehindEye,
    /// Before the eye, shining on: the eye is behind the lamp.
    BeforeEye,
}

pub(crate) const PLACES: [Place; 7] =
    [Place::Anywhere, Place::InView, Place::OnAxis, Place::AtEye, Place::Beside, Place::BehindEye, Place::BeforeEye];

/// A visible scene under a spot light, which mostly shines at a place in view: cones from 0.001 to 89.9 degrees, ranges up to
/// 1e6 times the near distance.
pub(crate) fn lamp(case: u64) -> (Scene, Place) {
    let mut random = Random::new(case ^ 0x5107);
    let r = &mut random;
    loop {
        let near = r.log_between(1e-2, 1.0);
        let far = near * r.log_between(10.0, 1e5);
        let view = view(r, 100.0, near, far, [0.05, 2.0]);
        let depth = r.log_between(view.near(), view.far());
        let slant =
            |r: &mut Random, size: f64| view.right() * r.between(-size, size) + view.up() * r.between(-size, size);
        let target = view.eye() + (view.forward() + slant(r, 0.1)) * depth;
        let reach = depth * r.log_between(0.1, 10.0);
        let place = PLACES[r.below(PLACES.len())];
        let position = match place {
            Place::Anywhere => target + r.direction() * reach,
            Place::InView => view.eye() + (view.forward() + slant(r, 0.05)) * depth * r.unit(),
            Place::OnAxis => view.eye() + view.forward() * r.between(-1.0, 1.0) * reach,
            Place::AtEye => view.eye(),
            Place::Beside => view.eye() + slant(r, 1.0) * reach,
            Place::BehindEye => view.eye() + (slant(r, 1.0) - view.forward()) * reach,
            Place::BeforeEye => view.eye() + (view.forward() + slant(r, 0.3)) * depth * r.between(0.1, 0.8),
        };
        let distance = position.distance(target);
        let away = if r.below(10) == 0 { -1.0 } else { 1.0 };
        let ahead = if place == Place::BeforeEye { view.forward() } else { (target - position) / distance };
        let direction = away * ahead + r.inside(0.1);
        let angle = r.log_between(1e-3, 89.9).to_radians();
        let start = distance * r.log_between(1e-6, 0.5);
        let range = (distance * r.log_between(0.5, 100.0)).min(1e6 * start).max(1.5 * start);
        let Ok(light) = Light::spot(position, direction, angle, start, range) else { continue };
        let boxes = [receiver_box(r, &view), super::box_about(target, DVec3::splat(reach * r.log_between(0.01, 1.0)))];
        let boxes = &boxes[..1 + r.below(2)];
        let casters = caster_box(r, boxes);
        let mut scene = Scene::new(view, DVec3::Y, boxes, casters);
        scene.light = light;
        if scene.is_visible() {
            return (scene, place);
        }
    }
}

pub(crate) fn spot(light: &Light) -> &Spot {
    match light {
        Light::Spot(spot) => spot,
        _ => unreachable!("a lamp is a spot light"),
    }
}

/// The vertices of what the light shines on, relative to a point: the receivers as they are, under a light at infinity.
pub(crate) fn lit(scene: &Scene, origin: DVec3) -> Vec<DVec3> {
    let relative = |body: shadow_warp::LitBody| {
        let shift = body.origin() - origin;
        body.vertices().iter().map(move |v| *v + shift).collect::<Vec<_>>()
    };
    scene.fit().lit_receivers().flat_map(relative).collect()
}

/// Asserts that no point of the casters' box between the near plane of a lamp and a receiver lies before the map's near
/// plane, and returns the least depth of those that were tried, 1 if there were none.
pub(crate) fn assert_casters_are_shown(scene: &Scene, map: &ShadowMap, random: &mut Random) -> f64 {
    let (lamp, casters) = (spot(&scene.light), &scene.casters);
    let size = casters.max() - casters.min();
    let (receivers, mut nearest) = (lit(scene, map.origin()), 1.0_f64);
    for try_ in 0..64 {
        let share = DVec3::new(random.unit(), random.unit(), random.unit());
        // Corners too.
        let share = if try_ < 8 { share.round() } else { share };
        let anywhere = casters.min() + size * share;
        // Half of them between the lamp and what it shines on, which may be a small part.
        let between = receivers[try_ % receivers.len()] + map.origin();
        let between = between.lerp(lamp.position(), random.unit()).clamp(casters.min(), casters.max());
        let q = if try_ % 2 == 0 { anywhere } else { between } - map.origin();
        let place = ndc(map, q);
        let started = lamp.direction().dot(q + map.origin() - lamp.position()) > lamp.near() * (1.0 + 1e-12);
        // The box is cut with a rounding of its size to spare, which is much of a narrow cone near its lamp, and more where a
        // strong warp begins.
        let base = lamp.direction().dot(q + map.origin() - lamp.position());
        let slack = 64.0 * f64::EPSILON * size.length() * map.warp().ratio() / lamp.outer_angle().min(1.0);
        let started = started && rounding(scene, map, q) < 1e-3 && slack < 1e-3 * base;
        if started && map.w(q + map.origin()) > 0.0 && place.truncate().abs().max_element() <= 1.0 {
            assert!(place.z >= -1e-12 - rounding(scene, map, q), "{place} {scene:?} {map:?}");
            nearest = nearest.min(place.z);
        }
    }
    nearest
}

/// What rounding allows at a point relative to the map's origin: of its product with the matrix, and of a lamp's place, which
/// counts where the lamp is far from a small part that it shines on.
pub(crate) fn rounding(scene: &Scene, map: &ShadowMap, q: DVec3) -> f64 {
    let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
    let light = scene.light.homogeneous();
    let distance = if light.w == 0.0 { 0.0 } else { (light.truncate() - map.origin()).length() };
    let steep = [0, 1, 2, 3].map(|row| matrix.row(row).truncate().length()).into_iter().fold(0.0, f64::max);
    product_rounding(map, q) + 64.0 * f64::EPSILON * steep * distance / matrix.row(3).dot(q.extend(1.0))
}
