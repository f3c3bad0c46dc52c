//! A synthetic vortex pair and its map, for the examples. Check: none, it is only to be looked at.
#![allow(dead_code, reason = "each example uses a part")]

use ndarray::{Array2, Array3};
use wakescope_sim::io::{
    CrossPlanes, Field, OPEN_EDGES, Provenance, PulseInfo, Ray, Sweep, Unit, VelocityMap,
};
use wakescope_sim::scene::Site;

/// Origin written into the sample files.
pub(crate) fn origin() -> Provenance {
    Provenance {
        program: format!("wakescope {}", env!("CARGO_PKG_VERSION")),
        scene_toml: "seed = 1\n\n[flow]\nkind = \"synthetic pair\"\n".into(),
        scene_hash: "none".into(),
        seed: 1,
    }
}

/// Wind (horizontal, vertical) of a vortex pair with smoothed cores [m/s]; it weakens with the age.
pub(crate) fn wind(y_m: f64, z_m: f64, tau: f64) -> (f64, f64) {
    let (gamma_m2_s, core_m) = (400.0 / (1.0 + 0.3 * tau), 3.0_f64);
    let vortices = [(-24.0, 28.0, 1.0), (26.0, 31.0, -1.0)];
    vortices.iter().fold((0.0, 0.0), |sum, &(y0, z0, sign)| {
        let (dy, dz) = (y_m - y0, z_m - z0);
        let turn =
            sign * gamma_m2_s / std::f64::consts::TAU / (dy * dy + dz * dz + core_m * core_m);
        (sum.0 + turn * dz, sum.1 - turn * dy)
    })
}

/// Sweeps of 41 rays and 60 gates at these ages; `gaps` leaves one value out.
pub(crate) fn map(taus: &[f64], gaps: bool) -> VelocityMap {
    let (per_sweep, gates, azimuth_rad) = (41, 60, 90_f64.to_radians());
    let mut rays = Vec::new();
    for (sweep, tau) in taus.iter().enumerate() {
        rays.extend((0..per_sweep).map(|i| Ray {
            sweep,
            time_s: 16.0 * tau + 0.1 * i as f64,
            elevation_rad: (0.5 + 0.25 * i as f64).to_radians(),
            azimuth_rad,
            pulses: 64,
            carrier: None,
        }));
    }
    let mut map = VelocityMap {
        title: "synthetic vortex pair".into(),
        rays,
        range_m: (0..gates).map(|g| 300.0 + 5.0 * (g as f64 + 0.5)).collect(),
        sweeps: taus
            .iter()
            .map(|&tau| Sweep::rhi(tau, azimuth_rad))
            .collect(),
        pulse: PulseInfo {
            prt_s: 5e-5,
            pulse_width_s: 2e-7,
            nyquist_velocity_m_s: 48.4,
            sampling_hz: 1.25e8,
            samples: 64,
            frequency_hz: 1.934e14,
        },
        fields: Vec::new(),
        lidar_y_m: -400.0,
        lidar_height_m: 2.0,
        flight: None,
        site: Site::default(),
        is_simulated: true,
    };
    let exact = Array2::from_shape_fn((map.rays.len(), gates), |(r, g)| {
        let (v, w) = wind(
            map.place_m(r, g)[1],
            map.place_m(r, g)[2],
            map.sweeps[map.rays[r].sweep].tau,
        );
        let angle = map.rays[r].elevation_rad;
        v * angle.cos() + w * angle.sin()
    });
    let snr = Array2::from_shape_fn(exact.dim(), |(_, g)| 12.0 - 0.2 * g as f64);
    let spread = snr.mapv(|db| 0.4 * 10_f64.powf(-db / 20.0));
    let mut mean = exact.mapv(|v| 0.95 * v);
    if gaps {
        mean[[3, 55]] = f64::NAN;
    }
    let flag = mean.mapv(|v| if v.is_nan() { 1.0 } else { 0.0 });
    let away = "positive away from the lidar";
    let speed = Unit::METRE_PER_SECOND;
    map.fields = vec![
        Field::float(
            "v_exact",
            speed,
            &format!("exact radial velocity, {away}"),
            exact.clone(),
        ),
        Field::float(
            "v_gate",
            speed,
            &format!("gate-weighted radial velocity, {away}"),
            exact.mapv(|v| 0.97 * v),
        ),
        Field::float(
            "radial_velocity",
            speed,
            &format!("estimated radial velocity, {away}"),
            mean,
        ),
        Field::float(
            "velocity_standard_deviation",
            speed,
            "standard deviation of the estimate",
            spread,
        ),
        Field::float(
            "signal_to_noise_ratio",
            Unit::DECIBEL,
            "signal-to-noise ratio",
            snr,
        ),
        Field::float(
            "quality_flag",
            Unit::ONE,
            "1 where the estimate is missing",
            flag,
        ),
    ];
    map
}

/// The wind in planes at three ages.
pub(crate) fn planes() -> CrossPlanes {
    let tau = vec![0.0, 2.5, 5.0];
    let y_m: Vec<f64> = (-20..=20)
        .map(|i| f64::from(i) * 3.0 + 0.02 * f64::from(i * i * i))
        .collect();
    let z_m: Vec<f64> = (0..24).map(|i| 0.5 * 1.15_f64.powi(i)).collect();
    let shape = (tau.len(), z_m.len(), y_m.len());
    let part = |get: fn((f64, f64)) -> f64| {
        Array3::from_shape_fn(shape, |(t, z, y)| get(wind(y_m[y], z_m[z], tau[t])))
    };
    CrossPlanes {
        title: "synthetic vortex pair".into(),
        time_s: tau.iter().map(|t| 16.4 * t).collect(),
        v_m_s: part(|w| w.0),
        w_m_s: part(|w| w.1),
        tau,
        y_m,
        z_m,
        y_edges: OPEN_EDGES,
        z_edges: OPEN_EDGES,
    }
}
