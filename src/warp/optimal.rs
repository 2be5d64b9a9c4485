//! The best warp: the exact minimum of the worst error over a body.

use crate::math::{max, sqrt};

/// What [`Rule::Optimal`](crate::Rule::Optimal) makes as small as can be: the perspective aliasing, in pixels per texel, at
/// the worst point of what is seen, or of the part between [`Fit::warp_depths`](crate::Fit::warp_depths).
///
/// With the ratio `rho = 1 + eta`, the warp's denominator `w = base (1 + eta t)` and the depth `z` in the view, a texel covers
///
/// ```text
/// along the warp:   w^2/(rho base z) * d       across it:   w/z * (max x/w - min x/w)
/// ```
/// of pixels, but for constants; `base` is 1 for a light at infinity, and the distance along the axis of a spot light.
///
/// - Along the warp each point gives `((1 - t)^2/rho + 2 t (1 - t) + t^2 rho) base/z`, a convex function of `rho`; so is the
///   greatest of them, and unless the body lies at one end, strictly. Its minimum is unique, so it is continuous in camera
///   and light, as long as the axes are.
/// - Across it, a point `k` that is worst, with `i` and `j` at the two sides of the map, gives `x_i w_k/w_i - x_j w_k/w_j`
///   over `z_k`, where `x_i >= 0 >= x_j`. Each of the two terms is a linear fraction of `rho`, so monotone; if one grows and the
///   other falls, the ratio of their slopes is a square of a linear fraction that grows, so the sum first falls and then grows.
///   The greatest of such functions is of this kind again (where it is at most `c` is an interval): **quasi-convex**, with
///   one valley, which may have a flat ground.
/// - So is the larger of both. Only the product may have two valleys; they lie between the minima along and across.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Objective {
    /// The error along the warp. Continuous in camera and light.
    Along,
    /// The error across the warp. Where its valley is flat, the least ratio of it that is found counts, so it can jump.
    Across,
    /// The larger of both, which is what [`Fit::worst_texel`](crate::Fit::worst_texel) tells. The default.
    #[default]
    Larger,
    /// The product of both: how many times more texels a map needs everywhere to have no error anywhere, the storage
    /// factor of Lloyd 2007, Sec. 3.5. It can jump between two valleys.
    Product,
}

/// The worst perspective aliasing of a warp over a body, in pixels per texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Along the warp.
    pub along: f64,
    /// Across the warp.
    pub across: f64,
}

impl Objective {
    /// Returns the value of the objective.
    #[must_use]
    pub fn of(self, errors: &Errors) -> f64 {
        let Errors { along, across } = *errors;
        match self {
            Self::Along => along,
            Self::Across => across,
            Self::Larger => max(along, across),
            Self::Product => along * across,
        }
    }
}

/// A point of the body. The denominator of a warp with ratio `rho` is `start + rho * end` there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    /// `base (1 - t)`.
    pub(crate) start: f64,
    /// `base t`.
    pub(crate) end: f64,
    /// `base x`, from the centre of the warp.
    pub(crate) x: f64,
    /// Pixels per world unit, over `base`, times the extent of the body over the texels along; 0 for points that count for
    /// the map's sides only.
    pub(crate) along: f64,
    /// Pixels per world unit over the texels across.
    pub(crate) across: f64,
}

impl Point {
    pub(crate) const NONE: Self = Self { start: 1.0, end: 0.0, x: 0.0, along: 0.0, across: 0.0 };

    #[inline(always)]
    fn w(&self, ratio: f64) -> f64 {
        self.start + ratio * self.end
    }
}

/// The points that are the worst for a ratio.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Worst {
    ratio: f64,
    along: Point,
    across: Point,
    /// At the two sides of the map.
    right: Point,
    left: Point,
    values: [f64; 4],
}

impl Worst {
    #[inline(always)]
    pub(crate) fn new(ratio: f64) -> Self {
        let [along, across, right, left] = [Point::NONE; 4];
        Self { ratio, along, across, right, left, values: [0.0, 0.0, 0.0, 0.0] }
    }

    #[inline(always)]
    pub(crate) fn include(&mut self, point: &Point) {
        let w = point.w(self.ratio);
        let (per_pixel, side) = (w * point.across, point.x / w);
        let along = w * w * point.along;
        if along > self.values[0] {
            (self.values[0], self.along) = (along, *point);
        }
        if per_pixel > self.values[1] {
            (self.values[1], self.across) = (per_pixel, *point);
        }
        if side > self.values[2] {
            (self.values[2], self.right) = (side, *point);
        }
        if side < self.values[3] {
            (self.values[3], self.left) = (side, *point);
        }
    }

