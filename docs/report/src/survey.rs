//! All techniques over some hundreds of settings, as a page: `docs/survey.md`.

use std::fmt::Write;

use anyhow::{Context, Result};
use fastrand::Rng;
use shadow_warp::glam::{DVec2, DVec3, dvec3};
use shadow_warp::{Axes, Body, Bounds, Error, Fit, Light, Objective, Rule, View};

use crate::table::short;

/// A kind of setting: what it is, and how one is made by chance.
struct Kind {
    what: &'static str,
    make: fn(&mut Rng) -> Result<Setting, Error>,
}

struct Setting {
    view: View,
    light: Light,
    bounds: Bounds,
}

const EACH: usize = 40;
const KINDS: [Kind; 7] = [
    Kind {
        what: "a landscape with the sun anywhere above 10 degrees",
        make: |r| outside(r, 10.0..90.0, 5.0..60.0, 0.0),
    },
    Kind { what: "the same, camera rolled by up to 90 degrees", make: |r| outside(r, 10.0..90.0, 5.0..60.0, 90.0) },
    Kind { what: "grazing suns, 0.5 to 8 degrees high", make: |r| outside(r, 0.5..8.0, 5.0..60.0, 0.0) },
    Kind { what: "slabs: ground with at most 1 in 100 of height", make: |r| outside(r, 5.0..90.0, 0.0..2.0, 0.0) },
    Kind { what: "slabs under grazing suns", make: |r| outside(r, 0.5..8.0, 0.0..2.0, 20.0) },
    Kind { what: "light within 20 degrees of along the view or against it", make: parallel },
    Kind { what: "a box around the camera, any light", make: inside },
];

fn between(random: &mut Rng, range: &std::ops::Range<f64>) -> f64 {
    range.start + (range.end - range.start) * random.f64()
}

/// As many of each order of magnitude.
#[expect(clippy::disallowed_methods, reason = "the library's numbers do not depend on it")]
fn spread(random: &mut Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(random.f64())
}

fn direction(azimuth: f64, elevation: f64) -> DVec3 {
    let [a, e] = [azimuth, elevation].map(|angle| DVec2::from_angle(angle.to_radians()));
    dvec3(a.y * e.x, e.y, a.x * e.x)
}

fn camera(random: &mut Rng, eye: DVec3, forward: DVec3, roll: f64) -> Result<View, Error> {
    let level = View::perspective(eye, forward, DVec3::Y, 1.0, 1.0, 1.0..2.0)?;
    let roll = DVec2::from_angle((roll * (2.0 * random.f64() - 1.0)).to_radians());
    let up = level.up() * roll.x + level.right() * roll.y;
    let fov = between(random, &(30.0..100.0)).to_radians();
    let near = spread(random, 0.1, 2.0);
    let far = if random.f64() < 0.25 { f64::INFINITY } else { spread(random, 100.0, 5000.0) };
    View::perspective(eye, forward, up, fov, 16.0 / 9.0, near..far)
}

fn outside(
    random: &mut Rng,
    sun: std::ops::Range<f64>,
    height: std::ops::Range<f64>,
    roll: f64,
) -> Result<Setting, Error> {
    let (size, height) = (spread(random, 100.0, 1000.0), between(random, &height));
    let bounds = Bounds::new(dvec3(-size, 0.0, -size), dvec3(size, height, size))?;
    let mut place = || (2.0 * random.f64() - 1.0) * 0.8 * size;
    let (x, z) = (place(), place());
    let eye = dvec3(x, spread(random, 1.0, 40.0), z);
    let forward = direction(360.0 * random.f64(), between(random, &(-30.0..10.0)));
    let view = camera(random, eye, forward, roll)?;
    let light = Light::directional(direction(360.0 * random.f64(), between(random, &sun)))?;
    Ok(Setting { view, light, bounds })
}

