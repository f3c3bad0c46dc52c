//! Autoregressive models against their equations and a stored window; CA and pulse pair against tones and wind.

use crate::fixtures::{baseband, correlogram_by_sum, noise, table_2, tone};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use num_complex::Complex;
use wakescope_estimate::{estimators::*, models::*, spectrum::*, window::*};

/// Columns x, r_biased, a, refl of the stored window.
fn stored_window() -> [Vec<f64>; 4] {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/reference/estimate/window64_vector.csv"
    );
    let text = std::fs::read_to_string(path).unwrap();
    let mut columns: [Vec<f64>; 4] = Default::default();
    for line in text
        .lines()
        .filter(|line| line.starts_with(|c: char| c.is_ascii_digit()))
    {
        for (column, field) in columns.iter_mut().zip(line.split(',').skip(1)) {
            column.extend(field.parse::<f64>());
        }
    }
    assert_eq!(columns.each_ref().map(Vec::len), [64, 64, 17, 16]);
    columns
}

#[test]
fn yule_walker_reproduces_the_stored_model_of_order_16() {
    let [x, r, a, reflection] = stored_window();
    let weights = vec![1.0; 64];
    let own = correlogram_by_sum(&x, &weights);
    for lags in [r, own] {
        let model = Autoregression::yule_walker(&lags, SignalKind::Real, 16).unwrap();
        for (found, expected) in model.coefficients.iter().zip(&a[1..]) {
            assert_abs_diff_eq!(found.re, expected, epsilon = 1e-12);
            assert_eq!(found.im, 0.0);
        }
        for (found, expected) in model.reflection.iter().zip(&reflection) {
            assert_abs_diff_eq!(found.re, expected, epsilon = 1e-12);
        }
        assert_relative_eq!(
            model.noise_power,
            9.864_466_303_239_14e-1,
            max_relative = 1e-12
        );
        assert!(model.reflection.iter().all(|k| k.norm() < 1.0));
    }
}

#[test]
fn ca_peak_reproduces_the_stored_window() {
    let [x, _, _, _] = stored_window();
    let statistic = Correlogram::<f64>::new(Weighting::Rectangular, 64).unwrap();
    let ca = ModelPeak::new(&table_2(), SignalKind::Real, 64, 16, 4096, Refinement::None).unwrap();
    let found = estimate_window(&statistic, &ca, &x, &mut Scratch::new()).unwrap();
    assert_abs_diff_eq!(found.velocity_m_s, -4.223_144_531_2, epsilon = 1e-9);
    assert_eq!(found.flag, Quality::Good);
}

#[test]
fn coefficients_satisfy_the_yule_walker_equations_complex() {
    let window: Vec<_> = noise(128, 1)
        .chunks(2)
        .map(|pair| Complex::new(pair[0], pair[1]))
        .collect();
    let lags = correlogram_by_sum(&window, &vec![1.0; 64]);
    let r = |m: i32| {
        let (re, im) = (
            lags[2 * m.unsigned_abs() as usize],
            lags[2 * m.unsigned_abs() as usize + 1],
        );
        Complex::new(re, if m < 0 { -im } else { im })
    };
    let model = Autoregression::yule_walker(&lags, SignalKind::Complex, 12).unwrap();
    for m in 0..=12 {
        let sum: Complex<f64> = r(m)
            + model
                .coefficients
                .iter()
                .zip(1..)
                .map(|(a, k)| a * r(m - k))
                .sum::<Complex<f64>>();
        let expected = if m == 0 { model.noise_power } else { 0.0 };
        assert!((sum - expected).norm() < 1e-13, "{m}: {sum}");
    }
}

