//! What a run needs: grid, spacing, layers, memory and time, derived from the scene - or a refusal that names the limit.
//!
//! Rules: at least 25 points across the aperture radius and l0 >= 2 dx; coherence radius at the target resolved; room
//! for beam and turbulent spread inside the absorbing border; Rytov variance of a layer at most 0.1. Check: the
//! chapter's set-up passes for Cn2 up to 1e-13 at 1 km, 1e-12 beyond 1 km on 512 points is refused, and what the plan
//! proposes passes its own test.

use crate::grid::Grid;
use crate::path::{Layers, Program};
use crate::source::check_grid;
use crate::turbulence::{self, Cn2Path};
use crate::{Error, Misalignment, Telescope, Turbulence};

/// Largest Rytov variance (plane wave) of one layer.
pub const LARGEST_LAYER_RYTOV: f64 = 0.1;
/// CPU time of one f32 layer per point, transforms included \[s\]; f64 takes twice as long. Measured, one core of 2023.
const LAYER_S: f64 = 9e-9;
/// CPU time of one f32 screen per point \[s\].
const SCREEN_S: f64 = 9e-9;
/// Largest number of points along an axis that a plan proposes.
const LARGEST_POINTS: usize = 4096;

/// The cheapest model that is valid for a receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// No turbulence: exact quadrature.
    FreeSpace,
    /// Bistatic: exact quadrature at any strength, no Monte Carlo.
    ExactBistatic,
    /// Monostatic through turbulence: Monte Carlo.
    MonteCarlo,
}

/// Which paths the two beams take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Receiver {
    /// Both beams through the same turbulence.
    Monostatic,
    /// Beams through independent turbulence.
    Bistatic,
}

/// The cheapest valid model for a receiver and a path.
pub fn cheapest_model(receiver: Receiver, cn2: &Cn2Path) -> Model {
    match receiver {
        _ if cn2.is_none() => Model::FreeSpace,
        Receiver::Bistatic => Model::ExactBistatic,
        Receiver::Monostatic => Model::MonteCarlo,
    }
}

/// A set-up for the Monte Carlo, with what it costs and what is doubtful about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Transverse grid.
    pub grid: Grid,
    /// Layers of the path.
    pub layers: Layers,
    /// Largest Rytov variance of a layer.
    pub layer_rytov_variance: f64,
    /// Memory of a run with eight groups at a time in f32 \[bytes\].
    pub memory_bytes: usize,
    /// CPU time of one realisation in f32 \[s\], an estimate within a factor of two on current machines.
    pub realisation_cpu_s: f64,
    /// What is allowed but deserves a word.
    pub warnings: Vec<Warning>,
}

/// Something about a plan that is allowed but costs accuracy.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The inner scale is below two grid spacings: the screens miss this fraction of D at one spacing.
    InnerScale {
        /// Fraction of the structure function that is missing at one grid spacing.
        missing: f64,
    },
    /// Layers are thicker than a Rytov variance of 0.1 allows.
    ThickLayers {
        /// Largest Rytov variance of a layer.
        rytov_variance: f64,
        /// Number of equal layers that would do.
        layers_needed: usize,
    },
    /// The turbulence is so weak that Monte Carlo differs from free space by less than its own error.
    WeakTurbulence {
        /// Rytov variance of the whole path.
        rytov_variance: f64,
    },
}

/// Rytov variance of a layer of the mean Cn2 from `start_m` to `end_m`.
fn layer_rytov(cn2: &Cn2Path, wavelength_m: f64, start_m: f64, end_m: f64) -> Result<f64, Error> {
    if cn2.is_none() {
        return Ok(0.0);
    }
    turbulence::rytov_variance(cn2.mean(start_m, end_m)?, wavelength_m, end_m - start_m)
}

