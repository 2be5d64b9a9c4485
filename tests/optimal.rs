//! The best warp: against dense search, against every other rule, and against its own lower bound.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]
#![expect(clippy::disallowed_methods, reason = "tests may call what the library must not")]

mod scenes;

use scenes::random::Random;
use scenes::{LIGHT_SPACE_RULES, Scene, box_about, light, moderate, view};
use shadow_warp::glam::DVec3;
use shadow_warp::{Aliasing, Axes, Error, Fit, Light, Objective, Rule, Warp};

const OBJECTIVES: [Objective; 4] = [Objective::Along, Objective::Across, Objective::Larger, Objective::Product];
const CASES: u64 = 400;

/// The scenes of the property tests with the warp on the texture's axes, every third one under a spot light.
fn scene(case: u64) -> Scene {
    let (mut scene, _) = moderate(case);
    scene.axes = if case % 4 == 1 { Axes::Middle } else { Axes::View };
    if case % 3 == 0 {
        scene.light = spot(&scene, &mut Random::new(case + 1_000_000));
    }
    scene
}

/// A spot light somewhere about what is seen, turned towards it.
fn spot(scene: &Scene, random: &mut Random) -> Light {
    let points = scene.receivers(DVec3::ZERO);
    let size = points.iter().map(|p| (*p - points[0]).length()).fold(1e-3 * scene.view.near(), f64::max);
    let target = random.mixed(&points);
    let place = target + random.direction() * size * random.log_between(0.01, 10.0);
    let angle = random.between(0.02, 1.5);
    let axis = (target - place).normalize_or(DVec3::X) + 0.3 * angle * random.direction();
    Light::spot(place, axis, angle, 1e-3 * size, 100.0 * size).unwrap()
}

/// Warps of all strengths, evenly in logarithm.
fn warps() -> impl Iterator<Item = Warp> {
    (0..=400).map(|step| Warp::new((10.0_f64.powf(f64::from(step) * 0.02 - 2.0) - 0.01).max(0.0)).unwrap())
}

/// Every warp that a rule or a scan has: the optimum is no worse, for its own objective, and it is one of the family.
#[test]
fn no_other_warp_is_better() {
    let (mut seen, mut warped) = (0, 0);
    for case in 0..CASES {
        let scene = scene(case);
        let fit = scene.fit();
        if matches!(fit.solve(Rule::Uniform), Err(Error::NothingLit | Error::Invalid { .. })) {
            continue;
        }
        seen += 1;
        let errors = |rule: Rule| fit.errors(fit.solve(rule).unwrap().warp()).unwrap();
        for objective in OBJECTIVES {
            let best = fit.solve(Rule::Optimal(objective)).unwrap().warp();
            let least = objective.of(&fit.errors(best).unwrap());
            assert!(least > 0.0, "{case}");
            warped += u32::from(best.excess() > 0.0);
            let limit = fit.solve(Rule::Explicit(Warp::new(1e8).unwrap())).unwrap().warp().excess();
            for warp in warps().filter(|warp| warp.excess() <= limit) {
                let other = objective.of(&fit.errors(warp).unwrap());
                assert!(
                    least <= other * (1.0 + 1e-9),
                    "{case} {objective:?}: {least} at {best:?}, {other} at {warp:?}"
                );
            }
            let published = LIGHT_SPACE_RULES.map(Rule::LightSpace);
            for rule in published.into_iter().chain([Rule::Uniform, Rule::TSM, Rule::OnAxis]) {
                assert!(least <= objective.of(&errors(rule)) * (1.0 + 1e-9), "{case} {objective:?} {rule:?}");
            }
        }
    }
    assert!(seen > 300 && warped > 600, "{seen} {warped}");
}

