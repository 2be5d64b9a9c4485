//! How much a picture of triangles shows, by a small rasteriser in software.

use std::collections::HashMap;

use shadow_warp::glam::{DMat3, DVec2, DVec3};

/// Pixels of the picture, and texels of the shadow map that it is lit through.
const PICTURE: [usize; 2] = [96, 54];
const MAP: [usize; 2] = [512, 512];
/// Steps of brightness that are told apart.
const STEPS: f64 = 24.0;
const AMBIENT: f64 = 0.35;

/// A pinhole camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pinhole {
    pub(crate) eye: DVec3,
    /// Of any length.
    pub(crate) forward: DVec3,
    /// Half the height of the picture at a distance of 1.
    pub(crate) tangent: f64,
    /// Width over height.
    pub(crate) aspect: f64,
    pub(crate) near: f64,
}

/// Triangles under a light at infinity.
pub(crate) struct Sight<'a> {
    triangles: &'a [[DVec3; 3]],
    to_light: DVec3,
    /// Across the light: the axes of the shadow map, which is about the middle and as large as half
    /// to each side.
    across: [DVec3; 2],
    middle: DVec3,
    half: f64,
    shadows: Buffer,
}

/// For each pixel the triangle that is nearest, and how near it is.
struct Buffer {
    size: [usize; 2],
    nearest: Vec<Option<(usize, f64)>>,
}

impl Buffer {
    /// Draws triangles whose corners `clip` gives as `(x, y, w)` with x/w and y/w from -1 to 1 in
    /// the picture. What is nearest is where the sum of the corners' `nearness`, each times its
    /// share over `w`, is greatest and up to `most`.
    fn draw(
        size: [usize; 2],
        triangles: &[[DVec3; 3]],
        clip: impl Fn(DVec3) -> DVec3,
        nearness: impl Fn(DVec3) -> f64,
        most: f64,
    ) -> Self {
        let mut buffer = Self { size, nearest: vec![None; size[0] * size[1]] };
        for (index, corners) in triangles.iter().enumerate() {
            let places = corners.map(&clip);
            // A pixel (x, y, 1) is the sum of the corners' places, each times its share (Olano and
            // Greer 1997). That needs no clipping. The inverse of a triangle without area has no
            // numbers, and covers nothing.
            let shares = DMat3::from_cols(places[0], places[1], places[2]).inverse();
            let near = DVec3::from(corners.map(&nearness));
            let [columns, rows] = buffer.range(&places);
            for row in rows {
                for column in columns.clone() {
                    let share = shares * buffer.pixel(column, row).extend(1.0);
                    let here = share.dot(near);
                    let place = &mut buffer.nearest[row * size[0] + column];
                    if share.min_element() >= 0.0 && here <= most && place.is_none_or(|(_, before)| here > before) {
                        *place = Some((index, here));
                    }
                }
            }
        }
        buffer
    }

    /// The middle of a pixel, from -1 to 1.
    fn pixel(&self, column: usize, row: usize) -> DVec2 {
        let at = |i: usize, axis: usize| (2 * i + 1) as f64 / self.size[axis] as f64 - 1.0;
        DVec2::new(at(column, 0), at(row, 1))
    }

    /// The columns and the rows that a triangle may cover: all of them, where a corner lies behind
    /// the eye.
    fn range(&self, places: &[DVec3; 3]) -> [std::ops::Range<usize>; 2] {
        let before = places.iter().all(|p| p.z > 0.0);
        let ends = |axis: usize| {
            let at = places.map(|p| (p[axis] / p.z + 1.0) * 0.5 * self.size[axis] as f64);
            let [low, high] = [at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2])];
            // The casts saturate.
            if before { low.floor() as usize..(high.ceil() as usize).min(self.size[axis]) } else { 0..self.size[axis] }
        };
        [ends(0), ends(1)]
    }
}

impl<'a> Sight<'a> {
    pub(crate) fn new(triangles: &'a [[DVec3; 3]], to_light: DVec3) -> Self {
        let to_light = to_light.normalize();
        let (x, y) = to_light.any_orthonormal_pair();
        let corners = triangles.as_flattened();
        let low = corners.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
        let high = corners.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
        let (middle, half) = (0.5 * (low + high), (0.5 * (high - low).length()).max(f64::MIN_POSITIVE));
        let place = |p: DVec3| DVec3::new(x.dot(p - middle), y.dot(p - middle), half) / half;
        let shadows = Buffer::draw(MAP, triangles, place, |p| to_light.dot(p - middle), f64::INFINITY);
        Self { triangles, to_light, across: [x, y], middle, half, shadows }
    }

    /// Returns how much a camera's picture tells, in bits per pixel: the entropy of its steps of
    /// brightness, of which the sky is one more. None where it shows one and the same all over.
    ///
    /// After the viewpoint entropy of Vazquez, Feixas, Sbert and Heidrich 2001, whose classes are
    /// faces: here they are what can be told apart, light, shadow and all.
    pub(crate) fn entropy(&self, camera: &Pinhole) -> f64 {
        let forward = camera.forward.normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let clip = |p: DVec3| {
            let q = p - camera.eye;
            DVec3::new(right.dot(q) / (camera.tangent * camera.aspect), up.dot(q) / camera.tangent, forward.dot(q))
        };
        let picture = Buffer::draw(PICTURE, self.triangles, clip, |_| 1.0, 1.0 / camera.near);
        let mut counts: HashMap<Option<u32>, u32> = HashMap::new();
        for row in 0..PICTURE[1] {
            for column in 0..PICTURE[0] {
                let step = picture.nearest[row * PICTURE[0] + column].map(|(triangle, over_depth)| {
                    let at = picture.pixel(column, row) * camera.tangent;
                    let ray = forward + right * (at.x * camera.aspect) + up * at.y;
                    // The square root is the eye's.
                    (self.brightness(triangle, camera.eye + ray / over_depth, ray).sqrt() * STEPS) as u32
                });
                *counts.entry(step).or_default() += 1;
            }
        }
        let all = (PICTURE[0] * PICTURE[1]) as f64;
        let mut shares: Vec<f64> = counts.values().map(|&count| f64::from(count) / all).collect();
        // The order of a hash map is by chance, and sums depend on it.
        shares.sort_by(f64::total_cmp);
        -shares.iter().map(|share| share * share.log10()).sum::<f64>() / std::f64::consts::LOG10_2
    }

