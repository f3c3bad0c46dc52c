//! Information on velocity in windows of one pulse that follow each other: that of the record which they cover.
//!
//! Neighbouring windows share samples and air. The correlation of their powers does not determine that of the errors of their
//! velocities, so that the bound of a region is not that of one window over a root of some number: it comes from the covariance of all
//! samples, tr(R^-1 dR R^-1 dR) as for one window. With R = L L^T the trace is the squared norm of L^-1 dR L^-T, and that of its
//! leading part belongs to the leading samples: one factor gives records of all lengths. Check: one window against its bound,
//! long records against the sum over frequencies, a maximum likelihood of the whole record.

use ndarray::{Array2, s};

use super::Noise;
use super::window_model::{LEAST_CONDITION, turned};
use crate::error::{Error, at_least_one, not_empty};
use crate::linalg::cholesky::{cholesky, forward};
use crate::window::{Gates, Sampling, SignalKind};

/// Samples up to which a record is always computed as a whole.
const WHOLE_SAMPLES: usize = 256;

/// Correlation of the signal below which samples count as independent.
const UNCORRELATED: f64 = 1e-3;

/// Second-order model of the record of one pulse, air at rest in the middle of the band.
#[derive(Debug, Clone)]
pub struct RecordModel {
    sampling: Sampling,
    kind: SignalKind,
    noise: Noise,
    correlation: Vec<f64>,
    is_gaussian: bool,
}

impl RecordModel {
    /// `correlation` of the signal's envelope at lags of 0, 1, 2 .. samples, 1 at lag 0 and nothing beyond the last; `is_gaussian` for a
    /// Gaussian pulse, whose f(a) f(b) is that correlation times |f((a + b)/2)|^2.
    ///
    /// # Errors
    /// [`Error::Empty`], [`Error::Band`] or [`Error::OutOfRange`] for impossible input.
    pub fn new(
        sampling: &Sampling,
        kind: SignalKind,
        noise: Noise,
        correlation: Vec<f64>,
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
            .rposition(|c| c.abs() > UNCORRELATED)
            .unwrap_or(0);
        let most = WHOLE_SAMPLES.max(gates.window_samples + memory);
        let (positions, ends) = rows(gates, count, most);
        let [covariance, mut derivative] = self.matrices(&positions, &snr);
        let order = positions.len();
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
        let mut sum = 0.0;
        let mut so_far = Vec::with_capacity(order);
        for n in 0..order {
            let off: f64 = derivative.slice(s![n, ..n]).iter().map(|x| x * x).sum();
            sum += self.kind.one_sided_share() * (2.0 * off + derivative[[n, n]].powi(2));
            so_far.push(sum);
        }
        let mut information: Vec<f64> = ends.iter().map(|end| so_far[end - 1]).collect();
        if let [.., first, _, _, _, end] = information[..] {
            for more in 1..=count - information.len() {
                information.push(end + 0.25 * (end - first) * more as f64);
            }
        }
        Ok(information)
    }

    /// Covariance of the samples at `positions` and its derivative with respect to velocity, noise in the band having unit power.
    ///
    /// Both are real: real samples are, and so are complex ones at rest except for a derivative that is imaginary and antisymmetric, of
    /// which the imaginary part serves as well.
    fn matrices(&self, positions: &[f64], snr: &dyn Fn(f64) -> f64) -> [Array2<f64>; 2] {
        let sampling = &self.sampling;
        let cycles = sampling.intermediate_frequency_hz * sampling.period_s();
        let slope = sampling.phase_slope();
        let signal = self.signal(positions, snr);
        let derivative = Array2::from_shape_fn(signal.dim(), |(n, m)| {
            let lag = positions[n] - positions[m];
            let turn = match self.kind {
                SignalKind::Real => -turned(cycles, lag).sin(),
                SignalKind::Complex => 1.0,
            };
            slope * lag * signal[[n, m]] * turn
        });
        let covariance = self.covariance(positions, &signal, self.noise);
        let Noise::Band { floor } = self.noise else {
            return [covariance, derivative];
        };
        let mut largest = 0.0;
        for row in covariance.rows() {
            let sum: f64 = row.iter().map(|x| x.abs()).sum();
            largest = f64::max(largest, sum);
        }
        let white = self.noise_at(0.0, Noise::White);
        let least = LEAST_CONDITION * positions.len() as f64 * largest / white;
        if floor < least {
            let raised = Noise::Band {
                floor: least.min(1.0),
            };
            return [self.covariance(positions, &signal, raised), derivative];
        }
        [covariance, derivative]
    }

    /// Covariance of the signal at `positions`, the carrier removed.
    fn signal(&self, positions: &[f64], snr: &dyn Fn(f64) -> f64) -> Array2<f64> {
        // Two samples of a Gaussian pulse share the air in the middle between them: ratios at every half sample.
        let first = positions.iter().copied().fold(positions[0], f64::min);
        let last = positions.iter().copied().fold(positions[0], f64::max);
        let mut ratios = Vec::new();
        for half in 0..=(2.0 * (last - first)) as usize {
            ratios.push(snr(first + 0.5 * half as f64));
        }
        let order = positions.len();
        Array2::from_shape_fn((order, order), |(n, m)| {
            let outer = positions[n.max(m)];
            let inner = positions[n.min(m)];
            let lag = (outer - inner).abs() as usize;
            let correlation = self.correlation.get(lag).copied().unwrap_or(0.0);
            if correlation == 0.0 {
                return 0.0;
            }
            if self.is_gaussian {
                return correlation * ratios[(outer + inner - 2.0 * first) as usize];
            }
            let of_outer = ratios[(outer + outer - 2.0 * first) as usize];
            let of_inner = ratios[(inner + inner - 2.0 * first) as usize];
            correlation * (of_outer * of_inner).sqrt()
        })
    }

    /// Covariance of the samples at `positions` for that of the signal without its carrier.
    fn covariance(&self, positions: &[f64], signal: &Array2<f64>, noise: Noise) -> Array2<f64> {
        let cycles = self.sampling.intermediate_frequency_hz * self.sampling.period_s();
        let farthest = positions
            .iter()
            .fold(0.0_f64, |most, position| most.max(position.abs()));
        let mut of_noise = Vec::new();
        for lag in 0..=(2.0 * farthest) as usize {
            of_noise.push(self.noise_at(lag as f64, noise));
        }
        Array2::from_shape_fn(signal.dim(), |(n, m)| {
            let lag = positions[n] - positions[m];
            let turn = match self.kind {
                SignalKind::Real => turned(cycles, lag).cos(),
                SignalKind::Complex => 1.0,
            };
            signal[[n, m]] * turn + of_noise[lag.abs() as usize]
        })
    }

    /// Covariance of noise of unit power in the band at a lag in samples.
    fn noise_at(&self, lag: f64, noise: Noise) -> f64 {
        let sampling = &self.sampling;
        let density = sampling.sample_rate_hz / (sampling.band_hz.1 - sampling.band_hz.0);
        noise.covariance(sampling, lag, self.kind).re * density
    }
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
