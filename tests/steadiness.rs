//! Steadiness: a camera or a light turns, and points move in the map. Halving the step again and
//! again leaves nothing of the largest moves, unless they are jumps.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]
#![expect(clippy::disallowed_methods, reason = "tests may call what the library must not")]

mod random;

use proptest::prelude::*;
use random::basic::{Mixture, log_between, mixture};
use random::check;
use random::measure::LIGHT_SPACE_RULES;
use shadow_warp::glam::{DVec2, DVec3};
use shadow_warp::{Axes, Body, Bounds, ClipSpace, Error, Fit, Light, Objective, Rule, ShadowMap, View};

/// Degrees.
const STEP: f64 = 0.01;
const SWEEP: f64 = 2.0;
/// How often the step is halved: to 4e-11 degrees. (Some moves are as the square root of the step.)
const HALVINGS: usize = 28;
/// What is left of a move then that is no jump, in texels.
const LEFT: f64 = 0.01;

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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Turn {
    CameraAzimuth,
    CameraElevation,
    LightAzimuth,
    LightElevation,
}

const TURNS: [Turn; 4] = [Turn::CameraAzimuth, Turn::CameraElevation, Turn::LightAzimuth, Turn::LightElevation];

fn direction([azimuth, elevation]: [f64; 2]) -> DVec3 {
    let (a, e) = (azimuth.to_radians(), elevation.to_radians());
    DVec3::new(a.sin() * e.cos(), e.sin(), a.cos() * e.cos())
}

/// A camera over a wide and low scene, and a sun.
fn setting() -> impl Strategy<Value = Setting> + Clone {
    let eye = (-0.5..0.5, 0.5..1.5, -0.5..0.5);
    let angles = ([0.0..360.0, -35.0..15.0], [0.0..360.0, 3.0..85.0]);
    let lens = (30.0..90.0, log_between(0.1, 2.0), log_between(100.0, 2000.0));
    (log_between(1.0, 60.0), log_between(30.0, 500.0), eye, angles, lens).prop_map(
        |(height, size, eye, (view, light), (fov, near, far))| Setting {
            eye: DVec3::from(eye) * DVec3::new(size, height, size),
            view,
            light,
            fov,
            near,
            far,
            bounds: Bounds::new(DVec3::new(-size, 0.0, -size), DVec3::new(size, height, size)).unwrap(),
        },
    )
}

