//! Depth bias: the least that keeps a lit surface from shadowing itself, exactly.
//!
//! A shadow map holds one depth per texel, and a filter compares a point with the depths of texels around it. On a
//! tilted surface those differ from the point's own by the surface's *depth slope* times the distance in the map. The
//! least bias is the greatest such difference:
//!
//! ```text
//! bias >= R (|D_x| + |D_y|) + quantum      R: the filter's reach      D_x, D_y: stored depth per texel
//! ```
//! [`ShadowMap::depth_slope`] has the slopes, [`Filter::reach`] the reach, [`DepthFormat::quantum`] the quantum.
//! The rasteriser's slope-scaled bias (polygon offset) does the sum by itself: constant one quantum, slope factor
//! [`Filter::least_slope_factor`].
//!
//! # Hyperbolic or linear
//! The depth of the matrix is a fraction over `w`, *hyperbolic* where the map is warped. A map of that kind takes
//! planes to planes, so the slope is constant over a plane however strong the warp is, and a slope-scaled bias by the
//! rasteriser is exact. The price: a surface that faces the light has a slope too,
//!
//! ```text
//! D_s = eta k_y (y - p_y)/(1 + eta)        per height of the map
//! ```
//! with `k_y` one over the depth range where `w = 1` and `y - p_y` the height above the middle of the receivers
//! (which makes it equal and opposite at the two ends, and so the worst one least); and a constant bias grows in the
//! world as `w` does, by `1 + eta` over the map. Linear depth ([`Fit::linear_depth`](crate::Fit::linear_depth)) has
//! neither; but its slope varies over a plane, and it must be written per fragment: see
//! [`vertex_depth_error`].
//!
//! # Signs
//! A bias pushes what is stored away from the light, or what is compared towards it. Biases and quanta are sizes
//! here; times [`ClipSpace::away_from_light`] they are what is added to a stored depth. *Stored* depth is what the
//! depth buffer holds, from 0 to 1 also in OpenGL's clip space of -1 to 1.
//!
//! # Out of scope
//! Blurring of shadows and the choice of the faces to render are filtering and rasteriser state. Where back faces are
//! rendered, stored depths lie deeper by the thickness of what casts: [`ShadowMap::bias_of_length`] says by how much.

use glam::{DVec3, DVec4};

use crate::clip_space::{ClipSpace, DepthRange};
use crate::error::{Error, require, require_direction, require_position};
use crate::map::ShadowMap;
use crate::math::sqrt;

/// Which texels a lookup compares with: `N x N` taps, one texel apart, about the point looked up. No taps count as
/// one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Filter {
    /// Each tap is one comparison, with the nearest texel.
    Nearest(u32),
    /// Each tap is four comparisons, weighted bilinearly ("2x2 PCF", what a comparison sampler with linear filtering
    /// does).
    Bilinear(u32),
}

impl Filter {
    /// Returns how far the centre of a texel that is compared with can lie from the point looked up, in texels, along
    /// each of the map's axes.
    ///
    /// ```text
    /// nearest: (N - 1)/2 + 1/2 = N/2        bilinear: (N - 1)/2 + 1 = (N + 1)/2
    /// ```
    /// The outermost tap, and from there to the centre of the nearest texel or of the next one.
    #[must_use]
    pub fn reach(self) -> f64 {
        let taps = |n: u32| f64::from(n.max(1));
        match self {
            Self::Nearest(n) => 0.5 * taps(n),
            Self::Bilinear(n) => 0.5 * (taps(n) + 1.0),
        }
    }

    /// Returns the least bias for a surface of this depth slope, in the slope's unit of depth, without the depth's own
    /// rounding ([`DepthFormat::quantum`]).
    ///
    /// ```text
    /// R (|D_x| + |D_y|)
    /// ```
    /// Form: the corner of the footprint where both parts add up. Exact on a plane in hyperbolic depth. In linear
    /// depth it is the first order of `R (|D_x| + |D_y|) w'/w`, with `w` at the point and `w'` at the corner's: more
    /// by at most the `1/(1 - h)` of `h = w eta/(1 + eta) R/height`, for axes of the view.
    /// Infinite for an infinite slope.
    #[must_use]
    pub fn least_bias(self, slope: [f64; 2]) -> f64 {
        self.reach() * (slope[0].abs() + slope[1].abs())
    }

