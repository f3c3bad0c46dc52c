//! Pixels of a scan or of a plane: each pixel of a picture in metres takes the value of the cell that it lies in, polar (ray,
//! gate) or rectangular. Cells reach half-way to their neighbours; the outer ones as far outward as inward.
//! Check: the centre of every cell finds its own value, upward is up and away from the lidar is right.

use super::colour::ColourMap;
use super::drawing::Raster;
use crate::io::VelocityMap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Cells of one sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct PolarCells {
    /// Horizontal position and height of the lidar, m.
    pub lidar_m: (f64, f64),
    /// Edges of the gates, m, one more than gates.
    pub range_edge_m: Vec<f64>,
    /// Edges of the rays, rad, increasing, one more than rays.
    pub elevation_edge_rad: Vec<f64>,
    /// Values, ray by ray in the order of increasing elevation, the gate running fastest.
    pub values: Vec<f64>,
}

impl PolarCells {
    /// Cells of a sweep of a map: `values` gives a number for (ray, gate).
    pub(crate) fn of_sweep(map: &VelocityMap, sweep: usize, value: impl Fn(usize, usize) -> f64) -> Self {
        let mut rays: Vec<usize> = (0..map.rays.len()).filter(|r| map.rays[*r].sweep == sweep).collect();
        rays.sort_by(|a, b| map.rays[*a].elevation_rad.total_cmp(&map.rays[*b].elevation_rad));
        let elevations: Vec<f64> = rays.iter().map(|r| map.rays[*r].elevation_rad).collect();
        let gates = map.range_m.len();
        Self {
            lidar_m: (map.lidar_y_m, map.lidar_height_m),
            range_edge_m: edges(&map.range_m, 0.5 * map.range_m[0]),
            elevation_edge_rad: edges(&elevations, 0.005),
            values: rays.iter().flat_map(|&r| (0..gates).map(move |g| (r, g))).map(|(r, g)| value(r, g)).collect(),
        }
    }

    /// Cells of a sweep of azimuth seen from above: across the flight to the right, along it upwards; ranges along the ground,
    /// angles from the right.
    pub(crate) fn from_above(map: &VelocityMap, sweep: usize, value: impl Fn(usize, usize) -> f64) -> Self {
        let (x_m, x_azimuth_rad) = map.flight.unwrap_or_default();
        let angle = |ray: &usize| FRAC_PI_2 - (map.rays[*ray].azimuth_rad - x_azimuth_rad);
        let mut rays: Vec<usize> = (0..map.rays.len()).filter(|r| map.rays[*r].sweep == sweep).collect();
        rays.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        let angles: Vec<f64> = rays.iter().map(angle).collect();
        let turns = angles.first().map_or(0.0, |first| ((first + PI) / TAU).floor() * TAU);
        let angles: Vec<f64> = angles.iter().map(|angle| angle - turns).collect();
        let mean = rays.iter().map(|r| map.rays[*r].elevation_rad).sum::<f64>() / rays.len().max(1) as f64;
        let ranges_m: Vec<f64> = map.range_m.iter().map(|range_m| range_m * mean.cos()).collect();
        let gates = map.range_m.len();
        Self {
            lidar_m: (map.lidar_y_m, x_m),
            range_edge_m: edges(&ranges_m, 0.5 * ranges_m[0]),
            elevation_edge_rad: edges(&angles, 0.005),
            values: rays.iter().flat_map(|&r| (0..gates).map(move |g| (r, g))).map(|(r, g)| value(r, g)).collect(),
        }
    }

    /// Value at a point; `None` outside the scan, NaN where it is missing.
    pub fn at(&self, y_m: f64, z_m: f64) -> Option<f64> {
        let (dy, dz) = (y_m - self.lidar_m.0, z_m - self.lidar_m.1);
        let gate = cell(&self.range_edge_m, dy.hypot(dz))?;
        let angle_rad = dz.atan2(dy);
        // A full turn may begin anywhere.
        let below = self.elevation_edge_rad.first().is_some_and(|first| angle_rad < *first);
        let ray = cell(&self.elevation_edge_rad, if below { angle_rad + TAU } else { angle_rad })?;
        Some(self.values[ray * (self.range_edge_m.len() - 1) + gate])
    }

