//! What a record holds beside (15): noises of a real receiver, phases of the laser, the reflex of
//! the telescope, the echo of the pulse before. Each in the samples as in the numbers that the
//! signal-to-noise ratio uses.

use std::f64::consts::PI;

use approx::assert_relative_eq;
use num_complex::Complex;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_signal::digitise::Digitiser;
use wakescope_signal::receiver::phase_noise::mean_frequency_sd_m_s;
use wakescope_signal::receiver::{Converter, FrontEnd};
use wakescope_signal::{
    LineOfSight, NoiseModel, Pulse, Receiver, Record, Scratch, Shot, Simulator,
};

use crate::setup::{C, STEP_M, gaussian, line, receiver};

/// A receiver with every noise.
fn real(noise: NoiseModel) -> Receiver {
    let front_end = FrontEnd {
        amplifier_noise_a_rthz: 1.2e-11,
        load_ohm: 200.0,
        dark_current_a: 1e-4,
        intensity_noise_db_hz: -150.0,
        rejection_db: 5.0,
        saturation_w: 6e-3,
        poles: 2,
        half_power_hz: 90e6,
        ..FrontEnd::IDEAL
    };
    Receiver {
        front_end,
        ..receiver(noise)
    }
}

fn planned(pulse: impl Into<Pulse>, receiver: Receiver, first_m: f64, samples: usize) -> Simulator {
    Simulator::new(
        pulse,
        receiver,
        Record {
            time_of_first_sample_s: 2.0 * first_m / C,
            samples,
        },
    )
    .unwrap()
}

fn silent() -> LineOfSight {
    LineOfSight {
        weight_per_m: vec![0.0; 100],
        ..line(400.0, 460.05, STEP_M, |_| 0.0)
    }
}

/// Mean square and its standard error.
fn mean_square(samples: &[f64]) -> (f64, f64) {
    let n = samples.len() as f64;
    let mean = samples.iter().map(|x| x * x).sum::<f64>() / n;
    (mean, mean * (2.0 / n).sqrt())
}

/// Records of noise alone.
fn noise(receiver: Receiver, records: usize) -> Vec<f64> {
    let simulator = planned(gaussian(200e-9), receiver, 400.0, 1000);
    let (mut scratch, mut rng) = (Scratch::default(), Xoshiro256PlusPlus::seed_from_u64(7));
    let mut out = vec![0.0; 1000 * records];
    for row in out.chunks_mut(1000) {
        simulator
            .record_into(&silent(), &mut rng, &mut scratch, row)
            .unwrap();
    }
    out
}

#[test]
fn all_noises_are_one_draw_of_the_summed_density_and_the_ratio_has_the_same() {
    let receiver = real(NoiseModel::White);
    let density = receiver.noise_densities().total_a2_hz();
    let shot = Receiver {
        front_end: FrontEnd::IDEAL,
        ..receiver
    };
    let alone = receiver.noise_densities().shot_a2_hz * receiver.noise_densities().response;
    assert!(
        density > 1.5 * alone,
        "there is more than shot noise: {density} {alone}"
    );
    let (found, error) = mean_square(&noise(receiver, 300));
    let expected = density * 125e6;
    assert!(
        (found - expected).abs() < 3.0 * error,
        "{found} {expected} {error}"
    );
    // The same numbers, scaled: noises of a real receiver draw none of their own.
    let scale = (density / shot.noise_density_a2_hz()).sqrt();
    for (real, ideal) in noise(receiver, 1).iter().zip(&noise(shot, 1)) {
        assert_relative_eq!(*real, ideal * scale, max_relative = 1e-12);
    }
    let air = line(300.0, 560.0, STEP_M, |_| 0.0);
    let snr = |receiver| {
        let mut out = [0.0];
        planned(gaussian(200e-9), receiver, 430.0, 1)
            .snr_into(&air, &mut Scratch::default(), &mut out)
            .unwrap();
        out[0]
    };
    assert_relative_eq!(
        10.0 * (snr(shot) / snr(receiver)).log10(),
        receiver.penalties().total_db(),
        max_relative = 1e-9
    );
}