impl Setting {
    fn turned(mut self, turn: Turn, degrees: f64) -> Self {
        match turn {
            Turn::CameraAzimuth => self.view[0] += degrees,
            Turn::CameraElevation => self.view[1] += degrees,
            Turn::LightAzimuth => self.light[0] += degrees,
            Turn::LightElevation => self.light[1] += degrees,
        }
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

    /// The places of some points in the map, in texels; of those that it shows.
    fn places(&self, axes: Axes, rule: Rule, points: &[DVec3]) -> Result<Vec<Option<DVec2>>, Error> {
        self.solve(axes, rule, |fit, map| {
            let matrix = map.clip_from_world_at(self.eye, ClipSpace::WGPU);
            let half = DVec2::from(fit.map_size.map(f64::from)) * 0.5;
            let place = |p: DVec3| matrix.project_point3(p - self.eye).truncate();
            let is_shown = |p: DVec3| map.w(p) > 0.0 && place(p).abs().max_element() <= 1.0;
            points.iter().map(|p| is_shown(*p).then(|| place(*p) * half)).collect()
        })
    }

    /// Points that are in what is seen.
    fn points(&self, mixtures: &[Mixture]) -> Vec<DVec3> {
        self.solve(Axes::View, Rule::Uniform, |fit, _| {
            let body = fit.receivers[0];
            mixtures.iter().map(|q| q.of(body.vertices()) + body.origin()).collect()
        })
        .unwrap_or_default()
    }
}

/// The places of points in one frame.
type Places = Vec<Option<DVec2>>;

/// The largest move of a point that both frames show.
fn moved(before: &Places, after: &Places) -> f64 {
    let moves = before.iter().zip(after).filter_map(|(a, b)| Some((*a)?.distance((*b)?)));
    moves.fold(0.0, f64::max)
}

/// How many sweeps of each angle.
const SWEEPS: u32 = 30;

/// The largest jump over the sweep, in texels; `None` where nothing is swept, or the rule refuses.
fn jump(setting: &Setting, turn: Turn, axes: Axes, rule: Rule, points: &[Mixture]) -> Option<f64> {
    let points = setting.points(points);
    if points.is_empty() {
        return None;
    }
    let places = |degrees: f64| setting.turned(turn, degrees).places(axes, rule, &points).ok();
    let count = (SWEEP / STEP).round() as usize;
    let frames = (0..=count).map(|i| Some((i as f64 * STEP, places(i as f64 * STEP)?))).collect::<Option<Vec<_>>>()?;
    let mut steps: Vec<_> = frames.windows(2).collect();
    steps.sort_by(|a, b| moved(&b[0].1, &b[1].1).total_cmp(&moved(&a[0].1, &a[1].1)));
    let mut largest: f64 = 0.0;
    for step in &steps[..3] {
        let [mut before, mut after] = [step[0].clone(), step[1].clone()];
        for _ in 0..HALVINGS {
            let degrees = 0.5 * (before.0 + after.0);
            let middle = (degrees, places(degrees)?);
            if moved(&before.1, &middle.1) > moved(&middle.1, &after.1) { after = middle } else { before = middle }
        }
        largest = largest.max(moved(&before.1, &after.1));
    }
    Some(largest)
}

/// Calls `found` with what two degrees of each of four angles show, apart from what comes near
/// light along view.
fn each_sweep(name: &str, axes: Axes, rule: Rule, least_sine: f64, mut found: impl FnMut(f64)) {
    for turn in TURNS {
        let points = prop::array::uniform12(mixture());
        check(&format!("{name}/{turn:?}"), SWEEPS, (setting(), points), |(setting, points)| {
            let sines = [0.0, SWEEP].map(|degrees| setting.turned(turn, degrees).sine());
            if sines[0].min(sines[1]) >= least_sine {
                jump(&setting, turn, axes, rule, &points).into_iter().for_each(&mut found);
            }
        });
    }
}

/// All rules of which it is promised, away from light along view, where the axes of the view turn.
#[test]
fn no_jumps() {
    let published = LIGHT_SPACE_RULES.map(Rule::LightSpace);
    let others = [Rule::Uniform, Rule::TSM, Rule::PSM, Rule::Optimal(Objective::Along)];
    for (number, rule) in published.into_iter().chain(others).enumerate() {
        let mut count = 0;
        each_sweep(&format!("steady-{number}"), Axes::View, rule, 0.15, |swept| {
            count += 1;
            assert!(swept < LEFT, "{rule:?}: jumps by {swept} texels");
        });
        assert!(count > 2 * SWEEPS, "{rule:?}: {count}");
    }
}

/// The centroid moves as the view does, and the axes with it.
#[test]
fn no_jumps_with_the_middle_either() {
    for (name, rule) in [("uniform", Rule::Uniform), ("LiSPSM", Rule::LISPSM)] {
        let mut count = 0;
        each_sweep(&format!("middle-{name}"), Axes::Middle, rule, 0.3, |swept| {
            count += 1;
            assert!(swept < LEFT, "{rule:?}: jumps by {swept} texels");
        });
        assert!(count > SWEEPS, "{rule:?}: {count}");
    }
}

/// Axes that are fixed by the light have no singularity in the camera, and one in the light: from
/// right below.
#[test]
fn no_jumps_at_all_with_fixed_axes() {
    for (name, rule) in [("uniform", Rule::Uniform), ("LiSPSM", Rule::LISPSM), ("TSM", Rule::TSM)] {
        let mut count = 0;
        let mut found = |swept: f64| {
            count += 1;
            assert!(swept < LEFT, "{rule:?}: jumps by {swept} texels");
        };
        each_sweep(&format!("fixed-{name}"), Axes::LightFixed, rule, 0.0, &mut found);
        // Right through light along view, and against it.
        for turn in TURNS {
            let strategy = (setting(), any::<bool>(), prop::array::uniform12(mixture()));
            check(&format!("through-{name}/{turn:?}"), SWEEPS, strategy, |(setting, against, points)| {
                let [azimuth, elevation] = setting.view;
                let light = if against { [azimuth + 180.0, -elevation] } else { [azimuth, elevation] };
                let setting = Setting { light, ..setting }.turned(turn, -0.5 * SWEEP);
                jump(&setting, turn, Axes::LightFixed, rule, &points).into_iter().for_each(&mut found);
            });
        }
        assert!(count > 6 * SWEEPS, "{rule:?}: {count}");
    }
}

/// The rules that may jump do so seldom: of two warps that are equally good for other scenes than
/// this one. The mean of the vertices jumps as vertices come and go.
#[test]
fn jumps_are_seldom() {
    let sweeps = |name: &str, axes: Axes, rule: Rule, least_sine: f64| {
        let (mut count, mut jumps) = (0, 0);
        each_sweep(name, axes, rule, least_sine, |swept| {
            count += 1;
            jumps += u32::from(swept >= LEFT);
        });
        println!("{name}: {jumps} of {count} sweeps jump");
        assert!(count > 20 && jumps * 8 < count, "{name}: {jumps} of {count}");
    };
    sweeps("seldom/on-axis", Axes::View, Rule::OnAxis, 0.15);
    sweeps("seldom/optimal", Axes::View, Rule::OPTIMAL, 0.15);
    sweeps("seldom/across", Axes::View, Rule::Optimal(Objective::Across), 0.15);
    sweeps("seldom/product", Axes::View, Rule::Optimal(Objective::Product), 0.15);
    sweeps("seldom/vertex-mean", Axes::VertexMean, Rule::LISPSM, 0.3);
}
