//! Margins: against rounding to `f32`, whatever the order of the sums, and for filters.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]

mod scenes;

use scenes::random::Random;
use scenes::{Scene, box_about, extent, moderate, ndc, product_rounding, project, rules};
use shadow_warp::glam::{DVec3, Mat4, Vec3, Vec4};
use shadow_warp::{ClipSpace, Error, Fit, NearDepth, Rule, ShadowMap, View};

const CASES: u64 = 600;
const SPACES: [ClipSpace; 4] =
    [ClipSpace::WGPU, ClipSpace::OPENGL, ClipSpace::VULKAN, ClipSpace::OPENGL_ZERO_TO_ONE.reversed()];

/// All orders of four terms.
fn orders() -> Vec<[usize; 4]> {
    let all = (0..256_usize).map(|i| [i & 3, i >> 2 & 3, i >> 4 & 3, i >> 6]);
    all.filter(|o| (0..4).all(|term| o.contains(&term))).collect()
}

/// The least and greatest that f32 can make of a row times a point: all orders of the sums, in a chain or in pairs,
/// each fused and not. The last term is the constant's, which has no product.
fn any_order(row: Vec4, p: Vec3, orders: &[[usize; 4]]) -> [f64; 2] {
    let (m, p) = (row.to_array(), [p.x, p.y, p.z, 1.0]);
    let product = |i: usize| m[i] * p[i];
    let values = orders.iter().flat_map(|&[a, b, c, d]| {
        let pair = |i: usize, j: usize| m[j].mul_add(p[j], product(i));
        [
            ((product(a) + product(b)) + product(c)) + product(d),
            (product(a) + product(b)) + (product(c) + product(d)),
            m[d].mul_add(p[d], m[c].mul_add(p[c], pair(a, b))),
            pair(a, b) + pair(c, d),
        ]
    });
    extent(values.map(f64::from))
}

/// The rows of a matrix after rounding to f32, as a shader sees them.
fn rows(map: &ShadowMap, origin: DVec3, space: ClipSpace) -> [Vec4; 4] {
    let rounded: Mat4 = map.clip_from_world_at(origin, space).as_mat4();
    [0, 1, 2, 3].map(|i| rounded.row(i))
}

/// Everything stays inside: in each convention, for each order, even if the rows are summed in different orders.
#[test]
fn guarded_maps_keep_everything_inside_in_f32() {
    let orders = orders();
    assert_eq!(orders.len(), 24);
    let (mut guarded, mut refused, mut strong, mut largest) = (0, 0, 0, DVec3::ZERO);
    for case in 0..CASES {
        let (scene, _) = moderate(case);
        let fit = scene.fit();
        for rule in rules(&mut Random::new(case)) {
            let exact = fit.solve(rule).unwrap();
            let origin = if case % 2 == 0 { scene.view.eye() } else { exact.origin() };
            let map = match fit.guard_f32(&exact, origin) {
                Ok(map) => map,
                Err(error) => {
                    assert!(matches!(error, Error::BeyondF32 { texels } if texels >= 1.0 || texels.is_finite()));
                    refused += 1;
                    continue;
                }
            };
            guarded += 1;
            strong += u32::from(map.warp().excess() > 100.0);
            let [width, height] = map.size().map(f64::from);
            let bound = fit.rounding(&map, origin) / DVec3::new(0.5 * width, 0.5 * height, 1.0);
            for space in [SPACES[0], SPACES[1 + case as usize % 3]] {
                let rows = rows(&map, origin, space);
                let check = |q: DVec3, sides: bool| {
                    let p = q.as_vec3();
                    let [x, y, z, w] = rows.map(|row| any_order(row, p, &orders));
                    let context = (case, rule, space);
                    let floor = if space == ClipSpace::OPENGL { -w[0] } else { 0.0 };
                    assert!(w[0] > 0.0 && z[0] >= floor && z[1] <= w[0], "{context:?} {z:?} {w:?}");
                    if sides {
                        assert!(-w[0] <= x[0] && x[1] <= w[0], "{context:?} {x:?} {w:?}");
                        assert!(-w[0] <= y[0] && y[1] <= w[0], "{context:?} {y:?} {w:?}");
                    }
                    let exact = project(map.clip_from_world_at(origin, space) * q.extend(1.0));
                    let off = |c: [f64; 2], exact: f64| (c[0] / w[1] - exact).abs().max((c[1] / w[0] - exact).abs());
                    DVec3::new(off(x, exact.x), off(y, exact.y), if floor == 0.0 { off(z, exact.z) } else { 0.0 })
                };
                for q in scene.receivers(origin) {
                    largest = largest.max(check(q, true) / bound);
                }
                for q in scene.caster_points(origin) {
                    // The vertices of the casters are themselves rounded, sideways by more than f32 where the body is
                    // thin.
                    if product_rounding(&exact, q + origin - exact.origin()) < 1e-9 {
                        check(q, false);
                    }
                }
            }
        }
    }
    println!("{guarded} guarded, {refused} refused, {strong} strong; largest share of the bound {largest}");
    assert!(guarded > 2000 && strong > 40, "{guarded} {strong}");
    // A bound, and not an idle one.
    assert!(largest.max_element() <= 1.0 && largest.min_element() > 0.2, "{largest}");
}

/// Without the margin something is lost, so the margin is needed.
#[test]
fn maps_without_a_margin_lose_receivers_in_f32() {
    let orders = orders();
    let mut lost = 0;
    for case in 0..100 {
        let (scene, _) = moderate(case);
        let map = scene.fit().solve(Rule::LISPSM).unwrap();
        let rows = rows(&map, scene.view.eye(), ClipSpace::WGPU);
        let out = scene.receivers(scene.view.eye()).iter().any(|q| {
            let [x, y, z, w] = rows.map(|row| any_order(row, q.as_vec3(), &orders));
            x[1] > w[0] || y[1] > w[0] || z[0] < 0.0 || z[1] > w[0]
        });
        lost += u32::from(out);
    }
    assert!(lost > 80, "{lost}");
}

