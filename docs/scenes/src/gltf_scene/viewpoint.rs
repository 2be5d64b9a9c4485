//! A camera for a file that has none.

use shadow_warp::glam::{DVec2, DVec3};

use crate::scene::Camera;
use crate::sight::{Pinhole, Sight};

/// Width over height of a picture that the file says nothing about.
pub(super) const ASPECT: f64 = 16.0 / 9.0;
const FOV_Y_DEG: f64 = 50.0;

/// Where a camera stands, seen from the middle of the box.
enum Stand {
    /// So far beyond a side or an edge, and so far above the top, in shares of the box's greatest
    /// side. It looks at the middle.
    Outside { beyond: f64, above: f64 },
    /// Four fifths of the way to a side or an edge, a fifth of the height above the bottom. It
    /// looks at what lies a little lower.
    Inside,
}

/// From close above, from further away, and from inside.
const STANDS: [Stand; 4] = [
    Stand::Outside { beyond: 0.05, above: 0.1 },
    Stand::Outside { beyond: 0.4, above: 0.25 },
    Stand::Outside { beyond: 0.25, above: 0.02 },
    Stand::Inside,
];

/// Returns the camera, of some before and inside the box, whose picture tells most; and how many
/// there were. The first, along the longer horizontal axis from a little above and before one end
/// of the box, where nothing is known of what there is in it.
pub(super) fn made_up(low: DVec3, high: DVec3, triangles: &[[DVec3; 3]], to_light: DVec3) -> (Camera, usize) {
    let candidates = candidates(low, high);
    let sight = Sight::new(triangles, to_light);
    let mut best = (candidates[0], f64::NEG_INFINITY);
    for camera in &candidates {
        let told = sight.entropy(camera);
        // Where one tells as much as another, to rounding and a little, the one before.
        if told > best.1 + 1e-6 {
            best = (*camera, told);
        }
    }
    let camera = Camera {
        eye: best.0.eye.to_array(),
        forward: best.0.forward.to_array(),
        up: DVec3::Y.to_array(),
        fov_y_deg: Some(FOV_Y_DEG),
        aspect: Some(ASPECT),
        near: best.0.near,
        far: None,
        ..Camera::default()
    };
    (camera, candidates.len())
}

