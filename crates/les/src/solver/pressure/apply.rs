//! The operator of the pressure equation, applied to a field.
//!
//! Check: symmetry, constants, products of the directions' own operators.

use std::ops::Range;

use multiversion::multiversion;
use rayon::prelude::*;

use super::super::layout::Layout;
use super::super::operators_1d::{Operators1d, Taps, nonzero};
use super::super::rows::{Columns, HALO, cut_rows, from_places, pad};
use super::super::slabs::Slabs;
use super::kernel;
use crate::Error;

/// `sum_b (prod_{d != b} m_d) Dw_b f_b^-1 Dw_b^T`.
///
/// Every row is applied to the differences from its own cell: a constant leaves exactly nothing,
/// however large it is.
#[derive(Debug)]
pub(crate) struct Operator {
    /// Shape of its fields, and what the ranks exchange of them.
    pub(super) slabs: Slabs,
    mass_m: [Vec<f64>; 3],
    /// `Dw_0 f_0^-1 Dw_0^T` by columns.
    along: Columns,
    /// The same where all cells of the row are equal.
    even: Option<[f64; 3]>,
    periodic: bool,
    /// `Dw_b f_b^-1 Dw_b^T` of the other two axes by rows, without the diagonals.
    across: [Vec<Taps>; 2],
}

impl Operator {
    /// The operator of a mesh.
    pub(crate) fn new(layout: &Layout) -> Self {
        let rows: [Vec<Taps>; 3] = std::array::from_fn(|b| stiffness(&layout.line[b]));
        let periodic = layout.line[0].is_periodic();
        Self {
            slabs: layout.slabs.clone(),
            mass_m: std::array::from_fn(|b| layout.line[b].cell_mass_m.clone()),
            along: Columns::new(&rows[0], periodic),
            even: even(&layout.line[0], &rows[0]),
            periodic,
            across: [off_diagonal(&rows[1]), off_diagonal(&rows[2])],
        }
    }

    /// Places in `residual` what `phi` leaves of the right side, `-g - A phi`.
    pub(crate) fn residual(&self, g: &[f64], phi: &[f64], residual: &mut [f64]) {
        let shape = self.slabs.shape;
        let n0 = shape.n[0];
        let planes = residual[shape.own_range()]
            .par_chunks_mut(shape.plane())
            .zip(shape.own());
        planes.for_each_init(
            || vec![0.0; n0 + 2 * HALO],
            |padded, (plane, k)| {
                for (j, out) in plane.chunks_mut(n0).enumerate() {
                    residual_row(self, g, phi, [j, k], out, padded);
                }
            },
        );
    }

    /// 2-norm of what `phi` leaves of the right side, which is nowhere stored.
    ///
    /// # Errors
    /// Those of the exchange between ranks.
    pub(crate) fn residual_norm(&self, g: &[f64], phi: &[f64]) -> Result<f64, Error> {
        let [n0, n1, _] = self.slabs.shape.n;
        let planes = self.slabs.shape.own().into_par_iter();
        let squares = planes.map_init(
            || (vec![0.0; n0], vec![0.0; n0 + 2 * HALO]),
            |(out, padded), k| {
                [(0..n1)
                    .map(|j| residual_row(self, g, phi, [j, k], out, padded))
                    .sum()]
            },
        );
        self.slabs
            .sums(squares.collect())
            .map(|[squares]| squares.sqrt())
    }

    /// Copies the right side `from` to `to`; returns its 2-norm. If its sum, which no pressure can
    /// balance, is more than `share` of the norm, it is taken out of the copy.
    ///
    /// # Errors
    /// Those of the exchange between ranks.
    pub(crate) fn copy_balanced(
        &self,
        from: &[f64],
        to: &mut [f64],
        share: f64,
    ) -> Result<f64, Error> {
        let plane = self.slabs.shape.plane();
        let own = self.slabs.shape.own_range();
        let planes = to[own.clone()]
            .par_chunks_mut(plane)
            .zip(from[own].par_chunks(plane));
        let parts = planes.map(|(to, from)| {
            to.copy_from_slice(from);
            [kernel::sum(to), kernel::dot(to, to)]
        });
        let [sum, squares] = self.slabs.sums(parts.collect())?;
        let mut volume = 1.0;
        let mut mass = 1.0;
        for axis in &self.mass_m {
            volume *= axis.iter().sum::<f64>();
            mass *= kernel::dot(axis, axis).sqrt();
        }
        if (sum / volume).abs() * mass <= share * squares.sqrt() {
            return Ok(squares.sqrt());
        }
        self.each_mass(to, sum / volume, |g, mass| *g -= mass);
        norm(&self.slabs, to)
    }

