//! Cuts of a convex body, one after the other, against brute force: through vertices and edges, along faces, and again.
//!
//! `SHADOW_WARP_CASES=100 cargo test --release --test cuts` runs 100 times as many cases.
#![expect(clippy::unwrap_used, reason = "a generator that makes invalid input must stop the test")]
#![expect(clippy::float_cmp, reason = "what is not computed must be the same to the bit")]

mod generate;
mod oracle;

use std::collections::HashMap;

use generate::{Rng, cases, corner};
use oracle::{EPS, HalfSpaces, assert_closed, support};
use shadow_warp::glam::DVec3;
use shadow_warp::{Body, Bounds, ConvexBody, Error, Plane, View};

/// As in the test of what a camera sees: roundings of the greatest coordinate. Measured: at most 2.5 in 600,000 cuts.
const ULPS: f64 = 8.0;
/// Of the volume, in the same times the area of the box. Measured: at most 1.0.
const VOLUME_ULPS: f64 = 16.0;
/// The same after a cut along another one but for a jitter: the oracle's, for three nearly parallel planes meet where
/// no digit is left. Measured: at most 27.
const JITTERED_VOLUME_ULPS: f64 = 256.0;
/// See the test of what a camera sees.
const SHRINK: f64 = 1e-8;

type Roomy = ConvexBody<64, 34>;

/// Where a cut goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Kind {
    Anywhere,
    ThroughVertex,
    ThroughEdge,
    ThroughThreeVertices,
    AlongFace,
    AlongFaceJitter,
    Again,
    AgainJitter,
    Opposite,
    Corner,
}

#[rustfmt::skip]
const KINDS: [Kind; 10] = [
    Kind::Anywhere, Kind::ThroughVertex, Kind::ThroughEdge, Kind::ThroughThreeVertices, Kind::AlongFace,
    Kind::AlongFaceJitter, Kind::Again, Kind::AgainJitter, Kind::Opposite, Kind::Corner,
];

/// Returns a plane of a kind, and whether it has what the kind promises; `None` where the body is too degenerate for
/// it.
fn plane_of(kind: Kind, rng: &mut Rng, body: &Roomy, last: Option<Plane>, size: f64) -> Option<(Plane, bool)> {
    let points = body.vertices();
    let through = |normal: DVec3, p: DVec3| Plane::new(normal, p).ok();
    let on = |plane: &Plane| points.iter().filter(|p| plane.distance(**p).abs() <= 4.0 * EPS * size).count();
    let faces: Vec<Plane> = body.faces().map(|face| face.plane()).collect();
    let tilted = |rng: &mut Rng, plane: Plane| {
        let normal = plane.normal() + rng.jitter() * rng.direction();
        through(normal, plane.normal() * plane.offset() + rng.jitter() * size * rng.direction())
    };
    let close = |a: &Plane, b: &Plane| (a.normal() - b.normal()).length() < 1e-8;
    Some(match kind {
        Kind::Anywhere => (through(rng.direction(), rng.mixture(points))?, true),
        Kind::ThroughVertex => {
            let plane = through(rng.direction(), rng.pick(points))?;
            (plane, on(&plane) >= 1)
        }
        Kind::ThroughEdge => {
            let edges: Vec<_> = body.edges().collect();
            let (a, b) = rng.pick(&edges);
            let plane = through((points[b] - points[a]).cross(rng.direction()) / size, points[a])?;
            (plane, on(&plane) >= 2)
        }
        Kind::ThroughThreeVertices => {
            let [a, b, c] = [rng.pick(points), rng.pick(points), rng.pick(points)];
            let plane = through((b - a).cross(c - a) / (size * size), a)?;
            (plane, on(&plane) >= 3)
        }
        Kind::AlongFace => {
            let plane = rng.pick(&faces);
            (plane, on(&plane) >= 3)
        }
        Kind::AlongFaceJitter => {
            let face = rng.pick(&faces);
            let plane = tilted(rng, face)?;
            (plane, plane != face && close(&plane, &face))
        }
        Kind::Again => (last?, faces.contains(&last?)),
        Kind::AgainJitter => {
            let plane = tilted(rng, last?)?;
            (plane, plane != last? && close(&plane, &last?))
        }
        Kind::Opposite => {
            let face = rng.pick(&faces);
            let plane = through(-face.normal(), face.normal() * face.offset())?;
            (plane, on(&plane) >= 3)
        }
        Kind::Corner => {
            // Deep enough to cut something, not so deep as to use the body up.
            let normal = rng.direction();
            let [low, high] = body.bounds_along(normal)?;
            (through(normal, normal * (high - 0.1 * (high - low)))?, high > low)
        }
    })
}

