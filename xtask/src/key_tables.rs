//! The keys of scenes, plans and cases as tables for the book, from their declarations (`keys!`, `table!`) in the source of `sim`.

use crate::workspace::root;
use fixtures::failure::Failure;
use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::collections::BTreeMap;
use walkdir::WalkDir;

/// A key of a table.
struct Field {
    name: String,
    meaning: String,
    of_type: String,
    default: String,
    allowed: Vec<String>,
}

/// One value of the key that chooses: the value, its meaning, the table whose keys follow, if any, and further keys.
type KindKeys = (String, String, String, Vec<Field>);

/// What the source declares, by the names of the types.
#[derive(Default)]
struct Declarations {
    tables: BTreeMap<String, Vec<Field>>,
    /// The key that chooses, and its values.
    kinds: BTreeMap<String, (String, Vec<KindKeys>)>,
    /// Variants and their names in files.
    choices: BTreeMap<String, Vec<(String, String)>>,
    /// What constants that are limits allow.
    limits: BTreeMap<String, String>,
}

/// Sections that were written: the path of each table by its type.
type Written = BTreeMap<String, String>;

/// The page of all keys: scenes, plans of data sets, cases of flows.
///
/// # Errors
/// Fails if the source cannot be read.
pub(crate) fn page() -> Result<String, Failure> {
    let mut known = Declarations::default();
    for entry in WalkDir::new(root().join("crates/sim/src")).sort_by_file_name() {
        let path = entry?.into_path();
        if path.extension().is_some_and(|end| end == "rs") {
            let text = std::fs::read_to_string(&path)?;
            known.read(text.parse().unwrap_or_default());
        }
    }
    let mut page = String::new();
    for (title, of_type) in [
        ("Scenes", "Scene"),
        ("Plans of data sets", "PlanKeys"),
        ("Cases of flows", "FlowCase"),
    ] {
        page += &format!("## {title}\n\n");
        known.write(&mut page, of_type, "", &mut Written::new());
    }
    Ok(page)
}

impl Declarations {
    /// Takes the declarations of a source file.
    fn read(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        for (i, token) in tokens.iter().enumerate() {
            let TokenTree::Ident(word) = token else {
                continue;
            };
            let body = group(tokens.get(i + 2));
            match (word.to_string().as_str(), body) {
                ("keys", Some(body)) if is_mark(tokens.get(i + 1), '!') => self.read_items(body),
                // A table alone: its name, then its keys.
                ("table", Some(body)) if is_mark(tokens.get(i + 1), '!') => {
                    let named = documented(&body).1;
                    if let [name, keys] = named
                        && let Some(keys) = group(Some(keys))
                    {
                        self.tables.insert(name.to_string(), fields(&keys));
                    }
                }
                ("foreign_choices", Some(body)) if is_mark(tokens.get(i + 1), '!') => {
                    for pair in body.chunks_exact(2) {
                        let variants = group(pair.get(1)).unwrap_or_default();
                        self.choices.insert(pair[0].to_string(), choices(&variants));
                    }
                }
                ("const", _) => {
                    let end = tokens[i..].iter().position(|t| is_mark(Some(t), ';'));
                    let item = &tokens[i..end.map_or(tokens.len(), |length| i + length)];
                    if item.get(3).is_some_and(|of| of.to_string() == "Number") {
                        let text = limit(&item[5..]);
                        self.limits.insert(item[1].to_string(), text);
                    }
                }
                _ => {}
            }
        }
    }

    fn read_items(&mut self, tokens: Vec<TokenTree>) {
        for (i, token) in tokens.iter().enumerate() {
            let name = tokens
                .get(i + 1)
                .map(ToString::to_string)
                .unwrap_or_default();
            match token.to_string().as_str() {
                "table" => {
                    let body = group(tokens.get(i + 2)).unwrap_or_default();
                    self.tables.insert(name, fields(&body));
                }
                "choice" => {
                    let body = group(tokens.get(i + 2)).unwrap_or_default();
                    self.choices.insert(name, choices(&body));
                }
                "kinds" => {
                    let tag = tokens.get(i + 3).map(text_of).unwrap_or_default();
                    // the body may follow `with` and the name of a trait
                    let body = tokens[i + 4..].iter().find_map(|token| group(Some(token)));
                    self.kinds
                        .insert(name, (tag, kinds(&body.unwrap_or_default())));
                }
                _ => {}
            }
        }
    }

