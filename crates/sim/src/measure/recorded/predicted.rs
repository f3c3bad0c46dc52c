//! What is predicted for the error of an estimate at its signal-to-noise ratio: the standard deviation by the Cramer-Rao bound of the
//! records that the chords of its region cover, and the bias that the method has in the scene's noise.
//!
//! Check: at the ratio of the scene, the bound of the scene; the mean error of very many windows.

use crate::Error;
use crate::interpolation::interpolate;
use crate::io::Table;
use crate::measure::map::VelocityEstimates;
use crate::measure::ray_information::RayInformation;
use crate::measure::region::places;
use crate::plan::Plan;
use crate::plan::estimators::ExpectedBias;
use crate::scene::NoiseModel;
use wakescope_estimate::map::{PolarPoint, ScanGeometry};

/// Signal-to-noise ratios of the curve, dB.
const SNR_DB: std::ops::RangeInclusive<i32> = -40..=60;

/// What pulses say against the signal-to-noise ratio, for the lines of a scan.
pub(crate) struct PredictedError {
    bias: Option<ExpectedBias>,
    places: ScanGeometry,
    snr_db: Vec<f64>,
    /// Information on the velocity, 1/(m/s)^2, in 1, 2, .. windows of a pulse, for each ratio.
    by_gates: Vec<Vec<f64>>,
    /// 1, 2, ..: the windows of a chord in the place of their information.
    windows: Vec<f64>,
}

impl PredictedError {
    /// For regions of a scan of a scene that have at most the radius `largest_m`.
    pub(crate) fn new(plan: &Plan, places: ScanGeometry, largest_m: f64) -> Result<Self, Error> {
        let is_noisy = plan.scene().detector.noise != NoiseModel::None;
        let of_rays = RayInformation::new(plan, &[])?;
        let count = places.most_gates(largest_m);
        let of_snr = |db: f64| of_rays.of_snr(10f64.powf(0.1 * db), count);
        // Without noise no estimate has a ratio.
        let snr_db: Vec<f64> = SNR_DB.filter(|_| is_noisy).map(f64::from).collect();
        let by_gates = snr_db
            .iter()
            .map(|db| of_snr(*db))
            .collect::<Result<_, Error>>()?;
        let bias = ExpectedBias::new(plan.scene(), &plan.instrument)?;
        Ok(Self {
            bias,
            places,
            snr_db,
            by_gates,
            windows: (1..=count).map(|windows| windows as f64).collect(),
        })
    }

    /// The bias of an estimate, m/s: that at the velocity which it would have without; NaN where it is not known.
    pub(super) fn bias_m_s(&self, velocity_m_s: f64, snr_db: f64) -> f64 {
        let Some(bias) = &self.bias else {
            return f64::NAN;
        };
        if velocity_m_s.is_nan() || snr_db.is_nan() {
            return f64::NAN;
        }
        let at = |velocity_m_s: f64| bias.m_s(velocity_m_s, 10f64.powf(0.1 * snr_db));
        at(velocity_m_s - at(velocity_m_s))
    }

    /// The standard deviation of an estimate from `level` of the windows about a point, m/s; NaN where there is none, or no ratio.
    pub(crate) fn deviation_m_s(
        &self,
        point: PolarPoint,
        radius_m: f64,
        level: f64,
        snr_db: f64,
    ) -> f64 {
        if snr_db.is_nan() || level.is_nan() || level <= 0.0 {
            return f64::NAN;
        }
        // Nearly straight between the ratios of the curve.
        let below =
            (self.snr_db.partition_point(|db| *db <= snr_db)).clamp(1, self.snr_db.len() - 1) - 1;
        let curves = [
            &self.by_gates[below],
            &self.by_gates[below + 1],
            &self.windows,
        ];
        let [low, high, whole] =
            self.places
                .information(point, radius_m, curves.map(Vec::as_slice));
        let ends = [low.ln(), high.ln()];
        (interpolate(&self.snr_db[below..below + 2], &ends, snr_db).exp() * level / whole)
            .sqrt()
            .recip()
    }
}

