use core::fmt;

/// What can go wrong. Every function that can fail returns this one type.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// An argument does not meet its condition. NaN and infinity meet none, unless the condition says otherwise.
    Invalid {
        /// The argument's name, or that of the part of it that is wrong: `near`, of a depth range.
        argument: &'static str,
        /// What must hold: "must be .. ".
        condition: &'static str,
    },
    /// No receiver lies in the view volume, so no shadow can be seen and no map is needed.
    NothingVisible,
    /// No receiver that is seen lies in what the light shines into, so this light needs no map.
    NothingLit,
    /// This kind of map cannot serve this configuration.
    Unsupported {
        /// What was asked for.
        requested: &'static str,
        /// What serves it.
        use_instead: &'static str,
    },
    /// A body has no room for another cut. Does not happen to bodies this crate makes from views, boxes and lights,
    /// whose capacity is proved; it can happen to one that a caller goes on cutting. A [`Body`](crate::Body) has no room to
    /// count on after a view's six planes; a [`WideBody`](crate::WideBody) has room for eight more.
    BodyFull,
    /// The map is too fine for `f32` positions relative to the given origin: no margin below one texel, and below a quarter
    /// of depth, keeps all receivers inside.
    BeyondF32 {
        /// The bound on the displacement by rounding, in texels, at the worst receiver.
        texels: f64,
        /// What takes the digits, and the way out. Found by trying: without the casters, and about another origin, the bound
        /// is computed again.
        cause: &'static str,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Invalid { argument, condition } => write!(f, "{argument} {condition}"),
            Self::NothingVisible => f.write_str("no receiver lies in the view volume"),
            Self::NothingLit => f.write_str("no receiver in view lies in the light"),
            Self::Unsupported { requested, use_instead } => {
                write!(f, "{requested} is not supported here: use {use_instead}")
            }
            Self::BodyFull => f.write_str("the body has no room for another cut: use a WideBody, see Body::widened"),
            Self::BeyondF32 { texels, cause } => {
                write!(f, "rounding to f32 displaces receivers by up to {texels:.3e} texels: {cause}")
            }
        }
    }
}

impl core::error::Error for Error {}

/// Lengths and coordinates are accepted up to this size, so that their cubes do not overflow.
pub(crate) const MAX_LENGTH: f64 = 1e100;
/// Lengths that must be positive are accepted from this size, so that their cubes do not vanish.
pub(crate) const MIN_LENGTH: f64 = 1e-100;

/// Checks a condition on an argument; written so that a comparison with NaN fails it.
pub(crate) fn require(holds: bool, argument: &'static str, condition: &'static str) -> Result<(), Error> {
    if holds { Ok(()) } else { Err(Error::Invalid { argument, condition }) }
}

/// Checks that each coordinate is finite and at most [`MAX_LENGTH`] in size.
pub(crate) fn require_position(p: glam::DVec3, argument: &'static str) -> Result<(), Error> {
    let small = |x: f64| x.abs() <= MAX_LENGTH;
    require(small(p.x) && small(p.y) && small(p.z), argument, "must be finite, with coordinates of at most 1e100")
}

/// Returns the unit vector along `v`, or the error that names it. Squares of lengths between 1e-100 and 1e100 neither
/// overflow nor vanish.
pub(crate) fn require_direction(v: glam::DVec3, argument: &'static str) -> Result<glam::DVec3, Error> {
    let length = crate::math::sqrt(v.length_squared());
    require(
        (MIN_LENGTH..=MAX_LENGTH).contains(&length),
        argument,
        "must be finite, with a length between 1e-100 and 1e100",
    )?;
    Ok(v / length)
}

/// Checks that a length is at least [`MIN_LENGTH`] and at most [`MAX_LENGTH`].
pub(crate) fn require_length(x: f64, argument: &'static str) -> Result<(), Error> {
    require((MIN_LENGTH..=MAX_LENGTH).contains(&x), argument, "must be between 1e-100 and 1e100")
}
