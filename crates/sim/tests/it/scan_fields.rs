//! Scans of fields in three dimensions: of this program and of others, classic and NetCDF-4, with the air that they carry.

use crate::scans::{RHI, map, plan_in};
use netcdf3::{DataSet, FileWriter, Version};
use std::f64::consts::TAU;
use std::path::Path;
use wakescope_sim::io::Provenance;
use wakescope_sim::io::cf_fields::{FaceVelocities, cf_faces_parts};
use wakescope_sim::plan::Target;

/// A smooth field that varies along the flight.
fn wave([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (a, b, c) = (x / 400.0, y / 500.0, z / 300.0);
    [
        3.0 * a.sin() * b.cos(),
        4.0 * (a + b).cos() * c.cos(),
        2.0 * a.cos() * (b + c).sin(),
    ]
}

fn axis(low: f64, high: f64, count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| low + (high - low) * i as f64 / (count - 1) as f64)
        .collect()
}

fn sampled(nodes_m: [&[f64]; 3], component: usize, of: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<f64> {
    let [xs, ys, zs] = nodes_m;
    let places = zs.iter().flat_map(|&z| {
        ys.iter()
            .flat_map(move |&y| xs.iter().map(move |&x| [x, y, z]))
    });
    places.map(|p| of(p)[component]).collect()
}

/// Writes the field of 2 s as `wave.nc`.
fn write_wave(folder: &Path) {
    let centre_m = [
        axis(-60.0, 60.0, 41),
        axis(220.0, 500.0, 95),
        axis(-4.0, 60.0, 33),
    ];
    let face_m = centre_m.clone().map(|c| {
        c.iter()
            .map(|x| x - 0.5 * (c[1] - c[0]))
            .collect::<Vec<f64>>()
    });
    let velocity_m_s = std::array::from_fn(|d| {
        let nodes = std::array::from_fn(|k| {
            if k == d {
                &face_m[k][..]
            } else {
                &centre_m[k][..]
            }
        });
        sampled(nodes, d, wave)
    });
    let origin = Provenance {
        program: "t".into(),
        scene_toml: String::new(),
        scene_hash: "0".into(),
        seed: 1,
    };
    let planes = 0..centre_m[2].len();
    let faces = FaceVelocities {
        title: "wave".into(),
        time_s: 2.0,
        centre_m,
        face_m,
        velocity_m_s,
        planes,
    };
    std::fs::write(
        folder.join("wave.nc"),
        cf_faces_parts(&faces, &origin).unwrap().into_bytes(),
    )
    .unwrap();
}

#[test]
fn an_rhi_off_the_cross_plane_sees_what_a_field_along_the_flight_says() {
    let folder = tempfile::tempdir().unwrap();
    write_wave(folder.path());
    let flow = "kind = \"fields\"\nfiles = \"wave.nc\"\nmotion = \"frozen\"\n";
    let scan = format!(
        "elevation_min_rad = 0.02\nelevation_max_rad = 0.08\nelevation_step_rad = 0.02\n{}",
        "lidar.x_m = 31.7\n"
    );
    let plan = plan_in(folder.path(), [flow, &scan, ""], Target::Map).unwrap();
    assert_eq!(plan.wind.start_s, 2.0);
    let map = map(&plan);
    for (line, gate) in (0..4).flat_map(|line| (0..map.range_m.len()).map(move |gate| (line, gate)))
    {
        let beam = plan.geometry.schedule.middle(line);
        let expected = beam
            .direction
            .radial_velocity_m_s(wave(beam.at_range_m(map.range_m[gate])), [0.0; 3]);
        assert!(
            (map.v_exact_m_s[[line, gate]] - expected).abs() < 1e-6,
            "{line} {gate} {expected}"
        );
    }
    let left = scan.replace("31.7", "300.0");
    let message = plan_in(folder.path(), [flow, &left, ""], Target::Map)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("leaves the simulated flow") && message.contains("x = 300.00 m"),
        "{message}"
    );
    // The only field is of 2 s, and the scan goes on.
    let moving = flow.replace("frozen", "moving");
    let message = plan_in(folder.path(), [&moving, &scan, ""], Target::Map)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("flow.files") && message.contains("the fields at 2.000 s: begin earlier"),
        "{message}"
    );
}

