//! A classic NetCDF file as one table of dimensions, variables and attributes, and its bytes (CDF-2): whole, or what one of several
//! ranks has of them.
//! The layouts live in `cfradial` and `cf_planes`; nothing here knows what a radar is.
//! Check: their tests read the bytes with an independent reader; here they are held against those of another encoder.

use super::checks::same_length;
use super::parts::FileParts;
use super::provenance::Provenance;
use crate::Error;
use std::collections::BTreeMap;

/// The whole file is held in memory, unless ranks share it; a larger result belongs in one file per time.
pub(crate) const MAX_BYTES: usize = 512 << 20;

/// Largest size of a variable in this format, bytes.
const LARGEST_VARIABLE: u64 = u32::MAX as u64 - 3;

/// Stored in place of a missing float.
pub(crate) const FILL: f32 = -9999.0;

/// Values of a variable or of an attribute as the file stores them, without what fills the last word.
pub(crate) struct Data {
    /// Code of their type in the format.
    code: usize,
    /// Bytes of a value.
    width: usize,
    bytes: Vec<u8>,
}

impl Data {
    fn new<const N: usize>(code: usize, values: impl Iterator<Item = [u8; N]>) -> Self {
        let mut bytes = Vec::with_capacity(N * values.size_hint().0);
        values.for_each(|value| bytes.extend(value));
        Self {
            code,
            width: N,
            bytes,
        }
    }

    pub(crate) fn i8(values: impl IntoIterator<Item = i8>) -> Self {
        Self::new(1, values.into_iter().map(i8::to_be_bytes))
    }

    pub(crate) fn text(text: impl Into<Vec<u8>>) -> Self {
        Self {
            code: 2,
            width: 1,
            bytes: text.into(),
        }
    }

    pub(crate) fn i32(values: impl IntoIterator<Item = i32>) -> Self {
        Self::new(4, values.into_iter().map(i32::to_be_bytes))
    }

    pub(crate) fn f32(values: impl IntoIterator<Item = f32>) -> Self {
        Self::new(5, values.into_iter().map(f32::to_be_bytes))
    }

    pub(crate) fn f64(values: impl IntoIterator<Item = f64>) -> Self {
        Self::new(6, values.into_iter().map(f64::to_be_bytes))
    }

    /// The floats of a slice, such as an axis.
    pub(crate) fn f64_slice(values: &[f64]) -> Self {
        Self::f64(values.iter().copied())
    }

    /// 32-bit floats with [`FILL`] for NaN.
    pub(crate) fn filled<'a>(values: impl IntoIterator<Item = &'a f64>) -> Self {
        Self::f32(
            values
                .into_iter()
                .map(|v| if v.is_nan() { FILL } else { *v as f32 }),
        )
    }

    fn len(&self) -> usize {
        self.bytes.len() / self.width
    }
}

