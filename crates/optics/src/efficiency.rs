//! The efficiency as a function of range, with its scatter and its statistical error.
//!
//! Check: the interpolation passes through the points, keeps monotone data monotone and refuses to extrapolate.

use crate::Error;
use crate::error::{finite, not_negative, positive};

/// eta_s(R) of (19): what the rest of a simulation needs to know about optics and turbulence.
///
/// All four lists have the same length; `range_m` increases strictly.
#[derive(Debug, Clone, PartialEq)]
pub struct EfficiencyProfile {
    /// Ranges \[m\].
    pub range_m: Vec<f64>,
    /// Mean efficiency at each range.
    pub mean: Vec<f64>,
    /// Standard deviation of the efficiency of one realisation, `sqrt(<eta^2> - <eta>^2)`; 0 for exact theory, NaN where it is
    /// not known (one realisation).
    pub standard_deviation: Vec<f64>,
    /// Standard error of `mean`; 0 for exact theory, NaN where it is not known: the monostatic mean needs two independent
    /// samples, the bistatic one three (an antithetic pair is one sample).
    pub standard_error: Vec<f64>,
}

impl EfficiencyProfile {
    /// A profile without scatter or error, from a function of range \[m\] (theory).
    ///
    /// # Errors
    /// What the function returns, and as [`EfficiencyProfile::validated`].
    pub fn from_theory(range_m: &[f64], mut efficiency: impl FnMut(f64) -> Result<f64, Error>) -> Result<Self, Error> {
        let mean = range_m.iter().map(|&r| efficiency(r)).collect::<Result<Vec<_>, _>>()?;
        Self {
            range_m: range_m.to_vec(),
            standard_deviation: vec![0.0; mean.len()],
            standard_error: vec![0.0; mean.len()],
            mean,
        }
        .validated()
    }

    /// The profile itself when its lists belong together and hold allowed numbers.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::NotIncreasing`] or [`Error::OutOfRange`], naming the list.
    pub fn validated(self) -> Result<Self, Error> {
        let expected = self.range_m.len();
        if expected == 0 {
            return Err(Error::Length { field: "range_m", found: 0, expected: 1 });
        }
        let lists = [
            ("mean", &self.mean),
            ("standard_deviation", &self.standard_deviation),
            ("standard_error", &self.standard_error),
        ];
        for (field, list) in lists {
            if list.len() != expected {
                return Err(Error::Length { field, found: list.len(), expected });
            }
            for &value in list {
                // A scatter that nobody knows is no mistake; a mean is always known.
                if !value.is_nan() || field == "mean" {
                    not_negative(field, value)?;
                }
            }
        }
        check_increasing("range_m", &self.range_m)?;
        Ok(self)
    }

    /// Mean efficiency at `range_m` \[m\], by monotone cubic interpolation (Fritsch and Carlson 1980).
    ///
    /// # Errors
    /// [`Error::Extrapolation`] outside the profile, [`Error::OutOfRange`] for a range that is not a number.
    pub fn interpolated(&self, range_m: f64) -> Result<f64, Error> {
        self.interpolate(&self.mean, range_m)
    }

    /// Standard deviation of one realisation at `range_m` \[m\], interpolated as the mean is.
    ///
    /// # Errors
    /// As [`EfficiencyProfile::interpolated`]; [`Error::NotKnown`] where one realisation leaves it open.
    pub fn interpolated_standard_deviation(&self, range_m: f64) -> Result<f64, Error> {
        let value = self.interpolate(&self.standard_deviation, range_m)?;
        known(value, "standard_deviation", "two realisations have a scatter, one has none")
    }

    /// Standard error of the mean at `range_m` \[m\], interpolated as the mean is.
    ///
    /// # Errors
    /// As [`EfficiencyProfile::interpolated`]; [`Error::NotKnown`] where too few realisations leave it open.
    pub fn interpolated_standard_error(&self, range_m: f64) -> Result<f64, Error> {
        let value = self.interpolate(&self.standard_error, range_m)?;
        known(
            value,
            "standard_error",
            "two independent samples give that of the monostatic mean, three that of the bistatic one",
        )
    }

    fn interpolate(&self, y: &[f64], range_m: f64) -> Result<f64, Error> {
        let x = &self.range_m;
        if x.is_empty() || y.len() != x.len() {
            return Err(Error::Length { field: "mean", found: y.len(), expected: x.len().max(1) });
        }
        let at = finite("range_m", range_m)?;
        let (first_m, last_m) = (x[0], x[x.len() - 1]);
        if !(first_m..=last_m).contains(&at) {
            return Err(Error::Extrapolation { range_m: at, first_m, last_m });
        }
        if x.len() == 1 {
            return Ok(y[0]);
        }
        let i = x.partition_point(|&v| v <= at).clamp(1, x.len() - 1) - 1;
        let h = x[i + 1] - x[i];
        let t = (at - x[i]) / h;
        let (m0, m1) = (monotone_slope(x, y, i), monotone_slope(x, y, i + 1));
        let (t2, t3) = (t * t, t * t * t);
        Ok((2.0 * t3 - 3.0 * t2 + 1.0) * y[i]
            + (t3 - 2.0 * t2 + t) * h * m0
            + (3.0 * t2 - 2.0 * t3) * y[i + 1]
            + (t3 - t2) * h * m1)
    }
}

