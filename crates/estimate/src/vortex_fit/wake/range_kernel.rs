//! Radial velocity as a range gate reports it: the wind along a line weighted by pulse and window, with derivatives.
//!
//! v(R) = sum over i of w_i v_R(R + offset_i), the weights summing to 1: (28), corrected, on a grid.
//! Check: a linear wind is kept but for the mean offset; gates between grid points are interpolated; derivatives against
//! difference quotients.

use multiversion::multiversion;
use statrs::function::erf::erf;
use std::f64::consts::SQRT_2;

use crate::error::{Error, finite, not_negative, positive};
use crate::linalg::dot;
use crate::vortex_fit::wake::pair::Ray;
use crate::vortex_fit::{PARAMETERS, Wake, WakeModel};
use crate::window::SPEED_OF_LIGHT_M_S;

/// Gates closer than this part of the distance of points stay between them: a grid that they fall on would have many points more.
const CLOSE: f64 = 0.75;

/// Weights of the air about the range of a gate.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeKernel {
    first_offset_m: f64,
    spacing_m: f64,
    weights: Vec<f64>,
}

impl RangeKernel {
    /// `weights` of the air at R + `first_offset_m`, `spacing_m` apart; they are scaled to the sum 1.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an offset or weight that is not finite, a spacing or a sum that is not positive.
    pub fn new(first_offset_m: f64, spacing_m: f64, weights: &[f64]) -> Result<Self, Error> {
        finite("first_offset_m", first_offset_m)?;
        positive("spacing_m", spacing_m)?;
        weights.iter().try_for_each(|w| finite("weights", *w))?;
        let sum: f64 = weights.iter().sum();
        positive("sum of the weights", sum)?;
        let weights = weights.iter().map(|w| w / sum).collect();
        Ok(Self {
            first_offset_m,
            spacing_m,
            weights,
        })
    }

    /// The weights of a Gaussian pulse of 1/e half-width `pulse_sigma_s` \[s\] seen through the window `window`, h_n, of samples
    /// `period_s` \[s\] apart: |f|^2 convolved with h^2, on a grid of `spacing_m` \[m\]. A window of one sample gives the
    /// weights of the pulse alone (whose range is then c T_s/4 before that of the window, as [`Gates`](crate::Gates) place it).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for numbers that are not positive or a window without power.
    pub fn gaussian_gate(
        pulse_sigma_s: f64,
        window: &[f64],
        period_s: f64,
        spacing_m: f64,
    ) -> Result<Self, Error> {
        positive("pulse_sigma_s", pulse_sigma_s)?;
        positive("period_s", period_s)?;
        positive("spacing_m", spacing_m)?;
        positive("power of the window", window.iter().map(|h| h * h).sum())?;
        let half_s = 0.5 * window.len() as f64 * period_s;
        let reach =
            (0.5 * SPEED_OF_LIGHT_M_S * (half_s + 4.0 * pulse_sigma_s) / spacing_m).ceil() as i64;
        let weights: Vec<f64> = (-reach..=reach)
            .map(|i| {
                let time_s = 2.0 * i as f64 * spacing_m / SPEED_OF_LIGHT_M_S;
                let terms = window.iter().enumerate().map(|(n, h)| {
                    let away = (time_s - n as f64 * period_s + half_s) / pulse_sigma_s;
                    h * h * (-away * away).exp()
                });
                terms.sum()
            })
            .collect();
        Self::new(-(reach as f64) * spacing_m, spacing_m, &weights)
    }

    /// The weights of a gate of that length \[m\], a rectangle, seen by a pulse whose power has that standard deviation in range \[m\], 0 if it is not
    /// known; on a grid of `spacing_m` \[m\].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a length or a spacing that is not positive, or a negative deviation.
    pub fn rectangular_gate(
        pulse_std_m: f64,
        length_m: f64,
        spacing_m: f64,
    ) -> Result<Self, Error> {
        not_negative("pulse_std_m", pulse_std_m)?;
        positive("length_m", length_m)?;
        positive("spacing_m", spacing_m)?;
        // The ends of a rectangle alone are smooth on the scale of the grid.
        let std_m = pulse_std_m.max(0.25 * spacing_m);
        let reach = ((0.5 * length_m + 4.0 * std_m) / spacing_m).ceil() as i64;
        let scale_m = SQRT_2 * std_m;
        let mut weights = Vec::with_capacity(2 * reach as usize + 1);
        for i in -reach..=reach {
            let offset_m = i as f64 * spacing_m;
            let far = erf((offset_m + 0.5 * length_m) / scale_m);
            let near = erf((offset_m - 0.5 * length_m) / scale_m);
            weights.push(far - near);
        }
        Self::new(-(reach as f64) * spacing_m, spacing_m, &weights)
    }

