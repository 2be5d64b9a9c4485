//! A lit picture: every shadow against rays, and every change of the shadow's coordinates against its closed form.

use std::ops::RangeInclusive;

use anyhow::{Context, Result, ensure};
use scenes::Technique;
use shadow_warp::glam::{DVec2, DVec3};
use shadow_warp::{Axes, ClipSpace, Fit, ShadowMap};

use super::allowance;
use crate::gpu::{DepthPass, Gpu, Pixel};
use crate::projection::{Facet, Projection};
use crate::raster::Allowance;
use crate::stage::{Seen, Stage};

/// The shadows of a picture.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shadows {
    /// Pixels that were compared.
    pub pixels: usize,
    /// Pixels whose place is not in the map.
    pub outside: usize,
    /// Wrong pixels whose texel has a shadow's edge between its centre and the point.
    pub edge: usize,
    /// Lit pixels that are in the shadow of something so close to them that the bias hides it.
    pub contact: usize,
    /// Dark pixels that only their own surface shadows.
    pub acne: usize,
    /// The furthest that such a point lies from its texel's centre along the warp, over half of the texel extent that the
    /// crate predicts, and the device's error.
    pub footprint: f64,
    /// Pixels, wrong or right, that are not as the map's own geometry predicts.
    pub unexplained: usize,
}

impl Shadows {
    /// What is not as it must be.
    #[must_use]
    pub fn failures(&self) -> Vec<String> {
        let mut failures = Vec::new();
        if self.pixels < LEAST_PIXELS {
            failures.push(format!("only {} pixels were compared", self.pixels));
        }
        let counts = [
            (self.outside, "receivers are outside of the map"),
            (self.acne, "surfaces shadow themselves"),
            (self.unexplained, "shadows are not as the map's geometry predicts"),
        ];
        failures.extend(
            counts.into_iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} pixels: {what}")),
        );
        if self.footprint > 1.0 + 1e-6 {
            failures.push(format!("a wrong pixel is {} half texels from its texel's centre", self.footprint));
        }
        failures
    }

    /// The share of pixels that are wrong, whatever the reason.
    #[must_use]
    pub fn wrong(&self) -> f64 {
        (self.edge + self.contact + self.acne) as f64 / self.pixels.max(1) as f64
    }
}

/// A picture with fewer shows nothing.
const LEAST_PIXELS: usize = 5_000;

/// Errors of the changes of the shadow's coordinates from pixel to pixel.
#[derive(Clone, Debug, Default)]
pub struct Changes {
    /// Relative, sorted.
    relative: Vec<f64>,
    /// The largest, in texels.
    pub texels: f64,
    /// The largest, over what rounding to `f32` explains.
    pub of_allowed: f64,
}

impl Changes {
    /// What is not as it must be.
    #[must_use]
    pub fn failures(&self) -> Vec<String> {
        let mut failures = Vec::new();
        if self.count() < LEAST_PIXELS {
            failures.push(format!("only {} changes were measured", self.count()));
        }
        if self.of_allowed > 1.0 {
            failures
                .push(format!("a change is off by {} texels, {} times what is allowed", self.texels, self.of_allowed));
        }
        failures
    }

    /// How many were measured.
    #[must_use]
    pub fn count(&self) -> usize {
        self.relative.len()
    }

    /// The relative error that this share of all does not exceed.
    #[must_use]
    pub fn quantile(&self, share: f64) -> f64 {
        let last = self.relative.len().saturating_sub(1);
        self.relative.get((last as f64 * share).round() as usize).copied().unwrap_or(f64::NAN)
    }
}