/// A frustum around the origin, as an engine with camera-relative rendering has it.
fn plain(random: &mut Random) -> Scene {
    let near = random.between(0.1, 2.0);
    let view = View::perspective(
        random.inside(100.0),
        random.direction(),
        random.direction(),
        random.between(0.5, 1.5),
        1.5,
        near..near * random.between(10.0, 200.0),
    );
    let view = view.unwrap();
    let all = box_about(view.eye(), DVec3::splat(2.0 * view.far()));
    Scene::new(view, random.direction(), &[all], all)
}

/// Relative to the eye the margin is some ulp of f32: 40 at most for a uniform map no deeper than wide. It grows with
/// the warp's ratio, and with the depth of the map, as casters that stand high above the receivers are subject to
/// rounding too.
#[test]
fn margins_are_small() {
    let (mut uniform, mut share, mut used) = (DVec3::ZERO, 0.0_f64, 0);
    for case in 0..CASES {
        let mut scene = plain(&mut Random::new(case));
        for (near_depth, rule) in [
            (NearDepth::Receivers, Rule::Uniform),
            (NearDepth::Receivers, Rule::LISPSM),
            (NearDepth::Casters, Rule::LISPSM),
        ] {
            scene.near_depth = near_depth;
            let fit = Fit { map_size: [2, 2], ..scene.fit() };
            let map = fit.solve(rule).unwrap();
            let rounding = fit.rounding(&map, scene.view.eye()) / f64::from(f32::EPSILON);
            let rows = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
            // Depth over width, where w = 1.
            let deep = rows.row(0).truncate().length() / rows.row(2).truncate().dot(scene.to_light()).abs();
            if rule == Rule::Uniform && deep < 2.0 {
                uniform = uniform.max(rounding);
                used += 1;
            }
            share = share.max(rounding.max_element() / (map.warp().ratio() + deep));
        }
    }
    println!("largest margin of uniform maps {uniform} ulp in {used}; of all {share} times ratio and depth over width");
    assert!(used > 100 && uniform.max_element() <= 40.0 && uniform.min_element() > 1.0, "{used} {uniform}");
    assert!(share <= 20.0, "{share}");
}

/// 1e7 from the origin the guard refuses, and says how many texels are lost; it is never less than what is lost.
#[test]
fn far_origins_are_refused_with_a_bound() {
    let orders = orders();
    let mut share = 0.0_f64;
    for case in 0..200 {
        let mut random = Random::new(case);
        let scene = plain(&mut random);
        let origin = scene.view.eye() - 1e7 * random.direction();
        let fit = scene.fit();
        let map = fit.solve(Rule::LISPSM).unwrap();
        let Err(Error::BeyondF32 { texels }) = fit.guard_f32(&map, origin) else { unreachable!("{case}") };
        let rows = rows(&map, origin, ClipSpace::WGPU);
        let mut worst = 0.0_f64;
        for q in scene.receivers(origin) {
            let exact = project(map.clip_from_world_at(origin, ClipSpace::WGPU) * q.extend(1.0));
            let [x, y, _, w] = rows.map(|row| any_order(row, q.as_vec3(), &orders));
            if w[0] > 0.0 {
                let ends = [[x[0], exact.x], [x[1], exact.x], [y[0], exact.y], [y[1], exact.y]];
                worst = ends.iter().map(|[c, exact]| (c / w[0] - exact).abs() * 512.0).fold(worst, f64::max);
            }
        }
        if texels.is_finite() {
            assert!(worst <= texels, "{case} {worst} {texels}");
            share = share.max(worst / texels);
        }
    }
    println!("largest share of the stated displacement {share}");
    assert!(share > 0.1);
}

/// A border is exactly so many texels wide on each side, whatever the map's shape, and leaves depth alone.
#[test]
fn borders_are_as_wide_as_asked() {
    for case in 0..CASES {
        let mut random = Random::new(case);
        let scene = plain(&mut random);
        let fit = Fit { map_size: [1024, 256], ..scene.fit() };
        let map = fit.solve(Rule::LISPSM).unwrap();
        let texels = random.between(0.0, 100.0);
        let bordered = map.with_border(texels).unwrap();
        let points: Vec<_> =
            scene.receivers(map.origin()).iter().map(|q| (ndc(&bordered, *q), ndc(&map, *q))).collect();
        for (axis, size) in [(0, 1024.0), (1, 256.0)] {
            let [low, high] = extent(points.iter().map(|(p, _)| 0.5 * (p[axis] + 1.0) * size));
            assert!((low - texels).abs() < 1e-9 && (size - high - texels).abs() < 1e-9, "{low} {high} {texels}");
        }
        assert!(points.iter().all(|(with, without)| (with.z - without.z).abs() < 1e-15));
        // A texel is wider by as much as fewer are left, and the worst texel with it.
        let point = map.origin() + scene.receivers(map.origin())[0];
        let left = [1024.0, 256.0].map(|size| size / (size - 2.0 * texels));
        for ((with, without), left) in bordered.texel_extent(point).into_iter().zip(map.texel_extent(point)).zip(left) {
            assert!((with / without / left - 1.0).abs() < 1e-14);
        }
        assert_eq!(bordered.with_border(0.0).unwrap(), bordered);
        assert_eq!((bordered.warp(), bordered.size()), (map.warp(), map.size()));
    }
}
