//! The middle of the receivers, which [`Axes::Middle`] follows: volume counts, then area, length and number.
#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]
#![expect(clippy::disallowed_methods, reason = "tests may call what the library must not")]

mod random;

use proptest::prelude::*;
use random::basic::{inside, log_between, within};
use random::{Ratchet, check};
use shadow_warp::glam::{DVec3, dvec3};
use shadow_warp::{Axes, Body, Bounds, Fit, Light, LightSpace, Rule, View};

/// Sees all of what lies within 10 of (0, 0, 40).
fn view() -> View {
    View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, 1.5, 1.0, 0.1..1000.0).unwrap()
}

/// The direction that takes the view's part, made perpendicular to the light.
fn space_of(bodies: &[Body], light: &Light, axes: Axes) -> LightSpace {
    let (view, all) = (view(), Bounds::new(DVec3::splat(-100.0), DVec3::splat(100.0)).unwrap());
    let fit = Fit { axes, ..Fit::new(&view, light, &all, bodies) };
    fit.solve(Rule::Uniform).unwrap().light_space()
}

fn seen(bounds: &Bounds) -> Body {
    Body::visible(&view(), bounds)
}

/// The unit vector along `v`, perpendicular to another.
fn across(v: DVec3, light: DVec3) -> DVec3 {
    (v - light * light.dot(v)).normalize()
}

fn boxes() -> impl Strategy<Value = Bounds> {
    let size = [log_between(0.1, 3.0), log_between(0.1, 3.0), log_between(0.1, 3.0)];
    (inside(6.0), size).prop_map(|(middle, size)| {
        let (middle, half) = (middle + 40.0 * DVec3::Z, DVec3::from(size));
        Bounds::new(middle - half, middle + half).unwrap()
    })
}

#[test]
fn bodies_count_by_their_volume() {
    let mut worst = Ratchet::new("direction of the middle");
    check("middle/volumes", 500, (prop::collection::vec(boxes(), 1..4), inside(1.0)), |(boxes, to_light)| {
        let Ok(light) = Light::directional(to_light) else { return };
        let to_light = light.homogeneous().truncate();
        let sizes = boxes.iter().map(|b| ((b.max() - b.min()).element_product(), 0.5 * (b.min() + b.max())));
        let middle: DVec3 = sizes.map(|(volume, middle)| volume * middle).sum();
        if middle.normalize().cross(to_light).length() < 0.1 {
            return;
        }
        let bodies: Vec<Body> = boxes.iter().map(seen).collect();
        let found = space_of(&bodies, &light, Axes::Middle).z;
        // Surfaces count 2^-26 of what volumes do.
        worst.note((found - across(middle, to_light)).length(), 1e-7, &boxes);
    });
    worst.finish();
}

/// A box that becomes flat, a line and a point: the middle goes where the flat box, the line and the point have it.
#[test]
fn the_middle_is_continuous_as_a_body_flattens() {
    let mut worst = Ratchet::new("direction of a flattening body");
    let light = Light::directional(dvec3(0.3, 1.0, -0.2)).unwrap();
    let (low, high) = (dvec3(-30.0, -4.0, 5.0), dvec3(9.0, 3.0, 60.0));
    let first_axes = within(DVec3::ZERO, DVec3::splat(2.999)).prop_map(|p| p.x as usize);
    check("middle/flattening", 200, (first_axes, 1..4_usize, within(low, low + 1.0)), |(first, count, low)| {
        let flattened = |thickness: f64| {
            let mut high = high;
            for axis in (first..first + count).map(|axis| axis % 3) {
                high[axis] = low[axis] + thickness * (high[axis] - low[axis]);
            }
            seen(&Bounds::new(low, high).unwrap())
        };
        let limit = flattened(0.0);
        if limit.is_empty() {
            return;
        }
        let direction = |body: Body| space_of(&[body], &light, Axes::Middle).z;
        let mut last = direction(flattened(1e-2));
        let mut thickness = 2e-2;
        for step in 0..64 {
            thickness *= 0.5;
            let next = direction(flattened(thickness));
            // Thinner by half: the middle moves by some of what the box lost, up to 55 long and 5 away.
            worst.note((next - last).length(), 3.0 * thickness + 1e-6, (first, count, low, step));
            last = next;
        }
        worst.note((direction(limit) - last).length(), 1e-6, (first, count, low));
    });
    worst.finish();
}

/// Flat tiles of different sizes count by their area, and the middle does not jump as a tile gains or loses a vertex.
#[test]
fn flat_bodies_count_by_their_area() {
    let tile = |[x0, x1, z0, z1]: [f64; 4]| Bounds::new(dvec3(x0, 0.0, z0), dvec3(x1, 0.0, z1)).unwrap();
    let view = |forward| View::perspective(5.0 * DVec3::Y, forward, DVec3::Y, 1.2, 1.5, 0.5..300.0).unwrap();
    let all = Bounds::new(DVec3::splat(-300.0), DVec3::splat(300.0)).unwrap();
    let along = |forward: DVec3, tiles: [Bounds; 2], to_light: DVec3| {
        let (view, light) = (view(forward), Light::directional(to_light).unwrap());
        let seen = tiles.map(|tile| Body::visible(&view, &tile));
        let fit = Fit { axes: Axes::Middle, ..Fit::new(&view, &light, &all, &seen) };
        fit.solve(Rule::Uniform).unwrap().light_space().z
    };
    let tiles = [tile([-11.0, -9.0, 19.0, 21.0]), tile([6.0, 14.0, 16.0, 24.0])];
    // 4 and 64 square units.
    let middle = (4.0 * dvec3(-10.0, -5.0, 20.0) + 64.0 * dvec3(10.0, -5.0, 20.0)) / 68.0;
    let found = along(dvec3(0.0, -0.2, 1.0), tiles, DVec3::Y);
    assert!((found - across(middle, DVec3::Y)).length() < 1e-7, "{found}");

    let tiles = [tile([-14.0, 43.0, 5.5, 10.5]), tile([-36.0, 7.5, 14.0, 72.0])];
    let [before, after] = [0.761_546_177, 0.761_546_178]
        .map(|a: f64| along(dvec3(a.sin(), -0.468, a.cos()), tiles, dvec3(0.8, 0.2, 1.0)));
    assert!((after - before).length() < 1e-6, "{before} {after}");
}

/// The mean of the vertices follows where they are many, by its name alone.
#[test]
fn vertices_count_alike_in_the_fast_form() {
    let light = Light::directional(DVec3::Y).unwrap();
    let large = Bounds::new(dvec3(-9.0, -1.0, 31.0), dvec3(-3.0, 1.0, 49.0)).unwrap();
    let small = Bounds::new(dvec3(5.0, -1.0, 39.5), dvec3(6.0, 1.0, 40.5)).unwrap();
    let bodies = [seen(&large), seen(&small)];
    let means = across(dvec3(-6.0, 0.0, 40.0) + dvec3(5.5, 0.0, 40.0), DVec3::Y);
    let volumes = across(216.0 * dvec3(-6.0, 0.0, 40.0) + 2.0 * dvec3(5.5, 0.0, 40.0), DVec3::Y);
    assert!((space_of(&bodies, &light, Axes::VertexMean).z - means).length() < 1e-15);
    assert!((space_of(&bodies, &light, Axes::Middle).z - volumes).length() < 1e-7);
    assert!((space_of(&bodies, &light, Axes::View).z - DVec3::Z).length() < 1e-15);
}
