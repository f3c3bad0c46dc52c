//! Checks of lengths and axes that all writers make.

use crate::Error;

/// Refuses a length that does not match its axis.
pub(crate) fn same_length(
    field: &str,
    actual: usize,
    axis: &str,
    expected: usize,
) -> Result<(), Error> {
    if actual == expected {
        return Ok(());
    }
    Err(Error::Length {
        field: field.into(),
        axis: axis.into(),
        expected,
        actual,
    })
}

/// Refuses an axis that is empty, not finite or not strictly increasing.
pub(crate) fn increasing(field: &str, values: &[f64]) -> Result<(), Error> {
    if values.is_empty() {
        return Err(Error::Missing {
            what: field.into(),
            needed: "at least one value".into(),
        });
    }
    if let Some(bad) = values.iter().find(|v| !v.is_finite()) {
        return Err(Error::value(field, bad, "must be finite"));
    }
    if let Some(pair) = values.windows(2).find(|w| w[1] <= w[0]) {
        return Err(Error::value(
            field,
            format!("{:?}, {:?}", pair[0], pair[1]),
            "must increase strictly",
        ));
    }
    Ok(())
}
