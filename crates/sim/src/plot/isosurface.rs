//! Surfaces of equal value of a field in space, lit and half transparent, in a box seen from aside without perspective.
//! Check: a sphere covers the area of its shadow; the opaque surface hides the one behind; the same bytes twice.

use super::colour::Rgb;
use super::drawing::{Anchor, Frame, Pen, Raster, Shape};
use super::font::Font;
use super::frame::{TICK_SIZE, label, top_room};
use super::volume::Volume;
use crate::io::{OutputError, OutputResult};
use rayon::prelude::*;
use std::sync::Arc;

/// Pixels of the embedded picture per drawing unit, as those of a PNG file.
const DENSITY: f64 = super::png_file::SCALE;
const MARGIN: f64 = 26.0;
const GROUND: Rgb = [232, 224, 212];
const EDGE: Rgb = [150, 150, 150];
/// A ray that has met so much shows nothing behind.
const OPAQUE: f64 = 0.98;

/// One surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Value of the field on it.
    pub level: f64,
    /// Colour in full light.
    pub colour: Rgb,
    /// 1 hides what lies behind.
    pub opacity: f64,
    /// Name in the legend.
    pub name: String,
}

/// Surfaces of one field to draw.
#[derive(Debug, Clone, PartialEq)]
pub struct IsosurfacePlot {
    /// Title above the panel.
    pub title: String,
    /// The field.
    pub volume: Arc<Volume>,
    /// The surfaces.
    pub surfaces: Vec<Surface>,
    /// From where it is seen: angle from the x axis in the horizontal plane, and above it \[rad\].
    pub view_rad: [f64; 2],
    /// Names of the axes, written at the edges of the box.
    pub axes: [String; 3],
    /// Whether the lowest plane is drawn as a ground.
    pub ground: bool,
}

