//! A thousand realistic jobs: cameras in and around a box of 400 x 50 x 400, near 0.1 to 1, far 70 to 10,000 or
//! infinite, field of view 30 to 100 degrees, and the sun anywhere above the horizon.

use shadow_warp::glam::{DVec3, dvec3};
use shadow_warp::{Body, Bounds, Error, Light, View};

/// The pieces of one job, as an engine holds them.
#[derive(Clone, Copy)]
pub(crate) struct Job {
    /// Eye, forward, up.
    pub(crate) frame: [DVec3; 3],
    /// Vertical field of view in radians.
    pub(crate) fov_y: f64,
    /// Near and far distance.
    pub(crate) depth: [f64; 2],
    /// Towards the sun.
    pub(crate) to_light: DVec3,
    /// Casters and receivers.
    pub(crate) bounds: Bounds,
}

impl Job {
    /// The camera.
    pub(crate) fn view(&self) -> Result<View, Error> {
        let [eye, forward, up] = self.frame;
        View::perspective(eye, forward, up, self.fov_y, 16.0 / 9.0, self.depth[0]..self.depth[1])
    }

    /// The sun.
    pub(crate) fn light(&self) -> Result<Light, Error> {
        Light::directional(self.to_light)
    }
}

/// A small generator of random numbers (splitmix64), so that every run has the same jobs.
struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        low + (high - low) * ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// The jobs, those only that see something.
pub(crate) fn jobs() -> Vec<Job> {
    let mut random = Random(1);
    let bounds = Bounds::new(DVec3::ZERO, dvec3(400.0, 50.0, 400.0)).unwrap();
    let mut jobs = Vec::new();
    while jobs.len() < 1000 {
        let mut r = |low, high| random.between(low, high);
        let eye = dvec3(r(-40.0, 440.0), r(1.0, 60.0), r(-40.0, 440.0));
        let forward = dvec3(r(-1.0, 1.0), r(-0.5, 0.3), r(-1.0, 1.0));
        let far = if r(0.0, 1.0) < 0.25 { f64::INFINITY } else { 70.0 + 9930.0 * r(0.0, 1.0) * r(0.0, 1.0) };
        let job = Job {
            frame: [eye, forward, DVec3::Y],
            fov_y: r(30.0, 100.0_f64).to_radians(),
            depth: [r(0.1, 1.0), far],
            to_light: dvec3(r(-1.0, 1.0), r(0.1, 1.5), r(-1.0, 1.0)),
            bounds,
        };
        if !Body::visible(&job.view().unwrap(), &bounds).is_empty() {
            jobs.push(job);
        }
    }
    jobs
}
