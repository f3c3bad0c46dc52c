//! What a result depends on as one hash: parameters, and the files of some places as they are.

use crate::sources::is_test_file;
use fixtures::failure::Failure;
use sha2::{Digest, Sha256};
use std::path::Path;
use walkdir::WalkDir;

/// Bytes of a hash that are kept.
const HASH_BYTES: usize = 12;

/// Twelve bytes in hexadecimal of the parameters and of the files and folders in `places`, below `root`; tests do not count.
///
/// # Errors
/// A place that is not there, a file that cannot be read.
pub(crate) fn cause(root: &Path, parameters: &[&str], places: &[&str]) -> Result<String, Failure> {
    let mut hash = Sha256::new();
    for parameter in parameters {
        add(&mut hash, parameter.as_bytes());
    }
    for place in places {
        for file in WalkDir::new(root.join(place)).sort_by_file_name() {
            let file = file?;
            let name = file.path().strip_prefix(root)?.to_string_lossy();
            if file.file_type().is_file() && !is_test_file(&name) {
                add(&mut hash, name.as_bytes());
                add(&mut hash, &std::fs::read(file.path())?);
            }
        }
    }
    let mut digits = String::new();
    for byte in hash.finalize().iter().take(HASH_BYTES) {
        digits += &format!("{byte:02x}");
    }
    Ok(digits)
}

/// Adds some bytes and how many they are.
fn add(hash: &mut Sha256, bytes: &[u8]) {
    hash.update(bytes.len().to_le_bytes());
    hash.update(bytes);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(temp: &tempfile::TempDir, file: &str, text: &str) {
        let path = temp.path().join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    #[test]
    fn files_and_parameters_change_it_tests_and_other_places_keep_it() {
        let temp = tempfile::tempdir().unwrap();
        for (file, text) in [
            ("Cargo.lock", "1.0.0"),
            ("one/src/lib.rs", "fn one() {}"),
            ("two/src/a/b.rs", "fn two() {}"),
        ] {
            write(&temp, file, text);
        }
        let of =
            |parameter: &str, places: &[&str]| cause(temp.path(), &[parameter], places).unwrap();
        let one = || of("quick", &["one", "Cargo.lock"]);
        let before = one();
        write(&temp, "one/src/one_tests.rs", "fn test() {}");
        write(&temp, "one/tests/it/main.rs", "fn test() {}");
        write(&temp, "two/src/a/b.rs", "fn two() { panic!() }");
        assert_eq!(one(), before);
        assert_ne!(of("full", &["one", "Cargo.lock"]), before);
        assert_ne!(of("quick", &["one", "two", "Cargo.lock"]), before);
        write(&temp, "Cargo.lock", "1.0.1");
        let newer = one();
        assert_ne!(newer, before);
        write(&temp, "one/src/lib.rs", "fn one() { return }");
        assert_ne!(one(), newer);
        assert!(cause(temp.path(), &[], &["three"]).is_err());
    }
}
