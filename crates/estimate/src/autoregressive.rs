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

use crate::error::Error;
use crate::sample::{Sample, SignalKind, binary_scale};
use crate::sampling::Sampling;

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
    /// [`Error::OutOfRange`] if the order is 0 or not below the number of lags, if there is no power, or if the correlogram is not positive
    /// definite.
    pub fn yule_walker(correlogram: &[f64], kind: SignalKind, order: usize) -> Result<Self, Error> {
        check_order(order, correlogram.len() / kind.lag_numbers(1))?;
        let mut model = Self::default();
        model.solve(correlogram, kind, order)?;
        Ok(model)
    }

    /// The Levinson-Durbin recursion into this model, without allocation once its vectors have grown.
    pub(crate) fn solve(&mut self, correlogram: &[f64], kind: SignalKind, order: usize) -> Result<(), Error> {
        self.coefficients.clear();
        self.reflection.clear();
        self.noise_power = kind.lag(correlogram, 0).re;
        crate::error::positive("lag 0 of the correlogram", self.noise_power)?;
        for m in 1..=order {
            let forward: Complex<f64> =
                self.coefficients.iter().enumerate().map(|(j, a)| a * kind.lag(correlogram, m - 1 - j)).sum();
            let reflection = -(kind.lag(correlogram, m) + forward) / self.noise_power;
            self.extend(reflection)?;
        }
        Ok(())
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
        let scale = binary_scale(window.iter().copied());
        let scaled = |sample: &S| sample.scaled(scale.recip()).to_complex();
        let mut forward: Vec<Complex<f64>> = window.iter().map(scaled).collect();
        let mut backward = forward.clone();
        let power = forward.iter().map(|x| x.norm_sqr()).sum::<f64>() / window.len() as f64;
        crate::error::positive("power of the window", power)?;
        let mut model = Self { noise_power: power, ..Self::default() };
        for m in 1..=order {
            let pairs = || forward[m..].iter().zip(&backward[m - 1..window.len() - 1]);
            let cross: Complex<f64> = pairs().map(|(f, b)| f * b.conj()).sum();
            let energy: f64 = pairs().map(|(f, b)| f.norm_sqr() + b.norm_sqr()).sum();
            // nothing left to predict: the model is complete
            let reflection = if energy > power * f64::EPSILON { -2.0 * cross / energy } else { Complex::ZERO };
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

    /// Adds a stage; refuses one that is not inside the unit circle.
    fn extend(&mut self, reflection: Complex<f64>) -> Result<(), Error> {
        let size = reflection.norm();
        if size < 1.0 {
            self.update(reflection);
            Ok(())
        } else {
            Err(Error::OutOfRange {
                field: "reflection coefficient",
                value: size,
                allowed: "below 1: the correlogram is not positive definite (is it the biased one?)",
            })
        }
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

    /// Whether all reflection coefficients, and with them all poles, lie inside the unit circle.
    #[must_use]
    pub fn is_stable(&self) -> bool {
        self.reflection.iter().all(|reflection| reflection.norm() < 1.0)
    }

    /// Density (32) at `frequency_hz`, in signal units squared; white noise has its variance.
    #[must_use]
    pub fn density(&self, frequency_hz: f64, sampling: &Sampling) -> f64 {
        let step = Complex::from_polar(1.0, -std::f64::consts::TAU * frequency_hz / sampling.sample_rate_hz);
        // Horner from the highest coefficient
        let sum = self.coefficients.iter().rev().fold(Complex::ZERO, |sum, a| (sum + a) * step);
        self.noise_power / (sum + 1.0).norm_sqr()
    }

    /// Correlogram of the coefficients 1, a_1 .. a_p themselves: the transform of its p + 1 lags is |A|^2.
    pub(crate) fn inverse_lags(&self, kind: SignalKind, out: &mut Vec<f64>) {
        let a = |k: usize| if k == 0 { Complex::ONE } else { self.coefficients[k - 1] };
        out.clear();
        for m in 0..=self.order() {
            let lag: Complex<f64> = (0..=self.order() - m).map(|k| a(k + m) * a(k).conj()).sum();
            out.push(lag.re);
            if kind == SignalKind::Complex {
                out.push(lag.im);
            }
        }
    }
}

/// An order needs at least one lag more than itself.
pub(crate) fn check_order(order: usize, lags: usize) -> Result<(), Error> {
    if (1..lags).contains(&order) {
        Ok(())
    } else {
        Err(Error::OutOfRange {
            field: "order",
            value: order as f64,
            allowed: "at least 1 and below the number of samples of the window",
        })
    }
}
