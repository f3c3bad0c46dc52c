//! Autoregressive models (31) of a correlogram, and their spectrum (32).
//!
//! Computes the coefficients by the Yule-Walker equations with the Levinson-Durbin recursion (Kay 1988, chapter 7). The biased
//! correlogram is positive semi-definite, so its model is stable: all reflection coefficients lie inside the unit circle. Check:
//! the Yule-Walker equations themselves, a stored window, and that a model's own correlogram returns the model.
//!
//! A pure tone never makes the biased equations singular (its prediction error is a few per cent of the power) but
//! shifts the peak by up to 0.13 m/s; a correlogram without power has no model. One that is indefinite is refused.

use num_complex::Complex;

use crate::error::{Error, check, positive};
use crate::models::levinson::reflect;
use crate::window::{Sampling, SignalKind};

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

    /// Replaces this model by that of [`Autoregression::yule_walker`], without allocation once its vectors and `work` have grown.
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
                let (coefficients, reflection, noise_power) =
                    reflect(correlogram, order, work).map_err(unstable)?;
                self.coefficients
                    .extend(coefficients.iter().map(|a| Complex::from(*a)));
                self.reflection
                    .extend(reflection.iter().map(|k| Complex::from(*k)));
                self.noise_power = noise_power;
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

    /// The Levinson update of coefficients and noise power.
    fn update(&mut self, reflection: Complex<f64>) {
        let count = self.coefficients.len();
        for j in 0..count.div_ceil(2) {
            let low = self.coefficients[j];
            let high = self.coefficients[count - 1 - j];
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

    /// The correlogram whose transform is |A|^2 / noise power.
    pub(crate) fn inverse_lags(&self, kind: SignalKind, out: &mut Vec<f64>) {
        let order = self.order();
        let scale = 1.0 / self.noise_power;
        out.clear();
        for m in 0..=order {
            let mut lag = Complex::<f64>::ZERO;
            for k in 0..=order - m {
                lag += self.coefficient(k + m) * self.coefficient(k).conj();
            }
            out.push(lag.re * scale);
            if kind == SignalKind::Complex {
                out.push(lag.im * scale);
            }
        }
    }

    /// a_k with a_0 = 1.
    fn coefficient(&self, k: usize) -> Complex<f64> {
        if k == 0 {
            Complex::ONE
        } else {
            self.coefficients[k - 1]
        }
    }
}

/// The error of a reflection coefficient of absolute value `size`.
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
