//! The scene as it is written down: `docs/scene-format.md` has every field.

use anyhow::{Result, anyhow};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Error as _, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use shadow_warp::{Axes, NearDepth};

use crate::echo::of_serde;
use crate::text::text;

/// A camera, a light, bounds and sizes: the input file.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, expecting = "a scene, which is an object")]
pub struct Scene {
    /// The camera.
    pub view: Camera,
    /// The light.
    pub light: Lamp,
    /// Bounds of all that casts shadows: their common box counts.
    pub casters: Boxes,
    /// Bounds of all that shadows are to be seen on, a body for each.
    pub receivers: Boxes,
    /// Texels of the map, `[width, height]`.
    pub map: [u32; 2],
    /// Pixels of the picture, `[width, height]`.
    pub viewport: [u32; 2],
    /// Which directions the texture's axes follow, for all techniques. Absent: each technique's
    /// own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axes: Option<AxesName>,
    /// Where the map's near plane lies. Absent: at the casters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub near_depth: Option<NearDepthName>,
    /// The depths along the view that the warp is chosen for, near and far. A far of null is
    /// infinite.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warp_depths: Option<(f64, Option<f64>)>,
}

/// [`Axes`], as it is written.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AxesName {
    /// [`Axes::View`].
    View,
    /// [`Axes::LightFixed`].
    LightFixed,
    /// [`Axes::Middle`].
    Middle,
    /// [`Axes::VertexMean`].
    VertexMean,
}

/// [`NearDepth`], as it is written.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NearDepthName {
    /// [`NearDepth::Casters`].
    Casters,
    /// [`NearDepth::Receivers`].
    Receivers,
}

impl From<AxesName> for Axes {
    fn from(name: AxesName) -> Self {
        match name {
            AxesName::View => Self::View,
            AxesName::LightFixed => Self::LightFixed,
            AxesName::Middle => Self::Middle,
            AxesName::VertexMean => Self::VertexMean,
        }
    }
}

impl From<NearDepthName> for NearDepth {
    fn from(name: NearDepthName) -> Self {
        match name {
            NearDepthName::Casters => Self::Casters,
            NearDepthName::Receivers => Self::Receivers,
        }
    }
}

/// A camera with exactly one lens: `fov_y_deg` with `aspect`, `tangents` (left, right, bottom,
/// top), or `orthographic`.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, expecting = "a camera, which is an object")]
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
#[serde(deny_unknown_fields, expecting = "an object with width and height")]
pub struct Orthographic {
    /// Along the camera's right.
    pub width: f64,
    /// Along its up.
    pub height: f64,
}

/// A light of exactly one kind.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, expecting = "a light, which is an object")]
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
#[serde(deny_unknown_fields, expecting = "an object with to_light")]
pub struct Directional {
    /// Towards the light; any length.
    pub to_light: [f64; 3],
}

/// A light in a place that shines into a cone.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, expecting = "a spot light, which is an object")]
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
#[serde(deny_unknown_fields, expecting = "a point light, which is an object")]
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
#[serde(deny_unknown_fields, expecting = "a box, which is an object with min and max")]
pub struct Cuboid {
    /// Its least corner.
    pub min: [f64; 3],
    /// Its greatest corner.
    pub max: [f64; 3],
}

/// One box, or a list of at least one.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Boxes {
    /// Bounds of things of any shape. A picture furnishes them.
    One(Cuboid),
    /// Bounds of one thing each. A picture shows each box as a solid.
    Many(Vec<Cuboid>),
}

impl Boxes {
    /// Returns the boxes.
    #[must_use]
    pub fn all(&self) -> &[Cuboid] {
        match self {
            Self::One(cuboid) => std::slice::from_ref(cuboid),
            Self::Many(list) => list,
        }
    }

    /// Returns the same boxes, each changed.
    #[must_use]
    pub fn map(&self, change: impl Fn(Cuboid) -> Cuboid) -> Self {
        match self {
            Self::One(cuboid) => Self::One(change(*cuboid)),
            Self::Many(list) => Self::Many(list.iter().map(|&cuboid| change(cuboid)).collect()),
        }
    }
}

impl From<Cuboid> for Boxes {
    fn from(cuboid: Cuboid) -> Self {
        Self::One(cuboid)
    }
}

/// Not derived, so that an error names the field of the box.
impl<'de> Deserialize<'de> for Boxes {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OneOrMany;
        impl<'de> Visitor<'de> for OneOrMany {
            type Value = Boxes;

            fn expecting(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                formatter.write_str("a box or a list of boxes")
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Boxes, A::Error> {
                Cuboid::deserialize(MapAccessDeserializer::new(map)).map(Boxes::One)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Boxes, A::Error> {
                let list = Vec::deserialize(SeqAccessDeserializer::new(list))?;
                if list.is_empty() {
                    Err(A::Error::invalid_length(0, &"at least one box"))
                } else {
                    Ok(Boxes::Many(list))
                }
            }
        }
        deserializer.deserialize_any(OneOrMany)
    }
}

impl Scene {
    /// Returns a scene with default options.
    #[must_use]
    pub fn new(view: Camera, light: Lamp, casters: Boxes, receivers: Boxes, map: [u32; 2], viewport: [u32; 2]) -> Self {
        Self { view, light, casters, receivers, map, viewport, axes: None, near_depth: None, warp_depths: None }
    }

    /// Reads JSON. A byte-order mark is skipped.
    ///
    /// # Errors
    /// Names the field that is missing, unknown or of another type. The text must be UTF-8.
    pub fn parse(bytes: &[u8]) -> Result<Self> {
        let json = &mut serde_json::Deserializer::from_str(text(bytes)?);
        let named = |path: &str, error: &serde_json::Error| anyhow!("{}", of_serde(path, &error.to_string()));
        let scene = serde_path_to_error::deserialize(&mut *json)
            .map_err(|error| named(&error.path().to_string(), error.inner()))?;
        json.end().map_err(|error| named(".", &error))?;
        Ok(scene)
    }
}
