//! Accumulation against the plain mean of the windows, its invariances, and missing samples.

use crate::fixtures::{correlogram_by_sum, table_2};
use approx::assert_abs_diff_eq;
use ndarray::{Array2, Axis, s};
use num_complex::Complex;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::{Error, estimators::*, map::*, spectrum::*, window::*};

const SAMPLES: usize = 400;

fn elevations_rad() -> Vec<f64> {
    // unordered, with two pulses at 12 mrad
    vec![0.012, 0.0, 0.003, 0.006, 0.009, 0.012, 0.015, 0.018]
}

fn noise_records(seed: u64) -> Array2<f64> {
    let rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let samples: Vec<f64> = StandardNormal.sample_iter(rng).take(8 * SAMPLES).collect();
    Array2::from_shape_vec((8, SAMPLES), samples).unwrap()
}

fn gates() -> Gates {
    Gates::new(64, 1, 2e-6).unwrap()
}

fn plan() -> PeriodogramPlan<f64> {
    PeriodogramPlan::new(&table_2(), 64).unwrap()
}

fn scan(records: &Array2<f64>, elevation_rad: &[f64]) -> Scan {
    Scan::new(
        &plan().statistic,
        &table_2(),
        &gates(),
        elevation_rad,
        records.view(),
    )
    .unwrap()
}

/// Mean correlogram and number of the valid windows near a point, window by window.
fn plain_mean(records: &Array2<f64>, point: PolarPoint, radius_m: f64) -> (Vec<f64>, usize) {
    let LineOfSight::Elevation(elevation_rad) = point.line else {
        panic!("{point:?} has no elevation");
    };
    let weights = Weighting::default().weights(64).unwrap();
    let (mut mean, mut level) = (vec![0.0; 64], 0);
    for (ray, angle_rad) in elevations_rad().iter().enumerate() {
        for (gate, range_m) in gates()
            .ranges_m(SAMPLES, &table_2())
            .unwrap()
            .iter()
            .enumerate()
        {
            let (a, b) = (
                Complex::from_polar(*range_m, *angle_rad),
                Complex::from_polar(point.range_m, elevation_rad),
            );
            let window = records.slice(s![ray, gate..gate + 64]).to_vec();
            if (a - b).norm() > radius_m || !window.iter().all(|x| x.is_finite()) {
                continue;
            }
            // the running mean of Table 3
            for (i, r) in mean.iter_mut().zip(correlogram_by_sum(&window, &weights)) {
                *i = (level as f64 * *i + r) / (level as f64 + 1.0);
            }
            level += 1;
        }
    }
    (mean, level)
}

#[test]
fn region_mean_is_the_running_mean_of_table_3() {
    let mut records = noise_records(1);
    records[[3, 100]] = f64::NAN;
    records[[0, 230]] = f64::INFINITY;
    let scan = scan(&records, &elevations_rad());
    let mut mean = vec![0.0; 64];
    for (range_m, elevation_rad, radius_m) in [
        (340.0, 0.009, 2.5),
        (400.0, 0.011, 4.0),
        (450.0, 0.0, 1.0),
        (430.0, 0.02, 30.0),
    ] {
        let point = PolarPoint::at_elevation(range_m, elevation_rad);
        let (expected, level) = plain_mean(&records, point, radius_m);
        assert!(level > 0);
        assert_eq!(scan.region_mean(point, radius_m, &mut mean).unwrap(), level);
        for (found, expected) in mean.iter().zip(&expected) {
            let unit = scan.scale().powi(2);
            assert_abs_diff_eq!(found * unit, *expected, epsilon = 1e-12);
        }
    }
}

#[test]
fn order_of_rays_does_not_matter() {
    let records = noise_records(2);
    let forward = scan(&records, &elevations_rad());
    let order = [7, 3, 5, 1, 0, 2, 6, 4];
    let shuffled = records.select(Axis(0), &order);
    let angles_rad: Vec<f64> = order.iter().map(|&ray| elevations_rad()[ray]).collect();
    let other = scan(&shuffled, &angles_rad);
    let point = PolarPoint::at_elevation(400.0, 0.01);
    let (mut a, mut b) = (vec![0.0; 64], vec![0.0; 64]);
    assert_eq!(
        forward.region_mean(point, 5.0, &mut a).unwrap(),
        other.region_mean(point, 5.0, &mut b).unwrap()
    );
    for (a, b) in a.iter().zip(&b) {
        assert_abs_diff_eq!(a, b, epsilon = 1e-13);
    }
}

