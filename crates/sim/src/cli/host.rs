//! Another program that runs commands in its own process, with their arguments: it receives what a terminal would show, may keep the files
//! in memory, and gives scenes as texts and signals as arrays.
//!
//! Check: the files that are kept are those that the command writes, byte for byte.

use super::options::OF_KEPT_FILES;
use super::output::{as_object, explained, print};
use super::progress::Bars;
use super::{Cli, dispatch, with_threads};
use crate::Error;
use crate::flow::{CaseFile, WakePreset};
use crate::io::raw::RawRecords;
use crate::io::{Existing, Provenance, text_file, write_atomic};
use crate::keys::Problem;
use crate::outputs::{self, Outputs};
use crate::progress::{Observer, stoppable};
use crate::scene::{Outputs as Formats, SceneFile};
use crate::sweep::{Request, Sweep};
use serde_json::Value;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// What a program gives to a command that it runs.
pub struct Host {
    /// Who is notified of progress and warnings; it may stop the run.
    pub observer: Arc<dyn Observer + Send>,
    /// Texts of scenes and cases, by the arguments in place of their files.
    pub texts: BTreeMap<PathBuf, String>,
    /// Signals, whose path is the argument in place of a file.
    pub signals: Mutex<Option<RawRecords>>,
    /// Whether files of `--out` stay in memory; those of flows, wakes and sweeps, which can be continued, are written.
    pub keeps_files: bool,
}

/// What a command gives to the program that runs it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Answer {
    /// The exit code: 1 where no value of a setting has the requested accuracy.
    pub code: u8,
    /// The object that `--json` prints; null for a command that prints a text alone.
    pub object: Value,
    /// What a person would read.
    pub text: String,
    /// Names and contents of the files, where they are kept.
    pub files: Vec<(String, Vec<u8>)>,
}

/// Why a command failed: the object that `--json` prints, with the whole text as `error`, and `problems`, each with its `file`,
/// `line`, `key`, `value` and what is `allowed`.
pub type Refusal = Value;

/// The refusal of a value of a scene that is not allowed.
pub fn refusal_of_value(problem: Problem) -> Refusal {
    as_object(&Error::Invalid {
        path: "scene".into(),
        problems: vec![problem],
    })
}

/// The refusal of an error; without `lines` where nobody wrote the text that has them.
pub fn refusal(mut error: Error, lines: bool) -> Refusal {
    if let (Error::Invalid { problems, .. }, false) = (&mut error, lines) {
        for problem in problems {
            problem.line = None;
        }
    }
    as_object(&error)
}

/// Runs a command in this process, with its arguments as after `wakescope`.
///
/// # Errors
/// Words that the command line does not know, and whatever the command refuses; [`Error::Stopped`] where the observer stopped it.
pub fn call(args: &[OsString], host: Host) -> Result<Answer, Refusal> {
    let args = [OsString::from("wakescope")]
        .into_iter()
        .chain(args.iter().cloned());
    let mut cli = Cli::read(args).map_err(|error| explained(&error))?;
    let has_texts = !host.texts.is_empty();
    cli.quiet = true;
    cli.json = true;
    cli.host = Some(host);
    let done = stoppable(|| with_threads(&cli, || dispatch(&cli)).flatten());
    let code = done.map_err(|error| refusal(error, !has_texts))?;
    Ok(Answer {
        code,
        ..std::mem::take(&mut *cli.answer())
    })
}

/// Where commands read and write.
impl Cli {
    fn answer(&self) -> std::sync::MutexGuard<'_, Answer> {
        self.answer.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Who is notified of the progress: the program that called, else progress bars, unless `--quiet` is given.
    pub(super) fn observer(&self) -> Arc<dyn Observer + Send> {
        match &self.host {
            Some(host) => host.observer.clone(),
            None => Arc::new(Bars::new(self.quiet)),
        }
    }

    /// Gives a result: as the object, or as the text.
    pub(super) fn say(&self, object: &Value, text: &str) -> Result<(), Error> {
        match &self.host {
            Some(_) => {
                let mut answer = self.answer();
                answer.object = object.clone();
                answer.text = text.to_owned();
                Ok(())
            }
            None if self.json => print(&format!("{object:#}\n")),
            None => print(&format!("{}\n", text.trim_end())),
        }
    }

