//! The exact minimum of the error on the line of sight.

use super::{Slab, ViewAxis};
use crate::math::{max, sqrt};

/// Returns the excess that makes the larger of the errors at the two ends of the line of sight, at the least and the greatest
/// depth of what is seen, as small as can be.
///
/// ```text
/// minimise max(q (1 + eta t_n)^2, (1 + eta t_f)^2/q)/(1 + eta),   q = sqrt(z_f/z_n) base_n/base_f
/// ```
/// with `t_n`, `t_f` the places of these ends in the body; the error is that of an edge along the line of sight.
///
/// Form: the minimum is where both are equal, `(q - 1)/(t_f - q t_n)`, or where one of them is least by itself,
/// `1/t - 2`, or at 0. Where the errors can be made equal, the warp has its pole on the line of sight at
/// `-sqrt(z_n z_f)`: this is what the papers' `n_opt` means without coordinates, for spot lights too. With the light
/// perpendicular to the view it is `sqrt(z_f/z_n) - 1`. Limits: 0 where an end of the line of sight lies behind a spot
/// light, and where the picture of the line of sight is a point, so that the warp's direction means nothing.
pub(crate) fn excess(slab: &Slab, axis: &ViewAxis) -> f64 {
    if slab.sin_gamma <= 0.0 {
        return 0.0;
    }
    let (Some([t_n, base_n]), Some([t_f, base_f])) = (axis.at(slab.near), axis.at(slab.far)) else { return 0.0 };
    let q = sqrt(slab.far / slab.near) * (base_n / base_f);
    let error = |eta: f64| {
        let (near, far) = (1.0 + eta * t_n, 1.0 + eta * t_f);
        max(q * near * near, far * far / q) / (1.0 + eta)
    };
    let (mut best, mut least) = (0.0, error(0.0));
    for eta in [(q - 1.0) / (t_f - q * t_n), 1.0 / t_n - 2.0, 1.0 / t_f - 2.0] {
        // NaN and negative ones fail, and those whose pole leaves an end of the line of sight behind.
        let before = 1.0 + eta * t_n > 0.0 && 1.0 + eta * t_f > 0.0;
        if eta > 0.0 && eta.is_finite() && before && error(eta) < least {
            (best, least) = (eta, error(eta));
        }
    }
    best
}
