//! How high the peak of pure noise stands: the threshold that tells a signal from noise.
//!
//! The density of a spectrum at one frequency is a quadratic form x^H Q x of the samples. In white noise its mean over
//! n_eff windows is, nearly, a gamma variable of shape a = n_eff (tr Q)^2 / tr Q^2. Between the frequencies it is a smooth
//! process; the rate at which it crosses a level upwards follows from its gradient (Rice 1945). With t the level over the
//! density of the noise, B the band in cycles per sample and w^2 the mean of (2 pi (n - m))^2 / 2 over |Q_nm|^2,
//!
//! ```text
//! P(t) = 1 - (1 - T) exp(-B w / sqrt(pi) (a t)^(a - 1/2) e^(-a t) / Gamma(a))
//! T = Q(a, a t), the upper incomplete gamma function
//! ```
//!
//! The density of the noise must be known, as an instrument knows it from its detector without light: that of the mean
//! statistic of noise ([`Noise::expected_correlogram`](crate::bound::Noise::expected_correlogram)). Check: one exponential; the
//! rate of false alarms of spectra with one taper, several, and lag windows, in white and in band-limited noise, for
//! single windows and whole regions (in the tests of the estimators).

use num_complex::Complex;
use statrs::function::gamma::ln_gamma;

use crate::error::{Error, positive};
use crate::estimators::tails::gamma_tail;
use crate::map::WindowCorrelation;
use crate::spectrum::Taper;
use crate::window::{Gates, Sampling};

/// Distances between windows at which the correlation of their densities is computed; between them it is linear.
const DISTANCES: usize = 48;

/// The test of a spectrum against noise: what noise looks like in it.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseTest {
    /// Gamma shape of the density of one window, (tr Q)^2 / tr Q^2.
    gain: f64,
    /// Independent cells that the mean over the band is worth.
    cells: f64,
    /// B w / sqrt(pi).
    crossings: f64,
    /// Frequencies at which the density is looked at.
    frequencies: f64,
    correlation: WindowCorrelation,
}

impl NoiseTest {
    /// For the spectrum of a correlogram of those tapers, times `lag_weights` from lag 0 on (none: all lags as they are),
    /// whose peak is sought among `padded_samples` frequencies over 0 .. F_s.
    ///
    /// # Errors
    /// [`Error::Empty`] without tapers, [`Error::OutOfRange`] for tapers or weights without power.
    pub fn new(
        sampling: &Sampling,
        gates: &Gates,
        tapers: &[Taper],
        lag_weights: Option<&[f64]>,
        padded_samples: usize,
    ) -> Result<Self, Error> {
        let complex = |taper: &Taper| {
            let root = taper.factor.abs().sqrt();
            taper.weights.iter().map(|h| Complex::from(h * root)).collect::<Vec<_>>()
        };
        let tapers: Vec<_> = tapers.iter().map(complex).collect();
        Self::of_complex(sampling, gates, &tapers, lag_weights, padded_samples)
    }

