//! Autoregressive models (31) of a correlogram or a window, and their spectrum (32).
//!
//! Computes the coefficients by the Yule-Walker equations with the Levinson-Durbin recursion, or by Burg's method (Kay 1988,
//! chapter 7). The biased correlogram is positive semi-definite, so its model is stable: all
//! reflection coefficients lie inside the unit circle. Check: the Yule-Walker equations themselves, a stored window, and
//! that a model's own correlogram returns the model.
//!
//! A pure tone never makes the biased equations singular (its prediction error is a few per cent of the power) but
//! shifts the peak by up to 0.13 m/s; a correlogram without power has no model. The unbiased correlogram may be
//! indefinite and is then refused.

use num_complex::Complex;

use crate::error::{Error, check, not_empty, positive};
use crate::models::levinson::reflect;
use crate::models::poles::roots;
use crate::window::missing::Rule;
use crate::window::{Sample, Sampling, SignalKind};

/// How the order of a model is found, from the prediction errors of all orders up to a largest one.
///
/// Both criteria weigh n ln(prediction error) against the number of coefficients p, with n the number of independent
/// samples behind the correlogram (those of one window times [`n_eff`](crate::map::MapPoint::n_eff)).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum OrderChoice {
    /// The given order.
    Fixed,
    /// Least n ln(error) + 2 p (Akaike 1974): AIC.
    Akaike {
        /// n.
        samples: f64,
    },
    /// Least n ln(error) + p ln n (Rissanen 1978): MDL, which does not overestimate the order of a long record.
    DescriptionLength {
        /// n.
        samples: f64,
    },
}

impl OrderChoice {
    /// The order with the least value of the criterion, 1 .. p, from the reflection coefficients of all p stages.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the number of samples is not above 0, [`Error::Empty`] without stages.
    pub fn order(&self, reflection: &[Complex<f64>]) -> Result<usize, Error> {
        not_empty("reflection", reflection.len())?;
        let (samples, penalty) = match *self {
            Self::Fixed => return Ok(reflection.len()),
            Self::Akaike { samples } => (samples, 2.0),
            Self::DescriptionLength { samples } => (samples, samples.ln()),
        };
        positive("samples", samples)?;
        let (mut best, mut least, mut value) = (1, f64::INFINITY, 0.0);
        for (stage, k) in reflection.iter().enumerate() {
            // a pure line leaves no error: the logarithm stays finite
            value += samples * (1.0 - k.norm_sqr()).max(f64::MIN_POSITIVE).ln() + penalty;
            if value < least {
                (best, least) = (stage + 1, value);
            }
        }
        Ok(best)
    }
}

/// x(n) = - sum over k = 1 .. p of a_k x(n-k) + w(n), w white noise.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Autoregression {
    /// a_1 .. a_p; the imaginary parts are 0 for real signals.
    pub coefficients: Vec<Complex<f64>>,
    /// Reflection coefficients of the stages 1 .. p.
    pub reflection: Vec<Complex<f64>>,
    /// Variance of w, in signal units squared.
    pub noise_power: f64,
}

impl Autoregression {
    /// Model of order `order` from a correlogram (stored as [`SignalKind::lag_numbers`] says).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the order is 0 or not below the number of lags, if there is no power, or if the
    /// correlogram is not positive definite.
    pub fn yule_walker(correlogram: &[f64], kind: SignalKind, order: usize) -> Result<Self, Error> {
        let mut model = Self::default();
        model.fit(correlogram, kind, order, &mut Vec::with_capacity(4 * order))?;
        Ok(model)
    }

