//! Realistic jobs, a thousand of each kind, the same in every run.
//!
//! | kind | receivers and casters | light |
//! |---|---|---|
//! | [`suns`] | a box of 400 x 50 x 400 | the sun, anywhere above the horizon |
//! | [`grounds`] | a box of 400 x 2 x 400 | the sun, behind the camera |
//! | [`spots`] | as for the sun | a spot light of 10 to 60 degrees in or over the box, pointing down |
//! | [`points`] | as for the sun | a point light in the box |
//!
//! The cameras are in the box and around it. Near is 0.1 to 1, far 70 to 10,000 or infinite, the field
//! of view 30 to 100 degrees.

use core::fmt::Debug;
use core::ops::Range;

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngSeed, TestRunner};
use shadow_warp::glam::{DVec3, dvec3};
use shadow_warp::{Body, Bounds, Fit, Light, Rule, ShadowMap, View};

/// How many jobs there are of each kind.
pub(crate) const COUNT: usize = 1000;

/// The numbers that a camera is made of, as an engine holds them.
#[derive(Clone, Debug)]
pub(crate) struct Camera {
    eye: DVec3,
    forward: DVec3,
    /// Vertical, in radians.
    fov_y: f64,
    depths: Range<f64>,
}

impl Camera {
    /// The view.
    pub(crate) fn view(&self) -> View {
        View::perspective(self.eye, self.forward, DVec3::Y, self.fov_y, 16.0 / 9.0, self.depths.clone()).unwrap()
    }
}

/// The numbers that a light is made of.
#[derive(Clone, Debug)]
pub(crate) enum Lamp {
    Sun { to_light: DVec3 },
    Spot { position: DVec3, direction: DVec3, outer_angle: f64, reach: [f64; 2] },
    Point { position: DVec3, reach: [f64; 2] },
}

impl Lamp {
    /// The light.
    pub(crate) fn light(&self) -> Light {
        match *self {
            Self::Sun { to_light } => Light::directional(to_light),
            Self::Spot { position, direction, outer_angle, reach: [near, range] } => {
                Light::spot(position, direction, outer_angle, near, range)
            }
            Self::Point { position, reach: [near, range] } => Light::point(position, near, range),
        }
        .unwrap()
    }
}

/// A job, with its first steps done.
#[derive(Clone, Debug)]
pub(crate) struct Job {
    pub(crate) camera: Camera,
    pub(crate) lamp: Lamp,
    /// Of casters and receivers.
    pub(crate) bounds: Bounds,
    pub(crate) view: View,
    /// For a point light, the first of its faces that needs a map.
    pub(crate) light: Light,
    pub(crate) receivers: [Body; 1],
    /// By [`Rule::LISPSM`].
    pub(crate) map: ShadowMap,
}

impl Job {
    /// `None` if nothing is seen, or nothing of it is lit.
    fn new(camera: Camera, lamp: Lamp, bounds: Bounds) -> Option<Self> {
        let view = camera.view();
        let receivers = [Body::visible(&view, &bounds)];
        let solved = |light| Some((light, Fit::new(&view, &light, &bounds, &receivers).solve(Rule::LISPSM).ok()?));
        let (light, map) = match lamp.light() {
            Light::Point(point) => point.faces().into_iter().find_map(solved)?,
            light => solved(light)?,
        };
        Some(Self { camera, lamp, bounds, view, light, receivers, map })
    }

    pub(crate) fn fit(&self) -> Fit<'_> {
        Fit::new(&self.view, &self.light, &self.bounds, &self.receivers)
    }
}

/// The box of casters and receivers.
fn scene(height: f64) -> Bounds {
    Bounds::new(DVec3::ZERO, dvec3(400.0, height, 400.0)).unwrap()
}

/// Each coordinate evenly from its range.
fn within(x: Range<f64>, y: Range<f64>, z: Range<f64>) -> impl Strategy<Value = DVec3> {
    (x, y, z).prop_map(|(x, y, z)| dvec3(x, y, z))
}

/// Cameras that look up and down by this range of slopes.
fn cameras(slopes: Range<f64>) -> impl Strategy<Value = Camera> {
    let eye = within(-40.0..440.0, 1.0..60.0, -40.0..440.0);
    let forward = within(-1.0..1.0, slopes, -1.0..1.0);
    let far = prop_oneof![
        1 => Just(f64::INFINITY),
        3 => (0.0..1.0, 0.0..1.0).prop_map(|(a, b)| 70.0 + 9930.0 * a * b),
    ];
    (eye, forward, 30.0..100_f64, 0.1..1.0, far).prop_map(|(eye, forward, degrees, near, far)| Camera {
        eye,
        forward,
        fov_y: degrees.to_radians(),
        depths: near..far,
    })
}

fn to_sun() -> impl Strategy<Value = DVec3> {
    within(-1.0..1.0, 0.1..1.5, -1.0..1.0)
}

/// As many jobs as are wanted, without those that have nothing to do.
fn draw<T: Debug>(jobs: impl Strategy<Value = Option<T>>) -> Vec<T> {
    let config = Config { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() };
    let mut runner = TestRunner::new(config);
    let values = core::iter::repeat_with(|| jobs.new_tree(&mut runner).unwrap().current());
    values.flatten().take(COUNT).collect()
}

/// The sun over all that there is.
pub(crate) fn suns() -> Vec<Job> {
    draw(
        (cameras(-0.5..0.3), to_sun())
            .prop_map(|(camera, to_light)| Job::new(camera, Lamp::Sun { to_light }, scene(50.0))),
    )
}

/// The sun over flat ground. It is behind a camera that looks down, so that no shadow falls behind
/// the eye.
pub(crate) fn grounds() -> Vec<Job> {
    draw((cameras(-0.5..0.0), to_sun()).prop_map(|(camera, to_light)| {
        let [ahead, aside] = [camera.forward, to_light].map(|v| dvec3(v.x, 0.0, v.z));
        let behind = if ahead.dot(aside) > 0.0 { -1.0 } else { 1.0 };
        let to_light = dvec3(behind * to_light.x, to_light.y, behind * to_light.z);
        Job::new(camera, Lamp::Sun { to_light }, scene(2.0))
    }))
}

/// Spot lights.
pub(crate) fn spots() -> Vec<Job> {
    let place = within(0.0..400.0, 5.0..80.0, 0.0..400.0);
    let spot = (place, within(-1.0..1.0, -1.0..0.0, -1.0..1.0), 10.0..60_f64, 0.1..1.0, 50.0..400.0);
    let lamp = spot.prop_map(|(position, direction, degrees, near, range)| Lamp::Spot {
        position,
        direction,
        outer_angle: degrees.to_radians(),
        reach: [near, range],
    });
    draw((cameras(-0.5..0.3), lamp).prop_map(|(camera, lamp)| Job::new(camera, lamp, scene(50.0))))
}

/// Point lights.
pub(crate) fn points() -> Vec<Job> {
    let place = within(0.0..400.0, 1.0..50.0, 0.0..400.0);
    let lamp = (place, 0.1..1.0, 20.0..200.0)
        .prop_map(|(position, near, range)| Lamp::Point { position, reach: [near, range] });
    draw((cameras(-0.5..0.3), lamp).prop_map(|(camera, lamp)| Job::new(camera, lamp, scene(50.0))))
}
