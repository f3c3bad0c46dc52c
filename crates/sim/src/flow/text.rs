//! The text of a case file: what it may say, with the defaults of its kind, and examples.

use super::case::FlowCase;
use super::kind::CaseKind;
use crate::Error;
use crate::keys::{Format, Key, Text, from_table, keys_of, to_table};
use std::path::Path;
use std::sync::LazyLock;
use toml::Table;

macro_rules! examples {
    ($($name:literal)*) => { [$(($name, include_str!(concat!("examples/", $name, ".toml")))),*] };
}

/// Names and texts of commented case files, one for each kind of flow, as `wakescope flow --example NAME` prints them.
pub const EXAMPLES: [(&str, &str); 3] = examples!["vortex_pair" "wake" "free"];

/// The example of this name.
pub fn example(name: &str) -> Option<&'static str> {
    EXAMPLES
        .iter()
        .find(|(n, _)| *n == name)
        .map(|(_, text)| *text)
}

/// Values of keys that no example has.
const MORE_EXAMPLES: &str = include_str!("more_examples.toml");

/// Keys whose value chooses the others of their table.
const TAGS: [&str; 3] = ["kind", "from", "model"];

/// The case of a text. Keys that it lacks are those of `base`, or the defaults of its kind.
///
/// # Errors
/// The file, the line, the key, the value and what is allowed.
pub(super) fn read(text: &str, path: &Path, base: Option<&FlowCase>) -> Result<FlowCase, Error> {
    static KEYS: LazyLock<Vec<Key>> = LazyLock::new(|| {
        let mut keys = keys_of::<FlowCase>();
        // Which flow is no matter of defaults.
        keys.iter_mut()
            .for_each(|key| key.is_required = key.name == "case");
        keys
    });
    let document = Text::parse(text, path)?;
    let kind = document.value("case.kind").and_then(|kind| kind.as_str());
    let defaults = match (base, kind) {
        (Some(base), _) => to_table(base),
        (None, Some(kind)) => defaults_of(kind),
        (None, None) => Table::new(),
    };
    let table = document.vet(&Format {
        keys: &KEYS,
        defaults: &defaults,
        examples: &examples_of(kind),
    })?;
    let whole = match base {
        Some(_) => over(defaults, table),
        None => table,
    };
    let mut case = document.read::<FlowCase>(whole)?;
    if matches!(case.case, CaseKind::Wake(_)) {
        case.wake.get_or_insert_default().complete();
    }
    let problems = case.problems();
    if problems.is_empty() {
        Ok(case)
    } else {
        Err(document.located(problems))
    }
}

/// Texts with values of keys, that of the same kind first.
fn examples_of(kind: Option<&str>) -> Vec<&'static str> {
    let mut own = Vec::new();
    let mut others = Vec::new();
    for (name, text) in EXAMPLES {
        match Some(name) == kind {
            true => own.push(text),
            false => others.push(text),
        }
    }
    own.extend(others);
    own.push(MORE_EXAMPLES);
    own
}

/// A case of this kind as a table; empty if there is no such kind.
fn defaults_of(kind: &str) -> Table {
    let case = Table::from_iter([("kind".to_owned(), toml::Value::from(kind))]);
    let whole = Table::from_iter([("case".to_owned(), toml::Value::Table(case))]);
    from_table::<FlowCase>(whole)
        .map(|case| to_table(&case))
        .unwrap_or_default()
}

/// The keys of `over` in place of those of `base`; a table of another kind replaces the whole table.
fn over(mut base: Table, over: Table) -> Table {
    let other = TAGS
        .iter()
        .any(|tag| over.contains_key(*tag) && over.get(*tag) != base.get(*tag));
    if other {
        return over;
    }
    for (key, value) in over {
        let value = match (base.remove(&key), value) {
            (Some(toml::Value::Table(inner)), toml::Value::Table(value)) => {
                toml::Value::Table(self::over(inner, value))
            }
            (_, value) => value,
        };
        base.insert(key, value);
    }
    base
}

#[cfg(test)]
mod tests {
    use super::super::{CaseFile, WakePreset};
    use super::*;
    use crate::keys::Kind;

