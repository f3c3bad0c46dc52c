//! The program `wakescope` in the process of Python: words and scenes go in, an object and the bytes of files come out.
//!
//! There is no physics here and no key: a command is called with the words of its command line, and says itself what is wrong with them.
//! The Python layer around it is `python/wakescope/__init__.py`.
//!
//! | module | what is in it |
//! |---|---|
//! | `call` | a command on a thread of its own, which is told to stop by Ctrl-C |
//! | `error` | what is refused as an exception |
//! | `progress` | what a command tells while it runs |
//! | `scene` | dictionaries as scenes and back |
//! | `signals` | arrays of numpy as signals |

mod call;
mod error;
mod progress;
mod scene;
mod signals;

/// Words and scenes go in, an object and the bytes of files come out.
#[pyo3::pymodule]
mod _wakescope {
    use std::ffi::OsString;
    use std::path::PathBuf;

    use pyo3::prelude::*;
    use pyo3::types::PyBytes;
    use wakescope_sim::io::Existing;
    use wakescope_sim::write_contents;

    #[pymodule_export]
    use crate::call::call;
    #[pymodule_export]
    use crate::scene::{presets, scene, table};

    /// Version of the program.
    #[pymodule_export]
    const VERSION: &str = wakescope_sim::VERSION;

    /// Runs the program with the words of its command line, of which the first is its name; returns its exit code.
    #[pyfunction]
    fn main(py: Python<'_>, words: Vec<OsString>) -> u8 {
        py.detach(|| wakescope_sim::cli::main(words))
    }

    /// Writes files to a folder, all or none, and returns their paths; existing files are replaced only with `overwrite`.
    #[pyfunction]
    fn write(
        files: Vec<(String, Bound<'_, PyBytes>)>,
        folder: PathBuf,
        overwrite: bool,
    ) -> PyResult<Vec<PathBuf>> {
        let files = files
            .into_iter()
            .map(|(name, content)| (name, content.as_bytes().to_vec()))
            .collect();
        write_contents(&folder, files, Existing::with_overwrite(overwrite))
            .map_err(|error| pyo3::exceptions::PyOSError::new_err(error.to_string()))
    }
}
