//! Tolerances that cannot grow idle.

use std::fmt::Debug;

use super::is_usual_run;

/// A tolerance, and the greatest share of it that was ever used.
///
/// A tolerance is a ratchet: the usual run must use at least a tenth of it, or it is too wide and the test fails; then narrow
/// it. It is set for the usual run. Longer runs, and those of other seeds, see rarer coincidences of rounding, and are
/// allowed [`Ratchet::RARE`] times as much.
pub(crate) struct Ratchet {
    what: &'static str,
    share: f64,
    deviation: f64,
}

impl Ratchet {
    /// The least share of an allowance that the usual run must use.
    const LEAST: f64 = 0.1;
    /// How many times as much any other run may use. Seen: 16, in 20 times the usual cases.
    const RARE: f64 = 30.0;

    pub(crate) fn new(what: &'static str) -> Self {
        Self { what, share: 0.0, deviation: 0.0 }
    }

    /// Asserts that a deviation is within its allowance. NaN is not.
    #[track_caller]
    pub(crate) fn note(&mut self, deviation: f64, allowed: f64, context: impl Debug) {
        let allowed = if is_usual_run() { allowed } else { Self::RARE * allowed };
        assert!(deviation <= allowed, "{}: {deviation:e} > {allowed:e} in {context:?}", self.what);
        if deviation > self.share * allowed {
            (self.share, self.deviation) = (deviation / allowed, deviation);
        }
    }

    /// Ends the test: prints what was used, and fails where that is too little.
    #[track_caller]
    pub(crate) fn finish(self) {
        println!("{}: worst {:.2e}, {:.3} of what is allowed", self.what, self.deviation, self.share);
        let idle = is_usual_run() && self.share < Self::LEAST;
        assert!(!idle, "{}: uses {:.1e} of its allowance: narrow it", self.what, self.share);
    }
}