    /// Box around all cells: (left, right), (lowest, highest), m.
    pub fn extent_m(&self) -> ((f64, f64), (f64, f64)) {
        let mut y = (f64::INFINITY, f64::NEG_INFINITY);
        let mut z = y;
        for angle in &self.elevation_edge_rad {
            for range in [self.range_edge_m[0], self.range_edge_m[self.range_edge_m.len() - 1]] {
                let (py, pz) = (self.lidar_m.0 + range * angle.cos(), self.lidar_m.1 + range * angle.sin());
                y = (y.0.min(py), y.1.max(py));
                z = (z.0.min(pz), z.1.max(pz));
            }
        }
        (y, z)
    }
}

/// Cells of a cross-plane.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneCells {
    /// Edges across, m, increasing, one more than cells.
    pub y_edge_m: Vec<f64>,
    /// Edges upward, m, increasing, one more than cells.
    pub z_edge_m: Vec<f64>,
    /// Values `[z][y]`.
    pub values: Vec<f64>,
}

impl PlaneCells {
    /// Cells about the centres `y_m` and `z_m` \[m\], increasing, with values `[z][y]`.
    pub fn about(y_m: &[f64], z_m: &[f64], values: Vec<f64>) -> Self {
        Self { y_edge_m: edges(y_m, 0.5), z_edge_m: edges(z_m, 0.5), values }
    }

    /// Value at a point; `None` outside.
    pub fn at(&self, y_m: f64, z_m: f64) -> Option<f64> {
        let (j, k) = (cell(&self.y_edge_m, y_m)?, cell(&self.z_edge_m, z_m)?);
        self.values.get(k * (self.y_edge_m.len() - 1) + j).copied()
    }
}

/// The cells of a map.
#[derive(Debug, Clone, PartialEq)]
pub enum MapCells {
    /// Of a scan.
    Polar(PolarCells),
    /// Of a plane.
    Plane(PlaneCells),
}

impl MapCells {
    /// Values in the order of the cells.
    pub fn values(&self) -> &[f64] {
        match self {
            Self::Polar(cells) => &cells.values,
            Self::Plane(cells) => &cells.values,
        }
    }

    /// Horizontal position and height of the lidar, m, where there is one.
    pub fn lidar_m(&self) -> Option<(f64, f64)> {
        match self {
            Self::Polar(cells) => Some(cells.lidar_m),
            Self::Plane(_) => None,
        }
    }

    /// Value at a point; `None` outside the cells, NaN where it is missing.
    pub fn at(&self, y_m: f64, z_m: f64) -> Option<f64> {
        match self {
            Self::Polar(cells) => cells.at(y_m, z_m),
            Self::Plane(cells) => cells.at(y_m, z_m),
        }
    }

    /// Box around all cells: (left, right), (lowest, highest), m.
    pub fn extent_m(&self) -> ((f64, f64), (f64, f64)) {
        let ends = |edges: &[f64]| match edges {
            [first, .., last] => (*first, *last),
            _ => (f64::NAN, f64::NAN),
        };
        match self {
            Self::Polar(cells) => cells.extent_m(),
            Self::Plane(cells) => (ends(&cells.y_edge_m), ends(&cells.z_edge_m)),
        }
    }

