//! Tests of the reader: files of other hands, and files that lie.

use super::*;
use crate::io::netcdf::{Data, Layout, Variable};
use crate::io::netcdf_dimensions::{TIME, Z};
use crate::io::planes_input;

/// Name, dimensions, text attributes and values of a variable.
type Sketched<'a> = (&'a str, &'a [u32], &'a [(&'a str, &'a str)], Vec<f64>);

/// The bytes of a classic file: dimensions (0 grows) and variables.
struct Sketch<'a> {
    version: u8,
    dims: &'a [(&'a str, u32)],
    records: u32,
    variables: Vec<Sketched<'a>>,
}

impl Sketch<'_> {
    fn count(&self, value: u64, out: &mut Vec<u8>) {
        let bytes = value.to_be_bytes();
        out.extend(if self.version == 5 {
            &bytes[..]
        } else {
            &bytes[4..]
        });
    }

    fn name(&self, name: &str, out: &mut Vec<u8>) {
        self.count(name.len() as u64, out);
        out.extend(name.as_bytes());
        out.resize(out.len().next_multiple_of(4), 0);
    }

    fn list(&self, tag: u32, count: usize, out: &mut Vec<u8>) {
        out.extend(if count == 0 { 0 } else { tag }.to_be_bytes());
        self.count(count as u64, out);
    }

    /// Header with values at these places.
    fn header(&self, begin: &[u64]) -> Vec<u8> {
        let mut out = vec![b'C', b'D', b'F', self.version];
        self.count(self.records.into(), &mut out);
        self.list(0x0A, self.dims.len(), &mut out);
        for (name, length) in self.dims {
            self.name(name, &mut out);
            self.count((*length).into(), &mut out);
        }
        self.list(0, 0, &mut out);
        self.list(0x0B, self.variables.len(), &mut out);
        for ((name, dims, attributes, values), begin) in self.variables.iter().zip(begin) {
            self.name(name, &mut out);
            self.count(dims.len() as u64, &mut out);
            dims.iter()
                .for_each(|dim| self.count((*dim).into(), &mut out));
            self.list(0x0C, attributes.len(), &mut out);
            for (name, text) in *attributes {
                self.name(name, &mut out);
                out.extend(2_u32.to_be_bytes());
                self.name(text, &mut out);
            }
            out.extend(6_u32.to_be_bytes());
            self.count(8 * values.len() as u64, &mut out);
            let bytes = begin.to_be_bytes();
            out.extend(if self.version == 1 {
                &bytes[4..]
            } else {
                &bytes[..]
            });
        }
        out
    }

    fn bytes(&self) -> Vec<u8> {
        let mut at = self.header(&vec![0; self.variables.len()]).len() as u64;
        let grows = |dims: &[u32]| {
            dims.first()
                .is_some_and(|dim| self.dims[*dim as usize].1 == 0)
        };
        let mut begin = Vec::new();
        // Variables that grow come last; a record has one part of each of them.
        for last in [false, true] {
            for (i, (_, dims, _, values)) in self
                .variables
                .iter()
                .enumerate()
                .filter(|(_, v)| grows(v.1) == last)
            {
                let parts = if grows(dims) {
                    self.records.max(1) as usize
                } else {
                    1
                };
                begin.push((i, at));
                at += (8 * values.len() / parts) as u64;
            }
        }
        begin.sort_unstable();
        let begin: Vec<u64> = begin.into_iter().map(|(_, at)| at).collect();
        let mut out = self.header(&begin);
        let put = |values: &[f64], out: &mut Vec<u8>| {
            values.iter().for_each(|v| out.extend(v.to_be_bytes()))
        };
        self.variables
            .iter()
            .filter(|v| !grows(v.1))
            .for_each(|v| put(&v.3, &mut out));
        for record in 0..self.records as usize {
            for (.., values) in self.variables.iter().filter(|v| grows(v.1)) {
                let part = values.len() / self.records as usize;
                put(&values[record * part..][..part], &mut out);
            }
        }
        out
    }
}

