//! Errors of retrievals over the realisations of a scene: a row for each method, vortex and quantity.
//!
//! Check: means and deviations by hand; failures are counted and not averaged.

use super::realisations::{RetrievalRow, SceneRetrieval, is_detected};
use super::table::{UNKNOWN, VORTEX, measured, name as word, with};
use super::truth::is_there;
use crate::io::Table;
use crate::scene::RetrievalMethod as Method;
use wakescope_estimate::Measured;
use wakescope_estimate::retrieval::Side;

/// Errors of one quantity of one vortex by one method: realisations, each as often as it has sweeps, and those without a value; the truth
/// of the first one, mean error and its standard error, standard deviation, root mean square error, and root mean square of the
/// deviations that the retrievals state.
type Errors = (Method, Side, &'static str, [usize; 2], [f64; 6]);

/// The columns of a vortex that are held against the truth; the rolling moment comes behind them.
const COMPARED: usize = 4;

/// Names of the quantities.
fn quantities() -> impl Iterator<Item = (usize, &'static str)> {
    VORTEX[..COMPARED]
        .iter()
        .map(|(name, _)| *name)
        .chain(["rolling_moment"])
        .enumerate()
}

/// What was found of a quantity, and the truth; NaN where it is not known.
fn quantity(row: &RetrievalRow, number: usize) -> (Measured, f64) {
    let (found, truth) = match VORTEX[..COMPARED].get(number) {
        Some((_, get)) => (
            row.found.as_ref().and_then(get),
            get(&row.truth).unwrap_or(UNKNOWN).value,
        ),
        None => (
            Some(Measured {
                value: row.rolling_moment.0,
                ..UNKNOWN
            }),
            row.rolling_moment.1,
        ),
    };
    (
        found
            .filter(|found| found.value.is_finite())
            .unwrap_or(UNKNOWN),
        truth,
    )
}

impl SceneRetrieval {
    /// The errors of all quantities whose truth is known, over the scans in which there is a vortex.
    fn errors(&self) -> Vec<Errors> {
        let mut all = Vec::new();
        // One scan has each method and side once.
        for first in self
            .rows
            .iter()
            .filter(|row| (row.realisation, row.sweep) == (0, 0))
        {
            let of = (first.method, first.truth.side);
            let is_own =
                |row: &&RetrievalRow| (row.method, row.truth.side) == of && is_there(&row.truth);
            let rows: Vec<_> = self.rows.iter().filter(is_own).collect();
            for (number, name) in quantities() {
                all.extend(
                    errors(number, &rows)
                        .map(|(counts, numbers)| (of.0, of.1, name, counts, numbers)),
                );
            }
        }
        all
    }

    /// Share of the maps whose test says wake; nothing without a test.
    #[must_use]
    pub fn detected(&self) -> Option<f64> {
        let found = self.tests.iter().filter(|test| is_detected(**test)).count();
        (!self.tests.is_empty()).then(|| found as f64 / self.tests.len() as f64)
    }

    /// The table of the errors.
    #[must_use]
    pub fn error_table(&self) -> Table {
        let all = self.errors();
        let number = |i: usize| all.iter().map(move |(.., numbers)| numbers[i]);
        let count = |i: usize| all.iter().map(move |(_, _, _, counts, _)| counts[i] as i64);
        Table::new()
            .text("method", all.iter().map(|(method, ..)| method.name()))
            .text("side", all.iter().map(|(_, side, ..)| word(side)))
            .text("quantity", all.iter().map(|(_, _, quantity, ..)| *quantity))
            .float("truth", number(0))
            .int("realisations", count(0))
            .int("failures", count(1))
            .float("bias", number(1))
            .float("bias_standard_error", number(2))
            .float("std", number(3))
            .float("rms", number(4))
            .float("stated_std", number(5))
    }

    /// The table of all vortices.
    #[must_use]
    pub fn table(&self) -> Table {
        let number =
            |get: &dyn Fn(&RetrievalRow) -> f64| self.rows.iter().map(get).collect::<Vec<_>>();
        let mut table = Table::new().int(
            "realisation",
            self.rows.iter().map(|row| row.realisation as i64),
        );
        if self.rows.iter().any(|row| row.sweep > 0) {
            table = table.int("sweep", self.rows.iter().map(|row| row.sweep as i64));
        }
        table = table
            .text("method", self.rows.iter().map(|row| row.method.name()))
            .text("side", self.rows.iter().map(|row| word(row.truth.side)))
            .float(
                "time_s",
                number(&|row| row.found.map_or(row.truth.time_s, |v| v.time_s)),
            );
        for (i, name) in quantities() {
            table = measured(table, name, self.rows.iter().map(|row| quantity(row, i).0))
                .float(&with(name, "true"), number(&|row| quantity(row, i).1));
        }
        let of_test = |row: &RetrievalRow| {
            self.tests
                .get(row.realisation)
                .copied()
                .unwrap_or((f64::NAN, f64::NAN))
        };
        table
            .float(
                "core_m",
                number(&|row| {
                    row.found
                        .and_then(|v| v.core_radius_m)
                        .unwrap_or(UNKNOWN)
                        .value
                }),
            )
            .float(
                "core_true_m",
                number(&|row| row.truth.core_radius_m.unwrap_or(UNKNOWN).value),
            )
            .float("chi2_per_dof", number(&|row| row.chi2_per_dof))
            .float("statistic", number(&|row| of_test(row).0))
            .float("threshold", number(&|row| of_test(row).1))
            .text("flags", self.rows.iter().map(|row| row.flags.clone()))
    }
}

fn errors(number: usize, rows: &[&RetrievalRow]) -> Option<([usize; 2], [f64; 6])> {
    let (_, first) = quantity(rows.first()?, number);
    if !first.is_finite() {
        return None;
    }
    let found = rows
        .iter()
        .map(|row| quantity(row, number))
        .filter(|(found, _)| found.value.is_finite());
    let values: Vec<(f64, f64)> = found
        .map(|(found, truth)| (found.value - truth, found.std))
        .collect();
    let n = values.len() as f64;
    let mean = |get: &dyn Fn(&(f64, f64)) -> f64| values.iter().map(get).sum::<f64>() / n;
    let bias = mean(&|v| v.0);
    let std = (values.iter().map(|v| (v.0 - bias).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let rms = mean(&|v| v.0 * v.0).sqrt();
    let stated = mean(&|v| v.1 * v.1).sqrt();
    // One value has no deviation.
    let own = if values.len() > 1 { std } else { f64::NAN };
    Some((
        [rows.len(), rows.len() - values.len()],
        [first, bias, std / n.sqrt(), own, rms, stated],
    ))
}
