//! The errors of all warps over the receivers, and the best one.

use glam::DVec3;

use super::Fit;
use super::extent::Extent;
use super::frame::{Frame, Place};
use super::prepared::Prepared;
use crate::error::Error;
use crate::math::{ln, max, min};
use crate::warp::TIE;
use crate::warp::Warp;
use crate::warp::optimal::{Aliasing, Objective, Piece, Point, Search, least_between, least_of_valley, on_flat_ground};

/// The receivers as the errors depend on them.
pub(super) struct Points<'a, const SPOT: bool, const V: usize, const F: usize> {
    frame: &'a Frame<'a, V, F>,
    /// Where the body begins along the warp, and the reciprocal of its extent.
    start: f64,
    per_extent: f64,
    /// The centre of the warp across it.
    centre: f64,
    eye_depth: f64,
    /// Pixels per unit at a depth of one, over the texels: along the warp, times the extent; and across.
    scale: [f64; 2],
    /// The unit of distances along a spot light's axis: the product of several of them must not overflow.
    unit: f64,
    chosen: Option<Extent>,
}

impl<'a, const SPOT: bool, const V: usize, const F: usize> Points<'a, SPOT, V, F> {
    #[inline(always)]
    pub(super) fn new(frame: &'a Frame<'a, V, F>, prepared: &Prepared<SPOT>) -> Self {
        let (fit, along) = (frame.fit, prepared.along);
        let pixels = fit.view.pixels_per_unit_at_one(fit.viewport);
        let texels = fit.map_size.map(f64::from);
        Points {
            frame,
            start: along.low,
            per_extent: 1.0 / along.size(),
            centre: prepared.centre,
            eye_depth: fit.view.forward().dot(frame.to_eye()),
            scale: [pixels * along.size() / texels[1], pixels / texels[0]],
            unit: if SPOT { prepared.measures.base.high } else { 1.0 },
            chosen: frame.chosen_depths(&prepared.measures),
        }
    }

    #[inline(always)]
    fn point(&self, place: &Place) -> Point {
        let Place { across, along, base, depth } = *place;
        let view = self.frame.fit.view;
        let per_depth = if view.is_perspective() { 1.0 / max(depth - self.eye_depth, view.near()) } else { 1.0 };
        let t = min(max((along - self.start) * self.per_extent, 0.0), 1.0);
        let share = if SPOT { base / self.unit } else { base };
        Point {
            start: share * (1.0 - t),
            end: share * t,
            x: share * (across - self.centre),
            along: self.scale[0] * if SPOT { per_depth * self.unit / share } else { per_depth },
            across: self.scale[1] * if SPOT { per_depth * self.unit } else { per_depth },
        }
    }

    /// Calls `f` with all points. If only some depths were chosen, all vertices make the sides of the map, and what lies in
    /// these depths makes its error.
    #[inline(always)]
    fn each(&self, mut f: impl FnMut(Point)) {
        self.frame.each::<SPOT>(|vertices, shift| {
            for vertex in vertices {
                let point = self.point(&self.frame.place::<SPOT>(*vertex + shift));
                f(if self.chosen.is_some() { Point { along: 0.0, across: 0.0, ..point } } else { point });
            }
        });
        if let Some(chosen) = self.chosen {
            self.frame.each_between(chosen, |q| f(self.point(&self.frame.place::<SPOT>(q))));
        }
    }

    fn search(&self, ratio: f64) -> Search {
        let mut search = Search::new(ratio);
        self.each(|point| search.include(&point));
        search
    }

    fn nth(&self, number: usize) -> Point {
        let (mut found, mut count) = (Point::NONE, 0);
        self.each(|point| {
            found = if count == number { point } else { found };
            count += 1;
        });
        found
    }

    /// The ratio of the best warp, at most `most`, by looks at all points each time.
    fn best_ratio(&self, objective: Objective, most: f64) -> f64 {
        best(objective, most, [None; 2], |ratio| self.search(ratio), |number| self.nth(number))
    }
}

/// More points than a body has, and than most lit ones.
const FEW: usize = 24;

