//! A naive oracle for convex bodies: half-spaces, brute force, nothing shared with the library's cuts.

#![allow(dead_code, reason = "each test file uses a part")]

use std::collections::{HashMap, HashSet};

use shadow_warp::glam::{DVec2, DVec3};
use shadow_warp::{Bounds, ConvexBody, Plane, View};

/// Twice the relative error of one rounding.
pub(crate) const EPS: f64 = f64::EPSILON;

/// A box and half-spaces, in the coordinates of the body they are compared with.
#[derive(Clone, Debug)]
pub(crate) struct HalfSpaces {
    pub(crate) low: DVec3,
    pub(crate) high: DVec3,
    /// Outward unit normals and offsets; the six of the box are not among them.
    pub(crate) planes: Vec<(DVec3, f64)>,
}

impl HalfSpaces {
    pub(crate) fn of_box(bounds: &Bounds, origin: DVec3) -> Self {
        Self { low: bounds.min() - origin, high: bounds.max() - origin, planes: Vec::new() }
    }

    pub(crate) fn of_view(view: &View, bounds: &Bounds, origin: DVec3) -> Self {
        let mut all = Self::of_box(bounds, origin);
        for plane in view.planes() {
            all.add(&plane.relative_to(origin - view.eye()));
        }
        all
    }

    pub(crate) fn add(&mut self, plane: &Plane) {
        self.planes.push((plane.normal(), plane.offset()));
    }

    /// The planes drawn in by `by`; the box stays as it is, so that flat boxes keep their points.
    pub(crate) fn shrunk(&self, by: f64) -> Self {
        let planes = self.planes.iter().map(|&(normal, offset)| (normal, offset - by)).collect();
        Self { planes, ..self.clone() }
    }

    /// The unit of all absolute tolerances: the greatest coordinate in the box.
    pub(crate) fn size(&self) -> f64 {
        self.low.abs().max(self.high.abs()).max_element()
    }

    pub(crate) fn box_area(&self) -> f64 {
        let d = self.high - self.low;
        2.0 * (d.x * d.y + d.y * d.z + d.z * d.x)
    }

    pub(crate) fn box_volume(&self) -> f64 {
        (self.high - self.low).element_product()
    }

    /// All planes, those of the box first.
    pub(crate) fn all(&self) -> Vec<(DVec3, f64)> {
        let mut all = Vec::with_capacity(6 + self.planes.len());
        for axis in DVec3::AXES {
            all.push((-axis, -axis.dot(self.low)));
            all.push((axis, axis.dot(self.high)));
        }
        all.extend(&self.planes);
        all
    }

