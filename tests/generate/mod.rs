//! Deterministic generators of cameras, boxes and lights, near-degenerate on purpose.

#![allow(dead_code, reason = "each test file uses a part")]

use std::ops::Range;

use shadow_warp::glam::{DMat3, DVec3};
use shadow_warp::{Bounds, Lens, Sides, View};

/// Splitmix64.
pub(crate) struct Rng(u64);

impl Rng {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.range(0.0..1.0) < probability
    }

    pub(crate) fn range(&mut self, range: Range<f64>) -> f64 {
        range.start + (range.end - range.start) * ((self.next() >> 11) as f64 / (1_u64 << 53) as f64)
    }

    pub(crate) fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }

    pub(crate) fn sign(&mut self) -> f64 {
        self.pick(&[-1.0, 1.0])
    }

    /// Of about the same density per decade, between powers of 10.
    pub(crate) fn decades(&mut self, exponents: Range<i32>) -> f64 {
        let decade = exponents.start + self.below((exponents.end - exponents.start) as usize) as i32;
        let power = (0..decade.abs()).fold(1.0, |x, _| x * 10.0);
        self.range(1.0..10.0) * if decade < 0 { 1.0 / power } else { power }
    }

    /// A point in the box between two points.
    pub(crate) fn within(&mut self, low: DVec3, high: DVec3) -> DVec3 {
        let t = DVec3::new(self.range(0.0..1.0), self.range(0.0..1.0), self.range(0.0..1.0));
        (low + (high - low) * t).clamp(low, high)
    }

    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.within(DVec3::NEG_ONE, DVec3::ONE);
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }

    /// A signed axis of the world.
    pub(crate) fn axis(&mut self) -> DVec3 {
        let axis = self.pick(&DVec3::AXES);
        axis * self.sign()
    }

    /// A point inside the convex hull of points.
    pub(crate) fn mixture(&mut self, points: &[DVec3]) -> DVec3 {
        let mut mixture = self.pick(points);
        for _ in 0..4 {
            let t = self.range(0.0..1.0);
            mixture += (self.pick(points) - mixture) * t;
        }
        mixture
    }

    /// A shuffle of light, bodies and jitter: 1e-16 to 1e-9, or zero.
    pub(crate) fn jitter(&mut self) -> f64 {
        let size = self.decades(-16..-9);
        size * self.pick(&[-1.0, 1.0, 1.0, 0.0])
    }
}

/// `default` times the environment variable `SHADOW_WARP_CASES`, for long runs.
pub(crate) fn cases(default: usize) -> usize {
    let scale = std::env::var("SHADOW_WARP_CASES").map_or(1, |s| s.parse::<usize>().unwrap());
    assert!(scale > 0, "SHADOW_WARP_CASES must be positive");
    default * scale
}

/// What is peculiar to a camera and a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Class {
    Realistic,
    PlaneThroughVertex,
    PlaneThroughEdge,
    Coplanar,
    CoplanarJitter,
    FlatBox,
    LineBox,
    PointBox,
    TouchVertex,
    TouchEdge,
    TouchFace,
    EyeInside,
    EyeOnFace,
    EyeOnCorner,
    NearOnFace,
    FarInfinite,
    FarRatio,
    NarrowField,
    WideField,
    OffCentre,
    Orthographic,
    Mirrored,
    WorldOffset,
    Tiny,
    Huge,
    Outside,
}

impl Class {
    #[rustfmt::skip]
    pub(crate) const ALL: [Self; 26] = [
        Self::Realistic, Self::PlaneThroughVertex, Self::PlaneThroughEdge, Self::Coplanar, Self::CoplanarJitter,
        Self::FlatBox, Self::LineBox, Self::PointBox, Self::TouchVertex, Self::TouchEdge, Self::TouchFace,
        Self::EyeInside, Self::EyeOnFace, Self::EyeOnCorner, Self::NearOnFace, Self::FarInfinite, Self::FarRatio,
        Self::NarrowField, Self::WideField, Self::OffCentre, Self::Orthographic, Self::Mirrored, Self::WorldOffset,
        Self::Tiny, Self::Huge, Self::Outside,
    ];

    /// Whether the box has no volume.
    pub(crate) fn is_flat(self) -> bool {
        matches!(self, Self::FlatBox | Self::LineBox | Self::PointBox)
    }

    /// Whether box and view volume meet in their borders only.
    pub(crate) fn touches(self) -> bool {
        matches!(self, Self::TouchVertex | Self::TouchEdge | Self::TouchFace)
    }
}

/// The pieces of a camera, before they are validated.
struct Pieces {
    eye: DVec3,
    forward: DVec3,
    up: DVec3,
    lens: Lens,
    depth: Range<f64>,
}

