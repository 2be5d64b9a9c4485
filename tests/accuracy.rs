//! Matrices and functions against 50 digits.
//!
//! The reference takes what a scene has stored, unit vectors and vertices, as exact numbers: the error of a map is
//! what the fit adds to them. `tests/data/accuracy_inputs.json` holds these numbers, `tests/data/accuracy.py` makes
//! `tests/data/accuracy.json` from them.

#![expect(clippy::unwrap_used, reason = "a table that does not have its fields is a broken test")]
#![expect(clippy::disallowed_methods, reason = "a fused product gives the error of a product")]

mod random;

#[path = "accuracy/functions.rs"]
mod functions;

use random::Ratchet;
use random::measure::{Scene, box_about, box_between, extent};
use serde_json::{Value, json};
use shadow_warp::glam::{DMat4, DVec3, DVec4};
use shadow_warp::{Axes, ClipSpace, LightSpaceRule, NearDepth, Rule, ShadowMap, View, Warp};

struct Case {
    name: String,
    scene: Scene,
    rule: Rule,
}

fn rule_name(rule: Rule) -> &'static str {
    match rule {
        Rule::LightSpace(LightSpaceRule::Extent) => "extent",
        Rule::LightSpace(LightSpaceRule::Damped) => "damped",
        Rule::LightSpace(LightSpaceRule::ViewDepth) => "view depth",
        Rule::LightSpace(LightSpaceRule::Depth) => "depth",
        _ => "given",
    }
}

/// Every place, with every light that asks something of it, with a rule that goes round.
fn cases() -> Vec<Case> {
    let eye = DVec3::new(3.0, 5.0, -2.0);
    let forward = DVec3::new(0.5, -0.25, 1.0);
    let view = |eye: DVec3, far: f64| View::perspective(eye, forward, DVec3::Y, 1.0, 1.5, 0.1..far).unwrap();
    let near_box = |eye: DVec3, distance: f64, size: f64| {
        box_about(eye + view(eye, 1e9).forward() * distance, DVec3::new(0.5, 0.375, 0.625) * size)
    };
    let far_eye = DVec3::new(1e7, -2e7, 3e7);
    let places = [
        ("frustum 1000", view(eye, 100.0), box_about(eye, DVec3::splat(150.0))),
        ("frustum 1e7", view(eye, 1e6), box_about(eye, DVec3::splat(1.5e6))),
        (
            "ground",
            view(eye, f64::INFINITY),
            box_between(DVec3::new(-200.0, -1.0, -200.0), DVec3::new(200.0, 4.0, 300.0)),
        ),
        ("world 1e7", view(far_eye, 100.0), box_about(far_eye, DVec3::splat(150.0))),
        ("box at 1e7 in the world", view(far_eye, 1e3), near_box(far_eye, 30.0, 8.0)),
        ("1 at 1e7", view(DVec3::ZERO, 1e9), near_box(DVec3::ZERO, 1e7, 1.0)),
        ("1e-6 at 8", view(DVec3::ZERO, 100.0), near_box(DVec3::ZERO, 8.0, 1e-6)),
    ];
    let v = view(eye, 1.0).forward();
    let up = view(eye, 1.0).up();
    let lights = [
        ("above", DVec3::new(1.0, 4.0, 2.0)),
        ("across", up),
        ("1e-3", v + up * 1e-3),
        ("1e-9", v + up * 1e-9),
        ("behind 1e-9", up * 1e-9 - v),
        ("along", v),
    ];
    let explicit = |eta: f64| Rule::Explicit(Warp::new(eta).unwrap());
    let turns = [
        Rule::LightSpace(LightSpaceRule::Extent),
        Rule::LightSpace(LightSpaceRule::Damped),
        Rule::Uniform,
        Rule::LightSpace(LightSpaceRule::ViewDepth),
        Rule::LightSpace(LightSpaceRule::Depth),
        explicit(7.5),
        explicit(1e4),
    ];
    let mut cases = Vec::new();
    for (place, view, bounds) in places {
        for (name, to_light) in lights {
            let mut scene = Scene::new(view, to_light, &[bounds], bounds);
            scene.near_depth = NearDepth::Receivers;
            scene.axes = if cases.len() % 3 == 2 { Axes::LightFixed } else { Axes::View };
            let rule = turns[cases.len() % turns.len()];
            let name = format!("{place}, light {name}, {rule:?}, {:?}", scene.axes);
            cases.push(Case { name, scene, rule });
        }
    }
    cases
}

fn vector(v: DVec3) -> Value {
    json!(v.to_array())
}

/// Points of the body, and some above it along the light: its vertices, and means of them with weights that never repeat.
fn probes(case: &Case, origin: DVec3) -> Vec<DVec3> {
    let points = case.scene.receivers(origin);
    let [low, high] = extent(points.iter().map(|p| case.scene.to_light().dot(*p)));
    let mean = |number: usize| {
        let weight = |i: usize| ((i + 1) as f64 * (number + 1) as f64 * 0.618_033_988_749_895).fract();
        let weights: f64 = (0..points.len()).map(weight).sum();
        points.iter().enumerate().map(|(i, p)| *p * (weight(i) / weights)).sum::<DVec3>()
    };
    let above = (8..10).map(|number| mean(number) + case.scene.to_light() * (high - low));
    (0..8).map(mean).chain(above).chain(points.iter().copied()).collect()
}

