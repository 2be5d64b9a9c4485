//! The frame and the excess.

use crate::scenes::random::Random;
use crate::scenes::{Kind, LIGHT_SPACE_RULES, Scene, box_about, moderate, rules};
use crate::{CASES, Worst};
use shadow_warp::glam::DVec3;
use shadow_warp::{Axes, ClipSpace, LightSpace, Rule, Sides, Slab, View};

/// LSP-6.
#[test]
fn axes_are_orthonormal() {
    let mut worst = Worst::new("LSP-6");
    for case in 0..CASES {
        let (scene, _) = moderate(case);
        let space = LightSpace::new(&scene.view, &scene.light).unwrap();
        let LightSpace { x, y, z, sin_gamma } = space;
        let [x_fixed, z_fixed] = space.fixed_axes();
        for [x, y, z] in [[x, y, z], [x_fixed, y, z_fixed]] {
            for (product, expected) in [(x.dot(x), 1.0), (y.dot(y), 1.0), (z.dot(z), 1.0)] {
                worst.note((product - expected).abs(), 3.3e-15, case);
            }
            worst.note(x.dot(y).abs().max(y.dot(z).abs()).max(z.dot(x).abs()), 3.3e-15, case);
            worst.note((y.cross(x) - z).length(), 3.3e-15, case);
        }
        assert_eq!(y, scene.to_light());
        let v = scene.view.forward();
        if sin_gamma > 0.0 {
            worst.note((z.dot(v) - sin_gamma).abs(), 3.3e-15, case);
            worst.note(x.dot(v).abs(), 3.3e-15, case);
        }
    }
}

/// LSP-21: relative steps of 1e-6 in the sine change the excess by as much, or for the damped rule by twice as much.
#[test]
fn excess_is_continuous() {
    let mut random = Random::new(21);
    for case in 0..20 * CASES {
        let near = random.log_between(1e-4, 1e2);
        let slab = Slab {
            near,
            far: near * random.log_between(1.0, 1e7),
            extent: near * random.log_between(1e-6, 1e7),
            sin_gamma: random.log_between(1e-12, 1.0 - 2e-6),
        };
        for rule in LIGHT_SPACE_RULES {
            let (a, b) = (rule.excess(&slab), rule.excess(&Slab { sin_gamma: slab.sin_gamma * (1.0 + 1e-6), ..slab }));
            let step = if rule == shadow_warp::LightSpaceRule::Damped { 2.2e-6 } else { 1.1e-6 };
            assert!(b >= a && b / a - 1.0 <= step, "{case} {rule:?} {slab:?}");
            // `ViewDepth` alone looks at the far depth.
            let bound = slab.extent * slab.sin_gamma / (2.0 * slab.near);
            assert!(a > 0.0 && a <= bound * (1.0 + 1e-15), "{case} {rule:?} {slab:?} {a}");
        }
    }
}

/// LSP-22: no excess at all, and every number finite.
#[test]
fn parallel_is_uniform() {
    let mut seen = 0;
    for case in 0..CASES {
        let (mut scene, kind) = moderate(case);
        if kind != Kind::Parallel && kind != Kind::Opposite {
            continue;
        }
        seen += 1;
        for axes in [Axes::View, Axes::LightFixed] {
            scene.axes = axes;
            let uniform = scene.fit().solve(Rule::Uniform).unwrap();
            for rule in LIGHT_SPACE_RULES {
                let map = scene.fit().solve(Rule::LightSpace(rule)).unwrap();
                assert_eq!(map.warp().excess().to_bits(), 0, "{case}");
                assert_eq!(map, uniform, "{case}");
                assert!(map.clip_from_world_at(map.origin(), ClipSpace::WGPU).is_finite());
                assert_eq!(map.light_space().sin_gamma.to_bits(), 0);
            }
        }
    }
    assert!(seen > 300, "{seen}");
}

/// An orthographic camera has no error that grows towards the eye, so only an explicit warp warps.
#[test]
fn published_rules_leave_orthographic_cameras_uniform() {
    let view = View::orthographic(DVec3::ZERO, DVec3::Z, DVec3::Y, Sides::centred(20.0, 10.0), 1.0..100.0).unwrap();
    let everything = box_about(DVec3::ZERO, DVec3::splat(200.0));
    let scene = Scene::new(view, DVec3::new(0.1, 1.0, 0.3), &[everything], everything);
    let more = [Rule::OnAxis, Rule::TSM, Rule::PSM, Rule::OPTIMAL];
    for rule in rules(&mut Random::new(0)).into_iter().chain(more) {
        let warped = scene.fit().solve(rule).unwrap().warp().excess() > 0.0;
        assert_eq!(warped, matches!(rule, Rule::Explicit(_)), "{rule:?}");
    }
}
