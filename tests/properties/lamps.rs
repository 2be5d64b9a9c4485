//! Spot lights: their worst texel, rounding to `f32`; the faces of point lights.

use crate::CASES;
use crate::random::Ratchet;
use crate::random::basic::{log_between, mixture};
use crate::random::lamps::each_lamp;
use crate::random::measure::{Scene, extent, lit, ndc, project, rounding, spot};
use proptest::prelude::*;
use proptest::sample::select;
use shadow_warp::glam::{DVec3, Mat4};
use shadow_warp::{Axes, ClipSpace, Error, Fit, Light, Rule, ShadowMap, Warp, aliasing};

const RULES: [Rule; 4] = [Rule::Uniform, Rule::LISPSM, Rule::OPTIMAL, Rule::PSM];

/// The vertices suffice: no point between them is worse, by any measure that the theorem is stated
/// for.
#[test]
fn worst_texel_is_at_a_vertex() {
    let mut at_vertex = Ratchet::new("worst texel of a lamp at a vertex");
    let (mut seen, mut reached) = (0, 0);
    let more = (select(RULES.to_vec()), any::<bool>(), prop::array::uniform12(mixture()));
    each_lamp("worst-texel", CASES, more, |scene, _, (rule, is_fixed, samples)| {
        let scene = Scene { axes: if is_fixed { Axes::LightFixed } else { Axes::View }, ..scene };
        let fit = Fit { map_size: [512, 2048], viewport: [1920, 800], ..scene.fit() };
        let Ok(map) = fit.solve(rule) else { return };
        let points = lit(&scene, map.origin());
        let worst = fit.worst_texel(&map);
        let at = |q: DVec3| aliasing::pixels_per_texel(&map, &scene.view, [1920, 800], q + map.origin());
        let greatest = points.iter().map(|q| at(*q)).fold(0.0, f64::max);
        let slack = 1e-12 + rounding(&scene, &map, points[0]);
        at_vertex.note((worst / greatest - 1.0).abs(), slack, (worst, greatest));
        seen += 1;
        let depth = |q: DVec3| scene.view.forward().dot(q + map.origin() - scene.view.eye());
        let base = |q: DVec3| spot(&scene.light).direction().dot(q + map.origin() - spot(&scene.light).position());
        // Across the warp, along it, as logarithms are spaced, and the area.
        let measures = |q: DVec3| {
            let (w, b, z) = (map.w(q + map.origin()), base(q), depth(q));
            [at(q), w / z, w * w / (b * z), w * w * w / (b * z * z), w / b / z]
        };
        let greatest = points.iter().fold([0.0_f64; 5], |most, q| {
            let here = measures(*q);
            [0, 1, 2, 3, 4].map(|i| most[i].max(here[i]))
        });
        for q in samples {
            let q = q.of(&points);
            // The last is of no theorem.
            for (here, most) in measures(q).into_iter().zip(greatest).take(4) {
                assert!(here <= most * (1.0 + 1e-9), "{here} {most}");
                reached += usize::from(here > 0.5 * most);
            }
        }
    });
    at_vertex.finish();
    assert!(seen > 400 && reached > 500, "{seen} {reached}");
}

/// The rows of a matrix after rounding to f32, times a rounded point, as a shader does it.
fn in_f32(map: &ShadowMap, origin: DVec3, q: DVec3) -> DVec3 {
    let rounded: Mat4 = map.clip_from_world_at(origin, ClipSpace::WGPU).as_mat4();
    let p = q.as_vec3();
    let row = |i: usize| {
        let m = rounded.row(i);
        f64::from(m.x.mul_add(p.x, m.y.mul_add(p.y, m.z.mul_add(p.z, m.w))))
    };
    DVec3::new(row(0), row(1), row(2)) / row(3)
}

