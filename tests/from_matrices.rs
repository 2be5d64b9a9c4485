//! A camera read back from the two matrices that an engine keeps, in the conventions of every interface.

#![expect(clippy::unwrap_used, reason = "a camera that cannot be built is a broken test")]

mod scenes;

use scenes::random::Random;
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

/// A camera of any kind: number `kind` of eight.
fn camera(random: &mut Random, kind: usize) -> View {
    let forward = random.direction();
    let eye = random.inside(1e3);
    let near = random.log_between(1e-2, 10.0);
    let far = if kind & 1 == 0 { near * random.log_between(1.5, 1e5) } else { f64::INFINITY };
    let mut sides = Sides::centred(random.log_between(0.1, 3.0), random.log_between(0.1, 3.0));
    if kind & 2 != 0 {
        let aside = random.between(-1.0, 1.0);
        sides = Sides { left: sides.left + aside, right: sides.right + aside, top: sides.top + 0.3, ..sides };
    }
    let view = if random.below(4) == 0 {
        // No matrix can have an infinite extent without perspective.
        View::orthographic(eye, forward, random.direction(), sides, -near..near * 30.0)
    } else {
        View::perspective_off_centre(eye, forward, random.direction(), sides, near..far)
    };
    let view = view.unwrap();
    if kind & 4 == 0 { view } else { view.mirrored() }
}

/// How far two planes are apart, relative to the size of their offsets.
fn apart(a: &Plane, b: &Plane) -> f64 {
    let offset = (a.offset() - b.offset()).abs() / b.offset().abs().max(1.0);
    a.normal().distance(b.normal()).max(offset)
}

#[test]
fn round_trip() {
    let (mut worst_plane, mut worst_far, mut worst_eye) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut orthographic = 0;
    for case in 0..4000 {
        let mut random = Random::new(case);
        let view = camera(&mut random, case as usize % 8);
        let space = SPACES[case as usize / 8 % SPACES.len()];
        let sense = if random.below(2) == 0 { 1.0 } else { -1.0 };
        let scale = [1.0, 0.125, 3.0][random.below(3)];
        let read = View::from_matrices(motion(&view, sense), projection(&view, space, sense, scale), space).unwrap();

        assert_eq!(read.is_perspective(), view.is_perspective());
        assert!(read.right().dot(view.right()) > 0.0, "{case}: the picture is mirrored");
        assert_eq!(read.planes().len(), view.planes().len(), "{case} {:?} {:?}", view.far(), read.far());
        worst_eye = worst_eye.max(read.eye().distance(view.eye()));
        // The far plane is the only one that loses more than rounding.
        let far_rounding = if view.far() == f64::INFINITY { 0.0 } else { view.far() / view.near().abs() };
        for (a, b) in read.planes().iter().zip(view.planes()) {
            let is_far = b.normal() == view.forward();
            let apart = apart(a, b) / if is_far { 1.0 + far_rounding } else { 1.0 };
            *(if is_far { &mut worst_far } else { &mut worst_plane }) =
                apart.max(if is_far { worst_far } else { worst_plane });
        }
        worst_plane = worst_plane.max((read.near() - view.near()).abs() / view.near().abs());
        orthographic += u32::from(!view.is_perspective());
    }
    println!("planes {worst_plane:e}, far plane {worst_far:e} far/near, eye {worst_eye:e}");
    assert!(worst_plane < 1e-14, "{worst_plane:e}");
    assert!(worst_far < 2e-15, "{worst_far:e}");
    assert!(worst_eye < 2e-12, "{worst_eye:e}");
    assert!(orthographic > 800);
}

/// What a matrix of f32 loses is as stated: some 6 % of a far distance of 1e6 times the near one, and of the eye one
/// rounding of its distance to the origin.
#[test]
fn rounded_matrices_lose_what_is_stated() {
    let (mut far_lost, mut eye_lost) = (0.0_f64, 0.0_f64);
    for case in 0..500 {
        let mut random = Random::new(case);
        let (near, eye) = (random.log_between(0.01, 10.0), random.inside(1e7));
        let view = View::perspective(eye, random.direction(), random.direction(), 1.0, 1.5, near..near * 1e6).unwrap();
        let space = [ClipSpace::WGPU, ClipSpace::OPENGL][case as usize % 2];
        let [motion, projection] = [motion(&view, -1.0), projection(&view, space, -1.0, 1.0)];
        let read = View::from_matrices(motion, projection.as_mat4().as_dmat4(), space).unwrap();
        far_lost = far_lost.max((read.far() / view.far() - 1.0).abs());
        assert!((read.near() / view.near() - 1.0).abs() < 1e-6);
        let read = View::from_matrices(motion.as_mat4().as_dmat4(), projection, space).unwrap();
        eye_lost = eye_lost.max((read.eye() - view.eye()).abs().max_element());
    }
    println!("far {far_lost}, eye {eye_lost}");
    assert!((0.02..0.065).contains(&far_lost), "{far_lost}");
    assert!((0.2..3.0).contains(&eye_lost), "{eye_lost}");
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
