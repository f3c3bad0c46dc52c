//! Whether the phase screens of a run give the bistatic mean that is known exactly for them, (P5).
//!
//! Nothing else shows that a grid is too coarse or too narrow for the field: what (P12) corrects
//! does not show in the result. Check: a grid of twice the spacing that its focus needs is refused,
//! and so is a mistake put in on purpose; good runs are not.

use crate::Error;
use crate::air::StructureTable;
use crate::monte_carlo::{EfficiencyEstimate, MonteCarlo};
use crate::screens::generator::ScreenGenerator;
use crate::screens::kernel::Real;
use crate::theory::{ScreenStrength, bistatic_efficiency_screens};

/// Standard errors by which mean and theory may differ.
const SIGMAS: f64 = 5.0;
/// Fraction of the mean that good screens may miss: single precision, and phases that are not quite
/// normal.
const OF_SCREENS: f64 = 2e-3;
/// Fraction of the correction (P12) that turbulence may change.
const OF_CORRECTION: f64 = 0.1;

/// Refuses a bistatic mean that the layers of the run cannot have.
///
/// # Errors
/// [`Error::AgainstTheory`] at the first such range.
pub(super) fn check<T: Real>(
    run: &MonteCarlo,
    screens: &ScreenGenerator<T>,
    found: &EfficiencyEstimate,
) -> Result<(), Error> {
    let Some(bistatic) = &found.bistatic else {
        return Ok(());
    };
    let table = StructureTable::new(&*run.turbulence.spectrum);
    // A spectrum that is cut at Nyquist misses less than this fraction at any separation.
    let missing = if screens.folds() {
        0.0
    } else {
        screens.missing_at_one_spacing()?.max(0.0)
    };
    for (i, &range_m) in run.range_m.iter().enumerate() {
        let mut layers = run.layers.screens_to(range_m, &run.turbulence.cn2)?;
        let exact = exact_bistatic(run, &layers, &table, range_m)?;
        let mut largest = exact;
        if missing > 0.0 {
            for layer in &mut layers {
                layer.cn2_thickness_m13 *= 1.0 - missing;
            }
            largest = exact_bistatic(run, &layers, &table, range_m)?;
        }
        let mean = bistatic.mean[i];
        let standard_error = bistatic.standard_error[i];
        let correction = found.exact_free_space[i] / found.grid_free_space[i];
        let of_grid = OF_SCREENS + OF_CORRECTION * (correction - 1.0).abs();
        let allowed = allowed_errors(found.independent_samples) * standard_error + of_grid * exact;
        let smallest = exact - allowed - 2.0 * found.lost_power_fraction[i] * exact;
        if mean < smallest || mean > largest + allowed {
            return Err(Error::AgainstTheory {
                range_m,
                mean,
                standard_error,
                exact,
            });
        }
    }
    Ok(())
}

/// Exact bistatic efficiency of a run for these screens.
fn exact_bistatic(
    run: &MonteCarlo,
    screens: &[ScreenStrength],
    table: &StructureTable,
    range_m: f64,
) -> Result<f64, Error> {
    bistatic_efficiency_screens(&run.telescope, &run.misalignment, screens, table, range_m)
}

/// Number of standard errors, estimated from `samples` samples, that a mean exceeds as rarely as
/// [`SIGMAS`] known standard errors: Student's distribution, after Wallace (1959).
fn allowed_errors(samples: usize) -> f64 {
    let freedom = samples.saturating_sub(1).max(1) as f64;
    let normal = SIGMAS * (8.0 * freedom + 3.0) / (8.0 * freedom + 1.0);
    (freedom * (normal * normal / freedom).exp_m1()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::EfficiencyProfile;
    use crate::efficiency::EfficiencyPoint;

    #[test]
    fn means_beyond_five_errors_of_theory_are_refused_and_others_are_not() {
        let run = MonteCarlo {
            layers: crate::Layers::equal(2, 600.0).unwrap(),
            range_m: vec![600.0],
            ..MonteCarlo::table2(1e-13, 1).unwrap()
        };
        let layers = run.layers.screens_to(600.0, &run.turbulence.cn2).unwrap();
        let table = StructureTable::new(&*run.turbulence.spectrum);
        let exact =
            bistatic_efficiency_screens(&run.telescope, &run.misalignment, &layers, &table, 600.0)
                .unwrap();
        let grid = |spacing_m| {
            ScreenGenerator::<f64>::new(
                crate::Grid::square(64, spacing_m).unwrap(),
                run.turbulence.spectrum.clone(),
            )
            .unwrap()
        };
        let tried = |spacing_m: f64, off: f64, error: f64, samples: usize, lost: f64| {
            let mut bistatic = EfficiencyProfile::default();
            let point = EfficiencyPoint {
                standard_error: error * exact,
                ..EfficiencyPoint::exact((1.0 + off) * exact)
            };
            bistatic.push(600.0, point);
            let found = EfficiencyEstimate {
                monostatic: EfficiencyProfile::default(),
                bistatic: Some(bistatic),
                monostatic_realisations: Vec::new(),
                bistatic_realisations: Vec::new(),
                realisations: samples,
                independent_samples: samples,
                grid_free_space: vec![1.0],
                exact_free_space: vec![1.0],
                lost_power_fraction: vec![lost],
            };
            check(&run, &grid(spacing_m), &found).is_ok()
        };
        for sign in [-1.0, 1.0] {
            assert!(
                tried(4e-3, sign * 0.048, 0.01, 10_000, 0.0)
                    && !tried(4e-3, sign * 0.056, 0.01, 10_000, 0.0)
            );
            // What the error of few samples is worth; that of one pair is not known.
            assert!(
                tried(4e-3, sign * 0.08, 0.01, 11, 0.0) && !tried(4e-3, sign * 0.13, 0.01, 11, 0.0)
            );
            assert!(tried(4e-3, sign * 0.9, f64::NAN, 2, 0.0));
            // Without random error the screens themselves are allowed for.
            assert!(
                tried(4e-3, sign * 1e-3, 0.0, 10_000, 0.0)
                    && !tried(4e-3, sign * 4e-3, 0.0, 10_000, 0.0)
            );
        }
        // Light that the border took lowers the mean, and screens that miss small eddies raise it.
        assert!(tried(4e-3, -0.03, 0.0, 10_000, 0.02) && !tried(4e-3, 0.03, 0.0, 10_000, 0.02));
        assert!(tried(2e-2, 0.008, 0.0, 10_000, 0.0) && !tried(2e-2, -0.008, 0.0, 10_000, 0.0));
    }

    #[test]
    fn errors_are_students() {
        // The quantiles of five normal deviations, 1 - 2.87e-7, by a quadrature of the density.
        for (samples, quantile) in [(11, 11.166), (31, 6.319), (101, 5.344), (100_001, 5.0)] {
            assert!(
                (allowed_errors(samples) / quantile - 1.0).abs() < 0.02,
                "{samples}: {}",
                allowed_errors(samples)
            );
        }
    }
}
