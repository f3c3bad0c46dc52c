//! Which predictions the test splits of a data set were read with: a line of `scored.csv` in its folder for each, since who chooses
//! between methods by a test split trains with it.
//!
//! Check: the same predictions are one line; a folder that cannot be written is no error.

use crate::io::data_set::Split;
use sha2::{Digest, Sha256};
use std::fs::{OpenOptions, read_to_string};
use std::io::Write;
use std::path::Path;

/// Name of the file.
const FILE: &str = "scored.csv";
const HEADER: &str = "predictions_sha256,splits\n";

/// Adds the text of predictions to the list of a data set, where it may be written and has not got them; those of `train` and
/// `validation` alone need not be in it. Returns the number of other predictions that test splits were scored with before.
#[must_use]
pub fn add_reading(folder: &Path, text: &str, splits: &[Split]) -> usize {
    let path = folder.join(FILE);
    let listed = read_to_string(&path).unwrap_or_default();
    let mut hash = String::new();
    for byte in Sha256::digest(text.as_bytes()) {
        hash += &format!("{byte:02x}");
    }
    let names: Vec<&str> = splits.iter().map(|split| split.name()).collect();
    let line = format!("{hash},{}", names.join(" "));
    let mut others: Vec<&str> = listed.lines().skip(1).filter_map(hash_of).collect();
    others.retain(|other| *other != hash);
    others.sort_unstable();
    others.dedup();
    let is_listed = listed.lines().any(|other| other == line);
    if splits.iter().any(|split| split.is_test()) && !is_listed {
        let header = if listed.is_empty() { HEADER } else { "" };
        // A folder that cannot be written to has no list.
        let _ = append(&path, &format!("{header}{line}\n"));
    }
    others.len()
}

fn hash_of(line: &str) -> Option<&str> {
    line.split_once(',').map(|(hash, _)| hash)
}

fn append(path: &Path, text: &str) -> std::io::Result<()> {
    let mut file = OpenOptions::new().append(true).create(true).open(path)?;
    file.write_all(text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn predictions_are_listed_once_and_others_counted() {
        let temp = tempfile::tempdir().unwrap();
        let add = |text: &str, splits: &[Split]| add_reading(temp.path(), text, splits);
        assert_eq!(add("a", &[Split::TestHome, Split::TestAway]), 0);
        assert_eq!(add("a", &[Split::TestHome, Split::TestAway]), 0);
        assert_eq!(add("b", &[Split::TestHome]), 1);
        assert_eq!(add("c", &[Split::Train]), 2);
        let listed = read_to_string(temp.path().join(FILE)).unwrap();
        // SHA-256 of "a".
        let hash = "ca978112ca1bbdcafac231b39a23dc4da786eff8147c4e72b9807785afee48bb";
        assert!(listed.starts_with(&format!("{HEADER}{hash},test_home test_away\n")));
        assert_eq!(listed.lines().count(), 3);
        let nowhere = temp.path().join("nowhere");
        assert_eq!(add_reading(&nowhere, "a", &[Split::TestHome]), 0);
        assert!(!nowhere.exists());
    }
}
