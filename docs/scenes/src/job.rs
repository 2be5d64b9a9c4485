//! A scene's way into the library's types.

use anyhow::{Context, Result, anyhow, bail, ensure};
use shadow_warp::glam::DVec3;
use shadow_warp::{Axes, Body, Bounds, ConvexBody, Error, Fit, Light, NearDepth, Sides, View};

use crate::scene::{Boxes, Camera, Cuboid, Directional, Lamp, Orthographic, Point, Scene, Spot};

/// A scene in the library's types, each of which has checked its part.
#[derive(Clone)]
pub struct Job {
    /// The camera.
    pub view: View,
    /// The light.
    pub light: Light,
    /// Which face of a point light the light is, if it is one.
    pub face: Option<&'static str>,
    /// Bounds of all that casts shadows.
    pub casters: Bounds,
    /// Bounds of all that shadows are to be seen on: one at least.
    pub receivers: Vec<Bounds>,
    /// Texels of the map.
    pub map: [u32; 2],
    /// Pixels of the picture.
    pub viewport: [u32; 2],
    /// Which directions the axes follow; without, each technique's own.
    pub axes: Option<Axes>,
    /// Where the near plane lies.
    pub near_depth: NearDepth,
    /// The depths that the warp is chosen for, if not all that is seen.
    pub warp_depths: Option<[f64; 2]>,
}

impl Scene {
    /// Returns the scene in the library's types.
    ///
    /// # Errors
    /// Names the field and the condition that it does not meet.
    pub fn validated(&self) -> Result<Job> {
        let no_zero = |[width, height]: [u32; 2]| width > 0 && height > 0;
        ensure!(no_zero(self.map), "map must not be zero");
        ensure!(no_zero(self.viewport), "viewport must not be zero");
        Ok(Job {
            view: self.view.validated()?,
            light: self.light.validated()?,
            face: None,
            casters: common(&self.casters.validated("casters")?)?,
            receivers: self.receivers.validated("receivers")?,
            map: self.map,
            viewport: self.viewport,
            axes: self.axes.map(Axes::from),
            near_depth: self.near_depth.map_or(NearDepth::default(), NearDepth::from),
            warp_depths: self.warp_depths()?,
        })
    }

    fn warp_depths(&self) -> Result<Option<[f64; 2]>> {
        let Some((near, far)) = self.warp_depths else { return Ok(None) };
        let far = far.unwrap_or(f64::INFINITY);
        ensure!(near >= 0.0 && near <= far, "warp_depths must be in order, from 0 up");
        Ok(Some([near, far]))
    }
}

impl Boxes {
    fn validated(&self, name: &str) -> Result<Vec<Bounds>> {
        match self {
            Self::One(cuboid) => Ok(vec![cuboid.validated(name)?]),
            Self::Many(list) => {
                list.iter().enumerate().map(|(i, cuboid)| cuboid.validated(&format!("{name}[{i}]"))).collect()
            }
        }
    }
}

/// Returns the box around boxes.
fn common(boxes: &[Bounds]) -> Result<Bounds> {
    let around = |a: Bounds, b: &Bounds| Bounds::new(a.min().min(b.min()), a.max().max(b.max()));
    let (first, rest) = boxes.split_first().context("casters: there are none")?;
    Ok(rest.iter().try_fold(*first, around)?)
}

/// The faces of a point light, in the library's order.
const FACES: [&str; 6] = ["+x", "-x", "+y", "-y", "+z", "-z"];

impl Job {
    /// Returns the jobs that have one map each: the faces of a point light, or else the job itself.
    #[must_use]
    pub fn parts(&self) -> Vec<Self> {
        match &self.light {
            Light::Point(point) => {
                let faces = FACES.iter().zip(point.faces());
                faces.map(|(face, light)| Self { light, face: Some(face), ..self.clone() }).collect()
            }
            _ => vec![self.clone()],
        }
    }

    /// Returns whether a point in world space lies in what the light shines into.
    #[must_use]
    pub fn shines_on(&self, point: DVec3) -> bool {
        let Light::Spot(spot) = &self.light else { return true };
        let from_light = point - spot.position();
        let along = spot.direction().dot(from_light);
        let is_between = if self.face.is_some() {
            along >= from_light.abs().max_element()
        } else {
            spot.direction().angle_between(from_light) <= spot.outer_angle()
        };
        is_between && spot.near() <= along && along <= spot.range()
    }

