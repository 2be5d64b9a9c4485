//! A scene with what all checks on it share.

use std::sync::OnceLock;

use anyhow::{Result, ensure};
use scenes::{Job, Model, Technique};
use shadow_warp::glam::{DVec2, DVec3};
use shadow_warp::{Body, Bounds, Error, Fit, Rule, ShadowMap};

use crate::camera::Camera;
use crate::gpu::Gpu;
use crate::pass::Mesh;
use crate::projection::Facet;
use crate::rays::Rays;

/// The size of the pictures that are compared, in pixels.
const PICTURE: [u32; 2] = [224, 224];

/// A model in the crate's types, with what its camera sees. Planes, rays and points are relative to the eye; the model is in
/// the world, and a body about its own origin.
pub struct Stage {
    /// The scene and its triangles.
    pub model: Model,
    /// The scene in the crate's types.
    pub job: Job,
    /// What is seen of the receivers.
    pub receivers: [Body; 1],
    /// The planes of the triangles.
    pub facets: Vec<Facet>,
    rays: OnceLock<Rays>,
    truth: OnceLock<Vec<Option<Seen>>>,
}

/// What a camera's pixel shows, by rays in `f64`.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// The triangle.
    pub triangle: usize,
    /// The middle of the pixel.
    pub pixel: DVec2,
    /// The point there.
    pub point: DVec3,
    /// Whether something stands between it and the light. Where the surface looks away from the light, or nearly along
    /// it, no shadow map is asked.
    pub shadowed: Option<bool>,
}

/// The sine of the least angle at which light must fall on a surface for its shadows to count.
const GRAZING: f64 = 0.01;

impl Stage {
    /// Prepares a model, with pictures of a size that is quickly compared.
    ///
    /// # Errors
    /// Where the crate refuses the scene.
    pub fn new(model: Model) -> Result<Self> {
        Self::with_picture(model, PICTURE)
    }

    /// Prepares a model, with pictures of another size, in pixels.
    ///
    /// # Errors
    /// Where the crate refuses the scene.
    pub fn with_picture(model: Model, picture: [u32; 2]) -> Result<Self> {
        let mut job = model.scene.validated()?;
        job.viewport = picture;
        let count = model.triangles.len();
        // Their numbers are floats in the picture.
        ensure!(0 < count && count < 1 << 24, "the scene must have from one to {} triangles", (1 << 24) - 1);
        ensure!(model.triangles.as_flattened().iter().all(|p| p.is_finite()), "the scene's triangles must be finite");
        let eye = job.view.eye();
        let facets = model.triangles.iter().map(|corners| Facet::of(corners.map(|p| p - eye))).collect();
        let receivers = [job.seen()];
        Ok(Self { model, job, receivers, facets, rays: OnceLock::new(), truth: OnceLock::new() })
    }

    /// Returns the camera with the size of its pictures.
    #[must_use]
    pub fn camera(&self) -> Camera<'_> {
        let view = &self.job.view;
        let depths = |bounds: &Bounds| {
            let [low, high] = [bounds.min(), bounds.max()].map(|corner| (corner - view.eye()) * view.forward());
            [low.min(high).element_sum(), low.max(high).element_sum()]
        };
        let [a, b] = [&self.job.casters, &self.job.receivers].map(depths);
        let near = a[0].min(b[0]).max(view.near());
        Camera { view, size: self.job.viewport, depth: [near, a[1].max(b[1]).max(near) + 1.0] }
    }

    /// Returns the unit vector towards the light.
    ///
    /// # Errors
    /// If the light is none at infinity.
    pub fn to_light(&self) -> Result<DVec3, Error> {
        Ok(self.job.light.as_directional()?.to_light())
    }

    /// Returns the scene's triangles, ready for rays.
    #[must_use]
    pub fn rays(&self) -> &Rays {
        let eye = self.job.view.eye();
        self.rays.get_or_init(|| Rays::new(self.model.triangles.iter().map(|corners| corners.map(|p| p - eye))))
    }

    /// Puts the scene on a device, relative to an origin in world space.
    ///
    /// # Errors
    /// If the device refuses.
    pub fn mesh(&self, gpu: &Gpu, origin: DVec3) -> Result<Mesh> {
        gpu.mesh(&self.model.triangles, origin)
    }

    /// Returns a technique's job and its map of `size` by `size` texels.
    ///
    /// # Errors
    /// As [`Fit::solve`].
    pub fn solve(&self, technique: &Technique, size: u32) -> Result<(Fit<'_>, ShadowMap), Error> {
        self.solve_rule(technique, technique.rule, size)
    }

    /// As [`Stage::solve`], with another rule on the technique's axes.
    ///
    /// # Errors
    /// As [`Fit::solve`].
    pub fn solve_rule(&self, technique: &Technique, rule: Rule, size: u32) -> Result<(Fit<'_>, ShadowMap), Error> {
        let fit = technique.fit(Fit { map_size: [size; 2], ..self.job.fit(&self.receivers) });
        Ok((fit, fit.solve(rule)?))
    }

    /// Returns what each pixel shows, row by row from the upper left; `None` where no receiver is seen.
    ///
    /// # Errors
    /// As [`Stage::to_light`].
    pub fn truth(&self) -> Result<&[Option<Seen>], Error> {
        let to_light = self.to_light()?;
        Ok(self.truth.get_or_init(|| {
            let [width, height] = self.job.viewport;
            let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
            pixels.map(|(x, y)| self.seen(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5), to_light)).collect()
        }))
    }

    /// Returns the point of a plane that is seen at a place in the picture.
    #[must_use]
    pub fn on(&self, facet: &Facet, pixel: DVec2) -> DVec3 {
        let [origin, direction] = self.camera().ray(pixel);
        origin + direction * facet.meet(origin, direction)
    }

    fn seen(&self, pixel: DVec2, to_light: DVec3) -> Option<Seen> {
        let [origin, direction] = self.camera().ray(pixel);
        let view = &self.job.view;
        // Along the forward axis a ray advances by one unit of its direction.
        let hit = self.rays().first(origin, direction, view.near())?;
        let point = origin + direction * hit.distance;
        let (low, high) = (self.job.receivers.min() - view.eye(), self.job.receivers.max() - view.eye());
        let rounding = 1e-12 * (1.0 + low.abs().max(high.abs()).max_element());
        let is_receiver = point.cmpge(low - rounding).all() && point.cmple(high + rounding).all();
        if hit.distance > view.far() || !is_receiver {
            return None;
        }
        // The side that is seen counts.
        let normal = self.facets[hit.triangle].normal;
        let facing = -normal.dot(direction).signum() * normal.dot(to_light);
        let shadowed = || self.rays().is_blocked(point, to_light, 1e-9 * (1.0 + point.abs().max_element()));
        Some(Seen { triangle: hit.triangle, pixel, point, shadowed: (facing > GRAZING).then(shadowed) })
    }
}
