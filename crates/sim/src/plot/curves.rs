//! Curves over one pair of axes: lines, markers, uncertainty bands and error bars, with a legend that covers none of them: it is put where
//! it covers least, in a corner, the middle of an edge, else anywhere. Where no place is free the plot makes room above its curves.
//! Check: a line breaks at a missing value, and a value lands at its coordinate; tests fill all places but one and find the legend there;
//! the rest is for the eye.

use super::axis::{Axis, Scale};
use super::colour::curve_colour;
use super::drawing::{Anchor, Frame, Shape};
use super::font::Font;
use super::frame::{BOTTOM, GRID, HALF_HEIGHT, LEFT, TICK_SIZE, inner, panel, top_room};
use crate::Error;
use crate::io::same_length;

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
        Self {
            title: title.into(),
            x,
            y,
            series: Vec::new(),
            equal_scales: false,
            shape: 0.5,
        }
    }

    /// The same plot with one more curve.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Ranges of x and y.
    fn ranges(&self) -> Result<[(f64, f64); 2], Error> {
        let mut x = Vec::new();
        let mut y = Vec::new();
        for series in &self.series {
            for point in &series.points {
                x.push(point.0);
                y.push(point.1);
            }
            for edges in series.band.iter().flatten() {
                y.extend([edges.0, edges.1]);
            }
        }
        let pad = if self.equal_scales || self.series.iter().any(|s| s.style == Style::Markers) {
            0.04
        } else {
            0.0
        };
        let x = self.x.resolve(x.into_iter(), pad)?;
        let y = self.y.resolve(y.into_iter(), 0.06)?;
        Ok([x, y])
    }

    /// Height of the panel at that width, drawing units.
    pub(crate) fn height(&self, width: f64) -> Result<f64, Error> {
        if !self.equal_scales {
            return Ok(self.shape * width);
        }
        let [x, y] = self.ranges()?;
        let inner = (width - LEFT - RIGHT) * (y.1 - y.0) / (x.1 - x.0);
        Ok(inner.clamp(120.0, 1.2 * width) + top_room(&self.title) + BOTTOM)
    }

    pub(crate) fn draw(&self, cell: Frame, font: &Font, out: &mut Vec<Shape>) -> Result<(), Error> {
        for series in &self.series {
            if let Some(band) = &series.band {
                same_length(
                    &format!("band of '{}'", series.label),
                    band.len(),
                    "its points",
                    series.points.len(),
                )?;
            }
        }
        let frame = inner(cell, RIGHT, &self.title);
        let [mut x_range, mut y_range] = self.ranges()?;
        if self.equal_scales && !self.x.log && !self.y.log {
            // A unit is equally long on both axes.
            let unit =
                ((x_range.1 - x_range.0) / frame.width).max((y_range.1 - y_range.0) / frame.height);
            for (range, length) in [(&mut x_range, frame.width), (&mut y_range, frame.height)] {
                let middle = 0.5 * (range.0 + range.1);
                let half = 0.5 * unit * length;
                *range = (middle - half, middle + half);
            }
        }
        // A series without name has a colour, too.
        let mut named: Vec<(usize, &Series)> = self.coloured().collect();
        named.retain(|(_, series)| !series.label.is_empty());
        let x = Scale {
            label: &self.x.label,
            range: x_range,
            log: self.x.log,
            paper: (frame.left, frame.right()),
        };
        let mut y = Scale {
            label: &self.y.label,
            range: y_range,
            log: self.y.log,
            paper: (frame.bottom(), frame.top),
        };
        let (mut content, mut occupied) = self.content(&x, &y);
        let size = legend_size(&named, font);
        let (mut place, covered) = legend_place(frame, size, &occupied);
        if !named.is_empty() && !self.equal_scales && covered > 0 {
            // Room above the highest point, as high as the legend.
            y.range.1 = y.above((size.1 + 3.0 * INSET) / frame.height);
            (content, occupied) = self.content(&x, &y);
            place = legend_place(frame, size, &occupied).0;
        }
        panel(&frame, [&x, &y], &self.title, content, font, out);
        if !named.is_empty() {
            draw_legend(&named, place, out);
        }
        Ok(())
    }

    /// The series with the indices of their colours.
    fn coloured(&self) -> impl Iterator<Item = (usize, &Series)> {
        self.series
            .iter()
            .enumerate()
            .map(|(i, series)| (series.colour.unwrap_or(i), series))
    }

    /// The curves on the paper, and where their ink is.
    fn content(&self, x: &Scale<'_>, y: &Scale<'_>) -> (Vec<Shape>, Vec<(f64, f64)>) {
        let mut content = Vec::new();
        let mut occupied = Vec::new();
        for (colour, series) in self.coloured() {
            let points: Vec<_> = series
                .points
                .iter()
                .map(|p| (x.place(p.0), y.place(p.1)))
                .collect();
            let band: Vec<_> = series
                .band
                .iter()
                .flatten()
                .map(|b| (y.place(b.0), y.place(b.1)))
                .collect();
            series.shapes(colour, &points, &band, &mut content);
            occupied.extend(along(&points, series.style.has_line()));
            let bars = points
                .iter()
                .zip(&band)
                .map(|(p, b)| [(p.0, b.0), (p.0, b.1)]);
            occupied.extend(bars.flat_map(|bar| along(&bar, true)));
        }
        (content, occupied)
    }
}

