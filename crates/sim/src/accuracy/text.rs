//! The report as text and as a table.
//!
//! Run times differ from run to run: they, and what follows from them, are the last columns of the table.

use super::{Report, Row, Setting};
#[cfg(feature = "cli")]
use crate::Error;
use crate::io::Table;
#[cfg(feature = "cli")]
use crate::outputs::Outputs;
use crate::quantities::seconds;
use wakescope_estimate::Measured;

/// A fraction in percent.
fn percent(fraction: f64) -> String {
    // A zero without sign.
    let percent = 100.0 * fraction + 0.0;
    match percent.abs() {
        x if x.is_nan() => "-".into(),
        x if x > 0.0 && x < 0.01 => format!("{percent:.1e}"),
        _ => format!("{percent:.2}"),
    }
}

/// A shift in percent, with two standard errors where it is uncertain.
fn shift_text(shift: Measured) -> String {
    match shift.std {
        0.0 => percent(shift.value),
        error => format!("{} ({})", percent(shift.value), percent(2.0 * error)),
    }
}

impl Report {
    /// The files of a report.
    #[cfg(feature = "cli")]
    pub(crate) fn list(report: Option<&Self>, files: &mut Outputs) -> Result<(), Error> {
        files.table("accuracy", report, |report| Ok(report.table()))?;
        #[cfg(feature = "plots")]
        files.figure("accuracy", report, |report| Ok(report.picture()))?;
        Ok(())
    }

    /// Whether a row is within the error, with the reason where it cannot be used.
    fn status(&self, row: &Row) -> String {
        match &row.refused {
            Some(reason) => format!("refused: {reason}"),
            None if row.lost > 0.0 => format!("loses {:.1} % of the gates", 100.0 * row.lost),
            None if row.is_within(self.within) => "within".into(),
            None => "beyond".into(),
        }
    }

    /// Whether a row is the cheapest of its setting within the error.
    fn is_cheapest(&self, setting: &Setting, row: &Row) -> bool {
        let cheapest = setting.cheapest(self.within);
        cheapest.is_some_and(|cheapest| cheapest.value == row.value)
    }

    /// The table `setting,value,metric,shift,standard_error,status,run_s,front,cheapest`: a row for each metric of each value.
    pub fn table(&self) -> Table {
        let mut settings = Vec::new();
        let mut values = Vec::new();
        let mut metrics = Vec::new();
        let mut shifts = Vec::new();
        let mut standard_errors = Vec::new();
        let mut statuses = Vec::new();
        let mut run_s = Vec::new();
        let mut front = Vec::new();
        let mut cheapest = Vec::new();
        for metric in &self.metrics {
            for ((setting, row), is_on_front) in self.rows().zip(self.front(*metric)) {
                let shift = row.shift(*metric);
                if shift.is_none() && row.refused.is_none() {
                    continue;
                }
                settings.push(setting.key);
                values.push(row.value);
                metrics.push(metric.name());
                shifts.push(shift.map_or(f64::NAN, |shift| shift.value));
                standard_errors.push(shift.map_or(f64::NAN, |shift| shift.std));
                statuses.push(self.status(row));
                run_s.push(row.run_s);
                front.push(i64::from(is_on_front));
                cheapest.push(i64::from(self.is_cheapest(setting, row)));
            }
        }
        Table::new()
            .text("setting", settings)
            .float("value", values)
            .text("metric", metrics)
            .float("shift", shifts)
            .float("standard_error", standard_errors)
            .text("status", statuses)
            .float("run_s", run_s)
            .int("front", front)
            .int("cheapest", cheapest)
    }

    /// The report for people.
    pub fn text(&self) -> String {
        let within = percent(self.within);
        let mut out = format!(
            "{}: accuracy of {} {}",
            crate::PROGRAM,
            self.subject,
            self.provenance.scene_hash
        );
        if let Some(realisations) = self.realisations {
            let seed = self.provenance.seed;
            out += &format!(", seed {seed}, {realisations} realisations");
        }
        let brackets = match self.realisations {
            Some(_) => ", two standard errors in brackets",
            None => "",
        };
        let threads = rayon::current_num_threads();
        out += &format!(
            "\nerror in %{brackets}; * cheapest value within {within} %; run time on {threads} threads\n{}",
            self.aligned()
        );
        for (setting, row) in self.rows() {
            if let Some(reason) = &row.refused {
                out += &format!("{} = {} is refused: {reason}\n", setting.key, row.label);
            }
        }
        for setting in &self.settings {
            if setting.cheapest(self.within).is_none() {
                out += &format!("{}: no value is within {within} %\n", setting.key);
            }
        }
        for note in &self.notes {
            out += &format!("note: {note}\n");
        }
        if let Some((setting, row)) = self.cheapest() {
            let run = run_text(row);
            let given = setting.given_row().map_or("-".into(), run_text);
            out += &format!(
                "cheapest within {within} %: {} = {}, {run} (as given {given})\n",
                setting.key, row.label
            );
        }
        out
    }

    fn aligned(&self) -> String {
        let mut settings = Vec::new();
        let mut labels = Vec::new();
        let mut runs = Vec::new();
        let mut statuses = Vec::new();
        for (setting, row) in self.rows() {
            let given = if row.value == setting.given {
                " (given)"
            } else {
                ""
            };
            let mark = if self.is_cheapest(setting, row) {
                "*"
            } else {
                " "
            };
            settings.push(setting.key);
            labels.push(format!("{}{given}{mark}", row.label));
            runs.push(run_text(row));
            // The reason of a refusal follows the table.
            statuses.push(match row.refused {
                Some(_) => "refused".into(),
                None => self.status(row),
            });
        }
        let mut table = Table::new()
            .text("setting", settings)
            .text("value ", labels)
            .text("run", runs);
        for metric in &self.metrics {
            let mut cells = Vec::new();
            for (_, row) in self.rows() {
                cells.push(row.shift(*metric).map_or("-".into(), shift_text));
            }
            table = table.text(metric.name(), cells);
        }
        table.text("status", statuses).aligned()
    }
}

fn run_text(row: &Row) -> String {
    match row.refused {
        Some(_) => "-".into(),
        None => seconds(row.run_s),
    }
}
