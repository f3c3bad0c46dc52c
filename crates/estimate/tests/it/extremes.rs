//! Extreme cases: for each a typed outcome, never a panic and never a silent number.

use crate::draw::Wind;
use crate::fixtures::{baseband, noise, sigma_s, table_2, tone};
use ndarray::Array2;
use num_complex::Complex;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::{
    Error, Gates, Sampling, Scratch, SignalKind, Weighting, bound::*, estimators::*, map::*,
    models::*, spectrum::*, window::Sample,
};

type Named = (&'static str, Box<dyn Statistic<f64>>, Box<dyn Estimator>);

/// Every estimator with the statistic that it goes with, for real windows of 64 samples.
fn estimators() -> Vec<Named> {
    let (s, kind, refinement) = (&table_2(), SignalKind::Real, Refinement::Parabola);
    let rectangular = || Box::new(Correlogram::<f64>::new(Weighting::Rectangular, 64).unwrap());
    let peak = SpectralPeak::new(s, kind, &unweighted_lags(64), 1024, refinement).unwrap();
    let (tapered, of_tapers) = likelihood::<f64>(table_2(), 200e-9, 10.0);
    let short = ShortCorrelogram::<f64>::new(64, 17).unwrap();
    vec![
        ("periodogram", rectangular(), Box::new(peak)),
        ("likelihood", Box::new(tapered), Box::new(of_tapers)),
        (
            "first moment",
            rectangular(),
            Box::new(FirstMoment::new(s, kind, &unweighted_lags(64), 512, 2.5).unwrap()),
        ),
        (
            "pulse pair",
            rectangular(),
            Box::new(PulsePair::new(s, kind, &unweighted_lags(64)).unwrap()),
        ),
        (
            "AR",
            Box::new(short),
            Box::new(ModelPeak::new(s, kind, 17, 16, 2048, refinement).unwrap()),
        ),
    ]
}

/// The likelihood of a pulse of that full width and signal-to-noise ratio, for windows of 64 samples.
fn likelihood<S: Sample>(
    s: Sampling,
    full_width_s: f64,
    snr: f64,
) -> (Correlogram<S>, SpectralPeak) {
    let sigma_s = sigma_s(full_width_s);
    let model = WindowModel::gaussian_pulse(&s, 64, sigma_s, Noise::White).unwrap();
    let tapers = likelihood_tapers(&model, snr).unwrap();
    let statistic = Correlogram::with_tapers(tapers).unwrap();
    let weights = statistic.lag_weights();
    let refinement = Refinement::Parabola;
    let peak = SpectralPeak::new(&s, S::KIND, &weights, 1024, refinement).unwrap();
    (statistic, peak)
}

/// One window through the accumulation, as any map has it.
fn single(statistic: &dyn Statistic<f64>, estimator: &dyn Estimator, window: &[f64]) -> MapPoint {
    let gates = Gates::new(window.len(), 1, 2e-6).unwrap();
    let records = Array2::from_shape_vec((1, window.len()), window.to_vec()).unwrap();
    let scan = Scan::new(statistic, &table_2(), &gates, &[0.0], records.view()).unwrap();
    let point = PolarPoint::at_elevation(scan.geometry().gate_ranges_m()[0], 0.0);
    scan.map(&[point], &Radius::Fixed { radius_m: 0.0 }, None, estimator)
        .unwrap()[0]
}

#[test]
fn zero_and_broken_signals_have_no_velocity_in_any_estimator() {
    let mut broken = tone(1.0, 0.4);
    broken[10] = f64::INFINITY;
    for (name, statistic, estimator) in estimators() {
        let found = single(statistic.as_ref(), estimator.as_ref(), &[0.0; 64]);
        assert_eq!(
            (found.estimate.flag, found.level),
            (Quality::NoSignal, 1),
            "{name}"
        );
        assert!(found.estimate.velocity_m_s.is_nan(), "{name}");
        let found = single(statistic.as_ref(), estimator.as_ref(), &broken);
        assert_eq!(
            (found.estimate.flag, found.level),
            (Quality::Empty, 0),
            "{name}"
        );
        assert!(found.estimate.velocity_m_s.is_nan(), "{name}");
        for number in [f64::NAN, f64::INFINITY] {
            let mean = vec![number; estimator.statistic_len()];
            assert_eq!(
                estimator.estimate(&mean, &mut Scratch::new()).flag,
                Quality::Invalid,
                "{name}"
            );
        }
    }
}

#[test]
fn constant_signals_are_no_good_in_any_estimator() {
    for (name, statistic, estimator) in estimators() {
        let found = single(statistic.as_ref(), estimator.as_ref(), &[3.0; 64]).estimate;
        assert_ne!(found.flag, Quality::Good, "{name}: {found:?}");
        if name != "likelihood" {
            assert_eq!(found.flag, Quality::NoSignal, "{name}: {found:?}");
        }
    }
}

#[test]
fn velocities_beyond_the_band_are_flagged_by_every_estimator() {
    let estimators = estimators();
    for velocity_m_s in [-28.0, 21.5, 25.0, 40.0, 100.0] {
        for (name, statistic, estimator) in &estimators {
            let found = single(
                statistic.as_ref(),
                estimator.as_ref(),
                &tone(velocity_m_s, 0.4),
            )
            .estimate;
            assert_eq!(
                found.flag,
                Quality::OutOfBand,
                "{name} {velocity_m_s}: {found:?}"
            );
        }
    }
}

#[test]
fn noise_free_tones_read_their_velocity_within_14_cm_s() {
    for (name, statistic, estimator) in estimators() {
        for velocity_m_s in [-14.0, -3.7, 0.0, 9.3] {
            let found = single(
                statistic.as_ref(),
                estimator.as_ref(),
                &tone(velocity_m_s, 0.4),
            )
            .estimate;
            let error_m_s = (found.velocity_m_s - velocity_m_s).abs();
            // a moment takes the sidelobes along that the edges of the band cut off; see the pulse pair
            let bar_m_s = if matches!(name, "pulse pair" | "first moment") {
                0.6
            } else {
                0.16
            };
            assert!(
                error_m_s < bar_m_s && found.is_good(),
                "{name} {velocity_m_s}: {found:?}"
            );
        }
    }
}

#[test]
fn amplitudes_of_1e_minus_200_and_1e200_change_nothing() {
    let window: Vec<f64> = tone(-4.0, 0.4)
        .iter()
        .zip(noise(64, 5))
        .map(|(s, n)| s + 0.3 * n)
        .collect();
    for (name, statistic, estimator) in estimators() {
        let reference = single(statistic.as_ref(), estimator.as_ref(), &window).estimate;
        assert!(reference.is_good(), "{name}");
        for factor in [1e-200, 1e200] {
            let scaled: Vec<f64> = window.iter().map(|x| x * factor).collect();
            let found = single(statistic.as_ref(), estimator.as_ref(), &scaled).estimate;
            assert!(
                (found.velocity_m_s - reference.velocity_m_s).abs() < 1e-9,
                "{name} {factor}"
            );
            assert!(
                (found.snr / reference.snr - 1.0).abs() < 1e-6 && found.flag == reference.flag,
                "{name}"
            );
        }
    }
}

#[test]
fn snr_of_minus_40_and_plus_60_db_give_finite_velocities_in_the_band() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
    for snr_db in [-40.0, 60.0] {
        let snr = 10.0_f64.powf(0.1 * snr_db);
        let wind = Wind::new(&table_2(), snr, Noise::White);
        for (name, statistic, estimator) in estimators() {
            let mut near = 0;
            for _ in 0..40 {
                let found = single(
                    statistic.as_ref(),
                    estimator.as_ref(),
                    &wind.real(5.0, &mut rng),
                )
                .estimate;
                assert!(
                    found.velocity_m_s.abs() < 19.6,
                    "{name} {snr_db}: {found:?}"
                );
                near += usize::from((found.velocity_m_s - 5.0).abs() < 3.0);
            }
            // at -40 dB a velocity within 3 m/s is chance: 6 of 40
            let expected = if snr_db > 0.0 { 37..=40 } else { 0..=18 };
            assert!(expected.contains(&near), "{name} {snr_db} dB: {near}");
        }
        // the likelihood's weights at any SNR
        let (statistic, peak) = likelihood(baseband(), 200e-9, snr);
        let turn = std::f64::consts::TAU * baseband().frequency_hz(5.0) * baseband().period_s();
        let line: Vec<_> = (0..64)
            .map(|n| Complex::from_polar(1.0, turn * f64::from(n)))
            .collect();
        let found = estimate_window(&statistic, &peak, &line, &mut Scratch::new()).unwrap();
        assert!(
            (found.velocity_m_s - 5.0).abs() < 0.5,
            "{snr_db} dB: {found:?}"
        );
    }
}

