//! Random scenes, near-degenerate on purpose, and what several tests measure on them.
#![allow(dead_code, reason = "every test file compiles this module and uses a part of it")]
#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]
#![expect(clippy::disallowed_methods, reason = "tests may call what the library must not")]

pub(crate) mod lamps;
pub(crate) mod random;
pub(crate) mod trapezoid;

use random::Random;
use shadow_warp::glam::{DVec3, DVec4};
use shadow_warp::{
    Axes, Body, Bounds, ClipSpace, Fit, Light, LightSpaceRule, NearDepth, Rule, ShadowMap, Sides, View, Warp,
};

/// Everything that a fit borrows.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    pub(crate) view: View,
    pub(crate) light: Light,
    pub(crate) boxes: Vec<Bounds>,
    pub(crate) casters: Bounds,
    pub(crate) bodies: Vec<Body>,
    pub(crate) axes: Axes,
    pub(crate) near_depth: NearDepth,
}

impl Scene {
    pub(crate) fn new(view: View, to_light: DVec3, boxes: &[Bounds], casters: Bounds) -> Self {
        Self {
            view,
            light: Light::directional(to_light).unwrap(),
            boxes: boxes.to_vec(),
            casters,
            bodies: boxes.iter().map(|b| Body::visible(&view, b)).collect(),
            axes: Axes::View,
            near_depth: NearDepth::Casters,
        }
    }

    pub(crate) fn fit(&self) -> Fit<'_> {
        Fit {
            axes: self.axes,
            near_depth: self.near_depth,
            ..Fit::new(&self.view, &self.light, &self.casters, &self.bodies)
        }
    }

    pub(crate) fn to_light(&self) -> DVec3 {
        self.light.homogeneous().truncate()
    }

    /// The receivers' vertices, relative to a point.
    pub(crate) fn receivers(&self, origin: DVec3) -> Vec<DVec3> {
        let relative = |body: &Body| {
            let shift = body.origin() - origin;
            body.vertices().iter().map(move |v| *v + shift).collect::<Vec<_>>()
        };
        self.bodies.iter().flat_map(relative).collect()
    }

    /// The vertices of all that can cast a shadow on the receivers, relative to a point.
    pub(crate) fn caster_points(&self, origin: DVec3) -> Vec<DVec3> {
        let relative = |body: &Body| {
            let casters = body.casters(&self.light, &self.casters).unwrap();
            let shift = casters.origin() - origin;
            casters.vertices().iter().map(|v| *v + shift).collect::<Vec<_>>()
        };
        self.bodies.iter().flat_map(relative).collect()
    }

    pub(crate) fn is_visible(&self) -> bool {
        self.bodies.iter().any(|body| !body.is_empty())
    }
}

/// The rules, each published form by itself, and an explicit warp.
pub(crate) fn rules(random: &mut Random) -> [Rule; 6] {
    [
        Rule::Uniform,
        Rule::LightSpace(LightSpaceRule::Extent),
        Rule::LightSpace(LightSpaceRule::Damped),
        Rule::LightSpace(LightSpaceRule::ViewDepth),
        Rule::LightSpace(LightSpaceRule::Depth),
        Rule::Explicit(Warp::new(random.log_between(1e-12, 1e8)).unwrap()),
    ]
}

pub(crate) const LIGHT_SPACE_RULES: [LightSpaceRule; 4] =
    [LightSpaceRule::Extent, LightSpaceRule::Damped, LightSpaceRule::ViewDepth, LightSpaceRule::Depth];

/// Normalised device coordinates of a point relative to the map's origin; depth from 0 at the light's side.
pub(crate) fn ndc(map: &ShadowMap, point: DVec3) -> DVec3 {
    project(map.clip_from_world_at(map.origin(), ClipSpace::WGPU) * point.extend(1.0))
}

/// How far the rounding of a vertex, and of its product with the matrix, moves it in normalised device coordinates. It
/// counts where a body is thin against its distance from the origin.
pub(crate) fn product_rounding(map: &ShadowMap, point: DVec3) -> f64 {
    let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
    let p = point.extend(1.0);
    let size = |row: usize| matrix.row(row).truncate().length() * point.length() + matrix.row(row).w.abs();
    64.0 * f64::EPSILON * size(0).max(size(1)).max(size(2) + size(3)) / matrix.row(3).dot(p)
}

pub(crate) fn project(clip: DVec4) -> DVec3 {
    clip.truncate() / clip.w
}

/// The least and greatest value.
pub(crate) fn extent(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    values.into_iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

/// The sizes of the points' extents along the axes of light space, across, towards the light and along.
pub(crate) fn sizes(points: &[DVec3], map: &ShadowMap) -> [f64; 3] {
    let space = map.light_space();
    [space.x, space.y, space.z].map(|axis| {
        let [low, high] = extent(points.iter().map(|p| axis.dot(*p)));
        high - low
    })
}

/// The box between two corners given in any order.
pub(crate) fn box_between(a: DVec3, b: DVec3) -> Bounds {
    Bounds::new(a.min(b), a.max(b)).unwrap()
}

pub(crate) fn box_about(centre: DVec3, half: DVec3) -> Bounds {
    Bounds::new(centre - half, centre + half).unwrap()
}

/// What a random light is to the view. Each kind must turn up in every run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Any,
    Across,
    NearParallel,
    NearOpposite,
    Parallel,
    Opposite,
    AlongUp,
}

