//! Fluxes across rows that the convection of one row leaves for its neighbours: each acts on four rows and is computed once, as
//! long as rows are asked for in the order of memory.
//!
//! Check: the literal form of the convection; the same bits from any order of rows.

/// Fluxes along one axis that act on one row.
pub(super) const SLOTS: usize = 4;

/// Rows of fluxes along the axes 1 and 2 of one velocity component.
#[derive(Debug, Default)]
pub(super) struct KeptFluxes {
    /// For each axis the last four rows of each place across it.
    pub(super) values: [Vec<f64>; 2],
    /// Where the row of each begins in a field; of none, and behind them the component.
    pub(super) starts: [Vec<usize>; 2],
}

impl KeptFluxes {
    /// Room for a component (its memory axis) on a mesh of `n` cells, empty if it was another one's.
    #[inline(always)]
    pub(super) fn fit(&mut self, component: usize, n: [usize; 3]) {
        for (axis, places) in [SLOTS, SLOTS * n[1]].into_iter().enumerate() {
            let starts = &mut self.starts[axis];
            if starts.len() != places + 1 || starts[places] != component {
                starts.clear();
                starts.resize(places, usize::MAX);
                starts.push(component);
                self.values[axis].resize(places * n[0], 0.0);
            }
        }
    }
}
