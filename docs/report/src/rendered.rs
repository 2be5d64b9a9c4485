//! The scene as a graphics device draws it with each technique.

use anyhow::{Context, Result};
use conformance::gpu::Gpu;
use conformance::pictures::{Pictures, pictures};
use conformance::stage::Stage;
use scenes::Model;

use crate::measure::Row;

/// The longer side of a picture, in pixels.
const SIDE: u32 = 480;

pub(crate) struct Rendered {
    /// What drew the pictures.
    pub(crate) device: String,
    /// For each row of the table, or why there is none.
    pub(crate) pictures: Vec<Result<Pictures, String>>,
}

/// Draws a model with every technique. Where there is no device, the error says why.
pub(crate) fn rendered(model: &Model, rows: &[Row]) -> Result<Rendered> {
    let gpu = Gpu::open()?;
    let viewport = model.scene.viewport;
    let longer = viewport[0].max(viewport[1]);
    let side = |pixels: u32| {
        // The quotient is at most SIDE.
        let scaled = u64::from(pixels) * u64::from(SIDE.min(longer)) / u64::from(longer);
        u32::try_from(scaled).unwrap_or(SIDE).max(1)
    };
    let stages = Stage::with_picture(model, viewport.map(side))?;
    let drawn = |row: &Row| {
        let stage = stages.iter().find(|stage| stage.job.face == row.face).context("a face has a stage")?;
        pictures(&gpu, stage, row.technique)
    };
    let pictures = rows.iter().map(|row| drawn(row).map_err(|error| format!("{error:#}"))).collect();
    Ok(Rendered { device: gpu.name, pictures })
}
