//! Reading NetCDF files, classic ones and with the feature `netcdf4` those in HDF5: variables as `f64`, with their dimensions in a
//! wanted order.
//!
//! Dimensions are found by what they are for: by the attribute `axis` of their coordinate, or by their name. Values are
//! unpacked (`scale_factor`, `add_offset`), missing ones are NaN. Check: the readers of initial fields and of cross-planes read
//! back what the writers wrote; files of another hand and damaged ones in the tests below.

use crate::io::netcdf_header::{self as header, Attribute, Header, Variable, is_default_fill};
use crate::io::number::{ByteOrder, NumberType};
use crate::io::units::Quantity;
use crate::{Error, io::text_file, machine};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Longest header that is read \[bytes\].
const LONGEST_HEADER_BYTES: u64 = 16 << 20;

/// Largest variable that is read \[bytes\].
const LARGEST_VARIABLE_BYTES: u64 = 4 << 30;

/// What a dimension is for: its name here, its letter in the attribute `axis`, and other names for it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Role {
    name: &'static str,
    axis: &'static str,
    others: &'static [&'static str],
}

/// Time, or the age of a wake.
pub(crate) const TIME: Role = Role { name: "time", axis: "T", others: &["tau", "t", "age", "xtime"] };
/// Along the flight.
pub(crate) const X: Role =
    Role { name: "x", axis: "X", others: &["x_face", "xc", "xf", "xu", "west_east", "west_east_stag"] };
/// Across the flight.
pub(crate) const Y: Role =
    Role { name: "y", axis: "Y", others: &["y_face", "yc", "yf", "yv", "lateral", "south_north", "south_north_stag"] };
/// Up.
pub(crate) const Z: Role = Role {
    name: "z",
    axis: "Z",
    others: &[
        "z_face",
        "zc",
        "zf",
        "zw",
        "height",
        "altitude",
        "zu",
        "zu_3d",
        "zw_3d",
        "bottom_top",
        "bottom_top_stag",
    ],
};

/// A NetCDF file, open, or a group of one.
pub(crate) struct NetcdfFile {
    path: PathBuf,
    numbers: Numbers,
    header: Header,
}

/// What the numbers of a file are read from.
enum Numbers {
    Classic(File),
    /// A group of a NetCDF-4 file, whose name is empty for the root.
    #[cfg(feature = "netcdf4")]
    Hdf5(std::rc::Rc<super::netcdf4_input::Nc4File>, String),
}

/// Where the numbers of a variable are.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NumbersInFile {
    pub(crate) number: NumberType,
    pub(crate) begin: u64,
    /// Bytes from one record of the file to the next, where the variable grows with them.
    pub(crate) stride: Option<u64>,
}

/// Opens a NetCDF file and reads its header, in NetCDF-4 that of its root.
///
/// # Errors
/// What the system says; a file of another kind, or one whose header does not fit its length.
pub(crate) fn open(path: &Path) -> Result<NetcdfFile, Error> {
    let unreadable = |source| Error::Io { action: "read", path: path.to_owned(), source };
    let refuse = |reason: String| Error::Input { path: path.to_owned(), reason };
    let (mut file, length) = text_file::open(path).map_err(unreadable)?;
    let mut beginning = Vec::new();
    Read::by_ref(&mut file).take(4).read_to_end(&mut beginning).map_err(unreadable)?;
    #[cfg(feature = "netcdf4")]
    if beginning == b"\x89HDF" {
        let file = std::rc::Rc::new(super::netcdf4_input::Nc4File::open(path).map_err(refuse)?);
        return of_group(path, &file, String::new()).map_err(refuse);
    }
    Read::by_ref(&mut file).take(LONGEST_HEADER_BYTES).read_to_end(&mut beginning).map_err(unreadable)?;
    let header = header::read(&beginning, length).map_err(|reason| refuse(reason.into()))?;
    Ok(NetcdfFile { path: path.to_owned(), numbers: Numbers::Classic(file), header })
}

#[cfg(feature = "netcdf4")]
fn of_group(
    path: &Path,
    file: &std::rc::Rc<super::netcdf4_input::Nc4File>,
    name: String,
) -> Result<NetcdfFile, String> {
    let header = file.header(&name)?;
    Ok(NetcdfFile { path: path.to_owned(), numbers: Numbers::Hdf5(std::rc::Rc::clone(file), name), header })
}

