//! Light space: the frame in which a shadow map is a picture.

use glam::DVec3;

use crate::error::Error;
use crate::light::Light;
use crate::math::{sqrt, unit_cross};
use crate::view::View;

/// Which directions in light space the texture's axes follow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Axes {
    /// The view: the map's vertical axis is the view direction made perpendicular to the light, as in the papers. The
    /// tightest fit, with the warp along a texture axis. The axes turn about the light where the view passes through
    /// its direction, and no choice that follows the view can avoid that.
    #[default]
    View,
    /// The light alone: the texel grid does not turn with the camera. For a light at infinity, with
    /// [`Rule::Uniform`](crate::Rule::Uniform), LiSPSM and TSM every entry of the matrix is continuous in the camera, also through light parallel to view, about which their
    /// warps fade out (test `no_jumps_at_all_with_fixed_axes`). The price is a looser fit, with the warp askew over the
    /// texture, and a jump where the *light* passes through one direction: see [`LightSpace::fixed_axes`].
    LightFixed,
    /// The view's middle: as [`Axes::View`], with the unit vector from the eye to the middle of the receivers in place of the
    /// view direction, for the axes and for `sin_gamma` alike. Where most of what is seen lies to one side of the picture,
    /// the warp runs along it.
    ///
    /// The middle is the volume-weighted mean of the bodies' centroids. Where all bodies are flat their area counts, where all
    /// are lines their length, and it is continuous on the way from one to the other. A flat body beside a solid one counts
    /// next to nothing, and what lies in two bodies twice. Where the middle lies behind the eye, the view direction itself is
    /// taken. The fit takes some four times the instructions of that with [`Axes::View`].
    ///
    /// Source: Wimmer and Scherzer 2005, Sec. 4.4, who leave open which `gamma` goes with it; with the view's own the warp
    /// would not fade out where these axes turn.
    Middle,
    /// As [`Axes::Middle`], with the mean of the vertices of the receivers' bodies as their middle: fewer instructions. The map
    /// jumps where a body gains or loses a vertex (seen: by 1656 of 2048 texels).
    ///
    /// Source: Wimmer and Scherzer 2005, Sec. 4.4, the fast form.
    VertexMean,
}

/// The axes of light space, in world space: orthonormal, with `z = y x x`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSpace {
    /// Across the warp: `v x l`, normalised.
    pub x: DVec3,
    /// Towards the light: `l`; for a spot light against its direction.
    pub y: DVec3,
    /// Along the warp: the view direction made perpendicular to the light.
    pub z: DVec3,
    /// The sine of the angle between light and view; 0 where they are parallel or opposite. For a spot light: of the
    /// angle between the view and the way from the eye to the light, times the sine of that between the plane of
    /// these two and the plane across the spot's axis; 0 where the axes are not defined.
    pub sin_gamma: f64,
}

impl LightSpace {
    /// Returns the light space of a view.
    ///
    /// ```text
    /// Y = l    X = (v x l)/|v x l|    Z = Y x X = (v - (v.l) l)/|..|    sin gamma = |v x l|     [LiSPSM, Sec. 3.2]
    /// ```
    /// Form: `v x l` as `(v -+ l) x l`: near-parallel vectors have an exact difference, so that axes and sine keep
    /// a relative error of 1e-16 down to the smallest angles. `sqrt(1 - (v.l)^2)` has lost everything at 1e-8.
    /// Limits: with light and view exactly parallel there is no `Z`; the camera's up axis takes the place of `v`
    /// and `sin_gamma` is 0, which makes every published warp uniform.
    ///
    /// For a spot light, `Y` is against its direction, and `X` is the normal of the plane through the line of sight and
    /// the light, made perpendicular to `Y`. So `Z` is the direction of the picture of the line of sight in the light's own
    /// perspective: `Y x (v x (p - e))` for the light's place `p` and the eye `e`, its Plücker direction, which does not
    /// depend on the point of the line it is taken at, and has the right sign wherever the light shines, also when the eye
    /// is behind it.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for point lights, each face of which has its own: [`Point::faces`](crate::Point::faces).
    pub fn new(view: &View, light: &Light) -> Result<Self, Error> {
        Self::along(view.forward(), view, light)
    }

    /// As [`LightSpace::new`], with another unit direction in place of the view's: [`Axes::Middle`].
    pub(crate) fn along(direction: DVec3, view: &View, light: &Light) -> Result<Self, Error> {
        let y = match light {
            Light::Directional(light) => {
                let y = light.to_light();
                let across = unit_cross(direction, y);
                let sine = sqrt(across.length_squared());
                if sine > 0.0 {
                    let x = across / sine;
                    return Ok(Self { x, y, z: y.cross(x), sin_gamma: sine });
                }
                y
            }
            Light::Spot(light) => {
                let y = -light.direction();
                let to_light = light.position() - view.eye();
                let distance = sqrt(to_light.length_squared());
                // At the eye there is no direction to it.
                let normal = if distance > 0.0 { unit_cross(direction, to_light / distance) } else { DVec3::ZERO };
                let size = sqrt(normal.length_squared());
                let along = if size > 0.0 { unit_cross(y, normal / size) } else { DVec3::ZERO };
                let sine = sqrt(along.length_squared());
                // Below this all of it is the rounding of the normal.
                if sine > 4.0 * f64::EPSILON {
                    let z = along / sine;
                    return Ok(Self { x: z.cross(y), y, z, sin_gamma: size * sine });
                }
                y
            }
            Light::Point(_) => {
                return Err(Error::Unsupported {
                    requested: "one map for a point light",
                    use_instead: "a map for each of Point::faces",
                });
            }
        };
        // The up axis, or the right one where that is along the light too.
        let up = unit_cross(view.up(), y);
        let across = if up.length_squared() > 0.5 { up } else { unit_cross(view.right(), y) };
        let x = across / sqrt(across.length_squared());
        Ok(Self { x, y, z: y.cross(x), sin_gamma: 0.0 })
    }

    /// Returns two unit vectors perpendicular to `y` and to each other that depend on `y` alone, with the orientation
    /// of `x` and `z`: the world's x axis, turned with the world's y axis into `y`, the shorter way. They are continuous but
    /// for light from right below, against the world's y axis. (Somewhere every such choice must jump: a sphere cannot be
    /// combed.)
    ///
    /// Form: the turn takes the x axis to its mirror image in the plane across the sum of the y axis and `y`.
    #[must_use]
    pub fn fixed_axes(&self) -> [DVec3; 2] {
        let y = self.y;
        // 1 + y.y, for a unit vector: without its cancellation, opposite to the y axis.
        let rise = if y.y < 0.0 { (y.x * y.x + y.z * y.z) / (1.0 - y.y) } else { 1.0 + y.y };
        let half_way = DVec3::new(y.x, rise, y.z);
        let length = half_way.length_squared();
        let turned = if length > 0.0 { DVec3::X - half_way * (2.0 * half_way.x / length) } else { DVec3::X };
        // Next to that one direction rounding is all there is of the sum.
        let across = turned - y * turned.dot(y);
        let x = across / sqrt(across.length_squared());
        [x, y.cross(x)]
    }
}
