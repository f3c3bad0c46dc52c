//! Covariance of the samples of a gate: closed forms, fine quadrature, and windows of many pulses.

use std::f64::consts::PI;

use ndarray::Array2;
use num_complex::Complex;
use wakescope_signal::scan::pulse_generator;
use wakescope_signal::{Error, NoiseModel, Pulse, Scan, Scratch, Shot, Simulator};

use crate::setup::{
    C, STEP_M, WAVELENGTH_M, chirped, core, gaussian, limits, line, receiver, simulator, skewed,
};

/// Samples of a window.
const WINDOW: usize = 64;
const FIRST_M: f64 = 400.0;

fn window(pulse: impl Into<Pulse>) -> Simulator {
    simulator(pulse, NoiseModel::None, FIRST_M, WINDOW)
}

/// Power of (14) in the noise-free envelope, for the weight of `setup::line`.
fn power_a2(pulse: &Pulse) -> f64 {
    receiver(NoiseModel::None).heterodyne_gain_a2_w() * pulse.energy_j() * 5e-17 * 0.5 * C
}

/// Largest difference of two matrices, in parts of `scale`.
fn largest_difference(a: &Array2<Complex<f64>>, b: &Array2<Complex<f64>>, scale: f64) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).norm() / scale)
        .fold(0.0, f64::max)
}

#[test]
fn a_chirped_pulse_in_a_linear_gradient_has_the_closed_form() {
    // (pi sigma)^2 (chirp + c g/lambda)^2 tau^2: chirp and gradient add up or cancel; a wrong sign
    // of either shows.
    let sigma_s = gaussian(200e-9).sigma_s();
    for (chirp_hz_s, gradient_per_s) in [
        (0.0, 0.0),
        (0.0, 0.5),
        (1e14, 0.0),
        (1e14, 0.5),
        (-9.7e13, 0.5),
    ] {
        let pulse = if chirp_hz_s == 0.0 {
            Pulse::from(gaussian(200e-9))
        } else {
            chirped(200e-9, chirp_hz_s)
        };
        let thickness_m = pulse.layer_thickness_m(limits(0.5)).unwrap();
        let velocity = |r: f64| 3.0 + gradient_per_s * (r - FIRST_M);
        let simulator = window(pulse.clone());
        let found = simulator
            .covariance_a2(&line(250.0, 600.0, thickness_m, velocity))
            .unwrap();
        let expected = Array2::from_shape_fn((WINDOW, WINDOW), |(m, n)| {
            let (tm, tn) = (simulator.time_s(m), simulator.time_s(n));
            let tau = tm - tn;
            let rate = PI * sigma_s * (chirp_hz_s + C * gradient_per_s / WAVELENGTH_M);
            let modulus = (-(tau / sigma_s).powi(2) / 4.0 - (rate * tau).powi(2)).exp();
            Complex::from_polar(
                modulus,
                -4.0 * PI * velocity(0.25 * C * (tm + tn)) * tau / WAVELENGTH_M,
            )
        });
        // The amplitude is cut where it is 1e-3 of its peak.
        let error = largest_difference(&(found / Complex::from(power_a2(&pulse))), &expected, 1.0);
        assert!(
            error < 1e-4,
            "chirp {chirp_hz_s}, gradient {gradient_per_s}: {error}"
        );
    }
}

#[test]
fn layers_in_a_gradient_miss_the_closed_form_fraction_of_the_power() {
    // Layers D apart repeat the phase of a gradient g at the lag lambda/(2 g D), where the pulse still overlaps itself.
    let gradient_per_s = 1.0;
    let pulse = gaussian(200e-9);
    let sigma_s = pulse.sigma_s();
    let simulator = simulator(pulse, NoiseModel::None, FIRST_M, 256);
    let velocity = |r: f64| 3.0 + gradient_per_s * (r - FIRST_M);
    let covariance = |thickness_m: f64| {
        let air = line(250.0, 800.0, thickness_m, velocity);
        simulator.covariance_a2(&air).unwrap()
    };
    let exact = covariance(0.1);
    for times_thinner in [1.0, 1.5, 2.0] {
        let thickness_m = WAVELENGTH_M / (4.0 * sigma_s * gradient_per_s * times_thinner);
        let found = largest_difference(
            &covariance(thickness_m),
            &exact,
            power_a2(&Pulse::from(pulse)),
        );
        let expected = (-times_thinner * times_thinner).exp();
        assert!(
            (found / expected - 1.0).abs() < 0.05,
            "{thickness_m} m: {found} for {expected}"
        );
    }
}

#[test]
fn expected_covariance_is_that_of_the_simulators_own_responses() {
    for pulse in [gaussian(200e-9).into(), chirped(200e-9, 1e14), skewed()] {
        let simulator = window(pulse.clone());
        let air = line(300.0, 560.0, STEP_M, |r| {
            if (430.0..432.0).contains(&r) {
                f64::NAN
            } else {
                core(r)
            }
        });
        let mut sum = Array2::zeros((WINDOW, WINDOW));
        let mut response = vec![Complex::ZERO; WINDOW];
        for layer in 0..air.layers() {
            let mut speckle = vec![Complex::ZERO; air.layers()];
            speckle[layer] = Complex::ONE;
            let scratch = &mut Scratch::default();
            simulator
                .envelope_of_speckle_into(&air, &speckle, scratch, &mut response)
                .unwrap();
            for (m, a) in response.iter().enumerate() {
                response
                    .iter()
                    .enumerate()
                    .for_each(|(n, b)| sum[(m, n)] += a * b.conj());
            }
        }
        let found = simulator.covariance_a2(&air).unwrap();
        assert!(largest_difference(&found, &sum, power_a2(&pulse)) < 1e-10);
    }
}

