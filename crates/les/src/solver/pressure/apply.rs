//! The operator of the pressure equation, applied to a field.
//!
//! Check: symmetry, constants, products of the directions' own operators.

use multiversion::multiversion;
use rayon::prelude::*;

use super::super::layout::{Layout, Shape};
use super::super::line::{Line, Taps};
use super::super::rows::{self, Columns, HALO, pad};
use super::kernel;

/// `sum_b (prod_{d != b} m_d) Dw_b f_b^-1 Dw_b^T`.
///
/// Every row is applied to the differences from its own cell: a constant leaves exactly nothing, however large it is.
#[derive(Debug)]
pub(crate) struct Operator {
    shape: Shape,
    mass_m: [Vec<f64>; 3],
    /// `Dw_0 f_0^-1 Dw_0^T` by columns.
    along: Columns,
    periodic: bool,
    /// `Dw_b f_b^-1 Dw_b^T` of the other two axes by rows, without the diagonals.
    across: [Vec<Taps>; 2],
    /// Ratio of the largest eigenvalue to the smallest that is not zero, about.
    condition: f64,
}

/// Rows that are treated at a time.
const ROWS: usize = 64;

impl Operator {
    /// The operator of a mesh.
    pub(crate) fn new(layout: &Layout) -> Self {
        let rows: [Vec<Taps>; 3] = std::array::from_fn(|b| stiffness(&layout.line[b]));
        let condition = condition(layout, &rows);
        let periodic = layout.line[0].is_periodic();
        let neighbours = |rows: &[Taps]| -> Vec<Taps> {
            let others = |(i, row): (usize, &Taps)| row.iter().copied().filter(|tap| tap.0 != i).collect();
            rows.iter().enumerate().map(others).collect()
        };
        Self {
            shape: layout.shape,
            mass_m: std::array::from_fn(|b| layout.line[b].cell_mass_m.clone()),
            along: Columns::new(&rows[0], periodic),
            periodic,
            across: [neighbours(&rows[1]), neighbours(&rows[2])],
            condition,
        }
    }

    /// Shape of its fields.
    pub(crate) fn shape(&self) -> Shape {
        self.shape
    }

    /// Ratio of the largest eigenvalue to the smallest that is not zero, about: what round-off of the solution is multiplied
    /// by in the residual of the longest waves.
    pub(crate) fn condition(&self) -> f64 {
        self.condition
    }

    /// Places in `residual` what `phi` leaves of the right side, `-g - A phi`, and returns its 2-norm.
    pub(crate) fn residual(&self, g: &[f64], phi: &[f64], residual: &mut [f64]) -> f64 {
        let n0 = self.shape.n[0];
        let chunks = residual.par_chunks_mut(ROWS * n0).enumerate();
        let squares: Vec<f64> = chunks
            .map_init(
                || vec![0.0; n0 + 2 * HALO],
                |padded, (c, chunk)| {
                    let rows = chunk.chunks_mut(n0).enumerate();
                    rows.map(|(r, out)| residual_row(self, g, phi, c * ROWS + r, out, padded)).sum()
                },
            )
            .collect();
        squares.iter().sum::<f64>().sqrt()
    }

    /// 2-norm of what the last digit of `phi` leaves.
    pub(crate) fn round_off(&self, phi: &[f64]) -> f64 {
        let [n0, n1, _] = self.shape.n;
        let sum = |taps: &Taps| {
            taps.iter().map(|tap| tap.1 * tap.1).sum::<f64>() + taps.iter().map(|tap| tap.1).sum::<f64>().powi(2)
        };
        let own: [Vec<f64>; 3] = [
            self.along.squares(n0),
            self.across[0].iter().map(sum).collect(),
            self.across[1].iter().map(sum).collect(),
        ];
        let squares = phi.par_chunks(n0).enumerate().map(|(r, row)| {
            let (j, k) = (r % n1, r / n1);
            let mass = |b: usize, i: usize| self.mass_m[b][i];
            let terms = row.iter().enumerate().map(|(i, phi)| {
                let [a, b, c] = [mass(1, j) * mass(2, k), mass(0, i) * mass(2, k), mass(0, i) * mass(1, j)];
                (a * a * own[0][i] + b * b * own[1][j] + c * c * own[2][k]) * phi * phi
            });
            terms.sum::<f64>()
        });
        0.5 * f64::EPSILON * squares.collect::<Vec<f64>>().iter().sum::<f64>().sqrt()
    }

    /// 2-norm of the residual over that of the right side `g`.
    pub(crate) fn relative_residual(&self, g: &[f64], phi: &[f64]) -> f64 {
        let left = self.residual(g, phi, &mut vec![0.0; g.len()]);
        let size = norm(self.shape, g);
        if size > 0.0 { left / size } else { 0.0 }
    }

