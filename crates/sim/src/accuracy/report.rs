//! The answer as a text, a table and a scene.
//!
//! Times that were measured stand apart: in a column of the table and in the last line of the text. Check: the same bytes for any
//! number of threads but for these.

use super::figures::{Figure, Shift};
use super::keys::CELLS;
use super::ladder::{Ladder, Step, Verdict};
use super::{Accuracy, Noise, Subject};
#[cfg(feature = "cli")]
use crate::Error;
use crate::io::{Table, csv::float_text};
use crate::keys::lines_with_keys;
#[cfg(feature = "cli")]
use crate::outputs::Outputs;
use crate::plan::units::seconds;
use crate::scene::hash_of;

/// A part in percent.
fn percent(part: f64) -> String {
    if part.is_finite() {
        format!("{:.2}", 100.0 * part)
    } else {
        "-".into()
    }
}

/// An error without noise in percent, which may be a small one.
fn exact_percent(part: f64) -> String {
    if part > 0.0 && part < 1e-4 {
        format!("{:.1e}", 100.0 * part)
    } else {
        percent(part)
    }
}

/// A shift and two standard errors in percent; of a flow the error alone.
fn shift_text<S: Subject>(own: Shift) -> String {
    if !S::IS_NOISY {
        return exact_percent(own.shift);
    }
    format!("{} ({})", percent(own.shift), percent(2.0 * own.error))
}

fn value_text(value: f64) -> String {
    if value.fract() == 0.0 {
        format!("{value:.0}")
    } else {
        float_text(value)
    }
}

fn step_text(step: &Step) -> String {
    step.cells.map_or_else(
        || value_text(step.value),
        |[nx, ny, nz]| format!("{nx} x {ny} x {nz}"),
    )
}

/// The order of an error in words.
fn order_text(key: &str, order: Option<f64>) -> String {
    match order {
        None => format!(
            "not converging at these {}",
            if key == CELLS { "cells" } else { "steps" }
        ),
        Some(order) if order.is_finite() => format!("order {order:.2}"),
        Some(_) => "the same".into(),
    }
}

fn seconds_text(value_s: f64) -> String {
    if value_s.is_finite() {
        seconds(value_s)
    } else {
        "-".into()
    }
}

fn words_of(noise: &Noise) -> String {
    match noise.is_reached {
        true => "in reach".into(),
        false => format!(
            "out of reach, the budget has {} %",
            percent(noise.of_budget)
        ),
    }
}

fn names<'f>(figures: impl Iterator<Item = &'f Figure>) -> String {
    figures
        .map(|figure| figure.name())
        .collect::<Vec<_>>()
        .join(", ")
}

impl<S: Subject> Accuracy<S> {
    /// The files of the answer.
    #[cfg(feature = "cli")]
    pub(crate) fn list(own: Option<&Self>, files: &mut Outputs) -> Result<(), Error> {
        files.add("accuracy.txt", own, |own, _| Ok(own.text()))?;
        files.table("accuracy", own, |own| Ok(own.table()))?;
        #[cfg(feature = "plots")]
        files.figure("accuracy", own, |own| Ok(own.picture()))?;
        files.add(&format!("{}_accuracy.toml", S::NAME), own, |own, _| {
            Ok(own.scene_text())
        })
    }

    /// The table `key,value,figure,shift,standard_error,measured_s,forecast_s,verdict`: a row for each figure of each value that was looked at.
    pub fn table(&self) -> Table {
        let unknown = Shift {
            shift: f64::NAN,
            error: f64::NAN,
        };
        let mut rows = Vec::new();
        for (ladder, step) in self.steps() {
            let mut row = |figure, shift| {
                rows.push((
                    ladder.key,
                    step.value,
                    figure,
                    shift,
                    step.forecast_s,
                    step.verdict.words(),
                ))
            };
            step.shifts
                .iter()
                .for_each(|(figure, shift)| row(figure.name(), *shift));
            if step.shifts.is_empty() {
                row("", unknown);
            }
        }
        for ladder in &self.ladders {
            for (figure, order) in &ladder.orders {
                rows.push((
                    ladder.key,
                    f64::NAN,
                    figure.name(),
                    unknown,
                    f64::NAN,
                    order_text(ladder.key, *order),
                ));
            }
        }
        for noise in &self.noises {
            let shift = Shift {
                error: 0.5 * noise.now,
                ..unknown
            };
            rows.push((
                noise.key,
                noise.needed,
                noise.figure.name(),
                shift,
                noise.forecast_s,
                words_of(noise),
            ));
        }
        for (figure, _, found) in &self.verified.rows {
            let verdict = if found.bound() <= self.within {
                "confirmed"
            } else {
                "not confirmed"
            };
            rows.push((
                "whole",
                f64::NAN,
                figure.name(),
                *found,
                self.run_s,
                verdict.into(),
            ));
        }
        let measured = self.took_s / self.spent_s;
        Table::new()
            .text("key", rows.iter().map(|row| row.0))
            .float("value", rows.iter().map(|row| row.1))
            .text("figure", rows.iter().map(|row| row.2))
            .float("shift", rows.iter().map(|row| row.3.shift))
            .float("standard_error", rows.iter().map(|row| row.3.error))
            .float("measured_s", rows.iter().map(|row| measured * row.4))
            .float("forecast_s", rows.iter().map(|row| row.4))
            .text("verdict", rows.iter().map(|row| row.5.clone()))
    }

