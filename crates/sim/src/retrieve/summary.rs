//! Errors of retrievals over the realisations of a scene: a row for each method, vortex and quantity.
//!
//! Check: means and deviations by hand; failures are counted and not averaged.

use super::realisations::{RetrievalRow, SceneRetrieval};
use super::table::{side as side_name, with};
use crate::io::Table;
use crate::scene::RetrievalMethod as Method;
use wakescope_estimate::retrieval::{Measured, Side, VortexResult};

/// Errors of one quantity of one vortex by one method.
#[derive(Debug, Clone, PartialEq)]
pub struct RetrievalErrors {
    /// The method.
    pub method: Method,
    /// The vortex.
    pub side: Side,
    /// Name of the quantity, with its unit.
    pub quantity: &'static str,
    /// Its true value, that of the first realisation and sweep.
    pub truth: f64,
    /// Realisations, each as often as it has sweeps.
    pub realisations: usize,
    /// Those without a value.
    pub failures: usize,
    /// Mean error and its standard error.
    pub bias: (f64, f64),
    /// Standard deviation of the values; NaN for one.
    pub std: f64,
    /// Root mean square error.
    pub rms: f64,
    /// Root mean square of the deviations that the retrievals state.
    pub stated_std: f64,
}

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
    #[must_use]
    pub fn errors(&self) -> Vec<RetrievalErrors> {
        let mut methods: Vec<Method> = Vec::new();
        for row in &self.rows {
            if !methods.contains(&row.method) {
                methods.push(row.method);
            }
        }
        let mut all = Vec::new();
        for method in methods {
            for side in [Side::Left, Side::Right] {
                let rows: Vec<&RetrievalRow> =
                    self.rows.iter().filter(|row| row.method == method && row.side == side).collect();
                let errors = QUANTITIES.iter().filter_map(|quantity| errors((method, side), quantity, &rows));
                all.extend(errors);
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
        let column = |get: fn(&RetrievalErrors) -> f64| all.iter().map(get).collect::<Vec<_>>();
        Table::new()
            .text("method", all.iter().map(|e| e.method.name()))
            .text("side", all.iter().map(|e| side_name(e.side)))
            .text("quantity", all.iter().map(|e| e.quantity))
            .float("truth", column(|e| e.truth))
            .int("realisations", all.iter().map(|e| e.realisations as i64))
            .int("failures", all.iter().map(|e| e.failures as i64))
            .float("bias", column(|e| e.bias.0))
            .float("bias_standard_error", column(|e| e.bias.1))
            .float("std", column(|e| e.std))
            .float("rms", column(|e| e.rms))
            .float("stated_std", column(|e| e.stated_std))
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
            .text("side", self.rows.iter().map(|row| side_name(row.side)))
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

fn errors(of: (Method, Side), (quantity, found, truth): &Quantity, rows: &[&RetrievalRow]) -> Option<RetrievalErrors> {
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
    Some(RetrievalErrors {
        method: of.0,
        side: of.1,
        quantity,
        truth: first,
        realisations: rows.len(),
        failures: rows.len() - values.len(),
        bias: (bias, std / n.sqrt()),
        std: if values.len() > 1 { std } else { f64::NAN },
        rms: mean(&|v| v.0 * v.0).sqrt(),
        stated_std: mean(&|v| v.1 * v.1).sqrt(),
    })
}