/// Equal layers to `range_m`, as many as keep each below [`LARGEST_LAYER_RYTOV`].
fn enough_layers(cn2: &Cn2Path, wavelength_m: f64, range_m: f64) -> Result<usize, Error> {
    const MOST: usize = 1000;
    for count in 1..=MOST {
        let step = range_m / count as f64;
        let mut worst = 0f64;
        for i in 0..count {
            worst = worst.max(layer_rytov(cn2, wavelength_m, i as f64 * step, (i + 1) as f64 * step)?);
        }
        if worst <= LARGEST_LAYER_RYTOV {
            return Ok(count);
        }
    }
    Err(Error::Sampling { limit: "number of layers", needed: f64::INFINITY, available: MOST as f64 })
}

/// Width \[m\] and spacing \[m\] that the beam needs at `range_m` in this turbulence (Schmidt 2010).
fn needs(telescope: &Telescope, misalignment: &Misalignment, cn2: &Cn2Path, range_m: f64) -> Result<(f64, f64), Error> {
    let lambda = telescope.wavelength_m;
    let reach = telescope.aperture_radius_m.min(3.0 * telescope.intensity_radius_m());
    let curvature = telescope.focus.curvature_per_m();
    let tilt = misalignment.tilt_rad[0].hypot(misalignment.tilt_rad[1]);
    let offset = misalignment.offset_m[0].hypot(misalignment.offset_m[1]);
    // Angular spread of turbulence: lambda/(pi rho_0), rho_0 seen from the telescope and from the target.
    let spread_rad = if cn2.is_none() {
        0.0
    } else {
        let rho_0 = turbulence::coherence_radius_m(cn2.mean(0.0, range_m)?, lambda, range_m)?;
        lambda / (std::f64::consts::PI * rho_0)
    };
    let radius = reach * (1.0 - range_m * curvature).abs() + lambda * range_m / (2.0 * reach);
    let width = 2.0 * (radius + 2.0 * spread_rad * range_m + offset + tilt * range_m) / 0.9;
    let slope = reach * curvature.abs() + tilt + 2.0 * spread_rad;
    let spacing = (telescope.aperture_radius_m / 25.0).min(0.5 * lambda / slope.max(1e-30));
    Ok((width.max(2.5 * (telescope.aperture_radius_m + offset)), spacing))
}

/// Derives grid and layers for ranges \[m\] (increasing; layers end at the largest).
///
/// # Errors
/// [`Error::Sampling`] when more than 4096 points along an axis are needed; [`Error`] for a scene that is not allowed.
pub fn plan(
    telescope: &Telescope,
    misalignment: &Misalignment,
    turbulence: &Turbulence,
    range_m: &[f64],
) -> Result<Plan, Error> {
    crate::efficiency::check_increasing("range_m", range_m)?;
    let furthest = *range_m.last().ok_or(Error::Length { field: "range_m", found: 0, expected: 1 })?;
    let telescope = telescope.validated()?;
    let cn2 = turbulence.cn2.clone().validated()?;
    let (width, mut spacing) = needs(&telescope, misalignment, &cn2, furthest)?;
    let inner = turbulence.spectrum.inner_wavenumber_rad_m();
    if inner.is_finite() && !cn2.is_none() {
        // Half the inner scale if that costs no more than a factor of two.
        let fine = 2.96 / inner;
        if fine < spacing && fine >= 0.5 * spacing {
            spacing = fine;
        }
    }
    let points = good_size((width / spacing).ceil() as usize);
    if points > LARGEST_POINTS {
        return Err(Error::Sampling {
            limit: "points along an axis",
            needed: points as f64,
            available: LARGEST_POINTS as f64,
        });
    }
    let grid = Grid::square(points.max(128), width.max(128.0 * spacing) / points.max(128) as f64)?;
    let layers = Layers::equal(enough_layers(&cn2, telescope.wavelength_m, furthest)?, furthest)?;
    examine(&telescope, misalignment, turbulence, &grid, &layers, range_m)
}

