//! What a run needs: grid, spacing, layers, memory and time, derived from the scene - or a refusal
//! that names the limits.
//!
//! Rules: at least 25 points across the aperture radius (4 where every range is in the far field);
//! l0 >= 2 dx; coherence radius at the target resolved; the border takes at most 0.0075 of the mean
//! beam's light, tails of diffraction and turbulence included; Rytov variance of a layer at most
//! 0.1; the exact mean for the screens within a third of the standard error of that for the
//! continuous path, at every range. Check: the chapter's set-up passes for Cn2 up to 1e-13 at 1 km,
//! 1e-12 beyond 1 km on 512 points is refused, what the plan proposes passes its own test, and runs
//! of derived set-ups lose less than 0.01 of the light.

mod gaps;
mod light;
mod limits;
pub(crate) mod violation;

pub use gaps::{LARGEST_GAP_SHARE, LARGEST_LAYER_RYTOV, LayerGap};
pub use violation::{Limit, SetUp, Violation};

use crate::air::cn2::Cn2Path;
use crate::air::turbulence::path_rytov_variance;
use crate::monte_carlo::path::{Layers, Path};
use crate::monte_carlo::{GROUP, GROUPS_PER_WAVE};
use crate::screens::generator::ScreenGenerator;
use crate::screens::grid::Grid;
use crate::{Error, Misalignment, Telescope, Turbulence};
use gaps::worst_rytov;
use limits::{Limits, last};

/// CPU time of one f32 layer per point, transforms included \[s\]; f64 takes twice as long.
/// Measured, one core of 2023.
const LAYER_S: f64 = 9e-9;
/// CPU time of one f32 screen per point \[s\].
const SCREEN_S: f64 = 9e-9;
/// Fraction of the light above which its loss at the border is doubtful.
pub const DOUBTFUL_LOSS: f64 = 0.01;

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
    /// Forecast of the largest mean fraction of the light that the border takes.
    pub light_lost: f64,
    /// What the layers do to the mean at the ranges of the run (at 64 of them at most); empty
    /// without turbulence.
    pub gaps: Vec<LayerGap>,
    /// Memory of a run with eight groups at a time in f32 \[bytes\].
    pub memory_bytes: usize,
    /// The part of `memory_bytes` that each group needs while it runs \[bytes\].
    pub group_bytes: usize,
    /// CPU time of one realisation in f32 \[s\], an estimate within a factor of two on
    /// current machines.
    pub realisation_cpu_s: f64,
    /// Properties that are allowed but cost accuracy.
    pub warnings: Vec<Warning>,
}

impl Plan {
    /// Memory of a run with this number of realisations and threads in f32 \[bytes\]. One group per
    /// thread runs at a time.
    #[must_use]
    pub fn memory_bytes_of(&self, realisations: usize, threads: usize) -> usize {
        let at_once = realisations
            .div_ceil(GROUP)
            .clamp(1, GROUPS_PER_WAVE)
            .min(threads.max(1));
        self.memory_bytes - (GROUPS_PER_WAVE - at_once) * self.group_bytes
    }
}

/// Something about a plan that is allowed but costs accuracy.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The inner scale is below two grid spacings: the screens miss this fraction of D
    /// at one spacing.
    InnerScale {
        /// Fraction of the structure function that is missing at one grid spacing.
        missing: f64,
    },
    /// Layers are thicker than a Rytov variance of 0.1 allows.
    ThickLayers {
        /// Largest Rytov variance of a layer.
        rytov_variance: f64,
        /// Number of equal layers that is enough for all runs, if 1000 are.
        layers_needed: Option<usize>,
    },
    /// The layers shift the mean by more than a third of its standard error.
    LayerGap {
        /// The worst of the ranges.
        worst: LayerGap,
        /// As of [`Warning::ThickLayers`].
        layers_needed: Option<usize>,
    },
    /// The border takes more than 0.01 of the light.
    LightLost {
        /// Forecast of the fraction.
        fraction: f64,
        /// Width of a grid that is wide enough \[m\].
        width_m: f64,
    },
    /// The turbulence is so weak that Monte Carlo differs from free space by less than its own
    /// error.
    WeakTurbulence {
        /// Rytov variance of the whole path.
        rytov_variance: f64,
    },
}

