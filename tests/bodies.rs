//! What a camera sees of a box, against brute force: closed, convex, and the right body, for all degenerate classes.
#![expect(clippy::unwrap_used, reason = "what is there by construction and is not must stop the test")]
#![expect(clippy::float_cmp, reason = "what is not computed must be the same to the bit")]

mod oracle;
mod random;

use oracle::{EPS, HalfSpaces, assert_closed, support};
use random::basic::{direction, shares};
use random::views::{Class, camera_and_box, corner};
use random::{Ratchet, check, prop};
use shadow_warp::glam::DVec3;
use shadow_warp::{Body, Bounds, Lens, Plane, View};

/// How far vertices may be from planes, in roundings of the greatest coordinate: some of the plane's own offset, some of
/// the product with its normal, and some of the vertex.
const ULPS: f64 = 4.0;

/// The volume's deviation, over the area of the box times a rounding of the greatest coordinate: as if each plane were
/// moved by that much.
const VOLUME_ULPS: f64 = 1.0;

/// How much the oracle's body is drawn in for a bound of the support from below, relative to the greatest coordinate. A
/// point that three planes give is a point of the body if it is inside the other planes by more than rounding; planes
/// that are parallel but for a jitter leave it few digits, and such a point must be further inside.
fn drawn_in(class: Class) -> f64 {
    if class == Class::CoplanarJitter { 1e-8 } else { 1e-12 }
}

/// What the tests have seen of all classes, and of one.
struct Seen {
    convexity: Ratchet,
    beyond: Ratchet,
    volume: Ratchet,
    realistic_volume: Ratchet,
    meaning: Ratchet,
}

#[derive(Debug, Default)]
struct Counts {
    cases: usize,
    hits: usize,
    empty: usize,
    greatest: (usize, usize),
}

type Input = ((View, Bounds), [DVec3; 8], [DVec3; 6]);

impl Seen {
    /// Checks one body against the oracle.
    fn check(&mut self, class: Class, ((view, bounds), directions, places): Input) -> Counts {
        let body = Body::visible(&view, &bounds);
        let oracle = HalfSpaces::of_view(&view, &bounds, body.origin());
        let size = oracle.size();
        let ulp = EPS * size;
        self.convexity.note(assert_closed(&body).greatest(), ULPS * ulp, class);

        // Nothing too much: no vertex is beyond a plane.
        let beyond = body.vertices().iter().map(|p| oracle.beyond(*p)).fold(0.0, f64::max);
        self.beyond.note(beyond, ULPS * ulp, class);

        // Nothing too little: the volume, and points of a smaller body.
        let error = (body.volume() - oracle.volume()).abs();
        self.volume.note(error, VOLUME_ULPS * ulp * oracle.box_area(), class);
        let inner = oracle.shrunk(drawn_in(class) * size).vertices(0.5 * drawn_in(class) * size);
        for direction in directions {
            let (Some(least), Some([low, high])) = (support(&inner, direction), body.bounds_along(direction)) else {
                assert!(inner.is_empty(), "empty, but the oracle has points");
                continue;
            };
            assert!(high >= least, "{class:?}: support {high:e} is less than {least:e}");
            let furthest = body.support(direction).unwrap();
            assert!(direction.dot(furthest) == high && low <= high);
        }
        if class == Class::Realistic {
            self.realistic_volume.note(error, 2e-15 * oracle.box_volume(), class);
        }
        self.check_meaning(&view, &bounds, &body, &places);
        Counts {
            cases: 1,
            hits: usize::from(is_hit(class, &view, &bounds)),
            empty: usize::from(body.is_empty()),
            greatest: (body.vertices().len(), body.faces().count()),
        }
    }

    /// Points of the box are in the body where the camera sees them, by the meaning of its pieces: no plane is used.
    fn check_meaning(&mut self, view: &View, bounds: &Bounds, body: &Body, places: &[DVec3]) {
        let (low, high) = (bounds.min(), bounds.max());
        let reach = (high - view.eye()).abs().max((low - view.eye()).abs()).max_element();
        let points = places.iter().map(|share| (low + (high - low) * *share).clamp(low, high));
        for p in points.chain((0..8).map(|v| corner(low, high, v))) {
            let q = p - view.eye();
            let depth = q.dot(view.forward());
            let (sides, along, slopes) = match view.lens() {
                Lens::Perspective(sides) => (sides, depth, 1.0),
                Lens::Orthographic(sides) => (sides, 1.0, 0.0),
            };
            let (x, y) = (q.dot(view.right()), q.dot(view.up()));
            // Gaps are longer than distances, by the slope of the side.
            let gap = |gap: f64, side: f64| gap / (1.0 + (slopes * side) * (slopes * side)).sqrt();
            let gaps = [
                gap(x - sides.left * along, sides.left),
                gap(sides.right * along - x, sides.right),
                gap(y - sides.bottom * along, sides.bottom),
                gap(sides.top * along - y, sides.top),
                depth - view.near(),
                view.far() - depth,
            ];
            let inside = gaps.into_iter().fold(f64::INFINITY, f64::min);
            // A plane knows its place to a rounding of the distance from the eye, and of what it is compared with.
            let wrong = if body.contains(p - body.origin()) { -inside } else { inside };
            self.meaning.note(wrong, 4.0 * EPS * reach, (p, inside));
        }
    }
}

