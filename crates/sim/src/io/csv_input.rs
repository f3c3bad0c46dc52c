//! Tables of texts from CSV: comment lines begin with `#`, the first other line is the header; quotes as in RFC 4180.
//!
//! Check: what the writer of tables makes of any text comes back.

use super::{Provenance, text_file};
use crate::Error;
use std::path::Path;

/// A table whose cells are texts.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TextTable {
    /// Names of the columns.
    pub header: Vec<String>,
    /// Rows with as many cells.
    pub rows: Vec<Vec<String>>,
    /// The comment lines before the header, without their signs.
    pub comment: String,
}

impl TextTable {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read; no header; rows with more or fewer cells than it.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = text_file::read(path).map_err(Error::io("read", path))?;
        Self::parse(&text).map_err(|reason| Error::Input {
            path: path.to_owned(),
            reason,
        })
    }

    /// Reads a text.
    ///
    /// # Errors
    /// As [`TextTable::read`], without the file.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut records = records(text.strip_prefix('\u{feff}').unwrap_or(text));
        let header = records
            .next()
            .ok_or("no header: the first line that is no comment names the columns")?;
        let mut rows = Vec::new();
        for row in records {
            if row.len() != header.len() {
                let (found, wanted) = (row.len(), header.len());
                return Err(format!(
                    "row {} has {found} cells, the header {wanted}",
                    rows.len() + 1
                ));
            }
            rows.push(row);
        }
        let comment = text
            .lines()
            .map_while(|line| line.strip_prefix('#'))
            .map(|line| format!("{}\n", line.trim_end()));
        Ok(Self {
            header,
            rows,
            comment: comment.collect(),
        })
    }

    /// Where the table comes from, as far as its comments say it.
    pub fn origin(&self) -> Provenance {
        let entry = |name: &str| {
            self.comment
                .lines()
                .find_map(|line| line.trim_start().strip_prefix(name))
        };
        let (_, scene) = self.comment.split_once(" scene:\n").unwrap_or_default();
        Provenance {
            program: crate::PROGRAM.into(),
            scene_toml: scene
                .lines()
                .map(|line| format!("{}\n", line.strip_prefix("   ").unwrap_or(line)))
                .collect(),
            scene_hash: entry("scene_hash: ").unwrap_or_default().into(),
            seed: entry("seed: ")
                .and_then(|seed| seed.parse().ok())
                .unwrap_or(0),
        }
    }

    /// Place of a column.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|column| column == name)
    }

    /// Place of the column of an angle, and its unit, rad: that in radians, or else that in degrees.
    pub(crate) fn angle(&self, name: &str) -> Option<(usize, f64)> {
        let in_degrees = || Some((self.column(&format!("{name}_deg"))?, 1f64.to_radians()));
        self.column(&format!("{name}_rad"))
            .map(|column| (column, 1.0))
            .or_else(in_degrees)
    }

    /// A cell as a number; NaN where it is empty or none.
    pub fn number(&self, row: usize, column: usize) -> f64 {
        let cell = self.rows.get(row).and_then(|cells| cells.get(column));
        cell.and_then(|cell| cell.trim().parse().ok())
            .unwrap_or(f64::NAN)
    }
}

/// Records of cells, without comments and empty lines.
fn records(text: &str) -> impl Iterator<Item = Vec<String>> + '_ {
    let mut chars = text.chars().peekable();
    std::iter::from_fn(move || {
        loop {
            match chars.peek()? {
                '#' => while chars.next().is_some_and(|c| c != '\n') {},
                '\n' | '\r' => drop(chars.next()),
                _ => break,
            }
        }
        let (mut row, mut cell, mut quoted) = (Vec::new(), String::new(), false);
        while let Some(c) = chars.next() {
            match c {
                '"' if quoted && chars.peek() == Some(&'"') => cell.extend(chars.next()),
                '"' => quoted = !quoted,
                ',' if !quoted => row.push(std::mem::take(&mut cell)),
                '\r' if !quoted => {}
                '\n' if !quoted => break,
                _ => cell.push(c),
            }
        }
        row.push(cell);
        Some(row)
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Table, provenance::example};
    use super::*;

    #[test]
    fn what_the_writer_makes_comes_back() {
        let wild = [
            "plain",
            "a,b",
            "say \"x\"",
            "two\nlines",
            "# no comment",
            "",
        ];
        let numbers = [0.1, 1.0 / 3.0, f64::NAN, f64::INFINITY, -2.5e-17, 5e-324];
        let text = Table::new()
            .text("a label", wild)
            .float("x_m", numbers)
            .to_csv(&example())
            .unwrap();
        let table = TextTable::parse(&text).unwrap();
        assert_eq!(table.header, ["a label", "x_m"]);
        assert_eq!(
            table.origin(),
            Provenance {
                program: crate::PROGRAM.into(),
                ..example()
            }
        );
        for (row, (label, number)) in wild.iter().zip(numbers).enumerate() {
            assert_eq!(table.rows[row][0], *label);
            let read = table.number(row, table.column("x_m").unwrap());
            assert!(read.to_bits() == number.to_bits() || (read.is_nan() && number.is_nan()));
        }
    }

    #[test]
    fn tables_of_others_are_read_or_refused() {
        let table = TextTable::parse("# note\r\n\r\na,b\r\n1,2\r\n\n3,4").unwrap();
        assert_eq!(
            (table.rows.len(), table.number(1, 1), table.column("c")),
            (2, 4.0, None)
        );
        assert!(
            TextTable::parse("a,b\n1\n")
                .unwrap_err()
                .contains("row 1 has 1 cells, the header 2")
        );
        assert!(
            TextTable::parse("# nothing\n")
                .unwrap_err()
                .contains("no header")
        );
    }
}
