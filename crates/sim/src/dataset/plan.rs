//! The plan of a data set: one TOML file with a scene and what varies from site to site and from flight to flight.
//!
//! Drawn are the keys of `[site]`, a row of the file of `[[flight_rows]]` and the keys of `[flight]`; then expressions in their
//! order. Each flight is drawn by itself, from the numbers of a sequence of its site.
//!
//! Check: no two flights are equal; an appended distribution moves no other; every refusal of a plan.

use super::draw;
use super::drawn::{DrawnKeys, Origin};
use super::keys::PlanKeys;
use crate::Error;
use crate::io::{hash_of, text_file};
use crate::keys::{
    Checker, Declared as _, Format, Key, Kind, Problem, Text, keys_of, near, to_table,
};
use crate::scene::SceneFile;
use crate::streams::stream;
use crate::sweep::{SceneKey, expression, number_of_key, set, text_of};
use rand_xoshiro::rand_core::Rng as _;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use toml::{Table, Value};

/// Tables of a plan whose keys are those of scenes.
const OF_SCENES: [&str; 3] = ["scene", "site", "flight"];

/// The plan of a data set.
#[derive(Debug, Clone, PartialEq)]
pub struct DatasetPlan {
    /// What it says of the data set.
    pub keys: PlanKeys,
    /// Its text.
    pub text: String,
    /// First 16 hexadecimal digits of the SHA-256 of the text and of the table of rows.
    pub hash: String,
    path: PathBuf,
    /// The scene before anything is drawn.
    base: Table,
    pub(super) drawn: DrawnKeys,
}

/// A flight of a data set.
#[derive(Debug, Clone, PartialEq)]
pub struct Flight {
    /// Its number, from 0.
    pub number: usize,
    /// The number of its site, from 0.
    pub site: usize,
    /// Whether no aircraft passes.
    pub is_empty: bool,
    /// Its scene.
    pub scene: SceneFile,
    /// Values of the keys that vary, in the order in which they were drawn.
    pub values: Vec<Value>,
}

impl DatasetPlan {
    /// Reads the plan of a file, with another seed if one is given.
    ///
    /// # Errors
    /// As [`Self::parse`]; a file that cannot be read.
    pub fn read(path: &Path, seed: Option<u64>) -> Result<Self, Error> {
        let text = text_file::read(path).map_err(Error::io("read", path))?;
        Self::parse(&text, path, seed)
    }