/// Opens the root of a file and the groups in it, as far as they have the variable `needed`, with their names; attributes of the file
/// are those of its root. A classic file is its root alone.
///
/// # Errors
/// As [`open`]; a file without that variable.
pub(crate) fn open_groups(path: &Path, needed: &str) -> Result<Vec<(String, NetcdfFile)>, Error> {
    let root = open(path)?;
    let mut found = match &root.numbers {
        #[cfg(feature = "netcdf4")]
        Numbers::Hdf5(file, _) => {
            let named = |name: String| Ok((name.clone(), of_group(path, file, name)?));
            let all: Result<Vec<_>, String> = file.groups().and_then(|names| names.into_iter().map(named).collect());
            all.map_err(|reason| root.refuse(reason))?
        }
        Numbers::Classic(_) => vec![(String::new(), root)],
    };
    found.retain(|(_, group)| group.has(needed));
    if found.is_empty() {
        let reason = format!("neither it nor one of its groups has a variable {needed}");
        return Err(Error::Input { path: path.to_owned(), reason });
    }
    Ok(found)
}

impl NetcdfFile {
    /// An error of this file.
    pub(crate) fn refuse(&self, reason: String) -> Error {
        Error::Input { path: self.path.clone(), reason }
    }

    fn variable(&self, name: &str) -> Option<&Variable> {
        self.header.variables.iter().find(|variable| variable.name == name)
    }

