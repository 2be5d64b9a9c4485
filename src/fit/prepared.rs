//! The receivers measured, and widened where they are flat.

use super::extent::{Extent, least_size};
use super::frame::{Frame, Measures, Place};
use crate::error::Error;
use crate::math::{max, min};
use crate::warp::Warp;

/// The warp's `w` has a rounding error of 2^-52 times its excess times the body's distance over its extent. Where
/// that is more than 2^-12, as for a body that is a point far from its origin, the excess is made smaller.
const MOST_STEEP: f64 = (1_u64 << 40) as f64;
/// The same for casters that are very much further away than the body is long: their distance over the body's extent,
/// times the excess, tilts the row of depth against the light, by the rounding of its axes. At this value it does by
/// 6 %.
const MOST_STEEP_DEPTH: f64 = (1_u64 << 48) as f64;

/// The receivers measured, and widened where they are flat: all that a rule looks at.
pub(super) struct Prepared<const SPOT: bool> {
    pub(super) measures: Measures,
    /// Along the warp, not flat.
    pub(super) along: Extent,
    /// The least extent across.
    pub(super) floor: f64,
    /// How far away things are, as fractions of light space.
    distance: f64,
    /// The centre of the warp across it: `p_x`.
    pub(super) centre: f64,
}

impl<const SPOT: bool> Prepared<SPOT> {
    #[inline(always)]
    pub(super) fn new(frame: &Frame, keep: impl FnMut(Place)) -> Result<Self, Error> {
        let measures = frame.measure::<SPOT>(keep)?;
        let Measures { across, along, height, base, depth } = &measures;
        let shift = max(frame.fit.greatest_shift(frame.origin), depth.high.abs());
        let (greatest, distance) = if SPOT {
            let lengths = max(shift, frame.light.abs().max_element());
            (max(across.size(), along.size()), max(lengths / base.low, max(across.reach(), along.reach())))
        } else {
            let reach = max(across.reach(), max(height.reach(), along.reach()));
            (max(across.size(), max(height.size(), along.size())), max(shift, reach))
        };
        let floor = least_size(greatest, distance);
        let along = along.at_least(floor);
        let centre = frame.eye_across::<SPOT>().map_or(across.middle(), |eye| across.clamp(eye));
        Ok(Self { measures, along, floor, distance, centre })
    }

    /// The greatest excess that `f64` can carry.
    pub(super) fn most(&self, frame: &Frame) -> f64 {
        let d = self.along.size();
        if let Some(spot) = frame.spot {
            // The casters of a spot light come as close to it as its near plane.
            let nearest = min(spot.near(), self.measures.base.low);
            return d * MOST_STEEP / max(self.distance * (self.measures.base.low / nearest), d);
        }
        let casters = frame.fit.caster_reach(frame.origin);
        d * min(MOST_STEEP / max(self.distance, d), MOST_STEEP_DEPTH / max(casters, d))
    }

    pub(super) fn most_ratio(&self, frame: &Frame) -> f64 {
        1.0 + min(self.most(frame), Warp::MAX_EXCESS)
    }
}
