//! What the report and the conformance tests run on: scenes (made up, or read from JSON or glTF) and the techniques.

mod gltf_scene;
mod model;
mod scene;
mod solid;
mod technique;

pub use gltf_scene::GltfScene;
pub use model::Model;
pub use scene::{Camera, Cuboid, Directional, Job, Lamp, Orthographic, Point, Scene, Spot};
pub use technique::{TECHNIQUES, Technique};