fn random_box(rng: &mut Rng) -> (Bounds, DVec3) {
    let scale = rng.decades(-6..7);
    let mut extent = rng.within(DVec3::splat(0.1), DVec3::ONE) * scale;
    if rng.chance(0.15) {
        extent[rng.below(3)] = 0.0;
    }
    if rng.chance(0.05) {
        extent[rng.below(3)] = 0.0;
    }
    let low = rng.within(-extent, extent);
    let origin = low + extent * rng.range(0.0..1.0);
    (Bounds::new(low, low + extent).unwrap(), origin)
}

#[test]
fn sequences_of_cuts_stay_closed_and_exact() {
    let count = cases(600);
    let mut hit: HashMap<Kind, usize> = HashMap::new();
    let (mut done, mut emptied, mut flat, mut greatest) = (0, 0, 0, (0, 0));
    let (mut deviation, mut volumes) = (0.0_f64, [0.0_f64; 2]);
    for case in 0..count {
        let mut rng = Rng::new(1 << 32 | case as u64);
        let (bounds, origin) = random_box(&mut rng);
        let mut body = Roomy::from_box(&bounds, origin).unwrap();
        let mut oracle = HalfSpaces::of_box(&bounds, origin);
        let size = oracle.size();
        let (ulp, unit) = (EPS * size, EPS * size * oracle.box_area());
        let (mut last, mut jittered) = (None, false);
        for step in 0..12 {
            // Some sequences shave corners off first, for faces with many corners.
            let kind = if case % 3 == 0 && step < 8 { Kind::Corner } else { rng.pick(&KINDS) };
            let Some((plane, hits)) = plane_of(kind, &mut rng, &body, last, size) else { continue };
            body.cut(&plane).unwrap();
            oracle.add(&plane);
            last = Some(plane);
            done += 1;
            *hit.entry(kind).or_default() += usize::from(hits);

            let mut closed = assert_closed(&body);
            if body.volume() <= VOLUME_ULPS * unit {
                // Both sides of a flat body lie in one plane, where rounding may turn a sliver of one over.
                closed.reflex = 0.0;
                flat += 1;
            }
            assert!(closed.greatest() <= ULPS * ulp, "{kind:?}: not convex: {closed:?} of {size:e}");
            let beyond = body.vertices().iter().map(|p| oracle.beyond(*p)).fold(0.0, f64::max);
            assert!(beyond <= ULPS * ulp, "{kind:?}: a vertex {beyond:e} beyond, of {size:e}");
            let error = (body.volume() - oracle.volume()).abs();
            jittered |= matches!(kind, Kind::AlongFaceJitter | Kind::AgainJitter);
            let ulps = if jittered { JITTERED_VOLUME_ULPS } else { VOLUME_ULPS };
            assert!(error <= ulps * unit, "{kind:?}: volume {} is not {}", body.volume(), oracle.volume());
            deviation = deviation.max(closed.greatest().max(beyond) / ulp);
            let volume = &mut volumes[usize::from(jittered)];
            *volume = volume.max(if unit > 0.0 { error / unit } else { 0.0 });
            greatest = greatest.max((body.vertices().len(), body.faces().count()));
            if body.is_empty() {
                emptied += 1;
                break;
            }
        }
        let inner = oracle.shrunk(SHRINK * size).vertices(0.1 * SHRINK * size);
        for _ in 0..20 {
            let direction = rng.direction();
            let Some(least) = support(&inner, direction) else { break };
            let high = body.bounds_along(direction).unwrap()[1];
            assert!(high >= least - ULPS * ulp, "support {high:e} is less than {least:e}");
        }
    }
    println!(
        "{done} cuts, {emptied} emptied, {flat} flat, {greatest:?}, off {deviation:.2} ulp, volume {volumes:.2?} ulp, {hit:?}"
    );
    for kind in KINDS {
        let hits = hit.get(&kind).copied().unwrap_or(0);
        assert!(hits >= count / 8, "{kind:?} was hit {hits} times in {done} cuts only");
    }
    assert!(emptied > count / 20 && flat > count / 2 && flat < done / 2, "{emptied} emptied, {flat} of {done} flat");
    assert!(greatest.0 >= 24);
}

