//! Smooth disturbances: the curl of a potential that is a sum of waves under an envelope, so free
//! of divergence.
//!
//! `u' = C curl A`, `A_c = g(y, z) sum_n a_n cos(k_n . x + phase_nc)/|k_n|`. The waves of the
//! wake's noise come from a closed formula, the same in any code and on any mesh, or from the hash
//! of a seed; those of background turbulence always from a seed. All are summed by axial wave
//! number first, so that a mesh costs a few waves for each of its rows.
//!
//! Check: divergence, the stated level, sums by row against sums by point.

use std::f64::consts::TAU;

/// Waves of the noise.
const NOISE_WAVES: usize = 48;
/// Waves of background turbulence.
const BACKGROUND_WAVES: usize = 128;
/// Highest axial wave number of the noise, in wave lengths per length of the box.
const AXIAL: usize = 8;

/// `g` and its slopes along y and z: everywhere but at the ground and the top at `top`, or without
/// a top between the ground and 1.6 `b0`, within 1.6 `b0` of the middle.
fn envelope(top: Option<f64>, y: f64, z: f64) -> [f64; 3] {
    let (near, near_slope) = rise(z);
    if let Some(height) = top {
        let (top, top_slope) = rise(height - z);
        return [near * top, 0.0, near_slope * top - near * top_slope];
    }
    let far = (-(z / 1.6).powi(8) - (y / 1.6).powi(8)).exp();
    let g = near * far;
    let [by_y, by_z] = [y, z].map(|x| -8.0 * x.powi(7) / 1.6_f64.powi(8) * g);
    [g, by_y, near_slope * far + by_z]
}

/// The rise of an envelope from a plane at the distance `d`, and its slope.
fn rise(d: f64) -> (f64, f64) {
    let gaussian = (-(d / 0.2).powi(2)).exp();
    (1.0 - gaussian, 2.0 * d / 0.04 * gaussian)
}

#[derive(Debug, Clone)]
struct Wave {
    /// Axial wave number, in wave lengths per length of the box.
    axial: usize,
    vector: [f64; 3],
    /// `a_n/|k_n|`.
    amplitude: f64,
    phase: [f64; 3],
}

/// A disturbance in the units of the pair.
#[derive(Debug, Clone)]
pub(super) struct Perturbation {
    /// Height of the box that it fills; none of one about the wake alone.
    top: Option<f64>,
    waves: Vec<Wave>,
}

impl Perturbation {
    /// Noise about the vortices at `(+-1/2, height)` of the given root mean square of each
    /// component within 0.3 of them, in a box of the given length.
    pub(super) fn noise(length: f64, height: f64, rms: f64, seed: Option<u64>) -> Self {
        let mut waves = Vec::with_capacity(NOISE_WAVES);
        for n in 0..NOISE_WAVES {
            let [across, angle, phases @ ..] = noise_fractions(n, seed);
            let axial = 1 + n % AXIAL;
            let across = TAU * (0.5 + 3.5 * across);
            let angle = TAU * angle;
            let along = TAU * axial as f64 / length;
            waves.push(Wave {
                axial,
                vector: [along, across * angle.cos(), across * angle.sin()],
                amplitude: 1.0 / along.hypot(across),
                phase: phases.map(|fraction| TAU * fraction),
            });
        }
        // Points of the discs about both vortices.
        let mut points = Vec::new();
        for j in -12..=12 {
            for k in -12..=12 {
                let y = 0.025 * f64::from(j);
                let z = 0.025 * f64::from(k);
                if y.hypot(z) < 0.3 {
                    points.extend([[y - 0.5, height + z], [y + 0.5, height + z]]);
                }
            }
        }
        let raw = Self { top: None, waves };
        raw.scaled_to(rms, &points)
    }

    /// Turbulence that fills the periodic box of the given size, of wave lengths from 2 to 1/4
    /// whose energy falls with the power -5/3, and of the given root mean square of each component
    /// over the box.
    pub(super) fn background(size: [f64; 3], rms: f64, seed: u64) -> Self {
        let [_, width, height] = size;
        let raw = Self {
            top: Some(height),
            waves: (0..BACKGROUND_WAVES)
                .map(|n| background_wave(n, size, seed))
                .collect(),
        };
        let mut points = Vec::with_capacity(40 * 40);
        for j in 0..40 {
            for k in 0..40 {
                let y = ((f64::from(j) + 0.5) / 40.0 - 0.5) * width;
                let z = (f64::from(k) + 0.5) / 40.0 * height;
                points.push([y, z]);
            }
        }
        raw.scaled_to(rms, &points)
    }

