//! Every error, and every argument that is checked.

#![expect(clippy::unwrap_used, reason = "arguments that should be accepted and are not are the failure")]

use shadow_warp::glam::{DMat4, DVec3, DVec4};
use shadow_warp::{Body, Bounds, ClipSpace, ConvexBody, Error, Fit, Light, Plane, Rule, ShadowMap, Sides, View, Warp};
use std::fmt::Debug;

const NOT_FINITE: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

/// Asserts that a call is refused because of one argument, and that the message says what would be right.
#[track_caller]
fn refused<T: Debug>(result: Result<T, Error>, name: &str, words: &str) {
    let error = result.unwrap_err();
    let Error::Invalid { argument, condition } = error else {
        unreachable!("{error:?}");
    };
    assert_eq!(argument, name);
    assert!(condition.contains("must "), "{condition}");
    assert!(condition.contains(words), "{condition}");
    assert_eq!(error.to_string(), format!("{argument} {condition}"));
}

/// All the ways to put bad numbers into a vector.
fn bad_vectors(bad: &[f64]) -> Vec<DVec3> {
    let place = |x: f64| [DVec3::new(x, 1.0, 2.0), DVec3::new(1.0, x, 2.0), DVec3::new(1.0, 2.0, x)];
    bad.iter().flat_map(|x| place(*x)).collect()
}

fn bad_positions() -> Vec<DVec3> {
    bad_vectors(&[NOT_FINITE[0], NOT_FINITE[1], NOT_FINITE[2], 1.1e100, -1.1e100])
}

/// Not finite, too long, too short, and nothing.
fn bad_directions() -> Vec<DVec3> {
    let mut bad = bad_vectors(&NOT_FINITE);
    bad.extend([DVec3::ZERO, DVec3::splat(1e101), DVec3::splat(1e-101), DVec3::X * 1e200, DVec3::X * 1e-200]);
    bad
}

const BAD_LENGTHS: [f64; 8] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -0.0, -1.0, 0.9e-100, 1.1e100];

/// A camera of which one piece at a time is replaced.
#[derive(Clone, Copy)]
struct Pieces {
    eye: DVec3,
    forward: DVec3,
    up: DVec3,
    fov_y: f64,
    aspect: f64,
    near: f64,
    far: f64,
}

const GOOD: Pieces =
    Pieces { eye: DVec3::ZERO, forward: DVec3::Z, up: DVec3::Y, fov_y: 1.0, aspect: 1.5, near: 1.0, far: 100.0 };
const SIDES: Sides = Sides { left: -1.0, right: 1.0, bottom: -0.5, top: 0.5 };

impl Pieces {
    fn perspective(self) -> Result<View, Error> {
        View::perspective(self.eye, self.forward, self.up, self.fov_y, self.aspect, self.near..self.far)
    }

    /// The view by each of the three constructors.
    fn each(self) -> [Result<View, Error>; 3] {
        let Self { eye, forward, up, near, far, .. } = self;
        [
            self.perspective(),
            View::perspective_off_centre(eye, forward, up, SIDES, near..far),
            View::orthographic(eye, forward, up, SIDES, near..far),
        ]
    }
}

#[test]
fn good_pieces_are_accepted() {
    for view in GOOD.each() {
        view.unwrap();
    }
    for far in [f64::INFINITY, 1e100] {
        for view in (Pieces { far, ..GOOD }).each() {
            assert!(view.unwrap().far() >= 1e100);
        }
    }
    // The ends of the ranges.
    let far_off = Pieces { eye: DVec3::splat(-1e100), forward: DVec3::X * 1e100, up: DVec3::Y * 1e-99, ..GOOD };
    far_off.perspective().unwrap();
    Pieces { near: 1e-100, ..GOOD }.perspective().unwrap();
}

