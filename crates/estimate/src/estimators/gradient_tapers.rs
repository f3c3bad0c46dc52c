//! Tapers of the likelihood of velocity and gradient: eigenvectors of the covariance in the noise and the mirror image.
//!
//! With M the noise, and for real windows the mirror image of the signal, M^-1/2 S M^-1/2 = V mu V^H gives the tapers
//! h_i = M^-1/2 v_i and their weights P mu_i / (1 + P mu_i). Check: in the tests of the likelihood.

use ndarray::Array2;
use num_complex::Complex;

use crate::bound::GradientModel;
use crate::error::Error;
use crate::linalg::hermitian_eigen;
use crate::window::{Sampling, SignalKind};

type C64 = Complex<f64>;

/// Tapers with less than this share of the largest weight are left out.
const LEAST_WEIGHT: f64 = 1e-3;

/// The tapers of one gradient, each conjugated and times the root of its weight.
#[derive(Debug, Clone)]
pub(crate) struct Tapers {
    pub(crate) weights: Vec<Vec<C64>>,
    /// Sum of ln(1 + P mu).
    pub(crate) spread: f64,
}

/// What each product of two samples weighs in the lags of the tapered correlogram.
#[derive(Debug, Clone)]
pub(crate) struct LagWeights(Vec<Vec<C64>>);

impl LagWeights {
    pub(crate) fn new(tapers: &Tapers, window_samples: usize) -> Self {
        let weight = |k: usize, m: usize| {
            tapers
                .weights
                .iter()
                .map(|taper| taper[k + m] * taper[k].conj())
                .sum()
        };
        Self(
            (0..window_samples)
                .map(|m| (0..window_samples - m).map(|k| weight(k, m)).collect())
                .collect(),
        )
    }

    /// Expected lags of the tapered correlogram for windows of that covariance.
    pub(crate) fn expected_lags(&self, covariance: &Array2<C64>) -> Vec<f64> {
        let lag = |(m, weights): (usize, &Vec<C64>)| -> C64 {
            weights
                .iter()
                .enumerate()
                .map(|(k, weight)| weight * covariance[[k + m, k]])
                .sum()
        };
        self.0
            .iter()
            .enumerate()
            .map(lag)
            .flat_map(|value| [value.re, value.im])
            .collect()
    }
}

/// Weight of lag m in the energy inside the band: the integral of exp(-j 2 pi f m / F_s) over the band, twice for m > 0.
pub(crate) fn band_lag(sampling: &Sampling, m: usize, share: f64) -> C64 {
    if m == 0 {
        return Complex::from(share);
    }
    let turn = std::f64::consts::PI * m as f64 / sampling.sample_rate_hz;
    let (low_hz, high_hz) = sampling.band_hz;
    let size = (turn * (high_hz - low_hz)).sin() / (std::f64::consts::PI * m as f64);
    Complex::from_polar(2.0 * size, -turn * (high_hz + low_hz))
}

/// Tapers of one gradient, `power` the signal power over the noise density.
pub(crate) fn tapers(
    model: &GradientModel,
    gradient_per_s: f64,
    power: f64,
    kind: SignalKind,
) -> Result<Tapers, Error> {
    let [signal, _] = model.envelope(gradient_per_s);
    let n = model.window_samples;
    let whitener = match kind {
        SignalKind::Complex => None,
        SignalKind::Real => Some(whitener(&model.sampling, &signal, power)?),
    };
    let whitened = whitener
        .as_ref()
        .map_or_else(|| signal.clone(), |root| root.dot(&signal).dot(root));
    let (values, vectors) = hermitian_eigen("signal covariance", whitened.view())?;
    let weight = |k: usize| {
        let gain = (power * values[k]).max(0.0);
        gain / (1.0 + gain)
    };
    let kept = (0..n)
        .rev()
        .filter(|&k| weight(k) > LEAST_WEIGHT * weight(n - 1));
    let weights = kept.map(|k| {
        let vector = vectors.column(k).to_owned();
        let taper = whitener
            .as_ref()
            .map_or_else(|| vector.clone(), |root| root.dot(&vector));
        let root = weight(k).sqrt();
        taper.iter().map(|value| value.conj() * root).collect()
    });
    let weights = weights.collect();
    let spread = values
        .iter()
        .map(|value| (power * value).max(0.0).ln_1p())
        .sum();
    Ok(Tapers { weights, spread })
}

/// M^-1/2 for white noise of density 1 and the mirror image of the signal, spread over the places that the band allows.
fn whitener(sampling: &Sampling, signal: &Array2<C64>, power: f64) -> Result<Array2<C64>, Error> {
    let (low_hz, high_hz) = sampling.band_hz;
    let turn = std::f64::consts::TAU / sampling.sample_rate_hz;
    let interference = Array2::from_shape_fn(signal.dim(), |(n, m)| {
        let lag = n as f64 - m as f64;
        // the image of a line at f lies at -f, and after the carrier is removed at -2 f
        let spread = turn * (high_hz - low_hz) * lag;
        let sinc = if lag == 0.0 {
            1.0
        } else {
            spread.sin() / spread
        };
        let image = signal[[n, m]].conj()
            * Complex::from_polar(power * sinc, -turn * (low_hz + high_hz) * lag);
        image + if n == m { 1.0 } else { 0.0 }
    });
    let (values, vectors) = hermitian_eigen("noise covariance", interference.view())?;
    let mut scaled = vectors.clone();
    for (mut column, value) in scaled.columns_mut().into_iter().zip(&values) {
        // at least the noise, whatever the rounding
        column.mapv_inplace(|element| element * value.max(0.5).sqrt().recip());
    }
    Ok(scaled.dot(&vectors.t().mapv(|value| value.conj())))
}
