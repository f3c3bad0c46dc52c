//! The wind of a VAD or DBS scan averaged over its sweeps and ranges.

use crate::Error;
use crate::plan::Plan;
use ndarray::Array2;
use wakescope_estimate::wind_profile::fit_wind;

/// Wind (u, v, w) of radial velocities \[line, gate\], m/s, by least squares over the beams of each sweep and range; none of scans whose
/// beams determine none.
///
/// # Errors
/// What the fits of winds refuse; a checked scene gives none.
pub(super) fn mean_wind_m_s(
    plan: &Plan,
    velocity_m_s: &Array2<f64>,
) -> Result<Option<[f64; 3]>, Error> {
    if !plan.scene().scan.pattern.has_beam_winds() {
        return Ok(None);
    }
    let schedule = &plan.geometry.schedule;
    let mut sum_m_s = [0.0; 3];
    let mut count = 0.0;
    for sweep in 0..schedule.sweeps.len() {
        let mut lines = Vec::new();
        let mut directions = Vec::new();
        for line in 0..schedule.lines.len() {
            if schedule.lines[line].sweep == sweep {
                lines.push(line);
                directions.push(schedule.middle(line).direction.0);
            }
        }
        for gate in velocity_m_s.columns() {
            let seen_m_s: Vec<f64> = lines.iter().map(|line| gate[*line]).collect();
            let Some(fit) = fit_wind(&directions, &seen_m_s)? else {
                continue;
            };
            if fit.velocity_m_s.iter().all(|part| part.is_finite()) {
                for (sum, part) in sum_m_s.iter_mut().zip(fit.velocity_m_s) {
                    *sum += part;
                }
                count += 1.0;
            }
        }
    }
    Ok(Some(sum_m_s.map(|sum| sum / count)))
}
