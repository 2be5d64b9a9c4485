//! Extents, and rows: affine functions of a position, as the rows of a matrix are.

use glam::{DVec3, DVec4};

use crate::error::MIN_LENGTH;
use crate::math::{max, min};

/// A flat body is fitted as if it were this much of its greatest extent thick. A smaller extent is mostly rounding: of
/// the order of 2^-52 of the greatest one, which leaves 32 bits at this size.
pub(crate) const LEAST_ASPECT: f64 = 1.0 / (1 << 20) as f64;
/// A body is fitted as if it were at least this much of its distance, from the eye and from the origins, in size: the
/// rounding of its position.
const LEAST_ANGLE: f64 = 1.0 / (1_u64 << 50) as f64;

/// The least and greatest value seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Extent {
    pub(crate) const NONE: Self = Self { low: f64::INFINITY, high: f64::NEG_INFINITY };

    #[inline(always)]
    pub(crate) fn include(&mut self, x: f64) {
        self.low = min(x, self.low);
        self.high = max(x, self.high);
    }

    pub(crate) fn size(self) -> f64 {
        self.high - self.low
    }

    /// The greatest size of a value.
    pub(crate) fn reach(self) -> f64 {
        max(self.high, -self.low)
    }

    pub(crate) fn middle(self) -> f64 {
        0.5 * (self.low + self.high)
    }

    pub(crate) fn clamp(self, x: f64) -> f64 {
        min(max(x, self.low), self.high)
    }

    /// Widened about its middle to at least this size.
    pub(crate) fn at_least(self, size: f64) -> Self {
        let lack = 0.5 * max(size - self.size(), 0.0);
        Self { low: self.low - lack, high: self.high + lack }
    }
}

/// The least extent that a body is fitted with, from its greatest extent and its distance.
pub(crate) fn least_size(greatest: f64, distance: f64) -> f64 {
    max(LEAST_ASPECT * greatest, max(LEAST_ANGLE * distance, MIN_LENGTH))
}

#[inline(always)]
pub(crate) fn at(row: DVec4, p: DVec3) -> f64 {
    row.truncate().dot(p) + row.w
}

pub(crate) fn row(linear: DVec3, constant: f64) -> DVec4 {
    linear.extend(constant)
}

/// The row whose fraction over `w` goes from -1 to 1 where that of `row` goes from one extreme to the other.
pub(crate) fn fitted(row: DVec4, extremes: Extent, w: DVec4) -> DVec4 {
    (2.0 * row - (extremes.low + extremes.high) * w) / extremes.size()
}
