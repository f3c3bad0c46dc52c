//! The one error type of the crate: each variant names the field, the value that was given and
//! what is allowed.

#[cfg(feature = "screens")]
use crate::plan::violation::{SetUp, Violation, listed};
use thiserror::Error;

/// Everything that can go wrong in this crate.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// A number lies outside its allowed interval, or is not a number.
    #[error("{field} = {value:?} is not allowed: {allowed}")]
    OutOfRange {
        /// Name of the field or parameter, with its unit suffix.
        field: &'static str,
        /// The value that was given.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// Two lists that belong together have different lengths.
    #[error("{field} has {found} entries, {expected} are needed")]
    Length {
        /// Name of the list.
        field: &'static str,
        /// Its length.
        found: usize,
        /// The length it must have.
        expected: usize,
    },
    /// A list that must increase strictly does not.
    #[error(
        "{field} must increase strictly, but entry {index} = {value:?} does not exceed the one before"
    )]
    NotIncreasing {
        /// Name of the list.
        field: &'static str,
        /// Index of the first offending entry.
        index: usize,
        /// The offending entry.
        value: f64,
    },
    /// A range lies outside an efficiency profile.
    #[error(
        "range {range_m:?} m lies outside the profile, which covers {first_m:?} m to {last_m:?} m: nothing is extrapolated"
    )]
    Extrapolation {
        /// The range \[m\].
        range_m: f64,
        /// First range of the profile \[m\].
        first_m: f64,
        /// Last range of the profile \[m\].
        last_m: f64,
    },
    /// A grid cannot hold the beam: every limit that it violates, and a set-up without violations.
    #[cfg(feature = "screens")]
    #[error("sampling: {}", listed(violations, would_do.as_ref()))]
    Sampling {
        /// The limits, one at least.
        violations: Vec<Violation>,
        /// A set-up that was tried and holds, if one of at most 16384 points does.
        would_do: Option<SetUp>,
    },
    /// Turbulence so strong that layers cannot be made thin enough.
    #[error("more than {most} layers are needed to keep the Rytov variance of each below 0.1")]
    TooManyLayers {
        /// The most that are tried.
        most: usize,
    },
    /// The absorbing border took so much power that the result means nothing.
    #[error(
        "the absorbing border took {fraction:.3} of the power before {range_m:?} m, 0.05 at most: use a wider grid"
    )]
    PowerLost {
        /// Range at which it was noticed \[m\].
        range_m: f64,
        /// Mean fraction of the power that was lost.
        fraction: f64,
    },
    /// Phase screens do not give the bistatic mean that is known exactly for them.
    #[error(
        "at {range_m:?} m the phase screens give a bistatic efficiency of {mean:.5} +- {standard_error:.5} where {exact:.5} is exact for \
         their layers: the grid does not carry the beam, take a smaller grid spacing with as many more points, or a derived grid"
    )]
    AgainstTheory {
        /// Range \[m\].
        range_m: f64,
        /// What the screens give.
        mean: f64,
        /// Its standard error.
        standard_error: f64,
        /// What is exact for them.
        exact: f64,
    },
    /// The caller's progress function asked to stop.
    #[error("cancelled after {realisations} realisations")]
    Cancelled {
        /// Realisations that were done.
        realisations: usize,
    },
    /// The beam has too many Fresnel zones for a quadrature.
    #[error(
        "the Fresnel number a^2 |1/R - 1/F| / lambda is {found:.4e} at {range_m:?} m, {largest:?} at most: the range must be nearer to \
         the focus, or the aperture smaller"
    )]
    FresnelNumber {
        /// Range at which it was found \[m\].
        range_m: f64,
        /// The Fresnel number there.
        found: f64,
        /// The largest that is allowed.
        largest: f64,
    },
    /// A quadrature did not reach its tolerance.
    #[error(
        "quadrature of {quantity} stopped at a relative error of {error:.1e}, {tolerance:.1e} was asked for"
    )]
    Convergence {
        /// What was integrated.
        quantity: &'static str,
        /// Estimated relative error when it stopped.
        error: f64,
        /// Required tolerance.
        tolerance: f64,
    },
}

/// `value` where it is `good`, else an error that names `field` and says what is `allowed`.
pub(crate) fn within(
    field: &'static str,
    value: f64,
    good: bool,
    allowed: &'static str,
) -> Result<f64, Error> {
    if good {
        Ok(value)
    } else {
        Err(Error::OutOfRange {
            field,
            value,
            allowed,
        })
    }
}

/// `value` when it is finite and positive, else an error that names `field`.
pub(crate) fn positive(field: &'static str, value: f64) -> Result<f64, Error> {
    within(
        field,
        value,
        value.is_finite() && value > 0.0,
        "a finite number above 0",
    )
}

/// `value` when it is finite and not negative, else an error that names `field`.
pub(crate) fn not_negative(field: &'static str, value: f64) -> Result<f64, Error> {
    within(
        field,
        value,
        value.is_finite() && value >= 0.0,
        "a finite number, 0 or above",
    )
}

/// `value` when it is finite, else an error that names `field`.
pub(crate) fn finite(field: &'static str, value: f64) -> Result<f64, Error> {
    within(field, value, value.is_finite(), "a finite number")
}

/// Nothing where a list has as many entries as it must, else an error that names `field`.
pub(crate) fn check_length(
    field: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), Error> {
    if found == expected {
        Ok(())
    } else {
        Err(Error::Length {
            field,
            found,
            expected,
        })
    }
}

/// The field that an error names.
#[cfg(test)]
pub(crate) fn refused<T>(result: Result<T, Error>) -> &'static str {
    match result.err() {
        Some(
            Error::OutOfRange { field, .. }
            | Error::Length { field, .. }
            | Error::NotIncreasing { field, .. },
        ) => field,
        other => panic!("a refusal by name, not {other:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiny_and_huge_values_are_told_in_few_digits() {
        let told = |value| {
            Error::OutOfRange {
                field: "a_m",
                value,
                allowed: "positive",
            }
            .to_string()
        };
        for (value, text) in [
            (1e-201, "1e-201"),
            (-3e300, "-3e300"),
            (0.5, "0.5"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(
                told(value),
                format!("a_m = {text} is not allowed: positive")
            );
        }
    }
}