    /// Returns the least slope factor of the rasteriser's depth bias (`depthBiasSlopeFactor`, `SlopeScaledDepthBias`,
    /// `glPolygonOffset`) that serves every plane.
    ///
    /// ```text
    /// 2 R
    /// ```
    /// Form: the rasteriser may take `m = max(|D_x|, |D_y|)` for the slope, and all interfaces allow it;
    /// `R (|D_x| + |D_y|) <= 2 R m`, equal where the two are. A rasteriser that takes `sqrt(D_x^2 + D_y^2)`, which is
    /// never less, would need only `sqrt(2) R`. The rendered map has to have the size of the one that is looked up.
    #[must_use]
    pub fn least_slope_factor(self) -> f64 {
        2.0 * self.reach()
    }
}

/// How a depth buffer holds its depths.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum DepthFormat {
    /// 16 bits, evenly from 0 to 1.
    Unorm16,
    /// 24 bits, evenly from 0 to 1.
    Unorm24,
    /// `f32`.
    Float32,
}

impl DepthFormat {
    /// Returns the distance between neighbouring stored depths about a depth from 0 to 1: the least constant bias.
    ///
    /// ```text
    /// 1/(2^n - 1) for n bits        2^(e - 23) for f32, 2^e <= depth < 2^(e + 1)
    /// ```
    /// One quantum, because the stored depth is off by up to half of it, and the compared one, where it is rounded
    /// too, by another half. (Half a quantum would do where it is not, and none where both are rounded alike after
    /// biasing and equal depths count as lit; neither is promised by the interfaces.) The error of *computing* the two
    /// depths in `f32` is not part of it: see [`Fit::rounding`](crate::Fit::rounding).
    ///
    /// Domain: any; a depth that is not within -1 to 1, or NaN, counts as 1, where `f32` is coarsest.
    #[must_use]
    pub fn quantum(self, depth: f64) -> f64 {
        match self {
            Self::Unorm16 => 1.0 / f64::from((1_u32 << 16) - 1),
            Self::Unorm24 => 1.0 / f64::from((1_u32 << 24) - 1),
            Self::Float32 => {
                let size = if depth.abs() < 1.0 { depth.abs() as f32 } else { 1.0 };
                // The next number's bits are the next integer.
                f64::from(f32::from_bits(size.to_bits() + 1)) - f64::from(size)
            }
        }
    }
}

impl ClipSpace {
    /// Returns the sign of a step of stored depth away from the light, and so of every bias of what is stored: 1, or
    /// -1 for reversed depth.
    #[must_use]
    pub fn away_from_light(self) -> f64 {
        match self.depth {
            DepthRange::ZeroToOne | DepthRange::NegativeOneToOne => 1.0,
            DepthRange::OneToZero => -1.0,
        }
    }
}

