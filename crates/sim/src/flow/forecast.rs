//! What a run will take, before anything of its size is allocated: cells, steps, time, memory, files.
//!
//! Memory is counted in arrays of one number for each cell, time in passes over the cells; the unit costs at the end of this
//! file are good to a factor of two. Steps follow from the Courant number of the initial field, those of a wake also from how
//! viscosity spreads its cores: flows that speed up take more.
//!
//! Check: memory against the arrays of a run, sizes that fit, cases too large are refused at once.

use super::case::{FlowCase, Subgrid};
use super::files::{FileForecast, Files};
use super::setup::Setup;
use super::wake::WakeHistory;
use super::{CaseFile, CaseKind, InitialName, WakeOutput};
use crate::keys::Declared as _;
use crate::quantities::{bytes, rounded, seconds};
use crate::{Error, machine};
use serde::Serialize as _;
use std::fmt;
use wakescope_les::solver::{RunPlan, Stability};
use wakescope_les::{TimeScheme, TimeStep};

/// Forecast of a run.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct FlowForecast {
    /// Name of the case by its hash.
    pub case_hash: String,
    /// Cells along x, y, z.
    pub cells: [usize; 3],
    /// Time integration.
    #[serde(serialize_with = "name_of_scheme")]
    pub scheme: TimeScheme,
    /// Why, where it is not that of the case.
    pub scheme_reason: Option<String>,
    /// Courant number of the first steps.
    pub courant: f64,
    /// The largest at which every wave of the mesh decays under the scheme; infinite in a flow that starts from rest.
    pub damped_courant: f64,
    /// What deserves attention.
    pub notes: Vec<String>,
    /// End of the run \[s\].
    pub end_s: f64,
    /// Age of the wake at the end; the time in seconds where there is none.
    pub end_tau: f64,
    /// Length of the first steps \[s\].
    pub step_s: f64,
    /// Steps to the end, or to the pause.
    pub steps: f64,
    /// Computing time of the flow on one core \[s\].
    pub core_s: f64,
    /// Of the program beside it, once: its start, and the pictures of a wake \[s\].
    pub program_s: f64,
    /// Memory held at once \[bytes\].
    pub memory_bytes: f64,
    /// Ranks that share the run.
    pub ranks: usize,
    /// Memory that each of them holds at once \[bytes\].
    pub rank_bytes: f64,
    /// Files, by kind.
    pub files: Vec<FileForecast>,
}

/// Writes a scheme by the name that case files have for it.
fn name_of_scheme<S: serde::Serializer>(scheme: &TimeScheme, to: S) -> Result<S::Ok, S::Error> {
    scheme.to_value().serialize(to)
}

impl FlowForecast {
    pub(super) fn new(file: &CaseFile, setup: &Setup, plan: &RunPlan, files: &Files) -> Self {
        let case = &file.content;
        let dense = setup.settings.pressure.dense_directions(&setup.mesh);
        let stability = setup.stability();
        let step_s = stability.first_step_s().min(plan.end_s);
        let to_end = steps_to(plan.end_s, step_s, setup).ceil();
        let steps = plan
            .pause_after_steps
            .map_or(to_end, |pause| to_end.min(pause as f64));
        let cells = setup.mesh.cells();
        let ranks = setup.settings.ranks.count();
        // Of a rank with its halos.
        let mut held = cells;
        if ranks > 1 {
            held[2] = (cells[2].div_ceil(ranks) + 2 * HALO_PLANES).min(cells[2]);
        }
        let scheme = setup.settings.scheme;
        let passes = if scheme == TimeScheme::RungeKutta3 {
            3.0
        } else {
            1.0
        };
        let matrices: f64 = dense.iter().map(|n| *n as f64).sum();
        let pictures_s = if case.wake.is_some() && cfg!(feature = "plots") {
            PICTURES_S
        } else {
            0.0
        };
        let eigen_s: f64 = dense.iter().map(|n| (*n as f64).powi(3) * EIGEN_S).sum();
        let cell_s = CELL_S[usize::from(setup.settings.pressure.is_multigrid(&setup.mesh))];
        let pass_s = count(cells) * (cell_s + matrices * MATRIX_S);
        Self {
            case_hash: file.hash.clone(),
            cells,
            scheme,
            scheme_reason: setup.undamped.map(|growth| {
                format!(
                    "as viscosity is too small to damp what Adams-Bashforth feeds (cell Reynolds number {:.3e} at Courant number {:.2})",
                    growth.cell_reynolds, growth.courant
                )
            }),
            courant: step_s * stability.courant_per_s(),
            damped_courant: stability.damped_courant(),
            notes: notes(case, &stability, step_s),
            end_s: plan.end_s,
            end_tau: plan.end_s * setup.tau_per_s,
            step_s,
            steps,
            core_s: eigen_s + (steps * passes + 2.0) * pass_s,
            program_s: START_S + pictures_s,
            memory_bytes: memory_bytes(case, [cells; 2], &dense),
            ranks,
            rank_bytes: memory_bytes(case, [held, cells], &dense),
            files: files.forecast(cells, steps, case.checkpoint.write),
        }
    }

