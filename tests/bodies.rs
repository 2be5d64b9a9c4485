//! What a camera sees of a box, against brute force: closed, convex, and the right body, for all degenerate classes.
//!
//! `SHADOW_WARP_CASES=100 cargo test --release --test bodies` runs 100 times as many cases.
#![expect(clippy::unwrap_used, reason = "a generator that makes invalid input must stop the test")]
#![expect(clippy::float_cmp, reason = "what is not computed must be the same to the bit")]

mod generate;
mod oracle;

use generate::{Class, Rng, camera_and_box, cases, corner};
use oracle::{EPS, HalfSpaces, assert_closed, support};
use shadow_warp::glam::DVec3;
use shadow_warp::{Body, Bounds, Lens, Plane, View};

/// Deviations of vertices from planes, in roundings of the greatest coordinate. Measured: at most 1.9 in 134,000 cases.
const ULPS: f64 = 8.0;

/// The volume's deviation. Planes off by a rounding of the greatest coordinate change the volume by that times the area
/// of the box. Measured: at most 0.25.
const VOLUME_ULPS: f64 = 16.0;

/// How much the oracle's body is drawn in for a bound of the support from below, relative to the greatest coordinate.
/// Where planes are nearly parallel a point has no digits, but half-spaces still have: a body drawn in a little lies
/// inside.
const SHRINK: f64 = 1e-8;

#[derive(Default)]
struct Seen {
    hits: usize,
    empty: usize,
    greatest_v: usize,
    greatest_f: usize,
    deviation: f64,
    volume: f64,
    relative_volume: f64,
    support: f64,
}

/// Checks one body against the oracle and notes the greatest deviations.
fn check(seen: &mut Seen, rng: &mut Rng, class: Class, view: &View, bounds: &Bounds) {
    let body = Body::visible(view, bounds);
    let oracle = HalfSpaces::of_view(view, bounds, body.origin());
    let size = oracle.size();
    let ulp = EPS * size;
    let deviation = assert_closed(&body).greatest();
    assert!(deviation <= ULPS * ulp, "not convex: {deviation:e} of {size:e}");
    assert!(body.vertices().len() <= 20 && body.faces().count() <= 12 && body.edges().count() <= 30);

    // Nothing too much: no vertex is beyond a plane.
    for p in body.vertices() {
        let beyond = oracle.beyond(*p);
        assert!(beyond <= ULPS * ulp, "a vertex {beyond:e} beyond, of {size:e}");
        seen.deviation = seen.deviation.max(beyond / ulp);
    }

    // Nothing too little: the volume, and points of a smaller body.
    let expected = oracle.volume();
    let error = (body.volume() - expected).abs();
    let unit = ulp * oracle.box_area();
    assert!(error <= VOLUME_ULPS * unit, "volume {} is not {expected}", body.volume());
    if unit > 0.0 {
        seen.volume = seen.volume.max(error / unit);
    }
    if oracle.box_volume() > 0.0 {
        seen.relative_volume = seen.relative_volume.max(error / oracle.box_volume());
    }
    let inner = oracle.shrunk(SHRINK * size).vertices(0.1 * SHRINK * size);
    for _ in 0..50 {
        let direction = rng.direction();
        let (Some(least), Some([low, high])) = (support(&inner, direction), body.bounds_along(direction)) else {
            assert!(inner.is_empty(), "empty, but the oracle has points");
            continue;
        };
        assert!(high >= least - ULPS * ulp, "support {high:e} is less than {least:e}");
        let furthest = body.support(direction).unwrap();
        assert!(direction.dot(furthest) == high && low <= high);
    }

    if !body.is_empty() && class == Class::Realistic {
        // Well-conditioned: the support itself.
        let exact = oracle.vertices(1e-12 * size);
        for _ in 0..50 {
            let direction = rng.direction();
            let error = (body.bounds_along(direction).unwrap()[1] - support(&exact, direction).unwrap()).abs();
            seen.support = seen.support.max(error / size);
        }
    }

    check_meaning(rng, view, bounds, &body);
    seen.empty += usize::from(body.is_empty());
    seen.greatest_v = seen.greatest_v.max(body.vertices().len());
    seen.greatest_f = seen.greatest_f.max(body.faces().count());
}

