//! Statistics of ranks, of values that belong to flights which count several times or not at all.
//!
//! Check: values by hand, and lists in which each value is repeated.

/// A value and the index of its flight.
pub(super) type Ranked = (f64, usize);

/// Quantile by linear interpolation between ranks, of values in rising order (Hyndman and Fan 1996, definition 7); NaN of none.
pub(super) fn quantile(sorted: &[Ranked], weights: &[f64], probability: f64) -> f64 {
    let count = total(sorted, weights);
    if count == 0.0 {
        return f64::NAN;
    }
    let position = probability * (count - 1.0);
    let rank = position.floor();
    let below = value_at(sorted, weights, rank);
    let above = value_at(sorted, weights, (rank + 1.0).min(count - 1.0));
    below + (position - rank) * (above - below)
}

/// How many values there are.
pub(super) fn total(values: &[Ranked], weights: &[f64]) -> f64 {
    values.iter().map(|(_, flight)| weights[*flight]).sum()
}

/// The value of a rank from 0; NaN beyond the last.
pub(super) fn value_at(sorted: &[Ranked], weights: &[f64], rank: f64) -> f64 {
    let mut passed = 0.0;
    for (value, flight) in sorted {
        passed += weights[*flight];
        if passed > rank {
            return *value;
        }
    }
    f64::NAN
}

/// Fraction of the values above a limit.
pub(super) fn fraction_above(values: &[Ranked], weights: &[f64], limit: f64) -> f64 {
    let mut above = 0.0;
    for (value, flight) in values {
        if *value > limit {
            above += weights[*flight];
        }
    }
    above / total(values, weights)
}

/// Probability that a wake has a higher score than an empty scan, ties counting half: the area below the operating curve. Both in
/// rising order.
pub(super) fn area(wakes: &[Ranked], empty: &[Ranked], weights: &[f64]) -> f64 {
    let mut lower = 0.0;
    let mut next = 0;
    let mut sum = 0.0;
    for equal in wakes.chunk_by(|a, b| a.0 == b.0) {
        let score = equal[0].0;
        while next < empty.len() && empty[next].0 < score {
            lower += weights[empty[next].1];
            next += 1;
        }
        let ties = &empty[next..];
        let ties = &ties[..ties.partition_point(|(value, _)| *value <= score)];
        sum += total(equal, weights) * (lower + 0.5 * total(ties, weights));
    }
    sum / (total(wakes, weights) * total(empty, weights))
}

/// Fractions of empty scans and of wakes above each threshold, from the highest down; empty without both or without scores.
pub(super) fn operating_curve(wakes: &[Ranked], empty: &[Ranked]) -> Vec<(f64, f64)> {
    let mut thresholds = Vec::new();
    for (score, _) in wakes.iter().chain(empty) {
        if score.is_finite() {
            thresholds.push(*score);
        }
    }
    if wakes.is_empty() || empty.is_empty() || thresholds.is_empty() {
        return Vec::new();
    }
    thresholds.sort_by(|a, b| b.total_cmp(a));
    thresholds.dedup();
    let mut curve = vec![(0.0, 0.0)];
    for threshold in thresholds {
        let reached = |sorted: &[Ranked]| {
            let below = sorted.partition_point(|(score, _)| *score < threshold);
            (sorted.len() - below) as f64 / sorted.len() as f64
        };
        curve.push((reached(empty), reached(wakes)));
    }
    curve
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_repetitions() {
        let sorted = [(1.0, 0), (2.0, 1), (4.0, 2), (8.0, 1)];
        // 2, 2, 2, 4, 8, 8, 8
        let weights = [0.0, 3.0, 1.0];
        for (probability, expected) in [(0.0, 2.0), (0.5, 4.0), (1.0, 8.0), (0.75, 8.0)] {
            assert_eq!(quantile(&sorted, &weights, probability), expected);
        }
        // Between ranks 3 and 4: 0.6 * 6 = 3.6.
        approx::assert_relative_eq!(quantile(&sorted, &weights, 0.6), 6.4, epsilon = 1e-12);
        assert!(quantile(&sorted, &[0.0; 3], 0.5).is_nan());
    }

    #[test]
    fn the_area_counts_ties_half() {
        let wakes = [(1.0, 0), (2.0, 0), (3.0, 1)];
        let empty = [(f64::NEG_INFINITY, 0), (2.0, 1)];
        // Of six pairs 1 + 1.5 + 2 are won.
        approx::assert_relative_eq!(area(&wakes, &empty, &[1.0, 1.0]), 4.5 / 6.0);
        // Flight 1 twice: wakes 1, 2, 3, 3; empty -inf, 2, 2.
        approx::assert_relative_eq!(area(&wakes, &empty, &[1.0, 2.0]), 9.0 / 12.0);
        assert_eq!(fraction_above(&wakes, &[1.0, 2.0], 2.0), 0.5);
    }

    #[test]
    fn the_operating_curve_ends_where_all_scores_are_reached() {
        let wakes = [(1.0, 0), (2.0, 0)];
        let empty = [(f64::NEG_INFINITY, 0), (1.0, 0)];
        let curve = operating_curve(&wakes, &empty);
        assert_eq!(curve, [(0.0, 0.0), (0.0, 0.5), (0.5, 1.0)]);
        assert!(operating_curve(&wakes, &[]).is_empty());
    }
}
