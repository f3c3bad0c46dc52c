//! What can go wrong in a run.

use crate::keys::{Problem, listed};
use std::path::PathBuf;

/// Why a run could not be made or finished.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file of a scene or a case cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The text of a scene or a case is no TOML.
    #[error("{}:{line}: {message}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong and what is allowed.
        message: String,
    },
    /// A scene or a case with unknown or missing keys, values of the wrong kind or out of their limits.
    #[error("{}", listed(path, problems))]
    Invalid {
        /// The file.
        path: PathBuf,
        /// All of them, in the order of their lines.
        problems: Vec<Problem>,
    },
    /// The wind refused a point or a time.
    #[error("wind: {0}")]
    Wind(#[from] wakescope_les::Error),
    /// The simulation of a flow could not be started or finished.
    #[error("flow: {0}")]
    Flow(wakescope_les::Error),
    /// A file that a flow case names does not hold what it should.
    #[error("{}: {reason}", path.display())]
    Input {
        /// The file.
        path: PathBuf,
        /// What is wrong, with what is allowed.
        reason: String,
    },
    /// What a key asks for cannot be done, which only a plan could find.
    #[error("{key}: {reason}")]
    Key {
        /// Path of the key.
        key: &'static str,
        /// What is wrong, and what would do.
        reason: String,
    },
    /// A file that a key names cannot be used.
    #[error("{key}: {source}")]
    OfKey {
        /// Path of the key.
        key: &'static str,
        /// What is wrong with the file.
        source: Box<Error>,
    },
    /// One of the winds that are added to the flow cannot be made.
    #[error("added_flows[{number}]: {source}")]
    OfAddedFlow {
        /// Its place in the list.
        number: usize,
        /// What is wrong with it.
        source: Box<Error>,
    },
    /// A case of a sweep was refused or could not be run.
    #[error("case {case} of the sweep ({keys}): {source}{}", more_in_words(*.others, "cases"))]
    Case {
        /// Number of the case, from 0.
        case: usize,
        /// Its keys and values.
        keys: String,
        /// Further cases that were refused.
        others: usize,
        /// What is wrong.
        source: Box<Error>,
    },
    /// A flight of a data set was refused or could not be run.
    #[error("flight {flight} of site {site} ({keys}): {source}{}", more_in_words(*.others, "flights"))]
    Flight {
        /// Number of the flight, from 0.
        flight: usize,
        /// Number of its site, from 0.
        site: usize,
        /// Its keys and values.
        keys: String,
        /// Further flights that were refused.
        others: usize,
        /// What is wrong.
        source: Box<Error>,
    },
    /// The folder holds the checkpoint of an earlier run.
    #[error("{} is the checkpoint of an earlier run: --restart continues it, --overwrite begins anew", path.display())]
    CheckpointInTheWay {
        /// The checkpoint.
        path: PathBuf,
    },
    /// A line of sight leaves the simulated flow, and the scene does not say what is there.
    #[error(
        "the line at elevation {elevation_rad:.6} rad leaves the simulated flow at range {range_m:.2} m, {time_s:.2} s after the start of the \
         scan (x = {x_m:.2} m, y = {y_m:.2} m, z = {z_m:.2} m): shorten the scan, or set scan.outside_flow.policy to \"mask\""
    )]
    OutsideFlow {
        /// Time after the start of the scan, s.
        time_s: f64,
        /// Elevation of the line, rad.
        elevation_rad: f64,
        /// Range of the point, m.
        range_m: f64,
        /// Its place along the flight, m.
        x_m: f64,
        /// Its place across the flight, m.
        y_m: f64,
        /// Its height, m.
        z_m: f64,
    },
    /// The optics refused a telescope or a range.
    #[error("optics: {0}")]
    Optics(#[from] wakescope_optics::Error),
    /// The signal simulation refused its input.
    #[error("signal: {0}")]
    Signal(#[from] wakescope_signal::Error),
    /// The products of the samples of a line cannot be drawn.
    #[error(
        "line {line} at elevation {elevation_rad:.6} rad: {source}: scan.accumulation = \"records\" simulates every record"
    )]
    OfLine {
        /// Index of the line, from 0.
        line: usize,
        /// Its elevation, rad.
        elevation_rad: f64,
        /// What is wrong with its records.
        source: wakescope_signal::Error,
    },
    /// A scene without noise has no bound.
    #[error(
        "detector.noise = \"none\": without noise nothing bounds the velocity; \"band\" or \"white\" is needed"
    )]
    NoBound,
    /// An estimator refused its input.
    #[error("estimate: {0}")]
    Estimate(#[from] wakescope_estimate::Error),
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
    /// A file or folder could not be written.
    #[error("cannot {action} {}: {source}", path.display())]
    NotWritten {
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
    /// A file or folder could not be used.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The run needs more memory than the machine has.
    #[error(
        "the run needs {needed} of memory, most of it for {stage}, and {available} are available: {remedy}; --allow-large \
         runs it all the same"
    )]
    TooLarge {
        /// Forecast of the memory, in words.
        needed: String,
        /// Memory that the machine has available, in words.
        available: String,
        /// The stage that takes most of it.
        stage: &'static str,
        /// What would take less: keys, for a flow with values that would fit.
        remedy: String,
    },
    /// The observer of the progress has stopped the run.
    #[error("stopped")]
    Stopped,
    /// The number of threads cannot be had.
    #[error("--threads {threads}: {reason}")]
    Threads {
        /// The requested number.
        threads: usize,
        /// What the thread pool says.
        reason: String,
    },
}

