//! The command line program `wakescope`: arguments in, files and exit codes out.
//!
//! Exit codes: 0 done, 1 no value of a setting has the requested accuracy, 2 wrong input or unusable output. Progress, plans and errors go to standard error,
//! results to standard output; `--json` makes the result one JSON object, and so an error.

mod accuracy;
mod args;
mod bound;
mod data_files;
mod data_sets;
mod dataset;
mod detect;
mod estimate;
mod flow;
mod help;
mod host;
mod options;
mod output;
mod progress;
mod retrieve;
mod score;
mod sweep;
mod wind;

use crate::flow::{EXAMPLES, WakePreset};
use crate::io::Existing;
use crate::io::csv::digits;
use crate::measure::budget::{scan_ranges_m, snr_without_screens_db};
use crate::measure::efficiency_model::model;
use crate::plan::{Plan, Stage, Target};
use crate::scene::{SceneFile, TABLE2_TOML, preset_names, preset_toml};
use crate::{Error, run, write};
use args::FolderArgs;
use clap::builder::PossibleValuesParser;
use clap::{Args, Parser, Subcommand};
use output::paths;
use serde_json::{Value, json};
use std::ffi::OsString;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use wakescope_optics::plan::Model;

pub use host::{Answer, Host, Refusal, call, refusal, refusal_of_value};
pub use options::command;

/// Simulate coherent Doppler lidar measurements of aircraft wake vortices.
#[derive(Parser)]
#[command(name = "wakescope", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Number of threads; one per core by default. Results do not change.
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Random seed; by default that of the scene.
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    seed: Option<u64>,
    /// Suppress plan and progress; `check` prints errors only.
    #[arg(long, global = true)]
    quiet: bool,
    /// Print the result, or the error, as one JSON object.
    #[arg(long, global = true)]
    json: bool,
    /// The program that runs the command.
    #[arg(skip)]
    host: Option<Host>,
    /// What that program receives.
    #[arg(skip)]
    answer: Mutex<Answer>,
    /// Long names of the options that the command line states.
    #[arg(skip)]
    given: Vec<String>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write a commented scene file with every key and its default.
    Init {
        /// Scene file to write.
        #[arg(default_value = "scene.toml")]
        scene: PathBuf,
        /// Replace an existing file.
        #[arg(long)]
        force: bool,
        /// Nominal set-up of a real lidar, with sources.
        #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(preset_names()))]
        preset: Option<String>,
    },
    /// Check a scene; print its plan, run time and memory.
    Check(CheckArgs),
    /// Simulate the whole measurement and write all requested files.
    Run(Io),
    /// Compute heterodyne efficiency and signal-to-noise ratio against range.
    Efficiency(Io),
    /// Simulate the raw signals of a scan.
    Signal(Io),
    /// Simulate a radial-velocity map with its errors.
    Map(Io),
    /// Estimate velocities from raw signals, simulated or measured.
    Estimate(estimate::EstimateArgs),
    /// Fit circulation, position and core of vortices to scans of any lidar.
    Retrieve(retrieve::RetrieveArgs),
    /// Print the Cramer-Rao bound of velocity against signal-to-noise ratio and range.
    Bound {
        /// Scene file.
        scene: PathBuf,
        /// CSV file for the whole table.
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
        /// Replace an existing file.
        #[arg(long)]
        overwrite: bool,
        /// Run even if the memory forecast exceeds the machine's.
        #[arg(long)]
        allow_large: bool,
    },
    /// Print the power budget, from pulse energy to signal-to-noise ratio.
    Budget {
        /// Scene file.
        scene: PathBuf,
        /// Ranges in m; by default start, middle and end of the scan.
        #[arg(long, value_name = "M,M,...", value_delimiter = ',', value_parser = args::range)]
        range: Vec<f64>,
        /// Output folder for budget.csv; created if missing.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Replace an existing table.
        #[arg(long)]
        overwrite: bool,
    },
    /// Detect wakes at a given false-alarm rate; report the smallest detectable circulation.
    Detect(detect::DetectArgs),
    /// Find wind over height and turbulence from scans of any lidar.
    Wind(wind::WindArgs),
    /// Score predictions against the truth of a data set.
    Score(score::ScoreArgs),
    /// Run a scene with varied keys; tabulate and plot the results.
    Sweep {
        /// Scene file that all cases are based on.
        #[arg(required_unless_present = "merge")]
        scene: Option<PathBuf>,
        #[command(flatten)]
        request: crate::sweep::Request,
        /// Run nothing; build the tables from results in these folders.
        #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = ["shard", "resume"])]
        merge: Vec<PathBuf>,
        #[command(flatten)]
        settings: crate::sweep::Settings,
        /// Output folder; created if missing.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Report numerical error and run time of each setting.
    Accuracy {
        /// Scene file, or case file of a flow or wake.
        #[arg(required_unless_present = "preset")]
        scene: Option<PathBuf>,
        /// Wake preset; a case file overrides its keys.
        #[arg(long, value_enum)]
        preset: Option<WakePreset>,
        #[command(flatten)]
        request: crate::accuracy::Request,
        #[command(flatten)]
        folder: FolderArgs,
    },
    /// Simulate a data set of scans with exact truth from a plan.
    Dataset(dataset::DatasetArgs),
    /// Simulate a flow from a case file; write fields and checkpoints.
    Flow {
        /// Case file; --example prints one.
        #[arg(required_unless_present = "example")]
        case: Option<PathBuf>,
        #[command(flatten)]
        run: flow::RunArgs,
        /// Print a commented case file and exit.
        #[arg(long, value_name = "NAME", conflicts_with_all = ["case", "out"], value_parser = EXAMPLES.map(|(name, _)| name))]
        example: Option<String>,
    },
    /// Simulate an aircraft wake near the ground: preset or case file.
    Wake {
        /// Case file with kind = "wake"; the preset supplies missing keys.
        case: Option<PathBuf>,
        /// Resolution; coarse by default, unless a case file is given.
        #[arg(long, value_enum)]
        preset: Option<WakePreset>,
        /// Print the case file and exit.
        #[arg(long)]
        print: bool,
        #[command(flatten)]
        run: flow::RunArgs,
    },
}

