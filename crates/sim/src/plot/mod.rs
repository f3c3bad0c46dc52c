//! Pictures of results: curves, and RHI maps in metres. One list of shapes is drawn as SVG and as PNG,
//! with a font that is compiled in, so that no system font is needed and the same input gives the same bytes.
//! Check: the tests look up single pixels, ticks and colours; the PNG files are for the eye.
//!
//! | module | draws |
//! |---|---|
//! | [`figure`] | panels side by side or stacked, as SVG text or PNG bytes |
//! | [`curves`], [`series`] | curves with bands and markers, linear or logarithmic |
//! | [`map`] | one field of a sweep or of a plane over distance and height, equal scales, with colour bar |
//! | [`cells`] | (inside a map) pixels from polar and rectangular cells |
//! | [`isosurface`] | lit surfaces of equal value of a field in space |
//! | [`volume`] | (inside it) rays through a mesh |
//! | [`apng`] | pictures one after the other |
//! | [`colour`] | palette and colour maps |

mod axis;
pub mod cells;
pub mod colour;
pub mod curves;
mod drawing;
pub mod figure;
mod font;
mod frame;
pub mod isosurface;
mod legend;
pub mod map;
mod png_file;
pub mod series;
mod svg;
pub mod volume;

pub use axis::Axis;
pub use cells::Cells;
pub use colour::ColourMap;
pub use curves::CurvePlot;
pub use figure::{Figure, Panel, apng};
pub use isosurface::{IsosurfacePlot, Surface};
pub use map::MapPlot;
pub use series::{Series, Style};
pub use svg::escape;
pub use volume::Volume;
