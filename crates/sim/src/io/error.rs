//! What can go wrong while a result is turned into bytes and put on disk.
//! Check: every variant is provoked by a test of the module that returns it.

use std::path::PathBuf;

/// Failure of a writer or of a drawing. Nothing half-written is left behind by any of them.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// A table or field has another size than its axes.
    #[error("{field}: length {actual}, but {expected} is needed to match {axis}")]
    Length {
        /// Column, field or axis that does not fit.
        field: String,
        /// What it has to match.
        axis: String,
        /// Length needed.
        expected: usize,
        /// Length found.
        actual: usize,
    },
    /// A value is outside what the format or the drawing can hold.
    #[error("{field} = {value}: {allowed}")]
    Value {
        /// Field that holds the value.
        field: String,
        /// The value as text.
        value: String,
        /// What is allowed.
        allowed: String,
    },
    /// Two columns, fields or files share a name.
    #[error("{what} '{name}' appears twice: names must differ")]
    Duplicate {
        /// Kind of thing (column, field, file).
        what: &'static str,
        /// The repeated name.
        name: String,
    },
    /// Something that the format needs is not there.
    #[error("{what} is missing: {needed}")]
    Missing {
        /// What is absent.
        what: String,
        /// Why it is needed and what to do.
        needed: String,
    },
    /// The format, or its encoder, refuses what the result contains.
    #[error("{format} cannot hold this result: {reason}")]
    Unsupported {
        /// Name of the format.
        format: &'static str,
        /// Why, with the values.
        reason: String,
    },
    /// The operating system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// On which path.
        path: PathBuf,
        /// The system's answer.
        source: std::io::Error,
    },
    /// A file of the name of an output.
    #[error("{} exists: --overwrite replaces it, or choose another --out", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// Another run writes to the folder.
    #[error("{} is in use: another run writes to it; wait for its end, or choose another folder", folder.display())]
    InUse {
        /// The folder.
        folder: PathBuf,
    },
}

/// Result of the writers and drawings.
pub type OutputResult<T> = Result<T, OutputError>;

impl OutputError {
    pub(crate) fn io(action: &'static str, path: &std::path::Path, source: std::io::Error) -> Self {
        Self::Io {
            action,
            path: path.to_owned(),
            source,
        }
    }

    pub(crate) fn unsupported(format: &'static str, reason: impl ToString) -> Self {
        Self::Unsupported {
            format,
            reason: reason.to_string(),
        }
    }

    pub(crate) fn value(
        field: impl Into<String>,
        value: impl ToString,
        allowed: impl Into<String>,
    ) -> Self {
        Self::Value {
            field: field.into(),
            value: value.to_string(),
            allowed: allowed.into(),
        }
    }
}

/// Refuses a length that does not match its axis.
pub(crate) fn same_length(
    field: &str,
    actual: usize,
    axis: &str,
    expected: usize,
) -> OutputResult<()> {
    if actual == expected {
        return Ok(());
    }
    Err(OutputError::Length {
        field: field.into(),
        axis: axis.into(),
        expected,
        actual,
    })
}

/// Refuses an axis that is empty, not finite or not strictly increasing.
pub(crate) fn increasing(field: &str, values: &[f64]) -> OutputResult<()> {
    if values.is_empty() {
        return Err(OutputError::Missing {
            what: field.into(),
            needed: "at least one value".into(),
        });
    }
    if let Some(bad) = values.iter().find(|v| !v.is_finite()) {
        return Err(OutputError::value(field, bad, "must be finite"));
    }
    if let Some(pair) = values.windows(2).find(|w| w[1] <= w[0]) {
        return Err(OutputError::value(
            field,
            format!("{:?}, {:?}", pair[0], pair[1]),
            "must increase strictly",
        ));
    }
    Ok(())
}
