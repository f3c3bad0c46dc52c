//! A text and the description of its keys: what does not fit, the table of the text, and the lines of problems that are found
//! later.

use super::declare::{Declared, from_table};
use super::key::{Key, Kind, join};
use super::problem::Problem;
use super::words::{near, one_of, quote, table_with, wanted};
use crate::Error;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::Value;
use toml::de::{DeTable, DeValue};

/// What a kind of file may say.
pub(crate) struct Format<'a> {
    /// Its keys.
    pub(crate) keys: &'a [Key],
    /// A whole file: kinds and needed values that a text leaves out are those of this one.
    pub(crate) defaults: &'a toml::Table,
    /// Texts with examples of values, the best ones first.
    pub(crate) examples: &'a [&'a str],
}

/// A text that is TOML.
pub(crate) struct Text<'a> {
    text: &'a str,
    path: &'a Path,
    table: DeTable<'a>,
    /// Where the lines end: a long list asks for the line of each of its values.
    breaks: Vec<usize>,
}

impl<'a> Text<'a> {
    /// Reads the text of the file `path`.
    ///
    /// # Errors
    /// The line and what is wrong, without the text that is there.
    pub(crate) fn parse(text: &'a str, path: &'a Path) -> Result<Self, Error> {
        let mut breaks = Vec::new();
        for (index, byte) in text.bytes().enumerate() {
            if byte == b'\n' {
                breaks.push(index);
            }
        }
        match DeTable::parse(text) {
            Ok(table) => Ok(Self {
                text,
                path,
                table: table.into_inner(),
                breaks,
            }),
            Err(error) => {
                let index = error.span().map_or(0, |span| span.start);
                let key = key_of_line(text, index).map(|key| format!("{}: ", quote(key)));
                Err(Error::Malformed {
                    path: path.to_owned(),
                    line: breaks.partition_point(|end| *end < index) + 1,
                    message: format!(
                        "{}this is not valid TOML: {}",
                        key.unwrap_or_default(),
                        error.message().replace('\n', " ")
                    ),
                })
            }
        }
    }

    /// The line of a key, from 1; none if the text does not state it.
    pub(crate) fn line(&self, path: &str) -> Option<usize> {
        // The values of a list have its line.
        let path = if path.ends_with(']') {
            path.split_once('[')?.0
        } else {
            path
        };
        find(&self.table, path).map(|(span, _)| self.line_of(&span))
    }

    /// The line of a place, from 1.
    fn line_of(&self, at: &Range<usize>) -> usize {
        self.breaks.partition_point(|end| *end < at.start) + 1
    }

    /// The line of a key, or of the table that would have it.
    fn line_near(&self, path: &str) -> Option<usize> {
        self.line(path)
            .or_else(|| self.line_near(path.rsplit_once('.')?.0))
    }

