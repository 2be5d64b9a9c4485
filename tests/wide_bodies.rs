//! Bodies with room for planes of the engine's own: capacities at their bound, and cuts that always
//! find room.
#![expect(clippy::unwrap_used, reason = "input that is not valid must stop the test")]

mod oracle;
mod random;

use oracle::{EPS, HalfSpaces, assert_closed};
use proptest::collection::vec;
use proptest::prelude::*;
use random::basic::{Mixture, direction, inside, mixture};
use random::{Ratchet, check};
use shadow_warp::glam::{DVec2, DVec3, dvec3};
use shadow_warp::{Body, Bounds, ConvexBody, Error, Light, LightSpace, Plane, Sides, View, WideBody};

/// A plane that touches the unit sphere about the origin.
fn touching(normal: DVec3) -> Plane {
    let normal = normal.normalize();
    Plane::new(normal, normal).unwrap()
}

fn cube() -> Bounds {
    Bounds::new(DVec3::NEG_ONE, DVec3::ONE).unwrap()
}

/// Directions that are spread over the sphere, none along an axis: turns by the golden angle.
fn spread(count: usize) -> impl Iterator<Item = DVec3> {
    let golden = DVec2::new(-0.737_368_878_078_319_7, 0.675_490_294_261_523_8);
    let turns = std::iter::successors(Some(DVec2::new(0.955, 0.2955)), move |turn| Some(turn.rotate(golden)));
    turns.take(count).enumerate().map(move |(i, turn)| {
        let height = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
        let across = turn.normalize() * (1.0 - height * height).sqrt();
        dvec3(across.x, height, across.y)
    })
}

/// An orthographic camera whose six planes touch the unit sphere.
fn view_about_sphere() -> View {
    let forward = dvec3(0.3, -0.5, 0.7).normalize();
    View::orthographic(-2.0 * forward, forward, dvec3(0.2, 1.0, 0.1), Sides::centred(2.0, 2.0), 1.0..3.0).unwrap()
}

fn counts<const V: usize, const F: usize>(body: &ConvexBody<V, F>) -> [usize; 3] {
    [body.faces().count(), body.vertices().len(), body.edges().count()]
}

/// All planes touch one sphere, so each has a face of its own: bodies of the greatest size.
#[test]
fn bodies_about_a_sphere_reach_each_capacity() {
    let view = view_about_sphere();
    let narrow = Body::visible(&view, &cube());
    assert_eq!(counts(&narrow), [12, 20, 30]);

    let mut body = WideBody::visible(&view, &cube());
    let shift = body.origin();
    for normal in spread(8) {
        body.cut(&touching(normal).relative_to(shift)).unwrap();
        assert!(assert_closed(&body).greatest() <= 8.0 * EPS);
    }
    assert_eq!(counts(&body), [20, 36, 54]);

    // A ninth has no room, and leaves the body as it is.
    let before = body.vertices().to_vec();
    let ninth = touching(dvec3(0.9, 0.1, -0.5)).relative_to(shift);
    assert_eq!(body.cut(&ninth), Err(Error::BodyFull));
    assert_eq!(body.vertices(), before);
    assert_closed(&body);

    // A lamp whose near plane, range and eight sides touch the sphere too.
    let axis = dvec3(-0.4, -0.8, 0.35).normalize();
    // The angle whose sine is a third.
    let light = Light::spot(-3.0 * axis, axis, 0.339_836_909_454_121_9, 2.0, 4.0).unwrap();
    let space = LightSpace::new(&view, &light).unwrap();
    let lit = body.lit_by(&light, &space);
    assert!(assert_closed(&lit).greatest() <= 16.0 * EPS);
    assert_eq!(counts(&lit), [30, 56, 84]);

    // All that may ever come: 41 planes.
    let mut all = ConvexBody::<78, 41>::from_box(&cube(), DVec3::ZERO).unwrap();
    for normal in spread(35) {
        all.cut(&touching(normal)).unwrap();
    }
    assert!(assert_closed(&all).greatest() <= 8.0 * EPS);
    assert_eq!(counts(&all), [41, 78, 117]);
    assert_eq!(all.cut(&touching(dvec3(0.9, 0.1, -0.5))), Err(Error::BodyFull));
}

/// Sets of more than 64 faces.
#[test]
fn a_body_of_all_faces_that_a_set_holds() {
    let mut body = ConvexBody::<252, 128>::from_box(&cube(), DVec3::ZERO).unwrap();
    for normal in spread(122) {
        body.cut(&touching(normal)).unwrap();
    }
    assert!(assert_closed(&body).greatest() <= 8.0 * EPS);
    assert_eq!(counts(&body), [128, 252, 378]);
    assert_eq!(body.cut(&touching(dvec3(0.9, 0.1, -0.5))), Err(Error::BodyFull));
    // Little more than the sphere is left.
    assert!(body.volume() > 4.189 && body.volume() < 4.5);
}

