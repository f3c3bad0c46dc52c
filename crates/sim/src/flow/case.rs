//! The case file of a flow: which flow, how it is integrated, what is written.
//!
//! Every key but `case.kind` has a default; unknown keys are refused. Units are in the key names; a key without a unit has
//! none, or is in the units of the case's literature.

use super::kind::CaseKind;
use super::wake::WakeOutput;
use crate::keys::{Checker, Problem};
use crate::scene::section;
use serde::{Deserialize, Serialize};

/// The version of the case format that this program reads and writes.
pub const FORMAT: u32 = 1;

/// Most output times of a run.
const MAX_OUTPUTS: usize = 9999;

/// A flow to be simulated, as its file says it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlowCase {
    /// Version of the format; only [`FORMAT`] is read.
    #[serde(default = "format")]
    pub format: u32,
    /// The flow.
    pub case: CaseKind,
    /// Time: the end, the scheme, the step.
    #[serde(default)]
    pub time: Time,
    /// How the equations are solved.
    #[serde(default)]
    pub solver: Solver,
    /// What is written.
    #[serde(default)]
    pub output: Output,
    /// How often the whole state is saved.
    #[serde(default)]
    pub checkpoint: Checkpoint,
    /// What is measured and written of a wake; only with `kind = "wake"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wake: Option<WakeOutput>,
}

fn format() -> u32 {
    FORMAT
}

/// Time integration of convection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scheme {
    /// Adams-Bashforth of second order, one pressure solve per step.
    AdamsBashforth2,
    /// Runge-Kutta of three stages, three pressure solves per step and longer steps.
    RungeKutta3,
}

section! {
    /// Time: the end, the scheme, the step.
    #[derive(Copy)]
    Time {
        /// Time at which the run ends \[s\]; that of the literature if absent.
        #[serde(skip_serializing_if = "Option::is_none")]
        end_s: Option<f64> = None,
        /// Time integration of convection; if absent that of the case, or Runge-Kutta where viscosity is too small to damp what
        /// Adams-Bashforth feeds.
        #[serde(skip_serializing_if = "Option::is_none")]
        scheme: Option<Scheme> = None,
        /// Fixed time step \[s\]; if absent, a Courant number controls it.
        #[serde(skip_serializing_if = "Option::is_none")]
        step_s: Option<f64> = None,
        /// Courant number; that of the case or the scheme if absent.
        #[serde(skip_serializing_if = "Option::is_none")]
        courant: Option<f64> = None,
        /// Longest step that the Courant number may give \[s\].
        #[serde(skip_serializing_if = "Option::is_none")]
        longest_step_s: Option<f64> = None,
        /// First steps in which viscosity is backward Euler, against the wiggles of an impulsive start.
        damped_steps: u64 = 0,
        /// The run pauses after so many steps; it continues with `--restart` when this is raised or taken out.
        #[serde(skip_serializing_if = "Option::is_none")]
        pause_after_steps: Option<u64> = None,
    }
}

/// How the pressure equation is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pressure {
    /// The faster one for the mesh.
    Auto,
    /// Transforms and a banded factorisation.
    Direct,
    /// Multigrid behind the transform of one direction.
    Multigrid,
}

/// The subgrid model; constants that are left out are the model's own.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "snake_case", deny_unknown_fields)]
pub enum Subgrid {
    /// None: laminar flow, or direct simulation.
    None {},
    /// Smagorinsky's, for comparison.
    Smagorinsky {
        /// `C_S`.
        #[serde(skip_serializing_if = "Option::is_none")]
        constant: Option<f64>,
    },
    /// WALE.
    Wale {
        /// `C_w`.
        #[serde(skip_serializing_if = "Option::is_none")]
        constant: Option<f64>,
    },
    /// WALE on the small scales.
    MultiscaleWale {
        /// `C_w` of this form.
        #[serde(skip_serializing_if = "Option::is_none")]
        constant: Option<f64>,
        /// Order of the filter, 1 to 4.
        #[serde(skip_serializing_if = "Option::is_none")]
        order: Option<usize>,
    },
}

