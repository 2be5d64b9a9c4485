//! Strategies for cameras and boxes, near-degenerate on purpose, a class at a time.

use core::ops::Range;

use proptest::prelude::*;
use shadow_warp::glam::{DMat3, DVec3};
use shadow_warp::{Bounds, Lens, Sides, View};

use super::basic::{axis, direction, inside, jitter, log_between, shares, unit};

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
}

/// The corner of a box; bit `a` of `v` chooses the greater end of axis `a`.
pub(crate) fn corner(low: DVec3, high: DVec3, v: usize) -> DVec3 {
    let end = |axis: usize| if v >> axis & 1 == 0 { low[axis] } else { high[axis] };
    DVec3::new(end(0), end(1), end(2))
}

/// A camera and a box of a class. Shrinks to a camera at the origin that looks along x, with depths from 1 to 1.5, in a
/// flat box about it.
pub(crate) fn camera_and_box(class: Class) -> impl Strategy<Value = (View, Bounds)> {
    choices().prop_map(move |choices| choices.camera_and_box(class))
}

/// Independent choices, enough for each class.
#[derive(Clone, Copy, Debug)]
struct Choices {
    centre: DVec3,
    eye: DVec3,
    aim: DVec3,
    stray: bool,
    directions: [DVec3; 2],
    axis: DVec3,
    tangent: f64,
    aspect: f64,
    near: f64,
    far: f64,
    shares: [DVec3; 2],
    corners: [usize; 2],
    first: usize,
    insets: [f64; 6],
    coins: [bool; 3],
    tilts: [DVec3; 2],
    jitters: [f64; 6],
}

fn choices() -> impl Strategy<Value = Choices> {
    let aspects = prop::sample::select(vec![1.0, 4.0 / 3.0, 16.0 / 9.0]);
    let far = prop_oneof![4 => log_between(1.5, 1e4), 1 => Just(f64::INFINITY)];
    let lens = (unit(), aspects, unit(), far);
    let around = (inside(1.0), inside(1.0), inside(1.0), prop::bool::weighted(0.2), [direction(), direction()], axis());
    let inset = prop::sample::select(vec![0.0, 0.0, 0.25, -0.25]);
    let tilt = (jitter(), direction()).prop_map(|(size, direction)| size * direction);
    let details = (
        [shares(), shares()],
        [0..8_usize, 0..8],
        0..3_usize,
        prop::array::uniform6(inset),
        any::<[bool; 3]>(),
        [tilt.clone(), tilt],
        prop::array::uniform6(jitter()),
    );
    (around, lens, details).prop_map(|(around, lens, details)| {
        let (centre, eye, aim, stray, directions, axis) = around;
        let (narrower, aspect, nearer, far) = lens;
        let (tangent, near) = (1.0 - 0.73 * narrower, 1.0 - 0.9 * nearer);
        let (shares, corners, first, insets, coins, tilts, jitters) = details;
        #[rustfmt::skip]
        let all = Choices {
            centre, eye, aim, stray, directions, axis, tangent, aspect, near, far, shares, corners, first, insets,
            coins, tilts, jitters,
        };
        all
    })
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
    /// The camera's axes: right, up, forward.
    fn frame(&self) -> DMat3 {
        let right = self.forward.cross(self.up).normalize();
        DMat3::from_cols(right, right.cross(self.forward), self.forward)
    }

    fn look_along(&mut self, forward: DVec3) {
        (self.forward, self.up) = (forward, upright(forward));
    }

    fn view(self) -> View {
        let Self { eye, forward, up, lens, depth } = self;
        let view = match lens {
            Lens::Perspective(sides) => View::perspective_off_centre(eye, forward, up, sides, depth),
            Lens::Orthographic(sides) => View::orthographic(eye, forward, up, sides, depth),
        };
        view.expect("the pieces of a camera")
    }
}

fn upright(forward: DVec3) -> DVec3 {
    if forward.y.abs() < 0.99 { DVec3::Y } else { DVec3::X }
}

