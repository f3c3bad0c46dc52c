//! Fits of scans against references of independent origin.

use super::retrieval_cases::*;
use ndarray::Array2;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::retrieval::*;
use wakescope_estimate::vortex_fit::*;

#[test]
fn exact_scans_give_the_truth_to_a_thousandth_of_the_bound() {
    for name in ["a", "b", "c"] {
        let mut case = case(name);
        case.map.velocity_m_s = case.exact.clone();
        let found = fit_scan(&case.map, Velocities::Means, &case.options).unwrap();
        let errors = errors_over_bounds(&case, &found);
        assert!(errors.iter().all(|e| e.abs() < 1e-3), "{name}: {errors:?}");
    }
}

#[test]
fn an_impossible_start_is_passed_over() {
    let mut case = case("b");
    let errors = |case: &Case| {
        let found = fit_scan(&case.map, Velocities::Means, &case.options);
        errors_over_bounds(case, &found.unwrap())
    };
    let blind = errors(&case);
    // Below the ground, where the model has no vortices.
    let below = [
        300.0, 300.0, 381.0, -5.0, 419.0, -5.0, 3.0, 3.0, -4.0, 0.03, 0.0,
    ];
    case.options.start = Some(Wake::from_array(&below));
    for (a, b) in errors(&case).iter().zip(&blind) {
        assert!((a - b).abs() < 0.05, "{a} {b}");
    }
}

#[test]
fn stored_scans_are_within_three_bounds_of_the_truth_whether_the_wake_moves_or_not() {
    for name in ["a", "b", "c"] {
        let case = case(name);
        let options = RetrievalOptions {
            movement: Movement::Auto,
            ..case.options.clone()
        };
        let found = fit_scan(&case.map, Velocities::Means, &options).unwrap();
        let errors = errors_over_bounds(&case, &found);
        assert!(errors.iter().all(|e| e.abs() < 3.0), "{name}: {errors:?}");
        assert!(
            (found.chi2_per_dof - 1.0).abs() < 0.1,
            "{name}: {}",
            found.chi2_per_dof
        );
        assert_eq!(
            found.has(Flag::MotionIgnored),
            name != "c",
            "{name}: {:?}",
            found.flags
        );
        let bound = case.bound;
        for (i, bound) in bound.iter().enumerate() {
            let stated = found.covariance[[i, i]].sqrt();
            assert!(
                (0.8..1.3).contains(&(stated / bound)),
                "{name} {i}: {stated} {bound}"
            );
        }
        let [left, right] =
            [Side::Left, Side::Right].map(|side| found.vortex(side).unwrap().circulation_5_15_m2_s);
        let truth = case
            .truth
            .mean_circulations_5_15_m2_s(CoreProfile::Algebraic, found.covariance.view());
        for (found, truth) in [(left, truth[0]), (right, truth[1])] {
            assert!(
                (found.value - truth.0).abs() < 3.0 * found.std,
                "{name}: {found:?} {truth:?}"
            );
        }
    }
}

#[test]
fn a_frozen_model_of_a_moving_wake_is_metres_off_and_fits_badly() {
    let mut case = case("c");
    case.options.movement = Movement::Frozen;
    let found = fit_scan(&case.map, Velocities::Means, &case.options).unwrap();
    let wake = found.wake.unwrap();
    assert!(
        (wake.right.lateral_position_m - 424.0 + 2.6).abs() < 0.8,
        "{wake:?}"
    );
    assert!(
        wake.left.circulation_m2_s < 400.0
            && found.chi2_per_dof > 1.2
            && found.has(Flag::MotionIgnored)
    );
}

#[test]
fn one_vortex_is_told_as_one_and_wind_as_no_wake() {
    let (map, _) = stored(reference!("map_one"));
    for movement in [Movement::Auto, Movement::Frozen] {
        let found = fit_scan(
            &map,
            Velocities::Means,
            &RetrievalOptions {
                movement,
                ..Default::default()
            },
        )
        .unwrap();
        assert!(
            found.has(Flag::OneVortex) && found.vortices.len() == 1,
            "{:?}",
            found.flags
        );
        let right = numbers(found.vortex(Side::Right).unwrap());
        let (truth, bound) = (
            [350.0, 410.0, 30.0, 2.5],
            [3.498, 0.070_12, 0.040_568, 0.065_798],
        );
        for ((found, truth), bound) in right.iter().zip(truth).zip(bound) {
            assert!(
                (found.value - truth).abs() < 4.0 * bound,
                "{found:?} {truth}"
            );
            assert!(
                (0.8..1.3).contains(&(found.std / bound)),
                "{found:?} {bound}"
            );
        }
    }
    let (map, _) = stored(reference!("map_noise"));
    let found = fit_scan(&map, Velocities::Means, &RetrievalOptions::default()).unwrap();
    assert!(found.has(Flag::NoWake) && found.vortices.is_empty() && found.wake.is_none());
    assert!((found.lateral_wind_m_s.value + 3.0).abs() < 4.0 * found.lateral_wind_m_s.std);
    assert!((found.wind_shear_per_s.value - 0.04).abs() < 4.0 * found.wind_shear_per_s.std);
    assert!((found.chi2_per_dof - 1.0).abs() < 0.1 && found.statistic < found.threshold);
}

