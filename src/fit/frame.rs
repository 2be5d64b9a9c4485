//! Light space as rows, and the receivers as seen in it.

use glam::{DVec3, DVec4};

use super::extent::{Extent, at, row};
use super::{Fit, NearDepth};
use crate::basis::{Axes, LightSpace};
use crate::body::{Body, ConvexBody, Reach};
use crate::error::Error;
use crate::light::{Light, Spot};
use crate::math::max;
use crate::scene::Bounds;
use crate::warp::{Slab, ViewAxis};

/// Light space about an origin near the receivers. Places in it are fractions: `x/base`, `z/base`, `height/base`. For a
/// light at infinity `base` is 1; for a spot light it is the distance along its axis, so that `x/base` and `z/base` are
/// tangents, and `height` is 1.
///
/// Functions over the receivers take `SPOT` as a constant, so that those for a light at infinity do not divide by 1.
pub(super) struct Frame<'a, const V: usize, const F: usize> {
    pub(super) fit: &'a Fit<'a, V, F>,
    pub(super) space: LightSpace,
    pub(super) origin: DVec3,
    /// The light as a homogeneous position, relative to the origin.
    pub(super) light: DVec4,
    pub(super) spot: Option<&'a Spot>,
    pub(super) x: DVec4,
    pub(super) z: DVec4,
    pub(super) height: DVec4,
    pub(super) base: DVec4,
}

/// What the receivers take up.
#[derive(Clone, Copy)]
pub(super) struct Measures {
    pub(super) across: Extent,
    pub(super) along: Extent,
    pub(super) height: Extent,
    pub(super) base: Extent,
    /// Along the view direction, from the eye; not less than the near distance.
    pub(super) depth: Extent,
}

impl Measures {
    /// No receiver is further from a spot light.
    pub(super) fn spot_reach(&self) -> f64 {
        self.base.high * (1.0 + self.across.reach() + self.along.reach())
    }
}

/// Where a vertex is in light space, as fractions, and in the view, from the plane through the origin.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) across: f64,
    pub(super) along: f64,
    pub(super) base: f64,
    pub(super) depth: f64,
}

impl Place {
    pub(super) const NONE: Self = Self { across: 0.0, along: 0.0, base: 1.0, depth: 0.0 };
}

impl<'a, const V: usize, const F: usize> Frame<'a, V, F> {
    #[inline(always)]
    pub(super) fn new(fit: &'a Fit<'a, V, F>) -> Result<Self, Error> {
        let origin = fit.origin()?;
        let space = fit.light_space()?;
        let LightSpace { x, y, z, .. } = space;
        let light = fit.light.relative_to(origin);
        let place = light.truncate();
        Ok(match fit.light {
            Light::Spot(spot) => Self {
                fit,
                space,
                origin,
                light,
                spot: Some(spot),
                x: row(x, -x.dot(place)),
                z: row(z, -z.dot(place)),
                height: DVec4::W,
                base: row(-y, y.dot(place)),
            },
            _ => Self {
                fit,
                space,
                origin,
                light,
                spot: None,
                x: row(x, 0.0),
                z: row(z, 0.0),
                height: row(y, 0.0),
                base: DVec4::W,
            },
        })
    }

    /// Calls `f` with the vertices of each receiver, as far as the light shines on it, and what to add to them.
    #[inline(always)]
    pub(super) fn each<const SPOT: bool>(&self, mut f: impl FnMut(&[DVec3], DVec3)) {
        for body in self.fit.receivers {
            let shift = body.origin() - self.origin;
            if SPOT {
                body.with_lit(self.fit.light, &self.space, |vertices| f(vertices, shift));
            } else {
                f(body.vertices(), shift);
            }
        }
    }

    /// Measures the receivers, and hands each vertex' place on to `keep`.
    #[inline(always)]
    pub(super) fn measure<const SPOT: bool>(&self, mut keep: impl FnMut(Place)) -> Result<Measures, Error> {
        let (y, view) = (self.space.y, self.fit.view);
        let mut measures = Measures {
            across: Extent::NONE,
            along: Extent::NONE,
            height: Extent::NONE,
            base: Extent::NONE,
            depth: Extent::NONE,
        };
        self.each::<SPOT>(|vertices, shift| {
            for vertex in vertices {
                let q = *vertex + shift;
                let place = self.place::<SPOT>(q);
                measures.depth.include(place.depth);
                measures.across.include(place.across);
                measures.along.include(place.along);
                measures.height.include(if SPOT { 1.0 / place.base } else { y.dot(q) });
                if SPOT {
                    measures.base.include(place.base);
                }
                keep(place);
            }
        });
        if SPOT {
            if measures.base.low > measures.base.high {
                return Err(Error::NothingLit);
            }
            // What remains of the near distance, at its place.
            let rounding = 64.0 * f64::EPSILON * max(self.light.abs().max_element(), measures.base.high);
            let condition = "must be above the rounding of the light's distance from what is seen";
            crate::error::require(measures.base.low > rounding, "near", condition)?;
        }
        let eye_depth = view.forward().dot(self.to_eye());
        measures.depth = Extent {
            low: max(measures.depth.low - eye_depth, view.near()),
            high: max(measures.depth.high - eye_depth, view.near()),
        };
        Ok(measures)
    }

