//! Dense linear algebra for covariances: solve, condition and Hermitian eigenproblem, with residual checks.
//!
//! The only module that meets ndarray-linalg. Each result is checked against its matrix before it is handed out. In
//! particular ndarray-linalg returns the eigenvectors of the conjugate for complex row-major matrices, whatever the
//! LAPACK; here a matrix goes in column-major. Check: random, singular and ill-conditioned matrices.

pub(crate) mod cholesky;
#[cfg(all(feature = "bundled-lapack", not(feature = "openblas-system")))]
mod dense;
#[cfg(all(feature = "bundled-lapack", not(feature = "openblas-system")))]
mod lapack;
#[cfg(feature = "openblas-system")]
mod openblas;

use ndarray::{Array1, Array2, ArrayView2, OwnedRepr, ShapeBuilder};
use ndarray_linalg::{Eigh, FactorizeInto, LUFactorized, Lapack, Scalar, Solve, UPLO};

use crate::error::{Error, length, not_empty};

/// Residual allowed per unit of the matrix's norm and order.
const RESIDUAL: f64 = 1e-12;

/// Why a matrix has no factors.
pub(crate) const SINGULAR: &str = "is singular";

/// Steps of the power method for a condition number.
const POWER_STEPS: usize = 12;

/// Column-major copy of a square, finite matrix that is not empty.
fn columns<T: Scalar<Real = f64> + Lapack>(field: &'static str, a: ArrayView2<'_, T>) -> Result<Array2<T>, Error> {
    let (rows, order) = a.dim();
    not_empty(field, order)?;
    length(field, order, rows)?;
    if a.iter().any(|value| !value.abs().is_finite()) {
        return Err(Error::Linalg { what: field, order, reason: "holds a value that is not finite" });
    }
    let mut copy = Array2::zeros(a.raw_dim().f());
    copy.assign(&a);
    Ok(copy)
}

fn norm<T: Scalar<Real = f64>>(a: &ArrayView2<'_, T>) -> f64 {
    a.iter().map(|value| value.square()).sum::<f64>().sqrt()
}

/// LU factors of a square matrix, and how far the matrix is from a singular one.
pub(crate) struct Factors<'a, T: Scalar<Real = f64> + Lapack> {
    field: &'static str,
    matrix: ArrayView2<'a, T>,
    lu: LUFactorized<OwnedRepr<T>>,
}

impl<'a, T: Scalar<Real = f64> + Lapack> Factors<'a, T> {
    /// Factorises `a`.
    ///
    /// # Errors
    /// [`Error::Linalg`] if it is singular or not finite, [`Error::Length`] unless it is square.
    pub(crate) fn new(field: &'static str, a: ArrayView2<'a, T>) -> Result<Self, Error> {
        let columns = columns(field, a)?;
        let order = columns.nrows();
        let lu = columns.factorize_into().map_err(|_| Error::Linalg { what: field, order, reason: SINGULAR })?;
        Ok(Self { field, matrix: a, lu })
    }

    fn column(&self, b: &Array1<T>) -> Result<Array1<T>, Error> {
        let (what, order) = (self.field, self.matrix.nrows());
        self.lu.solve(b).map_err(|_| Error::Linalg { what, order, reason: "cannot be solved with" })
    }

    /// X = A^-1 B.
    ///
    /// # Errors
    /// [`Error::Linalg`] if A is singular to working precision, [`Error::Length`] if the shapes differ.
    pub(crate) fn solve(&self, b: ArrayView2<'_, T>) -> Result<Array2<T>, Error> {
        let (a, order) = (&self.matrix, self.matrix.nrows());
        length("right-hand side", order, b.nrows())?;
        let mut x = Array2::zeros(b.raw_dim());
        for (target, column) in x.columns_mut().into_iter().zip(b.columns()) {
            let mut target: ndarray::ArrayViewMut1<'_, T> = target;
            target.assign(&self.column(&column.to_owned())?);
        }
        let residual = norm(&(a.dot(&x) - b).view());
        let size = norm(a) * norm(&x.view()) + norm(&b);
        if residual <= RESIDUAL * order as f64 * size {
            return Ok(x);
        }
        Err(Error::Linalg { what: self.field, order, reason: "is singular to working precision" })
    }

    /// Smallest over largest eigenvalue by absolute value of a Hermitian matrix, each by steps of the power method.
    ///
    /// The steps approach both from the safe side: the smallest from above by a per cent or so, which is plenty.
    pub(crate) fn reciprocal_condition(&self) -> f64 {
        let largest = growth(self.matrix.nrows(), |x| Some(self.matrix.dot(x)));
        let inverse = growth(self.matrix.nrows(), |x| self.column(x).ok());
        let ratio = (largest * inverse).recip();
        if ratio.is_finite() { ratio } else { 0.0 }
    }
}

