//! The gates of a scan before they are held against the noise.

use super::lines::ScanLines;
use ndarray::Array2;
use wakescope_estimate::GateVelocity;
use wakescope_estimate::estimators::Quality;
use wakescope_estimate::map::{MapPoint, ScanGeometry};

/// What is known of one gate before the noise is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cell {
    pub(super) found: MapPoint,
    /// Mean power in the band over that of the scene's noise.
    pub(super) power_ratio: f64,
    /// Signal-to-noise ratio over the excess of that ratio over 1.
    pub(super) gain: f64,
    /// Density of the peak over what the scene's noise exceeds with the rate of false alarms; NaN without a test.
    pub(super) detection_ratio: f64,
    /// Standard deviation of the power ratio of noise.
    pub(super) deviation: f64,
    /// Lines of sight that its region reaches.
    pub(super) lines: f64,
}

impl Cell {
    /// A gate of which nothing is known yet.
    pub(super) fn none() -> Self {
        let found = MapPoint { estimate: GateVelocity::none(Quality::Empty), level: 0, left_out: 0, n_eff: 0.0 };
        let [power_ratio, gain, detection_ratio, deviation] = [f64::NAN; 4];
        Self { found, power_ratio, gain, detection_ratio, deviation, lines: 0.0 }
    }
}

/// The gates of a scan.
pub(super) struct ScanCells {
    pub(super) lines: ScanLines,
    pub(super) cells: Array2<Cell>,
    /// Where the windows of the lines are, and the radius of the regions of each gate, m.
    pub(super) regions: (ScanGeometry, Vec<f64>),
    /// Spectra of the gates over the noise of the scene, where they were asked for.
    pub(super) spectra: Option<Vec<f32>>,
}
