//! The LAPACK symbols that ndarray-linalg calls here, bundled: LU, its solves, Hermitian eigenvalues.
//!
//! Defines `dgetrf_`, `dgetrs_`, `zgetrf_`, `zgetrs_`, `dsyev_`, `zheev_` with the standard interface, so that nothing has to be
//! installed. They are meant for the small matrices of this crate, not as a general LAPACK: no
//! blocking, no threads. Check: residuals against the matrix, standard `info` values, leading dimensions larger than
//! the order, workspace queries. All unsafe code of this crate is in this file: each function reads
//! its arguments by the LAPACK convention and hands slices to the safe kernels in `dense`.

#![allow(unsafe_code)]

use std::ffi::{c_char, c_int};

use num_complex::Complex;

use crate::linalg::dense::{Columns, Form, Scalar, factor, jacobi, solve};

/// Length of the memory of a column-major matrix.
fn extent(rows: usize, columns: usize, lda: usize) -> usize {
    if rows == 0 || columns == 0 { 0 } else { lda * (columns - 1) + rows }
}

/// LU factorisation with the arguments of `?getrf`.
///
/// # Safety
/// As LAPACK demands: scalars point to valid numbers, `a` to lda x n elements, `ipiv` to min(m, n) integers.
unsafe fn getrf<T: Scalar>(
    m: *const c_int,
    n: *const c_int,
    a: *mut T,
    lda: *const c_int,
    ipiv: *mut c_int,
    info: *mut c_int,
) {
    // SAFETY: the caller guarantees valid scalars
    let (m, n, lda) = unsafe { (*m, *n, *lda) };
    let status = if m < 0 {
        -1
    } else if n < 0 {
        -2
    } else if lda < m.max(1) {
        -4
    } else if m == 0 || n == 0 {
        0
    } else {
        let (rows, columns, lda) = (m as usize, n as usize, lda as usize);
        // SAFETY: the caller guarantees these extents, and the slices do not overlap
        let (data, pivots) = unsafe {
            (
                std::slice::from_raw_parts_mut(a, extent(rows, columns, lda)),
                std::slice::from_raw_parts_mut(ipiv, rows.min(columns)),
            )
        };
        factor(&mut Columns::new(data, lda), rows, columns, pivots)
    };
    // SAFETY: `info` points to a valid integer
    unsafe { *info = status };
}

/// Solution from LU factors with the arguments of `?getrs`.
///
/// # Safety
/// As LAPACK demands: `a` and `ipiv` from `?getrf` of order n, `b` of ldb x nrhs elements.
#[allow(clippy::too_many_arguments)]
unsafe fn getrs<T: Scalar>(
    trans: *const c_char,
    n: *const c_int,
    nrhs: *const c_int,
    a: *const T,
    lda: *const c_int,
    ipiv: *const c_int,
    b: *mut T,
    ldb: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: the caller guarantees valid scalars
    let (trans, n, nrhs, lda, ldb) = unsafe { (*trans as u8, *n, *nrhs, *lda, *ldb) };
    let form = match trans.to_ascii_uppercase() {
        b'N' => Some(Form::Plain),
        b'T' => Some(Form::Transposed),
        b'C' => Some(Form::Adjoint),
        _ => None,
    };
    let status = match form {
        None => -1,
        Some(_) if n < 0 => -2,
        Some(_) if nrhs < 0 => -3,
        Some(_) if lda < n.max(1) => -5,
        Some(_) if ldb < n.max(1) => -8,
        Some(form) if n > 0 && nrhs > 0 => {
            let (order, lda, ldb) = (n as usize, lda as usize, ldb as usize);
            let right = nrhs as usize;
            // SAFETY: the caller guarantees these extents; the factors are copied, so nothing is aliased
            let (mut factors, pivots, b) = unsafe {
                (
                    std::slice::from_raw_parts(a, extent(order, order, lda)).to_vec(),
                    std::slice::from_raw_parts(ipiv, order),
                    std::slice::from_raw_parts_mut(b, extent(order, right, ldb)),
                )
            };
            let factors = Columns::new(&mut factors, lda);
            for column in b.chunks_mut(ldb) {
                solve(&factors, order, pivots, form, &mut column[..order]);
            }
            0
        }
        Some(_) => 0,
    };
    // SAFETY: `info` points to a valid integer
    unsafe { *info = status };
}

