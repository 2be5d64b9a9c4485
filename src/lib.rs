//! Where should a shadow map spend its texels?
//!
//! `shadow-warp` turns a camera, a light and the bounds of a scene into the matrix of a shadow map, and says in
//! closed form how much that map aliases. It is mathematics only: no graphics interface, no allocation, no `std`, no
//! `unsafe`. From the pieces to the matrix of one box under a directional light, on the view's axes, takes 0.6 to 1.2
//! microseconds by the rule (measured: `docs/speed-and-error.md`); more boxes, spot lights and chosen depths take longer.
//!
//! ```
//! use shadow_warp::glam::{DVec3, Mat4};
//! use shadow_warp::{Body, Bounds, ClipSpace, Error, Fit, Light, Rule, View};
//!
//! # fn main() -> Result<(), Error> {
//! let eye = DVec3::new(0.0, 10.0, 0.0);
//! let fov_y = 60f64.to_radians();
//! let view = View::perspective(eye, DVec3::Z, DVec3::Y, fov_y, 16.0 / 9.0, 0.5..f64::INFINITY)?;
//! let to_sun = DVec3::new(0.3, 1.0, -0.2);
//! let light = Light::directional(to_sun)?;
//! let scene = Bounds::new(DVec3::new(-200.0, 0.0, 0.0), DVec3::new(200.0, 50.0, 400.0))?;
//!
//! // What shadows can be seen on. Lights under one view share it.
//! let seen = [Body::visible(&view, &scene)];
//! let fit = Fit { map_size: [2048, 2048], ..Fit::new(&view, &light, &scene, &seen) };
//! let plain = fit.solve(Rule::Uniform)?;
//! let map = fit.solve(Rule::OPTIMAL)?;
//! // In pixels per texel:
//! assert!(fit.worst_texel(&map) < 0.1 * fit.worst_texel(&plain));
//!
//! // For positions relative to the eye, safe to round to f32:
//! let map = fit.guard_f32(&map, eye)?;
//! let clip_from_eye_relative: Mat4 = map.clip_from_world_at(eye, ClipSpace::WGPU).as_mat4();
//! # Ok(())
//! # }
//! ```
//!
//! # One family, one parameter
//! Put the world in *light space*: `Y` towards the light, `Z` along the view made perpendicular to it, `X` across.
//! Let what is seen lie between `z0` and `z0 + d` along `Z`, and `t = (z - z0)/d`. The perspective warps that keep
//! the light's direction, run along `Z` and have one centre across it, are then one family with one number, the **excess**
//! `eta >= 0`. (Another direction is another family. Another centre shears the texture, and can be better.)
//!
//! ```text
//! w = 1 + eta t        x' = x/w        s = (1 + eta) t/w
//! ```
//! `eta = 0` *is* the uniform map, focused on what is seen. With the light perpendicular to the view and depths from
//! near `n` to far `f`, the ratio `1 + eta` is 1 for the uniform map, `f/n` for perspective shadow maps (PSM), and
//! `sqrt(f/n)`, half way in logarithm, for light-space perspective shadow maps (LiSPSM); trapezoidal ones (TSM) have
//! whatever puts a chosen point on a chosen line. For a spot light this is done in the light's own perspective. So there are
//! three words: a [`Rule`] decides, a [`Warp`] is what is decided, a [`ShadowMap`] is what is fitted. The papers' `n`, `f` of the
//! warp, its centre of projection and `(f + n)/(f - n)` are never formed: they are infinite for the uniform map.
//!
//! # Which rule
//! | rule | the excess | where it serves |
//! |---|---|---|
//! | [`Rule::OPTIMAL`] | least [`Fit::worst_texel`] on these axes, with this centre | receivers that are tight about what is looked at |
//! | [`Rule::LISPSM`] | a published formula, fading out where light and view are parallel | open scenes, the sun to the side |
//! | [`Rule::OnAxis`] | the least error on the line of sight | as before, also for spot lights |
//! | [`Rule::TSM`] | a chosen depth gets a chosen share of the map | when one depth matters most |
//! | [`Rule::PSM`] | the camera's own perspective | to compare with; its warp has a direction of its own |
//! | [`Rule::Plane`] | constant pixels per texel on a plane, one number for each of the map's axes | ground with little on it |
//! | [`Rule::Uniform`] | none | light along the view; orthographic cameras |
//!
//! [`Rule::OPTIMAL`] is never worse than [`Rule::Uniform`] on the same axes, by [`Fit::worst_texel`], to a relative 1e-9,
//! if no depths are chosen (tests `outdoor_scenes`, `full_circles`). That number looks at every point of the receivers' bodies, air included: of a tall
//! box it is the air next to the near plane, and the ground that people look at may come out worse than without a warp. Give
//! receivers that are tight about what is seen, or [`Fit::warp_depths`]. [`Fit::least_errors`] has a lower bound for the
//! error along the warp.
//!
//! # The way through
//! | step | type | what it adds |
//! |---|---|---|
//! | view | [`View`], [`Light`], [`Bounds`] | the pieces, validated |
//! | body | [`Body`], [`LitBody`] | the receivers: the box cut by the view volume, and by a spot light's cone; its casters on request |
//! | basis | [`LightSpace`], [`Axes`] | the frame |
//! | warp | [`Rule`], [`Warp`] | the excess |
//! | fit | [`Fit`], [`ShadowMap`] | the matrix; [`Fit::guard_f32`] and [`ShadowMap::with_border`] as outermost steps |
//! | aliasing | [`aliasing`] | the worst texel, exactly |
//! | bias | [`mod@bias`] | the least depth bias, exactly |
//! | lookup | [`Lookup`] | what a shader needs, rounded to `f32` |
//!
//! # Conventions
//! World space is right-handed (in a left-handed one the map is right too, but triangles show their other side).
//! Matrices are for column vectors; `clip_from_world` takes world to clip space. What a graphics interface wants is a
//! value: [`ClipSpace::WGPU`], [`ClipSpace::VULKAN`], [`ClipSpace::OPENGL`] and so on, each
//! [`reversed`](ClipSpace::reversed) if need be. Depth grows away from the light (before reversal). `f64` goes in and
//! comes out; round the finished matrix, once. Vertices and planes of bodies are relative to a point near by,
//! [`ConvexBody::origin`].
//!
//! # Glossary
//! | quantity | here | LiSPSM 2004 | Wimmer, Scherzer 2005 | Lloyd 2007 |
//! |---|---|---|---|---|
//! | eye's near and far distance | [`View::near`], [`View::far`] | `z_n`, `z_f` | `z_n`, `z_f` | `n`, `f` |
//! | depth range of what is seen | [`Slab::near`], [`Slab::far`] | (of the body) | | |
//! | extent along light space's z | [`Slab::extent`], `d` | `f - n` | `Delta z` | |
//! | warp's near distance | `d/eta`, never formed | `n` | `n_opt` | `n'` |
//! | warp ratio, far over near | [`Warp::ratio`], `1 + eta` | `f/n` | | |
//! | excess | [`Warp::excess`], `eta` | `(f - n)/n` | | |
//! | angle between light and view | sine: [`LightSpace::sin_gamma`] | `gamma` | `gamma` | `theta` |
//! | place in the body, in the map | `t`, `s` | `z'`, `s` | | |
//! | what is to be covered | [`Body`] | `B` | `B` | |
//!
//! # Where the papers err
//! LiSPSM Eq. 2 has a sign wrong ([`Warp::map_from_body`]); its refinement in Sec. 4.4 fades the warp out more
//! slowly, not faster. The four published variants disagree as light and view come to be parallel, and each can be
//! worse than no warp there: [`LightSpaceRule`] has numbers, and [`Rule::OPTIMAL`] mends it. PSM's aim at the middle of its
//! cube has what is seen behind the light where the sun is in the picture ([`Aim`]), and needs no reversed depth test and no
//! moved camera ([`PerspectiveRule`]). TSM's warp does not fade out as light and view become parallel, but ends in a jump
//! ([`TrapezoidalRule`]).
//!
//! # Numbers
//! Geometry uses `+ - * / sqrt` only, so results are the same to the bit with `std` and with `libm` (the tangent of a
//! field of view or a cone apart, and the logarithm of [`Fit::least_errors`];
//! [`View::perspective_off_centre`] takes tangents). The matrix is accurate to 1e-13 (1 + eta) in
//! normalised device coordinates, for depth ratios up to 1e7 and any angle between light and view, about a point of the
//! scene ([`ShadowMap::origin`]). Lengths from
//! 1e-100 to 1e100 are accepted; NaN, and infinity but for far distances, are errors that name the argument, wherever a function can fail (the
//! others, plain formulas, return NaN for NaN); nothing panics.
//!
//! # Features
//! | feature | default | |
//! |---|---|---|
//! | `std` | yes | the square root from `std` |
//! | `libm` | | the square root from `libm`, for `no_std`; `std` wins where both are on |
//! | `serde`, `bytemuck`, `mint` | | glam's features of these names, for its vectors and matrices |
//!
//! # Sources
//! M. Wimmer, D. Scherzer, W. Purgathofer: *Light Space Perspective Shadow Maps*, 2004 ("LiSPSM"). M. Wimmer, D.
//! Scherzer: *Robust Shadow Mapping with Light-Space Perspective Shadow Maps*, in ShaderX4, 2005. M. Stamminger, G.
//! Drettakis: *Perspective Shadow Maps*, 2002 ("PSM"). T. Martin, T.-S. Tan: *Anti-aliasing and Continuity with Trapezoidal
//! Shadow Maps*, 2004. H. Chong, S. Gortler: *A Lixel for every Pixel*, 2004. D. B. Lloyd: *Logarithmic Perspective Shadow
//! Maps*, 2007.
#![no_std]
#[cfg(any(test, feature = "std"))]
extern crate std;
#[cfg(not(any(feature = "std", feature = "libm")))]
compile_error!("shadow-warp needs a square root: enable the feature `std` (default) or `libm`");

pub use glam;

pub mod aliasing;
mod basis;
pub mod bias;
mod body;
mod clip_space;
mod error;
mod fit;
mod light;
mod lookup;
mod map;
mod margin;
mod math;
mod plane;
mod scene;
mod view;
mod warp;

pub use basis::{Axes, LightSpace};
#[doc(no_inline)]
pub use bias::{DepthFormat, Filter, vertex_depth_error};
pub use body::{Body, CasterBody, ConvexBody, Face, LitBody, WideBody, WideCasterBody};
pub use clip_space::{ClipSpace, DepthRange};
pub use error::Error;
pub use fit::{Fit, NearDepth};
pub use light::{Directional, Light, Point, Spot};
pub use lookup::Lookup;
pub use map::ShadowMap;
pub use plane::Plane;
pub use scene::Bounds;
pub use view::{Lens, Sides, View};
pub use warp::{
    Aim, Aliasing, LightSpaceRule, Objective, PerspectiveRule, Rule, Slab, TrapezoidalRule, ViewAxis, Warp,
};

/// The README's example is a test too.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
