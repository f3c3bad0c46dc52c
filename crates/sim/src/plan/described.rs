//! What files say of a scene's instrument.

use crate::io::PulseInfo;
use crate::scene::{DetectorSignal, Scene};

/// Least and largest velocity that the samples of a scene can tell from others, m/s: real currents are mirrored at 0 and at half the
/// sampling frequency, complex ones repeat.
pub(crate) fn sampled_velocities_m_s(scene: &Scene) -> (f64, f64) {
    let d = &scene.detector;
    let half_m = 0.5 * scene.laser.wavelength_m;
    let half_hz = 0.5 * d.sampling_hz;
    match d.signal {
        DetectorSignal::IntermediateFrequency => (
            half_m * (d.intermediate_frequency_hz - half_hz),
            half_m * d.intermediate_frequency_hz,
        ),
        DetectorSignal::Baseband => (-half_m * half_hz, half_m * half_hz),
    }
}

/// Width after which velocities of complex samples repeat, m/s; none of real ones, which are mirrored.
pub(crate) fn fold_m_s(scene: &Scene) -> Option<f64> {
    let (least_m_s, largest_m_s) = sampled_velocities_m_s(scene);
    match scene.detector.signal {
        DetectorSignal::IntermediateFrequency => None,
        DetectorSignal::Baseband => Some(largest_m_s - least_m_s),
    }
}

/// Pulse and acquisition of a scene.
pub(crate) fn pulse_info(scene: &Scene) -> PulseInfo {
    let (least_m_s, largest_m_s) = sampled_velocities_m_s(scene);
    PulseInfo {
        prt_s: 1.0 / scene.laser.pulse_repetition_hz,
        pulse_width_s: scene.pulse_width_s(),
        nyquist_velocity_m_s: largest_m_s.min(-least_m_s),
        sampling_hz: scene.detector.sampling_hz,
        samples: scene.scan.pulses_per_line as u32,
        frequency_hz: crate::SPEED_OF_LIGHT_M_S / scene.laser.wavelength_m,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{GaussianShape, PulseDefinition, PulseShape};

    #[test]
    fn velocities_that_samples_tell_apart_are_those_of_their_kind() {
        let mut scene = Scene::default();
        let info = pulse_info(&scene);
        // 45 MHz from the intermediate frequency to half of the rate: faster air comes back as slower.
        assert!(
            (info.nyquist_velocity_m_s - 34.875).abs() < 1e-9 && info.is_mirrored(),
            "{info:?}"
        );
        scene.detector.intermediate_frequency_hz = 40e6;
        let info = pulse_info(&scene);
        assert!(
            (info.nyquist_velocity_m_s - 31.0).abs() < 1e-9 && info.is_mirrored(),
            "{info:?}"
        );
        scene.detector.intermediate_frequency_hz = 62.5e6;
        assert!(pulse_info(&scene).is_mirrored());
        scene.detector.signal = DetectorSignal::Baseband;
        let info = pulse_info(&scene);
        assert!(
            (info.nyquist_velocity_m_s - 96.875).abs() < 1e-9 && !info.is_mirrored(),
            "{info:?}"
        );
    }

    #[test]
    fn the_width_of_a_pulse_is_that_at_half_height_however_it_is_stated() {
        let width_s = |duration_s, definition| {
            let shape = GaussianShape {
                duration_s,
                definition,
            };
            let mut scene = Scene::default();
            scene.pulse.shape = PulseShape::Gaussian(shape);
            pulse_info(&scene).pulse_width_s
        };
        assert_eq!(width_s(200e-9, PulseDefinition::Fwhm), 200e-9);
        assert!(
            (width_s(120.112_240_878e-9, PulseDefinition::OneOverEHalfWidth) - 200e-9).abs()
                < 1e-17
        );
    }
}