    /// Root mean square width of the weights \[m\].
    pub(crate) fn width_m(&self) -> f64 {
        self.moment(2, self.moment(1, 0.0)).max(0.0).sqrt()
    }

    /// Moment of the weights about an offset from the range of the gate.
    fn moment(&self, power: i32, centre_m: f64) -> f64 {
        let offsets = (0..self.weights.len())
            .map(|i| self.first_offset_m + i as f64 * self.spacing_m - centre_m);
        offsets
            .zip(&self.weights)
            .map(|(offset_m, w)| offset_m.powi(power) * w)
            .sum()
    }

    /// How often the distance of its points goes into a length \[m\], rounded down.
    pub(crate) fn points_within(&self, length_m: f64) -> usize {
        (length_m / self.spacing_m) as usize
    }

    /// Distance of the centre of the weights from the range of the gate \[m\].
    pub(crate) fn mean_offset_m(&self) -> f64 {
        let away = self
            .weights
            .iter()
            .enumerate()
            .map(|(i, w)| i as f64 * self.spacing_m * w)
            .sum::<f64>();
        self.first_offset_m + away
    }

    /// The centre of the weights alone, which sees of a linear wind what they see.
    pub(crate) fn middle(&self) -> Self {
        Self {
            first_offset_m: self.mean_offset_m(),
            spacing_m: self.spacing_m,
            weights: vec![1.0],
        }
    }

    /// The same kernel on a grid about `factor` times as coarse.
    pub(crate) fn coarser(&self, factor: usize) -> Self {
        if factor <= 1 || self.weights.len() <= factor {
            return self.clone();
        }
        let chunks = self.weights.chunks(factor);
        let weights = chunks.map(|chunk| chunk.iter().sum()).collect();
        Self {
            first_offset_m: self.first_offset_m + 0.5 * (factor - 1) as f64 * self.spacing_m,
            spacing_m: factor as f64 * self.spacing_m,
            weights,
        }
    }

    /// The same kernel on a grid about `factor` times as coarse that divides `step_m`: gates so far apart fall on its points. Weights are shared
    /// by the two points about them, which keeps their sum and their mean offset. Gates that are closer than its points stay between them.
    pub(crate) fn dividing(&self, step_m: f64, factor: usize) -> Self {
        let parts = step_m / (factor as f64 * self.spacing_m);
        if parts < CLOSE {
            return self.coarser(factor);
        }
        let spacing_m = step_m / parts.round().max(1.0);
        let ratio = self.spacing_m / spacing_m;
        let mut weights = vec![0.0; ((self.weights.len() - 1) as f64 * ratio) as usize + 2];
        for (i, weight) in self.weights.iter().enumerate() {
            let place = (i as f64 * ratio) as usize;
            let part = (i as f64 * ratio).fract();
            weights[place] += (1.0 - part) * weight;
            weights[place + 1] += part * weight;
        }
        Self {
            first_offset_m: self.first_offset_m,
            spacing_m,
            weights,
        }
    }