    /// The same with the given root mean square of each component over the points `(y, z)` and all
    /// x.
    fn scaled_to(mut self, rms: f64, points: &[[f64; 2]]) -> Self {
        let mut sum = 0.0;
        let mut count = 0.0;
        for &[y, z] in points {
            for component in 0..3 {
                for (m, [cos, sin]) in self.row(component, y, z).into_iter().enumerate() {
                    sum += if m == 0 {
                        cos * cos
                    } else {
                        0.5 * (cos * cos + sin * sin)
                    } / 3.0;
                }
            }
            count += 1.0;
        }
        let factor = rms / (sum / count).sqrt();
        self.waves
            .iter_mut()
            .for_each(|wave| wave.amplitude *= factor);
        self
    }

    /// Coefficients of `cos(2 pi m x/L)` and `sin(2 pi m x/L)`, m = 0, 1, ..., of a velocity
    /// component at `(y, z)`.
    pub(super) fn row(&self, component: usize, y: f64, z: f64) -> Vec<[f64; 2]> {
        let [g, by_y, by_z] = envelope(self.top, y, z);
        let slope = [0.0, by_y, by_z];
        // u_c = d_a A_b - d_b A_a with (c, a, b) cyclic.
        let a = (component + 1) % 3;
        let b = (component + 2) % 3;
        let highest = self.waves.iter().map(|wave| wave.axial).max().unwrap_or(0);
        let mut row = vec![[0.0; 2]; highest + 1];
        for wave in &self.waves {
            let angle = wave.vector[1] * y + wave.vector[2] * z;
            let [cos_sum, sin_sum] = &mut row[wave.axial];
            for (along, potential, sign) in [(a, b, 1.0), (b, a, -1.0)] {
                let (sin, cos) = (angle + wave.phase[potential]).sin_cos();
                let scale = sign * wave.amplitude;
                // d/d(along) of g cos(.) is P cos(.) + Q sin(.).
                let p = scale * slope[along];
                let q = -scale * g * wave.vector[along];
                *cos_sum += p * cos + q * sin;
                *sin_sum += q * cos - p * sin;
            }
        }
        row
    }
}

