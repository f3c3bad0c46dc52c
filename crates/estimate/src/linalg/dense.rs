//! Dense kernels behind the bundled LAPACK symbols: LU with partial pivoting and Hermitian Jacobi rotations.
//!
//! Real and complex alike, for orders up to a few hundred. Check: residuals of the routines in `lapack`, on singular, tiny, empty
//! and padded matrices.

use ndarray::{ArrayView2, ArrayViewMut2};
use ndarray_linalg::Scalar;

/// P A = L U in place; `pivots` from 1. Returns 0, or the first (from 1) pivot that is exactly 0.
pub(crate) fn factor<T: Scalar<Real = f64>>(mut a: ArrayViewMut2<'_, T>, pivots: &mut [i32]) -> i32 {
    let (rows, columns) = a.dim();
    let mut info = 0;
    for k in 0..rows.min(columns) {
        let pivot = (k..rows).fold(k, |best, row| if a[(row, k)].abs() > a[(best, k)].abs() { row } else { best });
        pivots[k] = pivot as i32 + 1;
        if a[(pivot, k)] == T::zero() {
            info = if info == 0 { k as i32 + 1 } else { info };
            continue;
        }
        if pivot != k {
            (0..columns).for_each(|column| a.swap((k, column), (pivot, column)));
        }
        let diagonal = a[(k, k)];
        for row in k + 1..rows {
            a[(row, k)] /= diagonal;
        }
        for column in k + 1..columns {
            let above = a[(k, column)];
            for row in k + 1..rows {
                let multiplier = a[(row, k)];
                a[(row, column)] -= multiplier * above;
            }
        }
    }
    info
}

/// Solves A x = b in place from the factors of [`factor`]; with `adjoint` A^T x = b or A^H x = b, as it takes elements or conjugates.
pub(crate) fn solve<T: Scalar>(a: ArrayView2<'_, T>, pivots: &[i32], adjoint: Option<fn(&T) -> T>, b: &mut [T]) {
    let order = b.len();
    let swaps = |b: &mut [T], k: usize| b.swap(k, pivots[k] as usize - 1);
    let Some(part) = adjoint else {
        (0..order).for_each(|k| swaps(b, k));
        for k in 0..order {
            let value = b[k];
            (k + 1..order).for_each(|row| b[row] -= a[(row, k)] * value);
        }
        for k in (0..order).rev() {
            b[k] /= a[(k, k)];
            let value = b[k];
            (0..k).for_each(|row| b[row] -= a[(row, k)] * value);
        }
        return;
    };
    for k in 0..order {
        for row in 0..k {
            let term = part(&a[(row, k)]) * b[row];
            b[k] -= term;
        }
        b[k] /= part(&a[(k, k)]);
    }
    for k in (0..order).rev() {
        for row in k + 1..order {
            let term = part(&a[(row, k)]) * b[row];
            b[k] -= term;
        }
    }
    (0..order).rev().for_each(|k| swaps(b, k));
}

/// Sweeps after which the rotations have converged for any matrix met in practice (8 are usual).
const SWEEPS: usize = 60;

/// Eigenvalues, increasing, and eigenvectors of a Hermitian matrix given as a full square, order x order.
///
/// Cyclic Jacobi rotations (Golub and Van Loan, section 8.5). The vectors are the columns of the result.
/// Returns `None` if the matrix is not finite or the rotations do not converge.
pub(crate) fn jacobi<T: Scalar<Real = f64>>(mut a: Vec<T>, order: usize) -> Option<(Vec<f64>, Vec<T>)> {
    let mut v = vec![T::zero(); order * order];
    (0..order).for_each(|k| v[k * (order + 1)] = T::one());
    let mut sweeps = 0;
    loop {
        let mut rotated = false;
        for q in 1..order {
            for p in 0..q {
                rotated |= rotate(&mut a, &mut v, order, p, q)?;
            }
        }
        sweeps += 1;
        match rotated {
            false => break,
            true if sweeps == SWEEPS => return None,
            true => {}
        }
    }
    let diagonal: Vec<f64> = (0..order).map(|k| a[k * (order + 1)].re()).collect();
    if diagonal.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let mut places: Vec<usize> = (0..order).collect();
    places.sort_by(|&i, &j| diagonal[i].total_cmp(&diagonal[j]));
    let vectors = places.iter().flat_map(|&k| v[k * order..(k + 1) * order].iter().copied()).collect();
    Some((places.iter().map(|&k| diagonal[k]).collect(), vectors))
}

/// One rotation of columns p < q that annihilates a_pq; `Some(false)` if that element is negligible, `None` if it is not finite.
fn rotate<T: Scalar<Real = f64>>(a: &mut [T], v: &mut [T], order: usize, p: usize, q: usize) -> Option<bool> {
    let at = |row: usize, column: usize| row + column * order;
    let off = a[at(p, q)];
    let size = off.abs();
    if !size.is_finite() {
        return None;
    }
    let (app, aqq) = (a[at(p, p)].re(), a[at(q, q)].re());
    // negligible: it cannot change either diagonal element any more
    if size <= f64::EPSILON * 0.25 * (app.abs() * aqq.abs()).sqrt() || size < f64::MIN_POSITIVE {
        return Some(false);
    }
    let phase = off.mul_real(size.recip());
    let theta = (aqq - app) / (2.0 * size);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = t.hypot(1.0).recip();
    let s = t * c;
    // columns p and q of A and V times [[c, s phase], [-s conj(phase), c]]
    let (up, down) = (phase.mul_real(s), phase.conj().mul_real(s));
    for matrix in [&mut *a, &mut *v] {
        let (before, from_q) = matrix.split_at_mut(q * order);
        for (x, y) in before[p * order..(p + 1) * order].iter_mut().zip(&mut from_q[..order]) {
            (*x, *y) = (x.mul_real(c) - *y * down, *x * up + y.mul_real(c));
        }
    }
    // rows p and q of A times the adjoint: A stays Hermitian
    for k in 0..order {
        (a[at(p, k)], a[at(q, k)]) = (a[at(k, p)].conj(), a[at(k, q)].conj());
    }
    a[at(p, q)] = T::zero();
    a[at(q, p)] = T::zero();
    a[at(p, p)] = T::from_real(app - t * size);
    a[at(q, q)] = T::from_real(aqq + t * size);
    Some(true)
}
