//! Error against run time of the velocity estimators: every one of the crate, and its knobs.
//!
//! In a uniform wind the error is by how much the standard deviation of the good estimates exceeds the Cramer-Rao bound; a method of
//! which more than a fifth of the estimates are bad has failed, and its row says so. On a scan of the vortex pair it
//! is the root mean square error against the velocity that the pulse sees.

use super::{Row, mean_and_error};
use crate::cost::fastest;
use fixtures::failure::Failure;
use fixtures::methods::{Known, Methods};
use fixtures::pair::PairScan;
use fixtures::uniform::{Air, BAND_M_S};
use fixtures::{WINDOW, sampling};
use wakescope_estimate::{
    Correlogram, Estimator, Refinement, Scratch, SignalKind, SpectralPeak, Statistic, Weighting,
    bound::{GradientModel, Noise, WindowModel},
    estimators::{AutoregressivePeak, CaponPeak, FirstMoment, GradientLikelihood, LagWindowPeak},
    map::good_and_bad,
};
use wakescope_signal::NoiseModel;

const SEED: u64 = 1;
/// Windows of one estimate.
const WINDOWS: usize = 20;
const GOOD: [&str; 2] =
    ["standard deviation of good estimates over the bound, less one", "Cramer-Rao bound in white noise"];
const FAILED: &str = "FAILED: more than a fifth of the estimates are bad";

/// All measurements; few trials if `quick`.
pub(super) fn rows(quick: bool) -> Result<Vec<Row>, Failure> {
    let trials = if quick { 60 } else { 600 };
    let cases = [
        ("0 dB, white", NoiseModel::White, 0.0),
        ("0 dB, band", NoiseModel::BandLimited, 0.0),
        ("20 dB, band", NoiseModel::BandLimited, 20.0),
    ];
    let mut rows = Vec::new();
    for &(case, noise, snr_db) in if quick { &cases[..1] } else { &cases[..] } {
        rows.extend(Uniform::new(case, noise, snr_db, trials)?.rows(quick)?);
    }
    if !quick {
        rows.extend(pair(4)?);
    }
    Ok(rows)
}

/// Windows drawn beforehand, so that only the estimates are timed.
struct Uniform {
    case: &'static str,
    known: Known,
    bound_m_s: f64,
    trials: Vec<(f64, Vec<Vec<f64>>)>,
}

impl Uniform {
    fn new(case: &'static str, noise: NoiseModel, snr_db: f64, trials: usize) -> Result<Self, Failure> {
        let air = Air::new(noise, 200e-9, snr_db, SEED)?;
        let known = Known { noise, sigma_s: air.sigma_s(), snr: 10f64.powf(0.1 * snr_db) };
        let model = WindowModel::gaussian_pulse(&sampling()?, WINDOW, air.sigma_s(), Noise::White)?;
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
        let bound_m_s = model.bound_m_s(0.0, known.snr, SignalKind::Real, WINDOWS as f64)?;
        Ok(Self { case, known, bound_m_s, trials: drawn })
    }

