//! Weightings h of a window: rectangular, Hann, Gaussian.
//!
//! All are symmetric about the centre of the window, (N - 1)/2 samples after its first one.
//! Check: dividing a periodogram by the sum of h^2 makes white noise read its variance for each of them.

use crate::error::{Error, at_least_one, positive};

/// Weighting h(n T_s) of (29).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Weighting {
    /// h = 1.
    Rectangular,
    /// h = sin^2(pi (n + 1/2) / N): Hann, without the zeros at the ends.
    Hann,
    /// h = exp(-(n - (N-1)/2)^2 / (2 (w N)^2)) with w = `relative_half_width`.
    Gaussian {
        /// Half-width w of h^2 at 1/e, as a fraction of the window length.
        relative_half_width: f64,
    },
}

impl Default for Weighting {
    /// Gaussian with w = 1/4: h falls to 0.135 at the ends of the window.
    fn default() -> Self {
        Self::Gaussian {
            relative_half_width: 0.25,
        }
    }
}

impl Weighting {
    /// The weights of a window of `window_samples` samples.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an empty window or a Gaussian without positive width.
    pub fn weights(&self, window_samples: usize) -> Result<Vec<f64>, Error> {
        at_least_one("window_samples", window_samples)?;
        let length = window_samples as f64;
        let centre = 0.5 * (length - 1.0);
        let index = (0..window_samples).map(|n| n as f64);
        Ok(match *self {
            Self::Rectangular => vec![1.0; window_samples],
            Self::Hann => index
                .map(|n| (std::f64::consts::PI * (n + 0.5) / length).sin().powi(2))
                .collect(),
            Self::Gaussian {
                relative_half_width,
            } => {
                positive("relative_half_width", relative_half_width)?;
                index
                    .map(|n| (-0.5 * ((n - centre) / (relative_half_width * length)).powi(2)).exp())
                    .collect()
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn weightings_are_symmetric_and_reach_their_stated_ends() {
        for weighting in [
            Weighting::Rectangular,
            Weighting::Hann,
            Weighting::default(),
        ] {
            let h = weighting.weights(64).unwrap();
            for n in 0..64 {
                assert_relative_eq!(h[n], h[63 - n], max_relative = 1e-12);
            }
            assert!(h[31] > 0.999);
        }
        let gaussian = Weighting::default().weights(64).unwrap();
        assert_relative_eq!(
            gaussian[0],
            (-0.5_f64 * (31.5 / 16.0_f64).powi(2)).exp(),
            max_relative = 1e-14
        );
        // with 9 samples and w = 1/3, h^2 falls to 1/e exactly 3 samples from the centre
        let narrow = Weighting::Gaussian {
            relative_half_width: 1.0 / 3.0,
        }
        .weights(9)
        .unwrap();
        assert_relative_eq!(narrow[1].powi(2), (-1.0_f64).exp(), max_relative = 1e-12);
    }

    #[test]
    fn degenerate_weightings_are_refused() {
        assert!(Weighting::Hann.weights(0).is_err());
        let flat = Weighting::Gaussian {
            relative_half_width: 0.0,
        };
        assert!(flat.weights(8).is_err());
    }
}
