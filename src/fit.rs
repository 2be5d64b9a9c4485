//! From view, light and bodies to a shadow map.

use glam::{DVec2, DVec3, DVec4};

use crate::aliasing;
use crate::basis::{Axes, LightSpace};
use crate::body::{Body, Reach};
use crate::error::{Error, require, require_position};
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
    /// The size of the picture that is seen, `[width, height]` in pixels. By default 1920 x 1080. Only errors depend
    /// on it.
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

    /// The greatest size of a value.
    fn reach(self) -> f64 {
        max(self.high, -self.low)
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
/// A body is fitted as if it were at least this much of its distance, from the eye and from the origins, in size: the
/// rounding of its position.
const LEAST_ANGLE: f64 = 1.0 / (1_u64 << 50) as f64;

/// The warp's `w` has a rounding error of 2^-52 times its excess times the body's distance over its extent. Where
/// that is more than 2^-12, as for a body that is a point far from its origin, the excess is made smaller.
const MOST_STEEP: f64 = (1_u64 << 40) as f64;
/// The same for casters that are very much further away than the body is long: their distance over the body's extent,
/// times the excess, tilts the row of depth against the light, by the rounding of its axes. At this value it does by
/// 6 %.
const MOST_STEEP_DEPTH: f64 = (1_u64 << 48) as f64;

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

    /// Returns the map that the rule gives, fitted exactly: the receivers touch its four sides and its far plane, and
    /// the highest of their casters its near plane, or the highest receiver where no caster is higher. Casters count
    /// as far as they stand between receivers and light; their box need not contain the receivers. A flat body does
    /// not touch all sides: it is fitted as if it were a millionth of its size thick. See [`ShadowMap::with_border`]
    /// and [`Fit::guard_f32`] for margins.
    ///
    /// ```text
    /// T = (Z, -z0)/d    W = eta T + (0,0,0,1)    A = (X, -p_x)    H = (Y, -p_y)
    /// clip_x = (2A - (X0 + X1) W)/(X1 - X0)      X0, X1: extremes of A/W over the body
    /// clip_y = (2 + eta) T - (0,0,0,1)           0 and 1: extremes of T
    /// clip_z = (Y1 W - H)/(Y1 - Y0)              Y0: least H/W of the receivers
    /// clip_w = W                                 Y1: greatest H/W of the casters
    /// ```
    /// This is the papers' frustum with near distance `d/eta` about the point `(p_x, p_y, z0 - d/eta)`, refitted to
    /// the body, [LiSPSM, Sec. 3]; but there is no `n`, no centre of projection and no `(f + n)/(f - n)` in it, which
    /// are infinite for a uniform map and cancel near it. `p_x` is the eye's, moved into the body's extent; `p_y` the
    /// middle of the receivers' extent, which makes the depth slopes that the warp adds equal and opposite at the two
    /// ends.
    ///
    /// Where the body is so short along the warp, against its distance, that `f64` cannot carry the rule's excess, the
    /// map has a smaller one: [`ShadowMap::warp`] tells.
    ///
    /// Accuracy: 1e-13 (1 + eta) in normalised device coordinates, for positions relative to [`ShadowMap::origin`];
    /// for a body whose extents across, along and towards the light differ by more than 1000, more in proportion.
    ///
    /// # Errors
    /// [`Error::NothingVisible`] if all receivers are empty; [`Error::Unsupported`] for lights that are not
    /// directional; [`Error::Invalid`] if `map_size` or `viewport` has no texels.
    pub fn solve(&self, rule: Rule) -> Result<ShadowMap, Error> {
        let light = self.light.as_directional()?;
        let no_zero = |[width, height]: [u32; 2]| width > 0 && height > 0;
        require(no_zero(self.map_size), "map_size", "must not be zero")?;
        require(no_zero(self.viewport), "viewport", "must not be zero")?;
        let space = LightSpace::new(self.view, light);
        let origin = self.origin()?;
        let to_eye = self.view.eye() - origin;

        let [across, height, along, depth] = self.extents(origin, [space.x, space.y, space.z, self.view.forward()]);
        let eye_depth = self.view.forward().dot(to_eye);
        let [near, far] = [depth.low - eye_depth, depth.high - eye_depth].map(|z| max(z, self.view.near()));
        let greatest = max(across.size(), max(height.size(), along.size()));
        let reach = max(across.reach(), max(height.reach(), along.reach()));
        let distance = max(self.greatest_shift(origin), max(far.abs(), reach));
        let floor = least_size(greatest, distance);
        let along = along.at_least(floor);

        let d = along.size();
        let slab = Slab { near, far, extent: d, sin_gamma: space.sin_gamma };
        let casters = (self.casters.min() - origin).abs().max((self.casters.max() - origin).abs()).max_element();
        let most = d * min(MOST_STEEP / max(distance, d), MOST_STEEP_DEPTH / max(casters, d));
        let warp = rule.warp(&slab, self.view.is_perspective()).at_most(most);
        let eta = warp.excess();
        // The warp's denominator: 1 where the body begins, 1 + eta where it ends.
        let w = row(space.z * (eta / d), 1.0 - eta / d * along.low);
        let texels = self.map_size.map(f64::from);
        let floor = floor / warp.ratio();

        let above_middle = row(space.y, -height.middle());
        let (x, y, texel_extents, depths);
        match self.axes {
            Axes::View => {
                let p_x = min(max(space.x.dot(to_eye), across.low), across.high);
                let offset = row(space.x, -p_x);
                let (sides, depth) = self.fractions(light, origin, [offset], above_middle, w);
                let side = sides[0].at_least(floor);
                x = fitted(offset, side, w);
                // As `fitted` to 0 and d/(1 + eta), without its difference of two rows of size (1 + eta)^2.
                y = row(space.z, -along.low) * ((2.0 + eta) / d) - DVec4::W;
                texel_extents =
                    [DVec2::new(side.size() / texels[0], 0.0), DVec2::new(0.0, d / (warp.ratio() * texels[1]))];
                depths = depth.at_least(floor);
            }
            Axes::LightFixed => {
                // The warp projects about the middle of the body's bounding rectangle. Seen along the light that is
                // inside the body, so w >= 1 there: a line through it with the body on one side would miss a side of
                // the rectangle.
                let axes = space.fixed_axes();
                let middle = self.extents(origin, axes).map(Extent::middle);
                let w_middle = at(w, axes[0] * middle[0] + axes[1] * middle[1]);
                let offsets = [row(axes[0], -middle[0]), row(axes[1], -middle[1])];
                let (sides, depth) = self.fractions(light, origin, offsets, above_middle, w);
                let sides = sides.map(|side| side.at_least(floor));
                x = fitted(offsets[0], sides[0], w);
                y = fitted(offsets[1], sides[1], w);
                // A step along such an axis goes partly across the warp and partly along it.
                let extents = |axis: usize| {
                    let parts = DVec2::new(axes[axis].dot(space.x).abs(), axes[axis].dot(space.z).abs() / w_middle);
                    parts * (sides[axis].size() / texels[axis])
                };
                texel_extents = [extents(0), extents(1)];
                depths = depth.at_least(floor);
            }
        }
        let z = (depths.high * w - above_middle) / depths.size();
        let depth_range = depths.size();
        Ok(ShadowMap::new(origin, [x, y, z, w], warp, space, texel_extents, depth_range, self.map_size))
    }

    /// Returns the worst perspective aliasing of a finished map over the receivers, in pixels per texel.
    /// See [`aliasing::worst`].
    #[must_use]
    pub fn worst_texel(&self, map: &ShadowMap) -> f64 {
        aliasing::worst(map, self.view, self.viewport, self.receivers)
    }

    /// Returns the affine row that gives linear depth, for engines that write depth in the fragment stage: its
    /// product with `(p, 1)`, for `p` relative to `origin`, is 0 at the near plane's caster (or receiver, as in
    /// [`Fit::solve`]) and 1 at the receiver farthest from the light.
    ///
    /// # Errors
    /// [`Error::NothingVisible`] and [`Error::Unsupported`] as [`Fit::solve`]; [`Error::Invalid`] unless `origin` is
    /// finite.
    pub fn linear_depth(&self, origin: DVec3) -> Result<DVec4, Error> {
        require_position(origin, "origin")?;
        let light = self.light.as_directional()?;
        let body_origin = self.origin()?;
        let to_light = light.to_light();
        let (sizes, height) = self.fractions(
            light,
            body_origin,
            [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| row(axis, 0.0)),
            row(to_light, 0.0),
            DVec4::W,
        );
        let greatest = sizes.map(Extent::size).into_iter().fold(0.0, max);
        let distance =
            max(self.greatest_shift(body_origin), sizes.into_iter().map(Extent::reach).fold(height.reach(), max));
        let height = height.at_least(least_size(greatest, distance));
        let shift = to_light.dot(origin - body_origin);
        Ok(row(-to_light, height.high - shift) / height.size())
    }

    /// How far the origins of the receivers are from this one.
    fn greatest_shift(&self, origin: DVec3) -> f64 {
        self.receivers.iter().fold(0.0, |greatest, body| max((body.origin() - origin).abs().max_element(), greatest))
    }

    /// Returns the origin of the first receiver that is not empty.
    fn origin(&self) -> Result<DVec3, Error> {
        self.receivers.iter().find(|body| !body.is_empty()).map(Body::origin).ok_or(Error::NothingVisible)
    }

    /// The extremes of `axis . p` over the receivers, for each of some axes and positions relative to `origin`.
    #[inline(always)]
    fn extents<const N: usize>(&self, origin: DVec3, axes: [DVec3; N]) -> [Extent; N] {
        let mut extents = [Extent::NONE; N];
        for body in self.receivers {
            let shift = body.origin() - origin;
            for vertex in body.vertices() {
                let q = *vertex + shift;
                for axis in 0..N {
                    extents[axis].include(axes[axis].dot(q));
                }
            }
        }
        extents
    }

    /// The extremes of linear fractions over `w`: of some rows over the receivers, and of the height from the
    /// receivers to the casters, as [`NearDepth`] says.
    #[inline(always)]
    fn fractions<const N: usize>(
        &self,
        light: &Directional,
        origin: DVec3,
        rows: [DVec4; N],
        height: DVec4,
        w: DVec4,
    ) -> ([Extent; N], Extent) {
        let (mut sides, mut depths) = ([Extent::NONE; N], Extent::NONE);
        let with_casters = self.near_depth == NearDepth::Casters;
        for body in self.receivers {
            let shift = body.origin() - origin;
            let mut reach = Reach::new(light.to_light(), self.casters, origin, shift, [height, w]);
            for (vertex, point) in body.vertices().iter().enumerate() {
                let q = *point + shift;
                let per_w = 1.0 / at(w, q);
                for axis in 0..N {
                    sides[axis].include(at(rows[axis], q) * per_w);
                }
                let height = at(height, q);
                depths.include(height * per_w);
                reach.include(vertex, q, height, per_w);
            }
            if with_casters {
                let inside = body.is_inside(self.casters);
                let reach = if inside { reach.of_enclosed(body) } else { reach.of_any(body, self.casters) };
                depths.high = max(reach, depths.high);
            }
        }
        (sides, depths)
    }
}

#[inline(always)]
fn at(row: DVec4, p: DVec3) -> f64 {
    row.truncate().dot(p) + row.w
}

/// The least extent that a body is fitted with, from its greatest extent and its distance.
fn least_size(greatest: f64, distance: f64) -> f64 {
    max(LEAST_ASPECT * greatest, max(LEAST_ANGLE * distance, crate::error::MIN_LENGTH))
}

fn row(linear: DVec3, constant: f64) -> DVec4 {
    linear.extend(constant)
}

/// The row whose fraction over `w` goes from -1 to 1 where that of `row` goes from one extreme to the other.
fn fitted(row: DVec4, extremes: Extent, w: DVec4) -> DVec4 {
    (2.0 * row - (extremes.low + extremes.high) * w) / extremes.size()
}
