//! Why a scene or a case was refused: the file, the line, the key, the value and what is allowed.

use std::fmt::{Display, Formatter, Result};
use std::path::Path;

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

/// Most problems that a message lists.
const MOST_LINES: usize = 50;

/// Problems of a file, each in its line.
pub(crate) fn listed(path: &Path, problems: &[Problem]) -> String {
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
