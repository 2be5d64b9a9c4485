//! Whatever the scene: no panic, no NaN, nothing lost, and no sample worse than the worst.
//!
//! `SHADOW_WARP_CASES` sets how many scenes are tried.

use super::derivatives::world_rounding;
use crate::scenes::random::Random;
use crate::scenes::{KINDS, Kind, Scene, box_between, light, ndc, product_rounding, rules, settled_direction};
use crate::{Worst, allowance};
use shadow_warp::aliasing::pixels_per_texel;
use shadow_warp::glam::{DVec3, DVec4};
use shadow_warp::{Axes, Bounds, ClipSpace, Error, NearDepth, Sides, View};

/// How far the body of the casters may reach beyond the map's sides where the receivers are slivers to the light: the
/// planes along their edges have lost digits then. In few scenes it sticks out further.
const SWEPT: f64 = 1e-5;
const SCENES: u64 = 20_000;

#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    casters: u64,
    beside: u64,
    hopeless: u64,
    solid: u32,
    flat: u32,
    lines: u32,
    points: u32,
    infinite: u32,
    orthographic: u32,
    off_centre: u32,
    wide: u32,
    narrow: u32,
    eye_inside: u32,
    eye_far_away: u32,
    invisible: u32,
    two_boxes: u32,
    kinds: [u32; KINDS.len()],
}

/// A length of a scene of any size.
fn length(r: &mut Random) -> f64 {
    r.log_between(1e-6, 1e12)
}

fn any_view(r: &mut Random, about: &Bounds, seen: &mut Seen) -> View {
    let size = (about.max() - about.min()).max_element().max(1e-6);
    let middle = 0.5 * (about.min() + about.max());
    let away = size * r.log_between(1e-3, 10.0);
    let eye = match r.below(8) {
        0 | 1 => about.min() + (about.max() - about.min()) * DVec3::new(r.unit(), r.unit(), r.unit()),
        2 => middle + r.direction() * (away * 1e7).min(1e13),
        _ => middle + r.direction() * away,
    };
    let fov = match r.below(4) {
        0 => 0.001_f64.to_radians(),
        1 => 179.9_f64.to_radians(),
        _ => r.between(0.01, 3.1),
    };
    let forward = match r.below(6) {
        0 => settled_direction(r),
        _ => (middle - eye).try_normalize().unwrap_or(DVec3::X) + 0.5 * fov.min(1.0) * r.direction(),
    };
    let up = [DVec3::Y, r.direction(), DVec3::new(1.0, 2.0, -3.0)]
        .into_iter()
        .find(|up| up.cross(forward).length() > 1e-6 * forward.length())
        .unwrap();
    let near = (eye.distance(middle) + size) * r.log_between(1e-7, 0.5);
    let far = if r.below(4) == 0 { f64::INFINITY } else { near * r.log_between(1.0 + 1e-6, 1e12) };
    seen.infinite += u32::from(far == f64::INFINITY);
    seen.narrow += u32::from(fov < 1e-4);
    seen.wide += u32::from(fov > 3.12);
    match r.below(4) {
        0 => {
            seen.orthographic += 1;
            let sides = Sides::centred(size * r.log_between(1e-4, 10.0), size * r.log_between(1e-4, 10.0));
            View::orthographic(eye, forward, up, sides, -near..far).unwrap()
        }
        1 => {
            seen.off_centre += 1;
            let tan = (0.5 * fov).tan();
            let [x, y] = [(); 2].map(|()| tan * r.between(-3.0, 3.0));
            let sides = Sides { left: x - tan, right: x + tan, bottom: y - tan, top: y + tan };
            View::perspective_off_centre(eye, forward, up, sides, near..far).unwrap()
        }
        _ => View::perspective(eye, forward, up, fov, r.log_between(0.1, 10.0), near..far).unwrap(),
    }
}

fn any_scene(case: u64, seen: &mut Seen) -> Scene {
    let mut random = Random::new(case);
    let r = &mut random;
    let size = length(r);
    let boxes: Vec<_> = (0..1 + r.below(3) / 2)
        .map(|_| {
            let extent = size * DVec3::new(r.log_between(1e-3, 1.0), r.log_between(1e-3, 1.0), r.unit());
            let (kept, count) = match r.below(5) {
                0 => (DVec3::new(1.0, 0.0, 1.0), &mut seen.flat),
                1 => (DVec3::X, &mut seen.lines),
                2 => (DVec3::ZERO, &mut seen.points),
                _ => (DVec3::ONE, &mut seen.solid),
            };
            *count += 1;
            let distance = size * r.log_between(1e-3, 1e3);
            let low = r.inside(distance);
            box_between(low, low + extent * kept)
        })
        .collect();
    seen.two_boxes += u32::from(boxes.len() == 2);
    let view = any_view(r, &boxes[0], seen);
    let kind = KINDS[r.below(KINDS.len())];
    seen.kinds[kind as usize] += 1;
    let to_light = light(r, &view, kind, 1e-17);
    let casters = match r.below(3) {
        0 => boxes[0],
        1 => box_between(boxes[0].min() - size * r.unit(), boxes[0].max() + size * r.unit()),
        _ => box_between(boxes[0].min() + r.inside(size), boxes[0].max() + r.inside(size)),
    };
    let inside = view.eye().cmpge(boxes[0].min()).all() && view.eye().cmple(boxes[0].max()).all();
    seen.eye_inside += u32::from(inside);
    let reach = (boxes[0].max() - boxes[0].min()).max_element();
    seen.eye_far_away += u32::from(view.eye().distance(boxes[0].min()) > 1e5 * reach.max(1e-6));
    let mut scene = Scene::new(view, to_light, &boxes, casters);
    scene.axes = [Axes::View, Axes::LightFixed][r.below(2)];
    scene.near_depth = [NearDepth::Casters, NearDepth::Casters, NearDepth::Receivers][r.below(3)];
    scene
}