/// One variable.
pub(crate) struct Variable {
    pub(crate) name: String,
    pub(crate) dims: Vec<&'static str>,
    pub(crate) data: Data,
    pub(crate) attrs: Vec<(&'static str, Data)>,
    /// The first of its values that are here, of a variable that ranks share.
    pub(crate) first: Option<usize>,
}

impl Variable {
    pub(crate) fn new(name: &str, dims: &[&'static str], data: Data) -> Self {
        Self {
            name: name.into(),
            dims: dims.to_vec(),
            data,
            attrs: Vec::new(),
            first: None,
        }
    }

    /// Adds a text attribute.
    pub(crate) fn text(self, name: &'static str, value: &str) -> Self {
        self.attr(name, Data::text(value))
    }

    /// Adds an attribute of any type.
    pub(crate) fn attr(mut self, name: &'static str, value: Data) -> Self {
        self.attrs.push((name, value));
        self
    }
}

/// Variables as `cdl` describes them in the notation of `ncdump`, in its order: their dimensions and attributes. Values have the name
/// of their variable; variables without values are skipped. An attribute `?` has the value of the name `variable:attribute`, or is skipped.
pub(crate) fn described(
    cdl: &'static str,
    values: impl IntoIterator<Item = (&'static str, Data)>,
) -> Vec<Variable> {
    // Types in the order of their codes.
    let types = ["byte", "char", "short", "int", "float", "double"];
    let mut values: BTreeMap<&str, Data> = values.into_iter().collect();
    let mut out: Vec<Variable> = Vec::new();
    for line in cdl
        .lines()
        .filter_map(|line| line.trim().strip_suffix(" ;"))
    {
        match line.split_once(" = ") {
            // Such as `float azimuth(time)`.
            None => {
                let (kind, line) = line.split_once(' ').unwrap_or_default();
                let (name, dims) = line
                    .trim_end_matches(')')
                    .split_once('(')
                    .unwrap_or((line, ""));
                let dims: Vec<&str> = dims.split(", ").filter(|dim| !dim.is_empty()).collect();
                let data = values.remove(name);
                debug_assert!(
                    data.iter().all(|data| types[data.code - 1] == kind),
                    "{name} is no {kind}"
                );
                out.extend(data.map(|data| Variable::new(name, &dims, data)));
            }
            Some((key, value)) => {
                let (name, attribute) = key.split_once(':').unwrap_or_default();
                let number = value
                    .strip_suffix('f')
                    .and_then(|number| number.parse::<f32>().ok());
                let value = match number {
                    _ if value == "?" => values.remove(key),
                    Some(number) => Some(Data::f32([number])),
                    None => Some(Data::text(value.trim_matches('"'))),
                };
                let variable = out.last_mut().filter(|variable| variable.name == name);
                variable
                    .into_iter()
                    .zip(value)
                    .for_each(|(variable, value)| variable.attrs.push((attribute, value)));
            }
        }
    }
    debug_assert!(values.is_empty(), "nothing describes {:?}", values.keys());
    out
}

/// Names and lengths of dimensions.
type Dims = Vec<(&'static str, usize)>;

/// A whole file.
pub(crate) struct Layout {
    pub(crate) dims: Dims,
    pub(crate) globals: Vec<(&'static str, String)>,
    pub(crate) variables: Vec<Variable>,
}

impl Layout {
    /// A file of the CF conventions.
    pub(crate) fn cf(
        title: &str,
        dims: Dims,
        variables: Vec<Variable>,
        provenance: &Provenance,
    ) -> Self {
        let history = format!("written by {}", provenance.program);
        let globals = vec![
            ("Conventions", "CF-1.10".into()),
            ("title", title.into()),
            ("history", history),
        ];
        Self {
            dims,
            globals,
            variables,
        }
    }

    /// The bytes of the file. The provenance follows the global attributes, each entry as text.
    pub(crate) fn into_bytes(self, provenance: &Provenance) -> Result<Vec<u8>, Error> {
        self.into_parts(provenance, true).map(FileParts::into_bytes)
    }

    /// The parts of the file that are here: of the variables that ranks share, and, for the first rank, all else.
    pub(crate) fn into_parts(
        mut self,
        provenance: &Provenance,
        is_first: bool,
    ) -> Result<FileParts, Error> {
        self.check()?;
        self.globals.extend(provenance.entries());
        let sizes: Vec<u64> = self
            .variables
            .iter()
            .map(|v| (self.count(v) * v.data.width) as u64)
            .collect();
        if let Some(size) = sizes.iter().find(|size| **size > LARGEST_VARIABLE) {
            let reason =
                format!("a variable of {size} bytes, at most {LARGEST_VARIABLE}: take fewer cells");
            return Err(Error::unsupported("NetCDF", reason));
        }
        // The places of the data do not change the length of the head.
        let mut length = self.head(&sizes, &vec![0; sizes.len()]).len() as u64;
        let mut begins = Vec::with_capacity(sizes.len());
        for size in &sizes {
            begins.push(length);
            length += size.next_multiple_of(4);
        }
        let mut parts = Vec::new();
        if is_first {
            parts.push((0, self.head(&sizes, &begins)));
        }
        for (variable, begin) in self.variables.into_iter().zip(begins) {
            let each = variable.data.width;
            let mut bytes = variable.data.bytes;
            // Behind bytes the value that the library of NetCDF stores where nothing was written.
            let padding = if variable.data.code == 1 {
                (-127_i8) as u8
            } else {
                0
            };
            match variable.first {
                Some(first) => parts.push((begin + (first * each) as u64, bytes)),
                None if is_first => {
                    bytes.resize(bytes.len().next_multiple_of(4), padding);
                    parts.push((begin, bytes));
                }
                None => {}
            }
        }
        Ok(FileParts { length, parts })
    }

    /// Values of a whole variable.
    fn count(&self, variable: &Variable) -> usize {
        let mut count = 1;
        for dim in &variable.dims {
            let length = self.dims.iter().find(|(name, _)| name == dim);
            count *= length.map_or(0, |(_, length)| *length);
        }
        count
    }

    /// Checks the lengths, and that names are valid and differ.
    fn check(&self) -> Result<(), Error> {
        for (place, variable) in self.variables.iter().enumerate() {
            let name = &variable.name;
            if name.is_empty() || name.contains(['/', '\0']) {
                return Err(Error::unsupported("NetCDF", format!("'{name}' is no name")));
            }
            if self.variables[..place]
                .iter()
                .any(|other| other.name == *name)
            {
                return Err(Error::Duplicate {
                    what: "name in NetCDF",
                    name: name.clone(),
                });
            }
            let found = variable.data.len();
            let expected = self.count(variable);
            let axes = variable.dims.join(" x ");
            match variable.first {
                Some(first) if first + found <= expected => {}
                first => same_length(name, first.unwrap_or(0) + found, &axes, expected)?,
            }
        }
        let own = self
            .variables
            .iter()
            .filter(|variable| variable.first.is_none());
        let total: usize = own.map(|v| v.data.bytes.len()).sum();
        if total > MAX_BYTES {
            let reason = format!(
                "{total} bytes in one file, at most {MAX_BYTES}: write one file per time or sweep"
            );
            return Err(Error::unsupported("NetCDF", reason));
        }
        Ok(())
    }

    /// The head of the file, of variables of these sizes at these places \[bytes\].
    fn head(&self, sizes: &[u64], begins: &[u64]) -> Vec<u8> {
        let mut head = b"CDF\x02\0\0\0\0".to_vec();
        push_list(&mut head, 0x0A, self.dims.len());
        for (name, size) in &self.dims {
            push_name(&mut head, name);
            push_number(&mut head, *size);
        }
        push_list(&mut head, 0x0C, self.globals.len());
        for (name, text) in &self.globals {
            push_attribute(&mut head, name, &Data::text(text.as_str()));
        }
        push_list(&mut head, 0x0B, self.variables.len());
        for ((variable, size), begin) in self.variables.iter().zip(sizes).zip(begins) {
            push_name(&mut head, &variable.name);
            push_number(&mut head, variable.dims.len());
            for dim in &variable.dims {
                // Every axis is among the dimensions, or the variable had no values and was refused.
                push_number(
                    &mut head,
                    self.dims
                        .iter()
                        .position(|(name, _)| name == dim)
                        .unwrap_or_default(),
                );
            }
            push_list(&mut head, 0x0C, variable.attrs.len());
            for (name, value) in &variable.attrs {
                push_attribute(&mut head, name, value);
            }
            push_number(&mut head, variable.data.code);
            push_number(&mut head, size.next_multiple_of(4) as usize);
            head.extend(begin.to_be_bytes());
        }
        head
    }
}

/// Adds a number to the head of a file, in a word of four bytes.
fn push_number(head: &mut Vec<u8>, number: usize) {
    head.extend((number as u32).to_be_bytes());
}

/// Adds the tag and the length of a list.
fn push_list(head: &mut Vec<u8>, tag: usize, length: usize) {
    push_number(head, if length == 0 { 0 } else { tag });
    push_number(head, length);
}

fn push_name(head: &mut Vec<u8>, name: &str) {
    push_number(head, name.len());
    push_bytes(head, name.as_bytes());
}

fn push_attribute(head: &mut Vec<u8>, name: &str, value: &Data) {
    push_name(head, name);
    push_number(head, value.code);
    push_number(head, value.len());
    push_bytes(head, &value.bytes);
}

/// Adds bytes and what fills their last word.
fn push_bytes(head: &mut Vec<u8>, bytes: &[u8]) {
    head.extend(bytes);
    head.resize(head.len().next_multiple_of(4), 0);
}

#[cfg(test)]
mod tests {
    use super::super::provenance::example;
    use super::*;
    use netcdf_writer::{NcAttrValue, NcFileBuilder, NcWriteOptions};

    fn layout() -> Layout {
        Layout {
            dims: vec![("time", 3), ("range", 2), ("letters", 5)],
            globals: vec![("title", "A, b".into()), ("empty", String::new())],
            variables: vec![
                Variable::new(
                    "v",
                    &["time", "range"],
                    Data::f32((0..6).map(|i| i as f32 - 2.5)),
                )
                .text("units", "m s-1")
                .attr("_FillValue", Data::f32([FILL])),
                Variable::new("once", &[], Data::f64([1.0 / 3.0])),
                Variable::new("flag", &["letters"], Data::i8([1, -2, 3, 4, 5]))
                    .attr("values", Data::i8([1, 2])),
                Variable::new("word", &["letters"], Data::text("lidar")),
                Variable::new("count", &["time"], Data::i32([7, -8, 9])).text("long_name", ""),
            ],
        }
    }

    #[test]
    fn the_bytes_are_those_of_another_encoder() {
        let mut file = NcFileBuilder::new();
        let ids = [("time", 3), ("range", 2), ("letters", 5)]
            .map(|(name, size)| file.add_dimension(name, size).unwrap());
        let chars = |text: &str| NcAttrValue::Chars(text.into());
        let own = [("title", "A, b".to_owned()), ("empty", String::new())];
        for (name, text) in own.into_iter().chain(example().entries()) {
            file.add_attribute(name, chars(&text)).unwrap();
        }
        let v = file.add_variable::<f32>("v", &ids[..2]).unwrap();
        file.add_variable_attribute(v, "units", chars("m s-1"))
            .unwrap();
        file.add_variable_attribute(v, "_FillValue", NcAttrValue::Floats(vec![FILL]))
            .unwrap();
        file.write_variable(v, &[-2.5_f32, -1.5, -0.5, 0.5, 1.5, 2.5])
            .unwrap();
        let once = file.add_variable::<f64>("once", &[]).unwrap();
        file.write_variable(once, &[1.0 / 3.0]).unwrap();
        let flag = file.add_variable::<i8>("flag", &ids[2..]).unwrap();
        file.add_variable_attribute(flag, "values", NcAttrValue::Bytes(vec![1, 2]))
            .unwrap();
        file.write_variable(flag, &[1_i8, -2, 3, 4, 5]).unwrap();
        let word = file.add_char_variable("word", &ids[2..]).unwrap();
        file.write_char_variable(word, b"lidar").unwrap();
        let count = file.add_variable::<i32>("count", &ids[..1]).unwrap();
        file.add_variable_attribute(count, "long_name", chars(""))
            .unwrap();
        file.write_variable(count, &[7, -8, 9]).unwrap();
        let mut expected = Vec::new();
        file.write(&mut expected, NcWriteOptions::offset64())
            .unwrap();
        assert_eq!(layout().into_bytes(&example()).unwrap(), expected);
    }

    #[test]
    fn parts_of_several_ranks_are_the_file_of_one() {
        let rank = |first: usize, values: &[f32]| {
            let mut layout = layout();
            layout.variables[0].data = Data::f32(values.iter().copied());
            layout.variables[0].first = Some(first);
            layout.into_parts(&example(), first == 0).unwrap()
        };
        let mut parts = rank(0, &[-2.5, -1.5]);
        for other in [rank(2, &[-0.5, 0.5, 1.5]), rank(5, &[2.5]), rank(6, &[])] {
            assert_eq!((other.length, other.parts.len()), (parts.length, 1));
            parts.parts.extend(other.parts);
        }
        assert_eq!(parts.into_bytes(), layout().into_bytes(&example()).unwrap());
        let mut beyond = layout();
        beyond.variables[0].first = Some(1);
        assert!(matches!(
            beyond.into_parts(&example(), true),
            Err(Error::Length { .. })
        ));
        let mut large = layout();
        (large.dims[0].1, large.variables[0].first) = (1 << 30, Some(0));
        large.variables.truncate(1);
        let error = large.into_parts(&example(), true).unwrap_err();
        assert!(matches!(error, Error::Unsupported { .. }), "{error}");
    }

    #[test]
    fn names_that_readers_cannot_take_are_refused() {
        for name in ["", "a/b", "count"] {
            let mut layout = layout();
            layout.variables[0].name = name.into();
            assert!(layout.into_bytes(&example()).is_err(), "{name:?}");
        }
    }

    #[test]
    fn a_variable_of_the_wrong_length_is_refused() {
        let layout = Layout {
            dims: vec![("time", 3), ("range", 2)],
            globals: vec![],
            variables: vec![Variable::new("v", &["time", "range"], Data::f32([0.0; 5]))],
        };
        let error = layout.into_bytes(&example()).unwrap_err();
        assert!(
            matches!(
                error,
                Error::Length {
                    expected: 6,
                    actual: 5,
                    ..
                }
            ),
            "{error}"
        );
    }
}
