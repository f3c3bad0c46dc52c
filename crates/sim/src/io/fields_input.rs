//! Velocity fields in three dimensions from classic NetCDF, one time at once: those that this program writes, those of PALM and
//! WRF with each component on nodes of its own, and any other with coordinates.
//!
//! Check: fields of this program come back; staggered files made with the names and axes of PALM and WRF give the same wind.

use crate::Error;
use crate::io::edges;
use crate::io::netcdf_dimensions::{Role, TIME, X, Y, Z};
use crate::io::netcdf_input::{NetcdfFile, open};
use crate::io::{UtcTime, variable};
use std::path::Path;
use wakescope_les::winds::{Edges, VolumeComponent};

/// Acceleration of gravity by which WRF makes heights of its geopotential, m/s^2.
const WRF_GRAVITY_M_S2: f64 = 9.81;

/// Heights of a level may differ by so much of the highest over a field, if it is to count as level.
const LEVEL: f64 = 2e-3;

/// The place of each field along the time, if the file has such a dimension, and its time in s or in the unit that the file leaves
/// unnamed; and the date from which these count, if it has one.
type FieldTimes = (Vec<(Option<usize>, f64)>, Option<UtcTime>);

/// The fields of a file, in the order of their times.
///
/// # Errors
/// A file that cannot be read or lacks the variable `name`; a time without values.
pub(crate) fn places(path: &Path, name: &str) -> Result<FieldTimes, Error> {
    let file = open(path)?;
    times(&file, name).map_err(|reason| file.refuse(reason))
}

fn times(file: &NetcdfFile, name: &str) -> Result<FieldTimes, String> {
    let Some(dim) = file.dim_of(name, TIME) else {
        // A field without a time dimension: its time is a number beside it.
        if !file.has("time") {
            return Ok((vec![(None, 0.0)], None));
        }
        let (times_s, reference) = dated_seconds(file, "time")?;
        let time_s = times_s.first().copied().unwrap_or(0.0);
        return Ok((vec![(None, time_s)], reference));
    };
    if file.dims(name).and_then(|dims| dims.first().copied()) != Some(dim.as_str()) {
        return Err(format!("{name}: time must be its first dimension"));
    }
    let source = file.coordinate_name(&dim);
    let source = source.or_else(|| file.has("time").then_some("time"));
    // The texts of WRF say the date, too.
    let has_texts = file.texts("Times").is_ok();
    let source = source.filter(|source| !(has_texts && file.has_plain_minutes(source)));
    let (times_s, reference) = match source {
        Some(source) => dated_seconds(file, source)?,
        None => wrf_times(file)?,
    };
    let mut times = Vec::with_capacity(times_s.len());
    for (index, time_s) in times_s.into_iter().enumerate() {
        times.push((Some(index), time_s));
    }
    Ok((times, reference))
}

/// The times of a variable in s, after the whole second of the date from which it counts them if it has one.
fn dated_seconds(file: &NetcdfFile, name: &str) -> Result<(Vec<f64>, Option<UtcTime>), String> {
    let mut times_s = file.seconds(name)?;
    let Some((date, fraction_s)) = variable::reference(file, name) else {
        return Ok((times_s, None));
    };
    for time_s in &mut times_s {
        *time_s += fraction_s;
    }
    Ok((times_s, Some(date)))
}

/// Times of WRF where they are texts alone: in s after the start of the run, or else after the first of them.
fn wrf_times(file: &NetcdfFile) -> Result<(Vec<f64>, Option<UtcTime>), String> {
    let texts = file.texts("Times").map_err(|_| {
        "it has no times: a variable with the name of its time dimension is needed".to_owned()
    })?;
    let mut dates = Vec::with_capacity(texts.len());
    for text in &texts {
        let date = UtcTime::parse_reference(text)
            .ok_or("a text of its variable Times is not a date such as 2024-01-31_12:00:00")?;
        dates.push(date);
    }
    let stated = ["SIMULATION_START_DATE", "START_DATE"]
        .iter()
        .find_map(|name| UtcTime::parse_reference(file.global_text(name)?));
    let start = stated.or(dates.first().copied()).map(|(date, _)| date);
    let mut times_s = Vec::with_capacity(dates.len());
    for (date, fraction_s) in dates {
        let later_s = start.map_or(0.0, |start| date.seconds_since(start));
        times_s.push(later_s + fraction_s);
    }
    Ok((times_s, start))
}

