//! A finished run of a wake, read from its files.
//!
//! Check: the test of the pictures reads a run that the program made.

use super::super::kind::CaseKind;
use super::super::{CaseFile, Subgrid};
use super::case::WakeFlow;
use super::history::SCALED;
use crate::Error;
use crate::io::csv_input::TextTable;
use std::collections::HashMap;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use wakescope_les::analysis::WakeScales;

/// A finished run.
#[derive(Debug, Clone, PartialEq)]
pub struct FinishedWake {
    /// Where its files are.
    pub folder: PathBuf,
    /// Its case.
    pub file: CaseFile,
    /// The flow.
    pub flow: WakeFlow,
    /// The scales of its pair.
    pub scales: WakeScales,
    /// Ages of the whole fields, in the order of the files.
    pub fields_tau: Vec<f64>,
    columns: HashMap<String, Vec<f64>>,
}

impl FinishedWake {
    /// The run in a folder, by its `case.toml` and its history.
    ///
    /// # Errors
    /// Files that are not there or not those of a wake; a run that has not come to its end.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let file = CaseFile::read(&folder.join("case.toml"))?;
        let CaseKind::Wake(flow) = &file.content.case else {
            return Err(Error::input(folder, "the case is not a wake"));
        };
        let Some(output) = file.content.wake.clone() else {
            return Err(Error::input(folder, "the case is not a wake"));
        };
        let flow = (**flow).clone();
        let scales = flow.pair.scales().map_err(Error::Flow)?;
        let mut columns = table(&folder.join("wake.csv"))?;
        let mut scaled = Vec::new();
        for (name, values) in &columns {
            scaled.extend(in_units_of_the_pair(name, values, &scales));
        }
        columns.extend(scaled);
        let wake = Self {
            folder: folder.to_owned(),
            scales,
            flow,
            file,
            fields_tau: output.fields_tau.unwrap_or_default(),
            columns,
        };
        let reached = wake.column("tau")?.last().copied().unwrap_or(0.0);
        // The last record need not be at the end.
        let last = (output.end_tau / output.every_tau + 1e-6).floor() * output.every_tau;
        if reached < last - 1e-9 {
            let end = output.end_tau;
            let reason = format!("the run has reached tau = {reached} of {end}");
            return Err(Error::input(folder, reason));
        }
        Ok(wake)
    }

    /// A column of the history: in SI units by its name in `wake.csv` (`y_left_m`), in those of the pair by that name without the
    /// unit (`y_left` in `b0`, circulations in `Gamma0`).
    ///
    /// # Errors
    /// There is none of that name.
    pub fn column(&self, name: &str) -> Result<&[f64], Error> {
        self.columns
            .get(name)
            .map(Vec::as_slice)
            .ok_or_else(|| Error::Input {
                path: self.folder.clone(),
                reason: format!("the history of the wake has no column {name}"),
            })
    }

    /// A column against `tau`.
    ///
    /// # Errors
    /// As [`FinishedWake::column`].
    pub fn curve(&self, name: &str) -> Result<Vec<(f64, f64)>, Error> {
        let mut points = Vec::new();
        for (tau, value) in self.column("tau")?.iter().zip(self.column(name)?) {
            points.push((*tau, *value));
        }
        Ok(points)
    }

    /// The run in words, its noise among them.
    pub fn words(&self) -> String {
        let WakeFlow {
            cells: [x, y, z],
            reynolds,
            core_radius,
            perturbation,
            ..
        } = self.flow;
        let subgrid = match self.file.content.solver.subgrid {
            Subgrid::None {} => "no",
            Subgrid::Smagorinsky { .. } => "Smagorinsky's",
            Subgrid::Wale { .. } => "WALE as",
            Subgrid::MultiscaleWale { .. } => "multiscale",
        };
        let share = 25.0 * PI * core_radius;
        format!(
            "simulated flow, {x} x {y} x {z} cells, {subgrid} subgrid model, Γ₀/ν = {reynolds}, core {core_radius} b₀ ({share:.1} % of \
             the span), noise {perturbation} V₀"
        )
    }
}

/// Name and values in the units of the pair of a column whose name ends in a unit.
fn in_units_of_the_pair(
    name: &str,
    values: &[f64],
    scales: &WakeScales,
) -> Option<(String, Vec<f64>)> {
    let kind = SCALED.iter().find(|kind| name.ends_with(kind.suffix))?;
    let bare = name.strip_suffix(kind.suffix)?;
    let unit = (kind.unit)(scales);
    let scaled = values.iter().map(|value| value / unit).collect();
    Some((bare.to_owned(), scaled))
}

/// Columns of a table by name; empty cells are NaN.
///
/// # Errors
/// A file that cannot be read; a value that is not a number.
pub fn table(path: &Path) -> Result<HashMap<String, Vec<f64>>, Error> {
    let text = std::fs::read_to_string(path).map_err(Error::io("read", path))?;
    let table = TextTable::parse(&text).map_err(|reason| Error::input(path, reason))?;
    let mut columns = HashMap::new();
    for (column, name) in table.header.iter().enumerate() {
        let mut values = Vec::with_capacity(table.rows.len());
        for row in &table.rows {
            let cell = row[column].as_str();
            values.push(match cell {
                "" => f64::NAN,
                cell => cell
                    .parse()
                    .map_err(|_| Error::input(path, format!("{cell} is not a number")))?,
            });
        }
        columns.insert(name.clone(), values);
    }
    Ok(columns)
}
