//! The estimates of a run as a map for files and pictures.
//! Check: the tests of the program read the files.

use crate::beams::SweepMode;
use crate::io::{Field, Ray, Sweep, Unit, VelocityMap};
use crate::measure::map::VelocityEstimates;
use crate::plan::Plan;
use crate::plan::described::pulse_info;
use ndarray::Array2;
use std::f64::consts::FRAC_PI_2;

/// Fields that say how good the mean estimate is.
const QUALITY_FIELDS: &str = "velocity_standard_deviation rms standard_error level n_eff flagged count signal_to_noise_ratio quality";

/// The map of a run in the form that files and pictures use.
pub fn velocity_map(plan: &Plan, estimates: &VelocityEstimates) -> VelocityMap {
    let scene = plan.scene();
    let g = &plan.geometry;
    let mount = &g.schedule.mount;
    let lines = &g.schedule.lines;
    let (zero_rad, from_x_rad) = mount.reference_rad;
    let moves = lines
        .iter()
        .any(|line| line.velocity_m_s != [0.0; 3] || line.position_m != mount.position_m);
    let mut is_rhi = true;
    let mut sweeps = Vec::with_capacity(g.schedule.sweeps.len());
    for (mode, fixed_angle_rad) in &g.schedule.sweeps {
        is_rhi &= *mode == SweepMode::Rhi;
        sweeps.push(Sweep {
            tau: plan.wind.tau,
            fixed_angle_rad: *fixed_angle_rad,
            mode: *mode,
            nyquist_velocity_m_s: None,
        });
    }
    let is_across = is_rhi
        && !moves
        && mount.position_m[0] == 0.0
        && zero_rad == scene.scan.azimuth_rad
        && from_x_rad == FRAC_PI_2;
    let mut rays = Vec::with_capacity(lines.len());
    for (index, elevation_rad) in g.elevation_rad.iter().enumerate() {
        let beam = g.schedule.middle(index);
        rays.push(Ray {
            sweep: lines[index].sweep,
            time_s: plan.wind.start_s + g.line_time_s[index],
            elevation_rad: *elevation_rad,
            azimuth_rad: beam.azimuth_rad,
            pulses: u32::try_from(lines[index].pulses).unwrap_or(u32::MAX),
            carrier: moves.then_some((beam.position_m, beam.velocity_m_s)),
        });
    }
    let mut fields = velocity_fields(estimates);
    fields.extend(accumulation_fields(estimates));
    fields.extend(spectral_fields(estimates));
    VelocityMap {
        title: "Radial velocity of a wake-vortex scan".into(),
        rays,
        range_m: estimates.range_m.clone(),
        sweeps,
        pulse: pulse_info(scene),
        fields,
        lidar_y_m: mount.position_m[1],
        lidar_height_m: scene.scan.lidar_height_m,
        flight: (!is_across).then_some((mount.position_m[0], zero_rad - from_x_rad)),
        site: scene.site.clone(),
        is_simulated: true,
    }
}

/// A field of velocities.
fn velocity(name: &str, long_name: &str, values_m_s: &Array2<f64>) -> Field {
    Field::float(name, Unit::METRE_PER_SECOND, long_name, values_m_s.clone())
}

/// A dimensionless field.
fn number(name: &str, long_name: &str, values: &Array2<f64>) -> Field {
    Field::float(name, Unit::ONE, long_name, values.clone())
}

/// Velocities of the wind, the mean estimate and its error.
fn velocity_fields(e: &VelocityEstimates) -> Vec<Field> {
    vec![
        velocity(
            "v_exact",
            "radial velocity of the air at the gate's centre, positive away from the lidar",
            &e.v_exact_m_s,
        ),
        velocity(
            "v_pulse",
            "radial velocity weighted with the pulse, positive away from the lidar",
            &e.v_pulse_m_s,
        ),
        velocity(
            "v_gate",
            "radial velocity weighted with pulse and window, positive away from the lidar",
            &e.v_gate_m_s,
        ),
        velocity(
            "radial_velocity",
            "mean estimated radial velocity, positive away from the lidar",
            &e.v_mean_m_s,
        )
        .over_realisations("mean")
        .with_ancillary(QUALITY_FIELDS),
        velocity(
            "velocity_standard_deviation",
            "standard deviation of one estimate",
            &e.std_m_s,
        )
        .over_realisations("standard_deviation"),
        velocity("rms", "root mean square error against v_pulse", &e.rms_m_s),
    ]
}

/// Windows and realisations of the estimates, and what they give of the error.
fn accumulation_fields(e: &VelocityEstimates) -> Vec<Field> {
    vec![
        number("level", "windows accumulated for one estimate", &e.level),
        number(
            "n_eff",
            "independent windows that these are worth",
            &e.n_eff,
        ),
        velocity("bias", "mean error against v_pulse", &e.bias_m_s),
        velocity(
            "standard_error",
            "standard error of the root mean square error",
            &e.standard_error_m_s,
        ),
        number(
            "flagged",
            "fraction of the realisations whose estimate was flagged",
            &e.flagged,
        ),
        number("count", "realisations with a velocity", &e.count),
    ]
}

/// Width, signal and quality of the spectra, one scan, and the spread of the wind over the pulses.
fn spectral_fields(e: &VelocityEstimates) -> Vec<Field> {
    let mut fields = vec![
        velocity("width", "spectral width of air and pulse", &e.width_m_s),
        Field::float(
            "signal_to_noise_ratio",
            Unit::DECIBEL,
            "signal-to-noise ratio in the detector band that the spectra show",
            e.snr_db.clone(),
        ),
        number(
            "quality",
            "density of the peak over the mean density in the band",
            &e.quality,
        ),
        velocity(
            "v_scan",
            "radial velocity estimated from the first realisation, positive away from the lidar",
            &e.v_scan_m_s,
        ),
    ];
    if let Some(spread_m_s) = &e.v_spread_m_s {
        let long_name = "standard deviation of v_pulse over the pulses of a line";
        fields.push(velocity("v_spread", long_name, spread_m_s));
    }
    fields
}
