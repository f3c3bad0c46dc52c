//! False alarms and detections of single gates, in closed form: the cell of a mean spectrum against the known noise.
//!
//! A window's signal-to-noise ratio in the band is spread over the width of its spectrum. The cell of the peak has S times the noise,
//!
//! ```text
//! S = SNR (B/F_s) sum_nm h_n h_m exp(-(n - m)^2/(4 (sigma F_s)^2)) / sum_n h_n^2
//! ```
//!
//! h the window, sigma the half-width of the pulse's power at 1/e: its power at zero lag, seen through the window, over noise of equal density in
//! the band B. For a Gaussian window that is not cut off it is SNR v_B kappa/sqrt(pi), v_B = lambda B/2, kappa = 4 pi sigma_p/lambda, sigma_p =
//! sigma sigma_h/sqrt(sigma^2 + sigma_h^2): 10.0 at 0 dB for 64 ns; cut off at 256 ns, as Table 2's is, 9.4. Check: that form; the closed forms in `CellTest`.

use crate::Error;
use crate::io::Table;
use crate::measure::bound::{BoundPoint, bound};
use crate::plan::Plan;
use crate::setup::estimators;
use crate::setup::progress::Observer;
use wakescope_estimate::estimators::CellTest;

/// Power of the signal over that of the noise in the cell of the peak, at a ratio of 1 in a band of `band` over the rate of samples, for
/// a pulse of `sigma` intervals.
fn peak_gain(window: &[f64], sigma: f64, band: f64) -> f64 {
    let lag = |n: usize, m: usize| (n as f64 - m as f64) / sigma;
    let row = |n: usize| {
        window
            .iter()
            .enumerate()
            .map(move |(m, h)| h * (-0.25 * lag(n, m).powi(2)).exp())
            .sum::<f64>()
    };
    let power: f64 = window.iter().enumerate().map(|(n, h)| h * row(n)).sum();
    band * power / window.iter().map(|h| h * h).sum::<f64>()
}

/// The table `range_m,snr_db,n_eff,false_alarm,threshold,detection,needed_snr_db,false_alarm_best`: threshold over the noise in a cell,
/// the share of signals found at a gate, the ratio in the band that is found nine times in ten, and the rate at which the best of
/// all cells of a gate is a false alarm.
///
/// # Errors
/// A scene without noise; what the crates refuse.
pub fn gate_table(plan: &Plan, false_alarm: f64, observer: &dyn Observer) -> Result<Table, Error> {
    let scene = &plan.scene.content;
    let d = &scene.detector;
    let window = estimators::weighting(scene).weights(scene.estimator.window_samples)?;
    let gain = peak_gain(
        &window,
        plan.instrument.pulse.sigma_s() * d.sampling_hz,
        d.bandwidth_hz / d.sampling_hz,
    );
    let cells =
        (3.0 * d.bandwidth_hz * scene.estimator.window_samples as f64 / d.sampling_hz).max(1.0);
    let best = CellTest::best_of(cells, false_alarm)?;
    let points = bound(plan, observer)?.by_range;
    let of = |point: &BoundPoint| -> Result<[f64; 3], Error> {
        let test = CellTest::known_noise(point.n_eff)?;
        let threshold = test.threshold(false_alarm)?;
        let snr = 10f64.powf(0.1 * point.snr_db);
        let found = if snr.is_finite() {
            test.probability(threshold, gain * snr)?
        } else {
            false_alarm
        };
        Ok([
            threshold,
            found,
            10.0 * (test.needed_snr(false_alarm, 0.9)? / gain).log10(),
        ])
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
    use wakescope_estimate::Weighting;

    #[test]
    fn the_peak_of_a_gaussian_window_is_that_of_the_closed_form_and_a_cut_one_is_lower() {
        let sigma = 30.03;
        let closed =
            2.0 * std::f64::consts::PI.sqrt() * 0.2 * sigma * 16.0 / f64::hypot(sigma, 16.0);
        assert!((closed - 10.0).abs() < 0.02, "{closed}");
        let whole = Weighting::Gaussian {
            relative_half_width: 16.0 / 256.0,
        }
        .weights(256)
        .unwrap();
        let gain = peak_gain(&whole, sigma, 0.2);
        assert!((gain / closed - 1.0).abs() < 1e-9, "{gain} {closed}");
        let cut = peak_gain(&Weighting::default().weights(64).unwrap(), sigma, 0.2);
        assert!((9.3..9.5).contains(&cut), "{cut}");
        // one sample: the noise of the whole rate over that of the band
        assert!((peak_gain(&[2.0], sigma, 0.2) - 0.2).abs() < 1e-15);
    }
}
