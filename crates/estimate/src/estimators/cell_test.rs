//! Whether one cell of a spectrum holds a signal: false alarms and detections in closed form.
//!
//! The periodogram of a circular Gaussian window is exponential in each cell, with the mean 1 + S where the signal has S times
//! the power of the noise there. The mean over n independent windows is a gamma variable; over the mean of M cells of noise alone,
//! it follows Fisher's law (Marcum 1960; Finn and Johnson 1968):
//!
//! ```text
//! noise known        P(T) = Q(n, n T / (1 + S))                    Q the upper incomplete gamma function
//! noise from M cells P(T) = 1 - F(T / (1 + S); 2 n, 2 n M)
//! ```
//!
//! Check: stored tables; draws.

use crate::error::{Error, check, not_negative, positive, probability};
use crate::estimators::tails::{beta_below, gamma_tail};

/// Most cells of noise, over all windows, for which the beta law is accurate.
const MOST_REFERENCES: f64 = 1e4;

/// The test of one cell: its mean power over that of the noise against a threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellTest {
    /// Independent windows that are averaged; an effective number will do.
    windows: f64,
    /// Cells whose mean stands for the noise; none where the noise is known.
    reference_cells: Option<f64>,
}

impl CellTest {
    /// With noise that is known, and the mean over `windows` independent windows.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless `windows` is above 0.
    pub fn known_noise(windows: f64) -> Result<Self, Error> {
        positive("windows", windows)?;
        Ok(Self {
            windows,
            reference_cells: None,
        })
    }

    /// With the mean of `reference_cells` cells of the same windows for the noise, which keeps the rate of false alarms whatever
    /// the noise.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless both are above 0 and their product at most 10 000: with more cells the noise is known.
    pub fn against_cells(windows: f64, reference_cells: f64) -> Result<Self, Error> {
        positive("reference_cells", reference_cells)?;
        let (cells, allowed) = (
            windows * reference_cells,
            "at most 10000: with more cells the noise is known",
        );
        check(
            "windows times reference_cells",
            cells,
            allowed,
            cells.is_nan() || cells <= MOST_REFERENCES,
        )?;
        Ok(Self {
            reference_cells: Some(reference_cells),
            ..Self::known_noise(windows)?
        })
    }

    /// Probability that a cell with `snr` times the power of the noise (0: noise alone) exceeds `threshold` times the noise.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless `threshold` is above 0 and `snr` at least 0, both finite.
    pub fn probability(&self, threshold: f64, snr: f64) -> Result<f64, Error> {
        positive("threshold", threshold)?;
        not_negative("snr", snr)?;
        Ok(self.exceeds(threshold / (1.0 + snr)))
    }

    fn exceeds(&self, level: f64) -> f64 {
        match self.reference_cells {
            None => gamma_tail(self.windows, self.windows * level),
            Some(cells) => beta_below(self.windows * cells, self.windows, cells / (cells + level)),
        }
    }

    /// Threshold over the noise that noise alone exceeds with probability `false_alarm`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless `false_alarm` lies between 0 and 1.
    pub fn threshold(&self, false_alarm: f64) -> Result<f64, Error> {
        probability("false_alarm", false_alarm)?;
        let (mut low, mut high) = (-700.0_f64, 700.0_f64);
        while high - low > 1e-15 * high.abs().max(1.0) {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if self.exceeds(middle.exp()) > false_alarm {
                low = middle
            } else {
                high = middle
            }
        }
        Ok((0.5 * (low + high)).exp())
    }

    /// Power of the signal over that of the noise in the cell with which it is found with probability `detection`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless both probabilities lie between 0 and 1, the first below the second.
    pub fn needed_snr(&self, false_alarm: f64, detection: f64) -> Result<f64, Error> {
        probability("detection", detection)?;
        let snr = self.threshold(false_alarm)? / self.threshold(detection)? - 1.0;
        check("detection", detection, "above the false alarm", snr > 0.0)?;
        Ok(snr)
    }

    /// Probability that the best of `cells` independent cells of noise is a false alarm, each of which is one with `false_alarm`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless `false_alarm` lies between 0 and 1 and `cells` is above 0.
    pub fn best_of(cells: f64, false_alarm: f64) -> Result<f64, Error> {
        probability("false_alarm", false_alarm)?;
        positive("cells", cells)?;
        Ok(-(cells * (-false_alarm).ln_1p()).exp_m1())
    }
}