#[test]
fn spectrum_of_a_known_model_has_its_power_and_its_pole() {
    // x(n) = 0.9 e^{j 0.7} x(n-1) + w, variance of w 1: r_m = (0.9 e^{j 0.7})^m / (1 - 0.81)
    let pole = Complex::from_polar(0.9, 0.7);
    let lags: Vec<f64> = (0..5)
        .flat_map(|m| {
            let lag = pole.powi(m) / (1.0 - 0.81);
            [lag.re, lag.im]
        })
        .collect();
    let model = Autoregression::yule_walker(&lags, SignalKind::Complex, 4).unwrap();
    assert!((model.coefficients[0] + pole).norm() < 1e-13);
    assert!(model.coefficients[1..].iter().all(|a| a.norm() < 1e-13));
    assert_relative_eq!(model.noise_power, 1.0, max_relative = 1e-12);
    let peak_hz = 0.7 / std::f64::consts::TAU * 250e6;
    assert_relative_eq!(
        model.density(peak_hz, &baseband()),
        100.0,
        max_relative = 1e-9
    );
    let mean = (0..4096)
        .map(|k| model.density(250e6 * f64::from(k) / 4096.0, &baseband()))
        .sum::<f64>()
        / 4096.0;
    assert_relative_eq!(mean, 1.0 / 0.19, max_relative = 1e-9);
}

#[test]
fn reflection_coefficients_of_biased_correlograms_stay_inside_the_unit_circle() {
    let mut inputs = vec![vec![1.0; 64], tone(-3.0, 0.1), tone(18.9, 1.0)];
    inputs.push((0..64).map(|n| f64::from(u8::from(n == 40))).collect());
    inputs.push((0..64).map(|n| n as f64).collect());
    inputs.push(
        (0..64)
            .map(|n| if n % 2 == 0 { 1e-9 } else { -1e9 })
            .collect(),
    );
    inputs.extend((0..20).map(|seed| noise(64, seed)));
    for window in inputs {
        for weighting in [Weighting::Rectangular, Weighting::default()] {
            let lags = correlogram_by_sum(&window, &weighting.weights(64).unwrap());
            for order in [1, 16, 63] {
                let model = Autoregression::yule_walker(&lags, SignalKind::Real, order).unwrap();
                assert!(model.reflection.iter().all(|k| k.norm() < 1.0) && model.noise_power > 0.0);
            }
        }
    }
}

#[test]
fn constant_signal_has_the_first_coefficient_of_its_biased_correlogram() {
    let lags = correlogram_by_sum(&[3.0; 64], &[1.0; 64]);
    let model = Autoregression::yule_walker(&lags, SignalKind::Real, 16).unwrap();
    assert_abs_diff_eq!(model.coefficients[0].re, -0.991, epsilon = 1e-3);
}