pub(crate) const KINDS: [Kind; 7] =
    [Kind::Any, Kind::Across, Kind::NearParallel, Kind::NearOpposite, Kind::Parallel, Kind::Opposite, Kind::AlongUp];

/// A light of one kind; angles down to `least`.
pub(crate) fn light(random: &mut Random, view: &View, kind: Kind, least: f64) -> DVec3 {
    let (v, u) = (view.forward(), view.up());
    let turn = random.between(0.0, core::f64::consts::TAU);
    let across = u * turn.cos() + view.right() * turn.sin();
    let gamma = random.log_between(least, 1.0);
    match kind {
        Kind::Any => random.direction(),
        Kind::Across => across,
        Kind::NearParallel => v * gamma.cos() + across * gamma.sin(),
        Kind::NearOpposite => across * gamma.sin() - v * gamma.cos(),
        Kind::Parallel => v,
        Kind::Opposite => -v,
        Kind::AlongUp => u,
    }
}

/// A direction that normalising does not change, so that a light can lie exactly along it.
pub(crate) fn settled_direction(random: &mut Random) -> DVec3 {
    if random.below(4) == 0 {
        return [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z][random.below(6)];
    }
    loop {
        let light = |d: DVec3| Light::directional(d).unwrap().homogeneous().truncate();
        let once = light(random.direction());
        if light(once) == once {
            return once;
        }
    }
}

/// A perspective camera: a quarter of them off-centre.
pub(crate) fn view(random: &mut Random, world: f64, near: f64, far: f64, tangents: [f64; 2]) -> View {
    let forward = settled_direction(random);
    let up = loop {
        let up = if random.below(2) == 0 { DVec3::Y } else { random.direction() };
        if up.cross(forward).length() > 1e-3 {
            break up;
        }
    };
    let eye = random.inside(world);
    let size = random.log_between(tangents[0], tangents[1]);
    let mut sides = Sides::centred(2.0 * size, 2.0 * size * random.between(0.3, 1.0));
    if random.below(4) == 0 {
        let (x, y) = (size * random.between(-2.0, 2.0), size * random.between(-2.0, 2.0));
        sides = Sides { left: sides.left + x, right: sides.right + x, bottom: sides.bottom + y, top: sides.top + y };
    }
    View::perspective_off_centre(eye, forward, up, sides, near..far).unwrap()
}

/// A visible scene: world up to 1e3, far/near up to 1e7, angles between light and view down to 1e-9 and exactly 0 and
/// pi, one or two boxes, some of them flat, casters that hold the receivers or miss a part of them.
pub(crate) fn moderate(case: u64) -> (Scene, Kind) {
    let mut random = Random::new(case);
    let r = &mut random;
    loop {
        let near = r.log_between(1e-4, 10.0);
        let far = (near * r.log_between(1.5, 1e7)).min(1e3);
        let view = view(r, 1e3, near, far, [0.05, 3.0]);
        let kind = KINDS[r.below(KINDS.len())];
        let to_light = light(r, &view, kind, 1e-9);
        let count = 1 + r.below(4) / 3;
        let boxes: Vec<_> = (0..count).map(|_| receiver_box(r, &view)).collect();
        let casters = caster_box(r, &boxes);
        let mut scene = Scene::new(view, to_light, &boxes, casters);
        scene.axes = if r.below(3) == 0 { Axes::LightFixed } else { Axes::View };
        if scene.is_visible() {
            return (scene, kind);
        }
    }
}

fn receiver_box(r: &mut Random, view: &View) -> Bounds {
    if r.below(3) == 0 {
        return box_about(view.eye(), DVec3::splat(10.0 * view.far()));
    }
    let depth = r.log_between(view.near(), view.far());
    let half = depth * r.log_between(1e-2, 10.0) * DVec3::new(1.0, r.log_between(0.1, 1.0), r.log_between(0.1, 1.0));
    let flat = if r.below(6) == 0 { DVec3::new(1.0, 0.0, 1.0) } else { DVec3::ONE };
    box_about(view.eye() + view.forward() * depth, half * flat)
}

/// Mostly the receivers' bounds, grown; sometimes a box beside them.
fn caster_box(r: &mut Random, boxes: &[Bounds]) -> Bounds {
    let low = boxes.iter().fold(DVec3::MAX, |a, b| a.min(b.min()));
    let high = boxes.iter().fold(DVec3::MIN, |a, b| a.max(b.max()));
    let size = (high - low).max_element();
    let grown = box_between(low - size * r.unit(), high + size * r.unit());
    if r.below(4) > 0 {
        return grown;
    }
    box_about(0.5 * (low + high) + r.inside(size), DVec3::splat(size * r.between(0.05, 0.6)))
}
