//! Whatever the scene: no panic, no NaN, nothing lost, and no sample worse than the worst.

use crate::allowance;
use crate::random::basic::{direction, inside, log_between, mixture, unit, within};
use crate::random::measure::{Scene, box_between, ndc, product_rounding, world_rounding};
use crate::random::scenes::{KINDS, Kind, rule, settled_direction, sun};
use crate::random::{Ratchet, check};
use proptest::option::weighted;
use proptest::prelude::*;
use proptest::sample::select;
use shadow_warp::aliasing::pixels_per_texel;
use shadow_warp::glam::{DVec3, DVec4};
use shadow_warp::{Axes, Bounds, ClipSpace, Error, NearDepth, Rule, Sides, View};

/// How far the body of the casters may reach beyond the map's sides where the receivers are slivers
/// to the light: the planes along their edges have lost digits then. In few scenes it sticks out
/// further.
const SWEPT: f64 = 1e-5;
/// Of each class.
const SCENES: u32 = 120;

/// A box: solid, or without some of its extents.
#[derive(Clone, Copy, Debug)]
enum Shape {
    Solid,
    Flat,
    Line,
    Point,
}

fn any_box(shape: Shape, size: f64) -> impl Strategy<Value = Bounds> {
    let kept = match shape {
        Shape::Solid => DVec3::ONE,
        Shape::Flat => DVec3::new(1.0, 0.0, 1.0),
        Shape::Line => DVec3::X,
        Shape::Point => DVec3::ZERO,
    };
    let extent = [log_between(1e-3, 1.0).boxed(), log_between(1e-3, 1.0).boxed(), (1e-9..1.0).boxed()];
    (extent, log_between(1e-3, 1e3), inside(1.0)).prop_map(move |(extent, distance, place)| {
        let low = size * distance * place;
        box_between(low, low + size * DVec3::from(extent) * kept)
    })
}

#[derive(Clone, Copy, Debug)]
enum Eye {
    Inside(DVec3),
    /// By the box's size.
    Away(DVec3),
    FarAway(DVec3),
}

/// Half of the field of view as a tangent, or the size of the picture.
#[derive(Clone, Copy, Debug)]
enum Picture {
    Centred { fov: f64, aspect: f64 },
    OffCentre { fov: f64, shift: [f64; 2] },
    Orthographic([f64; 2]),
}

#[derive(Clone, Copy, Debug)]
struct Camera {
    eye: Eye,
    picture: Picture,
    /// Else towards the box, a little aside.
    forward: Option<DVec3>,
    aside: DVec3,
    up: DVec3,
    near: f64,
    /// Of the near distance.
    far: Option<f64>,
}

impl Camera {
    fn view(&self, about: &Bounds) -> View {
        let extent = about.max() - about.min();
        let (middle, size) = (0.5 * (about.min() + about.max()), extent.max_element().max(1e-6));
        let eye = match self.eye {
            Eye::Inside(share) => about.min() + extent * share,
            Eye::Away(way) => middle + size * way,
            Eye::FarAway(way) => middle + way.normalize() * (1e7 * size * way.length()).min(1e13),
        };
        let fov = match self.picture {
            Picture::Centred { fov, .. } | Picture::OffCentre { fov, .. } => fov,
            Picture::Orthographic(_) => 1.0,
        };
        let towards = || (middle - eye).try_normalize().unwrap_or(DVec3::X) + 0.5 * fov.min(1.0) * self.aside;
        let forward = self.forward.unwrap_or_else(towards);
        let up = [self.up, DVec3::Y, DVec3::new(1.0, 2.0, -3.0)]
            .into_iter()
            .find(|up| up.cross(forward).length() > 1e-6 * forward.length())
            .unwrap();
        let near = (eye.distance(middle) + size) * self.near;
        let far = self.far.map_or(f64::INFINITY, |far| near * far);
        match self.picture {
            Picture::Centred { fov, aspect } => View::perspective(eye, forward, up, fov, aspect, near..far),
            Picture::OffCentre { fov, shift } => {
                let tan = (0.5 * fov).tan();
                let [x, y] = shift.map(|shift| shift * tan);
                let sides = Sides { left: x - tan, right: x + tan, bottom: y - tan, top: y + tan };
                View::perspective_off_centre(eye, forward, up, sides, near..far)
            }
            Picture::Orthographic([width, height]) => {
                View::orthographic(eye, forward, up, Sides::centred(size * width, size * height), -near..far)
            }
        }
        .unwrap()
    }
}

