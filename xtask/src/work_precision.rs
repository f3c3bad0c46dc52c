//! `cargo xtask work-precision`: error against run time of solvers, estimators and the whole chain, knob by knob.
//!
//! Every row is measured in this run, on one thread; the time is the smallest of three runs, of one beyond 0.2 s. Errors are relative, with their standard
//! errors; a setting that fails is a row.

mod chain;
mod estimate;
mod front;
mod physics;

use crate::cost::{Cost, machine};
use crate::workspace::{provenance, root};
use fixtures::failure::{Failure, Outcome};
use front::{Measured, cheapest, on_front};
use std::path::PathBuf;
use wakescope_sim::io::{FileGroup, Table};
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

/// Options of the task.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Group to measure; the default is all.
    #[arg(long, value_parser = GROUPS.map(|group| group.0))]
    group: Option<String>,
    /// Folder to write to.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Few and coarse settings: a minute instead of many.
    #[arg(long)]
    quick: bool,
}

/// What is measured: the groups and the rows of each, few and coarse ones if asked.
type Rows = fn(bool) -> Result<Vec<Row>, Failure>;
const GROUPS: [(&str, Rows); 5] = [
    ("optics", physics::optics),
    ("les", physics::les),
    ("signal", physics::signal),
    ("estimate", estimate::rows),
    ("chain", chain::rows),
];

/// Relative errors for which the cheapest settings are sought.
const TARGETS: [(&str, f64); 3] =
    [("is_cheapest_for_0.1", 0.10), ("is_cheapest_for_0.03", 0.03), ("is_cheapest_for_0.01", 0.01)];

/// What the settings of a knob have in common.
#[derive(Clone, Copy)]
struct Knob {
    case: &'static str,
    method: &'static str,
    knob: &'static str,
    metric: &'static str,
    reference: &'static str,
}

/// One measurement.
pub(crate) struct Row {
    knob: Knob,
    value: f64,
    /// Relative; NaN where the setting fails.
    error: f64,
    /// Zero where the error is exact.
    standard_error: f64,
    cost: Cost,
    group: &'static str,
    is_on_front: bool,
    /// For each of the [`TARGETS`].
    is_cheapest: [bool; TARGETS.len()],
}

impl Knob {
    fn new([case, method, knob, metric, reference]: [&'static str; 5]) -> Self {
        Self { case, method, knob, metric, reference }
    }

    fn row(self, value: f64, (error, standard_error): (f64, f64), cost: Cost) -> Row {
        Row { knob: self, value, error, standard_error, cost, group: "", is_on_front: false, is_cheapest: [false; 3] }
    }

    /// A row for each value, the first two alone if `quick`, from the error, its standard error and the cost there.
    fn rows(
        self,
        quick: bool,
        values: &[f64],
        measure: impl Fn(f64) -> Result<((f64, f64), Cost), Failure>,
    ) -> Result<Vec<Row>, Failure> {
        let one = |value: &f64| measure(*value).map(|(error, cost)| self.row(*value, error, cost));
        few(values, quick).iter().map(one).collect()
    }
}

/// The first two of the values if `quick`.
fn few<T>(values: &[T], quick: bool) -> &[T] {
    if quick { &values[..values.len().min(2)] } else { values }
}

/// The rows of a group or of all, on one thread; each case at a stretch, judged among its own.
pub(crate) fn measure(wanted: Option<&str>, quick: bool) -> Result<Vec<Row>, Failure> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut all = Vec::new();
    for (name, rows) in GROUPS.into_iter().filter(|group| wanted.is_none_or(|wanted| wanted == group.0)) {
        let mut rows = pool.install(|| rows(quick))?;
        rows.sort_by_key(|row| row.knob.case);
        for of_case in rows.chunk_by_mut(|a, b| a.knob.case == b.knob.case) {
            let of = |r: &Row| Measured { core_s: r.cost.cpu_s, error: r.error, standard_error: r.standard_error };
            let measured: Vec<Measured> = of_case.iter().map(of).collect();
            of_case.iter_mut().zip(on_front(&measured)).for_each(|(row, is_on)| row.is_on_front = is_on);
            for (place, (_, target)) in TARGETS.into_iter().enumerate() {
                cheapest(&measured, target).into_iter().for_each(|best| of_case[best].is_cheapest[place] = true);
            }
        }
        rows.iter_mut().for_each(|row| row.group = name);
        all.extend(rows);
    }
    Ok(all)
}

