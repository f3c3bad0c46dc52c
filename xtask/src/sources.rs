//! Source files as text: their lines of code, and which files of the workspace import which.

use std::collections::{BTreeMap, BTreeSet};

/// Whether a source file holds nothing but tests.
pub(crate) fn is_test_file(file: &str) -> bool {
    let of_tests = file.contains("/tests/") || file.starts_with("tests/");
    file.ends_with(".rs") && of_tests || file.ends_with("/tests.rs") || file.ends_with("_tests.rs")
}

/// Lines of code of a source text: neither blank, nor comment, nor part of an item that is compiled for tests alone.
pub(crate) fn code_lines(text: &str) -> Vec<&str> {
    let mut out = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if line.trim() == "#[cfg(test)]" {
            let end = format!("{}}}", &line[..line.len() - line.trim_start().len()]);
            // The item ends with a semicolon before any brace, or with the brace below its beginning.
            let mut is_open = false;
            for inner in lines.by_ref() {
                let has_brace = inner.contains('{') && !inner.trim_start().starts_with("use ");
                if inner == end || !is_open && (inner.ends_with(';') || has_brace && inner.ends_with('}')) {
                    break;
                }
                is_open |= has_brace;
            }
        } else if !line.trim().is_empty() && !line.trim_start().starts_with("//") {
            out.push(line);
        }
    }
    out
}

/// What an item is, as far as importing it matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// A constant or the name of a type: whoever states it needs nothing of who uses it.
    Constant,
    Other,
}

/// A file of a crate: its folder and the path of its module.
type Place = (String, Vec<String>);

/// One file as a module.
struct Module<'a> {
    file: &'a str,
    items: BTreeMap<String, Kind>,
    uses: Vec<Use>,
    /// Paths outside of `use`, such as `crate::a::f` or `child::g`.
    paths: Vec<Vec<String>>,
}

/// One `use` with its tree written out.
struct Use {
    is_public: bool,
    is_exported: bool,
    paths: Vec<Vec<String>>,
}

/// Names that one file takes from another.
pub(crate) type Imports<'a> = BTreeMap<&'a str, BTreeMap<&'a str, BTreeSet<String>>>;

/// The modules of the workspace.
pub(crate) struct Modules<'a>(BTreeMap<Place, Module<'a>>);

impl<'a> Modules<'a> {
    /// Of source files and their texts; what is not below a `src` is left out.
    pub(crate) fn new(files: &[(&'a str, &str)]) -> Self {
        Self(files.iter().filter_map(|(file, text)| Some((place(file)?, Module::new(file, text)))).collect())
    }

    /// Which file takes which names from which; constants that a module takes from the one above it do not count if
    /// `but_constants`.
    pub(crate) fn imports(&self, but_constants: bool) -> Imports<'a> {
        let mut out = Imports::new();
        for (from, module) in &self.0 {
            let used = module.uses.iter().filter(|u| !u.is_exported).flat_map(|u| &u.paths);
            for path in used.chain(&module.paths) {
                let name = path.last().cloned().unwrap_or_default();
                let Some(to) = self.absolute(from, path).and_then(|path| self.resolve(from, &path, 0)) else {
                    continue;
                };
                let is_above = to.1.len() < from.1.len() && from.1.starts_with(&to.1);
                let is_constant = self.0[to].items.get(&name) == Some(&Kind::Constant);
                if to != from && !(but_constants && is_above && is_constant) {
                    out.entry(module.file).or_default().entry(self.0[to].file).or_default().insert(name);
                }
            }
        }
        out
    }

    /// The path from the root of the crate; none if it leads to another crate.
    fn absolute(&self, at: &Place, path: &[String]) -> Option<Vec<String>> {
        let (first, mut rest) = (path.first()?.as_str(), &path[1..]);
        let mut base = at.1.clone();
        match first {
            "crate" => base.clear(),
            "self" => {}
            "super" => {
                base.pop();
                while rest.first().is_some_and(|word| word == "super") {
                    base.pop();
                    rest = &rest[1..];
                }
            }
            child => {
                base.push(child.into());
                if !self.0.contains_key(&(at.0.clone(), base.clone())) {
                    return None;
                }
            }
        }
        base.extend_from_slice(rest);
        Some(base)
    }

    /// The module that holds what a path names, through what modules hand on.
    fn resolve(&self, at: &Place, path: &[String], depth: usize) -> Option<&Place> {
        let (to, module, rest) = (0..=path.len()).rev().find_map(|n| {
            let (to, module) = self.0.get_key_value(&(at.0.clone(), path[..n].to_vec()))?;
            Some((to, module, &path[n..]))
        })?;
        let Some(name) = rest.first().filter(|name| !module.items.contains_key(*name) && depth < 6) else {
            return Some(to);
        };
        let handed = module.uses.iter().filter(|u| u.is_public).flat_map(|u| &u.paths);
        let found = handed
            .filter(|path| path.last() == Some(name))
            .find_map(|path| self.resolve(to, &self.absolute(to, path)?, depth + 1));
        found.or(Some(to))
    }
}

/// Groups of files each of which imports every other, in one step or several; a module and those right below it may.
pub(crate) fn circles<'a>(imports: &Imports<'a>) -> Vec<Vec<&'a str>> {
    let all: BTreeMap<&str, BTreeSet<&str>> = imports.keys().map(|file| (*file, reached(imports, file))).collect();
    let mut out: Vec<Vec<&str>> = Vec::new();
    for (file, seen) in all.iter().filter(|(file, seen)| seen.contains(*file)) {
        if !out.iter().any(|circle| circle.contains(file)) {
            out.push(seen.iter().copied().filter(|to| all.get(to).is_some_and(|back| back.contains(file))).collect());
        }
    }
    out.retain(|circle| {
        !circle.iter().any(|above| circle.iter().all(|file| file == above || is_right_below(file, above)))
    });
    out
}

