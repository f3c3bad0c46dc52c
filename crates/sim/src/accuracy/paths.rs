//! Phase screens: what their keys do to the efficiency in the middle of the scan.
//!
//! The shift by layers is known without random numbers, from the exact mean of independent paths (bistatic); it is taken for the
//! monostatic one, too. Grids are compared on the same realisations; an error leaves out four at a time, as they come in two
//! antithetic pairs. Check: a collimated beam through two layers.

use super::figures::{Shift, Values};
use crate::Error;
use crate::plan::Plan;
use crate::scene::RefractiveTurbulence;
use crate::setup::efficiency_model::{OF_SCREENS, stretches};
use crate::setup::instrument::Instrument;
use crate::setup::table::of_table;
use std::ops::ControlFlow;
use wakescope_optics::{Stop, curved_ranges_m};

/// Realisations on which grids are compared, the least for a trusted error of a mean.
pub(super) const COMPARED: usize = 64;
/// Least layers: one screen would be the whole path, for which the exact mean of independent paths says little of the common one.
pub(super) const LEAST_LAYERS: f64 = 2.0;
/// Least realisations that a scene is given.
pub(super) const LEAST: f64 = 50.0;
/// Realisations of two antithetic pairs, which are left out together.
const TOGETHER: usize = 4;

/// Range in the middle of the scan, m.
pub(super) fn middle_m(plan: &Plan) -> f64 {
    0.5 * (plan.scene.scene.scan.range_min_m + plan.scene.scene.scan.range_max_m)
}

/// What the layers of a scene do to the efficiency in the middle of the scan, and at most over the air that the signals cross.
///
/// # Errors
/// Screens that are refused.
pub(super) fn of_layers(plan: &Plan, t: &RefractiveTurbulence) -> Result<[f64; 2], Error> {
    let middle_m = [middle_m(plan)];
    let stretch = stretches(&plan.scene.scene, &plan.geometry, &middle_m).first().map(|(ends_m, _)| *ends_m);
    let Some([from_m, to_m]) = stretch else { return Ok([f64::NAN; 2]) };
    let range_m = curved_ranges_m(&plan.instrument.telescope, from_m, to_m, OF_SCREENS);
    let found = plan.instrument.screen_plans(t, &[&range_m])?.pop().map(|plan| plan.gaps).unwrap_or_default();
    let (range_m, gap): (Vec<f64>, Vec<f64>) = found.iter().map(|gap| (gap.range_m, gap.relative)).unzip();
    Ok([of_table(&range_m, &gap, middle_m[0]), gap.iter().fold(0.0, |most, gap| gap.abs().max(most))])
}

/// Time of so many realisations at one range on one core, s.
///
/// # Errors
/// Screens that are refused.
pub(super) fn time_s(instrument: &Instrument, t: &RefractiveTurbulence, range_m: f64) -> Result<f64, Error> {
    let plans = instrument.screen_plans(t, &[&[range_m]])?;
    Ok(plans.iter().map(|plan| plan.realisation_cpu_s).sum::<f64>() * COMPARED as f64)
}

/// The efficiency at one range, and its mean with so many independent parts left out.
///
/// # Errors
/// What the optics refuse.
pub(super) fn efficiency(
    instrument: &Instrument,
    t: &RefractiveTurbulence,
    range_m: f64,
    seed: u64,
) -> Result<Values, Error> {
    let run = instrument.monte_carlo(t, &[range_m], seed)?;
    let found = run.run_in::<f32>(Stop::after(COMPARED), |_| ControlFlow::Continue(()))?;
    let each = found.monostatic_realisations.first().map(Vec::as_slice).unwrap_or_default();
    // As the profile, freed of the error of the grid in free space.
    let scale = found.exact_free_space[0] / found.grid_free_space[0];
    let means = each.chunks(TOGETHER).map(|part| scale * part.iter().sum::<f64>() / part.len() as f64);
    Ok(Values::mean(&means.collect::<Vec<_>>()))
}

/// Shift of one from another by the same seed.
pub(super) fn shift(of: &Values, fine: &Values) -> Shift {
    of.shift(fine, fine)
}

/// Relative standard deviation of the mean of one realisation: that of so many, times the root of their number.
pub(super) fn scatter(of: &Values) -> f64 {
    of.relative_error() * (COMPARED as f64).sqrt()
}
