//! A sweep on disk: what it is, and a folder for each case with its scene and result.
//!
//! A result is there when `result.json` is: it is written last, and put into place by its name. Numbers stand in it as the
//! texts of the table, so that a table has the same bytes whoever computed its cases. Check: shards, kills, edited files.

use super::cases::Sweep;
use super::key_path::Takes;
use super::results::RESULTS;
use crate::io::{Existing, Provenance, csv::float_text, write_atomic};
use crate::scene::Outputs;
use crate::{Error, outputs};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

/// Name of the file that says what a sweep is.
pub(super) const SWEEP: &str = "sweep.json";
const RESULT: &str = "result.json";

/// What a column of keys holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Holds {
    Numbers,
    WholeNumbers,
    Texts,
}

/// A key that varies.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct VaryingKey {
    pub(super) name: String,
    pub(super) holds: Holds,
    /// Whether others determine it.
    pub(super) tied: bool,
}

/// The result of a case, each value as the text of a cell.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Row {
    pub(super) case: usize,
    pub(super) scene_hash: String,
    pub(super) keys: Vec<String>,
    pub(super) results: Vec<String>,
}

impl Row {
    /// A result as a number; NaN where it is none.
    pub(super) fn result(&self, name: &str) -> f64 {
        let place = RESULTS.iter().position(|(column, ..)| *column == name);
        place.and_then(|place| self.results.get(place)).map_or(f64::NAN, |cell| number(cell))
    }

    /// A key that varies as a number.
    pub(super) fn key(&self, place: usize) -> f64 {
        self.keys.get(place).map_or(f64::NAN, |cell| number(cell))
    }
}

fn number(cell: &str) -> f64 {
    cell.parse().unwrap_or(f64::NAN)
}

/// What a sweep is, as its folder says it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Definition {
    pub(super) origin: Provenance,
    pub(super) keys: Vec<VaryingKey>,
    pub(super) scene_hashes: Vec<String>,
    /// Whether the circulation is fitted to each map.
    pub(super) fits: bool,
}

impl Definition {
    pub(super) fn of(sweep: &Sweep, fits: bool) -> Self {
        let holds = |takes: &Takes| match takes {
            Takes::Number => Holds::Numbers,
            Takes::Whole { .. } => Holds::WholeNumbers,
            _ => Holds::Texts,
        };
        Self {
            origin: sweep.origin.clone(),
            keys: sweep
                .columns
                .iter()
                .map(|column| VaryingKey {
                    name: column.name.clone(),
                    holds: holds(&column.key.takes),
                    tied: column.tied,
                })
                .collect(),
            scene_hashes: sweep.cases.iter().map(|case| case.scene.hash.clone()).collect(),
            fits,
        }
    }

    /// Places and names of the keys that are free.
    #[cfg(feature = "plots")]
    pub(super) fn free(&self) -> impl Iterator<Item = (usize, &str)> {
        let keys = self.keys.iter().enumerate().filter(|(_, key)| !key.tied);
        keys.map(|(place, key)| (place, key.name.as_str()))
    }

    fn to_json(&self) -> String {
        let holds = |holds: Holds| match holds {
            Holds::Numbers => "numbers",
            Holds::WholeNumbers => "whole numbers",
            Holds::Texts => "texts",
        };
        let key = |key: &VaryingKey| json!({ "key": key.name, "holds": holds(key.holds), "tied": key.tied });
        let keys: Vec<Value> = self.keys.iter().map(key).collect();
        let object = json!({
            "source": self.origin.program, "seed": self.origin.seed, "sweep_hash": self.origin.scene_hash,
            "scene": self.origin.scene_toml, "keys": keys, "circulation": self.fits,
            "scene_hashes": self.scene_hashes,
        });
        format!("{object:#}\n")
    }

    /// Writes it into a folder, unless it is there: shards may begin at the same time.
    ///
    /// # Errors
    /// Another sweep that is there and may not be replaced; what the system says.
    pub(super) fn write(&self, folder: &Path, existing: Existing) -> Result<(), Error> {
        let (path, text) = (folder.join(SWEEP), self.to_json());
        std::fs::create_dir_all(folder).map_err(|source| Error::Io {
            action: "make the folder",
            path: folder.to_owned(),
            source,
        })?;
        if path.exists() {
            let there = Self::read(folder).ok();
            if there.as_ref() == Some(self) {
                return Ok(());
            }
            let is_same = there.is_some_and(|there| self.is_same(&there));
            if existing == Existing::Own && !is_same {
                let reason = "it is of another sweep, of another version of the program or not all with or without \
                              --no-circulation: take another folder, or replace it with --overwrite";
                return Err(Error::Input { path, reason: reason.into() });
            }
        }
        Ok(write_atomic(&path, text)?)
    }

