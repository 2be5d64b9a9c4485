//! What the format allows besides plain meshes: names of applications, extensions, integers, other
//! files' parts. And what it does not allow.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "tests")]

mod square;

use serde_json::{Value, json};
use shadow_warp::glam::DVec3;

use square::{changed, data, read, square, triangles};

/// The error of a changed file.
fn said(changes: &[(&str, Value)]) -> String {
    match read(changed(changes).to_string().as_bytes()).and_then(|file| file.triangles()) {
        Ok(triangles) => format!("no error, but {} triangles", triangles.len()),
        Err(error) => format!("{error:#}"),
    }
}

#[test]
fn attributes_of_any_kind() {
    let plain = triangles(&[]).unwrap();
    for name in [
        "_PART",
        "_",
        "_feature_id_0",
        "NORMAL",
        "TANGENT",
        "TEXCOORD_2",
        "TEXCOORD_9",
        "COLOR_1",
        "JOINTS_1",
        "WEIGHTS_1",
        "KHR_gaussian_splatting:SCALE",
    ] {
        let path = format!("/meshes/0/primitives/0/attributes/{name}");
        assert_eq!(triangles(&[(&path, json!(1))]).expect(name), plain, "{name}");
        let error = said(&[(&path, json!(7))]);
        assert!(error.contains(&format!("attributes.{name} must be the index of an accessor")), "{error}");
    }
    for name in ["BANANA", "TEXCOORD", "TEXCOORD_x", "position", ""] {
        let error = said(&[(&format!("/meshes/0/primitives/0/attributes/{name}"), json!(1))]);
        assert!(error.contains("meshes[0].primitives[0].attributes"), "{error}");
    }
    let target = json!([{ "POSITION": 0, "_PART": 0, "TEXCOORD_0": 0 }]);
    assert_eq!(triangles(&[("/meshes/0/primitives/0/targets", target)]).unwrap(), plain);
    // A part without positions is drawn by an extension, if at all.
    let parts = json!([{ "attributes": { "_PART": 1 } }, { "attributes": { "POSITION": 0 }, "indices": 1 }]);
    assert_eq!(triangles(&[("/meshes/0/primitives", parts)]).unwrap(), plain);
}

#[test]
fn extensions_that_leave_geometry_alone() {
    let plain = triangles(&[]).unwrap();
    for name in [
        "KHR_texture_transform",
        "KHR_texture_basisu",
        "EXT_texture_webp",
        "EXT_texture_avif",
        "MSFT_texture_dds",
        "KHR_materials_unlit",
        "KHR_materials_anisotropy",
        "KHR_materials_pbrSpecularGlossiness",
        "ADOBE_materials_thin_transparency",
        "KHR_lights_punctual",
        "EXT_lights_image_based",
        "KHR_animation_pointer",
        "KHR_xmp_json_ld",
        "KHR_mesh_quantization",
        "EXT_mesh_features",
        "EXT_structural_metadata",
        "CESIUM_primitive_outline",
    ] {
        let names = [("/extensionsUsed", json!([name])), ("/extensionsRequired", json!([name]))];
        assert_eq!(triangles(&names).expect(name), plain, "{name}");
    }
}

#[test]
fn what_is_not_geometry_does_not_matter() {
    let plain = triangles(&[]).unwrap();
    let cases = [
        ("/images", json!([{ "uri": "missing.ktx2" }, { "bufferView": 0, "mimeType": "image/ktx2" }, {}])),
        ("/textures", json!([{ "extensions": { "KHR_texture_basisu": { "source": 0 } } }, { "source": 99 }])),
        (
            "/materials",
            json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 5 } }, "alphaMode": "GLOW" }]),
        ),
        ("/samplers", json!([{ "wrapS": 1 }])),
        ("/animations", json!([{ "channels": [{ "sampler": 0, "target": { "path": "pointer" } }], "samplers": [] }])),
        ("/meshes/0/primitives/0/material", json!(0)),
        ("/extras", json!({ "a": [1, null] })),
        ("/nodes/0/extensions", json!({ "KHR_unheard_of": {} })),
        ("/extensionsUsed", json!(["KHR_unheard_of", "EXT_mesh_gpu_instancing"])),
    ];
    for (path, value) in cases {
        assert_eq!(triangles(&[(path, value)]).expect(path), plain, "{path}");
    }
    // Zeros, for the attribute of an application, lie nowhere. A buffer without geometry is not
    // looked for.
    let mut gltf = square();
    let accessors = gltf["accessors"].as_array_mut().unwrap();
    accessors.push(json!({ "componentType": 5126, "count": 4, "type": "SCALAR" }));
    gltf["meshes"][0]["primitives"][0]["attributes"]["_PART"] = json!(2);
    gltf["buffers"].as_array_mut().unwrap().push(json!({ "byteLength": 9, "uri": "missing.bin" }));
    gltf["bufferViews"].as_array_mut().unwrap().push(json!({ "buffer": 1, "byteLength": 9 }));
    gltf["images"] = json!([{ "bufferView": 2, "mimeType": "image/png" }]);
    assert_eq!(read(gltf.to_string().as_bytes()).unwrap().triangles().unwrap(), plain);
}