#[test]
fn frames() {
    for eye in bad_positions() {
        for view in (Pieces { eye, ..GOOD }).each() {
            refused(view, "eye", "finite, with coordinates of at most 1e100");
        }
    }
    for bad in bad_directions() {
        for view in (Pieces { forward: bad, ..GOOD }).each() {
            refused(view, "forward", "length between 1e-100 and 1e100");
        }
        for view in (Pieces { up: bad, ..GOOD }).each() {
            refused(view, "up", "length between 1e-100 and 1e100");
        }
    }
    for up in [GOOD.forward, -3.0 * GOOD.forward, DVec3::new(1e-15, 0.0, 1.0)] {
        for view in (Pieces { up, ..GOOD }).each() {
            refused(view, "up", "not be parallel to forward");
        }
    }
}

#[test]
fn depths() {
    for near in BAD_LENGTHS {
        let [a, b, ortho] = (Pieces { near, far: 1e101, ..GOOD }).each();
        refused(a, "near", "between 1e-100 and 1e100");
        refused(b, "near", "between 1e-100 and 1e100");
        // Without perspective it may be zero or negative.
        if near.abs() <= 1e100 {
            refused(ortho, "far", "at most 1e100, or infinite");
        } else {
            refused(ortho, "near", "finite and at most 1e100");
        }
    }
    for far in [f64::NAN, f64::NEG_INFINITY, 0.0, -1.0, 0.5, GOOD.near] {
        for view in (Pieces { far, ..GOOD }).each() {
            refused(view, "far", "greater than near");
        }
    }
    for view in (Pieces { far: 1.1e100, ..GOOD }).each() {
        refused(view, "far", "at most 1e100, or infinite");
    }
}

#[test]
fn lenses() {
    let pi = std::f64::consts::PI;
    for fov_y in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0, pi, 4.0] {
        refused(Pieces { fov_y, ..GOOD }.perspective(), "fov_y", "between 0 and pi radians");
    }
    for aspect in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0] {
        refused(Pieces { aspect, ..GOOD }.perspective(), "aspect", "positive and finite");
    }
    // In range by themselves, but with tangents that are not.
    for fov_y in [pi - 1e-7, 1e-13] {
        refused(Pieces { fov_y, ..GOOD }.perspective(), "fov_y", "a tangent, of its half, between 5e-13 and 1e6");
    }
    for aspect in [1e-13, 1e7] {
        refused(
            Pieces { aspect, ..GOOD }.perspective(),
            "aspect",
            "tangent of half of fov_y must be between 5e-13 and 1e6",
        );
    }
}

/// Each side in turn not finite, and each pair in the wrong order, or too close, or too far out.
#[test]
fn sides() {
    let perspective = |sides| View::perspective_off_centre(GOOD.eye, GOOD.forward, GOOD.up, sides, GOOD.near..GOOD.far);
    let orthographic = |sides| View::orthographic(GOOD.eye, GOOD.forward, GOOD.up, sides, GOOD.near..GOOD.far);
    let across = |left, right| Sides { left, right, ..SIDES };
    let upright = |bottom, top| Sides { bottom, top, ..SIDES };
    let mut bad: Vec<[f64; 2]> = NOT_FINITE.iter().flat_map(|x| [[*x, 1.0], [-1.0, *x], [*x, *x]]).collect();
    bad.extend([[1.0, 1.0], [1.0, -1.0], [0.0, 0.0], [1.0, 1.0 + 1e-13], [-1.0 - 1e-13, -1.0]]);
    for [a, b] in bad.iter().copied().chain([[-1.0, 1.1e6], [-1.1e6, 1.0], [0.0, 1e-13]]) {
        refused(perspective(across(a, b)), "left and right", "ordered, at least 1e-12 apart");
        refused(perspective(upright(a, b)), "bottom and top", "at most 1e6 in size");
    }
    for [a, b] in bad.into_iter().chain([[-1.0, 1.1e100], [-1.1e100, 1.0]]) {
        refused(orthographic(across(a, b)), "left and right", "ordered, at least 1e-12 of their size apart");
        refused(orthographic(upright(a, b)), "bottom and top", "at most 1e100 in size");
    }
    refused(orthographic(upright(0.0, 1e-101)), "bottom and top", "apart");
    orthographic(across(0.0, 1e6)).unwrap();
    perspective(across(0.0, 1e6)).unwrap();
}

