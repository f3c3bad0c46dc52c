//! The front of a table's rows: which columns count, under which conditions, and what is shown of it.
//!
//! Check: tables by hand; columns and conditions that cannot be are refused.

use super::expression::Condition;
use super::pareto::{NEAR, Objective, Place, Sense, front};
use super::results::standard_error_of;
use crate::io::csv_input::TextTable;
use crate::io::{Provenance, Table};
use crate::keys::near;
use serde_json::{Map, Value, json};

/// What is wanted of a table.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// Columns of which small values are better.
    pub min: &'a [String],
    /// Columns of which large values are better.
    pub max: &'a [String],
    /// Comparisons that a row must meet.
    pub conditions: &'a [String],
}

/// A table with the place of each row.
#[derive(Debug)]
pub struct FrontTable {
    table: TextTable,
    objectives: Vec<String>,
    /// Rows for which the conditions hold, and their places.
    rows: Vec<(usize, Place)>,
}

impl FrontTable {
    /// Finds the front of the rows for which all conditions hold; standard errors come from the columns that have them.
    ///
    /// # Errors
    /// Columns that are not there, no objective, conditions that cannot be read.
    pub fn new(table: TextTable, wanted: &Wanted<'_>) -> Result<Self, String> {
        let place = |name: &str| {
            table.column(name).ok_or_else(|| {
                let known = || table.header.iter().map(String::as_str);
                let hint = near(name, known()).map(|name| format!("; did you mean {name}?")).unwrap_or_default();
                format!("there is no column {name}{hint} Known: {}", known().collect::<Vec<_>>().join(", "))
            })
        };
        let conditions: Vec<Condition> =
            wanted.conditions.iter().map(|text| Condition::parse(text)).collect::<Result<_, _>>()?;
        let mut kept = Vec::new();
        for row in 0..table.rows.len() {
            let value_of = |name: &str| Ok(table.number(row, place(name)?));
            let mut holds = true;
            for condition in &conditions {
                holds &= condition.holds(&value_of)?;
            }
            kept.extend(holds.then_some(row));
        }
        let senses = wanted.min.iter().map(|name| (name, Sense::Min));
        let senses = senses.chain(wanted.max.iter().map(|name| (name, Sense::Max)));
        let column = |place: usize| kept.iter().map(|row| table.number(*row, place)).collect::<Vec<f64>>();
        let mut objectives = Vec::new();
        for (name, sense) in senses.clone() {
            let error = standard_error_of(name, table.header.iter().map(String::as_str));
            let standard_errors = error.map(place).transpose()?.map_or(Vec::new(), column);
            objectives.push(Objective { sense, values: column(place(name)?), standard_errors });
        }
        if objectives.is_empty() {
            return Err("no column is to be small or large: at least one --min COLUMN or --max COLUMN is needed".into());
        }
        let rows = kept.iter().copied().zip(front(&objectives)).collect();
        let objectives = senses.map(|(name, _)| name.clone()).collect();
        Ok(Self { table, objectives, rows })
    }

    fn members(&self) -> impl Iterator<Item = (usize, bool)> {
        self.rows.iter().filter(|(_, place)| *place != Place::Off).map(|(row, place)| (*row, *place == Place::Doubtful))
    }

    /// Columns to show: what comes before the results of a sweep, and the objectives.
    fn shown(&self) -> Vec<usize> {
        let results = self.table.column("scene_hash").unwrap_or(1.min(self.table.header.len()));
        let objectives = self.objectives.iter().filter_map(|name| self.table.column(name));
        let mut shown: Vec<usize> = (0..results).collect();
        objectives.for_each(|place| {
            if !shown.contains(&place) {
                shown.push(place)
            }
        });
        shown
    }

    /// The front for people.
    pub fn text(&self) -> String {
        let on = self.members().count();
        format!(
            "{}{on} of {} rows are on the front; doubtful: within {NEAR} standard errors of being beaten\n",
            self.of(&self.shown()).aligned(),
            self.rows.len()
        )
    }

    /// All columns of the front, and whether a row is doubtful.
    pub fn rows(&self) -> Table {
        self.of(&(0..self.table.header.len()).collect::<Vec<_>>())
    }

    /// Where the table comes from.
    pub fn origin(&self) -> Provenance {
        self.table.origin()
    }

    fn of(&self, columns: &[usize]) -> Table {
        let of_rows = columns.iter().fold(Table::new(), |table, &column| {
            table.text(&self.table.header[column], self.members().map(|(row, _)| self.table.rows[row][column].clone()))
        });
        of_rows.text("front", self.members().map(|(_, doubtful)| if doubtful { "doubtful" } else { "on" }))
    }

    /// The front for programs.
    pub fn json(&self) -> Value {
        let row = |(row, doubtful): (usize, bool)| {
            let cells = self.table.header.iter().cloned().zip(self.table.rows[row].iter().map(|cell| json!(cell)));
            json!({ "row": row, "doubtful": doubtful, "cells": cells.collect::<Map<_, _>>() })
        };
        let front: Vec<Value> = self.members().map(row).collect();
        json!({ "version": crate::VERSION, "objectives": self.objectives, "rows": self.rows.len(), "front": front })
    }
}
