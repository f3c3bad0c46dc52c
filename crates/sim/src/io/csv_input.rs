//! Tables of texts from CSV: comment lines begin with `#`, `%`, `!` or `//`, the first other line is the header; quotes as in RFC 4180.
//!
//! Tables of other programs may have a header that is the last comment before a first line of numbers (`numpy.savetxt`), cells
//! with semicolons, tabs, bars or blanks between them, decimal commas beside separators that are none or in quotes, blanks around cells,
//! the header again where files were joined, a row of units below it, and empty cells behind the last column.
//! Check: what the writer of tables makes of any text comes back; one table in each of these forms.

use super::netcdf_input::quoted;
use super::units::{is_unit, split_unit};
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
    /// Whether a comma in a number is its point.
    has_decimal_commas: bool,
}

impl TextTable {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read; no header; rows with more or fewer cells than it.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = text_file::read(path).map_err(Error::io("read", path))?;
        Self::parse(&text).map_err(|reason| Error::input(path, reason))
    }

    /// Reads a text.
    ///
    /// # Errors
    /// As [`TextTable::read`], without the file.
    pub fn parse(text: &str) -> Result<Self, String> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        // A spreadsheet may state its separator in a line of its own.
        let text = match text.split_once('\n') {
            Some((first, rest)) if first.starts_with("sep=") => rest,
            _ => text,
        };
        let separator = separator(text);
        let mut records = records(text, separator).peekable();
        let mut header = match records.peek() {
            Some(first) if are_numbers(first) => commented_header(text, separator, first.len())?,
            _ => records
                .next()
                .ok_or("no header: the first line that is not a comment names the columns")?,
        };
        let as_written = header.clone();
        for name in &mut header {
            *name = name.trim().to_owned();
        }
        let units = records.next_if(|row| are_units(row, header.len()));
        add_units(&mut header, units.as_deref().unwrap_or_default());
        let mut rows = Vec::new();
        for mut row in records {
            if row == as_written || Some(&row) == units.as_ref() {
                continue;
            }
            while row.len() > header.len() && row.last().is_some_and(|cell| cell.trim().is_empty())
            {
                row.pop();
            }
            if row.len() != header.len() {
                return Err(uneven(&row, &header, rows.len() + 1));
            }
            rows.push(row);
        }
        let has_decimal_commas = separator != ',' || has_quoted_decimals(&rows);
        let mut comment = String::new();
        for line in text.lines().map_while(comment_of) {
            comment += line.trim_end();
            comment.push('\n');
        }
        Ok(Self {
            header,
            rows,
            comment,
            has_decimal_commas,
        })
    }

    /// Where the table comes from, as far as its comments say it.
    pub fn origin(&self) -> Provenance {
        let (_, scene) = self.comment.split_once(" scene:\n").unwrap_or_default();
        let mut scene_toml = String::new();
        for line in scene.lines() {
            scene_toml += line.strip_prefix("   ").unwrap_or(line);
            scene_toml.push('\n');
        }
        let hash = self.comment_entry("scene_hash: ").unwrap_or_default();
        let seed = self.comment_entry("seed: ").map(str::parse);
        Provenance::new(&scene_toml, hash, seed.and_then(Result::ok).unwrap_or(0))
    }

    /// What follows a key in the comments.
    fn comment_entry(&self, key: &str) -> Option<&str> {
        let mut lines = self.comment.lines();
        lines.find_map(|line| line.trim_start().strip_prefix(key))
    }

    /// Index of a column by its name, in capital or small letters, with or without the unit in brackets behind it.
    pub fn column(&self, name: &str) -> Option<usize> {
        let column = |is_it: &dyn Fn(&str) -> bool| self.header.iter().position(|own| is_it(own));
        column(&|own| own == name)
            .or_else(|| column(&|own| own.eq_ignore_ascii_case(name)))
            .or_else(|| column(&|own| own.ends_with(']') && split_unit(own).0 == name))
    }

    /// Number of columns that [`TextTable::column`] could find by a name.
    pub fn columns_of(&self, name: &str) -> usize {
        let is_it = |own: &&String| {
            own.eq_ignore_ascii_case(name) || (own.ends_with(']') && split_unit(own).0 == name)
        };
        self.header.iter().filter(is_it).count()
    }

    /// A cell as a number; NaN where it is empty or none.
    pub fn number(&self, row: usize, column: usize) -> f64 {
        let Some(cell) = self.rows.get(row).and_then(|cells| cells.get(column)) else {
            return f64::NAN;
        };
        let number = match self.has_decimal_commas {
            true => cell.trim().replace(',', ".").parse(),
            false => cell.trim().parse(),
        };
        number.unwrap_or(f64::NAN)
    }
}

/// Why a cell with a comma is no number, as the end of a message; nothing for other cells.
pub(super) fn comma_remark(cell: &str) -> &'static str {
    match cell.contains(',') {
        true => {
            "; a comma is a decimal point only where no number of the table has a point, and some have other than three digits behind it"
        }
        false => "",
    }
}

