//! The bound against a stored curve, a closed form and difference quotients.

use crate::fixtures::{baseband, sigma_s, table_2};
use approx::assert_relative_eq;
use ndarray::Array2;
use num_complex::Complex;
use wakescope_estimate::{Error, Gates, Sampling, SignalKind, bound::*};

#[test]
fn bound_of_a_200_ns_pulse_is_the_stored_curve_from_minus_40_to_60_db() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/reference/signal/crlb_200ns.csv"
    );
    let text = std::fs::read_to_string(path).unwrap();
    let model =
        |sigma_s: f64| WindowModel::gaussian_pulse(&table_2(), 64, sigma_s, Noise::White).unwrap();
    let columns = [
        (model(sigma_s(200e-9)), SignalKind::Complex),
        (model(sigma_s(200e-9)), SignalKind::Real),
        (model(100e-9), SignalKind::Complex),
        (model(200e-9), SignalKind::Complex),
    ];
    let mut rows = 0;
    for line in text
        .lines()
        .filter(|line| line.starts_with(|c: char| c == '-' || c.is_ascii_digit()))
    {
        let fields: Vec<f64> = line
            .split(',')
            .map(|field| field.parse().unwrap())
            .collect();
        let snr = 10.0_f64.powf(fields[0] / 10.0);
        for ((model, kind), expected_m_s) in columns.iter().zip(&fields[1..]) {
            let found_m_s = model.bound_m_s(0.0, snr, *kind, 1.0).unwrap();
            // the curve is printed with 8 digits
            let digit = 10.0_f64.powf(expected_m_s.log10().floor() - 7.0);
            let error = (found_m_s - expected_m_s).abs();
            assert!(
                error <= 1e-8 * expected_m_s + 0.5 * digit,
                "{} dB {kind:?}: {found_m_s} {expected_m_s}",
                fields[0]
            );
        }
        rows += 1;
    }
    assert_eq!(rows, 41);
}

#[test]
fn independent_windows_lower_the_bound_by_the_root_of_their_number() {
    let model = WindowModel::gaussian_pulse(&table_2(), 64, sigma_s(200e-9), Noise::White).unwrap();
    for kind in [SignalKind::Real, SignalKind::Complex] {
        let one_m_s = model.bound_m_s(1.0, 3.0, kind, 1.0).unwrap();
        let many_m_s = model.bound_m_s(1.0, 3.0, kind, 7.5).unwrap();
        assert_relative_eq!(many_m_s, one_m_s / 7.5_f64.sqrt(), max_relative = 1e-13);
    }
}

#[test]
fn complex_bound_does_not_depend_on_velocity_and_the_real_one_hardly() {
    let model = WindowModel::gaussian_pulse(&table_2(), 64, sigma_s(200e-9), Noise::White).unwrap();
    let at = |velocity_m_s: f64, kind| model.bound_m_s(velocity_m_s, 10.0, kind, 1.0).unwrap();
    for velocity_m_s in [-15.0, 3.0, 18.0] {
        assert_relative_eq!(
            at(velocity_m_s, SignalKind::Complex),
            at(0.0, SignalKind::Complex),
            max_relative = 1e-9
        );
        assert_relative_eq!(
            at(velocity_m_s, SignalKind::Real),
            at(0.0, SignalKind::Real),
            max_relative = 1e-2
        );
    }
}

#[test]
fn band_noise_lowers_the_bound_by_one_to_eleven_percent() {
    for full_width_s in [200e-9, 400e-9] {
        for snr in [0.1, 1.0, 10.0, 100.0] {
            let at = |noise| {
                WindowModel::gaussian_pulse(&table_2(), 64, sigma_s(full_width_s), noise)
                    .unwrap()
                    .bound_m_s(0.0, snr, SignalKind::Real, 1.0)
                    .unwrap()
            };
            let ratio = at(Noise::Band { floor: 0.01 }) / at(Noise::White);
            assert!((0.85..0.999).contains(&ratio), "{snr}: {ratio}");
            assert_relative_eq!(
                at(Noise::Band { floor: 1.0 }),
                at(Noise::White),
                max_relative = 1e-9
            );
        }
    }
}

