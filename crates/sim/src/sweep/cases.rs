//! The cases of a sweep: a grid or a list of values, further keys by expression, conditions; each a whole checked scene.
//!
//! The rows of a list are slowest, then the keys in the order in which they were given; the last is fastest. Check: the
//! stored cases, to the last bit.

use super::expression::{Condition, Expression};
use super::key_path::{SceneKey, resolve};
use crate::Error;
use crate::io::csv_input::TextTable;
use crate::io::{Provenance, csv::float_text, text_file};
use crate::keys::{Located, Problem, SceneError};
use crate::scene::{Scene, SceneFile, hash_of};
use crate::setup::streams::stream;
use rand_xoshiro::rand_core::Rng;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Most cases of a sweep, before and after conditions.
pub const MOST_CASES: usize = 10_000;

/// What is to be swept, as the command line has it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Request {
    /// `KEY=a,b,c`, `KEY=lin:a:b:n` or `KEY=log:a:b:n`, the last one fastest.
    pub vary: Vec<String>,
    /// A table with a column for each key and a row for each case.
    pub list: Option<PathBuf>,
    /// `KEY = expression` of keys, in this order after all others.
    pub lets: Vec<String>,
    /// Comparisons of expressions; a case for which one does not hold is left out.
    pub conditions: Vec<String>,
    /// Whether each case has a seed of its own, drawn from the scene's.
    pub independent: bool,
    /// Seed in place of the scene's.
    pub seed: Option<u64>,
}

/// A key that varies, as a column of the results.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Column {
    /// As the user wrote it.
    pub(super) name: String,
    pub(super) key: SceneKey,
    /// Whether others determine it.
    pub(super) tied: bool,
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
    pub(super) columns: Vec<Column>,
    /// The cases in their order.
    pub cases: Vec<Case>,
    /// Scene, words and hash of the sweep.
    pub origin: Provenance,
}

impl Sweep {
    /// The cases of a request on a scene file.
    ///
    /// # Errors
    /// Keys, values and expressions that cannot be; more than [`MOST_CASES`]; no case; the first case whose scene is refused.
    pub fn new(path: &Path, request: &Request) -> Result<Self, Error> {
        let text = text_file::read(path).map_err(|source| SceneError::Unreadable { path: path.to_owned(), source })?;
        Self::parse(&text, path, request)
    }

    /// The same for the text of a scene; `path` is where its files are looked for.
    ///
    /// # Errors
    /// As [`Sweep::new`].
    pub fn parse(text: &str, path: &Path, request: &Request) -> Result<Self, Error> {
        let base = match toml::from_str::<Table>(text) {
            Ok(base) => base,
            // The reader of scenes says it better.
            Err(e) => {
                let plain = SceneError::Malformed { path: path.to_owned(), line: 1, message: e.message().into() };
                return Err(SceneFile::parse(text, path).err().unwrap_or(plain).into());
            }
        };
        let grid = Grid::new(request)?;
        let builder = Builder { path, base, grid, request };
        match builder.cases() {
            // What is wrong without the sweep is told with its line.
            Err(error) => Err(SceneFile::parse(text, path).err().map_or(error, Error::from)),
            Ok(cases) => {
                let columns = builder.columns();
                let origin = builder.origin(&columns, &cases);
                Ok(Self { columns, cases, origin })
            }
        }
    }

    /// Names of the keys that vary, as they were written.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|column| column.name.as_str())
    }

    /// The keys of a case with their values, for messages.
    pub(super) fn described(&self, case: &Case) -> String {
        described(&self.columns, &case.values)
    }
}

fn described(columns: &[Column], values: &[String]) -> String {
    let pairs = columns.iter().zip(values).map(|(column, value)| format!("{} = {value}", column.name));
    pairs.collect::<Vec<_>>().join(", ")
}

/// A refusal of a word of the command line.
fn refused(word: &str, problem: Problem) -> Error {
    SceneError::Invalid { path: word.into(), problems: vec![Located { problem, line: None }] }.into()
}

fn problem(key: &str, value: &str, allowed: impl Into<String>) -> Problem {
    Problem { key: key.into(), value: value.into(), allowed: allowed.into() }
}

/// Keys, and the values of each combination of them.
struct Grid {
    list: (Vec<Column>, Vec<Vec<Value>>),
    axes: Vec<(Column, Vec<Value>)>,
    lets: Vec<(Column, Expression)>,
    conditions: Vec<Condition>,
}

