//! The map of a scan of the set, and the true velocity of each of its gates.
//! Check: the velocities of signals differ from the true ones by their noise.

use super::cases::ScanCase;
use fixtures::failure::Failure;
use ndarray::Array2;
use wakescope_sim::io::VelocityMap;
use wakescope_sim::measure::map::VelocityEstimates;
use wakescope_sim::write::velocity_map;
use wakescope_sim::{Plan, Silent, run};

/// Fields of the files.
pub(super) const FIELDS: [&str; 2] = ["radial_velocity", "signal_to_noise_ratio"];

/// Signal-to-noise ratio that files with the velocities of the air state, dB.
const EXACT_SNR_DB: f64 = 20.0;

/// A scan of the set.
pub(super) struct Scan {
    pub(super) plan: Plan,
    /// As it is written.
    pub(super) map: VelocityMap,
    /// True radial velocity \[ray, gate\] at the centres of the gates, m/s, positive away from the lidar.
    pub(super) true_m_s: Array2<f64>,
}

impl Scan {
    /// The scan of a plan, with the peculiarities of its case.
    pub(super) fn new(plan: Plan, case: &ScanCase) -> Result<Self, Failure> {
        let true_m_s = true_velocities_m_s(&plan)?;
        let estimates = match case.snr_db {
            None => of_air(&plan, &true_m_s),
            Some(_) => {
                let found = run(&plan, &Silent)?.map;
                found.ok_or_else(|| Failure::new("the plan has no map".into()))?
            }
        };
        let mut map = velocity_map(&plan, &estimates);
        map.fields
            .retain(|field| FIELDS.contains(&field.name.as_str()));
        for field in &mut map.fields {
            // The fields that say how good it is are left out.
            field.ancillary.clear();
        }
        if !case.nyquist_m_s.is_empty() {
            fold(&mut map, &case.nyquist_m_s);
        }
        remove(&mut map, case);
        Ok(Self {
            plan,
            map,
            true_m_s,
        })
    }

    /// Cells (ray, gate) without a velocity.
    pub(super) fn missing(&self) -> Vec<[usize; 2]> {
        let mut out = Vec::new();
        if let Some(field) = self.map.field(FIELDS[0]) {
            for ((ray, gate), velocity_m_s) in field.values.indexed_iter() {
                if velocity_m_s.is_nan() {
                    out.push([ray, gate]);
                }
            }
        }
        out
    }
}

/// True radial velocity \[ray, gate\] at the middle of each line, m/s, positive away from the lidar.
fn true_velocities_m_s(plan: &Plan) -> Result<Array2<f64>, Failure> {
    let geometry = &plan.geometry;
    let gates = &geometry.gate_range_m;
    let mut out = Array2::zeros((geometry.schedule.lines.len(), gates.len()));
    for (line, mut row) in out.rows_mut().into_iter().enumerate() {
        let beam = geometry.schedule.middle(line);
        let points_m: Vec<[f64; 3]> = gates.iter().map(|r| beam.at_range_m(*r)).collect();
        let mut wind_m_s = vec![[0.0; 3]; points_m.len()];
        let time_s = plan.wind.start_s + beam.time_s;
        let wind = plan.wind.wind();
        wind.velocity_into(&points_m, time_s, &mut wind_m_s)?;
        for (value, wind_m_s) in row.iter_mut().zip(wind_m_s) {
            *value = beam
                .direction
                .radial_velocity_m_s(wind_m_s, beam.velocity_m_s);
        }
    }
    Ok(out)
}

/// Estimates without an error.
fn of_air(plan: &Plan, true_m_s: &Array2<f64>) -> VelocityEstimates {
    VelocityEstimates {
        elevation_rad: plan.geometry.elevation_rad.clone(),
        range_m: plan.geometry.gate_range_m.clone(),
        v_mean_m_s: true_m_s.clone(),
        snr_db: Array2::from_elem(true_m_s.dim(), EXACT_SNR_DB),
        ..VelocityEstimates::default()
    }
}

/// Folds the velocities of each sweep into its Nyquist interval, as complex samples do.
fn fold(map: &mut VelocityMap, nyquist_m_s: &[f64]) {
    map.pulse.nyquist_velocity_m_s = nyquist_m_s[0];
    map.pulse.sampling_hz = 4.0 * nyquist_m_s[0] / map.pulse.wavelength_m();
    for (sweep, nyquist_m_s) in map.sweeps.iter_mut().zip(nyquist_m_s) {
        sweep.nyquist_velocity_m_s = Some(*nyquist_m_s);
    }
    let rays = &map.rays;
    for field in &mut map.fields {
        if field.name != FIELDS[0] {
            continue;
        }
        for ((ray, _), velocity_m_s) in field.values.indexed_iter_mut() {
            let width_m_s = 2.0 * nyquist_m_s[rays[ray].sweep];
            *velocity_m_s -= width_m_s * (*velocity_m_s / width_m_s).round();
        }
    }
}

/// Removes the velocities that the case has not, and what was said of their signals.
fn remove(map: &mut VelocityMap, case: &ScanCase) {
    for block in &case.missing {
        for field in &mut map.fields {
            let [first_ray, last_ray] = block.rays;
            let [first_gate, last_gate] = block.gates;
            field
                .values
                .slice_mut(ndarray::s![first_ray..=last_ray, first_gate..=last_gate])
                .fill(f64::NAN);
        }
    }
}
