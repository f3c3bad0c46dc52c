//! Small made-up results for the tests of the writers: two sweeps, missing values, a stretched mesh.

use super::map::{CrossPlanes, Field, OPEN_EDGES, PulseInfo, Ray, Sweep, Unit, VelocityMap};
use crate::io::Site;
use ndarray::{Array2, Array3};

/// Two sweeps of 6 rays, 5 gates; NaN in a corner.
pub(crate) fn map() -> VelocityMap {
    let per_sweep = 6;
    let gates = 5;
    let mut rays = Vec::new();
    for sweep in 0..2 {
        for i in 0..per_sweep {
            rays.push(Ray {
                sweep,
                time_s: 40.0 * (sweep as f64 + 1.0) + 0.5 * i as f64,
                elevation_rad: 0.02 + 0.01 * i as f64,
                azimuth_rad: std::f64::consts::FRAC_PI_2,
                pulses: 64,
                carrier: None,
            });
        }
    }
    let shape = (rays.len(), gates);
    let wave = |phase: f64| {
        Array2::from_shape_fn(shape, |(r, g)| {
            (r as f64 * 0.7 + g as f64 * 1.3 + phase).sin() * 8.0
        })
    };
    let mut mean = wave(0.1);
    mean[[11, 4]] = f64::NAN;
    let positive = |scale: f64| wave(0.0).mapv(|v| scale * (v.abs() + 0.5));
    VelocityMap {
        title: "two sweeps".into(),
        rays,
        range_m: (0..gates).map(|g| 45.0 + 30.0 * g as f64).collect(),
        sweeps: [2.5, 5.0]
            .map(|tau| Sweep::rhi(tau, std::f64::consts::FRAC_PI_2))
            .to_vec(),
        pulse: PulseInfo {
            prt_s: 5e-5,
            pulse_width_s: 2e-7,
            nyquist_velocity_m_s: 38.75,
            sampling_hz: 1e8,
            samples: 64,
            frequency_hz: 1.934e14,
        },
        fields: vec![
            Field::float(
                "v_exact",
                Unit::METRE_PER_SECOND,
                "exact radial velocity, positive away from the lidar",
                wave(0.0),
            ),
            Field::float(
                "v_pulse",
                Unit::METRE_PER_SECOND,
                "pulse-weighted radial velocity, positive away from the lidar",
                wave(0.05),
            ),
            Field::float(
                "v_gate",
                Unit::METRE_PER_SECOND,
                "gate-weighted radial velocity, positive away from the lidar",
                wave(0.07),
            ),
            Field::float(
                "radial_velocity",
                Unit::METRE_PER_SECOND,
                "estimated radial velocity, positive away from the lidar",
                mean,
            ),
            Field::float(
                "velocity_standard_deviation",
                Unit::METRE_PER_SECOND,
                "standard deviation of the estimate",
                positive(0.05),
            ),
            Field::float(
                "rms",
                Unit::METRE_PER_SECOND,
                "root mean square error",
                positive(0.06),
            ),
            Field::float("level", Unit::ONE, "accumulation level", positive(3.0)),
            Field::float(
                "n_eff",
                Unit::ONE,
                "effective number of independent spectra",
                positive(2.0),
            ),
            Field::float(
                "signal_to_noise_ratio",
                Unit::DECIBEL,
                "signal-to-noise ratio",
                wave(1.0),
            ),
        ],
        lidar_y_m: -150.0,
        lidar_height_m: 2.0,
        flight: None,
        site: Site::default(),
        is_simulated: true,
    }
}

/// Two planes on a stretched mesh of 5 x 4 cells, one value missing.
pub(crate) fn planes() -> CrossPlanes {
    let shape = (2, 4, 5);
    let mut v_m_s = Array3::from_shape_fn(shape, |(t, z, y)| {
        t as f64 + 0.1 * z as f64 - 0.01 * y as f64
    });
    v_m_s[[0, 0, 0]] = f64::NAN;
    CrossPlanes {
        title: "planes".into(),
        tau: vec![2.5, 5.0],
        time_s: vec![41.0, 82.0],
        y_m: vec![-40.0, -12.5, 0.0, 11.0, 45.0],
        z_m: vec![0.5, 1.7, 4.1, 9.0],
        w_m_s: Array3::from_shape_fn(shape, |(t, z, y)| (t * 20 + z * 5 + y) as f64 / 7.0),
        v_m_s,
        y_edges: OPEN_EDGES,
        z_edges: OPEN_EDGES,
    }
}