    /// The value of a key.
    pub(crate) fn value(&self, path: &str) -> Option<&DeValue<'a>> {
        find(&self.table, path).map(|(_, value)| value.get_ref())
    }

    /// A plain value as the text writes it; none for lists and tables, of which a message knows the part that matters.
    pub(crate) fn written(&self, path: &str) -> Option<String> {
        let (_, value) = find(&self.table, path)?;
        let is_plain = !matches!(value.get_ref(), DeValue::Array(_) | DeValue::Table(_));
        is_plain.then(|| self.quote(value.span()))
    }

    /// The table of the text, with the kinds that it omits.
    ///
    /// # Errors
    /// Every key that is not known, has a value of the wrong kind or is missing, in the order of the lines.
    pub(crate) fn vet(&self, format: &Format<'_>) -> Result<toml::Table, Error> {
        self.walk(format, None).map(|(table, _)| table)
    }

    /// As [`Self::vet`], but keys that are not known are skipped; returns their paths, too.
    ///
    /// # Errors
    /// Every key that has a value of the wrong kind or is missing, in the order of the lines.
    pub(crate) fn vet_known(
        &self,
        format: &Format<'_>,
    ) -> Result<(toml::Table, Vec<String>), Error> {
        self.walk(format, Some(Vec::new()))
    }

    fn walk(
        &self,
        format: &Format<'_>,
        skipped: Option<Vec<String>>,
    ) -> Result<(toml::Table, Vec<String>), Error> {
        let mut walk = Walk {
            document: self,
            format,
            found: Vec::new(),
            skipped,
        };
        let defaults = Some(format.defaults);
        let table = walk.table(format.keys, &self.table, "", 1, defaults, None);
        if walk.found.is_empty() {
            return Ok((table, walk.skipped.unwrap_or_default()));
        }
        Err(self.invalid(walk.found))
    }

    /// A table whose keys all fit as the value of its type.
    ///
    /// # Errors
    /// A key that does not fit; a table from [`Self::vet`] has none.
    pub(crate) fn read<T: Declared>(&self, table: toml::Table) -> Result<T, Error> {
        from_table(table).ok_or_else(|| Error::Malformed {
            path: self.path.to_owned(),
            line: 1,
            message: "a value does not fit its key".into(),
        })
    }

    /// Problems with the lines where the text states their keys, and values as it writes them.
    pub(crate) fn located(&self, mut problems: Vec<Problem>) -> Error {
        for problem in &mut problems {
            if let Some(written) = self.written(&problem.key) {
                problem.value = written;
            } else if self.line(&problem.key).is_none()
                && !["", Problem::ABSENT].contains(&problem.value.as_str())
            {
                problem.value += " (the default)";
            }
            problem.line = self.line_near(&problem.key);
        }
        self.invalid(problems)
    }

    fn invalid(&self, mut problems: Vec<Problem>) -> Error {
        problems.sort_by_key(|problem| problem.line);
        Error::Invalid {
            path: self.path.to_owned(),
            problems,
        }
    }

    fn quote(&self, span: Range<usize>) -> String {
        quote(self.text.get(span).unwrap_or_default())
    }
}

/// Position of the key with this path, and its value; the path may lead through a table of a list.
fn find<'t, 'a>(
    table: &'t DeTable<'a>,
    path: &str,
) -> Option<(Range<usize>, &'t Spanned<DeValue<'a>>)> {
    let (head, rest) = path
        .split_once('.')
        .map_or((path, None), |(h, r)| (h, Some(r)));
    let (name, place) = match head.strip_suffix(']').and_then(|head| head.split_once('[')) {
        Some((name, place)) => (name, Some(place.parse::<usize>().ok()?)),
        None => (head, None),
    };
    let (key, value) = table.iter().find(|(key, _)| key.get_ref() == name)?;
    let value = match (place, value.get_ref()) {
        (Some(place), DeValue::Array(values)) => values.get(place)?,
        _ => value,
    };
    match (rest, value.get_ref()) {
        (None, _) => Some((key.span(), value)),
        (Some(rest), DeValue::Table(inner)) => find(inner, rest),
        (Some(_), _) => None,
    }
}

fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(value) => {
            let number: f64 = value.as_str().parse().ok()?;
            (number.is_finite() || !value.as_str().contains(|c: char| c.is_ascii_digit()))
                .then_some(number)
        }
        DeValue::Integer(value) if value.radix() == 10 => value.as_str().parse().ok(),
        DeValue::Integer(_) => whole(value).map(|number| number as f64),
        _ => None,
    }
}

fn whole(value: &DeValue<'_>) -> Option<i64> {
    let DeValue::Integer(value) = value else {
        return None;
    };
    i64::from_str_radix(value.as_str(), value.radix()).ok()
}

/// A whole number from 0 to the largest one.
fn whole_up_to(value: &DeValue<'_>, largest: u64) -> Option<i64> {
    let number = whole(value)?;
    let is_allowed = u64::try_from(number).is_ok_and(|number| number <= largest);
    is_allowed.then_some(number)
}

/// The key of the line that holds the byte at `index`, if the line has one.
fn key_of_line(text: &str, index: usize) -> Option<&str> {
    let start = text.get(..index)?.rfind('\n').map_or(0, |end| end + 1);
    let line = text.get(start..)?.lines().next()?;
    let (key, _) = line.split_once('=')?;
    let key = key.trim();
    let is_bare = key
        .bytes()
        .all(|b| b.is_ascii_alphanumeric() || b"_-.".contains(&b));
    is_bare.then_some(key)
}

