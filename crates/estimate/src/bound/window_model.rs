//! Cramer-Rao bound on the velocity of Gaussian windows with a given covariance.
//!
//! Computes 1 / sqrt(tr(R^-1 dR R^-1 dR)) for circular complex windows and 1 / sqrt(tr(R^-1 dR R^-1 dR) / 2) for real ones, R the
//! covariance of the samples and dR its derivative with respect to velocity (Kay 1993, section 3.9; Rye and Hardesty
//! 1993). n independent windows lower it by sqrt(n). Check: a stored curve for a 200 ns pulse over -40 to
//! 60 dB; a point target of known closed form; any difference quotient of the covariance.

use ndarray::Array2;
use ndarray_linalg::{Lapack, Scalar};
use num_complex::Complex;

use super::extended::GaussianWindow;
use crate::error::{Error, check, finite, length, not_empty, positive};
use crate::linalg::hermitian_eigen;
use crate::window::{Sampling, SignalKind};

/// Bound on the standard deviation of velocity \[m/s\] from one or more independent Gaussian windows.
///
/// `covariance` \[n, n\] = E{x x^H} and `derivative` \[n, n\], its derivative per m/s, in any common unit, of real samples the real
/// parts; `windows` counts independent windows and may be an effective number.
///
/// # Errors
/// [`Error::IllConditioned`] if the covariance is singular in double precision, [`Error::Length`] if shapes differ,
/// [`Error::OutOfRange`] if nothing depends on velocity.
pub fn bound_m_s(
    kind: SignalKind,
    covariance: &Array2<Complex<f64>>,
    derivative: &Array2<Complex<f64>>,
    windows: f64,
) -> Result<f64, Error> {
    from_information(information(kind, covariance, derivative)?, windows)
}

/// Fisher information of one window on a parameter: tr(R^-1 dR R^-1 dR) if circular complex, half of that if real.
fn information(
    kind: SignalKind,
    covariance: &Array2<Complex<f64>>,
    derivative: &Array2<Complex<f64>>,
) -> Result<f64, Error> {
    if kind == SignalKind::Complex {
        return trace(covariance, derivative);
    }
    let covariance = covariance.mapv(|value| value.re);
    let derivative = derivative.mapv(|value| value.re);
    Ok(kind.one_sided_share() * trace(&covariance, &derivative)?)
}

/// Least reciprocal condition of a covariance that is inverted, per unit of its order.
///
/// Rounding changes the smallest eigenvalue by the order times the unit of rounding. At this limit the bound of a 200 ns pulse
/// in 64 samples at 0 dB is right to some 1e-4, at a fifth of it to 4e-3, both held against 60 digits; there it soon
/// loses all meaning.
pub(super) const LEAST_CONDITION: f64 = 32.0 * f64::EPSILON;

/// tr(R^-1 dR R^-1 dR), unless R is no covariance or too near a singular matrix.
fn trace<T: Scalar<Real = f64> + Lapack>(
    covariance: &Array2<T>,
    derivative: &Array2<T>,
) -> Result<f64, Error> {
    let what = "covariance";
    let order = covariance.nrows();
    length(what, order, covariance.ncols())?;
    let mut asymmetry: f64 = 0.0;
    let mut largest: f64 = 0.0;
    for ((i, j), value) in covariance.indexed_iter() {
        asymmetry = asymmetry.max((*value - covariance[[j, i]].conj()).abs());
        largest = largest.max(value.abs());
    }
    check(
        "covariance minus its adjoint",
        asymmetry,
        "0 up to rounding",
        asymmetry <= 1e-10 * largest,
    )?;
    let least = LEAST_CONDITION * order as f64;
    // in its eigenvectors the inverse is a division by each eigenvalue
    let (values, vectors) = hermitian_eigen(what, covariance.view())?;
    let reciprocal_condition = (values[0] / values[order - 1]).max(0.0);
    if reciprocal_condition < least {
        return Err(Error::IllConditioned {
            what,
            order,
            reciprocal_condition,
            least,
        });
    }
    length("derivative", order, derivative.nrows())?;
    length("derivative", order, derivative.ncols())?;
    let adjoint = vectors.t().mapv(|value| value.conj());
    let turned = adjoint.dot(derivative).dot(&vectors);
    let mut sum = 0.0;
    for ((n, m), value) in turned.indexed_iter() {
        sum += (*value * turned[[m, n]]).re() / (values[n] * values[m]);
    }
    Ok(sum)
}

