//! How high the peak of pure noise stands: the threshold that tells a signal from noise.
//!
//! The density of a spectrum at one frequency is a quadratic form x^H A x of the samples, over a region the sum of those of its
//! windows. With C the covariance of the noise and tr CA = 1 in the middle of the band, it is in noise nearly y + theta G, G a gamma variable of
//! shape a: mean and variance are those of the form, and the tail falls as that of its largest eigenvalues,
//!
//! ```text
//! theta = tr (CA)^4 / tr (CA)^3, a = tr (CA)^2 / theta^2, y = 1 - theta a
//! ```
//!
//! Between the frequencies it is a smooth process; the rate at which it crosses a level upwards follows from its gradient (Rice 1945). An
//! excursion above a high level has one peak; those with their peak beyond an edge of the band, where it is flagged, are as many as
//! those that begin beyond the edge with their peak within. So with t the level over the density of the noise, g = (t - y) / theta, c its
//! change with the frequency, p the law of G, s^2 = 2 g w^2 the variance of its gradient and F_s the unit of frequency,
//!
//! ```text
//! P(t) = 1 - exp(- integral over the band of p(g) [s / sqrt(2 pi) exp(-c^2 / (2 s^2)) + |c| / 2 erf(|c| / (sqrt(2) s))])
//! w^2 = tr (C A')^2 / (2 tr (C A)^2), A'_nm = 2 pi i (n - m) A_nm
//! ```
//!
//! Near the edges of a band mean m and deviation d of the density of band-limited noise are smaller than in its middle, and t is
//! 1 + (t - m) / d there. A grid of frequencies 1 / M apart misses part of the peaks, which fall like t - (t - 1) w^2 f^2 beside their tops:
//! the first term gets the factor sqrt(pi) / 2 erf(u) / u, u^2 = (t - 1) (1 - (a - 1) / g) / theta (w / (2 M))^2.
//!
//! The density of the noise must be known, as an instrument knows it from its detector without light: that of the mean
//! statistic of noise ([`Noise::expected_correlogram`]). Check: one exponential; the rate of false alarms of spectra with one taper,
//! several, and lag windows, in white and in band-limited noise, for single windows and whole regions (in the tests of the
//! estimators).

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use ndarray::Array2;
use num_complex::Complex;
use statrs::function::erf::erf;
use statrs::function::gamma::ln_gamma;

use crate::bound::Noise;
use crate::error::{Error, length, not_empty, positive, probability};
use crate::estimators::tails::{bisected, gamma_tail};
use crate::map::{PolarPoint, ScanGeometry};
use crate::spectrum::Taper;
use crate::spectrum::lag_spectrum::Band;
use crate::window::{Gates, Sampling, SignalKind};

type C64 = Complex<f64>;

/// Most samples that describe the lags of a window; longer windows are thinned to every Nth sample.
const SAMPLES: usize = 40;

/// Number of parts of half the band; within each the density of the noise is taken as constant.
const PARTS: usize = 12;

/// The test of a spectrum against noise: mean, deviation and gradient of the density of noise.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseTest {
    /// Variance of the mean over the band of the density of one window.
    band_variance: f64,
    /// Width of the band in cycles per sample.
    band_width: f64,
    /// Width of the part of the band whose peaks are not flagged, in cycles per sample.
    unflagged_width: f64,
    /// Number of frequencies over 0 .. F_s at which the density is computed.
    padded: f64,
    /// For increasing numbers of windows in a row the traces of the powers 2, 3 and 4 of CA, and half of that of (CA')^2.
    moments: Vec<(usize, [f64; 4])>,
    /// Mean and deviation of the density in the parts of half the band from its middle on, over those in the middle.
    profile: Vec<(f64, f64)>,
}

/// Distribution of the density of noise in a region, relative to its mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RegionNoise {
    /// Effective number of independent windows; 0 without windows.
    pub n_eff: f64,
    /// Shape a of the gamma variable.
    shape: f64,
    /// Scale theta of the gamma variable.
    scale: f64,
    /// w in radians per cycle per sample.
    gradient: f64,
}

impl RegionNoise {
    /// Regions of the same key have thresholds within a thousandth of each other.
    #[must_use]
    pub fn key(&self) -> [i64; 3] {
        [self.shape, self.scale, self.gradient].map(|value| (1e3 * value.ln()).round() as i64)
    }
}

