//! The rows of the table: every technique, fitted and measured.

use std::hint::black_box;
use std::time::Instant;

use anyhow::{Result, anyhow};
use serde::Serialize;
use shadow_warp::glam::{DVec2, DVec3, DVec4};
use shadow_warp::{Body, ClipSpace, Error, Fit, ShadowMap, aliasing};

use scenes::{Job, Scene, TECHNIQUES, Technique};

/// Everything that is reported about a scene.
#[derive(Serialize)]
pub(crate) struct Report {
    pub(crate) name: String,
    /// Why there are no techniques.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) reason: Option<String>,
    pub(crate) techniques: Vec<Row>,
    pub(crate) body: Bodies,
    pub(crate) view: Frame,
    pub(crate) light: Towards,
    /// What the mean is taken over, and how.
    pub(crate) mean_over: &'static str,
    pub(crate) notes: Vec<String>,
    pub(crate) scene: Scene,
}

/// One technique. Matrices are row-major, for [`ClipSpace::WGPU`].
#[derive(Serialize)]
pub(crate) struct Row {
    pub(crate) name: &'static str,
    #[serde(skip)]
    pub(crate) what: &'static str,
    pub(crate) eta: f64,
    pub(crate) warp_ratio: f64,
    pub(crate) clip_from_world: [f64; 16],
    clip_from_eye: [f64; 16],
    clip_from_body: [f64; 16],
    body_origin: [f64; 3],
    pub(crate) worst_pixels_per_texel: f64,
    pub(crate) mean_pixels_per_texel: f64,
    pub(crate) map_share: f64,
    pub(crate) setup_ns: f64,
    pub(crate) f32_texels: Rounding,
    light_space: LightAxes,
    #[serde(skip)]
    pub(crate) map: ShadowMap,
}

/// The largest displacement of a receiver vertex by rounding to `f32`, in texels, and the proven bounds.
#[derive(Serialize)]
pub(crate) struct Rounding {
    pub(crate) eye: f64,
    pub(crate) eye_bound: f64,
    pub(crate) world: f64,
    pub(crate) world_bound: f64,
}

#[derive(Serialize)]
pub(crate) struct LightAxes {
    x: [f64; 3],
    y: [f64; 3],
    z: [f64; 3],
    sin_gamma: f64,
}

/// Vertices in world space, and as the library keeps them: about an origin near by, with all their digits.
#[derive(Serialize)]
pub(crate) struct Bodies {
    pub(crate) receiver_vertices: Vec<[f64; 3]>,
    caster_vertices: Vec<[f64; 3]>,
    origin: [f64; 3],
    receiver_vertices_from_origin: Vec<[f64; 3]>,
    caster_vertices_from_origin: Vec<[f64; 3]>,
    #[serde(skip)]
    pub(crate) receivers: Body,
}

/// The camera as the library keeps it.
#[derive(Serialize)]
pub(crate) struct Frame {
    eye: [f64; 3],
    right: [f64; 3],
    up: [f64; 3],
    forward: [f64; 3],
    near: f64,
    /// Null where infinite.
    far: f64,
}

#[derive(Serialize)]
pub(crate) struct Towards {
    pub(crate) to_light: [f64; 3],
}

pub(crate) fn report(name: &str, scene: Scene, notes: Vec<String>, job: &Job) -> Result<Report> {
    let receivers = [job.seen()];
    let fit = job.fit(&receivers);
    let [body] = receivers;
    let mut techniques = Vec::with_capacity(TECHNIQUES.len());
    let mut reason = None;
    for technique in TECHNIQUES {
        match technique.solve(fit) {
            Ok(map) => techniques.push(row(technique, job, &fit, &body, map)),
            Err(error @ Error::NothingVisible) => reason = Some(error.to_string()),
            Err(error) => return Err(anyhow!("{}: {error}", technique.name)),
        }
    }
    let casters = body.casters(&job.light, &job.casters)?;
    let in_world = |vertices: &[DVec3], origin: DVec3| vertices.iter().map(|v| (*v + origin).to_array()).collect();
    let view = &job.view;
    Ok(Report {
        name: name.to_owned(),
        reason,
        techniques,
        body: Bodies {
            receiver_vertices: in_world(body.vertices(), body.origin()),
            caster_vertices: in_world(casters.vertices(), casters.origin()),
            origin: body.origin().to_array(),
            receiver_vertices_from_origin: in_world(body.vertices(), DVec3::ZERO),
            caster_vertices_from_origin: in_world(casters.vertices(), DVec3::ZERO),
            receivers: body,
        },
        view: Frame {
            eye: view.eye().to_array(),
            right: view.right().to_array(),
            up: view.up().to_array(),
            forward: view.forward().to_array(),
            near: view.near(),
            far: view.far(),
        },
        light: Towards { to_light: job.light.homogeneous().truncate().to_array() },
        mean_over: Quadrature::of(&body).what(),
        notes,
        scene,
    })
}