    /// Adds the section of a table at a path, and those of the tables below it.
    fn write(&self, page: &mut String, of_type: &str, path: &str, written: &mut Written) {
        let below = |name: &str| match path {
            "" => name.to_owned(),
            _ => format!("{path}.{name}"),
        };
        if !path.is_empty() {
            *page += &format!("### `[{path}]`\n\n");
        }
        if let Some(first) = written.get(of_type) {
            *page += &format!("Keys as in `[{first}]`.\n\n");
            return;
        }
        written.insert(of_type.to_owned(), path.to_owned());
        let mut nested = Vec::new();
        if let Some((tag, kinds)) = self.kinds.get(of_type) {
            *page += &format!(
                "| `{tag}` | key | default | allowed | meaning |\n|---|---|---|---|---|\n"
            );
            for (word, meaning, inner, own) in kinds {
                *page += &format!("| `\"{word}\"` | | | | {meaning} |\n");
                let inner = self
                    .tables
                    .get(inner)
                    .map(Vec::as_slice)
                    .unwrap_or_default();
                for field in inner.iter().chain(own) {
                    *page += &format!("| | {} |\n", self.row(field));
                    nested.extend(
                        self.table_of(field)
                            .map(|inner| (inner, below(&field.name))),
                    );
                }
            }
        }
        if let Some(fields) = self.tables.get(of_type) {
            *page += "| key | default | allowed | meaning |\n|---|---|---|---|\n";
            for field in fields {
                match self.table_of(field) {
                    Some(inner) => nested.push((inner, below(&field.name))),
                    None => *page += &format!("| {} |\n", self.row(field)),
                }
            }
        }
        page.push('\n');
        for (inner, path) in nested {
            self.write(page, &inner, &path, written);
        }
    }

    /// The table that a key holds, or a list of which it holds.
    fn table_of(&self, field: &Field) -> Option<String> {
        let inner = inner_type(&field.of_type);
        let is_table = self.tables.contains_key(inner) || self.kinds.contains_key(inner);
        is_table.then(|| inner.to_owned())
    }

    /// The cells of a key.
    fn row(&self, field: &Field) -> String {
        let inner = inner_type(&field.of_type);
        let mut allowed = Vec::new();
        if let Some(choices) = self.choices.get(inner) {
            allowed.extend(choices.iter().map(|(_, word)| format!("`\"{word}\"`")));
        }
        for limit in &field.allowed {
            allowed.push(self.limits.get(limit).unwrap_or(limit).clone());
        }
        let default = field.default.rsplit("::").next().unwrap_or_default().trim();
        let named = self.choices.get(inner).and_then(|choices| {
            let found = choices.iter().find(|(variant, _)| variant == default)?;
            Some(format!("`\"{}\"`", found.1))
        });
        let default = match (named, field.default.as_str()) {
            (Some(name), _) => name,
            (None, "" | "None" | "String::new ()" | "Vec::new ()") => "-".into(),
            (None, _) if self.table_of(field).is_some() => "below".into(),
            (None, text) => format!("`{text}`"),
        };
        let cells = [default, allowed.join(", "), field.meaning.clone()];
        let cells = cells.map(|cell| cell.replace('|', "\\|"));
        format!("`{}` | {}", field.name, cells.join(" | "))
    }
}

/// What a type of a key holds, without lists, options and boxes.
fn inner_type(of_type: &str) -> &str {
    let inner = of_type.rsplit('<').next().unwrap_or_default();
    inner
        .trim_matches([' ', '>', '['])
        .split(';')
        .next()
        .unwrap_or_default()
        .trim()
}

