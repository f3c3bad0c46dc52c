//! Whole scans: order, threads, bounded memory, converters, realisations of the efficiency.

use num_complex::Complex;
use rand::Rng;
use std::collections::HashSet;
use wakescope_signal::digitise::Digitiser;
use wakescope_signal::efficiency::LayerEfficiency;
use wakescope_signal::scan::{PulseKey, pulse_generator};
use wakescope_signal::{Error, LineOfSight, NoiseModel, Scan, Scratch, Shot, Simulator};

use crate::setup::{STEP_M, gaussian, line, mean_power, receiver, simulator};

const SAMPLES: usize = 48;

fn lines() -> Vec<LineOfSight> {
    [-4.0, 2.0, 9.0]
        .map(|v| line(330.0, 500.0, STEP_M, |_| v))
        .to_vec()
}

fn noisy() -> Simulator {
    simulator(gaussian(200e-9), NoiseModel::BandLimited, 400.0, SAMPLES)
}

/// A current of about twice the root mean square of the noise.
fn digitiser() -> Digitiser {
    Digitiser::new(
        8,
        2.0 * receiver(NoiseModel::BandLimited).noise_variance_a2().sqrt(),
    )
    .unwrap()
}

/// Everything that a scan of 3 lines and 150 pulses each delivers: all records, their ordered and
/// their folded sum.
fn deliver(digitiser: Option<Digitiser>) -> (Vec<f64>, [u64; 2]) {
    let (simulator, lines) = (noisy(), lines());
    let scan = Scan {
        simulator: &simulator,
        lines: lines.len(),
        pulses_per_line: 150,
        shot: |key: PulseKey| Shot::from(&lines[key.line]),
        generator: |key| pulse_generator(9, key),
        digitiser,
    };
    let mut all = Vec::new();
    let mut next = 0;
    let first = scan
        .for_each::<f64, Error>(|key, record| {
            assert_eq!((key.line, key.pulse), (next / 150, next % 150));
            next += 1;
            all.extend_from_slice(record);
            Ok(())
        })
        .unwrap();
    assert_eq!(next, scan.records());
    let (collected, second) = scan.collect::<f64>().unwrap();
    assert_eq!(collected.as_slice().unwrap(), all);
    (all, [first, second])
}

#[test]
fn records_of_a_scan_are_those_made_one_by_one() {
    let (simulator, lines) = (noisy(), lines());
    let (all, clipped) = deliver(None);
    assert_eq!(clipped, [0; 2]);
    for (index, record) in all.chunks(SAMPLES).enumerate() {
        let key = PulseKey {
            line: index / 150,
            pulse: index % 150,
        };
        let mut alone = [0.0; SAMPLES];
        let mut rng = pulse_generator(9, key);
        simulator
            .record_into(
                &lines[key.line],
                &mut rng,
                &mut Scratch::default(),
                &mut alone,
            )
            .unwrap();
        assert_eq!(record, alone);
    }
}

#[cfg(feature = "rayon")]
#[test]
fn a_scan_has_the_same_bits_with_any_number_of_threads() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| deliver(Some(digitiser())))
    };
    let one = with(1);
    for threads in [2, 5] {
        assert_eq!(with(threads), one);
    }
}

#[test]
fn clipped_samples_are_counted_alike_by_all_ways_through_a_scan() {
    let (all, clipped) = deliver(Some(digitiser()));
    let step_a = digitiser().step_a();
    assert!(clipped[0] > 0 && clipped[1] == clipped[0]);
    for i in &all {
        let code = i / step_a;
        assert!((code - code.round()).abs() < 1e-9 && (-128.0..=127.0).contains(&code.round()));
    }
    let at_each_end = [-128.0, 127.0].map(|end| {
        let at_end = all.iter().filter(|i| (*i / step_a).round() == end);
        at_end.count() as u64
    });
    assert!(at_each_end.iter().all(|count| *count > 0));
    // Codes at the ends hold the clipped samples and those within half a step.
    let at_the_ends: u64 = at_each_end.iter().sum();
    assert!(at_the_ends >= clipped[0] && at_the_ends < 2 * clipped[0] + 50);
}

#[test]
fn complex_scans_are_digitised_too() {
    let (simulator, lines) = (noisy(), lines());
    let scan = Scan {
        simulator: &simulator,
        lines: 1,
        pulses_per_line: 20,
        shot: |_| Shot::from(&lines[0]),
        generator: |key| pulse_generator(9, key),
        digitiser: Some(digitiser()),
    };
    let (records, _) = scan.collect::<Complex<f64>>().unwrap();
    assert_eq!(records.dim(), (20, SAMPLES));
    let step_a = digitiser().step_a();
    let whole = |part: f64| (part / step_a - (part / step_a).round()).abs() < 1e-9;
    assert!(records.iter().all(|s| whole(s.re) && whole(s.im)));
}

