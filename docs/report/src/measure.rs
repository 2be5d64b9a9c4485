//! The rows of the table: every technique, fitted and measured.

use std::hint::black_box;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use serde::Serialize;
use shadow_warp::glam::DVec3;
use shadow_warp::{Body, ClipSpace, ConvexBody, Error, Fit, Light, LightSpace, LitBody, Rule, ShadowMap, aliasing};

use crate::mean::Quadrature;
use crate::place::{displacement, map_share};
use scenes::{Job, Scene, TECHNIQUES, Technique};

/// Everything that is reported about a scene.
#[derive(Serialize)]
pub(crate) struct Report {
    pub(crate) name: String,
    /// Why there are no techniques.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) reason: Option<String>,
    pub(crate) techniques: Vec<Row>,
    pub(crate) refused: Vec<Refused>,
    body: Bodies,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) least_errors: Option<Least>,
    /// Of a point light: each has a map of its own.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) faces: Vec<Face>,
    pub(crate) view: Frame,
    pub(crate) light: Lit,
    /// What the mean is taken over, and how.
    pub(crate) mean_over: &'static str,
    pub(crate) notes: Vec<String>,
    pub(crate) scene: Scene,
}

/// A technique that has no map for the scene.
#[derive(Serialize)]
pub(crate) struct Refused {
    pub(crate) name: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) face: Option<&'static str>,
    pub(crate) reason: String,
}

/// A face of a point light.
#[derive(Serialize)]
pub(crate) struct Face {
    pub(crate) face: &'static str,
    /// Why it needs no map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) reason: Option<String>,
    body: Bodies,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) least_errors: Option<Least>,
}

/// What a warp can reach on the scene's axes, in pixels per texel.
#[derive(Clone, Copy, Serialize)]
pub(crate) struct Least {
    /// A lower bound along the warp, for maps on these axes with any spacing of texels.
    pub(crate) along: f64,
    /// The least across the warp over all ratios, with this centre. No bound: a map with another
    /// centre may have less.
    pub(crate) across: f64,
}

/// One technique. Matrices are row-major, for [`ClipSpace::WGPU`].
#[derive(Serialize)]
pub(crate) struct Row {
    pub(crate) name: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) face: Option<&'static str>,
    pub(crate) eta: f64,
    pub(crate) warp_ratio: f64,
    pub(crate) clip_from_world: [f64; 16],
    clip_from_eye: [f64; 16],
    clip_from_body: [f64; 16],
    body_origin: [f64; 3],
    pub(crate) worst_pixels_per_texel: f64,
    /// The worst over the larger of the two least errors, which are for this direction and centre
    /// of the warp: how much other ratios could gain. Only on the axes that these are for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) worst_over_least: Option<f64>,
    pub(crate) mean_pixels_per_texel: f64,
    pub(crate) map_share: f64,
    pub(crate) setup_ns: f64,
    pub(crate) f32_texels: Rounding,
    light_space: LightAxes,
    #[serde(skip)]
    pub(crate) technique: &'static Technique,
    /// The scene, under the light that the map is for.
    #[serde(skip)]
    pub(crate) job: Job,
    /// What is seen in the light, of each box of receivers; those of which nothing is are left out.
    #[serde(skip)]
    pub(crate) bodies: Vec<LitBody>,
    #[serde(skip)]
    pub(crate) map: ShadowMap,
}

/// The largest displacement of a receiver vertex by rounding to `f32`, in texels, and the proven
/// bounds.
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

