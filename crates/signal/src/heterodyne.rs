//! The heterodyne signal of one pulse along one line of sight, equations (6)-(15).
//!
//! `s(t_k) = sqrt(2) S sqrt(E_t P_LO) sqrt(DeltaR) sum_l f(t_k - 2 R_l/c) b_l exp(-j 4 pi v_l t_k/lambda)`, (15),
//! corrected: by `sqrt 2`, so that (14) holds; `sqrt(DeltaR)`, since layers are independent; the sum centred on the range
//! that sample k sees. `b_l` is circular complex normal of variance `weight_per_m`, drawn for each pulse and the same
//! throughout it. Air moving away lowers the frequency, `f = f_c - 2 v/lambda`.
//!
//! Each layer is a phasor that is turned once per sample; it is computed afresh when the pulse reaches the layer and
//! every 1024 samples.
//!
//! Check: [`literal_envelope`](crate::literal_envelope) is the sum as written; the mean power is (14), whatever the layer
//! thickness; the covariance in a uniform wind is `exp(-tau^2/(4 sigma^2)) exp(-j 4 pi v tau/lambda)`.

use std::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2};

use num_complex::Complex;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use crate::error::{check, check_length};
use crate::kernel::Phasors;
use crate::noise::{NoiseScratch, NoiseSource};
use crate::window::Window;
use crate::{Error, GaussianPulse, LineOfSight, Receiver};

/// Samples after which all phasors are computed afresh, so that rounding cannot build up.
const RENEWAL_SAMPLES: usize = 1024;

/// When and how long the receiver samples after each pulse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Record {
    /// Time of the first sample after the middle of the pulse leaves \[s\]; it sees the range `c t/2`.
    pub time_of_first_sample_s: f64,
    /// Number of samples.
    pub samples: usize,
}

/// Buffers of one worker, reused from pulse to pulse.
#[derive(Debug, Default)]
pub struct Scratch {
    window: Window,
    phasors: Phasors,
    speckle: Vec<Complex<f64>>,
    envelope: Vec<Complex<f64>>,
    noise: NoiseScratch,
}

/// Makes records: pulse, receiver and sampling times, planned once and used for every line and pulse.
///
/// Shared between threads; each needs its own [`Scratch`] and random generator.
#[derive(Debug, Clone)]
pub struct Simulator {
    pulse: GaussianPulse,
    receiver: Receiver,
    record: Record,
    noise: NoiseSource,
    carrier: Vec<Complex<f64>>,
}

impl Simulator {
    /// Plans the records of `pulse` and `receiver`.
    ///
    /// # Errors
    /// As [`Receiver::validate`]; [`Error::OutOfRange`] for a record without samples or a first time that is not finite.
    pub fn new(pulse: GaussianPulse, receiver: Receiver, record: Record) -> Result<Self, Error> {
        receiver.validate()?;
        check("time_of_first_sample_s", record.time_of_first_sample_s, "finite", |_| true)?;
        check("samples", record.samples as f64, "1 or more", |n| n >= 1.0)?;
        let interval_s = 1.0 / receiver.sample_rate_hz;
        let carrier = (0..record.samples)
            .map(|k| {
                let time_s = record.time_of_first_sample_s + k as f64 * interval_s;
                // A whole turn is taken off before the multiplication, which keeps the phase exact for late samples.
                let turns = receiver.intermediate_frequency_hz * time_s;
                Complex::cis(2.0 * PI * (turns - turns.floor()))
            })
            .collect();
        let noise = NoiseSource::new(&receiver, record.samples);
        Ok(Self { pulse, receiver, record, noise, carrier })
    }

    /// The pulse.
    pub fn pulse(&self) -> &GaussianPulse {
        &self.pulse
    }

    /// The receiver.
    pub fn receiver(&self) -> &Receiver {
        &self.receiver
    }

    /// The sampling times.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// Time of sample `k` \[s\].
    pub fn time_s(&self, k: usize) -> f64 {
        self.record.time_of_first_sample_s + k as f64 / self.receiver.sample_rate_hz
    }

