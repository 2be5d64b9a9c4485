//! The one-parameter family of warps, and the rules that choose from it.

mod light_space;
pub(crate) mod on_axis;
pub(crate) mod optimal;
mod perspective;
mod trapezoidal;

pub use light_space::{LightSpaceRule, Slab};
pub(crate) use optimal::TIE;
pub use optimal::{Aliasing, Objective};
pub use perspective::{Aim, PerspectiveRule};
pub(crate) use perspective::{inside, rows as perspective_rows};
pub use trapezoidal::TrapezoidalRule;

use crate::error::{Error, require};
use crate::plane::Plane;

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

/// Where the points of the line of sight lie in the body: `t` at depth `z` is `(t0 + z t1)/(w0 + z w1)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewAxis {
    /// `t0` and `t1`.
    pub t: [f64; 2],
    /// `w0` and `w1`: 1 and 0 for a light at infinity; for a spot light the depth in the light's own perspective.
    pub w: [f64; 2],
}

impl ViewAxis {
    /// Returns `t` and `w` at a depth in the view; `None` behind a spot light, where there is no `t`.
    #[must_use]
    pub fn at(&self, depth: f64) -> Option<[f64; 2]> {
        let [t, w] = [self.t, self.w].map(|[at_eye, rate]| at_eye + depth * rate);
        (w > 0.0).then(|| [t / w, w])
    }
}

/// What decides how strong the warp is.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Rule {
    /// No warp: the plain map, focused on what is seen.
    Uniform,
    /// Light-space perspective shadow map, in one of its published forms. For a spot light, in whose own perspective there
    /// is no angle between light and view, all of them are [`Rule::OnAxis`], which they agree with where light and view are
    /// perpendicular.
    LightSpace(LightSpaceRule),
    /// The least error at the two ends of the line of sight, exactly: LiSPSM's aim, at any angle and for any light. It looks at
    /// nothing else: where the line of sight is not in the middle of what is seen, it does not fade out as light and view
    /// become parallel, can jump, and can be worse than no warp.
    OnAxis,
    /// Trapezoidal shadow map.
    Trapezoidal(TrapezoidalRule),
    /// Perspective shadow map, made in the camera's post-perspective space. Its warp has a direction of its own.
    Perspective(PerspectiveRule),
    /// The map that has the same pixels per texel at every point of a plane in world space, such as the ground: the camera's
    /// own picture of what the plane shows. It is one number for each of the map's two axes, and the two differ as the
    /// picture of the receivers is wider than high. What does not lie on the plane is drawn where its shadow falls on it.
    ///
    /// ```text
    /// x, y = the camera's picture of X (p.L) - L (p.X)            for a plane p, a light L, a point X, all homogeneous
    /// ```
    /// Source: H. Chong, S. Gortler, A Lixel for every Pixel, 2004.
    ///
    /// Domain: no receiver's shadow may fall behind the eye, or `w` is not positive for it; so mostly for a scene
    /// that is little more than its ground, and a light that does not shine from ahead. [`Error::Unsupported`]
    /// elsewhere, and for a light or a camera in the plane. Elsewhere in space the error is as
    /// [`Fit::worst_texel`](crate::Fit::worst_texel) says: it grows where the camera, seen along the light from the plane,
    /// comes nearer.
    Plane(Plane),
    /// The warp of the family with the least objective over the receivers: on these axes, about this centre.
    ///
    /// Never worse than no warp, to a relative 1e-9: with [`Objective::Larger`] by [`Fit::worst_texel`](crate::Fit::worst_texel)
    /// of the finished maps, on any axes; with the others by [`Fit::errors`](crate::Fit::errors). With chosen depths both
    /// are over these depths. (Not promised: the product on axes fixed by the light, where the warp is limited.)
    ///
    /// On axes fixed by the light, and for flat bodies, the search leaves out how the map is fitted: there the result is no
    /// more than not worse than no warp.
    ///
    /// Where the error across is the worst and its valley is flat, the warp with the smaller error along is taken, and of
    /// equal ones the weaker.
    Optimal(Objective),
    /// A warp of one's own. Unlike the published rules it does not fade out as light and view become parallel, nor
    /// for an orthographic camera, where any warp makes the map worse.
    Explicit(Warp),
}

impl Rule {
    /// LiSPSM as its authors' sample code computes it: the form that fades out soonest as light and view come to be
    /// parallel. See [`LightSpaceRule`], also for when it is worse than no warp.
    pub const LISPSM: Self = Self::LightSpace(LightSpaceRule::Damped);
    /// Trapezoidal, with the focus at a fifth of the depth, on the paper's line, and faded.
    pub const TSM: Self = Self::Trapezoidal(TrapezoidalRule { focus: 0.2, line: 0.8, fade: true });
    /// Perspective, with the aim that is refused least, and no shift.
    pub const PSM: Self = Self::Perspective(PerspectiveRule { aim: Aim::Closest, shift: 0.0 });
    /// The warp with the least worst texel.
    pub const OPTIMAL: Self = Self::Optimal(Objective::Larger);
}

impl Default for Rule {
    fn default() -> Self {
        Self::LISPSM
    }
}
