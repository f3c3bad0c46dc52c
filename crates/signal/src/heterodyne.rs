//! The heterodyne signal of one pulse along one line of sight, equations (6)-(15).
//!
//! `s(t_k) = sqrt(2) S sqrt(E_t P_LO) sqrt(DeltaR) sum_l f(t_k - 2 R_l/c) b_l exp(-j 4 pi v_l
//! t_k/lambda)`, (15), corrected: by `sqrt 2`, so that (14) holds; `sqrt(DeltaR)`, since layers are
//! independent; the sum centred on the range of sample k. `b_l` is circular complex normal of
//! variance `weight_per_m`, drawn for each pulse and the same throughout it. Air moving away lowers
//! the frequency, `f = f_c - 2 v/lambda`.
//!
//! Each layer is a phasor that is rotated once per sample; it is computed afresh when the pulse
//! reaches the layer and every 1024 samples.
//!
//! Check: [`literal_envelope`](crate::literal::literal_envelope) is the sum as written; the mean
//! power is (14), whatever the layer thickness; the covariance in a uniform wind is
//! `exp(-tau^2/(4 sigma^2)) exp(-j 4 pi v tau/lambda)`.

use std::f64::consts::{FRAC_1_SQRT_2, PI};
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use num_complex::Complex;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use crate::error::{check, check_length, check_overflow};
use crate::kernel::Phasors;
use crate::noise::{BasebandNoise, NoiseScratch, RealNoise};
use crate::record::{Detector, Record};
use crate::window::Window;
use crate::{Error, LineOfSight, Pulse, Receiver, Sample, Shot};

/// Samples after which all phasors are computed afresh, so that rounding cannot build up.
const RENEWAL_SAMPLES: usize = 1024;

/// Buffers of one worker, reused from pulse to pulse.
#[derive(Debug, Default)]
pub struct Scratch {
    pub(crate) window: Window,
    phasors: Phasors,
    speckle: Vec<Complex<f64>>,
    envelope: Vec<Complex<f64>>,
    noise: NoiseScratch,
}

/// Makes records: pulse, receiver and sampling times, planned once and used for every
/// line and pulse.
///
/// Shared between threads; each needs its own [`Scratch`] and random generator.
#[derive(Clone)]
pub struct Simulator {
    pulse: Pulse,
    receiver: Receiver,
    record: Record,
    detector: Arc<Detector>,
}

impl fmt::Debug for Simulator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            pulse,
            receiver,
            record,
            ..
        } = self;
        let mut shown = f.debug_struct("Simulator");
        shown
            .field("pulse", pulse)
            .field("receiver", receiver)
            .field("record", record)
            .finish_non_exhaustive()
    }
}

impl Simulator {
    /// Plans the records of `pulse` and `receiver`.
    ///
    /// # Errors
    /// As [`Receiver::validate`]; [`Error::OutOfRange`] for a record without samples or a first
    /// time that is not finite.
    pub fn new(pulse: impl Into<Pulse>, receiver: Receiver, record: Record) -> Result<Self, Error> {
        receiver.validate()?;
        Self::for_baseband(pulse, receiver, record)
    }

    /// Plans complex records, those of `Complex<f64>`: the band may be wider than a real current of
    /// this rate holds.
    ///
    /// # Errors
    /// As [`Simulator::new`], with [`Receiver::validate_baseband`].
    pub fn for_baseband(
        pulse: impl Into<Pulse>,
        receiver: Receiver,
        record: Record,
    ) -> Result<Self, Error> {
        receiver.validate_baseband()?;
        check(
            "time_of_first_sample_s",
            record.time_of_first_sample_s,
            "finite",
            |_| true,
        )?;
        check("samples", record.samples as f64, "1 or more", |n| n >= 1.0)?;
        let interval_s = 1.0 / receiver.sample_rate_hz;
        let mut carrier = Vec::with_capacity(record.samples);
        for k in 0..record.samples {
            let time_s = record.time_of_first_sample_s + k as f64 * interval_s;
            // Without the whole cycles the phase is exact for late samples, too.
            let cycles = receiver.intermediate_frequency_hz * time_s;
            carrier.push(Complex::cis(2.0 * PI * (cycles - cycles.floor())));
        }
        let noise = RealNoise::new(&receiver, record.samples);
        let baseband_noise = BasebandNoise::new(&receiver, record.samples);
        let pulse = pulse.into();
        Ok(Self {
            pulse,
            receiver,
            record,
            detector: Arc::new(Detector {
                carrier,
                noise,
                baseband_noise,
            }),
        })
    }

