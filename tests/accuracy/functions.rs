//! The public numeric functions, in ulp, against a table of what is allowed.

use super::{table, vectors};
use serde_json::{Value, json};
use shadow_warp::glam::DVec3;
use shadow_warp::{Light, LightSpace, LightSpaceRule, Slab, View, Warp};

/// How many ulp each function may be off. A function that gets worse fails, and so does an entry above 1 that is more
/// than twice what was measured: then lower it.
const ALLOWED: [(&str, f64); 12] = [
    ("map_from_body", 3.0),
    ("body_from_map", 1.5),
    ("density", 3.5),
    ("excess extent", 3.0),
    ("excess damped", 2.5),
    ("excess view depth", 1.75),
    ("excess depth", 2.0),
    ("sin_gamma", 2.5),
    // Of 1, not of the coordinate.
    ("axis x", 1.0),
    ("axis y", 0.0),
    ("axis z", 1.0),
    ("fixed axes", 2.0),
];

/// A view and a light along stored vectors, which neither of them rounds again.
fn frame(row: &Value) -> (View, Light) {
    let stored = vectors(&json!([row["forward"], row["up"], row["to_light"]]));
    let view = View::perspective(DVec3::ZERO, stored[0], stored[1], 1.0, 1.0, 1.0..2.0).unwrap();
    let light = Light::directional(stored[2]).unwrap();
    assert_eq!([view.forward(), view.up(), light.homogeneous().truncate()], stored[..]);
    (view, light)
}

/// How far a value is from one given as a double and what is left over, in ulp of `unit`.
fn ulp(value: f64, exact: &Value, unit: f64) -> f64 {
    let [high, low] = [0, 1].map(|i| exact[i].as_f64().unwrap());
    let size = f64::from_bits((unit.abs().to_bits() >> 52) << 52) * f64::EPSILON;
    let off = ((value - high) - low).abs();
    if off == 0.0 { 0.0 } else { off / size }
}

fn slab(x: &[f64]) -> Slab {
    Slab { near: x[0], far: x[1], extent: x[2], sin_gamma: x[3] }
}

fn evaluate(name: &str, x: &[f64]) -> f64 {
    let warp = || Warp::new(x[0]).unwrap();
    match name {
        "map_from_body" => warp().map_from_body(x[1]),
        "body_from_map" => warp().body_from_map(x[1]),
        "density" => warp().density(x[1]),
        "excess extent" => LightSpaceRule::Extent.excess(&slab(x)),
        "excess damped" => LightSpaceRule::Damped.excess(&slab(x)),
        "excess view depth" => LightSpaceRule::ViewDepth.excess(&slab(x)),
        "excess depth" => LightSpaceRule::Depth.excess(&slab(x)),
        _ => unreachable!("{name}"),
    }
}

#[test]
fn functions_are_within_their_ulp() {
    let (inputs, results) = table();
    let mut measured = [0.0_f64; ALLOWED.len()];
    let mut note = |name: &str, ulp: f64| {
        let place = ALLOWED.iter().position(|(known, _)| *known == name).unwrap();
        assert!(ulp.is_finite(), "{name}");
        measured[place] = measured[place].max(ulp);
    };
    for (name, rows) in results["functions"].as_object().unwrap() {
        for row in rows.as_array().unwrap() {
            let x: Vec<_> = row["x"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
            let value = evaluate(name, &x);
            note(name, ulp(value, &row["y"], value));
        }
    }
    for (case, expected) in results["frames"].as_array().unwrap().iter().enumerate() {
        let (view, light) = frame(&inputs["frames"][case]);
        let space = LightSpace::new(&view, &light).unwrap();
        let [x_fixed, z_fixed] = space.fixed_axes();
        note("sin_gamma", ulp(space.sin_gamma, &expected["sin_gamma"], space.sin_gamma));
        let axes = [("axis x", space.x, "x"), ("axis y", space.y, "y"), ("axis z", space.z, "z")];
        let fixed = [("fixed axes", x_fixed, "x_fixed"), ("fixed axes", z_fixed, "z_fixed")];
        for (name, axis, key) in axes.into_iter().chain(fixed) {
            for (i, value) in axis.to_array().into_iter().enumerate() {
                note(name, ulp(value, &expected[key][i], 1.0));
            }
        }
    }
    println!("{:?}", ALLOWED.map(|(name, _)| name).iter().zip(measured).collect::<Vec<_>>());
    for ((name, allowed), measured) in ALLOWED.into_iter().zip(measured) {
        assert!(measured <= allowed, "{name}: {measured} ulp, {allowed} allowed");
        assert!(
            allowed <= 1.0 || allowed <= 2.0 * measured,
            "{name}: {allowed} ulp allowed, but only {measured} needed"
        );
    }
}
