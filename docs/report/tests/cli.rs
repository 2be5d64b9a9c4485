//! The program as its users run it.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "tests")]

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::{Value, json};

const PAPER: &str = include_str!("../scenes/paper.json");

fn report(args: &[&str], stdin: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_report"));
    command.args(args).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    // A run that fails early may not read its input.
    let _ = child.stdin.take().unwrap().write_all(stdin.as_bytes());
    child.wait_with_output().unwrap()
}

fn json_of(output: &Output) -> Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn report_on(scene: &Value) -> Value {
    json_of(&report(&["--json", "--scene", "-"], &scene.to_string()))
}

fn paper() -> Value {
    serde_json::from_str(PAPER).unwrap()
}

/// The scene of the paper with another value, or none, at a path such as `/view/near`.
fn paper_with(path: &str, value: Option<Value>) -> Value {
    let mut scene = paper();
    let (parent, key) = path.rsplit_once('/').unwrap();
    let parent = scene.pointer_mut(parent).unwrap().as_object_mut().unwrap();
    match value {
        Some(value) => parent.insert(key.to_owned(), value),
        None => parent.remove(key),
    };
    scene
}

fn spot(outer_deg: f64) -> Value {
    json!({ "position": [0, 90, 0], "direction": [0, -1, 0], "outer_deg": outer_deg, "near": 1, "range": 200 })
}

/// A page without its drawn pictures, whose letters say anything.
fn without_pictures(html: &str) -> String {
    let mut parts = html.split("src=\"data:image/png;base64,");
    let first = parts.next().unwrap().to_owned();
    parts.fold(first, |page, part| page + part.split_once('"').unwrap().1)
}

