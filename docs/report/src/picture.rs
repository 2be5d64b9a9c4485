//! The light's view of the scene, before and after the warp, as SVG.

use shadow_warp::glam::{DMat3, DVec2, DVec3, DVec4};
use shadow_warp::{ClipSpace, Lens, Light, LitBody, ShadowMap, Sides, View};
use svg::Document;
use svg::node::element::{Circle, Element, Line, Polygon, Rectangle, SVG, Text};

use crate::measure::Row;
use scenes::Job;

pub(crate) const BODY: &str = "#1f6fb2";
pub(crate) const EYE: &str = "#d9730d";
pub(crate) const WARP: &str = "#b5179e";
pub(crate) const TEXELS: &str = "#9aa3ad";
pub(crate) const WORLD: &str = "#2a9d62";

/// The side of a drawing, and the room around it.
const SIZE: f64 = 420.0;
const MARGIN: f64 = 36.0;
/// A texel line for every 16th of the map.
const CELLS: u32 = 16;

/// A technique's map, drawn in a plane across the light: x across, z along, relative to the map's
/// origin. For a light with a place, the plane at a distance of 1, relative to its axis.
pub(crate) struct Drawing<'a> {
    job: &'a Job,
    bodies: &'a [LitBody],
    map: &'a ShadowMap,
    /// Points are drawn as far as they are this far along the axis of a light with a place.
    nearest: f64,
    /// To clip x, y, w of the map. Along the light nothing changes there, so it is a map of the
    /// plane.
    clip_from_plane: DMat3,
    plane_from_clip: DMat3,
    /// What the left picture shows: its middle and half its side, in world units.
    middle: DVec2,
    half: f64,
}

/// A square window on a plane, drawn with y up.
struct Panel {
    middle: DVec2,
    half: f64,
    svg: SVG,
}

impl Panel {
    fn new(middle: DVec2, half: f64) -> Self {
        // An inner svg element clips what it holds.
        let svg = SVG::new().set("x", MARGIN).set("y", MARGIN).set("width", SIZE).set("height", SIZE);
        let paper = Rectangle::new().set("width", SIZE).set("height", SIZE).set("fill", "#ffffff");
        Self { middle, half, svg: svg.add(paper) }
    }

    fn place(&self, p: DVec2) -> [f64; 2] {
        let unit = (p - self.middle) / self.half;
        // Hundredths of a pixel are fine enough, and far outside is far enough.
        [unit.x, -unit.y].map(|x| ((x.clamp(-1e5, 1e5) + 1.0) * 50.0 * SIZE).round() / 100.0)
    }

    fn line(&mut self, [a, b]: [DVec2; 2], stroke: &str, width: f64, dash: &str) {
        let ([x1, y1], [x2, y2]) = (self.place(a), self.place(b));
        let line = Line::new().set("x1", x1).set("y1", y1).set("x2", x2).set("y2", y2);
        self.add(line.set("stroke", stroke).set("stroke-width", width).set("stroke-dasharray", dash));
    }

    fn fill(&mut self, corners: &[DVec2], colour: &str, opacity: f64) {
        let points: Vec<String> = corners.iter().map(|&p| self.place(p).map(|x| x.to_string()).join(",")).collect();
        self.add(Polygon::new().set("points", points.join(" ")).set("fill", colour).set("fill-opacity", opacity));
    }

    fn add(&mut self, element: impl Into<Element>) {
        let svg = std::mem::replace(&mut self.svg, SVG::new());
        self.svg = svg.add(element.into());
    }

