//! Source files as tokens: which files of the workspace import which names from which.

use proc_macro2::{Delimiter, Group, TokenStream, TokenTree};
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

/// Modules by their places.
type Modules<'a> = BTreeMap<Place, Module<'a>>;

/// Which of some source files, given with their texts, takes which names from which; constants that a module takes from the one above it
/// do not count if `but_constants`. What is not below a `src` is left out, and what is no Rust has no imports.
pub(crate) fn imports<'a>(files: &[(&'a str, &str)], but_constants: bool) -> Imports<'a> {
    let mut modules = Modules::new();
    for (file, text) in files {
        if let Some(place) = place(file) {
            modules.insert(place, Module::parse(file, text));
        }
    }
    let mut out = Imports::new();
    for (from, module) in &modules {
        for path in &module.taken {
            let name = path.last().cloned().unwrap_or_default();
            let Some(to) =
                absolute(&modules, from, path).and_then(|path| resolve(&modules, from, &path, 0))
            else {
                continue;
            };
            let is_above = to.1.len() < from.1.len() && from.1.starts_with(&to.1);
            let is_constant = modules[to].items.get(&name) == Some(&true);
            if to != from && !(but_constants && is_above && is_constant) {
                out.entry(module.file)
                    .or_default()
                    .entry(modules[to].file)
                    .or_default()
                    .insert(name);
            }
        }
    }
    out
}

/// The path from the root of the crate; none if it leads to another crate.
fn absolute(modules: &Modules<'_>, at: &Place, path: &[String]) -> Option<Vec<String>> {
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
    let is_relative = rest.len() < path.len();
    let is_child = |child: &[String]| {
        let place = (at.0.clone(), [&base[..], child].concat());
        modules.contains_key(&place)
    };
    (is_relative || is_child(&rest[..1])).then(|| [&base[..], rest].concat())
}

/// The module that holds what a path names, through what modules hand on.
fn resolve<'m>(
    modules: &'m Modules<'_>,
    at: &Place,
    path: &[String],
    depth: usize,
) -> Option<&'m Place> {
    let (to, module, rest) = (0..=path.len()).rev().find_map(|n| {
        let (to, module) = modules.get_key_value(&(at.0.clone(), path[..n].to_vec()))?;
        Some((to, module, &path[n..]))
    })?;
    let Some(name) = rest
        .first()
        .filter(|name| !module.items.contains_key(*name) && depth < 6)
    else {
        return Some(to);
    };
    for path in &module.handed {
        if path.last() != Some(name) {
            continue;
        }
        let found =
            absolute(modules, to, path).and_then(|path| resolve(modules, to, &path, depth + 1));
        if found.is_some() {
            return found;
        }
    }
    Some(to)
}

/// Groups of files each of which imports every other, in one step or several; a module and those right below it may.
pub(crate) fn circles<'a>(imports: &Imports<'a>) -> Vec<Vec<&'a str>> {
    let mut reachable = BTreeMap::new();
    for file in imports.keys() {
        reachable.insert(*file, reached(imports, file));
    }
    let mut circles: Vec<Vec<&str>> = Vec::new();
    for (file, others) in &reachable {
        let is_known = circles.iter().any(|circle| circle.contains(file));
        if is_known || !others.contains(file) {
            continue;
        }
        let mut circle = Vec::new();
        for other in others {
            if reachable.get(other).is_some_and(|back| back.contains(file)) {
                circle.push(*other);
            }
        }
        circles.push(circle);
    }
    circles.retain(|circle| !circle.iter().any(|parent| is_family(circle, parent)));
    circles
}

/// Whether a circle is of a module and those right below it.
fn is_family(circle: &[&str], parent: &str) -> bool {
    circle.iter().all(|file| {
        *file == parent || above(file).is_some_and(|above| Some(above) == place(parent))
    })
}

/// The module above that of a file.
fn above(file: &str) -> Option<Place> {
    let (folder, mut path) = place(file)?;
    path.pop()?;
    Some((folder, path))
}