#[test]
fn the_first_error_of_a_scan_comes_out_after_the_records_before_it() {
    let (simulator, mut lines) = (noisy(), lines());
    lines[1].radial_velocity_m_s[7] = f64::INFINITY;
    lines[2].weight_per_m.clear();
    let scan = Scan {
        simulator: &simulator,
        lines: 3,
        pulses_per_line: 40,
        shot: |key: PulseKey| Shot::from(&lines[key.line]),
        generator: |key| pulse_generator(9, key),
        digitiser: None,
    };
    let mut delivered = 0;
    let result = scan.for_each::<f64, Error>(|_, _| {
        delivered += 1;
        Ok(())
    });
    assert!(matches!(
        result,
        Err(Error::ElementOutOfRange {
            field: "radial_velocity_m_s",
            index: 7,
            ..
        })
    ));
    assert_eq!(delivered, 40);
    assert!(matches!(
        scan.collect::<f64>(),
        Err(Error::ElementOutOfRange { index: 7, .. })
    ));
    let stop = scan.for_each::<f64, Error>(|_, _| {
        Err(Error::Empty {
            field: "the caller's own reason",
        })
    });
    assert_eq!(
        stop,
        Err(Error::Empty {
            field: "the caller's own reason"
        })
    );
    let nothing = Scan {
        lines: 0,
        pulses_per_line: 0,
        ..scan
    };
    assert_eq!(nothing.for_each::<f64, Error>(|_, _| Ok(())), Ok(0));
}

#[test]
fn streams_of_neighbouring_keys_and_seeds_differ() {
    let mut seen = HashSet::new();
    for seed in 0..4 {
        for line in 0..20 {
            for pulse in 0..20 {
                assert!(seen.insert(pulse_generator(seed, PulseKey { line, pulse }).next_u64()));
            }
        }
    }
    // Bits of the first draws of neighbours are independent: 64 bits differ in 32 on average.
    let first = |line, pulse| pulse_generator(1, PulseKey { line, pulse }).next_u64();
    let differing: u32 = (0..1000)
        .map(|i| (first(0, i) ^ first(0, i + 1)).count_ones())
        .sum();
    assert!((f64::from(differing) - 32_000.0).abs() < 4.0 * 16_000.0_f64.sqrt());
}

#[test]
fn an_efficiency_of_its_own_for_each_pulse_adds_its_variance_to_that_of_the_speckle() {
    let simulator = simulator(gaussian(200e-9), NoiseModel::None, 400.0, 2);
    let air = line(330.0, 480.0, STEP_M, |_| 2.0);
    let realisations = [[0.2, 0.2], [1.0, 1.0], [1.8, 1.8]];
    let layers = LayerEfficiency::new(&[300.0, 500.0], &realisations, &air).unwrap();
    let moments = |own: bool| {
        let scan = Scan {
            simulator: &simulator,
            lines: 1,
            pulses_per_line: 12_000,
            shot: |key: PulseKey| Shot {
                efficiency: own.then(|| layers.of_pulse(key.pulse)),
                ..Shot::from(&air)
            },
            generator: |key| pulse_generator(4, key),
            digitiser: None,
        };
        let mut sum = [0.0; 2];
        scan.for_each::<Complex<f64>, Error>(|_, record| {
            let power = record[0].norm_sqr();
            sum = [sum[0] + power / 12e3, sum[1] + power * power / 12e3];
            Ok(())
        })
        .unwrap();
        let mean = mean_power(&simulator, &air);
        (sum[0] / mean[0], sum[1] / mean[0].powi(2))
    };
    // Exponential power: E P^2 = 2 (E P)^2, with sd sqrt(20); times E eta^2 = 1 + 2/3 0.64 for
    // efficiencies about 1.
    let (mean, square) = moments(false);
    assert!((mean - 1.0).abs() < 4.0 / 12e3_f64.sqrt(), "{mean}");
    assert!(
        (square - 2.0).abs() < 4.0 * 20_f64.sqrt() / 12e3_f64.sqrt(),
        "{square}"
    );
    let (mean, square) = moments(true);
    let expected: f64 = 2.0 * (1.0 + 2.0 / 3.0 * 0.64);
    assert!(
        (mean - 1.0).abs() < 4.0 * (expected - 1.0).sqrt() / 12e3_f64.sqrt(),
        "{mean}"
    );
    // E P^4 = 24 E eta^4, E eta^4 = (0.2^4 + 1 + 1.8^4)/3.
    let sd = (24.0 * (0.2_f64.powi(4) + 1.0 + 1.8_f64.powi(4)) / 3.0 - expected * expected).sqrt();
    assert!(
        (square - expected).abs() < 4.0 * sd / 12e3_f64.sqrt(),
        "{square}"
    );
}