fn is_right_below(file: &str, above: &str) -> bool {
    match (place(file), place(above)) {
        (Some((folder, path)), Some(above)) => {
            path.split_last().is_some_and(|(_, rest)| above == (folder, rest.to_vec()))
        }
        _ => false,
    }
}

/// What a file imports, in one step or several.
fn reached<'a>(imports: &Imports<'a>, from: &'a str) -> BTreeSet<&'a str> {
    let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(file) = open.pop() {
        open.extend(imports.get(file).into_iter().flat_map(BTreeMap::keys).copied().filter(|to| seen.insert(*to)));
    }
    seen
}

fn place(file: &str) -> Option<Place> {
    let (folder, rest) = file.strip_suffix(".rs")?.split_once("/src/")?;
    let mut path: Vec<String> = rest.split('/').map(String::from).collect();
    path.pop_if(|last| last == "mod");
    if path == ["lib"] || path == ["main"] {
        path.clear();
    }
    Some((folder.into(), path))
}

impl<'a> Module<'a> {
    fn new(file: &'a str, text: &str) -> Self {
        let lines = code_lines(text);
        let items = lines.iter().filter_map(|line| item(line)).collect();
        let (mut uses, mut paths) = (Vec::new(), Vec::new());
        let mut open: Option<(String, String)> = None;
        for line in &lines {
            match &mut open {
                Some((_, tree)) => tree.push_str(line),
                None => {
                    let (visibility, item) = visibility(line);
                    open = item.strip_prefix("use ").map(|tree| (visibility.to_owned(), tree.to_owned()));
                    if open.is_none() {
                        paths.extend(inline_paths(item));
                    }
                }
            }
            if let Some((visibility, tree)) = open.take_if(|(_, tree)| tree.contains(';')) {
                let paths = written_out(tree.split(';').next().unwrap_or_default());
                uses.push(Use { is_public: !visibility.is_empty(), is_exported: visibility == "pub", paths });
            }
        }
        Self { file, items, uses, paths }
    }
}

/// What stands before an item, and the item.
fn visibility(line: &str) -> (&str, &str) {
    let line = line.trim_start();
    let Some(rest) = line.strip_prefix("pub") else { return ("", line) };
    let end = if rest.starts_with('(') { rest.find(')').map_or(0, |i| i + 1) } else { 0 };
    match rest[end..].strip_prefix(' ') {
        Some(item) => (&line[..3 + end], item),
        None => ("", line),
    }
}

/// Name and kind of the item that a line begins.
fn item(line: &str) -> Option<(String, Kind)> {
    let mut words = visibility(line).1.split_whitespace().peekable();
    loop {
        let word = words.next()?;
        let next = *words.peek()?;
        let kind = match word {
            "unsafe" | "async" => continue,
            "const" if ["fn", "unsafe", "async"].contains(&next) => continue,
            "const" | "static" | "type" => Kind::Constant,
            "fn" | "struct" | "enum" | "trait" | "mod" | "macro_rules!" => Kind::Other,
            _ => return None,
        };
        return Some((next.chars().take_while(|c| is_word(*c)).collect(), kind));
    }
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The paths of a tree such as `a::{b, c::{self, d as e}}`.
fn written_out(tree: &str) -> Vec<Vec<String>> {
    let words = |path: &str| -> Vec<String> {
        let path = path.split(" as ").next().unwrap_or_default();
        path.split("::").map(str::trim).filter(|word| !word.is_empty()).map(String::from).collect()
    };
    let Some((before, inside)) = tree.split_once('{') else { return vec![words(tree)] };
    let inside = inside.trim_end().strip_suffix('}').unwrap_or(inside);
    let (mut depth, mut from, mut parts) = (0, 0, Vec::new());
    for (i, c) in inside.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&inside[from..i]);
                from = i + 1;
            }
            _ => {}
        }
    }
    parts.push(&inside[from..]);
    let below = parts.into_iter().filter(|part| !part.trim().is_empty()).flat_map(written_out);
    below.map(|path| words(before).into_iter().chain(path).collect()).collect()
}

