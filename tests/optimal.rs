//! The best warp: against dense search, against every other rule, and against its own lower bound.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]
#![expect(clippy::float_cmp, reason = "what is compared is exact")]
#![expect(clippy::disallowed_methods, reason = "tests may call what the library must not")]

mod random;

use approx::assert_relative_eq;
use proptest::option::weighted;
use proptest::prelude::*;
use proptest::sample::select;
use random::basic::{Mixture, direction, log_between, mixture};
use random::measure::{
    LIGHT_SPACE_RULES, Scene, box_about, extent, lit, lit_between, ndc, product_rounding, world_rounding,
};
use random::scenes::{Cameras, Kind, each_kind, sun, view};
use random::{Ratchet, check};
use shadow_warp::glam::DVec3;
use shadow_warp::{Aliasing, Axes, Error, Fit, Light, Objective, Rule, ShadowMap, Warp};

const OBJECTIVES: [Objective; 4] = [Objective::Along, Objective::Across, Objective::Larger, Objective::Product];
/// How many scenes of each kind.
const CASES: u32 = 50;
/// Errors that differ by less are equally good.
const TIE: f64 = 1e-9;

/// A spot light about what is seen, turned towards it.
#[derive(Clone, Copy, Debug)]
struct Lamp {
    target: Mixture,
    direction: DVec3,
    distance: f64,
    angle: f64,
    aside: DVec3,
}

impl Lamp {
    fn light(self, scene: &Scene) -> Light {
        let points = scene.receivers(DVec3::ZERO);
        let size = points.iter().map(|p| (*p - points[0]).length()).fold(1e-3 * scene.view.near(), f64::max);
        let target = self.target.of(&points);
        let place = target + self.direction * size * self.distance;
        let axis = (target - place).normalize_or(DVec3::X) + 0.3 * self.angle * self.aside;
        Light::spot(place, axis, self.angle, 1e-3 * size, 100.0 * size).unwrap()
    }
}

/// Runs a property on scenes with the warp on the texture's axes, every third one under a spot
/// light.
fn each_scene<E: Strategy + Clone>(name: &str, more: E, mut property: impl FnMut(Scene, E::Value)) {
    let lamp = (mixture(), direction(), log_between(0.01, 10.0), 0.02..1.5, direction())
        .prop_map(|(target, direction, distance, angle, aside)| Lamp { target, direction, distance, angle, aside });
    let axes = select(vec![Axes::View, Axes::Middle, Axes::VertexMean]);
    each_kind(name, CASES, (axes, weighted(0.33, lamp), more), |scene, _, (axes, lamp, more)| {
        let light = lamp.map_or(scene.light, |lamp| lamp.light(&scene));
        property(Scene { axes, light, ..scene }, more);
    });
}

/// Warps of all strengths, evenly in logarithm.
fn warps() -> impl Iterator<Item = Warp> {
    (0..=200).map(|step| Warp::new((10.0_f64.powf(f64::from(step) * 0.04 - 2.0) - 0.01).max(0.0)).unwrap())
}