#[test]
fn records_that_come_in_pieces_give_the_same_bits() {
    let mut records = noise_records(12);
    // louder and louder, and one sample is missing
    records.row_mut(4).mapv_inplace(|x| 5.0 * x);
    records.row_mut(7).mapv_inplace(|x| 3e4 * x);
    records[[5, 200]] = f64::NAN;
    let (statistic, point) = (plan().statistic, PolarPoint::at_elevation(400.0, 0.01));
    let correlation = WindowCorrelation::from_gate_lags(&[1.0, 0.9, 0.7, 0.4]).unwrap();
    let lines_rad = [0.0, 0.004, 0.01, 0.013];
    let rays_rad: Vec<f64> = lines_rad.iter().flat_map(|&el| [el, el]).collect();
    let numbers = |scan: &Scan| {
        let mut mean = vec![0.0; 64];
        let level = scan.region_mean(point, 5.0, &mut mean).unwrap();
        let unit = scan.scale().powi(2);
        let bits: Vec<u64> = mean.iter().map(|m| (m * unit).to_bits()).collect();
        (bits, level, scan.n_eff(point, 5.0, &correlation).to_bits())
    };
    let whole = numbers(&scan(&records, &rays_rad));
    for piece in [1, 2, 3, 5, 8] {
        let geometry = ScanGeometry::regular(&table_2(), &gates(), &lines_rad, 2, SAMPLES).unwrap();
        let mut sums = ScanSums::new(&statistic, &gates(), geometry, SAMPLES).unwrap();
        for (index, rays) in records.axis_chunks_iter(Axis(0), piece).enumerate() {
            sums.add(piece * index, rays).unwrap();
        }
        assert_eq!(numbers(&sums.finish()), whole, "pieces of {piece}");
    }
    let falling = ScanGeometry::regular(&table_2(), &gates(), &[0.1, 0.1], 2, SAMPLES).unwrap_err();
    assert!(falling.to_string().contains("increasing"), "{falling}");
}

#[test]
fn sums_of_some_gates_have_the_bits_of_whole_records() {
    let mut records = noise_records(13);
    records[[5, 200]] = f64::NAN;
    let largest = records
        .iter()
        .fold(0.0_f64, |largest, sample| largest.max(sample.abs()));
    let correlation = WindowCorrelation::from_gate_lags(&[1.0, 0.9, 0.7, 0.4]).unwrap();
    let of = |statistic: &dyn Statistic<f64>,
              step: usize,
              radius_m: f64,
              held: std::ops::Range<usize>| {
        let gates = Gates {
            step_samples: step,
            ..gates()
        };
        let geometry = ScanGeometry::new(&table_2(), &gates, &elevations_rad(), SAMPLES).unwrap();
        let part = records.slice(s![.., gates.samples(&held)]).to_owned();
        let mut sums = ScanSums::of_gates(statistic, &gates, geometry, held)
            .unwrap()
            .scaled_for(largest);
        sums.add(0, part.view()).unwrap();
        let scan = sums.finish();
        let point = PolarPoint::at_elevation(400.0, 0.01);
        let mut mean = vec![0.0; statistic.statistic_len()];
        let level = scan.region_mean(point, radius_m, &mut mean).unwrap();
        let bits: Vec<u64> = mean.iter().map(|m| m.to_bits()).collect();
        (
            bits,
            level,
            scan.n_eff(point, radius_m, &correlation).to_bits(),
        )
    };
    let (whole, short) = (plan().statistic, ShortCorrelogram::new(64, 17).unwrap());
    for statistic in [&whole as &dyn Statistic<f64>, &short] {
        for step in [1, 3, 30] {
            let gates = Gates {
                step_samples: step,
                ..gates()
            };
            let geometry =
                ScanGeometry::new(&table_2(), &gates, &elevations_rad(), SAMPLES).unwrap();
            for radius_m in [0.5, 4.0, 14.0] {
                let whole = of(statistic, step, radius_m, 0..geometry.gates());
                let near = geometry.gates_between(400.0 - radius_m, 400.0 + radius_m);
                for held in [
                    near.clone(),
                    near.start.saturating_sub(5)..near.end,
                    near.start..geometry.gates(),
                ] {
                    assert_eq!(
                        of(statistic, step, radius_m, held),
                        whole,
                        "{step} {radius_m}"
                    );
                }
            }
        }
    }
    let geometry = ScanGeometry::new(&table_2(), &gates(), &elevations_rad(), SAMPLES).unwrap();
    assert!(ScanSums::<f64, _>::of_gates(&short, &gates(), geometry, 330..338).is_err());
}