#[test]
fn a_carried_field_is_the_field_with_a_moved_origin() {
    let folder = tempfile::tempdir().unwrap();
    write_wave(folder.path());
    let scan = "elevation_min_rad = 0.02\nelevation_max_rad = 0.08\nelevation_step_rad = 0.02\nhead.dead_time_s = 0.1\n";
    let planned = |motion: &str, turn: &str| {
        let flow = format!("kind = \"fields\"\nfiles = \"wave.nc\"\n{turn}{motion}");
        plan_in(folder.path(), [&flow, scan, ""], Target::Map)
    };
    let velocity_m_s = [100.0, 10.0];
    for turn in ["", "rotation_rad = 0.02\n"] {
        let motion = "motion = \"carried\"\ncarried_m_s = [100.0, 10.0]\n";
        let plan = planned(motion, turn).unwrap();
        let carried = map(&plan);
        for line in 0..4 {
            let time_s = plan.geometry.schedule.middle(line).time_s;
            let [x_m, y_m] = velocity_m_s.map(|velocity_m_s| velocity_m_s * time_s);
            let motion = format!("motion = \"frozen\"\norigin_m = [{x_m:?}, {y_m:?}, 0.0]\n");
            let moved = map(&planned(&motion, turn).unwrap());
            for (found, expected) in carried
                .v_exact_m_s
                .row(line)
                .iter()
                .zip(moved.v_exact_m_s.row(line))
            {
                assert!(
                    (found - expected).abs() < 1e-9,
                    "{line}: {found} {expected}"
                );
            }
        }
        assert!(plan.geometry.schedule.middle(3).time_s > 0.3);
    }
    // The field moves out of the scan: at which time is said.
    let message = planned("motion = \"carried\"\ncarried_m_s = [0.0, 200.0]\n", "");
    let message = message.unwrap_err().to_string();
    assert!(
        message.contains("s after the start of the scan (x = 0.00 m"),
        "{message}"
    );
    for (motion, expected) in [
        ("motion = \"carried\"\n", "a velocity other than 0"),
        (
            "motion = \"frozen\"\ncarried_m_s = [1.0, 0.0]\n",
            "needs motion = \"carried\"",
        ),
    ] {
        let message = planned(motion, "").unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn fields_with_the_names_of_other_programs_are_read() {
    // Written by Python's libraries (`tests/files-of-others/make.py`), of a wind that is linear in place.
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/files-of-others");
    let scan = "elevation_min_rad = 0.2\nelevation_max_rad = 0.6\n\
                elevation_step_rad = 0.1\noutside_flow = { policy = \"mask\" }\nbelow_ground = { policy = \"mask\" }\n";
    let wind = |[x, y, z]: [f64; 3], t: f64| {
        [
            1.0 + 0.01 * z,
            2.0 + 0.02 * z + 0.001 * y + t,
            -0.5 + 0.003 * x,
        ]
    };
    for (file, more, growth_per_s) in [
        ("fields_of_cm1.nc", "motion = \"frozen\"\n", 0.0),
        #[cfg(feature = "netcdf4")]
        (
            "fields_of_wrf.nc",
            "names = [\"U\", \"V\", \"W\"]\nmotion = \"moving\"\n",
            0.1,
        ),
    ] {
        let flow = format!(
            "kind = \"fields\"\nfiles = \"{file}\"\norigin_m = [-240.0, 100.0, 0.0]\n{more}"
        );
        let plan = plan_in(Path::new(folder), [&flow, scan, ""], Target::Map).unwrap();
        let map = map(&plan);
        let mut known = 0;
        for ((line, gate), found) in map
            .v_exact_m_s
            .indexed_iter()
            .filter(|(_, v)| v.is_finite())
        {
            let beam = plan.geometry.schedule.middle(line);
            let [x, y, z] = beam.at_range_m(map.range_m[gate]);
            let later_s = plan.wind.start_s + beam.time_s;
            let air = wind([x + 240.0, y - 100.0, z], growth_per_s * later_s);
            let expected = beam.direction.radial_velocity_m_s(air, [0.0; 3]);
            assert!(
                (found - expected).abs() < 1e-5,
                "{file}: {found} {expected}"
            );
            known += 1;
        }
        assert!(known > 30, "{file}: {known}");
    }
}

#[cfg(feature = "netcdf4")]
#[test]
fn fields_in_netcdf4_are_read_time_by_time() {
    // Written by netCDF4 of Python, compressed in chunks, of a wind that is linear in place and time; w is packed into 16 bits.
    let folder = Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/reference/sim"
    ));
    let wind = |[x, y, z]: [f64; 3], t: f64| {
        [
            1.0 + x / 64.0,
            2.0 + (y - 360.0) / 128.0 + z / 32.0 + t / 2.0,
            0.5 + (z - 16.0) / 64.0 - t / 4.0,
        ]
    };
    let flow = "kind = \"fields\"\nfiles = \"linear_fields_netcdf4.nc\"\n";
    let scan = "elevation_min_rad = 0.02\nelevation_max_rad = 0.08\nelevation_step_rad = 0.02\nlidar.x_m = 5.0\n";
    let plan = plan_in(folder, [flow, scan, ""], Target::Map).unwrap();
    let map = map(&plan);
    for (line, gate) in (0..4).flat_map(|line| (0..map.range_m.len()).map(move |gate| (line, gate)))
    {
        let beam = plan.geometry.schedule.middle(line);
        let air = wind(
            beam.at_range_m(map.range_m[gate]),
            plan.wind.start_s + beam.time_s,
        );
        let expected = beam.direction.radial_velocity_m_s(air, [0.0; 3]);
        assert!(
            (map.v_exact_m_s[[line, gate]] - expected).abs() < 1e-9,
            "{line} {gate} {expected}"
        );
    }
    let absent = plan_in(
        folder,
        [&format!("{flow}names = [\"u\", \"v\", \"up\"]\n"), scan, ""],
        Target::Map,
    );
    assert!(
        absent
            .unwrap_err()
            .to_string()
            .contains("it has no variable up")
    );
    // Begun by its writer, and nothing written: the library's default fill, which the file does not state.
    let unwritten = plan_in(
        folder,
        [
            &format!("{flow}names = [\"u\", \"v\", \"unwritten\"]\n"),
            scan,
            "",
        ],
        Target::Map,
    );
    let message = unwritten.unwrap_err().to_string();
    assert!(
        message.contains("unwritten is missing or not finite at index"),
        "{message}"
    );
}

