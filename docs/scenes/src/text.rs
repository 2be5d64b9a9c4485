//! JSON from a file's bytes.

use anyhow::{Result, bail, ensure};

/// Returns the text without its byte-order mark.
///
/// # Errors
/// If it is not UTF-8.
pub(crate) fn text(bytes: &[u8]) -> Result<&str> {
    let is_utf16 = bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]);
    ensure!(!is_utf16, "the file must be UTF-8, and is UTF-16");
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.strip_prefix('\u{feff}').unwrap_or(text)),
        Err(error) => bail!("the file must be UTF-8, and is not at byte {}", error.valid_up_to()),
    }
}
