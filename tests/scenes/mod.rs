//! A scene, and what tests measure on its maps.
#![allow(dead_code, unused_imports, reason = "every test file compiles this module and uses a part of it")]
#![allow(clippy::disallowed_methods, reason = "tests may call what the library must not")]

#[path = "../random/measure.rs"]
mod measure;

pub(crate) use measure::*;
