//! Puts files on disk so that no program finds one half-written, and a run's files appear all together or not at all.
//! A group is staged in a hidden folder inside the target folder (same file system), each file synced, then renamed into place;
//! if a rename fails, the earlier ones are undone and replaced files come back.
//! Check: the tests provoke a failure at each step and list the folder afterwards.

use super::parts::FileParts;
use crate::Error;
use std::fs;
use std::io::{ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Files of one run, collected in memory and committed together.
///
/// ```
/// use wakescope_sim::io::FileGroup;
/// let folder = std::env::temp_dir().join("wakescope-doc-group");
/// let mut group = FileGroup::new(&folder);
/// group.add("map.csv", "range_m\n100.0\n")?;
/// let written = group.commit()?;
/// assert_eq!(std::fs::read_to_string(&written[0]).unwrap(), "range_m\n100.0\n");
/// # std::fs::remove_dir_all(&folder).ok();
/// # Ok::<(), wakescope_sim::Error>(())
/// ```
#[derive(Debug)]
pub struct FileGroup {
    folder: PathBuf,
    files: Vec<(String, FileParts)>,
}

impl FileGroup {
    /// A group for this folder, which is made by [`Self::commit`] where it does not exist.
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            files: Vec::new(),
        }
    }

    /// Adds a file.
    ///
    /// # Errors
    /// A name that is not a plain file name (empty, with a separator, `.`, `..`), or one already in the group.
    pub fn add(&mut self, name: &str, content: impl Into<Vec<u8>>) -> Result<(), Error> {
        self.add_parts(name, FileParts::from(content.into()))
    }

    /// Adds a file of which several ranks have parts; of a file in one process all must be here.
    ///
    /// # Errors
    /// As [`Self::add`].
    pub fn add_parts(&mut self, name: &str, content: FileParts) -> Result<(), Error> {
        if Path::new(name).file_name() != Some(name.as_ref()) {
            return Err(Error::value(
                "file name",
                name,
                "must be a plain name without folders",
            ));
        }
        if self.files.iter().any(|(n, _)| n == name) {
            return Err(Error::Duplicate {
                what: "file",
                name: name.into(),
            });
        }
        self.files.push((name.into(), content));
        Ok(())
    }

    /// Writes all files, replacing older ones of the same names; returns their paths in the order in which they were added.
    ///
    /// # Errors
    /// The first refusal of the system. The folder is then as it was before, and a folder made by this call is gone again.
    pub fn commit(self) -> Result<Vec<PathBuf>, Error> {
        in_folder(&self.folder, true, || self.commit_inside())
    }

    fn commit_inside(&self) -> Result<Vec<PathBuf>, Error> {
        let staging = self.begin()?;
        self.write(&staging.name())?;
        self.put(&staging)
    }

    /// Makes a hidden folder with the files, which lack their content yet. The folder of the group must exist.
    ///
    /// # Errors
    /// The first refusal of the system.
    pub(crate) fn begin(&self) -> Result<StagingFolder, Error> {
        let staging = StagingFolder::make(&self.folder)?;
        for (name, content) in &self.files {
            let path = staging.new.join(name);
            let made = fs::File::create_new(&path).and_then(|file| file.set_len(content.length));
            made.map_err(|e| Error::not_written("write", &path, e))?;
        }
        Ok(staging)
    }

    /// Writes the parts that are here into the staging folder of that name, and waits until they are on disk.
    ///
    /// # Errors
    /// The first refusal of the system.
    pub(crate) fn write(&self, staging: &str) -> Result<(), Error> {
        for (name, content) in &self.files {
            if content.parts.is_empty() {
                continue;
            }
            let path = self.folder.join(staging).join(NEW).join(name);
            write_parts(&path, content).map_err(|e| Error::not_written("write", &path, e))?;
        }
        Ok(())
    }

    /// Puts the files of a staging folder, which are whole, into place; returns their paths.
    ///
    /// # Errors
    /// The first refusal of the system. The folder is then as it was before.
    pub(crate) fn put(&self, staging: &StagingFolder) -> Result<Vec<PathBuf>, Error> {
        for (place, (name, _)) in self.files.iter().enumerate() {
            // After the last one nothing can fail, so that what it replaces need not be kept: in one step, for others may do the same.
            if let Err(error) = self.put_one(staging, name, place + 1 == self.files.len()) {
                for (name, _) in self.files[..place].iter().rev() {
                    let target = self.folder.join(name);
                    let kept = staging.old.join(name);
                    let was_there = kept.symlink_metadata().is_ok();
                    drop(if was_there {
                        fs::rename(kept, target)
                    } else {
                        fs::remove_file(target)
                    });
                }
                return Err(error);
            }
        }
        // So that the renames reach the disk. Not every system can sync a folder; the files themselves are complete either way.
        drop(fs::File::open(&self.folder).and_then(|folder| folder.sync_all()));
        Ok(self
            .files
            .iter()
            .map(|(name, _)| self.folder.join(name))
            .collect())
    }

    /// Puts one file into place; an older one stays in the staging folder, except for the last file.
    fn put_one(&self, staging: &StagingFolder, name: &str, is_last: bool) -> Result<(), Error> {
        let target = self.folder.join(name);
        let kept = staging.old.join(name);
        if target.is_dir() {
            let source = std::io::Error::new(
                ErrorKind::IsADirectory,
                "a folder of that name is in the way",
            );
            return Err(Error::not_written("write", &target, source));
        }
        let keeps = !is_last && target.symlink_metadata().is_ok();
        if keeps {
            fs::rename(&target, &kept).map_err(|e| Error::not_written("replace", &target, e))?;
        }
        fs::rename(staging.new.join(name), &target).map_err(|source| {
            if keeps {
                drop(fs::rename(&kept, &target));
            }
            Error::not_written("write", &target, source)
        })
    }
}