fn points() -> Vec<PolarPoint> {
    let ranges_m: Vec<f64> = (0..40).map(|i| 330.0 + 3.0 * i as f64).collect();
    polar_points(&[0.001, 0.008, 0.0125], &ranges_m)
}

#[cfg(feature = "rayon")]
#[test]
fn map_has_the_same_bits_with_any_number_of_threads() {
    let records = noise_records(3);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let scan = scan(&records, &elevations_rad());
            scan.map(
                &points(),
                &Radius::Fixed { radius_m: 2.0 },
                None,
                &plan().estimator,
            )
            .unwrap()
        })
    };
    let one = run(1);
    for threads in [2, 3, 7] {
        for (a, b) in one.iter().zip(run(threads)) {
            assert_eq!(
                a.estimate.velocity_m_s.to_bits(),
                b.estimate.velocity_m_s.to_bits()
            );
            assert_eq!(a.estimate.power.to_bits(), b.estimate.power.to_bits());
            assert_eq!(a.level, b.level);
        }
    }
}

/// Records of a wind of 4 m/s at all ranges, in noise of equal power in the band.
fn uniform_wind() -> Array2<f64> {
    let turn = std::f64::consts::TAU * table_2().frequency_hz(4.0) / 250e6;
    let mut records = noise_records(4);
    for ((ray, n), sample) in records.indexed_iter_mut() {
        *sample += 2.0 * (turn * n as f64 + ray as f64).cos();
    }
    records
}

#[test]
fn uniform_wind_maps_to_itself_whatever_the_radius_and_a_missing_sample() {
    let mut records = uniform_wind();
    let whole = scan(&records, &elevations_rad());
    records[[4, 200]] = f64::NAN;
    let holed = scan(&records, &elevations_rad());
    let varying = Radius::OfRange(Box::new(|range_m| 0.005 * range_m));
    for radius in [Radius::Fixed { radius_m: 1.5 }, varying] {
        let full = whole
            .map(&points(), &radius, None, &plan().estimator)
            .unwrap();
        let less = holed
            .map(&points(), &radius, None, &plan().estimator)
            .unwrap();
        let mut missing = 0;
        for (full, less) in full.iter().zip(&less).filter(|(full, _)| full.level > 0) {
            assert!((less.estimate.velocity_m_s - 4.0).abs() < 1.0 || less.level == 0);
            assert!(less.level <= full.level);
            missing += full.level - less.level;
            if full.level == less.level {
                assert_abs_diff_eq!(
                    full.estimate.velocity_m_s,
                    less.estimate.velocity_m_s,
                    epsilon = 1e-6
                );
            }
        }
        assert!(missing > 0);
    }
}

/// Maps of regions of 7 m and of single windows, with the all-lag and the sliding correlogram.
fn maps<S: Sample>(records: &Array2<S>) -> Vec<MapPoint> {
    let elevation_rad = elevations_rad();
    let sampling = match S::KIND {
        SignalKind::Real => table_2(),
        SignalKind::Complex => Sampling::baseband(250e6, 1.55e-6, 50e6).unwrap(),
    };
    let whole = PeriodogramPlan::<S>::new(&sampling, 64).unwrap();
    let short = ShortCorrelogram::<S>::new(64, 17).unwrap();
    let model = ModelPeak::new(&sampling, S::KIND, 17, 16, 512, Refinement::Parabola).unwrap();
    let scans: [(Scan, &dyn Estimator); 2] = [
        (
            Scan::new(
                &whole.statistic,
                &sampling,
                &gates(),
                &elevation_rad,
                records.view(),
            )
            .unwrap(),
            &whole.estimator,
        ),
        (
            Scan::new(&short, &sampling, &gates(), &elevation_rad, records.view()).unwrap(),
            &model,
        ),
    ];
    let map = |radius_m: f64| {
        let radius = Radius::Fixed { radius_m };
        scans
            .iter()
            .flat_map(|(scan, estimator)| scan.map(&points(), &radius, None, *estimator).unwrap())
            .collect()
    };
    let (mut all, wide): (Vec<MapPoint>, Vec<MapPoint>) = (map(0.7), map(7.0));
    all.extend(wide);
    all
}

