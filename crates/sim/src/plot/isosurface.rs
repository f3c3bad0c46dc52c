//! Surfaces of equal value of a field in space, lit and half transparent, in a box seen from aside without perspective.
//!
//! The field is on a rectilinear mesh; between its points it is the trilinear interpolant. A ray goes from cell to cell; in those whose
//! corners are not all on one side of a level its crossings are found by steps and bisection. Rays need no list of triangles, and the
//! surfaces are those of the interpolant itself.
//! Check: a sphere covers the area of its shadow; the opaque surface hides the one behind; the same bytes twice; the interpolant is
//! exact for products of lines; a sphere is met at its radius with its own normal; small steps along a ray find no other crossings.

use super::axis::extremes;
use super::colour::Rgb;
use super::drawing::{Anchor, Frame, Shape};
use super::frame::{TICK_SIZE, top_room};
use super::png_file::pixels;
use crate::Error;
use crate::io::{increasing, same_length};
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

/// The axis along which an edge of the box lies, and its corners.
type Edge = (usize, usize, usize);

/// A point of an edge in the picture.
fn point_on_edge(corners: &[(f64, f64); 8], (_, a, b): Edge, fraction: f64) -> (f64, f64) {
    let a = corners[a];
    let b = corners[b];
    (a.0 + fraction * (b.0 - a.0), a.1 + fraction * (b.1 - a.1))
}

