//! Histories of runs of the pair, and how far apart two are.

use crate::references::numbers;
use fixtures::failure::Failure;
use std::f64::consts::TAU;
use wakescope_les::analysis::decay::value_at;
use wakescope_les::analysis::{WakeMeter, WakeRecord, WakeScales};
use wakescope_les::cases::VortexPairCase;

/// Records per unit of tau.
pub(crate) const PER_TAU: usize = 20;

/// A name, and what it is of a record.
type Column = (&'static str, fn(&WakeRecord) -> f64);

/// Columns of a history, by the names that `wake.csv` has for them, in the units of the pair.
pub(super) const COLUMNS: [Column; 21] = [
    ("tau", |r| r.time_s),
    ("gamma_5_15_left", |r| r.left.gamma_5_15_m2_s / TAU),
    ("gamma_5_15_right", |r| r.right.gamma_5_15_m2_s / TAU),
    ("y_left", |r| r.left.y_m),
    ("z_left", |r| r.left.z_m),
    ("y_right", |r| r.right.y_m),
    ("z_right", |r| r.right.z_m),
    ("energy", |r| r.energy_m4_s2),
    ("enstrophy", |r| r.enstrophy_m2_s2),
    ("energy_3d", WakeRecord::energy_3d_m4_s2),
    ("gamma_opposite_left", |r| r.left.gamma_opposite_m2_s / TAU),
    ("gamma_opposite_right", |r| r.right.gamma_opposite_m2_s / TAU),
    ("secondary_y_left", |r| r.left.secondary.y_m),
    ("secondary_z_left", |r| r.left.secondary.z_m),
    ("secondary_y_right", |r| r.right.secondary.y_m),
    ("secondary_z_right", |r| r.right.secondary.z_m),
    ("wall_units", |r| r.wall_units),
    ("secondary_gamma_left", |r| r.left.secondary.gamma_m2_s / TAU),
    ("secondary_gamma_right", |r| r.right.secondary.gamma_m2_s / TAU),
    ("energy_mode_2", mode::<2>),
    ("energy_mode_3", mode::<3>),
];

/// Energy of a mode along the flight, of which a plane flow has the first alone.
fn mode<const MODE: usize>(record: &WakeRecord) -> f64 {
    record.mode_energy_m4_s2.get(MODE).copied().unwrap_or(f64::NAN)
}

/// One run, in the units of the pair.
pub(crate) struct History {
    /// In the order of [`COLUMNS`].
    pub(super) columns: Vec<Vec<f64>>,
    /// Largest relative residual of the energy budget of a step, from tau = 0.1 on.
    pub(crate) budget_error: f64,
    /// Largest relative difference of the dissipation of a record by its vorticity and by its viscous power, from tau = 0.1 on.
    pub(crate) dissipation_error: f64,
}

impl History {
    /// The values of a column; none of one that is not there.
    pub(crate) fn column(&self, name: &str) -> &[f64] {
        let place = COLUMNS.iter().position(|column| column.0 == name);
        place.and_then(|place| self.columns.get(place)).map_or(&[], Vec::as_slice)
    }

    /// A column against tau.
    pub(crate) fn curve(&self, name: &str) -> Vec<(f64, f64)> {
        self.column("tau").iter().copied().zip(self.column(name).iter().copied()).collect()
    }

    /// `Gamma_5-15` of the left or right vortex over its initial value.
    pub(crate) fn gamma(&self, right: bool) -> Vec<(f64, f64)> {
        let curve = self.curve(if right { "gamma_5_15_right" } else { "gamma_5_15_left" });
        curve.iter().map(|(tau, gamma)| (*tau, gamma / curve[0].1)).collect()
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
    let mut records = vec![meter.measure(&flow)?];
    let [mut budget_error, mut dissipation_error] = [0.0_f64; 2];
    // Energy rate of a step and the powers at its start wait for the powers at its end.
    let mut open: Option<(f64, f64)> = None;
    let mut measured = 2.0 * viscosity * length * records[0].enstrophy_m2_s2;
    for i in 1..=(end * PER_TAU as f64).round() as usize {
        let until = i as f64 / PER_TAU as f64;
        while flow.time_s() < until {
            let (time, energy) = (flow.time_s(), flow.kinetic_energy_m5_s2());
            let report = flow.step_towards(until)?;
            let power = report.viscous_power_m5_s3 + report.subgrid_power_m5_s3;
            if let Some((rate, before)) = open
                && time > 0.1
            {
                budget_error = budget_error.max((rate / (0.5 * (before + power)) - 1.0).abs());
            }
            if measured.is_finite() && time > 0.1 {
                let error = (-report.viscous_power_m5_s3 / measured - 1.0).abs();
                dissipation_error = dissipation_error.max(error);
            }
            measured = f64::NAN;
            open = Some(((report.kinetic_energy_m5_s2 - energy) / report.step_s, power));
        }
        let record = meter.measure(&flow)?;
        measured = 2.0 * viscosity * length * record.enstrophy_m2_s2;
        records.push(record);
    }
    let columns = COLUMNS.iter().map(|(_, of)| records.iter().map(of).collect()).collect();
    Ok(History { columns, budget_error, dissipation_error })
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
    // What is no number is no agreement.
    within
        .map(|p| difference(value_at(measured, p.0), p.1))
        .fold(0.0, |most, d| if d > most || d.is_nan() { d } else { most })
}
