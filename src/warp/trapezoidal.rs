//! Trapezoidal shadow maps: a point of the line of sight is put on a line of the map.

use super::{Slab, ViewAxis};
use crate::math::{max, min};

/// The trapezoidal rule: the point at the focus is put on a line of the map, so that what lies before it has that
/// share of the map.
///
/// A trapezoidal map is the map of the family whose warp does this: the trapezoid's axis is the light-space z axis, its top
/// and base lines are the body's two ends, and its eight matrices make the same map as the one that [`Fit::solve`] writes down
/// at once. (The paper fits the whole view volume; here it is what of it there is to see. For a camera off its centre
/// the paper's axis joins the middles of the near and the far plane; here it is the view direction.)
///
/// Source: T. Martin, T.-S. Tan, Anti-aliasing and Continuity with Trapezoidal Shadow Maps, 2004.
///
/// [`Fit::solve`]: crate::Fit::solve
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrapezoidalRule {
    /// Where the focus lies on the line of sight, as a share of the depths of what is seen (or of
    /// [`Fit::warp_depths`](crate::Fit::warp_depths)): from 0, the nearest, to 1, the furthest. By default 0.2.
    pub focus: f64,
    /// The line of the map that it is put on, as a share of the map, from the near side: by default 0.8, as in the paper.
    /// 1 and more is the strongest warp there is, the camera's own; not more than the focus' own place is none.
    pub line: f64,
    /// Whether the warp fades out as light and view become parallel. The paper's does not: its ratio tends to
    /// `line/(1 - line)`, 4, while its axis becomes undefined, and it then jumps to the uniform map. Faded, the excess is
    /// multiplied by `s^2 (3 - 2 s)` for the sine `s` of the angle between light and view: continuous, without effect
    /// to second order where the light is perpendicular. The default.
    pub fade: bool,
}

impl Default for TrapezoidalRule {
    fn default() -> Self {
        Self { focus: 0.2, line: 0.8, fade: true }
    }
}

impl TrapezoidalRule {
    /// Returns the excess, `lambda/eta` in the paper's symbols, that puts the focus on the line.
    ///
    /// ```text
    /// eta = (lambda delta' + lambda delta' xi)/(lambda - 2 delta' - lambda xi)            [Martin and Tan]
    /// excess = (S - t)/((1 - S) t),   S = line = (1 - xi)/2,   t = delta'/lambda
    /// ```
    /// Symbols: `delta'` is the focus' distance from the top line, which is not that from the near plane's centre.
    ///
    /// Form: the reciprocal of the paper's `eta`, which is infinite for a focus that is on the line without any warp (the
    /// eight matrices have no point to meet in there). Limits: 0 for a focus beyond that line, where the paper's warp
    /// gives the far side more, not less; at most that of the camera's own perspective, `z_f/z_n - 1`, for a focus just after
    /// the top line, on it, or before it, where the paper's is infinite; 0 where it lies behind a spot light. A body without extent, all of whose corners are collinear or one, is fitted as if it had some
    /// (see [`Fit::solve`](crate::Fit::solve)).
    /// Domain: `focus` and `line` of any value; not a number counts as 0.
    #[must_use]
    pub fn excess(&self, slab: &Slab, axis: &ViewAxis) -> f64 {
        let focus = if self.focus > 0.0 { self.focus.min(1.0) } else { 0.0 };
        let depth = slab.near + focus * (slab.far - slab.near);
        let Some([t, _]) = axis.at(depth) else { return 0.0 };
        let s = self.line;
        // The camera's own perspective; NaN is no warp.
        let most = max((slab.far - slab.near) / slab.near, 0.0);
        let above = s - t;
        let excess = if above > 0.0 && (t <= 0.0 || s >= 1.0) {
            most
        } else if above > 0.0 {
            min(above / ((1.0 - s) * t), most)
        } else {
            0.0
        };
        let sine = slab.sin_gamma.min(1.0);
        if self.fade { excess * (sine * sine * (3.0 - 2.0 * sine)) } else { excess }
    }
}