    /// Writes the steps, the scheme and the Courant number.
    fn fmt_steps(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scheme = if self.scheme == TimeScheme::RungeKutta3 {
            "runge_kutta3"
        } else {
            "adams_bashforth2"
        };
        let reason = self
            .scheme_reason
            .as_ref()
            .map_or(String::new(), |reason| format!(", {reason}"));
        writeln!(
            f,
            "  steps    about {:.0} of {:.3e} s, {scheme}{reason}",
            self.steps, self.step_s
        )?;
        if self.damped_courant.is_finite() {
            let courant = self.courant;
            let damped = self.damped_courant;
            writeln!(
                f,
                "  courant  {courant:.3}, all waves of the mesh decay up to {damped:.3}"
            )?;
        }
        Ok(())
    }

    /// Size of all files \[bytes\].
    pub fn file_bytes(&self) -> f64 {
        self.files.iter().map(|kind| kind.bytes).sum()
    }
}

impl fmt::Display for FlowForecast {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [nx, ny, nz] = self.cells;
        writeln!(f, "case {}", self.case_hash)?;
        writeln!(f, "  cells    {nx} x {ny} x {nz} = {}", count(self.cells))?;
        let age = if self.end_tau == self.end_s {
            String::new()
        } else {
            format!(", tau = {:?}", rounded(self.end_tau, 5))
        };
        writeln!(f, "  end      t = {:?} s{age}", rounded(self.end_s, 5))?;
        self.fmt_steps(f)?;
        let time = seconds(self.core_s + self.program_s);
        writeln!(f, "  time     about {time} on one core")?;
        let available = machine::available_memory_bytes()
            .map_or(String::new(), |b| format!(" of {}", bytes(b)));
        let memory = bytes(self.memory_bytes);
        writeln!(f, "  memory   about {memory}{available}")?;
        if self.ranks > 1 {
            let memory = bytes(self.rank_bytes);
            writeln!(f, "  ranks    {}, each about {memory}", self.ranks)?;
        }
        writeln!(f, "  files    about {}", bytes(self.file_bytes()))?;
        for kind in &self.files {
            writeln!(
                f,
                "           {:<28} {:>6} {:>10}",
                kind.name,
                kind.count,
                bytes(kind.bytes)
            )?;
        }
        Ok(())
    }
}

pub(crate) fn count(cells: [usize; 3]) -> f64 {
    cells.iter().map(|n| *n as f64).product()
}

/// What deserves attention before a run.
fn notes(case: &FlowCase, stability: &Stability, step_s: f64) -> Vec<String> {
    let mut notes = case.case.unresolved();
    notes.extend(stability.stiff_note(step_s));
    if let CaseKind::Wake(wake) = &case.case {
        notes.extend(wake.idle());
    }
    notes.extend(case.wake.as_ref().and_then(WakeOutput::idle));
    notes
}

