//! Periodogram and correlogram against written-out sums, a stored window, white noise and tones.

use crate::fixtures::{correlogram_by_sum, noise, table_2, tone};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use num_complex::Complex;
use wakescope_estimate::{estimators::*, spectrum::*, window::*};

fn complex_noise(count: usize, seed: u64) -> Vec<Complex<f64>> {
    noise(2 * count, seed)
        .chunks(2)
        .map(|pair| Complex::new(pair[0], pair[1]) / 2.0_f64.sqrt())
        .collect()
}

/// Columns x, r_biased, pgram of the stored window.
fn stored_window() -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/reference/estimate/window64_vector.csv"
    );
    let text = std::fs::read_to_string(path).unwrap();
    let (mut x, mut r, mut p) = (vec![], vec![], vec![]);
    for line in text
        .lines()
        .filter(|l| l.starts_with(|c: char| c.is_ascii_digit()))
    {
        let fields: Vec<&str> = line.split(',').collect();
        x.push(fields[1].parse().unwrap());
        r.push(fields[2].parse().unwrap());
        p.extend(fields[5].parse::<f64>());
    }
    assert_eq!((x.len(), r.len(), p.len()), (64, 64, 33));
    (x, r, p)
}

#[test]
fn correlogram_and_periodogram_reproduce_the_stored_window() {
    let (x, r, p) = stored_window();
    let mut scratch = Scratch::new();
    let correlogram = Correlogram::<f64>::new(Weighting::Rectangular, 64).unwrap();
    let mut lags = vec![0.0; 64];
    correlogram.evaluate(&x, &mut scratch, &mut lags);
    for (found, expected) in lags.iter().zip(&r) {
        assert_abs_diff_eq!(found, expected, epsilon = 1e-12 * r[0]);
    }
    let spectrum = LagSpectrum::new(SignalKind::Real, 64, 64).unwrap();
    let density = spectrum.density(&lags, &mut scratch).unwrap();
    let largest = p.iter().copied().fold(0.0, f64::max);
    for (found, expected) in density.iter().zip(&p) {
        assert_abs_diff_eq!(found, expected, epsilon = 1e-12 * largest);
    }
}

/// The estimator with that weighting, the rest by default.
fn weighted(weighting: Weighting) -> PeriodogramPlan<f64> {
    PeriodogramPlan::with(&table_2(), 64, weighting, 1024, Refinement::Parabola).unwrap()
}

#[test]
fn peak_velocities_reproduce_the_stored_window() {
    let (x, _, _) = stored_window();
    let mut scratch = Scratch::new();
    let sampling = table_2();
    let rectangular = Weighting::Rectangular;
    let literal = PeriodogramPlan::<f64>::literal(&sampling, 64, rectangular).unwrap();
    let padded = PeriodogramPlan::with(&sampling, 64, rectangular, 4096, Refinement::None).unwrap();
    for (plan, velocity_m_s) in [(literal, -4.6015625), (padded, -4.1758422852)] {
        let found = plan.velocity(&x, &mut scratch).unwrap();
        assert_abs_diff_eq!(found.velocity_m_s, velocity_m_s, epsilon = 1e-9);
        assert_eq!(found.flag, Quality::Good);
    }
}

/// (29), corrected, written out at frequency index k of m.
fn periodogram_by_sum<S: Sample>(window: &[S], weights: &[f64], k: usize, m: usize) -> f64 {
    let energy: f64 = weights.iter().map(|h| h * h).sum();
    let sum: Complex<f64> = window
        .iter()
        .zip(weights)
        .enumerate()
        .map(|(n, (sample, h))| {
            let angle = -std::f64::consts::TAU * ((k * n) % m) as f64 / m as f64;
            sample.to_complex() * *h * Complex::from_polar(1.0, angle)
        })
        .sum();
    sum.norm_sqr() / energy
}

