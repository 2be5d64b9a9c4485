//! What a ray meets first: the truth that pictures are compared with, in `f64`.

use std::ops::Range;

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::Bvh;
use bvh::ray::Ray;
use nalgebra::{Point3, Vector3};
use shadow_warp::glam::DVec3;

/// The triangles of a scene, ready for rays.
pub struct Rays {
    shapes: Vec<Shape>,
    tree: Bvh<f64, 3>,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// How far along, in lengths of the ray's direction.
    pub distance: f64,
    /// Which triangle.
    pub triangle: usize,
}

struct Shape {
    corners: [DVec3; 3],
    index: usize,
    node: usize,
}

impl Bounded<f64, 3> for Shape {
    fn aabb(&self) -> Aabb<f64, 3> {
        let [a, b, c] = self.corners;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        // A flat box may be missed by a ray along it.
        let room = DVec3::splat(1e-9 * (1.0 + low.abs().max(high.abs()).max_element()));
        Aabb::with_bounds(point(low - room), point(high + room))
    }
}

impl BHShape<f64, 3> for Shape {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl Rays {
    /// Sorts a scene's triangles.
    #[must_use]
    pub fn new(triangles: impl Iterator<Item = [DVec3; 3]>) -> Self {
        let shape = |(index, corners)| Shape { corners, index, node: 0 };
        let mut shapes: Vec<Shape> = triangles.enumerate().map(shape).collect();
        let tree = Bvh::build(&mut shapes);
        Self { shapes, tree }
    }

    /// Returns what a ray meets first after `least`, from either side.
    #[must_use]
    pub fn first(&self, origin: DVec3, direction: DVec3, least: f64) -> Option<Hit> {
        let hits = self.candidates(origin, direction).filter_map(|shape| {
            let distance = meet(&shape.corners, origin, direction)?;
            (distance > least).then_some(Hit { distance, triangle: shape.index })
        });
        hits.min_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    /// Returns whether a ray meets anything between two distances, from either side.
    #[must_use]
    pub fn is_blocked(&self, origin: DVec3, direction: DVec3, between: Range<f64>) -> bool {
        let is_between = |distance| between.start < distance && distance < between.end;
        let blocks = |shape: &Shape| meet(&shape.corners, origin, direction).is_some_and(is_between);
        self.candidates(origin, direction).any(blocks)
    }

    fn candidates(&self, origin: DVec3, direction: DVec3) -> impl Iterator<Item = &Shape> {
        let ray = Ray::new(point(origin), Vector3::from(direction.to_array()));
        self.tree.traverse(&ray, &self.shapes).into_iter()
    }
}

/// The distance at which a line meets a triangle (Moeller and Trumbore 1997).
fn meet([a, b, c]: &[DVec3; 3], origin: DVec3, direction: DVec3) -> Option<f64> {
    let (along, up) = (*b - *a, *c - *a);
    let normal = direction.cross(up);
    let volume = along.dot(normal);
    let from = origin - *a;
    let (u, turned) = (from.dot(normal) / volume, from.cross(along));
    let v = direction.dot(turned) / volume;
    // A triangle seen edge-on gives numbers that are none, and is not met.
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| up.dot(turned) / volume)
}

fn point(p: DVec3) -> Point3<f64> {
    Point3::from(p.to_array())
}
