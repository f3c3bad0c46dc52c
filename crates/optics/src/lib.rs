//! Heterodyne efficiency of a coherent lidar: exact theory, and phase screens through turbulence of any strength.
//!
//! The system-antenna efficiency eta_s(R) of (19) is the overlap, at the target, of the transmitted beam and of the
//! local oscillator propagated backwards through the receiver (BPLO), both normalised to unit power before truncation.
//!
//! ```
//! use wakescope_optics::{SnrModel, Telescope, theory};
//!
//! # fn main() -> Result<(), wakescope_optics::Error> {
//! let telescope = Telescope::chapter(); // 1.55 um, 1/e radius 30 mm, aperture radius 50 mm, collimated
//! let efficiency = theory::free_space_efficiency(&telescope, 400.0)?;
//! assert!((efficiency - 8.801_813e-3).abs() < 1e-8);
//!
//! let snr = SnrModel::chapter().snr(400.0, efficiency)?;
//! assert!((10.0 * snr.log10() + 8.436).abs() < 1e-3);
//! # Ok(())
//! # }
//! ```
//!
//! Through turbulence the bistatic mean needs no random numbers ([`theory::bistatic_efficiency`]); the monostatic one is a
//! Monte Carlo (`MonteCarlo`), which gives both receivers from one set of realisations.
//!
//! | module | what is in it |
//! |---|---|
//! | [`beam`] | telescope, focus, obscuration, misalignment of the two beams |
//! | [`theory`] | exact efficiency: free space, bistatic at any strength, closed forms; monostatic in weak turbulence |
//! | [`hankel`] | free space by an independent Fresnel-Hankel quadrature; free-space irradiance |
//! | [`spectrum`], [`structure`] | spectra of the refractive index and their structure functions |
//! | [`turbulence`] | Cn2 along the path, Rytov variance, coherence radius |
//! | [`efficiency`] | efficiency profile with scatter and error |
//! | [`snr`] | signal-to-noise ratio (14), corrected |
//! | `grid`, `screen`, `propagate`, `source` | transverse grid, phase screens, split step, field at the telescope |
//! | `path`, `monte_carlo` | layers of the path; efficiency by Monte Carlo |
//! | `plan` | grid, layers, memory, time; refusals that name the limit |
//! | [`sampling`] | limits of a grid, what violates them, what would do |
//!
//! Features: `screens` (default) compiles the modules without a link above, with their FFT and random numbers; `rayon`
//! (default) runs realisations in parallel, with the same bits.

pub mod beam;
mod descent;
pub mod efficiency;
mod encircled;
mod error;
#[cfg(feature = "screens")]
pub mod grid;
pub mod hankel;
#[cfg(feature = "screens")]
mod kernel;
#[cfg(feature = "screens")]
mod low_frequency;
#[cfg(feature = "screens")]
pub mod monte_carlo;
#[cfg(all(test, feature = "screens"))]
mod mutation;
mod overlap;
#[cfg(feature = "screens")]
pub mod path;
#[cfg(feature = "screens")]
pub mod plan;
#[cfg(feature = "screens")]
pub mod propagate;
mod quadrature;
pub mod sampling;
#[cfg(feature = "screens")]
pub mod screen;
pub mod snr;
#[cfg(feature = "screens")]
pub mod source;
pub mod spectrum;
#[cfg(feature = "screens")]
mod statistics;
pub mod structure;
pub mod theory;
pub mod turbulence;
#[cfg(feature = "screens")]
mod walk;
mod weak;

pub use beam::{Focus, Misalignment, RadiusDefinition, Telescope};
#[cfg(feature = "screens")]
pub use efficiency::EfficiencyEstimate;
pub use efficiency::EfficiencyProfile;
pub use error::Error;
#[cfg(feature = "screens")]
pub use grid::Grid;
#[cfg(feature = "screens")]
pub use kernel::Real;
#[cfg(feature = "screens")]
pub use monte_carlo::{MonteCarlo, Progress, Sampling, Stop};
#[cfg(feature = "screens")]
pub use path::Layers;
pub use snr::{PlanckConvention, SnrModel};
pub use spectrum::{HillAndrews, OuterScaleConvention, Spectrum, VonKarman};
pub use turbulence::{Cn2Path, Turbulence};
