//! The header of a classic NetCDF file (CDF-1, CDF-2, CDF-5), read without trust: every count is held against the bytes that
//! are there, and every variable against the length of the file, before anything is made of them.
//!
//! Nothing of the file is repeated in a message. Check: each word of a good header is replaced by large and negative counts.

use crate::io::number::{ByteOrder, NumberType};

/// A variable of the file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Variable {
    pub(crate) name: String,
    /// Places of its dimensions in [`Header::dims`], slowest first.
    pub(crate) dims: Vec<usize>,
    pub(crate) attributes: Vec<(String, Attribute)>,
    pub(crate) number: NumberType,
    /// Where its values begin in the file.
    pub(crate) begin: u64,
    /// Values that follow each other without a gap: all of them, or those of one record.
    pub(crate) run: u64,
    /// How many such runs there are.
    pub(crate) runs: u64,
}

/// An attribute; those that are neither text nor number are left out.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Attribute {
    Text(String),
    /// The first number.
    Number(f64),
}

impl Attribute {
    pub(crate) fn text(&self) -> Option<&str> {
        if let Self::Text(text) = self { Some(text) } else { None }
    }

    pub(crate) fn number(&self) -> Option<f64> {
        if let Self::Number(value) = self { Some(*value) } else { None }
    }
}

/// What the file holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Header {
    /// Names and lengths of the dimensions.
    pub(crate) dims: Vec<(String, u64)>,
    pub(crate) variables: Vec<Variable>,
    /// Attributes of the whole file.
    pub(crate) attributes: Vec<(String, Attribute)>,
    /// Bytes from one record to the next.
    pub(crate) record_bytes: u64,
}

/// What the library of NetCDF stores where nothing was written.
pub(crate) const DEFAULT_FILL: f64 = 9.969_209_968_386_869e36;

/// Whether a value is what the library of NetCDF leaves where nothing was written.
pub(crate) fn is_default_fill(value: f64) -> bool {
    (value / DEFAULT_FILL - 1.0).abs() < 1e-6
}

/// Why a file is not read.
type Refused = &'static str;

const TRUNCATED: Refused = "it is no sound NetCDF file: its header counts more than the file holds";
const BROKEN: Refused = "it is no sound NetCDF file: its header is damaged";

const OTHER: Refused = "it is no NetCDF file; classic NetCDF is needed, from xarray with to_netcdf(\"out.nc\", \
                        format=\"NETCDF3_64BIT\")";

/// How NetCDF-4 becomes classic.
const CONVERT: Refused = "it is NetCDF-4 (HDF5), classic NetCDF is needed: nccopy -k cdf2 in.nc out.nc, or in xarray \
                          to_netcdf(\"out.nc\", format=\"NETCDF3_64BIT\")";

/// Reads the header from the beginning of a file that is `length` bytes long.
///
/// # Errors
/// What is wrong, without anything of the file.
pub(crate) fn read(beginning: &[u8], length: u64) -> Result<Header, Refused> {
    if beginning.starts_with(b"\x89HDF") {
        return Err(CONVERT);
    }
    let version = match beginning {
        [b'C', b'D', b'F', version @ (1 | 2 | 5), ..] => *version,
        _ => return Err(OTHER),
    };
    let mut words = Words { rest: &beginning[4..], wide: version == 5, wide_offsets: version > 1 };
    let records = words.count_or_streaming()?;
    let mut header = Header::default();
    for _ in 0..words.list(0x0A)? {
        header.dims.push((words.name()?, words.count()?));
    }
    header.attributes = words.attributes()?;
    for _ in 0..words.list(0x0B)? {
        header.variables.push(words.variable(&header.dims)?);
    }
    lay_out(&mut header, records, length)?;
    Ok(header)
}

/// Finds lengths and places of all values and holds them against the length of the file.
fn lay_out(header: &mut Header, records: Option<u64>, length: u64) -> Result<(), Refused> {
    let Header { dims, variables, record_bytes, .. } = header;
    let grows = |v: &Variable| v.dims.first().is_some_and(|dim| dims[*dim].1 == 0);
    let growing: Vec<bool> = variables.iter().map(grows).collect();
    for (variable, grows) in variables.iter_mut().zip(&growing) {
        // Only the first dimension may be the one that grows.
        let mut sizes = variable.dims.iter().skip(usize::from(*grows)).map(|dim| dims[*dim].1);
        let product = |run: u64, size: u64| run.checked_mul(size).filter(|_| size > 0);
        variable.run = sizes.try_fold(1, product).ok_or(BROKEN)?;
        variable.run.checked_mul(variable.number.bytes()).filter(|bytes| *bytes <= length).ok_or(TRUNCATED)?;
    }
    let of_records = || variables.iter().zip(&growing).filter(|(_, grows)| **grows).map(|(variable, _)| variable);
    *record_bytes = match of_records().count() {
        // The only variable with records has no padding between them.
        1 => of_records().map(Variable::run_bytes).sum(),
        _ => of_records()
            .try_fold(0_u64, |sum, variable| sum.checked_add(variable.run_bytes().div_ceil(4) * 4))
            .ok_or(TRUNCATED)?,
    };
    let first = of_records().map(|variable| variable.begin).min();
    let whole = |first| length.saturating_sub(first).checked_div(*record_bytes).unwrap_or(0);
    let records = records.unwrap_or_else(|| first.map_or(0, whole));
    for (variable, grows) in variables.iter_mut().zip(&growing) {
        variable.runs = if *grows { records } else { 1 };
        if let Some(before_last) = variable.runs.checked_sub(1) {
            let last = before_last.checked_mul(*record_bytes).and_then(|at| at.checked_add(variable.begin));
            let end = last.and_then(|at| at.checked_add(variable.run_bytes()));
            end.filter(|end| *end <= length).ok_or(TRUNCATED)?;
        }
    }
    dims.iter_mut().filter(|(_, size)| *size == 0).for_each(|(_, size)| *size = records);
    Ok(())
}

