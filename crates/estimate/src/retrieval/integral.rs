//! Circulation against radius from the map itself (Holzaepfel et al. 2003): a diagnostic beside a fit, not an estimate.
//!
//! Across the core's gate, Gamma(r) = pi r s [v(phi_c - r / R_c) - v(phi_c + r / R_c)]; or the second component from continuity,
//!
//! ```text
//! v_phi(R, phi) = -integral from 0 to phi of d(R v_R)/dR dphi'
//! ```
//!
//! (lidar on the ground, nothing varying along the flight), and the line integral round the circle. Gate averaging and the partner
//! take from both, half of the circulation for gates of 15 m. So each is also told divided by what the same operation makes of the fitted
//! wake, times that wake's circulation. Check: the losses of an independent program; exact maps of the fitted wake.

use ndarray::Array2;
use std::f64::consts::PI;

use crate::error::{Error, positive};
use crate::retrieval::{RetrievalOptions, ScanMap, Side};
use crate::vortex_fit::Wake;
use crate::vortex_fit::map_fit::gates::Gates;

/// Points of a circle.
const POINTS: usize = 72;

/// Circulation \[m^2/s\] at one radius; NaN where the map has holes or ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfilePoint {
    /// Radius \[m\].
    pub radius_m: f64,
    /// From velocities on both sides of the core, as it is.
    pub across_m2_s: f64,
    /// The same over what the fitted wake has.
    pub across_corrected_m2_s: f64,
    /// Line integral with the component from continuity, as it is.
    pub around_m2_s: f64,
    /// The same over what the fitted wake has.
    pub around_corrected_m2_s: f64,
}

/// Velocities without the wind, in two components.
struct Field<'a> {
    map: &'a ScanMap,
    along: Array2<f64>,
    across: Array2<f64>,
}

/// Circulation against radius of a vortex of a fitted wake, given where it is, by both integrals.
///
/// # Errors
/// [`Error::Length`], [`Error::OutOfRange`] for impossible input.
pub fn circulation_profile(
    map: &ScanMap,
    wake: &Wake,
    side: Side,
    radius_m: &[f64],
    options: &RetrievalOptions,
) -> Result<Vec<ProfilePoint>, Error> {
    options.validate()?;
    map.validate()?;
    wake.validate()?;
    radius_m
        .iter()
        .try_for_each(|radius| positive("radius_m", *radius))?;
    let gates = Gates::rough(map, options)?.frozen().fine(&options.gate)?;
    let (of_wake, of_wind) = (gates.velocities(wake), gates.velocities(&wake.wind_alone()));
    let measured = Field::new(map, &map.velocity_m_s - &of_wind);
    let fitted = Field::new(map, of_wake - of_wind);
    let (vortex, sense) = if side == Side::Left {
        (wake.left, -1.0)
    } else {
        (wake.right, 1.0)
    };
    let model = &options.model;
    let centre = (
        vortex.lateral_position_m - model.lidar_lateral_position_m,
        vortex.height_m - model.lidar_height_m,
    );
    let point = |radius: &f64| {
        let (omega, _, _) = model.profile.angular(radius * radius, vortex.core_radius_m);
        let truth = vortex.circulation_m2_s * 2.0 * PI * radius * radius * omega;
        let corrected = |seen: f64, of_fit: f64| (sense * seen, truth * seen / of_fit);
        let across = corrected(
            measured.across(centre, *radius),
            fitted.across(centre, *radius),
        );
        let around = corrected(
            measured.around(centre, *radius),
            fitted.around(centre, *radius),
        );
        ProfilePoint {
            radius_m: *radius,
            across_m2_s: across.0,
            across_corrected_m2_s: across.1,
            around_m2_s: around.0,
            around_corrected_m2_s: around.1,
        }
    };
    Ok(radius_m.iter().map(point).collect())
}

impl<'a> Field<'a> {
    fn new(map: &'a ScanMap, along: Array2<f64>) -> Self {
        let (range_m, gates) = (&map.range_m, map.range_m.len());
        let mut across = Array2::zeros(along.dim());
        for gate in 0..gates {
            let (before, after) = (gate.saturating_sub(1), (gate + 1).min(gates - 1));
            let slope = |line: usize| {
                let flux = |gate: usize| range_m[gate] * along[[line, gate]];
                (flux(after) - flux(before)) / (range_m[after] - range_m[before])
            };
            // up to the first line from the ground as on it
            let mut sum = -slope(0) * map.elevation_rad[0].max(0.0);
            across[[0, gate]] = sum;
            for line in 1..map.elevation_rad.len() {
                let step = map.elevation_rad[line] - map.elevation_rad[line - 1];
                sum -= 0.5 * step * (slope(line) + slope(line - 1));
                across[[line, gate]] = sum;
            }
        }
        Self { map, along, across }
    }

    /// Both components at a place, between the four cells about it.
    fn at(&self, (y, z): (f64, f64)) -> (f64, f64) {
        let nothing = (f64::NAN, f64::NAN);
        let Some((gate, a)) = place(&self.map.range_m, y.hypot(z)) else {
            return nothing;
        };
        let Some((line, b)) = place(&self.map.elevation_rad, z.atan2(y)) else {
            return nothing;
        };
        let between = |of: &Array2<f64>| {
            let low = of[[line, gate]] * (1.0 - a) + of[[line, gate + 1]] * a;
            let high = of[[line + 1, gate]] * (1.0 - a) + of[[line + 1, gate + 1]] * a;
            low * (1.0 - b) + high * b
        };
        (between(&self.along), between(&self.across))
    }

    /// From both sides of the core.
    fn across(&self, (y, z): (f64, f64), radius_m: f64) -> f64 {
        let (range_m, elevation_rad) = (y.hypot(z), z.atan2(y));
        let at = |sign: f64| {
            let (sin, cos) = (elevation_rad + sign * radius_m / range_m).sin_cos();
            self.at((range_m * cos, range_m * sin)).0
        };
        PI * radius_m * (at(-1.0) - at(1.0))
    }

    /// Round the circle.
    fn around(&self, (y, z): (f64, f64), radius_m: f64) -> f64 {
        let part = |i: usize| {
            let (sin, cos) = (2.0 * PI * i as f64 / POINTS as f64).sin_cos();
            let (py, pz) = (y + radius_m * cos, z + radius_m * sin);
            let (along, across) = self.at((py, pz));
            let (up, out) = (pz.atan2(py).sin(), pz.atan2(py).cos());
            let (vy, vz) = (along * out - across * up, along * up + across * out);
            vz * cos - vy * sin
        };
        2.0 * PI * radius_m / POINTS as f64 * (0..POINTS).map(part).sum::<f64>()
    }
}

/// The cell before a value and the part of the way to the next one.
fn place(axis: &[f64], value: f64) -> Option<(usize, f64)> {
    let next = axis
        .partition_point(|x| *x <= value)
        .min(axis.len().checked_sub(1)?);
    let before = next.checked_sub(1)?;
    let part = (value - axis[before]) / (axis[next] - axis[before]);
    (part <= 1.0).then_some((before, part))
}