    /// The finished picture, with a frame and labels around it (title, below, beside), and a bar of
    /// the given length.
    fn finish(self, [title, below, beside]: [&str; 3], scale: Option<f64>) -> String {
        let whole = SIZE + 2.0 * MARGIN;
        let frame = Rectangle::new().set("x", MARGIN).set("y", MARGIN).set("width", SIZE).set("height", SIZE);
        let label = |text: &str, x: f64, y: f64| {
            Text::new(text).set("x", x).set("y", y).set("text-anchor", "middle").set("fill", "#3b4652")
        };
        let turned = format!("rotate(-90 {} {})", 0.6 * MARGIN, 0.5 * whole);
        let document = Document::new()
            .set("viewBox", (0, 0, whole, whole))
            .set("font-family", "system-ui, sans-serif")
            .set("font-size", 13)
            .set("role", "img")
            .set("aria-label", title)
            .add(self.svg)
            .add(frame.set("fill", "none").set("stroke", "#c3cad2"))
            .add(label(title, 0.5 * whole, 0.6 * MARGIN).set("font-weight", 600))
            .add(label(below, 0.5 * whole, whole - 0.4 * MARGIN))
            .add(label(beside, 0.6 * MARGIN, 0.5 * whole).set("transform", turned));
        let Some(length) = scale else { return document.to_string() };
        let (x, y) = (MARGIN, MARGIN + SIZE + 8.0);
        let bar = Line::new().set("x1", x).set("y1", y).set("x2", x + 0.5 * SIZE * length / self.half).set("y2", y);
        let text = label(&units(length), x, y + 15.0).set("text-anchor", "start");
        document.add(bar.set("stroke", "#17202a").set("stroke-width", 3)).add(text).to_string()
    }
}

impl<'a> Drawing<'a> {
    pub(crate) fn new(row: &'a Row) -> Self {
        let Row { job, bodies, map, .. } = row;
        let space = map.light_space();
        let place = place(&job.light);
        let rows = map.clip_from_world_at(place.unwrap_or(map.origin()), ClipSpace::WGPU).transpose();
        let line = |r: DVec4| {
            let along = |axis: DVec3| r.truncate().dot(axis);
            DVec3::new(along(space.x), along(space.z), if place.is_some() { -along(space.y) } else { r.w })
        };
        let clip_from_plane = DMat3::from_cols(line(rows.x_axis), line(rows.y_axis), line(rows.w_axis)).transpose();
        let plane_from_clip = clip_from_plane.inverse();
        let (nearest, middle, half) = (1.0, DVec2::ZERO, 1.0);
        let mut drawing = Self { job, bodies, map, nearest, clip_from_plane, plane_from_clip, middle, half };

        let flat: Vec<DVec3> = drawing.vertices().map(|p| drawing.flat(p)).collect();
        drawing.nearest = flat.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
        let seen: Vec<DVec2> = flat.iter().map(|p| p.truncate() / p.z).collect();
        let (low, high) = bounds(&seen);
        let room = 0.75 * (high - low).max_element();
        // Corners of the map, and the eye, where they are not too far away to be shown.
        let corners = SQUARE.iter().filter_map(|&c| drawing.pull_back([c, c])).map(|[p, _]| p);
        let near_by = |p: &DVec2| p.cmpge(low - room).all() && p.cmple(high + room).all();
        let eye = drawing.project(&DMat3::IDENTITY, [job.view.eye(); 2]).map(|[eye, _]| eye);
        let shown: Vec<DVec2> = corners.chain(eye).filter(near_by).collect();
        let (low, high) = bounds(&[seen, shown].concat());
        drawing.middle = 0.5 * (low + high);
        drawing.half = 0.56 * (high - low).max_element().max(f64::MIN_POSITIVE);
        drawing
    }

    /// The scene as the light sees it, with the map's texels laid over it.
    pub(crate) fn before(&self) -> String {
        let mut panel = Panel::new(self.middle, self.half);
        for (line, on_edge) in grid_lines() {
            if let Some(line) = self.pull_back(line) {
                let (stroke, width) = if on_edge { (WARP, 2.0) } else { (TEXELS, 0.7) };
                panel.line(line, stroke, width, "none");
            }
        }
        self.draw_apex(&mut panel);
        self.draw_scene(&mut panel, &DMat3::IDENTITY);
        let scale = round_down(0.5 * self.half);
        panel.finish(["light space: before the warp", "across the warp (x)", "along the warp (z)"], Some(scale))
    }

    /// The same in the map, with a regular grid of the world laid over it.
    pub(crate) fn after(&self) -> String {
        let mut panel = Panel::new(DVec2::ZERO, 1.08);
        for (line, on_edge) in grid_lines() {
            let (stroke, width) = if on_edge { (WARP, 2.0) } else { (TEXELS, 0.4) };
            panel.line(line, stroke, width, "none");
        }
        let spacing = self.world_spacing();
        let (low, high) = (self.middle - self.half, self.middle + self.half);
        for (axis, across) in [(DVec2::X, DVec2::Y), (DVec2::Y, DVec2::X)] {
            let (first, last) = ((low.dot(axis) / spacing).ceil(), (high.dot(axis) / spacing).floor());
            // At most some twenty, by the choice of the spacing.
            for i in 0..=(last - first).clamp(0.0, 64.0) as u32 {
                let at = axis * (first + f64::from(i)) * spacing;
                let ends = [at + across * low.dot(across), at + across * high.dot(across)];
                if let Some(line) = through(&self.clip_from_plane, ends.map(|p| p.extend(1.0)), LEAST_W) {
                    panel.line(line, WORLD, 0.8, "none");
                }
            }
        }
        self.draw_scene(&mut panel, &self.clip_from_plane);
        panel.finish(["the map: after the warp", "across the map", "up the map"], None)
    }

