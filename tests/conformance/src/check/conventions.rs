//! Conventions: every clip space shows the same picture, with its own depths, comparison, rows and winding.

use anyhow::Result;
use scenes::Technique;
use shadow_warp::{ClipSpace, DepthRange};

use super::above;
use super::lookup::Lookup;
use super::picture::difference;
use crate::gpu::Gpu;
use crate::pass::DepthPass;
use crate::stage::Stage;

/// Every interface's conventions by name, each also with reversed depth.
pub const SPACES: [(&str, ClipSpace); 8] = [
    ("wgpu", ClipSpace::WGPU),
    ("wgpu reversed", ClipSpace::WGPU.reversed()),
    ("vulkan", ClipSpace::VULKAN),
    ("vulkan reversed", ClipSpace::VULKAN.reversed()),
    ("opengl", ClipSpace::OPENGL),
    ("opengl reversed", ClipSpace::OPENGL.reversed()),
    ("opengl 0 to 1", ClipSpace::OPENGL_ZERO_TO_ONE),
    ("opengl 0 to 1 reversed", ClipSpace::OPENGL_ZERO_TO_ONE.reversed()),
];

/// How a clip space differs from wgpu's.
#[derive(Clone, Copy, Debug, Default)]
pub struct Conventions {
    /// Texels of the depth map that hold something in one of the two and nothing in the other.
    pub coverage: usize,
    /// Texels whose depth, undone to wgpu's, differs by more than rounding can explain.
    pub depth: usize,
    /// The share of pixels of the lit picture that differ.
    pub lit: f64,
    /// Texels that change when back faces are left out. The scene is closed, so only ties are among them.
    pub back: usize,
    /// Texels that are the same when front faces are left out.
    pub front: usize,
    /// Texels that something is drawn on.
    pub texels: usize,
    /// The share of any of these that chance explains.
    ties: f64,
}

/// More than rounding can do to depth on the surfaces of the scene.
const DEPTH: f64 = 1e-4;
/// The share, over the rasteriser's grid, of texels whose centre may lie exactly on an edge and go to another of the faces that
/// meet there, or to a back face.
const TIES: f64 = 0.5;

/// A perspective shadow map gives most of itself to the air before the eye; the other maps have ten times as many.
const LEAST_TEXELS: usize = 2_000;

impl Conventions {
    /// What is not as it must be.
    #[must_use]
    pub fn failures(&self) -> Vec<String> {
        let mut failures = above(
            (self.ties * self.texels as f64) as usize,
            &[
                (self.coverage, "texels are covered otherwise than in wgpu's conventions"),
                (self.depth, "texels hold another depth than in wgpu's conventions"),
                (self.back, "texels show back faces"),
                (self.front, "texels show no front face"),
            ],
        );
        if self.texels < LEAST_TEXELS {
            failures.push(format!("only {} texels were drawn", self.texels));
        }
        if self.lit > self.ties {
            failures.push(format!("{} of the picture is lit otherwise than in wgpu's conventions", self.lit));
        }
        failures
    }
}

/// Draws the scene in every interface's conventions, and compares with wgpu's. In the order of [`SPACES`].
///
/// # Errors
/// If there is no map, or the device refuses.
pub fn conventions(gpu: &Gpu, stage: &Stage, technique: &Technique, size: u32) -> Result<Vec<Conventions>> {
    let (fit, map) = stage.solve(technique, size)?;
    let eye = stage.job.view.eye();
    let map = fit.guard_f32(&map, eye)?;
    let mesh = stage.mesh(gpu, eye)?;
    // In the order of wgpu's rows, and with its depth.
    let texels = |space: ClipSpace, cull| -> Result<Vec<f32>> {
        let pass = DepthPass { space, clamp: false, cull };
        let found = gpu.read(&gpu.depth(&mesh, map.clip_from_world_at(eye, space), pass, map.size())?)?;
        let depth = |&depth: &f32| if space.depth == DepthRange::OneToZero { 1.0 - depth } else { depth };
        let rows = found.chunks_exact(size as usize);
        Ok(if space.texture_top_first {
            rows.flatten().map(depth).collect()
        } else {
            rows.rev().flatten().map(depth).collect()
        })
    };
    let is_drawn = |depth: f32| depth < 1.0;
    let plain = texels(ClipSpace::WGPU, None)?;
    let lookup = Lookup::new(gpu, stage, &fit, &map)?;
    let lit = lookup.draw(gpu, ClipSpace::WGPU)?;
    let compared = |(_, space): (&str, ClipSpace)| {
        let all = texels(space, None)?;
        let (front_only, back_only) = (texels(space, Some(wgpu::Face::Back))?, texels(space, Some(wgpu::Face::Front))?);
        let both = plain.iter().zip(&all).filter(|(a, b)| is_drawn(**a) && is_drawn(**b));
        Ok(Conventions {
            coverage: plain.iter().zip(&all).filter(|(a, b)| is_drawn(**a) != is_drawn(**b)).count(),
            depth: both.filter(|(a, b)| f64::from((*a - *b).abs()) > DEPTH).count(),
            lit: difference(&lit, &lookup.draw(gpu, space)?),
            back: all.iter().zip(&front_only).filter(|(a, b)| a.to_bits() != b.to_bits()).count(),
            front: all.iter().zip(&back_only).filter(|(a, b)| is_drawn(**a) && a.to_bits() == b.to_bits()).count(),
            texels: all.iter().filter(|&&depth| is_drawn(depth)).count(),
            ties: TIES * gpu.grid(),
        })
    };
    SPACES.into_iter().map(compared).collect()
}
