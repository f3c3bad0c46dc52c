//! Raw signals in NetCDF: `signals.nc`, or a user-supplied variable with the samples of a record running fastest, read piece by piece.
//!
//! Check: signals of a run come back; constants of the recording that the scene contradicts are named.

use super::{RawFormat, RawRecords, RecordSource};
use crate::Error;
use crate::io::netcdf_input::{NetcdfFile, open};
use crate::io::number::middle_code;
use crate::io::variable;
use netcdf_reader::NcType;
use num_complex::Complex;
use std::ops::Range;
use std::path::Path;

/// Names of the constants of a recording.
const CONSTANTS: &str = "sampling_frequency intermediate_frequency bandwidth wavelength pulse_repetition_frequency pulse_sigma";

/// Records of samples in a NetCDF file.
#[derive(Debug)]
struct NetcdfRecords {
    file: NetcdfFile,
    /// The variable, and that of the second quadratures.
    name: String,
    second: Option<String>,
    /// Whether the numbers are pairs of both quadratures.
    are_pairs: bool,
    /// Lengths of the dimensions, slowest first, whose places are the records.
    lengths: Vec<u64>,
}

/// Opens the signals of a file.
pub(super) fn read(path: &Path, format: &RawFormat) -> Result<RawRecords, Error> {
    let file = open(path)?;
    signals(path, &file, format).map_err(|reason| file.refuse(reason))
}

fn signals(path: &Path, file: &NetcdfFile, format: &RawFormat) -> Result<RawRecords, String> {
    let name = match &format.variable {
        Some(name) => name.clone(),
        None if file.has("current_a") => "current_a".to_owned(),
        None => {
            return Err(
                "it has no variable current_a: --variable names the one that holds the samples"
                    .into(),
            );
        }
    };
    let mut lengths = file
        .shape(&name)
        .ok_or_else(|| format!("it has no variable {name}"))?;
    if let Some(NcType::Compound { .. }) = file.kind(&name) {
        return Err(format!(
            "variable {name} has numbers of several fields, as h5py stores complex ones: store their real and imaginary parts as two \
             variables, the second named by --quadrature"
        ));
    }
    let second = second_quadrature(file, format, &name, &lengths)?;
    let are_pairs = second.is_none() && format.complex && lengths.last() == Some(&2);
    if are_pairs {
        lengths.pop();
    }
    let samples = lengths.pop();
    let has_records = lengths.iter().all(|length| *length > 0);
    let Some(samples) = samples.filter(|_| has_records) else {
        return Err(format!(
            "variable {name} has no dimension: records with samples are needed"
        ));
    };
    let scale = file.number(&name, "scale_factor").unwrap_or(1.0);
    let (bits, is_unsigned) = integer_kind(file, &name);
    // An offset says itself which code is zero.
    let zero = match is_unsigned && file.number(&name, "add_offset").is_none() {
        true => scale * middle_code(bits),
        false => 0.0,
    };
    let shape = [lengths.iter().product::<u64>() as usize, samples as usize];
    let is_complex = are_pairs || second.is_some();
    let source = NetcdfRecords {
        file: file.clone(),
        name: name.clone(),
        second,
        are_pairs,
        lengths,
    };
    let mut records = RawRecords::new(path, source, shape, is_complex, bits > 0);
    records.packed_scale = scale;
    records.zero = Complex::new(zero, zero);
    read_metadata(file, &mut records)?;
    Ok(records)
}

/// The variable of the second quadrature, if there is one.
fn second_quadrature(
    file: &NetcdfFile,
    format: &RawFormat,
    name: &str,
    lengths: &[u64],
) -> Result<Option<String>, String> {
    let second = match &format.quadrature {
        Some(second) => second.clone(),
        None if name == "current_a" && file.has("quadrature_a") => "quadrature_a".to_owned(),
        None => return Ok(None),
    };
    match file.shape(&second).as_deref() == Some(lengths) {
        true => Ok(Some(second)),
        false => Err(format!(
            "variable {second} does not have the dimensions of {name}"
        )),
    }
}

/// Bits of the integers of a variable, and whether they have no sign; 0 bits for floats.
fn integer_kind(file: &NetcdfFile, name: &str) -> (i32, bool) {
    let (bits, is_unsigned) = match file.kind(name) {
        Some(NcType::Float | NcType::Double) => (0, false),
        Some(NcType::Byte) => (8, false),
        Some(NcType::UByte) => (8, true),
        Some(NcType::Short) => (16, false),
        Some(NcType::UShort) => (16, true),
        Some(NcType::UInt) => (32, true),
        _ => (32, false),
    };
    match file.text(name, "_Unsigned") {
        Some(text) => (bits, bits > 0 && text.eq_ignore_ascii_case("true")),
        None => (bits, is_unsigned),
    }
}