    /// The distance of the lines of the world grid: 1, 2 or 5 times a power of ten, eight to twenty
    /// to the picture.
    pub(crate) fn world_spacing(&self) -> f64 {
        round_down(self.half / 6.0)
    }

    /// A length in the plane, in words.
    pub(crate) fn units(&self, length: f64) -> String {
        units(length) + if place(&self.job.light).is_some() { " at a distance of 1 from the light" } else { "" }
    }

    fn draw_scene(&self, panel: &mut Panel, panel_from_plane: &DMat3) {
        let line = |ends: [DVec3; 2]| self.project(panel_from_plane, ends);
        let point = |p: DVec3| line([p, p]).map(|[p, _]| p);
        for body in self.bodies {
            for face in body.faces() {
                let corner = |v: usize| point(body.vertices()[v] + body.origin());
                let corners: Vec<DVec2> = face.corners().filter_map(corner).collect();
                panel.fill(&corners, BODY, 0.09);
            }
        }
        for edge in frustum_edges(&self.job.view, self.depth_reach()) {
            if let Some(ends) = line(edge) {
                panel.line(ends, EYE, 1.4, "6 4");
            }
        }
        for body in self.bodies {
            for (a, b) in body.edges() {
                if let Some(ends) = line([a, b].map(|v| body.vertices()[v] + body.origin())) {
                    panel.line(ends, BODY, 1.5, "none");
                }
            }
        }
        if let Some(eye) = point(self.job.view.eye()) {
            let [x, y] = panel.place(eye);
            panel.add(Circle::new().set("cx", x).set("cy", y).set("r", 4.5).set("fill", EYE));
        }
    }

    /// The sides of the warp's frustum beyond the map, towards the point where they meet.
    fn draw_apex(&self, panel: &mut Panel) {
        if self.map.warp().excess() <= 0.0 {
            return;
        }
        for [far, near] in [[SQUARE[3], SQUARE[0]], [SQUARE[2], SQUARE[1]]] {
            if let Some([far, near]) = self.pull_back([far, near]) {
                // A grid that does not follow the warp may have it run the other way.
                let [far, near] = if self.w(far) > self.w(near) { [far, near] } else { [near, far] };
                let (w_far, w_near) = (self.w(far), self.w(near));
                if w_far <= w_near {
                    continue;
                }
                // w falls along this side, which ends where w = 0.
                let rest = (near - far) * (w_near / (w_far - w_near));
                let shown =
                    if rest.length() > 4.0 * self.half { rest * (4.0 * self.half / rest.length()) } else { rest };
                panel.line([near, near + shown], WARP, 1.2, "3 4");
            }
        }
    }

    /// A point of the world in the plane, homogeneous.
    fn flat(&self, world: DVec3) -> DVec3 {
        let (space, place) = (self.map.light_space(), place(&self.job.light));
        let q = world - place.unwrap_or(self.map.origin());
        DVec3::new(space.x.dot(q), space.z.dot(q), if place.is_some() { -space.y.dot(q) } else { 1.0 })
    }

    fn w(&self, p: DVec2) -> f64 {
        (self.clip_from_plane * p.extend(1.0)).z
    }

    /// A line of the world in the plane or in the map, without what lies behind a projection's
    /// centre.
    fn project(&self, panel_from_plane: &DMat3, line: [DVec3; 2]) -> Option<[DVec2; 2]> {
        through(panel_from_plane, line.map(|p| self.flat(p)), LEAST_W * self.nearest)
    }

    /// A line of the map in the plane, without what lies near infinity.
    fn pull_back(&self, line: [DVec2; 2]) -> Option<[DVec2; 2]> {
        through(&self.plane_from_clip, line.map(|p| p.extend(1.0)), LEAST_W / self.map.warp().ratio())
    }

