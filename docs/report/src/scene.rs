//! The scene as it is written down, and its way into the library's types.

use anyhow::{Result, anyhow, bail, ensure};
use serde::{Deserialize, Serialize};
use shadow_warp::glam::DVec3;
use shadow_warp::{Body, Bounds, Error, Light, Sides, View};

/// The input file.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Scene {
    pub(crate) view: Camera,
    pub(crate) light: Lamp,
    pub(crate) casters: Cuboid,
    pub(crate) receivers: Cuboid,
    pub(crate) map: [u32; 2],
    pub(crate) viewport: [u32; 2],
}

/// Exactly one lens: `fov_y_deg` with `aspect`, `tangents` (left, right, bottom, top), or `orthographic`.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Camera {
    pub(crate) eye: [f64; 3],
    pub(crate) forward: [f64; 3],
    pub(crate) up: [f64; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) fov_y_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) aspect: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) tangents: Option<[f64; 4]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) orthographic: Option<Orthographic>,
    pub(crate) near: f64,
    /// Absent or null: infinite.
    pub(crate) far: Option<f64>,
}

#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Orthographic {
    pub(crate) width: f64,
    pub(crate) height: f64,
}

#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Lamp {
    pub(crate) directional: Directional,
}

#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Directional {
    pub(crate) to_light: [f64; 3],
}

#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Cuboid {
    pub(crate) min: [f64; 3],
    pub(crate) max: [f64; 3],
}

/// A scene in the library's types, each of which has checked its part.
pub(crate) struct Job {
    pub(crate) view: View,
    pub(crate) light: Light,
    pub(crate) casters: Bounds,
    pub(crate) receivers: Bounds,
    pub(crate) map: [u32; 2],
    pub(crate) viewport: [u32; 2],
}

impl Scene {
    /// Reads JSON. The error names the field.
    pub(crate) fn parse(text: &str) -> Result<Self> {
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

    pub(crate) fn validated(&self) -> Result<Job> {
        let to_light = self.light.directional.to_light;
        let no_zero = |[width, height]: [u32; 2]| width > 0 && height > 0;
        ensure!(no_zero(self.map), "map must not be zero");
        ensure!(no_zero(self.viewport), "viewport must not be zero");
        Ok(Job {
            view: self.view.validated()?,
            light: Light::directional(to_light.into()).map_err(|e| field("light.directional", e))?,
            casters: self.casters.validated("casters")?,
            receivers: self.receivers.validated("receivers")?,
            map: self.map,
            viewport: self.viewport,
        })
    }
}

impl Job {
    /// How deep in the view a point lies that is given relative to a body's origin.
    pub(crate) fn depth(&self, body: &Body, q: DVec3) -> f64 {
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

impl Cuboid {
    pub(crate) fn validated(&self, name: &str) -> Result<Bounds> {
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
