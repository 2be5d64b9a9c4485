//! The worst perspective aliasing over a body.

use glam::DVec3;

use crate::body::ConvexBody;
use crate::map::{ShadowMap, Texels};
use crate::math::max;
use crate::view::View;

/// Returns the perspective aliasing of a map at a point in world space, in pixels per texel: the larger of its parts along
/// the map's two axes. 1 is perfect; 10 shows steps of ten pixels.
///
/// ```text
/// max(dp/dt, dp/ds),   dp/dt = w dx * ppu/z,   dp/ds = w^2/b dz * ppu/z          [LiSPSM, Sec. 4.3]
/// ```
/// `dx`, `dz`: a texel's extent in world units where `w = 1`; `b`: the distance along a spot light's axis, or 1; `ppu/z`: pixels per world unit at depth `z` along the
/// view, the larger of the two picture directions. The orientation of the surface and the shear of the map are left
/// out, as in the papers. A texel is a parallelogram: its longest extent is longer where the warp shears it (seen: 5
/// times, 93.3 for 19.1 pixels). Depths before the near plane count as the near plane's. Infinite where `w <= 0`.
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
    let mut worst = Worst::of([map.texels_at(map.origin())], view, map.origin());
    for body in receivers {
        let shift = body.origin() - map.origin();
        body.vertices().iter().for_each(|vertex| worst.include(*vertex + shift));
    }
    let [sides] = worst.pixels(viewport);
    sides[0].max(sides[1])
}

/// Looks for the worst texels of some maps: the one place that says how bad a map is.
pub(crate) struct Worst<'a, const N: usize> {
    texels: [Texels; N],
    view: &'a View,
    /// Relative to the origin.
    eye: DVec3,
    /// Along each of a map's axes, for one pixel per unit at a depth of one.
    sides: [[f64; 2]; N],
}

impl<'a, const N: usize> Worst<'a, N> {
    /// Starts, with rows about an origin, and no point seen.
    pub(crate) fn of(texels: [Texels; N], view: &'a View, origin: DVec3) -> Self {
        Self { texels, view, eye: view.eye() - origin, sides: [[0.0; 2]; N] }
    }

    /// Takes in a point, relative to the origin.
    #[inline(always)]
    pub(crate) fn include(&mut self, q: DVec3) {
        let view = self.view;
        let depth = if view.is_perspective() { max(view.forward().dot(q - self.eye), view.near()) } else { 1.0 };
        for (worst, texels) in self.sides.iter_mut().zip(&self.texels) {
            for (worst, extent) in worst.iter_mut().zip(texels.at(q)) {
                let error = extent / depth;
                // A NaN counts, as infinite.
                let error = if error.is_nan() { f64::INFINITY } else { error };
                *worst = max(error, *worst);
            }
        }
    }

    /// The worst along each axis of each map, in pixels per texel.
    pub(crate) fn pixels(&self, viewport: [u32; 2]) -> [[f64; 2]; N] {
        let scale = self.view.pixels_per_unit_at_one(viewport);
        self.sides.map(|sides| sides.map(|side| side * scale))
    }
}
