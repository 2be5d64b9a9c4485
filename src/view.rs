//! The camera, as the pieces it is made of.

use core::ops::Range;

use glam::{DMat4, DVec3};

use crate::clip_space::{ClipSpace, DepthRange};
use crate::error::{Error, require, require_direction, require_length, require_position};
use crate::math::{sqrt, tan, unit_cross};
use crate::plane::Plane;

/// The four sides of a view volume: tangents `x/z`, `y/z` of a perspective camera, lengths of an orthographic one,
/// along [`View::right`] and [`View::up`]; signed, so that a centred camera has `left = -right`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sides {
    /// The side against [`View::right`].
    pub left: f64,
    /// The side along [`View::right`].
    pub right: f64,
    /// The side against [`View::up`].
    pub bottom: f64,
    /// The side along [`View::up`].
    pub top: f64,
}

impl Sides {
    /// Returns the sides of a centred rectangle.
    #[must_use]
    pub fn centred(width: f64, height: f64) -> Self {
        Self { left: -0.5 * width, right: 0.5 * width, bottom: -0.5 * height, top: 0.5 * height }
    }

    fn validated(self) -> Result<Self, Error> {
        let ordered = |low: f64, high: f64| {
            // A side's difference loses all meaning where it is below the rounding of the sides themselves.
            let least = (1e-12 * low.abs().max(high.abs())).max(1e-12);
            high - low >= least && low.abs() <= MAX_TANGENT && high.abs() <= MAX_TANGENT
        };
        require(ordered(self.left, self.right), "left and right", SIDES_CONDITION)?;
        require(ordered(self.bottom, self.top), "bottom and top", SIDES_CONDITION)?;
        Ok(self)
    }
}

/// Tangents beyond this are wider than 179.9999 degrees.
const MAX_TANGENT: f64 = 1e6;
const SIDES_CONDITION: &str =
    "must be ordered, at least 1e-12 apart (absolutely and relative to their size), and at most 1e6 in size";

/// How a camera projects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// Through the eye; the sides are tangents.
    Perspective(Sides),
    /// Along the forward axis; the sides are lengths in world units.
    Orthographic(Sides),
}

/// A camera: eye, unit axes, lens, near and far distance; validated, in world space.
///
/// Only the volume matters to a shadow map, so the pieces are kept and no matrix is formed: corners and planes taken
/// from a product matrix through its inverse are off by up to hundreds of texels on large scenes.
///
/// ```
/// use shadow_warp::{View, glam::DVec3};
/// let view = View::perspective(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 60f64.to_radians(), 16.0 / 9.0, 0.1..f64::INFINITY)?;
/// assert_eq!(view.right(), DVec3::X);
/// # Ok::<(), shadow_warp::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    eye: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    lens: Lens,
    near: f64,
    far: f64,
    reach: f64,
    planes: [Plane; 6],
}

impl View {
    /// Returns a centred perspective camera.
    ///
    /// `fov_y` is the full vertical angle in radians, `aspect` width over height, `depth` the near and far distance
    /// along `forward`; the far one may be `f64::INFINITY`. `forward` and `up` need not be unit nor perpendicular.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `eye` is finite, `forward` and `up` are directions that differ by more than 1e-14
    /// radians, `0 < fov_y < pi` with tangents between 5e-13 and 1e6, `aspect` is positive and finite, `1e-100 <=
    /// near < far`, and `far` is at most 1e100 or infinite.
    pub fn perspective(
        eye: DVec3,
        forward: DVec3,
        up: DVec3,
        fov_y: f64,
        aspect: f64,
        depth: Range<f64>,
    ) -> Result<Self, Error> {
        require(fov_y > 0.0 && fov_y < core::f64::consts::PI, "fov_y", "must be between 0 and pi radians")?;
        require(aspect > 0.0 && aspect.is_finite(), "aspect", "must be positive and finite")?;
        let height = 2.0 * tan(0.5 * fov_y);
        let sane = |side: f64| (1e-12..=2.0 * MAX_TANGENT).contains(&side);
        require(sane(height), "fov_y", "must have a tangent, of its half, between 5e-13 and 1e6")?;
        require(sane(aspect * height), "aspect", "times the tangent of half of fov_y must be between 5e-13 and 1e6")?;
        Self::perspective_off_centre(eye, forward, up, Sides::centred(aspect * height, height), depth)
    }

