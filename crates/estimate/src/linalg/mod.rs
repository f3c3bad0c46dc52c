//! Dense linear algebra for covariances: the Hermitian eigenproblem, with a check of its residual, and a real Cholesky factor.
//!
//! The only module that meets ndarray-linalg. Each result is checked against its matrix before it is handed out. In
//! particular ndarray-linalg returns the eigenvectors of the conjugate for complex row-major matrices, whatever the
//! LAPACK; here a matrix goes in column-major. Check: random, singular and ill-conditioned matrices.

pub(crate) mod cholesky;
#[cfg(all(feature = "bundled-lapack", not(feature = "openblas-system")))]
mod jacobi;
#[cfg(all(feature = "bundled-lapack", not(feature = "openblas-system")))]
mod lapack;
#[cfg(feature = "openblas-system")]
mod openblas;
pub(crate) mod positive_definite;
pub(crate) mod tridiagonal;

use ndarray::{Array1, Array2, ArrayView2, ShapeBuilder};
use ndarray_linalg::{Eigh, Lapack, Scalar, UPLO};

use crate::error::{Error, length, not_empty};

/// Residual allowed per unit of the matrix's norm and order.
const RESIDUAL: f64 = 1e-12;

fn norm<T: Scalar<Real = f64>>(a: &ArrayView2<'_, T>) -> f64 {
    a.iter().map(|value| value.square()).sum::<f64>().sqrt()
}

/// Eigenvalues, increasing, and eigenvectors (columns) of a Hermitian matrix; its lower triangle is read.
///
/// # Errors
/// [`Error::Linalg`] if the iteration fails or the vectors do not belong to the matrix.
pub(crate) fn hermitian_eigen<T: Scalar<Real = f64> + Lapack>(
    field: &'static str,
    a: ArrayView2<'_, T>,
) -> Result<(Array1<f64>, Array2<T>), Error> {
    let (rows, order) = a.dim();
    not_empty(field, order)?;
    length(field, order, rows)?;
    if a.iter().any(|value| !value.abs().is_finite()) {
        return Err(failed(field, order, "holds a value that is not finite"));
    }
    let mut columns = Array2::zeros(a.raw_dim().f());
    columns.assign(&a);
    let (values, vectors) = columns
        .eigh(UPLO::Lower)
        .map_err(|_| failed(field, order, "has no converged eigenvalues"))?;
    let mut scaled = vectors.clone();
    for (mut column, value) in scaled.columns_mut().into_iter().zip(&values) {
        column.mapv_inplace(|element| element.mul_real(*value));
    }
    let residual = norm(&(a.dot(&vectors) - scaled).view());
    if residual <= RESIDUAL * order as f64 * norm(&a) {
        Ok((values, vectors))
    } else {
        let reason = "is not Hermitian, or its eigenvectors are those of the conjugate";
        Err(failed(field, order, reason))
    }
}

fn failed(what: &'static str, order: usize, reason: &'static str) -> Error {
    Error::Linalg {
        what,
        order,
        reason,
    }
}

/// The inverse of a Hermitian matrix from its eigenvectors.
#[cfg(test)]
pub(crate) fn inverse(
    a: ArrayView2<'_, num_complex::Complex<f64>>,
) -> Array2<num_complex::Complex<f64>> {
    let (values, vectors) = hermitian_eigen("test", a).unwrap();
    let scaled = &vectors / &values.mapv(num_complex::Complex::from);
    scaled.dot(&vectors.t().mapv(|value| value.conj()))
}

/// Scalar product, in eight partial sums that the compiler keeps in vector registers: those of the function that calls it.
#[inline(always)]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a, a_rest) = a.as_chunks::<8>();
    let (b, b_rest) = b.as_chunks::<8>();
    for i in 0..a.len().min(b.len()) {
        for lane in 0..8 {
            sums[lane] += a[i][lane] * b[i][lane];
        }
    }
    let mut rest = 0.0;
    for i in 0..a_rest.len().min(b_rest.len()) {
        rest += a_rest[i] * b_rest[i];
    }
    let [first, second, third, fourth, fifth, sixth, seventh, eighth] = sums;
    first + second + third + fourth + fifth + sixth + seventh + eighth + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;
    use num_complex::Complex;

    type C64 = Complex<f64>;

    fn hermitian(order: usize) -> Array2<C64> {
        Array2::from_shape_fn((order, order), |(i, j)| {
            let lag = i as f64 - j as f64;
            Complex::from_polar((-lag * lag / 50.0).exp(), 0.6 * lag)
        })
    }

    #[test]
    fn complex_row_major_matrices_keep_their_own_eigenvectors() {
        let row_major = hermitian(24);
        assert!(row_major.is_standard_layout());
        let (values, vectors) = hermitian_eigen("test", row_major.view()).unwrap();
        let (other, _) = hermitian_eigen("test", row_major.t().to_owned().t()).unwrap();
        for (a, b) in values.iter().zip(&other) {
            assert!((a - b).abs() < 1e-12);
        }
        let top = vectors.column(23);
        let product = row_major.dot(&top);
        let residual = product
            .iter()
            .zip(top)
            .map(|(a, b)| (a - b * values[23]).norm())
            .fold(0.0, f64::max);
        assert!(residual < 1e-12);
        // the residual of the conjugate, which the check in `hermitian_eigen` would refuse, is large
        let wrong = row_major.dot(&top.mapv(|x| x.conj())) - top.mapv(|x| x.conj() * values[23]);
        assert!(wrong.iter().map(|x| x.norm()).fold(0.0, f64::max) > 0.1);
    }

    #[test]
    fn eigenvalues_are_those_of_the_matrix_in_both_memory_orders_and_solve_with_it() {
        let a = hermitian(16) + Array2::<C64>::eye(16);
        let x = Array2::from_shape_fn((16, 3), |(i, j)| C64::new(i as f64, j as f64 - 1.0));
        let b = a.dot(&x);
        for inverse in [inverse(a.view()), inverse(a.t().to_owned().t())] {
            assert!(norm(&(inverse.dot(&b) - &x).view()) < 1e-10);
        }
    }

    #[test]
    fn malformed_matrices_are_errors() {
        assert!(hermitian_eigen("a", Array2::<f64>::zeros((2, 3)).view()).is_err());
        assert!(hermitian_eigen("a", Array2::<f64>::zeros((0, 0)).view()).is_err());
        assert!(hermitian_eigen("a", array![[f64::NAN]].view()).is_err());
        let skew = array![[0.0, 1.0], [-1.0, 0.0]];
        let error = hermitian_eigen("skew", skew.view()).unwrap_err();
        assert!(error.to_string().contains("skew of order 2"), "{error}");
        assert!(hermitian_eigen("empty", Array2::<C64>::zeros((0, 0)).view()).is_err());
        let (values, _) =
            hermitian_eigen("singular", array![[1.0, 2.0], [2.0, 4.0]].view()).unwrap();
        assert!(values[0].abs() < 1e-15 && (values[1] - 5.0).abs() < 1e-14);
    }
}
