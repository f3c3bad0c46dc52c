//! What a result depends on as one hash: parameters, the code that computes it, the versions of what that code uses.
//!
//! Comments, blank lines and tests of Rust sources do not count, nor does anything outside the named places.

use crate::failure::Failure;
use crate::sources::{Modules, code_lines, is_test_file};
use serde::Deserialize;
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The libraries that `sim` joins.
const JOINED: [&str; 4] = ["optics", "les", "signal", "estimate"];

/// What figures use of `sim` that brings none of the libraries into their numbers.
const WITHOUT_LIBRARIES: [&str; 5] = ["flow", "io", "plot", "scene", "PROGRAM"];

/// What a file of this program depends on: the files that it imports, the libraries that these name, all of them where a
/// whole scene is run, and the stored numbers.
///
/// # Errors
/// A file that cannot be read.
pub(crate) fn places_of(root: &Path, file: &str) -> Result<Vec<String>, Failure> {
    let mut files = Vec::new();
    collect(root, "xtask/src", &mut files)?;
    let texts: Vec<String> = files.iter().map(|f| std::fs::read_to_string(root.join(f))).collect::<Result<_, _>>()?;
    let modules: Vec<(&str, &str)> = files.iter().map(String::as_str).zip(texts.iter().map(String::as_str)).collect();
    let modules = Modules::new(&modules);
    let (own, libraries) = modules.needs(file);
    let joins = |(of, name): &(&str, &str)| *of == "fixtures" || *of == "sim" && !WITHOUT_LIBRARIES.contains(name);
    let runs_scenes = libraries.iter().any(joins);
    let named = |library: &&str| runs_scenes || libraries.iter().any(|(of, _)| of == library);
    let mut out: Vec<String> = own.into_iter().map(String::from).collect();
    if out.iter().any(|file| file.ends_with("/references.rs")) {
        out.push("tests/reference/les".into());
    }
    if out.iter().any(|file| file.ends_with("/wakes.rs")) {
        out.push("tests/reference/wake".into());
    }
    if libraries.iter().any(|(of, _)| *of == "fixtures") {
        out.push("xtask/fixtures".into());
    }
    out.extend(JOINED.into_iter().filter(named).chain(["sim"]).map(|library| format!("crates/{library}")));
    Ok(out)
}

/// Twelve bytes in hexadecimal of the parameters and of the code in `places`, below `root`: crates with their
/// dependencies, folders, files.
///
/// # Errors
/// A place without sources, a file that cannot be read.
pub(crate) fn cause(root: &Path, parameters: &[&str], places: &[impl AsRef<str>]) -> Result<String, Failure> {
    let mut hash = Sha256::new();
    let mut packages = BTreeSet::new();
    let mut add = |text: &str| {
        hash.update(text.len().to_le_bytes());
        hash.update(text);
    };
    parameters.iter().for_each(|parameter| add(parameter));
    let lock = Lock::read(root)?;
    for place in places.iter().map(AsRef::as_ref) {
        let is_crate = root.join(place).join("Cargo.toml").exists();
        let mut files = Vec::new();
        collect(root, &if is_crate { format!("{place}/src") } else { place.into() }, &mut files)?;
        if is_crate {
            files.push(format!("{place}/Cargo.toml"));
            lock.follow(&manifest(root, place)?.package.name, root, &mut packages)?;
        }
        for file in files.iter().filter(|file| !is_test_file(file)) {
            let bytes = std::fs::read(root.join(file)).map_err(|e| Failure::new(format!("cannot read {file}: {e}")))?;
            let text = String::from_utf8_lossy(&bytes);
            add(file);
            add(&if file.ends_with(".rs") { code_lines(&text).join("\n") } else { text.into_owned() });
        }
    }
    packages.iter().for_each(|package| add(package));
    Ok(hash.finalize().iter().take(12).map(|b| format!("{b:02x}")).collect())
}

/// Files of a place, in the order of their names.
fn collect(root: &Path, place: &str, files: &mut Vec<String>) -> Result<(), Failure> {
    let path = root.join(place);
    if path.is_file() {
        files.push(place.into());
        return Ok(());
    }
    let entries = std::fs::read_dir(&path).map_err(|e| Failure::new(format!("no sources in {place}: {e}")))?;
    let mut names: Vec<String> =
        entries.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned())).collect::<std::io::Result<_>>()?;
    names.sort();
    names.iter().try_for_each(|name| collect(root, &format!("{place}/{name}"), files))
}

/// What a manifest says of its dependencies; those of tests and benchmarks compute nothing that is kept.
#[derive(Deserialize)]
struct Manifest {
    package: Name,
    #[serde(default)]
    dependencies: BTreeMap<String, toml::Value>,
}

#[derive(Deserialize)]
struct Name {
    name: String,
}

fn manifest(root: &Path, place: &str) -> Result<Manifest, Failure> {
    Ok(toml::from_str(&std::fs::read_to_string(root.join(place).join("Cargo.toml"))?)?)
}

