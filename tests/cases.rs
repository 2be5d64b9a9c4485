//! Scenes on which maps once went wrong, each the shape of something that users of shadow maps report, with the right values.
#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]

use approx::{assert_abs_diff_eq, assert_relative_eq};
use shadow_warp::glam::{DVec2, DVec3, dvec3};
use shadow_warp::{
    Aim, Axes, Body, Bounds, ClipSpace, Error, Fit, Light, NearDepth, Objective, PerspectiveRule, Plane, Rule,
    ShadowMap, Sides, View, Warp,
};

/// A view, a light, one box that casts and receives, and the sizes of map and picture.
struct Case {
    view: View,
    light: Light,
    casters: Bounds,
    seen: [Body; 1],
    map_size: [u32; 2],
}

impl Case {
    fn new(view: View, light: Light, bounds: [DVec3; 2], map_size: u32) -> Self {
        let casters = Bounds::new(bounds[0], bounds[1]).unwrap();
        let seen = [Body::visible(&view, &casters)];
        Self { view, light, casters, seen, map_size: [map_size; 2] }
    }

    fn fit(&self) -> Fit<'_> {
        Fit { map_size: self.map_size, ..Fit::new(&self.view, &self.light, &self.casters, &self.seen) }
    }

    fn on(&self, axes: Axes) -> Fit<'_> {
        Fit { axes, ..self.fit() }
    }
}

fn look([eye, forward]: [DVec3; 2], fov_y: f64, aspect: f64, [near, far]: [f64; 2]) -> View {
    View::perspective(eye, forward, DVec3::Y, fov_y, aspect, near..far).unwrap()
}

fn worst(fit: &Fit, rule: Rule) -> f64 {
    fit.worst_texel(&fit.solve(rule).unwrap())
}

fn place(map: &ShadowMap, point: DVec3) -> DVec2 {
    let q = map.clip_from_world_at(map.origin(), ClipSpace::WGPU) * (point - map.origin()).extend(1.0);
    q.truncate().truncate() / q.w * 0.5 * f64::from(map.size()[0])
}

/// A wide landscape, the sun opposite: two pieces of the error meet where the last step of the search leaves its bracket by a
/// rounding.
fn landscape(forward: DVec3) -> Case {
    let view = look([dvec3(0.0, 64.0, 0.0), forward], 75_f64.to_radians(), 16.0 / 9.0, [7.0, 30_000.0]);
    let light =
        Light::directional(dvec3(1.060_575_238_724_906_9e-16, 0.499_999_999_999_999_94, -0.866_025_403_784_438_7));
    Case::new(view, light.unwrap(), [dvec3(-4000.0, 0.0, -4000.0), dvec3(4000.0, 512.0, 4000.0)], 2048)
}

#[test]
fn the_best_warp_does_not_blow_up() {
    let case = landscape(dvec3(0.821_596_493_300_412_4, -0.173_648_177_666_930_33, 0.542_978_372_119_386_9));
    let beside = landscape(dvec3(0.821_501_713_183_657_4, -0.173_648_177_666_930_33, 0.543_121_759_487_934_7));
    assert_relative_eq!(worst(&case.fit(), Rule::OPTIMAL), 21.1148740, max_relative = 1e-8);
    assert_relative_eq!(worst(&beside.fit(), Rule::OPTIMAL), 21.1255130, max_relative = 1e-7);
    assert_relative_eq!(worst(&case.fit(), Rule::Uniform), 211.491_794, max_relative = 1e-8);
    // Across, the error has its own least value, far away.
    let across = |case: &Case| {
        let fit = case.fit();
        fit.errors(fit.solve(Rule::Optimal(Objective::Across)).unwrap().warp()).unwrap().across
    };
    assert_relative_eq!(across(&case), across(&beside), max_relative = 3e-3);
}

