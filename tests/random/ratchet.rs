//! Tolerances that cannot grow idle.

use std::fmt::Debug;

use super::is_usual_run;

/// A tolerance, and the greatest share of it that was ever used.
///
/// A tolerance is a ratchet: the usual run must use at least a tenth of it, or it is too wide and
/// the test fails. When the usual run needs less, narrow it. The test fails where the ratchet is
/// dropped, at its end. Longer runs, and those of other seeds, see rarer coincidences of rounding,
/// and may use [`Ratchet::RARE`] times as much.
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

    /// One deviation, and all of them.
    #[track_caller]
    pub(crate) fn once(what: &'static str, deviation: f64, allowed: f64) {
        Self::new(what).note(deviation, allowed, "");
    }

    /// Ends the test before the ratchet is dropped.
    pub(crate) fn finish(self) {}
}

/// Prints what was used, and fails where that is too little.
impl Drop for Ratchet {
    fn drop(&mut self) {
        if std::thread::panicking() {
            return;
        }
        println!("{}: worst {:.2e}, {:.3} of what is allowed", self.what, self.deviation, self.share);
        let idle = is_usual_run() && self.share < Self::LEAST;
        assert!(!idle, "{}: uses {:.1e} of its allowance: narrow it", self.what, self.share);
    }
}
