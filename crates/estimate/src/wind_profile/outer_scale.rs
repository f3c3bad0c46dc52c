//! Outer scales that are tried where none is known, and how probable each of them is.
//!
//! Check: one scale whose likelihood is far above those of the others has all the probability; without a likelihood it is the prior.

/// Outer scales that are tried \[m\]: each twice the one before.
pub const OUTER_SCALES_M: [f64; 7] = [15.0, 30.0, 60.0, 120.0, 240.0, 480.0, 960.0];
/// What is known of them before: a lognormal distribution.
const USUAL_OUTER_SCALE_M: f64 = 100.0;
const OUTER_SCALE_SPREAD: f64 = 0.8;

/// Probability of each outer scale \[m\], from the logarithms of the likelihoods of several samples \[sample\]\[outer scale\] and a lognormal
/// prior about 100 m with a standard deviation of 0.8 of the logarithm.
#[must_use]
pub fn outer_scale_probabilities(outer_scales_m: &[f64], log_likelihoods: &[Vec<f64>]) -> Vec<f64> {
    let mut logarithms = Vec::with_capacity(outer_scales_m.len());
    for (number, outer_scale_m) in outer_scales_m.iter().enumerate() {
        let away = (outer_scale_m / USUAL_OUTER_SCALE_M).ln() / OUTER_SCALE_SPREAD;
        let mut logarithm = -0.5 * away * away;
        for own in log_likelihoods {
            logarithm += own[number];
        }
        logarithms.push(logarithm);
    }
    let largest = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut probabilities = Vec::with_capacity(logarithms.len());
    for logarithm in logarithms {
        probabilities.push((logarithm - largest).exp());
    }
    let total: f64 = probabilities.iter().sum();
    for probability in &mut probabilities {
        *probability /= total;
    }
    probabilities
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_far_larger_likelihood_decides_and_without_one_the_prior_does() {
        let prior = outer_scale_probabilities(&OUTER_SCALES_M, &[]);
        assert!((prior.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        let ratio = (-0.5 * ((0.6f64.ln() / 0.8).powi(2) - (1.2f64.ln() / 0.8).powi(2))).exp();
        assert!((prior[2] / prior[3] / ratio - 1.0).abs() < 1e-12);
        let mut likelihoods = vec![0.0; 7];
        likelihoods[6] = 40.0;
        let decided = outer_scale_probabilities(&OUTER_SCALES_M, &[likelihoods]);
        assert!(decided[6] > 0.999_999);
    }
}
