//! Records brought to complex baseband at the rate of the detector band, with the covariance of the noise that comes along.
//!
//! Demodulates by the middle of the band, filters with a symmetric low-pass (Kaiser window, 60 dB) and keeps every D-th
//! sample, D = floor(rate / bandwidth): 250 MHz and 50 MHz give 5, and a line needs a fifth of the samples without losing
//! information on velocities in the band. The filter is part of the model: its gain weights the signal of each velocity
//! and shapes the noise, so its slopes do no harm. A record loses half a filter length at each end (14 m for 250 MHz).
//! Check: tones come out with their gain, phase and frequency; the covariance of filtered noise is that of many draws.

use std::f64::consts::{PI, SQRT_2, TAU};

use num_complex::Complex;

use crate::bound::Noise;
use crate::error::Error;
use crate::window::{Sample, Sampling, SignalKind};

/// Attenuation of the stop band \[dB\].
const STOP_DB: f64 = 60.0;
/// Half-width of the flat part of the filter over that of the band.
const PASS: f64 = 0.6;
/// Least density of the noise model over that in the band: keeps covariances invertible where the noise is cut off.
const FLOOR: f64 = 1e-2;

/// Demodulation, filter and decimation.
#[derive(Debug, Clone)]
pub struct Baseband {
    sampling: Sampling,
    kind: SignalKind,
    decimation: usize,
    taps: Vec<f64>,
}

impl Baseband {
    /// For records of `kind` sampled as `sampling`.
    ///
    /// # Errors
    /// As [`Sampling::validate`]; [`Error::Band`] for real samples with a band that reaches 0 Hz or half the rate.
    pub fn new(sampling: &Sampling, kind: SignalKind) -> Result<Self, Error> {
        sampling.validate_for(kind)?;
        let (low_hz, high_hz) = sampling.band_hz;
        if kind == SignalKind::Real && (low_hz <= 0.0 || high_hz >= 0.5 * sampling.sample_rate_hz) {
            return Err(Error::Band {
                low_hz,
                high_hz,
                allowed: "inside 0 Hz and half the rate for real samples",
            });
        }
        let bandwidth_hz = high_hz - low_hz;
        let decimation = (sampling.sample_rate_hz / bandwidth_hz * (1.0 + 1e-9)).floor() as usize;
        let taps = if decimation == 1 && kind == SignalKind::Complex {
            vec![1.0]
        } else {
            let rate_hz = sampling.sample_rate_hz / decimation as f64;
            let mut stop_hz = rate_hz - 0.5 * PASS * bandwidth_hz;
            if kind == SignalKind::Real {
                // the mirror image, as seen from the middle of the band
                stop_hz = stop_hz.min(2.0 * low_hz + 0.5 * bandwidth_hz);
                stop_hz = stop_hz
                    .min(2.0 * (0.5 * sampling.sample_rate_hz - high_hz) + 0.5 * bandwidth_hz);
            }
            low_pass(
                0.5 * PASS * bandwidth_hz / sampling.sample_rate_hz,
                stop_hz / sampling.sample_rate_hz,
            )
        };
        Ok(Self {
            sampling: *sampling,
            kind,
            decimation,
            taps,
        })
    }

    /// Interval between the samples of the baseband \[s\].
    #[must_use]
    pub fn interval_s(&self) -> f64 {
        self.decimation as f64 * self.sampling.period_s()
    }

    /// Number of baseband samples of a record.
    ///
    /// # Errors
    /// [`Error::WindowLongerThanRecord`] if the record is shorter than the filter.
    pub fn samples(&self, record_samples: usize) -> Result<usize, Error> {
        let window_samples = self.taps.len();
        if window_samples > record_samples {
            return Err(Error::WindowLongerThanRecord {
                window_samples,
                record_samples,
            });
        }
        Ok((record_samples - window_samples) / self.decimation + 1)
    }

    /// Time of the first baseband sample after that of the record \[s\].
    #[must_use]
    pub fn delay_s(&self) -> f64 {
        (self.taps.len() / 2) as f64 * self.sampling.period_s()
    }

    /// Baseband of one record; a real record i = sqrt(2) Re{s exp(j 2 pi f t)} gives s, so powers are kept.
    ///
    /// # Errors
    /// As [`Baseband::samples`].
    pub fn convert<S: Sample>(&self, record: &[S]) -> Result<Vec<Complex<f64>>, Error> {
        let count = self.samples(record.len())?;
        let gain = if self.kind == SignalKind::Real {
            SQRT_2
        } else {
            1.0
        };
        let turns = self.centre_hz() * self.sampling.period_s();
        let mut demodulated: Vec<Complex<f64>> = Vec::with_capacity(record.len());
        for (n, sample) in record.iter().enumerate() {
            let phase = n as f64 * turns;
            let carrier = Complex::from_polar(gain, -TAU * (phase - phase.floor()));
            demodulated.push(sample.to_complex() * carrier);
        }
        let mut filtered = Vec::with_capacity(count);
        for k in 0..count {
            let mut sum = Complex::ZERO;
            for (h, z) in self.taps.iter().zip(&demodulated[k * self.decimation..]) {
                sum += z * *h;
            }
            filtered.push(sum);
        }
        Ok(filtered)
    }

