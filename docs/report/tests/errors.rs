//! What errors repeat of their input, and that they say nothing twice.
#![expect(clippy::unwrap_used, reason = "tests")]

mod program;

use std::process::{Command, Output};

use serde_json::{Value, json};

use program::{PAPER, assert_refused, json_of, paper_with, report};

const MOST: usize = 80;

/// A letter that no message has, as often as it takes.
fn long() -> String {
    "\u{416}".repeat(5000)
}

fn assert_short(output: &Output) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_refused(output, "report: ");
    let repeated = said.matches('\u{416}').count();
    assert!((20..=MOST).contains(&repeated), "{repeated} characters: {said}");
}

fn on_scene(text: &str) -> Output {
    report(&["--json", "--scene", "-"], text)
}

fn on_gltf(folder: &std::path::Path, gltf: &Value) -> Output {
    let path = folder.join("a.gltf");
    std::fs::write(&path, gltf.to_string()).unwrap();
    report(&["--json", "--gltf", path.to_str().unwrap()], "")
}

#[test]
fn at_most_eighty_characters_are_repeated() {
    let long = long();
    let field = format!("/view/{long}");
    for (path, value) in [
        ("/view/near", json!(long)),
        ("/view", json!(long)),
        ("/axes", json!(long)),
        ("/receivers", json!([long])),
        (field.as_str(), json!(1)),
        (format!("/{long}").as_str(), json!(1)),
    ] {
        assert_short(&on_scene(&paper_with(path, Some(value)).to_string()));
    }
    assert_short(&on_scene(&format!("\"{long}\"")));
    assert_short(&on_scene(&json!([long]).to_string()));

    let flag = format!("--{long}");
    let equal = format!("--json={long}");
    let out = format!("/proc/{long}");
    for arguments in [
        &[long.as_str()][..],
        &[&flag],
        &[&equal],
        &["--scene", &long],
        &["--gltf", &long],
        &["--out", &out],
        &["--figures", &out, "--json"],
    ] {
        assert_short(&report(arguments, ""));
    }

    let folder = tempfile::tempdir().unwrap();
    let mesh = json!([{ "primitives": [{ "attributes": { long.as_str(): 0 } }] }]);
    for gltf in [
        json!({ "asset": { "version": format!("1.{long}") } }),
        json!({ "asset": { "version": format!("3.{long}") } }),
        json!({ "asset": { "version": "2.0", "minVersion": long } }),
        json!({ "asset": { "version": "2.0" }, "extensionsRequired": [long] }),
        json!({ "asset": { "version": "2.0" }, "meshes": mesh }),
        json!({ "asset": { "version": "2.0" }, "meshes": long }),
        json!({ "asset": { "version": "2.0" }, "nodes": [{ "mesh": long }] }),
        json!(long),
    ] {
        let output = on_gltf(folder.path(), &gltf);
        // A file that holds no object has nothing to repeat.
        if gltf.is_object() { assert_short(&output) } else { assert_refused(&output, "must hold a JSON object") }
    }
}

/// Words of four letters and more, in small letters.
fn words(text: &str) -> Vec<String> {
    let words = text.split(|c: char| !c.is_alphanumeric()).filter(|word| word.chars().count() > 3);
    words.map(str::to_lowercase).collect()
}

