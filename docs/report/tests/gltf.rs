//! Scenes from glTF files.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "tests")]

mod program;

use std::path::Path;
use std::process::Output;

use serde_json::{Value, json};

use program::{assert_refused, json_of, numbers, report, report_on};

/// A unit triangle's box, scaled and moved by its node; camera and light on turned nodes.
fn tiny_gltf() -> Value {
    let half_turn_about_y = json!([0, 1, 0, 0]);
    // A quarter turn about x, by which +z becomes -y.
    let quarter = json!([0.5f64.sqrt(), 0, 0, 0.5f64.sqrt()]);
    json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point" }, { "type": "directional" }] } },
        "scene": 0,
        "scenes": [{ "nodes": [0, 2, 3] }],
        "nodes": [
            { "translation": [10, 0, 20], "children": [1] },
            { "scale": [2, 3, 4], "mesh": 0 },
            { "translation": [11, 1, 0], "rotation": half_turn_about_y, "camera": 0 },
            { "children": [4, 5] },
            { "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "rotation": quarter, "extensions": { "KHR_lights_punctual": { "light": 1 } } }
        ],
        "cameras": [{
            "type": "perspective",
            "perspective": { "yfov": 1.0, "aspectRatio": 1.5, "znear": 0.5, "zfar": 100 }
        }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "buffers": [{
            "byteLength": 36,
            "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAIA/AAAAAAAAgD8AAAAA"
        }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "accessors": [{
            "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]
        }],
        "images": [{ "uri": "missing.png" }]
    })
}

fn report_on_gltf(folder: &Path, gltf: &Value) -> Output {
    let path = folder.join("tiny.gltf");
    std::fs::write(&path, gltf.to_string()).unwrap();
    report(&["--json", "--gltf", path.to_str().unwrap()], "")
}

fn assert_near(value: &Value, expected: &[f64]) {
    let value = numbers(value);
    assert!(value.len() == expected.len(), "{value:?}");
    assert!(value.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{value:?} {expected:?}");
}

#[test]
fn gltf_gives_bounds_camera_and_light() {
    let folder = tempfile::tempdir().unwrap();
    let report = json_of(&report_on_gltf(folder.path(), &tiny_gltf()));
    let scene = &report["scene"];
    assert_near(&scene["receivers"]["min"], &[10.0, 0.0, 20.0]);
    assert_near(&scene["receivers"]["max"], &[12.0, 3.0, 24.0]);
    assert_eq!(scene["casters"], scene["receivers"]);
    assert_near(&report["view"]["eye"], &[11.0, 1.0, 0.0]);
    assert_near(&report["view"]["forward"], &[0.0, 0.0, 1.0]);
    assert_near(&report["view"]["up"], &[0.0, 1.0, 0.0]);
    assert_near(&json!([report["view"]["near"], report["view"]["far"]]), &[0.5, 100.0]);
    assert_near(&json!([scene["view"]["aspect"]]), &[1.5]);
    assert_near(&report["light"]["to_light"], &[0.0, -1.0, 0.0]);
    assert_eq!(scene["viewport"], json!([1620, 1080]));
    assert!(!report["notes"].to_string().contains("made up"));
    // What it read is a scene file too, and gives the same.
    assert_eq!(report_on(scene)["techniques"][1]["clip_from_world"], report["techniques"][1]["clip_from_world"]);
}

#[test]
fn gltf_without_camera_and_light_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let mut gltf = tiny_gltf();
    gltf["scenes"][0]["nodes"] = json!([0]);
    let report = json_of(&report_on_gltf(folder.path(), &gltf));
    let notes = report["notes"].to_string();
    assert!(notes.contains("Camera: made up") && notes.contains("Light: made up"), "{notes}");
    assert!(report["techniques"].as_array().unwrap().len() > 1);
}

#[test]
fn bad_gltf_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        ("/nodes/1", json!({ "children": [0] }), "nodes[0] must have one parent"),
        ("/meshes/0/primitives/0/attributes", json!({ "POSITION": 7 }), "meshes[0].primitives[0].attributes.POSITION"),
        ("/accessors/0/min", json!([0, 0]), "min"),
        ("/accessors/0/max", json!([1e300, 0, 0]), "casters.max must be finite"),
        ("/scenes/0/nodes", json!([2]), "no mesh"),
        ("/cameras/0/perspective/znear", json!(200), "view.far must be greater"),
        ("/nodes/0/children", json!([9]), "nodes[0].children[0]"),
        ("/asset", json!(1), "tiny.gltf"),
    ];
    for (path, value, names) in cases {
        let mut gltf = tiny_gltf();
        *gltf.pointer_mut(path).expect(path) = value;
        assert_refused(&report_on_gltf(folder.path(), &gltf), names);
    }
}
