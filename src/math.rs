//! Small numeric helpers, and the three functions that neither `core` nor plain arithmetic offers, from `std` or `libm`.
//!
//! `sqrt` is correctly rounded by IEEE 754 in both, so every result that uses only `+ - * / sqrt` is the same to the
//! bit in both builds. `tan` is not; it is used for a camera's field of view and a spot light's cone. Nor is `ln`, which only
//! the lower bound on errors needs.

#[cfg(feature = "std")]
pub(crate) fn sqrt(x: f64) -> f64 {
    x.sqrt()
}

#[cfg(all(feature = "libm", not(feature = "std")))]
pub(crate) fn sqrt(x: f64) -> f64 {
    libm::sqrt(x)
}

#[cfg(feature = "std")]
#[expect(clippy::disallowed_methods, reason = "this is the one place that may call it")]
pub(crate) fn tan(x: f64) -> f64 {
    x.tan()
}

#[cfg(all(feature = "libm", not(feature = "std")))]
pub(crate) fn tan(x: f64) -> f64 {
    libm::tan(x)
}

#[cfg(feature = "std")]
#[expect(clippy::disallowed_methods, reason = "this is the one place that may call it")]
pub(crate) fn ln(x: f64) -> f64 {
    x.ln()
}

#[cfg(all(feature = "libm", not(feature = "std")))]
pub(crate) fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// The larger of two numbers that are not NaN. One comparison, where `f64::max` also has to look for NaN:
/// the passes over a body's vertices are half as long with it.
#[inline(always)]
pub(crate) fn max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller of two numbers that are not NaN; see [`max`].
#[inline(always)]
pub(crate) fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Returns `a x b` for unit vectors, without its cancellation where they are nearly parallel: the difference of two
/// close vectors is exact, so the result keeps its relative accuracy in length and direction. The plain product loses
/// all of it at an angle of 1e-16 and half at 1e-8.
pub(crate) fn unit_cross(a: glam::DVec3, b: glam::DVec3) -> glam::DVec3 {
    let c = if a.dot(b) >= 0.0 { a - b } else { a + b };
    c.cross(b)
}