/// A number in [0, 1) from a seed and an index: two rounds of the finaliser of SplitMix64 (Steele,
/// Lea and Flood 2014).
fn hashed(seed: u64, index: u64) -> f64 {
    let mixed_seed = mix(seed.wrapping_add(0x9e37_79b9_7f4a_7c15));
    let bits = mix(mixed_seed ^ index.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    (bits >> 11) as f64 * (0.5_f64).powi(53)
}

/// The finaliser of SplitMix64.
fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Fractions of wave `n` of the noise: length across the flight, angle, and three phases; those of
/// the closed formula without a seed.
fn noise_fractions(n: usize, seed: Option<u64>) -> [f64; 5] {
    let irrationals = [
        0.618_033_988_749_894_9,
        2.0_f64.sqrt(),
        7.0_f64.sqrt(),
        11.0_f64.sqrt(),
        13.0_f64.sqrt(),
    ];
    std::array::from_fn(|which| match seed {
        None => (n as f64 * irrationals[which]).fract(),
        Some(seed) => hashed(seed, (5 * n + which) as u64),
    })
}

/// Wave `n` of turbulence in a periodic box.
fn background_wave(n: usize, [length, width, _]: [f64; 3], seed: u64) -> Wave {
    let fractions: [f64; 6] =
        std::array::from_fn(|which| hashed(!seed, 8 * n as u64 + which as u64));
    let total = TAU * 0.5 * 8.0_f64.powf(fractions[0]);
    let rise = 2.0 * fractions[1] - 1.0;
    let azimuth_rad = TAU * fractions[2];
    let flat = total * (1.0 - rise * rise).sqrt();
    // Whole waves in the box.
    let axial = (flat * azimuth_rad.cos().abs() * length / TAU).round();
    let lateral = (flat * azimuth_rad.sin() * width / TAU).round();
    let vector = [TAU * axial / length, TAU * lateral / width, total * rise];
    let square: f64 = vector.iter().map(|k| k * k).sum();
    let magnitude = square.sqrt().max(TAU * 0.1);
    Wave {
        axial: axial as usize,
        vector,
        amplitude: magnitude.powf(-4.0 / 3.0),
        phase: [3, 4, 5].map(|which| TAU * fractions[which]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn velocity(field: &Perturbation, length: f64, [x, y, z]: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|component| {
            let term = |(m, [cos, sin]): (usize, [f64; 2])| {
                let angle = TAU * m as f64 * x / length;
                cos * angle.cos() + sin * angle.sin()
            };
            field
                .row(component, y, z)
                .into_iter()
                .enumerate()
                .map(term)
                .sum()
        })
    }

    fn divergence(field: &Perturbation, length: f64, at: [f64; 3]) -> f64 {
        let h = 1e-5;
        let slope = |d: usize| {
            let mut a = at;
            let mut b = at;
            a[d] += h;
            b[d] -= h;
            (velocity(field, length, a)[d] - velocity(field, length, b)[d]) / (2.0 * h)
        };
        slope(0) + slope(1) + slope(2)
    }

    #[test]
    fn disturbances_are_free_of_divergence_vanish_at_the_ground_and_repeat_themselves() {
        let size = [2.0, 4.0, 2.5];
        let noise = Perturbation::noise(2.0, 1.0, 0.01, None);
        let background = Perturbation::background(size, 0.01, 7);
        for field in [&noise, &background] {
            for at in [[0.1, 0.4, 0.9], [1.7, -0.6, 1.2], [0.3, 0.1, 0.15]] {
                assert!(divergence(field, 2.0, at).abs() < 1e-8, "{at:?}");
                let there = velocity(field, 2.0, at);
                assert!(there.iter().any(|v| v.abs() > 1e-4));
                let again = velocity(field, 2.0, [at[0] + 2.0, at[1], at[2]]);
                assert!(there.iter().zip(again).all(|(a, b)| (a - b).abs() < 1e-12));
            }
            let ground = velocity(field, 2.0, [0.3, 0.2, 0.0]);
            assert!(ground.iter().all(|v| v.abs() < 1e-15), "{ground:?}");
        }
        let left = velocity(&background, 2.0, [0.4, -2.0, 1.1]);
        let right = velocity(&background, 2.0, [0.4, 2.0, 1.1]);
        assert!(
            left.iter().zip(right).all(|(a, b)| (a - b).abs() < 1e-12),
            "periodic sides"
        );
    }

    #[test]
    fn the_noise_has_the_stated_level_and_the_constant_of_the_published_formula() {
        let noise = Perturbation::noise(1.0, 1.0, 0.01, None);
        let mut sum = 0.0;
        let mut count = 0.0;
        for i in 0..20 {
            for j in -10..=10 {
                for k in -10..=10 {
                    let y = 0.03 * f64::from(j);
                    let z = 0.03 * f64::from(k);
                    if y.hypot(z) < 0.3 {
                        for side in [-0.5, 0.5] {
                            let there =
                                velocity(&noise, 1.0, [0.05 * f64::from(i), side + y, 1.0 + z]);
                            sum += there.iter().map(|v| v * v).sum::<f64>() / 3.0;
                            count += 1.0;
                        }
                    }
                }
            }
        }
        let rms = f64::sqrt(sum / count);
        assert!((rms / 0.01 - 1.0).abs() < 0.01, "rms {rms}");
        // C of the independent code at this level, from its own mesh.
        let first = &noise.waves[0];
        let found = first.amplitude * first.vector.iter().map(|k| k * k).sum::<f64>().sqrt();
        assert!((found / 0.002_652_022_6 - 1.0).abs() < 0.02, "C = {found}");
    }

    #[test]
    fn seeds_give_different_fields_of_the_same_level() {
        let at = [0.3, 0.4, 1.1];
        let of = |seed| velocity(&Perturbation::noise(1.0, 1.0, 0.01, seed), 1.0, at);
        assert_eq!(of(Some(1)), of(Some(1)));
        assert!(of(Some(1)) != of(Some(2)) && of(Some(1)) != of(None));
        let mean: f64 = (0..10_000).map(|i| hashed(3, i)).sum::<f64>() / 1e4;
        // Standard error 0.0029.
        assert!((mean - 0.5).abs() < 0.012, "{mean}");
        assert!((0..100).all(|i| (hashed(1, i) - hashed(2, i)).abs() > 1e-6));
    }
}
