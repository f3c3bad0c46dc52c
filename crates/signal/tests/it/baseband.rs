//! Complex baseband: noise of the same signal-to-noise ratio, flat in the band, and the real
//! current that belongs to it.

use std::f64::consts::PI;

use num_complex::Complex;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_signal::{Error, LineOfSight, NoiseModel, Receiver, Record, Scratch, Simulator};

use crate::setup::{C, STEP_M, gaussian, line, receiver, simulator};

const RECORDS: usize = 400;

fn silent() -> LineOfSight {
    LineOfSight {
        weight_per_m: vec![0.0; 100],
        ..line(400.0, 460.05, STEP_M, |_| 0.0)
    }
}

/// Records of noise alone, in units of the square root of (13).
fn noise(model: NoiseModel, samples: usize) -> Vec<Vec<Complex<f64>>> {
    let simulator = simulator(gaussian(200e-9), model, 400.0, samples);
    let sd_a = receiver(model).noise_variance_a2().sqrt();
    let (mut scratch, mut rng) = (Scratch::default(), Xoshiro256PlusPlus::seed_from_u64(12));
    (0..RECORDS)
        .map(|_| {
            let mut out = vec![Complex::ZERO; samples];
            simulator
                .record_into(&silent(), &mut rng, &mut scratch, &mut out)
                .unwrap();
            out.iter().map(|n| n / sd_a).collect()
        })
        .collect()
}

fn density(records: &[Vec<Complex<f64>>], frequency_hz: f64) -> f64 {
    let samples = records[0].len();
    let hann = |k: usize| (PI * (k as f64 + 0.5) / samples as f64).sin().powi(2);
    let kernel: Vec<_> = (0..samples)
        .map(|k| hann(k) * Complex::cis(-2.0 * PI * frequency_hz * k as f64 / 250e6))
        .collect();
    let squares: f64 = (0..samples).map(|k| hann(k).powi(2)).sum();
    let power = |r: &Vec<Complex<f64>>| {
        r.iter()
            .zip(&kernel)
            .map(|(n, w)| n * w)
            .sum::<Complex<f64>>()
            .norm_sqr()
    };
    records.iter().map(power).sum::<f64>() / (records.len() as f64 * squares * 250e6)
}

#[test]
fn baseband_noise_has_the_mean_square_of_equation_13_and_no_preferred_phase() {
    for samples in [1, 63, 1000] {
        let records = noise(NoiseModel::BandLimited, samples);
        let count = (RECORDS * samples) as f64;
        let square = records.iter().flatten().map(|n| n.norm_sqr()).sum::<f64>() / count;
        let pseudo = records
            .iter()
            .flatten()
            .map(|n| n * n)
            .sum::<Complex<f64>>()
            / count;
        let independent = RECORDS as f64 * (0.2 * samples as f64).max(1.0);
        assert!(
            ((square - 1.0) * independent.sqrt()).abs() < 4.0,
            "{samples} samples: {square}"
        );
        assert!(
            pseudo.norm() * independent.sqrt() < 4.0,
            "{samples} samples: {pseudo}"
        );
    }
}

#[test]
fn baseband_noise_is_flat_in_the_band_about_zero_and_absent_outside() {
    let records = noise(NoiseModel::BandLimited, 1000);
    for step in 0..40 {
        let frequency_hz = -23.4e6 + 1.2e6 * f64::from(step);
        let z = (density(&records, frequency_hz) * 50e6 - 1.0) * (RECORDS as f64).sqrt();
        assert!(z.abs() < 4.0, "{frequency_hz} Hz: z = {z}");
    }
    for frequency_hz in [-120e6, -26.5e6, 26.5e6, 80e6] {
        assert!(density(&records, frequency_hz) * 50e6 < 1e-3);
    }
}

#[test]
fn white_baseband_noise_fills_the_sampling_rate_with_the_same_density() {
    let records = noise(NoiseModel::White, 500);
    let square =
        records.iter().flatten().map(|n| n.norm_sqr()).sum::<f64>() / (RECORDS * 500) as f64;
    assert!(
        ((square / 5.0 - 1.0) * (RECORDS as f64 * 500.0).sqrt()).abs() < 4.0,
        "{square}"
    );
    for frequency_hz in [-110e6, 0.0, 60e6] {
        let z = (density(&records, frequency_hz) * 50e6 - 1.0) * (RECORDS as f64).sqrt();
        assert!(z.abs() < 4.0, "{frequency_hz} Hz: z = {z}");
    }
}

#[test]
fn without_noise_the_current_is_sqrt_2_times_the_real_part_of_the_baseband_on_its_carrier() {
    let simulator = simulator(gaussian(200e-9), NoiseModel::None, 400.0, 200);
    let air = line(300.0, 600.0, STEP_M, |_| 6.0);
    let (mut baseband, mut current) = (vec![Complex::ZERO; 200], vec![0.0; 200]);
    let stream = || Xoshiro256PlusPlus::seed_from_u64(3);
    let mut scratch = Scratch::default();
    simulator
        .record_into(&air, &mut stream(), &mut scratch, &mut baseband)
        .unwrap();
    simulator
        .record_into(&air, &mut stream(), &mut scratch, &mut current)
        .unwrap();
    let largest = baseband.iter().map(|s| s.norm()).fold(0.0, f64::max);
    for (k, (s, i)) in baseband.iter().zip(&current).enumerate() {
        let carrier = Complex::cis(2.0 * PI * 80e6 * simulator.time_s(k));
        assert!((i - 2.0_f64.sqrt() * (s * carrier).re).abs() < 1e-9 * largest);
    }
}

#[test]
fn quadratures_hold_a_band_as_wide_as_their_rate_and_a_real_current_of_it_is_refused() {
    let record = Record {
        time_of_first_sample_s: 2.0 * 400.0 / C,
        samples: 400,
    };
    let wide = Receiver {
        sample_rate_hz: 50e6,
        bandwidth_hz: 49e6,
        ..receiver(NoiseModel::BandLimited)
    };
    assert!(matches!(
        Simulator::new(gaussian(200e-9), wide, record),
        Err(Error::BandBeyondNyquist { .. })
    ));
    let simulator = Simulator::for_baseband(gaussian(200e-9), wide, record).unwrap();
    let (mut scratch, mut rng) = (Scratch::default(), Xoshiro256PlusPlus::seed_from_u64(21));
    let air = LineOfSight {
        weight_per_m: vec![0.0; 100],
        ..line(400.0, 460.05, STEP_M, |_| 0.0)
    };
    let refused = simulator.record_into(&air, &mut rng, &mut scratch, &mut [0.0_f64; 400]);
    assert!(matches!(refused, Err(Error::BandBeyondNyquist { .. })));
    let mut sum = 0.0;
    for _ in 0..50 {
        let mut out = [Complex::ZERO; 400];
        simulator
            .record_into(&air, &mut rng, &mut scratch, &mut out)
            .unwrap();
        sum += out.iter().map(|n| n.norm_sqr()).sum::<f64>();
    }
    let relative = sum / (50.0 * 400.0) / wide.noise_variance_a2() - 1.0;
    assert!(
        relative.abs() < 3.0 / (50.0 * 400.0_f64).sqrt(),
        "{relative}"
    );
    for bad in [
        Receiver {
            bandwidth_hz: 50e6,
            ..wide
        },
        Receiver {
            intermediate_frequency_hz: 20e6,
            ..wide
        },
    ] {
        assert!(matches!(
            Simulator::for_baseband(gaussian(200e-9), bad, record),
            Err(Error::BandBeyondNyquist { .. })
        ));
    }
}
