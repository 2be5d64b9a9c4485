//! Shows that a real rasteriser does with the crate's matrices what the mathematics says.
//!
//! ```text
//! scenes::Model -> Stage -> what the device draws (gpu, pass, shaders.wgsl)
//!                        -> what it must draw, in f64: place in the map (projection), texels (raster),
//!                           the camera's points (camera), the truth about shadows (rays)
//!                        -> check: the two compared, and what was measured
//! ```
//! A technique is a row of `scenes::TECHNIQUES`. A check is a function in [`check`] whose result lists its failures: the
//! tests assert that there are none, and the program prints the rest as `docs/conformance.md`.

pub mod camera;
pub mod check;
pub mod gpu;
pub mod pass;
pub mod pictures;
pub mod projection;
pub mod raster;
pub mod rays;
pub mod stage;
