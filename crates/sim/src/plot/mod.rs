//! Pictures of results: curves, and RHI maps in metres. One list of shapes is drawn as SVG and as PNG,
//! with a font that is compiled in, so that no system font is needed and the same input gives the same bytes.
//! Check: the tests look up single pixels, ticks and colours; the PNG files are for the eye.
//!
//! | module | draws |
//! |---|---|
//! | [`figure`] | panels side by side or stacked, as SVG text or PNG bytes |
//! | [`curves`] | curves with bands and markers, linear or logarithmic |
//! | [`map`] | one field of a sweep or of a plane over distance and height, equal scales, with colour bar |
//! | [`isosurface`] | lit surfaces of equal value of a field in space, by rays through a mesh |
//! | [`apng`] | pictures one after the other |
//! | [`colour`] | palette and colour maps |

mod axis;
pub mod colour;
pub mod curves;
mod drawing;
pub mod figure;
mod font;
mod frame;
pub mod isosurface;
pub mod map;
mod png_file;
mod svg;

pub use axis::Axis;
pub use colour::ColourMap;
pub use curves::{CurvePlot, Series, Style};
pub use figure::{Figure, Panel, apng};
pub use isosurface::{IsosurfacePlot, Surface, Volume};
pub use map::{Cells, MapPlot};
pub use svg::escape;
