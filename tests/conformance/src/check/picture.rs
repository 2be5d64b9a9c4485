//! A lit picture: every shadow against rays, and every change of the shadow's coordinates against its closed form.

use anyhow::{Result, ensure};
use scenes::Technique;
use shadow_warp::ClipSpace;
use shadow_warp::glam::{DVec2, DVec3};

use super::lookup::{Found, Lookup};
use super::{above, worse};
use crate::gpu::Gpu;
use crate::pass::Pixel;
use crate::projection::Facet;
use crate::stage::{Seen, Stage};

/// The shadows of a picture.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shadows {
    /// Pixels that were compared.
    pub pixels: usize,
    /// With fewer the picture shows nothing.
    pub least: usize,
    /// Pixels whose place is not in the map.
    pub outside: usize,
    /// Wrong pixels whose texel has a shadow's edge between its centre and the point.
    pub edge: usize,
    /// Lit pixels that are in the shadow of something so close to them that the bias hides it.
    pub contact: usize,
    /// Dark pixels that only their own surface shadows.
    pub acne: usize,
    /// The furthest that a wrong point lies from its texel's centre along the warp, over half of the texel extent that the
    /// crate predicts, and the device's error. Not where the warp lies askew over the texture.
    pub footprint: f64,
    /// Pixels, wrong or right, that are not as the map's geometry predicts, or whose ray of light is not one place of the map
    /// all along.
    pub unexplained: usize,
}

impl Shadows {
    /// What is not as it must be.
    #[must_use]
    pub fn failures(&self) -> Vec<String> {
        let mut failures = above(
            0,
            &[
                (self.outside, "pixels show receivers that are outside of the map"),
                (self.acne, "pixels show surfaces that shadow themselves"),
                (self.unexplained, "pixels are lit or dark otherwise than the map's geometry predicts"),
            ],
        );
        if self.pixels < self.least {
            failures.push(format!("only {} pixels were compared", self.pixels));
        }
        let (pixels, wrong) = (self.pixels as f64, self.wrong());
        if !(wrong <= MOST_WRONG && self.contact as f64 <= MOST_IN_CONTACT * pixels) {
            failures.push(format!("{wrong} of the pixels are wrong, {} of {pixels} in contact", self.contact));
        }
        // Of many wrong pixels, some are near the ends of their texels.
        let is_telling = self.footprint > 0.0 && self.edge > 100;
        if !(self.footprint <= 1.0 + 1e-6 && (self.footprint > 0.8 || !is_telling)) {
            failures
                .push(format!("the furthest wrong pixel is {} half texels from its texel's centre", self.footprint));
        }
        failures
    }

    /// Of two pictures together.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            pixels: self.pixels + other.pixels,
            least: self.least + other.least,
            outside: self.outside + other.outside,
            edge: self.edge + other.edge,
            contact: self.contact + other.contact,
            acne: self.acne + other.acne,
            footprint: worse(self.footprint, other.footprint),
            unexplained: self.unexplained + other.unexplained,
        }
    }

    /// The share of pixels that are wrong, whatever the reason.
    #[must_use]
    pub fn wrong(&self) -> f64 {
        (self.edge + self.contact + self.acne) as f64 / self.pixels.max(1) as f64
    }
}

/// A picture with fewer shows nothing.
const LEAST_PIXELS: usize = 5_000;
/// The shares of pixels that are wrong at most in any of the scenes, with room: an avenue to the horizon without warp has
/// 0.029, and 0.008 in contact.
const MOST_WRONG: f64 = 0.05;
const MOST_IN_CONTACT: f64 = 0.02;

