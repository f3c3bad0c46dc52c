//! Writes any table as CSV: provenance as `#` comment lines, one header row, one row per record.
//! Floats are the shortest text that reads back to the same bits, a missing value is an empty cell.
//! Check: the tests parse the text again and compare bit patterns.

use super::checks::same_length;
use super::provenance::Provenance;
use crate::Error;

/// A usual float with its separator.
const USUAL_CELL_BYTES: usize = 20;

/// Values of one column.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Floating point; NaN is written as an empty cell.
    Float(Vec<f64>),
    /// Integers.
    Int(Vec<i64>),
    /// Text, quoted where needed (RFC 4180).
    Text(Vec<String>),
}

impl Column {
    fn len(&self) -> usize {
        match self {
            Self::Float(v) => v.len(),
            Self::Int(v) => v.len(),
            Self::Text(v) => v.len(),
        }
    }

    /// A cell as JSON; null where it is missing.
    #[cfg(feature = "cli")]
    fn json(&self, row: usize) -> serde_json::Value {
        match self {
            Self::Float(v) => v[row].into(),
            Self::Int(v) => v[row].into(),
            Self::Text(v) => v[row].clone().into(),
        }
    }

    /// The text of a cell, floats in the form given.
    fn cell(&self, row: usize, float: fn(f64) -> String) -> String {
        match self {
            Self::Float(v) => float(v[row]),
            Self::Int(v) => v[row].to_string(),
            Self::Text(v) => v[row].clone(),
        }
    }
}

/// A table under construction: columns of one length, written in the order in which they were added.
///
/// ```
/// use wakescope_sim::io::{Provenance, Table};
/// let origin = Provenance { program: "wakescope".into(), scene_toml: String::new(), scene_hash: "0".into(), seed: 1 };
/// let text = Table::new()
///     .float("range_m", [100.0, 200.0])
///     .float("snr_db", [12.5, f64::NAN])
///     .to_csv(&origin)?;
/// assert!(text.ends_with("range_m,snr_db\n100.0,12.5\n200.0,\n"));
/// # Ok::<(), wakescope_sim::Error>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    columns: Vec<(String, Column)>,
}

impl Table {
    /// An empty table.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a column of floats; the name carries the unit tag.
    #[must_use]
    pub fn float(self, name: &str, values: impl IntoIterator<Item = f64>) -> Self {
        self.column(name, Column::Float(values.into_iter().collect()))
    }

    /// Adds a column of integers.
    #[must_use]
    pub fn int(self, name: &str, values: impl IntoIterator<Item = i64>) -> Self {
        self.column(name, Column::Int(values.into_iter().collect()))
    }

    /// Adds a column of text.
    #[must_use]
    pub fn text<S: Into<String>>(self, name: &str, values: impl IntoIterator<Item = S>) -> Self {
        self.column(
            name,
            Column::Text(values.into_iter().map(Into::into).collect()),
        )
    }

    /// Adds a column of any kind.
    #[must_use]
    pub fn column(mut self, name: &str, values: Column) -> Self {
        self.columns.push((name.to_owned(), values));
        self
    }

    /// Adds the columns of another table.
    #[must_use]
    pub fn beside(mut self, other: Self) -> Self {
        self.columns.extend(other.columns);
        self
    }

    /// The rows of several tables, one table after the other.
    ///
    /// # Errors
    /// Tables whose columns differ in number, name or kind.
    pub fn stack(tables: impl IntoIterator<Item = Self>) -> Result<Self, Error> {
        let mut tables = tables.into_iter();
        let mut all = tables.next().unwrap_or_default();
        for table in tables {
            all.append(table)?;
        }
        Ok(all)
    }