    #[inline(always)]
    pub(super) fn place<const SPOT: bool>(&self, q: DVec3) -> Place {
        let depth = self.fit.view.forward().dot(q);
        if SPOT {
            let base = at(self.base, q);
            Place { across: at(self.x, q) / base, along: at(self.z, q) / base, base, depth }
        } else {
            Place { across: self.space.x.dot(q), along: self.space.z.dot(q), base: 1.0, depth }
        }
    }

    pub(super) fn to_eye(&self) -> DVec3 {
        self.fit.view.eye() - self.origin
    }

    /// The place of the line of sight across the warp, or of that through the view's middle where the axes follow it: the
    /// same for each of its points. `None` if it lies in the plane
    /// through the light across its axis, which is nowhere in its picture.
    #[inline(always)]
    pub(super) fn eye_across<const SPOT: bool>(&self) -> Option<f64> {
        if !SPOT {
            return Some(self.space.x.dot(self.to_eye()));
        }
        // Both would do; the one with the greater denominator is the more accurate. At infinity that is the eye.
        let eye = self.to_eye();
        let forward = match self.fit.axes {
            Axes::Middle | Axes::VertexMean => self.fit.middle_vector(),
            Axes::View | Axes::LightFixed => self.fit.view.forward(),
        };
        let at_eye = [at(self.x, eye), at(self.base, eye)];
        let far_away = [self.x, self.base].map(|row| row.truncate().dot(forward));
        let depth = at_eye[1].abs().max(eye.abs().max_element());
        let [x, base] = if at_eye[1].abs() > depth * far_away[1].abs() { at_eye } else { far_away };
        let place = x / base;
        place.is_finite().then_some(place)
    }

    /// Calls `f` with the points between two depths in the view that matter, positions relative to the origin: vertices, and
    /// where edges pass one of these depths.
    pub(super) fn each_between(&self, depths: Extent, mut f: impl FnMut(DVec3)) {
        for body in self.fit.receivers {
            if self.spot.is_some() {
                self.each_of_body(&body.lit_by(self.fit.light, &self.space), depths, &mut f);
            } else {
                self.each_of_body(body, depths, &mut f);
            }
        }
    }

    /// As [`Frame::each_between`], of one body.
    fn each_of_body<const V2: usize, const F2: usize>(
        &self,
        body: &ConvexBody<V2, F2>,
        depths: Extent,
        f: &mut impl FnMut(DVec3),
    ) {
        let (vertices, shift) = (body.vertices(), body.origin() - self.origin);
        let (eye, forward) = (self.to_eye() - shift, self.fit.view.forward());
        let depth = |q: DVec3| forward.dot(q - eye);
        for vertex in vertices {
            if (depths.low..=depths.high).contains(&depth(*vertex)) {
                f(*vertex + shift);
            }
        }
        for (a, b) in body.edges() {
            let (p, q) = (vertices[a], vertices[b]);
            let (first, last) = (depth(p), depth(q));
            for bound in [depths.low, depths.high] {
                let (before, beyond) = (bound - first, last - bound);
                if before * beyond > 0.0 {
                    f(p + (q - p) * (before / (before + beyond)) + shift);
                }
            }
        }
    }

    /// The depths that the warp is chosen for: those the user cares about, as far as there is anything.
    pub(super) fn chosen_depths(&self, measures: &Measures) -> Option<Extent> {
        let wanted = self.fit.warp_depths?;
        let [low, high] = wanted.map(|depth| measures.depth.clamp(depth));
        let chosen = Extent { low, high };
        let mut is_any = low < high;
        // Between two bodies there may be nothing.
        if is_any && self.fit.receivers.len() > 1 {
            is_any = false;
            self.each_between(chosen, |_| is_any = true);
        }
        is_any.then_some(chosen)
    }