#[test]
fn ca_shifts_noise_free_tones_by_at_most_14_cm_s() {
    let ca = ModelPeak::new(
        &table_2(),
        SignalKind::Real,
        64,
        16,
        4096,
        Refinement::Parabola,
    )
    .unwrap();
    let statistic = Correlogram::<f64>::new(Weighting::Rectangular, 64).unwrap();
    let mut worst_m_s = 0.0_f64;
    for step in 0..24 {
        let velocity_m_s = -15.0 + 1.27 * f64::from(step);
        let found = estimate_window(
            &statistic,
            &ca,
            &tone(velocity_m_s, f64::from(step)),
            &mut Scratch::new(),
        )
        .unwrap();
        assert_eq!(found.flag, Quality::Good);
        worst_m_s = worst_m_s.max((found.velocity_m_s - velocity_m_s).abs());
    }
    assert!((0.02..0.14).contains(&worst_m_s), "{worst_m_s}");
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

fn estimators(sampling: &Sampling, kind: SignalKind) -> Vec<Box<dyn Estimator>> {
    let refinement = Refinement::Parabola;
    vec![
        Box::new(
            SpectralPeak::new(sampling, kind, &unweighted_lags(64), 1024, refinement).unwrap(),
        ),
        Box::new(ModelPeak::new(sampling, kind, 64, 16, 2048, refinement).unwrap()),
        Box::new(PulsePair::new(sampling, kind, &unweighted_lags(64)).unwrap()),
    ]
}

/// Velocities of all estimators from the mean correlogram of `windows`.
fn estimates<S: Sample>(windows: &[Vec<S>], sampling: &Sampling) -> Vec<GateVelocity> {
    let statistic = Correlogram::<S>::new(Weighting::Rectangular, 64).unwrap();
    let mut scratch = Scratch::new();
    let mut mean = vec![0.0; statistic.statistic_len()];
    let mut one = mean.clone();
    for window in windows {
        statistic.evaluate(window, &mut scratch, &mut one);
        mean.iter_mut()
            .zip(&one)
            .for_each(|(sum, value)| *sum += value / windows.len() as f64);
    }
    estimators(sampling, S::KIND)
        .iter()
        .map(|estimator| estimator.estimate(&mean, &mut scratch))
        .collect()
}

#[test]
fn every_estimator_finds_a_tone_in_moderate_noise_real_and_complex() {
    for velocity_m_s in [-12.0, -3.7, 0.0, 9.3] {
        let real: Vec<Vec<f64>> = (0..30)
            .map(|seed| {
                tone(velocity_m_s, seed as f64)
                    .iter()
                    .zip(noise(64, seed))
                    .map(|(s, n)| s + 0.1 * n)
                    .collect()
            })
            .collect();
        // the last, pulse pair, is pulled to the middle of the band by noise and sidelobes that the edges cut
        for (found, bar_m_s) in estimates(&real, &table_2()).iter().zip([0.25, 0.25, 0.5]) {
            assert!(
                (found.velocity_m_s - velocity_m_s).abs() < bar_m_s,
                "{velocity_m_s}: {found:?}"
            );
            assert_eq!(found.flag, Quality::Good);
        }
        let turn = std::f64::consts::TAU * baseband().frequency_hz(velocity_m_s) / 250e6;
        let complex: Vec<Vec<Complex<f64>>> = (0..30)
            .map(|seed| {
                noise(128, seed)
                    .chunks(2)
                    .enumerate()
                    .map(|(n, pair)| {
                        Complex::from_polar(1.0, turn * n as f64)
                            + 0.1 * Complex::new(pair[0], pair[1])
                    })
                    .collect()
            })
            .collect();
        for found in estimates(&complex, &baseband()) {
            assert!(
                (found.velocity_m_s - velocity_m_s).abs() < 0.1,
                "{velocity_m_s}: {found:?}"
            );
            assert_eq!(found.flag, Quality::Good);
        }
    }
}

#[test]
fn white_noise_does_not_bias_the_complex_pulse_pair() {
    let velocity_m_s = 12.0;
    let turn = std::f64::consts::TAU * baseband().frequency_hz(velocity_m_s) / 250e6;
    let windows: Vec<Vec<Complex<f64>>> = (0..3000)
        .map(|seed| {
            noise(128, seed)
                .chunks(2)
                .enumerate()
                .map(|(n, pair)| {
                    Complex::from_polar(1.0, turn * n as f64) + Complex::new(pair[0], pair[1])
                })
                .collect()
        })
        .collect();
    let found = &estimates(&windows, &baseband())[2];
    // noise power is twice the signal: a band-filtered first moment would read about half of the velocity
    assert!(
        (found.velocity_m_s - velocity_m_s).abs() < 0.35,
        "{found:?}"
    );
}

#[test]
fn no_estimator_gives_a_silent_number_for_empty_or_constant_signals() {
    for found in estimates(&[vec![0.0; 64]], &table_2()) {
        assert_eq!(found.flag, Quality::NoSignal);
        assert!(found.velocity_m_s.is_nan());
    }
    for found in estimates(&[vec![2.0; 64]], &table_2()) {
        assert_eq!(found.flag, Quality::NoSignal, "{found:?}");
    }
    for found in estimates(&[vec![f64::NAN; 64]], &table_2()) {
        assert_eq!(found.flag, Quality::Invalid);
    }
}

#[test]
fn impossible_orders_and_indefinite_correlograms_are_refused() {
    let kind = SignalKind::Real;
    for order in [0, 64, 100] {
        assert!(ModelPeak::new(&table_2(), kind, 64, order, 2048, Refinement::None).is_err());
    }
    assert!(PulsePair::new(&table_2(), kind, &unweighted_lags(1)).is_err());
    assert!(Autoregression::yule_walker(&[0.0; 8], kind, 4).is_err());
    // |r_1| > r_0 belongs to no signal
    let error = Autoregression::yule_walker(&[1.0, 1.5], kind, 1).unwrap_err();
    assert!(error.to_string().contains("positive definite"));
}