    /// How far a point lies beyond the plane that it violates most; negative inside.
    pub(crate) fn beyond(&self, p: DVec3) -> f64 {
        self.all().iter().map(|(normal, offset)| normal.dot(p) - offset).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The points where three planes meet, moved into the box, with their determinant: how well they meet, up to 1.
    fn meetings(&self) -> Vec<(DVec3, f64)> {
        let all = self.all();
        let mut found = Vec::new();
        for (i, &(n_i, d_i)) in all.iter().enumerate() {
            for (j, &(n_j, d_j)) in all[..i].iter().enumerate() {
                let across = n_i.cross(n_j);
                for &(n_k, d_k) in &all[..j] {
                    let determinant = across.dot(n_k);
                    let p = (d_k * across + d_i * n_j.cross(n_k) + d_j * n_k.cross(n_i)) / determinant;
                    if determinant.abs() > 0.0 && p.is_finite() {
                        found.push((p.clamp(self.low, self.high), determinant.abs()));
                    }
                }
            }
        }
        found
    }

    fn beyond_planes(&self, p: DVec3) -> f64 {
        self.planes.iter().map(|(normal, offset)| normal.dot(p) - offset).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The points where three planes meet that are beyond no plane by more than the tolerance. However badly three
    /// planes meet, a point that passes is a point of the body to that tolerance: it is tested, not trusted.
    pub(crate) fn vertices(&self, tolerance: f64) -> Vec<DVec3> {
        self.meetings().into_iter().map(|(p, _)| p).filter(|p| self.beyond_planes(*p) <= tolerance).collect()
    }

    /// The volume, as the integral of the area of slices. Between the heights of neighbouring vertices that area is
    /// quadratic in height, so Gauss' rule with two points is exact; it asks for no slice through a face. Where planes meet
    /// badly a height may be off, and slices must be thinner.
    pub(crate) fn volume(&self) -> f64 {
        // A height too many does no harm, so the less digits a point has the more it may be off.
        let near =
            |p: DVec3, determinant: f64| self.beyond_planes(p) <= self.size() * (1e-6 + 64.0 * EPS / determinant);
        let mut heights = vec![self.low.z, self.high.z];
        let mut worst = 1.0_f64;
        for (p, determinant) in self.meetings().into_iter().filter(|&(p, determinant)| near(p, determinant)) {
            heights.push(p.z);
            // Planes that are parallel but for rounding meet in no edge.
            worst = if determinant > 1e-14 { worst.min(determinant) } else { worst };
        }
        heights.sort_by(f64::total_cmp);
        let pieces = if worst < 1e-6 { 8 } else { 1 };
        // What rounding takes from a sum of thousands of slices is kept aside.
        let (mut volume, mut excess) = (0.0, 0.0);
        for pair in heights.windows(2) {
            let half = 0.5 * (pair[1] - pair[0]) / f64::from(pieces);
            for piece in 0..if half > 0.0 { pieces } else { 0 } {
                let middle = pair[0] + half * f64::from(2 * piece + 1);
                let step = half * (1.0_f64 / 3.0).sqrt();
                let slice = half * (self.slice_area(middle - step) + self.slice_area(middle + step)) - excess;
                let sum = volume + slice;
                (volume, excess) = (sum, (sum - volume) - slice);
            }
        }
        volume
    }

    /// The area of the body's slice at a height: a rectangle, clipped by one half-plane after the other.
    fn slice_area(&self, z: f64) -> f64 {
        let (a, b) = (self.low.truncate(), self.high.truncate());
        let mut polygon = vec![a, DVec2::new(b.x, a.y), b, DVec2::new(a.x, b.y)];
        for (normal, offset) in &self.planes {
            let beyond = |p: DVec2| normal.dot(p.extend(z)) - offset;
            if polygon.iter().all(|&p| beyond(p) <= 0.0) {
                continue;
            }
            let mut kept = Vec::with_capacity(polygon.len() + 1);
            for (i, &q) in polygon.iter().enumerate() {
                let p = polygon[(i + polygon.len() - 1) % polygon.len()];
                let (at_p, at_q) = (beyond(p), beyond(q));
                if (at_p > 0.0) != (at_q > 0.0) {
                    kept.push(p + (q - p) * (at_p / (at_p - at_q)));
                }
                if at_q <= 0.0 {
                    kept.push(q);
                }
            }
            polygon = kept;
        }
        let Some(&first) = polygon.first() else { return 0.0 };
        0.5 * polygon.windows(2).map(|e| (e[0] - first).perp_dot(e[1] - first)).sum::<f64>()
    }

    /// How close a ray comes to the body: the least of [`HalfSpaces::beyond`] over `p + s direction`, `s >= 0`. It is
    /// the greatest of linear functions of `s`: convex, and least at 0 or where two of them meet.
    pub(crate) fn least_beyond_on_ray(&self, p: DVec3, direction: DVec3) -> f64 {
        let lines: Vec<[f64; 2]> =
            self.all().iter().map(|(normal, offset)| [normal.dot(p) - offset, normal.dot(direction)]).collect();
        let greatest = |s: f64| lines.iter().map(|[at, slope]| at + slope * s).fold(f64::NEG_INFINITY, f64::max);
        let mut least = greatest(0.0);
        for (i, [a, a_slope]) in lines.iter().enumerate() {
            for [b, b_slope] in &lines[..i] {
                let s = (b - a) / (a_slope - b_slope);
                if s > 0.0 && s.is_finite() {
                    least = least.min(greatest(s));
                }
            }
        }
        least
    }
}

/// The greatest `direction . p` over points; `None` if there are none.
pub(crate) fn support(points: &[DVec3], direction: DVec3) -> Option<f64> {
    points.iter().map(|p| direction.dot(*p)).reduce(f64::max)
}

/// The greatest deviations of a body from a closed convex one, in its own units.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Deviation {
    /// Of a corner from the plane of its face.
    pub(crate) off_plane: f64,
    /// Of a vertex beyond a face's plane.
    pub(crate) beyond: f64,
    /// Of a face's turn the wrong way: the height of its corner over the longer of the two edges there, times the
    /// sine of the angle between the faces that meet in this edge. (Faces in one plane may share it as rounding
    /// likes.)
    pub(crate) reflex: f64,
}

impl Deviation {
    pub(crate) fn greatest(self) -> f64 {
        self.off_plane.max(self.beyond).max(self.reflex)
    }
}

/// Asserts that a body is a closed simple polytope, by its public face and edge lists alone, and measures how far its
/// numbers are from that of a convex one. An empty body must have nothing.
pub(crate) fn assert_closed<const V: usize, const F: usize>(body: &ConvexBody<V, F>) -> Deviation {
    let points = body.vertices();
    let vertices = points.len();
    let mut deviation = Deviation::default();
    let (mut half_edges, mut faces, mut uses) = (HashMap::new(), 0, vec![0; vertices]);
    for face in body.faces() {
        faces += 1;
        let plane = face.plane();
        assert!((plane.normal().length() - 1.0).abs() < 4.0 * EPS, "a face without a unit normal: {plane:?}");
        // A walk that never came back would be endless.
        let corners: Vec<usize> = face.corners().take(vertices + 1).collect();
        assert!((3..=vertices).contains(&corners.len()), "a face of {} corners", corners.len());
        for (i, &b) in corners.iter().enumerate() {
            let a = corners[(i + corners.len() - 1) % corners.len()];
            let c = corners[(i + 1) % corners.len()];
            uses[b] += 1;
            let turn = (points[b] - points[a]).cross(points[c] - points[b]).dot(plane.normal());
            let other = half_edges.insert((b, c), (a, turn, plane.normal()));
            assert!(other.is_none(), "two faces on one side of an edge: {:?}", (b, c));
            deviation.off_plane = deviation.off_plane.max(plane.distance(points[b]).abs());
        }
        for p in points {
            deviation.beyond = deviation.beyond.max(plane.distance(*p));
        }
    }
    for (&(b, c), &(a, turn, normal)) in &half_edges {
        assert!(half_edges.contains_key(&(c, b)), "an edge with a face on one side only: {:?}", (b, c));
        assert!(half_edges.contains_key(&(b, a)), "an edge with a face on one side only: {:?}", (a, b));
        let (beside_out, beside_into) = (half_edges[&(c, b)].2, half_edges[&(b, a)].2);
        let (into, out) = (points[a].distance(points[b]), points[b].distance(points[c]));
        let (longer, across) = if into > out { (into, beside_into) } else { (out, beside_out) };
        if longer > 0.0 {
            deviation.reflex = deviation.reflex.max(-turn / longer * across.cross(normal).length());
        }
    }
    assert!(uses.iter().all(|&faces| faces == 3), "a vertex that is not on three faces: {uses:?}");
    let edges: Vec<(usize, usize)> = body.edges().collect();
    assert!(edges.iter().all(|edge| half_edges.contains_key(edge)), "an edge without faces");
    assert_eq!(edges.iter().collect::<HashSet<_>>().len(), edges.len(), "an edge listed twice");
    assert_eq!(2 * edges.len(), half_edges.len());
    assert_eq!(body.is_empty(), vertices == 0);
    if body.is_empty() {
        assert_eq!((faces, edges.len()), (0, 0));
    } else {
        assert_eq!(vertices + faces, edges.len() + 2, "Euler's formula");
        assert!(vertices <= V && faces <= F);
    }
    deviation
}
