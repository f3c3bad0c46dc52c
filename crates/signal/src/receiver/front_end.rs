//! Properties of a real receiver beyond the shot-noise limit: amplifier and dark current, intensity
//! noise of the laser, a detector that saturates and one that is slow, a converter, a laser of
//! finite linewidth, a telescope that reflects.
//!
//! Check: impossible values are refused by name.

use crate::Error;
use crate::error::check;

/// Properties of a receiver beyond (12)-(14). [`FrontEnd::IDEAL`] has none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrontEnd {
    /// Current noise of the amplifier, `i_n` \[A/sqrt(Hz)\]; 0 for none.
    pub amplifier_noise_a_rthz: f64,
    /// Resistor whose thermal noise `4 k T/R` enters the amplifier \[ohm\]; `inf` for none.
    pub load_ohm: f64,
    /// Its temperature \[K\].
    pub load_temperature_k: f64,
    /// Dark current of the detector, `I_d` \[A\].
    pub dark_current_a: f64,
    /// Relative intensity noise of the local oscillator \[dB/Hz\]; `-inf` for none.
    pub intensity_noise_db_hz: f64,
    /// Common-mode rejection of a balanced detector, electrical \[dB\]: 20 log of the
    /// ratio of currents.
    pub rejection_db: f64,
    /// Power `P_s` at which the current has fallen to half of `S P`, `I = S P/(1 + P/P_s)` \[W\];
    /// `inf` for none.
    pub saturation_w: f64,
    /// Number of poles `n` of the detector, a low pass of the Butterworth kind,
    /// `|H|^2 = 1/(1 + (f/f_3dB)^(2 n))`.
    pub poles: u32,
    /// Frequency `f_3dB` at which its power has fallen to half \[Hz\]; `inf` for a detector that is
    /// fast enough.
    pub half_power_hz: f64,
    /// Noise of the converter's rounding over the density of all noises before it,
    /// [`super::Converter::rounding`]. It counts in the signal-to-noise ratio alone: the samples
    /// have it from the converter itself.
    pub rounding_noise: f64,
    /// The same of its clipping, [`super::Converter::clipping_noise`].
    pub clipping_noise: f64,
    /// Factor of clipping on weak signals and on the copy of the noise, [`super::Clipping::gain`].
    pub clipping_gain: f64,
    /// Lorentzian full width at half maximum of the laser's line \[Hz\]; 0 for none.
    pub linewidth_hz: f64,
    /// Fraction of the pulse's power that the telescope reflects to the receiver,
    /// `rho`; 0 for none.
    pub reflection: f64,
}

impl FrontEnd {
    /// Only shot noise.
    pub const IDEAL: Self = Self {
        amplifier_noise_a_rthz: 0.0,
        load_ohm: f64::INFINITY,
        load_temperature_k: 290.0,
        dark_current_a: 0.0,
        intensity_noise_db_hz: f64::NEG_INFINITY,
        rejection_db: 0.0,
        saturation_w: f64::INFINITY,
        poles: 1,
        half_power_hz: f64::INFINITY,
        rounding_noise: 0.0,
        clipping_noise: 0.0,
        clipping_gain: 1.0,
        linewidth_hz: 0.0,
        reflection: 0.0,
    };

    /// `|H(f)|^2` of the detector.
    pub fn power_response_at(&self, frequency_hz: f64) -> f64 {
        1.0 / (1.0
            + (frequency_hz / self.half_power_hz)
                .powi(2)
                .powi(self.poles as i32))
    }

    pub(super) fn validate(&self) -> Result<(), Error> {
        let finite = [
            ("amplifier_noise_a_rthz", self.amplifier_noise_a_rthz),
            ("dark_current_a", self.dark_current_a),
            ("rejection_db", self.rejection_db),
            ("rounding_noise", self.rounding_noise),
            ("clipping_noise", self.clipping_noise),
            ("linewidth_hz", self.linewidth_hz),
            ("reflection", self.reflection),
        ];
        for (field, value) in finite {
            check(field, value, "finite and not negative", |v| v >= 0.0)?;
        }
        let above = [
            ("load_ohm", self.load_ohm),
            ("load_temperature_k", self.load_temperature_k),
            ("saturation_w", self.saturation_w),
            ("half_power_hz", self.half_power_hz),
            ("poles", f64::from(self.poles)),
            ("clipping_gain", self.clipping_gain),
        ];
        for (field, value) in above {
            if value.is_nan() || value <= 0.0 {
                return Err(Error::OutOfRange {
                    field,
                    value,
                    allowed: "above 0",
                });
            }
        }
        let value = self.intensity_noise_db_hz;
        if value.is_nan() || value > 0.0 {
            return Err(Error::OutOfRange {
                field: "intensity_noise_db_hz",
                value,
                allowed: "0 or less, or -inf",
            });
        }
        Ok(())
    }
}
