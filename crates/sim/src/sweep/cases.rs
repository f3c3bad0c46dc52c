//! The cases of a sweep: a grid or a list of values, further keys by expression, conditions; each a whole checked scene.
//!
//! The rows of a list are slowest, then the keys in the order in which they were given; the last is fastest. Check: the
//! stored cases, to the last bit.

use super::expression;
use super::key_path::{SceneKey, VaryingKey, resolve};
use crate::Error;
use crate::io::csv_input::TextTable;
use crate::io::{Provenance, csv::float_text};
use crate::keys::{Kind, Problem, to_table, value_at};
use crate::scene::{Scene, SceneFile, hash_of};
use crate::streams::stream;
use rand_xoshiro::rand_core::Rng;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Most cases of a sweep, before and after conditions.
pub const MOST_CASES: usize = 10_000;

/// What is to be swept.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct Request {
    /// KEY=a,b,c or KEY=lin:FIRST:LAST:COUNT or KEY=log:FIRST:LAST:COUNT; the last varies fastest.
    #[cfg_attr(feature = "cli", arg(long, value_name = "KEY=VALUES"))]
    pub vary: Vec<String>,
    /// CSV table of cases: one column per key, one row per case.
    #[cfg_attr(feature = "cli", arg(long = "cases", value_name = "FILE.csv"))]
    pub list: Option<PathBuf>,
    /// Key computed from others, e.g. "pulse.energy_j = 0.06/laser.pulse_repetition_hz".
    #[cfg_attr(feature = "cli", arg(long = "let", value_name = "KEY = EXPRESSION"))]
    pub lets: Vec<String>,
    /// Skip cases that violate this, e.g. "pulse.energy_j*laser.pulse_repetition_hz <= 2".
    #[cfg_attr(feature = "cli", arg(long = "where", value_name = "CONDITION"))]
    pub conditions: Vec<String>,
    /// Use a different seed per case; by default one seed for all.
    #[cfg_attr(feature = "cli", arg(long))]
    pub independent: bool,
    /// Seed in place of the scene's.
    #[cfg_attr(feature = "cli", arg(skip))]
    pub seed: Option<u64>,
}

/// One case.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Its number, from 0.
    pub index: usize,
    /// The whole scene.
    pub scene: SceneFile,
    /// Values of the keys that vary, as the results show them.
    pub values: Vec<String>,
}

/// All cases of a sweep, each within the limits of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    pub(super) keys: Vec<VaryingKey>,
    /// The cases in their order.
    pub cases: Vec<Case>,
    /// Scene, words and hash of the sweep.
    pub origin: Provenance,
}

impl Sweep {
    /// The cases of a request on the text of a scene; `path` is where its files are looked for.
    ///
    /// # Errors
    /// Keys, values and expressions that cannot be; more than [`MOST_CASES`]; no case; the first case whose scene is refused.
    pub fn parse(text: &str, path: &Path, request: &Request) -> Result<Self, Error> {
        let base = toml::from_str::<Table>(text).map_err(|e| {
            let malformed = Error::Malformed {
                path: path.to_owned(),
                line: 1,
                message: e.message().into(),
            };
            scene_error(text, path, malformed)
        })?;
        let grid = Grid::new(path, base, request)?;
        let cases = grid
            .cases()
            .map_err(|error| scene_error(text, path, error))?;
        let mut keys = Vec::new();
        for key in &grid.columns {
            keys.push(VaryingKey::new(key, false));
        }
        for (key, _) in &grid.lets {
            keys.push(VaryingKey::new(key, true));
        }
        if request.independent
            && let Ok(seed) = resolve("seed", "")
        {
            keys.push(VaryingKey::new(&seed, true));
        }
        let origin = grid.origin(&keys, &cases);
        Ok(Self {
            keys,
            cases,
            origin,
        })
    }

