//! The jobs of each step. What is measured must be right, so each function first asserts what the
//! step makes of them.

use shadow_warp::glam::{DVec3, Mat4, vec3};
use shadow_warp::{ClipSpace, Error, Fit, Light, ShadowMap};

use crate::jobs::{self, Job};
use crate::steps;

/// In normalised device coordinates.
const ROUNDING: f64 = 1e-9;

/// The extremes of the receivers in the map, in normalised device coordinates.
fn seen(fit: &Fit, map: &ShadowMap) -> [DVec3; 2] {
    // About an origin near by, so that nothing is lost.
    let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
    let lit: Vec<_> = fit.lit_receivers().collect();
    let points = lit.iter().flat_map(|body| body.vertices().iter().map(|v| *v + (body.origin() - map.origin())));
    points.map(|p| matrix.project_point3(p)).fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| {
        assert!(p.is_finite());
        [low.min(p), high.max(p)]
    })
}

/// Asserts that the map holds the receivers.
fn assert_holds(fit: &Fit, map: &ShadowMap) -> [DVec3; 2] {
    let [low, high] = seen(fit, map);
    let [least, most] = [DVec3::new(-1.0, -1.0, 0.0), DVec3::ONE];
    assert!(low.cmpge(least - ROUNDING).all() && high.cmple(most + ROUNDING).all(), "{low} to {high}");
    [low, high]
}

/// Asserts that the map holds the receivers, and that they touch its sides.
fn assert_fits(fit: &Fit, map: &ShadowMap) {
    let [low, high] = assert_holds(fit, map);
    let touched = |ends: [f64; 2]| (ends[0] + 1.0).abs() < ROUNDING && (ends[1] - 1.0).abs() < ROUNDING;
    assert!(touched([low.x, high.x]) && touched([low.y, high.y]), "{low} to {high}");
}

/// The mean of the worst texel.
fn worst(jobs: &[Job], solve: impl Fn(&Job) -> ShadowMap) -> f64 {
    jobs.iter().map(|job| job.fit().worst_texel(&solve(job))).sum::<f64>() / jobs.len() as f64
}

/// Asserts that each map fits, and that the mean worst texel is at most so many times that of the
/// uniform map.
fn fitted(jobs: Vec<Job>, solve: impl Fn(&Job) -> ShadowMap, times: f64) -> Vec<Job> {
    let jobs = each(jobs, |job| assert_fits(&job.fit(), &solve(job)));
    let found = worst(&jobs, &solve) / worst(&jobs, steps::fit_uniform);
    assert!(found <= times, "{found} times the worst texel of the uniform map");
    jobs
}

/// The jobs, once something was asserted of each.
fn each(jobs: Vec<Job>, check: impl Fn(&Job)) -> Vec<Job> {
    assert!(jobs.len() == jobs::COUNT);
    jobs.iter().for_each(check);
    jobs
}

pub(crate) fn view() -> Vec<Job> {
    each(jobs::suns(), |job| {
        let view = steps::view(job);
        // The planes are relative to the eye.
        let inside = view.forward() * (2.0 * view.near());
        assert!(view.planes().iter().all(|plane| plane.distance(inside) < 0.0));
    })
}

pub(crate) fn clip() -> Vec<Job> {
    each(jobs::suns(), |job| {
        let body = steps::clip(job);
        let beyond =
            |p: DVec3| job.view.planes().iter().map(|plane| plane.distance(p - job.view.eye())).fold(0.0, f64::max);
        let furthest = body.vertices().iter().map(|v| beyond(*v + body.origin())).fold(0.0, f64::max);
        assert!(body.volume() > 0.0 && furthest < 1e-9, "{furthest}");
    })
}

