//! Error against run time of the optics: quadrature, layers, grid, screens, realisations, precision, variance reduction.

use super::{Row, few};
use crate::cost::{Cost, fastest};
use fixtures::failure::Failure;
use std::ops::ControlFlow;
use wakescope_optics::air::{StructureTable, structure_function_m53};
use wakescope_optics::monte_carlo::{EfficiencyEstimate, Sampling};
use wakescope_optics::screens::{ScreenGenerator, stream};
use wakescope_optics::{
    Grid, Layers, Misalignment, MonteCarlo, Spectrum, Stop, Telescope, Turbulence, VonKarman, theory,
};

pub(super) const SEED: u64 = 1;
/// Strong turbulence at a range where the Monte Carlo is needed.
const CN2_M_M23: f64 = 1e-13;
const RANGE_M: f64 = 1000.0;
/// Spacing of the chapter's screens.
const SPACING_M: f64 = 2e-3;

/// All measurements; few and coarse ones if `quick`.
pub(super) fn rows(quick: bool) -> Result<Vec<Row>, Failure> {
    let mut rows = free_space()?;
    rows.extend(layers(quick)?);
    rows.extend(grids(quick)?);
    rows.extend(screens(quick)?);
    rows.extend(realisations(quick)?);
    Ok(rows)
}

/// Two quadratures of the free-space efficiency against one another.
fn free_space() -> Result<Vec<Row>, Failure> {
    let telescope = Telescope::table2();
    let mut rows = Vec::new();
    for (case, range_m) in
        [("free space, 100 m", 100.0), ("free space, 1000 m", 1000.0), ("free space, 3000 m", 3000.0)]
    {
        let (overlap, overlap_cost) = fastest(|| Ok(theory::free_space_efficiency(&telescope, range_m)?))?;
        let (hankel, hankel_cost) = fastest(|| Ok(theory::free_space_efficiency_hankel(&telescope, range_m)?))?;
        let error = (hankel / overlap - 1.0).abs();
        let words = ["relative difference of the two methods", "each other"];
        rows.push(Row::new(case, "pupil overlap", ("none", 0.0), (error, 0.0), words, overlap_cost));
        rows.push(Row::new(case, "Fresnel-Hankel", ("none", 0.0), (error, 0.0), words, hankel_cost));
    }
    Ok(rows)
}

fn set_up(layers: usize, grid: Grid) -> Result<MonteCarlo, Failure> {
    Ok(MonteCarlo {
        layers: Layers::equal(layers, RANGE_M)?,
        range_m: vec![RANGE_M],
        grid,
        ..MonteCarlo::table2(CN2_M_M23, SEED)?
    })
}

fn estimate(set_up: &MonteCarlo, realisations: usize, double: bool) -> Result<EfficiencyEstimate, Failure> {
    let go = |_| ControlFlow::Continue(());
    let stop = Stop::after(realisations);
    Ok(if double { set_up.run::<f64>(stop, go)? } else { set_up.run::<f32>(stop, go)? })
}

/// What a finite number of screens does to the exact bistatic efficiency, and what the screens cost.
fn layers(quick: bool) -> Result<Vec<Row>, Failure> {
    let (telescope, turbulence) = (Telescope::table2(), Turbulence::table2(CN2_M_M23)?);
    let table = StructureTable::new(&*turbulence.spectrum);
    let none = Misalignment::NONE;
    let continuous = theory::bistatic_efficiency_with(&telescope, &none, &turbulence.cn2, &table, RANGE_M)?;
    let mut rows = Vec::new();
    for &count in few(&[1, 2, 5, 10, 20], quick) {
        let screens = Layers::equal(count, RANGE_M)?.screens_to(RANGE_M, &turbulence.cn2)?;
        let exact = theory::bistatic_efficiency_screens(&telescope, &none, &screens, &table, RANGE_M)?;
        let (_, cost) = fastest(|| estimate(&set_up(count, Grid::table2())?, 2, false))?;
        let words = ["bistatic efficiency, relative", "exact theory of the continuous path"];
        let (knob, error) = (("atmosphere.turbulence.layers", count as f64), (exact / continuous - 1.0).abs());
        rows.push(Row::new("layers", "mid-layer screens", knob, (error, 0.0), words, cost));
    }
    Ok(rows)
}

/// What the grid does to the free-space efficiency, before the correction.
fn grids(quick: bool) -> Result<Vec<Row>, Failure> {
    let exact = theory::free_space_efficiency(&Telescope::table2(), RANGE_M)?;
    let mut rows = Vec::new();
    for &(points, spacing_m) in few(&[(128, 8e-3), (256, 4e-3), (512, 2e-3), (1024, 1e-3)], quick) {
        for (method, double) in [("f32", false), ("f64", true)] {
            let set_up = set_up(10, Grid::square(points, spacing_m)?)?;
            let (eta, cost) = fastest(|| {
                Ok(if double { set_up.grid_free_space::<f64>()? } else { set_up.grid_free_space::<f32>()? })
            })?;
            let words = ["free-space efficiency, relative, uncorrected", "exact theory"];
            let knob = ("atmosphere.turbulence.grid_points", points as f64);
            rows.push(Row::new("grid", method, knob, ((eta[0] / exact - 1.0).abs(), 0.0), words, cost));
        }
    }
    Ok(rows)
}