/// Where the ink is: the points, and every few units along the lines between them.
fn along(points: &[(f64, f64)], joined: bool) -> Vec<(f64, f64)> {
    let mut out: Vec<(f64, f64)> = points.iter().copied().filter(finite).collect();
    for pair in pieces(points).filter(|_| joined).flat_map(|s| s.windows(2)) {
        let dx = pair[1].0 - pair[0].0;
        let dy = pair[1].1 - pair[0].1;
        let steps = (dx.hypot(dy) / 8.0).min(400.0) as usize;
        out.extend(
            (1..steps)
                .map(|k| k as f64 / steps as f64)
                .map(|t| (pair[0].0 + t * dx, pair[0].1 + t * dy)),
        );
    }
    out
}

const LINE_WIDTH: f64 = 2.2;
/// Half the width of the ends of error bars.
const CAP: f64 = 4.0;

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Solid line.
    Line,
    /// Dashed line.
    Dash,
    /// Dotted line.
    Dot,
    /// Dashes and dots in turn.
    DashDot,
    /// A marker at each point, no line; a band becomes error bars.
    Markers,
    /// Solid line with a marker at each point.
    LineMarkers,
}

impl Style {
    fn dash(self) -> &'static [f64] {
        match self {
            Self::Dash => &[9.0, 5.0],
            Self::Dot => &[2.5, 4.0],
            Self::DashDot => &[11.0, 4.0, 2.5, 4.0],
            Self::Line | Self::Markers | Self::LineMarkers => &[],
        }
    }

    fn has_line(self) -> bool {
        self != Self::Markers
    }

    fn has_markers(self) -> bool {
        matches!(self, Self::Markers | Self::LineMarkers)
    }
}

/// One curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; none where empty.
    pub label: String,
    /// Points (x, y) in the order in which they are joined; a NaN breaks the line.
    pub points: Vec<(f64, f64)>,
    /// Line or markers.
    pub style: Style,
    /// Lower and upper y at each point, drawn as a band.
    pub band: Option<Vec<(f64, f64)>>,
    /// Index into the palette; the position of the series in the plot where absent.
    pub colour: Option<usize>,
}

impl Series {
    /// A curve without band, in the next colour.
    pub fn new(label: &str, style: Style, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self {
            label: label.into(),
            points: points.into_iter().collect(),
            style,
            band: None,
            colour: None,
        }
    }

    /// The same curve with a band of +- `half_width` about each point.
    #[must_use]
    pub fn with_band(mut self, half_width: &[f64]) -> Self {
        self.band = Some(
            self.points
                .iter()
                .zip(half_width)
                .map(|(p, h)| (p.1 - h, p.1 + h))
                .collect(),
        );
        self
    }

    /// The same curve in colour `index` of the palette.
    #[must_use]
    pub fn in_colour(mut self, index: usize) -> Self {
        self.colour = Some(index);
        self
    }

