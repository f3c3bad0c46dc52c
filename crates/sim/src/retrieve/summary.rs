//! Errors of retrievals over the realisations of a scene: a row for each method, vortex and quantity.
//!
//! Check: means and deviations by hand; failures are counted and not averaged.

use super::realisations::{RetrievalRow, SceneRetrieval, is_detected};
use super::table::{UNKNOWN, VORTEX, measured, name as word, with};
use super::truth::is_there;
use crate::io::Table;
use crate::scene::RetrievalMethod as Method;
use wakescope_estimate::Measured;
use wakescope_estimate::retrieval::{Side, VortexResult};

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
        for first in &self.rows {
            if (first.realisation, first.sweep) != (0, 0) {
                continue;
            }
            let method = first.method;
            let side = first.truth.side;
            let mut rows: Vec<&RetrievalRow> = self.rows.iter().collect();
            rows.retain(|row| row.method == method && row.truth.side == side);
            rows.retain(|row| is_there(&row.truth));
            for (number, name) in quantities() {
                if let Some((counts, numbers)) = errors(number, &rows) {
                    all.push((method, side, name, counts, numbers));
                }
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
        let mut counts: [Vec<i64>; 2] = Default::default();
        let mut numbers: [Vec<f64>; 6] = Default::default();
        for (.., row_counts, row_numbers) in &all {
            for (column, count) in counts.iter_mut().zip(row_counts) {
                column.push(*count as i64);
            }
            for (column, number) in numbers.iter_mut().zip(row_numbers) {
                column.push(*number);
            }
        }
        let [realisations, failures] = counts;
        let [truth, bias, bias_standard_error, std, rms, stated_std] = numbers;
        Table::new()
            .text("method", all.iter().map(|(method, ..)| method.name()))
            .text("side", all.iter().map(|(_, side, ..)| word(side)))
            .text("quantity", all.iter().map(|(_, _, quantity, ..)| *quantity))
            .float("truth", truth)
            .int("realisations", realisations)
            .int("failures", failures)
            .float("bias", bias)
            .float("bias_standard_error", bias_standard_error)
            .float("std", std)
            .float("rms", rms)
            .float("stated_std", stated_std)
    }

    /// The table of all vortices.
    #[must_use]
    pub fn table(&self) -> Table {
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
            .float("time_s", self.rows.iter().map(time_s));
        for (i, name) in quantities() {
            let found = self.rows.iter().map(|row| quantity(row, i).0);
            let truth = self.rows.iter().map(|row| quantity(row, i).1);
            table = measured(table, name, found).float(&with(name, "true"), truth);
        }
        let found = self.rows.iter().map(|row| row.found.as_ref());
        let cores = found.map(core_m);
        let true_cores = self.rows.iter().map(|row| core_m(Some(&row.truth)));
        let tests = self.rows.iter().map(|row| self.tests.get(row.realisation));
        let tests = tests.map(|test| *test.unwrap_or(&(f64::NAN, f64::NAN)));
        let (statistics, thresholds): (Vec<f64>, Vec<f64>) = tests.unzip();
        table
            .float("core_m", cores)
            .float("core_true_m", true_cores)
            .float("chi2_per_dof", self.rows.iter().map(|row| row.chi2_per_dof))
            .float("statistic", statistics)
            .float("threshold", thresholds)
            .text("flags", self.rows.iter().map(|row| row.flags.clone()))
    }
}

/// Time of a vortex, s: that of the one found, or of the true one.
fn time_s(row: &RetrievalRow) -> f64 {
    row.found.map_or(row.truth.time_s, |found| found.time_s)
}

/// Core radius, m; NaN where it is not known.
fn core_m(vortex: Option<&VortexResult>) -> f64 {
    let core = vortex.and_then(|vortex| vortex.core_radius_m);
    core.unwrap_or(UNKNOWN).value
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
    let bias = values.iter().map(|v| v.0).sum::<f64>() / n;
    let std = (values.iter().map(|v| (v.0 - bias).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let rms = (values.iter().map(|v| v.0 * v.0).sum::<f64>() / n).sqrt();
    let stated = (values.iter().map(|v| v.1 * v.1).sum::<f64>() / n).sqrt();
    // One value has no deviation.
    let own = if values.len() > 1 { std } else { f64::NAN };
    Some((
        [rows.len(), rows.len() - values.len()],
        [first, bias, std / n.sqrt(), own, rms, stated],
    ))
}
