//! Hard cases of spot lights, and of maps whose warp has a direction of its own.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]

mod random;

use approx::assert_abs_diff_eq;
use random::basic::{direction, inside, log_between};
use random::measure::{Scene, box_about, box_between, ndc, product_rounding};
use random::{Ratchet, Strategy, check, prop};
use shadow_warp::glam::DVec3;
use shadow_warp::{
    Aim, Axes, Body, Bounds, ClipSpace, Error, Fit, Light, LightSpace, PerspectiveRule, Plane, Rule, View,
};

/// How far a place is outside the map.
fn beyond(place: DVec3) -> f64 {
    assert!(place.is_finite(), "{place}");
    (place.truncate().abs().max_element() - 1.0).max(-place.z).max(place.z - 1.0)
}

fn camera(eye: DVec3, forward: DVec3, near: f64, far: f64) -> View {
    View::perspective(eye, forward, DVec3::Y, 1.0, 1.5, near..far).unwrap()
}

/// What rounding does to axes and to places in the map.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A spot light that shines across the plane of line of sight and light, to any number of digits: its axes are
/// orthonormal, and what it lights is in its map.
#[test]
fn spots_across_the_line_of_sight() {
    let mut orthonormal = Ratchet::new("axes, in roundings");
    let mut outside = Ratchet::new("outside the map");
    let (mut cases, mut solved) = (0, 0);
    let tilt = prop::option::of(log_between(1e-17, 1e-3)).prop_map(|tilt| tilt.unwrap_or(0.0));
    let input = (direction(), inside(10.0), direction(), tilt);
    check("hard-lights/across", 500, input, |(forward, place, aside, tilt)| {
        let Some(across) = forward.cross(place).try_normalize() else { return };
        let up = if forward.y.abs() < 0.9 { DVec3::Y } else { DVec3::X };
        let view = View::perspective(DVec3::ZERO, forward, up, 1.0, 1.5, 0.1..100.0).unwrap();
        let light = Light::spot(place, across + aside * tilt, 0.8, 0.1, 100.0).unwrap();
        let LightSpace { x, y, z, .. } = LightSpace::new(&view, &light).unwrap();
        for (a, b, expected) in [(x, x, 1.0), (y, y, 1.0), (z, z, 1.0), (x, y, 0.0), (y, z, 0.0), (z, x, 0.0)] {
            orthonormal.note((a.dot(b) - expected).abs(), ROUNDING, light);
        }
        assert_abs_diff_eq!(y.cross(x), z, epsilon = ROUNDING);

        cases += 1;
        let everything = box_about(DVec3::ZERO, DVec3::splat(30.0));
        let seen = [Body::visible(&view, &everything)];
        let fit = Fit::new(&view, &light, &everything, &seen);
        let map = match fit.solve(Rule::OPTIMAL) {
            Err(Error::NothingLit) => return,
            map => map.unwrap(),
        };
        solved += 1;
        for lit in fit.lit_receivers() {
            for q in lit.vertices() {
                let p = *q + lit.origin() - map.origin();
                outside.note(beyond(ndc(&map, p)), 8.0 * product_rounding(&map, p) / 16.0, light);
            }
        }
    });
    assert!(4 * solved > cases, "{solved} of {cases}");
}

/// Planes through the eye, or through the light, wherever in the world: no map, or one with finite texels.
#[test]
fn planes_through_the_eye_or_the_light() {
    let (mut cases, mut refused) = (0, 0);
    let place = (prop::sample::select(vec![1.0, 1e3, 1e5]), inside(1.0)).prop_map(|(size, place)| size * place);
    check("hard-lights/planes", 1000, (place, direction()), |(eye, normal)| {
        let view = camera(eye, DVec3::X, 0.1, 1000.0);
        let bounds = box_about(eye, DVec3::splat(100.0));
        let scene =
            Scene::new(view, DVec3::new(0.3, 1.0, 0.2), &[box_about(eye + 10.0 * DVec3::X, DVec3::splat(3.0))], bounds);
        let light = Light::spot(eye + DVec3::new(10.0, 40.0, 5.0), DVec3::NEG_Y, 0.8, 0.1, 100.0).unwrap();
        let fits = [scene.fit(), Fit { light: &light, ..scene.fit() }];
        let through = [eye, eye + DVec3::new(10.0, 40.0, 5.0)];
        for (fit, point) in [(fits[0], through[0]), (fits[1], through[0]), (fits[1], through[1])] {
            cases += 1;
            match fit.solve(Rule::Plane(Plane::new(normal, point).unwrap())) {
                Err(Error::Unsupported { use_instead, .. }) => {
                    assert_eq!(use_instead, "Rule::OPTIMAL");
                    refused += 1;
                }
                Err(error) => unreachable!("{error}"),
                Ok(map) => {
                    let worst = fit.worst_texel(&map);
                    assert!(worst > 0.0 && worst < 1e9, "{worst}");
                }
            }
        }
    });
    assert!(100 * refused > 99 * cases, "{refused} of {cases}");
}

