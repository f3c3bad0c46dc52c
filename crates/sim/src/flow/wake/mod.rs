//! The wake of an aircraft as a flow: its case, its presets, what is measured and written while it runs.
//!
//! Geometry and noise are in the units of the pair, lengths `b0` and velocities `V0 = Gamma0/(2 pi b0)`; the pair itself, wind
//! and all files are in SI units.
//!
//! Check: presets are those of the solver; tests of `flow` interrupt runs and compare the bytes.

mod case;
mod finished;
mod history;
mod output;
#[cfg(feature = "plots")]
mod pictures;
mod preset;
mod schedule;

pub use case::{PairScale, WakeFlow, WakeProfile};
pub use finished::{FinishedWake, table};
pub(super) use history::{HISTORIES, WakeHistory};
pub use output::WakeOutput;
#[cfg(feature = "plots")]
pub(super) use pictures::PICTURES;
#[cfg(feature = "plots")]
pub use pictures::REPEATS;
pub use preset::WakePreset;
pub(super) use schedule::{Due, age_tau, plain_schedule, wake_schedule};
