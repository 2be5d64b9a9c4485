//! A scene, and what several tests measure on the maps that are fitted to it.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]

use std::fmt;

use shadow_warp::glam::{DVec3, DVec4};
use shadow_warp::{
    Axes, Body, Bounds, ClipSpace, Fit, Light, LightSpaceRule, LitBody, NearDepth, ShadowMap, Spot, View,
};

/// Everything that a fit borrows.
#[derive(Clone)]
pub(crate) struct Scene {
    pub(crate) view: View,
    pub(crate) light: Light,
    pub(crate) boxes: Vec<Bounds>,
    pub(crate) casters: Bounds,
    pub(crate) bodies: Vec<Body>,
    pub(crate) axes: Axes,
    pub(crate) near_depth: NearDepth,
    pub(crate) map_size: [u32; 2],
}

/// Without the bodies, which follow from the rest.
impl fmt::Debug for Scene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { view, light, boxes, casters, bodies: _, axes, near_depth, map_size } = self;
        let (eye, depth) = (view.eye(), view.near()..view.far());
        write!(f, "eye {eye} forward {} up {} {:?} {depth:?}, ", view.forward(), view.up(), view.lens())?;
        write!(f, "{light:?}, boxes {boxes:?}, casters {casters:?}, {axes:?} {near_depth:?} {map_size:?}")
    }
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
            map_size: [1024, 1024],
        }
    }

    pub(crate) fn fit(&self) -> Fit<'_> {
        Fit {
            axes: self.axes,
            near_depth: self.near_depth,
            map_size: self.map_size,
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

    /// Whether a flat receiver turns no area to the light, so that nothing counts as its caster.
    pub(crate) fn is_edge_on(&self) -> bool {
        let normals = self.boxes.iter().map(|b| (b.max() - b.min()).cmple(DVec3::ZERO));
        normals.into_iter().any(|flat| flat.any() && DVec3::select(flat, self.to_light(), DVec3::ZERO).length() < 1e-3)
    }

    pub(crate) fn is_visible(&self) -> bool {
        self.bodies.iter().any(|body| !body.is_empty())
    }
}

pub(crate) const LIGHT_SPACE_RULES: [LightSpaceRule; 4] =
    [LightSpaceRule::Extent, LightSpaceRule::Damped, LightSpaceRule::ViewDepth, LightSpaceRule::Depth];

/// Normalised device coordinates of a point relative to the map's origin; depth from 0 at the
/// light's side.
pub(crate) fn ndc(map: &ShadowMap, point: DVec3) -> DVec3 {
    project(map.clip_from_world_at(map.origin(), ClipSpace::WGPU) * point.extend(1.0))
}

/// How far the rounding of a vertex, and of its product with the matrix, moves it in normalised
/// device coordinates. It counts where a body is thin against its distance from the origin.
pub(crate) fn product_rounding(map: &ShadowMap, point: DVec3) -> f64 {
    let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
    let p = point.extend(1.0);
    let size = |row: usize| matrix.row(row).truncate().length() * point.length() + matrix.row(row).w.abs();
    8.0 * f64::EPSILON * size(0).max(size(1)).max(size(2) + size(3)) / matrix.row(3).dot(p)
}

pub(crate) fn project(clip: DVec4) -> DVec3 {
    clip.truncate() / clip.w
}

/// The least and greatest value.
pub(crate) fn extent(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    values.into_iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

/// The sizes of the points' extents along the axes of light space, across, towards the light and
/// along.
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

pub(crate) fn spot(light: &Light) -> &Spot {
    match light {
        Light::Spot(spot) => spot,
        _ => unreachable!("a lamp is a spot light"),
    }
}

/// The vertices of what the light shines on, relative to a point: the receivers as they are, under
/// a light at infinity.
pub(crate) fn lit(scene: &Scene, origin: DVec3) -> Vec<DVec3> {
    let relative = |body: LitBody| {
        let shift = body.origin() - origin;
        body.vertices().iter().map(move |v| *v + shift).collect::<Vec<_>>()
    };
    scene.fit().lit_receivers().flat_map(relative).collect()
}

/// How much the rounding of a world position changes the aliasing there, relative: through `w^2`,
/// and through the depth.
pub(crate) fn world_rounding(map: &ShadowMap, scene: &Scene, p: DVec3) -> f64 {
    let size = (p.abs() + map.origin().abs() + scene.view.eye().abs()).element_sum();
    let row = map.clip_from_world_at(map.origin(), ClipSpace::WGPU).row(3);
    let depth = scene.view.forward().dot(p - scene.view.eye()).max(scene.view.near());
    let w = row.truncate().length() / map.w(p);
    2.0 * f64::EPSILON * size * (2.0 * w + if scene.view.is_perspective() { 1.0 / depth } else { 0.0 })
}

/// The vertices of what the light shines on between two depths, relative to the eye, by the edges
/// of the bodies.
pub(crate) fn lit_between(scene: &Scene, [low, high]: [f64; 2]) -> Vec<DVec3> {
    let (eye, forward) = (scene.view.eye(), scene.view.forward());
    let mut all = Vec::new();
    for body in scene.fit().lit_receivers() {
        let points: Vec<_> = body.vertices().iter().map(|q| *q + (body.origin() - eye)).collect();
        // Every pair: those that are no edge add nothing new.
        for (i, a) in points.iter().enumerate() {
            for b in &points[..=i] {
                let [z_a, z_b] = [*a, *b].map(|q| forward.dot(q));
                let along = [(low - z_a) / (z_b - z_a), (high - z_a) / (z_b - z_a)];
                all.extend(along.into_iter().filter(|s| (0.0..=1.0).contains(s)).map(|s| a.lerp(*b, s)));
                all.extend([*a, *b].into_iter().filter(|q| (low..=high).contains(&forward.dot(*q))));
            }
        }
    }
    all
}

/// What rounding allows at a point relative to the map's origin: of its product with the matrix,
/// and of a lamp's place, which counts where the lamp is far from a small part that it shines on.
pub(crate) fn rounding(scene: &Scene, map: &ShadowMap, q: DVec3) -> f64 {
    let matrix = map.clip_from_world_at(map.origin(), ClipSpace::WGPU);
    let light = scene.light.homogeneous();
    let distance = if light.w == 0.0 { 0.0 } else { (light.truncate() - map.origin()).length() };
    let steep = [0, 1, 2, 3].map(|row| matrix.row(row).truncate().length()).into_iter().fold(0.0, f64::max);
    product_rounding(map, q) + 8.0 * f64::EPSILON * steep * distance / matrix.row(3).dot(q.extend(1.0))
}
