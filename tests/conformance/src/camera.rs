//! A camera's picture: its matrix for the device, and its rays in `f64`.

use shadow_warp::glam::{DMat4, DVec2, DVec3, DVec4};
use shadow_warp::{Lens, Sides, View};

use crate::projection::Facet;

/// A view with the size of its picture. Positions are relative to the eye.
#[derive(Clone, Copy, Debug)]
pub struct Camera<'a> {
    /// The view.
    pub view: &'a View,
    /// `[width, height]` in pixels.
    pub size: [u32; 2],
    /// Around everything that is to be drawn without perspective.
    pub depth: [f64; 2],
}

impl Camera<'_> {
    /// Returns the matrix to wgpu's clip space with reversed depth, without a far plane where there is perspective.
    #[must_use]
    pub fn clip_from_eye(&self) -> DMat4 {
        let view = self.view;
        let (Lens::Perspective(s) | Lens::Orthographic(s)) = view.lens();
        let (forward, one) = (view.forward().extend(0.0), DVec4::W);
        let w = if view.is_perspective() { forward } else { one };
        let across = |axis: DVec3, low: f64, high: f64| (2.0 * axis.extend(0.0) - (low + high) * w) / (high - low);
        let depth = if view.is_perspective() {
            one * view.near()
        } else {
            (self.depth[1] * one - forward) / (self.depth[1] - self.depth[0])
        };
        DMat4::from_cols(across(view.right(), s.left, s.right), across(view.up(), s.bottom, s.top), depth, w)
            .transpose()
    }

    /// Returns the origin and the direction of the ray through a place in the picture, in pixels from its upper left.
    #[must_use]
    pub fn ray(&self, pixel: DVec2) -> [DVec3; 2] {
        let (Lens::Perspective(s) | Lens::Orthographic(s)) = self.view.lens();
        let [x, y] = self.steps(s);
        self.parts(self.view.right() * s.left + self.view.up() * s.top + x * pixel.x + y * pixel.y, self.view.forward())
    }

    /// Returns how the point of a plane that is seen at a place moves when the place moves a pixel across or down.
    #[must_use]
    pub fn change(&self, facet: &Facet, pixel: DVec2) -> [DVec3; 2] {
        let (Lens::Perspective(s) | Lens::Orthographic(s)) = self.view.lens();
        let [origin, direction] = self.ray(pixel);
        let t = facet.meet(origin, direction);
        self.steps(s).map(|step| {
            let [of_origin, of_direction] = self.parts(step, DVec3::ZERO);
            let moved = of_origin + of_direction * t;
            moved - direction * (facet.normal.dot(moved) / facet.normal.dot(direction))
        })
    }

    /// What a pixel is in the picture's plane, across and down.
    fn steps(&self, s: Sides) -> [DVec3; 2] {
        let [width, height] = self.size.map(f64::from);
        [self.view.right() * ((s.right - s.left) / width), self.view.up() * ((s.bottom - s.top) / height)]
    }

    /// A place in the picture's plane moves the ray's direction where there is perspective, and else its origin.
    fn parts(&self, in_plane: DVec3, forward: DVec3) -> [DVec3; 2] {
        if self.view.is_perspective() { [DVec3::ZERO, in_plane + forward] } else { [in_plane, forward] }
    }
}
