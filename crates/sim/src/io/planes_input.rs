//! Cross-planes of a simulated flow, read back from the files that `wakescope flow` writes.
//!
//! A file has the variables `v` and `w` over (`tau`, `z`, `y`), the coordinates of the same names, and `time`, in SI units or
//! those that their attributes `units` name; attributes
//! `edges` of `y` and `z` say what lies beyond their ends. Files of others may have `time` in place of `tau`, and any order.
//! Check: what was written comes back; files that lack something are refused by name.

use crate::Error;
use crate::io::netcdf_dimensions::{TIME, Y, Z};
use crate::io::netcdf_input::{NetcdfFile, open};
use crate::io::{CrossPlanes, OPEN_EDGES, edges};
use ndarray::Array3;
use std::path::{Path, PathBuf};
use wakescope_les::winds::Edges;

/// The files that `planes` names: itself, or the numbered files `planes_0001.nc`, ... in the order of their names.
///
/// # Errors
/// There is neither.
pub(crate) fn files(planes: &Path) -> Result<Vec<PathBuf>, Error> {
    if planes.is_file() {
        return Ok(vec![planes.to_owned()]);
    }
    let folder = planes
        .parent()
        .filter(|f| !f.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let stem = file_name(planes);
    let mut found = Vec::new();
    if let Ok(entries) = std::fs::read_dir(folder) {
        for entry in entries.flatten() {
            let path = entry.path();
            if is_numbered(&file_name(&path), &stem) {
                found.push(path);
            }
        }
    }
    // Longer numbers behind shorter ones.
    found.sort_by_key(|path| (path.as_os_str().len(), path.clone()));
    if found.is_empty() {
        let folder = folder.display();
        return Err(Error::input(
            planes,
            format!("neither a file nor the beginning of files {stem}_0001.nc, ... in {folder}"),
        ));
    }
    Ok(found)
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Whether a file name is the stem with a number, such as `planes_0001.nc`.
fn is_numbered(name: &str, stem: &str) -> bool {
    let number = name
        .strip_prefix(&format!("{stem}_"))
        .and_then(|rest| rest.strip_suffix(".nc"));
    number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
}

/// Reads one file.
///
/// # Errors
/// A file that cannot be read, lacks a variable, or has values that are missing.
pub(crate) fn read(path: &Path) -> Result<CrossPlanes, Error> {
    let file = open(path)?;
    planes(&file).map_err(|reason| file.refuse(reason))
}

fn planes(file: &NetcdfFile) -> Result<CrossPlanes, String> {
    let dims = file.roles("v", [TIME, Z, Y])?;
    let others = file.roles("w", [TIME, Z, Y])?;
    if dims != others {
        return Err("v and w do not have the same dimensions".into());
    }
    let [time, z, y] = &dims;
    let z_m = file.coordinate_m(z)?;
    let y_m = file.coordinate_m(y)?;
    let count = file.coordinate(time)?.len();
    let tau = ages(file, time, count)?;
    let time_s = times_s(file, time, count)?;
    let shape = (tau.len(), z_m.len(), y_m.len());
    let v_m_s = component(file, "v", &dims, shape)?;
    let w_m_s = component(file, "w", &dims, shape)?;
    let y_edges = ends(file, y)?;
    let z_edges = ends(file, z)?;
    let planes = CrossPlanes {
        title: String::new(),
        tau,
        time_s,
        y_m,
        z_m,
        v_m_s,
        w_m_s,
        y_edges,
        z_edges,
    };
    planes.check().map_err(|e| e.to_string())?;
    Ok(planes)
}

/// A component of the wind in all planes, m/s.
fn component(
    file: &NetcdfFile,
    name: &str,
    dims: &[String; 3],
    shape: (usize, usize, usize),
) -> Result<Array3<f64>, String> {
    let values = file.velocities(name, dims, None)?;
    if let Some(index) = values.iter().position(|v| !v.is_finite()) {
        return Err(format!("{name} is missing or not finite at index {index}"));
    }
    Array3::from_shape_vec(shape, values)
        .map_err(|_| format!("{name} does not have the lengths of its coordinates"))
}

/// Whether the planes lie along their ages.
fn is_age(dim: &str) -> bool {
    ["tau", "age"].contains(&dim.to_ascii_lowercase().as_str())
}

/// Ages of the planes: the variable `tau`, or else the coordinate of the planes, which may be their times \[s\].
fn ages(file: &NetcdfFile, dim: &str, count: usize) -> Result<Vec<f64>, String> {
    let source = if file.has("tau") { "tau" } else { dim };
    let ages = match is_age(dim) {
        true => file.floats(source)?,
        false => file.seconds(source)?,
    };
    one_for_each("tau", ages, count)
}

/// Times of the planes, s: the variable `time`, or else the coordinate of the planes.
fn times_s(file: &NetcdfFile, dim: &str, count: usize) -> Result<Vec<f64>, String> {
    if is_age(dim) && !file.has("time") {
        return Err("it has no variable time, the times of the planes in s".into());
    }
    let source = if file.has("time") { "time" } else { dim };
    one_for_each("time", file.seconds(source)?, count)
}

fn one_for_each(name: &str, values: Vec<f64>, count: usize) -> Result<Vec<f64>, String> {
    match values.len() == count {
        true => Ok(values),
        false => Err(format!("{name} has not one value for each plane")),
    }
}

/// The ends of an axis; open if the file does not say.
fn ends(file: &NetcdfFile, axis: &str) -> Result<Edges, String> {
    match file.text(axis, "edges") {
        Some(text) => edges::from_text(text).ok_or_else(|| {
            "an attribute edges must be as `wakescope flow` writes it, or be taken out".to_owned()
        }),
        None => Ok(OPEN_EDGES),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::cf_planes::cf_planes_bytes;
    use crate::io::samples;
    use wakescope_les::winds::Side;

    fn written(planes: &CrossPlanes) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plane1_0001.nc");
        let origin = crate::io::provenance::example();
        std::fs::write(&path, cf_planes_bytes(planes, &origin).unwrap()).unwrap();
        (folder, path)
    }

    fn whole() -> CrossPlanes {
        let mut planes = samples::planes();
        planes.v_m_s[[0, 0, 0]] = 0.25;
        planes.y_edges = Edges::Periodic { period_m: 100.0 };
        let ground = Side::NoSlipWall {
            position_m: 0.0,
            velocity_m_s: [0.0; 3],
        };
        planes.z_edges = Edges::Bounded {
            low: ground,
            high: Side::Open,
        };
        planes
    }

    #[test]
    fn planes_come_back_with_their_walls_and_periods() {
        let planes = whole();
        let (_folder, path) = written(&planes);
        let found = read(&path).unwrap();
        let single = |field: &Array3<f64>| field.mapv(|v| f64::from(v as f32));
        assert_eq!(
            (found.v_m_s, found.w_m_s),
            (single(&planes.v_m_s), single(&planes.w_m_s))
        );
        assert_eq!(
            (found.y_m, found.z_m, found.time_s),
            (planes.y_m, planes.z_m, planes.time_s)
        );
        assert_eq!(
            (found.tau, found.y_edges, found.z_edges),
            (planes.tau, planes.y_edges, planes.z_edges)
        );
    }

    /// The same planes with other units, made with nothing but what a client has.
    fn with_units(units: [&str; 3], scale: [f64; 3]) -> Result<CrossPlanes, Error> {
        use crate::io::netcdf::{Data, Layout, Variable};
        let [velocity, length, time] = scale;
        let axis =
            |name: &str, dims: &'static [&'static str], values: &[f64], scale: f64, units: &str| {
                let values = values.iter().map(|v| v / scale);
                Variable::new(name, dims, Data::f64(values)).text("units", units)
            };
        let planes = whole();
        let flat = |field: &Array3<f64>| field.iter().copied().collect::<Vec<f64>>();
        let variables = vec![
            axis("time", &["time"], &planes.time_s, time, units[2]),
            axis("z", &["z"], &planes.z_m, length, units[1]),
            axis("y", &["y"], &planes.y_m, length, units[1]),
            axis(
                "v",
                &["time", "z", "y"],
                &flat(&planes.v_m_s),
                velocity,
                units[0],
            ),
            axis(
                "w",
                &["time", "z", "y"],
                &flat(&planes.w_m_s),
                velocity,
                units[0],
            ),
        ];
        let dims = vec![
            ("time", planes.time_s.len()),
            ("z", planes.z_m.len()),
            ("y", planes.y_m.len()),
        ];
        let file = Layout {
            dims,
            globals: Vec::new(),
            variables,
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plane1_0001.nc");
        std::fs::write(
            &path,
            file.into_bytes(&crate::io::provenance::example()).unwrap(),
        )
        .unwrap();
        read(&path)
    }

    #[test]
    fn velocities_lengths_and_times_come_in_the_units_that_the_file_names() {
        let planes = whole();
        for (units, scale) in [
            (["m s-1", "m", "s"], [1.0; 3]),
            (
                ["cm s-1", "km", "days since 2024-02-29 23:59:58"],
                [0.01, 1e3, 86_400.0],
            ),
            (
                ["km/h", "cm", "nanoseconds since 2000-01-01"],
                [1.0 / 3.6, 0.01, 1e-9],
            ),
            (
                ["knots", "metre", "milliseconds"],
                [1852.0 / 3600.0, 1.0, 1e-3],
            ),
            (["", "", ""], [1.0; 3]),
        ] {
            let found = with_units(units, scale).unwrap();
            let close = |a: &[f64], b: &[f64]| {
                a.iter()
                    .zip(b)
                    .all(|(a, b)| (a - b).abs() <= 1e-12 * b.abs())
            };
            assert!(
                close(&found.y_m, &planes.y_m) && close(&found.z_m, &planes.z_m),
                "{units:?}: {:?}",
                found.z_m
            );
            assert!(
                close(&found.time_s, &planes.time_s) && close(&found.tau, &planes.time_s),
                "{units:?}"
            );
            let flat = |field: &Array3<f64>| field.iter().copied().collect::<Vec<f64>>();
            assert!(
                close(&flat(&found.v_m_s), &flat(&planes.v_m_s)),
                "{units:?}"
            );
            assert!(
                close(&flat(&found.w_m_s), &flat(&planes.w_m_s)),
                "{units:?}"
            );
        }
        for (units, name) in [
            (["furlongs", "m", "s"], "v has units"),
            (["m", "m", "s"], "v has units"),
            (["m/s", "degrees", "s"], "z has units"),
        ] {
            let message = with_units(units, [1.0; 3]).unwrap_err().to_string();
            assert!(message.contains(name), "{message}");
        }
    }

    #[test]
    fn missing_values_and_missing_files_are_refused_by_name() {
        let (_folder, path) = written(&samples::planes());
        let message = read(&path).unwrap_err().to_string();
        assert!(
            message.contains("plane1_0001.nc: v is missing"),
            "{message}"
        );
        let folder = tempfile::tempdir().unwrap();
        let message = files(&folder.path().join("plane1"))
            .unwrap_err()
            .to_string();
        assert!(message.contains("plane1_0001.nc"), "{message}");
        std::fs::write(folder.path().join("other.nc"), b"no such file").unwrap();
        let message = read(&folder.path().join("other.nc"))
            .unwrap_err()
            .to_string();
        assert!(message.contains("not a NetCDF file"), "{message}");
    }

    #[test]
    fn numbered_files_come_in_the_order_of_their_numbers() {
        let folder = tempfile::tempdir().unwrap();
        for name in [
            "plane1_0002.nc",
            "plane1_10000.nc",
            "plane1_0001.nc",
            "plane1_x.nc",
            "plane10_0001.nc",
        ] {
            std::fs::write(folder.path().join(name), b"").unwrap();
        }
        let found = files(&folder.path().join("plane1")).unwrap();
        let names: Vec<_> = found
            .iter()
            .map(|p| p.file_name().unwrap().to_string_lossy().into_owned())
            .collect();
        assert_eq!(
            names,
            ["plane1_0001.nc", "plane1_0002.nc", "plane1_10000.nc"]
        );
    }
}
