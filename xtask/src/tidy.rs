//! `cargo xtask tidy`: the rules of the house that no compiler checks.
//!
//! Who may depend on whom, no circles of imports, one line of documentation at the head of each file, units
//! in public names, reference curves with a header, tests and files that pages name, and no stray files or private paths.

use crate::process::output;
use crate::sources::{Modules, circles, is_test_file};
use crate::workspace::{read, root};
use fixtures::failure::{Failure, Outcome};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

/// The rules in numbers and words.
#[derive(Default, Deserialize)]
struct Rules {
    /// Files and folders that may stand at the top.
    top_level: BTreeSet<String>,
    /// File types that may stand anywhere below, and files of others.
    extensions: BTreeSet<String>,
    others: BTreeSet<String>,
    /// What only a machine knows must not stand in the repository.
    private: Vec<String>,
    /// Words that name a physical quantity: a public number of that name needs a unit at its end; a fraction has none.
    quantities: BTreeSet<String>,
    units: Vec<String>,
    /// Public numbers that name a quantity but have no unit of the SI: the path begins with the first word.
    without_unit: Vec<(String, String)>,
    /// Crates that work on one thread without their feature `rayon`.
    with_threads: BTreeSet<String>,
    /// Crates of the workspace that each crate may depend on.
    may_depend_on: BTreeMap<String, BTreeSet<String>>,
}

/// As they stand in their file, which the test reads.
static RULES: LazyLock<Rules> =
    LazyLock::new(|| toml::from_str(include_str!("tidy.toml")).unwrap_or_default());

/// Where they stand and are tested, with words that must stand nowhere else.
const OWN: &str = "xtask/src/tidy.";

/// Checks the tree; every violation is printed.
///
/// # Errors
/// When there is any.
pub(crate) fn run() -> Outcome {
    let mut found = Vec::new();
    let files = tracked_files()?;
    let mut sources = Vec::new();
    let mut pages = Vec::new();
    for file in &files {
        check_place(file, &mut found);
        let extension = Path::new(file)
            .extension()
            .and_then(|e| e.to_str())
            .unwrap_or("");
        if !["rs", "md", "toml", "csv"].contains(&extension) {
            continue;
        }
        let text = read(file)?;
        check_private(file, &text, &mut found);
        match extension {
            "rs" => {
                check_source(file, &text, &mut found);
                sources.push((file.as_str(), text));
            }
            "csv" if file.starts_with("tests/reference/") => {
                check_reference(file, &text, &mut found)
            }
            // Names of columns that a page may speak of.
            "csv" if file.starts_with("crates/") => sources.push((file.as_str(), text)),
            "md" if file == "README.md" || file.starts_with("docs/src/") => {
                pages.push((file.as_str(), text))
            }
            _ => {}
        }
    }
    for (folder, allowed) in &RULES.may_depend_on {
        check_manifest(
            folder,
            allowed,
            &read(&format!("{folder}/Cargo.toml"))?,
            &mut found,
        );
    }
    check_circles(&sources, &mut found);
    check_pages(&pages, &sources, &files, &mut found);
    if found.is_empty() {
        println!("tidy: {} files, nothing to complain of", files.len());
        return Ok(());
    }
    for line in &found {
        println!("tidy: {line}");
    }
    Err(Failure::new(format!("tidy: {} violations", found.len())))
}

/// Paths, from the root, of the files that git tracks or would track.
fn tracked_files() -> Result<Vec<String>, Failure> {
    let text = output(Command::new("git").args([
        "ls-files",
        "--cached",
        "--others",
        "--exclude-standard",
    ]))?;
    Ok(text
        .lines()
        .filter(|f| root().join(f).exists())
        .map(str::to_owned)
        .collect())
}

fn check_place(file: &str, found: &mut Vec<String>) {
    let top = file.split('/').next().unwrap_or(file);
    if !RULES.top_level.contains(top) {
        found.push(format!("{file}: a stray file at the top level"));
    }
    let extension = Path::new(file)
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or("");
    // Files that other programs wrote, for readers to be held against.
    let of_others = file.starts_with("tests/reference/") && ["nc", "npz"].contains(&extension);
    if !of_others && !RULES.extensions.contains(extension) && !RULES.others.contains(file) {
        found.push(format!("{file}: no file of this type belongs here"));
    }
}

