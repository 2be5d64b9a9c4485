//! Strategies for scenes, near-degenerate on purpose: all of a scene is drawn about its view, so
//! that some of it is seen.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]

use proptest::option::weighted;
use proptest::prelude::*;
use proptest::sample::select;
use shadow_warp::glam::DVec3;
use shadow_warp::{Axes, Bounds, Lens, Light, Rule, ShadowMap, Sides, View, Warp};

use super::basic::{direction, inside, log_between, unit};
use super::check;
use super::measure::{LIGHT_SPACE_RULES, Scene, box_about, box_between};

/// Ranges of perspective cameras.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cameras {
    /// The greatest coordinate of the eye.
    pub(crate) world: f64,
    pub(crate) near: [f64; 2],
    /// Of the far distance over the near one.
    pub(crate) ratio: [f64; 2],
    /// The greatest far distance.
    pub(crate) far: f64,
    /// Of half of the field of view.
    pub(crate) tangent: [f64; 2],
}

pub(crate) const MODERATE: Cameras =
    Cameras { world: 1e3, near: [1e-4, 10.0], ratio: [1.5, 1e7], far: 1e3, tangent: [0.05, 3.0] };

/// A perspective camera: a quarter of them off-centre.
pub(crate) fn view(cameras: Cameras) -> impl Strategy<Value = View> + Clone {
    let Cameras { world, near, ratio, far, tangent } = cameras;
    let depth = (log_between(near[0], near[1]), log_between(ratio[0], ratio[1]));
    let up = prop_oneof![Just(DVec3::Y), direction()];
    let size = (log_between(tangent[0], tangent[1]), 0.0..0.7);
    let shift = weighted(0.25, (-2.0..2.0, -2.0..2.0));
    (inside(world), settled_direction(), up, depth, size, shift).prop_map(
        move |(eye, forward, up, (near, ratio), (size, flatness), shift)| {
            let up = if up.cross(forward).length() > 1e-3 { up } else { forward.any_orthonormal_vector() };
            let sides = Sides::centred(2.0 * size, 2.0 * size * (1.0 - flatness));
            let (x, y) = shift.map_or((0.0, 0.0), |(x, y)| (size * x, size * y));
            let sides =
                Sides { left: sides.left + x, right: sides.right + x, bottom: sides.bottom + y, top: sides.top + y };
            View::perspective_off_centre(eye, forward, up, sides, near..(near * ratio).min(far)).unwrap()
        },
    )
}

/// A direction that normalising does not change, so that a light can lie exactly along it.
pub(crate) fn settled_direction() -> impl Strategy<Value = DVec3> + Clone {
    let settled = direction().prop_filter_map("a direction that rounding turns", |d| {
        let light = |d: DVec3| Light::directional(d).unwrap().homogeneous().truncate();
        let once = light(d);
        (light(once) == once).then_some(once)
    });
    prop_oneof![1 => super::basic::axis(), 3 => settled]
}

/// What a light is to the view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Across,
    Any,
    NearParallel,
    NearOpposite,
    Parallel,
    Opposite,
    AlongUp,
}

pub(crate) const KINDS: [Kind; 7] =
    [Kind::Across, Kind::Any, Kind::NearParallel, Kind::NearOpposite, Kind::Parallel, Kind::Opposite, Kind::AlongUp];

/// A light, as its view has it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sun {
    kind: Kind,
    turn: f64,
    gamma: f64,
    anywhere: DVec3,
}

impl Sun {
    pub(crate) fn to_light(self, view: &View) -> DVec3 {
        let Self { kind, turn, gamma, anywhere } = self;
        let (v, u) = (view.forward(), view.up());
        let across = u * turn.cos() + view.right() * turn.sin();
        match kind {
            Kind::Any => anywhere,
            Kind::Across => across,
            Kind::NearParallel => v * gamma.cos() + across * gamma.sin(),
            Kind::NearOpposite => across * gamma.sin() - v * gamma.cos(),
            Kind::Parallel => v,
            Kind::Opposite => -v,
            Kind::AlongUp => u,
        }
    }
}

/// A light of one kind; angles to the view down to `least`.
pub(crate) fn sun(kind: Kind, least: f64) -> impl Strategy<Value = Sun> + Clone {
    (0.0..core::f64::consts::TAU, log_between(least, 1.0), direction()).prop_map(move |(turn, gamma, anywhere)| Sun {
        kind,
        turn,
        gamma,
        anywhere,
    })
}

/// Receivers, as their view has them.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Region {
    /// The whole view volume.
    All,
    /// A box about a point in the picture, at a share of the way from near to far in logarithm; its
    /// size over the depth.
    Part { place: [f64; 2], depth: f64, half: DVec3 },
}

impl Region {
    pub(crate) fn of(self, view: &View) -> Bounds {
        match self {
            Self::All => box_about(view.eye(), DVec3::splat(10.0 * view.far())),
            Self::Part { place, depth, half } => {
                let depth = view.near() * (view.far() / view.near()).powf(depth);
                box_about(in_picture(view, place, depth), half * depth)
            }
        }
    }
}

