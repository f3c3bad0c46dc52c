//! Table 2 of the chapter, noise and tones; the correlogram written out.

use num_complex::Complex;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::{Sampling, SignalKind, window::Sample};

/// Sampling and band of Table 2: real samples at an intermediate frequency.
pub(crate) fn table_2() -> Sampling {
    Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap()
}

/// The same in complex baseband.
pub(crate) fn baseband() -> Sampling {
    Sampling::baseband(250e6, 1.55e-6, 50e6).unwrap()
}

/// Half-width of |f|^2 at 1/e of a pulse of that full width at half maximum.
pub(crate) fn sigma_s(full_width_s: f64) -> f64 {
    full_width_s / (2.0 * 2.0_f64.ln().sqrt())
}

/// A standard normal number.
pub(crate) fn normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
    rng.sample(StandardNormal)
}

/// So many of them.
pub(crate) fn noise(count: usize, seed: u64) -> Vec<f64> {
    let rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    StandardNormal.sample_iter(rng).take(count).collect()
}

/// A window of 64 real samples of a hard target.
pub(crate) fn tone(velocity_m_s: f64, phase_rad: f64) -> Vec<f64> {
    let turn = std::f64::consts::TAU * table_2().frequency_hz(velocity_m_s) / 250e6;
    (0..64)
        .map(|n| (turn * n as f64 + phase_rad).cos())
        .collect()
}

/// Density of a correlogram at one frequency: the sum over all its lags.
pub(crate) fn density_at(
    lags: &[f64],
    kind: SignalKind,
    frequency_hz: f64,
    sampling: &Sampling,
) -> f64 {
    let turn = std::f64::consts::TAU * frequency_hz / sampling.sample_rate_hz;
    let mut sum = 0.0;
    for (m, lag) in lags.chunks(kind.lag_numbers(1)).enumerate() {
        let lag = Complex::new(lag[0], lag.get(1).copied().unwrap_or(0.0));
        let weight = if m == 0 { 1.0 } else { 2.0 };
        sum += weight * (lag * Complex::from_polar(1.0, -turn * m as f64)).re;
    }
    sum
}

/// The biased correlogram written out as a double sum.
pub(crate) fn correlogram_by_sum<S: Sample>(window: &[S], weights: &[f64]) -> Vec<f64> {
    let energy: f64 = weights.iter().map(|h| h * h).sum();
    let weighted: Vec<_> = window
        .iter()
        .zip(weights)
        .map(|(sample, h)| sample.to_complex() * h)
        .collect();
    let lag = |m: usize| {
        let products = weighted[m..]
            .iter()
            .zip(&weighted)
            .map(|(ahead, behind)| ahead * behind.conj());
        let lag = products.sum::<Complex<f64>>() / energy;
        [lag.re, lag.im]
            .into_iter()
            .take(if S::KIND == SignalKind::Real { 1 } else { 2 })
    };
    (0..weighted.len()).flat_map(lag).collect()
}
