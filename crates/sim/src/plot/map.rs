//! One field of a sweep as a picture over distance and height in metres, with equal scales, colour bar, ground and lidar.
//!
//! Each pixel of a picture in metres takes the value of the cell that it lies in, polar (ray, gate) or rectangular. Cells reach half-way
//! to their neighbours; the outer ones as far outward as inward.
//! Check: the colour map is chosen from the field (symmetric for velocities), and the panel's height follows the scan's shape; the
//! centre of every cell finds its own value, upward is up and away from the lidar is right.

use super::axis::{Scale, extremes};
use super::colour::{ColourMap, Rgb};
use super::drawing::{Anchor, Frame, INK, Shape};
use super::font::Font;
use super::frame::{BOTTOM, LEFT, Side, TICK_SIZE, axis, inner, panel, top_room};
use super::png_file::pixels;
use crate::Error;
use crate::beams::SweepMode;
use crate::io::{Unit, VelocityMap};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use tiny_skia::Pixmap;

/// Room to the right of the box, for the colour bar and its label.
const RIGHT: f64 = 118.0;
/// Pixels of the embedded picture per drawing unit: cell edges stay sharp when the picture is enlarged.
const DENSITY: f64 = 2.0;
const GROUND: Rgb = [222, 211, 196];
/// Pixels of the colour bar; wide enough that a viewer's smoothing stays at the rim.
const BAR: (u32, u32) = (36, 256);

/// A map to draw.
#[derive(Debug, Clone, PartialEq)]
pub struct MapPlot {
    /// Title above the panel.
    pub title: String,
    /// Label of the colour bar, with the unit.
    pub bar_label: String,
    /// Colours and their range.
    pub colours: ColourMap,
    /// Cells and values.
    pub cells: Cells,
    /// Whether the lidar and its way to the first gate are in the picture.
    pub show_lidar: bool,
    /// Points (y, z) in metres to mark, such as vortex centres.
    pub points_m: Vec<(f64, f64)>,
    /// Whether it is seen from above, along the flight upwards, and not from the side with the ground below.
    pub from_above: bool,
}

impl MapPlot {
    /// The picture of a field of sweep `sweep`, one of azimuth as seen from above. Fields named `v_...`, `radial_velocity` and `bias` get
    /// symmetric colours, others light to dark; the limits are those of the sweep. The lidar is shown where it is less than
    /// half the width of the scan away.
    ///
    /// # Errors
    /// What [`VelocityMap::check`] finds, no such sweep or field.
    pub fn new(map: &VelocityMap, sweep: usize, field: &str) -> Result<Self, Error> {
        map.check()?;
        if sweep >= map.sweeps.len() {
            return Err(Error::value(
                "sweep",
                sweep,
                format!("below {}", map.sweeps.len()),
            ));
        }
        let field = map.field(field).ok_or_else(|| Error::Missing {
            what: format!("field {field}"),
            needed: "the map must have the field that is to be drawn".into(),
        })?;
        let from_above = matches!(
            map.sweeps[sweep].mode,
            SweepMode::AzimuthSurveillance | SweepMode::Sector
        );
        let cells = Cells::of_sweep(map, sweep, from_above, |r, g| field.values[[r, g]]);
        let is_signed =
            field.name.starts_with("v_") || field.name == "radial_velocity" || field.name == "bias";
        let ((left, right), _) = cells.extent_m();
        let show_lidar = !from_above && left - map.lidar_y_m < 0.5 * (right - left);
        let plot = Self::of_cells(cells, &bar_label(&field.long_name, field.unit), is_signed);
        Ok(Self {
            title: map.title.clone(),
            show_lidar,
            from_above,
            ..plot
        })
    }

    /// The picture of a field on a cross-plane; signed fields get symmetric colours.
    pub fn of_cells(cells: Cells, bar_label: &str, is_signed: bool) -> Self {
        Self {
            title: String::new(),
            bar_label: bar_label.into(),
            colours: colours_for(&cells.values, is_signed),
            show_lidar: false,
            cells,
            points_m: Vec::new(),
            from_above: false,
        }
    }

