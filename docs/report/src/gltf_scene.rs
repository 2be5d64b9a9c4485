//! A scene from a glTF file: its bounds, its first camera, its first directional light.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use gltf::camera::Projection;
use gltf::json::validation::Checked;
use gltf::khr_lights_punctual::Kind;
use gltf::scene::Transform;
use gltf::{Node, Semantic};
use shadow_warp::glam::{DMat4, DQuat, DVec3, DVec4};

use crate::scene::{Camera, Cuboid, Directional, Lamp, Orthographic, Scene};

const MAP: [u32; 2] = [1024, 1024];
const PICTURE_HEIGHT: f64 = 1080.0;
const ASPECT: f64 = 16.0 / 9.0;
/// From the side and a little behind the made-up camera, which looks along +x or +z.
const SUN: [f64; 3] = [-0.3, 0.8, -0.5];

/// What the node tree holds, in world space.
struct Found {
    low: DVec3,
    high: DVec3,
    cameras: Vec<(Camera, f64)>,
    to_lights: Vec<DVec3>,
    skinned: bool,
}

/// Reads a scene, and says what was not in the file. Needs neither buffers nor images: accessors carry their bounds.
pub(crate) fn read(path: &Path) -> Result<(Scene, Vec<String>)> {
    let document = open(path)?;
    let found = walk(&document)?;
    ensure!(found.low.cmple(found.high).all(), "scene: holds no mesh with positions");

    let mut notes = vec!["Bounds: the box around the boxes of all meshes; it casts and it receives.".to_owned()];
    if found.skinned {
        notes.push("Skinned meshes are taken as they are stored, without their skin.".to_owned());
    }
    let (view, aspect) = match found.cameras.as_slice() {
        [] => {
            notes.push("Camera: made up from the bounds; the file has none.".to_owned());
            (made_up_camera(found.low, found.high), ASPECT)
        }
        [first, rest @ ..] => {
            notes.push(format!("Camera: the file's first ({} in all).", rest.len() + 1));
            first.clone()
        }
    };
    let to_light = match found.to_lights.as_slice() {
        [] => {
            notes.push("Light: made up; the file has no directional one.".to_owned());
            SUN
        }
        [first, rest @ ..] => {
            notes.push(format!("Light: the file's first directional one ({} in all).", rest.len() + 1));
            first.to_array()
        }
    };
    let bounds = Cuboid { min: found.low.to_array(), max: found.high.to_array() };
    // The cast saturates, and a picture has at least one pixel.
    let viewport = [(PICTURE_HEIGHT * aspect).round() as u32, PICTURE_HEIGHT as u32].map(|pixels| pixels.max(1));
    let light = Lamp { directional: Directional { to_light } };
    Ok((Scene { view, light, casters: bounds, receivers: bounds, map: MAP, viewport }, notes))
}

fn open(path: &Path) -> Result<gltf::Document> {
    let root = gltf::Gltf::from_slice_without_validation(&std::fs::read(path)?)?.document.into_json();
    // The validation that follows looks positions up before it checks that they are there.
    for (i, mesh) in root.meshes.iter().enumerate() {
        for (j, primitive) in mesh.primitives.iter().enumerate() {
            let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            let there = positions.is_none_or(|accessor| accessor.value() < root.accessors.len());
            ensure!(there, "meshes[{i}].primitives[{j}].attributes.POSITION must be the index of an accessor");
        }
    }
    Ok(gltf::Document::from_json(root)?)
}

fn walk(document: &gltf::Document) -> Result<Found> {
    let scene = document.default_scene().or_else(|| document.scenes().next()).context("scenes: there are none")?;
    let mut found = Found {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
        cameras: Vec::new(),
        to_lights: Vec::new(),
        skinned: false,
    };
    let mut seen = vec![false; document.nodes().len()];
    let mut stack: Vec<(Node, DMat4)> = scene.nodes().map(|node| (node, DMat4::IDENTITY)).collect();
    stack.reverse();
    while let Some((node, parent)) = stack.pop() {
        // The format demands a tree; a ring would never end.
        if let Some(seen) = seen.get_mut(node.index()) {
            ensure!(!std::mem::replace(seen, true), "nodes[{}] must have one parent", node.index());
        }
        let world = parent * local(node.transform());
        found.include(&node, world)?;
        let first_child = stack.len();
        stack.extend(node.children().map(|child| (child, world)));
        stack[first_child..].reverse();
    }
    Ok(found)
}

