//! The variables of a file or of one of its groups, whatever the format of the file: what readers of scans ask for.
//!
//! Check: the same scans come from classic NetCDF and from NetCDF-4.

use crate::io::netcdf_input::NetcdfFile;

/// Variables and their attributes.
pub(super) trait Source {
    /// Names of all variables.
    fn names(&self) -> Vec<String>;
    /// Lengths of the dimensions of a variable, slowest first.
    fn shape(&self, name: &str) -> Option<Vec<u64>>;
    /// A text attribute of a variable.
    fn text(&self, variable: &str, name: &str) -> Option<String>;
    /// A text attribute of the file.
    fn global_text(&self, name: &str) -> Option<String>;
    /// A variable as numbers, unpacked; NaN where a value is missing.
    ///
    /// # Errors
    /// A variable that is not there, not made of numbers or not readable.
    fn floats(&mut self, name: &str) -> Result<Vec<f64>, String>;

    /// Whether there is a variable of this name.
    fn has(&self, name: &str) -> bool {
        self.shape(name).is_some()
    }
}

impl Source for NetcdfFile {
    fn names(&self) -> Vec<String> {
        NetcdfFile::names(self)
    }

    fn shape(&self, name: &str) -> Option<Vec<u64>> {
        NetcdfFile::shape(self, name)
    }

    fn text(&self, variable: &str, name: &str) -> Option<String> {
        NetcdfFile::text(self, variable, name).map(str::to_owned)
    }

    fn global_text(&self, name: &str) -> Option<String> {
        NetcdfFile::global_text(self, name).map(str::to_owned)
    }

    fn floats(&mut self, name: &str) -> Result<Vec<f64>, String> {
        NetcdfFile::floats(self, name)
    }
}
