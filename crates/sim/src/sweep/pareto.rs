//! Set-ups that no other one beats: the Pareto front of columns of a table, with what is doubtful within the errors; which columns count,
//! under which conditions, and what is shown of them.
//!
//! a dominates b if it is nowhere worse and somewhere better. Equal points all stay; what is not finite is never on the front
//! and dominates nothing. Check: the stored fronts, and every pair of 1000 random points; columns and conditions that cannot be are refused.

use super::expression::holds;
use super::results::standard_error_of;
use crate::io::csv_input::TextTable;
use crate::io::{Provenance, Table};
use crate::keys::near;
use serde_json::{Map, Value, json};

/// Standard errors of the difference within which a point counts as nearly dominated.
pub const NEAR: f64 = 2.0;

/// A column that is to be small or large.
#[derive(Debug, Clone, PartialEq)]
pub struct Objective {
    /// What is to be small of each point.
    costs: Vec<f64>,
    /// Standard error of each.
    standard_errors: Vec<f64>,
}

impl Objective {
    /// A column of which small values are better. Standard errors are in the same unit: none where all values are exact, NaN where one
    /// is not known, as of one realisation.
    pub fn small(values: Vec<f64>, standard_errors: Vec<f64>) -> Self {
        Self {
            costs: values,
            standard_errors,
        }
    }

    /// A column of which large values are better, with standard errors as of a small one.
    pub fn large(values: Vec<f64>, standard_errors: Vec<f64>) -> Self {
        Self::small(
            values.into_iter().map(|value| -value).collect(),
            standard_errors,
        )
    }

    /// By how much point `a` is better than `b`.
    fn gain(&self, a: usize, b: usize) -> f64 {
        self.costs[b] - self.costs[a]
    }

    /// Standard error of the difference of two points; without end where one is not known.
    fn error(&self, a: usize, b: usize) -> f64 {
        let error = |i: usize| {
            self.standard_errors
                .get(i)
                .map_or(0.0, |e| if e.is_nan() { f64::INFINITY } else { *e })
        };
        error(a).hypot(error(b))
    }
}

/// What a front says of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Another point dominates it, or a value is not finite.
    Off,
    /// On the front.
    On,
    /// On the front, and with [`NEAR`] standard errors less luck another point would dominate it.
    Doubtful,
}

/// The place of each point.
#[must_use]
pub fn front(objectives: &[Objective]) -> Vec<Place> {
    let points = objectives.iter().map(|o| o.costs.len()).min().unwrap_or(0);
    let is_finite = |i: &usize| objectives.iter().all(|o| o.costs[*i].is_finite());
    let finite: Vec<usize> = (0..points).filter(is_finite).collect();
    let dominates = |a: usize, b: usize, lenience: f64| {
        let luck = |o: &Objective| {
            if lenience > 0.0 {
                lenience * o.error(a, b)
            } else {
                0.0
            }
        };
        let gains = || objectives.iter().map(|o| o.gain(a, b) + luck(o));
        a != b && gains().all(|gain| gain >= 0.0) && gains().any(|gain| gain > 0.0)
    };
    let mut places = vec![Place::Off; points];
    for &point in &finite {
        let beaten = |lenience: f64| {
            finite
                .iter()
                .any(|other| dominates(*other, point, lenience))
        };
        places[point] = match (beaten(0.0), beaten(NEAR)) {
            (true, _) => Place::Off,
            (false, true) => Place::Doubtful,
            (false, false) => Place::On,
        };
    }
    places
}

/// What is wanted of a table.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct Wanted {
    /// A column of which small values are better.
    #[cfg_attr(feature = "cli", arg(long, value_name = "COLUMN"))]
    pub min: Vec<String>,
    /// A column of which large values are better.
    #[cfg_attr(feature = "cli", arg(long, value_name = "COLUMN"))]
    pub max: Vec<String>,
    /// Only rows for which this holds, e.g. "resolution_m <= 35".
    #[cfg_attr(feature = "cli", arg(long = "where", value_name = "CONDITION"))]
    pub conditions: Vec<String>,
}

/// A table with its front.
#[derive(Debug)]
pub struct FrontTable {
    table: TextTable,
    objectives: Vec<String>,
    /// How many rows meet the conditions.
    of: usize,
    /// Rows of the front, and whether they are doubtful.
    front: Vec<(usize, bool)>,
}

