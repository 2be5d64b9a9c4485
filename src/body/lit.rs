//! What of a body a light with a position can shine on, and what of a box a map shows.

use glam::{DVec3, DVec4};

use super::clip::Scratch;
use super::{Body, ConvexBody};
use crate::basis::LightSpace;
use crate::light::Light;
use crate::math::sqrt;
use crate::plane::Plane;
use crate::scene::Bounds;

/// A [`Body`] or [`WideBody`](super::WideBody) cut by the near plane, the far plane and the eight
/// sides of a spot light: at most 30 faces, 56 vertices.
pub type LitBody = ConvexBody<56, 30>;

impl<const V: usize, const F: usize> ConvexBody<V, F> {
    /// Returns the part of this body that a light can shine on, as far as the light's own shape
    /// says: all of it at infinity, and for a point light; for a spot light what lies in its cone,
    /// between near and range. The cone is taken as the pyramid of eight sides about it, two of
    /// them across each of the axes of light space, which must be that of this light. May be empty.
    /// For bodies of up to 20 faces.
    #[must_use]
    pub fn lit_by(&self, light: &Light, space: &LightSpace) -> LitBody {
        self.lit_into(light, space)
    }

    /// Calls `f` with the vertices of [`ConvexBody::lit_by`]. A [`Body`] needs room for 22 faces only, and less time.
    #[inline(always)]
    pub(crate) fn with_lit(&self, light: &Light, space: &LightSpace, f: impl FnOnce(&[DVec3])) {
        if V <= 20 && F <= 12 {
            f(self.lit_into::<40, 22>(light, space).vertices());
        } else {
            f(self.lit_by(light, space).vertices());
        }
    }

    fn lit_into<const V2: usize, const F2: usize>(&self, light: &Light, space: &LightSpace) -> ConvexBody<V2, F2> {
        let () = Self::NO_WIDER;
        let mut lit = self.resized();
        if let Light::Spot(spot) = light {
            let mut scratch = Scratch::new();
            for plane in spot.planes(self.origin(), [space.x, space.z]) {
                // Capacity: see `LitBody`.
                let _ = lit.cut_with(&plane, &mut scratch);
            }
        }
        lit
    }
}

impl Body {
    /// The part of a box where some rows, about an origin, are not negative: at most six. Wider by
    /// a rounding of the coordinates, so that a box without width is not missed.
    pub(crate) fn where_positive(bounds: &Bounds, origin: DVec3, rows: &[DVec4]) -> Self {
        let mut body = Self::box_about(bounds, origin);
        let size = (bounds.min() - origin).abs().max((bounds.max() - origin).abs()).max_element();
        let mut scratch = Scratch::new();
        for row in rows {
            let length = sqrt(row.truncate().length_squared());
            if length > 0.0 {
                let margin = 8.0 * f64::EPSILON * (size + row.w.abs() / length);
                // A box cut by six planes has room.
                let plane = Plane::from_unit(-row.truncate() / length, row.w / length + margin);
                let _ = body.cut_with(&plane, &mut scratch);
            }
        }
        body
    }
}
