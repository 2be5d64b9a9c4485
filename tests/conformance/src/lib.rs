//! Shows that a real rasteriser does with the crate's matrices what the mathematics says.

pub mod camera;
pub mod check;
pub mod gpu;
pub mod pass;
pub mod pictures;
pub mod projection;
pub mod raster;
pub mod rays;
pub mod stage;
