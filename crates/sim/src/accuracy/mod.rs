//! Numerical error and run time of a scene or flow, setting by setting.
//!
//! Each setting that trades accuracy for time is varied alone. The error of a value is its shift from the finest value of the setting,
//! or from theory where that is known.
//!
//! | module | contents |
//! |---|---|
//! | [`metrics`] | the metrics whose error is assessed, and their shifts between two runs |
//! | [`keys`] | the settings, and scenes with other values of them |
//! | `scene` | runs of a scene: estimator, phase screens, realisations |
//! | `flow` | runs of a flow: cells and time steps, with Richardson's extrapolation |
//! | `text`, `picture` | the report as text and table; drawn |

mod flow;
pub mod keys;
mod mean_wind;
pub mod metrics;
#[cfg(feature = "plots")]
mod picture;
mod scene;
mod text;

use crate::Error;
use crate::io::Provenance;
use crate::sweep::front::front;
use metrics::Metric;
use std::path::Path;
use wakescope_estimate::Measured;

/// What is requested of a report.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct Request {
    /// Largest relative error of each metric, e.g. 3%.
    #[cfg_attr(feature = "cli", arg(long, value_name = "ERROR", value_parser = relative_error))]
    pub within: f64,
    /// Metrics to assess; by default all that the scene has.
    #[cfg_attr(
        feature = "cli",
        arg(long, value_name = "METRIC,...", value_delimiter = ',', value_enum)
    )]
    pub of: Vec<Metric>,
}

impl Request {
    /// The metrics to assess among those that a `subject` has.
    ///
    /// # Errors
    /// A metric that is requested and that the subject does not have; no metric at all.
    fn select(&self, subject: &str, available: &[Metric]) -> Result<Vec<Metric>, Error> {
        let names: Vec<&str> = available.iter().map(|metric| metric.name()).collect();
        if let Some(metric) = self.of.iter().find(|metric| !available.contains(metric)) {
            let name = metric.name();
            let known = names.join(", ");
            return Err(Error::input(
                Path::new("--of"),
                format!("{name} is not a metric of this {subject}, which has: {known}"),
            ));
        }
        if available.is_empty() {
            let reason = format!("this {subject} has no metric");
            return Err(Error::input(Path::new("--of"), reason));
        }
        let mut requested = available.to_vec();
        requested.retain(|metric| self.of.is_empty() || self.of.contains(metric));
        Ok(requested)
    }
}

/// A relative error, such as 3% or 0.03.
#[cfg(feature = "cli")]
fn relative_error(text: &str) -> Result<f64, String> {
    let number = match text.trim().strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().map(|percent| 0.01 * percent),
        None => text.trim().parse(),
    };
    number
        .ok()
        .filter(|error| (1e-5..=0.5).contains(error))
        .ok_or_else(|| "from 0.001% to 50%, such as 3% or 0.03".into())
}

/// Errors and run time of a scene or flow for each value of each setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// What is assessed: `scene` or `case`.
    pub subject: &'static str,
    /// The scene or case.
    pub provenance: Provenance,
    /// Largest relative error of a recommended value, two standard errors included.
    pub within: f64,
    /// Realisations of the scan in each run; none of a flow, which has no noise.
    pub realisations: Option<usize>,
    /// Metrics that are assessed.
    pub metrics: Vec<Metric>,
    /// The settings, each varied alone.
    pub settings: Vec<Setting>,
    /// What limits the report.
    pub notes: Vec<String>,
}

/// A setting with its values.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Path of its key.
    pub key: &'static str,
    /// Its value in the scene or case.
    pub given: f64,
    /// Its values from the finest to the coarsest.
    pub rows: Vec<Row>,
}

/// A value of a setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The value; of cells their number.
    pub value: f64,
    /// The value as it is printed.
    pub label: String,
    /// Relative shift of each metric that the setting acts on.
    pub shifts: Vec<(Metric, Measured)>,
    /// Fraction of the gates that have no estimate with this value and have one with the finest.
    pub lost: f64,
    /// Why the program refuses the value.
    pub refused: Option<String>,
    /// Wall time of the run, s; NaN where it was refused.
    pub run_s: f64,
}

impl Setting {
    /// The row with the value of the scene or case.
    #[must_use]
    pub fn given_row(&self) -> Option<&Row> {
        self.rows.iter().find(|row| row.value == self.given)
    }

    /// The row of least run time whose metrics are all within a relative error.
    #[must_use]
    pub fn cheapest(&self, within: f64) -> Option<&Row> {
        self.rows
            .iter()
            .filter(|row| row.is_within(within))
            .min_by(|a, b| a.run_s.total_cmp(&b.run_s))
    }
}

impl Row {
    /// A value that was run.
    fn new(value: f64, label: String, run_s: f64) -> Self {
        Self {
            value,
            label,
            shifts: Vec::new(),
            lost: 0.0,
            refused: None,
            run_s,
        }
    }

    /// A value that the program refuses.
    fn refused(value: f64, label: String, error: &Error) -> Self {
        let reason = error.to_string();
        // The first line without the position of a value that the user did not write.
        let first = reason.lines().next().unwrap_or_default();
        let allowed = first.split("is not allowed: ").last().unwrap_or_default();
        let short = allowed.split("; together").next().unwrap_or_default();
        Self {
            refused: Some(short.into()),
            ..Self::new(value, label, f64::NAN)
        }
    }

