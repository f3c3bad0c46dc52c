//! Solutions and inverses of small positive definite systems whose unknowns have units of very different size.
//!
//! Check: inverse times matrix.

use ndarray::Array2;

use crate::error::Error;
use crate::linalg::cholesky::{cholesky, forward_one};

/// A pivot below this, of a matrix with a unit diagonal, is rounding.
const SINGULAR: f64 = 1e-14;

/// x of a x = b for a symmetric positive definite a.
pub(crate) fn solve(a: &Array2<f64>, b: &[f64]) -> Option<Vec<f64>> {
    // rows and columns scaled to a unit diagonal: parameters have units of very different size
    let n = b.len();
    let scale: Vec<f64> = (0..n).map(|i| a[[i, i]].sqrt().recip()).collect();
    if scale.iter().any(|s| !s.is_finite()) {
        return None;
    }
    let lower = cholesky(Array2::from_shape_fn((n, n), |(i, j)| {
        a[[i, j]] * scale[i] * scale[j]
    }))?;
    // what is left of a diagonal of ones
    if lower.diag().iter().any(|pivot| pivot * pivot < SINGULAR) {
        return None;
    }
    let mut x: Vec<f64> = b.iter().zip(&scale).map(|(b, s)| b * s).collect();
    forward_one(lower.as_slice()?, &mut x);
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|k| lower[[k, i]] * x[k]).sum();
        x[i] = (x[i] - sum) / lower[[i, i]];
    }
    x.iter_mut().zip(&scale).for_each(|(x, s)| *x *= s);
    Some(x)
}

/// The error of a matrix that is not positive definite.
pub(crate) fn singular(what: &'static str, order: usize) -> Error {
    let reason = "is singular to working precision: a free parameter does not show in the data";
    Error::Linalg {
        what,
        order,
        reason,
    }
}

/// Inverse of a symmetric positive definite matrix.
///
/// # Errors
/// [`Error::Linalg`] named `what` if it is singular to working precision.
pub(crate) fn inverse(what: &'static str, a: &Array2<f64>) -> Result<Array2<f64>, Error> {
    let n = a.nrows();
    let mut inverse = Array2::zeros((n, n));
    for j in 0..n {
        let unit: Vec<f64> = (0..n).map(|i| if i == j { 1.0 } else { 0.0 }).collect();
        let column = solve(a, &unit).ok_or(singular(what, n))?;
        (0..n).for_each(|i| inverse[[i, j]] = column[i]);
    }
    Ok(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn inverse_times_matrix_is_one_in_spite_of_units_of_different_size() {
        let a = array![[4e12, 1e5, 2e-1], [1e5, 3e-1, 1e-8], [2e-1, 1e-8, 5e-12]];
        let product = inverse("test", &a).unwrap().dot(&a);
        for ((i, j), value) in product.indexed_iter() {
            let scale = (a[[j, j]] / a[[i, i]]).sqrt();
            assert!(
                (value - f64::from(u8::from(i == j))).abs() < 1e-11 * scale.max(1.0),
                "{product}"
            );
        }
        assert!(inverse("test", &array![[1.0, 1.0], [1.0, 1.0]]).is_err());
        assert!(inverse("test", &array![[1.0, 0.0], [0.0, 0.0]]).is_err());
        // what is left of the second pivot is rounding, and just is not
        assert!(inverse("test", &array![[1.0, 1.0], [1.0, 1.0 + 4e-15]]).is_err());
        assert!(inverse("test", &array![[1.0, 1.0], [1.0, 1.0 + 4e-14]]).is_ok());
    }
}
