//! The best warp of the family: the minimum of the worst error over a body.

use crate::math::{max, min, sqrt};

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
/// - Along the warp each point gives `((1 - t)^2/rho + 2 t (1 - t) + t^2 rho) base/z`, a convex function of `rho` that is
///   strictly falling, strictly growing, or strictly convex; so the greatest of them is convex and has one minimum. That is
///   continuous in camera and light where the axes are.
/// - Across it, a point `k` that is worst, with `i` and `j` at the two sides of the map, gives `x_i w_k/w_i - x_j w_k/w_j`
///   over `z_k`, where `x_i >= 0 >= x_j`. Each of the two terms is a linear fraction of `rho`, so monotone; if one grows and the
///   other falls, the ratio of their slopes is a square of a linear fraction that grows, so the sum first falls and then grows.
///   The greatest of such functions is of this kind again (where it is at most `c` is an interval): **quasi-convex**, with
///   one valley, which may have a flat ground.
/// - So is the larger of both. Only the product may have two valleys; they lie between the minima along and across.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Objective {
    /// The error along the warp. Continuous in camera and light where the axes are.
    Along,
    /// The error across the warp. Where its valley is flat (to 5e-10, for a thousandth of the ratio and more), the error along
    /// decides. It can jump.
    Across,
    /// The larger of both, which is what [`Fit::worst_texel`](crate::Fit::worst_texel) tells. The default. Where the error
    /// across decides, it can change as fast as that one does. On axes fixed by the light the finished map may be no better
    /// than the one without a warp, which is then taken: there it can jump.
    #[default]
    Larger,
    /// The product of both: how many times more texels a map needs everywhere to have no error anywhere, the storage
    /// factor of Lloyd 2007, Sec. 3.5. It can jump between two valleys.
    Product,
}

/// The worst perspective aliasing of a warp over a body, in pixels per texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aliasing {
    /// Along the warp.
    pub along: f64,
    /// Across the warp.
    pub across: f64,
}

impl Objective {
    /// Returns the value of the objective.
    #[must_use]
    pub fn of(self, errors: &Aliasing) -> f64 {
        let Aliasing { along, across } = *errors;
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

/// The search for the points that are the worst for a ratio, by their numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search {
    ratio: f64,
    /// Along, across, and at the two sides of the map.
    values: [f64; 4],
    numbers: [usize; 4],
    len: usize,
}

impl Search {
    #[inline(always)]
    pub(crate) fn new(ratio: f64) -> Self {
        Self { ratio, values: [0.0; 4], numbers: [0; 4], len: 0 }
    }

    #[inline(always)]
    pub(crate) fn include(&mut self, point: &Point) {
        let w = point.w(self.ratio);
        let side = point.x / w;
        let values = [w * w * point.along, w * point.across, side, -side];
        for (which, value) in values.into_iter().enumerate() {
            self.numbers[which] = if value > self.values[which] { self.len } else { self.numbers[which] };
            self.values[which] = max(value, self.values[which]);
        }
        self.len += 1;
    }

    pub(crate) fn errors(&self) -> Aliasing {
        let [along, per_pixel, right, left] = self.values;
        Aliasing { along: along / self.ratio, across: per_pixel * (right + left) }
    }

    /// The function that is greatest at this ratio, made of the points of the numbers that were found.
    #[inline(always)]
    pub(crate) fn piece(&self, objective: Objective, point: impl Fn(usize) -> Point) -> Piece {
        let Aliasing { along, across } = self.errors();
        let is_across = objective == Objective::Across || objective == Objective::Larger && across > along;
        if !is_across {
            return Piece::Along(point(self.numbers[0]));
        }
        let k = point(self.numbers[1]);
        let side = |which: usize| {
            let i = point(self.numbers[which]);
            // No side of the map is beyond the centre. The slope: x (w_k/w_i)' = x (v_k u_i - u_k v_i)/w_i^2 for w = u + v rho.
            let x = if self.values[which] > 0.0 { i.x.abs() } else { 0.0 };
            Side { x, start: i.start, end: i.end, rise: x * (k.end * i.start - k.start * i.end) }
        };
        Piece::Across { start: k.start * k.across, end: k.end * k.across, sides: [side(2), side(3)] }
    }
}

/// The error of one point, or of three, as a function of the ratio: first falling, then growing. The error of the body is
/// nowhere less.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Piece {
    /// `w^2 along/rho`.
    Along(Point),
    /// `(start + end rho) (x/w of both sides)`.
    Across { start: f64, end: f64, sides: [Side; 2] },
}