/// Examines a set-up that someone else chose, the chapter's 512 x 2 mm and 10 layers for example.
///
/// # Errors
/// [`Error::Sampling`] names the limit that is violated and the smallest (for a spacing: largest) value that works.
pub fn examine(
    telescope: &Telescope,
    misalignment: &Misalignment,
    turbulence: &Turbulence,
    grid: &Grid,
    layers: &Layers,
    range_m: &[f64],
) -> Result<Plan, Error> {
    crate::efficiency::check_increasing("range_m", range_m)?;
    let furthest = *range_m.last().ok_or(Error::Length { field: "range_m", found: 0, expected: 1 })?;
    let lambda = telescope.validated()?.wavelength_m;
    let cn2 = turbulence.cn2.clone().validated()?;
    check_grid(telescope, misalignment, grid, furthest)?;
    let program = Program::compile(layers, range_m, &cn2, grid, lambda)?;
    let (width, spacing) = needs(telescope, misalignment, &cn2, furthest)?;
    // The rules keep a margin of two: what lies within it is left to the monitored border.
    if !cn2.is_none() && grid.smallest_width_m() < 0.5 * width {
        return Err(Error::Sampling {
            limit: "grid width [m] for the turbulent spread of the beam",
            needed: 0.5 * width,
            available: grid.smallest_width_m(),
        });
    }
    if !cn2.is_none() && grid.dx_m.max(grid.dy_m) > 2.0 * spacing {
        return Err(Error::Sampling {
            limit: "grid spacing [m] for the angles into which turbulence scatters",
            needed: 2.0 * spacing,
            available: grid.dx_m.max(grid.dy_m),
        });
    }
    let mut worst = 0f64;
    for i in 0..layers.end_m().len() {
        let (start, end) = layers.bounds_m(i);
        if start < furthest {
            worst = worst.max(layer_rytov(&cn2, lambda, start, end.min(furthest))?);
        }
    }
    let mut warnings = Vec::new();
    if worst > LARGEST_LAYER_RYTOV {
        let layers_needed = enough_layers(&cn2, lambda, furthest)?;
        warnings.push(Warning::ThickLayers { rytov_variance: worst, layers_needed });
    }
    if !cn2.is_none() {
        let whole = layer_rytov(&cn2, lambda, 0.0, furthest)?;
        if whole < 1e-3 {
            warnings.push(Warning::WeakTurbulence { rytov_variance: whole });
        }
        if turbulence.spectrum.inner_wavenumber_rad_m() * grid.dx_m.max(grid.dy_m) > 2.97 {
            warnings.push(Warning::InnerScale { missing: missing_at_one_spacing(turbulence, grid)? });
        }
    }
    let beams = if *misalignment == Misalignment::NONE { 1 } else { 2 };
    Ok(Plan {
        grid: *grid,
        layers: layers.clone(),
        layer_rytov_variance: worst,
        memory_bytes: memory_bytes(grid, range_m.len(), beams),
        realisation_cpu_s: grid.points() as f64
            * (LAYER_S * program.transform_pairs() * beams as f64 + SCREEN_S * program.strength.len() as f64),
        warnings,
    })
}

/// Relative deficit of the screens' structure function at one grid spacing.
fn missing_at_one_spacing(turbulence: &Turbulence, grid: &Grid) -> Result<f64, Error> {
    let generator = crate::screen::ScreenGenerator::<f64>::new(*grid, turbulence.spectrum.clone())?;
    let exact = crate::structure::structure_function_m53(&*turbulence.spectrum, grid.dx_m)?;
    Ok(1.0 - generator.expected_structure_m53(1, 0) / exact)
}

/// Buffers of eight groups (two realisations each, four screens) and their sums, f32.
fn memory_bytes(grid: &Grid, ranges: usize, beams: usize) -> usize {
    let points = grid.points();
    let complex = 8 * points;
    let per_group = complex * (4 * beams + 2) + 4 * 4 * points;
    let plane = if beams == 1 { (grid.nx / 2 + 1) * (grid.ny / 2 + 1) } else { points };
    8 * (per_group + 4 * plane * beams * (ranges + 4)) + (12 + complex / points) * points
}