    /// The same for tapers that are complex and hold the root of their factor.
    pub(crate) fn of_complex(
        sampling: &Sampling,
        gates: &Gates,
        tapers: &[Vec<Complex<f64>>],
        lag_weights: Option<&[f64]>,
        padded_samples: usize,
    ) -> Result<Self, Error> {
        let samples = tapers.first().map_or(0, Vec::len);
        if samples == 0 {
            return Err(Error::Empty { field: "tapers" });
        }
        let band = (sampling.band_hz.1 - sampling.band_hz.0) / sampling.sample_rate_hz;
        let shifts = distances(samples, gates.step_samples);
        let mut overlap = vec![0.0; shifts.len()];
        let (mut trace, mut square, mut in_band, mut spread) = (0.0, 0.0, 0.0, 0.0);
        for lag in 0..lag_weights.map_or(samples, |weights| weights.len().min(samples)) {
            let weight = lag_weights.map_or(1.0, |weights| weights[lag]);
            // the diagonal of Q that many places off the middle one
            let at = |n: usize| tapers.iter().map(|h| h[n + lag] * h[n].conj()).sum::<Complex<f64>>() * weight;
            let diagonal: Vec<Complex<f64>> = (0..samples - lag).map(at).collect();
            let sides = if lag == 0 { 1.0 } else { 2.0 };
            let energy = sides * diagonal.iter().map(|q| q.norm_sqr()).sum::<f64>();
            let turn = std::f64::consts::PI * band * lag as f64;
            square += energy;
            in_band += energy * if lag == 0 { 1.0 } else { (turn.sin() / turn).powi(2) };
            spread += energy * (lag * lag) as f64;
            if lag == 0 {
                trace = diagonal.iter().map(|q| q.re).sum();
            }
            for (sum, shift) in overlap.iter_mut().zip(&shifts) {
                let pairs = diagonal.iter().skip(*shift).zip(&diagonal);
                *sum += sides * pairs.map(|(a, b)| a.re * b.re + a.im * b.im).sum::<f64>();
            }
        }
        positive("power of the tapers", trace)?;
        positive("power of the weights of the lags", square)?;
        let gates_apart = (samples - 1) / gates.step_samples + 1;
        let gamma = |gate: usize| between(&shifts, &overlap, gate * gates.step_samples) / square;
        let gamma: Vec<f64> = (0..gates_apart).map(|gate| gamma(gate).clamp(0.0, 1.0).sqrt()).collect();
        Ok(Self {
            gain: trace * trace / square,
            cells: square / in_band,
            // w^2 = (2 pi)^2 spread / (2 square)
            crossings: band * (std::f64::consts::TAU * spread / square).sqrt(),
            frequencies: (band * padded_samples as f64).floor().max(1.0),
            correlation: WindowCorrelation::from_gate_lags(&gamma)?,
        })
    }

    /// Correlation of the densities of noise in the windows of one pulse, for the n_eff that the test asks for.
    #[must_use]
    pub fn correlation(&self) -> &WindowCorrelation {
        &self.correlation
    }

    /// Standard deviation of the mean density of noise in the band, over its mean.
    #[must_use]
    pub fn band_deviation(&self, n_eff: f64) -> f64 {
        (n_eff * self.gain * self.cells).sqrt().recip()
    }

    /// Probability that noise alone has a peak of more than `level` times its density.
    ///
    /// `n_eff` is the number of independent windows by [`NoiseTest::correlation`].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless both are above 0 and finite.
    pub fn false_alarm(&self, n_eff: f64, level: f64) -> Result<f64, Error> {
        positive("n_eff", n_eff)?;
        positive("level", level)?;
        Ok(self.probability(n_eff * self.gain, level))
    }

    fn probability(&self, shape: f64, level: f64) -> f64 {
        let sum = shape * level;
        let single = gamma_tail(shape, sum);
        let crossings = self.crossings * ((shape - 0.5) * sum.ln() - sum - ln_gamma(shape)).exp();
        // no more chances than frequencies looked at
        let chances = crossings.min(-(self.frequencies - 1.0) * (-single).ln_1p());
        1.0 - (1.0 - single) * (-chances).exp()
    }

    /// Peak over the density of the noise that noise alone exceeds with probability `false_alarm`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless `n_eff` is above 0 and `false_alarm` between 0 and 1.
    pub fn threshold(&self, n_eff: f64, false_alarm: f64) -> Result<f64, Error> {
        positive("n_eff", n_eff)?;
        if !(false_alarm > 0.0 && false_alarm < 1.0) {
            return Err(Error::OutOfRange { field: "false_alarm", value: false_alarm, allowed: "between 0 and 1" });
        }
        let shape = n_eff * self.gain;
        let (mut low, mut high) = (0.0, 2.0);
        while self.probability(shape, high) > false_alarm && high < f64::MAX {
            (low, high) = (high, 2.0 * high);
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.probability(shape, middle) > false_alarm {
                low = middle;
            } else {
                high = middle;
            }
        }
        Ok(0.5 * (low + high))
    }
}

