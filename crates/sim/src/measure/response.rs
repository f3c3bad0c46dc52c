//! What the estimator of a scene makes of a wake, for fits to its maps, and what fits to its signals must know.
//!
//! Check: circulations fitted to maps and signals of a pair, in the tests of sweeps and retrievals.

use crate::Error;
use crate::measure::ray_information::RayInformation;
use crate::measure::region::{places, region_radius};
use crate::measure::scan::{Scanner, median_snr};
use crate::plan::estimators::{Response, response};
use crate::plan::{Plan, Target};
use crate::progress::Observer;
use crate::scene::{Scene, SceneFile};
use wakescope_estimate::bound::Noise;
use wakescope_estimate::retrieval::ScanEstimator;
use wakescope_estimate::vortex_fit::{EstimatorResponse, ScanSetup, WakeModel};
use wakescope_estimate::window::Sample;
use wakescope_estimate::{Correlogram, Estimator, Radius};

/// Pulse, noise and signal-to-noise ratio of a scene's signals, and the estimator of its maps.
pub struct SceneResponse {
    pub(crate) scene: Scene,
    response: Option<Response>,
    pulse_sigma_s: f64,
    noise: Noise,
    /// Mean square of the noise of the samples in the detector band, A^2.
    pub(crate) noise_power_a2: f64,
    layer_snr: Vec<(f64, f64)>,
    radius: Radius,
}

impl SceneResponse {
    /// That of a scene in still air, so that no flow is opened; nothing without noise, or where the pulse is no Gaussian.
    ///
    /// # Errors
    /// What the efficiency refuses; a checked scene gives none.
    pub fn of_scene(scene: &SceneFile, observer: &dyn Observer) -> Result<Option<Self>, Error> {
        let plan = Plan::without_stages(scene.in_still_air()?, Target::Map)?;
        Self::new(&plan, Scanner::expected_layer_snr(&plan, observer)?)
    }

    /// Nothing where there is no noise, or the pulse is no Gaussian. `layer_snr` holds range, m, and expected
    /// signal-to-noise ratio of the layers of a line.
    ///
    /// # Errors
    /// What the regions refuse; a checked scene gives none.
    pub(crate) fn new(plan: &Plan, layer_snr: Vec<(f64, f64)>) -> Result<Option<Self>, Error> {
        let scene = plan.scene();
        let pulse = &plan.instrument.pulse;
        let Some(noise) = scene.noise_spectrum().filter(|_| scene.pulse.is_gaussian()) else {
            return Ok(None);
        };
        let of_rays = RayInformation::new(plan, &layer_snr)?;
        let radius = region_radius(&of_rays, &places(scene, &plan.geometry)?)?;
        let response = response(scene, pulse, median_snr(&layer_snr)).ok();
        let noise_power_a2 = plan.instrument.receiver.sampled_noise_a2();
        Ok(Some(Self {
            scene: scene.clone(),
            response,
            pulse_sigma_s: pulse.sigma_s(),
            noise,
            noise_power_a2,
            layer_snr,
            radius,
        }))
    }

    /// Expected signal-to-noise ratio of the layer nearest to a range, a power ratio.
    pub(crate) fn snr_at(&self, range_m: f64) -> f64 {
        let nearest = self
            .layer_snr
            .iter()
            .min_by(|a, b| (a.0 - range_m).abs().total_cmp(&(b.0 - range_m).abs()));
        nearest.map_or(0.0, |(_, snr)| *snr)
    }

    /// Radius of the regions of the maps at a range, m.
    fn radius_m(&self, range_m: f64) -> f64 {
        self.radius.at_m(range_m).unwrap_or(0.0)
    }

