//! Instructions for a thousand realistic jobs: a thousandth of each count is the mean per job. The
//! counts repeat exactly. `bash benches/baseline.sh` runs these benches.
#![expect(clippy::unwrap_used, reason = "the jobs are valid, and a bench may stop where one is not")]
#![expect(missing_docs, reason = "the harness generates public items")]

mod jobs;
mod steps;

use std::hint::black_box;

use gungraun::{LibraryBenchmarkConfig, library_benchmark, library_benchmark_group, main};
use jobs::Job;
use steps::checked;

macro_rules! count {
    ($($step:ident)*) => {
        $(
            #[library_benchmark]
            #[bench::jobs(setup = checked::$step)]
            fn $step(jobs: Vec<Job>) {
                jobs.iter().for_each(|job| {
                    let _ = black_box(steps::$step(black_box(job)));
                });
            }
        )*
        library_benchmark_group!(name = thousand_jobs, benchmarks = [$($step),*]);
    };
}
steps::with_all_steps!(count);
/// glibc chooses its `memcpy`, `memset` and `tan` by the processor. Those for any x86-64 processor
/// make the counts comparable.
const PLAIN_PROCESSOR: &str =
    "glibc.cpu.hwcaps=-AVX,-AVX2,-AVX512F,-AVX512VL,-AVX_Fast_Unaligned_Load,-ERMS,-FSRM,-FMA,-FMA4,-SSSE3";
main!(
    config = LibraryBenchmarkConfig::default().env("GLIBC_TUNABLES", PLAIN_PROCESSOR);
    library_benchmark_groups = thousand_jobs
);
