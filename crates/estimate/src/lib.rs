//! Velocity of the wind from sampled heterodyne signals: periodogram, accumulation over regions, errors, and
//! the bound on what any estimator can reach.
//!
//! The crate takes plain arrays, real at an intermediate frequency or complex, at any sampling rate; it
//! knows nothing of how they were made, so measured windows serve as well as simulated ones.
//! Radial velocities are positive away from the lidar. Equation numbers are those of the chapter on simulating
//! wake vortices seen by a coherent Doppler lidar; "corrected" marks a departure from its print.
//!
//! ```
//! use wakescope_estimate::{PeriodogramOptions, PeriodogramPlan, Sampling, Scratch};
//!
//! // 250 MHz sampling, target at rest at 80 MHz, 1.55 um, detector band 55 .. 105 MHz
//! let sampling = Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6))?;
//! let plan = PeriodogramPlan::<f64>::new(&sampling, 64, &PeriodogramOptions::default())?;
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
//! | module | content |
//! |---|---|
//! | `sampling`, `gates`, `sample`, `missing` | frequencies and velocities, windows and ranges, real and complex samples, which of them are missing |
//! | `weighting`, `transform`, `periodogram` | window weights, their transform, (29) and (30) |
//! | `correlogram`, `sliding`, `unbiased` | biased correlogram of all lags; of the first lags, slid along a record; the unbiased form |
//! | `spectrum`, `zoom` | the density that belongs to a correlogram, on a whole grid and at chosen frequencies |
//! | `velocity`, `statistic` | velocity with width, SNR, runner-up and flags; the traits for estimators of one's own |
//! | `search`, `peak` | the peak in the detector band and what it tells |
//! | `detection`, `special` | how high the peak of pure noise stands, for any tapers and lag windows |
//! | `region`, `accumulate`, `auto_radius` | circular regions, accumulation level and n_eff; Table 3, also following the wind; rho(R) for a target variance |
//! | `autoregressive`, `levinson`, `poles` | (31), (32): models, the choice of their order, their poles |
//! | `model_peaks`, `correlogram_estimators` | estimators of the accumulated correlogram: CA, pole, Capon; lag window, pulse pair |
//! | `likelihood` | tapers that make the accumulated periodogram the likelihood of a known pulse |
//! | `gradient`, `gradient_likelihood`, `gradient_tapers` | a linear wind in the window; likelihood of velocity and gradient, for real windows too |
//! | `first_moment` | the mean of a skewed spectrum, which (28) asks for |
//! | `bound`, `linalg` | Cramer-Rao bound; solve and eigenvectors with residual checks |
//! | `shrinkage` | a map drawn towards a guess of the wind as far as it does not contradict it |
//! | `error_map`, `mixture` | bias, standard deviation, root mean square with standard errors, (33); good estimates told from bad ones |
//! | [`vortex_fit`] | circulation, position and core of a vortex pair from a velocity map or from all raw signals |
//!
//! Features:
//! - `rayon` (default) works on lines of sight and map points in the caller's thread pool; the bits of the result
//!   do not depend on it.
//! - `bundled-lapack` (default) defines the few LAPACK symbols that `ndarray-linalg` calls here, in Rust. They are for
//!   matrices of the order of a window, not a general LAPACK. A program that also links a real LAPACK
//!   takes this crate without default features, else two definitions of one symbol meet; with neither of the two
//!   features such a library must be there at link time.
//! - `openblas-system` links a system OpenBLAS instead; the build stops with the remedy if there is none.

mod accumulate;
mod auto_radius;
mod autoregressive;
mod bound;
mod correlogram;
mod correlogram_estimators;
#[cfg(all(feature = "bundled-lapack", not(feature = "openblas-system")))]
mod dense;
mod detection;
mod error;
mod error_map;
mod first_moment;
mod gates;
mod gradient;
mod gradient_likelihood;
mod gradient_tapers;
#[cfg(all(feature = "bundled-lapack", not(feature = "openblas-system")))]
mod lapack;
mod levinson;
mod likelihood;
mod linalg;
mod missing;
mod mixture;
mod model_peaks;
#[cfg(feature = "openblas-system")]
mod openblas;
mod parallel;
mod peak;
mod periodogram;
mod poles;
mod rays;
mod region;
mod sample;
mod sampling;
mod search;
mod shrinkage;
mod sliding;
mod special;
mod spectrum;
mod statistic;
mod transform;
mod unbiased;
mod velocity;
pub mod vortex_fit;
mod weighting;
mod zoom;

pub use accumulate::{MapPoint, Radius, Scan, ScanSums};
pub use autoregressive::{Autoregression, OrderChoice};
pub use bound::{Noise, WindowModel, bound_complex_m_s, bound_real_m_s, information_complex, information_real};
pub use correlogram::{Correlogram, Taper, correlogram_by_sum};
pub use correlogram_estimators::{LagWindowPeak, PulsePair};
pub use detection::NoiseTest;
pub use error::Error;
pub use error_map::{ErrorMap, ErrorStatistics};
pub use first_moment::FirstMoment;
pub use gates::Gates;
pub use gradient::{GradientBound, GradientModel};
pub use gradient_likelihood::{GradientLikelihood, GradientPeak, GradientStatistic, GradientVelocity};
pub use likelihood::likelihood_tapers;
pub use missing::MissingSamples;
pub use mixture::{GoodAndBad, good_and_bad};
pub use model_peaks::{AutoregressivePeak, AutoregressivePole, CaponPeak, model_lag_weights};
pub use peak::SpectralPeak;
pub use periodogram::{Periodogram, PeriodogramOptions, PeriodogramPlan};
pub use region::{Chord, PolarPoint, ScanGeometry, WindowCorrelation, polar_points};
pub use sample::{Sample, Scratch, SignalKind};
pub use sampling::{SPEED_OF_LIGHT_M_S, Sampling};
pub use shrinkage::{ShrinkageOptions, ShrunkMap, shrink_to_guess};
pub use sliding::ShortCorrelogram;
pub use spectrum::{LagSpectrum, density_at};
pub use statistic::{Estimator, Statistic, estimate_window};
pub use unbiased::{Unbiased, unbiased_correlogram};
pub use velocity::{GateVelocity, Quality, Refinement, RunnerUp};
pub use weighting::Weighting;
pub use zoom::ZoomSpectrum;