fn row(technique: &Technique, job: &Job, fit: &Fit, body: &Body, map: ShadowMap) -> Row {
    let eye = job.view.eye();
    let matrix = |origin: DVec3| map.clip_from_world_at(origin, ClipSpace::WGPU).transpose().to_cols_array();
    let bound = |origin: DVec3| fit.rounding(&map, origin).truncate().max_element();
    let per_texel = |q: DVec3| aliasing::pixels_per_texel(&map, &job.view, job.viewport, q + body.origin());
    let space = map.light_space();
    Row {
        name: technique.name,
        what: technique.what,
        eta: map.warp().excess(),
        warp_ratio: map.warp().ratio(),
        clip_from_world: matrix(DVec3::ZERO),
        clip_from_eye: matrix(eye),
        clip_from_body: matrix(map.origin()),
        body_origin: map.origin().to_array(),
        worst_pixels_per_texel: fit.worst_texel(&map),
        mean_pixels_per_texel: Quadrature::of(body).mean(per_texel),
        map_share: map_share(&map, body),
        setup_ns: setup_ns(technique, job),
        f32_texels: Rounding {
            eye: displacement(&map, body, eye),
            eye_bound: bound(eye),
            world: displacement(&map, body, DVec3::ZERO),
            world_bound: bound(DVec3::ZERO),
        },
        light_space: LightAxes {
            x: space.x.to_array(),
            y: space.y.to_array(),
            z: space.z.to_array(),
            sin_gamma: space.sin_gamma,
        },
        map,
    }
}

/// Returns the share of the map that the receivers cover. Seen from the light a convex body covers each point with
/// two of its faces, so its picture is half as large as those of all faces together.
fn map_share(map: &ShadowMap, body: &Body) -> f64 {
    let clip = map.clip_from_world_at(body.origin(), ClipSpace::WGPU);
    let project = |q: DVec3| clip.project_point3(q).truncate();
    let area = |[a, b, c]: [DVec2; 3]| 0.5 * (b - a).perp_dot(c - a).abs();
    let faces: f64 = body.faces().flat_map(|face| face.triangles()).map(|t| area(t.map(project))).sum();
    0.5 * faces / 4.0
}

/// Returns how far the vertices move in the map, in texels, with matrix, positions and products in `f32`.
fn displacement(map: &ShadowMap, body: &Body, origin: DVec3) -> f64 {
    let half_size = DVec2::from(map.size().map(f64::from)) * 0.5;
    let exact = map.clip_from_world_at(body.origin(), ClipSpace::WGPU);
    let rounded = map.clip_from_world_at(origin, ClipSpace::WGPU).as_mat4();
    let ndc = |clip: DVec4| clip.truncate().truncate() / clip.w;
    let moved = body.vertices().iter().map(|&q| {
        let p = (q + (body.origin() - origin)).as_vec3();
        let displaced = ndc((rounded * p.extend(1.0)).as_dvec4()) - ndc(exact * q.extend(1.0));
        (displaced * half_size).abs().max_element()
    });
    // `f64::max` would drop a NaN, which means that `f32` cannot hold the scene.
    moved.fold(0.0, |worst, x| if x <= worst { worst } else { x })
}

const BATCHES: u32 = 301;
const RUNS_PER_BATCH: u32 = 16;

/// Returns the time from a view to a fitted map, in nanoseconds: the mean of the fastest batch, which was
/// disturbed least.
fn setup_ns(technique: &Technique, job: &Job) -> f64 {
    let batches = (0..BATCHES).map(|_| {
        let start = Instant::now();
        for _ in 0..RUNS_PER_BATCH {
            let receivers = [Body::visible(black_box(&job.view), black_box(&job.receivers))];
            let fit = technique.fit(job.fit(&receivers));
            let _ = black_box(fit.solve(black_box(technique.rule)));
        }
        start.elapsed().as_nanos() as f64 / f64::from(RUNS_PER_BATCH)
    });
    batches.fold(f64::INFINITY, f64::min)
}

/// Pieces of a body to average over, each with its share: tetrahedra of a solid one, triangles of a flat one.
enum Quadrature {
    Volume(Vec<(f64, [DVec3; 4])>),
    Area(Vec<(f64, [DVec3; 3])>),
    Vertices(Vec<DVec3>),
}

