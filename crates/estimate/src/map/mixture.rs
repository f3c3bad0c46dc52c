//! Good and bad estimates: Gaussian errors above a uniform floor over the band (Frehlich and Yadlowsky 1994).
//!
//! Fitted by expectation maximisation: the density of an error e is s N(e; b, sigma) + (1 - s)/B over a band of width B.
//! Check: the parameters of drawn mixtures come back within their standard errors.

/// The fitted mixture with standard errors; NaN with fewer than 20 good estimates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GoodAndBad {
    /// Standard deviation of the good estimates, m/s.
    pub std_good_m_s: f64,
    /// Its standard error, m/s.
    pub std_good_error_m_s: f64,
    /// Share of the bad estimates, those without a velocity among them.
    pub bad_fraction: f64,
    /// Its standard error.
    pub bad_fraction_error: f64,
    /// Mean error of the good estimates, m/s.
    pub bias_m_s: f64,
    /// Its standard error, m/s.
    pub bias_error_m_s: f64,
}

/// Fewest good estimates that a standard deviation is made of.
const LEAST_GOOD: f64 = 20.0;

/// Steps of the iteration; it settles within some ten where good and bad are apart.
const STEPS: usize = 300;

/// Separates good errors \[m/s\] from bad ones, which form a floor `band_m_s` wide; NaN is an estimate that is flagged as none. All
/// results are NaN without errors.
#[must_use]
pub fn good_and_bad(errors_m_s: &[f64], band_m_s: f64) -> GoodAndBad {
    let found: Vec<f64> = errors_m_s
        .iter()
        .copied()
        .filter(|e| e.is_finite())
        .collect();
    let mut sizes: Vec<f64> = found.iter().map(|e| e.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let all = errors_m_s.len() as f64;
    let mut share = 0.95;
    let mut mean = 0.0;
    // from the median of the sizes
    let mut std = sizes.get(sizes.len() / 2).map_or(f64::NAN, |m| m / 0.674_5);
    let mut good = 0.0;
    for _ in 0..STEPS {
        let mut sums = [0.0; 3];
        for error in &found {
            let bell = share * (-0.5 * ((error - mean) / std).powi(2)).exp()
                / (std * std::f64::consts::TAU.sqrt());
            let weight = bell / (bell + (1.0 - share) / band_m_s);
            sums[0] += weight;
            sums[1] += weight * error;
            sums[2] += weight * (error - mean).powi(2);
        }
        good = sums[0];
        // what lies within a hundredth of the floor's width is no peak of its own
        std = (sums[2] / good).sqrt().max(1e-6 * band_m_s);
        mean = sums[1] / good;
        share = (good / found.len() as f64).min(1.0 - 1e-12);
    }
    // a bell as wide as the floor is the floor
    let resolved = good >= LEAST_GOOD && std < 0.25 * band_m_s;
    if !resolved {
        mean = f64::NAN;
        std = f64::NAN;
    }
    let bad = if resolved { (all - good).max(0.0) } else { all };
    GoodAndBad {
        std_good_m_s: std,
        std_good_error_m_s: std / (2.0 * good).sqrt(),
        bad_fraction: bad / all,
        // the posterior of a fraction from counts: not 0 where no estimate was bad
        bad_fraction_error: ((bad + 1.0) * (all - bad + 1.0) / ((all + 2.0).powi(2) * (all + 3.0)))
            .sqrt(),
        bias_m_s: mean,
        bias_error_m_s: std / good.sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of a Gaussian of deviation 0.3 about 0.1, and of a floor over 40 m/s.
    fn drawn(good: usize, bad: usize) -> Vec<f64> {
        // rational approximation of the quantile, Abramowitz & Stegun 26.2.23: within 4.5e-4
        let bell = (0..good).map(|i| {
            let p = (i as f64 + 0.5) / good as f64;
            let t = (-2.0 * p.min(1.0 - p).ln()).sqrt();
            let z = t
                - (2.515_517 + t * (0.802_853 + t * 0.010_328))
                    / (1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308)));
            0.1 + 0.3 * if p < 0.5 { -z } else { z }
        });
        bell.chain((0..bad).map(|i| 40.0 * ((i as f64 + 0.5) / bad as f64 - 0.5)))
            .collect()
    }

    #[test]
    fn a_mixture_of_known_shares_comes_back() {
        let found = good_and_bad(&drawn(900, 100), 40.0);
        assert!(
            (found.std_good_m_s - 0.3).abs() < 3.0 * found.std_good_error_m_s,
            "{found:?}"
        );
        assert!(
            (found.bad_fraction - 0.1).abs() < 0.01 && (found.bias_m_s - 0.1).abs() < 0.02,
            "{found:?}"
        );
    }

    #[test]
    fn estimates_all_over_the_band_have_no_standard_deviation() {
        let found = good_and_bad(&drawn(0, 500), 40.0);
        assert!(
            found.std_good_m_s.is_nan() && found.bad_fraction == 1.0,
            "{found:?}"
        );
        assert!(good_and_bad(&[f64::NAN; 30], 40.0).bad_fraction == 1.0);
    }
}