pub(crate) fn sweep() -> Vec<Job> {
    each(jobs::suns(), |job| {
        let (casters, receivers) = (steps::sweep(job), &job.receivers[0]);
        let to_light = job.map.light_space().y;
        let [[low, high], [casters_low, casters_high]] =
            [receivers.bounds_along(to_light), casters.bounds_along(to_light)].map(Option::unwrap);
        assert!(casters.origin() == receivers.origin());
        assert!((casters_low - low).abs() < 1e-9 && casters_high > high - 1e-9 && casters.volume() > 0.0);
    })
}

pub(crate) fn fit_uniform() -> Vec<Job> {
    fitted(jobs::suns(), steps::fit_uniform, 1.0)
}

pub(crate) fn fit_lispsm() -> Vec<Job> {
    fitted(jobs::suns(), steps::fit_lispsm, 0.4)
}

pub(crate) fn fit_tsm() -> Vec<Job> {
    fitted(jobs::suns(), steps::fit_tsm, 0.4)
}

pub(crate) fn fit_psm() -> Vec<Job> {
    // Made for the camera's picture, not for the worst texel.
    fitted(jobs::suns(), steps::fit_psm, 2.0)
}

pub(crate) fn fit_on_axis() -> Vec<Job> {
    fitted(jobs::suns(), steps::fit_on_axis, 0.4)
}

pub(crate) fn fit_optimal() -> Vec<Job> {
    fitted(jobs::suns(), steps::fit_optimal, 0.3)
}

pub(crate) fn fit_plane() -> Vec<Job> {
    let jobs = each(jobs::grounds(), |job| {
        assert_holds(&job.fit(), &steps::fit_plane(job));
    });
    assert!(worst(&jobs, steps::fit_plane) < 0.6 * worst(&jobs, steps::fit_uniform));
    jobs
}

pub(crate) fn fit_uniform_light_fixed() -> Vec<Job> {
    fitted(jobs::suns(), steps::fit_uniform_light_fixed, 1.1)
}

pub(crate) fn fit_optimal_light_fixed() -> Vec<Job> {
    fitted(jobs::suns(), steps::fit_optimal_light_fixed, 0.5)
}

pub(crate) fn fit_lispsm_middle() -> Vec<Job> {
    fitted(jobs::suns(), steps::fit_lispsm_middle, 0.4)
}

pub(crate) fn fit_lispsm_vertex_mean() -> Vec<Job> {
    fitted(jobs::suns(), steps::fit_lispsm_vertex_mean, 0.4)
}

pub(crate) fn fit_lispsm_chosen_depths() -> Vec<Job> {
    fitted(jobs::suns(), steps::fit_lispsm_chosen_depths, 0.4)
}

pub(crate) fn fit_optimal_chosen_depths() -> Vec<Job> {
    fitted(jobs::suns(), steps::fit_optimal_chosen_depths, 0.4)
}

pub(crate) fn worst_texel() -> Vec<Job> {
    each(jobs::suns(), |job| assert!(steps::worst_texel(job) > 0.0))
}

/// Asserts that each side keeps free what rounding can move. Up to `refused` maps may have no room
/// for that, as those of a spot light far from the eye whose casters come close to it.
fn guarded(jobs: Vec<Job>, refused: usize) -> Vec<Job> {
    let is_guarded = |job: &&Job| {
        let guarded = match steps::guard_f32(job) {
            Ok(map) => map,
            Err(error) => {
                assert!(matches!(error, Error::BeyondF32 { .. }), "{error}");
                return false;
            }
        };
        let [low, high] = seen(&job.fit(), &guarded);
        let free = (1.0 - high).min(low + DVec3::new(1.0, 1.0, 0.0));
        let moved = job.fit().rounding(&guarded, job.view.eye()) / DVec3::new(512.0, 512.0, 1.0);
        // The bound of the guarded map is not quite that of the map before.
        assert!(moved.cmpgt(DVec3::ZERO).all() && moved.cmple(free * (1.0 + 4.0 * moved)).all(), "{moved} of {free}");
        true
    };
    let found = jobs.len() - jobs.iter().filter(is_guarded).count();
    assert!(found <= refused, "{found} maps without a guard");
    jobs
}

