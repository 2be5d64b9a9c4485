use core::ops::Range;

use glam::{DMat4, DVec4};

use crate::error::{Error, require};

/// Which depths lie at the near and the far plane of clip space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DepthRange {
    /// 0 at the near plane, 1 at the far plane. Compare with *less*, clear to 1.
    ZeroToOne,
    /// 1 at the near plane, 0 at the far plane ("reverse-Z"). Compare with *greater*, clear to 0; bias is negative.
    OneToZero,
    /// -1 at the near plane, 1 at the far plane. Compare with *less*, clear to 1 (in the 0 to 1 of the depth buffer).
    NegativeOneToOne,
}

/// The conventions of a graphics interface, as a value: what its clip space and its textures look like.
///
/// Whatever the interface, the map is the same picture: far from the eye is its top as displayed (with
/// [`Axes::View`](crate::Axes)), and the light's near plane is the near plane of depth. Triangles keep the winding
/// that an ordinary camera of the same interface gives them, in a right-handed world; in a left-handed world they get
/// the opposite one, so cull the other faces there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ClipSpace {
    /// The depth range.
    pub depth: DepthRange,
    /// Whether y of normalised device coordinates points down the displayed picture (Vulkan) and not up.
    pub y_down: bool,
    /// Whether the first row of a texture is the top of the displayed picture (all but OpenGL).
    pub texture_top_first: bool,
}

impl ClipSpace {
    /// WebGPU: depth 0 to 1, y up, first texture row at the top.
    pub const WGPU: Self = Self { depth: DepthRange::ZeroToOne, y_down: false, texture_top_first: true };
    /// Direct3D: as WebGPU.
    pub const DIRECT3D: Self = Self::WGPU;
    /// Metal: as WebGPU.
    pub const METAL: Self = Self::WGPU;
    /// Vulkan: depth 0 to 1, y down, first texture row at the top.
    pub const VULKAN: Self = Self { y_down: true, ..Self::WGPU };
    /// OpenGL: depth -1 to 1, y up, first texture row at the bottom.
    pub const OPENGL: Self = Self { depth: DepthRange::NegativeOneToOne, y_down: false, texture_top_first: false };
    /// OpenGL with `glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE)`.
    pub const OPENGL_ZERO_TO_ONE: Self = Self { depth: DepthRange::ZeroToOne, ..Self::OPENGL };

    /// Returns the same conventions with reversed depth: 1 at the near plane, 0 at the far plane. Twice is the
    /// identity for depth from 0 to 1.
    ///
    /// Depth from -1 to 1 has no reversed form worth having (its rounding is worst in the middle), so it becomes 1 to
    /// 0.
    #[must_use]
    pub const fn reversed(self) -> Self {
        let depth = match self.depth {
            DepthRange::ZeroToOne | DepthRange::NegativeOneToOne => DepthRange::OneToZero,
            DepthRange::OneToZero => DepthRange::ZeroToOne,
        };
        Self { depth, ..self }
    }

    /// Returns the matrix from this clip space to texture coordinates: `(u, v, depth, w)`, where after division by
    /// `w` `(0, 0)` is the corner of the first texel, `(1, 1)` that of the last one, and depth is as the depth buffer
    /// holds it.
    ///
    /// ```
    /// use shadow_warp::{ClipSpace, glam::{DVec3, DVec4}};
    /// let top_left_near = DVec4::new(-1.0, 1.0, 0.0, 1.0);
    /// assert_eq!(ClipSpace::WGPU.texture_from_clip() * top_left_near, DVec4::new(0.0, 0.0, 0.0, 1.0));
    /// ```
    #[must_use]
    #[rustfmt::skip]
    pub fn texture_from_clip(self) -> DMat4 {
        let v = if self.y_down == self.texture_top_first { 0.5 } else { -0.5 };
        let (z, z_w) = match self.depth {
            DepthRange::NegativeOneToOne => (0.5, 0.5),
            _ => (1.0, 0.0),
        };
        from_rows([
            DVec4::new(0.5, 0.0, 0.0, 0.5),
            DVec4::new(0.0, v,   0.0, 0.5),
            DVec4::new(0.0, 0.0, z,   z_w),
            DVec4::new(0.0, 0.0, 0.0, 1.0),
        ])
    }

    /// Returns the distance along the view direction of a point that a perspective camera's depth buffer holds, from its depth in normalised
    /// device coordinates (from 0 to 1, or -1 to 1, as these conventions have it) and the camera's near and far distance,
    /// which may be infinite: for the least depth that is really seen, read back from the frame before, as a near plane or as
    /// [`Fit::warp_depths`](crate::Fit::warp_depths).
    ///
    /// ```text
    /// 0 to 1: f n/(f - D (f - n))    1 to 0: f n/(n + D (f - n))    -1 to 1: 2 f n/(f + n - D (f - n))
    /// ```
    /// Form: `n/(1 - D + D n/f)` and the like, which has a value for an infinite far plane.
    /// Domain: depths of what lies between the planes; the result is between near and far then. It is one frame old, so multiply
    /// it by a factor below 1. Read from an `f32` buffer the depth itself has few digits left far away: at far/near 1e7 the
    /// distance is off by 30 % from 0 to 1, and by 1e-7 from 1 to 0. PSM, Sec. 6, reads it back; the worst error falls with the near
    /// distance found.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `0 < near < far`, `near` is finite, and `depth` finite.
    pub fn view_depth(self, depth: f64, range: Range<f64>) -> Result<f64, Error> {
        let Range { start: near, end: far } = range;
        require(near > 0.0 && near.is_finite(), "near", "must be positive and finite")?;
        require(far > near, "far", "must be greater than near")?;
        require(depth.is_finite(), "depth", "must be finite")?;
        let from_far = match self.depth {
            DepthRange::ZeroToOne => 1.0 - depth,
            DepthRange::OneToZero => depth,
            DepthRange::NegativeOneToOne => 0.5 * (1.0 - depth),
        };
        let from_near = match self.depth {
            DepthRange::ZeroToOne => depth,
            DepthRange::OneToZero => 1.0 - depth,
            DepthRange::NegativeOneToOne => 0.5 * (1.0 + depth),
        };
        Ok(near / (from_far + from_near * (near / far)))
    }

    /// Rewrites the rows of a WebGPU clip matrix for these conventions. Exact but for one rounding in the depth row.
    pub(crate) fn convert(self, [x, y, z, w]: [DVec4; 4]) -> [DVec4; 4] {
        let depth = match self.depth {
            DepthRange::ZeroToOne => z,
            DepthRange::OneToZero => w - z,
            DepthRange::NegativeOneToOne => z + z - w,
        };
        [x, if self.y_down { -y } else { y }, depth, w]
    }
}

/// Returns the matrix with these rows, for column vectors.
pub(crate) fn from_rows([x, y, z, w]: [DVec4; 4]) -> DMat4 {
    DMat4::from_cols(x, y, z, w).transpose()
}
