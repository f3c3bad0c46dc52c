//! What the record of one pulse says of the velocity about a range, for bounds, regions and stated errors.
//!
//! Check: the stored bound of one window; estimates of whole regions, which no bound may pass.

use crate::Error;
use crate::plan::Plan;
use crate::plan::estimators;
use crate::scene::NoiseModel;
use wakescope_estimate::bound::RecordModel;
use wakescope_signal::RangeFilter;

/// Signal-to-noise ratios of which a bound is made: no noise is as little as the last.
const SNR: std::ops::RangeInclusive<f64> = 1e-8..=1e6;

/// Weight of the air about the range of a gate: of the pulse and of the window.
pub(crate) fn range_filter(plan: &Plan) -> Result<RangeFilter, Error> {
    let scene = plan.scene();
    let window = scene.weighting().weights(scene.estimator.window_samples)?;
    let thickness_m = plan.geometry.layer_thickness_m;
    Ok(RangeFilter::gate(
        &plan.instrument.pulse,
        &window,
        scene.detector.sampling_hz,
        thickness_m,
    )?)
}

/// Signal-to-noise ratio of the samples of a scene's records, and the information in windows of them.
pub(crate) struct RayInformation<'a> {
    pub(crate) plan: &'a Plan,
    model: RecordModel,
    by_pulse: RangeFilter,
    by_gate: RangeFilter,
    /// Ranges of the layers, m, and their signal-to-noise ratios.
    pub(crate) layer_m: Vec<f64>,
    pub(crate) layer_snr: Vec<f64>,
}

impl<'a> RayInformation<'a> {
    /// For a planned scene; `layer_snr` holds range, m, and expected signal-to-noise ratio of the layers of its lines.
    ///
    /// # Errors
    /// What the crates refuse; a checked scene gives none.
    pub(crate) fn new(plan: &'a Plan, layer_snr: &[(f64, f64)]) -> Result<Self, Error> {
        let scene = plan.scene();
        let g = &plan.geometry;
        let pulse = &plan.instrument.pulse;
        let (layer_m, layer_snr) = layer_snr.iter().copied().unzip();
        let model = estimators::record_model(scene, pulse)?;
        let by_pulse = RangeFilter::pulse(pulse, g.layer_thickness_m)?;
        Ok(Self {
            plan,
            model,
            by_pulse,
            by_gate: range_filter(plan)?,
            layer_m,
            layer_snr,
        })
    }

    /// Signal-to-noise ratios of the windows about some ranges, power ratios: means over what pulse and window see.
    pub(crate) fn of_windows(&self, range_m: &[f64]) -> Result<Vec<f64>, Error> {
        let mut snr = vec![0.0; range_m.len()];
        self.by_gate
            .apply_into(self.layer_m[0], &self.layer_snr, range_m, &mut snr)?;
        Ok(snr)
    }

    /// Information on the velocity, 1/(m/s)^2, in 1, 2, .. `count` windows about a range, each sample having the ratio that it sees.
    pub(crate) fn at(&self, range_m: f64, count: usize) -> Result<Vec<f64>, Error> {
        let scene = self.plan.scene();
        let g = &self.plan.geometry;
        if scene.detector.noise == NoiseModel::None {
            return self.of_snr(*SNR.end(), count);
        }
        let snr = |samples: f64| {
            // The samples of a window are centred half a sample before its range; the pulse lights layers before and behind each.
            self.of_sample(range_m + (samples - 0.5) * g.sample_spacing_m)
        };
        Ok(self.model.information(&scene.gates()?, count, snr)?)
    }

    /// Signal-to-noise ratio of a sample. Rows of windows at the ends of the record go on beyond it, where layers are missing: those
    /// samples have the ratio of the nearest one for which it is known.
    fn of_sample(&self, at_m: f64) -> f64 {
        let snr = self.seen_by_pulse(at_m);
        if !snr.is_nan() {
            return snr;
        }
        let g = &self.plan.geometry;
        let spacing_m = g.sample_spacing_m;
        let last_m = g.first_sample_m + (g.samples - 1) as f64 * spacing_m;
        let end_m = at_m.clamp(g.first_sample_m, last_m);
        let step_m = spacing_m.copysign(at_m - end_m);
        let mut nearest = self.seen_by_pulse(end_m);
        // Samples beyond the end of the record: up to one it is known, from another one it is not.
        let mut known = 0;
        let mut unknown = ((at_m - end_m).abs() / spacing_m).ceil() as usize;
        while unknown > known + 1 {
            let middle = (known + unknown) / 2;
            let snr = self.seen_by_pulse(end_m + middle as f64 * step_m);
            if snr.is_nan() {
                unknown = middle;
            } else {
                known = middle;
                nearest = snr;
            }
        }
        nearest
    }

