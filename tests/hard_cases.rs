//! The cases that implementations get wrong, one by one, and what is right there.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]
#![expect(clippy::disallowed_methods, reason = "tests may call what the library must not")]

mod random;

use approx::{assert_abs_diff_eq, assert_ulps_eq};
use random::basic::{signed, unit};
use random::measure::{LIGHT_SPACE_RULES, Scene, box_about, box_between, extent, ndc, project};
use random::{Ratchet, check};
use shadow_warp::glam::{DMat4, DVec2, DVec3};
use shadow_warp::{Axes, Body, Bounds, ClipSpace, Error, Fit, Rule, ShadowMap, Sides, View, Warp};

const EYE: DVec3 = DVec3::new(3.0, 5.0, -2.0);
const FORWARD: DVec3 = DVec3::new(0.6, 0.0, 0.8);

fn camera(eye: DVec3, forward: DVec3, depth: std::ops::Range<f64>) -> View {
    let up = if forward.cross(DVec3::Y).length() > 1e-6 { DVec3::Y } else { DVec3::X };
    View::perspective(eye, forward, up, 1.0, 1.5, depth).unwrap()
}

/// All that a camera at `EYE` sees up to 100 units away.
fn frustum(to_light: DVec3) -> Scene {
    let all = box_about(EYE, DVec3::splat(150.0));
    Scene::new(camera(EYE, FORWARD, 0.5..100.0), to_light, &[all], all)
}

fn solve(scene: &Scene, rule: Rule) -> ShadowMap {
    scene.fit().solve(rule).unwrap()
}

fn matrix(map: &ShadowMap, origin: DVec3) -> DMat4 {
    map.clip_from_world_at(origin, ClipSpace::WGPU)
}

/// The rounding of places in the map.
const SIDES: f64 = 4.0 * f64::EPSILON;

/// The receivers reach all four sides and the far plane, and no caster is lost.
fn fills(scene: &Scene, map: &ShadowMap) {
    assert!(unfilled(scene, map) <= SIDES, "{:e}", unfilled(scene, map));
}

/// No receiver and no caster is outside.
fn inside(scene: &Scene, map: &ShadowMap) {
    assert!(outside(scene, map) <= SIDES, "{:e}", outside(scene, map));
}

/// How far the receivers are from reaching all four sides and the far plane, and receivers and casters beyond the map.
fn unfilled(scene: &Scene, map: &ShadowMap) -> f64 {
    let points: Vec<_> = scene.receivers(map.origin()).iter().map(|q| ndc(map, *q)).collect();
    let [x, y, z] = [0, 1, 2].map(|axis| extent(points.iter().map(|p| p[axis])));
    let gaps = [x[0] + 1.0, x[1] - 1.0, y[0] + 1.0, y[1] - 1.0, z[1] - 1.0];
    gaps.iter().map(|gap| gap.abs()).fold(outside(scene, map), f64::max)
}

/// How far receivers and casters are outside: infinite for what has no place.
fn outside(scene: &Scene, map: &ShadowMap) -> f64 {
    let place = |q: DVec3| Some(ndc(map, q)).filter(|p| p.is_finite()).unwrap_or(DVec3::NEG_INFINITY);
    let casters = scene.caster_points(map.origin()).into_iter().map(|q| -place(q).z);
    let receivers = scene.receivers(map.origin()).into_iter().map(place);
    let beyond = receivers.map(|p| (p.truncate().abs().max_element() - 1.0).max(-p.z).max(p.z - 1.0));
    beyond.chain(casters).fold(0.0, f64::max)
}

