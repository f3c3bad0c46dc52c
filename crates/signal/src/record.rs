//! Sampling times of the receiver, and the carrier and noise of its samples.
//!
//! Check: the tests of `heterodyne`.

use num_complex::Complex;

use crate::noise::{BasebandNoise, RealNoise};

/// Sampling times of the receiver after each pulse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Record {
    /// Time of the first sample after the middle of the pulse leaves \[s\]; its range is `c t/2`.
    pub time_of_first_sample_s: f64,
    /// Number of samples.
    pub samples: usize,
}

/// Converts an envelope into samples: the carrier at their times, and noise of either kind.
pub struct Detector {
    pub(crate) carrier: Vec<Complex<f64>>,
    pub(crate) noise: RealNoise,
    pub(crate) baseband_noise: BasebandNoise,
}
