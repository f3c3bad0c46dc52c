//! Scans in NetCDF-4 with groups: CfRadial 2, and the files of a WindCube as lidarwind reads them.
//! Check: the program reads both as it reads CfRadial 1.4.

use super::scan::FIELDS;
use fixtures::failure::Failure;
use netcdf_writer::{
    DimensionId, NcAttrValue, NcFileBuilder, NcWriteFormat, NcWriteOptions, NcWriteType, VariableId,
};
use wakescope_sim::io::{Ray, VelocityMap};

/// In place of a missing value, as in the files of the program.
const FILL: f32 = -9999.0;

/// A file in the making, and the group that variables are added to.
struct Group<'f> {
    file: &'f mut NcFileBuilder,
    path: String,
}

/// Texts of attributes, by their names.
type Attributes<'a> = &'a [(&'a str, &'a str)];

impl Group<'_> {
    fn dimension(&mut self, name: &str, size: usize) -> Result<DimensionId, Failure> {
        let path = format!("{}{name}", self.path);
        Ok(self.file.add_dimension_path(path, size as u64)?)
    }

    fn numbers<T: NcWriteType>(
        &mut self,
        name: &str,
        dimensions: &[DimensionId],
        values: &[T],
        attributes: Attributes<'_>,
    ) -> Result<VariableId, Failure> {
        let path = format!("{}{name}", self.path);
        let variable = self.file.add_variable_path::<T>(path, dimensions)?;
        self.file.write_variable(variable, values)?;
        self.describe(variable, attributes)?;
        Ok(variable)
    }

    fn texts(
        &mut self,
        name: &str,
        dimensions: &[DimensionId],
        values: &[String],
    ) -> Result<(), Failure> {
        let path = format!("{}{name}", self.path);
        let variable = self.file.add_string_variable_path(path, dimensions)?;
        Ok(self.file.write_string_variable(variable, values)?)
    }

    fn describe(
        &mut self,
        variable: VariableId,
        attributes: Attributes<'_>,
    ) -> Result<(), Failure> {
        for (name, text) in attributes {
            let text = NcAttrValue::Chars((*text).into());
            self.file.add_variable_attribute(variable, *name, text)?;
        }
        Ok(())
    }

    /// Values of cells \[ray, gate\]; NaN is the fill value.
    fn cells(
        &mut self,
        name: &str,
        dimensions: &[DimensionId],
        values: &[f64],
        attributes: Attributes<'_>,
    ) -> Result<(), Failure> {
        let mut filled = Vec::with_capacity(values.len());
        for value in values {
            filled.push(if value.is_nan() { FILL } else { *value as f32 });
        }
        let variable = self.numbers(name, dimensions, &filled, attributes)?;
        Ok(self.file.set_variable_fill_value(variable, FILL)?)
    }
}

/// The values of a field of some rays, one ray after the other.
fn field(map: &VelocityMap, name: &str, (first, last): (usize, usize)) -> Vec<f64> {
    let mut out = Vec::new();
    if let Some(field) = map.field(name) {
        for row in field.values.rows().into_iter().take(last + 1).skip(first) {
            out.extend(row.iter().copied());
        }
    }
    out
}

/// A number of each ray.
fn of_rays<T>(rays: &[Ray], value: impl Fn(&Ray) -> T) -> Vec<T> {
    rays.iter().map(value).collect()
}

fn azimuth_deg(ray: &Ray) -> f32 {
    ray.azimuth_rad.to_degrees().rem_euclid(360.0) as f32
}

fn elevation_deg(ray: &Ray) -> f32 {
    ray.elevation_rad.to_degrees() as f32
}

fn bytes(file: &NcFileBuilder) -> Result<Vec<u8>, Failure> {
    let options = NcWriteOptions {
        format: NcWriteFormat::Nc4,
    };
    Ok(file.to_vec(options)?.1)
}