/// A face of many corners, and planes that differ from it by less than their rounding: its corners' signs are noise,
/// and the kept and removed ones do not hang together by themselves.
#[test]
fn a_cut_by_noise_stays_closed() {
    let (mut cut, mut unchanged) = (0, 0);
    for case in 0..cases(300) {
        let mut rng = Rng::new(2 << 32 | case as u64);
        let bounds = Bounds::new(DVec3::NEG_ONE, DVec3::ONE).unwrap();
        let mut body = Roomy::from_box(&bounds, DVec3::ZERO).unwrap();
        let base = rng.direction();
        let across = base.any_orthonormal_pair();
        for step in 0..12 {
            // Round about the base's normal: a prism, then its base.
            let rim = (across.0 * rng.range(-1.0..1.0) + across.1 * rng.range(-1.0..1.0)).normalize();
            let normal = if step == 11 { base } else { rim + 0.2 * base * rng.range(-1.0..1.0) };
            body.cut(&Plane::new(normal, 0.7 * normal.normalize()).unwrap()).unwrap();
        }
        let noise = [0.0, 1e-17, 1e-16, 1e-15];
        for _ in 0..5 {
            let before = body.vertices().to_vec();
            let normal = base + rng.pick(&noise) * rng.direction();
            let plane = Plane::new(normal, base * (0.7 + rng.pick(&noise) * rng.sign())).unwrap();
            let volume = body.volume();
            body.cut(&plane).unwrap();
            let deviation = assert_closed(&body);
            assert!(deviation.greatest() <= ULPS * EPS, "not convex: {deviation:?}");
            assert!((body.volume() - volume).abs() <= 64.0 * EPS, "noise took {} away", volume - body.volume());
            if before == body.vertices() { unchanged += 1 } else { cut += 1 }
        }
    }
    println!("{cut} cut, {unchanged} unchanged");
    assert!(cut > 100 && unchanged > 10, "{cut} cuts, {unchanged} without effect");
}

/// A flat body, and planes square to it through two of its corners: of each corner's copies rounding removes one and
/// keeps the other, apart from what really lies beyond. The greater part must go, not the noise.
#[test]
fn a_flat_body_is_cut_through_its_corners() {
    let (mut cut, mut worst) = (0, 0.0_f64);
    for case in 0..cases(1000) {
        let mut rng = Rng::new(4 << 32 | case as u64);
        let mut body = Roomy::from_box(&cube(), DVec3::ZERO).unwrap();
        let mut oracle = HalfSpaces::of_box(&cube(), DVec3::ZERO);
        let (normal, middle) = (rng.direction(), 0.3 * rng.direction());
        body.cut(&Plane::new(normal, middle).unwrap()).unwrap();
        body.cut(&Plane::new(-normal, middle).unwrap()).unwrap();
        for _ in 0..8 {
            if body.is_empty() {
                break;
            }
            let (a, b) = (rng.pick(body.vertices()), rng.pick(body.vertices()));
            let Ok(plane) = Plane::new(normal.cross(b - a), a) else { continue };
            if b.distance(a) < 0.1 {
                continue;
            }
            body.cut(&plane).unwrap();
            oracle.add(&plane);
            assert_closed(&body);
            let beyond = body.vertices().iter().map(|p| oracle.beyond(*p)).fold(0.0, f64::max);
            assert!(beyond <= ULPS * EPS, "a vertex {beyond:e} beyond");
            worst = worst.max(beyond / EPS);
            cut += 1;
        }
    }
    println!("{cut} cuts, {worst:.2} ulp");
    assert!(cut > 1000);
}

/// A plane that cuts off corner `v` of the box from -1 to 1, and nothing else.
fn off_corner(v: usize) -> Plane {
    let outward = corner(DVec3::NEG_ONE, DVec3::ONE, v);
    Plane::new(outward, 0.8 * outward).unwrap()
}

fn cube() -> Bounds {
    Bounds::new(DVec3::NEG_ONE, DVec3::ONE).unwrap()
}

/// The whole public state of a body.
fn state<const V: usize, const F: usize>(body: &ConvexBody<V, F>) -> impl PartialEq + std::fmt::Debug + use<V, F> {
    let faces: Vec<(Plane, Vec<usize>)> = body.faces().map(|face| (face.plane(), face.corners().collect())).collect();
    (body.origin(), body.vertices().to_vec(), body.edges().collect::<Vec<_>>(), faces)
}