/// `bound` with the given noise; where its floor makes the covariance singular, the error names a floor that is large enough.
///
/// The smallest eigenvalue of the covariance is the floor's, so that the condition is proportional to it.
fn with_floor_named(
    noise: Noise,
    window_samples: usize,
    bound: &dyn Fn(Noise) -> Result<f64, Error>,
) -> Result<f64, Error> {
    let found = bound(noise);
    let Noise::Band { floor } = noise else {
        return found;
    };
    let Err(Error::IllConditioned {
        reciprocal_condition,
        least,
        ..
    }) = found
    else {
        return found;
    };
    let mut tried = (least * f64::EPSILON).max(floor);
    while tried < 1.0 {
        // up to two digits
        let digit = 10f64.powf(tried.log10().floor() - 1.0);
        let rounded = ((tried / digit).ceil() * digit).min(1.0);
        let printed = format!("{rounded:.1e}").parse().unwrap_or(rounded);
        match bound(Noise::Band { floor: printed }) {
            Ok(_) => {
                return Err(Error::NoiseFloor {
                    floor,
                    window_samples,
                    reciprocal_condition,
                    least: printed,
                });
            }
            Err(Error::IllConditioned { .. }) => tried = printed * 1.5,
            Err(_) => break,
        }
    }
    found
}

fn from_information(information: f64, windows: f64) -> Result<f64, Error> {
    positive("windows", windows)?;
    positive("information on velocity", information)?;
    Ok((information * windows).sqrt().recip())
}

/// Spectrum of the noise around a signal.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Noise {
    /// The same density at all frequencies of the samples as in the detector band.
    White,
    /// Flat in the detector band and `floor` times that density outside it.
    ///
    /// A floor so small that the covariance is singular in double precision has no bound ([`Error::NoiseFloor`]): for 64
    /// samples at 0 dB about 1e-11 is the least, and 1e-14 for a Gaussian pulse, which is computed in numbers of twice the
    /// length where it must.
    Band {
        /// Density outside the band over density inside, 0 .. 1.
        floor: f64,
    },
}

impl Noise {
    /// Checks the floor.
    pub(crate) fn validate(self) -> Result<(), Error> {
        let Self::Band { floor } = self else {
            return Ok(());
        };
        check(
            "floor",
            floor,
            "between 0 and 1",
            (0.0..=1.0).contains(&floor),
        )
    }

    /// Covariance of the noise, complex and for two-sided density 1 in the band, at a lag \[samples\].
    pub(crate) fn covariance(
        self,
        sampling: &Sampling,
        lag: f64,
        kind: SignalKind,
    ) -> Complex<f64> {
        let low = sampling.band_hz.0 / sampling.sample_rate_hz;
        let high = sampling.band_hz.1 / sampling.sample_rate_hz;
        let white = if lag == 0.0 {
            kind.one_sided_share()
        } else {
            0.0
        };
        let in_band = match lag {
            0.0 => Complex::new(high - low, 0.0),
            _ => {
                let half = turned(0.5 * (high - low), lag);
                Complex::from_polar(
                    half.sin() / (std::f64::consts::PI * lag),
                    turned(0.5 * (high + low), lag),
                )
            }
        };
        match self {
            Self::White => Complex::new(white, 0.0),
            Self::Band { floor } => in_band * (1.0 - floor) + white * floor,
        }
    }