    /// Whether it has a variable of this name.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.variable(name).is_some()
    }

    /// Names of all variables.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.header.variables.iter().map(|variable| variable.name.as_str())
    }

    /// Lengths of the dimensions of a variable, slowest first.
    pub(crate) fn shape(&self, name: &str) -> Option<Vec<u64>> {
        Some(self.variable(name)?.dims.iter().map(|dim| self.header.dims[*dim].1).collect())
    }

    /// Where the numbers of a variable are.
    pub(crate) fn layout(&self, name: &str) -> Option<NumbersInFile> {
        let variable = self.variable(name)?;
        let stride = (variable.runs != 1).then_some(self.header.record_bytes);
        Some(NumbersInFile { number: variable.number, begin: variable.begin, stride })
    }

    /// The numbers that stand for a missing one, and factor and offset of the others.
    pub(crate) fn packing(&self, name: &str) -> (Vec<f64>, f64, f64) {
        let fills = ["_FillValue", "missing_value"].iter().filter_map(|fill| self.number(name, fill)).collect();
        let scale = self.number(name, "scale_factor").unwrap_or(1.0);
        (fills, scale, self.number(name, "add_offset").unwrap_or(0.0))
    }

    /// A text attribute of the file.
    pub(crate) fn global_text(&self, name: &str) -> Option<&str> {
        of_name(&self.header.attributes, name)?.text()
    }

    /// The open file, for who reads places of it.
    pub(crate) fn handle(&self) -> std::io::Result<File> {
        match &self.numbers {
            Numbers::Classic(file) => file.try_clone(),
            #[cfg(feature = "netcdf4")]
            Numbers::Hdf5(..) => Err(std::io::ErrorKind::Unsupported.into()),
        }
    }

    /// Names of the dimensions of a variable, slowest first; none if there is no such variable.
    pub(crate) fn dims(&self, name: &str) -> Option<Vec<&str>> {
        let dims = &self.variable(name)?.dims;
        Some(dims.iter().map(|dim| self.header.dims[*dim].0.as_str()).collect())
    }

    /// A text attribute of a variable.
    pub(crate) fn text(&self, variable: &str, name: &str) -> Option<&str> {
        of_name(&self.variable(variable)?.attributes, name)?.text()
    }

    fn number(&self, variable: &str, name: &str) -> Option<f64> {
        of_name(&self.variable(variable)?.attributes, name)?.number()
    }

    /// A number among the attributes of the whole file.
    pub(crate) fn global_number(&self, name: &str) -> Option<f64> {
        of_name(&self.header.attributes, name)?.number()
    }

    /// A variable as `f64`, whatever its type of number; NaN where a value is missing.
    ///
    /// # Errors
    /// A variable that is not there, not made of numbers, too large, or not readable.
    pub(crate) fn floats(&mut self, name: &str) -> Result<Vec<f64>, String> {
        self.part(name, None)
    }

    /// The values at one place of the slowest dimension of a variable, or all of them.
    fn part(&mut self, name: &str, place: Option<usize>) -> Result<Vec<f64>, String> {
        let Some(variable) = self.variable(name) else {
            return Err(format!("it has no variable {name}"));
        };
        if variable.number == NumberType::Text {
            return Err(format!("variable {name} is not made of numbers"));
        }
        let (number, mut begin, mut runs) = (variable.number, variable.begin, variable.runs);
        let (mut run_bytes, mut first) = (variable.run_bytes(), 0);
        if let Some(place) = place {
            let places = variable.dims.first().map_or(1, |dim| self.header.dims[*dim].1).max(1);
            if place as u64 >= places {
                return Err(format!("variable {name} has no place {place}"));
            }
            if runs == places && places > 1 {
                (first, runs) = (place as u64, 1);
            } else {
                run_bytes = run_bytes * runs / places;
                (begin, runs) = (begin + place as u64 * run_bytes, 1);
            }
        }
        let bytes = run_bytes.saturating_mul(runs);
        if bytes > LARGEST_VARIABLE_BYTES {
            return Err(format!("variable {name} has more than {LARGEST_VARIABLE_BYTES} bytes: use one file per time"));
        }
        // As they are in the file and as they are handed on, perhaps in another order.
        machine::holds(&format!("variable {name}"), 3.0 * 8.0 * (bytes / number.bytes()) as f64)?;
        #[cfg(feature = "netcdf4")]
        if let Numbers::Hdf5(file, group) = &self.numbers {
            return file.read(group, name, &self.shape(name).unwrap_or_default(), place);
        }
        let (fills, scale, offset) = self.packing(name);
        let packed = scale != 1.0 || offset != 0.0;
        let unpack = |value: f64| {
            let missing = fills.contains(&value) || is_default_fill(value);
            match (missing, packed) {
                (true, _) => f64::NAN,
                (_, true) => value * scale + offset,
                (_, false) => value,
            }
        };
        let mut values = Vec::new();
        values.try_reserve_exact((bytes / number.bytes()) as usize).map_err(|e| format!("variable {name}: {e}"))?;
        let mut file = self.handle().map_err(|e| format!("variable {name} cannot be read: {e}"))?;
        let mut raw = vec![0; run_bytes as usize];
        for run in first..first + runs {
            let at = SeekFrom::Start(begin + run * self.header.record_bytes);
            file.seek(at)
                .and_then(|_| file.read_exact(&mut raw))
                .map_err(|e| format!("variable {name} cannot be read: {e}"))?;
            values.extend(
                raw.chunks_exact(number.bytes() as usize).map(|bytes| unpack(number.value(bytes, ByteOrder::Big))),
            );
        }
        Ok(values)
    }

    /// The dimension of `variable` that has a role.
    fn find(&self, dims: &[&str], role: Role) -> Option<usize> {
        let of_axis = |dim: &&str| self.text(dim, "axis").is_some_and(|axis| axis.eq_ignore_ascii_case(role.axis));
        let of_name = |dim: &&str| {
            let dim = dim.to_ascii_lowercase();
            dim == role.name || role.others.contains(&dim.as_str())
        };
        dims.iter().position(of_name).or_else(|| dims.iter().position(of_axis))
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
    pub(crate) fn roles<const N: usize>(&self, name: &str, roles: [Role; N]) -> Result<[String; N], String> {
        let needed = roles.each_ref().map(|role| role.name).join(", ");
        let Some(dims) = self.dims(name) else {
            return Err(format!("it has no variable {name}: one over {needed} is needed"));
        };
        let places: Vec<Option<usize>> = roles.iter().map(|role| self.find(&dims, *role)).collect();
        let spare: Vec<&str> = (0..dims.len()).filter(|i| !places.contains(&Some(*i))).map(|i| dims[i]).collect();
        let found: Vec<String> = places.iter().flatten().map(|place| dims[*place].to_owned()).collect();
        if let Some(missing) = places.iter().position(Option::is_none) {
            let role = roles[missing];
            let known = spare.iter().find_map(|dim| presentable(dim));
            let rename = known.map_or(String::new(), |dim| {
                format!(": rename {dim}, in xarray with ds.rename({dim}=\"{}\"), or", role.name)
            });
            return Err(format!(
                "{name} needs dimensions for {needed} (in any order), and none of its {} is {}{rename} give its coordinate the attribute \
                 axis = \"{}\"",
                dims.len(),
                role.name,
                role.axis
            ));
        }
        if let Some(long) = spare.iter().find(|dim| self.length(dim) != Some(1)) {
            let which = presentable(long).unwrap_or("dimension");
            return Err(format!("{name} has a further {which} of more than one value: select one of them first"));
        }
        found.try_into().map_err(|_| format!("{name} has one dimension for two of its axes"))
    }

    /// Length of a dimension.
    pub(crate) fn length(&self, dim: &str) -> Option<u64> {
        self.header.dims.iter().find(|(name, _)| name == dim).map(|(_, length)| *length)
    }

    /// The coordinate of a dimension.
    ///
    /// # Errors
    /// There is none, or it has another length.
    pub(crate) fn coordinate(&mut self, dim: &str) -> Result<Vec<f64>, String> {
        let shown = presentable(dim).unwrap_or("a dimension").to_owned();
        if !self.has(dim) {
            return Err(format!("{shown} has no coordinate: a variable of that name with its positions is needed"));
        }
        let values = self.floats(dim).map_err(|_| format!("the coordinate of {shown} cannot be read"))?;
        if self.length(dim) != Some(values.len() as u64) {
            return Err(format!("the coordinate of {shown} has not the length of its dimension"));
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
        quantity.si(text).map_err(|needed| format!("the attribute units of {shown} is of no use: {needed}"))
    }

    /// The coordinate of a dimension in metres.
    ///
    /// # Errors
    /// As [`Self::coordinate`]; a unit that is no length.
    pub(crate) fn coordinate_m(&mut self, dim: &str) -> Result<Vec<f64>, String> {
        let unit_m = self.unit(dim, Quantity::Length)?;
        Ok(scaled(self.coordinate(dim)?, unit_m))
    }

    /// Times in seconds, from the unit of a variable; a date from which they count is left out.
    ///
    /// # Errors
    /// As [`Self::floats`]; a unit that is no time.
    pub(crate) fn seconds(&mut self, name: &str) -> Result<Vec<f64>, String> {
        // Plain numbers are taken for seconds.
        let is_plain = self.text(name, "units") == Some("1");
        let unit_s = if is_plain { 1.0 } else { self.unit(name, Quantity::Time)? };
        Ok(scaled(self.floats(name)?, unit_s))
    }

    /// Velocities in m/s with their dimensions in this order, as [`Self::ordered`].
    ///
    /// # Errors
    /// As there; a unit that is no velocity.
    pub(crate) fn velocities(
        &mut self,
        name: &str,
        order: &[String],
        place: Option<usize>,
    ) -> Result<Vec<f64>, String> {
        let unit_m_s = self.unit(name, Quantity::Velocity)?;
        Ok(scaled(self.ordered(name, order, place)?, unit_m_s))
    }

    /// Values of a variable with its dimensions in this order, the last one fastest: all, or those of one place of the slowest dimension,
    /// which `order` then leaves out.
    ///
    /// # Errors
    /// As [`Self::floats`].
    pub(crate) fn ordered(&mut self, name: &str, order: &[String], place: Option<usize>) -> Result<Vec<f64>, String> {
        let mut dims: Vec<String> = self.dims(name).unwrap_or_default().into_iter().map(str::to_owned).collect();
        if place.is_some() && !dims.is_empty() {
            dims.remove(0);
        }
        let values = self.part(name, place)?;
        if dims == order {
            return Ok(values);
        }
        let lengths: Vec<usize> = dims.iter().map(|dim| self.length(dim).unwrap_or(1) as usize).collect();
        let stride = |dim: &String| {
            let place = dims.iter().position(|d| d == dim);
            place.map_or((1, 0), |i| (lengths[i], lengths[i + 1..].iter().product::<usize>()))
        };
        let axes: Vec<(usize, usize)> = order.iter().map(stride).collect();
        let mut out = Vec::with_capacity(values.len());
        for at in 0..values.len() {
            let (mut rest, mut from) = (at, 0);
            for (length, step) in axes.iter().rev() {
                from += rest % length * step;
                rest /= length;
            }
            out.extend(values.get(from));
        }
        Ok(out)
    }
}

fn of_name<'a>(attributes: &'a [(String, Attribute)], name: &str) -> Option<&'a Attribute> {
    attributes.iter().find(|(own, _)| own == name).map(|(_, value)| value)
}

/// The values in another unit; with the same bits in the same.
fn scaled(mut values: Vec<f64>, unit: f64) -> Vec<f64> {
    values.iter_mut().for_each(|value| *value *= unit);
    values
}

/// A name that may be shown: a short word of letters, digits and underscores. Nothing else of a file is.
fn presentable(name: &str) -> Option<&str> {
    let plain = name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
    (plain && !name.is_empty() && name.len() <= 32).then_some(name)
}

#[cfg(test)]
#[path = "netcdf_input_tests.rs"]
mod tests;