    /// 2-norm of what the last digit of `phi` leaves.
    ///
    /// # Errors
    /// Those of the exchange between ranks.
    pub(crate) fn round_off(&self, phi: &[f64]) -> Result<f64, Error> {
        let shape = self.slabs.shape;
        let n0 = shape.n[0];
        let squares_0 = self.along.squares(n0);
        let [squares_1, squares_2] = self
            .across
            .each_ref()
            .map(|rows| rows.iter().map(sum_of_squares).collect::<Vec<f64>>());
        let planes = phi[shape.own_range()]
            .par_chunks(shape.plane())
            .zip(shape.own());
        let of_planes = planes.map(|(plane, k)| {
            let mass_2 = self.mass_m[2][k];
            let terms = plane.iter().enumerate().map(|(place, phi)| {
                let i = place % n0;
                let j = place / n0;
                let mass_0 = self.mass_m[0][i];
                let mass_1 = self.mass_m[1][j];
                let a = mass_1 * mass_2;
                let b = mass_0 * mass_2;
                let c = mass_0 * mass_1;
                let squares = a * a * squares_0[i] + b * b * squares_1[j] + c * c * squares_2[k];
                squares * phi * phi
            });
            [terms.sum::<f64>()]
        });
        let [squares] = self.slabs.sums(of_planes.collect())?;
        Ok(0.5 * f64::EPSILON * squares.sqrt())
    }

    /// Gives each value that is owned, with `scale` times the mass of its cell, to `act`.
    pub(super) fn each_mass(
        &self,
        field: &mut [f64],
        scale: f64,
        act: impl Fn(&mut f64, f64) + Sync,
    ) {
        let shape = self.slabs.shape;
        let n0 = shape.n[0];
        field[shape.own_range()]
            .par_chunks_mut(shape.plane())
            .zip(shape.own())
            .for_each(|(plane, k)| {
                for (row, m1) in plane.chunks_mut(n0).zip(&self.mass_m[1]) {
                    let mass = m1 * self.mass_m[2][k] * scale;
                    row.iter_mut()
                        .zip(&self.mass_m[0])
                        .for_each(|(value, m0)| act(value, mass * m0));
                }
            });
    }
}

/// Residual of row `(j, k)`; returns the sum of its squares.
fn residual_row(
    op: &Operator,
    g: &[f64],
    phi: &[f64],
    [j, k]: [usize; 2],
    out: &mut [f64],
    padded: &mut [f64],
) -> f64 {
    let at = op.slabs.shape.row(j, k);
    let own = &phi[at.clone()];
    let m1 = op.mass_m[1][j];
    let m2 = op.mass_m[2][k];
    // Places that are not needed have the row itself with the coefficient zero.
    let mut taps = [(at.start, 0.0); MOST_TAPS];
    let along_1 = op.across[0][j]
        .iter()
        .map(|&(i, c)| (op.slabs.shape.row(i, k).start, c * m2));
    let along_2 = op.across[1][k]
        .iter()
        .map(|&(i, c)| (op.slabs.shape.row(j, i).start, c * m1));
    for (tap, new) in taps.iter_mut().zip(along_1.chain(along_2)) {
        *tap = new;
    }
    let (first, rest) = taps.split_at(INNER_TAPS);
    pad(padded, own, op.periodic);
    let even = op.even.map_or([0.0; 3], |even| even.map(|c| c * m1 * m2));
    row_differences(out, g, phi, at, first, &op.mass_m[0], even, padded);
    if op.even.is_none() || rest.iter().any(|tap| tap.1 != 0.0) {
        other_differences(op, out, own, phi, rest, m1 * m2, padded);
    }
    kernel::dot(out, out)
}