/// Regions without a bad sample have the bits of the clean record, those with nothing else have no velocity.
fn assert_only_their_own_windows(clean: &[MapPoint], holed: &[MapPoint], what: &str) {
    let (mut touched, mut empty) = (0, 0);
    for (clean, holed) in clean.iter().zip(holed) {
        assert_eq!(holed.level + holed.left_out, clean.level, "{what}");
        if holed.left_out == 0 {
            let bits = |point: &MapPoint| {
                let e = &point.estimate;
                [e.velocity_m_s, e.quality, e.snr, e.spread_m2_s2, e.power].map(f64::to_bits)
            };
            assert_eq!(bits(clean), bits(holed), "{what}");
            assert_eq!(clean.estimate.flag, holed.estimate.flag, "{what}");
        } else {
            touched += 1;
            if holed.level == 0 {
                empty += 1;
                assert!(
                    holed.estimate.flag == Quality::Empty && holed.estimate.velocity_m_s.is_nan(),
                    "{what}"
                );
            }
        }
    }
    assert!(
        touched > empty && empty > 0 && touched < clean.len(),
        "{what}: {touched} {empty} {}",
        clean.len()
    );
}

#[test]
fn fill_values_and_huge_samples_are_left_out_counted_and_leave_every_bit_of_the_other_windows() {
    // currents of a microampere, at a small scale that squares must not lose beside 1e308
    let real = uniform_wind().mapv(|sample| 1e-6 * sample);
    let complex = real.mapv(|sample| Complex::new(sample, 0.3 * sample));
    let (clean, clean_complex) = (maps(&real), maps(&complex));
    let sections = [s![1..2, 170..171], s![1..3, 150..260]];
    for value in [
        1e308,
        -9999.0,
        9.97e36,
        9.969_209_968_386_869e36,
        f64::NAN,
        f64::INFINITY,
    ] {
        for (kind, section) in ["single", "block"].iter().zip(sections) {
            let mut holed = real.clone();
            holed.slice_mut(section).fill(value);
            assert_only_their_own_windows(&clean, &maps(&holed), &format!("{value:e}, {kind}"));
            let mut holed = complex.clone();
            holed
                .slice_mut(section)
                .mapv_inplace(|sample| Complex::new(sample.re, value));
            assert_only_their_own_windows(
                &clean_complex,
                &maps(&holed),
                &format!("complex {value:e}, {kind}"),
            );
        }
    }
}

#[test]
fn regions_without_windows_are_empty_and_say_so() {
    let scan = scan(&uniform_wind(), &elevations_rad());
    let correlation = WindowCorrelation::from_gate_lags(&[1.0, 0.9, 0.5]).unwrap();
    let far = [
        PolarPoint::at_elevation(5000.0, 0.01),
        PolarPoint::at_elevation(400.0, -0.5),
        PolarPoint::at_elevation(400.0, 0.0105),
    ];
    let radius = Radius::Fixed { radius_m: 0.1 };
    for found in scan
        .map(&far, &radius, Some(&correlation), &plan().estimator)
        .unwrap()
    {
        assert_eq!(
            (found.level, found.estimate.flag, found.n_eff),
            (0, Quality::Empty, 0.0)
        );
        assert!(found.estimate.velocity_m_s.is_nan());
    }
}

