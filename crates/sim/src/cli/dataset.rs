//! `wakescope dataset`: data sets of scans with exact truth.

use super::options::{BESIDE_CHECKED_PLAN, BESIDE_PRINTED_PLAN};
use super::{Cli, paths};
use crate::Error;
use crate::dataset::plan::DatasetPlan;
use crate::dataset::presets::{PRESETS, preset_plan};
use crate::dataset::run::{self, Dataset, Settings, Summary};
use crate::quantities::{bytes, seconds};
use clap::Args;
use clap::builder::PossibleValuesParser;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Arguments of `wakescope dataset`.
#[derive(Debug, Args)]
pub(super) struct DatasetArgs {
    /// Plan: a scene, and what varies.
    #[arg(required_unless_present = "preset")]
    plan: Option<PathBuf>,
    /// Plan that comes with the program.
    #[arg(long, value_name = "NAME", conflicts_with = "plan", value_parser = PossibleValuesParser::new(PRESETS.map(|(name, _)| name)))]
    preset: Option<String>,
    /// Print the plan of the preset and exit.
    #[arg(long, requires = "preset", conflicts_with_all = ["check", "scene", "out"])]
    print: bool,
    /// Check the plan; print flights, bytes, run time and free space.
    #[arg(long, conflicts_with = "scene")]
    check: bool,
    /// Print the scene of a flight and exit.
    #[arg(long, value_name = "FLIGHT", conflicts_with = "out")]
    scene: Option<usize>,
    #[command(flatten)]
    settings: Settings,
    /// Output folder; created if missing.
    #[arg(long, value_name = "DIR", required_unless_present_any = ["print", "check", "scene"])]
    out: Option<PathBuf>,
}

/// Runs, checks or prints a plan.
pub(super) fn dataset(args: &DatasetArgs, cli: &Cli) -> Result<(), Error> {
    let plan = plan(args, cli)?;
    if args.print {
        cli.refuse_idle("--print", BESIDE_PRINTED_PLAN)?;
        return cli.say(&json!({ "plan": plan.text }), plan.text.trim_end());
    }
    if let Some(number) = args.scene {
        cli.refuse_idle("--scene", BESIDE_PRINTED_PLAN)?;
        return print_scene(&plan, number, cli);
    }
    let dataset = Dataset::new(&plan, args.settings)?;
    let Some(out) = args.out.as_deref().filter(|_| !args.check) else {
        cli.refuse_idle("--check", BESIDE_CHECKED_PLAN)?;
        return say_forecast(&plan, &dataset, args.out.as_deref(), cli);
    };
    let observer = cli.observer();
    observer.forecast(&format!("{}\n", text_of(&dataset)));
    let summary = dataset.run(out, &*observer)?;
    say_summary(&plan, &summary, out, cli)
}

/// The plan of the arguments.
fn plan(args: &DatasetArgs, cli: &Cli) -> Result<DatasetPlan, Error> {
    match (&args.plan, &args.preset) {
        (Some(path), _) => DatasetPlan::parse(&cli.text(path)?, path, cli.seed),
        (None, preset) => {
            let name = preset.as_deref().unwrap_or_default();
            let text = preset_plan(name).unwrap_or_default();
            DatasetPlan::parse(text, Path::new(&format!("{name}.toml")), cli.seed)
        }
    }
}

fn print_scene(plan: &DatasetPlan, number: usize, cli: &Cli) -> Result<(), Error> {
    let flights = plan.keys.flights();
    if number >= flights {
        let reason = format!(
            "--scene {number} is not allowed: a flight from 0 to {}",
            flights - 1
        );
        return Err(Error::input(plan.path(), reason));
    }
    let flight = plan.flight(number)?;
    let text = flight.scene.provenance().scene_file();
    let object =
        json!({ "flight": number, "site": flight.site, "empty": flight.is_empty, "scene": text });
    cli.say(&object, text.trim_end())
}

fn text_of(dataset: &Dataset<'_>) -> String {
    format!(
        "{} flights of {} scans of {} lines and {} gates: {} on disk, {} of one core, {} of memory",
        dataset.flights(),
        dataset.shape.scans,
        dataset.shape.elevation_deg.len(),
        dataset.shape.range_m.len(),
        bytes(dataset.disk_bytes()),
        seconds(dataset.core_s()),
        bytes(dataset.memory_bytes())
    )
}

fn say_forecast(
    plan: &DatasetPlan,
    dataset: &Dataset<'_>,
    out: Option<&Path>,
    cli: &Cli,
) -> Result<(), Error> {
    let mut text = format!(
        "{}: good, plan {}\n{}",
        plan.path().display(),
        plan.hash,
        text_of(dataset)
    );
    let mut free_bytes = None;
    if let Some(out) = out {
        run::check_folder(out)?;
        free_bytes = crate::machine::free_bytes(out);
    }
    if let Some(free) = free_bytes {
        text += &format!("; {} are free there", bytes(free));
    }
    let object = json!({
        "version": crate::VERSION, "plan_hash": plan.hash, "flights": dataset.flights(), "scans": dataset.shape.scans,
        "lines": dataset.shape.elevation_deg.len(), "gates": dataset.shape.range_m.len(), "bytes": dataset.disk_bytes(),
        "core_s": dataset.core_s(), "memory_bytes": dataset.memory_bytes(), "free_bytes": free_bytes,
    });
    cli.say(&object, &text)
}

fn say_summary(plan: &DatasetPlan, summary: &Summary, out: &Path, cli: &Cli) -> Result<(), Error> {
    let Summary {
        flights,
        chunks,
        kept,
    } = summary;
    let text = format!(
        "{flights} flights run in {chunks} chunks, {kept} chunks kept\nwrote {}",
        out.display()
    );
    let object = json!({
        "version": crate::VERSION, "plan_hash": plan.hash, "flights": flights, "chunks": chunks, "kept": kept,
        "files": paths(&run::paths(out)),
    });
    cli.say(&object, &text)
}
