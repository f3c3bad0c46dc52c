//! Maximum likelihood for a known pulse, as a periodogram with several tapers.
//!
//! The covariance of a window is E S E^H + q I with E the carrier of velocity v, S the envelope at rest and q the white
//! noise. Then -x^H R^-1 x is, up to a constant, the sum over i of w_i |u_i^T E^H x|^2, with u_i the eigenvectors of S and
//! w_i = lambda_i / (lambda_i + q): a weighted sum of tapered periodograms at the frequency of v, which
//! accumulates over windows like any other. Nothing is inverted, so any SNR is safe. Check: the
//! quadratic form itself, and the standard deviation of its estimates against the Cramer-Rao bound.

use crate::bound::WindowModel;
use crate::error::{Error, positive};
use crate::linalg::hermitian_eigen;
use crate::spectrum::Taper;

/// Tapers with less than this fraction of the largest weight are skipped.
const LEAST_WEIGHT: f64 = 1e-3;

/// Tapers of the likelihood of velocity for windows like `model` at signal-to-noise ratio `snr` (in the detector band).
///
/// Their factors add to 1, so white noise reads its variance. Feed them to
/// [`Correlogram::with_tapers`](crate::Correlogram::with_tapers) and the peak to [`SpectralPeak`](crate::SpectralPeak).
/// The noise counts as white with the density that it has in the band. Exact for circular complex windows of a pulse with a
/// symmetric spectrum: tapers are real, of the real part of the envelope. For real windows the mirror image is neglected.
///
/// # Errors
/// [`Error::OutOfRange`] if `snr` is not above 0; [`Error::Linalg`] if the envelope is no covariance.
pub fn likelihood_tapers(model: &WindowModel, snr: f64) -> Result<Vec<Taper>, Error> {
    positive("snr", snr)?;
    let noise_to_signal =
        model.sampling.sample_rate_hz / (model.sampling.band_hz.1 - model.sampling.band_hz.0) / snr;
    let envelope = model.envelope().mapv(|value| value.re);
    let power = envelope.diag().mean().unwrap_or(1.0);
    let (values, vectors) = hermitian_eigen("envelope", envelope.view())?;
    let weights = values.mapv(|value| (value / (value + noise_to_signal * power)).max(0.0));
    let largest = weights[weights.len() - 1];
    let mut tapers = Vec::new();
    let mut sum = 0.0;
    for (k, &weight) in weights.iter().enumerate().rev() {
        if weight > LEAST_WEIGHT * largest {
            sum += weight;
            tapers.push(Taper {
                weights: vectors.column(k).to_vec(),
                factor: weight,
            });
        }
    }
    positive("sum of the weights of the tapers", sum)?;
    for taper in &mut tapers {
        taper.factor /= sum;
    }
    Ok(tapers)
}
