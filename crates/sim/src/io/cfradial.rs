//! A scanned map as CfRadial 1.4 in classic NetCDF: rays along `time`, gates along `range`, sweeps of one mode.
//! Opens in Py-ART (`pyart.io.read_cfradial`), xradar (`open_cfradial1_datatree(f, first_dim="time")`), wradlib, xarray, scipy.
//! Ray times count from the start of the flow, whose date is that of the map's site: a synthetic one where none was given.
//! Check: the tests read the bytes back with an independent reader and hold them to the list that the clients need.

use super::error::{OutputError, OutputResult};
use super::map::{Field, Unit, VelocityMap};
use super::netcdf::{Data, FILL, Layout, Variable, described};
use super::provenance::Provenance;
use super::utc::MAX_TIME_S;
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
pub fn cfradial_bytes(map: &VelocityMap, provenance: &Provenance) -> OutputResult<Vec<u8>> {
    layout(map, provenance)?.into_bytes(provenance)
}

/// Bytes of data of a run's map with so many rays and gates, rounded up: 16 fields, and what each ray has.
pub(crate) fn data_bytes(rays: f64, gates: f64) -> f64 {
    64.0 * rays * gates + 64.0 * rays + 4.0 * gates + 4096.0
}

fn layout(map: &VelocityMap, provenance: &Provenance) -> OutputResult<Layout> {
    map.check()?;
    let outside = |t: &&f64| t.abs() > MAX_TIME_S;
    let times: Vec<f64> = map.rays.iter().map(|r| r.time_s).collect();
    if let Some(bad) = times.iter().find(outside) {
        let allowed = format!("within {MAX_TIME_S:?} s of the start of the flow");
        return Err(OutputError::value(
            "ray time_s",
            format!("{bad:?}"),
            allowed,
        ));
    }
    let mut values = axes(map, times);
    values.extend(site(map));
    values.extend(sweeps(map));
    values.extend(texts(map));
    values.extend(instrument(map));
    let mut variables = described(include_str!("cfradial.cdl"), values);
    if !map.is_carried() {
        // A lidar that stands has one place for all rays.
        let is_place = |variable: &&mut Variable| {
            ["latitude", "longitude", "altitude"].contains(&&*variable.name)
        };
        variables
            .iter_mut()
            .filter(is_place)
            .for_each(|variable| variable.dims.clear());
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
    let degrees = |angle: fn(&super::map::Ray) -> f64| {
        Data::f32(map.rays.iter().map(|r| angle(r).to_degrees() as f32))
    };
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
        ("azimuth", degrees(|r| turn(r.azimuth_rad))),
        ("elevation", degrees(|r| r.elevation_rad)),
    ]
}

/// What the attribute `folding` of `nyquist_velocity` says of real currents: faster air is mirrored, and no multiple of it is lost.
pub(crate) const MIRRORED: &str = "mirrored";

/// Length of a degree of latitude on a sphere with the mean radius of the Earth, m.
const DEGREE_M: f64 = 6_371_008.8 * std::f64::consts::PI / 180.0;

fn site(map: &VelocityMap) -> Values {
    // A scan in one plane without a flight of its own looks across it.
    let across_rad = map
        .rays
        .first()
        .map_or(0.0, |ray| ray.azimuth_rad - FRAC_PI_2);
    let heading_rad = map
        .flight
        .map_or(across_rad, |(_, azimuth_rad)| azimuth_rad);
    // Along the flight and to the right of it, as north and east.
    let north_east = |x: f64, y: f64| {
        let (sin, cos) = heading_rad.sin_cos();
        (x * cos - y * sin, x * sin + y * cos)
    };
    let place = |[x_m, y_m, z_m]: [f64; 3]| {
        let (north_m, east_m) = north_east(x_m, y_m);
        let width = map.site.latitude_deg.to_radians().cos();
        let latitude = map.site.latitude_deg;
        let longitude = map.site.longitude_deg;
        [
            latitude + north_m / DEGREE_M,
            longitude + east_m / (DEGREE_M * width),
            map.site.altitude_m + z_m,
        ]
    };
    let here_m = [
        map.flight.map_or(0.0, |(x_m, _)| x_m),
        map.lidar_y_m,
        map.lidar_height_m,
    ];
    let carrier: Vec<([f64; 3], [f64; 3])> =
        map.rays.iter().filter_map(|ray| ray.carrier).collect();
    let places: Vec<[f64; 3]> = match carrier.is_empty() {
        true => vec![place(here_m)],
        false => carrier.iter().map(|(place_m, _)| place(*place_m)).collect(),
    };
    let values = |d: usize| Data::f64(places.iter().map(|p| p[d]));
    let mut out = vec![
        ("latitude", values(0)),
        ("longitude", values(1)),
        ("altitude", values(2)),
    ];
    if !carrier.is_empty() {
        // A level carrier that heads along the flight, and drifts where its track does not.
        let heading_deg = turn(heading_rad).to_degrees();
        let over_ground = |i: usize| north_east(carrier[i].1[0], carrier[i].1[1]);
        let drift = |i: usize| {
            let (north, east) = over_ground(i);
            let aside_rad = if north == 0.0 && east == 0.0 {
                0.0
            } else {
                east.atan2(north) - heading_rad
            };
            aside_rad.sin().atan2(aside_rad.cos()).to_degrees() as f32
        };
        let each = |of: &dyn Fn(usize) -> f32| (0..carrier.len()).map(of).collect::<Vec<f32>>();
        let angles = map
            .rays
            .iter()
            .map(|ray| [ray.azimuth_rad, ray.elevation_rad].map(|rad| rad.to_degrees() as f32));
        let (rotation, tilt): (Vec<f32>, Vec<f32>) =
            angles.map(|[az, el]| (az - heading_deg as f32, el)).unzip();
        let still = || vec![0.0; map.rays.len()];
        let motion = [
            ("heading", each(&|_| heading_deg as f32)),
            ("roll", still()),
            ("pitch", still()),
            ("drift", each(&drift)),
            ("rotation", rotation),
            ("tilt", tilt),
            ("eastward_velocity", each(&|i| over_ground(i).1 as f32)),
            ("northward_velocity", each(&|i| over_ground(i).0 as f32)),
            ("vertical_velocity", each(&|i| carrier[i].1[2] as f32)),
        ];
        out.extend(motion.map(|(name, values)| (name, Data::f32(values))));
    }
    out
}