/// Paths of a line, of two words and more.
fn inline_paths(line: &str) -> Vec<Vec<String>> {
    let paths = line.split(|c: char| !is_word(c) && c != ':').map(|path| {
        let words =
            path.trim_start_matches(':').split("::").take_while(|word| !word.is_empty() && word.chars().all(is_word));
        words.map(String::from).collect::<Vec<_>>()
    });
    paths.filter(|path| path.len() > 1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(files: &[(&'static str, &str)], but_constants: bool) -> Vec<Vec<&'static str>> {
        circles(&Modules::new(files).imports(but_constants))
    }

    #[test]
    fn a_circle_through_a_name_that_is_handed_on_is_found() {
        let a = ("c/src/a.rs", "use crate::{Thing, other};\nfn make() {}\n");
        let root = ("c/src/lib.rs", "mod a;\nmod b;\npub use b::{Thing as Thing,\n    more};\n");
        let b = ("c/src/b.rs", "pub struct Thing;\nfn f() { super::a::make() }\n");
        assert_eq!(found(&[a, root, b], false), [["c/src/a.rs", "c/src/b.rs"]]);
        let apart = ("c/src/b.rs", "pub struct Thing;\n// super::a::make()\n");
        assert!(found(&[a, root, apart], false).is_empty());
    }

    #[test]
    fn a_path_that_begins_with_a_child_module_is_an_import() {
        let parent = ("c/src/a/mod.rs", "mod b;\npub(in super::super) fn f() { b::c::g() }\n");
        let (between, below) = (("c/src/a/b/mod.rs", "pub mod c;\n"), |text| ("c/src/a/b/c.rs", text));
        let circle = [["c/src/a/b/c.rs", "c/src/a/mod.rs"]];
        assert_eq!(found(&[parent, between, below("fn g() { super::super::f() }\n")], true), circle);
        assert!(found(&[parent, between, below("fn g() {}\n")], true).is_empty());
        // A word of a `use` is no child of the file that it stands in.
        let user = ("c/src/a/mod.rs", "mod b;\nuse crate::{\n    b::h,\n};\n");
        let files = [user, between, below("fn g() { super::super::f() }\n"), ("c/src/b.rs", "fn h() {}\n")];
        assert!(found(&files, true).is_empty());
    }

    #[test]
    fn a_module_and_those_right_below_it_may_import_one_another_and_others_may_not() {
        let parent = ("c/src/a/mod.rs", "mod b;\nuse b::wide;\npub(crate) fn lanes() {}\n");
        let child = ("c/src/a/b.rs", "use super::lanes;\npub(super) fn wide() {}\n");
        assert!(found(&[parent, child], true).is_empty());
        let aside = ("c/src/d.rs", "pub fn more() { crate::a::lanes() }\n");
        let with_aside = ("c/src/a/b.rs", "use crate::d::more;\npub(super) fn wide() {}\n");
        assert_eq!(found(&[parent, with_aside, aside], true).concat().len(), 3);
    }

    #[test]
    fn a_module_may_take_constants_from_above_and_nothing_else() {
        let of = |item: &str, but_constants| {
            let above = format!("mod d;\nuse d::b::wide;\n{item}\n");
            let below = ("c/src/a/d/b.rs", "use crate::a::LANES;\npub(super) fn wide() {}\n");
            found(&[("c/src/a/mod.rs", &above), ("c/src/a/d/mod.rs", "mod b;\n"), below], but_constants).len()
        };
        let constant = "const LANES: usize = 16;";
        assert_eq!([of(constant, true), of(constant, false), of("pub(crate) fn LANES() {}", true)], [0, 1, 1]);
    }

    #[test]
    fn tests_make_no_circle_and_are_no_code() {
        let a = ("c/src/a.rs", "use super::b::f;\nfn g() {}\n");
        let b = ("c/src/b.rs", "pub fn f() {}\n\n#[cfg(test)]\nmod tests {\n    use crate::a::g;\n}\n");
        assert!(found(&[a, b], false).is_empty());
        let text = "//! x\n\n#[cfg(test)]\nmod more_tests;\n#[cfg(test)]\nuse a::{\n    b,\n};\nfn f() {\n    g(); // c\n}\n    #[cfg(test)]\n    fn h() {\n    }\nfn k() {}\n";
        assert_eq!(code_lines(text), ["fn f() {", "    g(); // c", "}", "fn k() {}"]);
    }
}
