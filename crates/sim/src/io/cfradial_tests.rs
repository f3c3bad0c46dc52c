//! The bytes of a CfRadial file, read back by a reader that shares no code with the writer.

use super::super::provenance::example;
use super::super::samples;
use super::*;
use crate::Error;
use crate::io::Site;
use netcdf3::FileReader;

/// Writes the map, and opens it with a reader that shares no code with the writer.
fn reopened(map: &VelocityMap) -> (tempfile::TempDir, FileReader) {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path().join("map.nc");
    std::fs::write(&path, cfradial_bytes(map, &example()).unwrap()).unwrap();
    let file = FileReader::open(&path).unwrap();
    (temp, file)
}

/// What a client fails without: (name, dimensions, units).
const NEEDED: &[(&str, &[&str], Option<&str>)] = &[
    (
        "time",
        &["time"],
        Some("seconds since 2024-01-01T00:00:00Z"),
    ),
    ("range", &["range"], Some("meters")),
    ("azimuth", &["time"], Some("degrees")),
    ("elevation", &["time"], Some("degrees")),
    ("latitude", &[], Some("degrees_north")),
    ("longitude", &[], Some("degrees_east")),
    ("altitude", &[], Some("meters")),
    ("sweep_number", &["sweep"], None),
    ("sweep_mode", &["sweep", "string_length_32"], None),
    ("fixed_angle", &["sweep"], Some("degrees")),
    ("sweep_start_ray_index", &["sweep"], None),
    ("sweep_end_ray_index", &["sweep"], None),
    ("volume_number", &[], None),
    ("platform_type", &["string_length_32"], None),
    ("instrument_type", &["string_length_32"], None),
    ("primary_axis", &["string_length_32"], None),
    ("time_coverage_start", &["string_length_32"], None),
    ("time_coverage_end", &["string_length_32"], None),
    ("radial_velocity", &["time", "range"], Some("m s-1")),
    (
        "velocity_standard_deviation",
        &["time", "range"],
        Some("m s-1"),
    ),
    ("signal_to_noise_ratio", &["time", "range"], Some("dB")),
    ("v_exact", &["time", "range"], Some("m s-1")),
];

#[test]
fn every_variable_that_a_client_needs_has_its_dimensions_and_units() {
    let (_temp, file) = reopened(&samples::map());
    let set = file.data_set();
    for (name, dims, units) in NEEDED {
        let variable = set.get_var(name).unwrap_or_else(|| panic!("no {name}"));
        assert_eq!(&variable.dim_names(), dims, "{name}");
        assert_eq!(
            set.get_var_attr_as_string(name, "units").as_deref(),
            *units,
            "{name}"
        );
    }
    for name in set.get_var_names() {
        assert!(
            set.get_var_attr_as_string(&name, "_Encoding").is_none(),
            "_Encoding breaks Py-ART"
        );
    }
    for name in [
        "Conventions",
        "version",
        "title",
        "institution",
        "references",
        "source",
        "history",
        "comment",
        "instrument_name",
    ] {
        assert!(
            set.get_global_attr_as_string(name).is_some(),
            "no global {name}"
        );
    }
}

#[test]
fn values_angles_and_times_read_back() {
    let map = samples::map();
    let (_temp, mut file) = reopened(&map);
    let velocity = file.read_var_f32("radial_velocity").unwrap();
    let gates = map.range_m.len();
    let values = &map.field("radial_velocity").unwrap().values;
    for ((ray, gate), value) in values.indexed_iter() {
        let got = velocity[ray * gates + gate];
        if value.is_nan() {
            assert_eq!(got, FILL, "missing is the fill value, never NaN");
        } else {
            assert_eq!(got, *value as f32);
        }
    }
    assert_eq!(velocity.iter().filter(|v| **v == FILL).count(), 1);
    let elevation = file.read_var_f32("elevation").unwrap();
    for (ray, degrees) in map.rays.iter().zip(elevation) {
        approx::assert_relative_eq!(
            f64::from(degrees),
            ray.elevation_rad * 180.0 / std::f64::consts::PI,
            max_relative = 1e-7
        );
    }
    let times: Vec<f64> = map.rays.iter().map(|r| r.time_s).collect();
    assert_eq!(file.read_var_f64("time").unwrap(), times);
    assert_eq!(file.read_var_f32("fixed_angle").unwrap(), [90.0, 90.0]);
    assert_eq!(file.read_var_f32("wake_age").unwrap(), [2.5, 5.0]);
}

