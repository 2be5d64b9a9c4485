//! Strategies for numbers, points and directions. What is simplest comes first, so that failures
//! shrink to it.

use proptest::prelude::*;
use proptest::sample::{Index, select};
use shadow_warp::glam::DVec3;

/// From 0 to 1. Shrinks to a sixteenth, then to 0.
pub(crate) fn unit() -> impl Strategy<Value = f64> + Clone {
    (0.0..1.0, 0..16_u8).prop_map(|(rest, sixteenths)| (f64::from(sixteenths) + rest) / 16.0)
}

/// With an even spread of orders of magnitude; shrinks to 1, or to the end that is nearest to it.
pub(crate) fn log_between(low: f64, high: f64) -> impl Strategy<Value = f64> + Clone {
    assert!(0.0 < low && low < high);
    (low.ln()..high.ln()).prop_map(move |x| x.exp().clamp(low, high))
}

/// From -1 to 1; shrinks to 0.
pub(crate) fn signed() -> impl Strategy<Value = f64> + Clone {
    (unit(), any::<bool>()).prop_map(|(t, negative)| if negative { -t } else { t })
}

/// Next to nothing: from 1e-16 to 1e-9 in size, or 0.
pub(crate) fn jitter() -> impl Strategy<Value = f64> + Clone {
    (select(vec![0.0, 1.0, 1.0, -1.0]), log_between(1e-16, 1e-9)).prop_map(|(sign, size)| sign * size)
}

/// A share of each axis, from 0 to 1.
pub(crate) fn shares() -> impl Strategy<Value = DVec3> + Clone {
    [unit(), unit(), unit()].prop_map(DVec3::from)
}

/// A point of the box between two points.
pub(crate) fn within(low: DVec3, high: DVec3) -> impl Strategy<Value = DVec3> + Clone {
    shares().prop_map(move |t| (low + (high - low) * t).clamp(low, high))
}

/// A point with coordinates up to `size` in size; shrinks to the origin.
pub(crate) fn inside(size: f64) -> impl Strategy<Value = DVec3> + Clone {
    [signed(), signed(), signed()].prop_map(move |p| size * DVec3::from(p))
}

/// A signed axis of the world.
pub(crate) fn axis() -> impl Strategy<Value = DVec3> + Clone {
    select(vec![DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z])
}

/// A unit vector; all are equally likely. Shrinks to the x axis.
pub(crate) fn direction() -> impl Strategy<Value = DVec3> + Clone {
    // The area of a sphere is even in the coordinate along an axis.
    (unit(), any::<bool>(), unit()).prop_map(|(x, negative, turn)| {
        let x = if negative { x - 1.0 } else { 1.0 - x };
        let (sin, cos) = (turn * core::f64::consts::TAU).sin_cos();
        let across = (1.0 - x * x).max(0.0).sqrt();
        DVec3::new(x, across * cos, across * sin).normalize()
    })
}

/// What chooses a point of the hull of some points, whatever they turn out to be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mixture {
    turns: [(Index, f64); 4],
    on_an_edge: bool,
}

impl Mixture {
    /// The point: one in four lies on the way between two of the points.
    pub(crate) fn of(&self, points: &[DVec3]) -> DVec3 {
        let turns = &self.turns[..if self.on_an_edge { 2 } else { 4 }];
        let start = *self.turns[3].0.get(points);
        turns.iter().fold(start, |p, (index, t)| p.lerp(*index.get(points), *t))
    }
}

/// Points of a hull.
pub(crate) fn mixture() -> impl Strategy<Value = Mixture> + Clone {
    let turn = (any::<Index>(), unit());
    ([turn.clone(), turn.clone(), turn.clone(), turn], (0..4_u8).prop_map(|n| n == 3))
        .prop_map(|(turns, on_an_edge)| Mixture { turns, on_an_edge })
}