impl Grid {
    fn new(request: &Request) -> Result<Self, Error> {
        let axes = request.vary.iter().map(|word| axis(word).map_err(|p| refused("--vary", p)));
        let grid = Self {
            list: request.list.as_deref().map_or(Ok((Vec::new(), vec![Vec::new()])), list)?,
            axes: axes.collect::<Result<_, _>>()?,
            lets: request
                .lets
                .iter()
                .map(|word| binding(word).map_err(|p| refused("--let", p)))
                .collect::<Result<_, _>>()?,
            conditions: request
                .conditions
                .iter()
                .map(|word| Condition::parse(word).map_err(|why| refused("--where", problem("condition", word, why))))
                .collect::<Result<_, _>>()?,
        };
        let columns: Vec<&Column> = grid.columns().collect();
        for (i, column) in columns.iter().enumerate() {
            if columns[..i].iter().any(|other| other.key.path == column.key.path) {
                let why = "each key varies once, by --vary, --cases or --let";
                return Err(refused("sweep", problem(&column.name, "", why)));
            }
        }
        let seeded = columns.iter().any(|column| column.key.path == "seed");
        if request.independent && seeded {
            let why = "with --independent each case has a seed of its own: leave one of the two out";
            return Err(refused("sweep", problem("seed", "", why)));
        }
        let count = grid.axes.iter().map(|(_, values)| values.len() as f64).product::<f64>() * grid.list.1.len() as f64;
        if count > MOST_CASES as f64 {
            let why = format!("a sweep has 1 to {MOST_CASES} cases: fewer values, or several sweeps");
            return Err(refused("sweep", problem("number of cases", &format!("{count:?}"), why)));
        }
        Ok(grid)
    }

    fn columns(&self) -> impl Iterator<Item = &Column> {
        let list = self.list.0.iter();
        list.chain(self.axes.iter().map(|(column, _)| column)).chain(self.lets.iter().map(|(column, _)| column))
    }

    fn len(&self) -> usize {
        self.list.1.len() * self.axes.iter().map(|(_, values)| values.len()).product::<usize>()
    }

    /// The values of combination `index`, the last axis fastest.
    fn values(&self, index: usize) -> Vec<&Value> {
        let mut rest = index;
        let mut of_axes: Vec<&Value> = Vec::with_capacity(self.axes.len());
        for (_, values) in self.axes.iter().rev() {
            of_axes.extend(values.get(rest % values.len()));
            rest /= values.len();
        }
        let row = self.list.1.get(rest).map(Vec::as_slice).unwrap_or_default();
        row.iter().chain(of_axes.into_iter().rev()).collect()
    }
}

/// `KEY=VALUES`.
fn axis(word: &str) -> Result<(Column, Vec<Value>), Problem> {
    let example = "KEY=VALUES, e.g. pulse.energy_j=50e-6,150e-6 or pulse.energy_j=log:50e-6:600e-6:7";
    let (name, text) = word.split_once('=').ok_or_else(|| problem("--vary", word, example))?;
    let (name, text) = (name.trim(), text.trim());
    let key = resolve(name, text)?;
    if text.is_empty() {
        return Err(problem(name, "an empty list", format!("at least one value is needed: {example}")));
    }
    let range = text.split_once(':').filter(|(kind, _)| key.is_numeric() && matches!(*kind, "lin" | "log"));
    let values: Vec<Value> = match range {
        Some((kind, rest)) => {
            let numbers = range_of(kind == "log", rest).map_err(|why| problem(name, text, why))?;
            numbers.into_iter().map(|number| key.of_number(number)).collect::<Result<_, _>>()?
        }
        None => text.split(',').map(|value| key.read(value)).collect::<Result<_, _>>()?,
    };
    Ok((Column { name: name.into(), key, tied: false }, values))
}

/// `a:b:n`: from a to b, both as written.
fn range_of(is_log: bool, text: &str) -> Result<Vec<f64>, String> {
    let wrong = || {
        format!(
            "lin:FIRST:LAST:COUNT or log:FIRST:LAST:COUNT with finite numbers (log: above 0) and a count from 2 to \
             {MOST_CASES}, e.g. log:100e-9:800e-9:7"
        )
    };
    let [first, last, count] = text.split(':').collect::<Vec<_>>()[..] else { return Err(wrong()) };
    let (Ok(first), Ok(last), Ok(count)) = (first.parse::<f64>(), last.parse::<f64>(), count.parse::<f64>()) else {
        return Err(wrong());
    };
    let fine = first.is_finite() && last.is_finite() && (!is_log || (first > 0.0 && last > 0.0));
    if !fine || count.fract() != 0.0 || !(2.0..=MOST_CASES as f64).contains(&count) {
        return Err(wrong());
    }
    let steps = count - 1.0;
    let at = |i: usize| {
        let part = i as f64 / steps;
        match i {
            0 => first,
            _ if i as f64 == steps => last,
            _ if is_log => first * (last / first).powf(part),
            _ => first + (last - first) * part,
        }
    };
    Ok((0..count as usize).map(at).collect())
}

