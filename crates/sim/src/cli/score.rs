//! `wakescope score`: predictions of any method against the truth of a data set.

use super::Cli;
use super::args::not_negative;
use super::data_sets::SplitArgs;
use super::options::WITHOUT_OUTPUT;
use super::output::paths;
use crate::io::{Existing, text_file};
use crate::outputs::Outputs;
use crate::score::{self, Predictions, ScoreOptions, Scores, Truth};
use crate::{Error, VERSION};
use clap::Args;
use std::path::PathBuf;

/// Arguments of `wakescope score`.
#[derive(Debug, Args)]
pub(super) struct ScoreArgs {
    /// Folder of the data set.
    data_set: PathBuf,
    /// Predictions (CSV), such as retrieval.csv of the data set.
    predictions: PathBuf,
    #[command(flatten)]
    splits: SplitArgs,
    /// Least circulation of scored vortices in m^2/s.
    #[arg(long, value_name = "M2/S", default_value_t = 50.0, value_parser = not_negative)]
    least: f64,
    /// Scans without a row are those in which nothing was found.
    #[arg(long)]
    missing_is_none: bool,
    /// Output folder for tables and pictures; created if missing.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace existing files in the output folder.
    #[arg(long)]
    overwrite: bool,
}

pub(super) fn score(args: &ScoreArgs, cli: &Cli) -> Result<(), Error> {
    let existing = Existing::with_overwrite(args.overwrite);
    match &args.out {
        Some(folder) => {
            let names = Outputs::names(Default::default(), |files| list(None, files))?;
            cli.prepare(folder, &names, existing)?;
        }
        None => cli.refuse_idle("score", WITHOUT_OUTPUT)?,
    }
    let (truth, data_set) = Truth::read(&args.data_set)?;
    let splits = args.splits.splits();
    data_set.check_splits(&splits)?;
    let mut origin = data_set.origin();
    origin.seed = cli.seed.unwrap_or(origin.seed);
    let options = ScoreOptions {
        splits,
        least_m2_s: args.least,
        missing_is_none: args.missing_is_none,
        seed: origin.seed,
    };
    let path = &args.predictions;
    let text = text_file::read_data(path).map_err(Error::io("read", path))?;
    let predictions = Predictions::parse(&text, path, &truth, &options)?;
    let scores = score::score(&truth, &predictions, &options);
    let result: Scored<'_> = (&scores, &predictions, &options);
    let mut object = score::json(&scores, &predictions, &options);
    let mut report = score::summary(&scores, &predictions, &options);
    let mut files = Vec::new();
    if let Some(folder) = &args.out {
        let of = (Default::default(), origin);
        files = cli.write(folder, existing, of, |files| list(Some(result), files))?;
        report += &format!("wrote {} files to {}\n", files.len(), folder.display());
    }
    let readings_before = score::add_reading(&args.data_set, &text, &options.splits);
    let has_test = options.splits.iter().any(|split| split.is_test());
    if has_test && readings_before > 0 {
        report += &format!(
            "test splits of this data set were scored with other predictions before: {readings_before}\n"
        );
    }
    object["readings_before"] = readings_before.into();
    object["version"] = VERSION.into();
    object["files"] = paths(&files).into();
    cli.say(&object, &report)
}

/// Scores, of which predictions, and how.
type Scored<'r> = (&'r Scores, &'r Predictions, &'r ScoreOptions);

/// The files; before the predictions are scored their names alone.
fn list(result: Option<Scored<'_>>, files: &mut Outputs) -> Result<(), Error> {
    let scores = result.map(|(scores, ..)| scores);
    files.table("score", scores, |scores| Ok(score::table(scores)))?;
    files.add("score.json", result.as_ref(), |result, origin| {
        let (scores, predictions, options) = result;
        let mut object = score::json(scores, predictions, options);
        object["source"] = origin.program.clone().into();
        object["plan_hash"] = origin.scene_hash.clone().into();
        Ok(format!("{object:#}\n"))
    })?;
    #[cfg(feature = "plots")]
    files.figure("score", scores, |scores| Ok(score::figure(scores)))?;
    Ok(())
}
