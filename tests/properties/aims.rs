//! Where a perspective shadow map looks, and how far its camera is moved back.

use crate::CASES;
use crate::perspective::{plain, rule, tangents, unsupported};
use crate::random::basic::{inside, log_between, unit};
use crate::random::scenes::each_kind;
use crate::random::{Ratchet, check};
use proptest::option::weighted;
use proptest::prelude::*;
use shadow_warp::glam::DVec3;
use shadow_warp::{Aim, Error, Lens, PerspectiveRule, Rule};

/// Where the middle of the cube can be aimed at: where the light is further from it than any corner
/// is, seen along its direction.
#[test]
fn the_middle_is_aimed_at_only_where_all_lies_before_the_light() {
    let (mut refused, mut accepted) = (0, 0);
    let strategy = (log_between(2.0, 1e4), tangents(), inside(3.0));
    check("aim-at-centre", 4 * CASES, strategy, |(far, [x, y], sun)| {
        let scene = plain(1.0, far, [x, y], sun);
        let [r_x, r_y, r_z] = [sun.x / sun.z / x, sun.y / sun.z / y, (far + 1.0) / (far - 1.0)].map(f64::abs);
        let least = (r_x * r_x + r_y * r_y + r_z * r_z) / (r_x + r_y + r_z) - 1.0;
        // Too near to call; and a light at no distance is none.
        if least.abs() < 1e-4 || sun.length() < 1e-3 || sun.z.abs() < 1e-9 {
            return;
        }
        let found = scene.fit().solve(rule(Aim::Centre, 0.0));
        if least > 0.0 {
            accepted += 1;
            found.unwrap();
        } else {
            refused += 1;
            assert!(unsupported(&found), "{least}");
        }
        scene.fit().solve(Rule::PSM).unwrap();
    });
    assert!(refused > 40 && accepted > 40, "{refused} {accepted}");
}

/// `-2 f n (f + n)/(f - n)^2 tan^2 theta/tan^2 gamma`, seen from the eye, for the middle aimed at.
#[test]
fn pole_on_the_line_of_sight() {
    let mut worst = Ratchet::new("pole of a perspective map");
    // Across an axis of the picture, outside of it; and with the camera moved back, by its depths
    // from there.
    let sun = (log_between(2.5, 1e3), any::<[bool; 3]>());
    let shift = weighted(0.5, log_between(0.01, 100.0));
    let strategy = (log_between(1e-3, 10.0), log_between(1.5, 1e6), tangents(), sun, shift);
    check("pole", 4 * CASES, strategy, |(near, far, [x, y], (slope, [negative, upright, behind]), shift)| {
        let (far, shift) = (near * far, near * shift.unwrap_or(0.0));
        let slope = if negative { -slope } else { slope };
        let sun = if upright { DVec3::new(0.0, slope * y, 1.0) } else { DVec3::new(slope * x, 0.0, 1.0) };
        let sun = if behind { -sun } else { sun };
        let map = plain(near, far, [x, y], sun).fit().solve(rule(Aim::Centre, shift)).unwrap();
        let [at_near, at_far] = [near, far].map(|z| map.w(DVec3::Z * z));
        // How far it lies before the near plane, as the map's numbers have it.
        let before = (far - near) * at_near / (at_far - at_near);
        let (n, f, cotangent) = (near + shift, far + shift, 1.0 / slope);
        let pole = -2.0 * f * n * (f + n) / ((f - n) * (f - n)) * cotangent * cotangent;
        // The difference of the two w is small where the pole is far away.
        let allowed = 2e-14 + 2.0 * f64::EPSILON * before.abs() / (far - near);
        worst.note((before / (n - pole) - 1.0).abs(), allowed, (before, n - pole));
    });
    worst.finish();
}

/// The camera moved back by the least shift has the body in its volume, touching it; by less it has
/// not.
#[test]
fn least_shift_holds_the_body() {
    let mut worst = Ratchet::new("least shift");
    let mut moved = 0;
    each_kind("least-shift", 2 * CASES, unit(), |scene, _, share| {
        let body = &scene.bodies[0];
        let (view, Lens::Perspective(sides)) = (&scene.view, scene.view.lens()) else { return };
        // What can cast a shadow on it reaches out of the view.
        let Some(casters) = Some(body.casters(&scene.light, &scene.casters).unwrap()).filter(|c| !c.is_empty()) else {
            return;
        };
        let found = PerspectiveRule::least_shift(view, &casters);
        if sides.left.max(sides.bottom) >= 0.0 || sides.right.min(sides.top) <= 0.0 {
            assert!(matches!(found, Err(Error::Unsupported { .. })));
            return;
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
        let allowed = 4.0 * f64::EPSILON * size * narrow;
        worst.note(beyond(shift), allowed, shift);
        if shift > 10.0 * allowed {
            moved += 1;
            worst.note(beyond(shift).abs(), allowed, shift);
            assert!(beyond(shift * share) > -allowed, "{shift}");
        }
    });
    worst.finish();
    assert!(moved > 300, "{moved}");
}
