//! Incompressible large-eddy simulation.

// Indices stand for directions and places of stencils; kernels take their rows one by one, so that
// they vectorise.
#![allow(clippy::needless_range_loop, clippy::too_many_arguments)]

mod aligned;
pub mod cases;
mod checkpoint;
mod component_operators;
mod control;
mod convection;
mod fields;
pub(crate) mod flow;
mod growth;
mod implicit;
pub(crate) mod layout;
#[cfg(test)]
mod literal;
pub(crate) mod mesh;
mod operators_1d;
pub(crate) mod planes;
mod pressure;
mod projection;
mod report;
mod row_operator;
mod rows;
mod run;
pub(crate) mod settings;
pub(crate) mod shape;
mod slabs;
#[cfg(test)]
mod slabs_tests;
mod stiffness;
mod subgrid;
mod transport;

pub use checkpoint::check_checkpoint;
pub use flow::Flow;
pub use growth::{Stability, UndampedGrowth};
pub use mesh::{Direction, Ends, Mapping, MappingFn, Mesh, Spread, Wall};
pub use pressure::PressureMethod;
pub use report::StepReport;
pub use run::{
    CheckpointPlan, EnergyBudget, Interval, NOTICED_GROWTH, Run, RunObserver, RunPlan, RunWarning,
    StepEnergy, StepRecord,
};
pub use settings::{FlowSettings, TimeScheme, TimeStep};
pub use subgrid::SubgridModel;
