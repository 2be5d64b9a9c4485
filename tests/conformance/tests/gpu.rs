//! The crate's matrices on a real rasteriser. Needs a Vulkan driver; without one every test fails and says so.
#![expect(clippy::unwrap_used, clippy::panic, reason = "tests")]

use std::process::Command;
use std::sync::LazyLock;

use conformance::check::{
    ANGLES, Origin, SIZES, SPACES, changes, containment, conventions, far_away, ground_at, nearest, other_scenes,
    place, shadows,
};
use conformance::gpu::{Gpu, NO_DRIVER};
use conformance::stage::Stage;
use scenes::{Model, TECHNIQUES, Technique};
use shadow_warp::glam::DVec3;
use shadow_warp::{NearDepth, Rule, Warp};

static GPU: LazyLock<Gpu> = LazyLock::new(|| Gpu::open().unwrap_or_else(|error| panic!("{error:#}")));
static GROUNDS: LazyLock<Vec<Stage>> = LazyLock::new(|| ANGLES.map(|angle| ground_at(angle).unwrap()).into());
static OTHERS: LazyLock<Vec<Stage>> =
    LazyLock::new(|| other_scenes().iter().flat_map(|model| Stage::all(model).unwrap()).collect());

/// Collects what fails, so that one run shows all of it.
#[derive(Default)]
struct Failures(Vec<String>);

impl Failures {
    fn add(&mut self, name: &str, found: Vec<String>) {
        self.0.extend(found.into_iter().map(|failure| format!("{name}: {failure}")));
    }
}

impl Drop for Failures {
    fn drop(&mut self) {
        assert!(std::thread::panicking() || self.0.is_empty(), "{}", self.0.join("\n"));
    }
}

fn named(name: &str) -> &'static Technique {
    Technique::named(name).unwrap()
}

fn grounds() -> impl Iterator<Item = (f64, &'static Stage)> {
    ANGLES.into_iter().zip(GROUNDS.iter())
}

/// Whether there is a map: `what_is_refused_is_known` has the list of those that are not.
fn runs(stage: &Stage, technique: &Technique) -> bool {
    stage.refusal(technique, 256).is_none()
}

fn every_ground(mut check: impl FnMut(String, &'static Stage, &'static Technique)) {
    for (angle, stage) in grounds() {
        for technique in TECHNIQUES.iter().filter(|technique| runs(stage, technique)) {
            check(format!("{} at {angle} degrees", technique.name), stage, technique);
        }
    }
}

/// The largest maps are for one technique of each kind.
fn sizes(technique: &Technique) -> Vec<u32> {
    let all = ["uniform", "lispsm", "psm"].contains(&technique.name);
    SIZES.into_iter().filter(|&size| all || size < 4096).collect()
}

fn every_other_scene(mut check: impl FnMut(String, &'static Stage, &'static Technique)) {
    for stage in OTHERS.iter() {
        for technique in TECHNIQUES.iter().filter(|technique| runs(stage, technique)) {
            check(format!("{} over the {}", technique.name, stage.name), stage, technique);
        }
    }
}

#[test]
fn triangles_cover_the_predicted_texels_at_the_predicted_depth() {
    let mut failures = Failures::default();
    let mut check = |name: &str, stage: &Stage, technique: &Technique, sizes: &[u32]| {
        for &size in sizes {
            let rule = stage.rule(technique).unwrap();
            let (found, allowance) = place(&GPU, stage, technique, rule, size, Origin::Eye).unwrap();
            failures.add(&format!("{name}, {size} texels"), found.failures(&allowance));
        }
    };
    every_ground(|name, stage, technique| check(&name, stage, technique, &sizes(technique)));
    every_other_scene(|name, stage, technique| check(&name, stage, technique, &[1024]));
}

/// With w from 1 to 1000 a matrix about a far origin loses digits of w; about the eye it is as good as a map without
/// warp.
#[test]
fn strong_warps_are_as_exact_as_none_about_the_eye() {
    let strong = Rule::Explicit(Warp::new(999.0).unwrap());
    for technique in ["uniform", "lispsm-middle"].map(named) {
        for size in SIZES {
            let [world, eye] = [Origin::World, Origin::Eye].map(|origin| {
                let (found, allowance) = place(&GPU, &GROUNDS[0], technique, strong, size, origin).unwrap();
                assert!(found.failures(&allowance).is_empty(), "{:?}", found.failures(&allowance));
                found
            });
            // Half of the diagonal of the rasteriser's grid, and some rounding of the corners' own.
            let of_grid = 0.75 * GPU.grid() + f64::from(size) * 2e-7;
            assert!(eye.coverage <= of_grid || !GPU.is_lavapipe(), "{} {size}: {eye:?}", technique.name);
            assert!(
                size < 4096 || !GPU.is_lavapipe() || world.coverage > 2.0 * eye.coverage,
                "{}: {world:?} {eye:?}",
                technique.name
            );
        }
    }
}