/// What a Monte Carlo simulates.
#[derive(Debug, Clone)]
pub struct Case {
    /// Telescope of both beams.
    pub telescope: Telescope,
    /// Displacement of the BPLO against the transmitted beam.
    pub misalignment: Misalignment,
    /// Turbulence along the path.
    pub turbulence: Turbulence,
    /// Number of realisations: its standard error bounds that of the layers.
    pub realisations: usize,
}

impl Case {
    /// Derives grid and layers for ranges \[m\], increasing; layers end at the largest.
    ///
    /// # Errors
    /// [`Error::Sampling`] when more than 16384 points along an axis are needed; [`Error`] for a
    /// case that is not allowed.
    pub fn plan(&self, range_m: &[f64]) -> Result<Plan, Error> {
        crate::efficiency::check_increasing("range_m", range_m)?;
        let limits = Limits::new(self)?;
        let grid = limits.grid(range_m)?;
        let layers = limits
            .gaps(range_m)?
            .refined(limits.thin_layers(range_m)?)?;
        self.examine(&grid, &layers, range_m)
    }

    /// Examines a given set-up, such as the chapter's 512 x 2 mm and 10 layers.
    ///
    /// # Errors
    /// As [`Case::examine_runs`].
    pub fn examine(&self, grid: &Grid, layers: &Layers, range_m: &[f64]) -> Result<Plan, Error> {
        let plan = Limits::new(self)?
            .plans(grid, &[(layers.clone(), range_m)])?
            .pop();
        plan.ok_or(Error::Length {
            field: "range_m",
            found: 0,
            expected: 1,
        })
    }

    /// As [`Case::examine`] for several runs on one grid, each with `layers` equal layers to
    /// its last range: the violations of all runs are reported at once, and a proposed
    /// set-up holds for all.
    ///
    /// # Errors
    /// [`Error::Sampling`] names every limit that is violated with the smallest (for a spacing:
    /// largest) accepted value, and a complete set-up that was examined and accepted.
    pub fn examine_runs(
        &self,
        grid: &Grid,
        layers: usize,
        runs: &[&[f64]],
    ) -> Result<Vec<Plan>, Error> {
        let mut set_ups = Vec::new();
        for range_m in runs {
            set_ups.push((Layers::equal(layers, last(range_m)?)?, *range_m));
        }
        Limits::new(self)?.plans(grid, &set_ups)
    }
}

