//! The envelope of the pulse as the likelihood needs it, and the weights with which a pair of samples sees the air.
//!
//! Samples k and l at t_k = t + tau/2 and t_l = t - tau/2 see the layer at range R with the weight
//! f(t_k - 2R/c) f(t_l - 2R/c). Check: the weights sum to exp(-tau^2 / (4 sigma^2)).

use std::f64::consts::PI;

/// Real envelope f \[s^-1/2\] of the Gaussian pulse (7) of unit energy at a time \[s\]; `sigma_s` is the
/// half-width of f^2 at 1/e \[s\].
pub(crate) fn envelope_at(sigma_s: f64, time_s: f64) -> f64 {
    (-0.5 * (time_s / sigma_s).powi(2)).exp() / (PI.sqrt() * sigma_s).sqrt()
}

/// f(`middle_s` + `apart_s`) f(`middle_s` - `apart_s`) \[1/s\]: what a pair of samples sees of the air.
fn pair(sigma_s: f64, middle_s: f64, apart_s: f64) -> f64 {
    envelope_at(sigma_s, middle_s + apart_s) * envelope_at(sigma_s, middle_s - apart_s)
}

/// Largest time \[s\] at which f^2 matters: 1e-7 of its peak.
pub(crate) fn reach_s(sigma_s: f64) -> f64 {
    4.0 * sigma_s
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
    pub(crate) fn new(sigma_s: f64, interval_s: f64, samples: usize, cut: f64) -> Self {
        let step_s = 0.5 * interval_s;
        let half = (reach_s(sigma_s) / step_s).ceil() as usize;
        let nodes = -(half as i64)..=half as i64;
        let mut longest = 0;
        for lag in (0..samples).rev() {
            let apart_s = lag as f64 * step_s;
            let weights = nodes
                .clone()
                .map(|node| pair(sigma_s, node as f64 * step_s, apart_s) * step_s);
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
                let weight = pair(sigma_s, node as f64 * step_s, lag as f64 * step_s);
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
        let exact = PairWeights::new(sigma_s, 20e-9, 300, 1e-6);
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
        let weights = PairWeights::new(120e-9, 20e-9, 8, 1e-6);
        let lags: Vec<usize> = weights.lag_of_place().collect();
        assert_eq!(lags, [0, 2, 4, 6, 1, 3, 5, 7]);
        assert_eq!(&lags[weights.places(1, 5)], [1, 3, 5]);
        assert_eq!(&lags[weights.places(0, 5)], [0, 2, 4]);
        assert!(weights.places(1, 0).is_empty());
    }
}
