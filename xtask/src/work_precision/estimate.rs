//! Error against run time of the velocity estimators: every one of the crate, and its knobs.
//!
//! In a uniform wind the error is by how much the standard deviation of the good estimates exceeds the Cramer-Rao bound; a method of
//! which more than a fifth of the estimates are bad has no number.

use super::{Found, Row, physics::SEED};
use crate::cost::fastest;
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

/// Windows of one estimate.
pub(crate) const WINDOWS: usize = 20;

/// Cramer-Rao bound of an estimate from so many windows, in white noise of the same density in the band whatever the noise: the yardstick of
/// all methods \[m/s\].
pub(crate) fn bound_m_s(known: &Known, windows: usize) -> Result<f64, Failure> {
    let model = WindowModel::gaussian_pulse(&sampling()?, WINDOW, known.sigma_s, Noise::White)?;
    Ok(model.bound_m_s(0.0, known.snr, SignalKind::Real, windows as f64)?)
}

/// All measurements; few trials if `quick`.
pub(super) fn rows(quick: bool) -> Result<Vec<Row>, Failure> {
    let cases = [
        ("0 dB, white", NoiseModel::White, 0.0),
        ("0 dB, band", NoiseModel::BandLimited, 0.0),
        ("20 dB, band", NoiseModel::BandLimited, 20.0),
    ];
    let (cases, trials) = if quick {
        (&cases[..1], 2000)
    } else {
        (&cases[..], 6000)
    };
    let mut rows = Vec::new();
    for &(case, noise, snr_db) in cases {
        rows.extend(Uniform::new(noise, snr_db, trials)?.rows(case, quick)?);
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
        let (mut scratch, mut one) = (Scratch::new(), vec![0.0; statistic.statistic_len()]);
        let mut mean = vec![0.0; one.len()];
        let error = |(velocity_m_s, windows): &(f64, Vec<Vec<f64>>)| {
            mean.fill(0.0);
            for window in windows {
                statistic.evaluate(window, &mut scratch, &mut one);
                mean.iter_mut()
                    .zip(&one)
                    .for_each(|(sum, value)| *sum += value / WINDOWS as f64);
            }
            let found = estimator.estimate(&mean, &mut scratch);
            (found.velocity_m_s - velocity_m_s, found.is_good())
        };
        self.trials.iter().map(error).collect()
    }

    /// One setting: the time is that of one estimate from all its windows.
    fn row(
        &self,
        of: [&str; 3],
        value: f64,
        statistic: &dyn Statistic<f64>,
        estimator: &dyn Estimator,
    ) -> Result<Row, Failure> {
        let (errors, cost) = fastest(|| Ok(self.errors(statistic, estimator)))?;
        let errors: Vec<f64> = errors
            .into_iter()
            .map(|(error, good)| if good { error } else { f64::NAN })
            .collect();
        let found = good_and_bad(&errors, BAND_M_S);
        let excess = if found.bad_fraction > 0.2 {
            f64::NAN
        } else {
            found.std_good_m_s / self.bound_m_s - 1.0
        };
        let (standard_error, cost) = (
            found.std_good_error_m_s / self.bound_m_s,
            cost.scaled(1.0 / self.trials.len() as f64),
        );
        Ok(Row::new(
            of,
            value,
            Found {
                error: excess,
                standard_error,
                cost,
                set_up_s: 0.0,
            },
        ))
    }

    fn rows(&self, case: &'static str, quick: bool) -> Result<Vec<Row>, Failure> {
        let all = Methods::all(&self.known)?;
        let of = all.methods.iter().map(|method| {
            let statistic = all.statistics[method.statistic].as_ref();
            self.row(
                [case, method.name, "none"],
                0.0,
                statistic,
                method.estimator.as_ref(),
            )
        });
        let mut rows = of.collect::<Result<Vec<_>, _>>()?;
        let (s, kind) = (sampling()?, SignalKind::Real);
        let plain = Correlogram::<f64>::new(Weighting::Rectangular, WINDOW)?;
        for padded in [64, 128, 256, 1024, 4096] {
            let peak = SpectralPeak::new(
                &s,
                kind,
                &unweighted_lags(WINDOW),
                padded,
                Refinement::Parabola,
            )?;
            rows.push(self.row(
                [case, "PA by padding", "padded_samples"],
                padded as f64,
                &plain,
                &peak,
            )?);
        }
        if quick {
            return Ok(rows);
        }
        for order in [4, 8, 16, 32] {
            let value = order as f64;
            let ca = ModelPeak::new(&s, kind, WINDOW, order, 2048, Refinement::Parabola)?;
            rows.push(self.row([case, "CA by order", "order"], value, &plain, &ca)?);
        }
        Ok(rows)
    }
}
