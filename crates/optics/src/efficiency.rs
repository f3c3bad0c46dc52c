//! The efficiency as a function of range, with its scatter and its statistical error.
//!
//! Check: the interpolation passes through the points, keeps monotone data monotone and refuses
//! to extrapolate; between ranges that follow the curvature it is the function itself, however
//! near the focus.

use crate::error::{check_length, finite, not_negative, positive};
use crate::{Error, Telescope};
use std::f64::consts::SQRT_2;

/// Efficiency at one range with its scatter and error, in the units of [`EfficiencyProfile`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct EfficiencyPoint {
    pub(crate) mean: f64,
    pub(crate) standard_deviation: f64,
    pub(crate) standard_error: f64,
}

impl EfficiencyPoint {
    /// An efficiency without scatter or error.
    pub(crate) fn exact(mean: f64) -> Self {
        Self {
            mean,
            standard_deviation: 0.0,
            standard_error: 0.0,
        }
    }

    /// The same, times a factor.
    #[cfg(feature = "screens")]
    pub(crate) fn times(self, factor: f64) -> Self {
        Self {
            mean: factor * self.mean,
            standard_deviation: factor * self.standard_deviation,
            standard_error: factor * self.standard_error,
        }
    }
}

/// eta_s(R) of (19): the summary of optics and turbulence that the rest of a simulation needs.
///
/// All four lists have the same length; `range_m` increases strictly. The default has no ranges,
/// which [`EfficiencyProfile::validated`] refuses.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EfficiencyProfile {
    /// Ranges \[m\].
    pub range_m: Vec<f64>,
    /// Mean efficiency at each range.
    pub mean: Vec<f64>,
    /// Standard deviation of the efficiency of one realisation, `sqrt(<eta^2> - <eta>^2)`; 0 for
    /// exact theory, NaN where it is not known (one realisation).
    pub standard_deviation: Vec<f64>,
    /// Standard error of `mean`; 0 for exact theory, NaN where it is not known: the monostatic mean
    /// needs two independent samples, the bistatic one three (an antithetic pair is one sample).
    pub standard_error: Vec<f64>,
}

impl EfficiencyProfile {
    /// A profile without scatter or error, from a function of range \[m\] (theory).
    ///
    /// # Errors
    /// What the function returns, and as [`EfficiencyProfile::validated`].
    pub fn from_theory(
        range_m: &[f64],
        mut efficiency: impl FnMut(f64) -> Result<f64, Error>,
    ) -> Result<Self, Error> {
        let mut profile = Self::default();
        for &range_m in range_m {
            profile.push(range_m, EfficiencyPoint::exact(efficiency(range_m)?));
        }
        profile.validated()
    }

    /// Appends a range.
    pub(crate) fn push(&mut self, range_m: f64, point: EfficiencyPoint) {
        self.range_m.push(range_m);
        self.mean.push(point.mean);
        self.standard_deviation.push(point.standard_deviation);
        self.standard_error.push(point.standard_error);
    }

    /// Range \[m\], mean and standard error, range by range.
    pub fn rows(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        let errors = self.mean.iter().zip(&self.standard_error);
        self.range_m
            .iter()
            .zip(errors)
            .map(|(range_m, (mean, error))| (*range_m, *mean, *error))
    }

    /// The profile itself when its lists belong together and hold allowed numbers.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::NotIncreasing`] or [`Error::OutOfRange`], naming the list.
    pub fn validated(self) -> Result<Self, Error> {
        let expected = self.range_m.len();
        if expected == 0 {
            return Err(Error::Length {
                field: "range_m",
                found: 0,
                expected: 1,
            });
        }
        let lists = [
            ("mean", &self.mean),
            ("standard_deviation", &self.standard_deviation),
            ("standard_error", &self.standard_error),
        ];
        for (field, list) in lists {
            check_length(field, list.len(), expected)?;
            for &value in list {
                // Scatter and error may be unknown (NaN); a mean is always known.
                if !value.is_nan() || field == "mean" {
                    not_negative(field, value)?;
                }
            }
        }
        check_increasing("range_m", &self.range_m)?;
        Ok(self)
    }