#[test]
fn any_scene_has_a_sound_map() {
    let cases = std::env::var("SHADOW_WARP_CASES").map_or(SCENES, |text| text.parse().unwrap());
    let (mut inside, mut casters_inside) = (Worst::new("any receivers"), Worst::new("any casters"));
    let mut sampled = Worst::new("any sample over the worst texel");
    let mut seen = Seen::default();
    let mut random = Random::new(7);
    for case in 0..cases {
        let scene = any_scene(case, &mut seen);
        let rule = rules(&mut random)[random.below(6)];
        let fit = scene.fit();
        let map = match fit.solve(rule) {
            Ok(map) => map,
            Err(error) => {
                assert_eq!((error, scene.is_visible()), (Error::NothingVisible, false), "{case}");
                seen.invisible += 1;
                continue;
            }
        };
        for space in [ClipSpace::WGPU, ClipSpace::OPENGL, ClipSpace::VULKAN.reversed()] {
            for origin in [map.origin(), scene.view.eye(), DVec3::ZERO] {
                assert!(map.clip_from_world_at(origin, space).is_finite(), "{case}");
            }
        }
        let depth: DVec4 = fit.linear_depth(map.origin()).unwrap();
        assert!(depth.is_finite() && map.origin().is_finite(), "{case}");
        let worst = fit.worst_texel(&map);
        assert!(worst.is_finite() && worst > 0.0, "{case} {worst}");

        let allowed = allowance(map.warp().excess());
        let receivers = scene.receivers(map.origin());
        // Each body is rounded about its own origin, wherever the map's lies.
        let rounding = receivers.iter().map(|q| product_rounding(&map, *q)).fold(0.0, f64::max);
        for q in receivers {
            let p = ndc(&map, q);
            let out = (p.x.abs() - 1.0).max(p.y.abs() - 1.0).max(-p.z).max(p.z - 1.0);
            inside.note(out, allowed + rounding, (case, rule));
        }
        if scene.near_depth == NearDepth::Casters {
            for q in scene.caster_points(map.origin()) {
                let (rounding, p) = (product_rounding(&map, q), ndc(&map, q));
                // Casters that stand 1e15 times the size of the receivers above them are beyond f64.
                if (0.0..0.1).contains(&rounding) {
                    let aside = (p.x.abs().max(p.y.abs()) - 1.0).max(0.0);
                    if aside > SWEPT * map.warp().ratio() {
                        seen.beside += 1;
                    } else {
                        casters_inside.note(-p.z, 50.0 * (allowed + rounding + aside), (case, rule, scene.axes));
                    }
                    seen.casters += 1;
                } else {
                    seen.hopeless += 1;
                }
            }
        }
        for body in scene.bodies.iter().filter(|body| !body.is_empty()) {
            for _ in 0..8 {
                let p = random.mixed(body.vertices()) + body.origin();
                let here = pixels_per_texel(&map, &scene.view, fit.viewport, p);
                let rounding = world_rounding(&map, &scene, p);
                if (0.0..0.1).contains(&rounding) {
                    sampled.note(here / worst - 1.0, 1e-12 + 2.0 * rounding, (case, rule));
                }
            }
        }
    }
    assert!(seen.beside * 10_000 <= seen.casters && seen.hopeless * 50 <= seen.casters, "{seen:?}");
    println!("{cases} scenes: {seen:?}");
    if cases >= SCENES {
        let Seen { flat, lines, points, infinite, orthographic, off_centre, .. } = seen;
        let Seen { wide, narrow, eye_inside, eye_far_away, invisible, two_boxes, .. } = seen;
        let first = [flat, lines, points, infinite, orthographic, off_centre];
        let rest = [wide, narrow, eye_inside, eye_far_away, invisible, two_boxes];
        assert!(first.iter().chain(&rest).chain(&seen.kinds).all(|n| *n > 200), "{seen:?}");
        assert!(u64::from(invisible) < cases as u64 / 2, "{invisible}");
        assert!(seen.kinds[Kind::Parallel as usize] > 1000);
    }
}
