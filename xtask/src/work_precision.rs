//! `cargo xtask work-precision --crate les|optics|signal|estimate`: error against run time, knob by knob.
//!
//! Every row is measured in this run, on one thread; the table and the picture go to
//! `target/work-precision`. Errors are against exact theory, or are standard errors where the case says so.

mod estimate;
mod les;
mod optics;
mod signal;

use crate::Outcome;
use crate::cost::Cost;
use crate::workspace::{provenance, root};
use std::path::PathBuf;
use wakescope_sim::io::{FileGroup, Table};
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Crate to measure.
    #[arg(long = "crate", value_enum)]
    name: Measured,
    /// Folder to write to.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Multiplies sample counts; 1 takes a few minutes.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    effort: u32,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Measured {
    Les,
    Optics,
    Signal,
    Estimate,
}

/// One measurement.
pub(crate) struct Row {
    pub(crate) case: &'static str,
    pub(crate) method: String,
    pub(crate) knob: &'static str,
    pub(crate) value: f64,
    pub(crate) error: f64,
    pub(crate) metric: &'static str,
    pub(crate) reference: &'static str,
    pub(crate) cost: Cost,
}

/// Measures, prints and writes.
///
/// # Errors
/// What the crate refuses, or an unusable output.
pub(crate) fn run(options: &Options) -> Outcome {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let rows = match options.name {
        Measured::Les => pool.install(|| les::rows(options.effort as usize))?,
        Measured::Optics => pool.install(|| optics::rows(options.effort as usize))?,
        Measured::Signal => pool.install(|| signal::rows(options.effort as usize))?,
        Measured::Estimate => pool.install(|| estimate::rows(options.effort as usize))?,
    };
    println!(
        "{:<22} {:<34} {:<14} {:>10} {:>11} {:>10} metric, reference",
        "case", "method", "knob", "value", "error", "cpu"
    );
    for r in &rows {
        println!(
            "{:<22} {:<34} {:<14} {:>10} {:>11.3e} {:>8.1e} s {}, {}",
            r.case, r.method, r.knob, r.value, r.error, r.cost.cpu_s, r.metric, r.reference
        );
    }
    let name = match options.name {
        Measured::Les => "les",
        Measured::Optics => "optics",
        Measured::Signal => "signal",
        Measured::Estimate => "estimate",
    };
    let parameters = format!("crate = \"{name}\"\neffort = {}\n", options.effort);
    let origin = provenance(&parameters, optics::SEED);
    let folder = options.out.clone().unwrap_or_else(|| root().join("target/work-precision"));
    let mut files = FileGroup::new(&folder);
    files.add(&format!("{name}.csv"), table(&rows).to_csv(&origin)?)?;
    files.add(&format!("{name}.svg"), figure(&rows).svg(&origin)?)?;
    files.commit()?;
    println!("wrote {}", folder.join(format!("{name}.csv")).display());
    Ok(())
}

fn table(rows: &[Row]) -> Table {
    Table::new()
        .text("case", rows.iter().map(|r| r.case))
        .text("method", rows.iter().map(|r| r.method.clone()))
        .text("knob", rows.iter().map(|r| r.knob))
        .float("value", rows.iter().map(|r| r.value))
        .float("error", rows.iter().map(|r| r.error))
        .text("metric", rows.iter().map(|r| r.metric))
        .text("reference", rows.iter().map(|r| r.reference))
        .float("cpu_s", rows.iter().map(|r| r.cost.cpu_s))
        .float("wall_s", rows.iter().map(|r| r.cost.wall_s))
        .int("threads", rows.iter().map(|_| 1))
        .float("peak_mem_bytes", rows.iter().map(|r| r.cost.peak_mem_bytes))
}

/// Error against processor time, a panel for each case.
fn figure(rows: &[Row]) -> Figure {
    let mut panels: Vec<CurvePlot> = Vec::new();
    let mut cases: Vec<&str> = rows.iter().map(|r| r.case).collect();
    cases.dedup();
    for case in cases {
        let mut plot = CurvePlot::new(case, Axis::log("processor time [s]"), Axis::log("error"));
        let mut methods: Vec<&String> = rows.iter().filter(|r| r.case == case).map(|r| &r.method).collect();
        methods.dedup();
        for method in methods {
            let of = |r: &&Row| r.case == case && r.method == *method && r.error > 0.0 && r.cost.cpu_s > 0.0;
            let points: Vec<(f64, f64)> = rows.iter().filter(of).map(|r| (r.cost.cpu_s, r.error)).collect();
            if !points.is_empty() {
                plot = plot.with(Series::new(method, Style::LineMarkers, points));
            }
        }
        if !plot.series.is_empty() {
            panels.push(plot);
        }
    }
    Figure::stacked(panels)
}
