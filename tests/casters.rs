//! What can shadow a body, against its definition: the points of the casters' box from which going away from the light
//! meets the body. And the depth of the caster closest to the light, which the fit finds without that body.
//!
//! `SHADOW_WARP_CASES=100 cargo test --release --test casters` runs 100 times as many cases.
#![expect(clippy::unwrap_used, reason = "a generator that makes invalid input must stop the test")]

mod generate;
mod oracle;

use std::collections::HashMap;

use generate::{Class, Rng, camera_and_box, cases};
use oracle::{EPS, HalfSpaces, assert_closed};
use shadow_warp::glam::DVec3;
use shadow_warp::{Body, Bounds, CasterBody, ClipSpace, Error, Fit, Light, Rule, View, Warp};

/// Where the casters' box lies, seen from the receivers'.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Place {
    Around,
    Same,
    Inside,
    Partly,
    Above,
    Below,
    Beside,
    Flat,
}

const PLACES: [Place; 8] =
    [Place::Around, Place::Same, Place::Inside, Place::Partly, Place::Above, Place::Below, Place::Beside, Place::Flat];

/// Where the light is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Sun {
    AlongAxis,
    NearAxis,
    Diagonal,
    InPlane,
    AlongView,
    Anywhere,
}

const SUNS: [Sun; 6] = [Sun::AlongAxis, Sun::NearAxis, Sun::Diagonal, Sun::InPlane, Sun::AlongView, Sun::Anywhere];

fn to_light(rng: &mut Rng, sun: Sun, view: &View) -> DVec3 {
    match sun {
        Sun::AlongAxis => rng.axis(),
        Sun::NearAxis => rng.axis() + rng.decades(-17..-9) * rng.direction(),
        Sun::Diagonal => DVec3::new(rng.sign(), rng.sign(), rng.sign()),
        Sun::InPlane => {
            let mut l = rng.direction();
            l[rng.below(3)] = 0.0;
            l
        }
        Sun::AlongView => view.forward() * rng.sign(),
        Sun::Anywhere => rng.direction(),
    }
}

fn casters_box(rng: &mut Rng, place: Place, receivers: &Bounds, to_light: DVec3) -> Bounds {
    let (low, high) = (receivers.min(), receivers.max());
    let extent = high - low;
    let size = extent.max_element().max(1e-6);
    let moved = |by: DVec3| (low + by, high + by);
    // Beyond the box along the axis that the light is nearest to.
    let axis = (0..3).fold(0, |a, b| if to_light[b].abs() > to_light[a].abs() { b } else { a });
    let step = (extent[axis] + rng.range(0.01..1.0) * size) * to_light[axis].signum();
    let up = DVec3::AXES[axis] * step;
    let (low, high) = match place {
        Place::Around => {
            let more = rng.within(DVec3::ZERO, DVec3::ONE) * size;
            (low - more, high + more)
        }
        Place::Same => (low, high),
        Place::Inside => {
            let (a, b) = (rng.within(low, high), rng.within(low, high));
            (a.min(b), a.max(b))
        }
        Place::Partly => moved(0.7 * size * rng.direction()),
        Place::Above => moved(up),
        Place::Below => moved(-up),
        Place::Beside => {
            let side = (axis + 1) % 3;
            moved(DVec3::AXES[side] * (rng.sign() * (extent[side] + 0.02 * size)))
        }
        Place::Flat => {
            let mut top = high + up * rng.range(0.0..1.0);
            let mut bottom = low + up * rng.range(0.0..1.0);
            top[axis] = bottom[axis].max(top[axis]);
            bottom[axis] = top[axis];
            (bottom.min(top), bottom.max(top))
        }
    };
    Bounds::new(low, high).unwrap()
}

struct Job {
    class: Class,
    place: Place,
    sun: Sun,
    view: View,
    casters: Bounds,
    light: Light,
    to_light: DVec3,
    body: Body,
    /// The receivers' body, for the oracle, about `body.origin()`.
    receivers: HalfSpaces,
}