#[test]
fn converted_noise_has_the_clipping_and_rounding_of_the_closed_forms() {
    let receiver = real(NoiseModel::White);
    let rms_a = receiver.noise_variance_a2().sqrt();
    let input_over_noise = (125.0_f64 / 50.0).sqrt();
    let converter = |bits, k: f64| Converter {
        bits,
        full_scale_over_noise: k * input_over_noise,
        bandwidth_hz: 50e6,
        sample_rate_hz: 250e6,
        input_over_noise,
    };
    let plain = noise(receiver, 100);
    let converted = |bits, k: f64| {
        let mut out = plain.clone();
        Digitiser::new(bits, k * input_over_noise * rms_a)
            .unwrap()
            .digitise(&mut out)
            .unwrap();
        out
    };
    // Fine steps: clipping alone. The copy of the noise that is left, and the rest.
    let clipping = converter(16, 1.0).clipping();
    let clipped = converted(16, 1.0);
    let n = plain.len() as f64;
    let power = plain.iter().map(|x| x * x).sum::<f64>();
    let gain = plain.iter().zip(&clipped).map(|(x, y)| x * y).sum::<f64>() / power;
    assert!(
        (gain - clipping.gain).abs() < 3.0 / n.sqrt(),
        "{gain} {clipping:?}"
    );
    let rest = plain
        .iter()
        .zip(&clipped)
        .map(|(x, y)| (y - gain * x).powi(2))
        .sum::<f64>()
        / power;
    assert!(
        (rest / clipping.distortion - 1.0).abs() < 3.0 * (8.0 / n).sqrt(),
        "{rest} {clipping:?}"
    );
    // Coarse steps, no clipping: the error of rounding over all the noise.
    let coarse = converter(5, 5.5);
    let errors: Vec<f64> = plain
        .iter()
        .zip(&converted(5, 5.5))
        .map(|(x, y)| y - x)
        .collect();
    let (found, error) = mean_square(&errors);
    let expected = coarse.rounding() * receiver.noise_variance_a2() / 50e6 * 125e6;
    assert!((found - expected).abs() < 3.0 * error, "{found} {expected}");
    assert!(coarse.clipping_noise() < 1e-4 * coarse.rounding());
}

#[test]
fn noise_in_few_codes_has_the_gain_and_the_variance_of_the_sums_over_them() {
    let receiver = real(NoiseModel::White);
    let input_over_noise = (125.0_f64 / 50.0).sqrt();
    let plain = noise(receiver, 100);
    let n = plain.len() as f64;
    let power_a2 = plain.iter().map(|x| x * x).sum::<f64>() / n;
    for (bits, k) in [(2, 2.0), (2, 8.0), (3, 1.0), (3, 2.0)] {
        let full_scale_over_noise = k * input_over_noise;
        let converter = Converter {
            bits,
            full_scale_over_noise,
            bandwidth_hz: 50e6,
            sample_rate_hz: 250e6,
            input_over_noise,
        };
        let full_scale_a = full_scale_over_noise * receiver.noise_variance_a2().sqrt();
        let mut samples = plain.clone();
        Digitiser::new(bits, full_scale_a)
            .unwrap()
            .digitise(&mut samples)
            .unwrap();
        let mean_a = samples.iter().sum::<f64>() / n;
        let variance = samples.iter().map(|y| (y - mean_a).powi(2)).sum::<f64>() / n / power_a2;
        let gain = plain.iter().zip(&samples).map(|(x, y)| x * y).sum::<f64>() / n / power_a2;
        let clipping = converter.clipping();
        // Four and more standard deviations of the samples at hand; symmetric clipping beside rounding is 7 to 220 % off.
        let counted =
            clipping.gain.powi(2) * (1.0 + converter.rounding() + converter.clipping_noise());
        for (found, expected) in [
            (variance, clipping.variance),
            (variance, counted),
            (gain, clipping.gain),
        ] {
            assert_relative_eq!(found, expected, max_relative = 0.03);
        }
    }
}

