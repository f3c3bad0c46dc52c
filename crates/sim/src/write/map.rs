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
const JUDGES: &str = "velocity_standard_deviation rms standard_error level n_eff flagged count signal_to_noise_ratio quality";

/// The map of a run in the form that files and pictures take.
pub fn velocity_map(plan: &Plan, e: &VelocityEstimates) -> VelocityMap {
    let scene = plan.scene();
    let g = &plan.geometry;
    let mount = &g.schedule.mount;
    let lines = &g.schedule.lines;
    let (zero_rad, from_x_rad) = mount.reference_rad;
    let moves = lines
        .iter()
        .any(|line| line.velocity_m_s != [0.0; 3] || line.position_m != mount.position_m);
    let rhi = g
        .schedule
        .sweeps
        .iter()
        .all(|(mode, _)| *mode == SweepMode::Rhi);
    let stands = mount.position_m[0] == 0.0 && !moves;
    let across = rhi && stands && (zero_rad, from_x_rad) == (scene.scan.azimuth_rad, FRAC_PI_2);
    let start_s = plan.wind.start_s;
    let away = |what: &str| format!("{what}, positive away from the lidar");
    let speed = Unit::METRE_PER_SECOND;
    let one = Unit::ONE;
    let field = |name: &str, unit, text: &str, values: &Array2<f64>| {
        Field::float(name, unit, text, values.clone())
    };
    let in_band = "signal-to-noise ratio in the detector band that the spectra show";
    let of_pulses = "standard deviation of v_pulse over the pulses of a line";
    let spread = e
        .v_spread_m_s
        .as_ref()
        .map(|values| field("v_spread", speed, of_pulses, values));
    let ray = |i: usize| {
        let beam = g.schedule.middle(i);
        Ray {
            sweep: lines[i].sweep,
            time_s: start_s + g.line_time_s[i],
            elevation_rad: g.elevation_rad[i],
            azimuth_rad: beam.azimuth_rad,
            pulses: u32::try_from(lines[i].pulses).unwrap_or(u32::MAX),
            carrier: moves.then_some((beam.position_m, beam.velocity_m_s)),
        }
    };
    let sweep = |&(mode, fixed_angle_rad): &(SweepMode, f64)| Sweep {
        tau: plan.wind.tau,
        fixed_angle_rad,
        mode,
    };
    let mut fields = vec![
        field(
            "v_exact",
            speed,
            &away("radial velocity of the air at the gate's centre"),
            &e.v_exact_m_s,
        ),
        field(
            "v_pulse",
            speed,
            &away("radial velocity weighted with the pulse"),
            &e.v_pulse_m_s,
        ),
        field(
            "v_gate",
            speed,
            &away("radial velocity weighted with pulse and window"),
            &e.v_gate_m_s,
        ),
        field(
            "radial_velocity",
            speed,
            &away("mean estimated radial velocity"),
            &e.v_mean_m_s,
        )
        .over_realisations("mean")
        .with_ancillary(JUDGES),
        field(
            "velocity_standard_deviation",
            speed,
            "standard deviation of one estimate",
            &e.std_m_s,
        )
        .over_realisations("standard_deviation"),
        field(
            "rms",
            speed,
            "root mean square error against v_pulse",
            &e.rms_m_s,
        ),
        field(
            "level",
            one,
            "windows accumulated for one estimate",
            &e.level,
        ),
        field(
            "n_eff",
            one,
            "independent windows that these are worth",
            &e.n_eff,
        ),
        field("bias", speed, "mean error against v_pulse", &e.bias_m_s),
        field(
            "standard_error",
            speed,
            "standard error of the root mean square error",
            &e.standard_error_m_s,
        ),
        field(
            "flagged",
            one,
            "fraction of the realisations whose estimate was flagged",
            &e.flagged,
        ),
        field("count", one, "realisations with a velocity", &e.count),
        field(
            "width",
            speed,
            "spectral width of air and pulse",
            &e.width_m_s,
        ),
        field("signal_to_noise_ratio", Unit::DECIBEL, in_band, &e.snr_db),
        field(
            "quality",
            one,
            "density of the peak over the mean density in the band",
            &e.quality,
        ),
        field(
            "v_scan",
            speed,
            &away("radial velocity estimated from the first realisation"),
            &e.v_scan_m_s,
        ),
    ];
    fields.extend(spread);
    VelocityMap {
        title: "Radial velocity of a wake-vortex scan".into(),
        rays: (0..g.elevation_rad.len()).map(ray).collect(),
        range_m: e.range_m.clone(),
        sweeps: g.schedule.sweeps.iter().map(sweep).collect(),
        pulse: pulse_info(scene),
        fields,
        lidar_y_m: mount.position_m[1],
        lidar_height_m: scene.scan.lidar_height_m,
        flight: (!across).then_some((mount.position_m[0], zero_rad - from_x_rad)),
        site: scene.site.clone(),
        is_simulated: true,
    }
}