#[test]
fn nothing_that_is_seen_is_clipped() {
    let mut failures = Failures::default();
    every_ground(|name, stage, technique| {
        for size in sizes(technique) {
            failures.add(&name, containment(&GPU, stage, technique, size).unwrap().failures());
        }
    });
    every_other_scene(|name, stage, technique| {
        failures.add(&name, containment(&GPU, stage, technique, 256).unwrap().failures());
    });
}

/// The check above can fail: without casters in the depth range and without depth clamp, roofs are lost.
#[test]
fn casters_are_lost_where_they_may_be() {
    let stage = Stage::new(Model::town().under_sun(DVec3::new(0.005, 1.0, 0.01))).unwrap();
    for technique in TECHNIQUES {
        let found = containment(&GPU, &stage, technique, 256).unwrap();
        assert!(found.failures().is_empty(), "{}: {:?}", technique.name, found.failures());
        let [compared, lost] = nearest(&GPU, &stage, technique, 256, NearDepth::Receivers, false).unwrap();
        assert!(lost > 200, "{}: {lost} of {compared}", technique.name);
    }
}

#[test]
fn shadows_are_as_predicted() {
    let mut failures = Failures::default();
    every_ground(|name, stage, technique| {
        for size in sizes(technique) {
            let found = shadows(&GPU, stage, technique, size).unwrap();
            failures.add(&format!("{name}, {size} texels"), found.failures());
        }
    });
    every_other_scene(|name, stage, technique| {
        failures.add(&name, shadows(&GPU, stage, technique, 1024).unwrap().failures());
    });
}

#[test]
fn derivatives_are_as_predicted() {
    let mut failures = Failures::default();
    every_ground(|name, stage, technique| {
        // Relative errors hardly depend on the size.
        let all = ["uniform", "lispsm", "lispsm-fixed-axes"].contains(&technique.name);
        for size in SIZES.into_iter().filter(|&size| all || size == 1024) {
            let name = format!("{name}, {size} texels");
            let found = changes(&GPU, stage, technique, size).unwrap();
            failures.add(&name, found.failures());
            let (median, most) = (found.quantile(0.5), found.quantile(0.99));
            // Where positions are rounded before they are interpolated, nothing so general can be said.
            if GPU.is_lavapipe() && !(median <= 1.2e-4 && most <= 2.8e-3) {
                failures.add(&name, vec![format!("off by {median} in the median, {most} at 99 %")]);
            }
        }
    });
    every_other_scene(|name, stage, technique| {
        failures.add(&name, changes(&GPU, stage, technique, 1024).unwrap().failures());
    });
}

/// More texels, fewer wrong pixels; and the warp has fewer than none where light and view are far from parallel.
#[test]
fn wrong_pixels_are_fewer_where_the_map_is_finer() {
    let wrong = |stage, technique, size| shadows(&GPU, stage, technique, size).unwrap().wrong();
    let [uniform, lispsm] = ["uniform", "lispsm"].map(named);
    for (angle, stage) in grounds() {
        for technique in [uniform, lispsm] {
            let [coarse, fine] = [256, 4096].map(|size| wrong(stage, technique, size));
            assert!(4.0 * fine < coarse, "{} at {angle}: {coarse} {fine}", technique.name);
        }
        if (30.0..=60.0).contains(&angle) {
            let (plain, warped) = (wrong(stage, uniform, 256), wrong(stage, lispsm, 256));
            assert!(warped < 0.7 * plain, "at {angle}: {plain} {warped}");
        }
    }
    let avenue = &OTHERS[1];
    assert!(4.0 * wrong(avenue, lispsm, 1024) < wrong(avenue, uniform, 1024));
}

#[test]
fn every_clip_space_shows_the_same_picture() {
    let mut failures = Failures::default();
    let mut check = |name: &str, stage: &Stage, technique: &Technique, size: u32| {
        for ((interface, _), found) in SPACES.iter().zip(conventions(&GPU, stage, technique, size).unwrap()) {
            failures.add(&format!("{name}, {size} texels, {interface}"), found.failures());
        }
    };
    every_ground(|name, stage, technique| {
        check(&name, stage, technique, 256);
        // Reading large maps back is slow.
        if name.ends_with("at 60 degrees") {
            sizes(technique).into_iter().skip(1).for_each(|size| check(&name, stage, technique, size));
        }
    });
}

