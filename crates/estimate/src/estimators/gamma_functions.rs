//! Gamma functions for tests against noise.
//!
//! Computes ln Gamma by Stirling's series behind the recurrence, and the incomplete gamma function by its series or
//! Lentz's continued fraction (Press et al. 2007, section 6.2). Check: factorials, and sums of Poisson's law.

/// ln Gamma(x) for x > 0, to 1e-12.
pub(crate) fn ln_gamma(x: f64) -> f64 {
    let (mut x, mut shift) = (x, 0.0);
    while x < 10.0 {
        shift -= x.ln();
        x += 1.0;
    }
    let inverse = x.recip();
    let square = inverse * inverse;
    let series = inverse * (1.0 / 12.0 - square * (1.0 / 360.0 - square * (1.0 / 1260.0 - square / 1680.0)));
    shift + (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + series
}

/// Probability that a gamma variable of shape `a` and scale 1 exceeds `x`, both above 0.
pub(crate) fn gamma_tail(a: f64, x: f64) -> f64 {
    let factor = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        // x^a e^-x / Gamma(a) (1/a + x/(a (a+1)) + ...)
        let (mut term, mut sum, mut divisor) = (a.recip(), a.recip(), a);
        while term > 1e-16 * sum {
            divisor += 1.0;
            term *= x / divisor;
            sum += term;
        }
        return 1.0 - factor * sum;
    }
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (1e300, b.recip());
    let mut fraction = d;
    // some roots of the shape, at worst
    for i in 1..100_000 {
        let i = f64::from(i);
        b += 2.0;
        let step = -i * (i - a);
        d = (step * d + b).recip();
        c = b + step / c;
        let change = d * c;
        fraction *= change;
        if (change - 1.0).abs() < 1e-15 {
            break;
        }
    }
    factor * fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gamma_of_whole_and_half_numbers() {
        let mut factorial = 1.0_f64;
        for n in 1..30 {
            assert!((ln_gamma(f64::from(n)) - factorial.ln()).abs() < 1e-11, "{n}");
            factorial *= f64::from(n);
        }
        assert!((ln_gamma(0.5) - 0.5 * std::f64::consts::PI.ln()).abs() < 1e-12);
        assert!((ln_gamma(0.01) - 4.599_479_878_042_022).abs() < 1e-11);
    }

    #[test]
    fn gamma_tails_are_sums_of_poissons_law() {
        // a whole shape is waited for longer than x if fewer than that many events happen meanwhile
        for (a, x) in [(1_u32, 4.6_f64), (3, 0.5), (7, 12.0), (40, 30.0), (40, 90.0), (100, 100.0)] {
            let term = |k: u32| (f64::from(k) * x.ln() - x - ln_gamma(f64::from(k) + 1.0)).exp();
            let expected: f64 = (0..a).map(term).sum();
            let found = gamma_tail(f64::from(a), x);
            assert!((found / expected - 1.0).abs() < 1e-10, "{a} {x}: {found} {expected}");
        }
        assert!((gamma_tail(1e6, 1e6) - 0.5).abs() < 1e-3);
    }
}