    /// Returns a perspective camera from the signed tangents of its four sides, as headsets and tiled displays need it.
    ///
    /// # Errors
    /// As [`View::perspective`]; the sides must be ordered, `left < right` and `bottom < top`.
    pub fn perspective_off_centre(
        eye: DVec3,
        forward: DVec3,
        up: DVec3,
        tangents: Sides,
        depth: Range<f64>,
    ) -> Result<Self, Error> {
        require_length(depth.start, "near")?;
        Self::new(eye, forward, up, Lens::Perspective(tangents.validated()?), depth)
    }

    /// Returns an orthographic camera from the four sides of its volume, in world units. `near` may be negative.
    ///
    /// # Errors
    /// As [`View::perspective_off_centre`], without the condition that `near` is positive; sides are lengths of at
    /// most 1e100.
    pub fn orthographic(eye: DVec3, forward: DVec3, up: DVec3, sides: Sides, depth: Range<f64>) -> Result<Self, Error> {
        let lengths = |low: f64, high: f64| {
            let largest = low.abs().max(high.abs());
            high - low >= (1e-12 * largest).max(1e-100) && largest <= 1e100
        };
        let condition = "must be ordered, at least 1e-12 of their size apart, and at most 1e100 in size";
        require(lengths(sides.left, sides.right), "left and right", condition)?;
        require(lengths(sides.bottom, sides.top), "bottom and top", condition)?;
        require(depth.start.abs() <= 1e100, "near", "must be finite and at most 1e100 in size")?;
        Self::new(eye, forward, up, Lens::Orthographic(sides), depth)
    }

