//! Derivatives of the subgrid model along each memory axis, in the form that the kernels on rows take.
//!
//! Check: adjointness through the energy identity, linear and wall-bounded profiles (tests of the model).

use super::super::layout::{Layout, Shape};
use super::super::operators_1d::{Operators1d, Taps};
use super::super::rows::{Columns, add_rows, pad};

/// Most values that one derivative reads: two neighbouring gradients at a no-slip wall.
const MOST_TAPS: usize = 8;

/// A linear operator along one axis.
#[derive(Debug, Clone)]
pub(super) struct Operator {
    axis: usize,
    shape: Shape,
    periodic: bool,
    rows: Vec<Taps>,
    columns: Columns,
}

impl Operator {
    fn new(layout: &Layout, axis: usize, rows: Vec<Taps>) -> Self {
        let periodic = layout.line[axis].is_periodic();
        let columns = if axis == 0 { Columns::new(&rows, periodic) } else { Columns::default() };
        Self { axis, shape: layout.shape, periodic, rows, columns }
    }

    /// `out +=` the operator on `field` at the targets of the row `at` (its indices along the axes 1 and 2).
    #[inline(always)]
    pub(super) fn add(&self, out: &mut [f64], field: &[f64], at: [usize; 2], padded: &mut [f64]) {
        if self.axis == 0 {
            self.add_along(out, &field[self.shape.row(at[0], at[1])], padded);
        } else {
            self.add_across(out, field, at);
        }
    }

    /// `out +=` an operator of axis 1 or 2 on `field` at the targets of the row `at`.
    #[inline(always)]
    pub(super) fn add_across(&self, out: &mut [f64], field: &[f64], at: [usize; 2]) {
        let own = &self.rows[at[self.axis - 1]];
        let mut taps = [(0, 0.0); MOST_TAPS];
        for (tap, &(index, c)) in taps.iter_mut().zip(own) {
            let row = if self.axis == 1 { self.shape.row(index, at[1]) } else { self.shape.row(at[0], index) };
            *tap = (row.start, c);
        }
        add_rows(out, field, &taps[..own.len().min(MOST_TAPS)]);
    }

    /// `out +=` an operator of axis 0 on one row.
    #[inline(always)]
    pub(super) fn add_along(&self, out: &mut [f64], row: &[f64], padded: &mut [f64]) {
        pad(padded, row, self.periodic);
        self.columns.add(out, padded);
    }
}

/// The operators of a layout.
#[derive(Debug, Clone)]
pub(super) struct Operators {
    pub(super) shape: Shape,
    pub(super) periodic: [bool; 3],
    /// From the faces of each axis to the centres, `m^-1 Dw`.
    pub(super) to_cells: [Operator; 3],
    /// From the centres of each axis to the faces, `-f^-1 Dw^T`; nothing on walls.
    pub(super) to_faces: [Operator; 3],
    /// Half the mean of the gradients at the two faces of each cell, walls included.
    pub(super) half_mean_gradient: [Operator; 3],
    /// What the walls of an axis add to it for each component: `[axis][component]`.
    pub(super) wall_source: [[Vec<f64>; 3]; 3],
    /// `h^(2/3)` of the cells of each axis: their product is the square of the filter width.
    pub(super) width: [Vec<f64>; 3],
    /// Largest decay rate by a unit viscosity along each axis, `49/9 h^-2`; zero along a thin one \[1/m^2\].
    pub(super) decay: [Vec<f64>; 3],
}

/// Largest symbol of the fourth-order Laplacian times the square of the spacing.
const LAPLACIAN_SYMBOL: f64 = 49.0 / 9.0;

impl Operators {
    pub(super) fn new(layout: &Layout) -> Self {
        let operator = |axis: usize, rows| Operator::new(layout, axis, rows);
        Self {
            shape: layout.shape,
            periodic: std::array::from_fn(|axis| layout.line[axis].is_periodic()),
            to_cells: std::array::from_fn(|axis| operator(axis, divergence(&layout.line[axis]))),
            to_faces: std::array::from_fn(|axis| operator(axis, layout.line[axis].gradient())),
            half_mean_gradient: std::array::from_fn(|axis| operator(axis, half_mean_gradient(&layout.line[axis]).0)),
            wall_source: std::array::from_fn(|axis| {
                let walls = half_mean_gradient(&layout.line[axis]).1;
                std::array::from_fn(|component| {
                    let [low, high] = layout.wall_velocity_m_s(axis, component);
                    walls.iter().map(|wall| wall[0] * low + wall[1] * high).collect()
                })
            }),
            width: std::array::from_fn(|axis| {
                layout.line[axis].cell_metric_m.iter().map(|h| h.powf(2.0 / 3.0)).collect()
            }),
            decay: std::array::from_fn(|axis| {
                let line = &layout.line[axis];
                let symbol = if line.is_thin() { 0.0 } else { LAPLACIAN_SYMBOL };
                line.cell_metric_m.iter().map(|h| symbol / (h * h)).collect()
            }),
        }
    }

    /// The index of the face or centre after `index`; `None` beyond the end of a bounded axis.
    pub(super) fn after(&self, axis: usize, index: usize) -> Option<usize> {
        if index + 1 < self.shape.n[axis] { Some(index + 1) } else { self.periodic[axis].then_some(0) }
    }

    /// The index of the centre before `index`. On a wall, where there is none and no stress, it is `index`.
    pub(super) fn before(&self, axis: usize, index: usize) -> usize {
        if index > 0 {
            index - 1
        } else if self.periodic[axis] {
            self.shape.n[axis] - 1
        } else {
            0
        }
    }
}

/// Rows of `m^-1 Dw` over the stored faces.
fn divergence(line: &Operators1d) -> Vec<Taps> {
    let mut rows = line.stored_divergence();
    for (row, mass) in rows.iter_mut().zip(&line.cell_mass_m) {
        for tap in row {
            tap.1 /= mass;
        }
    }
    rows
}

/// Half the mean of the gradients at the two faces of each cell: rows over the cells, and the coefficients of the velocities
/// of the low and of the high wall. At a slip wall the gradient of what flows along it is zero.
fn half_mean_gradient(line: &Operators1d) -> (Vec<Taps>, Vec<[f64; 2]>) {
    let n = line.cells;
    let adjoint = line.adjoint();
    let sticks = line.no_slip();
    let mut rows = vec![Taps::new(); n];
    let mut walls = vec![[0.0; 2]; n];
    for (cell, row) in rows.iter_mut().enumerate() {
        let mut sums = vec![0.0; n];
        for face in [cell, cell + 1] {
            let face = if line.is_periodic() { face % n } else { face };
            let side = usize::from(face == n);
            let factor = -0.25 / line.face_mass_m[face];
            let at_wall = !line.is_periodic() && (face == 0 || face == n);
            if at_wall && !sticks[side] {
                continue;
            }
            for &(other, weight) in &adjoint[face] {
                sums[other] += factor * weight;
            }
            if at_wall {
                // As in the Laplacian: the wall's velocity has weight -1 at the low and +1 at the high end.
                walls[cell][side] += factor * if side == 0 { 1.0 } else { -1.0 };
            }
        }
        row.extend(sums.into_iter().enumerate().filter(|(_, c)| *c != 0.0));
    }
    (rows, walls)
}