    /// Names of the keys that vary, as they were written.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.keys.iter().map(|key| key.name.as_str())
    }

    /// The keys of a case with their values, for messages.
    pub(super) fn described(&self, case: &Case) -> String {
        described(self.keys(), &case.values)
    }

    /// What went wrong with a case, and with how many others.
    pub(super) fn failed(&self, case: &Case, others: usize, error: Error) -> Error {
        failed(case.index, self.described(case), others, error)
    }
}

/// The error that the text of a scene has without the sweep, which names its line; another one if it has none.
fn scene_error(text: &str, path: &Path, other: Error) -> Error {
    match SceneFile::parse(text, path) {
        Ok(_) => other,
        Err(error) => error,
    }
}

fn described<'a>(names: impl Iterator<Item = &'a str>, values: &[String]) -> String {
    names
        .zip(values)
        .map(|(name, value)| format!("{name} = {value}"))
        .collect::<Vec<_>>()
        .join(", ")
}

/// An error of a case; the lines of its text are no lines of a file.
fn failed(case: usize, keys: String, others: usize, mut error: Error) -> Error {
    if let Error::Invalid { problems, .. } = &mut error {
        for problem in problems {
            problem.line = None;
        }
    }
    Error::Case {
        case,
        keys,
        others,
        source: Box::new(error),
    }
}

/// A refusal of a word of the command line.
fn refused(word: &str, problem: Problem) -> Error {
    Error::Invalid {
        path: word.into(),
        problems: vec![problem],
    }
}

/// Keys that vary together, and their values, a row for each combination.
type Axis = (Vec<SceneKey>, Vec<Vec<Value>>);

/// Refuses keys that vary twice.
fn check_columns(
    columns: &[SceneKey],
    lets: &[(SceneKey, &str)],
    is_independent: bool,
) -> Result<(), Error> {
    let mut paths = Vec::new();
    let mut has_seed = false;
    for key in columns.iter().chain(lets.iter().map(|(own, _)| own)) {
        if paths.contains(&&key.path) {
            let why = "each key varies once, by --vary, --cases or --let";
            return Err(refused("sweep", Problem::new(&key.name, "", why)));
        }
        paths.push(&key.path);
        has_seed |= key.path == "seed";
    }
    if is_independent && has_seed {
        let why = "with --independent each case has a seed of its own: leave one of the two out";
        return Err(refused("sweep", Problem::new("seed", "", why)));
    }
    Ok(())
}

/// A scene, keys, and the values of each combination of them.
struct Grid<'a> {
    path: &'a Path,
    base: Table,
    request: &'a Request,
    /// Keys with values of their own, and those that each combination has.
    columns: Vec<SceneKey>,
    rows: Vec<Vec<Value>>,
    /// Keys with the expressions that determine them.
    lets: Vec<(SceneKey, &'a str)>,
}

impl<'a> Grid<'a> {
    fn new(path: &'a Path, base: Table, request: &'a Request) -> Result<Self, Error> {
        let mut axes: Vec<Axis> = Vec::new();
        if let Some(path) = &request.list {
            axes.push(list(path)?);
        }
        for text in &request.vary {
            axes.push(axis(text).map_err(|problem| refused("--vary", problem))?);
        }
        let mut lets = Vec::new();
        for text in &request.lets {
            lets.push(binding(text).map_err(|problem| refused("--let", problem))?);
        }
        for text in &request.conditions {
            expression::holds(text, None)
                .map_err(|why| refused("--where", Problem::new("condition", text, why)))?;
        }
        let mut count = 1.0;
        let mut columns = Vec::new();
        // The last axis is the fastest.
        for (keys, rows) in &mut axes {
            count *= rows.len() as f64;
            columns.append(keys);
        }
        check_columns(&columns, &lets, request.independent)?;
        if count > MOST_CASES as f64 {
            let why =
                format!("a sweep has 1 to {MOST_CASES} cases: fewer values, or several sweeps");
            let problem = Problem::new("number of cases", format!("{count:?}"), why);
            return Err(refused("sweep", problem));
        }
        let mut combinations = vec![Vec::new()];
        for (_, rows) in &axes {
            let mut longer = Vec::with_capacity(combinations.len() * rows.len());
            for combination in &combinations {
                for row in rows {
                    longer.push([&combination[..], row].concat());
                }
            }
            combinations = longer;
        }
        Ok(Self {
            path,
            base,
            request,
            columns,
            rows: combinations,
            lets,
        })
    }

