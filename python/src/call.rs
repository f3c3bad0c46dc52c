//! A command on a thread of its own. The thread that called waits for it, hands on what it tells, and looks for Ctrl-C meanwhile.

use crate::error::raised;
use crate::progress::{Event, Teller};
use crate::scene::toml_of;
use crate::signals::samples;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;
use wakescope_sim::cli::{self, Answer, Host, Refusal};

/// How often the thread that called looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);
/// How long it waits for a command that was told to stop; one that does not hear it ends by itself later, unheard.
const PATIENCE: Duration = Duration::from_millis(500);
/// As the main thread of a program has.
const STACK_BYTES: usize = 8 << 20;

/// The exit code, the object as JSON, the text, and the files with their contents.
type Answered<'py> = (u8, String, String, Vec<(String, Bound<'py, PyBytes>)>);

/// Runs a command with the words of its command line. `texts` are dictionaries of scenes and cases by the words that stand for them,
/// `signals` an array for the word "signals". With `keep` the files stay in memory. `progress` is called with the name of a stage,
/// the part of it that is done and a text. Returns the exit code, an object as JSON, the text and the files.
#[pyfunction]
#[pyo3(signature = (words, texts: "dict[str, dict[str, object]]", signals, keep, progress))]
pub(crate) fn call<'py>(
    py: Python<'py>,
    words: Vec<OsString>,
    texts: BTreeMap<PathBuf, Bound<'py, PyDict>>,
    signals: Option<Bound<'py, PyAny>>,
    keep: bool,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Answered<'py>> {
    let (sender, events) = channel();
    let stopped = Arc::new(AtomicBool::new(false));
    let host = Host {
        observer: Arc::new(Teller::new(sender.clone(), stopped.clone())),
        texts: texts
            .into_iter()
            .map(|(word, of)| Ok((word, toml_of(&of)?)))
            .collect::<PyResult<_>>()?,
        signals: Mutex::new(signals.map(|array| samples(&array)).transpose()?),
        keeps_files: keep,
    };
    let work = move || {
        // Nobody may hear it any more.
        let _ = sender.send(Event::Done(Box::new(cli::call(&words, host))));
    };
    thread::Builder::new()
        .name("wakescope".into())
        .stack_size(STACK_BYTES)
        .spawn(work)?;
    let events = Mutex::new(events);
    let answer = match wait(py, &events, progress.as_ref()) {
        Ok(answer) => answer,
        Err(error) => {
            stopped.store(true, Ordering::Relaxed);
            py.detach(|| let_end(&events));
            return Err(error);
        }
    };
    let Answer {
        code,
        object,
        text,
        files,
    } = answer.map_err(|refusal| raised(py, &refusal))?;
    let files = files
        .into_iter()
        .map(|(name, content)| (name, PyBytes::new(py, &content)))
        .collect();
    Ok((code, object.to_string(), text, files))
}

/// Waits for a command and hands on what it tells.
fn wait(
    py: Python<'_>,
    events: &Mutex<Receiver<Event>>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Result<Answer, Refusal>> {
    loop {
        match py.detach(|| next(events, LOOK)) {
            Ok(Event::Done(answer)) => return Ok(*answer),
            Ok(Event::Warning(text)) => warn(py, &text)?,
            Ok(Event::Progress { stage, part, text }) => {
                progress
                    .map(|progress| progress.call1((stage, part, text)))
                    .transpose()?;
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err(
                    "the command broke off: this is a fault of wakescope",
                ));
            }
        }
        py.check_signals()?;
    }
}

fn next(events: &Mutex<Receiver<Event>>, longest: Duration) -> Result<Event, RecvTimeoutError> {
    events
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .recv_timeout(longest)
}

/// Waits until a command that was told to stop has ended, but not for long.
fn let_end(events: &Mutex<Receiver<Event>>) {
    let begun = std::time::Instant::now();
    while begun.elapsed() < PATIENCE
        && !matches!(
            next(events, LOOK),
            Ok(Event::Done(_)) | Err(RecvTimeoutError::Disconnected)
        )
    {}
}

fn warn(py: Python<'_>, text: &str) -> PyResult<()> {
    // At the line that called the function of the layer.
    let level = PyDict::new(py);
    level.set_item("stacklevel", 3)?;
    py.import("warnings")?
        .call_method("warn", (text,), Some(&level))
        .map(drop)
}