/// Steps to `end_s`, of which the first has the length `first_s`. The step of a wake grows with the cores, in which the air is
/// fastest: their radius squared grows by `4 nu t`, and their largest speed, `b0/(2 r) V0`, falls beside the `V0` that each vortex
/// gets from the other.
fn steps_to(end_s: f64, first_s: f64, setup: &Setup) -> f64 {
    let TimeStep::Courant { longest_s, .. } = setup.settings.time_step else {
        return end_s / first_s;
    };
    let Some(wake) = &setup.wake else {
        return end_s / first_s;
    };
    let viscosity_m2_s = setup.settings.viscosity_m2_s;
    let speed_at_start = core_speed(wake, viscosity_m2_s, 0.0);
    let part_s = end_s / SPREADING_PARTS as f64;
    let mut steps = 0.0;
    for part in 0..SPREADING_PARTS {
        let speed = core_speed(wake, viscosity_m2_s, (part as f64 + 0.5) * part_s);
        let step_s = (first_s * speed_at_start / speed).min(longest_s);
        steps += part_s / step_s;
    }
    steps
}

/// Largest speed of the air of a pair at a time over the speed of its descent.
fn core_speed(wake: &WakeHistory, viscosity_m2_s: f64, time_s: f64) -> f64 {
    let radius_m = (wake.core_radius_m.powi(2) + 4.0 * viscosity_m2_s * time_s).sqrt();
    1.0 + 0.5 * wake.scales.spacing_m / radius_m
}

/// Refuses a case whose fields and matrices do not fit into `available_bytes`.
///
/// # Errors
/// [`Error::TooLarge`], with cells that would fit.
pub(super) fn refuse_too_large(
    case: &FlowCase,
    cells: [usize; 3],
    dense: &[usize],
    available_bytes: Option<f64>,
) -> Result<(), Error> {
    let needed = memory_bytes(case, [cells; 2], dense);
    let Some(available) = available_bytes.filter(|available| needed > *available) else {
        return Ok(());
    };
    let matrices = dense.iter().map(|n| matrix_bytes(*n)).sum::<f64>();
    let (stage, remedy) = if matrices > 0.5 * needed {
        let longest = dense.iter().max().copied().unwrap_or_default();
        let remedy = format!(
            "a direction of {longest} cells that are not equal and periodic is transformed by a matrix; take fewer, or \
             solver.pressure = \"auto\""
        );
        ("the pressure solver", remedy)
    } else {
        let [nx, ny, nz] = fitting(case, cells, dense, available);
        (
            "the fields of the flow",
            format!("case.cells of about {nx} x {ny} x {nz} would fit"),
        )
    };
    Err(Error::TooLarge {
        needed: bytes(needed),
        available: bytes(available),
        stage,
        remedy,
    })
}

/// Cells in the same proportions that fit, two digits of each, rounded down. Nothing grows faster than the cube of a direction.
fn fitting(
    case: &FlowCase,
    cells: [usize; 3],
    dense: &[usize],
    available_bytes: f64,
) -> [usize; 3] {
    let varying = cells.iter().filter(|n| **n > 1).count().max(1) as f64;
    let share = (available_bytes - PROGRAM_BYTES).max(0.0)
        / (memory_bytes(case, [cells; 2], dense) - PROGRAM_BYTES);
    cells.map(|n| {
        let most = if n == 1 {
            1
        } else {
            ((n as f64 * share.powf(1.0 / varying)) as usize).max(4)
        };
        let unit = 10_usize.pow(most.ilog10().saturating_sub(1));
        most / unit * unit
    })
}

