//! Cuts of a convex body, one after the other, against brute force: through vertices and edges, along faces, and again.
#![expect(clippy::unwrap_used, reason = "what is there by construction and is not must stop the test")]
#![expect(clippy::float_cmp, reason = "what is not computed must be the same to the bit")]

mod oracle;
mod random;

use approx::assert_ulps_eq;
use oracle::{EPS, HalfSpaces, assert_closed, support};
use random::basic::{direction, signed};
use random::cuts::{Kind, any_box, cuts};
use random::views::corner;
use random::{Ratchet, any, check, prop};
use shadow_warp::glam::DVec3;
use shadow_warp::{Body, Bounds, ConvexBody, Error, Plane, View};

/// As in the test of what a camera sees, roundings of the greatest coordinate; a few more after many cuts.
const ULPS: f64 = 6.0;
/// Of the volume, in the same times the area of the box.
const VOLUME_ULPS: f64 = 2.0;

type Roomy = ConvexBody<64, 34>;

#[test]
fn sequences_of_cuts_stay_closed_and_exact() {
    let mut convexity = Ratchet::new("off a convex body, in roundings");
    let mut beyond = Ratchet::new("vertices beyond a plane, in roundings");
    let mut volume = Ratchet::new("volume, in roundings");
    let (mut done, mut emptied, mut flat, mut greatest) = (0, 0, 0, (0, 0));
    for kind in Kind::ALL {
        let (mut of_kind, mut hits) = (0, 0);
        let input = (any_box(), cuts(kind), prop::array::uniform8(direction()));
        check(&format!("cuts/{kind:?}"), 150, input, |((bounds, origin), cuts, directions)| {
            let mut body = Roomy::from_box(&bounds, origin).unwrap();
            let mut oracle = HalfSpaces::of_box(&bounds, origin);
            let size = oracle.size();
            let (ulp, unit) = (EPS * size, EPS * size * oracle.box_area());
            let (mut planes, mut jittered) = (Vec::new(), false);
            for cut in cuts {
                let Some((plane, hit)) = cut.plane(&body, planes.last().copied(), size) else { continue };
                body.cut(&plane).unwrap();
                oracle.add(&plane);
                planes.push(plane);
                done += 1;
                if cut.kind == kind {
                    of_kind += 1;
                    hits += usize::from(hit);
                }
                let context = (kind, &bounds, origin, &planes);
                let mut closed = assert_closed(&body);
                if body.volume() <= VOLUME_ULPS * unit {
                    // Both sides of a flat body lie in one plane, where rounding may turn a sliver of one over.
                    closed.reflex = 0.0;
                    flat += 1;
                }
                convexity.note(closed.greatest(), ULPS * ulp, context);
                let furthest = body.vertices().iter().map(|p| oracle.beyond(*p)).fold(0.0, f64::max);
                beyond.note(furthest, ULPS * ulp, context);
                let error = (body.volume() - oracle.volume()).abs();
                jittered |= cut.kind.is_jittered();
                volume.note(error, VOLUME_ULPS * unit, context);
                greatest = greatest.max((body.vertices().len(), body.faces().count()));
                if body.is_empty() {
                    emptied += 1;
                    break;
                }
            }
            // See the test of what a camera sees.
            let drawn_in = size * if jittered { 1e-8 } else { 1e-12 };
            let inner = oracle.shrunk(drawn_in).vertices(0.5 * drawn_in);
            for direction in directions {
                let Some(least) = support(&inner, direction) else { break };
                let high = body.bounds_along(direction).unwrap()[1];
                assert!(high >= least, "support {high:e} is less than {least:e} in {planes:?}");
            }
        });
        println!("{kind:?}: {of_kind} cuts, {hits} hits");
        assert!(3 * hits > of_kind && of_kind > 0, "{kind:?} was hit {hits} times in {of_kind} cuts only");
    }
    println!("{done} cuts, {emptied} emptied, {flat} flat, {greatest:?}");
    assert!(500 * emptied > done && 20 * flat > done && 2 * flat < done, "{emptied} emptied, {flat} of {done} flat");
    assert!(greatest.0 >= 24, "{greatest:?}");
}

