//! Information on velocity in windows of one pulse that follow each other: that of the record which they cover.
//!
//! Neighbouring windows share samples and air. The correlation of their powers does not determine that of the errors of their
//! velocities, so that the bound of a region is not that of one window over a root of some number: it comes from the covariance of all
//! samples, tr(R^-1 dR R^-1 dR) as for one window. With R = L L^T the trace is the squared norm of L^-1 dR L^-T, and that of its
//! leading part belongs to the leading samples: one factor gives records of all lengths. Check: one window against its bound,
//! long records against the sum over frequencies, a maximum likelihood of the whole record.

use ndarray::{Array2, s};
use num_complex::Complex;

use super::Noise;
use super::window_model::{LEAST_CONDITION, turned};
use crate::error::{Error, at_least_one, not_empty};
use crate::linalg::cholesky::{cholesky, forward};
use crate::window::{Gates, Sampling, SignalKind};

/// Samples up to which a record is always computed as a whole.
const WHOLE_SAMPLES: usize = 256;

/// Correlation of the signal below which samples count as independent.
const UNCORRELATED: f64 = 1e-3;

/// Imaginary parts of the correlation up to this are rounding: the spectrum of the pulse is symmetric.
const SYMMETRIC: f64 = 1e-12;

/// Second-order model of the record of one pulse, air at rest in the middle of the band.
#[derive(Debug, Clone)]
pub struct RecordModel {
    sampling: Sampling,
    kind: SignalKind,
    noise: Noise,
    correlation: Vec<Complex<f64>>,
    is_gaussian: bool,
}

impl RecordModel {
    /// `correlation` E{x(t + lag) x*(t)} of the signal's envelope at lags of 0, 1, 2 .. samples, 1 at lag 0 and nothing beyond the last; it is
    /// real for a pulse with a symmetric spectrum. `is_gaussian` for a Gaussian pulse, whose f(a) f(b) is that correlation times
    /// |f((a + b)/2)|^2.
    ///
    /// # Errors
    /// [`Error::Empty`], [`Error::Band`] or [`Error::OutOfRange`] for impossible input.
    pub fn new(
        sampling: &Sampling,
        kind: SignalKind,
        noise: Noise,
        correlation: Vec<Complex<f64>>,
        is_gaussian: bool,
    ) -> Result<Self, Error> {
        sampling.validate_for(kind)?;
        noise.validate()?;
        not_empty("correlation", correlation.len())?;
        Ok(Self {
            sampling: *sampling,
            kind,
            noise,
            correlation,
            is_gaussian,
        })
    }

    /// Fisher information on the velocity, 1/(m/s)^2, in 1, 2, .. `count` windows in a row about a range.
    ///
    /// `snr` is the expected signal-to-noise ratio in the detector band of a sample, given its distance in samples behind the middle of
    /// the innermost window, from which the row grows by one window behind it and one before it in turn. Records far longer than windows
    /// and pulse are continued by the growth at their end. A floor of the noise outside its band that is too small for double precision
    /// is raised to the smallest sufficient one.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for no window, [`Error::Linalg`] for a covariance that is not positive definite, such as one from a ratio
    /// that is NaN.
    pub fn information(
        &self,
        gates: &Gates,
        count: usize,
        snr: impl Fn(f64) -> f64,
    ) -> Result<Vec<f64>, Error> {
        gates.validate()?;
        at_least_one("count", count)?;
        let memory = self
            .correlation
            .iter()
            .rposition(|c| c.norm() > UNCORRELATED)
            .unwrap_or(0);
        let most = WHOLE_SAMPLES.max(gates.window_samples + memory);
        let (positions, ends) = rows(gates, count, most);
        let numbers = self.numbers_per_sample();
        let [covariance, mut derivative] = self.matrices(&positions, &snr);
        let order = covariance.nrows();
        let failed = Error::Linalg {
            what: "covariance of a record",
            order,
            reason: "is not positive",
        };
        let factor = cholesky(covariance).ok_or(failed)?;
        for _ in 0..2 {
            forward(factor.view(), &mut derivative);
            derivative = derivative.reversed_axes().as_standard_layout().into_owned();
        }
        // The trace of matrices of real and imaginary parts is twice that of the complex ones.
        let share = self.kind.one_sided_share() / numbers as f64;
        let mut sum = 0.0;
        let mut so_far = Vec::with_capacity(order);
        for n in 0..order {
            let off: f64 = derivative.slice(s![n, ..n]).iter().map(|x| x * x).sum();
            sum += share * (2.0 * off + derivative[[n, n]].powi(2));
            so_far.push(sum);
        }
        let mut information: Vec<f64> = ends.iter().map(|end| so_far[numbers * end - 1]).collect();
        if let [.., first, _, _, _, end] = information[..] {
            for more in 1..=count - information.len() {
                information.push(end + 0.25 * (end - first) * more as f64);
            }
        }
        Ok(information)
    }

