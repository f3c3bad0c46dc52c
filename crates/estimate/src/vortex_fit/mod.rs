//! Circulation, position and core of a wake's two vortices, from a map of radial velocities or from all raw signals.
//!
//! | file | content |
//! |---|---|
//! | `wake`, `free` | the vortex pair with its images and the wind, derivatives; which parameters a fit may change |
//! | `range_kernel`, `wake_map` | what a range gate and a region see of it in the mean |
//! | `estimator_response`, `tangent` | what an estimator makes of its spectra: the map of very many pulses, and that of wakes near by |
//! | `guess`, `map_fit`, `map_problem` | fit to a map: search for the best pair, then robust least squares |
//! | `estimator_fit`, `map_starts`, `residual_covariance` | the same for the map of an estimator; several starts; correlated residuals |
//! | `baseband`, `pulse`, `scan_model` | raw signals at the rate of the detector band; lines cut into layers |
//! | `line`, `band`, `likelihood` | covariance of a line, its factor and derivatives; likelihood and Fisher information |
//! | `signal_fit`, `ascent`, `tops`, `small` | fit to all raw signals, the tops of its likelihood; the damped Newton iteration of both fits |
//!
//! A map is fitted first, without prior knowledge ([`fit_map_of_estimator`]; [`fit_map`] if its velocities are means
//! over gates); its outcome starts the fit of the signals ([`fit_signals`]). The bound on any unbiased fit of the
//! signals is [`ScanModel::bound`].
//!
//! Measured on scans of an analytic pair (500 m^2/s, 47 m apart and high, 376.5 and 423.5 m away, core 2.35 m, 200 ns,
//! 185 lines of one pulse each, 0 dB in 50 MHz, band noise, records from 280 to 520 m):
//!
//! - bound on the common circulation 6.8 m^2/s if the core is known and 8.3 if each core is fitted (2.5 and 3.4 at 10 dB);
//!   0.13 m in height, 0.78 m across;
//! - fit of the signals: bias -0.2 +- 0.8 m^2/s and standard deviation 7.8 +- 0.6 with the core known, -0.5 +- 1.0 and
//!   9.7 +- 0.7 with one core radius fitted: 1.14 +- 0.08 and 1.17 +- 0.08 times the bound (100 scans);
//! - fit of a map: 19.3 +- 1.4 m^2/s with a core of 4.5 % of the spacing, 24.7 +- 1.8 with one core radius fitted. What
//!   an estimator shows of a core is not its mean: taken for one, peaks of periodograms mislead by more than 10 %.
//!
//! `cargo xtask reproduce-figs --profile standard --only 17` measures them again.
//!
//! The likelihood of one scan has several tops near the highest, since few lines cross a core and each has its speckle;
//! which one is found depends on the start. So fits of signals begin with several core radii and heights ([`Starts`]), keep the
//! highest top and report the others; `cargo xtask fit-trials` measures that against a start at the truth.
//!
//! To measure again: `cargo test --release -p wakescope-tests --test it -- --ignored --nocapture circulation_over_many_scans`
//! (signals) or `circulation_from_many_maps` (maps).

mod ascent;
mod band;
mod baseband;
mod core_prior;
mod estimator_fit;
mod estimator_response;
mod free;
mod guess;
mod likelihood;
mod line;
mod map_fit;
mod map_problem;
mod map_starts;
mod pulse;
mod range_kernel;
mod residual_covariance;
mod scan_model;
mod signal_fit;
mod small;
mod tangent;
mod tops;
mod wake;
mod wake_map;

pub use baseband::Baseband;
pub use core_prior::CorePrior;
pub use estimator_fit::{fit_map_of_estimator, refine_map_fit_of_estimator};
pub use estimator_response::EstimatorResponse;
pub use free::{FreeParameters, Sharing, WindFit};
pub use likelihood::{LikelihoodValue, Powers, ScanSignals};
pub use map_fit::{Loss, MapFit, MapFitOptions, MapTop, VelocityMap, fit_map, refine_map_fit};
pub use pulse::PulseShape;
pub use range_kernel::RangeKernel;
pub use scan_model::{ScanModel, ScanSetup};
pub use signal_fit::{SignalFit, SignalFitOptions, Starts, fit_signals};
pub use tops::LikelihoodTop;
pub use wake::{CoreProfile, PARAMETERS, Parameter, Vortex, Wake, WakeModel};
