//! Convex polyhedra of fixed capacity: what is seen, and what can shadow it.

mod clip;
mod face;
mod face_set;
mod lit;
mod middle;
mod reach;
mod sweep;

pub use lit::LitBody;
pub(crate) use middle::Middle;
pub(crate) use reach::Reach;
pub use sweep::{CasterBody, WideCasterBody};

use glam::DVec3;

use self::clip::{SLACK, Scratch};
pub use self::face::Face;
use self::face_set::FaceSet;

use crate::error::{Error, require_position};
use crate::math::{max, min};
use crate::plane::Plane;
use crate::scene::Bounds;
use crate::view::View;

/// A bounded convex polyhedron with at most `V` vertices and `F` faces, or nothing.
///
/// Vertices and planes are relative to [`ConvexBody::origin`], a point close by in world space, so
/// that a body keeps its accuracy wherever it lies in the world.
///
/// # Representation
/// A *simple* polytope: every vertex lies on exactly three faces and has three neighbours. Where
/// more than three planes meet in a point, several vertices share the position. A cut keeps a
/// simple polytope simple as long as the kept and the removed vertices each hang together; signs
/// spoiled by rounding are mended so that they do. So the body is always closed and `V - E + F =
/// 2`, whatever the numbers. (Lists of polygons, clipped one by one, break at planes through
/// vertices and edges.)
///
/// # Capacity
/// A simple polytope with `f` faces has `2f - 4` vertices and `3f - 6` edges (Euler, with `3v =
/// 2e`). A cut adds one face, and its new vertices go where removed ones were, so a body that
/// starts as a box and is cut by `k` planes never has more than `2(6 + k) - 4` vertices.
///
/// | body | planes | `F` | `V` |
/// |---|---|---|---|
/// | [`Body`] | a box, a view | 6 + 6 = 12 | 20 |
/// | [`WideBody`] | and the engine's own | 12 + 8 = 20 | 36 |
/// | [`LitBody`] | and a lamp's near plane, range and eight sides | 20 + 10 = 30 | 56 |
/// | [`CasterBody`] of a [`Body`] | `3F`: see there | 36 | 68 |
/// | [`WideCasterBody`] of a [`WideBody`] | `3F` | 60 | 116 |
/// | all that may come | those of a lit body, 9 of what a box of casters can shadow, 2 of a slab of depths | 41 | 78 |
/// | casters of that | `3F` | 123 | 242 |
///
/// A set of faces is one word of 64 bits up to `F = 64`, which bounds a body whose casters are
/// wanted to `F <= 21`; and two words up to `F = 128`, enough for the last row. Vertices are
/// numbered in a byte: `V <= 255`.
#[derive(Clone, Copy, Debug)]
pub struct ConvexBody<const V: usize, const F: usize> {
    origin: DVec3,
    /// The greatest coordinate of the box that it was cut from: what rounding is measured by.
    size: f64,
    len: usize,
    planes_len: usize,
    points: [DVec3; V],
    /// Half-edges: the three at vertex `v`, on their way out, counter-clockwise seen from outside,
    /// have the numbers `4 v` to `4 v + 2`. Here stands the number of the half-edge that follows
    /// along the face to the left. It starts where this one ends; counter-clockwise after it comes
    /// this one's twin, the way back.
    next: [[u16; 4]; V],
    /// The face to the left: between this half-edge and the next one counter-clockwise.
    left: [[u8; 4]; V],
    planes: [Plane; F],
}

/// A box cut by the six planes of a view: at most 12 faces, 20 vertices, 30 edges.
pub type Body = ConvexBody<20, 12>;

