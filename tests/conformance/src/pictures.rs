//! Pictures to look at: the lit scene, the depth map, and how many pixels a texel covers.

use anyhow::Result;
use colorous::Gradient;
use scenes::Technique;
use shadow_warp::ClipSpace;
use shadow_warp::glam::{DMat2, DVec2, DVec3};

use crate::check::Lookup;
use crate::gpu::Gpu;
use crate::pass::Pixel;
use crate::stage::Stage;

/// A picture.
pub struct Image {
    /// `[width, height]`.
    size: [u32; 2],
    /// Row by row from the upper left.
    pixels: Vec<[u8; 3]>,
}

impl Image {
    /// Returns the picture as a PNG file.
    ///
    /// # Errors
    /// If it cannot be encoded.
    pub fn png(&self) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.size[0], self.size[1]);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header()?.write_image_data(self.pixels.as_flattened())?;
        Ok(bytes)
    }

    /// Returns pictures in rows, each in a cell of the size of the largest.
    #[must_use]
    pub fn sheet<const COLUMNS: usize>(rows: &[[&Self; COLUMNS]]) -> Self {
        const GAP: usize = 4;
        let side =
            |axis: usize| rows.as_flattened().iter().map(|image| image.size[axis] as usize).max().unwrap_or(0) + GAP;
        let (cell, width) = ([side(0), side(1)], COLUMNS * side(0));
        let mut pixels = vec![[255; 3]; width * rows.len() * cell[1]];
        for (row, images) in rows.iter().enumerate() {
            for (column, image) in images.iter().enumerate() {
                let start = row * cell[1] * width + column * cell[0];
                for (y, line) in image.pixels.chunks_exact(image.size[0] as usize).enumerate() {
                    pixels[start + y * width..][..line.len()].copy_from_slice(line);
                }
            }
        }
        Self { size: [width, rows.len() * cell[1]].map(|side| side as u32), pixels }
    }
}

/// What a technique looks like.
pub struct Pictures {
    /// The scene, lit through the map.
    pub shaded: Image,
    /// The map, dark where it is near the light.
    pub depth: Image,
    /// The scene, coloured by the pixels that the longer side of a texel covers: see [`HEAT`].
    pub heat: Image,
}

/// The ends of the scale of colours, blue to red, in pixels per texel; it is logarithmic.
pub const HEAT: [f64; 2] = [1.0 / 16.0, 64.0];
const HEAT_COLOURS: Gradient = colorous::TURBO;
const SKY: [u8; 3] = [216, 226, 236];
/// Where no light falls.
const UNLIT: [u8; 3] = [120, 120, 124];
/// The longer side of the picture of a depth map, in texels.
const DEPTH_SIDE: u32 = 384;

/// Returns the colour that a number of pixels per texel has.
#[must_use]
pub fn heat(pixels_per_texel: f64) -> [u8; 3] {
    let [low, high] = HEAT.map(f64::log10);
    let share = (pixels_per_texel.log10() - low) / (high - low);
    // Also where a number is lost.
    let share = if share > 0.0 { share.min(1.0) } else { 0.0 };
    HEAT_COLOURS.eval_continuous(share).into_array()
}

/// Draws a technique on a stage, with a map of the stage's size.
///
/// # Errors
/// If there is no map, `f32` cannot hold it, or the device refuses.
pub fn pictures(gpu: &Gpu, stage: &Stage, technique: &Technique) -> Result<Pictures> {
    let fit = technique.fit(&stage.job, &stage.receivers);
    let eye = stage.job.view.eye();
    let map = fit.guard_f32(&fit.solve(stage.rule(technique)?)?, eye)?;
    let lookup = Lookup::new(gpu, stage, &fit, &map)?;
    let pixels = lookup.draw(gpu, ClipSpace::WGPU)?;
    let (view, camera) = (&stage.job.view, stage.camera());
    // The cosine at which light falls on what is seen; 0 where none does. Positions are relative to the eye.
    let facing = |pixel: &Pixel, place: DVec2| {
        let facet = &stage.facets[pixel.triangle];
        let point = stage.on(facet, place);
        // The side that is seen counts.
        let away = if view.is_perspective() { facet.offset } else { facet.normal.dot(view.forward()) };
        let cosine = -away.signum() * facet.normal.dot(stage.to_light(point));
        if stage.job.shines_on(point + eye) { cosine.max(0.0) } else { 0.0 }
    };
    let texels = DVec2::from(map.size().map(f64::from));
    let coloured = |colour: &dyn Fn(&Pixel, DVec2) -> [u8; 3]| {
        let width = camera.size[0] as usize;
        let place = |index: usize| DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
        let colour =
            |(index, pixel): (usize, &Option<Pixel>)| pixel.as_ref().map_or(SKY, |pixel| colour(pixel, place(index)));
        Image { size: camera.size, pixels: pixels.iter().enumerate().map(colour).collect() }
    };
    let shaded = |pixel: &Pixel, place: DVec2| {
        let light = 0.35 + 0.65 * if pixel.lit { facing(pixel, place) } else { 0.0 };
        let surface = DVec3::new(226.0, 216.0, 200.0) * light.sqrt();
        surface.to_array().map(|x| x as u8)
    };
    let heated = |pixel: &Pixel, place: DVec2| {
        if facing(pixel, place) <= 0.0 {
            return UNLIT;
        }
        let [across, down] = pixel.change.map(|change| DVec2::from(change.map(f64::from)) * texels);
        heat(texel_length(DMat2::from_cols(across, down)))
    };

    let longer = map.size()[0].max(map.size()[1]);
    let size = map.size().map(|side| (side * DEPTH_SIDE / longer).max(1));
    let clip_from_eye = map.clip_from_world_at(eye, ClipSpace::WGPU);
    let depths = gpu.read(&gpu.depth(&stage.mesh(gpu, eye)?, clip_from_eye, stage.pass(ClipSpace::WGPU), size)?)?;
    let drawn = || depths.iter().copied().filter(|&depth| depth < 1.0);
    let (least, most) = drawn().fold((1.0, 0.0), |(low, high), depth| (f32::min(low, depth), f32::max(high, depth)));
    let grey = |&depth: &f32| {
        let share = (depth - least) / (most - least).max(f32::MIN_POSITIVE);
        if depth < 1.0 { [(40.0 + 215.0 * share) as u8; 3] } else { [28, 34, 56] }
    };
    let depth = Image { size, pixels: depths.iter().map(grey).collect() };
    Ok(Pictures { shaded: coloured(&shaded), depth, heat: coloured(&heated) })
}

/// The pixels that the longer side of a texel covers, from the texels by which each pixel differs.
fn texel_length(texels_per_pixel: DMat2) -> f64 {
    // One over the smaller singular value: the larger one over the area.
    let squares = texels_per_pixel.transpose() * texels_per_pixel;
    let (sum, difference) = (squares.x_axis.x + squares.y_axis.y, squares.x_axis.x - squares.y_axis.y);
    let larger = 0.5 * (sum + difference.hypot(2.0 * squares.x_axis.y));
    larger.sqrt() / texels_per_pixel.determinant().abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_texel_of_a_turned_and_stretched_map() {
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        // Half a texel to the pixel across, four down: the texel is two pixels long.
        let stretched = DMat2::from_diagonal(DVec2::new(0.5, 4.0));
        assert!(close(texel_length(stretched), 2.0));
        assert!(close(texel_length(DMat2::from_angle(0.7) * stretched * DMat2::from_angle(-1.9)), 2.0));
    }
}
