//! A program without std that fits a map, and ends with 0 if the map is right.
#![no_std]
#![no_main]

use core::ffi::c_int;

use shadow_warp::glam::DVec3;
use shadow_warp::{Body, Bounds, ClipSpace, Error, Fit, Light, Rule, View};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}

/// The prebuilt `core` asks for it; without unwinding it is never called.
#[unsafe(no_mangle)]
extern "C" fn rust_eh_personality() {}

fn greatest_overshoot() -> Result<f64, Error> {
    let view = View::perspective(DVec3::new(0.0, 10.0, 0.0), DVec3::Z, DVec3::Y, 1.0, 1.5, 1.0..f64::INFINITY)?;
    let light = Light::directional(DVec3::new(0.3, 1.0, -0.2))?;
    let bounds = Bounds::new(DVec3::new(-200.0, 0.0, 0.0), DVec3::new(200.0, 50.0, 400.0))?;
    let seen = [Body::visible(&view, &bounds)];
    let map = Fit::new(&view, &light, &bounds, &seen).solve(Rule::LISPSM)?;
    let clip_from_body = map.clip_from_world_at(seen[0].origin(), ClipSpace::WGPU);
    let mut greatest = DVec3::splat(-1.0);
    for vertex in seen[0].vertices() {
        greatest = greatest.max(clip_from_body.project_point3(*vertex).abs());
    }
    Ok(greatest.max_element())
}

#[unsafe(no_mangle)]
extern "C" fn main() -> c_int {
    match greatest_overshoot() {
        // The exact fit touches the sides of the map, and nothing lies beyond.
        Ok(greatest) if greatest > 1.0 - 1e-12 && greatest < 1.0 + 1e-12 => 0,
        _ => 1,
    }
}
