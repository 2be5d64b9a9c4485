//! Spot lights: their worst texel, rounding to `f32`; the faces of point lights.

use crate::scenes::lamps::{lamp, lit, rounding, spot};
use crate::scenes::random::Random;
use crate::scenes::{extent, ndc, project};
use crate::{CASES, Worst};
use shadow_warp::glam::{DVec3, Mat4};
use shadow_warp::{Axes, ClipSpace, Error, Fit, Light, Rule, ShadowMap, Warp, aliasing};

const RULES: [Rule; 4] = [Rule::Uniform, Rule::LISPSM, Rule::OPTIMAL, Rule::PSM];

/// The vertices suffice: no point between them is worse, by any measure that the theorem is stated for.
#[test]
fn worst_texel_is_at_a_vertex() {
    let mut random = Random::new(43);
    let (mut seen, mut reached) = (0, 0);
    for case in 0..CASES {
        let (mut scene, _) = lamp(case);
        scene.axes = [Axes::View, Axes::LightFixed][random.below(2)];
        let fit = Fit { map_size: [512, 2048], viewport: [1920, 800], ..scene.fit() };
        let Ok(map) = fit.solve(RULES[case as usize % 4]) else { continue };
        let points = lit(&scene, map.origin());
        let worst = fit.worst_texel(&map);
        let at = |q: DVec3| aliasing::pixels_per_texel(&map, &scene.view, [1920, 800], q + map.origin());
        let greatest = points.iter().map(|q| at(*q)).fold(0.0, f64::max);
        assert!(
            (worst / greatest - 1.0).abs() < 1e-9 + 1e3 * rounding(&scene, &map, points[0]),
            "{case} {worst} {greatest}"
        );
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
        for _ in 0..20 {
            let q = random.mixed(&points);
            // The last is of no theorem.
            for (here, most) in measures(q).into_iter().zip(greatest).take(4) {
                assert!(here <= most * (1.0 + 1e-9), "{case} {here} {most}");
                reached += usize::from(here > 0.5 * most);
            }
        }
    }
    assert!(seen > 600 && reached > 1000, "{seen} {reached}");
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
    for case in 0..CASES {
        let (scene, _) = lamp(case);
        let fit = scene.fit();
        let Ok(exact) = fit.solve(RULES[case as usize % 4]) else { continue };
        let origin = if case % 2 == 0 { scene.view.eye() } else { exact.origin() };
        let bound = fit.rounding(&exact, origin) / DVec3::new(512.0, 512.0, 1.0);
        let map = match fit.guard_f32(&exact, origin) {
            Ok(map) => map,
            Err(error) => {
                assert!(matches!(error, Error::BeyondF32 { .. }), "{case} {error}");
                refused += 1;
                continue;
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
            assert!(place.truncate().abs().max_element() <= 1.0, "{case} {place} {map:?}");
            assert!((0.0..=1.0).contains(&place.z), "{case} {place} {map:?}");
            let plain = in_f32(&exact, origin, q);
            is_lost |= plain.truncate().abs().max_element() > 1.0 || !(0.0..=1.0).contains(&plain.z);
            let off = plain - project(exact.clip_from_world_at(origin, ClipSpace::WGPU) * q.extend(1.0));
            // Half an ulp for the quotient itself.
            largest = largest.max((off.abs() - DVec3::splat(6e-8)) / bound);
        }
        lost += usize::from(is_lost);
    }
    println!("{guarded} guarded, {refused} refused, {lost} lost without; largest share of the bound {largest}");
    assert!(guarded > 300 && lost > 200, "{guarded} {lost}");
    assert!(largest.max_element() <= 1.0 && largest.min_element() > 0.1, "{largest}");
}

/// Six faces, each with a map of its own: all that is seen, from near to range, is in exactly one.
#[test]
fn faces_of_a_point_light_share_out_what_is_seen() {
    let mut random = Random::new(44);
    let (mut seen, mut dark) = ([0; 6], 0);
    for case in 0..CASES {
        let (mut scene, _) = lamp(case);
        let (position, near, range) =
            (spot(&scene.light).position(), spot(&scene.light).near(), spot(&scene.light).range());
        let light = Light::point(position, near, range).unwrap();
        assert!(matches!(Fit { light: &light, ..scene.fit() }.solve(Rule::Uniform), Err(Error::Unsupported { .. })));
        let Light::Point(point) = light else { continue };
        let bodies: Vec<_> = scene.bodies.iter().filter(|b| !b.is_empty()).copied().collect();
        let samples: Vec<_> = (0..12)
            .map(|_| {
                let body = &bodies[random.below(bodies.len())];
                random.mixed(body.vertices()) + body.origin()
            })
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
            let map = scene.fit().solve(RULES[(case as usize + i) % 3]);
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
                    Err(error) => unreachable!("{case} {i} {error}"),
                };
                let place = ndc(map, *p - map.origin());
                let allowed = 1e-9 + rounding(&scene, map, *p - map.origin());
                assert!(place.truncate().abs().max_element() <= 1.0 + allowed, "{case} {place} {map:?}");
                assert!(place.z >= -allowed && place.z <= 1.0 + allowed, "{case} {place} {map:?}");
                // No other face's body has it.
                let space = map.light_space();
                let holds = |light: &Light| bodies.iter().any(|b| b.lit_by(light, &space).contains(*p - b.origin()));
                for (j, other) in point.faces().iter().enumerate().filter(|(j, _)| *j != i) {
                    assert!(!holds(other), "{case} {i} {j} {p}");
                }
            }
        }
        assert!(faces.iter().all(|n| *n == 1), "{case} {faces:?}");
    }
    println!("{seen:?}, dark {dark}");
    assert!(seen.iter().all(|n| *n > 300) && dark > 1000, "{seen:?} {dark}");
}