/// Parallel and opposite are the uniform map, exactly, whatever the axes; the map is upright along the camera's up.
#[test]
fn light_parallel_and_opposite_to_the_view() {
    for sign in [1.0, -1.0] {
        let mut scene = frustum(sign * frustum(DVec3::Y).view.forward());
        for axes in [Axes::View, Axes::LightFixed] {
            scene.axes = axes;
            let uniform = solve(&scene, Rule::Uniform);
            assert_eq!(uniform.light_space().sin_gamma.to_bits(), 0);
            for rule in LIGHT_SPACE_RULES {
                assert_eq!(solve(&scene, Rule::LightSpace(rule)), uniform);
            }
            fills(&scene, &uniform);
        }
        scene.axes = Axes::View;
        let space = solve(&scene, Rule::Uniform).light_space();
        assert_abs_diff_eq!(space.z, scene.view.up());
        assert_abs_diff_eq!(space.x, scene.view.up().cross(scene.to_light()));
    }
}

/// Within 1e-12 of the view the sine keeps its digits, and the warp has all but gone; it grows with the angle.
#[test]
fn light_within_1e_12_of_the_view() {
    for sign in [1.0, -1.0] {
        let view = frustum(DVec3::Y).view;
        let mut last = 0.0;
        for tilt in [1e-12, 2e-12, 1e-9] {
            let scene = frustum(sign * view.forward() + view.up() * tilt);
            let map = solve(&scene, Rule::LISPSM);
            let space = map.light_space();
            let exact = scene.view.forward().cross(scene.to_light() - sign * scene.view.forward()).length();
            assert_ulps_eq!(space.sin_gamma, exact, max_ulps = 1, epsilon = 0.0);
            assert_ulps_eq!(space.sin_gamma, tilt, max_ulps = 1, epsilon = 0.0);
            assert_ulps_eq!(space.z.dot(scene.view.forward()), tilt, max_ulps = 1, epsilon = 0.0);
            // d s^2/(2 z_n) is 1e-22 at 1e-12.
            assert!(map.warp().excess() > last && map.warp().excess() < 1e3 * tilt * tilt, "{:?}", map.warp());
            last = map.warp().excess();
            fills(&scene, &map);
        }
    }
}

/// Along the camera's up axis, and within 1e-12 of it, nothing special happens: the strongest warp, `sqrt(far/near)`.
#[test]
fn light_along_up() {
    let mut filled = Ratchet::new("sides of the map");
    let view = frustum(DVec3::Y).view;
    for tilt in [0.0, 1e-12, -1e-12] {
        for sign in [1.0, -1.0] {
            let scene = frustum(sign * view.up() + view.right() * tilt);
            let map = solve(&scene, Rule::LISPSM);
            assert_ulps_eq!(map.warp().ratio(), 200_f64.sqrt(), max_ulps = 1);
            assert_abs_diff_eq!(map.light_space().z, view.forward());
            filled.note(unfilled(&scene, &map), 2e-15, "");
        }
    }
}

/// A frustum as deep as f32 cameras allow: the optimum is `sqrt(1e7)`, and its error equal at both ends.
#[test]
fn far_over_near_of_1e7() {
    let all = box_about(EYE, DVec3::splat(2e6));
    let scene = Scene::new(camera(EYE, FORWARD, 0.1..1e6), DVec3::Y, &[all], all);
    let map = solve(&scene, Rule::LISPSM);
    assert_ulps_eq!(map.warp().ratio(), 1e7_f64.sqrt(), max_ulps = 1);
    let [near, far] = [0.1, 1e6].map(|z| map.texel_extent(EYE + scene.view.forward() * z)[1] / z);
    assert_ulps_eq!(near, far, max_ulps = 1, epsilon = 0.0);
    fills(&scene, &map);
}

/// Infinitely far is as far as the box: the same map as with a far plane behind all of it.
#[test]
fn infinite_far_plane() {
    let ground = box_between(DVec3::new(-500.0, 0.0, -500.0), DVec3::new(500.0, 20.0, 500.0));
    let [open, closed] = [f64::INFINITY, 1e5]
        .map(|far| Scene::new(camera(EYE, FORWARD, 0.1..far), DVec3::new(1.0, 2.0, -0.5), &[ground], ground));
    for rule in LIGHT_SPACE_RULES.map(Rule::LightSpace) {
        let [a, b] = [&open, &closed].map(|scene| matrix(&solve(scene, rule), EYE));
        assert_abs_diff_eq!(a, b, epsilon = f64::EPSILON);
        fills(&open, &solve(&open, rule));
    }
}

