//! How far towards the light the casters of a body reach, without building their body.

use glam::{DVec3, DVec4};

use super::ConvexBody;
use super::clip;
use crate::math::{max, min};
use crate::plane::Plane;
use crate::scene::Bounds;

/// Looks for the greatest `height(c)/w(c)` over all casters `c` of a body, for affine functions
/// given as rows: `height` grows by one per unit towards the light, `w` is constant in that
/// direction and positive on the body. Positions are relative to the origin of these rows, from
/// where that of the body is at `shift`.
///
/// Above a receiver `q` the casters end where the ray to the light leaves the casters' box, at the
/// first of at most three planes. So the answer is the maximum over the body of the least of three
/// linear fractions. For each plane alone the maximum is at a vertex: the least of these three is a
/// bound, and if a vertex attains it, it is the answer. Otherwise the maximum may be where two
/// planes are left at once, on an edge, or all three: at the corner of the box, if that lies above
/// the body.
///
/// # Rounding
/// A caster straight above a receiver to within rounding casts a shadow on it, so it must not be
/// lost. Take light that is nearly parallel to a side of the box, and a receiver on that side. By
/// the numbers its ray leaves the box anywhere between here and the top, as the last bit of either
/// likes. So the box is widened by [`SLACK`] of the receivers' greatest coordinate, and the light
/// turned from each of its sides by as much in radians: what a point moves by when its coordinates
/// and the light's are rounded. The answer is never less than the exact one, and greater by at most
/// `2 sqrt(3) SLACK` of lengths where the light is not that close to a side.
pub(crate) struct Reach<const V: usize = 20> {
    height: DVec4,
    w: DVec4,
    to_light: DVec3,
    shift: DVec3,
    /// The corner of the box that is furthest towards the light.
    corner: DVec3,
    /// The same of the widened box; [`NEVER`] in directions perpendicular to the light.
    wide_corner: DVec3,
    /// The reciprocals of the coordinates of the light, turned from the sides; 1 for those that are
    /// [`NEVER`] reached.
    per_length: DVec3,
    /// What positions of the body are known to.
    slack: f64,
    /// The three fractions of each vertex seen, the greatest of each, and the greatest of their
    /// least.
    fractions: [[f64; 3]; V],
    bounds: [f64; 3],
    best: f64,
}

/// Twice what a body may be beyond a plane that cuts it: once for the receivers, once for the
/// casters.
const SLACK: f64 = 2.0 * clip::SLACK;

/// The distance of a plane along the light: further than any other, and finite, so that no
/// difference of two is NaN.
const NEVER: f64 = 1e150;

/// A body of up to 20 faces cut by the sweep of a box: at most 3 of its 6 faces look against the
/// sweep, with 6 edges around them. A face that lies along the sweep takes one plane, and those of
/// its own edges away: so 9 planes, whatever the direction.
type ShadedBody = ConvexBody<54, 29>;

impl<const V: usize> Reach<V> {
    /// Starts the search, with no vertex seen. The rows are relative to `origin`.
    #[inline(always)]
    pub(crate) fn above<const F: usize>(
        body: &ConvexBody<V, F>,
        to_light: DVec3,
        casters: &Bounds,
        origin: DVec3,
        [height, w]: [DVec4; 2],
    ) -> Self {
        let shift = body.origin - origin;
        let slack = SLACK * (body.size + shift.abs().max_element());
        let (low, high) = (casters.min() - origin, casters.max() - origin);
        let l = to_light;
        let mut reach = Self {
            height,
            w,
            to_light,
            shift,
            corner: DVec3::select(l.cmpgt(DVec3::ZERO), high, low),
            wide_corner: DVec3::splat(NEVER),
            per_length: DVec3::ONE,
            slack,
            fractions: [[f64::NEG_INFINITY; 3]; V],
            bounds: [f64::NEG_INFINITY; 3],
            best: f64::NEG_INFINITY,
        };
        for axis in 0..3 {
            if l[axis] > SLACK {
                reach.wide_corner[axis] = high[axis] + slack;
                reach.per_length[axis] = 1.0 / (l[axis] - SLACK);
            } else if l[axis] < -SLACK {
                reach.wide_corner[axis] = low[axis] - slack;
                reach.per_length[axis] = 1.0 / (l[axis] + SLACK);
            }
        }
        reach
    }

    /// Takes a vertex of the body in, with its own `height` and `1/w`.
    #[inline(always)]
    pub(crate) fn include(&mut self, vertex: usize, q: DVec3, height: f64, per_w: f64) {
        let fractions = self.distances(q).map(|distance| (height + distance) * per_w);
        self.fractions[vertex] = fractions;
        self.best = max(least(fractions), self.best);
        for axis in 0..3 {
            self.bounds[axis] = max(fractions[axis], self.bounds[axis]);
        }
    }

    /// Returns the answer for a body inside the casters' box, all of whose vertices have been taken
    /// in.
    #[inline(always)]
    pub(crate) fn of_enclosed<const F: usize>(&self, body: &ConvexBody<V, F>) -> f64 {
        if self.best >= least(self.bounds) { self.best } else { self.beyond_vertices(body) }
    }

