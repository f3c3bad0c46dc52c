//! Pulses of any shape through the simulator and the range filter.

use std::f64::consts::PI;

use approx::assert_relative_eq;
use num_complex::Complex;
use wakescope_signal::literal::literal_envelope;
use wakescope_signal::{NoiseModel, Pulse, RangeFilter, Scratch};

use crate::setup::{
    C, STEP_M, chirped, gaussian, limits, line, mean_power, normal_speckle, receiver, rectangle,
    simulator, skewed,
};

/// A Gaussian with a chirp; a real shape with a tail; a complex one; a box with edges of 4 ns; one
/// that begins at time 0.
fn shapes() -> Vec<Pulse> {
    let times: Vec<f64> = (0..400).map(|i| f64::from(i) * 2e-9).collect();
    let tail: Vec<f64> = times
        .iter()
        .map(|t| (t / 5e-8) * (-t / 8e-8).exp())
        .collect();
    let tail = Pulse::from_power(&times, &tail, 1e-4).unwrap();
    vec![
        chirped(200e-9, 1.5e14),
        tail.clone().centred(),
        skewed(),
        rectangle(200e-9, 4e-9),
        tail,
    ]
}

#[test]
fn fast_sum_agrees_with_the_literal_one_for_any_pulse() {
    let mut scratch = Scratch::default();
    for pulse in shapes() {
        let advised_m = pulse.layer_thickness_m(limits(1.0)).unwrap();
        // Layers that divide the step and layers that do not.
        for thickness_m in [advised_m, 0.83 * advised_m] {
            let simulator = simulator(pulse.clone(), NoiseModel::None, 300.0, 200);
            let line = line(250.3, 395.0, thickness_m, |r| 15.0 * (0.05 * r).sin());
            let speckle = normal_speckle(line.layers(), 3);
            let mut fast = vec![Complex::ZERO; 200];
            simulator
                .envelope_of_speckle_into(&line, &speckle, &mut scratch, &mut fast)
                .unwrap();
            let literal = literal_envelope(&simulator, &line, &speckle).unwrap();
            let largest = literal.iter().map(|s| s.norm()).fold(0.0, f64::max);
            for (a, b) in fast.iter().zip(&literal) {
                assert!((a - b).norm() < 1e-10 * largest);
            }
        }
    }
}

#[test]
fn mean_power_of_any_pulse_is_equation_14_whatever_the_layers() {
    for pulse in shapes() {
        let advised_m = pulse.layer_thickness_m(limits(0.0)).unwrap();
        let energy_j = pulse.energy_j();
        for thickness_m in [advised_m, advised_m / 4.0] {
            let simulator = simulator(pulse.clone(), NoiseModel::None, 400.0, 40);
            let mut snr = vec![0.0; 40];
            let line = line(150.0, 650.0, thickness_m, |_| 3.0);
            simulator
                .snr_into(&line, &mut Scratch::default(), &mut snr)
                .unwrap();
            let expected = receiver(NoiseModel::None).slowly_varying_snr(energy_j, 5e-17);
            for found in snr {
                assert_relative_eq!(found, expected, max_relative = 1e-3);
            }
        }
    }
}

#[test]
fn less_than_a_millionth_of_the_energy_of_any_pulse_lies_outside_the_sum() {
    for pulse in shapes() {
        let (first_s, last_s) = pulse.support_s();
        let step_s = 2e-11;
        let steps = ((last_s - first_s) / step_s) as i32;
        let inside: f64 = (0..=steps)
            .map(|i| step_s * pulse.intensity_per_s(first_s + (f64::from(i) + 0.5) * step_s))
            .sum();
        assert!((inside - 1.0).abs() < 1e-6, "{inside}");
    }
}

