//! `wakescope wake`: the wake of an aircraft near the ground, from a preset or a case file.

use super::Cli;
use super::flow::{RunWords, simulate};
use crate::Error;
use crate::flow::{CaseFile, CaseKind, WakePreset};
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use wakescope_les::ranks::Ranks;

/// Words of `wakescope wake`.
#[derive(Debug, Args)]
pub(super) struct WakeWords {
    /// A case file with kind = "wake"; keys that it lacks are those of the preset.
    case: Option<PathBuf>,
    /// How fine the flow is; coarse without one, unless a case file is given.
    #[arg(long, value_enum)]
    preset: Option<WakePreset>,
    /// Print the case file and do nothing else.
    #[arg(long)]
    print: bool,
    #[command(flatten)]
    run: RunWords,
}

pub(super) fn wake(words: &WakeWords, cli: &Cli, ranks: &Arc<dyn Ranks>) -> Result<(), Error> {
    let file = case_file(words.case.as_deref(), words.preset, cli)?;
    if !matches!(file.case.case, CaseKind::Wake(_)) {
        let path = words.case.clone().unwrap_or_default();
        return Err(Error::Input { path, reason: "case.kind is not \"wake\": wakescope flow runs it".into() });
    }
    if words.print {
        let file = cli.seed.map_or(Ok(file.clone()), |seed| file.with_seed(seed))?;
        return if ranks.rank() == 0 { cli.print(&file.toml) } else { Ok(()) };
    }
    simulate(file, &words.run, cli, ranks)
}

/// A case file, a preset, or the one over the other; the coarse preset without either.
pub(super) fn case_file(path: Option<&Path>, preset: Option<WakePreset>, cli: &Cli) -> Result<CaseFile, Error> {
    match path {
        Some(path) => cli.case(path, preset),
        None => Ok(CaseFile::parse_over(preset.or(Some(WakePreset::Coarse)), "", Path::new("preset"))?),
    }
}