    /// Returns the camera of a view and a projection matrix, for engines that keep nothing else.
    ///
    /// `eye_from_world` is a rigid motion (a mirror is allowed); eye space may look along its -z (OpenGL) or +z
    /// (Direct3D) axis; `clip_from_eye` is a perspective (finite, infinite, reversed, off-centre) or orthographic
    /// projection in the conventions of `space`.
    ///
    /// What is lost: the far distance has an absolute error of `far^2/near` roundings of the matrix, so an f32 matrix
    /// gives 6 % at far/near = 1e6 and treats far/near beyond some 1e15 (f64) as infinite; the eye has an error of
    /// one rounding of its distance to the origin, so 1 unit for an f32 matrix at 1e7. Use the pieces where you have
    /// them.
    ///
    /// # Errors
    /// [`Error::Invalid`] if `eye_from_world` is not a rigid motion to 1e-4, `clip_from_eye` has other entries
    /// than such a projection, or the pieces do not meet the conditions of [`View::perspective_off_centre`].
    pub fn from_matrices(eye_from_world: DMat4, clip_from_eye: DMat4, space: ClipSpace) -> Result<Self, Error> {
        let motion = eye_from_world.transpose();
        let axes = [motion.x_axis.truncate(), motion.y_axis.truncate(), motion.z_axis.truncate()];
        let [x, y, z] = axes;
        let nearly = |a: f64, b: f64| (a - b).abs() <= 1e-4;
        let rigid = motion.is_finite()
            && axes.iter().all(|a| nearly(a.length_squared(), 1.0))
            && nearly(x.dot(y), 0.0)
            && nearly(y.dot(z), 0.0)
            && nearly(z.dot(x), 0.0)
            && motion.w_axis == glam::DVec4::W;
        require(rigid, "eye_from_world", "must be a rigid motion, to 1e-4")?;
        let eye = -(x * motion.x_axis.w + y * motion.y_axis.w + z * motion.z_axis.w);

        // Rows of the projection: (a, 0, b, c), (0, d, e, g), (0, 0, p, q), (0, 0, s, t).
        let rows = clip_from_eye.transpose();
        let (rx, ry, rz, rw) = (rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis);
        let zeros = [rx.y, ry.x, rz.x, rz.y, rw.x, rw.y].iter().all(|&v| v == 0.0);
        let perspective = rw.z != 0.0;
        let flat = if perspective { rx.w == 0.0 && ry.w == 0.0 && rw.w == 0.0 } else { rw.w != 0.0 };
        require(
            zeros && flat && rows.is_finite() && rx.x != 0.0 && ry.y != 0.0,
            "clip_from_eye",
            "must be a perspective or orthographic projection along z",
        )?;
        let (near_depth, far_depth) = match space.depth {
            DepthRange::ZeroToOne => (0.0, 1.0),
            DepthRange::OneToZero => (1.0, 0.0),
            DepthRange::NegativeOneToOne => (-1.0, 1.0),
        };
        // Forward is where w grows, or without perspective where depth goes from near to far.
        let sense = if perspective { rw.z } else { rz.z / rw.w * (far_depth - near_depth) };
        let sense = if sense > 0.0 { 1.0 } else { -1.0 };
        let distance = |depth: f64| {
            let slope = rz.z - depth * rw.z;
            let vanishes = slope.abs() <= 4.0 * f64::EPSILON * rw.z.abs();
            if vanishes { f64::INFINITY } else { sense * (depth * rw.w - rz.w) / slope }
        };
        // A side of the volume, where clip x or y is `ndc` times w: its tangent, or its length.
        let side = |scale: f64, shift_z: f64, shift: f64, ndc: f64| {
            if perspective { (ndc * rw.z - shift_z) * sense / scale } else { (ndc * rw.w - shift) / scale }
        };
        let pair = |scale, shift_z, shift| {
            let (a, b) = (side(scale, shift_z, shift, -1.0), side(scale, shift_z, shift, 1.0));
            (a.min(b), a.max(b))
        };
        let (left, right) = pair(rx.x, rx.z, rx.w);
        let (bottom, top) = pair(ry.y, ry.z, ry.w);
        let sides = Sides { left, right, bottom, top };
        let (forward, depth) = (sense * z, distance(near_depth)..distance(far_depth));
        let in_order = depth.end > depth.start && (depth.start > 0.0 || !perspective);
        require(in_order, "clip_from_eye", "must have its near before its far plane, with depths as `space` says")?;
        let view = if perspective {
            Self::perspective_off_centre(eye, forward, y, sides, depth)?
        } else {
            Self::orthographic(eye, forward, y, sides, depth)?
        };
        Ok(if view.right.dot(x) < 0.0 { view.mirrored() } else { view })
    }