/// A body that is little more than the rounding of its own distance, and cameras moved far back.
#[test]
fn little_more_than_rounding() {
    let forward = DVec3::new(0.39, 0.21, 0.9);
    let mut outside = Ratchet::new("outside the map");
    for (distance, size) in [(1e7, 1e-8), (1e5, 1e-10), (1e3, 1e-3), (1.0, 1e-15)] {
        let view = camera(DVec3::ZERO, forward, 1e-3, 1e9);
        let centre = view.forward() * distance;
        let body = box_between(centre, centre + size);
        let scene = Scene::new(view, DVec3::new(0.3, 1.0, 0.2), &[body], body);
        let ground = Plane::new(DVec3::Y, centre - DVec3::Y * 0.1 * distance).unwrap();
        for shift in [0.0, 1e2, 1e6, 1e12] {
            let moved = Rule::Perspective(PerspectiveRule { shift, ..Default::default() });
            for rule in [moved, Rule::Plane(ground), Rule::OPTIMAL] {
                let map = scene.fit().solve(rule).unwrap();
                for q in scene.receivers(map.origin()) {
                    // Some digits are left of what is hardly more than rounding.
                    outside.note(beyond(ndc(&map, q)), 2e-7, rule);
                }
            }
        }
    }
}

/// A spot light whose near plane is next to nothing at its distance from the eye: inside, or refused.
#[test]
fn near_planes_far_away() {
    let view = camera(DVec3::ZERO, DVec3::X, 0.0067, f64::INFINITY);
    let mut outside = Ratchet::new("outside the map");
    let mut solved = 0;
    for near in [1.0, 1e-2, 1e-4, 1e-6, 1e-9] {
        let place = DVec3::new(730.5, -17.5, 200.5);
        let light = Light::spot(place, DVec3::new(1.0, 0.05, 0.02), 0.5, near, 200.0 * near).unwrap();
        let bounds = Bounds::new(DVec3::new(0.0, -200.0, place.z), DVec3::new(900.0, 200.0, place.z)).unwrap();
        let seen = [Body::visible(&view, &bounds)];
        let fit = Fit::new(&view, &light, &bounds, &seen);
        for rule in [Rule::PSM, Rule::OPTIMAL, Rule::Uniform] {
            let Ok(map) = fit.solve(rule) else { continue };
            solved += 1;
            for lit in fit.lit_receivers() {
                for q in lit.vertices() {
                    let place = ndc(&map, *q + lit.origin() - map.origin()).truncate();
                    outside.note(place.abs().max_element() - 1.0, 1e-3, rule);
                }
            }
        }
    }
    assert!(solved > 6, "{solved}");
}

/// The guard looks at no more of the casters' box than there is from a spot light to what it lights.
#[test]
fn guard_of_a_spot_light_among_huge_casters() {
    let view = camera(DVec3::new(1.0, 2.0, 3.0), DVec3::Z, 0.1, 100.0);
    let light = Light::spot(DVec3::new(3.0, 30.0, 30.0), DVec3::NEG_Y, 0.6, 0.5, 100.0).unwrap();
    let ground = Bounds::new(DVec3::new(-20.0, 0.0, 10.0), DVec3::new(20.0, 1.0, 60.0)).unwrap();
    let seen = [Body::visible(&view, &ground)];
    for size in [1e2, 1e12, 1e30] {
        let casters = box_about(DVec3::ZERO, DVec3::splat(size));
        let fit = Fit::new(&view, &light, &casters, &seen);
        for rule in [Rule::Uniform, Rule::PSM, Rule::OPTIMAL] {
            let map = fit.guard_f32(&fit.solve(rule).unwrap(), view.eye()).unwrap();
            assert!(map.clip_from_world_at(view.eye(), ClipSpace::WGPU).is_finite());
        }
    }
}