/// One vortex at (y, z), anticlockwise as one looks along +x with y to the right; `side` -1 in right-handed axes.
fn vortex(side: f64) -> impl Fn([f64; 3]) -> [f64; 3] {
    move |[_, y, z]| {
        let (dy, dz) = (side * y - 370.0, z - 30.0);
        let omega = 300.0 / (TAU * (dy * dy + dz * dz + 25.0 * 25.0));
        [0.0, side * -omega * dz, omega * dy]
    }
}

/// Writes a file: dimensions, coordinates (name, values), and components over their dimensions.
type Component<'a> = (&'a str, [&'a str; 4], Vec<f64>);

fn netcdf(
    path: &Path,
    dims: &[(&str, usize)],
    lists: &[(&str, &[&str], Vec<f64>)],
    components: &[Component<'_>],
    globals: &[(&str, f64)],
) {
    let mut data = DataSet::new();
    for (name, length) in dims {
        data.add_fixed_dim(name, *length).unwrap();
    }
    for (name, value) in globals {
        data.add_global_attr_f64(name, vec![*value]).unwrap();
    }
    for (name, dims, _) in lists {
        data.add_var_f64(name, dims).unwrap();
    }
    for (name, dims, _) in components {
        data.add_var_f64(name, dims).unwrap();
    }
    let mut file = FileWriter::open(path).unwrap();
    file.set_def(&data, Version::Offset64Bit, 0).unwrap();
    for (name, _, values) in lists {
        file.write_var_f64(name, values).unwrap();
    }
    for (name, _, values) in components {
        file.write_var_f64(name, values).unwrap();
    }
    file.close().unwrap();
}

fn near_vortex(folder: &Path, flow: &str) {
    let scan = "elevation_min_rad = 0.02\nelevation_max_rad = 0.12\nelevation_step_rad = 0.02\n";
    let plan = plan_in(folder, [flow, scan, ""], Target::Map).unwrap();
    let map = map(&plan);
    let mut largest = 0.0_f64;
    for (line, gate) in (0..6).flat_map(|line| (0..map.range_m.len()).map(move |gate| (line, gate)))
    {
        let beam = plan.geometry.schedule.middle(line);
        let expected = beam
            .direction
            .radial_velocity_m_s(vortex(1.0)(beam.at_range_m(map.range_m[gate])), [0.0; 3]);
        let found = map.v_exact_m_s[[line, gate]];
        assert!(
            (found - expected).abs() < 2e-3,
            "{flow} {line} {gate} {found} {expected}"
        );
        largest = largest.max(expected.abs());
    }
    assert!(largest > 0.5);
}

#[test]
fn staggered_fields_of_palm_and_wrf_come_out_unmirrored() {
    let folder = tempfile::tempdir().unwrap();
    // PALM: right-handed, y to the left of x, so the scan at y > 0 of the scene is at y < 0 of the file.
    let (x, y, z) = (
        axis(-100.0, 100.0, 6),
        axis(-500.0, -220.0, 71),
        axis(0.0, 80.0, 21),
    );
    let half = |nodes: &[f64]| -> Vec<f64> {
        nodes
            .iter()
            .map(|x| x - 0.5 * (nodes[1] - nodes[0]))
            .collect()
    };
    let (xu, yv) = (half(&x), half(&y));
    let zw: Vec<f64> = z.iter().map(|z| z + 2.0).collect();
    let times = |mut values: Vec<f64>| {
        values.extend(values.clone());
        values
    };
    let right = || vortex(-1.0);
    netcdf(
        &folder.path().join("palm.nc"),
        &[
            ("time", 2),
            ("zu_3d", 21),
            ("zw_3d", 21),
            ("y", 71),
            ("yv", 71),
            ("x", 6),
            ("xu", 6),
        ],
        &[
            ("time", &["time"], vec![600.0, 660.0]),
            ("zu_3d", &["zu_3d"], z.clone()),
            ("zw_3d", &["zw_3d"], zw.clone()),
            ("y", &["y"], y.clone()),
            ("yv", &["yv"], yv.clone()),
            ("x", &["x"], x.clone()),
            ("xu", &["xu"], xu.clone()),
        ],
        &[
            (
                "u",
                ["time", "zu_3d", "y", "xu"],
                times(sampled([&xu, &y, &z], 0, right())),
            ),
            (
                "v",
                ["time", "zu_3d", "yv", "x"],
                times(sampled([&x, &yv, &z], 1, right())),
            ),
            (
                "w",
                ["time", "zw_3d", "y", "x"],
                times(sampled([&x, &y, &zw], 2, right())),
            ),
        ],
        &[],
    );
    let flow = "kind = \"fields\"\nfiles = \"palm.nc\"\nmirror_y = true\nmotion = \"frozen\"\n";
    // The lowest w is 2 m up: open below, so the lines stay above.
    near_vortex(folder.path(), flow);
    let mirrored = plan_in(
        folder.path(),
        [&flow.replace("true", "false"), RHI, ""],
        Target::Map,
    )
    .unwrap_err()
    .to_string();
    assert!(mirrored.contains("leaves the simulated flow"), "{mirrored}");
    // WRF: no coordinates but DX, DY and the geopotential; faces one more than centres. Moved to where the scan is.
    let (nx, ny, nz) = (6, 71, 20);
    let faces =
        |count: usize, step: f64| -> Vec<f64> { (0..=count).map(|i| i as f64 * step).collect() };
    let centres = |count: usize, step: f64| -> Vec<f64> {
        (0..count).map(|i| (i as f64 + 0.5) * step).collect()
    };
    let (xs, xc, ys, yc) = (
        faces(nx, 40.0),
        centres(nx, 40.0),
        faces(ny, 4.0),
        centres(ny, 4.0),
    );
    let (zs, zc) = (faces(nz, 4.0), centres(nz, 4.0));
    // The file's y runs against the scene's: its origin is at y = 500 m, x = -120 m.
    let moved = |[x, y, z]: [f64; 3]| vortex(-1.0)([x - 120.0, y - 500.0, z]);
    let geopotential: Vec<f64> = zs
        .iter()
        .flat_map(|z| vec![9.81 * (z + 55.0); nx * ny])
        .collect();
    let mass = ["Time", "bottom_top_stag", "south_north", "west_east"];
    netcdf(
        &folder.path().join("wrfout.nc"),
        &[
            ("Time", 1),
            ("bottom_top", nz),
            ("bottom_top_stag", nz + 1),
            ("south_north", ny),
            ("south_north_stag", ny + 1),
            ("west_east", nx),
            ("west_east_stag", nx + 1),
        ],
        &[("XTIME", &["Time"], vec![0.0])],
        &[
            (
                "U",
                ["Time", "bottom_top", "south_north", "west_east_stag"],
                sampled([&xs, &yc, &zc], 0, moved),
            ),
            (
                "V",
                ["Time", "bottom_top", "south_north_stag", "west_east"],
                sampled([&xc, &ys, &zc], 1, moved),
            ),
            ("W", mass, sampled([&xc, &yc, &zs], 2, moved)),
            ("PH", mass, vec![0.0; geopotential.len()]),
            ("PHB", mass, geopotential.clone()),
        ],
        &[("DX", 40.0), ("DY", 4.0)],
    );
    let flow = "kind = \"fields\"\nfiles = \"wrfout.nc\"\nnames = [\"U\", \"V\", \"W\"]\nmirror_y = true\n\
                origin_m = [-120.0, 500.0, 0.0]\nmotion = \"frozen\"\n";
    near_vortex(folder.path(), flow);
    let turned = flow.replace("origin_m", "rotation_rad = 6.283185307179586\norigin_m");
    near_vortex(folder.path(), &turned);
}
