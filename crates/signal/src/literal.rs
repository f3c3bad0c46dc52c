//! The heterodyne sum term by term, as (15) is written: the oracle of the fast form.
//!
//! Check: the only common code with the fast form is the pulse, the receiver and the
//! rule for `L_c`.

use std::f64::consts::PI;

use num_complex::Complex;

use crate::error::check_length;
use crate::window::reach;
use crate::{Error, LineOfSight, SPEED_OF_LIGHT_M_S, Simulator};

/// The complex envelope \[A\] of (15), corrected, by direct evaluation of every term: some 40 times
/// slower than [`Simulator::envelope_of_speckle_into`], for tests.
///
/// `speckle` holds the amplitude `g_l` of each layer (mean square 1).
///
/// # Errors
/// As [`Simulator::envelope_of_speckle_into`].
pub fn literal_envelope(
    simulator: &Simulator,
    line: &LineOfSight,
    speckle: &[Complex<f64>],
) -> Result<Vec<Complex<f64>>, Error> {
    line.validate()?;
    check_length("speckle", speckle.len(), line.layers())?;
    let pulse = simulator.pulse();
    let receiver = simulator.receiver();
    let thickness_m = line.layer_thickness_m;
    let (near, far) = reach(pulse, thickness_m)?;
    let scale = (receiver.heterodyne_gain_a2_w() * pulse.energy_j() * thickness_m).sqrt();
    let mut envelope_a = Vec::with_capacity(simulator.record().samples);
    for k in 0..simulator.record().samples {
        let time_s = simulator.time_s(k);
        let range_m = 0.5 * SPEED_OF_LIGHT_M_S * time_s;
        let centre = ((range_m - line.first_range_m) / thickness_m).round();
        let mut sum = Complex::ZERO;
        for (layer, g) in speckle.iter().enumerate() {
            let velocity_m_s = line.radial_velocity_m_s[layer];
            let from_centre = layer as f64 - centre;
            if from_centre < -near as f64 || from_centre > far as f64 || velocity_m_s.is_nan() {
                continue;
            }
            let delay_s = 2.0 * line.range_m(layer) / SPEED_OF_LIGHT_M_S;
            let b = line.weight_per_m[layer].sqrt() * g;
            let phase_rad = -4.0 * PI * velocity_m_s * time_s / receiver.wavelength_m;
            sum += pulse.envelope_per_sqrt_s(time_s - delay_s) * b * Complex::cis(phase_rad);
        }
        envelope_a.push(scale * sum);
    }
    Ok(envelope_a)
}
