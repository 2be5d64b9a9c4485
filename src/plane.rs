//! Planes as the borders of half-spaces.

use glam::DVec3;

use crate::error::{Error, require_direction, require_position};
use crate::math::sqrt;

/// A half-space by its border: the points `p` with `normal . p <= offset`. The normal is unit and
/// points outward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    normal: DVec3,
    offset: f64,
}

impl Plane {
    /// Returns the half-space behind a plane through `point` that faces along `normal`, which need
    /// not be unit.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `point` is finite and `normal` a direction with a length between
    /// 1e-100 and 1e100.
    pub fn new(normal: DVec3, point: DVec3) -> Result<Self, Error> {
        require_position(point, "point")?;
        let normal = require_direction(normal, "normal")?;
        Ok(Self { normal, offset: normal.dot(point) })
    }

    pub(crate) fn from_unit(normal: DVec3, offset: f64) -> Self {
        Self { normal, offset }
    }

    pub(crate) fn through_origin(normal: DVec3) -> Self {
        Self { normal: normal / sqrt(normal.length_squared()), offset: 0.0 }
    }

    pub(crate) const UNUSED: Self = Self { normal: DVec3::ZERO, offset: 0.0 };

    /// Returns the outward unit normal.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Returns the signed distance of the plane from the origin along its normal.
    #[must_use]
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// Returns how far a point lies beyond the plane: positive outside, negative inside.
    #[must_use]
    #[inline]
    pub fn distance(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// Returns the same plane in coordinates whose origin lies at `origin` in the present ones.
    #[must_use]
    pub fn relative_to(&self, origin: DVec3) -> Self {
        Self { normal: self.normal, offset: self.offset - self.normal.dot(origin) }
    }
}