#[test]
fn guarded_maps_keep_what_a_lamp_shines_on_inside_in_f32() {
    let (mut guarded, mut refused, mut lost, mut largest) = (0, 0, 0, DVec3::ZERO);
    each_lamp("guarded", CASES, (select(RULES.to_vec()), any::<bool>()), |scene, _, (rule, about_eye)| {
        let fit = scene.fit();
        let Ok(exact) = fit.solve(rule) else { return };
        let origin = if about_eye { scene.view.eye() } else { exact.origin() };
        let bound = fit.rounding(&exact, origin) / DVec3::new(512.0, 512.0, 1.0);
        let map = match fit.guard_f32(&exact, origin) {
            Ok(map) => map,
            Err(error) => {
                // A margin of a texel or more, or of a quarter of the depth.
                assert!(matches!(error, Error::BeyondF32 { .. }), "{error}");
                assert!(bound.truncate().max_element() * 512.0 >= 1.0 || bound.z >= 0.25, "{bound}");
                refused += 1;
                return;
            }
        };
        guarded += 1;
        let casters = exact.shown(&scene.casters);
        // The box is cut with a rounding to spare.
        let is_shown = |q: &DVec3| {
            let place = ndc(&exact, *q + origin - exact.origin());
            (place * DVec3::new(1.0, 1.0, 2.0) - DVec3::Z).abs().max_element() <= 1.0 + 1e-9
        };
        let casters = casters.vertices().iter().map(|q| *q + casters.origin() - origin).filter(is_shown);
        let mut is_lost = false;
        for q in lit(&scene, origin).into_iter().chain(casters) {
            let place = in_f32(&map, origin, q);
            assert!(place.truncate().abs().max_element() <= 1.0, "{place} {map:?}");
            assert!((0.0..=1.0).contains(&place.z), "{place} {map:?}");
            let plain = in_f32(&exact, origin, q);
            is_lost |= plain.truncate().abs().max_element() > 1.0 || !(0.0..=1.0).contains(&plain.z);
            let off = plain - project(exact.clip_from_world_at(origin, ClipSpace::WGPU) * q.extend(1.0));
            // Half an ulp for the quotient itself.
            largest = largest.max((off.abs() - DVec3::splat(6e-8)) / bound);
        }
        lost += usize::from(is_lost);
    });
    println!("{guarded} guarded, {refused} refused, {lost} lost without; largest share of the bound {largest}");
    assert!(guarded > 200 && lost > 100, "{guarded} {lost}");
    assert!(largest.max_element() <= 1.0 && largest.min_element() > 0.1, "{largest}");
}