fn sweeps(map: &VelocityMap) -> Values {
    let bounds = map.sweep_bounds();
    let ints = |values: &mut dyn Iterator<Item = usize>| Data::i32(values.map(|v| v as i32));
    let floats =
        |get: fn(&super::map::Sweep) -> f64| Data::f32(map.sweeps.iter().map(|s| get(s) as f32));
    let is_rhi = map.sweeps.iter().all(|sweep| sweep.mode == SweepMode::Rhi);
    let fixed = floats(|s| {
        let angle_rad = if s.mode == SweepMode::Rhi {
            turn(s.fixed_angle_rad)
        } else {
            s.fixed_angle_rad
        };
        angle_rad.to_degrees()
    });
    let fixed_name = if is_rhi {
        "azimuth of the scan plane"
    } else {
        "angle that stays during the sweep"
    };
    let mut out = vec![
        ("volume_number", Data::i32([0])),
        ("sweep_number", ints(&mut (0..bounds.len()))),
        ("fixed_angle", fixed),
        ("fixed_angle:long_name", Data::text(fixed_name)),
        (
            "sweep_start_ray_index",
            ints(&mut bounds.iter().map(|b| b.0)),
        ),
        ("sweep_end_ray_index", ints(&mut bounds.iter().map(|b| b.1))),
    ];
    // Nobody knows the age of a measured wake.
    if map.sweeps.iter().all(|sweep| sweep.tau.is_finite()) {
        out.push(("wake_age", floats(|s| s.tau)));
    }
    out
}

fn texts(map: &VelocityMap) -> Values {
    let start = map.start();
    let time =
        |ray: Option<&super::map::Ray>| start.after_s(ray.map_or(0.0, |r| r.time_s)).to_string();
    let each = |text: &str| Data::text(padded(text).repeat(map.sweeps.len()));
    let modes: Vec<u8> = map
        .sweeps
        .iter()
        .flat_map(|sweep| padded(sweep.mode.name()))
        .collect();
    vec![
        (
            "time_coverage_start",
            Data::text(padded(&time(map.rays.first()))),
        ),
        (
            "time_coverage_end",
            Data::text(padded(&time(map.rays.last()))),
        ),
        ("time_reference", Data::text(padded(&start.to_string()))),
        (
            "platform_type",
            Data::text(padded(if map.is_carried() {
                "aircraft"
            } else {
                "fixed"
            })),
        ),
        ("instrument_type", Data::text(padded("lidar"))),
        ("primary_axis", Data::text(padded("axis_z"))),
        ("sweep_mode", Data::text(modes)),
        ("follow_mode", each("none")),
        ("prt_mode", each("fixed")),
    ]
}

fn instrument(map: &VelocityMap) -> Values {
    let rays = map.rays.len();
    let pulse = &map.pulse;
    let each = |value: f64| single(&vec![value; rays]);
    vec![
        ("frequency", single(&[pulse.frequency_hz])),
        ("prt", each(pulse.prt_s)),
        ("pulse_width", each(pulse.pulse_width_s)),
        ("nyquist_velocity", each(pulse.nyquist_velocity_m_s)),
        (
            "nyquist_velocity:folding",
            Data::text(if pulse.is_mirrored() {
                MIRRORED
            } else {
                "modulo"
            }),
        ),
        (
            "n_samples",
            Data::i32(
                map.rays
                    .iter()
                    .map(|ray| i32::try_from(ray.pulses).unwrap_or(i32::MAX)),
            ),
        ),
        ("antenna_transition", Data::i8(vec![0; rays])),
    ]
}

/// The estimates keep the scene too: xradar writes no global attributes but its own, and what a map means for a wake is in the scene; and
/// the part of it that says how they were estimated, for those who drop it.
fn fields(map: &VelocityMap, scene_toml: &str) -> OutputResult<Vec<Variable>> {
    let variable = |field: &Field| {
        let out = field_variable(field);
        match field.name.as_str() {
            "radial_velocity" => out
                .text("scene", scene_toml)
                .text("instrument", &instrument_of(scene_toml)),
            _ => out,
        }
    };
    let mut out: Vec<Variable> = map.fields.iter().map(variable).collect();
    if map.field("radial_velocity").is_none() {
        let source = ["v_gate", "v_pulse", "v_exact"]
            .iter()
            .find_map(|name| map.field(name));
        let source = source.ok_or_else(|| OutputError::Missing {
            what: "field radial_velocity".into(),
            needed: "a CfRadial file needs it, or one of v_gate, v_pulse, v_exact to stand for it"
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
fn instrument_of(scene_toml: &str) -> String {
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
    for (name, text) in further
        .into_iter()
        .filter_map(|(name, text)| Some((name, text?)))
    {
        out = out.text(name, text);
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
