//! The frame and the excess.

use crate::CASES;
use crate::random::basic::log_between;
use crate::random::measure::{LIGHT_SPACE_RULES, Scene, box_about};
use crate::random::scenes::{Kind, each_kind, moderate, rule};
use crate::random::{Ratchet, check};
use proptest::prelude::*;
use shadow_warp::glam::DVec3;
use shadow_warp::{Axes, ClipSpace, LightSpace, Rule, Sides, Slab, View};

/// LSP-6.
#[test]
fn axes_are_orthonormal() {
    let mut worst = Ratchet::new("LSP-6");
    each_kind("LSP-6", CASES, Just(()), |scene, _, ()| {
        let space = LightSpace::new(&scene.view, &scene.light).unwrap();
        let LightSpace { x, y, z, sin_gamma } = space;
        let [x_fixed, z_fixed] = space.fixed_axes();
        for [x, y, z] in [[x, y, z], [x_fixed, y, z_fixed]] {
            for (product, expected) in [(x.dot(x), 1.0), (y.dot(y), 1.0), (z.dot(z), 1.0)] {
                worst.note((product - expected).abs(), 3.3e-15, &scene);
            }
            worst.note(x.dot(y).abs().max(y.dot(z).abs()).max(z.dot(x).abs()), 3.3e-15, &scene);
            worst.note((y.cross(x) - z).length(), 3.3e-15, &scene);
        }
        assert_eq!(y, scene.to_light());
        let v = scene.view.forward();
        if sin_gamma > 0.0 {
            worst.note((z.dot(v) - sin_gamma).abs(), 3.3e-15, &scene);
            worst.note(x.dot(v).abs(), 3.3e-15, &scene);
        }
    });
    worst.finish();
}

/// LSP-21: relative steps of 1e-6 in the sine change the excess by as much, or for the damped rule
/// by twice as much.
#[test]
fn excess_is_continuous() {
    let mut worst = Ratchet::new("LSP-21");
    let sine = prop_oneof![Just(1.0 - 2e-6), log_between(1e-12, 1.0 - 2e-6)];
    let strategy = (log_between(1e-4, 1e2), log_between(1.0 + 1e-9, 1e7), log_between(1e-6, 1e7), sine);
    check("LSP-21", 20 * CASES, strategy, |(near, far, extent, sin_gamma)| {
        let slab = Slab { near, far: near * far, extent: near * extent, sin_gamma };
        for rule in LIGHT_SPACE_RULES {
            let (a, b) = (rule.excess(&slab), rule.excess(&Slab { sin_gamma: slab.sin_gamma * (1.0 + 1e-6), ..slab }));
            let step = if rule == shadow_warp::LightSpaceRule::Damped { 2e-6 } else { 1e-6 };
            assert!(b >= a, "{rule:?} {slab:?}");
            worst.note(b / a - 1.0, step * (1.0 + 1e-5), rule);
            // `ViewDepth` alone looks at the far depth.
            let bound = slab.extent * slab.sin_gamma / (2.0 * slab.near);
            assert!(a > 0.0 && a <= bound * (1.0 + 1e-15), "{rule:?} {slab:?} {a}");
        }
    });
    worst.finish();
}

/// LSP-22: no excess at all, and every number finite.
#[test]
fn parallel_is_uniform() {
    for kind in [Kind::Parallel, Kind::Opposite] {
        check(&format!("LSP-22/{kind:?}"), CASES, moderate(kind), |scene| {
            for axes in [Axes::View, Axes::LightFixed] {
                let scene = Scene { axes, ..scene.clone() };
                let uniform = scene.fit().solve(Rule::Uniform).unwrap();
                for rule in LIGHT_SPACE_RULES {
                    let map = scene.fit().solve(Rule::LightSpace(rule)).unwrap();
                    assert_eq!(map.warp().excess().to_bits(), 0);
                    assert_eq!(map, uniform);
                    assert!(map.clip_from_world_at(map.origin(), ClipSpace::WGPU).is_finite());
                    assert_eq!(map.light_space().sin_gamma.to_bits(), 0);
                }
            }
        });
    }
}

/// An orthographic camera has no error that grows towards the eye, so only an explicit warp warps.
#[test]
fn published_rules_leave_orthographic_cameras_uniform() {
    let view = View::orthographic(DVec3::ZERO, DVec3::Z, DVec3::Y, Sides::centred(20.0, 10.0), 1.0..100.0).unwrap();
    let everything = box_about(DVec3::ZERO, DVec3::splat(200.0));
    let scene = Scene::new(view, DVec3::new(0.1, 1.0, 0.3), &[everything], everything);
    let more =
        [Rule::OnAxis, Rule::TSM, Rule::PSM, Rule::OPTIMAL].into_iter().chain(LIGHT_SPACE_RULES.map(Rule::LightSpace));
    let uniform = scene.fit().solve(Rule::Uniform).unwrap();
    for rule in more {
        assert_eq!(scene.fit().solve(rule).unwrap(), uniform, "{rule:?}");
    }
    check("orthographic", CASES, rule(), |rule| {
        let warped = scene.fit().solve(rule).unwrap().warp().excess() > 0.0;
        assert_eq!(warped, matches!(rule, Rule::Explicit(_)));
    });
}
