//! How the sun's elevation decides what a warp is worth: `cargo run --example elevation`.
//!
//! The camera looks level over a plain towards the sun, as it sinks from overhead to the horizon. High up, the warp
//! makes the worst texel many times smaller; as the light comes to be parallel to the view there is nothing left to
//! gain, and the published rule fades to the uniform map.
#![expect(clippy::disallowed_methods, reason = "an example may take sine and cosine from std")]

use shadow_warp::glam::DVec3;
use shadow_warp::{Body, Bounds, Error, Fit, Light, Rule, View};

fn main() -> Result<(), Error> {
    let eye = DVec3::new(0.0, 2.0, 0.0);
    let view = View::perspective(eye, DVec3::Z, DVec3::Y, 60f64.to_radians(), 16.0 / 9.0, 0.5..f64::INFINITY)?;
    let plain = Bounds::new(DVec3::new(-500.0, -1.0, -500.0), DVec3::new(500.0, 20.0, 500.0))?;
    let seen = [Body::visible(&view, &plain)];

    println!("elevation  ratio  uniform  LiSPSM   (worst pixels per texel)");
    for degrees in (0..=90).rev().step_by(10) {
        let (sine, cosine) = f64::from(degrees).to_radians().sin_cos();
        let light = Light::directional(DVec3::new(0.0, sine, cosine))?;
        let fit = Fit { map_size: [2048, 2048], ..Fit::new(&view, &light, &plain, &seen) };
        let (uniform, warped) = (fit.solve(Rule::Uniform)?, fit.solve(Rule::LISPSM)?);
        println!(
            "{degrees:>8}°{:>7.2}{:>9.1}{:>8.1}",
            warped.warp().ratio(),
            fit.worst_texel(&uniform),
            fit.worst_texel(&warped)
        );
    }
    Ok(())
}
