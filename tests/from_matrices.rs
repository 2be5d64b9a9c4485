//! A camera read back from the two matrices that an engine keeps, in the conventions of every interface.

#![expect(clippy::unwrap_used, reason = "a camera that cannot be built is a broken test")]

mod random;

use proptest::option::weighted;
use proptest::prelude::*;
use proptest::sample::select;
use random::basic::{direction, inside, log_between};
use random::{Ratchet, check};
use shadow_warp::glam::{DMat4, DVec3, DVec4};
use shadow_warp::{ClipSpace, DepthRange, Lens, Plane, Sides, View};

const SPACES: [ClipSpace; 7] = [
    ClipSpace::WGPU,
    ClipSpace::VULKAN,
    ClipSpace::OPENGL,
    ClipSpace::OPENGL_ZERO_TO_ONE,
    ClipSpace::WGPU.reversed(),
    ClipSpace::VULKAN.reversed(),
    ClipSpace::OPENGL.reversed(),
];

/// The rigid motion into eye space, which looks along its z axis or against it.
fn motion(view: &View, sense: f64) -> DMat4 {
    let axes = [view.right(), view.up(), sense * view.forward()];
    DMat4::from_cols(
        axes[0].extend(-axes[0].dot(view.eye())),
        axes[1].extend(-axes[1].dot(view.eye())),
        axes[2].extend(-axes[2].dot(view.eye())),
        DVec4::W,
    )
    .transpose()
}

/// The projection, from what it must do to the volume's sides and ends; `scale` multiplies all of it.
fn projection(view: &View, space: ClipSpace, sense: f64, scale: f64) -> DMat4 {
    let (near_depth, far_depth) = match space.depth {
        DepthRange::ZeroToOne => (0.0, 1.0),
        DepthRange::OneToZero => (1.0, 0.0),
        DepthRange::NegativeOneToOne => (-1.0, 1.0),
    };
    let (near, far) = (view.near(), view.far());
    let y_sign = if space.y_down { -1.0 } else { 1.0 };
    let (Lens::Perspective(s) | Lens::Orthographic(s)) = view.lens();
    let (x_scale, y_scale) = (2.0 / (s.right - s.left), y_sign * 2.0 / (s.top - s.bottom));
    let (x_middle, y_middle) = (-0.5 * (s.left + s.right) * x_scale, -0.5 * (s.bottom + s.top) * y_scale);
    let rows = if view.is_perspective() {
        let constant = (near_depth - far_depth) / (1.0 / near - 1.0 / far);
        let slope = near_depth - constant / near;
        let slope = if far == f64::INFINITY { far_depth } else { slope };
        [
            DVec4::new(x_scale, 0.0, sense * x_middle, 0.0),
            DVec4::new(0.0, y_scale, sense * y_middle, 0.0),
            DVec4::new(0.0, 0.0, sense * slope, constant),
            DVec4::new(0.0, 0.0, sense, 0.0),
        ]
    } else {
        let slope = (far_depth - near_depth) / (far - near);
        [
            DVec4::new(x_scale, 0.0, 0.0, x_middle),
            DVec4::new(0.0, y_scale, 0.0, y_middle),
            DVec4::new(0.0, 0.0, sense * slope, near_depth - slope * near),
            DVec4::W,
        ]
    };
    let [x, y, z, w] = rows.map(|row| row * scale);
    DMat4::from_cols(x, y, z, w).transpose()
}

/// A camera of any kind.
fn camera() -> impl Strategy<Value = View> + Clone {
    let depth = (log_between(1e-2, 10.0), weighted(0.5, log_between(1.5, 1e5)));
    let size = (log_between(0.1, 3.0), log_between(0.1, 3.0), weighted(0.5, -1.0..1.0));
    let kind = (any::<bool>(), weighted(0.25, Just(())));
    (direction(), direction(), inside(1e3), depth, size, kind).prop_map(
        |(forward, up, eye, (near, far), (width, height, aside), (mirrored, orthographic)): Camera| {
            let up = if up.cross(forward).length() > 1e-6 { up } else { forward.any_orthonormal_vector() };
            let far = far.map_or(f64::INFINITY, |far| near * far);
            let sides = Sides::centred(width, height);
            let sides = aside.map_or(sides, |aside| Sides {
                left: sides.left + aside,
                right: sides.right + aside,
                top: sides.top + 0.3,
                ..sides
            });
            let view = if orthographic.is_some() {
                // No matrix can have an infinite extent without perspective.
                View::orthographic(eye, forward, up, sides, -near..near * 30.0)
            } else {
                View::perspective_off_centre(eye, forward, up, sides, near..far)
            };
            let view = view.unwrap();
            if mirrored { view.mirrored() } else { view }
        },
    )
}

/// Forward, up, eye; near and far; width, height and shift; whether it is mirrored, and orthographic.
type Camera = (DVec3, DVec3, DVec3, (f64, Option<f64>), (f64, f64, Option<f64>), (bool, Option<()>));

/// How far two planes are apart, relative to the size of their offsets.
fn apart(a: &Plane, b: &Plane) -> f64 {
    let offset = (a.offset() - b.offset()).abs() / b.offset().abs().max(1.0);
    a.normal().distance(b.normal()).max(offset)
}