    fn cases(&self) -> Result<Vec<Case>, Error> {
        let mut cases = Vec::new();
        let mut refusals = Vec::new();
        for (combination, row) in self.rows.iter().enumerate() {
            let index = cases.len();
            let mut values = Vec::new();
            match self.scene(row, index, &mut values) {
                Ok(scene) => cases.extend(scene.map(|scene| Case {
                    index,
                    scene,
                    values,
                })),
                Err(error) => refusals.push((combination, values, error)),
            }
        }
        let others = refusals.len().saturating_sub(1);
        if let Some((combination, values, error)) = refusals.into_iter().next() {
            let keys = self
                .columns
                .iter()
                .chain(self.lets.iter().map(|(key, _)| key));
            let keys = described(keys.map(|key| key.name.as_str()), &values);
            return Err(failed(combination, keys, others, error));
        }
        if cases.is_empty() {
            let why = format!("none of the {} cases is left", self.rows.len());
            return Err(refused(
                "--where",
                Problem::new("condition", self.request.conditions.join(" and "), why),
            ));
        }
        Ok(cases)
    }

    /// The scene of a combination, whose values are reported one after the other; none where a condition does not hold.
    fn scene(
        &self,
        row: &[Value],
        index: usize,
        values: &mut Vec<String>,
    ) -> Result<Option<SceneFile>, Error> {
        let mut table = self.base.clone();
        if let Some(seed) = self.request.seed {
            table.insert(
                "seed".into(),
                Value::Integer(i64::try_from(seed).unwrap_or(i64::MAX)),
            );
        }
        for (key, value) in self.columns.iter().zip(row) {
            values.push(cell_text(value));
            set(&mut table, &key.path, value.clone());
        }
        for (key, expression) in &self.lets {
            let whole = self.whole(&table)?;
            let value = computed(key, expression, &whole)
                .map_err(|why| refused("--let", Problem::new(&key.name, *expression, why)))?;
            values.push(cell_text(&value));
            set(&mut table, &key.path, value);
        }
        if !self.request.conditions.is_empty() {
            let whole = self.whole(&table)?;
            for condition in &self.request.conditions {
                let holds = expression::holds(condition, Some(&|name| number_of_key(&whole, name)));
                if !holds
                    .map_err(|why| refused("--where", Problem::new("condition", condition, why)))?
                {
                    return Ok(None);
                }
            }
        }
        if self.request.independent {
            let seed = seed_of(&table).unwrap_or(Scene::default().seed);
            // TOML has signed whole numbers.
            let own = stream(seed, "sweep", index as u64).next_u64() >> 1;
            table.insert("seed".into(), Value::Integer(own as i64));
            values.push(own.to_string());
        }
        Ok(Some(SceneFile::parse(&text_of(&table), self.path)?))
    }

    /// A table with all defaults.
    fn whole(&self, table: &Table) -> Result<Value, Error> {
        let scene = SceneFile::without_limits(&text_of(table), self.path)?;
        Ok(Value::Table(to_table(&scene)))
    }

