//! A mistake put in on purpose: the bistatic test must find a wrong sign of the random
//! frequency shift.
//!
//! With the wrong sign a frequency kappa_m - s carries the amplitude that belongs to kappa_m + s.
//! Screens look right and the monostatic efficiency hardly changes; the bistatic efficiency falls
//! by several standard errors.

use crate::air::StructureTable;
use crate::monte_carlo::EfficiencyEstimate;
use crate::{Error, Grid, Layers, Misalignment, MonteCarlo, Stop, VonKarman, theory};
use std::ops::ControlFlow;

/// Largest |z| of the bistatic mean against exact theory for the screens used.
fn worst_z(run: &MonteCarlo, estimate: &EfficiencyEstimate) -> f64 {
    let table = StructureTable::new(&*run.turbulence.spectrum);
    let bistatic = estimate.bistatic.as_ref().expect("a valid set-up");
    let mut worst = 0f64;
    for (i, &range_m) in run.range_m.iter().enumerate() {
        let screens = run
            .layers
            .screens_to(range_m, &run.turbulence.cn2)
            .expect("a valid set-up");
        let exact = theory::bistatic_efficiency_screens(
            &run.telescope,
            &Misalignment::NONE,
            &screens,
            &table,
            range_m,
        )
        .expect("a valid set-up");
        let z = ((bistatic.mean[i] - exact) / bistatic.standard_error[i]).abs();
        assert!(z.is_finite());
        worst = worst.max(z);
    }
    worst
}

#[test]
fn bistatic_test_passes_and_finds_a_wrong_sign_of_the_frequency_shift() {
    // A narrow grid, whose coarse frequencies make the mistake large, and short steps.
    let mut run = MonteCarlo::table2(1e-14, 20).expect("a valid set-up");
    run.grid = Grid::square(128, 4e-3).expect("a valid set-up");
    let spectrum = VonKarman::new(f64::INFINITY, 0.01, 0.033);
    run.turbulence.spectrum = std::sync::Arc::new(spectrum.expect("a valid set-up"));
    run.layers = Layers::equal(6, 3000.0).expect("a valid set-up");
    run.range_m = vec![1500.0, 3000.0];
    let mut prepared = run.prepare::<f32>().expect("a valid set-up");
    let mut go = |_| ControlFlow::Continue(());
    let right = run
        .run_prepared(&prepared, Stop::after(800), &mut go)
        .expect("a valid set-up");
    assert!(worst_z(&run, &right) < 3.0, "{}", worst_z(&run, &right));
    prepared
        .screens
        .as_mut()
        .expect("a valid set-up")
        .shift_sign = -1.0;
    // Every run compares its mean with theory.
    match run.run_prepared(&prepared, Stop::after(800), &mut go) {
        Err(Error::AgainstTheory {
            mean,
            standard_error,
            exact,
            ..
        }) => {
            assert!(
                (mean - exact).abs() > 5.0 * standard_error,
                "{mean} {exact} {standard_error}"
            );
        }
        other => panic!("{other:?}"),
    }
}
