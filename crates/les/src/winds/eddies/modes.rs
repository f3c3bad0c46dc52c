//! The modes of a turbulent field: wave numbers, amplitudes and frequencies, as data.

use crate::error::{Error, check};
use std::f64::consts::TAU;

/// Largest `|k . a|` over `|k| |a|` of a mode that is free of divergence.
const DIVERGENCE: f64 = 1e-12;

/// Steps of the lattice of directions: 1/p and 1/p^2 of the plastic number p, which spreads points
/// evenly over a square (Roberts 2018).
const LATTICE: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

/// One plane wave `Re{a exp i(k . x - omega t)}` of a velocity field, with `k . a = 0`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Mode {
    /// Wave vector `k` \[rad/m\].
    pub wavenumber_rad_m: [f64; 3],
    /// Real part of the amplitude `a` \[m/s\].
    pub real_m_s: [f64; 3],
    /// Imaginary part of the amplitude \[m/s\].
    pub imaginary_m_s: [f64; 3],
    /// Angular frequency `omega` \[rad/s\].
    pub frequency_rad_s: f64,
}

impl Mode {
    /// Fails unless all numbers are finite and the wave is free of divergence.
    ///
    /// # Errors
    /// [`Error::OutOfRange`].
    pub fn validated(self) -> Result<Self, Error> {
        for value in self.wavenumber_rad_m {
            check("wavenumber_rad_m", value, "finite", |_| true)?;
        }
        check("frequency_rad_s", self.frequency_rad_s, "finite", |_| true)?;
        for amplitude_m_s in [self.real_m_s, self.imaginary_m_s] {
            let along = dot(self.wavenumber_rad_m, amplitude_m_s);
            let size = norm(self.wavenumber_rad_m) * norm(amplitude_m_s);
            let allowed = "across wavenumber_rad_m, to 1e-12 of the product of both";
            check(
                "amplitude along wavenumber_rad_m",
                along,
                allowed,
                |along| along.abs() <= DIVERGENCE * size,
            )?;
        }
        Ok(self)
    }

    /// Mean square of the amplitude over a period, summed over the components \[m^2/s^2\].
    pub(super) fn mean_square_m2_s2(&self) -> f64 {
        let real = dot(self.real_m_s, self.real_m_s);
        let imaginary = dot(self.imaginary_m_s, self.imaginary_m_s);
        0.5 * (real + imaginary)
    }
}

/// `count` modes of isotropic turbulence between two wave numbers, (A6): wave numbers equally spaced in the logarithm, directions on
/// a lattice, amplitudes of fixed size
/// `a_n = sqrt(2 E(k_n) k_n s) (e_1 exp(i phi_1) + e_2 exp(i phi_2))`.
///
/// `band_rad_m` is the smallest and the largest wave number \[rad/m\], `lattice_start` where the
/// lattice of directions begins, two numbers from 0 to 1;
/// `energy_m3_s2` is the energy spectrum `E(k)` \[m^3/s^2\]. Each mode has the energy of its interval
/// of ln k, so that the mean structure function is exact in the band for any number of modes.
/// `uniforms(n)` returns three independent uniform numbers from 0 to 1 of mode n: its place in the
/// interval of ln k and its two phases.
///
/// # Errors
/// [`Error::OutOfRange`] for an empty band, no modes, or a spectrum that is not finite.
pub fn isotropic_modes(
    band_rad_m: [f64; 2],
    count: usize,
    lattice_start: [f64; 2],
    energy_m3_s2: impl Fn(f64) -> f64,
    mut uniforms: impl FnMut(usize) -> [f64; 3],
) -> Result<Vec<Mode>, Error> {
    let [smallest, largest] = band_rad_m;
    check("smallest wave number", smallest, "above 0", |k| k > 0.0)?;
    let allowed = "above the smallest wave number";
    check("largest wave number", largest, allowed, |k| k > smallest)?;
    check("modes", count as f64, "at least 1", |count| count >= 1.0)?;
    let interval = (largest / smallest).ln() / count as f64;
    let mut modes = Vec::with_capacity(count);
    for n in 0..count {
        let [place, first, second] = uniforms(n);
        let k = smallest * (interval * (n as f64 + place)).exp();
        let energy = energy_m3_s2(k);
        check("energy spectrum", energy, "0 or above", |e| e >= 0.0)?;
        let direction = lattice_direction(lattice_start, n);
        let [e1, e2] = across(direction);
        let size_m_s = (2.0 * energy * k * interval).sqrt();
        let (sin1, cos1) = (TAU * first).sin_cos();
        let (sin2, cos2) = (TAU * second).sin_cos();
        modes.push(Mode {
            wavenumber_rad_m: direction.map(|part| k * part),
            real_m_s: [0, 1, 2].map(|d| size_m_s * (e1[d] * cos1 + e2[d] * cos2)),
            imaginary_m_s: [0, 1, 2].map(|d| size_m_s * (e1[d] * sin1 + e2[d] * sin2)),
            frequency_rad_s: 0.0,
        });
    }
    Ok(modes)
}

/// Direction `n` of the lattice: equal areas of the sphere.
fn lattice_direction(start: [f64; 2], n: usize) -> [f64; 3] {
    let cosine = 2.0 * (start[0] + n as f64 * LATTICE[0]).fract() - 1.0;
    let azimuth = TAU * (start[1] + n as f64 * LATTICE[1]).fract();
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let (sin, cos) = azimuth.sin_cos();
    [sine * cos, sine * sin, cosine]
}

/// Two unit vectors across a unit vector and across each other.
fn across(direction: [f64; 3]) -> [[f64; 3]; 2] {
    // The axis that is farthest from the direction.
    let mut least = 0;
    for d in 1..3 {
        if direction[d].abs() < direction[least].abs() {
            least = d;
        }
    }
    let mut axis = [0.0; 3];
    axis[least] = 1.0;
    let first = cross(direction, axis);
    let length = norm(first);
    let first = first.map(|part| part / length);
    [first, cross(direction, first)]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Scalar product.
pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
