//! First moment of the main peak: the mean velocity of a spectrum that is skewed or has several peaks.
//!
//! (28) weights velocities, so that its estimate is a mean, not the most frequent value: where the wind changes
//! within a gate the peak of the spectrum lies aside of it. Computes the centroid of the density above the noise
//! floor within some standard deviations about itself, both found by iteration from a peak of the lag-windowed
//! spectrum, which is smooth. Narrow spectra are thus cut out of the noise and wide ones taken whole. Check: the mean
//! of two lines; simulated wind; the errors on a scan of a vortex pair.
//!
//! The floor is a low one, so that nothing of a wide spectrum is lost. At 0 dB what is left of the noise then widens the window
//! to most of the band with a reach of 3 or more, and calm air scatters as the noise of the band does; a reach of 2 costs
//! 0.2 m/s in a vortex and halves that. The book has the numbers.

use crate::error::{Error, positive};
use crate::estimators::{
    Estimator, GateVelocity, Quality, Refinement, SpectralPeak, model_lag_weights, search,
};
use crate::models::autoregressive::check_order;
use crate::window::{Sampling, Scratch, SignalKind};

/// Iterations of the window about the centroid.
const ITERATIONS: usize = 6;
/// Lags of the smooth spectrum, if there are as many: that of one is flat, that of few has its peak at an edge of the band.
const LEAST_LAGS: usize = 4;

/// First moment of the spectrum about its main peak.
#[derive(Clone)]
pub struct FirstMoment {
    /// Hann window of lags (Blackman and Tukey 1958), and the search in the spectrum that it smooths.
    lag_window: Vec<f64>,
    smooth: SpectralPeak,
    spectrum: SpectralPeak,
    /// Whether a quarter of the lags is fewer than the smooth spectrum needs.
    is_short: bool,
    /// Half of the window in standard deviations of the density in it.
    reach: f64,
    /// Narrowest half of the window \[bins\].
    least: f64,
}

impl FirstMoment {
    /// Plans the estimator for correlograms as [`SpectralPeak::new`] takes them and `padded_samples` frequencies.
    ///
    /// `reach` is the half width of the window about the centroid in standard deviations of the density in it, 1.5 to 3.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with less than 2 lags or a reach that is not above 0; [`Error::Band`] for an impossible band.
    pub fn new(
        sampling: &Sampling,
        kind: SignalKind,
        lag_weights: &[f64],
        padded_samples: usize,
        reach: f64,
    ) -> Result<Self, Error> {
        positive("reach", reach)?;
        let refinement = Refinement::Parabola;
        let lags = lag_weights.len();
        check_order(1, lags)?;
        let is_short = lags / 4 < LEAST_LAGS;
        let reach_lags = if is_short {
            LEAST_LAGS.min(lags)
        } else {
            lags / 4
        };
        let lag_window = model_lag_weights(reach_lags - 1);
        let weights: Vec<f64> = lag_window
            .iter()
            .zip(lag_weights)
            .map(|(window, own)| window * own)
            .collect();
        Ok(Self {
            smooth: SpectralPeak::new(sampling, kind, &weights, padded_samples, refinement)?,
            lag_window,
            spectrum: SpectralPeak::new(sampling, kind, lag_weights, padded_samples, refinement)?,
            is_short,
            reach,
            // the main lobe of the window
            least: padded_samples as f64 / lags as f64,
        })
    }

    /// Bin in the band of a velocity.
    fn bin_of(&self, velocity_m_s: f64) -> f64 {
        let [low_hz, next_hz] = [0.0, 1.0].map(|bin| self.spectrum.search.band.frequency_hz(bin));
        (self.spectrum.sampling().frequency_hz(velocity_m_s) - low_hz) / (next_hz - low_hz)
    }

    /// Bin from which the window starts: the peak of the smooth spectrum. The mirror image of real samples pulls that of few lags to an
    /// edge of the band, where no window fits: the peak of the spectrum then, where it is farther from the edges.
    fn start(&self, smooth_m_s: f64, peak_m_s: f64) -> f64 {
        let smooth = self.bin_of(smooth_m_s);
        if !self.is_short {
            return smooth;
        }
        let peak = self.bin_of(peak_m_s);
        let last = self.spectrum.search.band.bins as f64 - 1.0;
        if smooth.min(last - smooth) < peak.min(last - peak) {
            peak
        } else {
            smooth
        }
    }
}

impl Estimator for FirstMoment {
    fn statistic_len(&self) -> usize {
        self.spectrum.statistic_len()
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        let kind = self.smooth.search.kind;
        let mut numbers = std::mem::take(&mut scratch.numbers);
        numbers.clear();
        numbers.extend(kind.weighted_lags(mean, &self.lag_window));
        let smooth = self.smooth.estimate(&numbers, scratch);
        scratch.numbers = numbers;
        let peak = self.spectrum.estimate(mean, scratch);
        let has_start =
            smooth.flag == Quality::Good || (self.is_short && smooth.flag == Quality::OutOfBand);
        if peak.flag != Quality::Good || !has_start {
            return peak;
        }
        let sampling = *self.spectrum.sampling();
        let [low_hz, next_hz] = [0.0, 1.0].map(|bin| self.spectrum.search.band.frequency_hz(bin));
        let spacing_hz = next_hz - low_hz;
        let Ok(density) = self.spectrum.band_density(mean, scratch) else {
            return GateVelocity::none(Quality::Invalid);
        };
        let floor =
            search::lanes_sum(density) / density.len() as f64 / (1.0 + smooth.snr.max(peak.snr));
        let mut centre = self.start(smooth.velocity_m_s, peak.velocity_m_s);
        let mut half = 0.5 * density.len() as f64;
        for _ in 0..ITERATIONS {
            let Some((centroid, variance)) = moments(density, centre, half, floor) else {
                break;
            };
            centre = centroid;
            half = (self.reach * variance.max(0.0).sqrt()).max(self.least);
        }
        GateVelocity {
            velocity_m_s: sampling.velocity_m_s(low_hz + centre * spacing_hz),
            ..peak
        }
    }
}

