//! The wake of an aircraft as a flow: its case, its presets, what is measured and written while it runs.
//!
//! Geometry and noise are in the units of the pair, lengths `b0` and velocities `V0 = Gamma0/(2 pi b0)`; the pair itself, wind
//! and all files are in SI units.
//!
//! Check: presets are those of the solver; tests of `flow` interrupt runs and compare the bytes.

mod case;
mod history;
mod output;
mod preset;
mod schedule;

pub use case::{PairScale, WakeFlow, WakeProfile};
pub(super) use history::{WakeRun, file_names};
pub use output::WakeOutput;
pub use preset::WakePreset;
pub(super) use schedule::{Due, Schedule};
