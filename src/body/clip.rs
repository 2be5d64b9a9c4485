//! Cutting a simple polytope by a half-space.

use glam::DVec3;

use super::{ConvexBody, FaceSet, after, before};
use crate::error::Error;
use crate::math::{max, min};
use crate::plane::Plane;

/// What is lost when a position is computed, relative to the greatest coordinate: the rounding of
/// its coordinates, and of the distances that it was cut by. Vertices were found to be off by up to
/// 2.5 times 2^-52.
pub(super) const SLACK: f64 = 4.0 * f64::EPSILON;

/// Marks a half-edge that leads to a new vertex, whose number stands in the other bits.
const NEW: usize = 1 << 15;

impl<const V: usize, const F: usize> ConvexBody<V, F> {
    /// Cuts away what lies beyond a plane, given relative to [`ConvexBody::origin`]. Points on the
    /// plane are inside.
    ///
    /// On the plane means beyond it by at most 2^-50 of the greatest coordinate of the box that the
    /// body was made from. So a plane along a flat body takes none of it by rounding, and two
    /// planes that are one to rounding leave what lies between them.
    ///
    /// The result is closed and convex, or empty; a body that only touches the plane from outside is
    /// left flat. A new vertex lies on its edge, at the point that divides the distances of its
    /// ends: `a/(a + b)` from the one that is nearer to the plane, with both distances positive, so
    /// nothing cancels.
    ///
    /// Accuracy: whatever cuts came before, no vertex is beyond a plane by more than 2^-49 of that
    /// coordinate. Half of this is what counts as on the plane.
    ///
    /// # Errors
    /// [`Error::BodyFull`] if there is no room for the new face or vertices; the body is then
    /// unchanged.
    pub fn cut(&mut self, plane: &Plane) -> Result<(), Error> {
        self.cut_with(plane, &mut Scratch::new())
    }

    /// As [`ConvexBody::cut`], with the scratch space of the cuts before.
    #[inline(always)]
    pub(super) fn cut_with(&mut self, plane: &Plane, scratch: &mut Scratch<V>) -> Result<(), Error> {
        self.cut_within(plane, scratch, SLACK * self.size)
    }

    /// As [`ConvexBody::cut`]; vertices beyond the plane by no more than `slack` count as on it.
    #[inline(always)]
    pub(super) fn cut_within(&mut self, plane: &Plane, scratch: &mut Scratch<V>, slack: f64) -> Result<(), Error> {
        let points = &self.points[..self.len];
        let beyond = &mut scratch.beyond[..self.len];
        let mut removed_len = 0_u8;
        for v in 0..self.len {
            let distance = plane.distance(points[v]);
            beyond[v] = distance;
            scratch.removed[usize::from(removed_len)] = v as u8;
            removed_len += u8::from(distance > 0.0);
        }
        let mut removed_len = usize::from(removed_len);
        if scratch.removed[..removed_len].iter().any(|&v| scratch.beyond[usize::from(v)] <= slack) {
            removed_len = self.forgive(scratch, slack);
        }
        if removed_len == 0 {
            return Ok(());
        }
        if removed_len == self.len {
            self.len = 0;
            return Ok(());
        }
        let face = self.free_face()?;
        if !self.try_cut(scratch, removed_len, face) {
            let before = self.points;
            removed_len = self.mend(scratch);
            // Now both sides hang together and the cut cannot be torn; too little room it may have.
            if !self.try_cut(scratch, removed_len, face) {
                self.points = before;
                return Err(Error::BodyFull);
            }
        }
        self.planes[face] = *plane;
        self.planes_len = self.planes_len.max(face + 1);
        Ok(())
    }

    /// Puts vertices that are beyond a plane by no more than rounding on it. Returns how many are
    /// left beyond.
    ///
    /// Otherwise a plane along a flat body takes as much of it away as the last bits like; and one
    /// along a face leaves new vertices anywhere on it.
    #[cold]
    fn forgive(&self, scratch: &mut Scratch<V>, slack: f64) -> usize {
        let Scratch { beyond, removed, .. } = scratch;
        let mut len = 0;
        for v in 0..self.len {
            if beyond[v] > slack {
                removed[len] = v as u8;
                len += 1;
            } else {
                beyond[v] = min(beyond[v], 0.0);
            }
        }
        len
    }

