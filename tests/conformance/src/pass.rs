//! What goes into a pass, and what comes out of it.

use shadow_warp::glam::DVec3;
use shadow_warp::{ClipSpace, DepthRange};

/// How a depth map is drawn.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct DepthPass {
    /// The conventions of the matrix, and so the clear value, the comparison and which faces are front ones.
    pub space: ClipSpace,
    /// Whether depth outside 0 to 1 is clamped ("depth clamp") and not clipped.
    pub clamp: bool,
    /// Which faces are left out.
    pub cull: Option<wgpu::Face>,
}

impl DepthPass {
    /// For [`ClipSpace::WGPU`], with clipping, all faces.
    pub const WGPU: Self = Self { space: ClipSpace::WGPU, clamp: false, cull: None };

    pub(crate) fn is_reversed(self) -> bool {
        self.space.depth == DepthRange::OneToZero
    }

    /// The depth of a texel that nothing was drawn on.
    #[must_use]
    pub fn cleared(self) -> f32 {
        if self.is_reversed() { 0.0 } else { 1.0 }
    }

    /// Which triangles wgpu must call front ones. Its first row is the top of the picture; an interface that puts the
    /// bottom there draws, in wgpu's terms, upside down.
    pub(crate) fn front(self) -> wgpu::FrontFace {
        if self.space.texture_top_first { wgpu::FrontFace::Ccw } else { wgpu::FrontFace::Cw }
    }

    /// What the interface does to clip coordinates, as the shader applies it. wgpu fills the first row of a texture from
    /// y = 1; where the interface's first row shows y = -1, be it the top (Vulkan) or the bottom (OpenGL), y is turned.
    pub(crate) fn adapt(self) -> [f32; 4] {
        let first_row_at_plus_one = self.space.texture_top_first != self.space.y_down;
        let y = if first_row_at_plus_one { 1.0 } else { -1.0 };
        let (z, z_w) = if self.space.depth == DepthRange::NegativeOneToOne { (0.5, 0.5) } else { (1.0, 0.0) };
        [y, z, z_w, 0.0]
    }
}

/// Triangles on the device, relative to an origin and rounded to `f32`.
pub struct Mesh {
    pub(crate) positions: Vec<f32>,
    pub(crate) buffer: wgpu::Buffer,
}

impl Mesh {
    /// The corners as the device has them, relative to the origin.
    pub fn corners(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.positions.chunks_exact(3).map(|p| DVec3::new(p[0].into(), p[1].into(), p[2].into()))
    }

    pub(crate) fn len(&self) -> usize {
        self.positions.len() / 3
    }
}

/// A depth map on the device.
pub struct DepthMap {
    /// How it was drawn.
    pub pass: DepthPass,
    pub(crate) texture: wgpu::Texture,
}

/// A pixel of a lit picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// The triangle that is seen there.
    pub triangle: usize,
    /// Whether the shadow map says that light reaches it.
    pub lit: bool,
    /// Its place in the shadow map: `u`, `v`, depth.
    pub place: [f32; 3],
    /// The differences of `u` and `v` between this pixel and its neighbour in its pair, across and down.
    pub change: [[f32; 2]; 2],
}
