//! The tapered likelihood against the quadratic form, and its estimates against the Cramer-Rao bound.

use crate::fixtures::{baseband, density_at, sigma_s};
use approx::assert_relative_eq;
use ndarray::Array1;
use num_complex::Complex;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::{Scratch, SignalKind, bound::*, estimators::*, spectrum::*};

fn model(full_width_s: f64) -> WindowModel {
    WindowModel::gaussian_pulse(&baseband(), 64, sigma_s(full_width_s), Noise::White).unwrap()
}

/// A window whose covariance is that of `model` in white noise: a sum of tapers with random amplitudes.
fn draw(
    tapers: &[Taper],
    values: &[f64],
    noise: f64,
    velocity_m_s: f64,
    rng: &mut Xoshiro256PlusPlus,
) -> Vec<Complex<f64>> {
    let mut normal = |variance: f64| {
        let part = |rng: &mut Xoshiro256PlusPlus| -> f64 { StandardNormal.sample(rng) };
        Complex::new(part(rng), part(rng)) * (0.5 * variance).sqrt()
    };
    let turn = std::f64::consts::TAU * baseband().frequency_hz(velocity_m_s) / 250e6;
    let amplitudes: Vec<_> = values.iter().map(|value| normal(*value)).collect();
    (0..64)
        .map(|n| {
            let signal: Complex<f64> = tapers
                .iter()
                .zip(&amplitudes)
                .map(|(taper, a)| a * taper.weights[n])
                .sum();
            signal * Complex::from_polar(1.0, turn * n as f64) + normal(noise)
        })
        .collect()
}

/// Tapers and eigenvalues of the pulse covariance down to 1e-3 of the largest, from the weights at a high SNR.
fn basis(full_width_s: f64) -> (Vec<Taper>, Vec<f64>) {
    let tapers = likelihood_tapers(&model(full_width_s), 5e3).unwrap();
    let envelope = model(full_width_s).envelope().mapv(|value| value.re);
    let values = tapers
        .iter()
        .map(|taper| {
            let u = Array1::from(taper.weights.clone());
            u.dot(&envelope.dot(&u))
        })
        .collect();
    (tapers, values)
}

#[test]
fn eigenvalues_of_the_kept_tapers_carry_the_power_of_the_window() {
    for full_width_s in [200e-9, 400e-9] {
        let (_, values) = basis(full_width_s);
        assert_relative_eq!(values.iter().sum::<f64>(), 64.0, max_relative = 1e-4);
    }
    // a handful matters at 200 ns and 10 dB; a pulse much longer than the window leaves one
    assert!((4..=7).contains(&likelihood_tapers(&model(200e-9), 10.0).unwrap().len()));
    assert_eq!(likelihood_tapers(&model(1e-3), 10.0).unwrap().len(), 1);
}

#[test]
fn weighted_tapered_periodograms_are_the_quadratic_form_of_the_likelihood() {
    let (snr, velocity_m_s) = (10.0, -4.3);
    let tapers = likelihood_tapers(&model(200e-9), snr).unwrap();
    let correlogram = Correlogram::<Complex<f64>>::with_tapers(tapers).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
    let (basis_tapers, values) = basis(200e-9);
    let window = draw(&basis_tapers, &values, 0.5, 2.0, &mut rng);
    let mut lags = vec![0.0; 128];
    correlogram.evaluate(&window, &mut Scratch::new(), &mut lags);
    let at = |v_m_s: f64| {
        density_at(
            &lags,
            SignalKind::Complex,
            baseband().frequency_hz(v_m_s),
            &baseband(),
        )
    };
    // independent: x^H R^-1 x by conjugate gradients on the full covariance
    let x = Array1::from(window);
    let form = |v_m_s: f64| {
        let [r, _] = model(200e-9)
            .covariance(v_m_s, snr, SignalKind::Complex)
            .unwrap();
        let dot = |a: &Array1<Complex<f64>>, b: &Array1<Complex<f64>>| {
            a.iter()
                .zip(b)
                .map(|(a, b)| a.conj() * b)
                .sum::<Complex<f64>>()
                .re
        };
        let (mut y, mut rest) = (Array1::zeros(64), x.clone());
        let mut direction = rest.clone();
        for _ in 0..200 {
            let image = r.dot(&direction);
            let before = dot(&rest, &rest);
            if before < 1e-26 {
                break;
            }
            let step = before / dot(&direction, &image);
            y.scaled_add(Complex::from(step), &direction);
            rest.scaled_add(Complex::from(-step), &image);
            direction = &rest + &(direction * Complex::from(dot(&rest, &rest) / before));
        }
        dot(&x, &y)
    };
    // q x^H R^-1 x = |x|^2 - (sum of weights) * density
    let noise = 0.5;
    let slope = noise * (form(velocity_m_s) - form(2.0)) / (at(velocity_m_s) - at(2.0));
    for v_m_s in [-11.0, 0.0, 5.5] {
        let other = noise * (form(v_m_s) - form(2.0)) / (at(v_m_s) - at(2.0));
        assert_relative_eq!(other, slope, max_relative = 2e-2);
    }
    assert!(slope < 0.0);
}

#[test]
fn likelihood_estimates_reach_the_bound_of_twenty_windows() {
    let (basis_tapers, values) = basis(200e-9);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(42);
    for snr_db in [0.0, 10.0] {
        let snr = 10.0_f64.powf(snr_db / 10.0);
        let tapers = likelihood_tapers(&model(200e-9), snr).unwrap();
        let correlogram = Correlogram::<Complex<f64>>::with_tapers(tapers).unwrap();
        let peak = SpectralPeak::new(
            &baseband(),
            SignalKind::Complex,
            &unweighted_lags(64),
            1024,
            Refinement::Parabola,
        )
        .unwrap();
        let (mut scratch, mut one) = (Scratch::new(), vec![0.0; 128]);
        let trials = 800;
        let mut sum = 0.0;
        for trial in 0..trials {
            let velocity_m_s = -8.0 + 16.0 * f64::from(trial) / f64::from(trials);
            let mut mean = vec![0.0; 128];
            for _ in 0..20 {
                let window = draw(&basis_tapers, &values, 5.0 / snr, velocity_m_s, &mut rng);
                correlogram.evaluate(&window, &mut scratch, &mut one);
                mean.iter_mut()
                    .zip(&one)
                    .for_each(|(sum, value)| *sum += value / 20.0);
            }
            let found = peak.estimate(&mean, &mut scratch);
            sum += (found.velocity_m_s - velocity_m_s).powi(2);
        }
        let rms_m_s = (sum / f64::from(trials)).sqrt();
        let bound_m_s = model(200e-9)
            .bound_m_s(0.0, snr, SignalKind::Complex, 20.0)
            .unwrap();
        let ratio = rms_m_s / bound_m_s;
        // standard error of the ratio: 1 / sqrt(2 trials) = 0.025
        assert!((0.9..1.12).contains(&ratio), "{snr_db} dB: {ratio}");
    }
}
