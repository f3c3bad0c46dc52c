//! Maximum likelihood against the bound: velocity alone in real windows, velocity and gradient together.

use crate::draw::{Draw, Wind};
use crate::fixtures::{baseband, sigma_s, table_2};
use approx::assert_relative_eq;
use num_complex::Complex;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::{Error, bound::*, estimators::*, window::*};

fn model(sampling: &Sampling, noise: Noise) -> GradientModel {
    GradientModel::new(sampling, 64, sigma_s(200e-9), noise).unwrap()
}

/// Errors of velocity and gradient over trials of `windows` windows each, the velocity anywhere within 14 m/s.
fn errors<S: Draw>(
    plan: &GradientLikelihood<S>,
    gradient_per_s: f64,
    windows: usize,
    trials: usize,
    draw: impl Fn(f64, &mut Xoshiro256PlusPlus) -> Vec<S>,
) -> Vec<(f64, f64)> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
    let (mut scratch, mut one) = (Scratch::new(), vec![0.0; plan.statistic.statistic_len()]);
    (0..trials)
        .map(|_| {
            let velocity_m_s = rng.random_range(-14.0..14.0);
            let mut mean = vec![0.0; one.len()];
            for _ in 0..windows {
                plan.statistic
                    .evaluate(&draw(velocity_m_s, &mut rng), &mut scratch, &mut one);
                mean.iter_mut()
                    .zip(&one)
                    .for_each(|(sum, value)| *sum += value / windows as f64);
            }
            let found = plan.estimator.velocity_and_gradient(&mean, &mut scratch);
            (
                found.velocity.velocity_m_s - velocity_m_s,
                found.gradient_per_s - gradient_per_s,
            )
        })
        .collect()
}