    fn message(text: &str) -> String {
        CaseFile::parse(text, Path::new("c.toml"))
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn each_key_of_a_case_names_itself_and_what_it_takes() {
        let first = |text: &str| message(text).lines().next().unwrap_or_default().to_owned();
        let missing = first("[time]\nend_s = 1.0\n");
        assert!(
            missing.starts_with(
                "c.toml:1: case.kind is missing: one of \"vortex_pair\", \"wake\", \"free\""
            ),
            "{missing}"
        );
        for (text, wanted) in [
            (
                "[case]\nkind = \"vortex_pear\"\n",
                "c.toml:2: case.kind = \"vortex_pear\" is not allowed: one of \"vortex_pair\"",
            ),
            (
                "[case]\nkind = \"vortex_pair\"\ncells = 64\n",
                "c.toml:3: case.cells = 64 is not allowed: a list of 3 whole numbers",
            ),
            (
                "[case]\nkind = \"wake\"\ncells = [24, -1, 80]\n",
                "c.toml:3: case.cells[1] = -1 is not allowed: a whole number that is not negative, e.g. 24",
            ),
            (
                "[case]\nkind = \"vortex_pair\"\nend_tau = 1\n",
                "c.toml:3: case.end_tau = 1 is not allowed: there is no such key; it is a key of [wake].",
            ),
            (
                "[case]\nkind = \"wake\"\n[time]\nscheme = \"rk3\"\n",
                "c.toml:4: time.scheme = \"rk3\" is not allowed: one of \"adams_bashforth2\", \"runge_kutta3\"",
            ),
            (
                "[case]\nkind = \"vortex_pair\"\n[solver]\nsubgrid = \"wale\"\n",
                "c.toml:4: solver.subgrid = \"wale\" is not allowed: a table, e.g. { model = \"none\" }",
            ),
        ] {
            let m = first(text);
            assert!(m.starts_with(wanted), "{m}");
        }
    }

    #[test]
    fn tables_without_their_kind_and_needed_values_are_the_defaults() {
        let parse = |text: &str| CaseFile::parse(text, Path::new("c.toml")).unwrap().toml;
        let pair = parse("[case]\nkind = \"wake\"\npair = { spacing_m = 30.0 }\n");
        assert!(
            pair.contains("from = \"circulation\"\nspacing_m = 30.0\ncirculation_m2_s = 500.0"),
            "{pair}"
        );
        let free =
            parse("[case]\nkind = \"free\"\ninitial = { spacing_m = 30.0 }\n[time]\nend_s = 1.0\n");
        assert!(
            free.contains("kind = \"vortex_pair\"") && free.contains("spacing_m = 30.0"),
            "{free}"
        );
    }

    #[test]
    fn a_file_over_a_preset_needs_only_what_differs_and_is_blamed_on_its_own_lines() {
        let over =
            |text: &str| CaseFile::parse_over(Some(WakePreset::Fine), text, Path::new("c.toml"));
        let fine = over("").unwrap();
        assert_eq!(over("").unwrap().toml, fine.toml);
        let changed = over("[case.pair]\nfrom = \"a340\"\n[solver.subgrid]\norder = 2\n")
            .unwrap()
            .toml;
        assert!(
            changed.contains("from = \"a340\"\n") && !changed.contains("spacing_m"),
            "{changed}"
        );
        assert!(
            changed.contains("model = \"multiscale_wale\"\norder = 2\n"),
            "{changed}"
        );
        let message = over("\n[case]\nheight = 9.0\n").unwrap_err().to_string();
        assert!(
            message.starts_with("c.toml:3: case.height = 9.0 is not allowed"),
            "{message}"
        );
    }

    fn wrong<'k>(
        keys: &'k [Key],
        path: &str,
        before: &str,
        out: &mut Vec<(String, &'k Kind, String)>,
    ) {
        for key in keys
            .iter()
            .filter(|key| !(path.is_empty() && key.name == "case"))
        {
            let here = crate::keys::join(path, key.name);
            out.push((
                here.clone(),
                &key.kind,
                format!("{before}{here} = 1979-05-27\n"),
            ));
            match &key.kind {
                Kind::Table(inner) => wrong(inner, &here, before, out),
                Kind::Tagged { tag, kinds } => {
                    for (name, inner) in kinds {
                        wrong(
                            inner,
                            &here,
                            &format!("{before}{here}.{tag} = \"{name}\"\n"),
                            out,
                        );
                    }
                }
                _ => {}
            }
        }
    }

    #[test]
    fn every_key_of_every_case_has_an_example() {
        let mut cases = Vec::new();
        let keys = keys_of::<FlowCase>();
        wrong(&keys, "", "case.kind = \"vortex_pair\"\n", &mut cases);
        let case = keys.iter().find(|key| key.name == "case").unwrap();
        let Kind::Tagged { kinds, .. } = &case.kind else {
            panic!("tagged")
        };
        assert_eq!(
            kinds
                .iter()
                .map(|(name, _)| *name)
                .collect::<Vec<_>>()
                .len(),
            EXAMPLES.len()
        );
        for (name, inner) in kinds {
            wrong(
                inner,
                "case",
                &format!("case.kind = \"{name}\"\n"),
                &mut cases,
            );
        }
        assert!(cases.len() > 100, "{}", cases.len());
        for (key, kind, text) in cases {
            let line = text.lines().count();
            let m = message(&text);
            let own = m
                .lines()
                .any(|l| l.starts_with(&format!("c.toml:{line}: {key} ")));
            assert!(own, "{text}{m}");
            let plain = matches!(kind, Kind::Number | Kind::Whole { .. } | Kind::Text);
            let case = text.split('"').nth(1).unwrap();
            let examples = examples_of(Some(case));
            let format = Format {
                keys: &[],
                defaults: &defaults_of(case),
                examples: &examples,
            };
            assert!(
                !plain || format.example(&key, kind).is_some(),
                "{key} needs a value in flow/more_examples.toml"
            );
        }
    }
}
