//! Lights, validated.

use glam::{DVec3, DVec4};

use crate::error::{Error, require, require_direction, require_length, require_position};

/// A light. Make one with [`Light::directional`], [`Light::spot`] or [`Light::point`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Light {
    /// At infinity: the sun.
    Directional(Directional),
    /// A cone from a point.
    Spot(Spot),
    /// All around a point.
    Point(Point),
}

/// A light at infinity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Directional {
    to_light: DVec3,
}

/// A light that shines from a point into a cone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    position: DVec3,
    direction: DVec3,
    outer_angle: f64,
    near: f64,
    range: f64,
}

/// A light that shines from a point in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    position: DVec3,
    near: f64,
    range: f64,
}

impl Light {
    /// Returns a light at infinity. `to_light` points from the scene *towards* it and need not be unit.
    ///
    /// Coordinates below 2^-52 of its length count as 0: sines and cosines leave such remnants, and they move a
    /// shadow by no more than 2^-52 of its caster's height above it.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `to_light` is finite, with a length between 1e-100 and 1e100.
    pub fn directional(to_light: DVec3) -> Result<Self, Error> {
        let unit = require_direction(to_light, "to_light")?;
        let to_light = DVec3::select(unit.abs().cmplt(DVec3::splat(f64::EPSILON)), DVec3::ZERO, unit);
        Ok(Self::Directional(Directional { to_light }))
    }

    /// Returns a spot light: it shines along `direction` within `outer_angle` (radians, from the axis to the edge of
    /// the cone), from `near` to `range` along the axis.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `position` is finite, `direction` a direction, `0 < outer_angle < pi/2`, and
    /// `1e-100 <= near < range <= 1e100`.
    pub fn spot(position: DVec3, direction: DVec3, outer_angle: f64, near: f64, range: f64) -> Result<Self, Error> {
        require_position(position, "position")?;
        let direction = require_direction(direction, "direction")?;
        let acute = outer_angle > 0.0 && outer_angle < core::f64::consts::FRAC_PI_2;
        require(acute, "outer_angle", "must be between 0 and pi/2 radians")?;
        require_reach(near, range)?;
        Ok(Self::Spot(Spot { position, direction, outer_angle, near, range }))
    }

    /// Returns a point light that shines from `near` to `range`.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `position` is finite and `1e-100 <= near < range <= 1e100`.
    pub fn point(position: DVec3, near: f64, range: f64) -> Result<Self, Error> {
        require_position(position, "position")?;
        require_reach(near, range)?;
        Ok(Self::Point(Point { position, near, range }))
    }

    /// Returns the light at infinity that this is.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for lights with a position, whose maps are still to come.
    pub fn as_directional(&self) -> Result<&Directional, Error> {
        match self {
            Self::Directional(light) => Ok(light),
            Self::Spot(_) | Self::Point(_) => Err(Error::Unsupported {
                requested: "a fitted map for a spot or point light",
                use_instead: "the light's own perspective projection",
            }),
        }
    }

    /// Returns the light as one homogeneous position in world space: `(to_light, 0)` at infinity, `(position, 1)` else.
    #[must_use]
    pub fn homogeneous(&self) -> DVec4 {
        match self {
            Self::Directional(light) => light.to_light.extend(0.0),
            Self::Spot(light) => light.position.extend(1.0),
            Self::Point(light) => light.position.extend(1.0),
        }
    }
}

fn require_reach(near: f64, range: f64) -> Result<(), Error> {
    require_length(near, "near")?;
    require_length(range, "range")?;
    require(near < range, "range", "must be greater than near")
}

impl Directional {
    /// Returns the unit vector towards the light.
    #[must_use]
    pub fn to_light(&self) -> DVec3 {
        self.to_light
    }
}

impl Spot {
    /// Returns the light's position.
    #[must_use]
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Returns the unit axis along which the light shines.
    #[must_use]
    pub fn direction(&self) -> DVec3 {
        self.direction
    }

    /// Returns the angle from the axis to the edge of the cone, in radians.
    #[must_use]
    pub fn outer_angle(&self) -> f64 {
        self.outer_angle
    }

    /// Returns the distance along the axis from which the light casts shadows.
    #[must_use]
    pub fn near(&self) -> f64 {
        self.near
    }

    /// Returns the distance along the axis to which the light shines.
    #[must_use]
    pub fn range(&self) -> f64 {
        self.range
    }
}

impl Point {
    /// Returns the light's position.
    #[must_use]
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Returns the distance from which the light casts shadows.
    #[must_use]
    pub fn near(&self) -> f64 {
        self.near
    }

    /// Returns the distance to which the light shines.
    #[must_use]
    pub fn range(&self) -> f64 {
        self.range
    }
}
