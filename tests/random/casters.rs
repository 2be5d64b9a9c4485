//! Strategies for a light and a box of casters, about a camera and a box of receivers.

use proptest::prelude::*;
use proptest::sample::select;
use shadow_warp::glam::DVec3;
use shadow_warp::{Bounds, View};

use super::basic::{axis, direction, log_between, shares, unit};
use super::views::{Class, camera_and_box, corner};

/// Where the casters' box lies, seen from the receivers'.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Place {
    Same,
    Around,
    Inside,
    Partly,
    Above,
    Below,
    Beside,
    Flat,
}

impl Place {
    #[rustfmt::skip]
    pub(crate) const ALL: [Self; 8] = [
        Self::Same, Self::Around, Self::Inside, Self::Partly, Self::Above, Self::Below, Self::Beside, Self::Flat,
    ];
}

/// Where the light is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Sun {
    AlongAxis,
    NearAxis,
    Diagonal,
    InPlane,
    AlongView,
    Anywhere,
}

impl Sun {
    pub(crate) const ALL: [Self; 6] =
        [Self::AlongAxis, Self::NearAxis, Self::Diagonal, Self::InPlane, Self::AlongView, Self::Anywhere];
}

/// All that casters depend on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scene {
    pub(crate) class: Class,
    pub(crate) place: Place,
    pub(crate) sun: Sun,
    pub(crate) view: View,
    pub(crate) receivers: Bounds,
    pub(crate) casters: Bounds,
    pub(crate) to_light: DVec3,
}

/// Scenes of a class of cameras, with every kind of light and place of the casters.
pub(crate) fn scene(class: Class) -> impl Strategy<Value = Scene> {
    let kinds = (select(&Place::ALL[..]), select(&Sun::ALL[..]));
    (camera_and_box(class), kinds, choices()).prop_map(move |((view, receivers), (place, sun), choices)| {
        let to_light = choices.to_light(sun, &view);
        let casters = choices.casters(place, &receivers, to_light);
        Scene { class, place, sun, view, receivers, casters, to_light }
    })
}

#[derive(Clone, Copy, Debug)]
struct Choices {
    axis: DVec3,
    direction: DVec3,
    tilt: f64,
    octant: usize,
    first: usize,
    shares: [DVec3; 2],
    step: f64,
}

fn choices() -> impl Strategy<Value = Choices> {
    (axis(), direction(), log_between(1e-17, 1e-9), 0..8_usize, 0..3_usize, [shares(), shares()], unit()).prop_map(
        |(axis, direction, tilt, octant, first, shares, step)| Choices {
            axis,
            direction,
            tilt,
            octant,
            first,
            shares,
            step,
        },
    )
}

impl Choices {
    fn to_light(self, sun: Sun, view: &View) -> DVec3 {
        let octant = corner(DVec3::ONE, DVec3::NEG_ONE, self.octant);
        match sun {
            Sun::AlongAxis => self.axis,
            Sun::NearAxis => self.axis + self.tilt * self.direction,
            Sun::Diagonal => octant,
            Sun::InPlane => {
                let mut across = self.direction;
                across[self.first] = 0.0;
                if across.length() > 1e-3 { across } else { self.axis }
            }
            Sun::AlongView => octant.x * view.forward(),
            Sun::Anywhere => self.direction,
        }
    }

    fn casters(&self, place: Place, receivers: &Bounds, to_light: DVec3) -> Bounds {
        let (low, high) = (receivers.min(), receivers.max());
        let extent = high - low;
        let size = extent.max_element().max(1e-6);
        // Beyond the box along the axis that the light is nearest to.
        let axis = (0..3).fold(0, |a, b| if to_light[b].abs() > to_light[a].abs() { b } else { a });
        let up = DVec3::AXES[axis] * to_light[axis].signum() * (extent[axis] + (1.0 - 0.99 * self.step) * size);
        let side = (axis + 1) % 3;
        let sign = if self.octant % 2 == 0 { 1.0 } else { -1.0 };
        let beside = DVec3::AXES[side] * (sign * (extent[side] + 0.02 * size));
        let [s, t] = self.shares;
        let by = |by: DVec3| (low + by, high + by);
        let (low, high) = match place {
            Place::Same => (low, high),
            Place::Around => (low - s * size, high + s * size),
            Place::Inside => {
                let [a, b] = [s, t].map(|share| (low + extent * share).clamp(low, high));
                (a.min(b), a.max(b))
            }
            Place::Partly => by(0.7 * size * self.direction),
            Place::Above => by(up),
            Place::Below => by(-up),
            Place::Beside => by(beside),
            Place::Flat => {
                let mut top = high + up * s.x;
                let mut bottom = low + up * s.y;
                top[axis] = bottom[axis].max(top[axis]);
                bottom[axis] = top[axis];
                (bottom.min(top), bottom.max(top))
            }
        };
        Bounds::new(low, high).expect("an ordered box")
    }
}
