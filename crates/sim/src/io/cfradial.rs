//! A scanned map as CfRadial 1.4 in classic NetCDF: rays along `time`, gates along `range`, sweeps of one mode.
//! Opens in Py-ART (`pyart.io.read_cfradial`), xradar (`open_cfradial1_datatree(f, first_dim="time")`), wradlib, xarray, scipy.
//! Ray times count from the start of the flow, whose date is that of the map's site: a synthetic one where none was given.
//! Check: the tests read the bytes back with an independent reader and hold them to the list that the clients need.

use super::error::{OutputError, OutputResult};
use super::map::{Field, Unit, VelocityMap};
use super::netcdf::{Data, FILL, Layout, Variable};
use super::provenance::Provenance;
use super::utc::MAX_TIME_S;
use crate::setup::beams::SweepMode;
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
        return Err(OutputError::value("ray time_s", format!("{bad:?}"), allowed));
    }
    let mut variables = axes(map, times);
    variables.extend(site(map));
    variables.extend(sweeps(map));
    variables.extend(texts(map));
    variables.extend(instrument(map));
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
        ("references", "CfRadial data file format, version 1.4, NCAR (2016)"),
        ("comment", comment),
        ("instrument_name", "wakescope lidar"),
        ("scan_name", map.sweeps.first().map_or("rhi", |sweep| sweep.mode.name())),
        ("platform_is_mobile", if map.is_carried() { "true" } else { "false" }),
        ("n_gates_vary", "false"),
        ("ray_times_increase", "true"),
        ("simulated", simulated),
        ("title", &map.title),
        ("site_name", &map.site.name),
        ("history", &format!("written by {}", provenance.program)),
    ];
    entries.map(|(name, text)| (name, text.to_owned())).into()
}

fn axes(map: &VelocityMap, times: Vec<f64>) -> Vec<Variable> {
    let gates = &map.range_m;
    let spacing = if gates.len() > 1 { gates[1] - gates[0] } else { 0.0 };
    // Gate centres come from sums and products of a few terms: equal to a part in 1e6 is constant.
    let constant = gates.windows(2).all(|w| (w[1] - w[0] - spacing).abs() <= 1e-6 * spacing);
    let degrees = |angle: fn(&super::map::Ray) -> f64| Data::f32(map.rays.iter().map(|r| angle(r).to_degrees() as f32));
    vec![
        Variable::new("time", &["time"], Data::f64(times))
            .named(["time", "time since the start of the flow", &format!("seconds since {}", map.start())])
            .text("calendar", "gregorian"),
        Variable::new("range", &["range"], single(gates))
            .named(["projection_range_coordinate", "range to centre of measurement volume", "meters"])
            .text("spacing_is_constant", if constant { "true" } else { "false" })
            .attr("meters_to_center_of_first_gate", Data::f32([gates[0] as f32]))
            .attr("meters_between_gates", Data::f32([spacing as f32]))
            .text("axis", "radial_range_coordinate"),
        Variable::new("azimuth", &["time"], degrees(|r| turn(r.azimuth_rad)))
            .named(["ray_azimuth_angle", "azimuth angle from true north", "degrees"])
            .text("axis", "radial_azimuth_coordinate"),
        Variable::new("elevation", &["time"], degrees(|r| r.elevation_rad))
            .named(["ray_elevation_angle", "elevation angle from horizontal plane", "degrees"])
            .text("axis", "radial_elevation_coordinate"),
    ]
}

/// Velocities of the instrument and its platform.
const METRES: &str = "meters per second";
/// What the attribute `folding` of `nyquist_velocity` says of real currents: faster air is mirrored, and no multiple of it is lost.
pub(crate) const MIRRORED: &str = "mirrored";

/// Length of a degree of latitude on a sphere with the mean radius of the Earth, m.
const DEGREE_M: f64 = 6_371_008.8 * std::f64::consts::PI / 180.0;

