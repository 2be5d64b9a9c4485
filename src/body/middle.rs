//! The middle of bodies: their centroid, also where they are flat.

use glam::DVec3;

use super::ConvexBody;
use crate::math::{max, sqrt};

/// How much the area of a body's surface counts against its volume, its edges against its area, and its vertices against its
/// edges, in units of the body's size. Half of the digits: a volume of so much is known to as many digits as are left.
const LESSER: f64 = 1.0 / (1 << 26) as f64;

/// Weighted sums of positions, relative to a point: of volume, surface, edges and vertices at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Middle {
    /// The unit of length: its fourth power must not overflow, as those of world units may.
    unit: f64,
    /// The greatest extent of any of the bodies, in units.
    size: f64,
    weight: f64,
    sum: DVec3,
}

impl Middle {
    /// Nothing yet. The greatest distance from the point is a good unit. `extent`: the greatest extent of any of the bodies
    /// along an axis of the world.
    pub(crate) fn new(unit: f64, extent: f64) -> Self {
        Self { unit, size: extent / unit, weight: 0.0, sum: DVec3::ZERO }
    }

    /// Takes in a body whose origin is at `shift` from the point.
    ///
    /// ```text
    /// weight = V + e s A + (e s)^2 L + (e s)^3           s: the greatest extent of any body, e = 2^-26
    /// ```
    /// So this is the volume's centroid to some 1e-7 of the size where there is a volume, the surface's where all bodies are
    /// flat, that of the edges where all are lines; and continuous on the way from one to the other. (The last term's is the
    /// mean of the vertices, which jumps as vertices come and go: by 1e-23 of the size where there is a volume.)
    pub(crate) fn include<const V: usize, const F: usize>(&mut self, body: &ConvexBody<V, F>, shift: DVec3) {
        let points = body.vertices();
        let count = points.len() as f64;
        // Any point within would do.
        let apex = points.iter().sum::<DVec3>() / max(count, 1.0);
        let place = |p: DVec3| (p - apex) / self.unit;
        let less = LESSER * self.size;
        let (mut weight, mut sum) = (0.0, DVec3::ZERO);
        // Relative to the apex, in units.
        let mut add = |share: f64, middle: DVec3| {
            weight += share;
            sum += share * middle;
        };
        for [a, b, c] in body.faces().flat_map(|face| face.triangles()) {
            let [a, b, c] = [a, b, c].map(place);
            let twice_area = (b - a).cross(c - a);
            let corners = a + b + c;
            // The tetrahedron below, whose fourth corner is the apex.
            add(max(a.dot(twice_area) / 6.0, 0.0), corners / 4.0);
            add(0.5 * less * sqrt(twice_area.length_squared()), corners / 3.0);
        }
        for (start, end) in body.edges() {
            let (a, b) = (place(points[start]), place(points[end]));
            add(less * less * sqrt((b - a).length_squared()), 0.5 * (a + b));
        }
        // The apex is the vertices' mean.
        add(less * less * less, DVec3::ZERO);
        self.weight += weight;
        self.sum += sum + weight * ((apex + shift) / self.unit);
    }

    /// The middle of all, relative to the point, in units; `None` of what has no size at all.
    pub(crate) fn get(&self) -> Option<DVec3> {
        let middle = self.sum / self.weight;
        middle.is_finite().then_some(middle)
    }
}