/// Fits of few scans: squares of errors over their stated deviations are 1 on average.
#[test]
fn outliers_and_unknown_deviations_leave_errors_that_the_covariance_tells() {
    let case = thinned(case("a"));
    for (outliers, known) in [(true, true), (false, false)] {
        let mut squares = vec![];
        for seed in 0..6 {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(300 + seed);
            let velocity_m_s = if outliers {
                with_outliers(&case, &mut rng)
            } else {
                white(&case, &mut rng)
            };
            let sigma_m_s = case.map.sigma_m_s.clone().filter(|_| known);
            let map = ScanMap {
                velocity_m_s,
                sigma_m_s,
                ..case.map.clone()
            };
            let found = fit_scan(&map, Velocities::Means, &case.options).unwrap();
            let (p, truth) = (found.wake.unwrap().to_array(), case.truth.to_array());
            squares.extend(
                (0..STRAIGHT).map(|i| (p[i] - truth[i]).powi(2) / found.covariance[[i, i]]),
            );
            let rejected = if outliers { 30..90 } else { 0..3 };
            assert!(
                rejected.contains(&found.cells_rejected),
                "{}",
                found.cells_rejected
            );
        }
        // 60 squares, not all independent: their mean is known to 20 %
        let mean = mean(squares.into_iter());
        assert!((0.5..1.7).contains(&mean), "{outliers} {known}: {mean}");
    }
}

#[test]
fn weak_unequal_low_and_high_wakes_on_coarse_and_narrow_scans_are_within_their_errors() {
    let of = |p: [f64; 6], core_m: f64, wind: [f64; 2]| {
        Wake::from_array(&[
            p[0], p[1], p[2], p[3], p[4], p[5], core_m, core_m, wind[0], wind[1], 0.0,
        ])
    };
    let (lines, gates) = ((0.004, 0.004, 56), (330.0, 4.0, 36));
    let points = RetrievalOptions::default();
    let gate = Gate::Gaussian { std_m: 10.0 };
    let coarse = RetrievalOptions {
        gate: gate.clone(),
        ..Default::default()
    };
    let raised = WakeModel {
        lidar_height_m: 12.0,
        lidar_lateral_position_m: -30.0,
        ..Default::default()
    };
    let raised = RetrievalOptions {
        model: raised,
        ..Default::default()
    };
    let lamb = WakeModel {
        profile: CoreProfile::LambOseen,
        images: false,
        ..Default::default()
    };
    let lamb = RetrievalOptions {
        model: lamb,
        gate,
        ..Default::default()
    };
    for (name, wake, options, lines, gates) in [
        (
            "weak",
            of([50.0, 50.0, 380.0, 50.0, 420.0, 50.0], 2.5, [2.0, 0.0]),
            &points,
            lines,
            gates,
        ),
        (
            "unequal",
            of([420.0, 180.0, 370.0, 70.0, 425.0, 55.0], 2.5, [-5.0, 0.05]),
            &points,
            lines,
            gates,
        ),
        (
            "low",
            of([300.0, 320.0, 375.0, 14.0, 428.0, 18.0], 2.5, [1.0, 0.0]),
            &coarse,
            lines,
            gates,
        ),
        (
            "high",
            of([350.0, 350.0, 380.0, 110.0, 425.0, 118.0], 3.0, [8.0, 0.02]),
            &coarse,
            (0.12, 0.005, 50),
            gates,
        ),
        (
            "coarse gates",
            of([400.0, 380.0, 380.0, 50.0, 424.0, 48.0], 3.0, [0.0, 0.0]),
            &coarse,
            lines,
            (310.0, 18.0, 11),
        ),
        (
            "raised lidar",
            of([400.0, 380.0, 370.0, 50.0, 414.0, 48.0], 2.5, [0.0, 0.0]),
            &raised,
            (-0.02, 0.004, 60),
            gates,
        ),
        (
            "narrow",
            of([400.0, 380.0, 380.0, 50.0, 424.0, 48.0], 2.5, [0.0, 0.0]),
            &points,
            (0.08, 0.003, 27),
            gates,
        ),
        (
            "Lamb-Oseen",
            of([400.0, 380.0, 380.0, 50.0, 424.0, 48.0], 2.5, [0.0, 0.0]),
            &lamb,
            lines,
            gates,
        ),
    ] {
        let found = fit_scan(
            &noisy(&wake, options, lines, gates, 17),
            Velocities::Means,
            options,
        )
        .unwrap();
        let (p, truth) = (found.wake.unwrap().to_array(), wake.to_array());
        for i in 0..PARAMETERS {
            let sigma = found.covariance[[i, i]].sqrt();
            assert!(
                (p[i] - truth[i]).abs() <= 4.0 * sigma,
                "{name} {i}: {} {} {sigma}",
                p[i],
                truth[i]
            );
        }
        assert_eq!(found.vortices.len(), 2, "{name}: {:?}", found.flags);
        assert!(
            found.has(Flag::NearGround) == (name == "low") && found.has(Flag::MotionIgnored),
            "{name}: {:?}",
            found.flags
        );
    }
}