/// The tokens between braces, brackets or parentheses.
fn group(token: Option<&TokenTree>) -> Option<Vec<TokenTree>> {
    match token {
        Some(TokenTree::Group(group)) => Some(group.stream().into_iter().collect()),
        _ => None,
    }
}

fn is_mark(token: Option<&TokenTree>, mark: char) -> bool {
    matches!(token, Some(TokenTree::Punct(p)) if p.as_char() == mark)
}

/// Whether `=>` is at a place.
fn is_arrow(tokens: &[TokenTree], at: usize) -> bool {
    is_mark(tokens.get(at), '=') && is_mark(tokens.get(at + 1), '>')
}

/// The text of a literal.
fn text_of(token: &TokenTree) -> String {
    let text = token.to_string();
    text.trim_matches('"')
        .replace("\\\"", "\"")
        .replace("\\\\", "\\")
}

fn source(tokens: &[TokenTree]) -> String {
    tokens.iter().cloned().collect::<TokenStream>().to_string()
}

/// The text of the documentation at the head of some tokens, and the tokens behind it.
fn documented(tokens: &[TokenTree]) -> (String, &[TokenTree]) {
    let mut lines = Vec::new();
    let mut rest = tokens;
    while is_mark(rest.first(), '#') {
        let attribute = group(rest.get(1)).unwrap_or_default();
        if attribute
            .first()
            .is_some_and(|name| name.to_string() == "doc")
        {
            lines.extend(attribute.last().map(|text| text_of(text).trim().to_owned()));
        }
        rest = &rest[2..];
    }
    // Links of the documentation of the crate lead nowhere in the book.
    let text = lines.join(" ").replace("[`", "`").replace("`]", "`");
    (text, rest)
}

/// Parts that end with a comma.
fn parts(tokens: &[TokenTree]) -> impl Iterator<Item = &[TokenTree]> {
    let parts = tokens.split(|token| is_mark(Some(token), ','));
    parts.filter(|part| !part.is_empty())
}

fn choices(tokens: &[TokenTree]) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for part in parts(tokens) {
        let (_, part) = documented(part);
        if let [variant, _, word] = part {
            found.push((variant.to_string(), text_of(word)));
        }
    }
    found
}

fn kinds(tokens: &[TokenTree]) -> Vec<KindKeys> {
    let mut found = Vec::new();
    for part in parts(tokens) {
        let (meaning, part) = documented(part);
        let Some(word) = part.first().map(text_of) else {
            continue;
        };
        let body = group(part.get(4)).unwrap_or_default();
        let is_list =
            matches!(part.get(4), Some(TokenTree::Group(g)) if g.delimiter() == Delimiter::Brace);
        if is_list {
            found.push((word, meaning, String::new(), fields(&body)));
        } else {
            let inner = source(&body).replace(' ', "");
            found.push((word, meaning, inner_type(&inner).to_owned(), Vec::new()));
        }
    }
    found
}

fn fields(tokens: &[TokenTree]) -> Vec<Field> {
    let mut found = Vec::new();
    for part in parts(tokens) {
        let (meaning, part) = documented(part);
        let ends: Vec<usize> = (0..part.len()).filter(|at| is_arrow(part, *at)).collect();
        let first_end = ends.first().copied().unwrap_or(part.len());
        let declared = &part[..first_end];
        let equals = declared.iter().position(|token| is_mark(Some(token), '='));
        let Some(type_and_name) = declared.get(..equals.unwrap_or(first_end)) else {
            continue;
        };
        let [name, _, of_type @ ..] = type_and_name else {
            continue;
        };
        let default = equals
            .map(|at| source(&declared[at + 1..]))
            .unwrap_or_default();
        let mut allowed = Vec::new();
        for (number, start) in ends.iter().enumerate() {
            let end = ends.get(number + 1).copied().unwrap_or(part.len());
            allowed.push(limit(&part[start + 2..end]));
        }
        found.push(Field {
            name: name.to_string(),
            meaning,
            of_type: source(of_type).replace(" as omitted", "").replace(' ', ""),
            default: plain(&default),
            allowed,
        });
    }
    found
}