#[test]
fn sweeps_tile_the_rays_with_inclusive_ends() {
    let (_temp, mut file) = reopened(&samples::map());
    assert_eq!(file.read_var_i32("sweep_start_ray_index").unwrap(), [0, 6]);
    assert_eq!(file.read_var_i32("sweep_end_ray_index").unwrap(), [5, 11]);
    let mode = file.read_var_u8("sweep_mode").unwrap();
    assert_eq!(mode.len(), 64);
    for text in mode.chunks(32) {
        assert_eq!(&text[..3], b"rhi");
        assert!(text[3..].iter().all(|b| *b == 0), "padded with NUL");
    }
}

#[test]
fn fill_value_is_on_floats() {
    let (_temp, file) = reopened(&samples::map());
    let set = file.data_set();
    assert_eq!(
        set.get_var_attr_f32("radial_velocity", "_FillValue")
            .unwrap(),
        [-9999.0]
    );
}

#[test]
fn provenance_is_in_the_global_attributes() {
    let (_temp, file) = reopened(&samples::map());
    for (name, text) in example().entries() {
        assert_eq!(
            file.data_set().get_global_attr_as_string(name).unwrap(),
            text
        );
    }
}

#[test]
fn a_map_without_estimate_shows_the_gate_velocity() {
    let mut map = samples::map();
    map.fields.retain(|f| f.name.starts_with("v_"));
    let (_temp, mut file) = reopened(&map);
    assert_eq!(
        file.read_var_f32("radial_velocity").unwrap(),
        file.read_var_f32("v_gate").unwrap()
    );
    map.fields.clear();
    assert!(matches!(
        cfradial_bytes(&map, &example()),
        Err(Error::Missing { .. })
    ));
}

#[test]
fn place_and_date_are_those_of_the_site() {
    let mut map = samples::map();
    map.lidar_y_m = 0.0;
    map.site = Site {
        name: "Toulouse".into(),
        latitude_deg: 43.6293,
        longitude_deg: 1.3638,
        altitude_m: 151.5,
        start_utc: "2023-12-31T23:59:00Z".into(),
    };
    let (_temp, mut file) = reopened(&map);
    for (name, expected) in [
        ("latitude", 43.6293),
        ("longitude", 1.3638),
        ("altitude", 151.5 + map.lidar_height_m),
    ] {
        assert_eq!(file.read_var_f64(name).unwrap(), [expected]);
    }
    let units = file
        .data_set()
        .get_var_attr_as_string("time", "units")
        .unwrap();
    assert_eq!(units, "seconds since 2023-12-31T23:59:00Z");
    assert_eq!(
        file.data_set()
            .get_global_attr_as_string("site_name")
            .unwrap(),
        "Toulouse"
    );
    let first = file.read_var_u8("time_coverage_start").unwrap();
    assert_eq!(&first[..20], b"2023-12-31T23:59:40Z");
    let last = file.read_var_u8("time_coverage_end").unwrap();
    assert_eq!(&last[..20], b"2024-01-01T00:00:22Z");
}

#[test]
fn a_time_beyond_every_calendar_is_refused() {
    let mut map = samples::map();
    map.rays[0].time_s = -1.0;
    assert!(
        cfradial_bytes(&map, &example()).is_ok(),
        "a flow may begin before its time 0"
    );
    map.rays[0].time_s = -2e9;
    assert!(matches!(
        cfradial_bytes(&map, &example()),
        Err(Error::Value { .. })
    ));
}

#[test]
fn fields_say_what_they_are_and_which_others_judge_them() {
    let mut map = samples::map();
    let velocity = map
        .fields
        .iter_mut()
        .find(|f| f.name == "radial_velocity")
        .unwrap();
    *velocity = velocity
        .clone()
        .over_realisations("mean")
        .with_ancillary("rms n_eff");
    let (_temp, file) = reopened(&map);
    let text =
        |name: &str, attribute: &str| file.data_set().get_var_attr_as_string(name, attribute);
    assert_eq!(
        text("radial_velocity", "ancillary_variables").as_deref(),
        Some("rms n_eff")
    );
    assert_eq!(
        text("radial_velocity", "cell_methods").as_deref(),
        Some("realization: mean")
    );
    let name = Some("radial_velocity_of_scatterers_away_from_instrument");
    assert_eq!(text("v_exact", "standard_name").as_deref(), name);
    assert_eq!(text("level", "standard_name"), None);
}

