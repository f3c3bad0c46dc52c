//! The background of scans whose turbulence is found in each of them.
//!
//! Check: the rate of false alarms in empty scans of turbulence, in the tests across crates.

use super::DetectionSettings;
use crate::Error;
use ndarray::Array2;
use std::borrow::Cow;
use wakescope_estimate::retrieval::{
    Movement, RetrievalOptions, ScanMap, ScanTurbulence, Turbulence, Velocities, fit_scan,
};
use wakescope_estimate::wake_detection::DetectorOptions;

/// Factor of the usual threshold from which a wake is beyond doubt: what it shows is then not counted as turbulence. What the best of many
/// wakes takes from an empty scan must be counted, else alarms are too many.
const BEYOND_DOUBT: f64 = 2.0;

/// The settings of the test of a scan with the turbulence that the scan shows beside its wind and a wake that is beyond doubt, if that is
/// requested; without turbulence where the velocities are too few to tell it from noise.
///
/// # Errors
/// What the fit refuses of a scan.
pub(super) fn of_scan<'s>(
    map: &ScanMap,
    settings: &'s DetectionSettings,
) -> Result<Cow<'s, DetectionSettings>, Error> {
    if settings.options.turbulence != Some(Turbulence::OfScan) {
        return Ok(Cow::Borrowed(settings));
    }
    let found = turbulence(map, settings)?;
    Ok(Cow::Owned(DetectionSettings {
        options: DetectorOptions {
            turbulence: found.map(Turbulence::VonKarman),
            ..settings.options
        },
        ..settings.clone()
    }))
}

fn turbulence(
    map: &ScanMap,
    settings: &DetectionSettings,
) -> Result<Option<ScanTurbulence>, Error> {
    let options = RetrievalOptions {
        model: settings.model,
        other_profile: false,
        gate: settings.gate.clone(),
        turbulence: Some(Turbulence::OfScan),
        movement: Movement::Frozen,
        threshold: BEYOND_DOUBT * RetrievalOptions::DEFAULT_THRESHOLD,
        ..RetrievalOptions::default()
    };
    let fit = match map.sigma_m_s {
        Some(_) => fit_scan(map, Velocities::Means, &options),
        None => fit_scan(&with_unit_noise(map), Velocities::Means, &options),
    };
    Ok(fit?.turbulence)
}

/// The map with a noise of 1 m/s, where it is found with the turbulence.
pub(super) fn with_unit_noise(map: &ScanMap) -> ScanMap {
    ScanMap {
        sigma_m_s: Some(Array2::ones(map.velocity_m_s.raw_dim())),
        ..map.clone()
    }
}