    /// Rows of the matrices for each sample: two for complex samples whose correlation is not real.
    fn numbers_per_sample(&self) -> usize {
        let mut largest: f64 = 0.0;
        for value in &self.correlation {
            largest = largest.max(value.im.abs());
        }
        match self.kind {
            SignalKind::Complex if largest > SYMMETRIC => 2,
            _ => 1,
        }
    }

    /// Covariance of the samples at `positions` and its derivative with respect to velocity, noise in the band having unit power.
    ///
    /// Both are real. Real samples are, and so are complex ones of a symmetric spectrum at rest, except for a derivative that is
    /// imaginary and antisymmetric, of which the imaginary part serves as well. Other complex matrices X + jY are stored as
    /// blocks (X, -Y; Y, X), the two rows of a sample together, so that leading samples are leading rows.
    fn matrices(&self, positions: &[f64], snr: &dyn Fn(f64) -> f64) -> [Array2<f64>; 2] {
        let signal = Signal::new(self, positions, snr);
        let derivative = if self.numbers_per_sample() == 2 {
            self.complex_derivative(&signal)
        } else {
            self.real_derivative(&signal)
        };
        let covariance = self.covariance(&signal, self.noise);
        let Noise::Band { floor } = self.noise else {
            return [covariance, derivative];
        };
        let mut largest = 0.0;
        for row in covariance.rows() {
            let sum: f64 = row.iter().map(|x| x.abs()).sum();
            largest = f64::max(largest, sum);
        }
        let white = self.noise_at(0.0, Noise::White);
        let least = LEAST_CONDITION * covariance.nrows() as f64 * largest / white;
        if floor < least {
            let raised = Noise::Band {
                floor: least.min(1.0),
            };
            return [self.covariance(&signal, raised), derivative];
        }
        [covariance, derivative]
    }

    /// Derivative of the covariance of real samples, or the imaginary part of that of complex ones whose correlation is real.
    fn real_derivative(&self, signal: &Signal<'_>) -> Array2<f64> {
        let cycles = self.sampling.intermediate_frequency_hz * self.sampling.period_s();
        let slope = self.sampling.phase_slope();
        let order = signal.positions.len();
        Array2::from_shape_fn((order, order), |(n, m)| {
            let lag = signal.positions[n] - signal.positions[m];
            let value = signal.between(n, m);
            match self.kind {
                SignalKind::Real => {
                    let (sin, cos) = turned(cycles, lag).sin_cos();
                    slope * lag * value.re * -sin - slope * lag * value.im * cos
                }
                SignalKind::Complex => slope * lag * value.re,
            }
        })
    }

    /// Derivative of the covariance of complex samples, j slope lag times that of the signal, as real and imaginary parts.
    fn complex_derivative(&self, signal: &Signal<'_>) -> Array2<f64> {
        let slope = self.sampling.phase_slope();
        real_and_imaginary(signal.positions.len(), |n, m| {
            let lag = signal.positions[n] - signal.positions[m];
            signal.between(n, m) * Complex::new(0.0, slope * lag)
        })
    }

    /// Covariance of the samples of a signal in noise.
    fn covariance(&self, signal: &Signal<'_>, noise: Noise) -> Array2<f64> {
        let positions = signal.positions;
        let cycles = self.sampling.intermediate_frequency_hz * self.sampling.period_s();
        let farthest = positions
            .iter()
            .fold(0.0_f64, |most, position| most.max(position.abs()));
        let mut of_noise = Vec::new();
        for lag in 0..=(2.0 * farthest) as usize {
            of_noise.push(self.noise_at(lag as f64, noise));
        }
        let order = positions.len();
        if self.numbers_per_sample() == 2 {
            return real_and_imaginary(order, |n, m| {
                let lag = positions[n] - positions[m];
                signal.between(n, m) + of_noise[lag.abs() as usize]
            });
        }
        Array2::from_shape_fn((order, order), |(n, m)| {
            let lag = positions[n] - positions[m];
            let value = signal.between(n, m);
            let of_signal = match self.kind {
                SignalKind::Real => {
                    let (sin, cos) = turned(cycles, lag).sin_cos();
                    value.re * cos - value.im * sin
                }
                SignalKind::Complex => value.re,
            };
            of_signal + of_noise[lag.abs() as usize]
        })
    }

