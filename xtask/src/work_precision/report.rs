//! The panels of error against run time, this program beside others, and what they say in words.

use super::cases::{CASES, Panel};
use super::{Row, TARGETS};
use crate::cost::machine;
use std::collections::BTreeSet;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

/// Of more methods than these a panel shows the best settings.
const MOST_METHODS: usize = 4;

/// A panel with the rows of its case.
struct Drawn<'r> {
    panel: &'static Panel,
    /// In the order of their times.
    rows: Vec<&'r Row>,
    /// Rows without an error, since the setting fails.
    failed: Vec<&'r Row>,
}

/// The panels of the cases that are drawn.
fn panels(rows: &[Row]) -> Vec<Drawn<'_>> {
    let mut panels = Vec::new();
    for case in CASES.iter() {
        let mut drawn = Vec::new();
        let mut failed = Vec::new();
        for row in rows.iter().filter(|row| row.case == case.name) {
            if row.found.error.is_nan() {
                failed.push(row);
            } else if row.found.error > 0.0 && row.found.cost.cpu_s > 0.0 {
                drawn.push(row);
            }
        }
        drawn.sort_by(|a, b| a.found.cost.cpu_s.total_cmp(&b.found.cost.cpu_s));
        if let Some(panel) = case.panel.as_ref().filter(|_| !drawn.is_empty()) {
            panels.push(Drawn {
                panel,
                rows: drawn,
                failed,
            });
        }
    }
    panels
}

/// The six panels: a curve for each method, one colour for each program.
pub(crate) fn picture(rows: &[Row]) -> Figure {
    Figure {
        columns: 2,
        width: 1300.0,
        ..Figure::stacked(panels(rows).iter().map(Drawn::plot))
    }
}

/// Time and error of a row.
fn point(row: &Row) -> (f64, f64) {
    (row.found.cost.cpu_s, row.found.error)
}

impl Drawn<'_> {
    fn plot(&self) -> CurvePlot {
        let all = [&self.rows[..], &self.failed].concat();
        let times_s = widened(&all, |row| row.found.cost.cpu_s, 1.0);
        let errors = widened(&self.rows, |row| row.found.error, 2.0);
        let x = Axis {
            range: Some(times_s),
            ..Axis::log("processor time, one thread [s]")
        };
        let y = Axis {
            range: Some(errors),
            ..Axis::log("relative error")
        };
        let mut plot = CurvePlot {
            shape: 0.78,
            ..CurvePlot::new(&self.panel.title, x, y)
        };
        for (colour, method) in self.labels().iter().enumerate() {
            for series in self.series(method) {
                plot = plot.with(series.in_colour(colour));
            }
        }
        if let Some(guide) = self.guide() {
            plot = plot.with(guide.in_colour(6));
        }
        if self.failed.is_empty() {
            return plot;
        }
        let edge = errors.1 * (errors.0 / errors.1).powf(0.03);
        let points = self.failed.iter().map(|row| (row.found.cost.cpu_s, edge));
        let failed = Series::new("fails (at the upper edge)", Style::Markers, points);
        plot.with(failed.in_colour(5))
    }

    /// Whether this program has so many methods that only the settings that no other beats are drawn.
    fn has_many_methods(&self) -> bool {
        let own = self.rows.iter().filter(|row| row.is_own());
        let methods: BTreeSet<&str> = own.map(|row| row.method.as_str()).collect();
        methods.len() > MOST_METHODS
    }

    /// The label of the curve of a row; none if it is not drawn.
    fn label(&self, row: &Row) -> Option<String> {
        if !row.is_own() {
            return Some(row.method.clone());
        }
        if !self.has_many_methods() {
            return Some(format!("wakescope, {}", row.method));
        }
        row.is_on_front
            .then(|| "wakescope, its best settings".into())
    }

    /// The labels of all curves, those of this program first.
    fn labels(&self) -> Vec<String> {
        let mut labels = BTreeSet::new();
        for row in &self.rows {
            if let Some(label) = self.label(row) {
                labels.insert((!row.is_own(), label));
            }
        }
        labels.into_iter().map(|(_, label)| label).collect()
    }

    /// The curve of a label, and its errors if there are any.
    fn series(&self, label: &str) -> Vec<Series> {
        let mut points = Vec::new();
        let mut errors = Vec::new();
        for row in &self.rows {
            if self.label(row).as_deref() == Some(label) {
                points.push(point(row));
                errors.push(row.found.standard_error.min(0.9 * row.found.error));
            }
        }
        let style = if points.len() > 1 {
            Style::LineMarkers
        } else {
            Style::Markers
        };
        let mut series = vec![Series::new(label, style, points.clone())];
        if errors.iter().any(|error| *error > 0.0) {
            series.push(Series::new("", Style::Markers, points).with_band(&errors));
        }
        series
    }

    /// The slope through the first point of this program.
    fn guide(&self) -> Option<Series> {
        let (label, power) = self.panel.guide.as_ref()?;
        let mut own = self.rows.iter().filter(|row| row.is_own());
        let (start_s, error) = point(own.next()?);
        let last_s = own.map(|row| row.found.cost.cpu_s).fold(start_s, f64::max);
        let line = [start_s, last_s].map(|t| (t, 0.7 * error * (t / start_s).powf(*power)));
        Some(Series::new(label, Style::Dash, line))
    }
}

