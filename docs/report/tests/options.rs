//! What a scene may have besides a camera, a light and two boxes: lists of boxes, axes, the near
//! plane, the warp's depths.
#![expect(clippy::unwrap_used, reason = "tests")]

mod program;

use serde_json::{Value, json};

use program::{assert_refused, json_of, numbers, paper_with, project, report, report_on, without_pictures};

/// A flat ground and two houses on it.
fn houses() -> [Value; 3] {
    [
        json!({ "min": [-200, 0, -200], "max": [200, 0, 200] }),
        json!({ "min": [-20, 0, -20], "max": [-5, 30, 20] }),
        json!({ "min": [20, -3, -120], "max": [35, 20, -90] }),
    ]
}

fn with_lists() -> Value {
    let [ground, a, b] = houses();
    let mut scene = paper_with("/receivers", Some(json!([ground, a, b])));
    scene["casters"] = json!([a, b]);
    scene
}

fn with(field: &str, value: Value) -> Value {
    let mut scene = with_lists();
    scene[field] = value;
    scene
}

fn row<'a>(report: &'a Value, name: &str) -> &'a Value {
    report["techniques"].as_array().unwrap().iter().find(|row| row["name"] == name).unwrap()
}

/// The least and the greatest normalised device coordinates of points in a row's map.
fn extremes(row: &Value, points: &Value) -> [[f64; 3]; 2] {
    let matrix = numbers(&row["clip_from_world"]);
    let places = points.as_array().unwrap().iter().map(|point| project(&matrix, &numbers(point)));
    places.fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], place| {
        [[0, 1, 2].map(|i| low[i].min(place[i])), [0, 1, 2].map(|i| high[i].max(place[i]))]
    })
}

/// Every box is a body, and every map holds them all, and no more than that.
#[test]
fn receivers_of_a_list_are_bodies() {
    let report = report_on(&with_lists());
    let counts = numbers(&report["body"]["receiver_counts"]);
    let vertices = report["body"]["receiver_vertices"].as_array().unwrap();
    assert_eq!((counts.len(), counts.iter().sum::<f64>()), (3, vertices.len() as f64));
    let (_, houses) = vertices.split_at(counts[0] as usize);
    assert!(houses.iter().all(|vertex| numbers(vertex)[0] > -20.1 && numbers(vertex)[0] < 35.1), "{houses:?}");
    for row in report["techniques"].as_array().unwrap() {
        let [low, high] = extremes(row, &report["body"]["receiver_vertices"]);
        for axis in [0, 1] {
            assert!(
                (low[axis] + 1.0).abs() < 1e-9 && (high[axis] - 1.0).abs() < 1e-9,
                "{}: {low:?} {high:?}",
                row["name"]
            );
        }
    }
    // One box around all of them is worse: most of it is air.
    let around = json!({ "min": [-200, -3, -200], "max": [200, 30, 200] });
    let one = report_on(&paper_with("/receivers", Some(around)));
    for name in ["uniform", "lispsm", "optimal"] {
        let [many, one] = [&report, &one].map(|report| row(report, name)["worst_pixels_per_texel"].as_f64().unwrap());
        assert!(many < one, "{name}: {many} {one}");
    }
}

/// A list of one box is that box, and casters of a list count as the box around them.
#[test]
fn a_list_is_its_boxes() {
    let [ground, a, b] = houses();
    let one = report_on(&paper_with("/receivers", Some(ground.clone())));
    let list = report_on(&paper_with("/receivers", Some(json!([ground]))));
    let (around, apart) = (json!({ "min": [-20, -3, -120], "max": [35, 30, 20] }), json!([a, b]));
    let [around, apart] = [around, apart].map(|casters| report_on(&paper_with("/casters", Some(casters))));
    for [x, y] in [[one, list], [around, apart]] {
        for (x, y) in x["techniques"].as_array().unwrap().iter().zip(y["techniques"].as_array().unwrap()) {
            assert_eq!(x["clip_from_body"], y["clip_from_body"], "{}", x["name"]);
        }
    }
}

/// The plane is the lowest face of all receivers, here that of the second house: what lies in it
/// has as many pixels per texel all over, so that `w` there is as the depth along the view.
#[test]
fn the_plane_is_the_lowest_face_of_all() {
    let report = report_on(&with_lists());
    let matrix = numbers(&row(&report, "plane")["clip_from_world"]);
    let per_depth = |[x, z]: [f64; 2]| {
        let w = matrix[12] * x + matrix[13] * -3.0 + matrix[14] * z + matrix[15];
        w / (z + 190.0)
    };
    let ratios = [[0.0, 0.0], [50.0, -100.0], [-150.0, 180.0]].map(per_depth);
    assert!(ratios.iter().all(|ratio| (ratio / ratios[0] - 1.0).abs() < 1e-9), "{ratios:?}");
}

#[test]
fn every_technique_honours_the_axes() {
    let own = report_on(&with_lists());
    for (axes, same_as) in [("view", "lispsm"), ("light_fixed", "lispsm-fixed-axes"), ("middle", "lispsm-middle")] {
        let report = report_on(&with("axes", json!(axes)));
        assert_eq!(report["techniques"].as_array().unwrap().len(), 12);
        for row in report["techniques"].as_array().unwrap() {
            let name = row["name"].as_str().unwrap();
            let has_own = ["psm", "plane"].contains(&name);
            let (space, expected) =
                (&row["light_space"], &self::row(&own, if has_own { name } else { same_as })["light_space"]);
            // Those of its own come by another way, which rounds.
            let differ = numbers(&space["x"]).iter().zip(numbers(&expected["x"])).any(|(a, b)| (a - b).abs() > 1e-12);
            assert!(if has_own { !differ } else { space == expected }, "{axes} {name}: {space} {expected}");
            assert_eq!(row.get("worst_over_least").is_some(), !has_own, "{axes} {name}");
        }
        assert_eq!(row(&report, "lispsm")["clip_from_world"], row(&own, same_as)["clip_from_world"]);
    }
    let mean = report_on(&with("axes", json!("vertex_mean")));
    assert_ne!(row(&mean, "lispsm")["light_space"], row(&own, "lispsm")["light_space"]);
}

