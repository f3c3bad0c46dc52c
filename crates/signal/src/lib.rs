//! The signal of a coherent Doppler lidar: from the air along a line of sight to the sampled detector current.
//!
//! Each thin layer of air returns light with a random complex amplitude (speckle), shifted by its radial velocity; the
//! receiver sees the sum over the layers that the pulse lights, and shot noise: equations (6)-(15) of the chapter this
//! project follows, with its errors corrected. The crate also computes the velocity that such a measurement can at best
//! report: the radial velocity weighted by the pulse, (28). SI units, `f64`; a unit is the suffix of each name.
//!
//! ```
//! use rand::SeedableRng;
//! use wakescope_signal::*;
//!
//! let pulse = GaussianPulse::new(PulseDuration::FullWidthHalfMaximum(200e-9), 150e-6)?;
//! let receiver = Receiver {
//!     wavelength_m: 1.55e-6, sample_rate_hz: 250e6, intermediate_frequency_hz: 80e6, bandwidth_hz: 50e6,
//!     quantum_efficiency: 0.8, local_oscillator_w: 1e-3,
//!     planck: PlanckConvention::H, noise: NoiseModel::BandLimited,
//! };
//! let simulator = Simulator::new(pulse, receiver, Record { time_of_first_sample_s: 2e-6, samples: 256 })?;
//! let line = LineOfSight {
//!     first_range_m: 250.0, layer_thickness_m: layer_thickness_m(250e6, 1.55e-6, pulse.sigma_s(), 0.5)?,
//!     radial_velocity_m_s: vec![3.0; 500], weight_per_m: vec![4e-17; 500],
//! };
//! let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
//! let mut current_a = [0.0; 256];
//! simulator.record_into(&line, &mut rng, &mut Scratch::default(), &mut current_a)?;
//! assert!(current_a.iter().all(|i| i.is_finite() && *i != 0.0));
//! # Ok::<(), Error>(())
//! ```
//!
//! | module | what is in it |
//! |---|---|
//! | `pulse` | [`GaussianPulse`]: envelope (7), its range weight |
//! | `sampled` | [`SampledPulse`]: any envelope given by samples, and how it is resampled |
//! | `transmitted` | [`Pulse`]: either of them, with chirp; its moments, and the layers it needs |
//! | `piecewise` | the cubic pieces that a sampled envelope is kept in |
//! | `medium` | [`Medium`]: backscatter and extinction by range |
//! | `efficiency` | [`EfficiencyTable`]: heterodyne efficiency, one curve or one realisation per pulse |
//! | `table` | tables over range |
//! | `line` | [`LineOfSight`]; how thin a layer must be; what to do outside the flow's domain |
//! | `shot` | [`Shot`]: what one pulse meets |
//! | `receiver` | sampling, responsivity, noise power (13), signal-to-noise ratio (14), folding |
//! | `heterodyne` | [`Simulator`]: one record per pulse, (15), (12), fast form |
//! | `window`, `kernel` | which layers are lit at a sample; the inner loop |
//! | `literal` | the same sum term by term, as oracle |
//! | `noise` | band-limited or white shot noise, real or complex |
//! | `expected` | mean power, (14), and covariance of the samples, without drawing any |
//! | `digitise` | [`Digitiser`]: rounding and saturation |
//! | `scan` | [`Scan`]: all pulses of a scan, in parallel and in bounded memory |
//! | `parallel` | loops on the caller's thread pool |
//! | `series` | [`TimeSeries`]: records of many pulses |
//! | `filter` | [`RangeFilter`]: velocity profiles weighted by pulse and gate, (28) |
//!
//! Feature `rayon` (default): the pulses of a scan in the caller's thread pool; the bits of the result do not depend on it.

mod constants;
mod digitise;
mod efficiency;
mod error;
mod expected;
mod filter;
mod heterodyne;
mod kernel;
mod line;
mod literal;
mod medium;
mod noise;
mod parallel;
mod piecewise;
mod pulse;
mod receiver;
mod sampled;
mod scan;
mod series;
mod shot;
mod table;
mod transmitted;
mod window;

pub use constants::{ELEMENTARY_CHARGE_C, PLANCK_J_S, SPEED_OF_LIGHT_M_S};
pub use digitise::{Clipped, Digitiser};
pub use efficiency::{EfficiencyTable, LayerEfficiency};
pub use error::Error;
pub use filter::RangeFilter;
pub use heterodyne::{Record, Scratch, Simulator};
pub use line::{BeyondBand, LineOfSight, OutsideDomain, layer_thickness_m};
pub use literal::literal_envelope;
pub use medium::Medium;
pub use pulse::{GaussianPulse, PulseDuration};
pub use receiver::{NoiseModel, PlanckConvention, Receiver};
pub use sampled::{Resampling, SampledPulse};
pub use scan::{PulseKey, Sample, Scan, pulse_generator};
pub use series::TimeSeries;
pub use shot::Shot;
pub use transmitted::Pulse;
