//! Winds from radial velocities in several directions: the sine fit of velocity-azimuth displays (VAD), and Doppler beam
//! swinging (DBS).
//!
//! Both suppose that the wind is the same at all beams of one height. Check: tables of linear winds; the errors of white noise
//! are those of closed forms.

mod beam_fit;
mod beam_swinging;

pub use beam_fit::{WindFit, fit_wind};
pub use beam_swinging::swing;
