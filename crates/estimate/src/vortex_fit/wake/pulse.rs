//! The envelope of the pulse as the likelihood needs it, and the weights with which a pair of samples sees the air.
//!
//! Samples k and l at t_k = t + tau/2 and t_l = t - tau/2 see the layer at range R with the weight
//! f(t_k - 2R/c) f(t_l - 2R/c). Check: the weights sum to exp(-tau^2 / (4 sigma^2)).

use std::f64::consts::PI;

use crate::error::{Error, positive};

/// Real envelope f(t) of the transmitted pulse; its energy is scaled to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct PulseShape {
    /// Half-width of f^2 at 1/e \[s\].
    pub(crate) sigma_s: f64,
}

impl PulseShape {
    /// The Gaussian pulse (7); `sigma_s` is the half-width of f^2 at 1/e \[s\].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is not positive.
    pub fn gaussian(sigma_s: f64) -> Result<Self, Error> {
        positive("sigma_s", sigma_s)?;
        Ok(Self { sigma_s })
    }

    /// f \[s^-1/2\] at a time \[s\].
    pub(crate) fn at(&self, time_s: f64) -> f64 {
        (-0.5 * (time_s / self.sigma_s).powi(2)).exp() / (PI.sqrt() * self.sigma_s).sqrt()
    }

    /// f(`middle_s` + `apart_s`) f(`middle_s` - `apart_s`) \[1/s\]: what a pair of samples sees of the air.
    fn pair(&self, middle_s: f64, apart_s: f64) -> f64 {
        self.at(middle_s + apart_s) * self.at(middle_s - apart_s)
    }

    /// Largest time \[s\] at which f^2 matters: 1e-7 of its peak.
    pub(crate) fn reach_s(&self) -> f64 {
        4.0 * self.sigma_s
    }
}

/// Weights of the air for all lags, on nodes half a sample apart.
///
/// The lags of one row stand even ones first, then odd ones: a pair of samples with an even lag has its middle on a sample.
#[derive(Debug, Clone)]
pub(crate) struct PairWeights {
    /// Largest lag \[samples\].
    pub(crate) lags: usize,
    /// Nodes on each side of the middle.
    pub(crate) half: usize,
    /// Number of even lags.
    pub(crate) even: usize,
    /// Weights of all lags, row by row: those of the nodes from `-half` to `half` from the middle.
    pub(crate) rows: Vec<f64>,
}

impl PairWeights {
    /// For samples `interval_s` apart; lags whose covariance is below `cut` of the power are left out.
    pub(crate) fn new(pulse: &PulseShape, interval_s: f64, samples: usize, cut: f64) -> Self {
        let step_s = 0.5 * interval_s;
        let half = (pulse.reach_s() / step_s).ceil() as usize;
        let nodes = -(half as i64)..=half as i64;
        let mut longest = 0;
        for lag in (0..samples).rev() {
            let apart_s = lag as f64 * step_s;
            let weights = nodes
                .clone()
                .map(|node| pulse.pair(node as f64 * step_s, apart_s) * step_s);
            if weights.sum::<f64>().abs() > cut {
                longest = lag;
                break;
            }
        }
        let mut weights = Self {
            lags: longest,
            half,
            even: longest / 2 + 1,
            rows: Vec::new(),
        };
        for node in nodes {
            for lag in weights.lag_of_place() {
                let weight = pulse.pair(node as f64 * step_s, lag as f64 * step_s);
                weights.rows.push(weight * step_s);
            }
        }
        weights
    }

    /// Weights of all lags for the node `offset - half` from the middle.
    #[cfg(test)]
    pub(crate) fn row(&self, offset: usize) -> &[f64] {
        let width = self.lags + 1;
        &self.rows[offset * width..(offset + 1) * width]
    }

    /// Places of the even or of the odd lags in a row, those up to `longest`.
    pub(crate) fn places(&self, odd: usize, longest: usize) -> std::ops::Range<usize> {
        let longest = longest.min(self.lags);
        let count = if longest < odd {
            0
        } else {
            (longest - odd) / 2 + 1
        };
        let first = odd * self.even;
        first..first + count
    }

    /// The lag at each place of a row.
    pub(crate) fn lag_of_place(&self) -> impl Iterator<Item = usize> + use<> {
        let longest = self.lags;
        (0..=longest).step_by(2).chain((1..=longest).step_by(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_a_gaussian_sum_to_its_autocorrelation() {
        let sigma_s = 120e-9;
        let exact = PairWeights::new(&PulseShape::gaussian(sigma_s).unwrap(), 20e-9, 300, 1e-6);
        assert_eq!(exact.lags, 44);
        for (place, lag) in exact.lag_of_place().enumerate() {
            let sum: f64 = (0..=2 * exact.half)
                .map(|offset| exact.row(offset)[place])
                .sum();
            let expected = (-(lag as f64 * 20e-9 / (2.0 * sigma_s)).powi(2)).exp();
            assert!((sum - expected).abs() < 1e-6, "{lag}: {sum} {expected}");
        }
    }

    #[test]
    fn places_of_even_and_odd_lags_are_those_of_the_order() {
        let weights = PairWeights::new(&PulseShape::gaussian(120e-9).unwrap(), 20e-9, 8, 1e-6);
        let lags: Vec<usize> = weights.lag_of_place().collect();
        assert_eq!(lags, [0, 2, 4, 6, 1, 3, 5, 7]);
        assert_eq!(&lags[weights.places(1, 5)], [1, 3, 5]);
        assert_eq!(&lags[weights.places(0, 5)], [0, 2, 4]);
        assert!(weights.places(1, 0).is_empty());
    }

    #[test]
    fn pulses_without_width_are_refused() {
        assert!(PulseShape::gaussian(0.0).is_err());
    }
}
