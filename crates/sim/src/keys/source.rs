//! A text and the file that it came from, by which problems that are found later are given their lines.

#[cfg(feature = "flow")]
use super::problem::Located;
use super::problem::{Problem, SceneError};
use super::vet::Document;
use std::path::{Path, PathBuf};

/// The text of a scene or a case; empty for one that was made in memory.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Source {
    path: PathBuf,
    text: String,
}

impl Source {
    pub(crate) fn new(path: &Path, text: &str) -> Self {
        Self { path: path.to_owned(), text: text.to_owned() }
    }

    #[cfg(feature = "flow")]
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The folder from which files that the text names are looked for.
    pub(crate) fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Problems of what was asked for beside the text.
    #[cfg(feature = "flow")]
    pub(crate) fn refused(&self, problems: Vec<Problem>) -> SceneError {
        let problems = problems.into_iter().map(|problem| Located { problem, line: None }).collect();
        SceneError::Invalid { path: self.path.clone(), problems }
    }

    /// Whether the text gives a value to a key.
    pub(crate) fn has(&self, key: &str) -> bool {
        Document::parse(&self.text, &self.path).is_ok_and(|document| document.value(key).is_some())
    }

    /// Problems with the lines of the text.
    pub(crate) fn located(&self, problems: Vec<Problem>) -> SceneError {
        match Document::parse(&self.text, &self.path) {
            Ok(document) => document.located(problems),
            Err(error) => error,
        }
    }
}
