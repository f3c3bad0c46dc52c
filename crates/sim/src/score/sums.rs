//! Sums over the vortices and scans of a flight, from which the statistics of any draw of flights follow.
//!
//! Check: the score of a normal law by quadrature; half widths of intervals by the error function.

use super::Quantity;
use super::matching::MatchedScan;
use super::predictions::PredictedVortex;
use super::truth::TrueVortex;
use libm::erf;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Probabilities of central intervals of the normal law, half their widths in standard deviations, and the names of their
/// coverage.
pub(super) const NOMINAL: [(f64, f64, &str); 4] = [
    (0.5, 0.674_489_750_196_081_7, "coverage_0.5"),
    (0.6827, 1.000_021_713_322_999, "coverage_0.6827"),
    (0.9, 1.644_853_626_951_472_4, "coverage_0.9"),
    (0.95, 1.959_963_984_540_053_4, "coverage_0.95"),
];

impl PredictedVortex {
    /// Predicted less true.
    pub(super) fn error(&self, truth: &TrueVortex, quantity: Quantity) -> f64 {
        self.values.value(quantity) - truth.values.value(quantity)
    }

    /// Distance from its vortex, m.
    pub(super) fn distance_m(&self, truth: &TrueVortex) -> f64 {
        let y_m = self.error(truth, Quantity::LateralPosition);
        y_m.hypot(self.error(truth, Quantity::Height))
    }
}

/// Sums over the errors of a quantity.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ErrorSums {
    pub(super) error: f64,
    pub(super) square: f64,
    pub(super) relative_square: f64,
    /// Of the truth about its mean over the training flights.
    pub(super) truth_square: f64,
    pub(super) crps: f64,
    /// Errors with a stated deviation.
    pub(super) stated: f64,
    pub(super) reduced_square: f64,
    pub(super) covered: [f64; 4],
}

impl ErrorSums {
    fn add(&mut self, error: f64, truth: f64, deviation: f64, mean: f64) {
        self.error += error;
        self.square += error * error;
        self.relative_square += (error / truth).powi(2);
        self.truth_square += (truth - mean).powi(2);
        self.crps += crps(error, deviation);
        if deviation.is_nan() {
            return;
        }
        let reduced = error / deviation;
        self.stated += 1.0;
        self.reduced_square += reduced * reduced;
        for (covered, (_, limit, _)) in self.covered.iter_mut().zip(NOMINAL) {
            *covered += f64::from(reduced.abs() <= limit);
        }
    }

    fn add_weighted(&mut self, other: &Self, weight: f64) {
        self.error += weight * other.error;
        self.square += weight * other.square;
        self.relative_square += weight * other.relative_square;
        self.truth_square += weight * other.truth_square;
        self.crps += weight * other.crps;
        self.stated += weight * other.stated;
        self.reduced_square += weight * other.reduced_square;
        for (covered, other) in self.covered.iter_mut().zip(other.covered) {
            *covered += weight * other;
        }
    }
}

/// Continuous ranked probability score of a normal law about the prediction; the absolute error where no deviation is stated.
fn crps(error: f64, deviation: f64) -> f64 {
    if deviation.is_nan() {
        return error.abs();
    }
    let z = error / deviation;
    let bell = (-0.5 * z * z).exp() / (2.0 * PI).sqrt();
    deviation * (z * erf(z * FRAC_1_SQRT_2) + 2.0 * bell - 1.0 / PI.sqrt())
}

/// Sums over the scans of a flight.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FlightSums {
    pub(super) errors: [ErrorSums; 3],
    pub(super) distance_square_m2: f64,
    pub(super) hits: f64,
    pub(super) missed: f64,
    pub(super) false_vortices: f64,
    pub(super) wakes: f64,
    pub(super) detected: f64,
    pub(super) empty: f64,
    pub(super) false_alarms: f64,
    /// Scans with a wake or empty ones that have a score.
    pub(super) with_score: f64,
}

impl FlightSums {
    /// `means`: of each quantity over the training flights.
    pub(super) fn add_hit(
        &mut self,
        truth: &TrueVortex,
        predicted: &PredictedVortex,
        means: [f64; 3],
    ) {
        for (index, quantity) in Quantity::ALL.into_iter().enumerate() {
            self.errors[index].add(
                predicted.error(truth, quantity),
                truth.values.value(quantity),
                predicted.deviations.value(quantity),
                means[index],
            );
        }
        self.distance_square_m2 += predicted.distance_m(truth).powi(2);
        self.hits += 1.0;
    }

    /// All but the scored vortices.
    pub(super) fn add_scan(&mut self, scan: &MatchedScan) {
        self.false_vortices += scan.false_vortices as f64;
        let has_predicted = f64::from(scan.has_predicted);
        if scan.has_wake() {
            self.wakes += 1.0;
            self.detected += has_predicted;
        } else if scan.is_empty {
            self.empty += 1.0;
            self.false_alarms += has_predicted;
        }
        if scan.has_wake() || scan.is_empty {
            self.with_score += f64::from(scan.score.is_some());
        }
    }

    pub(super) fn add_weighted(&mut self, other: &Self, weight: f64) {
        for (sums, other) in self.errors.iter_mut().zip(&other.errors) {
            sums.add_weighted(other, weight);
        }
        self.distance_square_m2 += weight * other.distance_square_m2;
        self.hits += weight * other.hits;
        self.missed += weight * other.missed;
        self.false_vortices += weight * other.false_vortices;
        self.wakes += weight * other.wakes;
        self.detected += weight * other.detected;
        self.empty += weight * other.empty;
        self.false_alarms += weight * other.false_alarms;
        self.with_score += weight * other.with_score;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_widths_are_those_of_the_normal_law() {
        for (probability, limit, name) in NOMINAL {
            approx::assert_relative_eq!(erf(limit * FRAC_1_SQRT_2), probability, epsilon = 1e-12);
            assert_eq!(name, format!("coverage_{probability}"));
        }
    }

    #[test]
    fn the_score_of_a_normal_law_is_the_integral_of_its_squared_error() {
        // Integral of (F(x) - 1[x >= truth])^2 over x, F the law about the prediction.
        let deviation = 2.0;
        for error in [0.0, 1.5, -4.0] {
            let step = 1e-3;
            let mut integral = 0.0;
            for index in 0..60_000 {
                let x = -30.0 + (f64::from(index) + 0.5) * step;
                let law = 0.5 * (1.0 + erf((x - error) / deviation * FRAC_1_SQRT_2));
                integral += (law - f64::from(x >= 0.0)).powi(2) * step;
            }
            approx::assert_relative_eq!(crps(error, deviation), integral, epsilon = 1e-6);
        }
        assert_eq!(crps(-3.0, f64::NAN), 3.0);
    }
}
