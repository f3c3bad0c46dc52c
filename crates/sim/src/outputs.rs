//! The files of a command: one list gives their names before anything is computed, and makes them afterwards.
//!
//! Check: the names that commands announce are those that they write; folders in use, in the way or not writable are refused.

use crate::Error;
use crate::io::atomic::{StagingFolder, in_folder};
use crate::io::lock::FolderLock;
use crate::io::{Existing, FileGroup, Provenance, Table};
#[cfg(feature = "plots")]
use crate::plot::Figure;
use crate::scene::Outputs as Formats;
use std::path::{Path, PathBuf};

/// Files of a folder in the formats that are wanted. A list of them is a function that adds each with what it is made of, which is
/// absent as long as it is not computed.
pub(crate) struct Outputs {
    formats: Formats,
    /// What is written into each file; none where names alone are wanted.
    origin: Option<Provenance>,
    /// Names and contents, which are empty where names alone are wanted.
    files: Vec<(String, Vec<u8>)>,
}

impl Outputs {
    /// The names of a list.
    ///
    /// # Errors
    /// What the list finds before it makes a file.
    pub(crate) fn names(
        formats: Formats,
        list: impl FnOnce(&mut Self) -> Result<(), Error>,
    ) -> Result<Vec<String>, Error> {
        Ok(Self::contents(formats, None, list)?
            .into_iter()
            .map(|(name, _)| name)
            .collect())
    }

    /// Makes the files of a list and puts them into their folder, all or none; returns their paths.
    ///
    /// # Errors
    /// What the makers find; a file in the way that may not be replaced; another run that writes there; what the system says.
    pub(crate) fn write(
        folder: &Path,
        existing: Existing,
        of: (Formats, Provenance),
        list: impl FnOnce(&mut Self) -> Result<(), Error>,
    ) -> Result<Vec<PathBuf>, Error> {
        write_contents(folder, Self::contents(of.0, Some(of.1), list)?, existing)
    }

    /// Makes the files of a list and keeps them: their names and contents, which are empty without an origin.
    ///
    /// # Errors
    /// What the makers find.
    pub(crate) fn contents(
        formats: Formats,
        origin: Option<Provenance>,
        list: impl FnOnce(&mut Self) -> Result<(), Error>,
    ) -> Result<Vec<(String, Vec<u8>)>, Error> {
        let mut outputs = Self {
            formats,
            origin,
            files: Vec::new(),
        };
        list(&mut outputs)?;
        Ok(outputs.files)
    }

    /// Adds a file that is made of `of`; where that is absent, its name alone.
    ///
    /// # Errors
    /// What the maker finds.
    pub(crate) fn add<T: ?Sized, B: Into<Vec<u8>>>(
        &mut self,
        name: &str,
        of: Option<&T>,
        make: impl FnOnce(&T, &Provenance) -> Result<B, Error>,
    ) -> Result<(), Error> {
        match (&self.origin, of) {
            (None, _) => self.files.push((name.into(), Vec::new())),
            (Some(origin), Some(of)) => self.files.push((name.into(), make(of, origin)?.into())),
            (Some(_), None) => {}
        }
        Ok(())
    }

    /// Adds a table as `STEM.csv`, where tables are wanted.
    ///
    /// # Errors
    /// As [`Self::add`].
    pub(crate) fn table<T: ?Sized>(
        &mut self,
        stem: &str,
        of: Option<&T>,
        make: impl FnOnce(&T) -> Result<Table, Error>,
    ) -> Result<(), Error> {
        match self.formats.csv {
            true => self.add(&format!("{stem}.csv"), of, |of, origin| {
                make(of)?.to_csv(origin)
            }),
            false => Ok(()),
        }
    }

    /// Adds `STEM.nc`, where NetCDF is wanted.
    ///
    /// # Errors
    /// As [`Self::add`].
    pub(crate) fn netcdf<T: ?Sized>(
        &mut self,
        stem: &str,
        of: Option<&T>,
        make: impl FnOnce(&T, &Provenance) -> Result<Vec<u8>, Error>,
    ) -> Result<(), Error> {
        if self.formats.netcdf {
            self.add(&format!("{stem}.nc"), of, make)
        } else {
            Ok(())
        }
    }

    /// Adds a figure as `STEM.svg` and `STEM.png`, as far as these are wanted.
    ///
    /// # Errors
    /// As [`Self::add`].
    #[cfg(feature = "plots")]
    pub(crate) fn figure<T: ?Sized>(
        &mut self,
        stem: &str,
        of: Option<&T>,
        make: impl FnOnce(&T) -> Result<Figure, Error>,
    ) -> Result<(), Error> {
        let Formats { svg, png, .. } = self.formats;
        let figure = of.filter(|_| svg || png).map(make).transpose()?;
        if svg {
            self.add(&format!("{stem}.svg"), figure.as_ref(), |figure, origin| {
                figure.svg(origin)
            })?;
        }
        if png {
            self.add(&format!("{stem}.png"), figure.as_ref(), |figure, origin| {
                figure.png(origin)
            })?;
        }
        Ok(())
    }
}

/// Writes files whose contents are there, such as those that a command returned, to a folder, all or none; returns their paths.
///
/// # Errors
/// Names that are not plain; a file in the way that may not be replaced; another run that writes there; what the system says.
pub fn write_contents(
    folder: &Path,
    files: Vec<(String, Vec<u8>)>,
    existing: Existing,
) -> Result<Vec<PathBuf>, Error> {
    let lock = folder
        .exists()
        .then(|| FolderLock::take(folder))
        .transpose()?;
    // Again: a file may have come while the run computed.
    existing.check(folder, files.iter().map(|(name, _)| name.as_str()))?;
    let mut group = FileGroup::new(folder);
    files
        .into_iter()
        .try_for_each(|(name, content)| group.add(&name, content))?;
    let written = group.commit()?;
    drop(lock);
    Ok(written)
}

/// Finds out, before any computing, whether files of these names can be written to a folder; leaves no trace. `alone`: no other
/// process may be writing there.
///
/// # Errors
/// The folder cannot be made, is a file, cannot be written to, or another run writes to it; a folder is in the way of a file,
/// or a file exists that may not be replaced.
pub(crate) fn prepare(
    folder: &Path,
    names: &[String],
    existing: Existing,
    alone: bool,
) -> Result<(), Error> {
    existing.check(folder, names.iter().map(String::as_str))?;
    in_folder(folder, false, || {
        drop(StagingFolder::make(folder)?);
        alone
            .then(|| FolderLock::take(folder))
            .transpose()
            .map(drop)
    })
}
