//! A velocity field that moves: snapshots at several times, and linear interpolation between the two about the asked time.
//!
//! The error of the interpolation is at most an eighth of the square of the time between snapshots times the second
//! derivative of the velocity in time. A vortex of core `r_c` that drifts with `V` is smeared when the snapshots are further
//! apart than some tenth of `r_c/V`.
//!
//! Check: fields linear in time are exact, the error of a curved one falls with the square of the time between snapshots.

use super::between_times::{self, blend, check_times};
use super::grid_wind::GridSnapshot;
use super::wind::Wind;
use crate::Error;
use crate::error::check_lengths;

/// The snapshot at or before a time, the one behind it, and the weight of the latter.
type About<'a> = (&'a GridSnapshot, Option<(&'a GridSnapshot, f64)>);

/// Snapshots of one flow at increasing times.
#[derive(Debug, Clone)]
pub struct GridSeries {
    time_s: Vec<f64>,
    snapshots: Vec<GridSnapshot>,
}

impl GridSeries {
    /// A series of at least one snapshot, each with its time \[s\].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an empty series, and for times that are not finite or do not increase.
    pub fn new(snapshots: impl IntoIterator<Item = (f64, GridSnapshot)>) -> Result<Self, Error> {
        let (time_s, snapshots): (Vec<f64>, Vec<GridSnapshot>) = snapshots.into_iter().unzip();
        check_times(&time_s)?;
        Ok(Self { time_s, snapshots })
    }

    /// Times of the snapshots \[s\].
    pub fn times_s(&self) -> &[f64] {
        &self.time_s
    }

    /// The snapshots about `time_s`.
    fn about(&self, time_s: f64) -> Result<About<'_>, Error> {
        let (at, weight) = between_times::about(&self.time_s, time_s)?;
        Ok((&self.snapshots[at], weight.map(|weight| (&self.snapshots[at + 1], weight))))
    }
}

impl Wind for GridSeries {
    /// As the trait says; a time outside the series is refused.
    fn velocity_into(&self, points_m: &[[f64; 3]], time_s: f64, out_m_s: &mut [[f64; 3]]) -> Result<(), Error> {
        check_lengths(points_m.len(), out_m_s.len())?;
        let (before, after) = self.about(time_s)?;
        before.velocity_into(points_m, time_s, out_m_s)?;
        let Some((after, weight)) = after else { return Ok(()) };
        blend(after, weight, points_m, time_s, out_m_s)
    }

    /// The larger of the two snapshots' values; of a time outside the series, the largest of all.
    fn max_gradient_per_s(&self, time_s: f64) -> f64 {
        match self.about(time_s) {
            Ok((before, after)) => {
                let later = after.map_or(0.0, |(snapshot, _)| snapshot.max_gradient_per_s(time_s));
                before.max_gradient_per_s(time_s).max(later)
            }
            Err(_) => self.snapshots.iter().map(|s| s.max_gradient_per_s(time_s)).fold(0.0, f64::max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::wind::BATCH;
    use super::super::{Edges, OutsidePolicy, PlaneMesh, Side};
    use super::*;

    /// A uniform velocity on a small mesh.
    fn uniform(velocity_m_s: [f64; 3]) -> GridSnapshot {
        let axis: Vec<f64> = (0..4).map(f64::from).collect();
        let open = Edges::Bounded { low: Side::Open, high: Side::Open };
        let mesh =
            PlaneMesh { y_m: axis.clone(), z_m: axis, y_edges: open, z_edges: open, outside: OutsidePolicy::Error };
        GridSnapshot::new(&mesh, &[velocity_m_s; 16]).unwrap()
    }

    fn series(times_s: &[f64], velocity: impl Fn(f64) -> [f64; 3]) -> GridSeries {
        GridSeries::new(times_s.iter().map(|&t| (t, uniform(velocity(t))))).unwrap()
    }

    fn at(wind: &GridSeries, time_s: f64) -> Result<[f64; 3], Error> {
        // More points than fit into one batch.
        let mut out = vec![[0.0; 3]; BATCH + 3];
        wind.velocity_into(&vec![[0.0, 1.5, 1.5]; BATCH + 3], time_s, &mut out)?;
        assert!(out.iter().all(|v| *v == out[0]));
        Ok(out[0])
    }

    #[test]
    fn what_is_linear_in_time_is_exact_and_the_rest_converges_with_second_order() {
        let linear = series(&[1.0, 1.5, 4.0], |t| [2.0 * t, 1.0 - t, 0.5]);
        for t in [1.0, 1.2, 1.5, 3.9, 4.0] {
            let found = at(&linear, t).unwrap();
            for (found, expected) in found.iter().zip([2.0 * t, 1.0 - t, 0.5]) {
                assert!((found - expected).abs() < 1e-14, "{t}");
            }
        }
        let error = |n: u32| {
            let times_s: Vec<f64> = (0..=n).map(|i| f64::from(i) / f64::from(n)).collect();
            let wind = series(&times_s, |t| [(5.0 * t).sin(), 0.0, 0.0]);
            let probe = |i: u32| {
                let t = f64::from(i) / 997.0;
                (at(&wind, t).unwrap()[0] - (5.0 * t).sin()).abs()
            };
            (0..=997).map(probe).fold(0.0, f64::max)
        };
        // Its bound is an eighth of the square of 1/16 times 25.
        assert!(error(16) <= 25.0 / 8.0 / 256.0 && error(16) > 0.9 * 25.0 / 8.0 / 256.0);
        assert!(((error(16) / error(32)).log2() - 2.0).abs() < 0.1);
    }

    #[test]
    fn times_outside_the_series_and_disorder_are_refused() {
        let wind = series(&[0.0, 1.0], |_| [1.0; 3]);
        for t in [-1e-9, 1.0 + 1e-9, f64::NAN] {
            assert!(matches!(at(&wind, t), Err(Error::OutOfRange { field: "time_s", .. })), "{t}");
        }
        assert!(GridSeries::new([]).is_err());
        assert!(GridSeries::new([(1.0, uniform([0.0; 3])), (1.0, uniform([0.0; 3]))]).is_err());
        assert_eq!(at(&series(&[2.0], |_| [1.0; 3]), 2.0).unwrap(), [1.0; 3]);
    }
}