impl Pieces {
    /// A camera in and around a box: near 0.1 to 1, far 70 to 10,000 or infinite, field of view 30 to 100 degrees.
    fn realistic(rng: &mut Rng, low: DVec3, high: DVec3) -> Self {
        let extent = high - low;
        let unit = extent.max_element() / 400.0;
        let unit = if unit > 0.0 { unit } else { 1.0 };
        let around = (0.2 * extent).max(DVec3::splat(20.0 * unit));
        let eye = rng.within(low - around, high + around);
        // Towards a point of the box, mostly, so that most boxes are seen.
        let aim = rng.within(low, high) - eye;
        let forward = if rng.chance(0.8) && aim.length() > unit { aim.normalize() } else { rng.direction() };
        let tangent = rng.range(0.27..1.19);
        let aspect = rng.pick(&[1.0, 4.0 / 3.0, 16.0 / 9.0]);
        let far = if rng.chance(0.2) { f64::INFINITY } else { rng.range(70.0..1000.0) * rng.pick(&[1.0, 10.0]) };
        let lens = Lens::Perspective(Sides::centred(2.0 * aspect * tangent, 2.0 * tangent));
        Self { eye, forward, up: upright(forward), lens, depth: rng.range(0.1..1.0) * unit..far * unit }
    }

    fn view(self) -> View {
        let Self { eye, forward, up, lens, depth } = self;
        match lens {
            Lens::Perspective(sides) => View::perspective_off_centre(eye, forward, up, sides, depth).unwrap(),
            Lens::Orthographic(sides) => View::orthographic(eye, forward, up, sides, depth).unwrap(),
        }
    }
}

fn upright(forward: DVec3) -> DVec3 {
    if forward.y.abs() < 0.99 { DVec3::Y } else { DVec3::X }
}

/// The corner of a box; bit `a` of `v` chooses the greater end of axis `a`.
pub(crate) fn corner(low: DVec3, high: DVec3, v: usize) -> DVec3 {
    let end = |axis: usize| if v >> axis & 1 == 0 { low[axis] } else { high[axis] };
    DVec3::new(end(0), end(1), end(2))
}

/// Returns a camera and a box of a class.
pub(crate) fn camera_and_box(rng: &mut Rng, class: Class) -> (View, Bounds) {
    let scale = match class {
        Class::Tiny => 1e-6 / 400.0,
        Class::Huge => 1e12 / 400.0,
        _ => 1.0,
    };
    let extent = DVec3::new(400.0, rng.range(20.0..80.0), 400.0) * scale;
    let centre = rng.within(-extent, extent);
    let centre = if class == Class::WorldOffset {
        centre + 1e7 * rng.within(DVec3::NEG_ONE, DVec3::ONE).round()
    } else {
        centre
    };
    let (low, mut high) = (centre - 0.5 * extent, centre + 0.5 * extent);
    let first = rng.below(3);
    let flat_axes = match class {
        Class::FlatBox => 1,
        Class::LineBox => 2,
        Class::PointBox => 3,
        _ => 0,
    };
    for axis in (first..first + flat_axes).map(|axis| axis % 3) {
        high[axis] = low[axis];
    }
    let pieces = pieces(rng, class, low, high);
    let view = pieces.view();
    let view = if class == Class::Mirrored { view.mirrored() } else { view };
    (view, Bounds::new(low, high).unwrap())
}

