//! The estimates of a run as a map for files and pictures.
//! Check: the tests of the program read the files.

use crate::io::{Field, PulseInfo, Ray, Site, Sweep, Unit, UtcTime, VelocityMap};
use crate::measure::map::VelocityEstimates;
use crate::plan::Plan;
use crate::scene::Scene;

/// Fields that say how good the mean estimate is.
const JUDGES: [&str; 9] = [
    "velocity_standard_deviation",
    "rms",
    "standard_error",
    "level",
    "n_eff",
    "flagged",
    "count",
    "signal_to_noise_ratio",
    "quality",
];

/// The map of a run in the form that files and pictures take.
pub fn velocity_map(plan: &Plan, e: &VelocityEstimates) -> VelocityMap {
    let (scene, g) = (&plan.scene.scene, &plan.geometry);
    let azimuth_rad = scene.scan.azimuth_rad;
    let start_s = plan.wind.start_s;
    let away = |what: &str| format!("{what}, positive away from the lidar");
    let speed = |name: &str, text: String, values: &ndarray::Array2<f64>| {
        Field::float(name, Unit::MetrePerSecond, &text, values.clone())
    };
    let number =
        |name: &str, text: &str, values: &ndarray::Array2<f64>| Field::float(name, Unit::One, text, values.clone());
    VelocityMap {
        title: "Radial velocity of a wake-vortex scan".into(),
        rays: (0..g.elevation_rad.len())
            .map(|i| Ray {
                sweep: 0,
                time_s: start_s + g.line_time_s[i],
                elevation_rad: g.elevation_rad[i],
                azimuth_rad,
            })
            .collect(),
        range_m: e.range_m.clone(),
        sweeps: vec![Sweep { tau: plan.wind.tau, azimuth_rad }],
        pulse: pulse_info(scene),
        fields: vec![
            speed("v_exact", away("radial velocity of the air at the gate's centre"), &e.v_exact_m_s),
            speed("v_pulse", away("radial velocity weighted with the pulse"), &e.v_pulse_m_s),
            speed("v_gate", away("radial velocity weighted with pulse and window"), &e.v_gate_m_s),
            speed("radial_velocity", away("mean estimated radial velocity"), &e.v_mean_m_s)
                .over_realisations("mean")
                .with_ancillary(&JUDGES),
            speed("velocity_standard_deviation", "standard deviation of one estimate".into(), &e.std_m_s)
                .over_realisations("standard_deviation"),
            speed("rms", "root mean square error against v_pulse".into(), &e.rms_m_s),
            number("level", "windows accumulated for one estimate", &e.level),
            number("n_eff", "independent windows that these are worth", &e.n_eff),
            speed("bias", "mean error against v_pulse".into(), &e.bias_m_s),
            speed("standard_error", "standard error of the root mean square error".into(), &e.standard_error_m_s),
            number("flagged", "fraction of the realisations whose estimate was flagged", &e.flagged),
            number("count", "realisations with a velocity", &e.count),
            speed("width", "mean spectral width beyond that of the window".into(), &e.width_m_s),
            Field::float(
                "signal_to_noise_ratio",
                Unit::Decibel,
                "signal-to-noise ratio in the detector band that the spectra show",
                e.snr_db.clone(),
            ),
            number("quality", "density of the peak over the mean density in the band", &e.quality),
            speed("v_scan", away("radial velocity estimated from the first realisation"), &e.v_scan_m_s),
        ],
        lidar_y_m: 0.0,
        lidar_height_m: scene.scan.lidar_height_m,
        site: site(scene),
        is_simulated: true,
    }
}

/// Pulse and acquisition of a scene.
pub(crate) fn pulse_info(scene: &Scene) -> PulseInfo {
    PulseInfo {
        prt_s: 1.0 / scene.laser.pulse_repetition_hz,
        pulse_width_s: scene.pulse_width_s(),
        nyquist_velocity_m_s: 0.25 * scene.laser.wavelength_m * scene.detector.sampling_hz,
        samples: scene.scan.pulses_per_line as u32,
        frequency_hz: crate::SPEED_OF_LIGHT_M_S / scene.laser.wavelength_m,
    }
}

/// The site of a checked scene.
pub(crate) fn site(scene: &Scene) -> Site {
    let s = &scene.site;
    Site {
        name: s.name.clone(),
        latitude_deg: s.latitude_deg,
        longitude_deg: s.longitude_deg,
        altitude_m: s.altitude_m,
        start: UtcTime::parse(&s.start_utc).unwrap_or(UtcTime::SYNTHETIC),
    }
}
