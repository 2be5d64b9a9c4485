//! Cutting a simple polytope by a half-space.

use glam::DVec3;

use super::{ConvexBody, before};
use crate::error::Error;
use crate::plane::Plane;

/// Marks an edge that leads to a new vertex, whose number stands in the other bits.
const NEW: u16 = 1 << 15;

impl<const V: usize, const F: usize> ConvexBody<V, F> {
    /// Cuts away what lies beyond a plane, given relative to [`ConvexBody::origin`]. Points on the plane are inside.
    ///
    /// The result is closed and convex, or empty; a body that only touches the plane from outside is left flat.
    /// A new vertex lies on its edge, at the point that divides the distances of its ends: `a/(a + b)` from the one that is
    /// nearer to the plane, with both distances positive, so nothing cancels.
    ///
    /// # Errors
    /// [`Error::BodyFull`] if there is no room for the new face or vertices; the body is then unchanged.
    pub fn cut(&mut self, plane: &Plane) -> Result<(), Error> {
        let mut beyond = [0.0; V];
        let mut removed = [0_u8; V];
        let mut removed_len = 0;
        for (v, point) in self.vertices().iter().enumerate() {
            beyond[v] = plane.distance(*point);
            removed[removed_len] = v as u8;
            removed_len += usize::from(beyond[v] > 0.0);
        }
        if removed_len == 0 {
            return Ok(());
        }
        if removed_len == self.len {
            self.len = 0;
            return Ok(());
        }
        let face = self.free_face()?;
        let done = match self.try_cut(&beyond, &removed[..removed_len], face) {
            Outcome::Torn => {
                removed_len = self.mend(&mut beyond, &mut removed);
                self.try_cut(&beyond, &removed[..removed_len], face)
            }
            done => done,
        };
        match done {
            Outcome::Cut => {
                self.planes[face] = *plane;
                self.planes_len = self.planes_len.max(face + 1);
                Ok(())
            }
            // After mending, both sides hang together, so a torn cut is impossible; too little room is not.
            Outcome::Torn | Outcome::Full => Err(Error::BodyFull),
        }
    }

    /// An unused plane's number: a fresh one, or that of a face that has been cut away.
    fn free_face(&self) -> Result<usize, Error> {
        if self.planes_len < F {
            return Ok(self.planes_len);
        }
        let used = self.corners[..self.len].iter().flat_map(|c| c.face).fold(0_u64, |set, f| set | 1 << f);
        (0..F).find(|f| used & 1 << f == 0).ok_or(Error::BodyFull)
    }

    /// Cuts along the edges between kept and removed vertices, if they form a single cycle that crosses no face twice.
    /// Otherwise leaves the body as it is.
    fn try_cut(&mut self, beyond: &[f64; V], removed: &[u8], face: usize) -> Outcome {
        // Every cut edge, from its kept end; its new vertex; and the edge as the removed end knows it.
        let mut cut = [0_u16; V];
        let mut undo = [0_u16; V];
        let mut points = [DVec3::ZERO; V];
        let mut len = 0;
        let mut outcome = Outcome::Cut;
        'edges: for &v in removed {
            let v = usize::from(v);
            for edge in 0..3 {
                let half = self.corners[v].twin[edge];
                let kept = usize::from(half >> 2);
                if beyond[kept] > 0.0 {
                    continue;
                }
                if len == V {
                    outcome = Outcome::Torn;
                    break 'edges;
                }
                points[len] = divide(self.points[kept], -beyond[kept], self.points[v], beyond[v]);
                cut[len] = half;
                undo[len] = (4 * v + edge) as u16;
                self.corners[kept].twin[usize::from(half & 3)] = NEW | len as u16;
                len += 1;
            }
        }
        if outcome == Outcome::Cut && len > removed.len() + V - self.len {
            outcome = Outcome::Full;
        }

