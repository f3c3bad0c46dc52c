//! `cargo xtask work-precision`: error against run time of solvers, estimators and the whole chain, beside other programs.
//!
//! Every row of this program is measured in this run, on one thread; the time is the smallest of
//! three runs, of one beyond 0.2 s, and the set-up is separate. Errors are relative, with their
//! standard errors; a setting that fails is a row. Other programs come from `docs/peers`.

mod cases;
mod chain;
pub(crate) mod estimate;
mod front;
mod peers;
mod physics;
mod report;

use crate::cost::{Cost, machine};
use crate::figures::context::{Rendered, column};
use crate::profile::Profile;
use crate::workspace::{provenance, root};
use cases::{CASES, Case};
use fixtures::failure::{Failure, Outcome};
use front::{cheapest, on_front};
pub(crate) use report::{picture, text};
use std::path::PathBuf;
use wakescope_sim::io::{Provenance, Table};

/// What is measured: the groups and the rows of each, few and coarse ones unless the profile is full.
type Rows = fn(Profile) -> Result<Vec<Row>, Failure>;
pub(crate) const GROUPS: [(&str, Rows); 5] = [
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

/// Error and costs of a setting.
struct Found {
    /// Relative; NaN where the setting fails.
    error: f64,
    /// Zero where the error is exact.
    standard_error: f64,
    /// Without the set-up.
    cost: Cost,
    /// Processor time of what is done once, whatever the setting \[s\]; zero where it is not separate.
    set_up_s: f64,
}

impl Found {
    /// An exact error, the set-up not separate from the rest of the time.
    fn exact(error: f64, cost: Cost) -> Self {
        Self {
            error,
            standard_error: 0.0,
            cost,
            set_up_s: 0.0,
        }
    }
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

impl Row {
    /// A row of this program: case, method and knob, the value of the knob, and what was found.
    fn new([case, method, knob]: [&str; 3], value: f64, found: Found) -> Self {
        Self {
            case: case.into(),
            method: method.into(),
            knob: knob.into(),
            value,
            found,
            version: String::new(),
            group: "",
            is_on_front: false,
            is_cheapest: [false; TARGETS.len()],
        }
    }

    fn is_own(&self) -> bool {
        self.version.is_empty()
    }

    /// What the error is.
    fn metric(&self) -> &'static str {
        self.listed_case().map_or("", |case| &case.metric)
    }

    /// What the error is against.
    fn reference(&self) -> &'static str {
        self.listed_case().map_or("", |case| &case.reference)
    }

    fn listed_case(&self) -> Option<&'static Case> {
        CASES.iter().find(|case| case.name == self.case)
    }
}

/// A row for each value of a knob of a method in a case.
fn settings(
    names: [&str; 3],
    values: &[f64],
    measure: impl Fn(f64) -> Result<Found, Failure>,
) -> Result<Vec<Row>, Failure> {
    let mut rows = Vec::new();
    for &value in values {
        rows.push(Row::new(names, value, measure(value)?));
    }
    Ok(rows)
}

/// All values with the profile full, else the first three.
fn few<T>(values: &[T], profile: Profile) -> &[T] {
    if profile != Profile::Full {
        &values[..values.len().min(3)]
    } else {
        values
    }
}

/// The rows of a group or of all, on one thread, with those of other programs, case by case.
pub(crate) fn measure(wanted: Option<&str>, profile: Profile) -> Result<Vec<Row>, Failure> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut others = peers::rows()?;
    let mut all = Vec::new();
    for (name, measure) in GROUPS {
        if wanted.is_some_and(|wanted| wanted != name) {
            continue;
        }
        let mut rows = pool.install(|| measure(profile))?;
        let cases: Vec<String> = rows.iter().map(|row| row.case.clone()).collect();
        rows.extend(others.extract_if(.., |row| cases.contains(&row.case)));
        // In the order in which they were measured, those of other programs after this program's.
        rows.sort_by_key(|row| {
            let position = cases.iter().position(|case| *case == row.case);
            (position, !row.is_own())
        });
        for rows_of_case in rows.chunk_by_mut(|a, b| a.case == b.case) {
            let own = rows_of_case.iter().filter(|row| row.is_own()).count();
            judge(&mut rows_of_case[..own]);
        }
        for row in &mut rows {
            row.group = name;
        }
        all.extend(rows);
    }
    Ok(all)
}

