//! The worst perspective aliasing over a body.

use glam::DVec3;

use crate::body::ConvexBody;
use crate::map::ShadowMap;
use crate::view::View;

/// Returns the perspective aliasing of a map at a point in world space, in pixels per texel: how many pixels of the
/// viewport the longer side of a texel covers there. 1 is perfect; 10 shows steps of ten pixels.
///
/// ```text
/// max(dp/dt, dp/ds),   dp/dt = w dx * ppu/z,   dp/ds = w^2/b dz * ppu/z          [LiSPSM, Sec. 4.3]
/// ```
/// `dx`, `dz`: a texel's extent in world units where `w = 1`; `b`: the distance along a spot light's axis, or 1; `ppu/z`: pixels per world unit at depth `z` along the
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
/// aliasing is `g/z`, where `g` is convex in the point and the depth `z > 0` affine. The points where it is at most `k` are
/// those with `g - k z <= 0`, and this is a convex function; so a segment whose ends obey the bound obeys it too, and with all
/// vertices all of the body does. The same holds for the larger of two such functions.
///
/// That `g` is convex: the length of `(w dx, w^2/b dz)`, of two functions that are convex and not negative. `w` is affine.
/// `w^2/b` is the square of an affine function over a positive one, whose graph is a cone; so the theorem holds for spot
/// lights, where `w = b (1 + eta t)` and `b` the distance along the axis are affine. It holds for their texel's area too,
/// `(w/z) (w^2/b/z)`, as the product of three affine functions over three, `w^3/(b z^2)`: its cube root is at most `k` where
/// `w <= k (b z^2)^(1/3)`, an affine function below a geometric mean, which is concave. And for logarithmic spacing along the
/// warp, where `w^2/b` is replaced by `w`: a logarithm's derivative has one `w` less.
#[must_use]
pub fn worst<const V: usize, const F: usize>(
    map: &ShadowMap,
    view: &View,
    viewport: [u32; 2],
    receivers: &[ConvexBody<V, F>],
) -> f64 {
    let mut worst = 0.0;
    let forward = view.forward();
    let (w_row, base_row) = (map.rows_at(map.origin())[3], map.base());
    for body in receivers {
        let shift = body.origin() - map.origin();
        let eye = view.eye() - map.origin();
        for vertex in body.vertices() {
            let q = *vertex + shift;
            let depth = if view.is_perspective() { forward.dot(q - eye).max(view.near()) } else { 1.0 };
            let [s, t] = map.texel_extent_at(w_row.dot(q.extend(1.0)), base_row.dot(q.extend(1.0)));
            let error = s.max(t) / depth;
            // A NaN counts.
            worst = if error <= worst { worst } else { error };
        }
    }
    worst * view.pixels_per_unit_at_one(viewport)
}