#[derive(Debug, Args)]
struct Io {
    /// Scene file.
    scene: PathBuf,
    #[command(flatten)]
    folder: FolderArgs,
    /// Run even if the memory forecast exceeds the machine's.
    #[arg(long)]
    allow_large: bool,
}

/// Arguments of `wakescope check`.
#[derive(Debug, Args)]
struct CheckArgs {
    /// Scene file.
    scene: PathBuf,
    /// Output folder of the run, to be checked too.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Accept a memory forecast that exceeds the machine's.
    #[arg(long)]
    allow_large: bool,
    /// Draw the set-up to this SVG or PNG file.
    #[cfg(feature = "plots")]
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Replace the picture; accept existing files in the folder.
    #[arg(long)]
    overwrite: bool,
}

/// Runs the program with the arguments of its command line, the first being its name; returns its exit code.
pub fn main(args: impl IntoIterator<Item = OsString>) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    let cli = match Cli::read(args.iter().cloned()) {
        Ok(cli) => cli,
        Err(e) => return output::explain(&e, args.iter().any(|word| word == "--json")),
    };
    // All in one pool: forecasts count its threads, and files reuse the memory that the computing freed.
    match with_threads(&cli, || dispatch(&cli)).flatten() {
        Ok(code) => code,
        Err(e) => {
            output::complain(&e, cli.json);
            2
        }
    }
}

