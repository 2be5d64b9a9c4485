//! Bodies and depths that were wrong once, with the numbers that they were found at.
#![expect(clippy::unwrap_used, reason = "input that is not valid must stop the test")]

mod oracle;
mod random;

use oracle::{EPS, HalfSpaces, assert_closed};
use proptest::prelude::*;
use random::basic::{direction, inside, log_between, unit};
use random::{Ratchet, check};
use shadow_warp::glam::{DVec3, dvec3};
use shadow_warp::{Body, Bounds, ClipSpace, ConvexBody, Fit, Lens, Light, Plane, Rule, ShadowMap, Sides, View};

fn cube() -> Bounds {
    Bounds::new(DVec3::NEG_ONE, DVec3::ONE).unwrap()
}

/// Depth of a point relative to the map's origin: 0 at the near plane.
fn depth(map: &ShadowMap, p: DVec3) -> f64 {
    let q = map.clip_from_world_at(map.origin(), ClipSpace::WGPU) * p.extend(1.0);
    q.z / q.w
}

/// A flat body cut three times through one edge: two of its vertices were left 0.08 beyond the last
/// plane.
#[test]
fn a_flat_body_with_three_planes_through_an_edge_is_cut_clean() {
    #[rustfmt::skip]
    let planes = [
        ([0.30138039210686635, 0.19613512272391878, 0.9331135369758522], [0.21223258413746415, 0.21088106604932083, -0.022056885823619282]),
        ([-0.30138039210686635, -0.19613512272391878, -0.9331135369758522], [0.21223258413746415, 0.21088106604932083, -0.022056885823619282]),
        ([-2.075376899115831, 2.187605802257158, 0.21049053876589513], [-1.0, -1.0, 0.6239946546775264]),
        ([-2.0753768991158306, 2.1876058022571576, 0.21049053876589507], [-1.0, -1.0, 0.6239946546775262]),
        ([-0.23059743323509224, 0.2430673113619064, 0.02338783764065499], [-1.0, -1.0, 0.6239946546775264]),
        ([-0.052288191034688916, 1.3400229220767033, -0.2647769161708978], [-0.9689922480620156, -0.9689922480620156, 0.6074620066578985]),
    ];
    let mut body = ConvexBody::<64, 34>::from_box(&cube(), DVec3::ZERO).unwrap();
    let mut oracle = HalfSpaces::of_box(&cube(), DVec3::ZERO);
    for (normal, point) in planes {
        let plane = Plane::new(DVec3::from(normal), DVec3::from(point)).unwrap();
        body.cut(&plane).unwrap();
        oracle.add(&plane);
        assert!(!body.is_empty() && assert_closed(&body).greatest() <= 8.0 * EPS);
        assert!(body.vertices().iter().all(|p| oracle.beyond(*p) <= 8.0 * EPS));
    }
}

/// A flat floor, and a plane along it that differs by rounding alone: nothing of the floor is lost.
#[test]
fn a_plane_along_a_flat_body_takes_none_of_it() {
    check("body_regressions/floor", 2000, (direction(), 0.5..2.0, any::<bool>()), |(tilt, height, keep)| {
        let floor = Bounds::new(dvec3(-400.0, height, -400.0), dvec3(400.0, height, 400.0)).unwrap();
        let mut body = Body::from_box(&floor, DVec3::ZERO).unwrap();
        let normal = if keep { DVec3::Y } else { DVec3::NEG_Y } + 2e-16 * tilt;
        body.cut(&Plane::new(normal, DVec3::Y * height).unwrap()).unwrap();
        assert_closed(&body);
        for corner in [[-400.0, -400.0], [-400.0, 400.0], [400.0, -400.0], [400.0, 400.0]] {
            assert!(body.vertices().contains(&dvec3(corner[0], height, corner[1])), "{corner:?}");
        }
    });
}

/// Light that slides along a side of the casters' box, and receivers on that side: a wall that
/// stands there shadows them. By the last bit the ray left the box anywhere between the receivers
/// and the top.
#[test]
fn a_wall_on_the_side_of_the_box_is_a_caster() {
    let casters = Bounds::new(DVec3::ZERO, dvec3(1.0, 2.0, 1.0)).unwrap();
    let view =
        View::orthographic(dvec3(0.5, 0.5, -1.0), DVec3::Z, DVec3::Y, Sides::centred(4.0, 4.0), 0.0..4.0).unwrap();
    for tilt in [3e-16, 1e-15, -1e-15, 1e-13, 0.0] {
        for low in [1.0, 1.0 - EPS / 2.0, 1.0 - EPS] {
            let seen = Bounds::new(dvec3(low, 0.0, 0.0), dvec3(1.0, 0.25, 1.0)).unwrap();
            let bodies = [Body::visible(&view, &seen)];
            let light = Light::directional(dvec3(tilt, 1.0, 0.0)).unwrap();
            let map = Fit::new(&view, &light, &casters, &bodies).solve(Rule::Uniform).unwrap();
            // Where that wall rises before the light has left it by more than rounding.
            let wall = if tilt > 1e-14 { 0.25 + 4.0 * EPS / tilt } else { 2.0 };
            let top = depth(&map, dvec3(1.0, wall.min(2.0), 0.5) - map.origin());
            assert!(top >= -1e-12, "{top:e} for a light tilted by {tilt:e}, from {low}");
            // And no depth is given away: a sixteenth of 2 at most.
            assert!(depth(&map, dvec3(1.0, 2.2, 0.5) - map.origin()) < 0.0, "{tilt:e}");
        }
    }
}