impl NoiseTest {
    /// Plans the test for the spectrum of a correlogram of `tapers`, times `lag_weights` from lag 0 on (none: all lags unweighted),
    /// whose peak is searched among `padded_samples` frequencies over 0 .. F_s, in `noise`.
    ///
    /// # Errors
    /// [`Error::Empty`] without tapers or with no weight, [`Error::Length`] for tapers of different lengths, [`Error::OutOfRange`] for impossible
    /// gates and for tapers or weights without power, [`Error::Band`] for an impossible band.
    pub fn new(
        sampling: &Sampling,
        gates: &Gates,
        tapers: &[Taper],
        lag_weights: Option<&[f64]>,
        padded_samples: usize,
        noise: Noise,
    ) -> Result<Self, Error> {
        let tapers: Vec<Vec<C64>> = tapers.iter().map(scaled_weights).collect();
        let samples = tapers.first().map_or(0, Vec::len);
        gates.validate()?;
        not_empty("tapers", samples)?;
        for taper in &tapers {
            length("tapers", samples, taper.len())?;
        }
        not_empty("lag_weights", lag_weights.map_or(samples, <[f64]>::len))?;
        let bins = Band::new(sampling, SignalKind::Complex, padded_samples)?;
        let padded = padded_samples as f64;
        let band_width = (sampling.band_hz.1 - sampling.band_hz.0) / sampling.sample_rate_hz;
        let unflagged_width = if bins.cyclic {
            1.0
        } else {
            bins.bins.saturating_sub(2) as f64 / padded
        };
        let form = Form::new(sampling, &tapers, lag_weights, noise)?;
        let (mean, deviation) = form.density_moments(0.0);
        positive("power of the weights of the lags", deviation)?;
        let mut profile = Vec::with_capacity(PARTS);
        for part in 0..PARTS {
            let offset = 0.5 * band_width * (part as f64 + 0.5) / PARTS as f64;
            let (part_mean, part_deviation) = form.density_moments(offset);
            profile.push((part_mean / mean, part_deviation / deviation));
        }
        // The noise of two windows is independent where they are so far apart that even band-limited noise is uncorrelated:
        // sinc(20)^2 is below 3e-4. Beyond that a wider step changes nothing but the size of the covariance.
        let correlation_samples = (20.0 / band_width).min(8.0 * samples as f64) as usize;
        let step = gates
            .step_samples
            .min(samples + correlation_samples.max(samples));
        let mut moments = Vec::new();
        for row_gates in row_lengths(2 * samples / gates.step_samples + 2) {
            moments.push((row_gates, form.moments(row_gates, step, mean)));
        }
        Ok(Self {
            band_variance: form.band_variance(band_width),
            band_width,
            unflagged_width,
            padded,
            moments,
            profile,
        })
    }

    /// Distribution of noise in a region: for each chord its number of windows in a row and of pulses.
    #[must_use]
    pub fn region(&self, chords: impl Iterator<Item = (usize, usize)>) -> RegionNoise {
        let mut level = 0.0;
        let mut sums = [0.0; 4];
        for (gates, pulses) in chords {
            level += (pulses * gates) as f64;
            for (sum, moment) in sums.iter_mut().zip(self.row(gates)) {
                *sum += pulses as f64 * moment;
            }
        }
        if level == 0.0 {
            return RegionNoise {
                n_eff: 0.0,
                shape: f64::NAN,
                scale: f64::NAN,
                gradient: f64::NAN,
            };
        }
        let [second, third, fourth, gradient] = sums;
        let scale = fourth / (third * level);
        let variance = second / (level * level);
        RegionNoise {
            n_eff: self.moments[0].1[0] / variance,
            shape: variance / (scale * scale),
            scale,
            gradient: (gradient / second).sqrt(),
        }
    }

    /// Distribution of noise in the region of radius `radius_m` about a point of a scan, all of whose samples are valid.
    #[must_use]
    pub fn region_at(
        &self,
        places: &ScanGeometry,
        point: PolarPoint,
        radius_m: f64,
    ) -> RegionNoise {
        self.region(
            places
                .chords(point, radius_m)
                .map(|(line, gates)| (gates.len(), places.rays.count(line))),
        )
    }

