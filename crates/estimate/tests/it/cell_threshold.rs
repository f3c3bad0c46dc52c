//! The threshold of one cell against a table of independent origin and draws.

use rand::{RngExt, SeedableRng};
use rand_distr::Exp1;
use wakescope_estimate::estimators::cell_threshold;

#[test]
fn cells_have_the_thresholds_of_the_stored_table() {
    let table = include_str!("../../../../tests/reference/estimate/detection_cells.csv");
    let rows = table.lines().filter(|line| !line.starts_with('#')).skip(1);
    let mut count = 0;
    for row in rows {
        let numbers: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
        let [false_alarm, windows, threshold] = numbers[..] else {
            panic!("{row}");
        };
        let found = cell_threshold(windows, false_alarm).unwrap();
        assert!((found / threshold - 1.0).abs() < 1e-6, "{row}: {found}");
        count += 1;
    }
    assert!(count >= 12, "{count}");
}

#[test]
fn draws_of_noise_exceed_the_threshold_as_often_as_stated() {
    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(5);
    let (windows, trials, expected) = (4, 40_000, 0.05);
    let threshold = cell_threshold(f64::from(windows), expected).unwrap();
    let mut mean = || {
        let sum: f64 = (0..windows).map(|_| rng.sample::<f64, _>(Exp1)).sum();
        sum / f64::from(windows)
    };
    let alarms = (0..trials).filter(|_| mean() > threshold).count();
    let found = alarms as f64 / f64::from(trials);
    let error = (expected * (1.0 - expected) / f64::from(trials)).sqrt();
    assert!((found - expected).abs() < 3.0 * error, "{found}");
}

#[test]
fn numbers_beyond_what_is_of_use_are_answered_and_impossible_ones_refused() {
    for windows in [1e-3, 1e10, 1e200] {
        assert!(cell_threshold(windows, 1e-4).unwrap() > 0.0, "{windows}");
    }
    for (windows, false_alarm) in [(0.0, 0.1), (f64::NAN, 0.1), (1.0, 0.0), (1.0, 1.0)] {
        assert!(
            cell_threshold(windows, false_alarm).is_err(),
            "{windows} {false_alarm}"
        );
    }
}
