//! One writer for a folder at a time.
//!
//! The lock is one of the operating system on a hidden file: a process that ends in any way gives it back. Who holds it sweeps
//! what crashed writers have left.
//!
//! Check: a second lock is refused, a lock that was given back can be taken, nothing stays behind.

use super::atomic::sweep_stages;
use crate::Error;
use std::fs::{File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};

const NAME: &str = ".wakescope-lock";

/// The right to write to a folder, until it is dropped.
#[derive(Debug)]
pub(crate) struct FolderLock {
    path: PathBuf,
    // Held open: closing it gives the lock back.
    _file: File,
}

impl FolderLock {
    /// Takes the lock of a folder, which must exist.
    ///
    /// # Errors
    /// [`Error::InUse`] while another run has it; what the system says.
    pub(crate) fn take(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(NAME);
        let file = loop {
            let opened = OpenOptions::new()
                .create(true)
                .truncate(false)
                .write(true)
                .open(&path);
            let file = opened.map_err(|error| Error::not_written("lock", &path, error))?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    return Err(Error::InUse {
                        folder: folder.to_owned(),
                    });
                }
                // A file system without locks: nothing can be held there.
                Err(TryLockError::Error(error))
                    if error.kind() == std::io::ErrorKind::Unsupported =>
                {
                    break file;
                }
                Err(TryLockError::Error(error)) => {
                    return Err(Error::not_written("lock", &path, error));
                }
            }
            if is_at(&file, &path) {
                break file;
            }
            // The holder before removed the file after it was opened here and before it was locked.
        };
        sweep_stages(folder);
        Ok(Self { path, _file: file })
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // While the lock is held, so that nobody else holds one on the file that goes.
        if cfg!(unix) {
            drop(std::fs::remove_file(&self.path));
        }
    }
}

/// Whether the open file is still the one of that name.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    let open = file_id(file.metadata());
    open.is_some() && open == file_id(path.metadata())
}

/// Device and number of a file.
#[cfg(unix)]
fn file_id(metadata: std::io::Result<std::fs::Metadata>) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt as _;
    let metadata = metadata.ok()?;
    Some((metadata.dev(), metadata.ino()))
}

/// Elsewhere the file is never taken away.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_folder_has_one_writer_and_keeps_no_trace_of_it() {
        let temp = tempfile::tempdir().unwrap();
        let first = FolderLock::take(temp.path()).unwrap();
        let second = FolderLock::take(temp.path()).unwrap_err();
        assert!(matches!(second, Error::InUse { .. }), "{second}");
        assert!(
            second.to_string().contains(temp.path().to_str().unwrap()),
            "{second}"
        );
        drop(first);
        drop(FolderLock::take(temp.path()).unwrap());
        if cfg!(unix) {
            assert_eq!(fs::read_dir(temp.path()).unwrap().count(), 0);
        }
        assert!(FolderLock::take(&temp.path().join("none")).is_err());
        // The file of a writer that crashed is no obstacle.
        fs::write(temp.path().join(NAME), "").unwrap();
        drop(FolderLock::take(temp.path()).unwrap());
    }

    #[cfg(unix)]
    #[test]
    fn links_that_are_named_like_stages_are_not_followed() {
        use std::os::unix::fs::symlink;
        let temp = tempfile::tempdir().unwrap();
        let others = tempfile::tempdir().unwrap();
        for part in ["old", "new"] {
            fs::create_dir(others.path().join(part)).unwrap();
            fs::write(others.path().join(part).join("map.csv"), part).unwrap();
        }
        symlink(others.path(), temp.path().join(".wakescope-stage-1-0")).unwrap();
        // A folder of that name whose parts are links.
        let stage = temp.path().join(".wakescope-stage-1-1");
        fs::create_dir(&stage).unwrap();
        fs::write(stage.join("lock"), "").unwrap();
        ["old", "new"]
            .iter()
            .for_each(|part| symlink(others.path().join(part), stage.join(part)).unwrap());
        fs::write(temp.path().join("map.csv"), "mine").unwrap();
        drop(FolderLock::take(temp.path()).unwrap());
        let read = |folder: &Path, name: &str| fs::read_to_string(folder.join(name)).unwrap();
        assert_eq!(read(temp.path(), "map.csv"), "mine");
        assert_eq!(
            ["old/map.csv", "new/map.csv"].map(|name| read(others.path(), name)),
            ["old", "new"]
        );
        assert!(!stage.exists());
    }

    #[test]
    fn what_crashed_writers_left_is_swept_and_a_file_they_had_taken_away_comes_back() {
        let temp = tempfile::tempdir().unwrap();
        let stage = |name: &str| temp.path().join(format!(".wakescope-stage-{name}"));
        for name in ["1-0", "1-1"] {
            for part in ["old", "new"] {
                fs::create_dir_all(stage(name).join(part)).unwrap();
            }
            fs::write(stage(name).join("lock"), "").unwrap();
        }
        // Killed between taking the old file away and putting the new one into its place, with another still to come.
        fs::write(stage("1-0").join("old/map.csv"), "old").unwrap();
        fs::write(stage("1-0").join("new/map.csv"), "new").unwrap();
        // Killed when all were in place.
        fs::write(temp.path().join("profile.csv"), "new").unwrap();
        fs::write(stage("1-1").join("old/profile.csv"), "old").unwrap();
        drop(FolderLock::take(temp.path()).unwrap());
        let read = |name: &str| fs::read_to_string(temp.path().join(name)).unwrap();
        assert_eq!([read("map.csv"), read("profile.csv")], ["old", "new"]);
        assert!(!stage("1-0").exists() && !stage("1-1").exists());
    }

    #[test]
    fn what_a_living_writer_has_begun_stays_and_links_are_not_followed() {
        let temp = tempfile::tempdir().unwrap();
        let folder = temp.path().join("out");
        let elsewhere = temp.path().join("elsewhere");
        for of in [&folder, &elsewhere.join("new"), &elsewhere.join("old")] {
            fs::create_dir_all(of).unwrap();
        }
        fs::write(elsewhere.join("lock"), "").unwrap();
        fs::write(elsewhere.join("new/mine"), "mine").unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink(&elsewhere, folder.join(".wakescope-stage-1-0")).unwrap();
        let mut group = crate::io::FileGroup::new(&folder);
        group.add("map.csv", "new").unwrap();
        let begun = group.begin().unwrap();
        drop(FolderLock::take(&folder).unwrap());
        group.write(&begun.name()).unwrap();
        group.put(&begun).unwrap();
        assert_eq!(fs::read_to_string(folder.join("map.csv")).unwrap(), "new");
        assert_eq!(
            fs::read_to_string(elsewhere.join("new/mine")).unwrap(),
            "mine"
        );
    }
}
