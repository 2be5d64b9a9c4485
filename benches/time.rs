//! Time per job, over a thousand realistic jobs in turn: `cargo bench --bench time`.
#![expect(clippy::unwrap_used, reason = "the jobs are valid, and a bench may stop where one is not")]

mod cases;

use std::hint::black_box;

use cases::Job;
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use shadow_warp::{Body, Fit, Light, Rule, ShadowMap, View};

/// A job with its first steps done.
struct Ready {
    job: Job,
    view: View,
    light: Light,
    receivers: [Body; 1],
}

impl Ready {
    fn new(job: &Job) -> Self {
        let (view, light) = (job.view().unwrap(), job.light().unwrap());
        Self { job: *job, view, light, receivers: [Body::visible(&view, &job.bounds)] }
    }

    fn fit(&self) -> Fit<'_> {
        Fit::new(&self.view, &self.light, &self.job.bounds, &self.receivers)
    }
}

/// From pieces to matrix.
fn whole(job: &Job, rule: Rule) -> ShadowMap {
    Ready::new(job).fit().solve(rule).unwrap()
}

fn benches(criterion: &mut Criterion) {
    let jobs: Vec<Ready> = cases::jobs().iter().map(Ready::new).collect();
    let maps: Vec<ShadowMap> = jobs.iter().map(|ready| ready.fit().solve(Rule::LISPSM).unwrap()).collect();
    // What is timed must be right: a warp that helps, on the mean over the jobs.
    let worst = |rule| jobs.iter().map(|ready| ready.fit().worst_texel(&ready.fit().solve(rule).unwrap())).sum::<f64>();
    assert!(worst(Rule::LISPSM) < 0.9 * worst(Rule::Uniform));

    let mut time = |name: &str, run: &dyn Fn(usize)| {
        let mut next = (0..jobs.len()).cycle();
        criterion.bench_function(name, |b| {
            b.iter_batched(|| next.next().unwrap(), run, BatchSize::SmallInput);
        });
    };
    time("clip", &|i| {
        black_box(Body::visible(&jobs[i].view, &jobs[i].job.bounds));
    });
    time("sweep", &|i| {
        black_box(jobs[i].receivers[0].casters(&jobs[i].light, &jobs[i].job.bounds).unwrap());
    });
    time("fit uniform", &|i| {
        black_box(jobs[i].fit().solve(Rule::Uniform).unwrap());
    });
    time("fit lispsm", &|i| {
        black_box(jobs[i].fit().solve(Rule::LISPSM).unwrap());
    });
    time("fit tsm", &|i| {
        black_box(jobs[i].fit().solve(Rule::TSM).unwrap());
    });
    time("fit psm", &|i| {
        black_box(jobs[i].fit().solve(Rule::PSM).unwrap());
    });
    time("fit optimal", &|i| {
        black_box(jobs[i].fit().solve(Rule::OPTIMAL).unwrap());
    });
    time("worst texel", &|i| {
        black_box(jobs[i].fit().worst_texel(&maps[i]));
    });
    time("guard f32", &|i| {
        black_box(jobs[i].fit().guard_f32(&maps[i], jobs[i].view.eye()).unwrap());
    });
    time("pieces to matrix, uniform", &|i| {
        black_box(whole(&jobs[i].job, Rule::Uniform));
    });
    time("pieces to matrix, lispsm", &|i| {
        black_box(whole(&jobs[i].job, Rule::LISPSM));
    });
    time("pieces to matrix, tsm", &|i| {
        black_box(whole(&jobs[i].job, Rule::TSM));
    });
    time("pieces to matrix, psm", &|i| {
        black_box(whole(&jobs[i].job, Rule::PSM));
    });
    time("pieces to matrix, optimal", &|i| {
        black_box(whole(&jobs[i].job, Rule::OPTIMAL));
    });
}

criterion_group!(group, benches);
criterion_main!(group);
