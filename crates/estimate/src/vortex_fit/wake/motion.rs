//! How vortices move while a scan lasts: each with the velocity that the other one, the images and the wind have at its centre.
//!
//! Over a scan of some seconds the velocity changes by per cents, so it is that of the middle of the scan.
//! Check: the stored velocities of an independent program; difference quotients.

use crate::vortex_fit::{PARAMETERS, Parameter, Vortex, Wake, WakeModel};

/// Places of the moving coordinates among the parameters: lateral position and height of the left, then of the right vortex.
const MOVING: std::ops::Range<usize> =
    Parameter::LeftLateral as usize..Parameter::LeftCore as usize;

/// Velocities of the centres and their derivatives by all parameters.
#[derive(Debug, Clone)]
pub(crate) struct Motion {
    velocity_m_s: [f64; 4],
    slopes: [[f64; PARAMETERS]; 4],
}

impl Motion {
    pub(crate) fn new(model: &WakeModel, wake: &Wake) -> Self {
        let velocity_m_s = model.centre_velocities_m_s(wake);
        let mut slopes = [[0.0; PARAMETERS]; 4];
        for place in 0..PARAMETERS {
            let step = 1e-4 * wake.to_array()[place].abs().max(1.0);
            let [ahead, behind] = [step, -step].map(|by| {
                let mut p = wake.to_array();
                p[place] += by;
                model.centre_velocities_m_s(&Wake::from_array(&p))
            });
            for ((row, ahead), behind) in slopes.iter_mut().zip(ahead).zip(behind) {
                row[place] = (ahead - behind) / (2.0 * step);
            }
        }
        Self {
            velocity_m_s,
            slopes,
        }
    }

    /// The wake after this number of seconds.
    pub(crate) fn wake_after(&self, wake: &Wake, seconds: f64) -> Wake {
        let mut p = wake.to_array();
        MOVING
            .zip(self.velocity_m_s)
            .for_each(|(place, velocity)| p[place] += seconds * velocity);
        Wake::from_array(&p)
    }

    /// Turns derivatives by the parameters of the wake at a later time into those by the parameters of the wake at the start.
    pub(crate) fn carry_back(&self, seconds: f64, slope: &mut [f64; PARAMETERS]) {
        let then = *slope;
        for (place, row) in MOVING.zip(&self.slopes) {
            slope
                .iter_mut()
                .zip(row)
                .for_each(|(slope, by)| *slope += then[place] * seconds * by);
        }
    }
}

impl WakeModel {
    /// Range \[m\] and elevation \[rad\] at which the lidar sees a place (y, z) \[m\].
    #[must_use]
    pub fn range_and_elevation(&self, (lateral_m, height_m): (f64, f64)) -> (f64, f64) {
        let dy = lateral_m - self.lidar_lateral_position_m;
        let dz = height_m - self.lidar_height_m;
        (dy.hypot(dz), dz.atan2(dy))
    }

    /// Whether a place (y, z) \[m\] lies within the elevations \[rad\] and ranges \[m\] of a scan, both increasing.
    #[must_use]
    pub fn sees(&self, (elevation_rad, range_m): (&[f64], &[f64]), place_m: (f64, f64)) -> bool {
        let (at_m, at_rad) = self.range_and_elevation(place_m);
        spans(range_m, at_m) && spans(elevation_rad, at_rad)
    }

    /// Velocities \[m/s\] that the other vortex, the images and the wind have at the centres: lateral and vertical of the left, lateral
    /// and vertical of the right vortex.
    #[must_use]
    pub fn centre_velocities_m_s(&self, wake: &Wake) -> [f64; 4] {
        let [left_y, left_z] = self.centre_velocity_m_s(wake, &wake.left);
        let [right_y, right_z] = self.centre_velocity_m_s(wake, &wake.right);
        [left_y, left_z, right_y, right_z]
    }

    /// Lateral and vertical velocity \[m/s\] of the wind and the vortices of a wake at the centre of one of them.
    fn centre_velocity_m_s(&self, wake: &Wake, own: &Vortex) -> [f64; 2] {
        let mut lateral_m_s = wake.wind_at_m_s(own.height_m);
        let mut vertical_m_s = 0.0;
        for (vortex, _, side, sense) in self.sources(wake) {
            let dy = own.lateral_position_m - vortex.lateral_position_m;
            let dz = own.height_m - side * vortex.height_m;
            let (omega, _, _) = self
                .profile
                .angular(dy * dy + dz * dz, vortex.core_radius_m);
            lateral_m_s -= sense * vortex.circulation_m2_s * omega * dz;
            vertical_m_s += sense * vortex.circulation_m2_s * omega * dy;
        }
        [lateral_m_s, vertical_m_s]
    }
}

/// Whether a value lies between the first and the last of an increasing axis.
fn spans(axis: &[f64], value: f64) -> bool {
    axis.first()
        .zip(axis.last())
        .is_some_and(|(first, last)| (*first..=*last).contains(&value))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The truth of the reference map of moving vortices.
    #[test]
    fn centres_move_as_an_independent_program_has_them() {
        let wake = Wake::from_array(&[
            420.0, 340.0, 380.0, 48.0, 424.0, 38.0, 2.5, 2.5, 3.0, 0.02, 0.0,
        ]);
        let found = WakeModel::default().centre_velocities_m_s(&wake);
        let stored = [3.497_550_2, -0.910_882_06, 3.528_323_08, -1.125_207_24];
        assert!(
            found.iter().zip(stored).all(|(f, s)| (f - s).abs() < 2e-3),
            "{found:?}"
        );
    }

    #[test]
    fn derivatives_carried_back_are_difference_quotients() {
        let model = WakeModel::default();
        let wake = Wake::from_array(&[
            420.0, 340.0, 380.0, 48.0, 424.0, 38.0, 2.5, 2.0, 3.0, 0.02, 0.0,
        ]);
        let seen = |wake: &Wake| {
            let moved = Motion::new(&model, wake).wake_after(wake, 2.5);
            model.radial_velocity_m_s(&moved, 400.0, 0.12)
        };
        let motion = Motion::new(&model, &wake);
        let (_, mut slope) = model.gradient(&motion.wake_after(&wake, 2.5), 400.0, 0.12);
        motion.carry_back(2.5, &mut slope);
        for (place, slope) in slope.iter().enumerate() {
            let moved = |by: f64| {
                let mut p = wake.to_array();
                p[place] += by;
                seen(&Wake::from_array(&p))
            };
            let quotient = (moved(1e-4) - moved(-1e-4)) / 2e-4;
            assert!(
                (slope - quotient).abs() < 1e-5 * quotient.abs().max(1.0),
                "{place}: {slope} {quotient}"
            );
        }
    }
}
