//! Secondary vortices beside those that a scan of any instrument shows.
//!
//! Check: exact maps of gates with four vortices, and with two.

use ndarray::Array2;

use crate::error::Error;
use crate::retrieval::gate_means::{MOST, fit_means};
use crate::retrieval::{Flag, RetrievalOptions, ScanMap, ScanResult, VortexResult};
use crate::vortex_fit::map_fit::gates::Gates;
use crate::vortex_fit::map_fit::secondary::SecondaryVortices;
use crate::vortex_fit::map_fit::setting::Setting;
use crate::vortex_fit::{MapFitOptions, Parameter, Wake};

/// The fit with secondary vortices in the model, if the scan shows them beside the pair that was `found` or [`RetrievalOptions::secondary`] requests
/// them; with [`Secondary::Never`](crate::vortex_fit::Secondary::Never) what was found, flagged. They are searched in velocities whose errors are
/// independent. The standard errors contain what is not known of them.
///
/// # Errors
/// As [`fit_scan`](crate::retrieval::fit_scan).
pub(super) fn with_secondary_vortices(
    map: &ScanMap,
    options: &RetrievalOptions,
    found: &ScanResult,
) -> Result<Option<ScanResult>, Error> {
    let is_pair = found.vortices.len() == 2;
    // the least chi-square, where other spacings share in what is told
    let Some(pair) = found
        .tops
        .first()
        .map(|top| top.wake)
        .filter(|_| is_pair && options.turbulence.is_none())
    else {
        return Ok(None);
    };
    let moves = map.has_times() && !found.has(Flag::MotionIgnored);
    options.validate()?;
    let Some(four) = search(map, options, &pair, moves)? else {
        return Ok(None);
    };
    if !four.fitted {
        let mut result = found.clone();
        result.set(Flag::SecondaryVortices, true);
        return Ok(Some(result));
    }
    // what another profile would do was free in the search
    let mut options = RetrievalOptions {
        other_profile: false,
        ..options.clone()
    };
    options.model.secondary = Some(four.vortices);
    options.start = Some(four.wake);
    let mut result = fit_means(map, &options)?;
    if result.vortices.len() < 2 {
        return Ok(None);
    }
    result.set(Flag::SecondaryVortices, four.shown);
    widen(&mut result, map, &four.covariance, &options);
    Ok(Some(result))
}

/// The pair with the secondary vortices that its scan, thinned if it has many velocities, shows beside it as means over gates.
///
/// # Errors
/// As [`fit_scan`](crate::retrieval::fit_scan).
fn search(
    map: &ScanMap,
    options: &RetrievalOptions,
    pair: &Wake,
    moves: bool,
) -> Result<Option<SecondaryVortices>, Error> {
    let map_options = MapFitOptions {
        free: options.free,
        core_prior: options.core_prior,
        pair_prior: None,
        loss: options.loss,
        secondary: options.secondary,
        correlated_lines: map.elevation_rad.len(),
        ..MapFitOptions::default()
    };
    let unfolded = map.unfolded_about(&options.model, pair);
    let bounded = unfolded.medians(MOST);
    let sought = bounded.as_ref().unwrap_or(&unfolded);
    let gates = Gates::rough(sought, options)?;
    let gates = Gates {
        seconds: moves.then(|| sought.after_middle_s()),
        shared_points: true,
        ..gates
    };
    let setting = Setting {
        map: &sought.view(),
        model: &options.model,
        prediction: &gates,
        kernel: &gates.kernel,
        options: &map_options,
        least_core_m: 0.0,
    };
    Ok(setting.with_secondary(pair))
}

/// Deviations that are too small as the secondary vortices were kept become those of the fit of all.
fn widen(result: &mut ScanResult, map: &ScanMap, all: &Array2<f64>, options: &RetrievalOptions) {
    let grown: Vec<f64> = (0..all.nrows())
        .map(|place| {
            let own = result.covariance[[place, place]];
            let all = all[[place, place]];
            if own > 0.0 {
                (all / own).sqrt().max(1.0)
            } else {
                1.0
            }
        })
        .collect();
    result
        .covariance
        .indexed_iter_mut()
        .for_each(|((i, j), c)| *c *= grown[i] * grown[j]);
    let Some(wake) = result.wake else { return };
    let moves = map.has_times() && !result.has(Flag::MotionIgnored);
    for vortex in &mut result.vortices {
        *vortex = VortexResult::at_its_line(
            map,
            &options.model,
            (&wake, &result.covariance),
            vortex.side,
            moves,
        );
    }
    result.lateral_wind_m_s.std *= grown[Parameter::Wind as usize];
    result.wind_shear_per_s.std *= grown[Parameter::Shear as usize];
}
