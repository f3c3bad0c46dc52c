//! Reading NetCDF files, classic ones and with the feature `netcdf4` those in HDF5: variables as `f64`.
//!
//! Values are unpacked (`_Unsigned`, `scale_factor`, `add_offset`), missing ones are NaN. Nothing of a file is repeated in a message but
//! short names and units. Check: the readers of initial fields and of cross-planes read back what the writers wrote; files of other
//! programs, damaged ones, and each word of a good header replaced by large and negative counts in the tests below.

use crate::io::number::{PACKING, Packing};
use crate::io::units::{Quantity, split_date};
use crate::{Error, io::text_file, machine};
use ndarray::ArrayD;
use netcdf_reader::masked::MaskParams;
use netcdf_reader::unpack::{SignParams, UnpackParams};
use netcdf_reader::{
    NcAttrValue, NcAttribute, NcFile, NcFormat, NcGroup, NcSliceInfo, NcSliceInfoElem, NcType,
    NcVariable,
};
#[cfg(feature = "netcdf4")]
use netcdf_reader::{NcMetadataMode, NcOpenOptions};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Largest factor by which deflate compresses.
const MOST_EXPANDED: f64 = 1032.0;

/// What the library of NetCDF stores where no float was written.
pub(crate) const DEFAULT_FILL: f64 = 9.969_209_968_386_869e36;

const OTHER: &str = "it is not a NetCDF file; classic NetCDF is needed, from xarray with to_netcdf(\"out.nc\", \
                     format=\"NETCDF3_64BIT\")";
/// Messages of a file that the library does not read: its own would repeat bytes of a file that may be anything.
const UNSOUND: &str =
    "it is not a valid NetCDF file: its header is damaged, or counts more than the file holds";
const UNSOUND_HDF5: &str = "it is NetCDF-4 (HDF5), but damaged or of a kind that is not read: nccopy -k nc6 in.nc out.nc makes classic \
                            NetCDF of it";
/// How NetCDF-4 becomes classic.
const CONVERT: &str = "nccopy -k nc6 in.nc out.nc, or in xarray load_dataset(\"in.nc\").to_netcdf(\"out.nc\", format=\"NETCDF3_64BIT\")";

/// What is said of files of weather radars in another layout of HDF5.
const ODIM: &str = "it is an ODIM_H5 file, which is not read: export it to CfRadial, e.g. in Python with \
                    pyart.io.write_cfradial(\"out.nc\", pyart.aux_io.read_odim_h5(\"in.h5\"))";

/// What netCDF-4 puts before the name of a variable that is also that of a dimension along which it does not run.
const NON_COORDINATE: &str = "_nc4_non_coord_";

/// Variables that groups share with the root where they have none of their own.
const OF_ALL_GROUPS: [&str; 6] = [
    "range",
    "distance",
    "latitude",
    "longitude",
    "nyquist_velocity",
    "pulse_width",
];

/// A NetCDF file, open, or a group of one.
#[derive(Clone)]
pub(crate) struct NetcdfFile {
    path: PathBuf,
    file: Arc<NcFile>,
    /// Length of the file.
    bytes: u64,
    /// Name of the group; empty for the root.
    group: String,
    pub(super) variables: Vec<NcVariable>,
    /// Names of those among them that are of the root.
    shared: Vec<&'static str>,
    /// Variables of the root.
    root: Arc<Vec<NcVariable>>,
    /// Attributes of the root.
    attributes: Vec<NcAttribute>,
    /// Names of the attributes that say how numbers are packed, by the path of their variable, as HDF5 has them.
    packing: Arc<Packing>,
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
    let (_, bytes, beginning) = text_file::begin(path)?;
    let packing = packing(path, &beginning).map_err(|reason| Error::input(path, reason))?;
    let is_classic = beginning[0] == b'C';
    let unsound = if is_classic { UNSOUND } else { UNSOUND_HDF5 };
    let file = open_library(path).ok_or_else(|| Error::input(path, unsound))?;
    let root = file.root_group().map_err(|_| Error::input(path, unsound))?;
    if is_classic && root.variables.iter().any(|v| is_cut(v, bytes)) {
        return Err(Error::input(path, unsound));
    }
    let variables = root.variables.clone();
    let attributes = root.attributes.clone();
    Ok(NetcdfFile {
        path: path.to_owned(),
        file: Arc::new(file),
        bytes,
        group: String::new(),
        shared: Vec::new(),
        root: Arc::new(variables.clone()),
        variables,
        attributes,
        packing: Arc::new(packing),
    })
}

