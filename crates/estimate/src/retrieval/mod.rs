//! From one scan's map of radial velocities to its vortices: circulation, place, core and their errors, or no wake.
//!
//! | module | content |
//! |---|---|
//! | `scan_map`, `velocities`, `options`, `result` | what goes in, how, what comes out |
//! | `fit` | [`fit_scan`], whatever the velocities are |
//! | `gate_means`, `hypotheses`, `report` | fits of means: of wind alone, one vortex and two; which it is; deviations and flags |
//! | `estimates` | the fit to what an estimator of this crate makes of a wake |
//! | `aliases` | winds beyond the Nyquist interval |
//! | `plausible` | what the vortices of an aircraft can be |
//! | `gates`, `whitening` | what a velocity is of the air; correlated velocities |
//! | `scan_turbulence` | turbulence that a scan shows beside its wake |
//! | `secondary` | the fit again with secondary vortices, if the scan shows them |
//! | `radial_velocity`, `envelope` | the methods of the literature beside it, with their errors |
//! | `track` | many scans: filter and smoother |
//!
//! ```
//! use ndarray::Array2;
//! use wakescope_estimate::retrieval::{Flag, RetrievalOptions, ScanMap, Velocities, fit_scan};
//!
//! // a wind of 3 m/s and nothing else
//! let elevation_rad: Vec<f64> = (0..30).map(|i| 0.007 * f64::from(i)).collect();
//! let velocity_m_s = Array2::from_shape_fn((30, 20), |(i, j)| 3.0 * elevation_rad[i].cos() + 0.2 * (7.0 * (i * 20 + j) as f64).sin());
//! let range_m = (0..20).map(|j| 330.0 + 7.0 * f64::from(j)).collect();
//! let time_s = vec![0.0; 30];
//! let map = ScanMap { elevation_rad, time_s, range_m, velocity_m_s, sigma_m_s: None, fold_m_s: None };
//! let found = fit_scan(&map, Velocities::Means, &RetrievalOptions::default())?;
//! assert!(found.has(Flag::NoWake) && (found.lateral_wind_m_s.value - 3.0).abs() < 0.1);
//! # Ok::<(), wakescope_estimate::Error>(())
//! ```

mod aliases;
mod alternatives;
mod envelope;
mod estimates;
mod fit;
mod gate_means;
mod gates;
mod hypotheses;
mod options;
mod plausible;
mod radial_velocity;
mod report;
mod result;
mod scan_map;
pub(crate) mod scan_turbulence;
mod secondary;
mod spikes;
mod track;
mod velocities;
mod whitening;

pub use crate::vortex_fit::Top;
pub use envelope::{EnvelopeResult, ScanSpectra, SpectralShape, velocity_envelopes};
pub use fit::fit_scan;
pub use gates::expected_velocities;
pub use options::{Gate, Movement, RetrievalOptions, Turbulence};
pub use plausible::without_implausible_vortices;
pub use radial_velocity::radial_velocity_method;
pub use result::{Flag, ScanResult, Side, VortexResult};
pub use scan_map::ScanMap;
pub use scan_turbulence::ScanTurbulence;
pub(crate) use scan_turbulence::gate_covariance;
pub use spikes::without_spikes;
pub use track::{Track, TrackPoint, TrackedVortex, track};
pub use velocities::{ScanEstimator, Velocities};
pub(crate) use whitening::Whitening;
