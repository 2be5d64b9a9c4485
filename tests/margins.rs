//! Margins: against rounding to `f32`, whatever the order of the sums, and for filters.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]
#![expect(clippy::float_cmp, reason = "what is compared is exact")]

mod random;

use proptest::prelude::*;
use proptest::sample::select;
use random::basic::{direction, inside};
use random::measure::{Scene, box_about, extent, ndc, product_rounding, project, sizes};
use random::scenes::{each_kind, rule};
use random::{Ratchet, check};
use shadow_warp::glam::{DVec3, Mat4, Vec3, Vec4};
use shadow_warp::{ClipSpace, Error, Fit, NearDepth, Rule, ShadowMap, View};

const CASES: u32 = 400;
const SPACES: [ClipSpace; 4] =
    [ClipSpace::WGPU, ClipSpace::OPENGL, ClipSpace::VULKAN, ClipSpace::OPENGL_ZERO_TO_ONE.reversed()];

/// All orders of four terms.
fn orders() -> Vec<[usize; 4]> {
    let all = (0..256_usize).map(|i| [i & 3, i >> 2 & 3, i >> 4 & 3, i >> 6]);
    all.filter(|o| (0..4).all(|term| o.contains(&term))).collect()
}

/// The least and greatest that f32 can make of a row times a point: all orders of the sums, in a
/// chain or in pairs, each fused and not. The last term is the constant's, which has no product.
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

/// Everything stays inside: in each convention, for each order, even if the rows are summed in
/// different orders.
#[test]
fn guarded_maps_keep_everything_inside_in_f32() {
    let orders = orders();
    assert_eq!(orders.len(), 24);
    let (mut guarded, mut refused, mut strong, mut advice) = (0, 0, 0, [0; 2]);
    let mut shares = ["x in f32 of its bound", "y in f32 of its bound", "depth in f32 of its bound"].map(Ratchet::new);
    let more = (rule(), select(SPACES.to_vec()), any::<bool>());
    each_kind("guarded", 100, more, |scene, _, (rule, space, about_eye)| {
        let fit = scene.fit();
        let exact = fit.solve(rule).unwrap();
        let origin = if about_eye { scene.view.eye() } else { exact.origin() };
        let [width, height] = exact.size().map(f64::from);
        let half = DVec3::new(0.5 * width, 0.5 * height, 1.0);
        let bound = fit.rounding(&exact, origin);
        // A margin that is less than a texel, and less than a quarter of the map.
        let serves = bound.truncate().max_element() < 1.0 && (bound / half).max_element() < 0.25;
        let map = match fit.guard_f32(&exact, origin) {
            Ok(map) => map,
            Err(error) => {
                assert!(!serves, "{bound}");
                let Error::BeyondF32 { texels, cause } = error else { unreachable!("{error}") };
                assert!(texels == bound.truncate().max_element() || !bound.is_finite(), "{texels} {bound}");
                refused += 1;
                // The way out that it names is one.
                if cause.starts_with("the origin is too far away: ") {
                    advice[0] += 1;
                    fit.guard_f32(&exact, exact.origin()).unwrap();
                } else if cause.starts_with("the casters' box is too deep: ") {
                    advice[1] += 1;
                    let fit = Fit { near_depth: NearDepth::Receivers, ..fit };
                    let same = fit.solve(Rule::Explicit(exact.warp())).unwrap();
                    fit.guard_f32(&same, origin).unwrap();
                }
                return;
            }
        };
        assert!(serves, "{bound}");
        guarded += 1;
        strong += u32::from(map.warp().excess() > 100.0);
        let bound = fit.rounding(&map, origin) / half;
        let rows = rows(&map, origin, space);
        let mut check = |q: DVec3, is_receiver: bool| {
            let p = q.as_vec3();
            let [x, y, z, w] = rows.map(|row| any_order(row, p, &orders));
            let floor = if space == ClipSpace::OPENGL { -w[0] } else { 0.0 };
            assert!(w[0] > 0.0 && z[0] >= floor && z[1] <= w[0], "{z:?} {w:?}");
            if is_receiver {
                assert!(-w[0] <= x[0] && x[1] <= w[0], "{x:?} {w:?}");
                assert!(-w[0] <= y[0] && y[1] <= w[0], "{y:?} {w:?}");
                let exact = project(map.clip_from_world_at(origin, space) * q.extend(1.0));
                let off = |c: [f64; 2], exact: f64| (c[0] / w[1] - exact).abs().max((c[1] / w[0] - exact).abs());
                shares[0].note(off(x, exact.x), bound.x, q);
                shares[1].note(off(y, exact.y), bound.y, q);
                if floor == 0.0 {
                    shares[2].note(off(z, exact.z), bound.z, q);
                }
            }
        };
        for q in scene.receivers(origin) {
            check(q, true);
        }
        for q in scene.caster_points(origin) {
            // The vertices of the casters are themselves rounded, sideways by more than f32 where
            // the body is thin.
            if product_rounding(&exact, q + origin - exact.origin()) < 1e-9 {
                check(q, false);
            }
        }
    });
    println!("{guarded} guarded, {refused} refused, {strong} strong");
    assert!(guarded > 300 && refused > 20 && strong > 10, "{guarded} {refused} {strong}");
    assert!(advice.iter().all(|n| *n > 3), "{advice:?}");
    // A bound, and not an idle one.
    shares.into_iter().for_each(Ratchet::finish);
}

