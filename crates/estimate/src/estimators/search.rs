//! Search of a density for its peak inside the detector band, and what the peak tells: width, SNR, runner-up, flag.
//!
//! Works on the densities of the band alone, whatever made them. Check: a tone returns its velocity; zero, constant and
//! out-of-band signals are flagged; width and SNR of simulated wind (in the tests of the estimators).

use crate::error::Error;
use crate::estimators::{GateVelocity, Quality, Refinement, RunnerUp};
use crate::spectrum::lag_spectrum::Band;
use crate::window::{Sampling, SignalKind};

/// Below this fraction of the highest density outside, the band may hold nothing but sidelobes: the
/// first sidelobe of an unweighted window is 0.047 of its main lobe.
const SIDELOBE: f64 = 0.05;

/// Full width at half maximum of a Gaussian over its standard deviation: 2 sqrt(2 ln 2).
pub(crate) const FULL_WIDTH: f64 = 2.354_820_045_030_949;

/// Half-widths at half maximum on each side that belong to the main peak; beyond them a Gaussian is below 2e-5.
const LOBE: f64 = 4.0;

/// The flag of a mean correlogram that cannot hold a velocity: not finite, or without power.
pub(crate) fn unusable(correlogram: &[f64]) -> Option<Quality> {
    if !correlogram.iter().all(|value| value.is_finite()) {
        Some(Quality::Invalid)
    } else if correlogram.first().is_none_or(|power| *power <= 0.0) {
        Some(Quality::NoSignal)
    } else {
        None
    }
}

/// Upper limit of the density that a correlogram has at any frequency.
pub(crate) fn density_limit(correlogram: &[f64]) -> f64 {
    // the sum of the absolute parts, twice: at least |r_0| + 2 sum |r_m|
    2.0 * correlogram.iter().map(|value| value.abs()).sum::<f64>()
}

/// The highest density outside the band \[its value, its distance from 0 Hz in cycles per sample\].
pub(crate) type Outside = (f64, f64);

/// The peak search on any density in the detector band.
#[derive(Debug, Clone)]
pub(crate) struct PeakSearch {
    pub(crate) sampling: Sampling,
    pub(crate) band: Band,
    kind: SignalKind,
    padded: usize,
    /// A line closer to 0 Hz than this \[cycles per sample\] counts as a constant.
    constant: f64,
    /// Standard deviation of the window's own spectrum \[bins\].
    pub(crate) own_width: f64,
}

/// What the search found.
pub(crate) struct Located {
    pub(crate) top: i64,
    /// Fractional bin of the peak in the band.
    pub(crate) bin: f64,
    pub(crate) peak: f64,
    pub(crate) sum: f64,
    lobe: Lobe,
    pub(crate) flag: Quality,
}

/// Main peak and what lies beside it.
struct Lobe {
    /// Mean density beside the main peak.
    floor: f64,
    /// Standard deviation of the main peak \[bins\].
    width: f64,
    /// Bin and density of the second peak.
    second: Option<(usize, f64)>,
}

impl PeakSearch {
    /// `samples` is the length of the window, whose weighting counts as rectangular.
    pub(crate) fn new(sampling: &Sampling, kind: SignalKind, padded: usize, samples: usize) -> Result<Self, Error> {
        let band = Band::new(sampling, kind, padded)?;
        let constant = 1.0 / samples as f64;
        // half the maximum of the spectrum of n equal weights is 0.443 / n from its centre
        let own_width = 0.886 / FULL_WIDTH * constant * padded as f64;
        Ok(Self { sampling: *sampling, band, kind, padded, constant, own_width })
    }

    /// Frequencies of the grid over 0 .. F_s.
    pub(crate) fn padded(&self) -> usize {
        self.padded
    }

    /// Highest density in the band, by bin or by parabola through its logarithm.
    ///
    /// `density` holds the bins of the band and one neighbour on each side; `outside` is asked where it matters.
    pub(crate) fn locate(
        &self,
        density: &[f64],
        refinement: Refinement,
        outside: impl FnOnce(f64, f64) -> Option<Outside>,
    ) -> Located {
        let inside = &density[1..=self.band.bins];
        let (top, peak) = highest(inside);
        let sum: f64 = lanes_sum(inside);
        let bin = match refinement {
            Refinement::None => top as f64,
            _ => parabola(density, top),
        };
        let flag = self.flag(peak, top, outside(peak, sum));
        Located { top: top as i64, bin, peak, sum, lobe: Lobe::new(inside, top, peak), flag }
    }

