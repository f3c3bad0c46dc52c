//! Winds of a scan of this program: those that `wakescope wind` finds in its first realisation, beside the true ones.
//!
//! Check: a scan of one realisation has the winds of its own `map.nc`; the truth of linear winds.

use super::{Every, WindOptions, WindProfiles, Window, table, wind_profiles, windows};
use crate::beams::{Direction, Schedule};
use crate::io::Table;
use crate::io::map::VelocityMap;
use crate::io::scans::{Ray, RaySweep};
use crate::plan::Plan;
use crate::retrieve::gate_of_instrument;
use crate::scene::Scene;
use crate::{Error, SPEED_OF_LIGHT_M_S};
use std::f64::consts::FRAC_PI_2;

impl WindOptions {
    /// The gates of a scene.
    ///
    /// # Errors
    /// What pulse or window refuse; a checked scene gives none.
    pub fn of_scene(scene: &Scene) -> Result<Self, Error> {
        let (gate, _) = gate_of_instrument(None, None, None, Some(scene))?;
        Ok(Self {
            gate_std_m: gate.std_m(),
            gate_stride: gate_stride(scene),
            ..Self::default()
        })
    }
}

/// Gates this many apart share no air: neither samples of the windows of their regions nor scatterers of one pulse, whose speckle
/// correlates their errors as eddies would.
pub(crate) fn gate_stride(scene: &Scene) -> usize {
    let estimator = &scene.estimator;
    let sampling_hz = scene.detector.sampling_hz;
    let sample_m = 0.5 * SPEED_OF_LIGHT_M_S / sampling_hz;
    let region = 2.0 * estimator.largest_radius_m(scene.scan.range_max_m) / sample_m;
    let pulse = scene.pulse_width_s() * sampling_hz;
    let samples = estimator.window_samples as f64 + region + pulse;
    (samples / estimator.gate_step_samples.max(1) as f64).ceil() as usize
}

/// The winds of the first realisation of a scan, as far as its beams determine them, and the true ones; a window for each sweep. The
/// options of its own scene are
/// [`WindOptions::of_scene`].
///
/// # Errors
/// What the fits or the wind refuse; a checked scene gives none.
pub fn winds_of_map(
    plan: &Plan,
    map: &VelocityMap,
    options: &WindOptions,
) -> Result<WindProfiles, Error> {
    let (windows, reference, _) = windows(ray_sweeps(&plan.geometry.schedule, map), Every::Sweep)?;
    let mut profiles = wind_profiles(&windows, reference, options)?;
    profiles.true_m_s = true_winds_m_s(plan, map, &windows, &profiles)?;
    Ok(profiles)
}

/// The lines of sight of the first realisation.
fn ray_sweeps(schedule: &Schedule, map: &VelocityMap) -> Vec<RaySweep> {
    let mut sweeps = Vec::with_capacity(map.sweeps.len());
    for sweep in 0..map.sweeps.len() {
        sweeps.push(RaySweep {
            sweep,
            reference: Some(map.start()),
            ..RaySweep::default()
        });
    }
    let fold_m_s = (!map.pulse.is_mirrored()).then_some(2.0 * map.pulse.nyquist_velocity_m_s);
    let Some(field) = map.field("v_scan") else {
        return sweeps;
    };
    for (line, ray) in map.rays.iter().enumerate() {
        // Velocities are relative to the lidar.
        let beam = schedule.middle(line);
        let own_m_s = -beam
            .direction
            .radial_velocity_m_s([0.0; 3], beam.velocity_m_s);
        let velocity_m_s = field.values.row(line).mapv(|seen_m_s| seen_m_s + own_m_s);
        sweeps[ray.sweep].rays.push(Ray {
            azimuth_rad: ray.azimuth_rad,
            elevation_rad: ray.elevation_rad,
            time_s: ray.time_s,
            range_m: map.range_m.clone(),
            velocity_m_s: velocity_m_s.to_vec(),
            sigma_m_s: Vec::new(),
            fold_m_s,
        });
    }
    sweeps
}

/// True winds of rows (east, north, up), m/s.
fn true_winds_m_s(
    plan: &Plan,
    map: &VelocityMap,
    windows: &[Window],
    profiles: &WindProfiles,
) -> Result<Vec<[f64; 3]>, Error> {
    let x_axis_rad = map.flight.map_or(FRAC_PI_2, |(_, azimuth_rad)| azimuth_rad);
    let east = Direction::new(FRAC_PI_2 - x_axis_rad, 0.0).0;
    let north = Direction::new(-x_axis_rad, 0.0).0;
    let bounds = map.sweep_bounds();
    let mut winds_m_s = Vec::with_capacity(profiles.rows.len());
    for row in &profiles.rows {
        let rays = &windows[row.window - 1].rays;
        let time_s = rays.iter().map(|ray| ray.time_s).sum::<f64>() / rays.len() as f64;
        let (first, _) = bounds[row.window - 1];
        let lidar_m = plan.geometry.schedule.middle(first).position_m;
        let above_m = [lidar_m[0], lidar_m[1], lidar_m[2] + row.height_m];
        let mut found = [[f64::NAN; 3]];
        let air = plan.wind.without_eddies();
        air.velocity_into(&[above_m], time_s, &mut found)?;
        let [u, v, w] = found[0];
        winds_m_s.push([u * east[0] + v * east[1], u * north[0] + v * north[1], w]);
    }
    Ok(winds_m_s)
}

/// The table of winds with the true ones.
#[must_use]
pub fn table_with_truth(winds: &WindProfiles) -> Table {
    let mut all = table(winds);
    for (axis, name) in ["east", "north", "up"].into_iter().enumerate() {
        let values: Vec<f64> = winds.true_m_s.iter().map(|wind| wind[axis]).collect();
        all = all.float(&format!("{name}_true_m_s"), values);
    }
    all
}