fn title(file: &mut NcFileBuilder, conventions: &str, map: &VelocityMap) -> Result<(), Failure> {
    let texts = [
        ("Conventions", conventions),
        ("title", &map.title),
        ("institution", "simulation, no institution"),
        ("instrument_name", "simulated lidar"),
        ("source", &super::source()),
        ("references", ""),
        ("history", ""),
        ("comment", ""),
    ];
    for (name, text) in texts {
        file.add_attribute(name, NcAttrValue::Chars(text.into()))?;
    }
    Ok(())
}

/// A scan as CfRadial 2: a group for each sweep.
pub(super) fn cfradial2(map: &VelocityMap) -> Result<Vec<u8>, Failure> {
    let mut file = NcFileBuilder::new();
    title(&mut file, "CF-1.8 CfRadial-2.0", map)?;
    let mut names = Vec::new();
    let mut angles_deg = Vec::new();
    for (number, sweep) in map.sweeps.iter().enumerate() {
        names.push(format!("sweep_{number}"));
        angles_deg.push(sweep.fixed_angle_rad.to_degrees() as f32);
    }
    let mut dates = Vec::new();
    for ray in map.rays.iter().take(1).chain(map.rays.last()) {
        dates.push(map.start().after_s(ray.time_s).to_string());
    }
    let mut root = Group {
        file: &mut file,
        path: String::new(),
    };
    let sweeps = root.dimension("sweep", names.len())?;
    root.texts("sweep_group_name", &[sweeps], &names)?;
    root.numbers("sweep_fixed_angle", &[sweeps], &angles_deg, DEGREES)?;
    root.numbers("volume_number", &[], &[0_i32], &[])?;
    root.texts("time_coverage_start", &[], &dates[..1])?;
    root.texts("time_coverage_end", &[], &dates[1..])?;
    root.texts("platform_type", &[], &["fixed".into()])?;
    root.texts("instrument_type", &[], &["lidar".into()])?;
    let site = &map.site;
    root.numbers(
        "latitude",
        &[],
        &[site.latitude_deg],
        &[("units", "degrees_north")],
    )?;
    root.numbers(
        "longitude",
        &[],
        &[site.longitude_deg],
        &[("units", "degrees_east")],
    )?;
    let altitude_m = site.altitude_m + map.lidar_height_m;
    root.numbers("altitude", &[], &[altitude_m], &[("units", "meters")])?;
    for (number, bounds) in map.sweep_bounds().into_iter().enumerate() {
        sweep_group(&mut file, map, number, bounds)?;
    }
    bytes(&file)
}

const DEGREES: Attributes<'static> = &[("units", "degrees")];
const VELOCITY: Attributes<'static> = &[
    (
        "standard_name",
        "radial_velocity_of_scatterers_away_from_instrument",
    ),
    ("long_name", "radial velocity, positive away from the lidar"),
    ("units", "m s-1"),
    ("coordinates", "elevation azimuth range"),
];
const RATIO: Attributes<'static> = &[
    ("standard_name", "signal_to_noise_ratio"),
    ("units", "dB"),
    ("coordinates", "elevation azimuth range"),
];

/// The group of a sweep of CfRadial 2.
fn sweep_group(
    file: &mut NcFileBuilder,
    map: &VelocityMap,
    number: usize,
    bounds: (usize, usize),
) -> Result<(), Failure> {
    let sweep = &map.sweeps[number];
    let rays = &map.rays[bounds.0..=bounds.1];
    let mut group = Group {
        file,
        path: format!("sweep_{number}/"),
    };
    let time = group.dimension("time", rays.len())?;
    let range = group.dimension("range", map.range_m.len())?;
    let since = format!("seconds since {}", map.start());
    let times_s = of_rays(rays, |ray| ray.time_s);
    let of_time = [("standard_name", "time"), ("units", &since)];
    group.numbers("time", &[time], &times_s, &of_time)?;
    let range_m: Vec<f32> = map.range_m.iter().map(|range_m| *range_m as f32).collect();
    let of_range = [
        ("standard_name", "projection_range_coordinate"),
        ("units", "meters"),
    ];
    group.numbers("range", &[range], &range_m, &of_range)?;
    let azimuths = of_rays(rays, azimuth_deg);
    let of_azimuth = [("standard_name", "ray_azimuth_angle"), ("units", "degrees")];
    group.numbers("azimuth", &[time], &azimuths, &of_azimuth)?;
    let elevations = of_rays(rays, elevation_deg);
    let of_elevation = [
        ("standard_name", "ray_elevation_angle"),
        ("units", "degrees"),
    ];
    group.numbers("elevation", &[time], &elevations, &of_elevation)?;
    group.numbers("sweep_number", &[], &[number as i32], &[])?;
    group.texts("sweep_mode", &[], &[sweep.mode.name().into()])?;
    group.texts("follow_mode", &[], &["none".into()])?;
    group.texts("prt_mode", &[], &["fixed".into()])?;
    let fixed_deg = sweep.fixed_angle_rad.to_degrees() as f32;
    group.numbers("sweep_fixed_angle", &[], &[fixed_deg], DEGREES)?;
    let cells = [time, range];
    group.cells(FIELDS[0], &cells, &field(map, FIELDS[0], bounds), VELOCITY)?;
    group.cells(FIELDS[1], &cells, &field(map, FIELDS[1], bounds), RATIO)
}

