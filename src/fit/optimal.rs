//! The errors of all warps over the receivers, and the best one.

use glam::{DVec3, DVec4};

use super::Fit;
use super::extent::{Extent, at};
use super::family::Prepared;
use super::frame::{Frame, Measures};
use crate::error::Error;
use crate::math::{ln, max, min};
use crate::warp::Warp;
use crate::warp::optimal::{Errors, Objective, Point, Worst, minimise};

/// The receivers as the errors depend on them.
pub(super) struct Points<'a, const SPOT: bool> {
    frame: &'a Frame<'a>,
    /// The rows of `t` and of `x` from the centre of the warp.
    t: DVec4,
    x: DVec4,
    /// Pixels per unit at a depth of one, over the texels: along the warp, times the extent; and across.
    scale: [f64; 2],
    chosen: Option<Extent>,
    /// The points, if there are not too many.
    few: [Point; FEW],
    len: usize,
}

/// Two bodies of the greatest size. Where there are more, every look at the points goes back to the bodies.
const FEW: usize = 40;

impl<'a, const SPOT: bool> Points<'a, SPOT> {
    #[inline(always)]
    pub(super) fn new(frame: &'a Frame<'a>, measures: &Measures, along: Extent, centre: f64) -> Self {
        let fit = frame.fit;
        let pixels = fit.view.pixels_per_unit_at_one(fit.viewport);
        let texels = fit.map_size.map(f64::from);
        let mut points = Points {
            frame,
            t: (frame.z - along.low * frame.base) / along.size(),
            x: frame.x - centre * frame.base,
            scale: [pixels * along.size() / texels[1], pixels / texels[0]],
            chosen: frame.chosen_depths(measures),
            few: [Point::NONE; FEW],
            len: 0,
        };
        let (mut len, mut few) = (0, [Point::NONE; FEW]);
        points.each(|point| {
            if len < FEW {
                few[len] = *point;
            }
            len += 1;
        });
        (points.len, points.few) = (len, few);
        points
    }

    #[inline(always)]
    fn point(&self, q: DVec3) -> Point {
        let view = self.frame.fit.view;
        let [along, across] = self.scale;
        let depth = view.forward().dot(q - self.frame.to_eye());
        let per_depth = if view.is_perspective() { 1.0 / max(depth, view.near()) } else { 1.0 };
        let base = if SPOT { at(self.frame.base, q) } else { 1.0 };
        let end = min(max(at(self.t, q), 0.0), base);
        let per_base = if SPOT { per_depth / base } else { per_depth };
        Point { start: base - end, end, x: at(self.x, q), along: along * per_base, across: across * per_depth }
    }

    #[inline(always)]
    fn each(&self, mut f: impl FnMut(&Point)) {
        let Some(chosen) = self.chosen else {
            return self.frame.each::<SPOT>(|vertices, shift| {
                for vertex in vertices {
                    f(&self.point(*vertex + shift));
                }
            });
        };
        // All points make the sides of the map; those that were chosen make its error.
        self.frame.each::<SPOT>(|vertices, shift| {
            for vertex in vertices {
                f(&Point { along: 0.0, across: 0.0, ..self.point(*vertex + shift) });
            }
        });
        self.frame.each_between(chosen, |q| f(&self.point(q)));
    }

    fn worst(&self, ratio: f64) -> Worst {
        let mut worst = Worst::new(ratio);
        if self.len <= FEW {
            for point in &self.few[..self.len] {
                worst.include(point);
            }
        } else {
            self.each(|point| worst.include(point));
        }
        worst
    }

    /// The ratio of the best warp, at most `most`.
    pub(super) fn best_ratio(&self, objective: Objective, most: f64) -> f64 {
        minimise(objective, most, |ratio| self.worst(ratio))
    }

    pub(super) fn errors(&self, ratio: f64) -> Errors {
        self.worst(ratio).errors()
    }
}

impl Fit<'_> {
    /// Returns the worst perspective aliasing of a warp over the receivers, along the warp and across it, in pixels per
    /// texel: what [`Rule::Optimal`](crate::Rule::Optimal) minimises, for a map that need not be made. With
    /// [`Axes::View`](crate::Axes), and where the warp is not limited (see [`Fit::solve`]), the larger of both is
    /// [`Fit::worst_texel`] of the map. Axes fixed by the light lie askew to the warp; that is left out here.
    ///
    /// # Errors
    /// As [`Fit::solve`].
    pub fn errors(&self, warp: Warp) -> Result<Errors, Error> {
        let frame = self.frame()?;
        Ok(if frame.spot.is_some() {
            Prepared::<true>::new(&frame)?.points(&frame).errors(warp.ratio())
        } else {
            Prepared::<false>::new(&frame)?.points(&frame).errors(warp.ratio())
        })
    }

    /// Returns a lower bound on [`Fit::errors`] over all warps, along and across separately: no map on these axes can do
    /// better, whatever its ratio, and whatever its spacing along the warp, rational or logarithmic. Divide the
    /// errors of a map by it to know how much there is left to gain.
    ///
    /// ```text
    /// along: d integral of dt max(base/z)       across: the least error over all ratios
    /// ```
    /// Along the warp: where a texel covers at most `k` pixels, a step `dt` takes at least `d base/(k z)` of the map, for the
    /// point of the body at `t` where that is most; all of these make one map. Wherever this is attained the spacing is
    /// logarithmic, in pieces. `z/base` is affine in the fractions of light space, so what counts is the lower hull of the body's
    /// vertices in `(t, z/base)`. Several bodies count one by one. Across the warp the error does not depend on the
    /// spacing, and its minimum is exact (see [`Objective`]).
    ///
    /// # Errors
    /// As [`Fit::solve`].
    pub fn least_errors(&self) -> Result<Errors, Error> {
        let frame = self.frame()?;
        if frame.spot.is_some() { least_errors::<true>(&frame) } else { least_errors::<false>(&frame) }
    }
}

fn least_errors<const SPOT: bool>(frame: &Frame) -> Result<Errors, Error> {
    let prepared = Prepared::<SPOT>::new(frame)?;
    let points = prepared.points(frame);
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
                let point = points.point(q);
                // `t`, and the reciprocal of the error of a uniform map.
                (
                    point.end / (point.start + point.end),
                    1.0 / (point.along * (point.start + point.end) * (point.start + point.end)),
                )
            }),
            along,
        );
    }
    Ok(Errors { along, across: points.errors(ratio).across })
}

/// The integral of `1/g` over the lower hull of the points `(t, g)` of a body, found corner by corner.
fn integral(frame: &Frame, depths: Extent, place: impl Fn(DVec3) -> (f64, f64)) -> f64 {
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