/// Every class of cameras with every place of the casters' box and every kind of light, `rounds` times.
fn jobs(rounds: usize, seed: u64) -> impl Iterator<Item = (Job, Rng)> {
    let kinds = Class::ALL.into_iter().flat_map(|c| PLACES.into_iter().flat_map(move |p| SUNS.map(|s| (c, p, s))));
    let all = kinds.flat_map(move |kind| (0..rounds).map(move |round| (kind, round)));
    all.enumerate().map(move |(i, ((class, place, sun), _))| {
        let mut rng = Rng::new(seed << 32 | i as u64);
        let (view, bounds) = camera_and_box(&mut rng, class);
        let direction = to_light(&mut rng, sun, &view);
        let light = Light::directional(direction).unwrap();
        let casters = casters_box(&mut rng, place, &bounds, direction);
        let body = Body::visible(&view, &bounds);
        let receivers = HalfSpaces::of_view(&view, &bounds, body.origin());
        let to_light = light.homogeneous().truncate();
        (Job { class, place, sun, view, casters, light, to_light, body, receivers }, rng)
    })
}

impl Job {
    /// The unit of absolute tolerances: the greatest coordinate in either box.
    fn size(&self) -> f64 {
        self.casters_box().size().max(self.receivers.size()).max(f64::MIN_POSITIVE)
    }

    fn casters_box(&self) -> HalfSpaces {
        HalfSpaces::of_box(&self.casters, self.body.origin())
    }

    /// Whether the receivers, seen along the light, are a line or a point.
    fn turns_no_area(&self) -> bool {
        let triangles = self.body.faces().flat_map(|face| face.triangles());
        let seen = triangles.map(|[a, b, c]| 0.25 * (b - a).cross(c - a).dot(self.to_light).abs()).sum::<f64>();
        seen <= 1e-9 * self.size() * self.size()
    }