#[test]
fn n_eff_counts_pulses_and_leaves_out_what_is_missing() {
    let mut records = uniform_wind();
    let identical = WindowCorrelation::from_gate_lags(&[1.0; 400]).unwrap();
    let range_m = gates().range_m(150, &table_2());
    let point = PolarPoint::at_elevation(range_m, 0.012);
    // two pulses of the line of sight at 12 mrad, 3 windows each, fully correlated within a pulse
    let radius_m = 0.7;
    let both = scan(&records, &elevations_rad());
    assert_abs_diff_eq!(
        both.n_eff(point, radius_m, &identical),
        2.0,
        epsilon = 1e-12
    );
    // the first sample of the first of the three windows of one pulse: 2 windows of it remain
    records[[5, 149]] = f64::NAN;
    let fewer = scan(&records, &elevations_rad());
    assert_abs_diff_eq!(
        fewer.n_eff(point, radius_m, &identical),
        25.0 / 13.0,
        epsilon = 1e-12
    );
    let estimator = plan().estimator;
    let map = fewer
        .map(&[point], &Radius::Fixed { radius_m }, None, &estimator)
        .unwrap();
    assert_eq!(map[0].level, 5);
    assert!(map[0].n_eff.is_nan());
}

#[test]
fn extreme_amplitudes_map_like_ordinary_ones() {
    let records = uniform_wind();
    let radius = Radius::Fixed { radius_m: 2.0 };
    let reference = scan(&records, &elevations_rad())
        .map(&points(), &radius, None, &plan().estimator)
        .unwrap();
    for factor in [2.0_f64.powi(-660), 2.0_f64.powi(660)] {
        let found = scan(&(&records * factor), &elevations_rad())
            .map(&points(), &radius, None, &plan().estimator)
            .unwrap();
        for (a, b) in reference.iter().zip(&found) {
            assert_eq!(
                a.estimate.velocity_m_s.to_bits(),
                b.estimate.velocity_m_s.to_bits()
            );
            assert_eq!(a.estimate.flag, b.estimate.flag);
        }
    }
}

#[test]
fn mismatched_inputs_are_refused() {
    let records = noise_records(6);
    let statistic = plan().statistic;
    let new = |gates: Gates, angles_rad: &[f64]| {
        Scan::new(&statistic, &table_2(), &gates, angles_rad, records.view()).map(|_| ())
    };
    assert!(matches!(new(gates(), &[0.0]), Err(Error::Length { .. })));
    assert!(matches!(
        new(Gates::new(32, 1, 0.0).unwrap(), &elevations_rad()),
        Err(Error::Length { .. })
    ));
    let long = Correlogram::<f64>::new(Weighting::Hann, 500).unwrap();
    let refused = Scan::new(
        &long,
        &table_2(),
        &Gates::new(500, 1, 0.0).unwrap(),
        &elevations_rad(),
        records.view(),
    );
    assert!(matches!(
        refused.map(|_| ()),
        Err(Error::WindowLongerThanRecord {
            window_samples: 500,
            record_samples: 400
        })
    ));
    let scan = scan(&records, &elevations_rad());
    for radius_m in [f64::NAN, -1.0] {
        let radius = Radius::Fixed { radius_m };
        assert!(
            scan.map(&points(), &radius, None, &plan().estimator)
                .is_err()
        );
    }
}

/// An estimator of another crate: a statistic of two numbers and the velocity from their ratio.
struct LagOnePhase;

impl Statistic<Complex<f64>> for LagOnePhase {
    fn window_samples(&self) -> usize {
        64
    }
    fn statistic_len(&self) -> usize {
        2
    }
    fn evaluate(&self, window: &[Complex<f64>], _: &mut Scratch, out: &mut [f64]) {
        let lag: Complex<f64> = window.windows(2).map(|pair| pair[1] * pair[0].conj()).sum();
        out.copy_from_slice(&[lag.re, lag.im]);
    }
}

impl Estimator for LagOnePhase {
    fn statistic_len(&self) -> usize {
        2
    }
    fn estimate(&self, mean: &[f64], _: &mut Scratch) -> GateVelocity {
        let frequency_hz = mean[1].atan2(mean[0]) / std::f64::consts::TAU * 250e6;
        GateVelocity {
            velocity_m_s: -0.5 * 1.55e-6 * frequency_hz,
            power: mean[0].hypot(mean[1]),
            quality: 1.0,
            ..GateVelocity::none(Quality::Good)
        }
    }
}