impl RecordSource for NetcdfRecords {
    fn read(
        &mut self,
        records: Range<usize>,
        samples: Range<usize>,
    ) -> Result<Vec<Complex<f64>>, String> {
        let mut out = Vec::with_capacity(records.len() * samples.len());
        for mut part in blocks(&self.lengths, records.start as u64..records.end as u64) {
            part.push(samples.start as u64..samples.end as u64);
            let first = self.file.part(&self.name, &part)?;
            match &self.second {
                Some(second) => {
                    let second = self.file.part(second, &part)?;
                    out.extend(
                        first
                            .into_iter()
                            .zip(second)
                            .map(|(re, im)| Complex::new(re, im)),
                    );
                }
                None if self.are_pairs => {
                    out.extend(
                        first
                            .chunks_exact(2)
                            .map(|pair| Complex::new(pair[0], pair[1])),
                    );
                }
                None => out.extend(first.into_iter().map(|re| Complex::new(re, 0.0))),
            }
        }
        Ok(out)
    }
}

/// Some places in the order of an array, as ranges of its dimensions: whole rows together.
fn blocks(lengths: &[u64], places: Range<u64>) -> Vec<Vec<Range<u64>>> {
    let Some((_, inner)) = lengths.split_first() else {
        return vec![Vec::new()];
    };
    let row = inner.iter().product::<u64>();
    let mut at = places.start;
    let mut out = Vec::new();
    while at < places.end {
        let first = at / row;
        let rows = (places.end - at) / row;
        if at.is_multiple_of(row) && rows > 0 {
            out.push(
                std::iter::once(first..first + rows)
                    .chain(inner.iter().map(|length| 0..*length))
                    .collect(),
            );
            at += rows * row;
        } else {
            let end = places.end.min((first + 1) * row);
            let within = blocks(inner, at % row..at % row + end - at).into_iter();
            out.extend(within.map(|part| {
                std::iter::once(first..first + 1)
                    .chain(part)
                    .collect::<Vec<_>>()
            }));
            at = end;
        }
    }
    out
}

/// Reads what a file says of its records.
fn read_metadata(file: &NetcdfFile, records: &mut RawRecords) -> Result<(), String> {
    let count = records.records;
    records.scene_toml = file.global_text("scene").map(str::to_owned);
    if let Some((_, elevation_rad)) = variable::elevations_rad(file)? {
        records.elevation_rad = one_for_each(elevation_rad, count);
    }
    if let Some(name) = first_variable(file, ["pulse_time", "ray_time"]) {
        records.time_s = one_for_each(file.seconds(name)?, count);
    }
    if let Some(name) = first_variable(file, ["ray_line", "line"]) {
        records.line = one_for_each(file.floats(name)?, count);
    }
    for name in CONSTANTS.split(' ').filter(|name| file.has(name)) {
        if let Some(value) = file.floats(name)?.first() {
            records.constants.insert(name, *value);
        }
    }
    Ok(())
}

/// Values of the records; none for a coordinate of the samples, such as time.
fn one_for_each(values: Vec<f64>, records: usize) -> Option<Vec<f64>> {
    (values.len() == records).then_some(values)
}

