//! The heterodyne signal against the literal sum, the mean power (14), and the covariance of
//! a uniform wind.

use std::f64::consts::PI;

use approx::{assert_abs_diff_eq, assert_relative_eq};
use num_complex::Complex;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_signal::literal::literal_envelope;
use wakescope_signal::receiver::PlanckConvention;
use wakescope_signal::{LineOfSight, NoiseModel, Receiver, Record, Scratch, Simulator};

use crate::setup::{
    C, STEP_M, WAVELENGTH_M, gaussian, mean_power, normal_speckle, weighted_line as line,
};

fn receiver() -> Receiver {
    crate::setup::receiver(NoiseModel::None)
}

/// Records of a pulse of 200 ns without noise that begin when its middle comes back from `first_m`.
fn simulator(first_m: f64, samples: usize) -> Simulator {
    crate::setup::simulator(gaussian(200e-9), NoiseModel::None, first_m, samples)
}

/// `K^2 beta A_R eta_s/R^2` of Table 2 with a constant efficiency.
fn table2_weight(range_m: f64) -> f64 {
    1e-7 * PI * 0.05 * 0.05 * 0.009 * (-1.4e-4 * range_m).exp() / (range_m * range_m)
}

#[test]
fn fast_sum_agrees_with_the_literal_one_for_any_layers_masks_and_lengths() {
    let mut scratch = Scratch::default();
    // Layers that divide the step, that do not, that hold several samples, and that are thicker;
    // the line covers part of the record only.
    for (samples, thickness) in [
        (700, STEP_M),
        (700, STEP_M / 3.0),
        (701, 2.0 * STEP_M),
        (701, 4.0 * STEP_M),
        (300, 0.37),
        (1500, 0.9),
    ] {
        let simulator = simulator(200.0, samples);
        let velocity = |r: f64| {
            if (330.0..350.0).contains(&r) {
                f64::NAN
            } else {
                15.0 * (0.05 * r).sin()
            }
        };
        let line = line(260.2, 1000.0, thickness, velocity, table2_weight);
        let speckle = normal_speckle(line.layers(), 3);
        let mut fast = vec![Complex::ZERO; samples];
        simulator
            .envelope_of_speckle_into(&line, &speckle, &mut scratch, &mut fast)
            .unwrap();
        let literal = literal_envelope(&simulator, &line, &speckle).unwrap();
        let largest = literal.iter().map(|s| s.norm()).fold(0.0, f64::max);
        assert!(largest > 0.0);
        for (a, b) in fast.iter().zip(&literal) {
            assert!(
                (a - b).norm() < 1e-10 * largest,
                "{samples} samples, {thickness} m"
            );
        }
    }
}

#[test]
fn mean_power_is_equation_14_with_h() {
    let simulator = simulator(400.0, 50);
    let line = line(200.0, 700.0, STEP_M, |_| 3.0, |_| 5e-17);
    let mut snr = vec![0.0; 50];
    simulator
        .snr_into(&line, &mut Scratch::default(), &mut snr)
        .unwrap();
    // eta_Q E_t/(h nu B) times the integral of the weight times |f|^2, which is weight c/2.
    let photon_j = 6.626_070_15e-34 * C / WAVELENGTH_M;
    let expected = 0.8 * 150e-6 / (photon_j * 50e6) * 5e-17 * 0.5 * C;
    for found in snr {
        assert_relative_eq!(found, expected, max_relative = 1e-6);
    }
    assert_relative_eq!(
        receiver().slowly_varying_snr(150e-6, 5e-17),
        expected,
        max_relative = 1e-12
    );
}

#[test]
fn less_than_a_millionth_of_the_energy_lies_outside_the_sum() {
    for thickness in [STEP_M, 0.41, STEP_M / 4.0, 2.3] {
        let simulator = simulator(400.0, 20);
        let power = mean_power(
            &simulator,
            &line(200.0, 700.0, thickness, |_| 0.0, |_| 1e-16),
        );
        let whole = receiver().heterodyne_gain_a2_w() * 150e-6 * 1e-16 * 0.5 * C;
        for found in power {
            assert!(
                found <= whole * (1.0 + 1e-12) && found > whole * (1.0 - 1e-6),
                "{thickness} m"
            );
        }
    }
}