/// Fraction of bad estimates and standard deviation of the good ones: Gaussian errors in a flat floor over the band
/// (Frehlich and Yadlowsky 1994), by expectation maximisation.
fn mixture(errors: &[(f64, f64)]) -> (f64, f64) {
    let mut sizes: Vec<f64> = errors.iter().map(|(error, _)| error.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let (mut bad, mut std_m_s) = (0.05, sizes[sizes.len() / 2] / 0.674_5);
    for _ in 0..200 {
        let (mut good, mut square) = (0.0, 0.0);
        for (error, _) in errors {
            let bell =
                (-0.5 * (error / std_m_s).powi(2)).exp() / (std_m_s * std::f64::consts::TAU.sqrt());
            let share = (1.0 - bad) * bell / ((1.0 - bad) * bell + bad / 38.75);
            good += share;
            square += share * error * error;
        }
        std_m_s = (square / good).sqrt();
        bad = (1.0 - good / errors.len() as f64).max(1e-9);
    }
    (bad, std_m_s)
}

fn real_ratio(snr_db: f64, windows: usize, trials: usize, noise: Noise) -> (f64, f64) {
    let snr = 10.0_f64.powf(0.1 * snr_db);
    let plan =
        GradientLikelihood::<f64>::new(&model(&table_2(), noise), snr, &[0.0], 1024).unwrap();
    let wind = Wind::new(&table_2(), 0.0, snr, noise);
    let (bad, std_m_s) = mixture(&errors(&plan, 0.0, windows, trials, |v, rng| {
        wind.real(v, rng)
    }));
    // the yardstick is the bound in white noise, whatever the noise
    let bound = WindowModel::gaussian_pulse(&table_2(), 64, sigma_s(200e-9), Noise::White).unwrap();
    (
        bad,
        std_m_s
            / bound
                .bound_m_s(0.0, snr, SignalKind::Real, windows as f64)
                .unwrap(),
    )
}

#[test]
fn real_windows_reach_the_bound_from_minus_5_to_20_db_in_white_and_band_noise() {
    let band = Noise::Band { floor: 0.0 };
    // standard error of the ratio: 1 / sqrt(2 trials) = 0.03
    for (snr_db, windows, noise, bar) in [
        (-5.0, 20, Noise::White, 1.15),
        (0.0, 20, band, 1.05),
        (10.0, 20, band, 1.05),
        (15.0, 60, Noise::White, 1.05),
        (20.0, 20, Noise::White, 1.15),
        (20.0, 60, band, 1.15),
    ] {
        let (bad, ratio) = real_ratio(snr_db, windows, 500, noise);
        assert!(
            ratio < bar + 0.06 && ratio > 0.9,
            "{snr_db} dB, {windows} windows, {noise:?}: {ratio}"
        );
        assert!(bad < 2e-3, "{snr_db} dB: {bad}");
    }
}

#[test]
fn few_estimates_are_bad_at_minus_10_db() {
    for (windows, trials, bar) in [(20, 800, 0.1), (60, 300, 0.005)] {
        for noise in [Noise::White, Noise::Band { floor: 0.0 }] {
            let (bad, ratio) = real_ratio(-10.0, windows, trials, noise);
            let error = (bar * (1.0 - bar) / trials as f64).sqrt();
            assert!(bad < bar + error, "{windows} windows, {noise:?}: {bad}");
            assert!(ratio < 1.15, "{windows} windows, {noise:?}: {ratio}");
        }
    }
}

fn rms(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count() as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}

#[test]
fn velocity_and_gradient_together_reach_their_bound() {
    let (snr, windows, trials) = (10.0, 20, 120);
    let gradients: Vec<f64> = (-6..=0).map(|k| 0.04 * f64::from(k)).collect();
    let complex = model(&baseband(), Noise::White);
    let real = model(&table_2(), Noise::White);
    let complex_plan =
        GradientLikelihood::<Complex<f64>>::new(&complex, snr, &gradients, 1024).unwrap();
    let real_plan = GradientLikelihood::<f64>::new(&real, snr, &gradients, 1024).unwrap();
    for gradient_per_s in [-0.2, -0.07] {
        let bounds =
            [(&complex, SignalKind::Complex), (&real, SignalKind::Real)].map(|(model, kind)| {
                model
                    .bound(0.0, gradient_per_s, snr, kind, windows as f64)
                    .unwrap()
            });
        let complex_wind = Wind::new(&baseband(), gradient_per_s, snr, Noise::White);
        let real_wind = Wind::new(&table_2(), gradient_per_s, snr, Noise::White);
        let found = [
            errors(&complex_plan, gradient_per_s, windows, trials, |v, rng| {
                complex_wind.complex(v, rng)
            }),
            errors(&real_plan, gradient_per_s, windows, trials, |v, rng| {
                real_wind.real(v, rng)
            }),
        ];
        for (errors, bound) in found.iter().zip(&bounds) {
            // standard error of a ratio: 1 / sqrt(2 trials) = 0.065
            let ratio = rms(errors.iter().map(|error| error.0)) / bound.velocity_m_s;
            assert!(
                ratio < 1.2 && ratio > 0.8,
                "{gradient_per_s}: velocity {ratio}"
            );
            let ratio = rms(errors.iter().map(|error| error.1)) / bound.gradient_per_s;
            assert!(ratio < 1.6, "{gradient_per_s}: gradient {ratio}");
        }
    }
}

/// Mean error of the gradient and its standard error at 10 dB, with the list of a scene: seven from -0.6 to 0.6 1/s.
fn gradient_bias<S: Draw>(
    model: &GradientModel,
    gradient_per_s: f64,
    draw: impl Fn(f64, &mut Xoshiro256PlusPlus) -> Vec<S>,
) -> (f64, f64) {
    let gradients: Vec<f64> = (-3..=3).map(|k| 0.2 * f64::from(k)).collect();
    let plan = GradientLikelihood::<S>::new(model, 10.0, &gradients, 1024).unwrap();
    let errors: Vec<f64> = errors(&plan, gradient_per_s, 40, 40, draw)
        .iter()
        .map(|error| error.1)
        .collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    (
        mean,
        rms(errors.iter().map(|error| error - mean)) / (errors.len() as f64).sqrt(),
    )
}

#[test]
fn gradients_between_those_of_the_list_come_out_without_a_bias() {
    for gradient_per_s in [0.05, 0.1, -0.15, 0.3] {
        let complex_wind = Wind::new(&baseband(), gradient_per_s, 10.0, Noise::White);
        let real_wind = Wind::new(&table_2(), gradient_per_s, 10.0, Noise::White);
        let found = [
            gradient_bias(
                &model(&baseband(), Noise::White),
                gradient_per_s,
                |v, rng| complex_wind.complex(v, rng),
            ),
            gradient_bias(
                &model(&table_2(), Noise::White),
                gradient_per_s,
                |v, rng| real_wind.real(v, rng),
            ),
        ];
        for (bias_per_s, error_per_s) in found {
            assert!(
                bias_per_s.abs() < 0.002 + 3.0 * error_per_s,
                "{gradient_per_s}: {bias_per_s} {error_per_s}"
            );
            assert!(error_per_s < 2e-3, "{gradient_per_s}: {error_per_s}");
        }
    }
}

#[test]
fn periodogram_is_several_times_the_bound_in_a_gradient() {
    let wind = Wind::new(&baseband(), 0.2, 10.0, Noise::White);
    let plan =
        PeriodogramPlan::<Complex<f64>>::new(&baseband(), 64, &PeriodogramOptions::default())
            .unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
    let (mut scratch, mut one) = (Scratch::new(), vec![0.0; 128]);
    let errors: Vec<f64> = (0..200)
        .map(|_| {
            let mut mean = vec![0.0; 128];
            for _ in 0..20 {
                plan.statistic
                    .evaluate(&wind.complex(2.0, &mut rng), &mut scratch, &mut one);
                mean.iter_mut()
                    .zip(&one)
                    .for_each(|(sum, value)| *sum += value / 20.0);
            }
            plan.estimator.estimate(&mean, &mut scratch).velocity_m_s - 2.0
        })
        .collect();
    let bound = model(&baseband(), Noise::White)
        .bound(0.0, 0.2, 10.0, SignalKind::Complex, 20.0)
        .unwrap();
    assert!(rms(errors.into_iter()) > 3.5 * bound.velocity_m_s);
}

#[test]
fn covariance_is_the_sum_over_layers() {
    let (velocity_m_s, gradient_per_s) = (3.0, 0.4);
    let sigma_s = sigma_s(200e-9);
    let found = &model(&baseband(), Noise::White)
        .covariance(velocity_m_s, gradient_per_s, 1e12, SignalKind::Complex)
        .unwrap()[0];
    let layer_m = 0.1;
    for (n, m) in [(0, 0), (10, 3), (40, 60), (63, 0)] {
        let times_s = [n, m].map(|k| (f64::from(k) - 32.0) / 250e6);
        let sum: Complex<f64> = (-2000..2000)
            .map(|l| {
                let place_m = layer_m * f64::from(l);
                let envelope = times_s.map(|t_s| {
                    let x = (t_s - 2.0 * place_m / SPEED_OF_LIGHT_M_S) / sigma_s;
                    (-0.5 * x * x).exp() / (std::f64::consts::PI.sqrt() * sigma_s).sqrt()
                });
                let speed_m_s = velocity_m_s + gradient_per_s * place_m;
                let phase =
                    -4.0 * std::f64::consts::PI * speed_m_s * (times_s[0] - times_s[1]) / 1.55e-6;
                Complex::from_polar(
                    envelope[0] * envelope[1] * 2.0 / SPEED_OF_LIGHT_M_S * layer_m,
                    phase,
                )
            })
            .sum();
        assert!(
            (found[[n as usize, m as usize]] - sum).norm() < 1e-8,
            "{n} {m}"
        );
    }
}

#[test]
fn derivatives_are_difference_quotients_and_without_gradient_the_bound_is_the_known_one() {
    for (sampling, kind) in [
        (baseband(), SignalKind::Complex),
        (table_2(), SignalKind::Real),
    ] {
        let model = model(&sampling, Noise::White);
        let at = |v_m_s: f64, g: f64| model.covariance(v_m_s, g, 2.0, kind).unwrap();
        let [_, by_velocity, by_gradient] = at(3.0, 0.15);
        let quotients = [
            (&at(3.001, 0.15)[0] - &at(2.999, 0.15)[0]).mapv(|value| value / 0.002),
            (&at(3.0, 0.1501)[0] - &at(3.0, 0.1499)[0]).mapv(|value| value / 0.0002),
        ];
        for (a, b) in by_velocity
            .iter()
            .chain(&by_gradient)
            .zip(quotients.iter().flatten())
        {
            assert!((a - b).norm() < 1e-3 * (1.0 + a.norm()));
        }
        let window =
            WindowModel::gaussian_pulse(&sampling, 64, sigma_s(200e-9), Noise::White).unwrap();
        let known_m_s = window.bound_m_s(1.0, 2.0, kind, 7.0).unwrap();
        let bound = model.bound(1.0, 0.0, 2.0, kind, 7.0).unwrap();
        assert_relative_eq!(bound.velocity_alone_m_s, known_m_s, max_relative = 1e-9);
        assert!(bound.velocity_m_s >= bound.velocity_alone_m_s && bound.gradient_per_s > 0.0);
    }
}

#[test]
fn impossible_plans_are_refused() {
    let model = model(&table_2(), Noise::White);
    let plan = |snr: f64, gradients: &[f64]| {
        GradientLikelihood::<f64>::new(&model, snr, gradients, 1024).map(|_| ())
    };
    assert!(matches!(plan(1.0, &[]), Err(Error::Empty { .. })));
    assert!(
        plan(0.0, &[0.0]).is_err()
            && plan(1.0, &[0.1, 0.1]).is_err()
            && plan(1.0, &[f64::NAN]).is_err()
    );
    assert!(GradientModel::new(&table_2(), 0, 1e-7, Noise::White).is_err());
    assert!(GradientModel::new(&table_2(), 64, -1.0, Noise::White).is_err());
    assert!(GradientModel::new(&table_2(), 64, 1e-7, Noise::Band { floor: 1.5 }).is_err());
    let baseband = GradientModel::new(&baseband(), 16, 1e-7, Noise::White).unwrap();
    assert!(GradientLikelihood::<f64>::new(&baseband, 1.0, &[0.0], 256).is_err());
}