    pub(crate) fn errors(&self) -> Errors {
        let [along, per_pixel, right, left] = self.values;
        Errors { along: along / self.ratio, across: per_pixel * (right - left) }
    }

    /// The function that is greatest at this ratio.
    fn piece(&self, objective: Objective) -> Piece {
        let Errors { along, across } = self.errors();
        match objective {
            Objective::Across => self.piece_across(),
            Objective::Larger | Objective::Product if across > along => self.piece_across(),
            _ => Piece::Along(self.along),
        }
    }

    fn piece_across(&self) -> Piece {
        let k = self.across;
        // x_i (w_k/w_i)' = x_i (v_k u_i - u_k v_i)/w_i^2, for w = u + v rho.
        let rise = |i: Point| k.end * i.start - k.start * i.end;
        Piece::Across {
            k,
            i: self.right,
            j: self.left,
            rise: [self.right.x * rise(self.right), -self.left.x * rise(self.left)],
        }
    }
}

/// The error of one point, or of three, as a function of the ratio: first falling, then growing. The error of the body is
/// nowhere less.
#[derive(Clone, Copy, Debug)]
enum Piece {
    Along(Point),
    Across { k: Point, i: Point, j: Point, rise: [f64; 2] },
}

impl Piece {
    fn value(&self, ratio: f64) -> f64 {
        match self {
            Self::Along(p) => {
                let w = p.w(ratio);
                w * w * p.along / ratio
            }
            Self::Across { k, i, j, .. } => k.w(ratio) * k.across * (i.x / i.w(ratio) - j.x / j.w(ratio)),
        }
    }

    /// Has the sign of the derivative.
    fn slope(&self, ratio: f64) -> f64 {
        match self {
            Self::Along(p) => ratio * p.end - p.start,
            Self::Across { i, j, rise: [p, q], .. } => {
                let (w_i, w_j) = (i.w(ratio), j.w(ratio));
                p / (w_i * w_i) + q / (w_j * w_j)
            }
        }
    }

    /// Where the piece is least between two ratios.
    fn least_between(&self, low: f64, high: f64) -> f64 {
        let ratio = match self {
            // Without an end, or with one that is nothing, it falls for ever.
            Self::Along(p) => p.start / p.end,
            Self::Across { i, j, rise: [p, q], .. } => {
                if *p >= 0.0 && *q >= 0.0 {
                    low
                } else if *p <= 0.0 && *q <= 0.0 {
                    high
                } else {
                    // |p|/w_i^2 = |q|/w_j^2
                    let (p, q) = (sqrt(p.abs()), sqrt(q.abs()));
                    (q * i.start - p * j.start) / (p * j.end - q * i.end)
                }
            }
        };
        // Rounding, and poles, where the slope has one sign throughout.
        if low <= ratio && ratio <= high {
            ratio
        } else if self.slope(low) >= 0.0 {
            low
        } else {
            high
        }
    }
}

/// A ratio this close to 1 is 1. At 1 itself all points of one depth have one error along the warp, so that nothing could
/// be said of its slope there.
const LEAST_RATIO: f64 = 1.0 + 1.0 / (1_u64 << 40) as f64;
/// The relative error that is left of the minimum.
const ACCURACY: f64 = 1e-13;
/// The functions have at most some dozens of pieces, and the search meets no piece twice; it takes 2 to 5 rounds.
const MOST_ROUNDS: usize = 100;

/// Returns the ratio, from 1 to `most`, at which an objective is least, for a function that finds the worst points.
///
/// Form: Kelley's method of cutting planes, with the pieces of the function themselves in place of planes: exact after finitely
/// many rounds. Left of the minimum one piece is known that falls, right of it one that grows. Where the larger of the
/// two is least, the whole function is looked at; if it is no greater there, that is the minimum of it all.
pub(crate) fn minimise(objective: Objective, most: f64, worst: impl Fn(f64) -> Worst) -> f64 {
    match objective {
        Objective::Product => minimise_product(most, worst),
        _ => minimise_valley(objective, most, &worst),
    }
}