    /// The weights for a gate that lies by that share of the way to the next point: linear between both.
    fn between<'w>(&self, share: f64, out: &'w mut Vec<f64>) -> &'w [f64] {
        out.clear();
        out.extend(self.weights.iter().map(|weight| (1.0 - share) * weight));
        out.push(0.0);
        out[1..]
            .iter_mut()
            .zip(&self.weights)
            .for_each(|(out, weight)| *out += share * weight);
        out
    }

    /// Points of the air that gates at those ranges see.
    pub(crate) fn points_m(&self, range_m: &[f64]) -> impl Iterator<Item = f64> {
        let nearest_m = range_m.iter().copied().fold(f64::INFINITY, f64::min);
        let farthest_m = range_m.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let points =
            ((farthest_m - nearest_m) / self.spacing_m).ceil() as usize + self.weights.len() + 1;
        (0..points).map(move |i| nearest_m + self.first_offset_m + i as f64 * self.spacing_m)
    }

    /// The first of these points that a gate so far from the nearest one sees, and the part of the way to the next one at which it lies.
    pub(crate) fn place(&self, away_m: f64) -> (usize, f64) {
        let place = away_m / self.spacing_m;
        let index = (place + 1e-9).floor();
        (index as usize, (place - index).max(0.0))
    }

    /// Gate velocities of a line, and with `slopes` their derivatives: `out(gate, velocity, derivatives)` for each range.
    pub(crate) fn apply(
        &self,
        (model, wake, ray): (&WakeModel, &Wake, Ray),
        range_m: &[f64],
        slopes: bool,
        scratch: &mut LineScratch,
        mut out: impl FnMut(usize, f64, &[f64; PARAMETERS]),
    ) {
        let nearest_m = range_m.iter().copied().fold(f64::INFINITY, f64::min);
        scratch.points_m.clear();
        scratch.points_m.extend(self.points_m(range_m));
        scratch
            .rows
            .resize_with(if slopes { PARAMETERS + 1 } else { 1 }, Vec::new);
        model.along(wake, &scratch.points_m, ray, &mut scratch.rows);
        for (gate, &r_m) in range_m.iter().enumerate() {
            let (index, part) = self.place(r_m - nearest_m);
            let weights = if part > 1e-6 {
                self.between(part, &mut scratch.weights)
            } else {
                &self.weights
            };
            let found = means(weights, &scratch.rows, index);
            let mut slope = [0.0; PARAMETERS];
            slope.copy_from_slice(&found[1..]);
            out(gate, found[0], &slope);
        }
    }
}

/// Wind on the grid of one line.
#[derive(Debug, Default)]
pub(crate) struct LineScratch {
    points_m: Vec<f64>,
    rows: Vec<Vec<f64>>,
    weights: Vec<f64>,
}