/// Hermitian eigenproblem with the arguments common to `dsyev` and `zheev`.
///
/// # Safety
/// As LAPACK demands: `a` of lda x n elements, `w` of n; with `lwork` = -1 only `work[0]` and `info` are touched.
#[allow(clippy::too_many_arguments)]
unsafe fn heev<T: Scalar>(
    jobz: *const c_char,
    uplo: *const c_char,
    n: *const c_int,
    a: *mut T,
    lda: *const c_int,
    w: *mut f64,
    work: *mut T,
    lwork: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: the caller guarantees valid scalars
    let (jobz, uplo, n, lda, lwork) = unsafe { (*jobz as u8, *uplo as u8, *n, *lda, *lwork) };
    let (vectors, lower) = (jobz.to_ascii_uppercase(), uplo.to_ascii_uppercase());
    let status = if !matches!(vectors, b'N' | b'V') {
        -1
    } else if !matches!(lower, b'L' | b'U') {
        -2
    } else if n < 0 {
        -3
    } else if lda < n.max(1) {
        -5
    } else if lwork == -1 || n == 0 {
        // the kernel brings its own memory; 1 is the least that LAPACK allows to ask for
        // SAFETY: `work` has at least one element, also in a query
        unsafe { work.write(T::one()) };
        0
    } else {
        let (order, lda) = (n as usize, lda as usize);
        // SAFETY: the caller guarantees these extents, and the slices do not overlap
        let (data, values) = unsafe {
            (std::slice::from_raw_parts_mut(a, extent(order, order, lda)), std::slice::from_raw_parts_mut(w, order))
        };
        eigen(data, order, lda, vectors == b'V', lower == b'L', values)
    };
    // SAFETY: `info` points to a valid integer
    unsafe { *info = status };
}

/// Eigenvalues into `values` and, if asked for, vectors into `data`; only one triangle of `data` is read.
fn eigen<T: Scalar>(data: &mut [T], order: usize, lda: usize, vectors: bool, lower: bool, values: &mut [f64]) -> c_int {
    let mut a = Columns::new(data, lda);
    let mut full = Vec::with_capacity(order * order);
    for column in 0..order {
        for row in 0..order {
            full.push(match row.cmp(&column) {
                std::cmp::Ordering::Equal => T::from_real(a[(row, column)].re()),
                order if order.is_gt() == lower => a[(row, column)],
                _ => a[(column, row)].conj(),
            });
        }
    }
    let Some((found, basis)) = jacobi(full, order) else {
        return order as c_int;
    };
    values.copy_from_slice(&found);
    if vectors {
        for (place, value) in basis.into_iter().enumerate() {
            a[(place % order, place / order)] = value;
        }
    }
    0
}

macro_rules! lu_symbols {
    ($scalar:ty, $getrf:ident, $getrs:ident) => {
        /// # Safety
        /// The interface of LAPACK.
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $getrf(
            m: *const c_int,
            n: *const c_int,
            a: *mut $scalar,
            lda: *const c_int,
            ipiv: *mut c_int,
            info: *mut c_int,
        ) {
            // SAFETY: the same contract
            unsafe { getrf(m, n, a, lda, ipiv, info) }
        }

        /// # Safety
        /// The interface of LAPACK.
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $getrs(
            trans: *const c_char,
            n: *const c_int,
            nrhs: *const c_int,
            a: *const $scalar,
            lda: *const c_int,
            ipiv: *const c_int,
            b: *mut $scalar,
            ldb: *const c_int,
            info: *mut c_int,
        ) {
            // SAFETY: the same contract
            unsafe { getrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info) }
        }
    };
}

lu_symbols!(f64, dgetrf_, dgetrs_);
lu_symbols!(Complex<f64>, zgetrf_, zgetrs_);

/// # Safety
/// The interface of LAPACK.
#[unsafe(no_mangle)]
unsafe extern "C" fn dsyev_(
    jobz: *const c_char,
    uplo: *const c_char,
    n: *const c_int,
    a: *mut f64,
    lda: *const c_int,
    w: *mut f64,
    work: *mut f64,
    lwork: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: the same contract
    unsafe { heev(jobz, uplo, n, a, lda, w, work, lwork, info) }
}

/// # Safety
/// The interface of LAPACK.
#[unsafe(no_mangle)]
unsafe extern "C" fn zheev_(
    jobz: *const c_char,
    uplo: *const c_char,
    n: *const c_int,
    a: *mut Complex<f64>,
    lda: *const c_int,
    w: *mut f64,
    work: *mut Complex<f64>,
    lwork: *const c_int,
    _rwork: *mut f64,
    info: *mut c_int,
) {
    // SAFETY: the same contract; `rwork` is not needed
    unsafe { heev(jobz, uplo, n, a, lda, w, work, lwork, info) }
}

#[cfg(test)]
#[path = "lapack_tests.rs"]
mod tests;
