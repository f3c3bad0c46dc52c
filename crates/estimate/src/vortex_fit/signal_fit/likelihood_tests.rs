//! The likelihood against plain sums over layers, dense matrices, difference quotients and its own draws.

use super::*;
use crate::bound::Noise;
use crate::linalg;
use crate::vortex_fit::{CoreProfile, ScanSetup, Vortex, WakeModel, WindFit};
use crate::window::{SPEED_OF_LIGHT_M_S, Sampling, SignalKind};
use rand::{RngExt, SeedableRng};
use std::f64::consts::{PI, SQRT_2};

type C64 = Complex<f64>;

const SIGMA_S: f64 = 120e-9;

fn wake() -> Wake {
    let vortex = |lateral_position_m| Vortex {
        circulation_m2_s: 500.0,
        lateral_position_m,
        height_m: 47.0,
        core_radius_m: 2.35,
    };
    Wake {
        left: vortex(376.5),
        right: vortex(423.5),
        lateral_wind_m_s: 1.0,
        wind_shear_per_s: 0.01,
        log_wind_m_s: 0.0,
    }
}

/// Complex records of three rays, two of them along one line, through and beside the cores; 40 samples at 50 MHz.
fn setup(profile: CoreProfile) -> ScanSetup {
    ScanSetup {
        sampling: Sampling::baseband(50e6, 1.55e-6, 50e6).unwrap(),
        kind: SignalKind::Complex,
        noise: Noise::White,
        pulse_sigma_s: SIGMA_S,
        wake: WakeModel {
            profile,
            ..Default::default()
        },
        elevation_rad: vec![0.12, 0.118, 0.12],
        first_sample_time_s: 2.0 * 345.0 / SPEED_OF_LIGHT_M_S,
        record_samples: 40,
    }
}

fn snr(range_m: f64, _elevation_rad: f64) -> f64 {
    2.0 * (range_m / 400.0).powi(-2)
}

/// The covariance of (15), corrected, by a sum over layers of 5 cm.
fn plain_covariance(setup: &ScanSetup, wake: &Wake, elevation_rad: f64) -> Array2<C64> {
    let n = setup.record_samples;
    let time_s = |k: usize| setup.first_sample_time_s + k as f64 * setup.sampling.period_s();
    let pulse = |t_s: f64| (-0.5 * (t_s / SIGMA_S).powi(2)).exp() / (PI.sqrt() * SIGMA_S).sqrt();
    let thickness_m = 0.05;
    let mut sum = Array2::<C64>::eye(n);
    for layer in 0..6000 {
        let range_m = 250.0 + (f64::from(layer) + 0.5) * thickness_m;
        let velocity = setup.wake.radial_velocity_m_s(wake, range_m, elevation_rad);
        let weight = snr(range_m, elevation_rad) * thickness_m * 2.0 / SPEED_OF_LIGHT_M_S;
        let a: Vec<C64> = (0..n)
            .map(|k| {
                let f = pulse(time_s(k) - 2.0 * range_m / SPEED_OF_LIGHT_M_S);
                C64::from_polar(
                    f * weight.sqrt(),
                    -4.0 * PI * velocity / 1.55e-6 * time_s(k),
                )
            })
            .collect();
        for k in 0..n {
            for l in 0..n {
                sum[[k, l]] += a[k] * a[l].conj();
            }
        }
    }
    sum
}

fn draws(model: &ScanModel, setup: &ScanSetup, seed: u64) -> ScanSignals {
    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut records = Array2::zeros((setup.elevation_rad.len(), setup.record_samples));
    for mut row in records.rows_mut() {
        row.mapv_inplace(|_: C64| {
            let normal = |rng: &mut rand_xoshiro::Xoshiro256PlusPlus| {
                rng.sample::<f64, _>(rand_distr::StandardNormal)
            };
            C64::new(normal(&mut rng), normal(&mut rng))
        });
    }
    ScanSignals::new(model, records.view(), 0.7).unwrap()
}