fn any_camera() -> impl Strategy<Value = Camera> {
    let way = || (direction(), log_between(1e-3, 10.0)).prop_map(|(direction, distance)| direction * distance);
    let eye = prop_oneof![
        5 => way().prop_map(Eye::Away),
        2 => within(DVec3::ZERO, DVec3::ONE).prop_map(Eye::Inside),
        1 => way().prop_map(Eye::FarAway),
    ];
    // From 0.001 to 179.9 degrees.
    let fov = || prop_oneof![2 => 0.01..3.1, 1 => Just(0.001_f64.to_radians()), 1 => Just(179.9_f64.to_radians())];
    let picture = prop_oneof![
        2 => (fov(), log_between(0.1, 10.0)).prop_map(|(fov, aspect)| Picture::Centred { fov, aspect }),
        1 => (fov(), [-3.0..3.0, -3.0..3.0]).prop_map(|(fov, shift)| Picture::OffCentre { fov, shift }),
        1 => [log_between(1e-4, 10.0), log_between(1e-4, 10.0)].prop_map(Picture::Orthographic),
    ];
    let forward = (weighted(0.17, settled_direction()), direction(), prop_oneof![Just(DVec3::Y), direction()]);
    let depth = (log_between(1e-7, 0.5), weighted(0.75, log_between(1.0 + 1e-6, 1e12)));
    (eye, picture, forward, depth).prop_map(|(eye, picture, (forward, aside, up), (near, far))| Camera {
        eye,
        picture,
        forward,
        aside,
        up,
        near,
        far,
    })
}

/// Scenes from 1e-6 to 1e12 in size.
fn any_scene(kind: Kind, shape: Shape) -> impl Strategy<Value = Scene> {
    let other = select(vec![Shape::Solid, Shape::Flat, Shape::Line, Shape::Point]);
    let boxes =
        (log_between(1e-6, 1e12), any_box(shape, 1.0), weighted(0.33, other.prop_flat_map(|s| any_box(s, 1.0))));
    let casters = prop_oneof![
        Just([DVec3::ZERO; 2]),
        [unit(), unit()].prop_map(|[below, above]| [DVec3::splat(-below), DVec3::splat(above)]),
        [inside(1.0), inside(1.0)],
    ];
    let axes = select(vec![Axes::View, Axes::LightFixed, Axes::Middle, Axes::VertexMean]);
    let near_depth = select(vec![NearDepth::Casters, NearDepth::Casters, NearDepth::Receivers]);
    (boxes, any_camera(), sun(kind, 1e-17), casters, axes, near_depth).prop_map(
        |((size, first, second), camera, sun, [below, above], axes, near_depth)| {
            let scaled = |b: &Bounds| box_between(size * b.min(), size * b.max());
            let boxes: Vec<_> = [first].iter().chain(&second).map(scaled).collect();
            let view = camera.view(&boxes[0]);
            let casters = box_between(boxes[0].min() + size * below, boxes[0].max() + size * above);
            Scene { axes, near_depth, ..Scene::new(view, sun.to_light(&view), &boxes, casters) }
        },
    )
}

#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    scenes: u32,
    casters: u32,
    beside: u32,
    hopeless: u32,
    infinite: u32,
    orthographic: u32,
    eye_inside: u32,
    invisible: u32,
}

