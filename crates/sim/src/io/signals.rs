//! Raw signals at the border to files.
//! Check: signals whose lengths do not match are refused.

use super::checks::{increasing, same_length};
use crate::Error;
use ndarray::ArrayView2;

/// The signals of a scan, pulse by pulse, one realisation after the other; the large arrays are borrowed.
#[derive(Debug, Clone, PartialEq)]
pub struct RawSignals<'a> {
    /// Sampling frequency, Hz.
    pub sampling_hz: f64,
    /// Frequency of air at rest in the records, Hz: 0 for baseband signals.
    pub intermediate_frequency_hz: f64,
    /// Width of the detector band about that frequency, Hz.
    pub bandwidth_hz: f64,
    /// Wavelength, m.
    pub wavelength_m: f64,
    /// Pulse repetition frequency, Hz.
    pub pulse_repetition_hz: f64,
    /// Half width of the pulse's power where it is 1/e of its largest, or that of the Gaussian with the same spread, s.
    pub pulse_sigma_s: f64,
    /// Mean square of the noise of a sample, of both quadratures together, A^2.
    pub noise_power_a2: f64,
    /// Ranges of the air along the lines of sight, which an estimate is to be held against, m, increasing.
    pub range_m: Vec<f64>,
    /// Radial velocity of that air `[line, range]`, m/s, positive away from the lidar; NaN where nothing returns light.
    pub radial_velocity_m_s: ArrayView2<'a, f64>,
    /// Time of each pulse of one realisation from the start of the flow, s.
    pub pulse_time_s: Vec<f64>,
    /// Current of the detector `[pulse, sample]`, A.
    pub current_a: ArrayView2<'a, f64>,
    /// Second quadrature of a complex baseband signal, whose first is `current_a`.
    pub quadrature_a: Option<ArrayView2<'a, f64>>,
    /// Elevation of each pulse of one realisation, rad.
    pub elevation_rad: Vec<f64>,
    /// Azimuth of each of them, rad; empty for a scan in one plane.
    pub azimuth_rad: Vec<f64>,
    /// Time of each sample after the middle of the pulse left, s; increasing.
    pub time_s: Vec<f64>,
    /// First pulse of each line of sight in one realisation; the pulses of a line follow each other.
    pub first_pulse: Vec<usize>,
}

impl RawSignals<'_> {
    /// Checks the shapes.
    ///
    /// # Errors
    /// Lengths that do not match, times that do not increase, values that are not finite.
    pub fn check(&self) -> Result<(), Error> {
        increasing("time_s", &self.time_s)?;
        let (records, samples) = self.current_a.dim();
        let times = self.time_s.len();
        same_length("current_a", samples, "time_s", times)?;
        let pulses = self.elevation_rad.len();
        let expected = pulses * self.realisations();
        same_length("current_a", records, "elevation_rad", expected)?;
        let pulse_times = self.pulse_time_s.len();
        same_length("pulse_time_s", pulse_times, "elevation_rad", pulses)?;
        let azimuths = self.azimuth_rad.len();
        if azimuths > 0 {
            same_length("azimuth_rad", azimuths, "elevation_rad", pulses)?;
        }
        if let Some(quadrature) = &self.quadrature_a {
            same_length("quadrature_a", quadrature.nrows(), "current_a", records)?;
            same_length("quadrature_a", quadrature.ncols(), "time_s", times)?;
        }
        increasing("range_m", &self.range_m)?;
        let (lines, ranges) = self.radial_velocity_m_s.dim();
        same_length("radial_velocity_m_s", ranges, "range_m", self.range_m.len())?;
        let expected = self.first_pulse.len();
        same_length("radial_velocity_m_s", lines, "the lines", expected)?;
        let mut values = self
            .current_a
            .iter()
            .chain(self.quadrature_a.iter().flatten());
        match values.find(|a| !a.is_finite()) {
            Some(bad) => Err(Error::value("current_a", bad, "must be finite")),
            None => Ok(()),
        }
    }

    /// Realisations of the scan, one after the other.
    pub fn realisations(&self) -> usize {
        self.current_a.nrows() / self.elevation_rad.len().max(1)
    }
}

/// Two realisations of two lines of two pulses.
#[cfg(test)]
pub(crate) fn example() -> RawSignals<'static> {
    const CURRENT_A: [[f64; 3]; 8] = [
        [0.0, 1.0, 2.0],
        [10.0, 11.0, 12.0],
        [20.0, 21.0, 22.0],
        [30.0, 31.0, 32.0],
        [40.0, 41.0, 42.0],
        [50.0, 51.0, 52.0],
        [60.0, 61.0, 62.0],
        [70.0, 71.0, 72.0],
    ];
    RawSignals {
        sampling_hz: 1e6,
        intermediate_frequency_hz: 8e5,
        bandwidth_hz: 5e5,
        wavelength_m: 1.5e-6,
        pulse_repetition_hz: 400.0,
        pulse_sigma_s: 1.2e-7,
        noise_power_a2: 3e-13,
        range_m: vec![100.0, 130.0],
        radial_velocity_m_s: ndarray::aview2(&[[1.5, -2.5], [f64::NAN, 0.5]]),
        pulse_time_s: vec![8.0, 8.0025, 8.005, 8.0075],
        current_a: ndarray::aview2(&CURRENT_A),
        quadrature_a: None,
        elevation_rad: vec![0.0, 0.0, 0.1, 0.1],
        time_s: vec![1e-6, 2e-6, 3e-6],
        azimuth_rad: Vec::new(),
        first_pulse: vec![0, 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_that_do_not_match_are_refused() {
        let signals = example();
        signals.check().unwrap();
        assert_eq!(signals.realisations(), 2);
        assert!(
            RawSignals {
                time_s: vec![1.0],
                ..signals.clone()
            }
            .check()
            .is_err()
        );
        assert!(
            RawSignals {
                pulse_time_s: vec![1.0],
                ..signals.clone()
            }
            .check()
            .is_err()
        );
        let odd = signals.current_a.slice_move(ndarray::s![..7, ..]);
        assert!(
            RawSignals {
                current_a: odd,
                ..signals
            }
            .check()
            .is_err(),
            "half a realisation"
        );
    }
}
