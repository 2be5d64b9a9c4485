//! Lights of every kind, and techniques that have no map for them.
#![expect(clippy::unwrap_used, reason = "tests")]

mod program;

use serde_json::{Value, json};

use program::{json_of, numbers, paper_with, project, report, report_on, spot, without_pictures};

fn under(light: Value) -> Value {
    paper_with("/light", Some(light))
}

fn lamp(position: [f64; 3]) -> Value {
    under(json!({ "point": { "position": position, "near": 1, "range": 300 } }))
}

fn rows(report: &Value) -> &[Value] {
    report["techniques"].as_array().unwrap()
}

/// Every row is whole, and its map holds a body's vertices and touches them with its sides and its
/// far plane.
fn assert_fits(rows: &[Value], body: &Value) {
    let vertices: Vec<Vec<f64>> = body["receiver_vertices"].as_array().unwrap().iter().map(numbers).collect();
    for row in rows {
        for field in ["eta", "warp_ratio", "worst_pixels_per_texel", "mean_pixels_per_texel", "map_share", "setup_ns"] {
            assert!(row[field].as_f64().is_some_and(f64::is_finite), "{field}: {row}");
        }
        // What is lit depends on the axes: a cone is taken as a pyramid about them.
        let is_cone = row.get("face").is_none();
        if row["name"] == "lispsm-middle" && is_cone {
            continue;
        }
        let matrix = numbers(&row["clip_from_world"]);
        let places: Vec<[f64; 3]> = vertices.iter().map(|vertex| project(&matrix, vertex)).collect();
        // With w from 1 to a million there are digits lost about the world's origin.
        let room = 1e-9 + 1e-14 * row["warp_ratio"].as_f64().unwrap();
        for (axis, [low, high]) in [[-1.0, 1.0], [-1.0, 1.0], [0.0, 1.0]].into_iter().enumerate() {
            let least = places.iter().map(|place| place[axis]).fold(f64::INFINITY, f64::min);
            let most = places.iter().map(|place| place[axis]).fold(f64::NEG_INFINITY, f64::max);
            let touches_low = axis == 2 || (least - low).abs() < room;
            assert!(least > low - room && touches_low, "{}: {least}", row["name"]);
            assert!((most - high).abs() < room, "{}: {most}", row["name"]);
        }
    }
}

#[test]
fn a_spot_light_has_a_table() {
    let scene =
        under(json!({ "spot": { "position": [60, 90, -40], "direction": [-4, -10, 3], "outer_deg": 45, "near": 1,
        "range": 300 } }));
    let folder = tempfile::tempdir().unwrap();
    let (page, figures) = (folder.path().join("page.html"), folder.path().join("figures"));
    let paths = [&page, &figures].map(|path| path.to_str().unwrap().to_owned());
    let output = report(&["--scene", "-", "--out", &paths[0], "--figures", &paths[1]], &scene.to_string());
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(
        table.contains("psm has no map: a perspective shadow map")
            && table.contains(" across over ratios, with this centre"),
        "{table}"
    );
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(html.contains("spot light at (60, 90, -40)") && html.contains("psm has no map"));
    assert!(html.contains("at a distance of 1 from the light") && html.contains("data:image/png"));
    assert!(!without_pictures(&html).contains("NaN"));
    assert!(figures.join("optimal-after.svg").is_file() && !figures.join("psm-after.svg").exists());

    let report = report_on(&scene);
    assert_fits(rows(&report), &report["body"]);
    assert_eq!(report["refused"].as_array().unwrap().len(), 1);
    let refused = &report["refused"][0];
    assert!(refused["name"] == "psm" && refused.get("face").is_none());
    assert!(refused["reason"].as_str().unwrap().contains("not supported here"));
    assert!(rows(&report).iter().all(|row| row["name"] != "psm"));
    assert_eq!(report["light"]["position"], json!([60.0, 90.0, -40.0]));
    assert_eq!(report["light"]["range"], 300.0);
    assert!((report["light"]["outer_deg"].as_f64().unwrap() - 45.0).abs() < 1e-12);
    assert!(report["body"]["caster_vertices"].as_array().unwrap().len() >= 8);
    let optimal = rows(&report).iter().find(|row| row["name"] == "optimal").unwrap();
    assert!(rows(&report).iter().all(|row| row["worst_over_least"].as_f64() >= optimal["worst_over_least"].as_f64()
        || row.get("worst_over_least").is_none()));
}