/// A [`Body`] with room for eight more planes, the engine's own: a mirror, a portal, a zone. At
/// most 20 faces, 36 vertices, 54 edges.
///
/// ```
/// use shadow_warp::{Bounds, Plane, View, WideBody, glam::DVec3};
/// let view = View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, 1.0, 1.5, 0.1..100.0)?;
/// let bounds = Bounds::new(DVec3::splat(-50.0), DVec3::splat(50.0))?;
/// let mut body = WideBody::visible(&view, &bounds);
/// // Nothing beyond a wall 20 units ahead. Planes are relative to the body's origin.
/// body.cut(&Plane::new(DVec3::Z, DVec3::Z * 20.0)?.relative_to(body.origin()))?;
/// assert!(body.bounds_along(DVec3::Z).is_some_and(|[_, far]| far <= 20.0));
/// # Ok::<(), shadow_warp::Error>(())
/// ```
pub type WideBody = ConvexBody<36, 20>;

/// No more than these shares of a perspective camera's near distance count as on a plane. Its near
/// and far plane may be one to the rounding of the box: then 10 bits of the distance are left. Its
/// sides are not nearly parallel.
const NEAR_SLACK: f64 = 1.0 / 1024.0;
const SIDE_SLACK: f64 = 1.0 / (1_u64 << 43) as f64;

/// `next` and `left` of a box. Bit `a` of a vertex's number says whether it lies at the greater end
/// of axis `a`; face `2 a + bit` likewise. Vertices with an odd number of bits see their edges
/// along x, y, z counter-clockwise; the others x, z, y.
const BOX: ([[u16; 4]; 8], [[u8; 4]; 8]) = {
    let (mut next, mut left) = ([[0; 4]; 8], [[0; 4]; 8]);
    let mut v = 0;
    while v < 8 {
        let odd = (v & 1) ^ (v >> 1 & 1) ^ (v >> 2 & 1) == 1;
        let axes: [usize; 3] = if odd { [0, 1, 2] } else { [0, 2, 1] };
        let mut edge = 0;
        while edge < 3 {
            let neighbour = v ^ (1 << axes[edge]);
            let third = axes[(edge + 2) % 3];
            let twin = 4 * neighbour + [0, 2, 1][edge];
            next[v][edge] = before(twin) as u16;
            left[v][edge] = (2 * third + (v >> third & 1)) as u8;
            edge += 1;
        }
        v += 1;
    }
    (next, left)
};

impl<const V: usize, const F: usize> ConvexBody<V, F> {
    const ROOM_FOR_A_BOX: () = assert!(V >= 8 && V <= 255 && F >= 6 && F <= FaceSet::<F>::MOST);
    const ROOM_FOR_A_VIEW: () = assert!(V >= 20 && F >= 12, "a box cut by a view may have 12 faces and 20 vertices");

    /// What [`LitBody`] and the part below a box of casters have room for, beside their own planes.
    const NO_WIDER: () = assert!(F <= 20, "for bodies of up to 20 faces");

    /// Returns a box, with coordinates relative to `origin`.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `origin` is finite, with coordinates of at most 1e100.
    pub fn from_box(bounds: &Bounds, origin: DVec3) -> Result<Self, Error> {
        require_position(origin, "origin")?;
        Ok(Self::box_about(bounds, origin))
    }

    pub(crate) fn box_about(bounds: &Bounds, origin: DVec3) -> Self {
        Self::between(bounds.min() - origin, bounds.max() - origin, origin)
    }

    /// The box between two corners, given relative to its origin; empty if they are not in order.
    #[inline(always)]
    fn between(low: DVec3, high: DVec3, origin: DVec3) -> Self {
        let () = Self::ROOM_FOR_A_BOX;
        let mut body = Self {
            origin,
            size: low.abs().max(high.abs()).max_element(),
            len: if low.cmple(high).all() { 8 } else { 0 },
            planes_len: 6,
            points: [DVec3::ZERO; V],
            next: [[0; 4]; V],
            left: [[0; 4]; V],
            planes: [Plane::UNUSED; F],
        };
        body.next[..8].copy_from_slice(&BOX.0);
        body.left[..8].copy_from_slice(&BOX.1);
        for (v, point) in body.points[..8].iter_mut().enumerate() {
            *point = DVec3::new(
                if v & 1 == 0 { low.x } else { high.x },
                if v & 2 == 0 { low.y } else { high.y },
                if v & 4 == 0 { low.z } else { high.z },
            );
        }
        body.planes[..6].copy_from_slice(&[
            Plane::from_unit(DVec3::NEG_X, -low.x),
            Plane::from_unit(DVec3::X, high.x),
            Plane::from_unit(DVec3::NEG_Y, -low.y),
            Plane::from_unit(DVec3::Y, high.y),
            Plane::from_unit(DVec3::NEG_Z, -low.z),
            Plane::from_unit(DVec3::Z, high.z),
        ]);
        body
    }

