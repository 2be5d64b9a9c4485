//! `f32` far away: where the device puts a scene that lies far from the world's origin.

use anyhow::Result;
use scenes::Technique;
use shadow_warp::ClipSpace;
use shadow_warp::glam::{DVec2, DVec3};

use super::place::Origin;
use super::worse;
use crate::gpu::Gpu;
use crate::projection::Projection;
use crate::stage::Stage;

/// How far the device displaces what is seen, in texels.
#[derive(Clone, Copy, Debug, Default)]
pub struct FarAway {
    /// The largest displacement of a corner of the receivers' body.
    pub displacement: f64,
    /// What the crate says it is at most; infinite where `f32` leaves nothing of the map.
    pub bound: f64,
}

impl FarAway {
    /// What is not as it must be.
    #[must_use]
    pub fn failures(&self) -> Vec<String> {
        let within = self.displacement <= self.bound || self.bound == f64::INFINITY;
        let failure =
            || format!("a corner is {} texels off, {} are proven to be the most", self.displacement, self.bound);
        (!within).then(failure).into_iter().collect()
    }
}

/// Returns where the device puts the receivers' body with positions and matrix rounded to `f32`.
///
/// # Errors
/// If there is no map, or the device refuses.
pub fn far_away(gpu: &Gpu, stage: &Stage, technique: &Technique, size: u32, origin: Origin) -> Result<FarAway> {
    let (fit, map) = stage.solve(technique, size)?;
    let at = origin.of(stage, &map);
    let body = Stage::lit(&fit)?;
    let faces: Vec<[DVec3; 3]> = body
        .faces()
        .flat_map(|face| face.triangles())
        .map(|corners| corners.map(|q| q + (body.origin() - at)))
        .collect();
    // Relative to the origin in f64, and then rounded.
    let mesh = gpu.mesh(&faces, DVec3::ZERO)?;
    let clips = gpu.capture(&mesh, map.clip_from_world_at(at, ClipSpace::WGPU))?;
    let projection = Projection::new(&map, body.origin(), ClipSpace::WGPU);
    let half = DVec2::from(map.size().map(f64::from)) * 0.5;
    let corners = body.faces().flat_map(|face| face.triangles()).flatten();
    let displacements = corners.zip(&clips).map(|(q, clip)| {
        let [x, y, _, w] = clip.map(f64::from);
        let texel = (DVec2::new(x, -y) / w + 1.0) * half;
        (texel - projection.place(q).texel).abs().max_element()
    });
    let displacement = displacements.fold(0.0, worse);
    Ok(FarAway { displacement, bound: fit.rounding(&map, at).truncate().max_element() })
}
