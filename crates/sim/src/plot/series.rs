//! One curve: its points, how it is drawn, its band, its marker.
//! Check: with the plots of curves.

use super::colour::curve_colour;
use super::drawing::{Pen, Shape};

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

    pub(crate) fn has_line(self) -> bool {
        self != Self::Markers
    }

    pub(crate) fn has_markers(self) -> bool {
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
        Self { label: label.into(), points: points.into_iter().collect(), style, band: None, colour: None }
    }

    /// The same curve with a band of +- `half_width` about each point.
    #[must_use]
    pub fn with_band(mut self, half_width: &[f64]) -> Self {
        self.band = Some(self.points.iter().zip(half_width).map(|(p, h)| (p.1 - h, p.1 + h)).collect());
        self
    }

    /// The same curve in colour `index` of the palette.
    #[must_use]
    pub fn in_colour(mut self, index: usize) -> Self {
        self.colour = Some(index);
        self
    }

    pub(crate) fn pen(&self, colour: usize) -> Pen {
        Pen { colour: curve_colour(colour), width: LINE_WIDTH, dash: self.style.dash() }
    }

    /// The curve through its points on the paper, with its band between those at the same places.
    pub(super) fn shapes(&self, colour: usize, points: &[(f64, f64)], band: &[(f64, f64)], out: &mut Vec<Shape>) {
        let fill = curve_colour(colour);
        // x, lower and upper edge.
        let band: Vec<_> = points.iter().zip(band).map(|(p, b)| (p.0, b.0, b.1)).collect();
        let bands = band.split(|b| !(b.0.is_finite() && b.1.is_finite() && b.2.is_finite()));
        if self.style == Style::Markers {
            for &(x, low, high) in bands.flatten() {
                let cap = |y: f64| [(x - CAP, y), (x + CAP, y)];
                out.extend([[(x, low), (x, high)], cap(low), cap(high)].map(|line| Shape::line(line, fill, 1.4)));
            }
        } else {
            // One polygon for a stretch without gap: forth along the upper edge, back along the lower.
            for stretch in bands.filter(|stretch| stretch.len() > 1) {
                let (upper, lower) = (stretch.iter().map(|b| (b.0, b.2)), stretch.iter().rev().map(|b| (b.0, b.1)));
                out.push(Shape::Area { points: upper.chain(lower).collect(), fill, opacity: 0.22 });
            }
        }
        if self.style.has_line() {
            out.extend(pieces(points).map(|p| Shape::Line { points: p.to_vec(), pen: self.pen(colour) }));
        }
        if self.style.has_markers() {
            out.extend(points.iter().filter(|p| finite(p)).map(|p| marker(*p, colour)));
        }
    }
}

/// The marker of a series: its shape differs as well as its colour.
pub(crate) fn marker(at: (f64, f64), index: usize) -> Shape {
    let (corners, radius, turn): (u32, f64, f64) =
        [(24, 4.6, 0.0), (4, 5.6, 0.125), (3, 6.2, -0.25), (4, 5.8, 0.0)][index % 4];
    let corner = |i: u32| {
        let angle = std::f64::consts::TAU * (f64::from(i) / f64::from(corners) + turn);
        (at.0 + radius * angle.cos(), at.1 + radius * angle.sin())
    };
    Shape::area((0..corners).map(corner).collect::<Vec<_>>(), curve_colour(index))
}

pub(super) fn finite(p: &(f64, f64)) -> bool {
    p.0.is_finite() && p.1.is_finite()
}

/// Stretches of at least two finite points.
pub(super) fn pieces(points: &[(f64, f64)]) -> impl Iterator<Item = &[(f64, f64)]> {
    points.split(|p| !finite(p)).filter(|s| s.len() > 1)
}