    /// Returns the same camera with its right axis turned about, so that a centred camera sees the same volume
    /// through a mirror. In a left-handed world this is the ordinary camera: `up x forward` is its right.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        Self::from_frame(self.eye, [-self.right, self.up, self.forward], self.lens, self.near, self.far)
    }

    fn new(eye: DVec3, forward: DVec3, up: DVec3, lens: Lens, depth: Range<f64>) -> Result<Self, Error> {
        require_position(eye, "eye")?;
        let forward = require_direction(forward, "forward")?;
        let up = require_direction(up, "up")?;
        let across = unit_cross(forward, up);
        let sine = sqrt(across.length_squared());
        require(sine > 1e-14, "up", "must not be parallel to forward")?;
        let right = across / sine;
        let (near, far) = (depth.start, depth.end);
        require(far > near, "far", "must be greater than near")?;
        require(far <= 1e100 || far == f64::INFINITY, "far", "must be at most 1e100, or infinite")?;
        Ok(Self::from_frame(eye, [right, right.cross(forward), forward], lens, near, far))
    }

    fn from_frame(eye: DVec3, [right, up, forward]: [DVec3; 3], lens: Lens, near: f64, far: f64) -> Self {
        let [left_of, right_of, below, above] = match lens {
            Lens::Perspective(s) => [
                Plane::through_origin(s.left * forward - right),
                Plane::through_origin(right - s.right * forward),
                Plane::through_origin(s.bottom * forward - up),
                Plane::through_origin(up - s.top * forward),
            ],
            Lens::Orthographic(s) => [
                Plane::from_unit(-right, -s.left),
                Plane::from_unit(right, s.right),
                Plane::from_unit(-up, -s.bottom),
                Plane::from_unit(up, s.top),
            ],
        };
        let before = Plane::from_unit(-forward, -near);
        let beyond = Plane::from_unit(forward, far);
        let planes = [beyond, left_of, right_of, above, below, before];
        // The far corners are furthest from the eye. (An orthographic volume may begin behind it, further away.)
        let (Lens::Perspective(sides) | Lens::Orthographic(sides)) = lens;
        let across = sides.left.abs().max(sides.right.abs()) + sides.bottom.abs().max(sides.top.abs());
        let reach = match lens {
            Lens::Perspective(_) => far * (1.0 + across),
            Lens::Orthographic(_) => near.abs().max(far) + across,
        };
        Self { eye, right, up, forward, lens, near, far, reach, planes }
    }

    /// Returns the eye, in world space.
    #[must_use]
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Returns the unit axis to the right of the picture.
    #[must_use]
    pub fn right(&self) -> DVec3 {
        self.right
    }

    /// Returns the unit axis up the picture.
    #[must_use]
    pub fn up(&self) -> DVec3 {
        self.up
    }

    /// Returns the unit axis along which the camera looks.
    #[must_use]
    pub fn forward(&self) -> DVec3 {
        self.forward
    }

    /// Returns the lens: perspective with tangents, or orthographic with lengths.
    #[must_use]
    pub fn lens(&self) -> Lens {
        self.lens
    }

    /// Returns the near distance along [`View::forward`].
    #[must_use]
    pub fn near(&self) -> f64 {
        self.near
    }

    /// Returns the far distance along [`View::forward`]; may be infinite.
    #[must_use]
    pub fn far(&self) -> f64 {
        self.far
    }

    /// No point of the volume is further from the eye than this; may be infinite.
    pub(crate) fn reach(&self) -> f64 {
        self.reach
    }

    /// Returns the planes of the view volume with outward unit normals, relative to the eye: far where it is finite,
    /// left, right, top, bottom, near. (Cutting is quickest in this order, and most accurate with the near plane
    /// last.)
    #[must_use]
    pub fn planes(&self) -> &[Plane] {
        if self.far == f64::INFINITY { &self.planes[1..] } else { &self.planes }
    }

    /// Returns how many pixels a world unit across the view covers at a depth along [`View::forward`]: the larger of
    /// the two picture directions, for a viewport of `[width, height]` pixels.
    #[must_use]
    pub fn pixels_per_unit(&self, viewport: [u32; 2], depth: f64) -> f64 {
        self.pixels_per_unit_at_one(viewport) / if self.is_perspective() { depth } else { 1.0 }
    }

    pub(crate) fn pixels_per_unit_at_one(&self, [width, height]: [u32; 2]) -> f64 {
        let (Lens::Perspective(s) | Lens::Orthographic(s)) = self.lens;
        (f64::from(width) / (s.right - s.left)).max(f64::from(height) / (s.top - s.bottom))
    }

    /// Returns whether lines of sight meet in the eye.
    #[must_use]
    pub fn is_perspective(&self) -> bool {
        matches!(self.lens, Lens::Perspective(_))
    }
}