/// The value of a key in a text with examples, if it is of this kind; empty lists are no examples.
fn value_in_example(text: &str, path: &str, kind: &Kind) -> Option<String> {
    let document = Text::parse(text, Path::new("")).ok()?;
    let (_, value) = find(&document.table, path)?;
    let has_values = value.get_ref().as_array().map(|values| !values.is_empty());
    let fits = has_values == matches!(kind, Kind::List { .. }).then_some(true);
    fits.then(|| document.quote(value.span()))
}

/// The kinds that a table may have, each with its keys.
type AllKinds = [(&'static str, Vec<Key>)];
/// The tag of a table, the kind that it has, and all that it may have.
type Kinds<'k> = (&'k str, &'k str, &'k AllKinds);

struct Walk<'w> {
    document: &'w Text<'w>,
    format: &'w Format<'w>,
    found: Vec<Problem>,
    /// Paths of keys that are not known, where these are skipped.
    skipped: Option<Vec<String>>,
}

impl Walk<'_> {
    fn refuse(&mut self, key: String, value: String, allowed: String, line: usize) {
        let mut problem = Problem::new(key, value, allowed);
        problem.line = Some(line);
        self.found.push(problem);
    }

    /// A value as the text writes it; nothing for tables, which no line can show.
    fn shown(&self, value: &Spanned<DeValue<'_>>) -> String {
        let is_table = match value.get_ref() {
            DeValue::Array(values) => values
                .first()
                .is_some_and(|first| first.get_ref().is_table()),
            other => other.is_table(),
        };
        if is_table {
            String::new()
        } else {
            self.document.quote(value.span())
        }
    }

    /// A table at a path and a line with these keys; it has `defaults` where the text omits them. `kinds` are those of a table with a tag.
    fn table(
        &mut self,
        keys: &[Key],
        table: &DeTable<'_>,
        path: &str,
        line: usize,
        defaults: Option<&toml::Table>,
        kinds: Option<Kinds<'_>>,
    ) -> toml::Table {
        let mut out = toml::Table::new();
        for (name, value) in table {
            let here = name.get_ref().as_ref();
            let line = self.document.line_of(&name.span());
            match keys.iter().find(|key| key.name == here) {
                Some(key) => {
                    let defaults = defaults.and_then(|all| all.get(here)?.as_table());
                    let path = join(path, here);
                    if let Some(value) = self.value(&key.kind, value, &path, line, defaults) {
                        out.insert(here.to_owned(), value);
                    }
                }
                None if kinds.is_some_and(|(tag, ..)| tag == here) => {}
                None => {
                    let key = join(path, &quote(here));
                    if let Some(skipped) = &mut self.skipped {
                        skipped.push(key);
                        continue;
                    }
                    let allowed = self.unknown(keys, here, path, kinds);
                    self.refuse(key, self.shown(value), allowed, line);
                }
            }
        }
        for key in keys {
            if !key.is_required || table.contains_key(key.name) {
                continue;
            }
            match defaults.and_then(|all| all.get(key.name)) {
                Some(default) => drop(out.insert(key.name.to_owned(), default.clone())),
                None => self.refuse_missing(key, path, line),
            }
        }
        out
    }

    /// Refuses a table without a key that has no default; of a table with a tag, the tag must be stated.
    fn refuse_missing(&mut self, key: &Key, path: &str, line: usize) {
        let path = join(path, key.name);
        let (path, allowed) = match &key.kind {
            Kind::Tagged { tag, kinds } => (join(&path, tag), one_of(&names(kinds), "")),
            kind => (path.clone(), self.wanted(&path, kind, "")),
        };
        self.refuse(path, Problem::ABSENT.into(), allowed, line);
    }

    /// A value at a path and a line; a table has `defaults` where the text omits its keys.
    fn value(
        &mut self,
        kind: &Kind,
        value: &Spanned<DeValue<'_>>,
        path: &str,
        line: usize,
        defaults: Option<&toml::Table>,
    ) -> Option<Value> {
        let inner = value.get_ref();
        let read = match (kind, inner) {
            (Kind::Number, _) => number(inner).map(Value::Float),
            (Kind::Whole { largest }, _) => whole_up_to(inner, *largest).map(Value::Integer),
            (Kind::Switch, DeValue::Boolean(value)) => Some(Value::Boolean(*value)),
            (Kind::Text, DeValue::String(text)) => Some(Value::String(text.to_string())),
            (Kind::Choice(names), DeValue::String(text))
                if names.iter().any(|name| name == text) =>
            {
                Some(Value::String(text.to_string()))
            }
            (Kind::List { of, len }, DeValue::Array(values))
                if len.is_none_or(|len| len == values.len()) =>
            {
                // Each value that does not fit is named itself.
                let mut list = Vec::with_capacity(values.len());
                for (i, value) in values.iter().enumerate() {
                    let line = self.document.line_of(&value.span());
                    list.extend(self.value(of, value, &format!("{path}[{i}]"), line, None));
                }
                return Some(Value::Array(list));
            }
            (Kind::Table(keys), DeValue::Table(table)) => {
                return Some(Value::Table(
                    self.table(keys, table, path, line, defaults, None),
                ));
            }
            (Kind::Tagged { tag, kinds }, DeValue::Table(table)) => {
                let table = self.tagged(tag, kinds, table, path, line, defaults);
                return table.map(Value::Table);
            }
            _ => None,
        };
        if read.is_none() {
            let allowed = self.wanted(path, kind, inner.as_str().unwrap_or_default());
            self.refuse(path.to_owned(), self.shown(value), allowed, line);
        }
        read
    }

    fn tagged(
        &mut self,
        tag: &str,
        kinds: &AllKinds,
        table: &DeTable<'_>,
        path: &str,
        line: usize,
        defaults: Option<&toml::Table>,
    ) -> Option<toml::Table> {
        let of_default = defaults.and_then(|d| d.get(tag)).and_then(Value::as_str);
        let tag_path = join(path, tag);
        let name = match (
            table.iter().find(|(key, _)| key.get_ref() == tag),
            of_default,
        ) {
            (Some((key, value)), _) => {
                let line = self.document.line_of(&key.span());
                let kind = Kind::Choice(names(kinds));
                self.value(&kind, value, &tag_path, line, None)?;
                value.get_ref().as_str()?
            }
            (None, Some(name)) => name,
            (None, None) => {
                let allowed = one_of(&names(kinds), "");
                self.refuse(tag_path, Problem::ABSENT.into(), allowed, line);
                return None;
            }
        };
        let keys = kinds
            .iter()
            .find(|(n, _)| *n == name)
            .map_or(&[][..], |(_, keys)| keys);
        let defaults = defaults.filter(|_| of_default == Some(name));
        let kinds = Some((tag, name, kinds));
        let mut out = self.table(keys, table, path, line, defaults, kinds);
        out.insert(tag.to_owned(), Value::String(name.to_owned()));
        Some(out)
    }

    /// What to write in place of a key that is not known in the table at `path`.
    fn unknown(&self, keys: &[Key], here: &str, path: &str, kinds: Option<Kinds<'_>>) -> String {
        let mut known = Vec::new();
        if let Some((tag, chosen, all)) = kinds {
            known.push(tag);
            let mut others = Vec::new();
            for (name, keys) in all {
                if keys.iter().any(|key| key.name == here) {
                    others.push(format!("\"{name}\""));
                }
            }
            if !others.is_empty() {
                let tag = join(path, tag);
                let needed = others.join(" or ");
                let stated = if self.document.value(&tag).is_some() {
                    ""
                } else {
                    ", the default"
                };
                return format!(
                    "this key is for {tag} = {needed}, and {tag} is \"{chosen}\"{stated}"
                );
            }
        }
        let meant = near(here, keys.iter().map(|key| key.name));
        let hint = match (meant, table_with(self.format.keys, here, "")) {
            (Some(meant), _) => format!("; did you mean {meant}?"),
            (None, Some(table)) if table.is_empty() => {
                "; it belongs before the first [section].".into()
            }
            (None, Some(table)) => format!("; it is a key of [{table}]."),
            (None, None) => ".".into(),
        };
        known.extend(keys.iter().map(|key| key.name));
        format!(
            "there is no such key{hint} Known here: {}",
            known.join(", ")
        )
    }

    /// What a key takes in place of what is written, with an example.
    fn wanted(&self, path: &str, kind: &Kind, written: &str) -> String {
        let name = path
            .rsplit('.')
            .next()
            .and_then(|name| name.split('[').next());
        let what = wanted(name.unwrap_or(path), kind, written);
        match kind {
            Kind::Switch | Kind::Choice(_) => what,
            Kind::Table(keys) => {
                let inner = keys.first().map(|k| {
                    format!(
                        "{} = {}",
                        k.name,
                        self.example(&join(path, k.name), &k.kind)
                    )
                });
                format!("{what}, e.g. {{ {} }}", inner.unwrap_or_default())
            }
            Kind::Tagged { tag, kinds } => {
                let plainest = kinds
                    .iter()
                    .min_by_key(|(_, keys)| keys.iter().filter(|k| k.is_required).count());
                format!(
                    "{what}, e.g. {{ {tag} = \"{}\" }}",
                    plainest.map_or("", |(name, _)| name)
                )
            }
            _ => format!("{what}, e.g. {}", self.example(path, kind)),
        }
    }

    /// An example of the value of a key: its own, else one of the kind.
    fn example(&self, path: &str, kind: &Kind) -> String {
        self.format
            .example(path, kind)
            .unwrap_or_else(|| match kind {
                Kind::Number => "1.0".into(),
                Kind::Whole { .. } => "1".into(),
                Kind::Switch => "true".into(),
                Kind::Choice(names) => format!("\"{}\"", names.first().unwrap_or(&"")),
                Kind::List { of, len } => format!(
                    "[{}]",
                    vec![self.example("", of); len.unwrap_or(2)].join(", ")
                ),
                Kind::Text | Kind::Table(_) | Kind::Tagged { .. } => "\"name\"".into(),
            })
    }
}

