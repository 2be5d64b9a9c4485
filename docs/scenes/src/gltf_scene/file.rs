//! A glTF file, cut down to what concerns its geometry, and validated.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow, bail, ensure};
use gltf::Semantic;
use gltf::json::validation::{Checked, Error, Validate};
use gltf::json::{Root, Value};

use crate::echo::{echo, of_serde};
use crate::text::text;

/// A file that has been read, but for its buffers.
pub(super) struct File {
    pub(super) document: gltf::Document,
    /// What a binary file holds after its JSON.
    pub(super) blob: Option<Vec<u8>>,
    pub(super) folder: PathBuf,
    /// Whether positions may be integers.
    pub(super) quantised: bool,
}

const QUANTISED: &str = "KHR_mesh_quantization";
const DRACO: &str = "KHR_draco_mesh_compression";
/// They hold geometry in another form.
const COMPRESSED: [&str; 3] = [DRACO, "EXT_meshopt_compression", "KHR_meshopt_compression"];
/// What the names of extensions begin with, behind their vendor, that change neither where
/// triangles are nor which there are.
const HARMLESS: [&str; 18] = [
    "animation",
    "audio",
    "collision",
    "environment",
    "feature_metadata",
    "image",
    "instance_features",
    "interactivity",
    "lights",
    "materials",
    "mesh_features",
    "node_hoverability",
    "node_selectability",
    "physics",
    "primitive_outline",
    "structural_metadata",
    "texture",
    "xmp",
];

impl File {
    pub(super) fn open(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path)?;
        let (json, blob) = split(&bytes)?;
        let mut json = parse(&json)?;
        check_version(&json)?;
        let quantised = check_extensions(&json)?;
        strip(&mut json)?;
        let root: Root = serde_path_to_error::deserialize(json)
            .map_err(|error| anyhow!("{}", of_serde(&error.path().to_string(), &error.inner().to_string())))?;
        validate(&root)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        Ok(Self { document: gltf::Document::from_json_without_validation(root), blob, folder, quantised })
    }
}

/// The JSON of a file, and what a binary one holds after it.
fn split(bytes: &[u8]) -> Result<(Vec<u8>, Option<Vec<u8>>)> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes.to_owned(), None));
    }
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    match word(4) {
        Some(2) | None => {}
        Some(version) => refuse_version(&version.to_string())?,
    }
    // The header says how long the file is, itself included; the reader takes that for granted.
    ensure!(word(8).is_some_and(|length| length >= 12), "the file is shorter than its header");
    let file = gltf::Glb::from_slice(bytes)?;
    Ok((file.json.into_owned(), file.bin.map(std::borrow::Cow::into_owned)))
}

fn parse(bytes: &[u8]) -> Result<Value> {
    let json = serde_json::from_str(text(bytes)?);
    let value: Value = json.map_err(|error| anyhow!("{}", of_serde(".", &error.to_string())))?;
    ensure!(value.is_object(), "the file must hold a JSON object");
    Ok(value)
}

fn check_version(json: &Value) -> Result<()> {
    match &json["asset"]["version"] {
        Value::String(version) => refuse_version(version)?,
        // So old files have it.
        Value::Number(version) => refuse_version(&format!("{:?}", version.as_f64().unwrap_or_default()))?,
        _ => {
            // Their objects have names in place of numbers.
            let has_names = ["accessors", "buffers", "meshes", "nodes"].iter().any(|part| json[part].is_object());
            if has_names {
                refuse_version("1.0")?;
            }
        }
    }
    if let Value::String(version) = &json["asset"]["minVersion"] {
        ensure!(version == "2.0", "asset.minVersion: needs a reader of glTF {}; this one reads 2.0", echo(version));
    }
    Ok(())
}

fn refuse_version(version: &str) -> Result<()> {
    let major = version.split('.').next().unwrap_or_default();
    let name = if version == "1" { "1.0" } else { version };
    match major {
        "2" => Ok(()),
        "0" | "1" => bail!("the file is glTF {}, convert to 2.0 (Blender can)", echo(name)),
        _ => bail!("asset.version: this reads glTF 2.0, and the file is glTF {}", echo(name)),
    }
}

