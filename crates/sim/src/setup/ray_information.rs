//! What the record of one pulse says of the velocity about a range, for bounds, regions and stated errors.
//!
//! Check: the stored bound of one window; estimates of whole regions, which no bound may pass.

use crate::scene::NoiseModel;
use crate::setup::Setup;
use crate::setup::estimators;
use crate::setup::table::of_table;
use crate::{Error, SPEED_OF_LIGHT_M_S};
use wakescope_estimate::{Gates, bound::RecordModel};
use wakescope_signal::RangeFilter;

/// Signal-to-noise ratios of which a bound is made: no noise is as little as the last.
const SNR: std::ops::RangeInclusive<f64> = 1e-8..=1e6;

/// Whether ratios are within a factor of two of each other.
fn alike(a: f64, b: f64) -> bool {
    b <= 2.0 * a && a <= 2.0 * b
}

/// Signal-to-noise ratio of the samples of a scene's records, and the information in windows of them.
pub(crate) struct RayInformation {
    model: RecordModel,
    gates: Gates,
    /// Range between samples, m.
    spacing_m: f64,
    filter: RangeFilter,
    layer_m: Vec<f64>,
    layer_snr: Vec<f64>,
    is_noisy: bool,
}

impl RayInformation {
    /// For a planned scene; `layer_snr` holds range, m, and expected signal-to-noise ratio of the layers of its lines.
    ///
    /// # Errors
    /// What the crates refuse; a checked scene gives none.
    pub(crate) fn new(setup: &Setup, layer_snr: &[(f64, f64)]) -> Result<Self, Error> {
        let (scene, g, pulse) = (&setup.scene.scene, &setup.geometry, &setup.instrument.pulse);
        let (layer_m, layer_snr) = layer_snr.iter().copied().unzip();
        Ok(Self {
            model: estimators::record_model(scene, pulse)?,
            gates: estimators::gates(scene)?,
            spacing_m: 0.5 * SPEED_OF_LIGHT_M_S / scene.detector.sampling_hz,
            filter: RangeFilter::pulse(pulse, g.layer_thickness_m)?,
            layer_m,
            layer_snr,
            is_noisy: scene.detector.noise != NoiseModel::None,
        })
    }

    /// Signal-to-noise ratio at a range, a power ratio: that of the air there, or the mean of what the pulse lights beside it where
    /// that is of another order, as beside a cloud.
    pub(crate) fn snr_at(&self, range_m: f64) -> Result<f64, Error> {
        let (here, seen) = (of_table(&self.layer_m, &self.layer_snr, range_m), self.seen_snr(range_m)?);
        Ok(if alike(here, seen) { here } else { seen })
    }

    /// Mean ratio of a sample that sees a range: the pulse lights layers before and behind it.
    fn seen_snr(&self, range_m: f64) -> Result<f64, Error> {
        let mut snr = [0.0];
        self.filter.apply_into(self.layer_m[0], &self.layer_snr, &[range_m], &mut snr)?;
        Ok(snr[0])
    }

    /// Information on the velocity, 1/(m/s)^2, in 1, 2, .. `count` windows about a range, each sample having the ratio that it sees.
    pub(crate) fn at(&self, range_m: f64, count: usize) -> Result<Vec<f64>, Error> {
        if !self.is_noisy {
            return self.of_snr(*SNR.end(), count);
        }
        // The samples of a window are centred half a sample before its range.
        let seen = |samples: f64| self.seen_snr(range_m + (samples - 0.5) * self.spacing_m);
        let snr = |samples: f64| seen(samples).map_or(f64::NAN, |snr| snr.clamp(0.0, *SNR.end()));
        Ok(self.model.information(&self.gates, count, snr)?)
    }

    /// The same where all samples have one signal-to-noise ratio.
    pub(crate) fn of_snr(&self, snr: f64, count: usize) -> Result<Vec<f64>, Error> {
        let snr = snr.clamp(*SNR.start(), *SNR.end());
        Ok(self.model.information(&self.gates, count, |_| snr)?)
    }
}
