//! Noise of the analogue-to-digital converter, relative to the noise at its input.
//!
//! Check: the stored tables of rounding and of clipping; exact sums over the codes of another program; samples that were
//! rounded and clipped.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Codes further from zero than this, in standard deviations of the input, are never reached.
const REACH: f64 = 9.0;
/// Most codes that are summed; the closed forms of finer steps are exact to 1e-7.
const MOST_CODES: f64 = 4096.0;
/// Step below which the error of rounding has the variance `step^2/12` to the rounding of numbers: the terms left out have the
/// factor `exp(-2 pi^2/step^2)`.
const FINE_STEP: f64 = 0.5;
/// Largest step in standard deviations: with greater ones nothing leaves code 0, and the square of the gain is no normal number.
const LARGEST_STEP: f64 = 50.0;
/// Fraction of clipped samples below which no run has one.
const FEWEST_CLIPPED: f64 = 1e-12;

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
    /// Density of the rounding over that of the noise, `(k^2/(3 4^bits)) 2 B/F_s` for steps below
    /// half a standard deviation of the input; more for coarser ones.
    pub fn rounding(&self) -> f64 {
        let step = self.step_over_sd();
        let noise = if step < FINE_STEP {
            step * step / 12.0
        } else {
            let reach = codes_in_reach(step);
            Clipping::of_codes(step, reach, reach).noise()
        };
        noise * self.spread()
    }

    /// Effect of clipping and rounding on the samples.
    pub fn clipping(&self) -> Clipping {
        let step = self.step_over_sd();
        let half = 0.5 * f64::from(self.bits).exp2();
        let reach = codes_in_reach(step);
        let low_codes = half.min(reach);
        let high_codes = (half - 1.0).min(reach);
        let whole = if low_codes + high_codes < MOST_CODES {
            Clipping::of_codes(step, low_codes, high_codes)
        } else {
            Clipping::of_fine_steps(step, half * step, (half - 1.0) * step)
        };
        Clipping {
            clipped_fraction: upper_tail((half + 0.5) * step) + upper_tail((half - 0.5) * step),
            ..whole
        }
    }

    /// What clipping adds to [`Converter::rounding`]. The distortion spreads, as rounding does,
    /// evenly from zero to half the sampling rate, which is exact for white noise; the mean of the
    /// samples, of codes that are not symmetric, is a line at frequency zero and no noise.
    pub fn clipping_noise(&self) -> f64 {
        let clipping = self.clipping();
        if clipping.clipped_fraction < FEWEST_CLIPPED {
            return 0.0;
        }
        (clipping.noise() * self.spread() - self.rounding()).max(0.0)
    }

    /// Step from one code to the next over the standard deviation of the input.
    fn step_over_sd(&self) -> f64 {
        let codes = f64::from(self.bits).exp2();
        let step = 2.0 * self.full_scale_over_noise / (codes * self.input_over_noise);
        step.min(LARGEST_STEP)
    }

    /// Density of a variance of the samples over that of the noise in the band, for one of the
    /// input's.
    fn spread(&self) -> f64 {
        self.input_over_noise.powi(2) * 2.0 * self.bandwidth_hz / self.sample_rate_hz
    }
}

/// Gaussian noise that a converter clips and rounds, in units of its variance (Bussgang: a scaled
/// copy and a distortion that is uncorrelated with it).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clipping {
    /// Part of the samples that are clipped: `erfc(k/sqrt 2)` at `k` standard deviations on both
    /// sides.
    pub clipped_fraction: f64,
    /// Factor on weak signals and on the copy of the noise: `erf(k/sqrt 2)` for fine steps.
    pub gain: f64,
    /// Variance of the clipped and rounded noise about its mean.
    pub variance: f64,
    /// Variance of the distortion, `variance - gain^2`.
    pub distortion: f64,
}