    /// Reads a plan; files that it names are looked for beside `path`. Another seed takes the place of that in the text.
    ///
    /// # Errors
    /// All keys that are not known, not allowed or have no effect, with their lines.
    pub fn parse(text: &str, path: &Path, seed: Option<u64>) -> Result<Self, Error> {
        let text = match seed {
            Some(seed) => with_seed(text, seed),
            None => text.to_owned(),
        };
        let document = Text::parse(&text, path)?;
        let (table, skipped) = document.vet_known(&plan_format())?;
        let keys: PlanKeys = document.read(table)?;
        let is_stated = |key: &str| document.line(key).is_some();
        let mut c = Checker::new(&is_stated);
        refuse_unknown(&skipped, &mut c);
        keys.check_limits("", &mut c);
        if c.is_good() {
            keys.check_between(&mut c);
        }
        let mut whole: Table = toml::from_str(&text).map_err(|error| malformed(path, &error))?;
        let base = part(&mut whole, "scene", &mut c);
        let site = part(&mut whole, "site", &mut c);
        let flight = part(&mut whole, "flight", &mut c);
        refuse_idle(&base, &mut c);
        let problems = c.into_problems();
        if !problems.is_empty() {
            return Err(document.located(problems));
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let drawn = DrawnKeys::new(&site, &flight, keys.flight_rows.first(), folder)
            .and_then(|drawn| drawn.with_flows_of(&base))
            .map_err(|problems| invalid(path, located_by_name(&text, problems)))?;
        let rows = drawn.rows_text.as_deref().unwrap_or_default();
        let mut plan = Self {
            hash: hash_of(&format!("{text}\n{rows}")),
            keys,
            path: path.to_owned(),
            base,
            drawn,
            text,
        };
        set(&mut plan.base, "scan.realisations", Value::Integer(1));
        Ok(plan)
    }

    /// The file that it was read from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A flight.
    ///
    /// # Errors
    /// [`Error::Flight`] if its scene is refused, with its values.
    pub fn flight(&self, number: usize) -> Result<Flight, Error> {
        self.flight_with(number, None)
    }

    /// A flight of which the key of an index has this value in place of that which is drawn.
    ///
    /// # Errors
    /// As [`Self::flight`].
    pub(super) fn flight_with(
        &self,
        number: usize,
        replaced: Option<(usize, &Value)>,
    ) -> Result<Flight, Error> {
        let site = number / self.keys.flights_per_site;
        let mut values = Vec::with_capacity(self.drawn.keys.len());
        let scene = self.scene(number, replaced, &mut values);
        let scene = scene.map_err(|error| Error::Flight {
            flight: number,
            site,
            keys: self.drawn.described(&values),
            others: 0,
            source: Box::new(self.relocated(error)),
        })?;
        Ok(Flight {
            number,
            site,
            is_empty: self.is_empty(number),
            scene,
            values,
        })
    }

    /// Whether no aircraft passes in a flight.
    fn is_empty(&self, number: usize) -> bool {
        let (point, seed) = self.sequence(number);
        draw::uniform(point, 0, seed) < self.keys.empty
    }

    /// Point and seed of the sequence of a flight.
    fn sequence(&self, number: usize) -> (usize, u32) {
        let site = number / self.keys.flights_per_site;
        let seed = stream(self.keys.seed, "site", site as u64).next_u32();
        (number % self.keys.flights_per_site, seed)
    }

    /// The scene of a flight, whose values are reported one after the other.
    fn scene(
        &self,
        number: usize,
        replaced: Option<(usize, &Value)>,
        values: &mut Vec<Value>,
    ) -> Result<SceneFile, Error> {
        let site = number / self.keys.flights_per_site;
        let (point, seed) = self.sequence(number);
        let of_sites = stream(self.keys.seed, "sites", 0).next_u32();
        let row = draw::chosen(&self.drawn.row_weights, draw::uniform(point, 1, seed));
        let mut table = self.base.clone();
        for (index, (key, origin)) in self.drawn.keys.iter().enumerate() {
            let value = match (origin, replaced) {
                (_, Some((at, value))) if at == index => value.clone(),
                (Origin::Site(distribution, dimension), _) => {
                    distribution.value(draw::uniform(site, *dimension, of_sites))
                }
                (Origin::Flight(distribution, dimension), _) => {
                    distribution.value(draw::uniform(point, *dimension, seed))
                }
                (Origin::Row(column), _) => self.drawn.rows[row][*column].clone(),
                (Origin::Expression(text), _) => self.computed(key, text, &table)?,
            };
            values.push(value.clone());
            set(&mut table, &key.path, value);
        }
        if self.is_empty(number) {
            let calm = [("kind".to_owned(), Value::from("calm"))];
            table.insert("flow".into(), Value::Table(Table::from_iter(calm)));
            table.remove("retrieval");
        }
        // TOML has signed whole numbers.
        let seed = stream(self.keys.seed, "flight", number as u64).next_u64() >> 1;
        table.insert("seed".into(), Value::Integer(seed as i64));
        SceneFile::parse(&text_of(&table), &self.path)
    }

    /// The value of a key by its expression in the scene as it is so far.
    fn computed(&self, key: &SceneKey, text: &str, table: &Table) -> Result<Value, Error> {
        let scene = SceneFile::without_limits(&text_of(table), &self.path)?;
        let whole = Value::Table(to_table(&scene));
        let refused = |allowed: String| {
            let problem = Problem::new(&key.name, format!("\"{text}\""), allowed);
            invalid(&self.path, located_by_name(&self.text, vec![problem]))
        };
        let number = expression::value(text, Some(&|name| number_of_key(&whole, name)));
        let value = key.of_number(number.map_err(refused)?);
        value.map_err(|problem| refused(format!("{} is {}", problem.allowed, problem.value)))
    }

    /// A refusal of keys of the scene, with their lines.
    pub(super) fn refused(&self, problems: Vec<Problem>) -> Error {
        self.relocated(invalid(&self.path, problems))
    }

    /// An error of a drawn scene with the lines of the plan: its own text is that of no file.
    fn relocated(&self, mut error: Error) -> Error {
        if let Error::Invalid { problems, .. } = &mut error
            && let Ok(document) = Text::parse(&self.text, &self.path)
        {
            for problem in problems {
                // Scenes write added_flows[0], plans added_flows.0.
                let path = problem.key.replace('[', ".").replace(']', "");
                let mut drawn = self.drawn.keys.iter();
                let drawn = drawn.find(|(key, _)| key.path == path);
                problem.line = match drawn {
                    Some((key, _)) => line_of_name(&self.text, &key.name),
                    None => document.line(&format!("scene.{}", problem.key)),
                };
            }
        }
        error
    }

    /// Draws all flights, and those of the first site with each key at the ends of its distribution.
    ///
    /// # Errors
    /// The first flight that is refused, and how many others are.
    pub fn check(&self) -> Result<(), Error> {
        let flights: Vec<usize> = (0..self.keys.flights()).collect();
        let refused: Vec<Error> = flights
            .par_iter()
            .filter_map(|flight| self.flight(*flight).err())
            .collect();
        let more = refused.len().saturating_sub(1);
        if let Some(mut error) = refused.into_iter().next() {
            if let Error::Flight { others, .. } = &mut error {
                *others = more;
            }
            return Err(error);
        }
        Ok(())
    }

    /// The first flight with a wake, or else the first one, with each key at the ends of its distribution.
    ///
    /// # Errors
    /// As [`Self::flight`].
    pub(super) fn extreme_flights(&self) -> Result<Vec<Flight>, Error> {
        let of_site = 0..self.keys.flights_per_site;
        let number = of_site.into_iter().find(|flight| !self.is_empty(*flight));
        let number = number.unwrap_or(0);
        let mut flights = vec![self.flight(number)?];
        for (index, (_, origin)) in self.drawn.keys.iter().enumerate() {
            if let Origin::Site(distribution, _) | Origin::Flight(distribution, _) = origin {
                for end in distribution.ends() {
                    flights.push(self.flight_with(number, Some((index, &end)))?);
                }
            }
        }
        Ok(flights)
    }

    /// The number that an array stores for a value of a key: the value itself, or of a name its index.
    pub(super) fn stored_value(&self, index: usize, value: &Value) -> f64 {
        match value {
            Value::Float(number) => *number,
            Value::Integer(number) => *number as f64,
            other => self
                .drawn
                .index_of(index, other)
                .map_or(f64::NAN, |index| index as f64),
        }
    }
}

/// What a plan may say.
fn plan_format() -> Format<'static> {
    static MAY_SAY: LazyLock<(Vec<Key>, Table)> =
        LazyLock::new(|| (keys_of::<PlanKeys>(), to_table(&PlanKeys::default())));
    Format {
        keys: &MAY_SAY.0,
        defaults: &MAY_SAY.1,
        examples: &[super::presets::TINY],
    }
}