/// Whether commas within cells, which are quoted between commas, are decimal points: each number with one is like `12,5`, none has
/// a point, and some show that the comma does not divide thousands.
fn has_quoted_decimals(rows: &[Vec<String>]) -> bool {
    let mut is_sure = false;
    for cell in rows.iter().flatten() {
        let cell = cell.trim();
        let Some((whole, fraction)) = cell.split_once(',') else {
            if cell.contains('.') && cell.parse::<f64>().is_ok() {
                return false;
            }
            continue;
        };
        let is_decimal = cell.replacen(',', ".", 1).parse::<f64>().is_ok();
        if !is_decimal && cell.replace(',', "").parse::<f64>().is_ok() {
            return false;
        }
        let before = whole.trim_start_matches(['+', '-']);
        let is_whole = fraction.bytes().all(|b| b.is_ascii_digit());
        let is_thousands = is_whole
            && fraction.len() == 3
            && (1..4).contains(&before.len())
            && !before.starts_with('0');
        is_sure |= is_decimal && !is_thousands;
    }
    is_sure
}

/// What is said of a row with another number of cells than the header.
fn uneven(row: &[String], header: &[String], number: usize) -> String {
    let found = row.len();
    let wanted = header.len();
    let said = format!("row {number} has {found} cells, the header {wanted}");
    match header {
        [only] => format!(
            "{said} ({}): the first line that is no comment names the columns, and comments begin with #",
            quoted(only)
        ),
        _ => said,
    }
}

/// What follows the sign of a comment line.
fn comment_of(line: &str) -> Option<&str> {
    let signs = ["#", "%", "!", "//"];
    signs.iter().find_map(|sign| line.strip_prefix(sign))
}

/// Whether all cells are numbers, with a decimal point or comma.
fn are_numbers(cells: &[String]) -> bool {
    cells
        .iter()
        .all(|cell| cell.trim().replace(',', ".").parse::<f64>().is_ok())
}

/// Whether the cells of a row below a header of `columns` names are units: at least two are, and no cell is a number or another word.
fn are_units(row: &[String], columns: usize) -> bool {
    let mut units = 0;
    for (column, cell) in row.iter().enumerate() {
        match cell.trim().trim_matches(['[', ']', '(', ')']) {
            "" => {}
            _ if column >= columns => return false,
            "-" | "1" | "%" | "dB" | "UTC" => {}
            cell if is_unit(cell) => units += 1,
            _ => return false,
        }
    }
    units >= 2 && row.len() >= columns
}

/// Puts units behind the names of columns that have none.
fn add_units(header: &mut [String], units: &[String]) {
    for (name, unit) in header.iter_mut().zip(units) {
        let unit = unit.trim().trim_matches(['[', ']', '(', ')']);
        if is_unit(unit) && split_unit(name).1.is_none() {
            *name = format!("{name} [{unit}]");
        }
    }
}

/// What is between the cells of a row, by the first line of cells, a header or numbers; a blank for one or more blanks or tabs.
fn separator(text: &str) -> char {
    let mut lines = text
        .lines()
        .filter(|line| !line.trim().is_empty() && comment_of(line).is_none());
    let first = lines.next().unwrap_or_default();
    let unquoted: String = first.split('"').step_by(2).collect();
    for separator in [';', '\t', '|'] {
        if unquoted.contains(separator) {
            return separator;
        }
    }
    // Names may hold blanks, which divide them only where the next line is as many numbers.
    let count = first.split_whitespace().count();
    let next: Vec<&str> = lines.next().unwrap_or(first).split_whitespace().collect();
    let are_numbers = next.iter().all(|cell| cell.parse::<f64>().is_ok());
    match count > 1 && next.len() == count && are_numbers {
        true => ' ',
        false => ',',
    }
}

/// Whether a character is between cells.
fn divides(separator: char, c: char) -> bool {
    c == separator || (separator == ' ' && c == '\t')
}

/// The header of a table whose first line are numbers: the last comment before it.
fn commented_header(text: &str, separator: char, count: usize) -> Result<Vec<String>, String> {
    let comments = text.lines().map_while(comment_of);
    let last = comments.last().unwrap_or_default().trim();
    let names = records(last, separator).next().unwrap_or_default();
    match names.len() == count {
        true => Ok(names),
        false => Err(format!(
            "no header: its first line has {count} numbers, and the line before it does not name as many columns"
        )),
    }
}