#[test]
fn layers_of_the_rule_resolve_a_vortex_core_and_layers_of_a_sample_do_not() {
    for width_s in [200e-9, 400e-9] {
        let pulse = gaussian(width_s);
        let power = power_a2(&pulse.into());
        let covariance = |thickness_m| {
            window(pulse)
                .covariance_a2(&line(200.0, 700.0, thickness_m, core))
                .unwrap()
        };
        let rule_m = Pulse::from(pulse)
            .layer_thickness_m(limits(0.04 * 500.0 / 2.35_f64.powi(2)))
            .unwrap();
        let fine = covariance(rule_m / 6.0);
        let error = |thickness_m| largest_difference(&covariance(thickness_m), &fine, power);
        let errors = [error(rule_m), error(rule_m / 2.0), error(2.0 * STEP_M)];
        assert!(
            errors[0] < 1e-5 && errors[1] < 1e-5 && errors[2] > 1e-3,
            "{errors:?}"
        );
    }
}

/// Sample covariance of the windows of `pulses` pulses.
fn sampled(
    simulator: &Simulator,
    shot: Shot<'_>,
    pulses: usize,
    seed: u64,
) -> Array2<Complex<f64>> {
    let scan = Scan {
        simulator,
        lines: 1,
        pulses_per_line: pulses,
        shot: |_| shot,
        generator: |key| pulse_generator(seed, key),
        digitiser: None,
    };
    let mut sum = Array2::<Complex<f64>>::zeros((WINDOW, WINDOW));
    scan.for_each::<Complex<f64>, Error>(|_, window| {
        for (a, mut row) in window.iter().zip(sum.rows_mut()) {
            row.iter_mut()
                .zip(window)
                .for_each(|(to, b)| *to += a * b.conj());
        }
        Ok(())
    })
    .unwrap();
    sum / Complex::from(pulses as f64)
}

/// Frobenius norm of the error of a sample covariance, in parts of that of the covariance, and in
/// parts of its expectation `trace/(sqrt(pulses) norm)` for circular normal windows.
fn frobenius(
    found: &Array2<Complex<f64>>,
    expected: &Array2<Complex<f64>>,
    pulses: usize,
) -> (f64, f64) {
    let norm = |m: &Array2<Complex<f64>>| m.iter().map(|c| c.norm_sqr()).sum::<f64>().sqrt();
    let error = norm(&(found - expected)) / norm(expected);
    let trace: f64 = expected.diag().iter().map(|c| c.re).sum();
    (
        error,
        error * norm(expected) * (pulses as f64).sqrt() / trace,
    )
}

type Profile = (&'static str, fn(f64) -> f64);

/// Uniform wind, linear gradient, vortex core.
const PROFILES: [Profile; 3] = [
    ("uniform", |_| 7.3),
    ("gradient", |r| 3.0 + 0.2 * (r - 420.0)),
    ("core", core),
];

fn check_windows(
    pulses: usize,
    mut check: impl FnMut(&str, &Array2<Complex<f64>>, &Array2<Complex<f64>>),
) {
    let simulator = window(gaussian(200e-9));
    for (seed, (name, velocity)) in (1..).zip(PROFILES) {
        // Expectation from layers of their own, thinner and elsewhere than those of the pulses.
        let fine = line(200.05, 700.0, STEP_M / 7.0, velocity);
        let expected = simulator.covariance_a2(&fine).unwrap();
        let air = line(300.0, 560.0, STEP_M / 3.0, velocity);
        check(
            name,
            &sampled(&simulator, (&air).into(), pulses, seed),
            &expected,
        );
    }
}

#[test]
fn windows_of_many_pulses_have_the_covariance_of_the_gate() {
    let pulses = 3000;
    check_windows(pulses, |name, found, expected| {
        let (error, in_expectations) = frobenius(found, expected, pulses);
        assert!(
            in_expectations < 3.0,
            "{name}: {error} of the norm, {in_expectations} times the expectation"
        );
        for m in [0, 20, 63] {
            for n in 0..WINDOW {
                let (c, power) = (expected[(m, n)], expected[(m, m)].re * expected[(n, n)].re);
                // Variances of the two parts of a product of circular normal numbers.
                let turned = (c * c).re;
                let sd_re = ((power + turned) / (2.0 * pulses as f64)).sqrt();
                let sd_im = ((power - turned) / (2.0 * pulses as f64))
                    .sqrt()
                    .max(1e-9 * sd_re);
                let z = (found[(m, n)] - c).re / sd_re;
                assert!(z.abs() < 4.5, "{name} ({m}, {n}): z = {z}");
                if m != n {
                    let z = (found[(m, n)] - c).im / sd_im;
                    assert!(
                        z.abs() < 4.5,
                        "{name} ({m}, {n}): z = {z} of the imaginary part"
                    );
                }
            }
        }
    });
}