fn planes_of(bytes: &[u8]) -> Result<crate::io::CrossPlanes, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.nc");
    std::fs::write(&path, bytes).unwrap();
    planes_input::read(&path).map_err(|e| e.to_string())
}

/// Two planes of 3 x 4 points whose v is 100 t + 10 z + y, in a given order of dimensions.
fn sketch(version: u8, names: [&'static str; 3], records: u32) -> Sketch<'static> {
    let dims: &'static [(&str, u32)] = Box::leak(Box::new([
        (names[0], if records > 0 { 0 } else { 2 }),
        (names[1], 3),
        (names[2], 4),
    ]));
    let value = |t: usize, z: usize, y: usize| 100.0 * t as f64 + 10.0 * z as f64 + y as f64;
    let all = (0..24)
        .map(|i| value(i / 12, i / 4 % 3, i % 4))
        .collect::<Vec<_>>();
    let line = |n: usize| (0..n).map(|i| i as f64).collect::<Vec<_>>();
    Sketch {
        version,
        dims,
        records,
        variables: vec![
            (names[0], &[0], &[("units", "s")], line(2)),
            (names[1], &[1], &[], line(3)),
            (names[2], &[2], &[], line(4)),
            ("v", &[0, 1, 2], &[], all.clone()),
            ("w", &[0, 1, 2], &[], all),
        ],
    }
}

#[test]
fn all_versions_of_the_format_and_growing_files_are_read() {
    for version in [1, 2, 5] {
        for records in [0, 2] {
            let planes = planes_of(&sketch(version, ["time", "z", "y"], records).bytes()).unwrap();
            assert_eq!(planes.v_m_s.dim(), (2, 3, 4));
            assert_eq!(
                planes.v_m_s[[1, 2, 3]],
                123.0,
                "version {version}, {records} records"
            );
            assert_eq!(
                (planes.time_s, planes.tau),
                (vec![0.0, 1.0], vec![0.0, 1.0])
            );
        }
    }
}

#[test]
fn dimensions_are_found_by_name_and_role_in_any_order() {
    let mut turned = sketch(2, ["t", "height", "lateral"], 0);
    let value = |y: usize, t: usize, z: usize| 100.0 * t as f64 + 10.0 * z as f64 + y as f64;
    for (name, dims, _, values) in &mut turned.variables {
        if ["v", "w"].contains(name) {
            *dims = &[2, 0, 1];
            *values = (0..24).map(|i| value(i / 6, i / 3 % 2, i % 3)).collect();
        }
    }
    let planes = planes_of(&turned.bytes()).unwrap();
    assert_eq!(
        (planes.v_m_s.dim(), planes.v_m_s[[1, 2, 3]]),
        ((2, 3, 4), 123.0)
    );
    let mut of_axis = sketch(2, ["time", "level", "across"], 0);
    of_axis.variables[1].2 = &[("axis", "Z")];
    of_axis.variables[2].2 = &[("axis", "Y")];
    assert_eq!(planes_of(&of_axis.bytes()).unwrap().v_m_s[[1, 2, 3]], 123.0);
    let unknown = planes_of(&sketch(2, ["time", "level", "y"], 0).bytes()).unwrap_err();
    assert!(
        unknown.contains("rename level, in xarray with ds.rename(level=\"z\")"),
        "{unknown}"
    );
    let age = planes_of(&sketch(2, ["tau", "z", "y"], 0).bytes()).unwrap_err();
    assert!(age.contains("no variable time"), "{age}");
    let mut hours = sketch(2, ["time", "z", "y"], 0);
    hours.variables[0].2 = &[("units", "hours since 2000-01-01")];
    assert_eq!(planes_of(&hours.bytes()).unwrap().time_s, vec![0.0, 3600.0]);
    hours.variables[0].2 = &[("units", "months since 2000-01-01")];
    let months = planes_of(&hours.bytes()).unwrap_err();
    assert!(
        months.contains("time has units = \"months since 2000-01-01\": a unit of time is needed"),
        "{months}"
    );
}

