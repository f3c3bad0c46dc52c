//! What was measured, as tables and pictures: all settings, the fronts of error and time, the cheapest for an error.

use super::front::{Measured, cheapest, on_front};
use super::{Group, Row};
use wakescope_sim::io::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

/// Relative errors for which the cheapest settings are sought.
const TARGETS: [f64; 3] = [0.10, 0.03, 0.01];

type Groups<'a> = [(Group, &'a [Row])];

pub(super) fn print(group: Group, rows: &[Row]) {
    println!(
        "{}: {:<22} {:<34} {:<34} {:>8} {:>22} {:>10} metric, reference",
        group.name(),
        "case",
        "method",
        "knob",
        "value",
        "error",
        "cpu"
    );
    for r in rows {
        println!(
            "{:<28} {:<34} {:<34} {:>8} {:>10.2e} +- {:<8.1e} {:>8.1e} s {}, {}",
            r.case, r.method, r.knob, r.value, r.error, r.standard_error, r.cost.cpu_s, r.metric, r.reference
        );
    }
}

/// One row a setting.
pub(crate) fn table(groups: &Groups<'_>) -> Table {
    let rows: Vec<(&'static str, &Row)> =
        groups.iter().flat_map(|(group, rows)| rows.iter().map(move |row| (group.name(), row))).collect();
    let float = |get: fn(&Row) -> f64| rows.iter().map(|r| get(r.1)).collect::<Vec<_>>();
    Table::new()
        .text("case", rows.iter().map(|r| r.1.case))
        .text("method", rows.iter().map(|r| r.1.method.clone()))
        .text("knob", rows.iter().map(|r| r.1.knob))
        .float("value", float(|r| r.value))
        .float("error", float(|r| r.error))
        .text("metric", rows.iter().map(|r| r.1.metric))
        .text("reference", rows.iter().map(|r| r.1.reference))
        .float("cpu_s", float(|r| r.cost.cpu_s))
        .float("wall_s", float(|r| r.cost.wall_s))
        .int("threads", rows.iter().map(|_| 1))
        .float("peak_mem_bytes", float(|r| r.cost.peak_mem_bytes))
        .float("standard_error", float(|r| r.standard_error))
        .text("group", rows.iter().map(|r| r.0))
}

/// Cases of a group in their order.
fn cases(rows: &[Row]) -> Vec<&'static str> {
    let mut cases: Vec<&str> = Vec::new();
    for row in rows {
        if !cases.contains(&row.case) {
            cases.push(row.case);
        }
    }
    cases
}

/// The cheapest setting of each case for each target.
struct Cheapest<'a> {
    group: Group,
    case: &'static str,
    target: f64,
    found: Option<&'a Row>,
}

fn all_cheapest<'a>(groups: &Groups<'a>) -> Vec<Cheapest<'a>> {
    let mut out = Vec::new();
    for &(group, rows) in groups {
        for case in cases(rows) {
            let here: Vec<&Row> = rows.iter().filter(|r| r.case == case).collect();
            let measured: Vec<Measured> = here.iter().map(|r| r.measured()).collect();
            for target in TARGETS {
                out.push(Cheapest { group, case, target, found: cheapest(&measured, target).map(|i| here[i]) });
            }
        }
    }
    out
}

/// The cheapest settings as a table; "none" where no setting reaches the target.
pub(super) fn cheapest_table(groups: &Groups<'_>) -> Table {
    let all = all_cheapest(groups);
    let float = |get: fn(&Row) -> f64| all.iter().map(|c| c.found.map_or(f64::NAN, get)).collect::<Vec<_>>();
    Table::new()
        .text("group", all.iter().map(|c| c.group.name()))
        .text("case", all.iter().map(|c| c.case))
        .float("target", all.iter().map(|c| c.target))
        .text("method", all.iter().map(|c| c.found.map_or("none".into(), |r| r.method.clone())))
        .text("knob", all.iter().map(|c| c.found.map_or("", |r| r.knob)))
        .float("value", float(|r| r.value))
        .float("error", float(|r| r.error))
        .float("standard_error", float(|r| r.standard_error))
        .float("core_s", float(|r| r.cost.cpu_s))
}

/// Points of error and time that a logarithmic plot can show.
fn points<'a>(rows: impl Iterator<Item = &'a Row>) -> Vec<(f64, f64)> {
    rows.filter(|r| r.error > 0.0 && r.cost.cpu_s > 0.0).map(|r| (r.cost.cpu_s, r.error)).collect()
}

/// Error against processor time, a panel for each case, a curve for each method.
pub(super) fn panels(rows: &[Row]) -> Figure {
    let mut panels: Vec<CurvePlot> = Vec::new();
    for case in cases(rows) {
        let mut plot = CurvePlot::new(case, Axis::log("processor time [s]"), Axis::log("relative error"));
        let mut methods: Vec<&String> = rows.iter().filter(|r| r.case == case).map(|r| &r.method).collect();
        methods.dedup();
        for method in methods {
            let points = points(rows.iter().filter(|r| r.case == case && r.method == *method));
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

/// A panel for each group, in it the front of each case: what no other setting beats in error and in time.
pub(crate) fn fronts(groups: &Groups<'_>) -> Figure {
    let panel = |&(group, rows): &(Group, &[Row])| {
        let mut plot = CurvePlot::new(group.name(), Axis::log("processor time [s]"), Axis::log("relative error"));
        for case in cases(rows) {
            let here: Vec<&Row> = rows.iter().filter(|r| r.case == case).collect();
            let front = on_front(&here.iter().map(|r| r.measured()).collect::<Vec<_>>());
            let mut points = points(here.iter().zip(front).filter(|(_, is_on)| *is_on).map(|(r, _)| *r));
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            if !points.is_empty() {
                plot = plot.with(Series::new(case, Style::LineMarkers, points));
            }
        }
        plot
    };
    Figure::stacked(groups.iter().map(panel))
}