/// Vertices in world space, and as the library keeps them: about an origin near by, with all their
/// digits. Those of several bodies one after the other.
#[derive(Serialize)]
struct Bodies {
    receiver_vertices: Vec<[f64; 3]>,
    caster_vertices: Vec<[f64; 3]>,
    /// Of each box of receivers, how many of the vertices are its body's.
    receiver_counts: Vec<usize>,
    caster_counts: Vec<usize>,
    origin: [f64; 3],
    receiver_vertices_from_origin: Vec<[f64; 3]>,
    caster_vertices_from_origin: Vec<[f64; 3]>,
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

/// The light as the library keeps it.
#[derive(Serialize)]
#[serde(untagged)]
pub(crate) enum Lit {
    Directional { to_light: [f64; 3] },
    Spot { position: [f64; 3], direction: [f64; 3], outer_deg: f64, near: f64, range: f64 },
    Point { position: [f64; 3], near: f64, range: f64 },
}

/// Sines up to this are nothing but rounding of directions that were normalised apart.
const PARALLEL: f64 = 8.0 * f64::EPSILON;

pub(crate) fn report(name: &str, scene: Scene, mut notes: Vec<String>, job: &Job) -> Result<Report> {
    let seen = job.seen();
    let parts = job.parts().iter().map(|job| Part::new(job, &seen)).collect::<Result<Vec<Part>>>()?;
    notes.extend(parts.iter().filter_map(|part| part.note.clone()));
    // One reason for all of them, where there is nothing at all.
    let reason = parts.iter().map(|part| part.reason.clone()).reduce(Option::and).flatten();
    let (mut techniques, mut refused, mut faces, mut whole) = (Vec::new(), Vec::new(), Vec::new(), None);
    for part in parts {
        techniques.extend(part.techniques);
        refused.extend(part.refused);
        match part.face {
            Some(face) => faces.push(Face { face, reason: part.reason, body: part.body, least_errors: part.least }),
            None => whole = Some((part.body, part.least)),
        }
    }
    // What is seen around a point light is cut by the range of no face; its casters are all that
    // there are.
    let (body, least_errors) = match whole {
        Some(whole) => whole,
        None => (Bodies::new(&seen, &[Body::from_box(&job.casters, job.casters.min())?]), None),
    };
    let mean_over = techniques.first().map_or(Quadrature::of(&seen), |row: &Row| Quadrature::of(&row.bodies)).what();
    let view = &job.view;
    Ok(Report {
        name: name.to_owned(),
        reason,
        techniques,
        refused,
        body,
        least_errors,
        faces,
        view: Frame {
            eye: view.eye().to_array(),
            right: view.right().to_array(),
            up: view.up().to_array(),
            forward: view.forward().to_array(),
            near: view.near(),
            far: view.far(),
        },
        light: Lit::new(&job.light)?,
        mean_over,
        notes,
        scene,
    })
}

/// What is reported of one light with one map: all of it, or one face of a point light.
struct Part {
    face: Option<&'static str>,
    reason: Option<String>,
    techniques: Vec<Row>,
    refused: Vec<Refused>,
    body: Bodies,
    least: Option<Least>,
    note: Option<String>,
}

impl Part {
    fn new(job: &Job, seen: &[Body]) -> Result<Self> {
        let (fit, face) = (job.fit(seen), job.face);
        let lit: Vec<LitBody> = fit.lit_receivers().collect();
        let plain = match fit.solve(Rule::Uniform) {
            Ok(map) => map,
            Err(error @ (Error::NothingVisible | Error::NothingLit)) => {
                let (reason, body) = (Some(error.to_string()), Bodies::new(&lit, &lit));
                let (techniques, refused) = (Vec::new(), Vec::new());
                return Ok(Self { face, reason, techniques, refused, body, least: None, note: None });
            }
            Err(error) => return Err(error).context("uniform"),
        };
        let body = match &job.light {
            Light::Directional(_) => {
                let casters = seen.iter().map(|body| body.casters(&job.light, &job.casters));
                Bodies::new(&lit, &casters.collect::<Result<Vec<_>, _>>()?)
            }
            _ => Bodies::new(&lit, &[plain.shown(&job.casters)]),
        };
        // Of all that is seen, as the worst is.
        let errors = Fit { warp_depths: None, ..fit }.least_errors()?;
        let least = Least { along: errors.along, across: errors.across };
        let (mut techniques, mut refused) = (Vec::new(), Vec::new());
        for technique in TECHNIQUES {
            match Row::new(technique, job, seen, &plain.light_space(), &least) {
                Ok(row) => techniques.push(row),
                Err(error @ Error::Unsupported { .. }) => {
                    refused.push(Refused { name: technique.name, face, reason: error.to_string() });
                }
                Err(error) => return Err(error).context(technique.name),
            }
        }
        let is_parallel = plain.light_space().sin_gamma <= PARALLEL;
        let of_face = face.map_or(String::new(), |face| format!(" (face {face})"));
        let note = is_parallel.then(|| {
            format!("Light and view are parallel{of_face}: the map's axes turn about the light here; Axes::LightFixed does not.")
        });
        Ok(Self { face, reason: None, techniques, refused, body, least: Some(least), note })
    }
}

impl Bodies {
    fn new<const V: usize, const F: usize, const U: usize, const G: usize>(
        receivers: &[ConvexBody<V, F>],
        casters: &[ConvexBody<U, G>],
    ) -> Self {
        let origin = receivers.iter().find(|body| !body.is_empty()).or(receivers.first());
        let origin = origin.map_or(DVec3::ZERO, ConvexBody::origin);
        Self {
            receiver_vertices: vertices(receivers, DVec3::ZERO),
            caster_vertices: vertices(casters, DVec3::ZERO),
            receiver_counts: receivers.iter().map(|body| body.vertices().len()).collect(),
            caster_counts: casters.iter().map(|body| body.vertices().len()).collect(),
            origin: origin.to_array(),
            receiver_vertices_from_origin: vertices(receivers, origin),
            caster_vertices_from_origin: vertices(casters, origin),
        }
    }
}

/// The vertices of bodies, one after the other, relative to a point.
fn vertices<const V: usize, const F: usize>(bodies: &[ConvexBody<V, F>], origin: DVec3) -> Vec<[f64; 3]> {
    let of_body = |body: &ConvexBody<V, F>| {
        let by = body.origin() - origin;
        body.vertices().iter().map(|v| (*v + by).to_array()).collect::<Vec<_>>()
    };
    bodies.iter().flat_map(of_body).collect()
}

impl Lit {
    fn new(light: &Light) -> Result<Self> {
        Ok(match light {
            Light::Directional(sun) => Self::Directional { to_light: sun.to_light().to_array() },
            Light::Spot(spot) => Self::Spot {
                position: spot.position().to_array(),
                direction: spot.direction().to_array(),
                outer_deg: spot.outer_angle().to_degrees(),
                near: spot.near(),
                range: spot.range(),
            },
            Light::Point(point) => {
                Self::Point { position: point.position().to_array(), near: point.near(), range: point.range() }
            }
            _ => bail!("a light of an unknown kind"),
        })
    }
}

impl Row {
    fn new(
        technique: &'static Technique,
        job: &Job,
        seen: &[Body],
        view_axes: &LightSpace,
        least: &Least,
    ) -> Result<Self, Error> {
        let fit = technique.fit(job, seen);
        let map = fit.solve((technique.rule)(job)?)?;
        let bodies: Vec<LitBody> = fit.lit_receivers().filter(|body| !body.is_empty()).collect();
        let eye = job.view.eye();
        let matrix = |origin: DVec3| map.clip_from_world_at(origin, ClipSpace::WGPU).transpose().to_cols_array();
        let bound = |origin: DVec3| fit.rounding(&map, origin).truncate().max_element();
        let per_texel = |p: DVec3| aliasing::pixels_per_texel(&map, &job.view, job.viewport, p);
        let (space, worst) = (map.light_space(), fit.worst_texel(&map));
        let over_least = worst / least.along.max(least.across);
        let on_these_axes = fit.axes == job.axes.unwrap_or_default() && space == *view_axes && over_least.is_finite();
        Ok(Self {
            name: technique.name,
            face: job.face,
            eta: map.warp().excess(),
            warp_ratio: map.warp().ratio(),
            clip_from_world: matrix(DVec3::ZERO),
            clip_from_eye: matrix(eye),
            clip_from_body: matrix(map.origin()),
            body_origin: map.origin().to_array(),
            worst_pixels_per_texel: worst,
            worst_over_least: on_these_axes.then_some(over_least),
            mean_pixels_per_texel: Quadrature::of(&bodies).mean(per_texel),
            map_share: map_share(&map, &bodies),
            setup_ns: setup_ns(technique, job),
            f32_texels: Rounding {
                eye: displacement(&map, &bodies, eye),
                eye_bound: bound(eye),
                world: displacement(&map, &bodies, DVec3::ZERO),
                world_bound: bound(DVec3::ZERO),
            },
            light_space: LightAxes {
                x: space.x.to_array(),
                y: space.y.to_array(),
                z: space.z.to_array(),
                sin_gamma: space.sin_gamma,
            },
            technique,
            job: job.clone(),
            bodies,
            map,
        })
    }
}

const BATCHES: u32 = 301;
const RUNS_PER_BATCH: u32 = 16;

/// Returns the time from a view to a fitted map, in nanoseconds: the mean of the fastest batch,
/// which was disturbed least.
fn setup_ns(technique: &Technique, job: &Job) -> f64 {
    let mut receivers = Vec::with_capacity(job.receivers.len());
    let mut solve = || {
        receivers.clear();
        receivers.extend(black_box(&job.receivers).iter().map(|bounds| Body::visible(black_box(&job.view), bounds)));
        technique.fit(job, &receivers).solve(black_box((technique.rule)(job)?))
    };
    let batches = (0..BATCHES).map(|_| {
        let start = Instant::now();
        for _ in 0..RUNS_PER_BATCH {
            let _ = black_box(solve());
        }
        start.elapsed().as_nanos() as f64 / f64::from(RUNS_PER_BATCH)
    });
    batches.fold(f64::INFINITY, f64::min)
}