    fn beyond_vertices<const F: usize>(&self, body: &ConvexBody<V, F>) -> f64 {
        let mut best = self.best;
        // On an edge, each fraction is between its values at the ends: all three must be better
        // than the best so far at one of the ends.
        let mut better = [0_u8; V];
        for (better, fractions) in better.iter_mut().zip(&self.fractions[..body.len]) {
            let better_by = |axis: usize| u8::from(fractions[axis] > best) << axis;
            *better = better_by(0) | better_by(1) | better_by(2);
        }
        for (a, next) in body.next[..body.len].iter().enumerate() {
            for edge in 0..3 {
                let b = usize::from(next[edge] >> 2);
                if better[a] | better[b] == 0b111 && a < b {
                    best = max(self.best_on_edge(body.points[a] + self.shift, body.points[b] + self.shift), best);
                }
            }
        }
        let corner = self.corner.extend(1.0);
        let at_corner = min(self.height.dot(corner) / self.w.dot(corner), least(self.bounds));
        if at_corner > best && self.corner_is_above(body) { at_corner } else { best }
    }

    /// The best of the points of an edge from which the ray leaves through two planes at once.
    ///
    /// Form: all that counts there is a mean of its values at the ends, with positive weights and
    /// distances, so that no digit is lost however flat the light is to a plane. The point itself,
    /// put into the planes, would lose them.
    #[cold]
    fn best_on_edge(&self, p: DVec3, q: DVec3) -> f64 {
        let mut best = f64::NEG_INFINITY;
        let (at_p, at_q) = (self.distances(p), self.distances(q));
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let (x, y) = (at_p[i] - at_p[j], at_q[i] - at_q[j]);
            if (x < 0.0 && y > 0.0) || (x > 0.0 && y < 0.0) {
                let (of_p, of_q) = (y / (y - x), x / (x - y));
                let mean = |a: f64, b: f64| of_p * a + of_q * b;
                let distance = least([0, 1, 2].map(|axis| mean(at_p[axis], at_q[axis])));
                let of_row = |row: DVec4| mean(row.dot(p.extend(1.0)), row.dot(q.extend(1.0)));
                best = max((of_row(self.height) + distance) / of_row(self.w), best);
            }
        }
        best
    }

    /// Whether the line from the box's corner along the light meets the body, to within rounding.
    fn corner_is_above<const F: usize>(&self, body: &ConvexBody<V, F>) -> bool {
        if self.wide_corner.max_element() >= NEVER {
            return false;
        }
        let corner = self.corner - self.shift;
        let slack = self.slack + SLACK * corner.abs().max_element();
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        for plane in body.bounding_planes() {
            let (beyond, rate) = (plane.distance(corner) - slack, plane.normal().dot(self.to_light));
            if rate > 0.0 {
                enter = max(beyond / rate, enter);
            } else if rate < 0.0 {
                leave = min(beyond / rate, leave);
            } else if beyond > 0.0 {
                return false;
            }
        }
        enter <= leave
    }

    /// How far from a point each of the three planes is, along the ray to the light.
    #[inline(always)]
    fn distances(&self, q: DVec3) -> [f64; 3] {
        ((self.wide_corner - q) * self.per_length).to_array()
    }
}

impl<const V: usize> Reach<V> {
    /// Returns the answer for any body of up to 20 faces; minus infinity if it has no casters.
    #[cold]
    pub(crate) fn of_any<const F: usize>(&self, body: &ConvexBody<V, F>, casters: &Bounds) -> f64 {
        let () = ConvexBody::<V, F>::NO_WIDER;
        // Only that part of the body counts above which there is some of the box.
        let mut shaded: ShadedBody = body.resized();
        let whole: ConvexBody<8, 6> = ConvexBody::box_about(casters, body.origin);
        // Wider by a rounding of the coordinates, so that a box without width is not missed.
        let size = max(body.size, whole.size);
        for plane in whole.sweep_planes(-self.to_light) {
            let plane = Plane::from_unit(plane.normal(), plane.offset() + SLACK * size);
            // Capacity: see `ShadedBody`.
            let _ = shaded.cut(&plane);
        }
        let origin = body.origin - self.shift;
        let mut reach = Reach::above(&shaded, self.to_light, casters, origin, [self.height, self.w]);
        for (vertex, point) in shaded.vertices().iter().enumerate() {
            let q = *point + self.shift;
            reach.include(vertex, q, self.height.dot(q.extend(1.0)), 1.0 / self.w.dot(q.extend(1.0)));
        }
        reach.of_enclosed(&shaded)
    }
}

impl<const V: usize, const F: usize> ConvexBody<V, F> {
    /// Whether the box that the body was cut from lies inside another one. Says no for some bodies
    /// that are inside.
    #[inline(always)]
    pub(crate) fn is_inside(&self, bounds: &Bounds) -> bool {
        let (low, high) = (bounds.min() - self.origin, bounds.max() - self.origin);
        let side = |plane: usize| self.planes[plane].offset();
        -side(0) >= low.x
            && side(1) <= high.x
            && -side(2) >= low.y
            && side(3) <= high.y
            && -side(4) >= low.z
            && side(5) <= high.z
    }
}

fn least([a, b, c]: [f64; 3]) -> f64 {
    min(a, min(b, c))
}
