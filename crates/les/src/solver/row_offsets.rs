//! Where rows begin in an array: numbers that are copied, not closures, which would stay calls in functions that are compiled for
//! several instruction sets.
//!
//! Check: the places of a shape (tests of `shape`).

/// Where the rows of some index begin in an array.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowOffsets {
    /// That of index 0 in an array that goes on downwards.
    pub(crate) first: usize,
    pub(crate) step: usize,
    /// Index below which rows lie `round` further.
    pub(crate) lowest: usize,
    pub(crate) round: usize,
}

impl RowOffsets {
    /// Rows of `step` values, of which that of index `lowest` is the first.
    #[inline(always)]
    pub(crate) fn every(step: usize, lowest: usize) -> Self {
        Self { first: 0_usize.wrapping_sub(lowest * step), step, lowest: 0, round: 0 }
    }

    /// That of index `i`.
    #[inline(always)]
    pub(crate) fn of(self, i: usize) -> usize {
        let start = self.first.wrapping_add(i * self.step);
        if i < self.lowest { start.wrapping_add(self.round) } else { start }
    }
}
