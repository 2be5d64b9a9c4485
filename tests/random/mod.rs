//! Random tests: one runner for all of them, and strategies for their input.
//!
//! | variable | default | meaning |
//! |---|---|---|
//! | `SHADOW_WARP_CASES` | 1 | how many times the usual number of cases each test runs |
//! | `SHADOW_WARP_SEED` | 1 | the seed of all strategies; each test and class has its own stream |
//!
//! A failure is shrunk, printed, and kept in `tests/regressions/`, which is run first from then on.

#![allow(dead_code, unused_imports, reason = "every test file compiles this module and uses a part of it")]
#![allow(clippy::expect_used, clippy::panic, reason = "a wrong variable, or a property that fails, stops the test")]
#![allow(clippy::disallowed_methods, reason = "tests may call what the library must not")]

pub(crate) mod basic;
pub(crate) mod casters;
pub(crate) mod cuts;
pub(crate) mod lamps;
pub(crate) mod measure;
mod ratchet;
pub(crate) mod scenes;
pub(crate) mod trapezoid;
pub(crate) mod views;

use std::cell::RefCell;

pub(crate) use proptest::prelude::{Strategy, any, prop};
use proptest::test_runner::{Config, FileFailurePersistence, RngSeed, TestError, TestRunner};
pub(crate) use ratchet::Ratchet;

fn variable(name: &str) -> u64 {
    let value = std::env::var(name).map_or(Ok(1), |text| text.parse());
    value.unwrap_or_else(|_| panic!("{name} must be a whole number"))
}

/// How many times the usual number of cases is to be run.
pub(crate) fn multiplier() -> u32 {
    let cases = u32::try_from(variable("SHADOW_WARP_CASES")).expect("SHADOW_WARP_CASES is too large");
    assert!(cases > 0, "SHADOW_WARP_CASES must be positive");
    cases
}

/// Whether this is the run that ratchets were set for: the usual cases of the usual seed.
pub(crate) fn is_usual_run() -> bool {
    variable("SHADOW_WARP_CASES") == 1 && variable("SHADOW_WARP_SEED") == 1
}

/// Runs a property on `cases` times [`multiplier`] values of a strategy. The property fails by a
/// panic.
///
/// `name` names the property and, where there are several runners, the class: `"casters/FlatBox"`.
/// It is the name of the file of kept failures and chooses the stream of random numbers.
pub(crate) fn check<S: Strategy>(name: &str, cases: u32, strategy: S, property: impl FnMut(S::Value)) {
    // FNV-1a: each name has a stream of its own.
    let hash = name
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3));
    let file: &'static str = format!("tests/regressions/{}.txt", name.replace('/', "-")).leak();
    let config = Config {
        cases: cases.checked_mul(multiplier()).expect("SHADOW_WARP_CASES is too large"),
        rng_seed: RngSeed::Fixed(hash.wrapping_add(variable("SHADOW_WARP_SEED"))),
        failure_persistence: Some(Box::new(FileFailurePersistence::Direct(file))),
        source_file: Some(file!()),
        max_global_rejects: u32::MAX,
        max_local_rejects: 1 << 20,
        max_shrink_iters: 4096,
        ..Config::default()
    };
    let property = RefCell::new(property);
    let run = TestRunner::new(config).run(&strategy, |value| {
        (property.borrow_mut())(value);
        Ok(())
    });
    match run {
        Ok(()) => {}
        Err(TestError::Fail(reason, input)) => panic!("{name}: {reason}\nsmallest input that fails: {input:?}"),
        Err(TestError::Abort(reason)) => panic!("{name}: {reason}"),
    }
}
