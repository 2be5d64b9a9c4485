//! A scene from a glTF file: its bounds, its triangles, its first camera, its first directional light.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, ensure};
use base64::Engine;
use gltf::accessor::{Accessor, DataType, Dimensions};
use gltf::buffer::Source;
use gltf::camera::Projection;
use gltf::json::validation::Checked;
use gltf::khr_lights_punctual::Kind;
use gltf::mesh::{Mode, Primitive};
use gltf::scene::Transform;
use gltf::{Node, Semantic};
use shadow_warp::glam::{DMat4, DQuat, DVec3, DVec4};

use crate::scene::{Camera, Cuboid, Lamp, Orthographic, Scene};

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
    /// Indices of the nodes that hold one.
    meshes: Vec<(usize, DMat4)>,
    skinned: bool,
}

/// A glTF file that has been read, but for its buffers.
pub struct GltfScene {
    /// Bounds, camera and light. What the file lacks is made up from its bounds.
    pub scene: Scene,
    /// What was made up, and how the file was taken.
    pub notes: Vec<String>,
    document: gltf::Document,
    /// What a binary file holds after its JSON.
    blob: Option<Vec<u8>>,
    folder: PathBuf,
    meshes: Vec<(usize, DMat4)>,
}

impl GltfScene {
    /// Reads a file. Needs neither buffers nor images: accessors carry their bounds.
    ///
    /// # Errors
    /// If the file cannot be read, is no glTF, or holds no mesh with positions at finite places.
    pub fn read(path: &Path) -> Result<Self> {
        let (document, blob) = open(path)?;
        let found = walk(&document)?;
        ensure!(found.low.cmple(found.high).all(), "scene: holds no mesh with positions");
        let (scene, notes) = found.scene();
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        Ok(Self { scene, notes, document, blob, folder, meshes: found.meshes })
    }

    /// Returns the triangles of all meshes, in world space.
    ///
    /// # Errors
    /// If a buffer cannot be read, or a mesh refers to what is not in it.
    pub fn triangles(&self) -> Result<Vec<[DVec3; 3]>> {
        let buffers: Vec<Vec<u8>> =
            self.document.buffers().map(|buffer| self.buffer(&buffer)).collect::<Result<_>>()?;
        let mut triangles = Vec::new();
        for (node, world) in &self.meshes {
            let mesh =
                self.document.nodes().nth(*node).and_then(|node| node.mesh()).context("a node has lost its mesh")?;
            for part in mesh.primitives() {
                let name = || format!("meshes[{}].primitives[{}]", mesh.index(), part.index());
                triangles.extend(part_triangles(&part, &buffers, world).with_context(name)?);
            }
        }
        Ok(triangles)
    }

    fn buffer(&self, buffer: &gltf::Buffer) -> Result<Vec<u8>> {
        let name = || format!("buffers[{}]", buffer.index());
        match buffer.source() {
            Source::Bin => self.blob.clone().with_context(|| format!("{}: the file holds no data", name())),
            Source::Uri(uri) => match uri.strip_prefix("data:") {
                Some(rest) => {
                    let (_, data) =
                        rest.split_once(";base64,").with_context(|| format!("{}: must be base64", name()))?;
                    base64::engine::general_purpose::STANDARD.decode(data).with_context(name)
                }
                None => {
                    let name = || format!("{}: {uri}", name());
                    let path = self.folder.join(&*urlencoding::decode(uri).with_context(name)?);
                    ensure!(std::fs::metadata(&path).with_context(name)?.is_file(), "{} must be a file", name());
                    std::fs::read(path).with_context(name)
                }
            },
        }
    }
}

