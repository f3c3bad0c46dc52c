//! What pages link to and name: files, headings, folders of the sources, tests.

use super::SourceFile;
use crate::book::{GALLERY, RESULTS};
use std::collections::{BTreeMap, BTreeSet};

/// Folders of the sources: what a page sets as code and begins with one of these is a path.
const FOLDERS: [&str; 5] = ["crates/", "docs/", "python/", "tests/", "xtask/"];

/// Beginning of the links to the documentation of the crates, which lies beside the built pages.
const API: &str = "docs/src/api/";

/// A name with as many underscores as this is one of a test.
const LONG_NAME: usize = 3;

/// Links lead to files and headings that exist; paths and long names in code exist.
pub(super) fn check(files: &[SourceFile], paths: &[String], found: &mut Vec<String>) {
    let mut names = BTreeSet::new();
    let mut headings = BTreeMap::new();
    for file in files {
        if file.has_names() {
            names.extend(file.text.split(|c| !is_name_character(c)));
        }
        if file.is_page() {
            headings.insert(file.path.as_str(), anchors(&file.text));
        }
    }
    let known = Known {
        paths,
        names,
        headings,
    };
    for page in files.iter().filter(|file| file.is_page()) {
        known.check_page(page, found);
    }
}

/// What exists.
struct Known<'a> {
    paths: &'a [String],
    /// Words of the sources.
    names: BTreeSet<&'a str>,
    /// Anchors of each page.
    headings: BTreeMap<&'a str, BTreeSet<String>>,
}

impl Known<'_> {
    fn check_page(&self, page: &SourceFile, found: &mut Vec<String>) {
        for (i, line) in prose(&page.text) {
            for target in links(line) {
                if let Err(problem) = self.resolve(&page.path, target) {
                    found.push(format!("{}:{i}: {problem}", page.path));
                }
            }
            for code in line.split('`').skip(1).step_by(2) {
                if is_path(code) && !self.has_path(code) {
                    found.push(format!("{}:{i}: there is no `{code}`", page.path));
                }
                if is_long_name(code) && !self.names.contains(code) {
                    found.push(format!("{}:{i}: no source has a `{code}`", page.path));
                }
            }
        }
    }

    /// Whether a file, or a folder with files, exists.
    fn has_path(&self, path: &str) -> bool {
        let path = path.trim_end_matches('/');
        self.paths.iter().any(|file| {
            file.strip_prefix(path)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        })
    }

    /// Follows a link of a page; the problem if it leads nowhere.
    fn resolve(&self, page: &str, target: &str) -> Result<(), String> {
        if target.contains(':') {
            return Ok(());
        }
        let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
        let path = if file.is_empty() {
            page.to_owned()
        } else {
            joined(page, file)
        };
        let is_made = RESULTS
            .iter()
            .any(|made| path == format!("docs/src/{made}"))
            || path.starts_with(&format!("docs/src/{GALLERY}"));
        if path.starts_with(API) || is_made {
            return Ok(());
        }
        if !self.has_path(&path) {
            return Err(format!("a link leads to `{path}`, which does not exist"));
        }
        let headings = self.headings.get(path.as_str());
        if !anchor.is_empty() && headings.is_some_and(|headings| !headings.contains(anchor)) {
            return Err(format!(
                "a link leads to `{target}`, which has no such heading"
            ));
        }
        Ok(())
    }
}

/// Lines outside of blocks of code, with their numbers.
fn prose(text: &str) -> Vec<(usize, &str)> {
    let mut lines = Vec::new();
    let mut is_code = false;
    for (i, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            is_code = !is_code;
        } else if !is_code {
            lines.push((i + 1, line));
        }
    }
    lines
}

/// Targets of the links and pictures of a line, such as `b.md#c` of `[a](b.md#c)`.
fn links(line: &str) -> Vec<&str> {
    let mut targets = Vec::new();
    for rest in line.split("](").skip(1) {
        if let Some((target, _)) = rest.split_once(')') {
            targets.push(target);
        }
    }
    targets
}

/// Anchors of the headings of a page, as mdBook names them.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut anchors = BTreeSet::new();
    for (_, line) in prose(text) {
        if !line.starts_with('#') {
            continue;
        }
        let mut anchor = String::new();
        for c in line.trim_start_matches('#').trim().chars() {
            if c.is_alphanumeric() || c == '_' || c == '-' {
                anchor.extend(c.to_lowercase());
            } else if c.is_whitespace() {
                anchor.push('-');
            }
        }
        anchors.insert(anchor);
    }
    anchors
}

/// The path from the root of what a page links to.
fn joined(page: &str, link: &str) -> String {
    let mut parts: Vec<&str> = page.split('/').collect();
    parts.pop();
    for part in link.split('/') {
        match part {
            ".." => drop(parts.pop()),
            "." => {}
            part => parts.push(part),
        }
    }
    parts.join("/")
}

fn is_name_character(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

fn is_long_name(code: &str) -> bool {
    code.matches('_').count() >= LONG_NAME && code.chars().all(is_name_character)
}

fn is_path(code: &str) -> bool {
    let is_below = FOLDERS.iter().any(|folder| code.starts_with(folder));
    is_below && !code.contains(['*', ' ', '{'])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn violations(page: &str, source: &str, paths: &[&str]) -> Vec<String> {
        let files = [("docs/src/a.md", page), ("crates/les/src/a.rs", source)];
        let files = files.map(|(path, text)| SourceFile {
            path: path.into(),
            text: text.into(),
        });
        let paths: Vec<String> = paths.iter().map(|path| (*path).to_owned()).collect();
        let mut found = Vec::new();
        check(&files, &paths, &mut found);
        found
    }

    #[test]
    fn a_test_that_a_page_names_must_exist() {
        let source = "#[test]\nfn no_air_crosses_the_ground() {}\n";
        let page =
            "held by `no_air_crosses_the_ground` and `no_air_crosses_a_wall`, `scan.range_max_m`\n";
        assert_eq!(
            violations(page, source, &[]),
            ["docs/src/a.md:1: no source has a `no_air_crosses_a_wall`"]
        );
    }

    #[test]
    fn a_file_that_a_page_names_must_exist() {
        let page = "see `crates/les/src/a`, `crates/les/src/a/mod.rs` and `crates/les/src/b.rs`\n";
        assert_eq!(
            violations(page, "", &["crates/les/src/a/mod.rs"]),
            ["docs/src/a.md:1: there is no `crates/les/src/b.rs`"]
        );
    }

    #[test]
    fn a_link_must_lead_to_a_file_and_a_heading() {
        let page = "\
# One, two: `three`

[a](#one-two-three) [b](../../README.md) [c](https://example.org) [d](images/work_precision.svg)
[e](b.md) [f](a.md#four)

```sh
[g](none.md)
```
";
        let paths = ["README.md", "docs/src/a.md"];
        assert_eq!(
            violations(page, "", &paths),
            [
                "docs/src/a.md:4: a link leads to `docs/src/b.md`, which does not exist",
                "docs/src/a.md:4: a link leads to `a.md#four`, which has no such heading",
            ]
        );
    }
}