    /// The same into this model, without allocation once its vectors and `work` have grown.
    ///
    /// # Errors
    /// As [`Autoregression::yule_walker`]; the model is then unspecified.
    pub fn fit(
        &mut self,
        correlogram: &[f64],
        kind: SignalKind,
        order: usize,
        work: &mut Vec<f64>,
    ) -> Result<(), Error> {
        check_order(order, correlogram.len() / kind.lag_numbers(1))?;
        self.coefficients.clear();
        self.reflection.clear();
        self.noise_power = kind.lag(correlogram, 0).re;
        positive("lag 0 of the correlogram", self.noise_power)?;
        match kind {
            SignalKind::Real => {
                let found = reflect(correlogram, order, work).map_err(unstable)?;
                self.coefficients
                    .extend(found.coefficients.iter().map(|a| Complex::from(*a)));
                self.reflection
                    .extend(found.reflection.iter().map(|k| Complex::from(*k)));
                self.noise_power = found.noise_power;
            }
            SignalKind::Complex => {
                for m in 1..=order {
                    let past = self.coefficients.iter().enumerate();
                    let forward: Complex<f64> = past
                        .map(|(j, a)| a * kind.lag(correlogram, m - 1 - j))
                        .sum();
                    let reflection = -(kind.lag(correlogram, m) + forward) / self.noise_power;
                    let size = reflection.norm();
                    if size.is_nan() || size >= 1.0 {
                        return Err(unstable(size));
                    }
                    self.update(reflection);
                }
            }
        }
        Ok(())
    }

    /// The model of a lower order of the same signal, from the first reflection coefficients.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the order is 0 or above that of this model.
    pub fn truncated(&self, order: usize) -> Result<Self, Error> {
        check_order(order, self.order() + 1)?;
        let errors = self.reflection.iter().map(|k| 1.0 - k.norm_sqr());
        let mut model = Self {
            noise_power: self.noise_power / errors.product::<f64>(),
            ..Self::default()
        };
        self.reflection[..order]
            .iter()
            .for_each(|k| model.update(*k));
        Ok(model)
    }

    /// Model of order `order` of one window by Burg's method: forward and backward prediction errors together.
    ///
    /// Exact for a complex tone. The peak of a real tone moves with its phase by up to a tenth of F_s / N (0.3 m/s for 64
    /// samples), a known property of the method.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the order is 0 or not below the number of samples, or if there is no power.
    pub fn burg<S: Sample>(window: &[S], order: usize) -> Result<Self, Error> {
        check_order(order, window.len())?;
        let scale = Rule::NOT_FINITE
            .binary_scale(window.iter().copied())
            .unwrap_or(1.0);
        let scaled = |sample: &S| sample.scaled(scale.recip()).to_complex();
        let mut forward: Vec<Complex<f64>> = window.iter().map(scaled).collect();
        let mut backward = forward.clone();
        let power = forward.iter().map(|x| x.norm_sqr()).sum::<f64>() / window.len() as f64;
        positive("power of the window", power)?;
        let mut model = Self {
            noise_power: power,
            ..Self::default()
        };
        for m in 1..=order {
            let pairs = || forward[m..].iter().zip(&backward[m - 1..window.len() - 1]);
            let cross: Complex<f64> = pairs().map(|(f, b)| f * b.conj()).sum();
            let energy: f64 = pairs().map(|(f, b)| f.norm_sqr() + b.norm_sqr()).sum();
            // nothing left to predict: the model is complete
            let reflection = if energy > power * f64::EPSILON {
                -2.0 * cross / energy
            } else {
                Complex::ZERO
            };
            for n in (m..window.len()).rev() {
                let (f, b) = (forward[n], backward[n - 1]);
                forward[n] = f + reflection * b;
                backward[n] = b + reflection.conj() * f;
            }
            model.update(reflection);
        }
        model.noise_power *= scale * scale;
        Ok(model)
    }

    /// The Levinson update of coefficients and noise power.
    fn update(&mut self, reflection: Complex<f64>) {
        let count = self.coefficients.len();
        for j in 0..count.div_ceil(2) {
            let (low, high) = (self.coefficients[j], self.coefficients[count - 1 - j]);
            self.coefficients[j] = low + reflection * high.conj();
            if j != count - 1 - j {
                self.coefficients[count - 1 - j] = high + reflection * low.conj();
            }
        }
        self.coefficients.push(reflection);
        self.reflection.push(reflection);
        self.noise_power *= (1.0 - reflection.norm_sqr()).max(0.0);
    }

