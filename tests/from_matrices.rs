//! A camera read back from the two matrices that an engine keeps, in the conventions of every interface.

#![expect(clippy::unwrap_used, reason = "a camera that cannot be built is a broken test")]

mod random;

use approx::assert_relative_eq;
use random::basic::{direction, inside, log_between, signed};
use random::{Ratchet, Strategy, check, prop};
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

/// A kind of camera.
#[derive(Clone, Copy, Debug)]
struct Kind {
    is_perspective: bool,
    is_infinite: bool,
    is_centred: bool,
    is_mirrored: bool,
}

/// A camera of a kind: near 1 and far 1.5 at the origin, looking along x, where it is simplest.
fn camera(kind: Kind) -> impl Strategy<Value = View> {
    let lens = (log_between(0.1, 3.0), log_between(0.1, 3.0), signed());
    let pieces = (inside(1e3), direction(), direction(), lens, log_between(0.01, 10.0), log_between(1.5, 1e5));
    pieces.prop_filter_map("up along forward", move |(eye, forward, up, (width, height, aside), near, depth)| {
        let mut sides = Sides::centred(width, height);
        if !kind.is_centred {
            sides = Sides { left: sides.left + aside, right: sides.right + aside, top: sides.top + 0.3, ..sides };
        }
        let up = if up.cross(forward).length() > 1e-3 { up } else { forward.any_orthonormal_vector() };
        let far = if kind.is_infinite { f64::INFINITY } else { near * depth };
        let view = if kind.is_perspective {
            View::perspective_off_centre(eye, forward, up, sides, near..far)
        } else {
            View::orthographic(eye, forward, up, sides, -near..near * 30.0)
        };
        let view = view.ok()?;
        Some(if kind.is_mirrored { view.mirrored() } else { view })
    })
}

/// How far two planes are apart, relative to the size of their offsets.
fn apart(a: &Plane, b: &Plane) -> f64 {
    let offset = (a.offset() - b.offset()).abs() / b.offset().abs().max(1.0);
    a.normal().distance(b.normal()).max(offset)
}

#[test]
fn round_trip() {
    let mut near = Ratchet::new("near distance");
    let mut plane = Ratchet::new("planes");
    let mut far_plane = Ratchet::new("far plane, per far/near");
    let mut eye = Ratchet::new("eye, in roundings of its distance");
    for number in 0..12 {
        // No matrix can have an infinite extent without perspective.
        let (is_perspective, is_infinite) = (number < 8, number / 4 == 1);
        let kind = Kind { is_perspective, is_infinite, is_centred: number & 1 == 0, is_mirrored: number & 2 != 0 };
        let conventions = (prop::sample::select(&SPACES[..]), prop::sample::select(vec![1.0, -1.0]));
        let input = (camera(kind), conventions, prop::sample::select(vec![1.0, 0.125, 3.0]));
        check(&format!("from-matrices/{number}"), 200, input, |(view, (space, sense), scale)| {
            let matrices = (motion(&view, sense), projection(&view, space, sense, scale));
            let read = View::from_matrices(matrices.0, matrices.1, space).unwrap();
            assert_eq!(read.is_perspective(), kind.is_perspective);
            assert!(read.right().dot(view.right()) > 0.0, "the picture is mirrored");
            assert_eq!(read.planes().len(), view.planes().len(), "{} {}", view.far(), read.far());
            eye.note(read.eye().distance(view.eye()), 8.0 * f64::EPSILON * (1.0 + view.eye().length()), kind);
            near.note((read.near() - view.near()).abs(), 4e-15 * view.near().abs(), kind);
            // The far plane is the only one that loses more than rounding.
            for (a, b) in read.planes().iter().zip(view.planes()) {
                if b.normal() == view.forward() {
                    far_plane.note(apart(a, b), 1e-15 * (1.0 + view.far() / view.near().abs()), kind);
                } else {
                    plane.note(apart(a, b), 5e-15, kind);
                }
            }
        });
    }
}

/// What a matrix of f32 loses is as stated: some 6 % of a far distance of 1e6 times the near one, and of the eye one
/// rounding of its distance to the origin.
#[test]
fn rounded_matrices_lose_what_is_stated() {
    let mut near = Ratchet::new("near distance");
    let mut far = Ratchet::new("far distance");
    let mut eye = Ratchet::new("eye, in roundings of its distance");
    let input = (log_between(0.01, 10.0), inside(1e7), direction(), direction(), prop::bool::ANY);
    check("from-matrices/f32", 500, input, |(n, place, forward, up, opengl)| {
        let Ok(view) = View::perspective(place, forward, up, 1.0, 1.5, n..n * 1e6) else { return };
        let space = if opengl { ClipSpace::OPENGL } else { ClipSpace::WGPU };
        let [motion, projection] = [motion(&view, -1.0), projection(&view, space, -1.0, 1.0)];
        let read = View::from_matrices(motion, projection.as_mat4().as_dmat4(), space).unwrap();
        far.note((read.far() / view.far() - 1.0).abs(), 0.065, view);
        near.note((read.near() / view.near() - 1.0).abs(), 4.0 * f64::from(f32::EPSILON), view);
        let read = View::from_matrices(motion.as_mat4().as_dmat4(), projection, space).unwrap();
        let rounding = f64::from(f32::EPSILON) * view.eye().length();
        eye.note(read.eye().distance(view.eye()), rounding, view);
    });
    // Beyond what f32 can tell, the far plane is read as infinitely far; reversed depth goes further.
    let view = View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, 1.0, 1.0, 0.1..1e8).unwrap();
    let read = |space| {
        let projection = projection(&view, space, 1.0, 1.0).as_mat4().as_dmat4();
        View::from_matrices(motion(&view, 1.0), projection, space).unwrap().far()
    };
    assert!(read(ClipSpace::WGPU).is_infinite());
    assert_relative_eq!(read(ClipSpace::WGPU.reversed()), 1e8, max_relative = f64::from(f32::EPSILON));
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