fn check_identity<S: Sample>(windows: &[Vec<S>], weighting: Weighting) {
    let n = windows[0].len();
    let weights = weighting.weights(n).unwrap();
    let mut scratch = Scratch::new();
    let correlogram = Correlogram::<S>::new(weighting, n).unwrap();
    let mut one = vec![0.0; correlogram.statistic_len()];
    let mut mean = vec![0.0; one.len()];
    for window in windows {
        correlogram.evaluate(window, &mut scratch, &mut one);
        for (sum, value) in mean.iter_mut().zip(&one) {
            *sum += value / windows.len() as f64;
        }
        for (fast, slow) in one.iter().zip(correlogram_by_sum(window, &weights)) {
            assert_abs_diff_eq!(*fast, slow, epsilon = 1e-13 * one[0]);
        }
    }
    for m in [2 * n - 1, 2 * n, 1024] {
        let spectrum = LagSpectrum::new(S::KIND, n, m).unwrap();
        let density = spectrum.density(&mean, &mut scratch).unwrap().to_vec();
        // those of negative frequencies follow
        let frequencies = if S::KIND == SignalKind::Real {
            m / 2 + 1
        } else {
            m
        };
        let mean = |k: usize| {
            windows
                .iter()
                .map(|window| periodogram_by_sum(window, &weights, k, m))
                .sum::<f64>()
        };
        let average: Vec<f64> = (0..frequencies)
            .map(|k| mean(k) / windows.len() as f64)
            .collect();
        let largest = average.iter().copied().fold(0.0, f64::max);
        for (a, b) in density.iter().zip(&average) {
            assert_abs_diff_eq!(a, b, epsilon = 1e-12 * largest);
        }
    }
}

#[test]
fn transform_of_the_mean_biased_correlogram_is_the_mean_padded_periodogram() {
    for weighting in [
        Weighting::Rectangular,
        Weighting::Hann,
        Weighting::default(),
    ] {
        for n in [1, 2, 17, 64] {
            let real: Vec<_> = (0..5).map(|seed| noise(n, seed)).collect();
            check_identity(&real, weighting);
            let complex: Vec<_> = (0..5).map(|seed| complex_noise(n, seed)).collect();
            check_identity(&complex, weighting);
        }
    }
}

#[test]
fn white_noise_reads_its_variance_for_every_weighting() {
    let windows = 4000;
    for weighting in [
        Weighting::Rectangular,
        Weighting::Hann,
        Weighting::default(),
    ] {
        let correlogram = Correlogram::<f64>::new(weighting, 64).unwrap();
        let spectrum = LagSpectrum::new(SignalKind::Real, 64, 64).unwrap();
        let samples = noise(64 * windows, 11);
        let (mut scratch, mut lags) = (Scratch::new(), vec![0.0; 64]);
        // one frequency well inside: an exponential variable of mean 1 and variance 1
        let density = |window: &[f64]| {
            correlogram.evaluate(window, &mut scratch, &mut lags);
            spectrum.density(&lags, &mut scratch).unwrap()[20]
        };
        let mean: f64 = samples.chunks(64).map(density).sum::<f64>() / windows as f64;
        let z = (mean - 1.0) * (windows as f64).sqrt();
        assert!(z.abs() < 4.0, "{weighting:?}: z = {z}");
    }
}

#[test]
fn noise_free_tones_keep_their_velocity_within_the_leakage() {
    let mut scratch = Scratch::new();
    for (weighting, bar_m_s) in [(Weighting::Rectangular, 0.09), (Weighting::default(), 0.04)] {
        let plan = weighted(weighting);
        let mut worst_m_s = 0.0_f64;
        for step in 0..60 {
            let velocity_m_s = -18.0 + 0.61 * step as f64;
            let window = tone(velocity_m_s, step as f64);
            let found = plan.velocity(&window, &mut scratch).unwrap();
            assert_eq!(found.flag, Quality::Good);
            worst_m_s = worst_m_s.max((found.velocity_m_s - velocity_m_s).abs());
        }
        assert!(worst_m_s < bar_m_s, "{weighting:?}: {worst_m_s}");
    }
}

#[test]
fn complex_tones_have_no_image_and_keep_their_velocity() {
    let sampling = Sampling::baseband(250e6, 1.55e-6, 50e6).unwrap();
    let plan = PeriodogramPlan::<Complex<f64>>::new(&sampling, 64).unwrap();
    for velocity_m_s in [-18.3, -3.7, 0.0, 0.001, 7.77] {
        let turn = std::f64::consts::TAU * sampling.frequency_hz(velocity_m_s) / 250e6;
        let window: Vec<_> = (0..64)
            .map(|n| Complex::from_polar(2.0, turn * n as f64))
            .collect();
        let found = plan.velocity(&window, &mut Scratch::new()).unwrap();
        assert_abs_diff_eq!(found.velocity_m_s, velocity_m_s, epsilon = 1e-4);
        // the power is the square of the amplitude, all in the band unless its edge is near
        if velocity_m_s > -10.0 {
            assert_relative_eq!(found.power, 4.0, max_relative = 1e-3);
        }
    }
}

#[test]
fn power_in_the_band_of_a_real_tone_is_half_its_amplitude_squared() {
    let plan = PeriodogramPlan::<f64>::new(&table_2(), 64).unwrap();
    let found = plan.velocity(&tone(1.0, 0.3), &mut Scratch::new()).unwrap();
    assert_relative_eq!(found.power, 0.5, max_relative = 0.01);
}