#[test]
fn round_trip() {
    let (mut planes, mut far) = (Ratchet::new("planes of a read camera"), Ratchet::new("its far plane"));
    let (mut eye, mut near) = (Ratchet::new("its eye"), Ratchet::new("its near distance"));
    for space in SPACES {
        let more = (any::<bool>(), select(vec![1.0, 0.125, 3.0]));
        check(&format!("read/{space:?}"), 400, (camera(), more), |(view, (negative, scale))| {
            let sense = if negative { -1.0 } else { 1.0 };
            let read =
                View::from_matrices(motion(&view, sense), projection(&view, space, sense, scale), space).unwrap();

            assert_eq!(read.is_perspective(), view.is_perspective());
            assert!(read.right().dot(view.right()) > 0.0, "the picture is mirrored");
            assert_eq!(read.planes().len(), view.planes().len(), "{:?} {:?}", view.far(), read.far());
            eye.note(read.eye().distance(view.eye()), 2e-12, read);
            // The far plane is the only one that loses more than rounding.
            let far_rounding = if view.far() == f64::INFINITY { 0.0 } else { view.far() / view.near().abs() };
            for (a, b) in read.planes().iter().zip(view.planes()) {
                if b.normal() == view.forward() {
                    far.note(apart(a, b), 2e-15 * (1.0 + far_rounding), read);
                } else {
                    planes.note(apart(a, b), 1e-14, read);
                }
            }
            near.note((read.near() - view.near()).abs() / view.near().abs(), 1e-14, read);
        });
    }
    for ratchet in [planes, far, eye, near] {
        ratchet.finish();
    }
}

/// What a matrix of f32 loses is as stated: some 6 % of a far distance of 1e6 times the near one, and of the eye one
/// rounding of its distance to the origin.
#[test]
fn rounded_matrices_lose_what_is_stated() {
    let (mut far_lost, mut eye_lost) = (Ratchet::new("far distance in f32"), Ratchet::new("eye in f32"));
    let mut near_lost = Ratchet::new("near distance in f32");
    let space = select(vec![ClipSpace::WGPU, ClipSpace::OPENGL]);
    let strategy = (log_between(0.01, 10.0), inside(1e7), direction(), direction(), space);
    check("read-f32", 500, strategy, |(near, eye, forward, up, space)| {
        let up = if up.cross(forward).length() > 1e-6 { up } else { forward.any_orthonormal_vector() };
        let view = View::perspective(eye, forward, up, 1.0, 1.5, near..near * 1e6).unwrap();
        let [motion, projection] = [motion(&view, -1.0), projection(&view, space, -1.0, 1.0)];
        let read = View::from_matrices(motion, projection.as_mat4().as_dmat4(), space).unwrap();
        far_lost.note((read.far() / view.far() - 1.0).abs(), 0.065, read);
        near_lost.note((read.near() / view.near() - 1.0).abs(), 5e-7, read);
        let read = View::from_matrices(motion.as_mat4().as_dmat4(), projection, space).unwrap();
        eye_lost.note((read.eye() - view.eye()).abs().max_element(), 3.0, read);
    });
    for ratchet in [far_lost, near_lost, eye_lost] {
        ratchet.finish();
    }
    // Beyond what f32 can tell, the far plane is read as infinitely far; reversed depth goes further.
    let view = View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, 1.0, 1.0, 0.1..1e8).unwrap();
    for (space, far) in [(ClipSpace::WGPU, f64::INFINITY), (ClipSpace::WGPU.reversed(), 1e8)] {
        let projection = projection(&view, space, 1.0, 1.0).as_mat4().as_dmat4();
        let read = View::from_matrices(motion(&view, 1.0), projection, space).unwrap();
        // The reciprocal is 0 for infinity.
        assert!((far.recip() - read.far().recip()).abs() < 1e-14, "{} {far}", read.far());
    }
}

/// Matrices as they are printed in the interfaces' own documents, entry by entry.
#[test]
fn printed_matrices() {
    // glFrustum(-1, 3, -1, 1, 2, 10).
    let gl = DMat4::from_cols(
        DVec4::new(1.0, 0.0, 0.0, 0.0),
        DVec4::new(0.0, 2.0, 0.0, 0.0),
        DVec4::new(0.5, 0.0, -1.5, -1.0),
        DVec4::new(0.0, 0.0, -5.0, 0.0),
    );
    // D3DXMatrixPerspectiveOffCenterLH(-1, 3, -1, 1, 2, 10), for column vectors.
    let d3d = DMat4::from_cols(
        DVec4::new(1.0, 0.0, 0.0, 0.0),
        DVec4::new(0.0, 2.0, 0.0, 0.0),
        DVec4::new(-0.5, 0.0, 1.25, 1.0),
        DVec4::new(0.0, 0.0, -2.5, 0.0),
    );
    for (projection, space, forward) in [(gl, ClipSpace::OPENGL, DVec3::NEG_Z), (d3d, ClipSpace::DIRECT3D, DVec3::Z)] {
        let view = View::from_matrices(DMat4::IDENTITY, projection, space).unwrap();
        assert_eq!((view.forward(), view.up(), view.right()), (forward, DVec3::Y, DVec3::X));
        assert_eq!((view.near(), view.far()), (2.0, 10.0));
        assert_eq!(view.lens(), Lens::Perspective(Sides { left: -0.5, right: 1.5, bottom: -0.5, top: 0.5 }));
    }
}