    /// What the estimator shows at about a range, each line for itself.
    fn of_lines<'r, S: Sample>(
        &'r self,
        correlogram: &Correlogram<S>,
        estimator: &'r dyn Estimator,
        range_m: f64,
    ) -> Result<EstimatorResponse<'r>, Error> {
        let noise = (self.noise, self.snr_at(range_m));
        Ok(EstimatorResponse::new(
            correlogram,
            estimator,
            &self.scene.sampling()?,
            self.pulse_sigma_s,
            noise,
            0.0,
        )?)
    }

    /// How the records of lines at elevations, rad, were taken.
    pub(crate) fn setup(
        &self,
        wake: WakeModel,
        elevation_rad: Vec<f64>,
    ) -> Result<ScanSetup, Error> {
        let scene = &self.scene;
        Ok(ScanSetup {
            sampling: scene.sampling()?,
            kind: scene.signal_kind(),
            noise: self.noise,
            pulse_sigma_s: self.pulse_sigma_s,
            wake,
            elevation_rad,
            first_sample_time_s: 2.0 * scene.scan.range_min_m / crate::SPEED_OF_LIGHT_M_S,
            record_samples: scene.samples_per_record(),
        })
    }
}

impl ScanEstimator for SceneResponse {
    fn response(&self, range_m: f64) -> Option<EstimatorResponse<'_>> {
        let of_lines = match self.response.as_ref()? {
            Response::Real(all, estimator) => self.of_lines(all, &**estimator, range_m),
            Response::Complex(all, estimator) => self.of_lines(all, &**estimator, range_m),
        };
        Some(of_lines.ok()?.with_radius(|range_m| self.radius_m(range_m)))
    }

    fn correlated_lines(&self, spacing_rad: f64, range_m: f64) -> usize {
        (2.0 * self.radius_m(range_m) / (spacing_rad * range_m)) as usize
    }

    fn gate_stride(&self, range_m: &[f64]) -> usize {
        let period_s = 1.0 / self.scene.detector.sampling_hz;
        let apart_m = 0.25
            * self.scene.estimator.window_samples as f64
            * 0.5
            * crate::SPEED_OF_LIGHT_M_S
            * period_s;
        // files round their ranges
        ((apart_m / spacing_m(range_m) - 1e-3).ceil() as usize).max(1)
    }

    fn half_window_m(&self) -> f64 {
        0.5 * self.scene.estimator.window_samples as f64 * self.scene.sample_spacing_m()
    }
}

/// Mean distance of ranges, m.
fn spacing_m(range_m: &[f64]) -> f64 {
    let length_m = range_m.last().copied().unwrap_or(0.0) - range_m.first().copied().unwrap_or(0.0);
    length_m / (range_m.len().max(2) - 1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::RegionRadius;
    use wakescope_estimate::vortex_fit::Wake;

    #[test]
    fn what_is_shown_has_regions_of_the_radius_that_the_map_has_at_each_range() {
        let shown = |radius_m: f64, radius: RegionRadius| {
            let mut scene = Scene::default();
            (scene.estimator.radius_m, scene.estimator.radius) = (radius_m, radius);
            let plan = Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap();
            let snr: Vec<(f64, f64)> = plan
                .geometry
                .layer_range_m()
                .map(|range_m| (range_m, 1.0))
                .collect();
            let response = SceneResponse::new(&plan, snr).unwrap().unwrap();
            let wake = Wake::from_array(&[
                480.0, 520.0, 376.5, 45.0, 423.5, 49.0, 2.5, 2.5, 1.3, 0.0, 0.0,
            ]);
            let lines: Vec<f64> = (0..20).map(|line| 0.1 + 2.5e-3 * f64::from(line)).collect();
            let shown = response.response(400.0).unwrap();
            let map = shown
                .map(&WakeModel::default(), &wake, &lines, &[376.5, 423.5])
                .unwrap();
            (map, response.correlated_lines(2.5e-3, 400.0))
        };
        let table = |radius_m| RegionRadius::OfRange {
            range_m: vec![300.0, 500.0],
            radius_m,
        };
        let six = shown(6.0, RegionRadius::Fixed {});
        assert_eq!(shown(2.0, table(vec![6.0, 6.0])), six);
        assert_ne!(shown(2.0, RegionRadius::Fixed {}).0, six.0);
        assert_eq!(six.1, 12);
        // Regions that are as large as may be in order to reach a deviation that none has.
        let target = RegionRadius::Target {
            standard_deviation_m_s: 1e-3,
            largest_m: 6.0,
        };
        assert_eq!(shown(2.0, target), six);
    }
}