    /// Shift of a metric, where the setting acts on it and the value was run.
    #[must_use]
    pub fn shift(&self, metric: Metric) -> Option<Measured> {
        self.shifts
            .iter()
            .find(|(own, _)| *own == metric)
            .map(|(_, shift)| *shift)
    }

    /// Whether the value can be used: it is accepted and every gate keeps its estimate.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        self.refused.is_none() && self.lost == 0.0
    }

    /// Whether the value can be used and all metrics are within a relative error.
    #[must_use]
    pub fn is_within(&self, within: f64) -> bool {
        let mut shifts = self.shifts.iter();
        self.is_usable() && shifts.all(|(_, shift)| shift.bound() <= within)
    }
}

impl Report {
    /// Whether every setting has a value within the relative error.
    #[must_use]
    pub fn is_reached(&self) -> bool {
        self.settings
            .iter()
            .all(|setting| setting.cheapest(self.within).is_some())
    }

    /// The setting and the row of least run time within the relative error.
    #[must_use]
    pub fn cheapest(&self) -> Option<(&Setting, &Row)> {
        self.settings
            .iter()
            .filter_map(|setting| Some((setting, setting.cheapest(self.within)?)))
            .min_by(|(_, a), (_, b)| a.run_s.total_cmp(&b.run_s))
    }

    /// All rows with their settings.
    fn rows(&self) -> impl Iterator<Item = (&Setting, &Row)> {
        self.settings
            .iter()
            .flat_map(|setting| setting.rows.iter().map(move |row| (setting, row)))
    }

    /// Whether each of [`Self::rows`] is on the front of error against run time of a metric: no other row that can be used is as good
    /// in one and better in the other.
    fn front(&self, metric: Metric) -> Vec<bool> {
        let mut run_s = Vec::new();
        let mut errors = Vec::new();
        for (_, row) in self.rows() {
            let shift = row.shift(metric).filter(|_| row.is_usable());
            run_s.push(row.run_s);
            errors.push(shift.map_or(f64::NAN, Measured::bound));
        }
        front(&[run_s, errors])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(value: f64, run_s: f64, shift: f64, standard_error: f64) -> Row {
        let shift = Measured {
            value: shift,
            std: standard_error,
        };
        Row {
            shifts: vec![(Metric::Rms, shift)],
            ..Row::new(value, format!("{value}"), run_s)
        }
    }

    fn report(settings: Vec<Setting>) -> Report {
        Report {
            subject: "scene",
            provenance: Provenance::new("", "0", 1),
            within: 0.03,
            realisations: Some(8),
            metrics: vec![Metric::Rms],
            settings,
            notes: Vec::new(),
        }
    }

    fn window_step() -> Setting {
        let mut lossy = row(8.0, 1.0, 0.0, 0.0);
        lossy.lost = 0.13;
        let error = Error::Key {
            key: keys::WINDOW_STEP,
            reason: "16 is not allowed: at most 9; together with others".into(),
        };
        Setting {
            key: keys::WINDOW_STEP,
            given: 2.0,
            rows: vec![
                row(1.0, 9.0, 0.0, 0.0),
                row(2.0, 6.0, 0.01, 0.005),
                row(4.0, 4.0, -0.02, 0.01),
                lossy,
                Row::refused(16.0, "16".into(), &error),
            ],
        }
    }

    #[test]
    fn the_recommended_row_is_the_cheapest_within_the_error_and_loses_no_gate() {
        let setting = window_step();
        let value = |within: f64| setting.cheapest(within).map(|row| row.value);
        assert_eq!(value(0.5), Some(4.0), "8 loses gates, 16 is refused");
        assert_eq!(value(0.03), Some(2.0), "two standard errors count");
        assert_eq!(value(1e-4), Some(1.0));
        let unknown = Setting {
            rows: vec![row(1.0, 1.0, f64::NAN, 0.0)],
            ..setting.clone()
        };
        assert_eq!(unknown.cheapest(0.5), None);
        let report = report(vec![setting, unknown]);
        let (setting, row) = report.cheapest().unwrap();
        assert_eq!((setting.key, row.value), (keys::WINDOW_STEP, 2.0));
        assert!(!report.is_reached());
    }

    #[test]
    fn lost_gates_refusals_and_settings_without_a_value_are_in_text_and_table() {
        let noise = Setting {
            key: keys::REALISATIONS,
            given: 8.0,
            rows: vec![row(8.0, 7.0, 0.0, 0.04)],
        };
        let report = report(vec![window_step(), noise]);
        let text = report.text();
        for expected in [
            "loses 13.0 % of the gates",
            "estimator.window_step_samples = 16 is refused: at most 9",
            "scan.realisations: no value is within 3.00 %",
            "cheapest within 3.00 %: estimator.window_step_samples = 2, 6.0 s (as given 6.0 s)",
        ] {
            assert!(text.contains(expected), "{expected}\n{text}");
        }
        let csv = report.table().to_csv(&report.provenance).unwrap();
        let lines: Vec<&str> = csv.lines().filter(|line| !line.starts_with('#')).collect();
        assert_eq!(lines.len(), 7, "{csv}");
        assert!(
            lines[4].ends_with("loses 13.0 % of the gates,1.0,0,0"),
            "{csv}"
        );
    }

    #[test]
    fn the_front_has_the_rows_that_no_usable_row_beats() {
        let slow = Setting {
            key: keys::PADDED,
            given: 64.0,
            rows: vec![row(64.0, 7.0, 0.02, 0.005)],
        };
        let found = report(vec![window_step(), slow]).front(Metric::Rms);
        assert_eq!(found, [true, true, true, false, false, false]);
    }
}
