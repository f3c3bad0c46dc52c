//! How high the peak of pure noise stands: the threshold that tells a signal from noise.
//!
//! Computes the level that the highest of K independent cells of an averaged periodogram, over their mean, exceeds
//! with a given probability: Fisher's test (1929), for the mean of n_eff windows. A cell over the sum of all has a
//! beta distribution of parameters n_eff and (K - 1) n_eff; its quantile is that of Paulson (1942), good to 4 % from
//! n_eff = 1 on. Check: Fisher's closed form for one window, and the rate of false alarms on white noise.

use crate::error::{Error, positive};

/// [`GateVelocity::quality`](crate::GateVelocity::quality) that the spectral peak of white noise exceeds with
/// probability `false_alarm`.
///
/// `n_eff` is the number of independent windows averaged and `cells` the width of the band over the resolution, B_w N
/// / F_s: 12.8 for 50 MHz, 64 samples and 250 MHz. A peak below this level is not distinguishable from noise and its
/// velocity lies anywhere in the band.
///
/// # Errors
/// [`Error::OutOfRange`] unless `n_eff` is above 0, `cells` above 1 and `false_alarm` between 0 and 1.
pub fn noise_quality(n_eff: f64, cells: f64, false_alarm: f64) -> Result<f64, Error> {
    positive("n_eff", n_eff)?;
    positive("cells - 1", cells - 1.0)?;
    if !(false_alarm > 0.0 && false_alarm < 1.0) {
        return Err(Error::OutOfRange { field: "false_alarm", value: false_alarm, allowed: "between 0 and 1" });
    }
    // the maximum over all frequencies is that of about three times as many independent cells
    let single = -((-false_alarm).ln_1p() / (3.0 * cells)).exp_m1();
    // Paulson's quantile of the ratio of the cell to the mean of the others, as the root of a quadratic in its cube root
    let z = normal_quantile(single);
    let (own, others) = (1.0 / (9.0 * n_eff), 1.0 / (9.0 * n_eff * (cells - 1.0)));
    let square = (1.0 - others).powi(2) - z * z * others;
    let middle = (1.0 - own) * (1.0 - others);
    let rest = (1.0 - own).powi(2) - z * z * own;
    if square <= 0.0 {
        // too few cells: not even all power in one of them is that rare
        return Ok(cells);
    }
    let ratio = ((middle + (middle * middle - square * rest).max(0.0).sqrt()) / square).powi(3);
    Ok(cells * ratio / (cells - 1.0 + ratio))
}

/// z that a standard normal variable exceeds with probability `tail` (Hastings 1955, error below 5e-4).
fn normal_quantile(tail: f64) -> f64 {
    if tail > 0.5 {
        return -normal_quantile(1.0 - tail);
    }
    let t = (-2.0 * tail.ln()).sqrt();
    let upper = 2.515_517 + t * (0.802_853 + t * 0.010_328);
    let lower = 1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308));
    t - upper / lower
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_the_normal_distribution() {
        for (tail, z) in [(0.5, 0.0), (0.158_655, 1.0), (0.022_750, 2.0), (1.349_9e-3, 3.0), (0.841_345, -1.0)] {
            assert!((normal_quantile(tail) - z).abs() < 5e-4, "{tail}");
        }
    }

    #[test]
    fn threshold_of_one_window_is_that_of_fisher() {
        // one of 3 K cells at random exceeds the share g of the sum of K with probability (1 - g)^(K - 1)
        for (cells, false_alarm) in [(12.8_f64, 0.05_f64), (12.8, 1e-4), (40.0, 0.01)] {
            let single = -((-false_alarm).ln_1p() / (3.0 * cells)).exp_m1();
            let share = 1.0 - single.powf(1.0 / (cells - 1.0));
            let level = noise_quality(1.0, cells, false_alarm).unwrap();
            assert!((level / (share * cells) - 1.0).abs() < 0.04, "{level}");
        }
    }

    #[test]
    fn threshold_falls_to_1_with_averaging() {
        assert!(noise_quality(1e6, 12.8, 0.01).unwrap() < 1.01);
        assert!(noise_quality(7.5, 12.8, 0.01).unwrap() < noise_quality(1.0, 12.8, 0.01).unwrap());
        assert!(noise_quality(0.0, 12.8, 0.01).is_err() && noise_quality(1.0, 12.8, 1.0).is_err());
    }
}