    fn line(&self, points: &[(f64, f64)], colour: usize) -> Shape {
        Shape::Line {
            points: points.to_vec(),
            colour: curve_colour(colour),
            width: LINE_WIDTH,
            dash: self.style.dash(),
        }
    }

    /// The curve through its points on the paper, with its band between those at the same places.
    fn shapes(
        &self,
        colour: usize,
        points: &[(f64, f64)],
        band: &[(f64, f64)],
        out: &mut Vec<Shape>,
    ) {
        let fill = curve_colour(colour);
        // x, lower and upper edge.
        let mut edges = Vec::with_capacity(band.len());
        for (point, band) in points.iter().zip(band) {
            edges.push((point.0, band.0, band.1));
        }
        let bands = edges.split(|b| !(b.0.is_finite() && b.1.is_finite() && b.2.is_finite()));
        if self.style == Style::Markers {
            for &(x, low, high) in bands.flatten() {
                for line in [
                    [(x, low), (x, high)],
                    [(x - CAP, low), (x + CAP, low)],
                    [(x - CAP, high), (x + CAP, high)],
                ] {
                    out.push(Shape::line(line, fill, 1.4));
                }
            }
        } else {
            // One polygon for a stretch without gap: forth along the upper edge, back along the lower.
            for stretch in bands.filter(|stretch| stretch.len() > 1) {
                let upper = stretch.iter().map(|b| (b.0, b.2));
                let lower = stretch.iter().rev().map(|b| (b.0, b.1));
                out.push(Shape::Area {
                    points: upper.chain(lower).collect(),
                    fill,
                    opacity: 0.22,
                });
            }
        }
        if self.style.has_line() {
            for piece in pieces(points) {
                out.push(self.line(piece, colour));
            }
        }
        if self.style.has_markers() {
            for point in points {
                if finite(point) {
                    out.push(marker(*point, colour));
                }
            }
        }
    }
}

/// The marker of a series: its shape differs as well as its colour.
fn marker(at: (f64, f64), index: usize) -> Shape {
    let (corners, radius, turn): (u32, f64, f64) = [
        (24, 4.6, 0.0),
        (4, 5.6, 0.125),
        (3, 6.2, -0.25),
        (4, 5.8, 0.0),
    ][index % 4];
    let mut points = Vec::with_capacity(corners as usize);
    for corner in 0..corners {
        let angle = std::f64::consts::TAU * (f64::from(corner) / f64::from(corners) + turn);
        points.push((at.0 + radius * angle.cos(), at.1 + radius * angle.sin()));
    }
    Shape::area(points, curve_colour(index))
}

fn finite(p: &(f64, f64)) -> bool {
    p.0.is_finite() && p.1.is_finite()
}

/// Stretches of at least two finite points.
fn pieces(points: &[(f64, f64)]) -> impl Iterator<Item = &[(f64, f64)]> {
    points.split(|p| !finite(p)).filter(|s| s.len() > 1)
}

const SAMPLE: f64 = 34.0;
const LINE: f64 = 21.0;
const PAD: f64 = 9.0;
/// Between legend and frame.
const INSET: f64 = 8.0;
/// Half of the largest marker.
const REACH: f64 = 6.5;
/// Steps of the places that are tried along each side.
const GRID_PLACES: u8 = 12;

/// Room that the named series need, which come with the indices of their colours.
fn legend_size(series: &[(usize, &Series)], font: &Font) -> (f64, f64) {
    let widest = series
        .iter()
        .map(|(_, s)| font.width(&s.label, TICK_SIZE))
        .fold(0.0, f64::max);
    // A seventh more than the letters need: the font of an SVG viewer may run wider.
    (
        SAMPLE + 3.0 * PAD + 1.15 * widest,
        LINE * series.len() as f64 + PAD,
    )
}