/// The bound at 0 dB for a 200 ns pulse, 64 samples and noise with that floor outside the band.
fn with_floor(floor: f64, kind: SignalKind) -> Result<f64, Error> {
    let sampling = if kind == SignalKind::Real {
        table_2()
    } else {
        Sampling::baseband(250e6, 1.55e-6, 50e6).unwrap()
    };
    WindowModel::gaussian_pulse(&sampling, 64, sigma_s(200e-9), Noise::Band { floor })
        .unwrap()
        .bound_m_s(0.0, 1.0, kind, 1.0)
}

#[test]
fn bounds_with_little_noise_outside_the_band_are_right_or_refused() {
    // m/s, from 60 digits
    for (floor, real_m_s, complex_m_s, tolerance) in [
        (1e-3, 0.652_089_14, 0.645_980_71, 1e-8),
        (1e-6, 0.619_951_18, 0.609_384_74, 1e-8),
        (1e-10, 0.586_767_90, 0.570_439_77, 1e-6),
        (1e-11, 0.580_261_27, 0.561_124_03, 1e-4),
        (1e-12, 0.571_493_87, 0.555_028_63, 1e-5),
        (1e-13, 0.565_604_60, 0.545_804_69, 1e-5),
    ] {
        for (kind, expected_m_s) in [
            (SignalKind::Real, real_m_s),
            (SignalKind::Complex, complex_m_s),
        ] {
            assert_relative_eq!(
                with_floor(floor, kind).unwrap(),
                expected_m_s,
                max_relative = tolerance
            );
        }
    }
    for kind in [SignalKind::Real, SignalKind::Complex] {
        for refused in [1e-15, 0.0] {
            let error = with_floor(refused, kind).unwrap_err();
            let Error::NoiseFloor {
                floor,
                window_samples: 64,
                least,
                ..
            } = error
            else {
                panic!("{kind:?} {refused}: {error}");
            };
            assert!(
                floor == refused && (1e-15..1e-13).contains(&least),
                "{error}"
            );
            assert!(
                error.to_string().contains(&format!("floor = {refused:?}")),
                "{error}"
            );
            // the bound goes on falling slowly
            assert_relative_eq!(
                with_floor(least, kind).unwrap(),
                with_floor(1e-11, kind).unwrap(),
                max_relative = 0.05
            );
            assert!(
                matches!(with_floor(0.5 * least, kind), Err(Error::NoiseFloor { .. })),
                "{error}"
            );
        }
    }
}

#[test]
fn noise_that_is_too_small_everywhere_is_refused() {
    let white = WindowModel::gaussian_pulse(&table_2(), 64, sigma_s(200e-9), Noise::White).unwrap();
    let at = |snr| white.bound_m_s(0.0, snr, SignalKind::Complex, 1.0).unwrap();
    assert!(at(1e6) > 0.0 && at(1e6) < at(1e3));
    let refused = white.bound_m_s(0.0, 1e16, SignalKind::Complex, 1.0);
    assert!(
        matches!(refused, Err(Error::IllConditioned { order: 64, .. })),
        "{refused:?}"
    );
}

#[test]
fn point_target_bound_is_its_closed_form() {
    // R = u u^H + q I: information per (m/s)^2 = 2 gain^2 / (1 + gain) * spread * (4 pi / lambda)^2, with gain = |u|^2 / q and
    // spread the variance of time weighted by |u|^2
    let amplitude: Vec<f64> = (0..64)
        .map(|n| (-((n as f64 - 20.0) / 17.0).powi(2)).exp())
        .collect();
    let model = WindowModel::point_target(&table_2(), &amplitude, Noise::White).unwrap();
    let energy: f64 = amplitude.iter().map(|a| a * a).sum();
    let moment = |p: i32| {
        amplitude
            .iter()
            .enumerate()
            .map(|(n, a)| a * a * (n as f64 / 250e6).powi(p))
            .sum::<f64>()
            / energy
    };
    let spread = moment(2) - moment(1).powi(2);
    for snr in [0.1, 1.0, 100.0] {
        let gain = 64.0 * snr * 50e6 / 250e6;
        let wave = 4.0 * std::f64::consts::PI / 1.55e-6;
        let expected_m_s = (2.0 * gain * gain / (1.0 + gain) * spread * wave * wave)
            .sqrt()
            .recip();
        let found_m_s = model.bound_m_s(2.0, snr, SignalKind::Complex, 1.0).unwrap();
        assert_relative_eq!(found_m_s, expected_m_s, max_relative = 1e-9);
    }
}

