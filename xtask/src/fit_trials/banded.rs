//! Symmetric banded matrices: product, Cholesky factor, forward substitution.
//!
//! Check: solutions; two correlated numbers by hand.

use ndarray::{Array1, Array2, ArrayView1, s};

/// Lower triangle: entry (i, j), i - width <= j <= i, at `[i, width + j - i]`.
#[derive(Debug, Clone)]
pub(super) struct Banded(Array2<f64>);

impl Banded {
    pub(super) fn zeros(order: usize, width: usize) -> Self {
        Self(Array2::zeros((
            order,
            width.min(order.saturating_sub(1)) + 1,
        )))
    }

    fn width(&self) -> usize {
        self.0.ncols() - 1
    }

    /// Entry (i, j) of the lower triangle.
    pub(super) fn at(&mut self, i: usize, j: usize) -> &mut f64 {
        let column = self.width() + j - i;
        &mut self.0[[i, column]]
    }

    pub(super) fn diagonal(&self) -> ArrayView1<'_, f64> {
        self.0.column(self.width())
    }

    /// First column of a row.
    fn first(&self, i: usize) -> usize {
        i.saturating_sub(self.width())
    }

    /// Row i from one column to before another.
    fn row(&self, i: usize, from: usize, to: usize) -> ArrayView1<'_, f64> {
        let column = |j: usize| self.width() + j - i;
        self.0.slice(s![i, column(from)..column(to)])
    }

    /// A x.
    pub(super) fn times(&self, x: ArrayView1<'_, f64>) -> Array1<f64> {
        let mut product = &x * &self.diagonal();
        for i in 0..x.len() {
            let (first, row) = (self.first(i), self.row(i, self.first(i), i));
            product[i] += row.dot(&x.slice(s![first..i]));
            product.slice_mut(s![first..i]).scaled_add(x[i], &row);
        }
        product
    }

    /// Lower factor L, A = L L^T; nothing unless A is positive definite.
    pub(super) fn factor(mut self) -> Option<Self> {
        for i in 0..self.0.nrows() {
            for j in self.first(i)..=i {
                let from = self.first(i).max(self.first(j));
                let sum = *self.at(i, j) - self.row(i, from, j).dot(&self.row(j, from, j));
                let value = if i == j {
                    sum.sqrt()
                } else {
                    sum / *self.at(j, j)
                };
                // the root of a pivot that is not positive is no number, or zero
                if i == j && (value.is_nan() || value == 0.0) {
                    return None;
                }
                *self.at(i, j) = value;
            }
        }
        Some(self)
    }

    /// L^-1 x of a factor L.
    pub(super) fn forward(&self, mut x: Array1<f64>) -> Array1<f64> {
        for i in 0..x.len() {
            let first = self.first(i);
            x[i] = (x[i] - self.row(i, first, i).dot(&x.slice(s![first..i]))) / self.diagonal()[i];
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0.9^|i - j| within the band, and more on the diagonal.
    fn matrix(order: usize, width: usize) -> Banded {
        let mut a = Banded::zeros(order, width);
        for i in 0..order {
            for j in i.saturating_sub(width)..=i {
                *a.at(i, j) =
                    0.9_f64.powi((i - j) as i32) + if i == j { width as f64 } else { 0.0 };
            }
        }
        a
    }

    #[test]
    fn the_factor_solves() {
        for (order, width) in [(1, 0), (5, 1), (40, 11), (12, 30)] {
            let a = matrix(order, width);
            let x = Array1::from_shape_fn(order, |i| (0.7 * i as f64).sin());
            let white = a.clone().factor().unwrap().forward(x.clone());
            let back = a.clone().factor().unwrap().forward(a.times(x.view()));
            // x^T x = (L^-1 x)^T (L^-1 A x)
            assert!(
                (white.dot(&back) - x.dot(&x)).abs() < 1e-11,
                "{order} {width}"
            );
        }
        let mut bad = matrix(4, 2);
        *bad.at(2, 2) = -1.0;
        assert!(bad.factor().is_none());
    }

    /// The mean of two numbers of variances 1 and correlation 0.5 has the variance 3/4, so that its information is 4/3.
    #[test]
    fn whitened_slopes_give_the_information_of_correlated_numbers() {
        let mut c = Banded::zeros(2, 1);
        (*c.at(0, 0), *c.at(1, 0), *c.at(1, 1)) = (1.0, 0.5, 1.0);
        let white = c.factor().unwrap().forward(Array1::ones(2));
        assert!((white.dot(&white) - 4.0 / 3.0).abs() < 1e-14);
    }
}