#[derive(Deserialize)]
struct Lock {
    package: Vec<Package>,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    version: String,
    #[serde(default)]
    checksum: String,
    #[serde(default)]
    dependencies: Vec<String>,
}

impl Lock {
    fn read(root: &Path) -> Result<Self, Failure> {
        Ok(toml::from_str(&std::fs::read_to_string(root.join("Cargo.lock"))?)?)
    }

    /// Adds the packages that one needs from elsewhere, with versions and checksums; `wanted` is a name, and a version
    /// where there are several.
    fn follow(&self, wanted: &str, root: &Path, found: &mut BTreeSet<String>) -> Result<(), Failure> {
        let (name, version) = wanted.split_once(' ').unwrap_or((wanted, ""));
        for package in self.package.iter().filter(|p| p.name == name && p.version.starts_with(version)) {
            if let Some(own) = package.name.strip_prefix("wakescope-") {
                let of_manifest = manifest(root, &format!("crates/{own}"))?.dependencies;
                of_manifest
                    .keys()
                    .filter(|d| !d.starts_with("wakescope-"))
                    .try_for_each(|d| self.follow(d, root, found))?;
            } else if found.insert(format!("{} {} {}", package.name, package.version, package.checksum)) {
                package.dependencies.iter().try_for_each(|d| self.follow(d, root, found))?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two crates, of which `one` needs `number 1.0.0` from elsewhere.
    fn workspace() -> tempfile::TempDir {
        let temp = tempfile::tempdir().unwrap();
        for (file, text) in [
            ("Cargo.lock", LOCK),
            ("crates/one/Cargo.toml", "[package]\nname = \"wakescope-one\"\n[dependencies]\nnumber = \"1\"\n"),
            ("crates/one/src/lib.rs", "//! One.\nfn one() {}\n"),
            ("crates/two/Cargo.toml", "[package]\nname = \"wakescope-two\"\n"),
            ("crates/two/src/a/b.rs", "fn two() {}\n"),
        ] {
            write(&temp, file, text);
        }
        temp
    }

    const LOCK: &str = "[[package]]\nname = \"wakescope-one\"\nversion = \"0.1.0\"\n[[package]]\nname = \"number\"\nversion = \"1.0.0\"\n\
                        [[package]]\nname = \"other\"\nversion = \"1.0.0\"\n";

    fn write(temp: &tempfile::TempDir, file: &str, text: &str) {
        let path = temp.path().join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    fn one(temp: &tempfile::TempDir) -> String {
        cause(temp.path(), &["quick"], &["crates/one"]).unwrap()
    }

    #[test]
    fn comments_tests_and_other_crates_keep_a_result() {
        let temp = workspace();
        let before = one(&temp);
        write(&temp, "crates/one/src/lib.rs", "//! Another word.\n\nfn one() {}\n\n#[cfg(test)]\nmod tests {\n}\n");
        write(&temp, "crates/one/src/one_tests.rs", "fn test() {}\n");
        write(&temp, "crates/two/src/a/b.rs", "fn two() { panic!() }\n");
        write(&temp, "Cargo.lock", &LOCK.replace("other\"\nversion = \"1.0.0", "other\"\nversion = \"1.0.1"));
        assert_eq!(one(&temp), before);
    }

    #[test]
    fn code_parameters_and_versions_change_it() {
        let temp = workspace();
        let before = one(&temp);
        assert_ne!(cause(temp.path(), &["full"], &["crates/one"]).unwrap(), before);
        assert_ne!(cause(temp.path(), &["quick"], &["crates/one", "crates/two/src/a"]).unwrap(), before);
        write(&temp, "Cargo.lock", &LOCK.replace("number\"\nversion = \"1.0.0", "number\"\nversion = \"1.0.1"));
        let newer = one(&temp);
        assert_ne!(newer, before);
        write(&temp, "crates/one/src/lib.rs", "//! One.\nfn one() { return }\n");
        assert_ne!(one(&temp), newer);
        assert!(cause(temp.path(), &[], &["crates/three"]).is_err());
    }

    #[test]
    fn a_figure_depends_on_what_it_uses_alone() {
        let of = |name: &str| places_of(&crate::workspace::root(), &format!("xtask/src/figures/{name}.rs")).unwrap();
        let has = |places: &[String], place: &str| places.iter().any(|p| p == place);
        let (formula, wake, scan) = (of("fig01"), of("fig07"), of("fig10"));
        let used = ["les", "optics", "estimate"].map(|library| has(&formula, &format!("crates/{library}")));
        assert_eq!(used, [true, false, false], "{formula:?}");
        assert!(has(&wake, "xtask/src/wakes.rs") && has(&wake, "tests/reference/les") && !has(&wake, "crates/signal"));
        assert!(JOINED.iter().all(|library| has(&scan, &format!("crates/{library}"))), "{scan:?}");
        assert!(has(&scan, "xtask/src/figures/study.rs") && !has(&scan, "xtask/src/figures/fig11.rs"));
    }
}