/// `KEY = EXPRESSION`.
fn binding(word: &str) -> Result<(Column, Expression), Problem> {
    let example = "KEY = EXPRESSION, e.g. pulse.energy_j = 0.06/laser.pulse_repetition_hz";
    let (name, text) = word.split_once('=').ok_or_else(|| problem("--let", word, example))?;
    let key = resolve(name.trim(), text.trim())?;
    if !key.is_numeric() {
        return Err(problem(name.trim(), text.trim(), "an expression is a number, and this key takes none"));
    }
    let expression = Expression::parse(text).map_err(|why| problem(name.trim(), text.trim(), why))?;
    Ok((Column { name: name.trim().into(), key, tied: true }, expression))
}

/// The keys and rows of a list file.
fn list(path: &Path) -> Result<(Vec<Column>, Vec<Vec<Value>>), Error> {
    let of_file = |problem: Problem| refused(&path.display().to_string(), problem);
    let table = TextTable::read(path)?;
    let column = |name: &String| {
        Ok(Column { name: name.trim().into(), key: resolve(name.trim(), "").map_err(of_file)?, tied: false })
    };
    let columns: Vec<Column> = table.header.iter().map(column).collect::<Result<_, Error>>()?;
    if table.rows.is_empty() {
        return Err(of_file(problem("rows", "0", "at least one row below the names of the keys")));
    }
    let row = |cells: &Vec<String>| {
        let values = columns.iter().zip(cells).map(|(column, cell)| column.key.read(cell));
        values.collect::<Result<Vec<Value>, Problem>>().map_err(of_file)
    };
    let rows = table.rows.iter().map(row).collect::<Result<_, _>>()?;
    Ok((columns, rows))
}