/// The text of a plan with another seed.
fn with_seed(text: &str, seed: u64) -> String {
    let mut in_table = false;
    let mut is_replaced = false;
    let mut out = String::new();
    for line in text.lines() {
        in_table |= line.trim_start().starts_with('[');
        let key = line.split_once('=').map(|(key, _)| key.trim());
        if key == Some("seed") && !in_table {
            out += &format!("seed = {seed}\n");
            is_replaced = true;
        } else {
            out += line;
            out.push('\n');
        }
    }
    if is_replaced {
        out
    } else {
        format!("seed = {seed}\n{out}")
    }
}

/// Refuses keys that are neither of plans nor tables with keys of scenes.
fn refuse_unknown(skipped: &[String], c: &mut Checker<'_>) {
    for path in skipped {
        if OF_SCENES.contains(&path.as_str()) {
            continue;
        }
        let (table, name) = path.rsplit_once('.').unwrap_or(("", path.as_str()));
        let known = known_names(table);
        let meant = near(name, known.iter().copied());
        let hint = meant.map(|name| format!(", did you mean {name}?"));
        let hint = hint.unwrap_or_default();
        let allowed = format!(
            "there is no such key{hint}; known here: {}",
            known.join(", ")
        );
        c.refuse(path, "", allowed);
    }
}

