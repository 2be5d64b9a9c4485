//! What can shadow a body: its sweep towards the light, cut by the casters' box.

use glam::DVec3;

use super::clip::Scratch;
use super::{Body, ConvexBody, WideBody, after};
use crate::error::Error;
use crate::light::{Directional, Light};
use crate::math::{max, sqrt};
use crate::plane::Plane;
use crate::scene::Bounds;

/// The casters' box cut by the sweep of a [`Body`] towards the light.
///
/// Capacity: the sweep of a body with `F` faces is bounded by its `b` back faces and one plane for
/// each of the `S` edges between a back and a front face. Of the three edges at a vertex at most
/// two are between faces of different kinds, so `S` is at most the number of vertices, `2F - 4`.
/// Where all faces but one are back faces, `S` is the number of that one's edges, at most `F - 1`.
/// So `b + S <= max(F - 2 + 2F - 4, F - 1 + F - 1) = 3F - 6`, whatever the signs. With the six
/// planes of the box that makes `3F` faces and `6F - 4` vertices: 36 and 68 for the 12 faces of a
/// [`Body`].
pub type CasterBody = ConvexBody<68, 36>;

/// The casters' box cut by the sweep of a [`WideBody`] towards the light: `3F` faces and `6F - 4`
/// vertices, as for a [`CasterBody`], with `F = 20`.
pub type WideCasterBody = ConvexBody<116, 60>;

/// The planes of two faces that meet at a sharper angle than this, in radians, leave fewer than 10
/// good digits to one between.
const BLADE: f64 = 1e-6;

impl<const V: usize, const F: usize> ConvexBody<V, F> {
    /// The planes that bound the sweep of this body along a unit direction, to infinity.
    ///
    /// A face that looks against the direction, or lies along it, bounds the sweep too. An edge
    /// between a face that looks along the direction, `n1 . d > 0`, and one that looks against it,
    /// `n2 . d < 0`, gives the plane `(n1.d) n2 - (n2.d) n1`: it passes through the edge, along the
    /// direction. Where two faces meet like a blade this cancels, and the edge itself gives the
    /// normal. Either way the plane is then made to be along the direction and moved to touch the
    /// body, so that it contains the sweep whatever rounding has done to the normal.
    pub(super) fn sweep_planes(&self, direction: DVec3) -> impl Iterator<Item = Plane> {
        let back = self.faces().map(|face| face.plane()).filter(move |plane| plane.normal().dot(direction) <= 0.0);
        let sides = self.halves().filter_map(move |half| {
            let next = self.next(half);
            let (front, back) = (self.planes[self.left(half)].normal(), self.planes[self.left(after(next))].normal());
            let (along, against) = (front.dot(direction), back.dot(direction));
            if along <= 0.0 || against >= 0.0 {
                return None;
            }
            let between = unit(back * along - front * against, BLADE * (along - against));
            let normal = between.or_else(|| {
                let edge = self.points[next >> 2] - self.points[half >> 2];
                unit(edge.cross(direction), 0.0)
            })?;
            let normal = unit(normal - direction * normal.dot(direction), 0.5)?;
            Some(Plane::from_unit(normal, self.bounds_along(normal)?[1]))
        });
        back.chain(sides)
    }
}

impl Body {
    /// Returns all that can cast a shadow on this body: what lies between it and the light, in the
    /// casters' box. Exact; a few times the cost of a fit, which does not need it: for culling and
    /// drawing.
    ///
    /// The origin is that of this body. [`ConvexBody::faces`] has the planes to cull by. Where the
    /// body turns no area to the light, so that no shadow on it can be seen, or its sweep only
    /// touches the box, the result may be flat or empty.
    ///
    /// ```
    /// # use shadow_warp::{Body, Bounds, Light, View, glam::{DVec3, dvec3}};
    /// # let view = View::perspective(dvec3(0.0, 2.0, 0.0), DVec3::Z, DVec3::Y, 1.0, 1.5, 0.1..100.0)?;
    /// let light = Light::directional(dvec3(0.5, 1.0, 0.0))?;
    /// let scene = Bounds::new(dvec3(-50.0, 0.0, -50.0), dvec3(50.0, 10.0, 50.0))?;
    /// let casters = Body::visible(&view, &scene).casters(&light, &scene)?;
    ///
    /// // To cull: a sphere casts no visible shadow if it is beyond one of the planes, here taken relative to the eye.
    /// let planes = casters.faces().map(|face| face.plane().relative_to(view.eye() - casters.origin()));
    /// let (centre, radius) = (dvec3(10.0, 5.0, 20.0) - view.eye(), 1.0);
    /// assert!(planes.map(|plane| plane.distance(centre)).all(|distance| distance <= radius));
    /// # Ok::<(), shadow_warp::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Unsupported`] for lights that are not directional.
    pub fn casters(&self, light: &Light, casters: &Bounds) -> Result<CasterBody, Error> {
        self.casters_in(light, casters)
    }
}