    /// What the rules look at, for a body that begins at `along.low`.
    pub(super) fn slab(&self, measures: &Measures, along: Extent) -> Slab {
        let (mut depth, mut extent) = (measures.depth, along.size());
        if let Some(chosen) = self.chosen_depths(measures) {
            let mut part = Extent::NONE;
            self.each_between(chosen, |q| part.include(at(self.z, q) / at(self.base, q)));
            if part.low <= part.high {
                (depth, extent) = (chosen, part.size());
            }
        }
        Slab { near: depth.low, far: depth.high, extent, sin_gamma: self.space.sin_gamma }
    }

    /// All casters, if the near plane is to be before them.
    pub(super) fn casters(&self) -> Option<&'a Bounds> {
        (self.fit.near_depth == NearDepth::Casters).then_some(self.fit.casters)
    }

    /// Where the points of the line of sight lie in the body.
    pub(super) fn view_axis(&self, along: Extent) -> ViewAxis {
        let t = (self.z - along.low * self.base) / along.size();
        let (eye, forward) = (self.to_eye(), self.fit.view.forward());
        let of = |row: DVec4| [at(row, eye), row.truncate().dot(forward)];
        ViewAxis { t: of(t), w: of(self.base) }
    }

    /// The extremes of linear fractions over `w`: of some rows over the receivers, and of the height from the
    /// receivers to those casters. For a light at infinity, `height` grows by one per unit towards it.
    #[inline(always)]
    pub(super) fn fractions<const N: usize, const SPOT: bool>(
        &self,
        rows: [DVec4; N],
        height: DVec4,
        w: DVec4,
        casters: Option<&Bounds>,
    ) -> ([Extent; N], Extent) {
        let (mut sides, mut depths) = ([Extent::NONE; N], Extent::NONE);
        let to_light = self.space.y;
        for body in self.fit.receivers {
            let shift = body.origin() - self.origin;
            let mut include = |q: DVec3| {
                let per_w = 1.0 / at(w, q);
                for axis in 0..N {
                    sides[axis].include(at(rows[axis], q) * per_w);
                }
                let height = at(height, q);
                depths.include(height * per_w);
                (height, per_w)
            };
            if SPOT {
                body.with_lit(self.fit.light, &self.space, |vertices| {
                    vertices.iter().for_each(|vertex| {
                        include(*vertex + shift);
                    });
                });
                continue;
            }
            let mut reach = Reach::above(body, to_light, casters.unwrap_or(self.fit.casters), self.origin, [height, w]);
            for (vertex, point) in body.vertices().iter().enumerate() {
                let q = *point + shift;
                let (height, per_w) = include(q);
                reach.include(vertex, q, height, per_w);
            }
            if let Some(casters) = casters {
                let inside = body.is_inside(casters);
                let reach = if inside { reach.of_enclosed(body) } else { reach.of_any(body, casters) };
                depths.high = max(reach, depths.high);
            }
        }
        (sides, depths)
    }

    /// The extremes of linear fractions over the receivers alone.
    pub(super) fn fractions_of_receivers<const N: usize, const SPOT: bool>(
        &self,
        rows: [DVec4; N],
        w: DVec4,
    ) -> [Extent; N] {
        let mut sides = [Extent::NONE; N];
        self.each::<SPOT>(|vertices, shift| {
            for vertex in vertices {
                let q = *vertex + shift;
                let per_w = 1.0 / at(w, q);
                for axis in 0..N {
                    sides[axis].include(at(rows[axis], q) * per_w);
                }
            }
        });
        sides
    }

    /// The depths, out to the casters of a spot light that its finished sides show.
    pub(super) fn with_spot_casters(
        &self,
        mut depths: Extent,
        measures: &Measures,
        sides: [DVec4; 2],
        height: DVec4,
        w: DVec4,
    ) -> Extent {
        let Some(spot) = self.spot.filter(|_| self.fit.near_depth == NearDepth::Casters) else { return depths };
        // No more of the box than there is from the light to the receivers, so that one without measure leaves the numbers
        // their digits.
        if let Some(casters) = self.fit.casters.within(spot.position(), measures.spot_reach()) {
            let near = self.base - DVec4::W * spot.near();
            let [x, y] = sides;
            for vertex in Body::where_positive(&casters, self.origin, &[near, w - x, w + x, w - y, w + y]).vertices() {
                // By rounding a corner may lie on the plane through the light where `w` is 0.
                let w = at(w, *vertex);
                depths.high = if w > 0.0 { max(at(height, *vertex) / w, depths.high) } else { depths.high };
            }
        }
        depths
    }
}
