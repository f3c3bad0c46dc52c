//! Integrals of f(x) cos(kappa x) under an arc of the aperture's edge by steepest descent,
//! for large kappa.
//!
//! f(x) = exp(-x^2/s^2) integral of exp(-y^2/s^2) from -h(x) to h(x), h^2 = p^2 - (x -
//! centre)^2, is analytic but for the square roots where the arc meets the axis. The path of
//! integration can therefore leave each end of the interval straight into the upper half plane,
//! where exp(j kappa x) decays: one Gauss-Laguerre rule at each end, however many waves lie
//! between. Check: against Gauss-Legendre panels where both hold; the complex error function on
//! the real axis and by its symmetry.

use num_complex::Complex;
use std::f64::consts::PI;
use std::sync::LazyLock;

type C = Complex<f64>;

/// Waves (rad) that must lie between the ends of an interval, and within a 1/e radius, for the
/// rules to have converged.
const LEAST_RAD: f64 = 60.0;
/// Nodes of a rule.
const NODES: usize = 16;

/// Rules for integrals from 0 to infinity with the weights exp(-t) and sqrt(t) exp(-t), for ends
/// away from and at the end of an arc.
static REGULAR: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| laguerre(NODES, 0.0));
static BRANCH: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| laguerre(NODES, 0.5));

/// An arc of radius `radius_m` about `centre_m` on the axis, over part of the axis, and the 1/e
/// radius of the light.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arc {
    pub(crate) centre_m: f64,
    pub(crate) radius_m: f64,
    pub(crate) intensity_radius_m: f64,
}

impl Arc {
    /// Integral of f(x) cos(kappa x) from `low` to `high` under the arc; none where kappa is too
    /// small for the rules.
    pub(crate) fn integral(self, low: f64, high: f64, kappa: f64) -> Option<f64> {
        let kappa = kappa.abs();
        if kappa * (high - low).min(self.intensity_radius_m) < LEAST_RAD {
            return None;
        }
        let at_low = self.descent_from(low, kappa)?;
        let at_high = self.descent_from(high, kappa)?;
        Some((at_low - at_high).re)
    }

    /// Integral of f(x) exp(j kappa x) from `at` to `at` + j infinity.
    fn descent_from(self, at: f64, kappa: f64) -> Option<C> {
        let offset = at - self.centre_m;
        let to_branch = self.radius_m - offset.abs();
        let is_branch = to_branch <= 1e-13 * self.radius_m;
        if !is_branch && kappa * to_branch < LEAST_RAD {
            return None;
        }
        let rule = if is_branch { &BRANCH } else { &REGULAR };
        // h^2 = p^2 - (offset + j t)^2; at a branch p^2 - offset^2 is 0 and h is sqrt(t) times a
        // smooth function.
        let on_axis = if is_branch {
            0.0
        } else {
            (self.radius_m - offset) * (self.radius_m + offset)
        };
        let mut sum = C::new(0.0, 0.0);
        for &(node, weight) in rule.iter() {
            let t = node / kappa;
            let half = C::new(on_axis + t * t, -2.0 * offset * t).sqrt();
            let value = self.chord(C::new(at, t), half);
            let weight = if is_branch {
                weight / node.sqrt()
            } else {
                weight
            };
            sum += value * weight;
        }
        Some(C::new(0.0, 1.0 / kappa) * C::cis(kappa * at) * sum)
    }

    /// exp(-x^2/s^2) times the integral of exp(-y^2/s^2) from -half to half.
    fn chord(self, x: C, half: C) -> C {
        let s = self.intensity_radius_m;
        if s.is_infinite() {
            return half * 2.0;
        }
        let u = x / s;
        (-u * u).exp() * erf(half / s) * (s * PI.sqrt())
    }
}

/// Error function for a positive real part.
fn erf(z: C) -> C {
    let z2 = z * z;
    if z.norm_sqr() < 12.0 {
        // 2/sqrt(pi) z exp(-z^2) sum of (2 z^2)^n/(1 3 5 ... (2n + 1)).
        let mut term = C::new(1.0, 0.0);
        let mut sum = term;
        for n in 1..200 {
            term *= z2 * (2.0 / f64::from(2 * n + 1));
            sum += term;
            if term.norm_sqr() < 1e-34 * sum.norm_sqr() {
                break;
            }
        }
        return z * (-z2).exp() * sum * (2.0 / PI.sqrt());
    }
    // 1 - erfc by its continued fraction.
    let mut fraction = z;
    for n in (1..40).rev() {
        fraction = z + C::new(0.5 * f64::from(n), 0.0) / fraction;
    }
    C::new(1.0, 0.0) - (-z2).exp() / (fraction * PI.sqrt())
}