    /// Signal-to-noise ratio of a sample, the mean over what the pulse lights; NaN where more than half of that is not known.
    fn seen_by_pulse(&self, at_m: f64) -> f64 {
        let mut snr = [0.0];
        let seen = self
            .by_pulse
            .apply_into(self.layer_m[0], &self.layer_snr, &[at_m], &mut snr);
        seen.map_or(f64::NAN, |()| snr[0].clamp(0.0, *SNR.end()))
    }

    /// The same where all samples have one signal-to-noise ratio.
    pub(crate) fn of_snr(&self, snr: f64, count: usize) -> Result<Vec<f64>, Error> {
        let snr = snr.clamp(*SNR.start(), *SNR.end());
        Ok(self
            .model
            .information(&self.plan.scene().gates()?, count, |_| snr)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SPEED_OF_LIGHT_M_S;
    use crate::plan::{Plan, Target};
    use crate::scene::SceneFile;

    #[test]
    fn a_window_has_the_ratio_that_pulse_and_window_see_where_it_falls_steeply() {
        let text = "[pulse.shape]\nduration_s = 200e-9\n[estimator]\nwindow_samples = 48\nweighting = \"hann\"\n";
        let plan = Plan::new(
            SceneFile::parse(text, std::path::Path::new("s.toml")).unwrap(),
            Target::Map,
        )
        .unwrap();
        // By e in 20 m, as behind a focus: exp(v/(2 * 20^2)) more through a pulse of the variance v.
        let fall_m = 20.0;
        let thickness_m = plan.geometry.layer_thickness_m;
        let of_air = |range_m: f64| 3.0 * (-(range_m - 400.0) / fall_m).exp();
        let layers: Vec<(f64, f64)> = (0..4000)
            .map(|i| 200.0 + f64::from(i) * thickness_m)
            .map(|range_m| (range_m, of_air(range_m)))
            .collect();
        let found = RayInformation::new(&plan, &layers)
            .unwrap()
            .of_windows(&[350.0, 401.3])
            .unwrap();
        let variance_m2 = 0.5 * plan.instrument.pulse.sigma_m().powi(2);
        let spacing_m = 0.5 * SPEED_OF_LIGHT_M_S / 250e6;
        for (found, range_m) in found.into_iter().zip([350.0, 401.3]) {
            let mut sum = 0.0;
            let mut total = 0.0;
            for n in 0..48 {
                let h2 = (std::f64::consts::PI * (f64::from(n) - 23.5) / 48.0)
                    .cos()
                    .powi(4);
                sum += h2 * of_air(range_m + (f64::from(n) - 24.0) * spacing_m);
                total += h2;
            }
            let right = sum / total * (0.5 * variance_m2 / fall_m.powi(2)).exp();
            assert!((found / right - 1.0).abs() < 1e-5, "{found} {right}");
            assert!(right > 1.15 * of_air(range_m), "{right}");
        }
    }
    #[test]
    fn rows_of_windows_go_on_beyond_the_record_with_the_ratio_of_its_ends() {
        let text = "[pulse.shape]\nduration_s = 50e-9\n";
        let file = SceneFile::parse(text, std::path::Path::new("s.toml")).unwrap();
        let plan = Plan::new(file, Target::Map).unwrap();
        let g = &plan.geometry;
        let same: Vec<(f64, f64)> = g.layer_range_m().map(|range_m| (range_m, 3.0)).collect();
        let rays = RayInformation::new(&plan, &same).unwrap();
        // 75 windows to either side, 45 m; the layers reach some 17 m beyond the record.
        let expected = rays.of_snr(3.0, 150).unwrap();
        for range_m in [g.gate_range_m[0], g.gate_range_m[g.gate_range_m.len() - 1]] {
            let found = rays.at(range_m, 150).unwrap();
            assert_eq!(found.len(), expected.len());
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
            }
        }
        let rising: Vec<(f64, f64)> = g
            .layer_range_m()
            .map(|range_m| (range_m, range_m / 100.0))
            .collect();
        let rays = RayInformation::new(&plan, &rising).unwrap();
        let before = rays.of_sample(-50.0);
        let first_layer = g.first_layer_range_m / 100.0;
        let first_sample = g.first_sample_m / 100.0;
        assert!(
            before > first_layer && before < first_sample,
            "{first_layer} {before} {first_sample}"
        );
    }
}