    /// The light on the side of a triangle that a ray meets, from the ambient to 1.
    fn brightness(&self, triangle: usize, point: DVec3, ray: DVec3) -> f64 {
        let [a, b, c] = self.triangles[triangle];
        let normal = (b - a).cross(c - a).normalize();
        let facing = -normal.dot(ray).signum() * normal.dot(self.to_light);
        let place = self.places(point - self.middle);
        let texel = [0, 1].map(|axis| {
            let share = 0.5 * (place[axis] / self.half + 1.0);
            (share * MAP[axis] as f64).clamp(0.0, MAP[axis] as f64 - 1.0) as usize
        });
        let first = self.shadows.nearest[texel[1] * MAP[0] + texel[0]].map_or(triangle, |(first, _)| first);
        // Where the plane of what is nearest to the light lies above the point. Of a neighbour's
        // plane that may be as much as it is inclined to this one, times a texel and a half; of a
        // parallel one it is exact.
        let [other, own] = [first, triangle].map(|i| self.plane(i));
        let above = self.to_light.dot(other.point - point) + other.slope.dot(self.places(point - other.point));
        let texel_size = 2.0 * self.half / MAP[0] as f64;
        let lit =
            first == triangle || above <= 1.5 * texel_size * (other.slope - own.slope).length() + 1e-9 * self.half;
        AMBIENT + if lit { (1.0 - AMBIENT) * facing.max(0.0) } else { 0.0 }
    }

    /// A direction in the plane across the light.
    fn places(&self, q: DVec3) -> DVec2 {
        DVec2::new(self.across[0].dot(q), self.across[1].dot(q))
    }

    /// The plane of a triangle as the light sees it. Where it is along the light its slope is no
    /// number, or infinite, and nothing lies above it.
    fn plane(&self, triangle: usize) -> Plane {
        let [a, b, c] = self.triangles[triangle];
        let normal = (b - a).cross(c - a);
        Plane { point: a, slope: -self.places(normal) / normal.dot(self.to_light) }
    }
}

/// A point, and how the height towards the light changes across the light.
struct Plane {
    point: DVec3,
    slope: DVec2,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::{cuboid, floor};

    const SUN: DVec3 = DVec3::new(-0.3, 0.8, -0.5);

    fn entropy(triangles: &[[DVec3; 3]], eye: DVec3, forward: DVec3) -> f64 {
        let camera = Pinhole { eye, forward, tangent: 0.5, aspect: 16.0 / 9.0, near: 0.01 };
        Sight::new(triangles, SUN).entropy(&camera)
    }

    #[test]
    fn one_and_the_same_all_over_tells_nothing() {
        let room = cuboid(DVec3::splat(-1.0), DVec3::ONE);
        // From above its roof, from inside, where it is dark, and away from it.
        for (eye, forward) in [(DVec3::Y * 1.2, DVec3::NEG_Y), (DVec3::ZERO, DVec3::X), (DVec3::Y * 1.2, DVec3::Y)] {
            // Straight up and down there is no right.
            let told = entropy(&room, eye, forward + DVec3::Z * 1e-3);
            assert!(told.abs() < 1e-12, "{eye} {told}");
        }
    }

    /// Half sky, half ground to a pixel: one bit. With the sun's shadow of a wall on the ground it
    /// is more.
    #[test]
    fn the_horizon_tells_one_bit() {
        let mut triangles = floor(DVec3::new(-1e5, 0.0, -1e5), DVec3::new(1e5, 0.0, 1e5));
        let plain = entropy(&triangles, DVec3::Y, DVec3::Z);
        assert!((plain - 1.0).abs() < 1e-3, "{plain}");
        triangles = floor(DVec3::splat(-10.0).with_y(0.0), DVec3::splat(10.0).with_y(0.0));
        let bare = entropy(&triangles, DVec3::new(0.0, 2.0, -9.0), DVec3::new(0.0, -0.4, 1.0));
        triangles.extend(cuboid(DVec3::new(-3.0, 0.0, -2.0), DVec3::new(-2.0, 3.0, 4.0)));
        let with_wall = entropy(&triangles, DVec3::new(0.0, 2.0, -9.0), DVec3::new(0.0, -0.4, 1.0));
        assert!(with_wall > bare + 0.2, "{bare} {with_wall}");
    }

    /// A wall that crosses the plane of the eye, and one behind it, need no clipping.
    #[test]
    fn what_lies_behind_the_eye_is_not_drawn() {
        let wall =
            |z: [f64; 2]| vec![[DVec3::new(1.0, -9.0, z[0]), DVec3::new(1.0, 9.0, z[0]), DVec3::new(1.0, 0.0, z[1])]];
        assert!(entropy(&wall([-5.0, 9.0]), DVec3::ZERO, DVec3::Z) > 0.1);
        assert!(entropy(&wall([-5.0, -9.0]), DVec3::ZERO, DVec3::Z).abs() < 1e-12);
    }
}
