//! A scene with what all checks on it share.

use std::sync::OnceLock;

use anyhow::{Result, ensure};
use scenes::{Job, Model, Technique};
use shadow_warp::glam::{DVec2, DVec3, DVec4};
use shadow_warp::{Body, Bounds, ClipSpace, Error, Fit, Light, LitBody, NearDepth, Rule, ShadowMap};

use crate::camera::Camera;
use crate::gpu::Gpu;
use crate::pass::{DepthPass, Mesh};
use crate::projection::Facet;
use crate::rays::Rays;

/// The size of the pictures that are compared, in pixels.
const PICTURE: [u32; 2] = [224, 224];

/// A model in the crate's types, under a light with one map, with what its camera sees. Planes, rays and points are relative to the eye; the model is in
/// the world, and a body about its own origin.
pub struct Stage {
    /// The model's name, with that of the face of a point light.
    pub name: String,
    /// The scene and its triangles.
    pub model: Model,
    /// The scene in the crate's types; its light is the one with the map.
    pub job: Job,
    /// What is seen of the receivers.
    pub receivers: Vec<Body>,
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
    /// Prepares a model, with pictures of a size that is quickly compared. A point light has no map.
    ///
    /// # Errors
    /// Where the crate refuses the scene.
    pub fn new(model: Model) -> Result<Self> {
        let job = Job { viewport: PICTURE, ..model.scene.validated()? };
        Self::part(model, job)
    }

    /// Prepares a model for each of the maps that its light has: one, or six of a point light.
    ///
    /// # Errors
    /// Where the crate refuses the scene.
    pub fn all(model: &Model) -> Result<Vec<Self>> {
        Self::with_picture(model, PICTURE)
    }

    /// The same, with pictures of another size, in pixels.
    ///
    /// # Errors
    /// Where the crate refuses the scene.
    pub fn with_picture(model: &Model, picture: [u32; 2]) -> Result<Vec<Self>> {
        let job = Job { viewport: picture, ..model.scene.validated()? };
        job.parts().into_iter().map(|job| Self::part(model.clone(), job)).collect()
    }

    fn part(model: Model, job: Job) -> Result<Self> {
        let count = model.triangles.len();
        // Their numbers are floats in the picture.
        ensure!(0 < count && count < 1 << 24, "the scene must have from one to {} triangles", (1 << 24) - 1);
        ensure!(model.triangles.as_flattened().iter().all(|p| p.is_finite()), "the scene's triangles must be finite");
        let eye = job.view.eye();
        let facets = model.triangles.iter().map(|corners| Facet::of(corners.map(|p| p - eye))).collect();
        let receivers = job.seen();
        let name = job.face.map_or(model.name.clone(), |face| format!("{} {face}", model.name));
        Ok(Self { name, model, job, receivers, facets, rays: OnceLock::new(), truth: OnceLock::new() })
    }

    /// Returns the camera with the size of its pictures.
    #[must_use]
    pub fn camera(&self) -> Camera<'_> {
        let view = &self.job.view;
        let depths = |bounds: &Bounds| {
            let [low, high] = [bounds.min(), bounds.max()].map(|corner| (corner - view.eye()) * view.forward());
            [low.min(high).element_sum(), low.max(high).element_sum()]
        };
        let all = self.job.receivers.iter().map(depths);
        let [near, far] = all.fold(depths(&self.job.casters), |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        let near = near.max(view.near());
        Camera { view, size: self.job.viewport, depth: [near, far.max(near) + 1.0] }
    }

    /// Returns the light as a homogeneous position relative to the eye.
    #[must_use]
    pub fn light(&self) -> DVec4 {
        let light = self.job.light.homogeneous();
        (light.truncate() - self.job.view.eye() * light.w).extend(light.w)
    }

    /// Returns the unit vector from a point towards the light.
    #[must_use]
    pub fn to_light(&self, point: DVec3) -> DVec3 {
        let light = self.light();
        (light.truncate() - point * light.w).normalize()
    }

    /// Returns how far along a ray away from the light casters begin: at the near distance of a light with a place.
    #[must_use]
    pub fn near(&self, direction: DVec3) -> f64 {
        match &self.job.light {
            Light::Spot(spot) => spot.near() / spot.direction().dot(direction),
            _ => 0.0,
        }
    }