/// The attributes about packing of a file that begins so, none of a classic one.
///
/// # Errors
/// A file of another kind; groups that cannot be read.
#[cfg_attr(
    not(feature = "netcdf4"),
    expect(
        unused_variables,
        reason = "only groups of HDF5 are read from the path"
    )
)]
fn packing(path: &Path, beginning: &[u8]) -> Result<Packing, String> {
    match beginning {
        [b'C', b'D', b'F', 1 | 2 | 5, ..] => Ok(Packing::default()),
        #[cfg(feature = "netcdf4")]
        [0x89, b'H', b'D', b'F', ..] => {
            super::netcdf4_input::check_groups(path, UNSOUND_HDF5).map_err(str::to_owned)
        }
        #[cfg(not(feature = "netcdf4"))]
        [0x89, b'H', b'D', b'F', ..] => Err(format!(
            "it is NetCDF-4 (HDF5), classic NetCDF is needed: {CONVERT}"
        )),
        _ => Err(OTHER.to_owned()),
    }
}

/// Opens a file with the library of NetCDF; none where it cannot read it.
#[cfg(feature = "netcdf4")]
fn open_library(path: &Path) -> Option<NcFile> {
    // By places: a file that is mapped to memory would end the program where it becomes shorter. Variables and attributes of types
    // that netCDF does not know are passed over, as nothing may need them.
    let file = hdf5_reader::FileStorage::open(path).ok()?;
    let options = NcOpenOptions {
        metadata_mode: NcMetadataMode::Lossy,
        ..NcOpenOptions::default()
    };
    NcFile::from_storage_with_options(Arc::new(file), options).ok()
}

/// Opens a file with the library of NetCDF; none where it cannot read it.
#[cfg(not(feature = "netcdf4"))]
fn open_library(path: &Path) -> Option<NcFile> {
    NcFile::open(path).ok()
}

/// Whether a variable of a classic file reaches beyond its end: the library compares only records with the length of the file.
fn is_cut(variable: &NcVariable, file_bytes: u64) -> bool {
    !variable.is_record_var && end_byte(variable).is_none_or(|end| end > file_bytes)
}

/// Where the data of a variable end; none where the header counts more than a file can have.
fn end_byte(variable: &NcVariable) -> Option<u64> {
    let count = variable.num_elements().ok()?;
    let size = variable.dtype.size().ok()? as u64;
    variable.data_offset.checked_add(count.checked_mul(size)?)
}

/// Opens the root of a file and the groups in it, as far as they have what is `needed`; attributes of the file are those of its
/// root. A classic file is its root alone.
///
/// # Errors
/// As [`open`]; a file without it, with the name of what is needed.
pub(crate) fn open_groups(
    path: &Path,
    needed: &str,
    has_needed: impl Fn(&NetcdfFile) -> bool,
) -> Result<Vec<NetcdfFile>, Error> {
    let root = open(path)?;
    let mut found = vec![root.clone()];
    if let Ok(group) = root.file.root_group() {
        root.add_groups("", group, &mut found);
    }
    found.retain(has_needed);
    for group in found.iter_mut().filter(|group| !group.group.is_empty()) {
        for name in OF_ALL_GROUPS {
            if let Some(shared) = root.variable(name).filter(|_| !group.has(name)) {
                group.variables.push(shared.clone());
                group.shared.push(name);
            }
        }
    }
    if found.is_empty() {
        let conventions = root.global_text("Conventions").unwrap_or_default();
        let reason = match conventions.starts_with("ODIM_H5") {
            true => ODIM.to_owned(),
            false => format!("neither it nor one of its groups has a variable {needed}"),
        };
        return Err(root.refuse(reason));
    }
    Ok(found)
}

impl NetcdfFile {
    /// An error of this file, or of its group.
    pub(crate) fn refuse(&self, reason: String) -> Error {
        Error::input(&self.path, self.named(reason))
    }

