//! The error on the view axis of a whole frustum with the light perpendicular to the view, read off
//! the map.

use crate::CASES;
use crate::random::basic::{log_between, unit};
use crate::random::measure::{LIGHT_SPACE_RULES, Scene, box_about};
use crate::random::{Ratchet, check};
use proptest::prelude::*;
use proptest::sample::select;
use shadow_warp::glam::DVec3;
use shadow_warp::{Rule, ShadowMap, View, Warp};

/// A camera that looks along a texture axis, and all of its frustum as receivers.
fn head_on() -> impl Strategy<Value = Scene> + Clone {
    let to_light = select(vec![DVec3::Y, DVec3::X, DVec3::new(0.6, 0.8, 0.0)]);
    let lens = (0.2..2.0, log_between(0.5, 2.0));
    (log_between(1e-3, 10.0), log_between(1.01, 1e6), lens, to_light).prop_map(
        |(near, far, (fov, aspect), to_light)| {
            let far = near * far;
            let view = View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, fov, aspect, near..far).unwrap();
            let all = box_about(DVec3::ZERO, DVec3::splat(8.0 * far));
            Scene::new(view, to_light, &[all], all)
        },
    )
}

/// `E = (z_n/z) dz/ds`: the height of the map in world units at a depth, seen at the near plane.
fn error_at(scene: &Scene, map: &ShadowMap, depth: f64) -> f64 {
    let point = scene.view.eye() + scene.view.forward() * depth;
    map.texel_extent(point)[1] * f64::from(map.size()[1]) * scene.view.near() / depth
}

fn each_scene<E: Strategy>(name: &str, more: E, mut property: impl FnMut(&Scene, f64, f64, E::Value)) {
    check(name, 4 * CASES, (head_on(), more), |(scene, more)| {
        property(&scene, scene.view.near(), scene.view.far(), more);
    });
}

fn solve(scene: &Scene, eta: f64) -> ShadowMap {
    scene.fit().solve(Rule::Explicit(Warp::new(eta).unwrap())).unwrap()
}

/// LSP-14, and that all four published rules agree here: `eta = sqrt(z_f/z_n) - 1`.
#[test]
fn ends_are_equal() {
    let mut worst = Ratchet::new("LSP-14");
    each_scene("LSP-14", Just(()), |scene, near, far, ()| {
        for rule in LIGHT_SPACE_RULES {
            let map = scene.fit().solve(Rule::LightSpace(rule)).unwrap();
            let [a, b] = [near, far].map(|z| error_at(scene, &map, z));
            worst.note((a / b - 1.0).abs(), 9e-15, scene);
            worst.note((a / ((near / far).sqrt() * (far - near)) - 1.0).abs(), 1e-13, scene);
            let closed = (far - near) / (near + (near * far).sqrt());
            worst.note((map.warp().excess() / closed - 1.0).abs(), 1e-14, scene);
        }
    });
    worst.finish();
}

/// LSP-15: a minimum inside, at `sqrt(z_n z_f)`, of `4 z_n (sqrt z_f - sqrt z_n)/(sqrt z_f + sqrt
/// z_n)`.
#[test]
fn least_error_is_at_the_mean_depth() {
    let mut worst = Ratchet::new("LSP-15");
    each_scene("LSP-15", prop::array::uniform10(unit()), |scene, near, far, others| {
        let map = scene.fit().solve(Rule::LISPSM).unwrap();
        let mean = (near * far).sqrt();
        let least = error_at(scene, &map, mean);
        let closed = 4.0 * near * (far.sqrt() - near.sqrt()) / (far.sqrt() + near.sqrt());
        worst.note((least / closed - 1.0).abs(), 2e-14, scene);
        for t in others {
            assert!(error_at(scene, &map, near * (far / near).powf(t)) >= least * (1.0 - 4.0 * f64::EPSILON));
        }
        let [below, above] = [mean * (1.0 - 1e-4), mean * (1.0 + 1e-4)].map(|z| error_at(scene, &map, z));
        worst.note((above / below - 1.0).abs(), 1e-11, scene);
    });
    worst.finish();
}

/// LSP-16.
#[test]
fn no_other_excess_is_better() {
    each_scene("LSP-16", prop::array::uniform10(log_between(1e-6, 1e6)), |scene, near, far, others| {
        let worst_of = |map: &ShadowMap| error_at(scene, map, near).max(error_at(scene, map, far));
        let best = worst_of(&scene.fit().solve(Rule::LISPSM).unwrap());
        for eta in others {
            assert!(worst_of(&solve(scene, eta)) >= best * (1.0 - 8.0 * f64::EPSILON));
        }
        assert!(worst_of(&solve(scene, 0.0)) >= best);
    });
}

/// LSP-17. PSM is the warp with the ratio `z_f/z_n`.
#[test]
fn three_warps_meet_at_the_mean_depth() {
    let mut worst = Ratchet::new("LSP-17");
    each_scene("LSP-17", Just(()), |scene, near, far, ()| {
        let mean = (near * far).sqrt();
        let greatest = error_at(scene, &scene.fit().solve(Rule::LISPSM).unwrap(), near);
        for eta in [0.0, (far - near) / near] {
            worst.note((error_at(scene, &solve(scene, eta), mean) / greatest - 1.0).abs(), 5e-15, scene);
        }
    });
    worst.finish();
}

/// LSP-23: ratios multiply; `kappa = eta/(2 + eta)` adds like velocities; the inverse undoes.
#[test]
fn warps_compose_and_invert() {
    let (mut compose, mut invert) = (Ratchet::new("LSP-23 composition"), Ratchet::new("LSP-23 inverse"));
    let excess = log_between(1e-9, 1e3);
    check("LSP-23", 20 * CASES, ([excess.clone(), excess], unit()), |(excesses, t)| {
        let [a, b] = excesses.map(|excess| Warp::new(excess).unwrap());
        let both = Warp::new(a.excess() + b.excess() + a.excess() * b.excess()).unwrap();
        let s = b.map_from_body(a.map_from_body(t));
        compose.note((s - both.map_from_body(t)).abs(), 4e-14, (a, b));
        invert.note((a.body_from_map(a.map_from_body(t)) - t).abs(), 1e-15 * (1.0 + 1.0 / a.density(t)), (a, b));
        let kappa = |w: &Warp| w.excess() / (2.0 + w.excess());
        let sum = (kappa(&a) + kappa(&b)) / (1.0 + kappa(&a) * kappa(&b));
        compose.note((kappa(&both) - sum).abs(), 4e-14, (a, b));
        let tau = 2.0 * t - 1.0;
        let mapped = (tau + kappa(&a)) / (1.0 + kappa(&a) * tau);
        compose.note((2.0 * a.map_from_body(t) - 1.0 - mapped).abs(), 4e-14, (a, b));
    });
    compose.finish();
    invert.finish();
    for eta in [0.0, 1e-300, 1e-9, 1.0, 1e8] {
        let warp = Warp::new(eta).unwrap();
        for end in [0.0, 1.0] {
            assert_eq!((warp.map_from_body(end), warp.body_from_map(end)), (end, end));
        }
    }
}
