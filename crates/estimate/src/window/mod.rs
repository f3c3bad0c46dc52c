//! Windows of sampled records: frequencies and velocities, ranges, kinds of samples, which of them are missing, weightings.

pub(crate) mod gates;
pub(crate) mod missing;
pub(crate) mod sample;
pub(crate) mod sampling;
pub(crate) mod scratch;
pub(crate) mod signal_kind;
pub(crate) mod weighting;

pub use gates::Gates;
pub use missing::{FILL_VALUES, SampleSizes};
pub use sample::Sample;
pub use sampling::{SPEED_OF_LIGHT_M_S, Sampling};
pub use scratch::Scratch;
pub use signal_kind::SignalKind;
pub use weighting::Weighting;