#[test]
fn far_from_the_origin_nothing_moves_about_the_eye() {
    for model in [Model::ground(), Model::chessboard()] {
        let [near, far, very_far] = [0.0, 1e5, 1e7]
            .map(|distance| Stage::new(model.clone().moved(DVec3::new(distance, 0.0, -distance))).unwrap());
        let techniques = TECHNIQUES.iter().filter(|technique| runs(&near, technique));
        for (technique, size) in techniques.flat_map(|technique| SIZES.map(|size| (technique, size))) {
            let name = format!("{} over the {}, {size} texels", technique.name, model.name);
            let [near, far, very_far] = [&near, &far, &very_far].map(|stage| {
                [Origin::World, Origin::Eye, Origin::Body].map(|origin| {
                    let found = far_away(&GPU, stage, technique, size, origin).unwrap();
                    assert!(found.failures().is_empty(), "{name}: {:?}", found.failures());
                    found.displacement
                })
            });
            let limit = 1e-6 * f64::from(size);
            for [_, eye, body] in [near, far, very_far] {
                assert!(eye < limit && body < limit, "{name}: {eye} {body}");
            }
            // The strongest warp, of a perspective map, has w from 1 to 400.
            let worlds = [near[0] < 30.0 * limit, far[0] > limit, very_far[0] > 1e3 * limit];
            assert!(worlds == [true; 3], "{name}: {near:?} {far:?} {very_far:?}");
        }
    }
}

/// Where a technique refuses a scene it says why, and each has a map somewhere.
#[test]
fn what_is_refused_is_known() {
    let faces = |names: &[&str]| names.iter().map(|name| format!("hall {name}")).collect::<Vec<String>>();
    // The lamp is in the picture.
    let psm = faces(&["+x", "-x", "+y", "-y", "+z", "-z"]);
    // Shadows on the ground reach behind the eye, or there are none, as above the lamp.
    let plane = [vec!["town".to_owned(), "avenue".to_owned()], faces(&["+x", "-x", "+y", "+z", "-z"])].concat();
    let known = [
        ("psm", psm, "a perspective shadow map whose light is too close to what is seen"),
        ("plane", plane, "a map for a plane on which some of what is seen casts its shadow behind the eye"),
    ];
    for technique in TECHNIQUES {
        let refusal = |(name, stage): (String, &Stage)| Some((name, stage.refusal(technique, 256)?.to_string()));
        let stages = grounds().map(|(angle, stage)| (format!("{angle}°"), stage));
        let stages = stages.chain(OTHERS.iter().map(|stage| (stage.name.clone(), stage)));
        let refused: Vec<(String, String)> = stages.filter_map(refusal).collect();
        let (scenes, reason) = known
            .iter()
            .find(|(name, ..)| *name == technique.name)
            .map_or((&[][..], ""), |(_, scenes, reason)| (scenes, reason));
        assert!(refused.iter().all(|(_, why)| why.starts_with(reason)), "{}: {refused:?}", technique.name);
        let names: Vec<&String> = refused.iter().map(|(name, _)| name).collect();
        assert_eq!(names, scenes.iter().collect::<Vec<_>>(), "{}", technique.name);
        assert!(scenes.len() < ANGLES.len() + OTHERS.len());
    }
}

/// `docs/conformance.md` is printed by the program; it must not lag behind the table of techniques.
#[test]
fn the_page_has_every_technique() {
    let page = include_str!("../../../docs/conformance.md");
    let [introduction, mutants] = [include_str!("../src/introduction.md"), include_str!("../src/mutants.md")];
    assert!(page.starts_with(introduction) && page.contains(mutants.trim()) && !page.contains("Failures:"));
    assert!(mutants.lines().count() > 12 && !mutants.contains("**"), "a mistake is not caught");
    for title in ["Depth and place", "Containment", "Shadows", "Aliasing", "Far away"] {
        let section = page.split_once(&format!("### {title}")).unwrap().1.split("###").next().unwrap();
        for technique in TECHNIQUES {
            assert!(section.contains(&format!("| {} |", technique.name)), "{} in {title}", technique.name);
        }
    }
}

#[test]
fn without_a_driver_the_packages_are_named() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_conformance"));
    let output =
        command.env("VK_ICD_FILENAMES", "/nonexistent").env("VK_DRIVER_FILES", "/nonexistent").output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && stderr.contains(NO_DRIVER), "{stderr}");
    assert!(NO_DRIVER.contains("libvulkan1 mesa-vulkan-drivers"));
}
