//! The map that an estimator shows of wakes near a given one, to first order, and how far its velocities scatter.
//!
//! Slopes are difference quotients over steps of about a third of what a scan tells of a parameter: peaks of spectra
//! jump, and over such a step enough of them do for a mean slope. Velocities scatter the more the broader the air's
//! velocities: the logarithm of the residuals is fitted by a straight line over ln(1 + variance of the air / its
//! median), and its slope p gives standard deviations (1 + ...)^p. Check: fits of exact maps, the spread of fits over
//! scans, and the power of made-up residuals.

use ndarray::{Array2, ArrayView2};

use crate::vortex_fit::map_fit::data::median;
use crate::vortex_fit::map_fit::estimator_response::Prepared;
use crate::vortex_fit::{VelocityMap, Wake};

/// Map and slopes about a wake: the velocities of wakes near it to first order.
pub(crate) struct Tangent {
    pub(crate) at: Wake,
    pub(crate) velocity_m_s: Array2<f64>,
    /// One for each free number.
    pub(crate) slopes: Vec<Array2<f64>>,
    /// Standard deviations of the velocities over those in uniform wind.
    pub(crate) deviation: Array2<f64>,
}

impl Tangent {
    /// About `at`, where `here` is the map, with slopes about it or about a wake near by.
    pub(crate) fn new(
        prepared: &Prepared<'_>,
        at: Wake,
        here: ArrayView2<'_, f64>,
        slopes: &[Array2<f64>],
        map: &VelocityMap<'_>,
    ) -> Self {
        let mut tangent =
            Self { at, velocity_m_s: here.to_owned(), slopes: slopes.to_vec(), deviation: Array2::ones(here.dim()) };
        tangent.learn_deviations(&prepared.variances(&at), map);
        tangent
    }

    /// Difference quotients of the map about `at` with respect to the groups of parameters.
    pub(crate) fn slopes(
        prepared: &Prepared<'_>,
        at: &Wake,
        here: ArrayView2<'_, f64>,
        groups: &[Vec<usize>],
    ) -> Vec<Array2<f64>> {
        let quotient = |group: &Vec<usize>| {
            let step = step(at, group[0]);
            let mut parameters = at.to_array();
            group.iter().for_each(|&place| parameters[place] += step);
            let there = prepared.velocities(&Wake::from_array(&parameters));
            (there - here) / step
        };
        groups.iter().map(quotient).collect()
    }

    /// Learns from the residuals how they grow with the variance of the air: ln|r| is a straight line over ln(1 +
    /// variance / its median).
    fn learn_deviations(&mut self, variance: &Array2<f64>, map: &VelocityMap<'_>) {
        let typical = median(&mut variance.iter().copied().collect::<Vec<f64>>()).max(f64::MIN_POSITIVE);
        let broad = variance.mapv(|v| (v / typical).ln_1p());
        let [mut n, mut x, mut y, mut xx, mut xy] = [0.0; 5];
        for ((place, broad), shown) in broad.indexed_iter().zip(&self.velocity_m_s) {
            let residual = (map.velocity_m_s[place] - shown).abs() / map.deviation(place.0, place.1);
            let log = residual.ln();
            if log.is_finite() {
                (n, x, y, xx, xy) = (n + 1.0, x + broad, y + log, xx + broad * broad, xy + broad * log);
            }
        }
        let power = ((n * xy - x * y) / (n * xx - x * x)).clamp(0.0, 1.0);
        if power.is_finite() {
            self.deviation = broad.mapv(|b| (power * b).exp());
        }
    }

    /// The part of the way to a wake that the quotients can speak for.
    pub(crate) fn reach(&self, to: &Wake) -> f64 {
        let (a, b) = (self.at.to_array(), to.to_array());
        let part = |place: usize| REACH * step(&self.at, place) / (b[place] - a[place]).abs().max(f64::MIN_POSITIVE);
        (0..a.len()).map(part).fold(1.0, f64::min)
    }
}

/// Whether slopes about one wake serve for another: no parameter is more than so many steps away.
pub(crate) fn near(a: &Wake, b: &Wake) -> bool {
    let (from, to) = (a.to_array(), b.to_array());
    (0..from.len()).all(|place| (to[place] - from[place]).abs() <= NEAR * step(a, place))
}

/// A step is a third of an error.
const NEAR: f64 = 3.0;
/// The map is linear enough over this many steps.
const REACH: f64 = 12.0;

/// Spacing that stands for that of a vortex without a partner \[m\].
const LONE_M: f64 = 45.0;

/// Step of a difference quotient.
pub(crate) fn step(wake: &Wake, place: usize) -> f64 {
    let spacing_m = if wake.is_pair() { wake.spacing_m() } else { LONE_M };
    match place {
        0 | 1 => 0.01 * wake.to_array()[place].abs().max(1.0),
        2..=5 => 0.006 * spacing_m,
        6 | 7 => 0.002 * spacing_m,
        8 => 0.1,
        _ => 0.1 / spacing_m,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Residuals whose size grows with the variance of the air to a known power.
    #[test]
    fn the_power_of_the_scatter_is_learnt_from_the_residuals() {
        let variance = Array2::from_shape_fn((40, 50), |(i, j)| 0.1 * (0.2 * i as f64).exp() + 0.01 * j as f64);
        let typical = median(&mut variance.iter().copied().collect::<Vec<f64>>());
        let grown = |power: f64| variance.mapv(|v| (1.0 + v / typical).powf(power));
        let (lines, gates): (Vec<f64>, Vec<f64>) = ((0..40).map(f64::from).collect(), (0..50).map(f64::from).collect());
        let wake = Wake::from_array(&[500.0, 500.0, 376.5, 47.0, 423.5, 47.0, 2.0, 2.0, 0.0, 0.0]);
        for (power, learnt) in [(0.4, 0.4), (0.0, 0.0), (-0.3, 0.0)] {
            let mut place = 0.0_f64;
            // uniform numbers between -0.5 and 0.5
            let residual = grown(power).mapv(|size| {
                place += 1.0;
                let number = (place * 12.9898).sin() * 43_758.545;
                size * (number - number.floor() - 0.5)
            });
            let map = VelocityMap {
                elevation_rad: &lines,
                range_m: &gates,
                velocity_m_s: residual.view(),
                standard_deviation_m_s: None,
            };
            let zeros = Array2::zeros(residual.dim());
            let mut tangent =
                Tangent { at: wake, velocity_m_s: zeros, slopes: vec![], deviation: Array2::ones(residual.dim()) };
            tangent.learn_deviations(&variance, &map);
            let worst = (&tangent.deviation / &grown(learnt)).iter().fold(0.0_f64, |worst, r| worst.max(r.ln().abs()));
            assert!(worst < 0.2, "{power}: {worst}");
        }
    }
}
