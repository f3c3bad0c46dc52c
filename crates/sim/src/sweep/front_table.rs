//! The front of a table's rows: which columns count, under which conditions, and what is shown of it.
//!
//! Check: tables by hand; columns and conditions that cannot be are refused.

use super::expression::holds;
use super::pareto::{NEAR, Objective, Place, front};
use super::results::standard_error_of;
use crate::io::csv_input::TextTable;
use crate::io::{Provenance, Table};
use crate::keys::near;
use serde_json::{Map, Value, json};

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
                let hint = near(name, known()).map(|name| format!("; did you mean {name}?")).unwrap_or_default();
                format!("there is no column {name}{hint} Known: {}", known().collect::<Vec<_>>().join(", "))
            })
        };
        let mut kept: Vec<usize> = (0..table.rows.len()).collect();
        for text in &wanted.conditions {
            // Of a table without rows, too.
            holds(text, None)?;
            let of_row = |row: usize| holds(text, Some(&|name| Ok(table.number(row, place(name)?))));
            let held = (0..table.rows.len()).map(of_row).collect::<Result<Vec<bool>, String>>()?;
            kept.retain(|row| held[*row]);
        }
        let column = |place: usize| kept.iter().map(|row| table.number(*row, place)).collect::<Vec<f64>>();
        let objective = |name: &String, of: fn(Vec<f64>, Vec<f64>) -> Objective| -> Result<Objective, String> {
            let standard_errors = standard_error_of(name, known()).map(place).transpose()?.map_or(Vec::new(), column);
            Ok(of(column(place(name)?), standard_errors))
        };
        let small = wanted.min.iter().map(|name| objective(name, Objective::small));
        let large = wanted.max.iter().map(|name| objective(name, Objective::large));
        let objectives = small.chain(large).collect::<Result<Vec<_>, String>>()?;
        if objectives.is_empty() {
            return Err("no column is to be small or large: at least one --min COLUMN or --max COLUMN is needed".into());
        }
        let places = kept.iter().zip(front(&objectives)).filter(|(_, place)| *place != Place::Off);
        let front = places.map(|(row, place)| (*row, place == Place::Doubtful)).collect();
        let (of, objectives) = (kept.len(), [&wanted.min[..], &wanted.max[..]].concat());
        Ok(Self { table, objectives, of, front })
    }

    /// The front for people: what comes before the results of a sweep, and the objectives.
    pub fn text(&self) -> String {
        let results = self.table.column("scene_hash").unwrap_or(1.min(self.table.header.len()));
        let mut shown: Vec<usize> = (0..results).collect();
        for place in self.objectives.iter().filter_map(|name| self.table.column(name)) {
            if !shown.contains(&place) {
                shown.push(place);
            }
        }
        format!(
            "{}{} of {} rows are on the front; doubtful: within {NEAR} standard errors of being beaten\n",
            self.columns(shown).aligned(),
            self.front.len(),
            self.of
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
            table
                .text(&self.table.header[place], self.front.iter().map(|(row, _)| self.table.rows[*row][place].clone()))
        });
        of_rows.text("front", self.front.iter().map(|(_, doubtful)| if *doubtful { "doubtful" } else { "on" }))
    }

    /// The front for programs.
    pub fn json(&self) -> Value {
        let row = |(row, doubtful): &(usize, bool)| {
            let cells = self.table.header.iter().cloned().zip(self.table.rows[*row].iter().map(|cell| json!(cell)));
            json!({ "row": row, "doubtful": doubtful, "cells": cells.collect::<Map<_, _>>() })
        };
        let front: Vec<Value> = self.front.iter().map(row).collect();
        json!({ "version": crate::VERSION, "objectives": self.objectives, "rows": self.of, "front": front })
    }
}