fn dispatch(cli: &Cli) -> Result<u8, Error> {
    match &cli.command {
        Command::Accuracy {
            scene,
            preset,
            request,
            folder,
        } => return accuracy::accuracy(scene.as_deref(), *preset, request, folder, cli),
        Command::Init {
            scene,
            force,
            preset,
        } => init(scene, *force, preset.as_deref(), cli),
        Command::Check(args) => check(args, cli),
        Command::Run(io) => execute(io, Target::Run, cli),
        Command::Efficiency(io) => execute(io, Target::Efficiency, cli),
        Command::Signal(io) => execute(io, Target::Signal, cli),
        Command::Map(io) => execute(io, Target::Map, cli),
        Command::Estimate(args) => estimate::estimate(args, cli),
        Command::Retrieve(args) => retrieve::retrieve(args, cli),
        Command::Bound {
            scene,
            out,
            overwrite,
            allow_large,
        } => bound::plan(scene, *allow_large, cli)
            .and_then(|plan| bound::bound(&plan, out.as_deref(), *overwrite, cli)),
        Command::Budget {
            scene,
            range,
            out,
            overwrite,
        } => bound::budget(scene, range, out.as_deref(), *overwrite, cli),
        Command::Detect(args) => detect::detect(args, cli),
        Command::Wind(args) => wind::wind(args, cli),
        Command::Score(args) => score::score(args, cli),
        Command::Sweep {
            scene,
            request,
            merge,
            settings,
            out,
        } => sweep::cases(scene.as_deref(), request, cli)
            .and_then(|cases| sweep::sweep(cases.as_ref(), merge, out, *settings, cli)),
        Command::Dataset(args) => dataset::dataset(args, cli),
        Command::Flow { case, run, example } => {
            flow::flow(example.as_deref(), case.as_deref(), run, cli)
        }
        Command::Wake {
            case,
            preset,
            print,
            run,
        } => match print {
            true => flow::print_wake(case.as_deref(), *preset, run.end, cli),
            false => flow::wake(case.as_deref(), *preset, run, cli),
        },
    }?;
    Ok(0)
}

fn init(path: &Path, force: bool, preset: Option<&str>, cli: &Cli) -> Result<(), Error> {
    let mut text = preset
        .and_then(preset_toml)
        .unwrap_or_else(|| TABLE2_TOML.to_owned());
    if let Some(seed) = cli.seed {
        text = text.replacen("seed = 1 ", &format!("seed = {seed} "), 1);
    }
    SceneFile::parse(&text, path)?;
    if !force && path.exists() {
        let source = std::io::Error::new(
            std::io::ErrorKind::AlreadyExists,
            "it exists; --force replaces it",
        );
        return Err(Error::Io {
            action: "write",
            path: path.to_owned(),
            source,
        });
    }
    crate::io::write_atomic(path, text.as_bytes())?;
    let text = format!("wrote {}\nnext: wakescope check {0}", path.display());
    cli.say(&json!({ "scene": path.to_string_lossy() }), &text)
}

/// What the ratio of a check lacks where phase screens make the efficiency.
const AS_ON_INDEPENDENT_PATHS: &str = "; turbulence as on independent paths: one path out and back returns more, by as much as wakescope budget says";