    /// Order p.
    #[must_use]
    pub fn order(&self) -> usize {
        self.coefficients.len()
    }

    /// Density (32) at `frequency_hz`, in signal units squared; white noise has its variance.
    #[must_use]
    pub fn density(&self, frequency_hz: f64, sampling: &Sampling) -> f64 {
        let step = Complex::from_polar(
            1.0,
            -std::f64::consts::TAU * frequency_hz / sampling.sample_rate_hz,
        );
        // Horner from the highest coefficient
        let sum = self
            .coefficients
            .iter()
            .rev()
            .fold(Complex::ZERO, |sum, a| (sum + a) * step);
        self.noise_power / (sum + 1.0).norm_sqr()
    }

    /// Poles: the p roots of z^p + a_1 z^(p-1) + ... + a_p, in no order.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if a coefficient is not finite or the roots do not settle.
    pub fn poles(&self) -> Result<Vec<Complex<f64>>, Error> {
        roots(&self.coefficients).ok_or(Error::OutOfRange {
            field: "coefficients",
            value: self
                .coefficients
                .iter()
                .map(|a| a.norm())
                .fold(0.0, f64::max),
            allowed: "finite, with roots that can be told apart",
        })
    }

    /// The pole nearest to the unit circle among those whose frequency lies in the detector band: frequency \[Hz\] and modulus.
    ///
    /// `None` if the band holds no pole.
    ///
    /// # Errors
    /// As [`Autoregression::poles`].
    pub fn nearest_pole(&self, sampling: &Sampling) -> Result<Option<(f64, f64)>, Error> {
        let (low_hz, high_hz) = sampling.band_hz;
        let places = self.poles()?.into_iter().map(|pole| {
            let (modulus, angle) = pole.to_polar();
            (
                angle / std::f64::consts::TAU * sampling.sample_rate_hz,
                modulus,
            )
        });
        let inside = places.filter(|(frequency_hz, _)| (low_hz..=high_hz).contains(frequency_hz));
        Ok(inside.max_by(|a, b| a.1.total_cmp(&b.1)))
    }

    /// The correlogram whose transform is |A|^2 / noise power, or with `capon` e^H R^-1 e / (p + 1) with R of order p + 1.
    ///
    /// The second is the sum of |A|^2 / noise power over the models of orders 0 .. p, collected by Musicus (1985).
    pub(crate) fn inverse_lags(&self, kind: SignalKind, capon: bool, out: &mut Vec<f64>) {
        let order = self.order();
        let a = |k: usize| {
            if k == 0 {
                Complex::ONE
            } else {
                self.coefficients[k - 1]
            }
        };
        out.clear();
        for m in 0..=order {
            let weight = |k: usize| {
                if capon {
                    (order + 1 - m) as f64 - 2.0 * k as f64
                } else {
                    1.0
                }
            };
            let lag: Complex<f64> = (0..=order - m)
                .map(|k| a(k + m) * a(k).conj() * weight(k))
                .sum();
            let scale = if capon {
                1.0 / ((order + 1) as f64 * self.noise_power)
            } else {
                1.0 / self.noise_power
            };
            out.extend(
                [lag.re * scale, lag.im * scale]
                    .into_iter()
                    .take(kind.lag_numbers(1)),
            );
        }
    }
}

/// The error of a reflection coefficient of that size.
fn unstable(size: f64) -> Error {
    Error::OutOfRange {
        field: "reflection coefficient",
        value: size,
        allowed: "below 1: the correlogram is not positive definite (is it the biased one?)",
    }
}

/// An order needs at least one lag more than itself.
pub(crate) fn check_order(order: usize, lags: usize) -> Result<(), Error> {
    let allowed = "at least 1 and below the number of samples of the window";
    check("order", order as f64, allowed, (1..lags).contains(&order))
}
