//! What the scene says of itself: boxes.

use glam::DVec3;

use crate::error::{Error, require, require_position};

/// An axis-aligned box in world space. May be flat, a line or a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    min: DVec3,
    max: DVec3,
}

impl Bounds {
    /// Returns the box between two corners.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless both corners are finite, with coordinates of at most 1e100, and
    /// `min <= max`.
    pub fn new(min: DVec3, max: DVec3) -> Result<Self, Error> {
        require_position(min, "min")?;
        require_position(max, "max")?;
        require(min.cmple(max).all(), "min", "must not be greater than max, in any coordinate")?;
        Ok(Self { min, max })
    }

    /// The part of the box that is no further from a point than this, along any axis; `None` if
    /// there is none.
    pub(crate) fn within(&self, centre: DVec3, reach: f64) -> Option<Self> {
        Self::new(self.min.max(centre - reach), self.max.min(centre + reach)).ok()
    }

    /// Returns the corner with the least coordinates.
    #[must_use]
    pub fn min(&self) -> DVec3 {
        self.min
    }

    /// Returns the corner with the greatest coordinates.
    #[must_use]
    pub fn max(&self) -> DVec3 {
        self.max
    }
}