/// Writes one file, replacing an older one of that name; its folder must exist.
///
/// # Errors
/// The refusal of the system; nothing is left behind and an older file is untouched.
pub fn write_atomic(path: &Path, content: impl Into<Vec<u8>>) -> Result<(), Error> {
    let name = path.file_name().and_then(|n| n.to_str()).ok_or_else(|| {
        Error::value(
            "file name",
            path.display(),
            "must end with a UTF-8 file name",
        )
    })?;
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
    let folder = parent.unwrap_or(Path::new("."));
    let mut group = FileGroup::new(folder);
    group.add(name, content)?;
    group.commit_inside().map(drop)
}

/// Hidden folder for the new and the replaced files; removed when dropped.
#[derive(Debug)]
pub(crate) struct StagingFolder {
    root: PathBuf,
    new: PathBuf,
    old: PathBuf,
    // Locked while its maker lives: what nobody holds was left by a crash.
    _lock: fs::File,
}

/// What the folder of the new files in it is called.
const NEW: &str = "new";
/// How the names of staging folders begin.
const STAGE: &str = ".wakescope-stage-";
/// Name of the file in a staging folder that its maker holds locked.
const LOCK: &str = "lock";

/// Removes the staging folders that crashed processes left in a folder; those of running processes, and links, stay. Files that
/// a crashed process had replaced only in part are put back as far as they still exist.
pub(crate) fn sweep_stages(folder: &Path) {
    for root in entries(folder) {
        if !is_staging_folder(&root) {
            continue;
        }
        let Ok(lock) = fs::File::open(root.join(LOCK)) else {
            // Not yet locked, or left by a crash before that: an empty folder is removed, and its maker takes another name.
            drop(fs::remove_dir(&root));
            continue;
        };
        if lock.try_lock().is_err() {
            continue;
        }
        let staging = StagingFolder::from_root(root, lock);
        // Links in it may lead to folders of other programs.
        let are_folders = is_folder(&staging.new) && is_folder(&staging.old);
        if are_folders && !entries(&staging.new).is_empty() {
            for replaced in entries(&staging.old) {
                if let Some(name) = replaced.file_name() {
                    drop(fs::rename(&replaced, folder.join(name)));
                }
            }
        }
        // Dropping the staging folder removes it.
    }
}

/// Paths in a folder; none if it cannot be read.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut paths = Vec::new();
    if let Ok(entries) = fs::read_dir(folder) {
        for entry in entries.flatten() {
            paths.push(entry.path());
        }
    }
    paths
}

/// Whether the path is a folder, and no link to one.
fn is_folder(path: &Path) -> bool {
    path.symlink_metadata().is_ok_and(|about| about.is_dir())
}

/// Whether the path is a folder with the name of a staging folder.
fn is_staging_folder(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().starts_with(STAGE) && is_folder(path)
}

/// Writes the parts into an existing file and waits until they are on disk.
fn write_parts(path: &Path, content: &FileParts) -> std::io::Result<()> {
    let mut file = fs::OpenOptions::new().write(true).open(path)?;
    for (start, bytes) in &content.parts {
        file.seek(SeekFrom::Start(*start))?;
        file.write_all(bytes)?;
    }
    file.sync_all()
}

