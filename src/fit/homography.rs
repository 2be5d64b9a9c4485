//! The fit of a map whose warp has a direction of its own: perspective and plane-optimal shadow maps.
//!
//! Every projective map that keeps light rays is, in the plane of [`LightSpace`], a warp of the family along the gradient
//! of its `w`, and an affine map after that. So such a map is a [`ShadowMap`] like the others, on other axes.

use glam::{DVec2, DVec4};

use super::extent::{Extent, LEAST_ASPECT, at, fitted, least_size};
use super::frame::{Frame, Measures};
use crate::basis::LightSpace;
use crate::error::{Error, MIN_LENGTH};
use crate::map::ShadowMap;
use crate::math::{max, sqrt};
use crate::plane::Plane;
use crate::warp::{PerspectiveRule, Warp, perspective_rows};

/// The map of a perspective rule.
pub(super) fn perspective<const SPOT: bool, const V: usize, const F: usize>(
    frame: &Frame<V, F>,
    rule: PerspectiveRule,
) -> Result<ShadowMap, Error> {
    let measures = frame.measure::<SPOT>(|_| ())?;
    let depths = [measures.depth.low, measures.depth.high];
    let rows = perspective_rows(rule, frame.fit.view, frame.origin, frame.light, depths)?;
    fit::<SPOT, V, F>(frame, &measures, rule.shift, rows).ok_or(crate::warp::inside(rule.aim))
}

/// The map with the camera's picture of a plane.
pub(super) fn plane<const SPOT: bool, const V: usize, const F: usize>(
    frame: &Frame<V, F>,
    plane: &Plane,
) -> Result<ShadowMap, Error> {
    let refused = Error::Unsupported {
        requested: "a map for a plane on which some of what is seen casts its shadow behind the eye, or not at all",
        use_instead: "Rule::OPTIMAL",
    };
    let measures = frame.measure::<SPOT>(|_| ())?;
    let view = frame.fit.view;
    // The plane about the origin has the rounding of its place in the world.
    let doubt = ROUNDING * (plane.offset().abs() + frame.origin.abs().element_sum());
    let plane = plane.relative_to(frame.origin);
    let plane = plane.normal().extend(-plane.offset());
    let along = |axis: glam::DVec3| axis.extend(-axis.dot(frame.to_eye()));
    // The depth of the camera's picture is 1 where it has no perspective.
    let depth = if view.is_perspective() { along(view.forward()) } else { DVec4::W };
    let at_light = plane.dot(frame.light);
    // Seen from a light or a camera in it, the plane is a line.
    let camera = if view.is_perspective() { frame.to_eye().extend(1.0) } else { view.forward().extend(0.0) };
    let in_it = |from: &DVec4| plane.dot(*from).abs() <= ROUNDING * plane.abs().dot(from.abs()) + doubt * from.w;
    if [frame.light, camera].iter().any(in_it) {
        return Err(refused);
    }
    let cast = |row: DVec4| (row * at_light - plane * row.dot(frame.light)) * at_light.signum();
    let rows = [
        cast(along(view.right())),
        cast(along(view.up())),
        frame.height - measures.height.middle() * frame.base,
        cast(depth),
    ];
    fit::<SPOT, V, F>(frame, &measures, 0.0, rows).ok_or(refused)
}