    /// Returns how many of a count a check needs at least: a face of a point light has a part of the picture only.
    #[must_use]
    pub fn least(&self, count: usize) -> usize {
        if self.job.face.is_some() { count / 20 } else { count }
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

    /// Returns how the stage's maps are drawn: with depth clamp where their near plane is the receivers'.
    #[must_use]
    pub fn pass(&self, space: ClipSpace) -> DepthPass {
        DepthPass { space, clamp: self.job.near_depth == NearDepth::Receivers, ..DepthPass::WGPU }
    }

    /// Returns a technique's rule for this scene.
    ///
    /// # Errors
    /// Where the scene has none.
    pub fn rule(&self, technique: &Technique) -> Result<Rule, Error> {
        (technique.rule)(&self.job)
    }

    /// Returns a technique's job for a map of `size` by `size` texels.
    #[must_use]
    pub fn fit(&self, technique: &Technique, size: u32) -> Fit<'_> {
        Fit { map_size: [size; 2], ..technique.fit(&self.job, &self.receivers) }
    }

    /// Returns a technique's job and its map of `size` by `size` texels.
    ///
    /// # Errors
    /// As [`Fit::solve`].
    pub fn solve(&self, technique: &Technique, size: u32) -> Result<(Fit<'_>, ShadowMap), Error> {
        self.solve_rule(technique, self.rule(technique)?, size)
    }

    /// As [`Stage::solve`], with another rule on the technique's axes.
    ///
    /// # Errors
    /// As [`Fit::solve`].
    pub fn solve_rule(&self, technique: &Technique, rule: Rule, size: u32) -> Result<(Fit<'_>, ShadowMap), Error> {
        let fit = self.fit(technique, size);
        Ok((fit, fit.solve(rule)?))
    }

    /// Returns why a technique has no map for this stage, or none whose rounding to `f32` can be guarded against.
    #[must_use]
    pub fn refusal(&self, technique: &Technique, size: u32) -> Option<Error> {
        let guarded = |(fit, map): (Fit, ShadowMap)| fit.guard_f32(&map, self.job.view.eye());
        self.solve(technique, size).and_then(guarded).err()
    }

    /// Returns what the map is to show: the receivers, as far as they are in the light.
    ///
    /// # Errors
    /// [`Error::NothingVisible`] if nothing is seen.
    pub fn lit(fit: &Fit) -> Result<LitBody, Error> {
        fit.lit_receivers().next().ok_or(Error::NothingVisible)
    }

    /// Returns what each pixel shows, row by row from the upper left; `None` where no receiver is seen in the light.
    #[must_use]
    pub fn truth(&self) -> &[Option<Seen>] {
        self.truth.get_or_init(|| {
            let [width, height] = self.job.viewport;
            let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
            pixels.map(|(x, y)| self.seen(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5))).collect()
        })
    }

    /// Returns the point of a plane that is seen at a place in the picture.
    #[must_use]
    pub fn on(&self, facet: &Facet, pixel: DVec2) -> DVec3 {
        let [origin, direction] = self.camera().ray(pixel);
        origin + direction * facet.meet(origin, direction)
    }

    fn seen(&self, pixel: DVec2) -> Option<Seen> {
        let [origin, direction] = self.camera().ray(pixel);
        let view = &self.job.view;
        // Along the forward axis a ray advances by one unit of its direction.
        let hit = self.rays().first(origin, direction, view.near())?;
        let point = origin + direction * hit.distance;
        let is_in = |bounds: &Bounds| {
            let (low, high) = (bounds.min() - view.eye(), bounds.max() - view.eye());
            let rounding = 1e-12 * (1.0 + low.abs().max(high.abs()).max_element());
            point.cmpge(low - rounding).all() && point.cmple(high + rounding).all()
        };
        let is_receiver = self.job.receivers.iter().any(is_in);
        if hit.distance > view.far() || !is_receiver || !self.job.shines_on(point + view.eye()) {
            return None;
        }
        let to_light = self.to_light(point);
        // The side that is seen counts.
        let normal = self.facets[hit.triangle].normal;
        let facing = -normal.dot(direction).signum() * normal.dot(to_light);
        let light = self.light();
        // What there is of the ray, up to where casters begin.
        let end =
            if light.w > 0.0 { (light.truncate() - point).length() - self.near(-to_light) } else { f64::INFINITY };
        let shadowed = || self.rays().is_blocked(point, to_light, 1e-9 * (1.0 + point.abs().max_element())..end);
        Some(Seen { triangle: hit.triangle, pixel, point, shadowed: (facing > GRAZING).then(shadowed) })
    }
}