/// The components of one field, in m and m/s or the units that the file leaves unnamed, on the axes of the file.
///
/// # Errors
/// A variable or a coordinate that is missing, a value that is missing, levels that are not level.
pub(crate) fn read(
    path: &Path,
    place: Option<usize>,
    names: &[String; 3],
) -> Result<Components, Error> {
    let file = open(path)?;
    let mut components = Vec::with_capacity(names.len());
    for name in names {
        let component = component(&file, name, place, true);
        components.push(component.map_err(|reason| file.refuse(reason))?);
    }
    let [u, v, w] = components
        .try_into()
        .map_err(|_| file.refuse("it has no three components".to_owned()))?;
    let periods_m = [X, Y].map(|role| stated_period_m(&file, &names[0], role));
    Ok(([u, v, w], periods_m))
}

/// The period along an axis of a variable, m, if the file states one.
fn stated_period_m(file: &NetcdfFile, name: &str, role: Role) -> Option<f64> {
    let text = file.text(&file.dim_of(name, role)?, "edges")?;
    match edges::from_text(text) {
        Some(Edges::Periodic { period_m }) => Some(period_m),
        _ => None,
    }
}

/// The components of a field, and the lengths of the periods along x and y that its file states for the first of them \[m\].
type Components = ([VolumeComponent; 3], [Option<f64>; 2]);

/// A scalar of a field that cannot be negative, in the units and axes of the file.
///
/// # Errors
/// As [`read`]; a negative value.
#[cfg(any(feature = "plots", test))]
pub(crate) fn read_scalar(
    path: &Path,
    place: Option<usize>,
    name: &str,
) -> Result<VolumeComponent, Error> {
    let file = open(path)?;
    let scalar = component(&file, name, place, false).map_err(|reason| file.refuse(reason))?;
    if let Some((at, value)) = scalar
        .values
        .iter()
        .enumerate()
        .find(|(_, value)| **value < 0.0)
    {
        return Err(file.refuse(format!(
            "{name} is {value:?} at place {at}: it must not be negative"
        )));
    }
    Ok(scalar)
}

fn component(
    file: &NetcdfFile,
    name: &str,
    place: Option<usize>,
    is_velocity: bool,
) -> Result<VolumeComponent, String> {
    let dims = match place {
        Some(_) => file
            .roles(name, [TIME, Z, Y, X])
            .map(|[_, z, y, x]| [z, y, x])?,
        None => file.roles(name, [Z, Y, X])?,
    };
    let [z, y, x] = dims.each_ref().map(String::as_str);
    let nodes_m = [
        nodes(file, x, place)?,
        nodes(file, y, place)?,
        nodes(file, z, place)?,
    ];
    let values = match is_velocity {
        true => file.velocities(name, &dims, place)?,
        false => file.ordered(name, &dims, place)?,
    };
    if let Some(at) = values.iter().position(|v| !v.is_finite()) {
        return Err(format!(
            "{name} is missing or not finite at index {at}: cut what the terrain hides, or fill it"
        ));
    }
    Ok(VolumeComponent { nodes_m, values })
}

/// Places of the nodes along a dimension: its coordinate, or what WRF has instead.
fn nodes(file: &NetcdfFile, dim: &str, place: Option<usize>) -> Result<Vec<f64>, String> {
    if file.coordinate_name(dim).is_some() {
        return file.coordinate_m(dim);
    }
    let staggered = dim.ends_with("_stag");
    let step = match dim.trim_end_matches("_stag") {
        "west_east" => "DX",
        "south_north" => "DY",
        "bottom_top" => return levels(file, staggered, place),
        _ => return file.coordinate(dim),
    };
    let Some(step_m) = file.global_number(step).filter(|step_m| *step_m > 0.0) else {
        return Err(format!(
            "it has neither the coordinate of {dim} nor the attribute {step}"
        ));
    };
    let count = file.length(dim).unwrap_or(0);
    let first = if staggered { 0.0 } else { 0.5 };
    Ok((0..count).map(|i| (i as f64 + first) * step_m).collect())
}

