//! Shot noise: variance (13), flat in the band, nothing outside, no memory of the end of the
//! record.

use std::f64::consts::PI;

use num_complex::Complex;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_signal::{LineOfSight, NoiseModel, Scratch};

use crate::setup::{gaussian, receiver, simulator};

const RECORDS: usize = 400;

/// Records of noise alone, in units of the standard deviation of (13), `sqrt(2 e S P_LO B)`.
fn records(noise: NoiseModel, samples: usize) -> Vec<Vec<f64>> {
    let simulator = simulator(gaussian(200e-9), noise, 0.0, samples);
    let silent = LineOfSight {
        first_range_m: 0.0,
        layer_thickness_m: 0.6,
        radial_velocity_m_s: vec![0.0],
        weight_per_m: vec![0.0],
    };
    let charge_c = 1.602_176_634e-19;
    let sd_a = (2.0 * charge_c * receiver(noise).responsivity_a_w() * 2e-3 * 50e6).sqrt();
    let mut scratch = Scratch::default();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(77);
    (0..RECORDS)
        .map(|_| {
            let mut current = vec![0.0; samples];
            simulator
                .record_into(&silent, &mut rng, &mut scratch, &mut current)
                .unwrap();
            current.iter().map(|i| i / sd_a).collect()
        })
        .collect()
}

/// Two-sided density per hertz at `frequency_hz`, with a Hann window, averaged over the records.
fn density(records: &[Vec<f64>], frequency_hz: f64) -> f64 {
    let samples = records[0].len();
    let window = |k: usize| (PI * (k as f64 + 0.5) / samples as f64).sin().powi(2);
    let kernel: Vec<Complex<f64>> = (0..samples)
        .map(|k| window(k) * Complex::cis(-2.0 * PI * frequency_hz * k as f64 / 250e6))
        .collect();
    let squares: f64 = (0..samples).map(|k| window(k).powi(2)).sum();
    let power = |record: &Vec<f64>| {
        record
            .iter()
            .zip(&kernel)
            .map(|(i, w)| i * w)
            .sum::<Complex<f64>>()
            .norm_sqr()
    };
    records.iter().map(power).sum::<f64>() / (records.len() as f64 * squares * 250e6)
}

fn variance(records: &[Vec<f64>]) -> f64 {
    let count = (records.len() * records[0].len()) as f64;
    records.iter().flatten().map(|i| i * i).sum::<f64>() / count
}

#[test]
fn band_noise_has_the_variance_of_equation_13_for_any_length_of_record() {
    for samples in [1, 2, 63, 64, 1000] {
        let found = variance(&records(NoiseModel::BandLimited, samples));
        // Squares of normal numbers; of the samples, B/(F_s/2) are independent, one per
        // record at least.
        let independent = RECORDS as f64 * (0.4 * samples as f64).max(1.0);
        let z = (found - 1.0) * (independent / 2.0).sqrt();
        assert!(z.abs() < 4.0, "{samples} samples: {found}, z = {z}");
    }
}

#[test]
fn band_noise_is_flat_in_the_band_and_absent_outside() {
    let records = records(NoiseModel::BandLimited, 1000);
    let level = 0.5 / 50e6;
    for step in 0..40 {
        let frequency_hz = 56.5e6 + 1.2e6 * f64::from(step);
        let z = (density(&records, frequency_hz) / level - 1.0) * (RECORDS as f64).sqrt();
        assert!(z.abs() < 4.0, "{frequency_hz} Hz: z = {z}");
    }
    for frequency_hz in [1e6, 30e6, 53.5e6, 106.5e6, 120e6] {
        let ratio = density(&records, frequency_hz) / level;
        assert!(ratio < 1e-3, "{frequency_hz} Hz: {ratio}");
    }
}

#[test]
fn white_noise_has_the_same_density_up_to_nyquist() {
    let records = records(NoiseModel::White, 500);
    let z = (variance(&records) / 2.5 - 1.0) * (RECORDS as f64 * 500.0 / 2.0).sqrt();
    assert!(z.abs() < 4.0, "z = {z}");
    for frequency_hz in [5e6, 30e6, 80e6, 120e6] {
        let z = (density(&records, frequency_hz) * 100e6 - 1.0) * (RECORDS as f64).sqrt();
        assert!(z.abs() < 4.0, "{frequency_hz} Hz: z = {z}");
    }
}

#[test]
fn the_end_of_a_record_does_not_know_its_beginning() {
    let records = records(NoiseModel::BandLimited, 1000);
    let mean_product =
        |a: usize, b: usize| records.iter().map(|r| r[a] * r[b]).sum::<f64>() / RECORDS as f64;
    let error = 1.0 / (RECORDS as f64).sqrt();
    for (a, b) in [(0, 999), (0, 998), (1, 999)] {
        // The covariance of a flat band is sinc(B tau) cos(2 pi f_c tau), about -0.4 for neighbours
        // and next neighbours, which these pairs would be on a circle of 1000 samples.
        let tau = (a + 1000 - b) as f64 / 250e6;
        let covariance =
            (PI * 50e6 * tau).sin() / (PI * 50e6 * tau) * (2.0 * PI * 80e6 * tau).cos();
        let inside = mean_product(500, 500 + a + 1000 - b);
        assert!(
            (inside - covariance).abs() < 4.0 * error,
            "{inside} {covariance}"
        );
        assert!(mean_product(a, b).abs() < 3.0 * error && covariance.abs() > 7.0 * error);
    }
}
