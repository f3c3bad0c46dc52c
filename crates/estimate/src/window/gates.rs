//! Sliding windows of a record and the ranges of their centres.
//!
//! Computes R = c (t_p + N T_s / 2) / 2 for a window that starts at t_p after the centre of the pulse
//! has left. Check: the centre lies half a gate, 19.2 m for 64 samples at 250 MHz, beyond the start.

use std::ops::Range;

use crate::error::{Error, at_least_one, finite};
use crate::window::{SPEED_OF_LIGHT_M_S, Sampling};

/// Windows of `window_samples` samples, `step_samples` apart, in every record of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gates {
    /// Samples N of one window.
    pub window_samples: usize,
    /// Samples between the starts of neighbouring windows.
    pub step_samples: usize,
    /// Time of the first sample of a record after the pulse centre has left the lidar \[s\].
    pub first_sample_time_s: f64,
}

impl Gates {
    /// Checked gates.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if window or step is 0 or the time is not finite.
    pub fn new(
        window_samples: usize,
        step_samples: usize,
        first_sample_time_s: f64,
    ) -> Result<Self, Error> {
        let gates = Self {
            window_samples,
            step_samples,
            first_sample_time_s,
        };
        gates.validate()?;
        Ok(gates)
    }

    /// Checks that window and step have at least one sample and the time is finite.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the field at fault.
    pub fn validate(&self) -> Result<(), Error> {
        at_least_one("window_samples", self.window_samples)?;
        at_least_one("step_samples", self.step_samples)?;
        finite("first_sample_time_s", self.first_sample_time_s)
    }

    /// Number of whole windows in a record of `record_samples` samples, at least 1.
    ///
    /// # Errors
    /// [`Error::WindowLongerThanRecord`] when not a single window fits.
    pub fn count(&self, record_samples: usize) -> Result<usize, Error> {
        self.validate()?;
        if self.window_samples > record_samples {
            return Err(Error::WindowLongerThanRecord {
                window_samples: self.window_samples,
                record_samples,
            });
        }
        Ok((record_samples - self.window_samples) / self.step_samples + 1)
    }

    /// The samples of some windows, which are at least one.
    #[must_use]
    pub fn samples(&self, gates: &Range<usize>) -> Range<usize> {
        let last = gates.end.saturating_sub(1).max(gates.start);
        gates.start * self.step_samples..last * self.step_samples + self.window_samples
    }

    /// Range of the centre of window `gate` \[m\].
    #[must_use]
    pub fn range_m(&self, gate: usize, sampling: &Sampling) -> f64 {
        let centre_samples = (gate * self.step_samples) as f64 + 0.5 * self.window_samples as f64;
        let time_s = self.first_sample_time_s + centre_samples * sampling.period_s();
        0.5 * SPEED_OF_LIGHT_M_S * time_s
    }

    /// Ranges of the centres of all windows of a record \[m\].
    ///
    /// # Errors
    /// As [`Gates::count`].
    pub fn ranges_m(&self, record_samples: usize, sampling: &Sampling) -> Result<Vec<f64>, Error> {
        let count = self.count(record_samples)?;
        Ok((0..count)
            .map(|gate| self.range_m(gate, sampling))
            .collect())
    }

    /// Distance between neighbouring window centres \[m\].
    #[must_use]
    pub fn spacing_m(&self, sampling: &Sampling) -> f64 {
        0.5 * SPEED_OF_LIGHT_M_S * self.step_samples as f64 * sampling.period_s()
    }

    /// Length of one range gate, c N T_s / 2 \[m\].
    #[must_use]
    pub fn length_m(&self, sampling: &Sampling) -> f64 {
        0.5 * SPEED_OF_LIGHT_M_S * self.window_samples as f64 * sampling.period_s()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn sampling() -> Sampling {
        Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap()
    }

    #[test]
    fn range_is_that_of_the_window_centre() {
        let start_s = 2e-6;
        let gates = Gates::new(64, 1, start_s).unwrap();
        let start_m = 0.5 * SPEED_OF_LIGHT_M_S * start_s;
        assert_relative_eq!(
            gates.range_m(0, &sampling()) - start_m,
            19.186_717_3,
            max_relative = 1e-8
        );
        assert_relative_eq!(
            gates.length_m(&sampling()),
            38.373_434_6,
            max_relative = 1e-8
        );
        let ranges_m = gates.ranges_m(100, &sampling()).unwrap();
        assert_eq!(ranges_m.len(), 37);
        assert_relative_eq!(
            ranges_m[1] - ranges_m[0],
            0.599_584_916,
            max_relative = 1e-8
        );
        assert_relative_eq!(
            gates.spacing_m(&sampling()),
            0.599_584_916,
            max_relative = 1e-8
        );
    }

    #[test]
    fn step_leaves_out_the_incomplete_last_window() {
        let gates = Gates::new(64, 16, 0.0).unwrap();
        assert_eq!(gates.count(64).unwrap(), 1);
        assert_eq!(gates.count(79).unwrap(), 1);
        assert_eq!(gates.count(80).unwrap(), 2);
    }

    #[test]
    fn window_longer_than_the_record_names_both_lengths() {
        let error = Gates::new(64, 1, 0.0).unwrap().count(50).unwrap_err();
        assert_eq!(
            error,
            Error::WindowLongerThanRecord {
                window_samples: 64,
                record_samples: 50
            }
        );
        let text = error.to_string();
        assert!(text.contains("64") && text.contains("50"));
    }

    #[test]
    fn empty_windows_and_steps_are_refused() {
        assert!(Gates::new(0, 1, 0.0).is_err());
        assert!(Gates::new(64, 0, 0.0).is_err());
        assert!(Gates::new(64, 1, f64::NAN).is_err());
    }
}
