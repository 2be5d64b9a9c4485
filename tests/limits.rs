//! Where the numbers end: maps so thin, steep or far that little is left of f64 or f32 still hold what is promised, or are
//! refused.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]

mod random;

use random::basic::{mixture, unit};
use random::check;
use shadow_warp::glam::{DVec3, dvec3};
use shadow_warp::{
    Body, Bounds, ClipSpace, Error, Fit, Light, NearDepth, Rule, ShadowMap, Sides, View, Warp, aliasing,
};

fn camera(depth: std::ops::Range<f64>) -> View {
    View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, 1.0, 1.5, depth).unwrap()
}

fn box_between(low: DVec3, high: DVec3) -> Bounds {
    Bounds::new(low, high).unwrap()
}

fn sun(to_light: DVec3) -> Light {
    Light::directional(to_light).unwrap()
}

fn explicit(excess: f64) -> Rule {
    Rule::Explicit(Warp::new(excess).unwrap())
}

/// Every receiver vertex has a positive `w`, and the matrix is finite.
fn holds(map: &ShadowMap, receivers: &[Body]) {
    assert!(map.clip_from_world_at(map.origin(), ClipSpace::WGPU).is_finite(), "{map:?}");
    for body in receivers {
        for vertex in body.vertices() {
            let w = map.w(*vertex + body.origin());
            assert!(w > 0.0, "{w} of {map:?}");
        }
    }
}

/// A point under casters very far above it, with the steepest warp: depth still falls towards the light, and a guard
/// that is given has a margin.
#[test]
fn a_steep_warp_of_a_point_under_far_casters() {
    let point = dvec3(-123.963, 50.713, 327.709);
    let (view, light) = (camera(1.0..1000.0), sun(dvec3(0.3, 1.0, 0.1)));
    let receivers = [Body::visible(&view, &box_between(point, point))];
    let casters = box_between(point - 3070.0, point + 3070.0);
    let fit = Fit::new(&view, &light, &casters, &receivers);
    for excess in [1.0, 1e3, 7e7] {
        let map = fit.solve(explicit(excess)).unwrap();
        holds(&map, &receivers);
        let depth = map.clip_from_world_at(map.origin(), ClipSpace::WGPU).row(2).truncate();
        assert!(depth.dot(map.light_space().y) < 0.0, "{excess}");
        let bound = fit.rounding(&map, map.origin());
        assert!(bound.min_element() > 0.0, "{excess}: {bound}");
    }
}

/// `w` cannot be told from 0 where the body is far and the warp steep: the warp is made weaker.
#[test]
fn a_steep_warp_far_from_the_eye() {
    let light = sun(DVec3::Y);
    for slope in [0.011_f64, 0.012, 0.5] {
        let forward = dvec3(slope, 0.3, 1.0);
        let sides = Sides { left: 1e10, right: 1e10 + 1.0, bottom: -1.0, top: 1.0 };
        let view = View::orthographic(DVec3::ZERO, forward, DVec3::Y, sides, 1.0..2.0).unwrap();
        let all = box_between(DVec3::splat(-1e11), DVec3::splat(1e11));
        let receivers = [Body::visible(&view, &all)];
        let map = Fit::new(&view, &light, &all, &receivers).solve(explicit(1e8)).unwrap();
        holds(&map, &receivers);
    }
}

/// Two bodies with origins far apart, one much smaller than the way between.
#[test]
fn bodies_far_from_each_other() {
    let view = camera(1.0..f64::INFINITY);
    for distance in [1e3, 1e9, 1e15] {
        let near = box_between(dvec3(0.0, 0.0, 2.0), dvec3(0.0, 1e-6, 3.0));
        let far = box_between(dvec3(-0.1, 0.0, distance), dvec3(0.1, 0.2, distance));
        let receivers = [near, far].map(|bounds| Body::visible(&view, &bounds));
        for light in [DVec3::Y, DVec3::Z, dvec3(1e-9, 0.0, 1.0)].map(sun) {
            let fit = Fit::new(&view, &light, &far, &receivers);
            for rule in [Rule::Uniform, Rule::LISPSM, explicit(2.8e7)] {
                let map = fit.solve(rule).unwrap();
                holds(&map, &receivers);
                assert!(fit.worst_texel(&map).is_finite());
            }
        }
    }
}

