//! Plans: derived grids hold the light that was forecast, and what is refused is refused for its reason.

use crate::monte_carlo::{bistatic_z, go};
use wakescope_optics::monte_carlo::Sampling;
use wakescope_optics::plan::{Case, Limit, Warning};
use wakescope_optics::{Error, Focus, Grid, Layers, Misalignment, MonteCarlo, Stop, Telescope, Turbulence};

fn case(telescope: Telescope, cn2_m_m23: f64) -> Case {
    let turbulence = Turbulence::table2(cn2_m_m23).expect("turbulence");
    Case { telescope, misalignment: Misalignment::NONE, turbulence, realisations: 400 }
}

#[test]
fn derived_grids_hold_the_light_that_was_forecast() {
    let chapter = Telescope::table2();
    let obscured = Telescope { obscuration_radius_m: 0.02, ..chapter };
    for (telescope, cn2, furthest_m) in [
        (chapter, 1e-15, 3000.0),
        (Telescope { focus: Focus::At(800.0), ..obscured }, 1e-14, 1000.0),
        (chapter, 1e-13, 1000.0),
        (Telescope { focus: Focus::At(-900.0), ..chapter }, 1e-14, 1000.0),
    ] {
        let range_m = vec![0.5 * furthest_m, furthest_m];
        let planned = case(telescope, cn2).plan(&range_m).expect("plan");
        let run = MonteCarlo {
            telescope,
            grid: planned.grid,
            layers: planned.layers.clone(),
            range_m,
            sampling: Sampling::Antithetic,
            ..MonteCarlo::table2(cn2, 1).expect("set-up")
        };
        let estimate = run.run::<f32>(Stop::after(8), go).expect("run");
        let lost = estimate.lost_power_fraction.iter().fold(0f64, |a, b| a.max(*b));
        assert!(lost < 0.01 && lost < 1.3 * planned.light_lost, "{cn2:e}: {lost} {}", planned.light_lost);
        assert!(planned.warnings.is_empty(), "{:?}", planned.warnings);
    }
    // The narrow grid that a plan once derived: warned of, for what it then loses.
    let mut run = MonteCarlo::table2(1e-15, 1).expect("set-up");
    run.grid = Grid::square(144, 1.819e-3).expect("grid");
    run.range_m = vec![3000.0];
    let judged = case(run.telescope, 1e-15).examine(&run.grid, &run.layers, &run.range_m);
    let warnings = judged.expect("accepted").warnings;
    assert!(
        matches!(warnings[..], [Warning::LightLost { fraction, width_m }] if fraction > 0.01 && width_m > 0.3),
        "{warnings:?}"
    );
    let estimate = run.run::<f32>(Stop::after(8), go).expect("run");
    assert!(estimate.lost_power_fraction[0] > 0.01);
}

#[test]
fn far_field_of_a_small_aperture_needs_fewer_points() {
    let telescope = Telescope { aperture_radius_m: 0.01, beam_radius_m: 0.006, ..Telescope::table2() };
    let far = [2000.0, 20_000.0];
    let case = case(telescope, 1e-15);
    let planned = case.plan(&far).expect("a grid of at most 4096 points");
    assert!(planned.grid.dx_m > 1e-3 && planned.light_lost < 0.01, "{planned:?}");
    // A grid too coarse is refused for the aperture, not for the turbulence.
    let coarse = Grid::square(2000, 4e-3).expect("grid");
    match case.examine(&coarse, &planned.layers, &far) {
        Err(Error::Sampling { violations, would_do: Some(_) }) => {
            assert!(violations.iter().all(|v| v.limit == Limit::Aperture), "{violations:?}");
        }
        other => panic!("{other:?}"),
    }
    // Four points across the radius give the exact mean, where the aperture is in the far field.
    let run = coarse_run(telescope);
    let estimate = run.run::<f32>(Stop::after(160), go).expect("run");
    let z = bistatic_z(&run, &estimate);
    assert!(z.iter().all(|z| z.abs() < 3.0), "{z:?}");
    for (grid, exact) in estimate.grid_free_space.iter().zip(&estimate.exact_free_space) {
        assert!((grid / exact - 1.0).abs() < 1e-3, "{grid} {exact}");
    }
}

/// A small aperture on a grid of four points across its radius, all ranges in its far field.
fn coarse_run(telescope: Telescope) -> MonteCarlo {
    MonteCarlo {
        telescope,
        turbulence: Turbulence::table2(3e-14).expect("turbulence"),
        grid: Grid::square(256, 2.5e-3).expect("grid"),
        layers: Layers::equal(3, 900.0).expect("layers"),
        range_m: vec![600.0, 900.0],
        sampling: Sampling::Antithetic,
        ..MonteCarlo::table2(3e-14, 5).expect("set-up")
    }
}