/// What is predicted for the estimates of a run: `range_m, elevation_rad, snr_db, n_eff, predicted_std_m_s, predicted_bias_m_s`.
///
/// # Errors
/// What the estimators refuse; a checked scene gives none.
pub fn predicted_table(plan: &Plan, map: &VelocityEstimates) -> Result<Table, Error> {
    let places = places(plan.scene(), &plan.geometry)?;
    let points = places.points(&map.range_m);
    let largest_m = map.radius_m.iter().copied().fold(0.0, f64::max);
    let predicted = PredictedError::new(plan, places, largest_m)?;
    let gates = map.range_m.len();
    let of = |(at, ((snr_db, level), velocity_m_s)): (usize, ((&f64, &f64), &f64))| {
        let deviation_m_s =
            predicted.deviation_m_s(points[at], map.radius_m[at % gates], *level, *snr_db);
        (deviation_m_s, predicted.bias_m_s(*velocity_m_s, *snr_db))
    };
    let rows = map
        .snr_db
        .iter()
        .zip(&map.level)
        .zip(&map.v_mean_m_s)
        .enumerate();
    let (column, bias_m_s): (Vec<f64>, Vec<f64>) = rows.map(of).unzip();
    Ok(Table::new()
        .float("range_m", (0..column.len()).map(|i| map.range_m[i % gates]))
        .float(
            "elevation_rad",
            (0..column.len()).map(|i| map.elevation_rad[i / gates]),
        )
        .float("snr_db", map.snr_db.iter().copied())
        .float("n_eff", map.n_eff.iter().copied())
        .float("predicted_std_m_s", column)
        .float("predicted_bias_m_s", bias_m_s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Target;
    use crate::scene::SceneFile;
    use crate::{Silent, measure::bound::bound, run::run};

    /// Air of 6 m/s along four lines that share nothing, at 10 dB.
    fn plan(detector: &str, estimator: &str) -> Plan {
        let text = format!(
            "[detector]\n{detector}\nsnr = {{ reference = \"fixed\", snr_db = 10.0 }}\n[flow]\nkind = \"uniform\"\nlateral_m_s = 6.0\nvertical_m_s = 0.0\n\
             [scan]\nelevation_min_rad = 0.0\nelevation_max_rad = 0.06\nelevation_step_rad = 0.02\nrange_min_m = 320.0\n\
             range_max_m = 400.0\npulses_per_line = 20\nrealisations = 16\n[estimator]\nradius_m = 3.0\ngate_step_samples = 8\n{estimator}"
        );
        Plan::new(
            SceneFile::parse(&text, std::path::Path::new("s.toml")).unwrap(),
            Target::Map,
        )
        .unwrap()
    }

    #[test]
    fn stated_bias_is_that_of_many_pulses() {
        for (detector, method, least_m_s) in [
            ("", "method.kind = \"pulse_pair\"\n", 0.4),
            (
                "",
                "method = { kind = \"autoregressive\", order = 12 }\nweighting = \"rectangular\"\n",
                0.03,
            ),
            (
                "signal = \"baseband\"",
                "method.kind = \"pulse_pair\"\n",
                0.2,
            ),
            (
                "noise = \"white\"\nsignal = \"baseband\"",
                "method.kind = \"pulse_pair\"\n",
                0.0,
            ),
        ] {
            let plan = plan(detector, method);
            let map = run(&plan, &Silent).unwrap().map.unwrap();
            let places = places(plan.scene(), &plan.geometry).unwrap();
            let predicted = PredictedError::new(&plan, places, 3.0).unwrap();
            let count = map.bias_m_s.len() as f64;
            let mut found_m_s = 0.0;
            let mut stated_m_s = 0.0;
            for (bias_m_s, truth_m_s) in map.bias_m_s.iter().zip(&map.v_pulse_m_s) {
                found_m_s += bias_m_s / count;
                stated_m_s += predicted.bias_m_s(truth_m_s + bias_m_s, 10.0) / count;
            }
            // Lines and realisations are independent, gates hardly.
            let error_m_s = map.std_m_s.mean().unwrap() / 64_f64.sqrt();
            assert!(
                (found_m_s - stated_m_s).abs() < 3.5 * error_m_s + 0.01,
                "{method}: {found_m_s} {stated_m_s} +- {error_m_s}"
            );
            assert!(stated_m_s.abs() >= least_m_s, "{method}: {stated_m_s}");
        }
    }

    #[test]
    fn stated_deviation_is_the_bound_of_the_region_and_of_what_is_left_of_it() {
        for estimator in ["", "window_samples = 16\n"] {
            let plan = plan("", estimator);
            let found = bound(&plan, &Silent).unwrap().by_range[3];
            let places = places(plan.scene(), &plan.geometry).unwrap();
            let predicted = PredictedError::new(&plan, places, 3.0).unwrap();
            let point = PolarPoint::on_line(found.range_m, 2);
            let of = |level: f64, snr_db: f64| predicted.deviation_m_s(point, 3.0, level, snr_db);
            let whole = found.level as f64;
            assert!(
                (of(whole, 10.0) / found.region_m_s - 1.0).abs() < 1e-6,
                "{} {found:?}",
                of(whole, 10.0)
            );
            assert!((of(0.25 * whole, 10.0) / of(whole, 10.0) - 2.0).abs() < 1e-9);
            assert!(
                of(0.0, 10.0).is_nan()
                    && of(whole, f64::NAN).is_nan()
                    && of(whole, 7.3) > of(whole, 7.4)
            );
        }
    }
}