#[test]
fn lights() {
    for bad in bad_directions() {
        refused(Light::directional(bad), "to_light", "finite, with a length between 1e-100 and 1e100");
        refused(Light::spot(DVec3::ZERO, bad, 0.5, 1.0, 2.0), "direction", "length between");
    }
    for bad in bad_positions() {
        refused(Light::spot(bad, DVec3::X, 0.5, 1.0, 2.0), "position", "at most 1e100");
        refused(Light::point(bad, 1.0, 2.0), "position", "at most 1e100");
    }
    let half_pi = std::f64::consts::FRAC_PI_2;
    for angle in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -0.1, half_pi, 2.0] {
        refused(Light::spot(DVec3::ZERO, DVec3::X, angle, 1.0, 2.0), "outer_angle", "between 0 and pi/2 radians");
    }
    let each =
        |near, range| [Light::spot(DVec3::ZERO, DVec3::X, 0.5, near, range), Light::point(DVec3::ZERO, near, range)];
    for bad in BAD_LENGTHS {
        for light in each(bad, 2.0) {
            refused(light, "near", "between 1e-100 and 1e100");
        }
        for light in each(1.0, bad) {
            refused(light, "range", "between 1e-100 and 1e100");
        }
    }
    for range in [1.0, 0.5] {
        for light in each(1.0, range) {
            refused(light, "range", "greater than near");
        }
    }
    for light in each(1.0, 2.0) {
        light.unwrap();
    }
}

#[test]
fn boxes_and_planes() {
    for bad in bad_positions() {
        refused(Bounds::new(bad, DVec3::splat(3.0)), "min", "at most 1e100");
        refused(Bounds::new(DVec3::ZERO, bad), "max", "at most 1e100");
        refused(Plane::new(DVec3::X, bad), "point", "at most 1e100");
    }
    for min in DVec3::AXES {
        refused(Bounds::new(min, DVec3::ZERO), "min", "not be greater than max");
    }
    for bad in bad_directions() {
        refused(Plane::new(bad, DVec3::ZERO), "normal", "length between 1e-100 and 1e100");
    }
    Bounds::new(DVec3::ONE, DVec3::ONE).unwrap();
}

#[test]
fn warps() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1e-300, -1.0, 1.1e8] {
        refused(Warp::new(bad), "excess", "between 0 and 1e8");
    }
    for good in [0.0, -0.0, Warp::MAX_EXCESS] {
        Warp::new(good).unwrap();
    }
}

fn solved() -> ShadowMap {
    with_fit(DVec3::Y, |fit| Fit { map_size: [1024, 64], ..*fit }.solve(Rule::LISPSM)).unwrap()
}

