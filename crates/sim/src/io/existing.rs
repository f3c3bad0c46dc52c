//! Files that exist where a command is to write: refused, or replaced where the user requests it.
//! Check: an existing file, a link and a folder of the name of an output.

use crate::Error;
use std::path::Path;

/// What becomes of a file that has the name of an output.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Existing {
    /// The command is refused.
    #[default]
    Refuse,
    /// The file is replaced.
    Replace,
}

impl Existing {
    /// Replaces files if `overwrite` is set.
    pub fn with_overwrite(overwrite: bool) -> Self {
        if overwrite {
            Self::Replace
        } else {
            Self::Refuse
        }
    }

    /// Refuses names in a folder that cannot be written: an existing file, unless it is to be replaced, or a folder.
    ///
    /// # Errors
    /// [`Error::Exists`] or [`Error::NotWritten`], with the path.
    pub fn check<'a>(
        self,
        folder: &Path,
        names: impl IntoIterator<Item = &'a str>,
    ) -> Result<(), Error> {
        for name in names {
            let path = folder.join(name);
            if path.symlink_metadata().is_err() {
                continue;
            }
            if path.is_dir() {
                let source = std::io::Error::new(
                    std::io::ErrorKind::IsADirectory,
                    "a folder of that name is in the way",
                );
                return Err(Error::not_written("write", &path, source));
            }
            if self == Self::Refuse {
                return Err(Error::Exists { path });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn existing_files_are_refused_with_their_name_unless_they_are_to_be_replaced() {
        let temp = tempfile::tempdir().unwrap();
        let check = |existing: Existing| existing.check(temp.path(), ["new.csv", "map.csv"]);
        check(Existing::Refuse).unwrap();
        std::fs::write(temp.path().join("map.csv"), "range_m\n").unwrap();
        let message = check(Existing::Refuse).unwrap_err().to_string();
        assert!(
            message.contains("map.csv exists") && message.contains("--overwrite"),
            "{message}"
        );
        check(Existing::Replace).unwrap();
        std::fs::remove_file(temp.path().join("map.csv")).unwrap();
        std::fs::create_dir(temp.path().join("map.csv")).unwrap();
        for existing in [Existing::Refuse, Existing::Replace] {
            let message = check(existing).unwrap_err().to_string();
            assert!(message.contains("a folder of that name"), "{message}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_link_that_leads_nowhere_exists() {
        let temp = tempfile::tempdir().unwrap();
        std::os::unix::fs::symlink("nowhere", temp.path().join("map.csv")).unwrap();
        assert!(Existing::Refuse.check(temp.path(), ["map.csv"]).is_err());
        Existing::Replace.check(temp.path(), ["map.csv"]).unwrap();
    }
}
