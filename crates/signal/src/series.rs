//! Records of many pulses together.
//!
//! Check: a series holds the records that its streams give one by one.

use ndarray::Array2;
use rand::Rng;

use crate::{Error, LineOfSight, Scratch, Simulator};

/// Sampled currents of a number of pulses, with what is needed to read them.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeSeries {
    /// Sampling rate \[Hz\].
    pub sample_rate_hz: f64,
    /// Frequency of the return from air at rest \[Hz\].
    pub intermediate_frequency_hz: f64,
    /// Wavelength of the laser \[m\].
    pub wavelength_m: f64,
    /// Time of the first sample of each record after its pulse \[s\].
    pub time_of_first_sample_s: f64,
    /// Currents \[A\], one row per pulse, one column per sample.
    pub samples: Array2<f64>,
}

impl Simulator {
    /// One record per line of sight, in memory. `rng_of(pulse)` gives the random generator of each pulse, which makes the
    /// result independent of any order. To stream a long scan use [`Simulator::record_into`].
    ///
    /// # Errors
    /// As [`Simulator::record_into`].
    pub fn time_series<'a, R: Rng>(
        &self,
        lines: impl ExactSizeIterator<Item = &'a LineOfSight>,
        mut rng_of: impl FnMut(usize) -> R,
    ) -> Result<TimeSeries, Error> {
        let mut scratch = Scratch::default();
        let mut row_a = vec![0.0; self.record().samples];
        let mut samples = Array2::zeros((lines.len(), row_a.len()));
        for (pulse, (line, mut row)) in lines.zip(samples.rows_mut()).enumerate() {
            self.record_into(line, &mut rng_of(pulse), &mut scratch, &mut row_a)?;
            row.iter_mut().zip(&row_a).for_each(|(to, from)| *to = *from);
        }
        Ok(TimeSeries {
            sample_rate_hz: self.receiver().sample_rate_hz,
            intermediate_frequency_hz: self.receiver().intermediate_frequency_hz,
            wavelength_m: self.receiver().wavelength_m,
            time_of_first_sample_s: self.record().time_of_first_sample_s,
            samples,
        })
    }
}
