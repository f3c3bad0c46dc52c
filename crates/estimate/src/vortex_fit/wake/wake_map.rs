//! The map of radial velocities that gates and regions would show of a wake.
//!
//! Each velocity is the mean over the kernel along its line and over the lines of its region, weighted with their
//! chords. Check: a region of radius 0 gives the kernel's velocities; a wind linear in height is kept.

use ndarray::Array2;

use crate::error::{Error, finite, not_negative};
use crate::vortex_fit::map_fit::gates::Gates;
use crate::vortex_fit::{RangeKernel, Wake, WakeModel};

impl WakeModel {
    /// Radial velocities \[m/s\] \[line, gate\] of `wake` at `elevation_rad` \[rad\] and `range_m` \[m\], both
    /// increasing, as a gate with that kernel shows them, averaged over regions of radius `radius_m` \[m\], 0 for
    /// none.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an impossible wake or number.
    pub fn map(
        &self,
        wake: &Wake,
        kernel: &RangeKernel,
        elevation_rad: &[f64],
        range_m: &[f64],
        radius_m: f64,
    ) -> Result<Array2<f64>, Error> {
        wake.validate()?;
        elevation_rad
            .iter()
            .try_for_each(|value| finite("elevation_rad", *value))?;
        range_m
            .iter()
            .try_for_each(|value| finite("range_m", *value))?;
        not_negative("radius_m", radius_m)?;
        let rows = Gates::at_rest(self, kernel.clone(), (elevation_rad, range_m)).velocities(wake);
        Ok(Array2::from_shape_fn(
            (elevation_rad.len(), range_m.len()),
            |(line, gate)| {
                region(elevation_rad, line, range_m[gate], radius_m)
                    .map(|(other, share)| share * rows[[other, gate]])
                    .sum()
            },
        ))
    }
}

/// Lines within `radius_m` of a line at that range, with their shares: the chords that the circle cuts, over their
/// sum. A line alone if no other is as near.
pub(crate) fn region(
    elevation_rad: &[f64],
    line: usize,
    range_m: f64,
    radius_m: f64,
) -> impl Iterator<Item = (usize, f64)> {
    let own_rad = elevation_rad[line];
    let mut first = line;
    while first > 0 && chord_m(range_m * (own_rad - elevation_rad[first - 1]), radius_m) > 0.0 {
        first -= 1;
    }
    let mut last = line;
    while last + 1 < elevation_rad.len()
        && chord_m(range_m * (own_rad - elevation_rad[last + 1]), radius_m) > 0.0
    {
        last += 1;
    }
    let chords_m = elevation_rad[first..=last]
        .iter()
        .map(move |other_rad| chord_m(range_m * (own_rad - other_rad), radius_m));
    let sum_m: f64 = chords_m.clone().sum();
    let lines = (first..=last).zip(chords_m);
    lines.map(move |(other, chord_m)| (other, if sum_m > 0.0 { chord_m / sum_m } else { 1.0 }))
}

/// Half the chord that a circle cuts of a line at a distance from its centre; 0 outside.
fn chord_m(away_m: f64, radius_m: f64) -> f64 {
    (radius_m * radius_m - away_m * away_m).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 m apart at the near vortex, whose centre is at the fifth.
    const ELEVATIONS_RAD: [f64; 9] = [
        0.1098, 0.1124, 0.1150, 0.1177, 0.1203, 0.1230, 0.1256, 0.1283, 0.1309,
    ];
    const RANGES_M: [f64; 3] = [377.0, 400.0, 423.0];

    #[test]
    fn a_region_of_no_radius_gives_the_velocities_of_the_kernel() {
        let wake = Wake::from_array(&[
            480.0, 520.0, 376.5, 45.0, 423.5, 49.0, 2.0, 2.7, 1.3, 0.02, 0.0,
        ]);
        let model = WakeModel::default();
        let point = RangeKernel::new(0.0, 1.0, &[1.0]).unwrap();
        let map = model
            .map(&wake, &point, &ELEVATIONS_RAD, &RANGES_M, 0.0)
            .unwrap();
        for ((line, gate), velocity) in map.indexed_iter() {
            let expected = model.radial_velocity_m_s(&wake, RANGES_M[gate], ELEVATIONS_RAD[line]);
            assert!((velocity - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn regions_keep_a_wind_that_is_linear_in_height_and_blur_a_core() {
        let calm = Wake::from_array(&[0.0, 0.0, 376.5, 45.0, 423.5, 49.0, 2.0, 2.7, 1.0, 0.1, 0.0]);
        let wake = Wake {
            left: crate::vortex_fit::Vortex {
                circulation_m2_s: 500.0,
                ..calm.left
            },
            ..calm
        };
        let model = WakeModel::default();
        let point = RangeKernel::new(0.0, 1.0, &[1.0]).unwrap();
        let map = |wake, radius_m| {
            model
                .map(wake, &point, &ELEVATIONS_RAD, &RANGES_M, radius_m)
                .unwrap()
        };
        let change = map(&calm, 2.0) - map(&calm, 0.0);
        assert!(change.row(4).iter().all(|v| v.abs() < 1e-3), "{change}");
        // 2 m above the centre, where the air is fastest, it is averaged with slower air
        let sharp = map(&wake, 0.0)[[6, 0]];
        let blurred = map(&wake, 2.0)[[6, 0]];
        assert!(
            blurred.abs() < 0.98 * sharp.abs() && blurred.abs() > 0.5 * sharp.abs(),
            "{blurred} {sharp}"
        );
    }

    #[test]
    fn impossible_wakes_and_radii_are_refused() {
        let wake = Wake::from_array(&[
            500.0, 500.0, 376.5, 47.0, 423.5, 47.0, 2.0, 2.0, 0.0, 0.0, 0.0,
        ]);
        let model = WakeModel::default();
        let point = RangeKernel::new(0.0, 1.0, &[1.0]).unwrap();
        assert!(
            model
                .map(&wake, &point, &ELEVATIONS_RAD, &RANGES_M, -1.0)
                .is_err()
        );
        assert!(
            model
                .map(&wake, &point, &[f64::NAN], &RANGES_M, 1.0)
                .is_err()
        );
        let crossed = Wake {
            left: wake.right,
            right: wake.left,
            ..wake
        };
        assert!(
            model
                .map(&crossed, &point, &ELEVATIONS_RAD, &RANGES_M, 1.0)
                .is_err()
        );
    }
}