/// The error across is the same for ratios from 4.9 to 306: the error along decides.
#[test]
fn flat_ground_is_resolved_by_the_other_error() {
    let view = look([dvec3(12.0, 5.0, 5.0), dvec3(5.0, -1.0, 5.0)], 1.0, 1.5, [0.5, 500.0]);
    let bounds = [dvec3(-100.0, 0.0, -100.0), dvec3(100.0, 20.0, 100.0)];
    // One step of rounding apart.
    let cases = [0.549_882_295_985_760_7, 0.549_882_295_985_760_5]
        .map(|y| Case::new(view, Light::directional(dvec3(1.0, y, 1.0)).unwrap(), bounds, 1024));
    let maps = cases.each_ref().map(|case| case.fit().solve(Rule::OPTIMAL).unwrap());
    for (case, map) in cases.iter().zip(&maps) {
        let errors = case.fit().errors(map.warp()).unwrap();
        assert_relative_eq!(errors.across, 140.312_083, max_relative = 1e-8);
        assert_relative_eq!(errors.along, 8.548_301, max_relative = 1e-6);
        assert_relative_eq!(map.warp().ratio(), 18.673_5, max_relative = 1e-5);
    }
    for vertex in cases[0].seen[0].vertices() {
        let point = *vertex + cases[0].seen[0].origin();
        assert_abs_diff_eq!(place(&maps[0], point), place(&maps[1], point), epsilon = 1e-6);
    }
}

/// No warp lies at the edge of the flat ground, as good as its bottom to within a tie: rounding must not choose.
#[test]
fn rounding_does_not_choose_among_equals() {
    let eye = dvec3(25.474454167530013, 39.35695512848033, 46.90242106926745);
    let forward = dvec3(-0.15425314662343825, 0.17170835138792073, 0.23753612343967712);
    let up = dvec3(-0.5074696237354492, -0.23040125844055437, -0.13989252679046849);
    let depth = 0.11136563083735657..3522.3590078860307;
    let view = View::perspective(eye, forward, up, 0.8142356788624117, 1.1340816643699243, depth).unwrap();
    let flat = Bounds::new(
        dvec3(15.530327531207439, -199.4893151133416, 167.52979798993812),
        dvec3(40.85181729454586, -51.493614892077176, 167.52979798993812),
    );
    let origin = dvec3(22.129912205377572, -111.17648650326905, 191.9793702477878);
    let seen = [Body::from_box(&flat.unwrap(), origin).unwrap()];
    let casters = Bounds::new(dvec3(-202.0, -71.0, -2.0), dvec3(132.0, 263.0, 332.0)).unwrap();
    for axes in [Axes::View, Axes::Middle] {
        let [a, b] = [-0.06257557633481899, -0.06257557633481897].map(|y| {
            let light = Light::directional(dvec3(-0.46130839291981424, y, 0.4081469225833118)).unwrap();
            let fit = Fit::new(&view, &light, &casters, &seen);
            let fit = Fit { map_size: [512, 2048], viewport: [1080, 1920], axes, ..fit };
            let warp = fit.solve(Rule::OPTIMAL).unwrap().warp();
            (warp.ratio(), fit.errors(warp).unwrap())
        });
        assert_relative_eq!(a.0, b.0, max_relative = 1e-6);
        assert_relative_eq!(a.1.along, b.1.along, max_relative = 1e-6);
    }
}

/// A lamp above what the camera looks at, its face that shines down: the worst texel is across, whatever the warp.
#[test]
fn a_lamp_straight_ahead_has_the_smaller_error_along() {
    let view = look([dvec3(0.0, 2.0, -12.0), dvec3(0.0, -0.05, 1.0)], 60_f64.to_radians(), 16.0 / 9.0, [0.1, 1000.0]);
    let lamp = Light::point(dvec3(0.0, 6.0, 0.0), 0.1, 40.0).unwrap();
    let bounds = [dvec3(-20.0, 0.0, -20.0), dvec3(20.0, 8.0, 20.0)];
    let case = Case::new(view, lamp.as_point().unwrap().faces()[3], bounds, 1024);
    for axes in [Axes::View, Axes::LightFixed, Axes::Middle] {
        let fit = case.on(axes);
        let [plain, best] = [Rule::Uniform, Rule::OPTIMAL].map(|rule| fit.solve(rule).unwrap());
        assert_relative_eq!(fit.worst_texel(&plain), 1.799_070, max_relative = 1e-6);
        assert_relative_eq!(fit.worst_texel(&best), fit.worst_texel(&plain), max_relative = 1e-9);
        // No warp: 1.799; the strongest that is as good: 1.799.
        assert_relative_eq!(fit.errors(best.warp()).unwrap().along, 1.0444, max_relative = 1e-4);
        assert_relative_eq!(best.warp().excess(), 0.7226, max_relative = 1e-4);
    }
}