/// As [`minimise`], for the objectives that have one valley.
fn minimise_valley(objective: Objective, most: f64, worst: &impl Fn(f64) -> Worst) -> f64 {
    if most <= LEAST_RATIO {
        return 1.0;
    }
    let mut low = (LEAST_RATIO, worst(LEAST_RATIO).piece(objective));
    if low.1.slope(LEAST_RATIO) >= 0.0 {
        return 1.0;
    }
    let mut high = (most, worst(most).piece(objective));
    if high.1.slope(most) <= 0.0 {
        return most;
    }
    for _ in 0..MOST_ROUNDS {
        let ratio = meet(low, high);
        let bound = max(low.1.value(ratio), high.1.value(ratio));
        let found = worst(ratio).piece(objective);
        let slope = found.slope(ratio);
        if found.value(ratio) <= bound * (1.0 + ACCURACY) {
            return ratio;
        }
        if slope < 0.0 {
            low = (ratio, found);
        } else {
            high = (ratio, found);
        }
        if high.0 <= low.0 * (1.0 + ACCURACY) {
            break;
        }
    }
    low.0
}

/// Where the larger of two pieces is least: of one that falls at the lower of two ratios, and one that grows at the higher.
fn meet((low, falling): (f64, Piece), (high, growing): (f64, Piece)) -> f64 {
    let of_falling = falling.least_between(low, high);
    if growing.value(of_falling) <= falling.value(of_falling) {
        return of_falling;
    }
    let of_growing = growing.least_between(low, high);
    if falling.value(of_growing) <= growing.value(of_growing) {
        return of_growing;
    }
    // Between the two minima one falls and the other grows: their difference has one root. The rule of false position,
    // with the value at an end that stays reduced as Anderson and Bjorck (1973) do.
    let difference = |ratio: f64| growing.value(ratio) - falling.value(ratio);
    let rounding = |ratio: f64| 1e-15 * growing.value(ratio);
    let (mut a, mut b) = (of_growing, of_falling);
    let (mut f_a, mut f_b) = (difference(a), difference(b));
    for _ in 0..MOST_ROUNDS {
        let c = (a * f_b - b * f_a) / (f_b - f_a);
        let f_c = difference(c);
        if f_c.abs() <= rounding(c) || (b - a).abs() <= ACCURACY * 0.1 * b {
            return c;
        }
        if (f_c > 0.0) == (f_b > 0.0) {
            let less = 1.0 - f_c / f_b;
            f_a *= if less > 0.0 { less } else { 0.5 };
            (b, f_b) = (c, f_c);
        } else {
            let less = 1.0 - f_c / f_a;
            f_b *= if less > 0.0 { less } else { 0.5 };
            (a, f_a) = (c, f_c);
        }
    }
    0.5 * (a + b)
}

/// Steps of the scan for the valleys of the product.
const SCAN: usize = 16;
/// Rounds of the golden section: 0.618^60 is 3e-13.
const SECTIONS: usize = 60;

/// Left of both minima, along and across, both errors fall, and right of both they grow: the minimum of their product lies
/// between. It is scanned for, as there may be two valleys, and the best place is narrowed down.
fn minimise_product(most: f64, worst: impl Fn(f64) -> Worst) -> f64 {
    let along = minimise_valley(Objective::Along, most, &worst);
    let across = minimise_valley(Objective::Across, most, &worst);
    let (low, high) = if along < across { (along, across) } else { (across, along) };
    let value = |ratio: f64| Objective::Product.of(&worst(ratio).errors());
    // Even in 1/ratio, which is where a map's places are even: in logarithm it would need one, and there is none here.
    let place = |step: f64| {
        let share = step / SCAN as f64;
        low * high / (high - (high - low) * share)
    };
    let (mut best, mut least) = (0.0, value(low));
    for step in 1..=SCAN {
        let step = step as f64;
        let error = value(place(step));
        if error < least {
            (best, least) = (step, error);
        }
    }
    let golden = 0.5 * (sqrt(5.0) - 1.0);
    let (mut a, mut b) = (max(best - 1.0, 0.0), crate::math::min(best + 1.0, SCAN as f64));
    let (mut c, mut d) = (b - golden * (b - a), a + golden * (b - a));
    let (mut f_c, mut f_d) = (value(place(c)), value(place(d)));
    for _ in 0..SECTIONS {
        if f_c <= f_d {
            (b, d, f_d) = (d, c, f_c);
            c = b - golden * (b - a);
            f_c = value(place(c));
        } else {
            (a, c, f_c) = (c, d, f_d);
            d = a + golden * (b - a);
            f_d = value(place(d));
        }
    }
    let (last, error) = if f_c <= f_d { (c, f_c) } else { (d, f_d) };
    if error < least { place(last) } else { place(best) }
}
