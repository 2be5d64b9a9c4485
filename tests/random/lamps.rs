//! Strategies for scenes under a light with a position.

use proptest::option::weighted;
use proptest::prelude::*;
use shadow_warp::glam::DVec3;
use shadow_warp::{Light, ShadowMap};

use super::basic::{direction, inside, log_between, unit, within};
use super::check;
use super::measure::{Scene, box_about, lit, ndc, rounding, spot};
use super::scenes::{Cameras, in_picture, region, surround, view};

/// Where a lamp hangs.
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

const CAMERAS: Cameras =
    Cameras { world: 100.0, near: [1e-2, 1.0], ratio: [10.0, 1e5], far: f64::INFINITY, tangent: [0.05, 2.0] };

/// A visible scene under a spot light, which mostly shines at a place in view: cones from 0.001 to
/// 89.9 degrees, ranges up to 1e6 times the near distance.
pub(crate) fn lamp(place: Place) -> impl Strategy<Value = Scene> + Clone {
    let target = ([-0.9..0.9, -0.9..0.9], 0.01..0.99);
    let position = (log_between(0.1, 10.0), [-1.0..1.0, -1.0..1.0], unit(), direction());
    let cone = (log_between(1e-3, 89.9), log_between(1e-6, 0.5), log_between(0.5, 100.0));
    let aim = (inside(0.1), weighted(0.1, Just(())));
    let more = weighted(0.5, log_between(0.01, 1.0));
    (view(CAMERAS), target, position, cone, aim, region(), more, surround()).prop_filter_map(
        "a lamp without a direction",
        move |(
            view,
            (picture, depth),
            (reach, slant, share, anywhere),
            cone,
            (aside, away),
            region,
            more,
            surround,
        )| {
            let depth = view.near() * (view.far() / view.near()).powf(depth);
            let target = in_picture(&view, picture, depth);
            let reach = depth * reach;
            let slant = view.right() * slant[0] + view.up() * slant[1];
            let position = match place {
                Place::Anywhere => target + anywhere * reach,
                Place::InView => in_picture(&view, picture.map(|x| -x), depth * share),
                Place::OnAxis => view.eye() + view.forward() * (2.0 * share - 1.0) * reach,
                Place::AtEye => view.eye(),
                Place::Beside => view.eye() + slant * reach,
                Place::BehindEye => view.eye() + (slant - view.forward()) * reach,
                Place::BeforeEye => view.eye() + (view.forward() + 0.3 * slant) * depth * (0.1 + 0.7 * share),
            };
            let distance = position.distance(target);
            let ahead = if place == Place::BeforeEye { view.forward() } else { (target - position) / distance };
            let direction = if away.is_some() { aside - ahead } else { aside + ahead };
            let (angle, start, range) = cone;
            let start = distance * start;
            let range = (distance * range).min(1e6 * start).max(1.5 * start);
            let light = Light::spot(position, direction, angle.to_radians(), start, range).ok()?;
            let about = more.map(|size| box_about(target, DVec3::splat(reach * size)));
            let boxes: Vec<_> = [region.of(&view)].into_iter().chain(about).collect();
            Some(Scene { light, ..Scene::new(view, DVec3::Y, &boxes, surround.of(&boxes)) })
        },
    )
}

/// Runs a property on scenes with a lamp at each place, so many of each, with values of a strategy.
pub(crate) fn each_lamp<E: Strategy + Clone>(
    name: &str,
    cases: u32,
    more: E,
    mut property: impl FnMut(Scene, Place, E::Value),
) {
    for place in PLACES {
        let strategy = (lamp(place), more.clone());
        check(&format!("{name}/{place:?}"), cases, strategy, |(scene, more)| property(scene, place, more));
    }
}

/// What chooses a point of the casters' box: anywhere, and on the way from a receiver to the lamp.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Probe {
    share: DVec3,
    receiver: prop::sample::Index,
    way: f64,
}

pub(crate) fn probes() -> impl Strategy<Value = [Probe; 8]> + Clone {
    let probe = (within(DVec3::ZERO, DVec3::ONE), any::<prop::sample::Index>(), unit())
        .prop_map(|(share, receiver, way)| Probe { share, receiver, way });
    [(); 8].map(|()| probe.clone())
}

/// Asserts that no point of the casters' box between the near plane of a lamp and a receiver lies
/// before the map's near plane, and returns the least depth of those that were tried, 1 if there
/// were none.
pub(crate) fn assert_casters_are_shown(scene: &Scene, map: &ShadowMap, probes: &[Probe]) -> f64 {
    let (lamp, casters) = (spot(&scene.light), &scene.casters);
    let (receivers, mut nearest) = (lit(scene, map.origin()), 1.0_f64);
    let size = casters.max() - casters.min();
    let anywhere = |probe: &Probe| casters.min() + size * probe.share;
    // Corners too.
    let corner = |probe: &Probe| casters.min() + size * probe.share.round();
    // What the lamp shines on may be a small part.
    let between = |probe: &Probe| {
        let receiver = *probe.receiver.get(&receivers) + map.origin();
        receiver.lerp(lamp.position(), probe.way).clamp(casters.min(), casters.max())
    };
    for point in probes.iter().flat_map(|probe| [anywhere(probe), corner(probe), between(probe)]) {
        let q = point - map.origin();
        let base = lamp.direction().dot(point - lamp.position());
        // The box is cut with a rounding of its size to spare, which is much of a narrow cone near
        // its lamp, and more where a strong warp begins.
        let slack = 64.0 * f64::EPSILON * size.length() * map.warp().ratio() / lamp.outer_angle().min(1.0);
        let started = base > lamp.near() * (1.0 + 1e-12) && rounding(scene, map, q) < 1e-4 && slack < 1e-3 * base;
        let place = ndc(map, q);
        if started && map.w(point) > 0.0 && place.truncate().abs().max_element() <= 1.0 {
            assert!(place.z >= -1e-12 - rounding(scene, map, q), "{place} {map:?}");
            nearest = nearest.min(place.z);
        }
    }
    nearest
}