fn assert_refused(output: &Output, names: &str) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{names}: {stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert!(stderr.contains(names), "`{names}` is not in: {stderr}");
    assert!(output.stdout.is_empty(), "{names}");
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Normalised device coordinates of a point, by a row-major matrix.
fn project(matrix: &[f64], p: &[f64]) -> [f64; 3] {
    let row = |i: usize| (0..3).map(|j| matrix[4 * i + j] * p[j]).sum::<f64>() + matrix[4 * i + 3];
    [row(0) / row(3), row(1) / row(3), row(2) / row(3)]
}

#[test]
fn json_has_the_promised_fields() {
    let report = json_of(&report(&["--json"], ""));
    let techniques = report["techniques"].as_array().unwrap();
    let names: Vec<&str> = techniques.iter().map(|row| row["name"].as_str().unwrap()).collect();
    assert_eq!(names[..2], ["uniform", "lispsm"]);
    for row in techniques {
        for field in ["eta", "warp_ratio", "worst_pixels_per_texel", "mean_pixels_per_texel", "map_share", "setup_ns"] {
            assert!(row[field].as_f64().is_some_and(f64::is_finite), "{field}");
        }
        for matrix in ["clip_from_world", "clip_from_eye", "clip_from_body"] {
            assert_eq!(numbers(&row[matrix]).len(), 16, "{matrix}");
        }
        let (worst, mean) = (&row["worst_pixels_per_texel"], &row["mean_pixels_per_texel"]);
        assert!(worst.as_f64() >= mean.as_f64());
        let share = row["map_share"].as_f64().unwrap();
        assert!(share > 0.3 && share <= 1.0, "{share}");
        for place in ["eye", "world"] {
            let (seen, bound) = (&row["f32_texels"][place], &row["f32_texels"][format!("{place}_bound")]);
            assert!(seen.as_f64().unwrap() <= bound.as_f64().unwrap(), "{place}");
        }
    }
    assert_eq!(techniques[0]["eta"], 0.0);
    assert_eq!(techniques[0]["warp_ratio"], 1.0);
    assert!(techniques[1]["worst_pixels_per_texel"].as_f64() < techniques[0]["worst_pixels_per_texel"].as_f64());
    assert!(report["body"]["receiver_vertices"].as_array().unwrap().len() >= 8);
    assert!(report["body"]["caster_vertices"].as_array().unwrap().len() >= 8);
    assert_eq!(report["view"]["forward"], json!([0.0, 0.0, 1.0]));
    assert!(report.get("reason").is_none());
}

#[test]
fn matrices_fit_the_receivers() {
    let tangents = {
        let mut scene = paper_with("/view/tangents", Some(json!([-0.3, 0.5, -0.2, 0.6])));
        let view = scene["view"].as_object_mut().unwrap();
        view.remove("fov_y_deg");
        view.remove("aspect");
        scene
    };
    for scene in [paper(), paper_with("/view/far", None), tangents] {
        let report = report_on(&scene);
        let vertices: Vec<Vec<f64>> =
            report["body"]["receiver_vertices"].as_array().unwrap().iter().map(numbers).collect();
        for row in report["techniques"].as_array().unwrap() {
            let matrix = numbers(&row["clip_from_world"]);
            let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            for vertex in &vertices {
                let ndc = project(&matrix, vertex);
                for axis in 0..3 {
                    low[axis] = low[axis].min(ndc[axis]);
                    high[axis] = high[axis].max(ndc[axis]);
                }
            }
            let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
            for axis in 0..2 {
                assert!(close(low[axis], -1.0) && close(high[axis], 1.0), "{}: {low:?} {high:?}", row["name"]);
            }
            // The far plane is the receivers', the near plane the casters'.
            assert!(low[2] > -1e-9 && close(high[2], 1.0), "{}: {low:?} {high:?}", row["name"]);
        }
    }
}

#[test]
fn the_three_matrices_agree() {
    let report = json_of(&report(&["--json"], ""));
    let eye = numbers(&report["view"]["eye"]);
    for row in report["techniques"].as_array().unwrap() {
        let body = numbers(&row["body_origin"]);
        for vertex in report["body"]["receiver_vertices"].as_array().unwrap() {
            let p = numbers(vertex);
            let relative = |origin: &[f64]| p.iter().zip(origin).map(|(a, b)| a - b).collect::<Vec<f64>>();
            let world = project(&numbers(&row["clip_from_world"]), &p);
            let from_eye = project(&numbers(&row["clip_from_eye"]), &relative(&eye));
            let from_body = project(&numbers(&row["clip_from_body"]), &relative(&body));
            for axis in 0..3 {
                assert!((world[axis] - from_eye[axis]).abs() < 1e-10);
                assert!((world[axis] - from_body[axis]).abs() < 1e-10);
            }
        }
    }
}

#[test]
fn bad_scenes_are_refused_by_name() {
    let cases = [
        ("/view/near", Some(json!(0)), "view.near must"),
        ("/view/near", Some(json!(500)), "view.far must be greater than near"),
        ("/view/near", Some(json!("x")), "view.near: invalid type"),
        ("/view/near", None, "view.near: missing field"),
        ("/view/eye", Some(json!([1, 2])), "view.eye: invalid length 2"),
        ("/view/eye", Some(json!([1, 2, 3, 4])), "view.eye: too many elements"),
        ("/view/eye", Some(json!([1e300, 0, 0])), "view.eye must be finite"),
        ("/view/up", Some(json!([0, 0, 2])), "view.up must not be parallel"),
        ("/view/forward", Some(json!([0, 0, 0])), "view.forward must"),
        ("/view/fov_y_deg", Some(json!(180)), "view.fov_y_deg must be between 0 and 180 degrees"),
        ("/view/fov_y_deg", None, "view.fov_y_deg must go with view.aspect"),
        ("/view/aspect", Some(json!(-1)), "view.aspect must be positive"),
        ("/view/tangents", Some(json!([-1, 1, -1, 1])), "view must have one of"),
        ("/view/zoom", Some(json!(1)), "view.zoom: unknown field"),
        ("/light/directional/to_light", Some(json!([0, 0, 0])), "light.directional.to_light must"),
        ("/light/point", Some(json!({})), "light.point: unknown field"),
        ("/light/spot", Some(json!({ "position": [0, 9, 0] })), "light.spot.direction: missing field"),
        ("/light/spot", Some(spot(40.0)), "light must have one of directional and spot"),
        ("/light", Some(json!({ "spot": spot(90.0) })), "light.spot.outer_deg must be between 0 and 90 degrees"),
        ("/light", Some(json!({ "spot": spot(40.0) })), "spot or point light"),
        ("/casters/min", Some(json!([300, 0, 0])), "casters.min must not be greater than max"),
        ("/receivers/max", Some(json!([1, null, 1])), "receivers.max[1]: invalid type"),
        ("/map", Some(json!([0, 1024])), "map must not be zero"),
        ("/map", Some(json!([-1, 1024])), "map[0]: invalid value"),
        ("/viewport", Some(json!([1, 2, 3])), "viewport: too many elements"),
        ("/light", None, "light: missing field"),
        ("/sky", Some(json!(1)), "sky: unknown field"),
    ];
    for (path, value, names) in cases {
        let scene = paper_with(path, value).to_string();
        assert_refused(&report(&["--json", "--scene", "-"], &scene), names);
    }
    for number in ["NaN", "1e999", "-Infinity"] {
        let text = PAPER.replace("\"near\": 1", &format!("\"near\": {number}"));
        assert_refused(&report(&["--json", "--scene", "-"], &text), "view.near: ");
    }
    for text in ["", "{", "null", "[1]", "{} {}"] {
        assert_refused(&report(&["--json", "--scene", "-"], text), "stdin: ");
    }
}

#[test]
fn bad_files_and_flags_are_refused() {
    assert_refused(&report(&["--scene", "no/such.json"], ""), "no/such.json");
    assert_refused(&report(&["--gltf", "no/such.glb"], ""), "no/such.glb");
    let no_gltf = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
    assert_refused(&report(&["--gltf", no_gltf], ""), "Cargo.toml: ");
    assert_refused(&report(&["--wrong"], ""), "--wrong");
    assert_refused(&report(&["--scene"], ""), "--scene");
    assert_refused(&report(&["--scene", "a", "--gltf", "b"], ""), "--gltf");
    let folder = tempfile::tempdir().unwrap();
    assert_refused(&report(&["--out", folder.path().to_str().unwrap()], ""), "--out");
}

#[test]
fn nothing_visible_is_no_error() {
    let behind = json!({ "min": [-10, 0, -200], "max": [10, 10, -195] });
    let report = report_on(&paper_with("/receivers", Some(behind)));
    assert_eq!(report["techniques"], json!([]));
    assert!(report["reason"].as_str().unwrap().contains("no receiver"));
    assert_eq!(report["body"]["receiver_vertices"], json!([]));
}

#[test]
fn degenerate_scenes_have_finite_numbers() {
    let point = json!({ "min": [0, 0, 0], "max": [0, 0, 0] });
    let flat = json!({ "min": [-200, 0, -200], "max": [200, 0, 200] });
    let line = json!({ "min": [0, 0, 0], "max": [0, 0, 100] });
    let along_view = paper_with("/light/directional/to_light", Some(json!([0, 0, 1])));
    let boxes = [point, flat, line].map(|receivers| paper_with("/receivers", Some(receivers)));
    let orthographic = {
        let mut scene = paper_with("/view/orthographic", Some(json!({ "width": 100, "height": 80 })));
        let view = scene["view"].as_object_mut().unwrap();
        view.remove("fov_y_deg");
        view.remove("aspect");
        view.insert("near".to_owned(), json!(-50));
        view.insert("far".to_owned(), Value::Null);
        scene
    };
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("page.html");
    let mut scenes_drawn = 0;
    for scene in boxes.into_iter().chain([along_view, orthographic]) {
        let output = report(&["--json", "--scene", "-", "--out", page.to_str().unwrap()], &scene.to_string());
        for row in json_of(&output)["techniques"].as_array().unwrap() {
            for field in ["eta", "worst_pixels_per_texel", "mean_pixels_per_texel", "map_share"] {
                assert!(row[field].as_f64().is_some_and(f64::is_finite), "{field}: {row}");
            }
            assert!(numbers(&row["clip_from_world"]).iter().all(|x| x.is_finite()));
        }
        let html = std::fs::read_to_string(&page).unwrap();
        assert!(!without_pictures(&html).contains("NaN"));
        // A body that is a line or a point is nothing to f32.
        let drawn = html.matches("data:image/png;base64,iVBORw0KGgo").count();
        assert!(drawn == 18 || html.contains("There are no drawn pictures: rounding to f32"), "{drawn} pictures");
        scenes_drawn += usize::from(drawn == 18);
    }
    assert!(scenes_drawn >= 3, "{scenes_drawn}");
}

#[test]
fn the_page_stands_alone() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("<b> & co.json");
    std::fs::write(&scene, PAPER).unwrap();
    let page = folder.path().join("new/page.html");
    let output = report(&["--scene", scene.to_str().unwrap(), "--out", page.to_str().unwrap()], "");
    assert!(output.status.success());
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(table.contains("lispsm-fixed-axes") && table.contains("page.html"));
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(html.contains("&lt;b&gt; &amp; co") && !html.contains("<b>"));
    assert!(html.matches("<svg").count() > 12);
    assert!(html.contains("data:image/png"), "{table}");
    let html = without_pictures(&html);
    for outside in ["<script", "<link", "src=", "href=", "NaN", "inf,"] {
        assert!(!html.contains(outside), "{outside}");
    }
}

#[test]
fn without_a_driver_the_page_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("page.html");
    let mut command = Command::new(env!("CARGO_BIN_EXE_report"));
    command.env("VK_ICD_FILENAMES", "/nonexistent").env("VK_DRIVER_FILES", "/nonexistent");
    let output = command.args(["--out", page.to_str().unwrap()]).output().unwrap();
    assert!(output.status.success());
    let reason = "no Vulkan driver: install one";
    assert!(String::from_utf8(output.stdout).unwrap().contains(reason));
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(html.contains(reason) && !html.contains("data:image/png"));
}

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
