//! The best warps against those of the literature for a whole view frustum: in closed form for the
//! error along the warp, and as tables for the storage factor. Numbers have 50 digits inside.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]
#![expect(clippy::disallowed_methods, reason = "tests may call what the library must not")]

mod random;

use approx::{assert_abs_diff_eq, assert_relative_eq};
use random::basic::log_between;
use random::measure::{Scene, box_about};
use random::{Ratchet, check};
use shadow_warp::glam::DVec3;
use shadow_warp::{Objective, Rule, View, Warp};

/// All that a square camera along z sees, from 1 to `far`, under a light in that direction. Angles
/// in radians; `half` is half of the field of view.
fn frustum(half: f64, far: f64, to_light: DVec3) -> Scene {
    let view = View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, 2.0 * half, 1.0, 1.0..far).unwrap();
    let everything = box_about(DVec3::ZERO, DVec3::splat(20.0 * far));
    Scene::new(view, to_light, &[everything], everything)
}

fn best_excess(scene: &Scene, objective: Objective) -> f64 {
    scene.fit().solve(Rule::Optimal(objective)).unwrap().warp().excess()
}

/// The greatest error along the warp over a frustum is least where (Zhang et al. 2009, Sec. 3.1,
/// extended to all angles) the near and far ends of its bottom edge are equally bad, or one of them
/// is least by itself: with the distance `D` of the far bottom edge and `l` of the near one from
/// the near plane of the warp,
///
/// `kappa = min((D - 2 l)/(l D), (sqrt f - sqrt n)/(D sqrt n - l sqrt f))`, and 0 where `D <= 2 l`;
/// the excess is `kappa D`.
#[test]
fn error_along_a_frustum() {
    // n + sqrt(n f) away from the plane of the warp's pole at 90 degrees, and two more, as
    // published.
    for (degrees, extent, distance) in [(90.0, 99.0, 11.0), (30.0, 100.0, 10.0)] {
        let angle = f64::to_radians(degrees);
        let scene = frustum(30_f64.to_radians(), 100.0, DVec3::new(0.0, angle.sin(), angle.cos()));
        let found = best_excess(&scene, Objective::Along);
        assert_relative_eq!(found * distance, extent, max_relative = 1e-12);
    }
    let mut worst = Ratchet::new("the best excess along a frustum");
    let (mut warped, mut plain) = (0, 0);
    let strategy = (0.1..1.1, 0.01..core::f64::consts::FRAC_PI_2, log_between(1.5, 1e5));
    check("error-along", 400, strategy, |(half, gamma, f): (f64, f64, f64)| {
        let (s, c, t) = (gamma.sin(), gamma.cos(), half.tan());
        let (top, bottom) = (s - t * c, s + t * c);
        // The far bottom edge, and the near one, from where the warp begins: the near top edge, or
        // the far one.
        let extent = if top >= 0.0 { (f - 1.0) * s + (f + 1.0) * t * c } else { 2.0 * f * t * c };
        let near = if top >= 0.0 { 2.0 * t * c } else { 2.0 * f * t * c - (f - 1.0) * bottom };
        let equal = (f.sqrt() - 1.0) / (extent - near * f.sqrt());
        let alone = if near > 0.0 { (extent - 2.0 * near) / (near * extent) } else { f64::INFINITY };
        let kappa = if extent <= 2.0 * near {
            0.0
        } else if equal > 0.0 {
            alone.min(equal)
        } else {
            alone
        };
        let expected = kappa * extent;
        let found = best_excess(&frustum(half, f, DVec3::new(0.0, s, c)), Objective::Along);
        // The tangent of the field of view is taken twice.
        worst.note((found - expected).abs(), 1e-13 * (1.0 + expected), (found, expected));
        if expected > 0.0 { warped += 1 } else { plain += 1 }
    });
    worst.finish();
    assert!(warped > 200 && plain > 5, "{warped} {plain}");
}

/// The storage factor (Lloyd 2007): the product of the greatest errors in both directions. Field of
/// view 60 degrees, far/near 1000; light at `gamma` to the view and `azimuth` about it, in degrees.
/// The logarithm of the best ratio over that of far/near, and the factor with it and without a
/// warp.
#[test]
fn storage_factor_of_a_frustum() {
    let table = [
        (75.0, 20.0, 0.501_476_073_498_789_3, 1_557.217_136_386_908_4, 1_283_906.402_847_181_3),
        (60.0, 30.0, 0.502_803_777_368_824_4, 2_211.200_248_003_362, 1_490_467.391_082_546_4),
        (40.0, 10.0, 0.503_990_995_981_420_5, 5_190.611_427_301_881, 1_158_770.807_502_807_6),
        (25.0, 70.0, 0.177_795_264_688_775_6, 711_908.656_103_393_6, 1_488_871.203_106_235_2),
        (12.0, 45.0, 0.112_725_682_206_773_7, 1_675_279.695_314_024_8, 1_956_295.201_467_611_4),
    ];
    for (gamma, azimuth, log_ratio, best, uniform) in table {
        let (g, a) = (f64::to_radians(gamma), f64::to_radians(azimuth));
        let to_light = DVec3::new(g.sin() * a.cos(), g.sin() * a.sin(), g.cos());
        let scene = frustum(30_f64.to_radians(), 1000.0, to_light);
        let found = best_excess(&scene, Objective::Product);
        let place = (1.0 + found).ln() / 1000_f64.ln();
        assert_abs_diff_eq!(place, log_ratio, epsilon = 1e-6);
        let factor = |excess: f64| Objective::Product.of(&scene.fit().errors(Warp::new(excess).unwrap()).unwrap());
        let gain = factor(found) / factor(0.0);
        assert_relative_eq!(gain, best / uniform, max_relative = 1e-12);
    }
    // In the plane of the picture's upright, within the field of view, in closed form: p = 3 - 2/k
    // with k = 1 - y/W for the near edge that is furthest along, and the ratio 1/(1 - p).
    for (gamma, p) in [(12.0, 0.073_436_132_926_921_71), (27.0, 0.873_066_119_880_771_7)] {
        let g = f64::to_radians(gamma);
        let scene = frustum(30_f64.to_radians(), 1000.0, DVec3::new(0.0, g.sin(), g.cos()));
        let ratio = 1.0 + best_excess(&scene, Objective::Product);
        assert_relative_eq!(ratio * (1.0 - p), 1.0, max_relative = 1e-6);
    }
}
