//! The mean over a body, by quadrature.

use shadow_warp::ConvexBody;
use shadow_warp::glam::DVec3;

/// Pieces of a body to average over, each with its share: tetrahedra of a solid one, triangles of a flat one.
pub(crate) enum Quadrature {
    Volume(Vec<(f64, [DVec3; 4])>),
    Area(Vec<(f64, [DVec3; 3])>),
    Vertices(Vec<DVec3>),
}

/// Each halves the edges.
const SUBDIVISIONS: u32 = 3;
/// A body is flat where its thickness is less than this much of its width.
const FLAT: f64 = 1e-6;

impl Quadrature {
    pub(crate) fn of<const V: usize, const F: usize>(body: &ConvexBody<V, F>) -> Self {
        let vertices = body.vertices();
        let inner = vertices.iter().sum::<DVec3>() / vertices.len().max(1) as f64;
        let size = vertices.iter().map(|&q| (q - inner).abs().max_element()).fold(0.0, f64::max);
        // Relative to the body's size, so that products neither overflow nor vanish.
        let unit = |q: DVec3| (q - inner) / size;
        let area = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).length();
        let volume = |[a, b, c]: [DVec3; 3]| a.dot(b.cross(c)).abs() / 6.0;
        let triangles: Vec<[DVec3; 3]> = body.faces().flat_map(|face| face.triangles()).collect();
        let all_area: f64 = triangles.iter().map(|t| area(t.map(unit))).sum();
        let all_volume: f64 = triangles.iter().map(|t| volume(t.map(unit))).sum();
        // The area has both sides of a flat body.
        if 2.0 * all_volume > FLAT * all_area * all_area.sqrt() {
            let piece = |t: [DVec3; 3]| (volume(t.map(unit)) / all_volume, [t[0], t[1], t[2], inner]);
            Self::Volume(triangles.into_iter().map(piece).collect())
        } else if all_area > 0.0 {
            Self::Area(triangles.into_iter().map(|t| (area(t.map(unit)) / all_area, t)).collect())
        } else {
            Self::Vertices(vertices.to_vec())
        }
    }

    pub(crate) fn what(&self) -> &'static str {
        match self {
            Self::Volume(_) => {
                "the body's volume: tetrahedra from its faces to an inner point, each cut into 512, with 4 points in each"
            }
            Self::Area(_) => {
                "the flat body's area: the triangles of its faces, each cut into 64, with 3 points in each"
            }
            Self::Vertices(_) => "the vertices: the body is a line or a point",
        }
    }

    pub(crate) fn mean(&self, f: impl Fn(DVec3) -> f64) -> f64 {
        match self {
            Self::Volume(pieces) => pieces.iter().map(|(share, p)| share * mean_in_solid(*p, SUBDIVISIONS, &f)).sum(),
            Self::Area(pieces) => pieces.iter().map(|(share, p)| share * mean_in_flat(*p, SUBDIVISIONS, &f)).sum(),
            Self::Vertices(points) => points.iter().map(|&p| f(p)).sum::<f64>() / points.len() as f64,
        }
    }
}

/// The mean over a tetrahedron, by the four points that are exact for polynomials of degree 2.
fn mean_in_solid(p: [DVec3; 4], subdivisions: u32, f: &impl Fn(DVec3) -> f64) -> f64 {
    if subdivisions == 0 {
        // (5 - sqrt 5)/20: the points lie this far from three faces.
        let near = 0.138_196_601_125_010_52;
        let sum = p.iter().sum::<DVec3>();
        return p.map(|corner| f(sum * near + corner * (1.0 - 4.0 * near))).iter().sum::<f64>() / 4.0;
    }
    // Eight of equal volume: one at each corner, and the octahedron between them cut along a diagonal.
    let [a, b, c, d] = p;
    let [ab, ac, ad] = [b, c, d].map(|q| 0.5 * (a + q));
    let [bc, bd, cd] = [0.5 * (b + c), 0.5 * (b + d), 0.5 * (c + d)];
    let corners = [[a, ab, ac, ad], [ab, b, bc, bd], [ac, bc, c, cd], [ad, bd, cd, d]];
    let middle = [[ac, bd, ab, bc], [ac, bd, bc, cd], [ac, bd, cd, ad], [ac, bd, ad, ab]];
    let children = corners.into_iter().chain(middle);
    children.map(|child| mean_in_solid(child, subdivisions - 1, f)).sum::<f64>() / 8.0
}

/// The mean over a triangle, by the middles of its edges, exact for polynomials of degree 2.
fn mean_in_flat([a, b, c]: [DVec3; 3], subdivisions: u32, f: &impl Fn(DVec3) -> f64) -> f64 {
    let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
    if subdivisions == 0 {
        return (f(ab) + f(bc) + f(ca)) / 3.0;
    }
    let children = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
    children.map(|child| mean_in_flat(child, subdivisions - 1, f)).iter().sum::<f64>() / 4.0
}