impl ShadowMap {
    /// Returns the slope of a plane's stored depth in the map: its change per texel along the texture's u and v, as
    /// [`ShadowMap::texture_from_world_at`] has them, at a point in world space of a plane with this normal (of any
    /// length, to either side).
    ///
    /// ```text
    /// D_x = N.(m3 x m2)/N.(m1 x m2)        D_y = N.(m1 x m3)/N.(m1 x m2)
    /// m1 = row_u - u row_w        m2 = row_v - v row_w        m3 = row_z - D row_w
    /// ```
    /// without the rows' constants. Derivation: a step `q` changes `u = row_u.p/w` by `m1.q/w`, and `v` and `D` alike.
    /// Along the plane `N.q = 0`, so `m3 = D_x m1 + D_y m2` up to a multiple of `N`; the triple products with `m2` and
    /// with `m1` leave one unknown each. This holds for every projective map. In light space, for the plane
    /// `y = a x + b z` + constant, with `s` along the warp from 0 to 1 and `X = (x - p_x)/w`, it is
    ///
    /// ```text
    /// D_X = -k_y a        D_s = -k_y (w b d + eta a (x - p_x) - eta (y - p_y))/(1 + eta)
    /// ```
    /// Stored depth is 0 to 1: for OpenGL's clip space half the slope of its -1 to 1. Reversed depth has the opposite
    /// slope. It is the same at all points of a plane.
    ///
    /// Limits: a plane edge-on to the light has no slope; the result is `[INFINITY; 2]`, or, where rounding tilts the
    /// plane, of the order of 1e15. Infinite also where `w <= 0`, which no receiver is. Never NaN.
    /// Accuracy: 1e-14 (1 + eta) over the cosine of normal and light, of `k_y |y - p_y|` and the slopes across the
    /// map.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `point` is finite, with coordinates of at most 1e100, and `normal` has a length
    /// between 1e-100 and 1e100.
    pub fn depth_slope(&self, space: ClipSpace, point: DVec3, normal: DVec3) -> Result<[f64; 2], Error> {
        slope(self, space, None, point, normal)
    }

    /// Returns the slope of a plane's linear depth in the map, as [`ShadowMap::depth_slope`] does for the depth of the
    /// matrix. `linear` is a row such as [`Fit::linear_depth`](crate::Fit::linear_depth) returns; only its gradient
    /// counts, so it may be about any origin, and negated for reversed depth. `space` says which way v points.
    ///
    /// As there, with `m3 = w row_l`: linear depth is not divided by `w`, so a step `q` changes it by `row_l.q`, where
    /// it changes `u` by `m1.q/w`. Other than there, the slope varies over a plane, as `w` does or `w^2`, and a plane
    /// that faces the light has none.
    ///
    /// # Errors
    /// As [`ShadowMap::depth_slope`], and [`Error::Invalid`] unless `linear` is finite.
    pub fn linear_depth_slope(
        &self,
        space: ClipSpace,
        linear: DVec4,
        point: DVec3,
        normal: DVec3,
    ) -> Result<[f64; 2], Error> {
        require(linear.is_finite(), "linear", "must be finite")?;
        slope(self, space, Some(linear.truncate()), point, normal)
    }

    /// Returns how far in the world, away from the light along its ray, a bias moves a stored depth at a point.
    ///
    /// ```text
    /// b w/(m3.r - b row_w.r)        r: along the ray, away from the light        m3 as for the slope
    /// ```
    /// Form: `D(p + t r) = D(p) + b`, solved for `t`; for a light at infinity `row_w.r = 0` and it is `b w` times the
    /// world length of the depth range at `w = 1`. Under reversed depth it is a negative bias that has a positive
    /// length. Linear depth needs no function: `b` over the length of its row's gradient.
    ///
    /// Limits: infinite for a bias that no distance has, and where `w <= 0`.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `point` is finite, with coordinates of at most 1e100, and `bias` is finite.
    pub fn length_of_bias(&self, space: ClipSpace, point: DVec3, bias: f64) -> Result<f64, Error> {
        require(bias.is_finite(), "bias", "must be finite")?;
        let Ray { depth, w_step, w } = ray(self, point)?;
        let bias = bias * space.away_from_light();
        Ok(fraction(bias, (depth - bias * w_step) / w, w))
    }

    /// Returns the bias that moves a stored depth at a point so far in the world, away from the light along its ray:
    /// the inverse of [`ShadowMap::length_of_bias`]. For normal offsets, minimum thicknesses, and back faces.
    ///
    /// ```text
    /// t m3.r/(w + t row_w.r)
    /// ```
    /// Limits: infinite for a length that leaves the space before the light's pole, and where `w <= 0`.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `point` is finite, with coordinates of at most 1e100, and `length` is finite.
    pub fn bias_of_length(&self, space: ClipSpace, point: DVec3, length: f64) -> Result<f64, Error> {
        require(length.is_finite(), "length", "must be finite")?;
        let Ray { depth, w_step, w } = ray(self, point)?;
        Ok(fraction(length * depth, w + length * w_step, w) * space.away_from_light())
    }
}