/// A map on the same axes with another centre has a smaller error across than the least over the ratios with this centre.
#[test]
fn the_least_error_across_is_no_bound_for_other_centres() {
    let view = look([dvec3(-37.0, 3.0, 12.0), dvec3(-4.0, -3.0, 5.0)], 1.0, 1.5, [0.25, 1000.0]);
    let light = Light::directional(dvec3(-6.0, 1.0, 10.0)).unwrap();
    let case = Case::new(view, light, [dvec3(-200.0, 0.0, -200.0), dvec3(200.0, 1.0, 200.0)], 1024);
    let (fit, body) = (case.fit(), &case.seen[0]);
    let least = fit.least_errors().unwrap().across;
    assert_relative_eq!(least, 92.049_404, max_relative = 1e-7);

    // From the definition: w/z (max x/w - min x/w) pixels over texels, x from the centre.
    let space = fit.solve(Rule::Uniform).unwrap().light_space();
    let points: Vec<DVec3> = body.vertices().iter().map(|v| *v + body.origin()).collect();
    let fold = |values: &dyn Fn(&DVec3) -> f64| {
        points.iter().map(values).fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
    };
    let [start, end] = fold(&|p| space.z.dot(*p));
    let across = |ratio: f64, centre: f64| {
        let w = |p: &DVec3| 1.0 + (ratio - 1.0) * (space.z.dot(*p) - start) / (end - start);
        let [low, high] = fold(&|p| (space.x.dot(*p) - centre) / w(p));
        let [_, most] = fold(&|p| w(p) / view.forward().dot(*p - view.eye()).max(view.near()));
        most * (high - low) * view.pixels_per_unit(fit.viewport, 1.0) / 1024.0
    };
    // The eye's own place is this crate's centre.
    let eye = space.x.dot(view.eye());
    assert_relative_eq!(across(2.332_9, eye), least, max_relative = 1e-4);
    assert_relative_eq!(across(2.5, -93.0), 46.541_32, max_relative = 1e-6);
}

/// On axes fixed by the light the finished map's rectangle is another one for each warp.
#[test]
fn fixed_axes_are_never_worse_than_none() {
    let view = look([dvec3(-38.0, 3.0, -11.0), dvec3(-4.0, 1.0, 5.0)], 1.0, 1.5, [1.0, 1000.0]);
    let light = Light::directional(dvec3(4.0, 4.0, -10.0)).unwrap();
    let case = Case::new(view, light, [dvec3(-50.0, 0.0, -50.0), dvec3(50.0, 1.0, 50.0)], 1024);
    let fit = case.on(Axes::LightFixed);
    assert_relative_eq!(worst(&fit, Rule::Uniform), 6.403_729, max_relative = 1e-6);
    assert_relative_eq!(worst(&fit, Rule::OPTIMAL), 6.403_729, max_relative = 1e-6);
    assert_relative_eq!(worst(&case.fit(), Rule::OPTIMAL), 7.367_796, max_relative = 1e-6);
}

/// A street, and a box of casters of a size.
fn street(size: f64) -> Case {
    let view = look([dvec3(0.0, 2.0, 0.0), dvec3(0.0, -0.1, 1.0)], 1.0, 1.5, [0.1, 1000.0]);
    let light = Light::directional(dvec3(0.3, 1.0, 0.2)).unwrap();
    let case = Case::new(view, light, [dvec3(-300.0, 0.0, -300.0), dvec3(300.0, 20.0, 1000.0)], 1024);
    Case { casters: Bounds::new(DVec3::splat(-size), DVec3::splat(size)).unwrap(), ..case }
}