    /// The mean correlogram of noise of that `power` in the detector band, for windows that give their lags
    /// `lag_weights`; stored as [`SignalKind::lag_numbers`] says.
    ///
    /// The power that an estimator finds in it is that of the noise in its spectra.
    ///
    /// # Errors
    /// [`Error::Band`] for an impossible band, [`Error::OutOfRange`] for a power that is not above 0.
    pub fn expected_correlogram(
        self,
        sampling: &Sampling,
        kind: SignalKind,
        power: f64,
        lag_weights: &[f64],
    ) -> Result<Vec<f64>, Error> {
        sampling.validate_for(kind)?;
        positive("power", power)?;
        let unit = power * sampling.sample_rate_hz / (sampling.band_hz.1 - sampling.band_hz.0);
        let mut numbers = Vec::with_capacity(kind.lag_numbers(lag_weights.len()));
        for (m, weight) in lag_weights.iter().enumerate() {
            let lag = self.covariance(sampling, m as f64, kind) * (unit * weight);
            numbers.push(lag.re);
            if kind == SignalKind::Complex {
                numbers.push(lag.im);
            }
        }
        Ok(numbers)
    }
}

/// Angle that `cycles` per sample turn in `lag` samples, without whole turns: right to rounding however long the window.
///
/// The product alone is off by the rounding of all its turns, which a nearly singular covariance shows.
pub(crate) fn turned(cycles: f64, lag: f64) -> f64 {
    let product = cycles * lag;
    let rest = cycles.mul_add(lag, -product);
    std::f64::consts::TAU * (product - product.round() + rest)
}

/// Mean of the diagonal of an envelope; 0 without samples.
fn mean_power(envelope: &Array2<Complex<f64>>) -> f64 {
    let powers = envelope.diag().mapv(|value| value.re);
    powers.mean().unwrap_or(0.0)
}

/// Second-order model of a window: signal envelope, carrier, and noise at a given SNR.
///
/// R(n, m) = envelope(n, m) exp(j 2 pi f (t_n - t_m)) + noise, with f from (30); real samples take the real part.
#[derive(Debug, Clone)]
pub struct WindowModel {
    pub(crate) sampling: Sampling,
    envelope: Array2<Complex<f64>>,
    /// Half-width at 1/e of a Gaussian pulse \[s\], whose covariance is known beyond double precision.
    gaussian_sigma_s: Option<f64>,
    noise: Noise,
}

impl WindowModel {
    /// Gaussian pulse in uniform wind: envelope exp(-tau^2 / (4 sigma^2)).
    ///
    /// `pulse_sigma_s` is the half-width of |f|^2 at 1/e \[s\]: the full width at half maximum over 2 sqrt(ln 2).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] or [`Error::Band`] for a pulse, window, noise or sampling that makes no sense.
    pub fn gaussian_pulse(
        sampling: &Sampling,
        window_samples: usize,
        pulse_sigma_s: f64,
        noise: Noise,
    ) -> Result<Self, Error> {
        positive("pulse_sigma_s", pulse_sigma_s)?;
        let envelope = Array2::from_shape_fn((window_samples, window_samples), |(n, m)| {
            let lag_s = (n as f64 - m as f64) * sampling.period_s();
            Complex::from((-0.25 * (lag_s / pulse_sigma_s).powi(2)).exp())
        });
        Ok(Self {
            gaussian_sigma_s: Some(pulse_sigma_s),
            ..Self::with_envelope(sampling, envelope, noise)?
        })
    }

    /// Point target with a deterministic amplitude a(n) in the window and a random phase and strength: envelope a(n) a(m).
    ///
    /// # Errors
    /// As [`WindowModel::gaussian_pulse`].
    pub fn point_target(
        sampling: &Sampling,
        amplitude: &[f64],
        noise: Noise,
    ) -> Result<Self, Error> {
        let window_samples = amplitude.len();
        let envelope = Array2::from_shape_fn((window_samples, window_samples), |(n, m)| {
            Complex::from(amplitude[n] * amplitude[m])
        });
        Self::with_envelope(sampling, envelope, noise)
    }