#[test]
fn covariance_of_a_line_is_the_plain_sum_over_thin_layers() {
    for profile in [CoreProfile::Algebraic, CoreProfile::LambOseen] {
        let setup = setup(profile);
        let model = ScanModel::new(&setup, snr, &wake()).unwrap();
        assert_eq!((model.lines.len(), model.samples), (2, 40));
        for (line, elevation_rad) in model.lines.iter().zip([0.12, 0.118]) {
            let plain = plain_covariance(&setup, &wake(), elevation_rad);
            let mut space = Space::default();
            model.covariance_into(line, &wake(), Powers::default(), &mut space);
            let mut worst = 0.0_f64;
            for column in 0..40 {
                for down in 0..40 - column {
                    let place = space.factor.at(column, down);
                    let found = C64::new(space.factor.re[place], space.factor.im[place]);
                    let error = (found - plain[[column + down, column]]).norm();
                    worst = worst.max(error);
                }
            }
            // of a power of 3 to 4
            assert!(worst < 8e-4, "{profile:?}, {elevation_rad} rad: {worst}");
        }
    }
}

#[test]
fn gradient_is_the_difference_quotient_of_the_likelihood() {
    let setup = setup(CoreProfile::Algebraic);
    let model = ScanModel::new(&setup, snr, &wake()).unwrap();
    let signals = draws(&model, &setup, 5);
    let powers = Powers {
        log_signal: 0.2,
        log_noise: -0.1,
    };
    let value = model.log_likelihood(&signals, &wake(), powers).unwrap();
    for index in 0..PARAMETERS {
        let at = |by: f64| {
            let mut p = wake().to_array();
            p[index] += by;
            model
                .log_likelihood(&signals, &Wake::from_array(&p), powers)
                .unwrap()
                .log_likelihood
        };
        let h = [
            1e-2, 1e-2, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-4, 1e-6, 1e-4,
        ][index];
        let quotient = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
        let error = (value.by_wake[index] - quotient).abs();
        assert!(
            error < 1e-5 * quotient.abs() + 1e-6 / h,
            "{index}: {} {quotient}",
            value.by_wake[index]
        );
    }
    for (which, found) in value.by_powers.into_iter().enumerate() {
        let at = |by: f64| {
            let mut moved = powers;
            *(if which == 0 {
                &mut moved.log_signal
            } else {
                &mut moved.log_noise
            }) += by;
            model
                .log_likelihood(&signals, &wake(), moved)
                .unwrap()
                .log_likelihood
        };
        let quotient = (at(1e-4) - at(-1e-4)) / 2e-4;
        assert!(
            (found - quotient).abs() < 1e-5 * quotient.abs() + 1e-4,
            "{which}: {found} {quotient}"
        );
    }
}

#[test]
fn information_is_the_trace_of_dense_matrices() {
    let setup = setup(CoreProfile::Algebraic);
    let model = ScanModel::new(&setup, snr, &wake()).unwrap();
    let free = FreeParameters {
        wind: WindFit::Linear,
        ..FreeParameters::common_circulation()
    };
    let found = model
        .information(&wake(), Powers::default(), &free, true, 1)
        .unwrap();
    let groups = free.groups();
    let mut expected = Array2::<f64>::zeros(found.raw_dim());
    // the line at 0.12 rad has two rays
    for (elevation_rad, rays) in [(0.12, 2.0), (0.118, 1.0)] {
        let at =
            |p: &[f64; PARAMETERS]| plain_covariance(&setup, &Wake::from_array(p), elevation_rad);
        let middle = at(&wake().to_array());
        let mut changes: Vec<Array2<C64>> = Vec::new();
        for group in &groups {
            let h = if group[0] == 9 { 1e-5 } else { 1e-3 };
            let moved = |by: f64| {
                let mut p = wake().to_array();
                group.iter().for_each(|&place| p[place] += by);
                at(&p)
            };
            changes.push((moved(h) - moved(-h)).mapv(|v| v / (2.0 * h)));
        }
        let eye = Array2::<C64>::eye(40);
        changes.push(&middle - &eye);
        changes.push(eye);
        let inverse = linalg::inverse(middle.view());
        let solved: Vec<_> = changes.iter().map(|change| inverse.dot(change)).collect();
        for (i, a) in solved.iter().enumerate() {
            for (j, b) in solved.iter().enumerate() {
                let trace: C64 = a.indexed_iter().map(|((r, c), v)| v * b[[c, r]]).sum();
                expected[[i, j]] += rays * trace.re;
            }
        }
    }
    for ((i, j), value) in found.indexed_iter() {
        let size = (expected[[i, i]] * expected[[j, j]]).sqrt();
        assert!(
            (value - expected[[i, j]]).abs() < 2e-3 * size,
            "{i} {j}: {value} {}",
            expected[[i, j]]
        );
    }
    let strided = model
        .information(&wake(), Powers::default(), &free, true, 2)
        .unwrap();
    // the first line alone, weighted for all three rays
    assert!(strided[[0, 0]] > 0.0 && strided[[0, 0]] != found[[0, 0]]);
}