/// No word of an error comes twice, but for names of fields that are listed or stand in a path.
#[test]
fn nothing_is_said_twice() {
    let folder = tempfile::tempdir().unwrap();
    let scenes = [
        ("/view/near", Some(json!("x"))),
        ("/view/near", None),
        ("/view", None),
        ("/view/zoom", Some(json!(1))),
        ("/zoom", Some(json!(1))),
        ("/view/eye", Some(json!([1, 2, 3, 4]))),
        ("/view/eye", Some(json!([1]))),
        ("/view/far", Some(json!(0.5))),
        ("/view/forward", Some(json!([0, 0, 0]))),
        ("/light", Some(json!({}))),
        ("/light", Some(json!({ "spot": program::spot(90.0) }))),
        ("/map", Some(json!([0, 1]))),
        ("/receivers", Some(json!([]))),
        ("/axes", Some(json!("up"))),
        ("/warp_depths", Some(json!([3, 2]))),
    ];
    let mut outputs: Vec<Output> =
        scenes.into_iter().map(|(path, value)| on_scene(&paper_with(path, value).to_string())).collect();
    outputs.extend(["", "{", "null", "[1]", "{} {}", "{\"map\":[1,1],\"map\":[1,1]}"].map(on_scene));
    outputs.extend([
        report(&["--scene", "missing/a.json"], ""),
        report(&["--gltf", "missing/b.glb"], ""),
        report(&["--gltf", "/"], ""),
        report(&["--wrong"], ""),
        report(&["--scene"], ""),
    ]);
    let gltf = |change: Value| {
        let mut gltf = json!({
            "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
            "accessors": [{ "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1] }]
        });
        gltf.as_object_mut().unwrap().extend(change.as_object().unwrap().clone());
        gltf
    };
    for change in [
        json!({ "asset": {} }),
        json!({ "asset": 1 }),
        json!({ "asset": { "version": "1.0" } }),
        json!({ "nodes": [{ "mesh": 7 }] }),
        json!({ "nodes": [{ "mesh": "x" }] }),
        json!({ "accessors": [{ "componentType": 1, "count": 3, "type": "VEC3" }] }),
        json!({ "extensionsRequired": ["KHR_draco_mesh_compression"] }),
        json!({ "extensionsRequired": ["KHR_unheard_of"] }),
        json!({ "meshes": [{ "primitives": [{ "attributes": { "BANANA": 0 } }] }] }),
    ] {
        outputs.push(on_gltf(folder.path(), &gltf(change)));
    }
    for output in outputs {
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_refused(&output, "report: ");
        // Without the list of what is expected, and without the file's name.
        let said = said.replace(&folder.path().join("a.gltf").display().to_string(), "");
        let said = said.split(", expected").next().unwrap();
        let mut words = words(said);
        words.sort();
        assert!(words.windows(2).all(|pair| pair[0] != pair[1]), "{said}");
        assert!(!said.contains("struct ") && !said.contains("f64"), "{said}");
    }
}

#[test]
fn a_byte_order_mark_is_skipped() {
    let plain = json_of(&on_scene(PAPER));
    let marked = json_of(&on_scene(&format!("\u{feff}{PAPER}")));
    assert_eq!(plain["scene"], marked["scene"]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.json");
    std::fs::write(&path, format!("\u{feff}{PAPER}")).unwrap();
    assert!(json_of(&report(&["--json", "--scene", path.to_str().unwrap()], ""))["scene"] == plain["scene"]);
    // Not twice, and not in place of a scene.
    assert_refused(&on_scene(&format!("\u{feff}\u{feff}{PAPER}")), "stdin: expected value");
    let wide: Vec<u8> = PAPER.encode_utf16().flat_map(u16::to_le_bytes).collect();
    std::fs::write(&path, [&[0xff, 0xfe][..], &wide].concat()).unwrap();
    assert_refused(&report(&["--json", "--scene", path.to_str().unwrap()], ""), "must be UTF-8, and is UTF-16");
    std::fs::write(&path, [0x7b, 0xff]).unwrap();
    assert_refused(&report(&["--json", "--scene", path.to_str().unwrap()], ""), "must be UTF-8, and is not at byte 1");
}

/// A user without a desktop, who has set nothing, gets the table and nothing else.
#[test]
fn the_first_run_has_no_words_of_mesa() {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("page.html");
    let mut command = Command::new(env!("CARGO_BIN_EXE_report"));
    for variable in ["NODEVICE_SELECT", "XDG_RUNTIME_DIR", "WAYLAND_DISPLAY", "DISPLAY"] {
        command.env_remove(variable);
    }
    let output = command.arg("--out").arg(&page).output().unwrap();
    assert!(output.status.success());
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
    assert!(String::from_utf8_lossy(&output.stdout).contains("with pictures drawn by"));
    assert!(page.is_file());
}
