//! The panels of error against run time, this program beside others, and what they say in words.

use super::cases::{CASES, Guide, Panel};
use super::{Row, TARGETS};
use crate::cost::machine;
use std::fmt::Write as _;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

/// Of more methods than these a panel shows the best settings.
const MOST_METHODS: usize = 4;

/// The panels of the cases that are drawn, the rows of each in the order of their times, and those that have no error, for the setting fails.
fn panels(rows: &[Row]) -> impl Iterator<Item = (&'static Panel, Vec<&Row>, Vec<&Row>)> {
    CASES.iter().filter_map(|case| {
        let of_case = rows.iter().filter(|row| row.case == case.name);
        let (failed, mut drawn): (Vec<&Row>, Vec<&Row>) =
            of_case.partition(|row| row.found.error.is_nan());
        drawn.retain(|row| row.found.error > 0.0 && row.found.cost.cpu_s > 0.0);
        drawn.sort_by(|a, b| a.found.cost.cpu_s.total_cmp(&b.found.cost.cpu_s));
        let panel = case.panel.as_ref().filter(|_| !drawn.is_empty())?;
        Some((panel, drawn, failed))
    })
}

/// The six panels: a curve for each method, one colour for each program.
pub(crate) fn picture(rows: &[Row]) -> Figure {
    let panels = panels(rows).map(|(panel, drawn, failed)| curves(panel, &drawn, &failed));
    Figure {
        columns: 2,
        width: 1300.0,
        ..Figure::stacked(panels)
    }
}

fn curves(panel: &Panel, rows: &[&Row], failed: &[&Row]) -> CurvePlot {
    let point = |row: &&Row| (row.found.cost.cpu_s, row.found.error);
    let (x_range, y_range) = (
        widened(&[rows, failed].concat(), |row| row.found.cost.cpu_s, 1.0),
        widened(rows, |row| row.found.error, 2.0),
    );
    let x = Axis {
        range: Some(x_range),
        ..Axis::log("processor time, one thread [s]")
    };
    let y = Axis {
        range: Some(y_range),
        ..Axis::log("relative error")
    };
    let mut plot = CurvePlot {
        shape: 0.78,
        ..CurvePlot::new(&panel.title, x, y)
    };
    let mut own: Vec<&str> = rows
        .iter()
        .filter(|row| row.is_own())
        .map(|row| row.method.as_str())
        .collect();
    own.sort_unstable();
    own.dedup();
    // Of many methods only the settings that no other beats are drawn.
    let name = |row: &Row| match row.is_own() {
        true if own.len() > MOST_METHODS => {
            if row.is_on_front {
                "wakescope, its best settings".into()
            } else {
                String::new()
            }
        }
        true => format!("wakescope, {}", row.method),
        false => row.method.clone(),
    };
    let mut methods: Vec<(bool, String)> =
        rows.iter().map(|row| (!row.is_own(), name(row))).collect();
    methods.sort_unstable();
    methods.dedup();
    methods.retain(|(_, name)| !name.is_empty());
    for (colour, (_, method)) in methods.iter().enumerate() {
        let of: Vec<&&Row> = rows.iter().filter(|row| name(row) == *method).collect();
        let points: Vec<(f64, f64)> = of.iter().map(|row| point(row)).collect();
        let style = if points.len() > 1 {
            Style::LineMarkers
        } else {
            Style::Markers
        };
        let errors: Vec<f64> = of
            .iter()
            .map(|row| row.found.standard_error.min(0.9 * row.found.error))
            .collect();
        plot = plot.with(Series::new(method, style, points.clone()).in_colour(colour));
        if errors.iter().any(|error| *error > 0.0) {
            plot = plot.with(
                Series::new("", Style::Markers, points)
                    .with_band(&errors)
                    .in_colour(colour),
            );
        }
    }
    if let (Some(Guide { label, power }), Some(first)) =
        (&panel.guide, rows.iter().find(|row| row.is_own()))
    {
        let (start_s, error) = point(first);
        let last_s = rows
            .iter()
            .filter(|row| row.is_own())
            .map(|row| row.found.cost.cpu_s)
            .fold(start_s, f64::max);
        let line = [start_s, last_s].map(|t| (t, 0.7 * error * (t / start_s).powf(*power)));
        plot = plot.with(Series::new(label, Style::Dash, line).in_colour(6));
    }
    if failed.is_empty() {
        return plot;
    }
    let edge = y_range.1 * (y_range.0 / y_range.1).powf(0.03);
    let points = failed.iter().map(|row| (row.found.cost.cpu_s, edge));
    plot.with(Series::new("fails (at the upper edge)", Style::Markers, points).in_colour(5))
}

/// A logarithmic range with an eighth to spare at both ends, of so many decades at least.
fn widened(rows: &[&Row], value: fn(&Row) -> f64, decades: f64) -> (f64, f64) {
    let logarithms = rows.iter().map(|row| value(row).log10());
    let (low, high) = logarithms.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
        (l.min(v), h.max(v))
    });
    let spare = (0.12 * (high - low))
        .max(0.5 * (decades - (high - low)))
        .max(0.1);
    (10_f64.powf(low - spare), 10_f64.powf(high + spare))
}

