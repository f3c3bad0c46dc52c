//! Power density of a correlogram on a frequency grid.
//!
//! Computes S(f) = sum over m of r_m exp(-2 pi i f m / F_s), with r_-m the conjugate of r_m, so that white
//! noise has the density of its variance at every frequency. Check: for the biased correlogram
//! with all lags this is the periodogram (29), corrected, to round-off.

use std::sync::Arc;

use num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner};

use crate::error::{Error, at_least_one, length};
use crate::window::{Sampling, Scratch, SignalKind};

/// Transform of a correlogram to `padded_samples` equidistant frequencies.
#[derive(Clone)]
pub struct LagSpectrum {
    kind: SignalKind,
    lags: usize,
    inverse: Arc<dyn ComplexToReal<f64>>,
}

impl LagSpectrum {
    /// Plans the transform of `lags` lags (0 .. lags-1) to `padded_samples` frequencies.
    ///
    /// Fewer frequencies than 2 `lags` - 1 are allowed: the values are then samples of the same spectrum.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if one of the two numbers is 0.
    pub fn new(kind: SignalKind, lags: usize, padded_samples: usize) -> Result<Self, Error> {
        at_least_one("lags", lags)?;
        at_least_one("padded_samples", padded_samples)?;
        let inverse = RealFftPlanner::new().plan_fft_inverse(padded_samples);
        Ok(Self {
            kind,
            lags,
            inverse,
        })
    }

    /// Numbers of a correlogram with the planned number of lags.
    pub(crate) fn numbers(&self) -> usize {
        self.kind.lag_numbers(self.lags)
    }

    /// Number M of frequencies.
    pub(crate) fn frequencies(&self) -> usize {
        self.inverse.len()
    }

    /// Densities S(k F_s / M), k = 0 .. M-1 (k > M/2 are the negative frequencies), in signal units squared.
    ///
    /// # Errors
    /// [`Error::Length`] if `correlogram` does not hold the planned number of lags.
    pub fn density<'s>(
        &self,
        correlogram: &[f64],
        scratch: &'s mut Scratch,
    ) -> Result<&'s [f64], Error> {
        length("correlogram", self.numbers(), correlogram.len())?;
        let padded = self.inverse.len();
        let half = padded / 2 + 1;
        scratch.half.clear();
        scratch.half.resize(half, Complex::ZERO);
        scratch.density.resize(padded, 0.0);
        let inner = self.inverse.get_scratch_len();
        scratch
            .transform
            .resize(inner.max(scratch.transform.len()), Complex::ZERO);
        // The transform has the sign exp(+i), so the lags go in conjugated; lags beyond M/2 fold back.
        for m in 0..self.lags {
            let lag = self.kind.lag(correlogram, m).conj();
            let positive = m % padded;
            if positive < half {
                scratch.half[positive] += lag;
            }
            let negative = (padded - positive) % padded;
            if m > 0 && negative < half {
                scratch.half[negative] += lag.conj();
            }
        }
        scratch.half[0].im = 0.0;
        if padded.is_multiple_of(2) {
            scratch.half[half - 1].im = 0.0;
        }
        self.inverse
            .process_with_scratch(
                &mut scratch.half,
                &mut scratch.density,
                &mut scratch.transform[..inner],
            )
            .map_err(|_| Error::Length {
                field: "correlogram",
                expected: padded,
                found: correlogram.len(),
            })?;
        Ok(&scratch.density)
    }
}

/// Density of a correlogram at one frequency \[Hz\]: the sum over all its lags.
#[cfg(test)]
pub(crate) fn density_at(
    correlogram: &[f64],
    kind: SignalKind,
    frequency_hz: f64,
    sampling: &Sampling,
) -> f64 {
    let turn = std::f64::consts::TAU * frequency_hz / sampling.sample_rate_hz;
    let term = |m: usize| {
        let weight = if m == 0 { 1.0 } else { 2.0 };
        weight * (kind.lag(correlogram, m) * Complex::from_polar(1.0, -turn * m as f64)).re
    };
    (0..correlogram.len() / kind.lag_numbers(1)).map(term).sum()
}

/// The frequencies of a grid of `padded_samples` points that lie inside the detector band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Band {
    first: i64,
    pub(crate) bins: usize,
    /// The band covers all frequencies of a complex signal, so that it has no edge.
    pub(crate) cyclic: bool,
    spacing_hz: f64,
}

