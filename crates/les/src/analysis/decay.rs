//! Results from the history of a wake: when its fast decay begins, how fast its waves grow.
//!
//! A history is a list of points (tau, value) of increasing tau; between them a quantity is a
//! straight line. Check: a broken line has its knee and its onset where it breaks.

/// Value at `tau` on the straight line through the two points about it, beyond the ends on that of
/// the last two; NaN for fewer than two points.
#[must_use]
pub fn value_at(points: &[(f64, f64)], tau: f64) -> f64 {
    let i = points
        .partition_point(|p| p.0 < tau)
        .clamp(1, points.len().max(2) - 1);
    let (Some(a), Some(b)) = (points.get(i - 1), points.get(i)) else {
        return f64::NAN;
    };
    a.1 + (b.1 - a.1) * (tau - a.0) / (b.0 - a.0)
}

/// When the fast decay begins: where the loss of the circulation's ratio to its start, per tau,
/// first exceeds three times its mean over 0.5 to 1.5.
#[must_use]
pub fn onset(gamma: &[(f64, f64)]) -> Option<f64> {
    let early_loss = loss(gamma, 0.5, 1.5);
    let last_tau = gamma.last()?.0;
    (0..)
        .map(|i| 1.5 + 0.02 * f64::from(i))
        .take_while(|tau| tau + 0.05 <= last_tau)
        .find(|tau| loss(gamma, tau - 0.05, tau + 0.05) / 0.1 > 3.0 * early_loss)
}

/// Loss of the ratio from one time to another.
fn loss(gamma: &[(f64, f64)], from: f64, to: f64) -> f64 {
    value_at(gamma, from) - value_at(gamma, to)
}

/// Where the line through the ratio at 0.5 and 1.5 meets the steepest line over 0.8: a beginning of
/// the fast decay that does not depend on how slow the decay before it is; none if the steepest
/// line is less than twice as steep.
#[must_use]
pub fn knee(gamma: &[(f64, f64)]) -> Option<f64> {
    let last_tau = gamma.last()?.0;
    let early = value_at(gamma, 1.5) - value_at(gamma, 0.5);
    // The steepest line: its start, and the change over 0.8.
    let mut steepest: Option<(f64, f64)> = None;
    let starts = (0..).map(|i| 1.5 + 0.02 * f64::from(i));
    for from in starts.take_while(|from| from + 0.8 <= last_tau) {
        let change = value_at(gamma, from + 0.8) - value_at(gamma, from);
        if steepest.is_none_or(|(_, most)| change.total_cmp(&most).is_lt()) {
            steepest = Some((from, change));
        }
    }
    let (from, change) = steepest?;
    let steep = change / 0.8;
    let offset = value_at(gamma, from) - steep * from - value_at(gamma, 0.5) + 0.5 * early;
    (steep < 2.0 * early).then(|| offset / (early - steep))
}

/// Growth rate per tau of the amplitude of a mode whose energy is given: half the slope of the
/// logarithm from `from` to `to`.
#[must_use]
pub fn amplitude_growth(energy: &[(f64, f64)], from: f64, to: f64) -> f64 {
    0.5 * (value_at(energy, to) / value_at(energy, from)).ln() / (to - from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broken_line_has_its_knee_and_its_onset_where_it_breaks() {
        let gamma: Vec<(f64, f64)> = (0..=100)
            .map(|i| 0.05 * f64::from(i))
            .map(|tau| {
                (
                    tau,
                    1.0 - 0.01 * tau - 0.3 * (tau - 2.4).max(0.0) + 0.25 * (tau - 3.6).max(0.0),
                )
            })
            .collect();
        assert!((knee(&gamma).unwrap() - 2.4).abs() < 1e-9);
        assert!((onset(&gamma).unwrap() - 2.4).abs() < 0.06);
        let straight: Vec<(f64, f64)> = gamma
            .iter()
            .map(|(tau, _)| (*tau, 1.0 - 0.06 * tau))
            .collect();
        assert!(onset(&straight).is_none() && knee(&straight).is_none());
    }

    #[test]
    fn an_exponential_grows_at_half_the_rate_of_its_energy_and_nothing_is_no_history() {
        let energy: Vec<(f64, f64)> = (0..=40)
            .map(|i| 0.1 * f64::from(i))
            .map(|tau| (tau, (3.0 * tau).exp()))
            .collect();
        assert!((amplitude_growth(&energy, 1.0, 2.0) - 1.5).abs() < 1e-9);
        assert!(value_at(&[], 1.0).is_nan() && value_at(&[(0.0, 1.0)], 0.0).is_nan());
        assert!(onset(&[]).is_none() && knee(&[(0.0, 1.0)]).is_none());
    }
}
