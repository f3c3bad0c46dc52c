//! Exact maps of what an estimator shows: kept cores, regions that grow with range, vortices that move meanwhile, one vortex alone.

use crate::fixtures::{normal, table_2};
use crate::vortex_fit::SIGMA_S;
use approx::assert_relative_eq;
use ndarray::Array2;
use rand::SeedableRng;
use wakescope_estimate::retrieval::*;
use wakescope_estimate::vortex_fit::*;
use wakescope_estimate::{
    Correlogram, Refinement, SignalKind, SpectralPeak, Weighting, bound::Noise,
    spectrum::unweighted_lags,
};

fn axes() -> (Vec<f64>, Vec<f64>) {
    (
        (0..54).map(|i| 0.02 + 0.0035 * f64::from(i)).collect(),
        (0..24).map(|i| 324.0 + 7.0 * f64::from(i)).collect(),
    )
}

/// Calls `fit` with a map of peaks of a wake, exact but for rounding, and with the response to fit it by.
fn fitted<T>(
    truth: &Wake,
    of: impl Fn(EstimatorResponse<'_>) -> EstimatorResponse<'_>,
    fit: impl Fn(&VelocityMap<'_>, &EstimatorResponse<'_>) -> T,
) -> T {
    let sampling = table_2();
    let peak = SpectralPeak::new(
        &sampling,
        SignalKind::Real,
        &unweighted_lags(64),
        1024,
        Refinement::Parabola,
    )
    .unwrap();
    let statistic = Correlogram::<f64>::new(Weighting::default(), 64).unwrap();
    let new = || {
        EstimatorResponse::new(
            &statistic,
            &peak,
            &sampling,
            SIGMA_S,
            (Noise::White, 10.0),
            2.0,
        )
        .unwrap()
    };
    let (elevation_rad, range_m) = axes();
    let response = of(new());
    let velocity_m_s: Array2<f64> = response
        .map(&WakeModel::default(), truth, &elevation_rad, &range_m)
        .unwrap();
    let map = VelocityMap {
        elevation_rad: &elevation_rad,
        range_m: &range_m,
        velocity_m_s: velocity_m_s.view(),
        standard_deviation_m_s: None,
    };
    fit(&map, &response)
}

fn near(found: &Wake, truth: &Wake, part: f64) {
    for (found, truth) in found.to_array().iter().zip(truth.to_array()) {
        assert_relative_eq!(*found, truth, max_relative = part, epsilon = 2e-2);
    }
}

#[test]
fn cores_that_are_kept_are_those_that_are_stated() {
    let truth = Wake::from_array(&[
        480.0, 520.0, 376.5, 45.0, 423.5, 49.0, 4.0, 4.0, 1.3, 0.0, 0.0,
    ]);
    let free = FreeParameters {
        core_radius: Sharing::Fixed,
        ..Default::default()
    };
    let fit = |core_radius_m: Option<f64>| {
        let options = MapFitOptions {
            free,
            core_radius_m,
            ..Default::default()
        };
        fitted(
            &truth,
            |r| r,
            |map, shown| {
                fit_map_of_estimator(map, &WakeModel::default(), shown, &options)
                    .unwrap()
                    .wake
            },
        )
    };
    near(&fit(Some(4.0)), &truth, 1e-2);
    let [narrow, typical] = [Some(1.2), None].map(fit);
    assert_eq!(
        (narrow.left.core_radius_m, narrow.right.core_radius_m),
        (1.2, 1.2)
    );
    // the narrower the core, the less circulation has its velocities, though long gates show little of it; 4.5 % of the spacing are 2.1 m
    let [narrow, typical] = [narrow, typical].map(|wake| wake.left.circulation_m2_s);
    assert!(
        narrow < typical && typical < 0.985 * 480.0,
        "{narrow} {typical}"
    );
}

#[test]
fn regions_have_the_radius_of_their_range() {
    let truth = Wake::from_array(&[
        480.0, 520.0, 376.5, 45.0, 423.5, 49.0, 2.5, 2.5, 1.3, 0.0, 0.0,
    ]);
    let radius_m = |range_m: f64| 1.0 + 0.05 * (range_m - 320.0);
    let fit = |map: &VelocityMap<'_>, shown: &EstimatorResponse<'_>| {
        fit_map_of_estimator(map, &WakeModel::default(), shown, &MapFitOptions::default())
            .unwrap()
            .wake
    };
    near(
        &fitted(&truth, |r| r.with_radius(radius_m), fit),
        &truth,
        2e-2,
    );
    // the same velocities with regions of 2 m everywhere
    let wrong = fitted(
        &truth,
        |r| r.with_radius(radius_m),
        |map, _| fitted(&truth, |r| r, |_, shown| fit(map, shown)),
    );
    assert!((wrong.right.core_radius_m - 2.5).abs() > 0.3, "{wrong:?}");
}

/// A pair that sinks by 7 m while it is scanned.
#[test]
fn vortices_that_move_while_they_are_scanned_are_found_where_they_are_in_the_middle() {
    let truth = Wake::from_array(&[
        500.0, 500.0, 376.5, 60.0, 423.5, 60.0, 2.35, 2.35, 2.0, 0.0, 0.0,
    ]);
    let (elevation_rad, _) = axes();
    let seconds: Vec<f64> = (0..elevation_rad.len())
        .map(|line| 0.075 * line as f64 - 2.0)
        .collect();
    let fit = |map: &VelocityMap<'_>, shown: &EstimatorResponse<'_>| {
        fit_map_of_estimator(map, &WakeModel::default(), shown, &MapFitOptions::default())
            .unwrap()
            .wake
    };
    near(
        &fitted(&truth, |r| r.moving(&elevation_rad, &seconds), fit),
        &truth,
        2e-2,
    );
    let frozen = fitted(
        &truth,
        |r| r.moving(&elevation_rad, &seconds),
        |map, _| fitted(&truth, |r| r, |_, shown| fit(map, shown)),
    );
    assert!(
        (frozen.left.circulation_m2_s / 500.0 - 1.0).abs() > 0.03,
        "{frozen:?}"
    );
}

/// Long gates show circulation times spacing: a fit that begins with a narrow pair passes by cores that the regions do not resolve, which
/// must not keep the least radius where it ends (0.6 m with no deviation was told for 2.35 m).
#[test]
fn cores_that_shrink_on_the_way_are_fitted_where_it_ends() {
    let sampling = table_2();
    let peak = SpectralPeak::new(
        &sampling,
        SignalKind::Real,
        &unweighted_lags(64),
        1024,
        Refinement::Parabola,
    )
    .unwrap();
    let statistic = Correlogram::<f64>::new(Weighting::default(), 64).unwrap();
    let response = EstimatorResponse::new(
        &statistic,
        &peak,
        &sampling,
        SIGMA_S,
        (Noise::White, 10.0),
        2.0,
    )
    .unwrap();
    let (elevation_rad, range_m): (Vec<f64>, Vec<f64>) = (
        (0..39).map(|i| 0.006 * f64::from(i)).collect(),
        (0..7).map(|i| 288.0 + 38.4 * f64::from(i)).collect(),
    );
    let truth = Wake::from_array(&[
        450.0, 450.0, 376.5, 47.0, 423.5, 47.0, 2.35, 2.35, 0.0, 0.0, 0.0,
    ]);
    let start = Wake::from_array(&[
        1736.0, 1749.0, 394.8, 47.0, 405.6, 48.6, 0.49, 0.49, -0.1, 0.0, 0.0,
    ]);
    let (model, options) = (
        WakeModel::default(),
        MapFitOptions {
            correlated_lines: 2,
            // the start is where a fit ends that knows nothing of pairs
            pair_prior: None,
            ..Default::default()
        },
    );
    let exact = response
        .map(&model, &truth, &elevation_rad, &range_m)
        .unwrap();
    for seed in [0, 1, 3, 4, 5] {
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
        let velocity_m_s = exact.mapv(|v| v + 0.1 * normal(&mut rng));
        let map = VelocityMap {
            elevation_rad: &elevation_rad,
            range_m: &range_m,
            velocity_m_s: velocity_m_s.view(),
            standard_deviation_m_s: None,
        };
        let found = refine_map_fit_of_estimator(&map, &model, &response, &start, &options).unwrap();
        assert!(found.cores_fitted, "{found:?}");
        for place in [0, 1, 6, 7] {
            let away = (found.wake.to_array()[place] - truth.to_array()[place])
                / found.covariance[[place; 2]].sqrt();
            assert!(away.abs() < 3.5, "{place}: {away}");
        }
    }
}

/// Winds that blow the vortices together, as secondary vortices above them do: a pair in one wind does not explain them.
#[test]
fn circulations_are_those_near_the_vortices_where_a_pair_does_not_explain_the_map() {
    let truth = |wind| {
        Wake::from_array(&[
            440.0, 440.0, 355.0, 45.0, 445.0, 45.0, 3.0, 3.0, wind, 0.0, 0.0,
        ])
    };
    let same = |map: &VelocityMap<'_>| map.velocity_m_s.to_owned();
    let (left, right) = (
        fitted(&truth(0.7), |r| r, |map, _| same(map)),
        fitted(&truth(-0.7), |r| r, |map, _| same(map)),
    );
    let (elevation_rad, range_m) = axes();
    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(3);
    let mut fit = |of: &dyn Fn([usize; 2]) -> f64| {
        let size = (elevation_rad.len(), range_m.len());
        let velocity_m_s = Array2::from_shape_fn(size, |(line, gate)| {
            of([line, gate]) + 0.15 * normal(&mut rng)
        });
        let map = VelocityMap {
            elevation_rad: &elevation_rad,
            range_m: &range_m,
            velocity_m_s: velocity_m_s.view(),
            standard_deviation_m_s: None,
        };
        let (model, options) = (
            WakeModel::default(),
            MapFitOptions {
                correlated_lines: 2,
                ..Default::default()
            },
        );
        fitted(
            &truth(0.0),
            |r| r,
            |_, shown| {
                let pair = refine_map_fit_of_estimator(&map, &model, shown, &truth(0.0), &options)
                    .unwrap();
                let local = with_local_circulations(&map, &model, shown, &pair, &options).unwrap();
                // a vortex that is not in the scan has nothing near it
                let elsewhere = MapFit {
                    wake: Wake::from_array(&[
                        440.0, 440.0, -90.0, 45.0, 990.0, 45.0, 3.0, 3.0, 0.0, 0.0, 0.0,
                    ]),
                    ..pair.clone()
                };
                assert!(
                    with_local_circulations(&map, &model, shown, &elsewhere, &options)
                        .unwrap()
                        .is_none()
                );
                (pair, local)
            },
        )
    };
    let (_, local) = fit(&|at| left[at]);
    assert!(local.is_none(), "{local:?}");
    let (pair, local) = fit(&|at| {
        if range_m[at[1]] < 400.0 {
            left[at]
        } else {
            right[at]
        }
    });
    let local = local.unwrap();
    let errors = |fit: &MapFit| {
        [Parameter::LeftCirculation, Parameter::RightCirculation]
            .map(|of| fit.wake.to_array()[of as usize] / 440.0 - 1.0)
    };
    assert!(
        errors(&local).iter().all(|error| error.abs() < 0.07),
        "{local:?}"
    );
    assert!(errors(&pair)[0] < -0.15, "{pair:?}");
    for of in [Parameter::LeftCirculation, Parameter::RightCirculation] {
        assert!(local.covariance[[of as usize; 2]] >= pair.covariance[[of as usize; 2]]);
    }
}

/// One vortex has no spacing, and nothing is known of its core but what the map shows.
#[test]
fn one_vortex_alone_is_fitted_with_its_core() {
    let truth = Wake::from_array(&[
        0.0, 400.0, -600.0, 50.0, 400.0, 50.0, 5.0, 5.0, 1.0, 0.0, 0.0,
    ]);
    let start = Wake::from_array(&[
        0.0, 330.0, -600.0, 50.0, 402.0, 51.0, 2.0, 2.0, 0.0, 0.0, 0.0,
    ]);
    let found = fitted(
        &truth,
        |r| r,
        |map, shown| {
            refine_map_fit_of_estimator(
                map,
                &WakeModel::default(),
                shown,
                &start,
                &MapFitOptions::default(),
            )
            .unwrap()
        },
    );
    assert_eq!(found.wake.left.circulation_m2_s, 0.0);
    let right = found.wake.right;
    for (found, truth) in [
        (right.circulation_m2_s, 400.0),
        (right.lateral_position_m, 400.0),
        (right.height_m, 50.0),
        (right.core_radius_m, 5.0),
    ] {
        assert_relative_eq!(found, truth, max_relative = 1e-2);
    }
    // the same as means over gates of 10 m, with what is known of the cores of pairs
    let (elevation_rad, range_m) = axes();
    let mut map = ScanMap {
        time_s: vec![0.0; elevation_rad.len()],
        velocity_m_s: Array2::zeros((elevation_rad.len(), range_m.len())),
        elevation_rad,
        range_m,
        sigma_m_s: None,
        fold_m_s: None,
    };
    let options = RetrievalOptions {
        gate: Gate::Gaussian { std_m: 10.0 },
        core_prior: Some(CorePrior::TYPICAL),
        ..Default::default()
    };
    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(3);
    map.velocity_m_s = expected_velocities(&map, &options, &truth, false).unwrap();
    map.velocity_m_s
        .mapv_inplace(|v| v + 0.2 * crate::fixtures::normal(&mut rng));
    let found = fit_scan(&map, Velocities::Means, &options).unwrap();
    let [vortex] = &found.vortices[..] else {
        panic!("{found:?}")
    };
    let core = vortex.core_radius_m.expect("a core that is fitted");
    assert!(
        !found.has(Flag::CoreKept) && (core.value - 5.0).abs() < 4.0 * core.std && core.std < 1.0,
        "{core:?}"
    );
    let circulation = vortex.circulation_m2_s;
    assert!(
        (circulation.value - 400.0).abs() < 4.0 * circulation.std && circulation.std < 20.0,
        "{circulation:?}"
    );
}