    /// The same map under another title.
    #[must_use]
    pub fn titled(mut self, title: &str) -> Self {
        self.title = title.into();
        self
    }

    /// The same map with another label at the colour bar.
    #[must_use]
    pub fn labelled(mut self, bar_label: &str) -> Self {
        self.bar_label = bar_label.into();
        self
    }

    /// The same map with other colours, such as those of the map beside it.
    #[must_use]
    pub fn coloured(mut self, colours: ColourMap) -> Self {
        self.colours = colours;
        self
    }

    fn shown_lidar_m(&self) -> Option<(f64, f64)> {
        self.cells.lidar_m.filter(|_| self.show_lidar)
    }

    /// Box to show: (left, right), (lowest, highest), m.
    fn view_m(&self) -> ((f64, f64), (f64, f64)) {
        let (mut y, mut z) = self.cells.extent_m();
        if !self.from_above {
            z.0 = z.0.min(0.0);
        }
        if let Some(lidar_m) = self.shown_lidar_m() {
            y = (y.0.min(lidar_m.0), y.1.max(lidar_m.0));
            z.1 = z.1.max(lidar_m.1);
        }
        let pad = 0.02 * (y.1 - y.0);
        ((y.0 - pad, y.1 + pad), (z.0 - pad, z.1 + pad))
    }

    pub(crate) fn height(&self, width: f64) -> f64 {
        let (y, z) = self.view_m();
        let inner = (width - LEFT - RIGHT) * (z.1 - z.0) / (y.1 - y.0);
        inner.clamp(90.0, 1.5 * width) + top_room(&self.title) + BOTTOM
    }

    pub(crate) fn draw(&self, cell: Frame, font: &Font, out: &mut Vec<Shape>) -> Result<(), Error> {
        let (low, high) = self.colours.range();
        if !(low < high && low.is_finite() && high.is_finite()) {
            return Err(Error::value(
                "range of colours",
                format!("{low} to {high}"),
                "finite and increasing",
            ));
        }
        let frame = inner(cell, RIGHT, &self.title);
        let (y_m, z_m) = self.fitted(&frame);
        let [x_label, y_label] = match self.from_above {
            true => ["across the flight [m]", "along the flight [m]"],
            false => ["distance [m]", "height [m]"],
        };
        let x = Scale {
            label: x_label,
            range: y_m,
            log: false,
            paper: (frame.left, frame.right()),
        };
        let y = Scale {
            label: y_label,
            range: z_m,
            log: false,
            paper: (frame.bottom(), frame.top),
        };
        let size = (
            (frame.width * DENSITY) as u32,
            (frame.height * DENSITY) as u32,
        );
        let mut content = vec![Shape::Image {
            frame,
            pixels: self.cells.pixels(y_m, z_m, size, &self.colours)?,
        }];
        if !self.from_above {
            let ground = Frame {
                top: y.place(0.0),
                height: frame.bottom() - y.place(0.0),
                ..frame
            };
            content.insert(0, Shape::area(ground.outline(), GROUND));
            content.push(Shape::line(
                [(frame.left, ground.top), (frame.right(), ground.top)],
                INK,
                1.4,
            ));
        }
        self.push_marks(&x, &y, &mut content);
        panel(&frame, [&x, &y], &self.title, content, font, out);
        self.draw_bar(&frame, font, out)
    }

    /// The bar of colours beside the map.
    fn draw_bar(&self, frame: &Frame, font: &Font, out: &mut Vec<Shape>) -> Result<(), Error> {
        let (low, high) = self.colours.range();
        let bar = Frame {
            left: frame.right() + 18.0,
            width: 18.0,
            ..*frame
        };
        let mut rgba = Vec::with_capacity(4 * (BAR.0 * BAR.1) as usize);
        for row in 0..BAR.1 {
            let value = high - (f64::from(row) + 0.5) / f64::from(BAR.1) * (high - low);
            let [r, g, b] = self.colours.colour(value);
            rgba.extend([r, g, b, 255].repeat(BAR.0 as usize));
        }
        out.push(Shape::Image {
            frame: bar,
            pixels: pixels(BAR.0, BAR.1, rgba)?,
        });
        out.push(Shape::line(bar.outline(), INK, 1.2));
        let scale = Scale {
            label: &self.bar_label,
            range: (low, high),
            log: false,
            paper: (bar.bottom(), bar.top),
        };
        axis(Side::Right, &scale, &bar, font, out);
        Ok(())
    }