/// Directions of the picture: to the right, up, and into it.
struct Camera {
    right: [f64; 3],
    up: [f64; 3],
    into: [f64; 3],
    /// Smallest and largest coordinate to the right and up \[m\].
    range_m: [(f64, f64); 2],
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl IsosurfacePlot {
    fn camera(&self) -> Camera {
        let ([sa, ca], [se, ce]) = {
            let [azimuth, elevation] = self.view_rad;
            ([azimuth.sin(), azimuth.cos()], [elevation.sin(), elevation.cos()])
        };
        let (right, up) = ([-sa, ca, 0.0], [-se * ca, -se * sa, ce]);
        let mut range_m = [(f64::INFINITY, f64::NEG_INFINITY); 2];
        for corner in self.corners_m() {
            for (range, axis) in range_m.iter_mut().zip([right, up]) {
                let at = dot(corner, axis);
                *range = (range.0.min(at), range.1.max(at));
            }
        }
        Camera { right, up, into: [-ce * ca, -ce * sa, -se], range_m }
    }

    /// The eight corners; bit `d` of the place says which end of axis `d`.
    fn corners_m(&self) -> [[f64; 3]; 8] {
        let ends = self.volume.corners_m();
        std::array::from_fn(|place| std::array::from_fn(|d| ends[place >> d & 1][d]))
    }

    pub(crate) fn height(&self, width: f64) -> f64 {
        let [across, up] = self.camera().range_m.map(|(low, high)| high - low);
        let inner = (width - 2.0 * MARGIN) * up / across;
        inner.clamp(60.0, 1.5 * width) + 2.0 * MARGIN + top_room(&self.title)
    }

    pub(crate) fn draw(&self, cell: Frame, _: &Font, out: &mut Vec<Shape>) -> OutputResult<()> {
        for surface in &self.surfaces {
            if !(surface.level.is_finite() && (0.0..=1.0).contains(&surface.opacity)) {
                let value = format!("level {}, opacity {}", surface.level, surface.opacity);
                return Err(OutputError::value("surface", value, "a finite level, opacity 0 to 1"));
            }
        }
        let camera = self.camera();
        let [across, up] = camera.range_m.map(|(low, high)| high - low);
        let room = (cell.width - 2.0 * MARGIN, cell.height - 2.0 * MARGIN - top_room(&self.title));
        let scale = (room.0 / across).min(room.1 / up);
        let frame = Frame {
            left: cell.left + 0.5 * (cell.width - scale * across),
            top: cell.top + top_room(&self.title) + 0.5 * MARGIN,
            width: scale * across,
            height: scale * up,
        };
        let place = |at_m: [f64; 3]| {
            let [x, y] = [(dot(at_m, camera.right), 0), (dot(at_m, camera.up), 1)]
                .map(|(at, axis): (f64, usize)| at - camera.range_m[axis].0);
            (frame.left + scale * x, frame.bottom() - scale * y)
        };
        let corners = self.corners_m();
        // The corner farthest from the eye has the hidden edges.
        let far = (0..8).max_by(|a, b| dot(corners[*a], camera.into).total_cmp(&dot(corners[*b], camera.into)));
        let edge = |from: usize, d: usize| Shape::Line {
            points: vec![place(corners[from]), place(corners[from ^ (1 << d)])],
            pen: Pen::solid(EDGE, 1.0),
        };
        let edges = || (0..8_usize).flat_map(|from| (0..3).filter(move |d| from >> d & 1 == 0).map(move |d| (from, d)));
        let hidden = |from: usize, d: usize| far.is_some_and(|far| from == far || from ^ (1 << d) == far);
        if self.ground {
            let points = [0, 1, 3, 2].map(|c| place(corners[c])).to_vec();
            out.push(Shape::Area { points, fill: GROUND, opacity: 1.0 });
        }
        out.extend(edges().filter(|e| hidden(e.0, e.1)).map(|e| edge(e.0, e.1)));
        out.push(Shape::Image { frame, raster: self.raster(&camera, (frame.width * DENSITY, frame.height * DENSITY)) });
        out.extend(edges().filter(|e| !hidden(e.0, e.1)).map(|e| edge(e.0, e.1)));
        self.words(cell, &frame, &corners.map(place), out);
        Ok(())
    }

    fn words(&self, cell: Frame, frame: &Frame, corners: &[(f64, f64); 8], out: &mut Vec<Shape>) {
        let middle = cell.left + cell.width / 2.0;
        out.push(label((middle, cell.top + 20.0), self.title.clone(), TICK_SIZE + 2.0, Anchor::Middle));
        // Axis names and the ends of the axes at the lowest edges in the picture; edges that share a corner keep apart.
        let along = |edge: &[(f64, f64); 2], share: f64| {
            (edge[0].0 + share * (edge[1].0 - edge[0].0), edge[0].1 + share * (edge[1].1 - edge[0].1))
        };
        for (d, name) in self.axes.iter().enumerate() {
            let edges =
                (0..8_usize).filter(|from| from >> d & 1 == 0).map(|from| [corners[from], corners[from ^ (1 << d)]]);
            let outermost = if d == 2 {
                edges.min_by(|a, b| along(a, 0.5).0.total_cmp(&along(b, 0.5).0))
            } else {
                edges.max_by(|a, b| along(a, 0.5).1.total_cmp(&along(b, 0.5).1))
            };
            let [low, high] = self.volume.corners_m().map(|end| format!("{:.1}", end[d]));
            for (share, text) in [(0.5, name.clone()), (0.08, low), (0.92, high)] {
                let Some((x, y)) = outermost.map(|edge| along(&edge, share)) else { continue };
                let at = if d == 2 { (x - 4.0, y) } else { (x, y + TICK_SIZE) };
                out.push(label(at, text, TICK_SIZE - 1.0, if d == 2 { Anchor::End } else { Anchor::Middle }));
            }
        }
        for (row, surface) in self.surfaces.iter().enumerate() {
            let (left, top) = (frame.left + 4.0, frame.top + 14.0 + 18.0 * row as f64);
            let points = vec![(left, top - 9.0), (left + 14.0, top - 9.0), (left + 14.0, top), (left, top)];
            out.push(Shape::Area { points, fill: surface.colour, opacity: surface.opacity.max(0.4) });
            out.push(label((left + 20.0, top), surface.name.clone(), TICK_SIZE - 1.0, Anchor::Start));
        }
    }

    /// The lit surfaces on a transparent ground.
    fn raster(&self, camera: &Camera, size: (f64, f64)) -> Raster {
        let (width, height) = ((size.0.round() as usize).max(1), (size.1.round() as usize).max(1));
        let levels: Vec<f64> = self.surfaces.iter().map(|s| s.level).collect();
        let mut rgba = vec![0; 4 * width * height];
        rgba.par_chunks_mut(4 * width).enumerate().for_each(|(row, pixels)| {
            for (column, pixel) in pixels.as_chunks_mut::<4>().0.iter_mut().enumerate() {
                let part = [(column as f64 + 0.5) / width as f64, 1.0 - (row as f64 + 0.5) / height as f64];
                let [a, b] = [0, 1].map(|i| {
                    let (low, high) = camera.range_m[i];
                    low + part[i] * (high - low)
                });
                let from = std::array::from_fn(|d| a * camera.right[d] + b * camera.up[d]);
                *pixel = self.pixel(camera, from, &levels);
            }
        });
        Raster { width: width as u32, height: height as u32, rgba }
    }

    fn pixel(&self, camera: &Camera, from_m: [f64; 3], levels: &[f64]) -> [u8; 4] {
        let mut light = [0.0; 3];
        let mut met = 0.0;
        self.volume.cast(from_m, camera.into, levels, |crossing| {
            let surface = &self.surfaces[crossing.level];
            let shade = self.shade(camera, crossing.normal);
            let share = (1.0 - met) * surface.opacity;
            for (sum, colour) in light.iter_mut().zip(surface.colour) {
                *sum += share * (f64::from(colour) * shade[0] + 255.0 * shade[1]).min(255.0);
            }
            met += share;
            met < OPAQUE
        });
        if met == 0.0 {
            return [0; 4];
        }
        let [r, g, b] = light.map(|sum| (sum / met).round() as u8);
        [r, g, b, (255.0 * met).round() as u8]
    }

    /// Share of the surface's colour and of white: a lamp above the eye's left shoulder; both sides of a surface are lit.
    fn shade(&self, camera: &Camera, normal: [f64; 3]) -> [f64; 2] {
        let lamp: [f64; 3] =
            std::array::from_fn(|d| -0.75 * camera.into[d] + 0.55 * camera.up[d] - 0.37 * camera.right[d]);
        let facing = if dot(normal, camera.into) > 0.0 { -1.0 } else { 1.0 };
        let lit = (facing * dot(normal, lamp)).max(0.0);
        [0.35 + 0.65 * lit, 0.35 * lit.powi(30)]
    }
}

#[cfg(test)]
mod tests {
    use super::super::volume::tests::cone;
    use super::super::{Figure, Panel};
    use super::*;
    use crate::io::provenance::example;