/// What a limit allows: the text that it is declared with, a range, or the name of a constant.
fn limit(tokens: &[TokenTree]) -> String {
    if let [TokenTree::Ident(_), rest] = tokens
        && let Some(arguments) = group(Some(rest))
    {
        let text = arguments.iter().rev().find_map(literal);
        return text
            .unwrap_or_default()
            .replace(" {}", "")
            .replace("{FORMAT}, ", "");
    }
    plain(&source(tokens).replace("..=", " to "))
}

/// The text of a literal, or of the first one within a group.
fn literal(token: &TokenTree) -> Option<String> {
    match token {
        TokenTree::Literal(_) => Some(text_of(token)),
        TokenTree::Group(_) => group(Some(token))?.iter().find_map(literal),
        _ => None,
    }
}

/// Source tokens that a reader of a scene knows by other signs.
const SIGNS: [(&str, &str); 15] = [
    (" :: ", "::"),
    ("- ", "-"),
    (" . into ()", ""),
    (" ; ", "; "),
    (" , ", ", "),
    ("vec ! ", ""),
    ("std::f64::consts::", ""),
    ("f64::INFINITY", "inf"),
    ("f64::NEG_INFINITY", "-inf"),
    ("i64::MAX as u64", "2^63 - 1"),
    ("FRAC_PI_2", "π/2"),
    ("FRAC_PI_3", "π/3"),
    ("TAU", "2π"),
    ("PI", "π"),
    ("FORMAT", "that of the program"),
];

/// Source as a reader of a scene writes it.
fn plain(source: &str) -> String {
    let mut text = source.split_whitespace().collect::<Vec<_>>().join(" ");
    for (token, sign) in SIGNS {
        text = text.replace(token, sign);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_have_names_defaults_limits_and_meanings() {
        let source = r#"
            const ABOVE: Number = Number(|x| x > 0.0, "above 0");
            foreign_choices! { Profile { Flat = "flat", Round = "round" } }
            keys! {
                /// All.
                table Scene {
                    /// How far.
                    range_m: f64 = 2.0 => -1.0..=1e3,
                    /// Which profile.
                    profile: Profile = Profile::Round,
                    /// The wind.
                    flow: Flow = Flow::Calm {},
                }
                kinds Flow by "kind" {
                    /// No wind.
                    "calm" => Calm {},
                    /// A wind.
                    "uniform" => Uniform {
                        /// Speed.
                        speed_m_s: Option<f64> => ABOVE,
                    },
                }
            }
        "#;
        let mut known = Declarations::default();
        known.read(source.parse().unwrap());
        let mut page = String::new();
        known.write(&mut page, "Scene", "", &mut Written::new());
        for row in [
            "| `range_m` | `2.0` | -1.0 to 1e3 | How far. |",
            "| `profile` | `\"round\"` | `\"flat\"`, `\"round\"` | Which profile. |",
            "### `[flow]`",
            "| `\"calm\"` | | | | No wind. |",
            "| | `speed_m_s` | - | above 0 | Speed. |",
        ] {
            assert!(page.contains(row), "{row} in\n{page}");
        }
    }

    #[test]
    fn plans_have_their_keys_with_defaults_and_limits() {
        let page = page().unwrap();
        for row in [
            "| `sites` | `8` | 1 to 1000 | Number of sites. |",
            "| `empty` | `0.2` | 0.0 to 1.0 | Fraction of the flights without a wake. |",
            "### `[split]`",
            "### `[flight_rows]`",
        ] {
            assert!(page.contains(row), "{row} in\n{page}");
        }
    }

    #[test]
    fn no_key_of_the_default_scene_is_missing() {
        let page = page().unwrap();
        let scene: toml::Table = wakescope_sim::scene::TABLE2_TOML.parse().unwrap();
        let mut open: Vec<toml::Table> = vec![scene];
        while let Some(table) = open.pop() {
            for (key, value) in table {
                if let toml::Value::Table(inner) = value {
                    open.push(inner);
                } else {
                    assert!(page.contains(&format!("`{key}`")), "{key}");
                }
            }
        }
    }
}
