//! Several data files of one command: those that cannot be used are skipped, as sweeps of one file are, and those that are copies of
//! others, whose measurements would count twice.
//!
//! Check: a folder of a day with files that are cut short or hold other scans, in the tests of the program; copies.

use crate::Error;
use crate::progress::Observer;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{ErrorKind, Read};
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
    let lengths: Vec<Option<u64>> = paths.iter().map(|path| length_of_file(path)).collect();
    let mut before: BTreeMap<[u8; 32], &Path> = BTreeMap::new();
    for (path, length) in paths.iter().zip(&lengths) {
        let alike = lengths.iter().filter(|other| *other == length);
        if length.is_some()
            && alike.take(2).count() > 1
            && let Ok(digest) = digest_of_file(path)
        {
            if let Some(same) = before.get(&digest) {
                let same = same.display();
                let path = path.display();
                observer.warn(&format!("{path}: it is a copy of {same}: file skipped"));
                continue;
            }
            before.insert(digest, path);
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

/// The length of a file that can be read twice, bytes.
fn length_of_file(path: &Path) -> Option<u64> {
    let about = std::fs::metadata(path).ok()?;
    about.is_file().then_some(about.len())
}

/// The SHA-256 digest of the bytes of a file.
fn digest_of_file(path: &Path) -> std::io::Result<[u8; 32]> {
    let mut file = File::open(path)?;
    let mut part = vec![0; 1 << 16];
    let mut digest = Sha256::new();
    loop {
        match file.read(&mut part)? {
            0 => return Ok(digest.finalize().into()),
            count => digest.update(&part[..count]),
        }
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
