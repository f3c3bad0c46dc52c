//! What the estimator of a scene makes of a wake, for fits to its maps, and what fits to its signals must know.
//!
//! Check: circulations fitted to maps and signals of a pair, in the tests of sweeps and retrievals.

use crate::measure::estimators::{Response, response, sampling, signal_kind};
use crate::measure::instrument::Instrument;
use crate::measure::scan::mean_snr;
use crate::scene::{Method, NoiseKind, PulseShape as Shape, Scene};
use wakescope_estimate::bound::Noise;
use wakescope_estimate::vortex_fit::{EstimatorResponse, PulseShape, ScanSetup, WakeModel};

/// Pulse, noise and signal-to-noise ratio of a scene's signals, and the estimator of its maps.
pub(crate) struct SceneResponse {
    response: Option<Response>,
    pub(crate) pulse: PulseShape,
    pub(crate) noise: Noise,
    layer_snr: Vec<(f64, f64)>,
}

impl SceneResponse {
    /// Nothing where there is no noise, or the pulse is no Gaussian without chirp. `layer_snr` holds range, m, and expected
    /// signal-to-noise ratio of the layers of a line.
    pub(crate) fn new(scene: &Scene, instrument: &Instrument, layer_snr: Vec<(f64, f64)>) -> Option<Self> {
        let is_gaussian = matches!(scene.pulse.shape, Shape::Gaussian(_)) && scene.pulse.chirp_hz_s == 0.0;
        let noise = match scene.detector.noise {
            NoiseKind::Band => Noise::Band { floor: 0.0 },
            NoiseKind::White => Noise::White,
            NoiseKind::None => return None,
        };
        let pulse = PulseShape::gaussian(instrument.pulse.sigma_s()).ok().filter(|_| is_gaussian)?;
        let response = response(scene, &instrument.pulse, mean_snr(&layer_snr)).ok().flatten();
        Some(Self { response, pulse, noise, layer_snr })
    }

    /// Expected signal-to-noise ratio of the layer nearest to a range, a power ratio.
    pub(crate) fn snr_at(&self, range_m: f64) -> f64 {
        let nearest = self.layer_snr.iter().min_by(|a, b| (a.0 - range_m).abs().total_cmp(&(b.0 - range_m).abs()));
        nearest.map_or(0.0, |(_, snr)| *snr)
    }

    /// What the estimator shows of a wake about a range; nothing for complex signals, for the likelihood of gradients, and for lines
    /// that are shifted.
    pub(crate) fn shown(&self, scene: &Scene, range_m: f64) -> Option<EstimatorResponse<'_>> {
        let Response { correlogram, estimator } = self.response.as_ref()?;
        let noise = (self.noise, self.snr_at(range_m));
        let sampling = sampling(scene).ok()?;
        EstimatorResponse::new(correlogram, &**estimator, &sampling, &self.pulse, noise, radius_m(scene)).ok()
    }

    /// How the records of lines at elevations, rad, were taken.
    pub(crate) fn setup(
        &self,
        scene: &Scene,
        wake: WakeModel,
        elevation_rad: Vec<f64>,
    ) -> Result<ScanSetup, crate::Error> {
        Ok(ScanSetup {
            sampling: sampling(scene)?,
            kind: signal_kind(scene),
            noise: self.noise,
            pulse: self.pulse.clone(),
            wake,
            elevation_rad,
            first_sample_time_s: 2.0 * scene.scan.range_min_m / crate::SPEED_OF_LIGHT_M_S,
            record_samples: scene.samples_per_record(),
        })
    }
}

/// Radius of the regions of a scene's maps, m.
fn radius_m(scene: &Scene) -> f64 {
    if scene.estimator.method == (Method::Periodogram {}) { 0.0 } else { scene.estimator.radius_m }
}

/// Gates of a scene's maps of which neighbours share most of their window say the same: every so-manyth says all.
pub(crate) fn gate_step(scene: &Scene) -> usize {
    (scene.estimator.window_samples / 4).div_ceil(scene.estimator.gate_step_samples).max(1)
}

/// Neighbouring lines, `step_rad` apart, that share windows at a range, m.
pub(crate) fn correlated_lines(scene: &Scene, step_rad: f64, range_m: f64) -> usize {
    (2.0 * radius_m(scene) / (step_rad * range_m)) as usize
}
