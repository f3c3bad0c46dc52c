//! Velocity of the wind from sampled heterodyne signals: periodogram, accumulation over regions, errors, and
//! the bound on what any estimator can reach.
//!
//! The crate takes plain arrays, real at an intermediate frequency or complex, at any sampling rate; it
//! knows nothing of how they were made, so measured windows serve as well as simulated ones.
//! Radial velocities are positive away from the lidar. Equation numbers are those of the chapter on simulating
//! wake vortices seen by a coherent Doppler lidar; "corrected" marks a departure from its print.
//!
//! ```
//! use wakescope_estimate::{PeriodogramPlan, Sampling, Scratch};
//!
//! // 250 MHz sampling, target at rest at 80 MHz, 1.55 um, detector band 55 .. 105 MHz
//! let sampling = Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6))?;
//! let plan = PeriodogramPlan::<f64>::new(&sampling, 64)?;
//! // a tone from a target that recedes at 3 m/s, with a disturbance elsewhere in the band
//! let turn = |f_hz: f64, n: usize| std::f64::consts::TAU * f_hz * n as f64 / 250e6;
//! let frequency_hz = sampling.frequency_hz(3.0);
//! let window: Vec<f64> = (0..64)
//!     .map(|n| turn(frequency_hz, n).cos() + 0.1 * turn(97e6, n).sin())
//!     .collect();
//! let estimate = plan.velocity(&window, &mut Scratch::new())?;
//! assert!(estimate.is_good() && (estimate.velocity_m_s - 3.0).abs() < 0.1);
//! # Ok::<(), wakescope_estimate::Error>(())
//! ```
//!
//! A map is made in two steps: [`Scan::new`] computes a [`Statistic`] of all windows of a scan,
//! [`Scan::map`] averages it over the region of each point and hands the mean to an [`Estimator`].
//!
//! What a first program needs stands here; the rest is in its module.
//!
//! | module | content |
//! |---|---|
//! | [`window`] | frequencies and velocities, windows and ranges, real and complex samples, missing ones, weightings |
//! | [`spectrum`] | biased correlogram, also slid along a record; its power density on a whole grid |
//! | [`models`] | autoregressive models (31), their spectrum (32) |
//! | [`estimators`] | periodogram (29), (30), pulse pair, autoregressive peak, first moment, likelihood with tapers; their traits; when a peak is noise |
//! | [`map`] | regions, accumulation (Table 3) and n_eff, the radius that a variance needs; errors against the truth, (33); good and bad estimates |
//! | [`bound`] | Cramer-Rao bound on the velocity |
//! | [`vortex_fit`] | circulation, position and core of a vortex pair from a velocity map or from all raw signals |
//! | [`wake_detection`] | whether a scan holds a wake: threshold for a rate of false alarms, smallest circulation that is found |
//! | [`retrieval`] | from one scan of any instrument to its vortices, or none; tracks |
//! | [`turbulence`] | spectra, covariances and structure functions of isotropic turbulence |
//! | [`wind_profile`] | winds from beams in several directions, among bad velocities; turbulence and the standard errors that it makes |
//! | `matched_filter` | how well vortices at many positions explain a scan: for the test for a wake, and for first guesses of fits |
//! | `linalg`, `parallel` | solve and eigenvectors with residual checks, the bundled LAPACK; loops on the caller's threads |
//!
//! Features:
//! - `rayon` (default) works on lines of sight and map points in the caller's thread pool; the bits of the result
//!   do not depend on it.
//! - `bundled-lapack` (default) defines the few LAPACK symbols that `ndarray-linalg` calls here, in Rust. They are for
//!   matrices of the order of a window, not a general LAPACK. A program that also links a real LAPACK
//!   takes this crate without default features, else two definitions of one symbol meet; with neither of the two
//!   features such a library must be there at link time.
//! - `openblas-system` links a system OpenBLAS instead; the build stops with the remedy if there is none.

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}

pub mod bound;
mod error;
pub mod estimators;
mod linalg;
pub mod map;
mod matched_filter;
mod measured;
pub mod models;
mod parallel;
pub mod retrieval;
pub mod spectrum;
pub mod turbulence;
pub mod vortex_fit;
pub mod wake_detection;
pub mod wind_profile;
pub mod window;

pub use error::Error;
pub use estimators::{
    Estimator, GateVelocity, PeriodogramPlan, Refinement, SpectralPeak, Statistic,
};
pub use map::{Radius, Scan, polar_points};
pub use measured::Measured;
pub use spectrum::Correlogram;
pub use window::{Gates, Sampling, Scratch, SignalKind, Weighting};
