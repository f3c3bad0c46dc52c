//! What the program prints: results to standard output, errors to standard error, as text or as JSON.

use crate::Error;
use clap::error::ContextKind;
use serde_json::{Value, json};
use std::io::{ErrorKind, Write as _};
use std::path::Path;

/// Prints a text to standard output; a pipe that nobody reads any more is no error, a full disk is.
///
/// # Errors
/// What the system says.
pub(super) fn print(text: &str) -> Result<(), Error> {
    let mut out = std::io::stdout().lock();
    // What is still in the buffer at the end of the program would be lost without a word.
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(source) if source.kind() != ErrorKind::BrokenPipe => {
            // Results are printed last.
            let message = format!("{source}; the files of this command are in place");
            let source = std::io::Error::new(source.kind(), message);
            Err(Error::Io {
                action: "write to",
                path: "standard output".into(),
                source,
            })
        }
        _ => Ok(()),
    }
}

/// Paths for an object, whatever bytes their names are of.
pub(super) fn paths<P: AsRef<Path>>(paths: &[P]) -> Vec<String> {
    paths
        .iter()
        .map(|path| path.as_ref().display().to_string())
        .collect()
}

/// Prints an error to standard error; nothing can be done where that fails.
pub(super) fn complain(error: &Error, as_json: bool) {
    let text = if as_json {
        format!("{:#}", as_object(error))
    } else {
        format!("error: {error}")
    };
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Words that the command line does not know, or help; returns the exit code.
pub(super) fn explain(error: &clap::Error, as_json: bool) -> u8 {
    let printed = if error.use_stderr() && as_json {
        writeln!(std::io::stderr(), "{:#}", explained(error))
    } else {
        // Help and version are no errors and go to standard output; clap knows which is which.
        error.print()
    };
    match printed {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => 2,
        _ => error.exit_code() as u8,
    }
}

/// Words that the command line does not know, as an object.
pub(super) fn explained(error: &clap::Error) -> Value {
    let text = error.render().to_string();
    let text = text.trim_end().trim_start_matches("error: ");
    let mut problems = Vec::new();
    if let Some(key) = error.get(ContextKind::InvalidArg) {
        let value = error
            .get(ContextKind::InvalidValue)
            .map(ToString::to_string);
        // What the reader of the value says is less than the whole text.
        let allowed =
            std::error::Error::source(error).map_or_else(|| text.to_owned(), ToString::to_string);
        problems.push(
            json!({ "file": null, "line": null, "key": key.to_string(), "value": value, "allowed": allowed }),
        );
    }
    json!({ "error": text, "problems": problems })
}

/// An error as an object: the whole message, and each problem with its file, line, key, value and what is allowed.
pub(super) fn as_object(error: &Error) -> Value {
    json!({ "error": error.to_string(), "problems": problems(error) })
}

fn problems(error: &Error) -> Vec<Value> {
    match error {
        Error::Invalid { path, problems } => {
            let mut objects = Vec::with_capacity(problems.len());
            for problem in problems {
                let mut object = problem_object(path, problem.line, &problem.allowed);
                object["key"] = json!(problem.key);
                object["value"] = json!(problem.value);
                objects.push(object);
            }
            objects
        }
        Error::Malformed {
            path,
            line,
            message,
        } => vec![problem_object(path, Some(*line), message)],
        Error::Input { path, reason } => vec![problem_object(path, None, reason)],
        Error::Unreadable { path, source } | Error::Io { path, source, .. } => {
            vec![problem_object(path, None, &source.to_string())]
        }
        Error::Case { source, .. } | Error::Flight { source, .. } => problems(source),
        Error::OfKey { key, source } => {
            let mut found = problems(source);
            for problem in &mut found {
                problem["key"] = json!(key);
            }
            found
        }
        _ => Vec::new(),
    }
}

/// A problem of a file without a key.
fn problem_object(file: &Path, line: Option<usize>, allowed: &str) -> Value {
    json!({ "file": file.to_string_lossy(), "line": line, "key": null, "value": null, "allowed": allowed })
}