/// At 1e7 from the origin the map relative to the eye is the same to the last digits.
#[test]
fn world_coordinates_of_1e7() {
    let shift = DVec3::new(1e7, -2e7, 3e7);
    let bounds = box_between(DVec3::new(-40.0, 0.0, -60.0), DVec3::new(40.0, 15.0, 70.0));
    let far_bounds = Bounds::new(bounds.min() + shift, bounds.max() + shift).unwrap();
    let to_light = DVec3::new(1.0, 2.0, -0.5);
    let scene = Scene::new(camera(EYE, FORWARD, 0.5..200.0), to_light, &[bounds], bounds);
    let moved = Scene::new(camera(EYE + shift, FORWARD, 0.5..200.0), to_light, &[far_bounds], far_bounds);
    let map = solve(&moved, Rule::LISPSM);
    // Both are exact inputs, so that even the bits agree.
    assert_eq!(matrix(&map, EYE + shift), matrix(&solve(&scene, Rule::LISPSM), EYE));
    fills(&moved, &map);
}

/// Tiny and huge bodies are the same map, scaled.
#[test]
fn bodies_of_1e_6_and_1e12() {
    let unit = box_between(DVec3::new(-1.0, -0.5, 4.0), DVec3::new(1.5, 0.75, 7.0));
    let to_light = DVec3::new(1.0, 2.0, -0.5);
    let solved = |scale: f64| {
        let bounds = Bounds::new(unit.min() * scale, unit.max() * scale).unwrap();
        let view = camera(DVec3::ZERO, DVec3::Z, scale..100.0 * scale);
        let scene = Scene::new(view, to_light, &[bounds], bounds);
        let map = solve(&scene, Rule::LISPSM);
        fills(&scene, &map);
        map
    };
    let one = solved(1.0);
    // Powers of two next to 1e-6 and 1e12, so that scaling rounds nothing.
    for scale in [1.0 / f64::from(1 << 20), f64::from(1 << 20) * f64::from(1 << 20)] {
        let map = solved(scale);
        let point = DVec3::new(0.25, -0.125, 5.5);
        assert_eq!(map.warp(), one.warp());
        assert_eq!(ndc(&map, (point - unit.min()) * scale), ndc(&one, point - unit.min()));
    }
    // A tiny body far from the eye keeps its own digits.
    for (distance, size) in [(8.0, 1e-6), (1e7, 1.0)] {
        let bounds = box_about(DVec3::Z * distance, DVec3::splat(0.5 * size));
        let scene = Scene::new(camera(DVec3::ZERO, DVec3::Z, 0.1..1e9), to_light, &[bounds], bounds);
        fills(&scene, &solve(&scene, Rule::LISPSM));
    }
}

/// A floor, a pole and a point have a map, which contains them.
#[test]
fn flat_line_and_point_boxes() {
    let centre = DVec3::new(9.0, 4.0, 6.0);
    for half in [DVec3::new(3.0, 0.0, 2.0), DVec3::new(0.0, 1.0, 0.0), DVec3::ZERO] {
        for to_light in [DVec3::Y, DVec3::new(1.0, 0.0, 0.0), DVec3::new(1.0, 2.0, -0.5), FORWARD] {
            let bounds = box_about(centre, half);
            let mut scene = Scene::new(camera(EYE, FORWARD, 0.5..100.0), to_light, &[bounds], bounds);
            for axes in [Axes::View, Axes::LightFixed] {
                scene.axes = axes;
                let map = solve(&scene, Rule::LISPSM);
                inside(&scene, &map);
                if half == DVec3::ZERO {
                    let middle = project(matrix(&map, centre) * DVec3::ZERO.extend(1.0));
                    assert_abs_diff_eq!(middle.truncate(), DVec2::ZERO);
                }
            }
        }
    }
    // A floor seen along itself is a line in the map: across it the map is as wide as 2^-20 of its length.
    let floor = box_about(centre, DVec3::new(3.0, 0.0, 2.0));
    let scene = Scene::new(camera(EYE, FORWARD, 0.5..100.0), DVec3::X, &[floor], floor);
    let [thin, long] = solve(&scene, Rule::Uniform).texel_extent(centre);
    let ratio = thin.min(long) / thin.max(long);
    assert!((0.5e-6..2e-6).contains(&ratio), "{ratio:e}");
}

