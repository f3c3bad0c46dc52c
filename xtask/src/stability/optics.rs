//! Extreme cases of the optics (section 5 of its numerics).

use super::extreme::Extreme;
use crate::failure::Failure;
use std::ops::ControlFlow;
use std::sync::Arc;
use wakescope_optics::air::{OuterScaleConvention, Scales, StructureTable, structure_function_m53};
use wakescope_optics::monte_carlo::EfficiencyEstimate;
use wakescope_optics::plan::Case;
use wakescope_optics::screens::ScreenGenerator;
use wakescope_optics::{Focus, Grid, Layers, Misalignment, MonteCarlo, Stop, Telescope, Turbulence, VonKarman, theory};

type Number = Result<f64, Failure>;

const AGAINST_THEORY: &str = "against exact theory, relative";

/// One case a row.
#[rustfmt::skip]
pub(super) fn cases() -> Vec<Extreme> {
    use Extreme as E;
    vec![
        E::at_most("no turbulence", "Cn2 = 0, Monte Carlo", "against free space, relative, plus standard error", 1e-13, calm),
        E::at_most("faintest turbulence", "Cn2 1e-18 m^(-2/3), 1500 m", "against free space, relative", 5e-3, faint),
        E::between("strongest turbulence", "Cn2 1e-11 over 1e-12 m^(-2/3), 1000 m, bistatic", "ratio of efficiencies, 10^-1.2 to 10^-1 and what diffraction adds", (0.063, 0.11), strong),
        E::refused("strong turbulence on the chapter's grid", "Cn2 1e-12, 3000 m, 512 points of 2 mm", "grid", || planned(1e-12, 3000.0, true)),
        E::refused("strongest turbulence, derived grid", "Cn2 1e-9, 10000 m", "16384", || planned(1e-9, 10_000.0, false)),
        E::refused("negative turbulence", "Cn2 -1e-15", "cn2_m_m23", || Ok(Turbulence::table2(-1e-15).map(|_| 0.0)?)),
        E::refused("NaN turbulence", "Cn2 NaN", "cn2_m_m23", || Ok(Turbulence::table2(f64::NAN).map(|_| 0.0)?)),
        E::at_most("infinite outer scale", "L0 infinite, 1.024 m grid", "expected structure function, relative, worst", 1e-3, || structure(f64::INFINITY, 0.01)),
        E::at_most("short outer scale", "L0 a tenth of the grid", "expected structure function, relative, worst", 1e-3, || structure(0.1, 0.01)),
        E::between("no inner scale", "l0 = 0, 4 mm spacing", "structure function missing at one spacing", (0.02, 0.3), no_inner_scale),
        E::refused("scales that cross", "L0 1 mm, l0 10 mm", "inner_scale_m", || structure(1e-3, 0.01)),
        E::refused("target at the telescope", "range_m = 0", "range_m", || Ok(theory::free_space_efficiency(&Telescope::table2(), 0.0)?)),
        E::refused("no aperture", "aperture_radius_m = 0", "aperture_radius_m", || free_space(|t| t.aperture_radius_m = 0.0, 400.0)),
        E::refused("wavelength NaN", "wavelength_m = NaN", "wavelength_m", || free_space(|t| t.wavelength_m = f64::NAN, 400.0)),
        E::at_most("uniform beam", "beam radius infinite, against 10 km", AGAINST_THEORY, 1e-9, uniform_beam),
        E::at_most("wide aperture", "six 1/e radii, against the untruncated closed form", AGAINST_THEORY, 1e-9, wide_aperture),
        E::between("target in the focus", "a/s = 1.76334, matched pair", "efficiency", (0.401_178_5, 0.401_179_5), || free_space(|t| (t.beam_radius_m, t.focus) = (0.05 / 1.76334, Focus::At(700.0)), 700.0)),
        E::refused("focus at the telescope", "focus at 1 mm, target at 3000 m", "Fresnel number", || free_space(|t| t.focus = Focus::At(1e-3), 3000.0)),
        E::at_most("diverging beam", "focus -900 m: overlap against Hankel's integral", AGAINST_THEORY, 3e-6, diverging),
        E::at_most("long waves", "10.6 um, grid against theory", AGAINST_THEORY, 2e-3, long_waves),
        E::at_most("prime and rectangular grid", "131 x 193 points, free space", AGAINST_THEORY, 5e-3, prime_grid),
        E::refused("grid of a point", "1 x 1", "nx", || Ok(Grid::square(1, 1e-3)?.points() as f64)),
        E::refused("aperture of two points", "points of 40 mm", "aperture", || Ok(run(coarse(0.0, 64, 0.04)?, 1)?.exact_free_space[0])),
        E::refused("beam wider than the grid", "focus at 20 m, target at 1000 m", "grid", || Ok(run(MonteCarlo { telescope: Telescope { focus: Focus::At(20.0), ..Telescope::table2() }, ..coarse(0.0, 256, 4e-3)? }, 1)?.exact_free_space[0])),
        E::refused("no realisation", "0 realisations", "realisations", || Ok(run(coarse(1e-14, 128, 4e-3)?, 0)?.realisations as f64)),
        E::at_most("one realisation", "1 realisation, no pairs", "numbers that claim to be known", 0.0, one_realisation),
        E::at_most("ranges in disorder", "against increasing ones", "numbers with other bits", 0.0, disorder),
        E::at_most("bistatic through infinite outer scale", "Cn2 1e-14, L0 infinite, 120 realisations", "standard errors from exact theory", 3.3, infinite_outer_scale).long(),
    ]
}

