//! Instructions for a thousand realistic jobs, so that a thousandth of each count is the mean per job; the counts
//! repeat exactly: `cargo bench --bench instructions` (needs valgrind, and `cargo install gungraun-runner --version
//! 0.20.0`).
#![expect(clippy::unwrap_used, reason = "the jobs are valid, and a bench may stop where one is not")]
#![expect(missing_docs, reason = "the harness generates public items")]

mod cases;

use std::hint::black_box;

use cases::Job;
use gungraun::{library_benchmark, library_benchmark_group, main};
use shadow_warp::{Body, Fit, Light, Rule, ShadowMap, View};

/// A job with its first steps done.
struct Ready {
    job: Job,
    view: View,
    light: Light,
    receivers: [Body; 1],
    map: ShadowMap,
}

impl Ready {
    fn fit(&self) -> Fit<'_> {
        Fit::new(&self.view, &self.light, &self.job.bounds, &self.receivers)
    }
}

fn ready() -> Vec<Ready> {
    let ready = |job: &Job| {
        let (view, light) = (job.view().unwrap(), job.light().unwrap());
        let receivers = [Body::visible(&view, &job.bounds)];
        let map = Fit::new(&view, &light, &job.bounds, &receivers).solve(Rule::LISPSM).unwrap();
        assert!(map.warp().ratio() >= 1.0 && map.clip_from_world(shadow_warp::ClipSpace::WGPU).is_finite());
        Ready { job: *job, view, light, receivers, map }
    };
    cases::jobs().iter().map(ready).collect()
}

#[library_benchmark]
#[bench::jobs(setup = ready)]
fn view(jobs: Vec<Ready>) {
    jobs.iter().for_each(|ready| {
        black_box(ready.job.view().unwrap());
    });
}

#[library_benchmark]
#[bench::jobs(setup = ready)]
fn clip(jobs: Vec<Ready>) {
    jobs.iter().for_each(|ready| {
        black_box(Body::visible(&ready.view, &ready.job.bounds));
    });
}

#[library_benchmark]
#[bench::jobs(setup = ready)]
fn sweep(jobs: Vec<Ready>) {
    jobs.iter().for_each(|ready| {
        black_box(ready.receivers[0].casters(&ready.light, &ready.job.bounds).unwrap());
    });
}

#[library_benchmark]
#[bench::jobs(setup = ready)]
fn fit_uniform(jobs: Vec<Ready>) {
    jobs.iter().for_each(|ready| {
        black_box(ready.fit().solve(Rule::Uniform).unwrap());
    });
}

#[library_benchmark]
#[bench::jobs(setup = ready)]
fn fit_lispsm(jobs: Vec<Ready>) {
    jobs.iter().for_each(|ready| {
        black_box(ready.fit().solve(Rule::LISPSM).unwrap());
    });
}

#[library_benchmark]
#[bench::jobs(setup = ready)]
fn fit_tsm(jobs: Vec<Ready>) {
    jobs.iter().for_each(|ready| {
        black_box(ready.fit().solve(Rule::TSM).unwrap());
    });
}

#[library_benchmark]
#[bench::jobs(setup = ready)]
fn fit_psm(jobs: Vec<Ready>) {
    jobs.iter().for_each(|ready| {
        black_box(ready.fit().solve(Rule::PSM).unwrap());
    });
}

#[library_benchmark]
#[bench::jobs(setup = ready)]
fn fit_optimal(jobs: Vec<Ready>) {
    jobs.iter().for_each(|ready| {
        black_box(ready.fit().solve(Rule::OPTIMAL).unwrap());
    });
}

#[library_benchmark]
#[bench::jobs(setup = ready)]
fn worst_texel(jobs: Vec<Ready>) {
    jobs.iter().for_each(|ready| {
        black_box(ready.fit().worst_texel(&ready.map));
    });
}

#[library_benchmark]
#[bench::jobs(setup = ready)]
fn guard_f32(jobs: Vec<Ready>) {
    jobs.iter().for_each(|ready| {
        black_box(ready.fit().guard_f32(&ready.map, ready.view.eye()).unwrap());
    });
}

library_benchmark_group!(
    name = jobs,
    benchmarks = [view, clip, sweep, fit_uniform, fit_lispsm, fit_tsm, fit_psm, fit_optimal, worst_texel, guard_f32]
);
main!(library_benchmark_groups = jobs);
