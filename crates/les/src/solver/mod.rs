//! Incompressible large-eddy simulation.

mod layout;
mod line;
mod mesh;
mod pressure;
mod transport;

pub use mesh::{Direction, Ends, Mapping, MappingFn, Mesh, Wall};