impl Clipping {
    /// Clipping at `clip_over_sd` standard deviations, without rounding.
    pub fn at(clip_over_sd: f64) -> Self {
        Self::between(clip_over_sd, clip_over_sd)
    }

    /// Clipping below `-low` and above `high`, without rounding.
    fn between(low: f64, high: f64) -> Self {
        let clipped_fraction = upper_tail(low) + upper_tail(high);
        let gain = probability(-low, high);
        let mean = mean_beyond(low) - mean_beyond(high);
        // Of what is cut off, without the differences between numbers near 1, which would leave a
        // negative distortion.
        let error = square_beyond(low) + square_beyond(high) - mean * mean;
        let distortion = (error - clipped_fraction * clipped_fraction).max(0.0);
        Self {
            clipped_fraction,
            gain,
            variance: gain * gain + distortion,
            distortion,
        }
    }

    /// The same with steps so fine that the error of rounding has the variance `step^2/12` between
    /// the lowest and the highest code.
    fn of_fine_steps(step: f64, low: f64, high: f64) -> Self {
        let clipped = Self::between(low, high);
        let rounding = step * step / 12.0 * probability(-low, high);
        Self {
            variance: clipped.variance + rounding,
            distortion: clipped.distortion + rounding,
            ..clipped
        }
    }

    /// Codes from `-low_codes` to `high_codes`, each the nearest one to the inputs that it stands
    /// for; the two outermost stand for all beyond them, none of which counts as clipped here.
    fn of_codes(step: f64, low_codes: f64, high_codes: f64) -> Self {
        let mut mean = 0.0;
        let mut square = 0.0;
        let mut gain = 0.0;
        let mut below = f64::NEG_INFINITY;
        for index in 0..=(low_codes + high_codes) as u32 {
            let code = f64::from(index) - low_codes;
            let above = if code < high_codes {
                (code + 0.5) * step
            } else {
                f64::INFINITY
            };
            let value = code * step;
            let share = probability(below, above);
            mean += share * value;
            square += share * value * value;
            // Stein: the mean of input times output is that of the output's slope.
            gain += step * density(above);
            below = above;
        }
        let variance = square - mean * mean;
        Self {
            clipped_fraction: 0.0,
            gain,
            variance,
            distortion: (variance - gain * gain).max(0.0),
        }
    }

    /// Variance of the distortion over that of the copy of the noise.
    fn noise(&self) -> f64 {
        self.distortion / (self.gain * self.gain)
    }
}

/// Number of codes of either sign that noise reaches.
fn codes_in_reach(step: f64) -> f64 {
    (REACH / step).ceil()
}

/// Density of the normal distribution.
fn density(x: f64) -> f64 {
    (-0.5 * x * x).exp() / (2.0 * PI).sqrt()
}

/// Probability that a normal number is above `x`.
fn upper_tail(x: f64) -> f64 {
    0.5 * libm::erfc(x * FRAC_1_SQRT_2)
}

/// Probability that a normal number is between two others, from the smaller tails.
fn probability(below: f64, above: f64) -> f64 {
    if below >= 0.0 {
        upper_tail(below) - upper_tail(above)
    } else {
        upper_tail(-above) - upper_tail(-below)
    }
}

/// Mean of what a normal number has beyond `x`, 0 where it has nothing.
fn mean_beyond(x: f64) -> f64 {
    density(x) - x * upper_tail(x)
}

