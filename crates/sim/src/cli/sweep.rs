//! `wakescope sweep` and `wakescope pareto`: design studies.

use super::progress::{Quiet, SweepBar};
use super::words::{TableWords, existing};
use super::{Cli, paths, say};
use crate::io::csv_input::TextTable;
use crate::sweep::front_table::{FrontTable, Wanted};
use crate::sweep::{Request, Settings, Shard, Sweep, merge, run};
use crate::{Error, sweep};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Words of `wakescope sweep`.
#[derive(Debug, Args)]
pub(super) struct SweepWords {
    /// The scene that all cases begin with.
    #[arg(required_unless_present = "merge")]
    scene: Option<PathBuf>,
    /// A key and its values: KEY=a,b,c or KEY=lin:FIRST:LAST:COUNT or KEY=log:FIRST:LAST:COUNT; the last --vary is fastest.
    #[arg(long, value_name = "KEY=VALUES")]
    vary: Vec<String>,
    /// A table of cases: a column for each key, a row for each case.
    #[arg(long, value_name = "FILE.csv")]
    cases: Option<PathBuf>,
    /// A key by arithmetic on others, e.g. "pulse.energy_j = 0.06/laser.pulse_repetition_hz".
    #[arg(long = "let", value_name = "KEY = EXPRESSION")]
    lets: Vec<String>,
    /// Leave out the cases for which this does not hold, e.g. "pulse.energy_j*laser.pulse_repetition_hz <= 2".
    #[arg(long = "where", value_name = "CONDITION")]
    conditions: Vec<String>,
    /// Run part NUMBER of COUNT of the cases, e.g. 2/8; --merge makes the tables of all.
    #[arg(long, value_name = "NUMBER/COUNT")]
    shard: Option<Shard>,
    /// Leave cases as they are whose result is there.
    #[arg(long)]
    resume: bool,
    /// Run nothing: make the tables from the results in these folders.
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = ["shard", "resume"])]
    merge: Vec<PathBuf>,
    /// A seed for each case; without it all have the scene's, and differences between cases are the clearer.
    #[arg(long)]
    independent: bool,
    /// Leave out the fits of the circulation, which take longer than the maps where regions are small.
    #[arg(long)]
    no_circulation: bool,
    /// Folder to write to; made if it does not exist.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Run even if the forecast of the memory of a case is more than the machine has.
    #[arg(long)]
    allow_large: bool,
    /// Replace another sweep, or files that this program did not write.
    #[arg(long)]
    overwrite: bool,
}

pub(super) fn sweep(words: &SweepWords, cli: &Cli) -> Result<(), Error> {
    let request = Request {
        vary: words.vary.clone(),
        list: words.cases.clone(),
        lets: words.lets.clone(),
        conditions: words.conditions.clone(),
        independent: words.independent,
        seed: cli.seed,
    };
    let sweep = words.scene.as_deref().map(|scene| Sweep::new(scene, &request)).transpose()?;
    let existing = existing(words.overwrite);
    let Some(sweep) = sweep.as_ref().filter(|_| words.merge.is_empty()) else {
        let files = merge(&words.merge, sweep.as_ref(), &words.out, existing)?;
        let text = format!("wrote {} files to {}", files.len(), words.out.display());
        return say(cli.json, &json!({ "version": crate::VERSION, "files": paths(&files) }), &text);
    };
    let settings = Settings {
        shard: words.shard,
        resume: words.resume,
        allow_large: words.allow_large,
        fits: !words.no_circulation,
        existing,
    };
    let bar = (!cli.quiet).then(SweepBar::new);
    let mut told = |case: &str, done, of| bar.iter().for_each(|bar| bar.done(case, done, of));
    let summary = run(sweep, &words.out, settings, &Quiet, &mut told)?;
    drop(bar);
    let sweep::Summary { run: ran, kept, shared, files } = &summary;
    let text = format!(
        "{ran} cases run, {kept} kept; computed once for all that share them: flows {}, efficiency curves {}, signals {}\n\
         wrote {} files and the folders of the cases to {}",
        shared.flows,
        shared.efficiencies,
        shared.signals,
        files.len(),
        words.out.display()
    );
    let object = json!({
        "version": crate::VERSION, "sweep_hash": sweep.origin.scene_hash, "cases": sweep.cases.len(), "run": ran,
        "kept": kept, "flows": shared.flows, "efficiencies": shared.efficiencies, "signals": shared.signals,
        "files": paths(files),
    });
    say(cli.json, &object, &text)
}

/// Words of `wakescope pareto`.
#[derive(Debug, Args)]
pub(super) struct ParetoWords {
    /// The table, such as results.csv of a sweep.
    table: PathBuf,
    /// A column of which small values are better.
    #[arg(long, value_name = "COLUMN")]
    min: Vec<String>,
    /// A column of which large values are better.
    #[arg(long, value_name = "COLUMN")]
    max: Vec<String>,
    /// Only rows for which this holds, e.g. "resolution_m <= 35".
    #[arg(long = "where", value_name = "CONDITION")]
    conditions: Vec<String>,
    #[command(flatten)]
    front: TableWords,
}

pub(super) fn pareto(words: &ParetoWords, cli: &Cli) -> Result<(), Error> {
    words.front.prepare()?;
    let wanted = Wanted { min: &words.min, max: &words.max, conditions: &words.conditions };
    let refuse = |reason| Error::Input { path: words.table.clone(), reason };
    let found = FrontTable::new(TextTable::read(&words.table)?, &wanted).map_err(refuse)?;
    let mut text = found.text();
    words.front.write(&found.rows(), &found.origin(), &mut text)?;
    say(cli.json, &found.json(), &text)
}
