//! Reading NetCDF files, classic ones and with the feature `netcdf4` those in HDF5: variables as `f64`, with their dimensions in a
//! wanted order.
//!
//! Dimensions are found by what they are for: by the attribute `axis` of their coordinate, or by their name. Values are
//! unpacked (`scale_factor`, `add_offset`), missing ones are NaN. Nothing of a file is repeated in a message but names that may be
//! shown. Check: the readers of initial fields and of cross-planes read back what the writers wrote; files of another hand, damaged
//! ones, and each word of a good header replaced by large and negative counts in the tests below.

use crate::io::units::Quantity;
use crate::{Error, io::text_file, machine};
use ndarray::ArrayD;
use netcdf_reader::{
    NcAttrValue, NcAttribute, NcFile, NcFormat, NcGroup, NcSliceInfo, NcSliceInfoElem, NcType,
    NcVariable,
};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Deflate makes no more than so many bytes of one.
const MOST_EXPANDED: f64 = 1032.0;

/// What the library of NetCDF stores where no float was written.
pub(crate) const DEFAULT_FILL: f64 = 9.969_209_968_386_869e36;

const OTHER: &str = "it is no NetCDF file; classic NetCDF is needed, from xarray with to_netcdf(\"out.nc\", \
                     format=\"NETCDF3_64BIT\")";
/// What is said of a file that the library does not read: its own words would tell bytes of a file that may be anything.
const UNSOUND: &str =
    "it is no sound NetCDF file: its header is damaged, or counts more than the file holds";
const UNSOUND_HDF5: &str = "it is NetCDF-4 (HDF5), but damaged or of a kind that is not read: nccopy -k nc6 in.nc out.nc makes classic \
                            NetCDF of it";
/// How NetCDF-4 becomes classic, for programs that do not read it.
#[cfg(not(feature = "netcdf4"))]
const CONVERT: &str = "it is NetCDF-4 (HDF5), classic NetCDF is needed: nccopy -k nc6 in.nc out.nc, or in xarray \
                       to_netcdf(\"out.nc\", format=\"NETCDF3_64BIT\")";

/// What a dimension is for: its name here, its letter in the attribute `axis`, and other names for it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Role {
    name: &'static str,
    axis: &'static str,
    /// Words between blanks.
    others: &'static str,
}

/// Time, or the age of a wake.
pub(crate) const TIME: Role = Role {
    name: "time",
    axis: "T",
    others: "tau t age xtime",
};
/// Along the flight.
pub(crate) const X: Role = Role {
    name: "x",
    axis: "X",
    others: "x_face xc xf xu west_east west_east_stag",
};
/// Across the flight.
pub(crate) const Y: Role = Role {
    name: "y",
    axis: "Y",
    others: "y_face yc yf yv lateral south_north south_north_stag",
};
/// Up.
pub(crate) const Z: Role = Role {
    name: "z",
    axis: "Z",
    others: "z_face zc zf zw height altitude zu zu_3d zw_3d bottom_top bottom_top_stag",
};

/// A NetCDF file, open, or a group of one.
#[derive(Clone)]
pub(crate) struct NetcdfFile {
    path: PathBuf,
    file: Arc<NcFile>,
    /// Length of the file.
    bytes: u64,
    /// Name of the group; empty for the root.
    group: String,
    variables: Vec<NcVariable>,
    /// Attributes of the root.
    attributes: Vec<NcAttribute>,
}

impl std::fmt::Debug for NetcdfFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.path.display(), self.group)
    }
}

/// Opens a NetCDF file and reads its header, in NetCDF-4 that of its root.
///
/// # Errors
/// What the system says; a file of another kind, or one whose header does not fit its length.
pub(crate) fn open(path: &Path) -> Result<NetcdfFile, Error> {
    let refuse = |reason: &str| Error::Input {
        path: path.to_owned(),
        reason: reason.to_owned(),
    };
    let (_, bytes, beginning) = text_file::begin(path)?;
    match &beginning[..] {
        [b'C', b'D', b'F', 1 | 2 | 5, ..] => {}
        #[cfg(feature = "netcdf4")]
        [0x89, b'H', b'D', b'F', ..] => {
            super::netcdf4_input::check_groups(path, UNSOUND_HDF5).map_err(refuse)?
        }
        #[cfg(not(feature = "netcdf4"))]
        [0x89, b'H', b'D', b'F', ..] => return Err(refuse(CONVERT)),
        _ => return Err(refuse(OTHER)),
    }
    let unsound = || {
        refuse(if beginning[0] == b'C' {
            UNSOUND
        } else {
            UNSOUND_HDF5
        })
    };
    // By places: a file that is mapped to memory would end the program where it becomes shorter.
    #[cfg(feature = "netcdf4")]
    let file = hdf5_reader::FileStorage::open(path)
        .ok()
        .and_then(|file| NcFile::from_storage(Arc::new(file)).ok());
    #[cfg(not(feature = "netcdf4"))]
    let file = NcFile::open(path).ok();
    let file = file.ok_or_else(unsound)?;
    let root = file.root_group().map_err(|_| unsound())?;
    let (variables, attributes) = (root.variables.clone(), root.attributes.clone());
    Ok(NetcdfFile {
        path: path.to_owned(),
        file: Arc::new(file),
        bytes,
        group: String::new(),
        variables,
        attributes,
    })
}