fn site(map: &VelocityMap) -> Vec<Variable> {
    const ONE: &[&str] = &[];
    const EACH: &[&str] = &["time"];
    // A scan in one plane without a flight of its own looks across it.
    let across_rad = map.rays.first().map_or(0.0, |ray| ray.azimuth_rad - FRAC_PI_2);
    let heading_rad = map.flight.map_or(across_rad, |(_, azimuth_rad)| azimuth_rad);
    // Along the flight and to the right of it, as north and east.
    let north_east = |x: f64, y: f64| {
        let (sin, cos) = heading_rad.sin_cos();
        (x * cos - y * sin, x * sin + y * cos)
    };
    let place = |[x_m, y_m, z_m]: [f64; 3]| {
        let (north_m, east_m) = north_east(x_m, y_m);
        let width = map.site.latitude_deg.to_radians().cos();
        let (latitude, longitude) = (map.site.latitude_deg, map.site.longitude_deg);
        [latitude + north_m / DEGREE_M, longitude + east_m / (DEGREE_M * width), map.site.altitude_m + z_m]
    };
    let here_m = [map.flight.map_or(0.0, |(x_m, _)| x_m), map.lidar_y_m, map.lidar_height_m];
    let carrier: Vec<([f64; 3], [f64; 3])> = map.rays.iter().filter_map(|ray| ray.carrier).collect();
    let (places, dims) = match carrier.is_empty() {
        true => (vec![place(here_m)], ONE),
        false => (carrier.iter().map(|(place_m, _)| place(*place_m)).collect(), EACH),
    };
    let values = |d: usize| Data::f64(places.iter().map(|p| p[d]));
    let mut out = vec![
        Variable::new("latitude", dims, values(0)).named(["latitude", "", "degrees_north"]),
        Variable::new("longitude", dims, values(1)).named(["longitude", "", "degrees_east"]),
        Variable::new("altitude", dims, values(2))
            .named(["altitude", "height of the telescope above the sea", "meters"])
            .text("positive", "up"),
    ];
    if !carrier.is_empty() {
        // A level carrier that heads along the flight, and drifts where its track does not.
        let heading_deg = turn(heading_rad).to_degrees();
        let over_ground = |i: usize| north_east(carrier[i].1[0], carrier[i].1[1]);
        let drift = |i: usize| {
            let (north, east) = over_ground(i);
            let aside_rad = if north == 0.0 && east == 0.0 { 0.0 } else { east.atan2(north) - heading_rad };
            aside_rad.sin().atan2(aside_rad.cos()).to_degrees() as f32
        };
        let each = |of: &dyn Fn(usize) -> f32| (0..carrier.len()).map(of).collect::<Vec<f32>>();
        let angles = map.rays.iter().map(|ray| [ray.azimuth_rad, ray.elevation_rad].map(|rad| rad.to_degrees() as f32));
        let (rotation, tilt): (Vec<f32>, Vec<f32>) = angles.map(|[az, el]| (az - heading_deg as f32, el)).unzip();
        let still = || vec![0.0; map.rays.len()];
        let motion = [
            ("heading", "degrees", "heading of the platform from true north", each(&|_| heading_deg as f32)),
            ("roll", "degrees", "roll of the platform", still()),
            ("pitch", "degrees", "pitch of the platform", still()),
            ("drift", "degrees", "track of the platform over the ground less its heading", each(&drift)),
            ("rotation", "degrees", "azimuth of the beam from the heading of the platform", rotation),
            ("tilt", "degrees", "elevation of the beam from the plane of the platform", tilt),
            ("eastward_velocity", METRES, "eastward velocity of the platform", each(&|i| over_ground(i).1 as f32)),
            ("northward_velocity", METRES, "northward velocity of the platform", each(&|i| over_ground(i).0 as f32)),
            ("vertical_velocity", METRES, "upward velocity of the platform", each(&|i| carrier[i].1[2] as f32)),
        ];
        out.extend(motion.map(|(name, units, long_name, values)| {
            Variable::new(name, EACH, Data::f32(values)).named(["", long_name, units])
        }));
    }
    out
}

fn sweeps(map: &VelocityMap) -> Vec<Variable> {
    let bounds = map.sweep_bounds();
    let ints = |values: &mut dyn Iterator<Item = usize>| Data::i32(values.map(|v| v as i32));
    let floats = |get: fn(&super::map::Sweep) -> f64| Data::f32(map.sweeps.iter().map(|s| get(s) as f32));
    let is_rhi = map.sweeps.iter().all(|sweep| sweep.mode == SweepMode::Rhi);
    let fixed = floats(|s| {
        let angle_rad = if s.mode == SweepMode::Rhi { turn(s.fixed_angle_rad) } else { s.fixed_angle_rad };
        angle_rad.to_degrees()
    });
    let fixed_name = if is_rhi { "azimuth of the scan plane" } else { "angle that stays during the sweep" };
    let (first, last) = (ints(&mut bounds.iter().map(|b| b.0)), ints(&mut bounds.iter().map(|b| b.1)));
    let each = |(name, values, long_name, units): (&str, Data, &str, &str)| {
        Variable::new(name, &["sweep"], values).named(["", long_name, units])
    };
    let mut of_sweeps = vec![
        ("sweep_number", ints(&mut (0..bounds.len())), "sweep number, from 0", ""),
        ("fixed_angle", fixed, fixed_name, "degrees"),
        ("sweep_start_ray_index", first, "index of the first ray of the sweep", ""),
        ("sweep_end_ray_index", last, "index of the last ray of the sweep, inclusive", ""),
    ];
    // Nobody knows the age of a measured wake.
    if map.sweeps.iter().all(|sweep| sweep.tau.is_finite()) {
        of_sweeps.push(("wake_age", floats(|s| s.tau), "age of the wake, t Gamma0 / (2 pi b0^2)", "1"));
    }
    let volume = Variable::new("volume_number", &[], Data::i32([0])).text("long_name", "volume number");
    std::iter::once(volume).chain(of_sweeps.into_iter().map(each)).collect()
}

