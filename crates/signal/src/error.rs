//! The error type of the crate.

/// Error in the input of a simulation of signals. Every variant has the value found and the
/// values allowed.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A number is outside its range, or is not finite.
    #[error("{field} = {value:?}: must be {allowed}")]
    OutOfRange {
        /// Name of the field or parameter, with its unit suffix.
        field: &'static str,
        /// The value found.
        value: f64,
        /// The values that are allowed, in words.
        allowed: &'static str,
    },
    /// One element of a list is outside its range.
    #[error("{field}[{index}] = {value:?}: must be {allowed}")]
    ElementOutOfRange {
        /// Name of the list, with its unit suffix.
        field: &'static str,
        /// Index of the element.
        index: usize,
        /// The value found.
        value: f64,
        /// The values that are allowed, in words.
        allowed: &'static str,
    },
    /// Two slices that go together differ in length.
    #[error("{field} has {found} elements: must have {expected}")]
    LengthMismatch {
        /// Name of the slice.
        field: &'static str,
        /// Its length.
        found: usize,
        /// The length it must have.
        expected: usize,
    },
    /// A list that must hold something is empty.
    #[error("{field} is empty")]
    Empty {
        /// Name of the list.
        field: &'static str,
    },
    /// A sum is too large for a number of double precision.
    #[error("{field}[{index}] overflows: lower weight_per_m, energy_j or local_oscillator_w")]
    Overflow {
        /// Name of the result.
        field: &'static str,
        /// Index of its first element that overflows.
        index: usize,
    },
    /// The covariance of the samples of a record cannot be that of any signal.
    #[error("the covariance of the record is not positive definite at sample {sample}")]
    NotPositiveDefinite {
        /// Index of a sample whose variance, given others, is negative.
        sample: usize,
    },
    /// The detector band does not fit between zero and half the sampling rate.
    #[error(
        "the detector band {low_hz:?} to {high_hz:?} Hz (intermediate_frequency_hz -+ bandwidth_hz/2) \
         must lie between 0 and half the sampling rate, {nyquist_hz} Hz"
    )]
    BandBeyondNyquist {
        /// Lower edge of the band.
        low_hz: f64,
        /// Upper edge of the band.
        high_hz: f64,
        /// Half the sampling rate.
        nyquist_hz: f64,
    },
}

/// `value` if it is finite and `accept` holds, else [`Error::OutOfRange`].
pub(crate) fn check(
    field: &'static str,
    value: f64,
    allowed: &'static str,
    accept: impl Fn(f64) -> bool,
) -> Result<(), Error> {
    if value.is_finite() && accept(value) {
        Ok(())
    } else {
        Err(Error::OutOfRange {
            field,
            value,
            allowed,
        })
    }
}

/// A finite number above zero, or [`Error::OutOfRange`].
pub(crate) fn check_positive(field: &'static str, value: f64) -> Result<(), Error> {
    check(field, value, "finite and positive", |v| v > 0.0)
}

/// A slice of the expected length, or [`Error::LengthMismatch`].
pub(crate) fn check_length(
    field: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), Error> {
    if found == expected {
        Ok(())
    } else {
        Err(Error::LengthMismatch {
            field,
            found,
            expected,
        })
    }
}

/// As many elements as there must be of what needs one, or [`Error::Empty`].
pub(crate) fn check_any(field: &'static str, found: usize) -> Result<(), Error> {
    if found > 0 {
        Ok(())
    } else {
        Err(Error::Empty { field })
    }
}

/// Elements that `accept` holds for, or [`Error::ElementOutOfRange`] with the first of
/// which it does not.
pub(crate) fn check_each(
    field: &'static str,
    values: &[f64],
    allowed: &'static str,
    accept: impl Fn(f64) -> bool,
) -> Result<(), Error> {
    match values.iter().position(|v| !accept(*v)) {
        Some(index) => Err(Error::ElementOutOfRange {
            field,
            index,
            value: values[index],
            allowed,
        }),
        None => Ok(()),
    }
}

/// Finite elements of which each is larger than the one before, or [`Error::ElementOutOfRange`].
pub(crate) fn check_increasing(
    field: &'static str,
    values: &[f64],
    allowed: &'static str,
) -> Result<(), Error> {
    check_each(field, values, "finite", f64::is_finite)?;
    let late = values
        .windows(2)
        .position(|pair| pair[1] <= pair[0])
        .map(|before| before + 1);
    late.map_or(Ok(()), |index| {
        Err(Error::ElementOutOfRange {
            field,
            index,
            value: values[index],
            allowed,
        })
    })
}

/// [`Error::Overflow`] at the first element of a result that is not finite.
pub(crate) fn check_overflow(
    field: &'static str,
    mut finite: impl Iterator<Item = bool>,
) -> Result<(), Error> {
    finite
        .position(|finite| !finite)
        .map_or(Ok(()), |index| Err(Error::Overflow { field, index }))
}

/// Elements that are finite and not negative, or [`Error::ElementOutOfRange`].
pub(crate) fn check_amounts(field: &'static str, values: &[f64]) -> Result<(), Error> {
    check_each(field, values, "finite and not negative", |v| {
        v.is_finite() && v >= 0.0
    })
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
            assert_eq!(told(value), format!("a_m = {text}: must be positive"));
        }
    }
}