/// Light along the view, against it, along up and down, in the picture, beside it, at the horizon; casters behind the eye;
/// a spot light at the eye, before it and behind it. Each rule has a right map, or says what to use instead.
#[test]
fn every_rule_under_special_lights() {
    let eye = DVec3::new(1.0, 2.0, 3.0);
    let view = camera(eye, DVec3::Z, 0.1, 100.0);
    let (v, up, right) = (view.forward(), view.up(), view.right());
    let suns = [v, -v, up, -up, right, v + 0.1 * right, 0.2 * up - v, v + 0.8 * right + 0.5 * up, right + 1e-9 * v];
    let spots =
        [(eye, v), (eye, -v), (eye + 5.0 * v, v), (eye - 5.0 * v, v), (eye + 3.0 * up, -up), (eye + 2.0 * right, v)];
    let suns = suns.map(|to_light| Light::directional(to_light).unwrap());
    let spots = spots.map(|(place, axis)| Light::spot(place, axis, 0.9, 0.2, 90.0).unwrap());
    let [in_place, moved, centred] = [(Aim::Closest, 0.0), (Aim::Closest, 7.0), (Aim::Centre, 0.0)]
        .map(|(aim, shift)| Rule::Perspective(PerspectiveRule { aim, shift }));
    let ground = Rule::Plane(Plane::new(DVec3::Y, DVec3::ZERO).unwrap());
    let published = random::measure::LIGHT_SPACE_RULES.map(Rule::LightSpace);
    let others = [Rule::Uniform, Rule::OnAxis, Rule::TSM, Rule::OPTIMAL, in_place, moved, centred, ground];
    let bounds = box_between(DVec3::new(-40.0, 0.0, -60.0), DVec3::new(40.0, 10.0, 80.0));
    let seen = [Body::visible(&view, &bounds)];
    let mut outside = Ratchet::new("outside the map");
    let mut aside = Ratchet::new("way to the light, across the map");
    let (mut solved, mut refused) = (0, 0);
    for light in suns.iter().chain(&spots) {
        for rule in published.into_iter().chain(others) {
            for axes in [Axes::View, Axes::LightFixed, Axes::Middle] {
                let fit = Fit { axes, ..Fit::new(&view, light, &bounds, &seen) };
                let map = match fit.solve(rule) {
                    Ok(map) => map,
                    Err(Error::Unsupported { use_instead, .. }) => {
                        assert!(use_instead.contains("Rule::OPTIMAL"), "{use_instead}");
                        assert!(matches!(rule, Rule::Perspective(_) | Rule::Plane(_)), "{rule:?}");
                        refused += 1;
                        continue;
                    }
                    Err(error) => {
                        assert!(
                            error == Error::NothingLit && matches!(light, Light::Spot(_)),
                            "{rule:?} {light:?} {error}"
                        );
                        continue;
                    }
                };
                solved += 1;
                let worst = fit.worst_texel(&map);
                assert!(worst > 0.0 && worst.is_finite(), "{rule:?} {light:?} {worst}");
                for lit in fit.lit_receivers() {
                    for q in lit.vertices() {
                        let p = *q + lit.origin() - map.origin();
                        let place = ndc(&map, p);
                        outside.note(beyond(place), 5e-14, (rule, axes, light));
                        assert!(map.w(p + map.origin()) > 0.0, "{rule:?} {axes:?} {light:?} {place}");
                        // The way to the light keeps its texel, and depth falls on it.
                        let nearer = p + map.to_light(p + map.origin()) * 0.1;
                        let moved = ndc(&map, nearer) - place;
                        aside.note(moved.truncate().length(), 2e-14, (rule, axes, light));
                        assert!(moved.z < 0.0, "{rule:?} {axes:?} {light:?} {moved}");
                    }
                }
            }
        }
    }
    assert!(solved > 400 && refused > 20, "{solved} {refused}");
}

/// A point light has no single map, and the error says what it has; a spot light at the eye, along the view, sees what the
/// eye does: a uniform map by every rule that looks at the line of sight.
#[test]
fn lights_at_the_eye() {
    let eye = DVec3::new(3.0, 5.0, -2.0);
    let view = camera(eye, DVec3::new(0.6, 0.0, 0.8), 0.1, 20.0);
    let everything = box_about(eye, DVec3::splat(40.0));
    let seen = [Body::visible(&view, &everything)];
    let point = Light::point(eye, 0.1, 9.0).unwrap();
    let error = Fit::new(&view, &point, &everything, &seen).solve(Rule::LISPSM).unwrap_err();
    assert!(matches!(error, Error::Unsupported { .. }) && error.to_string().contains("Point::faces"), "{error}");
    let spot = Light::spot(eye, view.forward(), 0.5, 0.1, 9.0).unwrap();
    let fit = Fit::new(&view, &spot, &everything, &seen);
    let uniform = fit.worst_texel(&fit.solve(Rule::Uniform).unwrap());
    for rule in [Rule::Uniform, Rule::LISPSM, Rule::OnAxis, Rule::TSM, Rule::OPTIMAL] {
        let map = fit.solve(rule).unwrap();
        assert_eq!(map.light_space().sin_gamma.to_bits(), 0);
        assert!(fit.worst_texel(&map) <= uniform, "{rule:?}");
    }
}
