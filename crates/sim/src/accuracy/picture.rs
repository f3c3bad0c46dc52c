//! The picture of a report: for each metric error against run time, with the front.

use super::Report;
use super::metrics::Metric;
use crate::plot::{Axis, CurvePlot, Figure, Series, Style};
use wakescope_estimate::Measured;

/// Smallest error that is drawn, %: a logarithmic axis has no zero.
const SMALLEST: f64 = 1e-3;

/// Error in percent as it is drawn.
fn drawn(shift: Measured) -> f64 {
    (100.0 * shift.bound()).max(SMALLEST)
}

impl Report {
    /// The picture.
    pub fn picture(&self) -> Figure {
        let panels = self.metrics.iter().map(|metric| self.panel(*metric));
        Figure {
            columns: 2.min(self.metrics.len().max(1)),
            width: 1240.0,
            ..Figure::stacked(panels)
        }
    }

    fn panel(&self, metric: Metric) -> CurvePlot {
        let x = Axis::log("run time [s]");
        let y = match self.realisations {
            Some(_) => Axis::log("shift and two standard errors [%]"),
            None => Axis::log("error [%]"),
        };
        let mut plot = CurvePlot::new(metric.name(), x, y);
        plot.shape = 0.7;
        let mut run_s = Vec::new();
        for (colour, setting) in self.settings.iter().enumerate() {
            let usable = setting.rows.iter().filter(|row| row.is_usable());
            let points: Vec<(f64, f64)> = usable
                .filter_map(|row| Some((row.run_s, drawn(row.shift(metric)?))))
                .collect();
            run_s.extend(points.iter().map(|point| point.0));
            if !points.is_empty() {
                let name = setting.key.rsplit('.').next().unwrap_or_default();
                plot = plot.with(Series::new(name, Style::LineMarkers, points).in_colour(colour));
            }
        }
        let mut front = Vec::new();
        for ((_, row), is_on_front) in self.rows().zip(self.front(metric)) {
            if is_on_front && let Some(shift) = row.shift(metric) {
                front.push((row.run_s, drawn(shift)));
            }
        }
        front.sort_by(|a, b| a.0.total_cmp(&b.0));
        let colour = self.settings.len();
        plot = plot.with(Series::new("front", Style::Dash, front).in_colour(colour));
        let shortest = run_s.iter().copied().fold(f64::INFINITY, f64::min);
        let longest = run_s.iter().copied().fold(0.0, f64::max);
        let within = [shortest / 1.5, 1.5 * longest].map(|x| (x, 100.0 * self.within));
        plot.with(Series::new("--within", Style::Dot, within).in_colour(colour + 1))
    }
}
