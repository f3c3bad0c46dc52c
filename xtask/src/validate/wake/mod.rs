//! The vortex pair near the ground in space: histories of runs, and what the bars are measured from.
//!
//! References: an independent code in the same box with the same noise formula (`tests/reference/les/wake_3d_*.csv`).

mod bars;
mod crosswind;
mod files;
mod onset;

pub(super) use bars::{show_coarse, show_files, show_medium};
pub(super) use crosswind::show as show_crosswind;
pub(super) use onset::show as show_onset;

use super::{interpolate, numbers};
use crate::Failure;
use std::f64::consts::TAU;
use wakescope_les::cases::VortexPairCase;
use wakescope_les::analysis::{WakeMeter, WakeRecord, WakeScales};

/// Records per unit of tau.
pub(super) const PER_TAU: usize = 20;

/// One run, in the units of the pair.
pub(super) struct History {
    pub(super) records: Vec<WakeRecord>,
    /// Largest relative residual of the energy budget of a step, from tau = 0.1 on.
    pub(super) budget_error: f64,
    /// Largest relative difference of the dissipation of a record by its vorticity and by its viscous power, from tau = 0.1 on.
    pub(super) dissipation_error: f64,
}

impl History {
    /// A quantity against tau.
    pub(super) fn curve(&self, of: impl Fn(&WakeRecord) -> f64) -> Vec<(f64, f64)> {
        self.records.iter().map(|r| (r.time_s, of(r))).collect()
    }

    /// `Gamma_5-15` of the left or right vortex over its initial value.
    pub(super) fn gamma(&self, right: bool) -> Vec<(f64, f64)> {
        let of = |r: &WakeRecord| if right { r.right.gamma_5_15_m2_s } else { r.left.gamma_5_15_m2_s };
        let first = of(&self.records[0]);
        self.curve(|r| of(r) / first)
    }

    /// The mean of both.
    pub(super) fn mean_gamma(&self, tau: f64) -> f64 {
        0.5 * (interpolate(&self.gamma(false), tau) + interpolate(&self.gamma(true), tau))
    }
}

/// Runs the pair to `end`.
pub(super) fn run(pair: &VortexPairCase, end: f64) -> Result<History, Failure> {
    run_with(pair, pair.meter(&WakeScales::REDUCED)?, end)
}

/// The same with a meter of one's own.
pub(super) fn run_with(pair: &VortexPairCase, mut meter: WakeMeter, end: f64) -> Result<History, Failure> {
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
pub(super) struct Stored(Vec<Vec<f64>>);

impl Stored {
    /// Columns of the files.
    pub(super) const GAMMA: [usize; 2] = [1, 2];
    pub(super) const Y: [usize; 2] = [3, 5];
    pub(super) const Z: [usize; 2] = [4, 6];
    pub(super) const ENERGY: usize = 11;
    pub(super) const ENSTROPHY: usize = 12;
    pub(super) const ENERGY_3D: usize = 13;
    pub(super) const MODE_2: usize = 19;
    pub(super) const MODE_3: usize = 20;

    pub(super) fn read(file: &str) -> Result<Self, Failure> {
        Ok(Self(numbers(file)?))
    }

    pub(super) fn curve(&self, column: usize) -> Vec<(f64, f64)> {
        self.0.iter().map(|row| (row[0], row[column])).collect()
    }
}

/// Largest value of `difference(measured, stored)` at the stored times from `from` to `to`.
pub(super) fn worst(
    measured: &[(f64, f64)],
    stored: &[(f64, f64)],
    [from, to]: [f64; 2],
    difference: impl Fn(f64, f64) -> f64,
) -> f64 {
    let within = stored.iter().filter(|p| p.0 > from - 1e-9 && p.0 < to + 1e-9);
    within.map(|p| difference(interpolate(measured, p.0), p.1)).fold(0.0, f64::max)
}

/// When the fast decay begins: where the loss of the ratio per tau first exceeds three times its mean over 0.5 to 1.5.
pub(crate) fn onset(gamma: &[(f64, f64)]) -> Option<f64> {
    let early = interpolate(gamma, 0.5) - interpolate(gamma, 1.5);
    let last = gamma.last()?.0;
    let slope = |tau: f64| (interpolate(gamma, tau - 0.05) - interpolate(gamma, tau + 0.05)) / 0.1;
    (0..).map(|i| 1.5 + 0.02 * f64::from(i)).take_while(|tau| tau + 0.05 <= last).find(|tau| slope(*tau) > 3.0 * early)
}

/// Where the line through the ratio at 0.5 and 1.5 meets the steepest line over 0.8: a beginning of the fast decay that
/// does not depend on how slow the decay before it is; none if the steepest line is less than twice as steep.
pub(crate) fn knee(gamma: &[(f64, f64)]) -> Option<f64> {
    let at = |tau: f64| interpolate(gamma, tau);
    let last = gamma.last()?.0;
    let early = at(1.5) - at(0.5);
    let starts = (0..).map(|i| 1.5 + 0.02 * f64::from(i)).take_while(|tau| tau + 0.8 <= last);
    let from = starts.min_by(|a, b| (at(a + 0.8) - at(*a)).total_cmp(&(at(b + 0.8) - at(*b))))?;
    let steep = (at(from + 0.8) - at(from)) / 0.8;
    (steep < 2.0 * early).then(|| (at(from) - steep * from - at(0.5) + 0.5 * early) / (early - steep))
}

/// Amplitude growth rate of a mode whose energy is given: half the slope of its logarithm from `from` to `to`.
pub(super) fn growth(energy: &[(f64, f64)], from: f64, to: f64) -> f64 {
    0.5 * (interpolate(energy, to) / interpolate(energy, from)).ln() / (to - from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broken_line_has_its_knee_and_its_onset_where_it_breaks() {
        let gamma: Vec<(f64, f64)> = (0..=100)
            .map(|i| 0.05 * f64::from(i))
            .map(|tau| (tau, 1.0 - 0.01 * tau - 0.3 * (tau - 2.4).max(0.0) + 0.25 * (tau - 3.6).max(0.0)))
            .collect();
        assert!((knee(&gamma).unwrap() - 2.4).abs() < 1e-9);
        assert!((onset(&gamma).unwrap() - 2.4).abs() < 0.06);
        let straight: Vec<(f64, f64)> = gamma.iter().map(|(tau, _)| (*tau, 1.0 - 0.06 * tau)).collect();
        assert!(onset(&straight).is_none() && knee(&straight).is_none());
    }
}