    /// The estimate for a peak placed at `frequency_hz`.
    pub(crate) fn velocity(&self, found: &Located, frequency_hz: f64) -> GateVelocity {
        let sides = match self.kind {
            SignalKind::Real => 2.0,
            SignalKind::Complex => 1.0,
        };
        if found.flag == Quality::NoSignal {
            return GateVelocity { power: sides * found.sum / self.padded as f64, ..GateVelocity::none(found.flag) };
        }
        let bins = self.band.bins as f64;
        let lobe = &found.lobe;
        let width = (lobe.width * lobe.width - self.own_width * self.own_width).max(0.0).sqrt();
        let bin_m_s = 0.5 * self.sampling.wavelength_m * self.sampling.sample_rate_hz / self.padded as f64;
        GateVelocity {
            velocity_m_s: self.sampling.velocity_m_s(frequency_hz),
            power: sides * found.sum / self.padded as f64,
            quality: found.peak * bins / found.sum,
            detection: found.peak,
            width_m_s: width * bin_m_s,
            snr: (found.sum / (bins * lobe.floor.max(0.0)) - 1.0).max(0.0),
            runner_up: lobe.second.map(|(bin, density)| RunnerUp {
                velocity_m_s: self.sampling.velocity_m_s(self.band.frequency_hz(bin as f64)),
                relative_density: density / found.peak,
            }),
            flag: found.flag,
        }
    }

    /// Power and highest density in the band; `density` as for [`PeakSearch::locate`].
    pub(crate) fn power_and_detection(&self, density: &[f64]) -> (f64, f64) {
        let inside = &density[1..=self.band.bins];
        let sum = lanes_sum(inside);
        let sides = if self.kind == SignalKind::Real { 2.0 } else { 1.0 };
        (sides * sum / self.padded as f64, highest(inside).1)
    }

    /// Flag of a search whose highest density in the band is `peak`, in bin `top`.
    fn flag(&self, peak: f64, top: usize, outside: Option<Outside>) -> Quality {
        if let Some((highest, from_zero)) = outside
            && peak < SIDELOBE * highest
        {
            let constant = self.kind == SignalKind::Real && from_zero < self.constant;
            return if constant { Quality::NoSignal } else { Quality::OutOfBand };
        }
        let edge = top == 0 || top + 1 == self.band.bins;
        if edge && !self.band.cyclic { Quality::OutOfBand } else { Quality::Good }
    }
}

/// Whether a peak is so high that nothing below `limit` can have it for a sidelobe.
pub(crate) fn beyond_doubt(peak: f64, limit: f64) -> bool {
    peak >= SIDELOBE * limit
}

impl Lobe {
    fn new(density: &[f64], top: usize, peak: f64) -> Self {
        let mut floor = 0.0;
        let mut reach = [0.0; 2];
        // the half height needs the floor and the floor the half height: one repetition settles it
        for _ in 0..2 {
            reach = half_widths(density, top, floor + 0.5 * (peak - floor));
            floor = mean_beside(density, top, reach);
        }
        let second = second_peak(density, top, reach);
        Self { floor, width: (reach[0] + reach[1]) / FULL_WIDTH, second }
    }
}

/// Distances \[bins\] from `top` to where the density falls to `level` on either side; to the end of the band if it does not.
fn half_widths(density: &[f64], top: usize, level: f64) -> [f64; 2] {
    let distance = |steps: usize, above: f64, below: f64| steps as f64 + (above - level) / (above - below);
    let down = density[..top].iter().rposition(|value| *value < level);
    let up = density[top + 1..].iter().position(|value| *value < level);
    [
        down.map_or(top as f64, |k| distance(top - k - 1, density[k + 1], density[k])),
        up.map_or((density.len() - 1 - top) as f64, |k| distance(k, density[top + k], density[top + 1 + k])),
    ]
}

/// Mean density away from the peak; the lowest density if the peak fills the band.
fn mean_beside(density: &[f64], top: usize, reach: [f64; 2]) -> f64 {
    let low = (top as f64 - (LOBE * reach[0]).ceil()).max(0.0) as usize;
    let high = ((top as f64 + (LOBE * reach[1]).ceil()) as usize + 1).min(density.len());
    let count = low + density.len() - high;
    if count == 0 {
        return density.iter().copied().fold(f64::INFINITY, f64::min);
    }
    (lanes_sum(&density[..low]) + lanes_sum(&density[high..])) / count as f64
}

/// Highest density beyond the first valley on each side of the peak.
fn second_peak(density: &[f64], top: usize, reach: [f64; 2]) -> Option<(usize, f64)> {
    let (left, right) = (top - reach[0] as usize, top + reach[1] as usize);
    // from the half height on, to the first place where the density rises again
    let low = (1..=left).rev().find(|&k| density[k - 1] > density[k]);
    let high = (right..density.len() - 1).find(|&k| density[k + 1] > density[k]);
    let below = low.map(|k| highest(&density[..k]));
    let above = high.map(|k| {
        let (place, value) = highest(&density[k + 1..]);
        (k + 1 + place, value)
    });
    match (below, above) {
        (Some(a), Some(b)) => Some(if b.1 > a.1 { b } else { a }),
        (one, other) => one.or(other),
    }
}