/// Expected structure function of the screens against theory, beside plain Fourier synthesis and Lane's subharmonics:
/// the worst from 2 dx to half the grid.
fn screens(quick: bool) -> Result<Vec<Row>, Failure> {
    let spectrum = VonKarman::table2();
    let words = ["expected structure function, relative, worst", "quadrature of the spectrum"];
    let mut rows = Vec::new();
    for &points in few(&[128, 256, 512], quick) {
        let grid = Grid::square(points, SPACING_M)?;
        let generator = ScreenGenerator::<f32>::new(grid, std::sync::Arc::new(spectrum))?;
        let mut work = generator.work();
        let mut pair = [vec![0.0f32; points * points], vec![0.0f32; points * points]];
        let [first, second] = &mut pair;
        let mut rng = stream(SEED, 0, 0);
        let (_, cost) = fastest(|| Ok(generator.fill_pair(&mut rng, &mut work, first, second)?))?;
        let own = worst_error(&spectrum, points, |steps| generator.expected_structure_m53(steps, 0))?;
        let row = |method, error, cost| {
            Row::new("screens (a pair)", method, ("points", points as f64), (error, 0.0), words, cost)
        };
        rows.push(row("random shift and subharmonics", own, cost));
        for (method, levels) in [("plain synthesis (no cost taken)", 0), ("3 levels of Lane (no cost taken)", 3)] {
            // Only the expectation is computed: these screens are not part of the crate.
            let error = worst_error(&spectrum, points, |steps| {
                expected_lane_m53(&spectrum, points, levels, steps as f64 * SPACING_M)
            })?;
            rows.push(row(method, error, Cost::NONE));
        }
    }
    Ok(rows)
}

/// Largest relative error of a structure function from 2 dx to half the grid.
fn worst_error(spectrum: &VonKarman, points: usize, expected_m53: impl Fn(usize) -> f64) -> Result<f64, Failure> {
    let mut worst: f64 = 0.0;
    let mut steps = 2;
    while steps <= points / 2 {
        let theory_m53 = structure_function_m53(spectrum, steps as f64 * SPACING_M)?;
        worst = worst.max((expected_m53(steps) / theory_m53 - 1.0).abs());
        steps *= 2;
    }
    Ok(worst)
}

/// Expected structure function of Fourier synthesis on a square grid with `levels` of Lane's 3 x 3 subharmonics (Lane
/// et al. 1992), per unit k^2 Cn2 dz: 4 pi times the sum over the frequencies of Phi_n dkappa^2 (1 - cos(kappa_x r)).
fn expected_lane_m53(spectrum: &VonKarman, points: usize, levels: i32, separation_m: f64) -> f64 {
    let step_rad_m = 2.0 * std::f64::consts::PI / (points as f64 * SPACING_M);
    let cells = |half: i32, cell_rad_m: f64| -> f64 {
        let mut sum = 0.0;
        for (i, j) in (-half..=half).flat_map(|i| (-half..=half).map(move |j| (i, j))).filter(|c| *c != (0, 0)) {
            let (x, y) = (f64::from(i) * cell_rad_m, f64::from(j) * cell_rad_m);
            sum += spectrum.density_per_cn2(x.hypot(y)) * cell_rad_m * cell_rad_m * (1.0 - (x * separation_m).cos());
        }
        sum
    };
    let subharmonics: f64 = (1..=levels).map(|level| cells(1, step_rad_m / 3f64.powi(level))).sum();
    4.0 * std::f64::consts::PI * (cells(points as i32 / 2 - 1, step_rad_m) + subharmonics)
}

/// Standard errors of the monostatic efficiency against the work, for each way of drawing.
fn realisations(quick: bool) -> Result<Vec<Row>, Failure> {
    let ways = [
        ("independent, f32", Sampling::Independent, false),
        ("antithetic, f32", Sampling::Antithetic, false),
        ("independent, f64", Sampling::Independent, true),
    ];
    let mut rows = Vec::new();
    for &(method, sampling, double) in few(&ways, quick) {
        for &count in if quick { &[16, 32] } else { &[32, 128, 512][..] } {
            let set_up = MonteCarlo { sampling, ..set_up(5, Grid::square(256, 4e-3)?)? };
            let (found, cost) = fastest(|| estimate(&set_up, count, double))?;
            let error = found.monostatic.standard_error[0] / found.monostatic.mean[0];
            // A standard deviation of so many independent samples.
            let of_error = error / (2.0 * (found.independent_samples.max(2) - 1) as f64).sqrt();
            let words = ["relative standard error, monostatic", "itself"];
            let knob = ("atmosphere.turbulence.realisations", count as f64);
            rows.push(Row::new("realisations", method, knob, (error, of_error), words, cost));
        }
    }
    Ok(rows)
}
