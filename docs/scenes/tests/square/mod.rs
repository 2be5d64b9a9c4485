//! A glTF file of a square, and changes to it.
#![allow(dead_code, reason = "each of the tests needs a part of it")]

use std::path::Path;

use base64::Engine;
use scenes::GltfScene;
use serde_json::{Value, json};
use shadow_warp::glam::DVec3;

/// A data URI of some bytes.
pub(crate) fn data(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}

/// Four points of a square, in the order of a strip, with indices to two triangles behind them.
pub(crate) fn square() -> Value {
    let points: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    let indices: [u16; 6] = [0, 1, 2, 2, 1, 3];
    let mut bytes: Vec<u8> = points.iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
    json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "translation": [0, 0, 5] }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "buffers": [{ "byteLength": 60, "uri": data(&bytes) }],
        "bufferViews": [{ "buffer": 0, "byteLength": 48 }, { "buffer": 0, "byteOffset": 48, "byteLength": 12 }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] },
            { "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" }
        ]
    })
}

/// The square with other values, or none where that is null, at paths such as `/asset/version`.
pub(crate) fn changed(changes: &[(&str, Value)]) -> Value {
    let mut gltf = square();
    for (path, value) in changes {
        let (parent, key) = path.rsplit_once('/').unwrap();
        let parent = gltf.pointer_mut(parent).expect(path);
        match (parent.as_array_mut(), value) {
            (Some(array), value) => array[key.parse::<usize>().unwrap()] = value.clone(),
            (None, Value::Null) => drop(parent.as_object_mut().unwrap().remove(key)),
            (None, value) => drop(parent.as_object_mut().unwrap().insert((*key).to_owned(), value.clone())),
        }
    }
    gltf
}

pub(crate) fn triangles(changes: &[(&str, Value)]) -> anyhow::Result<Vec<[DVec3; 3]>> {
    with_file(changed(changes).to_string().as_bytes(), |path| GltfScene::read(path)?.triangles())
}

/// Reads a file that holds some bytes, and whose folder is gone afterwards.
pub(crate) fn read(bytes: &[u8]) -> anyhow::Result<GltfScene> {
    with_file(bytes, GltfScene::read)
}

fn with_file<T>(bytes: &[u8], read: impl FnOnce(&Path) -> anyhow::Result<T>) -> anyhow::Result<T> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("square.gltf");
    std::fs::write(&path, bytes)?;
    read(&path)
}
