//! Several data files of one command: those that cannot be used are skipped, as sweeps of one file are, and those that are copies of
//! others, whose measurements would count twice.
//!
//! Check: a folder of a day with files that are cut short or hold other scans, in the tests of the program; copies.

use crate::Error;
use crate::progress::Observer;
use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind};
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
    let mut before: Vec<(u64, &Path)> = Vec::with_capacity(paths.len());
    for path in paths {
        if let Ok(about) = std::fs::metadata(path)
            && about.is_file()
        {
            let alike = before.iter().filter(|(length, _)| *length == about.len());
            if let Some((_, same)) = alike.into_iter().find(|(_, other)| are_equal(other, path)) {
                let same = same.display();
                let path = path.display();
                observer.warn(&format!("{path}: it is a copy of {same}: file skipped"));
                continue;
            }
            before.push((about.len(), path));
        }
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

/// Whether two files have the same bytes; not of files that cannot be read.
fn are_equal(path: &Path, other: &Path) -> bool {
    have_same_bytes(path, other).unwrap_or(false)
}

fn have_same_bytes(path: &Path, other: &Path) -> std::io::Result<bool> {
    let mut file = BufReader::new(File::open(path)?);
    let mut other = BufReader::new(File::open(other)?);
    loop {
        let own = file.fill_buf()?;
        let others = other.fill_buf()?;
        let count = own.len().min(others.len());
        if count == 0 {
            return Ok(own.len() == others.len());
        }
        if own[..count] != others[..count] {
            return Ok(false);
        }
        file.consume(count);
        other.consume(count);
    }
}

/// Whether an error is about the content of a file, and other files can be used all the same.
pub(super) fn is_of_the_file(error: &Error) -> bool {
    match error {
        Error::Input { .. } => true,
        Error::Io { source, .. } => source.kind() != ErrorKind::NotFound,
        _ => false,
    }
}
