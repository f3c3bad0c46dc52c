//! The radius rho(R) that a target variance needs: small where the signal is strong or the lines are close, larger
//! where they are not.
//!
//! A large region averages noise away and blurs the vortex; this takes the smallest sufficient one. The information of a region is
//! the sum over its pulses of that of the record that the chord covers. Check: the requested variance is reached and
//! not by much more; the radius grows with range.

use crate::error::{Error, positive};
use crate::estimators::tails::bisected;
use crate::map::{PolarPoint, Radius, ScanGeometry};

/// Bisections of the radius: to a thousandth of the largest.
const BISECTIONS: usize = 10;

impl ScanGeometry {
    /// Smallest radius \[m\] about `point` whose region has at least `information`, 1/(m/s)^2, to a thousandth of `largest_m`. `by_gates`
    /// holds the information of a pulse in a chord of 1, 2, .. gates.
    ///
    /// `None` if even `largest_m` is too small.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless `information` and `largest_m` are above 0.
    pub fn radius_for(
        &self,
        point: PolarPoint,
        information: f64,
        by_gates: &[f64],
        largest_m: f64,
    ) -> Result<Option<f64>, Error> {
        positive("information", information)?;
        positive("largest_m", largest_m)?;
        if !self.has_information(point, largest_m, by_gates, information) {
            return Ok(None);
        }
        if self.has_information(point, 0.0, by_gates, information) {
            return Ok(Some(0.0));
        }
        let [_, enough_m] = bisected(0.0, largest_m, BISECTIONS, |radius_m| {
            !self.has_information(point, radius_m, by_gates, information)
        });
        Ok(Some(enough_m))
    }

    /// Whether the region of a radius has at least `needed` information.
    fn has_information(
        &self,
        point: PolarPoint,
        radius_m: f64,
        by_gates: &[f64],
        needed: f64,
    ) -> bool {
        self.information(point, radius_m, [by_gates])[0] >= needed
    }
}

impl Radius {
    /// rho(R) for a target standard deviation `target_m_s` \[m/s\] of velocity: the smallest region in the middle of
    /// the scan that is enough, at most `largest_m`.
    ///
    /// `by_gates` gives the information of one pulse on the velocity, 1/(m/s)^2, in chords of 1, 2, .. gates at a range \[m\]:
    /// that of the record ([`RecordModel::information`](crate::bound::RecordModel::information)) for the signal-to-noise ratio
    /// there, less the losses of the estimator. The radius is interpolated in a table of 65 increasing ranges. Where `largest_m`
    /// does not reach the target it is used all the same; the bound reports it.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a target or radius that is not above 0.
    pub fn for_standard_deviation(
        geometry: &ScanGeometry,
        by_gates: impl Fn(f64) -> Vec<f64>,
        target_m_s: f64,
        largest_m: f64,
    ) -> Result<Self, Error> {
        positive("target_m_s", target_m_s)?;
        let ranges_m = geometry.gate_ranges_m();
        let line = geometry.lines() / 2;
        let first_m = ranges_m[0];
        let last_m = ranges_m[ranges_m.len() - 1];
        let step_m = (last_m - first_m) / 64.0;
        let information = target_m_s.powi(-2);
        let mut table_m = Vec::with_capacity(65);
        for k in 0..=64 {
            let range_m = first_m + f64::from(k) * step_m;
            let point = PolarPoint::on_line(range_m, line);
            let radius_m =
                geometry.radius_for(point, information, &by_gates(range_m), largest_m)?;
            table_m.push(radius_m.unwrap_or(largest_m));
        }
        Ok(Self::OfRange(Box::new(move |range_m| {
            let place = if step_m > 0.0 {
                ((range_m - first_m) / step_m).clamp(0.0, 64.0)
            } else {
                0.0
            };
            let below = (place as usize).min(63);
            table_m[below] + (table_m[below + 1] - table_m[below]) * (place - below as f64)
        })))
    }
}
