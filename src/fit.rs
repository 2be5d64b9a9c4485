//! From view, light and bodies to a shadow map.

mod extent;
mod family;
mod frame;
mod homography;
mod optimal;
mod prepared;

use glam::{DVec3, DVec4};

use self::extent::{Extent, at, least_size, row};
use self::frame::Frame;
use crate::aliasing::{self, Worst};
use crate::basis::{Axes, LightSpace};
use crate::body::{ConvexBody, LitBody, Middle};
use crate::error::{Error, require, require_position};
use crate::light::Light;
use crate::map::ShadowMap;
use crate::math::{max, min, sqrt};
use crate::scene::Bounds;
use crate::view::View;
use crate::warp::Rule;

/// Where the map's near plane lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum NearDepth {
    /// At the caster closest to the light: nothing is clipped. A box of casters that reaches far towards the light costs the
    /// precision of depth, whether anything is there or not; [`Fit::guard_f32`] tells where `f32` has none left. (Casters that are further away than 2^48 over the warp's excess,
    /// times the receivers' extent, do not count: the rounding of the light's direction alone is 6 % of the `w` that they have.)
    #[default]
    Casters,
    /// At the receiver closest to the light: the best depth precision, for engines that clamp the depth of what lies
    /// before it ("depth clamp", "pancaking"). The map does not depend on the casters.
    Receivers,
}

/// A job: everything a shadow map depends on but the [`Rule`].
///
/// `receivers` are bodies that a shadow is to be seen on: usually [`Body::visible`](crate::Body::visible) of one box, or of several, whose
/// union counts. They are borrowed, so that lights under one view share them. `casters` bounds all that casts shadows.
///
/// `V` and `F` are the capacity of the receivers' bodies, of up to 20 faces: those of [`Body`](crate::Body), or of
/// [`WideBody`](crate::WideBody) where planes of the engine's own, of a mirror or a portal, cut them.
#[derive(Clone, Copy, Debug)]
pub struct Fit<'a, const V: usize = 20, const F: usize = 12> {
    /// The camera.
    pub view: &'a View,
    /// The light.
    pub light: &'a Light,
    /// Bounds of all that casts shadows.
    pub casters: &'a Bounds,
    /// What shadows are to be seen on; several bodies count as their union.
    pub receivers: &'a [ConvexBody<V, F>],
    /// The size of the map, `[width, height]` in texels. By default 1024 x 1024.
    pub map_size: [u32; 2],
    /// The size of the picture that is seen, `[width, height]` in pixels. By default 1920 x 1080. Only errors depend
    /// on it.
    pub viewport: [u32; 2],
    /// Which directions the texture's axes follow. Perspective and plane-optimal maps have axes of their own.
    pub axes: Axes,
    /// Where the near plane lies.
    pub near_depth: NearDepth,
    /// The depths along the view that the warp is chosen for, `[near, far]`, where these are not all that is seen: a near
    /// hint, for what is close by but does not matter; or a far distance from visibility, up to which anything is seen at
    /// all (Wimmer and Scherzer 2005, Sec. 4.4). Only the strength of the warp depends on it, by any rule of the family: the map
    /// covers what it did. For LiSPSM's rules these are the near and the far distance, and the extent is that of
    /// the part between. Ignored where nothing that is seen lies between them. By default none.
    pub warp_depths: Option<[f64; 2]>,
}