/// Removes a folder with its content; returns whether it no longer exists.
fn remove_folder(path: &Path) -> bool {
    fs::remove_dir_all(path).is_ok() || path.symlink_metadata().is_err()
}

impl StagingFolder {
    /// The name of the folder.
    pub(crate) fn name(&self) -> String {
        self.root
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    }

    fn from_root(root: PathBuf, lock: fs::File) -> Self {
        Self {
            new: root.join(NEW),
            old: root.join("old"),
            root,
            _lock: lock,
        }
    }

    /// Writes one file of any folder of the same file system through the staging folder, whole or not at all; `unique` names it in
    /// the staging folder. An older file is replaced, folders are made.
    ///
    /// # Errors
    /// The refusal of the system; an older file is then untouched.
    pub(crate) fn put_file(
        &self,
        unique: usize,
        target: &Path,
        content: &[u8],
    ) -> Result<(), Error> {
        let staged = self.new.join(unique.to_string());
        let written = fs::write(&staged, content)
            .and_then(|()| fs::File::open(&staged))
            .and_then(|file| file.sync_all())
            .and_then(|()| match target.parent() {
                Some(parent) => fs::create_dir_all(parent),
                None => Ok(()),
            })
            .and_then(|()| fs::rename(&staged, target));
        written.map_err(|error| {
            drop(fs::remove_file(&staged));
            Error::not_written("write", target, error)
        })
    }

    /// Makes the staging folder of a folder.
    ///
    /// # Errors
    /// Files cannot be written there.
    pub(crate) fn make(folder: &Path) -> Result<Self, Error> {
        for attempt in 0..10_000 {
            let root = folder.join(format!("{STAGE}{}-{attempt}", std::process::id()));
            match fs::create_dir(&root) {
                Ok(()) => {}
                Err(e) if e.kind() == ErrorKind::AlreadyExists => continue,
                Err(e) => return Err(Error::not_written("write into", folder, e)),
            }
            match Self::begin(&root) {
                Ok(staging) => return Ok(staging),
                // Before it was locked somebody took it for one that was left.
                Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::WouldBlock) => {}
                Err(e) => return Err(Error::not_written("create folder", &root, e)),
            }
        }
        Err(Error::not_written(
            "write into",
            folder,
            ErrorKind::AlreadyExists.into(),
        ))
    }

    fn begin(root: &Path) -> std::io::Result<Self> {
        let lock = fs::File::create_new(root.join(LOCK))?;
        match lock.try_lock() {
            // A file system without locks: then nobody can hold it, and nobody sweeps.
            Err(fs::TryLockError::Error(e)) if e.kind() == ErrorKind::Unsupported => {}
            tried => tried?,
        }
        let staging = Self::from_root(root.to_owned(), lock);
        fs::create_dir(&staging.new)?;
        fs::create_dir(&staging.old)?;
        Ok(staging)
    }
}

impl Drop for StagingFolder {
    fn drop(&mut self) {
        // The lock is removed last: without it no process sweeps a staging folder that is not empty.
        if remove_folder(&self.new) && remove_folder(&self.old) {
            drop(fs::remove_dir_all(&self.root));
        }
    }
}

/// Makes a folder and its parents for what is done in it. Folders that this call made are removed again if `inside` fails, or
/// unless they are to stay.
///
/// # Errors
/// The folder cannot be made; what fails in it.
pub(crate) fn in_folder<T>(
    folder: &Path,
    stays: bool,
    inside: impl FnOnce() -> Result<T, Error>,
) -> Result<T, Error> {
    let missing = missing_ancestors(folder);
    let made =
        fs::create_dir_all(folder).map_err(|e| Error::not_written("create folder", folder, e));
    let done = made.and_then(|()| inside());
    if done.is_err() || !stays {
        // Deepest first; `remove_dir` leaves a folder that another program has used meanwhile.
        for folder in missing {
            drop(fs::remove_dir(folder));
        }
    }
    done
}

