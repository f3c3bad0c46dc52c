//! The answer as a text, a table and a scene.
//!
//! Times that were measured stand apart: in a column of the table and in the last line of the text. Check: the same bytes for any
//! number of threads but for these.

use super::figures::Shift;
use super::ladder::{Ladder, Step, Verdict};
use super::{Accuracy, Noise};
use crate::Error;
use crate::io::{Provenance, Table, csv::float_text};
use crate::outputs::Outputs;
use crate::plan::units::seconds;
use crate::scene::hash_of;

/// A part in percent.
fn percent(part: f64) -> String {
    if part.is_finite() { format!("{:.2}", 100.0 * part) } else { "-".into() }
}

fn value_text(value: f64) -> String {
    if value.fract() == 0.0 { format!("{value:.0}") } else { float_text(value) }
}

/// A row of the table.
struct Row {
    key: &'static str,
    value: f64,
    figure: &'static str,
    shift: f64,
    standard_error: f64,
    forecast_s: f64,
    verdict: String,
}

impl Accuracy {
    /// The files of the answer.
    pub(crate) fn list(own: Option<&Self>, files: &mut Outputs) -> Result<(), Error> {
        files.add("accuracy.txt", own, |own, _| Ok(own.text()))?;
        files.table("accuracy", own, |own| Ok(own.table()))?;
        #[cfg(feature = "plots")]
        files.figure("accuracy", own, |own| Ok(own.picture()))?;
        files.add("scene_accuracy.toml", own, |own, _| Ok(own.scene_text()))
    }

    /// The table `key,value,figure,shift,standard_error,measured_s,forecast_s,verdict`: a row for each figure of each value that was looked at.
    pub fn table(&self) -> Table {
        let rows = self.rows();
        let column = |of: fn(&Row) -> f64| rows.iter().map(of).collect::<Vec<_>>();
        let measured = self.took_s / self.spent_s;
        Table::new()
            .text("key", rows.iter().map(|row| row.key))
            .float("value", column(|row| row.value))
            .text("figure", rows.iter().map(|row| row.figure))
            .float("shift", column(|row| row.shift))
            .float("standard_error", column(|row| row.standard_error))
            .float("measured_s", rows.iter().map(|row| measured * row.forecast_s))
            .float("forecast_s", column(|row| row.forecast_s))
            .text("verdict", rows.iter().map(|row| row.verdict.clone()))
    }

    fn rows(&self) -> Vec<Row> {
        let mut rows = Vec::new();
        for (ladder, step) in self.steps() {
            let mut row = |figure, Shift { shift, error }| {
                let verdict = step.verdict.words();
                let (key, value, forecast_s) = (ladder.key, step.value, step.forecast_s);
                rows.push(Row { key, value, figure, shift, standard_error: error, forecast_s, verdict });
            };
            step.shifts.iter().for_each(|(figure, shift)| row(figure.name(), *shift));
            if step.shifts.is_empty() {
                row("", Shift { shift: f64::NAN, error: f64::NAN });
            }
        }
        rows.extend(self.noises.iter().map(|noise| Row {
            key: noise.key,
            value: noise.needed,
            figure: noise.figure.name(),
            shift: f64::NAN,
            standard_error: 0.5 * noise.now,
            forecast_s: noise.forecast_s,
            verdict: self.words_of(noise),
        }));
        rows.extend(self.verified.rows.iter().map(|(figure, _, found)| Row {
            key: "whole",
            value: f64::NAN,
            figure: figure.name(),
            shift: found.shift,
            standard_error: found.error,
            forecast_s: self.run_s,
            verdict: if found.bound() <= self.within { "confirmed".into() } else { "not confirmed".into() },
        }));
        rows
    }

    fn steps(&self) -> impl Iterator<Item = (&Ladder, &Step)> {
        self.ladders.iter().flat_map(|ladder| ladder.steps.iter().map(move |step| (ladder, step)))
    }

    fn words_of(&self, noise: &Noise) -> String {
        match noise.is_reached {
            true => "in reach".into(),
            false => format!("out of reach, the budget has {} %", percent(noise.of_budget)),
        }
    }

    /// The answer for people.
    pub fn text(&self) -> String {
        let figures: Vec<&str> = self.figures.iter().map(|figure| figure.name()).collect();
        let mut out = format!(
            "{}: accuracy of scene {}, seed {}\nasked for: {} % of {}, two standard errors included\nown run: {}, {} realisations, without \
             pictures; pilot of {} realisations; search {:.1} of {:.1} own runs (forecasts of one core)\n\n",
            crate::PROGRAM,
            self.of_scene,
            self.scene.scene.seed,
            percent(self.within),
            figures.join(", "),
            seconds(self.own_s),
            self.own_realisations,
            self.pilot,
            self.spent_s / self.own_s,
            self.allowed_s / self.own_s,
        );
        out += "shift of each figure from the finest value, %, two standard errors in brackets; * chosen\n";
        out += &self.key_table().aligned();
        for ladder in &self.ladders {
            out.extend(ladder.note.iter().map(|note| format!("{} {note}\n", ladder.key)));
            let refused = ladder.steps.iter().filter(|step| matches!(step.verdict, Verdict::Refused(_)));
            out.extend(refused.map(|step| format!("{} {}\n", value_text(step.value), step.verdict.words())));
        }
        let response: Vec<String> =
            self.response.iter().map(|(figure, of)| format!("{} {}", figure.name(), percent(0.03 * of))).collect();
        if !response.is_empty() {
            out += &format!("3 % of efficiency shift at most, %: {}\n", response.join(", "));
        }
        out += "\nnoise, two standard errors\n";
        out += &self.noise_table().aligned();
        out += &self.whole_text();
        out.extend(self.notes.iter().map(|note| format!("note: {note}\n")));
        let reached = if self.is_reached() { "reached" } else { "not reached" };
        out += &format!("{reached}; run with these keys: {}\n", seconds(self.run_s));
        out
    }

