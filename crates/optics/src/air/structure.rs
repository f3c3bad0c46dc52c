//! Phase structure function of a thin layer, by quadrature of its spectrum.
//!
//! D(r) = k^2 Cn2 dz G(r), G(r) = 8 pi^2 integral of kappa Phi_n/Cn2 (1 - J0(kappa r))
//! dkappa \[m^(5/3)\]. Check: the stored curve of (17) to 1e-9, and 2.914 r^(5/3) for
//! Kolmogorov's spectrum.

use crate::Error;
use crate::air::spectrum::Spectrum;
use crate::error::not_negative;
use crate::quadrature::{GaussLegendre, lagrange};
use std::f64::consts::PI;

/// Beyond this argument the oscillating part of the integral is below 1e-10 of the whole.
const LAST_OSCILLATION: f64 = 1200.0;

/// G(r) \[m^(5/3)\] at separation `separation_m`: structure function per unit k^2 Cn2 dz.
///
/// # Errors
/// [`Error::OutOfRange`] for a negative separation or one that is not a number.
pub fn structure_function_m53(spectrum: &dyn Spectrum, separation_m: f64) -> Result<f64, Error> {
    let r = not_negative("separation_m", separation_m)?;
    if r == 0.0 {
        return Ok(0.0);
    }
    let rule = GaussLegendre::new(16);
    let outer = spectrum.outer_wavenumber_rad_m();
    let inner = spectrum.inner_wavenumber_rad_m();
    let end = if inner.is_finite() {
        7.0 * inner
    } else {
        1e12 / r
    };
    // Without an outer scale the integrand falls as kappa^(-2/3) dkappa towards 0: 1e-39 of the
    // scale is 1e-13 of it.
    let start = if outer > 0.0 {
        1e-8 * outer.min(1.0 / r).min(end)
    } else {
        1e-39 / r
    };
    let smooth_end = (4.0 / r).min(end);
    let density = |kappa: f64| kappa * spectrum.density_per_cn2(kappa);
    let integrand = |kappa: f64| density(kappa) * one_minus_j0(kappa * r);
    let mut sum = logarithmic(&rule, start, smooth_end, integrand);
    let wave_end = (LAST_OSCILLATION / r).min(end);
    if wave_end > smooth_end {
        let panels = 1 + ((wave_end - smooth_end) * r / 6.0) as usize;
        sum += rule.composite(smooth_end, wave_end, panels, integrand);
    }
    if end > wave_end {
        sum += logarithmic(&rule, wave_end, end, density);
    }
    Ok(8.0 * PI * PI * sum)
}

/// Integral over \[a, b\] on panels equal in the logarithm, three to a decade.
fn logarithmic(rule: &GaussLegendre, a: f64, b: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
    if b <= a {
        return 0.0;
    }
    let panels = 1 + (3.0 * (b / a).log10()) as usize;
    rule.composite(a.ln(), b.ln(), panels, |t| {
        let kappa = t.exp();
        kappa * f(kappa)
    })
}

/// 1 - J0(x) without cancellation.
pub(crate) fn one_minus_j0(x: f64) -> f64 {
    if x > 0.3 {
        return 1.0 - libm::j0(x);
    }
    let q = 0.25 * x * x;
    q * (1.0 - q / 4.0 * (1.0 - q / 9.0 * (1.0 - q / 16.0)))
}

/// G(r) tabulated once: 6-point interpolation in the logarithms, relative error below 1e-6
/// (see the test).
#[derive(Debug, Clone)]
pub struct StructureTable {
    first_ln: f64,
    step_ln: f64,
    ln_value: Vec<f64>,
}

