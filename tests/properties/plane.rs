//! The plane-optimal map: the camera's own picture of a plane.

use crate::CASES;
use crate::random::basic::{inside, log_between, mixture};
use crate::random::lamps::{Place, lamp};
use crate::random::measure::{Scene, box_about, extent, lit, ndc, rounding};
use crate::random::{Ratchet, check};
use proptest::option::weighted;
use proptest::prelude::*;
use shadow_warp::glam::{DVec2, DVec3};
use shadow_warp::{Bounds, Error, Lens, Light, Plane, Rule, ShadowMap, Sides, View};

/// What a ground is made of: camera, whether it is orthographic, height and things, light.
type Ground = ((DVec3, f64, f64, f64, f64), Option<()>, (f64, Option<f64>), (DVec3, [f64; 2]));

/// A ground that is seen from above, flat or with things on it, a light that shines down, and the
/// ground's plane.
fn ground(is_lamp: bool) -> impl Strategy<Value = (Scene, Plane)> + Clone {
    let camera = (inside(100.0), log_between(1.0, 30.0), 0.0..core::f64::consts::TAU, 0.05..0.6, 0.2..1.5);
    let things = (log_between(1.0, 30.0), weighted(0.5, 0.001..0.02));
    let light = (inside(20.0), [-1.0..1.0, -1.0..1.0]);
    (camera, weighted(0.2, Just(())), things, light).prop_map(
        move |((eye, above, turn, down, size), orthographic, (height, thick), (position, sun)): Ground| {
            let eye = eye + DVec3::Y * above;
            let forward = DVec3::new(turn.cos(), -down, turn.sin());
            let view = if orthographic.is_some() {
                let sides = Sides::centred(40.0 * size, 20.0 * size);
                View::orthographic(eye, forward, DVec3::Y, sides, 0.1..300.0).unwrap()
            } else {
                let sides = Sides::centred(2.0 * size, size);
                View::perspective_off_centre(eye, forward, DVec3::Y, sides, 0.1..300.0).unwrap()
            };
            let floor = eye.y - height;
            let thick = height * thick.unwrap_or(0.0);
            let ground = Bounds::new(
                DVec3::new(eye.x - 500.0, floor, eye.z - 500.0),
                DVec3::new(eye.x + 500.0, floor + thick, eye.z + 500.0),
            );
            let casters = box_about(eye, DVec3::splat(60.0));
            let mut scene = Scene::new(view, DVec3::new(sun[0], 1.0, sun[1]), &[ground.unwrap()], casters);
            if is_lamp {
                let position = eye + position + DVec3::Y * 30.0;
                scene.light = Light::spot(position, DVec3::new(0.3, -1.0, 0.2), 1.2, 0.5, 200.0).unwrap();
            }
            (scene, Plane::new(DVec3::Y, DVec3::Y * floor).unwrap())
        },
    )
}

/// The camera's picture, by its lens.
fn picture(view: &View, point: DVec3) -> DVec2 {
    let q = point - view.eye();
    let place = DVec2::new(view.right().dot(q), view.up().dot(q));
    match view.lens() {
        Lens::Perspective(_) => place / view.forward().dot(q),
        Lens::Orthographic(_) => place,
    }
}

fn each_map<E: Strategy + Clone>(
    name: &str,
    more: E,
    mut property: impl FnMut(&Scene, &Plane, &ShadowMap, &[DVec3], E::Value),
) {
    for (light, is_lamp) in [("sun", false), ("lamp", true)] {
        let (mut seen, mut refused) = (0, 0);
        check(&format!("{name}/{light}"), 2 * CASES, (ground(is_lamp), more.clone()), |((scene, plane), more)| {
            if !scene.is_visible() {
                return;
            }
            match scene.fit().solve(Rule::Plane(plane)) {
                Ok(map) => {
                    seen += 1;
                    property(&scene, &plane, &map, &lit(&scene, map.origin()), more);
                }
                Err(Error::NothingLit) => assert!(is_lamp),
                Err(error) => {
                    assert!(matches!(error, Error::Unsupported { .. }), "{error}");
                    refused += 1;
                }
            }
        });
        assert!(seen > CASES && refused * 100 < seen, "{light} {seen} {refused}");
    }
}

