//! From view, light and bodies to a shadow map.

use glam::{DVec2, DVec3, DVec4};

use crate::aliasing;
use crate::basis::{Axes, LightSpace};
use crate::body::Body;
use crate::error::{Error, require};
use crate::light::{Directional, Light};
use crate::map::ShadowMap;
use crate::math::{max, min};
use crate::scene::Bounds;
use crate::view::View;
use crate::warp::{Rule, Slab};

/// Where the map's near plane lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum NearDepth {
    /// At the caster closest to the light: nothing is clipped.
    #[default]
    Casters,
    /// At the receiver closest to the light: the best depth precision, for engines that clamp the depth of what lies
    /// before it ("depth clamp", "pancaking").
    Receivers,
}

/// A job: everything a shadow map depends on but the [`Rule`].
///
/// `receivers` are bodies that a shadow is to be seen on: usually [`Body::visible`] of one box, or of several, whose
/// union counts. They are borrowed, so that lights under one view share them. `casters` bounds all that casts shadows.
#[derive(Clone, Copy, Debug)]
pub struct Fit<'a> {
    /// The camera.
    pub view: &'a View,
    /// The light.
    pub light: &'a Light,
    /// Bounds of all that casts shadows.
    pub casters: &'a Bounds,
    /// What shadows are to be seen on; several bodies count as their union.
    pub receivers: &'a [Body],
    /// The size of the map, `[width, height]` in texels. By default 1024 x 1024.
    pub map_size: [u32; 2],
    /// The size of the picture that is seen, `[width, height]` in pixels. By default 1920 x 1080. Only errors depend on it.
    pub viewport: [u32; 2],
    /// Which directions the texture's axes follow.
    pub axes: Axes,
    /// Where the near plane lies.
    pub near_depth: NearDepth,
}

/// The least and greatest value seen.
#[derive(Clone, Copy)]
struct Extent {
    low: f64,
    high: f64,
}

impl Extent {
    const NONE: Self = Self { low: f64::INFINITY, high: f64::NEG_INFINITY };

    #[inline(always)]
    fn include(&mut self, x: f64) {
        self.low = min(x, self.low);
        self.high = max(x, self.high);
    }

    fn size(self) -> f64 {
        self.high - self.low
    }

    fn middle(self) -> f64 {
        0.5 * (self.low + self.high)
    }

    /// Widened about its middle to at least this size.
    fn at_least(self, size: f64) -> Self {
        let lack = 0.5 * max(size - self.size(), 0.0);
        Self { low: self.low - lack, high: self.high + lack }
    }
}

/// A flat body is fitted as if it were this much of its greatest extent thick. A smaller extent is mostly rounding: of
/// the order of 2^-52 of the greatest one, which leaves 32 bits at this size.
const LEAST_ASPECT: f64 = 1.0 / (1 << 20) as f64;
/// A body is fitted as if it were at least this much of its distance from the eye in size: the rounding of its position.
const LEAST_ANGLE: f64 = 1.0 / (1_u64 << 50) as f64;

impl<'a> Fit<'a> {
    /// Returns the job, with default options; set its public fields for others.
    #[must_use]
    pub fn new(view: &'a View, light: &'a Light, casters: &'a Bounds, receivers: &'a [Body]) -> Self {
        Self {
            view,
            light,
            casters,
            receivers,
            map_size: [1024, 1024],
            viewport: [1920, 1080],
            axes: Axes::View,
            near_depth: NearDepth::Casters,
        }
    }

