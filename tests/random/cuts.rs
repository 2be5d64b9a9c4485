//! Strategies for boxes and for planes to cut bodies by: what they are depends on the body that there is by then.

use proptest::prelude::*;
use proptest::sample::{Index, select};
use shadow_warp::glam::DVec3;
use shadow_warp::{Bounds, ConvexBody, Plane};

use super::basic::{Mixture, direction, inside, jitter, log_between, mixture, shares};

/// Where a cut goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Kind {
    Corner,
    Anywhere,
    ThroughVertex,
    ThroughEdge,
    ThroughThreeVertices,
    AlongFace,
    AlongFaceJitter,
    Again,
    AgainJitter,
    Opposite,
}

impl Kind {
    #[rustfmt::skip]
    pub(crate) const ALL: [Self; 10] = [
        Self::Corner, Self::Anywhere, Self::ThroughVertex, Self::ThroughEdge, Self::ThroughThreeVertices,
        Self::AlongFace, Self::AlongFaceJitter, Self::Again, Self::AgainJitter, Self::Opposite,
    ];

    /// Whether it makes planes that are parallel to others but for a jitter.
    pub(crate) fn is_jittered(self) -> bool {
        matches!(self, Self::AlongFaceJitter | Self::AgainJitter)
    }
}

/// What chooses a plane, whatever the body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut {
    pub(crate) kind: Kind,
    direction: DVec3,
    inside: Mixture,
    picks: [Index; 3],
    tilts: [DVec3; 2],
}

impl Cut {
    /// The plane, and whether it has what its kind promises; `None` where the body is too degenerate for it. `last` is the
    /// plane of the cut before, `size` the greatest coordinate.
    pub(crate) fn plane<const V: usize, const F: usize>(
        &self,
        body: &ConvexBody<V, F>,
        last: Option<Plane>,
        size: f64,
    ) -> Option<(Plane, bool)> {
        let points = body.vertices();
        let [a, b, c] = self.picks.map(|pick| *pick.get(points));
        let faces: Vec<Plane> = body.faces().map(|face| face.plane()).collect();
        let face = *self.picks[0].get(&faces);
        let through = |normal: DVec3, p: DVec3| Plane::new(normal, p).ok();
        let on =
            |plane: &Plane| points.iter().filter(|p| plane.distance(**p).abs() <= 4.0 * f64::EPSILON * size).count();
        let tilted = |plane: Plane| {
            let point = plane.normal() * plane.offset() + self.tilts[1] * size;
            let tilted = through(plane.normal() + self.tilts[0], point)?;
            let close = (tilted.normal() - plane.normal()).length() < 1e-8;
            Some((tilted, tilted != plane && close))
        };
        let least = |count: usize| move |plane: Plane| (plane, on(&plane) >= count);
        match self.kind {
            Kind::Corner => {
                // Deep enough to cut something, not so deep as to use the body up.
                let [low, high] = body.bounds_along(self.direction)?;
                Some((through(self.direction, self.direction * (high - 0.1 * (high - low)))?, high > low))
            }
            Kind::Anywhere => through(self.direction, self.inside.of(points)).map(|plane| (plane, true)),
            Kind::ThroughVertex => through(self.direction, a).map(least(1)),
            Kind::ThroughEdge => {
                let edges: Vec<_> = body.edges().collect();
                let (a, b) = *self.picks[0].get(&edges);
                through((points[b] - points[a]).cross(self.direction) / size, points[a]).map(least(2))
            }
            Kind::ThroughThreeVertices => through((b - a).cross(c - a) / (size * size), a).map(least(3)),
            Kind::AlongFace => Some(least(3)(face)),
            Kind::AlongFaceJitter => tilted(face),
            Kind::Again => last.map(|last| (last, faces.contains(&last))),
            Kind::AgainJitter => tilted(last?),
            Kind::Opposite => through(-face.normal(), face.normal() * face.offset()).map(least(3)),
        }
    }
}

/// A cut of a kind.
pub(crate) fn cut(kind: impl Strategy<Value = Kind>) -> impl Strategy<Value = Cut> {
    let tilt = (jitter(), direction()).prop_map(|(size, direction)| size * direction);
    (kind, direction(), mixture(), any::<[Index; 3]>(), [tilt.clone(), tilt])
        .prop_map(|(kind, direction, inside, picks, tilts)| Cut { kind, direction, inside, picks, tilts })
}

/// Cuts of which a third are of one kind and a third take corners off, for faces with many corners.
pub(crate) fn cuts(kind: Kind) -> impl Strategy<Value = Vec<Cut>> {
    prop::collection::vec(cut(prop_oneof![Just(Kind::Corner), Just(kind), select(&Kind::ALL[..])]), 1..=12)
}

/// A box of any size, flat in one case of five, and an origin in it.
pub(crate) fn any_box() -> impl Strategy<Value = (Bounds, DVec3)> {
    let flat = prop::bool::weighted(0.07);
    (log_between(1e-6, 1e7), shares(), [flat, flat, flat], inside(1.0), shares()).prop_map(
        |(scale, less, flat, low, origin)| {
            let extent = (1.0 - 0.9 * less) * scale * DVec3::from(flat.map(|flat| if flat { 0.0 } else { 1.0 }));
            let low = low * extent;
            (Bounds::new(low, low + extent).expect("an ordered box"), low + extent * origin)
        },
    )
}