/// Draws a picture through a technique's map, and compares each of its pixels.
///
/// # Errors
/// If there is no map, or the device refuses.
pub fn picture(gpu: &Gpu, stage: &Stage, technique: &Technique, size: u32) -> Result<(Shadows, Changes)> {
    let (fit, map) = stage.solve(technique, size)?;
    let eye = stage.job.view.eye();
    let map = fit.guard_f32(&map, eye)?;
    let lookup = Lookup::new(gpu, stage, &fit, &map)?;
    let pixels = lookup.draw(gpu, ClipSpace::WGPU)?;
    let truth = stage.truth()?;
    let mut shadows = Shadows::default();
    let mut shown = 0;
    for (pixel, seen) in pixels.iter().zip(truth) {
        // Where edges of triangles meet the pixel's middle, device and rays may see different ones.
        let (Some(pixel), Some(seen)) = (pixel, seen) else { continue };
        if pixel.triangle != seen.triangle {
            continue;
        }
        shown += 1;
        let inside = pixel.place.iter().all(|x| (0.0..=1.0).contains(x));
        shadows.outside += usize::from(!inside);
        if let Some(shadowed) = seen.shadowed {
            lookup.judge(pixel, seen, shadowed, &mut shadows);
        }
    }
    let seen = truth.iter().flatten().count();
    ensure!(100 * shown > 98 * seen, "device and rays see the same triangle in {shown} of {seen} pixels only");
    Ok((shadows, lookup.changes(&pixels, truth)))
}

/// A map, and what is needed to predict what a look into it gives. Positions are relative to the eye.
pub(crate) struct Lookup<'a> {
    stage: &'a Stage,
    map: &'a ShadowMap,
    axes: Axes,
    projection: Projection,
    allowance: Allowance,
    to_light: DVec3,
    /// For each triangle: the least bias with which it does not shadow itself.
    biases: Vec<f64>,
    /// What rounding of matrix, position and coordinate to `f32` may displace a place by, in texels.
    rounding: f64,
    /// Longer than the scene.
    far: f64,
}

impl<'a> Lookup<'a> {
    pub(crate) fn new(gpu: &Gpu, stage: &'a Stage, fit: &Fit, map: &'a ShadowMap) -> Result<Self> {
        let eye = stage.job.view.eye();
        let projection = Projection::new(map, eye, ClipSpace::WGPU);
        let allowance = allowance(gpu, fit, map, eye);
        let corner = DVec2::from(map.size().map(f64::from));
        let bias = |facet| {
            let slope = projection.slope(facet);
            // Half a texel away, and what the device may err by there and here.
            let bias = 0.5 * slope.abs().element_sum() + 2.0 * allowance.of_depth(corner, 1.0, slope);
            // A surface along the light has none; it is not asked for.
            if bias < 2.0 { bias } else { 2.0 }
        };
        let biases = stage.facets.iter().map(bias).collect();
        let size =
            stage.job.casters.max() - stage.job.casters.min() + stage.job.receivers.max() - stage.job.receivers.min();
        let rounding = fit.rounding(map, eye).truncate().length() + corner.max_element() * f64::from(f32::EPSILON);
        let (to_light, far) = (stage.to_light()?, size.length());
        Ok(Self { stage, map, axes: fit.axes, projection, allowance, to_light, biases, rounding, far })
    }

    pub(crate) fn stage(&self) -> &Stage {
        self.stage
    }

    pub(crate) fn projection(&self) -> &Projection {
        &self.projection
    }

    pub(crate) fn to_light(&self) -> DVec3 {
        self.to_light
    }

    /// The lit picture, through a map in the conventions of an interface.
    pub(crate) fn draw(&self, gpu: &Gpu, space: ClipSpace) -> Result<Vec<Option<Pixel>>> {
        let eye = self.stage.job.view.eye();
        let (mesh, camera) = (self.stage.mesh(gpu, eye), self.stage.camera());
        let pass = DepthPass { space, ..DepthPass::WGPU };
        let shadows = gpu.depth(&mesh, self.map.clip_from_world_at(eye, space), pass, self.map.size())?;
        // Towards the light is towards greater depth where depth is reversed, and half as far in units of the buffer
        // as in those of clip space from -1 to 1; the buffer's are meant here.
        let sign = if pass.cleared() > 0.5 { 1.0 } else { -1.0 };
        let biases: Vec<f32> = self.biases.iter().map(|&bias| (sign * bias) as f32).collect();
        let texture_from_eye = self.map.texture_from_world_at(eye, space);
        gpu.lit(&mesh, camera.clip_from_eye(), texture_from_eye, &biases, &shadows, camera.size)
    }