/// A logarithmic range with an eighth to spare at both ends, of so many decades at least.
fn widened(rows: &[&Row], value: fn(&Row) -> f64, decades: f64) -> (f64, f64) {
    let mut low = f64::INFINITY;
    let mut high = f64::NEG_INFINITY;
    for row in rows {
        let logarithm = value(row).log10();
        low = low.min(logarithm);
        high = high.max(logarithm);
    }
    let spare = (0.12 * (high - low))
        .max(0.5 * (decades - (high - low)))
        .max(0.1);
    (10_f64.powf(low - spare), 10_f64.powf(high + spare))
}

/// Under each panel: what is compared, what this program costs, what others cost at their errors.
pub(crate) fn text(rows: &[Row]) -> String {
    let mut out = format!("Measured on {}.\n\n", machine());
    for drawn in panels(rows) {
        out += &drawn.text();
    }
    out
}

impl Drawn<'_> {
    fn text(&self) -> String {
        let mut own = Vec::new();
        let mut others = Vec::new();
        for &row in &self.rows {
            if row.is_own() {
                own.push(row);
            } else {
                others.push(row);
            }
        }
        let mut out = format!("**{}.** {}\n\n", self.panel.title, self.panel.compared);
        let costs = costs(&own);
        out += &format!("This program reaches {}.\n\n", costs.join(", "));
        let failed: Vec<String> = self.failed.iter().map(|row| setting(row)).collect();
        if !failed.is_empty() {
            out += &format!(
                "No error, for the setting fails: {}.\n\n",
                failed.join("; ")
            );
        }
        if !others.is_empty() {
            out += &comparison(&own, &others);
        }
        out
    }
}

/// The cheapest setting for each target.
fn costs(own: &[&Row]) -> Vec<String> {
    let mut costs = Vec::new();
    for (index, (_, target)) in TARGETS.iter().enumerate() {
        let best = own.iter().find(|row| row.is_cheapest[index]);
        let cost = best.map_or("by no setting".into(), |row| {
            format!("{} ({})", seconds(row.found.cost.cpu_s), setting(row))
        });
        costs.push(format!("{} % {cost}", 100.0 * target));
    }
    costs
}

/// The table of other programs, and which of them cost less at their errors.
fn comparison(own: &[&Row], others: &[&Row]) -> String {
    let mut out = String::from(
        "| other program | error | its time over this program's at that error |\n|---|---|---|\n",
    );
    let mut better = Vec::new();
    for row in others {
        let ratio = ratio(own, row);
        let words = ratio.map_or("this program has no setting so near".into(), |ratio| {
            format!("{ratio:.2}")
        });
        out += &format!(
            "| {} {} | {:.2e} | {words} |\n",
            row.method, row.version, row.found.error
        );
        if ratio.is_none_or(|ratio| ratio < 1.0) {
            better.push(format!("{} at {:.1e}", row.method, row.found.error));
        }
    }
    if better.is_empty() {
        better.push("none of them".into());
    }
    out + &format!("\nThe better buy: {}.\n\n", better.join(", "))
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