#[test]
fn covariance_of_the_gradient_over_draws_is_the_information() {
    let setup = setup(CoreProfile::Algebraic);
    let model = ScanModel::new(&setup, snr, &wake()).unwrap();
    let free = FreeParameters::common_circulation();
    let information = model
        .information(&wake(), Powers::default(), &free, false, 1)
        .unwrap();
    // samples of the model itself: z = L w
    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(17);
    let mut normal = || rng.sample::<f64, _>(rand_distr::StandardNormal) / SQRT_2;
    let factors: Vec<Banded> = model
        .lines
        .iter()
        .map(|line| {
            let mut space = Space::default();
            model.covariance_into(line, &wake(), Powers::default(), &mut space);
            factorize(&mut space.factor).unwrap();
            space.factor
        })
        .collect();
    let trials = 1500;
    let mut mean = 0.0;
    let mut square = 0.0;
    for _ in 0..trials {
        let rays = [0, 1, 0].map(|line: usize| {
            let factor = &factors[line];
            let w: Vec<C64> = (0..40).map(|_| C64::new(normal(), normal())).collect();
            let mut z = vec![C64::ZERO; 40];
            for column in 0..40 {
                for down in 0..=factor.width.min(39 - column) {
                    let place = factor.at(column, down);
                    z[column + down] += C64::new(factor.re[place], factor.im[place]) * w[column];
                }
            }
            Some(z)
        });
        let signals = ScanSignals {
            rays: rays.to_vec(),
        };
        let value = model
            .log_likelihood(&signals, &wake(), Powers::default())
            .unwrap();
        // score of the common circulation in units of its expected standard deviation
        let score = (value.by_wake[0] + value.by_wake[1]) / information[[0, 0]].sqrt();
        mean += score / f64::from(trials);
        square += score * score / f64::from(trials);
    }
    let root = f64::from(trials).sqrt();
    assert!(mean.abs() < 3.5 / root, "mean {mean}");
    // kurtosis of a sum of exponentials: allow twice the error of normal numbers
    assert!(
        (square - 1.0).abs() < 7.0 * SQRT_2 / root,
        "variance {square}"
    );
}

#[test]
fn rays_with_missing_samples_are_left_out_and_impossible_input_is_refused() {
    let setup = setup(CoreProfile::Algebraic);
    let model = ScanModel::new(&setup, snr, &wake()).unwrap();
    let mut records = Array2::from_elem((3, 40), C64::new(1.0, 0.5));
    records[[1, 7]] = C64::new(f64::NAN, 0.0);
    let signals = ScanSignals::new(&model, records.view(), 1.0).unwrap();
    assert_eq!(signals.used_rays(), 2);
    assert!(
        model
            .log_likelihood(&signals, &wake(), Powers::default())
            .is_some()
    );
    let mut coreless = wake();
    coreless.left.core_radius_m = -1.0;
    assert!(
        model
            .log_likelihood(&signals, &coreless, Powers::default())
            .is_none()
    );
    records.fill(C64::new(f64::INFINITY, 0.0));
    assert!(matches!(
        ScanSignals::new(&model, records.view(), 1.0),
        Err(Error::Empty { .. })
    ));
    assert!(matches!(
        ScanSignals::new(&model, records.view(), 0.0),
        Err(Error::OutOfRange { .. })
    ));
    assert!(matches!(
        ScanModel::new(&setup, |_, _| 0.0, &wake()),
        Err(Error::OutOfRange { .. })
    ));
    assert!(matches!(
        ScanModel::new(&setup, |_, _| f64::NAN, &wake()),
        Err(Error::OutOfRange { field: "snr", .. })
    ));
    let no_pulse = ScanSetup {
        pulse_sigma_s: 0.0,
        ..setup.clone()
    };
    assert!(matches!(
        ScanModel::new(&no_pulse, snr, &wake()),
        Err(Error::OutOfRange {
            field: "pulse_sigma_s",
            ..
        })
    ));
    let rayless = ScanSetup {
        elevation_rad: vec![],
        ..setup
    };
    assert!(matches!(
        ScanModel::new(&rayless, snr, &wake()),
        Err(Error::Empty { .. })
    ));
}
