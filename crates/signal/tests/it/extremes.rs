//! Extreme cases: each has a stated outcome, a number or a typed error, never a panic or a
//! silent wrong number.

use std::f64::consts::PI;

use approx::assert_relative_eq;
use num_complex::Complex;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_signal::{
    Error, LineOfSight, NoiseModel, Pulse, RangeFilter, Receiver, Record, Scratch, Shot, Simulator,
};

use crate::setup::{
    C, STEP_M, WAVELENGTH_M, chirped, gaussian, limits, line, receiver, rectangle, simulator,
};

fn current(simulator: &Simulator, line: &LineOfSight, seed: u64) -> Result<Vec<f64>, Error> {
    let mut out = vec![0.0; simulator.record().samples];
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    simulator.record_into(line, &mut rng, &mut Scratch::default(), &mut out)?;
    Ok(out)
}

#[test]
fn pulses_much_longer_and_much_shorter_than_the_gate_have_their_power_and_covariance() {
    // From 40 times longer than a window of 64 samples to 250 times shorter.
    for width_s in [1e-5, 2e-6, 5e-9, 1e-9] {
        let pulse = gaussian(width_s);
        let thickness_m = Pulse::from(pulse)
            .layer_thickness_m(limits(0.0))
            .unwrap()
            .max(0.02);
        let reach_m = 4.0 * pulse.sigma_m();
        let far_m = 8000.0;
        let simulator = simulator(pulse, NoiseModel::None, far_m, 16);
        let air = line(far_m - reach_m, far_m + reach_m + 40.0, thickness_m, |_| {
            4.0
        });
        let found = simulator.covariance_a2(&air).unwrap();
        let power = receiver(NoiseModel::None).heterodyne_gain_a2_w() * 150e-6 * 5e-17 * 0.5 * C;
        for lag in [0, 1, 5, 15] {
            let tau = lag as f64 / 250e6;
            let modulus = (-(tau / pulse.sigma_s()).powi(2) / 4.0).exp();
            let expected = Complex::from_polar(modulus, -4.0 * PI * 4.0 * tau / WAVELENGTH_M);
            assert!(
                (found[(lag, 0)] / power - expected).norm() < 2e-4,
                "{width_s} s, lag {lag}"
            );
        }
        // v_pulse of the longest pulse is a mean over kilometres, of the shortest the
        // wind at the place.
        let wind = |r: f64| 5.0 * ((r - far_m) / 30.0).cos();
        let seen = RangeFilter::pulse(pulse, thickness_m)
            .unwrap()
            .at_range(far_m, wind);
        assert_relative_eq!(
            seen,
            5.0 * (-(pulse.sigma_m() / 60.0).powi(2)).exp(),
            epsilon = 1e-3
        );
    }
}

#[test]
fn layers_too_thick_for_the_pulse_are_refused_with_the_thickness() {
    let thick = line(300.0, 500.0, STEP_M, |_| 1.0);
    let short = simulator(gaussian(1e-9), NoiseModel::None, 400.0, 16);
    let too_thick = |error: Error| matches!(error, Error::OutOfRange { field: "layer_thickness_m", value, .. } if value == STEP_M);
    let refused = |simulator: &Simulator| too_thick(current(simulator, &thick, 1).unwrap_err());
    assert!(refused(&short) && too_thick(short.covariance_a2(&thick).unwrap_err()));
    let chirped = chirped(200e-9, 2e15);
    assert!(refused(&simulator(chirped, NoiseModel::None, 400.0, 16)));
    let steep = rectangle(200e-9, 1e-10);
    assert!(refused(&simulator(
        steep.clone(),
        NoiseModel::None,
        400.0,
        16
    )));
    let thin_m = steep.clone().layer_thickness_m(limits(0.0)).unwrap();
    let thin = line(340.0, 430.0, thin_m, |_| 1.0);
    assert!(
        current(&simulator(steep, NoiseModel::None, 400.0, 16), &thin, 1)
            .unwrap()
            .iter()
            .all(|i| *i != 0.0)
    );
}

