//! Search of a density for its peak inside the detector band, and properties of the peak: width, SNR, flag.
//!
//! Works on the densities of the band alone, whatever their source. Check: a tone returns its velocity; zero, constant and
//! out-of-band signals are flagged; width and SNR of simulated wind (in the tests of the estimators).

use num_complex::Complex;
use std::cell::LazyCell;

use crate::error::Error;
use crate::estimators::{GateVelocity, Quality, Refinement};
use crate::spectrum::lag_spectrum::Band;
use crate::spectrum::{LagSpectrum, ZoomSpectrum};
use crate::window::{Sampling, Scratch, SignalKind};

/// Largest factor by which noise raises the amplitude that a line outside leaks into the band.
const RAISED: f64 = 1.5;

/// Widths of spectra for which that of the peak is known, from 0 to 9 times that of a line.
const WIDTHS: usize = 13;

/// Number of them up to the width of a line.
const LEAST_WIDTHS: usize = 5;

/// Increase of the squared width of a peak over that of its spectrum below which the peak does not determine the spectrum.
const LEAST_SHARE: f64 = 0.25;

/// Full width at half maximum of a Gaussian over its standard deviation: 2 sqrt(2 ln 2).
pub(crate) const FULL_WIDTH: f64 = 2.354_820_045_030_949;

/// Lowest over highest density below which there is no noise beneath a peak that fills the band.
const BARE: f64 = 0.02;

/// Full widths of the peak that the bins beside it must hold for its width to be measured above
/// noise.
const LEAST_BESIDE: f64 = 0.5;

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
fn density_limit(correlogram: &[f64]) -> f64 {
    // the sum of the absolute parts, twice: at least |r_0| + 2 sum |r_m|
    2.0 * correlogram.iter().map(|value| value.abs()).sum::<f64>()
}

/// The spectrum of correlograms in the detector band and the search for its peak, or that of any density there.
#[derive(Clone)]
pub(crate) struct PeakSearch {
    pub(crate) sampling: Sampling,
    pub(crate) band: Band,
    pub(crate) kind: SignalKind,
    padded: usize,
    /// Spectrum at the frequencies of the band and one neighbour on each side, and on a whole grid.
    pub(crate) zoom: ZoomSpectrum,
    whole: LagSpectrum,
    /// A line closer to 0 Hz than this \[cycles per sample\] counts as a constant.
    constant: f64,
    /// Squares of the standard deviations of peak and spectrum \[bins^2\], from that of a line on; empty where the width of the peak does
    /// not determine that of its spectrum.
    widths: Vec<(f64, f64)>,
    /// Highest density of a line at a distance from its frequency and beyond, over that of its peak; distances up to half a cycle per
    /// sample, equally spaced.
    leak: Vec<f64>,
}

/// What the search found.
pub(crate) struct Located {
    /// Fractional bin of the peak in the band.
    pub(crate) bin: f64,
    pub(crate) peak: f64,
    pub(crate) sum: f64,
    /// Mean density beside the main peak.
    floor: f64,
    /// Standard deviation of the main peak \[bins\]; NaN where it nearly fills the band with noise
    /// beneath, which then is not known.
    width: f64,
    pub(crate) flag: Quality,
}

impl PeakSearch {
    /// Plans the search for the spectrum of correlograms with `lag_weights`, among `padded` frequencies over 0 .. F_s.
    pub(crate) fn new(
        sampling: &Sampling,
        kind: SignalKind,
        padded: usize,
        lag_weights: &[f64],
    ) -> Result<Self, Error> {
        let lags = lag_weights.len();
        let whole = LagSpectrum::new(kind, lags, padded)?;
        let band = Band::new(sampling, kind, padded)?;
        let zoom = ZoomSpectrum::new(kind, lags, sampling, &band.with_neighbours_hz())?;
        let line = LagSpectrum::new(SignalKind::Real, lags, padded.max(8 * lags))?;
        let mut scratch = Scratch::new();
        let line = line.density(lag_weights, &mut scratch)?;
        let mut leak: Vec<f64> = line[..=line.len() / 2]
            .iter()
            .map(|density| (density / line[0]).abs())
            .collect();
        for index in (1..leak.len()).rev() {
            leak[index - 1] = leak[index - 1].max(leak[index]);
        }
        Ok(Self {
            sampling: *sampling,
            band,
            kind,
            padded,
            zoom,
            whole,
            constant: 1.0 / lags as f64,
            widths: widths(lag_weights, padded, band.bins)?,
            leak,
        })
    }

