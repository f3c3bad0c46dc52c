//! Surfaces of equal value of a field in space, lit and half transparent, in a box seen from aside without perspective.
//! Check: a sphere covers the area of its shadow; the opaque surface hides the one behind; the same bytes twice.

use super::axis::extremes;
use super::colour::Rgb;
use super::drawing::{Anchor, Frame, Shape};
use super::frame::{TICK_SIZE, top_room};
use super::png_file::pixels;
use super::volume::Volume;
use crate::io::{OutputError, OutputResult};
use rayon::prelude::*;
use tiny_skia::Pixmap;

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
}

/// Surfaces of one field to draw.
#[derive(Debug, Clone, PartialEq)]
pub struct IsosurfacePlot {
    /// Title above the panel.
    pub title: String,
    /// The field.
    pub volume: Volume,
    /// The surfaces.
    pub surfaces: Vec<Surface>,
    /// From where it is seen: angle from the x axis in the horizontal plane, and above it \[rad\].
    pub view_rad: [f64; 2],
}

/// Directions of the picture: to the right, up, and into it.
struct Camera {
    right: [f64; 3],
    up: [f64; 3],
    into: [f64; 3],
    /// Smallest and largest coordinate to the right and up \[m\].
    range_m: [(f64, f64); 2],
}

impl Camera {
    /// Width and height of the picture \[m\].
    fn size_m(&self) -> [f64; 2] {
        self.range_m.map(|(low, high)| high - low)
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl IsosurfacePlot {
    fn camera(&self) -> Camera {
        let [(sa, ca), (se, ce)] = self.view_rad.map(f64::sin_cos);
        let (right, up) = ([-sa, ca, 0.0], [-se * ca, -se * sa, ce]);
        let range_m = [right, up].map(|axis| extremes(self.corners_m().into_iter().map(|corner| dot(corner, axis))));
        Camera { right, up, into: [-ce * ca, -ce * sa, -se], range_m }
    }

    /// The eight corners; bit `d` of the place says which end of axis `d`.
    fn corners_m(&self) -> [[f64; 3]; 8] {
        let ends = self.volume.corners_m();
        std::array::from_fn(|place| std::array::from_fn(|d| ends[place >> d & 1][d]))
    }

    pub(crate) fn height(&self, width: f64) -> f64 {
        let [across, up] = self.camera().size_m();
        let inner = (width - 2.0 * MARGIN) * up / across;
        inner.clamp(60.0, 1.5 * width) + 2.0 * MARGIN + top_room(&self.title)
    }

    pub(crate) fn draw(&self, cell: Frame, out: &mut Vec<Shape>) -> OutputResult<()> {
        for surface in &self.surfaces {
            if !(surface.level.is_finite() && (0.0..=1.0).contains(&surface.opacity)) {
                let value = format!("level {}, opacity {}", surface.level, surface.opacity);
                return Err(OutputError::value("surface", value, "a finite level, opacity 0 to 1"));
            }
        }
        let camera = self.camera();
        let [across, up] = camera.size_m();
        let room = (cell.width - 2.0 * MARGIN, cell.height - 2.0 * MARGIN - top_room(&self.title));
        let scale = (room.0 / across).min(room.1 / up);
        let frame = Frame {
            left: cell.left + 0.5 * (cell.width - scale * across),
            top: cell.top + top_room(&self.title) + 0.5 * MARGIN,
            width: scale * across,
            height: scale * up,
        };
        let [left_m, low_m] = camera.range_m.map(|range| range.0);
        let corners_m = self.corners_m();
        let corners = corners_m.map(|at_m| {
            let (x_m, y_m) = (dot(at_m, camera.right) - left_m, dot(at_m, camera.up) - low_m);
            (frame.left + scale * x_m, frame.bottom() - scale * y_m)
        });
        // Of each edge the axis that it lies along, and its ends.
        let edges = (0..3)
            .flat_map(|d| (0..8).filter(move |from| from >> d & 1 == 0).map(move |from| (d, from, from | 1 << d)));
        // The corner farthest from the eye has the hidden edges.
        let depth_m = |corner: &usize| dot(corners_m[*corner], camera.into);
        let far = (0..8).max_by(|a, b| depth_m(a).total_cmp(&depth_m(b)));
        let (hidden, seen): (Vec<_>, Vec<_>) = edges.partition(|(_, a, b)| far == Some(*a) || far == Some(*b));
        let lines = |edges: &[(usize, usize, usize)]| -> Vec<Shape> {
            edges.iter().map(|(_, a, b)| Shape::line([corners[*a], corners[*b]], EDGE, 1.0)).collect()
        };
        out.push(Shape::area([0, 1, 3, 2].map(|corner| corners[corner]), GROUND));
        out.extend(lines(&hidden));
        let size = [frame.width, frame.height].map(|length| ((length * DENSITY).round() as u32).max(1));
        out.push(Shape::Image { frame, pixels: self.pixels(&camera, size)? });
        out.extend(lines(&seen));
        let middle = cell.left + cell.width / 2.0;
        out.push(Shape::text((middle, cell.top + 20.0), &self.title, TICK_SIZE + 2.0, Anchor::Middle));
        // Names and ends of the axes at the lowest edges in the picture, of the vertical one at the leftmost; edges that share a corner
        // keep apart.
        let along = |(_, a, b): &(usize, usize, usize), share: f64| {
            let (a, b) = (corners[*a], corners[*b]);
            (a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1))
        };
        for (d, name) in ["x", "y", "z"].into_iter().enumerate() {
            let outward = |edge: &(usize, usize, usize)| if d == 2 { -along(edge, 0.5).0 } else { along(edge, 0.5).1 };
            let of_axis = hidden.iter().chain(&seen).filter(|edge| edge.0 == d);
            let Some(edge) = of_axis.max_by(|a, b| outward(a).total_cmp(&outward(b))) else { continue };
            let [low, high] = self.volume.corners_m().map(|end| format!("{:.1}", end[d]));
            for (share, text) in [(0.5, name), (0.08, &low), (0.92, &high)] {
                let (x, y) = along(edge, share);
                out.push(match d {
                    2 => Shape::text((x - 4.0, y), text, TICK_SIZE - 1.0, Anchor::End),
                    _ => Shape::text((x, y + TICK_SIZE), text, TICK_SIZE - 1.0, Anchor::Middle),
                });
            }
        }
        for (row, surface) in self.surfaces.iter().enumerate() {
            let (left, bottom) = (frame.left + 4.0, frame.top + 14.0 + 18.0 * row as f64);
            let points = Frame { left, top: bottom - 9.0, width: 14.0, height: 9.0 }.outline();
            out.push(Shape::Area { points, fill: surface.colour, opacity: surface.opacity.max(0.4) });
            out.push(Shape::text((left + 20.0, bottom), &surface.level.to_string(), TICK_SIZE - 1.0, Anchor::Start));
        }
        Ok(())
    }

    /// The lit surfaces on a transparent ground.
    fn pixels(&self, camera: &Camera, [width, height]: [u32; 2]) -> OutputResult<Pixmap> {
        let levels: Vec<f64> = self.surfaces.iter().map(|s| s.level).collect();
        let mut rgba = vec![0; 4 * width as usize * height as usize];
        rgba.as_chunks_mut::<4>().0.par_iter_mut().enumerate().for_each(|(place, pixel)| {
            let (row, column) = (place / width as usize, place % width as usize);
            let [(left_m, _), (_, top_m)] = camera.range_m;
            let [across_m, up_m] = camera.size_m();
            let a = left_m + (column as f64 + 0.5) / f64::from(width) * across_m;
            let b = top_m - (row as f64 + 0.5) / f64::from(height) * up_m;
            let from_m = std::array::from_fn(|d| a * camera.right[d] + b * camera.up[d]);
            *pixel = self.pixel(camera, from_m, &levels);
        });
        pixels(width, height, rgba)
    }

    /// What a ray gathers of surfaces that let some of the light pass: colours times the opacity, and the opacity.
    fn pixel(&self, camera: &Camera, from_m: [f64; 3], levels: &[f64]) -> [u8; 4] {
        // A lamp above the eye's left shoulder.
        let lamp: [f64; 3] =
            std::array::from_fn(|d| -0.75 * camera.into[d] + 0.55 * camera.up[d] - 0.37 * camera.right[d]);
        let mut met = [0.0; 4];
        self.volume.cast(from_m, camera.into, levels, |_, level, normal| {
            let surface = &self.surfaces[level];
            // Both sides of a surface are lit.
            let facing = if dot(normal, camera.into) > 0.0 { -1.0 } else { 1.0 };
            let lit = (facing * dot(normal, lamp)).max(0.0);
            let share = (1.0 - met[3]) * surface.opacity;
            for (sum, colour) in met.iter_mut().zip(surface.colour) {
                let light = f64::from(colour) / 255.0 * (0.35 + 0.65 * lit) + 0.35 * lit.powi(30);
                *sum += share * light.min(1.0);
            }
            met[3] += share;
            met[3] < OPAQUE
        });
        met.map(|part| (255.0 * part).round() as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::super::volume::tests::cone;
    use super::super::{Figure, Panel};
    use super::*;
    use crate::io::provenance::example;

    fn plot(surfaces: &[(f64, Rgb, f64)]) -> IsosurfacePlot {
        let surface = |&(level, colour, opacity): &(f64, Rgb, f64)| Surface { level, colour, opacity };
        IsosurfacePlot {
            title: "sphere".into(),
            volume: cone(40),
            surfaces: surfaces.iter().map(surface).collect(),
            view_rad: [-0.6, 0.4],
        }
    }

    #[test]
    fn a_sphere_covers_the_area_of_its_shadow_and_hides_what_it_holds() {
        let blue = [0, 0, 200];
        let plot = plot(&[(-0.7, blue, 1.0), (-0.3, [200, 0, 0], 1.0)]);
        let camera = plot.camera();
        let [across, up] = camera.size_m();
        let picture = plot.pixels(&camera, [300, (300.0 * up / across).round() as u32]).unwrap();
        let pixels = picture.data().as_chunks::<4>().0;
        let covered = pixels.iter().filter(|p| p[3] == 255).count() as f64;
        let area_m2 = covered * (across / 300.0).powi(2);
        let shadow_m2 = std::f64::consts::PI * 0.49;
        assert!((area_m2 / shadow_m2 - 1.0).abs() < 0.01, "{area_m2} against {shadow_m2}");
        assert!(pixels.iter().all(|p| p[3] == 0 || p[2] > p[0]), "the inner sphere is not seen");
        // Light comes from above.
        let rows: Vec<&[[u8; 4]]> = pixels.chunks(300).collect();
        let row = |part: f64| rows[(part * rows.len() as f64) as usize][150][2];
        assert!(row(0.4) > row(0.65), "{} {}", row(0.4), row(0.65));
    }

    #[test]
    fn a_half_transparent_surface_shows_what_it_holds() {
        let plot = plot(&[(-0.7, [0, 0, 200], 0.3), (-0.3, [200, 0, 0], 1.0)]);
        let picture = plot.pixels(&plot.camera(), [120, 120]).unwrap();
        let centre = picture.data().as_chunks::<4>().0[60 * 120 + 60];
        assert!(centre[0] > centre[2] && centre[2] > 20 && centre[3] == 255, "{centre:?}");
    }

    #[test]
    fn a_panel_is_drawn_the_same_twice_and_wrong_surfaces_are_refused() {
        let figure = |plot: IsosurfacePlot| Figure::stacked([Panel::Surfaces(plot)]);
        let good = figure(plot(&[(-0.5, [0, 0, 200], 0.5)]));
        assert_eq!(good.png(&example()).unwrap(), good.png(&example()).unwrap());
        assert!(good.svg(&example()).unwrap().contains("<image"));
        assert!(figure(plot(&[(f64::NAN, [0, 0, 0], 1.0)])).png(&example()).is_err());
        assert!(figure(plot(&[(-0.5, [0, 0, 0], 2.0)])).png(&example()).is_err());
    }
}
