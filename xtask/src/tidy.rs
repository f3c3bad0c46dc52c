//! `cargo xtask tidy`: the rules of the house that no compiler checks.
//!
//! Who may depend on whom, no circles of imports, no imports of higher layers, links of pages and the files and tests that they
//! name, private paths, units in public names, heads of reference files.

mod links;

use crate::process::output;
use crate::sources::{Imports, circles, imports, is_test_file};
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
    /// Beginnings of paths that only one machine has.
    private: Vec<String>,
    /// Words that no page, message or help has.
    not_plain: Vec<String>,
    /// Words that name a physical quantity: a public number of that name ends in its unit.
    quantities: BTreeSet<String>,
    units: Vec<String>,
    /// Public numbers that name a quantity but have no unit of the SI: beginning of the path, name.
    without_unit: Vec<(String, String)>,
    /// Crates of the workspace that each crate may depend on.
    may_depend_on: BTreeMap<String, BTreeSet<String>>,
    /// Modules of a crate from the lowest to the highest: each imports those before it alone.
    layers: BTreeMap<String, Vec<String>>,
    /// Modules of a crate that are in no layer.
    beside_layers: BTreeMap<String, BTreeSet<String>>,
    /// Other crates that one crate alone may depend on.
    for_one_crate: BTreeMap<String, String>,
}

/// As in their file, which the test reads.
static RULES: LazyLock<Rules> =
    LazyLock::new(|| toml::from_str(include_str!("tidy.toml")).unwrap_or_default());

/// Where the private paths are listed and tested.
const OWN: &str = "xtask/src/tidy";

/// Extensions of the files that are read.
const READ: [&str; 3] = ["rs", "md", "toml"];

/// A file and its content.
struct SourceFile {
    /// Path from the root.
    path: String,
    text: String,
}

impl SourceFile {
    fn extension(&self) -> &str {
        extension(&self.path)
    }

    /// Whether its links and names are checked.
    fn is_page(&self) -> bool {
        self.extension() == "md"
            && (self.path.starts_with("docs/src/")
                || self.path == "README.md"
                || self.path == "CONTRIBUTING.md")
    }

    /// Whether its words are names that a page may use: items, and columns of tables of a crate.
    fn has_names(&self) -> bool {
        self.extension() == "rs" || self.extension() == "csv" && self.path.starts_with("crates/")
    }
}

/// Checks the tree; every violation is printed.
///
/// # Errors
/// Fails if there is one.
pub(crate) fn run() -> Outcome {
    let paths = tracked_files()?;
    let mut files = Vec::new();
    for path in &paths {
        if is_read(path) {
            files.push(SourceFile {
                text: read(path)?,
                path: path.clone(),
            });
        }
    }
    let mut found = Vec::new();
    for file in &files {
        check_private(file, &mut found);
        check_words(file, &mut found);
        check_units(file, &mut found);
        check_reference(file, &mut found);
    }
    for (folder, allowed) in &RULES.may_depend_on {
        let manifest = read(&format!("{folder}/Cargo.toml"))?;
        check_manifest(folder, allowed, &manifest, &mut found);
    }
    check_imports(&files, &mut found);
    links::check(&files, &paths, &mut found);
    if found.is_empty() {
        println!("tidy: {} files, no violations", paths.len());
        return Ok(());
    }
    for line in &found {
        println!("tidy: {line}");
    }
    Err(Failure::new(format!("tidy: {} violations", found.len())))
}

/// Whether a rule is about the file. Other tables are files as users have them, of any encoding.
fn is_read(path: &str) -> bool {
    let is_table = path.starts_with("crates/") || path.starts_with("tests/reference/");
    READ.contains(&extension(path)) || is_table && extension(path) == "csv"
}

fn extension(path: &str) -> &str {
    let extension = Path::new(path).extension();
    extension.and_then(|e| e.to_str()).unwrap_or("")
}

/// Paths, from the root, of the files that git tracks or would track.
fn tracked_files() -> Result<Vec<String>, Failure> {
    let mut list = Command::new("git");
    list.args(["ls-files", "--cached", "--others", "--exclude-standard"]);
    let text = output(&mut list)?;
    let present = text.lines().filter(|path| root().join(path).exists());
    Ok(present.map(str::to_owned).collect())
}

/// Pages, texts of the program and its help have none of the words that the field does not use.
fn check_words(file: &SourceFile, found: &mut Vec<String>) {
    let path = &file.path;
    let is_program = file.extension() == "rs" && path.contains("/src/") && !is_test_file(path);
    if !(file.is_page() || is_program && !path.starts_with(OWN)) {
        return;
    }
    for (i, line) in file.text.lines().enumerate() {
        if line.starts_with("mod tests {") {
            return;
        }
        // Of a source the texts between quotation marks, and what becomes help.
        let is_help = path.starts_with("crates/sim/src/cli/") && line.contains("/// ");
        let text = if is_program && !is_help {
            let parts: Vec<&str> = line.split('"').skip(1).step_by(2).collect();
            parts.join("\n")
        } else {
            line.to_owned()
        };
        for word in &RULES.not_plain {
            if has_word(&text, word) {
                found.push(format!("{path}:{}: `{word}` is no plain English", i + 1));
            }
        }
    }
}

