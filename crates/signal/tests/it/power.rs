//! Mean power by range against (14), in air that changes with range.

use std::f64::consts::PI;

use approx::assert_relative_eq;
use wakescope_signal::efficiency::LayerEfficiency;
use wakescope_signal::scan::pulse_generator;
use wakescope_signal::{
    Error, GaussianPulse, LineOfSight, Medium, NoiseModel, Receiver, Scan, Scratch,
};

use crate::setup::{C, STEP_M, gaussian, line, mean_power, receiver, simulator, weighted_line};

const FIRST_M: f64 = 200.0;
const SAMPLES: usize = 700;
const AREA_M2: f64 = 7.85e-3;

/// A haze that thins out, a thin cloud at 450 m, clear air behind.
fn medium() -> Medium {
    Medium::new(
        vec![0.0, 150.0, 300.0, 440.0, 450.0, 460.0, 800.0],
        vec![4e-7, 4e-7, 1e-7, 1e-7, 6e-7, 1e-7, 8e-8],
        vec![3e-4, 3e-4, 7e-5, 7e-5, 3e-3, 7e-5, 7e-5],
    )
    .unwrap()
}

fn efficiency(line: &LineOfSight) -> LayerEfficiency {
    let ranges: Vec<f64> = (0..40).map(|i| 20.0 + 20.0 * f64::from(i)).collect();
    let curve: Vec<f64> = ranges
        .iter()
        .map(|r| 0.01 / (1.0 + (r / 500.0).powi(2)))
        .collect();
    LayerEfficiency::new(&ranges, &[curve], line).unwrap()
}

fn scene(thickness_m: f64) -> LineOfSight {
    let mut line = line(90.0, 760.0, thickness_m, |r| 10.0 * (0.02 * r).sin());
    let eta = efficiency(&line);
    medium().weigh(&mut line, AREA_M2).unwrap();
    line.weight_per_m
        .iter_mut()
        .zip(eta.of_pulse(0))
        .for_each(|(weight, eta)| *weight *= eta);
    line
}

#[test]
fn mean_power_is_the_integral_of_14_at_every_range_of_a_scene() {
    let pulse = gaussian(200e-9);
    let power = mean_power(
        &simulator(pulse, NoiseModel::None, FIRST_M, SAMPLES),
        &scene(STEP_M / 3.0),
    );
    // (14) by a fine quadrature of its own over the return, efficiency included.
    let step_m = 0.05;
    let integral = |seen_m: f64| {
        let reach_m = 5.0 * pulse.sigma_m();
        let steps = (2.0 * reach_m / step_m) as i32;
        let term = |i: i32| {
            let range_m = seen_m - reach_m + (f64::from(i) + 0.5) * step_m;
            let eta_line = LineOfSight {
                first_range_m: range_m,
                layer_thickness_m: 1.0,
                radial_velocity_m_s: vec![0.0],
                weight_per_m: vec![0.0],
            };
            let eta = efficiency(&eta_line).of_pulse(0)[0];
            let weight = medium().return_per_m(range_m, AREA_M2).unwrap() * eta;
            weight * pulse.intensity_per_s(2.0 * (seen_m - range_m) / C) * step_m
        };
        (0..steps).map(term).sum::<f64>()
    };
    let gain = receiver(NoiseModel::None).heterodyne_gain_a2_w() * pulse.energy_j();
    for (k, found) in power.iter().enumerate().step_by(10) {
        let seen_m = FIRST_M + STEP_M * k as f64;
        assert_relative_eq!(*found, gain * integral(seen_m), max_relative = 2e-5);
    }
}

#[test]
fn power_of_a_scene_does_not_change_with_layers_a_quarter_and_four_times_as_thick() {
    let simulator = simulator(gaussian(200e-9), NoiseModel::None, FIRST_M, SAMPLES);
    let reference = mean_power(&simulator, &scene(STEP_M));
    for factor in [0.25, 4.0] {
        for (found, expected) in mean_power(&simulator, &scene(factor * STEP_M))
            .iter()
            .zip(&reference)
        {
            assert_relative_eq!(*found, *expected, max_relative = 1e-3);
        }
    }
}

