//! The receivers measured, and widened where they are flat.

use super::extent::{Extent, least_size};
use super::frame::{Frame, Measures, Place};
use crate::error::Error;
use crate::math::{max, min};
use crate::warp::Warp;

/// The warp's `w` has a rounding error of 2^-52 times its excess times the body's distance over its extent. Where
/// that is more than 2^-12, as for a body that is a point far from its origin, the excess is made smaller.
const MOST_STEEP: f64 = (1_u64 << 40) as f64;
/// Casters that are further away than this times the body's extent along the warp, over the excess, are not known in `f64`:
/// the rounding of the light's direction moves them by 6 % of the `w` that they have. (With no warp there is no such limit.)
const FARTHEST_CASTERS: f64 = (1_u64 << 48) as f64;

/// The receivers measured, and widened where they are flat: all that a rule looks at.
#[derive(Clone, Copy)]
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
    pub(super) fn new<const V: usize, const F: usize>(
        frame: &Frame<V, F>,
        keep: impl FnMut(Place),
    ) -> Result<Self, Error> {
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
    pub(super) fn most<const V: usize, const F: usize>(&self, frame: &Frame<V, F>) -> f64 {
        let d = self.along.size();
        if let Some(spot) = frame.spot {
            let Measures { across, along, base, .. } = &self.measures;
            // The casters of a spot light come as close to it as its near plane.
            let nearest = min(spot.near(), base.low);
            // A place is a quotient by `base`, whose rounding counts as much as the place itself.
            let wide = 1.0 + max(across.reach(), along.reach());
            return d * MOST_STEEP / max(self.distance * wide * (base.low / nearest), d);
        }
        d * MOST_STEEP / max(self.distance, d)
    }

    /// How far casters count under a light at infinity: as far as `f64` knows where they cast with this warp. `None` if all do.
    #[inline(always)]
    pub(super) fn caster_limit<const V: usize, const F: usize>(&self, frame: &Frame<V, F>, warp: Warp) -> Option<f64> {
        let (limit, reach) = (self.along.size() * FARTHEST_CASTERS, frame.fit.caster_reach(frame.origin));
        (reach * warp.excess() > limit).then(|| limit / warp.excess())
    }

    pub(super) fn most_ratio<const V: usize, const F: usize>(&self, frame: &Frame<V, F>) -> f64 {
        1.0 + min(self.most(frame), Warp::MAX_EXCESS)
    }
}
