//! The LAPACK symbols that ndarray-linalg calls here, bundled: LU, its solves, Hermitian eigenvalues.
//!
//! Defines `dgetrf_`, `dgetrs_`, `zgetrf_`, `zgetrs_`, `dsyev_`, `zheev_` with the standard interface, so that nothing has to be
//! installed. They are meant for the small matrices of this crate, not as a general LAPACK: no
//! blocking, no threads. Check: residuals against the matrix, standard `info` values, leading dimensions larger than
//! the order, workspace queries. All unsafe code of this crate is in this file: each function reads
//! its arguments by the LAPACK convention and hands views to the safe kernels in `dense`.

#![allow(unsafe_code)]

use std::ffi::{c_char, c_int};

use ndarray::{ArrayView2, ArrayViewMut2, ShapeBuilder};
use ndarray_linalg::Scalar;
use num_complex::Complex;

use crate::linalg::dense::{factor, jacobi, solve};

/// `info` for the first argument that is wrong, by its place in the list of arguments.
fn wrong<const N: usize>(checks: [(bool, c_int); N]) -> Option<c_int> {
    checks.iter().find(|(is_wrong, _)| *is_wrong).map(|(_, place)| -place)
}

/// The column-major matrix in LAPACK's memory.
///
/// # Safety
/// `a` points to lda x columns elements that nothing else uses, lda being at least the rows.
unsafe fn matrix<'a, T>(a: *mut T, rows: c_int, columns: c_int, lda: c_int) -> ArrayViewMut2<'a, T> {
    // SAFETY: the caller's
    unsafe { ArrayViewMut2::from_shape_ptr((rows as usize, columns as usize).strides((1, lda as usize)), a) }
}

/// LU factorisation with the arguments of `?getrf`; returns `info`.
///
/// # Safety
/// As LAPACK demands: `a` points to lda x n elements, `ipiv` to min(m, n) integers.
unsafe fn getrf<T: Scalar<Real = f64>>(m: c_int, n: c_int, a: *mut T, lda: c_int, ipiv: *mut c_int) -> c_int {
    if let Some(info) = wrong([(m < 0, 1), (n < 0, 2), (lda < m.max(1), 4)]) {
        return info;
    }
    // SAFETY: the caller guarantees these extents, and that they do not overlap
    unsafe { factor(matrix(a, m, n, lda), std::slice::from_raw_parts_mut(ipiv, m.min(n) as usize)) }
}

/// Solution from LU factors with the arguments of `?getrs`; returns `info`.
///
/// # Safety
/// As LAPACK demands: `a` and `ipiv` from `?getrf` of order n, `b` of ldb x nrhs elements.
#[allow(clippy::too_many_arguments)]
unsafe fn getrs<T: Scalar<Real = f64>>(
    trans: c_char,
    n: c_int,
    nrhs: c_int,
    a: *const T,
    lda: c_int,
    ipiv: *const c_int,
    b: *mut T,
    ldb: c_int,
) -> c_int {
    let (trans, least) = ((trans as u8).to_ascii_uppercase(), n.max(1));
    let adjoint: Option<fn(&T) -> T> = match trans {
        b'T' => Some(|element| *element),
        b'C' => Some(T::conj),
        _ => None,
    };
    let unknown = !matches!(trans, b'N' | b'T' | b'C');
    if let Some(info) = wrong([(unknown, 1), (n < 0, 2), (nrhs < 0, 3), (lda < least, 5), (ldb < least, 8)]) {
        return info;
    }
    // SAFETY: the caller guarantees these extents; nothing writes to the factors while they are seen
    let (factors, pivots, mut right) = unsafe {
        let factors = ArrayView2::from_shape_ptr((n as usize, n as usize).strides((1, lda as usize)), a);
        (factors, std::slice::from_raw_parts(ipiv, n as usize), matrix(b, n, nrhs, ldb))
    };
    for mut column in right.columns_mut() {
        // the rows of a column lie in one piece
        column.as_slice_mut().into_iter().for_each(|column| solve(factors, pivots, adjoint, column));
    }
    0
}

