//! Perspective shadow maps: the light's view of the scene in the camera's post-perspective space.

use glam::{DVec3, DVec4};

use crate::body::ConvexBody;
use crate::error::{Error, require};
use crate::math::{max, min, sqrt};
use crate::view::{Lens, Sides, View};

/// How a perspective shadow map looks at post-perspective space.
///
/// The map depends on the convention of that space, since what is a right angle there depends on it: here depth goes from -1
/// to 1 between the least and greatest depth of what is seen, as in OpenGL and in the paper. (With 0 to 1, the pole
/// behind the eye would be four times nearer.) Texture axes: across and along the plane through the line of sight and the
/// light.
///
/// ```text
/// L = M (l, w_l)     D = L3 - W c      w = D.(L3 w_c - W q)/D.D      h = D.(q - c w_c)      u, v = a, b.(q - c w_c)
/// ```
/// with the camera's matrix `M`, the point `(q, w_c)` and the light `(L3, W)` in its clip space, a point `c` that is aimed
/// at, `a` and `b` perpendicular to `D`; depth is `h/w`, and grows towards the light. One matrix for a light
/// before the eye (`W > 0`, a point light in that space), beside it (`W = 0`, a light at infinity) and behind it (`W < 0`, where
/// light rays run towards it): `D.(L3 w_c - W q)` is positive on the body in each case, and no depth test is
/// reversed. Nor does a caster behind the eye need the camera moved back: nothing is divided by `w_c` on the way, so all of
/// a light ray stays in its texel, in order.
///
/// Form: about the plane at infinity, where a light at infinity has `L3.z = 0` and the far plane `-2n/(f - n)`, so that
/// nothing cancels at great depth ratios; `W c` by its limits, so that nothing is divided by `W`. For a light along the view
/// `w` is constant, exactly.
///
/// Source: M. Stamminger, G. Drettakis, Perspective Shadow Maps, 2002.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PerspectiveRule {
    /// Where the light looks.
    pub aim: Aim,
    /// How far the camera of the post-perspective space stands behind the real one, in world units: 0 in the paper, unless
    /// something in front of which it must be reaches behind it (see [`PerspectiveRule::least_shift`]). Moved back by
    /// `sqrt(n f)`, with the light perpendicular to the view, this is LiSPSM's map; further back it becomes
    /// the uniform one.
    pub shift: f64,
}

/// Where the light of a perspective shadow map looks in post-perspective space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Aim {
    /// At the point of the camera's cube that is closest to it: what is seen lies in front of the light then, whatever its
    /// direction, unless it stands within the cube. With the light in the picture that is straight along the view, and the map is a uniform one; just beside
    /// the picture the warp is at its strongest, with a ratio of up to some `(f/n)^1.5`, and refused above 1e8.
    #[default]
    Closest,
    /// At the middle of the cube, as in the paper. Refused where a part of what is seen then lies behind the light: mostly
    /// where it stands in the picture, or opposite.
    Centre,
}

impl PerspectiveRule {
    /// Returns how far the camera must be moved back so that a body lies in its view volume, from its near plane on, for
    /// whoever renders in post-perspective space: in world units.
    ///
    /// ```text
    /// max(0, n - z, x/right - z, x/left - z, y/top - z, y/bottom - z)   over the vertices
    /// ```
    /// Exact: each term is what one plane of the volume needs. The near distance is then to be kept where it was in the
    /// world, not at the camera: the slab between near and far would else vanish as `2 n (f - n)/shift^2`.
    ///
    /// Source: Stamminger and Drettakis 2002, Sec. 4.2, for the near plane.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for orthographic cameras, and for a side of the volume that leans inward.
    pub fn least_shift<const V: usize, const F: usize>(view: &View, body: &ConvexBody<V, F>) -> Result<f64, Error> {
        let refused = Err(Error::Unsupported {
            requested: "moving a camera back whose view volume does not widen on all sides",
            use_instead: "Rule::LISPSM",
        });
        let Lens::Perspective(Sides { left, right, bottom, top }) = view.lens() else { return refused };
        if !(left < 0.0 && right > 0.0 && bottom < 0.0 && top > 0.0) {
            return refused;
        }
        let shift = body.origin() - view.eye();
        let needs = body.vertices().iter().map(|vertex| {
            let q = *vertex + shift;
            let [x, y, z] = [view.right(), view.up(), view.forward()].map(|axis| axis.dot(q));
            max(view.near(), max(max(x / right, x / left), max(y / top, y / bottom))) - z
        });
        Ok(needs.fold(0.0, max))
    }
}

