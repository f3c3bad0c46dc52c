//! `cargo xtask work-precision`: error against run time of solvers, estimators and the whole chain, beside other programs.
//!
//! Every row of this program is measured in this run, on one thread; the time is the smallest of three runs, of one beyond 0.2 s, and the set-up stands
//! apart. Errors are relative, with their standard errors; a setting that fails is a row. Other programs come from `docs/peers`.

mod cases;
mod chain;
pub(crate) mod estimate;
mod front;
mod peers;
mod physics;
mod report;

use crate::cost::{Cost, machine};
use crate::figures::context::Rendered;
use crate::workspace::{provenance, root};
use cases::CASES;
use fixtures::failure::{Failure, Outcome};
use front::{cheapest, on_front};
pub(crate) use report::{picture, text};
use std::path::PathBuf;
use wakescope_sim::io::{Table, write_atomic};

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
    /// Store the page's text, table and picture in the book.
    #[arg(long, conflicts_with_all = ["group", "quick"])]
    store: bool,
    /// Print only the processor time of the kernel by which times of other machines are scaled.
    #[arg(long)]
    kernel: bool,
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
const TARGETS: [(&str, f64); 3] = [
    ("is_cheapest_for_0.1", 0.10),
    ("is_cheapest_for_0.03", 0.03),
    ("is_cheapest_for_0.01", 0.01),
];

/// What a setting came to.
struct Found {
    /// Relative; NaN where the setting fails.
    error: f64,
    /// Zero where the error is exact.
    standard_error: f64,
    /// Without the set-up.
    cost: Cost,
    /// Processor time of what is done once, whatever the setting \[s\]; zero where it is not told apart.
    set_up_s: f64,
}

/// One measurement.
pub(crate) struct Row {
    case: String,
    method: String,
    knob: String,
    value: f64,
    found: Found,
    /// Of another program; empty for this one.
    version: String,
    group: &'static str,
    is_on_front: bool,
    /// For each of the [`TARGETS`].
    is_cheapest: [bool; TARGETS.len()],
}

impl Found {
    /// An exact error, all of whose time is told together.
    fn exact(error: f64, cost: Cost) -> Self {
        Self {
            error,
            standard_error: 0.0,
            cost,
            set_up_s: 0.0,
        }
    }
}

/// A row for each value of a knob of a method in a case.
fn settings(
    of: [&str; 3],
    values: &[f64],
    measure: impl Fn(f64) -> Result<Found, Failure>,
) -> Result<Vec<Row>, Failure> {
    values
        .iter()
        .map(|value| Ok(Row::new(of, *value, measure(*value)?)))
        .collect()
}

impl Row {
    /// Of a case, a method and a knob.
    fn new(of: [&str; 3], value: f64, found: Found) -> Self {
        let ([case, method, knob], version) = (of.map(String::from), String::new());
        Self {
            case,
            method,
            knob,
            value,
            found,
            version,
            group: "",
            is_on_front: false,
            is_cheapest: [false; 3],
        }
    }

    fn is_own(&self) -> bool {
        self.version.is_empty()
    }

    /// What the error is, and against what.
    fn compared(&self) -> [&'static str; 2] {
        let case = CASES.iter().find(|case| case.name == self.case);
        case.map_or([""; 2], |case| [&case.metric, &case.reference])
    }
}

/// The first three of the values if `quick`.
fn few<T>(values: &[T], quick: bool) -> &[T] {
    if quick {
        &values[..values.len().min(3)]
    } else {
        values
    }
}

/// The rows of a group or of all, on one thread, with those of other programs; each case at a stretch, this program's judged among their own.
pub(crate) fn measure(wanted: Option<&str>, quick: bool) -> Result<Vec<Row>, Failure> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut others = peers::rows()?;
    let mut all = Vec::new();
    for (name, rows) in GROUPS
        .into_iter()
        .filter(|group| wanted.is_none_or(|wanted| wanted == group.0))
    {
        let mut rows = pool.install(|| rows(quick))?;
        let cases: Vec<String> = rows.iter().map(|row| row.case.clone()).collect();
        rows.extend(others.extract_if(.., |row| cases.contains(&row.case)));
        // In the order in which they were measured, those of other programs after this program's.
        rows.sort_by_key(|row| {
            (
                cases.iter().position(|case| *case == row.case),
                !row.is_own(),
            )
        });
        for of_case in rows.chunk_by_mut(|a, b| a.case == b.case) {
            let own = of_case.iter().filter(|row| row.is_own()).count();
            let own = &mut of_case[..own];
            let found: Vec<&Found> = own.iter().map(|row| &row.found).collect();
            let (front, best) = (
                on_front(&found),
                TARGETS.map(|(_, target)| cheapest(&found, target)),
            );
            for (place, row) in own.iter_mut().enumerate() {
                (row.is_on_front, row.is_cheapest) =
                    (front[place], best.map(|best| best == Some(place)));
            }
        }
        rows.iter_mut().for_each(|row| row.group = name);
        all.extend(rows);
    }
    Ok(all)
}

