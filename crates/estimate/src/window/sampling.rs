//! How the samples relate to frequency and velocity: sampling rate, intermediate frequency, wavelength, detector band.
//!
//! Computes (30): a scatterer with radial velocity v, positive away from the lidar, beats at
//! f = f_c - 2 v / lambda. Check: the inverse returns the velocity, and a velocity beyond the
//! unambiguous interval reads as its folded alias (63 m/s reads 61.0 m/s at 250 MHz, 80 MHz, 1.55 um).

use crate::error::{Error, finite, positive};
use crate::window::SignalKind;

/// Speed of light in vacuum \[m/s\].
pub const SPEED_OF_LIGHT_M_S: f64 = 299_792_458.0;

/// Sampling of the heterodyne signal and the meaning of its frequencies.
///
/// Real windows have `intermediate_frequency_hz` f_c well above 0 (80 MHz) and a band inside (0, F_s/2);
/// complex baseband has f_c = 0 and a band that is symmetric about 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampling {
    /// Sampling rate F_s \[Hz\].
    pub sample_rate_hz: f64,
    /// Beat frequency f_c of a target at rest \[Hz\].
    pub intermediate_frequency_hz: f64,
    /// Laser wavelength lambda \[m\].
    pub wavelength_m: f64,
    /// Lower and upper edge of the detector band \[Hz\]; peaks are sought only here.
    pub band_hz: (f64, f64),
}

impl Sampling {
    /// A checked sampling.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] or [`Error::Band`], see [`Sampling::validate`].
    pub fn new(
        sample_rate_hz: f64,
        intermediate_frequency_hz: f64,
        wavelength_m: f64,
        band_hz: (f64, f64),
    ) -> Result<Self, Error> {
        let sampling = Self {
            sample_rate_hz,
            intermediate_frequency_hz,
            wavelength_m,
            band_hz,
        };
        sampling.validate()?;
        Ok(sampling)
    }

    /// Complex baseband (f_c = 0) with a band of full width `bandwidth_hz` about 0.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] or [`Error::Band`], see [`Sampling::validate`].
    pub fn baseband(
        sample_rate_hz: f64,
        wavelength_m: f64,
        bandwidth_hz: f64,
    ) -> Result<Self, Error> {
        let half_hz = 0.5 * bandwidth_hz;
        Self::new(sample_rate_hz, 0.0, wavelength_m, (-half_hz, half_hz))
    }

    /// Checks that rate and wavelength are positive and the band lies within -F_s/2 .. F_s/2.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a number, [`Error::Band`] for the band.
    pub fn validate(&self) -> Result<(), Error> {
        positive("sample_rate_hz", self.sample_rate_hz)?;
        positive("wavelength_m", self.wavelength_m)?;
        finite("intermediate_frequency_hz", self.intermediate_frequency_hz)?;
        let (low_hz, high_hz) = self.band_hz;
        let half_hz = 0.5 * self.sample_rate_hz;
        if low_hz < high_hz && low_hz >= -half_hz && high_hz <= half_hz {
            Ok(())
        } else {
            Err(Error::Band {
                low_hz,
                high_hz,
                allowed: "increasing and within half the sampling rate of 0 Hz",
            })
        }
    }

    /// Checks the band against the kind of samples: real samples have no negative frequencies.
    pub(crate) fn validate_for(&self, kind: SignalKind) -> Result<(), Error> {
        self.validate()?;
        let (low_hz, high_hz) = self.band_hz;
        if kind == SignalKind::Real && low_hz < 0.0 {
            return Err(Error::Band {
                low_hz,
                high_hz,
                allowed: "at or above 0 Hz for real samples",
            });
        }
        Ok(())
    }

    /// Sampling period T_s \[s\].
    #[must_use]
    pub fn period_s(&self) -> f64 {
        1.0 / self.sample_rate_hz
    }

    /// Derivative of the phase from sample to sample with respect to velocity \[rad per m/s\].
    pub(crate) fn phase_slope(&self) -> f64 {
        -4.0 * std::f64::consts::PI * self.period_s() / self.wavelength_m
    }

    /// Radial velocity \[m/s\], positive away from the lidar, of a beat frequency \[Hz\]: (30).
    #[must_use]
    pub fn velocity_m_s(&self, frequency_hz: f64) -> f64 {
        0.5 * self.wavelength_m * (self.intermediate_frequency_hz - frequency_hz)
    }