    /// Picture of the box `y_m` x `z_m` with that many pixels; transparent outside the cells, the first row is the highest.
    pub(crate) fn raster(
        &self,
        y_m: (f64, f64),
        z_m: (f64, f64),
        (width, height): (u32, u32),
        colours: &ColourMap,
    ) -> Raster {
        let mut rgba = Vec::with_capacity(4 * width as usize * height as usize);
        for row in 0..height {
            let z = z_m.1 - (f64::from(row) + 0.5) / f64::from(height) * (z_m.1 - z_m.0);
            for column in 0..width {
                let y = y_m.0 + (f64::from(column) + 0.5) / f64::from(width) * (y_m.1 - y_m.0);
                match self.at(y, z) {
                    Some(value) => {
                        rgba.extend(colours.colour(value));
                        rgba.push(255);
                    }
                    None => rgba.extend([255, 255, 255, 0]),
                }
            }
        }
        Raster { width, height, rgba }
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

fn cell(edges: &[f64], value: f64) -> Option<usize> {
    let above = edges.partition_point(|e| *e <= value);
    (above > 0 && above < edges.len()).then(|| above - 1)
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
        let cells = PolarCells::of_sweep(&map, 1, |r, g| field.values[[r, g]]);
        for ray in 6..12 {
            for gate in 0..map.range_m.len() {
                let found = cells.at(map.y_m(ray, gate), map.z_m(ray, gate)).unwrap();
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
        let cells = PolarCells::from_above(&map, 0, |r, g| (10 * r + g) as f64);
        for (ray, gate) in (0..6).flat_map(|ray| (0..map.range_m.len()).map(move |gate| (ray, gate))) {
            assert_eq!(
                cells.at(map.y_m(ray, gate), map.x_m(ray, gate)),
                Some((10 * ray + gate) as f64),
                "{ray} {gate}"
            );
        }
    }

    #[test]
    fn the_order_of_the_rays_does_not_matter() {
        let mut map = samples::map();
        let up = PolarCells::of_sweep(&map, 0, |r, _| map.rays[r].elevation_rad);
        map.rays[..6].reverse();
        let down = PolarCells::of_sweep(&map, 0, |r, _| map.rays[r].elevation_rad);
        assert_eq!(up, down);
    }

    #[test]
    fn cells_of_a_plane_reach_half_way_to_their_neighbours() {
        let cells = PlaneCells::about(&[0.0, 1.0, 3.0], &[1.0, 2.0], vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(cells.at(-0.4, 0.6), Some(1.0));
        assert_eq!(cells.at(1.9, 1.4), Some(2.0));
        assert_eq!(cells.at(2.1, 1.6), Some(6.0));
        assert_eq!((cells.at(4.1, 1.0), cells.at(0.0, 0.4)), (None, None));
        assert_eq!(MapCells::Plane(cells).extent_m(), ((-0.5, 4.0), (0.5, 2.5)));
    }

    #[test]
    fn up_is_up_and_away_from_the_lidar_is_right() {
        // Two rays and two gates: low-near 1, low-far 2, high-near 3, high-far missing.
        let cells = PolarCells {
            lidar_m: (0.0, 0.0),
            range_edge_m: vec![10.0, 20.0, 30.0],
            elevation_edge_rad: vec![0.0, 0.5, 1.0],
            values: vec![1.0, 2.0, 3.0, f64::NAN],
        };
        let cells = MapCells::Polar(cells);
        let colours = ColourMap::Sequential { low: 0.0, high: 3.0 };
        let raster = cells.raster((0.0, 30.0), (0.0, 30.0), (300, 300), &colours);
        let pixel = |range: f64, angle: f64| {
            let (column, row) = (range * angle.cos() * 10.0, 299.0 - range * angle.sin() * 10.0);
            let at = 4 * (row as usize * 300 + column as usize);
            [raster.rgba[at], raster.rgba[at + 1], raster.rgba[at + 2], raster.rgba[at + 3]]
        };
        let opaque = |c: [u8; 3]| [c[0], c[1], c[2], 255];
        assert_eq!(pixel(15.0, 0.25), opaque(colours.colour(1.0)));
        assert_eq!(pixel(25.0, 0.25), opaque(colours.colour(2.0)));
        assert_eq!(pixel(15.0, 0.75), opaque(colours.colour(3.0)));
        assert_eq!(pixel(25.0, 0.75), opaque(MISSING));
        assert_eq!(pixel(5.0, 0.25)[3], 0);
    }
}