/// Every warp that a rule or a scan has: the optimum is no worse, for its own objective. Of equally
/// good ones it has the smaller other error.
#[test]
fn no_other_warp_is_better() {
    let (mut seen, mut warped, mut tied) = (0, 0, 0);
    each_scene("optimal/least", select(OBJECTIVES.to_vec()), |scene, objective| {
        let fit = scene.fit();
        if matches!(fit.solve(Rule::Uniform), Err(Error::NothingLit | Error::Invalid { .. })) {
            return;
        }
        seen += 1;
        let solve = |rule: Rule| fit.solve(rule).unwrap().warp();
        let best = solve(Rule::Optimal(objective));
        let errors = fit.errors(best).unwrap();
        let least = objective.of(&errors);
        assert!(least > 0.0);
        warped += u32::from(best.excess() > 0.0);
        let limit = solve(Rule::Explicit(Warp::new(1e8).unwrap())).excess();
        let published =
            LIGHT_SPACE_RULES.map(Rule::LightSpace).into_iter().chain([Rule::Uniform, Rule::TSM, Rule::OnAxis]);
        for warp in warps().filter(|warp| warp.excess() <= limit).chain(published.map(solve)) {
            let other = fit.errors(warp).unwrap();
            assert!(least <= objective.of(&other) * (1.0 + TIE), "{objective:?}: {least} {best:?} {other:?} {warp:?}");
            if objective.of(&other) <= least && objective == Objective::Larger {
                tied += 1;
                let [ours, theirs] = [&errors, &other].map(|errors| errors.along.min(errors.across));
                assert!(ours <= theirs * (1.0 + 1e-6), "{objective:?}: {errors:?} {best:?} {other:?} {warp:?}");
            }
        }
    });
    println!("{seen} {warped} {tied}");
    assert!(seen > 250 && warped > 100, "{seen} {warped}");
}

/// By the worst texel of the finished map, on any axes.
#[test]
fn never_worse_than_no_warp() {
    let (mut seen, mut warped) = (0, 0);
    let axes = select(vec![Axes::LightFixed, Axes::View, Axes::Middle, Axes::VertexMean]);
    each_scene("optimal/no-warp", axes, |scene, axes| {
        let scene = Scene { axes, ..scene };
        let fit = scene.fit();
        let (Ok(map), Ok(plain)) = (fit.solve(Rule::OPTIMAL), fit.solve(Rule::Uniform)) else { return };
        seen += 1;
        warped += u32::from(map.warp().excess() > 0.0);
        let [ours, without] = [&map, &plain].map(|map| fit.worst_texel(map));
        assert!(ours <= without * (1.0 + TIE), "{ours} {without} {map:?}");
    });
    assert!(seen > 250 && warped > 100, "{seen} {warped}");
}

/// Each error, but for the product, falls and then grows: on a fine scan it never turns down again.
#[test]
fn errors_have_one_valley() {
    let three = vec![Objective::Along, Objective::Across, Objective::Larger];
    each_scene("optimal/valley", select(three), |scene, objective| {
        let fit = scene.fit();
        if fit.solve(Rule::Uniform).is_err() {
            return;
        }
        let (mut grows, mut last) = (false, f64::INFINITY);
        for warp in warps() {
            let value = objective.of(&fit.errors(warp).unwrap());
            // Of flat ground only rounding is seen.
            grows |= value > last * (1.0 + VALLEY);
            if grows {
                assert!(value >= last * (1.0 - VALLEY), "{value} after {last} at {warp:?}");
            }
            last = value;
        }
    });
}

/// Rounding of the errors of neighbouring warps, of flat ground.
const VALLEY: f64 = 4.0 * f64::EPSILON;

/// The greatest extents of a map's texels over some points relative to the eye, across and along,
/// in pixels.
fn texels(scene: &Scene, map: &ShadowMap, points: &[DVec3]) -> [f64; 2] {
    let fit = scene.fit();
    points.iter().fold([0.0_f64; 2], |greatest, q| {
        let depth = scene.view.forward().dot(*q).max(scene.view.near());
        let [across, along] = map.texel_extent(*q + scene.view.eye());
        let pixels = scene.view.pixels_per_unit(fit.viewport, depth);
        [greatest[0].max(across * pixels), greatest[1].max(along * pixels)]
    })
}

/// The share of the map's width that the receivers fill. A flat body is fitted wider than it is, by
/// 2^-20 of its size, which `errors` leaves out across.
fn filled(scene: &Scene, map: &ShadowMap) -> f64 {
    let [low, high] = extent(lit(scene, map.origin()).iter().map(|q| ndc(map, *q).x));
    0.5 * (high - low)
}