    /// Mean efficiency at `range_m` \[m\], by monotone cubic interpolation (Fritsch
    /// and Carlson 1980).
    ///
    /// # Errors
    /// [`Error::Extrapolation`] outside the profile, [`Error::OutOfRange`] for a range that
    /// is not a number.
    pub fn interpolated(&self, range_m: f64) -> Result<f64, Error> {
        let x = &self.range_m;
        let y = &self.mean;
        if x.is_empty() || y.len() != x.len() {
            return Err(Error::Length {
                field: "mean",
                found: y.len(),
                expected: x.len().max(1),
            });
        }
        let at = finite("range_m", range_m)?;
        let first_m = x[0];
        let last_m = x[x.len() - 1];
        if !(first_m..=last_m).contains(&at) {
            return Err(Error::Extrapolation {
                range_m: at,
                first_m,
                last_m,
            });
        }
        if x.len() == 1 {
            return Ok(y[0]);
        }
        let i = x.partition_point(|&v| v <= at).clamp(1, x.len() - 1) - 1;
        let h = x[i + 1] - x[i];
        let t = (at - x[i]) / h;
        let m0 = monotone_slope(x, y, i);
        let m1 = monotone_slope(x, y, i + 1);
        let t2 = t * t;
        let t3 = t * t * t;
        Ok((2.0 * t3 - 3.0 * t2 + 1.0) * y[i]
            + (t3 - 2.0 * t2 + t) * h * m0
            + (3.0 * t2 - 2.0 * t3) * y[i + 1]
            + (t3 - t2) * h * m1)
    }
}

/// Ranges from `first_m` to `last_m` \[m\] that follow the curvature of an efficiency: at most an
/// eighth of the path apart, and closer where the beam's width changes, mainly about a focus;
/// `density` times as many. At a density of 12, monotone cubics between them are within 1e-3 of the
/// function.
pub fn curved_ranges_m(telescope: &Telescope, first_m: f64, last_m: f64, density: f64) -> Vec<f64> {
    let start = range_coordinate(telescope, first_m, last_m);
    let end = range_coordinate(telescope, last_m, last_m);
    let steps = (density * (end - start)).ceil().max(1.0);
    let mut ranges_m = vec![first_m];
    for step in 1..steps as u32 {
        let target = start + (end - start) * f64::from(step) / steps;
        let mut low_m = first_m;
        let mut high_m = last_m;
        for _ in 0..60 {
            let middle_m = 0.5 * (low_m + high_m);
            if range_coordinate(telescope, middle_m, last_m) < target {
                low_m = middle_m;
            } else {
                high_m = middle_m;
            }
        }
        ranges_m.push(high_m);
    }
    ranges_m.push(last_m);
    ranges_m.dedup();
    ranges_m
}

/// A coordinate along the path, increasing, in which the ranges of [`curved_ranges_m`] are evenly
/// spaced.
///
/// The efficiency is a bell of (1/R - 1/F) times the Rayleigh length, about 1 wide, that falls with
/// its square: even steps in its area sine.
fn range_coordinate(telescope: &Telescope, range_m: f64, last_m: f64) -> f64 {
    let width_m = telescope
        .intensity_radius_m()
        .min(telescope.aperture_radius_m / SQRT_2);
    let rayleigh_m = telescope.wavenumber_rad_m() * width_m * width_m;
    let defocus = rayleigh_m * (1.0 / range_m - telescope.focus.curvature_per_m());
    8.0 * range_m / last_m - 3.0 * defocus.asinh()
}

/// Slope at point `i` that preserves monotone data (weighted harmonic mean of the two secants).
fn monotone_slope(x: &[f64], y: &[f64], i: usize) -> f64 {
    let last = x.len() - 1;
    if last == 1 {
        return secant_slope(x, y, 0);
    }
    if i == 0 {
        return end_slope(x, y, 0, 1);
    }
    if i == last {
        return end_slope(x, y, last - 1, last - 2);
    }
    let left = secant_slope(x, y, i - 1);
    let right = secant_slope(x, y, i);
    if left * right <= 0.0 {
        return 0.0;
    }
    let h0 = x[i] - x[i - 1];
    let h1 = x[i + 1] - x[i];
    let w0 = 2.0 * h1 + h0;
    let w1 = h1 + 2.0 * h0;
    (w0 + w1) / (w0 / left + w1 / right)
}