    /// Numbers of the correlograms.
    pub(crate) fn statistic_len(&self) -> usize {
        self.whole.numbers()
    }

    /// The peak of the spectrum of a correlogram; `None` for another number of lags.
    pub(crate) fn find(
        &self,
        lags: &[f64],
        refinement: Refinement,
        scratch: &mut Scratch,
    ) -> Option<Located> {
        let mut band = std::mem::take(&mut scratch.band);
        self.zoom.density_into(lags, &mut band).ok()?;
        let found = self.locate(&band, refinement, lags, &mut || {
            let density = self.whole.density(lags, scratch).ok()?;
            let (bin, highest) = highest(density);
            Some((highest, bin as f64 / density.len() as f64))
        });
        scratch.band = band;
        Some(found)
    }

    /// Highest density in the band, by bin or by parabola through its logarithm.
    ///
    /// `density` holds the bins of the band and one neighbour on each side, and is that of `lags`; `anywhere` returns the highest
    /// density at any frequency, and that frequency in cycles per sample. It is called where it matters: never without lags.
    pub(crate) fn locate(
        &self,
        density: &[f64],
        refinement: Refinement,
        lags: &[f64],
        anywhere: &mut dyn FnMut() -> Option<(f64, f64)>,
    ) -> Located {
        let inside = &density[1..=self.band.bins];
        let (top, peak) = highest(inside);
        let sum: f64 = lanes_sum(inside);
        let bin = match refinement {
            Refinement::None => top as f64,
            _ => parabola(density, top),
        };
        let (floor, width) = floor_and_width(inside, top, peak);
        // What holds half of the power is no sidelobe, and a line outside is at least as far away as the edge of the band.
        let to_edge = top.min(self.band.bins - 1 - top) as f64 / self.padded as f64;
        let is_doubtful = self.power(sum) < 0.5 * lags.first().copied().unwrap_or(0.0)
            && peak - floor < self.leaked(to_edge, density_limit(lags));
        let flag = self.flag(
            peak - floor,
            top,
            floor,
            if is_doubtful { anywhere() } else { None },
        );
        Located {
            bin,
            peak,
            sum,
            floor,
            width,
            flag,
        }
    }

    /// The estimate for a peak that was found.
    pub(crate) fn velocity(&self, found: &Located) -> GateVelocity {
        let power = self.power(found.sum);
        if found.flag == Quality::NoSignal {
            return GateVelocity {
                power,
                ..GateVelocity::none(found.flag)
            };
        }
        let bins = self.band.bins as f64;
        let bin_m_s =
            0.5 * self.sampling.wavelength_m * self.sampling.sample_rate_hz / self.padded as f64;
        let square_m2_s2 = bin_m_s * bin_m_s;
        GateVelocity {
            velocity_m_s: self
                .sampling
                .velocity_m_s(self.band.frequency_hz(found.bin)),
            power,
            quality: found.peak * bins / found.sum,
            detection: found.peak,
            spread_m2_s2: self.spread(found.width * found.width) * square_m2_s2,
            resolution_m2_s2: self
                .widths
                .first()
                .map_or(f64::NAN, |line| line.0 * square_m2_s2),
            snr: (found.sum / (bins * found.floor.max(0.0)) - 1.0).max(0.0),
            flag: found.flag,
        }
    }

    /// Power in the band, over which the densities have that sum.
    pub(crate) fn power(&self, sum: f64) -> f64 {
        let sides = if self.kind == SignalKind::Real {
            2.0
        } else {
            1.0
        };
        sides * sum / self.padded as f64
    }

