//! The turbulence of a scene: modes of its spectrum with the random numbers of a realisation.
//!
//! Mode n has a stream keyed by (seed, realisation, "eddies", n).

use crate::Error;
use crate::scene::{
    EddyDecorrelation, EddyEvaluation, EddyField, EddyGround, EddyRealisations, Scene,
};
use crate::streams::stream;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::Rng;
use std::f64::consts::TAU;
use wakescope_les::winds::{Eddies, isotropic_modes};

/// The turbulence of a realisation; none where the scene has none.
///
/// # Errors
/// What the modes refuse; a checked scene gives none.
pub(super) fn eddies(scene: &Scene, realisation: usize) -> Result<Option<Eddies>, Error> {
    let Some(keys) = scene.eddies() else {
        return Ok(None);
    };
    let Some(spectrum) = keys.spectrum() else {
        return Ok(None);
    };
    let realisation = match keys.realisations {
        EddyRealisations::One => 0,
        EddyRealisations::Each => realisation,
    };
    let stage = format!("eddies {realisation}");
    let mut lattice = stream(scene.seed, &format!("{stage} lattice"), 0);
    let band_rad_m = keys.wavenumbers_rad_m();
    let lattice_start = [uniform(&mut lattice), uniform(&mut lattice)];
    let mut turns = Vec::with_capacity(keys.modes);
    let uniforms = |n: usize| {
        let mut own = stream(scene.seed, &stage, n as u64);
        let numbers = [0; 3].map(|_| uniform(&mut own));
        turns.push(normal(&mut own));
        numbers
    };
    let energy_m3_s2 = |wavenumber_rad_m| spectrum.energy_m3_s2(wavenumber_rad_m);
    let mut modes = isotropic_modes(
        band_rad_m,
        keys.modes,
        lattice_start,
        energy_m3_s2,
        uniforms,
    )?;
    if keys.decorrelation == EddyDecorrelation::Sweeping {
        // Large eddies carry small ones past a point (Kraichnan 1964, Tennekes 1975).
        let sweeping_m_s = spectrum.variance_m2_s2().sqrt();
        for (mode, turn) in modes.iter_mut().zip(turns) {
            let [x, y, z] = mode.wavenumber_rad_m;
            mode.frequency_rad_s = turn * sweeping_m_s * (x * x + y * y + z * z).sqrt();
        }
    }
    let mut eddies = Eddies::new(modes)?.carried(carrying_m_s(scene, keys)?)?;
    if keys.evaluation == EddyEvaluation::All {
        eddies = eddies.summed_at_each_sample();
    }
    Ok(Some(match keys.ground {
        EddyGround::Open => eddies,
        EddyGround::Blocked => eddies.blocked(),
    }))
}

/// The mean wind (x, y) at the height that carries the eddies, m/s.
fn carrying_m_s(scene: &Scene, keys: &EddyField) -> Result<[f64; 2], Error> {
    let mut sum_m_s = [0.0; 2];
    let Some(height_m) = keys.carried_at_m else {
        return Ok(sum_m_s);
    };
    for wind in scene.mean_winds() {
        let [x_m_s, y_m_s] = wind.simulated()?.velocity_m_s(height_m);
        sum_m_s[0] += x_m_s;
        sum_m_s[1] += y_m_s;
    }
    Ok(sum_m_s)
}

/// A uniform number from 0 to 1.
fn uniform(generator: &mut Xoshiro256PlusPlus) -> f64 {
    (generator.next_u64() >> 11) as f64 * (-53.0_f64).exp2()
}

/// A normal number (Box and Muller 1958).
fn normal(generator: &mut Xoshiro256PlusPlus) -> f64 {
    let size = (-2.0 * (1.0 - uniform(generator)).ln()).sqrt();
    size * (TAU * uniform(generator)).cos()
}
