//! The scene as it is written down, and its way into the library's types.

use anyhow::{Result, anyhow, bail, ensure};
use serde::{Deserialize, Serialize};
use shadow_warp::glam::DVec3;
use shadow_warp::{Body, Bounds, ConvexBody, Error, Fit, Light, Sides, View};

/// A camera, a light, bounds and sizes: the input file.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// The camera.
    pub view: Camera,
    /// The light.
    pub light: Lamp,
    /// Bounds of all that casts shadows.
    pub casters: Cuboid,
    /// Bounds of all that shadows are to be seen on.
    pub receivers: Cuboid,
    /// Texels of the map, `[width, height]`.
    pub map: [u32; 2],
    /// Pixels of the picture, `[width, height]`.
    pub viewport: [u32; 2],
}

/// A camera with exactly one lens: `fov_y_deg` with `aspect`, `tangents` (left, right, bottom, top), or `orthographic`.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Where it stands.
    pub eye: [f64; 3],
    /// Where it looks; any length.
    pub forward: [f64; 3],
    /// Up in the picture, roughly.
    pub up: [f64; 3],
    /// The full vertical angle, in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fov_y_deg: Option<f64>,
    /// Width over height.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aspect: Option<f64>,
    /// Left, right, bottom, top of an off-centre lens.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tangents: Option<[f64; 4]>,
    /// The size of an orthographic volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orthographic: Option<Orthographic>,
    /// The near distance.
    pub near: f64,
    /// The far distance. Absent or null: infinite.
    pub far: Option<f64>,
}

/// The size of an orthographic view volume, in world units.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Orthographic {
    /// Along the camera's right.
    pub width: f64,
    /// Along its up.
    pub height: f64,
}

/// A light of exactly one kind.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Lamp {
    /// Infinitely far away.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub directional: Option<Directional>,
    /// A cone of light.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spot: Option<Spot>,
    /// In a place, all around.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point: Option<Point>,
}

/// A light at infinity.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Directional {
    /// Towards the light; any length.
    pub to_light: [f64; 3],
}

/// A light in a place that shines into a cone.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Spot {
    /// Where it stands.
    pub position: [f64; 3],
    /// Where it shines; any length.
    pub direction: [f64; 3],
    /// From the axis to the edge of the cone, in degrees.
    pub outer_deg: f64,
    /// Nothing nearer casts shadows.
    pub near: f64,
    /// Nothing further away is lit.
    pub range: f64,
}

/// A light in a place that shines all around. Each of its six faces has a map.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// Where it stands.
    pub position: [f64; 3],
    /// Nothing nearer casts shadows.
    pub near: f64,
    /// Nothing further away is lit.
    pub range: f64,
}

/// A box along the world's axes.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Cuboid {
    /// Its least corner.
    pub min: [f64; 3],
    /// Its greatest corner.
    pub max: [f64; 3],
}

/// A scene in the library's types, each of which has checked its part.
#[derive(Clone, Copy)]
pub struct Job {
    /// The camera.
    pub view: View,
    /// The light.
    pub light: Light,
    /// Which face of a point light the light is, if it is one.
    pub face: Option<&'static str>,
    /// Bounds of all that casts shadows.
    pub casters: Bounds,
    /// Bounds of all that shadows are to be seen on.
    pub receivers: Bounds,
    /// Texels of the map.
    pub map: [u32; 2],
    /// Pixels of the picture.
    pub viewport: [u32; 2],
}

impl Scene {
    /// Reads JSON.
    ///
    /// # Errors
    /// Names the field that is missing, unknown or of another type.
    pub fn parse(text: &str) -> Result<Self> {
        let json = &mut serde_json::Deserializer::from_str(text);
        let scene = serde_path_to_error::deserialize(&mut *json).map_err(|error| {
            let path = error.path().to_string();
            // The whole file, or nothing that has a name yet.
            let path = if path == "." || path == "?" { String::new() } else { path };
            let message = error.into_inner().to_string();
            // A missing field has no place in the file, so the path ends before it.
            let missing = message.strip_prefix("missing field `").and_then(|rest| rest.split('`').next());
            match (path.as_str(), missing) {
                ("", Some(field)) => anyhow!("{field}: {message}"),
                ("", None) => anyhow!("{message}"),
                (_, Some(field)) => anyhow!("{path}.{field}: {message}"),
                (_, None) => anyhow!("{path}: {}", message.replace("trailing characters", "too many elements")),
            }
        })?;
        json.end()?;
        Ok(scene)
    }

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
            casters: self.casters.validated("casters")?,
            receivers: self.receivers.validated("receivers")?,
            map: self.map,
            viewport: self.viewport,
        })
    }
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
                faces.map(|(face, light)| Self { light, face: Some(face), ..*self }).collect()
            }
            _ => vec![*self],
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

    /// Returns what of the receivers' box the camera sees.
    #[must_use]
    pub fn seen(&self) -> Body {
        Body::visible(&self.view, &self.receivers)
    }

    /// Returns the library's job for receivers that were cut by this view.
    #[must_use]
    pub fn fit<'a>(&'a self, receivers: &'a [Body]) -> Fit<'a> {
        let fit = Fit::new(&self.view, &self.light, &self.casters, receivers);
        Fit { map_size: self.map, viewport: self.viewport, ..fit }
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
                ensure!(outer_deg > 0.0 && outer_deg < 90.0, "light.spot.outer_deg must be between 0 and 90 degrees");
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
