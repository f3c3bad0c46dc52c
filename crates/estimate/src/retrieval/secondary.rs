//! Secondary vortices beside those that a scan of any instrument shows.
//!
//! Check: exact maps of gates with four vortices, and with two.

use ndarray::Array2;

use crate::error::Error;
use crate::retrieval::expected::Expected;
use crate::retrieval::{Flag, RetrievalOptions, ScanMap, ScanResult, fit_scan};
use crate::vortex_fit::map_fit::secondary::Setting;
use crate::vortex_fit::{MapFitOptions, Parameter};

/// What [`fit_scan`] finds with secondary vortices in the model, and the options with them, if the scan shows them beside the pair that it has
/// `found`. Looked for are those of vortices that stand still, in velocities whose errors are independent. The deviations count what is
/// not known of them.
///
/// # Errors
/// As [`fit_scan`].
pub fn with_secondary_vortices(
    map: &ScanMap,
    options: &RetrievalOptions,
    found: &ScanResult,
) -> Result<Option<(ScanResult, RetrievalOptions)>, Error> {
    let stands = found.has(Flag::MotionIgnored) && found.vortices.len() == 2;
    let Some(pair) = found.wake.filter(|_| stands && options.turbulence.is_none()) else {
        return Ok(None);
    };
    options.validate()?;
    let map_options = MapFitOptions {
        free: options.free,
        core_prior: options.core_prior,
        loss: options.loss,
        correlated_lines: map.elevation_rad.len(),
        ..MapFitOptions::default()
    };
    let unfolded = map.unfolded();
    let kernel = Expected::rough(&unfolded, options)?.kernel;
    let setting = Setting {
        map: &unfolded.view(),
        model: &options.model,
        prepared: None,
        kernel: &kernel,
        options: &map_options,
        groups: &options.free.groups(),
    };
    let Some(four) = setting.find(&pair) else { return Ok(None) };
    let mut options = options.clone();
    options.model.secondary = Some(four.secondary);
    options.start = Some(four.wake);
    let mut result = fit_scan(map, &options)?;
    if result.vortices.len() < 2 {
        return Ok(None);
    }
    result.flags.push(Flag::SecondaryVortices);
    result.flags.sort();
    widen(&mut result, &four.covariance, &options);
    Ok(Some((result, options)))
}

/// Deviations that are too small as the secondary vortices were kept become those of the fit of all.
fn widen(result: &mut ScanResult, all: &Array2<f64>, options: &RetrievalOptions) {
    let grown: Vec<f64> = (0..all.nrows())
        .map(|place| {
            let (own, all) = (result.covariance[[place, place]], all[[place, place]]);
            if own > 0.0 { (all / own).sqrt().max(1.0) } else { 1.0 }
        })
        .collect();
    result.covariance.indexed_iter_mut().for_each(|((i, j), c)| *c *= grown[i] * grown[j]);
    let Some(wake) = result.wake else { return };
    let means = wake.mean_circulations_5_15_m2_s(options.model.profile, result.covariance.view());
    for vortex in &mut result.vortices {
        let [circulation, lateral, height, core] = vortex.side.parameters();
        vortex.circulation_m2_s.std *= grown[circulation as usize];
        vortex.lateral_position_m.std *= grown[lateral as usize];
        vortex.height_m.std *= grown[height as usize];
        if let Some(radius) = &mut vortex.core_radius_m {
            radius.std *= grown[core as usize];
        }
        vortex.circulation_5_15_m2_s.std = means[usize::from(circulation == Parameter::RightCirculation)].1;
    }
    result.lateral_wind_m_s.std *= grown[Parameter::Wind as usize];
    result.wind_shear_per_s.std *= grown[Parameter::Shear as usize];
}