impl<'a, const V: usize, const F: usize> Fit<'a, V, F> {
    /// Returns the job, with default options; set its public fields for others.
    #[must_use]
    pub fn new(view: &'a View, light: &'a Light, casters: &'a Bounds, receivers: &'a [ConvexBody<V, F>]) -> Self {
        Self {
            view,
            light,
            casters,
            receivers,
            map_size: [1024, 1024],
            viewport: [1920, 1080],
            axes: Axes::View,
            near_depth: NearDepth::Casters,
            warp_depths: None,
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
    /// for a body whose extents across, along and towards the light differ by more than 1000, more in proportion. For a spot light,
    /// times its distance over the size of what it lights.
    ///
    /// # Errors
    /// [`Error::NothingVisible`] if all receivers are empty; [`Error::NothingLit`] if a spot light shines on none of them;
    /// [`Error::Unsupported`] for point lights, whose faces have maps ([`Point::faces`](crate::Point::faces)), and where a
    /// perspective or plane-optimal map cannot serve; [`Error::Invalid`] if `map_size` or `viewport` has no texels,
    /// `warp_depths` are not in order, the `shift` of a perspective rule is not from 0 to 1e100,
    /// or a spot light's near distance is nothing at its distance from what is seen.
    pub fn solve(&self, rule: Rule) -> Result<ShadowMap, Error> {
        let frame = self.frame()?;
        match (frame.spot.is_some(), rule) {
            (true, Rule::Perspective(rule)) if self.view.is_perspective() => {
                homography::perspective::<true, V, F>(&frame, rule)
            }
            (false, Rule::Perspective(rule)) if self.view.is_perspective() => {
                homography::perspective::<false, V, F>(&frame, rule)
            }
            (true, Rule::Plane(plane)) => homography::plane::<true, V, F>(&frame, &plane),
            (false, Rule::Plane(plane)) => homography::plane::<false, V, F>(&frame, &plane),
            (true, Rule::OPTIMAL) => family::best::<true, V, F>(&frame),
            (false, Rule::OPTIMAL) => family::best::<false, V, F>(&frame),
            (true, _) => family::fit::<true, V, F>(&frame, rule),
            (false, _) => family::fit::<false, V, F>(&frame, rule),
        }
    }

    /// Returns the worst perspective aliasing of a finished map over the receivers' bodies, in pixels per texel: the larger of
    /// its parts along the map's two axes, without shear. See [`aliasing::worst`].
    #[must_use]
    pub fn worst_texel(&self, map: &ShadowMap) -> f64 {
        let Light::Spot(_) = self.light else {
            return aliasing::worst(map, self.view, self.viewport, self.receivers);
        };
        let mut worst = Worst::of([map.texels_at(map.origin())], self.view, map.origin());
        self.each_lit(|origin, vertices| {
            vertices.iter().for_each(|vertex| worst.include(*vertex + (origin - map.origin())));
        });
        let [[a, b]] = worst.pixels(self.viewport);
        max(a, b)
    }

    /// Returns the receivers, each cut to what the light shines on: see [`ConvexBody::lit_by`]. Nothing for a point light, whose
    /// faces are jobs of their own.
    pub fn lit_receivers(&self) -> impl Iterator<Item = LitBody> + '_ {
        let space = self.light_space().ok();
        self.receivers.iter().filter_map(move |body| Some(body.lit_by(self.light, space.as_ref()?)))
    }

    /// Calls `f` with the origin and the vertices of each of [`Fit::lit_receivers`].
    pub(crate) fn each_lit(&self, mut f: impl FnMut(DVec3, &[DVec3])) {
        let Ok(space) = self.light_space() else { return };
        for body in self.receivers {
            body.with_lit(self.light, &space, |vertices| f(body.origin(), vertices));
        }
    }

    /// Returns the affine row that gives linear depth, for engines that write depth in the fragment stage: its
    /// product with `(p, 1)`, for `p` relative to `origin`, is 0 at the near plane's caster (or receiver, as in
    /// [`Fit::solve`]) and 1 at the receiver farthest from the light. For a spot light it is the distance along its axis, from
    /// its near plane or the casters' box, whichever comes later.
    ///
    /// Write it in the fragment stage: interpolated from the vertices it is wrong inside a triangle, by up to
    /// [`bias::vertex_depth_error`](crate::bias::vertex_depth_error) of the triangle's range of depths.
    ///
    /// # Errors
    /// As [`Fit::solve`]; [`Error::Invalid`] unless `origin` is finite.
    pub fn linear_depth(&self, origin: DVec3) -> Result<DVec4, Error> {
        require_position(origin, "origin")?;
        let frame = self.frame()?;
        if let Some(spot) = frame.spot {
            let far = frame.measure::<true>(|_| ())?.base;
            let nearest = frame.base.truncate();
            let corner = DVec3::select(nearest.cmplt(DVec3::ZERO), self.casters.max(), self.casters.min());
            let casters = max(at(frame.base, corner - frame.origin), spot.near());
            let near = if self.near_depth == NearDepth::Casters { min(casters, far.low) } else { far.low };
            let depth = Extent { low: near, high: far.high };
            let depth = depth.at_least(least_size(far.high, frame.light.abs().max_element()));
            return Ok((frame.base + DVec4::W * (nearest.dot(origin - frame.origin) - depth.low)) / depth.size());
        }
        let to_light = frame.space.y;
        let (sizes, height) = frame.fractions::<3, false>(
            [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| row(axis, 0.0)),
            row(to_light, 0.0),
            DVec4::W,
            frame.casters(),
        );
        let greatest = sizes.map(Extent::size).into_iter().fold(0.0, max);
        let distance =
            max(self.greatest_shift(frame.origin), sizes.into_iter().map(Extent::reach).fold(height.reach(), max));
        let height = height.at_least(least_size(greatest, distance));
        let shift = to_light.dot(origin - frame.origin);
        Ok(row(-to_light, height.high - shift) / height.size())
    }

    /// Light space, once everything that is not a number of light space is found to be in order.
    #[inline(always)]
    fn frame(&self) -> Result<Frame<'_, V, F>, Error> {
        let no_zero = |[width, height]: [u32; 2]| width > 0 && height > 0;
        require(no_zero(self.map_size), "map_size", "must not be zero")?;
        require(no_zero(self.viewport), "viewport", "must not be zero")?;
        if let Some([near, far]) = self.warp_depths {
            require(near >= 0.0 && near <= far, "warp_depths", "must be [near, far] with 0 <= near <= far")?;
        }
        Frame::new(self)
    }

