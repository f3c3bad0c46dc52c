//! What all realisations of a run share: the path, transfer functions, screen generator and start fields.

use crate::monte_carlo::path::Path;
use crate::monte_carlo::statistics::Folding;
use crate::screens::generator::ScreenGenerator;
use crate::screens::kernel::Real;
use crate::screens::propagate::{Propagator, Transfer};
use rustfft::num_complex::Complex;

/// Everything that is planned once and shared by all realisations.
pub(crate) struct Prepared<T: Real> {
    pub(crate) path: Path,
    pub(crate) propagator: Propagator<T>,
    pub(crate) transfers: Vec<Transfer<T>>,
    pub(crate) screens: Option<ScreenGenerator<T>>,
    /// Start fields: transmitted beam and, if displaced, BPLO.
    pub(crate) start: Vec<Vec<Complex<T>>>,
    pub(crate) folding: Folding,
    /// lambda^2 R^2 / A_R times the area of a pixel, at each range.
    pub(crate) scale: Vec<f64>,
    pub(crate) power: f64,
}
