//! Runs the program, and reads what it prints.
#![allow(dead_code, reason = "each of the tests needs a part of it")]

use std::io::Write;
use std::process::{Command, Output, Stdio};

use serde_json::{Value, json};

pub(crate) const PAPER: &str = include_str!("../../scenes/paper.json");

pub(crate) fn report(args: &[&str], stdin: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_report"));
    command.args(args).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    // A run that fails early may not read its input.
    let _ = child.stdin.take().unwrap().write_all(stdin.as_bytes());
    child.wait_with_output().unwrap()
}

pub(crate) fn json_of(output: &Output) -> Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

pub(crate) fn report_on(scene: &Value) -> Value {
    json_of(&report(&["--json", "--scene", "-"], &scene.to_string()))
}

pub(crate) fn paper() -> Value {
    serde_json::from_str(PAPER).unwrap()
}

/// The scene of the paper with another value, or none, at a path such as `/view/near`.
pub(crate) fn paper_with(path: &str, value: Option<Value>) -> Value {
    let mut scene = paper();
    let (parent, key) = path.rsplit_once('/').unwrap();
    let parent = scene.pointer_mut(parent).unwrap().as_object_mut().unwrap();
    match value {
        Some(value) => parent.insert(key.to_owned(), value),
        None => parent.remove(key),
    };
    scene
}

pub(crate) fn spot(outer_deg: f64) -> Value {
    json!({ "position": [0, 90, 0], "direction": [0, -1, 0], "outer_deg": outer_deg, "near": 1, "range": 200 })
}

/// A page without its drawn pictures, whose letters say anything.
pub(crate) fn without_pictures(html: &str) -> String {
    let mut parts = html.split("src=\"data:image/png;base64,");
    let first = parts.next().unwrap().to_owned();
    parts.fold(first, |page, part| page + part.split_once('"').unwrap().1)
}

pub(crate) fn assert_refused(output: &Output, names: &str) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{names}: {stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert!(stderr.contains(names), "`{names}` is not in: {stderr}");
    assert!(output.stdout.is_empty(), "{names}");
}

pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Normalised device coordinates of a point, by a row-major matrix.
pub(crate) fn project(matrix: &[f64], p: &[f64]) -> [f64; 3] {
    let row = |i: usize| (0..3).map(|j| matrix[4 * i + j] * p[j]).sum::<f64>() + matrix[4 * i + 3];
    [row(0) / row(3), row(1) / row(3), row(2) / row(3)]
}
