//! The gates of a scan before they are held against the noise.

use super::lines::ScanLines;
use ndarray::Array2;
use wakescope_estimate::map::ScanGeometry;

/// What is known of one gate before the noise is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cell {
    pub(super) velocity_m_s: f64,
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
    /// Variance of the velocities in the spectrum, and what the method adds to it, m^2/s^2.
    pub(super) spread: (f64, f64),
    pub(super) quality: f64,
    pub(super) level: f64,
    pub(super) n_eff: f64,
    pub(super) is_good: bool,
}

impl Cell {
    /// A gate of which nothing is known yet.
    pub(super) const NONE: Self = Self {
        velocity_m_s: f64::NAN,
        power_ratio: f64::NAN,
        gain: f64::NAN,
        detection_ratio: f64::NAN,
        deviation: f64::NAN,
        lines: 0.0,
        spread: (f64::NAN, f64::NAN),
        quality: f64::NAN,
        level: 0.0,
        n_eff: 0.0,
        is_good: false,
    };
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