/// Records of cells, without comments and empty lines.
fn records(text: &str, separator: char) -> impl Iterator<Item = Vec<String>> + '_ {
    let mut chars = text.chars().peekable();
    std::iter::from_fn(move || {
        loop {
            let first = *chars.peek()?;
            match first {
                '#' | '%' | '!' => while chars.next().is_some_and(|c| c != '\n') {},
                '/' if chars.clone().nth(1) == Some('/') => {
                    while chars.next().is_some_and(|c| c != '\n') {}
                }
                '\n' | '\r' => drop(chars.next()),
                ' ' if separator == ' ' => drop(chars.next()),
                _ => break,
            }
        }
        let mut row = Vec::new();
        let mut cell = String::new();
        let mut quoted = false;
        while let Some(c) = chars.next() {
            match c {
                '"' if quoted && chars.peek() == Some(&'"') => cell.extend(chars.next()),
                '"' => quoted = !quoted,
                '\r' if !quoted && chars.peek() == Some(&'\n') => {}
                '\n' | '\r' if !quoted => break,
                // Blanks together divide once.
                c if !quoted && divides(separator, c) => {
                    if separator != ' ' || !cell.is_empty() {
                        row.push(std::mem::take(&mut cell));
                    }
                }
                _ => cell.push(c),
            }
        }
        if separator != ' ' || !cell.is_empty() {
            row.push(cell);
        }
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
    fn quoted_commas_are_decimal_points_where_all_numbers_have_that_form() {
        fn numbers(rows: &str) -> [f64; 2] {
            let table = TextTable::parse(&format!("a,b,name\n{rows}")).unwrap();
            [0, 1].map(|column| table.number(0, column))
        }
        assert_eq!(numbers("\"12,5\",\"-0,125\",x\n"), [12.5, -0.125]);
        assert_eq!(numbers("\"1,5e3\",7,\"x,y\"\n"), [1500.0, 7.0]);
        assert_eq!(numbers("\"308,000\",\"0,125\",\"1. x\"\n"), [308.0, 0.125]);
        for rows in [
            "\"1,234.5\",\"12,5\",x\n",
            "\"1,234,567\",\"12,5\",x\n",
            "\"12,5\",\"1,25\",1.5\n",
            "\"1,234\",\"12,500\",x\n",
        ] {
            assert!(numbers(rows).iter().all(|number| number.is_nan()), "{rows}");
        }
        assert_eq!(comma_remark("12.x"), "");
        assert!(comma_remark("1,234").contains("three digits"));
    }

    #[test]
    fn tables_of_others_are_read_or_refused() {
        let table = TextTable::parse("# note\r\n\r\na,b\r\n1,2\r\n\n3,4").unwrap();
        assert_eq!(
            (table.rows.len(), table.number(1, 1), table.column("c")),
            (2, 4.0, None)
        );
        for text in [
            "# of a simulation\n# a,b\n1.5,2.5\n3.0,4.0\n",
            "a, b\n1.5, 2.5\n3.0, 4.0\n",
            "a;b\n1,5;2,5\n3,0;4,0\n",
            "a\tb\n1.5\t2.5\n3.0\t4.0\n",
            "sep=;\r\na;b\r\n1,5;2,5\r\n3,0;4,0\r\n",
            "# a b\n1.5 2.5\n3.0 4.0\n",
            "a  b\n 1.5   2.5 \n 3.0   4.0\n",
            "A,B\r1.5,2.5\r3.0,4.0\r",
            "% of Octave\n%\na,b\n1.5,2.5\n3.0,4.0\n",
            "// a b\n1.5 2.5\n3.0 4.0\n",
            "! note\na|b\n1.5|2.5\n3.0|4.0\n",
            "a,b\n1.5,2.5,\na,b\n3.0,4.0,\n",
        ] {
            let table = TextTable::parse(text).expect(text);
            let a = table.column("a").expect(text);
            let b = table.column("b").expect(text);
            let numbers = [0, 1].map(|row| [table.number(row, a), table.number(row, b)]);
            assert_eq!(numbers, [[1.5, 2.5], [3.0, 4.0]], "{text}");
            assert_eq!(table.rows.len(), 2, "{text}");
        }
        let united =
            TextTable::parse("range,el_deg,v,name\n[m],deg,m/s,-\n1.5,2.5,3.5,a\n").unwrap();
        assert_eq!(united.header, ["range [m]", "el_deg", "v [m/s]", "name"]);
        assert_eq!((united.rows.len(), united.number(0, 1)), (1, 2.5));
        assert_eq!(united.column("v"), Some(2));
        let joined = TextTable::parse("a,b\nm,s,\n1,2,\na,b\nm,s,\n3,4,\n").unwrap();
        assert_eq!((joined.rows.len(), joined.number(1, 1)), (2, 4.0));
        let words = TextTable::parse("a,b\nleft,m\n").unwrap();
        assert_eq!((words.header[1].as_str(), words.rows.len()), ("b", 1));
        let refused = TextTable::parse("Scan of 2024\na,b\n1,2\n").unwrap_err();
        assert!(
            refused.contains("the header 1 (\"Scan of 2024\")"),
            "{refused}"
        );
        let refused = TextTable::parse("# three, of, these\n1.0,2.0\n").unwrap_err();
        assert!(refused.contains("first line has 2 numbers"), "{refused}");
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