/// One row a setting.
pub(crate) fn table(rows: &[Row]) -> Table {
    let text = |get: fn(&Knob) -> &'static str| rows.iter().map(move |r| get(&r.knob));
    let float = |get: fn(&Row) -> f64| rows.iter().map(get);
    let table = Table::new()
        .text("case", text(|k| k.case))
        .text("method", text(|k| k.method))
        .text("knob", text(|k| k.knob))
        .float("value", float(|r| r.value))
        .float("error", float(|r| r.error))
        .text("metric", text(|k| k.metric))
        .text("reference", text(|k| k.reference))
        .float("cpu_s", float(|r| r.cost.cpu_s))
        .float("wall_s", float(|r| r.cost.wall_s))
        .int("threads", rows.iter().map(|_| 1))
        .float("peak_mem_bytes", float(|r| r.cost.peak_mem_bytes))
        .float("standard_error", float(|r| r.standard_error))
        .text("group", rows.iter().map(|r| r.group))
        .int("is_on_front", rows.iter().map(|r| r.is_on_front.into()));
    let targets = TARGETS.iter().enumerate();
    targets.fold(table, |table, (k, target)| table.int(target.0, rows.iter().map(|r| r.is_cheapest[k].into())))
}

/// A panel for each group, in it the front of each case: what no other setting beats in error and in time.
pub(crate) fn picture(rows: &[Row]) -> Figure {
    let panel = |of_group: &[Row]| {
        let axes = (Axis::log("processor time [s]"), Axis::log("relative error"));
        let mut plot = CurvePlot::new(of_group[0].group, axes.0, axes.1);
        for of_case in of_group.chunk_by(|a, b| a.knob.case == b.knob.case) {
            let shown = of_case.iter().filter(|r| r.is_on_front && r.error > 0.0 && r.cost.cpu_s > 0.0);
            let mut points: Vec<(f64, f64)> = shown.map(|r| (r.cost.cpu_s, r.error)).collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            if !points.is_empty() {
                plot = plot.with(Series::new(of_case[0].knob.case, Style::LineMarkers, points));
            }
        }
        plot
    };
    Figure::stacked(rows.chunk_by(|a, b| a.group == b.group).map(panel))
}

/// Measures, prints and writes.
///
/// # Errors
/// What a crate refuses, or an unusable output.
pub(crate) fn run(options: &Options) -> Outcome {
    let rows = measure(options.group.as_deref(), options.quick)?;
    println!("{:<28} {:<34} {:<34} {:>8} {:>22} {:>10}", "case", "method", "knob", "value", "error", "cpu");
    for Row { knob, value, error, standard_error, cost, .. } in &rows {
        let Knob { case, method, knob, metric, reference } = knob;
        let (error, cost) = (format!("{error:.2e} +- {standard_error:.1e}"), format!("{:.1e} s", cost.cpu_s));
        println!("{case:<28} {method:<34} {knob:<34} {value:>8} {error:>22} {cost:>10} {metric}, {reference}");
    }
    let parameters = format!("machine = {:?}\nthreads = 1\nquick = {}\n", machine(), options.quick);
    let origin = provenance(&parameters, physics::SEED);
    let folder = options.out.clone().unwrap_or_else(|| root().join("target/work-precision"));
    let mut files = FileGroup::new(&folder);
    files.add("work_precision.csv", table(&rows).to_csv(&origin)?)?;
    files.add("work_precision.svg", picture(&rows).svg(&origin)?)?;
    files.commit()?;
    println!("wrote {}", folder.join("work_precision.csv").display());
    Ok(())
}
