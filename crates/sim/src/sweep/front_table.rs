//! The front of a table's rows: which columns count, under which conditions, and what is shown of it.
//!
//! Check: tables by hand; columns and conditions that cannot be are refused.

use super::expression::Condition;
use super::pareto::{NEAR, Objective, Place, Sense, front};
use super::results::standard_error_of;
use crate::io::csv_input::TextTable;
use crate::io::{OutputError, Table};
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
        let shown = self.shown();
        let cell = |row: usize, column: usize| self.table.rows[row][column].clone();
        let mut lines = vec![shown.iter().map(|column| self.table.header[*column].clone()).collect::<Vec<_>>()];
        for (row, doubtful) in self.members() {
            let mut line: Vec<String> = shown.iter().map(|column| cell(row, *column)).collect();
            line.extend(doubtful.then(|| "doubtful".to_owned()));
            lines.push(line);
        }
        let width = |column: usize| lines.iter().filter_map(|l| l.get(column)).map(String::len).max().unwrap_or(0);
        let padded = |line: &Vec<String>| {
            let cells = line.iter().enumerate().map(|(i, cell)| format!("{cell:>0$}", width(i)));
            cells.collect::<Vec<_>>().join("  ")
        };
        let on = self.members().count();
        let mut text = lines.iter().map(|line| padded(line) + "\n").collect::<String>();
        text += &format!(
            "{on} of {} rows are on the front; doubtful: within {NEAR} standard errors of being beaten\n",
            self.rows.len()
        );
        text
    }

    /// All columns of the front, and whether a row is doubtful.
    ///
    /// # Errors
    /// A header that no table can have, such as a column twice.
    pub fn csv(&self) -> Result<String, OutputError> {
        let members: Vec<(usize, bool)> = self.members().collect();
        let mut out = Table::new();
        for (column, name) in self.table.header.iter().enumerate() {
            out = out.text(name, members.iter().map(|(row, _)| self.table.rows[*row][column].clone()));
        }
        out.text("front", members.iter().map(|(_, doubtful)| if *doubtful { "doubtful" } else { "on" }))
            .to_csv(&self.table.origin())
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
