//! Products of samples drawn at once: the covariance of records against records, the moments of
//! the products against those of the Wishart distribution, both against sums over records.

use ndarray::Array2;
use num_complex::Complex;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_signal::{
    AccumulatedProducts, Error, LineOfSight, NoiseModel, Record, Sample, Scratch, Shot, Simulator,
};

use crate::setup::{C, STEP_M, core, gaussian, receiver, weighted_line};

const NOISES: [NoiseModel; 2] = [NoiseModel::BandLimited, NoiseModel::White];

/// Records across a vortex core; the signal is about as strong as the noise.
fn simulator(noise: NoiseModel, samples: usize) -> Simulator {
    let record = Record {
        time_of_first_sample_s: 2.0 * 410.0 / C,
        samples,
    };
    Simulator::for_baseband(gaussian(60e-9), receiver(noise), record).unwrap()
}

fn line(velocity_m_s: f64) -> LineOfSight {
    let weight = |range_m: f64| 2e-15 * (1.0 + 0.02 * (range_m - 420.0));
    weighted_line(
        370.0,
        470.0,
        0.25 * STEP_M,
        |r| core(r) + velocity_m_s,
        weight,
    )
}

/// The shot of a line with the echo of the pulse before.
fn with_echo<'a>(line: &'a LineOfSight, previous: &'a LineOfSight, seed: u64) -> Shot<'a> {
    Shot {
        previous: Some(previous),
        impairment_seed: seed,
        ..Shot::from(line)
    }
}

/// Deviations over standard errors of the mean products of `count` records from the covariance.
fn record_deviations<T: Sample>(noise: NoiseModel, count: u64) -> Vec<f64> {
    let samples = 40;
    let simulator = simulator(noise, samples);
    let (line, previous) = (line(0.0), line(-6.0));
    let expected: Array2<T> = simulator
        .record_covariance_a2(with_echo(&line, &previous, 0))
        .unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut scratch = Scratch::default();
    let mut record = vec![T::default(); samples];
    let mut sums = Array2::<T>::zeros((samples, samples));
    for seed in 0..count {
        let shot = with_echo(&line, &previous, seed);
        simulator
            .record_into(shot, &mut rng, &mut scratch, &mut record)
            .unwrap();
        for ((m, n), sum) in sums.indexed_iter_mut() {
            *sum = *sum + record[m] * record[n].conj();
        }
    }
    let mut deviations = Vec::new();
    for ((m, n), sum) in sums.indexed_iter() {
        let error = (*sum - expected[(m, n)] * number(count as f64)).abs();
        deviations.push(error / product_variance(&expected, count as f64, [m, n]).sqrt());
    }
    deviations
}

fn number<T: Sample>(value: f64) -> T {
    T::from(value).unwrap()
}

fn is_complex<T: 'static>() -> bool {
    std::any::TypeId::of::<T>() == std::any::TypeId::of::<Complex<f64>>()
}

