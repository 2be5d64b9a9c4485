//! What a rasteriser must do with triangles, predicted in `f64`, and how far one is from that.

use std::collections::HashMap;

use shadow_warp::glam::{DVec2, DVec3};

use crate::check::worse;
use crate::projection::{Facet, Projection};

/// How a depth map differs from the prediction.
#[derive(Clone, Copy, Debug, Default)]
pub struct Agreement {
    /// Texels that something was drawn on.
    pub texels: usize,
    /// Of the map's sixteenths, by rows and by columns, those that something was drawn in; the fewer of both.
    pub sixteenths: usize,
    /// The furthest that the centre of a texel lies on the wrong side of an edge, in texels.
    pub coverage: f64,
    /// The largest error in depth.
    pub depth: f64,
    /// The largest error in depth, over what is allowed at that texel.
    pub depth_of_allowed: f64,
    /// Texels that hold what no triangle explains.
    pub unexplained: usize,
}

impl Agreement {
    /// What is not as it must be.
    #[must_use]
    pub fn failures(&self, allowance: &Allowance) -> Vec<String> {
        let mut failures = Vec::new();
        if self.texels < LEAST_TEXELS {
            failures.push(format!("only {} texels were drawn", self.texels));
        }
        if self.sixteenths < LEAST_SIXTEENTHS {
            failures.push(format!("only {} sixteenths of the map were drawn in", self.sixteenths));
        }
        // Depth beyond what is allowed is explained by nothing.
        if self.unexplained > 0 {
            failures.push(format!("{} texels hold what no triangle explains", self.unexplained));
        }
        let is_bounded = allowance.coverage.is_finite() && allowance.depth.is_finite() && allowance.shift.is_finite();
        if !(self.coverage <= allowance.coverage && is_bounded) {
            failures.push(format!("an edge is {} texels off, {} are allowed", self.coverage, allowance.coverage));
        }
        failures
    }

    /// Of two maps together.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            texels: self.texels + other.texels,
            sixteenths: self.sixteenths.max(other.sixteenths),
            coverage: worse(self.coverage, other.coverage),
            depth: worse(self.depth, other.depth),
            depth_of_allowed: worse(self.depth_of_allowed, other.depth_of_allowed),
            unexplained: self.unexplained + other.unexplained,
        }
    }
}

/// A map with fewer shows nothing.
const LEAST_TEXELS: usize = 2_000;
/// Triangles must be all over the map, as far as what is seen is.
const LEAST_SIXTEENTHS: usize = 10;

/// What error a rasteriser may make.
#[derive(Clone, Copy, Debug)]
pub struct Allowance {
    /// The reach of an edge, in texels: half the diagonal of the grid of positions, and rounding in `f32`.
    pub coverage: f64,
    /// In depth, from `f32` rounding of the vertices.
    pub depth: f64,
    /// In texels, by which the surface that depth is taken from may be displaced.
    pub shift: f64,
}

/// The rasteriser's own rounding of depth, in units of 2^-24: on lavapipe up to 23.4 for single thin or flat triangles.
pub const DEPTH_ROUNDING: f64 = 32.0;

impl Allowance {
    /// The largest error in depth at a place on a surface with this slope. Rasterisers evaluate the plane of depth from
    /// the target's corner, so the error grows with the products of slope and coordinate.
    #[must_use]
    pub fn of_depth(&self, texel: DVec2, depth: f64, slope: DVec2) -> f64 {
        let unit = f64::from(f32::EPSILON) / 2.0;
        let (slope, terms) = (slope.abs(), slope.abs().dot(texel.abs()));
        DEPTH_ROUNDING * unit * (depth.abs() + 2.0 * terms) + self.depth + slope.element_sum() * self.shift
    }
}

/// A triangle in a map.
#[derive(Clone, Copy, Debug)]
pub struct Drawn {
    /// For each edge, the line with which `line . (x, y, 1)` is the distance inward of a place, in texels.
    lines: [DVec3; 3],
    /// Depth is `plane . (x, y, 1)`.
    plane: DVec3,
}

impl Drawn {
    /// Returns a triangle whose corners are relative to the projection's origin; it may reach behind the projection's
    /// centre. `None` where it is seen edge-on.
    #[must_use]
    pub fn new(triangle: [DVec3; 3], projection: &Projection) -> Option<Self> {
        let corners = triangle.map(|q| projection.homogeneous(q));
        let volume = corners[0].dot(corners[1].cross(corners[2]));
        let lines = [0, 1, 2].map(|i| {
            let line = corners[i].cross(corners[(i + 1) % 3]) * volume.signum();
            line / line.truncate().length()
        });
        let plane = projection.depth_plane(&Facet::of(triangle));
        let is_seen = volume != 0.0 && plane.is_finite() && lines.iter().all(|line| line.is_finite());
        is_seen.then_some(Self { lines, plane })
    }