fn first_variable(file: &NetcdfFile, names: [&'static str; 2]) -> Option<&'static str> {
    names.into_iter().find(|name| file.has(name))
}

#[cfg(test)]
mod tests {
    use super::super::{RawFormat, RawRecords};
    use crate::io::netcdf::{Data, Layout, Variable};
    use num_complex::Complex;

    fn opened(bytes: Vec<u8>, format: &RawFormat) -> RawRecords {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        RawRecords::open(file.path(), format, 4, 3).unwrap()
    }

    #[test]
    fn any_part_of_the_records_is_read_with_what_the_file_says_of_its_numbers() {
        const DIMS: &[&str] = &["line", "pulse", "sample"];
        let numbers = |from: i32| Data::i32((0..24).map(|i| if i == 5 { -1 } else { from + i }));
        let packed = |name: &str, from: i32| {
            let with = [
                ("scale_factor", 2.0),
                ("add_offset", 1.0),
                ("_FillValue", -1.0),
            ];
            let variable = Variable::new(name, DIMS, numbers(from));
            with.into_iter().fold(variable, |variable, (name, value)| {
                variable.attr(name, Data::f64([value]))
            })
        };
        let variables = vec![packed("current_a", 0), packed("quadrature_a", 100)];
        let layout = Layout {
            dims: vec![("line", 2), ("pulse", 3), ("sample", 4)],
            globals: Vec::new(),
            variables,
        };
        let mut found = opened(
            layout
                .into_bytes(&crate::io::provenance::example())
                .unwrap(),
            &RawFormat::default(),
        );
        assert_eq!(
            (
                found.records,
                found.samples,
                found.is_complex,
                found.whole_scale()
            ),
            (6, 4, true, 2.0)
        );
        assert!(found.are_integers);
        for records in (0..6).flat_map(|first| (first + 1..=6).map(move |end| first..end)) {
            for samples in [0..4, 1..3, 3..4] {
                let part = found
                    .read_samples(records.clone(), samples.clone())
                    .unwrap();
                let places = records
                    .clone()
                    .flat_map(|record| samples.clone().map(move |sample| 4 * record + sample));
                let wanted =
                    places.map(|i| (2.0 * i as f64 + 1.0, 2.0 * (100 + i) as f64 + 1.0, i == 5));
                let is_same = |(sample, (re, im, missing)): (&Complex<f64>, (f64, f64, bool))| {
                    match missing {
                        true => sample.re.is_nan() && sample.im.is_nan(),
                        false => *sample == Complex::new(re, im),
                    }
                };
                assert_eq!(part.len(), records.len() * samples.len());
                assert!(
                    part.iter().zip(wanted).all(is_same),
                    "{records:?} {samples:?}: {part:?}"
                );
            }
        }
    }

    #[test]
    fn the_middle_code_of_bytes_without_sign_is_zero_unless_an_offset_says_otherwise() {
        const DIMS: &[&str] = &["line", "sample"];
        let first = |attributes: &[(&'static str, f64)]| {
            let codes = Data::i8([0, 100, -128, -1, 1, 2, 3, 4]);
            let mut variable = Variable::new("current_a", DIMS, codes).text("_Unsigned", "true");
            for (name, value) in attributes {
                variable = variable.attr(name, Data::f64([*value]));
            }
            let layout = Layout {
                dims: vec![("line", 2), ("sample", 4)],
                globals: Vec::new(),
                variables: vec![variable],
            };
            let bytes = layout.into_bytes(&crate::io::provenance::example());
            let mut found = opened(bytes.unwrap(), &RawFormat::default());
            let record = found.read(0..1).unwrap();
            record.iter().map(|sample| sample.re).collect::<Vec<_>>()
        };
        assert_eq!(first(&[]), [-128.0, -28.0, 0.0, 127.0]);
        assert_eq!(first(&[("scale_factor", 0.5)]), [-64.0, -14.0, 0.0, 63.5]);
        let stated = [("scale_factor", 0.5), ("add_offset", -64.0)];
        assert_eq!(first(&stated), [-64.0, -14.0, 0.0, 63.5]);
    }

    /// Lines with pulses with samples, and what stands beside them, as another program may have stored a `signals.nc` again.
    #[cfg(feature = "netcdf4")]
    #[test]
    fn signals_in_netcdf4_are_those_of_the_array() {
        use crate::io::netcdf4_input::made::of_arrays;
        let numbers = |from: f64| (0..24).map(|i| from + f64::from(i)).collect::<Vec<f64>>();
        let real = ("current_a", &[2, 3, 4][..], numbers(0.5));
        let second = ("quadrature_a", &[2, 3, 4][..], numbers(100.0));
        let lines = ("ray_line", &[6][..], vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        let open = |arrays: &[(&str, &[u64], Vec<f64>)], format: &RawFormat| {
            opened(of_arrays(arrays), format)
        };
        let mut found = open(&[real.clone(), lines], &RawFormat::default());
        found.scale = 2.0;
        assert_eq!(
            (found.records, found.samples, found.is_complex),
            (6, 4, false)
        );
        assert_eq!(found.line, Some(vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0]));
        let some = found.read_samples(1..3, 1..3).unwrap();
        assert_eq!(
            some,
            [5.5, 6.5, 9.5, 10.5].map(|re| Complex::new(2.0 * re, 0.0))
        );
        let mut found = open(&[real, second], &RawFormat::default());
        assert!(found.is_complex);
        assert_eq!(found.read(5..6).unwrap()[3], Complex::new(23.5, 123.0));
        let mut pairs = open(
            &[("volts", &[3, 4, 2], numbers(0.0))],
            &RawFormat {
                variable: Some("volts".into()),
                complex: true,
                ..RawFormat::default()
            },
        );
        assert_eq!(
            (pairs.records, pairs.read(1..2).unwrap()[0]),
            (3, Complex::new(8.0, 9.0))
        );
    }
}
