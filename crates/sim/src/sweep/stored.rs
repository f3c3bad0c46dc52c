//! A sweep on disk: what it is, and a folder for each case with its scene and result.
//!
//! A result is there when `result.json` is: it is written last, and put into place by its name. Its numbers are the
//! texts of the table, so that a table has the same bytes whoever computed its cases. Check: shards, kills, edited files.

use super::cases::{Case, Sweep};
use super::key_path::VaryingKey;
use super::results::results as columns;
use crate::io::{Existing, Provenance, csv::float_text, text_file, write_atomic};
use crate::scene::Outputs;
use crate::{Error, outputs};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Name of the file that says what a sweep is.
pub(super) const SWEEP: &str = "sweep.json";
const RESULT: &str = "result.json";
const SCENE: &str = "scene.toml";

/// The result of a case, each value as the text of a cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct CaseResult {
    source: String,
    pub(super) scene_hash: String,
    pub(super) case: usize,
    keys: BTreeMap<String, String>,
    circulation: bool,
    results: BTreeMap<String, String>,
}

impl CaseResult {
    /// A result as a number; NaN where it is none.
    pub(super) fn result(&self, name: &str) -> f64 {
        self.results
            .get(name)
            .and_then(|cell| cell.parse().ok())
            .unwrap_or(f64::NAN)
    }

    /// A key that varies as a number.
    pub(super) fn key(&self, name: &str) -> f64 {
        self.text(name).parse().unwrap_or(f64::NAN)
    }

    /// A key that varies as a text.
    pub(super) fn text(&self, name: &str) -> &str {
        self.keys.get(name).map_or("", String::as_str)
    }
}

/// What a sweep is, as its folder says it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Definition {
    pub(super) source: String,
    seed: u64,
    pub(super) sweep_hash: String,
    scene: String,
    pub(super) keys: Vec<VaryingKey>,
    /// Whether the circulation is fitted to each map.
    pub(super) circulation: bool,
    pub(super) scene_hashes: Vec<String>,
}

impl Definition {
    pub(super) fn from_sweep(sweep: &Sweep, fits: bool) -> Self {
        let Provenance {
            program,
            scene_toml,
            scene_hash,
            seed,
        } = sweep.origin.clone();
        Self {
            source: program,
            seed,
            sweep_hash: scene_hash,
            scene: scene_toml,
            keys: sweep.keys.clone(),
            circulation: fits,
            scene_hashes: sweep
                .cases
                .iter()
                .map(|case| case.scene.hash.clone())
                .collect(),
        }
    }

    pub(super) fn origin(&self) -> Provenance {
        let program = self.source.clone();
        Provenance {
            program,
            ..Provenance::new(&self.scene, &self.sweep_hash, self.seed)
        }
    }

    /// Names of the keys that are free, and what they hold.
    #[cfg(feature = "plots")]
    pub(super) fn free(&self) -> impl Iterator<Item = &VaryingKey> {
        self.keys.iter().filter(|key| !key.tied)
    }

    /// Refuses a folder of another sweep.
    ///
    /// # Errors
    /// Its file, and what is to be done.
    pub(super) fn refuse_other(&self, folder: &Path) -> Result<(), Error> {
        let path = folder.join(SWEEP);
        if !path.exists() || self.is_in(folder) {
            return Ok(());
        }
        let reason = "it is of another sweep, of another version of the program or not all with or without \
                      --no-circulation: take another folder, or replace it with --overwrite";
        Err(Error::input(&path, reason))
    }

    /// Writes it into a folder, unless it is there: shards may begin at the same time.
    ///
    /// # Errors
    /// What the system says.
    pub(super) fn write(&self, folder: &Path) -> Result<(), Error> {
        if self.is_in(folder) {
            return Ok(());
        }
        std::fs::create_dir_all(folder).map_err(Error::io("make the folder", folder))?;
        write_atomic(&folder.join(SWEEP), format!("{:#}\n", json!(self)))
    }

    pub(super) fn read(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(SWEEP);
        let text = text_file::read(&path).map_err(Error::io("read what was swept from", &path))?;
        let reason = "it does not say what was swept, as `wakescope sweep --out` writes it";
        serde_json::from_str(&text).map_err(|_| Error::input(&path, reason))
    }

    pub(super) fn is_same(&self, other: &Self) -> bool {
        (&self.source, &self.sweep_hash) == (&other.source, &other.sweep_hash)
            && (&self.scene_hashes, self.circulation) == (&other.scene_hashes, other.circulation)
    }

    /// Whether a folder holds this sweep.
    pub(super) fn is_in(&self, folder: &Path) -> bool {
        Self::read(folder).is_ok_and(|there| self.is_same(&there))
    }

    /// Puts the result of a case into its folder, all of it or nothing.
    ///
    /// # Errors
    /// What the system says; an existing file that may not be replaced.
    pub(super) fn store(
        &self,
        folder: &Path,
        case: &Case,
        results: &[f64],
        existing: Existing,
    ) -> Result<(), Error> {
        let mut row = CaseResult {
            source: crate::PROGRAM.into(),
            scene_hash: case.scene.hash.clone(),
            case: case.index,
            keys: BTreeMap::new(),
            circulation: self.circulation,
            results: BTreeMap::new(),
        };
        for (key, value) in self.keys.iter().zip(&case.values) {
            row.keys.insert(key.name.clone(), value.clone());
        }
        for ((name, ..), result) in columns().zip(results) {
            row.results.insert(name.to_owned(), float_text(*result));
        }
        let of = (Outputs::default(), case.scene.provenance());
        outputs::Outputs::write(&folder_of(folder, case.index), existing, of, |files| {
            files.add(SCENE, Some(case), |_, origin| Ok(origin.scene_file()))?;
            files.add(RESULT, Some(&row), |row, _| {
                Ok(format!("{:#}\n", json!(row)))
            })
        })
        .map(drop)
    }

    /// The result of a case in a folder; none where there is none of this scene by this version of the program.
    pub(super) fn stored(&self, folder: &Path, case: usize) -> Option<CaseResult> {
        let text = text_file::read(&folder_of(folder, case).join(RESULT)).ok()?;
        let row: CaseResult = serde_json::from_str(&text).ok()?;
        let is_this = (row.case, row.circulation) == (case, self.circulation)
            && (Some(&row.scene_hash), &row.source) == (self.scene_hashes.get(case), &self.source)
            && self.keys.iter().all(|key| row.keys.contains_key(&key.name))
            && columns().all(|(name, ..)| row.results.contains_key(name));
        is_this.then_some(row)
    }
}

/// Names of the files of a case in the folder of its sweep.
pub(super) fn case_files(case: usize) -> impl Iterator<Item = String> {
    [SCENE, RESULT]
        .into_iter()
        .map(move |name| format!("cases/{case:05}/{name}"))
}

/// The folder of a case.
fn folder_of(folder: &Path, case: usize) -> PathBuf {
    folder.join("cases").join(format!("{case:05}"))
}
