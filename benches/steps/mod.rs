//! The steps that are measured, each with its jobs: one list for time and for instructions.

pub(crate) mod checked;

use shadow_warp::glam::{DVec3, DVec4};
use shadow_warp::{
    Aliasing, Axes, Body, CasterBody, ClipSpace, DepthFormat, Error, Filter, Fit, LitBody, Lookup, Plane, Rule,
    ShadowMap, View,
};

use crate::jobs::Job;

/// Calls a macro with the names of all steps. Each name is that of two functions: the step for one job,
/// here, and in [`checked`] what returns the jobs, once it has asserted what the step makes of them.
macro_rules! with_all_steps {
    ($macro:ident) => {
        $macro! {
            view clip sweep
            fit_uniform fit_lispsm fit_tsm fit_psm fit_on_axis fit_optimal fit_plane
            fit_uniform_light_fixed fit_optimal_light_fixed fit_lispsm_middle fit_lispsm_vertex_mean
            fit_lispsm_chosen_depths fit_optimal_chosen_depths
            worst_texel guard_f32 least_errors bias lookup
            whole_uniform whole_lispsm whole_tsm whole_psm whole_optimal
            spot_lit spot_uniform spot_optimal spot_worst_texel spot_guard_f32
            point_optimal
        }
    };
}
pub(crate) use with_all_steps;

/// The view from its pieces.
pub(crate) fn view(job: &Job) -> View {
    job.camera.view()
}

/// The receivers: the box by the view.
pub(crate) fn clip(job: &Job) -> Body {
    Body::visible(&job.view, &job.bounds)
}

/// The casters' body.
pub(crate) fn sweep(job: &Job) -> CasterBody {
    job.receivers[0].casters(&job.light, &job.bounds).unwrap()
}

pub(crate) fn fit_uniform(job: &Job) -> ShadowMap {
    job.fit().solve(Rule::Uniform).unwrap()
}

pub(crate) fn fit_lispsm(job: &Job) -> ShadowMap {
    job.fit().solve(Rule::LISPSM).unwrap()
}

pub(crate) fn fit_tsm(job: &Job) -> ShadowMap {
    job.fit().solve(Rule::TSM).unwrap()
}

pub(crate) fn fit_psm(job: &Job) -> ShadowMap {
    job.fit().solve(Rule::PSM).unwrap()
}

pub(crate) fn fit_on_axis(job: &Job) -> ShadowMap {
    job.fit().solve(Rule::OnAxis).unwrap()
}

pub(crate) fn fit_optimal(job: &Job) -> ShadowMap {
    job.fit().solve(Rule::OPTIMAL).unwrap()
}

/// The map of one error on the ground.
pub(crate) fn fit_plane(job: &Job) -> ShadowMap {
    job.fit().solve(Rule::Plane(Plane::new(DVec3::Y, DVec3::ZERO).unwrap())).unwrap()
}

fn on(axes: Axes, job: &Job) -> Fit<'_> {
    Fit { axes, ..job.fit() }
}

pub(crate) fn fit_uniform_light_fixed(job: &Job) -> ShadowMap {
    on(Axes::LightFixed, job).solve(Rule::Uniform).unwrap()
}

pub(crate) fn fit_optimal_light_fixed(job: &Job) -> ShadowMap {
    on(Axes::LightFixed, job).solve(Rule::OPTIMAL).unwrap()
}

pub(crate) fn fit_lispsm_middle(job: &Job) -> ShadowMap {
    on(Axes::Middle, job).solve(Rule::LISPSM).unwrap()
}

pub(crate) fn fit_lispsm_vertex_mean(job: &Job) -> ShadowMap {
    on(Axes::VertexMean, job).solve(Rule::LISPSM).unwrap()
}

/// From a near hint to where fog or walls end the sight.
fn for_depths(job: &Job) -> Fit<'_> {
    Fit { warp_depths: Some([5.0, 150.0]), ..job.fit() }
}