/// `out = -g - sum c mass (row - own)` over twelve rows, less the even differences along the row
/// itself.
#[multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+fma",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn row_differences(
    out: &mut [f64],
    g: &[f64],
    phi: &[f64],
    at: Range<usize>,
    taps: &[(usize, f64)],
    mass: &[f64],
    even: [f64; 3],
    padded: &[f64],
) {
    let n = out.len();
    let mut c = [0.0; INNER_TAPS];
    let mut rows: [&[f64]; INNER_TAPS] = [&[]; INNER_TAPS];
    for (t, &(start, coefficient)) in taps.iter().enumerate().take(INNER_TAPS) {
        c[t] = coefficient;
        rows[t] = &phi[start..start + n];
    }
    let [x0, x1, x2, x3, x4, x5] = cut_rows!(rows, n, 0 1 2 3 4 5);
    let [x6, x7, x8, x9, x10, x11] = cut_rows!(rows, n, 6 7 8 9 10 11);
    let own = &phi[at.clone()][..n];
    let g = &g[at][..n];
    let mass = &mass[..n];
    let [p3, p2, p1, q1, q2, q3] = from_places!(padded, 1, 2, 3, 5, 6, 7);
    let [p3, p2, p1, q1, q2, q3] = cut_rows!([p3, p2, p1, q1, q2, q3], n, 0 1 2 3 4 5);
    for i in 0..n {
        let o = own[i];
        let a = c[0].mul_add(x0[i] - o, c[1].mul_add(x1[i] - o, c[2] * (x2[i] - o)));
        let a = c[3].mul_add(
            x3[i] - o,
            c[4].mul_add(x4[i] - o, c[5].mul_add(x5[i] - o, a)),
        );
        let b = c[6].mul_add(x6[i] - o, c[7].mul_add(x7[i] - o, c[8] * (x8[i] - o)));
        let b = c[9].mul_add(
            x9[i] - o,
            c[10].mul_add(x10[i] - o, c[11].mul_add(x11[i] - o, b)),
        );
        let e = even[0].mul_add((p1[i] - o) + (q1[i] - o), g[i]);
        let e = even[1].mul_add((p2[i] - o) + (q2[i] - o), e);
        let e = even[2].mul_add((p3[i] - o) + (q3[i] - o), e);
        out[i] = -mass[i].mul_add(a + b, e);
    }
}

/// Subtracts the rows that only cells at walls see, and the differences along a row whose cells are
/// not all equal.
#[multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+fma",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn other_differences(
    op: &Operator,
    out: &mut [f64],
    own: &[f64],
    phi: &[f64],
    taps: &[(usize, f64)],
    mass: f64,
    padded: &mut [f64],
) {
    let n = out.len();
    for &(start, c) in taps.iter().filter(|tap| tap.1 != 0.0) {
        for (((out, x), own), m0) in out
            .iter_mut()
            .zip(&phi[start..start + n])
            .zip(own)
            .zip(&op.mass_m[0])
        {
            *out = (-c * m0).mul_add(x - own, *out);
        }
    }
    if op.even.is_none() {
        op.along.subtract_differences(out, mass, own, padded);
    }
}

/// Neighbours of a cell along two axes away from walls: six of seven bands each.
const INNER_TAPS: usize = 12;
/// Largest number of neighbours along two axes: the entries that close no-slip walls besides.
const MOST_TAPS: usize = 16;

/// Coefficients of the pairs of neighbours at 1, 2 and 3 where all rows are equal and even.
fn even(line: &Operators1d, rows: &[Taps]) -> Option<[f64; 3]> {
    if !line.is_fourier() || line.cells < 8 {
        return None;
    }
    let middle = line.cells / 2;
    Some([1, 2, 3].map(|offset| {
        let tap = rows[middle].iter().find(|tap| tap.0 == middle + offset);
        tap.map_or(0.0, |tap| tap.1)
    }))
}

/// The rows of an operator without their diagonals.
pub(super) fn off_diagonal(rows: &[Taps]) -> Vec<Taps> {
    let mut others = rows.to_vec();
    for (i, row) in others.iter_mut().enumerate() {
        row.retain(|tap| tap.0 != i);
    }
    others
}

/// Sum of the squares of a row, its diagonal being the negative sum of the other entries.
fn sum_of_squares(others: &Taps) -> f64 {
    let squares = others.iter().map(|tap| tap.1 * tap.1).sum::<f64>();
    let diagonal = others.iter().map(|tap| tap.1).sum::<f64>();
    squares + diagonal.powi(2)
}

/// Rows of `Dw F^-1 Dw^T`.
pub(crate) fn stiffness(line: &Operators1d) -> Vec<Taps> {
    let faces = line.adjoint();
    let mut rows = Vec::with_capacity(line.cells);
    for taps in line.stored_divergence() {
        let mut sums = vec![0.0; line.cells];
        for (face, c) in taps {
            for &(cell, other) in &faces[face] {
                sums[cell] += c * other / line.face_mass_m[face];
            }
        }
        rows.push(nonzero(&sums));
    }
    rows
}

/// 2-norm of a field: the sums of the planes are added in their order.
///
/// # Errors
/// Those of the exchange between ranks.
pub(crate) fn norm(slabs: &Slabs, field: &[f64]) -> Result<f64, Error> {
    let planes = field[slabs.shape.own_range()].par_chunks(slabs.shape.plane());
    slabs
        .sums(planes.map(|plane| [kernel::dot(plane, plane)]).collect())
        .map(|[squares]| squares.sqrt())
}
