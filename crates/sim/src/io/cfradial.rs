//! A scanned map as CfRadial 1.4 in classic NetCDF: rays along `time`, gates along `range`, sweeps of one mode.
//! Opens in Py-ART (`pyart.io.read_cfradial`), xradar (`open_cfradial1_datatree(f, first_dim="time")`), wradlib, xarray, scipy.
//! Ray times count from the start of the flow, whose date is that of the map's site: a synthetic one where none was given.
//! Check: the tests read the bytes back with an independent reader and hold them to the list that the clients need.

use super::map::{Field, Ray, Unit, VelocityMap};
use super::netcdf::{Data, FILL, Layout, Variable, described};
use super::provenance::Provenance;
use super::utc::MAX_TIME_S;
use crate::Error;
use crate::beams::SweepMode;
use std::f64::consts::FRAC_PI_2;

/// Length of all text variables; unused bytes are NUL, since blanks stay in the strings of xarray and Py-ART.
const TEXT: usize = 32;
/// The file's bytes.
///
/// `radial_velocity` is the estimate; a map without one gets a copy of the first of `v_gate`, `v_pulse`, `v_exact` under that name
/// (its `comment` says so), because no client opens a file without it.
///
/// # Errors
/// What [`VelocityMap::check`] finds, ray times beyond 1e9 s, no velocity at all, a result too large for one file.
pub fn cfradial_bytes(map: &VelocityMap, provenance: &Provenance) -> Result<Vec<u8>, Error> {
    layout(map, provenance)?.into_bytes(provenance)
}

/// Bytes of data of a run's map with this number of rays and gates, rounded up: 16 fields, and what each ray has.
pub(crate) fn data_bytes(rays: f64, gates: f64) -> f64 {
    64.0 * rays * gates + 64.0 * rays + 4.0 * gates + 4096.0
}

fn layout(map: &VelocityMap, provenance: &Provenance) -> Result<Layout, Error> {
    map.check()?;
    let times: Vec<f64> = map.rays.iter().map(|r| r.time_s).collect();
    if let Some(bad) = times.iter().find(|t| t.abs() > MAX_TIME_S) {
        let allowed = format!("within {MAX_TIME_S:?} s of the start of the flow");
        return Err(Error::value("ray time_s", format!("{bad:?}"), allowed));
    }
    let mut values = axes(map, times);
    values.extend(site(map));
    values.extend(sweeps(map));
    values.extend(texts(map));
    values.extend(instrument(map));
    let mut variables = described(include_str!("cfradial.cdl"), values);
    if !map.is_carried() {
        // A lidar that does not move has one position for all rays.
        for variable in &mut variables {
            if ["latitude", "longitude", "altitude"].contains(&variable.name.as_str()) {
                variable.dims.clear();
            }
        }
    }
    variables.extend(fields(map, &provenance.scene_toml)?);
    Ok(Layout {
        dims: vec![
            ("time", map.rays.len()),
            ("range", map.range_m.len()),
            ("sweep", map.sweeps.len()),
            ("string_length_32", TEXT),
            ("frequency", 1),
        ],
        globals: globals(map, provenance),
        variables,
    })
}

const SIMULATED: &str = "Simulated measurement: date, latitude and longitude are those of the scene, or synthetic; velocity is positive \
                         away from the lidar";
const MEASURED: &str = "Estimated from recorded signals: date, latitude and longitude are those of the scene, or synthetic; velocity \
                        is positive away from the lidar";

fn globals(map: &VelocityMap, provenance: &Provenance) -> Vec<(&'static str, String)> {
    let (institution, comment, simulated) = match map.is_simulated {
        true => ("simulation, no institution", SIMULATED, "true"),
        false => ("", MEASURED, "false"),
    };
    let entries = [
        ("Conventions", "CF-1.7 CF/Radial instrument_parameters"),
        ("version", "1.4"),
        ("institution", institution),
        (
            "references",
            "CfRadial data file format, version 1.4, NCAR (2016)",
        ),
        ("comment", comment),
        ("instrument_name", "wakescope lidar"),
        (
            "scan_name",
            map.sweeps.first().map_or("rhi", |sweep| sweep.mode.name()),
        ),
        (
            "platform_is_mobile",
            if map.is_carried() { "true" } else { "false" },
        ),
        ("n_gates_vary", "false"),
        ("ray_times_increase", "true"),
        ("simulated", simulated),
        ("title", &map.title),
        ("site_name", &map.site.name),
        ("history", &format!("written by {}", provenance.program)),
    ];
    entries.map(|(name, text)| (name, text.to_owned())).into()
}