#[test]
fn a_header_that_lies_is_refused_without_memory_and_without_a_word_of_the_file() {
    let secret = "the_secret_of_the_file_that_nobody_may_see";
    for version in [1, 2, 5] {
        let mut good = sketch(version, ["time", "z", "y"], 2);
        good.variables[0].2 = &[("secret", "the_secret_of_the_file_that_nobody_may_see")];
        let good = good.bytes();
        let mut refused = 0;
        for at in 0..good.len() - 4 {
            for lie in [0x7fff_ffff_u32, 0x8000_0000, 0xffff_ffff, 0x0fff_ffff, 0] {
                let mut bytes = good.clone();
                bytes[at..at + 4].copy_from_slice(&lie.to_be_bytes());
                if let Err(message) = planes_of(&bytes) {
                    refused += 1;
                    assert!(
                        !message.contains(&secret[..8]) && message.len() < 400,
                        "{message}"
                    );
                }
            }
        }
        assert!(refused > 500, "{refused}");
        for length in 0..good.len() {
            assert!(planes_of(&good[..length]).is_err(), "cut to {length} bytes");
        }
    }
}

#[test]
fn files_of_other_kinds_name_the_remedy_and_nothing_of_their_content() {
    let hdf = b"\x89HDF\r\n\x1a\nsecret";
    let broken = planes_of(hdf).unwrap_err();
    assert!(
        broken.contains("NetCDF-4") && !broken.contains("secret"),
        "{broken}"
    );
    assert!(broken.contains("nccopy -k nc6"), "{broken}");
    let text = planes_of("root:x:0:0:secret\n".repeat(300).as_bytes()).unwrap_err();
    assert!(
        text.contains("not a NetCDF file") && !text.contains("root"),
        "{text}"
    );
    #[cfg(unix)]
    assert!(open(Path::new("/dev/zero")).is_err());
}

#[test]
fn packed_and_missing_values_are_understood() {
    let mut packed = sketch(2, ["time", "z", "y"], 0);
    packed.variables[3].3[0] = DEFAULT_FILL;
    assert!(
        planes_of(&packed.bytes())
            .unwrap_err()
            .contains("v is missing or not finite at index 0")
    );
    let y = [
        ("scale_factor", 0.5),
        ("add_offset", 3.0),
        ("_FillValue", 2.0),
    ]
    .into_iter()
    .fold(
        Variable::new("y", &["y"], Data::f64([0.0, 1.0, 2.0, 3.0])),
        |y, (name, value)| y.attr(name, Data::f64([value])),
    );
    let layout = Layout {
        dims: vec![("y", 4)],
        globals: Vec::new(),
        variables: vec![y],
    };
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(
        file.path(),
        layout
            .into_bytes(&crate::io::provenance::example())
            .unwrap(),
    )
    .unwrap();
    let y = open(file.path()).unwrap().floats("y").unwrap();
    assert_eq!((y[0], y[1], y[3]), (3.0, 3.5, 4.5));
    assert!(y[2].is_nan());
}

/// A file with these variables, over dimensions of their own names or of these.
fn file_of(dims: Vec<(&'static str, usize)>, variables: Vec<Variable>) -> NetcdfFile {
    let layout = Layout {
        dims,
        globals: Vec::new(),
        variables,
    };
    let origin = crate::io::provenance::example();
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), layout.into_bytes(&origin).unwrap()).unwrap();
    open(file.path()).unwrap()
}

