//! Files that the ranks of a flow write together: the first one makes them, each writes the parts that it has, and when all are
//! on disk the first one puts them into place.
//!
//! Check: files of ranks against those of one process, a rank whose part cannot be written, a rank that is lost.

use crate::Error;
use crate::io::FileGroup;
use std::path::PathBuf;
use std::sync::Arc;
use wakescope_les::ranks::{self, Ranks, all_gather};

/// An error of one rank is that of all.
pub(super) fn agree<T>(ranks: &Arc<dyn Ranks>, result: Result<T, Error>) -> Result<T, Error> {
    ranks::all_agree(&**ranks, result, Error::Flow)
}

/// Writes the files of a group, which has the same names on all ranks, all of them or none; the folder exists.
///
/// # Errors
/// The first refusal of the system on any rank; the folder is then as it was before.
pub(super) fn commit(group: &FileGroup, ranks: &Arc<dyn Ranks>) -> Result<Vec<PathBuf>, Error> {
    let is_first = ranks.rank() == 0;
    let begun = if is_first { group.begin().map(Some) } else { Ok(None) };
    let stage = agree(ranks, begun.map_err(Error::from))?;
    let name = stage.as_ref().map_or_else(Vec::new, |stage| stage.name().bytes().map(f64::from).collect());
    let name: Vec<u8> = all_gather(&**ranks, name).map_err(Error::Flow)?.iter().map(|byte| *byte as u8).collect();
    agree(ranks, group.write(&String::from_utf8_lossy(&name)).map_err(Error::from))?;
    agree(ranks, stage.map_or(Ok(Vec::new()), |stage| group.put(&stage).map_err(Error::from)))
}

#[cfg(test)]
mod tests {
    use super::super::thread_ranks::on_threads;
    use super::*;
    use crate::io::FileParts;
    use std::fs;

    #[test]
    fn a_file_is_whole_or_not_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let write = |text: &'static str, fails: bool| {
            on_threads(3, |ranks| {
                let rank = ranks.rank();
                let mut group = FileGroup::new(folder.path());
                let part = (rank as u64, vec![text.as_bytes()[rank]]);
                // No file reaches so far.
                let part = if fails && rank == 1 { (u64::MAX, part.1) } else { part };
                group.add_parts("a", FileParts { length: 3, parts: vec![part] }).unwrap();
                commit(&group, &ranks).map_err(|error| error.to_string())
            })
        };
        let names = || fs::read_dir(folder.path()).unwrap().count();
        let written = write("abc", false);
        assert_eq!(written[0], Some(Ok(vec![path.clone()])));
        assert_eq!((fs::read_to_string(&path).unwrap().as_str(), names()), ("abc", 1));
        let failed = write("xyz", true);
        assert!(
            failed.iter().all(|one| matches!(one, Some(Err(words)) if words.contains("cannot write"))),
            "{failed:?}"
        );
        assert_eq!((fs::read_to_string(&path).unwrap().as_str(), names()), ("abc", 1), "nothing is left behind");
    }

    #[test]
    fn a_rank_that_is_lost_leaves_no_file_under_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let found = on_threads(2, |ranks| {
            assert!(ranks.rank() == 0, "this one ends early");
            let mut group = FileGroup::new(folder.path());
            group.add("a", "abc").unwrap();
            commit(&group, &ranks).is_err()
        });
        assert_eq!(found, [Some(true), None]);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