/// Each error, but for the product, falls and then grows: on a fine scan it never turns down again.
#[test]
fn errors_have_one_valley() {
    for case in 0..CASES {
        let scene = scene(case);
        let fit = scene.fit();
        if fit.solve(Rule::Uniform).is_err() {
            continue;
        }
        let all: Vec<Aliasing> = warps().map(|warp| fit.errors(warp).unwrap()).collect();
        for objective in [Objective::Along, Objective::Across, Objective::Larger] {
            let (mut least, mut grows) = (f64::INFINITY, false);
            let mut last = f64::INFINITY;
            for errors in &all {
                let value = objective.of(errors);
                // Ten digits: of flat ground only rounding is seen.
                grows |= value > last * (1.0 + 1e-10);
                assert!(!grows || value >= last * (1.0 - 1e-10), "{case} {objective:?}: {value} after {last}, {least}");
                (least, last) = (least.min(value), value);
            }
        }
    }
}

/// The larger of both errors is the worst texel of the map.
#[test]
fn errors_are_those_of_the_map() {
    for case in 0..CASES {
        let scene = scene(case);
        let fit = scene.fit();
        for rule in [Rule::Uniform, Rule::OnAxis, Rule::OPTIMAL, Rule::Explicit(Warp::new(30.0).unwrap())] {
            let Ok(map) = fit.solve(rule) else { continue };
            let (worst, errors) = (fit.worst_texel(&map), fit.errors(map.warp()).unwrap());
            let same = (Objective::Larger.of(&errors) / worst - 1.0).abs();
            // Flat bodies are fitted wider than they are, by 2^-20 of their size, which `errors` leaves out across.
            assert!(same < 1e-9 || worst > Objective::Larger.of(&errors), "{case} {rule:?}: {errors:?}, {worst}");
        }
    }
}

/// The bound is below every warp's errors, with rational and with logarithmic spacing, and not far below.
#[test]
fn nothing_is_below_the_bound() {
    let mut closest: f64 = f64::INFINITY;
    let (mut gaps, mut without) = (Vec::new(), 0);
    for case in 0..CASES {
        let scene = scene(case);
        let fit = scene.fit();
        let Ok(bound) = fit.least_errors() else { continue };
        // A body without extent along the warp needs no map there.
        assert!(bound.along >= 0.0 && bound.across > 0.0, "{case} {bound:?}");
        without += u32::from(bound.along <= 0.0);
        for warp in warps() {
            let errors = fit.errors(warp).unwrap();
            assert!(errors.along >= bound.along * (1.0 - 1e-9), "{case} {warp:?} {errors:?} {bound:?}");
            assert!(errors.across >= bound.across * (1.0 - 1e-9), "{case} {warp:?} {errors:?} {bound:?}");
            closest = closest.min(errors.along / bound.along);
        }
        let best = fit.errors(fit.solve(Rule::OPTIMAL).unwrap().warp()).unwrap();
        gaps.push(Objective::Larger.of(&best) / Objective::Larger.of(&bound));
    }
    gaps.sort_by(f64::total_cmp);
    println!("closest {closest}, median {}, 90 % {}", gaps[gaps.len() / 2], gaps[gaps.len() * 9 / 10]);
    assert!(closest < 1.01 && without < 20, "{closest} {without}");
}

/// The bound along the warp against a sum over slices of the body, found by brute force.
#[test]
fn the_bound_is_the_integral_over_slices() {
    for case in 0..60 {
        let mut random = Random::new(case);
        let view = view(&mut random, 10.0, 1.0, 200.0, [0.3, 1.5]);
        let everything = box_about(view.eye(), DVec3::splat(1e3));
        let to_light = light(&mut random, &view, scenes::Kind::Any, 1e-3);
        let scene = Scene::new(view, to_light, &[everything], everything);
        let fit = scene.fit();
        let map = fit.solve(Rule::Uniform).unwrap();
        let space = map.light_space();
        let points = scene.receivers(view.eye());
        let [low, high] = scenes::extent(points.iter().map(|p| space.z.dot(*p)));
        // The least depth of a slice is on a segment between two vertices.
        let slices = 2000;
        let sum: f64 = (0..slices)
            .map(|slice| {
                let z = low + (high - low) * (f64::from(slice) + 0.5) / f64::from(slices);
                let mut least = f64::INFINITY;
                for (i, a) in points.iter().enumerate() {
                    for b in &points[..i] {
                        let (z_a, z_b) = (space.z.dot(*a), space.z.dot(*b));
                        if (z_a - z) * (z_b - z) < 0.0 {
                            let p = *a + (*b - *a) * ((z - z_a) / (z_b - z_a));
                            least = least.min(view.forward().dot(p));
                        }
                    }
                }
                1.0 / least
            })
            .sum();
        let pixels = view.pixels_per_unit(fit.viewport, 1.0) * (high - low) / f64::from(fit.map_size[1]);
        let expected = pixels * sum / f64::from(slices);
        let bound = fit.least_errors().unwrap().along;
        assert!((bound / expected - 1.0).abs() < 2e-3, "{case}: {bound} {expected}");
    }
}

