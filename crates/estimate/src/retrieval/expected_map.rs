//! The velocities that a wake shows at the gates of a scan, for pictures and residuals.
//!
//! Check: a wake without circulation shows its wind.

use ndarray::Array2;

use crate::error::Error;
use crate::retrieval::{Movement, RetrievalOptions, ScanMap};
use crate::vortex_fit::Wake;
use crate::vortex_fit::map_fit::gates::Gates;

/// Radial velocities \[m/s\] \[line, gate\] of `wake`, given at the reference time of the scan, as the options see it; vortices stand
/// still unless `moving`.
///
/// # Errors
/// [`Error::Length`], [`Error::OutOfRange`] for impossible input.
pub fn expected_velocities(
    map: &ScanMap,
    options: &RetrievalOptions,
    wake: &Wake,
    moving: bool,
) -> Result<Array2<f64>, Error> {
    options.validate()?;
    map.validate()?;
    let movement = if moving { Movement::Moving } else { Movement::Frozen };
    let options = RetrievalOptions { movement, ..options.clone() };
    Ok(Gates::rough(map, &options)?.fine(&options.gate)?.velocities(wake))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wind_without_vortices_is_seen_along_the_lines() {
        let map = ScanMap {
            elevation_rad: vec![0.0, 0.3],
            time_s: vec![f64::NAN; 2],
            range_m: vec![100.0, 110.0],
            velocity_m_s: Array2::from_elem((2, 2), 0.0),
            sigma_m_s: None,
            fold_m_s: None,
        };
        let wind = Wake::from_array(&[0.0, 0.0, 90.0, 20.0, 110.0, 20.0, 1.0, 1.0, 2.0, 0.1]);
        let found = expected_velocities(&map, &RetrievalOptions::default(), &wind, true).unwrap();
        let at = |line: usize, gate: usize| {
            let (angle, range_m) = (map.elevation_rad[line], map.range_m[gate]);
            (2.0 + 0.1 * range_m * angle.sin()) * angle.cos()
        };
        for ((line, gate), velocity) in found.indexed_iter() {
            assert!((velocity - at(line, gate)).abs() < 1e-12, "{found}");
        }
    }
}
