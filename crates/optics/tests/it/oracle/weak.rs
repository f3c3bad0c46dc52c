//! Weak turbulence: the monostatic efficiency to first order in Cn2 for the actual beam.
//!
//! Both beams of a monostatic lidar cross the same air, so that eta = (C/..) <integral of j^2>
//! exceeds the bistatic value by the variance of the irradiance j. A phase wave of wave vector
//! kappa at distance z tilts a copy of the beam: at the target it arrives displaced by s = kappa
//! (R - z)/k and late by kappa^2 (R - z)/(2k). To first order in Cn2 therefore
//!
//! integral of var(j) = integral dz 2 pi k^2 Cn2(z) integral d^2 kappa Phi_n
//!     2 \[Q(s) - Re exp(-j kappa^2 (R - z) z/(k R)) X(s)\],
//! Q(s) = integral of |U(w)|^2 |U(w - s)|^2 d^2 w,
//! X(s) = integral of U*(w)^2 U(w - s) U(w + s) d^2 w,
//!
//! with U the free-space field at the target without its spherical phase (Born approximation;
//! Ishimaru 1978, chapter 17). Truncation, obscuration, focus and spectrum enter as they are.

use super::hankel::field_per_m;
use super::quadrature::GaussLegendre;
use num_complex::Complex;
use std::f64::consts::PI;
use wakescope_optics::air::path_rytov_variance;
use wakescope_optics::theory::{bistatic_efficiency, fresnel_number};
use wakescope_optics::{Misalignment, Spectrum, Telescope, Turbulence};

/// Largest Fresnel number for which the overlaps Q and X are tabulated.
const LARGEST_FRESNEL: f64 = 40.0;
/// Largest Rytov variance of the path at which the first order holds.
pub(crate) const LARGEST_RYTOV: f64 = 0.3;

/// Efficiencies (19) in weak turbulence.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WeakTurbulence {
    /// Bistatic efficiency, exact.
    pub bistatic: f64,
    /// Monostatic over bistatic efficiency less one, to first order in Cn2.
    pub enhancement: f64,
    /// Monostatic efficiency, (1 + enhancement) times the bistatic one.
    pub monostatic: f64,
    /// Rytov variance of a plane wave over the path.
    pub rytov_variance: f64,
}

/// Both efficiencies of a matched, aligned pair at `range_m` in weak turbulence of constant Cn2.
pub(crate) fn weak_turbulence_efficiency(
    telescope: &Telescope,
    turbulence: &Turbulence,
    range_m: f64,
) -> WeakTurbulence {
    let bistatic =
        bistatic_efficiency(telescope, &Misalignment::NONE, turbulence, range_m).expect("theory");
    let fresnel = fresnel_number(telescope, range_m);
    assert!(fresnel < LARGEST_FRESNEL, "{fresnel}");
    let rytov_variance =
        path_rytov_variance(&turbulence.cn2, telescope.wavelength_m, range_m).expect("path");
    let overlaps = DisplacedOverlaps::new(telescope, range_m);
    let mut enhancement = 0.0;
    for (z, dz) in GaussLegendre::new(16).on_panels(0.0, range_m, 1) {
        let cn2_dz = turbulence.cn2.at(z).expect("path") * dz;
        enhancement += cn2_dz * overlaps.variance_of_layer(&*turbulence.spectrum, z);
    }
    WeakTurbulence {
        bistatic,
        enhancement,
        monostatic: bistatic * (1.0 + enhancement),
        rytov_variance,
    }
}

/// Overlaps Q(s) and X(s) of the beam at the target with displaced copies of itself, over their
/// common value at s = 0.
struct DisplacedOverlaps {
    wavenumber_rad_m: f64,
    range_m: f64,
    /// Step of s \[m\].
    step_m: f64,
    /// Q, and X (real and imaginary part), at s = 0, one step, two steps, ...
    values: Vec<[f64; 3]>,
}

