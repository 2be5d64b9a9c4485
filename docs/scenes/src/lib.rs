//! What the report and the conformance tests run on: scenes (made up, or read from JSON or glTF)
//! and the techniques.

mod echo;
mod gltf_scene;
mod job;
mod model;
mod scene;
mod sight;
mod solid;
mod technique;
mod text;

pub use echo::echo;
pub use gltf_scene::GltfScene;
pub use job::Job;
pub use model::Model;
pub use scene::{AxesName, Boxes, Camera, Cuboid, Directional, Lamp, NearDepthName, Orthographic, Point, Scene, Spot};
pub use technique::{TECHNIQUES, Technique};
