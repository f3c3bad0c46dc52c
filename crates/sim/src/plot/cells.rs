//! Pixels of a scan or of a plane: each pixel of a picture in metres takes the value of the cell that it lies in, polar (ray,
//! gate) or rectangular. Cells reach half-way to their neighbours; the outer ones as far outward as inward.
//! Check: the centre of every cell finds its own value, upward is up and away from the lidar is right.

use super::axis::extremes;
use super::colour::ColourMap;
use super::png_file::pixels;
use crate::io::{OutputResult, VelocityMap};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use tiny_skia::Pixmap;

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
    pub(crate) fn of_sweep(
        map: &VelocityMap,
        sweep: usize,
        from_above: bool,
        value: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let (x_m, x_azimuth_rad) = map.flight.unwrap_or_default();
        let mut rays: Vec<(f64, usize)> = Vec::new();
        for (number, ray) in map.rays.iter().enumerate().filter(|(_, ray)| ray.sweep == sweep) {
            let from_right_rad = FRAC_PI_2 - (ray.azimuth_rad - x_azimuth_rad);
            rays.push((if from_above { from_right_rad } else { ray.elevation_rad }, number));
        }
        rays.sort_by(|a, b| a.0.total_cmp(&b.0));
        let turns = rays.first().map_or(0.0, |first| ((first.0 + PI) / TAU).floor() * TAU);
        let angles_rad: Vec<f64> = rays.iter().map(|ray| ray.0 - turns).collect();
        let mean_rad = rays.iter().map(|ray| map.rays[ray.1].elevation_rad).sum::<f64>() / rays.len().max(1) as f64;
        let part = if from_above { mean_rad.cos() } else { 1.0 };
        let ranges_m: Vec<f64> = map.range_m.iter().map(|range_m| part * range_m).collect();
        let cells = rays.iter().flat_map(|&(_, ray)| (0..ranges_m.len()).map(move |gate| (ray, gate)));
        Self {
            lidar_m: Some((map.lidar_y_m, if from_above { x_m } else { map.lidar_height_m })),
            first_edge_m: edges(&ranges_m, 0.5 * ranges_m[0]),
            second_edge: edges(&angles_rad, 0.005),
            values: cells.map(|(ray, gate)| value(ray, gate)).collect(),
        }
    }

    /// Cells of a cross-plane about the centres `y_m` and `z_m` \[m\], increasing, with values `[z, y]`.
    pub fn of_plane(y_m: &[f64], z_m: &[f64], values: Vec<f64>) -> Self {
        Self { lidar_m: None, first_edge_m: edges(y_m, 0.5), second_edge: edges(z_m, 0.5), values }
    }

    /// Value at a point; `None` outside the cells, NaN where it is missing.
    pub fn at(&self, y_m: f64, z_m: f64) -> Option<f64> {
        self.values.get(self.index(y_m, z_m)?).copied()
    }

    fn index(&self, y_m: f64, z_m: f64) -> Option<usize> {
        let (mut first, mut second) = (y_m, z_m);
        if let Some(lidar_m) = self.lidar_m {
            let (dy, dz) = (y_m - lidar_m.0, z_m - lidar_m.1);
            (first, second) = (dy.hypot(dz), dz.atan2(dy));
            // A full turn may begin anywhere.
            if self.second_edge.first().is_some_and(|edge| second < *edge) {
                second += TAU;
            }
        }
        let cell = |edges: &[f64], value: f64| {
            let above = edges.partition_point(|edge| *edge <= value);
            (above > 0 && above < edges.len()).then(|| above - 1)
        };
        Some(cell(&self.second_edge, second)? * (self.first_edge_m.len() - 1) + cell(&self.first_edge_m, first)?)
    }

    /// Box around all cells: (left, right), (lowest, highest), m.
    pub fn extent_m(&self) -> ((f64, f64), (f64, f64)) {
        let ends = || self.first_edge_m.first().into_iter().chain(self.first_edge_m.last());
        let corners = || self.second_edge.iter().flat_map(move |second| ends().map(move |first| (*first, *second)));
        let place = |(first, second): (f64, f64)| match self.lidar_m {
            Some((y_m, z_m)) => (y_m + first * second.cos(), z_m + first * second.sin()),
            None => (first, second),
        };
        (extremes(corners().map(|c| place(c).0)), extremes(corners().map(|c| place(c).1)))
    }

    /// Picture of the box `y_m` x `z_m` with that many pixels; transparent outside the cells, the first row is the highest.
    pub(crate) fn pixels(
        &self,
        y_m: (f64, f64),
        z_m: (f64, f64),
        (width, height): (u32, u32),
        colours: &ColourMap,
    ) -> OutputResult<Pixmap> {
        let of_cells: Vec<_> = self.values.iter().map(|value| colours.colour(*value)).collect();
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

#[cfg(test)]
mod tests {
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
                let found = cells.at(map.place_m(ray, gate)[1], map.place_m(ray, gate)[2]).unwrap();
                let expected = field.values[[ray, gate]];
                assert!(found == expected || (found.is_nan() && expected.is_nan()));
            }
        }
        assert_eq!(cells.at(map.lidar_y_m + 10.0, map.lidar_height_m + 0.5), None, "before the first gate");
        assert_eq!(cells.at(map.lidar_y_m + 100.0, map.lidar_height_m + 50.0), None, "above the scan");
    }

    #[test]
    fn from_above_every_cell_finds_its_own_value_round_a_full_turn() {
        let mut map = samples::map();
        map.flight = Some((5.0, 0.3));
        let turn = |i: usize| TAU * i as f64 / 6.0;
        (0..6).for_each(|i| (map.rays[i].azimuth_rad, map.rays[i].elevation_rad) = (0.2 + turn(i), 0.4));
        let cells = Cells::of_sweep(&map, 0, true, |r, g| (10 * r + g) as f64);
        for (ray, gate) in (0..6).flat_map(|ray| (0..map.range_m.len()).map(move |gate| (ray, gate))) {
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
        let cells = Cells::of_plane(&[0.0, 1.0, 3.0], &[1.0, 2.0], vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
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
        let colours = ColourMap::Sequential { low: 0.0, high: 3.0 };
        let picture = cells.pixels((0.0, 30.0), (0.0, 30.0), (300, 300), &colours).unwrap();
        let pixel = |range: f64, angle: f64| {
            let (column, row) = (range * angle.cos() * 10.0, 299.0 - range * angle.sin() * 10.0);
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
