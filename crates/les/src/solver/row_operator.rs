//! A linear operator along one memory axis, applied to one row at a time.

use super::layout::{Layout, Shape};
use super::operators_1d::Taps;
use super::rows::RowOffsets;
use super::rows::{Columns, HALO, add_across, add_even, from_places, pad, rows_from};

/// A linear operator along one axis.
#[derive(Debug, Clone)]
pub(crate) struct RowOperator {
    axis: usize,
    shape: Shape,
    pub(super) periodic: bool,
    /// For each target the places and their coefficients.
    pub(super) rows: Vec<Taps>,
    pub(super) columns: Columns,
    /// Coefficients of the pairs at the distances 1, 2 and 3, the same in all rows, of a second
    /// difference on equal periodic cells.
    pub(super) even: Option<[f64; 3]>,
}

impl RowOperator {
    /// The operator with the rows `rows` along memory axis `axis`.
    pub(crate) fn new(layout: &Layout, axis: usize, rows: Vec<Taps>) -> Self {
        let periodic = layout.line[axis].is_periodic();
        let columns = if axis == 0 {
            Columns::new(&rows, periodic)
        } else {
            Columns::default()
        };
        Self {
            axis,
            shape: layout.shape,
            periodic,
            rows,
            columns,
            even: None,
        }
    }

    /// `out +=` the operator on `field` at the targets of the row `at` (its indices along the axes
    /// 1 and 2).
    #[inline(always)]
    pub(crate) fn add(&self, out: &mut [f64], field: &[f64], at: [usize; 2], padded: &mut [f64]) {
        if self.axis == 0 {
            self.add_along(out, &field[self.shape.row(at[0], at[1])], padded);
        } else {
            self.add_across(out, field, at);
        }
    }

    /// `out +=` an operator of axis 1 or 2 on `field` at the targets of the row `at`.
    #[inline(always)]
    pub(crate) fn add_across(&self, out: &mut [f64], field: &[f64], at: [usize; 2]) {
        let index = at[self.axis - 1];
        let starts = self.shape.row_offsets(self.axis, at);
        if let Some(pairs) = self.even {
            let count = self.shape.n[self.axis];
            add_even(
                out,
                pairs,
                &rows_from(field, out.len(), starts, index + 3 * count - 3, count),
            );
        } else {
            add_across(out, field, 1.0, &self.rows[index], starts);
        }
    }

    /// `out +=` an operator of axis 1 at row `j` of a plane that stands alone.
    #[inline(always)]
    pub(crate) fn add_in_plane(&self, out: &mut [f64], plane: &[f64], j: usize) {
        add_across(
            out,
            plane,
            1.0,
            &self.rows[j],
            RowOffsets::every(self.shape.n[0], 0),
        );
    }

    /// `out =` an operator of axis 0 on one row.
    #[inline(always)]
    pub(crate) fn along(&self, out: &mut [f64], row: &[f64], padded: &mut [f64]) {
        out.fill(0.0);
        self.add_along(out, row, padded);
    }

    /// `out +=` an operator of axis 0 on one row.
    #[inline(always)]
    pub(crate) fn add_along(&self, out: &mut [f64], row: &[f64], padded: &mut [f64]) {
        pad(padded, row, self.periodic);
        if let Some(pairs) = self.even {
            const FIRST: usize = HALO - 3;
            let places = from_places!(
                padded,
                FIRST,
                FIRST + 1,
                FIRST + 2,
                FIRST + 3,
                FIRST + 4,
                FIRST + 5,
                FIRST + 6
            );
            add_even(out, pairs, &places);
        } else {
            self.columns.add(out, padded);
        }
    }
}
