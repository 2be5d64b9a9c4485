//! The finished map.

use glam::{DMat4, DVec2, DVec3, DVec4};

use crate::basis::LightSpace;
use crate::body::Body;
use crate::clip_space::{ClipSpace, from_rows};
use crate::error::{Error, require};
use crate::math::sqrt;
use crate::scene::Bounds;
use crate::warp::Warp;

/// A fitted shadow map: its matrix, and what it was made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowMap {
    origin: DVec3,
    /// For positions relative to `origin`, in the conventions of [`ClipSpace::WGPU`].
    rows: [DVec4; 4],
    warp: Warp,
    space: LightSpace,
    /// As a homogeneous position, relative to `origin`.
    light: DVec4,
    /// The extents of a texel where `w` and the light's own depth are 1: each of the map's axes, across and along the warp.
    texels: [DVec2; 2],
    /// For a light at infinity, the world length, towards the light, of the range of depths where `w = 1`.
    depth_range: f64,
    size: [u32; 2],
}

impl ShadowMap {
    #[expect(clippy::too_many_arguments, reason = "this is all that a map is, for the three fits that make one")]
    pub(crate) fn new(
        origin: DVec3,
        rows: [DVec4; 4],
        warp: Warp,
        space: LightSpace,
        light: DVec4,
        texels: [DVec2; 2],
        depth_range: f64,
        size: [u32; 2],
    ) -> Self {
        Self { origin, rows, warp, space, light, texels, depth_range, size }
    }

    /// Returns the matrix from world space to clip space.
    ///
    /// Round it to `f32` with `as_mat4()`. Far from the world's origin the `f32` matrix, not this one, loses texels:
    /// use [`ShadowMap::clip_from_world_at`] there, and see [`Fit::rounding`](crate::Fit::rounding).
    #[must_use]
    pub fn clip_from_world(&self, space: ClipSpace) -> DMat4 {
        self.clip_from_world_at(DVec3::ZERO, space)
    }

    /// Returns the matrix from world directions and positions relative to `origin` to clip space: for the eye's
    /// position as origin, the one to use with camera-relative rendering.
    ///
    /// Accuracy: 1e-13 (1 + eta) in normalised device coordinates at [`ShadowMap::origin`]; times one plus the
    /// distance from there over the size of the body elsewhere. (An explicit warp about an eye far from the body adds
    /// one rounding of that distance, over the size of the body, times eta: it is not known better where the eye is.)
    #[must_use]
    pub fn clip_from_world_at(&self, origin: DVec3, space: ClipSpace) -> DMat4 {
        from_rows(space.convert(self.rows_at(origin)))
    }

    /// Returns the matrix to texture coordinates and depth, `(u, v, depth, w)`, for positions relative to `origin`:
    /// what a shader looks the shadow up with, after division by `w`.
    #[must_use]
    pub fn texture_from_world_at(&self, origin: DVec3, space: ClipSpace) -> DMat4 {
        space.texture_from_clip() * self.clip_from_world_at(origin, space)
    }

    /// Returns the point in world space about which the matrix is most accurate: the receivers' own origin.
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Returns the warp that the rule decided on. For a perspective or plane-optimal map: the warp along the axis that
    /// [`ShadowMap::light_space`] has for it.
    #[must_use]
    pub fn warp(&self) -> Warp {
        self.warp
    }

    /// Returns the axes of light space. Those of a perspective or plane-optimal map are turned about the light, so that
    /// its warp runs along `z`.
    #[must_use]
    pub fn light_space(&self) -> LightSpace {
        self.space
    }

