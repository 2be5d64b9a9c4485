//! What can shadow a body, against its definition: the points of the casters' box from which going away from the light
//! meets the body. And the depth of the caster closest to the light, which the fit finds without that body.
#![expect(clippy::unwrap_used, reason = "what is there by construction and is not must stop the test")]

mod oracle;
mod random;

use std::collections::HashMap;

use oracle::{EPS, HalfSpaces, assert_closed};
use random::basic::{Mixture, mixture, unit, within};
use random::casters::{Place, Scene, Sun, scene};
use random::views::Class;
use random::{Ratchet, check, prop};
use shadow_warp::glam::DVec3;
use shadow_warp::{Body, Bounds, CasterBody, ClipSpace, ConvexBody, Error, Fit, Light, Rule, Sides, View, Warp};

/// A scene's light and bodies.
struct Job {
    scene: Scene,
    light: Light,
    to_light: DVec3,
    body: Body,
    /// The receivers' body, for the oracle, about `body.origin()`.
    receivers: HalfSpaces,
}

impl Job {
    fn of(scene: Scene) -> Self {
        let light = Light::directional(scene.to_light).unwrap();
        let body = Body::visible(&scene.view, &scene.receivers);
        let receivers = HalfSpaces::of_view(&scene.view, &scene.receivers, body.origin());
        Self { scene, light, to_light: light.homogeneous().truncate(), body, receivers }
    }

    /// The unit of absolute tolerances: the greatest coordinate in either box.
    fn size(&self) -> f64 {
        self.casters_box().size().max(self.receivers.size()).max(f64::MIN_POSITIVE)
    }

    fn casters_box(&self) -> HalfSpaces {
        HalfSpaces::of_box(&self.scene.casters, self.body.origin())
    }

    /// Of a flat body, the sine of the angle between it and the light: the less, the less is known of where a ray meets it.
    fn grazing(&self) -> f64 {
        if self.body.volume() > 1e-9 * self.receivers.size() * self.receivers.box_area() {
            return 1.0;
        }
        let areas = self.body.faces().map(|face| {
            face.triangles().map(|[a, b, c]| (b - a).cross(c - a)).sum::<DVec3>().dot(face.plane().normal())
        });
        let (_, normal) = areas.zip(self.body.faces()).fold((0.0, self.to_light), |(most, normal), (area, face)| {
            if area > most { (area, face.plane().normal()) } else { (most, normal) }
        });
        normal.dot(self.to_light).abs().max(1e-9)
    }

    /// Whether the receivers, seen along the light, are a line or a point.
    fn turns_no_area(&self) -> bool {
        let triangles = self.body.faces().flat_map(|face| face.triangles());
        let seen = triangles.map(|[a, b, c]| 0.25 * (b - a).cross(c - a).dot(self.to_light).abs()).sum::<f64>();
        seen <= 1e-9 * self.size() * self.size()
    }
}

/// Points of the hull of some points: these themselves, and mixtures.
fn hull<'a>(points: &'a [DVec3], mixtures: &'a [Mixture]) -> impl Iterator<Item = DVec3> + 'a {
    let mixed = mixtures.iter().filter(|_| !points.is_empty()).map(|mixture| mixture.of(points));
    points.iter().copied().chain(mixed)
}

/// More of the classes that ask most of the numbers.
fn cases_of(class: Class) -> u32 {
    if matches!(class, Class::FlatBox | Class::PlaneThroughVertex | Class::PlaneThroughEdge) { 800 } else { 200 }
}

/// The part of the ray from `p` that is in the box, as distances along it.
fn in_box(space: &HalfSpaces, p: DVec3, direction: DVec3) -> Option<[f64; 2]> {
    let (mut first, mut last) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let (low, high, d) = (space.low[axis] - p[axis], space.high[axis] - p[axis], direction[axis]);
        if d == 0.0 {
            if low > 0.0 || high < 0.0 {
                return None;
            }
        } else {
            first = first.max((low / d).min(high / d));
            last = last.min((low / d).max(high / d));
        }
    }
    (first <= last).then_some([first, last])
}