    /// The moments of `gates` windows in a row, interpolated as powers of their number at first, linearly once rows are longer than a
    /// window.
    fn row(&self, gates: usize) -> [f64; 4] {
        let above = self
            .moments
            .partition_point(|(at, _)| *at < gates)
            .clamp(1, self.moments.len() - 1);
        let (low_gates, a) = &self.moments[above - 1];
        let (high_gates, b) = &self.moments[above];
        let low = *low_gates as f64;
        let high = *high_gates as f64;
        let at = gates as f64;
        std::array::from_fn(|k| {
            if at > high {
                a[k] + (b[k] - a[k]) * (at - low) / (high - low)
            } else {
                a[k] * (b[k] / a[k]).powf((at / low).ln() / (high / low).ln())
            }
        })
    }

    /// Standard deviation of the mean density of noise in the band, over its mean.
    #[must_use]
    pub fn band_deviation(&self, n_eff: f64) -> f64 {
        (self.band_variance / n_eff).sqrt()
    }

    /// Probability that noise alone has a peak of more than `level` times its density in a region, within the band and not at its edge.
    #[must_use]
    pub fn false_alarm(&self, region: &RegionNoise, level: f64) -> f64 {
        let RegionNoise {
            shape,
            scale,
            gradient,
            ..
        } = *region;
        let mut excesses = [0.0; PARTS];
        let mut sums = [0.0; PARTS];
        for (part, (mean, deviation)) in self.profile.iter().enumerate() {
            excesses[part] = 1.0 + (level - mean) / deviation - 1.0;
            sums[part] = (excesses[part] + scale * shape) / scale;
        }
        // below the mean it is always above
        if level <= 1.0 || sums.iter().any(|sum| *sum <= 0.0) {
            return 1.0;
        }
        let mut rates = 0.0;
        for part in 0..PARTS {
            let sum = sums[part];
            let before = part.saturating_sub(1);
            let after = (part + 1).min(PARTS - 1);
            let slope = (sums[after] - sums[before]).abs()
                / ((after - before) as f64 * 0.5 * self.band_width / PARTS as f64);
            let spread = (2.0 * sum).sqrt() * gradient;
            let steepness = (1.0 - (shape - 1.0) / sum).max(0.0) / scale;
            let half_step =
                (0.5 * gradient / self.padded * (excesses[part] * steepness).sqrt()).max(1e-3);
            let found_fraction = 0.5 * PI.sqrt() * erf(half_step) / half_step;
            let level_off =
                found_fraction * spread / TAU.sqrt() * (-0.5 * (slope / spread).powi(2)).exp();
            let across = 0.5 * slope * erf(FRAC_1_SQRT_2 * slope / spread);
            let crossings =
                ((shape - 1.0) * sum.ln() - sum - ln_gamma(shape)).exp() * (level_off + across);
            // the rate is at most that of independent frequencies
            rates += crossings.min(-self.padded * (-gamma_tail(shape, sum)).ln_1p());
        }
        1.0 - (-self.unflagged_width * rates / PARTS as f64).exp()
    }

    /// Peak over the density of the noise that noise alone exceeds in a region with probability `rate`; NaN without windows.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless `rate` is between 0 and 1.
    pub fn threshold(&self, region: &RegionNoise, rate: f64) -> Result<f64, Error> {
        probability("false_alarm", rate)?;
        let mut low = 0.0;
        let mut high = 2.0;
        while self.false_alarm(region, high) > rate && high < f64::MAX {
            low = high;
            high *= 2.0;
        }
        let [low, high] = bisected(low, high, 60, |level| {
            self.false_alarm(region, level) > rate
        });
        Ok(if region.n_eff > 0.0 {
            0.5 * (low + high)
        } else {
            f64::NAN
        })
    }
}

/// The quadratic form A of one window, thinned to every Nth sample, and the noise that it is applied to.
struct Form<'a> {
    matrix: Array2<C64>,
    /// Stride of the samples that represent all.
    every: usize,
    /// Length of the window over that of the shorter window with similar tapers that represents it where only short lags count; the
    /// density of the shorter window has a variance larger by this factor.
    shorter: usize,
    sampling: &'a Sampling,
    noise: Noise,
}