    /// Variance \[bins^2\] of the Gaussian spectrum whose peak has the variance `of_peak`; below 0 for a peak narrower than that of a
    /// line, NaN where peaks do not determine it.
    fn spread(&self, of_peak: f64) -> f64 {
        let above = self.widths.partition_point(|(at, _)| *at < of_peak).max(1);
        match (self.widths.get(above - 1), self.widths.get(above)) {
            (Some(low), Some(high)) => {
                low.1 + (high.1 - low.1) * (of_peak - low.0) / (high.0 - low.0)
            }
            _ => f64::NAN,
        }
    }

    /// Most that a line of density `highest` reaches beside noise, `distance` cycles per sample away and beyond.
    fn leaked(&self, distance: f64, highest: f64) -> f64 {
        let index = (distance * 2.0 * (self.leak.len() - 1) as f64) as usize;
        RAISED * RAISED * self.leak[index.min(self.leak.len() - 1)] * highest
    }

    /// Flag of a search whose highest density in the band is `peak` above the mean beside it, `floor`, in bin `top`.
    fn flag(&self, peak: f64, top: usize, floor: f64, anywhere: Option<(f64, f64)>) -> Quality {
        let is_real = self.kind == SignalKind::Real;
        if let Some((highest, line)) = anywhere
            && !self.holds(line)
        {
            let own = self.band.frequency_hz(top as f64) / self.sampling.sample_rate_hz;
            let image = if is_real { -line } else { line };
            let distance = cyclic_distance(line, own).min(cyclic_distance(image, own));
            if peak < self.leaked(distance, highest - floor) {
                let is_constant = is_real && cyclic_distance(line, 0.0) < self.constant;
                return if is_constant {
                    Quality::NoSignal
                } else {
                    Quality::OutOfBand
                };
            }
        }
        let edge = top == 0 || top + 1 == self.band.bins;
        if edge && !self.band.cyclic {
            Quality::OutOfBand
        } else {
            Quality::Good
        }
    }

    /// Whether a frequency in cycles per sample, or its image, lies in the band.
    fn holds(&self, frequency: f64) -> bool {
        let is_image_held = self.kind == SignalKind::Real && self.is_in_band(-frequency);
        self.is_in_band(frequency) || is_image_held
    }

    /// Whether a frequency in cycles per sample lies in the band.
    fn is_in_band(&self, frequency: f64) -> bool {
        let (low_hz, high_hz) = self.sampling.band_hz;
        let frequency_hz = (frequency - frequency.round()) * self.sampling.sample_rate_hz;
        (low_hz..=high_hz).contains(&frequency_hz)
    }
}

/// Distance of two frequencies on their circle \[cycles per sample\].
fn cyclic_distance(a: f64, b: f64) -> f64 {
    (a - b - (a - b).round()).abs()
}

/// Squares of the standard deviations \[bins^2\] of the peaks of Gaussian spectra in the middle of a band, and of the spectra.
fn widths(lag_weights: &[f64], padded: usize, bins: usize) -> Result<Vec<(f64, f64)>, Error> {
    let spectrum = LagSpectrum::new(SignalKind::Complex, lag_weights.len(), padded)?;
    let line = peak_variance(&spectrum, lag_weights, bins, 0.0, 0.0)?;
    let line_width = line.sqrt();
    let mut pairs = Vec::<(f64, f64)>::new();
    for k in 0..WIDTHS {
        let width = (k * k) as f64 / 16.0 * line_width;
        // peaks are anywhere between the frequencies
        let quarter = peak_variance(&spectrum, lag_weights, bins, width, 0.125)?;
        let three_quarters = peak_variance(&spectrum, lag_weights, bins, width, 0.375)?;
        let of_peak = 0.5 * (quarter + three_quarters);
        let of_spectrum = width * width;
        if let Some(last) = pairs.last() {
            let shows = of_peak - last.0 > LEAST_SHARE * (of_spectrum - last.1);
            if !shows {
                break;
            }
        }
        pairs.push((of_peak, of_spectrum));
    }
    // where not even a width like that of a line shows, the few below it would be chosen by chance
    if pairs.len() < LEAST_WIDTHS {
        pairs.clear();
    }
    Ok(pairs)
}

