//! Scans in NetCDF-4 (HDF5): CfRadial 1 at the root, or a group for each sweep as CfRadial 2 and Windcube have them.
//!
//! Check: files that Py-ART and xradar wrote, in the tests of the program.

use super::source::Source;
use crate::Error;
use crate::io::netcdf4_input::Nc4File;
use netcdf_reader::{NcAttribute, NcGroup};
use std::path::Path;

/// A file and one of its groups; attributes are looked for at the root, too.
pub(super) struct Nc4Group {
    file: std::rc::Rc<Nc4File>,
    /// Name of the group; empty at the root.
    name: String,
}

/// The groups of a file that hold scans: those with elevations.
pub(super) fn groups(path: &Path) -> Result<Vec<(String, Nc4Group)>, Error> {
    let refuse = |reason: String| Error::Input { path: path.to_owned(), reason };
    let file = std::rc::Rc::new(Nc4File::open(path).map_err(refuse)?);
    let root = file.file.root_group().map_err(|e| refuse(format!("it is no sound NetCDF-4 file: {e}")))?;
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
        let root = self.file.file.root_group().ok()?;
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
        text_of(self.file.file.root_group().ok()?.attribute(name))
    }

    fn floats(&mut self, name: &str) -> Result<Vec<f64>, String> {
        let shape = self.shape(name).ok_or_else(|| format!("it has no variable {name}"))?;
        self.file.read(&self.path(name), &shape, None)
    }
}
