//! Directions of beams in the axes of a scene: x along the flight, y to its right, z up, azimuths clockwise.
//!
//! Check: the table of directions, and zeros that are exact at quarter turns.

use std::f64::consts::FRAC_PI_2;

/// Unit vector from the lidar outwards, (x, y, z).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction(pub [f64; 3]);

impl Direction {
    /// From the azimuth, clockwise from +x, and the elevation, rad, (G1) of the book's page on scans.
    pub fn new(azimuth_from_x_rad: f64, elevation_rad: f64) -> Self {
        let (sin, cos) = elevation_rad.sin_cos();
        let (sin_azimuth, cos_azimuth) = sin_cos_of_turn(azimuth_from_x_rad);
        Self([cos * cos_azimuth, cos * sin_azimuth, sin])
    }

    /// The place at a range, m, from a place, m.
    pub fn at_range_m(&self, from_m: [f64; 3], range_m: f64) -> [f64; 3] {
        std::array::from_fn(|d| from_m[d] + range_m * self.0[d])
    }

    /// Radial velocity, m/s, positive away, of air with `wind_m_s` seen from a lidar that moves with `lidar_m_s`, (G2).
    pub fn radial_velocity_m_s(&self, wind_m_s: [f64; 3], lidar_m_s: [f64; 3]) -> f64 {
        let [x, y, z] = self.0;
        let [u, v, w]: [f64; 3] = std::array::from_fn(|d| wind_m_s[d] - lidar_m_s[d]);
        let across = v * y + w * z;
        // A beam in a plane across the flight has the numbers of that plane, to the bit.
        if x == 0.0 { across } else { across + u * x }
    }

    /// Cosine of the angle to another direction, and its sine, which is not negative.
    pub fn cos_sin_to(&self, other: &Self) -> (f64, f64) {
        let ([a, b, c], [d, e, f]) = (self.0, other.0);
        let cross = [b * f - c * e, c * d - a * f, a * e - b * d];
        (
            a * d + b * e + c * f,
            cross.iter().map(|x| x * x).sum::<f64>().sqrt(),
        )
    }
}

/// Sine and cosine that are exact at multiples of a quarter turn, however those were rounded.
pub fn sin_cos_of_turn(angle_rad: f64) -> (f64, f64) {
    let quarters = (angle_rad / FRAC_PI_2).round();
    if (angle_rad - quarters * FRAC_PI_2).abs() > 4.0 * f64::EPSILON * angle_rad.abs() {
        return angle_rad.sin_cos();
    }
    match quarters.rem_euclid(4.0) as u8 {
        0 => (0.0, 1.0),
        1 => (1.0, 0.0),
        2 => (0.0, -1.0),
        _ => (-1.0, 0.0),
    }
}
