//! Arrays of numpy as signals: records are read piece by piece where they lie, so that the array is never copied as a whole.

use num_complex::Complex;
use numpy::{Complex64, PyReadonlyArray2};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PySlice;
use std::ops::Range;
use std::path::Path;
use wakescope_sim::io::number::middle_code;
use wakescope_sim::io::raw::{RawRecords, RecordSource};

/// An array \[record, sample\].
#[derive(Debug)]
struct NumpyRecords(Py<PyAny>);

impl NumpyRecords {
    fn piece(
        &self,
        py: Python<'_>,
        records: Range<usize>,
        samples: Range<usize>,
    ) -> PyResult<Vec<Complex<f64>>> {
        let slice =
            |part: Range<usize>| PySlice::new(py, part.start as isize, part.end as isize, 1);
        let piece = self.0.bind(py).get_item((slice(records), slice(samples)))?;
        let piece: PyReadonlyArray2<'_, Complex64> =
            piece.call_method1("astype", ("complex128",))?.extract()?;
        Ok(piece.as_array().iter().copied().collect())
    }
}

impl RecordSource for NumpyRecords {
    fn read(
        &mut self,
        records: Range<usize>,
        samples: Range<usize>,
    ) -> Result<Vec<Complex<f64>>, String> {
        let piece = Python::try_attach(|py| self.piece(py, records, samples));
        piece
            .ok_or("Python has ended")?
            .map_err(|error| error.to_string())
    }
}

/// The records of an array, whose last dimension are the samples of one.
pub(crate) fn samples(array: &Bound<'_, PyAny>) -> PyResult<RawRecords> {
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if !["f", "c", "i", "u"].contains(&kind.as_str()) {
        return Err(PyTypeError::new_err(format!(
            "signals: an array of real, complex or whole numbers is needed, this one is of {kind}"
        )));
    }
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    let Some((&samples, before)) = shape.split_last() else {
        return Err(PyValueError::new_err(
            "signals: a single number is no record",
        ));
    };
    // Two dimensions are taken as they lie in memory; more than these are one after the other.
    let is_plain =
        before.len() < 2 || array.getattr("flags")?.getattr("c_contiguous")?.extract()?;
    if !is_plain {
        return Err(PyValueError::new_err(
            "signals: numpy.ascontiguousarray makes an array that is read without a copy",
        ));
    }
    let records: usize = before.iter().product();
    let plane = array.call_method1("reshape", (records, samples))?;
    let are_integers = kind == "i" || kind == "u";
    let bytes: i32 = array.getattr("dtype")?.getattr("itemsize")?.extract()?;
    let source = NumpyRecords(plane.unbind());
    let shape = [records, samples];
    let mut out = RawRecords::new(
        Path::new("signals"),
        source,
        shape,
        kind == "c",
        are_integers,
    );
    if kind == "u" && bytes <= 4 {
        let zero = middle_code(8 * bytes);
        out.zero = Complex::new(zero, zero);
    }
    Ok(out)
}
