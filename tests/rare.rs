//! Rare faults: many outdoor scenes, and cameras that turn full circle in small steps.
//!
//! The usual run takes a share of them. `SHADOW_WARP_CASES=500 cargo test --release --test rare -- --nocapture` runs
//! 3,000,000 scenes and five turns of 360,000 frames, in minutes, and prints what it counted.
#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]
#![expect(clippy::disallowed_methods, reason = "tests may call what the library must not")]

mod random;

use std::cell::RefCell;

use proptest::prelude::*;
use random::basic::log_between;
use random::measure::product_rounding;
use random::{check, multiplier};
use shadow_warp::glam::{DVec2, DVec3, dvec3};
use shadow_warp::{Axes, Body, Bounds, ClipSpace, Fit, Light, LightSpaceRule, Objective, Rule, ShadowMap, View, Warp};

/// Of two maps with the same worst texel either may be the one that is a rounding better.
const ROUNDING: f64 = 1e-9;

/// A rule, and what is promised of it.
#[derive(Clone, Copy, Debug)]
struct Entry {
    name: &'static str,
    rule: Rule,
    axes: Axes,
    /// By `Fit::worst_texel`, and on its own axes, never worse than no warp.
    is_never_worse: bool,
    /// Continuous in the camera, where light and view are not parallel (the axes fixed by the light: there too).
    is_continuous: bool,
}

const fn entry(name: &'static str, axes: Axes, rule: Rule, is_never_worse: bool, is_continuous: bool) -> Entry {
    Entry { name, rule, axes, is_never_worse, is_continuous }
}

const ENTRIES: [Entry; 18] = [
    entry("uniform", Axes::View, Rule::Uniform, true, true),
    entry("LiSPSM, extent", Axes::View, Rule::LightSpace(LightSpaceRule::Extent), false, true),
    entry("LiSPSM", Axes::View, Rule::LISPSM, false, true),
    entry("LiSPSM, view depth", Axes::View, Rule::LightSpace(LightSpaceRule::ViewDepth), false, true),
    entry("LiSPSM, depth", Axes::View, Rule::LightSpace(LightSpaceRule::Depth), false, true),
    entry("on axis", Axes::View, Rule::OnAxis, false, false),
    entry("TSM", Axes::View, Rule::TSM, false, true),
    entry("PSM", Axes::View, Rule::PSM, false, false),
    entry("optimal", Axes::View, Rule::OPTIMAL, true, false),
    entry("optimal along", Axes::View, Rule::Optimal(Objective::Along), false, true),
    entry("optimal across", Axes::View, Rule::Optimal(Objective::Across), false, false),
    entry("optimal product", Axes::View, Rule::Optimal(Objective::Product), false, false),
    entry("uniform, fixed axes", Axes::LightFixed, Rule::Uniform, true, true),
    entry("LiSPSM, fixed axes", Axes::LightFixed, Rule::LISPSM, false, true),
    entry("optimal, fixed axes", Axes::LightFixed, Rule::OPTIMAL, true, false),
    entry("LiSPSM, middle", Axes::Middle, Rule::LISPSM, false, true),
    entry("optimal, middle", Axes::Middle, Rule::OPTIMAL, true, false),
    entry("LiSPSM, vertex mean", Axes::VertexMean, Rule::LISPSM, false, false),
];

/// A camera over a landscape, as angles in degrees.
#[derive(Clone, Debug)]
struct Outdoors {
    eye: DVec3,
    /// Azimuth, elevation.
    view: [f64; 2],
    light: [f64; 2],
    fov: f64,
    near: f64,
    far: f64,
    bounds: Bounds,
}

fn direction([azimuth, elevation]: [f64; 2]) -> DVec3 {
    let (a, e) = (azimuth.to_radians(), elevation.to_radians());
    dvec3(a.sin() * e.cos(), e.sin(), a.cos() * e.cos())
}

fn outdoors() -> impl Strategy<Value = Outdoors> {
    let bounds = (log_between(30.0, 5000.0), log_between(0.1, 600.0));
    let view = ([-0.9..0.9, -0.9..0.9], log_between(0.5, 200.0), [0.0..360.0, -60.0..20.0]);
    let light = [0.0..360.0, 1.0..90.0];
    (bounds, view, light, 30.0..100.0, log_between(0.05, 8.0), log_between(50.0, 30_000.0)).prop_map(
        |((size, height), (place, above, view), light, fov, near, far)| Outdoors {
            eye: dvec3(place[0] * size, above, place[1] * size),
            view,
            light,
            fov,
            near,
            far,
            bounds: Bounds::new(dvec3(-size, 0.0, -size), dvec3(size, height, size)).unwrap(),
        },
    )
}