    fn steps(&self) -> impl Iterator<Item = (&Ladder, &Step)> {
        self.ladders
            .iter()
            .flat_map(|ladder| ladder.steps.iter().map(move |step| (ladder, step)))
    }

    /// The answer for people.
    pub fn text(&self) -> String {
        let mut out = format!(
            "{}: accuracy of {} {}",
            crate::PROGRAM,
            S::NAME,
            self.of_scene
        );
        let (within, figures, own) = (
            percent(self.within),
            names(self.figures.iter()),
            seconds(self.own_s),
        );
        let [spent, allowed] = [self.spent_s, self.allowed_s].map(|s| s / self.own_s);
        let search =
            format!("search {spent:.1} of {allowed:.1} own runs (forecasts of one core)\n\n");
        out += &match S::IS_NOISY {
            true => format!(
                ", seed {}\nasked for: {within} % of {figures}, two standard errors included\nown run: {own} without pictures; pilot of {} \
                 realisations; {search}shift of each figure from the finest value, %, two standard errors in brackets; * chosen\n",
                self.scene.provenance().seed,
                self.pilot
            ),
            false => format!(
                "\nasked for: {within} % of {figures}\nown run: {own}; {search}error of each figure over the run, % of its root mean square; \
                 * chosen\n"
            ),
        };
        out += &self.key_table().aligned();
        for ladder in &self.ladders {
            out.extend(
                ladder
                    .note
                    .iter()
                    .map(|note| format!("{} {note}\n", ladder.key)),
            );
            let refused = ladder
                .steps
                .iter()
                .filter(|step| matches!(step.verdict, Verdict::Refused(_)));
            out.extend(
                refused.map(|step| format!("{} {}\n", step_text(step), step.verdict.words())),
            );
            let orders = ladder
                .orders
                .iter()
                .map(|(of, order)| format!("{} {}", of.name(), order_text(ladder.key, *order)));
            if !ladder.orders.is_empty() {
                out += &format!(
                    "{}: {}\n",
                    ladder.key,
                    orders.collect::<Vec<_>>().join(", ")
                );
            }
        }
        let response = self
            .response
            .iter()
            .map(|(figure, of)| format!("{} {}", figure.name(), percent(0.03 * of)));
        if !self.response.is_empty() {
            out += &format!(
                "3 % of efficiency shift at most, %: {}\n",
                response.collect::<Vec<_>>().join(", ")
            );
        }
        if S::IS_NOISY {
            // Runs without noise are not tried again with another seed.
            out += &format!(
                "\nnoise, two standard errors\n{}{}",
                self.noise_table().aligned(),
                self.whole_text()
            );
        }
        out.extend(self.notes.iter().map(|note| format!("note: {note}\n")));
        let reached = if self.is_reached() {
            "reached"
        } else {
            "not reached"
        };
        out + &format!("{reached}; run with these keys: {}\n", seconds(self.run_s))
    }

