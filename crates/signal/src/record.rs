//! When the receiver samples, and what its samples are made of.
//!
//! Check: the tests of `heterodyne`.

use num_complex::Complex;

use crate::noise::{BasebandNoise, RealNoise};

/// When and how long the receiver samples after each pulse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Record {
    /// Time of the first sample after the middle of the pulse leaves \[s\]; its range is `c t/2`.
    pub time_of_first_sample_s: f64,
    /// Number of samples.
    pub samples: usize,
}

/// What turns an envelope into samples: the carrier at their times, and the noise of either kind.
pub struct Detector {
    pub(crate) carrier: Vec<Complex<f64>>,
    pub(crate) noise: RealNoise,
    pub(crate) baseband_noise: BasebandNoise,
}
