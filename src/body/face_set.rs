//! Sets of faces, by number.

/// A set of the numbers below `F`: one word where that is enough, which the compiler knows, and two
/// up to 128.
#[derive(Clone, Copy)]
pub(super) struct FaceSet<const F: usize> {
    low: u64,
    high: u64,
}

impl<const F: usize> FaceSet<F> {
    pub(super) const MOST: usize = 128;
    pub(super) const NONE: Self = Self { low: 0, high: 0 };

    /// Adds a face. Returns whether it is new.
    #[inline(always)]
    pub(super) fn insert(&mut self, face: usize) -> bool {
        let (word, bit) =
            if F <= 64 || face < 64 { (&mut self.low, 1 << face) } else { (&mut self.high, 1 << (face - 64)) };
        let new = *word & bit == 0;
        *word |= bit;
        new
    }

    pub(super) fn contains(mut self, face: usize) -> bool {
        !self.insert(face)
    }
}
