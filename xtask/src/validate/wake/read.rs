//! The history of a run that `wakescope wake` made, read from its files.

use super::history::{COLUMNS, History};
use fixtures::failure::Failure;
use std::f64::consts::TAU;
use wakescope_sim::flow::{FinishedWake, table};

impl History {
    /// That of a run, in the units of the pair.
    pub(super) fn read(wake: &FinishedWake) -> Result<Self, Failure> {
        let columns = COLUMNS.iter().map(|(name, _)| Ok(wake.column(name)?.to_vec()));
        let columns = columns.collect::<Result<_, Failure>>()?;
        let [budget_error, dissipation_error] = errors(wake)?;
        Ok(Self { columns, budget_error, dissipation_error })
    }
}

/// Largest relative errors of the energy budget of a step, and of the dissipation of a record by its vorticity.
fn errors(wake: &FinishedWake) -> Result<[f64; 2], Failure> {
    let steps = table(&wake.folder.join("steps.csv"))?;
    let column = |name: &str| steps.get(name).ok_or_else(|| Failure::new(format!("steps.csv has no column {name}")));
    let (time, step) = (column("time_s")?, column("step_s")?);
    let (rate, residual) = (column("energy_rate_m5_s3")?, column("energy_residual_m5_s3")?);
    let viscous = column("viscous_power_m5_s3")?;
    let scales = wake.flow.pair.scales()?;
    let (b0_m, speed_m_s, unit_s) = (scales.spacing_m, scales.descent_speed_m_s(), scales.time_unit_s());
    let early_s = 0.1 * unit_s;
    let late = |i: &usize| time[*i] - step[*i] > early_s && residual[*i].is_finite();
    // What the powers leave of the rate, over what they give.
    let budget =
        (0..time.len()).filter(late).map(|i| (residual[i] / (rate[i] - residual[i])).abs()).fold(0.0, f64::max);
    let power_unit = b0_m.powi(2) * speed_m_s.powi(3);
    let viscosity = TAU / wake.flow.reynolds;
    let mut dissipation = 0.0_f64;
    for (tau, enstrophy) in wake.curve("enstrophy")?.into_iter().filter(|p| p.0 > 0.1) {
        // The step that begins with the record reports the power there.
        let begins = |i: &usize| (time[*i] - step[*i] - tau * unit_s).abs() < 1e-6 * unit_s;
        if let Some(i) = (0..time.len()).find(begins) {
            let measured = 2.0 * viscosity * wake.flow.size[0] * enstrophy;
            dissipation = dissipation.max((-viscous[i] / power_unit / measured - 1.0).abs());
        }
    }
    Ok([budget, dissipation])
}
