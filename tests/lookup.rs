//! What a shader is given, against the matrix and the bias that it is made from; depths read back.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]

mod random;

use approx::{assert_relative_eq, assert_ulps_eq};
use proptest::prelude::*;
use random::Ratchet;
use random::scenes::{Kind, each_kind, moderate};
use shadow_warp::glam::{DVec3, DVec4, Mat4, Vec4};
use shadow_warp::{ClipSpace, DepthFormat, Error, Filter, Rule};

/// The struct, evaluated in f32 as a shader does, lands where the f64 matrix does, to the bound on
/// rounding.
#[test]
fn a_shader_lands_where_the_matrix_does() {
    let mut off =
        ["a shader's x of the bound", "a shader's y of the bound", "a shader's depth of the bound"].map(Ratchet::new);
    let mut row = Ratchet::new("linear depth in a shader");
    each_kind("lookup", 40, Just(()), |scene, _, ()| {
        let fit = scene.fit();
        let map = fit.solve(Rule::OPTIMAL).unwrap();
        let origin = map.origin();
        let Ok(map) = fit.guard_f32(&map, origin) else { return };
        let linear = fit.linear_depth(origin).unwrap();
        for space in [ClipSpace::WGPU, ClipSpace::VULKAN.reversed(), ClipSpace::OPENGL] {
            let lookup = map.lookup(origin, space, Filter::Bilinear(3), DepthFormat::Unorm16, Some(linear));
            let all = lookup.to_array();
            let matrix = Mat4::from_cols_slice(&all[..16]);
            let exact = map.texture_from_world_at(origin, space);
            let [width, height] = map.size().map(f64::from);
            // Half an ulp of the quotient, apart.
            let ulp = f64::from(f32::EPSILON);
            let allowed = fit.rounding(&map, origin) + 0.5 * ulp * DVec3::new(width, height, 1.0);
            for q in scene.receivers(origin) {
                let (found, expected) = (matrix * q.as_vec3().extend(1.0), exact * q.extend(1.0));
                let apart = (found.as_dvec4() / f64::from(found.w) - expected / expected.w).abs();
                off[0].note(apart.x * width, allowed.x, apart);
                off[1].note(apart.y * height, allowed.y, apart);
                off[2].note(apart.z, allowed.z, apart);
                let depth = Vec4::from_slice(&all[16..20]).dot(q.as_vec3().extend(1.0));
                // A chain of four products and three sums.
                let rounding = 3.0 * ulp * linear.abs().dot(q.abs().extend(1.0));
                row.note((f64::from(depth) - linear.dot(q.extend(1.0))).abs(), rounding, depth);
            }
            // Texels in v against those in u, by the convention; the filter's reach; and the
            // format's quantum.
            let texel = map.size().map(|size| 1.0 / size as f32);
            let sign = if space == ClipSpace::VULKAN.reversed() { -1.0 } else { 1.0 };
            assert_eq!(all[20..], [texel[0], texel[1], sign * 2.0, sign / 65535.0]);
        }
    });
    off.into_iter().for_each(Ratchet::finish);
    row.finish();
    random::check("no-linear-depth", 1, moderate(Kind::Any), |scene| {
        let map = scene.fit().solve(Rule::Uniform).unwrap();
        let lookup = map.lookup(map.origin(), ClipSpace::WGPU, Filter::Nearest(1), DepthFormat::Float32, None);
        assert_eq!(lookup.linear_depth.map(f32::to_bits), [0; 4]);
        assert_eq!(core::mem::size_of_val(&lookup), 96);
    });
}

/// Depths of a camera's projection in every convention, there and back; and the row of a reference.
#[test]
fn depths_read_back() {
    let spaces = [ClipSpace::WGPU, ClipSpace::WGPU.reversed(), ClipSpace::OPENGL];
    for (near, far) in [(0.1, 1000.0), (1.0, 1.5), (0.25, f64::INFINITY)] {
        // w = z, depth = (a z + b)/z with 0 at near and 1 at far.
        let a = 1.0 / (1.0 - near / far);
        for share in [0.0, 1e-3, 0.5, 1.0] {
            let z = if far.is_finite() { near + share * (far - near) } else { near * (1.0 + 100.0 * share) };
            let clip = DVec4::new(0.0, 0.0, a * (z - near), z);
            for space in spaces {
                let depth = clip.z / clip.w;
                let stored = match space.depth {
                    shadow_warp::DepthRange::ZeroToOne => depth,
                    shadow_warp::DepthRange::OneToZero => 1.0 - depth,
                    shadow_warp::DepthRange::NegativeOneToOne => 2.0 * depth - 1.0,
                };
                let found = space.view_depth(stored, near..far).unwrap();
                // Depths are crowded before the far plane.
                assert_relative_eq!(found, z, max_relative = 2.0 * f64::EPSILON * z / near);
            }
        }
    }
    let [gl, zero_to_one, reversed] =
        [(spaces[2], 0.75), (spaces[0], 0.75), (spaces[1], 0.25)].map(|(s, d)| s.view_depth(d, 0.1..1000.0).unwrap());
    // 2 f n/(f + n - d (f - n)), f n/(f - d (f - n)), f n/(n + d (f - n))
    // The difference has a fourth of its terms' size.
    assert_ulps_eq!(gl, 200.0 / (1000.1 - 0.75 * 999.9), max_ulps = 4);
    assert_ulps_eq!(zero_to_one, 100.0 / (1000.0 - 0.75 * 999.9), max_ulps = 2);
    assert_ulps_eq!(reversed, 100.0 / (0.1 + 0.25 * 999.9), max_ulps = 2);
    for (depth, range, argument) in
        [(f64::NAN, 0.1..1.0, "depth"), (0.5, 0.0..1.0, "near"), (0.5, f64::NAN..1.0, "near"), (0.5, 2.0..1.0, "far")]
    {
        let Err(Error::Invalid { argument: found, .. }) = ClipSpace::WGPU.view_depth(depth, range) else {
            unreachable!()
        };
        assert_eq!(found, argument);
    }
}
