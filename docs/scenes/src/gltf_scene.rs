//! A scene from a glTF file: its bounds, its triangles, its first camera, its first directional
//! light.

mod file;
mod geometry;
mod viewpoint;

use std::path::Path;

use anyhow::{Context, Result, ensure};
use gltf::camera::Projection;
use gltf::khr_lights_punctual::Kind;
use gltf::scene::Transform;
use gltf::{Node, Semantic};
use shadow_warp::glam::{DMat4, DQuat, DVec3, DVec4};

use self::file::File;
use self::viewpoint::ASPECT;
use crate::scene::{Camera, Cuboid, Lamp, Orthographic, Scene};

const MAP: [u32; 2] = [1024, 1024];
const PICTURE_HEIGHT: f64 = 1080.0;
/// From the side and a little behind a camera that looks along +x or +z.
const SUN: DVec3 = DVec3::new(-0.3, 0.8, -0.5);

/// What the node tree holds, in world space.
struct Found {
    low: DVec3,
    high: DVec3,
    cameras: Vec<(Camera, f64)>,
    to_lights: Vec<DVec3>,
    /// Indices of the nodes that hold one.
    meshes: Vec<(usize, DMat4)>,
    skinned: bool,
    morphed: bool,
}

/// A glTF file that has been read, but for its buffers.
pub struct GltfScene {
    /// Bounds, camera and light. What the file lacks is made up from its bounds.
    pub scene: Scene,
    /// What was made up, and how the file was taken.
    pub notes: Vec<String>,
    file: File,
    meshes: Vec<(usize, DMat4)>,
}

impl GltfScene {
    /// Reads a file. Accessors carry their bounds: only a camera that has to be made up needs
    /// buffers, and does without where they cannot be read. Images are never needed.
    ///
    /// # Errors
    /// If the file cannot be read, is no glTF 2.0, requires an extension that may change or hide
    /// its geometry, or holds no mesh with positions at finite places.
    pub fn read(path: &Path) -> Result<Self> {
        let file = File::open(path)?;
        let found = walk(&file.document)?;
        ensure!(found.low.cmple(found.high).all(), "scene: holds no mesh with positions");
        let (scene, notes) = found.scene(&file);
        Ok(Self { scene, notes, file, meshes: found.meshes })
    }

    /// Returns the triangles of all meshes, in world space.
    ///
    /// # Errors
    /// If a buffer cannot be read, or a mesh refers to what is not in it.
    pub fn triangles(&self) -> Result<Vec<[DVec3; 3]>> {
        self.file.triangles(&self.meshes)
    }
}

impl Found {
    /// The scene, and what was not in the file.
    fn scene(&self, file: &File) -> (Scene, Vec<String>) {
        let mut notes = vec!["Bounds: the box around the boxes of all meshes; it casts and it receives.".to_owned()];
        if self.skinned {
            notes.push("Skinned meshes are taken as they are stored, without their skin.".to_owned());
        }
        if self.morphed {
            notes.push("Meshes with morph targets are taken as they are stored, without these.".to_owned());
        }
        let sun = self.to_lights.first().copied().unwrap_or(SUN);
        let (view, aspect) = match self.cameras.as_slice() {
            [] => {
                let triangles = file.triangles(&self.meshes).unwrap_or_default();
                let (camera, count) = viewpoint::made_up(self.low, self.high, &triangles, sun);
                let which = if triangles.is_empty() {
                    "from the bounds".to_owned()
                } else {
                    format!("the one of {count} about the bounds whose picture tells most")
                };
                notes.push(format!("Camera: made up, {which}; the file has none."));
                (camera, ASPECT)
            }
            [first, rest @ ..] => {
                notes.push(format!("Camera: the file's first ({} in all).", rest.len() + 1));
                first.clone()
            }
        };
        notes.push(match self.to_lights.len() {
            0 => "Light: made up; the file has no directional one.".to_owned(),
            count => format!("Light: the file's first directional one ({count} in all)."),
        });
        let bounds = Cuboid { min: self.low.to_array(), max: self.high.to_array() };
        // The cast saturates, and a picture has at least one pixel.
        let viewport = [(PICTURE_HEIGHT * aspect).round() as u32, PICTURE_HEIGHT as u32].map(|pixels| pixels.max(1));
        let light = Lamp::directional(sun.to_array());
        (Scene::new(view, light, bounds.into(), bounds.into(), MAP, viewport), notes)
    }
}

fn walk(document: &gltf::Document) -> Result<Found> {
    let scene = document.default_scene().or_else(|| document.scenes().next()).context("scenes: there are none")?;
    let mut found = Found {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
        cameras: Vec::new(),
        to_lights: Vec::new(),
        meshes: Vec::new(),
        skinned: false,
        morphed: false,
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
        if node.mesh().is_some() {
            self.meshes.push((node.index(), world));
        }
        let parts: Vec<_> = node.mesh().into_iter().flat_map(|mesh| mesh.primitives()).collect();
        self.morphed |= parts.iter().any(|part| part.morph_targets().len() > 0);
        let positions: Vec<_> = parts.iter().filter_map(|part| part.get(&Semantic::Positions)).collect();
        for accessor in positions {
            let corner = |value: Option<gltf::json::Value>, which: &str| {
                let numbers = value.and_then(|value| serde_json::from_value::<[f64; 3]>(value).ok());
                let name = || format!("accessors[{}].{which} must be three numbers", accessor.index());
                numbers.map(|numbers| geometry::in_units(&accessor, numbers)).with_context(name)
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
