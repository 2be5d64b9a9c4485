//! The checks. Each takes a device, a stage and a technique, and returns what it measured.

mod containment;
mod conventions;
mod far_away;
mod lookup;
mod picture;
mod place;

pub use containment::{Containment, containment, nearest};
pub use conventions::{Conventions, SPACES, conventions};
pub use far_away::{FarAway, far_away};
pub(crate) use lookup::Lookup;
pub use picture::{Changes, Shadows, changes, shadows};
pub use place::{Origin, place};

use scenes::Model;
use shadow_warp::glam::{DMat3, DVec3};
use shadow_warp::{Fit, ShadowMap};

use crate::gpu::Gpu;
use crate::raster::Allowance;
use crate::stage::Stage;

/// The angles between light and view at which every technique is checked, in degrees.
pub const ANGLES: [f64; 6] = [90.0, 60.0, 30.0, 10.0, 1.0, 0.0];
/// The sizes of map with which every technique is checked, in texels.
pub const SIZES: [u32; 3] = [256, 1024, 4096];

/// Returns the scenes beside the ground: two under the sun, one under a spot light, one around a point light.
#[must_use]
pub fn other_scenes() -> Vec<Model> {
    vec![Model::town(), Model::avenue(), Model::chessboard(), Model::hall()]
}

/// Returns the ground under a light at an angle to the view: at 0 degrees it shines where the camera looks.
///
/// # Errors
/// As [`Stage::new`].
pub fn ground_at(degrees: f64) -> anyhow::Result<Stage> {
    let ground = Model::ground();
    let forward = DVec3::from(ground.scene.view.forward).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    // Not straight above the view, so that no axis is a special one.
    let towards = DMat3::from_axis_angle(forward, 25_f64.to_radians()) * right.cross(forward);
    let turn = DMat3::from_axis_angle(towards.cross(forward), degrees.to_radians());
    Stage::new(ground.under_sun(turn * -forward))
}

/// What error a device may make with a map, relative to an origin.
#[must_use]
pub fn allowance(gpu: &Gpu, fit: &Fit, map: &ShadowMap, origin: DVec3) -> Allowance {
    let rounding = fit.rounding(map, origin);
    // The device's own way from clip coordinates to texels: four roundings of numbers up to the map's size.
    let viewport = 2.0 * f64::from(f32::EPSILON) * f64::from(map.size()[0].max(map.size()[1]));
    let moved = rounding.truncate().length() + viewport;
    let grid = gpu.grid() * std::f64::consts::FRAC_1_SQRT_2;
    // Where depth is taken from rounded positions, so it is from those of clipped corners, which are rounded again.
    let shift = if gpu.is_lavapipe() { moved } else { 1.5 * grid + moved };
    Allowance { coverage: grid + moved, depth: rounding.z, shift }
}

/// Names the counts that are above what is allowed.
fn above(most: usize, counts: &[(usize, &str)]) -> Vec<String> {
    counts.iter().filter(|(count, _)| *count > most).map(|(count, what)| format!("{count} {what}")).collect()
}

/// The larger number; a number that is none is worse than any.
pub(crate) fn worse(a: f64, b: f64) -> f64 {
    if a > b || a.is_nan() { a } else { b }
}