/// Boxes of casters without end give the depths of the finite box that does the same.
#[test]
fn casters_without_end_have_finite_depths() {
    let view = View::perspective(dvec3(0.0, 2.0, 0.0), dvec3(1.0, -0.1, 0.3), DVec3::Y, 1.0, 1.5, 0.1..1000.0).unwrap();
    let scene = Bounds::new(dvec3(-500.0, 0.0, -500.0), dvec3(500.0, 50.0, 500.0)).unwrap();
    let bodies = [Body::visible(&view, &scene)];
    let between = |low: DVec3, high: DVec3| Bounds::new(low, high).unwrap();
    let suns = [DVec3::Y, dvec3(0.3, 1.0, 0.2), dvec3(1e-15, 1.0, 0.0), dvec3(1.0, 1e-10, 0.0), DVec3::X];
    for (size, sun) in [1e6, 1e18, 1e100].into_iter().flat_map(|size| suns.map(|sun| (size, sun))) {
        let light = Light::directional(sun).unwrap();
        let solve = |casters: &Bounds| Fit::new(&view, &light, casters, &bodies).solve(Rule::Uniform).unwrap();
        let to_light = light.homogeneous().truncate();
        for casters in [
            between(DVec3::splat(-size), DVec3::splat(size)),
            between(scene.min(), scene.max().with_y(size)),
            between(DVec3::splat(-size).with_y(60.0), DVec3::splat(size)),
            between(dvec3(0.0, 60.0, -size), DVec3::splat(size)),
            between(DVec3::splat(-size), DVec3::splat(size).with_y(-10.0)),
        ] {
            let map = solve(&casters);
            let rows = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
            assert!(rows.is_finite(), "{size:e} {sun}");
            // What is highest lies where rays leave the box, to a rounding of that distance.
            let space = HalfSpaces::of_box(&casters, map.origin());
            for p in bodies[0].vertices() {
                let ends = [0, 1, 2].map(|axis| {
                    let l = to_light[axis];
                    if l == 0.0 {
                        f64::INFINITY
                    } else {
                        (if l > 0.0 { space.high[axis] } else { space.low[axis] } - p[axis]) / l
                    }
                });
                let last = ends.into_iter().fold(f64::INFINITY, f64::min);
                let caster = *p + to_light * last.max(0.0);
                if space.beyond(caster) <= 0.0 {
                    assert!(depth(&map, caster) >= -1e-12, "{size:e} {sun}: {:e}", depth(&map, caster));
                }
            }
        }
        // A layer without end, against one that is no larger than it must be.
        if sun.y > 0.5 {
            let (wide, near) = (
                between(DVec3::splat(-size).with_y(60.0), DVec3::splat(size).with_y(100.0)),
                between(dvec3(-2e3, 60.0, -2e3), dvec3(2e3, 100.0, 2e3)),
            );
            let (wide, near) = (solve(&wide), solve(&near));
            // To the bit.
            let matrix = |map: &ShadowMap| map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
            assert_eq!(matrix(&wide), matrix(&near), "{size:e} {sun}");
        }
    }
}

/// Views that are one or a few units in the last place deep, in any place and direction: their
/// corners are receivers, and in the map. The body of such a view was cut away whole, or lost
/// corners.
#[test]
fn views_one_ulp_deep_lose_nothing() {
    let strategy = (
        (inside(400.0), direction(), log_between(0.01, 300.0), 1_u64..30),
        (any::<bool>(), direction(), unit(), 0_usize..3),
    );
    let mut seen = 0;
    let mut ratchet = Ratchet::new("a corner outside of the map");
    check("body_regressions/one_ulp", 4000, strategy, |((eye, forward, near, ulps), (flat, sun, turn, rule))| {
        let far = f64::from_bits(near.to_bits() + ulps);
        let up = if forward.y.abs() > 0.9 { DVec3::X } else { DVec3::Y };
        let view = if flat {
            View::orthographic(eye, forward, up, Sides::centred(20.0, 10.0 + turn), near..far)
        } else {
            View::perspective(eye, forward, up, 0.5 + turn, 1.5, near..far)
        }
        .unwrap();
        let bounds = Bounds::new(DVec3::splat(-1000.0), DVec3::splat(1000.0)).unwrap();
        let bodies = [Body::visible(&view, &bounds)];
        assert_closed(&bodies[0]);
        let (Lens::Perspective(sides) | Lens::Orthographic(sides)) = view.lens();
        let light = Light::directional(sun).unwrap();
        let mut corners = Vec::new();
        for (x, y) in
            [(sides.left, sides.bottom), (sides.left, sides.top), (sides.right, sides.bottom), (sides.right, sides.top)]
        {
            let slope = if flat { 1.0 } else { near };
            corners.push(eye + view.forward() * near + (view.right() * x + view.up() * y) * slope);
        }
        corners.retain(|p| p.abs().max_element() < 999.0);
        if corners.is_empty() {
            return;
        }
        assert!(!bodies[0].is_empty(), "nothing of {near:e} to {far:e}");
        let rule = [Rule::Uniform, Rule::LISPSM, Rule::OPTIMAL][rule];
        let map = Fit::new(&view, &light, &bounds, &bodies).solve(rule).unwrap();
        for p in corners {
            let q = map.clip_from_world_at(map.origin(), ClipSpace::WGPU) * (p - map.origin()).extend(1.0);
            let n = q.truncate() / q.w;
            let outside = (n.x.abs() - 1.0).max(n.y.abs() - 1.0).max(-n.z).max(n.z - 1.0);
            // The corner is known to a rounding of the box, the map to that of its least extent.
            ratchet.note(outside, 4e-9, (near, ulps, rule));
            seen += 1;
        }
    });
    assert!(seen > 5000, "{seen}");
    println!("{seen} corners");
    ratchet.finish();
}