    /// Adds the rows of a table with the same columns.
    fn append(&mut self, table: Self) -> Result<(), Error> {
        let has_same_count = self.columns.len() == table.columns.len();
        for ((name, column), (other, more)) in self.columns.iter_mut().zip(table.columns) {
            let is_same = has_same_count && *name == other;
            match (column, more) {
                (Column::Float(column), Column::Float(more)) if is_same => column.extend(more),
                (Column::Int(column), Column::Int(more)) if is_same => column.extend(more),
                (Column::Text(column), Column::Text(more)) if is_same => column.extend(more),
                _ => {
                    return Err(Error::value(
                        "column of a table",
                        other,
                        format!("{name}, of the same kind"),
                    ));
                }
            }
        }
        Ok(())
    }

    /// Names and values in order.
    pub fn columns(&self) -> &[(String, Column)] {
        &self.columns
    }

    /// The rows as objects with the names of the columns as keys; missing values are null.
    #[cfg(feature = "cli")]
    pub(crate) fn objects(&self) -> Vec<serde_json::Value> {
        let mut objects = Vec::with_capacity(self.len());
        for row in 0..self.len() {
            let mut object = serde_json::Map::new();
            for (name, column) in &self.columns {
                object.insert(name.clone(), column.json(row));
            }
            objects.push(object.into());
        }
        objects
    }

    fn len(&self) -> usize {
        self.columns.first().map_or(0, |(_, column)| column.len())
    }

    /// The table for people: columns side by side, floats as `digits` has them.
    pub fn aligned(&self) -> String {
        let mut lines = vec![String::new(); self.len() + 1];
        for (index, (name, column)) in self.columns.iter().enumerate() {
            let mut cells = vec![name.clone()];
            for row in 0..self.len() {
                cells.push(column.cell(row, digits));
            }
            let widths = cells.iter().map(|cell| cell.chars().count());
            let width = widths.max().unwrap_or(0);
            for (line, cell) in lines.iter_mut().zip(cells) {
                if index > 0 {
                    line.push_str("  ");
                }
                *line += &format!("{cell:>width$}");
            }
        }
        let mut text = String::new();
        for line in lines {
            text += line.trim_end();
            text.push('\n');
        }
        text
    }

    /// The table as CSV text.
    ///
    /// # Errors
    /// No column, columns of different lengths, a repeated or empty name, a name that would look like a comment.
    pub fn to_csv(&self, provenance: &Provenance) -> Result<String, Error> {
        self.check()?;
        let header: Vec<String> = self
            .columns
            .iter()
            .map(|(name, _)| quoted(name.clone()))
            .collect();
        let mut out = provenance.comment_lines() + &header.join(",") + "\n";
        // Room for most texts at once, so that growing does not copy what is there.
        out.reserve(USUAL_CELL_BYTES * self.columns.len() * self.len());
        for row in 0..self.len() {
            for (i, (_, column)) in self.columns.iter().enumerate() {
                if i > 0 {
                    out.push(',');
                }
                out.push_str(&quoted(column.cell(row, float_text)));
            }
            out.push('\n');
        }
        out.shrink_to_fit();
        Ok(out)
    }

    fn check(&self) -> Result<(), Error> {
        let Some((first, values)) = self.columns.first() else {
            return Err(Error::Missing {
                what: "column".into(),
                needed: "a table has at least one".into(),
            });
        };
        for (i, (name, column)) in self.columns.iter().enumerate() {
            same_length(name, column.len(), first, values.len())?;
            if name.is_empty() || name.starts_with('#') {
                return Err(Error::value(
                    "column name",
                    name,
                    "must not be empty or start with '#'",
                ));
            }
            if self.columns[..i].iter().any(|(n, _)| n == name) {
                return Err(Error::Duplicate {
                    what: "column",
                    name: name.clone(),
                });
            }
        }
        Ok(())
    }
}

/// Shortest text that reads back to the same value; empty for NaN, and one zero for both signs, which no reader
/// should have to tell apart.
pub(crate) fn float_text(value: f64) -> String {
    match value {
        v if v.is_nan() => String::new(),
        0.0 => "0.0".into(),
        v => format!("{v:?}"),
    }
}