/// A point far from the origin that its body was given.
#[test]
fn points_far_from_their_origin() {
    let point = DVec3::new(1e9, 0.0, 0.0);
    let bounds = box_about(point, DVec3::ZERO);
    let mut scene =
        Scene::new(camera(point - DVec3::X, DVec3::X, 0.5..10.0), DVec3::new(1.0, 2.0, 0.5), &[bounds], bounds);
    scene.bodies = vec![Body::from_box(&bounds, DVec3::ZERO).unwrap()];
    inside(&scene, &solve(&scene, Rule::LISPSM));
    assert!(scene.fit().linear_depth(point).unwrap().is_finite());
}

/// Planes of the view through vertices and along faces of the box, and a far plane on a face.
#[test]
fn planes_through_vertices() {
    // 90 degrees: the sides go through the corners of a cube in front.
    let view = View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, std::f64::consts::FRAC_PI_2, 1.0, 1.0..3.0).unwrap();
    let volume = |bounds: &Bounds| Body::visible(&view, bounds).volume();
    let cube = box_between(DVec3::new(-1.0, -1.0, 1.0), DVec3::new(1.0, 1.0, 3.0));
    let whole = box_between(DVec3::new(-3.0, -3.0, 1.0), DVec3::new(3.0, 3.0, 3.0));
    let touching = box_between(DVec3::new(-1.0, -1.0, 3.0), DVec3::new(1.0, 1.0, 5.0));
    let beside = box_between(DVec3::new(3.0, -3.0, 1.0), DVec3::new(4.0, 3.0, 3.0));
    for (bounds, expected) in [(cube, 8.0), (whole, 104.0 / 3.0), (touching, 0.0), (beside, 0.0)] {
        assert_ulps_eq!(volume(&bounds), expected, max_ulps = 2);
    }
    for bounds in [cube, whole] {
        let scene = Scene::new(view, DVec3::new(0.0, 1.0, 0.25), &[bounds], bounds);
        fills(&scene, &solve(&scene, Rule::LISPSM));
    }
    // What only touches the far plane is flat, and still a receiver.
    let scene = Scene::new(view, DVec3::Y, &[touching], touching);
    inside(&scene, &solve(&scene, Rule::LISPSM));
}

/// The eye inside the box: the body begins at the near plane, not at the eye.
#[test]
fn eye_inside_the_box() {
    let scene = frustum(DVec3::Y);
    let map = solve(&scene, Rule::LISPSM);
    assert_eq!(map.origin(), EYE);
    assert_ulps_eq!(map.w(EYE + scene.view.forward() * 0.5), 1.0, max_ulps = 2);
    assert!(map.w(EYE) > 0.0 && map.w(EYE) < 1.0);
    fills(&scene, &map);
}

