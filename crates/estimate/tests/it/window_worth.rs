//! How many independent windows those of one pulse are worth, by the scatter of their mean periodogram.

use crate::draw::{Draw, Windows};
use crate::fixtures::{baseband, sigma_s, table_2};
use ndarray::Array2;
use num_complex::Complex;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;
use wakescope_estimate::{SignalKind, bound::*, map::WindowCovariance, window::Weighting};

/// Power of the mean periodogram of windows of one pulse at the frequency of the peak, its mean squared over its variance: what the
/// windows are worth, and its standard error.
fn worth<S: Draw>(
    record: &Array2<Complex<f64>>,
    weights: &[f64],
    cycles: f64,
    draws: u64,
) -> (f64, f64) {
    let (windows, mut rng) = (
        Windows::<S>::new(record),
        Xoshiro256PlusPlus::seed_from_u64(11),
    );
    let turn = |n: usize| Complex::from_polar(1.0, -TAU * cycles * n as f64);
    let power = |window: &[S]| -> f64 {
        let sum: Complex<f64> = window
            .iter()
            .zip(weights)
            .enumerate()
            .map(|(n, (x, h))| x.to_complex() * h * turn(n))
            .sum();
        sum.norm_sqr()
    };
    let powers: Vec<f64> = (0..draws)
        .map(|_| {
            let record = windows.draw(&mut rng);
            record.windows(weights.len()).map(power).sum::<f64>()
        })
        .collect();
    let n = draws as f64;
    let mean = powers.iter().sum::<f64>() / n;
    let moment = |order: i32| {
        powers
            .iter()
            .map(|p| (p / mean - 1.0).powi(order))
            .sum::<f64>()
            / n
    };
    let error = (moment(4) - moment(2).powi(2)).sqrt() / n.sqrt() / moment(2);
    (moment(2).recip(), error / moment(2))
}

#[test]
fn windows_are_worth_what_the_variance_of_their_mean_periodogram_says_in_noise_of_any_density() {
    let pulse = |full_width_s: f64, rate_hz: f64| {
        let sigma = sigma_s(full_width_s) * rate_hz;
        move |lag: usize| (-0.25 * (lag as f64 / sigma).powi(2)).exp()
    };
    let gaussian = Weighting::default();
    // window, windows of one pulse, pulse, ratio in dB, noise; the values that noise taken as white in the whole spectrum gave
    for (sampling, window, count, weighting, pulse_s, snr_db, band, wrong) in [
        (table_2(), 64, 60, gaussian, 200e-9, -10.0, true, 1.36),
        (table_2(), 16, 21, gaussian, 100e-9, -10.0, true, 1.70),
        (table_2(), 16, 21, gaussian, 100e-9, -10.0, false, 2.06),
        (baseband(), 16, 21, gaussian, 100e-9, -10.0, true, 1.70),
        (baseband(), 16, 21, gaussian, 100e-9, -10.0, false, 0.0),
        (table_2(), 32, 21, gaussian, 400e-9, -10.0, true, 1.15),
    ] {
        let weights = weighting.weights(window).unwrap();
        let signal = pulse(pulse_s, sampling.sample_rate_hz);
        let share = (sampling.band_hz.1 - sampling.band_hz.0) / sampling.sample_rate_hz;
        let noise = |lag: usize| match (band, lag) {
            (true, 0) => 1.0,
            (true, _) => (TAU * 0.5 * share * lag as f64).sin() / (TAU * 0.5 * lag as f64 * share),
            (false, 0) => 1.0 / share,
            (false, _) => 0.0,
        };
        let snr = 10f64.powf(0.1 * snr_db);
        let covariance = WindowCovariance::new(&weights, 1, 200, signal, noise).unwrap();
        let foretold =
            (count * count) as f64 / covariance.correlation(snr).unwrap().pair_sum(count);

        let kind = if sampling.band_hz.0 < 0.0 {
            SignalKind::Complex
        } else {
            SignalKind::Real
        };
        let noise = if band {
            Noise::Band { floor: 1e-6 }
        } else {
            Noise::White
        };
        let model =
            WindowModel::gaussian_pulse(&sampling, window + count - 1, sigma_s(pulse_s), noise)
                .unwrap();
        let [record, _] = model.covariance(0.0, snr, kind).unwrap();
        let cycles = sampling.frequency_hz(0.0) * sampling.period_s();
        let (found, error) = match kind {
            SignalKind::Real => worth::<f64>(&record, &weights, cycles, 10_000),
            SignalKind::Complex => worth::<Complex<f64>>(&record, &weights, cycles, 10_000),
        };
        assert!(
            (found - foretold).abs() < 3.5 * error,
            "{window} {band} {kind:?}: {foretold}, {found} +- {error}"
        );
        assert!(
            (found - wrong).abs() > 3.5 * error,
            "{window} {band} {kind:?}: {wrong}, {found} +- {error}"
        );
    }
}
