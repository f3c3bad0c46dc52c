//! Curves over one pair of axes: lines, markers, uncertainty bands and error bars, with a legend that covers none of them.
//! Check: a line breaks at a missing value, and a value lands at its coordinate; the rest is for the eye.

use super::axis::{Axis, Scale};
use super::drawing::{Frame, Shape};
use super::font::Font;
use super::frame::{BOTTOM, LEFT, inner, panel, top_room};
use super::legend;
use super::series::{Series, Style, finite, pieces};
use crate::io::{OutputResult, same_length};

const RIGHT: f64 = 24.0;

/// Curves over one pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct CurvePlot {
    /// Title above the panel; none where empty.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Curves, later ones over earlier ones.
    pub series: Vec<Series>,
    /// One metre is as long upward as sideways; the range of one axis is widened for it. Linear axes only.
    pub equal_scales: bool,
    /// Height over width of the panel; ignored with equal scales.
    pub shape: f64,
}

impl CurvePlot {
    /// An empty plot of the usual shape.
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        Self { title: title.into(), x, y, series: Vec::new(), equal_scales: false, shape: 0.5 }
    }

    /// The same plot with one more curve.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    fn ranges(&self) -> OutputResult<((f64, f64), (f64, f64))> {
        let points = || self.series.iter().flat_map(|s| &s.points);
        let bands = self.series.iter().flat_map(|s| s.band.iter().flatten()).flat_map(|b| [b.0, b.1]);
        let pad = if self.equal_scales || self.series.iter().any(|s| s.style == Style::Markers) { 0.04 } else { 0.0 };
        let x = self.x.resolve(points().map(|p| p.0), pad)?;
        let y = self.y.resolve(points().map(|p| p.1).chain(bands), 0.06)?;
        Ok((x, y))
    }

    /// Height of the panel at that width, drawing units.
    pub(crate) fn height(&self, width: f64) -> OutputResult<f64> {
        if !self.equal_scales {
            return Ok(self.shape * width);
        }
        let (x, y) = self.ranges()?;
        let inner = (width - LEFT - RIGHT) * (y.1 - y.0) / (x.1 - x.0);
        Ok(inner.clamp(120.0, 1.2 * width) + top_room(&self.title) + BOTTOM)
    }

    pub(crate) fn draw(&self, cell: Frame, font: &Font, out: &mut Vec<Shape>) -> OutputResult<()> {
        for series in &self.series {
            if let Some(band) = &series.band {
                same_length(&format!("band of '{}'", series.label), band.len(), "its points", series.points.len())?;
            }
        }
        let frame = inner(cell, RIGHT, &self.title);
        let (mut x_range, mut y_range) = self.ranges()?;
        if self.equal_scales && !self.x.log && !self.y.log {
            // A unit is equally long on both axes.
            let unit = ((x_range.1 - x_range.0) / frame.width).max((y_range.1 - y_range.0) / frame.height);
            for (range, length) in [(&mut x_range, frame.width), (&mut y_range, frame.height)] {
                let (middle, half) = (0.5 * (range.0 + range.1), 0.5 * unit * length);
                *range = (middle - half, middle + half);
            }
        }
        // A series without name has a colour, too.
        let mut named: Vec<(usize, &Series)> = self.coloured().collect();
        named.retain(|(_, series)| !series.label.is_empty());
        let x = Scale { label: &self.x.label, range: x_range, log: self.x.log, paper: (frame.left, frame.right()) };
        let mut y = Scale { label: &self.y.label, range: y_range, log: self.y.log, paper: (frame.bottom(), frame.top) };
        let (mut content, mut occupied) = self.content(&x, &y);
        let size = legend::size(&named, font);
        let (mut place, covered) = legend::place(frame, size, &occupied);
        if !named.is_empty() && !self.equal_scales && covered > 0 {
            // Room above the highest point, as high as the legend.
            y.range.1 = y.above((size.1 + 3.0 * legend::INSET) / frame.height);
            (content, occupied) = self.content(&x, &y);
            place = legend::place(frame, size, &occupied).0;
        }
        panel(&frame, [&x, &y], &self.title, content, font, out);
        if !named.is_empty() {
            legend::legend(&named, place, out);
        }
        Ok(())
    }

    /// The series with the indices of their colours.
    fn coloured(&self) -> impl Iterator<Item = (usize, &Series)> {
        self.series.iter().enumerate().map(|(i, series)| (series.colour.unwrap_or(i), series))
    }

    /// The curves on the paper, and where their ink is.
    fn content(&self, x: &Scale<'_>, y: &Scale<'_>) -> (Vec<Shape>, Vec<(f64, f64)>) {
        let (mut content, mut occupied) = (Vec::new(), Vec::new());
        for (colour, series) in self.coloured() {
            let points: Vec<_> = series.points.iter().map(|p| (x.place(p.0), y.place(p.1))).collect();
            let band: Vec<_> = series.band.iter().flatten().map(|b| (y.place(b.0), y.place(b.1))).collect();
            series.shapes(colour, &points, &band, &mut content);
            occupied.extend(along(&points, series.style.has_line()));
            let bars = points.iter().zip(&band).map(|(p, b)| [(p.0, b.0), (p.0, b.1)]);
            occupied.extend(bars.flat_map(|bar| along(&bar, true)));
        }
        (content, occupied)
    }
}