/// A telescope and an extreme fisheye's tangent.
#[test]
fn fields_of_view_of_a_thousandth_and_of_179_9_degrees() {
    let mut volumes = Ratchet::new("volume");
    let mut filled = Ratchet::new("sides of the map");
    for degrees in [0.001_f64, 179.9] {
        let tangent = (0.5 * degrees).to_radians().tan();
        let view = View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, degrees.to_radians(), 1.0, 1.0..100.0).unwrap();
        let all = box_about(DVec3::ZERO, DVec3::splat(100.0 * tangent.max(1.0)));
        for to_light in [DVec3::Y, DVec3::new(0.5, 1.0, 0.25)] {
            let scene = Scene::new(view, to_light, &[all], all);
            let volume = scene.bodies[0].volume();
            let exact = 4.0 * tangent * tangent * (1e6 - 1.0) / 3.0;
            volumes.note((volume / exact - 1.0).abs(), 2e-11, degrees);
            for rule in [Rule::Uniform, Rule::LISPSM] {
                filled.note(unfilled(&scene, &solve(&scene, rule)), 4e-15, rule);
            }
        }
    }
}

/// Off-centre: the warp projects about the eye where the eye is abreast of the body, else about the body's side.
#[test]
fn off_centre_cameras() {
    let all = box_about(EYE, DVec3::splat(150.0));
    for (left, right) in [(-0.2, 0.9), (0.4, 1.4)] {
        let sides = Sides { left, right, bottom: -0.5, top: 0.5 };
        let view = View::perspective_off_centre(EYE, FORWARD, DVec3::Y, sides, 0.5..100.0).unwrap();
        let scene = Scene::new(view, DVec3::Y, &[all], all);
        let map = solve(&scene, Rule::LISPSM);
        fills(&scene, &map);
        // The line through the centre of projection is upright in the map.
        let aside = left.max(0.0) * 0.5;
        let x = |z: f64| ndc(&map, view.right() * aside + view.forward() * z + EYE - map.origin()).x;
        assert_abs_diff_eq!(x(1.0), x(50.0), epsilon = 2.0 * f64::EPSILON);
    }
}

/// Orthographic cameras see all depths at one scale: no published rule warps, and the worst texel is the largest.
#[test]
fn orthographic_cameras() {
    let all = box_about(EYE, DVec3::splat(300.0));
    for near in [-30.0, 0.5] {
        let view = View::orthographic(EYE, FORWARD, DVec3::Y, Sides::centred(40.0, 20.0), near..100.0).unwrap();
        let scene = Scene::new(view, DVec3::new(0.2, 1.0, 0.0), &[all], all);
        assert_ulps_eq!(scene.bodies[0].volume(), 40.0 * 20.0 * (100.0 - near), max_ulps = 4);
        let uniform = solve(&scene, Rule::Uniform);
        fills(&scene, &uniform);
        for rule in LIGHT_SPACE_RULES {
            assert_eq!(solve(&scene, Rule::LightSpace(rule)), uniform);
        }
        let fit = Fit { viewport: [400, 100], ..scene.fit() };
        let [s, t] = uniform.texel_extent(EYE);
        assert_ulps_eq!(fit.worst_texel(&uniform), 10.0 * s.max(t), max_ulps = 1, epsilon = 0.0);
        let warped = solve(&scene, Rule::Explicit(Warp::new(3.0).unwrap()));
        fills(&scene, &warped);
    }
}

/// A mirror turns the picture over, not the volume.
#[test]
fn mirrored_cameras() {
    let mut scene = frustum(DVec3::new(1.0, 2.0, -0.5));
    let before = matrix(&solve(&scene, Rule::LISPSM), EYE);
    scene = Scene::new(scene.view.mirrored(), scene.to_light(), &scene.boxes, scene.casters);
    assert_abs_diff_eq!(before, matrix(&solve(&scene, Rule::LISPSM), EYE), epsilon = f64::EPSILON);
}