fn check_source(file: &str, text: &str, found: &mut Vec<String>) {
    if !text.starts_with("//!") && !text.starts_with("#![") {
        found.push(format!("{file}:1: begin with `//!`: what the file is for"));
    }
    for (i, line) in text.lines().enumerate() {
        if ["TODO", "FIXME"].iter().any(|word| line.contains(word)) && !file.ends_with("tidy.rs") {
            found.push(format!("{file}:{}: unfinished work", i + 1));
        }
        let bare = public_number(line).filter(|name| lacks_unit(name) && !excused(file, name));
        if let Some(name) = bare.filter(|_| file.starts_with("crates/")) {
            found.push(format!(
                "{file}:{}: `{name}` needs its unit, as in `{name}_m`",
                i + 1
            ));
        }
    }
}

/// Files that import one another in a circle: neither can be read, tested or moved without the other.
fn check_circles(sources: &[(&str, String)], found: &mut Vec<String>) {
    let of_crates: Vec<(&str, &str)> = sources
        .iter()
        .filter(|(file, _)| !is_test_file(file))
        .map(|(file, text)| (*file, text.as_str()))
        .collect();
    let imports = Modules::new(&of_crates).imports(true);
    for circle in circles(&imports) {
        for from in &circle {
            for (to, names) in imports[from].iter().filter(|(to, _)| circle.contains(to)) {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                found.push(format!(
                    "{from}: in a circle of imports of {} files: {} from {to}",
                    circle.len(),
                    names.join(", ")
                ));
            }
        }
    }
}

/// What a page sets as code is there: files and folders of the sources, and names of four words and more, tests above all.
fn check_pages(
    pages: &[(&str, String)],
    sources: &[(&str, String)],
    files: &[String],
    found: &mut Vec<String>,
) {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let known: BTreeSet<&str> = sources
        .iter()
        .flat_map(|(_, text)| text.split(move |c| !is_word(c)))
        .collect();
    let is_there = |path: &str| {
        let path = path.trim_end_matches('/');
        files.iter().any(|f| {
            f.strip_prefix(path)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        })
    };
    for (page, text) in pages {
        let lines = text.lines().enumerate();
        for (i, word) in lines.flat_map(|(i, line)| {
            line.split('`')
                .skip(1)
                .step_by(2)
                .map(move |word| (i + 1, word))
        }) {
            if word.starts_with("crates/") && !word.contains(['*', ' ']) && !is_there(word) {
                found.push(format!("{page}:{i}: there is no `{word}`"));
            }
            if word.matches('_').count() >= 3 && word.chars().all(is_word) && !known.contains(word)
            {
                found.push(format!("{page}:{i}: no source has a `{word}`"));
            }
        }
    }
}

