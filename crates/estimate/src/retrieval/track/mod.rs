//! A track through the results of many scans: a Kalman filter over both vortices and the smoother of Rauch, Tung and Striebel.
//!
//! State of each vortex: y and its rate, z and its rate, ln Gamma and q = -d ln Gamma/dt. Positions
//! have white acceleration of a given spectral density; q is a random walk, and ln Gamma may be
//! another one beside it. The densities of both walks are those of the largest posterior: the
//! likelihood of the innovations (Schweppe 1965), with a prior of the first. Both vortices are one
//! state of twelve numbers, as their errors in a scan are correlated. A scan is taken for a vortex if
//! its normalised innovation is below 16.3 (99.9 % of chi^2 with three degrees). A vortex is born at
//! the first of two detections within three scans; it ends with its last detection before three
//! misses or below the ground.
//! Check: synthetic series, innovations, errors of smoothed circulations in little and much noise.

mod filter;

use crate::Measured;
use crate::error::{Error, finite, increasing, not_empty, positive};
use crate::retrieval::{ScanResult, Side};
use crate::vortex_fit::{Vortex, Wake};
use filter::{ONE, State, likely_filter};

/// A vortex at the reference time of a scan, with the standard deviations of the smoother.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackedVortex {
    /// Which one.
    pub side: Side,
    /// Lateral coordinate \[m\].
    pub lateral_position_m: Measured,
    /// Height \[m\].
    pub height_m: Measured,
    /// Rate of the lateral coordinate \[m/s\].
    pub lateral_velocity_m_s: Measured,
    /// Rate of the height \[m/s\].
    pub vertical_velocity_m_s: Measured,
    /// Circulation \[m^2/s\].
    pub circulation_m2_s: Measured,
    /// -d ln Gamma / dt \[1/s\].
    pub decay_per_s: Measured,
    /// Whether the scan was taken for it; else it is the track alone.
    pub detected: bool,
}

impl TrackedVortex {
    /// The vortex with that core radius \[m\] a time \[s\] later, at the same rates.
    fn after(&self, seconds: f64, core_radius_m: f64) -> Vortex {
        Vortex {
            circulation_m2_s: self.circulation_m2_s.value
                * (-self.decay_per_s.value * seconds).exp(),
            lateral_position_m: self.lateral_position_m.value
                + seconds * self.lateral_velocity_m_s.value,
            height_m: self.height_m.value + seconds * self.vertical_velocity_m_s.value,
            core_radius_m,
        }
    }
}

/// The vortices that are tracked at the time of one scan.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackPoint {
    /// Reference time of the scan \[s\].
    pub time_s: f64,
    /// The vortices that live then.
    pub vortices: Vec<TrackedVortex>,
}

impl TrackPoint {
    fn vortex(&self, side: Side) -> Option<&TrackedVortex> {
        self.vortices.iter().find(|vortex| vortex.side == side)
    }
}

/// A track.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// One for each scan.
    pub points: Vec<TrackPoint>,
    /// Mean normalised innovation of what was taken: 3 if the densities are right, less if they are too large.
    pub mean_innovation: f64,
    /// Detections that were not taken, being too far from the track.
    pub rejected: usize,
    /// Spectral density of the changes of the rate of decay \[1/s^3\], as the detections show it.
    pub decay_density_per_s3: f64,
    /// Spectral density of a random walk of ln Gamma beside them \[1/s\].
    pub circulation_walk_per_s: f64,
}

impl Track {
    /// A spectral density of the acceleration \[m^2/s^3\] that suits most wakes; it lies between 0.002 and 0.02.
    pub const ACCELERATION_DENSITY_M2_S3: f64 = 0.005;

    /// The pair at a time \[s\] after the last scan, to start the next fit from; nothing unless both vortices live.
    #[must_use]
    pub fn prediction(&self, time_s: f64, core_radius_m: f64) -> Option<Wake> {
        let last = self.points.last()?;
        let seconds = time_s - last.time_s;
        let left = last.vortex(Side::Left)?.after(seconds, core_radius_m);
        let right = last.vortex(Side::Right)?.after(seconds, core_radius_m);
        let wake = Wake::calm(left, right);
        wake.validate().is_ok().then_some(wake)
    }
}

/// Tracks the vortices through scans, in the order of their times; `acceleration_density_m2_s3` is the spectral density of the
/// acceleration \[m^2/s^3\], such as [`Track::ACCELERATION_DENSITY_M2_S3`].
///
/// # Errors
/// [`Error::Empty`] without scans; [`Error::OutOfRange`] for unknown or not increasing times and a density that is not above 0;
/// [`Error::Linalg`] for covariances that are no covariances.
pub fn track(results: &[&ScanResult], acceleration_density_m2_s3: f64) -> Result<Track, Error> {
    positive("acceleration_density_m2_s3", acceleration_density_m2_s3)?;
    let times: Vec<f64> = results
        .iter()
        .map(|result| result.reference_time_s)
        .collect();
    times
        .iter()
        .try_for_each(|time| finite("reference_time_s", *time))?;
    increasing("reference_time_s", &times)?;
    not_empty("results", results.len())?;
    let filter = likely_filter(results, &times, acceleration_density_m2_s3)?;
    let smoothed = filter.smoothed()?;
    let points = filter.steps.iter().zip(&smoothed).zip(&times);
    let points = points.map(|((step, state), time_s)| TrackPoint {
        time_s: *time_s,
        vortices: (0..2)
            .filter(|i| step.alive[*i])
            .map(|i| tracked(state, i, step.detected[i]))
            .collect(),
    });
    let count = filter.innovations.len() as f64;
    Ok(Track {
        points: points.collect(),
        mean_innovation: filter.innovations.iter().sum::<f64>() / count,
        rejected: filter.rejected,
        decay_density_per_s3: filter.decay_per_s3,
        circulation_walk_per_s: filter.walk_per_s,
    })
}

fn tracked(state: &State, i: usize, detected: bool) -> TrackedVortex {
    let first = ONE * i;
    let log_circulation = state.element(first + 4);
    let value = log_circulation.value.exp();
    TrackedVortex {
        side: Side::BOTH[i],
        lateral_position_m: state.element(first),
        lateral_velocity_m_s: state.element(first + 1),
        height_m: state.element(first + 2),
        vertical_velocity_m_s: state.element(first + 3),
        circulation_m2_s: Measured {
            value,
            std: value * log_circulation.std,
        },
        decay_per_s: state.element(first + 5),
        detected,
    }
}

#[cfg(test)]
mod tests;