fn check(args: &CheckArgs, cli: &Cli) -> Result<(), Error> {
    #[cfg(feature = "plots")]
    let writes = args.out.is_some() || args.picture.is_some();
    #[cfg(not(feature = "plots"))]
    let writes = args.out.is_some();
    if !writes {
        cli.refuse_idle(&args.scene, options::WITHOUT_OUTPUT)?;
    }
    let plan = planned(&args.scene, Target::Run, args.allow_large, cli)?;
    let existing = Existing::with_overwrite(args.overwrite);
    if let Some(folder) = &args.out {
        // What is in the way of a run is in the way of it here, too.
        cli.prepare(folder, &write::names(&plan)?, existing)?;
    }
    #[cfg(feature = "plots")]
    if let Some(path) = &args.picture {
        write::write_set_up(&plan, path, existing)?;
    }
    if cli.quiet && !cli.json {
        return Ok(());
    }
    let ranges_m = scan_ranges_m(plan.scene());
    let snr_db = snr_without_screens_db(&plan, &ranges_m)?;
    // What only phase screens could give is not printed.
    let is_less = plan.runs(Stage::PhaseScreens) && model(plan.scene()) == Model::MonteCarlo;
    let mut object = plan_json(&plan);
    object["budget"] =
        json!({ "range_m": ranges_m, "snr_db": snr_db, "independent_paths": is_less });
    let screens = if is_less { AS_ON_INDEPENDENT_PATHS } else { "" };
    let ranges = ranges_m
        .iter()
        .map(f64::to_string)
        .collect::<Vec<_>>()
        .join(", ");
    let ratios = snr_db
        .iter()
        .map(|db| format!("{db:.2}"))
        .collect::<Vec<_>>()
        .join(", ");
    let short = format!("SNR in the band, one pulse, at {ranges} m: {ratios} dB{screens}");
    cli.say(
        &object,
        &format!("{}: good\n{plan}  {short}\n", args.scene.display()),
    )
}

/// The plan of a scene, with all that can be known before the computing: limits, memory.
fn planned(scene: &Path, target: Target, allow_large: bool, cli: &Cli) -> Result<Plan, Error> {
    let plan = Plan::new(cli.scene(scene)?, target)?;
    if !allow_large {
        plan.fits()?;
    }
    Ok(plan)
}

fn execute(io: &Io, target: Target, cli: &Cli) -> Result<(), Error> {
    let plan = planned(&io.scene, target, io.allow_large, cli)?;
    io.folder.prepare_names(cli, &write::names(&plan)?)?;
    if !cli.quiet {
        let _ = write!(std::io::stderr(), "{plan}");
    }
    let outcome = run::run(&plan, &*cli.observer())?;
    let summary = outcome.summary();
    let mut text: String = summary
        .iter()
        .map(|(_, text, value)| format!("{text:<44} {}\n", digits(*value)))
        .collect();
    let values: serde_json::Map<_, _> = summary
        .iter()
        .map(|(key, _, value)| ((*key).into(), json!(value)))
        .collect();
    let mut object = plan_json(&plan);
    object["results"] = Value::Object(values);
    if let Some(retrieval) = &outcome.retrieval {
        let errors = retrieval.error_table();
        let detected = retrieval.detected();
        text += &errors.aligned();
        let share = "share of scans in which the test finds a wake";
        text.extend(detected.map(|found| format!("{share:<44} {}\n", digits(found))));
        object["retrieval"] = json!({ "errors": errors.objects(), "detected": detected });
    }
    let of = (plan.scene().outputs, plan.file.provenance());
    io.folder.finish(
        cli,
        of,
        |files| write::list(&plan, &outcome, files),
        (object, text),
    )
}

fn with_threads<T: Send>(cli: &Cli, work: impl FnOnce() -> T + Send) -> Result<T, Error> {
    let threads = usize::from(cli.threads.unwrap_or(0));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|e| Error::Threads {
        threads,
        reason: e.to_string(),
    })?;
    Ok(pool.install(work))
}

fn plan_json(plan: &Plan) -> Value {
    let stages = plan.stages.iter().map(|s| {
        json!({
            "stage": s.stage.name(), "runs": s.runs, "reason": s.reason,
            "memory_bytes": s.runs.then_some(s.memory_bytes), "kept_bytes": s.runs.then_some(s.kept_bytes),
        })
    });
    let stages: Vec<Value> = stages.collect();
    json!({
        "version": crate::VERSION, "scene_hash": plan.file.hash, "seed": plan.scene().seed,
        "scan": plan.schedule(), "stages": stages, "core_s": plan.core_s(), "memory_bytes": plan.memory_bytes(), "warnings": plan.warnings,
    })
}
