//! The scene as a graphics device draws it with each technique.

use anyhow::Result;
use conformance::gpu::Gpu;
use conformance::pictures::{Pictures, pictures};
use conformance::stage::Stage;
use scenes::{Model, TECHNIQUES};

/// The longer side of a picture, in pixels.
const SIDE: u32 = 480;

pub(crate) struct Rendered {
    /// What drew the pictures.
    pub(crate) device: String,
    /// In the order of the techniques.
    pub(crate) pictures: Vec<Pictures>,
}

/// Draws a model with every technique. Where there is no device, or no picture, the error says why.
pub(crate) fn rendered(model: Model) -> Result<Rendered> {
    let gpu = Gpu::open()?;
    let viewport = model.scene.viewport;
    let longer = viewport[0].max(viewport[1]);
    let side = |pixels: u32| {
        // The quotient is at most SIDE.
        let scaled = u64::from(pixels) * u64::from(SIDE.min(longer)) / u64::from(longer);
        u32::try_from(scaled).unwrap_or(SIDE).max(1)
    };
    let stage = Stage::with_picture(model, viewport.map(side))?;
    let pictures = TECHNIQUES.iter().map(|technique| pictures(&gpu, &stage, technique)).collect::<Result<_>>()?;
    Ok(Rendered { device: gpu.name, pictures })
}