pub(crate) fn fit_lispsm_chosen_depths(job: &Job) -> ShadowMap {
    for_depths(job).solve(Rule::LISPSM).unwrap()
}

pub(crate) fn fit_optimal_chosen_depths(job: &Job) -> ShadowMap {
    for_depths(job).solve(Rule::OPTIMAL).unwrap()
}

pub(crate) fn worst_texel(job: &Job) -> f64 {
    job.fit().worst_texel(&job.map)
}

/// For positions relative to the eye.
pub(crate) fn guard_f32(job: &Job) -> Result<ShadowMap, Error> {
    job.fit().guard_f32(&job.map, job.view.eye())
}

pub(crate) fn least_errors(job: &Job) -> Aliasing {
    job.fit().least_errors().unwrap()
}

pub(crate) const FILTER: Filter = Filter::Bilinear(3);

/// The bias that level ground needs at a point that is seen, and its length in the world.
pub(crate) fn bias(job: &Job) -> [f64; 2] {
    let [receivers] = &job.receivers;
    let point = receivers.origin() + receivers.vertices()[0];
    let slope = job.map.depth_slope(ClipSpace::WGPU, point, DVec3::Y).unwrap();
    let bias = FILTER.least_bias(slope) + DepthFormat::Unorm24.quantum(1.0);
    [bias, job.map.length_of_bias(ClipSpace::WGPU, point, bias).unwrap()]
}

/// What a shader needs, with the row for linear depth.
pub(crate) fn lookup(job: &Job) -> Lookup {
    let eye = job.view.eye();
    let linear: DVec4 = job.fit().linear_depth(eye).unwrap();
    job.map.lookup(eye, ClipSpace::WGPU, FILTER, DepthFormat::Unorm24, Some(linear))
}

/// From the pieces to the matrix.
fn whole(job: &Job, rule: Rule) -> ShadowMap {
    let (view, light) = (job.camera.view(), job.lamp.light());
    let receivers = [Body::visible(&view, &job.bounds)];
    Fit::new(&view, &light, &job.bounds, &receivers).solve(rule).unwrap()
}

pub(crate) fn whole_uniform(job: &Job) -> ShadowMap {
    whole(job, Rule::Uniform)
}

pub(crate) fn whole_lispsm(job: &Job) -> ShadowMap {
    whole(job, Rule::LISPSM)
}

pub(crate) fn whole_tsm(job: &Job) -> ShadowMap {
    whole(job, Rule::TSM)
}

pub(crate) fn whole_psm(job: &Job) -> ShadowMap {
    whole(job, Rule::PSM)
}

pub(crate) fn whole_optimal(job: &Job) -> ShadowMap {
    whole(job, Rule::OPTIMAL)
}

/// The receivers in the cone.
pub(crate) fn spot_lit(job: &Job) -> LitBody {
    job.receivers[0].lit_by(&job.light, &job.map.light_space())
}

pub(crate) fn spot_uniform(job: &Job) -> ShadowMap {
    fit_uniform(job)
}

pub(crate) fn spot_optimal(job: &Job) -> ShadowMap {
    fit_optimal(job)
}

pub(crate) fn spot_worst_texel(job: &Job) -> f64 {
    worst_texel(job)
}

pub(crate) fn spot_guard_f32(job: &Job) -> Result<ShadowMap, Error> {
    guard_f32(job)
}

/// The maps of the six faces; none where no map is needed.
pub(crate) fn point_optimal(job: &Job) -> [Option<ShadowMap>; 6] {
    let shadow_warp::Light::Point(point) = job.lamp.light() else { return [None; 6] };
    point.faces().map(|light| match (Fit { light: &light, ..job.fit() }).solve(Rule::OPTIMAL) {
        Ok(map) => Some(map),
        Err(error) => {
            assert!(error == Error::NothingLit, "{error}");
            None
        }
    })
}
