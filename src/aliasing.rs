//! How good a map is, in closed form.

mod worst;

pub use worst::{pixels_per_texel, worst};
