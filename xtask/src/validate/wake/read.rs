//! The history of a run that `wakescope wake` made, read from its files.

use super::history::History;
use fixtures::failure::Failure;
use std::f64::consts::TAU;
use wakescope_les::{analysis::SecondaryRecord, analysis::VortexRecord, analysis::WakeRecord};
use wakescope_sim::flow::{FinishedWake, table};

/// Modes whose energy is in the table.
const MODES: usize = 9;

impl History {
    /// That of a run, in the units of the pair.
    pub(super) fn read(wake: &FinishedWake) -> Result<Self, Failure> {
        let rows = wake.column("tau")?.len();
        let records: Vec<WakeRecord> = (0..rows).map(|row| record(wake, row)).collect::<Result<_, _>>()?;
        let [budget_error, dissipation_error] = errors(wake, &records)?;
        Ok(Self { records, budget_error, dissipation_error })
    }
}

fn record(wake: &FinishedWake, row: usize) -> Result<WakeRecord, Failure> {
    let number = |name: &str| Ok::<f64, Failure>(wake.column(name)?[row]);
    let vortex = |side: &str| {
        let of = |name: &str| number(&format!("{name}_{side}"));
        Ok::<_, Failure>(VortexRecord {
            y_m: of("y")?,
            z_m: of("z")?,
            slices_m: Vec::new(),
            y_spread_m: of("y_spread")?,
            z_spread_m: of("z_spread")?,
            gamma_5_15_m2_s: TAU * of("gamma_5_15")?,
            gamma_m2_s: Vec::new(),
            gamma_opposite_m2_s: TAU * of("gamma_opposite")?,
            secondary: SecondaryRecord {
                y_m: of("secondary_y")?,
                z_m: of("secondary_z")?,
                y_spread_m: of("secondary_y_spread")?,
                z_spread_m: of("secondary_z_spread")?,
                gamma_m2_s: TAU * of("secondary_gamma")?,
            },
            outward_shear_per_s: of("outward_shear")?,
        })
    };
    Ok(WakeRecord {
        time_s: number("tau")?,
        left: vortex("left")?,
        right: vortex("right")?,
        energy_m4_s2: number("energy")?,
        mode_energy_m4_s2: (0..MODES).map(|m| number(&format!("energy_mode_{m}"))).collect::<Result<_, _>>()?,
        enstrophy_m2_s2: number("enstrophy")?,
        wall_shear_per_s: number("wall_shear")?,
        wall_units: number("wall_units")?,
    })
}

/// Largest relative errors of the energy budget of a step, and of the dissipation of a record by its vorticity.
fn errors(wake: &FinishedWake, records: &[WakeRecord]) -> Result<[f64; 2], Failure> {
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
    for record in records.iter().filter(|r| r.time_s > 0.1) {
        // The step that begins with the record reports the power there.
        let begins = |i: &usize| (time[*i] - step[*i] - record.time_s * unit_s).abs() < 1e-6 * unit_s;
        if let Some(i) = (0..time.len()).find(begins) {
            let measured = 2.0 * viscosity * wake.flow.size[0] * record.enstrophy_m2_s2;
            dissipation = dissipation.max((-viscous[i] / power_unit / measured - 1.0).abs());
        }
    }
    Ok([budget, dissipation])
}