#[test]
fn a_sampled_gaussian_gives_the_records_of_the_gaussian() {
    let times: Vec<f64> = (-300..=300).map(|i| f64::from(i) * 2.5e-9).collect();
    let power: Vec<f64> = times
        .iter()
        .map(|t| 7.0 * gaussian(200e-9).intensity_per_s(*t))
        .collect();
    let sampled = Pulse::from_power(&times, &power, 150e-6).unwrap();
    let line = line(250.0, 600.0, STEP_M, |r| 0.1 * (r - 400.0));
    let speckle = normal_speckle(line.layers(), 8);
    let envelope = |pulse: Pulse| {
        let mut out = vec![Complex::ZERO; 300];
        let simulator = simulator(pulse, NoiseModel::None, 350.0, 300);
        simulator
            .envelope_of_speckle_into(&line, &speckle, &mut Scratch::default(), &mut out)
            .unwrap();
        out
    };
    let (a, b) = (envelope(sampled), envelope(gaussian(200e-9).into()));
    let largest = b.iter().map(|s| s.norm()).fold(0.0, f64::max);
    // The amplitude of a Gaussian is cut at 1e-3 of its peak.
    assert!(
        a.iter()
            .zip(&b)
            .all(|(a, b)| (a - b).norm() < 2e-3 * largest)
    );
}

#[test]
fn v_pulse_of_a_pulse_with_a_tail_looks_at_the_air_that_the_tail_lights() {
    // At time t the light sent at time u comes from c (t - u)/2: the tail, sent late,
    // sees nearer air.
    let tail = shapes()[4].clone();
    let filter = RangeFilter::pulse(&tail, 0.2).unwrap();
    let shift_m = 0.5 * C * tail.mean_time_s();
    assert!(shift_m > 15.0);
    assert_relative_eq!(
        filter.at_range(500.0, |r| 0.1 * (r - 450.0)),
        0.1 * (50.0 - shift_m),
        max_relative = 1e-4
    );
    assert_relative_eq!(filter.at_range(500.0, |_| 7.0), 7.0, max_relative = 1e-13);
    let spread = filter.at_range(500.0, |r| (r - (500.0 - shift_m)).powi(2));
    assert_relative_eq!(spread, 0.5 * tail.sigma_m().powi(2), max_relative = 1e-3);
}

#[test]
fn v_gate_of_any_pulse_is_the_first_moment_of_the_power_in_the_window() {
    // Against the covariance of the simulated window: the layers' powers in the window
    // are the weights.
    let window: Vec<f64> = (0..48)
        .map(|n| 0.3 + (0.065 * f64::from(n)).sin())
        .collect();
    for pulse in shapes() {
        let thickness_m = pulse.layer_thickness_m(limits(0.0)).unwrap();
        let filter = RangeFilter::gate(&pulse, &window, 250e6, thickness_m).unwrap();
        let wind = |r: f64| 8.0 * (0.03 * r).sin();
        let simulator = simulator(pulse, NoiseModel::None, 400.0 - 24.0 * STEP_M, 48);
        let air = line(200.0, 640.0, thickness_m, wind);
        let power = |only: usize| {
            let mut one = air.clone();
            one.weight_per_m
                .iter_mut()
                .enumerate()
                .filter(|(l, _)| *l != only)
                .for_each(|(_, w)| *w = 0.0);
            mean_power(&simulator, &one)
                .iter()
                .zip(&window)
                .map(|(p, h)| p * h * h)
                .sum::<f64>()
        };
        let powers: Vec<f64> = (0..air.layers()).map(power).collect();
        let moment: f64 = powers
            .iter()
            .zip(&air.radial_velocity_m_s)
            .map(|(p, v)| p * v)
            .sum();
        let expected = moment / powers.iter().sum::<f64>();
        assert_relative_eq!(filter.at_range(400.0, wind), expected, epsilon = 2e-3);
    }
}

#[test]
fn a_pulse_above_its_nominal_frequency_raises_that_of_the_return() {
    let times: Vec<f64> = (-400..=400).map(|i| f64::from(i) * 2e-9).collect();
    let turning =
        |t: &f64| Complex::from_polar(gaussian(200e-9).envelope_per_sqrt_s(*t), 2.0 * PI * 5e6 * t);
    let amplitude: Vec<_> = times.iter().map(turning).collect();
    let pulse = Pulse::from_envelope(&times, &amplitude, 1e-4).unwrap();
    assert_relative_eq!(pulse.mean_frequency_hz(), 5e6, max_relative = 1e-6);
    let simulator = simulator(pulse, NoiseModel::None, 400.0, 2);
    let covariance = simulator
        .covariance_a2(&line(300.0, 500.0, STEP_M, |_| 2.0))
        .unwrap();
    let frequency_hz = covariance[(1, 0)].arg() * 250e6 / (2.0 * PI);
    assert_relative_eq!(frequency_hz, 5e6 - 2.0 * 2.0 / 1.55e-6, max_relative = 1e-5);
}