/// Names of the keys of a table of a plan; of the plan itself where its path is empty.
fn known_names(table: &str) -> Vec<&'static str> {
    let keys = plan_format().keys;
    let name = table.split('[').next().unwrap_or_default();
    let own = keys.iter().find(|key| key.name == name);
    let inner = own.and_then(|key| match &key.kind {
        Kind::Table(inner) => Some(inner),
        Kind::List { of, .. } => match &**of {
            Kind::Table(inner) => Some(inner),
            _ => None,
        },
        _ => None,
    });
    match inner {
        Some(inner) => inner.iter().map(|key| key.name).collect(),
        None => keys.iter().map(|key| key.name).chain(OF_SCENES).collect(),
    }
}

/// Refuses keys of the scene that a data set does not use.
fn refuse_idle(base: &Table, c: &mut Checker<'_>) {
    if base.contains_key("seed") {
        c.refuse(
            "scene.seed",
            "",
            "absent: each flight has a seed of its own, from the seed of the plan",
        );
    }
    if base.contains_key("outputs") {
        c.refuse(
            "scene.outputs",
            "",
            "absent: the arrays of the data set are its outputs",
        );
    }
    let scan = base.get("scan").and_then(Value::as_table);
    let realisations = scan.and_then(|scan| scan.get("realisations"));
    if let Some(realisations) = realisations.filter(|stated| stated.as_integer() != Some(1)) {
        let allowed = "1: flights are the realisations";
        c.refuse(
            "scene.scan.realisations",
            &realisations.to_string(),
            allowed,
        );
    }
}

/// Takes a table of a plan out of it.
fn part(whole: &mut Table, name: &str, c: &mut Checker<'_>) -> Table {
    match whole.remove(name) {
        None => Table::new(),
        Some(Value::Table(table)) => table,
        Some(other) => {
            c.refuse(name, &other.to_string(), "a table with keys of scenes");
            Table::new()
        }
    }
}

fn invalid(path: &Path, problems: Vec<Problem>) -> Error {
    Error::Invalid {
        path: path.to_owned(),
        problems,
    }
}

fn malformed(path: &Path, error: &toml::de::Error) -> Error {
    Error::Malformed {
        path: path.to_owned(),
        line: 1,
        message: error.message().into(),
    }
}

/// Problems of keys in quotation marks with their lines.
fn located_by_name(text: &str, mut problems: Vec<Problem>) -> Vec<Problem> {
    for problem in &mut problems {
        problem.line = line_of_name(text, &problem.key);
    }
    problems
}

/// The line in `[site]` or `[flight]` of a key in quotation marks, from 1. Other tables may have keys of the same name.
fn line_of_name(text: &str, name: &str) -> Option<usize> {
    let quoted = [
        format!("\"{name}\""),
        format!("'{name}'"),
        format!("{name} "),
        format!("{name}="),
    ];
    let mut is_drawn = false;
    for (index, line) in text.lines().enumerate() {
        let line = line.trim_start();
        if let Some(header) = line.strip_prefix('[') {
            let table = header.split(']').next().unwrap_or_default().trim();
            is_drawn = ["site", "flight"].contains(&table);
        }
        let begins = |quoted: &String| line.starts_with(quoted.as_str());
        if is_drawn && quoted.iter().any(begins) {
            return Some(index + 1);
        }
    }
    None
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