    /// Counts a pixel.
    fn judge(&self, pixel: &Pixel, seen: &Seen, shadowed: bool, shadows: &mut Shadows) {
        shadows.pixels += 1;
        let facet = &self.stage.facets[seen.triangle];
        let place = self.projection.place(seen.point);
        let limit = DVec2::from(self.map.size().map(f64::from));
        let looked_at = DVec2::new(pixel.place[0].into(), pixel.place[1].into()) * limit;
        // Where the place lies on the border of texels, the sampler may have taken either.
        let slack = self.allowance.coverage;
        let centre_of = |place: DVec2| place.floor().clamp(DVec2::ZERO, limit - 1.0) + 0.5;
        let reference = f64::from(pixel.place[2]) - self.biases[seen.triangle];
        let is_near = (place.texel - looked_at).length() <= slack + CAMERA * self.speed(facet, seen.pixel);
        let look = |offset: DVec2| {
            let centre = centre_of(looked_at + offset);
            self.first(self.projection.on(facet, centre + offset)).moved(-offset)
        };
        let decides = |found: &Found| (reference <= found.depth) == pixel.lit;
        let mut found = look(DVec2::ZERO);
        let explains =
            |range: RangeInclusive<f64>| range.contains(&reference) || (reference < *range.start()) == pixel.lit;
        if !decides(&found) {
            // Something else may have been looked up next to an edge; where nothing that is found there decides, it is
            // the edge itself.
            found = around(slack).map(look).find(decides).unwrap_or(found);
        }
        if !is_near || !(decides(&found) || explains(Found::range(around(slack).map(look)))) {
            shadows.unexplained += 1;
            return;
        }
        if pixel.lit != shadowed {
            return;
        }
        let own = |index: usize| {
            let other = &self.stage.facets[index];
            let distance = (other.offset * other.normal.dot(facet.normal) - facet.offset).abs();
            other.normal.dot(facet.normal).abs() > 1.0 - 1e-9 && distance <= 1e-9 * (1.0 + facet.offset.abs())
        };
        let is_above = found.depth < reference + self.biases[seen.triangle] - found.error;
        let count = if pixel.lit && is_above {
            &mut shadows.contact
        } else if !pixel.lit && found.triangle.is_some_and(own) {
            &mut shadows.acne
        } else {
            &mut shadows.edge
        };
        *count += 1;
        let centre = self.projection.on(facet, centre_of(looked_at));
        let along = (centre - seen.point).dot(self.map.light_space().z).abs();
        let extent = |q: DVec3| {
            let [s, t] = self.map.texel_extent(q + self.stage.job.view.eye());
            // Along axes of its own, each side of a texel has a part along the warp.
            if self.axes == Axes::View { t } else { s + t }
        };
        shadows.footprint = shadows.footprint.max(along / ((0.5 + slack) * extent(centre).max(extent(seen.point))));
    }

    /// What is nearest to the light on the ray of light through a point: its depth as the map has it, and what the
    /// device may err by.
    pub(crate) fn first(&self, point: DVec3) -> Found {
        let start = point + self.to_light * self.far;
        let Some(hit) = self.stage.rays.first(start, -self.to_light, 0.0) else {
            return Found { depth: 1.0, slope: DVec2::ZERO, error: 0.0, triangle: None };
        };
        let place = self.projection.place(start - self.to_light * hit.distance);
        let slope = self.projection.slope(&self.stage.facets[hit.triangle]);
        let error = self.allowance.of_depth(place.texel, place.depth, slope);
        // A surface along the light has no depth to speak of.
        let (slope, error) = if error.is_finite() { (slope, error) } else { (DVec2::ZERO, 2.0) };
        Found { depth: place.depth, slope, error, triangle: Some(hit.triangle) }
    }

    /// How far the place in the map moves from pixel to pixel, in texels.
    fn speed(&self, facet: &Facet, pixel: DVec2) -> f64 {
        let point = self.seen(facet, pixel);
        let [across, down] = self.stage.camera().change(facet, pixel).map(|step| self.projection.change(point, step));
        across.length() + down.length()
    }

    /// The point of a plane that is seen at a place in the picture.
    fn seen(&self, facet: &Facet, pixel: DVec2) -> DVec3 {
        let [origin, direction] = self.stage.camera().ray(pixel);
        origin + direction * facet.meet(origin, direction)
    }