    /// An unused plane's number: a fresh one, or that of a face that has been cut away.
    fn free_face(&self) -> Result<usize, Error> {
        if self.planes_len < F {
            return Ok(self.planes_len);
        }
        let mut used = FaceSet::<F>::NONE;
        for half in self.halves() {
            used.insert(self.left(half));
        }
        (6..F).find(|&face| !used.contains(face)).ok_or(Error::BodyFull)
    }

    /// Cuts along the edges between kept and removed vertices, if they form a single cycle that
    /// crosses no face twice, and there is room for a new vertex on each. Otherwise leaves the body
    /// as it is, and says so.
    #[inline(always)]
    fn try_cut(&mut self, scratch: &mut Scratch<V>, removed_len: usize, new_face: usize) -> bool {
        let Scratch { beyond, removed, cut } = scratch;
        let removed = &removed[..removed_len];
        let room = V - self.len + removed_len;
        let mut len = 0;
        for &v in removed {
            let ends = self.next[usize::from(v)];
            for edge in 0..3 {
                let start = usize::from(ends[edge]);
                let kept = start >> 2;
                if beyond[kept] > 0.0 {
                    continue;
                }
                if len == room {
                    return self.undo(removed);
                }
                let (half, point) = (after(start), self.divide(kept, usize::from(v), beyond));
                // New vertices go where removed ones were, then to the end.
                let slot = if len < removed.len() { removed[len] } else { (self.len + len - removed.len()) as u8 };
                cut[len] = Cut { point, half: half as u16, start: start as u16, slot, ..cut[len] };
                self.set_next(half, NEW | len);
                len += 1;
            }
        }

        // From each cut edge follow the face to its right, along the kept side, to the cut edge
        // where that face ends; and on from there, until the cycle closes.
        let (mut i, mut crossed, mut twice, mut steps) = (0, FaceSet::<F>::NONE, false, 0);
        loop {
            let mut half = usize::from(cut[i].start);
            let face = self.left(half);
            twice |= !crossed.insert(face);
            while half & NEW == 0 {
                half = self.next(half);
            }
            cut[i].next = (half & !NEW) as u16;
            cut[i].face = face as u8;
            i = half & !NEW;
            steps += 1;
            if i == 0 {
                break;
            }
        }
        if steps != len || twice {
            return self.undo(removed);
        }

        // The half-edges of a new vertex, counter-clockwise: back to the kept end, on to the next
        // new vertex, and to the one before. The new face is on the left of those in the middle.
        for edge in &cut[..len] {
            let (here, there) = (usize::from(edge.slot), usize::from(cut[usize::from(edge.next)].slot));
            let half = usize::from(edge.half);
            self.points[here] = edge.point;
            self.left[here] = [edge.face, new_face as u8, self.left(half) as u8, 0];
            self.set_next(half, 4 * here + 2);
            self.set_next(4 * here, usize::from(edge.start));
            self.set_next(4 * here + 1, 4 * there + 1);
            self.set_next(4 * there + 2, 4 * here);
        }
        self.len += len.saturating_sub(removed.len());
        for &hole in removed.get(len..).unwrap_or(&[]).iter().rev() {
            self.move_last_to(usize::from(hole));
        }
        true
    }

    /// Where the edge from a kept to a removed vertex meets the plane, measured from the end that
    /// is nearer to it.
    #[inline(always)]
    fn divide(&self, kept: usize, removed: usize, beyond: &[f64; V]) -> DVec3 {
        let (a, b) = (-beyond[kept], beyond[removed]);
        let (near, far) = if a <= b { (kept, removed) } else { (removed, kept) };
        self.points[near] + (self.points[far] - self.points[near]) * (min(a, b) / (a + b))
    }

    /// Links cut edges up again. Returns `false`, for a cut that failed.
    #[cold]
    fn undo(&mut self, removed: &[u8]) -> bool {
        for v in removed.iter().map(|v| usize::from(*v)) {
            for gone in 4 * v..4 * v + 3 {
                let half = after(self.next(gone));
                if self.next(half) & NEW != 0 {
                    self.set_next(half, before(gone));
                }
            }
        }
        false
    }

    /// Fills a hole in the table of vertices with its last one.
    fn move_last_to(&mut self, hole: usize) {
        self.len -= 1;
        if hole == self.len {
            return;
        }
        self.points[hole] = self.points[self.len];
        self.next[hole] = self.next[self.len];
        self.left[hole] = self.left[self.len];
        for half in 4 * hole..4 * hole + 3 {
            let twin = after(self.next(half));
            self.set_next(twin, before(half));
        }
    }

