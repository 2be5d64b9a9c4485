//! What a shader needs to look a shadow up.

use glam::{DVec3, DVec4};

use crate::bias::{DepthFormat, Filter};
use crate::clip_space::ClipSpace;
use crate::map::ShadowMap;

/// All that a shader looks a shadow up with, rounded to `f32`, in a layout that is the same in WGSL, GLSL (std140 and std430) and
/// HLSL: a matrix, a vector of four, and four numbers; 96 bytes.
///
/// ```text
/// struct Lookup {                                let q = lookup.texture_from_world * vec4(position, 1.0);
///     texture_from_world: mat4x4<f32>,           let uv = q.xy/q.w;
///     linear_depth: vec4<f32>,                   let depth = q.z/q.w;         // or, where it was written:
///     texel: vec2<f32>,                          let depth = dot(lookup.linear_depth, vec4(position, 1.0));
///     slope_factor: f32,                         // by a receiver's own slopes of depth per texel:
///     constant_bias: f32,                        let bias = lookup.constant_bias
/// }                                                  + lookup.slope_factor * (abs(slope.x) + abs(slope.y));
/// ```
/// Positions are relative to the origin that it was made for. Compare `depth - bias` with what is stored: the bias has the
/// sign of the depth's convention, so it is negative for reversed depth.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Lookup {
    /// Columns of [`ShadowMap::texture_from_world_at`].
    pub texture_from_world: [[f32; 4]; 4],
    /// The row that was given, such as that of [`Fit::linear_depth`](crate::Fit::linear_depth); zero where none was. That one
    /// grows away from the light: for reversed depth give 1 less it, as it is written, so that the biases have its sign.
    pub linear_depth: [f32; 4],
    /// The size of a texel in texture coordinates: one over the map's width and height.
    pub texel: [f32; 2],
    /// The filter's reach in texels, times the sign of the depth's convention: the bias that a plane needs is this times the
    /// sum of its slopes per texel, [`Filter::least_bias`].
    pub slope_factor: f32,
    /// The depth format's quantum at a stored depth of 1, where it is coarsest, times the sign of the depth's convention.
    pub constant_bias: f32,
}

impl Lookup {
    /// Returns the numbers in order, for interfaces that take bytes.
    #[must_use]
    pub fn to_array(&self) -> [f32; 24] {
        let mut all = [0.0; 24];
        all[..16].copy_from_slice(self.texture_from_world.as_flattened());
        all[16..20].copy_from_slice(&self.linear_depth);
        all[20..22].copy_from_slice(&self.texel);
        all[22..].copy_from_slice(&[self.slope_factor, self.constant_bias]);
        all
    }
}

impl ShadowMap {
    /// Returns what a shader needs, for positions relative to `origin`, a filter and a depth format. `linear_depth`: the row that
    /// [`Fit::linear_depth`](crate::Fit::linear_depth) gives about the same origin, where depth is written in the
    /// fragment stage.
    ///
    /// The map should be guarded for that origin ([`Fit::guard_f32`](crate::Fit::guard_f32)).
    #[must_use]
    pub fn lookup(
        &self,
        origin: DVec3,
        space: ClipSpace,
        filter: Filter,
        format: DepthFormat,
        linear_depth: Option<DVec4>,
    ) -> Lookup {
        let [width, height] = self.size();
        let sign = space.away_from_light();
        Lookup {
            texture_from_world: self.texture_from_world_at(origin, space).as_mat4().to_cols_array_2d(),
            linear_depth: linear_depth.unwrap_or_default().as_vec4().to_array(),
            texel: [1.0 / width as f32, 1.0 / height as f32],
            slope_factor: (sign * filter.reach()) as f32,
            constant_bias: (sign * format.quantum(1.0)) as f32,
        }
    }
}
