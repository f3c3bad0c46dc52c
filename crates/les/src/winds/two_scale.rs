//! The two-scale profile of a rolled-up wake: a viscous core inside a broad distribution of circulation.
//!
//! `Gamma(r) = Gamma0 [1 - exp(-q)]`, `q = beta_i (r/b)^2/{1 + [(beta_i/beta_o) (r/b)^(5/4)]^3}^(1/3)` with the wing span `b` and
//! `beta_o` = 10 (Winckelmans; Gerz, Holzaepfel and Darracq 2002). Near the centre it is a Lamb-Oseen core, far away
//! `q = beta_o (r/b)^(3/4)`: a fifth of the circulation lies further out than a twelfth of the span, a third
//! further out than an eighteenth.
//!
//! Check: the largest velocity is at the core radius; both limits of `q`.

use crate::error::{Error, check};

/// `beta_o`: the outer scale.
const OUTER: f64 = 10.0;
/// Power that joins the two parts.
const POWER: f64 = 3.0;

/// The parameters of a two-scale profile in units of its core radius; made by [`TwoScale::new`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoScale {
    /// `beta_i (r_c/b)^2`.
    inner: f64,
    /// `(beta_i/beta_o) (r_c/b)^(5/4)`.
    joint: f64,
}

impl TwoScale {
    /// The profile whose largest tangential velocity is at `r_c = b/span_over_core`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless the ratio is from 5 to 1000.
    pub fn new(span_over_core: f64) -> Result<Self, Error> {
        check("span_over_core", span_over_core, "from 5 to 1000", |r| (5.0..=1000.0).contains(&r))?;
        let of =
            |inner: f64| Self { inner, joint: inner * span_over_core.powi(2) / OUTER * span_over_core.powf(-1.25) };
        // The velocity grows with r at the core radius while r q' > exp(q) - 1; the stronger the core, the less.
        let (mut low, mut high) = (1e-6_f64, 1e3_f64);
        for _ in 0..200 {
            let middle = (low * high).sqrt();
            let (q, slope) = of(middle).exponent(1.0);
            if slope > q.exp_m1() {
                low = middle;
            } else {
                high = middle;
            }
        }
        Ok(of(low))
    }

    /// `q` and `r dq/dr` at the squared distance `s2` in core radii.
    pub(crate) fn exponent(&self, s2: f64) -> (f64, f64) {
        let outer = (self.joint * s2.powf(0.625)).powf(POWER);
        let q = self.inner * s2 / (1.0 + outer).powf(1.0 / POWER);
        (q, q * (2.0 - 1.25 * outer / (1.0 + outer)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn core_and_far_field_have_their_own_scales() {
        for span in [15.0, 40.0] {
            let profile = TwoScale::new(span).unwrap();
            let (near, slope) = profile.exponent(1e-6);
            assert!((near / (profile.inner * 1e-6) - 1.0).abs() < 1e-6 && (slope / near - 2.0).abs() < 1e-6);
            let far = 30.0 * span;
            let (q, slope) = profile.exponent(far * far);
            assert!((q / (10.0 * (far / span).powf(0.75)) - 1.0).abs() < 1e-3, "{q}");
            assert!((slope / q - 0.75).abs() < 1e-3);
            let velocity = |s: f64| -(-profile.exponent(s * s).0).exp_m1() / s;
            assert!(velocity(1.0) > velocity(0.998) && velocity(1.0) > velocity(1.002));
        }
        // With the constants of the literature, beta_i = 500, the core is 4.1 % of the span.
        let usual = |core_over_span: f64| TwoScale::new(core_over_span.recip()).unwrap().inner / core_over_span.powi(2);
        assert!(usual(0.0405) > 500.0 && usual(0.0415) < 500.0, "{} {}", usual(0.0405), usual(0.0415));
        // What lies beyond a part of the span.
        let beyond = |span: f64, part: f64| (-TwoScale::new(span).unwrap().exponent((part * span).powi(2)).0).exp();
        for span in [25.0, 33.0, 40.0] {
            assert!(
                (beyond(span, 1.0 / 12.0) - 0.215).abs() < 0.01 && (beyond(span, 1.0 / 18.0) - 0.333).abs() < 0.025
            );
        }
        assert!(TwoScale::new(1.0).is_err() && TwoScale::new(f64::NAN).is_err());
    }
}
