//! What a look into a technique's map must give.

use anyhow::Result;
use shadow_warp::glam::{DVec2, DVec3};
use shadow_warp::{ClipSpace, Fit, LitBody, ShadowMap};

use super::allowance;
use crate::gpu::Gpu;
use crate::pass::Pixel;
use crate::projection::{Facet, Projection};
use crate::raster::{Allowance, Drawn};
use crate::stage::Stage;

/// A map, and what is needed to predict what a look into it gives. Positions are relative to the eye.
pub(crate) struct Lookup<'a> {
    pub(super) stage: &'a Stage,
    pub(super) map: &'a ShadowMap,
    /// What the map is to show.
    pub(super) body: LitBody,
    pub(super) projection: Projection,
    pub(super) allowance: Allowance,
    /// The scene's triangles in the map.
    drawn: Vec<Option<Drawn>>,
    /// For each triangle: the least bias with which it does not shadow itself.
    pub(super) biases: Vec<f64>,
    /// What rounding of matrix, position and coordinate to `f32` may displace a place by, in texels.
    pub(super) rounding: f64,
    /// How far the device may be from the middle of a pixel with the position that it interpolates, in pixels.
    camera: f64,
    /// Nothing of the scene is further from the eye.
    far: f64,
}

/// What may lie nearest to the light at a place of the map.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// As the depth buffer holds it.
    pub(super) depth: f64,
    /// What the device may err by.
    pub(super) error: f64,
    pub(super) triangle: Option<usize>,
    /// How far the map puts the point that the ray of light met from the place that the ray belongs to, in texels.
    pub(super) off_ray: f64,
}

impl Found {
    /// A texel that nothing was drawn on.
    const CLEARED: Self = Self { depth: 1.0, error: 0.0, triangle: None, off_ray: 0.0 };
}

impl<'a> Lookup<'a> {
    pub(crate) fn new(gpu: &Gpu, stage: &'a Stage, fit: &Fit, map: &'a ShadowMap) -> Result<Self> {
        let eye = stage.job.view.eye();
        let projection = Projection::new(map, eye, ClipSpace::WGPU);
        let allowance = allowance(gpu, fit, map, eye);
        let corner = DVec2::from(map.size().map(f64::from));
        let drawn: Vec<Option<Drawn>> =
            (stage.model.triangles.iter()).map(|corners| Drawn::new(corners.map(|p| p - eye), &projection)).collect();
        // Half a texel away, and what the device may err by there and here.
        let least = |slope: DVec2| 0.5 * slope.abs().element_sum() + 2.0 * allowance.of_depth(corner, 1.0, slope);
        // A surface along the light has none; it is not asked for.
        let bias = |drawn: &Option<Drawn>| drawn.map_or(2.0, |drawn| least(drawn.slope()).min(2.0));
        let biases = drawn.iter().map(bias).collect();
        let reach = |bounds: &shadow_warp::Bounds| (bounds.min() - eye).abs().max((bounds.max() - eye).abs()).length();
        Ok(Self {
            stage,
            map,
            body: Stage::lit(fit)?,
            projection,
            allowance,
            drawn,
            biases,
            rounding: fit.rounding(map, eye).truncate().length() + corner.max_element() * f64::from(f32::EPSILON),
            // Where positions are rounded before they are interpolated, so are those of clipped corners.
            camera: if gpu.is_lavapipe() { 4e-4 } else { 2.0 * gpu.grid() },
            far: stage.job.receivers.iter().map(reach).fold(reach(&stage.job.casters), f64::max),
        })
    }

    /// The map's size, `(width, height)` in texels.
    pub(super) fn limit(&self) -> DVec2 {
        DVec2::from(self.map.size().map(f64::from))
    }