/// Along the warp, and across it where the centre of the warp is, by the derivatives of the matrix.
#[test]
fn texels_are_as_large_as_the_matrix_says() {
    let mut worst = Worst::new("texels of a spot light's map");
    let mut random = Random::new(50);
    let mut seen = 0;
    for case in 0..CASES {
        let (scene, _) = lamp(case);
        let warp = Warp::new(random.log_between(0.1, 100.0)).unwrap();
        let fit = Fit { map_size: [512, 2048], ..scene.fit() };
        let Ok(map) = fit.solve(Rule::Explicit(warp)) else { continue };
        let (space, eye, lamp) = (map.light_space(), scene.view.eye(), spot(&scene.light));
        let base = |p: DVec3| lamp.direction().dot(p - lamp.position());
        let across = |p: DVec3| space.x.dot(p - lamp.position()) / base(p);
        let points: Vec<_> = lit(&scene, map.origin()).into_iter().map(|q| q + map.origin()).collect();
        let [low, high] = extent(points.iter().map(|p| across(*p)));
        let distance = eye.distance(lamp.position());
        // The picture of the line of sight is one place across the warp, known well where the eye is not beside the lamp.
        if base(eye).abs() < 0.1 * distance || space.sin_gamma < 1e-3 || high - low < 1e-3 {
            continue;
        }
        let p = points[random.below(points.len())];
        let p = p + space.x * ((across(eye).clamp(low, high) - across(p)) * base(p));
        let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
        let (w, q) = (matrix.row(3), (p - map.origin()).extend(1.0));
        let derivative = |row: usize, axis: DVec3| {
            let row = matrix.row(row);
            (row.truncate().dot(axis) * w.dot(q) - row.dot(q) * w.truncate().dot(axis)) / (w.dot(q) * w.dot(q))
        };
        let expected = [2.0 / (512.0 * derivative(0, space.x)), 2.0 / (2048.0 * derivative(1, space.z))].map(f64::abs);
        let slack = 1e3 * rounding(&scene, &map, p - map.origin());
        for (a, b) in map.texel_extent(p).into_iter().zip(expected) {
            worst.note((a / b - 1.0).abs(), 1e-12 + slack, (case, a, b));
        }
        seen += usize::from(slack < 1e-6);
    }
    assert!(seen > 200, "{seen}");
}