/// A direction of the mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AxisName {
    /// Along the flight.
    X,
    /// Across it.
    Y,
    /// Up.
    Z,
}

/// Directions in the order of their numbers.
pub(super) const ALL_AXES: [AxisName; 3] = [AxisName::X, AxisName::Y, AxisName::Z];

section! {
    /// How the equations are solved.
    Solver {
        /// Directions of implicit viscosity; chosen by the first time step if absent.
        #[serde(skip_serializing_if = "Option::is_none")]
        implicit_viscosity: Option<Vec<AxisName>> = None,
        /// Order of the directions in memory, that of neighbours first; ranks share the planes across the last one. Absent: x, y, z, but
        /// y, x, z where y has more cells than x, all equal and periodic, and in plane flows the long direction first. Another order
        /// rounds in another way.
        #[serde(skip_serializing_if = "Option::is_none")]
        memory_order: Option<[AxisName; 3]> = None,
        /// How the pressure equation is solved.
        pressure: Pressure = Pressure::Auto,
        /// Relative residual at which it counts as solved.
        pressure_tolerance: f64 = 1e-10,
        /// Rotational form of the pressure update.
        rotational: bool = false,
        /// The subgrid model.
        subgrid: Subgrid = Subgrid::None {},
    }
}

/// Format of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FileFormat {
    /// A table, one row for each value.
    Csv,
    /// Classic NetCDF.
    Netcdf,
    /// VTK rectilinear grids with a collection, for ParaView and PyVista.
    Vtr,
    /// All three velocity components on their own faces in full precision: an initial field for another run.
    InitialNetcdf,
}

section! {
    /// What is written.
    Output {
        /// Times of the outputs \[s\]; the end alone if there are none and no interval.
        times_s: Vec<f64> = Vec::new(),
        /// Outputs at all multiples of this interval \[s\] from the start to the end.
        #[serde(skip_serializing_if = "Option::is_none")]
        every_s: Option<f64> = None,
        /// A table with one row for each step.
        steps: bool = true,
        /// Formats of the whole field at the centres of the cells.
        fields: Vec<FileFormat> = Vec::new(),
        /// Positions of planes across the flight \[m\].
        planes_x_m: Vec<f64> = Vec::new(),
        /// Formats of these planes.
        planes: Vec<FileFormat> = vec![FileFormat::Netcdf],
    }
}

section! {
    /// How often the whole state is saved; with neither, every 500 steps.
    #[derive(Copy)]
    Checkpoint {
        /// False: never.
        write: bool = true,
        /// After so many steps.
        #[serde(skip_serializing_if = "Option::is_none")]
        every_steps: Option<u64> = None,
        /// After so much simulated time \[s\].
        #[serde(skip_serializing_if = "Option::is_none")]
        every_s: Option<f64> = None,
    }
}

impl FlowCase {
    /// Everything in this case that is out of its limits; what depends on the mesh is found when the flow starts.
    pub fn problems(&self) -> Vec<Problem> {
        let mut p = Checker::new(&|_| true);
        p.require(self.format == FORMAT, "format", self.format, "1, the format of this program");
        self.case.check(&mut p);
        self.check_time(&mut p);
        if let Some(order) = &self.solver.memory_order {
            let once = ALL_AXES.iter().all(|axis| order.contains(axis));
            p.require(
                once,
                "solver.memory_order",
                order,
                "each of \"x\", \"y\", \"z\" once, e.g. [\"x\", \"z\", \"y\"]",
            );
        }
        p.within("solver.pressure_tolerance", self.solver.pressure_tolerance, 1e-15, 0.1, "");
        self.check_output(&mut p);
        self.check_wake(&mut p);
        let c = self.checkpoint;
        p.require(c.every_steps != Some(0), "checkpoint.every_steps", c.every_steps, "a whole number above 0");
        if let Some(every_s) = c.every_s {
            p.positive("checkpoint.every_s", every_s);
            p.require(c.every_steps.is_none(), "checkpoint.every_s", every_s, "absent beside checkpoint.every_steps");
        }
        p.into_problems()
    }

