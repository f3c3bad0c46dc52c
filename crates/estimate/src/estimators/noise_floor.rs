//! The power of the noise from gates among which some hold no signal.
//!
//! The quietest gates are quiet by chance, too: their mean is too low. Powers of noise are gamma variables of known deviation, so the
//! mean of those below a level tells that of all. From the lowest tenth on, all gates below the level that nine in ten of noise
//! stay below are taken, until the mean that they tell is the one that they were chosen by. Check: draws of noise
//! alone and beside signals, for any number of gates and deviation.

use crate::estimators::tails::{bisected, gamma_tail};

/// Share of the gates of noise that the mean is taken from.
const SHARE: f64 = 0.9;

/// Mean power of the gates of `power` that hold noise alone; `deviation` is the standard deviation of the power of such a gate
/// over its mean. NaN without gates.
///
/// A tenth of the gates at least must be without a signal. One weaker than `deviation` counts as noise.
#[must_use]
pub fn noise_floor(power: &[f64], deviation: f64) -> f64 {
    let mut sorted: Vec<f64> = power
        .iter()
        .copied()
        .filter(|power| power.is_finite())
        .collect();
    sorted.sort_by(f64::total_cmp);
    let shape = deviation.max(1e-6).powi(2).recip();
    let lowest = sorted.len().div_ceil(10);
    let mut mean = mean_of(&sorted[..lowest]) / below(shape, quantile(shape, 0.1));
    let level = quantile(shape, SHARE);
    // Each step takes the gates below a level; there are no more of them than gates.
    for _ in 0..sorted.len() {
        let chosen = sorted.partition_point(|power| *power < level * mean).max(1);
        let next = mean_of(&sorted[..chosen]) / below(shape, level);
        if next == mean {
            break;
        }
        mean = next;
    }
    mean
}

fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Mean of a gamma variable of that shape and mean 1 where it is below `level`.
fn below(shape: f64, level: f64) -> f64 {
    (1.0 - gamma_tail(shape + 1.0, shape * level)) / (1.0 - gamma_tail(shape, shape * level))
}

/// Level that a gamma variable of that shape and mean 1 stays below with that probability.
fn quantile(shape: f64, probability: f64) -> f64 {
    let highest = 1.0 + 20.0 / shape.sqrt().min(shape);
    let [low, high] = bisected(0.0, highest, 60, |level| {
        gamma_tail(shape, shape * level) > 1.0 - probability
    });
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Gamma};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// Mean floor and standard error over draws of gates, the first of which have a signal, too.
    fn floor(gates: usize, shape: f64, lit: usize, snr: f64) -> (f64, f64) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let noise = Gamma::new(shape, shape.recip()).unwrap();
        let found: Vec<f64> = (0..400)
            .map(|_| {
                let power = (0..gates)
                    .map(|gate| noise.sample(&mut rng) + if gate < lit { snr } else { 0.0 });
                noise_floor(&power.collect::<Vec<f64>>(), shape.sqrt().recip())
            })
            .collect();
        let mean = mean_of(&found);
        (
            mean,
            (found.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 400.0 / 399.0).sqrt(),
        )
    }

    #[test]
    fn gates_chosen_by_their_power_tell_the_noise_for_any_number_of_lines() {
        // 13 cells of one line, of 10, of 100
        for shape in [13.0, 130.0, 1300.0] {
            for (gates, lit, snr) in [
                (40, 0, 0.0),
                (160, 0, 0.0),
                (40, 20, 10.0),
                (160, 144, 10.0),
                (10, 5, 10.0),
            ] {
                let (found, error) = floor(gates, shape, lit, snr);
                // of few gates with a wide scatter some per cent are left
                let left = 0.3 / (shape * (gates - lit) as f64).sqrt();
                assert!(
                    (found - 1.0).abs() < left + 3.0 * error,
                    "{shape} {gates} {lit}: {found} +- {error}"
                );
            }
        }
    }

    #[test]
    fn gates_without_a_number_are_left_out() {
        assert!((noise_floor(&[f64::NAN, 2.0, f64::NAN], 1e-3) - 2.0).abs() < 1e-2);
        assert!(noise_floor(&[], 0.1).is_nan() && noise_floor(&[f64::NAN], 0.1).is_nan());
    }
}