/// A flat pulse of 1.2 us about time 0.
fn flat() -> Pulse {
    let times: Vec<f64> = (0..=64).map(|i| (f64::from(i) - 32.0) * 20e-9).collect();
    let power: Vec<f64> = times
        .iter()
        .map(|t| f64::from(u8::from(t.abs() < 0.61e-6)))
        .collect();
    Pulse::from_power(&times, &power, 150e-6).unwrap()
}

/// One layer at this range that returns light, and nothing else.
fn point_target(range_m: f64) -> LineOfSight {
    let first_m = range_m - 400.0 * STEP_M;
    let mut line = line(first_m, range_m + 400.0 * STEP_M, STEP_M, |_| 0.0);
    line.weight_per_m.fill(0.0);
    line.weight_per_m[400] = 1e-14;
    line
}

/// Envelopes of a point target at 400 m by a laser of some linewidth, 65 samples within
/// the flat pulse.
fn target_envelope(linewidth_hz: f64, range_m: f64, impairment_seed: u64) -> Vec<Complex<f64>> {
    let front_end = FrontEnd {
        linewidth_hz,
        ..FrontEnd::IDEAL
    };
    let simulator = planned(
        flat(),
        Receiver {
            front_end,
            ..receiver(NoiseModel::None)
        },
        400.0 - 32.0 * STEP_M,
        65,
    );
    let mut out = vec![Complex::ZERO; 65];
    let target = point_target(range_m);
    let shot = Shot {
        impairment_seed,
        ..Shot::from(&target)
    };
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    simulator
        .envelope_into(shot, &mut rng, &mut Scratch::default(), &mut out)
        .unwrap();
    out
}

/// Frequency of the highest point of a spectrum near zero, in radians per sample, by
/// Newton's method.
fn peak(samples: &[Complex<f64>]) -> f64 {
    let middle = 0.5 * (samples.len() - 1) as f64;
    let mut omega = 0.0;
    for _ in 0..4 {
        let sum = |power: i32| -> Complex<f64> {
            let term = |(k, s): (usize, &Complex<f64>)| {
                let t = k as f64 - middle;
                s * Complex::cis(-omega * t) * Complex::new(0.0, -t).powi(power)
            };
            samples.iter().enumerate().map(term).sum()
        };
        let [value, slope, bend] = [sum(0), sum(1), sum(2)];
        omega -= (value.conj() * slope).re / (slope.norm_sqr() + (value.conj() * bend).re);
    }
    omega
}

#[test]
fn velocities_of_a_point_target_scatter_as_phase_noise_says() {
    const PULSES: u64 = 3000;
    let expected = mean_frequency_sd_m_s(1.55e-6, 1e4, 2.7e-6, 256e-9);
    assert!((expected - 0.0864).abs() < 1e-4);
    let to_m_s = |omega: f64| 0.5 * 1.55e-6 * omega * 250e6 / (2.0 * PI);
    let (mut mean, mut peaks) = (Vec::new(), Vec::new());
    for seed in 0..PULSES {
        let s = target_envelope(1e4, 400.0, seed);
        mean.push(to_m_s((s[64] * s[0].conj()).arg() / 64.0));
        peaks.push(to_m_s(peak(&s[..64])));
    }
    for (found, expected) in [(mean, expected), (peaks, expected * 1.2_f64.sqrt())] {
        let sd = mean_square(&found).0.sqrt();
        let relative = sd / expected - 1.0;
        assert!(
            relative.abs() < 3.0 / (2.0 * PULSES as f64).sqrt() && relative.abs() < 0.04,
            "{sd} {expected}"
        );
    }
}

