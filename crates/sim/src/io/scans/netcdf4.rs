//! Scans in NetCDF-4 (HDF5): CfRadial 1 at the root, or a group for each sweep as CfRadial 2 and Windcube have them.
//!
//! Check: files that Py-ART and xradar wrote, in the tests of the program.

use super::source::Source;
use crate::Error;
use netcdf_reader::{NcAttribute, NcFile, NcGroup};
use std::path::Path;

/// Largest variable that is read \[numbers\].
const LARGEST: u64 = 1 << 28;

/// A file and one of its groups; attributes are looked for at the root, too.
pub(super) struct Nc4Group {
    file: std::rc::Rc<NcFile>,
    /// Name of the group; empty at the root.
    name: String,
}

/// The groups of a file that hold scans: those with elevations.
pub(super) fn groups(path: &Path) -> Result<Vec<(String, Nc4Group)>, Error> {
    let refuse = |reason: String| Error::Input { path: path.to_owned(), reason };
    let unreadable = |e: netcdf_reader::Error| refuse(format!("it is no sound NetCDF-4 file: {e}"));
    let file = std::rc::Rc::new(NcFile::open(path).map_err(unreadable)?);
    let root = file.root_group().map_err(unreadable)?;
    let has_scan = |group: &NcGroup| group.variable("elevation").is_some();
    let mut names: Vec<String> =
        root.groups.iter().filter(|group| has_scan(group)).map(|group| group.name.clone()).collect();
    if has_scan(root) {
        names.insert(0, String::new());
    }
    if names.is_empty() {
        return Err(refuse("neither it nor one of its groups has a variable elevation".into()));
    }
    Ok(names.into_iter().map(|name| (name.clone(), Nc4Group { file: std::rc::Rc::clone(&file), name })).collect())
}

impl Nc4Group {
    fn group(&self) -> Option<&NcGroup> {
        let root = self.file.root_group().ok()?;
        if self.name.is_empty() { Some(root) } else { root.groups.iter().find(|group| group.name == self.name) }
    }

    fn path(&self, name: &str) -> String {
        if self.name.is_empty() { name.to_owned() } else { format!("{}/{name}", self.name) }
    }
}

fn text_of(attribute: Option<&NcAttribute>) -> Option<String> {
    attribute.and_then(|attribute| attribute.value.as_string())
}

impl Source for Nc4Group {
    fn names(&self) -> Vec<String> {
        self.group().map_or(Vec::new(), |group| group.variables.iter().map(|v| v.name().to_owned()).collect())
    }

    fn shape(&self, name: &str) -> Option<Vec<u64>> {
        Some(self.group()?.variable(name)?.shape())
    }

    fn text(&self, variable: &str, name: &str) -> Option<String> {
        text_of(self.group()?.variable(variable)?.attribute(name))
    }

    fn global_text(&self, name: &str) -> Option<String> {
        text_of(self.file.root_group().ok()?.attribute(name))
    }

    fn floats(&mut self, name: &str) -> Result<Vec<f64>, String> {
        let shape = self.shape(name).ok_or_else(|| format!("it has no variable {name}"))?;
        let numbers = shape.iter().try_fold(1_u64, |n, length| n.checked_mul(*length));
        if numbers.is_none_or(|numbers| numbers > LARGEST) {
            return Err(format!("variable {name} has more than {LARGEST} numbers"));
        }
        let read = self.file.read_variable_unpacked_masked(&self.path(name));
        read.map(|values| values.into_iter().collect()).map_err(|e| format!("variable {name} cannot be read: {e}"))
    }
}
