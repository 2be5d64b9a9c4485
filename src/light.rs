//! Lights, validated.

use glam::{DVec3, DVec4};

use crate::error::{Error, require, require_direction, require_length, require_position};
use crate::math::{sqrt, tan};
use crate::plane::Plane;

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

/// A light that shines from a point into a cone, or, as a face of a [`Point`] light, into a square pyramid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    position: DVec3,
    direction: DVec3,
    outer_angle: f64,
    /// Of the outer angle.
    tangent: f64,
    is_square: bool,
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
        let condition =
            "must be between 0 and pi/2 radians, from the axis to the edge; for a wider light use Light::point";
        require(acute, "outer_angle", condition)?;
        require_reach(near, range)?;
        let tangent = tan(outer_angle);
        Ok(Self::Spot(Spot { position, direction, outer_angle, tangent, is_square: false, near, range }))
    }

    /// Returns a point light that shines from `near` to `range`. It has no single map: see
    /// [`Light::as_point`] and [`Point::faces`].
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
    /// [`Error::Unsupported`] for lights with a position.
    pub fn as_directional(&self) -> Result<&Directional, Error> {
        match self {
            Self::Directional(light) => Ok(light),
            Self::Spot(_) | Self::Point(_) => Err(Error::Unsupported {
                requested: "the sweep of a body towards a light with a position",
                use_instead: "what the finished map shows of a box, ShadowMap::shown",
            }),
        }
    }

    /// Returns the point light that this is.
    ///
    /// ```
    /// use shadow_warp::{Light, glam::DVec3};
    /// let faces = Light::point(DVec3::ZERO, 0.1, 20.0)?.as_point()?.faces();
    /// assert_eq!(faces.len(), 6);
    /// # Ok::<(), shadow_warp::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Unsupported`] for other lights.
    pub fn as_point(&self) -> Result<&Point, Error> {
        match self {
            Self::Point(light) => Ok(light),
            Self::Directional(_) | Self::Spot(_) => Err(Error::Unsupported {
                requested: "a set of six faces for a light that is not a point light",
                use_instead: "the light itself, which has one map",
            }),
        }
    }

    /// The light as one homogeneous position, relative to an origin.
    pub(crate) fn relative_to(&self, origin: DVec3) -> DVec4 {
        match self {
            Self::Directional(light) => light.to_light.extend(0.0),
            Self::Spot(Spot { position, .. }) | Self::Point(Point { position, .. }) => (*position - origin).extend(1.0),
        }
    }

    /// Returns the light as one homogeneous position in world space: `(to_light, 0)` at infinity, `(position, 1)` else.
    #[must_use]
    pub fn homogeneous(&self) -> DVec4 {
        self.relative_to(DVec3::ZERO)
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

    /// Returns the angle from the axis to the edge of the cone, in radians; to the sides, for a face of a point light.
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

    /// The planes around what it lights, relative to a point: near, range, and the sides. Those of a cone are eight,
    /// which touch it, two of them across each of the given axes; so it counts as up to 8 % wider between.
    pub(crate) fn planes(&self, origin: DVec3, [x, z]: [DVec3; 2]) -> impl Iterator<Item = Plane> {
        let (axis, apex, tangent) = (self.direction, self.position - origin, self.tangent);
        let through = |normal: DVec3, point: DVec3| Plane::from_unit(normal, normal.dot(point));
        let ends = [through(-axis, apex + axis * self.near), through(axis, apex + axis * self.range)];
        let half = sqrt(0.5);
        let around: [DVec3; 8] = if self.is_square {
            // Four are enough; the others are not used.
            let [a, b] = across_world_axis(axis);
            [a, b, -a, -b, a, b, -a, -b]
        } else {
            [x, z, -x, -z, (x + z) * half, (z - x) * half, -(x + z) * half, (x - z) * half]
        };
        let count = if self.is_square { 4 } else { 8 };
        // Unit normals also where the tangent is beyond measure: its reciprocal is the cotangent then.
        let side = move |outward: DVec3| {
            let normal = if tangent > 1.0 { outward / tangent - axis } else { outward - axis * tangent };
            through(normal / sqrt(normal.length_squared()), apex)
        };
        ends.into_iter().chain(around.into_iter().take(count).map(side))
    }
}

/// The two of the world's axes that are perpendicular to one of them, whatever its sign.
fn across_world_axis(axis: DVec3) -> [DVec3; 2] {
    match axis.abs().to_array().map(|c| c > 0.5) {
        [true, ..] => [DVec3::Y, DVec3::Z],
        [_, true, _] => [DVec3::Z, DVec3::X],
        _ => [DVec3::X, DVec3::Y],
    }
}

impl Point {
    /// Returns the six faces of the cube around the light, each as a light of its own, in the usual order: +x, -x, +y,
    /// -y, +z, -z. Together they light every direction, and no direction is in two but on their edges. A face is a
    /// [`Spot`] with a square pyramid of 45 degrees to its sides, in world space.
    ///
    /// Each is fitted by itself: what is seen and lies in its pyramid, and nothing else, is in its map. Where nothing
    /// does, [`Fit::solve`](crate::Fit::solve) says [`Error::NothingLit`]: that face needs no map.
    ///
    /// The near plane of a face lies at `near/sqrt(3)`, so that it takes nothing away in the corners that is `near`
    /// away from the light; the far plane at `range`.
    #[must_use]
    pub fn faces(&self) -> [Light; 6] {
        [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z].map(|direction| {
            Light::Spot(Spot {
                position: self.position,
                direction,
                outer_angle: core::f64::consts::FRAC_PI_4,
                tangent: 1.0,
                is_square: true,
                near: self.near / sqrt(3.0),
                range: self.range,
            })
        })
    }

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