    /// Covariance of noise of unit power in the band at a lag in samples.
    fn noise_at(&self, lag: f64, noise: Noise) -> f64 {
        let sampling = &self.sampling;
        let density = sampling.sample_rate_hz / (sampling.band_hz.1 - sampling.band_hz.0);
        noise.covariance(sampling, lag, self.kind).re * density
    }
}

/// The signal in samples of a record, its carrier removed.
struct Signal<'a> {
    model: &'a RecordModel,
    positions: &'a [f64],
    /// Least position.
    first: f64,
    /// Signal-to-noise ratios at every half sample from there: two samples of a Gaussian pulse share the air in the middle between them.
    ratios: Vec<f64>,
}

impl<'a> Signal<'a> {
    fn new(model: &'a RecordModel, positions: &'a [f64], snr: &dyn Fn(f64) -> f64) -> Self {
        let first = positions.iter().copied().fold(positions[0], f64::min);
        let last = positions.iter().copied().fold(positions[0], f64::max);
        let mut ratios = Vec::new();
        for half in 0..=(2.0 * (last - first)) as usize {
            ratios.push(snr(first + 0.5 * half as f64));
        }
        Self {
            model,
            positions,
            first,
            ratios,
        }
    }

    /// Covariance of the samples at two positions, given by their indices.
    fn between(&self, n: usize, m: usize) -> Complex<f64> {
        let late = self.positions[n];
        let early = self.positions[m];
        let lag = (late - early).abs() as usize;
        let none = Complex::new(0.0, 0.0);
        let known = self.model.correlation.get(lag).copied().unwrap_or(none);
        if known == none {
            return none;
        }
        let correlation = if late < early { known.conj() } else { known };
        if self.model.is_gaussian {
            return correlation * self.ratios[(late + early - 2.0 * self.first) as usize];
        }
        let of_late = self.ratios[(late + late - 2.0 * self.first) as usize];
        let of_early = self.ratios[(early + early - 2.0 * self.first) as usize];
        correlation * (of_late * of_early).sqrt()
    }
}

/// A complex matrix of an order as a real one of twice that order: the two rows and columns of an element together.
fn real_and_imaginary(order: usize, element: impl Fn(usize, usize) -> Complex<f64>) -> Array2<f64> {
    let mut matrix = Array2::zeros((2 * order, 2 * order));
    for n in 0..order {
        for m in 0..order {
            let value = element(n, m);
            matrix[[2 * n, 2 * m]] = value.re;
            matrix[[2 * n, 2 * m + 1]] = -value.im;
            matrix[[2 * n + 1, 2 * m]] = value.im;
            matrix[[2 * n + 1, 2 * m + 1]] = value.re;
        }
    }
    matrix
}

/// Positions of the samples of windows about a middle, in samples from it, window after window from the innermost one, and the number
/// of positions with 1, 2, .. windows; at most `most` positions, but at least five windows.
fn rows(gates: &Gates, count: usize, most: usize) -> (Vec<f64>, Vec<usize>) {
    let window = gates.window_samples as i64;
    let step = gates.step_samples as i64;
    let mut known = std::collections::BTreeSet::<i64>::new();
    let mut positions = Vec::new();
    let mut ends = Vec::new();
    for k in 0..count as i64 {
        let side = if k % 2 == 1 { (k + 1) / 2 } else { -k / 2 };
        let samples = side * step..side * step + window;
        let new: Vec<i64> = samples.filter(|sample| !known.contains(sample)).collect();
        if ends.len() > 4 && positions.len() + new.len() > most {
            break;
        }
        known.extend(&new);
        for sample in new {
            positions.push(sample as f64 - 0.5 * (window - 1) as f64);
        }
        ends.push(positions.len());
    }
    (positions, ends)
}
