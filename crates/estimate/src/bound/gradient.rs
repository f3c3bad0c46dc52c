//! A window of wind that changes linearly along the line of sight: its covariance, and the bound on velocity and gradient together.
//!
//! With v(R) = v + g (R - R_c) and a Gaussian pulse, |f|^2 ~ exp(-t^2 / sigma^2), the covariance of the complex
//! signal at the times t_1, t_2 from the centre of the window is exp(-tau^2 / (4 sigma^2) - (k g c sigma tau / 4)^2)
//! exp(-j k (v + g c (t_1 + t_2) / 4) tau), tau = t_1 - t_2, k = 4 pi / lambda: a chirp, and a spectrum that is
//! broader by the spread of velocities in the pulse (Frehlich 1997 calls it shear broadening). Check: the sum over
//! layers, difference quotients, and g = 0.

use ndarray::Array2;
use num_complex::Complex;

use crate::bound::Noise;
use crate::bound::window_model::{Carrier, information, with_floor_named};
use crate::error::{Error, at_least_one, finite, positive};
use crate::window::{SPEED_OF_LIGHT_M_S, Sampling, SignalKind};

/// Second-order model of a window of a Gaussian pulse in a wind with a constant gradient along the line of sight.
#[derive(Debug, Clone)]
pub struct GradientModel {
    pub(crate) sampling: Sampling,
    pub(crate) window_samples: usize,
    pulse_sigma_s: f64,
    pub(crate) noise: Noise,
}

/// What bounds the estimates of velocity and gradient from the same windows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GradientBound {
    /// Standard deviation of the velocity at the centre of the window when the gradient is unknown too \[m/s\].
    pub velocity_m_s: f64,
    /// Standard deviation of the gradient when the velocity is unknown too \[1/s\].
    pub gradient_per_s: f64,
    /// Standard deviation of the velocity if the gradient were known \[m/s\].
    pub velocity_alone_m_s: f64,
}

impl GradientModel {
    /// Windows of `window_samples` samples; `pulse_sigma_s` is the half-width of |f|^2 at 1/e \[s\].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] or [`Error::Band`] for a pulse, window, noise or sampling that makes no sense.
    pub fn new(
        sampling: &Sampling,
        window_samples: usize,
        pulse_sigma_s: f64,
        noise: Noise,
    ) -> Result<Self, Error> {
        sampling.validate()?;
        positive("pulse_sigma_s", pulse_sigma_s)?;
        noise.validate()?;
        at_least_one("window_samples", window_samples)?;
        Ok(Self {
            sampling: *sampling,
            window_samples,
            pulse_sigma_s,
            noise,
        })
    }

    /// Signal covariance at rest with unit power and its derivative per 1/s of gradient, with the carrier removed.
    ///
    /// The centre of the window is N/2 samples after its first one, as [`Gates`](crate::Gates) counts ranges.
    pub(crate) fn envelope(&self, gradient_per_s: f64) -> [Array2<Complex<f64>>; 2] {
        let wave = 4.0 * std::f64::consts::PI / self.sampling.wavelength_m;
        let half_speed = 0.5 * SPEED_OF_LIGHT_M_S;
        let period_s = self.sampling.period_s();
        let shape = (self.window_samples, self.window_samples);
        let parts = |(n, m): (usize, usize)| {
            let tau_s = (n as f64 - m as f64) * period_s;
            let middle_s = 0.5 * (n as f64 + m as f64 - self.window_samples as f64) * period_s;
            // phase and logarithm of the broadening per 1/s of gradient, and per its square
            let phase = -wave * half_speed * middle_s * tau_s;
            let broadening = -(0.5 * wave * half_speed * self.pulse_sigma_s * tau_s).powi(2);
            let pulse = -(0.5 * tau_s / self.pulse_sigma_s).powi(2);
            let value = Complex::from_polar(
                (pulse + broadening * gradient_per_s.powi(2)).exp(),
                phase * gradient_per_s,
            );
            [
                value,
                value * Complex::new(2.0 * broadening * gradient_per_s, phase),
            ]
        };
        let both = Array2::from_shape_fn(shape, parts);
        [0, 1].map(|k| both.mapv(|pair| pair[k]))
    }

    fn carrier(&self, velocity_m_s: f64, snr: f64, kind: SignalKind) -> Result<Carrier, Error> {
        Carrier::new(
            (&self.sampling, self.noise),
            self.window_samples,
            velocity_m_s,
            (1.0, snr),
            kind,
        )
    }

    /// Covariance of samples of unit signal power, from the [`envelope`](Self::envelope) of a gradient.
    ///
    /// # Errors
    /// As [`GradientModel::covariance`].
    pub(crate) fn of_samples(
        &self,
        envelope: &Array2<Complex<f64>>,
        velocity_m_s: f64,
        snr: f64,
        kind: SignalKind,
    ) -> Result<Array2<Complex<f64>>, Error> {
        let carrier = self.carrier(velocity_m_s, snr, kind)?;
        let covariance = carrier.covariance(carrier.signal(envelope));
        Ok(match kind {
            SignalKind::Real => covariance.mapv(|value| Complex::from(value.re)),
            SignalKind::Complex => covariance,
        })
    }

    /// Covariance and its derivatives with respect to velocity \[per m/s\] and gradient \[per 1/s\], complex samples
    /// of unit signal power.
    ///
    /// `snr` is signal power over noise power in the detector band.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if `snr` is not above 0 or velocity or gradient is not finite.
    pub fn covariance(
        &self,
        velocity_m_s: f64,
        gradient_per_s: f64,
        snr: f64,
        kind: SignalKind,
    ) -> Result<[Array2<Complex<f64>>; 3], Error> {
        finite("gradient_per_s", gradient_per_s)?;
        let carrier = self.carrier(velocity_m_s, snr, kind)?;
        let [signal, by_gradient] = self
            .envelope(gradient_per_s)
            .map(|envelope| carrier.signal(&envelope));
        let by_velocity = carrier.by_velocity(&signal);
        Ok([carrier.covariance(signal), by_velocity, by_gradient])
    }

    /// Bounds for `windows` independent windows.
    ///
    /// # Errors
    /// As [`GradientModel::covariance`] and [`bound_m_s`](crate::bound::bound_m_s); [`Error::NoiseFloor`] for too small a floor of the noise.
    pub fn bound(
        &self,
        velocity_m_s: f64,
        gradient_per_s: f64,
        snr: f64,
        kind: SignalKind,
        windows: f64,
    ) -> Result<GradientBound, Error> {
        with_floor_named(self.noise, self.window_samples, |noise| {
            positive("windows", windows)?;
            let model = Self {
                noise,
                ..self.clone()
            };
            let [covariance, by_velocity, by_gradient] =
                model.covariance(velocity_m_s, gradient_per_s, snr, kind)?;
            let information =
                information(kind, &covariance, &[by_velocity, by_gradient])? * windows;
            let [vv, vg, gg] = [
                information[[0, 0]],
                information[[0, 1]],
                information[[1, 1]],
            ];
            let determinant = vv * gg - vg * vg;
            positive("information on velocity", vv)?;
            // what is left after rounding of the two products
            positive(
                "information on velocity and gradient apart",
                determinant - 8.0 * f64::EPSILON * vv * gg,
            )?;
            Ok(GradientBound {
                velocity_m_s: (gg / determinant).sqrt(),
                gradient_per_s: (vv / determinant).sqrt(),
                velocity_alone_m_s: vv.sqrt().recip(),
            })
        })
    }
}
