//! The wake near the ground against the stored run of an independent code, in its plane phase; `references::wakes` has the rest.

use std::f64::consts::TAU;
use wakescope_les::SubgridModel;
use wakescope_les::analysis::{WakeRecord, WakeScales};
use wakescope_les::cases::VortexPairCase;

/// Rows of the stored run: tau first.
fn stored() -> Vec<Vec<f64>> {
    let path = "../../tests/reference/les/wake_3d_ground_re5000_coarse_box4_cans.csv";
    let text = std::fs::read_to_string(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(path))
        .unwrap();
    let row = |line: &str| {
        line.split(',')
            .map(|cell| cell.parse().ok())
            .collect::<Option<Vec<f64>>>()
    };
    text.lines()
        .filter(|line| !line.starts_with('#'))
        .filter_map(row)
        .collect()
}

/// Records at tau = 0, 0.1, ... and the largest relative difference between dissipation by vorticity and by viscous power.
fn plane_flow(subgrid: SubgridModel, end: f64) -> (Vec<WakeRecord>, f64) {
    let pair = VortexPairCase {
        cells: [1, 128, 80],
        subgrid,
        ..VortexPairCase::coarse()
    };
    let mut meter = pair.meter(&WakeScales::REDUCED).unwrap();
    let case = pair.case(VortexPairCase::steps(0.01)).unwrap();
    let (mut flow, _) = case.start().unwrap();
    let mut records = vec![meter.measure(&flow).unwrap()];
    let mut worst = 0.0_f64;
    for i in 1..=(10.0 * end).round() as usize {
        let until = 0.1 * i as f64;
        let mut is_first = i > 1;
        while flow.time_s() < until {
            let power = flow.step_towards(until).unwrap().viscous_power_m5_s3;
            if is_first {
                let measured = 2.0 * TAU / 5000.0 * records[i - 1].enstrophy_m2_s2;
                worst = worst.max((-power / measured - 1.0).abs());
            }
            is_first = false;
        }
        records.push(meter.measure(&flow).unwrap());
    }
    (records, worst)
}

#[test]
fn the_plane_phase_is_that_of_the_independent_code_without_and_with_the_multiscale_model() {
    let stored = stored();
    for subgrid in [SubgridModel::None, SubgridModel::MULTISCALE_WALE] {
        let (records, dissipation) = plane_flow(subgrid, 2.0);
        let first = records[0].right.gamma_5_15_m2_s;
        for (record, row) in records.iter().zip(&stored) {
            let tau = row[0];
            assert!((record.time_s - tau).abs() < 1e-9);
            for (vortex, y, z) in [
                (&record.left, row[3], row[4]),
                (&record.right, row[5], row[6]),
            ] {
                assert!(
                    (vortex.y_m - y).abs() < 0.02,
                    "tau {tau}: y {} for {y}",
                    vortex.y_m
                );
                assert!(
                    (vortex.z_m - z).abs() < 0.02,
                    "tau {tau}: z {} for {z}",
                    vortex.z_m
                );
            }
            let ratio = record.right.gamma_5_15_m2_s / first;
            assert!(
                (ratio - row[2]).abs() < 0.008,
                "tau {tau}: Gamma ratio {ratio} for {}",
                row[2]
            );
            if tau > 0.05 {
                assert!(
                    (record.energy_m4_s2 / row[11] - 1.0).abs() < 0.005,
                    "tau {tau}: {}",
                    record.energy_m4_s2
                );
            }
        }
        assert!(
            dissipation < 0.005,
            "2 nu Z against the viscous power: {dissipation}"
        );
        // Separated, with secondary vortices up; the stored run has 0.34 of the circulation above the layer at 1.5.
        let at = &records[15];
        assert!(at.left.outward_shear_per_s < 0.0 && at.right.outward_shear_per_s < 0.0);
        let second = -at.right.gamma_opposite_m2_s / TAU;
        assert!((second - 0.337).abs() < 0.03, "{second}");
        assert!(
            at.right.secondary.y_m > at.right.y_m && at.right.secondary.gamma_m2_s < 0.0,
            "{:?}",
            at.right.secondary
        );
    }
}
