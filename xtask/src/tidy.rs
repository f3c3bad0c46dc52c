//! `cargo xtask tidy`: the rules of the house that no compiler checks.
//!
//! Who may depend on whom, one line of documentation at the head of each file, file lengths, units
//! in public names, reference curves with a header, and no stray files or private paths.

use crate::workspace::{read, root, tracked_files};
use crate::{Failure, Outcome};
use std::collections::BTreeMap;
use std::path::Path;

/// Crates of the workspace that each crate may depend on.
const MAY_DEPEND_ON: [(&str, &[&str]); 7] = [
    ("crates/optics", &[]),
    ("crates/les", &[]),
    ("crates/signal", &[]),
    ("crates/estimate", &[]),
    ("crates/sim", &["optics", "les", "signal", "estimate"]),
    ("xtask", &["optics", "les", "signal", "estimate", "sim"]),
    ("tests", &["optics", "les", "signal", "estimate", "sim"]),
];

/// Longest source file, in lines of code: what explains them may take the room that it needs.
const MAX_CODE_LINES: usize = 500;

/// Files and folders that may stand at the top.
const TOP_LEVEL: [&str; 15] = [
    ".cargo",
    ".ci",
    ".gitignore",
    "CHANGELOG.md",
    "CITATION.cff",
    "Cargo.lock",
    "Cargo.toml",
    "LICENSE",
    "README.md",
    "clippy.toml",
    "crates",
    "docs",
    "rustfmt.toml",
    "tests",
    "xtask",
];

/// File types that may stand anywhere below.
const EXTENSIONS: [&str; 10] = ["rs", "toml", "csv", "md", "svg", "png", "lock", "cff", "css", "json"];

/// What only a machine knows must not stand in the repository.
const PRIVATE: [&str; 5] = ["/home/", "/root/", "/work/", "/tmp/", "C:\\Users"];

/// Words that name a physical quantity: a public number of that name needs a unit at its end.
const QUANTITIES: [&str; 26] = [
    "range",
    "velocity",
    "speed",
    "time",
    "frequency",
    "wavelength",
    "length",
    "radius",
    "height",
    "width",
    "distance",
    "thickness",
    "spacing",
    "power",
    "energy",
    "duration",
    "elevation",
    "azimuth",
    "angle",
    "circulation",
    "bandwidth",
    "backscatter",
    "extinction",
    "area",
    "wavenumber",
    "position",
];

/// What a name with a unit ends with; a fraction has none.
const UNITS: [&str; 36] = [
    "_m",
    "_s",
    "_hz",
    "_rad",
    "_rad_m",
    "_m_s",
    "_m2_s",
    "_m2",
    "_m3",
    "_m13",
    "_j",
    "_w",
    "_a",
    "_a_w",
    "_a2",
    "_db",
    "_per_m",
    "_per_s",
    "_per_m_sr",
    "_per_m2",
    "_deg",
    "_kg",
    "_kg_m3",
    "_m_m23",
    "_n",
    "_bytes",
    "_samples",
    "_m_s2",
    "_m2_s2",
    "_m4_s2",
    "_m5_s2",
    "_m5_s3",
    "_a2_hz",
    "_per_hz",
    "_fraction",
    "_per_sqrt_s",
];

/// Public numbers that name a quantity but have no unit of the SI: the path begins with the first word.
const WITHOUT_UNIT: [(&str, &str); 5] = [
    // In the square of whatever unit the caller's samples have.
    ("crates/estimate/src/estimators/velocity.rs", "power"),
    ("crates/estimate/src/models/autoregressive.rs", "noise_power"),
    // In spacings of the pair.
    ("crates/les/src/solver/cases/vortex_pair.rs", "height"),
    ("crates/les/src/solver/cases/vortex_pair.rs", "core_radius"),
    // In drawing units.
    ("crates/sim/src/plot/", "width"),
];

/// Checks the tree; every violation is printed.
///
/// # Errors
/// When there is any.
pub(crate) fn run() -> Outcome {
    let mut found = Vec::new();
    let files = tracked_files()?;
    for file in &files {
        check_place(file, &mut found);
        match Path::new(file).extension().and_then(|e| e.to_str()) {
            Some("rs") => check_source(file, &read(file)?, &mut found),
            Some("csv") if file.starts_with("tests/reference/") => check_reference(file, &read(file)?, &mut found),
            _ => {}
        }
        if file.ends_with(".rs") || file.ends_with(".md") || file.ends_with(".toml") || file.ends_with(".csv") {
            check_private(file, &read(file)?, &mut found);
        }
    }
    for (folder, allowed) in MAY_DEPEND_ON {
        check_manifest(folder, allowed, &read(&format!("{folder}/Cargo.toml"))?, &mut found);
    }
    if found.is_empty() {
        println!("tidy: {} files, nothing to complain of", files.len());
        return Ok(());
    }
    for line in &found {
        println!("tidy: {line}");
    }
    Err(Failure::new(format!("tidy: {} violations", found.len())))
}

fn check_place(file: &str, found: &mut Vec<String>) {
    let top = file.split('/').next().unwrap_or(file);
    if !TOP_LEVEL.contains(&top) {
        found.push(format!("{file}: a stray file at the top level"));
    }
    let path = Path::new(file);
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    let named = ["LICENSE", ".gitignore", ".ci/run"].contains(&file);
    if !named && !EXTENSIONS.contains(&extension) {
        found.push(format!("{file}: no file of this type belongs here"));
    }
    if !root().join(file).exists() {
        found.push(format!("{file}: tracked but not there"));
    }
}