/// Whether a text has a word or some, not as a part of a longer one.
fn has_word(text: &str, word: &str) -> bool {
    let is_border = |c: Option<char>| c.is_none_or(|c| !c.is_alphanumeric() && c != '_');
    text.match_indices(word).any(|(at, _)| {
        let after = text[at + word.len()..].chars().next();
        is_border(text[..at].chars().next_back()) && is_border(after)
    })
}

/// Public numbers that name a quantity end in its unit.
fn check_units(file: &SourceFile, found: &mut Vec<String>) {
    let path = &file.path;
    if file.extension() != "rs" || !path.starts_with("crates/") {
        return;
    }
    for (i, line) in file.text.lines().enumerate() {
        let Some(name) = public_number(line) else {
            continue;
        };
        if lacks_unit(name) && !is_excused(path, name) {
            found.push(format!(
                "{path}:{}: `{name}` needs its unit, as in `{name}_m`",
                i + 1
            ));
        }
    }
}

/// Types of public fields that are numbers.
const NUMBER_TYPES: [&str; 7] = [
    "f64",
    "f32",
    "Vec<f64>",
    "Option<f64>",
    "Array1<f64>",
    "Array2<f64>",
    "(f64, f64)",
];

/// The name of a public field of floating point type, such as `pub range_m: Vec<f64>`.
fn public_number(line: &str) -> Option<&str> {
    let (name, kind) = line.trim().strip_prefix("pub ")?.split_once(':')?;
    let is_number = NUMBER_TYPES.contains(&kind.trim().trim_end_matches(','));
    let is_name = name
        .chars()
        .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    (is_number && is_name).then_some(name)
}

fn lacks_unit(name: &str) -> bool {
    let names_quantity = name.split('_').any(|word| RULES.quantities.contains(word));
    names_quantity && !RULES.units.iter().any(|unit| name.ends_with(unit))
}

fn is_excused(path: &str, name: &str) -> bool {
    let mut excused = RULES.without_unit.iter();
    excused.any(|(start, number)| path.starts_with(start) && name == number)
}

/// Imports of files: no circle, and none of a higher layer.
fn check_imports(files: &[SourceFile], found: &mut Vec<String>) {
    let mut sources = Vec::new();
    for file in files {
        if !is_test_file(&file.path) {
            sources.push((file.path.as_str(), file.text.as_str()));
        }
    }
    let imports = imports(&sources, true);
    check_circles(&imports, found);
    for (folder, layers) in &RULES.layers {
        check_layers(&imports, folder, layers, found);
    }
}