fn inputs_of(case: &Case) -> Value {
    let map = case.scene.fit().solve(case.rule).unwrap();
    let view = &case.scene.view;
    let list = |points: Vec<DVec3>| points.into_iter().map(vector).collect::<Vec<_>>();
    json!({
        "name": case.name,
        "forward": vector(view.forward()), "up": vector(view.up()), "to_light": vector(case.scene.to_light()),
        "eye": vector(view.eye()), "origin": vector(map.origin()), "near": view.near(),
        "vertices": list(case.scene.receivers(map.origin())),
        "rule": rule_name(case.rule), "excess": map.warp().excess(),
        "axes": if case.scene.axes == Axes::View { "view" } else { "fixed" },
        "probes": list(probes(case, map.origin())), "probes_from_eye": list(probes(case, view.eye())),
    })
}

fn data(name: &str) -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn read(name: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(data(name)).unwrap()).unwrap()
}

/// Returns the present inputs and the results that were made from them. The frames are read, the maps' inputs are those of
/// [`cases`].
///
/// With `SHADOW_WARP_WRITE` in the environment it writes the inputs first, and the results are of the old ones.
fn table() -> (Value, Value) {
    let stored = read("accuracy_inputs.json");
    let maps = cases().iter().map(inputs_of).collect::<Vec<_>>();
    let inputs = json!({ "maps": maps, "frames": stored["frames"] });
    if std::env::var_os("SHADOW_WARP_WRITE").is_some() {
        let list = |name: &str| {
            let rows: Vec<_> = inputs[name].as_array().unwrap().iter().map(ToString::to_string).collect();
            format!("\"{name}\": [\n{}\n]", rows.join(",\n"))
        };
        std::fs::write(data("accuracy_inputs.json"), format!("{{\n{},\n{}\n}}\n", list("maps"), list("frames")))
            .unwrap();
    }
    assert!(
        inputs == read("accuracy_inputs.json"),
        "the inputs are no longer those that the results were made from: run\n    \
         SHADOW_WARP_WRITE=1 cargo test --test accuracy; python3 tests/data/accuracy.py\nand look at what changed"
    );
    (inputs, read("accuracy.json"))
}

fn vectors(value: &Value) -> Vec<DVec3> {
    let number = |x: &Value| x.as_f64().unwrap();
    value.as_array().unwrap().iter().map(|v| DVec3::new(number(&v[0]), number(&v[1]), number(&v[2]))).collect()
}

/// A row times a point to twice the digits of f64: what is left is the matrix's own error.
fn exact_dot(row: DVec4, p: DVec3) -> f64 {
    let (mut sum, mut rest) = (row.w, 0.0);
    for (m, x) in row.truncate().to_array().into_iter().zip(p.to_array()) {
        let product = m * x;
        let new = sum + product;
        let back = new - sum;
        rest += m.mul_add(x, -product) + ((sum - (new - back)) + (product - back));
        sum = new;
    }
    sum + rest
}

fn deviation(matrix: &DMat4, p: DVec3, expected: DVec3) -> f64 {
    let [x, y, z, w] = [0, 1, 2, 3].map(|i| exact_dot(matrix.row(i), p));
    (DVec3::new(x, y, z) / w - expected).abs().max_element()
}

#[test]
fn matrices_are_as_accurate_as_they_say() {
    let (inputs, results) = table();
    let mut errors = [Ratchet::new("matrix from the map's origin"), Ratchet::new("matrix from the eye")];
    let mut excess = Ratchet::new("excess");
    for (i, case) in cases().iter().enumerate() {
        let map: ShadowMap = case.scene.fit().solve(case.rule).unwrap();
        let (input, result) = (&inputs["maps"][i], &results["maps"][i]);
        let points = case.scene.receivers(map.origin());
        let size = [DVec3::X, DVec3::Y, DVec3::Z].map(|a| extent(points.iter().map(|p| a.dot(*p)))).map(|[l, h]| h - l);
        let distance = 1.0 + case.scene.view.eye().distance(map.origin()) / size.into_iter().fold(0.0, f64::max);
        let places = [
            (map.origin(), "probes", 4e-15 * map.warp().ratio()),
            (case.scene.view.eye(), "probes_from_eye", 2e-15 * map.warp().ratio() * distance),
        ];
        for (place, (origin, probes, allowed)) in places.into_iter().enumerate() {
            let matrix = map.clip_from_world_at(origin, ClipSpace::WGPU);
            // The centre of the warp is the eye's place across: it is known to one rounding of the eye's distance.
            // Only an explicit warp of a body far away is strong enough to show that.
            let centre = f64::EPSILON * map.warp().excess() * distance;
            for (p, expected) in vectors(&input[probes]).into_iter().zip(vectors(&result[probes])) {
                errors[place].note(deviation(&matrix, p, expected), allowed + centre, (&case.name, p));
            }
        }
        if rule_name(case.rule) != "given" {
            let expected = result["excess"].as_f64().unwrap();
            excess.note((map.warp().excess() - expected).abs(), 1e-15 * expected * distance, &case.name);
        }
    }
    assert_eq!(cases().len(), results["maps"].as_array().unwrap().len());
    assert!(cases().len() >= 40);
}
