//! Losses of a real receiver against the shot-noise limit: densities of its noises, saturation and
//! response of its detector.
//!
//! All noises are Gaussian and flat in the band, so that their densities add. Check: the stored
//! tables of densities, saturation and band response; nothing changes, to the bit, where
//! everything is off.

use super::{FrontEnd, Receiver};
use crate::constants::{BOLTZMANN_J_K, ELEMENTARY_CHARGE_C};

/// One-sided densities of the noises of a receiver \[A^2/Hz\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseDensities {
    /// `2 e I`, `I` the current that the local oscillator gives.
    pub shot_a2_hz: f64,
    /// `i_n^2 + 4 k T/R`.
    pub amplifier_a2_hz: f64,
    /// `2 e I_d`.
    pub dark_a2_hz: f64,
    /// `(P dI/dP)^2` times the relative intensity noise after the common-mode rejection.
    pub intensity_a2_hz: f64,
    /// `|H|^2` at the intermediate frequency: what the detector lets through of all but
    /// the amplifier's.
    pub response: f64,
}

impl NoiseDensities {
    /// All of them behind the detector \[A^2/Hz\].
    pub fn total_a2_hz(&self) -> f64 {
        self.response * (self.shot_a2_hz + self.dark_a2_hz + self.intensity_a2_hz)
            + self.amplifier_a2_hz
    }
}

/// Differences between the shot-noise limit and the signal-to-noise ratio of a receiver \[dB\],
/// each in addition to those before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Penalties {
    /// Of the detector's saturation at the shot-noise limit, `30 log(1 + P/P_s)`.
    pub saturation_db: f64,
    /// Of the amplifier and its load.
    pub amplifier_db: f64,
    /// Of the dark current.
    pub dark_db: f64,
    /// Of the intensity noise.
    pub intensity_db: f64,
    /// Of the detector's poles, which act on all but the amplifier's noise.
    pub response_db: f64,
    /// Of the converter's rounding.
    pub rounding_db: f64,
    /// Of its clipping.
    pub clipping_db: f64,
}

impl Penalties {
    /// Their sum \[dB\].
    pub fn total_db(&self) -> f64 {
        let before = self.saturation_db
            + self.amplifier_db
            + self.dark_db
            + self.intensity_db
            + self.response_db;
        before + self.rounding_db + self.clipping_db
    }
}

