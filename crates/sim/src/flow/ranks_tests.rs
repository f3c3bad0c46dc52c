//! Runs on ranks: the files of one process, byte for byte.

use super::execute::{RunOptions, run_on};
use super::{Begin, CaseFile, Unwatched};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use wakescope_les::ranks::on_threads;

/// A small wake with records, fields, planes and checkpoints.
fn wake(more: &str) -> String {
    let format = if cfg!(feature = "netcdf") { "netcdf" } else { "csv" };
    format!(
        "[case]\nkind = \"wake\"\ncells = [6, 32, 24]\nreynolds = 1000.0\nperturbation = 0.05\n\
         [wake]\nend_tau = 0.1\nevery_tau = 0.02\nfields_tau = [0.1]\nplanes_tau = [0.05, 0.1]\n\
         [output]\nfields = [\"{format}\"]\nplanes = [\"{format}\"]\n[solver]\nsubgrid = {{ model = \"multiscale_wale\" }}\n\
         [checkpoint]\nevery_steps = 2\n{more}"
    )
}

/// Runs the case; the words of each rank's error, if any.
fn run(text: &str, folder: &Path, begin: Begin, count: usize) -> Vec<Option<String>> {
    let file = CaseFile::parse(text, Path::new("case.toml")).unwrap();
    let options = RunOptions { begin, allow_large: false };
    let run = |ranks| run_on(&ranks, &file, folder, options, &mut Unwatched).err().map(|e| e.to_string());
    on_threads(count, run).into_iter().map(|error| error.unwrap()).collect()
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entry = |entry: std::io::Result<fs::DirEntry>| {
        let path = entry.unwrap().path();
        (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read(path).unwrap())
    };
    fs::read_dir(folder).unwrap().map(entry).collect()
}

#[test]
fn every_file_has_the_bytes_of_one_process_also_after_a_restart_on_other_ranks() {
    let new = || tempfile::tempdir().unwrap();
    let (paused, whole) = (wake("[time]\npause_after_steps = 3\n"), wake(""));
    let (alone, ranks) = (new(), new());
    assert_eq!(run(&paused, alone.path(), Begin::New, 1), [None]);
    assert_eq!(run(&paused, ranks.path(), Begin::New, 3), [None, None, None]);
    assert!(files(alone.path()).len() > 3 && files(ranks.path()) == files(alone.path()), "paused");
    assert_eq!(run(&whole, alone.path(), Begin::Restart, 1), [None]);
    assert_eq!(run(&whole, ranks.path(), Begin::Restart, 2), [None, None]);
    let (expected, found) = (files(alone.path()), files(ranks.path()));
    assert!(expected.len() > 5, "{:?}", expected.keys());
    assert!(found.keys().eq(expected.keys()), "{:?} against {:?}", found.keys(), expected.keys());
    for (name, bytes) in &expected {
        assert!(found[name] == *bytes, "{name}");
    }
    // What rank 0 finds in its folder stops all.
    let refused = run(&whole, ranks.path(), Begin::New, 2);
    assert!(refused.iter().all(|error| error.as_ref().is_some_and(|e| e.contains("--restart"))), "{refused:?}");
    let many = run(&whole, new().path(), Begin::New, 7);
    assert!(many.iter().all(|error| error.as_ref().is_some_and(|e| e.contains("at most 6"))), "{many:?}");
}