/// Whether a case has what its class promises, measured on the camera and the box alone.
fn is_hit(class: Class, view: &View, bounds: &Bounds) -> bool {
    let (low, high) = (bounds.min() - view.eye(), bounds.max() - view.eye());
    let size = low.abs().max(high.abs()).max_element();
    let extent = high - low;
    let on = |plane: &Plane, v: usize, tolerance: f64| plane.distance(corner(low, high, v)).abs() <= tolerance * size;
    let corners_on = |plane: &Plane, tolerance: f64| (0..8).filter(|&v| on(plane, v, tolerance)).count();
    let most_corners = |tolerance| view.planes().iter().map(|plane| corners_on(plane, tolerance)).max().unwrap();
    let touching = |p: DVec3| [0, 1, 2].iter().filter(|&&a| p[a] == low[a] || p[a] == high[a]).count();
    let inside = low.cmple(DVec3::ZERO).all() && high.cmpge(DVec3::ZERO).all();
    let flat = [0, 1, 2].iter().filter(|&&axis| extent[axis] == 0.0).count();
    let borders = |plane: &Plane| (0..8).all(|v| plane.distance(corner(low, high, v)) >= 0.0);
    let bordering = view.planes().iter().filter(|plane| borders(plane)).count();
    let (Lens::Perspective(s) | Lens::Orthographic(s)) = view.lens();
    match class {
        Class::Realistic => flat == 0 && view.is_perspective(),
        Class::PlaneThroughVertex => most_corners(4.0 * EPS) == 1,
        Class::PlaneThroughEdge => most_corners(4.0 * EPS) >= 2,
        Class::Coplanar => most_corners(0.0) >= 4,
        Class::CoplanarJitter => most_corners(1e-8) >= 4 && most_corners(0.0) < 4,
        Class::FlatBox => flat == 1,
        Class::LineBox => flat == 2,
        Class::PointBox => flat == 3,
        Class::TouchVertex => bordering == 3,
        Class::TouchEdge => bordering == 2,
        Class::TouchFace => bordering == 1,
        Class::EyeInside => inside && touching(DVec3::ZERO) == 0,
        Class::EyeOnFace => inside && touching(DVec3::ZERO) == 1,
        Class::EyeOnCorner => inside && touching(DVec3::ZERO) == 3,
        Class::NearOnFace => view.planes().iter().any(|p| p.normal() == -view.forward() && corners_on(p, 0.0) == 4),
        Class::FarInfinite => view.far() == f64::INFINITY,
        Class::FarRatio => (view.far() / view.near() - 1e7).abs() < 1.0,
        Class::NarrowField => s.top < 1e-5,
        Class::WideField => s.top > 1e3,
        Class::OffCentre => s.left != -s.right && s.bottom != -s.top,
        Class::Orthographic => !view.is_perspective(),
        Class::Mirrored => view.right().cross(view.forward()).dot(view.up()) < -0.5,
        Class::WorldOffset => bounds.max().abs().max_element() > 9e6,
        Class::Tiny => extent.max_element() < 2e-6,
        Class::Huge => extent.max_element() > 5e11,
        Class::Outside => (0..8).all(|v| corner(low, high, v).dot(view.forward()) < view.near()),
    }
}

#[test]
fn what_a_camera_sees_is_what_brute_force_finds() {
    let mut seen = Seen {
        convexity: Ratchet::new("off a convex body, in roundings"),
        beyond: Ratchet::new("vertices beyond a plane, in roundings"),
        volume: Ratchet::new("volume, in roundings"),
        realistic_volume: Ratchet::new("volume of realistic bodies"),
        meaning: Ratchet::new("what is in view, in roundings"),
    };
    for class in Class::ALL {
        let mut all = Counts::default();
        let cases = if class == Class::Realistic { 2000 } else { 400 };
        let input = (camera_and_box(class), prop::array::uniform8(direction()), prop::array::uniform6(shares()));
        check(&format!("bodies/{class:?}"), cases, input, |input| {
            let one = seen.check(class, input);
            all = Counts {
                cases: all.cases + one.cases,
                hits: all.hits + one.hits,
                empty: all.empty + one.empty,
                greatest: (all.greatest.0.max(one.greatest.0), all.greatest.1.max(one.greatest.1)),
            };
        });
        println!("{class:?}: {all:?}");
        let Counts { cases, hits, empty, greatest } = all;
        assert!(2 * hits >= cases, "{class:?} was hit {hits} times of {cases} only");
        match class {
            Class::Outside => assert_eq!(empty, cases),
            _ => assert!(5 * empty < 4 * cases, "{class:?}: {empty} of {cases} are empty"),
        }
        assert!(class != Class::Realistic || greatest.0 >= 16, "no case is rich enough: {greatest:?}");
    }
}
