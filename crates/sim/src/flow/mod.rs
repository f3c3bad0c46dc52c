//! Simulations of the air: a case file goes in; a table of the steps, fields, planes and checkpoints come out.
//!
//! A [`CaseFile`] is a vortex pair or a wake with its parameters, or gives a mesh, a viscosity and an initial field of your own.
//! [`run`] runs it with the solver of `wakescope-les`, which does the computing; this module reads the case, writes the files and
//! continues runs from their checkpoints.
//!
//! Check: every example file is read and run; interrupted runs leave the same files as others; wrong cases are refused with
//! key, value and what is allowed.

mod case;
mod execute;
mod files;
pub(crate) mod forecast;
mod free;
mod initial_file;
mod integration;
mod kind;
#[cfg(test)]
pub(crate) mod plane_vortices_for_tests;
#[cfg(test)]
mod ranks_tests;
mod setup;
mod text;
#[cfg(test)]
#[path = "../../../les/src/ranks/threads_for_tests.rs"]
mod thread_ranks;
pub(crate) mod trial;
mod vortex_pair;
mod wake;
mod writer;

pub use case::*;
pub use execute::{check_on, run, run_on};
pub use files::FileForecast;
pub use forecast::FlowForecast;
pub use free::*;
pub use kind::CaseKind;
pub use text::{EXAMPLES, example};
pub use vortex_pair::VortexPairFlow;
#[cfg(feature = "plots")]
pub use wake::REPEATS;
pub use wake::{FinishedWake, PairScale, WakeFlow, WakeOutput, WakePreset, WakeProfile, table};

use crate::Error;
use crate::document::{Content, Document};
use crate::keys::{Problem, to_table};
use std::path::{Path, PathBuf};

/// A valid case, with what names it.
pub type CaseFile = Document<FlowCase>;

impl Content for FlowCase {
    fn parse(text: &str, path: &Path) -> Result<Self, Error> {
        text::read(text, path, None)
    }

    fn to_toml(&self) -> String {
        toml::to_string(&to_table(self))
            .unwrap_or_else(|e| unreachable!("a case is plain data: {e}"))
    }

    fn seed(&self) -> u64 {
        // 0 means noise by a closed formula, or none.
        if let CaseKind::Wake(wake) = &self.case {
            wake.seed.unwrap_or(0)
        } else {
            0
        }
    }
}

impl CaseFile {
    /// Whether a text is a case, by its keys, and no scene.
    pub fn is_of(text: &str) -> bool {
        text.parse::<toml::Table>()
            .is_ok_and(|table| table.contains_key("case"))
    }

    /// The text of a case file over the preset of a wake, if there is one: keys that it does not have are those of the preset.
    ///
    /// # Errors
    /// As [`CaseFile::parse`].
    pub fn parse_over(preset: Option<WakePreset>, text: &str, path: &Path) -> Result<Self, Error> {
        let base = preset.map(WakePreset::case);
        Ok(Self::of(text::read(text, path, base.as_ref())?, path, text))
    }

    /// The same case with another end: the age `tau` of a wake, of other flows a time \[s\]. Outputs behind it are skipped.
    ///
    /// # Errors
    /// An end that is no finite number above 0.
    pub fn with_end(&self, end: f64) -> Result<Self, Error> {
        let mut case = self.content.clone();
        case.time.end_s = None;
        match &mut case.wake {
            Some(wake) => wake.end_at(
                end,
                ["wake.fields_tau", "wake.planes_tau"].map(|key| self.states(key)),
            ),
            None => {
                case.time.end_s = Some(end);
                case.output.times_s.retain(|time_s| *time_s <= end);
            }
        }
        let mut problems = case.problems();
        for problem in &mut problems {
            // The end is of the command line, whatever the file says of it.
            if ["time.end_s", "wake.end_tau"].contains(&problem.key.as_str()) {
                problem.key = "--end".into();
            }
        }
        if problems.is_empty() {
            Ok(self.changed(case))
        } else {
            Err(self.refused(problems))
        }
    }

    /// The same case with another seed of its noise.
    ///
    /// # Errors
    /// A flow whose noise has no seed.
    pub fn with_seed(&self, seed: u64) -> Result<Self, Error> {
        let mut case = self.content.clone();
        let CaseKind::Wake(wake) = &mut case.case else {
            let allowed = "absent: this flow has no noise; it is for case.kind = \"wake\"";
            return Err(self.refused(vec![Problem::new("--seed", seed.to_string(), allowed)]));
        };
        wake.seed = Some(seed);
        Ok(self.changed(case))
    }

    fn refuse(&self, key: &str, value: impl std::fmt::Debug, allowed: String) -> Error {
        self.located(vec![Problem::new(key, format!("{value:?}"), allowed)])
    }
}

/// Whether a run begins or continues.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Begin {
    /// From the initial field; an earlier checkpoint in the folder is not overwritten.
    #[default]
    New,
    /// From the initial field, over whatever is there.
    Overwrite,
    /// From the checkpoint in the folder.
    Restart,
}

/// What a run did.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowOutcome {
    /// Steps of the flow, those before a restart included.
    pub steps: u64,
    /// Time reached \[s\].
    pub time_s: f64,
    /// Whether that is the end, not a pause.
    pub is_complete: bool,
    /// Wall time of the steps \[s\].
    pub steps_wall_s: f64,
    /// Part of it in exchanges between ranks \[s\].
    pub exchange_wall_s: f64,
    /// Kinetic energy, integral of `u^2/2` \[m^5/s^2\].
    pub kinetic_energy_m5_s2: f64,
    /// Largest divergence over the largest `sum |u_i|/h_i`.
    pub relative_divergence: f64,
    /// Files written, in the order of writing.
    pub files: Vec<PathBuf>,
    /// What deserves attention.
    pub warnings: Vec<String>,
}

#[cfg(test)]
mod tests;