/// Heights of WRF's levels above the ground, from the geopotential, if they are level.
fn levels(file: &NetcdfFile, staggered: bool, place: Option<usize>) -> Result<Vec<f64>, String> {
    let both = ["PH", "PHB"].map(|name| geopotential(file, name, place));
    let [(count, disturbed), (_, base)] =
        match both {
            [Ok(ph), Ok(phb)] if ph.1.len() == phb.1.len() && ph.0 > 1 => [ph, phb],
            _ => return Err(
                "its levels have no heights: a coordinate of bottom_top, or PH and PHB are needed"
                    .into(),
            ),
        };
    let mut height_m = Vec::with_capacity(base.len());
    for (disturbed, base) in disturbed.iter().zip(&base) {
        height_m.push((disturbed + base) / WRF_GRAVITY_M_S2);
    }
    let columns = height_m.len() / count;
    let mut mean_m = Vec::with_capacity(count);
    let mut uneven_m = 0_f64;
    for level_m in height_m.chunks_exact(columns) {
        let mean = level_m.iter().sum::<f64>() / columns as f64;
        for height_m in level_m {
            uneven_m = uneven_m.max((height_m - mean).abs());
        }
        mean_m.push(mean);
    }
    let ground_m = mean_m[0];
    let top_m = mean_m[count - 1];
    if uneven_m > LEVEL * (top_m - ground_m) {
        return Err(format!(
            "its levels rise and fall by {uneven_m:.1} m: bring it to levels of constant height first, e.g. by wrf-python's vinterp"
        ));
    }
    let faces_m: Vec<f64> = mean_m.iter().map(|h| h - ground_m).collect();
    if staggered {
        return Ok(faces_m);
    }
    let pairs = faces_m.windows(2);
    Ok(pairs.map(|pair| 0.5 * (pair[0] + pair[1])).collect())
}

