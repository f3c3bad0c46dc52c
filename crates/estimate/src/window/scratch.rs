//! The work space that the caller owns, so that estimates need no allocation.
//!
//! Check: in the tests of the estimators, which reuse one for all windows.

use crate::models::Autoregression;
use num_complex::Complex;

/// Work space owned by the caller; buffers grow on first use and are then reused without allocation.
///
/// One per thread. The contents between calls mean nothing. Estimators of other crates may use the
/// public buffers as they like.
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    /// Free real numbers.
    pub real: Vec<f64>,
    /// Free complex numbers.
    pub complex: Vec<Complex<f64>>,
    /// Densities in the detector band and next to it.
    pub(crate) band: Vec<f64>,
    /// Spectrum on the whole grid.
    pub(crate) density: Vec<f64>,
    /// Half spectrum of the transforms.
    pub(crate) half: Vec<Complex<f64>>,
    /// Inner work space of the transforms.
    pub(crate) transform: Vec<Complex<f64>>,
    /// Correlogram on its way into a transform.
    pub(crate) numbers: Vec<f64>,
    /// Autoregressive model.
    pub(crate) model: Autoregression,
    /// Power spectrum of one window.
    pub(crate) power: Vec<f64>,
}

impl Scratch {
    /// An empty work space.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}