    /// Subtracts from a right side the multiple of the cells' masses that makes its sum zero, if that is more than round-off;
    /// returns the sum over the sum of the moduli.
    pub(crate) fn remove_imbalance(&self, g: &mut [f64]) -> f64 {
        let [n0, n1, _] = self.shape.n;
        let rows: Vec<[f64; 2]> = g.par_chunks(ROWS * n0).map(kernel::sum_and_moduli).collect();
        let [sum, moduli] = rows.iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        if sum.abs() <= BALANCED * moduli {
            return if moduli > 0.0 { sum / moduli } else { 0.0 };
        }
        let volume: f64 = self.mass_m.iter().map(|mass| mass.iter().sum::<f64>()).product();
        g.par_chunks_mut(n0).enumerate().for_each(|(r, row)| {
            let mass = self.mass_m[1][r % n1] * self.mass_m[2][r / n1] * sum / volume;
            for (g, m0) in row.iter_mut().zip(&self.mass_m[0]) {
                *g -= mass * m0;
            }
        });
        sum / moduli
    }

    /// Multiplies each value by the mass of its cell.
    pub(crate) fn weigh(&self, field: &mut [f64]) {
        let [n0, n1, _] = self.shape.n;
        field.par_chunks_mut(n0).enumerate().for_each(|(r, row)| {
            let mass = self.mass_m[1][r % n1] * self.mass_m[2][r / n1];
            for (value, m0) in row.iter_mut().zip(&self.mass_m[0]) {
                *value *= mass * m0;
            }
        });
    }
}

/// Sum of a right side, relative to that of its moduli, that is round-off.
const BALANCED: f64 = 4.0 * f64::EPSILON;

/// Residual of row `r` of memory; returns the sum of its squares, in eight lanes.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+fma", "x86_64+avx2+fma", "aarch64+neon"))]
fn residual_row(op: &Operator, g: &[f64], phi: &[f64], r: usize, out: &mut [f64], padded: &mut [f64]) -> f64 {
    let [n0, n1, _] = op.shape.n;
    let (j, k) = (r % n1, r / n1);
    let at = op.shape.row(j, k);
    let own = &phi[at.clone()];
    let (m1, m2) = (op.mass_m[1][j], op.mass_m[2][k]);
    out.fill(0.0);
    let mut taps = [(0, 0.0); MOST_TAPS];
    let mut count = 0;
    let below = op.across[0][j].iter().map(|&(i, c)| (op.shape.row(i, k).start, c * m2));
    let aside = op.across[1][k].iter().map(|&(i, c)| (op.shape.row(j, i).start, c * m1));
    for (tap, new) in taps.iter_mut().zip(below.chain(aside)) {
        *tap = new;
        count += 1;
    }
    rows::add_row_differences(out, own, phi, &taps[..count]);
    pad(padded, own, op.periodic);
    let mass = m1 * m2;
    for (out, m0) in out.iter_mut().zip(&op.mass_m[0]) {
        *out *= m0 / mass;
    }
    op.along.add_differences(out, own, padded);
    let mut sums = [0.0; LANES];
    for (out, g) in out.chunks_mut(LANES).zip(g[at].chunks(LANES)) {
        for ((out, g), sum) in out.iter_mut().zip(g).zip(&mut sums) {
            *out = -(mass.mul_add(*out, *g));
            *sum = out.mul_add(*out, *sum);
        }
    }
    debug_assert_eq!(out.len(), n0);
    sums.iter().sum()
}

/// Largest number of neighbours of a cell along two axes: seven bands and the entry that closes a no-slip wall.
const MOST_TAPS: usize = 16;
/// Partial sums of a row.
const LANES: usize = 8;

/// Largest over smallest eigenvalue: bounds of the rows' sums of moduli over the masses, and the longest wave of the longest axis.
fn condition(layout: &Layout, rows: &[Vec<Taps>; 3]) -> f64 {
    let (mut largest, mut longest_m) = (0.0, 0.0_f64);
    for (line, rows) in layout.line.iter().zip(rows).filter(|(line, _)| !line.is_thin()) {
        let moduli =
            rows.iter().zip(&line.cell_mass_m).map(|(row, mass)| row.iter().map(|tap| tap.1.abs()).sum::<f64>() / mass);
        largest += moduli.fold(0.0, f64::max);
        let length_m = line.cell_mass_m.iter().sum::<f64>();
        longest_m = longest_m.max(if line.is_periodic() { 0.5 * length_m } else { length_m });
    }
    (largest * (longest_m / std::f64::consts::PI).powi(2)).max(1.0)
}

/// Rows of `Dw F^-1 Dw^T`.
pub(crate) fn stiffness(line: &Line) -> Vec<Taps> {
    let divergence = line.stored_divergence();
    let mut faces = vec![Taps::new(); line.cells];
    for (cell, row) in divergence.iter().enumerate() {
        for &(face, c) in row {
            faces[face].push((cell, c));
        }
    }
    let row = |taps: &Taps| {
        let mut sums = vec![0.0; line.cells];
        for &(face, c) in taps {
            for &(cell, other) in &faces[face] {
                sums[cell] += c * other / line.face_mass_m[face];
            }
        }
        sums.into_iter().enumerate().filter(|(_, c)| *c != 0.0).collect()
    };
    divergence.iter().map(row).collect()
}

/// 2-norm of a field, by rows in their order.
pub(crate) fn norm(shape: Shape, field: &[f64]) -> f64 {
    let rows: Vec<f64> = field.par_chunks(shape.n[0]).map(|row| kernel::dot(row, row)).collect();
    rows.iter().sum::<f64>().sqrt()
}