/// Fractional bin of the peak next to bin `top`, by parabola; `density` begins one bin early.
fn parabola(density: &[f64], top: usize) -> f64 {
    let floor = density[top + 1] * 1e-30;
    let [left, middle, right] = [0, 1, 2].map(|k| density[top + k].max(floor).ln());
    let curvature = left - 2.0 * middle + right;
    if curvature < 0.0 { top as f64 + (0.5 * (left - right) / curvature).clamp(-0.5, 0.5) } else { top as f64 }
}

/// Sum in independent lanes, so that the additions need not wait for each other.
pub(crate) fn lanes_sum(values: &[f64]) -> f64 {
    let (chunks, rest) = values.as_chunks::<8>();
    let mut lanes = [0.0; 8];
    for chunk in chunks {
        for (lane, value) in lanes.iter_mut().zip(chunk) {
            *lane += value;
        }
    }
    lanes.iter().chain(rest).sum()
}

/// Place and value of the first highest number; (0, -inf) if there is none.
pub(crate) fn highest(values: &[f64]) -> (usize, f64) {
    let mut lanes = [f64::NEG_INFINITY; 8];
    let (chunks, rest) = values.as_chunks::<8>();
    for chunk in chunks {
        for (lane, value) in lanes.iter_mut().zip(chunk) {
            *lane = if *value > *lane { *value } else { *lane };
        }
    }
    let highest = lanes.iter().chain(rest).copied().fold(f64::NEG_INFINITY, f64::max);
    (values.iter().position(|value| *value == highest).unwrap_or(0), highest)
}

/// Standard deviation \[cycles per sample\] of the spectrum of a window whose weights have the autocorrelation `lag_weights`.
///
/// That of a Gaussian with the same width at half maximum.
pub(crate) fn own_width_cycles(lag_weights: &[f64]) -> f64 {
    let at = |cycles: f64| {
        let angle = std::f64::consts::TAU * cycles;
        let sum: f64 = lag_weights.iter().enumerate().skip(1).map(|(m, w)| w * (angle * m as f64).cos()).sum();
        lag_weights.first().copied().unwrap_or(0.0) + 2.0 * sum
    };
    let half = 0.5 * at(0.0);
    let step = 1.0 / (32 * lag_weights.len().max(1)) as f64;
    let Some(place) = (1..).map(|k| k as f64 * step).take_while(|f| *f <= 0.5).find(|f| at(*f) < half) else {
        return 0.5;
    };
    let (above, below) = (at(place - step), at(place));
    2.0 * (place - step * (half - below) / (above - below)) / FULL_WIDTH
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_width_of_equal_and_gaussian_weights() {
        let triangle: Vec<f64> = (0..64).map(|m| 1.0 - f64::from(m) / 64.0).collect();
        assert!((own_width_cycles(&triangle) * 64.0 - 0.886 / FULL_WIDTH).abs() < 2e-4);
        // exp(-m^2 / (2 s^2)) has a spectrum of standard deviation 1 / (2 pi s)
        let gaussian: Vec<f64> = (0..64).map(|m| (-0.5 * f64::from(m * m) / 100.0).exp()).collect();
        assert!((own_width_cycles(&gaussian) * 20.0 * std::f64::consts::PI - 1.0).abs() < 2e-3);
    }

    #[test]
    fn lobe_of_two_gaussians_on_a_floor() {
        let gaussian = |k: f64, centre: f64, width: f64| (-0.5 * ((k - centre) / width).powi(2)).exp();
        let density: Vec<f64> =
            (0..200).map(f64::from).map(|k| 0.1 + gaussian(k, 60.3, 6.0) + 0.5 * gaussian(k, 120.0, 4.0)).collect();
        let lobe = Lobe::new(&density, 60, density[60]);
        assert!((lobe.width - 6.0).abs() < 0.3, "{}", lobe.width);
        assert_eq!(lobe.second.unwrap().0, 120);
        let alone: Vec<f64> = (0..200).map(f64::from).map(|k| 0.1 + gaussian(k, 60.3, 6.0)).collect();
        let lobe = Lobe::new(&alone, 60, alone[60]);
        assert!((lobe.floor - 0.1).abs() < 1e-3 && (lobe.width - 6.0).abs() < 0.05, "{} {}", lobe.floor, lobe.width);
        assert!(lobe.second.is_none());
        // a flat band: everything is the main peak, and nothing is above the floor
        let flat = Lobe::new(&[1.0; 50], 0, 1.0);
        assert!(flat.floor == 1.0 && flat.second.is_none());
        let single = Lobe::new(&[1.0], 0, 1.0);
        assert!(single.second.is_none());
    }
}