#[test]
fn pulses_much_longer_and_much_shorter_than_the_gate_keep_their_velocity() {
    for full_width_s in [10e-9, 5e-6] {
        let model =
            WindowModel::gaussian_pulse(&baseband(), 64, sigma_s(full_width_s), Noise::White)
                .unwrap();
        let (statistic, peak) = likelihood(baseband(), full_width_s, 10.0);
        let [covariance, _] = model.covariance(4.0, 10.0, SignalKind::Complex).unwrap();
        let windows = crate::draw::Windows::<Complex<f64>>::new(&covariance);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let (mut scratch, mut one) = (Scratch::new(), vec![0.0; statistic.statistic_len()]);
        let mut mean = one.clone();
        for _ in 0..200 {
            statistic.evaluate(&windows.draw(&mut rng), &mut scratch, &mut one);
            mean.iter_mut()
                .zip(&one)
                .for_each(|(sum, value)| *sum += value / 200.0);
        }
        let found = peak.estimate(&mean, &mut scratch);
        let bound_m_s = model
            .bound_m_s(4.0, 10.0, SignalKind::Complex, 200.0)
            .unwrap();
        assert!(
            (found.velocity_m_s - 4.0).abs() < 4.0 * bound_m_s + 0.02,
            "{full_width_s}: {found:?} {bound_m_s}"
        );
    }
}

