//! Files in and out: readers of NetCDF and text; tables as CSV, maps as CfRadial 1.4 and HALO `.hpl`, cross-planes as CF NetCDF.
//! Every writer turns plain data and a [`Provenance`] into bytes (no clock, so the same run gives the same bytes);
//! [`FileGroup`] puts a run's files on disk, all or none.
//! Check: each format is read back by an independent reader in the tests.
//!
//! | module | writes | feature |
//! |---|---|---|
//! | [`map`] | (data) [`VelocityMap`], [`CrossPlanes`] | - |
//! | [`fields`] | (data) [`VelocityField`] | - |
//! | [`provenance`] | (data) where a file comes from | - |
//! | [`utc`], [`Site`] | (data) dates and place of a measurement | - |
//! | [`Existing`] | existing files of the names of outputs: refused or replaced | - |
//! | [`csv`] | any table | - |
//! | [`csv_input`] | (reader) tables of texts | - |
//! | [`raw`], [`number`] | (readers) raw signals in NetCDF, NPY, NPZ and binary files | - |
//! | [`scans`] | (readers) scans of radial velocity: CfRadial, `.hpl`, tables | - |
//! | [`data_set`] | (reader) data sets of scans with their truth | - |
//! | [`scan_list`] | (reader) lines of sight of a scan | - |
//! | [`tables`] | a map or planes as a table | - |
//! | [`parts`] | (data) files in parts, for ranks that write them together | - |
//! | [`atomic`] | files to disk, all or none | - |
//! | `text_file`, `netcdf_input` (`netcdf4_input`), `netcdf_dimensions`, `planes_input`, `fields_input`, `units` | (readers) texts, NetCDF, cross-planes and fields in it, units | `netcdf` or `netcdf4` but for texts |
//! | `lock` | nothing: one writer for a folder at a time | - |
//! | [`hpl`] | one sweep as HALO raw file | - |
//! | [`zarr`] | arrays of a Zarr v3 group, and their reader | - |
//! | `cfradial`, `cf_planes`, `cf_fields`, `cf_signals`, `cf_spectra` (through `netcdf`; their variables are described beside them in `.cdl`) | classic NetCDF | `netcdf` |

pub mod atomic;
pub(crate) mod fields_input;
#[cfg(feature = "netcdf4")]
pub(crate) mod netcdf4_input;
pub(crate) mod netcdf_dimensions;
pub(crate) mod netcdf_input;
pub(crate) mod planes_input;
pub(crate) mod text_file;
pub(crate) mod units;
pub(crate) mod variable;

pub mod cf_fields;
pub mod cf_planes;
pub mod cf_signals;
pub mod cf_spectra;
pub mod cfradial;
mod checks;
pub mod csv;
pub mod csv_input;
pub mod data_set;
pub(crate) mod edges;
mod existing;
pub mod fields;
pub mod hpl;
pub(crate) mod lock;
pub mod map;
pub(crate) mod netcdf;
pub mod number;
pub mod parts;
pub mod provenance;
pub mod raw;
pub mod scan_list;
pub mod scans;
pub mod signals;
mod site;
pub mod tables;
pub mod utc;
pub mod zarr;

pub use atomic::{FileGroup, write_atomic};
pub use cf_spectra::Spectra;
#[cfg(feature = "plots")]
pub(crate) use checks::{increasing, same_length};
pub use csv::Table;
pub use existing::Existing;
pub use fields::VelocityField;
pub use map::{CrossPlanes, Field, OPEN_EDGES, PulseInfo, Ray, Sweep, Unit, VelocityMap};
pub use parts::FileParts;
pub use provenance::{Provenance, hash_of};
pub use site::Site;
pub(crate) use utc::MAX_TIME_S;
pub use utc::UtcTime;

#[cfg(test)]
#[path = "samples_for_tests.rs"]
pub(crate) mod samples;
