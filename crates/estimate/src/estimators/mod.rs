//! From an accumulated correlogram to a velocity with width, SNR and flags; the traits for your own estimators.

pub(crate) mod cell_threshold;
pub(crate) mod detection;
pub(crate) mod first_moment;
pub(crate) mod likelihood;
pub(crate) mod model_peak;
pub(crate) mod noise_floor;
pub(crate) mod peak;
pub(crate) mod periodogram;
pub(crate) mod pulse_pair;
pub(crate) mod search;
pub(crate) mod statistic;
pub(crate) mod tails;
pub(crate) mod velocity;

pub use cell_threshold::cell_threshold;
pub use detection::{NoiseTest, RegionNoise};
pub use first_moment::FirstMoment;
pub use likelihood::likelihood_tapers;
pub use model_peak::{ModelPeak, model_lag_weights};
pub use noise_floor::noise_floor;
pub use peak::SpectralPeak;
pub use periodogram::PeriodogramPlan;
pub use pulse_pair::PulsePair;
pub use statistic::{Estimator, Statistic, estimate_window};
pub use velocity::{GateVelocity, Quality, Refinement};
