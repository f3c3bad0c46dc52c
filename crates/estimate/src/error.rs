//! The one error type of this crate. Every variant carries the offending values and what is allowed.

/// Why an estimator could not be set up or applied.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A number lies outside what is allowed.
    #[error("{field} = {value:?}: must be {allowed}")]
    OutOfRange {
        /// Name of the field or parameter, with its unit suffix.
        field: &'static str,
        /// The value that was given.
        value: f64,
        /// What is allowed, in words.
        allowed: &'static str,
    },
    /// The detector band is empty, reversed or not contained in the spectrum of the samples.
    #[error("band_hz = ({low_hz:?}, {high_hz:?}): must be {allowed}")]
    Band {
        /// Lower edge \[Hz\].
        low_hz: f64,
        /// Upper edge \[Hz\].
        high_hz: f64,
        /// What is allowed, in words.
        allowed: &'static str,
    },
    /// The analysis window does not fit in the record.
    #[error(
        "window_samples = {window_samples} is longer than the record of {record_samples} samples: \
         shorten the window or record longer"
    )]
    WindowLongerThanRecord {
        /// Samples of one window.
        window_samples: usize,
        /// Samples of the record.
        record_samples: usize,
    },
    /// There is nothing to estimate from.
    #[error("{field} is empty: at least one is needed")]
    Empty {
        /// Name of the empty argument.
        field: &'static str,
    },
    /// An array has the wrong length.
    #[error("{field} has {found} elements, {expected} are needed")]
    Length {
        /// Name of the array.
        field: &'static str,
        /// Length that is needed.
        expected: usize,
        /// Length that was given.
        found: usize,
    },
    /// A matrix cannot be inverted or diagonalised.
    #[error("{what} of order {order} {reason}")]
    Linalg {
        /// Name of the matrix.
        what: &'static str,
        /// Its order.
        order: usize,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A covariance is so near a singular one that its inverse means nothing in double precision.
    #[error(
        "{what} of order {order} is too near a singular one: its reciprocal condition is {reciprocal_condition:.1e}, \
         at least {least:.1e} is needed: more noise against the signal, or a shorter window"
    )]
    IllConditioned {
        /// Name of the matrix.
        what: &'static str,
        /// Its order.
        order: usize,
        /// Smallest over largest eigenvalue.
        reciprocal_condition: f64,
        /// Least ratio that is accepted.
        least: f64,
    },
    /// The noise outside the detector band is too small for the covariance of a window to be inverted.
    #[error(
        "floor = {floor:?}: with so little noise outside the band the covariance of {window_samples} samples is singular \
         in double precision (reciprocal condition {reciprocal_condition:.1e}); a floor of at least {least:e} works here"
    )]
    NoiseFloor {
        /// Density of the noise outside the band over that inside.
        floor: f64,
        /// Samples of the window.
        window_samples: usize,
        /// Smallest over largest eigenvalue of the covariance.
        reciprocal_condition: f64,
        /// A floor just large enough, to two digits; it was tried.
        least: f64,
    },
    /// A fit did not converge.
    #[error(
        "the fit is not converged after {iterations} iterations, {sigmas_left:.2e} standard deviations are left: \
         start nearer, free fewer parameters or allow more iterations"
    )]
    NotConverged {
        /// Iterations that were done.
        iterations: usize,
        /// The step that is left, in standard deviations of the fit.
        sigmas_left: f64,
    },
    /// The velocity map shows no vortex pair.
    #[error(
        "no vortex pair found: the best one takes {statistic:.1} from the chi-square of the wind, at least {needed} is needed"
    )]
    NoVortex {
        /// Chi-square that the best pair takes from the wind.
        statistic: f64,
        /// Least one that is accepted.
        needed: f64,
    },
    /// Too few points of a map are finite.
    #[error("{found} of the map's velocities are finite, at least {needed} are needed")]
    TooFewVelocities {
        /// Finite velocities.
        found: usize,
        /// Least number that is accepted.
        needed: usize,
    },
}

/// Fails with `allowed` as the reason unless `is_allowed`.
pub(crate) fn check(
    field: &'static str,
    value: f64,
    allowed: &'static str,
    is_allowed: bool,
) -> Result<(), Error> {
    if is_allowed {
        Ok(())
    } else {
        Err(Error::OutOfRange {
            field,
            value,
            allowed,
        })
    }
}

/// Checks that a number is finite and positive.
pub(crate) fn positive(field: &'static str, value: f64) -> Result<(), Error> {
    check(
        field,
        value,
        "finite and above 0",
        value.is_finite() && value > 0.0,
    )
}

/// Checks that a number is finite.
pub(crate) fn finite(field: &'static str, value: f64) -> Result<(), Error> {
    check(field, value, "finite", value.is_finite())
}

/// Checks that a number is finite and not negative.
pub(crate) fn not_negative(field: &'static str, value: f64) -> Result<(), Error> {
    check(
        field,
        value,
        "finite and at least 0",
        value.is_finite() && value >= 0.0,
    )
}

/// Checks that there is at least one.
pub(crate) fn at_least_one(field: &'static str, count: usize) -> Result<(), Error> {
    check(field, 0.0, "at least 1", count > 0)
}

/// Checks that a number is the chance of something that may happen or not.
pub(crate) fn probability(field: &'static str, value: f64) -> Result<(), Error> {
    check(field, value, "between 0 and 1", value > 0.0 && value < 1.0)
}

/// Checks that an argument has elements.
pub(crate) fn not_empty(field: &'static str, count: usize) -> Result<(), Error> {
    if count > 0 {
        Ok(())
    } else {
        Err(Error::Empty { field })
    }
}

/// Checks that a fit or a test has the velocities that it needs.
pub(crate) fn enough_velocities(found: usize, needed: usize) -> Result<(), Error> {
    if found >= needed {
        Ok(())
    } else {
        Err(Error::TooFewVelocities { found, needed })
    }
}

/// Checks that finite numbers increase.
pub(crate) fn increasing(field: &'static str, numbers: &[f64]) -> Result<(), Error> {
    let late = numbers.windows(2).find(|pair| pair[1] <= pair[0]);
    late.map_or(Ok(()), |pair| check(field, pair[1], "increasing", false))
}

/// Checks the length of an array.
pub(crate) fn length(field: &'static str, expected: usize, found: usize) -> Result<(), Error> {
    if expected == found {
        Ok(())
    } else {
        Err(Error::Length {
            field,
            expected,
            found,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiny_and_huge_values_are_printed_in_few_digits() {
        let message = |value| {
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
            assert_eq!(message(value), format!("a_m = {text}: must be positive"));
        }
    }
}