/// Draws samples and names of the series into their place.
fn draw_legend(series: &[(usize, &Series)], place: Frame, out: &mut Vec<Shape>) {
    out.push(Shape::Area {
        points: place.outline(),
        fill: [255, 255, 255],
        opacity: 0.88,
    });
    out.push(Shape::line(place.outline(), GRID, 1.0));
    for (row, (colour, series)) in series.iter().enumerate() {
        let x = place.left + PAD;
        let y = place.top + 0.5 * PAD + LINE * (row as f64 + 0.5);
        if series.style.has_line() {
            out.push(series.line(&[(x, y), (x + SAMPLE, y)], *colour));
        }
        if series.style.has_markers() {
            out.push(marker((x + SAMPLE / 2.0, y), *colour));
        }
        out.push(Shape::text(
            (x + SAMPLE + PAD, y + HALF_HEIGHT),
            &series.label,
            TICK_SIZE,
            Anchor::Start,
        ));
    }
}

/// The place with the fewest points under the legend, and how many these are. Of equal ones it is the first: the corners
/// from the upper right on, the middles of the edges, then all over the frame.
fn legend_place(
    frame: Frame,
    (width, height): (f64, f64),
    occupied: &[(f64, f64)],
) -> (Frame, usize) {
    let corners = [(1.0, 0.0), (0.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    let edges = [(0.5, 0.0), (0.5, 1.0), (1.0, 0.5), (0.0, 0.5)];
    let mut places = [corners, edges].concat();
    for row in 0..=GRID_PLACES {
        for column in 0..=GRID_PLACES {
            let across = f64::from(column) / f64::from(GRID_PLACES);
            let down = f64::from(row) / f64::from(GRID_PLACES);
            places.push((1.0 - across, down));
        }
    }
    let mut best: Option<(Frame, usize)> = None;
    for (across, down) in places {
        let place = Frame {
            left: frame.left + INSET + across * (frame.width - 2.0 * INSET - width),
            top: frame.top + INSET + down * (frame.height - 2.0 * INSET - height),
            width,
            height,
        };
        let count = covered(&place, occupied);
        if best.is_none_or(|(_, least)| count < least) {
            best = Some((place, count));
        }
    }
    best.unwrap_or((frame, 0))
}

/// Number of points under a frame; markers and the width of lines reach beyond their points.
fn covered(frame: &Frame, occupied: &[(f64, f64)]) -> usize {
    let mut count = 0;
    for (x, y) in occupied {
        let is_beside = *x > frame.left - REACH && *x < frame.right() + REACH;
        let is_level = *y > frame.top - REACH && *y < frame.bottom() + REACH;
        count += usize::from(is_beside && is_level);
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shapes(plot: &CurvePlot) -> Vec<Shape> {
        let mut out = Vec::new();
        let cell = Frame {
            left: 0.0,
            top: 0.0,
            width: 600.0,
            height: 400.0,
        };
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
        CurvePlot::new(
            "t",
            Axis::linear("x").between(0.0, 10.0),
            Axis::linear("y").between(0.0, 1.0),
        )
        .with(Series::new("a", style, points))
    }

    #[test]
    fn a_line_breaks_at_a_missing_value() {
        let content = content(&plot(
            vec![
                (0.0, 0.0),
                (1.0, 1.0),
                (2.0, f64::NAN),
                (3.0, 0.0),
                (4.0, 1.0),
                (5.0, 0.5),
            ],
            Style::Line,
        ));
        let lengths: Vec<usize> = content
            .iter()
            .map(|s| {
                if let Shape::Line { points, .. } = s {
                    points.len()
                } else {
                    0
                }
            })
            .collect();
        assert_eq!(lengths, [2, 3]);
    }

    #[test]
    fn values_land_at_their_coordinates_with_y_upward() {
        let Shape::Line { points, .. } =
            &content(&plot(vec![(0.0, 0.0), (10.0, 1.0)], Style::Line))[0]
        else {
            panic!("no line")
        };
        assert_eq!(points[0], (LEFT, 400.0 - BOTTOM));
        assert_eq!(points[1], (600.0 - RIGHT, top_room("t")));
    }

    #[test]
    fn equal_scales_make_a_metre_equally_long() {
        let mut plot = CurvePlot::new("", Axis::linear("y [m]"), Axis::linear("z [m]"))
            .with(Series::new("", Style::Line, [(-50.0, 0.0), (50.0, 40.0)]));
        plot.equal_scales = true;
        let Shape::Line { points, .. } = &content(&plot)[0] else {
            panic!("no line")
        };
        let dx = points[1].0 - points[0].0;
        let dy = points[0].1 - points[1].1;
        approx::assert_relative_eq!(dx / 100.0, dy / 40.0, max_relative = 1e-12);
    }

    #[test]
    fn a_legend_that_finds_no_free_place_gets_room_above_the_curves() {
        // Error bars from bottom to top all over the panel, as those of a hundred scans.
        let bars = Series::new(
            "scans",
            Style::Markers,
            (0..=100).map(|i| (0.1 * f64::from(i), 0.5)),
        );
        let mut full = plot(Vec::new(), Style::Line);
        full.y.range = None;
        full.series = vec![bars.with_band(&[0.45; 101])];
        let drawn = shapes(&full);
        let Some(Shape::Area {
            points: box_of_legend,
            ..
        }) = drawn
            .iter()
            .rfind(|s| matches!(s, Shape::Area { fill, .. } if *fill == [255; 3]))
        else {
            panic!("no legend")
        };
        let bottom = box_of_legend.iter().map(|p| p.1).fold(0.0, f64::max);
        let content = content(&full);
        let highest = content.iter().flat_map(|s| match s {
            Shape::Line { points, .. } => points.iter().map(|p| p.1).collect(),
            _ => vec![f64::INFINITY],
        });
        assert!(
            highest.fold(f64::INFINITY, f64::min) > bottom,
            "the bars begin below the legend"
        );
    }

    #[test]
    fn a_band_must_match_its_curve() {
        let mut plot = plot(vec![(0.0, 0.0), (1.0, 1.0)], Style::Line);
        plot.series[0].band = Some(vec![(0.0, 1.0)]);
        let cell = Frame {
            left: 0.0,
            top: 0.0,
            width: 600.0,
            height: 400.0,
        };
        assert!(
            plot.draw(cell, &Font::load().unwrap(), &mut Vec::new())
                .is_err()
        );
        let bars = plot.series[0].clone().with_band(&[0.1, 0.2]);
        assert_eq!(bars.band.unwrap()[1], (0.8, 1.2));
    }
}

#[cfg(test)]
mod legend_tests {
    use super::*;

    #[test]
    fn the_legend_goes_to_the_empty_corner() {
        let frame = Frame {
            left: 0.0,
            top: 0.0,
            width: 400.0,
            height: 300.0,
        };
        let corners = [(390.0, 10.0), (10.0, 10.0), (390.0, 290.0), (10.0, 290.0)];
        for empty in 0..4 {
            let ink: Vec<(f64, f64)> = corners
                .iter()
                .enumerate()
                .filter(|(i, _)| *i != empty)
                .map(|(_, p)| *p)
                .collect();
            let (found, covered) = legend_place(frame, (100.0, 60.0), &ink);
            assert_eq!(covered, 0);
            let expected = corners[empty];
            assert!(
                (found.left < 200.0) == (expected.0 < 200.0)
                    && (found.top < 150.0) == (expected.1 < 150.0)
            );
        }
    }

    #[test]
    fn the_only_free_place_is_found_away_from_corners_and_edges() {
        let frame = Frame {
            left: 0.0,
            top: 0.0,
            width: 400.0,
            height: 300.0,
        };
        let grid =
            (0..=80).flat_map(|i| (0..=60).map(move |j| (5.0 * f64::from(i), 5.0 * f64::from(j))));
        // A hole off the middle, a little larger than the legend.
        let ink: Vec<(f64, f64)> = grid
            .filter(|(x, y)| !(70.0..=210.0).contains(x) || !(60.0..=150.0).contains(y))
            .collect();
        let (found, covered) = legend_place(frame, (80.0, 40.0), &ink);
        assert_eq!(covered, 0, "{found:?}");
        assert!(
            found.left > 70.0
                && found.right() < 210.0
                && found.top > 60.0
                && found.bottom() < 150.0
        );
        let (_, covered) = legend_place(frame, (200.0, 100.0), &ink);
        assert!(covered > 0, "too large for the hole");
    }
}