    fn origin(&self, keys: &[VaryingKey], cases: &[Case]) -> Provenance {
        let Request {
            vary,
            list,
            lets,
            conditions,
            independent,
            seed,
        } = self.request;
        let mut words: Vec<String> = vary.iter().map(|word| format!("--vary {word}")).collect();
        words.extend(list.as_ref().map(|_| "--cases FILE".to_owned()));
        words.extend(lets.iter().map(|word| format!("--let \"{word}\"")));
        words.extend(conditions.iter().map(|word| format!("--where \"{word}\"")));
        words.extend(independent.then(|| "--independent".to_owned()));
        let names = keys.iter().map(|key| key.name.as_str());
        let identity: Vec<&str> = names
            .chain(cases.iter().map(|case| case.scene.hash.as_str()))
            .collect();
        let scene_toml = format!("# sweep {}\n{}", words.join(" "), text_of(&self.base));
        let seed = seed
            .or(seed_of(&self.base))
            .unwrap_or(Scene::default().seed);
        Provenance::new(&scene_toml, &hash_of(&identity.join("\n")), seed)
    }
}

/// The value of a key by an expression of other keys.
fn computed(key: &SceneKey, expression: &str, whole: &Value) -> Result<Value, String> {
    let number = expression::value(expression, Some(&|name| number_of_key(whole, name)))?;
    key.of_number(number).map_err(|problem| problem.allowed)
}

fn seed_of(table: &Table) -> Option<u64> {
    u64::try_from(table.get("seed")?.as_integer()?).ok()
}

/// `KEY=VALUES`.
fn axis(word: &str) -> Result<Axis, Problem> {
    let example =
        "KEY=VALUES, e.g. pulse.energy_j=50e-6,150e-6 or pulse.energy_j=log:50e-6:600e-6:7";
    let (name, text) = word
        .split_once('=')
        .ok_or_else(|| Problem::new("--vary", word, example))?;
    let name = name.trim();
    let text = text.trim();
    let key = resolve(name, text)?;
    if text.is_empty() {
        return Err(Problem::new(
            name,
            "an empty list",
            format!("at least one value is needed: {example}"),
        ));
    }
    let range = text
        .split_once(':')
        .filter(|(kind, _)| is_numeric(&key) && matches!(*kind, "lin" | "log"));
    let values = match range {
        Some((kind, rest)) => {
            let numbers =
                range_of(kind == "log", rest).map_err(|why| Problem::new(name, text, why))?;
            numbers
                .into_iter()
                .map(|number| key.of_number(number))
                .collect::<Result<Vec<Value>, _>>()?
        }
        None => text
            .split(',')
            .map(|value| key.read(value))
            .collect::<Result<_, _>>()?,
    };
    let rows = values.into_iter().map(|value| vec![value]).collect();
    Ok((vec![key], rows))
}

/// Whether a key holds numbers.
fn is_numeric(key: &SceneKey) -> bool {
    matches!(key.kind, Kind::Number | Kind::Whole { .. })
}

/// `a:b:n`: from a to b, both as written.
fn range_of(is_log: bool, text: &str) -> Result<Vec<f64>, String> {
    let Some([first, last, count]) = three_numbers(text) else {
        return Err(wrong_range());
    };
    let is_finite = first.is_finite() && last.is_finite();
    if !is_finite || (is_log && !(first > 0.0 && last > 0.0)) {
        return Err(wrong_range());
    }
    if count.fract() != 0.0 || !(2.0..=MOST_CASES as f64).contains(&count) {
        return Err(wrong_range());
    }
    let last_index = count as usize - 1;
    let mut values = Vec::with_capacity(count as usize);
    for index in 0..=last_index {
        let fraction = index as f64 / (count - 1.0);
        values.push(match index {
            0 => first,
            _ if index == last_index => last,
            _ if is_log => first * (last / first).powf(fraction),
            _ => first + (last - first) * fraction,
        });
    }
    Ok(values)
}

/// Three numbers between colons.
fn three_numbers(text: &str) -> Option<[f64; 3]> {
    let mut numbers = Vec::new();
    for part in text.split(':') {
        numbers.push(part.parse().ok()?);
    }
    numbers.try_into().ok()
}

