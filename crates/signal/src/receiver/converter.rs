//! Noise of the analogue-to-digital converter, relative to the noise at its input.
//!
//! Check: the stored tables of rounding and of clipping; samples that were rounded and clipped.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// A converter of `bits` and a full scale of `full_scale_over_noise` times the root mean square of
/// the noise in the band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Converter {
    /// Bits of a sample.
    pub bits: u32,
    /// Full scale over the noise in the band, `k`.
    pub full_scale_over_noise: f64,
    /// Noise bandwidth `B` \[Hz\].
    pub bandwidth_hz: f64,
    /// Sampling rate `F_s` \[Hz\].
    pub sample_rate_hz: f64,
    /// Root mean square of the input of the converter over that of the noise in the band: 1 for a
    /// band-limited current, `1/sqrt 2` for each of its two quadratures, `sqrt(F_s/2B)` for either
    /// with white noise.
    pub input_over_noise: f64,
}

impl Converter {
    /// Density of the rounding over that of the noise, `(k^2/(3 4^bits)) 2 B/F_s`.
    pub fn rounding(&self) -> f64 {
        let steps = f64::from(self.bits).exp2();
        (self.full_scale_over_noise / steps).powi(2) / 3.0
            * (2.0 * self.bandwidth_hz / self.sample_rate_hz)
    }

    /// Effect of clipping on the samples.
    pub fn clipping(&self) -> Clipping {
        Clipping::at(self.full_scale_over_noise / self.input_over_noise)
    }

    /// What clipping adds to [`Converter::rounding`]. The distortion spreads, as rounding does,
    /// evenly from zero to half the sampling rate, which is exact for white noise.
    pub fn clipping_noise(&self) -> f64 {
        let spread = self.input_over_noise.powi(2) * 2.0 * self.bandwidth_hz / self.sample_rate_hz;
        let Clipping {
            gain, distortion, ..
        } = self.clipping();
        let rounding = self.rounding();
        (rounding * (1.0 - gain * gain) + distortion * spread) / (gain * gain)
    }
}

/// Gaussian noise clipped at some standard deviations, in units of its variance (Bussgang: a scaled
/// copy and a distortion that is uncorrelated with it).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clipping {
    /// Part of the samples that are clipped, `erfc(k/sqrt 2)`.
    pub clipped_fraction: f64,
    /// Factor on weak signals and on the copy of the noise, `erf(k/sqrt 2)`.
    pub gain: f64,
    /// Variance of the clipped noise.
    pub variance: f64,
    /// Variance of the distortion, `variance - gain^2`.
    pub distortion: f64,
}

impl Clipping {
    /// Clipping at `clip_over_sd` standard deviations.
    pub fn at(clip_over_sd: f64) -> Self {
        let k = clip_over_sd;
        let clipped_fraction = libm::erfc(k * FRAC_1_SQRT_2);
        let gain = libm::erf(k * FRAC_1_SQRT_2);
        let density = (-0.5 * k * k).exp() / (2.0 * PI).sqrt();
        // Without the rounding of differences between numbers near 1, which would leave a
        // negative distortion.
        let missing = (k * k - 1.0) * clipped_fraction - 2.0 * k * density;
        let distortion =
            (missing + 2.0 * clipped_fraction - clipped_fraction * clipped_fraction).max(0.0);
        Self {
            clipped_fraction,
            gain,
            variance: 1.0 + missing,
            distortion,
        }
    }
}
