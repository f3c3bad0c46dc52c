//! Line solves of the implicit viscosity, `(1 - a L) x = r` along one axis.
//!
//! With the masses as weights the matrix is symmetric and positive definite, so it is factored once
//! per time step length as `L D L^T` without pivoting. Its envelope is seven bands wide; walls and
//! periods add a few entries outside, which are kept as further taps of their rows. Lines are
//! solved side by side, so that the elimination runs over contiguous values.
//!
//! Check: residuals against the explicit operator, every kind of end.

use rayon::prelude::*;

use super::component_operators::ComponentOperators;
use super::layout::Shape;
use super::operators_1d::Taps;
use super::pressure::{Pencil, pencils};
use super::rows::RowOffsets;
use super::rows::add_across;
use super::slabs::Slabs;
use crate::Error;

/// Factors of `1 - a L` along one axis for one component.
#[derive(Debug, Clone)]
pub(crate) struct LineSolver {
    pub(super) component: usize,
    pub(super) axis: usize,
    mass: Vec<f64>,
    inverse_pivot: Vec<f64>,
    /// Rows of `-L` below the diagonal and of `-L^T` above it.
    lower: Vec<Taps>,
    upper: Vec<Taps>,
}

/// The factors of all components along the implicit axes, `a_m2` being viscosity times the
/// implicit part of a stage \[m^2\]: from `made`, those of the last stages, or new ones.
pub(crate) fn solvers_for_stage<'a>(
    made: &'a mut Vec<(f64, Vec<LineSolver>)>,
    ops: &[ComponentOperators; 3],
    implicit: [bool; 3],
    a_m2: f64,
) -> &'a [LineSolver] {
    let found = made.iter().position(|(a, _)| *a == a_m2);
    let index = found.unwrap_or_else(|| {
        // A fixed step has at most three stages of different length; a variable one always needs
        // new factors.
        made.truncate(2);
        let axes = (0..3).filter(|&axis| implicit[axis]);
        let solvers = ops.iter().flat_map(|ops| {
            axes.clone()
                .map(move |axis| LineSolver::new(ops, axis, a_m2))
        });
        made.insert(0, (a_m2, solvers.collect()));
        0
    });
    &made[index].1
}

/// Lines of axis 0 that are solved side by side.
const TILE: usize = 16;
/// Lines of axis 2 that are solved side by side: a gathered strip stays in the second cache.
const COLUMNS: usize = 64;

impl LineSolver {
    /// Factors `1 - a L` of component `ops` along `axis`, `a_s_m2` being half the time step times
    /// the viscosity \[m^2\].
    pub(crate) fn new(ops: &ComponentOperators, axis: usize, a_m2: f64) -> Self {
        let mass = ops.mass[axis].clone();
        let n = mass.len();
        let [mut lower, mut upper] = [vec![Taps::new(); n], vec![Taps::new(); n]];
        let mut pivot = vec![0.0; n];
        for (i, row) in ops.laplacian[axis].rows.iter().enumerate() {
            // Row i of the factor, from its first entry to the diagonal.
            let first = row
                .iter()
                .map(|tap| tap.0)
                .filter(|j| *j <= i)
                .min()
                .unwrap_or(i);
            let mut work = vec![0.0; i - first + 1];
            work[i - first] = mass[i];
            for &(j, c) in row.iter().filter(|tap| tap.0 <= i) {
                work[j - first] -= a_m2 * mass[i] * c;
            }
            for j in first..i {
                // work[j] holds l_ij d_j once the earlier columns are taken off.
                let sum: f64 = lower[j]
                    .iter()
                    .filter(|t| t.0 >= first)
                    .map(|&(p, l)| l * work[p - first])
                    .sum();
                work[j - first] += sum;
            }
            let mut diagonal = work[i - first];
            for j in first..i {
                let value = work[j - first];
                if value != 0.0 {
                    diagonal -= value * value / pivot[j];
                    lower[i].push((j, -value / pivot[j]));
                    upper[j].push((i, -value / pivot[j]));
                }
            }
            pivot[i] = diagonal;
        }
        Self {
            component: ops.axis,
            axis,
            mass,
            inverse_pivot: pivot.iter().map(|d| 1.0 / d).collect(),
            lower,
            upper,
        }
    }

    /// Replaces the planes of a field that are owned by the solution.
    ///
    /// # Errors
    /// Those of the exchange between ranks.
    pub(crate) fn solve(&self, slabs: &Slabs, own: &mut [f64]) -> Result<(), Error> {
        let shape = slabs.shape;
        match self.axis {
            0 => own
                .par_chunks_mut(shape.n[0] * TILE)
                .for_each(|rows| self.solve_tile(rows, shape.n[0])),
            1 => own
                .par_chunks_mut(shape.plane())
                .for_each(|plane| solve_block(self, plane, shape.n[0])),
            _ => slabs.transposed(own, 1, |field, shape, _| {
                self.solve_across_planes(shape, field)
            })?,
        }
        Ok(())
    }

