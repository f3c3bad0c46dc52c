//! Dense kernels behind the bundled LAPACK symbols: LU with partial pivoting and Hermitian Jacobi rotations.
//!
//! Column-major matrices, real and complex alike, for orders up to a few hundred. Check: residuals of
//! the routines in `lapack`, on singular, tiny, empty and padded matrices.

use std::ops::{Index, IndexMut, Mul, MulAssign, SubAssign};

use num_complex::{Complex, ComplexFloat};

/// Real or complex double.
pub(crate) trait Scalar: ComplexFloat<Real = f64> + Mul<f64, Output = Self> + SubAssign + MulAssign {
    /// A real number as a scalar.
    fn from_real(value: f64) -> Self;
}

impl Scalar for f64 {
    fn from_real(value: f64) -> Self {
        value
    }
}

impl Scalar for Complex<f64> {
    fn from_real(value: f64) -> Self {
        Self::new(value, 0.0)
    }
}

/// Column-major matrix in borrowed memory with leading dimension `lda`.
pub(crate) struct Columns<'a, T> {
    data: &'a mut [T],
    lda: usize,
}

impl<'a, T> Columns<'a, T> {
    pub(crate) fn new(data: &'a mut [T], lda: usize) -> Self {
        Self { data, lda }
    }
}

impl<T> Index<(usize, usize)> for Columns<'_, T> {
    type Output = T;
    fn index(&self, (row, column): (usize, usize)) -> &T {
        &self.data[row + column * self.lda]
    }
}

impl<T> IndexMut<(usize, usize)> for Columns<'_, T> {
    fn index_mut(&mut self, (row, column): (usize, usize)) -> &mut T {
        &mut self.data[row + column * self.lda]
    }
}

/// P A = L U in place; `pivots` from 1. Returns 0, or the first (from 1) pivot that is exactly 0.
pub(crate) fn factor<T: Scalar>(a: &mut Columns<'_, T>, rows: usize, columns: usize, pivots: &mut [i32]) -> i32 {
    let mut info = 0;
    for k in 0..rows.min(columns) {
        let pivot = (k..rows).fold(k, |best, row| if a[(row, k)].abs() > a[(best, k)].abs() { row } else { best });
        pivots[k] = pivot as i32 + 1;
        if a[(pivot, k)] == T::zero() {
            if info == 0 {
                info = k as i32 + 1;
            }
            continue;
        }
        if pivot != k {
            for column in 0..columns {
                let kept = a[(k, column)];
                a[(k, column)] = a[(pivot, column)];
                a[(pivot, column)] = kept;
            }
        }
        for row in k + 1..rows {
            let quotient = a[(row, k)] / a[(k, k)];
            a[(row, k)] = quotient;
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

/// Which matrix a factorisation solves with.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Form {
    /// A.
    Plain,
    /// The transpose of A.
    Transposed,
    /// The conjugate transpose of A.
    Adjoint,
}

/// Solves A x = b, A^T x = b or A^H x = b in place from the factors of [`factor`].
pub(crate) fn solve<T: Scalar>(a: &Columns<'_, T>, order: usize, pivots: &[i32], form: Form, b: &mut [T]) {
    let swaps = |b: &mut [T], k: usize| b.swap(k, pivots[k] as usize - 1);
    if form == Form::Plain {
        (0..order).for_each(|k| swaps(b, k));
        for k in 0..order {
            let value = b[k];
            (k + 1..order).for_each(|row| b[row] -= a[(row, k)] * value);
        }
        for k in (0..order).rev() {
            b[k] = b[k] / a[(k, k)];
            let value = b[k];
            (0..k).for_each(|row| b[row] -= a[(row, k)] * value);
        }
        return;
    }
    let part = |value: T| if form == Form::Adjoint { value.conj() } else { value };
    for k in 0..order {
        for row in 0..k {
            let term = part(a[(row, k)]) * b[row];
            b[k] -= term;
        }
        b[k] = b[k] / part(a[(k, k)]);
    }
    for k in (0..order).rev() {
        for row in k + 1..order {
            let term = part(a[(row, k)]) * b[row];
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
pub(crate) fn jacobi<T: Scalar>(mut a: Vec<T>, order: usize) -> Option<(Vec<f64>, Vec<T>)> {
    let mut v = vec![T::zero(); order * order];
    (0..order).for_each(|k| v[k * (order + 1)] = T::one());
    let mut converged = false;
    for _ in 0..SWEEPS {
        let mut rotated = false;
        for q in 1..order {
            for p in 0..q {
                rotated |= rotate(&mut a, &mut v, order, p, q)?;
            }
        }
        if !rotated {
            converged = true;
            break;
        }
    }
    let diagonal: Vec<f64> = (0..order).map(|k| a[k * (order + 1)].re()).collect();
    if !converged || diagonal.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let mut places: Vec<usize> = (0..order).collect();
    places.sort_by(|&i, &j| diagonal[i].total_cmp(&diagonal[j]));
    let vectors = places.iter().flat_map(|&k| v[k * order..(k + 1) * order].iter().copied()).collect();
    Some((places.iter().map(|&k| diagonal[k]).collect(), vectors))
}

/// One rotation of columns p < q that annihilates a_pq; `Some(false)` if that element is negligible, `None` if it is not finite.
fn rotate<T: Scalar>(a: &mut [T], v: &mut [T], order: usize, p: usize, q: usize) -> Option<bool> {
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
    let phase = off * size.recip();
    let theta = (aqq - app) / (2.0 * size);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = t.hypot(1.0).recip();
    let s = t * c;
    // columns p and q of A and V times [[c, s phase], [-s conj(phase), c]]
    let (up, down) = (phase * s, phase.conj() * s);
    for matrix in [&mut *a, &mut *v] {
        let (before, from_q) = matrix.split_at_mut(q * order);
        for (x, y) in before[p * order..(p + 1) * order].iter_mut().zip(&mut from_q[..order]) {
            (*x, *y) = (*x * c - *y * down, *x * up + *y * c);
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
