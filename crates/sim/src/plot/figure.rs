//! A figure: panels in columns, written as SVG text or as PNG bytes from one list of shapes.
//! Check: both formats of a figure with every kind of panel come out the same twice, and the panels do not overlap.

use super::curves::CurvePlot;
use super::drawing::{Drawing, Frame};
use super::font::Font;
use super::frame::title;
use super::isosurface::IsosurfacePlot;
use super::map::MapPlot;
use super::png_file::{encode, paint};
use super::svg::svg_text;
use crate::Error;
use crate::io::{FileGroup, Provenance};

const TITLE_ROOM: f64 = 40.0;
const MARGIN: f64 = 10.0;

/// One panel of a figure.
#[derive(Debug, Clone, PartialEq)]
pub enum Panel {
    /// Curves.
    Curves(CurvePlot),
    /// A map over distance and height.
    Map(MapPlot),
    /// Surfaces in space.
    Surfaces(IsosurfacePlot),
}

impl Panel {
    fn height(&self, width: f64) -> Result<f64, Error> {
        match self {
            Self::Curves(plot) => plot.height(width),
            Self::Map(plot) => Ok(plot.height(width)),
            Self::Surfaces(plot) => Ok(plot.height(width)),
        }
    }
}

impl From<CurvePlot> for Panel {
    fn from(plot: CurvePlot) -> Self {
        Self::Curves(plot)
    }
}

impl From<MapPlot> for Panel {
    fn from(plot: MapPlot) -> Self {
        Self::Map(plot)
    }
}

/// Panels, filled row by row.
///
/// ```
/// use wakescope_sim::io::Provenance;
/// use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};
/// let origin = Provenance { program: "wakescope".into(), scene_toml: String::new(), scene_hash: "0".into(), seed: 1 };
/// let curve = Series::new("pair", Style::Line, (0..50).map(|i| (f64::from(i), f64::from(i).sin())));
/// let plot = CurvePlot::new("", Axis::linear("y [m]"), Axis::linear("w [m/s]")).with(curve);
/// let figure = Figure::stacked([plot]);
/// assert!(figure.svg(&origin)?.starts_with("<svg"));
/// assert_eq!(figure.png(&origin)?[1..4], *b"PNG");
/// # Ok::<(), wakescope_sim::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Title above all panels; none where empty.
    pub title: String,
    /// Panels in reading order.
    pub panels: Vec<Panel>,
    /// Panels side by side, at least one.
    pub columns: usize,
    /// Width of the whole [drawing units: 1 in SVG, 1.2 pixels in PNG].
    pub width: f64,
}

impl Figure {
    /// Panels one below the other.
    pub fn stacked(panels: impl IntoIterator<Item = impl Into<Panel>>) -> Self {
        let panels = panels.into_iter().map(Into::into).collect();
        Self {
            title: String::new(),
            panels,
            columns: 1,
            width: 960.0,
        }
    }

    /// Panels side by side.
    pub fn side_by_side(panels: impl IntoIterator<Item = impl Into<Panel>>) -> Self {
        let mut figure = Self::stacked(panels);
        figure.columns = figure.panels.len().max(1);
        figure
    }

    /// The same figure under a title.
    #[must_use]
    pub fn titled(mut self, title: &str) -> Self {
        self.title = title.into();
        self
    }

    /// The figure as SVG text.
    ///
    /// # Errors
    /// A range that cannot be drawn, a band of another length than its curve, a size out of range.
    pub fn svg(&self, provenance: &Provenance) -> Result<String, Error> {
        svg_text(&self.draw()?, provenance)
    }

    /// The figure as PNG bytes.
    ///
    /// # Errors
    /// As [`Self::svg`].
    pub fn png(&self, provenance: &Provenance) -> Result<Vec<u8>, Error> {
        encode([paint(&self.draw()?)], 0.0, Some(provenance))
    }

    /// Both, drawn once: the SVG text and the PNG bytes.
    ///
    /// # Errors
    /// As [`Self::svg`].
    pub fn svg_and_png(&self, provenance: &Provenance) -> Result<(String, Vec<u8>), Error> {
        let drawing = self.draw()?;
        Ok((
            svg_text(&drawing, provenance)?,
            encode([paint(&drawing)], 0.0, Some(provenance))?,
        ))
    }

    /// Adds both to files, as `name.svg` and `name.png`.
    ///
    /// # Errors
    /// As [`Self::svg`]; a file of that name among them.
    pub fn add_to(
        &self,
        files: &mut FileGroup,
        name: &str,
        provenance: &Provenance,
    ) -> Result<(), Error> {
        let (svg, png) = self.svg_and_png(provenance)?;
        files.add(&format!("{name}.svg"), svg)?;
        files.add(&format!("{name}.png"), png)
    }

