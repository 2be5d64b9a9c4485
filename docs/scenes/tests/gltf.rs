//! The triangles of a glTF file, and what is wrong with files that have none.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "tests")]

mod square;

use serde_json::{Value, json};
use shadow_warp::glam::DVec3;

use square::{data, triangles};

/// Twice the area, positive if the triangle is counter-clockwise as seen from +z.
fn areas(triangles: &[[DVec3; 3]]) -> Vec<f64> {
    triangles.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).z).collect()
}

#[test]
fn every_kind_of_triangles() {
    let indexed = triangles(&[]).unwrap();
    assert_eq!(areas(&indexed), [1.0, 1.0]);
    assert_eq!(indexed[0][1], DVec3::new(1.0, 0.0, 5.0));
    let primitive = "/meshes/0/primitives/0";
    let (mode, indices) = (format!("{primitive}/mode"), format!("{primitive}/indices"));
    let strip = triangles(&[(&mode, json!(5)), (&indices, Value::Null)]).unwrap();
    assert_eq!(areas(&strip), [1.0, 1.0]);
    // Around the first corner the strip's order turns over once.
    let fan = triangles(&[(&mode, json!(6)), (&indices, Value::Null)]).unwrap();
    assert_eq!(areas(&fan), [1.0, -1.0]);
    let loose = triangles(&[(&indices, Value::Null)]).unwrap();
    assert_eq!(areas(&loose), [1.0]);
    let points = triangles(&[(&mode, json!(0))]).unwrap();
    assert!(points.is_empty());
    // A mirror turns the winding over, and the format turns it back.
    let mirrored = triangles(&[("/nodes/0/scale", json!([-2, 1, 1]))]).unwrap();
    assert_eq!(areas(&mirrored), [2.0, 2.0]);
}

#[test]
fn what_is_not_there_is_named() {
    let cases = [
        ("/buffers/0/uri", json!("missing.bin"), "buffers[0]: missing.bin"),
        ("/buffers/0/uri", json!("data:application/octet-stream;base64,!!"), "buffers[0]"),
        ("/buffers/0/uri", json!("data:application/octet-stream;base64,AAAA"), "POSITION must lie in its buffer"),
        ("/buffers/0/uri", json!(data(&[0xff; 60])), "POSITION must be finite"),
        ("/buffers/0/uri", Value::Null, "buffers[0]"),
        ("/bufferViews/1/byteOffset", json!(400), "indices must lie in their buffer"),
        ("/bufferViews/0/byteStride", json!(8), "POSITION must be floats in threes"),
        ("/accessors/0/componentType", json!(5123), "POSITION must be floats in threes"),
        ("/accessors/0/count", json!(3), "index 3 is beyond the positions"),
        ("/accessors/0/count", json!(0), "POSITION must be floats in threes"),
        ("/accessors/0/count", json!(1_u64 << 40), "POSITION must be floats in threes"),
        ("/accessors/0/byteOffset", json!(u64::MAX), "POSITION must be floats in threes"),
        ("/accessors/1/count", json!(7), "indices must be unsigned integers"),
        ("/buffers/0/uri", json!("."), "must be a file"),
        ("/buffers/0/uri", json!("data:text/plain,x"), "must be base64"),
        ("/accessors/1/componentType", json!(5126), "indices must be unsigned integers"),
    ];
    for (path, value, names) in cases {
        let error = triangles(&[(path, value)]).expect_err(path);
        assert!(format!("{error:#}").contains(names), "{path}: {error:#}");
    }
}
