//! Gauss-Legendre quadrature for the oracles.

/// Nodes and weights of a Gauss-Legendre rule on \[-1, 1\].
pub(super) struct GaussLegendre {
    rule: Vec<(f64, f64)>,
}

impl GaussLegendre {
    /// The rule with `n` nodes, by Newton's iteration on the Legendre polynomial.
    pub(super) fn new(n: usize) -> Self {
        let rule = (0..n)
            .map(|i| {
                let guess = std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5);
                let mut x = guess.cos();
                let mut slope = 1.0;
                for _ in 0..20 {
                    let (p, derivative) = legendre(n, x);
                    slope = derivative;
                    x -= p / derivative;
                }
                (x, 2.0 / ((1.0 - x * x) * slope * slope))
            })
            .collect();
        Self { rule }
    }

    /// Nodes and weights on `panels` equal panels of \[a, b\].
    pub(super) fn on_panels(&self, a: f64, b: f64, panels: usize) -> Vec<(f64, f64)> {
        let half = 0.5 * (b - a) / panels as f64;
        let mut nodes = Vec::with_capacity(panels * self.rule.len());
        for panel in 0..panels {
            let middle = a + half * (2 * panel + 1) as f64;
            for (x, w) in &self.rule {
                nodes.push((middle + half * x, half * w));
            }
        }
        nodes
    }

    /// Integral of `f` from `a` to `b` on `panels` equal panels.
    pub(super) fn composite(&self, a: f64, b: f64, panels: usize, f: impl Fn(f64) -> f64) -> f64 {
        let nodes = self.on_panels(a, b, panels);
        nodes.iter().map(|(x, w)| w * f(*x)).sum()
    }
}

/// Legendre polynomial of degree `n`, 1 or more, and its derivative.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let mut before = 1.0;
    let mut p = x;
    for k in 2..=n {
        let k = k as f64;
        let next = ((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k;
        before = p;
        p = next;
    }
    (p, n as f64 * (x * p - before) / (x * x - 1.0))
}
