//! Structure functions of the screens: expected ones against quadrature, measured ones
//! against the expected.

use std::sync::Arc;
use wakescope_optics::air::{HillAndrews, structure_function_m53};
use wakescope_optics::screens::{ScreenGenerator, stream};
use wakescope_optics::{Grid, Spectrum, VonKarman};

/// Largest relative error of the expected structure function from 2 dx to half the grid, along
/// axis and diagonal.
fn worst_error(grid: Grid, spectrum: Arc<dyn Spectrum>) -> f64 {
    let generator = ScreenGenerator::<f64>::new(grid, spectrum.clone()).expect("generator");
    let mut worst = 0f64;
    let mut steps = 2;
    while steps <= grid.nx / 2 {
        for (x, y) in [
            (steps, 0),
            (0, steps.min(grid.ny / 2)),
            (steps, steps.min(grid.ny / 2)),
        ] {
            let r = (x as f64 * grid.dx_m).hypot(y as f64 * grid.dy_m);
            let exact = structure_function_m53(&*spectrum, r).expect("quadrature");
            worst = worst.max((generator.expected_structure_m53(x, y) / exact - 1.0).abs());
        }
        steps *= 2;
    }
    worst
}

#[test]
fn expected_structure_function_is_within_0_1_percent_of_theory() {
    let grid = Grid::square(256, 4e-3).expect("grid");
    let width = 1.024;
    for outer_scale_m in [0.1 * width, 1.0, 10.0, f64::INFINITY] {
        for inner_scale_m in [8e-3, 0.02] {
            let spectrum = VonKarman::new(outer_scale_m, inner_scale_m, 0.033);
            let worst = worst_error(grid, Arc::new(spectrum.expect("spectrum")));
            assert!(
                worst < 1e-3,
                "L0 {outer_scale_m} l0 {inner_scale_m}: {worst}"
            );
        }
    }
}

#[test]
fn expected_structure_function_holds_on_rectangular_and_prime_grids_and_for_other_spectra() {
    let rectangular = Grid {
        nx: 192,
        ny: 251,
        dx_m: 3e-3,
        dy_m: 4e-3,
    };
    let worst = worst_error(rectangular, Arc::new(VonKarman::table2()));
    assert!(worst < 1e-3, "{worst}");
    let hill = HillAndrews::new(0.8, 0.02).expect("spectrum");
    let worst = worst_error(Grid::square(128, 4e-3).expect("grid"), Arc::new(hill));
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn unresolved_inner_scale_is_cut_at_nyquist_and_reported() {
    let grid = Grid::square(128, 4e-3).expect("grid");
    let generator =
        ScreenGenerator::<f64>::new(grid, Arc::new(VonKarman::kolmogorov())).expect("generator");
    assert!(!generator.folds());
    let error = |steps: usize| {
        let exact = structure_function_m53(&VonKarman::kolmogorov(), steps as f64 * 4e-3)
            .expect("quadrature");
        generator.expected_structure_m53(steps, 0) / exact - 1.0
    };
    // What lies beyond Nyquist is missing: much at small separations, little at large ones.
    assert!(error(1) < -0.02 && error(1) > -0.3, "{}", error(1));
    assert!(error(32).abs() < 2e-3, "{}", error(32));
}

#[test]
fn measured_structure_function_agrees_with_the_expected_one() {
    let grid = Grid {
        nx: 96,
        ny: 128,
        dx_m: 6e-3,
        dy_m: 5e-3,
    };
    let generator =
        ScreenGenerator::<f32>::new(grid, Arc::new(VonKarman::table2())).expect("generator");
    let mut work = generator.work();
    let mut screens = [vec![0f32; grid.points()], vec![0f32; grid.points()]];
    let separations = [(1usize, 0usize), (0, 3), (10, 0), (8, 8), (0, 40)];
    let mut samples = vec![Vec::new(); separations.len()];
    let mut cross = Vec::new();
    for realisation in 0..600 {
        let [first, second] = &mut screens;
        let mut rng = stream(42, realisation, 0);
        generator
            .fill_pair(&mut rng, &mut work, first, second)
            .expect("sizes");
        for (list, &(sx, sy)) in samples.iter_mut().zip(&separations) {
            let mut sum = 0.0;
            for screen in [&*first, &*second] {
                for (x, y) in [(5, 7), (50, 60), (20, 80)] {
                    let a = f64::from(screen[y * 96 + x]);
                    let b = f64::from(screen[(y + sy) * 96 + x + sx]);
                    sum += (a - b).powi(2) / 6.0;
                }
            }
            list.push(sum);
        }
        let slope = |s: &[f32]| f64::from(s[60 * 96 + 70] - s[60 * 96 + 20]);
        cross.push(slope(first) * slope(second));
    }
    let z = |list: &[f64], expected: f64| {
        let n = list.len() as f64;
        let mean = list.iter().sum::<f64>() / n;
        let variance = list.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean - expected) / (variance / n).sqrt()
    };
    for (list, &(sx, sy)) in samples.iter().zip(&separations) {
        let z = z(list, generator.expected_structure_m53(sx, sy));
        assert!(z.abs() < 3.5, "{sx} {sy}: {z}");
    }
    // The two halves of a synthesis are uncorrelated.
    assert!(z(&cross, 0.0).abs() < 3.5);
}