/// Measures the receivers, and finds the excess of the best warp. One body's vertices are kept as they are measured; where there
/// are more, or only some depths count, every look at the points goes back to the bodies.
pub(super) fn prepare<const SPOT: bool, const V: usize, const F: usize>(
    frame: &Frame<V, F>,
    objective: Objective,
) -> Result<(Prepared<SPOT>, f64), Error> {
    let (mut places, mut len) = ([Place::NONE; FEW], 0);
    let prepared = Prepared::<SPOT>::new(frame, |place| {
        if let Some(kept) = places.get_mut(len) {
            *kept = place;
        }
        len += 1;
    })?;
    let most = prepared.most_ratio(frame);
    let all = Points::new(frame, &prepared);
    let Some(places) = places.get(..len).filter(|_| all.chosen.is_none()) else {
        let ratio = all.best_ratio(objective, most);
        return Ok((prepared, ratio - 1.0));
    };
    let mut points = [Point::NONE; FEW];
    // The worst along the warp without one (under a light at infinity), and with one without end: both are no more than hints.
    let (mut first, mut last, mut most_at_once, mut most_in_the_end) = (0, 0, 0.0, 0.0);
    for ((number, place), slot) in places.iter().enumerate().zip(&mut points) {
        let point = all.point(place);
        *slot = point;
        let in_the_end = point.end * point.end * point.along;
        first = if point.along > most_at_once { number } else { first };
        last = if in_the_end > most_in_the_end { number } else { last };
        most_at_once = max(point.along, most_at_once);
        most_in_the_end = max(in_the_end, most_in_the_end);
    }
    let points = &points[..len];
    let known = match objective {
        Objective::Across => [None; 2],
        _ => [first, last].map(|number| Some(Piece::Along(points[number]))),
    };
    let search = |ratio: f64| {
        let mut search = Search::new(ratio);
        points.iter().for_each(|point| search.include(point));
        search
    };
    Ok((prepared, best(objective, most, known, search, |number| points[number]) - 1.0))
}

/// The ratio of the best warp for an objective.
#[inline(always)]
fn best(
    objective: Objective,
    most: f64,
    known: [Option<Piece>; 2],
    search: impl Fn(f64) -> Search,
    point: impl Fn(usize) -> Point,
) -> f64 {
    let errors = |ratio: f64| search(ratio).errors();
    let valley = |of: Objective, known| least_of_valley(most, known, |ratio| search(ratio).piece(of, &point));
    let ratio = match objective {
        Objective::Along => valley(Objective::Along, known).ratio,
        Objective::Across | Objective::Larger => {
            let along = || valley(Objective::Along, [None; 2]);
            on_flat_ground(&valley(objective, known), most, errors, objective, along)
        }
        Objective::Product => {
            let ends = [valley(Objective::Along, known), valley(Objective::Across, [None; 2])];
            least_between(ends.map(|end| end.ratio), |ratio| objective.of(&errors(ratio)))
        }
    };
    // No warp must not be better. (Of equally good ones the choice is made.)
    if objective.of(&errors(1.0)) < objective.of(&errors(ratio)) * (1.0 - TIE) { 1.0 } else { ratio }
}