    /// The changes of the shadow's coordinates within the pairs of pixels that show one triangle. A difference is the
    /// derivative half-way.
    fn changes(&self, pixels: &[Option<Pixel>], truth: &[Option<Seen>]) -> Changes {
        let camera = self.stage.camera();
        let width = camera.size[0] as usize;
        let limit = DVec2::from(self.map.size().map(f64::from));
        let shown = |index: usize| {
            let (pixel, seen) = ((*pixels.get(index)?)?, (*truth.get(index)?)?);
            (pixel.triangle == seen.triangle).then_some((pixel, seen))
        };
        let mut changes = Changes::default();
        for index in 0..pixels.len() {
            for (axis, (place, step)) in [(index % width, 1), (index / width, width)].into_iter().enumerate() {
                // Pairs begin at even pixels.
                let pair = shown(index).zip(shown(index + step)).filter(|_| place % 2 == 0);
                let Some(((pixel, a), (_, b))) = pair.filter(|((_, a), (_, b))| a.triangle == b.triangle) else {
                    continue;
                };
                let facet = &self.stage.facets[a.triangle];
                let measured = DVec2::from(pixel.change[axis].map(f64::from)) * limit;
                let middle = 0.5 * (a.pixel + b.pixel);
                let half_way = self.projection.change(self.seen(facet, middle), camera.change(facet, middle)[axis]);
                changes.relative.push((measured - half_way).length() / half_way.length());
                let difference = self.projection.place(b.point).texel - self.projection.place(a.point).texel;
                let error = (measured - difference).length();
                // Either end is displaced, by the map's rounding and by the camera's.
                let speed = self.speed(facet, a.pixel) + self.speed(facet, b.pixel);
                changes.texels = changes.texels.max(error);
                changes.of_allowed = changes.of_allowed.max(error / (2.0 * self.rounding + CAMERA * speed));
            }
        }
        changes.relative.sort_by(f64::total_cmp);
        changes
    }
}

/// How far a device may be from the middle of a pixel with the position that it interpolates, in pixels.
const CAMERA: f64 = 1e-4;

/// Places around one, as far as `reach` in texels, close enough to each other to meet a spike.
pub(crate) fn around(reach: f64) -> impl Iterator<Item = DVec2> {
    const RINGS: u32 = 4;
    const DIRECTIONS: u32 = 24;
    let ring = move |ring: u32| {
        (0..DIRECTIONS).map(move |direction| {
            let angle = f64::from(direction) / f64::from(DIRECTIONS) * std::f64::consts::TAU;
            DVec2::from_angle(angle) * (reach * f64::from(ring) / f64::from(RINGS))
        })
    };
    (1..=RINGS).flat_map(ring)
}

/// What lies nearest to the light at a place of the map.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    pub(crate) depth: f64,
    /// How depth changes from texel to texel.
    slope: DVec2,
    /// What the device may err by.
    error: f64,
    triangle: Option<usize>,
}

impl Found {
    /// The same, with a depth that a buffer can hold.
    pub(crate) fn clamped(self) -> Self {
        Self { depth: self.depth.clamp(0.0, 1.0), ..self }
    }

    /// The same surface so many texels further on, whether or not it reaches there.
    pub(crate) fn moved(self, offset: DVec2) -> Self {
        Self { depth: self.depth + self.slope.dot(offset), ..self }
    }

    /// The depths that a device may hold where it may have found any of these. Next to an edge it may be that of a wall
    /// between them which none met; a wall's depth is taken at the texel's centre, which may be beyond its edge by as
    /// much as positions are rounded.
    pub(crate) fn range(looks: impl Iterator<Item = Self>) -> RangeInclusive<f64> {
        let (least, most) = looks.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), found| {
            (least.min(found.depth - found.error), most.max(found.depth + found.error))
        });
        let room = 0.1 * (most - least);
        least - room..=most + room
    }
}

/// Returns the shares of all pixels at which two pictures differ.
pub(crate) fn difference(a: &[Option<Pixel>], b: &[Option<Pixel>]) -> Result<f64> {
    let lit = |pixel: &Option<Pixel>| pixel.map(|pixel| pixel.lit);
    let differ = a.iter().zip(b).filter(|(a, b)| lit(a) != lit(b)).count();
    Ok(differ as f64 / u32::try_from(a.len()).map(f64::from).context("a picture is small")?)
}