    /// Mends signs that rounding has spoiled: keeps what hangs together with the deepest vertex,
    /// and of the rest removes only what hangs together with the outermost one. Returns how many
    /// vertices are removed.
    ///
    /// Where faces are nearly in one plane, the place of a vertex between them is not known along
    /// it, so that vertex may be beyond the cut with all of its neighbours inside. Such vertices
    /// are kept and, if it is by more than rounding, drawn in along an edge until they are inside
    /// too: nothing is left beyond the cut, nor comes to be beyond another plane.
    #[cold]
    fn mend(&mut self, scratch: &mut Scratch<V>) -> usize {
        let Scratch { beyond, removed, .. } = scratch;
        let last_by = |better: fn(f64, f64) -> bool| {
            (0..self.len).fold(0, |best, v| if better(beyond[v], beyond[best]) { v } else { best })
        };
        let (deepest, outermost) = (last_by(|a, b| a < b), last_by(|a, b| a > b));
        let (mut kept, mut gone) = ([false; V], [false; V]);
        self.flood(&mut kept, deepest, |v| beyond[v] <= 0.0);
        self.flood(&mut gone, outermost, |v| !kept[v]);
        let (mut len, mut outside) = (0, 0);
        for v in 0..self.len {
            if gone[v] {
                beyond[v] = max(beyond[v], f64::MIN_POSITIVE);
                removed[len] = v as u8;
                len += 1;
            } else if beyond[v] > 0.0 {
                outside += 1;
            }
        }
        // What is kept hangs together, so of those outside one has a neighbour inside, until there
        // are none.
        for _ in 0..self.len {
            if outside == 0 {
                break;
            }
            for v in (0..self.len).filter(|&v| !gone[v]) {
                if beyond[v] > 0.0 && self.draw_in(v, beyond) {
                    beyond[v] = 0.0;
                    outside -= 1;
                }
            }
        }
        len
    }

    /// Moves a vertex beyond the cut along an edge to where the cut meets it: along the one that
    /// leaves the third face there the least. `false` if all neighbours are beyond the cut too.
    fn draw_in(&mut self, v: usize, beyond: &[f64; V]) -> bool {
        let mut least = f64::INFINITY;
        let mut place = self.points[v];
        for half in 4 * v..4 * v + 3 {
            let neighbour = self.next(half) >> 2;
            if beyond[neighbour] <= 0.0 {
                let point = self.divide(neighbour, v, beyond);
                let off = self.planes[self.left(after(half))].distance(point).abs();
                if off < least {
                    (least, place) = (off, point);
                }
            }
        }
        self.points[v] = place;
        least < f64::INFINITY
    }

    /// Marks all vertices that hang together with `start` through such as pass the test.
    fn flood(&self, marked: &mut [bool; V], start: usize, passes: impl Fn(usize) -> bool) {
        let mut found = [0_u8; V];
        found[0] = start as u8;
        marked[start] = true;
        let (mut len, mut done) = (1, 0);
        while done < len {
            for half in 4 * usize::from(found[done])..4 * usize::from(found[done]) + 3 {
                let v = self.next(half) >> 2;
                if !marked[v] && passes(v) {
                    marked[v] = true;
                    found[len] = v as u8;
                    len += 1;
                }
            }
            done += 1;
        }
    }
}

/// What a cut writes down on its way; kept from cut to cut, for clearing it costs a tenth of the
/// cut.
pub(super) struct Scratch<const V: usize> {
    /// How far each vertex is beyond the plane.
    beyond: [f64; V],
    /// The vertices beyond the plane. Long enough for any number of them that a byte can hold.
    removed: [u8; 256],
    /// The edges that the plane cuts.
    cut: [Cut; V],
}

impl<const V: usize> Scratch<V> {
    pub(super) fn new() -> Self {
        Self { beyond: [0.0; V], removed: [0; 256], cut: [Cut::UNUSED; V] }
    }
}

/// An edge between a kept and a removed vertex, and the new vertex on it.
#[derive(Clone, Copy)]
struct Cut {
    point: DVec3,
    /// The half-edge from the kept end.
    half: u16,
    /// The half-edge that follows on the way from the removed to the kept end.
    start: u16,
    /// The new vertex's number.
    slot: u8,
    /// The next edge along the cut, and the face between.
    next: u16,
    face: u8,
}

impl Cut {
    const UNUSED: Self = Self { point: DVec3::ZERO, half: 0, start: 0, slot: 0, next: 0, face: 0 };
}