impl WideBody {
    /// Returns all that can cast a shadow on this body, as for a [`Body`].
    ///
    /// # Errors
    /// [`Error::Unsupported`] for lights that are not directional.
    pub fn casters(&self, light: &Light, casters: &Bounds) -> Result<WideCasterBody, Error> {
        self.casters_in(light, casters)
    }
}

impl<const V: usize, const F: usize> ConvexBody<V, F> {
    fn casters_in<const V2: usize, const F2: usize>(
        &self,
        light: &Light,
        casters: &Bounds,
    ) -> Result<ConvexBody<V2, F2>, Error> {
        let light = light.as_directional()?;
        let exact = self.swept(light, casters, 0.0);
        // A flat box may have been cut away whole by rounding.
        if exact.is_empty() && casters.min().cmpeq(casters.max()).any() && self.volume() > 0.0 {
            return Ok(self.swept(light, casters, 8.0 * f64::EPSILON * self.size_with(casters)));
        }
        Ok(exact)
    }

    /// The casters' box cut by the sweep, whose planes are moved out by a margin.
    fn swept<const V2: usize, const F2: usize>(
        &self,
        light: &Directional,
        casters: &Bounds,
        margin: f64,
    ) -> ConvexBody<V2, F2> {
        let mut body = ConvexBody::box_about(casters, self.origin);
        let mut scratch = Scratch::new();
        if self.is_empty() {
            body.len = 0;
        }
        for plane in self.sweep_planes(light.to_light()) {
            let plane = Plane::from_unit(plane.normal(), plane.offset() + margin);
            // Capacity: see `CasterBody`. Every bit counts: a box may be very much larger than what
            // it shadows.
            let _ = body.cut_within(&plane, &mut scratch, 0.0);
        }
        body
    }

    /// The greatest coordinate of this body and the casters' box, about the origin.
    pub(super) fn size_with(&self, casters: &Bounds) -> f64 {
        let corners = [casters.min() - self.origin, casters.max() - self.origin];
        corners.iter().chain(self.vertices()).fold(0.0, |size, p| max(p.abs().max_element(), size))
    }
}

/// The unit vector along `v`, if `v` is longer than this.
fn unit(v: DVec3, least: f64) -> Option<DVec3> {
    let length = sqrt(v.length_squared());
    (length > least).then(|| v / length)
}

#[cfg(test)]
mod tests {
    use glam::dvec3;

    use super::*;

    /// A trough of strips that touch the parabola `z = x^2` from below, under a roof of two faces.
    /// Seen from above the roof is all: a silhouette with as many edges as there can be.
    fn trough<const V: usize, const F: usize>(strips: u8) -> Result<ConvexBody<V, F>, Error> {
        let mut body = ConvexBody::from_box(&Bounds::new(DVec3::splat(-10.0), DVec3::splat(10.0))?, DVec3::ZERO)?;
        for y in [-1.0, 1.0] {
            body.cut(&Plane::new(dvec3(0.0, y, 1.0), DVec3::Z)?)?;
        }
        for strip in 0..strips {
            let x = (2.0 * f64::from(strip) + 1.0) / f64::from(strips) - 1.0;
            body.cut(&Plane::new(dvec3(2.0 * x, 0.0, -1.0), dvec3(x, 0.0, x * x))?)?;
        }
        Ok(body)
    }

    fn casters<const V: usize, const F: usize, const V2: usize, const F2: usize>(
        strips: u8,
    ) -> Result<[usize; 2], Error> {
        let body: ConvexBody<V, F> = trough(strips)?;
        assert_eq!(body.faces().count(), usize::from(strips) + 2);
        // Takes the ends of the trough, its lowest edge and the eaves' furthest points.
        let bounds = Bounds::new(dvec3(-0.99, -1.0, -0.001), dvec3(0.99, 1.0, 5.0))?;
        let casters: ConvexBody<V2, F2> = body.casters_in(&Light::directional(DVec3::Z)?, &bounds)?;
        Ok([casters.faces().count(), casters.vertices().len()])
    }

    #[test]
    fn a_trough_has_casters_with_as_many_faces_as_can_be() -> Result<(), Error> {
        // The six faces of the box that a trough is cut from are gone, but not their places.
        assert_eq!(casters::<32, 18, 68, 36>(10)?, [36, 68]);
        assert_eq!(casters::<48, 26, 116, 60>(18)?, [60, 116]);
        Ok(())
    }
}
