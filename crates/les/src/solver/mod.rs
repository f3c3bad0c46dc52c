//! Incompressible large-eddy simulation.

// Indices stand for directions and places of stencils; kernels take their rows one by one, so that they vectorise.
#![allow(clippy::needless_range_loop, clippy::too_many_arguments)]

pub mod cases;
mod checkpoint;
mod control;
mod convection;
mod fields;
mod flow;
mod growth;
mod implicit;
mod layout;
mod line;
mod mapping;
mod mesh;
mod momentum;
mod pressure;
mod projection;
mod report;
mod rows;
mod run;
mod sample;
mod settings;
mod stage;
mod subgrid;
mod transport;
mod wake;

pub use checkpoint::check_checkpoint;
pub use flow::Flow;
pub use growth::UndampedGrowth;
pub use mesh::{Direction, Ends, Mapping, MappingFn, Mesh, Wall};
pub use pressure::{PressureEquation, PressureMethod, Solved as PressureSolved};
pub use report::{StartReport, StepReport};
pub use run::{
    CheckpointPlan, EnergyBudget, Interval, Run, RunObserver, RunPlan, RunSummary, RunWarning, Silent, StepRecord,
};
pub use sample::CrossPlane;
pub use settings::{FlowSettings, TimeScheme, TimeStep, ViscousTreatment};
pub use subgrid::SubgridModel;
pub use wake::{SecondaryRecord, VortexRecord, WakeMeter, WakeRecord, WakeScales};