fn square(tangent: f64) -> Lens {
    Lens::Perspective(Sides::centred(2.0 * tangent, 2.0 * tangent))
}

impl Choices {
    fn camera_and_box(&self, class: Class) -> (View, Bounds) {
        let scale = match class {
            Class::Tiny => 1e-6 / 400.0,
            Class::Huge => 1e12 / 400.0,
            _ => 1.0,
        };
        let extent = DVec3::new(400.0, 20.0 + 60.0 * self.shares[0].y, 400.0) * scale;
        let mut centre = self.centre * extent;
        if class == Class::WorldOffset {
            centre += 1e7 * (self.axis + 2.0 * self.centre.round());
        }
        let (low, mut high) = (centre - 0.5 * extent, centre + 0.5 * extent);
        let flat_axes = match class {
            Class::FlatBox => 1,
            Class::LineBox => 2,
            Class::PointBox => 3,
            _ => 0,
        };
        for axis in (self.first..self.first + flat_axes).map(|axis| axis % 3) {
            high[axis] = low[axis];
        }
        let view = self.pieces(class, low, high).view();
        let view = if class == Class::Mirrored { view.mirrored() } else { view };
        (view, Bounds::new(low, high).expect("an ordered box"))
    }

    /// A camera in and around a box, which it looks at in four cases of five.
    fn realistic(&self, low: DVec3, high: DVec3) -> Pieces {
        let (extent, middle) = (high - low, 0.5 * (low + high));
        let unit = extent.max_element() / 400.0;
        let unit = if unit > 0.0 { unit } else { 1.0 };
        let eye = middle + self.eye * (0.5 * extent + (0.2 * extent).max(DVec3::splat(20.0 * unit)));
        let aim = middle + 0.5 * self.aim * extent - eye;
        let forward = if self.stray || aim.length() <= unit { self.directions[0] } else { aim.normalize() };
        let lens = Lens::Perspective(Sides::centred(2.0 * self.aspect * self.tangent, 2.0 * self.tangent));
        Pieces { eye, forward, up: upright(forward), lens, depth: self.near * unit..self.far * unit }
    }

