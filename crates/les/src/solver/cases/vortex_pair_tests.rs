//! The pair in the plane: symmetry, drift, scales; fast forms of the bars of the independent codes.

use super::*;
use crate::analysis::WakeRecord;
use crate::solver::Flow;

fn plane(cells: [usize; 2]) -> VortexPairCase {
    VortexPairCase {
        cells: [1, cells[0], cells[1]],
        perturbation: 0.0,
        ..VortexPairCase::coarse()
    }
}

/// Records at multiples of `every` up to `end`, in the units of the pair.
fn history(pair: &VortexPairCase, every: f64, end: f64) -> (Flow, Vec<WakeRecord>) {
    let mut meter = pair.meter(&WakeScales::REDUCED).unwrap();
    let (mut flow, _) = pair
        .clone()
        .case(VortexPairCase::steps(0.02))
        .unwrap()
        .start()
        .unwrap();
    let mut records = vec![meter.measure(&flow).unwrap()];
    for i in 1..=(end / every).round() as usize {
        while flow.time_s() < every * i as f64 {
            flow.step_towards(every * i as f64).unwrap();
        }
        records.push(meter.measure(&flow).unwrap());
    }
    (flow, records)
}

#[test]
fn left_and_right_mirror_each_other_to_round_off() {
    let (flow, records) = history(&plane([96, 48]), 0.5, 1.0);
    let v = flow.face_velocity_m_s(1);
    let w = flow.face_velocity_m_s(2);
    let mut worst = 0.0_f64;
    let mut largest = 0.0_f64;
    for k in 0..48 {
        for j in 1..96 {
            worst = worst.max((v[k * 96 + j] + v[k * 96 + 96 - j]).abs());
            worst = worst.max((w[k * 96 + j] - w[k * 96 + 95 - j]).abs());
            largest = largest.max(v[k * 96 + j].abs());
        }
    }
    assert!(worst < 1e-11 * largest, "{worst} of {largest}");
    for record in records {
        assert!(
            (record.left.y_m + record.right.y_m).abs() < 1e-10,
            "{record:?}"
        );
        assert!((record.left.gamma_5_15_m2_s + record.right.gamma_5_15_m2_s).abs() < 1e-9);
    }
}

#[test]
fn over_a_frictionless_ground_the_pair_follows_the_hyperbola() {
    // Compact cores: the tails of algebraic ones overlap with their images.
    let pair = VortexPairCase {
        sticky_ground: false,
        reynolds: 1e6,
        size: [1.0, 8.0, 4.0],
        core_radius: 0.12,
        profile: CirculationProfile::LambOseen,
        ..plane([192, 96])
    };
    let (_, records) = history(&pair, 0.25, 1.0);
    for record in records.iter().skip(1) {
        let y = record.right.y_m;
        let z = record.right.z_m;
        let invariant = 1.0 / (y * y) + 1.0 / (z * z);
        assert!((invariant / 5.0 - 1.0).abs() < 0.04, "{y}, {z}");
    }
    let last = &records[4].right;
    assert!(last.y_m > 0.7 && last.z_m < 0.65, "{last:?}");
}

#[test]
fn a_uniform_wind_over_a_frictionless_ground_carries_the_pair_along() {
    let still = VortexPairCase {
        sticky_ground: false,
        core_radius: 0.2,
        ..plane([64, 40])
    };
    let windy = VortexPairCase {
        cross_wind: 0.8,
        ..still.clone()
    };
    let (_, a) = history(&still, 0.5, 0.5);
    let (_, b) = history(&windy, 0.5, 0.5);
    for (a, b) in [(&a[1].left, &b[1].left), (&a[1].right, &b[1].right)] {
        assert!(
            (b.y_m - a.y_m - 0.4).abs() < 0.01,
            "{} from {}",
            b.y_m,
            a.y_m
        );
        assert!((b.z_m - a.z_m).abs() < 0.01);
    }
}

