//! Symmetric banded matrices: product, Cholesky factor, forward substitution.
//!
//! Check: a dense matrix; two correlated numbers by hand.

/// Lower triangle of a symmetric matrix, row by row: entry (i, j), i - `width` <= j <= i, at `i (width + 1) + width + j - i`.
#[derive(Debug, Clone)]
pub(crate) struct Banded {
    order: usize,
    width: usize,
    values: Vec<f64>,
}

/// Sum of products, in partial sums that fit vector registers.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    for (a, b) in a.iter().zip(b) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
}

impl Banded {
    pub(crate) fn zeros(order: usize, width: usize) -> Self {
        let width = width.min(order.saturating_sub(1));
        Self { order, width, values: vec![0.0; order * (width + 1)] }
    }

    /// Entry (i, j) of the lower triangle.
    pub(crate) fn at(&mut self, i: usize, j: usize) -> &mut f64 {
        &mut self.values[i * (self.width + 1) + self.width + j - i]
    }

    pub(crate) fn diagonal(&self) -> impl Iterator<Item = f64> {
        self.values.iter().skip(self.width).step_by(self.width + 1).copied()
    }

    /// First column of row i, and the row from there to the diagonal.
    fn row(&self, i: usize) -> (usize, &[f64]) {
        let first = i.saturating_sub(self.width);
        let end = (i + 1) * (self.width + 1);
        (first, &self.values[end - (i - first) - 1..end])
    }

    /// The rows and columns that `keep` tells, in their order; the band is as wide as before.
    pub(crate) fn part(&self, keep: impl Fn(usize) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.order).filter(|&i| keep(i)).collect();
        let mut part = Self::zeros(kept.len(), self.width);
        for (i, &from) in kept.iter().enumerate() {
            let (first, row) = self.row(from);
            for j in (0..=i).rev().take_while(|&j| kept[j] >= first) {
                *part.at(i, j) = row[kept[j] - first];
            }
        }
        part
    }

    /// A x.
    pub(crate) fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; self.order];
        for i in 0..self.order {
            let (first, row) = self.row(i);
            product[i] += dot(row, &x[first..=i]);
            for (sum, a) in product[first..i].iter_mut().zip(row) {
                *sum += a * x[i];
            }
        }
        product
    }

    /// Lower factor L, A = L L^T; nothing unless A is positive definite.
    pub(crate) fn factor(mut self) -> Option<Self> {
        let stride = self.width + 1;
        for i in 0..self.order {
            let first = i.saturating_sub(self.width);
            for j in first..=i {
                let from = first.max(j.saturating_sub(self.width));
                let place = |row: usize, column: usize| row * stride + self.width + column - row;
                let sum = self.values[place(i, j)]
                    - dot(&self.values[place(i, from)..place(i, j)], &self.values[place(j, from)..place(j, j)]);
                let value = if i == j { sum.sqrt() } else { sum / self.values[place(j, j)] };
                // the root of a pivot that is not positive is no number, or zero
                if i == j && (value.is_nan() || value == 0.0) {
                    return None;
                }
                self.values[i * stride + self.width + j - i] = value;
            }
        }
        Some(self)
    }

    /// L^-1 x of a factor L.
    pub(crate) fn forward(&self, mut x: Vec<f64>) -> Vec<f64> {
        for i in 0..self.order {
            let (first, row) = self.row(i);
            let (row, pivot) = row.split_at(i - first);
            x[i] = (x[i] - dot(row, &x[first..i])) / pivot[0];
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
                *a.at(i, j) = 0.9_f64.powi((i - j) as i32) + if i == j { width as f64 } else { 0.0 };
            }
        }
        a
    }

    #[test]
    fn the_factor_solves_and_parts_are_parts() {
        for (order, width) in [(1, 0), (5, 1), (40, 11), (12, 30)] {
            let a = matrix(order, width);
            let x: Vec<f64> = (0..order).map(|i| (0.7 * i as f64).sin()).collect();
            let white = a.clone().factor().unwrap().forward(x.clone());
            let back = a.clone().factor().unwrap().forward(a.times(&x));
            // x^T x = (L^-1 x)^T (L^-1 A x)
            assert!((dot(&white, &back) - dot(&x, &x)).abs() < 1e-11, "{order} {width}");
            let odd: Vec<f64> = (0..order).map(|i| if i % 2 == 1 { x[i] } else { 0.0 }).collect();
            let kept: Vec<f64> = x.iter().skip(1).step_by(2).copied().collect();
            let part = a.part(|i| i % 2 == 1).times(&kept);
            assert!(part.iter().zip(a.times(&odd).iter().skip(1).step_by(2)).all(|(p, q)| (p - q).abs() < 1e-12));
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
        let white = c.factor().unwrap().forward(vec![1.0, 1.0]);
        assert!((dot(&white, &white) - 4.0 / 3.0).abs() < 1e-14);
    }
}