    fn pieces(&self, class: Class, low: DVec3, high: DVec3) -> Pieces {
        let mut pieces = self.realistic(low, high);
        let middle = 0.5 * (low + high);
        let size = (high - low).max_element();
        let place = low + (high - low) * self.shares[1];
        let [s, t] = self.shares;
        match class {
            Class::PlaneThroughVertex | Class::PlaneThroughEdge => {
                // Sides through the pictures of two corners. Square to the box, the corners' edges lie in the sides'
                // planes too.
                pieces.look_along(if class == Class::PlaneThroughEdge { self.axis } else { self.directions[0] });
                pieces.eye = middle - pieces.forward * (size * (1.0 + 2.0 * s.x)) + 0.3 * size * self.directions[1];
                let local = pieces.frame().transpose();
                let picture = |v: usize| local * (corner(low, high, v) - pieces.eye);
                let pictures: Vec<_> = (0..8).map(picture).filter(|p| p.z > 0.0).map(|p| p / p.z).collect();
                let ordered = |a: f64, b: f64| if (a - b).abs() > 1e-3 { (a.min(b), a.max(b)) } else { (a, a + 0.3) };
                let [a, b] = self.corners.map(|v| pictures[v % pictures.len()]);
                let ((left, right), (bottom, top)) = (ordered(a.x, b.x), ordered(a.y, b.y));
                pieces.lens = Lens::Perspective(Sides { left, right, bottom, top });
                pieces.depth.end = f64::INFINITY;
            }
            Class::Coplanar | Class::CoplanarJitter => self.boxed_volume(class, 0, low, high, &mut pieces),
            Class::TouchFace => self.boxed_volume(class, 1, low, high, &mut pieces),
            Class::TouchEdge => self.boxed_volume(class, 2, low, high, &mut pieces),
            Class::TouchVertex => self.boxed_volume(class, 3, low, high, &mut pieces),
            Class::EyeInside => pieces.eye = place,
            Class::EyeOnFace => {
                pieces.eye = place;
                pieces.eye[self.first] = corner(low, high, self.corners[0])[self.first];
            }
            Class::EyeOnCorner => {
                pieces.eye = corner(low, high, self.corners[0]);
                if self.coins[0] {
                    pieces.forward = (middle - pieces.eye).normalize();
                }
            }
            Class::NearOnFace => {
                pieces.look_along(self.axis);
                let near = f64::from(1 << (self.corners[0] % 6));
                let face = (if self.coins[0] { high } else { low }).dot(pieces.forward);
                pieces.eye += pieces.forward * (face - near - pieces.eye.dot(pieces.forward));
                // As the library sees it: from the eye's own, rounded position.
                pieces.depth = face - pieces.eye.dot(pieces.forward)..1e4;
            }
            Class::FarInfinite => pieces.depth.end = f64::INFINITY,
            Class::FarRatio => pieces.depth = 1e-3..1e4,
            // Tangents of half of 0.001 and of 179.9 degrees.
            Class::NarrowField => {
                pieces.look_along((place - pieces.eye).try_normalize().unwrap_or(DVec3::X));
                pieces.lens = square(8.726_646_259_971_65e-6);
            }
            Class::WideField => pieces.lens = square(1_145.915_298_950_4),
            Class::OffCentre => {
                let (left, bottom) = (1.0 - 3.0 * s.x, 1.0 - 3.0 * s.z);
                let (right, top) = (left + 2.0 - 1.9 * t.x, bottom + 2.0 - 1.9 * t.y);
                pieces.lens = Lens::Perspective(Sides { left, right, bottom, top });
            }
            Class::Orthographic => {
                let [width, height] = [s.x, s.z].map(|narrower| (1.5 - 1.4 * narrower) * size);
                pieces.lens = Lens::Orthographic(Sides::centred(width, height));
                let near = (t.x - 0.5) * size;
                pieces.depth = near..near + (2.0 - 1.9 * t.y) * size;
            }
            Class::Outside => {
                pieces.eye = middle + self.axis * (1.5 * size);
                pieces.look_along(self.axis);
                pieces.lens = square(1.0);
            }
            _ => {}
        }
        pieces
    }

    /// An orthographic camera square to the box: its volume is a box with faces in the planes of the other one's, tilted
    /// and moved by a jitter, or one that it touches along so many axes: in a face, an edge or a vertex.
    fn boxed_volume(&self, class: Class, touching: usize, low: DVec3, high: DVec3, pieces: &mut Pieces) {
        let size = (high - low).max_element();
        pieces.look_along(self.axis);
        // A corner, so that the volume's planes meet the box without rounding.
        pieces.eye = corner(low, high, self.corners[0]);
        let local = pieces.frame().transpose();
        let (a, b) = (local * (low - pieces.eye), local * (high - pieces.eye));
        let (low, high) = (a.min(b), a.max(b));
        let extent = high - low;
        let mut ends = [0, 1, 2].map(|axis| {
            let touches = (axis + 3 - self.first) % 3 < touching;
            match (touches, self.coins[axis]) {
                (true, true) => [high[axis], high[axis] + 0.5 * size],
                (true, false) => [low[axis] - 0.5 * size, low[axis]],
                _ => {
                    let [from, to] = [2 * axis, 2 * axis + 1].map(|end| extent[axis] * self.insets[end]);
                    [low[axis] + from, high[axis] - to]
                }
            }
        });
        if class == Class::CoplanarJitter {
            pieces.forward += self.tilts[0];
            pieces.up += self.tilts[1];
            for (end, jitter) in ends.as_flattened_mut().iter_mut().zip(self.jitters) {
                *end += jitter * size;
            }
        }
        let [[left, right], [bottom, top], [near, far]] = ends;
        pieces.lens = Lens::Orthographic(Sides { left, right, bottom, top });
        pieces.depth = near..far;
    }
}