/// How much a matrix stretches the vector that it stretches most, nearly; infinite where it cannot be told.
fn growth<T: Scalar<Real = f64> + Lapack>(order: usize, times: impl Fn(&Array1<T>) -> Option<Array1<T>>) -> f64 {
    let size = |x: &Array1<T>| x.iter().map(|value| value.square()).sum::<f64>().sqrt();
    // no eigenvector of a covariance is orthogonal to numbers without order
    let mut x: Array1<T> = (0..order).map(|k| T::from_real((1.0 + (k * k) as f64 * 0.7).sin())).collect();
    let mut stretch = 0.0;
    for _ in 0..POWER_STEPS {
        let before = size(&x);
        let Some(y) = times(&x.mapv(|value| value.div_real(before))) else {
            return f64::INFINITY;
        };
        stretch = size(&y);
        if !(stretch.is_finite() && stretch > 0.0) {
            return f64::INFINITY;
        }
        x = y;
    }
    stretch
}

/// X = A^-1 B for a square A.
///
/// # Errors
/// As [`Factors::new`] and [`Factors::solve`].
#[cfg(test)]
pub(crate) fn solve<T: Scalar<Real = f64> + Lapack>(
    field: &'static str,
    a: ArrayView2<'_, T>,
    b: ArrayView2<'_, T>,
) -> Result<Array2<T>, Error> {
    Factors::new(field, a)?.solve(b)
}

/// Eigenvalues, increasing, and eigenvectors (columns) of a Hermitian matrix; its lower triangle is read.
///
/// # Errors
/// [`Error::Linalg`] if the iteration fails or the vectors do not belong to the matrix.
pub(crate) fn hermitian_eigen<T: Scalar<Real = f64> + Lapack>(
    field: &'static str,
    a: ArrayView2<'_, T>,
) -> Result<(Array1<f64>, Array2<T>), Error> {
    let columns = columns(field, a)?;
    let order = columns.nrows();
    let failed = |reason| Error::Linalg { what: field, order, reason };
    let (values, vectors) = columns.eigh(UPLO::Lower).map_err(|_| failed("has no converged eigenvalues"))?;
    let mut scaled = vectors.clone();
    for (mut column, value) in scaled.columns_mut().into_iter().zip(&values) {
        column.mapv_inplace(|element| element.mul_real(*value));
    }
    let residual = norm(&(a.dot(&vectors) - scaled).view());
    if residual <= RESIDUAL * order as f64 * norm(&a) {
        Ok((values, vectors))
    } else {
        Err(failed("is not Hermitian, or its eigenvectors are those of the conjugate"))
    }
}

/// Scalar product, in eight partial sums that the compiler keeps in vector registers: those of the function that calls it.
#[inline(always)]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
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
        let residual = product.iter().zip(top).map(|(a, b)| (a - b * values[23]).norm()).fold(0.0, f64::max);
        assert!(residual < 1e-12);
        // the residual of the conjugate, which the check in `hermitian_eigen` would refuse, is large
        let wrong = row_major.dot(&top.mapv(|x| x.conj())) - top.mapv(|x| x.conj() * values[23]);
        assert!(wrong.iter().map(|x| x.norm()).fold(0.0, f64::max) > 0.1);
    }

    #[test]
    fn solutions_agree_with_the_product_in_both_memory_orders() {
        let a = hermitian(16) + Array2::<C64>::eye(16);
        let x = Array2::from_shape_fn((16, 3), |(i, j)| C64::new(i as f64, j as f64 - 1.0));
        let b = a.dot(&x);
        for found in
            [solve("test", a.view(), b.view()).unwrap(), solve("test", a.t().to_owned().t(), b.view()).unwrap()]
        {
            assert!(norm(&(found - &x).view()) < 1e-10);
        }
    }

    #[test]
    fn reciprocal_condition_is_the_ratio_of_the_extreme_eigenvalues() {
        for floor in [1.0, 1e-3, 1e-9] {
            let a = hermitian(24) + Array2::<C64>::eye(24) * C64::from(floor);
            let (values, _) = hermitian_eigen("test", a.view()).unwrap();
            let ratio = Factors::new("test", a.view()).unwrap().reciprocal_condition() / (values[0] / values[23]);
            assert!((0.98..1.5).contains(&ratio), "{floor}: {ratio}");
        }
        // singular to working precision: nothing but rounding is left of the smallest
        let found = Factors::new("test", hermitian(64).view()).map_or(0.0, |factors| factors.reciprocal_condition());
        assert!(found < 1e-14, "{found}");
    }

    #[test]
    fn singular_and_malformed_matrices_are_errors() {
        let singular = array![[1.0, 2.0], [2.0, 4.0]];
        let unit = Array2::<f64>::eye(2);
        let error = solve("covariance", singular.view(), unit.view()).unwrap_err();
        assert!(error.to_string().contains("covariance") && error.to_string().contains("singular"));
        assert!(solve("a", Array2::<f64>::zeros((2, 3)).view(), unit.view()).is_err());
        assert!(solve("a", Array2::<f64>::zeros((0, 0)).view(), unit.view()).is_err());
        assert!(solve("a", array![[f64::NAN]].view(), array![[1.0]].view()).is_err());
        assert!(solve("a", unit.view(), array![[1.0]].view()).is_err());
        let skew = array![[0.0, 1.0], [-1.0, 0.0]];
        assert!(hermitian_eigen("skew", skew.view()).is_err());
        assert!(hermitian_eigen("empty", Array2::<C64>::zeros((0, 0)).view()).is_err());
        assert_eq!(solve("one", array![[4.0]].view(), array![[2.0]].view()).unwrap(), array![[0.5]]);
    }
}