#[test]
fn derivative_of_the_covariance_is_its_difference_quotient_with_sign() {
    let model =
        WindowModel::gaussian_pulse(&table_2(), 16, sigma_s(200e-9), Noise::Band { floor: 0.1 })
            .unwrap();
    for kind in [SignalKind::Real, SignalKind::Complex] {
        let at = |velocity_m_s: f64| model.covariance(velocity_m_s, 2.0, kind).unwrap();
        let [_, derivative] = at(3.0);
        let quotient = (&at(3.001)[0] - &at(2.999)[0]).mapv(|value| value / 0.002);
        for (a, b) in derivative.iter().zip(&quotient) {
            assert!((a - b).norm() < 1e-6);
        }
    }
    // v > 0 lowers the frequency: the phase between neighbouring samples falls with v
    let complex = WindowModel::gaussian_pulse(&table_2(), 2, 1.0, Noise::White).unwrap();
    let phase = |velocity_m_s: f64| {
        complex
            .covariance(velocity_m_s, 1.0, SignalKind::Complex)
            .unwrap()[0][[1, 0]]
        .arg()
    };
    assert_relative_eq!(
        phase(1.0) - phase(0.0),
        -std::f64::consts::TAU * 2.0 / 1.55e-6 / 250e6,
        max_relative = 1e-9
    );
}

#[test]
fn noise_power_in_the_band_follows_from_the_snr() {
    // white: (250/50)/SNR for complex, (125/50)/SNR for real samples; band: 1/SNR for both
    let power = |noise, kind| {
        let model = WindowModel::gaussian_pulse(&table_2(), 8, 1e-7, noise).unwrap();
        let [covariance, _] = model.covariance(0.0, 4.0, kind).unwrap();
        covariance[[3, 3]].re - 1.0
    };
    assert_relative_eq!(
        power(Noise::White, SignalKind::Complex),
        1.25,
        max_relative = 1e-12
    );
    assert_relative_eq!(
        power(Noise::White, SignalKind::Real),
        0.625,
        max_relative = 1e-12
    );
    for kind in [SignalKind::Real, SignalKind::Complex] {
        assert_relative_eq!(
            power(Noise::Band { floor: 0.0 }, kind),
            0.25,
            max_relative = 1e-12
        );
    }
}

#[test]
fn any_covariance_is_accepted_and_impossible_ones_are_refused() {
    let identity = Array2::<Complex<f64>>::eye(3);
    let zero = Array2::<Complex<f64>>::zeros((3, 3));
    // nothing depends on velocity
    let [complex, real] = [SignalKind::Complex, SignalKind::Real];
    assert!(bound_m_s(complex, &identity, &zero, 1.0).is_err());
    // singular
    assert!(bound_m_s(complex, &zero, &identity, 1.0).is_err());
    // scale: R = I, dR = s I gives 1 / (s sqrt(n))
    let scaled = identity.mapv(|value| value * 2.0);
    let found_m_s = |kind| bound_m_s(kind, &identity, &scaled, 1.0).unwrap();
    assert_relative_eq!(
        found_m_s(complex),
        1.0 / 12.0_f64.sqrt(),
        max_relative = 1e-14
    );
    assert_relative_eq!(found_m_s(real), 1.0 / 6.0_f64.sqrt(), max_relative = 1e-14);
    assert!(bound_m_s(real, &identity, &identity, 0.0).is_err());
    let mut skew = identity.clone();
    skew[[0, 1]] = Complex::from(0.5);
    assert!(bound_m_s(real, &skew, &identity, 1.0).is_err());
    let sampling = table_2();
    assert!(WindowModel::gaussian_pulse(&sampling, 0, 1e-7, Noise::White).is_err());
    assert!(WindowModel::gaussian_pulse(&sampling, 8, f64::NAN, Noise::White).is_err());
    assert!(WindowModel::gaussian_pulse(&sampling, 8, 1e-7, Noise::Band { floor: 2.0 }).is_err());
    assert!(WindowModel::point_target(&sampling, &[0.0; 4], Noise::White).is_err());
    let model = WindowModel::gaussian_pulse(&sampling, 8, 1e-7, Noise::White).unwrap();
    assert!(model.bound_m_s(0.0, 0.0, SignalKind::Real, 1.0).is_err());
}