#[test]
fn literal_mode_stays_on_a_grid_of_three_metres_per_second() {
    let plan = PeriodogramPlan::<f64>::literal(&table_2(), 64, Weighting::Rectangular).unwrap();
    let mut scratch = Scratch::new();
    // calm air lies between bins 20 and 21 and reads one of the two
    let read_m_s = plan
        .velocity(&tone(0.0, 0.2), &mut scratch)
        .unwrap()
        .velocity_m_s;
    assert!((read_m_s - 1.453_125).abs() < 1e-9 || (read_m_s + 1.574_218_75).abs() < 1e-9);
    let spacing_m_s = 250e6 / 64.0 * 1.55e-6 / 2.0;
    assert_relative_eq!(spacing_m_s, 3.027_343_75, max_relative = 1e-12);
    let steps = (plan
        .velocity(&tone(9.0, 0.2), &mut scratch)
        .unwrap()
        .velocity_m_s
        - read_m_s)
        / spacing_m_s;
    assert_abs_diff_eq!(steps, steps.round(), epsilon = 1e-9);
}

#[test]
fn amplitudes_of_1e_minus_200_and_1e200_keep_their_velocity() {
    let plan = PeriodogramPlan::<f64>::new(&table_2(), 64).unwrap();
    let mut scratch = Scratch::new();
    let window = tone(-3.7, 0.4);
    let reference = plan.velocity(&window, &mut scratch).unwrap();
    for factor in [1e-200, 1e200] {
        let scaled: Vec<f64> = window.iter().map(|x| x * factor).collect();
        let found = plan.velocity(&scaled, &mut scratch).unwrap();
        assert_abs_diff_eq!(found.velocity_m_s, reference.velocity_m_s, epsilon = 1e-9);
        assert_relative_eq!(found.quality, reference.quality, max_relative = 1e-9);
        assert_eq!(found.flag, Quality::Good);
    }
}

#[test]
fn empty_constant_and_broken_signals_have_no_velocity() {
    for weighting in [
        Weighting::Rectangular,
        Weighting::default(),
        Weighting::Hann,
    ] {
        let plan = weighted(weighting);
        let mut scratch = Scratch::new();
        let mut broken = tone(1.0, 0.0);
        broken[10] = f64::NAN;
        for (window, flag) in [
            (vec![0.0; 64], Quality::NoSignal),
            (vec![5.0; 64], Quality::NoSignal),
            (broken, Quality::Invalid),
        ] {
            let found = plan.velocity(&window, &mut scratch).unwrap();
            assert_eq!(found.flag, flag, "{weighting:?}");
            assert!(found.velocity_m_s.is_nan());
        }
        assert!(plan.velocity(&[0.0; 63], &mut scratch).is_err());
    }
}

#[test]
fn tones_outside_the_band_are_flagged() {
    let mut scratch = Scratch::new();
    for weighting in [Weighting::Rectangular, Weighting::default()] {
        let plan = weighted(weighting);
        for velocity_m_s in [-34.0, -28.0, -24.0, -20.5, 20.5, 24.0, 30.0, 45.0, 100.0] {
            let found = plan
                .velocity(&tone(velocity_m_s, 0.7), &mut scratch)
                .unwrap();
            assert_eq!(
                found.flag,
                Quality::OutOfBand,
                "{velocity_m_s} {weighting:?}"
            );
        }
        // 63 m/s folds to 61.0 m/s, next to 0 Hz
        let folded = plan.velocity(&tone(63.0, 0.7), &mut scratch).unwrap();
        assert_ne!(folded.flag, Quality::Good);
    }
}

#[test]
fn noise_at_minus_40_db_gives_finite_velocities_spread_over_the_band() {
    let plan = PeriodogramPlan::<f64>::new(&table_2(), 64).unwrap();
    let mut scratch = Scratch::new();
    let signal = tone(3.0, 0.0);
    let windows = 2000;
    let samples = noise(64 * windows, 5);
    let mut near = 0;
    for window in samples.chunks(64) {
        let mixed: Vec<f64> = window
            .iter()
            .zip(&signal)
            .map(|(n, s)| n + 0.014 * s)
            .collect();
        let found = plan.velocity(&mixed, &mut scratch).unwrap();
        assert!(found.velocity_m_s.abs() <= 19.5 && found.quality >= 1.0);
        near += usize::from((found.velocity_m_s - 3.0).abs() < 0.5);
    }
    // 1 m/s of 38.75 m/s: 2.6 %, at most 2 % more
    assert!(
        (near as f64 / windows as f64 - 0.026).abs() < 0.02,
        "{near}"
    );
}