/// Hermitian eigenproblem with the arguments common to `dsyev` and `zheev`; returns `info`.
///
/// # Safety
/// As LAPACK demands: `a` of lda x n elements, `w` of n; with `lwork` = -1 only `work[0]` is touched.
#[allow(clippy::too_many_arguments)]
unsafe fn heev<T: Scalar<Real = f64>>(
    jobz: c_char,
    uplo: c_char,
    n: c_int,
    a: *mut T,
    lda: c_int,
    w: *mut f64,
    work: *mut T,
    lwork: c_int,
) -> c_int {
    let [jobz, uplo] = [jobz, uplo].map(|letter| (letter as u8).to_ascii_uppercase());
    let unknown = [!matches!(jobz, b'N' | b'V'), !matches!(uplo, b'L' | b'U')];
    if let Some(info) = wrong([(unknown[0], 1), (unknown[1], 2), (n < 0, 3), (lda < n.max(1), 5)]) {
        return info;
    }
    if lwork == -1 || n == 0 {
        // the kernel brings its own memory; 1 is the least that LAPACK allows to ask for
        // SAFETY: `work` has at least one element, also in a query
        unsafe { work.write(T::one()) };
        return 0;
    }
    // SAFETY: the caller guarantees these extents, and that they do not overlap
    let (mut a, values) = unsafe { (matrix(a, n, n, lda), std::slice::from_raw_parts_mut(w, n as usize)) };
    let element = |(row, column): (usize, usize)| match row.cmp(&column) {
        std::cmp::Ordering::Equal => T::from_real(a[(row, column)].re()),
        order if order.is_gt() == (uplo == b'L') => a[(row, column)],
        _ => a[(column, row)].conj(),
    };
    let order = n as usize;
    let full = (0..order * order).map(|place| element((place % order, place / order))).collect();
    let Some((found, basis)) = jacobi(full, order) else { return n };
    values.copy_from_slice(&found);
    if jobz == b'V' {
        basis.into_iter().enumerate().for_each(|(place, value)| a[(place % order, place / order)] = value);
    }
    0
}

/// The symbols of one type of elements; `dsyev_` lacks the real work space of `zheev_`, which is not needed.
macro_rules! symbols {
    ($scalar:ty, $getrf:ident, $getrs:ident, $heev:ident $(, $rwork:ident)?) => {
        /// # Safety
        /// The interface of LAPACK.
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $getrf(m: *const c_int, n: *const c_int, a: *mut $scalar, lda: *const c_int,
            ipiv: *mut c_int, info: *mut c_int) {
            // SAFETY: the same contract; all scalars are valid
            unsafe { *info = getrf(*m, *n, a, *lda, ipiv) }
        }

        /// # Safety
        /// The interface of LAPACK.
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $getrs(trans: *const c_char, n: *const c_int, nrhs: *const c_int, a: *const $scalar,
            lda: *const c_int, ipiv: *const c_int, b: *mut $scalar, ldb: *const c_int, info: *mut c_int) {
            // SAFETY: the same contract; all scalars are valid
            unsafe { *info = getrs(*trans, *n, *nrhs, a, *lda, ipiv, b, *ldb) }
        }

        /// # Safety
        /// The interface of LAPACK.
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $heev(jobz: *const c_char, uplo: *const c_char, n: *const c_int, a: *mut $scalar,
            lda: *const c_int, w: *mut f64, work: *mut $scalar, lwork: *const c_int, $($rwork: *mut f64,)? info: *mut c_int) {
            // SAFETY: the same contract; all scalars are valid
            unsafe { *info = heev(*jobz, *uplo, *n, a, *lda, w, work, *lwork) }
        }
    };
}

symbols!(f64, dgetrf_, dgetrs_, dsyev_);
symbols!(Complex<f64>, zgetrf_, zgetrs_, zheev_, _rwork);

#[cfg(test)]
#[path = "lapack_tests.rs"]
mod tests;
