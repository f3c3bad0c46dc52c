//! The program as a user calls it: words in, files and JSON out.

use super::ledger::Ledger;
use netcdf3::{DataVector, FileReader};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A program, and the folder in which a draw works.
pub(crate) struct Bench<'a> {
    pub(crate) program: &'a Path,
    pub(crate) folder: PathBuf,
}

/// How a command ended.
pub(crate) struct Ended {
    /// It did what it was asked for.
    pub(crate) is_good: bool,
    /// What it printed.
    pub(crate) stdout: String,
    /// Why not, and warnings.
    pub(crate) stderr: String,
}

impl Ended {
    /// What it printed as JSON.
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or(Value::Null)
    }
}

impl Bench<'_> {
    /// Runs a command on one thread.
    pub(crate) fn run(&self, words: &[&str]) -> Ended {
        self.run_on("1", words)
    }

    /// Runs a command on a number of threads.
    pub(crate) fn run_on(&self, threads: &str, words: &[&str]) -> Ended {
        let done = Command::new(self.program)
            .args(words)
            .args(["--threads", threads, "--quiet"])
            .current_dir(&self.folder)
            .stdin(Stdio::null())
            .output()
            .unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Ended {
            is_good: done.status.success(),
            stdout: text(&done.stdout),
            stderr: text(&done.stderr),
        }
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.folder.join(name), text).unwrap();
    }

    /// A command that a good scene must pass; where it does not, that is a fault of its own.
    pub(crate) fn must(&self, ledger: &mut Ledger, words: &[&str]) -> Option<Ended> {
        let ended = self.run(words);
        ledger.holds(
            "a scene that check passes runs",
            ended.is_good,
            &format!("{words:?}: {}", ended.stderr.trim()),
        );
        ended.is_good.then_some(ended)
    }

    /// A table that a command wrote; its columns count as seen.
    pub(crate) fn csv(&self, ledger: &mut Ledger, file: &str) -> Csv {
        let path = self.folder.join(file);
        let csv = Csv::parse(&std::fs::read_to_string(&path).unwrap_or_default());
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        csv.names
            .iter()
            .for_each(|column| ledger.saw(&name, column));
        csv
    }

    /// A NetCDF file that a command wrote; its variables count as seen.
    pub(crate) fn netcdf(&self, ledger: &mut Ledger, file: &str) -> Netcdf {
        let path = self.folder.join(file);
        let netcdf = Netcdf(FileReader::open(&path).unwrap());
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        netcdf
            .0
            .data_set()
            .get_var_names()
            .iter()
            .for_each(|variable| ledger.saw(&name, variable));
        netcdf
    }
}

/// A table: comment lines left out.
#[derive(Debug, Clone, Default)]
pub(crate) struct Csv {
    pub(crate) names: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Csv {
    fn parse(text: &str) -> Self {
        let mut lines = text.lines().filter(|l| !l.starts_with('#'));
        let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        Self {
            names: lines.next().map(cells).unwrap_or_default(),
            rows: lines.map(cells).collect(),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether all cells of another table are the same.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        self.names == other.names && self.rows == other.rows
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.names.iter().any(|n| n == name)
    }

    /// The words of a column.
    pub(crate) fn words(&self, name: &str) -> Vec<String> {
        let place = self.names.iter().position(|n| n == name);
        self.rows
            .iter()
            .map(|row| {
                place
                    .and_then(|at| row.get(at))
                    .cloned()
                    .unwrap_or_default()
            })
            .collect()
    }

    /// The numbers of a column; NaN where a cell is empty.
    pub(crate) fn f(&self, name: &str) -> Vec<f64> {
        self.words(name)
            .iter()
            .map(|word| word.parse().unwrap_or(f64::NAN))
            .collect()
    }
}

/// A classic NetCDF file.
pub(crate) struct Netcdf(FileReader);

impl Netcdf {
    /// The numbers of a variable; NaN where they are missing.
    pub(crate) fn f(&mut self, name: &str) -> Vec<f64> {
        let fill = self.attribute(name, "_FillValue");
        let values: Vec<f64> = match self.0.read_var(name) {
            Ok(DataVector::F64(v)) => v,
            Ok(DataVector::F32(v)) => v.into_iter().map(f64::from).collect(),
            Ok(DataVector::I32(v)) => v.into_iter().map(f64::from).collect(),
            Ok(DataVector::I16(v)) => v.into_iter().map(f64::from).collect(),
            Ok(DataVector::I8(v)) => v.into_iter().map(f64::from).collect(),
            _ => Vec::new(),
        };
        values
            .into_iter()
            .map(|v| if Some(v) == fill { f64::NAN } else { v })
            .collect()
    }

    fn attribute(&self, name: &str, attribute: &str) -> Option<f64> {
        let set = self.0.data_set();
        let doubles = set
            .get_var_attr_f64(name, attribute)
            .and_then(|v| v.first().copied());
        doubles.or_else(|| {
            set.get_var_attr_f32(name, attribute)
                .and_then(|v| v.first().map(|x| f64::from(*x)))
        })
    }

    /// A text of a variable.
    pub(crate) fn text(&self, name: &str, attribute: &str) -> String {
        self.0
            .data_set()
            .get_var_attr_as_string(name, attribute)
            .unwrap_or_default()
    }

    /// A text of the whole file.
    pub(crate) fn text_of_file(&self, attribute: &str) -> String {
        self.0
            .data_set()
            .get_global_attr_as_string(attribute)
            .unwrap_or_default()
    }

    pub(crate) fn names(&self) -> Vec<String> {
        self.0.data_set().get_var_names()
    }
}

/// A number of a JSON object, by the path of its keys; NaN where it is null or absent.
pub(crate) fn at(json: &Value, path: &str) -> f64 {
    path.split('.')
        .fold(json, |value, key| &value[key])
        .as_f64()
        .unwrap_or(f64::NAN)
}

/// The keys of a JSON object count as seen.
pub(crate) fn see(ledger: &mut Ledger, source: &str, object: &Value) {
    for (key, value) in object.as_object().into_iter().flatten() {
        if value.is_number() || value.is_null() {
            ledger.saw(source, key);
        }
    }
}