impl StructureTable {
    const PER_DECADE: f64 = 16.0;
    const SMALLEST_M: f64 = 1e-5;
    const LARGEST_M: f64 = 10.0;
    /// Of the interpolation, in steps.
    const NODES: [f64; 6] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];

    /// Table of `spectrum` for separations of 0.01 mm to 10 m; power laws continue it at both ends.
    pub fn new(spectrum: &dyn Spectrum) -> Self {
        let step_ln = std::f64::consts::LN_10 / Self::PER_DECADE;
        let first_ln = Self::SMALLEST_M.ln();
        let n = ((Self::LARGEST_M / Self::SMALLEST_M).ln() / step_ln).round() as usize + 1;
        let mut ln_value = Vec::with_capacity(n);
        for i in 0..n {
            let r = (first_ln + step_ln * i as f64).exp();
            ln_value.push(structure_function_m53(spectrum, r).unwrap_or(f64::NAN).ln());
        }
        Self {
            first_ln,
            step_ln,
            ln_value,
        }
    }

    /// G(r) \[m^(5/3)\] at `separation_m` >= 0.
    pub fn at(&self, separation_m: f64) -> f64 {
        if separation_m <= 0.0 {
            return 0.0;
        }
        let n = self.ln_value.len();
        let t = (separation_m.ln() - self.first_ln) / self.step_ln;
        if t < 0.0 {
            return (self.ln_value[0] + t * (self.ln_value[1] - self.ln_value[0])).exp();
        }
        if t > (n - 1) as f64 {
            let slope = self.ln_value[n - 1] - self.ln_value[n - 2];
            return (self.ln_value[n - 1] + (t - (n - 1) as f64) * slope).exp();
        }
        let start = (t as usize).saturating_sub(2).min(n - 6);
        let near = self.ln_value[start..start + 6].iter().enumerate();
        near.map(|(i, value)| lagrange(&Self::NODES, i, t - start as f64) * value)
            .sum::<f64>()
            .exp()
    }

    /// Structure function D(rho) \[rad^2\] of two spherical waves from `range_m` that are rho apart
    /// at the telescope: k^2 times the sum of w G(rho (1 - z/R)) over positions z \[m\] with
    /// weights w = Cn2 dz \[m^(1/3)\].
    pub(crate) fn of_spherical_waves(
        &self,
        wavenumber_rad_m: f64,
        range_m: f64,
        places: impl IntoIterator<Item = (f64, f64)>,
    ) -> impl Fn(f64) -> f64 {
        let k2 = wavenumber_rad_m.powi(2);
        let weights: Vec<_> = places
            .into_iter()
            .map(|(z, w)| (1.0 - z / range_m, k2 * w))
            .collect();
        move |rho| weights.iter().map(|(g, w)| w * self.at(rho * g)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::air::spectrum::{EXACT_CONSTANT, VonKarman};

    #[test]
    fn kolmogorov_gives_the_five_thirds_law() {
        // 8 pi^2 C integral of x^(-8/3) (1 - J0(x)) dx = 8 pi^2 C (3/5) Gamma(1/6) / (2^(5/3)
        // Gamma(11/6)) r^(5/3).
        let constant = 8.0 * PI * PI * EXACT_CONSTANT * 0.6 * libm::tgamma(1.0 / 6.0)
            / (2f64.powf(5.0 / 3.0) * libm::tgamma(11.0 / 6.0));
        assert!((constant - 2.914).abs() < 1e-3);
        for r in [1e-4f64, 0.01, 1.0] {
            let g = structure_function_m53(&VonKarman::kolmogorov(), r).unwrap();
            let exact = constant * r.powf(5.0 / 3.0);
            assert!((g / exact - 1.0).abs() < 1e-9, "{r}: {}", g / exact - 1.0);
        }
    }

    #[test]
    fn table_follows_the_quadrature() {
        for spectrum in [
            VonKarman::table2(),
            VonKarman::kolmogorov(),
            VonKarman::new(0.05, 0.004, 0.033).unwrap(),
        ] {
            let table = StructureTable::new(&spectrum);
            for i in 0..60 {
                let r = 2.3e-5 * 10f64.powf(f64::from(i) * 0.09);
                let exact = structure_function_m53(&spectrum, r).unwrap();
                let error = table.at(r) / exact - 1.0;
                assert!(error.abs() < 1e-6, "{spectrum:?} {r}: {error}");
            }
        }
    }
}