fn part_triangles(part: &Primitive, buffers: &[Vec<u8>], world: &DMat4) -> Result<Vec<[DVec3; 3]>> {
    // A part without positions is drawn by an extension, if at all.
    let Some(positions) = part.get(&Semantic::Positions) else { return Ok(Vec::new()) };
    // The reader takes these for granted.
    let is_float = positions.data_type() == DataType::F32 && positions.dimensions() == Dimensions::Vec3;
    ensure!(is_float && is_readable(&positions), "POSITION must be floats in threes, in their buffer view");
    let reader = part.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
    let positions = reader.read_positions().context("POSITION must lie in its buffer")?;
    let points: Vec<DVec3> = positions.map(|p| world.transform_point3(DVec3::from(p.map(f64::from)))).collect();
    ensure!(points.iter().all(|p| p.is_finite()), "POSITION must be finite");
    let order: Vec<usize> = match part.indices() {
        Some(indices) => {
            let is_whole = matches!(indices.data_type(), DataType::U8 | DataType::U16 | DataType::U32);
            let is_index = is_whole && indices.dimensions() == Dimensions::Scalar;
            ensure!(is_index && is_readable(&indices), "indices must be unsigned integers, in their buffer view");
            let indices = reader.read_indices().context("indices must lie in their buffer")?;
            indices.into_u32().map(|i| i as usize).collect()
        }
        None => (0..points.len()).collect(),
    };
    let corners: Vec<[usize; 3]> = match part.mode() {
        Mode::Triangles => order.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        // Every other triangle of a strip has its corners in the other order.
        Mode::TriangleStrip => (order.windows(3).enumerate())
            .map(|(i, t)| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] })
            .collect(),
        Mode::TriangleFan => match order.split_first() {
            Some((&first, rest)) => rest.windows(2).map(|t| [first, t[0], t[1]]).collect(),
            None => Vec::new(),
        },
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => Vec::new(),
    };
    // A mirrored node turns its triangles' winding about, which glTF says to undo.
    let mirrored = world.determinant() < 0.0;
    let triangle = |[a, b, c]: [usize; 3]| {
        let point = |i: usize| points.get(i).copied().ok_or_else(|| anyhow!("index {i} is beyond the positions"));
        let (b, c) = if mirrored { (c, b) } else { (b, c) };
        Ok([point(a)?, point(b)?, point(c)?])
    };
    corners.into_iter().map(triangle).collect()
}

/// Whether an accessor has elements, not too many, and they lie in its buffer view.
fn is_readable(accessor: &Accessor) -> bool {
    const MOST: usize = 1 << 26;
    let (count, size) = (accessor.count(), accessor.size());
    let fits = |view: gltf::buffer::View| {
        let stride = view.stride().unwrap_or(size);
        let end = stride.checked_mul(count - 1)?.checked_add(size)?.checked_add(accessor.offset())?;
        Some(stride >= size && end <= view.length() && view.offset().checked_add(view.length())? <= isize::MAX as usize)
    };
    let is_sparse_enough = accessor.sparse().is_none_or(|sparse| (1..=count).contains(&sparse.count()));
    (1..=MOST).contains(&count) && is_sparse_enough && accessor.view().is_none_or(|view| fits(view) == Some(true))
}

impl Found {
    /// The scene, and what was not in the file.
    fn scene(&self) -> (Scene, Vec<String>) {
        let mut notes = vec!["Bounds: the box around the boxes of all meshes; it casts and it receives.".to_owned()];
        if self.skinned {
            notes.push("Skinned meshes are taken as they are stored, without their skin.".to_owned());
        }
        let (view, aspect) = match self.cameras.as_slice() {
            [] => {
                notes.push("Camera: made up from the bounds; the file has none.".to_owned());
                (made_up_camera(self.low, self.high), ASPECT)
            }
            [first, rest @ ..] => {
                notes.push(format!("Camera: the file's first ({} in all).", rest.len() + 1));
                first.clone()
            }
        };
        let to_light = match self.to_lights.as_slice() {
            [] => {
                notes.push("Light: made up; the file has no directional one.".to_owned());
                SUN
            }
            [first, rest @ ..] => {
                notes.push(format!("Light: the file's first directional one ({} in all).", rest.len() + 1));
                first.to_array()
            }
        };
        let bounds = Cuboid { min: self.low.to_array(), max: self.high.to_array() };
        // The cast saturates, and a picture has at least one pixel.
        let viewport = [(PICTURE_HEIGHT * aspect).round() as u32, PICTURE_HEIGHT as u32].map(|pixels| pixels.max(1));
        let light = Lamp::directional(to_light);
        (Scene { view, light, casters: bounds, receivers: bounds, map: MAP, viewport }, notes)
    }
}

fn open(path: &Path) -> Result<(gltf::Document, Option<Vec<u8>>)> {
    let bytes = std::fs::read(path)?;
    // A binary file's header says how long the file is, itself included; the reader takes that for granted.
    let is_binary = bytes.starts_with(b"glTF");
    let length = bytes.get(8..12).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    ensure!(!is_binary || length.is_some_and(|length| length >= 12), "the file is shorter than its header");
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice_without_validation(&bytes)?;
    let root = document.into_json();
    // The validation that follows looks positions up before it checks that they are there.
    for (i, mesh) in root.meshes.iter().enumerate() {
        for (j, primitive) in mesh.primitives.iter().enumerate() {
            let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            let there = positions.is_none_or(|accessor| accessor.value() < root.accessors.len());
            ensure!(there, "meshes[{i}].primitives[{j}].attributes.POSITION must be the index of an accessor");
        }
    }
    Ok((gltf::Document::from_json(root)?, blob))
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
