//! A velocity field that moves: fields at several times, and linear interpolation between the two
//! about the requested time.
//!
//! The error of the interpolation is at most an eighth of the square of the time between fields
//! times the second derivative of the velocity in time. A vortex of core `r_c` that drifts with `V`
//! is smeared when the fields are further apart than some tenth of `r_c/V`. Fields may be read when
//! they are needed: at most the two about the time that was asked for last are kept.
//!
//! Check: fields linear in time are exact, the error of a curved one falls with the square of the
//! time between fields; many times in order read each field once and keep two.

use std::sync::{Arc, Mutex, PoisonError};

use super::grid_wind::GridSnapshot;
use super::volume::VolumeSnapshot;
use super::wind::{Wind, combine};
use crate::error::{Error, check, check_lengths};

/// Gives field number `i`.
type Reader = dyn Fn(usize) -> Result<Arc<dyn Wind>, Error> + Send + Sync;

/// Fields of one flow at increasing times; a time outside them is refused.
pub struct Series {
    time_s: Vec<f64>,
    /// Of each field.
    max_gradient_per_s: Vec<f64>,
    read: Box<Reader>,
    kept: Mutex<Vec<(usize, Arc<dyn Wind>)>>,
}

impl Series {
    /// A series of at least one snapshot in a plane, each with its time \[s\].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an empty series, and for times that are not finite or do not
    /// increase.
    pub fn new(snapshots: impl IntoIterator<Item = (f64, GridSnapshot)>) -> Result<Self, Error> {
        let (time_s, fields): (Vec<f64>, Vec<GridSnapshot>) = snapshots.into_iter().unzip();
        let gradients_per_s = fields
            .iter()
            .map(|field| field.max_gradient_per_s(0.0))
            .collect();
        let fields: Vec<Arc<dyn Wind>> = fields
            .into_iter()
            .map(|field| Arc::new(field) as Arc<dyn Wind>)
            .collect();
        Self::from_reader(
            time_s,
            gradients_per_s,
            Box::new(move |i| Ok(fields[i].clone())),
        )
    }

    /// A series with the times \[s\] of its fields, the largest gradient of all \[1/s\], and what
    /// reads field number `i`.
    ///
    /// # Errors
    /// As [`Series::new`].
    pub fn read(
        time_s: Vec<f64>,
        max_gradient_per_s: f64,
        read: impl Fn(usize) -> Result<VolumeSnapshot, Error> + Send + Sync + 'static,
    ) -> Result<Self, Error> {
        let gradients_per_s = vec![max_gradient_per_s; time_s.len()];
        Self::from_reader(
            time_s,
            gradients_per_s,
            Box::new(move |i| Ok(Arc::new(read(i)?))),
        )
    }

    fn from_reader(
        time_s: Vec<f64>,
        max_gradient_per_s: Vec<f64>,
        read: Box<Reader>,
    ) -> Result<Self, Error> {
        check("number of times", time_s.len() as f64, "at least 1", |n| {
            n >= 1.0
        })?;
        let mut last_s = f64::NEG_INFINITY;
        for &time_s in &time_s {
            check(
                "time_s",
                time_s,
                "finite and greater than the one before",
                |t| t > last_s,
            )?;
            last_s = time_s;
        }
        Ok(Self {
            time_s,
            max_gradient_per_s,
            read,
            kept: Mutex::new(Vec::new()),
        })
    }

    /// The last field that is not after `time_s`, and the weight of the next one if it counts.
    fn about(&self, time_s: f64) -> Result<(usize, Option<f64>), Error> {
        let times_s = &self.time_s;
        let last = times_s.len() - 1;
        check(
            "time_s",
            time_s,
            "between the first and the last time of the series",
            |t| times_s[0] <= t && t <= times_s[last],
        )?;
        let at = times_s.partition_point(|&t| t <= time_s) - 1;
        let from_s = times_s[at];
        let weight = (time_s != from_s && at != last)
            .then(|| (time_s - from_s) / (times_s[at + 1] - from_s));
        Ok((at, weight))
    }

    fn field(&self, number: usize) -> Result<Arc<dyn Wind>, Error> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, field)) = kept.iter().find(|(n, _)| *n == number) {
            return Ok(Arc::clone(field));
        }
        let field = (self.read)(number)?;
        if kept.len() > 1 {
            kept.remove(0);
        }
        kept.push((number, Arc::clone(&field)));
        Ok(field)
    }
}

impl Wind for Series {
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        check_lengths(points_m.len(), out_m_s.len())?;
        let (at, weight) = self.about(time_s)?;
        self.field(at)?.velocity_into(points_m, time_s, out_m_s)?;
        let Some(weight) = weight else { return Ok(()) };
        combine(
            &*self.field(at + 1)?,
            points_m,
            time_s,
            out_m_s,
            |out, later| *out += weight * (later - *out),
        )
    }

    /// The larger of those of the two fields about the time; of a time outside the series, the
    /// largest of all.
    fn max_gradient_per_s(&self, time_s: f64) -> f64 {
        let about = self
            .about(time_s)
            .map(|(at, weight)| at..=at + usize::from(weight.is_some()));
        let gradients = &self.max_gradient_per_s[about.unwrap_or(0..=self.time_s.len() - 1)];
        gradients.iter().copied().fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Edges, GridSnapshot, PlaneMesh, Side};
    use super::*;

    /// A uniform velocity on a small mesh.
    fn uniform(velocity_m_s: [f64; 3]) -> GridSnapshot {
        let axis: Vec<f64> = (0..4).map(f64::from).collect();
        let open = Edges::Bounded {
            low: Side::Open,
            high: Side::Open,
        };
        let mesh = PlaneMesh {
            y_m: axis.clone(),
            z_m: axis,
            y_edges: open,
            z_edges: open,
        };
        GridSnapshot::new(&mesh, &[velocity_m_s; 16]).unwrap()
    }

    fn series(times_s: &[f64], velocity: impl Fn(f64) -> [f64; 3]) -> Series {
        Series::new(times_s.iter().map(|&t| (t, uniform(velocity(t))))).unwrap()
    }

    fn at(wind: &Series, time_s: f64) -> Result<[f64; 3], Error> {
        let mut out = vec![[0.0; 3]; 259];
        wind.velocity_into(&vec![[0.0, 1.5, 1.5]; 259], time_s, &mut out)?;
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
            assert!(
                matches!(
                    at(&wind, t),
                    Err(Error::OutOfRange {
                        field: "time_s",
                        ..
                    })
                ),
                "{t}"
            );
        }
        assert!(Series::new([]).is_err());
        assert!(Series::new([(1.0, uniform([0.0; 3])), (1.0, uniform([0.0; 3]))]).is_err());
        assert_eq!(at(&series(&[2.0], |_| [1.0; 3]), 2.0).unwrap(), [1.0; 3]);
    }
}