/// Variance of a product summed over records: both parts of it, if it is complex.
fn product_variance<T: Sample>(covariance: &Array2<T>, records: f64, [m, n]: [usize; 2]) -> f64 {
    let powers = covariance[(m, m)].re() * covariance[(n, n)].re();
    let square = covariance[(m, n)].abs().powi(2);
    records
        * if is_complex::<T>() {
            powers
        } else {
            powers + square
        }
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn the_covariance_of_records_is_that_of_records() {
    for noise in NOISES {
        for deviations in [
            record_deviations::<f64>(noise, 4000),
            record_deviations::<Complex<f64>>(noise, 4000),
        ] {
            let largest = deviations.iter().copied().fold(0.0, f64::max);
            assert!(largest < 5.0, "{noise:?}: {largest}");
            let mean = root_mean_square(&deviations);
            assert!((mean - 1.0).abs() < 0.15, "{noise:?}: {mean}");
        }
    }
}

/// Moments of products over `draws` draws against those of the Wishart distribution: of each
/// element, and of random sums of the elements, whose variance holds all their covariances.
fn check_moments<T: Sample>(noise: NoiseModel, records: usize, draws: usize) {
    let samples = 24;
    let lags = samples;
    let simulator = simulator(noise, samples);
    let line = line(0.0);
    let covariance: Array2<T> = simulator.record_covariance_a2(&line).unwrap();
    let products = AccumulatedProducts::<T>::new(&simulator, &line).unwrap();
    let n = records as f64;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
    // The sum of Re{a (x_m x_k*)} over pairs is x* A x with a Hermitian A.
    let mut weights = Array2::<T>::zeros((samples, samples));
    for m in 0..samples {
        for k in 0..=m {
            let weight: T = number(rng.random::<f64>() - 0.5);
            weights[(m, k)] = weight;
            weights[(k, m)] = weight;
        }
    }
    let both = weights.dot(&covariance);
    let expected_sum: f64 = n * both.diag().iter().map(|v| v.re()).sum::<f64>();
    let square: f64 = both.dot(&both).diag().iter().map(|v| v.re()).sum();
    let sum_variance = n * square * if is_complex::<T>() { 1.0 } else { 2.0 };
    let mut drawn = Array2::<T>::zeros((samples, lags));
    let mut means = Array2::<T>::zeros((samples, lags));
    let mut squares = Array2::<f64>::zeros((samples, lags));
    let mut sums = Vec::new();
    for _ in 0..draws {
        products.draw_into(records, &mut rng, &mut drawn).unwrap();
        let mut sum = 0.0;
        for ((k, lag), value) in drawn.indexed_iter() {
            if k + lag >= samples {
                assert_eq!(value.abs(), 0.0);
                continue;
            }
            let expected = covariance[(k + lag, k)] * number(n);
            means[(k, lag)] = means[(k, lag)] + *value;
            squares[(k, lag)] += (*value - expected).abs().powi(2);
            let factor = if lag == 0 { 1.0 } else { 2.0 };
            sum += factor * (weights[(k + lag, k)] * *value).re();
        }
        sums.push((sum - expected_sum) / sum_variance.sqrt());
    }
    let draws = draws as f64;
    for k in 0..samples {
        for lag in 0..samples - k {
            let variance = product_variance(&covariance, n, [k + lag, k]);
            let expected = covariance[(k + lag, k)] * number(n * draws);
            let error = (means[(k, lag)] - expected).abs() / (draws * variance).sqrt();
            assert!(
                error < 5.0,
                "{noise:?}, {records}: mean of {k}, {lag}: {error}"
            );
            // The fourth moment of few records is larger than that of a normal number.
            let spread = (2.0 / draws).sqrt() * (1.0 + 12.0 / n).sqrt();
            let ratio = squares[(k, lag)] / (draws * variance);
            assert!(
                (ratio - 1.0).abs() < 5.0 * spread,
                "{noise:?}, {records}: variance of {k}, {lag}: {ratio}"
            );
        }
    }
    let mean = sums.iter().sum::<f64>() / draws;
    assert!(
        mean.abs() < 4.0 / draws.sqrt(),
        "{noise:?}, {records}: {mean}"
    );
    let deviation = root_mean_square(&sums);
    let spread = (0.5 / draws).sqrt() * (1.0 + 12.0 / n).sqrt();
    assert!(
        (deviation - 1.0).abs() < 4.0 * spread,
        "{noise:?}, {records}: {deviation}"
    );
}

#[test]
fn products_have_the_moments_of_the_wishart_distribution() {
    for noise in NOISES {
        // Fewer records than samples, as many, and many more.
        for records in [3, 24, 60, 4000] {
            check_moments::<f64>(noise, records, 2000);
            check_moments::<Complex<f64>>(noise, records, 2000);
        }
    }
}

/// A record whose band takes two fifths of the frequencies has fewer degrees of freedom than
/// samples; its products still have every variance.
#[test]
fn long_records_of_a_band_are_drawn_with_their_covariance() {
    let samples = 300;
    let simulator = simulator(NoiseModel::BandLimited, samples);
    let line = line(0.0);
    let covariance: Array2<f64> = simulator.record_covariance_a2(&line).unwrap();
    let products = AccumulatedProducts::<f64>::new(&simulator, &line).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    let mut drawn = Array2::zeros((samples, 64));
    let records = 1_000_000_000;
    products.draw_into(records, &mut rng, &mut drawn).unwrap();
    for ((k, lag), value) in drawn.indexed_iter() {
        if k + lag < samples {
            let n = records as f64;
            let error = (value - n * covariance[(k + lag, k)]).abs();
            let error = error / product_variance(&covariance, n, [k + lag, k]).sqrt();
            assert!(error < 5.5, "{k}, {lag}: {error}");
        }
    }
}

#[test]
fn draws_depend_on_their_stream_alone() {
    let simulator = simulator(NoiseModel::BandLimited, 100);
    let products = AccumulatedProducts::<f64>::new(&simulator, &line(1.0)).unwrap();
    let draw = |lags: usize| {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut drawn = Array2::zeros((100, lags));
        products.draw_into(50, &mut rng, &mut drawn).unwrap();
        drawn
    };
    let long = draw(100);
    let short = draw(20);
    for ((k, lag), value) in short.indexed_iter() {
        assert_eq!(*value, long[(k, lag)], "{k}, {lag}");
    }
    assert_eq!(short, draw(20));
}

#[test]
fn covariances_that_are_none_and_records_that_are_not_gaussian_are_refused() {
    let mut matrix = Array2::<f64>::eye(8);
    matrix[(5, 2)] = 1.5;
    matrix[(2, 5)] = 1.5;
    let error = AccumulatedProducts::from_covariance(matrix).unwrap_err();
    assert_eq!(error, Error::NotPositiveDefinite { sample: 5 });
    let not_a_number = Array2::from_elem((2, 2), f64::NAN);
    let error = AccumulatedProducts::from_covariance(not_a_number).unwrap_err();
    assert_eq!(error, Error::NotPositiveDefinite { sample: 0 });
    let mut receiver = receiver(NoiseModel::White);
    receiver.front_end.linewidth_hz = 1e3;
    let record = Record {
        time_of_first_sample_s: 2.7e-6,
        samples: 16,
    };
    let simulator = Simulator::new(gaussian(60e-9), receiver, record).unwrap();
    let error = AccumulatedProducts::<f64>::new(&simulator, &line(0.0)).unwrap_err();
    assert!(error.to_string().contains("linewidth_hz"), "{error}");
    let small = Array2::<f64>::eye(4);
    let products = AccumulatedProducts::from_covariance(small).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let mut wrong = Array2::zeros((3, 2));
    assert!(products.draw_into(5, &mut rng, &mut wrong).is_err());
}
