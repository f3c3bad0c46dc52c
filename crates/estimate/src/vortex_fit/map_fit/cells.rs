//! The velocities of a map that a fit uses, and sums over them.

use ndarray::Array2;

use crate::linalg::dot;
use crate::vortex_fit::VelocityMap;

/// A velocity that is used \[m/s\]: where it is, and its standard deviation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cell {
    pub(crate) line: usize,
    pub(crate) gate: usize,
    pub(crate) velocity_m_s: f64,
    pub(crate) sigma_m_s: f64,
}

/// Residuals and, by free number, slopes of the expected velocities, both over their deviations and white.
pub(crate) struct Rows {
    pub(crate) residuals: Vec<f64>,
    pub(crate) slopes: Vec<Vec<f64>>,
}

/// The velocities that there are, each with its stated deviation.
pub(crate) fn cells(map: &VelocityMap<'_>) -> Vec<Cell> {
    let mut cells = Vec::new();
    for ((line, gate), &velocity_m_s) in map.velocity_m_s.indexed_iter() {
        if velocity_m_s.is_finite() {
            cells.push(Cell {
                line,
                gate,
                velocity_m_s,
                sigma_m_s: map.deviation(line, gate),
            });
        }
    }
    cells
}

/// Numbers times their weights.
pub(crate) fn scaled(weights: &[f64], numbers: &[f64]) -> Vec<f64> {
    weights.iter().zip(numbers).map(|(w, x)| w * x).collect()
}

/// Sums of products of columns of numbers with those weights.
pub(crate) fn products(weights: &[f64], columns: &[Vec<f64>]) -> Array2<f64> {
    let mut out = Array2::zeros((columns.len(), columns.len()));
    for (i, a) in columns.iter().enumerate() {
        let scaled = scaled(weights, a);
        for (j, b) in columns.iter().enumerate().take(i + 1) {
            let product = dot(&scaled, b);
            out[[i, j]] = product;
            out[[j, i]] = product;
        }
    }
    out
}

/// Orthonormal basis of columns of numbers, twice by Gram and Schmidt; columns that depend on those before have none.
pub(crate) fn orthonormal(columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for column in columns {
        let mut rest = column.clone();
        let before = dot(column, column);
        (0..2).for_each(|_| remove(&basis, &mut rest));
        let norm = dot(&rest, &rest);
        if norm > 1e-12 * before {
            rest.iter_mut().for_each(|x| *x /= norm.sqrt());
            basis.push(rest);
        }
    }
    basis
}

/// Removes the part along an orthonormal basis from numbers.
fn remove(basis: &[Vec<f64>], numbers: &mut [f64]) {
    for direction in basis {
        let part = dot(direction, numbers);
        numbers
            .iter_mut()
            .zip(direction)
            .for_each(|(number, d)| *number -= part * d);
    }
}
