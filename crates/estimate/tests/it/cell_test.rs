//! The test of one cell against tables of independent origin and draws.

use rand::{RngExt, SeedableRng};
use rand_distr::Exp1;
use wakescope_estimate::estimators::CellTest;

#[test]
fn cells_have_the_thresholds_and_detections_of_the_stored_table() {
    let table = include_str!("../../../../tests/reference/estimate/detection_cells.csv");
    let rows = table.lines().filter(|line| !line.starts_with('#')).skip(1);
    let mut count = 0;
    for row in rows {
        let numbers: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
        let [
            false_alarm,
            snr,
            windows,
            cells,
            known,
            known_detection,
            cfar,
            cfar_detection,
        ] = numbers[..]
        else {
            panic!("{row}");
        };
        let laws = [
            (
                CellTest::known_noise(windows).unwrap(),
                known,
                known_detection,
            ),
            (
                CellTest::against_cells(windows, cells).unwrap(),
                cfar,
                cfar_detection,
            ),
        ];
        for (test, threshold, detection) in laws {
            let found = test.threshold(false_alarm).unwrap();
            assert!((found / threshold - 1.0).abs() < 1e-6, "{row}: {found}");
            let found = test.probability(found, snr).unwrap();
            assert!((found - detection).abs() < 1e-6, "{row}: {found}");
        }
        count += 1;
    }
    assert!(count > 50);
}

#[test]
fn draws_of_cells_exceed_the_threshold_as_often_as_the_closed_forms_say() {
    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(5);
    let (windows, cells, snr, trials) = (4, 8, 1.0, 40_000);
    let test = CellTest::against_cells(f64::from(windows), f64::from(cells)).unwrap();
    let threshold = test.threshold(0.05).unwrap();
    for (snr, expected) in [
        (0.0, 0.05),
        (snr, test.probability(threshold, snr).unwrap()),
    ] {
        let mut mean = |count: i32| {
            (0..count).map(|_| rng.sample::<f64, _>(Exp1)).sum::<f64>() / f64::from(count)
        };
        let alarms = (0..trials)
            .filter(|_| (1.0 + snr) * mean(windows) > threshold * mean(windows * cells))
            .count();
        let found = alarms as f64 / f64::from(trials);
        let error = (expected * (1.0 - expected) / f64::from(trials)).sqrt();
        assert!(
            (found - expected).abs() < 3.0 * error,
            "{snr}: {found} {expected}"
        );
    }
}

#[test]
fn one_window_needs_its_closed_form_of_signal_and_the_best_of_many_cells_alarms_more_often() {
    let one = CellTest::known_noise(1.0).unwrap();
    // P_d = P_fa^(1 / (1 + S))
    let needed = one.needed_snr(1e-4, 0.9).unwrap();
    assert!((needed - (1e-4_f64.ln() / 0.9_f64.ln() - 1.0)).abs() < 1e-9 * needed);
    assert!((CellTest::best_of(10.0, 0.01).unwrap() - (1.0 - 0.99_f64.powi(10))).abs() < 1e-14);
    // numbers beyond what is of use are answered, too
    for windows in [1e-3, 1e10, 1e200] {
        let test = CellTest::known_noise(windows).unwrap();
        for threshold in [1e-300, 1.0, 1e300] {
            assert!(
                (0.0..=1.0).contains(&test.probability(threshold, 0.0).unwrap()),
                "{windows} {threshold}"
            );
        }
        assert!(test.threshold(1e-4).unwrap() > 0.0);
    }
    assert!(CellTest::against_cells(1e3, 1e2).is_err());
    assert!(CellTest::known_noise(0.0).is_err() && CellTest::against_cells(1.0, f64::NAN).is_err());
    assert!(
        one.threshold(0.0).is_err()
            && one.probability(-1.0, 0.0).is_err()
            && one.needed_snr(0.9, 0.1).is_err()
    );
}
