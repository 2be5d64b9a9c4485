//! The program as its users run it.
#![expect(clippy::unwrap_used, reason = "tests")]

mod program;

use std::process::Command;

use serde_json::{Value, json};

use program::{
    PAPER, assert_refused, json_of, numbers, paper, paper_with, project, report, report_on, spot, without_pictures,
};

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
        assert!(share > 0.3 && share <= 1.0, "{}: {share}", row["name"]);
        assert!(row.get("face").is_none());
        let over_least = row.get("worst_over_least").map(|times| times.as_f64().unwrap());
        let has_other_axes =
            ["lispsm-fixed-axes", "lispsm-middle", "psm", "plane"].contains(&row["name"].as_str().unwrap());
        assert!(over_least.is_none_or(|times| times >= 1.0 - 1e-9) && over_least.is_none() == has_other_axes);
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
    assert!(report.get("reason").is_none() && report.get("faces").is_none());
    assert_eq!(report["refused"], json!([]));
    assert!(
        numbers(&json!([report["least_errors"]["along"], report["least_errors"]["across"]])).iter().all(|x| *x > 0.0)
    );
    assert_eq!(report["notes"], json!([]));
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
        ("/light/point", Some(json!({})), "light.point.position: missing field"),
        ("/light/moon", Some(json!({})), "light.moon: unknown field"),
        ("/light/spot", Some(json!({ "position": [0, 9, 0] })), "light.spot.direction: missing field"),
        ("/light/spot", Some(spot(40.0)), "light must have one of directional, spot and point"),
        ("/light", Some(json!({ "spot": spot(90.0) })), "light.spot.outer_deg must be between 0 and 90 degrees"),
        (
            "/light",
            Some(json!({ "point": { "position": [0, 9, 0], "near": 2, "range": 1 } })),
            "light.point.range must",
        ),
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
        let not_drawn = html.matches("There are no drawn pictures: rounding to f32").count();
        let rows = json_of(&output)["techniques"].as_array().unwrap().len();
        assert!(drawn + 3 * not_drawn == 3 * rows && rows > 8, "{drawn} pictures, {not_drawn} reasons, {rows} rows");
        scenes_drawn += usize::from(not_drawn == 0);
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