/// A face of many corners, and planes that differ from it by less than their rounding: its corners' signs are noise,
/// and the kept and removed ones do not hang together by themselves.
#[test]
fn a_cut_by_noise_stays_closed() {
    let mut convexity = Ratchet::new("off a convex body, in roundings");
    let mut taken = Ratchet::new("taken away by noise, in roundings");
    let (mut cut, mut unchanged) = (0, 0);
    let noise = || prop::sample::select(vec![0.0, 1e-17, 1e-16, 1e-15, -1e-17, -1e-16, -1e-15]);
    let rims = prop::collection::vec([signed(), signed(), signed()], 11);
    let planes = prop::collection::vec((noise(), direction(), noise()), 5);
    check("cuts/Noise", 300, (direction(), rims, planes), |(base, rims, planes)| {
        let mut body = Roomy::from_box(&cube(), DVec3::ZERO).unwrap();
        let across = base.any_orthonormal_pair();
        // Round about the base's normal: a prism, then its base.
        let sides = rims.iter().filter_map(|[x, y, slope]| {
            let rim = (across.0 * *x + across.1 * *y).try_normalize()?;
            Some(rim + 0.2 * base * *slope)
        });
        for normal in sides.chain([base]) {
            body.cut(&Plane::new(normal, 0.7 * normal.normalize()).unwrap()).unwrap();
        }
        for (tilt, direction, shift) in planes {
            let before = body.vertices().to_vec();
            let plane = Plane::new(base + tilt * direction, base * (0.7 + shift)).unwrap();
            let volume = body.volume();
            body.cut(&plane).unwrap();
            convexity.note(assert_closed(&body).greatest(), ULPS * EPS, plane);
            taken.note((body.volume() - volume).abs(), VOLUME_ULPS * EPS * 24.0, plane);
            if before == body.vertices() { unchanged += 1 } else { cut += 1 }
        }
    });
    println!("{cut} cut, {unchanged} unchanged");
    assert!(10 * cut > unchanged && 10 * unchanged > cut, "{cut} cuts, {unchanged} without effect");
}

/// A flat body, and planes square to it through two of its corners: of each corner's copies rounding removes one and
/// keeps the other, apart from what really lies beyond. The greater part must go, not the noise.
#[test]
fn a_flat_body_is_cut_through_its_corners() {
    let mut beyond = Ratchet::new("vertices beyond a plane, in roundings");
    let (mut cases, mut cut) = (0, 0);
    let pairs = prop::collection::vec(any::<[prop::sample::Index; 2]>(), 8);
    check("cuts/Flat", 500, (direction(), direction(), pairs), |(normal, middle, pairs)| {
        cases += 1;
        let mut body = Roomy::from_box(&cube(), DVec3::ZERO).unwrap();
        let mut oracle = HalfSpaces::of_box(&cube(), DVec3::ZERO);
        body.cut(&Plane::new(normal, 0.3 * middle).unwrap()).unwrap();
        body.cut(&Plane::new(-normal, 0.3 * middle).unwrap()).unwrap();
        for pair in pairs {
            if body.is_empty() {
                break;
            }
            let [a, b] = pair.map(|corner| *corner.get(body.vertices()));
            if b.distance(a) < 0.1 {
                continue;
            }
            let Ok(plane) = Plane::new(normal.cross(b - a), a) else { continue };
            body.cut(&plane).unwrap();
            oracle.add(&plane);
            assert_closed(&body);
            let furthest = body.vertices().iter().map(|p| oracle.beyond(*p)).fold(0.0, f64::max);
            beyond.note(furthest, ULPS * EPS, plane);
            cut += 1;
        }
    });
    println!("{cut} cuts of {cases} bodies");
    assert!(cut > cases, "{cut} cuts of {cases} bodies");
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
    assert_ulps_eq!(body.volume(), 8.0 - side * side * side, max_ulps = 1);

    let before = state(&body);
    assert_eq!(body.cut(&off_corner(6)), Err(Error::BodyFull));
    assert_eq!(state(&body), before);
}

#[test]
fn cameras_reach_the_capacity() {
    let mut volume = Ratchet::new("volume of two cubes' common part");
    let (mut cases, mut reached) = (0, 0);
    check("cuts/Cubes", 300, (direction(), direction()), |(forward, up)| {
        // Two cubes about one centre: mostly, every face of both is left.
        let sides = shadow_warp::Sides::centred(2.0, 2.0);
        let Ok(view) = View::orthographic(-forward, forward, up, sides, 0.0..2.0) else { return };
        let body = Body::visible(&view, &cube());
        assert_closed(&body);
        let oracle = HalfSpaces::of_view(&view, &cube(), body.origin());
        volume.note(
            (body.volume() - oracle.volume()).abs(),
            VOLUME_ULPS * EPS * oracle.size() * oracle.box_area(),
            (forward, up),
        );
        cases += 1;
        reached += usize::from((body.vertices().len(), body.faces().count()) == (20, 12));
    });
    println!("{reached} of {cases} at the capacity");
    assert!(20 * reached > cases, "{reached} of {cases} reach 20 vertices");
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
        assert_ulps_eq!(no_vertex.volume(), 4.0, max_ulps = 1);
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
        assert_ulps_eq!(body.volume(), 4.0 * (1.0 + x), max_ulps = 4);
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
