//! Where a perspective shadow map looks, and how far its camera is moved back.

use crate::perspective::{plain, rule, tangents, unsupported};
use crate::scenes::moderate;
use crate::scenes::random::Random;
use crate::{CASES, Worst};
use shadow_warp::glam::DVec3;
use shadow_warp::{Aim, Error, Lens, PerspectiveRule, Rule};

/// Where the middle of the cube can be aimed at: where the light is further from it than any corner is, seen along its
/// direction.
#[test]
fn the_middle_is_aimed_at_only_where_all_lies_before_the_light() {
    let mut random = Random::new(32);
    let (mut refused, mut accepted) = (0, 0);
    for case in 0..CASES {
        let far = random.log_between(2.0, 1e4);
        let [x, y] = tangents(&mut random);
        let sun = DVec3::new(random.between(-3.0, 3.0), random.between(-3.0, 3.0), random.between(-3.0, 3.0));
        let scene = plain(1.0, far, [x, y], sun);
        let [r_x, r_y, r_z] = [sun.x / sun.z / x, sun.y / sun.z / y, (far + 1.0) / (far - 1.0)].map(f64::abs);
        let least = (r_x * r_x + r_y * r_y + r_z * r_z) / (r_x + r_y + r_z) - 1.0;
        if least.abs() < 1e-4 {
            continue;
        }
        let found = scene.fit().solve(rule(Aim::Centre, 0.0));
        if least > 0.0 {
            accepted += 1;
            found.unwrap();
        } else {
            refused += 1;
            assert!(unsupported(&found), "{case} {least}");
        }
        scene.fit().solve(Rule::PSM).unwrap();
    }
    assert!(refused > 100 && accepted > 100, "{refused} {accepted}");
}

/// `-2 f n (f + n)/(f - n)^2 tan^2 theta/tan^2 gamma`, seen from the eye, for the middle aimed at.
#[test]
fn pole_on_the_line_of_sight() {
    let mut worst = Worst::new("pole of a perspective map");
    let mut random = Random::new(33);
    for case in 0..CASES {
        let near: f64 = random.log_between(1e-3, 10.0);
        let far = near * random.log_between(1.5, 1e6);
        let [x, y] = tangents(&mut random);
        // Across an axis of the picture, outside of it.
        let slope = random.log_between(2.5, 1e3) * [1.0, -1.0][random.below(2)];
        let sun = [DVec3::new(slope * x, 0.0, 1.0), DVec3::new(0.0, slope * y, 1.0)][random.below(2)];
        let sun = sun * [1.0, -1.0][random.below(2)];
        // And with the camera moved back, by its depths from there.
        let shift = if random.below(2) == 0 { 0.0 } else { near * random.log_between(0.01, 100.0) };
        let map = plain(near, far, [x, y], sun).fit().solve(rule(Aim::Centre, shift)).unwrap();
        let [at_near, at_far] = [near, far].map(|z| map.w(DVec3::Z * z));
        // How far it lies before the near plane, as the map's numbers have it.
        let before = (far - near) * at_near / (at_far - at_near);
        let (n, f, cotangent) = (near + shift, far + shift, 1.0 / slope);
        let pole = -2.0 * f * n * (f + n) / ((f - n) * (f - n)) * cotangent * cotangent;
        worst.note((before / (n - pole) - 1.0).abs(), 1e-12, (case, before, n - pole));
    }
}

/// The camera moved back by the least shift has the body in its volume, touching it; by less it has not.
#[test]
fn least_shift_holds_the_body() {
    let mut random = Random::new(34);
    let mut moved = 0;
    for case in 0..CASES {
        let (scene, _) = moderate(case);
        let body = &scene.bodies[0];
        let (view, Lens::Perspective(sides)) = (&scene.view, scene.view.lens()) else { continue };
        // What can cast a shadow on it reaches out of the view.
        let Some(casters) = Some(body.casters(&scene.light, &scene.casters).unwrap()).filter(|c| !c.is_empty()) else {
            continue;
        };
        let found = PerspectiveRule::least_shift(view, &casters);
        if sides.left.max(sides.bottom) >= 0.0 || sides.right.min(sides.top) <= 0.0 {
            assert!(matches!(found, Err(Error::Unsupported { .. })), "{case}");
            continue;
        }
        let shift = found.unwrap();
        let beyond = |shift: f64| {
            let q = |v: &DVec3| *v + (casters.origin() - view.eye()) + view.forward() * shift;
            let planes = |q: DVec3| {
                let [x, y, z] = [view.right(), view.up(), view.forward()].map(|axis| axis.dot(q));
                let across = (x - sides.right * z) / sides.right;
                let over = (y - sides.top * z) / sides.top;
                let [left, below] = [(sides.left * z - x) / -sides.left, (sides.bottom * z - y) / -sides.bottom];
                across.max(over).max(left).max(below).max(view.near() - z)
            };
            casters.vertices().iter().map(|v| planes(q(v))).fold(f64::NEG_INFINITY, f64::max)
        };
        let size = casters.vertices().iter().fold(shift, |s, v| s.max(v.length())) + casters.origin().length();
        let narrow = 1.0 + 1.0 / sides.right.min(sides.top).min(-sides.left).min(-sides.bottom);
        let allowed = 1e-14 * size * narrow;
        assert!(beyond(shift) <= allowed, "{case} {shift} {}", beyond(shift));
        if shift > 10.0 * allowed {
            moved += 1;
            assert!(beyond(shift).abs() <= allowed, "{case} {shift} {}", beyond(shift));
            assert!(beyond(shift * random.unit()) > -allowed, "{case}");
        }
    }
    assert!(moved > 300, "{moved}");
}