/// With the light perpendicular to the view, and nothing but the line of sight, the best warp is LiSPSM's.
#[test]
fn a_narrow_view_has_the_published_optimum() {
    for ratio in [2.0, 100.0, 1e4] {
        let view = shadow_warp::View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, 1e-6, 1.0, 1.0..ratio).unwrap();
        let everything = box_about(DVec3::ZERO, DVec3::splat(2.0 * ratio));
        let scene = Scene::new(view, DVec3::Y, &[everything], everything);
        for rule in [Rule::Optimal(Objective::Along), Rule::OnAxis] {
            let found = scene.fit().solve(rule).unwrap().warp().ratio();
            assert!((found / ratio.sqrt() - 1.0).abs() < 1e-5, "{rule:?} {ratio}: {found}");
        }
    }
}

/// A near hint: the warp is the best for what lies beyond it; the map covers what it did.
#[test]
fn chosen_depths_change_the_warp_alone() {
    let (mut changed, mut in_range) = (0, 0);
    for case in 0..CASES {
        let scene = scene(case);
        let mut random = Random::new(case);
        let near = scene.view.near() * random.log_between(1.0, 1e4);
        let far = near * random.log_between(1.0, 1e3);
        let fit = Fit { warp_depths: Some([near, far]), ..scene.fit() };
        for rule in [Rule::OPTIMAL, Rule::Optimal(Objective::Product), Rule::LISPSM, Rule::OnAxis, Rule::TSM] {
            let Ok(map) = fit.solve(rule) else { continue };
            let same = Fit { warp_depths: None, ..fit }.solve(Rule::Explicit(map.warp())).unwrap();
            assert_eq!(map, same, "{case} {rule:?}");
            changed += u32::from(map.warp() != scene.fit().solve(rule).unwrap().warp());
        }
        // The errors are those of the map, whose sides all that is seen makes, at the points that count.
        if let Ok(map) = fit.solve(Rule::OPTIMAL) {
            let errors = fit.errors(map.warp()).unwrap();
            for lit in fit.lit_receivers().filter(|lit| !lit.is_empty()) {
                for _ in 0..20 {
                    let p = random.mixed(lit.vertices()) + lit.origin();
                    let depth = scene.view.forward().dot(p - scene.view.eye());
                    if (near..far).contains(&depth) {
                        let pixels = scene.view.pixels_per_unit(fit.viewport, depth.max(scene.view.near()));
                        let [across, along] = map.texel_extent(p);
                        let flat = across * pixels > errors.across && errors.across < 1e-5 * errors.along;
                        assert!(flat || across * pixels <= errors.across * (1.0 + 1e-9), "{case} {errors:?}");
                        assert!(along * pixels <= errors.along * (1.0 + 1e-9), "{case} {errors:?}");
                        in_range += 1;
                    }
                }
            }
        }
        for objective in OBJECTIVES {
            let Ok(map) = fit.solve(Rule::Optimal(objective)) else { continue };
            let least = objective.of(&fit.errors(map.warp()).unwrap());
            let bound = objective.of(&fit.least_errors().unwrap());
            assert!(least >= bound * (1.0 - 1e-9), "{case} {objective:?} {least} {bound}");
            for warp in warps().step_by(7) {
                assert!(least <= objective.of(&fit.errors(warp).unwrap()) * (1.0 + 1e-9), "{case} {objective:?}");
            }
        }
    }
    assert!(changed > 300 && in_range > 1000, "{changed} {in_range}");
}
