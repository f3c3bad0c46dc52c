//! What bounds an instrument beside its signal-to-noise ratio: power, ranges, velocities, phase noise, local oscillator, resolution.

use super::Budget;
use super::digits::si;
use crate::measure::ray_information::range_filter;
use crate::plan::Plan;
use crate::plan::described::sampled_velocities_m_s;
use crate::scene::Weighting;
use crate::{Error, SPEED_OF_LIGHT_M_S};
use wakescope_signal::RangeFilter;
use wakescope_signal::receiver::echoes::ambiguous_range_m;
use wakescope_signal::receiver::phase_noise::{mean_frequency_sd_m_s, peak_variance_factor};

/// Signal-to-noise ratio below which the telescope's reflex does no harm, -20 dB.
const HARMLESS_SNR: f64 = 0.01;

impl Budget {
    /// Adds the limits of a planned scene.
    ///
    /// # Errors
    /// What estimators and signals refuse; a checked scene gives none.
    pub(super) fn add_limits(&mut self, plan: &Plan) -> Result<(), Error> {
        let scene = plan.scene();
        let instrument = &plan.instrument;
        let receiver = &instrument.receiver;
        let pulse = &instrument.pulse;
        let mean_w = scene.pulse.energy_j * scene.laser.pulse_repetition_hz;
        let peak_w = instrument.peak_power_w();
        let power = format!("mean power {}, peak {}", si(mean_w, "W"), si(peak_w, "W"));
        self.limits
            .extend([("mean_power_w", mean_w), ("peak_power_w", peak_w)]);
        self.limit_lines.push(power);
        let apart_m = ambiguous_range_m(scene.laser.pulse_repetition_hz);
        let blind_m = 0.5 * SPEED_OF_LIGHT_M_S * receiver.blind_time_s(pulse, HARMLESS_SNR);
        self.limits
            .extend([("reflex_range_m", blind_m), ("ambiguous_range_m", apart_m)]);
        let mut blind = Vec::new();
        if receiver.front_end.reflection > 0.0 {
            let reflection_db = scene.telescope.reflection_db;
            blind.push(format!(
                "blind to {} (reflection {reflection_db} dB, until -20 dB)",
                si(blind_m, "m")
            ));
        }
        if instrument.blind_range_m > 0.0 {
            blind.push(format!(
                "blind to {} (key blind_range_m)",
                si(instrument.blind_range_m, "m")
            ));
        }
        blind.push(format!("ambiguous from {}", si(apart_m, "m")));
        self.limit_lines
            .push(format!("range: {}", blind.join("; ")));
        self.velocities(plan);
        if scene.laser.linewidth_hz > 0.0 {
            self.phase_noise(plan)?;
        }
        self.local_oscillator(plan);
        self.resolution(plan)
    }

    /// Powers of the local oscillator at which noises are equal, and the best one.
    fn local_oscillator(&mut self, plan: &Plan) {
        let receiver = &plan.instrument.receiver;
        let n = receiver.noise_densities();
        let mut powers = Vec::new();
        if n.amplifier_a2_hz > 0.0 {
            let equal_w = receiver.amplifier_equals_shot_w();
            if equal_w.is_finite() {
                self.limits.push(("amplifier_equals_shot_w", equal_w));
                let equal = si(equal_w, "W");
                powers.push(format!("amplifier noise equals shot noise at {equal}"));
            } else {
                powers.push("amplifier noise is above shot noise at any power".into());
            }
        }
        if n.intensity_a2_hz > 0.0 {
            let equal_w = receiver.intensity_equals_shot_w();
            if equal_w.is_finite() {
                self.limits.push(("intensity_equals_shot_w", equal_w));
                powers.push(format!("intensity noise equals it at {}", si(equal_w, "W")));
            } else {
                powers.push("intensity noise is below shot noise at any power".into());
            }
        }
        let best_w = receiver.best_local_oscillator_w();
        if best_w > 0.0 && best_w.is_finite() {
            self.limits.push(("best_local_oscillator_w", best_w));
            powers.push(format!("best at {}", si(best_w, "W")));
        }
        if powers.is_empty() {
            powers.push("shot noise alone".into());
        }
        let power = si(plan.scene().detector.local_oscillator_w, "W");
        let line = format!("local oscillator {power}: {}", powers.join("; "));
        self.limit_lines.push(line);
    }

    fn velocities(&mut self, plan: &Plan) {
        let d = &plan.scene().detector;
        let half_m = 0.5 * plan.scene().laser.wavelength_m;
        let band_m_s = 0.5 * half_m * d.bandwidth_hz;
        let (low_m_s, high_m_s) = sampled_velocities_m_s(plan.scene());
        let flow_m_s = plan.fastest_m_s;
        self.limits.extend([
            ("band_m_s", band_m_s),
            ("sampled_from_m_s", low_m_s),
            ("sampled_to_m_s", high_m_s),
        ]);
        self.limit_lines.push(format!(
            "velocity: band +-{band_m_s:.1} m/s; sampled {low_m_s:+.1} to {high_m_s:+.1} m/s; flow reaches {flow_m_s:.0} m/s"
        ));
    }

    fn phase_noise(&mut self, plan: &Plan) -> Result<(), Error> {
        let scene = plan.scene();
        let wavelength_m = scene.laser.wavelength_m;
        let linewidth_hz = scene.laser.linewidth_hz;
        let window_s = scene.estimator.window_samples as f64 / scene.detector.sampling_hz;
        let delay_s = 2.0 * scene.scan.range_min_m / SPEED_OF_LIGHT_M_S;
        let mean_m_s = mean_frequency_sd_m_s(wavelength_m, linewidth_hz, delay_s, window_s);
        /// Places of the window between which its weights are joined by straight lines.
        const PLACES: usize = 1000;
        let weights = scene.weighting().weights(PLACES)?;
        let at = |s: f64| weights[(((s + 0.5) * PLACES as f64) as usize).min(PLACES - 1)];
        let peak_m_s = mean_m_s * peak_variance_factor(at).sqrt();
        let spectrum_m_s = 0.5 * wavelength_m * plan.instrument.pulse.spectral_width_hz();
        self.limits.extend([
            ("phase_noise_m_s", mean_m_s),
            ("phase_noise_of_peak_m_s", peak_m_s),
        ]);
        self.limit_lines.push(format!(
            "linewidth {}: {mean_m_s:.3} m/s a window, its peak {peak_m_s:.3} m/s (spectrum of one pulse {spectrum_m_s:.2} m/s)",
            si(linewidth_hz, "Hz")
        ));
        Ok(())
    }

    fn resolution(&mut self, plan: &Plan) -> Result<(), Error> {
        let scene = plan.scene();
        let gate_m = range_filter(plan)?.full_width_half_maximum_m();
        let pulse = RangeFilter::pulse(&plan.instrument.pulse, plan.geometry.layer_thickness_m)?;
        let pulse_m = pulse.full_width_half_maximum_m();
        let weighting = match scene.estimator.weighting {
            Weighting::Gaussian => "Gaussian",
            Weighting::Rectangular => "rectangular",
            Weighting::Hann => "Hann",
        };
        self.limits.extend([
            ("pulse_resolution_m", pulse_m),
            ("gate_resolution_m", gate_m),
        ]);
        self.limit_lines.push(format!(
            "resolution: pulse {pulse_m:.1} m, gate (pulse and {weighting} window of {}) {gate_m:.1} m, full width at half maximum",
            scene.estimator.window_samples
        ));
        Ok(())
    }
}