impl Variable {
    /// Bytes of one run of values.
    pub(crate) fn run_bytes(&self) -> u64 {
        self.run * self.number.bytes()
    }
}

/// The header from the place that is read next.
struct Words<'a> {
    rest: &'a [u8],
    /// Counts have 8 bytes, not 4.
    wide: bool,
    wide_offsets: bool,
}

impl<'a> Words<'a> {
    fn take(&mut self, bytes: u64) -> Result<&'a [u8], Refused> {
        let bytes = usize::try_from(bytes).map_err(|_| TRUNCATED)?;
        let (head, rest) = self.rest.split_at_checked(bytes).ok_or(TRUNCATED)?;
        self.rest = rest;
        Ok(head)
    }

    fn word(&mut self, bytes: u64) -> Result<u64, Refused> {
        Ok(self.take(bytes)?.iter().fold(0, |word, byte| word << 8 | u64::from(*byte)))
    }

    fn size(&self) -> u64 {
        if self.wide { 8 } else { 4 }
    }

    fn count(&mut self) -> Result<u64, Refused> {
        let largest = if self.wide { i64::MAX as u64 } else { i32::MAX as u64 };
        let count = self.word(self.size())?;
        if count > largest { Err(BROKEN) } else { Ok(count) }
    }

    /// A count, or none where the file was still growing.
    fn count_or_streaming(&mut self) -> Result<Option<u64>, Refused> {
        let streaming = if self.wide { u64::MAX } else { u64::from(u32::MAX) };
        let count = self.word(self.size())?;
        let largest = streaming / 2;
        match count {
            count if count == streaming => Ok(None),
            count if count <= largest => Ok(Some(count)),
            _ => Err(BROKEN),
        }
    }

    /// The number of entries of a list with this tag; 0 for a list that is absent.
    fn list(&mut self, tag: u64) -> Result<u64, Refused> {
        let found = self.word(4)?;
        let count = self.count()?;
        match found {
            0 if count == 0 => Ok(0),
            // Each entry has more than one word.
            found if found == tag && count <= self.rest.len() as u64 / 8 => Ok(count),
            found if found == tag => Err(TRUNCATED),
            _ => Err(BROKEN),
        }
    }

    fn name(&mut self) -> Result<String, Refused> {
        let length = self.count()?;
        let bytes = self.take(length)?;
        self.take(length.wrapping_neg() % 4)?;
        String::from_utf8(bytes.to_vec()).map_err(|_| BROKEN)
    }

    fn attributes(&mut self) -> Result<Vec<(String, Attribute)>, Refused> {
        let mut found = Vec::new();
        for _ in 0..self.list(0x0C)? {
            let name = self.name()?;
            let number = self.number_type()?;
            let bytes = self.count()?.checked_mul(number.bytes()).ok_or(TRUNCATED)?;
            let values = self.take(bytes)?;
            self.take(bytes.wrapping_neg() % 4)?;
            if number == NumberType::Text {
                found.push((name, Attribute::Text(String::from_utf8_lossy(values).trim_end_matches('\0').to_owned())));
            } else if let Some(first) = values.get(..number.bytes() as usize) {
                found.push((name, Attribute::Number(number.value(first, ByteOrder::Big))));
            }
        }
        Ok(found)
    }

    fn number_type(&mut self) -> Result<NumberType, Refused> {
        u32::try_from(self.word(4)?).ok().and_then(NumberType::of_netcdf).ok_or(BROKEN)
    }

    fn variable(&mut self, dims: &[(String, u64)]) -> Result<Variable, Refused> {
        let name = self.name()?;
        let count = self.count()?;
        if count > self.rest.len() as u64 / self.size() {
            return Err(TRUNCATED);
        }
        let mut own = Vec::new();
        for _ in 0..count {
            let dim = usize::try_from(self.count()?).ok().filter(|dim| *dim < dims.len()).ok_or(BROKEN)?;
            own.push(dim);
        }
        let attributes = self.attributes()?;
        let number = self.number_type()?;
        // What the file says of the size is the product of the dimensions, which is counted here.
        self.word(self.size())?;
        let begin = self.word(if self.wide_offsets { 8 } else { 4 })?;
        Ok(Variable { name, dims: own, attributes, number, begin, run: 0, runs: 0 })
    }
}