/// The errors of a warp are those of the finished map, along each of its axes, and the larger one
/// is the worst texel.
#[test]
fn errors_are_those_of_the_map() {
    let mut worst = Ratchet::new("errors of the finished map");
    let mut flat = 0;
    let rules = vec![Rule::Uniform, Rule::OnAxis, Rule::OPTIMAL, Rule::Explicit(Warp::new(30.0).unwrap())];
    each_scene("optimal/errors", select(rules), |scene, rule| {
        let fit = scene.fit();
        let Ok(map) = fit.solve(rule) else { return };
        let errors = fit.errors(map.warp()).unwrap();
        let points = lit(&scene, scene.view.eye());
        let (share, [across, along]) = (filled(&scene, &map), texels(&scene, &map, &points));
        flat += u32::from(share < 0.9);
        let slack = slack(&scene, &map, &points);
        worst.note((along / errors.along - 1.0).abs(), slack, (along, errors));
        worst.note((across * share / errors.across - 1.0).abs(), slack, (across, share, errors));
        assert_relative_eq!(fit.worst_texel(&map), across.max(along), max_relative = slack);
    });
    worst.finish();
    println!("{flat} flat");
}

/// How well rounding lets texels at points relative to the eye be compared.
fn slack(scene: &Scene, map: &ShadowMap, points: &[DVec3]) -> f64 {
    let sides = lit(scene, map.origin()).iter().map(|q| product_rounding(map, *q)).fold(0.0, f64::max);
    let texels = points.iter().map(|q| world_rounding(map, scene, *q + scene.view.eye())).fold(0.0, f64::max);
    1e-15 + 0.12 * (sides + texels)
}

/// The bound along is below every warp's errors, and not far below; across, the least over all
/// ratios is that of the best warp.
#[test]
fn nothing_is_below_the_bound() {
    let mut closest: f64 = f64::INFINITY;
    let (mut gaps, mut without) = (Vec::new(), 0_usize);
    each_scene("optimal/bound", Just(()), |scene, ()| {
        let fit = scene.fit();
        let Ok(bound) = fit.least_errors() else { return };
        // A body without extent along the warp needs no map there.
        assert!(bound.along >= 0.0 && bound.across > 0.0, "{bound:?}");
        without += usize::from(bound.along <= 0.0);
        for warp in warps() {
            let errors = fit.errors(warp).unwrap();
            assert!(errors.along >= bound.along * (1.0 - 1e-12), "{warp:?} {errors:?} {bound:?}");
            assert!(errors.across >= bound.across * (1.0 - 2.0 * TIE), "{warp:?} {errors:?} {bound:?}");
            closest = closest.min(errors.along / bound.along);
        }
        let best = |objective| fit.errors(fit.solve(Rule::Optimal(objective)).unwrap().warp()).unwrap();
        assert_eq!(best(Objective::Across).across, bound.across);
        gaps.push(Objective::Larger.of(&best(Objective::Larger)) / Objective::Larger.of(&bound));
    });
    gaps.sort_by(f64::total_cmp);
    println!("closest {closest}, median {}, 90 % {}", gaps[gaps.len() / 2], gaps[gaps.len() * 9 / 10]);
    assert!(closest < 1.01 && without * 20 < gaps.len(), "{closest} {without}");
}

/// The bound along the warp against a sum over slices of the body, found by brute force.
#[test]
fn the_bound_is_the_integral_over_slices() {
    let mut worst = Ratchet::new("the bound along");
    let cameras =
        Cameras { world: 10.0, near: [0.99, 1.01], ratio: [150.0, 250.0], far: f64::INFINITY, tangent: [0.3, 1.5] };
    check("optimal/slices", 40, (view(cameras), sun(Kind::Any, 1e-3)), |(view, sun)| {
        let everything = box_about(view.eye(), DVec3::splat(1e3));
        let scene = Scene::new(view, sun.to_light(&view), &[everything], everything);
        let fit = scene.fit();
        let map = fit.solve(Rule::Uniform).unwrap();
        let space = map.light_space();
        let points = scene.receivers(view.eye());
        let [low, high] = extent(points.iter().map(|p| space.z.dot(*p)));
        // The least depth of a slice is on a segment between two vertices.
        let slices = 1000;
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
        // The rule of midpoints.
        worst.note((bound / expected - 1.0).abs(), 1e-2, (bound, expected));
    });
    worst.finish();
}