        // From each cut edge follow the face to its right, along the kept side, to the cut edge where that face ends.
        let mut next = [0_u8; V];
        let mut faces = [0_u8; V];
        if outcome == Outcome::Cut {
            let mut crossed = 0_u64;
            for i in 0..len {
                let mut half = before(usize::from(cut[i]));
                faces[i] = self.corners[half >> 2].face[half & 3];
                crossed |= 1 << faces[i];
                let end = loop {
                    let twin = self.corners[half >> 2].twin[half & 3];
                    if twin & NEW != 0 {
                        break twin & !NEW;
                    }
                    half = before(usize::from(twin));
                };
                next[i] = end as u8;
            }
            let mut steps = 1;
            let mut i = usize::from(next[0]);
            while i != 0 {
                i = usize::from(next[i]);
                steps += 1;
            }
            if steps != len || crossed.count_ones() as usize != len {
                outcome = Outcome::Torn;
            }
        }
        if outcome != Outcome::Cut {
            for (&half, &back) in cut[..len].iter().zip(&undo) {
                self.corners[usize::from(half >> 2)].twin[usize::from(half & 3)] = back;
            }
            return outcome;
        }

        // New vertices go where removed ones were, then to the end. Their edges, counter-clockwise: back to the kept end,
        // on to the next new vertex, and to the one before.
        let old_len = self.len;
        let slot = |i: usize| if i < removed.len() { usize::from(removed[i]) } else { old_len + i - removed.len() };
        for i in 0..len {
            let (here, there) = (slot(i), slot(usize::from(next[i])));
            let half = usize::from(cut[i]);
            self.points[here] = points[i];
            self.corners[half >> 2].twin[half & 3] = (4 * here) as u16;
            let other_face = self.corners[half >> 2].face[half & 3];
            let corner = &mut self.corners[here];
            corner.twin[0] = cut[i];
            corner.twin[1] = (4 * there + 2) as u16;
            corner.face = [faces[i], face as u8, other_face];
            self.corners[there].twin[2] = (4 * here + 1) as u16;
        }
        self.len = old_len + len.saturating_sub(removed.len());
        for &hole in removed.get(len..).unwrap_or(&[]).iter().rev() {
            self.move_last_to(usize::from(hole));
        }
        Outcome::Cut
    }

    /// Fills a hole in the table of vertices with its last one.
    fn move_last_to(&mut self, hole: usize) {
        self.len -= 1;
        if hole == self.len {
            return;
        }
        self.points[hole] = self.points[self.len];
        self.corners[hole] = self.corners[self.len];
        for (edge, half) in self.corners[hole].twin.map(usize::from).into_iter().enumerate() {
            self.corners[half >> 2].twin[half & 3] = (4 * hole + edge) as u16;
        }
    }

    /// Mends signs that rounding has spoiled: keeps what hangs together with the deepest vertex, and of the rest removes
    /// only the largest part that hangs together. Returns how many vertices are removed.
    #[cold]
    fn mend(&self, beyond: &mut [f64; V], removed: &mut [u8; V]) -> usize {
        let deepest = (0..self.len).fold(0, |a, b| if beyond[b] < beyond[a] { b } else { a });
        let mut part = [0_usize; V];
        self.flood(&mut part, deepest, 1, |v| beyond[v] <= 0.0);
        let (mut parts, mut largest, mut largest_size) = (1, 0, 0);
        for v in 0..self.len {
            if part[v] == 0 {
                parts += 1;
                let size = self.flood(&mut part, v, parts, |_| true);
                if size > largest_size {
                    (largest, largest_size) = (parts, size);
                }
            }
        }
        let mut len = 0;
        for v in 0..self.len {
            if part[v] == largest {
                beyond[v] = beyond[v].max(f64::MIN_POSITIVE);
                removed[len] = v as u8;
                len += 1;
            } else {
                beyond[v] = beyond[v].min(0.0);
            }
        }
        len
    }

    /// Gives a number to all vertices without one that hang together with `start` through such as pass the test.
    /// Returns how many.
    fn flood(&self, part: &mut [usize; V], start: usize, number: usize, passes: impl Fn(usize) -> bool) -> usize {
        let mut found = [0_u8; V];
        found[0] = start as u8;
        part[start] = number;
        let (mut len, mut done) = (1, 0);
        while done < len {
            for half in self.corners[usize::from(found[done])].twin {
                let v = usize::from(half >> 2);
                if part[v] == 0 && passes(v) {
                    part[v] = number;
                    found[len] = v as u8;
                    len += 1;
                }
            }
            done += 1;
        }
        len
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Outcome {
    Cut,
    Torn,
    Full,
}

/// The point where the way from `p`, `a` inside, to `q`, `b` outside, meets the plane; measured from the nearer end.
fn divide(p: DVec3, a: f64, q: DVec3, b: f64) -> DVec3 {
    if a <= b { p + (q - p) * (a / (a + b)) } else { q + (p - q) * (b / (a + b)) }
}