fn wrong_range() -> String {
    format!(
        "lin:FIRST:LAST:COUNT or log:FIRST:LAST:COUNT with finite numbers (log: above 0) and a count from 2 to \
         {MOST_CASES}, e.g. log:100e-9:800e-9:7"
    )
}

/// `KEY = EXPRESSION`.
fn binding(word: &str) -> Result<(SceneKey, &str), Problem> {
    let example = "KEY = EXPRESSION, e.g. pulse.energy_j = 0.06/laser.pulse_repetition_hz";
    let (name, text) = word
        .split_once('=')
        .ok_or_else(|| Problem::new("--let", word, example))?;
    let text = text.trim();
    let key = resolve(name.trim(), text)?;
    if !is_numeric(&key) {
        let allowed = "an expression is a number, and this key is none";
        return Err(Problem::new(&key.name, text, allowed));
    }
    expression::value(text, None).map_err(|why| Problem::new(&key.name, text, why))?;
    Ok((key, text))
}

/// The keys and rows of a list file.
fn list(path: &Path) -> Result<Axis, Error> {
    let table = TextTable::read(path)?;
    let name = path.display().to_string();
    list_of_table(&table).map_err(|problem| refused(&name, problem))
}

fn list_of_table(table: &TextTable) -> Result<Axis, Problem> {
    if table.rows.is_empty() {
        return Err(Problem::new(
            "rows",
            "0",
            "at least one row below the names of the keys",
        ));
    }
    let mut columns = Vec::with_capacity(table.header.len());
    for name in &table.header {
        columns.push(resolve(name.trim(), "")?);
    }
    let mut rows = Vec::with_capacity(table.rows.len());
    for cells in &table.rows {
        let mut row = Vec::with_capacity(cells.len());
        for (key, cell) in columns.iter().zip(cells) {
            row.push(key.read(cell)?);
        }
        rows.push(row);
    }
    Ok((columns, rows))
}

/// The text of a value in the results.
fn cell_text(value: &Value) -> String {
    match value {
        Value::Float(number) => float_text(*number),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// A table as TOML.
pub(crate) fn text_of(table: &Table) -> String {
    toml::to_string(table)
        .unwrap_or_else(|e| unreachable!("a table that was read can be written: {e}"))
}

/// Sets a key, with the tables above it where they are missing. A number in the path is that of a table of a list; a list that
/// has no such table gets one with this key alone, which is refused when the scene is read, as is what is no table.
pub(crate) fn set(table: &mut Table, path: &str, value: Value) {
    let Some((first, rest)) = path.split_once('.') else {
        table.insert(path.into(), value);
        return;
    };
    let is_list = rest.starts_with(|letter: char| letter.is_ascii_digit());
    let missing = if is_list {
        Value::Array(Vec::new())
    } else {
        Value::Table(Table::new())
    };
    match table.entry(first).or_insert(missing) {
        Value::Table(inner) => set(inner, rest, value),
        Value::Array(list) => {
            let (index, rest) = rest.split_once('.').unwrap_or((rest, ""));
            let index = index.parse().unwrap_or(list.len()).min(list.len());
            if index == list.len() {
                list.push(Value::Table(Table::new()));
            }
            if let Value::Table(inner) = &mut list[index] {
                set(inner, rest, value);
            }
        }
        _ => {}
    }
}

/// The number of a name in an expression.
pub(crate) fn number_of_key(whole: &Value, name: &str) -> Result<f64, String> {
    let key = resolve(name, "").map_err(|problem| problem.to_string())?;
    match value_at(whole, &key.path) {
        Some(Value::Float(number)) => Ok(*number),
        Some(Value::Integer(number)) => Ok(*number as f64),
        Some(other) => Err(format!(
            "{name} is {other}, and only numbers can be computed with"
        )),
        None => Err(format!("{name} is not a key of this scene")),
    }
}