/// A box much larger than the view, as of one who does not know the scene's bounds: the receivers are the view
/// volume, to its own digits.
#[test]
fn boxes_that_hold_everything() {
    let mut volumes = Ratchet::new("volume");
    let scene = |size: f64| {
        let all = box_about(EYE, DVec3::splat(size));
        Scene::new(camera(EYE, FORWARD, 0.5..100.0), DVec3::Y, &[all], box_about(EYE, DVec3::splat(150.0)))
    };
    let [plain, huge, vast] = [150.0, 1e9, 1e30].map(scene);
    for large in [huge, vast] {
        let volume = |scene: &Scene| scene.bodies[0].volume();
        volumes.note((volume(&large) / volume(&plain) - 1.0).abs(), 1e-15, large.boxes[0]);
        let [a, b] = [&plain, &large].map(|scene| matrix(&solve(scene, Rule::LISPSM), EYE));
        assert_abs_diff_eq!(a, b, epsilon = f64::EPSILON);
    }
}

/// A lamp post and a speck above large receivers: casters without width stand in the map like others.
#[test]
fn casters_without_width() {
    let ground = box_between(DVec3::ZERO, DVec3::splat(10.0));
    let view = camera(DVec3::new(5.0, 3.0, -10.0), DVec3::new(0.1, -0.2, 1.0), 0.1..100.0);
    let input = ([signed(), signed()], [signed(), signed()], unit());
    check("hard-cases/casters-without-width", 200, input, |([slope_x, slope_z], [x, z], height)| {
        let to_light = DVec3::new(0.3 * slope_x, 1.0, 0.3 * slope_z);
        let above = DVec3::new(5.0 + 2.0 * x, 5.0, 5.0 + 2.0 * z);
        let foot = above + to_light * (10.0 + 5.0 * height);
        for half in [DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::new(0.5, 0.0, 0.5)] {
            let map = solve(&Scene::new(view, to_light, &[ground], box_about(foot, half)), Rule::LISPSM);
            let p = project(matrix(&map, foot) * DVec3::ZERO.extend(1.0));
            assert!(p.x.abs() < 1.0 && p.y.abs() < 1.0 && p.z >= -4.0 * f64::EPSILON, "{half}: {p}");
        }
    });
}

/// Where the light is almost along a face of the casters' box, the highest caster is at the crossing of two faces.
#[test]
fn light_almost_along_the_casters_box() {
    for tilt in [1e-7, 1e-8, 1e-9, 1e-11] {
        let ground = box_between(DVec3::new(-4.0, -1.0, 5.0), DVec3::new(5.0, 0.0, 17.0));
        let casters = box_between(DVec3::new(-1.3, -1.0, 4.0), DVec3::new(6.0, 7.0, 15.7));
        let view = camera(DVec3::new(0.0, 3.0, 0.0), DVec3::new(0.0, -0.2, 1.0), 0.1..100.0);
        let scene = Scene::new(view, DVec3::new(-0.7 * tilt, 1.0, 1.2 * tilt), &[ground], casters);
        let map = solve(&scene, Rule::Uniform);
        let above = extent(scene.caster_points(map.origin()).iter().map(|q| ndc(&map, *q).z))[0];
        assert_abs_diff_eq!(above, 0.0, epsilon = 2.0 * f64::EPSILON);
    }
}

/// Behind, beside, before the near plane and beyond the far one.
#[test]
fn nothing_visible() {
    let view = camera(DVec3::ZERO, DVec3::Z, 1.0..10.0);
    for centre in [DVec3::Z * -5.0, DVec3::X * 50.0, DVec3::Z * 0.5, DVec3::Z * 20.0] {
        let bounds = box_about(centre, DVec3::splat(0.25));
        let scene = Scene::new(view, DVec3::Y, &[bounds; 2], bounds);
        assert_eq!(scene.fit().solve(Rule::LISPSM), Err(Error::NothingVisible));
    }
    // One body that is seen among some that are not.
    let [hidden, seen] = [-5.0, 5.0].map(|z| box_about(DVec3::Z * z, DVec3::splat(0.25)));
    let scene = Scene::new(view, DVec3::Y, &[hidden, seen, hidden], seen);
    fills(&scene, &solve(&scene, Rule::LISPSM));
}
