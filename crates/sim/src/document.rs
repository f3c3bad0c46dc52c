//! A checked scene or case, with its file, its hash and the lines of its keys.

use crate::Error;
use crate::io::{Provenance, hash_of, text_file};
use crate::keys::{Problem, Text};
use std::path::{Path, PathBuf};

/// What a file says: a scene or a case.
pub trait Content: Sized {
    /// Reads and checks a text; `path` serves the messages.
    ///
    /// # Errors
    /// [`Error`] names the file, the line, the key, the value and what is allowed.
    fn parse(text: &str, path: &Path) -> Result<Self, Error>;

    /// The same as TOML, every default written out.
    fn to_toml(&self) -> String;

    /// The seed of its random numbers; 0 where there are none.
    fn seed(&self) -> u64;
}

/// A valid scene or case, with what names it.
#[derive(Debug, Clone, PartialEq)]
pub struct Document<T> {
    /// The scene or the case.
    pub content: T,
    /// The same as TOML, every default written out.
    pub toml: String,
    /// First 16 hexadecimal digits of the SHA-256 of `toml`.
    pub hash: String,
    path: PathBuf,
    /// As it was read; empty if it was made in memory.
    text: String,
}

impl<T: Content> Document<T> {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// [`Error`] names the file, the line, the key, the value and what is allowed.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = text_file::read(path).map_err(|source| Error::Unreadable {
            path: path.to_owned(),
            source,
        })?;
        Self::parse(&text, path)
    }

    /// Checks the text of a file; `path` serves the error messages, and its folder is where files that the text names are
    /// looked for.
    ///
    /// # Errors
    /// As [`Document::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, Error> {
        Ok(Self::of(T::parse(text, path)?, path, text))
    }

    /// What was checked of a text.
    pub(crate) fn of(content: T, path: &Path, text: &str) -> Self {
        let toml = content.to_toml();
        Self {
            hash: hash_of(&toml),
            toml,
            content,
            path: path.to_owned(),
            text: text.to_owned(),
        }
    }

    /// What comes of this and needs no check, with the folder and the lines of its file.
    pub(crate) fn changed(&self, content: T) -> Self {
        Self::of(content, &self.path, &self.text)
    }

    /// Where the files that come of this come from.
    pub fn provenance(&self) -> Provenance {
        Provenance::new(&self.toml, &self.hash, self.content.seed())
    }

    /// The file that it was read from.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Folder to which names of files in it are relative.
    pub fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Whether the file gives a value to a key.
    pub(crate) fn states(&self, key: &str) -> bool {
        Text::parse(&self.text, &self.path).is_ok_and(|text| text.value(key).is_some())
    }

    /// Problems that are found later, with the lines of the file.
    pub(crate) fn located(&self, problems: Vec<Problem>) -> Error {
        match Text::parse(&self.text, &self.path) {
            Ok(text) => text.located(problems),
            Err(error) => error,
        }
    }

    /// Problems of requests beside the file.
    pub(crate) fn refused(&self, problems: Vec<Problem>) -> Error {
        Error::Invalid {
            path: self.path.clone(),
            problems,
        }
    }
}
