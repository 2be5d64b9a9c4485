//! The fit of a map of the one family: a warp along light space's z axis.

use glam::{DVec2, DVec3, DVec4};

use super::extent::{Extent, LEAST_ASPECT, fitted, row};
use super::frame::Frame;
use super::optimal;
use super::prepared::Prepared;
use crate::aliasing::Worst;
use crate::basis::Axes;
use crate::error::Error;
use crate::map::{ShadowMap, Texels};
use crate::math::{max, min};
use crate::warp::{Rule, TIE, Warp, on_axis};

/// The excess by a rule that looks at no more than the line of sight.
#[inline(always)]
fn excess<const SPOT: bool, const V: usize, const F: usize>(
    frame: &Frame<V, F>,
    prepared: &Prepared<SPOT>,
    rule: Rule,
) -> f64 {
    let Prepared { measures, along, .. } = prepared;
    let slab = || frame.slab(measures, *along);
    let axis = || frame.view_axis(*along);
    match rule {
        Rule::Explicit(warp) => warp.excess(),
        // The others answer an error that grows towards the eye; an orthographic camera has none.
        _ if !frame.fit.view.is_perspective() => 0.0,
        Rule::LightSpace(rule) if !SPOT => {
            let slab = slab();
            // The part that was chosen decides on the warp's near distance, n = d/eta; the body is as long as it is.
            let whole = if slab.extent > 0.0 { along.size() / slab.extent } else { 0.0 };
            rule.excess(&slab) * whole
        }
        Rule::LightSpace(_) | Rule::OnAxis => on_axis::excess(&slab(), &axis()),
        Rule::Trapezoidal(rule) => rule.excess(&slab(), &axis()),
        Rule::Uniform | Rule::Perspective(_) | Rule::Plane(_) | Rule::Optimal(_) => 0.0,
    }
}

/// With axes that do not turn with the view, the ratio of a warp that does not fade out by itself is at most the fourth power
/// of one plus this times the sine of the angle between light and view, whose logarithm has a slope of at most 16: where
/// the two are parallel a warp has no direction, and must vanish to be continuous. At 6 degrees this is 4.0.
const FADE: f64 = 4.0;

/// The receivers measured, and the warp that a rule chooses for them.
#[inline(always)]
fn prepare<const SPOT: bool, const V: usize, const F: usize>(
    frame: &Frame<V, F>,
    rule: Rule,
) -> Result<(Prepared<SPOT>, Warp), Error> {
    let (prepared, mut excess) = match rule {
        Rule::Optimal(objective) => optimal::prepare::<SPOT, V, F>(frame, objective)?,
        _ => {
            let prepared = Prepared::<SPOT>::new(frame, |_| ())?;
            let excess = excess(frame, &prepared, rule);
            (prepared, excess)
        }
    };
    if frame.fit.axes == Axes::LightFixed
        && (SPOT || !matches!(rule, Rule::LightSpace(_)))
        && !matches!(rule, Rule::Explicit(_))
    {
        let root = 1.0 + FADE * frame.space.sin_gamma;
        excess = min(excess, root * root * (root * root) - 1.0);
    }
    let warp = Warp::clamped(excess).at_most(prepared.most(frame));
    Ok((prepared, warp))
}

pub(super) fn fit<const SPOT: bool, const V: usize, const F: usize>(
    frame: &Frame<V, F>,
    rule: Rule,
) -> Result<ShadowMap, Error> {
    let (prepared, warp) = prepare::<SPOT, V, F>(frame, rule)?;
    Ok(finish::<SPOT, V, F>(frame, prepared, warp))
}

/// The map with the least worst texel, no warp among them.
pub(super) fn best<const SPOT: bool, const V: usize, const F: usize>(frame: &Frame<V, F>) -> Result<ShadowMap, Error> {
    let (prepared, warp) = prepare::<SPOT, V, F>(frame, Rule::OPTIMAL)?;
    let map = finish::<SPOT, V, F>(frame, prepared, warp);
    if warp.excess() > 0.0 && !is_better_than_none::<SPOT, V, F>(frame, &prepared, &map) {
        return fit::<SPOT, V, F>(frame, Rule::Uniform);
    }
    Ok(map)
}

/// Whether the finished map has a smaller worst texel than the one without a warp, or, of equal ones, a smaller error along
/// its other axis. On axes fixed by the light the rectangle about the receivers is another one for each warp, and a flat body
/// is fitted wider than it is: what the search knows nothing of.
fn is_better_than_none<const SPOT: bool, const V: usize, const F: usize>(
    frame: &Frame<V, F>,
    prepared: &Prepared<SPOT>,
    map: &ShadowMap,
) -> bool {
    let texels = frame.fit.map_size.map(f64::from);
    let extents = match frame.fit.axes {
        Axes::View | Axes::Middle | Axes::VertexMean => {
            let side = prepared.measures.across.at_least(prepared.floor);
            [DVec2::new(side.size() / texels[0], 0.0), DVec2::new(0.0, prepared.along.size() / texels[1])]
        }
        Axes::LightFixed => {
            let Rectangle { axes, sides, .. } = Rectangle::of::<SPOT, V, F>(frame);
            let sides = sides.map(|side| side.at_least(prepared.floor));
            [0, 1].map(|axis| askew(frame, axes[axis], 1.0) * (sides[axis].size() / texels[axis]))
        }
    };
    let plain = Texels { w: frame.base, base: frame.base, extents };
    let mut worst = Worst::of([map.texels_at(frame.origin), plain], frame.fit.view, frame.origin);
    match frame.chosen_depths(&prepared.measures) {
        Some(chosen) => frame.each_between(chosen, |q| worst.include(q)),
        None => frame.each::<SPOT>(|vertices, shift| vertices.iter().for_each(|v| worst.include(*v + shift))),
    }
    let [warped, plain] = worst.pixels(frame.fit.viewport).map(|[a, b]| [max(a, b), min(a, b)]);
    // The search gave half of a tie away for a smaller other error: so much is none against what it found.
    let is_no_worse = warped[0] <= plain[0] * (1.0 + TIE);
    let ties = warped[0] >= plain[0] * (1.0 - 0.5 * TIE);
    is_no_worse && (!ties || warped[1] < plain[1] * (1.0 - TIE))
}