/// Memory that a run holds at once \[bytes\], of whose mesh `whole` a rank has `cells`.
fn memory_bytes(case: &FlowCase, [cells, whole]: [[usize; 3]; 2], dense: &[usize]) -> f64 {
    let model = match case.solver.subgrid {
        Subgrid::None {} => 0.0,
        Subgrid::MultiscaleWale { .. } => 6.0,
        Subgrid::Smagorinsky { .. } | Subgrid::Wale { .. } => 4.0,
    };
    let given = match &case.case {
        CaseKind::Wake(_) | CaseKind::VortexPair(_) => 3.0,
        CaseKind::Free(free) if matches!(free.initial, InitialName::Netcdf { .. }) => 3.0,
        _ => 0.0,
    };
    let outputs = if case.output.fields.is_empty() {
        0.0
    } else {
        OUTPUT_ARRAYS
    };
    let meter = if matches!(case.case, CaseKind::Wake(_)) {
        METER_ARRAYS
    } else {
        0.0
    };
    // At the start the given field, which every rank has whole; in the first step of Adams-Bashforth its terms; later what is written.
    let later = count(cells)
        * [FIRST_STEP_ARRAYS, outputs, meter]
            .into_iter()
            .fold(0.0, f64::max);
    let values = count(cells) * (FLOW_ARRAYS + model) + f64::max(count(whole) * given, later);
    8.0 * values + dense.iter().map(|n| matrix_bytes(*n)).sum::<f64>() + PROGRAM_BYTES
}

/// The eigenvectors of a direction, what finds them, and its two transforms.
fn matrix_bytes(n: usize) -> f64 {
    6.0 * 8.0 * (n as f64).powi(2)
}

/// Arrays of a flow: velocity, history, pressure; the velocity before the projection, the increment; two of the refinement.
const FLOW_ARRAYS: f64 = 13.0;
/// Arrays that the first step of Adams-Bashforth needs.
const FIRST_STEP_ARRAYS: f64 = 3.0;
/// Arrays that an output of the whole field needs while it is written.
const OUTPUT_ARRAYS: f64 = 10.0;
/// Arrays that the record of a wake needs.
const METER_ARRAYS: f64 = 4.0;
/// The program without a flow \[bytes\].
const PROGRAM_BYTES: f64 = 1.5e7;
/// Planes of a halo.
const HALO_PLANES: usize = 4;
/// Parts of a run in which the step of a wake is taken as constant.
const SPREADING_PARTS: usize = 100;

// Unit costs on one core, good to a factor of two: a cell of one stage of a step without and with multigrid; a cell of a dense
// direction, the eigenvectors.
const CELL_S: [f64; 2] = [1.2e-7, 2.2e-7];
const MATRIX_S: f64 = 1.5e-10;
const EIGEN_S: f64 = 5e-9;
// What a run takes however few its cells and steps are, and the pictures of a wake.
const START_S: f64 = 0.02;
const PICTURES_S: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn case(text: &str) -> FlowCase {
        CaseFile::parse(text, Path::new("case.toml"))
            .unwrap()
            .content
    }

    #[test]
    fn cells_that_are_said_to_fit_do_and_a_few_more_do_not() {
        for text in [
            "[case]\nkind = \"vortex_pair\"\ncells = [4000, 4000, 4000]\n",
            "[case]\nkind = \"wake\"\ncells = [100, 20000, 9000]\n[output]\nfields = [\"netcdf\"]\n",
        ] {
            let case = case(text);
            let cells = case.case.cells();
            let error = refuse_too_large(&case, cells, &[], Some(8e9)).unwrap_err();
            assert!(matches!(error, Error::TooLarge { .. }), "{error}");
            let fits = fitting(&case, cells, &[], 8e9);
            assert!(
                error
                    .to_string()
                    .contains(&format!("{} x {} x {}", fits[0], fits[1], fits[2])),
                "{error}"
            );
            refuse_too_large(&case, fits, &[], Some(8e9)).unwrap();
            assert!(refuse_too_large(&case, fits.map(|n| n * 5 / 4), &[], Some(8e9)).is_err());
            refuse_too_large(&case, cells, &[], None).unwrap();
        }
        let direct = case(
            "[case]\nkind = \"vortex_pair\"\ncells = [1, 30, 30000]\n[solver]\npressure = \"direct\"\n",
        );
        let error = refuse_too_large(&direct, [1, 30, 30_000], &[30_000], Some(8e9))
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("30000 cells") && error.contains("pressure solver"),
            "{error}"
        );
    }
}
