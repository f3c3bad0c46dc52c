//! Fluxes across rows that are kept until all rows on which they act are computed.

/// Fluxes along one axis that act on one row.
pub(super) const SLOTS: usize = 4;

/// Fluxes along the axes 1 and 2 of one component of one velocity field: each acts on four rows and is computed once, as long as rows
/// are asked for in the order of memory.
#[derive(Debug, Default)]
pub(super) struct FluxCache {
    /// For each axis the last four rows of each place across it.
    pub(super) values: [Vec<f64>; 2],
    /// Offset in the field of each row that is cached, `usize::MAX` of none.
    pub(super) offsets: [Vec<usize>; 2],
}

impl FluxCache {
    /// Room on a mesh of `n` cells.
    #[inline(always)]
    pub(super) fn fit(&mut self, n: [usize; 3]) {
        for (axis, places) in [SLOTS, SLOTS * n[1]].into_iter().enumerate() {
            self.offsets[axis].resize(places, usize::MAX);
            self.values[axis].resize(places * n[0], 0.0);
        }
    }
}