/// Slope at an end of the data from the secants of interval `next` at the end and of its neighbour
/// `beyond`, limited so that monotone data stay monotone.
fn end_slope(x: &[f64], y: &[f64], next: usize, beyond: usize) -> f64 {
    let near = secant_slope(x, y, next);
    let far = secant_slope(x, y, beyond);
    let h0 = x[next + 1] - x[next];
    let h1 = x[beyond + 1] - x[beyond];
    let slope = ((2.0 * h0 + h1) * near - h0 * far) / (h0 + h1);
    if slope * near <= 0.0 {
        0.0
    } else if near * far < 0.0 && slope.abs() > 3.0 * near.abs() {
        3.0 * near
    } else {
        slope
    }
}

/// Slope of the straight line across interval `j`.
fn secant_slope(x: &[f64], y: &[f64], j: usize) -> f64 {
    (y[j + 1] - y[j]) / (x[j + 1] - x[j])
}

/// Every entry positive and finite, each above the one before.
pub(crate) fn check_increasing(field: &'static str, list: &[f64]) -> Result<(), Error> {
    for (index, &value) in list.iter().enumerate() {
        positive(field, value)?;
        if index > 0 && value <= list[index - 1] {
            return Err(Error::NotIncreasing {
                field,
                index,
                value,
            });
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
    fn ranges_that_follow_the_curvature_give_the_function_at_and_beside_any_focus() {
        use crate::theory::free_space_efficiency;
        let wide = Telescope {
            aperture_radius_m: 0.15,
            beam_radius_m: 0.09,
            ..Telescope::table2()
        };
        for (telescope, focus, first_m, last_m) in [
            (Telescope::table2(), crate::Focus::At(300.0), 150.0, 3000.0),
            (wide, crate::Focus::At(600.0), 200.0, 3000.0),
            (
                Telescope {
                    beam_radius_m: f64::INFINITY,
                    ..wide
                },
                crate::Focus::At(450.0),
                250.0,
                900.0,
            ),
        ] {
            let telescope = Telescope { focus, ..telescope };
            let ranges_m = curved_ranges_m(&telescope, first_m, last_m, 12.0);
            assert!(
                ranges_m.len() < 600 && ranges_m.windows(2).all(|r| r[1] > r[0]),
                "{ranges_m:?}"
            );
            let exact = |r| free_space_efficiency(&telescope, r);
            let profile = EfficiencyProfile::from_theory(&ranges_m, exact).unwrap();
            let mut worst = 0f64;
            for i in 0..80 {
                let range_m = first_m * (last_m / first_m).powf((f64::from(i) + 0.37) / 80.0);
                worst = worst.max(
                    (profile.interpolated(range_m).unwrap() / exact(range_m).unwrap() - 1.0).abs(),
                );
            }
            assert!(worst < 1e-3, "{focus:?}: {worst}");
        }
    }

    #[test]
    fn extrapolation_is_refused_with_the_limits() {
        let p = profile(&[100.0, 200.0], &[0.1, 0.2]);
        assert_eq!(
            p.interpolated(99.0),
            Err(Error::Extrapolation {
                range_m: 99.0,
                first_m: 100.0,
                last_m: 200.0
            })
        );
        assert_eq!(refused(p.interpolated(f64::NAN)), "range_m");
        assert!((p.interpolated(150.0).unwrap() - 0.15).abs() < 1e-15);
    }

    #[test]
    fn lists_that_do_not_belong_together_are_refused() {
        let mut p = profile(&[100.0, 200.0], &[0.1, 0.2]);
        p.standard_error.pop();
        assert_eq!(refused(p.validated()), "standard_error");
        assert_eq!(
            refused(profile(&[200.0, 100.0], &[0.1, 0.2]).validated()),
            "range_m"
        );
        assert_eq!(refused(profile(&[100.0], &[f64::NAN]).validated()), "mean");
        let mut p = profile(&[100.0, 200.0], &[0.1, 0.2]);
        p.standard_error = vec![f64::NAN; 2];
        let p = p.validated().unwrap();
        p.interpolated(150.0).unwrap();
    }
}
