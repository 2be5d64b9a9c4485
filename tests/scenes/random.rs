//! A generator that is the same on every platform: splitmix64.

use shadow_warp::glam::DVec3;

/// Steele, Lea and Flood 2014, Fig. 17; as small as generators come, and its seeds need not be good ones.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0xD1B5_4A32_D192_ED03))
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// From 0 to below 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// With an even spread of orders of magnitude.
    #[expect(clippy::disallowed_methods, reason = "tests may call what the library must not")]
    pub(crate) fn log_between(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp().clamp(low, high)
    }

    pub(crate) fn below(&mut self, end: usize) -> usize {
        (self.bits() % end as u64) as usize
    }

    /// A point with coordinates up to `size`.
    pub(crate) fn inside(&mut self, size: f64) -> DVec3 {
        DVec3::new(self.between(-size, size), self.between(-size, size), self.between(-size, size))
    }

    /// A unit vector; all are equally likely.
    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.inside(1.0);
            if (1e-4..=1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }

    /// A point of the hull of some points. One in four lies on the way between two of them.
    pub(crate) fn mixed(&mut self, points: &[DVec3]) -> DVec3 {
        if self.below(4) == 0 {
            let (a, b) = (points[self.below(points.len())], points[self.below(points.len())]);
            return a.lerp(b, self.unit());
        }
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        for p in points {
            // Cubes, so that points near a vertex or a face are common.
            let u = self.unit();
            let weight = u * u * u;
            sum += weight * *p;
            weights += weight;
        }
        sum / weights
    }
}