/// Values and attributes by the names that the description of the variables has for them.
type Values = Vec<(&'static str, Data)>;

fn axes(map: &VelocityMap, times: Vec<f64>) -> Values {
    let gates = &map.range_m;
    let spacing = if gates.len() > 1 {
        gates[1] - gates[0]
    } else {
        0.0
    };
    // Gate centres come from sums and products of a few terms: equal to a part in 1e6 is constant.
    let constant = gates
        .windows(2)
        .all(|w| (w[1] - w[0] - spacing).abs() <= 1e-6 * spacing);
    let mut azimuth_deg = Vec::with_capacity(map.rays.len());
    let mut elevation_deg = Vec::with_capacity(map.rays.len());
    for ray in &map.rays {
        azimuth_deg.push(turn(ray.azimuth_rad).to_degrees() as f32);
        elevation_deg.push(ray.elevation_rad.to_degrees() as f32);
    }
    vec![
        ("time", Data::f64(times)),
        (
            "time:units",
            Data::text(format!("seconds since {}", map.start())),
        ),
        ("range", single(gates)),
        (
            "range:spacing_is_constant",
            Data::text(if constant { "true" } else { "false" }),
        ),
        (
            "range:meters_to_center_of_first_gate",
            Data::f32([gates[0] as f32]),
        ),
        ("range:meters_between_gates", Data::f32([spacing as f32])),
        ("azimuth", Data::f32(azimuth_deg)),
        ("elevation", Data::f32(elevation_deg)),
    ]
}

/// What the attribute `folding` of `nyquist_velocity` says of real currents: faster air is mirrored, and no multiple of it is lost.
pub(crate) const MIRRORED: &str = "mirrored";

/// Length of a degree of latitude on a sphere with the mean radius of the Earth, m.
const DEGREE_M: f64 = 6_371_008.8 * std::f64::consts::PI / 180.0;

/// Latitude, longitude and altitude of the lidar, one for all rays or, of a lidar that moves, one for each with its motion.
fn site(map: &VelocityMap) -> Values {
    // A scan in one plane without a flight of its own looks across it.
    let across_rad = map
        .rays
        .first()
        .map_or(0.0, |ray| ray.azimuth_rad - FRAC_PI_2);
    let heading_rad = map
        .flight
        .map_or(across_rad, |(_, azimuth_rad)| azimuth_rad);
    let carriers = map.rays.iter().filter_map(|ray| ray.carrier);
    let mut positions_m: Vec<[f64; 3]> = carriers.map(|(position_m, _)| position_m).collect();
    if positions_m.is_empty() {
        let x_m = map.flight.map_or(0.0, |(x_m, _)| x_m);
        positions_m.push([x_m, map.lidar_y_m, map.lidar_height_m]);
    }
    let width = map.site.latitude_deg.to_radians().cos();
    let mut latitude_deg = Vec::with_capacity(positions_m.len());
    let mut longitude_deg = Vec::with_capacity(positions_m.len());
    let mut altitude_m = Vec::with_capacity(positions_m.len());
    for [x_m, y_m, z_m] in positions_m {
        let (north_m, east_m) = north_east(heading_rad, x_m, y_m);
        latitude_deg.push(map.site.latitude_deg + north_m / DEGREE_M);
        longitude_deg.push(map.site.longitude_deg + east_m / (DEGREE_M * width));
        altitude_m.push(map.site.altitude_m + z_m);
    }
    let mut values = vec![
        ("latitude", Data::f64(latitude_deg)),
        ("longitude", Data::f64(longitude_deg)),
        ("altitude", Data::f64(altitude_m)),
    ];
    if map.is_carried() {
        values.extend(carrier_motion(map, heading_rad));
    }
    values
}

/// Components along the flight and to the right of it as components to the north and to the east.
fn north_east(heading_rad: f64, along: f64, right: f64) -> (f64, f64) {
    let (sin, cos) = heading_rad.sin_cos();
    (along * cos - right * sin, along * sin + right * cos)
}

/// Attitude and velocity of a level carrier that heads along the flight and drifts where its track differs from its heading.
fn carrier_motion(map: &VelocityMap, heading_rad: f64) -> Values {
    let heading_deg = turn(heading_rad).to_degrees() as f32;
    let mut rotation_deg = Vec::new();
    let mut tilt_deg = Vec::new();
    let mut drift_deg = Vec::new();
    let mut eastward_m_s = Vec::new();
    let mut northward_m_s = Vec::new();
    let mut vertical_m_s = Vec::new();
    for ray in &map.rays {
        rotation_deg.push(ray.azimuth_rad.to_degrees() as f32 - heading_deg);
        tilt_deg.push(ray.elevation_rad.to_degrees() as f32);
        let Some((_, velocity_m_s)) = ray.carrier else {
            continue;
        };
        let (north_m_s, east_m_s) = north_east(heading_rad, velocity_m_s[0], velocity_m_s[1]);
        let drift_rad = if north_m_s == 0.0 && east_m_s == 0.0 {
            0.0
        } else {
            east_m_s.atan2(north_m_s) - heading_rad
        };
        drift_deg.push(drift_rad.sin().atan2(drift_rad.cos()).to_degrees() as f32);
        eastward_m_s.push(east_m_s as f32);
        northward_m_s.push(north_m_s as f32);
        vertical_m_s.push(velocity_m_s[2] as f32);
    }
    let heading_deg = vec![heading_deg; drift_deg.len()];
    let level_deg = vec![0.0; map.rays.len()];
    vec![
        ("heading", Data::f32(heading_deg)),
        ("roll", Data::f32(level_deg.clone())),
        ("pitch", Data::f32(level_deg)),
        ("drift", Data::f32(drift_deg)),
        ("rotation", Data::f32(rotation_deg)),
        ("tilt", Data::f32(tilt_deg)),
        ("eastward_velocity", Data::f32(eastward_m_s)),
        ("northward_velocity", Data::f32(northward_m_s)),
        ("vertical_velocity", Data::f32(vertical_m_s)),
    ]
}

fn sweeps(map: &VelocityMap) -> Values {
    let mut first_rays = Vec::new();
    let mut last_rays = Vec::new();
    for (first, last) in map.sweep_bounds() {
        first_rays.push(first as i32);
        last_rays.push(last as i32);
    }
    let mut fixed_deg = Vec::new();
    let mut ages = Vec::new();
    for sweep in &map.sweeps {
        let angle_rad = match sweep.mode {
            SweepMode::Rhi => turn(sweep.fixed_angle_rad),
            _ => sweep.fixed_angle_rad,
        };
        fixed_deg.push(angle_rad.to_degrees() as f32);
        ages.push(sweep.tau as f32);
    }
    let is_rhi = map.sweeps.iter().all(|sweep| sweep.mode == SweepMode::Rhi);
    let fixed_name = if is_rhi {
        "azimuth of the scan plane"
    } else {
        "angle that stays during the sweep"
    };
    let mut values = vec![
        ("volume_number", Data::i32([0])),
        ("sweep_number", Data::i32(0..first_rays.len() as i32)),
        ("fixed_angle", Data::f32(fixed_deg)),
        ("fixed_angle:long_name", Data::text(fixed_name)),
        ("sweep_start_ray_index", Data::i32(first_rays)),
        ("sweep_end_ray_index", Data::i32(last_rays)),
    ];
    // The age of a measured wake is unknown.
    if map.sweeps.iter().all(|sweep| sweep.tau.is_finite()) {
        values.push(("wake_age", Data::f32(ages)));
    }
    values
}

fn texts(map: &VelocityMap) -> Values {
    let sweeps = map.sweeps.len();
    let mut modes = Vec::new();
    for sweep in &map.sweeps {
        modes.extend(padded(sweep.mode.name()));
    }
    let platform = if map.is_carried() {
        "aircraft"
    } else {
        "fixed"
    };
    vec![
        ("time_coverage_start", date_text(map, map.rays.first())),
        ("time_coverage_end", date_text(map, map.rays.last())),
        (
            "time_reference",
            Data::text(padded(&map.start().to_string())),
        ),
        ("platform_type", Data::text(padded(platform))),
        ("instrument_type", Data::text(padded("lidar"))),
        ("primary_axis", Data::text(padded("axis_z"))),
        ("sweep_mode", Data::text(modes)),
        ("follow_mode", Data::text(padded("none").repeat(sweeps))),
        ("prt_mode", Data::text(padded("fixed").repeat(sweeps))),
    ]
}

/// The date of a ray; that of the start of the flow without one.
fn date_text(map: &VelocityMap, ray: Option<&Ray>) -> Data {
    let date = map.start().after_s(ray.map_or(0.0, |r| r.time_s));
    Data::text(padded(&date.to_string()))
}

fn instrument(map: &VelocityMap) -> Values {
    let rays = map.rays.len();
    let pulse = &map.pulse;
    let folding = if pulse.is_mirrored() {
        MIRRORED
    } else {
        "modulo"
    };
    let mut samples = Vec::with_capacity(rays);
    let mut nyquist_m_s = Vec::with_capacity(rays);
    for ray in &map.rays {
        let of_sweep_m_s = map.sweeps[ray.sweep].nyquist_velocity_m_s;
        nyquist_m_s.push(of_sweep_m_s.unwrap_or(pulse.nyquist_velocity_m_s));
        samples.push(i32::try_from(ray.pulses).unwrap_or(i32::MAX));
    }
    vec![
        ("frequency", single(&[pulse.frequency_hz])),
        ("prt", single(&vec![pulse.prt_s; rays])),
        ("pulse_width", single(&vec![pulse.pulse_width_s; rays])),
        ("nyquist_velocity", single(&nyquist_m_s)),
        ("nyquist_velocity:folding", Data::text(folding)),
        ("n_samples", Data::i32(samples)),
        ("antenna_transition", Data::i8(vec![0; rays])),
    ]
}

/// The estimates keep the scene too: xradar writes no global attributes but its own, and what a map means for a wake is in the scene; and
/// the part of it that says how they were estimated, for those who drop it.
fn fields(map: &VelocityMap, scene_toml: &str) -> Result<Vec<Variable>, Error> {
    let mut out = Vec::with_capacity(map.fields.len() + 1);
    for field in &map.fields {
        let variable = field_variable(field);
        out.push(match field.name.as_str() {
            "radial_velocity" => variable
                .text("scene", scene_toml)
                .text("instrument", &instrument_tables(scene_toml)),
            _ => variable,
        });
    }
    if map.field("radial_velocity").is_none() {
        let source = ["v_gate", "v_pulse", "v_exact"]
            .iter()
            .find_map(|name| map.field(name));
        let source = source.ok_or_else(|| Error::Missing {
            what: "field radial_velocity".into(),
            needed: "a CfRadial file needs it, or one of v_gate, v_pulse, v_exact in its place"
                .into(),
        })?;
        let copy = Field::float(
            "radial_velocity",
            Unit::METRE_PER_SECOND,
            &source.long_name,
            source.values.clone(),
        );
        out.push(field_variable(&copy).text(
            "comment",
            &format!("no estimate was made: copy of {}", source.name),
        ));
    }
    Ok(out)
}

/// The tables of a scene that say how velocities were estimated, whatever the air did.
fn instrument_tables(scene_toml: &str) -> String {
    let mut scene: toml::Table = scene_toml.parse().unwrap_or_default();
    scene.retain(|key, _| {
        [
            "format",
            "laser",
            "pulse",
            "detector",
            "telescope",
            "atmosphere",
            "scan",
            "estimator",
        ]
        .contains(&key)
    });
    scene.to_string()
}

fn field_variable(field: &Field) -> Variable {
    const DIMS: &[&str] = &["time", "range"];
    let mut out = Variable::new(&field.name, DIMS, Data::filled(&field.values))
        .text("long_name", &field.long_name)
        .text("units", field.unit.udunits)
        .text("coordinates", "elevation azimuth range");
    let further = [
        ("standard_name", field.standard_name()),
        ("cell_methods", field.cell_methods.as_deref()),
        (
            "ancillary_variables",
            Some(field.ancillary.as_str()).filter(|names| !names.is_empty()),
        ),
    ];
    for (name, text) in further {
        if let Some(text) = text {
            out = out.text(name, text);
        }
    }
    out.attr("_FillValue", Data::f32([FILL]))
}

fn single(values: &[f64]) -> Data {
    Data::f32(values.iter().map(|v| *v as f32))
}

/// Angle in 0 .. 2 pi.
fn turn(angle_rad: f64) -> f64 {
    angle_rad.rem_euclid(std::f64::consts::TAU)
}

fn padded(text: &str) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(TEXT, 0);
    bytes
}

#[cfg(test)]
#[path = "cfradial_tests.rs"]
mod tests;