/// Without the margin something is lost, so the margin is needed.
#[test]
fn maps_without_a_margin_lose_receivers_in_f32() {
    let orders = orders();
    let (mut lost, mut seen) = (0, 0);
    each_kind("unguarded", 15, Just(()), |scene, _, ()| {
        let map = scene.fit().solve(Rule::LISPSM).unwrap();
        let rows = rows(&map, scene.view.eye(), ClipSpace::WGPU);
        let out = scene.receivers(scene.view.eye()).iter().any(|q| {
            let [x, y, z, w] = rows.map(|row| any_order(row, q.as_vec3(), &orders));
            x[1] > w[0] || y[1] > w[0] || z[0] < 0.0 || z[1] > w[0]
        });
        lost += u32::from(out);
        seen += 1;
    });
    assert!(lost * 10 > seen * 8, "{lost} of {seen}");
}

/// A frustum around the origin, as an engine with camera-relative rendering has it.
fn plain() -> impl Strategy<Value = Scene> + Clone {
    let camera = (inside(100.0), direction(), direction());
    (camera, 0.5..1.5, 0.1..2.0, 10.0..200.0, direction()).prop_map(
        |((eye, forward, up), fov, near, far, to_light): ((DVec3, DVec3, DVec3), f64, f64, f64, DVec3)| {
            let up = if up.cross(forward).length() > 1e-6 { up } else { forward.any_orthonormal_vector() };
            let view = View::perspective(eye, forward, up, fov, 1.5, near..near * far).unwrap();
            let all = box_about(view.eye(), DVec3::splat(2.0 * view.far()));
            Scene::new(view, to_light, &[all], all)
        },
    )
}

