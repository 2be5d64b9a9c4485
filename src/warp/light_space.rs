//! LiSPSM: the published rules for the excess.

use crate::math::sqrt;

/// The four published forms of the light-space perspective rule.
///
/// Head-on, with the light perpendicular to the view, all four give the excess that makes the error on the view
/// axis equal at its two ends, `sqrt(z_f/z_n) - 1`. They differ in how it fades towards light parallel to view.
/// The largest error on the axis, for near 1, far 100 and a field of view of 60 degrees, by the angle in degrees:
///
/// | rule | 90 | 60 | 30 | 20 | 10 | 5 |
/// |---|---|---|---|---|---|---|
/// | [`Extent`](Self::Extent) | 9.90 | 13.84 | 29.75 | 199.9 | 721.4 | 1568 |
/// | [`Damped`](Self::Damped) | 9.90 | 14.81 | 40.85 | 194.8 | 597.1 | 1290 |
/// | [`ViewDepth`](Self::ViewDepth) | 9.90 | 13.81 | 37.72 | 193.7 | 619.6 | 1329 |
/// | [`Depth`](Self::Depth) | 9.90 | 14.63 | 37.86 | 193.7 | 614.9 | 1322 |
/// | uniform | 99.0 | 132.7 | 200.0 | 317.3 | 654.9 | 1320 |
///
/// That is the axis. None of these rules looks at the rest of the body, and off the axis each can be worse than the
/// uniform map, mostly where light and view are within 30 degrees of parallel.
/// [`Fit::worst_texel`](crate::Fit::worst_texel) tells which map is the better one for the scene at hand, exactly and
/// for less than the cost of a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LightSpaceRule {
    /// `n = (z_n + sqrt(z_n (z_n + d sin gamma)))/sin gamma`: the paper with its refinement, far replaced by near
    /// plus the body's extent. Strongest near parallel: it fades only at `sin gamma` of `z_n/d`.
    ///
    /// Source: LiSPSM, Sec. 4.4. The paper says that this "converges faster" to the uniform map; it converges more
    /// slowly.
    Extent,
    /// As [`Extent`](Self::Extent) with `z_n/sin gamma` in place of `z_n`: the authors' sample code. Off below
    /// `sin gamma` of `sqrt(z_n/d)`. On the axis, in each column of this table, it is no worse than uniform; off the axis
    /// it can be (see above). The default.
    #[default]
    Damped,
    /// `n = (z_n + sqrt(z_n z_f))/sin gamma`, with the depths of the body.
    ///
    /// Source: LiSPSM, Sec. 4.4, without its refinement.
    ViewDepth,
    /// `n = (z_n + sqrt(z_n (z_n + d)))/sin gamma`.
    ///
    /// Source: Wimmer and Scherzer 2005, Eq. 1, taken literally.
    Depth,
}

/// What the rules look at: the body's depths from the eye, and its extent in light space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slab {
    /// The least depth of the receivers' body along the view direction, in world units: `z_n`. The papers take the
    /// camera's near distance, which is the same where the body begins there.
    pub near: f64,
    /// The greatest depth of the receivers' body: `z_f`. Finite for an infinite far plane too.
    pub far: f64,
    /// The body's extent along light space's z axis: `d`.
    pub extent: f64,
    /// The sine of the angle between light and view.
    pub sin_gamma: f64,
}

impl LightSpaceRule {
    /// Returns the excess `eta = d/n` for a body; 0 where light and view are parallel.
    ///
    /// Form, with `q(x) = x/(1 + sqrt(1 + x))`, which is `sqrt(1 + x) - 1` without its cancellation at small `x` (the
    /// plain one is off by 11 % at 1e-15):
    ///
    /// ```text
    /// Extent: q(d s/z_n)    Damped: q(d s^2/z_n)    ViewDepth: d s/(z_n + sqrt(z_n z_f))    Depth: s q(d/z_n)
    /// ```
    /// Domain: `z_n > 0`, `z_f >= z_n`, `d >= 0`, `0 <= s <= 1`.
    /// Accuracy: 4 roundings.
    #[must_use]
    pub fn excess(&self, slab: &Slab) -> f64 {
        let Slab { near: z_n, far: z_f, extent: d, sin_gamma: s } = *slab;
        let q = |x: f64| x / (1.0 + sqrt(1.0 + x));
        match self {
            Self::Extent => q(d * s / z_n),
            Self::Damped => q(d * s * s / z_n),
            Self::ViewDepth => d * s / (z_n * (1.0 + sqrt(z_f / z_n))),
            Self::Depth => s * q(d / z_n),
        }
    }
}
