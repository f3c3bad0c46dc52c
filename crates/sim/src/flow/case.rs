//! The case file of a flow: which flow, how it is integrated, what is written.
//!
//! Every key but `case.kind` has a default; unknown keys are refused. Units are in the key names; a key without a unit has
//! none, or is in the units of the case's literature.

use super::kind::CaseKind;
use super::vortex_pair::VortexPairFlow;
use super::wake::WakeOutput;
use crate::keys::{ABOVE_ZERO, Checker, Declared as _, FINITE, Is, Problem, keys};
use std::fmt::Debug;
use wakescope_les::TimeScheme;
use wakescope_les::solver::PressureMethod;

/// The version of the case format that this program reads and writes.
pub const FORMAT: u32 = 1;

crate::keys::foreign_choices! {
    TimeScheme { AdamsBashforth2 = "adams_bashforth2", RungeKutta3 = "runge_kutta3" }
    PressureMethod { Auto = "auto", Direct = "direct", Multigrid = "multigrid" }
}

/// Most output times of a run.
const MAX_OUTPUTS: usize = 9999;

keys! {
    /// A flow to simulate, as given in a case file; the key `case` is required.
    table FlowCase {
        /// Version of the format; only [`FORMAT`] is read.
        format: u32 = FORMAT,
        /// The flow.
        case: CaseKind = CaseKind::VortexPair(VortexPairFlow::default()),
        /// Time integration: end, scheme, step.
        time: Time = Time::default(),
        /// Solution of the equations.
        solver: Solver = Solver::default(),
        /// Output files.
        output: Output = Output::default(),
        /// Interval of checkpoints.
        checkpoint: Checkpoint = Checkpoint::default(),
        /// Measurements and output files of a wake; only with `kind = "wake"`.
        wake: Option<WakeOutput> = None,
    }

    /// Time integration: end, scheme, step.
    #[derive(Copy)]
    table Time {
        /// Time at which the run ends \[s\]; that of the literature if absent.
        end_s: Option<f64> = None => ABOVE_ZERO,
        /// Time integration of convection; if absent that of the case, or Runge-Kutta where viscosity is too small to damp what
        /// Adams-Bashforth feeds.
        scheme: Option<TimeScheme> = None,
        /// Fixed time step \[s\]; if absent, a Courant number controls it.
        step_s: Option<f64> = None => ABOVE_ZERO,
        /// Courant number; that of the case or the scheme if absent.
        courant: Option<f64> = None => ABOVE_ZERO,
        /// Longest step that the Courant number may give \[s\].
        longest_step_s: Option<f64> = None => ABOVE_ZERO,
        /// Number of steps after which the run pauses; it continues with `--restart` once this is raised or removed.
        pause_after_steps: Option<u64> = None,
    }

    /// The subgrid model; omitted constants have the model's defaults.
    #[derive(Copy)]
    kinds Subgrid by "model" {
        /// None: laminar flow, or direct simulation.
        "none" => None {},
        /// Smagorinsky's, for comparison.
        "smagorinsky" => Smagorinsky {
            /// `C_S`.
            constant: Option<f64>,
        },
        /// WALE.
        "wale" => Wale {
            /// `C_w`.
            constant: Option<f64>,
        },
        /// WALE on the small scales.
        "multiscale_wale" => MultiscaleWale {
            /// `C_w` of this form.
            constant: Option<f64>,
            /// Order of the filter, 1 to 4.
            order: Option<usize>,
        },
    }

    /// Solution of the equations.
    table Solver {
        /// How the pressure equation is solved.
        pressure: PressureMethod = PressureMethod::Auto,
        /// Relative residual at which the iteration stops.
        pressure_tolerance: f64 = 1e-10 => 1e-15..=0.1,
        /// The subgrid model.
        subgrid: Subgrid = Subgrid::None {},
    }

    /// Format of a file.
    choice FileFormat {
        /// Classic NetCDF.
        Netcdf = "netcdf",
        /// All three velocity components on their own faces in full precision: an initial field for another run.
        InitialNetcdf = "initial_netcdf",
    }

    /// Output files.
    table Output {
        /// Times of the outputs \[s\]; the end alone if there are none and no interval.
        times_s: Vec<f64> = Vec::new() => Is(
            |times_s: &Vec<f64>| times_s.windows(2).all(|t| t[1] > t[0]) && times_s.iter().all(|t| t.is_finite() && *t >= 0.0),
            "finite, 0 or more, and increasing",
        ),
        /// Outputs at all multiples of this interval \[s\] from the start to the end.
        every_s: Option<f64> = None => ABOVE_ZERO,
        /// A table with one row for each step.
        steps: bool = true,
        /// Formats of the whole field at the centres of the cells.
        fields: Vec<FileFormat> = Vec::new(),
        /// Positions of planes across the flight \[m\].
        planes_x_m: Vec<f64> = Vec::new() => FINITE,
        /// Formats of these planes.
        planes: Vec<FileFormat> = vec![FileFormat::Netcdf],
    }

    /// Interval of checkpoints; with neither interval, every 500 steps.
    #[derive(Copy)]
    table Checkpoint {
        /// Whether checkpoints are written.
        write: bool = true,
        /// Steps between checkpoints.
        every_steps: Option<u64> = None => Is(|steps: &Option<u64>| *steps != Some(0), "a whole number above 0"),
        /// Simulated time between checkpoints \[s\].
        every_s: Option<f64> = None => ABOVE_ZERO,
    }
}