    /// The lit picture, through a map in the conventions of an interface.
    pub(crate) fn draw(&self, gpu: &Gpu, space: ClipSpace) -> Result<Vec<Option<Pixel>>> {
        let eye = self.stage.job.view.eye();
        let (mesh, camera) = (self.stage.mesh(gpu, eye)?, self.stage.camera());
        let pass = self.stage.pass(space);
        let shadows = gpu.depth(&mesh, self.map.clip_from_world_at(eye, space), pass, self.map.size())?;
        // Towards the light is towards greater depth where depth is reversed.
        let sign = if pass.cleared() > 0.5 { 1.0 } else { -1.0 };
        let biases: Vec<f32> = self.biases.iter().map(|&bias| (sign * bias) as f32).collect();
        let texture_from_eye = self.map.texture_from_world_at(eye, space);
        gpu.lit(&mesh, camera.clip_from_eye(), texture_from_eye, &biases, &shadows, camera.size)
    }

    /// The ray of light through a place: a point before everything, or the light itself, and the unit direction.
    pub(super) fn ray(&self, texel: DVec2) -> [DVec3; 2] {
        let (light, normal) = (self.stage.light(), self.map.light_space().y);
        let place = light.truncate() * light.w;
        // On a plane across the light, far from a light with a place.
        let offset = normal.dot(place) - self.far * light.w;
        let point = self.projection.on(&Facet { normal, offset }, texel);
        if light.w > 0.0 {
            [place, (point - place).normalize()]
        } else {
            [point + light.truncate() * self.far, -light.truncate()]
        }
    }

    /// What is nearest to the light on its ray through a place, by rays.
    pub(super) fn first(&self, texel: DVec2) -> Found {
        let [start, direction] = self.ray(texel);
        let first = self.stage.rays().first(start, direction, self.stage.near(direction));
        let Some(hit) = first else { return Found::CLEARED };
        let met = self.projection.place(start + direction * hit.distance).texel;
        let found = self.on(hit.triangle, texel).unwrap_or(Found::CLEARED);
        Found { off_ray: (met - texel).length(), ..found }
    }

    /// Whether the warp runs along the second of the texture's axes: a step across it changes nothing there.
    pub(super) fn is_straight(&self) -> bool {
        let at = self.map.origin() - self.stage.job.view.eye();
        let change = self.projection.change(at, self.map.light_space().x);
        change.y.abs() <= 1e-9 * change.length()
    }

    /// Everything that a device may have found nearest to the light where it rounds positions: whatever is at the place or
    /// next to it, and not surely hidden.
    pub(super) fn candidates(&self, texel: DVec2) -> Vec<Found> {
        let reach = self.allowance.coverage;
        let mut hidden_from = Found::CLEARED.depth;
        let mut candidates = vec![Found::CLEARED];
        for (triangle, drawn) in self.drawn.iter().enumerate() {
            let inside = drawn.map_or(f64::NEG_INFINITY, |drawn| drawn.inside(texel));
            let Some(found) = self.on(triangle, texel).filter(|_| inside > -reach) else { continue };
            candidates.push(found);
            if inside > reach {
                hidden_from = hidden_from.min(found.depth + found.error);
            }
        }
        candidates.retain(|found| found.depth - found.error <= hidden_from);
        candidates
    }

    /// How depth changes on a triangle's plane from texel to texel, both ways together.
    pub(super) fn slope(&self, triangle: usize) -> f64 {
        self.drawn[triangle].map_or(f64::INFINITY, |drawn| drawn.slope().abs().element_sum())
    }

    /// A triangle's plane at a place, with a depth that a buffer can hold.
    fn on(&self, triangle: usize, texel: DVec2) -> Option<Found> {
        let drawn = self.drawn[triangle]?;
        let depth = drawn.depth(texel);
        let error = self.allowance.of_depth(texel, depth, drawn.slope());
        Some(Found { depth: depth.clamp(0.0, 1.0), error, triangle: Some(triangle), off_ray: 0.0 })
    }

    /// How far a place in the map may be displaced by the device's error in the camera's picture, in texels. Next to the
    /// horizon of a plane that has no end.
    pub(super) fn drift(&self, facet: &Facet, pixel: DVec2) -> f64 {
        let at = |pixel: DVec2| self.projection.place(self.stage.on(facet, pixel));
        let here = at(pixel).texel;
        let away = |offset: DVec2| {
            let there = at(pixel + offset * self.camera);
            if there.w > 0.0 { (there.texel - here).length() } else { f64::INFINITY }
        };
        [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]].into_iter().map(|o| away(o.into())).fold(0.0, f64::max)
    }
}