    fn name(&self) -> String {
        format!("{:?} {:?} {:?}", self.class, self.place, self.sun)
    }
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

fn beyond_faces(body: &CasterBody, p: DVec3) -> f64 {
    body.faces().map(|face| face.plane().distance(p)).fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn casters_are_what_lies_between_the_receivers_and_the_light() {
    let (mut missed, mut surplus) = (0.0_f64, 0.0_f64);
    let mut by_place: HashMap<Place, [usize; 2]> = HashMap::new();
    let mut by_sun: HashMap<Sun, usize> = HashMap::new();
    let (mut rays, mut greatest) = (0, (0, 0));
    for (job, mut rng) in jobs(cases(5), 1) {
        let space = job.casters_box();
        let (size, name) = (job.size(), job.name());
        let casters = job.body.casters(&job.light, &job.casters).unwrap();
        assert_eq!(casters.origin(), job.body.origin());
        let deviation = assert_closed(&casters).greatest();
        assert!(deviation <= 8.0 * EPS * size, "{name}: not convex: {deviation:e} of {size:e}");
        greatest = greatest.max((casters.vertices().len(), casters.faces().count()));
        let seen = by_place.entry(job.place).or_default();
        seen[usize::from(casters.is_empty())] += 1;

        // Nothing too little: from the receivers towards the light, all that is in the casters' box.
        let points = job.body.vertices();
        for n in 0..if points.is_empty() { 0 } else { 40 } {
            let p = if n < points.len() { points[n] } else { rng.mixture(points) };
            let Some([first, last]) = in_box(&space, p, job.to_light) else { continue };
            for s in [first, last, rng.range(0.0..1.0) * (last - first) + first] {
                let caster = (p + job.to_light * s).clamp(space.low, space.high);
                let beyond = beyond_faces(&casters, caster) / size;
                // A ray that only grazes the box proves nothing of an empty body; nor do receivers that turn no area to
                // the light, whose sweep is flat or a line between planes that rounding may part.
                let grazes = casters.is_empty() && (last - first <= 1e-9 * size || job.turns_no_area());
                missed = missed.max(if grazes { f64::NEG_INFINITY } else { beyond });
                assert!(grazes || !casters.is_empty(), "{name}: a caster, but no body");
                assert!(grazes || beyond <= 1e-9, "{name}: a caster is not in the body: {beyond:e}");
                rays += 1;
            }
        }

        // Nothing too much: from the casters away from the light, a receiver.
        let points = casters.vertices();
        for n in 0..if points.is_empty() { 0 } else { points.len() + 10 } {
            let p = if n < points.len() { points[n] } else { rng.mixture(points) };
            assert!(space.beyond(p) <= 8.0 * EPS * size, "{name}: a caster outside the casters' box");
            let beyond = job.receivers.least_beyond_on_ray(p, -job.to_light) / size;
            surplus = surplus.max(beyond);
            assert!(beyond <= 1e-9, "{name}: {p} shadows nothing: {beyond:e}");
            *by_sun.entry(job.sun).or_default() += 1;
        }
    }
    println!("{rays} rays; missed {missed:e}, surplus {surplus:e}; {greatest:?}; {by_place:?}; {by_sun:?}");
    for place in PLACES {
        let [full, empty] = by_place[&place];
        let total = full + empty;
        match place {
            Place::Around | Place::Same => assert!(full > total * 3 / 4, "{place:?}: {full} of {total}"),
            Place::Below => assert!(empty > total / 2, "{place:?}: {empty} empty of {total}"),
            _ => assert!(full > total / 8, "{place:?}: {full} of {total}"),
        }
        // The rest only: what the camera does not see has no casters.
        assert!(empty > 0, "{place:?}: never empty");
    }
    for sun in SUNS {
        assert!(by_sun[&sun] > 5_000, "{sun:?}: {} points", by_sun[&sun]);
    }
    assert!(rays > 100_000 && greatest.0 >= 20);
}

/// Light that is overhead but for the rounding of its direction: the ray from a receiver at the side of the casters'
/// box leaves at once, the ray from one beside it at the top.
#[test]
fn light_overhead_but_for_rounding_reaches_the_top() {
    let unit = Bounds::new(DVec3::ZERO, DVec3::ONE).unwrap();
    let casters = Bounds::new(DVec3::ZERO, DVec3::new(1.0, 2.0, 1.0)).unwrap();
    let sides = shadow_warp::Sides::centred(4.0, 4.0);
    let rule = Rule::Explicit(Warp::new(1.0).unwrap());
    for case in 0..100 {
        let mut rng = Rng::new(3 << 32 | case);
        // Inside the box, so that its sides are not at whole numbers from the origin.
        let eye = rng.within(DVec3::splat(0.1), DVec3::splat(0.9));
        let view = View::orthographic(eye, DVec3::Z, DVec3::Y, sides, -2.0..2.0).unwrap();
        let bodies = [Body::visible(&view, &unit)];
        let sizes = [0.0, 6e-17, -6e-17, -1e-16, -2e-16, 1e-13];
        let light = Light::directional(DVec3::new(rng.pick(&sizes), 1.0, rng.pick(&sizes))).unwrap();
        let map = Fit::new(&view, &light, &casters, &bodies).solve(rule).unwrap();
        // Where the warp begins, the top is highest.
        let top = map.clip_from_world(ClipSpace::WGPU) * DVec3::new(0.5, 2.0, 0.0).extend(1.0);
        assert!(top.z.abs() < 1e-12, "{:e} for {:?}", top.z, light.homogeneous());
    }
}

/// The least depth of the casters and the receivers is 0: nothing is clipped, and no depth is given away.
#[test]
fn the_near_plane_touches_the_caster_closest_to_the_light() {
    let (mut worst, mut attained, mut widened, mut higher, mut vague) = (0.0_f64, 0, 0, 0, 0);
    let mut lines = 0;
    let mut by_place: HashMap<Place, usize> = HashMap::new();
    for (job, mut rng) in jobs(cases(5), 2) {
        let name = job.name();
        let casters = job.body.casters(&job.light, &job.casters).unwrap();
        let excess = rng.pick(&[0.0, 1e-6, 0.3, 1.0, 20.0, 1e3, 1e4]);
        let rule = if excess == 0.0 { Rule::Uniform } else { Rule::Explicit(Warp::new(excess).unwrap()) };
        let bodies = [job.body];
        let solved = Fit::new(&job.view, &job.light, &job.casters, &bodies).solve(rule);
        if job.body.is_empty() {
            assert_eq!(solved, Err(Error::NothingVisible), "{name}");
            continue;
        }
        let map = solved.unwrap();
        let clip = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
        assert!(clip.is_finite(), "{name}, eta {excess}: {clip:?}");
        let depth = |p: &DVec3| {
            let q = clip * p.extend(1.0);
            q.z / q.w
        };
        let receivers: Vec<f64> = job.body.vertices().iter().map(depth).collect();
        let mut above: Vec<f64> = casters.vertices().iter().map(depth).collect();
        // The last casters above receivers too: of a point or a line, rounding may cut that body short.
        let (space, points) = (job.casters_box(), job.body.vertices());
        for n in 0..points.len() + 10 {
            let p = if n < points.len() { points[n] } else { rng.mixture(points) };
            if let Some([_, last]) = in_box(&space, p, job.to_light) {
                above.push(depth(&(p + job.to_light * last).clamp(space.low, space.high)));
            }
        }
        let least = |depths: &[f64]| depths.iter().copied().fold(f64::INFINITY, f64::min);
        let nearest = least(&receivers).min(least(&above));
        let farthest = receivers.iter().copied().fold(f64::NEG_INFINITY, f64::max);

        // One unit of depth in world units, where w is 1: heights are known to a rounding of the greatest coordinate.
        let unit = -1.0 / clip.row(2).truncate().dot(job.to_light);
        // So is the place along the warp, of which w is this many per world unit.
        let slope = clip.row(3).truncate().length();
        let tolerance = 1e-12 * (1.0 + excess) + 16.0 * EPS * job.size() * (1.0 / unit + slope);
        if tolerance > 1e-6 {
            // A point or a line far off: nothing to measure depths by.
            vague += 1;
            continue;
        }
        worst = worst.max(-nearest / tolerance);
        assert!(nearest >= -tolerance, "{name}, eta {excess}: a caster at {nearest:e}, tolerance {tolerance:e}");
        assert!(farthest <= 1.0 + tolerance, "{name}, eta {excess}: a receiver at {farthest}");
        if nearest > tolerance && job.turns_no_area() {
            // The highest caster may be above any point of the line, and the casters' body is cut short: no witness.
            lines += 1;
        } else if farthest >= 1.0 - tolerance {
            worst = worst.max(nearest / tolerance);
            assert!(
                nearest <= tolerance,
                "{name}, eta {excess}: no caster before {nearest:e}, tolerance {tolerance:e}"
            );
            attained += 1;
            if least(&above) < least(&receivers) - 0.01 {
                higher += 1;
                *by_place.entry(job.place).or_default() += 1;
            }
        } else {
            // A flat body has been widened about its middle.
            assert!((nearest + farthest - 1.0).abs() <= tolerance, "{name}: {nearest:e} to {farthest:e}");
            let thickness = unit * (farthest - nearest);
            assert!(thickness <= 2e-6 * job.size(), "{name}: {thickness:e} of {:e} is not flat", job.size());
            widened += 1;
        }
    }
    println!(
        "worst {worst:.2} of the tolerance; {attained} attained, {widened} widened, {higher} above, {vague} vague, {lines} lines: {by_place:?}"
    );
    assert!(vague < attained / 10 && lines < attained / 10 && attained > 2_000 && widened > 20 && higher > 1_000);
    for place in [Place::Around, Place::Same, Place::Partly, Place::Above, Place::Flat] {
        assert!(by_place[&place] > 50, "{place:?}: {} cases with casters above", by_place[&place]);
    }
}
