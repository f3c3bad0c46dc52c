//! Winds from radial velocities in several directions, and the turbulence that they show.
//!
//! | module | content |
//! |---|---|
//! | `beam_fit`, `beam_swinging` | least squares over beams (VAD), and the closed form of four beams (DBS) |
//! | `mixture` | the most likely wind among bad velocities |
//! | `correlation`, `gate_covariance` | covariance of the velocities of two gates in isotropic turbulence |
//! | `outer_scale` | outer scales that are tried, and their probabilities |
//! | `restricted_likelihood` | dissipation and noise of velocities about an unknown mean wind |
//! | `stated` | standard deviations in turbulence that velocities share |
//!
//! Check: tables of linear winds; the errors of white noise are those of closed forms; tables of an independent program in
//! `tests/reference/wind`.

mod beam_fit;
mod beam_swinging;
mod correlation;
mod gate_covariance;
mod mixture;
mod outer_scale;
mod restricted_likelihood;
mod stated;

pub use beam_fit::{WindFit, fit_wind};
pub use beam_swinging::swing;
pub use gate_covariance::{GateCovariance, GatePosition};
pub use mixture::{LEAST_LIKELIHOOD, MixtureFit, RadialVelocities, fit_mixture};
pub use outer_scale::{OUTER_SCALES_M, outer_scale_probabilities};
pub use restricted_likelihood::{Block, GateSample, Spectrum, TurbulenceFit, spectra};
pub use stated::{turbulence_covariance, wind_covariance};
