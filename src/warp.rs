//! The one-parameter family of warps, and the rules that choose from it.

mod light_space;

pub use light_space::{LightSpaceRule, Slab};

use crate::error::{Error, require};

/// A perspective warp along light space's z axis that keeps the light direction.
///
/// With `t` from 0 to 1 over the body's extent, and the excess `eta` (the ratio `1 + eta` is the far over the near
/// distance of the warp's frustum):
///
/// ```text
/// w = 1 + eta t        x' = x / w        s = (1 + eta) t / w        s/(1 - s) = (1 + eta) t/(1 - t)
/// ```
/// `eta = 0` is the uniform map itself, not a limit. The papers' near distance is `n = d/eta`, for an extent `d`; it is
/// infinite there, so it is never formed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Warp {
    excess: f64,
}

impl Warp {
    /// The uniform map.
    pub const UNIFORM: Self = Self { excess: 0.0 };

    /// The greatest excess. Half of f64's digits are left with it.
    pub const MAX_EXCESS: f64 = 1e8;

    /// Returns the warp with this excess, `eta`.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `0 <= excess <= MAX_EXCESS`.
    pub fn new(excess: f64) -> Result<Self, Error> {
        require((0.0..=Self::MAX_EXCESS).contains(&excess), "excess", "must be between 0 and 1e8")?;
        Ok(Self { excess })
    }

    /// Returns the excess `eta`: 0 is uniform.
    #[must_use]
    pub fn excess(&self) -> f64 {
        self.excess
    }

    /// Returns the ratio `1 + eta` of the warp's far to its near distance: 1 is uniform.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        1.0 + self.excess
    }

    /// Returns `s`, the place in the map from 0 to 1, of a point at `t`, its place in the body from 0 to 1.
    ///
    /// ```text
    /// s = 1/2 + (f+n)/(2(f-n)) - f n/(z'(f-n)),   z' = n + t d,  f = n + d        [LiSPSM, Sec. 4.2, Eq. 2]
    /// ```
    /// Deviations: the paper prints a plus before the last term, which would put `z' = n` at 2.2 and `z' = f` at 1.2
    /// for n = 11, f = 110. Form: `(1 + eta) t/(1 + eta t)`, which has no difference of large numbers: the printed
    /// one is off by 3e-11 at a depth ratio of 1e7 and has no value for the uniform map. Domain: `0 <= t <= 1`; exact
    /// at both ends.
    #[must_use]
    pub fn map_from_body(&self, t: f64) -> f64 {
        self.ratio() * t / (1.0 + self.excess * t)
    }

    /// Returns `t` of a point at `s`: the inverse of [`Warp::map_from_body`].
    #[must_use]
    pub fn body_from_map(&self, s: f64) -> f64 {
        s / (1.0 + self.excess * (1.0 - s))
    }

    /// Returns how much of the map a step through the body covers at `t`: `ds/dt = (1 + eta)/(1 + eta t)^2`.
    #[must_use]
    pub fn density(&self, t: f64) -> f64 {
        let w = 1.0 + self.excess * t;
        self.ratio() / w / w
    }

    /// The same warp, or the weaker one with this excess.
    pub(crate) fn at_most(self, excess: f64) -> Self {
        Self { excess: if self.excess > excess { excess } else { self.excess } }
    }

    pub(crate) fn clamped(excess: f64) -> Self {
        Self { excess: if excess > 0.0 { excess.min(Self::MAX_EXCESS) } else { 0.0 } }
    }
}

/// What decides how strong the warp is.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Rule {
    /// No warp: the plain map, focused on what is seen.
    Uniform,
    /// Light-space perspective shadow map, in one of its published forms.
    LightSpace(LightSpaceRule),
    /// A warp of one's own. Unlike the published rules it does not fade out as light and view become parallel, nor
    /// for an orthographic camera, where any warp makes the map worse.
    Explicit(Warp),
}

impl Rule {
    /// LiSPSM as its authors' sample code computes it: the form that fades out soonest as light and view come to be
    /// parallel. See [`LightSpaceRule`], also for when it is worse than no warp.
    pub const LISPSM: Self = Self::LightSpace(LightSpaceRule::Damped);

    /// Returns the warp for a body. The published rules answer an error that grows towards the eye; an orthographic
    /// camera has none (`perspective` false), so they give the uniform map for it.
    #[must_use]
    pub fn warp(&self, slab: &Slab, perspective: bool) -> Warp {
        match self {
            Self::Uniform => Warp::UNIFORM,
            Self::LightSpace(rule) if perspective => Warp::clamped(rule.excess(slab)),
            Self::LightSpace(_) => Warp::UNIFORM,
            Self::Explicit(warp) => *warp,
        }
    }
}

impl Default for Rule {
    fn default() -> Self {
        Self::LISPSM
    }
}