/// Variance \[bins^2\] of the peak of a Gaussian spectrum of standard deviation `width` \[bins\], `offset` bins from a frequency of the
/// grid, in the middle of a band of `bins`.
fn peak_variance(
    spectrum: &LagSpectrum,
    lag_weights: &[f64],
    bins: usize,
    width: f64,
    offset: f64,
) -> Result<f64, Error> {
    let padded = spectrum.frequencies();
    let mut lags = Vec::with_capacity(2 * lag_weights.len());
    for (m, weight) in lag_weights.iter().enumerate() {
        let turn = std::f64::consts::TAU * m as f64 / padded as f64;
        let size = weight * (-0.5 * (turn * width).powi(2)).exp();
        let lag = Complex::from_polar(size, turn * offset);
        lags.push(lag.re);
        lags.push(lag.im);
    }
    let mut scratch = Scratch::new();
    let line = spectrum.density(&lags, &mut scratch)?;
    let mut density = Vec::with_capacity(bins);
    for bin in 0..bins {
        density.push(line[(bin + padded - bins / 2) % padded]);
    }
    let (_, deviation) = floor_and_width(&density, bins / 2, line[0]);
    Ok(deviation.powi(2))
}

/// Mean density beside the main peak, and standard deviation of that \[bins\].
fn floor_and_width(density: &[f64], top: usize, peak: f64) -> (f64, f64) {
    let lowest = LazyCell::new(|| lowest(density));
    let mut floor = 0.0;
    let mut beside = 0;
    let mut reach = [0.0; 2];
    // the half height needs the floor and the floor the half height: one repetition settles it
    for _ in 0..2 {
        reach = half_widths(density, top, floor + 0.5 * (peak - floor));
        (floor, beside) = mean_beside(density, top, reach).unwrap_or_else(|| (*lowest, 0));
    }
    // The few densities beside a peak that nearly fills the band are noisy: where they are low by
    // chance the peak is too broad, and where they are high it is not measured at all.
    let full_width = reach[0] + reach[1];
    let is_floor_known = beside as f64 >= LEAST_BESIDE * full_width || *lowest < BARE * peak;
    let width = if is_floor_known {
        full_width / FULL_WIDTH
    } else {
        f64::NAN
    };
    (floor, width)
}

/// Distances \[bins\] from `top` to where the density falls to `level` on either side; to the end of the band if it does not.
fn half_widths(density: &[f64], top: usize, level: f64) -> [f64; 2] {
    let mut down = top as f64;
    if let Some(k) = density[..top].iter().rposition(|value| *value < level) {
        let above = density[k + 1];
        down = (top - k - 1) as f64 + (above - level) / (above - density[k]);
    }
    let mut up = (density.len() - 1 - top) as f64;
    if let Some(k) = density[top + 1..].iter().position(|value| *value < level) {
        let above = density[top + k];
        up = k as f64 + (above - level) / (above - density[top + 1 + k]);
    }
    [down, up]
}

/// Mean density away from the peak and from the edges, over which noise of a band leaks out of it,
/// and the number of bins there; none if the peak fills the band.
fn mean_beside(density: &[f64], top: usize, reach: [f64; 2]) -> Option<(f64, usize)> {
    let edge = 0.5 * (reach[0] + reach[1]);
    let first = edge as usize;
    let last = density.len().saturating_sub(first);
    let low = ((top as f64 - (LOBE * reach[0]).ceil()).max(0.0) as usize).max(first);
    let high = ((top as f64 + (LOBE * reach[1]).ceil()) as usize + 1).min(last);
    let count = low - first + last - high;
    (count > 0).then(|| {
        let sum = lanes_sum(&density[first..low]) + lanes_sum(&density[high..last]);
        (sum / count as f64, count)
    })
}