/// Opens the root of a file and the groups in it, as far as they have the variable `needed`; attributes of the file are those of its
/// root. A classic file is its root alone.
///
/// # Errors
/// As [`open`]; a file without that variable.
pub(crate) fn open_groups(path: &Path, needed: &str) -> Result<Vec<NetcdfFile>, Error> {
    let root = open(path)?;
    let groups = root
        .file
        .root_group()
        .map_or(&[][..], |group| &group.groups);
    let of_group = |group: &NcGroup| {
        let (group, variables) = (group.name.clone(), group.variables.clone());
        NetcdfFile {
            group,
            variables,
            ..root.clone()
        }
    };
    let mut found: Vec<NetcdfFile> = std::iter::once(root.clone())
        .chain(groups.iter().map(of_group))
        .collect();
    found.retain(|group| group.has(needed));
    if found.is_empty() {
        return Err(root.refuse(format!(
            "neither it nor one of its groups has a variable {needed}"
        )));
    }
    Ok(found)
}

impl NetcdfFile {
    /// An error of this file, or of its group.
    pub(crate) fn refuse(&self, reason: String) -> Error {
        let reason = if self.group.is_empty() {
            reason
        } else {
            format!("group {}: {reason}", self.group)
        };
        Error::Input {
            path: self.path.clone(),
            reason,
        }
    }

    fn variable(&self, name: &str) -> Option<&NcVariable> {
        self.variables.iter().find(|variable| variable.name == name)
    }

