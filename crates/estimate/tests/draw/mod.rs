//! Gaussian windows with a given covariance, for the tests: a Cholesky factor times white noise.

use ndarray::Array2;
use num_complex::Complex;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::{Sample, SignalKind};

/// Draws windows x = L w with L L^H the covariance.
pub(crate) struct Windows<S> {
    factor: Vec<Vec<S>>,
}

fn cholesky(covariance: &Array2<Complex<f64>>) -> Vec<Vec<Complex<f64>>> {
    let n = covariance.nrows();
    // a brick-wall noise has no power outside its band: a floor 1e-9 of the total keeps the factor real
    let floor = 1e-9 * covariance.diag().iter().map(|value| value.re).sum::<f64>() / n as f64;
    let mut l = vec![vec![Complex::new(0.0, 0.0); n]; n];
    for i in 0..n {
        for j in 0..=i {
            let sum: Complex<f64> = (0..j).map(|k| l[i][k] * l[j][k].conj()).sum();
            let rest = covariance[[i, j]] - sum;
            l[i][j] = if i == j { Complex::new((rest.re + floor).sqrt(), 0.0) } else { rest / l[j][j] };
        }
        assert!(l[i][i].re.is_finite());
    }
    l
}

pub(crate) trait Draw: Sample {
    fn from_complex(value: Complex<f64>) -> Self;
    fn normal(rng: &mut Xoshiro256PlusPlus) -> Self;
    fn sum_of_products(row: &[Self], white: &[Self]) -> Self;
}

impl Draw for f64 {
    fn from_complex(value: Complex<f64>) -> Self {
        value.re
    }
    fn normal(rng: &mut Xoshiro256PlusPlus) -> Self {
        StandardNormal.sample(rng)
    }
    fn sum_of_products(row: &[Self], white: &[Self]) -> Self {
        row.iter().zip(white).map(|(a, b)| a * b).sum()
    }
}

impl Draw for Complex<f64> {
    fn from_complex(value: Complex<f64>) -> Self {
        value
    }
    fn normal(rng: &mut Xoshiro256PlusPlus) -> Self {
        let part = |rng: &mut Xoshiro256PlusPlus| -> f64 { StandardNormal.sample(rng) };
        Complex::new(part(rng), part(rng)) * 0.5_f64.sqrt()
    }
    fn sum_of_products(row: &[Self], white: &[Self]) -> Self {
        row.iter().zip(white).map(|(a, b)| a * b).sum()
    }
}

impl<S: Draw> Windows<S> {
    pub(crate) fn new(covariance: &Array2<Complex<f64>>) -> Self {
        let real = covariance.mapv(|value| if S::KIND == SignalKind::Real { Complex::from(value.re) } else { value });
        let factor = cholesky(&real).into_iter().map(|row| row.into_iter().map(S::from_complex).collect()).collect();
        Self { factor }
    }

    pub(crate) fn draw(&self, rng: &mut Xoshiro256PlusPlus) -> Vec<S> {
        let white: Vec<S> = (0..self.factor.len()).map(|_| S::normal(rng)).collect();
        self.factor.iter().enumerate().map(|(i, row)| S::sum_of_products(&row[..=i], &white[..=i])).collect()
    }
}