/// Files that import one another in a circle: neither can be read, tested or moved without the other.
fn check_circles(imports: &Imports<'_>, found: &mut Vec<String>) {
    for circle in circles(imports) {
        for from in &circle {
            for (to, names) in &imports[from] {
                if !circle.contains(to) {
                    continue;
                }
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

/// Modules of a crate that import a higher layer, or have no layer.
fn check_layers(imports: &Imports<'_>, folder: &str, layers: &[String], found: &mut Vec<String>) {
    let beside = RULES.beside_layers.get(folder);
    for (from, taken) in imports {
        let Some(module) = top_module(from, folder) else {
            continue;
        };
        if beside.is_some_and(|names| names.contains(module)) {
            continue;
        }
        let Some(layer) = layers.iter().position(|name| name == module) else {
            found.push(format!(
                "{from}: `{module}` is not among the layers of tidy.toml"
            ));
            continue;
        };
        let higher = &layers[layer + 1..];
        for (to, names) in taken {
            let is_higher = |module| higher.iter().any(|name| name == module);
            if top_module(to, folder).is_some_and(is_higher) {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                found.push(format!(
                    "{from}: imports a higher layer: {} from {to}",
                    names.join(", ")
                ));
            }
        }
    }
}

/// The module right below the root of a crate that a file belongs to; none for the root itself.
fn top_module<'f>(file: &'f str, folder: &str) -> Option<&'f str> {
    let path = file.strip_prefix(folder)?.strip_prefix("/src/")?;
    let module = path.split('/').next()?.trim_end_matches(".rs");
    (module != "lib" && module != "main").then_some(module)
}

/// A reference file says what it holds before its numbers.
fn check_reference(file: &SourceFile, found: &mut Vec<String>) {
    let path = &file.path;
    if file.extension() != "csv" || !path.starts_with("tests/reference/") {
        return;
    }
    if !file.text.starts_with('#') {
        found.push(format!(
            "{path}:1: a reference curve says in `#` lines what it is, its source, units and uncertainty"
        ));
    }
}

/// No file names a path that only one machine has.
fn check_private(file: &SourceFile, found: &mut Vec<String>) {
    let path = &file.path;
    if path.starts_with(OWN) {
        return;
    }
    for (i, line) in file.text.lines().enumerate() {
        for word in &RULES.private {
            if line.contains(word) {
                found.push(format!(
                    "{path}:{}: `{word}` is a path of one machine",
                    i + 1
                ));
            }
        }
    }
}

/// A crate depends on those that it may depend on alone.
fn check_manifest(folder: &str, allowed: &BTreeSet<String>, text: &str, found: &mut Vec<String>) {
    let mut section = "";
    for (i, line) in text.lines().enumerate() {
        if line.starts_with('[') {
            section = line.trim_matches(['[', ']']);
        }
        let Some((key, _)) = line.split_once('=') else {
            continue;
        };
        if !section.ends_with("dependencies") {
            continue;
        }
        let name = key.trim().split('.').next().unwrap_or("");
        let own = name.strip_prefix("wakescope-");
        let user = RULES.for_one_crate.get(name);
        if own.is_some_and(|own| !allowed.contains(own)) || user.is_some_and(|user| user != folder)
        {
            found.push(format!(
                "{folder}/Cargo.toml:{}: must not depend on `{name}`",
                i + 1
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_that_are_no_plain_english_are_found_in_pages_texts_and_help() {
        let found = |path: &str, text: &str| {
            let mut found = Vec::new();
            check_words(&file(path, text), &mut found);
            found.len()
        };
        assert_eq!(found("docs/src/a.md", "It was told. Untold, told_m."), 1);
        let source = "#[cfg(test)]\nmod a_tests;\nfail(\"so many\"); // so many\n";
        assert_eq!(found("crates/sim/src/a.rs", source), 1);
        assert_eq!(
            found("crates/sim/src/cli/a.rs", "    /// It bears outliers.\n"),
            1
        );
        assert_eq!(
            found("crates/sim/src/a.rs", "mod tests {\n    \"told\"\n}\n"),
            0
        );
    }

    fn file(path: &str, text: &str) -> SourceFile {
        SourceFile {
            path: path.into(),
            text: text.into(),
        }
    }

    #[test]
    fn a_public_quantity_without_unit_is_found() {
        let source =
            "//! x\n    pub range: Vec<f64>,\n    pub range_m: Vec<f64>,\n    pub quality: f64,\n";
        let mut found = Vec::new();
        check_units(&file("crates/les/src/a.rs", source), &mut found);
        assert_eq!(
            found,
            ["crates/les/src/a.rs:2: `range` needs its unit, as in `range_m`"]
        );
    }

    #[test]
    fn a_forbidden_dependency_is_found() {
        let les = "[dependencies]\nwakescope-les.workspace = true\n";
        let linear_algebra = "[dependencies]\nndarray-linalg.workspace = true\n";
        let only_les = BTreeSet::from(["les".to_owned()]);
        let cases = [
            ("crates/optics", BTreeSet::new(), les, 1),
            ("crates/sim", only_les, les, 0),
            ("crates/sim", BTreeSet::new(), linear_algebra, 1),
            ("crates/estimate", BTreeSet::new(), linear_algebra, 0),
        ];
        for (folder, allowed, manifest, violations) in cases {
            let mut found = Vec::new();
            check_manifest(folder, &allowed, manifest, &mut found);
            assert_eq!(found.len(), violations, "{folder}: {manifest}");
        }
    }

    #[test]
    fn references_without_a_head_and_private_paths_are_found() {
        let mut found = Vec::new();
        check_reference(&file("tests/reference/a.csv", "x,y\n"), &mut found);
        check_private(&file("docs/a.md", "see /home/me\n"), &mut found);
        assert_eq!(found.len(), 2, "{found:?}");
    }

    #[test]
    fn a_circle_is_reported_with_the_names_that_close_it() {
        let sources = [
            file("xtask/src/a.rs", "use crate::b::f;\nfn g() {}\n"),
            file("xtask/src/b.rs", "use super::a::g;\nfn f() {}\n"),
        ];
        let mut found = Vec::new();
        check_imports(&sources, &mut found);
        assert_eq!(
            found[0],
            "xtask/src/a.rs: in a circle of imports of 2 files: f from xtask/src/b.rs"
        );
    }

    #[test]
    fn an_import_of_a_higher_layer_is_reported_with_its_names() {
        let layers = ["scene", "plan"].map(String::from);
        let plan = (
            "crates/x/src/plan/stage.rs",
            "pub fn f() { crate::scene::g() }\n",
        );
        let scene = |text| ("crates/x/src/scene.rs", text);
        let violations = |files: &[(&'static str, &str)]| {
            let mut found = Vec::new();
            let imports = imports(files, true);
            check_layers(&imports, "crates/x", &layers, &mut found);
            found
        };
        assert!(violations(&[plan, scene("pub fn g() {}\n")]).is_empty());
        assert_eq!(
            violations(&[plan, scene("use crate::plan::stage::f;\npub fn g() {}\n")]),
            ["crates/x/src/scene.rs: imports a higher layer: f from crates/x/src/plan/stage.rs"]
        );
        let other = (
            "crates/x/src/other.rs",
            "fn h() { crate::plan::stage::f() }\n",
        );
        assert_eq!(
            violations(&[plan, scene("pub fn g() {}\n"), other]),
            ["crates/x/src/other.rs: `other` is not among the layers of tidy.toml"]
        );
    }
}
