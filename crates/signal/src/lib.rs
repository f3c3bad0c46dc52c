//! The signal of a coherent Doppler lidar: from the air along a line of sight to the sampled
//! detector current.
//!
//! Each thin layer of air returns light with a random complex amplitude (speckle), shifted by its
//! radial velocity; the receiver measures the sum over the layers that the pulse lights, and shot
//! noise: equations (6)-(15) of the chapter this project follows, with its errors corrected. The
//! crate also computes the velocity that such a measurement can at best report: the radial velocity
//! weighted by the pulse, (28). SI units, `f64`; a unit is the suffix of each name.
//!
//! ```
//! use rand::SeedableRng;
//! use wakescope_signal::*;
//!
//! let (pulse, receiver) = (Pulse::from(GaussianPulse::table2()), Receiver::table2());
//! let simulator = Simulator::new(&pulse, receiver, Record { time_of_first_sample_s: 2e-6, samples: 256 })?;
//! let limits = receiver.layer_limits(0.5);
//! let line = LineOfSight {
//!     first_range_m: 250.0, layer_thickness_m: pulse.layer_thickness_m(limits)?,
//!     radial_velocity_m_s: vec![3.0; 500], weight_per_m: vec![4e-17; 500],
//! };
//! let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
//! let current_a: Vec<f64> = simulator.record_of(&line, &mut rng)?;
//! assert!(current_a.iter().all(|i| i.is_finite() && *i != 0.0));
//! # Ok::<(), Error>(())
//! ```
//!
//! **Read first** [`literal`]: (15) as it is written, in thirty lines.
//!
//! | module | what is in it |
//! |---|---|
//! | `pulse` | [`Pulse`]: [`GaussianPulse`] (7) or sampled; its moments and range weight, and the layers it needs |
//! | `sampled` | [`Pulse::from_envelope`], [`Pulse::from_power`]: any envelope given by samples, joined by a spline |
//! | `piecewise` | cubic pieces of a sampled envelope |
//! | `medium` | [`Medium`]: backscatter and extinction by range or height |
//! | [`aerosol`] | extinction of a visibility; a layer over height |
//! | [`efficiency`] | [`LayerEfficiency`](efficiency::LayerEfficiency): heterodyne efficiency, one curve or one realisation per pulse |
//! | `table` | tables over range |
//! | `line` | [`LineOfSight`]; how thin a layer must be, [`LayerLimits`] |
//! | `shot` | [`Shot`]: line of sight and efficiency of one pulse |
//! | [`receiver`] | sampling, responsivity, noise power (13), signal-to-noise ratio (14); what a real receiver adds |
//! | `heterodyne` | [`Simulator`]: one record per pulse, (15), (12), fast form |
//! | `record` | [`Record`]: when the receiver samples; carrier and noise of the samples |
//! | `sample` | [`Sample`]: the current, or both quadratures of the baseband |
//! | `impairments` | effects beyond (15): laser phases, reflex of the telescope, second-trip echo |
//! | `window`, `kernel` | which layers are lit at a sample; the inner loop |
//! | [`literal`] | the same sum term by term, as oracle |
//! | `noise` | band-limited or white shot noise, real or complex |
//! | `expected` | mean power, (14), and covariance of the samples, without random numbers |
//! | `accumulated` | [`AccumulatedProducts`]: products of samples summed over many records, drawn at once |
//! | [`digitise`] | [`Digitiser`](digitise::Digitiser): rounding and saturation |
//! | [`scan`] | [`Scan`]: all pulses of a scan, in parallel and in bounded memory |
//! | `parallel` | loops on the caller's thread pool |
//! | `filter` | [`RangeFilter`]: velocity profiles weighted by pulse and gate, (28) |
//!
//! Feature `rayon` (default): the pulses of a scan in the caller's thread pool; the bits of the
//! result do not depend on it.

#![warn(clippy::too_many_lines, clippy::type_complexity)]

mod accumulated;
pub mod aerosol;
pub mod constants;
pub mod digitise;
pub mod efficiency;
mod error;
mod expected;
mod filter;
mod heterodyne;
mod impairments;
mod kernel;
mod line;
pub mod literal;
mod medium;
mod noise;
mod parallel;
mod piecewise;
mod pulse;
pub mod receiver;
mod record;
mod sample;
mod sampled;
pub mod scan;
mod shot;
mod table;
mod window;

pub use accumulated::AccumulatedProducts;
pub use constants::SPEED_OF_LIGHT_M_S;
pub use error::Error;
pub use filter::RangeFilter;
pub use heterodyne::{Scratch, Simulator};
pub use line::{LayerLimits, LineOfSight};
pub use medium::Medium;
pub use pulse::{GaussianPulse, Pulse};
pub use receiver::{NoiseModel, Receiver};
pub use record::Record;
pub use sample::Sample;
pub use scan::Scan;
pub use shot::Shot;

/// The example of the README is run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
