//! `docs/scene-format.md` against the program: its tables have the fields that the sources have,
//! its examples are read, and what the program prints is in it.
#![expect(clippy::unwrap_used, reason = "tests")]

mod program;

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;
use syn::{Field, Fields, GenericArgument, Item, Meta, PathArguments, Type};

use program::{json_of, paper_with, report, report_on};

const PAGE: &str = include_str!("../../scene-format.md");

/// A row of a table: what is in its columns `type` and `absent`.
#[derive(Debug, PartialEq)]
struct Row {
    kind: String,
    may_be_absent: bool,
}

/// By the name of a type, its rows.
type Tables = BTreeMap<String, BTreeMap<String, Row>>;

/// The tables of the page, each under a heading with the name of a type.
fn page() -> Tables {
    let mut tables = Tables::new();
    let mut heading = String::new();
    for line in PAGE.lines() {
        if let Some(name) = line.strip_prefix("### ") {
            heading = name.to_owned();
            assert!(tables.insert(heading.clone(), BTreeMap::new()).is_none(), "{heading} twice");
        } else if line.starts_with("## ") {
            heading.clear();
        } else if line.starts_with("| `") {
            let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
            let name = cells[0].trim_matches(['`', '"']).to_owned();
            let row = match cells[..] {
                [_, _] => Row { kind: "value".to_owned(), may_be_absent: false },
                [_, kind, _, absent, meaning] => {
                    assert!(!meaning.is_empty() && !absent.is_empty(), "{line}");
                    Row { kind: without_links(kind), may_be_absent: !["never", "an error"].contains(&absent) }
                }
                _ => unreachable!("a row of five columns, or two: {line}"),
            };
            assert!(tables.get_mut(&heading).unwrap().insert(name, row).is_none(), "{line}");
        }
    }
    tables
}

/// `list of [Row](#row)` without its link, which must be to the heading.
fn without_links(cell: &str) -> String {
    let Some((before, rest)) = cell.split_once('[') else { return cell.to_owned() };
    let (name, rest) = rest.split_once("](#").unwrap();
    let (anchor, after) = rest.split_once(')').unwrap();
    assert_eq!(anchor, name.to_lowercase());
    format!("{before}{name}{after}")
}

/// The types of the sources that serde reads or writes.
fn sources() -> Tables {
    let mut tables = Tables::new();
    for folder in ["src", "../scenes/src"] {
        for entry in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|extension| extension == "rs") {
                let file = syn::parse_file(&std::fs::read_to_string(path).unwrap()).unwrap();
                tables.extend(file.items.iter().filter_map(table));
            }
        }
    }
    tables
}

fn table(item: &Item) -> Option<(String, BTreeMap<String, Row>)> {
    let (attributes, name) = match item {
        Item::Struct(item) => (&item.attrs, &item.ident),
        Item::Enum(item) => (&item.attrs, &item.ident),
        _ => return None,
    };
    let lists = |wanted: &str, word: &str| {
        attributes.iter().filter(|attribute| attribute.path().is_ident(wanted)).any(|attribute| match &attribute.meta {
            Meta::List(list) => list.tokens.to_string().contains(word),
            _ => false,
        })
    };
    if !lists("derive", "Serialize") {
        return None;
    }
    let rows = match item {
        Item::Struct(item) => fields(&item.fields, false),
        // One of several objects, or of several words.
        Item::Enum(item) if lists("serde", "untagged") => {
            item.variants.iter().flat_map(|variant| fields(&variant.fields, true)).collect()
        }
        Item::Enum(item) => {
            assert!(lists("serde", "snake_case"), "{name}");
            let value = || Row { kind: "value".to_owned(), may_be_absent: false };
            item.variants.iter().map(|variant| (snake_case(&variant.ident.to_string()), value())).collect()
        }
        _ => BTreeMap::new(),
    };
    Some((name.to_string(), rows))
}

fn fields(fields: &Fields, of_variant: bool) -> BTreeMap<String, Row> {
    let named = fields.iter().filter(|field| field.ident.is_some());
    named
        .filter_map(|field| {
            let serde = serde_words(field);
            let skipped = serde.contains("skip") && !serde.contains("skip_serializing_if");
            let kind = kind(&field.ty);
            let may_be_absent = of_variant || serde.contains("skip_serializing_if") || is_option(&field.ty);
            (!skipped).then(|| (field.ident.as_ref().unwrap().to_string(), Row { kind, may_be_absent }))
        })
        .collect()
}

fn serde_words(field: &Field) -> String {
    let serde = field.attrs.iter().filter(|attribute| attribute.path().is_ident("serde"));
    serde.map(|attribute| attribute.meta.require_list().unwrap().tokens.to_string()).collect()
}

fn is_option(kind: &Type) -> bool {
    matches!(kind, Type::Path(path) if path.path.segments[0].ident == "Option")
}