fn decibels(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

impl Receiver {
    /// Factor by which saturation reduces the current of the local oscillator, `1 + P_LO/P_s`.
    fn drive(&self) -> f64 {
        1.0 + self.local_oscillator_w / self.front_end.saturation_w
    }

    /// Power gain of the beat against an unsaturated and fast detector: `|H(f_c)|^2 (dI/dP / S)^2`.
    pub(super) fn beat_gain(&self) -> f64 {
        self.front_end
            .power_response_at(self.intermediate_frequency_hz)
            / self.drive().powi(4)
    }

    /// The densities of its noises.
    pub fn noise_densities(&self) -> NoiseDensities {
        let front = &self.front_end;
        let shot = 2.0 * ELEMENTARY_CHARGE_C * self.responsivity_a_w() * self.local_oscillator_w;
        let thermal = 4.0 * BOLTZMANN_J_K * front.load_temperature_k / front.load_ohm;
        let current_a = self.responsivity_a_w() * self.local_oscillator_w;
        let intensity = 10f64.powf(0.1 * (front.intensity_noise_db_hz - front.rejection_db));
        NoiseDensities {
            shot_a2_hz: shot / self.drive(),
            amplifier_a2_hz: front.amplifier_noise_a_rthz.powi(2) + thermal,
            dark_a2_hz: 2.0 * ELEMENTARY_CHARGE_C * front.dark_current_a,
            intensity_a2_hz: current_a * current_a * intensity / self.drive().powi(4),
            response: front.power_response_at(self.intermediate_frequency_hz),
        }
    }

    /// Its losses against the shot-noise limit.
    pub fn penalties(&self) -> Penalties {
        let NoiseDensities {
            shot_a2_hz,
            amplifier_a2_hz,
            dark_a2_hz,
            intensity_a2_hz,
            response,
        } = self.noise_densities();
        let FrontEnd {
            rounding_noise,
            clipping_noise,
            ..
        } = self.front_end;
        let amplified = shot_a2_hz + amplifier_a2_hz;
        let dark = amplified + dark_a2_hz;
        let all = dark + intensity_a2_hz;
        let slow = all - amplifier_a2_hz + amplifier_a2_hz / response;
        Penalties {
            saturation_db: 3.0 * decibels(self.drive()),
            amplifier_db: decibels(amplified / shot_a2_hz),
            dark_db: decibels(dark / amplified),
            intensity_db: decibels(all / dark),
            response_db: decibels(slow / all),
            rounding_db: decibels(1.0 + rounding_noise),
            clipping_db: decibels((1.0 + rounding_noise + clipping_noise) / (1.0 + rounding_noise)),
        }
    }

    /// Power of the local oscillator at which its shot noise equals the amplifier's \[W\]; `inf` where saturation keeps it below at any
    /// power.
    pub fn amplifier_equals_shot_w(&self) -> f64 {
        let per_watt = self.with_unsaturated_watt().noise_densities();
        let unsaturated_w = per_watt.amplifier_a2_hz / per_watt.shot_a2_hz;
        let saturation_w = self.front_end.saturation_w;
        if unsaturated_w < saturation_w {
            // Of P/(1 + P/P_s) = unsaturated_w.
            unsaturated_w / (1.0 - unsaturated_w / saturation_w)
        } else {
            f64::INFINITY
        }
    }

    /// Lowest power of the local oscillator at which its intensity noise equals its shot noise \[W\]; `inf` where it stays below at
    /// any power, as without intensity noise.
    pub fn intensity_equals_shot_w(&self) -> f64 {
        let per_watt = self.with_unsaturated_watt().noise_densities();
        let unsaturated_w = per_watt.shot_a2_hz / per_watt.intensity_a2_hz;
        let saturation_w = self.front_end.saturation_w;
        if saturation_w.is_infinite() {
            return unsaturated_w;
        }
        // P/(1 + P/P_s)^3 rises to its largest value at P_s/2 and falls beyond.
        let reached = |power_w: f64| power_w / (1.0 + power_w / saturation_w).powi(3);
        let mut high_w = 0.5 * saturation_w;
        if unsaturated_w > reached(high_w) {
            return f64::INFINITY;
        }
        let mut low_w = 0.0;
        // Each step halves the interval; after these it is one number wide.
        for _ in 0..200 {
            let middle_w = 0.5 * (low_w + high_w);
            if reached(middle_w) < unsaturated_w {
                low_w = middle_w
            } else {
                high_w = middle_w
            }
        }
        high_w
    }

    /// The same receiver with a local oscillator of 1 W that saturates nothing.
    fn with_unsaturated_watt(&self) -> Self {
        Self {
            local_oscillator_w: 1.0,
            front_end: FrontEnd {
                saturation_w: f64::INFINITY,
                ..self.front_end
            },
            ..*self
        }
    }

    /// Power of the local oscillator that gives the best signal-to-noise ratio \[W\]: 0 if there is
    /// only shot noise, `inf` if nothing limits it.
    ///
    /// For amplifier noise and saturation `P_s (sqrt(4 A^2 + 3 A) - A)/(3 (1 + A))`,
    /// `A = i_n^2/(2 e S P_s)`.
    pub fn best_local_oscillator_w(&self) -> f64 {
        let NoiseDensities {
            shot_a2_hz,
            amplifier_a2_hz,
            dark_a2_hz,
            intensity_a2_hz,
            response,
        } = self.with_unsaturated_watt().noise_densities();
        let constant = amplifier_a2_hz / response + dark_a2_hz;
        if constant == 0.0 {
            return 0.0;
        }
        let saturation_w = self.front_end.saturation_w;
        // Slope of noise over signal, s (1 + x)^3 + constant (1 + x)^4/P + intensity P, in the
        // logarithm of the power P.
        let slope = |power_w: f64| {
            let x = power_w / saturation_w;
            3.0 * x * (1.0 + x).powi(2) * shot_a2_hz
                + (3.0 * x - 1.0) * (1.0 + x).powi(3) * constant / power_w
                + intensity_a2_hz * power_w
        };
        let mut low_w = 0.0;
        let mut high_w = (saturation_w / 3.0).min((constant / intensity_a2_hz).sqrt());
        if high_w.is_infinite() {
            return f64::INFINITY;
        }
        // Each step halves the interval; after these it is one number wide.
        for _ in 0..200 {
            let middle_w = 0.5 * (low_w + high_w);
            if slope(middle_w) < 0.0 {
                low_w = middle_w
            } else {
                high_w = middle_w
            }
        }
        high_w
    }
}