/// The folder and its parents that do not exist, the deepest first.
fn missing_ancestors(folder: &Path) -> Vec<&Path> {
    let mut missing = Vec::new();
    for ancestor in folder.ancestors() {
        if ancestor.as_os_str().is_empty() || ancestor.exists() {
            break;
        }
        missing.push(ancestor);
    }
    missing
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listing(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn group(folder: &Path, names: &[&str]) -> FileGroup {
        let mut group = FileGroup::new(folder);
        for name in names {
            group.add(name, format!("new {name}")).unwrap();
        }
        group
    }

    #[test]
    fn a_group_appears_complete_and_replaces_older_files() {
        let temp = tempfile::tempdir().unwrap();
        let folder = temp.path().join("deep/er");
        group(&folder, &["a", "b"]).commit().unwrap();
        fs::write(folder.join("a"), "old").unwrap();
        let written = group(&folder, &["a", "b", "c"]).commit().unwrap();
        assert_eq!(listing(&folder), ["a", "b", "c"]);
        for path in written {
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            assert_eq!(fs::read_to_string(path).unwrap(), format!("new {name}"));
        }
    }

    #[test]
    fn a_folder_in_the_way_leaves_everything_as_it_was() {
        let temp = tempfile::tempdir().unwrap();
        fs::write(temp.path().join("a"), "old a").unwrap();
        fs::create_dir(temp.path().join("c")).unwrap();
        let error = group(temp.path(), &["a", "b", "c"]).commit().unwrap_err();
        assert!(error.to_string().contains('c'), "{error}");
        assert_eq!(listing(temp.path()), ["a", "c"]);
        assert_eq!(
            fs::read_to_string(temp.path().join("a")).unwrap(),
            "old a",
            "the replaced file must come back"
        );
    }

    #[test]
    fn a_file_in_place_of_the_folder_is_an_error_and_no_folder_stays() {
        let temp = tempfile::tempdir().unwrap();
        let file = temp.path().join("file");
        fs::write(&file, "x").unwrap();
        for folder in [file.clone(), file.join("sub/folder")] {
            assert!(matches!(
                group(&folder, &["a"]).commit(),
                Err(Error::NotWritten { .. })
            ));
        }
        assert_eq!(listing(temp.path()), ["file"]);
        assert_eq!(fs::read_to_string(file).unwrap(), "x");
    }

    #[cfg(unix)]
    #[test]
    fn an_unwritable_folder_is_an_error_and_stays_empty() {
        use std::os::unix::fs::PermissionsExt;
        let temp = tempfile::tempdir().unwrap();
        let folder = temp.path().join("locked");
        fs::create_dir(&folder).unwrap();
        fs::set_permissions(&folder, fs::Permissions::from_mode(0o555)).unwrap();
        let privileged = fs::write(folder.join("probe"), "x").is_ok();
        let result = group(&folder, &["a"]).commit();
        fs::set_permissions(&folder, fs::Permissions::from_mode(0o755)).unwrap();
        if !privileged {
            assert!(matches!(result, Err(Error::NotWritten { .. })));
            assert!(listing(&folder).is_empty());
        }
    }

    #[test]
    fn a_new_folder_is_removed_again_after_a_failure() {
        let temp = tempfile::tempdir().unwrap();
        let folder = temp.path().join("new/folder");
        // 300 characters are longer than any usual file system allows, so the failure comes after the folder was made.
        let long = "x".repeat(300);
        assert!(group(&folder, &["a", &long]).commit().is_err());
        assert!(listing(temp.path()).is_empty());
    }

    #[test]
    fn one_file_is_replaced_whole_or_not_at_all() {
        let temp = tempfile::tempdir().unwrap();
        let path = temp.path().join("one.csv");
        write_atomic(&path, "first").unwrap();
        write_atomic(&path, "second").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "second");
        assert!(write_atomic(&temp.path().join("none/one.csv"), "x").is_err());
        assert_eq!(listing(temp.path()), ["one.csv"]);
    }

    #[test]
    fn a_stage_that_is_going_keeps_its_lock_to_the_end_so_that_a_kill_then_leaves_what_is_swept() {
        let temp = tempfile::tempdir().unwrap();
        let staging = StagingFolder::make(temp.path()).unwrap();
        let root = staging.root.clone();
        let old = staging.old.clone();
        fs::remove_dir(&old).unwrap();
        // What stops the removing, as a kill would.
        fs::write(&old, "").unwrap();
        drop(staging);
        assert_eq!(listing(&root), ["lock", "old"]);
        fs::remove_file(&old).unwrap();
        sweep_stages(temp.path());
        assert!(listing(temp.path()).is_empty());
    }

    #[test]
    fn names_that_leave_the_folder_are_refused() {
        let mut group = FileGroup::new(Path::new("x"));
        for name in ["", ".", "..", "a/b", "/etc/x", "a/"] {
            assert!(group.add(name, "").is_err(), "{name:?}");
        }
        group.add("a", "").unwrap();
        assert!(matches!(group.add("a", ""), Err(Error::Duplicate { .. })));
    }
}
