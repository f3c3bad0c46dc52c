//! The keys of a scene that a plan varies: by distributions of sites and flights, rows of a table, expressions.
//!
//! Check: what cannot vary is refused with its reason in the tests of `plan`.

use super::draw::{DIMENSIONS, Distribution, are_weights};
use super::keys::FlightRows;
use crate::io::csv_input::TextTable;
use crate::io::text_file;
use crate::keys::Problem;
use crate::sweep::{SceneKey, expression, resolve};
use std::cell::RefCell;
use std::path::Path;
use toml::{Table, Value};

/// Dimensions of the sequence of a site before those of its keys: whether a flight is empty, and its row.
const BEFORE_KEYS: usize = 2;

/// Keys that set the shape of the arrays, which all flights share, or the coordinates along their axes.
const OF_SHAPE: [&str; 18] = [
    "detector.bandwidth_hz",
    "detector.intermediate_frequency_hz",
    "detector.sampling_hz",
    "detector.signal",
    "estimator.gate_step_samples",
    "estimator.padded_samples",
    "estimator.window_samples",
    "laser.pulse_repetition_hz",
    "laser.wavelength_m",
    "scan.azimuth_rad",
    "scan.elevation_max_rad",
    "scan.elevation_min_rad",
    "scan.elevation_step_rad",
    "scan.pulses_per_line",
    "scan.range_max_m",
    "scan.range_min_m",
    "scan.realisations",
    "seed",
];

/// Where the values of a key come from.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Origin {
    /// Drawn once a site, from a dimension of the sequence of sites.
    Site(Distribution, usize),
    /// A column of the row of a flight.
    Row(usize),
    /// Drawn once a flight, from a dimension of the sequence of its site.
    Flight(Distribution, usize),
    /// An expression of other keys.
    Expression(String),
}

/// All keys that vary, in the order in which they are drawn.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct DrawnKeys {
    pub(super) keys: Vec<(SceneKey, Origin)>,
    /// Rows of a table, and their weights.
    pub(super) rows: Vec<Vec<Value>>,
    pub(super) row_weights: Vec<f64>,
    /// Text of the table of rows.
    pub(super) rows_text: Option<String>,
}

impl DrawnKeys {
    /// Reads the tables `[site]` and `[flight]` and the file of rows.
    ///
    /// # Errors
    /// All keys that cannot vary, and what is wrong with their values.
    pub(super) fn new(
        site: &Table,
        flight: &Table,
        rows: Option<&FlightRows>,
        folder: &Path,
    ) -> Result<Self, Vec<Problem>> {
        let mut all = Self::default();
        let mut expressions = Vec::new();
        let mut problems = Vec::new();
        let mut dimension = 0;
        for (name, value) in site {
            match origin(name, value, &mut dimension, Origin::Site) {
                Ok(drawn) => all.place(drawn, &mut expressions),
                Err(problem) => problems.push(problem),
            }
        }
        if let Some(rows) = rows {
            let read = all.read_rows(rows, folder);
            problems.extend(read.err());
        }
        dimension = BEFORE_KEYS;
        for (name, value) in flight {
            match origin(name, value, &mut dimension, Origin::Flight) {
                Ok(drawn) => all.place(drawn, &mut expressions),
                Err(problem) => problems.push(problem),
            }
        }
        if dimension > DIMENSIONS {
            let most = DIMENSIONS - BEFORE_KEYS;
            let allowed = format!(
                "a plan with at most {most} distributions; rows of a table need one for all of their keys"
            );
            problems.push(Problem::new(
                "flight",
                (dimension - BEFORE_KEYS).to_string(),
                allowed,
            ));
        }
        all.keys.append(&mut expressions);
        all.refuse_repeated(&mut problems);
        all.refuse_late(&mut problems);
        if problems.is_empty() {
            Ok(all)
        } else {
            Err(problems)
        }
    }

    fn place(&mut self, drawn: (SceneKey, Origin), expressions: &mut Vec<(SceneKey, Origin)>) {
        match drawn {
            (_, Origin::Expression(_)) => expressions.push(drawn),
            _ => self.keys.push(drawn),
        }
    }

    /// Reads the rows of a table of keys.
    fn read_rows(&mut self, rows: &FlightRows, folder: &Path) -> Result<(), Problem> {
        let refused =
            |allowed: String| Problem::new("flight_rows.file", format!("{:?}", rows.file), allowed);
        if Path::new(&rows.file).file_name() != Some(rows.file.as_ref()) {
            return Err(refused(
                "a plain file name: the table is beside the plan, and is copied to the data set"
                    .into(),
            ));
        }
        let path = folder.join(&rows.file);
        let text = text_file::read(&path)
            .map_err(|error| refused(format!("a CSV file that can be read: {error}")))?;
        let table = TextTable::parse(&text).map_err(&refused)?;
        if table.rows.is_empty() {
            return Err(refused(
                "at least one row below the names of the keys".into(),
            ));
        }
        if let Some(weight) = rows
            .weight
            .as_ref()
            .filter(|weight| !table.header.contains(weight))
        {
            let allowed = format!("a column of {}: {}", rows.file, table.header.join(", "));
            return Err(Problem::new(
                "flight_rows.weight",
                format!("{weight:?}"),
                allowed,
            ));
        }
        self.row_weights = vec![1.0; table.rows.len()];
        self.rows = vec![Vec::new(); table.rows.len()];
        for (column, name) in table.header.iter().enumerate() {
            let cells = table.rows.iter().map(|row| row[column].trim());
            if rows.weight.as_ref() == Some(name) {
                let weights: Option<Vec<f64>> = cells.map(|cell| cell.parse().ok()).collect();
                let weights = weights.filter(|weights| are_weights(weights));
                self.row_weights = weights.ok_or_else(|| {
                    refused(format!(
                        "weights in column {name}, none below 0 and not all 0"
                    ))
                })?;
                continue;
            }
            let key = varying(name, "")?;
            for (number, (row, cell)) in self.rows.iter_mut().zip(cells).enumerate() {
                let of_file = |problem| in_row(problem, number + 1, &rows.file);
                row.push(key.read(cell).map_err(of_file)?);
            }
            let origin = Origin::Row(self.rows[0].len() - 1);
            self.keys.push((key, origin));
        }
        self.rows_text = Some(text);
        Ok(())
    }