    /// Returns what a camera can see of a box: the box cut by the view volume. May be empty. As a
    /// [`Body`], or as a [`WideBody`] with room for planes of the engine's own.
    ///
    /// The origin is the point of the box closest to the eye: the eye itself where it is inside.
    /// The view's planes go through it then without rounding, and a small box far away keeps its
    /// own accuracy.
    ///
    /// ```
    /// use shadow_warp::{Body, Bounds, View, glam::DVec3};
    /// let view = View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, 90f64.to_radians(), 1.0, 1.0..3.0)?;
    /// let body = Body::visible(&view, &Bounds::new(DVec3::splat(-10.0), DVec3::splat(10.0))?);
    /// // A frustum: thirds of 3 * 6^2 less 1 * 2^2.
    /// assert!((body.volume() - (3.0 * 36.0 - 4.0) / 3.0).abs() < 1e-13);
    /// # Ok::<(), shadow_warp::Error>(())
    /// ```
    #[must_use]
    pub fn visible(view: &View, bounds: &Bounds) -> Self {
        let () = Self::ROOM_FOR_A_VIEW;
        let origin = view.eye().clamp(bounds.min(), bounds.max());
        let to_eye = view.eye() - origin;
        // No more of the box than the view can reach, so that a box without measure leaves the
        // numbers their digits.
        let reach = DVec3::splat(view.reach());
        let low = (bounds.min() - origin).max(to_eye - reach);
        let high = (bounds.max() - origin).min(to_eye + reach);
        let mut body = Self::between(low, high, origin);
        let mut scratch = Scratch::new();
        // However large the box, what is close to a perspective camera keeps its own digits.
        let most = |share: f64| if view.is_perspective() { share * view.near() } else { f64::INFINITY };
        let [of_sides, of_ends] = [SIDE_SLACK, NEAR_SLACK].map(|share| min(SLACK * body.size, most(share)));
        for plane in view.planes() {
            // The sides of a perspective camera pass through the eye.
            let slack = if plane.offset().abs() > 0.0 { of_ends } else { of_sides };
            let plane = plane.relative_to(-to_eye);
            // The corner of the box that is furthest along the normal tells most planes apart
            // without a cut.
            let furthest = (plane.normal() * low).max(plane.normal() * high).element_sum();
            if furthest > plane.offset() {
                // A box cut by six planes has room: 20 vertices, 12 faces.
                let _ = body.cut_within(&plane, &mut scratch, slack);
            }
        }
        body
    }

    /// Returns the point in world space that vertices and planes are relative to.
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Returns whether there is nothing left. A flat body is not empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the vertices, relative to [`ConvexBody::origin`]. Several may share a position.
    #[must_use]
    pub fn vertices(&self) -> &[DVec3] {
        &self.points[..self.len]
    }

    /// Returns the edges, each once, as pairs of indices into [`ConvexBody::vertices`].
    pub fn edges(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.halves().map(|half| (half >> 2, self.next(half) >> 2)).filter(|(start, end)| start < end)
    }