    fn key_table(&self) -> Table {
        let steps: Vec<(&Ladder, &Step)> = self.steps().collect();
        let chosen = |(ladder, step): &(&Ladder, &Step)| {
            let mark = if step.value == ladder.value() { "*" } else { "" };
            value_text(step.value) + mark
        };
        let mut table = Table::new()
            .text("key", steps.iter().map(|(ladder, _)| ladder.key))
            .text("now", steps.iter().map(|(ladder, _)| value_text(ladder.now)))
            .text("value", steps.iter().map(chosen))
            .text("run", steps.iter().map(|(_, step)| seconds_text(step.forecast_s)));
        for figure in &self.figures {
            let cell = |(_, step): &(&Ladder, &Step)| {
                let found = step.shifts.iter().find(|(of, _)| of == figure);
                found.map_or("-".into(), |(_, own)| format!("{} ({})", percent(own.shift), percent(2.0 * own.error)))
            };
            table = table.text(figure.name(), steps.iter().map(cell));
        }
        let verdict = |(_, step): &(&Ladder, &Step)| match step.verdict {
            Verdict::Refused(_) => "refused".into(),
            _ => step.verdict.words(),
        };
        table.text("verdict", steps.iter().map(verdict))
    }

    fn noise_table(&self) -> Table {
        let of = |text: fn(&Noise) -> String| self.noises.iter().map(text).collect::<Vec<_>>();
        Table::new()
            .text("figure", of(|noise| noise.figure.name().into()))
            .text("now [%]", of(|noise| percent(noise.now)))
            .text("key", of(|noise| noise.key.into()))
            .text("needed", of(|noise| value_text(noise.needed)))
            .text("run", of(|noise| seconds_text(noise.forecast_s)))
            .text("verdict", self.noises.iter().map(|noise| self.words_of(noise)))
    }

    fn whole_text(&self) -> String {
        let verified = &self.verified;
        let mut out = String::new();
        for (figure, predicted, found) in &verified.rows {
            let [predicted, shift, error] = [*predicted, found.shift, 2.0 * found.error].map(percent);
            out += &format!("  {:<12} predicted {predicted:>6} %, found {shift:>6} % ({error})\n", figure.name());
        }
        let head = match (verified.rows.is_empty(), verified.is_confirmed) {
            (true, true) => "\nas a whole: nothing is coarser than the finest setting, nothing to confirm\n".to_owned(),
            (true, false) => "\nas a whole: not confirmed, the budget is spent\n".to_owned(),
            (false, is_confirmed) => {
                let word = if is_confirmed { "confirmed" } else { "not confirmed" };
                format!("\nas a whole, with seed {}: {word}\n", verified.seed)
            }
        };
        head + &out
    }

    /// The scene with the chosen keys, each with a comment.
    fn scene_text(&self) -> String {
        let (mut out, mut section) = (String::new(), String::new());
        for line in self.scene.toml.lines() {
            if let Some(name) = line.strip_prefix('[') {
                section = name.trim_end_matches(']').to_owned();
            }
            let path = line.split_once(" = ").map(|(name, _)| format!("{section}.{name}")).unwrap_or_default();
            let comment = self.values.iter().find(|(key, _)| *key == path).map(|(key, _)| self.comment(key));
            out += &format!("{line}{}\n", comment.map(|words| format!(" # {words}")).unwrap_or_default());
        }
        Provenance::new(&out, &hash_of(&out), self.scene.scene.seed).scene_file()
    }

    fn comment(&self, key: &'static str) -> String {
        let ladder = self.ladders.iter().find(|ladder| ladder.key == key);
        if let Some(note) = ladder.and_then(|ladder| ladder.note.as_ref()) {
            return note.clone();
        }
        let worst = |step: &Step| step.shifts.iter().map(|(_, own)| own.bound()).fold(0.0, f64::max);
        let step = ladder.and_then(|ladder| ladder.steps.get(ladder.chosen));
        match step {
            Some(step) if step.shifts.is_empty() => "the finest value that was looked at".into(),
            Some(step) => format!("shifts no figure by more than {} %", percent(worst(step))),
            None => {
                let of: Vec<&str> = self
                    .noises
                    .iter()
                    .filter(|noise| noise.key == key && noise.is_reached)
                    .map(|noise| noise.figure.name())
                    .collect();
                match of.is_empty() {
                    true => "as before: what the noise asks for is out of reach".into(),
                    false => format!("noise of {}", of.join(", ")),
                }
            }
        }
    }
}

fn seconds_text(value_s: f64) -> String {
    if value_s.is_finite() { seconds(value_s) } else { "-".into() }
}