fn coarse(cn2_m_m23: f64, points: usize, spacing_m: f64) -> Result<MonteCarlo, Failure> {
    Ok(MonteCarlo {
        grid: Grid::square(points, spacing_m)?,
        layers: Layers::equal(3, 900.0)?,
        range_m: vec![300.0, 900.0],
        ..MonteCarlo::table2(cn2_m_m23, 1)?
    })
}

fn run(set_up: MonteCarlo, realisations: usize) -> Result<EfficiencyEstimate, Failure> {
    Ok(set_up.run::<f64>(Stop::after(realisations), |_| ControlFlow::Continue(()))?)
}

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |most, x| if x.is_nan() { x } else { most.max(x) })
}

/// Largest relative difference.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    largest(a.iter().zip(b).map(|(a, b)| (a / b - 1.0).abs()))
}

fn calm() -> Number {
    let found = run(coarse(0.0, 256, 4e-3)?, 40)?;
    let errors = largest(found.monostatic.standard_error.iter().copied());
    Ok(apart(&found.monostatic.mean, &found.exact_free_space) + errors)
}

fn faint() -> Number {
    let set_up = MonteCarlo { range_m: vec![1500.0], layers: Layers::equal(3, 1500.0)?, ..coarse(1e-18, 256, 4e-3)? };
    let found = run(set_up, 4)?;
    Ok(apart(&found.monostatic.mean, &found.exact_free_space))
}

/// In strong turbulence the efficiency is that of coherence areas: it falls as their radius squared, Cn2^(-6/5), or with
/// its inverse where they are smaller than the inner scale.
fn strong() -> Number {
    let of = |cn2: f64| {
        theory::bistatic_efficiency(&Telescope::table2(), &Misalignment::NONE, &Turbulence::table2(cn2)?, 1000.0)
    };
    Ok(of(1e-11)? / of(1e-12)?)
}

fn planned(cn2_m_m23: f64, range_m: f64, chapter: bool) -> Number {
    let turbulence = Turbulence::table2(cn2_m_m23)?;
    let case = Case { telescope: Telescope::table2(), misalignment: Misalignment::NONE, turbulence, realisations: 400 };
    let plan = match chapter {
        true => case.examine(&Grid::table2(), &Layers::equal(10, range_m)?, &[range_m])?,
        false => case.plan(&[range_m])?,
    };
    Ok(plan.light_lost)
}

fn structure(outer_scale_m: f64, inner_scale_m: f64) -> Number {
    let scales = Scales { outer_scale_m, inner_scale_m, convention: OuterScaleConvention::Inverse };
    let spectrum = VonKarman::new(scales, 0.033)?;
    let generator = ScreenGenerator::<f64>::new(Grid::square(256, 4e-3)?, Arc::new(spectrum))?;
    let mut worst = 0.0_f64;
    for steps in [2, 4, 8, 16, 32, 64, 128] {
        let exact = structure_function_m53(&spectrum, steps as f64 * 4e-3)?;
        worst = worst.max((generator.expected_structure_m53(steps, 0) / exact - 1.0).abs());
    }
    Ok(worst)
}