#[test]
fn velocities_beyond_the_sampled_band_appear_where_they_fold_to() {
    // The current shows frequencies from 0 to F_s/2: -34.9 to 62.0 m/s; beyond, they
    // are folded back.
    for (velocity_m_s, shown_m_s) in [(25.0, 25.0), (63.0, 61.0), (100.0, 24.0), (-36.0, -33.75)] {
        // The strongest frequency of a tone in the sampled current.
        let target = LineOfSight {
            first_range_m: 404.0,
            ..line(0.0, 0.7, 0.6, |_| velocity_m_s)
        };
        let long = simulator(
            gaussian(1e-6),
            NoiseModel::None,
            404.0 - 128.0 * STEP_M,
            256,
        );
        let record = current(&long, &target, 3).unwrap();
        let power = |velocity_m_s: f64| {
            let frequency = (80e6 - 2.0 * velocity_m_s / WAVELENGTH_M) / 250e6;
            let term = |(k, i): (usize, &f64)| i * Complex::cis(-2.0 * PI * frequency * k as f64);
            record
                .iter()
                .enumerate()
                .map(term)
                .sum::<Complex<f64>>()
                .norm_sqr()
        };
        let grid = (-348..=620).map(|i| 0.1 * f64::from(i));
        let peak = grid.max_by(|a, b| power(*a).total_cmp(&power(*b))).unwrap();
        assert!(
            (peak - shown_m_s).abs() < 0.15,
            "{velocity_m_s} m/s appears at {peak}"
        );
    }
}

#[test]
fn signals_40_db_below_and_60_db_above_the_noise_are_added_to_it_exactly() {
    let noisy = simulator(gaussian(200e-9), NoiseModel::BandLimited, 400.0, 64);
    let bare = simulator(gaussian(200e-9), NoiseModel::None, 400.0, 64);
    let unit = receiver(NoiseModel::None).slowly_varying_snr(150e-6, 1.0);
    for snr_db in [-40.0, 60.0] {
        let mut air = line(330.0, 520.0, STEP_M, |_| 5.0);
        air.weight_per_m.fill(10f64.powf(0.1 * snr_db) / unit);
        let mut snr = [0.0; 64];
        noisy
            .snr_into(&air, &mut Scratch::default(), &mut snr)
            .unwrap();
        assert!(snr.iter().all(|s| (10.0 * s.log10() - snr_db).abs() < 1e-4));
        let silent = LineOfSight {
            weight_per_m: vec![0.0; air.layers()],
            ..air.clone()
        };
        let (sum, noise) = (
            current(&noisy, &air, 5).unwrap(),
            current(&noisy, &silent, 5).unwrap(),
        );
        let signal = current(&bare, &air, 5).unwrap();
        let largest = sum.iter().fold(0.0_f64, |m, i| m.max(i.abs()));
        for k in 0..64 {
            assert!((sum[k] - noise[k] - signal[k]).abs() < 1e-14 * largest);
        }
        let ratio = |part: &[f64]| part.iter().map(|i| i * i).sum::<f64>();
        let found_db = 10.0 * (ratio(&signal) / ratio(&noise)).log10();
        assert!((found_db - snr_db).abs() < 8.0, "one record: {found_db} dB");
    }
}