    /// Writes the measured current `i(t_k) = sqrt(2) Re{s(t_k) exp(j 2 pi f_c t_k)} + i_N`, (12) \[A\], of one pulse.
    ///
    /// Draws, in this order: for each layer of the line, first to last, the real and the imaginary part of its speckle
    /// (masked and weightless layers too, so that they do not shift the others); then the noise: none for
    /// [`NoiseModel::None`](crate::NoiseModel::None), one normal number per sample for `White`, two per frequency
    /// for `BandLimited`.
    ///
    /// # Errors
    /// As [`LineOfSight::validate`]; [`Error::LengthMismatch`] if `out_a` has not one place per sample;
    /// [`Error::OutOfRange`] for layers far thinner than any use.
    pub fn record_into<R: Rng + ?Sized>(
        &self,
        line: &LineOfSight,
        rng: &mut R,
        scratch: &mut Scratch,
        out_a: &mut [f64],
    ) -> Result<(), Error> {
        check_length("out_a", out_a.len(), self.record.samples)?;
        let mut envelope = std::mem::take(&mut scratch.envelope);
        envelope.resize(self.record.samples, Complex::ZERO);
        let result = self.envelope_into(line, rng, scratch, &mut envelope);
        if result.is_ok() {
            for ((out, s), carrier) in out_a.iter_mut().zip(&envelope).zip(&self.carrier) {
                *out = SQRT_2 * (s.re * carrier.re - s.im * carrier.im);
            }
            self.noise.add_to(rng, &mut scratch.noise, out_a);
        }
        scratch.envelope = envelope;
        result
    }

    /// Writes the complex envelope `s(t_k)` of one pulse, (15), corrected \[A\], without noise.
    ///
    /// Draws the speckle as [`Simulator::record_into`] does.
    ///
    /// # Errors
    /// As [`Simulator::record_into`].
    pub fn envelope_into<R: Rng + ?Sized>(
        &self,
        line: &LineOfSight,
        rng: &mut R,
        scratch: &mut Scratch,
        out_a: &mut [Complex<f64>],
    ) -> Result<(), Error> {
        line.validate()?;
        let mut speckle = std::mem::take(&mut scratch.speckle);
        speckle.clear();
        speckle.extend((0..line.layers()).map(|_| {
            let re: f64 = rng.sample(StandardNormal);
            let im: f64 = rng.sample(StandardNormal);
            Complex::new(re, im) * FRAC_1_SQRT_2
        }));
        let result = self.envelope_of_speckle_into(line, &speckle, scratch, out_a);
        scratch.speckle = speckle;
        result
    }

    /// Writes the complex envelope for given speckle amplitudes `g_l` (mean square 1), one per layer \[A\].
    ///
    /// # Errors
    /// As [`Simulator::record_into`]; [`Error::LengthMismatch`] if there is not one amplitude per layer.
    pub fn envelope_of_speckle_into(
        &self,
        line: &LineOfSight,
        speckle: &[Complex<f64>],
        scratch: &mut Scratch,
        out_a: &mut [Complex<f64>],
    ) -> Result<(), Error> {
        check_length("out_a", out_a.len(), self.record.samples)?;
        line.validate()?;
        check_length("speckle", speckle.len(), line.layers())?;
        self.prepare(line, scratch)?;
        let Scratch { window, phasors, .. } = scratch;
        phasors.resize(line.layers());
        for (block, outs) in out_a.chunks_mut(RENEWAL_SAMPLES).enumerate() {
            let start = block * RENEWAL_SAMPLES;
            self.renew(line, speckle, window, phasors, start, outs.len());
            for (i, out) in outs.iter_mut().enumerate() {
                let (first, _) = window.layers_at(start + i);
                let envelope = window.amplitudes_at(&self.pulse, line.layer_thickness_m, start + i);
                let (re, im) = phasors.sum_and_turn(first, envelope);
                *out = Complex::new(re, im);
            }
        }
        Ok(())
    }