    /// Gives a text as it is.
    pub(super) fn print(&self, text: &str) -> Result<(), Error> {
        if self.host.is_none() {
            return print(text);
        }
        text.clone_into(&mut self.answer().text);
        Ok(())
    }

    /// The text of a scene or a case: what the program that called has for its path, else that of the file.
    pub(super) fn text(&self, path: &Path) -> Result<Cow<'_, str>, Error> {
        if let Some(host) = &self.host
            && let Some(text) = host.texts.get(path)
        {
            return Ok(text.into());
        }
        let text = text_file::read(path).map_err(|source| Error::Unreadable {
            path: path.to_owned(),
            source,
        })?;
        Ok(text.into())
    }

    /// The scene of a path, with the seed of the command line.
    pub(super) fn scene(&self, path: &Path) -> Result<SceneFile, Error> {
        let file = SceneFile::parse(&self.text(path)?, path)?;
        match self.seed {
            Some(seed) => Ok(file.with(crate::scene::Scene {
                seed,
                ..file.content.clone()
            })?),
            None => Ok(file),
        }
    }

    /// The cases of a sweep over the scene of a path.
    pub(super) fn sweep(&self, path: &Path, request: &Request) -> Result<Sweep, Error> {
        Sweep::parse(&self.text(path)?, path, request)
    }

    /// Whether a path is that of the case of a flow, by its keys, and not of a scene.
    pub(super) fn is_case(&self, path: &Path) -> bool {
        self.text(path).is_ok_and(|text| CaseFile::is_of(&text))
    }

    /// The flow case of a path; keys that it lacks are those of the preset, if there is one.
    pub(super) fn case(&self, path: &Path, preset: Option<WakePreset>) -> Result<CaseFile, Error> {
        let text = self.text(path)?;
        CaseFile::parse_over(preset, &text, path)
    }

    /// The signals of a path, if the calling program supplies them.
    pub(super) fn signals(&self, path: &Path) -> Option<RawRecords> {
        let mut held = self
            .host
            .as_ref()?
            .signals
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        held.take_if(|records| records.path == path)
    }

    /// Whether files stay in memory.
    fn keeps_files(&self) -> bool {
        self.host.as_ref().is_some_and(|host| host.keeps_files)
    }

    /// Finds out whether files of these names can be written to a folder.
    pub(super) fn prepare(
        &self,
        folder: &Path,
        names: &[String],
        existing: Existing,
    ) -> Result<(), Error> {
        if self.keeps_files() {
            self.refuse_idle("--out", OF_KEPT_FILES)
        } else {
            outputs::prepare(folder, names, existing, true)
        }
    }

    /// Writes the files of a list to a folder, or keeps them; returns their paths.
    pub(super) fn write(
        &self,
        folder: &Path,
        existing: Existing,
        of: (Formats, Provenance),
        list: impl FnOnce(&mut Outputs) -> Result<(), Error>,
    ) -> Result<Vec<PathBuf>, Error> {
        if !self.keeps_files() {
            return Outputs::write(folder, existing, of, list);
        }
        let files = Outputs::contents(of.0, Some(of.1), list)?;
        let names = files.iter().map(|(name, _)| name.into()).collect();
        self.answer().files.extend(files);
        Ok(names)
    }

    /// Finds out whether a file can be written.
    pub(super) fn prepare_file(&self, path: &Path, existing: Existing) -> Result<(), Error> {
        let name = path
            .file_name()
            .and_then(|name| name.to_str())
            .filter(|_| !self.keeps_files());
        existing.check(path.parent().unwrap_or(Path::new("")), name)
    }

    /// Writes a file, or keeps it.
    pub(super) fn write_file(&self, path: &Path, content: String) -> Result<(), Error> {
        if !self.keeps_files() {
            return write_atomic(path, content);
        }
        self.answer()
            .files
            .push((path.display().to_string(), content.into()));
        Ok(())
    }
}