/// The receivers' bounding rectangle along axes that are fixed by the light.
struct Rectangle {
    axes: [DVec3; 2],
    /// The axes as rows, whose fractions over `base` these are.
    rows: [DVec4; 2],
    sides: [Extent; 2],
}

impl Rectangle {
    #[inline(always)]
    fn of<const SPOT: bool, const V: usize, const F: usize>(frame: &Frame<V, F>) -> Self {
        let axes = frame.space.fixed_axes();
        let place = frame.light.truncate() * frame.light.w;
        let rows = axes.map(|axis| row(axis, -axis.dot(place)));
        Self { axes, rows, sides: frame.fractions_of_receivers::<2, SPOT>(rows, frame.base) }
    }
}

/// A step along a texture axis goes partly across the warp and partly along it; less along where `w` is more at the point
/// that the warp projects about.
#[inline(always)]
fn askew<const V: usize, const F: usize>(frame: &Frame<V, F>, axis: DVec3, w_middle: f64) -> DVec2 {
    DVec2::new(axis.dot(frame.space.x).abs(), axis.dot(frame.space.z).abs() / w_middle)
}

/// The map with a warp.
#[inline(always)]
fn finish<const SPOT: bool, const V: usize, const F: usize>(
    frame: &Frame<V, F>,
    prepared: Prepared<SPOT>,
    warp: Warp,
) -> ShadowMap {
    let Prepared { measures, along, floor, centre, .. } = prepared;
    let (eta, d, base) = (warp.excess(), along.size(), frame.base);
    // The warp's denominator, over `base`: 1 where the body begins, 1 + eta where it ends.
    let from_start = frame.z - along.low * base;
    let w = base + from_start * (eta / d);
    let texels = frame.fit.map_size.map(f64::from);
    let floor = floor / warp.ratio();

    let limited;
    let casters = match prepared.caster_limit(frame, warp) {
        None => frame.casters(),
        Some(limit) => {
            limited = frame.casters().and_then(|casters| casters.within(frame.origin, limit));
            limited.as_ref()
        }
    };
    let above_middle = frame.height - measures.height.middle() * base;
    let (x, y, texel_extents, depths);
    match frame.fit.axes {
        Axes::View | Axes::Middle | Axes::VertexMean => {
            let offset = frame.x - centre * base;
            let (sides, depth) = frame.fractions::<1, SPOT>([offset], above_middle, w, casters);
            let side = sides[0].at_least(floor);
            x = fitted(offset, side, w);
            // As `fitted` to 0 and d/(1 + eta), without its difference of two rows of size (1 + eta)^2.
            y = from_start * ((2.0 + eta) / d) - base;
            texel_extents = [DVec2::new(side.size() / texels[0], 0.0), DVec2::new(0.0, d / (warp.ratio() * texels[1]))];
            depths = depth;
        }
        Axes::LightFixed => {
            // The warp projects about the middle of the body's bounding rectangle. Seen along the light that is
            // inside the body, so w >= 1 there: a line through it with the body on one side would miss a side of
            // the rectangle.
            let Rectangle { axes, rows, sides } = Rectangle::of::<SPOT, V, F>(frame);
            let middle = sides.map(Extent::middle);
            let in_plane = axes[0] * middle[0] + axes[1] * middle[1];
            let w_middle = 1.0 + (frame.space.z.dot(in_plane) - along.low) * (eta / d);
            let offsets = [rows[0] - middle[0] * base, rows[1] - middle[1] * base];
            let (sides, depth) = frame.fractions::<2, SPOT>(offsets, above_middle, w, casters);
            let sides = sides.map(|side| side.at_least(floor));
            x = fitted(offsets[0], sides[0], w);
            y = fitted(offsets[1], sides[1], w);
            texel_extents = [0, 1].map(|axis| askew(frame, axes[axis], w_middle) * (sides[axis].size() / texels[axis]));
            depths = depth;
        }
    }
    let depths = if SPOT {
        let depths = frame.with_spot_casters(depths, &measures, [x, y], above_middle, w);
        depths.at_least(LEAST_ASPECT * measures.height.high / warp.ratio())
    } else {
        depths.at_least(floor)
    };
    let z = (depths.high * w - above_middle) / depths.size();
    let range = depths.size();
    ShadowMap::new(frame.origin, [x, y, z, w], warp, frame.space, frame.light, texel_extents, range, frame.fit.map_size)
}
