//! Cholesky factor of a real symmetric matrix of some thousand rows, and solutions with it: block by block, so that nearly all of
//! the work is products of matrices.
//!
//! Check: the factor times its transpose; solutions; matrices that are not positive.

use multiversion::multiversion;
use ndarray::linalg::general_mat_mul;
use ndarray::{Array2, ArrayView2, Axis, s};

use crate::linalg::dot;

/// Rows of a block: small against the matrix, large enough for fast products.
const BLOCK: usize = 64;

/// The lower factor L of A = L L^T; nothing unless A is positive definite in double precision. The lower triangle of A is read.
pub(crate) fn cholesky(mut a: Array2<f64>) -> Option<Array2<f64>> {
    let order = a.nrows();
    for first in (0..order).step_by(BLOCK) {
        let last = (first + BLOCK).min(order);
        let (done, mut rest) = a.view_mut().split_at(Axis(1), first);
        let own = done.slice(s![first..last, ..]);
        general_mat_mul(
            -1.0,
            &done.slice(s![first.., ..]),
            &own.t(),
            1.0,
            &mut rest.slice_mut(s![first.., ..last - first]),
        );
        for i in first..order {
            let (above, mut rest) = a.view_mut().split_at(Axis(0), i);
            let row = rest.as_slice_mut()?;
            for j in first..last.min(i) {
                let other = above.row(j).to_slice()?;
                let sum = row[j] - dot(&row[first..j], &other[first..j]);
                row[j] = sum / other[j];
            }
            if i < last {
                let sum = row[i] - dot(&row[first..i], &row[first..i]);
                row[i] = sum.sqrt();
            }
        }
        // the root of a pivot that is not positive is no number, or zero
        let diagonal = a.diag();
        let pivots = diagonal.slice(s![first..last]);
        if !pivots.iter().all(|&pivot| pivot > 0.0) {
            return None;
        }
    }
    for ((i, j), element) in a.indexed_iter_mut() {
        if j > i {
            *element = 0.0;
        }
    }
    Some(a)
}

/// X = L^-1 B, in the place of B.
pub(crate) fn forward(lower: ArrayView2<'_, f64>, b: &mut Array2<f64>) {
    let order = lower.nrows();
    for first in (0..order).step_by(BLOCK) {
        let last = (first + BLOCK).min(order);
        let (done, mut rest) = b.view_mut().split_at(Axis(0), first);
        let mut own = rest.slice_mut(s![..last - first, ..]);
        general_mat_mul(
            -1.0,
            &lower.slice(s![first..last, ..first]),
            &done,
            1.0,
            &mut own,
        );
        for i in 0..last - first {
            let (before, mut here) = own.view_mut().split_at(Axis(0), i);
            let mut row = here.row_mut(0);
            for (k, known) in before.rows().into_iter().enumerate() {
                row.scaled_add(-lower[[first + i, first + k]], &known);
            }
            row /= lower[[first + i, first + i]];
        }
    }
}

/// x = L^-1 b, in the place of b, given the rows of L in one piece.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn forward_one(rows: &[f64], b: &mut [f64]) {
    for (i, row) in rows.chunks_exact(b.len().max(1)).enumerate() {
        b[i] = (b[i] - dot(&row[..i], &b[..i])) / row[i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn covariance(order: usize) -> Array2<f64> {
        Array2::from_shape_fn((order, order), |(i, j)| {
            (-(i.abs_diff(j) as f64) / 20.0).exp() + if i == j { 0.1 } else { 0.0 }
        })
    }

    #[test]
    fn the_factor_times_its_transpose_is_the_matrix_and_solutions_solve() {
        for order in [1, 63, 64, 65, 200] {
            let a = covariance(order);
            let lower = cholesky(a.clone()).unwrap();
            let error = (lower.dot(&lower.t()) - &a)
                .mapv(f64::abs)
                .into_iter()
                .fold(0.0, f64::max);
            assert!(error < 1e-13, "{order}: {error}");
            let x = Array2::from_shape_fn((order, 3), |(i, j)| ((i * 7 + j) as f64).sin());
            let mut b = lower.dot(&x);
            forward(lower.view(), &mut b);
            let mut one = lower.dot(&x.column(0)).to_vec();
            forward_one(lower.as_slice().unwrap(), &mut one);
            let error = (b - &x).mapv(f64::abs).into_iter().fold(0.0, f64::max);
            let error = one
                .iter()
                .zip(x.column(0))
                .map(|(a, b)| (a - b).abs())
                .fold(error, f64::max);
            assert!(error < 1e-11, "{order}: {error}");
        }
    }

    #[test]
    fn matrices_that_are_not_positive_have_no_factor() {
        let mut a = covariance(100);
        a[[80, 80]] = -1.0;
        assert!(cholesky(a).is_none());
        assert!(cholesky(Array2::from_elem((2, 2), f64::NAN)).is_none());
    }
}
