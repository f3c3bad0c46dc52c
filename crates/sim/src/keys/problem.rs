//! Why a scene or a case was refused: the file, the line, the key, the value and what is allowed.

use std::fmt::{Display, Formatter, Result};
use std::path::{Path, PathBuf};

/// A value that a scene or a case may not have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// Path of the key, `section.key`.
    pub key: String,
    /// The value found.
    pub value: String,
    /// What is allowed, with the unit.
    pub allowed: String,
    /// Line of the key in the file, from 1; `None` where the value is a default, or of no file.
    pub line: Option<usize>,
}

impl Problem {
    /// A problem of no line.
    pub fn new(
        key: impl Into<String>,
        value: impl Into<String>,
        allowed: impl Into<String>,
    ) -> Self {
        Self {
            key: key.into(),
            value: value.into(),
            allowed: allowed.into(),
            line: None,
        }
    }
    /// The value of a key that is not there.
    pub const ABSENT: &str = "absent";
}

impl Display for Problem {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self.value.as_str() {
            Self::ABSENT => write!(f, "{} is missing: {}", self.key, self.allowed),
            // A table is not repeated.
            "" => write!(f, "{} is not allowed: {}", self.key, self.allowed),
            value => write!(f, "{} = {value} is not allowed: {}", self.key, self.allowed),
        }
    }
}

/// Why a scene or a case was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The text is no TOML.
    #[error("{}:{line}: {message}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong and what is allowed.
        message: String,
    },
    /// Unknown or missing keys, values of the wrong kind or out of their limits.
    #[error("{}", list(path, problems))]
    Invalid {
        /// The file.
        path: PathBuf,
        /// All of them, in the order of their lines.
        problems: Vec<Problem>,
    },
}

/// Most problems that a message lists.
const MOST_LINES: usize = 50;

fn list(path: &Path, problems: &[Problem]) -> String {
    let path = path.display();
    let mut lines = Vec::new();
    for problem in problems.iter().take(MOST_LINES) {
        lines.push(match problem.line {
            Some(line) => format!("{path}:{line}: {problem}"),
            None => format!("{path}: {problem}"),
        });
    }
    if problems.len() > MOST_LINES {
        lines.push(format!("and {} more", problems.len() - MOST_LINES));
    }
    lines.join("\n")
}