/// Errors of the changes of the shadow's coordinates from pixel to pixel.
#[derive(Clone, Debug, Default)]
pub struct Changes {
    /// Relative, sorted.
    relative: Vec<f64>,
    /// With fewer the picture shows nothing.
    least: usize,
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
        if self.count() < self.least {
            failures.push(format!("only {} changes were measured", self.count()));
        }
        let all = [self.of_allowed, self.texels, self.quantile(1.0)];
        if !(self.of_allowed <= 1.0 && all.iter().all(|x| x.is_finite())) {
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

/// Draws a picture through a technique's map, and judges the shadow of each of its pixels.
///
/// # Errors
/// If there is no map, or the device refuses.
pub fn shadows(gpu: &Gpu, stage: &Stage, technique: &Technique, size: u32) -> Result<Shadows> {
    with_picture(gpu, stage, technique, size, |lookup, pixels, truth| {
        let mut shadows = Shadows { least: stage.least(LEAST_PIXELS), ..Shadows::default() };
        for (pixel, seen) in pixels.iter().zip(truth).filter_map(|(pixel, seen)| agreed(pixel, seen)) {
            let inside = pixel.place.iter().all(|x| (0.0..=1.0).contains(x));
            shadows.outside += usize::from(!inside);
            if let Some(shadowed) = seen.shadowed {
                lookup.judge(pixel, seen, shadowed, &mut shadows);
            }
        }
        shadows
    })
}

/// Draws the same picture, and measures how the places in the map change from pixel to pixel.
///
/// # Errors
/// If there is no map, or the device refuses.
pub fn changes(gpu: &Gpu, stage: &Stage, technique: &Technique, size: u32) -> Result<Changes> {
    with_picture(gpu, stage, technique, size, |lookup, pixels, truth| lookup.changes(pixels, truth))
}

fn with_picture<T>(
    gpu: &Gpu,
    stage: &Stage,
    technique: &Technique,
    size: u32,
    measure: impl FnOnce(&Lookup, &[Option<Pixel>], &[Option<Seen>]) -> T,
) -> Result<T> {
    let (fit, map) = stage.solve(technique, size)?;
    let map = fit.guard_f32(&map, stage.job.view.eye())?;
    let lookup = Lookup::new(gpu, stage, &fit, &map)?;
    let (pixels, truth) = (lookup.draw(gpu, ClipSpace::WGPU)?, stage.truth());
    let shown = pixels.iter().zip(truth).filter(|(pixel, seen)| agreed(pixel, seen).is_some()).count();
    let seen = truth.iter().flatten().count();
    ensure!(100 * shown > 98 * seen, "device and rays see the same triangle in {shown} of {seen} pixels only");
    Ok(measure(&lookup, &pixels, truth))
}

/// A pixel where device and rays see the same triangle. Where the edges of triangles meet its middle they may not.
fn agreed<'a>(pixel: &'a Option<Pixel>, seen: &'a Option<Seen>) -> Option<(&'a Pixel, &'a Seen)> {
    pixel.as_ref().zip(seen.as_ref()).filter(|(pixel, seen)| pixel.triangle == seen.triangle)
}

impl Lookup<'_> {
    /// Counts a pixel.
    fn judge(&self, pixel: &Pixel, seen: &Seen, shadowed: bool, shadows: &mut Shadows) {
        shadows.pixels += 1;
        let facet = &self.stage.facets[seen.triangle];
        let place = self.projection.place(seen.point);
        let limit = self.limit();
        let looked_at = DVec2::new(pixel.place[0].into(), pixel.place[1].into()) * limit;
        // Where the place lies on the border of texels, the sampler may have taken either.
        let slack = self.allowance.coverage;
        let centre_of = |place: DVec2| place.floor().clamp(DVec2::ZERO, limit - 1.0) + 0.5;
        let reference = f64::from(pixel.place[2]) - self.biases[seen.triangle];
        let drift = self.drift(facet, seen.pixel);
        let depth_off = (f64::from(pixel.place[2]) - place.depth).abs();
        let depth_room = self.allowance.depth + f64::from(f32::EPSILON) + self.slope(seen.triangle) * (slack + drift);
        let is_near =
            drift.is_finite() && (place.texel - looked_at).length() <= slack + drift && depth_off <= depth_room;
        let decides = |found: &Found| (reference <= found.depth) == pixel.lit;
        let at_centre = self.first(centre_of(looked_at));
        let found = if decides(&at_centre) {
            Some(at_centre)
        } else {
            let corners = [[-slack, -slack], [slack, -slack], [-slack, slack], [slack, slack]].map(DVec2::from);
            let candidates = corners.into_iter().flat_map(|corner| self.candidates(centre_of(looked_at + corner)));
            let may_decide = |found: &Found| decides(found) || (reference - found.depth).abs() <= found.error;
            candidates.into_iter().find(may_decide)
        };
        let Some(found) = found.filter(|_| is_near && at_centre.off_ray <= slack) else {
            shadows.unexplained += 1;
            return;
        };
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
        if self.is_straight() {
            // On the plane across the light through the point.
            let normal = self.map.light_space().y;
            let across = Facet { normal, offset: normal.dot(self.projection.on(facet, looked_at)) };
            let [centre, point] = [centre_of(looked_at), looked_at].map(|place| self.projection.on(&across, place));
            let along = (centre - point).dot(self.map.light_space().z).abs();
            let extent = |q: DVec3| self.map.texel_extent(q + self.stage.job.view.eye())[1];
            let longer = extent(centre).max(extent(point));
            shadows.footprint = worse(along / ((0.5 + slack) * longer), shadows.footprint);
        }
    }

