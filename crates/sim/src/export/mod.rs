//! Output writers: tables as CSV, maps as CfRadial 1.4 and HALO `.hpl`, cross-planes as CF NetCDF, VTR and NPZ.
//! Every writer turns plain data and a [`Provenance`] into bytes (no clock, so the same run gives the same bytes);
//! [`FileGroup`] puts a run's files on disk, all or none.
//! Check: each format is read back by an independent reader in the tests.
//!
//! | module | writes | feature |
//! |---|---|---|
//! | [`map`] | (data) [`VelocityMap`], [`CrossPlanes`] | - |
//! | [`fields`] | (data) [`VelocityField`] | - |
//! | [`provenance`] | (data) where a file comes from | - |
//! | [`csv`] | any table | - |
//! | [`tables`] | a map or planes as a table | - |
//! | [`atomic`] | files to disk, all or none | - |
//! | [`hpl`] | one sweep as HALO raw file | - |
//! | `cfradial`, `cf_planes`, `cf_fields` (through `netcdf`) | classic NetCDF | `netcdf` |
//! | `vtr` | VTK rectilinear grids and their collection | `vtk` |
//! | `npz` | NumPy archive | `npz` |

pub mod atomic;
#[cfg(feature = "netcdf")]
pub mod cf_fields;
#[cfg(feature = "netcdf")]
pub mod cf_planes;
#[cfg(feature = "netcdf")]
pub mod cf_signals;
#[cfg(feature = "netcdf")]
pub mod cfradial;
pub mod csv;
#[cfg(feature = "netcdf")]
pub(crate) mod edges;
mod error;
pub mod fields;
pub mod hpl;
pub mod map;
#[cfg(feature = "netcdf")]
pub(crate) mod netcdf;
#[cfg(feature = "npz")]
pub mod npz;
pub mod provenance;
pub mod signals;
pub mod tables;
#[cfg(feature = "vtk")]
pub mod vtr;

pub use atomic::{FileGroup, write_atomic};
pub use csv::Table;
#[cfg(feature = "plots")]
pub(crate) use error::same_length;
pub use error::{OutputError, OutputResult};
pub use fields::VelocityField;
pub use map::{CrossPlanes, Field, FieldKind, OPEN_EDGES, PulseInfo, Ray, Sweep, Unit, VelocityMap};
#[cfg(feature = "netcdf")]
pub(crate) use netcdf::{FILL, MAX_BYTES as NETCDF_MAX_BYTES};
pub use provenance::Provenance;

#[cfg(test)]
pub(crate) mod samples;