impl DisplacedOverlaps {
    fn new(telescope: &Telescope, range_m: f64) -> Self {
        let wavenumber_rad_m = telescope.wavenumber_rad_m();
        let lit_m = telescope
            .aperture_radius_m
            .min(6.0 * telescope.intensity_radius_m());
        // U has no wave number above 1/lobe: sums over a lattice of less than 2 pi/(4 lobe)
        // integrate products of four exactly.
        let lobe_m = range_m / (wavenumber_rad_m * lit_m);
        let step_m = 0.5 * lobe_m;
        let shadow_m = lit_m * (1.0 - range_m * telescope.focus.curvature_per_m()).abs();
        let reach = ((1.2 * shadow_m + 20.0 * lobe_m) / step_m).ceil() as usize;
        let field = lattice(telescope, range_m, step_m, reach);
        let at = |i: usize, j: usize| {
            if i.max(j) <= reach {
                field[i * (reach + 1) + j]
            } else {
                Complex::default()
            }
        };
        let irradiance = |i: usize, j: usize| at(i, j).norm_sqr();
        let mut values = Vec::with_capacity(2 * reach + 1);
        for s in 0..=2 * reach {
            let mut sum = [0.0; 3];
            for i in 0..=reach {
                for j in 0..=reach {
                    // Four quadrants; points on an axis belong to two, the origin to one.
                    let copies = f64::from(if i > 0 { 2u8 } else { 1 })
                        * f64::from(if j > 0 { 2u8 } else { 1 });
                    let (near, far) = (i.abs_diff(s), i + s);
                    // The point and its mirror image across the y axis.
                    sum[0] += copies
                        * 0.5
                        * irradiance(i, j)
                        * (irradiance(near, j) + irradiance(far, j));
                    let x = (at(i, j) * at(i, j)).conj() * (at(near, j) * at(far, j));
                    sum[1] += copies * x.re;
                    sum[2] += copies * x.im;
                }
            }
            values.push(sum);
        }
        let whole = values[0][0];
        values.iter_mut().flatten().for_each(|v| *v /= whole);
        Self {
            wavenumber_rad_m,
            range_m,
            step_m,
            values,
        }
    }

    /// Q, Re X, Im X at displacement `s_m`: even functions, so polynomials in its square.
    fn at(&self, s_m: f64) -> [f64; 3] {
        let t = s_m / self.step_m;
        if t >= (self.values.len() - 1) as f64 {
            return [0.0; 3];
        }
        let start = (t as usize).saturating_sub(2).min(self.values.len() - 6);
        let squares: [f64; 6] = std::array::from_fn(|i| ((start + i) as f64).powi(2));
        let mut out = [0.0; 3];
        for (i, values) in self.values[start..start + 6].iter().enumerate() {
            let weight = lagrange(&squares, i, t * t);
            out.iter_mut()
                .zip(values)
                .for_each(|(o, v)| *o += weight * v);
        }
        out
    }

    /// Q(s) - Re exp(-j kappa^2 (R - z) z/(k R)) X(s).
    fn bracket(&self, kappa: f64, z: f64) -> f64 {
        let rest = self.range_m - z;
        let [q, re, im] = self.at(kappa * rest / self.wavenumber_rad_m);
        let (sin, cos) =
            (kappa * kappa * rest * z / (self.wavenumber_rad_m * self.range_m)).sin_cos();
        q - (re * cos + im * sin)
    }

    /// Relative variance of the irradiance at the target, weighted with its square, for unit Cn2 dz
    /// at distance `z`.
    fn variance_of_layer(&self, spectrum: &dyn Spectrum, z: f64) -> f64 {
        let k = self.wavenumber_rad_m;
        let rest = self.range_m - z;
        // Wave numbers beyond which displaced copies do not meet, or the spectrum ends.
        let end = (k / rest * self.step_m * (self.values.len() - 1) as f64)
            .min(7.0 * spectrum.inner_wavenumber_rad_m());
        let late = rest * z / (k * self.range_m);
        // Below this the bracket is quadratic in kappa.
        let quadratic = (0.05 * k / rest * self.step_m)
            .min(0.1 / late.sqrt())
            .min(end);
        let curvature = self.bracket(quadratic, z) / (quadratic * quadratic);
        let rule = GaussLegendre::new(8);
        let density = |kappa: f64| kappa * spectrum.density_per_cn2(kappa);
        let mut sum = 0.0;
        let mut high = quadratic;
        for _ in 0..60 {
            sum += rule.composite(0.5 * high, high, 1, |kappa| {
                density(kappa) * curvature * kappa * kappa
            });
            high *= 0.5;
        }
        let mut low = quadratic;
        while low < end {
            // A third of an octave, or 4 rad of the delay.
            let next = (1.26 * low).min((low * low + 4.0 / late).sqrt()).min(end);
            // So late that the delay has averaged X away.
            sum += if low * low * late > 1000.0 {
                rule.composite(low, end, 1, |kappa| {
                    density(kappa) * self.at(kappa * rest / k)[0]
                })
            } else {
                rule.composite(low, next, 1, |kappa| {
                    density(kappa) * self.bracket(kappa, z)
                })
            };
            low = if low * low * late > 1000.0 { end } else { next };
        }
        8.0 * PI * PI * k * k * sum
    }
}