#[test]
fn regions_cut_by_the_edge_of_the_sector_count_what_they_hold() {
    let records = Array2::from_shape_vec((5, 400), noise(2000, 3)).unwrap();
    let gates = Gates::new(64, 1, 2e-6).unwrap();
    let elevation_rad = [0.0, 0.002, 0.004, 0.006, 0.008];
    let statistic = ShortCorrelogram::<f64>::new(64, 17).unwrap();
    let scan = Scan::new(
        &statistic,
        &table_2(),
        &gates,
        &elevation_rad,
        records.view(),
    )
    .unwrap();
    let at = |elevation_rad| PolarPoint::at_elevation(400.0, elevation_rad);
    let mut mean = vec![0.0; 17];
    let inside = scan.region_mean(at(0.004), 1.3, &mut mean).unwrap();
    let edge = scan.region_mean(at(0.0), 1.3, &mut mean).unwrap();
    let outside = scan.region_mean(at(-0.002), 1.3, &mut mean).unwrap();
    assert!(
        outside > 0 && outside < edge && edge < inside,
        "{outside} {edge} {inside}"
    );
    let (level, n_eff) = scan.geometry().level(
        at(0.0),
        1.3,
        &WindowCorrelation::from_gate_lags(&[1.0, 0.9]).unwrap(),
    );
    assert!(level == edge && n_eff > 0.0 && n_eff < level as f64);
    // nothing at all: NaN and a count of 0
    let far = scan
        .map(&[at(1.0)], &Radius::Fixed { radius_m: 1.3 }, None, &LagOne)
        .unwrap()[0];
    assert!(
        far.level == 0 && far.estimate.flag == Quality::Empty && far.estimate.velocity_m_s.is_nan()
    );
}

/// Takes any mean of 17 numbers.
struct LagOne;

impl Estimator for LagOne {
    fn statistic_len(&self) -> usize {
        17
    }
    fn estimate(&self, mean: &[f64], _: &mut Scratch) -> GateVelocity {
        GateVelocity {
            velocity_m_s: mean[1],
            ..GateVelocity::none(Quality::Good)
        }
    }
}

#[test]
fn windows_longer_than_the_record_and_orders_as_long_as_the_window_are_errors() {
    let error = Gates::new(64, 1, 0.0).unwrap().count(63).unwrap_err();
    assert_eq!(
        error,
        Error::WindowLongerThanRecord {
            window_samples: 64,
            record_samples: 63
        }
    );
    let (kind, refinement) = (SignalKind::Real, Refinement::None);
    for order in [64, 65] {
        assert!(ModelPeak::new(&table_2(), kind, 64, order, 1024, refinement).is_err());
    }
    assert!(Autoregression::yule_walker(&[1.0; 16], kind, 16).is_err());
    assert!(FirstMoment::new(&table_2(), kind, &unweighted_lags(64), 512, 0.0).is_err());
}