    /// Lines along axis 0: a few rows are transposed so that they lie side by side.
    fn solve_tile(&self, rows: &mut [f64], n: usize) {
        let width = rows.len() / n;
        let mut block = vec![0.0; rows.len()];
        for (r, row) in rows.chunks_exact(n).enumerate() {
            for (i, value) in row.iter().enumerate() {
                block[i * width + r] = *value;
            }
        }
        solve_block(self, &mut block, width);
        for (r, row) in rows.chunks_exact_mut(n).enumerate() {
            for (i, value) in row.iter_mut().enumerate() {
                *value = block[i * width + r];
            }
        }
    }

    /// Lines along axis 2: some neighbours are gathered from all planes, for rows of the same place
    /// in all planes get in each other's way in the caches.
    fn solve_across_planes(&self, shape: Shape, field: &mut [f64]) {
        pencils(field, shape, 2, COLUMNS)
            .par_iter_mut()
            .for_each_init(Vec::new, |block: &mut Vec<f64>, Pencil { rows, .. }| {
                let width = rows[0].len();
                block.clear();
                rows.iter().for_each(|row| block.extend_from_slice(row));
                solve_block(self, block, width);
                rows.iter_mut()
                    .zip(block.chunks(width))
                    .for_each(|(row, solved)| row.copy_from_slice(solved));
            });
    }
}

/// Solves lines that run across the rows of `block`, which are `width` long.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn solve_block(solver: &LineSolver, block: &mut [f64], width: usize) {
    for i in 0..solver.mass.len() {
        let (before, rest) = block.split_at_mut(i * width);
        let row = &mut rest[..width];
        for value in row.iter_mut() {
            *value *= solver.mass[i];
        }
        add_taps(row, before, &solver.lower[i], 0);
    }
    for i in (0..solver.mass.len()).rev() {
        let (head, after) = block.split_at_mut((i + 1) * width);
        let row = &mut head[i * width..];
        for value in row.iter_mut() {
            *value *= solver.inverse_pivot[i];
        }
        add_taps(row, after, &solver.upper[i], i + 1);
    }
}

/// `row += sum c x_i`, `x_i` being the rows of `other`, the first of which has index `first`.
#[inline(always)]
fn add_taps(row: &mut [f64], other: &[f64], taps: &[(usize, f64)], first: usize) {
    let n = row.len();
    for taps in taps.chunks(4) {
        if let [a, b, c] = *taps {
            let x = &other[(a.0 - first) * n..][..n];
            let y = &other[(b.0 - first) * n..][..n];
            let z = &other[(c.0 - first) * n..][..n];
            for i in 0..n {
                row[i] += (a.1 * x[i] + b.1 * y[i]) + c.1 * z[i];
            }
        } else {
            add_across(row, other, 1.0, taps, RowOffsets::every(n, first));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::layout::Layout;
    use super::super::mesh::{Direction, Mesh, Spread, Wall};
    use super::*;

    #[test]
    fn solutions_satisfy_the_explicit_operator_on_every_axis_and_kind_of_end() {
        let a_m2 = 0.02;
        let kinds = [
            Direction::periodic(20, 0.0, 1.0).stretched(Spread::Sine.by(0.5)),
            Direction::between(21, 0.0, 1.0, Wall::AT_REST, Wall::Slip)
                .stretched(Spread::TanhLow.by(1.5)),
            Direction::between(18, 0.0, 1.0, Wall::AT_REST, Wall::AT_REST),
        ];
        for shift in 0..3 {
            let d = |i: usize| kinds[(i + shift) % 3].clone();
            let layout = Layout::new(&Mesh::new(d(0), d(1), d(2)).unwrap());
            let shape = layout.shape;
            let [nx, ny, _] = shape.n;
            for component in 0..3 {
                let ops = ComponentOperators::new(&layout, component);
                for axis in 0..3 {
                    let right: Vec<f64> =
                        (0..shape.len()).map(|i| ((i * i) as f64).sin()).collect();
                    let mut x = right.clone();
                    LineSolver::new(&ops, axis, a_m2)
                        .solve(&layout.slabs, &mut x)
                        .unwrap();
                    let stride = [1, nx, nx * ny][axis];
                    for place in 0..shape.len() {
                        let index = place / stride % shape.n[axis];
                        let origin = place - index * stride;
                        let applied: f64 = ops.laplacian[axis].rows[index]
                            .iter()
                            .map(|&(i, c)| c * x[origin + i * stride])
                            .sum();
                        let residual = x[place] - a_m2 * applied - right[place];
                        assert!(
                            residual.abs() < 1e-11,
                            "component {component}, axis {axis}, {index}: {residual}"
                        );
                    }
                }
            }
        }
    }
}