    fn check_wake(&self, p: &mut Checker<'_>) {
        let is_wake = matches!(self.case, CaseKind::Wake(_));
        if let Some(wake) = &self.wake {
            p.require(is_wake, "wake.end_tau", wake.end_tau, "absent: the section is for case.kind = \"wake\"");
            wake.check(p);
        }
        let o = &self.output;
        let by_age = !is_wake || (o.times_s.is_empty() && o.every_s.is_none());
        p.require(by_age, "output.times_s", &o.times_s, "absent, like output.every_s: the section wake has the ages");
        let planes = !is_wake || o.planes_x_m.is_empty();
        p.require(planes, "output.planes_x_m", &o.planes_x_m, "absent: see wake.planes_x");
    }

    fn check_time(&self, p: &mut Checker<'_>) {
        let t = self.time;
        let keys = [
            ("time.end_s", t.end_s),
            ("time.step_s", t.step_s),
            ("time.courant", t.courant),
            ("time.longest_step_s", t.longest_step_s),
        ];
        for (key, value) in keys.into_iter().filter_map(|(key, value)| Some((key, value?))) {
            p.positive(key, value);
        }
        if let (Some(step_s), true) = (t.step_s, t.courant.is_some() || t.longest_step_s.is_some()) {
            p.require(false, "time.step_s", step_s, "absent where a Courant number or a longest step is given");
        }
    }

    fn check_output(&self, p: &mut Checker<'_>) {
        let o = &self.output;
        let increasing =
            o.times_s.windows(2).all(|w| w[1] > w[0]) && o.times_s.iter().all(|t| t.is_finite() && *t >= 0.0);
        p.require(increasing, "output.times_s", &o.times_s, "finite, 0 or more, and increasing");
        if let Some(every_s) = o.every_s {
            p.positive("output.every_s", every_s);
            p.require(o.times_s.is_empty(), "output.every_s", every_s, "absent beside output.times_s");
        }
        p.require(o.planes_x_m.iter().all(|x| x.is_finite()), "output.planes_x_m", &o.planes_x_m, "finite");
        let initial = o.planes.contains(&FileFormat::InitialNetcdf);
        p.require(!initial, "output.planes", &o.planes, "csv, netcdf, vtr: an initial field is a whole field");
        for (key, formats) in [("output.fields", &o.fields), ("output.planes", &o.planes)] {
            if let Some(missing) = formats.iter().find_map(|f| f.missing_feature()) {
                p.require(false, key, formats, format!("formats of this build, which lacks the feature `{missing}`"));
            }
        }
    }

    /// Times of the outputs of a run that ends at `end_s` \[s\].
    ///
    /// # Errors
    /// A problem if there are too many.
    pub(super) fn output_times_s(&self, end_s: f64) -> Result<Vec<f64>, Problem> {
        let Some(every_s) = self.output.every_s else {
            return Ok(if self.output.times_s.is_empty() { vec![end_s] } else { self.output.times_s.clone() });
        };
        let count = end_s / every_s;
        if count > MAX_OUTPUTS as f64 {
            let allowed = format!("at least {:?}, for at most {MAX_OUTPUTS} outputs", end_s / MAX_OUTPUTS as f64);
            return Err(Problem { key: "output.every_s".into(), value: format!("{every_s:?}"), allowed });
        }
        // The last multiple may be the end but for rounding.
        let mut times_s: Vec<f64> = (0..=(count + 1e-6).floor() as usize).map(|i| i as f64 * every_s).collect();
        if let Some(last_s) = times_s.last_mut()
            && (*last_s - end_s).abs() < 1e-6 * every_s
        {
            *last_s = end_s;
        }
        Ok(times_s)
    }
}

impl FileFormat {
    /// The feature of this program that the format needs and this build lacks.
    fn missing_feature(self) -> Option<&'static str> {
        match self {
            Self::Csv => None,
            Self::Netcdf | Self::InitialNetcdf => (!cfg!(feature = "netcdf")).then_some("netcdf"),
            Self::Vtr => (!cfg!(feature = "vtk")).then_some("vtk"),
        }
    }
}