    /// Returns the map that the rule gives, fitted exactly: the receivers touch its four sides and its far plane, the
    /// casters its near plane. See [`ShadowMap::with_border`] and [`Fit::guard_f32`] for margins.
    ///
    /// ```text
    /// T = (Z, -z0)/d      W = eta T + (0,0,0,1)      A = (X, -p_x)      H = (Y, -p_y)
    /// clip_x = (2A - (X0 + X1) W)/(X1 - X0)          X0, X1: extremes of A/W over the body
    /// clip_y = (2 + eta) T - (0,0,0,1)               0 and 1: extremes of T
    /// clip_z = (Y1 W - H)/(Y1 - Y0)                  Y0: least H/W of the receivers, Y1: greatest of the casters
    /// clip_w = W
    /// ```
    /// This is the papers' frustum with near distance `d/eta` about the point `(p_x, p_y, z0 - d/eta)`, refitted to the body,
    /// [LiSPSM, Sec. 3]; but there is no `n`, no centre of projection and no `(f + n)/(f - n)` in it, which are infinite
    /// for a uniform map and cancel near it. `p_x` is the eye's, moved into the body's extent; `p_y` the middle
    /// of the receivers' extent, which makes the depth slopes that the warp adds equal and opposite at the two ends.
    ///
    /// Accuracy: 1e-13 (1 + eta) in normalised device coordinates, for positions relative to [`ShadowMap::origin`].
    ///
    /// # Errors
    /// [`Error::NothingVisible`] if all receivers are empty; [`Error::Unsupported`] for lights that are not directional;
    /// [`Error::Invalid`] if the map or the viewport has no texels.
    pub fn solve(&self, rule: Rule) -> Result<ShadowMap, Error> {
        let light = self.light.as_directional()?;
        let no_zero = |[width, height]: [u32; 2]| width > 0 && height > 0;
        require(no_zero(self.map_size), "map_size", "must not be zero")?;
        require(no_zero(self.viewport), "viewport", "must not be zero")?;
        let space = LightSpace::new(self.view, light);
        let origin = self.origin()?;
        let to_eye = self.view.eye() - origin;

        let mut extent = [Extent::NONE; 3];
        let mut depth = Extent::NONE;
        self.for_each_receiver(origin, |q| {
            extent[0].include(space.x.dot(q));
            extent[1].include(space.y.dot(q));
            extent[2].include(space.z.dot(q));
            depth.include(self.view.forward().dot(q));
        });
        let eye_depth = self.view.forward().dot(to_eye);
        let [near, far] = [depth.low - eye_depth, depth.high - eye_depth].map(|z| max(z, self.view.near()));
        let greatest = max(extent[0].size(), max(extent[1].size(), extent[2].size()));
        let floor = max(LEAST_ASPECT * greatest, max(LEAST_ANGLE * far.abs(), crate::error::MIN_LENGTH));
        let [across, height, along] = extent.map(|e| e.at_least(floor));

        let d = along.size();
        let slab = Slab { near, far, extent: d, sin_gamma: space.sin_gamma };
        let warp = rule.warp(&slab, self.view.is_perspective());
        let eta = warp.excess();
        let slope = eta / d;
        // The warp's denominator: 1 where the body begins, 1 + eta where it ends.
        let w = |q: DVec3| 1.0 + slope * (space.z.dot(q) - along.low);
        let w_row = row(space.z * slope, 1.0 - slope * along.low);

        // The plane of the texture: two axes, and the point that the warp projects about.
        let (axes, centre) = match self.axes {
            Axes::View => {
                let eye_x = space.x.dot(to_eye).clamp(across.low, across.high);
                ([space.x, space.z], [eye_x, along.low])
            }
            Axes::LightFixed => {
                // The middle of the body's bounding rectangle is inside the body, seen along the light, so w >= 1 there:
                // a line through it with the body on one side would miss two neighbouring sides of the rectangle.
                let axes = space.fixed_axes();
                let mut sides = [Extent::NONE; 2];
                self.for_each_receiver(origin, |q| {
                    sides[0].include(axes[0].dot(q));
                    sides[1].include(axes[1].dot(q));
                });
                (axes, sides.map(Extent::middle))
            }
        };
        let p_y = height.middle();
        let mut sides = [Extent::NONE; 2];
        let mut depths = Extent::NONE;
        self.for_each_receiver(origin, |q| {
            let r = 1.0 / w(q);
            sides[0].include((axes[0].dot(q) - centre[0]) * r);
            sides[1].include((axes[1].dot(q) - centre[1]) * r);
            depths.include((space.y.dot(q) - p_y) * r);
        });
        if self.near_depth == NearDepth::Casters {
            depths.high = max(depths.high, self.highest_caster(light, origin, p_y, w));
        }
        // The farthest end has w = 1 + eta.
        let floor = floor / warp.ratio();
        let [sides_x, mut sides_y] = sides.map(|e| e.at_least(floor));
        let depths = depths.at_least(floor);
        let offset = |axis: usize| row(axes[axis], -centre[axis]);

        let x = fitted(offset(0), sides_x, w_row);
        let y = match self.axes {
            Axes::View => {
                sides_y = Extent { low: 0.0, high: d / warp.ratio() };
                // `fitted` would subtract two rows of size (1 + eta)^2 here, to get one of size 1 + eta.
                (2.0 + eta) / d * offset(1) - DVec4::W
            }
            Axes::LightFixed => fitted(offset(1), sides_y, w_row),
        };
        let z = (depths.high * w_row - row(space.y, -p_y)) / depths.size();

        // World size of a texel: along an axis that runs across the warp it grows with w, along the warp with w^2.
        let w_centre = match self.axes {
            Axes::View => 1.0,
            Axes::LightFixed => w(axes[0] * centre[0] + axes[1] * centre[1]),
        };
        let texel = |axis: DVec3, extent: Extent, texels: u32| {
            let size = extent.size() / f64::from(texels);
            size * DVec2::new(axis.dot(space.x).abs(), axis.dot(space.z).abs() / w_centre)
        };
        let texels = match self.axes {
            Axes::View => [
                DVec2::new(sides_x.size() / f64::from(self.map_size[0]), 0.0),
                DVec2::new(0.0, sides_y.size() / f64::from(self.map_size[1])),
            ],
            Axes::LightFixed => [texel(axes[0], sides_x, self.map_size[0]), texel(axes[1], sides_y, self.map_size[1])],
        };
        Ok(ShadowMap::new(origin, [x, y, z, w_row], warp, space, texels, self.map_size))
    }