#[test]
fn casters_without_end_leave_the_warp() {
    for size in [1e3, 1e5, 1e12, 1e18, 1e30, 1e100] {
        let case = street(size);
        for near_depth in [NearDepth::Casters, NearDepth::Receivers] {
            let fit = Fit { near_depth, ..case.fit() };
            assert_relative_eq!(worst(&fit, Rule::OPTIMAL), 143.364_531, max_relative = 1e-8);
            let map = fit.solve(Rule::OPTIMAL).unwrap();
            let depth = |p: DVec3| {
                let q = map.clip_from_world_at(map.origin(), ClipSpace::WGPU) * p.extend(1.0);
                q.z / q.w
            };
            for vertex in case.seen[0].vertices() {
                let q = *vertex + case.seen[0].origin() - map.origin();
                assert!((-1e-9..=1.0 + 1e-9).contains(&depth(q)), "{size} {near_depth:?}: {}", depth(q));
            }
        }
        let fit = Fit { near_depth: NearDepth::Receivers, ..case.fit() };
        assert_eq!(
            fit.solve(Rule::OPTIMAL),
            Fit { near_depth: NearDepth::Receivers, ..street(1e3).fit() }.solve(Rule::OPTIMAL)
        );
    }
}

/// Where `f64` does not know any more where casters cast, they do not count, and depth keeps its digits.
#[test]
fn casters_count_as_far_as_they_are_known() {
    let [far, farther] = [1e30, 1e100].map(|size| street(size).fit().solve(Rule::OPTIMAL).unwrap());
    assert_eq!(far, farther);
    // Along the light depth grows as the range has it: to 6 %, from the receivers to the last casters that count.
    let matrix = far.clip_from_world_at(far.origin(), ClipSpace::WGPU);
    let to_light = far.light_space().y;
    let step = -matrix.row(2).truncate().dot(to_light);
    let extent = (far.warp().ratio() - 1.0) / matrix.row(3).truncate().length();
    let range = extent * (1_u64 << 48) as f64 / far.warp().excess();
    assert!((0.9..1.1).contains(&(step * range)), "{}", step * range);
    // Without a warp all of them count.
    let plain = [1e18, 1e30].map(|size| street(size).fit().solve(Rule::Uniform).unwrap());
    let step = plain.map(|map| -map.clip_from_world_at(map.origin(), ClipSpace::WGPU).row(2).truncate().dot(to_light));
    assert_relative_eq!(step[0] / step[1], 1e12, max_relative = 1e-3);
}

/// A refusal does not advise what was asked for.
#[test]
fn a_lamp_in_the_picture_has_no_perspective_map() {
    let case = street(100.0);
    let lamp = Light::spot(dvec3(0.0, 3.0, 20.0), dvec3(0.0, -1.0, 0.1), 0.7, 0.1, 100.0).unwrap();
    let fit = Fit { light: &lamp, ..case.fit() };
    for (aim, advice) in [(Aim::Closest, "Rule::OPTIMAL"), (Aim::Centre, "Aim::Closest, or Rule::OPTIMAL")] {
        let refused = fit.solve(Rule::Perspective(PerspectiveRule { aim, shift: 0.0 }));
        let Err(Error::Unsupported { use_instead, .. }) = refused else { unreachable!("{refused:?}") };
        assert_eq!(use_instead, advice);
    }
    fit.solve(Rule::OPTIMAL).unwrap();
}