    /// The pulse.
    pub fn pulse(&self) -> &Pulse {
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

    /// Carrier and noise of the samples.
    pub(crate) fn detector(&self) -> &Detector {
        &self.detector
    }

    /// Time of sample `k` \[s\].
    pub fn time_s(&self, k: usize) -> f64 {
        self.record.time_of_first_sample_s + k as f64 / self.receiver.sample_rate_hz
    }

    /// Writes the samples of one pulse \[A\]: the measured current (12) into `f64`, both
    /// quadratures of the baseband into `Complex<f64>`; see [`Sample`].
    ///
    /// Draws, in this order: for each layer of the line, first to last, the real and the imaginary
    /// part of its speckle (masked and weightless layers too, so that they do not shift the
    /// others); then the noise: none for [`NoiseModel::None`](crate::NoiseModel::None), one normal
    /// number per real number for `White`, two per frequency for `BandLimited`.
    ///
    /// # Errors
    /// As [`Shot::validate`]; [`Error::LengthMismatch`] if `out_a` does not have one element per
    /// sample; [`Error::OutOfRange`] for layers too thick for the pulse, or far thinner than any
    /// use; [`Error::Overflow`]; [`Error::BandBeyondNyquist`] if the simulator was planned for
    /// complex records and a real one does not hold the band.
    pub fn record_into<'a, T: Sample, R: Rng + ?Sized>(
        &self,
        shot: impl Into<Shot<'a>>,
        rng: &mut R,
        scratch: &mut Scratch,
        out_a: &mut [T],
    ) -> Result<(), Error> {
        check_length("out_a", out_a.len(), self.record.samples)?;
        T::check_band(&self.receiver)?;
        let mut envelope_a = std::mem::take(&mut scratch.envelope);
        envelope_a.resize(self.record.samples, Complex::ZERO);
        let result = self.envelope_into(shot, rng, scratch, &mut envelope_a);
        if result.is_ok() {
            T::receive(&self.detector, &envelope_a, out_a);
            T::add_noise(&self.detector, rng, &mut scratch.noise, out_a);
        }
        scratch.envelope = envelope_a;
        result
    }