/// The bound from 1, 2, .. windows of `window` samples in a row, `step` apart, m/s.
fn rows_m_s(
    (sampling, kind): (&Sampling, SignalKind),
    sigma_s: f64,
    noise: Noise,
    (window, step, count): (usize, usize, usize),
    snr: f64,
) -> Vec<f64> {
    let lag = |m: usize| m as f64 * sampling.period_s() / sigma_s;
    let correlation = (0..2000)
        .map(|m| Complex::from((-0.25 * lag(m).powi(2)).exp()))
        .collect();
    let model = RecordModel::new(sampling, kind, noise, correlation, true).unwrap();
    let gates = Gates::new(window, step, 0.0).unwrap();
    model
        .information(&gates, count, |_| snr)
        .unwrap()
        .into_iter()
        .map(|x| x.sqrt().recip())
        .collect()
}

#[test]
fn bound_of_windows_in_a_row_is_that_of_the_samples_that_they_cover() {
    for (sampling, kind) in [
        (table_2(), SignalKind::Real),
        (baseband(), SignalKind::Complex),
    ] {
        for (noise, snr) in [
            (Noise::White, 10.0),
            (Noise::White, 0.01),
            (Noise::Band { floor: 1e-6 }, 0.3),
            (Noise::Band { floor: 1e-4 }, 100.0),
        ] {
            for (sigma_s, (window, step, count)) in [
                (sigma_s(400e-9), (16, 1, 100)),
                (sigma_s(100e-9), (16, 5, 12)),
                (sigma_s(200e-9), (64, 1, 7)),
            ] {
                let found_m_s = rows_m_s(
                    (&sampling, kind),
                    sigma_s,
                    noise,
                    (window, step, count),
                    snr,
                );
                assert_eq!(found_m_s.len(), count);
                for windows in [1, count / 2, count] {
                    let samples = window + (windows - 1) * step;
                    let whole =
                        WindowModel::gaussian_pulse(&sampling, samples, sigma_s, noise).unwrap();
                    let expected_m_s = whole.bound_m_s(0.0, snr, kind, 1.0).unwrap();
                    // Rounding is magnified by the condition of the covariance.
                    assert_relative_eq!(found_m_s[windows - 1], expected_m_s, max_relative = 1e-5);
                }
            }
        }
    }
}

/// Correlation of a pulse with two spectral lines of different powers at a lag in samples.
fn two_lines(lag: i64) -> Complex<f64> {
    let lag = lag as f64;
    (Complex::from_polar(0.3, 0.15 * lag) + 0.7) * (-(lag / 40.0).powi(2)).exp()
}

#[test]
fn an_asymmetric_spectrum_lowers_the_bound_of_records_as_that_of_windows() {
    // Of one window in white noise at a ratio of 2: numpy.
    for (sampling, kind, one_m_s) in [
        (table_2(), SignalKind::Real, 3.161_157_845),
        (baseband(), SignalKind::Complex, 3.145_512_019),
    ] {
        for noise in [Noise::White, Noise::Band { floor: 1e-4 }] {
            let correlation = (0..400).map(two_lines).collect();
            let record = RecordModel::new(&sampling, kind, noise, correlation, false).unwrap();
            let gates = Gates::new(16, 5, 0.0).unwrap();
            let found = record.information(&gates, 6, |_| 2.0).unwrap();
            for windows in [1, 3, 6] {
                let found_m_s = found[windows - 1].sqrt().recip();
                let samples = 16 + 5 * (windows - 1);
                let envelope = Array2::from_shape_fn((samples, samples), |(n, m)| {
                    two_lines(n as i64 - m as i64)
                });
                let real = envelope.mapv(|value| Complex::from(value.re));
                let bound_m_s = |envelope| {
                    WindowModel::with_envelope(&sampling, envelope, noise)
                        .unwrap()
                        .bound_m_s(0.0, 2.0, kind, 1.0)
                        .unwrap()
                };
                let whole_m_s = bound_m_s(envelope);
                assert_relative_eq!(found_m_s, whole_m_s, max_relative = 1e-6);
                let of_real_part_m_s = bound_m_s(real);
                assert!(found_m_s < 0.94 * of_real_part_m_s, "{found_m_s}");
                if windows == 1 && noise == Noise::White {
                    assert_relative_eq!(found_m_s, one_m_s, max_relative = 1e-8);
                }
            }
        }
    }
}

