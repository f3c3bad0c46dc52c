//! The threshold for one cell of a spectrum against known noise.
//!
//! The periodogram of a circular Gaussian window is exponential in each cell. The mean over n independent windows is a gamma variable
//! (Marcum 1960), so that noise alone exceeds T times its own power with the probability P(T) = Q(n, n T), Q the upper incomplete gamma
//! function. Check: a stored table; draws.

use crate::error::{Error, positive, probability};
use crate::estimators::tails::gamma_tail;

/// Threshold over the power of the noise that the mean of `windows` independent windows of noise alone exceeds in a cell with
/// probability `false_alarm`; an effective number of windows will do.
///
/// # Errors
/// [`Error::OutOfRange`] unless `windows` is above 0 and `false_alarm` lies between 0 and 1.
pub fn cell_threshold(windows: f64, false_alarm: f64) -> Result<f64, Error> {
    positive("windows", windows)?;
    probability("false_alarm", false_alarm)?;
    // logarithms of the threshold
    let mut low = -700.0_f64;
    let mut high = 700.0_f64;
    while high - low > 1e-15 * high.abs().max(1.0) {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if gamma_tail(windows, windows * middle.exp()) > false_alarm {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok((0.5 * (low + high)).exp())
}