    fn key_table(&self) -> Table {
        let steps: Vec<(&Ladder, &Step)> = self.steps().collect();
        let chosen = |(ladder, step): &(&Ladder, &Step)| {
            step_text(step)
                + if step.value == ladder.value() {
                    "*"
                } else {
                    ""
                }
        };
        let now = |ladder: &Ladder| {
            let own = ladder.steps.iter().find(|step| step.value == ladder.now);
            own.map_or_else(|| value_text(ladder.now), step_text)
        };
        let mut table = Table::new()
            .text("key", steps.iter().map(|(ladder, _)| ladder.key))
            .text("now", steps.iter().map(|(ladder, _)| now(ladder)))
            .text("value", steps.iter().map(chosen))
            .text(
                "run",
                steps.iter().map(|(_, step)| seconds_text(step.forecast_s)),
            );
        for figure in &self.figures {
            let found = |(_, step): &(&Ladder, &Step)| {
                step.shift(*figure).map_or("-".into(), shift_text::<S>)
            };
            table = table.text(figure.name(), steps.iter().map(found));
        }
        // Why it is refused stands below.
        let verdict = |words: String| words.split(':').next().unwrap_or_default().to_owned();
        table.text(
            "verdict",
            steps.iter().map(|(_, step)| verdict(step.verdict.words())),
        )
    }

    fn noise_table(&self) -> Table {
        Table::new()
            .text(
                "figure",
                self.noises.iter().map(|noise| noise.figure.name()),
            )
            .text(
                "now [%]",
                self.noises.iter().map(|noise| percent(noise.now)),
            )
            .text("key", self.noises.iter().map(|noise| noise.key))
            .text(
                "needed",
                self.noises.iter().map(|noise| value_text(noise.needed)),
            )
            .text(
                "run",
                self.noises
                    .iter()
                    .map(|noise| seconds_text(noise.forecast_s)),
            )
            .text("verdict", self.noises.iter().map(words_of))
    }

    fn whole_text(&self) -> String {
        let verified = &self.verified;
        let mut out = match (verified.rows.is_empty(), verified.is_confirmed) {
            (true, true) => {
                "\nas a whole: nothing is coarser than the finest setting, nothing to confirm\n"
                    .to_owned()
            }
            (true, false) => "\nas a whole: not confirmed, the budget is spent\n".to_owned(),
            (false, true) => format!("\nas a whole, with seed {}: confirmed\n", verified.seed),
            (false, false) => format!("\nas a whole, with seed {}: not confirmed\n", verified.seed),
        };
        for (figure, predicted, found) in &verified.rows {
            let (predicted, found) = (percent(*predicted), shift_text::<S>(*found));
            out += &format!(
                "  {:<12} predicted {predicted:>6} %, found {found:>14} %\n",
                figure.name()
            );
        }
        out
    }

    /// The scene or case with the chosen keys, each with a comment, as TOML.
    pub fn scene_text(&self) -> String {
        let comment = |key: &str| {
            self.comment(key)
                .map(|words| format!(" # {words}"))
                .unwrap_or_default()
        };
        let toml = self.scene.provenance().scene_toml;
        let out: String = lines_with_keys(&toml)
            .map(|(key, line)| format!("{line}{}\n", comment(&key)))
            .collect();
        format!("# {}, {} {}\n{out}", crate::PROGRAM, S::NAME, hash_of(&out))
    }

    /// What is said of a key that was looked at.
    fn comment(&self, key: &str) -> Option<String> {
        // Cells have a key for each direction of a flow of one's own; a longest step and the scheme go with the steps.
        let is_of = |ladder: &&Ladder| {
            let goes_with = ["time.longest_step_s", "time.scheme"].contains(&key)
                && ladder.value() != ladder.now;
            let is_cells =
                ladder.key == CELLS && key.starts_with("case.") && key.ends_with(".cells");
            ladder.key == key || is_cells || (goes_with && ladder.key.starts_with("time."))
        };
        if let Some(ladder) = self.ladders.iter().find(is_of) {
            let shifts = ladder
                .steps
                .get(ladder.chosen)
                .map(|step| step.shifts.as_slice())
                .unwrap_or_default();
            let worst = shifts
                .iter()
                .map(|(_, own)| own.bound())
                .fold(0.0, f64::max);
            return Some(match &ladder.note {
                Some(note) => note.clone(),
                None if !S::IS_NOISY => {
                    format!("no figure is off by more than {} %", exact_percent(worst))
                }
                None if ladder.chosen == 0 => "the finest value that was looked at".into(),
                None => format!("shifts no figure by more than {} %", percent(worst)),
            });
        }
        let of = || self.noises.iter().filter(|noise| noise.key == key);
        let reached = names(
            of().filter(|noise| noise.is_reached)
                .map(|noise| &noise.figure),
        );
        of().next().map(|_| match reached.is_empty() {
            true => "as before: what the noise asks for is out of reach".into(),
            false => format!("noise of {reached}"),
        })
    }
}
