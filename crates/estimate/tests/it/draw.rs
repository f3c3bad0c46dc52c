//! Gaussian windows with a given covariance, for the tests: a Cholesky factor times white noise.

use crate::fixtures::sigma_s;
use ndarray::Array2;
use num_complex::Complex;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::{
    Sampling, SignalKind,
    bound::{Noise, WindowModel},
    window::Sample,
};

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
            l[i][j] = if i == j {
                Complex::new((rest.re + floor).sqrt(), 0.0)
            } else {
                rest / l[j][j]
            };
        }
        assert!(l[i][i].re.is_finite());
    }
    l
}

pub(crate) trait Draw: Sample {
    fn normal(rng: &mut Xoshiro256PlusPlus) -> Self;
    fn sum_of_products(row: &[Self], white: &[Self]) -> Self;
}

impl Draw for f64 {
    fn normal(rng: &mut Xoshiro256PlusPlus) -> Self {
        StandardNormal.sample(rng)
    }
    fn sum_of_products(row: &[Self], white: &[Self]) -> Self {
        row.iter().zip(white).map(|(a, b)| a * b).sum()
    }
}

impl Draw for Complex<f64> {
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
        let real = covariance.mapv(|value| {
            if S::KIND == SignalKind::Real {
                Complex::from(value.re)
            } else {
                value
            }
        });
        let factor = cholesky(&real)
            .into_iter()
            .map(|row| row.into_iter().map(S::from_complex).collect())
            .collect();
        Self { factor }
    }

    pub(crate) fn draw(&self, rng: &mut Xoshiro256PlusPlus) -> Vec<S> {
        let white: Vec<S> = (0..self.factor.len()).map(|_| S::normal(rng)).collect();
        self.factor
            .iter()
            .enumerate()
            .map(|(i, row)| S::sum_of_products(&row[..=i], &white[..=i]))
            .collect()
    }
}

/// Real windows of wind with any velocity: signal of unit power, white or band noise.
pub(crate) struct Wind {
    signal: Windows<Complex<f64>>,
    noise: Windows<f64>,
    sampling: Sampling,
}

impl Wind {
    /// The 200 ns pulse in windows of 64 samples.
    pub(crate) fn new(sampling: &Sampling, snr: f64, noise: Noise) -> Self {
        let rest = Sampling {
            intermediate_frequency_hz: 0.0,
            band_hz: (-25e6, 25e6),
            ..*sampling
        };
        let model = WindowModel::gaussian_pulse(&rest, 64, sigma_s(200e-9), Noise::White).unwrap();
        let [signal, _] = model.covariance(0.0, 1e12, SignalKind::Complex).unwrap();
        let real = WindowModel::gaussian_pulse(sampling, 64, sigma_s(200e-9), noise).unwrap();
        let at = |snr: f64| real.covariance(0.0, snr, SignalKind::Real).unwrap()[0].clone();
        let noise = (at(snr) - at(1e15)).mapv(|value| Complex::from(value.re));
        Self {
            signal: Windows::new(&signal),
            noise: Windows::new(&noise),
            sampling: *sampling,
        }
    }

    pub(crate) fn real(&self, velocity_m_s: f64, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        let turn = std::f64::consts::TAU
            * self.sampling.frequency_hz(velocity_m_s)
            * self.sampling.period_s();
        let signal = self.signal.draw(rng);
        let noise = self.noise.draw(rng);
        let carried = signal
            .iter()
            .enumerate()
            .map(|(n, z)| (z * Complex::from_polar(1.0, turn * n as f64)).re);
        carried
            .zip(noise)
            .map(|(signal, noise)| 2.0_f64.sqrt() * signal + noise)
            .collect()
    }
}