#[test]
fn the_bytes_are_the_same_every_time() {
    let map = samples::map();
    let first = cfradial_bytes(&map, &example()).unwrap();
    assert_eq!(first[..4], *b"CDF\x02");
    assert_eq!(first, cfradial_bytes(&map, &example()).unwrap());
}

/// Places, m, as degrees north and east on a sphere.
fn placed(map: &VelocityMap, north_m: f64, east_m: f64) -> [f64; 2] {
    let site = &map.site;
    let degree_m = 6_371_008.8 * std::f64::consts::PI / 180.0;
    let width = site.latitude_deg.to_radians().cos();
    [
        site.latitude_deg + north_m / degree_m,
        site.longitude_deg + east_m / (degree_m * width),
    ]
}

#[test]
fn the_place_is_that_of_the_telescope_whether_it_stands_or_moves() {
    let mut map = samples::map();
    (
        map.site.latitude_deg,
        map.site.longitude_deg,
        map.site.altitude_m,
    ) = (-43.489, 170.0, 37.5);
    let of = |file: &mut FileReader| {
        ["latitude", "longitude", "altitude"].map(|name| file.read_var_f64(name).unwrap()[0])
    };
    let near = |found: [f64; 3], [latitude, longitude]: [f64; 2], altitude: f64| {
        let off = [
            found[0] - latitude,
            found[1] - longitude,
            found[2] - altitude,
        ];
        assert!(off.iter().all(|off| off.abs() < 1e-9), "{found:?}");
    };
    // Beside the flight, which a scan in one plane looks across; then one that looks to the south-east.
    let (_temp, mut file) = reopened(&map);
    near(of(&mut file), placed(&map, 0.0, -150.0), 39.5);
    map.rays
        .iter_mut()
        .for_each(|ray| ray.azimuth_rad = 0.75 * std::f64::consts::PI);
    let (_temp, mut file) = reopened(&map);
    let half = 0.5_f64.sqrt();
    near(
        of(&mut file),
        placed(&map, 150.0 * half, -150.0 * half),
        39.5,
    );
    // 3000 m along a flight to the azimuth 1.2, and 500 m to its right.
    (map.flight, map.lidar_y_m) = (Some((3000.0, 1.2)), 500.0);
    let (sin, cos) = 1.2_f64.sin_cos();
    let (_temp, mut file) = reopened(&map);
    near(
        of(&mut file),
        placed(&map, 3000.0 * cos - 500.0 * sin, 3000.0 * sin + 500.0 * cos),
        39.5,
    );
    // One that flies 70 m/s along it, drifts to the right and climbs.
    let at = |i: usize| [3000.0 + 7.0 * i as f64, 500.0 + 0.5 * i as f64, 50.0];
    map.rays
        .iter_mut()
        .enumerate()
        .for_each(|(i, ray)| ray.carrier = Some((at(i), [70.0, 5.0, 1.0])));
    let (_temp, mut file) = reopened(&map);
    near(
        of(&mut file),
        placed(&map, 3000.0 * cos - 500.0 * sin, 3000.0 * sin + 500.0 * cos),
        87.5,
    );
    let mut first = |name: &str| f64::from(file.read_var_f32(name).unwrap()[3]);
    let track_rad = 1.2 + (5.0_f64 / 70.0).atan();
    assert!((first("heading") - 1.2_f64.to_degrees()).abs() < 1e-5);
    assert!((first("drift") - (5.0_f64 / 70.0).atan().to_degrees()).abs() < 1e-5);
    let speed = 70.0_f64.hypot(5.0);
    assert!((first("eastward_velocity") - speed * track_rad.sin()).abs() < 1e-5);
    assert!((first("northward_velocity") - speed * track_rad.cos()).abs() < 1e-5);
    assert_eq!(first("vertical_velocity"), 1.0);
    for name in [
        "heading",
        "roll",
        "pitch",
        "drift",
        "rotation",
        "tilt",
        "eastward_velocity",
        "prt",
        "pulse_width",
    ] {
        assert!(
            file.data_set()
                .get_var_attr_as_string(name, "long_name")
                .is_some(),
            "{name}"
        );
    }
}