fn known(value: f64, field: &'static str, needed: &'static str) -> Result<f64, Error> {
    if value.is_nan() { Err(Error::NotKnown { field, needed }) } else { Ok(value) }
}

/// Slope at point `i` which keeps monotone data monotone (weighted harmonic mean of the two secants).
fn monotone_slope(x: &[f64], y: &[f64], i: usize) -> f64 {
    let secant = |j: usize| (y[j + 1] - y[j]) / (x[j + 1] - x[j]);
    let last = x.len() - 1;
    if last == 1 {
        return secant(0);
    }
    if i == 0 || i == last {
        let (near, far, h0, h1) = if i == 0 {
            (secant(0), secant(1), x[1] - x[0], x[2] - x[1])
        } else {
            (secant(last - 1), secant(last - 2), x[last] - x[last - 1], x[last - 1] - x[last - 2])
        };
        let slope = ((2.0 * h0 + h1) * near - h0 * far) / (h0 + h1);
        return if slope * near <= 0.0 {
            0.0
        } else if near * far < 0.0 && slope.abs() > 3.0 * near.abs() {
            3.0 * near
        } else {
            slope
        };
    }
    let (left, right) = (secant(i - 1), secant(i));
    if left * right <= 0.0 {
        return 0.0;
    }
    let (h0, h1) = (x[i] - x[i - 1], x[i + 1] - x[i]);
    let (w0, w1) = (2.0 * h1 + h0, h1 + 2.0 * h0);
    (w0 + w1) / (w0 / left + w1 / right)
}

/// Every entry positive and finite, each above the one before.
pub(crate) fn check_increasing(field: &'static str, list: &[f64]) -> Result<(), Error> {
    for (index, &value) in list.iter().enumerate() {
        positive(field, value)?;
        if index > 0 && value <= list[index - 1] {
            return Err(Error::NotIncreasing { field, index, value });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::refused;

    fn profile(range_m: &[f64], mean: &[f64]) -> EfficiencyProfile {
        EfficiencyProfile {
            range_m: range_m.to_vec(),
            mean: mean.to_vec(),
            standard_deviation: vec![0.0; mean.len()],
            standard_error: vec![0.0; mean.len()],
        }
    }

    #[test]
    fn interpolation_passes_through_the_points_and_stays_monotone() {
        let p = profile(&[100.0, 200.0, 250.0, 900.0], &[0.0, 0.1, 0.5, 0.51]);
        for (r, m) in p.range_m.iter().zip(&p.mean) {
            assert!((p.interpolated(*r).unwrap() - m).abs() < 1e-15);
        }
        let mut before = 0.0;
        for i in 0..=800 {
            let now = p.interpolated(100.0 + f64::from(i)).unwrap();
            assert!(now >= before - 1e-15);
            before = now;
        }
    }

    #[test]
    fn interpolation_is_third_order_on_a_smooth_curve() {
        let error = |n: u32| {
            let x: Vec<f64> = (0..=n).map(|i| 1.0 + f64::from(i) / f64::from(n)).collect();
            let y: Vec<f64> = x.iter().map(|v| v * v).collect();
            let p = profile(&x, &y);
            (p.interpolated(1.503).unwrap() - 1.503f64.powi(2)).abs()
        };
        assert!(error(40) < 1e-4);
    }

    #[test]
    fn extrapolation_is_refused_with_the_limits() {
        let p = profile(&[100.0, 200.0], &[0.1, 0.2]);
        assert_eq!(p.interpolated(99.0), Err(Error::Extrapolation { range_m: 99.0, first_m: 100.0, last_m: 200.0 }));
        assert_eq!(refused(p.interpolated(f64::NAN)), "range_m");
        assert!((p.interpolated(150.0).unwrap() - 0.15).abs() < 1e-15);
    }

    #[test]
    fn lists_that_do_not_belong_together_are_refused() {
        let mut p = profile(&[100.0, 200.0], &[0.1, 0.2]);
        p.standard_error.pop();
        assert_eq!(refused(p.validated()), "standard_error");
        assert_eq!(refused(profile(&[200.0, 100.0], &[0.1, 0.2]).validated()), "range_m");
        assert_eq!(refused(profile(&[100.0], &[f64::NAN]).validated()), "mean");
        let mut p = profile(&[100.0, 200.0], &[0.1, 0.2]);
        p.standard_error = vec![f64::NAN; 2];
        let p = p.validated().unwrap();
        assert!(matches!(p.interpolated_standard_error(150.0), Err(Error::NotKnown { field: "standard_error", .. })));
        p.interpolated(150.0).unwrap();
    }
}
