//! Heterodyne efficiency of a coherent lidar: exact theory, and phase screens through turbulence
//! of any strength.
//!
//! The system-antenna efficiency eta_s(R) of (19) is the overlap, at the target, of the transmitted
//! beam and of the local oscillator propagated backwards through the receiver (BPLO), both
//! normalised to unit power before truncation.
//!
//! ```
//! use wakescope_optics::{Telescope, theory};
//!
//! # fn main() -> Result<(), wakescope_optics::Error> {
//! let telescope = Telescope::table2(); // 1.55 um, 1/e radius 30 mm, aperture radius 50 mm, collimated
//! let efficiency = theory::free_space_efficiency(&telescope, 400.0)?;
//! assert!((efficiency - 8.801_813e-3).abs() < 1e-8);
//! # Ok(())
//! # }
//! ```
//!
//! Through turbulence the bistatic mean needs no random numbers
//! ([`theory::bistatic_efficiency`]); the monostatic one is a Monte Carlo (`MonteCarlo`), which
//! gives both receivers from one set of realisations.
//!
//! **Read first** `literal`: (16) to (19) as they are written, one path in sixty lines. It is the
//! oracle of the tests of the Monte Carlo.
//!
//! | equation | where |
//! |---|---|
//! | (16), a step through a layer | `screens::Propagator`; as written in `literal` |
//! | (17), spectrum of the refractive index | [`air::VonKarman`], [`air::Spectrum`] |
//! | (18), a phase screen | `screens::ScreenGenerator`; as written in `literal` |
//! | (19), the efficiency | [`theory`] (exact), `monte_carlo` (by screens); as written in `literal` |
//!
//! | module | what is in it |
//! |---|---|
//! | [`beam`] | telescope, focus, obscuration, misalignment of the two beams; the field at the telescope |
//! | [`air`] | spectrum, Cn2 along the path, structure function, Rytov variance, coherence radius |
//! | [`theory`] | efficiency without random numbers: free space, bistatic at any strength |
//! | [`efficiency`] | efficiency profile with scatter and error |
//! | `screens` | transverse grid, phase screens, split step, inner loops |
//! | `monte_carlo` | layers of the path; efficiency by Monte Carlo |
//! | `plan` | grid, layers, memory, run time; errors that name the limit and a set-up that holds |
//! | `literal` | (16) to (19) term by term, as oracle |
//!
//! Features: `screens` (default) compiles the modules without a link above, with their FFT and
//! random numbers; `rayon` (default) runs realisations in parallel, with the same bits.

#![warn(clippy::too_many_lines, clippy::type_complexity)]

pub mod air;
pub mod beam;
pub mod efficiency;
mod error;
#[cfg(feature = "screens")]
pub mod literal;
#[cfg(feature = "screens")]
pub mod monte_carlo;
#[cfg(feature = "screens")]
pub mod plan;
mod quadrature;
#[cfg(feature = "screens")]
pub mod screens;
pub mod theory;

pub use air::{Cn2Path, Spectrum, Turbulence, VonKarman};
pub use beam::{Focus, Misalignment, RadiusDefinition, Telescope};
pub use efficiency::{EfficiencyProfile, curved_ranges_m};
pub use error::Error;
#[cfg(feature = "screens")]
pub use monte_carlo::{Layers, MonteCarlo, Stop};
#[cfg(feature = "screens")]
pub use screens::Grid;

/// The example of the README is run as a test.
#[cfg(all(doctest, feature = "screens"))]
#[doc = include_str!("../README.md")]
mod readme {}
