//! A wind: the velocity of the air at any point and time, computed in batches.
//!
//! Axes: x along the flight direction, y across it (to the right), z up; the ground is z = 0.
//!
//! Check: a sum of winds is the sum of the velocities, and wrong lengths are refused by every wind.

use crate::error::{Error, check_lengths};

/// The velocity field of the air.
///
/// Object safe, so that a scene may hold any wind as `Box<dyn Wind>`; batched, so that one virtual
/// call serves a whole line of sight. Analytic flows and sampled simulations implement it alike.
///
/// A point with a coordinate that is not a number gives a velocity that is not a number.
pub trait Wind: Send + Sync {
    /// Writes the velocity `(u, v, w)` \[m/s\] at each of `points_m` = `(x, y, z)` \[m\] into
    /// `out_m_s`.
    ///
    /// # Errors
    /// [`Error::LengthMismatch`] if the slices differ in length; what else depends on the wind.
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), Error>;

    /// Writes the velocity along a line, `e . u` \[m/s\], at its samples `first`, `first + 1`, ...
    /// into `out_m_s`. A sample has the same bits whatever samples are written with it.
    ///
    /// # Errors
    /// As [`Self::velocity_into`].
    fn along_line_into(
        &self,
        line: &SampledLine,
        first: usize,
        time_s: f64,
        out_m_s: &mut [f64],
    ) -> Result<(), Error> {
        let points_m: Vec<[f64; 3]> = (first..first + out_m_s.len())
            .map(|index| line.point_m(index))
            .collect();
        let mut velocity_m_s = vec![[0.0; 3]; points_m.len()];
        self.velocity_into(&points_m, time_s, &mut velocity_m_s)?;
        let [x, y, z] = line.direction;
        for (out, [u, v, w]) in out_m_s.iter_mut().zip(velocity_m_s) {
            *out = x * u + y * v + z * w;
        }
        Ok(())
    }

    /// Upper bound of the gradient of the radial velocity along any straight line,
    /// `|e . grad(u) . e|` for unit `e` \[1/s\]: the largest eigenvalue of the strain rate. It sets
    /// how thin the layers of a lidar signal must be. Each wind says how sharp its bound is.
    fn max_gradient_per_s(&self, time_s: f64) -> f64;
}

/// Equally spaced samples along a straight line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledLine {
    /// Sample 0 \[m\].
    pub origin_m: [f64; 3],
    /// Unit vector along the line.
    pub direction: [f64; 3],
    /// Distance between samples \[m\].
    pub step_m: f64,
}

impl SampledLine {
    /// Position of a sample \[m\].
    pub fn point_m(&self, index: usize) -> [f64; 3] {
        let along_m = index as f64 * self.step_m;
        [0, 1, 2].map(|d| self.origin_m[d] + along_m * self.direction[d])
    }
}

/// A wind that several owners share.
impl<T: Wind + ?Sized> Wind for std::sync::Arc<T> {
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        (**self).velocity_into(points_m, time_s, out_m_s)
    }

    fn along_line_into(
        &self,
        line: &SampledLine,
        first: usize,
        time_s: f64,
        out_m_s: &mut [f64],
    ) -> Result<(), Error> {
        (**self).along_line_into(line, first, time_s, out_m_s)
    }

    fn max_gradient_per_s(&self, time_s: f64) -> f64 {
        (**self).max_gradient_per_s(time_s)
    }
}

/// Lets `act` change each component of `out_m_s` by that of another wind at the same point.
pub(super) fn combine(
    wind: &dyn Wind,
    points_m: &[[f64; 3]],
    time_s: f64,
    out_m_s: &mut [[f64; 3]],
    act: impl Fn(&mut f64, f64),
) -> Result<(), Error> {
    // The path of a pair evaluates winds at one point some 100 000 times.
    let mut of_one = [[0.0; 3]];
    let mut of_many = Vec::new();
    let others: &mut [[f64; 3]] = if points_m.len() == 1 {
        &mut of_one
    } else {
        of_many.resize(points_m.len(), [0.0; 3]);
        &mut of_many
    };
    wind.velocity_into(points_m, time_s, others)?;
    out_m_s
        .as_flattened_mut()
        .iter_mut()
        .zip(others.as_flattened())
        .for_each(|(out, other)| act(out, *other));
    Ok(())
}

/// The sum of several winds in their order, such as a vortex pair in a cross wind. An empty sum is
/// air at rest.
impl Wind for Vec<Box<dyn Wind>> {
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        check_lengths(points_m.len(), out_m_s.len())?;
        out_m_s.fill([0.0; 3]);
        self.iter().try_for_each(|wind| {
            combine(&**wind, points_m, time_s, out_m_s, |sum, other| {
                *sum += other
            })
        })
    }

    fn along_line_into(
        &self,
        line: &SampledLine,
        first: usize,
        time_s: f64,
        out_m_s: &mut [f64],
    ) -> Result<(), Error> {
        out_m_s.fill(0.0);
        let mut one_m_s = vec![0.0; out_m_s.len()];
        for wind in self {
            wind.along_line_into(line, first, time_s, &mut one_m_s)?;
            for (sum, one) in out_m_s.iter_mut().zip(&one_m_s) {
                *sum += one;
            }
        }
        Ok(())
    }

    /// The sum of the bounds: sharp when one wind dominates.
    fn max_gradient_per_s(&self, time_s: f64) -> f64 {
        self.iter()
            .map(|wind| wind.max_gradient_per_s(time_s))
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::winds::Linear;

    #[test]
    fn sum_adds_velocities_and_gradients() {
        let uniform = |v| Box::new(Linear::uniform(v).unwrap()) as Box<dyn Wind>;
        let at_rest: Vec<Box<dyn Wind>> = Vec::new();
        let sum = vec![
            uniform([1.0, 2.0, 3.0]),
            Box::new(at_rest),
            uniform([0.5, -4.0, 0.25]),
        ];
        let points = vec![[0.0; 3]; 519];
        let mut out = vec![[9.0; 3]; points.len()];
        sum.velocity_into(&points, 0.0, &mut out).unwrap();
        assert!(out.iter().all(|&v| v == [1.5, -2.0, 3.25]));
        assert_eq!(sum.max_gradient_per_s(0.0), 0.0);
    }

    #[test]
    fn an_empty_sum_is_calm() {
        let mut out = [[9.0; 3]; 2];
        Vec::<Box<dyn Wind>>::new()
            .velocity_into(&[[1.0; 3]; 2], 0.0, &mut out)
            .unwrap();
        assert_eq!(out, [[0.0; 3]; 2]);
    }

    #[test]
    fn every_wind_refuses_slices_of_different_length() {
        let winds: [Box<dyn Wind>; 2] = [
            Box::new(Linear::uniform([1.0; 3]).unwrap()),
            Box::<Vec<Box<dyn Wind>>>::default(),
        ];
        for wind in &winds {
            let result = wind.velocity_into(&[[0.0; 3]; 3], 0.0, &mut [[0.0; 3]; 2]);
            assert_eq!(result, Err(Error::LengthMismatch { points: 3, out: 2 }));
        }
    }

    #[test]
    fn a_wind_that_is_not_finite_is_refused() {
        assert!(matches!(
            Linear::uniform([0.0, f64::NAN, 0.0]),
            Err(Error::OutOfRange {
                field: "linear wind",
                ..
            })
        ));
    }
}
