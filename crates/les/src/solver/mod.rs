//! Incompressible large-eddy simulation.

pub mod cases;
mod fields;
mod flow;
mod implicit;
mod interim;
mod interim_subgrid;
mod layout;
mod line;
mod mesh;
mod momentum;
mod pressure;
mod projection;
mod rows;
mod settings;

mod transport;

pub use flow::{Flow, StartReport, StepReport};
pub use interim_subgrid::SubgridModel;
pub use mesh::{Direction, Ends, Mapping, MappingFn, Mesh, Wall};
pub use pressure::{PressureEquation, PressureMethod, Solved as PressureSolved};
pub use settings::{FlowSettings, TimeScheme, TimeStep, ViscousTreatment};