/// A point that a side of the map touches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Side {
    x: f64,
    start: f64,
    end: f64,
    rise: f64,
}

impl Side {
    fn w(&self, ratio: f64) -> f64 {
        self.start + ratio * self.end
    }
}

impl Piece {
    /// Numerator and denominator.
    #[inline(always)]
    fn fraction(&self, ratio: f64) -> (f64, f64) {
        match self {
            Self::Along(point) => {
                let w = point.w(ratio);
                (w * w * point.along, ratio)
            }
            Self::Across { start, end, sides: [i, j] } => {
                let (w, w_i, w_j) = (start + ratio * end, i.w(ratio), j.w(ratio));
                (w * (i.x * w_j + j.x * w_i), w_i * w_j)
            }
        }
    }

    /// The derivatives of numerator and denominator.
    #[inline(always)]
    fn slopes(&self, ratio: f64) -> (f64, f64) {
        match self {
            Self::Along(point) => (2.0 * point.w(ratio) * point.end * point.along, 1.0),
            Self::Across { start, end, sides: [i, j] } => {
                let (w, w_i, w_j) = (start + ratio * end, i.w(ratio), j.w(ratio));
                let (width, change) = (i.x * w_j + j.x * w_i, i.x * j.end + j.x * i.end);
                (end * width + w * change, i.end * w_j + w_i * j.end)
            }
        }
    }

    fn value(&self, ratio: f64) -> f64 {
        let (numerator, denominator) = self.fraction(ratio);
        numerator / denominator
    }

    /// Has the sign of the derivative.
    fn slope(&self, ratio: f64) -> f64 {
        match self {
            Self::Along(point) => ratio * point.end - point.start,
            Self::Across { sides: [i, j], .. } => {
                let (w_i, w_j) = (i.w(ratio), j.w(ratio));
                i.rise / (w_i * w_i) + j.rise / (w_j * w_j)
            }
        }
    }

