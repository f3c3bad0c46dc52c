//! What there is to measure in the simulated wake of an aircraft, while the simulation runs.
//!
//! A [`WakeMeter`] follows the two vortices and gives a [`WakeRecord`]: centres in every
//! cross-plane of the mesh, circulation against radius, `Gamma_5-15`, secondary vortices, energy by
//! axial wave number, enstrophy, shear at the ground. All work is one pass over the fields and the
//! circles about the cores: a fifth of a Runge-Kutta step of the coarse wake, more than one step of
//! a plane flow (`cargo bench -p wakescope-les --bench step`).
//!
//! Check: an analytic pair with its images on a mesh, fields of known modes, exact flows (in the
//! files of the parts).

mod cores;
mod meter;
mod record;
#[cfg(test)]
mod reduced;
mod spectrum;
mod vorticity;

pub use meter::WakeMeter;
pub use record::{SecondaryRecord, VortexRecord, WakeRecord, WakeScales};
