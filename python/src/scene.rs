//! Dictionaries of Python as scenes and cases, and back: TOML has the same kinds of values.

use crate::error::raised;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::path::Path;
use toml::{Table, Value};
use wakescope_sim::cli::{refusal, refusal_of_value};
use wakescope_sim::scene::{Problem, SceneFile, preset_names, preset_toml};

/// Names of the lidars that `scene` knows.
#[pyfunction]
pub(crate) fn presets() -> Vec<&'static str> {
    preset_names().collect()
}

/// The scene of a preset, or the default one, with some keys changed, `{"section.key": value}`: all its keys.
#[pyfunction]
#[pyo3(signature = (preset, keys: "dict[str, object]") -> "dict[str, object]")]
pub(crate) fn scene<'py>(
    py: Python<'py>,
    preset: Option<&str>,
    keys: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyDict>> {
    let refused = |error: wakescope_sim::Error| raised(py, &refusal(error, false));
    let text = match preset {
        None => String::new(),
        Some(name) => preset_toml(name).ok_or_else(|| {
            let known: Vec<&str> = preset_names().collect();
            let allowed = format!("one of {}", known.join(", "));
            raised(py, &refusal_of_value(Problem::new("preset", name, allowed)))
        })?,
    };
    let mut table: Table =
        toml::from_str(&text).map_err(|error| PyTypeError::new_err(error.to_string()))?;
    for (key, value) in keys {
        let key: String = key.extract()?;
        set(&mut table, &key, value_of(&key, &value)?);
    }
    let file = SceneFile::parse(&table.to_string(), Path::new("scene")).map_err(refused)?;
    self::table(py, &file.toml)
}

/// The keys of a text in the format of scenes and cases.
#[pyfunction]
#[pyo3(signature = (text) -> "dict[str, object]")]
pub(crate) fn table<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyDict>> {
    dict_of(
        py,
        toml::from_str(text).map_err(|error| PyTypeError::new_err(error.to_string()))?,
    )
}

/// Puts a value where the path of its key says, in place of what there is; none takes it away.
fn set(table: &mut Table, path: &str, value: Option<Value>) {
    let Some((section, rest)) = path.split_once('.') else {
        match value {
            Some(value) => drop(table.insert(path.to_owned(), value)),
            None => drop(table.remove(path)),
        }
        return;
    };
    let inner = table
        .entry(section)
        .or_insert_with(|| Value::Table(Table::new()));
    match inner {
        Value::Table(inner) => set(inner, rest, value),
        other => {
            *other = Value::Table(Table::from_iter(
                value.map(|value| (rest.to_owned(), value)),
            ))
        }
    }
}

/// A dictionary as the text of a scene.
pub(crate) fn toml_of(dict: &Bound<'_, PyDict>) -> PyResult<String> {
    Ok(table_of("", dict)?.to_string())
}

fn table_of(path: &str, dict: &Bound<'_, PyDict>) -> PyResult<Table> {
    let mut table = Table::new();
    for (key, value) in dict {
        let key: String = key.extract()?;
        let here = if path.is_empty() {
            key.clone()
        } else {
            format!("{path}.{key}")
        };
        table.extend(value_of(&here, &value)?.map(|value| (key, value)));
    }
    Ok(table)
}

/// The value of a key; none for None, which stands for a key that is not there.
fn value_of(key: &str, value: &Bound<'_, PyAny>) -> PyResult<Option<Value>> {
    if value.is_none() {
        return Ok(None);
    }
    if let Ok(dict) = value.cast::<PyDict>() {
        return Ok(Some(Value::Table(table_of(key, dict)?)));
    }
    if let Ok(value) = value.extract::<bool>() {
        return Ok(Some(Value::Boolean(value)));
    }
    if let Ok(value) = value.extract::<i64>() {
        return Ok(Some(Value::Integer(value)));
    }
    if let Ok(value) = value.extract::<f64>() {
        return Ok(Some(Value::Float(value)));
    }
    if let Ok(value) = value.extract::<String>() {
        return Ok(Some(Value::String(value)));
    }
    if let Ok(path) = value.extract::<std::path::PathBuf>() {
        return Ok(Some(Value::String(path.to_string_lossy().into_owned())));
    }
    let no_value = || {
        PyTypeError::new_err(format!(
            "{key}: {value} is neither a number, a text, a list nor a dictionary"
        ))
    };
    let mut list = Vec::new();
    for (place, value) in value.try_iter().map_err(|_| no_value())?.enumerate() {
        list.extend(value_of(&format!("{key}[{place}]"), &value?)?);
    }
    Ok(Some(Value::Array(list)))
}

fn dict_of(py: Python<'_>, table: Table) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    table
        .into_iter()
        .try_for_each(|(key, value)| dict.set_item(key, object_of(py, value)?))?;
    Ok(dict)
}

fn object_of(py: Python<'_>, value: Value) -> PyResult<Bound<'_, PyAny>> {
    Ok(match value {
        Value::Table(table) => dict_of(py, table)?.into_any(),
        Value::Array(values) => {
            let values = values
                .into_iter()
                .map(|value| object_of(py, value))
                .collect::<PyResult<Vec<_>>>()?;
            PyList::new(py, values)?.into_any()
        }
        Value::Boolean(value) => value.into_pyobject(py)?.to_owned().into_any(),
        Value::Integer(value) => value.into_pyobject(py)?.into_any(),
        Value::Float(value) => value.into_pyobject(py)?.into_any(),
        Value::String(text) => text.into_pyobject(py)?.into_any(),
        Value::Datetime(time) => time.to_string().into_pyobject(py)?.into_any(),
    })
}
