//! A classic NetCDF file as one table of dimensions, variables and attributes, and the loop that writes it (CDF-2).
//! The layouts live in `cfradial` and `cf_planes`; nothing here knows what a radar is.
//! Check: their tests read the bytes with an independent reader.

use super::error::{OutputError, OutputResult, same_length};
use super::provenance::Provenance;
use netcdf_writer::{DimensionId, NcAttrValue, NcFileBuilder, NcWriteOptions};

/// The encoder holds several copies of the data in memory; a larger result belongs in one file per time.
pub(crate) const MAX_BYTES: usize = 512 << 20;

/// Stored in place of a missing float.
pub(crate) const FILL: f32 = -9999.0;

/// Values of a variable in their stored type.
pub(crate) enum Data {
    F64(Vec<f64>),
    F32(Vec<f32>),
    I32(Vec<i32>),
    I8(Vec<i8>),
    Char(Vec<u8>),
}

impl Data {
    fn len(&self) -> usize {
        match self {
            Self::F64(v) => v.len(),
            Self::F32(v) => v.len(),
            Self::I32(v) => v.len(),
            Self::I8(v) => v.len(),
            Self::Char(v) => v.len(),
        }
    }

    fn bytes(&self) -> usize {
        self.len()
            * match self {
                Self::F64(_) => 8,
                Self::F32(_) | Self::I32(_) => 4,
                Self::I8(_) | Self::Char(_) => 1,
            }
    }

    /// 32-bit floats with [`FILL`] for NaN.
    pub(crate) fn filled<'a>(values: impl IntoIterator<Item = &'a f64>) -> Self {
        let store = |v: &f64| if v.is_nan() { FILL } else { *v as f32 };
        Self::F32(values.into_iter().map(store).collect())
    }
}

/// Value of an attribute.
pub(crate) enum Attr {
    Text(String),
    F32(f32),
    I8(Vec<i8>),
}

impl From<&str> for Attr {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl Attr {
    fn value(&self) -> NcAttrValue {
        match self {
            Self::Text(text) => NcAttrValue::Chars(text.clone()),
            Self::F32(value) => NcAttrValue::Floats(vec![*value]),
            Self::I8(values) => NcAttrValue::Bytes(values.clone()),
        }
    }
}

/// One variable.
pub(crate) struct Variable {
    pub(crate) name: String,
    pub(crate) dims: &'static [&'static str],
    pub(crate) data: Data,
    pub(crate) attrs: Vec<(&'static str, Attr)>,
}

impl Variable {
    pub(crate) fn new(name: &str, dims: &'static [&'static str], data: Data) -> Self {
        Self { name: name.into(), dims, data, attrs: Vec::new() }
    }

    /// Adds a text attribute.
    pub(crate) fn text(mut self, name: &'static str, value: &str) -> Self {
        self.attrs.push((name, value.into()));
        self
    }

    /// Adds an attribute of any type.
    pub(crate) fn attr(mut self, name: &'static str, value: Attr) -> Self {
        self.attrs.push((name, value));
        self
    }
}

/// A whole file.
pub(crate) struct Layout {
    pub(crate) dims: Vec<(&'static str, usize)>,
    pub(crate) globals: Vec<(&'static str, String)>,
    pub(crate) variables: Vec<Variable>,
}

impl Layout {
    /// The bytes of the file. The provenance follows the global attributes, each entry as text.
    ///
    /// Each variable is freed as soon as the encoder has its copy; the encoder makes three more before the file.
    pub(crate) fn into_bytes(self, provenance: &Provenance) -> OutputResult<Vec<u8>> {
        let size = self.check()?;
        let refuse = |e: netcdf_writer::Error| OutputError::encode("NetCDF", e);
        let mut file = NcFileBuilder::new();
        let mut ids: Vec<(&str, DimensionId)> = Vec::new();
        for (name, size) in &self.dims {
            ids.push((name, file.add_dimension(*name, *size as u64).map_err(refuse)?));
        }
        let own = self.globals.into_iter();
        for (name, text) in own.chain(provenance.entries()) {
            file.add_attribute(name, NcAttrValue::Chars(text)).map_err(refuse)?;
        }
        for variable in self.variables {
            add_variable(&mut file, &ids, &variable).map_err(refuse)?;
        }
        // Room for the head; it may grow beyond.
        let mut bytes = Vec::with_capacity(size + (16 << 10));
        file.write(&mut bytes, NcWriteOptions::offset64()).map_err(refuse)?;
        Ok(bytes)
    }

    /// Checks the lengths; the bytes of the data.
    fn check(&self) -> OutputResult<usize> {
        let size = |dim: &str| {
            let found = self.dims.iter().find(|(name, _)| *name == dim);
            found.map_or(0, |(_, size)| *size)
        };
        for variable in &self.variables {
            let expected = variable.dims.iter().map(|d| size(d)).product();
            let axes = variable.dims.join(" x ");
            same_length(&variable.name, variable.data.len(), &axes, expected)?;
        }
        let total: usize = self.variables.iter().map(|v| v.data.bytes()).sum();
        if total > MAX_BYTES {
            return Err(OutputError::Unsupported {
                format: "NetCDF",
                reason: format!("{total} bytes in one file, at most {MAX_BYTES}: write one file per time or sweep"),
            });
        }
        Ok(total)
    }
}

fn add_variable(
    file: &mut NcFileBuilder,
    ids: &[(&str, DimensionId)],
    variable: &Variable,
) -> netcdf_writer::Result<()> {
    let wanted = |(name, _): &&(&str, DimensionId)| variable.dims.contains(name);
    debug_assert_eq!(ids.iter().filter(wanted).count(), variable.dims.len());
    let dims: Vec<DimensionId> =
        variable.dims.iter().filter_map(|d| ids.iter().find(|(name, _)| name == d).map(|(_, id)| *id)).collect();
    let name = variable.name.as_str();
    let id = match &variable.data {
        Data::F64(_) => file.add_variable::<f64>(name, &dims)?,
        Data::F32(_) => file.add_variable::<f32>(name, &dims)?,
        Data::I32(_) => file.add_variable::<i32>(name, &dims)?,
        Data::I8(_) => file.add_variable::<i8>(name, &dims)?,
        Data::Char(_) => file.add_char_variable(name, &dims)?,
    };
    for (attribute, value) in &variable.attrs {
        file.add_variable_attribute(id, *attribute, value.value())?;
    }
    match &variable.data {
        Data::F64(v) => file.write_variable(id, v),
        Data::F32(v) => file.write_variable(id, v),
        Data::I32(v) => file.write_variable(id, v),
        Data::I8(v) => file.write_variable(id, v),
        Data::Char(v) => file.write_char_variable(id, v),
    }
}

#[cfg(test)]
mod tests {
    use super::super::provenance::example;
    use super::*;

    #[test]
    fn a_variable_of_the_wrong_length_is_refused() {
        let layout = Layout {
            dims: vec![("time", 3), ("range", 2)],
            globals: vec![],
            variables: vec![Variable::new("v", &["time", "range"], Data::F32(vec![0.0; 5]))],
        };
        let error = layout.into_bytes(&example()).unwrap_err();
        assert!(matches!(error, OutputError::Length { expected: 6, actual: 5, .. }), "{error}");
    }
}