#[test]
fn mean_power_does_not_depend_on_the_layer_thickness() {
    let simulator = simulator(150.0, 1200);
    let power = |thickness| {
        let weight = |r: f64| table2_weight(r) * (1.0 + 0.5 * (r / 20.0).sin());
        mean_power(&simulator, &line(60.0, 1000.0, thickness, |_| 0.0, weight))
    };
    let reference = power(STEP_M);
    for factor in [0.25, 4.0] {
        for (found, expected) in power(factor * STEP_M).iter().zip(&reference) {
            assert_relative_eq!(*found, *expected, max_relative = 1e-3);
        }
    }
}

#[test]
fn power_of_simulated_pulses_averages_to_equation_14() {
    let pulses = 4000;
    let simulator = simulator(200.0, 700);
    let line = line(
        100.0,
        760.0,
        STEP_M,
        |r| 10.0 * (0.02 * r).sin(),
        table2_weight,
    );
    let expected = mean_power(&simulator, &line);
    let mut scratch = Scratch::default();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let (mut envelope, mut current) = (vec![Complex::ZERO; 700], vec![0.0; 700]);
    let mut sums = [[0.0; 2]; 7];
    for _ in 0..pulses {
        simulator
            .envelope_into(&line, &mut rng, &mut scratch, &mut envelope)
            .unwrap();
        simulator
            .record_into(&line, &mut rng, &mut scratch, &mut current)
            .unwrap();
        for (i, sum) in sums.iter_mut().enumerate() {
            sum[0] += envelope[100 * i].norm_sqr() / f64::from(pulses);
            sum[1] += current[100 * i].powi(2) / f64::from(pulses);
        }
    }
    for (i, sum) in sums.iter().enumerate() {
        let mean = expected[100 * i];
        // |s|^2 is exponential (sd = mean); the square of a real normal number has sd = sqrt 2 mean.
        let z = (sum[0] / mean - 1.0) * f64::from(pulses).sqrt();
        let z_real = (sum[1] / mean - 1.0) * (f64::from(pulses) / 2.0).sqrt();
        assert!(
            z.abs() < 4.0 && z_real.abs() < 4.0,
            "sample {}: {z} {z_real}",
            100 * i
        );
    }
}

#[test]
fn covariance_in_a_uniform_wind_is_that_of_the_pulse_with_the_doppler_phase() {
    let (pulses, velocity) = (6000, 7.3);
    let simulator = simulator(400.0, 65);
    let line = line(300.0, 520.0, STEP_M / 2.0, |_| velocity, |_| 1e-16);
    let power = mean_power(&simulator, &line)[0];
    let mut scratch = Scratch::default();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut envelope = vec![Complex::ZERO; 65];
    let lags = [1, 5, 16, 40, 64];
    let mut sums = [Complex::<f64>::ZERO; 5];
    for _ in 0..pulses {
        simulator
            .envelope_into(&line, &mut rng, &mut scratch, &mut envelope)
            .unwrap();
        for (sum, lag) in sums.iter_mut().zip(lags) {
            *sum += envelope[lag] * envelope[0].conj() / (power * f64::from(pulses));
        }
    }
    for (found, lag) in sums.iter().zip(lags) {
        let tau = lag as f64 / 250e6;
        let coherence = (-(tau / gaussian(200e-9).sigma_s()).powi(2) / 4.0).exp();
        let expected = Complex::from_polar(coherence, -4.0 * PI * velocity * tau / WAVELENGTH_M);
        // Each part of the product of two circular normal numbers has a variance of at most (1 +
        // coherence^2)/2.
        let error = ((1.0 + coherence * coherence) / 2.0 / f64::from(pulses)).sqrt();
        let (z_re, z_im) = (
            (found.re - expected.re) / error,
            (found.im - expected.im) / error,
        );
        assert!(
            z_re.abs() < 4.0 && z_im.abs() < 4.0,
            "lag {lag}: {z_re} {z_im}"
        );
    }
}