/// A camera in a box, with a light.
fn with_fit<T>(to_light: DVec3, f: impl FnOnce(&Fit<'_>) -> T) -> T {
    with_light(&Light::directional(to_light).unwrap(), f)
}

fn with_light<T>(light: &Light, f: impl FnOnce(&Fit<'_>) -> T) -> T {
    let view = GOOD.perspective().unwrap();
    let bounds = Bounds::new(DVec3::splat(-50.0), DVec3::splat(50.0)).unwrap();
    f(&Fit::new(&view, light, &bounds, &[Body::visible(&view, &bounds)]))
}

#[test]
fn borders() {
    let map = solved();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1e-9, -1.0, 32.0, 1000.0] {
        refused(map.with_border(bad), "border_texels", "not be negative, and leave");
    }
    for good in [0.0, 0.5, 31.999] {
        map.with_border(good).unwrap();
    }
}

#[test]
fn sizes() {
    with_fit(DVec3::Y, |fit| {
        for bad in [[0, 1], [1, 0], [0, 0]] {
            refused(Fit { map_size: bad, ..*fit }.solve(Rule::Uniform), "map_size", "not be zero");
            refused(Fit { viewport: bad, ..*fit }.solve(Rule::Uniform), "viewport", "not be zero");
        }
        for good in [[1, 1], [u32::MAX, u32::MAX]] {
            let map = Fit { map_size: good, viewport: good, ..*fit }.solve(Rule::LISPSM);
            assert_eq!(map.unwrap().size(), good);
        }
    });
}

#[test]
fn matrices() {
    // Infinite, reversed, right-handed.
    let projection = DMat4::from_cols(DVec4::X * 1.2, DVec4::Y * 1.8, DVec4::new(0.0, 0.0, 0.0, -1.0), DVec4::Z * 0.1);
    let space = ClipSpace::WGPU.reversed();
    let from = |motion, projection| View::from_matrices(motion, projection, space);
    from(DMat4::IDENTITY, projection).unwrap();
    let not_rigid = [
        DMat4::from_scale(DVec3::splat(1.001)),
        DMat4::from_cols(DVec4::X, DVec4::new(0.001, 1.0, 0.0, 0.0), DVec4::Z, DVec4::W),
        DMat4::ZERO,
        projection,
        DMat4::from_cols(DVec4::X, DVec4::Y, DVec4::Z, DVec4::new(0.0, 0.0, 0.0, 2.0)),
    ];
    for bad in not_rigid {
        refused(from(bad, projection), "eye_from_world", "a rigid motion, to 1e-4");
    }
    let entry = |column: usize, row: usize, value: f64| {
        let mut matrix = projection;
        matrix.col_mut(column)[row] = value;
        matrix
    };
    let bad = [(0, 0, 0.0), (1, 1, 0.0), (1, 0, 0.1), (0, 1, 0.1), (0, 2, 0.1), (1, 2, 0.1), (0, 3, 0.1), (1, 3, 0.1)];
    let offset = [(3, 0, 0.1), (3, 1, 0.1), (3, 3, 0.1)];
    for (column, row, value) in bad.into_iter().chain(offset) {
        let matrix = entry(column, row, value);
        refused(from(DMat4::IDENTITY, matrix), "clip_from_eye", "a perspective or orthographic projection along z");
    }
    for bad in NOT_FINITE {
        for column in 0..4 {
            for row in 0..4 {
                refused(from(DMat4::IDENTITY, entry(column, row, bad)), "clip_from_eye", "along z");
                let mut motion = DMat4::IDENTITY;
                motion.col_mut(column)[row] = bad;
                refused(from(motion, projection), "eye_from_world", "a rigid motion");
            }
        }
    }
    // A projection onto nothing: near and far are the same.
    refused(from(DMat4::IDENTITY, DMat4::ZERO), "clip_from_eye", "along z");
}

#[test]
fn nothing_visible() {
    let view = GOOD.perspective().unwrap();
    let light = Light::directional(DVec3::Y).unwrap();
    let behind = Bounds::new(DVec3::splat(-9.0), DVec3::splat(-8.0)).unwrap();
    for receivers in [&[][..], &[Body::visible(&view, &behind)], &[Body::visible(&view, &behind); 2]] {
        let fit = Fit::new(&view, &light, &behind, receivers);
        assert_eq!(fit.solve(Rule::Uniform), Err(Error::NothingVisible));
        assert_eq!(fit.linear_depth(DVec3::ZERO), Err(Error::NothingVisible));
        assert_eq!(fit.worst_texel(&solved()).to_bits(), 0);
    }
    assert_eq!(Error::NothingVisible.to_string(), "no receiver lies in the view volume");
}

/// A point light is six jobs; a body is swept towards a light at infinity alone.
#[test]
fn lights_that_are_not_directional() {
    let spot = Light::spot(DVec3::new(0.0, 9.0, 5.0), DVec3::NEG_Y, 0.5, 0.1, 90.0).unwrap();
    let point = Light::point(DVec3::Y, 0.1, 9.0).unwrap();
    with_light(&point, |fit| {
        for error in [fit.solve(Rule::LISPSM).unwrap_err(), fit.linear_depth(DVec3::ZERO).unwrap_err()] {
            let Error::Unsupported { requested, use_instead } = error else { unreachable!("{error:?}") };
            assert!(requested.contains("point light") && use_instead.contains("Point::faces"), "{error}");
            assert_eq!(error.to_string(), format!("{requested} is not supported here: use {use_instead}"));
        }
    });
    for light in [spot, point] {
        with_light(&light, |fit| {
            let error = fit.receivers[0].casters(&light, fit.casters).unwrap_err();
            let Error::Unsupported { requested, use_instead } = error else { unreachable!("{error:?}") };
            assert!(requested.contains("light with a position") && use_instead.contains("ShadowMap::shown"), "{error}");
        });
    }
    // A spot light that shines away from all that is seen.
    let away = Light::spot(DVec3::new(0.0, 1e3, 0.0), DVec3::Y, 0.5, 0.1, 90.0).unwrap();
    with_light(&away, |fit| {
        assert_eq!(fit.solve(Rule::Uniform), Err(Error::NothingLit));
        assert_eq!(Error::NothingLit.to_string(), "no receiver in view lies in the light");
    });
}

#[test]
fn bodies_without_room() {
    let unit = Bounds::new(DVec3::ZERO, DVec3::ONE).unwrap();
    let mut body = ConvexBody::<8, 6>::from_box(&unit, DVec3::ZERO).unwrap();
    let corner = Plane::new(DVec3::ONE, DVec3::splat(0.9)).unwrap();
    assert_eq!(body.cut(&corner), Err(Error::BodyFull));
    assert_eq!(body.volume().to_bits(), 1_f64.to_bits());
    assert_eq!(Error::BodyFull.to_string(), "the body has no room for another cut: use a WideBody, see Body::widened");
}

#[test]
fn far_from_the_origin() {
    with_fit(DVec3::Y, |fit| {
        let map = fit.solve(Rule::LISPSM).unwrap();
        let origin = DVec3::splat(1e7);
        let error = fit.guard_f32(&map, origin).unwrap_err();
        let Error::BeyondF32 { texels, cause } = error else { unreachable!("{error:?}") };
        assert!(texels > 1.0 && texels.is_finite() && cause.contains("origin is too far away"), "{error}");
        assert!(error.to_string().contains(&format!("{texels:.3e} texels: {cause}")), "{error}");
        let hopeless = fit.guard_f32(&map, DVec3::splat(1e60)).unwrap_err();
        assert_eq!(hopeless, Error::BeyondF32 { texels: f64::INFINITY, cause });
    });
}

#[test]
fn planes_seen_edge_on() {
    let scene = Bounds::new(DVec3::new(-20.0, 0.0, -20.0), DVec3::new(20.0, 5.0, 20.0)).unwrap();
    let light = Light::directional(DVec3::new(0.4, 0.9, -0.3)).unwrap();
    let sides = Sides::centred(10.0, 8.0);
    let level = View::orthographic(DVec3::Y, DVec3::Z, DVec3::Y, sides, -5.0..30.0).unwrap();
    let bent = View::orthographic(DVec3::Y, DVec3::new(0.0, -0.5, 1.0), DVec3::Y, sides, -5.0..30.0).unwrap();
    for (view, serves) in [(level, false), (bent, true)] {
        let seen = [Body::visible(&view, &scene)];
        let plane = Plane::new(DVec3::Y, DVec3::ZERO).unwrap();
        let map = Fit::new(&view, &light, &scene, &seen).solve(Rule::Plane(plane));
        assert!(map.is_ok() == serves && (serves || matches!(map, Err(Error::Unsupported { .. }))), "{map:?}");
    }
}