#[test]
fn records_far_longer_than_window_and_pulse_are_continued_and_gaps_tell_nothing() {
    let of = |window, noise, snr, count| {
        rows_m_s(
            (&baseband(), SignalKind::Complex),
            sigma_s(200e-9),
            noise,
            (window, 1, count),
            snr,
        )
    };
    for (noise, snr) in [
        (Noise::White, 0.1),
        (Noise::White, 1e3),
        (Noise::Band { floor: 1e-6 }, 1.0),
    ] {
        // 256 samples of the first are computed as a whole, all of the second.
        let (short, long) = (of(16, noise, snr, 400), of(410, noise, snr, 6));
        assert_relative_eq!(short[399], long[5], max_relative = 2e-3);
    }
    let apart = rows_m_s(
        (&baseband(), SignalKind::Complex),
        sigma_s(200e-9),
        Noise::White,
        (16, 400, 3),
        1.0,
    );
    assert_relative_eq!(apart[2] * 3.0_f64.sqrt(), apart[0], max_relative = 1e-6);
}

/// A pulse in air whose return grows by 30 dB from one layer to the next: the covariance of all layers is that of the model.
#[test]
fn bound_beside_a_cloud_is_that_of_the_sum_over_its_layers() {
    let (sampling, sigma) = (baseband(), 20.0);
    let snr_of_layer = |layer: i32| if layer > 4 { 1000.0 } else { 1.0 };
    let layers = -150..150_i32;
    let envelope = |samples: f64| {
        (-0.5 * (samples / sigma).powi(2)).exp() / (std::f64::consts::PI.sqrt() * sigma).sqrt()
    };
    let seen = |at: f64| {
        layers
            .clone()
            .map(|l| snr_of_layer(l) * envelope(at - f64::from(l)).powi(2))
            .sum()
    };
    let correlation = (0..200)
        .map(|m| Complex::from((-0.25 * (f64::from(m) / sigma).powi(2)).exp()))
        .collect();
    let model = RecordModel::new(
        &sampling,
        SignalKind::Complex,
        Noise::White,
        correlation,
        true,
    )
    .unwrap();
    let found = model
        .information(&Gates::new(20, 1, 0.0).unwrap(), 5, seen)
        .unwrap()[4];
    let signal = |n: usize, m: usize| -> f64 {
        let (a, b) = (n as f64 - 11.5, m as f64 - 11.5);
        layers
            .clone()
            .map(|l| snr_of_layer(l) * envelope(a - f64::from(l)) * envelope(b - f64::from(l)))
            .sum()
    };
    let slope = -4.0 * std::f64::consts::PI / (sampling.wavelength_m * sampling.sample_rate_hz);
    let whole = Array2::from_shape_fn((24, 24), |(n, m)| {
        Complex::from(signal(n, m) + if n == m { 5.0 } else { 0.0 })
    });
    let derivative = Array2::from_shape_fn((24, 24), |(n, m)| {
        Complex::new(0.0, slope * (n as f64 - m as f64) * signal(n, m))
    });
    let expected_m_s = bound_m_s(SignalKind::Complex, &whole, &derivative, 1.0).unwrap();
    assert_relative_eq!(found.sqrt().recip(), expected_m_s, max_relative = 1e-6);
}
