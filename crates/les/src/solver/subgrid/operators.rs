//! Derivatives of the subgrid model along each memory axis, in the form that the kernels on rows
//! take.
//!
//! Check: adjointness through the energy identity, linear and wall-bounded profiles (tests of the
//! model).

use super::super::layout::{Layout, Shape};
use super::super::operators_1d::{LAPLACIAN_SYMBOL, Operators1d, Taps};
use super::super::row_operator::RowOperator;

/// The operators of a layout.
#[derive(Debug, Clone)]
pub(super) struct Operators {
    pub(super) shape: Shape,
    pub(super) periodic: [bool; 3],
    /// From the faces of each axis to the centres, `m^-1 Dw`.
    pub(super) to_cells: [RowOperator; 3],
    /// From the centres of each axis to the faces, `-f^-1 Dw^T`; nothing on walls.
    pub(super) to_faces: [RowOperator; 3],
    /// Half the mean of the gradients at the two faces of each cell, walls included.
    pub(super) half_mean_gradient: [RowOperator; 3],
    /// What the walls of an axis add to it for each component: `[axis][component]`.
    pub(super) wall_source: [[Vec<f64>; 3]; 3],
    /// `h^(2/3)` of the cells of each axis: their product is the square of the filter width.
    pub(super) width: [Vec<f64>; 3],
    /// What viscosity, strained velocity and stress need of their halos: planes below and above a
    /// slab.
    pub(super) reach: [usize; 2],
    /// Largest decay rate by a unit viscosity along each axis, `49/9 h^-2`; zero along a thin one
    /// \[1/m^2\].
    pub(super) decay: [Vec<f64>; 3],
}

/// A row of cells, by its indices along the axes 1 and 2, and the velocity about it.
pub(super) struct Row<'a> {
    pub(super) operators: &'a Operators,
    pub(super) velocity: [&'a [f64]; 3],
    pub(super) at: [usize; 2],
}

impl Operators {
    pub(super) fn new(layout: &Layout) -> Self {
        let line = &layout.line;
        let to_cells: [RowOperator; 3] =
            std::array::from_fn(|axis| RowOperator::new(layout, axis, divergence(&line[axis])));
        let to_faces: [RowOperator; 3] =
            std::array::from_fn(|axis| RowOperator::new(layout, axis, line[axis].gradient()));
        let [cells_below, cells_above] = layout.slabs.reach(&to_cells[2].rows);
        let [faces_below, faces_above] = layout.slabs.reach(&to_faces[2].rows);
        Self {
            shape: layout.shape,
            // Of the viscosity the plane below is needed.
            reach: [
                cells_below.max(faces_below).max(1),
                cells_above.max(faces_above),
            ],
            periodic: std::array::from_fn(|axis| line[axis].is_periodic()),
            to_cells,
            to_faces,
            half_mean_gradient: std::array::from_fn(|axis| {
                RowOperator::new(layout, axis, line[axis].half_mean_gradient().0)
            }),
            wall_source: std::array::from_fn(|axis| {
                let walls = line[axis].half_mean_gradient().1;
                std::array::from_fn(|component| layout.wall_source(axis, component, &walls))
            }),
            width: std::array::from_fn(|axis| {
                let metric_m = line[axis].cell_metric_m.iter();
                metric_m.map(|h| h.powf(2.0 / 3.0)).collect()
            }),
            decay: std::array::from_fn(|axis| decay_by_unit_viscosity(&line[axis])),
        }
    }

    /// The index of the face or centre after `index`; `None` beyond the end of a bounded axis.
    pub(super) fn after(&self, axis: usize, index: usize) -> Option<usize> {
        if index + 1 < self.shape.n[axis] {
            Some(index + 1)
        } else {
            self.periodic[axis].then_some(0)
        }
    }

    /// The index of the centre before `index`. On a wall, where there is none and no stress, it is
    /// `index`.
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

/// Largest decay rate by a unit viscosity along a direction, `49/9 h^-2`; zero along a thin one
/// \[1/m^2\].
fn decay_by_unit_viscosity(line: &Operators1d) -> Vec<f64> {
    let symbol = if line.is_thin() {
        0.0
    } else {
        LAPLACIAN_SYMBOL
    };
    let metric_m = line.cell_metric_m.iter();
    metric_m.map(|h| symbol / (h * h)).collect()
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