impl Band {
    /// Bins of the band of `sampling`; at least one must lie inside.
    pub(crate) fn new(sampling: &Sampling, kind: SignalKind, padded: usize) -> Result<Self, Error> {
        sampling.validate_for(kind)?;
        let spacing_hz = sampling.sample_rate_hz / padded as f64;
        let (low_hz, high_hz) = sampling.band_hz;
        // a band edge that is a bin up to rounding counts as inside
        let first = (low_hz / spacing_hz - 1e-9).ceil() as i64;
        let last = (high_hz / spacing_hz + 1e-9).floor() as i64;
        let bins = (last - first + 1).max(0) as usize;
        if bins == 0 {
            return Err(Error::Band {
                low_hz,
                high_hz,
                allowed: "wide enough to hold a frequency of the padded spectrum: pad more or widen",
            });
        }
        Ok(Self {
            first,
            bins: bins.min(padded),
            cyclic: bins >= padded,
            spacing_hz,
        })
    }

    /// Frequencies \[Hz\] of the bins and of one neighbour on each side.
    pub(crate) fn with_neighbours_hz(&self) -> Vec<f64> {
        (0..self.bins + 2)
            .map(|place| self.frequency_hz(place as f64 - 1.0))
            .collect()
    }

    /// Frequency \[Hz\] of a (fractional) bin of the band.
    pub(crate) fn frequency_hz(&self, bin: f64) -> f64 {
        (self.first as f64 + bin) * self.spacing_hz
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    fn sampling() -> Sampling {
        Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap()
    }

    #[test]
    fn grid_and_single_frequency_agree_for_every_length_of_the_grid() {
        let real: Vec<f64> = (0..20)
            .map(|m| (0.7 * m as f64).cos() / (1.0 + m as f64))
            .collect();
        let mut complex: Vec<f64> = (0..40)
            .map(|m| (1.3 * m as f64).sin() / (1.0 + m as f64))
            .collect();
        complex[1] = 0.0;
        let mut scratch = Scratch::new();
        for (kind, lags) in [(SignalKind::Real, &real), (SignalKind::Complex, &complex)] {
            for padded in [1, 2, 7, 16, 20, 37, 38, 39, 40, 41, 64, 1024] {
                let plan = LagSpectrum::new(kind, 20, padded).unwrap();
                let density = plan.density(lags, &mut scratch).unwrap().to_vec();
                for (k, value) in density.iter().enumerate() {
                    let frequency_hz = k as f64 * 250e6 / padded as f64;
                    let exact = density_at(lags, kind, frequency_hz, &sampling());
                    assert_abs_diff_eq!(*value, exact, epsilon = 1e-12);
                }
            }
        }
    }

    #[test]
    fn detector_band_holds_205_bins_of_1024_and_12_of_64() {
        let wide = Band::new(&sampling(), SignalKind::Real, 1024).unwrap();
        let places = |band: &Band, padded: f64| {
            (
                band.bins,
                (band.frequency_hz(0.0) * padded / 250e6).round() as i64,
            )
        };
        assert_eq!(places(&wide, 1024.0), (205, 226));
        let neighbours_hz = wide.with_neighbours_hz();
        assert_eq!(neighbours_hz.len(), 207);
        assert_abs_diff_eq!(neighbours_hz[206], 431.0 * 250e6 / 1024.0, epsilon = 1e-3);
        let literal = Band::new(&sampling(), SignalKind::Real, 64).unwrap();
        assert_eq!(places(&literal, 64.0), (12, 15));
        let baseband = Sampling::baseband(250e6, 1.55e-6, 250e6).unwrap();
        let whole = Band::new(&baseband, SignalKind::Complex, 64).unwrap();
        assert!(whole.cyclic && whole.bins == 64);
    }

    #[test]
    fn wrong_lengths_and_empty_bands_are_refused() {
        assert!(LagSpectrum::new(SignalKind::Real, 0, 64).is_err());
        let plan = LagSpectrum::new(SignalKind::Complex, 8, 64).unwrap();
        assert!(plan.density(&[0.0; 8], &mut Scratch::new()).is_err());
        let narrow = Sampling::new(250e6, 80e6, 1.55e-6, (80.1e6, 80.2e6)).unwrap();
        assert!(Band::new(&narrow, SignalKind::Real, 64).is_err());
    }
}
