//! The standard deviation that the Cramer-Rao bound predicts for an estimate at its signal-to-noise ratio.
//!
//! Of one window, over the root of the independent windows. Check: at the ratio of the scene, the bound of the scene.

use crate::Error;
use crate::io::Table;
use crate::measure::estimators;
use crate::measure::map::VelocityEstimates;
use crate::measure::region::of_table;
use crate::plan::Plan;

/// Signal-to-noise ratios of the curve, dB.
const SNR_DB: std::ops::RangeInclusive<i32> = -40..=60;

/// The bound of one window against the signal-to-noise ratio.
pub(super) struct PredictedDeviation {
    snr_db: Vec<f64>,
    /// Logarithm of the bound in m/s, which is nearly straight.
    logarithm: Vec<f64>,
}

impl PredictedDeviation {
    /// For the windows of a scene; nothing without noise.
    pub(super) fn new(plan: &Plan) -> Result<Option<Self>, Error> {
        let scene = &plan.scene.scene;
        let Some(model) = estimators::window_model(scene, scene.detector.noise, &plan.instrument.pulse)? else {
            return Ok(None);
        };
        let snr_db: Vec<f64> = SNR_DB.map(f64::from).collect();
        let bound = |db: &f64| estimators::bound_m_s(&model, 10f64.powf(0.1 * db), estimators::signal_kind(scene));
        let logarithm = snr_db.iter().map(|db| Ok(bound(db)?.ln())).collect::<Result<_, Error>>()?;
        Ok(Some(Self { snr_db, logarithm }))
    }

    /// The standard deviation of an estimate, m/s; NaN where the ratio or the windows are not known.
    pub(super) fn m_s(&self, snr_db: f64, n_eff: f64) -> f64 {
        match snr_db.is_nan() || n_eff.is_nan() || n_eff <= 0.0 {
            true => f64::NAN,
            false => (of_table(&self.snr_db, &self.logarithm, snr_db)).exp() / n_eff.sqrt(),
        }
    }
}

/// What the bound predicts for the estimates of a run: `range_m, elevation_rad, snr_db, n_eff, predicted_std_m_s`.
///
/// # Errors
/// What the estimators refuse; a checked scene gives none.
pub fn predicted_table(plan: &Plan, map: &VelocityEstimates) -> Result<Table, Error> {
    let predicted = PredictedDeviation::new(plan)?;
    let (snr_db, n_eff) = (map.snr_db.iter().copied(), map.n_eff.iter().copied());
    let of = |(snr_db, n_eff)| predicted.as_ref().map_or(f64::NAN, |predicted| predicted.m_s(snr_db, n_eff));
    let column: Vec<f64> = snr_db.zip(n_eff).map(of).collect();
    let gates = map.range_m.len();
    Ok(Table::new()
        .float("range_m", (0..column.len()).map(|i| map.range_m[i % gates]))
        .float("elevation_rad", (0..column.len()).map(|i| map.elevation_rad[i / gates]))
        .float("snr_db", map.snr_db.iter().copied())
        .float("n_eff", map.n_eff.iter().copied())
        .float("predicted_std_m_s", column))
}