#[test]
fn vortices_beyond_or_at_the_end_of_the_sector_are_told() {
    let options = RetrievalOptions::default();
    let wake = |right_m: f64| {
        Wake::from_array(&[
            380.0, 380.0, 400.0, 50.0, right_m, 50.0, 2.5, 2.5, 1.0, 0.0, 0.0,
        ])
    };
    let (lines, gates) = ((0.004, 0.004, 56), (330.0, 4.0, 31));
    // 450 m is the last gate
    let found = fit_scan(
        &noisy(&wake(475.0), &options, lines, gates, 1),
        Velocities::Means,
        &options,
    )
    .unwrap();
    assert!(
        found.has(Flag::OneVortex) && found.vortex(Side::Right).is_none(),
        "{:?}",
        found.flags
    );
    let left = numbers(found.vortex(Side::Left).unwrap());
    assert!(
        (left[0].value - 380.0).abs() < 25.0 && (left[1].value - 400.0).abs() < 1.0,
        "{left:?}"
    );
    let found = fit_scan(
        &noisy(&wake(444.0), &options, lines, gates, 2),
        Velocities::Means,
        &options,
    )
    .unwrap();
    assert!(
        found.has(Flag::AtEdge) && found.vortices.len() == 2,
        "{:?}",
        found.flags
    );
}

#[test]
fn folded_velocities_holes_and_cores_that_are_kept() {
    let options = RetrievalOptions::default();
    let wake = Wake::from_array(&[
        400.0, 380.0, 380.0, 50.0, 424.0, 48.0, 2.5, 2.5, 9.0, 0.0, 0.0,
    ]);
    let (lines, gates) = ((0.004, 0.004, 56), (330.0, 4.0, 36));
    let mut map = noisy(&wake, &options, lines, gates, 3);
    // a band of 20 m/s about 0: what is above 10 m/s comes out below
    map.velocity_m_s
        .mapv_inplace(|v| v - 20.0 * (v / 20.0_f64).round());
    map.fold_m_s = Some(20.0);
    map.velocity_m_s
        .slice_mut(ndarray::s![20..24, 3..9])
        .fill(f64::NAN);
    let found = fit_scan(&map, Velocities::Means, &options).unwrap();
    let (p, truth) = (found.wake.unwrap().to_array(), wake.to_array());
    assert!(
        (0..PARAMETERS).all(|i| (p[i] - truth[i]).powi(2) <= 16.0 * found.covariance[[i, i]]),
        "{p:?}"
    );
    assert_eq!(found.cells_used + found.cells_rejected, 56 * 36 - 24);
    let fixed = FreeParameters {
        core_radius: Sharing::Fixed,
        ..options.free
    };
    let kept = fit_scan(
        &map,
        Velocities::Means,
        &RetrievalOptions {
            free: fixed,
            core_radius_m: Some(2.2),
            ..options
        },
    )
    .unwrap();
    assert!(kept.has(Flag::CoreKept) && kept.vortices.iter().all(|v| v.core_radius_m.is_none()));
    assert_eq!(kept.wake.unwrap().left.core_radius_m, 2.2);
}

#[test]
fn impossible_scans_and_options_are_refused_with_the_field() {
    let (map, _) = stored(reference!("map_noise"));
    let refused = |map: &ScanMap, options: &RetrievalOptions, field: &str| {
        let error = fit_scan(map, Velocities::Means, options)
            .unwrap_err()
            .to_string();
        assert!(error.contains(field), "{error}");
    };
    let options = RetrievalOptions::default();
    refused(
        &ScanMap {
            time_s: vec![0.0; 3],
            ..map.clone()
        },
        &options,
        "time_s",
    );
    refused(
        &ScanMap {
            fold_m_s: Some(-1.0),
            ..map.clone()
        },
        &options,
        "fold_m_s",
    );
    refused(
        &ScanMap {
            sigma_m_s: Some(Array2::zeros((75, 36))),
            ..map.clone()
        },
        &options,
        "standard_deviation_m_s",
    );
    refused(
        &ScanMap {
            velocity_m_s: Array2::from_elem((75, 36), f64::NAN),
            ..map.clone()
        },
        &options,
        "velocities",
    );
    refused(
        &map,
        &RetrievalOptions {
            threshold: f64::NAN,
            ..options.clone()
        },
        "threshold",
    );
    for std_m in [-3.0, 1e9] {
        refused(
            &map,
            &RetrievalOptions {
                gate: Gate::Gaussian { std_m },
                ..options.clone()
            },
            "std_m of the gate",
        );
    }
    let turbulence = Some(Turbulence::Exponential {
        deviation_m_s: 0.0,
        length_m: 25.0,
    });
    refused(
        &map,
        &RetrievalOptions {
            turbulence,
            ..options.clone()
        },
        "deviation_m_s",
    );
    assert_eq!(
        fit_scan(&map, Velocities::Means, &options).unwrap(),
        fit_scan(&map, Velocities::Means, &options).unwrap()
    );
}