fn no_inner_scale() -> Number {
    let spectrum = VonKarman::kolmogorov();
    let generator = ScreenGenerator::<f64>::new(Grid::square(128, 4e-3)?, Arc::new(spectrum))?;
    Ok(1.0 - generator.expected_structure_m53(1, 0) / structure_function_m53(&spectrum, 4e-3)?)
}

fn free_space(change: impl Fn(&mut Telescope), range_m: f64) -> Number {
    let mut telescope = Telescope::table2();
    change(&mut telescope);
    Ok(theory::free_space_efficiency(&telescope, range_m)?)
}

fn uniform_beam() -> Number {
    let of = |beam_radius_m| {
        theory::free_space_antenna_efficiency(&Telescope { beam_radius_m, ..Telescope::table2() }, 900.0)
    };
    Ok((of(1e4)? / of(f64::INFINITY)? - 1.0).abs())
}

fn wide_aperture() -> Number {
    let closed = theory::untruncated_efficiency(&Telescope::table2(), 900.0)?;
    // The area of the aperture, by which both are divided, is 3.6^2 times as large.
    Ok((free_space(|t| t.aperture_radius_m = 0.18, 900.0)? * 12.96 / closed - 1.0).abs())
}

fn diverging() -> Number {
    let telescope = Telescope { focus: Focus::At(-900.0), ..Telescope::table2() };
    let hankel = theory::free_space_efficiency_hankel(&telescope, 700.0)?;
    Ok((hankel / theory::free_space_efficiency(&telescope, 700.0)? - 1.0).abs())
}

fn long_waves() -> Number {
    let telescope = Telescope { wavelength_m: 10.6e-6, ..Telescope::table2() };
    let found = run(MonteCarlo { telescope, ..coarse(0.0, 256, 4e-3)? }, 1)?;
    Ok(apart(&found.grid_free_space, &found.exact_free_space))
}

fn prime_grid() -> Number {
    let grid = Grid { nx: 131, ny: 193, dx_m: 6e-3, dy_m: 4e-3 };
    let found = run(MonteCarlo { grid, ..coarse(0.0, 128, 4e-3)? }, 1)?;
    Ok(apart(&found.grid_free_space, &found.exact_free_space))
}

fn one_realisation() -> Number {
    let found = run(coarse(1e-14, 128, 4e-3)?, 1)?;
    let known = found.monostatic.standard_error.iter().filter(|e| !e.is_nan()).count();
    Ok((known + usize::from(found.bistatic.is_some())) as f64)
}

fn disorder() -> Number {
    let of = |range_m: Vec<f64>| run(MonteCarlo { range_m, ..coarse(1e-14, 128, 4e-3)? }, 4);
    let (mixed, sorted) = (of(vec![900.0, 300.0, 600.0])?, of(vec![300.0, 600.0, 900.0])?);
    let pairs = mixed.monostatic.mean.iter().zip(&sorted.monostatic.mean);
    Ok(pairs.filter(|(a, b)| a.to_bits() != b.to_bits()).count() as f64)
}

fn infinite_outer_scale() -> Number {
    let scales =
        Scales { outer_scale_m: f64::INFINITY, inner_scale_m: 0.01, convention: OuterScaleConvention::Inverse };
    let mut set_up = coarse(1e-14, 256, 4e-3)?;
    set_up.turbulence.spectrum = Arc::new(VonKarman::new(scales, 0.033)?);
    let found = run(set_up.clone(), 120)?.bistatic.ok_or_else(|| Failure::new("no pairs".into()))?;
    let table = StructureTable::new(&*set_up.turbulence.spectrum);
    let mut worst = 0.0_f64;
    for (i, &range_m) in set_up.range_m.iter().enumerate() {
        let screens = set_up.layers.screens_to(range_m, &set_up.turbulence.cn2)?;
        let exact =
            theory::bistatic_efficiency_screens(&set_up.telescope, &Misalignment::NONE, &screens, &table, range_m)?;
        worst = worst.max(((found.mean[i] - exact) / found.standard_error[i]).abs());
    }
    Ok(worst)
}
