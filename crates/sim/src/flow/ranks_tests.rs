//! Runs on ranks: the files of one process, byte for byte.

use super::execute::run_on;
use super::thread_ranks::on_threads;
use super::{Begin, CaseFile};
use crate::progress::{Observer, Silent};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// A small wake with records, fields in all formats, planes, and checkpoints.
fn wake(more: &str) -> String {
    format!(
        "[case]\nkind = \"wake\"\ncells = [6, 32, 24]\nreynolds = 1000.0\nperturbation = 0.05\n\
         [wake]\nend_tau = 0.1\nevery_tau = 0.02\nfields_tau = [0.1]\nplanes_tau = [0.05, 0.1]\n\
         [output]\nfields = [\"netcdf\", \"initial_netcdf\"]\n[checkpoint]\nevery_steps = 2\n\
         {more}[solver]\nsubgrid = {{ model = \"multiscale_wale\" }}\n"
    )
}

/// Runs the case; the words of each rank's error, if any.
fn run(text: &str, folder: &Path, begin: Begin, count: usize) -> Vec<Option<String>> {
    let file = CaseFile::parse(text, Path::new("case.toml")).unwrap();
    let run = |ranks| {
        run_on(&ranks, &file, folder, begin, false, &Silent)
            .err()
            .map(|e| e.to_string())
    };
    on_threads(count, run)
        .into_iter()
        .map(|error| error.unwrap())
        .collect()
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entry = |entry: std::io::Result<fs::DirEntry>| {
        let path = entry.unwrap().path();
        (
            path.file_name().unwrap().to_string_lossy().into_owned(),
            fs::read(path).unwrap(),
        )
    };
    fs::read_dir(folder)
        .unwrap()
        .filter(|entry| entry.as_ref().unwrap().path().is_file())
        .map(entry)
        .collect()
}

#[test]
fn every_file_has_the_bytes_of_one_process_also_after_a_restart_on_other_ranks() {
    let new = || tempfile::tempdir().unwrap();
    let paused = wake("[time]\npause_after_steps = 3\n");
    let whole = wake("");
    let alone = new();
    let ranks = new();
    assert_eq!(run(&paused, alone.path(), Begin::New, 1), [None]);
    assert_eq!(
        run(&paused, ranks.path(), Begin::New, 3),
        [None, None, None]
    );
    assert!(
        files(alone.path()).len() > 3 && files(ranks.path()) == files(alone.path()),
        "paused"
    );
    assert_eq!(run(&whole, alone.path(), Begin::Restart, 1), [None]);
    assert_eq!(run(&whole, ranks.path(), Begin::Restart, 2), [None, None]);
    let expected = files(alone.path());
    let found = files(ranks.path());
    assert!(expected.len() > 8, "{:?}", expected.keys());
    assert!(
        found.keys().eq(expected.keys()),
        "{:?} against {:?}",
        found.keys(),
        expected.keys()
    );
    for (name, bytes) in &expected {
        assert!(found[name] == *bytes, "{name}");
    }
    let ranks = new();
    assert_eq!(run(&whole, ranks.path(), Begin::New, 2), [None, None]);
    // What rank 0 finds in its folder stops all.
    let refused = run(&whole, ranks.path(), Begin::New, 2);
    assert!(
        refused
            .iter()
            .all(|error| error.as_ref().is_some_and(|e| e.contains("--restart"))),
        "{refused:?}"
    );
    let many = run(&whole, new().path(), Begin::New, 7);
    assert!(
        many.iter()
            .all(|error| error.as_ref().is_some_and(|e| e.contains("at most 6"))),
        "{many:?}"
    );
}

#[test]
fn an_output_that_one_rank_cannot_write_stops_all_and_leaves_no_part_of_it() {
    let folder = tempfile::tempdir().unwrap();
    // A folder in the way of the fields: rank 0 sees it when all have written their parts.
    let name = "fields_0001.nc";
    let text = wake("");
    let file = CaseFile::parse(&text, Path::new("case.toml")).unwrap();
    let blocked = folder.path().join(name);
    let found = on_threads(3, |ranks| {
        let blocks = Blocks(&blocked);
        run_on(&ranks, &file, folder.path(), Begin::New, false, &blocks)
            .err()
            .map(|e| e.to_string())
    });
    assert!(
        found
            .iter()
            .all(|one| matches!(one, Some(Some(words)) if words.contains(name))),
        "{found:?}"
    );
    let left = files(folder.path());
    assert!(
        left.keys()
            .all(|name| !name.starts_with("fields") && !name.starts_with('.')),
        "{:?}",
        left.keys()
    );
    assert!(left.contains_key("flow.checkpoint"), "{:?}", left.keys());
}

/// Puts a folder in the way of a file when the run has begun.
struct Blocks<'a>(&'a Path);

impl Observer for Blocks<'_> {
    fn reach(&self, _: &str) {
        fs::create_dir_all(self.0).unwrap();
    }
}