fn check_source(file: &str, text: &str, found: &mut Vec<String>) {
    if !text.starts_with("//!") && !text.starts_with("#![") {
        found.push(format!("{file}:1: begin with `//!`: what the file is for"));
    }
    let is_code = |line: &&str| !line.trim().is_empty() && !line.trim_start().starts_with("//");
    let lines = text.lines().filter(is_code).count();
    if lines > MAX_CODE_LINES {
        found.push(format!("{file}: {lines} lines of code, at most {MAX_CODE_LINES}: split it by subject"));
    }
    for (i, line) in text.lines().enumerate() {
        let unfinished = ["TODO", "FIXME", "todo!(", "unimplemented!("].iter().any(|word| line.contains(word));
        if unfinished && !file.ends_with("tidy.rs") {
            found.push(format!("{file}:{}: unfinished work", i + 1));
        }
        let bare = public_number(line).filter(|name| lacks_unit(name) && !excused(file, name));
        if let Some(name) = bare.filter(|_| file.starts_with("crates/")) {
            found.push(format!("{file}:{}: `{name}` needs its unit, as in `{name}_m`", i + 1));
        }
    }
}

/// The name of a public field of floating point type, such as `pub range_m: Vec<f64>`.
fn public_number(line: &str) -> Option<&str> {
    let (name, kind) = line.trim().strip_prefix("pub ")?.split_once(':')?;
    let kind = kind.trim().trim_end_matches(',');
    let number = ["f64", "f32", "Vec<f64>", "Option<f64>", "Array1<f64>", "Array2<f64>", "(f64, f64)"].contains(&kind);
    (number && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')).then_some(name)
}

fn lacks_unit(name: &str) -> bool {
    let names_quantity = name.split('_').any(|word| QUANTITIES.contains(&word));
    names_quantity && !UNITS.iter().any(|unit| name.ends_with(unit))
}

fn excused(file: &str, name: &str) -> bool {
    WITHOUT_UNIT.iter().any(|(path, number)| file.starts_with(path) && name == *number)
}

fn check_reference(file: &str, text: &str, found: &mut Vec<String>) {
    if !text.starts_with('#') {
        found.push(format!(
            "{file}:1: a reference curve says in `#` lines what it is, its source, units and uncertainty"
        ));
    }
}

fn check_private(file: &str, text: &str, found: &mut Vec<String>) {
    if file == "xtask/src/tidy.rs" {
        return;
    }
    for (i, line) in text.lines().enumerate() {
        for word in PRIVATE.iter().filter(|word| line.contains(**word)) {
            found.push(format!("{file}:{}: `{word}` is a path of one machine", i + 1));
        }
    }
}

fn check_manifest(folder: &str, allowed: &[&str], text: &str, found: &mut Vec<String>) {
    let mut section = "";
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    for (i, line) in text.lines().enumerate() {
        if line.starts_with('[') {
            section = line.trim_matches(['[', ']']);
        }
        let Some((key, value)) = line.split_once('=').filter(|_| section.ends_with("dependencies")) else { continue };
        let name = key.trim().split('.').next().unwrap_or("");
        if !line.contains("workspace = true") {
            found.push(format!(
                "{folder}/Cargo.toml:{}: `{name}`: versions stand in the workspace ({})",
                i + 1,
                value.trim()
            ));
        }
        if name.strip_prefix("wakescope-").is_some_and(|own| !allowed.contains(&own)) {
            found.push(format!("{folder}/Cargo.toml:{}: must not know `{name}`", i + 1));
        }
        if name == "ndarray-linalg" && folder != "crates/estimate" {
            found.push(format!("{folder}/Cargo.toml:{}: ndarray-linalg belongs to estimate alone", i + 1));
        }
        if section == "dependencies" && seen.insert(name, i).is_some() {
            found.push(format!("{folder}/Cargo.toml:{}: `{name}` twice", i + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn complaints(check: impl FnOnce(&mut Vec<String>)) -> Vec<String> {
        let mut found = Vec::new();
        check(&mut found);
        found
    }

    #[test]
    fn a_public_quantity_without_unit_is_found() {
        let source = "//! x\n    pub range: Vec<f64>,\n    pub range_m: Vec<f64>,\n    pub quality: f64,\n";
        let found = complaints(|f| check_source("crates/les/src/a.rs", source, f));
        assert_eq!(found, ["crates/les/src/a.rs:2: `range` needs its unit, as in `range_m`"]);
    }

    #[test]
    fn a_forbidden_dependency_is_found() {
        let manifest = "[dependencies]\nwakescope-les.workspace = true\n";
        assert_eq!(complaints(|f| check_manifest("crates/optics", &[], manifest, f)).len(), 1);
        assert!(complaints(|f| check_manifest("crates/sim", &["les"], manifest, f)).is_empty());
        let version = "[dependencies]\nserde = \"1\"\n";
        assert_eq!(complaints(|f| check_manifest("crates/sim", &[], version, f)).len(), 1);
    }

    #[test]
    fn stray_files_and_headless_sources_are_found() {
        assert!(!complaints(|f| check_place("notes.txt", f)).is_empty());
        assert!(!complaints(|f| check_source("crates/les/src/a.rs", "fn a() {}\n", f)).is_empty());
        assert!(!complaints(|f| check_reference("tests/reference/a.csv", "x,y\n", f)).is_empty());
        assert!(!complaints(|f| check_private("docs/a.md", "see /home/me\n", f)).is_empty());
    }
}