#[test]
fn attributes_of_packed_numbers_are_obeyed_in_their_order() {
    let double = |value: f64| Data::f64([value]);
    let bytes = Variable::new("bytes", &["n"], Data::i8([0, 1, 100, -56, -3]))
        .text("_Unsigned", "true")
        .attr("scale_factor", double(0.5))
        .attr("add_offset", double(-10.0))
        .attr("_FillValue", Data::i8([0]))
        .attr("valid_range", Data::i8([1, -6]));
    let stored = [-4000, 200, 3000, 3001, -2_147_483_647];
    let limits = Variable::new("limits", &["n"], Data::i32(stored))
        .attr("scale_factor", double(0.01))
        .attr("valid_min", double(-30.0))
        .attr("valid_max", double(30.0));
    let several = Variable::new("several", &["n"], Data::i32([1, 2, 3, 4, 5]))
        .attr("missing_value", Data::i32([2, 4]));
    let file = file_of(vec![("n", 5)], vec![bytes, limits, several]);
    let missing = f64::NAN;
    for (name, wanted) in [
        ("bytes", [missing, -9.5, 40.0, 90.0, missing]),
        ("limits", [missing, 2.0, 30.0, missing, missing]),
        ("several", [1.0, missing, 3.0, missing, 5.0]),
    ] {
        let found = file.floats(name).unwrap();
        let is_same = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-12 || (a.is_nan() && b.is_nan());
        assert!(found.iter().zip(&wanted).all(is_same), "{name}: {found:?}");
        assert_eq!(
            file.part(name, std::slice::from_ref(&(1..3)))
                .unwrap()
                .len(),
            2
        );
    }
}

#[test]
fn attributes_of_packed_numbers_that_cannot_be_understood_are_named() {
    let plain = |name: &str| Variable::new(name, &["n"], Data::i32([1, 2]));
    let file = file_of(
        vec![("n", 2)],
        vec![
            plain("a").text("scale_factor", "0.5"),
            plain("b").text("_Unsigned", "perhaps"),
            plain("c").attr("valid_range", Data::i32([1])),
        ],
    );
    for (name, words) in [
        (
            "a",
            "variable a has the attribute scale_factor = \"0.5\": a number",
        ),
        (
            "b",
            "variable b has the attribute _Unsigned = \"perhaps\": true or false",
        ),
        ("c", "variable c has the attribute valid_range: two numbers"),
    ] {
        let refused = file.floats(name).unwrap_err();
        assert!(refused.contains(words), "{refused}");
    }
}

#[test]
fn whole_numbers_with_a_factor_of_another_convention_are_refused() {
    let plain = |name: &str| Variable::new(name, &["n"], Data::i32([1, 2]));
    let factor = |variable: Variable, name: &'static str| variable.attr(name, Data::f64([0.5]));
    let floats = Variable::new("c", &["n"], Data::f64([1.0, 2.0]));
    let file = file_of(
        vec![("n", 2)],
        vec![
            factor(plain("a"), "gain"),
            factor(factor(plain("b"), "Scale"), "scale_factor"),
            factor(floats, "gain"),
        ],
    );
    let refused = file.refuse_other_packing("a").unwrap_err();
    assert!(
        refused.contains("whole numbers and the attribute gain"),
        "{refused}"
    );
    for name in ["b", "c"] {
        assert_eq!(file.refuse_other_packing(name), Ok(()));
    }
}

#[test]
fn values_along_falling_coordinates_are_turned_round_and_others_are_not() {
    let values = Data::f64((0..6).map(f64::from));
    let file = file_of(
        vec![("time", 2), ("nz", 3)],
        vec![
            Variable::new("time", &["time"], Data::f64([5.0, 4.0])),
            // Called otherwise than its dimension.
            Variable::new("z", &["nz"], Data::f64([0.3, 0.2, 0.1])).text("units", "km"),
            Variable::new("w", &["time", "nz"], values),
        ],
    );
    let dims = file.roles("w", [TIME, Z]).unwrap();
    assert_eq!(dims, ["time", "nz"]);
    assert_eq!(file.coordinate_m("nz").unwrap(), [100.0, 200.0, 300.0]);
    let turned = file.ordered("w", &dims, None).unwrap();
    assert_eq!(turned, [2.0, 1.0, 0.0, 5.0, 4.0, 3.0]);
    let second = file.ordered("w", &dims[1..], Some(1)).unwrap();
    assert_eq!(second, [5.0, 4.0, 3.0]);
}
