//! The crate's prediction in `f64`: where a point lies in the map, in texels.

use shadow_warp::glam::{DMat3, DMat4, DVec2, DVec3, DVec4};
use shadow_warp::{ClipSpace, ShadowMap};

/// A map's matrix to texels and depth, for positions relative to an origin.
#[derive(Clone, Copy, Debug)]
pub struct Projection {
    x: DVec4,
    y: DVec4,
    z: DVec4,
    w: DVec4,
}

/// A place in a map.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// In texels from the corner of the first one; centres lie at halves.
    pub texel: DVec2,
    /// As the depth buffer holds it.
    pub depth: f64,
    /// The denominator.
    pub w: f64,
}

/// A plane: the points `q` with `normal . q = offset`, relative to the same origin.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// Of unit length.
    pub normal: DVec3,
    /// Along the normal.
    pub offset: f64,
}

impl Facet {
    /// Returns the plane of a triangle whose corners are relative to the same origin.
    #[must_use]
    pub fn of([a, b, c]: [DVec3; 3]) -> Self {
        let normal = (b - a).cross(c - a).normalize();
        Self { normal, offset: normal.dot(a) }
    }

    /// Returns where a line meets the plane, in lengths of its direction.
    #[must_use]
    pub fn meet(&self, origin: DVec3, direction: DVec3) -> f64 {
        (self.offset - self.normal.dot(origin)) / self.normal.dot(direction)
    }
}

impl Projection {
    /// Returns the projection of a map, in the conventions of an interface.
    #[must_use]
    pub fn new(map: &ShadowMap, origin: DVec3, space: ClipSpace) -> Self {
        let [width, height] = map.size().map(f64::from);
        let rows = map.texture_from_world_at(origin, space).transpose();
        Self { x: rows.x_axis * width, y: rows.y_axis * height, z: rows.z_axis, w: rows.w_axis }
    }

    /// Returns where a point lies.
    #[must_use]
    pub fn place(&self, q: DVec3) -> Place {
        let q = q.extend(1.0);
        let w = self.w.dot(q);
        Place { texel: DVec2::new(self.x.dot(q), self.y.dot(q)) / w, depth: self.z.dot(q) / w, w }
    }

    /// Returns how fast the place in texels changes with a point that moves.
    #[must_use]
    pub fn change(&self, q: DVec3, velocity: DVec3) -> DVec2 {
        let (place, v) = (self.place(q), velocity.extend(0.0));
        (DVec2::new(self.x.dot(v), self.y.dot(v)) - place.texel * self.w.dot(v)) / place.w
    }

    /// Returns the point of a plane that lies at a place of the map.
    #[must_use]
    pub fn on(&self, facet: &Facet, texel: DVec2) -> DVec3 {
        let (x, y) = (self.x - self.w * texel.x, self.y - self.w * texel.y);
        let rows = DMat3::from_cols(x.truncate(), y.truncate(), facet.normal).transpose();
        rows.inverse() * DVec3::new(-x.w, -y.w, facet.offset)
    }

    /// Returns `(x w, y w, w)` of a point, with its place `(x, y)` in texels.
    #[must_use]
    pub fn homogeneous(&self, q: DVec3) -> DVec3 {
        let q = q.extend(1.0);
        DVec3::new(self.x.dot(q), self.y.dot(q), self.w.dot(q))
    }

    /// Returns `(a, b, c)` with which depth on a plane is `a x + b y + c` at the place `(x, y)` in texels: a projective
    /// map takes a plane to a plane. Not finite for a plane along the light.
    #[must_use]
    pub fn depth_plane(&self, facet: &Facet) -> DVec3 {
        // On the plane z = a x + b y + c w, so as rows z = a x + b y + c w + d (normal, -offset).
        let rows = DMat4::from_cols(self.x, self.y, self.w, facet.normal.extend(-facet.offset));
        (rows.inverse() * self.z).truncate()
    }
}
