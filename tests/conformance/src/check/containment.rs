//! Containment: nothing that can be seen, and no caster of a shadow that can be seen, is clipped.

use anyhow::Result;
use scenes::Technique;
use shadow_warp::glam::{DVec2, DVec3};
use shadow_warp::{ClipSpace, Fit, NearDepth};

use super::above;
use super::lookup::{Found, Lookup};
use crate::gpu::Gpu;
use crate::pass::DepthPass;
use crate::projection::Projection;
use crate::stage::Stage;

/// What was clipped, and what reached where it should not.
#[derive(Clone, Copy, Debug, Default)]
pub struct Containment {
    /// Corners of the receivers' body that the device puts outside of the guarded map.
    pub clipped: usize,
    /// Texels of the border, two wide, that the body covers.
    pub in_border: usize,
    /// How far the body is from touching a side of the map, in texels; the furthest of the four.
    pub slack: f64,
    /// The margin against rounding, in texels.
    pub margin: f64,
    /// Texels whose ray of light meets the body.
    pub texels: usize,
    /// Those of them whose depth is not that of what lies nearest to the light there.
    pub wrong: usize,
    /// The same with depths from the receivers alone, and depth clamp.
    pub wrong_clamped: usize,
}

impl Containment {
    /// What is not as it must be.
    #[must_use]
    pub fn failures(&self) -> Vec<String> {
        let mut failures = above(
            0,
            &[
                (self.clipped, "corners of the body are outside of the map"),
                (self.in_border, "texels of the border are covered"),
                (self.wrong, "texels do not hold what is nearest to the light"),
                (self.wrong_clamped, "texels do not hold what is nearest to the light, with depth clamp"),
            ],
        );
        if self.texels < 1_000 {
            failures.push(format!("only {} texels were compared", self.texels));
        }
        let touches = self.slack.abs() <= 1.1 * self.margin + 1e-3;
        if !touches {
            failures.push(format!("the body is {} texels from touching a side", self.slack));
        }
        failures
    }
}

/// How many rows and columns of a map are compared with rays.
const COMPARED: u32 = 256;
/// The border of the map, in texels.
const BORDER: f64 = 2.0;

/// Draws the receivers' body, as far as it is lit, and the scene into a technique's map.
///
/// # Errors
/// If there is no map, or the device refuses.
pub fn containment(gpu: &Gpu, stage: &Stage, technique: &Technique, size: u32) -> Result<Containment> {
    let (fit, map) = stage.solve(technique, size)?;
    let eye = stage.job.view.eye();
    let body = Stage::lit(&fit)?;
    let faces: Vec<[DVec3; 3]> =
        body.faces().flat_map(|face| face.triangles()).map(|corners| corners.map(|q| q + body.origin())).collect();
    let outline = gpu.mesh(&faces, eye)?;

    let guarded = fit.guard_f32(&map, eye)?;
    let clips = gpu.capture(&outline, guarded.clip_from_world_at(eye, ClipSpace::WGPU))?;
    let is_inside = |&[x, y, z, w]: &[f32; 4]| x.abs() <= w && y.abs() <= w && z >= 0.0 && z <= w;
    let clipped = clips.iter().filter(|clip| !is_inside(clip)).count();

    let bordered = fit.guard_f32(&map.with_border(BORDER)?, eye)?;
    let drawn = gpu.depth(&outline, bordered.clip_from_world_at(eye, ClipSpace::WGPU), DepthPass::WGPU, map.size())?;
    let covered: Vec<bool> = gpu.read(&drawn)?.iter().map(|&depth| depth < 1.0).collect();
    let at = |index: usize| DVec2::new((index % size as usize) as f64 + 0.5, (index / size as usize) as f64 + 0.5);
    let edge = |texel: DVec2| texel.min(f64::from(size) - texel).min_element();
    let in_border = covered.iter().enumerate().filter(|&(index, &covered)| covered && edge(at(index)) < BORDER).count();

    let mut found = Containment { clipped, in_border, ..Containment::default() };
    let projection = Projection::new(&bordered, eye, ClipSpace::WGPU);
    let places: Vec<DVec2> = outline.corners().map(|q| projection.place(q).texel).collect();
    let least = places.iter().fold(DVec2::INFINITY, |least, &place| least.min(place));
    let most = places.iter().fold(DVec2::NEG_INFINITY, |most, &place| most.max(place));
    found.margin = fit.rounding(&bordered, eye).truncate().max_element();
    found.slack = least.max(f64::from(size) - most).max_element() - BORDER;

    [found.texels, found.wrong] = nearest(gpu, stage, technique, size, NearDepth::Casters, false)?;
    [_, found.wrong_clamped] = nearest(gpu, stage, technique, size, NearDepth::Receivers, true)?;
    Ok(found)
}

/// Returns how many texels whose ray of light meets the receivers' body were compared, and how many of them do not hold the
/// depth of what lies nearest to the light there. Without casters in the range of depths, and without clamp, some are lost.
///
/// # Errors
/// If there is no map, or the device refuses.
pub fn nearest(
    gpu: &Gpu,
    stage: &Stage,
    technique: &Technique,
    size: u32,
    near_depth: NearDepth,
    clamp: bool,
) -> Result<[usize; 2]> {
    let (fit, eye) = (Fit { near_depth, ..stage.fit(technique, size) }, stage.job.view.eye());
    let map = fit.guard_f32(&fit.solve(stage.rule(technique)?)?, eye)?;
    let pass = DepthPass { clamp, ..DepthPass::WGPU };
    let scene = gpu.depth(&stage.mesh(gpu, eye)?, map.clip_from_world_at(eye, ClipSpace::WGPU), pass, map.size())?;
    let scene = gpu.read(&scene)?;
    let lookup = Lookup::new(gpu, stage, &fit, &map)?;
    // Of a large map every so many rows and columns.
    let lines = || (0..size).step_by(size.div_ceil(COMPARED) as usize);
    let texels = lines().flat_map(|y| lines().map(move |x| (x, y)));
    let (mut compared, mut wrong) = (0, 0);
    for (x, y) in texels {
        let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        if lookup.crosses_body(centre) {
            compared += 1;
            wrong += usize::from(!lookup.holds(centre, scene[(y * size + x) as usize]));
        }
    }
    Ok([compared, wrong])
}

impl Lookup<'_> {
    /// Whether the ray of light through a place in the map meets the receivers' body.
    fn crosses_body(&self, texel: DVec2) -> bool {
        let [start, direction] = self.ray(texel);
        let start = start + (self.stage.job.view.eye() - self.body.origin());
        let (mut enters, mut leaves) = (f64::NEG_INFINITY, f64::INFINITY);
        for plane in self.body.faces().map(|face| face.plane()) {
            let (speed, room) = (plane.normal().dot(direction), plane.offset() - plane.normal().dot(start));
            if speed > 0.0 {
                leaves = leaves.min(room / speed);
            } else if speed < 0.0 {
                enters = enters.max(room / speed);
            } else if room < 0.0 {
                return false;
            }
        }
        enters < leaves
    }

    /// Whether a texel holds what lies nearest to the light there, or where the device may have taken the place to be.
    fn holds(&self, centre: DVec2, depth: f32) -> bool {
        let is = |found: &Found| (f64::from(depth) - found.depth).abs() <= found.error;
        let at_centre = self.first(centre);
        let is_there = is(&at_centre) || self.candidates(centre).iter().any(is);
        is_there && at_centre.off_ray <= self.allowance.coverage
    }
}