    fn plot(surfaces: &[(f64, Rgb, f64)]) -> IsosurfacePlot {
        let surface =
            |&(level, colour, opacity): &(f64, Rgb, f64)| Surface { level, colour, opacity, name: "r".into() };
        IsosurfacePlot {
            title: "sphere".into(),
            volume: Arc::new(cone(40)),
            surfaces: surfaces.iter().map(surface).collect(),
            view_rad: [-0.6, 0.4],
            axes: ["x", "y", "z"].map(String::from),
            ground: true,
        }
    }

    #[test]
    fn a_sphere_covers_the_area_of_its_shadow_and_hides_what_it_holds() {
        let blue = [0, 0, 200];
        let plot = plot(&[(-0.7, blue, 1.0), (-0.3, [200, 0, 0], 1.0)]);
        let camera = plot.camera();
        let [across, up] = camera.range_m.map(|(low, high)| high - low);
        let raster = plot.raster(&camera, (300.0, 300.0 * up / across));
        let pixels = raster.rgba.as_chunks::<4>().0;
        let covered = pixels.iter().filter(|p| p[3] == 255).count() as f64;
        let area_m2 = covered * (across / 300.0).powi(2);
        let shadow_m2 = std::f64::consts::PI * 0.49;
        assert!((area_m2 / shadow_m2 - 1.0).abs() < 0.01, "{area_m2} against {shadow_m2}");
        assert!(pixels.iter().all(|p| p[3] == 0 || p[2] > p[0]), "the inner sphere is not seen");
        // Light comes from above.
        let rows: Vec<&[[u8; 4]]> = pixels.chunks(raster.width as usize).collect();
        let row = |part: f64| rows[(part * rows.len() as f64) as usize][raster.width as usize / 2][2];
        assert!(row(0.4) > row(0.65), "{} {}", row(0.4), row(0.65));
    }

    #[test]
    fn a_half_transparent_surface_shows_what_it_holds() {
        let plot = plot(&[(-0.7, [0, 0, 200], 0.3), (-0.3, [200, 0, 0], 1.0)]);
        let raster = plot.raster(&plot.camera(), (120.0, 120.0));
        let centre = raster.rgba.as_chunks::<4>().0[60 * 120 + 60];
        assert!(centre[0] > centre[2] && centre[2] > 20 && centre[3] == 255, "{centre:?}");
    }

    #[test]
    fn a_panel_is_drawn_the_same_twice_and_wrong_surfaces_are_refused() {
        let figure = |plot: IsosurfacePlot| Figure::stacked([Panel::from(plot)]);
        let good = figure(plot(&[(-0.5, [0, 0, 200], 0.5)]));
        assert_eq!(good.png(&example()).unwrap(), good.png(&example()).unwrap());
        assert!(good.svg(&example()).unwrap().contains("<image"));
        assert!(figure(plot(&[(f64::NAN, [0, 0, 0], 1.0)])).png(&example()).is_err());
        assert!(figure(plot(&[(-0.5, [0, 0, 0], 2.0)])).png(&example()).is_err());
    }
}