/// Six faces, each with a map of its own: all that is seen, from near to range, is in exactly one.
#[test]
fn faces_of_a_point_light_share_out_what_is_seen() {
    let (mut seen, mut dark) = ([0; 6], 0);
    let more = (select(RULES[..3].to_vec()), prop::array::uniform12((any::<prop::sample::Index>(), mixture())));
    each_lamp("faces", CASES / 2, more, |mut scene, _, (rule, samples)| {
        let (position, near, range) =
            (spot(&scene.light).position(), spot(&scene.light).near(), spot(&scene.light).range());
        let light = Light::point(position, near, range).unwrap();
        assert!(matches!(Fit { light: &light, ..scene.fit() }.solve(Rule::Uniform), Err(Error::Unsupported { .. })));
        let Light::Point(point) = light else { unreachable!() };
        let bodies: Vec<_> = scene.bodies.iter().filter(|b| !b.is_empty()).copied().collect();
        let samples: Vec<_> = samples
            .iter()
            .map(|(body, q)| (body.get(&bodies), q))
            .map(|(body, q)| q.of(body.vertices()) + body.origin())
            .filter(|p| {
                let from = *p - position;
                let mut sides = from.abs().to_array();
                sides.sort_by(f64::total_cmp);
                // Off the edges, and clearly between near and range.
                sides[2] - sides[1] > 1e-6 * sides[2] && sides[2] < range * 0.999 && from.length() > near * 1.001
            })
            .collect();
        let mut faces = vec![0; samples.len()];
        for (i, face) in point.faces().into_iter().enumerate() {
            scene.light = face;
            let axis = spot(&face).direction();
            let in_face = |p: &DVec3| axis.dot(*p - position) >= (*p - position).abs().max_element();
            let map = scene.fit().solve(rule);
            dark += usize::from(matches!(map, Err(Error::NothingLit)));
            for (p, faces) in samples.iter().zip(&mut faces) {
                if !in_face(p) {
                    continue;
                }
                *faces += 1;
                seen[i] += 1;
                let map = match &map {
                    Ok(map) => map,
                    // Too near for its distance.
                    Err(Error::Invalid { argument: "near", .. }) => continue,
                    Err(error) => unreachable!("{i} {error}"),
                };
                let place = ndc(map, *p - map.origin());
                let allowed = 1e-10 + 8.0 * rounding(&scene, map, *p - map.origin());
                assert!(place.truncate().abs().max_element() <= 1.0 + allowed, "{place} {map:?}");
                assert!(place.z >= -allowed && place.z <= 1.0 + allowed, "{place} {map:?}");
                // No other face's body has it.
                let space = map.light_space();
                let holds = |light: &Light| bodies.iter().any(|b| b.lit_by(light, &space).contains(*p - b.origin()));
                for (j, other) in point.faces().iter().enumerate().filter(|(j, _)| *j != i) {
                    assert!(!holds(other), "{i} {j} {p}");
                }
            }
        }
        assert!(faces.iter().all(|n| *n == 1), "{faces:?}");
    });
    println!("{seen:?}, dark {dark}");
    assert!(seen.iter().all(|n| *n > 100) && dark > 300, "{seen:?} {dark}");
}

/// Along the warp, and across it where the centre of the warp is, by the derivatives of the matrix.
#[test]
fn texels_are_as_large_as_the_matrix_says() {
    let mut worst = Ratchet::new("texels of a spot light's map");
    let mut seen = 0;
    let more = (log_between(0.1, 100.0), any::<prop::sample::Index>());
    each_lamp("texels-of-lamps", 2 * CASES, more, |scene, _, (excess, index)| {
        let warp = Warp::new(excess).unwrap();
        let fit = Fit { map_size: [512, 2048], ..scene.fit() };
        let Ok(map) = fit.solve(Rule::Explicit(warp)) else { return };
        let (space, eye, lamp) = (map.light_space(), scene.view.eye(), spot(&scene.light));
        let base = |p: DVec3| lamp.direction().dot(p - lamp.position());
        let across = |p: DVec3| space.x.dot(p - lamp.position()) / base(p);
        let points: Vec<_> = lit(&scene, map.origin()).into_iter().map(|q| q + map.origin()).collect();
        let [low, high] = extent(points.iter().map(|p| across(*p)));
        let distance = eye.distance(lamp.position());
        // The picture of the line of sight is one place across the warp, known well where the eye
        // is not beside the lamp.
        if base(eye).abs() < 0.1 * distance || space.sin_gamma < 1e-3 || high - low < 1e-3 {
            return;
        }
        let p = *index.get(&points);
        let p = p + space.x * ((across(eye).clamp(low, high) - across(p)) * base(p));
        let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
        let (w, q) = (matrix.row(3), (p - map.origin()).extend(1.0));
        let derivative = |row: usize, axis: DVec3| {
            let row = matrix.row(row);
            (row.truncate().dot(axis) * w.dot(q) - row.dot(q) * w.truncate().dot(axis)) / (w.dot(q) * w.dot(q))
        };
        let expected = [2.0 / (512.0 * derivative(0, space.x)), 2.0 / (2048.0 * derivative(1, space.z))].map(f64::abs);
        let slack = rounding(&scene, &map, p - map.origin());
        for (a, b) in map.texel_extent(p).into_iter().zip(expected) {
            worst.note((a / b - 1.0).abs(), 1e-13 + 4.0 * slack, (a, b));
        }
        seen += usize::from(slack < 1e-6);
    });
    worst.finish();
    assert!(seen > 200, "{seen}");
}