fn parallel(random: &mut Rng) -> Result<Setting, Error> {
    let Setting { view, bounds, .. } = outside(random, 10.0..90.0, 5.0..60.0, 0.0)?;
    let [angle, turn] = [20.0, 360.0].map(|most| DVec2::from_angle((most * random.f64()).to_radians()));
    let across = view.right() * turn.x + view.up() * turn.y;
    let sign = if random.bool() { 1.0 } else { -1.0 };
    let light = Light::directional(sign * view.forward() * angle.x + across * angle.y)?;
    Ok(Setting { view, light, bounds })
}

fn inside(random: &mut Rng) -> Result<Setting, Error> {
    let size = spread(random, 5.0, 200.0);
    let bounds = Bounds::new(DVec3::splat(-size), DVec3::splat(size))?;
    let mut place = || (2.0 * random.f64() - 1.0) * 0.9 * size;
    let eye = dvec3(place(), place(), place());
    let forward = direction(360.0 * random.f64(), between(random, &(-60.0..60.0)));
    let view = camera(random, eye, forward, 180.0)?;
    let light = Light::directional(direction(360.0 * random.f64(), 180.0 * random.f64() - 90.0))?;
    Ok(Setting { view, light, bounds })
}

/// A technique of the page: on its own axes, or on those of the view as the optimum is.
struct Entry {
    name: &'static str,
    axes: Axes,
    rule: Rule,
}

const UNIFORM: usize = 0;
const OPTIMAL: usize = 5;
const ENTRIES: [Entry; 8] = [
    Entry { name: "uniform", axes: Axes::View, rule: Rule::Uniform },
    Entry { name: "lispsm", axes: Axes::View, rule: Rule::LISPSM },
    Entry { name: "lispsm-on-axis", axes: Axes::View, rule: Rule::OnAxis },
    Entry { name: "tsm", axes: Axes::View, rule: Rule::TSM },
    Entry { name: "psm", axes: Axes::View, rule: Rule::PSM },
    Entry { name: "optimal", axes: Axes::View, rule: Rule::OPTIMAL },
    Entry { name: "lispsm-middle", axes: Axes::Middle, rule: Rule::LISPSM },
    Entry { name: "optimal, middle vector", axes: Axes::Middle, rule: Rule::OPTIMAL },
];

/// Worst pixels per texel of each entry, where it does not refuse, and the least that any ratio and
/// spacing can have on the view's axes, with their centre.
struct Outcome {
    worst: [Option<f64>; ENTRIES.len()],
    bound: f64,
}

fn measure(setting: &Setting) -> Result<Option<Outcome>> {
    let Setting { view, light, bounds } = setting;
    let seen = [Body::visible(view, bounds)];
    let fit = Fit { map_size: [2048; 2], ..Fit::new(view, light, bounds, &seen) };
    let mut worst = [None; ENTRIES.len()];
    for (entry, worst) in ENTRIES.iter().zip(&mut worst) {
        match (Fit { axes: entry.axes, ..fit }).solve(entry.rule) {
            Ok(map) => *worst = Some(fit.worst_texel(&map)),
            Err(Error::NothingVisible) => return Ok(None),
            Err(Error::Unsupported { .. }) => {}
            Err(error) => return Err(error).context(entry.name),
        }
    }
    Ok(Some(Outcome { worst, bound: Objective::Larger.of(&fit.least_errors()?) }))
}