    /// Returns the worst perspective aliasing of a finished map over the receivers, in pixels per texel.
    /// See [`aliasing::worst`].
    #[must_use]
    pub fn worst_texel(&self, map: &ShadowMap) -> f64 {
        aliasing::worst(map, self.view, self.viewport, self.receivers)
    }

    /// Returns the affine row that gives linear depth, for engines that write depth in the fragment stage: its product with
    /// `(p, 1)`, for `p` relative to `origin`, is 0 at the caster closest to the light and 1 at the receiver farthest from it.
    ///
    /// # Errors
    /// As [`Fit::solve`].
    pub fn linear_depth(&self, origin: DVec3) -> Result<DVec4, Error> {
        let light = self.light.as_directional()?;
        let body_origin = self.origin()?;
        let to_light = light.to_light();
        let (mut height, mut greatest) = (Extent::NONE, 0.0);
        self.for_each_receiver(body_origin, |q| {
            height.include(to_light.dot(q));
            greatest = max(greatest, q.abs().max_element());
        });
        if self.near_depth == NearDepth::Casters {
            height.high = max(height.high, self.highest_caster(light, body_origin, 0.0, |_| 1.0));
        }
        let height = height.at_least(max(LEAST_ASPECT * greatest, crate::error::MIN_LENGTH));
        let shift = to_light.dot(origin - body_origin);
        Ok(row(-to_light, height.high - shift) / height.size())
    }

    /// Returns the origin of the first receiver that is not empty.
    fn origin(&self) -> Result<DVec3, Error> {
        self.receivers.iter().find(|body| !body.is_empty()).map(Body::origin).ok_or(Error::NothingVisible)
    }

    /// Calls `f` with every vertex of the receivers, relative to `origin`.
    #[inline(always)]
    pub(crate) fn for_each_receiver(&self, origin: DVec3, mut f: impl FnMut(DVec3)) {
        for body in self.receivers {
            let shift = body.origin() - origin;
            for vertex in body.vertices() {
                f(*vertex + shift);
            }
        }
    }

    /// Returns the greatest `(height - base)/w` of the casters, for `w` of points relative to `origin`.
    fn highest_caster(&self, light: &Directional, origin: DVec3, base: f64, w: impl Fn(DVec3) -> f64) -> f64 {
        let mut highest = f64::NEG_INFINITY;
        for body in self.receivers {
            let shift = body.origin() - origin;
            let base = base - light.to_light().dot(shift);
            if let Some(reach) = body.casters_reach(light, self.casters, base, |q| w(q + shift)) {
                highest = max(highest, reach);
            }
        }
        highest
    }
}

fn row(linear: DVec3, constant: f64) -> DVec4 {
    linear.extend(constant)
}

/// The row that maps the extremes of `row . p/(w . p)` to -1 and 1.
fn fitted(row: DVec4, extremes: Extent, w_row: DVec4) -> DVec4 {
    (2.0 * row - (extremes.low + extremes.high) * w_row) / extremes.size()
}
