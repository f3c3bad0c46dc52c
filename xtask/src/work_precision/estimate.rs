//! Error against run time of the velocity estimators: every one of the crate, and its knobs.
//!
//! In a uniform wind the error is by how much the standard deviation of the good estimates exceeds the Cramer-Rao bound; a method of
//! which more than a fifth of the estimates are bad has no number.

use super::{Found, Row, physics::SEED};
use crate::cost::fastest;
use crate::profile::Profile;
use fixtures::failure::Failure;
use fixtures::methods::{Known, Methods};
use fixtures::uniform::{Air, BAND_M_S};
use fixtures::{WINDOW, sampling};
use wakescope_estimate::{
    Correlogram, Estimator, Refinement, Scratch, SignalKind, SpectralPeak, Statistic, Weighting,
    bound::{Noise, WindowModel},
    estimators::ModelPeak,
    map::good_and_bad,
    spectrum::unweighted_lags,
};
use wakescope_signal::NoiseModel;

/// A method of which a larger fraction of the estimates is bad has no number.
const MOST_BAD: f64 = 0.2;
/// Windows of one estimate.
pub(crate) const WINDOWS: usize = 20;

/// Cramer-Rao bound of an estimate from so many windows, in white noise of the same density in the band whatever the noise: the yardstick of
/// all methods \[m/s\].
pub(crate) fn bound_m_s(known: &Known, windows: usize) -> Result<f64, Failure> {
    let model = WindowModel::gaussian_pulse(&sampling()?, WINDOW, known.sigma_s, Noise::White)?;
    Ok(model.bound_m_s(0.0, known.snr, SignalKind::Real, windows as f64)?)
}

/// All measurements; few trials if `quick`.
pub(super) fn rows(profile: Profile) -> Result<Vec<Row>, Failure> {
    let cases = [
        ("0 dB, white", NoiseModel::White, 0.0),
        ("0 dB, band", NoiseModel::BandLimited, 0.0),
        ("20 dB, band", NoiseModel::BandLimited, 20.0),
    ];
    let cases = &cases[..profile.choose(1, 1, cases.len())];
    let trials = profile.choose(2000, 2000, 6000);
    let mut rows = Vec::new();
    for &(case, noise, snr_db) in cases {
        rows.extend(Uniform::new(noise, snr_db, trials)?.rows(case, profile)?);
    }
    Ok(rows)
}

/// Windows of a uniform wind, drawn beforehand, so that only the estimates are timed.
pub(crate) struct Uniform {
    known: Known,
    pub(crate) bound_m_s: f64,
    trials: Vec<(f64, Vec<Vec<f64>>)>,
}

impl Uniform {
    pub(crate) fn new(noise: NoiseModel, snr_db: f64, trials: usize) -> Result<Self, Failure> {
        let air = Air::new(noise, 200e-9, snr_db, SEED)?;
        let mut scratch = wakescope_signal::Scratch::default();
        let mut drawn = Vec::with_capacity(trials);
        for trial in 0..trials {
            let (line, velocity_m_s) = air.line(trial, trials);
            let mut windows = vec![vec![0.0; WINDOW]; WINDOWS];
            for (pulse, window) in windows.iter_mut().enumerate() {
                air.window(&line, trial, pulse, &mut scratch, window)?;
            }
            drawn.push((velocity_m_s, windows));
        }
        Ok(Self {
            known: air.known,
            bound_m_s: bound_m_s(&air.known, WINDOWS)?,
            trials: drawn,
        })
    }

    /// Errors of all trials \[m/s\], and whether the estimator says that it has a velocity.
    pub(crate) fn errors(
        &self,
        statistic: &dyn Statistic<f64>,
        estimator: &dyn Estimator,
    ) -> Vec<(f64, bool)> {
        let mut scratch = Scratch::new();
        let mut one = vec![0.0; statistic.statistic_len()];
        let mut mean = vec![0.0; one.len()];
        let mut errors = Vec::with_capacity(self.trials.len());
        for (velocity_m_s, windows) in &self.trials {
            mean.fill(0.0);
            for window in windows {
                statistic.evaluate(window, &mut scratch, &mut one);
                for (sum, value) in mean.iter_mut().zip(&one) {
                    *sum += value / WINDOWS as f64;
                }
            }
            let found = estimator.estimate(&mean, &mut scratch);
            errors.push((found.velocity_m_s - velocity_m_s, found.is_good()));
        }
        errors
    }

    /// One setting: the time is that of one estimate from all its windows.
    fn row(
        &self,
        names: [&str; 3],
        value: f64,
        statistic: &dyn Statistic<f64>,
        estimator: &dyn Estimator,
    ) -> Result<Row, Failure> {
        let (errors, cost) = fastest(|| Ok(self.errors(statistic, estimator)))?;
        let mut errors_m_s = Vec::with_capacity(errors.len());
        for (error_m_s, is_good) in errors {
            errors_m_s.push(if is_good { error_m_s } else { f64::NAN });
        }
        let found = good_and_bad(&errors_m_s, BAND_M_S);
        let excess = if found.bad_fraction > MOST_BAD {
            f64::NAN
        } else {
            found.std_good_m_s / self.bound_m_s - 1.0
        };
        let found = Found {
            error: excess,
            standard_error: found.std_good_error_m_s / self.bound_m_s,
            cost: cost.scaled(1.0 / self.trials.len() as f64),
            set_up_s: 0.0,
        };
        Ok(Row::new(names, value, found))
    }

    fn rows(&self, case: &'static str, profile: Profile) -> Result<Vec<Row>, Failure> {
        let all = Methods::all(&self.known)?;
        let mut rows = Vec::new();
        for method in &all.methods {
            let names = [case, method.name, "none"];
            let statistic = all.statistics[method.statistic].as_ref();
            rows.push(self.row(names, 0.0, statistic, method.estimator.as_ref())?);
        }
        let s = sampling()?;
        let kind = SignalKind::Real;
        let lags = unweighted_lags(WINDOW);
        let plain = Correlogram::<f64>::new(Weighting::Rectangular, WINDOW)?;
        for padded in [64, 128, 256, 1024, 4096] {
            let names = [case, "PA by padding", "padded_samples"];
            let peak = SpectralPeak::new(&s, kind, &lags, padded, Refinement::Parabola)?;
            rows.push(self.row(names, padded as f64, &plain, &peak)?);
        }
        if profile != Profile::Full {
            return Ok(rows);
        }
        for order in [4, 8, 16, 32] {
            let names = [case, "CA by order", "order"];
            let peak = ModelPeak::new(&s, kind, WINDOW, order, 2048, Refinement::Parabola)?;
            rows.push(self.row(names, order as f64, &plain, &peak)?);
        }
        Ok(rows)
    }
}