/// Under each panel: what is compared, what this program costs, what others cost at their errors.
pub(crate) fn text(rows: &[Row]) -> String {
    let mut out = format!("Measured on {}.\n\n", machine());
    for (panel, drawn, failed) in panels(rows) {
        let (own, others): (Vec<&Row>, Vec<&Row>) = drawn.into_iter().partition(|row| row.is_own());
        let _ = writeln!(out, "**{}.** {}\n", panel.title, panel.compared);
        let costs = TARGETS.iter().enumerate().map(|(place, (_, target))| {
            let best = own.iter().find(|row| row.is_cheapest[place]);
            let cost = best.map_or("by no setting".into(), |row| {
                format!("{} ({})", seconds(row.found.cost.cpu_s), setting(row))
            });
            format!("{} % {cost}", 100.0 * target)
        });
        let _ = writeln!(
            out,
            "This program reaches {}.\n",
            costs.collect::<Vec<_>>().join(", ")
        );
        let fails: Vec<String> = failed.into_iter().map(setting).collect();
        if !fails.is_empty() {
            let _ = writeln!(
                out,
                "No error, for the setting fails: {}.\n",
                fails.join("; ")
            );
        }
        if others.is_empty() {
            continue;
        }
        out.push_str("| other program | error | its time over this program's at that error |\n|---|---|---|\n");
        for row in &others {
            let ratio = ratio(&own, row)
                .map_or("this program has no setting so near".into(), |ratio| {
                    format!("{ratio:.2}")
                });
            let _ = writeln!(
                out,
                "| {} {} | {:.2e} | {ratio} |",
                row.method, row.version, row.found.error
            );
        }
        let better = others
            .iter()
            .filter(|row| ratio(&own, row).is_none_or(|ratio| ratio < 1.0));
        let better: Vec<String> = better
            .map(|row| format!("{} at {:.1e}", row.method, row.found.error))
            .collect();
        let better = if better.is_empty() {
            "none of them".into()
        } else {
            better.join(", ")
        };
        let _ = writeln!(out, "\nThe better buy: {better}.\n");
    }
    out
}

fn setting(row: &Row) -> String {
    format!("{}, {} {}", row.method, row.value, row.knob)
        .trim_end()
        .to_owned()
}

fn seconds(s: f64) -> String {
    match s {
        s if s < 1e-3 => format!("{:.0} µs", 1e6 * s),
        s if s < 1.0 => format!("{:.1} ms", 1e3 * s),
        s => format!("{s:.2} s"),
    }
}

/// Time of another program over this one's at the same error: on the line through the settings that no other beats, the setting of the same size
/// beyond its dearer errors, or the cheapest; none if no setting is so good.
fn ratio(own: &[&Row], other: &Row) -> Option<f64> {
    let front: Vec<&&Row> = own.iter().filter(|row| row.is_on_front).collect();
    let error = other.found.error;
    let better = front.iter().position(|row| row.found.error <= error)?;
    let same = own
        .iter()
        .filter(|row| row.value == other.value)
        .map(|row| row.found.cost.cpu_s);
    let own_s = if better == 0 {
        same.min_by(f64::total_cmp)
            .unwrap_or(front[0].found.cost.cpu_s)
    } else {
        let [a, b] = [front[better - 1], front[better]]
            .map(|row| (row.found.error.ln(), row.found.cost.cpu_s.ln()));
        (a.1 + (b.1 - a.1) * (error.ln() - a.0) / (b.0 - a.0)).exp()
    };
    Some(other.found.cost.cpu_s / own_s)
}

#[cfg(test)]
mod tests {
    use super::super::Found;
    use super::*;
    use crate::cost::Cost;

    fn rows(settings: &[(f64, f64, f64)]) -> Vec<Row> {
        let row = |&(value, error, cpu_s): &(f64, f64, f64)| {
            let mut row = Row::new(
                ["case", "method", "points"],
                value,
                Found::exact(
                    error,
                    Cost {
                        cpu_s,
                        wall_s: 0.0,
                        peak_mem_bytes: 0.0,
                    },
                ),
            );
            row.is_on_front = true;
            row
        };
        settings.iter().map(row).collect()
    }

    #[test]
    fn ratios_are_taken_at_equal_errors() {
        let mut own = rows(&[(16.0, 1e-1, 1.0), (32.0, 1e-3, 100.0), (64.0, 2e-1, 150.0)]);
        own[2].is_on_front = false;
        let own: Vec<&Row> = own.iter().collect();
        let others = rows(&[
            (1.0, 1e-2, 20.0),
            (64.0, 0.5, 450.0),
            (7.0, 0.5, 3.0),
            (1.0, 1e-4, 1.0),
        ]);
        let found: Vec<Option<f64>> = others.iter().map(|other| ratio(&own, other)).collect();
        assert!((found[0].unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(
            found[1..],
            [Some(3.0), Some(3.0), None],
            "the same size; the cheapest; nothing so good"
        );
    }
}