    /// One setting: the time is that of one estimate from all its windows.
    fn row(
        &self,
        method: &str,
        knob: (&'static str, f64),
        statistic: &dyn Statistic<f64>,
        estimator: &dyn Estimator,
    ) -> Result<Row, Failure> {
        let (errors, cost) = fastest(|| {
            let (mut scratch, mut one) = (Scratch::new(), vec![0.0; statistic.statistic_len()]);
            let mut mean = vec![0.0; one.len()];
            let mut errors = Vec::with_capacity(self.trials.len());
            for (velocity_m_s, windows) in &self.trials {
                mean.fill(0.0);
                for window in windows {
                    statistic.evaluate(window, &mut scratch, &mut one);
                    mean.iter_mut().zip(&one).for_each(|(sum, value)| *sum += value / WINDOWS as f64);
                }
                let found = estimator.estimate(&mean, &mut scratch);
                errors.push(if found.is_good() { found.velocity_m_s - velocity_m_s } else { f64::NAN });
            }
            Ok(errors)
        })?;
        let found = good_and_bad(&errors, BAND_M_S);
        let failed = found.bad_fraction > 0.2;
        let excess = if failed { f64::NAN } else { found.std_good_m_s / self.bound_m_s - 1.0 };
        let error = (excess, found.std_good_error_m_s / self.bound_m_s);
        let words = if failed { [FAILED, GOOD[1]] } else { GOOD };
        Ok(Row::new(self.case, method, knob, error, words, cost.per(self.trials.len())))
    }

    fn rows(&self, quick: bool) -> Result<Vec<Row>, Failure> {
        let mut rows = Vec::new();
        let all = Methods::all(&self.known, &[WINDOWS])?;
        for method in &all.methods {
            let statistic = all.statistics[method.statistic].as_ref();
            rows.push(self.row(method.name, ("none", 0.0), statistic, method.estimators[0].as_ref())?);
        }
        if !quick {
            rows.extend(self.knobs()?);
        }
        Ok(rows)
    }

    fn knobs(&self) -> Result<Vec<Row>, Failure> {
        let (s, kind) = (sampling()?, SignalKind::Real);
        let plain = Correlogram::<f64>::new(Weighting::Rectangular, WINDOW)?;
        let mut rows = Vec::new();
        for padded in [64, 128, 256, 1024, 4096] {
            let peak = SpectralPeak::new(&s, kind, WINDOW, padded, Refinement::Parabola)?;
            rows.push(self.row("PA by padding", ("padded_samples", padded as f64), &plain, &peak)?);
        }
        for (number, refinement) in [(0.0, Refinement::None), (1.0, Refinement::Parabola), (2.0, Refinement::Exact)] {
            let peak = SpectralPeak::new(&s, kind, WINDOW, 256, refinement)?;
            rows.push(self.row("PA by refinement", ("none, parabola, exact", number), &plain, &peak)?);
        }
        for order in [4, 8, 16, 32] {
            let knob = ("order", order as f64);
            let ca = AutoregressivePeak::new(&s, kind, WINDOW, order, 2048, Refinement::Parabola)?;
            let capon = CaponPeak::new(&s, kind, WINDOW, order, 2048, Refinement::Parabola)?;
            rows.push(self.row("CA by order", knob, &plain, &ca)?);
            rows.push(self.row("Capon by order", knob, &plain, &capon)?);
        }
        for lags in [8, 16, 32, 48] {
            let peak = LagWindowPeak::new(&s, kind, WINDOW, lags, 1024, Refinement::Parabola)?;
            rows.push(self.row("CA-BT by lags", ("lags", lags as f64), &plain, &peak)?);
        }
        for reach in [1.5, 2.5, 3.5] {
            let moment = FirstMoment::new(&s, kind, WINDOW, 512, reach)?;
            rows.push(self.row("first moment by reach", ("reach", reach), &plain, &moment)?);
        }
        let wind = GradientModel::new(&s, WINDOW, self.known.sigma_s, self.known.estimate_noise())?;
        for gradients in [1, 3, 5, 9] {
            let list: Vec<f64> = (0..gradients).map(|k| 0.1 * (k as f64 - 0.5 * (gradients - 1) as f64)).collect();
            let plan = GradientLikelihood::<f64>::new(&wind, self.known.snr, &list, 1024)?;
            let knob = ("gradients", gradients as f64);
            rows.push(self.row("likelihood by gradients", knob, &plan.statistic, &plan.estimator)?);
        }
        for factor_db in [-10.0, 10.0] {
            let snr = self.known.snr * 10f64.powf(0.1 * factor_db);
            let plan = GradientLikelihood::<f64>::new(&wind, snr, &[0.0], 1024)?;
            let knob = ("assumed SNR off by [dB]", factor_db);
            rows.push(self.row("likelihood, wrong SNR", knob, &plan.statistic, &plan.estimator)?);
        }
        Ok(rows)
    }
}

/// Every estimator on scans of the pair: the time is that of the statistics of a scan and the chosen points of a map.
fn pair(scans: usize) -> Result<Vec<Row>, Failure> {
    let pair = PairScan::new(NoiseModel::BandLimited, 200e-9, 0.0, 3, SEED)?;
    let known = Known { noise: NoiseModel::BandLimited, sigma_s: pair.sigma_s(), snr: pair.snr };
    let all = Methods::all(&known, &[8])?;
    let zones: [Vec<usize>; 2] = [
        (0..pair.points.len()).filter(|&i| pair.distance_m[i] < 8.0).collect(),
        (0..pair.points.len()).filter(|&i| pair.distance_m[i] > 30.0).step_by(23).collect(),
    ];
    // The speed of the air beside a core is what errors are compared with.
    let root = |squares: &[f64]| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    let scale_m_s = root(&zones[0].iter().map(|&i| pair.v_pulse_m_s[i].powi(2)).collect::<Vec<_>>());
    let records = (0..scans).map(|scan| pair.records(scan)).collect::<Result<Vec<_>, _>>()?;
    let mut rows = Vec::new();
    for method in &all.methods {
        let (errors, cost) = fastest(|| {
            let mut errors = [Vec::new(), Vec::new()];
            for records in &records {
                let scan = pair.statistics(records, all.statistics[method.statistic].as_ref())?;
                for (errors, chosen) in errors.iter_mut().zip(&zones) {
                    let points: Vec<_> = chosen.iter().map(|&i| pair.points[i]).collect();
                    let found = pair.velocities(&scan, &points, 2.0, method.estimators[0].as_ref())?;
                    let known = found.iter().zip(chosen).filter(|(v, _)| v.is_finite());
                    errors.push(
                        root(&known.map(|(v, &i)| (v - pair.v_pulse_m_s[i]).powi(2)).collect::<Vec<_>>()) / scale_m_s,
                    );
                }
            }
            Ok(errors)
        })?;
        for (errors, case) in errors.iter().zip(["pair, within 8 m", "pair, beyond 30 m"]) {
            let words =
                ["root mean square error over the velocities within 8 m of a core", "velocity weighted with the pulse"];
            let (error, cost) = (mean_and_error(errors), cost.per(records.len()));
            rows.push(Row::new(case, method.name, ("rho_m", 2.0), error, words, cost));
        }
    }
    rows.sort_by_key(|row| row.case.len());
    Ok(rows)
}