    /// Any Hermitian envelope \[n, m\] = E{x(t_n) x*(t_m)} of the covariance, its carrier removed; it is real for a pulse with a
    /// symmetric spectrum.
    ///
    /// # Errors
    /// [`Error::Empty`], [`Error::Length`], [`Error::Band`] or [`Error::OutOfRange`] for impossible input.
    pub fn with_envelope(
        sampling: &Sampling,
        envelope: Array2<Complex<f64>>,
        noise: Noise,
    ) -> Result<Self, Error> {
        sampling.validate()?;
        not_empty("envelope", envelope.len())?;
        length("envelope", envelope.nrows(), envelope.ncols())?;
        positive("mean of the envelope's diagonal", mean_power(&envelope))?;
        noise.validate()?;
        Ok(Self {
            sampling: *sampling,
            envelope,
            gaussian_sigma_s: None,
            noise,
        })
    }

    /// The envelope of the covariance \[n, m\].
    #[must_use]
    pub fn envelope(&self) -> &Array2<Complex<f64>> {
        &self.envelope
    }

    /// Covariance and its derivative with respect to velocity \[per m/s\], complex samples.
    ///
    /// `snr` is signal power (mean over the window) over noise power in the detector band. The signal keeps the unit
    /// of the envelope.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if `snr` is not above 0 or the velocity not finite.
    pub fn covariance(
        &self,
        velocity_m_s: f64,
        snr: f64,
        kind: SignalKind,
    ) -> Result<[Array2<Complex<f64>>; 2], Error> {
        positive("snr", snr)?;
        finite("velocity_m_s", velocity_m_s)?;
        let sampling = &self.sampling;
        sampling.validate_for(kind)?;
        let samples = self.envelope.nrows();
        let power = mean_power(&self.envelope);
        let cycles = sampling.frequency_hz(velocity_m_s) * sampling.period_s();
        let bandwidth = (sampling.band_hz.1 - sampling.band_hz.0) / sampling.sample_rate_hz;
        let density = power / (snr * bandwidth);
        // At the lags from -(N - 1) to N - 1.
        let mut carrier = Vec::with_capacity(2 * samples);
        let mut noise = Vec::with_capacity(2 * samples);
        let longest = samples as i64 - 1;
        for lag in -longest..=longest {
            let lag = lag as f64;
            carrier.push(Complex::from_polar(1.0, turned(cycles, lag)));
            noise.push(self.noise.covariance(sampling, lag, kind) * density);
        }
        let phase_slope = sampling.phase_slope();
        let mut covariance = Array2::zeros(self.envelope.dim());
        let mut derivative = Array2::zeros(self.envelope.dim());
        for ((n, m), &envelope) in self.envelope.indexed_iter() {
            let lag = n + samples - 1 - m;
            let signal = carrier[lag] * envelope;
            let turn = Complex::new(0.0, phase_slope * (n as f64 - m as f64));
            covariance[(n, m)] = signal + noise[lag];
            derivative[(n, m)] = signal * turn;
        }
        Ok([covariance, derivative])
    }

    /// Bound on the standard deviation of velocity \[m/s\] for `windows` independent windows.
    ///
    /// # Errors
    /// As [`WindowModel::covariance`] and [`bound_m_s`]; [`Error::NoiseFloor`] for too small a floor of the noise.
    pub fn bound_m_s(
        &self,
        velocity_m_s: f64,
        snr: f64,
        kind: SignalKind,
        windows: f64,
    ) -> Result<f64, Error> {
        with_floor_named(self.noise, self.envelope.nrows(), &|noise| {
            let model = Self {
                noise,
                ..self.clone()
            };
            let [covariance, derivative] = model.covariance(velocity_m_s, snr, kind)?;
            let found = bound_m_s(kind, &covariance, &derivative, windows);
            let Err(Error::IllConditioned { .. }) = found else {
                return found;
            };
            let Noise::Band { floor } = noise else {
                return found;
            };
            let Some(sigma_s) = self.gaussian_sigma_s else {
                return found;
            };
            let window = GaussianWindow {
                sampling: &self.sampling,
                samples: self.envelope.nrows(),
                sigma_s,
                floor,
                velocity_m_s,
                snr,
                kind,
            };
            match window.information() {
                Some(information) => {
                    from_information(kind.one_sided_share() * information, windows)
                }
                None => found,
            }
        })
    }
}