/// A map of one texel has no room for a margin of half its width.
#[test]
fn the_guard_of_a_tiny_map() {
    let sides = Sides::centred(2.0, 2000.0);
    let view = View::orthographic(DVec3::ZERO, DVec3::Z, DVec3::Y, sides, 0.0..2.0).unwrap();
    let bounds = box_between(dvec3(-1.0, -1000.0, 0.0), dvec3(1.0, 1000.0, 2.0));
    let (light, receivers) = (sun(DVec3::Y), [Body::visible(&view, &bounds)]);
    let fit =
        Fit { map_size: [1, 1], near_depth: NearDepth::Receivers, ..Fit::new(&view, &light, &bounds, &receivers) };
    let map = fit.solve(Rule::Uniform).unwrap();
    let right = |map: &ShadowMap, origin: DVec3| {
        map.clip_from_world_at(origin, ClipSpace::WGPU).project_point3(dvec3(1.0, 0.0, 1.0) - origin).x.abs()
    };
    for far in [0.0, 1e3, 1e5, 1e6, 1.9e6, 1e9] {
        let origin = dvec3(far, 0.0, 0.0);
        match fit.guard_f32(&map, origin) {
            Ok(guarded) => assert!(right(&guarded, origin) > 0.5, "{far}"),
            Err(error) => assert!(matches!(error, Error::BeyondF32 { .. }) && far > 1e5, "{far}: {error}"),
        }
    }
}

/// Behind the centre of projection there is no texel.
#[test]
fn points_behind_the_warp() {
    let (view, light) = (camera(1.0..100.0), sun(DVec3::Y));
    let bounds = box_between(dvec3(-50.0, -5.0, 0.0), dvec3(50.0, 5.0, 100.0));
    let receivers = [Body::visible(&view, &bounds)];
    let fit = Fit::new(&view, &light, &bounds, &receivers);
    let map = fit.solve(Rule::LISPSM).unwrap();
    let behind = dvec3(0.0, 0.0, -100.0);
    assert!(map.w(behind) < 0.0);
    assert!(map.texel_extent(behind).iter().all(|extent| extent.is_infinite()));
    assert!(aliasing::pixels_per_texel(&map, &view, fit.viewport, behind).is_infinite());
}

/// A wall, a pole and a speck have a body as casters wherever they stand above a receiver, its border included.
#[test]
fn casters_without_thickness_have_a_body() {
    let view = camera(0.5..100.0);
    let to_light = dvec3(0.3, 1.0, -0.2);
    let receivers = Body::visible(&view, &box_between(dvec3(-10.0, -3.0, 1.0), dvec3(10.0, 0.0, 40.0)));
    // Some above edges, some inside.
    check("limits/casters-without-thickness", 1000, (mixture(), unit()), |(place, height)| {
        let at = receivers.origin() + place.of(receivers.vertices()) + to_light * (5.0 + 50.0 * height);
        for half in [DVec3::ZERO, DVec3::Y, DVec3::X, dvec3(0.7, 0.3, 0.0)] {
            let bounds = box_between(at - half, at + half);
            assert!(!receivers.casters(&sun(to_light), &bounds).unwrap().is_empty(), "{half}");
        }
    });
}

/// An origin that is none is an error, or a bound that says so.
#[test]
fn origins_that_are_none() {
    let (view, light) = (camera(1.0..100.0), sun(DVec3::Y));
    let bounds = box_between(DVec3::splat(-5.0), DVec3::splat(5.0));
    let receivers = [Body::visible(&view, &bounds)];
    let fit = Fit::new(&view, &light, &bounds, &receivers);
    let map = fit.solve(Rule::LISPSM).unwrap();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1.1e100] {
        let origin = dvec3(0.0, bad, 0.0);
        let named = |error: Error| assert!(matches!(error, Error::Invalid { argument: "origin", .. }), "{error}");
        named(fit.guard_f32(&map, origin).unwrap_err());
        named(fit.linear_depth(origin).unwrap_err());
        named(Body::from_box(&bounds, origin).unwrap_err());
        assert_eq!(fit.rounding(&map, origin), DVec3::INFINITY);
    }
}