#[test]
fn estimators_of_others_plug_in() {
    let baseband = Sampling::baseband(250e6, 1.55e-6, 50e6).unwrap();
    let turn = std::f64::consts::TAU * baseband.frequency_hz(-6.0) / 250e6;
    let records = Array2::from_shape_fn((8, SAMPLES), |(ray, n)| {
        Complex::from_polar(1.0, turn * n as f64 + ray as f64)
    });
    let scan = Scan::new(
        &LagOnePhase,
        &baseband,
        &gates(),
        &elevations_rad(),
        records.view(),
    )
    .unwrap();
    let map = scan
        .map(
            &points(),
            &Radius::Fixed { radius_m: 3.0 },
            None,
            &LagOnePhase,
        )
        .unwrap();
    for point in map.iter().filter(|point| point.level > 0) {
        assert_abs_diff_eq!(point.estimate.velocity_m_s, -6.0, epsilon = 1e-9);
    }
}

#[test]
fn automatic_radius_is_the_smallest_that_reaches_the_target() {
    let elevation_rad: Vec<f64> = (0..101).map(|i| 1.25e-3 * f64::from(i)).collect();
    let geometry = ScanGeometry::new(&table_2(), &gates(), &elevation_rad, 1000).unwrap();
    // one window: 0.69 m/s near the lidar, more with the range; long chords tell more than the root of their gates
    let by_gates = |range_m: f64| -> Vec<f64> {
        (1..=100)
            .map(|gates| (0.69 * range_m / 400.0).powi(-2) * f64::from(gates).powf(1.2))
            .collect()
    };
    let target_m_s = 0.2;
    let ranges_m = [380.0, 450.0, 600.0, 800.0];
    let information = |range_m: f64, radius_m: f64| -> Result<f64, Error> {
        let point = PolarPoint::at_elevation(range_m, elevation_rad[50]);
        Ok(geometry.information(point, radius_m, [&by_gates(range_m)])[0])
    };
    let std_m_s =
        |range_m: f64, radius_m: f64| information(range_m, radius_m).unwrap().sqrt().recip();
    let radius = Radius::for_standard_deviation(&ranges_m, information, target_m_s, 20.0).unwrap();
    let mut before_m = 0.0;
    for range_m in ranges_m {
        let radius_m = radius.at_m(range_m).unwrap();
        // Steps of a thousandth of the largest radius.
        assert!(
            std_m_s(range_m, radius_m) <= target_m_s
                && std_m_s(range_m, radius_m - 0.02) > target_m_s,
            "{range_m}: {radius_m}"
        );
        assert!(radius_m > before_m);
        before_m = radius_m;
    }
    // elsewhere that of the nearest range
    for (range_m, nearest_m) in [
        (100.0, 380.0),
        (524.0, 450.0),
        (526.0, 600.0),
        (900.0, 800.0),
    ] {
        assert_eq!(
            radius.at_m(range_m).unwrap(),
            radius.at_m(nearest_m).unwrap()
        );
    }
    // out of reach: the largest
    let modest = Radius::for_standard_deviation(&ranges_m, information, 1e-3, 5.0).unwrap();
    assert_eq!(modest.at_m(600.0).unwrap(), 5.0);
    for (ranges_m, target_m_s, largest_m) in [
        (ranges_m.to_vec(), 0.0, 5.0),
        (ranges_m.to_vec(), 0.2, 0.0),
        (vec![], 0.2, 5.0),
        (vec![400.0, 300.0], 0.2, 5.0),
    ] {
        let refused = Radius::for_standard_deviation(&ranges_m, information, target_m_s, largest_m);
        assert!(refused.is_err(), "{ranges_m:?} {target_m_s} {largest_m}");
    }
}

/// Products of the samples of two lines with four rays each, `[line][sample, lag]`.
fn products_of<S: Sample>(records: &Array2<S>, lags: usize) -> Vec<Array2<S>> {
    let mut lines = Vec::new();
    for rays in records.axis_chunks_iter(Axis(0), 4) {
        lines.push(Array2::from_shape_fn((SAMPLES, lags), |(k, lag)| {
            let mut sum = Complex::new(0.0, 0.0);
            for record in rays.rows() {
                if k + lag < SAMPLES {
                    sum += record[k + lag].to_complex() * record[k].to_complex().conj();
                }
            }
            S::from_complex(sum)
        }));
    }
    lines
}