/// A scan of beams that point, as a WindCube writes it: one group, times at the ends of the rays.
pub(super) fn windcube(map: &VelocityMap) -> Result<Vec<u8>, Failure> {
    let mut file = NcFileBuilder::new();
    title(&mut file, "CF-1.8 CfRadial-2.0", map)?;
    let name = String::from("Sweep_1001");
    let mut root = Group {
        file: &mut file,
        path: String::new(),
    };
    let sweeps = root.dimension("sweep", 1)?;
    root.texts("sweep_group_name", &[sweeps], std::slice::from_ref(&name))?;
    let rays = &map.rays;
    let mut group = Group {
        file: &mut file,
        path: name + "/",
    };
    let time = group.dimension("time", rays.len())?;
    let gate = group.dimension("gate_index", map.range_m.len())?;
    group.texts("time_reference", &[], &[map.start().to_string()])?;
    let since = format!("seconds since {}", map.start());
    let half_s = half_step_s(rays);
    let times_s = of_rays(rays, |ray| ray.time_s + half_s);
    group.numbers("time", &[time], &times_s, &[("units", &since)])?;
    let numbers: Vec<i32> = (0..rays.len() as i32).collect();
    group.numbers("ray_index", &[time], &numbers, &[])?;
    group.numbers("azimuth", &[time], &of_rays(rays, azimuth_deg), DEGREES)?;
    group.numbers("elevation", &[time], &of_rays(rays, elevation_deg), DEGREES)?;
    let gates: Vec<i32> = (0..map.range_m.len() as i32).collect();
    group.numbers("gate_index", &[gate], &gates, &[])?;
    let range_m: Vec<f32> = map.range_m.iter().map(|range_m| *range_m as f32).collect();
    group.numbers("range", &[gate], &range_m, &[("units", "m")])?;
    let cells = [time, gate];
    let mut height_m = Vec::new();
    for ray in rays {
        let sine = ray.elevation_rad.sin();
        height_m.extend(map.range_m.iter().map(|range_m| range_m * sine));
    }
    let count = height_m.len();
    group.cells("measurement_height", &cells, &height_m, &[("units", "m")])?;
    let all = (0, rays.len() - 1);
    let velocity_m_s = field(map, FIELDS[0], all);
    group.cells("radial_wind_speed", &cells, &velocity_m_s, &VELOCITY[..3])?;
    group.numbers("radial_wind_speed_status", &cells, &vec![1_i8; count], &[])?;
    group.cells(
        "cnr",
        &cells,
        &field(map, FIELDS[1], all),
        &[("units", "dB")],
    )?;
    group.cells("relative_beta", &cells, &vec![1e-7; count], &[])?;
    bytes(&file)
}

/// Half of the usual time between rays, s.
pub(super) fn half_step_s(rays: &[Ray]) -> f64 {
    let mut steps_s: Vec<f64> = rays
        .windows(2)
        .map(|pair| pair[1].time_s - pair[0].time_s)
        .collect();
    steps_s.sort_by(f64::total_cmp);
    0.5 * steps_s.get(steps_s.len() / 2).copied().unwrap_or(0.0)
}