/// Field at the target on the quadrant of a lattice, `[i][j]`, 0 to `reach` steps along each axis.
fn lattice(telescope: &Telescope, range_m: f64, step_m: f64, reach: usize) -> Vec<Complex<f64>> {
    const FINER: f64 = 8.0;
    let end_m = step_m * (reach + 1) as f64 * std::f64::consts::SQRT_2;
    let field_per_m = field_per_m(telescope, range_m, end_m);
    let count = (end_m / step_m * FINER) as usize + 4;
    let radial: Vec<Complex<f64>> = (0..count)
        .map(|i| field_per_m(step_m / FINER * i as f64))
        .collect();
    let steps = (0..=reach).flat_map(|i| (0..=reach).map(move |j| (i as f64).hypot(j as f64)));
    steps.map(|steps| cubic(FINER * steps, &radial)).collect()
}

/// Value at `x` of the polynomial that is 1 at `node[j]` and 0 at the other nodes.
fn lagrange(node: &[f64], j: usize, x: f64) -> f64 {
    let mut product = 1.0;
    for (i, z) in node.iter().enumerate() {
        if i != j {
            product *= (x - z) / (node[j] - z);
        }
    }
    product
}

/// Cubic interpolation at `t` between the four neighbours in a table of values at 0, 1, 2, ...
fn cubic(t: f64, table: &[Complex<f64>]) -> Complex<f64> {
    let at = (t as usize).clamp(1, table.len() - 3);
    let nodes = [-1.0, 0.0, 1.0, 2.0];
    let near = table[at - 1..at + 3].iter().enumerate();
    near.map(|(j, v)| *v * lagrange(&nodes, j, t - at as f64))
        .sum()
}

mod tests {
    use super::*;
    use wakescope_optics::{Cn2Path, Focus, VonKarman};

    #[test]
    fn overlaps_of_a_gaussian_beam_are_gaussians() {
        // U = exp(-g w^2): Q = exp(-2 Re g ... ) in closed form. |U|^2 = exp(-2 a w^2), g = a +
        // jb: Q(s)/Q(0) = exp(-a s^2); X(s) = exp(-2 g s^2) integral of exp(-(2 g* + 2 g) w^2) =
        // exp(-2 g s^2) Q(0).
        let s = 0.02;
        let t = Telescope {
            aperture_radius_m: 0.2,
            beam_radius_m: s,
            focus: Focus::At(900.0),
            ..Telescope::table2()
        };
        let range_m = 1500.0;
        let k = t.wavenumber_rad_m();
        let overlaps = DisplacedOverlaps::new(&t, range_m);
        // Field at the aperture exp(-p r'^2), p = 1/(2 s^2) - j k (1/R - 1/F)/2; its transform is
        // exp(-(k/R)^2 r^2/(4p)).
        let (re, im) = (0.5 / (s * s), -0.5 * k * (1.0 / range_m - 1.0 / 900.0));
        let scale = (k / range_m).powi(2) / (4.0 * (re * re + im * im));
        let (a, b) = (scale * re, -scale * im);
        for d in [0.0f64, 0.003, 0.011, 0.03, 0.05] {
            let [q, x_re, x_im] = overlaps.at(d);
            assert!((q - (-a * d * d).exp()).abs() < 1e-6, "{d}: {q}");
            let size = (-2.0 * a * d * d).exp();
            assert!(
                (x_re - size * (2.0 * b * d * d).cos()).abs() < 1e-6,
                "{d}: {x_re}"
            );
            assert!(
                (x_im + size * (2.0 * b * d * d).sin()).abs() < 1e-6,
                "{d}: {x_im}"
            );
        }
    }

    #[test]
    fn wide_beam_has_the_rytov_variance_of_a_plane_wave_less_what_its_width_averages() {
        let turbulence = |spectrum| Turbulence {
            spectrum: std::sync::Arc::new(spectrum),
            cn2: Cn2Path::Uniform { cn2_m_m23: 1e-16 },
        };
        let t = Telescope {
            aperture_radius_m: 0.25,
            beam_radius_m: 0.08,
            ..Telescope::table2()
        };
        let weak = weak_turbulence_efficiency(&t, &turbulence(VonKarman::kolmogorov()), 1500.0);
        assert!(
            (weak.enhancement / weak.rytov_variance - 1.0).abs() < 0.03,
            "{weak:?}"
        );
        // In its focus the spot wanders and breaks up: far more.
        let focused = Telescope {
            focus: Focus::At(1500.0),
            ..t
        };
        let weak = weak_turbulence_efficiency(&focused, &turbulence(VonKarman::table2()), 1500.0);
        assert!(weak.enhancement > 3.0 * weak.rytov_variance, "{weak:?}");
    }
}
