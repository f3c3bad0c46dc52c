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
    let [jobz, uplo] = [jobz, uplo].map(|letter| (letter as u8).to_ascii_uppercase());
    let unknown = [!matches!(jobz, b'N' | b'V'), !matches!(uplo, b'L' | b'U')];
    let wrong = [
        (unknown[0], 1),
        (unknown[1], 2),
        (n < 0, 3),
        (lda < n.max(1), 5),
    ];
    if let Some((_, place)) = wrong.iter().find(|(is_wrong, _)| *is_wrong) {
        return -place;
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
    let element = |(row, column): (usize, usize)| match row.cmp(&column) {
        std::cmp::Ordering::Equal => T::from_real(a[(row, column)].re()),
        order if order.is_gt() == (uplo == b'L') => a[(row, column)],
        _ => a[(column, row)].conj(),
    };
    let full = (0..order * order)
        .map(|place| element((place % order, place / order)))
        .collect();
    let Some((found, basis)) = jacobi(full, order) else {
        return n;
    };
    values.copy_from_slice(&found);
    if jobz == b'V' {
        basis
            .into_iter()
            .enumerate()
            .for_each(|(place, value)| a[(place % order, place / order)] = value);
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
