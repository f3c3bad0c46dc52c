//! The sliding correlogram against the sum written out: drift, missing samples, bursts, steps, complex samples.

#![allow(clippy::unwrap_used)]

use num_complex::Complex;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::*;

fn noise(count: usize, seed: u64) -> Vec<f64> {
    let rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    StandardNormal.sample_iter(rng).take(count).collect()
}

/// Largest difference to the sum written out over lag 0, and the windows seen.
fn worst<S: Sample>(record: &[S], step: usize, valid: &dyn Fn(usize) -> bool) -> (f64, Vec<usize>) {
    let (n, lags) = (64, 17);
    let statistic = ShortCorrelogram::<S>::new(n, lags).unwrap();
    let (mut largest, mut seen) = (0.0_f64, vec![]);
    statistic.evaluate_record(record, step, valid, &mut Scratch::new(), &mut |gate, found| {
        let direct = correlogram_by_sum(&record[gate * step..gate * step + n], &[1.0; 64]);
        for (found, direct_lag) in found.iter().zip(&direct) {
            largest = largest.max((found - direct_lag).abs() / direct[0]);
        }
        seen.push(gate);
    });
    (largest, seen)
}

#[test]
fn sliding_sums_are_the_direct_ones_for_every_step_real_and_complex() {
    let real = noise(3000, 1);
    let complex: Vec<_> = real.chunks(2).map(|pair| Complex::new(pair[0], pair[1])).collect();
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

#[test]
fn rounding_of_a_burst_is_gone_after_256_windows() {
    let mut record = noise(2000, 3);
    record[100..140].iter_mut().for_each(|x| *x *= 1e4);
    // windows 0..255 start together, those from 256 on are formed anew and have not seen the burst
    let statistic = ShortCorrelogram::<f64>::new(64, 17).unwrap();
    statistic.evaluate_record(&record, 1, &|_| true, &mut Scratch::new(), &mut |gate, found| {
        let direct = correlogram_by_sum(&record[gate..gate + 64], &[1.0; 64]);
        let error = (found[0] - direct[0]).abs() / direct[0];
        let allowed = if (37..256).contains(&gate) { 1e-6 } else { 1e-12 };
        assert!(error < allowed, "{gate}: {error}");
    });
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
    let ca = |lags| AutoregressivePeak::new(&sampling, SignalKind::Real, lags, 16, 2048, Refinement::Parabola).unwrap();
    let points = polar_points(&elevation_rad, &scans.0.geometry().gate_ranges_m());
    let radius = Radius::Fixed { radius_m: 2.5 };
    let maps =
        (scans.0.map(&points, &radius, None, &ca(64)).unwrap(), scans.1.map(&points, &radius, None, &ca(17)).unwrap());
    for (a, b) in maps.0.iter().zip(&maps.1) {
        assert_eq!((a.level, a.estimate.flag), (b.level, b.estimate.flag));
        let difference_m_s = (a.estimate.velocity_m_s - b.estimate.velocity_m_s).abs();
        assert!(difference_m_s < 1e-7 || a.estimate.velocity_m_s.is_nan(), "{difference_m_s}");
    }
    assert!(ShortCorrelogram::<f64>::new(64, 65).is_err() && ShortCorrelogram::<f64>::new(64, 0).is_err());
}
