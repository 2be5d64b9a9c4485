//! The guard against rounding to `f32`: a margin with a proof.

use glam::{DVec3, DVec4};

use crate::error::Error;
use crate::fit::Fit;
use crate::map::ShadowMap;

/// Half an ulp of 1 in `f32`: the relative error of one rounding.
const U: f64 = 1.0 / (1 << 24) as f64;
/// The relative error of six roundings: of a position, of a matrix entry, of their product, and of up to three sums that
/// follow, in any order; a fused multiply-add has one fewer.
const SIX_ROUNDINGS: f64 = 6.0 * U / (1.0 - 6.0 * U);
/// The absolute error of a product that rounds below the normal numbers: of each factor, times the other, and its own.
const UNDERFLOW: f64 = f32::MIN_POSITIVE as f64 * 4.0 * U;

impl Fit<'_> {
    /// Returns how far rounding to `f32` can move a receiver or its casters in the map, at worst: `x` and `y` in texels, `z` in
    /// depth from 0 to 1. For the matrix [`ShadowMap::clip_from_world_at`] `origin`, rounded to `f32`, times positions relative to
    /// `origin`, rounded to `f32`, in `f32` arithmetic, with the sums in any order and fused or not.
    ///
    /// Form: each of the four terms `m_j p_j` of a row has at most six roundings, 3 ulp together, so a row is off
    /// by at most `e = 6u/(1 - 6u) sum |m_j p_j|` with `u = 2^-24`, and a coordinate by `(e_x + e_w)/(w - e_w)` after division
    /// by `w` (its own rounding, half an ulp, apart). That is a convex function over a concave one, so it is greatest at a
    /// vertex. Casters stand at most the map's depth range above a receiver. Infinite where `f32` leaves nothing of `w`.
    #[must_use]
    pub fn rounding(&self, map: &ShadowMap, origin: DVec3) -> DVec3 {
        let [width, height] = map.size().map(f64::from);
        self.rounding_ndc(map, origin) * DVec3::new(0.5 * width, 0.5 * height, 1.0)
    }

    /// Returns the map drawn in so far that no receiver, nor a caster above one, can leave it by rounding to `f32`: the
    /// matrix [`ShadowMap::clip_from_world_at`] `origin` may be rounded to `f32` and multiplied in `f32`, in any order.
    ///
    /// The margin is the bound of [`Fit::rounding`], some 3 to 20 ulp of `f32` for positions relative to the eye or
    /// the body. Apply it last, after [`ShadowMap::with_border`].
    ///
    /// # Errors
    /// [`Error::FarFromOrigin`] with that bound where it is a texel or more.
    pub fn guard_f32(&self, map: &ShadowMap, origin: DVec3) -> Result<ShadowMap, Error> {
        let bound = self.rounding(map, origin);
        let texels = bound.x.max(bound.y);
        // Written so that NaN and infinity fail.
        if texels < 1.0 && bound.z < 0.25 {
            // The rows drawn in are smaller but for depth, which gains margin times w: a second-order term.
            Ok(map.with_margin(self.rounding_ndc(map, origin) * (1.0 + 1e-6)))
        } else {
            Err(Error::FarFromOrigin { texels: if texels.is_nan() { f64::INFINITY } else { texels } })
        }
    }

    /// The bound in normalised device coordinates: of `x/w`, `y/w`, and of depth in any convention.
    fn rounding_ndc(&self, map: &ShadowMap, origin: DVec3) -> DVec3 {
        let rows = map.rows_at(origin);
        let light = map.light_space().y;
        // One unit of depth, at w = 1, in world units along the light.
        let depth_range = -1.0 / rows[2].truncate().dot(light);
        let mut worst = DVec3::ZERO;
        for q in self.receivers.iter().flat_map(|body| body.vertices().iter().map(|v| *v + (body.origin() - origin))) {
            let w = rows[3].dot(q.extend(1.0));
            let size = (q.abs() + light.abs() * (depth_range * w)).extend(1.0);
            let [x, y, z, own] = rows.map(|row: DVec4| {
                let size_of_row = row.abs().max_element();
                let safe = size_of_row < 1e37 && size.max_element() < 1e37 && size_of_row * size.max_element() < 1e37;
                let error = SIX_ROUNDINGS * row.abs().dot(size) + UNDERFLOW * (row.abs() + size).element_sum();
                if safe { error / w } else { f64::INFINITY }
            });
            // Depth is compared with 0 and with w, and may have been formed as w - z. The true w is at least (1 - own) w; if
            // that is nothing, neither is the bound.
            let per_w = if own < 1.0 { 1.0 / (1.0 - own) } else { f64::INFINITY };
            worst = worst.max(DVec3::new(x + own, y + own, z + 2.0 * own) * per_w);
        }
        worst
    }
}