/// Points of the box are in the body where the camera sees them, by the meaning of its pieces: no plane is used.
fn check_meaning(rng: &mut Rng, view: &View, bounds: &Bounds, body: &Body) {
    let reach = (bounds.max() - view.eye()).abs().max((bounds.min() - view.eye()).abs()).max_element();
    // The planes know their place to a rounding of the distance from the eye.
    let tolerance = 16.0 * EPS * reach;
    for _ in 0..10 {
        let p = rng.within(bounds.min(), bounds.max());
        let q = p - view.eye();
        let depth = q.dot(view.forward());
        let (sides, along) = match view.lens() {
            Lens::Perspective(sides) => (sides, depth),
            Lens::Orthographic(sides) => (sides, 1.0),
        };
        let (x, y) = (q.dot(view.right()), q.dot(view.up()));
        let gaps = [
            x - sides.left * along,
            sides.right * along - x,
            y - sides.bottom * along,
            sides.top * along - y,
            depth - view.near(),
            view.far() - depth,
        ];
        // Gaps are longer than distances, by up to the greatest tangent.
        let steepest =
            if view.is_perspective() { [sides.left, sides.right, sides.bottom, sides.top] } else { [0.0; 4] };
        let slant = 1.0 + steepest.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
        let local = p - body.origin();
        if least > slant * tolerance {
            let inside = body.faces().all(|face| face.plane().distance(local) <= tolerance);
            assert!(!body.is_empty() && inside, "a visible point is not in the body: {least:e}");
        } else if least < -slant * tolerance {
            assert!(!body.contains(local), "a point out of sight is in the body: {least:e}");
        }
    }
}

/// Whether a case has what its class promises, measured on the camera and the box alone.
fn hits(class: Class, view: &View, bounds: &Bounds) -> bool {
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
    let sides = view.lens();
    let (Lens::Perspective(s) | Lens::Orthographic(s)) = sides;
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
        Class::Outside => Body::visible(view, bounds).is_empty(),
    }
}

fn run(class: Class, count: usize) -> Seen {
    let mut seen = Seen::default();
    for case in 0..count {
        let mut rng = Rng::new((class as u64) << 40 | case as u64);
        let (view, bounds) = camera_and_box(&mut rng, class);
        seen.hits += usize::from(hits(class, &view, &bounds));
        check(&mut seen, &mut rng, class, &view, &bounds);
    }
    println!(
        "{class:?}: {count}, hit {}, empty {}, V {}, F {}, off {:.2} ulp, volume {:.2} ulp {:.1e}, support {:.1e}",
        seen.hits,
        seen.empty,
        seen.greatest_v,
        seen.greatest_f,
        seen.deviation,
        seen.volume,
        seen.relative_volume,
        seen.support
    );
    seen
}

#[test]
fn what_a_camera_sees_is_what_brute_force_finds() {
    let count = cases(3000);
    let seen = run(Class::Realistic, count);
    assert!(seen.hits == count && seen.empty < count / 5, "most cameras must see the box");
    assert!(seen.greatest_v >= 16, "no case is rich enough: {}", seen.greatest_v);
    assert!(seen.relative_volume < 1e-13 && seen.support < 1e-9);
}

#[test]
fn degenerate_classes_are_closed_and_exact() {
    let count = cases(400);
    for class in Class::ALL {
        let seen = run(class, count);
        assert!(seen.hits >= count / 2, "{class:?} was hit {} times of {count} only", seen.hits);
        match class {
            Class::Outside => assert_eq!(seen.empty, count),
            _ => assert!(seen.empty < count * 4 / 5, "{class:?}: {} of {count} are empty", seen.empty),
        }
    }
}