/// Refuses what geometry may hide in; returns whether positions may be integers.
fn check_extensions(json: &Value) -> Result<bool> {
    let names = |list: &str| json[list].as_array().into_iter().flatten().filter_map(Value::as_str).collect::<Vec<_>>();
    let (used, required) = (names("extensionsUsed"), names("extensionsRequired"));
    for name in &required {
        refuse_compressed("extensionsRequired", name)?;
        let what = name.split_once('_').map_or(*name, |(_vendor, what)| what);
        let is_harmless = *name == QUANTISED || HARMLESS.iter().any(|known| what.starts_with(known));
        ensure!(
            is_harmless,
            "extensionsRequired: {} may change the geometry, and is not known here: export the file without it",
            echo(name)
        );
    }
    // Where it is not required there must be the plain data as well. Not all files have it.
    for (place, part) in primitives(json) {
        let position = part["attributes"]["POSITION"].as_u64().and_then(|index| usize::try_from(index).ok());
        let accessor = position.and_then(|index| json["accessors"].get(index));
        let is_plain = accessor.is_none_or(|accessor| accessor.get("bufferView").is_some());
        if part["extensions"].get(DRACO).is_some() && !is_plain {
            refuse_compressed(&place, DRACO)?;
        }
    }
    for (index, buffer) in json["buffers"].as_array().into_iter().flatten().enumerate() {
        for name in &COMPRESSED[1..] {
            if buffer["extensions"][name]["fallback"] == Value::Bool(true) && buffer.get("uri").is_none() {
                refuse_compressed(&format!("buffers[{index}]"), name)?;
            }
        }
    }
    Ok(used.iter().chain(&required).any(|name| *name == QUANTISED))
}

fn refuse_compressed(place: &str, name: &str) -> Result<()> {
    ensure!(
        !COMPRESSED.contains(&name),
        "{place}: the geometry is compressed by {name}, which is not read here: decompress it (gltf-transform can)"
    );
    Ok(())
}

fn primitives(json: &Value) -> impl Iterator<Item = (String, &Value)> {
    let meshes = json["meshes"].as_array().into_iter().flatten().enumerate();
    meshes.flat_map(|(i, mesh)| {
        let parts = mesh["primitives"].as_array().into_iter().flatten().enumerate();
        parts.map(move |(j, part)| (format!("meshes[{i}].primitives[{j}]"), part))
    })
}

/// Takes out what does not concern geometry, whatever is in it, and attributes that the reader does
/// not know but the format allows.
fn strip(json: &mut Value) -> Result<()> {
    let count = json["accessors"].as_array().map_or(0, Vec::len) as u64;
    for (place, part) in primitives(json) {
        for (name, accessor) in part["attributes"].as_object().into_iter().flatten() {
            let place = || format!("{place}.attributes.{}", echo(name));
            let known = ["POSITION", "NORMAL", "TANGENT"].contains(&name.as_str());
            let numbered = ["TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"];
            let is_numbered = numbered.iter().any(|start| name.starts_with(start));
            ensure!(
                known || is_numbered || is_foreign(name),
                "{}: the format has no such name; those of applications begin with _",
                place()
            );
            let is_there = accessor.as_u64().is_some_and(|index| index < count);
            ensure!(is_there, "{} must be the index of an accessor", place());
        }
    }
    let Some(root) = json.as_object_mut() else { return Ok(()) };
    for part in ["animations", "extensionsRequired", "images", "materials", "samplers", "textures"] {
        root.remove(part);
    }
    let meshes = root.get_mut("meshes").and_then(Value::as_array_mut).into_iter().flatten();
    for part in meshes.filter_map(|mesh| mesh.get_mut("primitives")?.as_array_mut()).flatten() {
        if let Some(part) = part.as_object_mut() {
            part.remove("material");
        }
        if let Some(attributes) = part.get_mut("attributes").and_then(Value::as_object_mut) {
            attributes.retain(|name, _| !is_foreign(name));
        }
    }
    Ok(())
}

/// Whether an attribute is an application's, or an extension's.
fn is_foreign(name: &str) -> bool {
    name.starts_with('_') || name.contains(':')
}

fn validate(root: &Root) -> Result<()> {
    // The validation that follows looks positions up before it checks that they are there.
    for (i, mesh) in root.meshes.iter().enumerate() {
        for (j, primitive) in mesh.primitives.iter().enumerate() {
            let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            let there = positions.is_none_or(|accessor| accessor.value() < root.accessors.len());
            ensure!(there, "meshes[{i}].primitives[{j}].attributes.POSITION must be the index of an accessor");
        }
    }
    let mut errors = Vec::new();
    root.validate(root, gltf::json::Path::new, &mut |path, error| {
        // A name in brackets is a field like any other.
        let path = path().to_string().replace("[\"", ".").replace("\"]", "");
        // The format allows meshes without positions, which are not drawn, and accessors without
        // data, which are zero.
        let is_allowed = path.ends_with(".attributes.POSITION") || path.ends_with("].bufferView");
        if !(is_allowed && error == Error::Missing) {
            errors.push((path, error));
        }
    });
    let Some((path, error)) = errors.first() else { return Ok(()) };
    let what = match error {
        Error::IndexOutOfBounds => "the index is out of bounds",
        Error::Invalid => "the value is invalid",
        Error::Missing => "is missing",
        Error::Oversize => "is too large",
        Error::Unsupported => "is not supported",
    };
    let more = if errors.len() > 1 { format!(" (and {} more)", errors.len() - 1) } else { String::new() };
    bail!("{}: {what}{more}", echo(path))
}
