//! Where receivers lie in a map, and how far off.

use shadow_warp::glam::{DVec2, DVec3, DVec4};
use shadow_warp::{ClipSpace, LitBody, ShadowMap};

/// Lines of the map that are measured where bodies may overlap.
const LINES: u32 = 4096;

/// Returns the share of the map that the receivers cover. Of several bodies, whose pictures may
/// overlap, in the middles of 4096 lines.
pub(crate) fn map_share(map: &ShadowMap, bodies: &[LitBody]) -> f64 {
    let triangles = |body: &LitBody| {
        let clip = map.clip_from_world_at(body.origin(), ClipSpace::WGPU);
        let project = |q: DVec3| clip.project_point3(q).truncate();
        let triangles = body.faces().flat_map(|face| face.triangles().collect::<Vec<_>>());
        triangles.map(|t| t.map(project)).collect::<Vec<_>>()
    };
    if let [body] = bodies {
        // Seen from the light a convex body covers each point with two of its faces, so its picture
        // is half as large as those of all faces together.
        let area = |[a, b, c]: [DVec2; 3]| 0.5 * (b - a).perp_dot(c - a).abs();
        return 0.5 * triangles(body).into_iter().map(area).sum::<f64>() / 4.0;
    }
    let pictures: Vec<Vec<[DVec2; 3]>> = bodies.iter().map(triangles).collect();
    let covered = |line: u32| {
        let y = f64::from(2 * line + 1) / f64::from(LINES) - 1.0;
        let mut parts: Vec<[f64; 2]> = pictures.iter().filter_map(|picture| section(picture, y)).collect();
        parts.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut end = f64::NEG_INFINITY;
        let new = parts.into_iter().map(|[low, high]| {
            let length = (high - low.max(end)).max(0.0);
            end = end.max(high);
            length
        });
        new.sum::<f64>()
    };
    (0..LINES).map(covered).sum::<f64>() / (2.0 * f64::from(LINES))
}

/// Where a convex picture begins and ends on a level line.
fn section(picture: &[[DVec2; 3]], y: f64) -> Option<[f64; 2]> {
    let edges = picture.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
    let crossing = |[a, b]: [DVec2; 2]| {
        let crosses = (a.y <= y) != (b.y <= y);
        crosses.then(|| a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)))
    };
    let ends = edges.filter_map(crossing).map(|x| [x, x]);
    ends.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

/// Returns how far the vertices move in the map, in texels, with matrix, positions and products in
/// `f32`.
pub(crate) fn displacement(map: &ShadowMap, bodies: &[LitBody], origin: DVec3) -> f64 {
    let half_size = DVec2::from(map.size().map(f64::from)) * 0.5;
    let rounded = map.clip_from_world_at(origin, ClipSpace::WGPU).as_mat4();
    let ndc = |clip: DVec4| clip.truncate().truncate() / clip.w;
    let moved = bodies.iter().flat_map(|body| {
        let exact = map.clip_from_world_at(body.origin(), ClipSpace::WGPU);
        body.vertices().iter().map(move |&q| {
            let p = (q + (body.origin() - origin)).as_vec3();
            let displaced = ndc((rounded * p.extend(1.0)).as_dvec4()) - ndc(exact * q.extend(1.0));
            (displaced * half_size).abs().max_element()
        })
    });
    // `f64::max` would drop a NaN, which means that `f32` cannot hold the scene.
    moved.fold(0.0, |worst, x| if x <= worst { worst } else { x })
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::{Context, Result};
    use scenes::{Boxes, Cuboid, Job, Model};
    use shadow_warp::{Fit, Rule};

    fn share(boxes: &[[f64; 4]]) -> Result<f64> {
        let solid = |&[x0, x1, z0, z1]: &[f64; 4]| Cuboid { min: [x0, 0.0, z0], max: [x1, 1.0, z1] };
        let mut scene = Model::ground().scene;
        scene.light = scenes::Lamp::directional([0.0, 1.0, 0.0]);
        scene.receivers = Boxes::Many(boxes.iter().map(solid).collect());
        let job: Job = scene.validated()?;
        let seen = job.seen();
        let fit: Fit = job.fit(&seen);
        let bodies: Vec<LitBody> = fit.lit_receivers().collect();
        bodies.first().context("a body")?;
        Ok(map_share(&fit.solve(Rule::Uniform)?, &bodies))
    }

    /// Under a light from above: one body that two cover, or three of which one lies in the others,
    /// is covered as much.
    #[test]
    fn what_is_covered_twice_counts_once() -> Result<()> {
        let whole = share(&[[-10.0, 10.0, 0.0, 40.0]])?;
        assert!((whole - 1.0).abs() < 1e-12, "{whole}");
        for parts in [
            vec![[-10.0, 10.0, 0.0, 40.0], [-10.0, 10.0, 0.0, 40.0]],
            vec![[-10.0, 2.0, 0.0, 40.0], [-3.0, 10.0, 0.0, 40.0], [-5.0, 5.0, 10.0, 20.0]],
            vec![[-10.0, 10.0, 0.0, 15.0], [-10.0, 10.0, 15.0, 40.0]],
        ] {
            let all = share(&parts)?;
            assert!((all - 1.0).abs() < 1e-9, "{parts:?}: {all}");
        }
        // Two quarters, at opposite corners.
        let half = share(&[[-10.0, 0.0, 0.0, 20.0], [0.0, 10.0, 20.0, 40.0]])?;
        assert!((half - 0.5).abs() < 1e-3, "{half}");
        Ok(())
    }
}