/// Centroid and variance of the density above `floor` within `half` of `centre`; `None` if nothing is above it there.
fn moments(density: &[f64], centre: f64, half: f64, floor: f64) -> Option<(f64, f64)> {
    // as far to both sides, so that the floor and its errors do not pull the centroid
    let half = half
        .min(centre.max(0.0))
        .min((density.len() as f64 - 1.0 - centre).max(0.0))
        .max(1.0);
    let first = (centre - half).ceil().max(0.0) as usize;
    let last = ((centre + half).floor() as usize).min(density.len() - 1);
    let mut sum = 0.0;
    let mut once = 0.0;
    let mut twice = 0.0;
    for (k, density) in density.iter().enumerate().take(last + 1).skip(first) {
        let excess = density - floor;
        let distance = k as f64 - centre;
        sum += excess;
        once += excess * distance;
        twice += excess * distance * distance;
    }
    let mean = once / sum;
    (sum > 0.0 && mean.abs() <= half).then(|| (centre + mean, twice / sum - mean * mean))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::unweighted_lags;
    use num_complex::Complex;

    /// Lags of two lines with the powers 1 and 0.6 in white noise of power 0.1.
    fn two_lines(
        sampling: &Sampling,
        kind: SignalKind,
        samples: usize,
        velocity_m_s: [f64; 2],
    ) -> Vec<f64> {
        let mut numbers = Vec::new();
        for (m, weight) in unweighted_lags(samples).into_iter().enumerate() {
            let mut lag = Complex::new(if m == 0 { 0.1 } else { 0.0 }, 0.0);
            for (power, velocity_m_s) in [1.0, 0.6].into_iter().zip(velocity_m_s) {
                let cycles = sampling.frequency_hz(velocity_m_s) / sampling.sample_rate_hz;
                lag += Complex::from_polar(power, std::f64::consts::TAU * cycles * m as f64);
            }
            numbers.push(weight * lag.re);
            if kind == SignalKind::Complex {
                numbers.push(weight * lag.im);
            }
        }
        numbers
    }

    /// Errors of the first moment and of the peak of the spectrum against the mean of two lines, m/s.
    fn errors_m_s(
        sampling: &Sampling,
        kind: SignalKind,
        samples: usize,
        velocity_m_s: [f64; 2],
    ) -> [f64; 2] {
        let weights = unweighted_lags(samples);
        let moment = FirstMoment::new(sampling, kind, &weights, 1024, 2.0).unwrap();
        let refinement = Refinement::Parabola;
        let peak = SpectralPeak::new(sampling, kind, &weights, 1024, refinement).unwrap();
        let lags = two_lines(sampling, kind, samples, velocity_m_s);
        let mean_m_s = (velocity_m_s[0] + 0.6 * velocity_m_s[1]) / 1.6;
        let estimators: [&dyn Estimator; 2] = [&moment, &peak];
        estimators.map(|estimator| {
            let found = estimator.estimate(&lags, &mut Scratch::new());
            assert_eq!(found.flag, Quality::Good, "{samples} {velocity_m_s:?}");
            found.velocity_m_s - mean_m_s
        })
    }

    #[test]
    fn short_windows_of_two_quadratures_give_the_mean_of_two_lines() {
        let sampling = Sampling::baseband(80e6, 1.55e-6, 60e6).unwrap();
        for samples in [5, 6, 7, 12] {
            let [moment_m_s, peak_m_s] =
                errors_m_s(&sampling, SignalKind::Complex, samples, [2.0, -5.0]);
            assert!(
                moment_m_s.abs() < 0.5 * peak_m_s.abs(),
                "{samples}: {moment_m_s} {peak_m_s}"
            );
        }
    }

    #[test]
    fn short_windows_of_real_samples_do_not_fall_back_to_the_peak() {
        let sampling = Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap();
        let mut squares = [0.0; 2];
        for k in -4..=4 {
            let middle_m_s = 2.0 * f64::from(k);
            let lines_m_s = [middle_m_s + 2.0, middle_m_s - 4.0];
            let errors = errors_m_s(&sampling, SignalKind::Real, 8, lines_m_s);
            for (square, error_m_s) in squares.iter_mut().zip(errors) {
                *square += error_m_s * error_m_s;
            }
        }
        assert!(squares[0] < 0.5 * squares[1], "{squares:?}");
        assert!(squares[0] < 9.0 * 0.2 * 0.2, "{squares:?}");
    }
}