/// A number for people: four decimals, or the form with an exponent where they do not show it; what is not known is a dash.
pub(crate) fn digits(value: f64) -> String {
    match value {
        v if v.is_nan() => "-".into(),
        v if v != 0.0 && !(1e-3..1e5).contains(&v.abs()) => format!("{v:.3e}"),
        v => format!("{v:.4}"),
    }
}

fn quoted(text: String) -> String {
    // A leading '#' is quoted too: readers drop lines that begin with it.
    let plain = !text.contains([',', '"', '\n', '\r']) && !text.starts_with('#');
    if plain {
        text
    } else {
        format!("\"{}\"", text.replace('"', "\"\""))
    }
}

#[cfg(test)]
mod tests {
    use super::super::provenance::example;
    use super::*;

    /// Minimal independent reader: records of cells, comments dropped, quotes undone.
    fn parse(text: &str) -> Vec<Vec<String>> {
        let body: String = text
            .split_inclusive('\n')
            .filter(|l| !l.starts_with('#'))
            .collect();
        let mut rows = vec![];
        let mut row = vec![];
        let mut cell = String::new();
        let mut inside = false;
        let mut chars = body.chars().peekable();
        while let Some(c) = chars.next() {
            match c {
                '"' if inside && chars.peek() == Some(&'"') => cell.push(chars.next().unwrap()),
                '"' => inside = !inside,
                ',' if !inside => row.push(std::mem::take(&mut cell)),
                '\n' if !inside => {
                    row.push(std::mem::take(&mut cell));
                    rows.push(std::mem::take(&mut row));
                }
                _ => cell.push(c),
            }
        }
        rows
    }

    #[test]
    fn numbers_read_back_to_the_same_bits() {
        let values = [
            0.1,
            1.0 / 3.0,
            -2.5e-17,
            6.02e23,
            f64::MAX,
            f64::MIN_POSITIVE,
            5e-324,
            123456789.0,
        ];
        let text = Table::new()
            .float("a_m", values)
            .int("n", 0..8)
            .to_csv(&example())
            .unwrap();
        let rows = parse(&text);
        assert_eq!(rows[0], ["a_m", "n"]);
        for (row, value) in rows[1..].iter().zip(values) {
            assert_eq!(
                row[0].parse::<f64>().unwrap().to_bits(),
                value.to_bits(),
                "{}",
                row[0]
            );
        }
        assert!(
            text.lines().all(|l| l.len() < 60),
            "tiny and huge numbers must not be spelled out"
        );
    }

    #[test]
    fn missing_is_empty_and_zero_has_no_sign() {
        let text = Table::new()
            .float("a", [f64::NAN, -0.0])
            .float("b", [f64::INFINITY, 1.0])
            .to_csv(&example())
            .unwrap();
        assert!(text.ends_with("a,b\n,inf\n0.0,1.0\n"), "{text}");
    }

    #[test]
    fn text_with_separators_comes_back() {
        let wild = ["plain", "a,b", "say \"x\"", "two\nlines", "# no comment"];
        let text = Table::new().text("label", wild).to_csv(&example()).unwrap();
        let back: Vec<String> = parse(&text)[1..].iter().map(|r| r[0].clone()).collect();
        assert_eq!(back, wild);
    }

    #[test]
    fn bad_tables_are_refused() {
        let uneven = Table::new().float("a", [1.0]).float("b", [1.0, 2.0]);
        assert!(matches!(
            uneven.to_csv(&example()),
            Err(Error::Length { .. })
        ));
        let twice = Table::new().float("a", [1.0]).float("a", [1.0]);
        assert!(matches!(
            twice.to_csv(&example()),
            Err(Error::Duplicate { .. })
        ));
        assert!(matches!(
            Table::new().to_csv(&example()),
            Err(Error::Missing { .. })
        ));
        let comment = Table::new().float("#a", [1.0]);
        assert!(matches!(
            comment.to_csv(&example()),
            Err(Error::Value { .. })
        ));
    }
}