#[test]
fn six_cuts_of_a_box_reach_the_capacity_and_fit() {
    let mut body = Body::from_box(&cube(), DVec3::ZERO).unwrap();
    for v in 0..6 {
        body.cut(&off_corner(v)).unwrap();
        assert_closed(&body);
    }
    assert_eq!((body.vertices().len(), body.faces().count(), body.edges().count()), (20, 12, 30));
    // Each corner is a sixth of a cube with three times the side 0.6.
    let side = 0.6_f64;
    assert!((body.volume() - (8.0 - 6.0 * side * side * side / 6.0)).abs() < 1e-14);

    let before = state(&body);
    assert_eq!(body.cut(&off_corner(6)), Err(Error::BodyFull));
    assert_eq!(state(&body), before);
}

#[test]
fn cameras_reach_the_capacity() {
    let count = cases(300);
    let mut reached = 0;
    for case in 0..count {
        let mut rng = Rng::new(3 << 32 | case as u64);
        // Two cubes about one centre: mostly, every face of both is left.
        let (forward, up) = (rng.direction(), rng.direction());
        let sides = shadow_warp::Sides::centred(2.0, 2.0);
        let Ok(view) = View::orthographic(-forward, forward, up, sides, 0.0..2.0) else { continue };
        let body = Body::visible(&view, &cube());
        assert_closed(&body);
        let oracle = HalfSpaces::of_view(&view, &cube(), body.origin());
        assert!((body.volume() - oracle.volume()).abs() < 1e-13);
        reached += usize::from((body.vertices().len(), body.faces().count()) == (20, 12));
    }
    println!("{reached} of {count} at the capacity");
    assert!(reached > count / 20, "{reached} of {count} reach 20 vertices");
}

#[test]
fn a_full_table_is_an_error_and_changes_nothing() {
    let mut no_face = ConvexBody::<64, 6>::from_box(&cube(), DVec3::ZERO).unwrap();
    let before = state(&no_face);
    assert_eq!(no_face.cut(&off_corner(3)), Err(Error::BodyFull));
    assert_eq!(state(&no_face), before);

    for v in 0..8 {
        let mut no_vertex = ConvexBody::<9, 34>::from_box(&cube(), DVec3::ZERO).unwrap();
        let before = state(&no_vertex);
        assert_eq!(no_vertex.cut(&off_corner(v)), Err(Error::BodyFull));
        assert_eq!(state(&no_vertex), before);
        assert_closed(&no_vertex);
        // It is not spoiled either: what fits still works.
        no_vertex.cut(&Plane::new(DVec3::new(1.0, 0.1, 0.0), DVec3::ZERO).unwrap()).unwrap();
        assert_closed(&no_vertex);
        assert!((no_vertex.volume() - 4.0).abs() < 1e-14);
    }
}

#[test]
fn faces_that_are_cut_away_make_room() {
    // Room for the face that goes and the one that comes, beside those of the box, and for no more vertices.
    let mut body = ConvexBody::<8, 8>::from_box(&cube(), DVec3::ZERO).unwrap();
    let normal = DVec3::new(1.0, 1.0 / 16.0, -1.0 / 16.0);
    for step in 0..20 {
        let x = 0.75 - 0.05 * f64::from(step);
        body.cut(&Plane::new(normal, DVec3::X * x).unwrap()).unwrap();
        let deviation = assert_closed(&body).greatest();
        assert!(deviation <= ULPS * EPS);
        assert!((body.volume() - 4.0 * (1.0 + x)).abs() < 1e-13, "{} at {x}", body.volume());
    }
}

#[test]
fn planes_on_the_border_keep_and_planes_beyond_empty() {
    for axis in DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]) {
        let mut body = Roomy::from_box(&cube(), DVec3::ZERO).unwrap();
        let before = state(&body);
        body.cut(&Plane::new(axis, axis).unwrap()).unwrap();
        assert_eq!(state(&body), before, "a plane on a face cuts nothing");
        // From the other side, only that face is left.
        body.cut(&Plane::new(-axis, axis).unwrap()).unwrap();
        assert_closed(&body);
        assert!(!body.is_empty() && body.volume() == 0.0);
        assert!(body.vertices().iter().all(|p| p.dot(axis) == 1.0));
        body.cut(&Plane::new(-axis, 1.5 * axis).unwrap()).unwrap();
        assert_closed(&body);
        assert!(body.is_empty() && body.bounds_along(axis).is_none() && body.support(axis).is_none());
        // Nothing stays nothing.
        body.cut(&Plane::new(axis, axis).unwrap()).unwrap();
        assert!(body.is_empty() && body.volume() == 0.0);
    }
}
