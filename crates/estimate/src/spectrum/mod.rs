//! Correlograms of windows and the spectra that belong to them.

pub(crate) mod correlogram;
pub(crate) mod lag_spectrum;
pub(crate) mod sliding;
pub(crate) mod transform;
pub(crate) mod zoom;

pub use correlogram::{Correlogram, Taper, unweighted_lags};
pub use lag_spectrum::LagSpectrum;
pub use sliding::ShortCorrelogram;
pub use zoom::ZoomSpectrum;