    /// Returns `[width, height]` in texels.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    pub(crate) fn depth_range(&self) -> f64 {
        self.depth_range
    }

    /// Returns the denominator `w` of a point in world space: 1 where the receivers' body begins, and the warp's ratio
    /// where it ends; for a spot light times the distance along its axis.
    #[must_use]
    pub fn w(&self, point: DVec3) -> f64 {
        self.rows[3].dot((point - self.origin).extend(1.0))
    }

    /// Returns the unit vector from a point in world space towards the light: zero at the light itself.
    #[must_use]
    pub fn to_light(&self, point: DVec3) -> DVec3 {
        if self.light.w == 0.0 {
            return self.light.truncate();
        }
        let to_light = self.light.truncate() - (point - self.origin);
        let length = sqrt(to_light.length_squared());
        if length > 0.0 { to_light / length } else { DVec3::ZERO }
    }

    /// Returns the part of a box that the map shows: what lies between its sides, and between its near and far plane. For
    /// culling, and for drawing. (For a light at infinity [`Body::casters`] is tighter: what can shadow what is seen.)
    #[must_use]
    pub fn shown(&self, bounds: &Bounds) -> Body {
        let origin = self.origin.clamp(bounds.min(), bounds.max());
        let [x, y, z, w] = self.rows_at(origin);
        Body::where_positive(bounds, origin, &[w - x, w + x, w - y, w + y, z, w - z])
    }

    /// Returns the world extent of a texel along each of the map's axes at a point in world space, in world units, on the
    /// plane through it across the light's axis.
    ///
    /// ```text
    /// across the warp: w dx        along the warp: w^2/b dz       [LiSPSM, Sec. 4.3, without the view's part]
    /// ```
    /// with `dx`, `dz` the extents where `w = 1`, and `b` the distance along the axis of a spot light, or 1. A map's axis that
    /// lies askew to the warp ([`Axes::LightFixed`](crate::Axes), and perspective and plane-optimal maps) has both. The
    /// shear, by which a step along the warp also moves a point across it, is left out, as in the papers. Infinite where
    /// `w <= 0`, which no receiver is, nor a caster of one.
    #[must_use]
    pub fn texel_extent(&self, point: DVec3) -> [f64; 2] {
        self.texels_at(self.origin).at(point - self.origin)
    }

    /// The size of its texels, as rows about an origin.
    pub(crate) fn texels_at(&self, origin: DVec3) -> Texels {
        let shift = (origin - self.origin).extend(1.0);
        let [w, base] = [self.rows[3], self.base()].map(|row| row.truncate().extend(row.dot(shift)));
        Texels { w, base, extents: self.texels }
    }

    /// The row, about the map's origin, of the distance along the light's axis: 1 for a light at infinity.
    pub(crate) fn base(&self) -> DVec4 {
        let y = self.space.y * self.light.w;
        (-y).extend(if self.light.w == 0.0 { 1.0 } else { y.dot(self.light.truncate()) })
    }

    /// Returns the map drawn in by a border of so many texels on each of its four sides, for filters that read around
    /// a point. The receivers fill the rest.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `0 <= border_texels` and twice that is less than the map's width and height.
    pub fn with_border(&self, border_texels: f64) -> Result<Self, Error> {
        let [width, height] = self.size.map(f64::from);
        let fits = border_texels >= 0.0 && 2.0 * border_texels < width.min(height);
        require(fits, "border_texels", "must not be negative, and leave at least part of a texel")?;
        let margin = |texels: f64| 2.0 * border_texels / texels;
        Ok(self.with_margin(DVec3::new(margin(width), margin(height), 0.0)))
    }

    /// Draws the map in: `|x|` and `|y|` of normalised device coordinates to `1 - margin`, depth to between `margin`
    /// and `1 - margin`.
    pub(crate) fn with_margin(&self, margin: DVec3) -> Self {
        let [x, y, z, w] = self.rows;
        let rows = [x * (1.0 - margin.x), y * (1.0 - margin.y), z * (1.0 - 2.0 * margin.z) + w * margin.z, w];
        let texels = [self.texels[0] / (1.0 - margin.x), self.texels[1] / (1.0 - margin.y)];
        Self { rows, texels, depth_range: self.depth_range / (1.0 - 2.0 * margin.z), ..*self }
    }

    /// The rows for positions relative to another origin.
    pub(crate) fn rows_at(&self, origin: DVec3) -> [DVec4; 4] {
        let shift = (origin - self.origin).extend(1.0);
        self.rows.map(|row| row.truncate().extend(row.dot(shift)))
    }
}

/// How large the texels of a map are: all of it that its aliasing depends on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Texels {
    pub(crate) w: DVec4,
    /// The distance along the light's axis; 1 for a light at infinity.
    pub(crate) base: DVec4,
    /// Where both are 1: of each of the map's axes, across and along the warp.
    pub(crate) extents: [DVec2; 2],
}

impl Texels {
    /// The extents of a texel along each of the map's axes; infinite where `w <= 0`.
    #[inline(always)]
    pub(crate) fn at(&self, q: DVec3) -> [f64; 2] {
        let [w, base] = [self.w, self.base].map(|row| row.truncate().dot(q) + row.w);
        // NaN is beyond the map too.
        if w > 0.0 && base > 0.0 {
            self.extents.map(|texel| length(w * texel.x, w * w / base * texel.y))
        } else {
            [f64::INFINITY; 2]
        }
    }
}

/// The length of `(a, b)`, exact if either is zero, without overflow.
fn length(a: f64, b: f64) -> f64 {
    let (large, small) = if a > b { (a, b) } else { (b, a) };
    if small == 0.0 {
        return large;
    }
    let ratio = small / large;
    large * sqrt(1.0 + ratio * ratio)
}
