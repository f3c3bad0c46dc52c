//! False alarms and detections of single gates, in closed form: the cell of a mean spectrum against the known noise.
//!
//! A window's signal-to-noise ratio in the band is spread over the width of the pulse's spectrum: the cell of the peak has
//! S = SNR v_B kappa/sqrt(pi) times the noise, v_B = lambda B/2, kappa = 4 pi sigma_p/lambda, sigma_p = sigma sigma_h/sqrt(sigma^2 +
//! sigma_h^2) for a Gaussian pulse and window. Check: S is 10.0 at 0 dB for Table 2; the closed forms in `CellTest`.

use crate::Error;
use crate::io::Table;
use crate::measure::bound::{BoundPoint, bound};
use crate::measure::estimators;
use crate::measure::progress::Observer;
use crate::plan::Plan;
use crate::scene::Scene;
use std::f64::consts::PI;
use wakescope_estimate::estimators::CellTest;

/// Power of the signal over that of the noise in the cell of the peak, at a ratio of 1 in the band.
fn peak_gain(scene: &Scene, sigma_s: f64) -> Result<f64, Error> {
    let weights = estimators::weighting(scene).weights(scene.estimator.window_samples)?;
    let (sum, squares) = weights.iter().fold((0.0, 0.0), |(sum, squares), h| (sum + h, squares + h * h));
    // the Gaussian with the same ratio of sum and squares, and so with the same band of noise
    let window_s = sum * sum / squares / (2.0 * PI.sqrt()) / scene.detector.sampling_hz;
    let width_s = sigma_s * window_s / sigma_s.hypot(window_s);
    Ok(2.0 * PI.sqrt() * width_s * scene.detector.bandwidth_hz)
}

/// The table `range_m,snr_db,n_eff,false_alarm,threshold,detection,needed_snr_db,false_alarm_best`: threshold over the noise in a cell,
/// the share of signals found at a gate, the ratio in the band that is found nine times in ten, and the rate at which the best of
/// all cells of a gate is a false alarm.
///
/// # Errors
/// A scene without noise; what the crates refuse.
pub fn gate_table(plan: &Plan, false_alarm: f64, observer: &dyn Observer) -> Result<Table, Error> {
    let scene = &plan.scene.scene;
    let gain = peak_gain(scene, plan.instrument.pulse.sigma_s())?;
    let d = &scene.detector;
    let cells = (3.0 * d.bandwidth_hz * scene.estimator.window_samples as f64 / d.sampling_hz).max(1.0);
    let best = CellTest::best_of(cells, false_alarm)?;
    let points = bound(plan, observer)?.by_range;
    let of = |point: &BoundPoint| -> Result<[f64; 3], Error> {
        let test = CellTest::known_noise(point.n_eff)?;
        let threshold = test.threshold(false_alarm)?;
        let snr = 10f64.powf(0.1 * point.snr_db);
        let found = if snr.is_finite() { test.probability(threshold, gain * snr)? } else { false_alarm };
        Ok([threshold, found, 10.0 * (test.needed_snr(false_alarm, 0.9)? / gain).log10()])
    };
    let rows = points.iter().map(of).collect::<Result<Vec<_>, Error>>()?;
    let column = |i: usize| rows.iter().map(move |row| row[i]).collect::<Vec<_>>();
    Ok(Table::new()
        .float("range_m", points.iter().map(|p| p.range_m))
        .float("snr_db", points.iter().map(|p| p.snr_db))
        .float("n_eff", points.iter().map(|p| p.n_eff))
        .float("false_alarm", points.iter().map(|_| false_alarm))
        .float("threshold", column(0))
        .float("detection", column(1))
        .float("needed_snr_db", column(2))
        .float("false_alarm_best", points.iter().map(|_| best)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_of_table_2_is_ten_times_the_noise_at_0_db() {
        let scene = Scene::default();
        let gain = peak_gain(&scene, scene.pulse_sigma_s()).unwrap();
        // that of a Gaussian window; the default one is not Gaussian, and its equal in the band of noise is 7 % below
        assert!((gain - 10.0).abs() < 1.0, "{gain}");
    }
}