    /// The view, widened along one axis to the shape of the frame.
    fn fitted(&self, frame: &Frame) -> ((f64, f64), (f64, f64)) {
        let (y, z) = self.view_m();
        let unit = ((y.1 - y.0) / frame.width).max((z.1 - z.0) / frame.height);
        let extra = unit * frame.width - (y.1 - y.0);
        // Room above, not below the ground.
        (
            (y.0 - 0.5 * extra, y.1 + 0.5 * extra),
            (z.0, z.0 + unit * frame.height),
        )
    }

    fn push_marks(&self, x: &Scale<'_>, y: &Scale<'_>, out: &mut Vec<Shape>) {
        if let Some(lidar_m) = self.shown_lidar_m() {
            // A tripod on the ground, large enough to be visible when the telescope is low.
            let at = x.place(lidar_m.0);
            let ground = y.place(0.0);
            let apex = (at, y.place(lidar_m.1).min(ground - 13.0));
            out.push(Shape::area(
                [apex, (at - 8.0, ground), (at + 8.0, ground)],
                INK,
            ));
            out.push(Shape::text(
                (at + 13.0, ground - 4.0),
                "lidar",
                TICK_SIZE,
                Anchor::Start,
            ));
        }
        for p in &self.points_m {
            let px = x.place(p.0);
            let py = y.place(p.1);
            for (colour, width) in [([255, 255, 255], 4.5), (INK, 2.0)] {
                for d in [7.0, -7.0] {
                    let arm = [(px - 7.0, py - d), (px + 7.0, py + d)];
                    out.push(Shape::line(arm, colour, width));
                }
            }
        }
    }
}

/// Colours from the finite values: symmetric about zero for signed fields, rounded up to two digits.
fn colours_for(values: &[f64], is_signed: bool) -> ColourMap {
    let (low, high) = extremes(values.iter().copied().filter(|v| v.is_finite()));
    if is_signed {
        let largest = high.max(-low);
        let limit = if largest > 0.0 && largest.is_finite() {
            round_up(largest)
        } else {
            1.0
        };
        return ColourMap::Diverging { limit };
    }
    if low > high {
        return ColourMap::Sequential {
            low: 0.0,
            high: 1.0,
        };
    }
    let low = if low >= 0.0 && low < 0.5 * high {
        0.0
    } else {
        low
    };
    let high = if high > low { high } else { low + 1.0 };
    ColourMap::Sequential { low, high }
}

fn round_up(value: f64) -> f64 {
    let step = 10_f64.powf(value.log10().floor() - 1.0);
    (value / step - 1e-9).ceil() * step
}

fn bar_label(long_name: &str, unit: Unit) -> String {
    // The part after a comma explains the sign; a colour bar shows it.
    let short = long_name.split(',').next().unwrap_or(long_name);
    if unit == Unit::ONE {
        short.into()
    } else {
        format!("{short} [{}]", unit.label)
    }
}

/// Cells of one sweep, or of a cross-plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    /// Horizontal position and height of the lidar, m, about which the cells of a sweep lie; a plane has none.
    pub lidar_m: Option<(f64, f64)>,
    /// Edges of the gates along the range, or of the cells across, m, increasing, one more than cells.
    pub first_edge_m: Vec<f64>,
    /// Edges of the rays, rad, or of the cells upward, m, increasing, one more than cells.
    pub second_edge: Vec<f64>,
    /// Values `[ray, gate]` in the order of increasing angles, or `[z, y]`.
    pub values: Vec<f64>,
}