/// How badly three planes meet in a vertex at worst: the reciprocal of their determinant, up to a million.
fn ill_condition<const V: usize, const F: usize>(body: &ConvexBody<V, F>) -> f64 {
    let mut normals = vec![Vec::new(); body.vertices().len()];
    for face in body.faces() {
        face.corners().for_each(|corner| normals[corner].push(face.plane().normal()));
    }
    normals.iter().map(|n| 1.0 / n[0].cross(n[1]).dot(n[2]).abs().max(1e-6)).fold(1.0, f64::max)
}

fn beyond_faces(body: &CasterBody, p: DVec3) -> f64 {
    body.faces().map(|face| face.plane().distance(p)).fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn casters_are_what_lies_between_the_receivers_and_the_light() {
    let mut convexity = Ratchet::new("off a convex body, in roundings");
    let mut reflex = Ratchet::new("reflex corners, in roundings");
    let mut outside = Ratchet::new("casters outside their box, in roundings");
    let mut missed = Ratchet::new("casters that are not in the body");
    let mut surplus = Ratchet::new("what is in the body and shadows nothing");
    let mut by_place: HashMap<Place, [usize; 2]> = HashMap::new();
    let mut by_sun: HashMap<Sun, usize> = HashMap::new();
    let (mut cases, mut rays, mut greatest) = (0, 0, (0, 0));
    for class in Class::ALL {
        let input = (scene(class), prop::array::uniform12(mixture()), unit());
        check(&format!("casters/{class:?}"), cases_of(class), input, |(scene, mixtures, between)| {
            let job = Job::of(scene);
            let (space, size) = (job.casters_box(), job.size());
            let casters = job.body.casters(&job.light, &scene.casters).unwrap();
            assert_eq!(casters.origin(), job.body.origin());
            let closed = assert_closed(&casters);
            convexity.note(closed.off_plane.max(closed.beyond), 12.0 * EPS * size, class);
            // Where planes meet badly, a corner is not known along them.
            reflex.note(closed.reflex, 0.05 * EPS * size * ill_condition(&casters), class);
            greatest = greatest.max((casters.vertices().len(), casters.faces().count()));
            by_place.entry(scene.place).or_default()[usize::from(casters.is_empty())] += 1;
            cases += 1;

            // Nothing too little: from the receivers towards the light, all that is in the casters' box.
            for p in hull(job.body.vertices(), &mixtures) {
                let Some([first, last]) = in_box(&space, p, job.to_light) else { continue };
                // A ray that only grazes the box proves nothing of an empty body; nor do receivers that turn no area to
                // the light, whose sweep is flat or a line between planes that rounding may part.
                if casters.is_empty() && (last - first <= 1e-9 * size || job.turns_no_area()) {
                    continue;
                }
                for s in [first, last, first + between * (last - first)] {
                    let caster = (p + job.to_light * s).clamp(space.low, space.high);
                    assert!(!casters.is_empty(), "a caster, but no body");
                    missed.note(beyond_faces(&casters, caster), 4.0 * EPS * size, caster);
                    rays += 1;
                }
            }

            // Nothing too much: from the casters away from the light, a receiver.
            let allowed = 4.0 * EPS * size * ill_condition(&casters).max(ill_condition(&job.body));
            for p in hull(casters.vertices(), &mixtures) {
                outside.note(space.beyond(p), 8.0 * EPS * size, p);
                surplus.note(job.receivers.least_beyond_on_ray(p, -job.to_light), allowed, p);
                *by_sun.entry(scene.sun).or_default() += 1;
            }
        });
    }
    println!("{rays} rays; {greatest:?}; {by_place:?}; {by_sun:?}");
    for place in Place::ALL {
        let [full, empty] = by_place[&place];
        let total = full + empty;
        match place {
            Place::Around | Place::Same => assert!(3 * full > 2 * total, "{place:?}: {full} of {total}"),
            Place::Below => assert!(2 * empty > total, "{place:?}: {empty} empty of {total}"),
            _ => assert!(20 * full > total, "{place:?}: {full} of {total}"),
        }
        // The rest only: what the camera does not see has no casters.
        assert!(empty > 0, "{place:?}: never empty");
    }
    for sun in Sun::ALL {
        assert!(by_sun[&sun] > cases, "{sun:?}: {} points", by_sun[&sun]);
    }
    assert!(rays > 10 * cases && greatest.0 >= 20, "{rays} {greatest:?}");
}

/// Light that is overhead but for the rounding of its direction: the ray from a receiver at the side of the casters'
/// box leaves at once, the ray from one beside it at the top.
#[test]
fn light_overhead_but_for_rounding_reaches_the_top() {
    let unit = Bounds::new(DVec3::ZERO, DVec3::ONE).unwrap();
    let casters = Bounds::new(DVec3::ZERO, DVec3::new(1.0, 2.0, 1.0)).unwrap();
    let sides = Sides::centred(4.0, 4.0);
    let rule = Rule::Explicit(Warp::new(1.0).unwrap());
    let mut top = Ratchet::new("depth of the top");
    // Inside the box, so that its sides are not at whole numbers from the origin.
    let eye = within(DVec3::splat(0.1), DVec3::splat(0.9));
    let tilt = || prop::sample::select(vec![0.0, 6e-17, -6e-17, -1e-16, -2e-16, 1e-13]);
    check("casters/overhead", 200, (eye, tilt(), tilt()), |(eye, x, z)| {
        let view = View::orthographic(eye, DVec3::Z, DVec3::Y, sides, -2.0..2.0).unwrap();
        let bodies = [Body::visible(&view, &unit)];
        let light = Light::directional(DVec3::new(x, 1.0, z)).unwrap();
        let map = Fit::new(&view, &light, &casters, &bodies).solve(rule).unwrap();
        // Where the warp begins, the top is highest.
        let clip = map.clip_from_world(ClipSpace::WGPU) * DVec3::new(0.5, 2.0, 0.0).extend(1.0);
        top.note(clip.z.abs(), 2e-13, light);
    });
}

/// The least depth of the casters and the receivers is 0: nothing is clipped, and no depth is given away.
#[test]
fn the_near_plane_touches_the_caster_closest_to_the_light() {
    let mut near = Ratchet::new("near plane, in roundings");
    let mut far = Ratchet::new("far plane, in roundings");
    let mut thickness = Ratchet::new("thickness of what is widened");
    let (mut attained, mut widened, mut higher, mut vague, mut lines) = (0, 0, 0, 0, 0);
    let mut by_place: HashMap<Place, usize> = HashMap::new();
    let excesses = prop::sample::select(vec![0.0, 1e-6, 0.3, 1.0, 20.0, 1e3, 1e4]);
    for class in Class::ALL {
        let input = (scene(class), excesses.clone(), prop::array::uniform8(mixture()));
        check(&format!("near-plane/{class:?}"), cases_of(class), input, |(scene, excess, mixtures)| {
            let job = Job::of(scene);
            let casters = job.body.casters(&job.light, &scene.casters).unwrap();
            let rule = if excess > 0.0 { Rule::Explicit(Warp::new(excess).unwrap()) } else { Rule::Uniform };
            let bodies = [job.body];
            let solved = Fit::new(&scene.view, &job.light, &scene.casters, &bodies).solve(rule);
            if job.body.is_empty() {
                assert_eq!(solved, Err(Error::NothingVisible));
                return;
            }
            let map = solved.unwrap();
            let clip = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
            assert!(clip.is_finite(), "{clip:?}");
            let depth = |p: &DVec3| {
                let q = clip * p.extend(1.0);
                q.z / q.w
            };
            let receivers: Vec<f64> = job.body.vertices().iter().map(depth).collect();
            // Of receivers that turn no area to the light rounding makes the casters' body, too short or too long.
            let witnesses = if job.turns_no_area() { &[][..] } else { casters.vertices() };
            let mut above: Vec<f64> = witnesses.iter().map(depth).collect();
            // The last casters above receivers are casters whatever they are like.
            let space = job.casters_box();
            for p in hull(job.body.vertices(), &mixtures) {
                if let Some([_, last]) = in_box(&space, p, job.to_light) {
                    above.push(depth(&(p + job.to_light * last).clamp(space.low, space.high)));
                }
            }
            let least = |depths: &[f64]| depths.iter().copied().fold(f64::INFINITY, f64::min);
            let nearest = least(&receivers).min(least(&above));
            let farthest = receivers.iter().copied().fold(f64::NEG_INFINITY, f64::max);

            // One unit of depth in world units, where w is 1: heights are known to some roundings of the greatest
            // coordinate. So is the place along the warp, of which w is `slope` per world unit; what depth adds to a
            // height is in proportion to it.
            let unit = (1.0 / clip.row(2).truncate().dot(job.to_light)).abs();
            let slope = clip.row(3).truncate().length();
            let along = slope * job.size();
            let heights = (job.size() / unit * (1.0 + along) + along) / job.grazing();
            let tolerance = EPS * (512.0 * (1.0 + excess) + 80.0 * heights);
            if tolerance > 1e-6 {
                // A point or a line far off: nothing to measure depths by.
                vague += 1;
                return;
            }
            near.note(-nearest, tolerance, excess);
            far.note(farthest - 1.0, 0.125 * tolerance, excess);
            if nearest > tolerance && job.turns_no_area() {
                // The highest caster may be above any point of the line, and the casters' body is cut short: no
                // witness.
                lines += 1;
            } else if farthest >= 1.0 - tolerance {
                near.note(nearest, tolerance, excess);
                attained += 1;
                if least(&above) < least(&receivers) - 0.01 {
                    higher += 1;
                    *by_place.entry(scene.place).or_default() += 1;
                }
            } else {
                // A flat body has been widened about its middle: to 2^-20 of its extent, or 2^-50 of its distance.
                far.note((nearest + farthest - 1.0).abs(), 0.125 * tolerance, excess);
                let points = job.body.vertices();
                let diameter = points.iter().flat_map(|a| points.iter().map(|b| a.distance(*b))).fold(0.0, f64::max);
                let distance = job.size() + scene.view.eye().distance(job.body.origin());
                thickness.note(unit, diameter / f64::from(1 << 20) + 4.0 * EPS * distance, excess);
                widened += 1;
            }
        });
    }
    println!("{attained} attained, {widened} widened, {higher} above, {vague} vague, {lines} lines: {by_place:?}");
    assert!(5 * vague < attained && 10 * lines < attained && 3 * higher > attained && 200 * widened > attained);
    for place in [Place::Around, Place::Same, Place::Partly, Place::Above, Place::Flat] {
        assert!(50 * by_place[&place] > attained, "{place:?}: {} cases with casters above", by_place[&place]);
    }
}

/// Receivers on an edge of the casters' box, to which the light is parallel but for less than their rounding: found by the
/// test above. What rounding has in the casters' body must be in the map.
#[test]
fn casters_straight_above_an_edge_to_within_rounding() {
    let half = |x: f64, y: f64| Bounds::new(DVec3::new(-x, -y, -x), DVec3::new(x, y, x)).unwrap();
    let high = 16.689_657_621_065_546;
    let below = DVec3::new(200.0, -37.482_756_784_200_845, 200.0);
    let beside = Sides { left: -600.0, right: -400.0, bottom: -2.0 * high, top: 0.0 };
    let eye = DVec3::new(-200.0, high, -200.0);
    let touching = View::orthographic(eye, DVec3::Z, DVec3::Y, beside, -200.0..0.0).unwrap();
    let eye = DVec3::new(105.0, 663.342_726_713_691_3, 41.079_191_812_887_466);
    #[rustfmt::skip]
    let sides = Sides {
        left: 0.248_045_259_410_532_65, right: 0.548_045_259_410_532_6,
        bottom: -0.476_047_188_689_690_13, top: -0.176_047_188_689_690_14,
    };
    let looking_down = View::perspective_off_centre(eye, DVec3::NEG_Y, DVec3::X, sides, 1.0..f64::INFINITY).unwrap();
    let ground = half(200.0, 22.649_941_192_290_846);
    let scenes = [
        (touching, half(200.0, high), Bounds::new(below * DVec3::new(-1.0, 1.0, -1.0), below).unwrap(), 3.1e-16, 0.0),
        (looking_down, ground, ground, 8.575_147_179_800_435e-12, 3.354_858_245_931_076e-12),
    ];
    for (view, receivers, casters, x, z) in scenes {
        let light = Light::directional(DVec3::new(x, -1.0, z)).unwrap();
        let body = Body::visible(&view, &receivers);
        let above = body.casters(&light, &casters).unwrap();
        let bodies = [body];
        let map = Fit::new(&view, &light, &casters, &bodies).solve(Rule::Uniform).unwrap();
        let clip = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
        let least = above.vertices().iter().map(|p| (clip * p.extend(1.0)).z).fold(f64::INFINITY, f64::min);
        assert!(least > -1e-13 && least < 1.0, "{least:e} {light:?}");
    }
}