/// What a file imports, in one step or several.
fn reached<'a>(imports: &Imports<'a>, from: &'a str) -> BTreeSet<&'a str> {
    let mut found = BTreeSet::new();
    let mut open = vec![from];
    while let Some(file) = open.pop() {
        let Some(imported) = imports.get(file) else {
            continue;
        };
        for to in imported.keys() {
            if found.insert(*to) {
                open.push(to);
            }
        }
    }
    found
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
    let pair = tokens.get(place..place + 2);
    pair.is_some_and(|pair| pair.iter().all(|token| is_mark(token, ':')))
}

fn is_mark(token: &TokenTree, mark: char) -> bool {
    matches!(token, TokenTree::Punct(p) if p.as_char() == mark)
}

/// Whether a token is the body of an item.
fn is_body(token: &TokenTree) -> bool {
    matches!(token, TokenTree::Group(group) if group.delimiter() == Delimiter::Brace)
}

/// The place of the next token from `start` on that ends an item; the number of tokens if none does.
fn end_of(tokens: &[TokenTree], start: usize, is_end: impl Fn(&TokenTree) -> bool) -> usize {
    let after = tokens[start..].iter().position(is_end);
    after.map_or(tokens.len(), |length| start + length)
}

impl<'a> Module<'a> {
    fn parse(file: &'a str, text: &str) -> Self {
        let mut module = Self {
            file,
            ..Self::default()
        };
        module.read(text.parse().unwrap_or_default());
        module
    }

    /// Takes what items, imports and paths some tokens have; items for tests alone are skipped.
    fn read(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut at = 0;
        while let Some(token) = tokens.get(at) {
            at = match token {
                TokenTree::Group(group) => self.read_group(&tokens, at, group),
                _ => self.read_word(&tokens, at),
            };
        }
    }

    /// Takes what a group has; returns the place behind it, or behind the item that is for tests alone.
    fn read_group(&mut self, tokens: &[TokenTree], at: usize, group: &Group) -> usize {
        if group.to_string().replace(' ', "") == "[cfg(test)]" {
            return end_of(tokens, at, |t| is_mark(t, ';') || is_body(t)) + 1;
        }
        let is_visibility = at > 0 && name(tokens, at - 1) == "pub";
        if !is_visibility {
            self.read(group.stream());
        }
        at + 1
    }

    /// Takes what begins with a word: an import, an item or a path; returns the place behind it.
    fn read_word(&mut self, tokens: &[TokenTree], at: usize) -> usize {
        let word = name(tokens, at);
        let next = name(tokens, at + 1);
        match word.as_str() {
            "" => {}
            "use" => return self.read_use(tokens, at),
            "const" | "static" | "type"
                if !["fn", "unsafe", "async", ""].contains(&next.as_str()) =>
            {
                self.items.insert(next, true);
            }
            "fn" | "struct" | "enum" | "trait" | "mod" if !next.is_empty() => {
                self.items.insert(next, false);
            }
            "macro_rules" => {
                self.items.insert(name(tokens, at + 2), false);
            }
            _ if at > 1 && is_joint(tokens, at - 2) => {}
            _ => return self.read_path(tokens, at),
        }
        at + 1
    }

    /// Takes the paths of a `use`.
    fn read_use(&mut self, tokens: &[TokenTree], at: usize) -> usize {
        let end = end_of(tokens, at, |t| is_mark(t, ';'));
        let is_exported = at > 0 && name(tokens, at - 1) == "pub";
        let is_public = is_exported || at > 1 && name(tokens, at - 2) == "pub";
        let mut paths = Vec::new();
        write_out(&tokens[at + 1..end], &[], &mut paths);
        if is_public {
            self.handed.extend(paths.iter().cloned());
        }
        if !is_exported {
            self.taken.extend(paths);
        }
        end + 1
    }

    /// Takes a path such as `a::b::c`.
    fn read_path(&mut self, tokens: &[TokenTree], start: usize) -> usize {
        let mut at = start;
        let mut path = vec![name(tokens, at)];
        while is_joint(tokens, at + 1) && !name(tokens, at + 3).is_empty() {
            path.push(name(tokens, at + 3));
            at += 3;
        }
        if path.len() > 1 {
            self.taken.push(path);
        }
        at + 1
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
        circles(&imports(files, but_constants))
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
        let between = ("c/src/a/b/mod.rs", "pub mod c;\n");
        let below = |text| ("c/src/a/b/c.rs", text);
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