/// With the receivers' near plane nothing but receivers fills the depths, whatever the technique.
#[test]
fn every_technique_honours_the_near_plane() {
    let mut scene = with("near_depth", json!("receivers"));
    // One caster far above, whose shadow falls near the eye.
    scene["casters"] = json!([{ "min": [919, 1995, -848], "max": [929, 2005, -838] }]);
    let tight = report_on(&scene);
    scene["near_depth"] = json!("casters");
    let whole = report_on(&scene);
    let vertices = &whole["body"]["receiver_vertices"];
    for (tight, whole) in tight["techniques"].as_array().unwrap().iter().zip(whole["techniques"].as_array().unwrap()) {
        let [low, high] = extremes(tight, vertices);
        assert!(low[2].abs() < 1e-9 && (high[2] - 1.0).abs() < 1e-9, "{}: {low:?} {high:?}", tight["name"]);
        let [low, _] = extremes(whole, vertices);
        assert!(low[2] > 0.01, "{}: {low:?}", whole["name"]);
    }
}

/// Only the warp's strength depends on the depths. Up to infinity is as far as anything is seen.
#[test]
fn every_technique_honours_the_depths_of_the_warp() {
    let all = report_on(&with_lists());
    let [part, to_infinity, to_the_end] =
        [json!([40, 60]), json!([40, null]), json!([40, 400])].map(|depths| report_on(&with("warp_depths", depths)));
    for row in part["techniques"].as_array().unwrap() {
        let name = row["name"].as_str().unwrap();
        let stays = ["uniform", "psm", "plane"].contains(&name);
        assert_eq!(row["eta"] == self::row(&all, name)["eta"], stays, "{name}");
        assert_eq!(self::row(&to_infinity, name)["eta"], self::row(&to_the_end, name)["eta"], "{name}");
        let [low, high] = extremes(row, &part["body"]["receiver_vertices"]);
        assert!((low[0] + 1.0).abs() < 1e-9 && (high[1] - 1.0).abs() < 1e-9, "{name}: {low:?} {high:?}");
    }
    // What the errors are over does not change.
    assert_eq!(part["least_errors"], all["least_errors"]);
}

/// A list is drawn as solids, and the page says what the scene says.
#[test]
fn the_page_has_the_options() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("page.html");
    let mut scene = with("near_depth", json!("receivers"));
    scene["axes"] = json!("light_fixed");
    scene["warp_depths"] = json!([30, null]);
    for light in [
        scene["light"].clone(),
        json!({ "spot": { "position": [60, 90, -40], "direction": [-4, -10, 3], "outer_deg": 45, "near": 1, "range": 300 } }),
        json!({ "point": { "position": [30, 30, -60], "near": 1, "range": 300 } }),
    ] {
        scene["light"] = light;
        let output = report(&["--json", "--scene", "-", "--out", path.to_str().unwrap()], &scene.to_string());
        let rows = json_of(&output)["techniques"].as_array().unwrap().len();
        let html = std::fs::read_to_string(&path).unwrap();
        assert_eq!(html.matches("data:image/png;base64,iVBORw0KGgo").count(), 3 * rows);
        assert_eq!(html.matches("<th>Receivers</th>").count(), 3);
        for text in ["LightFixed, of every technique", "at the receivers", "chosen for depths from 30 to \u{221e}"] {
            assert!(html.contains(text), "{text}");
        }
        assert!(!without_pictures(&html).contains("NaN"));
    }
}

#[test]
fn wrong_options_are_refused_by_name() {
    let cases = [
        ("receivers", json!([]), "receivers: invalid length 0, expected at least one box"),
        ("receivers", json!(3), "receivers: invalid type: integer `3`, expected a box or a list of boxes"),
        ("casters", json!([{ "min": [0, 0, 0] }]), "casters[0].max: missing field"),
        ("receivers", json!([{ "min": [0, 0, 0], "max": [1, 1, "x"] }]), "receivers[0].max[2]: invalid type"),
        (
            "receivers",
            json!([{ "min": [0, 0, 0], "max": [1, 1, 1], "mid": 1 }]),
            "receivers[0].mid: unknown field, expected `min` or `max`",
        ),
        ("casters", json!([{ "min": [0, 0, 0], "max": [1, -1, 1] }]), "casters[0].min must not be greater than max"),
        (
            "axes",
            json!("sideways"),
            "axes: unknown variant `sideways`, expected one of `view`, `light_fixed`, `middle`, `vertex_mean`",
        ),
        ("near_depth", json!("caster"), "near_depth: unknown variant `caster`, expected `casters` or `receivers`"),
        ("warp_depths", json!([1]), "warp_depths: invalid length 1"),
        ("warp_depths", json!([null, 1]), "warp_depths[0]: invalid type: null, expected a number"),
        ("warp_depths", json!([-1, 1]), "warp_depths must be in order"),
        ("warp_depths", json!([2, 1]), "warp_depths must be in order"),
    ];
    for (field, value, names) in cases {
        assert_refused(&report(&["--json", "--scene", "-"], &with(field, value).to_string()), names);
    }
    for field in ["axes", "near_depth", "warp_depths"] {
        assert_eq!(report_on(&with(field, Value::Null))["scene"], report_on(&with_lists())["scene"], "{field}");
    }
}