impl<'a> Form<'a> {
    /// The form of tapers of one length that is not 0.
    fn new(
        sampling: &'a Sampling,
        tapers: &[Vec<C64>],
        lag_weights: Option<&[f64]>,
        noise: Noise,
    ) -> Result<Self, Error> {
        let samples = tapers[0].len();
        let lags = lag_weights.map_or(samples, |weights| weights.len().min(samples));
        let every = lags.div_ceil(SAMPLES);
        let shorter = (samples / (every * SAMPLES.max(8 * lags / every))).max(1);
        let size = samples.div_ceil(every * shorter);
        let matrix = Array2::from_shape_fn((size, size), |(i, j)| {
            let lag = i.abs_diff(j) * every;
            let weight = if lag < lags {
                lag_weights.map_or(1.0, |weights| weights[lag])
            } else {
                0.0
            };
            let mut products = C64::ZERO;
            for h in tapers {
                products += h[i * every * shorter] * h[j * every * shorter].conj();
            }
            products * weight
        });
        positive(
            "power of the tapers",
            matrix.diag().iter().map(|q| q.re).sum(),
        )?;
        Ok(Self {
            matrix,
            every,
            shorter,
            sampling,
            noise,
        })
    }

    /// Variance of the mean over the band, `band_width` cycles per sample wide, of the density of one window in white noise.
    fn band_variance(&self, band_width: f64) -> f64 {
        let mut sum = 0.0;
        for ((i, j), q) in self.matrix.indexed_iter() {
            let turn = PI * band_width * (i.abs_diff(j) * self.every) as f64;
            let mean_square = if i == j {
                1.0
            } else {
                (turn.sin() / turn).powi(2)
            };
            sum += q.norm_sqr() * mean_square;
        }
        let power: f64 = self.matrix.diag().iter().map(|q| q.re).sum();
        sum / (power * power * self.shorter as f64)
    }

    /// Covariance C of the noise at `size` samples, `offset` cycles per sample from the middle of the band.
    fn covariance(&self, size: usize, offset: f64) -> Array2<C64> {
        let Self {
            every,
            sampling,
            noise,
            ..
        } = *self;
        let (low_hz, high_hz) = sampling.band_hz;
        let band = (high_hz - low_hz) / sampling.sample_rate_hz;
        let middle = 0.5 * (low_hz + high_hz) / sampling.sample_rate_hz;
        let white = match noise {
            Noise::Band { floor } if band * (every as f64) < 1.0 => floor,
            _ => 1.0,
        };
        let mut lags: Vec<C64> = Vec::with_capacity(size);
        for index in 0..size {
            let own = if index == 0 { white } else { 0.0 };
            if white >= 1.0 {
                lags.push(Complex::from(own));
                continue;
            }
            let lag = (index * every) as f64;
            let within = noise.covariance(sampling, lag, SignalKind::Complex) - own;
            let carrier = Complex::from_polar(1.0, -TAU * (middle + offset) * lag);
            lags.push(within * every as f64 * carrier + own);
        }
        Array2::from_shape_fn((size, size), |(i, j)| {
            if i >= j {
                lags[i - j]
            } else {
                lags[j - i].conj()
            }
        })
    }

    /// Mean tr CA and standard deviation of the density of one window, `offset` cycles per sample from the middle of the band.
    fn density_moments(&self, offset: f64) -> (f64, f64) {
        let product = self
            .covariance(self.matrix.nrows(), offset)
            .dot(&self.matrix);
        (
            product.diag().iter().map(|q| q.re).sum(),
            trace(&product, &product).sqrt(),
        )
    }

    /// The traces of [`NoiseTest`] for `gates` windows in a row, `step` samples apart, each with the mean density `mean`.
    fn moments(&self, gates: usize, step: usize, mean: f64) -> [f64; 4] {
        let size = self.matrix.nrows();
        let every = self.every;
        let stride = (every * self.shorter) as f64;
        let last = (((gates - 1) * step) as f64 / stride).round() as usize;
        let length = size + last;
        let mut sum = Array2::<C64>::zeros((length, length));
        for gate in 0..gates {
            let start = ((gate * step) as f64 / stride).round() as usize;
            let end = start + size;
            let mut part = sum.slice_mut(ndarray::s![start..end, start..end]);
            part += &self.matrix;
        }
        let turned = Array2::from_shape_fn((length, length), |(i, j)| {
            sum[[i, j]] * Complex::new(0.0, TAU * every as f64 * (i as f64 - j as f64))
        });
        let covariance = self.covariance(length, 0.0);
        let once = covariance.dot(&sum);
        let turned = covariance.dot(&turned);
        let twice = once.dot(&once);
        let unit = mean.recip();
        let less = self.shorter as f64;
        let second = unit * unit / less;
        let third = (unit / less).powi(2) * unit;
        [
            trace(&once, &once) * second,
            trace(&twice, &once) * third,
            trace(&twice, &twice) * third * unit / less,
            0.5 * trace(&turned, &turned) * second,
        ]
    }
}

