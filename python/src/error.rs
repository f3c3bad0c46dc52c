//! What is refused as an exception of Python.

use pyo3::prelude::*;
use wakescope_sim::cli::Refusal;

/// The exception of a command that was refused.
pub(crate) fn raised(py: Python<'_>, refusal: &Refusal) -> PyErr {
    let class = py
        .import("wakescope")
        .and_then(|module| module.getattr("WakescopeError"));
    match class.and_then(|class| class.call_method1("_of", (refusal.to_string(),))) {
        Ok(error) => PyErr::from_value(error),
        Err(error) => error,
    }
}
