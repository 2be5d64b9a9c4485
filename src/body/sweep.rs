//! What can shadow a body: its sweep towards the light, cut by the casters' box; and how high that reaches.

use glam::DVec3;

use super::{Body, ConvexBody};
use crate::error::Error;
use crate::light::{Directional, Light};
use crate::math::{min, sqrt};
use crate::plane::Plane;
use crate::scene::Bounds;

/// The casters' box cut by the sweep of a [`Body`] towards the light.
///
/// Capacity: the sweep of a body with `F = 12` faces is bounded by its `b` back faces and one plane for each of the `S`
/// edges between a back and a front face. Both kinds of faces hang together, so they share at least `b - 1` and
/// `F - b - 1` of the `3F - 6` edges among themselves, and `S <= 2F - 4 = 20`. Where `S` is that large, `b <= 10`:
/// no plane but these 30 cuts the box, which leaves at most 36 faces and 68 vertices.
pub type CasterBody = ConvexBody<68, 36>;

/// Two faces that meet at a sharper angle than this (radians) give no plane: it would have fewer than 10 good digits. The
/// sweep is then a little larger there.
const BLADE: f64 = 1e-6;

/// A body cut by the sweep of a box: 6 faces, of which at most 3 are hidden from the light, and at most 6 edges between.
type ShadedBody = ConvexBody<38, 21>;

impl<const V: usize, const F: usize> ConvexBody<V, F> {
    /// The planes that bound the sweep of this body along a direction, to infinity.
    ///
    /// A face that looks against the direction bounds the sweep too. An edge between a face that looks along the
    /// direction, `n1 . d > 0`, and one that does not, `n2 . d <= 0`, gives the plane `(n1.d) n2 - (n2.d) n1`: it
    /// passes through the edge, along the direction. As a combination of two half-spaces with positive factors it
    /// contains the body whatever the rounding, unlike one from the edge's own direction, which a sliver does not have.
    fn sweep_planes(&self, direction: DVec3) -> impl Iterator<Item = Plane> {
        let back = self.faces().map(|face| face.plane()).filter(move |plane| plane.normal().dot(direction) <= 0.0);
        let sides = (0..4 * self.len).filter(|half| half % 4 < 3).filter_map(move |half| {
            let twin = usize::from(self.corners[half / 4].twin[half % 4]);
            let plane = |half: usize| self.planes[usize::from(self.corners[half / 4].face[half % 4])];
            let (front, back) = (plane(half), plane(twin));
            let (along, against) = (front.normal().dot(direction), back.normal().dot(direction));
            let normal = back.normal() * along - front.normal() * against;
            let length = sqrt(normal.length_squared());
            let offset = back.offset() * along - front.offset() * against;
            let silhouette = along > 0.0 && against <= 0.0 && length > BLADE * (along - against);
            silhouette.then(|| Plane::from_unit(normal / length, offset / length))
        });
        back.chain(sides)
    }

    /// Copies a body into one with other capacity, about the same origin. The caller sees to it that it fits.
    fn resized<const V2: usize, const F2: usize>(&self, bounds: &Bounds) -> ConvexBody<V2, F2> {
        let mut copy = ConvexBody::from_box(bounds, self.origin);
        (copy.len, copy.planes_len) = (self.len, self.planes_len);
        for v in 0..self.len.min(V2) {
            (copy.points[v], copy.corners[v]) = (self.points[v], self.corners[v]);
        }
        for f in 0..self.planes_len.min(F2) {
            copy.planes[f] = self.planes[f];
        }
        copy
    }
}

impl Body {
    /// Returns all that can cast a shadow on this body: what lies between it and the light, in the casters' box.
    /// Exact; a few times the cost of a fit, which does not need it: for culling and drawing.
    ///
    /// The origin is that of this body. [`ConvexBody::faces`] has the planes to cull by.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for lights that are not directional.
    pub fn casters(&self, light: &Light, casters: &Bounds) -> Result<CasterBody, Error> {
        let light = light.as_directional()?;
        let mut body = CasterBody::from_box(casters, self.origin);
        if self.is_empty() {
            body.len = 0;
        }
        for plane in self.sweep_planes(light.to_light()) {
            // Capacity: see `CasterBody`.
            let _ = body.cut(&plane);
        }
        Ok(body)
    }

