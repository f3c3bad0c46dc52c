//! Winds beyond the Nyquist interval.

use ndarray::Array2;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::retrieval::{
    Flag, RetrievalOptions, ScanMap, ScanResult, Velocities, fit_scan, radial_velocity_method,
};
use wakescope_estimate::vortex_fit::{Wake, WakeModel};

/// Width after which velocities repeat.
const FOLD_M_S: f64 = 16.8;

/// A pair over or beside the lidar in a wind.
fn wake(gamma_m2_s: f64, lateral_m: [f64; 2], wind_m_s: f64) -> Wake {
    let [left, right] = lateral_m;
    Wake::from_array(&[
        gamma_m2_s, gamma_m2_s, left, 60.0, right, 60.0, 3.0, 3.0, wind_m_s, 0.0, 0.0,
    ])
}

/// Folded velocities with noise of 0.2 m/s of a scan of elevations in degrees.
fn map(wake: &Wake, elevations: [f64; 3], range_m: [f64; 2], seed: u64) -> ScanMap {
    let [first, last, step] = elevations;
    let lines = ((last - first) / step).round() as usize + 1;
    let elevation_rad: Vec<f64> = (0..lines)
        .map(|i| (first + step * i as f64).to_radians())
        .collect();
    let gates = ((range_m[1] - range_m[0]) / 8.0) as usize;
    let range_m: Vec<f64> = (0..gates).map(|i| range_m[0] + 8.0 * i as f64).collect();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let model = WakeModel::default();
    let velocity_m_s = Array2::from_shape_fn((lines, gates), |(line, gate)| {
        let noise: f64 = 0.2 * rng.sample::<f64, _>(rand_distr::StandardNormal);
        let velocity = model.radial_velocity_m_s(wake, range_m[gate], elevation_rad[line]) + noise;
        velocity - FOLD_M_S * (velocity / FOLD_M_S).round()
    });
    ScanMap {
        time_s: vec![0.0; lines],
        elevation_rad,
        range_m,
        velocity_m_s,
        sigma_m_s: None,
        fold_m_s: Some(FOLD_M_S),
    }
}

fn wind_is(found: &ScanResult, wind_m_s: f64, what: &str) {
    let wind = found.lateral_wind_m_s;
    assert!(
        (wind.value - wind_m_s).abs() < 4.0 * wind.std + 0.02 && wind.std < 0.5,
        "{what}: {wind:?}"
    );
}

#[test]
fn a_wind_of_several_intervals_is_found_in_any_sector() {
    let options = RetrievalOptions::default();
    for (wind_m_s, seed) in [(12.0, 1), (-12.0, 2), (20.0, 3), (-33.0, 4), (3.0, 5)] {
        for (elevations, range_m, lateral_m) in [
            ([3.0, 16.0, 0.25], [320.0, 520.0], [400.0, 440.0]),
            ([2.0, 60.0, 0.5], [60.0, 200.0], [90.0, 130.0]),
            ([12.0, 168.0, 2.0], [28.0, 130.0], [-15.0, 25.0]),
        ] {
            let what = format!("{wind_m_s} m/s at {elevations:?}");
            let wake = wake(400.0, lateral_m, wind_m_s);
            let map = map(&wake, elevations, range_m, seed);
            let found = fit_scan(&map, Velocities::Means, &options).unwrap();
            wind_is(&found, wind_m_s, &what);
            assert!(
                !found.has(Flag::Ambiguous) && found.vortices.len() == 2,
                "{what}: {found:?}"
            );
            for (vortex, y_m) in found.vortices.iter().zip(lateral_m) {
                let circulation = vortex.circulation_m2_s;
                assert!(
                    (circulation.value - 400.0).abs() < 4.0 * circulation.std,
                    "{what}"
                );
                assert!(
                    (vortex.lateral_position_m.value - y_m).abs() < 1.0,
                    "{what}"
                );
            }
        }
    }
}

#[test]
fn a_wind_without_a_wake_is_found_beyond_the_interval_too() {
    let options = RetrievalOptions::default();
    for (wind_m_s, seed) in [(12.0, 1), (-20.0, 2)] {
        let calm = wake(0.0, [400.0, 440.0], wind_m_s);
        let map = map(&calm, [3.0, 30.0, 0.5], [320.0, 520.0], seed);
        let found = fit_scan(&map, Velocities::Means, &options).unwrap();
        assert!(
            found.has(Flag::NoWake) && !found.has(Flag::Ambiguous),
            "{found:?}"
        );
        wind_is(&found, wind_m_s, "no wake");
        let by_extremes = radial_velocity_method(&map, &options).unwrap();
        assert!((by_extremes.lateral_wind_m_s.value - wind_m_s).abs() < 1.0);
    }
}

/// Over one degree the cosine changes too little to tell the aliases apart.
#[test]
fn winds_that_a_sector_does_not_tell_apart_are_ambiguous() {
    let wake = wake(400.0, [1600.0, 1640.0], 3.0);
    let map = map(&wake, [1.2, 3.2, 0.05], [1540.0, 1700.0], 7);
    let found = fit_scan(&map, Velocities::Means, &RetrievalOptions::default()).unwrap();
    assert!(found.has(Flag::Ambiguous), "{:?}", found.flags);
    let winds: Vec<f64> = found
        .tops
        .iter()
        .map(|top| top.wake.lateral_wind_m_s)
        .collect();
    assert!(
        winds.iter().any(|wind| (wind - 3.0).abs() < 1.0),
        "{winds:?}"
    );
}