/// The point at a place in the picture, whose sides are at -1 and 1, and a depth.
pub(crate) fn in_picture(view: &View, [x, y]: [f64; 2], depth: f64) -> DVec3 {
    let Lens::Perspective(sides) = view.lens() else { unreachable!("these cameras are perspective") };
    let between = |low: f64, high: f64, t: f64| 0.5 * (low + high) + 0.5 * (high - low) * t;
    let slant = view.right() * between(sides.left, sides.right, x) + view.up() * between(sides.bottom, sides.top, y);
    view.eye() + (view.forward() + slant) * depth
}

/// One in three is the whole view volume; one in ten is flat.
pub(crate) fn region() -> impl Strategy<Value = Region> + Clone {
    let size = (log_between(1e-2, 10.0), [log_between(0.1, 1.0), log_between(0.1, 1.0)]);
    let part = ([-0.9..0.9, -0.9..0.9], 0.01..0.99, size, weighted(0.15, Just(()))).prop_map(
        |(place, depth, (size, [y, z]), flat)| {
            let half = size * DVec3::new(1.0, if flat.is_some() { 0.0 } else { y }, z);
            Region::Part { place, depth, half }
        },
    );
    prop_oneof![1 => Just(Region::All), 2 => part]
}

/// Casters, as the receivers have them, by their size.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Surround {
    /// Their bounds, grown below and above.
    Grown(f64, f64),
    /// A box beside their middle, and half of its size.
    Beside(DVec3, f64),
}

impl Surround {
    pub(crate) fn of(self, boxes: &[Bounds]) -> Bounds {
        let low = boxes.iter().fold(DVec3::MAX, |a, b| a.min(b.min()));
        let high = boxes.iter().fold(DVec3::MIN, |a, b| a.max(b.max()));
        let size = (high - low).max_element();
        match self {
            Self::Grown(below, above) => box_between(low - size * below, high + size * above),
            Self::Beside(place, half) => box_about(0.5 * (low + high) + size * place, DVec3::splat(size * half)),
        }
    }
}

pub(crate) fn surround() -> impl Strategy<Value = Surround> + Clone {
    prop_oneof![
        3 => (unit(), unit()).prop_map(|(below, above)| Surround::Grown(below, above)),
        1 => (inside(1.0), 0.05..0.6).prop_map(|(place, half)| Surround::Beside(place, half)),
    ]
}

/// A visible scene: world up to 1e3, far/near up to 1e7, angles between light and view down to 1e-9
/// and exactly 0 and pi, one or two boxes, some of them flat, casters that hold the receivers or
/// miss a part of them.
pub(crate) fn moderate(kind: Kind) -> impl Strategy<Value = Scene> + Clone {
    let axes = prop_oneof![2 => Just(Axes::View), 1 => Just(Axes::LightFixed)];
    let size = select(vec![[1024, 1024], [1024, 512], [512, 2048]]);
    (view(MODERATE), sun(kind, 1e-9), region(), weighted(0.25, region()), surround(), axes, size).prop_map(
        |(view, sun, region, other, surround, axes, map_size)| {
            let boxes: Vec<_> = [region].into_iter().chain(other).map(|region| region.of(&view)).collect();
            let scene = Scene::new(view, sun.to_light(&view), &boxes, surround.of(&boxes));
            Scene { axes, map_size, ..scene }
        },
    )
}

/// No warp, each published form by itself, and an explicit warp.
pub(crate) fn rule() -> impl Strategy<Value = Rule> + Clone {
    let explicit = log_between(1e-12, 1e8).prop_map(|excess| Rule::Explicit(Warp::new(excess).unwrap()));
    let published = LIGHT_SPACE_RULES.map(Rule::LightSpace);
    prop_oneof![1 => Just(Rule::Uniform), 4 => select(published.to_vec()), 1 => explicit]
}

/// Runs a property on moderate scenes under each kind of light, so many of each, with values of a
/// strategy.
pub(crate) fn each_kind<E: Strategy + Clone>(
    name: &str,
    cases: u32,
    more: E,
    mut property: impl FnMut(Scene, Kind, E::Value),
) {
    for kind in KINDS {
        let strategy = (moderate(kind), more.clone());
        check(&format!("{name}/{kind:?}"), cases, strategy, |(scene, more)| property(scene, kind, more));
    }
}

/// As [`each_kind`], with the map that some rule makes, and the receivers relative to its origin.
pub(crate) fn each_map<E: Strategy + Clone>(
    name: &str,
    cases: u32,
    more: E,
    mut property: impl FnMut(&Scene, &ShadowMap, &[DVec3], E::Value),
) {
    each_kind(name, cases, (rule(), more), |scene, _, (rule, more)| {
        let map = scene.fit().solve(rule).unwrap();
        property(&scene, &map, &scene.receivers(map.origin()), more);
    });
}