    /// Returns the greatest `(l . c - base)/w(c)` over all casters `c` of this body, for `w` affine, positive on the body and
    /// constant along the light direction `l`. `None` if there are none.
    ///
    /// Form: above a receiver `q` the casters end where the ray to the light leaves the box, at the first of
    /// at most three planes. So the answer is the maximum over the body of the least of three linear fractions. For each
    /// plane alone the maximum is at a vertex: the least of these three is a bound, and if a vertex attains it, it is the
    /// answer (two thirds of real cases). Otherwise the maximum is where two planes are left at once, on an edge,
    /// or all three: at the corner of the box, if that lies above the body.
    pub(crate) fn casters_reach(
        &self,
        light: &Directional,
        casters: &Bounds,
        base: f64,
        w: impl Fn(DVec3) -> f64,
    ) -> Option<f64> {
        let exit = Exit::new(light.to_light(), casters, self.origin);
        if exit.encloses(self.vertices()) {
            return exit.reach(self, base, w);
        }
        // Only that part of the body counts above which there is some of the box.
        let mut shaded: ShadedBody = self.resized(casters);
        let whole: ConvexBody<8, 6> = ConvexBody::from_box(casters, self.origin);
        for plane in whole.sweep_planes(-light.to_light()) {
            // Capacity: see `ShadedBody`.
            let _ = shaded.cut(&plane);
        }
        exit.reach(&shaded, base, w)
    }
}

/// Where rays to the light leave the casters' box.
struct Exit {
    to_light: DVec3,
    low: DVec3,
    high: DVec3,
    /// The corner that is furthest towards the light.
    corner: DVec3,
}

impl Exit {
    fn new(to_light: DVec3, casters: &Bounds, origin: DVec3) -> Self {
        let (low, high) = (casters.min() - origin, casters.max() - origin);
        Self { to_light, low, high, corner: DVec3::select(to_light.cmpgt(DVec3::ZERO), high, low) }
    }

    fn encloses(&self, points: &[DVec3]) -> bool {
        points.iter().all(|p| p.cmpge(self.low).all() && p.cmple(self.high).all())
    }

    /// How far along the ray from a point each of the planes is. Infinite for planes along the light.
    fn distances(&self, q: DVec3) -> [f64; 3] {
        let along = |gap: f64, l: f64| if l == 0.0 { f64::INFINITY } else { gap / l };
        let gap = self.corner - q;
        [along(gap.x, self.to_light.x), along(gap.y, self.to_light.y), along(gap.z, self.to_light.z)]
    }

    fn reach<const V: usize, const F: usize>(
        &self,
        body: &ConvexBody<V, F>,
        base: f64,
        w: impl Fn(DVec3) -> f64,
    ) -> Option<f64> {
        let least = |[a, b, c]: [f64; 3]| min(a, min(b, c));
        let value = |q: DVec3, distance: f64| (self.to_light.dot(q) - base + distance) / w(q);
        let mut bounds = [f64::NEG_INFINITY; 3];
        let mut best = f64::NEG_INFINITY;
        // Comparisons drop a NaN, which an infinite distance would give on an edge.
        let raise = |best: &mut f64, x: f64| {
            if x > *best {
                *best = x;
            }
        };
        for &q in body.vertices() {
            let distances = self.distances(q);
            for (bound, distance) in bounds.iter_mut().zip(distances) {
                raise(bound, value(q, distance));
            }
            raise(&mut best, value(q, least(distances)));
        }
        if best < least(bounds) {
            for (a, b) in body.edges() {
                let (p, q) = (body.points[a], body.points[b]);
                let (at_p, at_q) = (self.distances(p), self.distances(q));
                for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                    let (x, y) = (at_p[i] - at_p[j], at_q[i] - at_q[j]);
                    if x * y < 0.0 {
                        let crossing = p + (q - p) * (x / (x - y));
                        raise(&mut best, value(crossing, least(self.distances(crossing))));
                    }
                }
            }
            if body.sweep_planes(self.to_light).all(|plane| plane.distance(self.corner) <= 0.0) {
                raise(&mut best, value(self.corner, 0.0));
            }
        }
        (best > f64::NEG_INFINITY).then_some(best)
    }
}
