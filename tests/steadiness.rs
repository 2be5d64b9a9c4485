//! Steadiness: halving the step of a turning camera or light halves the largest move of a point in the map. A jump cannot
//! do that.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]
#![expect(clippy::disallowed_methods, reason = "tests may call what the library must not")]

mod scenes;

use scenes::random::Random;
use shadow_warp::glam::{DVec2, DVec3};
use shadow_warp::{Axes, Body, Bounds, ClipSpace, Error, Fit, Light, Objective, Rule, ShadowMap, View};

/// Degrees.
const STEPS: [f64; 3] = [0.04, 0.02, 0.01];
const SWEEP: f64 = 2.0;

/// A camera and a sun over a scene, as angles in degrees.
#[derive(Clone, Copy, Debug)]
struct Setting {
    eye: DVec3,
    /// Azimuth and elevation.
    view: [f64; 2],
    light: [f64; 2],
    fov: f64,
    near: f64,
    far: f64,
    bounds: Bounds,
}

/// What turns: one of the four angles.
const TURNS: [&str; 4] = ["camera's azimuth", "camera's elevation", "light's azimuth", "light's elevation"];

fn direction([azimuth, elevation]: [f64; 2]) -> DVec3 {
    let (a, e) = (azimuth.to_radians(), elevation.to_radians());
    DVec3::new(a.sin() * e.cos(), e.sin(), a.cos() * e.cos())
}

impl Setting {
    fn random(random: &mut Random) -> Self {
        let height = random.log_between(1.0, 60.0);
        let size = random.log_between(30.0, 500.0);
        let bounds = Bounds::new(DVec3::new(-size, 0.0, -size), DVec3::new(size, height, size)).unwrap();
        Self {
            eye: DVec3::new(
                random.between(-0.5, 0.5) * size,
                random.between(0.5, 1.5) * height,
                random.between(-0.5, 0.5) * size,
            ),
            view: [random.between(0.0, 360.0), random.between(-35.0, 15.0)],
            light: [random.between(0.0, 360.0), random.between(3.0, 85.0)],
            fov: random.between(30.0, 90.0),
            near: random.log_between(0.1, 2.0),
            far: random.log_between(100.0, 2000.0),
            bounds,
        }
    }

    fn turned(mut self, turn: usize, degrees: f64) -> Self {
        let angles = if turn < 2 { &mut self.view } else { &mut self.light };
        angles[turn % 2] += degrees;
        self
    }

    /// The sine of the angle between light and view.
    fn sine(&self) -> f64 {
        direction(self.view).cross(direction(self.light)).length()
    }

    fn solve<T>(&self, axes: Axes, rule: Rule, read: impl FnOnce(&Fit, &ShadowMap) -> T) -> Result<T, Error> {
        let view = View::perspective(
            self.eye,
            direction(self.view),
            DVec3::Y,
            self.fov.to_radians(),
            1.5,
            self.near..self.far,
        )?;
        let light = Light::directional(direction(self.light))?;
        let seen = [Body::visible(&view, &self.bounds)];
        let fit = Fit { axes, ..Fit::new(&view, &light, &self.bounds, &seen) };
        fit.solve(rule).map(|map| read(&fit, &map))
    }

    /// The places of some points in the map, in texels.
    fn places(&self, axes: Axes, rule: Rule, points: &[DVec3]) -> Result<Vec<DVec2>, Error> {
        self.solve(axes, rule, |fit, map| {
            let matrix = map.clip_from_world_at(self.eye, ClipSpace::WGPU);
            let half = DVec2::from(fit.map_size.map(f64::from)) * 0.5;
            points.iter().map(|p| matrix.project_point3(*p - self.eye).truncate() * half).collect()
        })
    }

    /// Points that are in what is seen.
    fn points(&self, random: &mut Random) -> Vec<DVec3> {
        self.solve(Axes::View, Rule::Uniform, |fit, _| {
            let body = fit.receivers[0];
            (0..12).map(|_| random.mixed(body.vertices()) + body.origin()).collect()
        })
        .unwrap_or_default()
    }
}

/// The largest move of a point over the sweep, for a step. `None` where the rule refuses on the way.
fn largest_move(setting: &Setting, turn: usize, axes: Axes, rule: Rule, points: &[DVec3], step: f64) -> Option<f64> {
    let count = (SWEEP / step).round() as usize;
    let mut last: Option<Vec<DVec2>> = None;
    let mut largest: f64 = 0.0;
    for i in 0..=count {
        let places = setting.turned(turn, i as f64 * step).places(axes, rule, points).ok()?;
        if let Some(last) = &last {
            let moved = places.iter().zip(last).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
            largest = largest.max(moved);
        }
        last = Some(places);
    }
    Some(largest)
}