    /// Writes the mean power `E|s(t_k)|^2` of the discrete sum \[A^2\]: what many pulses average to, without drawing any.
    /// It is also the mean square of the signal part of [`Simulator::record_into`].
    ///
    /// # Errors
    /// As [`Simulator::record_into`].
    pub fn mean_power_into(&self, line: &LineOfSight, scratch: &mut Scratch, out_a2: &mut [f64]) -> Result<(), Error> {
        check_length("out_a2", out_a2.len(), self.record.samples)?;
        line.validate()?;
        self.prepare(line, scratch)?;
        let gain = self.amplitude_gain_a_sqrt_s(line).powi(2);
        for (k, out) in out_a2.iter_mut().enumerate() {
            let (first, _) = scratch.window.layers_at(k);
            let envelope = scratch.window.amplitudes_at(&self.pulse, line.layer_thickness_m, k);
            let sum: f64 = envelope
                .iter()
                .zip(&line.weight_per_m[first..])
                .zip(&line.radial_velocity_m_s[first..])
                .filter(|&(_, velocity)| !velocity.is_nan())
                .map(|((f, weight), _)| f * f * weight)
                .sum();
            *out = gain * sum;
        }
        Ok(())
    }

    /// Writes the signal-to-noise ratio of each sample, (14), corrected: mean signal power over the noise power in the
    /// detector band.
    ///
    /// # Errors
    /// As [`Simulator::record_into`].
    pub fn snr_into(&self, line: &LineOfSight, scratch: &mut Scratch, out: &mut [f64]) -> Result<(), Error> {
        self.mean_power_into(line, scratch, out)?;
        let noise_a2 = self.receiver.noise_variance_a2();
        out.iter_mut().for_each(|power| *power /= noise_a2);
        Ok(())
    }

    /// `sqrt(2) S sqrt(E_t P_LO) sqrt(DeltaR)`: what `f b_l` is multiplied with in (15) \[A s^1/2 m^1/2\].
    pub(crate) fn amplitude_gain_a_sqrt_s(&self, line: &LineOfSight) -> f64 {
        let gain = self.receiver.heterodyne_gain_a2_w() * self.pulse.energy_j();
        (gain * line.layer_thickness_m).sqrt()
    }

    /// Phase of layer velocity `v` per second, `-4 pi v/lambda` \[rad/s\].
    pub(crate) fn phase_rate_rad_s(&self, radial_velocity_m_s: f64) -> f64 {
        -4.0 * PI * radial_velocity_m_s / self.receiver.wavelength_m
    }

    fn prepare(&self, line: &LineOfSight, scratch: &mut Scratch) -> Result<(), Error> {
        scratch.window.prepare(
            &self.pulse,
            line,
            self.record.time_of_first_sample_s,
            1.0 / self.receiver.sample_rate_hz,
            self.record.samples,
        )
    }

    /// Sets the phasors of all layers that are lit in the `samples` samples from `start`: each as it is at `start`, or at
    /// the first sample that lights it.
    fn renew(
        &self,
        line: &LineOfSight,
        speckle: &[Complex<f64>],
        window: &Window,
        phasors: &mut Phasors,
        start: usize,
        samples: usize,
    ) {
        let gain = self.amplitude_gain_a_sqrt_s(line);
        let mut next = window.layers_at(start).0;
        for k in start..start + samples {
            let time_s = self.time_s(k);
            let (first, end) = window.layers_at(k);
            let from = next.max(first);
            for (layer, g) in (from..end).zip(&speckle[from.min(end)..end]) {
                let velocity_m_s = line.radial_velocity_m_s[layer];
                let amplitude = gain * line.weight_per_m[layer].sqrt() * g;
                self.set_phasor(phasors, layer, velocity_m_s, amplitude, time_s);
            }
            next = next.max(end);
        }
    }

    /// Sets the phasor of one layer as it is at `time_s`, and its turn per sample; nothing returns from a masked layer.
    fn set_phasor(&self, phasors: &mut Phasors, layer: usize, velocity_m_s: f64, amplitude: Complex<f64>, time_s: f64) {
        let (phasor, turn) = if velocity_m_s.is_nan() {
            (Complex::ZERO, Complex::ONE)
        } else {
            let rate = self.phase_rate_rad_s(velocity_m_s);
            let interval_s = 1.0 / self.receiver.sample_rate_hz;
            (amplitude * Complex::cis(rate * time_s), Complex::cis(rate * interval_s))
        };
        (phasors.re[layer], phasors.im[layer]) = (phasor.re, phasor.im);
        (phasors.turn_re[layer], phasors.turn_im[layer]) = (turn.re, turn.im);
    }
}
