//! Strategies for numbers, points and directions. What is simplest comes first, so that failures shrink to it.

use proptest::prelude::*;
use proptest::sample::select;
use shadow_warp::glam::DVec3;

/// From 0 to below 1.
pub(crate) fn unit() -> impl Strategy<Value = f64> + Clone {
    0.0..1.0
}

/// With an even spread of orders of magnitude; shrinks to 1, or to the end that is nearest to it.
pub(crate) fn log_between(low: f64, high: f64) -> impl Strategy<Value = f64> + Clone {
    assert!(0.0 < low && low < high);
    (low.ln()..high.ln()).prop_map(move |x| x.exp().clamp(low, high))
}

/// A point of the box between two points.
pub(crate) fn within(low: DVec3, high: DVec3) -> impl Strategy<Value = DVec3> + Clone {
    [unit(), unit(), unit()].prop_map(move |t| (low + (high - low) * DVec3::from(t)).clamp(low, high))
}

/// A point with coordinates up to `size` in size; shrinks to the origin.
pub(crate) fn inside(size: f64) -> impl Strategy<Value = DVec3> + Clone {
    let coordinate = (unit(), any::<bool>()).prop_map(move |(t, negative)| if negative { -size * t } else { size * t });
    [coordinate.clone(), coordinate.clone(), coordinate].prop_map(DVec3::from)
}

/// A signed axis of the world.
pub(crate) fn axis() -> impl Strategy<Value = DVec3> + Clone {
    select(vec![DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z])
}

/// A unit vector; all are equally likely. Shrinks to the x axis.
pub(crate) fn direction() -> impl Strategy<Value = DVec3> + Clone {
    // The area of a sphere is even in the coordinate along an axis.
    (unit(), any::<bool>(), 0.0..core::f64::consts::TAU).prop_map(|(x, negative, turn)| {
        let x = if negative { x - 1.0 } else { 1.0 - x };
        let across = (1.0 - x * x).max(0.0).sqrt();
        DVec3::new(x, across * turn.cos(), across * turn.sin()).normalize()
    })
}

/// What chooses a point of the hull of some points, whatever they turn out to be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mixture {
    turns: [(prop::sample::Index, f64); 4],
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
    let turn = (any::<prop::sample::Index>(), unit());
    ([turn.clone(), turn.clone(), turn.clone(), turn], (0..4_u8).prop_map(|n| n == 0))
        .prop_map(|(turns, on_an_edge)| Mixture { turns, on_an_edge })
}