    /// How far to draw the edges of a camera's volume that may have no end.
    fn depth_reach(&self) -> f64 {
        let view = &self.job.view;
        let far = |body: &LitBody| {
            let [_, far] = body.bounds_along(view.forward())?;
            Some(far + view.forward().dot(body.origin() - view.eye()))
        };
        let far = self.bodies.iter().filter_map(far).reduce(f64::max).unwrap_or(1.0);
        view.far().min(far + (far - view.near()).abs())
    }

    /// The vertices of all bodies, in world space.
    fn vertices(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.bodies.iter().flat_map(|body| body.vertices().iter().map(|&q| q + body.origin()))
    }
}

/// The map, counter-clockwise from its lower left corner, in normalised device coordinates.
const SQUARE: [DVec2; 4] = [DVec2::NEG_ONE, DVec2::new(1.0, -1.0), DVec2::ONE, DVec2::new(-1.0, 1.0)];
/// Lines are drawn as far as the denominator, 1 or more on the body, is more than this.
const LEAST_W: f64 = 0.05;

/// Where a light with a place stands.
fn place(light: &Light) -> Option<DVec3> {
    match light {
        Light::Spot(spot) => Some(spot.position()),
        _ => None,
    }
}

/// Returns a line's picture under a projective map, cut where the denominator falls below its least
/// value.
fn through(map: &DMat3, line: [DVec3; 2], least: f64) -> Option<[DVec2; 2]> {
    let [a, b] = line.map(|p| *map * p);
    let (over_a, over_b) = (a.z - least, b.z - least);
    let cut = || a + (b - a) * (over_a / (over_a - over_b));
    let ends = match (over_a >= 0.0, over_b >= 0.0) {
        (true, true) => [a, b],
        (true, false) => [a, cut()],
        (false, true) => [cut(), b],
        // Also where a number is lost.
        (false, false) => return None,
    };
    Some(ends.map(|p| p.truncate() / p.z))
}

/// The lines between the map's cells, and whether they are its border.
fn grid_lines() -> impl Iterator<Item = ([DVec2; 2], bool)> {
    // The border comes last, on top.
    let order = (1..CELLS).chain([0, CELLS]);
    order.flat_map(|i| {
        let at = f64::from(i) / f64::from(CELLS) * 2.0 - 1.0;
        let on_edge = i == 0 || i == CELLS;
        let upright = [DVec2::new(at, -1.0), DVec2::new(at, 1.0)];
        let level = [DVec2::new(-1.0, at), DVec2::new(1.0, at)];
        [(upright, on_edge), (level, on_edge)]
    })
}

/// The edges of a camera's volume, in world space, from the near plane to `reach`.
fn frustum_edges(view: &View, reach: f64) -> impl Iterator<Item = [DVec3; 2]> {
    let (Lens::Perspective(s) | Lens::Orthographic(s)) = view.lens();
    let Sides { left, right, bottom, top } = s;
    let perspective = view.is_perspective();
    let corner = move |(x, y): (f64, f64), depth: f64| {
        let side = if perspective { depth } else { 1.0 };
        view.eye() + view.forward() * depth + (view.right() * x + view.up() * y) * side
    };
    let corners = [(left, bottom), (right, bottom), (right, top), (left, top)];
    (0..4).flat_map(move |i| {
        let (a, b) = (corners[i], corners[(i + 1) % 4]);
        let (near, far) = (view.near(), reach);
        [[corner(a, near), corner(a, far)], [corner(a, near), corner(b, near)], [corner(a, far), corner(b, far)]]
    })
}

fn bounds(points: &[DVec2]) -> (DVec2, DVec2) {
    points.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)))
}

/// The greatest of 1, 2 or 5 times a power of ten that is not above a length.
fn round_down(length: f64) -> f64 {
    // Printed and read again, a power of ten is exact.
    let power: f64 = format!("1e{}", length.log10().floor()).parse().unwrap_or(length);
    let factor = if length >= 5.0 * power {
        5.0
    } else if length >= 2.0 * power {
        2.0
    } else {
        1.0
    };
    factor * power
}

/// A length with its unit, in words.
fn units(length: f64) -> String {
    format!("{length} unit{}", if (length - 1.0).abs() < 1e-9 { "" } else { "s" })
}
