//! A number with its standard deviation.

/// A number with its standard deviation; NaN where that is not known.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Measured {
    /// The value.
    pub value: f64,
    /// Its standard deviation, in the same unit.
    pub std: f64,
}

impl Measured {
    /// A value without uncertainty.
    #[must_use]
    pub fn exact(value: f64) -> Self {
        Self { value, std: 0.0 }
    }

    /// The fraction of `hits` among `trials`, with its binomial standard error.
    #[must_use]
    pub fn share(hits: usize, trials: usize) -> Self {
        let value = hits as f64 / trials as f64;
        Self {
            value,
            std: (value * (1.0 - value) / trials as f64).sqrt(),
        }
    }

    /// Size of the value plus two standard deviations.
    #[must_use]
    pub fn bound(self) -> f64 {
        self.value.abs() + 2.0 * self.std
    }

    /// The product with an independent number, to first order in both deviations.
    #[must_use]
    pub fn times(self, other: Self) -> Self {
        let of_self = other.value * self.std;
        let of_other = other.std * self.value;
        Self {
            value: other.value * self.value,
            std: of_self.hypot(of_other),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_has_its_binomial_standard_error() {
        let share = Measured::share(90, 100);
        assert!((share.value - 0.9).abs() < 1e-15 && (share.std - 0.03).abs() < 1e-15);
    }

    #[test]
    fn relative_variances_of_a_product_add() {
        let product = Measured {
            value: -2.0,
            std: 0.06,
        }
        .times(Measured {
            value: 5.0,
            std: 0.2,
        });
        assert_eq!(product.value, -10.0);
        assert!((product.std - 0.5).abs() < 1e-15, "{product:?}");
        assert!((product.bound() - 11.0).abs() < 1e-14);
        assert_eq!(Measured::exact(3.0).bound(), 3.0);
    }
}