/// Fits a map to the receivers, seen by a camera moved back by `shift`: rows `u`, `v`, height and `w`, where `height/w` grows towards the light. `None` if `w` is
/// not positive on them, or not known to be.
fn fit<const SPOT: bool, const V: usize, const F: usize>(
    frame: &Frame<V, F>,
    measures: &Measures,
    shift: f64,
    [u, v, height, w]: [DVec4; 4],
) -> Option<ShadowMap> {
    let base = frame.base;
    // The warp's own axes: `z` along the gradient of `w`.
    let in_plane = |row: DVec4, axis: glam::DVec3| row.truncate().dot(axis);
    let [g_x, g_z] = [in_plane(w, frame.space.x), in_plane(w, frame.space.z)];
    let gradient = sqrt(g_x * g_x + g_z * g_z);
    let y = frame.space.y;
    let space = if gradient > 0.0 {
        let z = (frame.space.x * g_x + frame.space.z * g_z) / gradient;
        LightSpace { x: z.cross(y), y, z, ..frame.space }
    } else {
        frame.space
    };
    // In the family's units: height is 1 at a spot light, and grows by 1 in world length towards a light at infinity.
    let height = height / height.dot(frame.light);
    let ([u_extent, v_extent, per_ratio], depths) =
        frame.fractions::<3, SPOT>([u, v, base], height, w, frame.casters());
    // `w/base` over the receivers: not positive somewhere, and its reciprocal is not either, or has no bound.
    let ratio = Extent { low: 1.0 / per_ratio.high, high: 1.0 / per_ratio.low };
    let of = |measure: fn(Extent) -> f64| {
        let Measures { across, along, height, .. } = measures;
        max(measure(*across), max(measure(*along), measure(*height)))
    };
    // How far the receivers, and the camera, are from the origin, and how much of a row is rounding there.
    let (reach, nearest) = if SPOT {
        (frame.light.abs().element_sum() + measures.spot_reach(), measures.base.low)
    } else {
        (measures.across.reach() + measures.along.reach() + measures.height.reach(), 1.0)
    };
    // A point at the eye and at the origin has none.
    let distance = max(reach + frame.to_eye().abs().element_sum() + shift, MIN_LENGTH);
    let size = |row: DVec4| row.truncate().abs().element_sum() * distance + row.w.abs();
    let is_known = ratio.low * nearest > ROUNDING * size(w);
    if !(per_ratio.low > 0.0 && is_known && ratio.high <= Warp::MAX_EXCESS * ratio.low) {
        return None;
    }
    let [u, v, w] = [u, v, w].map(|row| row / ratio.low);
    let depths = Extent { low: depths.low * ratio.low, high: depths.high * ratio.low };
    let excess = ratio.size() / ratio.low;
    // The rows as functions of places in light space: across, along, constant.
    let constant = |row: DVec4| if SPOT { -in_plane(row, y) } else { row.w };
    let place = |row: DVec4| [in_plane(row, space.x), in_plane(row, space.z), constant(row)];

    let rounding = |row: DVec4| 64.0 * f64::EPSILON * size(row) / nearest;
    let floor = LEAST_ASPECT * max(u_extent.size(), v_extent.size());
    let (u_extent, v_extent) = (u_extent.at_least(max(floor, rounding(u))), v_extent.at_least(max(floor, rounding(v))));

    // The derivatives of the picture where w is 1; across the warp where the body is nearest to the eye.
    let [_, w_z, w_0] = place(w);
    let (eye, eye_base) = (frame.to_eye(), at(base, frame.to_eye()));
    let nearest = |row: DVec4, extent: Extent| {
        if eye_base > 0.0 { extent.clamp(at(row, eye) / eye_base) } else { extent.middle() }
    };
    let nearest = frame.space.x * nearest(frame.x, measures.across) + frame.space.z * nearest(frame.z, measures.along);
    let centre = space.x.dot(nearest);
    let derivative = |row: DVec4| {
        let [r_x, r_z, r_0] = place(row);
        // r_z - (r/w) w_z, without the place itself, which is far away for a weak warp.
        [r_x, r_z * w_0 - (r_x * centre + r_0) * w_z]
    };
    let ([u_x, u_z], [v_x, v_z]) = (derivative(u), derivative(v));
    let determinant = u_x * v_z - u_z * v_x;
    let [width, height_texels] = frame.fit.map_size.map(f64::from);
    let texels = [
        DVec2::new(v_z, v_x).abs() * (u_extent.size() / (width * determinant.abs())),
        DVec2::new(u_z, u_x).abs() * (v_extent.size() / (height_texels * determinant.abs())),
    ];
    if !(determinant.abs() > 0.0 && texels.iter().all(|texel| texel.is_finite())) {
        return None;
    }
    // Far up and unmirrored, as the family's.
    let up = if v_z < 0.0 { -1.0 } else { 1.0 };
    let across = if determinant * up < 0.0 { -1.0 } else { 1.0 };
    let x = fitted(u, u_extent, w) * across;
    let y = fitted(v, v_extent, w) * up;

    let depths = if SPOT { frame.with_spot_casters(depths, measures, [x, y], height, w) } else { depths };
    // A body that is flat towards the light is fitted as by the family.
    let [body, reach] = if SPOT { [measures.height.high, 0.0] } else { [of(Extent::size), of(Extent::reach)] };
    let distance = max(depths.reach(), max(reach, frame.fit.greatest_shift(frame.origin)) / (1.0 + excess));
    let depths = depths.at_least(max(least_size(body / (1.0 + excess), distance), rounding(height)));
    let z = (depths.high * w - height) / depths.size();
    let warp = Warp::clamped(excess);
    // One that is not finite makes the sum so.
    (x + y + z + w).is_finite().then(|| {
        ShadowMap::new(frame.origin, [x, y, z, w], warp, space, frame.light, texels, depths.size(), frame.fit.map_size)
    })
}

/// `w` has a rounding error of this times the size of its terms; less than this of them and nothing is left of it.
const ROUNDING: f64 = 1.0 / (1_u64 << 44) as f64;