/// A type in the words of the page.
fn kind(of: &Type) -> String {
    let several = |count: String, one: &str| format!("{count} {one}s");
    match of {
        Type::Reference(reference) => kind(&reference.elem),
        Type::Array(array) => {
            let syn::Expr::Lit(length) = &array.len else { unreachable!("a length is a number") };
            let syn::Lit::Int(length) = &length.lit else { unreachable!("a length is a number") };
            several(length.to_string(), &kind(&array.elem))
        }
        Type::Tuple(tuple) => several(tuple.elems.len().to_string(), &kind(&tuple.elems[0])),
        Type::Path(path) => {
            let last = path.path.segments.last().unwrap();
            let inner = match &last.arguments {
                PathArguments::AngleBracketed(arguments) => match &arguments.args[0] {
                    GenericArgument::Type(inner) => kind(inner),
                    _ => unreachable!("a type of a type"),
                },
                _ => String::new(),
            };
            match last.ident.to_string().as_str() {
                "f64" => "number".to_owned(),
                "u32" | "usize" => "whole number".to_owned(),
                "String" | "str" => "string".to_owned(),
                "Option" => inner,
                "Vec" => format!("list of {inner}"),
                name => name.to_owned(),
            }
        }
        _ => unreachable!("no such type is read or written"),
    }
}

fn snake_case(name: &str) -> String {
    let lower = |(i, letter): (usize, char)| {
        let break_before = i > 0 && letter.is_uppercase();
        break_before.then_some('_').into_iter().chain(letter.to_lowercase()).collect::<Vec<_>>()
    };
    name.chars().enumerate().flat_map(lower).collect()
}

#[test]
fn the_tables_are_the_types() {
    let (page, sources) = (page(), sources());
    assert!(page.len() > 15, "{page:?}");
    let names = |tables: &Tables| tables.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&page), names(&sources));
    for (name, rows) in &sources {
        assert_eq!(&page[name], rows, "{name}");
    }
}

/// Every object that the program prints has fields of its type alone, and all that are always
/// there.
#[test]
fn what_is_printed_is_in_the_tables() {
    let tables = page();
    let spot = paper_with("/light", Some(serde_json::json!({ "spot": program::spot(40.0) })));
    let lamp = serde_json::json!({ "point": { "position": [30, 30, -60], "near": 1, "range": 300 } });
    let lamp = paper_with("/light", Some(lamp));
    let dark = paper_with("/receivers", Some(serde_json::json!({ "min": [0, 0, -299], "max": [1, 1, -298] })));
    let mut kinds = Vec::new();
    for scene in [program::paper(), spot, lamp, dark].into_iter().chain(examples()) {
        check(&tables, "Report", &report_on(&scene), &mut kinds);
    }
    for kind in ["Row", "Refused", "Face", "Least", "Rounding", "LightAxes", "Bodies", "Frame", "Lit", "Scene", "Boxes"]
    {
        assert!(kinds.iter().any(|seen| seen == kind), "{kind}");
    }
}

fn check(tables: &Tables, kind: &str, value: &Value, kinds: &mut Vec<String>) {
    if let Some(kind) = kind.strip_prefix("list of ") {
        return value.as_array().unwrap().iter().for_each(|value| check(tables, kind, value, kinds));
    }
    if kind == "Boxes" {
        kinds.push(kind.to_owned());
        let kind = if value.is_array() { "list of Cuboid" } else { "Cuboid" };
        return check(tables, kind, value, kinds);
    }
    let Some(rows) = tables.get(kind) else {
        let is_number = |value: &Value| value.is_number() || value.is_null();
        let count = kind.split(' ').next().and_then(|count| count.parse::<usize>().ok());
        let fits = match (kind, count) {
            ("string", _) => value.is_string(),
            (_, Some(count)) => value.as_array().is_some_and(|list| list.len() == count && list.iter().all(is_number)),
            _ => is_number(value),
        };
        assert!(fits, "{kind}: {value}");
        return;
    };
    kinds.push(kind.to_owned());
    let Some(object) = value.as_object() else {
        assert!(rows.contains_key(value.as_str().unwrap()), "{kind}: {value}");
        return;
    };
    for (name, value) in object {
        assert!(rows.contains_key(name), "{kind}.{name}");
        let is_far = value.is_null() && rows[name].may_be_absent;
        if !is_far {
            check(tables, &rows[name].kind, value, kinds);
        }
    }
    for (name, row) in rows {
        assert!(row.may_be_absent || object.contains_key(name), "{kind}.{name} is not there");
    }
}

/// The page's scenes.
fn examples() -> Vec<Value> {
    let blocks = PAGE.split("```json\n").skip(1).map(|rest| rest.split("```").next().unwrap());
    blocks.map(|text| serde_json::from_str(text).unwrap()).collect()
}

#[test]
fn the_examples_are_read() {
    let examples = examples();
    assert_eq!(examples.len(), 2);
    let report = report_on(&examples[1]);
    // What was read is written down again, with numbers for numbers.
    let again = report_on(&report["scene"]);
    assert_eq!(again["scene"], report["scene"]);
    let fields = |scene: &Value| scene.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    assert_eq!(fields(&report["scene"]), fields(&examples[1]));
    assert_eq!(report["view"]["far"], Value::Null);
    assert_eq!(report["body"]["receiver_counts"].as_array().unwrap().len(), 3);
}

/// The page's example of an error is one.
#[test]
fn the_error_is_what_is_said() {
    let text = program::PAPER.replace("\"near\": 1", "\"near\": \"x\"");
    let output = report(&["--scene", "-"], &text);
    let said = String::from_utf8(output.stderr).unwrap();
    let said = said.trim().trim_start_matches("report: stdin: ").to_owned();
    assert!(PAGE.contains(&format!("`scene.json: {said}`")), "{said}");
    assert!(json_of(&report(&["--json"], "")).is_object());
}