/// Trace of the product of two matrices, which is real here.
fn trace(a: &Array2<C64>, b: &Array2<C64>) -> f64 {
    a.iter().zip(b.t()).map(|(a, b)| (a * b).re).sum()
}

/// The weights of a taper times the root of its factor.
fn scaled_weights(taper: &Taper) -> Vec<C64> {
    let root = taper.factor.abs().sqrt();
    taper
        .weights
        .iter()
        .map(|h| Complex::from(h * root))
        .collect()
}

/// Numbers of windows in a row up to `most`, each about a third larger than the one before.
fn row_lengths(most: usize) -> Vec<usize> {
    let mut lengths = vec![1];
    let mut next = 2;
    while next <= most {
        lengths.push(next);
        next = (next + 1).max(4 * next / 3);
    }
    lengths
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::window::Weighting;

    fn table_2() -> Sampling {
        Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap()
    }

    fn of(weighting: Weighting, step: usize) -> NoiseTest {
        let taper = Taper::unit(weighting.weights(64).unwrap()).unwrap();
        NoiseTest::new(
            &table_2(),
            &Gates::new(64, step, 0.0).unwrap(),
            &[taper],
            None,
            1 << 16,
            Noise::White,
        )
        .unwrap()
    }

    #[test]
    fn one_taper_has_the_shape_of_one_exponential_and_known_cells() {
        let flat = of(Weighting::Rectangular, 1);
        // B N, and a little for what the edges of the band let in
        assert!(
            (12.8..14.5).contains(&flat.band_variance.recip()),
            "{}",
            flat.band_variance
        );
        for gates in [1_usize, 2, 5, 20, 63, 100, 400] {
            let overlap = |k: usize| {
                if k < 64 {
                    (1.0 - k as f64 / 64.0).powi(2)
                } else {
                    0.0
                }
            };
            let pairs: f64 = (0..gates)
                .flat_map(|i| (0..gates).map(move |j| overlap(i.abs_diff(j))))
                .sum();
            let n_eff = flat.region([(gates, 1)].into_iter()).n_eff;
            assert!(
                (n_eff * pairs / (gates * gates) as f64 - 1.0).abs() < 0.03,
                "{gates}: {n_eff}"
            );
        }
        assert!(of(Weighting::default(), 3).band_variance > flat.band_variance / 0.8);
    }

    #[test]
    fn one_window_has_the_tail_of_an_exponential_and_crosses_a_level_at_rices_rate() {
        let test = of(Weighting::Rectangular, 1);
        let window = test.region([(1, 1)].into_iter());
        assert!(
            (window.n_eff - 1.0).abs() < 1e-9 && (window.scale - 1.0).abs() < 1e-9,
            "{window:?}"
        );
        for level in [3.0_f64, 5.0, 9.0] {
            let single = (-level).exp();
            let crossings = 12.8 * (PI / 3.0).sqrt() * level.sqrt() * single;
            let found = test.false_alarm(&window, level) / (1.0 - (-crossings).exp());
            assert!((found - 1.0).abs() < 2e-3, "{level}: {found}");
            // frequencies so far apart that each is a chance of its own
            let few = NoiseTest {
                padded: 5.0,
                band_width: 1.0,
                unflagged_width: 1.0,
                ..test.clone()
            };
            let expected = 1.0 - (1.0 - single).powi(5);
            assert!(
                (few.false_alarm(&window, level) / expected - 1.0).abs() < 1e-6,
                "{level}"
            );
        }
    }

    #[test]
    fn short_lags_in_a_long_window_are_so_many_shorter_windows() {
        let test = |samples: usize| {
            let taper = Taper::unit(Weighting::Hann.weights(samples).unwrap()).unwrap();
            let gates = Gates::new(samples, samples / 16, 0.0).unwrap();
            let lags: Vec<f64> = (0..5).map(|m| 1.0 - 0.2 * f64::from(m)).collect();
            NoiseTest::new(
                &table_2(),
                &gates,
                &[taper],
                Some(&lags),
                1 << 16,
                Noise::White,
            )
            .unwrap()
        };
        for gates in [1, 10] {
            let of =
                |samples: usize, pulses: usize| test(samples).region([(gates, pulses)].into_iter());
            let one = of(1024, 1);
            let four = of(256, 4);
            assert!(
                (one.shape / four.shape - 1.0).abs() < 0.03
                    && (one.scale / four.scale - 1.0).abs() < 0.03
            );
            assert!(
                (one.gradient / four.gradient - 1.0).abs() < 0.03,
                "{one:?} {four:?}"
            );
        }
    }

    #[test]
    fn thresholds_have_their_probability_and_fall_to_1_with_averaging() {
        let test = of(Weighting::default(), 1);
        let level = |gates, pulses, rate| {
            test.threshold(&test.region([(gates, pulses)].into_iter()), rate)
                .unwrap()
        };
        for (gates, pulses) in [(1, 1), (7, 1), (7, 40), (400, 1), (1, 10_000)] {
            for rate in [0.3, 0.01, 1e-6] {
                let region = test.region([(gates, pulses)].into_iter());
                let level = level(gates, pulses, rate);
                let found = test.false_alarm(&region, level);
                assert!(
                    (found / rate - 1.0).abs() < 1e-6,
                    "{gates} {pulses} {rate}: {level} {found}"
                );
            }
        }
        assert!(level(1, 1_000_000, 0.01) < 1.01 && level(1, 8, 0.01) < level(1, 1, 0.01));
        let window = test.region([(1, 1)].into_iter());
        assert!(
            test.threshold(&window, 1.0).is_err() && test.threshold(&window, f64::NAN).is_err()
        );
        let taper = Taper::unit(vec![1.0; 8]).unwrap();
        let other = Taper::unit(vec![1.0; 4]).unwrap();
        let gates = Gates::new(8, 1, 0.0).unwrap();
        let of = |tapers: &[Taper], lags: Option<&[f64]>, gates: &Gates| {
            NoiseTest::new(&table_2(), gates, tapers, lags, 64, Noise::White)
        };
        assert!(of(std::slice::from_ref(&taper), None, &gates).is_ok());
        assert!(matches!(
            of(&[taper.clone(), other], None, &gates),
            Err(Error::Length { .. })
        ));
        assert!(matches!(
            of(std::slice::from_ref(&taper), Some(&[]), &gates),
            Err(Error::Empty {
                field: "lag_weights"
            })
        ));
        assert!(
            of(
                &[taper],
                None,
                &Gates {
                    step_samples: 0,
                    ..gates
                }
            )
            .is_err()
        );
        let empty = test.region(std::iter::empty());
        assert!(empty.n_eff == 0.0 && test.threshold(&empty, 0.01).unwrap().is_nan());
    }

    #[test]
    fn windows_far_apart_see_noise_as_independent_as_that_of_pulses() {
        let of_two = |samples: usize, step, noise| {
            let taper = [Taper::unit(vec![1.0; samples]).unwrap()];
            let gates = Gates::new(samples, step, 0.0).unwrap();
            let test = NoiseTest::new(&table_2(), &gates, &taper, None, 64, noise).unwrap();
            let level = |gates, pulses| {
                test.threshold(&test.region([(gates, pulses)].into_iter()), 0.01)
                    .unwrap()
            };
            level(2, 1) / level(1, 2) - 1.0
        };
        // White noise has forgotten at once, that of a fifth of the frequencies after some 100 samples.
        assert!(
            of_two(16, 40, Noise::White).abs() < 1e-9
                && of_two(16, 1_000_000_000, Noise::White).abs() < 1e-9
        );
        for samples in [4, 16, 64] {
            let band = |step| of_two(samples, step, Noise::Band { floor: 1e-3 }).abs();
            let near = band(2 * samples);
            let far = band(1_000_000_000);
            // Four samples apart it remembers.
            assert!(
                far < 5e-4 && (samples > 4 || near > 1e-2),
                "{samples}: {near} {far}"
            );
        }
    }
}
