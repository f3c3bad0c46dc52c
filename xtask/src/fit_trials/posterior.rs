//! How wide the likelihood of one scan is in one parameter: the standard deviation of its posterior with a flat density before it.
//!
//! The bound holds the mean curvature of the likelihood over scans. Few lines tell a height, and each has its speckle, so that one
//! scan may tell it worse than the mean curvature says, and an estimate may scatter more than the bound without anything amiss.
//! Along the parameter the others go where the bound says that they would, and then take the step of Newton that their
//! derivatives ask for. Check: a likelihood that is a parabola has the width of the bound.

use ndarray::{Array2, ArrayView1};
use wakescope_estimate::vortex_fit::{PARAMETERS, Wake};

/// Places of the parameter: this far in deviations of the bound, in such steps.
const REACH: f64 = 6.0;
const STEP: f64 = 0.5;
/// What the others may gain in ln p by their step: it is one of a parabola.
const MOST_GAIN: f64 = 4.0;

/// Standard deviation of the posterior of parameter `place` about `top`, from `likelihood`, ln p and its derivatives by the
/// parameters, and the covariance \[10, 10\] of the free `groups` at the bound. Nothing if there is no likelihood anywhere.
pub(super) fn posterior_deviation(
    top: &Wake,
    place: usize,
    (covariance, groups): (&Array2<f64>, &[Vec<usize>]),
    likelihood: impl Fn(&Wake) -> Option<(f64, [f64; PARAMETERS])>,
) -> Option<f64> {
    let variance = covariance[[place, place]];
    let along: ArrayView1<'_, f64> = covariance.column(place);
    let others: Vec<&Vec<usize>> = groups
        .iter()
        .filter(|group| !group.contains(&place))
        .collect();
    let steps = (REACH / STEP) as i32;
    let offset = |step: i32| f64::from(step) * STEP * variance.sqrt();
    let height = |step: i32| {
        let mut parameters = top.to_array();
        parameters
            .iter_mut()
            .zip(along)
            .for_each(|(p, c)| *p += c / variance * offset(step));
        let (log_likelihood, slopes) = likelihood(&Wake::from_array(&parameters))?;
        let pull: Vec<f64> = others
            .iter()
            .map(|group| group.iter().map(|&i| slopes[i]).sum())
            .collect();
        let mut gain = 0.0;
        for (a, by_a) in others.iter().zip(&pull) {
            for (b, by_b) in others.iter().zip(&pull) {
                // the covariance of the others once this parameter is known
                let (a, b) = (a[0], b[0]);
                gain += 0.5 * by_a * by_b * (covariance[[a, b]] - along[a] * along[b] / variance);
            }
        }
        Some((offset(step), log_likelihood + gain.clamp(0.0, MOST_GAIN)))
    };
    let places: Vec<(f64, f64)> = (-steps..=steps).filter_map(height).collect();
    let highest = places
        .iter()
        .map(|(_, height)| *height)
        .fold(f64::NEG_INFINITY, f64::max);
    let mean = |of: &dyn Fn(f64) -> f64| {
        let weights = places.iter().map(|(_, height)| (height - highest).exp());
        let sum: f64 = weights.clone().sum();
        weights
            .zip(&places)
            .map(|(weight, (at, _))| weight * of(*at))
            .sum::<f64>()
            / sum
    };
    let middle = mean(&|at| at);
    let deviation = mean(&|at| (at - middle).powi(2)).sqrt();
    deviation.is_finite().then_some(deviation)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ln p = -x^T F x / 2 in a height and a circulation that are correlated, its top a bound away from where one begins.
    #[test]
    fn a_parabola_is_as_wide_as_its_bound() {
        let top = Wake::from_array(&[380.0, 340.0, 380.0, 30.0, 420.0, 30.0, 3.0, 3.0, 2.0, 0.0]);
        let (height, circulation) = (5, 1);
        let (variances, shared) = ([0.04, 100.0], 1.2);
        let mut covariance = Array2::zeros((PARAMETERS, PARAMETERS));
        covariance[[height, height]] = variances[0];
        covariance[[circulation, circulation]] = variances[1];
        (
            covariance[[height, circulation]],
            covariance[[circulation, height]],
        ) = (shared, shared);
        let determinant = variances[0] * variances[1] - shared * shared;
        let likelihood = |wake: &Wake| {
            let (at, best) = (wake.to_array(), top.to_array());
            let (h, c) = (
                at[height] - best[height] - 0.2,
                at[circulation] - best[circulation] + 3.0,
            );
            let pull = [variances[1] * h - shared * c, variances[0] * c - shared * h]
                .map(|p| p / determinant);
            let mut slopes = [0.0; PARAMETERS];
            (slopes[height], slopes[circulation]) = (-pull[0], -pull[1]);
            Some((-0.5 * (h * pull[0] + c * pull[1]), slopes))
        };
        let groups = [vec![circulation], vec![height]];
        let found = posterior_deviation(&top, height, (&covariance, &groups), likelihood).unwrap();
        assert!((found / 0.2 - 1.0).abs() < 1e-3, "{found}");
        assert!(posterior_deviation(&top, height, (&covariance, &groups), |_| None).is_none());
    }
}
