//! A program on its own glam, passing glam's types to the library and back.

use glam::{DVec3, Mat4};
use shadow_warp::{Body, Bounds, ClipSpace, Error, Fit, Light, Rule, View};

fn main() -> Result<(), Error> {
    let view = View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, 1.0, 1.5, 1.0..100.0)?;
    let light = Light::directional(DVec3::Y)?;
    let bounds = Bounds::new(DVec3::splat(-50.0), DVec3::splat(50.0))?;
    let seen = [Body::visible(&view, &bounds)];
    let map = Fit::new(&view, &light, &bounds, &seen).solve(Rule::LISPSM)?;
    let matrix: Mat4 = map.clip_from_world_at(view.eye(), ClipSpace::WGPU).as_mat4();
    assert!(matrix.is_finite() && map.warp().ratio() > 1.0);
    Ok(())
}