    /// Returns what of each of the receivers' boxes the camera sees.
    #[must_use]
    pub fn seen(&self) -> Vec<Body> {
        self.receivers.iter().map(|bounds| Body::visible(&self.view, bounds)).collect()
    }

    /// Returns the library's job for receivers that were cut by this view.
    #[must_use]
    pub fn fit<'a>(&'a self, receivers: &'a [Body]) -> Fit<'a> {
        let fit = Fit::new(&self.view, &self.light, &self.casters, receivers);
        let (axes, near_depth, warp_depths) = (self.axes.unwrap_or_default(), self.near_depth, self.warp_depths);
        Fit { map_size: self.map, viewport: self.viewport, axes, near_depth, warp_depths, ..fit }
    }

    /// Returns how deep in the view a point lies that is given relative to a body's origin.
    #[must_use]
    pub fn depth<const V: usize, const F: usize>(&self, body: &ConvexBody<V, F>, q: DVec3) -> f64 {
        self.view.forward().dot(q + (body.origin() - self.view.eye()))
    }
}

impl Camera {
    fn validated(&self) -> Result<View> {
        let [eye, forward, up] = [self.eye, self.forward, self.up].map(DVec3::from);
        let depth = self.near..self.far.unwrap_or(f64::INFINITY);
        match (self.fov_y_deg, self.aspect, self.tangents, self.orthographic) {
            (Some(fov), Some(aspect), None, None) => {
                ensure!(fov > 0.0 && fov < 180.0, "view.fov_y_deg must be between 0 and 180 degrees");
                View::perspective(eye, forward, up, fov.to_radians(), aspect, depth)
                    .map_err(|error| side(error, "aspect", "fov_y_deg"))
            }
            (None, None, Some([left, right, bottom, top]), None) => {
                View::perspective_off_centre(eye, forward, up, Sides { left, right, bottom, top }, depth)
                    .map_err(|error| side(error, "tangents", "tangents"))
            }
            (None, None, None, Some(Orthographic { width, height })) => {
                View::orthographic(eye, forward, up, Sides::centred(width, height), depth)
                    .map_err(|error| side(error, "orthographic.width", "orthographic.height"))
            }
            (Some(_), None, None, None) => bail!("view.aspect must go with view.fov_y_deg"),
            (None, Some(_), None, None) => bail!("view.fov_y_deg must go with view.aspect"),
            _ => bail!("view must have one of fov_y_deg with aspect, tangents, and orthographic"),
        }
    }
}

impl Lamp {
    /// Returns a light at infinity.
    #[must_use]
    pub fn directional(to_light: [f64; 3]) -> Self {
        Self { directional: Some(Directional { to_light }), ..Self::default() }
    }

    fn validated(&self) -> Result<Light> {
        match (self.directional, self.spot, self.point) {
            (Some(light), None, None) => {
                Light::directional(light.to_light.into()).map_err(|error| field("light.directional", error))
            }
            (None, Some(Spot { position, direction, outer_deg, near, range }), None) => {
                ensure!(
                    outer_deg > 0.0 && outer_deg < 90.0,
                    "light.spot.outer_deg must be between 0 and 90 degrees from axis to edge; wider lights are points"
                );
                Light::spot(position.into(), direction.into(), outer_deg.to_radians(), near, range)
                    .map_err(|error| field("light.spot", error))
            }
            (None, None, Some(Point { position, near, range })) => {
                Light::point(position.into(), near, range).map_err(|error| field("light.point", error))
            }
            _ => bail!("light must have one of directional, spot and point"),
        }
    }
}

impl Cuboid {
    fn validated(&self, name: &str) -> Result<Bounds> {
        Bounds::new(self.min.into(), self.max.into()).map_err(|error| field(name, error))
    }
}

/// Puts the path of the field before the library's condition.
fn field(parent: &str, error: Error) -> anyhow::Error {
    match error {
        Error::Invalid { argument, condition } => anyhow!("{parent}.{argument} {condition}"),
        other => anyhow!("{parent}: {other}"),
    }
}

/// As [`field`], where the library checks sides that the file gives as something else.
fn side(error: Error, across: &str, upright: &str) -> anyhow::Error {
    match error {
        Error::Invalid { argument: "left and right", .. } => anyhow!("view.{across}: {error}"),
        Error::Invalid { argument: "bottom and top", .. } => anyhow!("view.{upright}: {error}"),
        _ => field("view", error),
    }
}