#[test]
fn a_line_that_leaves_the_domain_is_silent_beyond_it() {
    let simulator = simulator(gaussian(200e-9), NoiseModel::None, 400.0, 300);
    // The flow is known up to 450 m only; the last samples see 580 m.
    let air = line(
        330.0,
        700.0,
        STEP_M,
        |r| if r > 450.0 { f64::NAN } else { 5.0 },
    );
    let record = current(&simulator, &air, 2).unwrap();
    assert!(record[..80].iter().all(|i| *i != 0.0));
    // More than 3.72 sigma (67 m) beyond the end nothing returns.
    assert!(record[200..].iter().all(|i| *i == 0.0));
    let mut out = [0.0; 2];
    let filter = RangeFilter::pulse(gaussian(200e-9), STEP_M).unwrap();
    filter
        .apply_into(
            air.first_range_m,
            &air.radial_velocity_m_s,
            &[430.0, 520.0],
            &mut out,
        )
        .unwrap();
    assert!((out[0] - 5.0).abs() < 1e-12 && out[1].is_nan());
}

#[test]
fn returns_of_1e_minus_200_and_1e200_scale_as_they_should_and_more_is_an_overflow() {
    let simulator = simulator(gaussian(200e-9), NoiseModel::None, 400.0, 32);
    let air = |weight_per_m: f64| {
        let mut air = line(330.0, 500.0, STEP_M, |_| 5.0);
        air.weight_per_m.fill(weight_per_m);
        air
    };
    let unit = current(&simulator, &air(1.0), 7).unwrap();
    let mut power = [0.0; 32];
    for exponent in [-200, 200] {
        let scale = 10f64.powi(exponent);
        let record = current(&simulator, &air(scale), 7).unwrap();
        for (found, expected) in record.iter().zip(&unit) {
            assert_relative_eq!(*found, expected * scale.sqrt(), max_relative = 1e-9);
        }
        simulator
            .mean_power_into(&air(scale), &mut Scratch::default(), &mut power)
            .unwrap();
        let expected = receiver(NoiseModel::None).heterodyne_gain_a2_w() * 150e-6 * scale * 0.5 * C;
        assert_relative_eq!(power[3], expected, max_relative = 1e-6);
    }
    let strong = Receiver {
        local_oscillator_w: 1e200,
        ..receiver(NoiseModel::None)
    };
    let record = Record {
        time_of_first_sample_s: 2.0 * 400.0 / C,
        samples: 32,
    };
    let beyond = Simulator::new(gaussian(200e-9), strong, record).unwrap();
    let overflow = beyond.mean_power_into(&air(1e200), &mut Scratch::default(), &mut power);
    assert!(matches!(
        overflow,
        Err(Error::Overflow {
            field: "out_a2",
            index: 0
        })
    ));
    let beyond = Simulator::new(
        gaussian(200e-9),
        Receiver {
            local_oscillator_w: 1e308,
            ..strong
        },
        record,
    )
    .unwrap();
    let huge = LineOfSight {
        weight_per_m: vec![f64::MAX; 284],
        ..air(1.0)
    };
    let outcome = current(&beyond, &huge, 7);
    assert!(
        matches!(
            outcome,
            Err(Error::Overflow { .. } | Error::LengthMismatch { .. })
        ),
        "{outcome:?}"
    );
}

#[test]
fn factors_of_a_shot_that_are_no_efficiencies_are_refused() {
    let simulator = simulator(gaussian(200e-9), NoiseModel::None, 400.0, 8);
    let air = line(330.0, 500.0, STEP_M, |_| 5.0);
    let run = |efficiency: &[f64]| {
        let shot = Shot {
            efficiency: Some(efficiency),
            ..Shot::from(&air)
        };
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        simulator.record_into(shot, &mut rng, &mut Scratch::default(), &mut [0.0; 8])
    };
    let mut factors = vec![1.0; air.layers()];
    assert_eq!(run(&factors), Ok(()));
    assert!(matches!(
        run(&factors[1..]),
        Err(Error::LengthMismatch {
            field: "efficiency",
            ..
        })
    ));
    for bad in [-0.1, f64::NAN, f64::INFINITY] {
        factors[4] = bad;
        assert!(matches!(
            run(&factors),
            Err(Error::ElementOutOfRange {
                field: "efficiency",
                index: 4,
                ..
            })
        ));
    }
}