    /// Angular frequency \[rad/s\] in the baseband of a radial velocity \[m/s\].
    pub(crate) fn turn_rad_s(&self, velocity_m_s: f64) -> f64 {
        TAU * (self.sampling.frequency_hz(velocity_m_s) - self.centre_hz())
    }

    /// Change of [`Baseband::turn_rad_s`] per m/s.
    pub(crate) fn turn_per_velocity_rad_m(&self) -> f64 {
        -2.0 * TAU / self.sampling.wavelength_m
    }

    fn centre_hz(&self) -> f64 {
        0.5 * (self.sampling.band_hz.0 + self.sampling.band_hz.1)
    }

    /// Amplitude gain of the filter at an angular frequency \[rad/s\] from the middle of the band.
    fn gain(&self, turn_rad_s: f64) -> f64 {
        let middle = self.taps.len() / 2;
        let angle = turn_rad_s * self.sampling.period_s();
        self.taps[middle]
            + 2.0
                * (1..=middle)
                    .map(|n| self.taps[middle + n] * (angle * n as f64).cos())
                    .sum::<f64>()
    }

    /// Table of the power gain against velocity, from -`reach` to `reach` about the middle of the band.
    pub(crate) fn power_gain(&self) -> PowerGain {
        let half_m_s = 0.25 * self.sampling.wavelength_m * self.sampling.sample_rate_hz;
        let centre_m_s = self.sampling.velocity_m_s(self.centre_hz());
        let points = 2048;
        let step_m_s = 2.0 * half_m_s / points as f64;
        let values = (0..=points)
            .map(|i| {
                self.gain(self.turn_rad_s(centre_m_s - half_m_s + i as f64 * step_m_s))
                    .powi(2)
            })
            .collect();
        PowerGain {
            first_m_s: centre_m_s - half_m_s,
            step_m_s,
            values,
        }
    }

    /// Covariance of the noise at lags 0 .. `lags` of the baseband, for unit noise power in the detector band.
    ///
    /// Real, since band and filter are symmetric about the middle. The noise has `FLOOR` of its density where `noise` says
    /// less, and a lag window, which smooths the density and keeps it positive, replaces the cut after `lags`.
    pub(crate) fn noise_covariance(&self, noise: Noise, lags: usize) -> Vec<f64> {
        let (low_hz, high_hz) = self.sampling.band_hz;
        let half_hz = 0.5 * (high_hz - low_hz);
        let rate_hz = self.sampling.sample_rate_hz;
        let floor = match noise {
            Noise::White => 1.0,
            Noise::Band { floor } => floor.max(FLOOR),
        };
        let mut covariance = vec![0.0; lags + 1];
        for (from_hz, to_hz, density) in [(0.0, half_hz, 1.0), (half_hz, 0.5 * rate_hz, floor)] {
            let points = 4096;
            let step_hz = (to_hz - from_hz) / points as f64;
            for i in 0..points {
                let turn = TAU * (from_hz + (i as f64 + 0.5) * step_hz);
                let power = density * self.gain(turn).powi(2) * step_hz / half_hz;
                let angle = turn * self.interval_s();
                for (m, value) in covariance.iter_mut().enumerate() {
                    *value += power * (angle * m as f64).cos();
                }
            }
        }
        let width = 0.25 * (lags as f64 + 1.0);
        for (m, value) in covariance.iter_mut().enumerate() {
            *value *= (-0.5 * (m as f64 / width).powi(2)).exp();
        }
        covariance
    }
}

/// Power gain of the filter against velocity, linear between points.
#[derive(Debug, Clone)]
pub(crate) struct PowerGain {
    first_m_s: f64,
    step_m_s: f64,
    values: Vec<f64>,
}

impl PowerGain {
    /// Gain and its change per m/s; velocities beyond the unambiguous interval fold.
    pub(crate) fn at(&self, velocity_m_s: f64) -> (f64, f64) {
        let intervals = self.values.len() - 1;
        let position =
            ((velocity_m_s - self.first_m_s) / self.step_m_s).rem_euclid(intervals as f64);
        let index = (position as usize).min(intervals - 1);
        let a = self.values[index];
        let change = self.values[index + 1] - a;
        let value = a + (position - index as f64) * change;
        (value, change / self.step_m_s)
    }
}