impl Error {
    /// What a library refuses of a field of its input, if the error is about one: as its key the name of the field, with the index of the
    /// element of a list.
    pub(crate) fn refused_field(&self) -> Option<Problem> {
        use wakescope_estimate::Error as EstimateError;
        use wakescope_les::Error as WindError;
        use wakescope_optics::Error as OpticsError;
        use wakescope_signal::Error as SignalError;
        match self {
            Self::Optics(OpticsError::OutOfRange {
                field,
                value,
                allowed,
            })
            | Self::Signal(SignalError::OutOfRange {
                field,
                value,
                allowed,
            })
            | Self::Estimate(EstimateError::OutOfRange {
                field,
                value,
                allowed,
            })
            | Self::Wind(WindError::OutOfRange {
                field,
                value,
                allowed,
            }) => Some(Problem::new(*field, format!("{value:?}"), *allowed)),
            Self::Signal(SignalError::ElementOutOfRange {
                field,
                index,
                value,
                allowed,
            }) => Some(Problem::new(
                format!("{field}[{index}]"),
                format!("{value:?}"),
                *allowed,
            )),
            Self::Signal(SignalError::LengthMismatch {
                field,
                found,
                expected,
            }) => Some(Problem::new(
                *field,
                format!("a list of {found}"),
                format!("a list of {expected} values, as many as the lists beside it have"),
            )),
            _ => None,
        }
    }

    /// The error of a file that a key names.
    pub(crate) fn of_key(key: &'static str) -> impl Fn(Self) -> Self + Copy {
        move |source| Self::OfKey {
            key,
            source: Box::new(source),
        }
    }

    /// A file that does not hold what it should, with the reason.
    pub(crate) fn input(path: &std::path::Path, reason: impl Into<String>) -> Self {
        Self::Input {
            path: path.to_owned(),
            reason: reason.into(),
        }
    }

    /// What the system says of a file or folder that is written.
    pub(crate) fn not_written(
        action: &'static str,
        path: &std::path::Path,
        source: std::io::Error,
    ) -> Self {
        Self::NotWritten {
            action,
            path: path.to_owned(),
            source,
        }
    }

    /// A format, or its encoder, that refuses what the result contains.
    pub(crate) fn unsupported(format: &'static str, reason: impl ToString) -> Self {
        Self::Unsupported {
            format,
            reason: reason.to_string(),
        }
    }

    /// A value outside what a format or a drawing can hold.
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

    /// What the system says of a file or folder.
    pub(crate) fn io(
        action: &'static str,
        path: &std::path::Path,
    ) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io {
            action,
            path,
            source,
        }
    }
}

fn more_in_words(others: usize, what: &str) -> String {
    if others == 0 {
        String::new()
    } else {
        format!("\nand {others} more {what} are refused")
    }
}
