//! Banded Hermitian positive definite matrices: Cholesky factor, solutions, and the entries of the inverse in the band.
//!
//! The covariance of a line of sight has no entries beyond the length of the pulse, so all this costs
//! order x bandwidth^2 (Takahashi, Fagan and Chen 1973 for the inverse). Real and imaginary parts are kept apart so that
//! the compiler can use vector instructions. Check: against dense matrices of random numbers.

use multiversion::multiversion;
use num_complex::Complex;

/// Lower triangle of a Hermitian banded matrix, column by column: entry (j + d, j) at `j (width + 1) + d`.
#[derive(Debug, Clone, Default)]
pub(crate) struct Banded {
    pub(crate) order: usize,
    /// Number of subdiagonals.
    pub(crate) width: usize,
    pub(crate) re: Vec<f64>,
    pub(crate) im: Vec<f64>,
}

/// target -= source * conj(a + i b), real and imaginary parts apart.
#[inline(always)]
fn subtract(tr: &mut [f64], ti: &mut [f64], sr: &[f64], si: &[f64], a: f64, b: f64) {
    let n = tr.len();
    let ti = &mut ti[..n];
    let sr = &sr[..n];
    let si = &si[..n];
    for i in 0..n {
        tr[i] -= sr[i] * a + si[i] * b;
        ti[i] -= si[i] * a - sr[i] * b;
    }
}

impl Banded {
    /// Makes room for an order and a number of subdiagonals; all entries 0.
    pub(crate) fn reset(&mut self, order: usize, width: usize) {
        self.order = order;
        self.width = width.min(order.saturating_sub(1));
        for part in [&mut self.re, &mut self.im] {
            part.clear();
            part.resize(order * (self.width + 1), 0.0);
        }
    }

    /// Index of the entry (column + down, column).
    pub(crate) fn at(&self, column: usize, down: usize) -> usize {
        column * (self.width + 1) + down
    }

    /// Multiplies all entries.
    pub(crate) fn scale(&mut self, factor: f64) {
        for entry in self.re.iter_mut().chain(&mut self.im) {
            *entry *= factor;
        }
    }

    /// Entries of a column below and on the diagonal.
    fn height(&self, column: usize) -> usize {
        (self.width + 1).min(self.order - column)
    }

    /// Replaces x by L^-H x.
    pub(crate) fn backward(&self, x: &mut [Complex<f64>]) {
        for j in (0..self.order).rev() {
            let start = self.at(j, 0);
            let mut value = x[j];
            for d in 1..self.height(j) {
                value -= Complex::new(self.re[start + d], -self.im[start + d]) * x[j + d];
            }
            x[j] = value / self.re[start];
        }
    }
}

/// Replaces a matrix by its Cholesky factor L (A = L L^H) and returns ln det A; nothing if not positive definite.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn factorize(band: &mut Banded) -> Option<f64> {
    let mut log_determinant = 0.0;
    for j in 0..band.order {
        let start = band.at(j, 0);
        let height = band.height(j);
        let pivot = band.re[start];
        // also false for NaN
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        log_determinant += pivot.ln();
        let scale = pivot.sqrt().recip();
        for i in start..start + height {
            band.re[i] *= scale;
            band.im[i] *= scale;
        }
        let (re_head, re_tail) = band.re.split_at_mut(start + band.width + 1);
        let (im_head, im_tail) = band.im.split_at_mut(start + band.width + 1);
        for k in 1..height {
            let target = (k - 1) * (band.width + 1);
            let count = height - k;
            subtract(
                &mut re_tail[target..target + count],
                &mut im_tail[target..target + count],
                &re_head[start + k..start + height],
                &im_head[start + k..start + height],
                re_head[start + k],
                im_head[start + k],
            );
        }
    }
    Some(log_determinant)
}

/// Replaces rows `from` .. `to` of x by those of L^-1 x, for an x that is 0 above `from`.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn forward(band: &Banded, re: &mut [f64], im: &mut [f64], from: usize, to: usize) {
    for j in from..to {
        let start = band.at(j, 0);
        let scale = band.re[start].recip();
        re[j] *= scale;
        im[j] *= scale;
        let value_re = re[j];
        let value_im = im[j];
        let end = (j + band.height(j)).min(to);
        let count = end - j - 1;
        // x -= L value: `subtract` conjugates its factor
        subtract(
            &mut re[j + 1..end],
            &mut im[j + 1..end],
            &band.re[start + 1..start + 1 + count],
            &band.im[start + 1..start + 1 + count],
            value_re,
            -value_im,
        );
    }
}