#[test]
fn a_point_light_has_six_maps() {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("page.html");
    let output =
        report(&["--json", "--scene", "-", "--out", page.to_str().unwrap()], &lamp([30.0, 30.0, -60.0]).to_string());
    let report = json_of(&output);
    let faces = report["faces"].as_array().unwrap();
    assert_eq!(
        faces.iter().map(|face| face["face"].as_str().unwrap()).collect::<Vec<_>>(),
        ["+x", "-x", "+y", "-y", "+z", "-z"]
    );
    for face in faces {
        let rows: Vec<Value> = rows(&report).iter().filter(|row| row["face"] == face["face"]).cloned().collect();
        let refused = report["refused"].as_array().unwrap().iter().filter(|row| row["face"] == face["face"]).count();
        assert_eq!(rows.len() + refused, 12, "{}", face["face"]);
        assert_fits(&rows, &face["body"]);
        assert!(face.get("reason").is_none() && face["least_errors"]["across"].as_f64().unwrap() > 0.0);
    }
    assert_eq!(report["light"], json!({ "position": [30.0, 30.0, -60.0], "near": 1.0, "range": 300.0 }));
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(
        html.contains("uniform +x") && html.contains("psm +x has no map") && !without_pictures(&html).contains("NaN")
    );
}

#[test]
fn faces_with_nothing_to_shadow_are_named() {
    let behind_the_camera = lamp([0.0, 30.0, -400.0]);
    let report = report_on(&behind_the_camera);
    let faces = report["faces"].as_array().unwrap();
    let dark: Vec<&str> =
        faces.iter().filter(|face| face.get("reason").is_some()).map(|face| face["face"].as_str().unwrap()).collect();
    assert!(dark.contains(&"-z") && !dark.contains(&"+z"), "{dark:?}");
    assert!(rows(&report).iter().all(|row| row["face"] == "+z" || !dark.contains(&row["face"].as_str().unwrap())));
    let output = crate::report(&["--scene", "-", "--out", "/dev/null"], &behind_the_camera.to_string());
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(table.contains("face -z needs no map: no receiver in view lies in the light"), "{table}");
}

#[test]
fn nothing_lit_is_no_error() {
    let up = json!({ "position": [0, 90, 0], "direction": [0, 1, 0], "outer_deg": 40, "near": 1, "range": 200 });
    for scene in [under(json!({ "spot": up })), lamp([0.0, 2000.0, 0.0])] {
        let report = report_on(&scene);
        assert_eq!(report["techniques"], json!([]));
        assert_eq!(report["reason"], "no receiver in view lies in the light");
    }
}

#[test]
fn parallel_light_and_view_are_noted() {
    let along = under(json!({ "directional": { "to_light": [0, 0, -1] } }));
    let askew = under(json!({ "directional": { "to_light": [0, 1e-9, -1] } }));
    let at_the_eye = {
        let mut light = spot(40.0);
        light["position"] = json!([0, 20, -190]);
        light["direction"] = json!([0, -0.1, 1]);
        under(json!({ "spot": light }))
    };
    for (scene, noted) in [(along, true), (askew, false), (at_the_eye, true)] {
        let report = report_on(&scene);
        assert_eq!(report["notes"].to_string().contains("Axes::LightFixed does not"), noted, "{}", report["notes"]);
        assert_fits(rows(&report), &report["body"]);
        assert!(rows(&report).len() > 8, "{}", report["refused"]);
    }
}
