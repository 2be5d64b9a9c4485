//! The mean over bodies, by quadrature.

use shadow_warp::ConvexBody;
use shadow_warp::glam::DVec3;

/// Pieces to average over, in world space, each with its share: tetrahedra of solid bodies,
/// triangles of flat ones.
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
    /// Of the volume of solid bodies; of the area of all faces, where some body is flat; else of
    /// the vertices. What lies in several bodies counts several times.
    pub(crate) fn of<const V: usize, const F: usize>(bodies: &[ConvexBody<V, F>]) -> Self {
        let bodies: Vec<_> = bodies.iter().filter(|body| !body.is_empty()).collect();
        let world: Vec<Vec<DVec3>> =
            bodies.iter().map(|body| body.vertices().iter().map(|&q| q + body.origin()).collect()).collect();
        let inner: Vec<DVec3> = world.iter().map(|vertices| middle(vertices)).collect();
        let centre = middle(&inner);
        let size = world.iter().flatten().map(|&p| (p - centre).abs().max_element()).fold(0.0, f64::max);
        // Relative to the size of all, so that products neither overflow nor vanish.
        let unit = |p: DVec3| (p - centre) / size;
        let area = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).length();
        let triangles: Vec<Vec<[DVec3; 3]>> = bodies
            .iter()
            .map(|body| {
                let of_body = body.faces().flat_map(|face| face.triangles().collect::<Vec<_>>());
                of_body.map(|t| t.map(|q| q + body.origin())).collect()
            })
            .collect();
        let solids = triangles.iter().zip(&inner).map(|(triangles, &inner)| {
            let volume = |t: [DVec3; 3]| {
                let [a, b, c] = t.map(|p| unit(p) - unit(inner));
                a.dot(b.cross(c)).abs() / 6.0
            };
            let pieces: Vec<(f64, [DVec3; 4])> =
                triangles.iter().map(|&t| (volume(t), [t[0], t[1], t[2], inner])).collect();
            let surface: f64 = triangles.iter().map(|t| area(t.map(unit))).sum();
            let volume: f64 = pieces.iter().map(|(share, _)| share).sum();
            // The area has both sides of a flat body.
            (2.0 * volume > FLAT * surface * surface.sqrt()).then_some(pieces)
        });
        let solids: Option<Vec<_>> = solids.collect();
        let faces: Vec<(f64, [DVec3; 3])> =
            triangles.into_iter().flatten().map(|t| (area(t.map(unit)), t)).filter(|(area, _)| *area > 0.0).collect();
        match solids {
            Some(pieces) if !pieces.is_empty() => Self::Volume(in_shares(pieces.into_iter().flatten().collect())),
            _ if !faces.is_empty() => Self::Area(in_shares(faces)),
            _ => Self::Vertices(world.into_iter().flatten().collect()),
        }
    }

    pub(crate) fn what(&self) -> &'static str {
        match self {
            Self::Volume(_) => {
                "the bodies' volume: tetrahedra from their faces to an inner point, each cut into 512, with 4 points in each"
            }
            Self::Area(_) => {
                "the area of all faces, as there is a flat body: their triangles, each cut into 64, with 3 points in each"
            }
            Self::Vertices(_) => "the vertices: the bodies are lines or points",
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

fn middle(points: &[DVec3]) -> DVec3 {
    points.iter().sum::<DVec3>() / points.len().max(1) as f64
}

/// The pieces, with shares of all in place of sizes.
fn in_shares<P>(pieces: Vec<(f64, P)>) -> Vec<(f64, P)> {
    let all: f64 = pieces.iter().map(|(size, _)| size).sum();
    pieces.into_iter().map(|(size, piece)| (size / all, piece)).collect()
}

/// The mean over a tetrahedron, by the four points that are exact for polynomials of degree 2.
fn mean_in_solid(p: [DVec3; 4], subdivisions: u32, f: &impl Fn(DVec3) -> f64) -> f64 {
    if subdivisions == 0 {
        // (5 - sqrt 5)/20: the points lie this far from three faces.
        let near = 0.138_196_601_125_010_52;
        let sum = p.iter().sum::<DVec3>();
        return p.map(|corner| f(sum * near + corner * (1.0 - 4.0 * near))).iter().sum::<f64>() / 4.0;
    }
    // Eight of equal volume: one at each corner, and the octahedron between them cut along a
    // diagonal.
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