impl Limits<'_> {
    /// A plan for each of the runs on one grid.
    fn plans(&self, grid: &Grid, runs: &[(Layers, &[f64])]) -> Result<Vec<Plan>, Error> {
        let all: Vec<&[f64]> = runs.iter().map(|(_, range_m)| *range_m).collect();
        let mut violations = Vec::new();
        let mut light_lost = Vec::new();
        for range_m in &all {
            crate::efficiency::check_increasing("range_m", range_m)?;
            let (of_run, lost) = self.examine(grid, range_m)?;
            violations.extend(of_run);
            light_lost.push(lost);
        }
        if !violations.is_empty() {
            return Err(Error::Sampling {
                violations,
                would_do: self.set_up(&all),
            });
        }
        let mut plans = Vec::with_capacity(runs.len());
        for ((layers, range_m), lost) in runs.iter().zip(light_lost) {
            plans.push(self.costs(grid, layers, range_m, lost, &all)?);
        }
        Ok(plans)
    }

    /// Cost and warnings of a set-up whose grid is accepted; proposed layers hold for all `runs`.
    fn costs(
        &self,
        grid: &Grid,
        layers: &Layers,
        range_m: &[f64],
        light_lost: f64,
        runs: &[&[f64]],
    ) -> Result<Plan, Error> {
        let Case {
            telescope,
            misalignment,
            turbulence,
            ..
        } = self.case;
        let lambda = telescope.wavelength_m;
        let split = layers.split_at(range_m);
        let path = Path::new(&split, range_m, &turbulence.cn2, grid, lambda)?;
        let beams = if *misalignment == Misalignment::NONE {
            1
        } else {
            2
        };
        let transfers = path.distance_m.len() * (grid.nx + grid.ny) * 8;
        let group_bytes = group_bytes(grid, range_m.len(), beams);
        let steps_s =
            LAYER_S * path.transform_pairs() * beams as f64 + SCREEN_S * path.strength.len() as f64;
        let mut plan = Plan {
            grid: *grid,
            layers: layers.clone(),
            layer_rytov_variance: worst_rytov(&turbulence.cn2, lambda, &split, last(range_m)?)?,
            light_lost,
            gaps: self.gaps(range_m)?.of_layers(&split)?,
            memory_bytes: GROUPS_PER_WAVE * group_bytes
                + shared_bytes(grid, range_m.len(), beams)
                + transfers,
            group_bytes,
            realisation_cpu_s: grid.points() as f64 * steps_s,
            warnings: Vec::new(),
        };
        plan.warnings = self.warnings(&plan, range_m, runs)?;
        Ok(plan)
    }

    /// The warnings about a plan.
    fn warnings(
        &self,
        plan: &Plan,
        range_m: &[f64],
        runs: &[&[f64]],
    ) -> Result<Vec<Warning>, Error> {
        let mut warnings = Vec::new();
        let rytov_variance = plan.layer_rytov_variance;
        let is_thick = rytov_variance > LARGEST_LAYER_RYTOV;
        let worst = plan
            .gaps
            .iter()
            .filter(|g| g.is_large())
            .max_by(|a, b| a.excess().total_cmp(&b.excess()));
        if is_thick || worst.is_some() {
            // One number clears both warnings, of every run.
            let layers_needed = self.equal_layers(runs)?;
            warnings.extend(is_thick.then_some(Warning::ThickLayers {
                rytov_variance,
                layers_needed,
            }));
            warnings.extend(worst.map(|&worst| Warning::LayerGap {
                worst,
                layers_needed,
            }));
        }
        if plan.light_lost > DOUBTFUL_LOSS {
            let width_m = self.width_for_light_m(&plan.grid, range_m)?;
            warnings.push(Warning::LightLost {
                fraction: plan.light_lost,
                width_m,
            });
        }
        let Case {
            telescope,
            turbulence,
            ..
        } = self.case;
        if !turbulence.cn2.is_none() {
            let rytov_variance =
                path_rytov_variance(&turbulence.cn2, telescope.wavelength_m, last(range_m)?)?;
            if rytov_variance < 1e-3 {
                warnings.push(Warning::WeakTurbulence { rytov_variance });
            }
            if turbulence.spectrum.inner_wavenumber_rad_m() * plan.grid.largest_spacing_m() > 2.97 {
                warnings.push(Warning::InnerScale {
                    missing: missing_at_one_spacing(turbulence, &plan.grid)?,
                });
            }
        }
        Ok(warnings)
    }
}

/// Fraction of the structure function that the screens miss at one grid spacing. A part of a large
/// grid gives it.
fn missing_at_one_spacing(turbulence: &Turbulence, grid: &Grid) -> Result<f64, Error> {
    let part = Grid {
        nx: grid.nx.min(256),
        ny: grid.ny.min(256),
        ..*grid
    };
    ScreenGenerator::<f64>::new(part, turbulence.spectrum.clone())?.missing_at_one_spacing()
}

/// Points of the plane onto which a field folds.
fn folded_points(grid: &Grid, beams: usize) -> usize {
    if beams == 1 {
        (grid.nx / 2 + 1) * (grid.ny / 2 + 1)
    } else {
        grid.points()
    }
}

/// Buffers of a running group in f32: fields and taps of two realisations, work space of steps and
/// screens, four screens; planes that wait for their antithetic partners at each range.
fn group_bytes(grid: &Grid, ranges: usize, beams: usize) -> usize {
    let complex = 8 * grid.points();
    complex * (4 * beams + 2)
        + 4 * 4 * grid.points()
        + 4 * folded_points(grid, beams) * beams * (2 * ranges + 4)
}

