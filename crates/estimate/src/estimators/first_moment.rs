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

/// First moment of the spectrum about its main peak.
#[derive(Clone)]
pub struct FirstMoment {
    /// Hann window of lags (Blackman and Tukey 1958), and the search in the spectrum that it smooths.
    lag_window: Vec<f64>,
    smooth: SpectralPeak,
    spectrum: SpectralPeak,
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
        let reach_lags = (lags / 4).max(1);
        check_order(reach_lags, lags)?;
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
            reach,
            // the main lobe of the window
            least: padded_samples as f64 / lags as f64,
        })
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
        if peak.flag != Quality::Good || smooth.flag != Quality::Good {
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
        let mut centre = (sampling.frequency_hz(smooth.velocity_m_s) - low_hz) / spacing_hz;
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
