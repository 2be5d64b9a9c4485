//! The worst perspective aliasing over a body.

use glam::DVec3;

use crate::body::Body;
use crate::map::ShadowMap;
use crate::view::View;

/// Returns the perspective aliasing of a map at a point in world space, in pixels per texel: how many pixels of the
/// viewport the longer side of a texel covers there. 1 is perfect; 10 shows steps of ten pixels.
///
/// ```text
/// max(dp/dt, dp/ds),   dp/dt = w dx * ppu/z,   dp/ds = w^2 dz * ppu/z          [LiSPSM, Sec. 4.3]
/// ```
/// `dx`, `dz`: a texel's extent in world units where `w = 1`; `ppu/z`: pixels per world unit at depth `z` along the
/// view, the larger of the two picture directions. The orientation of the surface and the shear of the map are left
/// out, as in the papers. Depths before the near plane count as the near plane's. Infinite where `w <= 0`.
#[must_use]
pub fn pixels_per_texel(map: &ShadowMap, view: &View, viewport: [u32; 2], point: DVec3) -> f64 {
    let depth = view.forward().dot(point - view.eye()).max(view.near());
    let [s, t] = map.texel_extent(point);
    s.max(t) * view.pixels_per_unit(viewport, depth)
}

/// Returns the worst perspective aliasing of a map over the receivers, in pixels per texel; 0 if there are none.
/// Domain: receivers that were cut by this view.
///
/// Exact, with no sampling: the worst point of a convex body is one of its vertices. For each axis of the map the
/// aliasing is `g(w)/z`, where `g` is convex and `w` and the depth `z > 0` are affine in the point. The points where
/// it is at most `k` are those with `g(w) - k z <= 0`, and this is a convex function; so a segment whose ends obey
/// the bound obeys it too, and with all vertices all of the body does. The same holds for the larger of two such
/// functions.
#[must_use]
pub fn worst(map: &ShadowMap, view: &View, viewport: [u32; 2], receivers: &[Body]) -> f64 {
    let mut worst = 0.0;
    let forward = view.forward();
    let w_row = map.rows_at(map.origin())[3];
    for body in receivers {
        let shift = body.origin() - map.origin();
        let eye = view.eye() - map.origin();
        for vertex in body.vertices() {
            let q = *vertex + shift;
            let depth = if view.is_perspective() { forward.dot(q - eye).max(view.near()) } else { 1.0 };
            let [s, t] = map.texel_extent_at_w(w_row.dot(q.extend(1.0)));
            worst = crate::math::max(s.max(t) / depth, worst);
        }
    }
    worst * view.pixels_per_unit_at_one(viewport)
}