impl Cells {
    /// Cells of a sweep of a map: `value` gives a number for (ray, gate). A sweep of azimuth is seen from above: across the flight
    /// to the right, along it upwards; ranges along the ground, angles from the right.
    fn of_sweep(
        map: &VelocityMap,
        sweep: usize,
        from_above: bool,
        value: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let (x_m, x_azimuth_rad) = map.flight.unwrap_or_default();
        let mut rays: Vec<(f64, usize)> = Vec::new();
        for (number, ray) in map
            .rays
            .iter()
            .enumerate()
            .filter(|(_, ray)| ray.sweep == sweep)
        {
            let from_right_rad = FRAC_PI_2 - (ray.azimuth_rad - x_azimuth_rad);
            rays.push((
                if from_above {
                    from_right_rad
                } else {
                    ray.elevation_rad
                },
                number,
            ));
        }
        rays.sort_by(|a, b| a.0.total_cmp(&b.0));
        let turns = rays
            .first()
            .map_or(0.0, |first| ((first.0 + PI) / TAU).floor() * TAU);
        let angles_rad: Vec<f64> = rays.iter().map(|ray| ray.0 - turns).collect();
        let mean_rad = rays
            .iter()
            .map(|ray| map.rays[ray.1].elevation_rad)
            .sum::<f64>()
            / rays.len().max(1) as f64;
        let part = if from_above { mean_rad.cos() } else { 1.0 };
        let ranges_m: Vec<f64> = map.range_m.iter().map(|range_m| part * range_m).collect();
        let cells = rays
            .iter()
            .flat_map(|&(_, ray)| (0..ranges_m.len()).map(move |gate| (ray, gate)));
        Self {
            lidar_m: Some((
                map.lidar_y_m,
                if from_above { x_m } else { map.lidar_height_m },
            )),
            first_edge_m: edges(&ranges_m, 0.5 * ranges_m[0]),
            second_edge: edges(&angles_rad, 0.005),
            values: cells.map(|(ray, gate)| value(ray, gate)).collect(),
        }
    }

    /// Cells of a cross-plane about the centres `y_m` and `z_m` \[m\], increasing, with values `[z, y]`.
    pub fn of_plane(y_m: &[f64], z_m: &[f64], values: Vec<f64>) -> Self {
        Self {
            lidar_m: None,
            first_edge_m: edges(y_m, 0.5),
            second_edge: edges(z_m, 0.5),
            values,
        }
    }

    /// Value at a point; `None` outside the cells, NaN where it is missing.
    pub fn at(&self, y_m: f64, z_m: f64) -> Option<f64> {
        self.values.get(self.index(y_m, z_m)?).copied()
    }

    fn index(&self, y_m: f64, z_m: f64) -> Option<usize> {
        let mut first = y_m;
        let mut second = z_m;
        if let Some(lidar_m) = self.lidar_m {
            let dy = y_m - lidar_m.0;
            let dz = z_m - lidar_m.1;
            first = dy.hypot(dz);
            second = dz.atan2(dy);
            // A full turn may begin anywhere.
            if self.second_edge.first().is_some_and(|edge| second < *edge) {
                second += TAU;
            }
        }
        let row = cell_between(&self.second_edge, second)?;
        let column = cell_between(&self.first_edge_m, first)?;
        Some(row * (self.first_edge_m.len() - 1) + column)
    }

    /// Box around all cells: (left, right), (lowest, highest), m.
    pub fn extent_m(&self) -> ((f64, f64), (f64, f64)) {
        let ends = [self.first_edge_m.first(), self.first_edge_m.last()];
        let mut across_m = Vec::new();
        let mut up_m = Vec::new();
        for second in &self.second_edge {
            for first in ends.into_iter().flatten() {
                let (y_m, z_m) = match self.lidar_m {
                    Some((y_m, z_m)) => (y_m + first * second.cos(), z_m + first * second.sin()),
                    None => (*first, *second),
                };
                across_m.push(y_m);
                up_m.push(z_m);
            }
        }
        (extremes(across_m.into_iter()), extremes(up_m.into_iter()))
    }