/// What all groups share, in f32: the sums of a wave of groups and of all before them, the spectrum
/// of the screens, the field at the telescope, rings of the folded points.
fn shared_bytes(grid: &Grid, ranges: usize, beams: usize) -> usize {
    let folded = folded_points(grid, beams);
    (GROUPS_PER_WAVE + 1) * 4 * folded * beams * ranges
        + (4 + 8 * beams) * grid.points()
        + 2 * folded
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Telescope;

    fn case(cn2: f64) -> Case {
        Case {
            telescope: Telescope::table2(),
            misalignment: Misalignment::NONE,
            turbulence: Turbulence::table2(cn2).unwrap(),
            realisations: 400,
        }
    }

    fn chapter(cn2: f64, range_m: f64) -> Result<Plan, Error> {
        case(cn2).examine(
            &Grid::table2(),
            &Layers::equal(10, range_m).unwrap(),
            &[range_m],
        )
    }

    #[test]
    fn chapters_set_up_is_accepted_with_the_warning_it_deserves() {
        assert!(chapter(1e-15, 3000.0).unwrap().warnings.is_empty());
        let plan = chapter(1e-13, 3000.0).unwrap();
        assert!(
            matches!(
                plan.warnings[..],
                [Warning::ThickLayers {
                    layers_needed: Some(15..=17),
                    ..
                }]
            ),
            "{plan:?}"
        );
        assert!((plan.layer_rytov_variance - 0.22).abs() < 0.01);
        assert!(plan.memory_bytes < 200 << 20, "{}", plan.memory_bytes);
        let weak = chapter(1e-18, 1000.0).unwrap();
        assert!(
            matches!(weak.warnings[..], [Warning::WeakTurbulence { .. }]),
            "{weak:?}"
        );
    }

    #[test]
    fn strong_turbulence_on_a_small_grid_is_refused_with_what_works() {
        let error = chapter(1e-12, 3000.0).unwrap_err();
        assert!(matches!(error, Error::Sampling { .. }), "{error}");
        assert!(!chapter(1e-12, 500.0).unwrap().gaps.is_empty());
    }

    #[test]
    fn what_a_plan_proposes_passes_its_own_test() {
        for (cn2, range_m) in [
            (0.0, 2000.0),
            (1e-15, 3000.0),
            (1e-13, 1000.0),
            (1e-12, 1500.0),
        ] {
            let p = case(cn2).plan(&[0.5 * range_m, range_m]).unwrap();
            assert!(p.layer_rytov_variance <= LARGEST_LAYER_RYTOV);
            assert!(
                !p.warnings
                    .iter()
                    .any(|w| matches!(w, Warning::ThickLayers { .. }))
            );
            assert!(p.realisation_cpu_s > 0.0);
        }
    }

    #[test]
    fn cheapest_model_needs_no_monte_carlo_for_bistatic_or_calm_air() {
        let uniform = Cn2Path::Uniform { cn2_m_m23: 1e-13 };
        assert_eq!(
            cheapest_model(Receiver::Bistatic, &uniform),
            Model::ExactBistatic
        );
        assert_eq!(
            cheapest_model(Receiver::Monostatic, &uniform),
            Model::MonteCarlo
        );
        assert_eq!(
            cheapest_model(Receiver::Monostatic, &Cn2Path::Uniform { cn2_m_m23: 0.0 }),
            Model::FreeSpace
        );
    }

    #[test]
    fn unresolved_inner_scale_is_a_warning_with_its_size() {
        let turbulence = Turbulence {
            spectrum: std::sync::Arc::new(crate::VonKarman::kolmogorov()),
            cn2: Cn2Path::Uniform { cn2_m_m23: 1e-14 },
        };
        let grid = Grid::square(128, 4e-3).unwrap();
        let layers = Layers::equal(6, 800.0).unwrap();
        let p = Case {
            turbulence,
            ..case(0.0)
        }
        .examine(&grid, &layers, &[800.0])
        .unwrap();
        assert!(
            matches!(p.warnings[..], [Warning::InnerScale { missing }] if missing > 0.02 && missing < 0.3),
            "{p:?}"
        );
    }
}
