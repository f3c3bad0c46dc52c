//! Information on velocity in windows of one pulse that follow each other: that of the record which they cover.
//!
//! Neighbouring windows share samples and air. How alike their powers are says little of how alike the errors of their velocities
//! are, so that the bound of a region is not that of one window over a root of some number: it comes from the covariance of all
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

/// Correlation of the signal that is none, where it is asked how long air is remembered.
const FORGOTTEN: f64 = 1e-3;

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

    /// Fisher information on the velocity, 1/(m/s)^2, in 1, 2, .. `count` windows in a row about a place.
    ///
    /// `snr` is the expected signal-to-noise ratio in the detector band of a sample so many samples behind the middle of the innermost window, from
    /// which the row grows by one behind it and one before it in turn. Records far longer than windows and pulse are continued by the growth at their end. A floor of the noise outside its band
    /// that is too small for double precision is raised to the least that is not.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for no window, [`Error::Linalg`] for a covariance that has no factor, such as that of a ratio that is not a
    /// number.
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
            .rposition(|c| c.abs() > FORGOTTEN)
            .unwrap_or(0);
        let most = WHOLE_SAMPLES.max(gates.window_samples + memory);
        let (places, ends) = rows(gates, count, most);
        let [covariance, mut derivative] = self.matrices(&places, snr);
        let order = places.len();
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
        if let (last, &[.., first, _, _, _, end]) = (information.len(), &information[..]) {
            information
                .extend((1..=count - last).map(|more| end + 0.25 * (end - first) * more as f64));
        }
        Ok(information)
    }

    /// Covariance of the samples at some places and its derivative with respect to velocity, noise in the band having unit power.
    ///
    /// Both are real: real samples are, and so are complex ones at rest but for a derivative that is imaginary and antisymmetric, of
    /// which the imaginary part serves as well.
    fn matrices(&self, places: &[f64], snr: impl Fn(f64) -> f64) -> [Array2<f64>; 2] {
        let sampling = &self.sampling;
        let cycles = sampling.intermediate_frequency_hz * sampling.period_s();
        let slope = sampling.phase_slope();
        let density = sampling.sample_rate_hz / (sampling.band_hz.1 - sampling.band_hz.0);
        // Two samples of a Gaussian pulse share the air in the middle between them: ratios at every half sample.
        let [first, last] =
            [f64::min, f64::max].map(|of| places.iter().copied().fold(places[0], of));
        let halves = 0..=(2.0 * (last - first)) as usize;
        let ratios: Vec<f64> = halves.map(|half| snr(first + 0.5 * half as f64)).collect();
        let between = |n: usize, m: usize| ratios[(places[n] + places[m] - 2.0 * first) as usize];
        let of_lag =
            |lag: f64, noise: Noise| noise.covariance(sampling, lag, self.kind).re * density;
        let signal = |(n, m): (usize, usize)| {
            let lag = (places[n] - places[m]).abs() as usize;
            let correlation = self.correlation.get(lag).copied().unwrap_or(0.0);
            if correlation == 0.0 {
                return 0.0;
            }
            correlation
                * if self.is_gaussian {
                    between(n, m)
                } else {
                    (between(n, n) * between(m, m)).sqrt()
                }
        };
        let order = places.len();
        let signal = Array2::from_shape_fn((order, order), |(n, m)| signal((n.max(m), n.min(m))));
        let lag = |(n, m): (usize, usize)| places[n] - places[m];
        let covariance = |noise: Noise| {
            let longest = places
                .iter()
                .fold(0.0_f64, |most, place| most.max(place.abs()))
                * 2.0;
            let of_noise: Vec<f64> = (0..=longest as usize)
                .map(|lag| of_lag(lag as f64, noise))
                .collect();
            Array2::from_shape_fn((order, order), |place| {
                let turn = if self.kind == SignalKind::Real {
                    turned(cycles, lag(place)).cos()
                } else {
                    1.0
                };
                signal[place] * turn + of_noise[lag(place).abs() as usize]
            })
        };
        let derivative = Array2::from_shape_fn((order, order), |place| {
            let turn = if self.kind == SignalKind::Real {
                -turned(cycles, lag(place)).sin()
            } else {
                1.0
            };
            slope * lag(place) * signal[place] * turn
        });
        let covariance_as_it_is = covariance(self.noise);
        let Noise::Band { floor } = self.noise else {
            return [covariance_as_it_is, derivative];
        };
        let row = |row: ndarray::ArrayView1<'_, f64>| row.iter().map(|x| x.abs()).sum::<f64>();
        let largest = covariance_as_it_is
            .rows()
            .into_iter()
            .map(row)
            .fold(0.0, f64::max);
        let white = of_lag(0.0, Noise::White);
        let least = LEAST_CONDITION * order as f64 * largest / white;
        let raised = (floor < least).then(|| {
            covariance(Noise::Band {
                floor: least.min(1.0),
            })
        });
        [raised.unwrap_or(covariance_as_it_is), derivative]
    }
}

/// Places of the samples of windows about a middle, in samples from it, window after window from the innermost one, and how many
/// there are with 1, 2, .. windows; at most `most` of them, but five windows at least.
fn rows(gates: &Gates, count: usize, most: usize) -> (Vec<f64>, Vec<usize>) {
    let (window, step) = (gates.window_samples as i64, gates.step_samples as i64);
    let mut known = std::collections::BTreeSet::<i64>::new();
    let (mut places, mut ends) = (Vec::new(), Vec::new());
    for k in 0..count as i64 {
        let side = if k % 2 == 1 { (k + 1) / 2 } else { -k / 2 };
        let samples = side * step..side * step + window;
        let new: Vec<i64> = samples.filter(|place| !known.contains(place)).collect();
        if ends.len() > 4 && places.len() + new.len() > most {
            break;
        }
        known.extend(&new);
        places.extend(
            new.into_iter()
                .map(|place| place as f64 - 0.5 * (window - 1) as f64),
        );
        ends.push(places.len());
    }
    (places, ends)
}
