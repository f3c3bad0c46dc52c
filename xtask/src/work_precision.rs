//! `cargo xtask work-precision`: error against run time of every solver, every estimator and the whole chain, knob by knob.
//!
//! Every row is measured in this run, on one thread; the time is the smallest of three runs, of one beyond 0.2 s. Errors are relative, with their standard
//! errors; a setting that fails is a row. Tables, pictures and the cheapest settings go to `target/work-precision`.

mod chain;
mod estimate;
mod front;
mod les;
mod optics;
pub(crate) mod show;
mod signal;

use crate::cost::{Cost, machine};
use crate::workspace::{provenance, root};
use fixtures::failure::{Failure, Outcome};
use front::Measured;
use std::path::PathBuf;
use wakescope_sim::io::FileGroup;

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Group to measure; the default is all.
    #[arg(long, value_enum)]
    group: Option<Group>,
    /// Folder to write to.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Few and coarse settings: a minute instead of many.
    #[arg(long)]
    quick: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Group {
    Optics,
    Les,
    Signal,
    Estimate,
    /// The whole chain.
    Chain,
}

impl Group {
    pub(crate) const ALL: [Self; 5] = [Self::Optics, Self::Les, Self::Signal, Self::Estimate, Self::Chain];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Optics => "optics",
            Self::Les => "les",
            Self::Signal => "signal",
            Self::Estimate => "estimate",
            Self::Chain => "chain",
        }
    }

    /// What is measured of it.
    fn rows(self, quick: bool) -> Result<Vec<Row>, Failure> {
        match self {
            Self::Optics => optics::rows(quick),
            Self::Les => les::rows(quick),
            Self::Signal => signal::rows(quick),
            Self::Estimate => estimate::rows(quick),
            Self::Chain => chain::rows(quick),
        }
    }
}

/// One measurement.
pub(crate) struct Row {
    case: &'static str,
    method: String,
    knob: &'static str,
    value: f64,
    /// Relative; NaN where the setting fails.
    error: f64,
    /// Zero where the error is exact.
    standard_error: f64,
    metric: &'static str,
    reference: &'static str,
    cost: Cost,
}

impl Row {
    /// A setting (knob, value) with its error and that one's standard error; words are metric and reference.
    fn new(
        case: &'static str,
        method: &str,
        (knob, value): (&'static str, f64),
        (error, standard_error): (f64, f64),
        [metric, reference]: [&'static str; 2],
        cost: Cost,
    ) -> Self {
        Self { case, method: method.into(), knob, value, error, standard_error, metric, reference, cost }
    }

    fn measured(&self) -> Measured {
        Measured { core_s: self.cost.cpu_s, error: self.error, standard_error: self.standard_error }
    }
}

/// The first two of the values if `quick`.
fn few<T>(values: &[T], quick: bool) -> &[T] {
    if quick { &values[..values.len().min(2)] } else { values }
}

/// Mean and its standard error.
fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// The rows of some groups, on one thread.
pub(crate) fn measure(groups: &[Group], quick: bool) -> Result<Vec<(Group, Vec<Row>)>, Failure> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    groups.iter().map(|group| Ok((*group, pool.install(|| group.rows(quick))?))).collect()
}

/// Measures, prints and writes.
///
/// # Errors
/// What a crate refuses, or an unusable output.
pub(crate) fn run(options: &Options) -> Outcome {
    let groups = options.group.map_or(Group::ALL.to_vec(), |group| vec![group]);
    let measured = measure(&groups, options.quick)?;
    let machine = machine();
    let parameters = format!("machine = {machine:?}\nthreads = 1\nquick = {}\n", options.quick);
    let origin = provenance(&parameters, optics::SEED);
    let folder = options.out.clone().unwrap_or_else(|| root().join("target/work-precision"));
    let mut files = FileGroup::new(&folder);
    for (group, rows) in &measured {
        show::print(*group, rows);
        let one = [(*group, rows.as_slice())];
        files.add(&format!("{}.csv", group.name()), show::table(&one).to_csv(&origin)?)?;
        files.add(&format!("{}.svg", group.name()), show::panels(rows).svg(&origin)?)?;
    }
    let all: Vec<(Group, &[Row])> = measured.iter().map(|(group, rows)| (*group, rows.as_slice())).collect();
    files.add("work_precision.csv", show::table(&all).to_csv(&origin)?)?;
    files.add("work_precision.svg", show::fronts(&all).svg(&origin)?)?;
    files.add("cheapest.csv", show::cheapest_table(&all).to_csv(&origin)?)?;
    files.commit()?;
    println!("wrote {}", folder.join("work_precision.csv").display());
    Ok(())
}