    /// What is said of this group.
    pub(crate) fn named(&self, reason: String) -> String {
        match self.group.is_empty() {
            true => reason,
            false => format!("group {}: {reason}", self.group),
        }
    }

    pub(super) fn variable(&self, name: &str) -> Option<&NcVariable> {
        self.variables
            .iter()
            .find(|variable| own_name(variable) == name)
    }

    /// Whether it has a variable of this name.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.variable(name).is_some()
    }

    /// Names of all variables.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.variables.iter().map(own_name)
    }

    /// Lengths of the dimensions of a variable, slowest first.
    pub(crate) fn shape(&self, name: &str) -> Option<Vec<u64>> {
        Some(self.variable(name)?.shape())
    }

    /// Names of the variables of the file or group whose types are not read.
    pub(crate) fn unread(&self) -> Vec<&str> {
        let mut unread = Vec::new();
        for path in self.packing.keys() {
            let (group, name) = path.rsplit_once('/').unwrap_or(("", path));
            let is_read = self.variables.iter().any(|own| own.name == name);
            if group == self.group && !is_read {
                unread.extend(presentable(name));
            }
        }
        unread
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

    /// The numbers of an attribute of a variable.
    pub(crate) fn numbers(&self, variable: &str, name: &str) -> Option<Vec<f64>> {
        self.variable(variable)?.attribute(name)?.value.as_f64_vec()
    }

    /// Texts of a variable of the group or else of the root, whose last dimension are the characters.
    ///
    /// # Errors
    /// A variable that is not there or not made of texts.
    pub(crate) fn texts(&self, name: &str) -> Result<Vec<String>, String> {
        let own = self.variable(name).filter(|v| is_text(v));
        let of_root = self.root.iter().find(|v| own_name(v) == name);
        let path = match (own, of_root.filter(|v| is_text(v))) {
            (Some(variable), _) => self.path_of(variable),
            (None, Some(variable)) => variable.name.clone(),
            (None, None) => return Err(format!("it has no texts {name}")),
        };
        let mut texts = self
            .file
            .read_variable_as_strings(&path)
            .map_err(|_| format!("variable {name} cannot be read"))?;
        for text in &mut texts {
            *text = text.trim_matches(['\0', ' ']).to_owned();
        }
        Ok(texts)
    }

    /// A text of the file: a variable of one text in the group or the root, or an attribute of the file.
    pub(crate) fn named_text(&self, name: &str) -> Option<String> {
        match self.texts(name).as_deref() {
            Ok([text]) => Some(text.clone()),
            _ => self.global_text(name).map(str::to_owned),
        }
    }

    /// The groups in a group of this path, and those in them.
    fn add_groups(&self, path: &str, group: &NcGroup, found: &mut Vec<NetcdfFile>) {
        for inner in &group.groups {
            let path = match path {
                "" => inner.name.clone(),
                path => format!("{path}/{}", inner.name),
            };
            found.push(NetcdfFile {
                group: path.clone(),
                variables: inner.variables.clone(),
                ..self.clone()
            });
            self.add_groups(&path, inner, found);
        }
    }

    fn path_of(&self, variable: &NcVariable) -> String {
        match self.group.is_empty() || self.shared.contains(&own_name(variable)) {
            true => variable.name.clone(),
            false => format!("{}/{}", self.group, variable.name),
        }
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
        #[cfg(feature = "netcdf4")]
        if let (NcType::Enum { .. }, []) = (&variable.dtype, ranges) {
            let codes = super::netcdf4_input::codes(&self.file, &self.path_of(variable));
            return codes.ok_or_else(|| format!("variable {name} cannot be read: {UNSOUND_HDF5}"));
        }
        let is_number = variable.dtype.is_primitive()
            && !matches!(variable.dtype, NcType::Char | NcType::String);
        if !is_number {
            return Err(format!("variable {name} is not made of numbers"));
        }
        let mut lengths = variable.shape();
        let mut part = NcSliceInfo::all(variable.ndim());
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
        let path = self.path_of(variable);
        self.has_known_packing(variable, &path)?;
        let stored = match ranges {
            [] => self.file.read_variable_as_f64(&path),
            _ => self.file.read_variable_slice_as_f64(&path, &part),
        };
        let stored = stored.map_err(|error| self.unreadable(name, &error.to_string()))?;
        Ok(unpacked(variable, stored).into_iter().collect())
    }

    /// Refuses a variable with an attribute about its packing that is no number, or of a type that is not read.
    fn has_known_packing(&self, variable: &NcVariable, path: &str) -> Result<(), String> {
        let shown = presentable(own_name(variable)).unwrap_or("a variable");
        let stored = self.packing.get(path).into_iter().flatten();
        if let Some(name) = stored
            .into_iter()
            .find(|name| variable.attribute(name).is_none())
        {
            return Err(format!(
                "attribute {name} of variable {shown} is of a type that is not read"
            ));
        }
        for attribute in &variable.attributes {
            let name = attribute.name.as_str();
            let value = &attribute.value;
            let is_known = match name {
                "_Unsigned" => text(value).is_none_or(|text| {
                    text.eq_ignore_ascii_case("true") || text.eq_ignore_ascii_case("false")
                }),
                "valid_range" => value.as_f64_vec().is_some_and(|ends| ends.len() == 2),
                _ => !PACKING.contains(&name) || value.as_f64().is_some(),
            };
            if !is_known {
                let found =
                    text(value).map_or(String::new(), |text| format!(" = {}", quoted(text)));
                return Err(format!(
                    "variable {shown} has the attribute {name}{found}: {}",
                    match name {
                        "_Unsigned" => "true or false is needed",
                        "valid_range" => "two numbers are needed",
                        _ => "a number is needed",
                    }
                ));
            }
        }
        Ok(())
    }

    /// Refuses whole numbers with attributes of other conventions, whose factors would be missed.
    ///
    /// # Errors
    /// The first such attribute.
    pub(crate) fn refuse_other_packing(&self, name: &str) -> Result<(), String> {
        let Some(variable) = self.variable(name).filter(|v| !is_float(&v.dtype)) else {
            return Ok(());
        };
        let is_packed = |own: &str| variable.attribute(own).is_some();
        let found = variable.attributes.iter().find(|attribute| {
            let own = attribute.name.to_ascii_lowercase();
            OTHER_PACKING.contains(&own.as_str())
        });
        match found.filter(|_| !(is_packed("scale_factor") || is_packed("add_offset"))) {
            Some(attribute) => Err(format!(
                "variable {name} has whole numbers and the attribute {}, which is not read: scale_factor and add_offset are",
                attribute.name
            )),
            None => Ok(()),
        }
    }

    /// Why a variable cannot be read, without anything of the file but the number of its filter.
    fn unreadable(&self, name: &str, error: &str) -> String {
        let is_hdf5 = matches!(self.file.format(), NcFormat::Nc4 | NcFormat::Nc4Classic);
        let filter = error
            .split_once("filter id ")
            .and_then(|(_, rest)| rest.split(|c: char| !c.is_ascii_digit()).next());
        match filter {
            Some(number) => {
                let known = FILTERS.iter().find(|(own, _)| *own == number);
                let filter = known.map_or("a filter", |(_, filter)| filter);
                format!(
                    "variable {name} is compressed by {filter} (number {number} of HDF5), which is not read: {CONVERT} makes classic NetCDF \
                     of it where that filter is installed"
                )
            }
            None if is_hdf5 => format!("variable {name} cannot be read: {UNSOUND_HDF5}"),
            None => format!("variable {name} cannot be read: {UNSOUND}"),
        }
    }

    /// SI units in the unit that the attribute `units` of a variable names; 1 where it has none.
    ///
    /// # Errors
    /// Another unit, with what is needed.
    pub(crate) fn unit(&self, name: &str, quantity: Quantity) -> Result<f64, String> {
        let units = self.text(name, "units").unwrap_or_default();
        let (text, _) = split_date(units);
        let shown = presentable(name).unwrap_or("a variable");
        quantity
            .si(text)
            .map_err(|needed| format!("{shown} has units = {}: {needed}", quoted(units)))
    }
}

