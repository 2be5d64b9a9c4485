//! The faces of a body.

use glam::DVec3;

use super::ConvexBody;
use crate::plane::Plane;

/// A face of a body: its plane, and its corners in counter-clockwise order, seen from outside.
#[derive(Clone, Copy, Debug)]
pub struct Face<'a, const V: usize, const F: usize> {
    pub(super) body: &'a ConvexBody<V, F>,
    pub(super) plane: usize,
    pub(super) start: usize,
}

impl<'a, const V: usize, const F: usize> Face<'a, V, F> {
    /// Returns the plane of the face, with outward normal, relative to [`ConvexBody::origin`].
    #[must_use]
    pub fn plane(&self) -> Plane {
        self.body.planes[self.plane]
    }

    /// Returns the indices of the corners, counter-clockwise seen from outside.
    pub fn corners(&self) -> impl Iterator<Item = usize> + use<'a, V, F> {
        let (body, start) = (self.body, self.start);
        let following = move |&half: &usize| Some(body.next(half)).filter(|&next| next != start);
        core::iter::successors(Some(start), following).map(|half| half >> 2)
    }

    /// Returns the triangles of a fan over the face, counter-clockwise seen from outside.
    pub fn triangles(&self) -> impl Iterator<Item = [DVec3; 3]> + use<'a, V, F> {
        let points = &self.body.points;
        let first = points[self.start >> 2];
        let rest = self.corners().skip(1);
        rest.zip(self.corners().skip(2)).map(move |(a, b)| [first, points[a], points[b]])
    }
}