#[test]
fn what_may_hide_geometry_is_refused() {
    let compressed = ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];
    for name in compressed {
        let error = said(&[("/extensionsRequired", json!([name]))]);
        assert!(error.contains(&format!("compressed by {name}")) && error.contains("decompress"), "{error}");
    }
    for name in ["EXT_mesh_gpu_instancing", "KHR_node_visibility", "KHR_unheard_of", "nonsense"] {
        let error = said(&[("/extensionsRequired", json!([name]))]);
        assert!(error.contains(&format!("extensionsRequired: {name} may change the geometry")), "{error}");
    }
    // Used, and in truth required: there is no plain data.
    let draco = json!({ "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": { "POSITION": 0 } } });
    let part = json!({ "attributes": { "POSITION": 0 }, "indices": 1, "extensions": draco });
    let plain = ("/meshes/0/primitives/0", part);
    assert!(triangles(std::slice::from_ref(&plain)).is_ok());
    let error = said(&[plain, ("/accessors/0/bufferView", Value::Null)]);
    assert!(error.contains("meshes[0].primitives[0]: the geometry is compressed by KHR_draco"), "{error}");
    let fallback = json!({ "byteLength": 60, "extensions": { "EXT_meshopt_compression": { "fallback": true } } });
    let error = said(&[("/buffers/0", fallback)]);
    assert!(error.contains("buffers[0]: the geometry is compressed by EXT_meshopt"), "{error}");
    let long = "X".repeat(300);
    let error = said(&[("/extensionsRequired", json!([long]))]);
    assert!(error.matches('X').count() < 80, "{error}");
}

/// The corners of the square, in steps of 1 over a power of two that the integers hold exactly, or
/// normalised.
#[test]
fn integers_are_scaled_by_the_node() {
    let plain = triangles(&[]).unwrap();
    let half = |x: f32| if x > 0.5 { 64.0_f64 } else { 0.0 };
    let corners: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    // Component type, its size, and the greatest of the normalised integers.
    for (kind, size, greatest) in [(5120, 1, 127.0), (5121, 1, 255.0), (5122, 2, 32767.0), (5123, 2, 65535.0)] {
        for normalised in [false, true] {
            let stride = if size == 1 { 4 } else { 8 };
            let number = |x: f32| if normalised { if x > 0.5 { greatest } else { 0.0 } } else { half(x) };
            let mut bytes: Vec<u8> = Vec::new();
            for corner in corners.chunks_exact(3) {
                let whole = corner.iter().flat_map(|x| (number(*x) as u32).to_le_bytes().into_iter().take(size));
                bytes.extend(whole);
                bytes.resize(bytes.len().next_multiple_of(stride), 0);
            }
            bytes.resize(48, 0);
            bytes.extend([0_u16, 1, 2, 2, 1, 3].iter().flat_map(|i| i.to_le_bytes()));
            let scale = if normalised { 1.0 } else { 1.0 / 64.0 };
            let most = number(1.0);
            let changes = [
                ("/extensionsRequired", json!(["KHR_mesh_quantization"])),
                ("/buffers/0/uri", json!(data(&bytes))),
                ("/bufferViews/0/byteStride", json!(stride)),
                ("/accessors/0/componentType", json!(kind)),
                ("/accessors/0/normalized", json!(normalised)),
                ("/accessors/0/max", json!([most, most, 0])),
                ("/nodes/0/scale", json!([scale, scale, scale])),
            ];
            let file = read(changed(&changes).to_string().as_bytes()).unwrap();
            assert_eq!(file.triangles().unwrap(), plain, "{kind} {normalised}");
            let bounds = file.scene.receivers.all()[0];
            let corners = [bounds.min, bounds.max].map(DVec3::from);
            assert_eq!(corners, [DVec3::new(0.0, 0.0, 5.0), DVec3::new(1.0, 1.0, 5.0)], "{kind} {normalised}");
            // Not without the extension.
            let error = said(&changes[1..]);
            assert!(error.contains("POSITION must be floats in threes"), "{error}");
        }
    }
    // The least of the signed integers means -1 too.
    let least = [0x80_u8; 48].into_iter().chain([0; 12]).collect::<Vec<_>>();
    let changes = [
        ("/extensionsUsed", json!(["KHR_mesh_quantization"])),
        ("/buffers/0/uri", json!(data(&least))),
        ("/bufferViews/0/byteStride", json!(4)),
        ("/accessors/0/componentType", json!(5120)),
        ("/accessors/0/normalized", json!(true)),
        ("/accessors/0/min", json!([-128, -128, -128])),
    ];
    let file = read(changed(&changes).to_string().as_bytes()).unwrap();
    assert_eq!(file.triangles().unwrap()[0][0], DVec3::new(-1.0, -1.0, 4.0));
    assert_eq!(DVec3::from(file.scene.receivers.all()[0].min), DVec3::new(-1.0, -1.0, 4.0));
    let error =
        said(&[("/extensionsUsed", json!(["KHR_mesh_quantization"])), ("/accessors/0/componentType", json!(5125))]);
    assert!(error.contains("POSITION must be floats in threes, or integers of 8 or 16 bits"), "{error}");
}