fn candidates(low: DVec3, high: DVec3) -> Vec<Pinhole> {
    let (size, middle) = (high - low, low + 0.5 * (high - low));
    let length = if size.max_element() > 0.0 { size.max_element() } else { 1.0 };
    let (along, across) = if size.x > size.z { (DVec3::X, DVec3::Z) } else { (DVec3::Z, DVec3::X) };
    let around = [along, -along, across, -across, along + across, along - across, across - along, -along - across];
    let camera = |(stand, towards): (&Stand, DVec3)| {
        let (eye, target) = match stand {
            Stand::Outside { beyond, above } => {
                let aside = 0.5 * size * towards + beyond * length * towards.normalize();
                (middle - aside + DVec3::Y * (0.5 * size.y + above * length), middle)
            }
            Stand::Inside => {
                (middle - 0.4 * size * towards - DVec3::Y * (0.3 * size.y), middle - DVec3::Y * (0.35 * size.y))
            }
        };
        let half = DVec2::from_angle(0.5 * FOV_Y_DEG.to_radians());
        Pinhole { eye, forward: target - eye, tangent: half.y / half.x, aspect: ASPECT, near: length / 200.0 }
    };
    STANDS.iter().flat_map(|stand| around.map(|towards| (stand, towards))).map(camera).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::{Triangles, cuboid, floor};

    const SUN: DVec3 = DVec3::new(-0.3, 0.8, -0.5);

    fn bounds(triangles: &Triangles) -> [DVec3; 2] {
        let corners = || triangles.as_flattened().iter();
        [corners().fold(DVec3::INFINITY, |a, b| a.min(*b)), corners().fold(DVec3::NEG_INFINITY, |a, b| a.max(*b))]
    }

    /// The distance to the triangle, where the ray meets it (Moeller and Trumbore 1997).
    fn meets([a, b, c]: [DVec3; 3], eye: DVec3, ray: DVec3) -> Option<f64> {
        let (u, v) = (b - a, c - a);
        let p = ray.cross(v);
        let determinant = u.dot(p);
        let (s, over) = (eye - a, 1.0 / determinant);
        let q = s.cross(u);
        let (x, y, distance) = (s.dot(p) * over, ray.dot(q) * over, v.dot(q) * over);
        (x >= 0.0 && y >= 0.0 && x + y <= 1.0 && distance > 0.0).then_some(distance)
    }

    /// The triangles that rays through a picture's pixels meet first, by brute force; none for the
    /// sky.
    fn seen(triangles: &Triangles, camera: &Camera) -> Vec<Option<usize>> {
        let [eye, forward] = [camera.eye, camera.forward].map(DVec3::from);
        let forward = forward.normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let half = DVec2::from_angle(25_f64.to_radians());
        let tangent = half.y / half.x;
        let at = |i: u32, count: u32| f64::from(2 * i + 1) / f64::from(count) - 1.0;
        let pixels = (0..27).flat_map(|j| (0..48).map(move |i| (i, j)));
        let ray = |(i, j)| forward + (right * at(i, 48) * ASPECT + up * at(j, 27)) * tangent;
        let first = |ray| {
            let hits = triangles.iter().enumerate().filter_map(|(i, t)| Some((i, meets(*t, eye, ray)?)));
            hits.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
        };
        pixels.map(ray).map(first).collect()
    }

    /// Of a closed box more than one face is seen, and one that light falls on; of a slab, its top.
    #[test]
    fn a_closed_box_is_seen_from_where_it_has_faces() {
        for size in [
            DVec3::ONE,
            DVec3::new(10.0, 3.0, 4.0),
            DVec3::new(4.0, 3.0, 10.0),
            DVec3::new(1.0, 20.0, 1.0),
            DVec3::new(20.0, 0.1, 20.0),
        ] {
            let triangles = cuboid(DVec3::new(5.0, -1.0, 3.0), DVec3::new(5.0, -1.0, 3.0) + size);
            let [low, high] = bounds(&triangles);
            let (camera, count) = made_up(low, high, &triangles, SUN);
            assert_eq!(count, 32);
            let seen = seen(&triangles, &camera);
            let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize();
            let shares = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| {
                let on_face = |t: &&usize| normal(triangles[**t]).dot(axis).abs() > 0.5;
                seen.iter().flatten().filter(on_face).count() as f64 / seen.len() as f64
            });
            // A slab's edge is thin, and a tower leaves room beside it.
            let faces = shares.iter().filter(|share| **share > 0.01).count();
            let is_slab = size.y < 0.1 * size.x && shares[1] > 0.2;
            assert!(faces >= 2 || is_slab, "{size}: {shares:?}");
            let lit = seen.iter().flatten().filter(|t| normal(triangles[**t]).dot(SUN) > 0.0).count();
            assert!(lit * 20 > seen.len(), "{size}: {lit} of {}", seen.len());
        }
    }

    /// A hall without a roof is looked into, a plain with a house on it is looked along.
    #[test]
    fn what_there_is_fills_the_picture() {
        let wall = |low: [f64; 3], high: [f64; 3]| cuboid(low.into(), high.into());
        let mut hall = floor(DVec3::ZERO, DVec3::new(20.0, 0.0, 30.0));
        for (low, high) in [
            ([0.0, 0.0, 0.0], [0.2, 6.0, 30.0]),
            ([19.8, 0.0, 0.0], [20.0, 6.0, 30.0]),
            ([0.0, 0.0, 0.0], [20.0, 6.0, 0.2]),
            ([0.0, 0.0, 29.8], [20.0, 6.0, 30.0]),
            ([8.0, 0.0, 12.0], [9.0, 3.0, 13.0]),
        ] {
            hall.extend(wall(low, high));
        }
        let mut plain = floor(DVec3::splat(-50.0).with_y(0.0), DVec3::splat(50.0).with_y(0.0));
        plain.extend(wall([-5.0, 0.0, -5.0], [5.0, 8.0, 5.0]));
        for triangles in [hall, plain] {
            let [low, high] = bounds(&triangles);
            let (camera, _) = made_up(low, high, &triangles, SUN);
            let seen = seen(&triangles, &camera);
            // The ground is the first two triangles.
            let [ground, other] = [true, false].map(|is_ground| {
                let counted = seen.iter().flatten().filter(|triangle| (**triangle < 2) == is_ground);
                counted.count() as f64 / seen.len() as f64
            });
            assert!(ground > 0.2 && other > 0.02 && ground + other > 0.4, "{ground} {other}");
        }
    }

    /// Boxes that are flat, lines and points, and no triangles at all, have cameras that the
    /// library takes.
    #[test]
    fn degenerate_boxes_have_cameras() {
        for size in [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, 0.0, 1.0), DVec3::new(0.0, 1.0, 1.0)] {
            let (camera, _) = made_up(DVec3::ONE, DVec3::ONE + size, &Triangles::new(), SUN);
            let [eye, forward] = [camera.eye, camera.forward].map(DVec3::from);
            assert!(eye.is_finite() && forward.is_finite() && camera.near > 0.0, "{size}");
            assert!(forward.cross(DVec3::Y).length() > 1e-3 * forward.length(), "{size}: {forward}");
        }
    }
}
