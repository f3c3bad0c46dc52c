//! Tops of the likelihood that fits come to from different starts.

use crate::vortex_fit::Wake;

/// Tops closer than this many standard deviations are one.
pub(crate) const SAME_SIGMAS: f64 = 0.3;

/// Those that are not the same as one before them.
pub(crate) fn distinct<T>(all: impl IntoIterator<Item = T>, same: impl Fn(&T, &T) -> bool) -> Vec<T> {
    let mut kept: Vec<T> = Vec::new();
    for one in all {
        if !kept.iter().any(|before| same(before, &one)) {
            kept.push(one);
        }
    }
    kept
}

/// A top of the likelihood: an end of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Top {
    /// The wake there; of a scan at the reference time.
    pub wake: Wake,
    /// Its chi-square, which is -2 ln p but for a constant: twice the cost of the loss. In fits of our own maps and signals with what is known of
    /// the cores; velocities that say the same as their neighbours are counted once.
    pub chi2: f64,
}