impl Outdoors {
    /// Calls `f` with the job, if anything is seen.
    fn fit<T>(&self, f: impl FnOnce(Fit) -> T) -> Option<T> {
        let depth = self.near..self.far;
        let view =
            View::perspective(self.eye, direction(self.view), DVec3::Y, self.fov.to_radians(), 16.0 / 9.0, depth);
        let (view, light) = (view.unwrap(), Light::directional(direction(self.light)).unwrap());
        let seen = [Body::visible(&view, &self.bounds)];
        (!seen[0].is_empty()).then(|| f(Fit { map_size: [2048, 2048], ..Fit::new(&view, &light, &self.bounds, &seen) }))
    }
}

/// What became of a rule.
#[derive(Clone, Copy, Debug, Default)]
struct Count {
    maps: u64,
    refused: u64,
    above_no_warp: u64,
    outside: u64,
    worst_outside: f64,
    /// Its worst texel over that of no warp, at most.
    most: f64,
    /// Steps that move a point by more than [`JUMP`], and those of them that are jumps.
    steep: u64,
    jumps: u64,
    greatest_jump: f64,
}

impl Count {
    /// Takes in a map, and asserts what is promised of it.
    fn note(&mut self, entry: &Entry, fit: &Fit, map: &ShadowMap) {
        self.maps += 1;
        let worst = fit.worst_texel(map);
        let plain = fit.worst_texel(&fit.solve(Rule::Uniform).unwrap());
        self.most = self.most.max(worst / plain);
        let is_worse = worst > plain * (1.0 + ROUNDING);
        self.above_no_warp += u64::from(is_worse);
        assert!(worst.is_finite() && worst > 0.0, "{}: {worst}", entry.name);
        assert!(!(entry.is_never_worse && is_worse), "{}: {worst}, {plain} without", entry.name);
        // On axes fixed by the light the finished map counts, not its own objective.
        if let (Rule::Optimal(objective), true) = (entry.rule, entry.axes != Axes::LightFixed) {
            let [own, none] = [map.warp(), Warp::UNIFORM].map(|warp| objective.of(&fit.errors(warp).unwrap()));
            assert!(own <= none * (1.0 + ROUNDING), "{}: {own}, {none} without", entry.name);
        }
        let out = beyond(fit, map);
        self.worst_outside = self.worst_outside.max(out);
        let allowed = 1e-12 * (1.0 + map.warp().ratio());
        self.outside += u64::from(out > allowed);
        assert!(out <= allowed, "{}: {out:e} outside", entry.name);
    }
}

fn print(title: &str, counts: &[Count]) {
    println!(
        "\n{title}\n| rule | maps | refused | above no warp | at most | outside | by | steep | jumps | texels |\n|---|---|---|---|---|---|---|---|---|---|"
    );
    for (Entry { name, .. }, c) in ENTRIES.iter().zip(counts) {
        let Count { maps, refused, above_no_warp, most, outside, worst_outside, steep, jumps, greatest_jump } = c;
        println!(
            "| {name} | {maps} | {refused} | {above_no_warp} | {most:.3} | {outside} | {worst_outside:.1e} | {steep} | {jumps} | {greatest_jump:.1} |"
        );
    }
}

/// How far a vertex lies outside of the map in normalised device coordinates, by more than the rounding of its product with
/// the matrix. (Of a sliver far away little else is left.)
fn beyond(fit: &Fit, map: &ShadowMap) -> f64 {
    let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
    let relative = |body: &Body| {
        let shift = body.origin() - map.origin();
        body.vertices().iter().map(move |v| *v + shift).collect::<Vec<_>>()
    };
    let vertices = fit.receivers.iter().flat_map(relative);
    vertices.fold(0.0, |worst, q| {
        let p = matrix * q.extend(1.0);
        let p = p.truncate() / p.w;
        worst.max(p.x.abs().max(p.y.abs()).max(2.0 * p.z.max(1.0 - p.z) - 1.0) - 1.0 - product_rounding(map, q))
    })
}

#[test]
fn outdoor_scenes() {
    let counts = RefCell::new([Count::default(); ENTRIES.len()]);
    check("rare/outdoors", 6_000, outdoors(), |scene| {
        scene.fit(|fit| {
            for (entry, count) in ENTRIES.iter().zip(counts.borrow_mut().iter_mut()) {
                let fit = Fit { axes: entry.axes, ..fit };
                let Ok(map) = fit.solve(entry.rule) else {
                    count.refused += 1;
                    continue;
                };
                count.note(entry, &fit, &map);
            }
        });
    });
    print("outdoor scenes", &*counts.borrow());
}

/// Steps of a turn, in degrees, and how many make a full circle.
const STEP: f64 = 0.001;
const CIRCLE: u32 = 360_000;
/// The parts of a circle that the usual run takes a share of.
const PARTS: u32 = 36;
/// A jump moves a point by more than this many texels in one step, and goes on doing so however small the step.
const JUMP: f64 = 1.0;