fn texts(map: &VelocityMap) -> Vec<Variable> {
    const ONE: &[&str] = &["string_length_32"];
    const EACH: &[&str] = &["sweep", "string_length_32"];
    let start = map.start();
    let time = |ray: Option<&super::map::Ray>| start.after_s(ray.map_or(0.0, |r| r.time_s)).to_string();
    let one = |name: &str, text: &str| Variable::new(name, ONE, Data::text(padded(text)));
    let each = |name: &str, text: &str| Variable::new(name, EACH, Data::text(padded(text).repeat(map.sweeps.len())));
    let modes: Vec<u8> = map.sweeps.iter().flat_map(|sweep| padded(sweep.mode.name())).collect();
    vec![
        one("time_coverage_start", &time(map.rays.first())),
        one("time_coverage_end", &time(map.rays.last())),
        one("time_reference", &start.to_string()),
        one("platform_type", if map.is_carried() { "aircraft" } else { "fixed" }),
        one("instrument_type", "lidar"),
        one("primary_axis", "axis_z"),
        Variable::new("sweep_mode", EACH, Data::text(modes)),
        each("follow_mode", "none"),
        each("prt_mode", "fixed"),
    ]
}

fn instrument(map: &VelocityMap) -> Vec<Variable> {
    let (rays, pulse) = (map.rays.len(), &map.pulse);
    let samples = Data::i32(map.rays.iter().map(|ray| i32::try_from(ray.pulses).unwrap_or(i32::MAX)));
    let group = |v: Variable, units: &str| v.text("units", units).text("meta_group", "instrument_parameters");
    let each = |name: &str, value: f64, long_name: &str| {
        Variable::new(name, &["time"], single(&vec![value; rays])).text("long_name", long_name)
    };
    let folding = if pulse.is_mirrored() { MIRRORED } else { "modulo" };
    let frequency = Variable::new("frequency", &["frequency"], single(&[pulse.frequency_hz]));
    let width = "full width at half maximum of the power of the pulse";
    let nyquist = "largest velocity that the samples tell from others";
    vec![
        group(frequency.text("standard_name", "radiation_frequency"), "s-1"),
        group(each("prt", pulse.prt_s, "time between pulses"), "seconds"),
        group(each("pulse_width", pulse.pulse_width_s, width), "seconds"),
        group(each("nyquist_velocity", pulse.nyquist_velocity_m_s, nyquist).text("folding", folding), METRES),
        group(Variable::new("n_samples", &["time"], samples).text("long_name", "pulses of the ray"), "1"),
        Variable::new("antenna_transition", &["time"], Data::i8(vec![0; rays]))
            .text("long_name", "1 while the telescope moves between sweeps"),
    ]
}

/// The estimates keep the scene too: xradar writes no global attributes but its own, and what a map means for a wake is in the scene; and
/// the part of it that says how they were estimated, for those who drop it.
fn fields(map: &VelocityMap, scene_toml: &str) -> OutputResult<Vec<Variable>> {
    let variable = |field: &Field| {
        let out = field_variable(field);
        match field.name.as_str() {
            "radial_velocity" => out.text("scene", scene_toml).text("instrument", &instrument_of(scene_toml)),
            _ => out,
        }
    };
    let mut out: Vec<Variable> = map.fields.iter().map(variable).collect();
    if map.field("radial_velocity").is_none() {
        let source = ["v_gate", "v_pulse", "v_exact"].iter().find_map(|name| map.field(name));
        let source = source.ok_or_else(|| OutputError::Missing {
            what: "field radial_velocity".into(),
            needed: "a CfRadial file needs it, or one of v_gate, v_pulse, v_exact to stand for it".into(),
        })?;
        let copy = Field::float("radial_velocity", Unit::METRE_PER_SECOND, &source.long_name, source.values.clone());
        out.push(field_variable(&copy).text("comment", &format!("no estimate was made: copy of {}", source.name)));
    }
    Ok(out)
}

/// The tables of a scene that say how velocities were estimated, whatever the air did.
fn instrument_of(scene_toml: &str) -> String {
    let mut scene: toml::Table = scene_toml.parse().unwrap_or_default();
    scene.retain(|key, _| {
        ["format", "laser", "pulse", "detector", "telescope", "atmosphere", "scan", "estimator"].contains(&key)
    });
    scene.to_string()
}

fn field_variable(field: &Field) -> Variable {
    const DIMS: &[&str] = &["time", "range"];
    let mut out = Variable::new(&field.name, DIMS, Data::filled(&field.values))
        .named(["", &field.long_name, field.unit.udunits])
        .text("coordinates", "elevation azimuth range");
    let further = [
        ("standard_name", field.standard_name()),
        ("cell_methods", field.cell_methods.as_deref()),
        ("ancillary_variables", Some(field.ancillary.as_str()).filter(|names| !names.is_empty())),
    ];
    for (name, text) in further.into_iter().filter_map(|(name, text)| Some((name, text?))) {
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
