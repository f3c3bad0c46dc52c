//! Several data files of one command: those that cannot be used are skipped, as sweeps of one file are.
//!
//! Check: a folder of a day with files that are cut short or hold other scans, in the tests of the program.

use crate::Error;
use crate::progress::Observer;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// What `read` makes of each file. Of several, those that cannot be used are skipped, and the observer is warned of each with its reason.
///
/// # Errors
/// A file that does not exist; what is wrong with the first one where none can be used.
pub(super) fn each_usable<T>(
    paths: &[PathBuf],
    observer: &dyn Observer,
    mut read: impl FnMut(&Path) -> Result<T, Error>,
) -> Result<Vec<T>, Error> {
    let mut usable = Vec::new();
    let mut refused = Vec::new();
    for path in paths {
        match read(path) {
            Ok(content) => usable.push(content),
            Err(error) if is_of_the_file(&error) => refused.push(error),
            Err(error) => return Err(error),
        }
    }
    if usable.is_empty() && !refused.is_empty() {
        let first = refused.remove(0);
        refused
            .iter()
            .for_each(|error| observer.warn(&error.to_string()));
        return Err(first);
    }
    for error in &refused {
        observer.warn(&format!("{error}: file skipped"));
    }
    Ok(usable)
}

/// Whether an error is about the content of a file, and other files can be used all the same.
pub(super) fn is_of_the_file(error: &Error) -> bool {
    match error {
        Error::Input { .. } => true,
        Error::Io { source, .. } => source.kind() != ErrorKind::NotFound,
        _ => false,
    }
}