    fn light_space(&self) -> Result<LightSpace, Error> {
        LightSpace::along(self.warp_direction(), self.view, self.light)
    }

    /// The direction that takes the view's part in light space.
    fn warp_direction(&self) -> DVec3 {
        match self.axes {
            Axes::Middle | Axes::VertexMean => self.middle_vector(),
            Axes::View | Axes::LightFixed => self.view.forward(),
        }
    }

    /// The direction from the eye to the middle of the receivers; along the view where there is none before the eye.
    fn middle_vector(&self) -> DVec3 {
        let eye = self.view.eye();
        let middle = if self.axes == Axes::VertexMean { None } else { self.centroid() };
        // The sum has the direction of the mean.
        let middle = middle.unwrap_or_else(|| {
            let relative = |body: &'a ConvexBody<V, F>| body.vertices().iter().map(move |v| *v + (body.origin() - eye));
            self.receivers.iter().flat_map(relative).sum()
        });
        let length = sqrt(middle.length_squared());
        if self.view.forward().dot(middle) > 0.0 && length.is_finite() { middle / length } else { self.view.forward() }
    }

    /// The direction and distance of the receivers' centroid from the eye, in a unit of length of its own.
    fn centroid(&self) -> Option<DVec3> {
        let eye = self.view.eye();
        let bodies = || self.receivers.iter().map(|body| (body, body.origin() - eye));
        let reach = |(body, shift): (&ConvexBody<V, F>, DVec3)| {
            body.vertices().iter().fold(0.0, |reach, v| max((*v + shift).abs().max_element(), reach))
        };
        // Continuous as vertices come and go.
        let extent = |(body, _): (&ConvexBody<V, F>, DVec3)| {
            DVec3::AXES
                .map(|axis| body.bounds_along(axis).map_or(0.0, |[low, high]| high - low))
                .into_iter()
                .fold(0.0, max)
        };
        let mut middle = Middle::new(bodies().map(reach).fold(0.0, max), bodies().map(extent).fold(0.0, max));
        bodies().for_each(|(body, shift)| middle.include(body, shift));
        middle.get()
    }

    /// How far the origins of the receivers are from this one.
    fn greatest_shift(&self, origin: DVec3) -> f64 {
        self.receivers.iter().fold(0.0, |greatest, body| max((body.origin() - origin).abs().max_element(), greatest))
    }

    /// How far the casters are from an origin.
    fn caster_reach(&self, origin: DVec3) -> f64 {
        (self.casters.min() - origin).abs().max((self.casters.max() - origin).abs()).max_element()
    }

    /// Returns the origin of the first receiver that is not empty.
    fn origin(&self) -> Result<DVec3, Error> {
        self.receivers.iter().find(|body| !body.is_empty()).map(ConvexBody::origin).ok_or(Error::NothingVisible)
    }
}
