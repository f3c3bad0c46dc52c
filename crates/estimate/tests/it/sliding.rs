//! The sliding correlogram against the sum written out: missing samples, bursts, steps, complex samples.

use crate::fixtures::{correlogram_by_sum, noise};
use num_complex::Complex;
use wakescope_estimate::{Radius, Scan, estimators::*, polar_points, spectrum::*, window::*};

/// Largest difference to the sum written out over lag 0, and the windows seen.
fn worst<S: Sample>(record: &[S], step: usize, valid: &dyn Fn(usize) -> bool) -> (f64, Vec<usize>) {
    let (n, lags) = (64, 17);
    let statistic = ShortCorrelogram::<S>::new(n, lags).unwrap();
    let (mut largest, mut seen) = (0.0_f64, vec![]);
    statistic.evaluate_record(
        record,
        0,
        step,
        valid,
        &mut Scratch::new(),
        &mut |gate, found| {
            let direct = correlogram_by_sum(&record[gate * step..gate * step + n], &[1.0; 64]);
            for (found, direct_lag) in found.iter().zip(&direct) {
                largest = largest.max((found - direct_lag).abs() / direct[0]);
            }
            seen.push(gate);
        },
    );
    (largest, seen)
}

#[test]
fn sliding_sums_are_the_direct_ones_for_every_step_real_and_complex() {
    let real = noise(3000, 1);
    let complex: Vec<_> = real
        .chunks(2)
        .map(|pair| Complex::new(pair[0], pair[1]))
        .collect();
    for step in [1, 2, 5, 32, 33, 64, 100] {
        let (error, seen) = worst(&real, step, &|_| true);
        assert!(error < 1e-12, "{step}: {error}");
        assert_eq!(seen.len(), (3000 - 64) / step + 1);
        let (error, seen) = worst(&complex, step, &|_| true);
        assert!(error < 1e-12, "{step}: {error}");
        assert_eq!(seen.len(), (1500 - 64) / step + 1);
    }
    assert!(worst(&real[..63], 1, &|_| true).1.is_empty());
}

#[test]
fn a_missing_sample_spoils_its_windows_only() {
    let mut record = noise(800, 2);
    record[300] = f64::NAN;
    let valid = |gate: usize| !(237..=300).contains(&gate);
    let (error, seen) = worst(&record, 1, &valid);
    assert!(error < 1e-12 && seen.len() == 737 - 64, "{error}");
}

/// All windows of a record without the samples of `bad`, each with its number and its bits.
fn windows_without<S: Sample>(record: &[S], step: usize, bad: &[usize]) -> Vec<(usize, Vec<u64>)> {
    let statistic = ShortCorrelogram::<S>::new(64, 17).unwrap();
    let (mut seen, valid) = (vec![], |gate: usize| {
        !bad.iter()
            .any(|b| (gate * step..gate * step + 64).contains(b))
    });
    statistic.evaluate_record(
        record,
        0,
        step,
        &valid,
        &mut Scratch::new(),
        &mut |gate, found| {
            seen.push((gate, found.iter().map(|value| value.to_bits()).collect()));
        },
    );
    seen
}

#[test]
fn samples_of_any_size_leave_every_bit_of_the_windows_without_them() {
    let clean = noise(900, 3);
    let complex: Vec<_> = clean
        .chunks(2)
        .map(|pair| Complex::new(pair[0], pair[1]))
        .collect();
    for value in [1e308, -9999.0, 9.97e36, f64::NAN, f64::INFINITY, 1e4] {
        for bad in [vec![200], (200..240).collect(), vec![0, 63, 130, 131, 449]] {
            for step in [1, 7, 40] {
                let mut record = clean.clone();
                bad.iter().for_each(|&k| record[k] = value);
                assert_eq!(
                    windows_without(&record, step, &bad),
                    windows_without(&clean, step, &bad),
                    "{value} {step}"
                );
                let mut record = complex.clone();
                bad.iter().for_each(|&k| record[k].im = value);
                assert_eq!(
                    windows_without(&record, step, &bad),
                    windows_without(&complex, step, &bad),
                    "{value} {step}"
                );
            }
        }
    }
}

#[test]
fn a_burst_costs_its_neighbours_no_digit() {
    let mut record = noise(2000, 3);
    record[100..140].iter_mut().for_each(|x| *x *= 1e10);
    let (error, seen) = worst(&record, 1, &|_| true);
    assert!(error < 1e-14 && seen.len() == 2000 - 63, "{error}");
}

#[test]
fn a_scan_of_short_correlograms_maps_like_one_of_all_lags() {
    let sampling = Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap();
    let gates = Gates::new(64, 1, 2e-6).unwrap();
    let mut records = ndarray::Array2::from_shape_vec((4, 500), noise(2000, 4)).unwrap();
    records[[2, 250]] = f64::NAN;
    let elevation_rad = [0.0, 0.003, 0.006, 0.009];
    let all = Correlogram::<f64>::new(Weighting::Rectangular, 64).unwrap();
    let short = ShortCorrelogram::<f64>::new(64, 17).unwrap();
    let scans = (
        Scan::new(&all, &sampling, &gates, &elevation_rad, records.view()).unwrap(),
        Scan::new(&short, &sampling, &gates, &elevation_rad, records.view()).unwrap(),
    );
    let ca = |lags| {
        ModelPeak::new(
            &sampling,
            SignalKind::Real,
            lags,
            16,
            2048,
            Refinement::Parabola,
        )
        .unwrap()
    };
    let points = polar_points(&elevation_rad, &scans.0.geometry().gate_ranges_m());
    let radius = Radius::Fixed { radius_m: 2.5 };
    let maps = (
        scans.0.map(&points, &radius, None, &ca(64)).unwrap(),
        scans.1.map(&points, &radius, None, &ca(17)).unwrap(),
    );
    for (a, b) in maps.0.iter().zip(&maps.1) {
        assert_eq!((a.level, a.estimate.flag), (b.level, b.estimate.flag));
        let difference_m_s = (a.estimate.velocity_m_s - b.estimate.velocity_m_s).abs();
        assert!(
            difference_m_s < 1e-7 || a.estimate.velocity_m_s.is_nan(),
            "{difference_m_s}"
        );
    }
    assert!(
        ShortCorrelogram::<f64>::new(64, 65).is_err()
            && ShortCorrelogram::<f64>::new(64, 0).is_err()
    );
}
