//! Order choice, poles and Capon's spectrum against their definitions; the unbiased correlogram and why it is not used.

use crate::draw::Windows;
use crate::fixtures::{baseband, correlogram_by_sum, noise, sigma_s, table_2};
use approx::assert_abs_diff_eq;
use ndarray::Array2;
use num_complex::Complex;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::{
    Sampling, Scratch, SignalKind, Weighting, bound::*, estimators::*, models::*, spectrum::*,
};

/// x(n) = 1.2 x(n-1) - 0.8 x(n-2) + w(n).
fn second_order(count: usize, seed: u64) -> Vec<f64> {
    let mut x = noise(count + 100, seed);
    for n in 2..x.len() {
        x[n] += 1.2 * x[n - 1] - 0.8 * x[n - 2];
    }
    x.split_off(100)
}

#[test]
fn description_length_finds_the_order_of_a_process_and_akaike_rarely_less() {
    let samples = 1000;
    let (mut right, mut akaike_below) = (0, 0);
    for seed in 0..50 {
        let x = second_order(samples, seed);
        let lags = correlogram_by_sum(&x, &vec![1.0; samples]);
        let full = Autoregression::yule_walker(&lags, SignalKind::Real, 16).unwrap();
        let order = |choice: OrderChoice| choice.order(&full.reflection).unwrap();
        let samples = samples as f64;
        right += usize::from(order(OrderChoice::DescriptionLength { samples }) == 2);
        akaike_below += usize::from(order(OrderChoice::Akaike { samples }) < 2);
        assert_eq!(order(OrderChoice::Fixed), 16);
    }
    assert!(right >= 45 && akaike_below == 0, "{right} {akaike_below}");
    let model = Autoregression::yule_walker(&[1.0, 0.5, 0.2], SignalKind::Real, 2).unwrap();
    assert!(
        OrderChoice::Akaike { samples: 0.0 }
            .order(&model.reflection)
            .is_err()
    );
    assert!(OrderChoice::Fixed.order(&[]).is_err());
}

#[test]
fn truncated_models_are_those_of_the_lower_order() {
    let complex: Vec<_> = noise(128, 4)
        .chunks(2)
        .map(|pair| Complex::new(pair[0], pair[1]))
        .collect();
    let inputs = [
        (
            correlogram_by_sum(&noise(64, 3), &[1.0; 64]),
            SignalKind::Real,
        ),
        (
            correlogram_by_sum(&complex, &[1.0; 64]),
            SignalKind::Complex,
        ),
    ];
    for (lags, kind) in inputs {
        let full = Autoregression::yule_walker(&lags, kind, 12).unwrap();
        for order in [1, 2, 7, 12] {
            let (cut, own) = (
                full.truncated(order).unwrap(),
                Autoregression::yule_walker(&lags, kind, order).unwrap(),
            );
            assert!((cut.noise_power - own.noise_power).abs() < 1e-13);
            for (a, b) in cut.coefficients.iter().zip(&own.coefficients) {
                assert!((a - b).norm() < 1e-13);
            }
        }
        assert!(full.truncated(0).is_err() && full.truncated(13).is_err());
    }
}

#[test]
fn real_and_complex_recursions_give_the_same_model() {
    for order in [1, 2, 3, 16, 33, 63] {
        let lags = correlogram_by_sum(&noise(64, order as u64), &[1.0; 64]);
        let doubled: Vec<f64> = lags.iter().flat_map(|lag| [*lag, 0.0]).collect();
        let real = Autoregression::yule_walker(&lags, SignalKind::Real, order).unwrap();
        let complex = Autoregression::yule_walker(&doubled, SignalKind::Complex, order).unwrap();
        for (a, b) in real.coefficients.iter().zip(&complex.coefficients) {
            assert!((a - b).norm() < 1e-12, "{order}");
        }
        assert!((real.noise_power / complex.noise_power - 1.0).abs() < 1e-12);
    }
}