/// A value as the results show it.
fn shown(value: &Value) -> String {
    match value {
        Value::Float(number) => float_text(*number),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

struct Builder<'a> {
    path: &'a Path,
    base: Table,
    grid: Grid,
    request: &'a Request,
}

impl Builder<'_> {
    fn cases(&self) -> Result<Vec<Case>, Error> {
        let mut cases = Vec::new();
        let (mut first, mut refusals) = (None, 0);
        for combination in 0..self.grid.len() {
            match self.case(combination, cases.len()) {
                Ok(case) => cases.extend(case),
                Err(error) => {
                    first = first.or(Some(error));
                    refusals += 1;
                }
            }
        }
        match first {
            Some(Error::Case { case, keys, source, .. }) => {
                Err(Error::Case { case, keys, source, others: refusals - 1 })
            }
            Some(error) => Err(error),
            None if cases.is_empty() => {
                let all: Vec<String> = self.grid.conditions.iter().map(ToString::to_string).collect();
                let why = format!("none of the {} cases is left", self.grid.len());
                Err(refused("--where", problem("condition", &all.join(" and "), why)))
            }
            None => Ok(cases),
        }
    }

    /// The columns of the results: all keys that vary, and the seed if each case has its own.
    fn columns(&self) -> Vec<Column> {
        let seed = self.request.independent.then(|| resolve("seed", "").ok()).flatten();
        let seed = seed.map(|key| Column { name: "seed".into(), key, tied: true });
        self.grid.columns().cloned().chain(seed).collect()
    }

    /// The case of a combination; none where a condition does not hold.
    fn case(&self, combination: usize, index: usize) -> Result<Option<Case>, Error> {
        let mut table = self.base.clone();
        let given: Vec<&Column> = self.grid.columns().collect();
        let mut values = Vec::with_capacity(given.len());
        let failed = |values: &[String], source: Error| {
            let columns: Vec<Column> = given.iter().map(|column| (*column).clone()).collect();
            let source = Box::new(without_lines(source));
            Error::Case { case: combination, keys: described(&columns, values), others: 0, source }
        };
        if let Some(seed) = self.request.seed {
            table.insert("seed".into(), Value::Integer(i64::try_from(seed).unwrap_or(i64::MAX)));
        }
        for (column, value) in given.iter().zip(self.grid.values(combination)) {
            set(&mut table, &column.key.path, value.clone());
            values.push(shown(value));
        }
        for ((column, expression), word) in self.grid.lets.iter().zip(&self.request.lets) {
            let of_let = |why: String| {
                let text = word.split_once('=').map_or("", |(_, text)| text.trim());
                refused("--let", problem(&column.name, text, why))
            };
            let whole = self.whole(&table).map_err(|e| failed(&values, e))?;
            let number = expression.value(&|name| value_of(&whole, name)).map_err(|e| failed(&values, of_let(e)))?;
            let value = column.key.of_number(number).map_err(|p| failed(&values, of_let(p.allowed)))?;
            values.push(shown(&value));
            set(&mut table, &column.key.path, value);
        }
        if !self.grid.conditions.is_empty() {
            let whole = self.whole(&table).map_err(|e| failed(&values, e))?;
            for condition in &self.grid.conditions {
                let of_condition = |why| refused("--where", problem("condition", &condition.to_string(), why));
                let holds = condition.holds(&|name| value_of(&whole, name));
                if !holds.map_err(|why| failed(&values, of_condition(why)))? {
                    return Ok(None);
                }
            }
        }
        if self.request.independent {
            let seed = table.get("seed").and_then(Value::as_integer).and_then(|seed| u64::try_from(seed).ok());
            // TOML has signed whole numbers.
            let own = stream(seed.unwrap_or(Scene::default().seed), "sweep", index as u64).next_u64() >> 1;
            table.insert("seed".into(), Value::Integer(own as i64));
            values.push(own.to_string());
        }
        let scene = SceneFile::parse(&text_of(&table), self.path).map_err(|e| failed(&values, e.into()))?;
        Ok(Some(Case { index, scene, values }))
    }

    /// The table of a case with all defaults.
    fn whole(&self, table: &Table) -> Result<Table, Error> {
        Ok(SceneFile::whole_table(&text_of(table), self.path)?)
    }

    fn origin(&self, columns: &[Column], cases: &[Case]) -> Provenance {
        let Request { vary, list, lets, conditions, independent, .. } = self.request;
        let mut words: Vec<String> = vary.iter().map(|word| format!("--vary {word}")).collect();
        words.extend(list.as_ref().map(|_| "--cases FILE".to_owned()));
        words.extend(lets.iter().map(|word| format!("--let \"{word}\"")));
        words.extend(conditions.iter().map(|word| format!("--where \"{word}\"")));
        words.extend(independent.then(|| "--independent".to_owned()));
        let names = columns.iter().map(|column| column.name.as_str());
        let identity: Vec<&str> = names.chain(cases.iter().map(|case| case.scene.hash.as_str())).collect();
        let seed = self.base.get("seed").and_then(Value::as_integer).and_then(|seed| u64::try_from(seed).ok());
        let scene_toml = format!("# sweep {}\n{}", words.join(" "), text_of(&self.base));
        let seed = self.request.seed.or(seed).unwrap_or(Scene::default().seed);
        Provenance::new(&scene_toml, &hash_of(&identity.join("\n")), seed)
    }
}

fn text_of(table: &Table) -> String {
    toml::to_string(table).unwrap_or_else(|e| unreachable!("a table that was read can be written: {e}"))
}

/// Sets a key, with the tables above it where they are missing.
fn set(table: &mut Table, path: &str, value: Value) {
    let (head, rest) = path.split_once('.').map_or((path, None), |(head, rest)| (head, Some(rest)));
    match rest {
        None => drop(table.insert(head.into(), value)),
        Some(rest) => {
            // What is no table there is refused when the scene is read.
            if let Value::Table(inner) = table.entry(head).or_insert_with(|| Value::Table(Table::new())) {
                set(inner, rest, value);
            }
        }
    }
}

/// The number that a name in an expression stands for.
fn value_of(whole: &Table, name: &str) -> Result<f64, String> {
    let key = resolve(name, "").map_err(|problem| problem.to_string())?;
    let mut names = key.path.split('.');
    let first = names.next().and_then(|name| whole.get(name));
    let value = names.fold(first, |value, name| value?.get(name));
    match value {
        Some(Value::Float(number)) => Ok(*number),
        Some(Value::Integer(number)) => Ok(*number as f64),
        Some(other) => Err(format!("{name} is {other}, and only numbers can be computed with")),
        None => Err(format!("{name} is no key of this scene")),
    }
}

/// The lines of a case's text are no lines of a file.
pub(super) fn without_lines(error: Error) -> Error {
    match error {
        Error::Scene(SceneError::Invalid { path, mut problems }) => {
            problems.iter_mut().for_each(|located| located.line = None);
            Error::Scene(SceneError::Invalid { path, problems })
        }
        other => other,
    }
}