    /// The changes of the shadow's coordinates within the pairs of pixels that show one triangle. A difference is the
    /// derivative half-way.
    fn changes(&self, pixels: &[Option<Pixel>], truth: &[Option<Seen>]) -> Changes {
        let camera = self.stage.camera();
        let width = camera.size[0] as usize;
        let shown = |index: usize| agreed(pixels.get(index)?, truth.get(index)?);
        let mut changes = Changes { least: self.stage.least(LEAST_PIXELS), ..Changes::default() };
        for index in 0..pixels.len() {
            for (axis, (place, step)) in [(index % width, 1), (index / width, width)].into_iter().enumerate() {
                // Pairs begin at even pixels, and the last one may have no partner.
                let is_pair = place % 2 == 0 && place + 1 < camera.size[axis] as usize;
                let pair = shown(index).zip(shown(index + step)).filter(|_| is_pair);
                let Some(((pixel, a), (_, b))) = pair.filter(|((_, a), (_, b))| a.triangle == b.triangle) else {
                    continue;
                };
                let facet = &self.stage.facets[a.triangle];
                let measured = DVec2::from(pixel.change[axis].map(f64::from)) * self.limit();
                let middle = 0.5 * (a.pixel + b.pixel);
                let half_way = self.projection.change(self.stage.on(facet, middle), camera.change(facet, middle)[axis]);
                changes.relative.push((measured - half_way).length() / half_way.length());
                let difference = self.projection.place(b.point).texel - self.projection.place(a.point).texel;
                let error = (measured - difference).length();
                // Either end is displaced, by the map's rounding and by the camera's.
                let drift = self.drift(facet, a.pixel) + self.drift(facet, b.pixel);
                changes.texels = worse(error, changes.texels);
                changes.of_allowed = worse(error / (2.0 * self.rounding + 2.0 * drift), changes.of_allowed);
            }
        }
        changes.relative.sort_by(f64::total_cmp);
        changes
    }
}

/// Returns the share of all pixels at which two pictures differ.
pub(super) fn difference(a: &[Option<Pixel>], b: &[Option<Pixel>]) -> f64 {
    let lit = |pixel: &Option<Pixel>| pixel.map(|pixel| pixel.lit);
    let differ = a.iter().zip(b).filter(|(a, b)| lit(a) != lit(b)).count();
    differ as f64 / a.len().max(1) as f64
}
