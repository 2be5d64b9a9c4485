//! What of its input an error repeats.

/// The most characters that an error repeats.
const MOST: usize = 80;
/// How many of them are the end's, where the middle is left out.
const END: usize = 40;

/// Returns a text, or its beginning and its end where it has more than 80 characters.
#[must_use]
pub fn echo(text: &str) -> String {
    let count = text.chars().count();
    if count <= MOST {
        return text.to_owned();
    }
    let beginning = text.chars().take(MOST - END - 1);
    beginning.chain(['\u{2026}']).chain(text.chars().skip(count - END)).collect()
}

/// Returns what serde says about the field at a path, in the words of the format.
pub(crate) fn of_serde(path: &str, message: &str) -> String {
    // The whole file, or nothing that has a name yet.
    let path = if path == "." || path == "?" { "" } else { path };
    let (message, place) = match message.rfind(" at line ") {
        Some(at) => message.split_at(at),
        None => (message, ""),
    };
    let (said, expected) = match message.rsplit_once(", expected ") {
        Some((said, expected)) => (said, format!(", expected {}", in_words(expected))),
        None => (message, String::new()),
    };
    let quoted = |kind: &str| said.strip_prefix(kind).and_then(|rest| rest.split('`').next());
    let joined = |field: &str| if path.is_empty() { field.to_owned() } else { format!("{path}.{field}") };
    // The path names the field already, or ends just before one that is not there.
    let (path, said) = match (quoted("missing field `"), quoted("duplicate field `")) {
        (Some(field), _) => (joined(field), "missing field"),
        (_, Some(field)) if path.rsplit('.').next() == Some(field) => (path.to_owned(), "duplicate field"),
        (_, Some(field)) => (joined(field), "duplicate field"),
        _ if said.starts_with("unknown field `") => (path.to_owned(), "unknown field"),
        _ if said == "trailing characters" && !path.is_empty() => (path.to_owned(), "too many elements"),
        _ => (path.to_owned(), said),
    };
    let separator = if path.is_empty() { "" } else { ": " };
    format!("{}{separator}{}{expected}{place}", echo(&path), echo(said))
}

/// Rust's names of types, as the format calls them.
fn in_words(expected: &str) -> &str {
    match expected {
        "f32" | "f64" => "a number",
        "u32" | "u64" => "a whole number that is not negative",
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_most_eighty_characters_are_repeated() {
        let long = "\u{e9}a".repeat(500);
        assert_eq!(echo(&long).chars().count(), MOST);
        assert_eq!(echo(&long[..120]), long[..120]);
        let message = format!("invalid type: string {long:?}, expected f64 at line 3 column 4");
        let said = of_serde("view.near", &message);
        assert!(said.starts_with("view.near: invalid type: string \"\u{e9}a\u{e9}a"), "{said}");
        assert!(said.ends_with("\u{e9}a\", expected a number at line 3 column 4"), "{said}");
        assert!(said.chars().count() < 80 + MOST, "{said}");
    }

    #[test]
    fn a_field_is_named_once() {
        let cases = [
            ("view", "missing field `near` at line 1 column 2", "view.near: missing field at line 1 column 2"),
            (".", "missing field `view`", "view: missing field"),
            (
                "view.zoom",
                "unknown field `zoom`, expected one of `eye`, `up`",
                "view.zoom: unknown field, expected one of `eye`, `up`",
            ),
            ("view.eye", "duplicate field `eye` at line 1 column 2", "view.eye: duplicate field at line 1 column 2"),
            ("view", "duplicate field `eye`", "view.eye: duplicate field"),
            ("map", "trailing characters at line 1 column 9", "map: too many elements at line 1 column 9"),
            ("?", "trailing characters at line 1 column 9", "trailing characters at line 1 column 9"),
        ];
        for (path, message, said) in cases {
            assert_eq!(of_serde(path, message), said);
        }
    }
}