/// Each halves the edges.
const SUBDIVISIONS: u32 = 3;
/// A body is flat where its thickness is less than this much of its width.
const FLAT: f64 = 1e-6;

impl Quadrature {
    fn of(body: &Body) -> Self {
        let vertices = body.vertices();
        let inner = vertices.iter().sum::<DVec3>() / vertices.len().max(1) as f64;
        let size = vertices.iter().map(|&q| (q - inner).abs().max_element()).fold(0.0, f64::max);
        // Relative to the body's size, so that products neither overflow nor vanish.
        let unit = |q: DVec3| (q - inner) / size;
        let area = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).length();
        let volume = |[a, b, c]: [DVec3; 3]| a.dot(b.cross(c)).abs() / 6.0;
        let triangles: Vec<[DVec3; 3]> = body.faces().flat_map(|face| face.triangles()).collect();
        let all_area: f64 = triangles.iter().map(|t| area(t.map(unit))).sum();
        let all_volume: f64 = triangles.iter().map(|t| volume(t.map(unit))).sum();
        // The area has both sides of a flat body.
        if 2.0 * all_volume > FLAT * all_area * all_area.sqrt() {
            let piece = |t: [DVec3; 3]| (volume(t.map(unit)) / all_volume, [t[0], t[1], t[2], inner]);
            Self::Volume(triangles.into_iter().map(piece).collect())
        } else if all_area > 0.0 {
            Self::Area(triangles.into_iter().map(|t| (area(t.map(unit)) / all_area, t)).collect())
        } else {
            Self::Vertices(vertices.to_vec())
        }
    }

    fn what(&self) -> &'static str {
        match self {
            Self::Volume(_) => {
                "the body's volume: tetrahedra from its faces to an inner point, each cut into 512, with 4 points in each"
            }
            Self::Area(_) => {
                "the flat body's area: the triangles of its faces, each cut into 64, with 3 points in each"
            }
            Self::Vertices(_) => "the vertices: the body is a line or a point",
        }
    }

    fn mean(&self, f: impl Fn(DVec3) -> f64) -> f64 {
        match self {
            Self::Volume(pieces) => pieces.iter().map(|(share, p)| share * mean_in_solid(*p, SUBDIVISIONS, &f)).sum(),
            Self::Area(pieces) => pieces.iter().map(|(share, p)| share * mean_in_flat(*p, SUBDIVISIONS, &f)).sum(),
            Self::Vertices(points) => points.iter().map(|&p| f(p)).sum::<f64>() / points.len() as f64,
        }
    }
}

/// The mean over a tetrahedron, by the four points that are exact for polynomials of degree 2.
fn mean_in_solid(p: [DVec3; 4], subdivisions: u32, f: &impl Fn(DVec3) -> f64) -> f64 {
    if subdivisions == 0 {
        // (5 - sqrt 5)/20: the points lie this far from three faces.
        let near = 0.138_196_601_125_010_52;
        let sum = p.iter().sum::<DVec3>();
        return p.map(|corner| f(sum * near + corner * (1.0 - 4.0 * near))).iter().sum::<f64>() / 4.0;
    }
    // Eight of equal volume: one at each corner, and the octahedron between them cut along a diagonal.
    let [a, b, c, d] = p;
    let [ab, ac, ad] = [b, c, d].map(|q| 0.5 * (a + q));
    let [bc, bd, cd] = [0.5 * (b + c), 0.5 * (b + d), 0.5 * (c + d)];
    let corners = [[a, ab, ac, ad], [ab, b, bc, bd], [ac, bc, c, cd], [ad, bd, cd, d]];
    let middle = [[ac, bd, ab, bc], [ac, bd, bc, cd], [ac, bd, cd, ad], [ac, bd, ad, ab]];
    let children = corners.into_iter().chain(middle);
    children.map(|child| mean_in_solid(child, subdivisions - 1, f)).sum::<f64>() / 8.0
}

/// The mean over a triangle, by the middles of its edges, exact for polynomials of degree 2.
fn mean_in_flat([a, b, c]: [DVec3; 3], subdivisions: u32, f: &impl Fn(DVec3) -> f64) -> f64 {
    let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
    if subdivisions == 0 {
        return (f(ab) + f(bc) + f(ca)) / 3.0;
    }
    let children = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
    children.map(|child| mean_in_flat(child, subdivisions - 1, f)).iter().sum::<f64>() / 4.0
}