/// The next size with only the factors 2, 3 and 5, even.
fn good_size(at_least: usize) -> usize {
    (at_least.max(2)..)
        .find(|&n| {
            let mut rest = n;
            for prime in [2, 3, 5] {
                while rest % prime == 0 {
                    rest /= prime;
                }
            }
            rest == 1 && n % 2 == 0
        })
        .unwrap_or(at_least)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chapter(cn2: f64, range_m: f64) -> Result<Plan, Error> {
        let layers = Layers::equal(10, range_m).unwrap();
        let turbulence = Turbulence::chapter(cn2).unwrap();
        examine(&Telescope::chapter(), &Misalignment::NONE, &turbulence, &Grid::chapter(), &layers, &[range_m])
    }

    #[test]
    fn chapters_set_up_is_accepted_with_the_warning_it_deserves() {
        assert!(chapter(1e-15, 3000.0).unwrap().warnings.is_empty());
        let plan = chapter(1e-13, 3000.0).unwrap();
        assert!(matches!(plan.warnings[..], [Warning::ThickLayers { layers_needed: 15..=17, .. }]), "{plan:?}");
        assert!((plan.layer_rytov_variance - 0.22).abs() < 0.01);
        assert!(plan.memory_bytes < 200 << 20, "{}", plan.memory_bytes);
        let weak = chapter(1e-18, 1000.0).unwrap();
        assert!(matches!(weak.warnings[..], [Warning::WeakTurbulence { .. }]), "{weak:?}");
    }

    #[test]
    fn strong_turbulence_on_a_small_grid_is_refused_with_what_works() {
        let error = chapter(1e-12, 3000.0).unwrap_err();
        assert!(matches!(error, Error::Sampling { .. }), "{error}");
        assert!(chapter(1e-12, 500.0).is_ok());
    }

    #[test]
    fn what_a_plan_proposes_passes_its_own_test() {
        for (cn2, range_m) in [(0.0, 2000.0), (1e-15, 3000.0), (1e-13, 1000.0), (1e-12, 1500.0)] {
            let t = Telescope::chapter();
            let turbulence = Turbulence::chapter(cn2).unwrap();
            let p = plan(&t, &Misalignment::NONE, &turbulence, &[0.5 * range_m, range_m]).unwrap();
            assert!(p.layer_rytov_variance <= LARGEST_LAYER_RYTOV);
            assert!(!p.warnings.iter().any(|w| matches!(w, Warning::ThickLayers { .. })));
            assert!(p.realisation_cpu_s > 0.0);
        }
    }

    #[test]
    fn cheapest_model_needs_no_monte_carlo_for_bistatic_or_calm_air() {
        let uniform = Cn2Path::Uniform { cn2_m_m23: 1e-13 };
        assert_eq!(cheapest_model(Receiver::Bistatic, &uniform), Model::ExactBistatic);
        assert_eq!(cheapest_model(Receiver::Monostatic, &uniform), Model::MonteCarlo);
        assert_eq!(cheapest_model(Receiver::Monostatic, &Cn2Path::Uniform { cn2_m_m23: 0.0 }), Model::FreeSpace);
    }

    #[test]
    fn unresolved_inner_scale_is_a_warning_with_its_size() {
        let turbulence = Turbulence {
            spectrum: std::sync::Arc::new(crate::VonKarman::kolmogorov()),
            cn2: Cn2Path::Uniform { cn2_m_m23: 1e-14 },
        };
        let grid = Grid::square(128, 4e-3).unwrap();
        let layers = Layers::equal(4, 800.0).unwrap();
        let p = examine(&Telescope::chapter(), &Misalignment::NONE, &turbulence, &grid, &layers, &[800.0]).unwrap();
        assert!(
            matches!(p.warnings[..], [Warning::InnerScale { missing }] if missing > 0.02 && missing < 0.3),
            "{p:?}"
        );
    }
}