#[test]
fn nearest_pole_is_that_of_the_line_in_the_band() {
    // two damped lines: 83 MHz in the band with modulus 0.97, 20 MHz outside nearer to the circle
    let turn = |f_hz: f64| std::f64::consts::TAU * f_hz / 250e6;
    let lag = |m: f64| {
        0.97_f64.powf(m) * (turn(83e6) * m).cos() + 0.2 * 0.99_f64.powf(m) * (turn(20e6) * m).cos()
    };
    let lags: Vec<f64> = (0..64).map(|m| lag(f64::from(m))).collect();
    let model = Autoregression::yule_walker(&lags, SignalKind::Real, 16).unwrap();
    let (frequency_hz, modulus) = model.nearest_pole(&table_2()).unwrap().unwrap();
    assert!(
        (frequency_hz - 83e6).abs() < 0.3e6 && (0.95..0.99).contains(&modulus),
        "{frequency_hz} {modulus}"
    );
    assert_eq!(model.poles().unwrap().len(), 16);
    let pole = ModelPeak::new(
        ModelReading::Pole,
        &table_2(),
        SignalKind::Real,
        64,
        16,
        2048,
        Refinement::Parabola,
    )
    .unwrap();
    let found = pole.estimate(&lags, &mut Scratch::new());
    assert_abs_diff_eq!(
        found.velocity_m_s,
        table_2().velocity_m_s(frequency_hz),
        epsilon = 1e-9
    );
    let narrow = Sampling {
        band_hz: (60e6, 62e6),
        ..table_2()
    };
    let single = Autoregression::yule_walker(&lags, SignalKind::Real, 1).unwrap();
    assert!(single.nearest_pole(&narrow).unwrap().is_none());
}

/// (p + 1) / (e^H R^-1 e) by elimination, R the Toeplitz matrix of the first p + 1 lags.
fn capon_by_inversion(lag: impl Fn(i64) -> Complex<f64>, order: usize, turn: f64) -> f64 {
    let n = order + 1;
    let steering: Vec<_> = (0..n)
        .map(|k| Complex::from_polar(1.0, turn * k as f64))
        .collect();
    let mut rows: Vec<Vec<Complex<f64>>> = (0..n)
        .map(|i| {
            (0..n)
                .map(|j| lag(i as i64 - j as i64))
                .chain([steering[i]])
                .collect()
        })
        .collect();
    for i in 0..n {
        let pivot: Vec<_> = rows[i].iter().map(|value| value / rows[i][i]).collect();
        for (k, row) in rows.iter_mut().enumerate() {
            let factor = if k == i { Complex::from(0.0) } else { row[i] };
            row.iter_mut()
                .zip(&pivot)
                .for_each(|(value, above)| *value -= factor * above);
        }
        rows[i] = pivot;
    }
    let solution: Vec<_> = rows.iter().map(|row| row[n]).collect();
    n as f64
        / steering
            .iter()
            .zip(&solution)
            .map(|(e, x)| (e.conj() * x).re)
            .sum::<f64>()
}