/// One row a setting.
pub(crate) fn table(rows: &[Row]) -> Table {
    let text = |get: fn(&Row) -> &str| rows.iter().map(get);
    let float = |get: fn(&Row) -> f64| rows.iter().map(get);
    let table = Table::new()
        .text("case", text(|r| &r.case))
        .text("method", text(|r| &r.method))
        .text("knob", text(|r| &r.knob))
        .float("value", float(|r| r.value))
        .float("error", float(|r| r.found.error))
        .text("metric", text(|r| r.compared()[0]))
        .text("reference", text(|r| r.compared()[1]))
        .float("cpu_s", float(|r| r.found.cost.cpu_s))
        .float("wall_s", float(|r| r.found.cost.wall_s))
        .int("threads", rows.iter().map(|_| 1))
        .float("peak_mem_bytes", float(|r| r.found.cost.peak_mem_bytes))
        .float("standard_error", float(|r| r.found.standard_error))
        .float("set_up_s", float(|r| r.found.set_up_s))
        .text("other_version", text(|r| &r.version))
        .text("group", text(|r| r.group))
        .int("is_on_front", rows.iter().map(|r| r.is_on_front.into()));
    let targets = TARGETS.iter().enumerate();
    targets.fold(table, |table, (k, target)| {
        table.int(target.0, rows.iter().map(|r| r.is_cheapest[k].into()))
    })
}

/// Measures, prints and writes.
///
/// # Errors
/// What a crate refuses, or an unusable output.
pub(crate) fn run(options: &Options) -> Outcome {
    if options.kernel {
        println!("{:.6}", physics::kernel_s()?);
        return Ok(());
    }
    let rows = measure(options.group.as_deref(), options.quick)?;
    println!(
        "{:<28} {:<34} {:<24} {:>8} {:>22} {:>10}",
        "case", "method", "knob", "value", "error", "cpu"
    );
    for row in &rows {
        let Row {
            case,
            method,
            knob,
            value,
            found,
            version,
            ..
        } = row;
        let Found {
            error,
            standard_error,
            cost,
            ..
        } = found;
        let [metric, reference] = row.compared();
        let (error, cost) = (
            format!("{error:.2e} +- {standard_error:.1e}"),
            format!("{:.1e} s", cost.cpu_s),
        );
        let method = format!("{method} {version}");
        println!(
            "{case:<28} {method:<34} {knob:<24} {value:>8} {error:>22} {cost:>10} {metric}, {reference}"
        );
    }
    let parameters = format!(
        "machine = {:?}\nthreads = 1\nquick = {}\n",
        machine(),
        options.quick
    );
    let origin = provenance(&parameters, physics::SEED);
    let folder = options
        .out
        .clone()
        .unwrap_or_else(|| root().join("target/work-precision"));
    Rendered::new(&table(&rows), &picture(&rows), &origin)?
        .files_in(&folder, "work_precision")?
        .commit()?;
    println!(
        "{}\nwrote {}",
        text(&rows),
        folder.join("work_precision.csv").display()
    );
    if options.store {
        let book = root().join("docs/src");
        write_atomic(
            &book.join("work-precision-results.md"),
            text(&rows).as_bytes(),
        )?;
        write_atomic(
            &book.join("images/work_precision.svg"),
            picture(&rows).svg(&origin)?.as_bytes(),
        )?;
        write_atomic(
            &book.join("images/work_precision.csv"),
            table(&rows).to_csv(&origin)?.into_bytes(),
        )?;
        println!(
            "stored the page's text, picture and table in {}",
            book.display()
        );
    }
    Ok(())
}