impl Format<'_> {
    /// The value of a key in the texts with examples, or its default; of a list also one of its values, `key[0]`.
    pub(crate) fn example(&self, path: &str, kind: &Kind) -> Option<String> {
        let (whole, is_element) = path
            .split_once('[')
            .map_or((path, false), |(whole, _)| (whole, true));
        let path = if is_element {
            format!("{whole}[0]")
        } else {
            whole.to_owned()
        };
        let mut examples = self.examples.iter();
        examples
            .find_map(|text| value_in_example(text, &path, kind))
            .or_else(|| {
                // A key of another kind may have the same name.
                let is_list = matches!(kind, Kind::List { .. });
                self.plain_default(whole)
                    .filter(|_| !is_element && !is_list)
            })
    }

    /// The default of a key that is neither a list nor a table.
    fn plain_default(&self, path: &str) -> Option<String> {
        let mut keys = path.split('.');
        let section = self.defaults.get(keys.next()?)?;
        let value = keys.try_fold(section, |table, key| table.get(key))?;
        let is_plain = !value.is_array() && !value.is_table();
        is_plain.then(|| value.to_string())
    }
}

/// The lines of a text that was written, each with the path of its key; of other lines that is empty.
pub(crate) fn lines_with_keys(toml: &str) -> impl Iterator<Item = (String, &str)> {
    let mut section = "";
    toml.lines().map(move |line| {
        section = line
            .strip_prefix('[')
            .map_or(section, |name| name.trim_end_matches(']'));
        (
            line.split_once(" = ")
                .map(|(key, _)| join(section, key))
                .unwrap_or_default(),
            line,
        )
    })
}

/// The value of the key with this path; a number in it is that of a table of a list.
pub(crate) fn value_at<'v>(table: &'v Value, path: &str) -> Option<&'v Value> {
    path.split('.').try_fold(table, |above, key| match above {
        Value::Array(list) => list.get(key.parse::<usize>().ok()?),
        _ => above.get(key),
    })
}

fn names(kinds: &AllKinds) -> Vec<&'static str> {
    kinds.iter().map(|(name, _)| *name).collect()
}