/// Entries of A^-1 in the band, from the factor L.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn inverse_into(band: &Banded, out: &mut Banded) {
    out.reset(band.order, band.width);
    let stride = band.width + 1;
    let mut lr = vec![0.0; stride];
    let mut li = vec![0.0; stride];
    let mut xr = vec![0.0; stride];
    let mut xi = vec![0.0; stride];
    for j in (0..band.order).rev() {
        let start = band.at(j, 0);
        let count = band.height(j) - 1;
        let scale = band.re[start].recip();
        for d in 0..count {
            lr[d] = band.re[start + 1 + d] * scale;
            li[d] = band.im[start + 1 + d] * scale;
        }
        xr[..count].fill(0.0);
        xi[..count].fill(0.0);
        // x = V l, V the known block of the inverse below and right of j, of which the lower triangle is stored
        for k in 0..count {
            let column = (j + 1 + k) * stride;
            let rows = count - k;
            let vr = &out.re[column..column + rows];
            let vi = &out.im[column..column + rows];
            subtract(&mut xr[k..count], &mut xi[k..count], vr, vi, -lr[k], li[k]);
            let (sum_re, sum_im) =
                conjugate_dot(&vr[1..], &vi[1..], &lr[k + 1..count], &li[k + 1..count]);
            xr[k] += sum_re;
            xi[k] += sum_im;
        }
        let mut pivot = scale * scale;
        for d in 0..count {
            out.re[start + 1 + d] = -xr[d];
            out.im[start + 1 + d] = -xi[d];
            pivot += lr[d] * xr[d] + li[d] * xi[d];
        }
        out.re[start] = pivot;
    }
}

/// Sum of conj(v) l, in four partial sums that the compiler keeps in vector registers.
#[inline(always)]
fn conjugate_dot(vr: &[f64], vi: &[f64], lr: &[f64], li: &[f64]) -> (f64, f64) {
    let n = vr.len();
    let vi = &vi[..n];
    let lr = &lr[..n];
    let li = &li[..n];
    let mut re = [0.0; 4];
    let mut im = [0.0; 4];
    let whole = n - n % 4;
    for base in (0..whole).step_by(4) {
        for lane in 0..4 {
            let i = base + lane;
            re[lane] += vr[i] * lr[i] + vi[i] * li[i];
            im[lane] += vr[i] * li[i] - vi[i] * lr[i];
        }
    }
    for i in whole..n {
        re[0] += vr[i] * lr[i] + vi[i] * li[i];
        im[0] += vr[i] * li[i] - vi[i] * lr[i];
    }
    (
        (re[0] + re[1]) + (re[2] + re[3]),
        (im[0] + im[1]) + (im[2] + im[3]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;
    use rand::{RngExt, SeedableRng};

    type C64 = Complex<f64>;

    /// A diagonally dominant banded matrix and its dense form.
    fn random(order: usize, width: usize) -> (Banded, Array2<C64>) {
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(order as u64);
        let mut normal = || rng.sample::<f64, _>(rand_distr::StandardNormal);
        let mut band = Banded::default();
        band.reset(order, width);
        let mut dense = Array2::zeros((order, order));
        for j in 0..order {
            for d in 0..=band.width.min(order - 1 - j) {
                let value = if d == 0 {
                    C64::new(3.0 * width as f64 + normal(), 0.0)
                } else {
                    C64::new(normal(), normal())
                };
                let place = band.at(j, d);
                (band.re[place], band.im[place]) = (value.re, value.im);
                dense[[j + d, j]] = value;
                dense[[j, j + d]] = value.conj();
            }
        }
        (band, dense)
    }

    #[test]
    fn inverse_in_the_band_and_determinant_are_those_of_the_dense_matrix() {
        for (order, width) in [(1, 0), (2, 1), (7, 3), (9, 8), (30, 11)] {
            let (mut band, dense) = random(order, width);
            let log_determinant = factorize(&mut band).unwrap();
            let inverse = crate::linalg::inverse(dense.view());
            let (values, _) = crate::linalg::hermitian_eigen("test", dense.view()).unwrap();
            assert!((log_determinant - values.mapv(f64::ln).sum()).abs() < 1e-10);
            let mut out = Banded::default();
            inverse_into(&band, &mut out);
            for j in 0..order {
                for d in 0..=out.width.min(order - 1 - j) {
                    let place = out.at(j, d);
                    let found = C64::new(out.re[place], out.im[place]);
                    assert!(
                        (found - inverse[[j + d, j]]).norm() < 1e-12,
                        "{order} {width} {j} {d}"
                    );
                }
            }
        }
    }

    #[test]
    fn forward_and_backward_solve_with_the_dense_matrix() {
        let (mut band, dense) = random(25, 6);
        factorize(&mut band).unwrap();
        let x: Vec<C64> = (0..25)
            .map(|i| {
                if i < 4 {
                    C64::ZERO
                } else {
                    C64::new(i as f64, 1.0 - i as f64)
                }
            })
            .collect();
        let (mut re, mut im): (Vec<f64>, Vec<f64>) = x.iter().map(|x| (x.re, x.im)).unzip();
        forward(&band, &mut re, &mut im, 4, 25);
        let mut solution: Vec<C64> = re.iter().zip(&im).map(|(a, b)| C64::new(*a, *b)).collect();
        band.backward(&mut solution);
        let back = dense.dot(&ndarray::Array1::from(solution));
        assert!(back.iter().zip(&x).all(|(a, b)| (a - b).norm() < 1e-11));
    }

    #[test]
    fn indefinite_matrices_and_nan_have_no_factor() {
        let (mut band, _) = random(8, 2);
        let place = band.at(5, 0);
        band.re[place] = -1.0;
        assert!(factorize(&mut band).is_none());
        let (mut band, _) = random(8, 2);
        band.re[place] = f64::NAN;
        assert!(factorize(&mut band).is_none());
    }
}
