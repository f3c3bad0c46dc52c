//! Fit of one scan, whatever its velocities are: the best wake, whether there is one, and what is known of it.
//!
//! | velocities | fit |
//! |---|---|
//! | means over gates | `gate_means`: wind alone, one vortex, a pair, each to its minimum; then `secondary` |
//! | estimates of a known estimator | as means with typical cores, which leads to the start; then `estimates` |
//!
//! Check: the reference maps; scatter, bias and stated standard errors over many maps of either kind.

use crate::error::Error;
use crate::retrieval::aliases::Unfolded;
use crate::retrieval::estimates::fit_estimates;
use crate::retrieval::gate_means::{fit_among_outliers, fit_means, fit_once};
use crate::retrieval::secondary::with_secondary_vortices;
use crate::retrieval::{Flag, RetrievalOptions, ScanMap, ScanResult, Turbulence, Velocities};
use crate::vortex_fit::Sharing;

/// Gates that share most of their window are skipped unless fewer velocities are left.
const ENOUGH: usize = 500;

/// Finds the vortices of one scan. No wake is a result, not an error.
///
/// Estimates that are taken for means mislead about the cores above all, so that a fit of means with typical cores only leads to the start of
/// theirs; if that fit does not converge, or there is no model of the estimator, they are taken for means.
///
/// # Errors
/// [`Error::Length`], [`Error::OutOfRange`] for impossible input; [`Error::TooFewVelocities`] with less than a hundred;
/// [`Error::Linalg`] if what is free does not show in the map or velocities are so correlated that they cannot be whitened.
pub fn fit_scan(
    map: &ScanMap,
    velocities: Velocities<'_>,
    options: &RetrievalOptions,
) -> Result<ScanResult, Error> {
    let (estimator, is_likely) = match velocities {
        Velocities::Estimates(estimator) => (estimator, false),
        Velocities::LikelyEstimates(estimator) => (estimator, true),
        Velocities::Means => return fit_as_means(map, options, true),
        Velocities::Unknown => return fit_as_means(map, options, false),
    };
    let strided = map.strided(1, estimator.gate_stride(&map.range_m));
    let count = strided
        .velocity_m_s
        .iter()
        .filter(|v| v.is_finite())
        .count();
    let independent = if count >= ENOUGH { &strided } else { map };
    let mut rough = RetrievalOptions {
        core_radius_m: None,
        other_profile: false,
        other_spacings: false,
        turbulence: options.turbulence.filter(|air| *air != Turbulence::OfScan),
        ..options.clone()
    };
    rough.free.core_radius = Sharing::Fixed;
    let found = fit_once(independent, &rough)?;
    let found = fit_among_outliers(independent, &rough, found)?;
    // Guesses and starts do not know that velocities repeat.
    let unfolded = match &found.wake {
        Some(wake) => strided.unfolded_about(&options.model, wake),
        None => Unfolded::new(&strided, options)?.map,
    };
    let Some(mut fit) = fit_estimates(&unfolded, estimator, options, &found) else {
        return fit_as_means(independent, options, false);
    };
    if map.fold_m_s.is_some() && found.has(Flag::Ambiguous) {
        fit.set(Flag::Ambiguous, true);
    }
    if is_likely {
        let means = fit_means(independent, options)?;
        fit.add_distance_from(&means, map);
        flag_taken_for_means(&mut fit);
    }
    Ok(fit)
}

/// The fit of means, with secondary vortices if the scan shows them; flagged unless the velocities are known to be means.
fn fit_as_means(
    map: &ScanMap,
    options: &RetrievalOptions,
    are_means: bool,
) -> Result<ScanResult, Error> {
    let pair = fit_means(map, options)?;
    // Secondary vortices may be what looks like outliers.
    let mut fit = match with_secondary_vortices(map, options, &pair)? {
        Some(four) => four,
        None => fit_among_outliers(map, options, pair)?,
    };
    if !are_means {
        flag_taken_for_means(&mut fit);
    }
    Ok(fit)
}

fn flag_taken_for_means(result: &mut ScanResult) {
    result.set(Flag::TakenForMeans, !result.vortices.is_empty());
}
