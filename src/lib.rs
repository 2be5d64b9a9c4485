//! Shadow-map matrices.
#![no_std]
#[cfg(any(test, feature = "std"))]
extern crate std;
#[cfg(not(any(feature = "std", feature = "libm")))]
compile_error!("shadow-warp needs a square root: enable the feature `std` (default) or `libm`");

pub use glam;

pub mod aliasing;
mod basis;
mod body;
mod clip_space;
mod error;
mod fit;
mod light;
mod map;
mod margin;
mod math;
mod plane;
mod scene;
mod view;
mod warp;

pub use basis::{Axes, LightSpace};
pub use body::{Body, CasterBody, ConvexBody, Face};
pub use clip_space::{ClipSpace, DepthRange};
pub use error::Error;
pub use fit::{Fit, NearDepth};
pub use light::{Directional, Light, Point, Spot};
pub use map::ShadowMap;
pub use plane::Plane;
pub use scene::Bounds;
pub use view::{Lens, Sides, View};
pub use warp::{LightSpaceRule, Rule, Slab, Warp};