impl FlowCase {
    /// Everything in this case that is out of its limits; what depends on the mesh is found when the flow starts.
    pub fn problems(&self) -> Vec<Problem> {
        let mut p = Checker::new(&|_| true);
        p.require(
            self.format == FORMAT,
            "format",
            self.format,
            "1, the format of this program",
        );
        self.check_limits("", &mut p);
        self.case.check(&mut p);
        self.check_exclusive(&mut p);
        if let Some(wake) = &self.wake {
            wake.check(&mut p);
        }
        let planes = &self.output.planes;
        p.require(
            !planes.contains(&FileFormat::InitialNetcdf),
            "output.planes",
            planes,
            "netcdf: an initial field is a whole field",
        );
        p.into_problems()
    }

    /// Refuses keys beside others that they exclude.
    fn check_exclusive(&self, p: &mut Checker<'_>) {
        let time = &self.time;
        let output = &self.output;
        let checkpoint = &self.checkpoint;
        if let Some(step_s) = time.step_s {
            p.require(
                time.courant.is_none() && time.longest_step_s.is_none(),
                "time.step_s",
                step_s,
                "absent where a Courant number or a longest step is given",
            );
        }
        if let Some(every_s) = output.every_s {
            p.require(
                output.times_s.is_empty(),
                "output.every_s",
                every_s,
                "absent beside output.times_s",
            );
        }
        if let Some(every_s) = checkpoint.every_s {
            p.require(
                checkpoint.every_steps.is_none(),
                "checkpoint.every_s",
                every_s,
                "absent beside checkpoint.every_steps",
            );
        }
        let is_wake = matches!(self.case, CaseKind::Wake(_));
        let has_times = !output.times_s.is_empty() || output.every_s.is_some();
        p.require(
            !(is_wake && has_times),
            "output.times_s",
            &output.times_s,
            "absent, like output.every_s: the section wake has the ages",
        );
        p.require(
            !is_wake || output.planes_x_m.is_empty(),
            "output.planes_x_m",
            &output.planes_x_m,
            "absent: see wake.planes_x",
        );
        if let Some(wake) = &self.wake {
            p.require(
                is_wake,
                "wake.end_tau",
                wake.end_tau,
                "absent: the section is for case.kind = \"wake\"",
            );
        }
    }

    /// Times of the outputs of a run that ends at `end_s` \[s\].
    ///
    /// # Errors
    /// A problem if there are too many.
    pub(super) fn output_times_s(&self, end_s: f64) -> Result<Vec<f64>, Problem> {
        let Some(every_s) = self.output.every_s else {
            return Ok(if self.output.times_s.is_empty() {
                vec![end_s]
            } else {
                self.output.times_s.clone()
            });
        };
        let count = end_s / every_s;
        if count > MAX_OUTPUTS as f64 {
            let allowed = format!(
                "at least {:?}, for at most {MAX_OUTPUTS} outputs",
                end_s / MAX_OUTPUTS as f64
            );
            return Err(Problem::new(
                "output.every_s",
                format!("{every_s:?}"),
                allowed,
            ));
        }
        // The last multiple may be the end but for rounding.
        let mut times_s: Vec<f64> = (0..=(count + 1e-6).floor() as usize)
            .map(|i| i as f64 * every_s)
            .collect();
        if let Some(last_s) = times_s.last_mut()
            && (*last_s - end_s).abs() < 1e-6 * every_s
        {
            *last_s = end_s;
        }
        Ok(times_s)
    }
}