#[test]
fn any_scene_has_a_sound_map() {
    let (mut inside, mut casters_inside) = (Ratchet::new("any receivers"), Ratchet::new("any casters"));
    let mut sampled = Ratchet::new("any sample over the worst texel");
    let mut seen = Seen::default();
    let mut property = |scene: Scene, rule: Rule, samples: [crate::random::basic::Mixture; 8]| {
        let (view, about) = (&scene.view, &scene.boxes[0]);
        seen.scenes += 1;
        seen.infinite += u32::from(view.far() == f64::INFINITY);
        seen.orthographic += u32::from(!view.is_perspective());
        seen.eye_inside += u32::from(view.eye().clamp(about.min(), about.max()) == view.eye());
        let fit = scene.fit();
        let map = match fit.solve(rule) {
            Ok(map) => map,
            Err(error) => {
                assert_eq!((error, scene.is_visible()), (Error::NothingVisible, false));
                seen.invisible += 1;
                return;
            }
        };
        for space in [ClipSpace::WGPU, ClipSpace::OPENGL, ClipSpace::VULKAN.reversed()] {
            for origin in [map.origin(), scene.view.eye(), DVec3::ZERO] {
                assert!(map.clip_from_world_at(origin, space).is_finite());
            }
        }
        let depth: DVec4 = fit.linear_depth(map.origin()).unwrap();
        assert!(depth.is_finite() && map.origin().is_finite());
        let worst = fit.worst_texel(&map);
        assert!(worst.is_finite() && worst > 0.0, "{worst}");

        let allowed = 0.3 * allowance(map.warp().excess());
        let receivers = scene.receivers(map.origin());
        // Each body is rounded about its own origin, wherever the map's lies.
        let rounding = receivers.iter().map(|q| product_rounding(&map, *q)).fold(0.0, f64::max);
        for q in receivers {
            let p = ndc(&map, q);
            let out = (p.x.abs() - 1.0).max(p.y.abs() - 1.0).max(-p.z).max(p.z - 1.0);
            inside.note(out, allowed + 0.3 * rounding, rule);
        }
        if scene.near_depth == NearDepth::Casters {
            let mut is_beside = false;
            for q in scene.caster_points(map.origin()) {
                let (rounding, p) = (product_rounding(&map, q), ndc(&map, q));
                // Casters that stand 1e15 times the size of the receivers above them are beyond
                // f64.
                if (0.0..0.01).contains(&rounding) {
                    let aside = (p.x.abs().max(p.y.abs()) - 1.0).max(0.0);
                    if aside > SWEPT * map.warp().ratio() {
                        is_beside = true;
                    } else {
                        casters_inside.note(-p.z, 2.0 * (allowed + rounding + aside), rule);
                    }
                    seen.casters += 1;
                } else {
                    seen.hopeless += 1;
                }
            }
            seen.beside += u32::from(is_beside);
        }
        for body in scene.bodies.iter().filter(|body| !body.is_empty()) {
            for q in &samples {
                let p = q.of(body.vertices()) + body.origin();
                let here = pixels_per_texel(&map, &scene.view, fit.viewport, p);
                let rounding = world_rounding(&map, &scene, p);
                if (0.0..0.1).contains(&rounding) {
                    sampled.note(here / worst - 1.0, 1e-15 + rounding, rule);
                }
            }
        }
    };
    for kind in KINDS {
        for shape in [Shape::Solid, Shape::Flat, Shape::Line, Shape::Point] {
            let strategy = (any_scene(kind, shape), rule(), prop::array::uniform8(mixture()));
            check(&format!("any/{kind:?}/{shape:?}"), SCENES, strategy, |(scene, rule, samples)| {
                property(scene, rule, samples);
            });
        }
    }
    inside.finish();
    casters_inside.finish();
    sampled.finish();
    println!("{seen:?}");
    let Seen { scenes, casters, beside, hopeless, infinite, orthographic, eye_inside, invisible } = seen;
    assert!(beside * 300 <= scenes && hopeless * 50 <= casters, "{seen:?}");
    assert!([infinite, orthographic, eye_inside, invisible].iter().all(|n| *n > scenes / 20), "{seen:?}");
    assert!(invisible < scenes / 2, "{seen:?}");
}