pub(crate) fn guard_f32() -> Vec<Job> {
    guarded(jobs::suns(), 0)
}

pub(crate) fn least_errors() -> Vec<Job> {
    each(jobs::suns(), |job| {
        let (least, found) = (steps::least_errors(job), job.fit().errors(job.map.warp()).unwrap());
        assert!(least.along > 0.0 && least.along <= found.along * (1.0 + 1e-9));
        assert!(least.across > 0.0 && least.across <= found.across * (1.0 + 1e-9));
    })
}

pub(crate) fn bias() -> Vec<Job> {
    each(jobs::suns(), |job| {
        let [bias, length] = steps::bias(job);
        assert!(bias > 0.0 && length > 0.0 && length.is_finite());
    })
}

pub(crate) fn lookup() -> Vec<Job> {
    each(jobs::suns(), |job| {
        let (lookup, [receivers]) = (steps::lookup(job), &job.receivers);
        let texture_from_world = Mat4::from_cols_array_2d(&lookup.texture_from_world);
        let vertex = (receivers.vertices()[0] + (receivers.origin() - job.view.eye())).as_vec3();
        let place = texture_from_world.project_point3(vertex);
        // Without a guard: up to a texel may be lost.
        let [width, height] = lookup.texel;
        let lost = vec3(width, height, 1e-3);
        assert!(place.cmpge(-lost).all() && place.cmple(1.0 + lost).all(), "{place}");
        assert!(lookup.slope_factor > 0.0 && lookup.constant_bias > 0.0);
    })
}

pub(crate) fn whole_uniform() -> Vec<Job> {
    each(jobs::suns(), |job| assert!(steps::whole_uniform(job) == steps::fit_uniform(job)))
}

pub(crate) fn whole_lispsm() -> Vec<Job> {
    each(jobs::suns(), |job| assert!(steps::whole_lispsm(job) == job.map))
}

pub(crate) fn whole_tsm() -> Vec<Job> {
    each(jobs::suns(), |job| assert!(steps::whole_tsm(job) == steps::fit_tsm(job)))
}

pub(crate) fn whole_psm() -> Vec<Job> {
    each(jobs::suns(), |job| assert!(steps::whole_psm(job) == steps::fit_psm(job)))
}

pub(crate) fn whole_optimal() -> Vec<Job> {
    each(jobs::suns(), |job| assert!(steps::whole_optimal(job) == steps::fit_optimal(job)))
}

pub(crate) fn spot_lit() -> Vec<Job> {
    each(jobs::spots(), |job| {
        let (lit, receivers) = (steps::spot_lit(job).volume(), job.receivers[0].volume());
        assert!(0.0 < lit && lit <= receivers * (1.0 + 1e-9), "{lit} of {receivers}");
    })
}

pub(crate) fn spot_uniform() -> Vec<Job> {
    fitted(jobs::spots(), steps::spot_uniform, 1.0)
}

pub(crate) fn spot_optimal() -> Vec<Job> {
    fitted(jobs::spots(), steps::spot_optimal, 0.6)
}

pub(crate) fn spot_worst_texel() -> Vec<Job> {
    each(jobs::spots(), |job| assert!(steps::worst_texel(job) > 0.0))
}

pub(crate) fn spot_guard_f32() -> Vec<Job> {
    guarded(jobs::spots(), 150)
}

pub(crate) fn point_optimal() -> Vec<Job> {
    each(jobs::points(), |job| {
        let maps = steps::point_optimal(job);
        let Light::Point(point) = job.lamp.light() else { return };
        point.faces().iter().zip(&maps).for_each(|(light, map)| {
            if let Some(map) = map {
                assert_fits(&Fit { light, ..job.fit() }, map);
            }
        });
    })
}
