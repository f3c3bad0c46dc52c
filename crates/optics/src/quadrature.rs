//! Gauss-Legendre rules, an adaptive integral built on them, and the interpolation of tables.
//!
//! Check: a rule of n nodes integrates polynomials of degree 2n - 1 exactly; the adaptive integral
//! reproduces closed forms to its tolerance.

use crate::Error;

/// Gauss-Legendre rule on \[-1, 1\].
#[derive(Debug, Clone)]
pub(crate) struct GaussLegendre {
    /// Nodes and weights.
    rule: Vec<(f64, f64)>,
}

impl GaussLegendre {
    /// The rule with `n` nodes, by Newton's iteration on the Legendre polynomial.
    pub(crate) fn new(n: usize) -> Self {
        let mut rule = vec![(0.0, 0.0); n];
        for i in 0..n.div_ceil(2) {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (p, d) = legendre(n, x);
                slope = d;
                let step = p / d;
                x -= step;
                if step.abs() < 1e-16 {
                    break;
                }
            }
            let w = 2.0 / ((1.0 - x * x) * slope * slope);
            rule[i] = (-x, w);
            rule[n - 1 - i] = (x, w);
        }
        Self { rule }
    }

    /// Integral of `f` from `a` to `b` with this rule once.
    pub(crate) fn integrate(&self, a: f64, b: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
        let middle = 0.5 * (a + b);
        let half = 0.5 * (b - a);
        let mut sum = 0.0;
        for (x, w) in &self.rule {
            sum += w * f(middle + half * x);
        }
        sum * half
    }

    /// Integral of `f` from `a` to `b` on `panels` equal panels.
    pub(crate) fn composite(
        &self,
        a: f64,
        b: f64,
        panels: usize,
        mut f: impl FnMut(f64) -> f64,
    ) -> f64 {
        let h = (b - a) / panels as f64;
        (0..panels)
            .map(|i| self.integrate(a + h * i as f64, a + h * (i + 1) as f64, &mut f))
            .sum()
    }

    /// Nodes and weights on `panels` equal panels of \[a, b\].
    pub(crate) fn on_panels(
        &self,
        a: f64,
        b: f64,
        panels: usize,
    ) -> impl Iterator<Item = (f64, f64)> + '_ {
        let h = (b - a) / panels as f64;
        (0..panels)
            .map(move |i| a + h * i as f64)
            .flat_map(move |low| self.mapped(low, low + h))
    }

    /// Nodes and weights mapped to \[a, b\].
    pub(crate) fn mapped(&self, a: f64, b: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        let middle = 0.5 * (a + b);
        let half = 0.5 * (b - a);
        self.rule
            .iter()
            .map(move |(x, w)| (middle + half * x, half * w))
    }
}

/// Legendre polynomial of degree n, 1 or more, and its derivative.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let mut p0 = 1.0;
    let mut p1 = x;
    for k in 2..=n {
        let k = k as f64;
        let p2 = ((2.0 * k - 1.0) * x * p1 - (k - 1.0) * p0) / k;
        p0 = p1;
        p1 = p2;
    }
    (p1, n as f64 * (x * p1 - p0) / (x * x - 1.0))
}

/// An interval of the adaptive integral.
struct Panel {
    start: f64,
    end: f64,
    /// Integral by one use of the rule.
    integral: f64,
    /// Number of halvings that led to it.
    depth: u32,
}

impl Panel {
    fn new(
        rule: &GaussLegendre,
        start: f64,
        end: f64,
        depth: u32,
        f: &mut dyn FnMut(f64) -> f64,
    ) -> Self {
        Self {
            start,
            end,
            integral: rule.integrate(start, end, f),
            depth,
        }
    }
}