#[test]
fn a_target_keeps_its_amplitude_for_the_whole_pulse_and_gets_a_new_one_with_the_next() {
    // One layer: the record is the pulse itself, with one random amplitude and the frequency
    // f_c - 2 v/lambda.
    let simulator = simulator(380.0, 80);
    let mut scratch = Scratch::default();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    let (mut envelope, mut amplitudes) = (vec![Complex::ZERO; 80], Vec::new());
    for _ in 0..2 {
        simulator
            .envelope_into(&target(), &mut rng, &mut scratch, &mut envelope)
            .unwrap();
        let factor = |k: usize| {
            let time_s = simulator.time_s(k);
            let f = gaussian(200e-9).envelope_per_sqrt_s(time_s - 800.0 / C);
            envelope[k] / (f * Complex::cis(-4.0 * PI * 6.0 * time_s / WAVELENGTH_M))
        };
        let first = factor(0);
        for k in 0..80 {
            assert!((factor(k) - first).norm() < 1e-10 * first.norm());
        }
        amplitudes.push(first);
    }
    assert!((amplitudes[0] - amplitudes[1]).norm() > 0.1 * amplitudes[0].norm());
}

/// A hard target at 400 m that moves away at 6 m/s.
fn target() -> LineOfSight {
    LineOfSight {
        first_range_m: 400.0,
        layer_thickness_m: 0.6,
        radial_velocity_m_s: vec![6.0],
        weight_per_m: vec![1e-14],
    }
}

#[test]
fn a_target_that_moves_away_lowers_the_frequency_of_the_current() {
    let mut current = vec![0.0; 80];
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    simulator(380.0, 80)
        .record_into(&target(), &mut rng, &mut Scratch::default(), &mut current)
        .unwrap();
    let power_at = |frequency_hz: f64| {
        let term =
            |(k, i): (usize, &f64)| i * Complex::cis(-2.0 * PI * frequency_hz * k as f64 / 250e6);
        current
            .iter()
            .enumerate()
            .map(term)
            .sum::<Complex<f64>>()
            .norm_sqr()
    };
    let shift_hz = 2.0 * 6.0 / WAVELENGTH_M;
    let peak = power_at(80e6 - shift_hz);
    assert!(peak > 100.0 * power_at(80e6 + shift_hz));
    assert!(
        peak > 1.05 * power_at(80e6 - 0.8 * shift_hz)
            && peak > 1.05 * power_at(80e6 - 1.2 * shift_hz)
    );
}

#[test]
fn current_is_sqrt_2_times_the_real_part_of_the_envelope_on_its_carrier() {
    let simulator = simulator(400.0, 300);
    let line = line(300.0, 700.0, STEP_M, |r| 0.1 * (r - 450.0), table2_weight);
    let mut scratch = Scratch::default();
    let (mut envelope, mut current) = (vec![Complex::ZERO; 300], vec![0.0; 300]);
    let stream = || Xoshiro256PlusPlus::seed_from_u64(8);
    simulator
        .envelope_into(&line, &mut stream(), &mut scratch, &mut envelope)
        .unwrap();
    simulator
        .record_into(&line, &mut stream(), &mut scratch, &mut current)
        .unwrap();
    let scale = envelope.iter().map(|s| s.norm()).fold(0.0, f64::max);
    for (k, (s, i)) in envelope.iter().zip(&current).enumerate() {
        let carrier = Complex::cis(2.0 * PI * 80e6 * simulator.time_s(k));
        assert_abs_diff_eq!(
            *i,
            2.0_f64.sqrt() * (s * carrier).re,
            epsilon = 1e-10 * scale
        );
    }
}

#[test]
fn printed_hbar_multiplies_the_power_of_the_signal_by_two_pi() {
    let run = |planck| {
        let record = Record {
            time_of_first_sample_s: 800.0 / C,
            samples: 100,
        };
        let simulator = Simulator::new(
            gaussian(200e-9),
            Receiver {
                planck,
                ..receiver()
            },
            record,
        )
        .unwrap();
        let line = line(300.0, 600.0, STEP_M, |_| 2.0, table2_weight);
        let mut current = vec![0.0; 100];
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
        simulator
            .record_into(&line, &mut rng, &mut Scratch::default(), &mut current)
            .unwrap();
        current.iter().map(|i| i * i).sum::<f64>()
    };
    let ratio = run(PlanckConvention::Hbar) / run(PlanckConvention::H);
    assert_relative_eq!(ratio, 2.0 * PI, max_relative = 1e-12);
}