impl<const V: usize, const F: usize> Fit<'_, V, F> {
    /// Returns the worst perspective aliasing of a warp over the receivers, along the warp and across it, in pixels per
    /// texel: what [`Rule::Optimal`](crate::Rule::Optimal) minimises, for a map that need not be made. With
    /// [`Axes::View`](crate::Axes) and [`Axes::Middle`](crate::Axes), for receivers that are not flat, and where the warp is not
    /// limited (see [`Fit::solve`]), the larger of both is [`Fit::worst_texel`] of the map. Axes fixed by the light lie askew
    /// to the warp, and a flat body is fitted wider than it is; that is left out here.
    ///
    /// # Errors
    /// As [`Fit::solve`].
    pub fn errors(&self, warp: Warp) -> Result<Aliasing, Error> {
        let frame = self.frame()?;
        let search = if frame.spot.is_some() {
            Points::new(&frame, &Prepared::<true>::new(&frame, |_| ())?).search(warp.ratio())
        } else {
            Points::new(&frame, &Prepared::<false>::new(&frame, |_| ())?).search(warp.ratio())
        };
        Ok(search.errors())
    }

    /// Returns the least errors along the warp and across it, each by itself, in pixels per texel.
    ///
    /// ```text
    /// along: d integral of dt max(base/z)       across: the least error over all ratios
    /// ```
    /// `along` is a lower bound on [`Aliasing::along`] of [`Fit::errors`]: for maps on these axes, whatever their ratio and
    /// their spacing along the warp, rational or logarithmic. `across` is no such bound. It is the least
    /// [`Aliasing::across`] over the ratios with *this* centre (the eye's place across, moved into the body): a map with another
    /// centre, on the same axes, can have less.
    ///
    /// Along the warp: where a texel covers at most `k` pixels, a step `dt` takes at least `d base/(k z)` of the map, for the
    /// point of the body at `t` where that is most; all of these make one map. Wherever this is attained the spacing is
    /// logarithmic, in pieces. `z/base` is affine in the fractions of light space, so what counts is the lower hull of the body's
    /// vertices in `(t, z/base)`. Several bodies count one by one.
    ///
    /// # Errors
    /// As [`Fit::solve`].
    pub fn least_errors(&self) -> Result<Aliasing, Error> {
        let frame = self.frame()?;
        if frame.spot.is_some() { least_errors::<true, V, F>(&frame) } else { least_errors::<false, V, F>(&frame) }
    }
}

fn least_errors<const SPOT: bool, const V: usize, const F: usize>(frame: &Frame<V, F>) -> Result<Aliasing, Error> {
    let prepared = Prepared::<SPOT>::new(frame, |_| ())?;
    let points = Points::new(frame, &prepared);
    let ratio = points.best_ratio(Objective::Across, prepared.most_ratio(frame));
    let depths = points.chosen.unwrap_or(prepared.measures.depth);
    let mut along = 0.0;
    for body in frame.fit.receivers {
        // One body at a time, as a job of its own.
        let alone = core::slice::from_ref(body);
        let lit = Fit { receivers: alone, ..*frame.fit };
        if body.is_empty() {
            continue;
        }
        let frame = Frame { fit: &lit, ..*frame };
        along = max(
            integral(&frame, depths, |q| {
                let point = points.point(&frame.place::<SPOT>(q));
                // `t`, and the reciprocal of the error of a uniform map.
                (
                    point.end / (point.start + point.end),
                    1.0 / (point.along * (point.start + point.end) * (point.start + point.end)),
                )
            }),
            along,
        );
    }
    Ok(Aliasing { along, across: points.search(ratio).errors().across })
}

/// The integral of `1/g` over the lower hull of the points `(t, g)` of a body, found corner by corner.
fn integral<const V: usize, const F: usize>(
    frame: &Frame<V, F>,
    depths: Extent,
    place: impl Fn(DVec3) -> (f64, f64),
) -> f64 {
    let mut start = (f64::INFINITY, f64::INFINITY);
    frame.each_between(depths, |q| {
        let (t, g) = place(q);
        if t < start.0 || (t <= start.0 && g < start.1) {
            start = (t, g);
        }
    });
    let mut sum = 0.0;
    loop {
        // The next corner: the least slope, and of those the furthest.
        let (mut next, mut least) = (start, f64::INFINITY);
        frame.each_between(depths, |q| {
            let (t, g) = place(q);
            let slope = (g - start.1) / (t - start.0);
            if t > start.0 && (slope < least || (slope <= least && t > next.0)) {
                (next, least) = ((t, g), slope);
            }
        });
        if next.0 <= start.0 {
            return sum;
        }
        sum += (next.0 - start.0) * mean_reciprocal(start.1, next.1);
        start = next;
    }
}

/// `ln(b/a)/(b - a)`: the mean of `1/g` for `g` from `a` to `b`.
///
/// Form: for `b` near `a`, where this is 0/0, the first terms of `2 artanh(y)/(y (a + b))` with `y = (b - a)/(a + b)`;
/// at the limit the next one is `y^6/7`, 2e-16.
fn mean_reciprocal(a: f64, b: f64) -> f64 {
    let (sum, y) = (a + b, (b - a) / (a + b));
    if y.abs() < 3e-3 { 2.0 * (1.0 + y * y * (1.0 / 3.0 + y * y / 5.0)) / sum } else { ln(b / a) / (b - a) }
}
