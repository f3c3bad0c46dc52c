//! The Gaussian pulse: its envelope (7), its energy and the weight that it gives to each range, (28), corrected.
//!
//! Check: `|f|^2` integrates to 1 over time, falls to one half at half the full width at half maximum, and the range
//! weight integrates to 1 over range.

use std::f64::consts::PI;

use crate::Error;
use crate::SPEED_OF_LIGHT_M_S;
use crate::error::check_positive;

/// The two usual meanings of "pulse duration", both of the power `|f|^2`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PulseDuration {
    /// Full width at half maximum \[s\]: `2 sqrt(ln 2) sigma` = 1.665 `sigma`.
    FullWidthHalfMaximum(f64),
    /// Half the width between the points at 1/e \[s\]: `sigma` itself.
    OneOverEHalfWidth(f64),
}

impl PulseDuration {
    /// The 1/e half-width of the power, `sigma` of (7) \[s\].
    pub fn sigma_s(self) -> f64 {
        match self {
            Self::FullWidthHalfMaximum(width_s) => width_s / (2.0 * 2.0_f64.ln().sqrt()),
            Self::OneOverEHalfWidth(half_width_s) => half_width_s,
        }
    }
}

/// A transmitted pulse with the Gaussian envelope (7).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaussianPulse {
    sigma_s: f64,
    energy_j: f64,
}

impl GaussianPulse {
    /// Table 2's 150 uJ in 200 ns (full width at half maximum), the shorter of the chapter's two pulses.
    pub fn table2() -> Self {
        Self { sigma_s: PulseDuration::FullWidthHalfMaximum(200e-9).sigma_s(), energy_j: 150e-6 }
    }

    /// A pulse of the given duration and energy.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the duration or the energy is not finite and positive.
    pub fn new(duration: PulseDuration, energy_j: f64) -> Result<Self, Error> {
        check_positive("pulse duration_s", duration.sigma_s())?;
        check_positive("energy_j", energy_j)?;
        Ok(Self { sigma_s: duration.sigma_s(), energy_j })
    }

    /// The 1/e half-width of the power, `sigma` \[s\].
    pub fn sigma_s(&self) -> f64 {
        self.sigma_s
    }

    /// Full width at half maximum of the power \[s\].
    pub fn full_width_half_maximum_s(&self) -> f64 {
        2.0 * 2.0_f64.ln().sqrt() * self.sigma_s
    }

    /// Energy of the pulse, `E_t` \[J\].
    pub fn energy_j(&self) -> f64 {
        self.energy_j
    }

    /// Length scale of the pulse in range, `c sigma/2` \[m\].
    pub fn sigma_m(&self) -> f64 {
        0.5 * SPEED_OF_LIGHT_M_S * self.sigma_s
    }

    /// Envelope `f(t) = pi^(-1/4) sigma^(-1/2) exp(-t^2/(2 sigma^2))`, (7) \[s^-1/2\].
    pub fn envelope_per_sqrt_s(&self, time_s: f64) -> f64 {
        let ratio = time_s / self.sigma_s;
        (-0.5 * ratio * ratio).exp() / (PI.sqrt() * self.sigma_s).sqrt()
    }

    /// Power `|f(t)|^2` for unit energy \[1/s\]; integrates to 1 over time, (8).
    pub fn intensity_per_s(&self, time_s: f64) -> f64 {
        let ratio = time_s / self.sigma_s;
        (-ratio * ratio).exp() / (PI.sqrt() * self.sigma_s)
    }

    /// Weight of the air at `offset_m` from the range in question, `|f(2 offset/c)|^2 2/c` \[1/m\]: (28), corrected by
    /// the Jacobian `2/c`, so that it integrates to 1 over range.
    pub fn range_weight_per_m(&self, offset_m: f64) -> f64 {
        let per_range = 2.0 / SPEED_OF_LIGHT_M_S;
        self.intensity_per_s(offset_m * per_range) * per_range
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn pulse() -> GaussianPulse {
        GaussianPulse::table2()
    }

    #[test]
    fn power_is_half_its_peak_at_half_the_full_width() {
        let half = pulse().intensity_per_s(100e-9) / pulse().intensity_per_s(0.0);
        assert_relative_eq!(half, 0.5, max_relative = 1e-14);
        assert_relative_eq!(pulse().sigma_s(), 120.112_241e-9, max_relative = 1e-8);
        assert_relative_eq!(pulse().full_width_half_maximum_s(), 200e-9, max_relative = 1e-15);
    }

    #[test]
    fn power_is_one_over_e_at_the_stated_half_width() {
        let pulse = GaussianPulse::new(PulseDuration::OneOverEHalfWidth(80e-9), 1.0).unwrap();
        let ratio = pulse.intensity_per_s(-80e-9) / pulse.intensity_per_s(0.0);
        assert_relative_eq!(ratio, (-1.0_f64).exp(), max_relative = 1e-14);
    }

    #[test]
    fn power_integrates_to_one_and_is_the_square_of_the_envelope() {
        let (pulse, step_s) = (pulse(), 10e-9);
        let times = (-200..=200).map(|i| f64::from(i) * step_s);
        let sum: f64 = times.clone().map(|t| pulse.intensity_per_s(t) * step_s).sum();
        assert_relative_eq!(sum, 1.0, max_relative = 1e-13);
        for t in times.filter(|t| t.abs() < 1e-6) {
            let squared = pulse.envelope_per_sqrt_s(t).powi(2);
            assert_relative_eq!(squared, pulse.intensity_per_s(t), max_relative = 1e-12);
        }
    }

    #[test]
    fn range_weight_integrates_to_one_and_its_half_width_is_half_the_pulse_length() {
        let (pulse, step_m) = (pulse(), 1.5);
        let sum: f64 = (-200..=200).map(|i| pulse.range_weight_per_m(f64::from(i) * step_m) * step_m).sum();
        assert_relative_eq!(sum, 1.0, max_relative = 1e-13);
        let half_power_m = 0.5 * SPEED_OF_LIGHT_M_S * 100e-9;
        let ratio = pulse.range_weight_per_m(half_power_m) / pulse.range_weight_per_m(0.0);
        assert_relative_eq!(ratio, 0.5, max_relative = 1e-13);
    }

    #[test]
    fn durations_and_energies_that_are_not_positive_are_refused() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let duration = GaussianPulse::new(PulseDuration::FullWidthHalfMaximum(bad), 1.0);
            assert!(matches!(duration, Err(Error::OutOfRange { field: "pulse duration_s", .. })));
            let energy = GaussianPulse::new(PulseDuration::OneOverEHalfWidth(1e-7), bad);
            assert!(matches!(energy, Err(Error::OutOfRange { field: "energy_j", .. })));
        }
    }
}
