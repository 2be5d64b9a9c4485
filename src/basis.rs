//! Light space: the frame in which a shadow map of a directional light is a picture.

use glam::DVec3;

use crate::light::Directional;
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
    /// The light alone: the texel grid does not turn with the camera, and every entry of the matrix is continuous in
    /// the camera, also through light parallel to view. The price is a looser fit, with the warp askew over the
    /// texture, and a jump where the *light* passes through certain directions: see [`LightSpace::fixed_axes`].
    LightFixed,
}

/// The axes of light space, in world space: orthonormal, with `z = y x x`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSpace {
    /// Across the warp: `v x l`, normalised.
    pub x: DVec3,
    /// Towards the light: `l`.
    pub y: DVec3,
    /// Along the warp: the view direction made perpendicular to the light.
    pub z: DVec3,
    /// The sine of the angle between light and view; 0 where they are parallel or opposite.
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
    #[must_use]
    pub fn new(view: &View, light: &Directional) -> Self {
        let y = light.to_light();
        let across = unit_cross(view.forward(), y);
        let sine = sqrt(across.length_squared());
        if sine > 0.0 {
            let x = across / sine;
            return Self { x, y, z: y.cross(x), sin_gamma: sine };
        }
        let across = unit_cross(view.up(), y);
        let x = across / sqrt(across.length_squared());
        Self { x, y, z: y.cross(x), sin_gamma: 0.0 }
    }

    /// Returns two unit vectors perpendicular to `y` and to each other that depend on `y` alone, with the orientation
    /// of `x` and `z`. They jump where two of the coordinates of `y` change rank; somewhere every such choice must (a
    /// sphere cannot be combed).
    #[must_use]
    pub fn fixed_axes(&self) -> [DVec3; 2] {
        let size = self.y.abs();
        let least = size.min_element();
        let reference = match size.to_array().map(|s| s <= least) {
            [true, ..] => DVec3::X,
            [_, true, _] => DVec3::Y,
            _ => DVec3::Z,
        };
        let across = reference.cross(self.y);
        let x = across / sqrt(across.length_squared());
        [x, self.y.cross(x)]
    }
}
