//! What files say of a scene's instrument and of its place.

use crate::io::{PulseInfo, Site, UtcTime};
use crate::scene::Scene;

/// Pulse and acquisition of a scene.
pub(crate) fn pulse_info(scene: &Scene) -> PulseInfo {
    PulseInfo {
        prt_s: 1.0 / scene.laser.pulse_repetition_hz,
        pulse_width_s: scene.pulse_width_s(),
        nyquist_velocity_m_s: 0.25 * scene.laser.wavelength_m * scene.detector.sampling_hz,
        samples: scene.scan.pulses_per_line as u32,
        frequency_hz: crate::SPEED_OF_LIGHT_M_S / scene.laser.wavelength_m,
    }
}

/// The site of a checked scene.
pub(crate) fn site(scene: &Scene) -> Site {
    let s = &scene.site;
    Site {
        name: s.name.clone(),
        latitude_deg: s.latitude_deg,
        longitude_deg: s.longitude_deg,
        altitude_m: s.altitude_m,
        start: UtcTime::parse(&s.start_utc).unwrap_or(UtcTime::SYNTHETIC),
    }
}