/// A point of a ray at a distance \[m\].
fn point_on_ray(from_m: [f64; 3], along: [f64; 3], distance_m: f64) -> [f64; 3] {
    [0, 1, 2].map(|d| from_m[d] + distance_m * along[d])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl IsosurfacePlot {
    fn camera(&self) -> Camera {
        let [(sa, ca), (se, ce)] = self.view_rad.map(f64::sin_cos);
        let right = [-sa, ca, 0.0];
        let up = [-se * ca, -se * sa, ce];
        let range_m = [right, up]
            .map(|axis| extremes(self.corners_m().into_iter().map(|corner| dot(corner, axis))));
        Camera {
            right,
            up,
            into: [-ce * ca, -ce * sa, -se],
            range_m,
        }
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

    pub(crate) fn draw(&self, cell: Frame, out: &mut Vec<Shape>) -> Result<(), Error> {
        self.check_surfaces()?;
        let camera = self.camera();
        let scale = self.scale(&camera, cell);
        let [across, up] = camera.size_m();
        let frame = Frame {
            left: cell.left + 0.5 * (cell.width - scale * across),
            top: cell.top + top_room(&self.title) + 0.5 * MARGIN,
            width: scale * across,
            height: scale * up,
        };
        let corners = self.corners(&camera, frame, scale);
        // The corner farthest from the eye has the hidden edges.
        let corners_m = self.corners_m();
        let depths_m = corners_m.map(|corner_m| dot(corner_m, camera.into));
        let far = (0..8).max_by(|a, b| depths_m[*a].total_cmp(&depths_m[*b]));
        let mut hidden = Vec::new();
        let mut visible = Vec::new();
        for axis in 0..3 {
            for from in (0..8).filter(|from| from >> axis & 1 == 0) {
                let to = from | 1 << axis;
                match far == Some(from) || far == Some(to) {
                    true => hidden.push((axis, from, to)),
                    false => visible.push((axis, from, to)),
                }
            }
        }
        out.push(Shape::area(
            [0, 1, 3, 2].map(|corner| corners[corner]),
            GROUND,
        ));
        for (_, a, b) in &hidden {
            out.push(Shape::line([corners[*a], corners[*b]], EDGE, 1.0));
        }
        let size =
            [frame.width, frame.height].map(|length| ((length * DENSITY).round() as u32).max(1));
        out.push(Shape::Image {
            frame,
            pixels: self.pixels(&camera, size)?,
        });
        for (_, a, b) in &visible {
            out.push(Shape::line([corners[*a], corners[*b]], EDGE, 1.0));
        }
        let middle = cell.left + cell.width / 2.0;
        out.push(Shape::text(
            (middle, cell.top + 20.0),
            &self.title,
            TICK_SIZE + 2.0,
            Anchor::Middle,
        ));
        self.label_axes(&corners, &[hidden, visible].concat(), out);
        self.draw_legend(frame, out);
        Ok(())
    }

    fn check_surfaces(&self) -> Result<(), Error> {
        for surface in &self.surfaces {
            if !(surface.level.is_finite() && (0.0..=1.0).contains(&surface.opacity)) {
                return Err(Error::value(
                    "surface",
                    format!("level {}, opacity {}", surface.level, surface.opacity),
                    "a finite level, opacity 0 to 1",
                ));
            }
        }
        Ok(())
    }

    /// Drawing units per metre that let the box fill its cell.
    fn scale(&self, camera: &Camera, cell: Frame) -> f64 {
        let [across, up] = camera.size_m();
        let width = cell.width - 2.0 * MARGIN;
        let height = cell.height - 2.0 * MARGIN - top_room(&self.title);
        (width / across).min(height / up)
    }

    /// The corners of the box in its picture.
    fn corners(&self, camera: &Camera, frame: Frame, scale: f64) -> [(f64, f64); 8] {
        let [(left_m, _), (low_m, _)] = camera.range_m;
        self.corners_m().map(|at_m| {
            let x_m = dot(at_m, camera.right) - left_m;
            let y_m = dot(at_m, camera.up) - low_m;
            (frame.left + scale * x_m, frame.bottom() - scale * y_m)
        })
    }

    /// Names and ends of the axes at the lowest edges in the picture, of the vertical one at the leftmost; edges that share a corner
    /// keep apart.
    fn label_axes(&self, corners: &[(f64, f64); 8], edges: &[Edge], out: &mut Vec<Shape>) {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let mut outermost = None;
            let mut largest = f64::NEG_INFINITY;
            for edge in edges.iter().filter(|edge| edge.0 == axis) {
                let (x, y) = point_on_edge(corners, *edge, 0.5);
                let outward = if axis == 2 { -x } else { y };
                if outward >= largest {
                    outermost = Some(*edge);
                    largest = outward;
                }
            }
            let Some(edge) = outermost else {
                continue;
            };
            let [low, high] = self
                .volume
                .corners_m()
                .map(|end| format!("{:.1}", end[axis]));
            for (fraction, text) in [(0.5, name), (0.08, &low), (0.92, &high)] {
                let (x, y) = point_on_edge(corners, edge, fraction);
                out.push(match axis {
                    2 => Shape::text((x - 4.0, y), text, TICK_SIZE - 1.0, Anchor::End),
                    _ => Shape::text((x, y + TICK_SIZE), text, TICK_SIZE - 1.0, Anchor::Middle),
                });
            }
        }
    }

    /// The levels of the surfaces in their colours.
    fn draw_legend(&self, frame: Frame, out: &mut Vec<Shape>) {
        for (row, surface) in self.surfaces.iter().enumerate() {
            let left = frame.left + 4.0;
            let bottom = frame.top + 14.0 + 18.0 * row as f64;
            let points = Frame {
                left,
                top: bottom - 9.0,
                width: 14.0,
                height: 9.0,
            }
            .outline();
            out.push(Shape::Area {
                points,
                fill: surface.colour,
                opacity: surface.opacity.max(0.4),
            });
            out.push(Shape::text(
                (left + 20.0, bottom),
                &surface.level.to_string(),
                TICK_SIZE - 1.0,
                Anchor::Start,
            ));
        }
    }

    /// The lit surfaces on a transparent ground.
    fn pixels(&self, camera: &Camera, [width, height]: [u32; 2]) -> Result<Pixmap, Error> {
        let levels: Vec<f64> = self.surfaces.iter().map(|s| s.level).collect();
        let mut rgba = vec![0; 4 * width as usize * height as usize];
        rgba.as_chunks_mut::<4>()
            .0
            .par_iter_mut()
            .enumerate()
            .for_each(|(place, pixel)| {
                let row = place / width as usize;
                let column = place % width as usize;
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
        let lamp: [f64; 3] = std::array::from_fn(|d| {
            -0.75 * camera.into[d] + 0.55 * camera.up[d] - 0.37 * camera.right[d]
        });
        let mut met = [0.0; 4];
        self.volume
            .cast(from_m, camera.into, levels, |_, level, normal| {
                let surface = &self.surfaces[level];
                // Both sides of a surface are lit.
                let facing = if dot(normal, camera.into) > 0.0 {
                    -1.0
                } else {
                    1.0
                };
                let lit = (facing * dot(normal, lamp)).max(0.0);
                let share = (1.0 - met[3]) * surface.opacity;
                for (sum, colour) in met.iter_mut().zip(surface.colour) {
                    let light =
                        f64::from(colour) / 255.0 * (0.35 + 0.65 * lit) + 0.35 * lit.powi(30);
                    *sum += share * light.min(1.0);
                }
                met[3] += share;
                met[3] < OPAQUE
            });
        met.map(|part| (255.0 * part).round() as u8)
    }
}

/// A field on a rectilinear mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    /// Positions of the points along x, y, z \[m\], increasing, at least two each.
    pub axis_m: [Vec<f64>; 3],
    /// Values `[k][j][i]`, x fastest.
    pub values: Vec<f32>,
}

/// Whether the corners of a cell are on both sides of a level.
fn is_crossed(corners: &[f64; 8], level: f64) -> bool {
    corners.iter().any(|v| (*v < level) != (corners[0] < level))
}

fn between(a: f64, b: f64, fraction: f64) -> f64 {
    a + fraction * (b - a)
}

/// Steps of a ray through a cell: along it the interpolant is a polynomial of third degree.
const STEPS: u32 = 4;
const BISECTIONS: usize = 10;

impl Volume {
    /// A field with the values in the order z, y, x, x fastest.
    ///
    /// # Errors
    /// Axes with fewer than two points or that do not increase, another number of values than points.
    pub fn new(axis_m: [Vec<f64>; 3], values: Vec<f32>) -> Result<Self, Error> {
        for (name, axis) in ["x axis", "y axis", "z axis"].into_iter().zip(&axis_m) {
            increasing(name, axis)?;
            if axis.len() < 2 {
                return Err(Error::value(name, axis.len(), "at least two positions"));
            }
        }
        same_length(
            "values",
            values.len(),
            "the points",
            axis_m.iter().map(Vec::len).product(),
        )?;
        Ok(Self { axis_m, values })
    }

    /// Low and high corner \[m\].
    fn corners_m(&self) -> [[f64; 3]; 2] {
        [
            self.axis_m.each_ref().map(|axis| axis[0]),
            self.axis_m.each_ref().map(|axis| axis[axis.len() - 1]),
        ]
    }

    /// The cell of a position, the nearest one outside.
    fn cell(&self, at_m: [f64; 3]) -> [usize; 3] {
        std::array::from_fn(|d| {
            let axis = &self.axis_m[d];
            axis.partition_point(|a| *a <= at_m[d])
                .clamp(1, axis.len() - 1)
                - 1
        })
    }

    /// Values at the corners of a cell, x fastest.
    fn corners(&self, [i, j, k]: [usize; 3]) -> [f32; 8] {
        let [nx, ny, _] = self.axis_m.each_ref().map(Vec::len);
        let a = (k * ny + j) * nx + i;
        let b = a + nx;
        let c = a + ny * nx;
        let d = c + nx;
        [a, a + 1, b, b + 1, c, c + 1, d, d + 1].map(|place| self.values[place])
    }

    /// The interpolant of a cell; positions outside are moved to its nearest face.
    fn within(&self, cell: [usize; 3], at_m: [f64; 3]) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|d| {
            let low = self.axis_m[d][cell[d]];
            let high = self.axis_m[d][cell[d] + 1];
            ((at_m[d] - low) / (high - low)).clamp(0.0, 1.0)
        });
        let [a, b, c, d, e, f, g, h] = self.corners(cell).map(f64::from);
        let low = between(between(a, b, x), between(c, d, x), y);
        let high = between(between(e, f, x), between(g, h, x), y);
        between(low, high, z)
    }

    /// The interpolant; positions outside are moved to the nearest face.
    fn at(&self, at_m: [f64; 3]) -> f64 {
        self.within(self.cell(at_m), at_m)
    }

    /// Where the ray `from + t along` enters and leaves the mesh.
    fn span_m(&self, from_m: [f64; 3], along: [f64; 3]) -> Option<(f64, f64)> {
        let [low, high] = self.corners_m();
        let mut span = (f64::NEG_INFINITY, f64::INFINITY);
        for d in 0..3 {
            if along[d].abs() < 1e-12 {
                if from_m[d] < low[d] || from_m[d] > high[d] {
                    return None;
                }
                continue;
            }
            let a = (low[d] - from_m[d]) / along[d];
            let b = (high[d] - from_m[d]) / along[d];
            span = (span.0.max(a.min(b)), span.1.min(a.max(b)));
        }
        (span.0 < span.1).then_some(span)
    }

    /// Calls `met` for each crossing of a level along the ray, in order, until it returns false: with its distance along the ray \[m\],
    /// the number of the level, and the unit normal of the surface, down the gradient.
    fn cast(
        &self,
        from_m: [f64; 3],
        along: [f64; 3],
        levels: &[f64],
        mut met: impl FnMut(f64, usize, [f64; 3]) -> bool,
    ) {
        let Some((mut start, end)) = self.span_m(from_m, along) else {
            return;
        };
        let mut cell = self.cell(point_on_ray(from_m, along, start));
        while start < end {
            // The face through which the ray leaves the cell.
            let mut leaves = (end, 0);
            for d in 0..3 {
                let face =
                    (self.axis_m[d][cell[d] + usize::from(along[d] > 0.0)] - from_m[d]) / along[d];
                if along[d].abs() >= 1e-12 && face < leaves.0 {
                    leaves = (face.max(start), d);
                }
            }
            let corners = self.corners(cell).map(f64::from);
            if levels.iter().any(|level| is_crossed(&corners, *level)) {
                let part = (start, leaves.0);
                for (at_m, level) in self.crossings(cell, from_m, along, part, levels) {
                    let normal = self.normal(point_on_ray(from_m, along, at_m));
                    if !met(at_m, level, normal) {
                        return;
                    }
                }
            }
            let through = leaves.1;
            let last = self.axis_m[leaves.1].len() - 2;
            match along[through] > 0.0 {
                true if cell[through] < last => cell[through] += 1,
                false if cell[through] > 0 => cell[through] -= 1,
                _ => return,
            }
            start = leaves.0;
        }
    }

    /// Crossings of the levels in the part of a ray in a cell, in order.
    fn crossings(
        &self,
        cell: [usize; 3],
        from_m: [f64; 3],
        along: [f64; 3],
        (start, end): (f64, f64),
        levels: &[f64],
    ) -> Vec<(f64, usize)> {
        let mut found = Vec::new();
        for step in 0..STEPS {
            for (index, level) in levels.iter().enumerate() {
                let mut low = start + f64::from(step) / f64::from(STEPS) * (end - start);
                let mut high = start + f64::from(step + 1) / f64::from(STEPS) * (end - start);
                let is_below = self.within(cell, point_on_ray(from_m, along, low)) < *level;
                if is_below == (self.within(cell, point_on_ray(from_m, along, high)) < *level) {
                    continue;
                }
                for _ in 0..BISECTIONS {
                    let middle = 0.5 * (low + high);
                    let value = self.within(cell, point_on_ray(from_m, along, middle));
                    match (value < *level) == is_below {
                        true => low = middle,
                        false => high = middle,
                    }
                }
                found.push((0.5 * (low + high), index));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    }

    /// Unit vector down the gradient, by differences over two cells; the upright one where there is none.
    fn normal(&self, at_m: [f64; 3]) -> [f64; 3] {
        let cell = self.cell(at_m);
        let slope: [f64; 3] = std::array::from_fn(|d| {
            let reach_m = self.axis_m[d][cell[d] + 1] - self.axis_m[d][cell[d]];
            let mut low = at_m;
            let mut high = at_m;
            low[d] -= reach_m;
            high[d] += reach_m;
            (self.at(low) - self.at(high)) / reach_m
        });
        let length = slope.iter().map(|s| s * s).sum::<f64>().sqrt();
        if length > 0.0 {
            slope.map(|s| s / length)
        } else {
            [0.0, 0.0, 1.0]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Figure, Panel};
    use super::volume_tests::cone;
    use super::*;
    use crate::io::provenance::example;

    fn plot(surfaces: &[(f64, Rgb, f64)]) -> IsosurfacePlot {
        let surface = |&(level, colour, opacity): &(f64, Rgb, f64)| Surface {
            level,
            colour,
            opacity,
        };
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
        let picture = plot
            .pixels(&camera, [300, (300.0 * up / across).round() as u32])
            .unwrap();
        let pixels = picture.data().as_chunks::<4>().0;
        let covered = pixels.iter().filter(|p| p[3] == 255).count() as f64;
        let area_m2 = covered * (across / 300.0).powi(2);
        let shadow_m2 = std::f64::consts::PI * 0.49;
        assert!(
            (area_m2 / shadow_m2 - 1.0).abs() < 0.01,
            "{area_m2} against {shadow_m2}"
        );
        assert!(
            pixels.iter().all(|p| p[3] == 0 || p[2] > p[0]),
            "the inner sphere is not seen"
        );
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
        assert!(
            centre[0] > centre[2] && centre[2] > 20 && centre[3] == 255,
            "{centre:?}"
        );
    }

    #[test]
    fn a_panel_is_drawn_the_same_twice_and_wrong_surfaces_are_refused() {
        let figure = |plot: IsosurfacePlot| Figure::stacked([Panel::Surfaces(plot)]);
        let good = figure(plot(&[(-0.5, [0, 0, 200], 0.5)]));
        assert_eq!(good.png(&example()).unwrap(), good.png(&example()).unwrap());
        assert!(good.svg(&example()).unwrap().contains("<image"));
        assert!(
            figure(plot(&[(f64::NAN, [0, 0, 0], 1.0)]))
                .png(&example())
                .is_err()
        );
        assert!(
            figure(plot(&[(-0.5, [0, 0, 0], 2.0)]))
                .png(&example())
                .is_err()
        );
    }
}

#[cfg(test)]
mod volume_tests {
    use super::*;

    fn axis(n: usize, stretch: f64) -> Vec<f64> {
        (0..n)
            .map(|i| i as f64 / (n - 1) as f64)
            .map(|s| -1.0 + 2.0 * s.powf(stretch))
            .collect()
    }

    /// Minus the distance from the origin.
    pub(super) fn cone(n: usize) -> Volume {
        let axes = [axis(n, 1.0), axis(n + 5, 1.1), axis(n + 9, 0.9)];
        let mut values = Vec::new();
        for z in &axes[2] {
            for y in &axes[1] {
                for x in &axes[0] {
                    values.push(-(x * x + y * y + z * z).sqrt() as f32);
                }
            }
        }
        Volume::new(axes, values).unwrap()
    }

    #[test]
    fn the_interpolant_is_exact_for_products_of_lines_on_unequal_steps() {
        let axes = [axis(5, 1.0), axis(7, 1.7), axis(9, 0.6)];
        let field = |x: f64, y: f64, z: f64| (1.0 + x) * (2.0 - y) * (0.5 + z);
        let mut values = Vec::new();
        for z in &axes[2] {
            for y in &axes[1] {
                values.extend(axes[0].iter().map(|x| field(*x, *y, *z) as f32));
            }
        }
        let volume = Volume::new(axes, values).unwrap();
        for i in 0..200 {
            let [x, y, z] = [0.618, 0.755, 0.57].map(|step| -1.0 + 2.0 * (i as f64 * step).fract());
            assert!(
                (volume.at([x, y, z]) - field(x, y, z)).abs() < 1e-6,
                "{x} {y} {z}"
            );
        }
        assert!(
            (volume.at([9.0, 9.0, 9.0]) - field(1.0, 1.0, 1.0)).abs() < 1e-6,
            "outside: the nearest face"
        );
    }

    #[test]
    fn rays_meet_a_sphere_at_its_radius_with_its_normal() {
        let volume = cone(60);
        let along = [0.6, 0.48, -0.64];
        let from = [-1.8 + 0.1, -1.44, 1.92];
        let mut met = Vec::new();
        volume.cast(from, along, &[-0.5, -0.8], |at_m, level, normal| {
            met.push((at_m, level, normal));
            true
        });
        assert_eq!(met.iter().map(|c| c.1).collect::<Vec<_>>(), [1, 0, 0, 1]);
        for (at_m, level, normal) in met {
            let radius = [0.5, 0.8][level];
            let at: Vec<f64> = (0..3).map(|d| from[d] + at_m * along[d]).collect();
            let distance = at.iter().map(|a| a * a).sum::<f64>().sqrt();
            assert!((distance - radius).abs() < 1e-3, "{distance} for {radius}");
            let cosine: f64 = (0..3).map(|d| normal[d] * at[d] / distance).sum();
            assert!(cosine > 0.999, "{cosine}");
        }
    }

    #[test]
    fn small_steps_along_a_ray_find_the_same_crossings() {
        let volume = cone(37);
        let levels = [-0.5, -0.8, -1.1];
        let mut all = 0;
        for ray in 0..200 {
            let [a, b, c] =
                [0.618, 0.755, 0.57].map(|part| 2.0 * (f64::from(ray) * part).fract() - 1.0);
            let length = (a * a + b * b + 1.0_f64).sqrt();
            let along = [
                a / length,
                b / length,
                if ray % 2 == 0 { 1.0 } else { -1.0 } / length,
            ];
            let from = [c, -a, 0.3 * b];
            let mut met = Vec::new();
            volume.cast(from, along, &levels, |at_m, level, _| {
                met.push((level, at_m));
                true
            });
            let Some((start, end)) = volume.span_m(from, along) else {
                assert!(met.is_empty());
                continue;
            };
            let at = |step: u32| start + f64::from(step) * 1e-3 * (end - start);
            let value =
                |step: u32| volume.at(std::array::from_fn(|d| from[d] + at(step) * along[d]));
            let values: Vec<f64> = (0..=1000).map(value).collect();
            let mut expected = Vec::new();
            for (step, pair) in (0..).zip(values.windows(2)) {
                let crossed = levels
                    .iter()
                    .enumerate()
                    .filter(|(_, wanted)| (pair[0] < **wanted) != (pair[1] < **wanted));
                expected.extend(crossed.map(|(level, _)| (level, at(step))));
            }
            assert_eq!(met.len(), expected.len(), "ray {ray}");
            for ((level, at_m), (expected, from_m)) in met.iter().zip(&expected) {
                let near = (from_m - 1e-9..=from_m + 1.001e-3 * (end - start)).contains(at_m);
                assert!(
                    level == expected && near,
                    "ray {ray}: {at_m} after {from_m}"
                );
            }
            all += met.len();
        }
        assert!(all > 300, "{all}");
    }

    #[test]
    fn axes_and_values_that_do_not_fit_are_refused() {
        let line = || vec![0.0, 1.0];
        assert!(Volume::new([line(), line(), vec![0.0]], vec![0.0; 4]).is_err());
        assert!(Volume::new([line(), line(), vec![1.0, 0.0]], vec![0.0; 8]).is_err());
        assert!(Volume::new([line(), line(), line()], vec![0.0; 7]).is_err());
    }
}