/// What takes the digits is named, and the way out that is named leads out.
#[test]
fn the_guard_names_the_cause() {
    let (deep, shallow) = (street(1e5), street(1e3));
    let refusal = |fit: &Fit, origin: DVec3| {
        let map = fit.solve(Rule::OPTIMAL).unwrap();
        let Err(Error::BeyondF32 { texels, cause }) = fit.guard_f32(&map, origin) else { return None };
        assert!(texels >= 1.0, "{texels}");
        Some(cause)
    };
    let (eye, away) = (deep.view.eye(), dvec3(1e7, 0.0, 0.0));
    let receivers = |case: &Case, origin| refusal(&Fit { near_depth: NearDepth::Receivers, ..case.fit() }, origin);

    assert!(refusal(&deep.fit(), eye).unwrap().starts_with("the casters' box is too deep"));
    assert_eq!(receivers(&deep, eye), None);
    assert!(refusal(&shallow.fit(), away).unwrap().starts_with("the origin is too far away: "));
    assert_eq!(refusal(&shallow.fit(), eye), None);
    assert!(
        refusal(&deep.fit(), away).unwrap().starts_with("the origin is too far away, and the casters' box too deep")
    );
    assert_eq!(receivers(&deep, eye), None);

    // Ground to a light at the horizon is next to nothing across the warp, but not about a point of it.
    let view = look([dvec3(0.0, 2.0, 0.0), DVec3::Z], 1.0, 1.5, [0.1, 1000.0]);
    let light = Light::directional(dvec3(0.3, 1e-7, 1.0)).unwrap();
    let flat = Case::new(view, light, [dvec3(-300.0, 0.0, -300.0), dvec3(300.0, 0.0, 1000.0)], 16384);
    assert!(receivers(&flat, eye).unwrap().starts_with("the origin is too far away: "));
    assert_eq!(receivers(&flat, flat.seen[0].origin()), None);

    // A map with more texels than f32 has numbers.
    let large = Fit { map_size: [1 << 24; 2], near_depth: NearDepth::Receivers, ..shallow.fit() };
    let refusal = |rule: Rule| {
        let Err(Error::BeyondF32 { cause, .. }) = large.guard_f32(&large.solve(rule).unwrap(), eye) else {
            return None;
        };
        Some(cause)
    };
    assert!(refusal(Rule::OPTIMAL).unwrap().starts_with("the warp is too strong, "));
    assert!(refusal(Rule::Uniform).unwrap().starts_with("the receivers are too thin, or the map too large"));
}

/// All that is seen is one point, which is the eye of an orthographic camera and the origin of the body.
#[test]
fn a_plane_through_one_point_has_a_finite_map() {
    let eye = dvec3(1.0, 2.0, 3.0);
    let view = View::orthographic(eye, DVec3::Z, DVec3::Y, Sides::centred(2.0, 2.0), -1.0..1.0).unwrap();
    let case = Case::new(view, Light::directional(DVec3::Y).unwrap(), [eye, eye], 1024);
    for normal in [dvec3(0.0, 1.0, 1.0), dvec3(1.0, 2.0, -1.0), DVec3::Y] {
        match case.fit().solve(Rule::Plane(Plane::new(normal, eye).unwrap())) {
            Ok(map) => {
                assert!(map.clip_from_world_at(eye, ClipSpace::WGPU).is_finite(), "{normal}: {map:?}");
                assert_abs_diff_eq!(place(&map, eye), DVec2::ZERO, epsilon = 1024.0);
            }
            Err(error) => assert!(matches!(error, Error::Unsupported { .. }), "{normal}: {error}"),
        }
    }
    case.fit().solve(Rule::Plane(Plane::new(dvec3(0.0, 1.0, 1.0), eye).unwrap())).unwrap();
}

/// A mirror shows what lies behind its plane: one plane more than box and view have.
#[test]
fn a_mirror_cuts_what_is_seen() {
    let case = street(100.0);
    let lamp = Light::spot(dvec3(10.0, 40.0, 60.0), dvec3(0.1, -1.0, 0.2), 0.7, 0.5, 500.0).unwrap();
    let mirror = Plane::new(dvec3(0.3, 0.1, -1.0), dvec3(0.0, 0.0, 40.0)).unwrap();
    let whole = [case.seen[0].widened()];
    let mut cut = whole;
    cut[0].cut(&mirror.relative_to(cut[0].origin())).unwrap();
    assert!(cut[0].volume() > 0.5 * whole[0].volume() && cut[0].volume() < 0.999_99 * whole[0].volume());
    for light in [case.light, lamp] {
        for rule in [Rule::Uniform, Rule::LISPSM, Rule::PSM, Rule::OPTIMAL] {
            let narrow = Fit { light: &light, ..case.fit() };
            let wide = |seen| Fit::new(&case.view, &light, &case.casters, seen);
            // The same body makes the same map.
            assert_eq!(wide(&whole).solve(rule), narrow.solve(rule), "{rule:?}");
            let fit = wide(&cut);
            let map = fit.solve(rule).unwrap();
            let lit: Vec<DVec3> = fit
                .lit_receivers()
                .flat_map(|lit| lit.vertices().iter().map(|v| *v + lit.origin()).collect::<Vec<_>>())
                .collect();
            let place = |p: &DVec3| {
                let q = map.clip_from_world_at(map.origin(), ClipSpace::WGPU) * (*p - map.origin()).extend(1.0);
                q.truncate() / q.w
            };
            let [low, high] =
                lit.iter().map(place).fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[a, b], p| [a.min(p), b.max(p)]);
            assert_abs_diff_eq!(low.truncate(), DVec2::NEG_ONE, epsilon = 1e-9);
            assert_abs_diff_eq!(high, DVec3::ONE, epsilon = 1e-9);
            assert!(lit.iter().all(|p| mirror.distance(*p) <= 1e-9));
            assert!(
                fit.worst_texel(&map) < fit.worst_texel(&fit.solve(Rule::Uniform).unwrap()) * (1.0 + 1e-9)
                    || rule == Rule::PSM
            );
        }
    }
}