/// Distances in samples from 0 to the length of the window, those of the gates among them while they are few.
fn distances(samples: usize, step: usize) -> Vec<usize> {
    let every = step * samples.div_ceil(step).div_ceil(DISTANCES).max(1);
    (0..samples).step_by(every).chain([samples]).collect()
}

/// Value at `at` of a table with increasing places; beyond the last as there.
fn between(places: &[usize], values: &[f64], at: usize) -> f64 {
    let above = places.partition_point(|place| *place <= at);
    match (places.get(above.wrapping_sub(1)), places.get(above)) {
        (Some(&low), Some(&high)) => {
            let part = (at - low) as f64 / (high - low) as f64;
            values[above - 1] + part * (values[above] - values[above - 1])
        }
        _ => values.last().copied().unwrap_or(0.0),
    }
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
        NoiseTest::new(&table_2(), &Gates::new(64, step, 0.0).unwrap(), &[taper], None, 1024).unwrap()
    }

    #[test]
    fn one_taper_has_the_shape_of_one_exponential_and_known_cells() {
        let flat = of(Weighting::Rectangular, 1);
        assert!((flat.gain - 1.0).abs() < 1e-12);
        // B N, and a little for what the edges of the band let in
        assert!((12.8..14.5).contains(&flat.cells), "{}", flat.cells);
        let exact = 12.8 * (std::f64::consts::PI / 3.0).sqrt();
        assert!((flat.crossings / exact - 1.0).abs() < 1e-3, "{} {exact}", flat.crossings);
        for gates in [0, 1, 5, 20, 63, 64] {
            let overlap = (1.0 - f64::from(gates) / 64.0).powi(2);
            assert!((flat.correlation().squared(gates as usize) - overlap).abs() < 2e-3, "{gates}");
        }
        let weighted = of(Weighting::default(), 3);
        assert!(weighted.cells < 0.8 * flat.cells && weighted.crossings < 0.8 * flat.crossings);
    }

    #[test]
    fn one_window_has_the_tail_of_an_exponential_and_crosses_a_level_at_rices_rate() {
        let test = of(Weighting::Rectangular, 1);
        for level in [3.0_f64, 5.0, 9.0] {
            let single = (-level).exp();
            let crossings = 12.8 * (std::f64::consts::PI / 3.0).sqrt() * level.sqrt() * single;
            let expected = 1.0 - (1.0 - single) * (-crossings).exp();
            assert!((test.false_alarm(1.0, level).unwrap() / expected - 1.0).abs() < 1e-3, "{level}");
            // a spectrum that is looked at in one place only
            let one = NoiseTest { frequencies: 1.0, ..test.clone() };
            assert!((one.false_alarm(1.0, level).unwrap() / single - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn thresholds_have_their_probability_and_fall_to_1_with_averaging() {
        let test = of(Weighting::default(), 1);
        for n_eff in [0.5, 1.0, 7.5, 120.0, 1e4] {
            for rate in [0.3, 0.01, 1e-6] {
                let level = test.threshold(n_eff, rate).unwrap();
                let found = test.false_alarm(n_eff, level).unwrap();
                assert!((found / rate - 1.0).abs() < 1e-6, "{n_eff} {rate}: {level} {found}");
            }
        }
        assert!(test.threshold(1e6, 0.01).unwrap() < 1.01);
        assert!(test.threshold(7.5, 0.01).unwrap() < test.threshold(1.0, 0.01).unwrap());
        assert!(test.threshold(0.0, 0.01).is_err() && test.threshold(1.0, 1.0).is_err());
        assert!(test.threshold(f64::NAN, 0.01).is_err() && test.false_alarm(1.0, -1.0).is_err());
    }
}