/// Relative to the eye or the body the margin is some ulp of f32: 100 at most for a uniform map no
/// deeper than wide. It grows with the warp's ratio, and with the depth of the map, as casters that
/// stand high above the receivers are subject to rounding too.
#[test]
fn margins_are_small() {
    let mut uniform = Ratchet::new("margin of uniform maps in ulp");
    let mut all = Ratchet::new("margin of any map, over ratio and depth over width, in ulp");
    let mut used = 0;
    let rules = select(vec![Rule::Uniform, Rule::LISPSM]);
    let more = (select(vec![NearDepth::Receivers, NearDepth::Casters]), rules, any::<bool>());
    let mut property = |scene: Scene, is_plain: bool, (near_depth, rule, about_eye): (NearDepth, Rule, bool)| {
        let scene = Scene { near_depth, ..scene };
        let fit = Fit { map_size: [2, 2], ..scene.fit() };
        let map = fit.solve(rule).unwrap();
        let origin = if about_eye { scene.view.eye() } else { map.origin() };
        let rounding = fit.rounding(&map, origin) / f64::from(f32::EPSILON);
        // Depth over width, where w = 1.
        let rows = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
        let range = 1.0 / rows.row(2).truncate().dot(scene.to_light()).abs();
        let deep = rows.row(0).truncate().length() * range;
        assert!(rounding.min_element() > 1.0, "{rounding}");
        // And no thinner than deep, wherever the origin is.
        let [across, height, along] = sizes(&scene.receivers(origin), &map);
        let reach = scene.receivers(origin).iter().map(|q| q.length()).fold(range, f64::max);
        if rule == Rule::Uniform && reach < 3.0 * across.min(along).min(height) {
            uniform.note(rounding.max_element(), 100.0, rounding);
            used += 1;
        }
        if is_plain {
            all.note(rounding.max_element(), 20.0 * (map.warp().ratio() + deep), rounding);
        }
    };
    check("margins", CASES, (plain(), more.clone()), |(scene, more)| property(scene, true, more));
    each_kind("margins", CASES / 2, more, |scene, _, more| property(scene, false, more));
    uniform.finish();
    all.finish();
    assert!(used > 30, "{used}");
}

/// 1e7 from the origin the guard refuses, and says how many texels are lost; it is never less than
/// what is lost.
#[test]
fn far_origins_are_refused_with_a_bound() {
    let orders = orders();
    let mut share = Ratchet::new("displacement about a far origin, of its bound");
    check("far-origins", CASES / 2, (plain(), direction()), |(scene, away)| {
        let origin = scene.view.eye() - 1e7 * away;
        let fit = scene.fit();
        let map = fit.solve(Rule::LISPSM).unwrap();
        let Err(Error::BeyondF32 { texels, cause }) = fit.guard_f32(&map, origin) else { unreachable!("not refused") };
        assert!(texels >= 1.0 && cause.starts_with("the origin is too far away"), "{texels} {cause}");
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
            share.note(worst, texels, away);
        }
    });
    share.finish();
}

/// A border is exactly so many texels wide on each side, whatever the map's shape, and leaves depth
/// alone.
#[test]
fn borders_are_as_wide_as_asked() {
    let mut sides = Ratchet::new("width of a border");
    let mut wider = Ratchet::new("texels with a border");
    check("borders", CASES, (plain(), 0.0..100.0), |(scene, texels)| {
        let fit = Fit { map_size: [1024, 256], ..scene.fit() };
        let map = fit.solve(Rule::LISPSM).unwrap();
        let bordered = map.with_border(texels).unwrap();
        let points: Vec<_> =
            scene.receivers(map.origin()).iter().map(|q| (ndc(&bordered, *q), ndc(&map, *q))).collect();
        for (axis, size) in [(0, 1024.0), (1, 256.0)] {
            let [low, high] = extent(points.iter().map(|(p, _)| 0.5 * (p[axis] + 1.0) * size));
            sides.note((low - texels).abs().max((size - high - texels).abs()), 1e-12, (low, high));
        }
        for (with, without) in &points {
            assert_eq!(with.z, without.z);
        }
        // A texel is wider by as much as fewer are left, and the worst texel with it.
        let point = map.origin() + scene.receivers(map.origin())[0];
        let left = [1024.0, 256.0].map(|size| size / (size - 2.0 * texels));
        for ((with, without), left) in bordered.texel_extent(point).into_iter().zip(map.texel_extent(point)).zip(left) {
            wider.note((with / without / left - 1.0).abs(), 1e-15, (with, without));
        }
        assert_eq!(bordered.with_border(0.0).unwrap(), bordered);
        assert_eq!((bordered.warp(), bordered.size()), (map.warp(), map.size()));
    });
    for ratchet in [sides, wider] {
        ratchet.finish();
    }
}
