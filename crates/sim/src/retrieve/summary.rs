//! Errors of retrievals over the realisations of a scene: a row for each method, vortex and quantity.
//!
//! Check: means and deviations by hand; failures are counted and not averaged.

use super::realisations::{RetrievalRow, SceneRetrieval};
use super::table::{name, with};
use crate::io::Table;
use crate::scene::RetrievalMethod as Method;
use wakescope_estimate::retrieval::{Measured, Side, VortexResult};

/// Errors of one quantity of one vortex by one method: realisations, each as often as it has sweeps, and those without a value; the truth
/// of the first one, mean error and its standard error, standard deviation, root mean square error, and root mean square of the
/// deviations that the retrievals state.
type Errors = (Method, Side, &'static str, [usize; 2], [f64; 6]);

/// A quantity: its name, what was found, and the truth.
type Quantity = (&'static str, fn(&RetrievalRow) -> Option<Measured>, fn(&RetrievalRow) -> f64);

fn of(row: &RetrievalRow, get: fn(&VortexResult) -> Measured) -> Option<Measured> {
    row.found.as_ref().map(get).filter(|measured| measured.value.is_finite())
}

const QUANTITIES: [Quantity; 5] = [
    ("gamma_m2_s", |row| of(row, |v| v.circulation_m2_s), |row| row.truth.circulation_m2_s),
    ("gamma_5_15_m2_s", |row| of(row, |v| v.circulation_5_15_m2_s), |row| row.truth.circulation_5_15_m2_s),
    ("y_m", |row| of(row, |v| v.lateral_position_m), |row| row.truth.lateral_position_m),
    ("z_m", |row| of(row, |v| v.height_m), |row| row.truth.height_m),
    (
        "rolling_moment",
        |row| Some(Measured { value: row.rolling_moment.0, std: f64::NAN }).filter(|m| m.value.is_finite()),
        |row| row.rolling_moment.1,
    ),
];

impl SceneRetrieval {
    /// The errors of all quantities whose truth is known.
    fn errors(&self) -> Vec<Errors> {
        let mut methods: Vec<Method> = Vec::new();
        for row in &self.rows {
            if !methods.contains(&row.method) {
                methods.push(row.method);
            }
        }
        let mut all = Vec::new();
        for (method, side) in methods.into_iter().flat_map(|method| Side::BOTH.map(|side| (method, side))) {
            let rows: Vec<_> = self.rows.iter().filter(|row| (row.method, row.side) == (method, side)).collect();
            for (quantity, found, truth) in QUANTITIES {
                all.extend(
                    errors(found, truth, &rows).map(|(counts, numbers)| (method, side, quantity, counts, numbers)),
                );
            }
        }
        all
    }

    /// Share of the maps whose test says wake; nothing without a test.
    #[must_use]
    pub fn detected(&self) -> Option<f64> {
        let found = self.tests.iter().filter(|(statistic, threshold)| statistic > threshold).count();
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
            .text("side", all.iter().map(|(_, side, ..)| name(side)))
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
        let number = |get: &dyn Fn(&RetrievalRow) -> f64| self.rows.iter().map(get).collect::<Vec<_>>();
        let mut table = Table::new().int("realisation", self.rows.iter().map(|row| row.realisation as i64));
        if self.rows.iter().any(|row| row.sweep > 0) {
            table = table.int("sweep", self.rows.iter().map(|row| row.sweep as i64));
        }
        table = table
            .text("method", self.rows.iter().map(|row| row.method.name()))
            .text("side", self.rows.iter().map(|row| name(row.side)))
            .float("time_s", number(&|row| row.found.map_or(row.truth.time_s, |v| v.time_s)));
        for (quantity, found, truth) in QUANTITIES {
            let value = |row: &RetrievalRow| found(row).unwrap_or(Measured { value: f64::NAN, std: f64::NAN });
            table = table
                .float(quantity, number(&|row| value(row).value))
                .float(&with(quantity, "std"), number(&|row| value(row).std))
                .float(&with(quantity, "true"), number(&truth));
        }
        let of_test = |row: &RetrievalRow| self.tests.get(row.realisation).copied().unwrap_or((f64::NAN, f64::NAN));
        table
            .float("core_m", number(&|row| row.found.and_then(|v| v.core_radius_m).map_or(f64::NAN, |core| core.value)))
            .float("core_true_m", number(&|row| row.truth.core_radius_m))
            .float("chi2_per_dof", number(&|row| row.chi2_per_dof))
            .float("statistic", number(&|row| of_test(row).0))
            .float("threshold", number(&|row| of_test(row).1))
            .text("flags", self.rows.iter().map(|row| row.flags.clone()))
    }
}

fn errors(
    found: fn(&RetrievalRow) -> Option<Measured>,
    truth: fn(&RetrievalRow) -> f64,
    rows: &[&RetrievalRow],
) -> Option<([usize; 2], [f64; 6])> {
    let first = truth(rows.first()?);
    if !first.is_finite() {
        return None;
    }
    let values: Vec<(f64, f64)> =
        rows.iter().filter_map(|row| found(row).map(|m| (m.value - truth(row), m.std))).collect();
    let n = values.len() as f64;
    let mean = |get: &dyn Fn(&(f64, f64)) -> f64| values.iter().map(get).sum::<f64>() / n;
    let bias = mean(&|v| v.0);
    let std = (values.iter().map(|v| (v.0 - bias).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let (rms, stated) = (mean(&|v| v.0 * v.0).sqrt(), mean(&|v| v.1 * v.1).sqrt());
    // One value has no deviation.
    let own = if values.len() > 1 { std } else { f64::NAN };
    Some(([rows.len(), rows.len() - values.len()], [first, bias, std / n.sqrt(), own, rms, stated]))
}