/// The page.
pub(crate) fn page() -> Result<String> {
    let mut random = Rng::with_seed(1);
    let mut groups = Vec::new();
    for kind in &KINDS {
        let mut outcomes = Vec::new();
        while outcomes.len() < EACH {
            outcomes.extend(measure(&(kind.make)(&mut random)?)?);
        }
        groups.push((kind.what, outcomes));
    }
    let all: Vec<&Outcome> = groups.iter().flat_map(|(_, outcomes)| outcomes).collect();
    let mut page = String::from(include_str!("survey.md"));
    let names = ENTRIES.map(|entry| entry.name).join(" | ");
    let _ = writeln!(page, "| settings | | {names} |\n|---|---|{}", "---|".repeat(ENTRIES.len()));
    let everything = [("all", all.clone())];
    let groups = groups.iter().map(|(what, outcomes)| (*what, outcomes.iter().collect::<Vec<_>>()));
    for (what, outcomes) in groups.chain(everything) {
        for (title, share) in [("median", 0.5), ("worst", 1.0)] {
            let cells = (0..ENTRIES.len()).map(|entry| cell(&outcomes, entry, share)).collect::<Vec<_>>().join(" | ");
            let what = if share < 1.0 { format!("{what} ({})", outcomes.len()) } else { String::new() };
            let _ = writeln!(page, "| {what} | {title} | {cells} |");
        }
    }
    page.push_str("\n## Against the optimum\n\n| technique | settings | better than `optimal` | by at most | worse, in the median by | by at most | refused |\n|---|---|---|---|---|---|---|\n");
    for (number, entry) in ENTRIES.iter().enumerate().filter(|(number, _)| *number != OPTIMAL) {
        let ratios = sorted(all.iter().filter_map(|o| Some(o.worst[number]? / o.worst[OPTIMAL]?)));
        let better = ratios.iter().filter(|ratio| **ratio < 1.0 - 1e-9).count();
        let by = |ratio: f64| if better > 0 { format!("{}x", short(1.0 / ratio)) } else { "-".to_owned() };
        let _ = writeln!(
            page,
            "| {} | {} | {better} | {} | {}x | {}x | {} |",
            entry.name,
            ratios.len(),
            by(ratios[0]),
            short(quantile(&ratios, 0.5)),
            short(quantile(&ratios, 1.0)),
            all.len() - ratios.len()
        );
    }
    let gaps = sorted(all.iter().filter_map(|o| Some(o.worst[OPTIMAL]? / o.bound)));
    let _ = writeln!(
        page,
        "\nNo map with the view's axes and the centre of these warps, whatever its ratio and its spacing of texels, can be better than \
         `optimal` by more than {}x in the median setting, {}x in nine of ten, and {}x in any of them (`Fit::least_errors`). A map \
         with another centre may.",
        short(quantile(&gaps, 0.5)),
        short(quantile(&gaps, 0.9)),
        short(quantile(&gaps, 1.0))
    );
    Ok(page)
}

/// A technique's worst pixels per texel over those of the uniform map.
fn cell(outcomes: &[&Outcome], entry: usize, share: f64) -> String {
    let ratios = sorted(outcomes.iter().filter_map(|o| Some(o.worst[entry]? / o.worst[UNIFORM]?)));
    if ratios.is_empty() { "-".to_owned() } else { short(quantile(&ratios, share)) }
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

fn quantile(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenes::TECHNIQUES;

    /// On the same axes nothing is better than the optimum, to 1e-9 of it, over more than 200
    /// settings.
    #[test]
    fn nothing_on_its_axes_beats_the_optimum() -> Result<()> {
        let mut random = Rng::with_seed(2);
        let (mut count, mut refused) = (0, 0);
        for kind in KINDS.iter().cycle().take(60 * KINDS.len()) {
            let Some(outcome) = measure(&(kind.make)(&mut random)?)? else { continue };
            count += 1;
            let optimal = outcome.worst[OPTIMAL].context("the optimum refuses nothing")?;
            for (entry, worst) in ENTRIES.iter().zip(outcome.worst) {
                let in_the_family = entry.axes == Axes::View && entry.name != "psm";
                refused += u32::from(worst.is_none());
                assert!(!in_the_family || worst.is_some_and(|worst| optimal <= worst * (1.0 + 1e-9)), "{}", entry.name);
            }
            assert!(optimal >= outcome.bound * (1.0 - 1e-9));
        }
        assert!(count > 200 && refused == 0, "{count} {refused}");
        // What the page calls a technique is one.
        for entry in &ENTRIES[..=OPTIMAL] {
            assert!(TECHNIQUES.iter().any(|technique| technique.name == entry.name), "{}", entry.name);
        }
        Ok(())
    }

    #[test]
    fn the_page_is_what_the_program_prints() -> Result<()> {
        assert_eq!(
            include_str!("../../survey.md"),
            page()?,
            "run: cargo run --release -p report -- --survey > docs/survey.md"
        );
        Ok(())
    }
}
