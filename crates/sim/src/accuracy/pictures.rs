//! The picture of an answer: a panel for each figure, error against the time of a run.
//!
//! Check: by eye; a test of the program compares the names of the files.

use super::figures::Figure;
use super::{Accuracy, Subject};
use crate::plot::{Axis, CurvePlot, Figure as Picture, Series, Style};

/// Shifts below this, in percent, are drawn here: a logarithmic axis has no zero.
const FLOOR: f64 = 1e-3;

impl<S: Subject> Accuracy<S> {
    /// The picture.
    pub fn picture(&self) -> Picture {
        let panels = self.figures.iter().map(|figure| self.panel(*figure));
        Picture {
            columns: 2.min(self.figures.len().max(1)),
            width: 1240.0,
            ..Picture::stacked(panels)
        }
    }

    fn panel(&self, figure: Figure) -> CurvePlot {
        let axis = Axis::log("forecast of a run, one core [s]");
        let error = if S::IS_NOISY {
            "error, two standard errors [%]"
        } else {
            "error [%]"
        };
        let mut plot = CurvePlot::new(figure.name(), axis, Axis::log(error));
        plot.shape = 0.7;
        let mut all = Vec::new();
        let mut chosen = Vec::new();
        for (colour, ladder) in self.ladders.iter().enumerate() {
            let mut points = Vec::new();
            for (place, step) in ladder.steps.iter().enumerate() {
                let point = step
                    .shift(figure)
                    .map(|own| (step.forecast_s, (100.0 * own.bound()).max(FLOOR)));
                points.extend(point);
                chosen.extend(point.filter(|_| place == ladder.chosen));
            }
            all.extend(points.clone());
            if !points.is_empty() {
                let name = ladder.key.rsplit('.').next().unwrap_or_default();
                plot = plot.with(Series::new(name, Style::LineMarkers, points).in_colour(colour));
            }
        }
        if let Some(noise) = self.noises.iter().find(|noise| noise.figure == figure) {
            let points = [
                (self.own_s, 100.0 * noise.now),
                (noise.forecast_s, 100.0 * self.within),
            ];
            all.extend(points);
            plot = plot
                .with(Series::new("noise: now, needed", Style::LineMarkers, points).in_colour(5));
        }
        plot = plot.with(Series::new("chosen", Style::Markers, chosen).in_colour(6));
        let ends = all.iter().map(|(x, _)| *x).filter(|x| x.is_finite());
        let (low, high) = ends.fold((self.own_s, self.own_s), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        let target = [
            (low / 1.5, 100.0 * self.within),
            (1.5 * high, 100.0 * self.within),
        ];
        plot.with(Series::new("target", Style::Dash, target).in_colour(7))
    }
}