/// Number of levels and values of a part of WRF's geopotential, level by level \[m^2/s^2\].
fn geopotential(
    file: &NetcdfFile,
    name: &str,
    place: Option<usize>,
) -> Result<(usize, Vec<f64>), String> {
    let dims = match file.roles(name, [TIME, Z, Y, X]) {
        Ok([_, z, y, x]) => [z, y, x],
        Err(_) => file.roles(name, [Z, Y, X])?,
    };
    let count = file.length(&dims[0]).unwrap_or(0) as usize;
    Ok((count, file.ordered(name, &dims, place)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::netcdf::{Data, Layout, Variable};

    #[test]
    fn velocities_places_and_times_come_in_the_units_that_the_file_names() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fields_0001.nc");
        let wind = |name: &str| {
            let values = (0..64).map(|i| 100.0 * f64::from(i));
            Variable::new(name, &["time", "z", "y", "x"], Data::f64(values)).text("units", "cm s-1")
        };
        let axis = |name: &str, dims: &'static [&'static str]| {
            Variable::new(name, dims, Data::f64((0..4).map(|i| 0.01 * f64::from(i))))
                .text("units", "km")
        };
        let time = Variable::new("time", &["time"], Data::f64([0.5]))
            .text("units", "days since 2024-01-01");
        let scalar = Variable::new("beta", &["time", "z", "y", "x"], Data::f64(vec![2.0; 64]))
            .text("units", "km-1 sr-1");
        let variables = vec![
            time,
            axis("z", &["z"]),
            axis("y", &["y"]),
            axis("x", &["x"]),
            wind("u"),
            wind("v"),
            wind("w"),
            scalar,
        ];
        let layout = Layout {
            dims: vec![("time", 1), ("z", 4), ("y", 4), ("x", 4)],
            globals: Vec::new(),
            variables,
        };
        std::fs::write(
            &path,
            layout
                .into_bytes(&crate::io::provenance::example())
                .unwrap(),
        )
        .unwrap();
        let (times, _) = places(&path, "u").unwrap();
        assert_eq!(times, [(Some(0), 43_200.0)]);
        let names = ["u", "v", "w"].map(str::to_owned);
        for component in read(&path, Some(0), &names).unwrap().0 {
            assert!(
                component
                    .values
                    .iter()
                    .enumerate()
                    .all(|(i, v)| (v - i as f64).abs() < 1e-12)
            );
            assert!(
                component
                    .nodes_m
                    .iter()
                    .flatten()
                    .zip([0.0, 10.0, 20.0, 30.0].iter().cycle())
                    .all(|(a, b)| (a - b).abs() < 1e-12)
            );
        }
        // What the air carries keeps its own unit, which the scene scales.
        let beta = read_scalar(&path, Some(0), "beta").unwrap();
        assert_eq!(beta.values, vec![2.0; 64]);
    }

    /// Writes a file of one field of components that are 1 more at each node, upwards, than at the one below.
    fn staggered(path: &Path, names: [[&'static str; 3]; 3], times: Vec<Variable>) {
        let mut dims = vec![("time", 1), ("DateStrLen", 21)];
        let mut variables = times;
        for name in names.concat() {
            if !dims.contains(&(name, 4)) {
                dims.push((name, 4));
                let own: &'static [&'static str] = vec![name].leak();
                variables.push(Variable::new(name, own, Data::f64([0.0, 1.0, 2.0, 3.0])));
            }
        }
        for (component, [x, y, z]) in ["u", "v", "w"].into_iter().zip(names) {
            let values = Data::f64((0..64).map(|i| f64::from(i / 16)));
            let own: &'static [&'static str] = vec!["time", z, y, x].leak();
            variables.push(Variable::new(component, own, values));
        }
        let layout = Layout {
            dims,
            globals: Vec::new(),
            variables,
        };
        let origin = crate::io::provenance::example();
        std::fs::write(path, layout.into_bytes(&origin).unwrap()).unwrap();
    }

    #[test]
    fn axes_are_known_by_the_names_of_large_eddy_simulations() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("les.nc");
        for names in [
            [["xh", "y", "z"], ["x", "yh", "z"], ["x", "y", "zh"]],
            [["xm", "yt", "zt"], ["xt", "ym", "zt"], ["xt", "yt", "zm"]],
            [["xf", "yh", "zh"], ["xh", "yf", "zh"], ["xh", "yh", "zf"]],
        ] {
            let time = Variable::new("time", &["time"], Data::f64([10.0]));
            let time = time.text("units", "seconds since start");
            staggered(&path, names, vec![time]);
            let found = places(&path, "u").unwrap();
            assert_eq!(found, (vec![(Some(0), 10.0)], None));
            let components = ["u", "v", "w"].map(str::to_owned);
            for component in read(&path, Some(0), &components).unwrap().0 {
                assert!(component.nodes_m.iter().all(|nodes| nodes[3] == 3.0));
                assert_eq!(component.values[63], 3.0, "{names:?}");
            }
        }
    }

    #[test]
    fn each_file_tells_the_date_from_which_its_times_count() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("dated.nc");
        let names = [["x", "y", "z"]; 3];
        let time = Variable::new("time", &["time"], Data::f64([0.5]));
        let time = time.text("units", "minutes since 2024-1-31 13:00 +01:00");
        staggered(&path, names, vec![time]);
        let (times, reference) = places(&path, "u").unwrap();
        let date = reference.map(|date| date.to_string());
        assert_eq!(
            (times[0].1, date.as_deref()),
            (30.0, Some("2024-01-31T12:00:00Z"))
        );
    }

    /// The time of the one field of a file in s, and the date from which it counts.
    fn time_of(times: Vec<Variable>) -> (f64, Option<String>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("timed.nc");
        staggered(&path, [["x", "y", "z"]; 3], times);
        let (times, reference) = places(&path, "u").unwrap();
        (times[0].1, reference.map(|date| date.to_string()))
    }

    #[test]
    fn the_fraction_of_a_second_of_a_date_belongs_to_the_times() {
        let time = Variable::new("time", &["time"], Data::f64([0.25]));
        let time = time.text("units", "seconds since 2024-01-31 12:00:00.5");
        let noon = Some("2024-01-31T12:00:00Z".to_owned());
        assert_eq!(time_of(vec![time]), (0.75, noon.clone()));
        let text = Data::text("2024-01-31_12:00:00.5");
        let texts = Variable::new("Times", &["time", "DateStrLen"], text);
        assert_eq!(time_of(vec![texts]), (0.5, noon));
    }

    #[test]
    fn times_of_wrf_without_a_unit_are_its_texts_or_else_minutes() {
        let minutes = || Variable::new("XTIME", &["time"], Data::f64([5.0]));
        assert_eq!(time_of(vec![minutes()]), (300.0, None));
        let stated = minutes().text("units", "s");
        assert_eq!(time_of(vec![stated]), (5.0, None));
        let text = Data::text("2024-01-31_12:05:00.0");
        let texts = Variable::new("Times", &["time", "DateStrLen"], text);
        let date = Some("2024-01-31T12:05:00Z".to_owned());
        assert_eq!(time_of(vec![minutes(), texts]), (0.0, date));
    }
}