/// Where the ink is: the points, and every few units along the lines between them.
fn along(points: &[(f64, f64)], joined: bool) -> Vec<(f64, f64)> {
    let mut out: Vec<(f64, f64)> = points.iter().copied().filter(finite).collect();
    for pair in pieces(points).filter(|_| joined).flat_map(|s| s.windows(2)) {
        let (dx, dy) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
        let steps = (dx.hypot(dy) / 8.0).min(400.0) as usize;
        out.extend((1..steps).map(|k| k as f64 / steps as f64).map(|t| (pair[0].0 + t * dx, pair[0].1 + t * dy)));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shapes(plot: &CurvePlot) -> Vec<Shape> {
        let mut out = Vec::new();
        let cell = Frame { left: 0.0, top: 0.0, width: 600.0, height: 400.0 };
        plot.draw(cell, &Font::load().unwrap(), &mut out).unwrap();
        out
    }

    fn content(plot: &CurvePlot) -> Vec<Shape> {
        let found = shapes(plot).into_iter().find_map(|s| match s {
            Shape::Clip { shapes, .. } => Some(shapes),
            _ => None,
        });
        found.unwrap()
    }

    fn plot(points: Vec<(f64, f64)>, style: Style) -> CurvePlot {
        CurvePlot::new("t", Axis::linear("x").between(0.0, 10.0), Axis::linear("y").between(0.0, 1.0))
            .with(Series::new("a", style, points))
    }

    #[test]
    fn a_line_breaks_at_a_missing_value() {
        let content = content(&plot(
            vec![(0.0, 0.0), (1.0, 1.0), (2.0, f64::NAN), (3.0, 0.0), (4.0, 1.0), (5.0, 0.5)],
            Style::Line,
        ));
        let lengths: Vec<usize> =
            content.iter().map(|s| if let Shape::Line { points, .. } = s { points.len() } else { 0 }).collect();
        assert_eq!(lengths, [2, 3]);
    }

    #[test]
    fn values_land_at_their_coordinates_with_y_upward() {
        let Shape::Line { points, .. } = &content(&plot(vec![(0.0, 0.0), (10.0, 1.0)], Style::Line))[0] else {
            panic!("no line")
        };
        assert_eq!(points[0], (LEFT, 400.0 - BOTTOM));
        assert_eq!(points[1], (600.0 - RIGHT, top_room("t")));
    }

    #[test]
    fn equal_scales_make_a_metre_equally_long() {
        let mut plot = CurvePlot::new("", Axis::linear("y [m]"), Axis::linear("z [m]")).with(Series::new(
            "",
            Style::Line,
            [(-50.0, 0.0), (50.0, 40.0)],
        ));
        plot.equal_scales = true;
        let Shape::Line { points, .. } = &content(&plot)[0] else { panic!("no line") };
        let (dx, dy) = (points[1].0 - points[0].0, points[0].1 - points[1].1);
        approx::assert_relative_eq!(dx / 100.0, dy / 40.0, max_relative = 1e-12);
    }

    #[test]
    fn a_legend_that_finds_no_free_place_gets_room_above_the_curves() {
        // Error bars from bottom to top all over the panel, as those of a hundred scans.
        let bars = Series::new("scans", Style::Markers, (0..=100).map(|i| (0.1 * f64::from(i), 0.5)));
        let mut full = plot(Vec::new(), Style::Line);
        full.y.range = None;
        full.series = vec![bars.with_band(&[0.45; 101])];
        let drawn = shapes(&full);
        let Some(Shape::Area { points: box_of_legend, .. }) =
            drawn.iter().rfind(|s| matches!(s, Shape::Area { fill, .. } if *fill == [255; 3]))
        else {
            panic!("no legend")
        };
        let bottom = box_of_legend.iter().map(|p| p.1).fold(0.0, f64::max);
        let content = content(&full);
        let highest = content.iter().flat_map(|s| match s {
            Shape::Line { points, .. } => points.iter().map(|p| p.1).collect(),
            _ => vec![f64::INFINITY],
        });
        assert!(highest.fold(f64::INFINITY, f64::min) > bottom, "the bars begin below the legend");
    }

    #[test]
    fn a_band_must_match_its_curve() {
        let mut plot = plot(vec![(0.0, 0.0), (1.0, 1.0)], Style::Line);
        plot.series[0].band = Some(vec![(0.0, 1.0)]);
        let cell = Frame { left: 0.0, top: 0.0, width: 600.0, height: 400.0 };
        assert!(plot.draw(cell, &Font::load().unwrap(), &mut Vec::new()).is_err());
        let bars = plot.series[0].clone().with_band(&[0.1, 0.2]);
        assert_eq!(bars.band.unwrap()[1], (0.8, 1.2));
    }
}
