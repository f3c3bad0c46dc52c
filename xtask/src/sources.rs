//! Source files as tokens: which files of the workspace import which names from which.

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};

/// Whether a source file of a crate holds nothing but tests.
pub(crate) fn is_test_file(file: &str) -> bool {
    file.ends_with(".rs") && file.contains("/tests/")
        || file.ends_with("/tests.rs")
        || file.ends_with("_tests.rs")
}

/// A file of a crate: its folder and the path of its module.
type Place = (String, Vec<String>);

/// One file as a module.
#[derive(Default)]
struct Module<'a> {
    file: &'a str,
    /// Names of items, and whether each is a constant or the name of a type: whoever states it needs nothing of who uses it.
    items: BTreeMap<String, bool>,
    /// Paths that it takes: of `use`, unless other crates see it, and outside, such as `crate::a::f` or `child::g`.
    taken: Vec<Vec<String>>,
    /// Paths of `use` that others see.
    handed: Vec<Vec<String>>,
}

/// Names that one file takes from another.
pub(crate) type Imports<'a> = BTreeMap<&'a str, BTreeMap<&'a str, BTreeSet<String>>>;

/// The modules of the workspace.
pub(crate) struct Modules<'a>(BTreeMap<Place, Module<'a>>);

impl<'a> Modules<'a> {
    /// Of source files and their texts; what is not below a `src` is left out, and what is no Rust has no imports.
    pub(crate) fn new(files: &[(&'a str, &str)]) -> Self {
        let module = |file: &'a str, text: &str| {
            let mut module = Module {
                file,
                ..Module::default()
            };
            module.read(
                &text
                    .parse::<TokenStream>()
                    .unwrap_or_default()
                    .into_iter()
                    .collect::<Vec<_>>(),
            );
            module
        };
        Self(
            files
                .iter()
                .filter_map(|(file, text)| Some((place(file)?, module(file, text))))
                .collect(),
        )
    }

    /// Which file takes which names from which; constants that a module takes from the one above it do not count if
    /// `but_constants`.
    pub(crate) fn imports(&self, but_constants: bool) -> Imports<'a> {
        let mut out = Imports::new();
        for (from, module) in &self.0 {
            for path in &module.taken {
                let name = path.last().cloned().unwrap_or_default();
                let Some(to) = self
                    .absolute(from, path)
                    .and_then(|path| self.resolve(from, &path, 0))
                else {
                    continue;
                };
                let is_above = to.1.len() < from.1.len() && from.1.starts_with(&to.1);
                let is_constant = self.0[to].items.get(&name) == Some(&true);
                if to != from && !(but_constants && is_above && is_constant) {
                    out.entry(module.file)
                        .or_default()
                        .entry(self.0[to].file)
                        .or_default()
                        .insert(name);
                }
            }
        }
        out
    }

    /// The path from the root of the crate; none if it leads to another crate.
    fn absolute(&self, at: &Place, path: &[String]) -> Option<Vec<String>> {
        let mut base = at.1.clone();
        let mut rest = path;
        while let Some((word @ ("crate" | "self" | "super"), more)) =
            rest.split_first().map(|(word, more)| (word.as_str(), more))
        {
            match word {
                "crate" => base.clear(),
                "super" => drop(base.pop()),
                _ => {}
            }
            rest = more;
        }
        let is_child = || {
            self.0
                .contains_key(&(at.0.clone(), [&base[..], &rest[..1]].concat()))
        };
        (rest.len() < path.len() || is_child()).then(|| [&base[..], rest].concat())
    }

    /// The module that holds what a path names, through what modules hand on.
    fn resolve(&self, at: &Place, path: &[String], depth: usize) -> Option<&Place> {
        let (to, module, rest) = (0..=path.len()).rev().find_map(|n| {
            let (to, module) = self.0.get_key_value(&(at.0.clone(), path[..n].to_vec()))?;
            Some((to, module, &path[n..]))
        })?;
        let Some(name) = rest
            .first()
            .filter(|name| !module.items.contains_key(*name) && depth < 6)
        else {
            return Some(to);
        };
        let mut handed = module
            .handed
            .iter()
            .filter(|path| path.last() == Some(name));
        handed
            .find_map(|path| self.resolve(to, &self.absolute(to, path)?, depth + 1))
            .or(Some(to))
    }
}

