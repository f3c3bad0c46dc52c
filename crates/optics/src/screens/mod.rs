//! Waves on a transverse grid: phase screens (18) and the steps between them (16), with their
//! transforms and inner loops.

pub(crate) mod generator;
pub(crate) mod grid;
pub(crate) mod kernel;
pub(crate) mod low_frequency;
pub(crate) mod propagate;

pub use generator::{ScreenGenerator, stream};
pub use grid::{Grid, Work};
pub use kernel::Real;
pub use propagate::{Propagator, Transfer};
