//! Wakes of the program as they are compared, and how far apart two curves are.

use crate::wakes;
use crate::workspace::root;
use wakescope_sim::flow::CaseKind;

// What the cases are made of.
pub(super) use super::Shown;
pub(super) use crate::claim::Claim;
pub(super) use crate::profile::Profile;
pub(super) use crate::workspace::numbers;
pub(super) use fixtures::failure::Failure;
pub(super) use wakescope_les::analysis::decay::{onset, value_at};
pub(super) use wakescope_sim::flow::{FinishedWake, Subgrid, WakeFlow, WakePreset};
pub(super) use wakescope_sim::io::Table;
pub(super) use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

/// Points of a curve.
pub(super) type Curve = Vec<(f64, f64)>;

/// The multiscale model as it is by default.
pub(super) const MULTISCALE: Subgrid = Subgrid::MultiscaleWale {
    constant: None,
    order: None,
};

/// The history of a preset's flow with a change, without a model unless one is given, to an age.
pub(super) fn run(
    preset: WakePreset,
    subgrid: Subgrid,
    end_tau: f64,
    change: impl FnOnce(&mut WakeFlow),
) -> Result<FinishedWake, Failure> {
    let mut case = preset.case();
    case.solver.subgrid = subgrid;
    (case.output.fields, case.output.planes) = (Vec::new(), Vec::new());
    if let Some(output) = &mut case.wake {
        (output.end_tau, output.fields_tau, output.planes_tau) =
            (end_tau, Some(Vec::new()), Some(Vec::new()));
    }
    if let CaseKind::Wake(flow) = &mut case.case {
        change(flow);
    }
    wakes::run(&case, &root().join("target/validation/wakes"), false)
}

/// The same flow on one cell along the flight.
pub(super) fn plane(flow: &mut WakeFlow) {
    flow.cells[0] = 1;
}

/// A table of curves at the same places, a column for each.
pub(super) fn table_of(places: &str, curves: &[(&str, &Curve)]) -> Table {
    let table = Table::new().float(places, curves[0].1.iter().map(|p| p.0));
    curves.iter().fold(table, |table, (name, curve)| {
        table.float(name, curve.iter().map(|p| p.1))
    })
}

/// A column of stored rows against the first.
pub(super) fn stored_curve(rows: &[Vec<f64>], column: usize) -> Curve {
    rows.iter().map(|row| (row[0], row[column])).collect()
}

/// Largest value of `difference(measured, stored)` at the stored times from `from` to `to`.
pub(super) fn worst(
    measured: &[(f64, f64)],
    stored: &[(f64, f64)],
    [from, to]: [f64; 2],
    difference: impl Fn(f64, f64) -> f64,
) -> f64 {
    let within = stored
        .iter()
        .filter(|p| p.0 > from - 1e-9 && p.0 < to + 1e-9);
    // What is no number is no agreement.
    within
        .map(|p| difference(value_at(measured, p.0), p.1))
        .fold(0.0, |most, d| if d > most || d.is_nan() { d } else { most })
}

pub(super) fn apart(a: f64, b: f64) -> f64 {
    (a - b).abs()
}

pub(super) fn relative(a: f64, b: f64) -> f64 {
    (a / b - 1.0).abs()
}
