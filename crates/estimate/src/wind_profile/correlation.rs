//! Table of the correlations along and across a separation in turbulence with the spectrum of von Karman, for many separations.
//!
//! Check: the closed forms of [`VonKarman`].

use crate::turbulence::VonKarman;

/// Constant of the convention of all dissipation rates.
const KOLMOGOROV: f64 = 1.5;

/// Turbulence of a dissipation of 1 m²/s³.
pub(super) fn unit_turbulence(outer_scale_m: f64) -> VonKarman {
    VonKarman {
        dissipation_m2_s3: 1.0,
        outer_scale_m,
        kolmogorov_constant: KOLMOGOROV,
    }
}

/// Separations in outer scales beyond which there is no correlation: 1e-5 of the variance.
pub(super) const FARTHEST: f64 = 12.0;
/// Knots of the table.
const KNOTS: usize = 512;

/// Correlation along and across the separation, tabulated over w = x^(2/3), x the separation in outer scales, of which both are analytic.
#[derive(Debug, Clone)]
pub(super) struct Correlation {
    /// f = B_LL and g = B_LL - B_NN over the variance, each followed by its slope over one knot.
    knots: Vec<[f64; 4]>,
    knots_per_w: f64,
}

/// f and g at a separation in outer scales.
fn exact(x: f64) -> (f64, f64) {
    let air = unit_turbulence(1.0);
    let variance = air.variance_m2_s2();
    let (along, across) = air.covariances_m2_s2(x);
    (along / variance, (along - across) / variance)
}

impl Correlation {
    pub(super) fn new() -> Self {
        let step = FARTHEST.powf(2.0 / 3.0) / (KNOTS - 1) as f64;
        // Proportional to w at separations far below the outer scale.
        let near = 1e-4f64;
        let (f, g) = exact(near.powf(1.5));
        let mut knots = vec![[1.0, (f - 1.0) / near * step, 0.0, g / near * step]];
        for i in 1..=KNOTS {
            let w = step * i as f64;
            let x = w.powf(1.5);
            let (f, g) = exact(x);
            // x f' = -2 g of air without divergence, and g' by the derivatives of Bessel functions.
            let dx = 1.5 * w.sqrt() * step;
            let f_slope = -2.0 * g / x;
            let g_slope = 2.0 * g / (3.0 * x) - 0.5 * x * f;
            knots.push([f, f_slope * dx, g, g_slope * dx]);
        }
        Self {
            knots,
            knots_per_w: step.recip(),
        }
    }

    /// f and g at w = (r/L)^(2/3); 0 from 12 L on.
    #[inline]
    pub(super) fn at(&self, w: f64) -> (f64, f64) {
        let knot = w * self.knots_per_w;
        let index = knot as usize;
        if index + 1 >= KNOTS {
            return (0.0, 0.0);
        }
        let t = knot - index as f64;
        let low = &self.knots[index];
        let high = &self.knots[index + 1];
        let u = 1.0 - t;
        let value_low = u * u * (1.0 + 2.0 * t);
        let value_high = t * t * (1.0 + 2.0 * u);
        let slope_low = u * u * t;
        let slope_high = -t * t * u;
        let values = [value_low, slope_low, value_high, slope_high];
        let f = [low[0], low[1], high[0], high[1]];
        let g = [low[2], low[3], high[2], high[3]];
        (weighted(values, f), weighted(values, g))
    }
}

#[inline]
fn weighted(weights: [f64; 4], values: [f64; 4]) -> f64 {
    weights[0] * values[0]
        + weights[1] * values[1]
        + weights[2] * values[2]
        + weights[3] * values[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_follows_the_closed_forms_to_a_billionth() {
        let table = Correlation::new();
        assert_eq!(table.at(0.0), (1.0, 0.0));
        for i in 1..1000 {
            let x = (f64::from(i) * 1e-3).powi(3) * 11.9;
            let (f, g) = table.at(x.powf(2.0 / 3.0));
            let (f_exact, g_exact) = exact(x);
            assert!((f - f_exact).abs() < 1e-9, "{x}: {f} {f_exact}");
            assert!((g - g_exact).abs() < 1e-9, "{x}: {g} {g_exact}");
        }
    }
}