/// The sweeps of a rule, and those among them in which a point jumps.
struct Sweeps {
    count: usize,
    jumps: Vec<String>,
}

impl Sweeps {
    /// Two degrees of each of four angles, for 60 settings; those apart that come near light along view.
    fn of(axes: Axes, rule: Rule, least_sine: f64) -> Self {
        let mut random = Random::new(5);
        let mut sweeps = Self { count: 0, jumps: Vec::new() };
        for case in 0..60 {
            let setting = Setting::random(&mut random);
            let points = setting.points(&mut random);
            for turn in 0..TURNS.len() {
                let sines = [0.0, SWEEP].map(|degrees| setting.turned(turn, degrees).sine());
                if points.is_empty() || sines[0].min(sines[1]) < least_sine {
                    continue;
                }
                sweeps.add(&setting, turn, axes, rule, &points, case);
            }
        }
        sweeps
    }

    fn add(&mut self, setting: &Setting, turn: usize, axes: Axes, rule: Rule, points: &[DVec3], case: usize) {
        let moves = STEPS.map(|step| largest_move(setting, turn, axes, rule, points, step));
        let [Some(a), Some(b), Some(c)] = moves else { return };
        self.count += 1;
        if a > 1e-6 && (b > 0.6 * a || c > 0.6 * b) {
            self.jumps.push(format!("case {case}, {}: {a} {b} {c} texels", TURNS[turn]));
        }
    }
}

/// All rules of which it is promised, away from light along view, where the axes of the view turn.
#[test]
fn no_jumps() {
    let published = scenes::LIGHT_SPACE_RULES.map(Rule::LightSpace);
    let others = [Rule::Uniform, Rule::OnAxis, Rule::TSM, Rule::PSM, Rule::Optimal(Objective::Along), Rule::OPTIMAL];
    for rule in published.into_iter().chain(others) {
        let Sweeps { count, jumps } = Sweeps::of(Axes::View, rule, 0.15);
        println!("{rule:?}: {count} sweeps");
        assert!(count > 200 && jumps.is_empty(), "{rule:?}: {count} {jumps:#?}");
    }
}

/// Axes that are fixed by the light have no singularity in the camera, and one in the light: from right below.
#[test]
fn no_jumps_at_all_with_fixed_axes() {
    for rule in [Rule::Uniform, Rule::LISPSM, Rule::TSM, Rule::OPTIMAL] {
        let mut sweeps = Sweeps::of(Axes::LightFixed, rule, 0.0);
        // Right through light along view, and against it.
        let mut random = Random::new(6);
        for case in 0..30 {
            let setting = Setting::random(&mut random);
            let [azimuth, elevation] = setting.view;
            let through = if case % 2 == 0 { [azimuth, elevation] } else { [azimuth + 180.0, -elevation] };
            let setting = Setting { light: through, ..setting };
            for turn in 0..TURNS.len() {
                let setting = setting.turned(turn, -0.5 * SWEEP);
                let points = setting.points(&mut random);
                if !points.is_empty() {
                    sweeps.add(&setting, turn, Axes::LightFixed, rule, &points, 1000 + case);
                }
            }
        }
        println!("{rule:?}: {} sweeps", sweeps.count);
        assert!(sweeps.count > 300 && sweeps.jumps.is_empty(), "{rule:?}: {} {:#?}", sweeps.count, sweeps.jumps);
    }
}

/// The objectives that may jump do so seldom; limited, they do not. The middle vector jumps with the vertices it is made of.
#[test]
fn jumps_are_seldom() {
    for objective in [Objective::Across, Objective::Product] {
        let Sweeps { count, jumps } = Sweeps::of(Axes::View, Rule::Optimal(objective), 0.15);
        println!("{objective:?}: {} of {count} sweeps jump", jumps.len());
        assert!(count > 200 && (1..=3).contains(&jumps.len()), "{objective:?}: {count} {jumps:#?}");
    }
    let Sweeps { count, jumps } = Sweeps::of(Axes::Middle, Rule::LISPSM, 0.3);
    println!("middle vector: {} of {count} sweeps jump", jumps.len());
    assert!(count > 150 && jumps.len() < 10, "{count} {jumps:#?}");
}