impl FrontTable {
    /// Finds the front of the rows for which all conditions hold; standard errors come from the columns that have them.
    ///
    /// # Errors
    /// Columns that are not there, no objective, conditions that cannot be read.
    pub fn new(table: TextTable, wanted: &Wanted) -> Result<Self, String> {
        let known = || table.header.iter().map(String::as_str);
        let place = |name: &str| {
            table.column(name).ok_or_else(|| {
                let hint = near(name, known())
                    .map(|name| format!("; did you mean {name}?"))
                    .unwrap_or_default();
                format!(
                    "there is no column {name}{hint} Known: {}",
                    known().collect::<Vec<_>>().join(", ")
                )
            })
        };
        let mut kept: Vec<usize> = (0..table.rows.len()).collect();
        for text in &wanted.conditions {
            // Of a table without rows, too.
            holds(text, None)?;
            let of_row =
                |row: usize| holds(text, Some(&|name| Ok(table.number(row, place(name)?))));
            let held = (0..table.rows.len())
                .map(of_row)
                .collect::<Result<Vec<bool>, String>>()?;
            kept.retain(|row| held[*row]);
        }
        let column = |place: usize| {
            kept.iter()
                .map(|row| table.number(*row, place))
                .collect::<Vec<f64>>()
        };
        let objective =
            |name: &String, of: fn(Vec<f64>, Vec<f64>) -> Objective| -> Result<Objective, String> {
                let standard_errors = standard_error_of(name, known())
                    .map(place)
                    .transpose()?
                    .map_or(Vec::new(), column);
                Ok(of(column(place(name)?), standard_errors))
            };
        let small = wanted
            .min
            .iter()
            .map(|name| objective(name, Objective::small));
        let large = wanted
            .max
            .iter()
            .map(|name| objective(name, Objective::large));
        let objectives = small.chain(large).collect::<Result<Vec<_>, String>>()?;
        if objectives.is_empty() {
            return Err("no column is to be small or large: at least one --min COLUMN or --max COLUMN is needed".into());
        }
        let places = kept
            .iter()
            .zip(front(&objectives))
            .filter(|(_, place)| *place != Place::Off);
        let front = places
            .map(|(row, place)| (*row, place == Place::Doubtful))
            .collect();
        let (of, objectives) = (kept.len(), [&wanted.min[..], &wanted.max[..]].concat());
        Ok(Self {
            table,
            objectives,
            of,
            front,
        })
    }

    /// The front for people: what comes before the results of a sweep, and the objectives.
    pub fn text(&self) -> String {
        let results = self
            .table
            .column("scene_hash")
            .unwrap_or(1.min(self.table.header.len()));
        let mut shown: Vec<usize> = (0..results).collect();
        for place in self
            .objectives
            .iter()
            .filter_map(|name| self.table.column(name))
        {
            if !shown.contains(&place) {
                shown.push(place);
            }
        }
        let (shown, count, of) = (self.columns(shown).aligned(), self.front.len(), self.of);
        format!(
            "{shown}{count} of {of} rows are on the front; doubtful: within {NEAR} standard errors of being beaten\n"
        )
    }

    /// All columns of the front, and whether a row is doubtful.
    pub fn rows(&self) -> Table {
        self.columns(0..self.table.header.len())
    }

    /// Where the table comes from.
    pub fn origin(&self) -> Provenance {
        self.table.origin()
    }

    fn columns(&self, places: impl IntoIterator<Item = usize>) -> Table {
        let of_rows = places.into_iter().fold(Table::new(), |table, place| {
            table.text(
                &self.table.header[place],
                self.front
                    .iter()
                    .map(|(row, _)| self.table.rows[*row][place].clone()),
            )
        });
        of_rows.text(
            "front",
            self.front
                .iter()
                .map(|(_, doubtful)| if *doubtful { "doubtful" } else { "on" }),
        )
    }

    /// The front for programs.
    pub fn json(&self) -> Value {
        let row = |(row, doubtful): &(usize, bool)| {
            let cells = self
                .table
                .header
                .iter()
                .cloned()
                .zip(self.table.rows[*row].iter().map(|cell| json!(cell)));
            json!({ "row": row, "doubtful": doubtful, "cells": cells.collect::<Map<_, _>>() })
        };
        let front: Vec<Value> = self.front.iter().map(row).collect();
        json!({ "version": crate::VERSION, "objectives": self.objectives, "rows": self.of, "front": front })
    }
}