    /// Where the piece is least between two ratios.
    fn least_between(&self, low: f64, high: f64) -> f64 {
        let ratio = match self {
            // Without an end, it falls for ever.
            Self::Along(point) => point.start / point.end,
            Self::Across { sides: [i, j], .. } => {
                if i.rise >= 0.0 && j.rise >= 0.0 {
                    low
                } else if i.rise <= 0.0 && j.rise <= 0.0 {
                    high
                } else {
                    // |rise_i|/w_i^2 = |rise_j|/w_j^2
                    let (p, q) = (sqrt(i.rise.abs()), sqrt(j.rise.abs()));
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
const ACCURACY: f64 = 1e-11;
/// Errors that differ by less than this, relatively, are equally good. A hundred times what a search leaves.
pub(crate) const TIE: f64 = 1e-9;
/// The relative difference of two pieces, or of two ratios, where the pieces have met: well below [`ACCURACY`], well above
/// rounding.
const MET: f64 = 1e-12;
/// Halvings, in logarithm, that take the widest bracket, 1 to 1e8, to [`MET`]: 2^-45 of ln 1e8 is 5e-13.
const HALVINGS: usize = 45;
/// After so many rounds every second one halves the bracket, whatever the others do.
const QUICK_ROUNDS: usize = 8;
const MOST_ROUNDS: usize = QUICK_ROUNDS + 2 * HALVINGS;

/// Whether a round is one of those that halve the bracket.
fn is_slow(round: usize) -> bool {
    round > QUICK_ROUNDS && round % 2 == 0
}

/// The number, or the end of the bracket that it is beyond. NaN is the upper one. (`f64::clamp` may panic.)
fn within(x: f64, low: f64, high: f64) -> f64 {
    max(min(x, high), low)
}

/// The middle of a bracket, in logarithm, and inside it whatever the rounding.
fn halved(low: f64, high: f64) -> f64 {
    within(sqrt(low * high), low, high)
}

/// The minimum of an error that first falls and then grows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Valley {
    pub(crate) ratio: f64,
    /// The error there.
    least: f64,
    /// Pieces that are nowhere above the error: one that falls before the minimum, one that grows after it, and the one that
    /// was met there.
    pieces: [Option<Piece>; 3],
}

impl Valley {
    /// Whether the error may be as small as here at a ratio a thousandth away. A no is proved: a piece that is nowhere
    /// above the error is greater there.
    fn may_be_flat(&self, most: f64) -> bool {
        [self.ratio * 0.999, self.ratio * 1.001].into_iter().any(|aside| {
            let is_above = |piece: &Piece| piece.value(aside) > self.least * (1.0 + TIE);
            // Past an end of the range there is nothing.
            (1.0..=most).contains(&aside) && !self.pieces.iter().flatten().any(is_above)
        })
    }
}

/// Finds the ratio, from 1 to `most`, at which an error is least that first falls and then grows. `piece` finds the piece that
/// is greatest at a ratio. Two pieces that are known beforehand save looks: one that falls at 1, and one that grows at `most`.
///
/// Form: Kelley's method of cutting planes, with the pieces of the function themselves in place of planes. Left of the minimum
/// one piece is known that falls, right of it one that grows. Where the larger of the two is least, the whole function is
/// looked at; if it is no greater there, that is the minimum of it all. It takes 1 to 5 rounds; later ones halve the
/// bracket of the two, so that [`MOST_ROUNDS`] are enough whatever happens. The least error seen counts.
#[inline(always)]
pub(crate) fn least_of_valley(most: f64, [falls, grows]: [Option<Piece>; 2], piece: impl Fn(f64) -> Piece) -> Valley {
    let at = |ratio: f64, pieces| Valley { ratio, least: piece(ratio).value(ratio), pieces };
    if most <= LEAST_RATIO {
        return at(1.0, [None; 3]);
    }
    let known = |guess: Option<Piece>, ratio: f64, sign: f64| {
        guess.filter(|piece| sign * piece.slope(ratio) > 0.0).unwrap_or_else(|| piece(ratio))
    };
    let mut low = (LEAST_RATIO, known(falls, LEAST_RATIO, -1.0));
    if low.1.slope(LEAST_RATIO) >= 0.0 {
        return at(1.0, [Some(low.1), None, None]);
    }
    let mut high = (most, known(grows, most, 1.0));
    if high.1.slope(most) <= 0.0 {
        return at(most, [Some(high.1), None, None]);
    }
    let mut best = Valley { ratio: 1.0, least: f64::INFINITY, pieces: [None; 3] };
    for round in 1..=MOST_ROUNDS {
        let halves = is_slow(round);
        let ratio = if halves { halved(low.0, high.0) } else { meet(&low, &high) };
        let found = piece(ratio);
        let value = found.value(ratio);
        let bound = max(low.1.value(ratio), high.1.value(ratio));
        if value < best.least {
            best = Valley { ratio, least: value, pieces: [None, None, Some(found)] };
        }
        // Where they meet, nothing is less than these two.
        let is_least = !halves && value <= bound * (1.0 + ACCURACY);
        if is_least || high.0 <= low.0 * (1.0 + ACCURACY) {
            break;
        }
        *(if found.slope(ratio) < 0.0 { &mut low } else { &mut high }) = (ratio, found);
    }
    best.pieces = [Some(low.1), Some(high.1), best.pieces[2]];
    // No more than rounding off 1, and not worse there.
    if best.ratio <= LEAST_RATIO {
        best.ratio = 1.0;
    }
    best
}

/// Where the larger of two pieces is least: of one that falls at the lower of two ratios, and one that grows at the higher. In
/// between, ends included.
fn meet((low, falling): &(f64, Piece), (high, growing): &(f64, Piece)) -> f64 {
    let of_falling = falling.least_between(*low, *high);
    if growing.value(of_falling) <= falling.value(of_falling) {
        return of_falling;
    }
    let of_growing = growing.least_between(*low, *high);
    if falling.value(of_growing) <= growing.value(of_growing) {
        return of_growing;
    }
    // Between the two minima one falls and the other grows, so they meet once, whichever minimum comes first.
    let ((mut a, growing), (mut b, falling)) = if of_growing <= of_falling {
        ((of_growing, growing), (of_falling, falling))
    } else {
        ((of_falling, falling), (of_growing, growing))
    };
    if let (Piece::Along(p), Piece::Along(q)) = (falling, growing) {
        // Both are squares, but for the ratio, of functions that are linear.
        let (root_p, root_q) = (sqrt(p.along), sqrt(q.along));
        let met = (root_p * p.start - root_q * q.start) / (root_q * q.end - root_p * p.end);
        // Two points that differ by rounding give anything.
        return within(met, a, b);
    }
    // Halley's method in logarithms, where both are
    // nearly straight: with the quotient r = p/q of the two and its slope s, the next ratio is r^(-1/s) times this one, and
    // that power a fraction which is right to third order about 1. The bracket [a, b] holds the meeting, and each ratio lies
    // in it: in place of one that leaves it its middle is taken. The ratio that is returned has been looked at: the two are
    // equal there, or the next step is none.
    let mut ratio = a;
    for round in 1..=MOST_ROUNDS {
        let ((n, d), (m, e)) = (growing.fraction(ratio), falling.fraction(ratio));
        let (p, q) = (n * e, m * d);
        *(if p < q { &mut a } else { &mut b }) = ratio;
        if (p - q).abs() <= MET * p {
            break;
        }
        let ((dn, dd), (dm, de)) = (growing.slopes(ratio), falling.slopes(ratio));
        let (dp, dq) = (dn * e + n * de, dm * d + m * dd);
        let power = -p * q / (ratio * (dp * q - dq * p));
        let next = ratio * (((1.0 + power) * p + (1.0 - power) * q) / ((1.0 - power) * p + (1.0 + power) * q));
        if (next - ratio).abs() <= MET * ratio || b <= a * (1.0 + MET) {
            break;
        }
        ratio = if a < next && next < b && !is_slow(round) { next } else { halved(a, b) };
    }
    ratio
}

/// Of the ratios at which an error across is as small as at the bottom of its valley, the one where the other error is
/// smallest, and of those the weakest. `errors` are those at a ratio, `primary` the one that is least, `along` finds the valley
/// of the error along the warp.
///
/// The error across may have flat ground: where the point that is worst and those at the map's sides lie at one place along the
/// warp, the ratio does not change it. The error along has one lowest point. So that one, or the end of the ground next to it.
#[inline(always)]
pub(crate) fn on_flat_ground(
    valley: &Valley,
    most: f64,
    errors: impl Fn(f64) -> Aliasing,
    primary: Objective,
    along: impl FnOnce() -> Valley,
) -> f64 {
    if !valley.may_be_flat(most) {
        return valley.ratio;
    }
    // Half of a tie, so that what is compared with the result later is not in doubt by rounding.
    let limit = valley.least * (1.0 + 0.5 * TIE);
    let is_good = |ratio: f64| primary.of(&errors(ratio)) <= limit;
    let best_along = along();
    // Where the error along is all the same, the weaker warp.
    let goal = if errors(1.0).along <= best_along.least * (1.0 + TIE) { 1.0 } else { best_along.ratio };
    if is_good(goal) {
        return goal;
    }
    let (mut good, mut bad) = (valley.ratio, goal);
    for _ in 0..HALVINGS {
        let middle = halved(min(good, bad), max(good, bad));
        *(if is_good(middle) { &mut good } else { &mut bad }) = middle;
    }
    good
}

/// Steps of the scan for the valleys of the product.
const SCAN: usize = 16;
/// Rounds of the golden section: 0.618^60 is 3e-13.
const SECTIONS: usize = 60;

/// Returns the ratio at which a value is least between the two ratios at which the errors along and across are.
///
/// Left of both minima both errors fall, and right of both they grow: the minimum of their product lies between. It is
/// scanned for, as there may be two valleys, and the best place is narrowed down.
pub(crate) fn least_between([along, across]: [f64; 2], value: impl Fn(f64) -> f64) -> f64 {
    let (low, high) = (min(along, across), max(along, across));
    // Even in 1/ratio, which is where a map's places are even: in logarithm it would need one, and there is none here.
    let place = |step: f64| low * high / (high - (high - low) * (step / SCAN as f64));
    let (mut best, mut least) = (0.0, value(low));
    for step in 1..=SCAN {
        let step = step as f64;
        let error = value(place(step));
        if error < least {
            (best, least) = (step, error);
        }
    }
    let golden = 0.5 * (sqrt(5.0) - 1.0);
    let (mut a, mut b) = (max(best - 1.0, 0.0), min(best + 1.0, SCAN as f64));
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
    let (step, error) = if error < least { (last, error) } else { (best, least) };
    // No warp is not between the two, where one of the errors grows from the start.
    if value(1.0) <= error { 1.0 } else { within(place(step), low, high) }
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, reason = "tests may call what the library must not")]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;
    use proptest::test_runner::{Config, RngSeed, TestRunner};

    use super::*;

    /// The deeper of two valleys, where a golden section alone goes down the other one.
    #[test]
    fn the_deeper_valley_is_found() {
        let value = |ratio: f64| min(5.0 * (ratio - 1.05).abs(), 0.25 * (ratio - 3.6).abs() + 0.1);
        for ends in [[1.0, 10.0], [10.0, 1.0]] {
            assert!((least_between(ends, value) - 1.05).abs() < 1e-9);
        }
    }

    /// However the value behaves, no warp is one of the candidates.
    #[test]
    fn no_warp_is_compared_with_the_product() {
        assert!((least_between([2.0, 5.0], |ratio| ratio) - 1.0).abs() <= 0.0);
        assert!((least_between([2.0, 5.0], |ratio| (ratio - 3.0).abs()) - 3.0).abs() < 1e-9);
    }

    fn search(points: &[Point], ratio: f64) -> Search {
        let mut search = Search::new(ratio);
        points.iter().for_each(|point| search.include(point));
        search
    }

    /// Points anywhere in a body, some of them at one place along it, at depths of all sizes. As in a fit, there is something
    /// on either side of the centre, or at it.
    fn points() -> impl Strategy<Value = Vec<Point>> {
        let place = prop_oneof![0.0..=1.0, Just(0.0), Just(1.0), Just(0.25)];
        let size = (0.0..4.0).prop_map(|x: f64| [1e-3, 0.1, 1.0, 10.0, 1e3][x as usize]);
        let point = (place, -1.0..1.0, size, 0.1..1.0).prop_map(|(t, x, size, pixels): (f64, f64, f64, f64)| Point {
            start: 1.0 - t,
            end: t,
            x,
            along: pixels * size,
            across: 0.7 * pixels * size,
        });
        prop::collection::vec(point, 2..12)
    }

    /// Against a dense scan: no other ratio is better, by the function that reports the errors; and of those that are as good
    /// none has a smaller other error.
    #[test]
    fn nothing_is_better_than_what_is_found() {
        let config = Config { cases: 800, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() };
        let run = TestRunner::new(config).run(&(points(), 0.0..8.0), |(points, decades)| {
            let most = 10.0_f64.powf(decades);
            let errors = |ratio: f64| search(&points, ratio).errors();
            let valley = |of: Objective| {
                least_of_valley(most, [None; 2], |ratio| search(&points, ratio).piece(of, |number| points[number]))
            };
            for objective in [Objective::Along, Objective::Across, Objective::Larger] {
                let found = valley(objective);
                let ratio = if objective == Objective::Along {
                    found.ratio
                } else {
                    on_flat_ground(&found, most, errors, objective, || valley(Objective::Along))
                };
                prop_assert!((1.0..=most).contains(&ratio), "{objective:?}: {ratio} of {most}");
                let best = errors(ratio);
                let [least, other] = [objective.of(&best), min(best.along, best.across)];
                let (steps, mut at) = (400, 1.0);
                let factor = (most.ln() / f64::from(steps)).exp();
                for _ in 0..=steps {
                    let there = errors(min(at, most));
                    prop_assert!(least <= objective.of(&there) * (1.0 + 2.0 * TIE), "{objective:?} {ratio} {at}");
                    // As good, but for the rounding: then it has no smaller error along.
                    let is_as_good = objective.of(&there) <= least * (1.0 + 0.1 * TIE);
                    let is_across = objective != Objective::Along && best.across >= best.along;
                    let smaller = there.along < best.along * (1.0 - 1e-6);
                    prop_assert!(
                        !(is_as_good && is_across && smaller),
                        "{objective:?} {ratio} {at}: {there:?} {other}"
                    );
                    at *= factor;
                }
            }
            Ok(())
        });
        assert!(run.is_ok(), "{run:?}");
    }
}