/// The rows of the map before it is fitted, about an origin: `u`, `v`, height `h`, and `w`.
pub(crate) fn rows(
    rule: PerspectiveRule,
    view: &View,
    origin: DVec3,
    light: DVec4,
    [near, far]: [f64; 2],
) -> Result<[DVec4; 4], Error> {
    let Lens::Perspective(sides) = view.lens() else { return Err(inside(rule.aim)) };
    require(rule.shift >= 0.0 && rule.shift <= crate::error::MAX_LENGTH, "shift", "must be between 0 and 1e100")?;
    let eye = view.eye() - view.forward() * rule.shift - origin;
    let n = near + rule.shift;
    // A body of one depth counts as one of some.
    let f = max(far + rule.shift, n * (1.0 + 1.0 / (1 << 20) as f64));
    let along = |axis: DVec3| axis.extend(-axis.dot(eye));
    let depth = along(view.forward());
    let across = |axis: DVec3, low: f64, high: f64| (2.0 * along(axis) - (low + high) * depth) / (high - low);
    // The camera's clip space, less the plane at infinity: z = -2 f n/(f - n).
    let clip = [
        across(view.right(), sides.left, sides.right),
        across(view.up(), sides.bottom, sides.top),
        DVec4::W * (-2.0 * n / (1.0 - n / f)),
    ];
    let cube = [DVec3::new(-1.0, -1.0, -2.0 / (1.0 - n / f)), DVec3::new(1.0, 1.0, -2.0 * (n / f) / (1.0 - n / f))];
    let l3 = DVec3::from(clip.map(|row| row.dot(light)));
    let w_l = depth.dot(light);

    let (c, w_c) = match rule.aim {
        Aim::Centre => {
            let c = 0.5 * (cube[0] + cube[1]);
            (c, w_l * c)
        }
        Aim::Closest => {
            let (mut c, mut w_c) = (DVec3::ZERO, DVec3::ZERO);
            for axis in 0..3 {
                let ends = [cube[0][axis], cube[1][axis]];
                let scaled = ends.map(|end| w_l * end);
                let [low, high] = [min(scaled[0], scaled[1]), max(scaled[0], scaled[1])];
                // W clamp(L/W), and clamp(L/W) itself, without a quotient of small numbers.
                w_c[axis] = min(max(l3[axis], low), high);
                c[axis] =
                    if w_l == 0.0 { 0.5 * (ends[0] + ends[1]) } else { min(max(l3[axis] / w_l, ends[0]), ends[1]) };
            }
            (c, w_c)
        }
    };
    let d = l3 - w_c;
    let length = sqrt(d.length_squared());
    if length <= 64.0 * f64::EPSILON * max(l3.abs().max_element(), w_l.abs()) {
        return Err(inside(rule.aim));
    }
    let d = d / length;
    // Perpendicular to the plane through the line of sight and the light, as far as the aim lets it.
    let normal = DVec3::new(-l3.y, l3.x, 0.0);
    let normal = normal - d * normal.dot(d);
    let size = sqrt(normal.length_squared());
    let a = if size > 0.0 { normal / size } else { any_perpendicular(d) };
    let b = d.cross(a);

    let combine = |weights: DVec3| weights.x * clip[0] + weights.y * clip[1] + weights.z * clip[2];
    let aimed = |axis: DVec3| combine(axis) - axis.dot(c) * depth;
    Ok([aimed(a), aimed(b), aimed(d), d.dot(l3) * depth - w_l * combine(d)])
}

/// A unit vector perpendicular to a unit vector: across, for the view direction.
fn any_perpendicular(d: DVec3) -> DVec3 {
    let across = if d.x.abs() < 0.5 { DVec3::X } else { DVec3::Y };
    let across = across - d * across.dot(d);
    across / sqrt(across.length_squared())
}

/// Where an aim does not have all that is seen before the light.
pub(crate) const fn inside(aim: Aim) -> Error {
    Error::Unsupported {
        requested: "a perspective shadow map whose light is too close to what is seen, or within it, in the camera's space",
        use_instead: match aim {
            Aim::Closest => "Rule::OPTIMAL",
            Aim::Centre => "Aim::Closest, or Rule::OPTIMAL",
        },
    }
}