/// Pixels per texel are the same everywhere on the plane: from the camera's picture of it to the
/// map is an affine way.
#[test]
fn pixels_per_texel_are_constant_on_the_plane() {
    let mut worst = Ratchet::new("constant pixels per texel");
    each_map("plane/constant", prop::array::uniform7(mixture()), |scene, plane, map, points, samples| {
        // Points of the plane in view, three of which decide on the affine map.
        let on_plane = |q: DVec3| q - plane.normal() * plane.distance(q + map.origin());
        let light = scene.light.homogeneous();
        let samples: Vec<_> = samples
            .iter()
            .map(|q| on_plane(q.of(points)))
            .filter(|q| light.w == 0.0 || map.w(*q + map.origin()) > 0.0)
            .collect();
        let places: Vec<_> = samples.iter().map(|q| ndc(map, *q).truncate()).collect();
        let pictures: Vec<_> = samples.iter().map(|q| picture(&scene.view, *q + map.origin())).collect();
        let [a, b] = [1, 2].map(|i| pictures[i] - pictures[0]);
        let area = a.perp_dot(b);
        let spread = extent(pictures.iter().map(|p| p.length()))[1];
        if area.abs() < 1e-4 * spread * spread {
            return;
        }
        let slack = extent(samples.iter().map(|q| rounding(scene, map, *q)))[1];
        for i in 3..samples.len() {
            let c = pictures[i] - pictures[0];
            let [s, t] = [c.perp_dot(b) / area, a.perp_dot(c) / area];
            let expected = places[0] + (places[1] - places[0]) * s + (places[2] - places[0]) * t;
            let size = 1.0 + s.abs() + t.abs();
            let allowed = (1e-15 + slack) * size * spread * spread / area.abs();
            worst.note((places[i] - expected).abs().max_element(), allowed, map);
        }
    });
    worst.finish();
}

/// Anywhere in space: the point's shadow on the plane, seen by the camera.
#[test]
fn points_are_drawn_where_their_shadow_is_seen() {
    let mut worst = Ratchet::new("picture of the shadow");
    each_map("plane/shadow", mixture(), |scene, plane, map, points, q| {
        let light = scene.light.homogeneous();
        let q = q.of(points) + map.origin();
        let ray = light.truncate() - q * light.w;
        let shadow = q - ray * (plane.distance(q) / plane.normal().dot(ray));
        let [here, there] = [q, shadow].map(|p| ndc(map, p - map.origin()).truncate());
        let slack = [q, shadow].map(|p| rounding(scene, map, p - map.origin()));
        worst.note((here - there).abs().max_element(), 1e-15 + slack[0] + slack[1], map);
    });
    worst.finish();
}

#[test]
fn contains_and_touches() {
    let (mut inside, mut touch) = (Ratchet::new("plane-optimal, inside"), Ratchet::new("plane-optimal, touch"));
    each_map("plane/touch", Just(()), |scene, _, map, points, ()| {
        let allowed = 1e-15 + extent(points.iter().map(|q| rounding(scene, map, *q)))[1];
        let places: Vec<_> = points.iter().map(|q| ndc(map, *q)).collect();
        for axis in [0, 1] {
            let [low, high] = extent(places.iter().map(|p| p[axis]));
            inside.note((-1.0 - low).max(high - 1.0), allowed, map);
            touch.note((low + 1.0).abs().max((high - 1.0).abs()), allowed, map);
        }
        let [low, high] = extent(places.iter().map(|p| p.z));
        inside.note((-low).max(high - 1.0), allowed, map);
        // Depth falls towards the light.
        let light = scene.light.homogeneous();
        for q in points {
            let q = *q + map.origin();
            let towards = q + (light.truncate() - q * light.w) * if light.w == 0.0 { 1.0 } else { 0.01 };
            let [here, there] = [q, towards].map(|p| ndc(map, p - map.origin()).z);
            assert!(there < here + allowed, "{here} {there}");
        }
    });
    inside.finish();
    touch.finish();
}

/// A light in the plane, or shadows that fall behind the eye.
#[test]
fn refuses_what_it_cannot_show() {
    let view = View::perspective(DVec3::Y * 2.0, DVec3::Z, DVec3::Y, 1.0, 1.0, 1.0..100.0).unwrap();
    let all = box_about(DVec3::new(0.0, 0.5, 20.0), DVec3::new(50.0, 0.5, 30.0));
    let found = |to_light: DVec3, height: f64| {
        let plane = Plane::new(DVec3::Y, DVec3::Y * height).unwrap();
        Scene::new(view, to_light, &[all], all).fit().solve(Rule::Plane(plane))
    };
    for (light, height) in [
        (DVec3::X, 0.0),
        (DVec3::X, -1.0),
        (DVec3::Z, -1.0),
        (DVec3::NEG_Z, -1.0),
        (DVec3::new(1.0, 0.0, -1.0), -0.5),
        // From ahead, and low: the shadow of what stands there falls behind the eye.
        (DVec3::new(0.0, 0.05, 1.0), 0.0),
        (DVec3::new(0.0, 1.0, 1.0), -1.0),
    ] {
        assert!(matches!(found(light, height), Err(Error::Unsupported { .. })), "{light} {height}");
    }
    for (light, height) in [(DVec3::Y, 0.0), (DVec3::new(0.0, 1.0, -1.0), 0.0), (DVec3::new(1.0, 0.1, 0.0), 0.0)] {
        let map = found(light, height).unwrap();
        assert!(map.texel_extent(DVec3::Z * 20.0).iter().all(|t| *t > 0.0 && t.is_finite()));
    }
    // A lamp in the plane.
    check("plane/through-lamp", CASES, lamp(Place::InView), |scene| {
        let at = scene.light.homogeneous().truncate();
        let plane = Plane::new(DVec3::new(0.3, 0.5, -0.2), at).unwrap();
        let found = scene.fit().solve(Rule::Plane(plane));
        assert!(matches!(found, Err(Error::Unsupported { .. } | Error::NothingLit)), "{found:?}");
    });
}