/// With the light perpendicular to the view, and nothing but the line of sight, the best warp is
/// LiSPSM's.
#[test]
fn a_narrow_view_has_the_published_optimum() {
    for ratio in [2.0, 100.0, 1e4] {
        let view = shadow_warp::View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, 1e-6, 1.0, 1.0..ratio).unwrap();
        let everything = box_about(DVec3::ZERO, DVec3::splat(2.0 * ratio));
        let scene = Scene::new(view, DVec3::Y, &[everything], everything);
        for rule in [Rule::Optimal(Objective::Along), Rule::OnAxis] {
            let found = scene.fit().solve(rule).unwrap().warp().ratio();
            assert_relative_eq!(found, f64::sqrt(ratio), max_relative = 1e-9);
        }
    }
}

/// A near hint: the map covers what it did, and its errors are those at the points that count.
#[test]
fn chosen_depths_change_the_warp_alone() {
    let mut worst = Ratchet::new("errors at chosen depths");
    let (mut changed, mut in_range) = (0, 0);
    let rules = vec![Rule::OPTIMAL, Rule::Optimal(Objective::Product), Rule::LISPSM, Rule::OnAxis, Rule::TSM];
    let more = (select(rules), log_between(1.0, 1e4), log_between(1.0, 1e3));
    each_scene("optimal/chosen", more, |scene, (rule, near, far)| {
        let near = scene.view.near() * near;
        let chosen = [near, near * far];
        let fit = Fit { warp_depths: Some(chosen), ..scene.fit() };
        let Ok(map) = fit.solve(rule) else { return };
        let same = Fit { warp_depths: None, ..fit }.solve(Rule::Explicit(map.warp())).unwrap();
        assert_eq!(map, same);
        changed += u32::from(map.warp() != scene.fit().solve(rule).unwrap().warp());
        let points = lit_between(&scene, chosen);
        // Where nothing lies between them, all counts.
        let points = if points.is_empty() { lit(&scene, scene.view.eye()) } else { points };
        in_range += points.len();
        let errors = fit.errors(map.warp()).unwrap();
        let (share, [across, along]) = (filled(&scene, &map), texels(&scene, &map, &points));
        let slack = slack(&scene, &map, &points);
        worst.note((along / errors.along - 1.0).abs(), slack, (along, errors));
        worst.note((across * share / errors.across - 1.0).abs(), slack, (across, errors));
    });
    worst.finish();
    println!("{changed} {in_range}");
    assert!(changed > 50 && in_range > 1000, "{changed} {in_range}");
}

/// The best warp for what lies between two depths is no worse there than any other.
#[test]
fn no_other_warp_is_better_at_chosen_depths() {
    let more = (select(OBJECTIVES.to_vec()), log_between(1.0, 1e4), log_between(1.0, 1e3));
    each_scene("optimal/chosen-least", more, |scene, (objective, near, far)| {
        let near = scene.view.near() * near;
        let fit = Fit { warp_depths: Some([near, near * far]), ..scene.fit() };
        let Ok(map) = fit.solve(Rule::Optimal(objective)) else { return };
        let errors = fit.errors(map.warp()).unwrap();
        let least = objective.of(&errors);
        let limit = fit.solve(Rule::Explicit(Warp::new(1e8).unwrap())).unwrap().warp().excess();
        for warp in warps().step_by(4).filter(|warp| warp.excess() <= limit) {
            let other: Aliasing = fit.errors(warp).unwrap();
            assert!(least <= objective.of(&other) * (1.0 + TIE), "{objective:?} {map:?} {warp:?}");
        }
        assert!(errors.along >= fit.least_errors().unwrap().along * (1.0 - 1e-12));
    });
}