/// Groups of files each of which imports every other, in one step or several; a module and those right below it may.
pub(crate) fn circles<'a>(imports: &Imports<'a>) -> Vec<Vec<&'a str>> {
    let all: BTreeMap<&str, BTreeSet<&str>> = imports
        .keys()
        .map(|file| (*file, reached(imports, file)))
        .collect();
    let mut out: Vec<Vec<&str>> = Vec::new();
    for (file, seen) in all.iter().filter(|(file, seen)| seen.contains(*file)) {
        if !out.iter().any(|circle| circle.contains(file)) {
            out.push(
                seen.iter()
                    .copied()
                    .filter(|to| all.get(to).is_some_and(|back| back.contains(file)))
                    .collect(),
            );
        }
    }
    let above =
        |file: &str| place(file).map(|(folder, mut path)| path.pop().map(|_| (folder, path)));
    let is_family = |circle: &Vec<&str>, parent: &str| {
        circle
            .iter()
            .all(|file| *file == parent || above(file).is_some_and(|of| of == place(parent)))
    };
    out.retain(|circle| !circle.iter().any(|parent| is_family(circle, parent)));
    out
}

/// What a file imports, in one step or several.
fn reached<'a>(imports: &Imports<'a>, from: &'a str) -> BTreeSet<&'a str> {
    let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(file) = open.pop() {
        open.extend(
            imports
                .get(file)
                .into_iter()
                .flat_map(BTreeMap::keys)
                .copied()
                .filter(|to| seen.insert(*to)),
        );
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

/// The name at a place of some tokens; empty where there is none.
fn name(tokens: &[TokenTree], place: usize) -> String {
    match tokens.get(place) {
        Some(TokenTree::Ident(name)) => name.to_string(),
        _ => String::new(),
    }
}

/// Whether there are two colons at a place of some tokens.
fn is_joint(tokens: &[TokenTree], place: usize) -> bool {
    let is_colon = |token: Option<&TokenTree>| matches!(token, Some(TokenTree::Punct(p)) if p.as_char() == ':');
    is_colon(tokens.get(place)) && is_colon(tokens.get(place + 1))
}

fn is_end(token: &TokenTree) -> bool {
    matches!(token, TokenTree::Punct(p) if p.as_char() == ';')
}

impl Module<'_> {
    /// Takes what items, imports and paths some tokens have; items for tests alone are left out.
    fn read(&mut self, tokens: &[TokenTree]) {
        let mut at = 0;
        while let Some(token) = tokens.get(at) {
            let (word, next) = (name(tokens, at), name(tokens, at + 1));
            match (token, word.as_str()) {
                (TokenTree::Group(group), _)
                    if group.to_string().replace(' ', "") == "[cfg(test)]" =>
                {
                    let ends = |t: &TokenTree| matches!(t, TokenTree::Group(g) if g.delimiter() == Delimiter::Brace);
                    at += tokens[at..]
                        .iter()
                        .position(|t| is_end(t) || ends(t))
                        .unwrap_or(tokens.len());
                }
                // who may see an item
                (TokenTree::Group(_), _) if at > 0 && name(tokens, at - 1) == "pub" => {}
                (TokenTree::Group(group), _) => {
                    self.read(&group.stream().into_iter().collect::<Vec<_>>())
                }
                (_, "use") => {
                    let end = tokens[at..]
                        .iter()
                        .position(is_end)
                        .map_or(tokens.len(), |length| at + length);
                    let is_exported = at > 0 && name(tokens, at - 1) == "pub";
                    let is_public = is_exported || at > 1 && name(tokens, at - 2) == "pub";
                    let mut paths = Vec::new();
                    write_out(&tokens[at + 1..end], &[], &mut paths);
                    self.handed
                        .extend(paths.iter().filter(|_| is_public).cloned());
                    self.taken
                        .extend(paths.into_iter().filter(|_| !is_exported));
                    at = end;
                }
                (_, "const" | "static" | "type")
                    if !["fn", "unsafe", "async", ""].contains(&next.as_str()) =>
                {
                    self.items.insert(next, true);
                }
                (_, "fn" | "struct" | "enum" | "trait" | "mod") if !next.is_empty() => {
                    self.items.insert(next, false);
                }
                (_, "macro_rules") => {
                    self.items.insert(name(tokens, at + 2), false);
                }
                (_, word) if !(word.is_empty() || at > 1 && is_joint(tokens, at - 2)) => {
                    let mut path = vec![word.to_owned()];
                    while is_joint(tokens, at + 1) && !name(tokens, at + 3).is_empty() {
                        path.push(name(tokens, at + 3));
                        at += 3;
                    }
                    self.taken.extend((path.len() > 1).then_some(path));
                }
                _ => {}
            }
            at += 1;
        }
    }
}

/// Adds the paths of a tree such as `a::{b, c::{self, d as e}}` below a path.
fn write_out(tree: &[TokenTree], below: &[String], out: &mut Vec<Vec<String>>) {
    for part in tree.split(|token| matches!(token, TokenTree::Punct(p) if p.as_char() == ',')) {
        let mut path = below.to_vec();
        let mut is_whole = !part.is_empty();
        for token in part.iter().take_while(|token| token.to_string() != "as") {
            match token {
                TokenTree::Ident(name) => path.push(name.to_string()),
                TokenTree::Group(group) => {
                    write_out(&group.stream().into_iter().collect::<Vec<_>>(), &path, out);
                    is_whole = false;
                }
                _ => {}
            }
        }
        out.extend(is_whole.then_some(path));
    }
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
        let root = (
            "c/src/lib.rs",
            "mod a;\nmod b;\npub use b::{Thing as Thing,\n    more};\n",
        );
        let b = (
            "c/src/b.rs",
            "pub struct Thing;\nfn f() { super::a::make() }\n",
        );
        assert_eq!(found(&[a, root, b], false), [["c/src/a.rs", "c/src/b.rs"]]);
        let apart = ("c/src/b.rs", "pub struct Thing;\n// super::a::make()\n");
        assert!(found(&[a, root, apart], false).is_empty());
    }

    #[test]
    fn a_path_that_begins_with_a_child_module_is_an_import() {
        let parent = (
            "c/src/a/mod.rs",
            "mod b;\npub(in super::super) fn f() { b::c::g() }\n",
        );
        let (between, below) = (("c/src/a/b/mod.rs", "pub mod c;\n"), |text| {
            ("c/src/a/b/c.rs", text)
        });
        let circle = [["c/src/a/b/c.rs", "c/src/a/mod.rs"]];
        assert_eq!(
            found(
                &[parent, between, below("fn g() { super::super::f() }\n")],
                true
            ),
            circle
        );
        assert!(found(&[parent, between, below("fn g() {}\n")], true).is_empty());
        // A word of a `use` is no child of the file that it stands in.
        let user = ("c/src/a/mod.rs", "mod b;\nuse crate::{\n    b::h,\n};\n");
        let files = [
            user,
            between,
            below("fn g() { super::super::f() }\n"),
            ("c/src/b.rs", "fn h() {}\n"),
        ];
        assert!(found(&files, true).is_empty());
    }

    #[test]
    fn a_module_and_those_right_below_it_may_import_one_another_and_others_may_not() {
        let parent = (
            "c/src/a/mod.rs",
            "mod b;\nuse b::wide;\npub(crate) fn lanes() {}\n",
        );
        let child = (
            "c/src/a/b.rs",
            "use super::lanes;\npub(super) fn wide() {}\n",
        );
        assert!(found(&[parent, child], true).is_empty());
        let aside = ("c/src/d.rs", "pub fn more() { crate::a::lanes() }\n");
        let with_aside = (
            "c/src/a/b.rs",
            "use crate::d::more;\npub(super) fn wide() {}\n",
        );
        assert_eq!(found(&[parent, with_aside, aside], true).concat().len(), 3);
    }

    #[test]
    fn a_module_may_take_constants_from_above_and_nothing_else() {
        let of = |item: &str, but_constants| {
            let above = format!("mod d;\nuse d::b::wide;\n{item}\n");
            let below = (
                "c/src/a/d/b.rs",
                "use crate::a::LANES;\npub(super) fn wide() {}\n",
            );
            found(
                &[
                    ("c/src/a/mod.rs", &above),
                    ("c/src/a/d/mod.rs", "mod b;\n"),
                    below,
                ],
                but_constants,
            )
            .len()
        };
        let constant = "const LANES: usize = 16;";
        assert_eq!(
            [
                of(constant, true),
                of(constant, false),
                of("pub(crate) fn LANES() {}", true)
            ],
            [0, 1, 1]
        );
    }

    #[test]
    fn tests_make_no_circle() {
        let a = ("c/src/a.rs", "use super::b::f;\nfn g() {}\n");
        let b = (
            "c/src/b.rs",
            "pub fn f() {}\n\n#[cfg(test)]\nmod tests {\n    use crate::a::g;\n}\n",
        );
        assert!(found(&[a, b], false).is_empty());
        let c = (
            "c/src/b.rs",
            "#[cfg(test)]\nmod more;\n#[cfg(test)]\nuse crate::{\n    a::g,\n};\nfn f() {\n    // crate::a::g()\n}\n",
        );
        assert!(found(&[a, c], false).is_empty());
    }
}
