//! The literal form: its screens against quadrature of their spectrum, and the fast walk
//! against its loop.

use std::ops::ControlFlow;
use std::sync::Arc;
use wakescope_optics::air::structure_function_m53;
use wakescope_optics::literal::{Layer, efficiency, irradiance_per_m2, phase_screen};
use wakescope_optics::screens::{ScreenGenerator, stream};
use wakescope_optics::theory::free_space_efficiency;
use wakescope_optics::{Focus, Grid, Layers, MonteCarlo, Spectrum, Stop, Telescope, VonKarman};

#[test]
fn fast_walk_is_the_literal_loop_to_round_off() {
    let telescope = Telescope {
        obscuration_radius_m: 0.01,
        focus: Focus::At(1200.0),
        ..Telescope::table2()
    };
    let grid = Grid {
        nx: 40,
        ny: 45,
        dx_m: 8e-3,
        dy_m: 7e-3,
    };
    // Strong turbulence: some radians of phase in each layer.
    let (cn2, seed, range_m) = (1e-12, 5, 700.0);
    let layers = Layers::new(vec![100.0, 300.0, range_m]).expect("layers");
    let end_m = [0.0, 100.0, 300.0, range_m];
    let run = MonteCarlo {
        telescope,
        grid,
        layers,
        range_m: vec![range_m],
        ..MonteCarlo::table2(cn2, seed).expect("set-up")
    };
    let fast = run
        .run_in::<f64>(Stop::after(2), |_| ControlFlow::Continue(()))
        .expect("run");
    // The numbers of the fast walk are freed of their correction to the exact
    // free-space efficiency.
    let raw = fast.grid_free_space[0] / fast.exact_free_space[0];

    let generator =
        ScreenGenerator::<f64>::new(grid, Arc::new(VonKarman::table2())).expect("generator");
    let mut work = generator.work();
    let mut path = |realisation: u64| {
        let mut screens = vec![vec![0.0; grid.points()]; 4];
        for (pair, screens) in screens.chunks_exact_mut(2).enumerate() {
            let [first, second] = screens else {
                unreachable!("pairs")
            };
            let mut rng = stream(seed, realisation, pair as u64);
            generator
                .fill_pair(&mut rng, &mut work, first, second)
                .expect("sizes");
        }
        let layers: Vec<Layer> = end_m
            .windows(2)
            .zip(screens)
            .map(|(ends, screen)| {
                let thickness_m = ends[1] - ends[0];
                let strength = telescope.wavenumber_rad_m() * (cn2 * thickness_m).sqrt();
                Layer {
                    thickness_m,
                    phase_rad: screen.iter().map(|psi| strength * psi).collect(),
                }
            })
            .collect();
        irradiance_per_m2(&telescope, &grid, &layers).expect("sizes")
    };
    let (first, second) = (path(0), path(1));
    for (found, sent, received) in [
        (fast.monostatic_realisations[0][0], &first, &first),
        (fast.monostatic_realisations[0][1], &second, &second),
        (fast.bistatic_realisations[0][0], &first, &second),
    ] {
        let exact = efficiency(&telescope, &grid, range_m, sent, received);
        assert!(
            (found * raw / exact - 1.0).abs() < 1e-11,
            "{} {exact}",
            found * raw
        );
    }
    assert!((first[900] / second[900] - 1.0).abs() > 0.01, "two paths");
}

#[test]
fn literal_loop_without_screens_gives_free_space() {
    let telescope = Telescope::table2();
    let grid = Grid::square(64, 6e-3).expect("grid");
    let layer = Layer {
        thickness_m: 300.0,
        phase_rad: vec![0.0; grid.points()],
    };
    let irradiance = irradiance_per_m2(&telescope, &grid, &[layer.clone(), layer]).expect("sizes");
    let found = efficiency(&telescope, &grid, 600.0, &irradiance, &irradiance);
    let exact = free_space_efficiency(&telescope, 600.0).expect("theory");
    assert!((found / exact - 1.0).abs() < 5e-3, "{found} {exact}");
}

/// The form of (17) with eddies that fit on the grid of the test, and an inner scale
/// that it resolves.
#[derive(Debug)]
struct SmallEddies;

impl Spectrum for SmallEddies {
    fn density_per_cn2(&self, wavenumber_rad_m: f64) -> f64 {
        let k2 = wavenumber_rad_m.powi(2);
        let inner = (-k2 / self.inner_wavenumber_rad_m().powi(2)).exp();
        0.033 * inner * (k2 + self.outer_wavenumber_rad_m().powi(2)).powf(-11.0 / 6.0)
    }
    fn outer_wavenumber_rad_m(&self) -> f64 {
        157.0
    }
    fn inner_wavenumber_rad_m(&self) -> f64 {
        370.0
    }
}

#[test]
fn literal_screens_have_the_structure_function_of_their_spectrum() {
    let spectrum = SmallEddies;
    let grid = Grid {
        nx: 24,
        ny: 20,
        dx_m: 5e-3,
        dy_m: 6e-3,
    };
    let (wavelength_m, cn2_thickness_m13) = (1.55e-6, 1e-11);
    let mut rng = stream(3, 0, 0);
    let screens: Vec<_> = (0..200)
        .map(|_| phase_screen(&grid, &spectrum, wavelength_m, cn2_thickness_m13, &mut rng))
        .collect();
    let k2 = (2.0 * std::f64::consts::PI / wavelength_m).powi(2);
    for (x, y) in [(1, 0), (0, 1), (3, 2), (8, 0)] {
        let mut mean = 0.0;
        for psi in &screens {
            for i in 0..grid.points() {
                let other = (i / 24 + y) % 20 * 24 + (i % 24 + x) % 24;
                mean += (psi[i] - psi[other]).powi(2) / (200 * grid.points()) as f64;
            }
        }
        let separation_m = (x as f64 * grid.dx_m).hypot(y as f64 * grid.dy_m);
        let exact = k2
            * cn2_thickness_m13
            * structure_function_m53(&spectrum, separation_m).expect("quadrature");
        assert!((mean / exact - 1.0).abs() < 0.04, "{x} {y}: {mean} {exact}");
    }
}
