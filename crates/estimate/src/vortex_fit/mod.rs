//! Circulation, position and core of a wake's two vortices, from a map of radial velocities or from all raw signals.
//!
//! | module | content |
//! |---|---|
//! | `wake` | `pair`: the vortices with their images and the wind, derivatives; `motion`; `free_parameters`: which a fit may change; `core_prior`: what is known before; `range_kernel`, `wake_map`: what a range gate and a region see in the mean; `pulse` |
//! | `map_fit` | `data`, `cells`: the map; `prediction`: what is expected of it, by `gates` at rest or in motion or by an estimator (`estimator_response`); `least_squares`: what is minimised and what is known at the minimum; `residual_covariance`; `setting`: both ways to the minimum; `guess`, `starts`, `estimates`: fits of our own maps; `secondary`: four vortices; `local_circulation`: what is near each vortex |
//! | `signal_fit` | `baseband`, `scan_model`: signals at the rate of the detector band, lines cut into layers; `line_covariance`, `banded_cholesky`, `likelihood`: covariance of a line, its factor and derivatives, Fisher information; `fit`, `ascent`, `tops`: the fit and the tops of its likelihood |
//! | `top` | the ends of fits from several starts |
//! | `levenberg_marquardt` | the iteration that both fits share |
//! | `tolerances` | when each pass of a fit stops, and which of its minima are compared, in one table |
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
//! - fit of a map: 19.3 +- 1.4 m^2/s with a core of 4.5 % of the spacing, 24.7 +- 1.8 with one core radius fitted freely. What
//!   an estimator shows of a core is not its mean: taken for one, peaks of periodograms mislead by more than 10 %.
//!
//! `cargo xtask reproduce-figs --profile standard --only 17` measures them again.
//!
//! The likelihood of one scan has several tops near the highest, since few lines cross a core and each has its speckle;
//! which one is found depends on the start. So fits of signals begin with several core radii and heights ([`SignalFitOptions::several_starts`]), keep the
//! highest top and report the others; `cargo xtask fit-trials` measures that against a start at the truth.
//!
//! To measure again: `cargo test --release -p wakescope-tests --test it -- --ignored --nocapture circulation_over_many_scans`
//! (signals) or `circulation_from_many_maps` (maps).

pub(crate) mod levenberg_marquardt;
pub(crate) mod map_fit;
mod signal_fit;
pub(crate) mod tolerances;
pub(crate) mod top;
pub(crate) mod wake;

pub use map_fit::data::{Loss, MapFit, MapFitOptions, Secondary, VelocityMap};
pub use map_fit::estimates::{
    fit_map, fit_map_of_estimator, fit_secondary_vortices, gain_over_local_circulations,
    refine_map_fit_of_estimator, with_local_circulations,
};
pub use map_fit::estimator_response::EstimatorResponse;
pub use map_fit::secondary::SecondaryVortices;
pub use signal_fit::baseband::Baseband;
pub use signal_fit::fit::{SignalFit, fit_signals};
pub use signal_fit::likelihood::{LikelihoodValue, Powers, ScanSignals};
pub use signal_fit::options::SignalFitOptions;
pub use signal_fit::scan_model::{ScanModel, ScanSetup};
pub use top::Top;
pub use wake::core_prior::CorePrior;
pub use wake::free_parameters::{FreeParameters, Sharing, WindFit};
pub use wake::pair::{CoreProfile, PARAMETERS, Parameter, Vortex, Wake, WakeModel};
pub use wake::pair_prior::PairPrior;
pub use wake::range_kernel::RangeKernel;
pub use wake::rolling_moment::{Follower, LiftSlope};