    /// Picture of the box `y_m` x `z_m` with that many pixels; transparent outside the cells, the first row is the highest.
    fn pixels(
        &self,
        y_m: (f64, f64),
        z_m: (f64, f64),
        (width, height): (u32, u32),
        colours: &ColourMap,
    ) -> Result<Pixmap, Error> {
        let of_cells: Vec<_> = self
            .values
            .iter()
            .map(|value| colours.colour(*value))
            .collect();
        let mut rgba = Vec::with_capacity(4 * width as usize * height as usize);
        for row in 0..height {
            let z = z_m.1 - (f64::from(row) + 0.5) / f64::from(height) * (z_m.1 - z_m.0);
            for column in 0..width {
                let y = y_m.0 + (f64::from(column) + 0.5) / f64::from(width) * (y_m.1 - y_m.0);
                let colour = self.index(y, z).and_then(|index| of_cells.get(index));
                rgba.extend(colour.map_or([0; 4], |[r, g, b]| [*r, *g, *b, 255]));
            }
        }
        pixels(width, height, rgba)
    }
}

/// Edges half-way between centres; a single centre gets `half` on both sides.
fn edges(centres: &[f64], half: f64) -> Vec<f64> {
    let n = centres.len();
    if n < 2 {
        return centres.iter().flat_map(|c| [c - half, c + half]).collect();
    }
    let mut out = vec![1.5 * centres[0] - 0.5 * centres[1]];
    out.extend(centres.windows(2).map(|w| 0.5 * (w[0] + w[1])));
    out.push(1.5 * centres[n - 1] - 0.5 * centres[n - 2]);
    out
}

