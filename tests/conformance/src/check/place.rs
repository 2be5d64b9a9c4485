//! Depth and place: every texel that triangles at known positions cover, and its depth.

use anyhow::Result;
use fastrand::Rng;
use scenes::Technique;
use shadow_warp::glam::{DVec2, DVec3};
use shadow_warp::{ClipSpace, LitBody, Rule, ShadowMap};

use super::allowance;
use crate::gpu::Gpu;
use crate::pass::DepthPass;
use crate::projection::{Facet, Projection};
use crate::raster::{Agreement, Allowance, compare};
use crate::stage::Stage;

/// What positions and matrix are relative to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The world's origin.
    World,
    /// The camera's eye.
    Eye,
    /// The origin of the receivers' body.
    Body,
}

impl Origin {
    /// Returns the origin in world space.
    #[must_use]
    pub fn of(self, stage: &Stage, map: &ShadowMap) -> DVec3 {
        match self {
            Self::World => DVec3::ZERO,
            Self::Eye => stage.job.view.eye(),
            Self::Body => map.origin(),
        }
    }
}

const TRIANGLES: usize = 160;
/// The reach of the triangles' corners from their middle, in texels.
const REACHES: [f64; 4] = [2.0, 8.0, 30.0, 80.0];
/// How far their heights differ, in shares of the receivers' height.
const STEEPNESSES: [f64; 3] = [0.01, 0.1, 1.0];

/// Draws random triangles into a map and compares every texel. Returns what was found, and what was allowed.
///
/// # Errors
/// If there is no map, or the device refuses.
pub fn place(
    gpu: &Gpu,
    stage: &Stage,
    technique: &Technique,
    rule: Rule,
    size: u32,
    origin: Origin,
) -> Result<(Agreement, Allowance)> {
    let (fit, map) = stage.solve_rule(technique, rule, size)?;
    let origin = origin.of(stage, &map);
    // Or a corner on the near plane may be clipped.
    let map = fit.guard_f32(&map, stage.job.view.eye())?;
    let mesh = gpu.mesh(&random_triangles(&Stage::lit(&fit)?, &map), origin)?;
    let drawn = gpu.depth(&mesh, map.clip_from_world_at(origin, ClipSpace::WGPU), DepthPass::WGPU, map.size())?;
    let found = gpu.read(&drawn)?;
    // The positions that the device was given, exactly.
    let corners: Vec<DVec3> = mesh.corners().collect();
    let triangles = corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]);
    let projection = Projection::new(&map, origin, ClipSpace::WGPU);
    let allowance = allowance(gpu, &fit, &map, origin);
    Ok((compare(&found, map.size(), triangles, &projection, &allowance), allowance))
}

/// Triangles of all sizes and inclinations in the receivers' body, in world space: their corners lie where texels and
/// heights above the lowest point say.
fn random_triangles(body: &LitBody, map: &ShadowMap) -> Vec<[DVec3; 3]> {
    let mut random = Rng::with_seed(11);
    let (towards_light, about) = (map.light_space().y, body.origin());
    let projection = Projection::new(map, about, ClipSpace::WGPU);
    let [low, high] = body.bounds_along(towards_light).unwrap_or_default();
    let vertices = body.vertices();
    let rows = vertices.iter().map(|&q| projection.place(q).texel.y);
    let (top, bottom) = rows.fold((f64::INFINITY, 0.0), |(top, bottom), y| (y.min(top), y.max(bottom)));
    let mut triangles = Vec::new();
    while triangles.len() < TRIANGLES {
        // Chance chooses a row of the map, and points of edges and diagonals that lie there.
        let row = top + (bottom - top) * random.f64();
        // A function that is affine in space, and 0 where the map has this row.
        let off_row = |q: DVec3| projection.homogeneous(q).dot(DVec3::new(0.0, 1.0, -row));
        let mut point = || loop {
            let [a, b] = [(); 2].map(|()| vertices[random.usize(..vertices.len())]);
            let [off_a, off_b] = [a, b].map(off_row);
            if off_a < 0.0 && off_b >= 0.0 {
                break a + (b - a) * (off_a / (off_a - off_b));
            }
        };
        let middle = point().lerp(point(), random.f64());
        let (texel, height) = (projection.place(middle).texel, towards_light.dot(middle));
        let at = |texel: DVec2, offset: f64| projection.on(&Facet { normal: towards_light, offset }, texel);
        let reach = REACHES[triangles.len() % REACHES.len()];
        let steepness = STEEPNESSES[triangles.len() % STEEPNESSES.len()];
        let mut offset = || 2.0 * random.f64() - 1.0;
        // As large as there is room for, which is mostly a question of height. Beside a vertex there may be none.
        let (mut share, mut share_of_height) = (1.0, 1.0);
        while share > 0.02 {
            let corners = [(); 3].map(|()| {
                let texel = texel + share * reach * DVec2::new(offset(), offset());
                at(texel, height + share_of_height * steepness * (high - low) * offset())
            });
            if corners.iter().all(|&q| body.contains(q)) {
                triangles.push(corners.map(|q| q + about));
                break;
            }
            (share, share_of_height) = (0.97 * share, 0.8 * share_of_height);
        }
    }
    triangles
}