#[test]
fn the_version_is_named() {
    for version in [json!("1.0"), json!("1.1"), json!("0.8"), json!(1), json!(1.0)] {
        let error = said(&[("/asset/version", version.clone())]);
        let name = version.as_str().unwrap_or("1.0");
        assert!(error.contains(&format!("glTF {name}, convert to 2.0")), "{error}");
    }
    // As the old format has it: objects by name, and no asset at all.
    let old = json!({ "meshes": { "a": {} }, "nodes": { "b": {} }, "buffers": {} }).to_string();
    let error = format!("{:#}", read(old.as_bytes()).err().unwrap());
    assert!(error.contains("glTF 1.0, convert to 2.0"), "{error}");
    // Binary, with the length of the scene and its format behind the header.
    let binary: Vec<u8> =
        b"glTF".iter().copied().chain([1, 0, 0, 0, 22, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0]).chain(*b"{}").collect();
    let error = format!("{:#}", read(&binary).err().unwrap());
    assert!(error.contains("glTF 1.0, convert to 2.0"), "{error}");
    let error = said(&[("/asset/version", json!("3.0"))]);
    assert!(error.contains("this reads glTF 2.0, and the file is glTF 3.0"), "{error}");
    let error = said(&[("/asset/minVersion", json!("2.1"))]);
    assert!(error.contains("asset.minVersion"), "{error}");
    assert!(triangles(&[("/asset/version", json!("2.1")), ("/asset/minVersion", json!("2.0"))]).is_ok());
    let error = said(&[("/asset", json!({}))]);
    assert!(error.contains("asset.version: missing field"), "{error}");
}

#[test]
fn a_byte_order_mark_is_skipped() {
    let text = square().to_string();
    let marked = format!("\u{feff}{text}");
    assert!(read(marked.as_bytes()).is_ok());
    let mut binary = b"glTF\x02\0\0\0".to_vec();
    let padded = marked.clone() + &" ".repeat((4 - marked.len() % 4) % 4);
    binary.extend((20 + padded.len() as u32).to_le_bytes());
    binary.extend((padded.len() as u32).to_le_bytes());
    binary.extend(b"JSON");
    binary.extend(padded.as_bytes());
    assert!(read(&binary).is_ok());
    let wide: Vec<u8> = marked.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let error = format!("{:#}", read(&wide).err().unwrap());
    assert!(error.contains("must be UTF-8, and is UTF-16"), "{error}");
}

#[test]
fn errors_of_invalid_files_stay() {
    let cases = [
        ("/nodes/0/mesh", json!(3), "nodes[0].mesh: the index is out of bounds"),
        ("/meshes/0/primitives/0/mode", json!(9), "meshes[0].primitives[0].mode: the value is invalid"),
        ("/accessors/0/type", json!("VEC9"), "accessors[0].type: the value is invalid"),
        ("/accessors/0/componentType", json!(1), "accessors[0].componentType: the value is invalid"),
        ("/accessors/0/min", Value::Null, "meshes[0].primitives[0].attributes.POSITION.min: is missing"),
        ("/accessors/0/bufferView", json!(9), "accessors[0].bufferView: the index is out of bounds"),
        ("/accessors/0/bufferView", Value::Null, "POSITION must lie in its buffer"),
        ("/accessors/0/count", Value::Null, "accessors[0].count: missing field"),
        ("/bufferViews/0/buffer", json!(2), "bufferViews[0].buffer: the index is out of bounds"),
        ("/scenes/0/nodes", json!([5]), "scenes[0].nodes[0]: the index is out of bounds"),
        ("/nodes", json!({}), "nodes: invalid type: map"),
    ];
    for (path, value, names) in cases {
        let error = said(&[(path, value)]);
        assert!(error.contains(names), "{path}: {error}");
    }
}
