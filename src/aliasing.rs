//! How good a map is, in closed form.

mod worst;

pub(crate) use worst::Worst;
pub use worst::{pixels_per_texel, worst};