#[test]
fn the_phases_of_a_pulse_are_new_for_each_and_the_same_at_all_its_ranges() {
    // Ratio to a quiet laser: phase of the pulse at its place in the pulse, less that of the
    // local oscillator.
    let turns = |range_m: f64, seed| -> Vec<Complex<f64>> {
        let (quiet, noisy) = (
            target_envelope(0.0, range_m, seed),
            target_envelope(1e5, range_m, seed),
        );
        quiet.iter().zip(&noisy).map(|(a, b)| b / a).collect()
    };
    let [near, middle, far] = [0.0, 10.0, 20.0].map(|steps| turns(400.0 + steps * STEP_M, 5));
    // Without the local oscillator, which they share: what the pulse did over 10 samples.
    let before: Vec<_> = near
        .iter()
        .zip(&middle)
        .map(|(a, b)| a * b.conj())
        .collect();
    let behind: Vec<_> = middle.iter().zip(&far).map(|(a, b)| a * b.conj()).collect();
    for (early, late) in before.iter().zip(&behind[10..]) {
        assert!((early - late).norm() < 1e-9, "{early} {late}");
    }
    assert!((near[0] - turns(400.0, 6)[0]).norm() > 1e-3);
}

#[test]
fn the_reflex_is_in_the_record_as_its_ratio_says() {
    let front_end = FrontEnd {
        reflection: 1e-6,
        ..FrontEnd::IDEAL
    };
    let simulator = planned(
        gaussian(200e-9),
        Receiver {
            front_end,
            ..receiver(NoiseModel::None)
        },
        20.0,
        150,
    );
    let mut out = vec![Complex::ZERO; 150];
    let (mut scratch, mut rng) = (Scratch::default(), Xoshiro256PlusPlus::seed_from_u64(3));
    simulator
        .envelope_into(&silent(), &mut rng, &mut scratch, &mut out)
        .unwrap();
    let receiver = simulator.receiver();
    for (k, s) in out.iter().enumerate() {
        let expected = receiver.reflex_snr(simulator.pulse(), simulator.time_s(k));
        assert_relative_eq!(
            s.norm_sqr() / receiver.noise_variance_a2(),
            expected,
            max_relative = 1e-9
        );
    }
    // Light that never moved: one phase.
    assert!((out[0] / out[40]).im.abs() < 1e-9 * (out[0] / out[40]).re);
}

#[test]
fn the_pulse_before_adds_its_power_and_leaves_speckle_and_noise_alone() {
    let air = line(300.0, 560.0, STEP_M, |_| 2.0);
    let cloud = LineOfSight {
        weight_per_m: air.weight_per_m.iter().map(|w| 0.5 * w).collect(),
        ..line(300.0, 560.0, STEP_M, |_| -4.0)
    };
    let dark = LineOfSight {
        weight_per_m: vec![0.0; air.layers()],
        ..air.clone()
    };
    let simulator = planned(
        gaussian(200e-9),
        receiver(NoiseModel::BandLimited),
        430.0,
        64,
    );
    let record = |shot: Shot<'_>, seed| {
        let mut out = vec![0.0; 64];
        simulator
            .record_into(
                shot,
                &mut Xoshiro256PlusPlus::seed_from_u64(seed),
                &mut Scratch::default(),
                &mut out,
            )
            .unwrap();
        out
    };
    let plain = record(Shot::from(&air), 4);
    let with = |previous, impairment_seed| Shot {
        previous: Some(previous),
        impairment_seed,
        ..Shot::from(&air)
    };
    for (a, b) in plain.iter().zip(&record(with(&dark, 9), 4)) {
        assert_relative_eq!(*a, *b, max_relative = 1e-12);
    }
    const PULSES: u64 = 2000;
    // Mean square of a sample of the echo: the rest is the same with and without it.
    let echoes: Vec<f64> = (0..PULSES)
        .map(|i| record(with(&cloud, i), 4)[30] - plain[30])
        .collect();
    let (found, error) = mean_square(&echoes);
    let mut expected = [0.0; 64];
    simulator
        .mean_power_into(&cloud, &mut Scratch::default(), &mut expected)
        .unwrap();
    assert!(
        (found - expected[30]).abs() < 3.0 * error,
        "{found} {} {error}",
        expected[30]
    );
}