/// The cone of a lamp that opens almost all round: what lies at its rim has places of up to 1e9, known to as many roundings.
#[test]
fn lamps_that_open_all_round_have_finite_maps() {
    let ahead = |eye| View::perspective(eye, DVec3::Z, DVec3::Y, 1.0, 1.5, 1.0..f64::INFINITY).unwrap();
    let at_eye = Light::spot(DVec3::ZERO, DVec3::Z, std::f64::consts::FRAC_PI_2 - 2.7e-8, 1e-5, 1e9).unwrap();
    let place = dvec3(1.7519740813189404, -1.76, 0.9841858404523249);
    let beside =
        Light::spot(place, dvec3(1.9997, 0.00041938, -1.0001), std::f64::consts::FRAC_PI_2 - 2.7e-8, 1.91e-5, 1e9)
            .unwrap();
    let low = dvec3(1.7519740813189404, -3.0, 0.9841858404523249);
    let cases = [
        (ahead(DVec3::ZERO), at_eye, [dvec3(0.0, -2.0, 0.0), dvec3(4.0, -1.0, 2.0)], dvec3(0.0, 0.0, 1e4)),
        (ahead(dvec3(1.75, -3.0, 1.0)), beside, [low, dvec3(low.x, -0.76, low.z)], dvec3(3.0, -3.0, -0.11)),
    ];
    for (view, light, [low, high], origin) in cases {
        let bounds = Bounds::new(low, high).unwrap();
        let seen = [Body::from_box(&bounds, origin).unwrap()];
        let fit = Fit { near_depth: NearDepth::Receivers, ..Fit::new(&view, &light, &bounds, &seen) };
        let strongest = Rule::Explicit(Warp::new(1e8).unwrap());
        let objectives =
            [Objective::Along, Objective::Across, Objective::Larger, Objective::Product].map(Rule::Optimal);
        for rule in objectives.into_iter().chain([strongest, Rule::TSM, Rule::OnAxis, Rule::Uniform]) {
            let map = fit.solve(rule).unwrap();
            let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
            assert!(matrix.is_finite() && fit.worst_texel(&map).is_finite(), "{rule:?}: {map:?}");
        }
    }
}

/// Right before, and to stay so.
#[test]
fn a_low_sun_gains_little() {
    let view = look([dvec3(60.0, 12.0, 60.0), dvec3(-1.0, -0.2, -1.0)], 50_f64.to_radians(), 16.0 / 9.0, [0.1, 2000.0]);
    let light = Light::directional(dvec3(0.799_512_661_615_276_7, 0.034_899_496_702_500_97, 0.599_634_496_211_457_5));
    let case = Case::new(view, light.unwrap(), [dvec3(-200.0, 0.0, -200.0), dvec3(200.0, 9.0, 200.0)], 2048);
    assert_relative_eq!(worst(&case.fit(), Rule::Uniform), 30.510_943, max_relative = 1e-7);
    assert_relative_eq!(worst(&case.fit(), Rule::OPTIMAL), 29.977_911, max_relative = 1e-7);
}