#[test]
fn a_pair_in_si_units_is_the_reduced_one_scaled() {
    let scales = WakeScales {
        spacing_m: 47.0,
        circulation_m2_s: 500.0,
    };
    let pair = VortexPairCase {
        cells: [6, 32, 24],
        ..VortexPairCase::coarse()
    };
    let unit_s = scales.time_unit_s();
    let fixed = |step_s| TimeStep::Fixed { step_s };
    let (mut small, _) = pair.clone().case(fixed(0.01)).unwrap().start().unwrap();
    let (mut large, _) = pair
        .clone()
        .scaled(&scales, fixed(0.01 * unit_s))
        .unwrap()
        .start()
        .unwrap();
    let mut meters = (
        pair.meter(&WakeScales::REDUCED).unwrap(),
        pair.meter(&scales).unwrap(),
    );
    for _ in 0..5 {
        small.step().unwrap();
        large.step().unwrap();
    }
    let a = meters.0.measure(&small).unwrap();
    let b = meters.1.measure(&large).unwrap().reduced(&scales);
    for (a, b) in [
        (a.time_s, b.time_s),
        (a.right.y_m, b.right.y_m),
        (a.left.gamma_5_15_m2_s, b.left.gamma_5_15_m2_s),
        (a.energy_m4_s2, b.energy_m4_s2),
        (a.energy_3d_m4_s2(), b.energy_3d_m4_s2()),
        (a.enstrophy_m2_s2, b.enstrophy_m2_s2),
        (a.left.outward_shear_per_s, b.left.outward_shear_per_s),
        (a.wall_units, b.wall_units),
    ] {
        assert!((a / b - 1.0).abs() < 1e-8, "{a} against {b}");
    }
}

#[test]
fn the_three_dimensional_start_is_that_of_the_independent_code() {
    // Case P at tau = 0: energy 10.43, of which 5.28e-4 varies along x.
    let pair = VortexPairCase::coarse();
    let (flow, given_m5_s2) = pair
        .clone()
        .case(TimeStep::Fixed { step_s: 1e-3 })
        .unwrap()
        .start()
        .unwrap();
    let record = pair
        .meter(&WakeScales::REDUCED)
        .unwrap()
        .measure(&flow)
        .unwrap();
    assert!(
        (record.energy_m4_s2 / 10.430 - 1.0).abs() < 0.004,
        "{}",
        record.energy_m4_s2
    );
    assert!(
        (record.energy_3d_m4_s2() / 5.28e-4 - 1.0).abs() < 0.1,
        "{}",
        record.energy_3d_m4_s2()
    );
    assert!(
        (record.right.gamma_5_15_m2_s / TAU - 0.785).abs() < 0.002,
        "{}",
        record.right.gamma_5_15_m2_s / TAU
    );
    for (m, stored) in [(1, 7.883e-5), (2, 7.291e-5), (3, 9.043e-5), (4, 4.259e-5)] {
        assert!(
            (record.mode_energy_m4_s2[m] / stored - 1.0).abs() < 0.15,
            "{m}: {}",
            record.mode_energy_m4_s2[m]
        );
    }
    let removed = 1.0 - flow.kinetic_energy_m5_s2() / given_m5_s2;
    assert!(removed < 0.01, "{removed} of the energy");
}

#[test]
fn winds_and_background_turbulence_need_periodic_sides() {
    let step = || TimeStep::Fixed { step_s: 1e-3 };
    let refused = |pair: VortexPairCase| pair.case(step()).unwrap_err();
    let walls = VortexPairCase {
        slip_sides: true,
        ..plane([32, 24])
    };
    assert!(matches!(
        refused(VortexPairCase {
            cross_wind: 1.0,
            ..walls.clone()
        }),
        Error::OutOfRange {
            field: "cross_wind",
            ..
        }
    ));
    assert!(matches!(
        refused(VortexPairCase {
            background: 0.1,
            ..walls
        }),
        Error::OutOfRange {
            field: "background",
            ..
        }
    ));
    let windy = VortexPairCase {
        cross_wind: 1.0,
        wind_roughness: 0.01,
        ..plane([32, 24])
    };
    let v = windy.pair(1.9, 1.0)[1]
        - VortexPairCase {
            cross_wind: 0.0,
            ..windy.clone()
        }
        .pair(1.9, 1.0)[1];
    assert!(
        (v - 1.0).abs() < 1e-12,
        "at the height of the vortices: {v}"
    );
    let case = VortexPairCase {
        background: 0.05,
        cells: [8, 32, 24],
        ..plane([32, 24])
    }
    .with_two_scales()
    .unwrap();
    let (flow, _) = case.case(step()).unwrap().start().unwrap();
    // The pair itself has no velocity along the flight.
    let u = flow.face_velocity_m_s(0);
    let rms = (u.iter().map(|u| u * u).sum::<f64>() / u.len() as f64).sqrt();
    assert!((0.02..0.08).contains(&rms), "{rms}");
}