/// Marks which settings of a case are on the front and which are the cheapest for each target.
fn judge(rows: &mut [Row]) {
    let found: Vec<&Found> = rows.iter().map(|row| &row.found).collect();
    let is_on_front = on_front(&found);
    let best = TARGETS.map(|(_, target)| cheapest(&found, target));
    for (index, row) in rows.iter_mut().enumerate() {
        row.is_on_front = is_on_front[index];
        row.is_cheapest = best.map(|best| best == Some(index));
    }
}

/// One row a setting.
pub(crate) fn table(rows: &[Row]) -> Table {
    let mut table = Table::new()
        .text("case", column(rows, |r| &r.case))
        .text("method", column(rows, |r| &r.method))
        .text("knob", column(rows, |r| &r.knob))
        .float("value", column(rows, |r| r.value))
        .float("error", column(rows, |r| r.found.error))
        .text("metric", column(rows, Row::metric))
        .text("reference", column(rows, Row::reference))
        .float("cpu_s", column(rows, |r| r.found.cost.cpu_s))
        .float("wall_s", column(rows, |r| r.found.cost.wall_s))
        .int("threads", column(rows, |_| 1))
        .float(
            "peak_mem_bytes",
            column(rows, |r| r.found.cost.peak_mem_bytes),
        )
        .float("standard_error", column(rows, |r| r.found.standard_error))
        .float("set_up_s", column(rows, |r| r.found.set_up_s))
        .text("other_version", column(rows, |r| &r.version))
        .text("group", column(rows, |r| r.group))
        .int("is_on_front", column(rows, |r| r.is_on_front.into()));
    for (index, (name, _)) in TARGETS.iter().enumerate() {
        let cheapest = rows.iter().map(|r| r.is_cheapest[index].into());
        table = table.int(name, cheapest);
    }
    table
}

pub(crate) fn provenance_of_run(quick: bool) -> Provenance {
    let parameters = format!("machine = {:?}\nthreads = 1\nquick = {quick}\n", machine());
    provenance(&parameters, physics::SEED)
}

fn print(rows: &[Row]) {
    println!(
        "{:<28} {:<34} {:<24} {:>8} {:>22} {:>10}",
        "case", "method", "knob", "value", "error", "cpu"
    );
    for row in rows {
        let found = &row.found;
        let method = format!("{} {}", row.method, row.version);
        let error = format!("{:.2e} +- {:.1e}", found.error, found.standard_error);
        let cost = format!("{:.1e} s", found.cost.cpu_s);
        println!(
            "{:<28} {method:<34} {:<24} {:>8} {error:>22} {cost:>10} {}, {}",
            row.case,
            row.knob,
            row.value,
            row.metric(),
            row.reference()
        );
    }
}

/// Measures a group or all, prints and writes.
///
/// # Errors
/// Fails if a crate refuses a setting or the output cannot be written.
pub(crate) fn run(group: Option<&str>, out: Option<PathBuf>, quick: bool) -> Outcome {
    let profile = if quick { Profile::Quick } else { Profile::Full };
    let rows = measure(group, profile)?;
    print(&rows);
    let origin = provenance_of_run(quick);
    let folder = out.unwrap_or_else(|| root().join("target/work-precision"));
    Rendered::new(&table(&rows), &picture(&rows), &origin)?
        .files_in(&folder, "work_precision")?
        .commit()?;
    let file = folder.join("work_precision.csv");
    println!("{}\nwrote {}", text(&rows), file.display());
    Ok(())
}

/// Prints the processor time of the kernel by which times of other machines are scaled.
///
/// # Errors
/// Fails if the solver refuses the kernel's case.
pub(crate) fn print_kernel() -> Outcome {
    println!("{:.6}", physics::kernel_s()?);
    Ok(())
}