/// Mean square of the same.
fn square_beyond(x: f64) -> f64 {
    (1.0 + x * x) * upper_tail(x) - x * density(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// A converter of white noise, with the full scale in its standard deviations.
    fn converter(bits: u32, full_scale_over_sd: f64) -> Converter {
        Converter {
            bits,
            full_scale_over_noise: full_scale_over_sd,
            bandwidth_hz: 125e6,
            sample_rate_hz: 250e6,
            input_over_noise: 1.0,
        }
    }

    /// Bits, full scale, clipped fraction, gain, variance and distortion: sums over all codes in Python with scipy.
    const CODES: [(u32, f64, [f64; 4]); 11] = [
        (
            1,
            1.0,
            [
                0.375344739995,
                0.352065326764,
                0.213342125923,
                0.089392131613,
            ],
        ),
        (
            2,
            2.0,
            [
                0.073016866595,
                0.833648249194,
                0.813033479117,
                0.118064075732,
            ],
        ),
        (
            2,
            8.0,
            [
                9.8658764504e-10,
                0.431927756409,
                0.728004269698,
                0.541442682941,
            ],
        ),
        (
            3,
            1.0,
            [
                0.321081469989,
                0.615940624277,
                0.436404328086,
                0.057021475451,
            ],
        ),
        (
            3,
            2.0,
            [
                0.052283629519,
                0.913593293760,
                0.874414640390,
                0.039761933987,
            ],
        ),
        (
            3,
            8.0,
            [
                1.2798126567e-12,
                0.985616238621,
                1.301651050309,
                0.330211680477,
            ],
        ),
        (
            4,
            2.0,
            [
                0.047189668214,
                0.937864532511,
                0.898078720836,
                0.018488839495,
            ],
        ),
        (
            5,
            1.5,
            [
                0.134041220742,
                0.853515461778,
                0.759422126909,
                0.030933483414,
            ],
        ),
        (
            8,
            3.0,
            [
                0.002701622054,
                0.997193231760,
                0.994857654838,
                4.6331336974e-04,
            ],
        ),
        (
            13,
            1.0,
            [
                0.317310511469,
                0.682630411244,
                0.515981081905,
                0.049996803550,
            ],
        ),
        (
            16,
            1.5,
            [
                0.133614402639,
                0.866379668448,
                0.778456041544,
                0.027842311645,
            ],
        ),
    ];

    #[test]
    fn the_noise_is_that_of_the_codes() {
        for (bits, full_scale, expected) in CODES {
            let all = converter(bits, full_scale);
            let found = all.clipping();
            let values = [
                found.clipped_fraction,
                found.gain,
                found.variance,
                found.distortion,
            ];
            for (found, expected) in values.into_iter().zip(expected) {
                assert_relative_eq!(found, expected, max_relative = 1e-6);
            }
            let noise = expected[3] / expected[1].powi(2);
            let counted = all.rounding() + all.clipping_noise();
            assert_relative_eq!(counted, noise, max_relative = 1e-6);
        }
    }

    #[test]
    fn rounding_of_coarse_steps_is_more_than_that_of_fine_ones() {
        // Steps of 0.49, 0.51, 2 and 4 standard deviations; sums over the codes in Python.
        for (step, expected) in [
            (0.49, 0.020_008_333_333),
            (0.51, 0.021_675),
            (2.0, 0.339_920_010_161),
            (4.0, 2.902_219_357_075),
        ] {
            let wide = converter(8, 128.0 * step);
            assert_relative_eq!(wide.rounding(), expected, max_relative = 1e-9);
            assert_eq!(wide.clipping_noise(), 0.0);
        }
    }

    #[test]
    fn numbers_stay_finite_for_every_converter() {
        for bits in [1, 2, 8, 12, 13, 32] {
            for full_scale in [1e-6, 1e-3, 1.0, 8.0, 1e3, 1e12] {
                let all = converter(bits, full_scale);
                let clipping = all.clipping();
                let gain = clipping.gain;
                assert!(gain > 0.0 && gain < 2.0, "{bits} {full_scale}: {gain}");
                let noise = 1.0 + all.rounding() + all.clipping_noise();
                assert!(noise.is_finite() && noise >= 1.0, "{bits} {full_scale}");
                // What is left of the noise is not more than the converter can show.
                let largest = full_scale.powi(2).max(1.0);
                let left = noise * gain * gain;
                assert!(left < 1.5 * largest, "{bits} {full_scale}: {left}");
            }
        }
    }
}