/// Symmetric low-pass, unit gain at 0, for a pass and a stop edge in units of the sampling rate (Kaiser 1974).
fn low_pass(pass: f64, stop: f64) -> Vec<f64> {
    let beta = 0.1102 * (STOP_DB - 8.7);
    let half = ((STOP_DB - 7.95) / (2.285 * TAU * (stop - pass)) / 2.0).ceil() as i64;
    let cut = pass + stop;
    let taps: Vec<f64> = (-half..=half)
        .map(|n| {
            let sinc = if n == 0 {
                cut
            } else {
                (PI * cut * n as f64).sin() / (PI * n as f64)
            };
            let x = n as f64 / (half as f64 + 1.0);
            sinc * bessel_i0(beta * (1.0 - x * x).sqrt())
        })
        .collect();
    let sum: f64 = taps.iter().sum();
    taps.into_iter().map(|h| h / sum).collect()
}

/// Modified Bessel function of order 0, by its series.
fn bessel_i0(x: f64) -> f64 {
    let quarter = 0.25 * x * x;
    let mut term = 1.0;
    let mut sum = 1.0;
    for k in 1..60 {
        term *= quarter / f64::from(k * k);
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn table_2() -> Sampling {
        Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap()
    }

    #[test]
    fn tones_keep_frequency_phase_and_power_and_lose_their_image() {
        let baseband = Baseband::new(&table_2(), SignalKind::Real).unwrap();
        assert_eq!(baseband.decimation, 5);
        assert!(baseband.taps.len() < 60, "{}", baseband.taps.len());
        for velocity in [-11.0, 0.0, 3.3, 15.0] {
            let turn = TAU * table_2().frequency_hz(velocity) / 250e6;
            let record: Vec<f64> = (0..400)
                .map(|n| SQRT_2 * (turn * n as f64 + 0.4).cos())
                .collect();
            let out = baseband.convert(&record).unwrap();
            let (gain, _) = baseband.power_gain().at(velocity);
            for (k, z) in out.iter().enumerate() {
                let time_s = baseband.delay_s() + k as f64 * baseband.interval_s();
                // the demodulation begins at phase 0 with the record
                let expected =
                    Complex::from_polar(gain.sqrt(), baseband.turn_rad_s(velocity) * time_s + 0.4);
                assert!(
                    (z - expected).norm() < 3e-3,
                    "{velocity} m/s: {z} {expected}"
                );
            }
            assert!(velocity.abs() > 11.5 || (gain - 1.0).abs() < 4e-3);
        }
    }

    #[test]
    fn complex_records_at_the_rate_of_the_band_pass_unchanged() {
        let sampling = Sampling::baseband(50e6, 1.55e-6, 50e6).unwrap();
        let baseband = Baseband::new(&sampling, SignalKind::Complex).unwrap();
        let record: Vec<Complex<f64>> = (0..9).map(|n| Complex::new(f64::from(n), -1.0)).collect();
        assert_eq!(baseband.convert(&record).unwrap(), record);
        let white = baseband.noise_covariance(Noise::White, 8);
        assert!(
            (white[0] - 1.0).abs() < 1e-12 && white[3].abs() < 1e-3,
            "{white:?}"
        );
    }

    #[test]
    fn filtered_white_noise_has_the_covariance_of_the_model() {
        let baseband = Baseband::new(&table_2(), SignalKind::Real).unwrap();
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(3);
        // variance 125/50 for unit power in the band
        let record: Vec<f64> = (0..1_000_000)
            .map(|_| 2.5_f64.sqrt() * rng.sample::<f64, _>(rand_distr::StandardNormal))
            .collect();
        let out = baseband.convert(&record).unwrap();
        let model = baseband.noise_covariance(Noise::White, 45);
        for lag in [0, 1, 2, 5] {
            let pairs = out.len() - lag;
            let mean: Complex<f64> = (0..pairs)
                .map(|k| out[k + lag] * out[k].conj())
                .sum::<Complex<f64>>()
                / pairs as f64;
            let error = (pairs as f64).sqrt().recip() * model[0] * 1.3;
            assert!(
                (mean - model[lag]).norm() < 4.0 * error,
                "lag {lag}: {mean} {}",
                model[lag]
            );
        }
    }

    #[test]
    fn records_shorter_than_the_filter_and_bands_at_the_edge_are_refused() {
        let baseband = Baseband::new(&table_2(), SignalKind::Real).unwrap();
        assert!(matches!(
            baseband.samples(10),
            Err(Error::WindowLongerThanRecord {
                record_samples: 10,
                ..
            })
        ));
        let edge = Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 125e6)).unwrap();
        assert!(matches!(
            Baseband::new(&edge, SignalKind::Real),
            Err(Error::Band { .. })
        ));
    }
}