fn pieces(rng: &mut Rng, class: Class, low: DVec3, high: DVec3) -> Pieces {
    let mut pieces = Pieces::realistic(rng, low, high);
    let middle = 0.5 * (low + high);
    let size = (high - low).max_element();
    let wide = |tangent: f64| Lens::Perspective(Sides::centred(2.0 * tangent, 2.0 * tangent));
    match class {
        Class::PlaneThroughVertex | Class::PlaneThroughEdge => {
            // Sides through the pictures of two corners. Square to the box, the corners' edges lie in the sides'
            // planes too.
            let square = class == Class::PlaneThroughEdge;
            pieces.forward = if square { rng.axis() } else { rng.direction() };
            pieces.up = upright(pieces.forward);
            pieces.eye = middle - pieces.forward * (size * rng.range(1.0..3.0)) + 0.3 * size * rng.direction();
            let frame = frame(&pieces);
            let tangents: Vec<DVec3> = (0..8)
                .map(|v| frame.transpose() * (corner(low, high, v) - pieces.eye))
                .map(|p| DVec3::new(p.x / p.z, p.y / p.z, p.z))
                .filter(|t| t.z > 0.0)
                .collect();
            let ordered = |a: f64, b: f64| if (a - b).abs() > 1e-3 { (a.min(b), a.max(b)) } else { (a, a + 0.3) };
            let (a, b) = (rng.pick(&tangents), rng.pick(&tangents));
            let ((left, right), (bottom, top)) = (ordered(a.x, b.x), ordered(a.y, b.y));
            pieces.lens = Lens::Perspective(Sides { left, right, bottom, top });
            pieces.depth.end = f64::INFINITY;
        }
        Class::Coplanar | Class::CoplanarJitter | Class::TouchVertex | Class::TouchEdge | Class::TouchFace => {
            boxed_volume(rng, class, low, high, &mut pieces);
        }
        Class::EyeInside => pieces.eye = rng.within(low, high),
        Class::EyeOnFace => {
            let axis = rng.below(3);
            pieces.eye = rng.within(low, high);
            pieces.eye[axis] = rng.pick(&[low[axis], high[axis]]);
        }
        Class::EyeOnCorner => {
            pieces.eye = corner(low, high, rng.below(8));
            if rng.chance(0.5) {
                pieces.forward = (middle - pieces.eye).normalize();
            }
        }
        Class::NearOnFace => {
            pieces.forward = rng.axis();
            pieces.up = upright(pieces.forward);
            let near = f64::from(1 << rng.below(6));
            let face = corner(low, high, rng.pick(&[0, 7])).dot(pieces.forward);
            pieces.eye += pieces.forward * (face - near - pieces.eye.dot(pieces.forward));
            // As the library sees it: from the eye's own, rounded position.
            pieces.depth = face - pieces.eye.dot(pieces.forward)..1e4;
        }
        Class::FarInfinite => pieces.depth.end = f64::INFINITY,
        Class::FarRatio => pieces.depth = 1e-3..1e4,
        Class::NarrowField | Class::WideField => {
            // Tangents of half of 0.001 and of 179.9 degrees.
            pieces.forward = (rng.within(low, high) - pieces.eye).normalize();
            pieces.up = upright(pieces.forward);
            pieces.lens = wide(if class == Class::NarrowField { 8.726_646_259_971_65e-6 } else { 1_145.915_298_950_4 });
        }
        Class::OffCentre => {
            let (left, bottom) = (rng.range(-2.0..1.0), rng.range(-2.0..1.0));
            let (right, top) = (left + rng.range(0.1..2.0), bottom + rng.range(0.1..2.0));
            pieces.lens = Lens::Perspective(Sides { left, right, bottom, top });
        }
        Class::Orthographic => {
            let (width, height) = (rng.range(0.1..1.5) * size, rng.range(0.1..1.5) * size);
            pieces.lens = Lens::Orthographic(Sides::centred(width, height));
            pieces.depth.start = rng.range(-0.5..0.5) * size;
            pieces.depth.end = pieces.depth.start + rng.range(0.1..2.0) * size;
        }
        Class::Outside => {
            let away = rng.axis();
            pieces.eye = middle + away * (1.5 * size);
            pieces.forward = away;
            pieces.up = upright(away);
            pieces.lens = wide(1.0);
        }
        _ => {}
    }
    pieces
}

/// An orthographic camera square to the box: its volume is a box with faces in the planes of the other one's, tilted
/// and moved by a jitter, or one that it touches in a face, an edge or a vertex.
fn boxed_volume(rng: &mut Rng, class: Class, low: DVec3, high: DVec3, pieces: &mut Pieces) {
    let size = (high - low).max_element();
    let touching = match class {
        Class::TouchFace => 1,
        Class::TouchEdge => 2,
        Class::TouchVertex => 3,
        _ => 0,
    };
    pieces.forward = rng.axis();
    pieces.up = upright(pieces.forward);
    // Whole numbers, so that the volume's planes meet the box without rounding.
    pieces.eye = corner(low, high, rng.below(8));
    let frame = frame(pieces);
    let (a, b) = (frame.transpose() * (low - pieces.eye), frame.transpose() * (high - pieces.eye));
    let (near_corner, far_corner) = (a.min(b), a.max(b));
    let first = rng.below(3);
    let mut sides = [[0.0; 2]; 3];
    for axis in 0..3 {
        let (low, high) = (near_corner[axis], far_corner[axis]);
        let extent = high - low;
        let touches = (axis + 3 - first) % 3 < touching;
        sides[axis] = if touches {
            if rng.chance(0.5) { [high, high + 0.5 * size] } else { [low - 0.5 * size, low] }
        } else {
            let inset = [0.0, 0.0, 0.25, -0.25];
            [low + extent * rng.pick(&inset), high - extent * rng.pick(&inset)]
        };
    }
    if class == Class::CoplanarJitter {
        pieces.forward += rng.jitter() * rng.direction();
        pieces.up += rng.jitter() * rng.direction();
        for side in sides.as_flattened_mut() {
            *side += rng.jitter() * size;
        }
    }
    let [[left, right], [bottom, top], [near, far]] = sides;
    pieces.lens = Lens::Orthographic(Sides { left, right, bottom, top });
    pieces.depth = near..far;
}

/// The camera's axes: right, up, forward.
fn frame(pieces: &Pieces) -> DMat3 {
    let right = pieces.forward.cross(pieces.up).normalize();
    DMat3::from_cols(right, right.cross(pieces.forward), pieces.forward)
}