    pub(super) fn read(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(SWEEP);
        let text = crate::io::text_file::read(&path).map_err(|source| Error::Io {
            action: "read what was swept from",
            path: path.clone(),
            source,
        })?;
        serde_json::from_str(&text).ok().and_then(|object: Value| Self::of_json(&object)).ok_or_else(|| Error::Input {
            path,
            reason: "it does not say what was swept, as `wakescope sweep --out` writes it".into(),
        })
    }

    fn of_json(object: &Value) -> Option<Self> {
        let text = |name: &str| Some(object.get(name)?.as_str()?.to_owned());
        let key = |key: &Value| {
            let holds = match key.get("holds")?.as_str()? {
                "numbers" => Holds::Numbers,
                "whole numbers" => Holds::WholeNumbers,
                _ => Holds::Texts,
            };
            Some(VaryingKey { name: key.get("key")?.as_str()?.to_owned(), holds, tied: key.get("tied")?.as_bool()? })
        };
        let hashes = object.get("scene_hashes")?.as_array()?.iter();
        Some(Self {
            origin: Provenance {
                program: text("source")?,
                scene_toml: text("scene")?,
                scene_hash: text("sweep_hash")?,
                seed: object.get("seed")?.as_u64()?,
            },
            keys: object.get("keys")?.as_array()?.iter().map(key).collect::<Option<_>>()?,
            scene_hashes: hashes.map(|hash| hash.as_str().map(str::to_owned)).collect::<Option<_>>()?,
            fits: object.get("circulation")?.as_bool()?,
        })
    }

    pub(super) fn is_same(&self, other: &Self) -> bool {
        (&self.origin.program, &self.origin.scene_hash) == (&other.origin.program, &other.origin.scene_hash)
            && (&self.scene_hashes, self.fits) == (&other.scene_hashes, other.fits)
    }
}

/// The folder of a case.
fn folder_of(folder: &Path, case: usize) -> PathBuf {
    folder.join("cases").join(format!("{case:05}"))
}

/// Puts the result of a case into its folder, all of it or nothing.
///
/// # Errors
/// What the system says; a file of somebody else in the way.
pub(super) fn store(
    folder: &Path,
    sweep: &Sweep,
    case: usize,
    results: &[f64],
    (fits, existing): (bool, Existing),
) -> Result<(), Error> {
    let Some(of) = sweep.cases.get(case) else { return Ok(()) };
    let keys: Map<String, Value> = sweep.keys().map(str::to_owned).zip(of.values.iter().map(|v| json!(v))).collect();
    let names = RESULTS.iter().map(|(name, ..)| (*name).to_owned());
    let results: Map<String, Value> = names.zip(results.iter().map(|value| json!(float_text(*value)))).collect();
    let object = json!({
        "source": crate::PROGRAM, "scene_hash": of.scene.hash, "case": case, "keys": keys, "circulation": fits,
        "results": results,
    });
    let (path, formats) = (folder_of(folder, case), Outputs::default());
    outputs::Outputs::write(&path, existing, (formats, of.scene.provenance()), |files| {
        files.add("scene.toml", Some(of), |_, origin| Ok(origin.scene_file()))?;
        files.add(RESULT, Some(&object), |object, _| Ok(format!("{object:#}\n")))
    })
    .map(drop)
}

/// The result of a case in a folder; none where there is none of this scene by this version of the program.
pub(super) fn stored(folder: &Path, definition: &Definition, case: usize) -> Option<Row> {
    let text = crate::io::text_file::read(&folder_of(folder, case).join(RESULT)).ok()?;
    let object: Value = serde_json::from_str(&text).ok()?;
    let hash = object.get("scene_hash")?.as_str()?;
    let is_this = definition.scene_hashes.get(case)? == hash
        && object.get("source")?.as_str()? == definition.origin.program
        && object.get("case")?.as_u64()? == case as u64
        && object.get("circulation")?.as_bool()? == definition.fits;
    let cell = |part: &str, name: &str| Some(object.get(part)?.get(name)?.as_str()?.to_owned());
    let keys = definition.keys.iter().map(|key| cell("keys", &key.name)).collect::<Option<_>>()?;
    let results = RESULTS.iter().map(|(name, ..)| cell("results", name)).collect::<Option<_>>()?;
    is_this.then(|| Row { case, scene_hash: hash.to_owned(), keys, results })
}