impl Found {
    fn include(&mut self, node: &Node, world: DMat4) -> Result<()> {
        self.skinned |= node.skin().is_some();
        let positions = node
            .mesh()
            .into_iter()
            .flat_map(|mesh| mesh.primitives().filter_map(|part| part.get(&Semantic::Positions)).collect::<Vec<_>>());
        for accessor in positions {
            let corner = |value: Option<gltf::json::Value>, which: &str| {
                let numbers = value.and_then(|value| serde_json::from_value::<[f64; 3]>(value).ok());
                let name = || format!("accessors[{}].{which} must be three numbers", accessor.index());
                numbers.map(DVec3::from).with_context(name)
            };
            let (low, high) = (corner(accessor.min(), "min")?, corner(accessor.max(), "max")?);
            for bits in 0..8 {
                let at_high = DVec3::new(f64::from(bits & 1), f64::from(bits >> 1 & 1), f64::from(bits >> 2 & 1));
                let p = world.transform_point3(low + (high - low) * at_high);
                ensure!(p.is_finite(), "nodes[{}]: its mesh must lie at a finite place", node.index());
                (self.low, self.high) = (self.low.min(p), self.high.max(p));
            }
        }
        // Cameras look, and directional lights shine, along the -z axis of their node.
        let axis = |column: DVec4| column.truncate();
        if let Some(camera) = node.camera() {
            let frame = [axis(world.w_axis), -axis(world.z_axis), axis(world.y_axis)];
            self.cameras.push(camera_of(camera.projection(), frame));
        }
        if node.light().is_some_and(|light| matches!(light.kind(), Kind::Directional)) {
            self.to_lights.push(axis(world.z_axis));
        }
        Ok(())
    }
}

fn local(transform: Transform) -> DMat4 {
    match transform {
        Transform::Matrix { matrix } => DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from))),
        Transform::Decomposed { translation, rotation, scale } => DMat4::from_scale_rotation_translation(
            scale.map(f64::from).into(),
            DQuat::from_array(rotation.map(f64::from)).normalize(),
            translation.map(f64::from).into(),
        ),
    }
}

/// A camera and its picture's width over height.
fn camera_of(projection: Projection, frame: [DVec3; 3]) -> (Camera, f64) {
    let [eye, forward, up] = frame.map(|v| v.to_array());
    let pieces = Camera { eye, forward, up, ..Camera::default() };
    match projection {
        Projection::Perspective(lens) => {
            let aspect = lens.aspect_ratio().map_or(ASPECT, f64::from);
            let fov_y_deg = Some(f64::from(lens.yfov()).to_degrees());
            let (near, far) = (f64::from(lens.znear()), lens.zfar().map(f64::from));
            (Camera { fov_y_deg, aspect: Some(aspect), near, far, ..pieces }, aspect)
        }
        Projection::Orthographic(lens) => {
            let [width, height] = [lens.xmag(), lens.ymag()].map(|half| 2.0 * f64::from(half));
            let (near, far) = (f64::from(lens.znear()), Some(f64::from(lens.zfar())));
            let orthographic = Some(Orthographic { width, height });
            (Camera { orthographic, near, far, ..pieces }, width / height)
        }
    }
}

/// Looks along the longer horizontal axis, down at the middle, from a little above and before one end of the box.
fn made_up_camera(low: DVec3, high: DVec3) -> Camera {
    let (size, middle) = (high - low, low + 0.5 * (high - low));
    let along = if size.x > size.z { DVec3::X } else { DVec3::Z };
    let length = if size.max_element() > 0.0 { size.max_element() } else { 1.0 };
    let above = DVec3::Y * (0.5 * size.y + 0.1 * length);
    let eye = middle + above - along * (0.5 * size.dot(along) + 0.05 * length);
    let forward = middle - eye;
    Camera {
        eye: eye.to_array(),
        forward: forward.to_array(),
        up: DVec3::Y.to_array(),
        fov_y_deg: Some(50.0),
        aspect: Some(ASPECT),
        near: length / 200.0,
        far: None,
        ..Camera::default()
    }
}
