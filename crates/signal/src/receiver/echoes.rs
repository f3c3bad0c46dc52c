//! Unwanted echoes: the reflex of the telescope, and the echo of the previous pulse.
//!
//! Check: the stored tables of the reflex and of the second trip.

use super::Receiver;
use crate::{Pulse, SPEED_OF_LIGHT_M_S};

impl Receiver {
    /// Signal-to-noise ratio of the pulse that the telescope reflects, at `time_s` after its middle
    /// has left: `eta_Q rho E |f(t)|^2/(h nu B)` at the shot-noise limit.
    pub fn reflex_snr(&self, pulse: &Pulse, time_s: f64) -> f64 {
        self.heterodyne_gain_a2_w()
            * pulse.energy_j()
            * self.front_end.reflection
            * pulse.intensity_per_s(time_s)
            / self.snr_noise_a2()
    }

    /// Time after which the reflex stays below a signal-to-noise ratio \[s\]; 0 if it
    /// never reaches it.
    pub fn blind_time_s(&self, pulse: &Pulse, limit_snr: f64) -> f64 {
        /// Steps in which the tail of a sampled pulse is searched.
        const STEPS: u32 = 4096;
        if let Some(sigma_s) = pulse.gaussian_sigma_s() {
            let peak = self.reflex_snr(pulse, 0.0);
            return sigma_s * (peak / limit_snr).ln().max(0.0).sqrt();
        }
        let (first_s, last_s) = pulse.support_s();
        for i in 0..=STEPS {
            let time_s = last_s - (last_s - first_s) * f64::from(i) / f64::from(STEPS);
            if self.reflex_snr(pulse, time_s) >= limit_snr {
                return time_s.max(0.0);
            }
        }
        0.0
    }
}

/// Range up to which an echo is that of the last pulse, `c/(2 PRF)` \[m\].
pub fn ambiguous_range_m(pulse_repetition_hz: f64) -> f64 {
    0.5 * SPEED_OF_LIGHT_M_S / pulse_repetition_hz
}
