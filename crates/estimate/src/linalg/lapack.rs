//! The LAPACK symbols that ndarray-linalg calls here, bundled: Hermitian eigenvalues.
//!
//! Defines `dsyev_` and `zheev_` with the standard interface, so that nothing has to be installed. They are meant for the small
//! matrices of this crate, not as a general LAPACK: no blocking, no threads. Check: residuals against the matrix, standard
//! `info` values, leading dimensions larger than the order, workspace queries. All unsafe code of this crate is in this
//! file: it reads its arguments by the LAPACK convention and hands safe ones to [`jacobi`].

#![allow(unsafe_code)]

use std::ffi::{c_char, c_int};

use ndarray::{ArrayViewMut2, ShapeBuilder};
use ndarray_linalg::Scalar;
use num_complex::Complex;

use crate::linalg::jacobi::jacobi;

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
    let jobz = (jobz as u8).to_ascii_uppercase();
    let uplo = (uplo as u8).to_ascii_uppercase();
    // the number of the first argument that is invalid
    if !matches!(jobz, b'N' | b'V') {
        return -1;
    }
    if !matches!(uplo, b'L' | b'U') {
        return -2;
    }
    if n < 0 {
        return -3;
    }
    if lda < n.max(1) {
        return -5;
    }
    if lwork == -1 || n == 0 {
        // the kernel brings its own memory; 1 is the least that LAPACK allows to ask for
        // SAFETY: `work` has at least one element, also in a query
        unsafe { work.write(T::one()) };
        return 0;
    }
    let order = n as usize;
    // SAFETY: the caller guarantees these extents, and that they do not overlap
    let (mut a, values) = unsafe {
        let a = ArrayViewMut2::from_shape_ptr((order, order).strides((1, lda as usize)), a);
        (a, std::slice::from_raw_parts_mut(w, order))
    };
    let mut full = Vec::with_capacity(order * order);
    for column in 0..order {
        for row in 0..order {
            let is_stored = (row > column) == (uplo == b'L');
            full.push(if row == column {
                T::from_real(a[(row, column)].re())
            } else if is_stored {
                a[(row, column)]
            } else {
                a[(column, row)].conj()
            });
        }
    }
    let Some((found, basis)) = jacobi(full, order) else {
        return n;
    };
    values.copy_from_slice(&found);
    if jobz == b'V' {
        for (index, value) in basis.into_iter().enumerate() {
            a[(index % order, index / order)] = value;
        }
    }
    0
}

/// The symbol of one type of elements; `dsyev_` lacks the real work space of `zheev_`, which is not needed.
macro_rules! symbol {
    ($scalar:ty, $heev:ident $(, $rwork:ident)?) => {
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

symbol!(f64, dsyev_);
symbol!(Complex<f64>, zheev_, _rwork);

#[cfg(test)]
#[path = "lapack_tests.rs"]
mod tests;
