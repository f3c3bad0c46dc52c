//! Tops of the likelihood that fits come to from different starts.

use ndarray::Array2;

use crate::vortex_fit::{PARAMETERS, Wake};

/// Those that are not the same as one before them.
pub(crate) fn distinct<T>(
    all: impl IntoIterator<Item = T>,
    same: impl Fn(&T, &T) -> bool,
) -> Vec<T> {
    let mut kept: Vec<T> = Vec::new();
    for one in all {
        if !kept.iter().any(|before| same(before, &one)) {
            kept.push(one);
        }
    }
    kept
}

/// Covariance \[10, 10\] about a wake of tops with their weights: what is known within each of them, and the distances between them in all parameters
/// that were fitted.
pub(crate) fn mixed<'t>(
    tops: impl Iterator<Item = (f64, &'t Wake, &'t Array2<f64>)>,
    about: &Wake,
) -> Array2<f64> {
    let about = about.to_array();
    let mut mixed = Array2::zeros((PARAMETERS, PARAMETERS));
    let mut weights = 0.0;
    for (weight, wake, within) in tops {
        let mut distance = wake.to_array();
        for i in 0..PARAMETERS {
            distance[i] = if within[[i, i]] > 0.0 {
                distance[i] - about[i]
            } else {
                0.0
            };
        }
        for ((i, j), c) in mixed.indexed_iter_mut() {
            *c += weight * (within[[i, j]] + distance[i] * distance[j]);
        }
        weights += weight;
    }
    mixed / weights
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