#[derive(Clone, Copy, Debug)]
enum Through {
    /// A point of the body.
    Inside(Mixture),
    /// A vertex of the body.
    Vertex(prop::sample::Index),
    /// An edge of the body.
    Edge(prop::sample::Index),
}

impl Through {
    fn plane(&self, body: &WideBody, normal: DVec3) -> Option<Plane> {
        let points = body.vertices();
        match self {
            Self::Inside(mixture) => Plane::new(normal, mixture.of(points)).ok(),
            Self::Vertex(index) => Plane::new(normal, *index.get(points)).ok(),
            Self::Edge(index) => {
                let edges: Vec<_> = body.edges().collect();
                let &(a, b) = index.get(&edges);
                let along = (points[b] - points[a]).normalize_or_zero();
                Plane::new(normal - along * along.dot(normal), points[a]).ok()
            }
        }
    }
}

fn planes(count: usize) -> impl Strategy<Value = Vec<(Through, DVec3)>> {
    let through = prop_oneof![
        4 => mixture().prop_map(Through::Inside),
        1 => any::<prop::sample::Index>().prop_map(Through::Vertex),
        1 => any::<prop::sample::Index>().prop_map(Through::Edge),
    ];
    vec((through, direction()), count)
}

/// Cameras around a box of 400 x 50 x 400, and points of it to look at.
fn cameras() -> impl Strategy<Value = (View, Bounds)> {
    let middle = dvec3(0.0, 25.0, 0.0);
    (inside(240.0), inside(150.0), 0.5..1.8, 0.1..1.0, 70.0..10_000.0).prop_filter_map(
        "a direction to look in",
        move |(eye, aim, fov, near, far)| {
            let bounds = Bounds::new(dvec3(-200.0, 0.0, -200.0), dvec3(200.0, 50.0, 200.0)).unwrap();
            let (eye, aim) = (middle + eye * dvec3(1.0, 0.2, 1.0), middle + aim * dvec3(1.0, 0.2, 1.0));
            let view = View::perspective(eye, aim - eye, DVec3::Y, fov, 16.0 / 9.0, near..far).ok()?;
            Some((view, bounds))
        },
    )
}

/// 100,000 planes: eight after another on what a camera sees. Each leaves a closed body with
/// nothing beyond it.
#[test]
fn eight_planes_after_a_view_always_have_room() {
    let (mut ratchet, mut growth) = (Ratchet::new("beyond a plane"), Ratchet::new("growth of the volume"));
    let (mut cut, mut narrow_is_full) = (0, 0);
    check("wide_bodies/eight", 12_500, (cameras(), planes(8)), |((view, bounds), planes)| {
        let mut body = WideBody::visible(&view, &bounds);
        let mut narrow = Body::visible(&view, &bounds);
        assert_eq!(body.vertices(), narrow.vertices());
        assert_eq!(narrow.widened().vertices(), WideBody::from(narrow).vertices());
        let space = HalfSpaces::of_box(&bounds, body.origin());
        let ulp = EPS * space.size();
        let mut volume = body.volume();
        for (through, normal) in planes {
            if body.is_empty() {
                break;
            }
            let Some(plane) = through.plane(&body, normal) else { continue };
            narrow_is_full += usize::from(narrow.cut(&plane).is_err());
            body.cut(&plane).unwrap();
            let deviation = assert_closed(&body).greatest();
            let beyond = body.vertices().iter().map(|p| plane.distance(*p)).fold(0.0, f64::max);
            ratchet.note(deviation.max(beyond) / ulp, 8.0, (through, normal));
            growth.note(body.volume() - volume, 0.015625 * ulp * space.box_area(), "volume");
            volume = body.volume();
            cut += 1;
        }
    });
    println!("{cut} cuts; no room in the narrow body: {narrow_is_full}");
    assert!(cut > 60_000 && narrow_is_full > 1000);
    ratchet.finish();
    growth.finish();
}

/// A wide body that is cut by nothing more gives what the narrow one gives.
#[test]
fn a_wide_body_has_the_casters_of_a_narrow_one() {
    let mut seen = 0;
    check("wide_bodies/casters", 2000, (cameras(), direction()), |((view, bounds), to_light)| {
        let light = Light::directional(to_light).unwrap();
        let narrow = Body::visible(&view, &bounds);
        let (few, many) =
            (narrow.casters(&light, &bounds).unwrap(), narrow.widened().casters(&light, &bounds).unwrap());
        assert_eq!(few.vertices(), many.vertices());
        assert_closed(&many);
        seen += usize::from(!few.is_empty());
    });
    assert!(seen > 1000);
}
