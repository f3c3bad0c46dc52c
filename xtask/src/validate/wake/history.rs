//! Histories of runs of the pair, and how far apart two are.

use crate::references::numbers;
use fixtures::failure::Failure;
use std::f64::consts::TAU;
use wakescope_les::analysis::decay::value_at;
use wakescope_les::analysis::{WakeMeter, WakeRecord, WakeScales};
use wakescope_les::cases::VortexPairCase;

/// Records per unit of tau.
pub(crate) const PER_TAU: usize = 20;

/// One run, in the units of the pair.
pub(crate) struct History {
    pub(crate) records: Vec<WakeRecord>,
    /// Largest relative residual of the energy budget of a step, from tau = 0.1 on.
    pub(crate) budget_error: f64,
    /// Largest relative difference of the dissipation of a record by its vorticity and by its viscous power, from tau = 0.1 on.
    pub(crate) dissipation_error: f64,
}

impl History {
    /// A quantity against tau.
    pub(crate) fn curve(&self, of: impl Fn(&WakeRecord) -> f64) -> Vec<(f64, f64)> {
        self.records.iter().map(|r| (r.time_s, of(r))).collect()
    }

    /// `Gamma_5-15` of the left or right vortex over its initial value.
    pub(crate) fn gamma(&self, right: bool) -> Vec<(f64, f64)> {
        let of = |r: &WakeRecord| if right { r.right.gamma_5_15_m2_s } else { r.left.gamma_5_15_m2_s };
        let first = of(&self.records[0]);
        self.curve(|r| of(r) / first)
    }

    /// The mean of both.
    pub(crate) fn mean_gamma(&self, tau: f64) -> f64 {
        0.5 * (value_at(&self.gamma(false), tau) + value_at(&self.gamma(true), tau))
    }
}

/// Runs the pair to `end`.
pub(crate) fn run(pair: &VortexPairCase, end: f64) -> Result<History, Failure> {
    run_with(pair, pair.meter(&WakeScales::REDUCED)?, end)
}

/// The same with a meter of one's own.
pub(crate) fn run_with(pair: &VortexPairCase, mut meter: WakeMeter, end: f64) -> Result<History, Failure> {
    let (mut flow, _) = pair.clone().case(VortexPairCase::steps(0.01))?.start()?;
    let [length, viscosity] = [pair.size[0], TAU / pair.reynolds];
    let mut history = History { records: vec![meter.measure(&flow)?], budget_error: 0.0, dissipation_error: 0.0 };
    // Energy rate of a step and the powers at its start wait for the powers at its end.
    let mut open: Option<(f64, f64)> = None;
    let mut measured = 2.0 * viscosity * length * history.records[0].enstrophy_m2_s2;
    for i in 1..=(end * PER_TAU as f64).round() as usize {
        let until = i as f64 / PER_TAU as f64;
        while flow.time_s() < until {
            let (time, energy) = (flow.time_s(), flow.kinetic_energy_m5_s2());
            let report = flow.step_towards(until)?;
            let power = report.viscous_power_m5_s3 + report.subgrid_power_m5_s3;
            if let Some((rate, before)) = open
                && time > 0.1
            {
                history.budget_error = history.budget_error.max((rate / (0.5 * (before + power)) - 1.0).abs());
            }
            if measured.is_finite() && time > 0.1 {
                let error = (-report.viscous_power_m5_s3 / measured - 1.0).abs();
                history.dissipation_error = history.dissipation_error.max(error);
            }
            measured = f64::NAN;
            open = Some(((report.kinetic_energy_m5_s2 - energy) / report.step_s, power));
        }
        let record = meter.measure(&flow)?;
        measured = 2.0 * viscosity * length * record.enstrophy_m2_s2;
        history.records.push(record);
    }
    Ok(history)
}

/// A stored run of the independent code: its rows, `tau` first.
pub(crate) struct Stored(Vec<Vec<f64>>);

impl Stored {
    /// Columns of the files.
    pub(crate) const GAMMA: [usize; 2] = [1, 2];
    pub(crate) const Y: [usize; 2] = [3, 5];
    pub(crate) const Z: [usize; 2] = [4, 6];
    pub(crate) const ENERGY: usize = 11;
    pub(crate) const ENSTROPHY: usize = 12;
    pub(crate) const ENERGY_3D: usize = 13;
    pub(crate) const MODE_2: usize = 19;
    pub(crate) const MODE_3: usize = 20;

    pub(crate) fn read(file: &str) -> Result<Self, Failure> {
        Ok(Self(numbers(file)?))
    }

    pub(crate) fn curve(&self, column: usize) -> Vec<(f64, f64)> {
        self.0.iter().map(|row| (row[0], row[column])).collect()
    }
}

/// Largest value of `difference(measured, stored)` at the stored times from `from` to `to`.
pub(crate) fn worst(
    measured: &[(f64, f64)],
    stored: &[(f64, f64)],
    [from, to]: [f64; 2],
    difference: impl Fn(f64, f64) -> f64,
) -> f64 {
    let within = stored.iter().filter(|p| p.0 > from - 1e-9 && p.0 < to + 1e-9);
    within.map(|p| difference(value_at(measured, p.0), p.1)).fold(0.0, f64::max)
}