/// Five cameras: over a wide landscape, on a street, over a slab, under a high sun, and one that passes right through light along
/// view.
fn cameras() -> [Outdoors; 5] {
    let camera = |eye, pitch, light, fov, [near, far]: [f64; 2], [size, height]: [f64; 2]| Outdoors {
        eye,
        view: [0.0, pitch],
        light,
        fov,
        near,
        far,
        bounds: Bounds::new(dvec3(-size, 0.0, -size), dvec3(size, height, size)).unwrap(),
    };
    [
        camera(dvec3(0.0, 64.0, 0.0), -20.0, [180.0, 30.0], 75.0, [7.0, 30_000.0], [4000.0, 512.0]),
        camera(dvec3(3.0, 1.8, -7.0), 5.0, [33.0, 50.0], 70.0, [0.1, 500.0], [120.0, 30.0]),
        camera(dvec3(-20.0, 10.0, 31.0), -15.0, [250.0, 40.0], 60.0, [0.5, 1000.0], [200.0, 0.0]),
        camera(dvec3(10.0, 40.0, 10.0), -35.0, [70.0, 80.0], 50.0, [1.0, 2000.0], [300.0, 50.0]),
        camera(dvec3(0.0, 6.0, 0.0), -25.0, [140.0, 25.0], 65.0, [0.3, 800.0], [250.0, 12.0]),
    ]
}

impl Outdoors {
    /// Points on the ground all around.
    fn ground(&self) -> Vec<DVec3> {
        let size = self.bounds.max().x;
        let point = |i: u32| {
            let away = size * [0.02, 0.05, 0.12, 0.3, 0.7][i as usize % 5];
            let p = self.eye + away * direction([f64::from(i) * 7.2, 0.0]);
            dvec3(p.x.clamp(-size, size), 0.0, p.z.clamp(-size, size))
        };
        (0..50).map(point).collect()
    }

    fn turned(&self, degrees: f64) -> Self {
        Self { view: [degrees, self.view[1]], ..self.clone() }
    }
}

/// The places of those points in the map that are seen, in texels.
fn places(fit: &Fit, map: &ShadowMap, points: &[DVec3]) -> Vec<Option<DVec2>> {
    let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
    let body = &fit.receivers[0];
    let place = |p: &DVec3| {
        let q = matrix * (*p - map.origin()).extend(1.0);
        body.contains(*p - body.origin()).then(|| q.truncate().truncate() / q.w * 1024.0)
    };
    points.iter().map(place).collect()
}

/// The greatest move of a point that is seen before and after.
fn greatest_move(before: &[Option<DVec2>], after: &[Option<DVec2>]) -> f64 {
    let both = before.iter().zip(after).filter_map(|(a, b)| Some((*a)?.distance((*b)?)));
    both.fold(0.0, f64::max)
}

/// What is left of a move between two angles when the step is halved again and again, down to rounding.
fn jump(camera: &Outdoors, entry: &Entry, [mut low, mut high]: [f64; 2], points: &[DVec3]) -> f64 {
    let at = |degrees: f64| {
        let solved = camera.turned(degrees).fit(|fit| {
            let fit = Fit { axes: entry.axes, ..fit };
            fit.solve(entry.rule).ok().map(|map| places(&fit, &map, points))
        });
        solved.flatten().unwrap_or_default()
    };
    let (mut before, mut after) = (at(low), at(high));
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        let between = at(middle);
        if greatest_move(&before, &between) >= greatest_move(&between, &after) {
            (high, after) = (middle, between);
        } else {
            (low, before) = (middle, between);
        }
    }
    greatest_move(&before, &after)
}

#[test]
fn full_circles() {
    for (number, camera) in cameras().iter().enumerate() {
        let mut counts = [Count::default(); ENTRIES.len()];
        let points = camera.ground();
        let frames = (20 * multiplier()).min(CIRCLE / PARTS);
        for part in 0..PARTS {
            let mut before: [Vec<Option<DVec2>>; ENTRIES.len()] = Default::default();
            for frame in 0..=frames {
                let degrees = f64::from(part * (CIRCLE / PARTS) + frame) * STEP;
                camera.turned(degrees).fit(|fit| {
                    for ((entry, count), before) in ENTRIES.iter().zip(&mut counts).zip(&mut before) {
                        let fit = Fit { axes: entry.axes, ..fit };
                        let Ok(map) = fit.solve(entry.rule) else {
                            count.refused += 1;
                            before.clear();
                            continue;
                        };
                        count.note(entry, &fit, &map);
                        let after = places(&fit, &map, &points);
                        let moved = greatest_move(before, &after);
                        if moved > JUMP {
                            let left = jump(camera, entry, [degrees - STEP, degrees], &points);
                            // Light along view, where axes that follow the view turn about.
                            let is_parallel = number == 4 && entry.axes != Axes::LightFixed;
                            assert!(
                                left <= 0.5 * JUMP || is_parallel || !entry.is_continuous,
                                "{}: {left} texels at {degrees} degrees of camera {number}",
                                entry.name
                            );
                            count.jumps += u64::from(left > 0.5 * JUMP);
                            count.greatest_jump = count.greatest_jump.max(left);
                            count.steep += 1;
                        }
                        *before = after;
                    }
                });
            }
        }
        print(&format!("camera {number}, {} frames", PARTS * frames), &counts);
    }
}
