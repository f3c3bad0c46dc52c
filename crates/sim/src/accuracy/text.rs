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
        let mut cells = Vec::new();
        for metric in &self.metrics {
            for ((setting, row), on_front) in self.rows().zip(self.front(*metric)) {
                let shift = row.shift(*metric);
                if shift.is_some() || row.refused.is_some() {
                    let unknown = Measured {
                        value: f64::NAN,
                        std: f64::NAN,
                    };
                    cells.push((setting, row, metric, shift.unwrap_or(unknown), on_front));
                }
            }
        }
        let cheapest = |setting: &Setting, row| i64::from(self.is_cheapest(setting, row));
        Table::new()
            .text("setting", cells.iter().map(|cell| cell.0.key))
            .float("value", cells.iter().map(|cell| cell.1.value))
            .text("metric", cells.iter().map(|cell| cell.2.name()))
            .float("shift", cells.iter().map(|cell| cell.3.value))
            .float("standard_error", cells.iter().map(|cell| cell.3.std))
            .text("status", cells.iter().map(|cell| self.status(cell.1)))
            .float("run_s", cells.iter().map(|cell| cell.1.run_s))
            .int("front", cells.iter().map(|cell| i64::from(cell.4)))
            .int(
                "cheapest",
                cells.iter().map(|cell| cheapest(cell.0, cell.1)),
            )
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
        let label = |(setting, row): (&Setting, &Row)| {
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
            format!("{}{given}{mark}", row.label)
        };
        let mut table = Table::new()
            .text("setting", self.rows().map(|(setting, _)| setting.key))
            .text("value ", self.rows().map(label))
            .text("run", self.rows().map(|(_, row)| run_text(row)));
        for metric in &self.metrics {
            let cell = |(_, row): (_, &Row)| row.shift(*metric).map_or("-".into(), shift_text);
            table = table.text(metric.name(), self.rows().map(cell));
        }
        // The reason of a refusal follows the table.
        let short = |(_, row): (_, &Row)| match row.refused {
            Some(_) => "refused".into(),
            None => self.status(row),
        };
        table.text("status", self.rows().map(short)).aligned()
    }
}

fn run_text(row: &Row) -> String {
    match row.refused {
        Some(_) => "-".into(),
        None => seconds(row.run_s),
    }
}