/// Index of the cell between edges that a value lies in.
fn cell_between(edges: &[f64], value: f64) -> Option<usize> {
    let above = edges.partition_point(|edge| *edge <= value);
    (above > 0 && above < edges.len()).then(|| above - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::samples;

    #[test]
    fn velocities_get_symmetric_colours_and_errors_do_not() {
        let map = samples::map();
        let velocity = MapPlot::new(&map, 0, "v_exact").unwrap();
        let (low, high) = velocity.colours.range();
        assert_eq!(low, -high);
        assert!((7.0..=8.0).contains(&high), "{high}");
        let spread = MapPlot::new(&map, 0, "velocity_standard_deviation").unwrap();
        assert!(matches!(
            spread.colours,
            ColourMap::Sequential { low: 0.0, .. }
        ));
        assert_eq!(velocity.bar_label, "exact radial velocity [m/s]");
    }

    #[test]
    fn a_metre_is_equally_long_both_ways_and_the_ground_is_below() {
        let map = samples::map();
        let plot = MapPlot::new(&map, 0, "v_exact").unwrap();
        for height in [180.0, 400.0] {
            let frame = Frame {
                left: 0.0,
                top: 0.0,
                width: 500.0,
                height,
            };
            let (y, z) = plot.fitted(&frame);
            approx::assert_relative_eq!(
                (y.1 - y.0) / 500.0,
                (z.1 - z.0) / height,
                max_relative = 1e-12
            );
            assert!(z.0 <= 0.0 && z.1 >= plot.view_m().1.1 - 1e-9);
        }
        assert!(plot.show_lidar);
    }

    #[test]
    fn limits_are_rounded_up() {
        approx::assert_relative_eq!(round_up(7.31), 7.4, max_relative = 1e-12);
        approx::assert_relative_eq!(round_up(0.5), 0.5, max_relative = 1e-12);
        assert_eq!(
            colours_for(&[f64::NAN], true),
            ColourMap::Diverging { limit: 1.0 }
        );
    }

    #[test]
    fn what_is_not_there_is_refused() {
        let map = samples::map();
        assert!(matches!(
            MapPlot::new(&map, 0, "nothing"),
            Err(Error::Missing { .. })
        ));
        assert!(matches!(
            MapPlot::new(&map, 2, "v_exact"),
            Err(Error::Value { .. })
        ));
    }
}

#[cfg(test)]
mod cells_tests {
    use super::*;
    use crate::io::samples;
    use crate::plot::colour::MISSING;

    #[test]
    fn every_cell_centre_finds_its_own_value() {
        let map = samples::map();
        let field = map.field("radial_velocity").unwrap();
        let cells = Cells::of_sweep(&map, 1, false, |r, g| field.values[[r, g]]);
        for ray in 6..12 {
            for gate in 0..map.range_m.len() {
                let found = cells
                    .at(map.place_m(ray, gate)[1], map.place_m(ray, gate)[2])
                    .unwrap();
                let expected = field.values[[ray, gate]];
                assert!(found == expected || (found.is_nan() && expected.is_nan()));
            }
        }
        assert_eq!(
            cells.at(map.lidar_y_m + 10.0, map.lidar_height_m + 0.5),
            None,
            "before the first gate"
        );
        assert_eq!(
            cells.at(map.lidar_y_m + 100.0, map.lidar_height_m + 50.0),
            None,
            "above the scan"
        );
    }

    #[test]
    fn from_above_every_cell_finds_its_own_value_round_a_full_turn() {
        let mut map = samples::map();
        map.flight = Some((5.0, 0.3));
        let turn = |i: usize| TAU * i as f64 / 6.0;
        (0..6).for_each(|i| {
            (map.rays[i].azimuth_rad, map.rays[i].elevation_rad) = (0.2 + turn(i), 0.4)
        });
        let cells = Cells::of_sweep(&map, 0, true, |r, g| (10 * r + g) as f64);
        for (ray, gate) in
            (0..6).flat_map(|ray| (0..map.range_m.len()).map(move |gate| (ray, gate)))
        {
            assert_eq!(
                cells.at(map.place_m(ray, gate)[1], map.place_m(ray, gate)[0]),
                Some((10 * ray + gate) as f64),
                "{ray} {gate}"
            );
        }
    }

    #[test]
    fn the_order_of_the_rays_does_not_matter() {
        let mut map = samples::map();
        let up = Cells::of_sweep(&map, 0, false, |r, _| map.rays[r].elevation_rad);
        map.rays[..6].reverse();
        let down = Cells::of_sweep(&map, 0, false, |r, _| map.rays[r].elevation_rad);
        assert_eq!(up, down);
    }

    #[test]
    fn cells_of_a_plane_reach_half_way_to_their_neighbours() {
        let cells = Cells::of_plane(
            &[0.0, 1.0, 3.0],
            &[1.0, 2.0],
            vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        );
        assert_eq!(cells.at(-0.4, 0.6), Some(1.0));
        assert_eq!(cells.at(1.9, 1.4), Some(2.0));
        assert_eq!(cells.at(2.1, 1.6), Some(6.0));
        assert_eq!((cells.at(4.1, 1.0), cells.at(0.0, 0.4)), (None, None));
        assert_eq!(cells.extent_m(), ((-0.5, 4.0), (0.5, 2.5)));
    }

    #[test]
    fn up_is_up_and_away_from_the_lidar_is_right() {
        // Two rays and two gates: low-near 1, low-far 2, high-near 3, high-far missing.
        let cells = Cells {
            lidar_m: Some((0.0, 0.0)),
            first_edge_m: vec![10.0, 20.0, 30.0],
            second_edge: vec![0.0, 0.5, 1.0],
            values: vec![1.0, 2.0, 3.0, f64::NAN],
        };
        let colours = ColourMap::Sequential {
            low: 0.0,
            high: 3.0,
        };
        let picture = cells
            .pixels((0.0, 30.0), (0.0, 30.0), (300, 300), &colours)
            .unwrap();
        let pixel = |range: f64, angle: f64| {
            let column = range * angle.cos() * 10.0;
            let row = 299.0 - range * angle.sin() * 10.0;
            let at = picture.pixel(column as u32, row as u32).unwrap();
            [at.red(), at.green(), at.blue(), at.alpha()]
        };
        let opaque = |c: [u8; 3]| [c[0], c[1], c[2], 255];
        assert_eq!(pixel(15.0, 0.25), opaque(colours.colour(1.0)));
        assert_eq!(pixel(25.0, 0.25), opaque(colours.colour(2.0)));
        assert_eq!(pixel(15.0, 0.75), opaque(colours.colour(3.0)));
        assert_eq!(pixel(25.0, 0.75), opaque(MISSING));
        assert_eq!(pixel(5.0, 0.25)[3], 0);
    }
}