/// The largest difference of the means of regions from records and from their products.
fn products_deviation<S: Sample>(statistic: &dyn Statistic<S>, records: &Array2<S>) -> f64 {
    let geometry = || {
        let lines_rad = [0.0, 0.01];
        ScanGeometry::regular(&table_2(), &gates(), &lines_rad, 4, SAMPLES).unwrap()
    };
    let mut of_records = ScanSums::new(statistic, &gates(), geometry(), SAMPLES).unwrap();
    of_records.add(0, records.view()).unwrap();
    let of_records = of_records.finish();
    let mut of_products = ScanSums::new(statistic, &gates(), geometry(), SAMPLES).unwrap();
    for (line, products) in products_of(records, 70).iter().enumerate() {
        of_products
            .add_products(line, std::slice::from_ref(products))
            .unwrap();
    }
    let of_products = of_products.finish();
    let mut means = [(); 2].map(|()| vec![0.0; statistic.statistic_len()]);
    let mut largest = 0.0_f64;
    for (range_m, radius_m) in [(340.0, 0.4), (400.0, 5.0), (430.0, 30.0)] {
        let point = PolarPoint::at_elevation(range_m, 0.008);
        let levels = [&of_records, &of_products]
            .into_iter()
            .zip(&mut means)
            .map(|(scan, mean)| scan.region_mean(point, radius_m, mean).unwrap());
        let levels: Vec<usize> = levels.collect();
        assert_eq!(levels[0], levels[1]);
        for (a, b) in means[0].iter().zip(&means[1]) {
            let error = a * of_records.scale().powi(2) - b * of_products.scale().powi(2);
            largest = largest.max(error.abs());
        }
    }
    largest
}

#[test]
fn sums_of_products_give_what_their_records_give() {
    let real = noise_records(21);
    let imaginary = noise_records(22);
    let both = ndarray::Zip::from(&real)
        .and(&imaginary)
        .map_collect(|re, im| Complex::new(*re, *im));
    let tapers = vec![
        Taper::unit(Weighting::default().weights(64).unwrap()).unwrap(),
        Taper::unit((0..64).map(|k| f64::from(k) - 31.5).collect()).unwrap(),
    ];
    let deviations = [
        products_deviation(
            &Correlogram::<f64>::with_tapers(tapers.clone()).unwrap(),
            &real,
        ),
        products_deviation(&ShortCorrelogram::<f64>::new(64, 17).unwrap(), &real),
        products_deviation(
            &Correlogram::<Complex<f64>>::with_tapers(tapers).unwrap(),
            &both,
        ),
        products_deviation(
            &ShortCorrelogram::<Complex<f64>>::new(64, 17).unwrap(),
            &both,
        ),
    ];
    assert!(deviations.iter().all(|d| *d < 1e-12), "{deviations:?}");
}

#[test]
fn products_that_do_not_fit_are_refused() {
    let statistic = plan().statistic;
    let geometry = ScanGeometry::regular(&table_2(), &gates(), &[0.0], 4, SAMPLES).unwrap();
    let mut sums = ScanSums::new(&statistic, &gates(), geometry, SAMPLES).unwrap();
    let few_lags = sums.add_products(0, &[Array2::zeros((SAMPLES, 63))]);
    assert!(
        few_lags
            .unwrap_err()
            .to_string()
            .contains("lags of the products")
    );
    assert!(
        sums.add_products(0, &[Array2::zeros((SAMPLES - 1, 64))])
            .is_err()
    );
    let too_many = vec![Array2::zeros((SAMPLES, 64)); 2];
    assert!(sums.add_products(0, &too_many).is_err());
    sums.add(0, Array2::ones((1, SAMPLES)).view()).unwrap();
    let after_records = sums.add_products(0, &[Array2::zeros((SAMPLES, 64))]);
    assert!(
        after_records
            .unwrap_err()
            .to_string()
            .contains("sum of records")
    );
}

#[test]
fn records_are_not_added_to_products() {
    let statistic = plan().statistic;
    let geometry = ScanGeometry::regular(&table_2(), &gates(), &[0.0], 4, SAMPLES).unwrap();
    let mut sums = ScanSums::new(&statistic, &gates(), geometry, SAMPLES).unwrap();
    sums.add_products(0, &[Array2::ones((SAMPLES, 64))])
        .unwrap();
    let refused = sums.add(0, Array2::ones((1, SAMPLES)).view()).unwrap_err();
    assert!(refused.to_string().contains("not to products"), "{refused}");
}
