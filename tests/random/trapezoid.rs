//! The eight matrices of Martin and Tan 2004, as the paper has them, in the plane.

use shadow_warp::glam::{DMat3, DVec2, DVec3};

/// Returns the product that takes the corners of a trapezoid, base line `t0 t1` and top line `t3
/// t2`, to those of the square: `(-1, -1)`, `(1, -1)`, `(1, 1)`, `(-1, 1)`. Not a number where the
/// side lines do not meet.
pub(crate) fn eight_matrices([t0, t1, t2, t3]: [DVec2; 4]) -> DMat3 {
    let rows = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| DMat3::from_cols(a.into(), b.into(), c.into()).transpose();
    let translation = |u: DVec2| rows([1.0, 0.0, -u.x], [0.0, 1.0, -u.y], [0.0, 0.0, 1.0]);
    let scale = |x: f64, y: f64| rows([x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, 1.0]);
    let apply = |m: DMat3, p: DVec2| m * p.extend(1.0);
    let place = |p: DVec3| p.truncate() / p.z;

    let t_1 = translation(0.5 * (t2 + t3));
    let u = (t2 - t3) / (t2 - t3).length();
    let r = rows([u.x, u.y, 0.0], [u.y, -u.x, 0.0], [0.0, 0.0, 1.0]);
    // Where the side lines meet.
    let (a, b) = (t3 - t0, t2 - t1);
    let i = t0 + a * ((t1 - t0).perp_dot(b) / a.perp_dot(b));
    let m = r * t_1;
    let m = translation(place(apply(m, i))) * m;
    let u = 0.5 * (place(apply(m, t2)) + place(apply(m, t3)));
    let m = rows([1.0, -u.x / u.y, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]) * m;
    let u = place(apply(m, t2));
    let m = scale(1.0 / u.x, 1.0 / u.y) * m;
    let m = rows([1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 1.0, 0.0]) * m;
    let [u, v] = [t0, t2].map(|t| place(apply(m, t)));
    let m = translation(DVec2::new(0.0, 0.5 * (u.y + v.y))) * m;
    let u = place(apply(m, t0));
    scale(1.0, -1.0 / u.y) * m
}