/// The name of a public field of floating point type, such as `pub range_m: Vec<f64>`.
fn public_number(line: &str) -> Option<&str> {
    let (name, kind) = line.trim().strip_prefix("pub ")?.split_once(':')?;
    let kind = kind.trim().trim_end_matches(',');
    let number = [
        "f64",
        "f32",
        "Vec<f64>",
        "Option<f64>",
        "Array1<f64>",
        "Array2<f64>",
        "(f64, f64)",
    ]
    .contains(&kind);
    (number
        && name
            .chars()
            .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_'))
    .then_some(name)
}

fn lacks_unit(name: &str) -> bool {
    let names_quantity = name.split('_').any(|word| RULES.quantities.contains(word));
    names_quantity && !RULES.units.iter().any(|unit| name.ends_with(unit))
}

fn excused(file: &str, name: &str) -> bool {
    RULES
        .without_unit
        .iter()
        .any(|(path, number)| file.starts_with(path) && name == number)
}

fn check_reference(file: &str, text: &str, found: &mut Vec<String>) {
    if !text.starts_with('#') {
        found.push(format!(
            "{file}:1: a reference curve says in `#` lines what it is, its source, units and uncertainty"
        ));
    }
}

fn check_private(file: &str, text: &str, found: &mut Vec<String>) {
    if file.starts_with(OWN) {
        return;
    }
    for (i, line) in text.lines().enumerate() {
        for word in RULES.private.iter().filter(|word| line.contains(*word)) {
            found.push(format!(
                "{file}:{}: `{word}` is a path of one machine",
                i + 1
            ));
        }
    }
}

fn check_manifest(folder: &str, allowed: &BTreeSet<String>, text: &str, found: &mut Vec<String>) {
    let mut section = "";
    for (i, line) in text.lines().enumerate() {
        if line.starts_with('[') {
            section = line.trim_matches(['[', ']']);
        }
        let Some((key, value)) = line
            .split_once('=')
            .filter(|_| section.ends_with("dependencies"))
        else {
            continue;
        };
        let name = key.trim().split('.').next().unwrap_or("");
        if !line.contains("workspace = true") {
            found.push(format!(
                "{folder}/Cargo.toml:{}: `{name}`: versions stand in the workspace ({})",
                i + 1,
                value.trim()
            ));
        }
        if name
            .strip_prefix("wakescope-")
            .is_some_and(|own| !allowed.contains(own))
        {
            found.push(format!(
                "{folder}/Cargo.toml:{}: must not know `{name}`",
                i + 1
            ));
        }
        if name == "ndarray-linalg" && folder != "crates/estimate" {
            found.push(format!(
                "{folder}/Cargo.toml:{}: ndarray-linalg belongs to estimate alone",
                i + 1
            ));
        }
        // The workspace turns their default features off, and builds of the whole workspace hide that one is missing.
        let program = folder == "crates/sim" || folder == "xtask";
        if program && RULES.with_threads.contains(name) && !line.contains("\"rayon\"") {
            found.push(format!(
                "{folder}/Cargo.toml:{}: `{name}` without `rayon` works on one thread",
                i + 1
            ));
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
        let source =
            "//! x\n    pub range: Vec<f64>,\n    pub range_m: Vec<f64>,\n    pub quality: f64,\n";
        let found = complaints(|f| check_source("crates/les/src/a.rs", source, f));
        assert_eq!(
            found,
            ["crates/les/src/a.rs:2: `range` needs its unit, as in `range_m`"]
        );
    }

    #[test]
    fn a_forbidden_dependency_is_found() {
        let manifest = "[dependencies]\nwakescope-les.workspace = true\n";
        assert_eq!(
            complaints(|f| check_manifest("crates/optics", &BTreeSet::new(), manifest, f)).len(),
            1
        );
        assert!(
            complaints(|f| check_manifest("crates/sim", &["les".into()].into(), manifest, f))
                .is_empty()
        );
        let one_thread = "[dependencies]\nwakescope-signal.workspace = true\n";
        assert_eq!(
            complaints(|f| check_manifest("crates/sim", &["signal".into()].into(), one_thread, f))
                .len(),
            1
        );
        assert!(
            complaints(|f| check_manifest(
                "crates/estimate",
                &["signal".into()].into(),
                one_thread,
                f
            ))
            .is_empty()
        );
        let version = "[dependencies]\nserde = \"1\"\n";
        assert_eq!(
            complaints(|f| check_manifest("crates/sim", &BTreeSet::new(), version, f)).len(),
            1
        );
    }

    #[test]
    fn stray_files_and_headless_sources_are_found() {
        assert!(!complaints(|f| check_place("notes.txt", f)).is_empty());
        assert!(!complaints(|f| check_source("crates/les/src/a.rs", "fn a() {}\n", f)).is_empty());
        assert!(
            !complaints(|f| check_source("crates/les/src/a.rs", "//! x\n// TODO\n", f)).is_empty()
        );
        assert!(!complaints(|f| check_reference("tests/reference/a.csv", "x,y\n", f)).is_empty());
        assert!(!complaints(|f| check_private("docs/a.md", "see /home/me\n", f)).is_empty());
    }

    #[test]
    fn a_test_that_a_page_names_must_be_there() {
        let sources = [(
            "crates/les/src/a.rs",
            "#[test]\nfn no_air_crosses_the_ground() {}\n".to_owned(),
        )];
        let page =
            "held by `no_air_crosses_the_ground` and `no_air_crosses_a_wall`, `scan.range_max_m`\n"
                .to_owned();
        let found = complaints(|f| check_pages(&[("docs/src/a.md", page)], &sources, &[], f));
        assert_eq!(
            found,
            ["docs/src/a.md:1: no source has a `no_air_crosses_a_wall`"]
        );
    }

    #[test]
    fn a_file_that_a_page_names_must_be_there() {
        let files = ["crates/les/src/a/mod.rs".to_owned()];
        let page = "see `crates/les/src/a`, `crates/les/src/a/mod.rs` and `crates/les/src/b.rs`\n"
            .to_owned();
        let found = complaints(|f| check_pages(&[("docs/src/a.md", page)], &[], &files, f));
        assert_eq!(
            found,
            ["docs/src/a.md:1: there is no `crates/les/src/b.rs`"]
        );
    }

    #[test]
    fn a_circle_is_told_with_the_names_that_close_it() {
        let source = |file, text: &str| (file, text.to_owned());
        let sources = [
            source("xtask/src/a.rs", "use crate::b::f;\nfn g() {}\n"),
            source("xtask/src/b.rs", "use super::a::g;\nfn f() {}\n"),
        ];
        let found = complaints(|found| check_circles(&sources, found));
        assert_eq!(
            found[0],
            "xtask/src/a.rs: in a circle of imports of 2 files: f from xtask/src/b.rs"
        );
    }
}
