//! The guard against rounding to `f32`: a margin with a proof.

use glam::DVec3;

use crate::error::{Error, require_position};
use crate::fit::{Fit, NearDepth};
use crate::light::Light;
use crate::map::ShadowMap;
use crate::math::max;

/// Half an ulp of 1 in `f32`: the relative error of one rounding.
const U: f64 = 1.0 / (1 << 24) as f64;
/// The relative error of six roundings: of a position, of a matrix entry, of their product, and of up to three sums
/// that follow, in any order; a fused multiply-add has one fewer.
const SIX_ROUNDINGS: f64 = 6.0 * U / (1.0 - 6.0 * U);
/// Sums of products below this are finite in `f32`.
const HUGE: f64 = 1e37;
/// The absolute error of a product that rounds below the normal numbers: of each factor, times the other, and its own.
const UNDERFLOW: f64 = f32::MIN_POSITIVE as f64 * 4.0 * U;

impl<const V: usize, const F: usize> Fit<'_, V, F> {
    /// Returns how far rounding to `f32` can move a receiver or its casters in the map, at worst: `x` and `y` in
    /// texels, `z` in depth from 0 to 1. For the matrix [`ShadowMap::clip_from_world_at`] `origin`, rounded to `f32`,
    /// times positions relative to `origin`, rounded to `f32`, in `f32` arithmetic, with the sums in any order and
    /// fused or not.
    ///
    /// Form: each of the four terms `m_j p_j` of a row has at most six roundings, 3 ulp together, so a row is off by
    /// at most `e = 6u/(1 - 6u) sum |m_j p_j|` with `u = 2^-24`, and a coordinate by `(e_x + e_w)/(w - e_w)` after
    /// division by `w` (its own rounding, half an ulp, apart). That is a convex function over a concave one, so it is
    /// greatest at a vertex. Casters stand at most the map's depth range above a receiver; those of a spot light are in
    /// what the map shows, where `w` falls towards the light. Infinite where `f32`
    /// leaves nothing of `w`, and for an origin that is not finite.
    #[must_use]
    pub fn rounding(&self, map: &ShadowMap, origin: DVec3) -> DVec3 {
        self.rounding_ndc(map, origin, self.near_depth == NearDepth::Casters) * half_size(map)
    }

    /// Returns the map drawn in so far that no receiver, nor (with [`NearDepth::Casters`](crate::NearDepth)) a caster
    /// above one, can leave it by rounding to `f32`: the matrix [`ShadowMap::clip_from_world_at`] `origin` may be
    /// rounded to `f32` and multiplied in `f32`, in any order.
    ///
    /// The margin is the bound of [`Fit::rounding`]: for positions relative to the eye or the body up to 100 ulp of `f32` in
    /// normalised device coordinates for a uniform map no deeper than wide (seen: 98), and more in proportion to the warp's
    /// ratio and the depth. Apply it last, after [`ShadowMap::with_border`]. It costs about as much as the fit.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `origin` is finite, with coordinates of at most 1e100.
    /// [`Error::BeyondF32`] with that bound where it is a texel or more, or a quarter of the map's depth, or of its half
    /// width.
    pub fn guard_f32(&self, map: &ShadowMap, origin: DVec3) -> Result<ShadowMap, Error> {
        require_position(origin, "origin")?;
        let margin = self.rounding_ndc(map, origin, self.near_depth == NearDepth::Casters);
        if is_small(map, margin) {
            // The rows drawn in are smaller but for depth, which gains margin times w: a second-order term.
            return Ok(map.with_margin(margin * (1.0 + 1e-6)));
        }
        let texels = (margin * half_size(map)).truncate().max_element();
        Err(Error::BeyondF32 { texels, cause: self.cause(map, origin) })
    }

    /// Why a map is too fine for `f32`: what must be otherwise for the bound to be small.
    #[cold]
    fn cause(&self, map: &ShadowMap, origin: DVec3) -> &'static str {
        let bound = |origin, casters| self.rounding_ndc(map, origin, casters);
        let is_enough = |origin, casters| is_small(map, bound(origin, casters));
        let has_casters = self.near_depth == NearDepth::Casters;
        if is_enough(map.origin(), has_casters) {
            return "the origin is too far away: use one near the receivers, such as ShadowMap::origin";
        }
        if has_casters && is_enough(origin, false) {
            return "the casters' box is too deep: cut it to what can cast, or use NearDepth::Receivers";
        }
        if has_casters && is_enough(map.origin(), false) {
            return "the origin is too far away, and the casters' box too deep: use ShadowMap::origin, and \
                    NearDepth::Receivers";
        }
        // About another origin there is more to be gained than rounding.
        let is_far = bound(map.origin(), false).max_element() < 0.5 * bound(origin, false).max_element();
        match (map.warp().excess() > 0.0, is_far) {
            (true, false) => {
                "the warp is too strong, the receivers too thin, or the map too large: use a weaker warp, a smaller map, or \
                 both"
            }
            (true, true) => {
                "the origin is too far away, and the warp too strong or the map too large: use ShadowMap::origin, and a \
                 weaker warp, a smaller map, or both"
            }
            (false, false) => "the receivers are too thin, or the map too large: use a smaller map",
            (false, true) => {
                "the origin is too far away, and the map too large: use ShadowMap::origin, and a smaller map"
            }
        }
    }

    /// The bound in normalised device coordinates: of `x/w`, `y/w`, and of depth in any convention. With the casters above the
    /// receivers, or without.
    fn rounding_ndc(&self, map: &ShadowMap, origin: DVec3, casters: bool) -> DVec3 {
        if !origin.is_finite() {
            return DVec3::INFINITY;
        }
        let rows = map.rows_at(origin);
        let sizes = rows.map(|row| row.abs());
        let light = map.light_space().y.abs();
        // One unit of depth, at w = 1, in world units along the light; and what it adds to the sums at most.
        let is_above = casters && !matches!(self.light, Light::Spot(_));
        let depth_range = if is_above { map.depth_range() } else { 0.0 };
        let above = sizes.map(|size| size.truncate().dot(light) * depth_range);
        let underflow = sizes.map(|size| UNDERFLOW * (size.element_sum() + 1.0));
        let (mut worst, mut largest) = (DVec3::ZERO, 0.0);
        let mut include = |body_origin: DVec3, vertices: &[DVec3]| {
            let shift = body_origin - origin;
            for vertex in vertices {
                let q = *vertex + shift;
                let size = q.abs();
                let w = rows[3].dot(q.extend(1.0));
                let reach = size.element_sum() + 2.0 * depth_range * w;
                let [x, y, z, own] = [0, 1, 2, 3].map(|row| {
                    let sum = sizes[row].dot(size.extend(1.0)) + above[row] * w;
                    (SIX_ROUNDINGS * sum + underflow[row] + UNDERFLOW * reach) / w
                });
                // Depth is compared with 0 and with w, and may have been formed as w - z. The w in f32 is at least
                // (1 - own) w; if that is nothing, neither is the bound.
                let error = DVec3::new(x + own, y + own, z + 2.0 * own) / (1.0 - own);
                worst = worst.max(if w > 0.0 && own < 1.0 { error } else { DVec3::INFINITY });
                largest = max(reach, largest);
            }
        };
        if let Light::Spot(spot) = self.light {
            let mut distance = 0.0;
            self.each_lit(|origin, vertices| {
                include(origin, vertices);
                let far = |q: &DVec3| (*q + (origin - spot.position())).abs().max_element();
                distance = vertices.iter().map(far).fold(distance, max);
            });
            // Its casters are not above one another; they are in what the map shows.
            if casters && self.near_depth == NearDepth::Casters {
                if let Some(casters) = self.casters.within(spot.position(), distance) {
                    let casters = map.shown(&casters);
                    include(casters.origin(), casters.vertices());
                }
            }
        } else {
            for body in self.receivers {
                include(body.origin(), body.vertices());
            }
        }
        let entry = sizes.iter().fold(0.0, |largest, size| max(size.max_element(), largest));
        let finite = entry < HUGE && largest < HUGE && entry * largest < HUGE;
        if finite { worst } else { DVec3::INFINITY }
    }
}

/// Whether a bound is below a texel and leaves a map. (A map may be one texel wide, which is all of it.)
fn is_small(map: &ShadowMap, bound: DVec3) -> bool {
    (bound * half_size(map)).truncate().max_element() < 1.0 && bound.max_element() < 0.25
}

/// Normalised device coordinates to texels, and depth to itself.
fn half_size(map: &ShadowMap) -> DVec3 {
    let [width, height] = map.size().map(f64::from);
    DVec3::new(0.5 * width, 0.5 * height, 1.0)
}