    /// Whether it has a variable of this name.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.variable(name).is_some()
    }

    /// Names of all variables.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.variables.iter().map(|variable| variable.name.as_str())
    }

    /// Lengths of the dimensions of a variable, slowest first.
    pub(crate) fn shape(&self, name: &str) -> Option<Vec<u64>> {
        Some(self.variable(name)?.shape())
    }

    /// How the numbers of a variable are stored.
    pub(crate) fn kind(&self, name: &str) -> Option<&NcType> {
        Some(&self.variable(name)?.dtype)
    }

    /// Names of the dimensions of a variable, slowest first; none if there is no such variable.
    pub(crate) fn dims(&self, name: &str) -> Option<Vec<&str>> {
        Some(
            self.variable(name)?
                .dimensions
                .iter()
                .map(|dim| dim.name.as_str())
                .collect(),
        )
    }

    /// A text attribute of the file.
    pub(crate) fn global_text(&self, name: &str) -> Option<&str> {
        text(&self.attributes.iter().find(|own| own.name == name)?.value)
    }

    /// A number among the attributes of the whole file.
    pub(crate) fn global_number(&self, name: &str) -> Option<f64> {
        self.attributes
            .iter()
            .find(|own| own.name == name)?
            .value
            .as_f64()
    }

    /// A text attribute of a variable.
    pub(crate) fn text(&self, variable: &str, name: &str) -> Option<&str> {
        text(&self.variable(variable)?.attribute(name)?.value)
    }

    /// A number among the attributes of a variable.
    pub(crate) fn number(&self, variable: &str, name: &str) -> Option<f64> {
        self.variable(variable)?.attribute(name)?.value.as_f64()
    }

    /// A variable as `f64`, whatever its type of number; NaN where a value is missing.
    ///
    /// # Errors
    /// A variable that is not there, not made of numbers, too large, or not readable.
    pub(crate) fn floats(&self, name: &str) -> Result<Vec<f64>, String> {
        self.part(name, &[])
    }

    /// The values of a variable in these ranges of its first dimensions and all along the others, the last one fastest.
    ///
    /// # Errors
    /// As [`Self::floats`]; a range beyond its dimension.
    pub(crate) fn part(&self, name: &str, ranges: &[Range<u64>]) -> Result<Vec<f64>, String> {
        let Some(variable) = self.variable(name) else {
            return Err(format!("it has no variable {name}"));
        };
        let is_number = variable.dtype.is_primitive()
            && !matches!(variable.dtype, NcType::Char | NcType::String);
        if !is_number {
            return Err(format!("variable {name} is not made of numbers"));
        }
        let (mut lengths, mut part) = (variable.shape(), NcSliceInfo::all(variable.ndim()));
        for (at, range) in ranges.iter().enumerate() {
            match lengths.get_mut(at) {
                Some(length) if range.end <= *length => *length = range.end - range.start,
                _ => {
                    return Err(format!(
                        "variable {name} has no place {}",
                        range.end.saturating_sub(1)
                    ));
                }
            }
            part.selections[at] = NcSliceInfoElem::Slice {
                start: range.start,
                end: range.end,
                step: 1,
            };
        }
        let count: f64 = lengths.iter().map(|length| *length as f64).product();
        if count > MOST_EXPANDED * self.bytes as f64 {
            return Err(format!(
                "variable {name} has {count} values, more than {} bytes can hold",
                self.bytes
            ));
        }
        // As they are in the file, as the library and as this program hands them on.
        machine::holds(&format!("variable {name}"), 32.0 * count)?;
        let path = if self.group.is_empty() {
            name.to_owned()
        } else {
            format!("{}/{name}", self.group)
        };
        let values = match ranges {
            [] => self.file.read_variable_unpacked_masked(&path),
            _ => self.file.read_variable_slice_unpacked_masked(&path, &part),
        };
        let is_hdf5 = matches!(self.file.format(), NcFormat::Nc4 | NcFormat::Nc4Classic);
        let unsound = if is_hdf5 { UNSOUND_HDF5 } else { UNSOUND };
        let values = values.map_err(|_| format!("variable {name} cannot be read: {unsound}"))?;
        // The library knows fills that the file states, not those of values that were never written.
        let is_unwritten = |value: f64| (value / DEFAULT_FILL - 1.0).abs() < 1e-6;
        Ok(values
            .into_iter()
            .map(|value| if is_unwritten(value) { f64::NAN } else { value })
            .collect())
    }

    /// The dimension of `variable` that has a role.
    fn find(&self, dims: &[&str], role: Role) -> Option<usize> {
        let of_axis = |dim: &&str| {
            self.text(dim, "axis")
                .is_some_and(|axis| axis.eq_ignore_ascii_case(role.axis))
        };
        let of_name = |dim: &&str| {
            let dim = dim.to_ascii_lowercase();
            dim == role.name || role.others.split(' ').any(|other| other == dim)
        };
        dims.iter()
            .position(of_name)
            .or_else(|| dims.iter().position(of_axis))
    }

    /// The dimension of a variable that has a role, if there is one.
    pub(crate) fn dim_of(&self, name: &str, role: Role) -> Option<String> {
        let dims = self.dims(name)?;
        self.find(&dims, role).map(|place| dims[place].to_owned())
    }

    /// The dimensions of a variable that have these roles, in their order; dimensions of length 1 may be left over.
    ///
    /// # Errors
    /// What to rename.
    pub(crate) fn roles<const N: usize>(
        &self,
        name: &str,
        roles: [Role; N],
    ) -> Result<[String; N], String> {
        let needed = roles.each_ref().map(|role| role.name).join(", ");
        let Some(dims) = self.dims(name) else {
            return Err(format!(
                "it has no variable {name}: one over {needed} is needed"
            ));
        };
        let places: Vec<Option<usize>> = roles.iter().map(|role| self.find(&dims, *role)).collect();
        let spare: Vec<&str> = (0..dims.len())
            .filter(|i| !places.contains(&Some(*i)))
            .map(|i| dims[i])
            .collect();
        let found: Vec<String> = places
            .iter()
            .flatten()
            .map(|place| dims[*place].to_owned())
            .collect();
        if let Some(missing) = places.iter().position(Option::is_none) {
            let (role, count) = (roles[missing], dims.len());
            let known = spare.iter().find_map(|dim| presentable(dim));
            let rename = known.map_or(String::new(), |dim| {
                format!(
                    ": rename {dim}, in xarray with ds.rename({dim}=\"{}\"), or",
                    role.name
                )
            });
            return Err(format!(
                "{name} needs dimensions for {needed} (in any order), and none of its {count} is {}{rename} give its coordinate the attribute \
                 axis = \"{}\"",
                role.name, role.axis
            ));
        }
        if let Some(long) = spare.iter().find(|dim| self.length(dim) != Some(1)) {
            let which = presentable(long).unwrap_or("dimension");
            return Err(format!(
                "{name} has a further {which} of more than one value: select one of them first"
            ));
        }
        found
            .try_into()
            .map_err(|_| format!("{name} has one dimension for two of its axes"))
    }

    /// Length of a dimension.
    pub(crate) fn length(&self, dim: &str) -> Option<u64> {
        let all = self
            .variables
            .iter()
            .flat_map(|variable| &variable.dimensions);
        all.filter(|own| own.name == dim).map(|own| own.size).next()
    }

    /// The coordinate of a dimension.
    ///
    /// # Errors
    /// There is none, or it has another length.
    pub(crate) fn coordinate(&self, dim: &str) -> Result<Vec<f64>, String> {
        let shown = presentable(dim).unwrap_or("a dimension").to_owned();
        if !self.has(dim) {
            return Err(format!(
                "{shown} has no coordinate: a variable of that name with its positions is needed"
            ));
        }
        let values = self
            .floats(dim)
            .map_err(|_| format!("the coordinate of {shown} cannot be read"))?;
        if self.length(dim) != Some(values.len() as u64) {
            return Err(format!(
                "the coordinate of {shown} has not the length of its dimension"
            ));
        }
        Ok(values)
    }

    /// SI units in the unit that the attribute `units` of a variable names; 1 where it has none.
    ///
    /// # Errors
    /// Another unit, with what is needed.
    pub(crate) fn unit(&self, name: &str, quantity: Quantity) -> Result<f64, String> {
        let text = self.text(name, "units").unwrap_or_default();
        let text = text.split(" since ").next().unwrap_or_default();
        let shown = presentable(name).unwrap_or("a variable");
        quantity
            .si(text)
            .map_err(|needed| format!("the attribute units of {shown} is of no use: {needed}"))
    }

    /// The coordinate of a dimension in metres.
    ///
    /// # Errors
    /// As [`Self::coordinate`]; a unit that is no length.
    pub(crate) fn coordinate_m(&self, dim: &str) -> Result<Vec<f64>, String> {
        let unit_m = self.unit(dim, Quantity::Length)?;
        Ok(self
            .coordinate(dim)?
            .into_iter()
            .map(|value| value * unit_m)
            .collect())
    }

    /// Times in seconds, from the unit of a variable; a date from which they count is left out.
    ///
    /// # Errors
    /// As [`Self::floats`]; a unit that is no time.
    pub(crate) fn seconds(&self, name: &str) -> Result<Vec<f64>, String> {
        // Plain numbers are taken for seconds.
        let is_plain = self.text(name, "units") == Some("1");
        let unit_s = if is_plain {
            1.0
        } else {
            self.unit(name, Quantity::Time)?
        };
        Ok(self
            .floats(name)?
            .into_iter()
            .map(|value| value * unit_s)
            .collect())
    }

    /// Velocities in m/s with their dimensions in this order, as [`Self::ordered`].
    ///
    /// # Errors
    /// As there; a unit that is no velocity.
    pub(crate) fn velocities(
        &self,
        name: &str,
        order: &[String],
        place: Option<usize>,
    ) -> Result<Vec<f64>, String> {
        let unit_m_s = self.unit(name, Quantity::Velocity)?;
        Ok(self
            .ordered(name, order, place)?
            .into_iter()
            .map(|value| value * unit_m_s)
            .collect())
    }

    /// Values of a variable with its dimensions in this order, the last one fastest: all, or those of one place of the slowest dimension,
    /// which `order` then leaves out.
    ///
    /// # Errors
    /// As [`Self::floats`].
    pub(crate) fn ordered(
        &self,
        name: &str,
        order: &[String],
        place: Option<usize>,
    ) -> Result<Vec<f64>, String> {
        let mut dims = self.dims(name).unwrap_or_default();
        if place.is_some() && !dims.is_empty() {
            dims.remove(0);
        }
        let values = match place {
            Some(place) => self.part(
                name,
                std::slice::from_ref(&(place as u64..place as u64 + 1)),
            )?,
            None => self.floats(name)?,
        };
        if dims == order {
            return Ok(values);
        }
        let lengths: Vec<usize> = dims
            .iter()
            .map(|dim| self.length(dim).unwrap_or(1) as usize)
            .collect();
        // What is left over has one place.
        let (mut axes, spare): (Vec<usize>, Vec<usize>) =
            (0..dims.len()).partition(|at| order.iter().any(|own| own == dims[*at]));
        axes.sort_by_key(|at| order.iter().position(|own| own == dims[*at]));
        axes.extend(spare);
        let stored = ArrayD::from_shape_vec(lengths, values)
            .map_err(|_| format!("{name} has not the lengths of its dimensions"))?;
        Ok(stored.permuted_axes(axes).iter().copied().collect())
    }
}

fn text(value: &NcAttrValue) -> Option<&str> {
    match value {
        NcAttrValue::Chars(text) => Some(text),
        NcAttrValue::Strings(texts) if texts.len() == 1 => Some(&texts[0]),
        _ => None,
    }
}

/// A name that may be shown: a short word of letters, digits and underscores. Nothing else of a file is.
fn presentable(name: &str) -> Option<&str> {
    let plain = name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
    (plain && !name.is_empty() && name.len() <= 32).then_some(name)
}

#[cfg(test)]
#[path = "netcdf_input_tests.rs"]
mod tests;