    /// Refuses keys of added flows that the scene does not have.
    ///
    /// # Errors
    /// All such keys, with the numbers that are there.
    pub(super) fn with_flows_of(self, scene: &Table) -> Result<Self, Vec<Problem>> {
        let flows = scene.get("added_flows").and_then(Value::as_array);
        let count = flows.map_or(0, Vec::len);
        let mut problems = Vec::new();
        for (key, _) in &self.keys {
            let Some(rest) = key.path.strip_prefix("added_flows.") else {
                continue;
            };
            let number = rest.split('.').next().unwrap_or_default();
            if number.parse().is_ok_and(|number: usize| number < count) {
                continue;
            }
            let allowed = match count {
                0 => "a plan with [[scene.added_flows]]: this one has none".to_owned(),
                1 => "number 0 of added_flows: [[scene.added_flows]] has one".to_owned(),
                _ => format!(
                    "a number of added_flows from 0 to {}: [[scene.added_flows]] has {count}",
                    count - 1
                ),
            };
            problems.push(Problem::new(&key.name, "", allowed));
        }
        match problems.is_empty() {
            true => Ok(self),
            false => Err(problems),
        }
    }

    fn refuse_repeated(&self, problems: &mut Vec<Problem>) {
        for (index, (key, _)) in self.keys.iter().enumerate() {
            let mut before = self.keys[..index].iter();
            if before.any(|(other, _)| other.path == key.path) {
                let allowed =
                    "each key varies once, in [site], in [flight] or in the table of rows";
                problems.push(Problem::new(&key.name, "", allowed));
            }
        }
    }

    /// Refuses expressions that cannot be computed, and those with a key that is set after them.
    fn refuse_late(&self, problems: &mut Vec<Problem>) {
        for (index, (key, origin)) in self.keys.iter().enumerate() {
            let Origin::Expression(text) = origin else {
                continue;
            };
            let found = RefCell::new(Vec::new());
            let read = expression::value(
                text,
                Some(&|name| {
                    let key = resolve(name, "").map_err(|problem| problem.to_string())?;
                    found.borrow_mut().push(key.path);
                    Ok(f64::NAN)
                }),
            );
            let value = format!("\"{text}\"");
            if let Err(why) = read {
                problems.push(Problem::new(&key.name, &value, why));
            }
            let late = self.keys[index..]
                .iter()
                .find(|(later, _)| found.borrow().contains(&later.path));
            if let Some((late, _)) = late {
                let allowed = format!("keys that are set before: {} is not", late.name);
                problems.push(Problem::new(&key.name, &value, allowed));
            }
        }
    }

    /// Keys and values, for messages; of a flight that could not be drawn, those that were.
    pub(super) fn described(&self, values: &[Value]) -> String {
        let pairs = self.keys.iter().zip(values);
        let texts: Vec<String> = pairs
            .map(|((key, _), value)| format!("{} = {value}", key.name))
            .collect();
        texts.join(", ")
    }

    /// The number of a name among those that a key takes.
    pub(super) fn index_of(&self, index: usize, value: &Value) -> Option<usize> {
        let (_, origin) = self.keys.get(index)?;
        match origin {
            Origin::Site(distribution, _) | Origin::Flight(distribution, _) => {
                distribution.index_of(value)
            }
            Origin::Row(column) => self.rows.iter().position(|row| row[*column] == *value),
            Origin::Expression(_) => None,
        }
    }
}

/// A problem of a cell with its row, from 1, and its file.
fn in_row(problem: Problem, row: usize, file: &str) -> Problem {
    Problem {
        allowed: format!("{}; it is in row {row} of {file}", problem.allowed),
        ..problem
    }
}

/// A key with the origin of its values; a distribution takes the next dimension.
fn origin(
    name: &str,
    value: &Value,
    dimension: &mut usize,
    of: fn(Distribution, usize) -> Origin,
) -> Result<(SceneKey, Origin), Problem> {
    let key = varying(name, &value.to_string())?;
    let origin = match value {
        Value::String(text) => Origin::Expression(text.clone()),
        value => {
            *dimension += 1;
            of(Distribution::read(name, &key, value)?, *dimension - 1)
        }
    };
    Ok((key, origin))
}

/// A key of the scene that may vary, by its name as the plan writes it.
fn varying(name: &str, value: &str) -> Result<SceneKey, Problem> {
    let key = resolve(name.trim(), value)?;
    let is_of_shape = OF_SHAPE.contains(&key.path.as_str())
        || key.path.starts_with("scan.pattern.")
        || key.path.starts_with("scan.head.");
    if is_of_shape {
        let allowed = "a key that does not set lines, gates, times, velocities of the arrays or the seed: all flights share these, in [scene]";
        return Err(Problem::new(name, "", allowed));
    }
    Ok(SceneKey {
        name: name.into(),
        ..key
    })
}