/// Integral of `f` over consecutive intervals between `breaks`, each halved until the sum of two
/// halves equals the whole within the tolerance.
///
/// The tolerance is relative to the integral of |f| found on the first pass.
pub(crate) fn adaptive(
    rule: &GaussLegendre,
    breaks: &[f64],
    tolerance: f64,
    quantity: &'static str,
    f: &mut dyn FnMut(f64) -> f64,
) -> Result<f64, Error> {
    const DEEPEST: u32 = 12;
    let mut pending: Vec<Panel> = Vec::new();
    let mut scale = 0.0;
    for pair in breaks.windows(2) {
        let [start, end] = [pair[0], pair[1]];
        if end > start {
            let panel = Panel::new(rule, start, end, 0, f);
            scale += panel.integral.abs();
            pending.push(panel);
        }
    }
    let mut sum = 0.0;
    let mut missed = 0.0;
    while let Some(panel) = pending.pop() {
        // Halving a panel with a NaN would not end.
        if !scale.is_finite() {
            break;
        }
        let middle = 0.5 * (panel.start + panel.end);
        let left = Panel::new(rule, panel.start, middle, panel.depth + 1, f);
        let right = Panel::new(rule, middle, panel.end, panel.depth + 1, f);
        let halves = left.integral + right.integral;
        // The first panel may have missed a narrow peak: the scale grows with what is found.
        scale = if halves.abs() > scale || halves.is_nan() {
            halves.abs()
        } else {
            scale
        };
        let gap = (halves - panel.integral).abs();
        if gap <= tolerance * scale || panel.depth >= DEEPEST {
            if gap > tolerance * scale {
                missed += gap;
            }
            sum += halves;
            continue;
        }
        pending.push(right);
        pending.push(left);
    }
    // `<=` is false for NaN, so that a NaN integrand is an error and no result.
    if missed <= 100.0 * tolerance * scale && scale.is_finite() {
        Ok(sum)
    } else {
        Err(Error::Convergence {
            quantity,
            error: missed / scale,
            tolerance,
        })
    }
}

/// Value at `x` of the polynomial that is 1 at `node[j]` and 0 at the other nodes.
pub(crate) fn lagrange(node: &[f64], j: usize, x: f64) -> f64 {
    let mut product = 1.0;
    for (i, z) in node.iter().enumerate() {
        if i != j {
            product *= (x - z) / (node[j] - z);
        }
    }
    product
}

/// Cubic interpolation at `t` between the four neighbours in a table of values at 0, 1, 2, ...
#[cfg(feature = "screens")]
pub(crate) fn cubic(t: f64, table: &[f64]) -> f64 {
    let at = (t as usize).clamp(1, table.len() - 3);
    let u = t - at as f64;
    let a = u + 1.0;
    let b = u - 1.0;
    let c = u - 2.0;
    let weight = [
        -u * b * c / 6.0,
        a * b * c / 2.0,
        -a * u * c / 2.0,
        a * u * b / 6.0,
    ];
    weight
        .iter()
        .zip(&table[at - 1..])
        .map(|(w, v)| v * w)
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rule_is_exact_for_polynomials_up_to_twice_its_order() {
        for n in [1usize, 2, 5, 16, 20] {
            let rule = GaussLegendre::new(n);
            let degree = 2 * n as i32 - 1;
            let exact = 2f64.powi(degree + 1) / f64::from(degree + 1);
            let found = rule.integrate(0.0, 2.0, |x| x.powi(degree));
            assert!(
                (found / exact - 1.0).abs() < 1e-13,
                "n = {n}: {found} {exact}"
            );
        }
    }

    #[test]
    fn adaptive_integral_finds_a_narrow_peak() {
        let rule = GaussLegendre::new(16);
        let width = 1e-4;
        let found = adaptive(&rule, &[0.0, 1.0], 1e-12, "test", &mut |x| {
            1.0 / (1.0 + (x / width).powi(2))
        })
        .unwrap();
        let exact = width * (1.0 / width).atan();
        assert!((found / exact - 1.0).abs() < 1e-11, "{found} {exact}");
    }

    #[test]
    fn nan_integrand_is_an_error() {
        let rule = GaussLegendre::new(4);
        let error = adaptive(&rule, &[0.0, 1.0], 1e-9, "test", &mut |_| f64::NAN);
        assert!(matches!(
            error,
            Err(Error::Convergence {
                quantity: "test",
                ..
            })
        ));
    }
}