    /// Returns how far inside of the nearest edge a place lies, in texels.
    #[must_use]
    pub fn inside(&self, p: DVec2) -> f64 {
        self.lines.map(|line| line.dot(p.extend(1.0))).into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Returns the depth at a place, on the triangle or beyond its edges.
    #[must_use]
    pub fn depth(&self, p: DVec2) -> f64 {
        self.plane.dot(p.extend(1.0))
    }

    /// Returns how depth changes from texel to texel.
    #[must_use]
    pub fn slope(&self) -> DVec2 {
        self.plane.truncate()
    }
}

/// The texels whose centres are within `reach` texels of the box around some places.
fn centres(corners: [DVec2; 3], size: [u32; 2], reach: f64) -> impl Iterator<Item = (usize, DVec2)> {
    let limit = DVec2::from(size.map(f64::from));
    let [a, b, c] = corners;
    let texel = |p: DVec2| p.clamp(DVec2::ZERO, limit).to_array().map(|x| x as u32);
    let low = texel((a.min(b).min(c) - reach - 0.5).ceil());
    let high = texel((a.max(b).max(c) + reach + 0.5).floor());
    let texels = (low[1]..high[1]).flat_map(move |y| (low[0]..high[0]).map(move |x| (x, y)));
    texels.map(move |(x, y)| ((y * size[0] + x) as usize, DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)))
}

/// What is known of a texel that a triangle covers, or nearly so.
#[derive(Clone, Copy, Default)]
struct Texel {
    /// The triangle that explains the depth best: how far inside of it the centre is, its error, and that over what is
    /// allowed.
    explained: Option<(f64, f64, f64)>,
    /// How far the centre is inside of a triangle that should hide what is there; the furthest.
    hidden: f64,
}

/// Compares a depth map (ordinary depth, cleared to 1) with triangles whose corners are relative to the projection's
/// origin and inside the map.
#[must_use]
pub fn compare(
    found: &[f32],
    size: [u32; 2],
    triangles: impl Iterator<Item = [DVec3; 3]>,
    projection: &Projection,
    allowance: &Allowance,
) -> Agreement {
    // Far beyond what is allowed, so that errors are measured and not only counted.
    let reach = 1.0;
    // A large map is mostly empty.
    let mut texels: HashMap<usize, Texel> = HashMap::new();
    for triangle in triangles {
        let Some(drawn) = Drawn::new(triangle, projection) else { continue };
        for (index, centre) in centres(triangle.map(|q| projection.place(q).texel), size, reach) {
            let inside = drawn.inside(centre);
            if inside <= -reach {
                continue;
            }
            let (there, depth) = (f64::from(found[index]), drawn.depth(centre));
            let texel = texels.entry(index).or_default();
            let allowed = allowance.of_depth(centre, depth, drawn.slope());
            let (error, is_cleared) = ((there - depth).abs(), there >= 1.0);
            let of_allowed = error / allowed;
            // By chance a depth may fit a triangle beside the texel, too.
            let rank = |inside: f64, of_allowed: f64| (inside < -allowance.coverage, of_allowed);
            let is_better =
                texel.explained.is_none_or(|(other, _, error)| rank(inside, of_allowed) < rank(other, error));
            if !is_cleared && of_allowed <= 1.0 && is_better {
                texel.explained = Some((inside, error, of_allowed));
            }
            if is_cleared || depth + allowed < there {
                texel.hidden = inside.max(texel.hidden);
            }
        }
    }
    let drawn = found.iter().filter(|&&depth| depth < 1.0).count();
    let explained = texels.values().filter(|texel| texel.explained.is_some()).count();
    let sixteenths = sixteenths(found, size);
    let start = Agreement { texels: drawn, sixteenths, unexplained: drawn - explained, ..Agreement::default() };
    texels.values().fold(start, |sum, texel| {
        // A texel that should hold something and does not.
        let missing = Agreement { coverage: texel.hidden, ..Agreement::default() };
        let of = |(inside, depth, depth_of_allowed): (f64, f64, f64)| Agreement {
            coverage: -inside,
            depth,
            depth_of_allowed,
            ..Agreement::default()
        };
        sum.and(missing).and(texel.explained.map(of).unwrap_or_default())
    })
}

/// Of sixteen strips of a map, across and down, how many are not empty; the fewer of both.
fn sixteenths(found: &[f32], size: [u32; 2]) -> usize {
    let [width, height] = size.map(|side| side as usize);
    let mut drawn = [[false; 16]; 2];
    for (index, _) in found.iter().enumerate().filter(|(_, depth)| **depth < 1.0) {
        drawn[0][index % width * 16 / width] = true;
        drawn[1][index / width * 16 / height] = true;
    }
    drawn.map(|strips| strips.iter().filter(|drawn| **drawn).count()).into_iter().min().unwrap_or(0)
}