/// Attributes that hold the factor or the offset of packed numbers in other conventions than netCDF's.
const OTHER_PACKING: [&str; 8] = [
    "gain",
    "offset",
    "scale",
    "scaling_factor",
    "scalefactor",
    "slope",
    "intercept",
    "multiplier",
];

/// Filters of HDF5 that files of instruments have, by their registered numbers.
const FILTERS: [(&str, &str); 8] = [
    ("307", "bzip2"),
    ("32000", "LZF"),
    ("32001", "Blosc"),
    ("32004", "LZ4"),
    ("32008", "bitshuffle"),
    ("32013", "ZFP"),
    ("32015", "Zstandard"),
    ("32026", "Blosc2"),
];

/// The values of the stored numbers of a variable; NaN for those that are missing.
fn unpacked(variable: &NcVariable, mut values: ArrayD<f64>) -> ArrayD<f64> {
    let sign = SignParams::from_variable(variable);
    let packing = UnpackParams::from_variable(variable);
    // Limits in the type of the packed numbers are about these, others about the values (NetCDF User's Guide, A.1).
    let is_packed = packing.is_some() && !is_float(&variable.dtype);
    let mut of_stored = variable.clone();
    let mut of_values = variable.clone();
    of_stored
        .attributes
        .retain(|attribute| !(is_packed && is_float_limit(attribute)));
    of_values
        .attributes
        .retain(|attribute| is_packed && is_float_limit(attribute));
    let mask = MaskParams::from_variable(&of_stored);
    let is_filled = mask
        .as_ref()
        .is_some_and(|mask| mask.fill_value.is_some() || !mask.missing_values.is_empty());
    let unwritten = unwritten(&variable.dtype).filter(|_| sign.is_none() && !is_filled);
    if let Some(unwritten) = unwritten {
        values.mapv_inplace(|value| if value == unwritten { f64::NAN } else { value });
    }
    if is_float(&variable.dtype) {
        values.mapv_inplace(|value| match (value / DEFAULT_FILL - 1.0).abs() < 1e-6 {
            true => f64::NAN,
            false => value,
        });
    }
    if let Some(sign) = sign {
        sign.apply(&mut values);
    }
    if let Some(mask) = mask {
        mask.apply(&mut values);
    }
    if let Some(packing) = packing {
        packing.apply(&mut values);
    }
    if let Some(limits) = MaskParams::from_variable(&of_values) {
        limits.apply(&mut values);
    }
    values
}