#[test]
fn snr_reproduces_the_stored_curve() {
    let path = format!(
        "{}/../../tests/reference/optics/eta_freespace_table2.csv",
        env!("CARGO_MANIFEST_DIR")
    );
    let (air, receiver) = (Medium::table2(), Receiver::table2());
    let ratio = |range_m: f64, efficiency: f64| {
        let weight_per_m = air.return_per_m(range_m, PI * 0.05 * 0.05).unwrap() * efficiency;
        receiver.slowly_varying_snr(150e-6, weight_per_m)
    };
    let mut rows = 0;
    for line in std::fs::read_to_string(path)
        .unwrap()
        .lines()
        .filter(|l| l.starts_with(|c: char| c.is_ascii_digit()))
    {
        let row: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
        let snr = ratio(row[0], row[1]);
        assert_relative_eq!(snr, row[5], max_relative = 1e-8);
        assert!((10.0 * snr.log10() - row[6]).abs() < 1e-6);
        // K^2/R^2 is all that the range changes beside the efficiency.
        let at_1_m =
            |range_m: f64| ratio(range_m, 0.01) * range_m * range_m / (-2.0 * 7e-5 * range_m).exp();
        assert_relative_eq!(at_1_m(row[0]), at_1_m(150.0), max_relative = 1e-12);
        rows += 1;
    }
    assert!(rows > 70, "{rows}");
}

#[test]
fn pulse_integral_tends_to_the_narrow_pulse_form() {
    let (air, range_m, thickness_m) = (Medium::uniform(1e-7, 7e-5).unwrap(), 1000.0, 0.05);
    let gap = |pulse: GaussianPulse| {
        let weight_per_m = |r: f64| air.return_per_m(r, AREA_M2).unwrap() * 0.05;
        let line = weighted_line(900.0, 1100.0, thickness_m, |_| 0.0, weight_per_m);
        let (simulator, mut snr) = (simulator(pulse, NoiseModel::BandLimited, range_m, 1), [0.0]);
        simulator
            .snr_into(&line, &mut Scratch::default(), &mut snr)
            .unwrap();
        let narrow =
            receiver(NoiseModel::None).slowly_varying_snr(pulse.energy_j(), weight_per_m(range_m));
        snr[0] / narrow - 1.0
    };
    // Second order in the length: sigma_R^2/4 times the second derivative of K^2/R^2 over itself.
    let long = gaussian(200e-9);
    let a = 2.0 * 7e-5;
    let curvature = 6.0 / (range_m * range_m) + 4.0 * a / range_m + a * a;
    assert_relative_eq!(
        gap(long),
        0.25 * long.sigma_m().powi(2) * curvature,
        max_relative = 0.02
    );
    assert!(gap(gaussian(2e-9)).abs() < 1e-6);
}

/// Mean power of the simulated envelopes \[A^2\] at each sample.
fn simulated(pulses: usize, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let simulator = simulator(gaussian(200e-9), NoiseModel::None, FIRST_M, SAMPLES);
    let line = scene(STEP_M);
    let scan = Scan {
        simulator: &simulator,
        lines: 1,
        pulses_per_line: pulses,
        shot: |_| (&line).into(),
        generator: |key| pulse_generator(seed, key),
        digitiser: None,
    };
    let mut sum = vec![0.0; SAMPLES];
    scan.for_each::<num_complex::Complex<f64>, Error>(|_, record| {
        sum.iter_mut()
            .zip(record)
            .for_each(|(to, s)| *to += s.norm_sqr());
        Ok(())
    })
    .unwrap();
    (
        sum.iter().map(|s| s / pulses as f64).collect(),
        mean_power(&simulator, &line),
    )
}

#[test]
fn simulated_power_averages_to_its_expectation_at_every_range() {
    let pulses = 2000;
    let (found, expected) = simulated(pulses, 5);
    for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
        // |s|^2 is exponential; 700 correlated samples.
        let z = (found / expected - 1.0) * (pulses as f64).sqrt();
        assert!(z.abs() < 4.5, "sample {k}: z = {z}");
    }
}