    /// The shapes of all panels; a row is as high as its highest panel, and maps beside it keep their own height.
    pub(crate) fn draw(&self) -> Result<Drawing, Error> {
        if self.columns == 0 || !(200.0..=10_000.0).contains(&self.width) {
            let value = format!("{} columns, width {}", self.columns, self.width);
            return Err(Error::value(
                "figure",
                value,
                "at least one column, width 200 to 10000",
            ));
        }
        let font = Font::load()?;
        let mut shapes = Vec::new();
        let mut top = MARGIN;
        if !self.title.is_empty() {
            shapes.push(title((self.width / 2.0, top + 22.0), &self.title, 20.0));
            top += TITLE_ROOM;
        }
        let width = (self.width - 2.0 * MARGIN) / self.columns as f64;
        for row in self.panels.chunks(self.columns) {
            let mut heights = Vec::with_capacity(row.len());
            let mut highest = 0_f64;
            for panel in row {
                let height = panel.height(width)?;
                highest = highest.max(height);
                heights.push(height);
            }
            for (column, (panel, own)) in row.iter().zip(heights).enumerate() {
                let left = MARGIN + column as f64 * width;
                let cell = Frame {
                    left,
                    top,
                    width,
                    height: highest,
                };
                match panel {
                    Panel::Curves(plot) => plot.draw(cell, &font, &mut shapes)?,
                    Panel::Map(plot) => plot.draw(
                        Frame {
                            height: own,
                            ..cell
                        },
                        &font,
                        &mut shapes,
                    )?,
                    Panel::Surfaces(plot) => plot.draw(cell, &mut shapes)?,
                }
            }
            top += highest;
        }
        Ok(Drawing {
            width: self.width,
            height: (top + MARGIN).ceil(),
            shapes,
        })
    }
}

/// The figures as one animated PNG, each shown for `frame_s` \[s\], over and over.
///
/// # Errors
/// No figures, figures of different sizes, a time that is not between 0.01 s and 60 s, and what [`Figure::png`] finds.
pub fn apng(figures: &[Figure], frame_s: f64, provenance: &Provenance) -> Result<Vec<u8>, Error> {
    if !(0.01..=60.0).contains(&frame_s) {
        return Err(Error::value("frame_s", frame_s, "0.01 to 60 s"));
    }
    encode(
        figures.iter().map(|figure| paint(&figure.draw()?)),
        frame_s,
        Some(provenance),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::provenance::example;
    use crate::io::samples;
    use crate::plot::drawing::Shape;
    use crate::plot::{Axis, Series, Style};

    fn figure() -> Figure {
        let map = MapPlot::new(&samples::map(), 0, "radial_velocity").unwrap();
        let curve = Series::new("a < b", Style::LineMarkers, [(1.0, 1e-3), (2.0, 1e-1)])
            .with_band(&[1e-4, 1e-2]);
        let curves =
            CurvePlot::new("curves", Axis::linear("x"), Axis::log("C_{n}^{2}")).with(curve);
        Figure::stacked([Panel::Map(map), curves.clone().into(), curves.into()])
    }

    #[test]
    fn both_formats_are_the_same_twice() {
        let figure = figure();
        let origin = example();
        let svg = figure.svg(&origin).unwrap();
        assert_eq!(svg, figure.svg(&origin).unwrap());
        assert_eq!(
            (svg.clone(), figure.png(&origin).unwrap()),
            figure.svg_and_png(&origin).unwrap()
        );
        assert_eq!(svg.matches("<image").count(), 2, "map and colour bar");
        assert_eq!(svg.matches("<svg").count(), svg.matches("</svg>").count());
        assert!(svg.contains("a &lt; b") && !svg.contains("NaN"));
    }

    #[test]
    fn cells_fill_rows_without_overlap() {
        let mut figure = figure();
        figure.columns = 2;
        let drawing = figure.draw().unwrap();
        let boxes: Vec<Frame> = drawing
            .shapes
            .iter()
            .filter_map(|shape| {
                if let Shape::Clip { frame, .. } = shape {
                    Some(*frame)
                } else {
                    None
                }
            })
            .collect();
        assert_eq!(boxes.len(), 3);
        assert!(boxes[0].right() < boxes[1].left && boxes[1].right() < figure.width);
        assert!(boxes[0].bottom().max(boxes[1].bottom()) < boxes[2].top);
        assert_eq!(boxes[0].left, boxes[2].left);
        assert!(boxes[2].bottom() < drawing.height);
    }

    #[test]
    fn impossible_figures_are_refused() {
        for (columns, width) in [(0, 960.0), (1, 10.0), (1, f64::NAN)] {
            let figure = Figure {
                columns,
                width,
                ..figure()
            };
            assert!(figure.svg(&example()).is_err());
        }
    }
}