    /// Beat frequency \[Hz\] of a radial velocity \[m/s\], before folding: inverse of (30).
    #[must_use]
    pub fn frequency_hz(&self, velocity_m_s: f64) -> f64 {
        self.intermediate_frequency_hz - 2.0 * velocity_m_s / self.wavelength_m
    }

    /// Lowest and highest velocity \[m/s\] inside the detector band.
    #[must_use]
    pub fn velocity_limits_m_s(&self) -> (f64, f64) {
        (
            self.velocity_m_s(self.band_hz.1),
            self.velocity_m_s(self.band_hz.0),
        )
    }

    /// Frequency \[Hz\] at which a true frequency \[Hz\] appears after sampling.
    ///
    /// Complex samples fold into -F_s/2 .. F_s/2; real samples fold into 0 .. F_s/2.
    #[must_use]
    pub fn folded_frequency_hz(&self, frequency_hz: f64, kind: SignalKind) -> f64 {
        let turns = (frequency_hz / self.sample_rate_hz).round();
        let folded_hz = frequency_hz - turns * self.sample_rate_hz;
        match kind {
            SignalKind::Real => folded_hz.abs(),
            SignalKind::Complex => folded_hz,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Velocity that a true velocity reads after sampling, whatever the band.
    fn reads_m_s(sampling: &Sampling, velocity_m_s: f64, kind: SignalKind) -> f64 {
        let frequency_hz = sampling.frequency_hz(velocity_m_s);
        sampling.velocity_m_s(sampling.folded_frequency_hz(frequency_hz, kind))
    }

    fn table_2() -> Sampling {
        Sampling::new(250e6, 80e6, 1.55e-6, (55e6, 105e6)).unwrap()
    }

    #[test]
    fn motion_away_from_the_lidar_lowers_the_frequency() {
        let sampling = table_2();
        assert_relative_eq!(
            sampling.frequency_hz(1.0),
            80e6 - 2.0 / 1.55e-6,
            max_relative = 1e-15
        );
        assert_relative_eq!(
            sampling.velocity_m_s(sampling.frequency_hz(-3.7)),
            -3.7,
            max_relative = 1e-12
        );
    }

    #[test]
    fn detector_band_of_50_mhz_is_19_m_s_to_each_side() {
        let (low_m_s, high_m_s) = table_2().velocity_limits_m_s();
        assert_relative_eq!(low_m_s, -19.375, max_relative = 1e-12);
        assert_relative_eq!(high_m_s, 19.375, max_relative = 1e-12);
    }

    #[test]
    fn velocities_beyond_the_unambiguous_interval_fold() {
        let sampling = table_2();
        assert_relative_eq!(
            reads_m_s(&sampling, 63.0, SignalKind::Real),
            61.0,
            max_relative = 1e-12
        );
        assert_relative_eq!(
            reads_m_s(&sampling, 100.0, SignalKind::Real),
            24.0,
            max_relative = 1e-12
        );
        assert_relative_eq!(
            reads_m_s(&sampling, -12.0, SignalKind::Real),
            -12.0,
            max_relative = 1e-12
        );
        let baseband = Sampling::baseband(250e6, 1.55e-6, 50e6).unwrap();
        // complex samples repeat after F_s lambda / 2 = 193.75 m/s
        assert_relative_eq!(
            reads_m_s(&baseband, 100.0, SignalKind::Complex),
            100.0 - 193.75,
            max_relative = 1e-12
        );
    }

    #[test]
    fn impossible_samplings_are_refused_with_the_field_name() {
        for (rate_hz, wavelength_m, band_hz, word) in [
            (0.0, 1.55e-6, (55e6, 105e6), "sample_rate_hz"),
            (250e6, f64::NAN, (55e6, 105e6), "wavelength_m"),
            (250e6, 1.55e-6, (105e6, 55e6), "band_hz"),
            (250e6, 1.55e-6, (55e6, 126e6), "band_hz"),
            (250e6, 1.55e-6, (f64::NAN, 126e6), "band_hz"),
        ] {
            let error = Sampling::new(rate_hz, 80e6, wavelength_m, band_hz).unwrap_err();
            assert!(error.to_string().contains(word), "{error}");
        }
        let baseband = Sampling::baseband(250e6, 1.55e-6, 50e6).unwrap();
        assert!(baseband.validate_for(SignalKind::Real).is_err());
    }
}