/// Mean velocity of the gate whose first weight falls on grid point `index`, and the means of the other rows.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn means(weights: &[f64], rows: &[Vec<f64>], index: usize) -> [f64; PARAMETERS + 1] {
    let mut found = [0.0; PARAMETERS + 1];
    for (found, row) in found.iter_mut().zip(rows) {
        *found = dot(weights, &row[index..index + weights.len()]);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn wake() -> Wake {
        Wake::from_array(&[
            480.0, 520.0, 376.5, 45.0, 423.5, 49.0, 2.0, 2.7, 1.3, 0.02, 0.0,
        ])
    }

    fn gate() -> RangeKernel {
        let window: Vec<f64> = (0..64)
            .map(|n| (-0.5 * ((f64::from(n) - 31.5) / 16.0).powi(2)).exp())
            .collect();
        RangeKernel::gaussian_gate(120e-9, &window, 4e-9, 0.6).unwrap()
    }

    #[test]
    fn a_rectangular_gate_has_the_variances_of_rectangle_and_pulse_and_a_flat_top() {
        for (pulse_std_m, length_m) in [(0.0, 60.0), (4.0, 60.0), (12.0, 18.0)] {
            let kernel = RangeKernel::rectangular_gate(pulse_std_m, length_m, 0.5).unwrap();
            let expected_m = (length_m * length_m / 12.0 + pulse_std_m * pulse_std_m).sqrt();
            assert_relative_eq!(kernel.width_m(), expected_m, max_relative = 1e-3);
            assert!(kernel.moment(1, 0.0).abs() < 1e-12);
            let middle = kernel.weights.len() / 2;
            if length_m > 10.0 * pulse_std_m {
                let over_middle = kernel.weights[middle + 30] / kernel.weights[middle];
                assert!((over_middle - 1.0).abs() < 1e-3, "{over_middle}");
            }
        }
        assert!(RangeKernel::rectangular_gate(-1.0, 30.0, 1.0).is_err());
        assert!(RangeKernel::rectangular_gate(1.0, 0.0, 1.0).is_err());
    }

    #[test]
    fn a_linear_wind_is_seen_a_quarter_sample_before_the_range_of_the_gate() {
        let model = WakeModel::default();
        let calm = Wake::from_array(&[0.0, 0.0, 376.5, 45.0, 423.5, 49.0, 2.0, 2.7, 1.0, 0.1, 0.0]);
        let elevation_rad = 0.3_f64;
        let ranges = [300.0, 300.25, 412.3];
        gate().apply(
            (&model, &calm, Ray::new(elevation_rad)),
            &ranges,
            false,
            &mut LineScratch::default(),
            |i, v, _| {
                let at_m = ranges[i] - 0.25 * SPEED_OF_LIGHT_M_S * 4e-9;
                let expected = (1.0 + 0.1 * at_m * elevation_rad.sin()) * elevation_rad.cos();
                assert_relative_eq!(v, expected, max_relative = 1e-9);
            },
        );
    }

    #[test]
    fn weights_have_the_width_of_pulse_and_window_and_a_coarser_grid_keeps_it() {
        // variance of |f|^2: sigma^2 / 2; of h^2: 8^2 * 2 samples^2
        let expected = 0.5
            * SPEED_OF_LIGHT_M_S
            * (120e-9_f64.powi(2) / 2.0 + (16.0 * 4e-9_f64).powi(2) / 2.0).sqrt();
        assert_relative_eq!(gate().width_m(), expected, max_relative = 2e-2);
        assert_relative_eq!(gate().coarser(4).width_m(), expected, max_relative = 3e-2);
        assert!(gate().coarser(4).weights.len() < gate().weights.len() / 3);
        for (step_m, factor) in [(6.0, 1), (5.9, 2), (2.9, 4)] {
            let dividing = gate().dividing(step_m, factor);
            assert_relative_eq!(dividing.width_m(), expected, max_relative = 3e-2);
            assert_relative_eq!(
                dividing.middle().first_offset_m,
                gate().middle().first_offset_m,
                epsilon = 1e-9
            );
            assert_relative_eq!(
                dividing.weights.iter().sum::<f64>(),
                1.0,
                max_relative = 1e-12
            );
            let parts = step_m / dividing.spacing_m;
            assert!(
                (parts - parts.round()).abs() < 1e-9
                    && dividing.spacing_m < 1.5 * factor as f64 * gate().spacing_m
            );
        }
    }

    #[test]
    fn derivatives_of_gate_velocities_are_difference_quotients() {
        let model = WakeModel::default();
        let kernel = gate();
        let ray = Ray::new(0.12);
        let ranges = [377.7, 400.0];
        let values = |wake: &Wake| {
            let mut values = vec![];
            kernel.apply(
                (&model, wake, ray),
                &ranges,
                false,
                &mut LineScratch::default(),
                |_, v, _| values.push(v),
            );
            values
        };
        kernel.apply(
            (&model, &wake(), ray),
            &ranges,
            true,
            &mut LineScratch::default(),
            |gate, velocity, slope| {
                assert_eq!(velocity, values(&wake())[gate]);
                for (index, slope) in slope.iter().enumerate() {
                    let moved = |by: f64| {
                        let mut p = wake().to_array();
                        p[index] += by;
                        values(&Wake::from_array(&p))[gate]
                    };
                    let quotient = (moved(1e-4) - moved(-1e-4)) / 2e-4;
                    assert_relative_eq!(*slope, quotient, max_relative = 1e-6, epsilon = 1e-8);
                }
            },
        );
    }

    #[test]
    fn the_middle_alone_sees_the_same_of_a_linear_wind() {
        let calm = Wake::from_array(&[0.0, 0.0, 376.5, 45.0, 423.5, 49.0, 2.0, 2.7, 1.0, 0.1, 0.0]);
        let lopsided = RangeKernel::new(-10.0, 4.0, &[0.1, 0.4, 0.3, 0.15, 0.05]).unwrap();
        let seen = |kernel: &RangeKernel| {
            let mut seen = Vec::new();
            let ray = Ray::new(0.3);
            let take = |_, v, _: &[f64; PARAMETERS]| seen.push(v);
            kernel.apply(
                (&WakeModel::default(), &calm, ray),
                &[300.0, 333.3],
                false,
                &mut LineScratch::default(),
                take,
            );
            seen
        };
        for (whole, middle) in seen(&lopsided).into_iter().zip(seen(&lopsided.middle())) {
            assert_relative_eq!(whole, middle, max_relative = 1e-12);
        }
    }

    #[test]
    fn kernels_without_weight_or_spacing_are_refused() {
        assert!(RangeKernel::new(0.0, 1.0, &[]).is_err());
        assert!(RangeKernel::new(0.0, 0.0, &[1.0]).is_err());
        assert!(RangeKernel::new(0.0, 1.0, &[1.0, f64::NAN]).is_err());
        assert!(RangeKernel::gaussian_gate(120e-9, &[0.0; 4], 4e-9, 1.0).is_err());
    }
}