/// Returns the greatest error of linear depth written per vertex instead of per fragment, as a share of the edge's
/// range of depths, for an edge whose `w` at one end is so many times that at the other.
///
/// ```text
/// max |s - t| = (sqrt r - 1)/(sqrt r + 1)        s = t r/(1 + (r - 1) t)
/// ```
/// Derivation: the rasteriser interpolates a depth that was multiplied by `w` at the vertices evenly over the map, as
/// `s`, where the true one goes as `t`. They are furthest apart at `t = 1/(1 + sqrt r)`, `s = 1 - t`.
///
/// Form: `(r - 1)/(1 + sqrt r)^2`, without the cancellation of `sqrt r - 1` near 1.
/// Exact at `r = 1`: 0. Accuracy: 4 ulp.
///
/// # Errors
/// [`Error::Invalid`] unless `1 <= w_ratio` and finite.
///
/// # Examples
/// ```
/// let error = shadow_warp::vertex_depth_error(10.0)?;
/// assert!((error - 0.5194938532959157).abs() < 1e-15);
/// # Ok::<(), shadow_warp::Error>(())
/// ```
pub fn vertex_depth_error(w_ratio: f64) -> Result<f64, Error> {
    require((1.0..=f64::MAX).contains(&w_ratio), "w_ratio", "must be at least 1 and finite")?;
    let root = 1.0 + sqrt(w_ratio);
    Ok((w_ratio - 1.0) / root / root)
}

fn slope(
    map: &ShadowMap,
    space: ClipSpace,
    linear: Option<DVec3>,
    point: DVec3,
    normal: DVec3,
) -> Result<[f64; 2], Error> {
    require_position(point, "point")?;
    let n = require_direction(normal, "normal")?;
    // About the point itself, so that a row's constant is its value there.
    let matrix = map.texture_from_world_at(point, space);
    let [u, v, z, w] = [0, 1, 2, 3].map(|i| matrix.row(i));
    if w.w <= 0.0 {
        return Ok([f64::INFINITY; 2]);
    }
    // Times w.
    let gradient = |row: DVec4| row.truncate() - w.truncate() * (row.w / w.w);
    let [width, height] = map.size().map(f64::from);
    let (m1, m2) = (gradient(u) * width, gradient(v) * height);
    let m3 = linear.map_or(gradient(z), |l| l * w.w);
    let area = n.dot(m1.cross(m2));
    let slope = [n.dot(m3.cross(m2)) / area, n.dot(m1.cross(m3)) / area];
    let exists = area != 0.0 && !slope[0].is_nan() && !slope[1].is_nan();
    Ok(if exists { slope } else { [f64::INFINITY; 2] })
}

/// What a unit step away from the light changes: depth times w (not reversed, 0 to 1), and w.
struct Ray {
    depth: f64,
    w_step: f64,
    w: f64,
}

fn ray(map: &ShadowMap, point: DVec3) -> Result<Ray, Error> {
    require_position(point, "point")?;
    let away = -map.to_light(point);
    let [_, _, z, w] = map.rows_at(point);
    let w_step = w.truncate().dot(away);
    Ok(Ray { depth: z.truncate().dot(away) - z.w / w.w * w_step, w_step, w: w.w })
}

/// Infinite, with the numerator's sign, where the denominator or `w` is not positive.
fn fraction(numerator: f64, denominator: f64, w: f64) -> f64 {
    let quotient = numerator / denominator;
    if w > 0.0 && denominator > 0.0 && !quotient.is_nan() {
        quotient
    } else if numerator < 0.0 {
        f64::NEG_INFINITY
    } else {
        f64::INFINITY
    }
}