/// Nodes and weights of the Gauss rule with weight t^alpha exp(-t) on 0 to infinity, alpha 0 or
/// 1/2, by Newton's iteration.
fn laguerre(n: usize, alpha: f64) -> Vec<(f64, f64)> {
    let count = n as f64;
    let scale = libm::tgamma(count + alpha) / libm::tgamma(count);
    let mut out: Vec<(f64, f64)> = Vec::with_capacity(n);
    let mut x = (1.0 + alpha) * (3.0 + 0.92 * alpha) / (1.0 + 2.4 * count + 1.8 * alpha);
    for i in 0..n {
        // First guesses after Stroud and Secrest.
        if i == 1 {
            x += (15.0 + 6.25 * alpha) / (1.0 + 0.9 * alpha + 2.5 * count);
        } else if i > 1 {
            let k = (i - 1) as f64;
            let stretch = (1.0 + 2.55 * k) / (1.9 * k) + 1.26 * k * alpha / (1.0 + 3.5 * k);
            x += stretch * (x - out[i - 2].0) / (1.0 + 0.3 * alpha);
        }
        let mut slope = 1.0;
        for _ in 0..50 {
            let (value, before) = laguerre_polynomials(n, alpha, x);
            slope = (count * value - (count + alpha) * before) / x;
            let step = value / slope;
            x -= step;
            if step.abs() < 1e-15 * x {
                break;
            }
        }
        let (_, before) = laguerre_polynomials(n, alpha, x);
        out.push((x, -scale / (slope * before * count)));
    }
    out
}

/// Generalised Laguerre polynomials of degrees `n` and `n` - 1 at `x`.
fn laguerre_polynomials(n: usize, alpha: f64, x: f64) -> (f64, f64) {
    let mut before = 0.0;
    let mut current = 1.0;
    for k in 0..n {
        let k = k as f64;
        let next = ((2.0 * k + 1.0 + alpha - x) * current - (k + alpha) * before) / (k + 1.0);
        before = current;
        current = next;
    }
    (current, before)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::GaussLegendre;

    #[test]
    fn rules_are_exact_for_polynomials() {
        for alpha in [0.0, 0.5] {
            for power in [0, 1, 7, 20, 31] {
                let found: f64 = laguerre(NODES, alpha)
                    .iter()
                    .map(|(x, w)| w * x.powi(power))
                    .sum();
                let exact = libm::tgamma(f64::from(power) + alpha + 1.0);
                assert!(
                    (found / exact - 1.0).abs() < 1e-11,
                    "{alpha} {power}: {found:e} {exact:e}"
                );
            }
        }
    }

    #[test]
    fn error_function_is_the_real_one_on_the_axis_and_continuous_between_its_forms() {
        for x in [1e-3, 0.4, 1.7, 3.4, 3.5, 6.0] {
            let found = erf(C::new(x, 0.0));
            assert!(
                (found.re - libm::erf(x)).abs() < 1e-14 && found.im == 0.0,
                "{x}: {found}"
            );
        }
        // The derivative 2/sqrt(pi) exp(-z^2) across the circle where the form changes.
        for angle in [0.2, 0.5] {
            let z = C::from_polar(12f64.sqrt(), angle);
            let d = z * 1e-4;
            let slope = (erf(z + d) - erf(z - d)) / (d * 2.0);
            let exact = (-z * z).exp() * (2.0 / PI.sqrt());
            assert!(
                (slope / exact - 1.0).norm() < 1e-5,
                "{angle}: {slope} {exact}"
            );
        }
    }

    #[test]
    fn descent_agrees_with_panels_where_both_hold() {
        let rule = GaussLegendre::new(20);
        for s in [0.012, 0.03, f64::INFINITY] {
            let arc = Arc {
                centre_m: -0.007,
                radius_m: 0.05,
                intensity_radius_m: s,
            };
            // From inside to the end of the arc, and the whole disc.
            for (low, high) in [(0.004, 0.043), (-0.057, 0.043), (-0.057, 0.01)] {
                for kappa in [8e3, 3e4] {
                    let middle = 0.5 * (low + high);
                    let half = 0.5 * (high - low);
                    let panels = rule.composite(-0.5 * PI, 0.5 * PI, 800, |theta: f64| {
                        let x = middle + half * theta.sin();
                        let y = (0.05f64.powi(2) - (x + 0.007).powi(2)).max(0.0).sqrt();
                        half * theta.cos()
                            * arc.chord(C::new(x, 0.0), C::new(y, 0.0)).re
                            * (kappa * x).cos()
                    });
                    let found = arc.integral(low, high, kappa).unwrap();
                    // Against the size of the integrand: what an efficiency needs.
                    assert!(
                        (found - panels).abs() < 1e-13 * (high - low),
                        "{s} {low} {kappa}: {found} {panels}"
                    );
                }
            }
            assert!(arc.integral(0.004, 0.043, 1e3).is_none());
        }
    }
}