#[test]
fn capon_peak_is_that_of_the_inverted_covariance() {
    let complex: Vec<_> = (0..64)
        .zip(noise(128, 6).chunks(2))
        .map(|(n, pair)| {
            Complex::from_polar(1.0, 0.3 * f64::from(n)) + 0.3 * Complex::new(pair[0], pair[1])
        })
        .collect();
    let real: Vec<f64> = (0..64)
        .zip(noise(64, 7))
        .map(|(n, w)| (2.2 * f64::from(n)).cos() + 0.3 * w)
        .collect();
    let lags = [
        (
            correlogram_by_sum(&real, &[1.0; 64]),
            SignalKind::Real,
            table_2(),
        ),
        (
            correlogram_by_sum(&complex, &[1.0; 64]),
            SignalKind::Complex,
            baseband(),
        ),
    ];
    for (lags, kind, sampling) in lags {
        let lag = |m: i64| {
            let k = m.unsigned_abs() as usize;
            let value = match kind {
                SignalKind::Real => Complex::from(lags[k]),
                SignalKind::Complex => Complex::new(lags[2 * k], lags[2 * k + 1]),
            };
            if m < 0 { value.conj() } else { value }
        };
        for order in [2, 9, 16] {
            let capon = ModelPeak::new(
                ModelReading::Capon,
                &sampling,
                kind,
                64,
                order,
                2048,
                Refinement::Parabola,
            )
            .unwrap();
            let found = capon.estimate(&lags, &mut Scratch::new());
            let density = |f_hz: f64| {
                capon_by_inversion(
                    lag,
                    order,
                    std::f64::consts::TAU * f_hz / sampling.sample_rate_hz,
                )
            };
            let (low_hz, high_hz) = sampling.band_hz;
            let grid = (0..=5000).map(|k| low_hz + (high_hz - low_hz) * f64::from(k) / 5000.0);
            let best_hz = grid
                .max_by(|a, b| density(*a).total_cmp(&density(*b)))
                .unwrap();
            assert_abs_diff_eq!(
                found.velocity_m_s,
                sampling.velocity_m_s(best_hz),
                epsilon = 0.01
            );
        }
    }
    // white noise reads its variance: lag 0 alone, whatever the order
    assert_abs_diff_eq!(
        capon_by_inversion(|m| Complex::from(f64::from(u8::from(m == 0)) * 3.0), 8, 1.0),
        3.0,
        epsilon = 1e-12
    );
    assert!(
        ModelPeak::new(
            ModelReading::Capon,
            &table_2(),
            SignalKind::Real,
            16,
            16,
            1024,
            Refinement::None
        )
        .is_err()
    );
}

fn band_noise_model() -> Array2<Complex<f64>> {
    let sigma_s = sigma_s(200e-9);
    let model =
        WindowModel::gaussian_pulse(&table_2(), 64, sigma_s, Noise::Band { floor: 0.0 }).unwrap();
    let [covariance, _] = model.covariance(-3.7, 1.0, SignalKind::Real).unwrap();
    covariance
}

#[test]
fn unbiased_correlogram_has_the_mean_of_the_covariance_but_no_model_of_order_16() {
    let covariance = band_noise_model();
    let windows = Windows::<f64>::new(&covariance);
    let statistic = Correlogram::<f64>::new(Weighting::Rectangular, 64).unwrap();
    let weights = statistic.lag_weights();
    let kind = SignalKind::Real;
    let ca = ModelPeak::new(
        ModelReading::Spectrum,
        &table_2(),
        kind,
        64,
        16,
        2048,
        Refinement::Parabola,
    )
    .unwrap();
    let unbiased = Unbiased::new(ca.clone(), kind, &weights).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let (mut scratch, mut one) = (Scratch::new(), vec![0.0; 64]);
    let trials = 200;
    let (mut mean, mut square) = (vec![0.0; 64], vec![0.0; 64]);
    let mut failed = 0;
    for _ in 0..trials {
        let mut average = vec![0.0; 64];
        for _ in 0..8 {
            statistic.evaluate(&windows.draw(&mut rng), &mut scratch, &mut one);
            average
                .iter_mut()
                .zip(&one)
                .for_each(|(sum, value)| *sum += value / 8.0);
        }
        for (m, value) in average
            .iter()
            .zip(&weights)
            .map(|(value, weight)| value / weight)
            .enumerate()
        {
            mean[m] += value / f64::from(trials);
            square[m] += value * value / f64::from(trials);
        }
        assert!(ca.estimate(&average, &mut scratch).velocity_m_s.is_finite());
        failed += i32::from(unbiased.estimate(&average, &mut scratch).flag == Quality::Invalid);
    }
    for m in 0..40 {
        let error = ((square[m] - mean[m] * mean[m]) / f64::from(trials)).sqrt();
        assert!(
            (mean[m] - covariance[[m, 0]].re).abs() < 4.5 * error,
            "lag {m}"
        );
    }
    assert!(failed > trials / 2, "{failed} of {trials}");
    assert!(Unbiased::new(ca.clone(), kind, &weights[1..]).is_err());
    assert!(Unbiased::new(ca, kind, &[0.0; 64]).is_err());
}