    /// The samples of one pulse \[A\], as [`Simulator::record_into`] writes them, in
    /// memory of their own.
    ///
    /// # Errors
    /// As [`Simulator::record_into`].
    pub fn record_of<'a, T: Sample, R: Rng + ?Sized>(
        &self,
        shot: impl Into<Shot<'a>>,
        rng: &mut R,
    ) -> Result<Vec<T>, Error> {
        let mut samples_a = vec![T::default(); self.record.samples];
        self.record_into(shot, rng, &mut Scratch::default(), &mut samples_a)?;
        Ok(samples_a)
    }

    /// Writes the complex envelope `s(t_k)` of one pulse, (15), corrected \[A\], without noise;
    /// with the phases of the laser, the reflex of the telescope and the echo of the pulse before,
    /// if the receiver or the shot has them.
    ///
    /// Draws the speckle as [`Simulator::record_into`] does; for the others the shot has a
    /// seed of its own.
    ///
    /// # Errors
    /// As [`Simulator::record_into`].
    pub fn envelope_into<'a, R: Rng + ?Sized>(
        &self,
        shot: impl Into<Shot<'a>>,
        rng: &mut R,
        scratch: &mut Scratch,
        out_a: &mut [Complex<f64>],
    ) -> Result<(), Error> {
        let shot = shot.into();
        shot.validate()?;
        check_length("out_a", out_a.len(), self.record.samples)?;
        let mut speckle = std::mem::take(&mut scratch.speckle);
        draw_speckle(shot.line.layers(), rng, &mut speckle);
        let result = if self.is_plain(&shot) {
            self.sum_into(shot, &speckle, &[], scratch, out_a)
        } else {
            self.sum_with_impairments_into(shot, &speckle, scratch, out_a)
        };
        scratch.speckle = speckle;
        result
    }

    /// Writes the envelope (15) for given speckle amplitudes `g_l` (mean square 1), one
    /// per layer \[A\].
    ///
    /// # Errors
    /// As [`Simulator::record_into`]; [`Error::LengthMismatch`] if there is not one
    /// amplitude per layer.
    pub fn envelope_of_speckle_into<'a>(
        &self,
        shot: impl Into<Shot<'a>>,
        speckle: &[Complex<f64>],
        scratch: &mut Scratch,
        out_a: &mut [Complex<f64>],
    ) -> Result<(), Error> {
        let shot = shot.into();
        check_length("out_a", out_a.len(), self.record.samples)?;
        shot.validate()?;
        check_length("speckle", speckle.len(), shot.line.layers())?;
        self.sum_into(shot, speckle, &[], scratch, out_a)
    }

    /// The sum (15) of a shot that is valid, with one amplitude per layer; `phases` are those of
    /// the laser over the lit layers, none for a quiet one.
    pub(crate) fn sum_into(
        &self,
        shot: Shot<'_>,
        speckle: &[Complex<f64>],
        phases: &[Complex<f64>],
        scratch: &mut Scratch,
        out_a: &mut [Complex<f64>],
    ) -> Result<(), Error> {
        let line = shot.line;
        self.illuminate(line, phases, scratch)?;
        let Scratch {
            window, phasors, ..
        } = scratch;
        phasors.resize(line.layers());
        for (block, outs) in out_a.chunks_mut(RENEWAL_SAMPLES).enumerate() {
            let start = block * RENEWAL_SAMPLES;
            self.renew(shot, speckle, window, phasors, start..start + outs.len());
            for (k, out) in (start..).zip(outs) {
                let envelope = window.amplitudes_at(&self.pulse, line.layer_thickness_m, k);
                let (re, im) = phasors.sum_and_rotate(envelope);
                *out = Complex::new(re, im);
            }
        }
        check_overflow("out_a", out_a.iter().map(|s| s.is_finite()))
    }

    /// `sqrt(2) S sqrt(E_t P_LO) sqrt(DeltaR)`: what `f b_l` is multiplied with in (15)
    /// \[A s^1/2 m^1/2\].
    pub(crate) fn amplitude_gain_a_sqrt_s(&self, line: &LineOfSight) -> f64 {
        let gain = self.receiver.heterodyne_gain_a2_w() * self.pulse.energy_j();
        (gain * line.layer_thickness_m).sqrt()
    }

    /// Phase of layer velocity `v` per second, `-4 pi v/lambda` \[rad/s\].
    pub(crate) fn phase_rate_rad_s(&self, radial_velocity_m_s: f64) -> f64 {
        -4.0 * PI * radial_velocity_m_s / self.receiver.wavelength_m
    }

    /// Finds which layers of a line the pulse lights at each sample; `phases` as in
    /// [`Simulator::sum_into`].
    pub(crate) fn illuminate(
        &self,
        line: &LineOfSight,
        phases: &[Complex<f64>],
        scratch: &mut Scratch,
    ) -> Result<(), Error> {
        scratch.window.prepare(
            &self.pulse,
            line,
            phases,
            &self.record,
            self.receiver.sample_rate_hz,
        )
    }

    /// Sets the phasors of all layers that are lit in some samples, each as it is at the first of
    /// them that lights it, and their rotation per sample; nothing returns from a masked layer.
    fn renew(
        &self,
        shot: Shot<'_>,
        speckle: &[Complex<f64>],
        window: &Window,
        phasors: &mut Phasors,
        samples: Range<usize>,
    ) {
        let line = shot.line;
        let gain = self.amplitude_gain_a_sqrt_s(line);
        let interval_s = 1.0 / self.receiver.sample_rate_hz;
        let mut next = window.layers_at(samples.start).0;
        for k in samples {
            let time_s = self.time_s(k);
            let (first, end) = window.layers_at(k);
            let lit = next.max(first).min(end)..end;
            for (layer, g) in lit.clone().zip(&speckle[lit]) {
                let amplitude = gain * shot.weight_per_m(layer).sqrt() * g;
                let rate_rad_s = self.phase_rate_rad_s(line.radial_velocity_m_s[layer]);
                let mut phasor = Complex::ZERO;
                let mut rotation = Complex::ONE;
                if !rate_rad_s.is_nan() {
                    phasor = amplitude * Complex::cis(rate_rad_s * time_s);
                    rotation = Complex::cis(rate_rad_s * interval_s);
                }
                phasors.re[layer] = phasor.re;
                phasors.im[layer] = phasor.im;
                phasors.rotation_re[layer] = rotation.re;
                phasors.rotation_im[layer] = rotation.im;
            }
            next = next.max(end);
        }
    }
}

/// Circular complex normal numbers of mean square 1.
pub(crate) fn draw_speckle<R: Rng + ?Sized>(
    layers: usize,
    rng: &mut R,
    out: &mut Vec<Complex<f64>>,
) {
    out.clear();
    out.extend((0..layers).map(|_| {
        let re: f64 = rng.sample(StandardNormal);
        let im: f64 = rng.sample(StandardNormal);
        Complex::new(re, im) * FRAC_1_SQRT_2
    }));
}
