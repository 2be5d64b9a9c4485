//! Closed meshes, with their triangles counter-clockwise as seen from outside.

use shadow_warp::glam::{DVec2, DVec3};

pub(crate) type Triangles = Vec<[DVec3; 3]>;

/// The box between two corners.
pub(crate) fn cuboid(low: DVec3, high: DVec3) -> Triangles {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    frustum(middle - DVec3::Y * half.y, [half.x, half.z], [half.x, half.z], 2.0 * half.y)
}

/// A pyramid on a rectangle, cut across: half the widths along x and z below and above, and the
/// height.
pub(crate) fn frustum(foot: DVec3, below: [f64; 2], above: [f64; 2], height: f64) -> Triangles {
    let ring = |[x, z]: [f64; 2], y: f64| {
        [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)].map(|(i, j)| foot + DVec3::new(i * x, y, j * z)).to_vec()
    };
    between(&ring(below, 0.0), &ring(above, height))
}

/// A round solid with as many sides, from rings of (radius, height), the lowest first.
pub(crate) fn turned(foot: DVec3, sides: u32, rings: &[(f64, f64)]) -> Triangles {
    let ring = |&(radius, height): &(f64, f64)| {
        let corner = |i: u32| {
            // From above (against y) x turns to -z.
            let towards = DVec2::from_angle(f64::from(i) * std::f64::consts::TAU / f64::from(sides));
            foot + DVec3::new(radius * towards.x, height, -radius * towards.y)
        };
        (0..sides).map(corner).collect::<Vec<_>>()
    };
    rings.windows(2).flat_map(|pair| between(&ring(&pair[0]), &ring(&pair[1]))).collect()
}

/// A flat square on the ground, seen from above.
pub(crate) fn floor(low: DVec3, high: DVec3) -> Triangles {
    let [a, b, c, d] =
        [(low.x, low.z), (low.x, high.z), (high.x, high.z), (high.x, low.z)].map(|(x, z)| DVec3::new(x, low.y, z));
    vec![[a, b, c], [a, c, d]]
}

/// The sides, the lid and the bottom between two rings that run counter-clockwise as seen from
/// above.
fn between(below: &[DVec3], above: &[DVec3]) -> Triangles {
    let count = below.len();
    let sides = (0..count).flat_map(|i| {
        let next = (i + 1) % count;
        [[below[i], below[next], above[next]], [below[i], above[next], above[i]]]
    });
    let lid = (1..count - 1).map(|i| [above[0], above[i], above[i + 1]]);
    let bottom = (1..count - 1).map(|i| [below[0], below[i + 1], below[i]]);
    sides.chain(lid).chain(bottom).filter(|[a, b, c]| (*b - *a).cross(*c - *a).length_squared() > 0.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six times the volume, by the divergence theorem: positive only if the triangles look
    /// outward.
    fn six_volumes(solid: &Triangles) -> f64 {
        solid.iter().map(|[a, b, c]| a.dot(b.cross(*c))).sum()
    }

    #[test]
    fn triangles_look_outward() {
        let is_one = |x: f64| (x - 1.0).abs() < 1e-12;
        assert!(is_one(six_volumes(&cuboid(DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 4.0, 6.0))) / 36.0));
        assert!(is_one(six_volumes(&frustum(DVec3::ONE, [1.0, 2.0], [0.0, 0.0], 3.0)) / 48.0));
        assert!(is_one(six_volumes(&turned(DVec3::X, 4, &[(1.0, 0.0), (1.0, 5.0)])) / 60.0));
        let [a, b, c] = floor(DVec3::ZERO, DVec3::ONE)[0];
        assert!((b - a).cross(c - a).y > 0.0);
    }
}