/// Fractional bin of the peak next to bin `top`, by parabola; `density` begins one bin early.
fn parabola(density: &[f64], top: usize) -> f64 {
    let floor = density[top + 1] * 1e-30;
    let [left, middle, right] = [0, 1, 2].map(|k| density[top + k].max(floor).ln());
    let curvature = left - 2.0 * middle + right;
    if curvature < 0.0 {
        top as f64 + (0.5 * (left - right) / curvature).clamp(-0.5, 0.5)
    } else {
        top as f64
    }
}

/// Folds numbers in independent lanes, so that successive steps do not depend on each other.
fn lanes(values: &[f64], start: f64, fold: impl Fn(f64, f64) -> f64) -> f64 {
    let (chunks, rest) = values.as_chunks::<8>();
    let mut lanes = [start; 8];
    for chunk in chunks {
        for (lane, value) in lanes.iter_mut().zip(chunk) {
            *lane = fold(*lane, *value);
        }
    }
    lanes.iter().chain(rest).copied().fold(start, fold)
}

/// The sum of numbers.
pub(crate) fn lanes_sum(values: &[f64]) -> f64 {
    lanes(values, 0.0, |sum, value| sum + value)
}

/// The lowest number; infinite without numbers.
fn lowest(values: &[f64]) -> f64 {
    lanes(
        values,
        f64::INFINITY,
        |low, value| {
            if value < low { value } else { low }
        },
    )
}

/// Index and value of the first highest number; (0, -inf) without numbers.
pub(crate) fn highest(values: &[f64]) -> (usize, f64) {
    let highest = lanes(values, f64::NEG_INFINITY, |highest, value| {
        if value > highest { value } else { highest }
    });
    let index = values.iter().position(|value| *value == highest);
    (index.unwrap_or(0), highest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_as_wide_as_its_weights_make_it() {
        let own = |lags: &[f64]| widths(lags, 4096, 1024).unwrap()[0].0.sqrt() / 4096.0;
        // half the maximum of the spectrum of n equal weights is 0.443 / n from its centre
        let triangle: Vec<f64> = (0..64).map(|m| 1.0 - f64::from(m) / 64.0).collect();
        assert!(
            (own(&triangle) * 64.0 - 0.886 / FULL_WIDTH).abs() < 2e-3,
            "{}",
            own(&triangle)
        );
        // exp(-m^2 / (2 s^2)) has a spectrum of standard deviation 1 / (2 pi s)
        let gaussian: Vec<f64> = (0..64)
            .map(|m| (-0.5 * f64::from(m * m) / 100.0).exp())
            .collect();
        assert!((own(&gaussian) * 20.0 * std::f64::consts::PI - 1.0).abs() < 2e-3);
    }

    #[test]
    fn floor_and_width_are_those_of_a_gaussian_beside_another_one() {
        let gaussian =
            |k: f64, centre: f64, width: f64| (-0.5 * ((k - centre) / width).powi(2)).exp();
        let density: Vec<f64> = (0..200)
            .map(f64::from)
            .map(|k| 0.1 + gaussian(k, 60.3, 6.0) + 0.5 * gaussian(k, 120.0, 4.0))
            .collect();
        let (_, width) = floor_and_width(&density, 60, density[60]);
        assert!((width - 6.0).abs() < 0.3, "{width}");
        let alone: Vec<f64> = (0..200)
            .map(f64::from)
            .map(|k| 0.1 + gaussian(k, 60.3, 6.0))
            .collect();
        let (floor, width) = floor_and_width(&alone, 60, alone[60]);
        assert!(
            (floor - 0.1).abs() < 1e-3 && (width - 6.0).abs() < 0.05,
            "{floor} {width}"
        );
        // a flat band: everything is the main peak, and nothing is above the floor
        assert_eq!(floor_and_width(&[1.0; 50], 0, 1.0).0, 1.0);
        assert_eq!(floor_and_width(&[1.0], 0, 1.0).0, 1.0);
    }
}
