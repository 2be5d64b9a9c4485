//! Time per job, over a thousand realistic jobs in turn: `cargo bench --bench time`.
#![expect(clippy::unwrap_used, reason = "the jobs are valid, and a bench may stop where one is not")]

mod jobs;
mod steps;

use std::hint::black_box;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use jobs::Job;
use steps::checked;

fn time<T>(criterion: &mut Criterion, name: &str, jobs: &[Job], step: impl Fn(&Job) -> T) {
    let mut next = jobs.iter().cycle();
    criterion.bench_function(name, |b| {
        b.iter_batched(|| next.next().unwrap(), |job| black_box(step(job)), BatchSize::SmallInput);
    });
}

macro_rules! time_all {
    ($($step:ident)*) => {
        fn benches(criterion: &mut Criterion) {
            $(time(criterion, stringify!($step), &checked::$step(), steps::$step);)*
        }
    };
}
steps::with_all_steps!(time_all);

criterion_group!(group, benches);
criterion_main!(group);