/// Whether an attribute is a limit of valid values and a float.
fn is_float_limit(attribute: &NcAttribute) -> bool {
    let is_float = matches!(
        attribute.value,
        NcAttrValue::Floats(_) | NcAttrValue::Doubles(_)
    );
    is_float && attribute.name.starts_with("valid_")
}

fn is_text(variable: &NcVariable) -> bool {
    matches!(variable.dtype, NcType::Char | NcType::String)
}

fn is_float(kind: &NcType) -> bool {
    matches!(kind, NcType::Float | NcType::Double)
}

/// What the library of NetCDF stores where no whole number was written; of bytes and of 16 bits without sign each may be a number.
fn unwritten(kind: &NcType) -> Option<f64> {
    match kind {
        NcType::Short => Some(-32_767.0),
        NcType::Int => Some(-2_147_483_647.0),
        NcType::UInt => Some(4_294_967_295.0),
        NcType::Int64 => Some(-9_223_372_036_854_775_806_f64),
        NcType::UInt64 => Some(18_446_744_073_709_551_614_f64),
        _ => None,
    }
}

/// The name of a variable as its writer has it.
pub(super) fn own_name(variable: &NcVariable) -> &str {
    let name = variable.name.as_str();
    name.strip_prefix(NON_COORDINATE).unwrap_or(name)
}

/// A short text of a file as it may be shown.
pub(crate) fn quoted(text: &str) -> String {
    let plain = text.bytes().all(|b| b.is_ascii_graphic() || b == b' ');
    match plain && text.len() <= 64 {
        true => format!("\"{text}\""),
        false => "a text of other signs, or a long one".to_owned(),
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
pub(super) fn presentable(name: &str) -> Option<&str> {
    let plain = name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
    (plain && !name.is_empty() && name.len() <= 32).then_some(name)
}

#[cfg(test)]
#[path = "netcdf_input_tests.rs"]
mod tests;