    /// Returns the faces.
    pub fn faces(&self) -> impl Iterator<Item = Face<'_, V, F>> {
        let mut seen = FaceSet::<F>::NONE;
        self.halves().filter_map(move |start| {
            let plane = self.left(start);
            seen.insert(plane).then_some(Face { body: self, plane, start })
        })
    }

    /// Returns whether a point, relative to [`ConvexBody::origin`], is inside or on the border.
    #[must_use]
    pub fn contains(&self, point: DVec3) -> bool {
        !self.is_empty() && self.bounding_planes().iter().all(|plane| plane.distance(point) <= 0.0)
    }

    /// Returns the least and greatest `direction . p` over the body: its bounds along an axis.
    /// `None` if empty.
    #[must_use]
    pub fn bounds_along(&self, direction: DVec3) -> Option<[f64; 2]> {
        let along = |p: &DVec3| direction.dot(*p);
        let first = self.vertices().first().map(along)?;
        Some(self.vertices().iter().map(along).fold([first; 2], |[low, high], x| [min(low, x), max(high, x)]))
    }

    /// Returns the vertex that lies furthest along `direction`. `None` if empty.
    #[must_use]
    pub fn support(&self, direction: DVec3) -> Option<DVec3> {
        let further = |a: DVec3, b: DVec3| if direction.dot(b) > direction.dot(a) { b } else { a };
        self.vertices().iter().copied().reduce(further)
    }

    /// Returns the volume, by the divergence theorem over the faces. 0 if flat or empty.
    ///
    /// Accuracy: relative to the volume of the box around the body, a few roundings.
    #[must_use]
    pub fn volume(&self) -> f64 {
        let Some(&apex) = self.vertices().first() else { return 0.0 };
        let six_volumes = self.faces().flat_map(|face| face.triangles()).map(|[a, b, c]| {
            // Relative to a vertex of the body, so that nothing is lost where the origin is far.
            (a - apex).dot((b - apex).cross(c - apex))
        });
        max(six_volumes.sum::<f64>() / 6.0, 0.0)
    }

    /// Copies a body into one with other capacity, about the same origin. The caller sees to it
    /// that it fits.
    fn resized<const V2: usize, const F2: usize>(&self) -> ConvexBody<V2, F2> {
        let mut copy = ConvexBody {
            origin: self.origin,
            size: self.size,
            len: self.len.min(V2),
            planes_len: self.planes_len.min(F2),
            points: [DVec3::ZERO; V2],
            next: [[0; 4]; V2],
            left: [[0; 4]; V2],
            planes: [Plane::UNUSED; F2],
        };
        copy.points[..copy.len].copy_from_slice(&self.points[..copy.len]);
        copy.next[..copy.len].copy_from_slice(&self.next[..copy.len]);
        copy.left[..copy.len].copy_from_slice(&self.left[..copy.len]);
        copy.planes[..copy.planes_len].copy_from_slice(&self.planes[..copy.planes_len]);
        copy
    }

    /// The numbers of all half-edges.
    fn halves(&self) -> impl Iterator<Item = usize> + use<V, F> {
        (0..4 * self.len).filter(|half| half & 3 < 3)
    }

    #[inline(always)]
    fn next(&self, half: usize) -> usize {
        usize::from(self.next.as_flattened()[half])
    }

    #[inline(always)]
    fn set_next(&mut self, half: usize, next: usize) {
        self.next.as_flattened_mut()[half] = next as u16;
    }

    #[inline(always)]
    fn left(&self, half: usize) -> usize {
        usize::from(self.left.as_flattened()[half])
    }

    /// All planes that the body was cut by and that are still stored: first those of the box it was
    /// made from, which are never replaced. Some may have no face any more; each of them holds for
    /// the whole body.
    fn bounding_planes(&self) -> &[Plane] {
        &self.planes[..self.planes_len]
    }
}

/// The half-edge before this one, counter-clockwise around the same vertex.
const fn before(half: usize) -> usize {
    if half & 3 == 0 { half + 2 } else { half - 1 }
}

/// The half-edge after this one, counter-clockwise around the same vertex.
const fn after(half: usize) -> usize {
    if half & 3 == 2 { half - 2 } else { half + 1 }
}

impl Body {
    /// Returns the same body with room for eight more planes.
    #[must_use]
    pub fn widened(&self) -> WideBody {
        self.resized()
    }
}

impl From<Body> for WideBody {
    fn from(body: Body) -> Self {
        body.widened()
    }
}
