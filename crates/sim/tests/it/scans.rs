//! Scans of every pattern through whole runs: the bytes of an RHI, truths of linear winds, fields in three dimensions, files.

use netcdf3::{DataSet, FileReader, FileWriter, Version};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;
use wakescope_sim::io::cf_fields::{FaceVelocities, cf_faces_bytes};
use wakescope_sim::io::{Existing, Provenance};
use wakescope_sim::measure::beam_winds::beam_winds;
use wakescope_sim::measure::map::VelocityEstimates;
use wakescope_sim::measure::write::write;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::scene::SceneFile;
use wakescope_sim::{Error, Silent, run};

/// A scene with few lines at 10 dB; the words in capitals are replaced.
const SCENE: &str = r#"
seed = 3
ADDED
[detector.snr]
reference = "fixed"
snr_db = 10.0
[flow]
FLOW
[scan]
SCAN
range_min_m = 300.0
range_max_m = 420.0
pulses_per_line = 8
realisations = 2
[estimator]
gate_step_samples = 20
[outputs]
profile_points = 3
png = false
OUTPUTS
"#;

const RHI: &str = "elevation_max_rad = 0.02\nelevation_step_rad = 4e-3\n";

fn plan_in(folder: &Path, [flow, scan, outputs]: [&str; 3], target: Target) -> Result<Plan, Error> {
    let text = SCENE.replace("ADDED", "").replace("FLOW", flow).replace("SCAN", scan).replace("OUTPUTS", outputs);
    Plan::new(SceneFile::parse(&text, &folder.join("scene.toml"))?, target)
}

fn plan(flow: &str, scan: &str) -> Plan {
    plan_in(Path::new(""), [flow, scan, ""], Target::Map).unwrap()
}

fn refused(flow: &str, scan: &str) -> String {
    plan_in(Path::new(""), [flow, scan, ""], Target::Map).unwrap_err().to_string()
}

fn map(plan: &Plan) -> VelocityEstimates {
    run(plan, &Silent).unwrap().map.unwrap()
}

/// Names and bytes of the files of a run.
fn files(scan: &str, threads: usize) -> Vec<(String, Vec<u8>)> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let plan = plan_in(Path::new(""), ["", scan, "signals = true\nhpl = false"], Target::Run).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let result = pool.install(|| run(&plan, &Silent)).unwrap();
    let paths = write(&plan, &result, folder.path(), Existing::Own).unwrap();
    let read = |path: &std::path::PathBuf| {
        (path.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(path).unwrap())
    };
    let mut all: Vec<_> = paths.iter().map(read).collect();
    all.sort();
    all
}

#[test]
fn an_rhi_has_the_same_bytes_however_it_is_said_and_with_any_number_of_threads() {
    let plain = files(RHI, 1);
    assert_eq!(plain.len(), 10);
    assert!(plain == files(RHI, 2));
    // Defaults that are stated are the defaults.
    assert!(
        plain == files(&format!("{RHI}pattern.kind = \"rhi\"\nhead.sweeps = 1\nwind_of_pulses.kind = \"line\"\n"), 2)
    );
    // Another azimuth is another label: numbers of the map and of the signals stay.
    let same = |a: &Plan, b: &Plan| {
        let [a, b] = [a, b].map(|plan| run(plan, &Silent).unwrap());
        assert!(a.signals_a.is_some() && a.signals_a == b.signals_a && a.line_velocity_m_s == b.line_velocity_m_s);
        let [a, b] = [a.map.unwrap(), b.map.unwrap()];
        assert_eq!(a.v_mean_m_s, b.v_mean_m_s);
        assert_eq!((a.v_exact_m_s, a.v_pulse_m_s, a.v_gate_m_s), (b.v_exact_m_s, b.v_pulse_m_s, b.v_gate_m_s));
        b.v_spread_m_s
    };
    let of = |scan: &str| plan_in(Path::new(""), ["", &format!("{RHI}{scan}"), "signals = true"], Target::Run).unwrap();
    let plain = of("");
    assert_eq!(same(&plain, &of("azimuth_rad = 1.0")), None);
    // Air that stands still is the same for each pulse, and each pulse looks at it through the general path.
    let spread = same(&plain, &of("azimuth_rad = 1.0\nwind_of_pulses.kind = \"pulse\"")).unwrap();
    assert!(spread.iter().all(|s| *s == 0.0));
    same(&plain, &of("wind_of_pulses = { kind = \"groups\", groups = 3 }"));
}

const PPI: &str = "pattern = { kind = \"ppi\", elevations_rad = [0.05, 0.08], azimuth_min_rad = 1.3, azimuth_max_rad = 1.5 }\n\
                   head = { motion = \"continuous\", rate_rad_s = 1.5, direction = \"alternate\", pointing_jitter_rad = [1e-3, 1e-3] }\n\
                   wind_of_pulses.kind = \"pulse\"\n";

#[test]
fn a_moving_scan_with_jitter_has_the_same_bytes_with_any_number_of_threads() {
    let files_of = files(PPI, 1);
    assert!(files_of == files(PPI, 2));
    let names: Vec<&str> = files_of.iter().map(|(name, _)| name.as_str()).collect();
    assert!(names.contains(&"scan.svg") && names.contains(&"map.svg"), "{names:?}");
}

/// A wind that is linear in place, as scene and as function.
const LINEAR: &str = "kind = \"linear\"\nvelocity_m_s = [4.0, 1.0, -0.2]\ngradient_u_per_s = [0.004, 0.0, 0.03]\n\
                      gradient_v_per_s = [0.002, -0.003, -0.01]\ngradient_w_per_s = [0.001, 0.0, -0.002]\n";

fn linear(p: [f64; 3]) -> [f64; 3] {
    let dot = |g: [f64; 3]| g[0] * p[0] + g[1] * p[1] + g[2] * p[2];
    [4.0 + dot([0.004, 0.0, 0.03]), 1.0 + dot([0.002, -0.003, -0.01]), -0.2 + dot([0.001, 0.0, -0.002])]
}

#[test]
fn truths_of_a_linear_wind_are_exact_in_any_direction() {
    for scan in [
        "pattern = { kind = \"vad\", elevation_rad = 1.0, beams = 6 }",
        "pattern = { kind = \"ppi\", azimuth_step_rad = 0.5 }\nlidar = { flight_azimuth_rad = 0.4, x_m = -50.0, y_m = 7.0 }",
        "pattern.kind = \"axial\"\nelevation_max_rad = 0.1\nelevation_step_rad = 0.05\nlidar_height_m = 30.0",
    ] {
        let plan = plan(LINEAR, scan);
        let map = map(&plan);
        let spacing_m = plan.geometry.sample_spacing_m;
        for line in 0..map.elevation_rad.len() {
            let beam = plan.geometry.schedule.middle(line);
            let seen = |range_m: f64| beam.direction.radial_velocity_m_s(linear(beam.at_range_m(range_m)), [0.0; 3]);
            for (gate, &range_m) in map.range_m.iter().enumerate() {
                let at = [line, gate];
                assert!((map.v_exact_m_s[at] - seen(range_m)).abs() < 1e-9);
                assert!((map.v_pulse_m_s[at] - seen(range_m)).abs() < 1e-9, "{scan}");
                // A window is placed by its middle, its samples are half a sample before it: c T_s/4.
                assert!((map.v_gate_m_s[at] - seen(range_m - 0.5 * spacing_m)).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn the_truth_of_a_line_is_the_mean_over_its_pulses_with_their_spread() {
    let scan = "pattern = { kind = \"ppi\", azimuth_min_rad = 0.4, azimuth_max_rad = 1.0 }\n\
                head = { motion = \"continuous\", rate_rad_s = 6.0 }\nwind_of_pulses.kind = \"pulse\"";
    let plan = plan("kind = \"linear\"\nvelocity_m_s = [-8.0, 3.0, 0.5]", scan);
    let map = map(&plan);
    let schedule = &plan.geometry.schedule;
    assert!(schedule.lines.len() >= 4);
    for line in 0..schedule.lines.len() {
        let seen: Vec<f64> = (0..8)
            .map(|pulse| schedule.beam_of_pulse(line, pulse).direction.radial_velocity_m_s([-8.0, 3.0, 0.5], [0.0; 3]))
            .collect();
        let mean = seen.iter().sum::<f64>() / 8.0;
        let sd = (seen.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 8.0).sqrt();
        let spread = map.v_spread_m_s.as_ref().unwrap()[[line, 0]];
        assert!((map.v_pulse_m_s[[line, 0]] - mean).abs() < 1e-9 && (spread - sd).abs() < 1e-9, "{spread} {sd}");
        assert!(sd > 0.1);
    }
    // Without noise to speak of the estimates are that mean, not the wind at the middle of the line.
    let error = (&map.v_mean_m_s - &map.v_gate_m_s).mapv(f64::abs);
    assert!(error.mean().unwrap() < 0.6, "{error}");
}

#[test]
fn vad_and_dbs_of_a_scan_tell_the_wind_with_their_errors() {
    let uniform = "kind = \"linear\"\nvelocity_m_s = [6.0, -3.0, 0.2]";
    let wind = [6.0, -3.0, 0.2];
    for (scan, beams) in [
        ("pattern = { kind = \"vad\", elevation_rad = 1.1, beams = 24 }\nhead.sweeps = 2", 24.0),
        ("pattern = { kind = \"dbs\", elevation_rad = 1.1 }\nhead.sweeps = 2", 4.0f64),
    ] {
        let plan = plan(uniform, scan);
        let map = map(&plan);
        let winds = beam_winds(&plan, &map).unwrap().unwrap();
        assert_eq!(winds.len(), 2 * map.range_m.len());
        let cos = 1.1f64.cos();
        for (i, found) in winds.iter().enumerate() {
            assert!((found.height_m - found.range_m * 1.1f64.sin()).abs() < 1e-6);
            let gate = i % map.range_m.len();
            let sigma = map.std_m_s.column(gate).mean().unwrap().max(0.1);
            for (d, wind) in wind.iter().enumerate() {
                assert!((found.true_m_s[d] - wind).abs() < 1e-12 && (found.noiseless_m_s[d] - wind).abs() < 1e-9);
                // (u, v) of white noise: sigma sqrt(2/N)/cos.
                assert!((found.mean_m_s[d] - wind).abs() < 6.0 * sigma * (2.0 / beams).sqrt() / cos, "{found:?}");
                assert!(found.std_m_s[d] > 0.0 && found.std_m_s[d] < 10.0 * sigma * (2.0 / beams).sqrt() / cos);
                assert_eq!(found.error_bar_m_s[d].is_nan(), beams == 4.0);
            }
        }
    }
}

/// A smooth field that varies along the flight.
fn wave([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (a, b, c) = (x / 400.0, y / 500.0, z / 300.0);
    [3.0 * a.sin() * b.cos(), 4.0 * (a + b).cos() * c.cos(), 2.0 * a.cos() * (b + c).sin()]
}

fn axis(low: f64, high: f64, count: usize) -> Vec<f64> {
    (0..count).map(|i| low + (high - low) * i as f64 / (count - 1) as f64).collect()
}

fn sampled(nodes_m: [&[f64]; 3], component: usize, of: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<f64> {
    let [xs, ys, zs] = nodes_m;
    let places = zs.iter().flat_map(|&z| ys.iter().flat_map(move |&y| xs.iter().map(move |&x| [x, y, z])));
    places.map(|p| of(p)[component]).collect()
}

#[test]
fn an_rhi_off_the_cross_plane_sees_what_a_field_along_the_flight_says() {
    let folder = tempfile::tempdir().unwrap();
    let centre_m = [axis(-60.0, 60.0, 41), axis(220.0, 500.0, 95), axis(-4.0, 60.0, 33)];
    let face_m = centre_m.clone().map(|c| c.iter().map(|x| x - 0.5 * (c[1] - c[0])).collect::<Vec<f64>>());
    let velocity_m_s = std::array::from_fn(|d| {
        let nodes = std::array::from_fn(|k| if k == d { &face_m[k][..] } else { &centre_m[k][..] });
        sampled(nodes, d, wave)
    });
    let origin = Provenance { program: "t".into(), scene_toml: String::new(), scene_hash: "0".into(), seed: 1 };
    let faces = FaceVelocities { title: "wave".into(), time_s: 2.0, centre_m, face_m, velocity_m_s };
    std::fs::write(folder.path().join("wave.nc"), cf_faces_bytes(&faces, &origin).unwrap()).unwrap();
    let flow = "kind = \"fields\"\nfiles = \"wave.nc\"\nmotion = \"frozen\"\n";
    let scan = format!(
        "elevation_min_rad = 0.02\nelevation_max_rad = 0.08\nelevation_step_rad = 0.02\n{}",
        "lidar.x_m = 31.7\n"
    );
    let plan = plan_in(folder.path(), [flow, &scan, ""], Target::Map).unwrap();
    assert_eq!(plan.wind.start_s, 2.0);
    let map = map(&plan);
    for (line, gate) in (0..4).flat_map(|line| (0..map.range_m.len()).map(move |gate| (line, gate))) {
        let beam = plan.geometry.schedule.middle(line);
        let expected = beam.direction.radial_velocity_m_s(wave(beam.at_range_m(map.range_m[gate])), [0.0; 3]);
        assert!((map.v_exact_m_s[[line, gate]] - expected).abs() < 1e-6, "{line} {gate} {expected}");
    }
    let left = scan.replace("31.7", "300.0");
    let message = plan_in(folder.path(), [flow, &left, ""], Target::Map).unwrap_err().to_string();
    assert!(message.contains("leaves the simulated flow") && message.contains("x = 300.00 m"), "{message}");
    // The only field is of 2 s, and the scan goes on.
    let moving = flow.replace("frozen", "moving");
    let message = plan_in(folder.path(), [&moving, &scan, ""], Target::Map).unwrap_err().to_string();
    assert!(message.contains("flow.files") && message.contains("the fields at 2.000 s: begin earlier"), "{message}");
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
    for (line, gate) in (0..6).flat_map(|line| (0..map.range_m.len()).map(move |gate| (line, gate))) {
        let beam = plan.geometry.schedule.middle(line);
        let expected = beam.direction.radial_velocity_m_s(vortex(1.0)(beam.at_range_m(map.range_m[gate])), [0.0; 3]);
        let found = map.v_exact_m_s[[line, gate]];
        assert!((found - expected).abs() < 2e-3, "{flow} {line} {gate} {found} {expected}");
        largest = largest.max(expected.abs());
    }
    assert!(largest > 0.5);
}

#[test]
fn staggered_fields_of_palm_and_wrf_come_out_unmirrored() {
    let folder = tempfile::tempdir().unwrap();
    // PALM: right-handed, y to the left of x, so the scan at y > 0 of the scene is at y < 0 of the file.
    let (x, y, z) = (axis(-100.0, 100.0, 6), axis(-500.0, -220.0, 71), axis(0.0, 80.0, 21));
    let half = |nodes: &[f64]| -> Vec<f64> { nodes.iter().map(|x| x - 0.5 * (nodes[1] - nodes[0])).collect() };
    let (xu, yv) = (half(&x), half(&y));
    let zw: Vec<f64> = z.iter().map(|z| z + 2.0).collect();
    let times = |mut values: Vec<f64>| {
        values.extend(values.clone());
        values
    };
    let right = || vortex(-1.0);
    netcdf(
        &folder.path().join("palm.nc"),
        &[("time", 2), ("zu_3d", 21), ("zw_3d", 21), ("y", 71), ("yv", 71), ("x", 6), ("xu", 6)],
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
            ("u", ["time", "zu_3d", "y", "xu"], times(sampled([&xu, &y, &z], 0, right()))),
            ("v", ["time", "zu_3d", "yv", "x"], times(sampled([&x, &yv, &z], 1, right()))),
            ("w", ["time", "zw_3d", "y", "x"], times(sampled([&x, &y, &zw], 2, right()))),
        ],
        &[],
    );
    let flow = "kind = \"fields\"\nfiles = \"palm.nc\"\nmirror_y = true\nmotion = \"frozen\"\n";
    // The lowest w is 2 m up: open below, so the lines stay above.
    near_vortex(folder.path(), flow);
    let mirrored =
        plan_in(folder.path(), [&flow.replace("true", "false"), RHI, ""], Target::Map).unwrap_err().to_string();
    assert!(mirrored.contains("leaves the simulated flow"), "{mirrored}");
    // WRF: no coordinates but DX, DY and the geopotential; faces one more than centres. Moved to where the scan is.
    let (nx, ny, nz) = (6, 71, 20);
    let faces = |count: usize, step: f64| -> Vec<f64> { (0..=count).map(|i| i as f64 * step).collect() };
    let centres = |count: usize, step: f64| -> Vec<f64> { (0..count).map(|i| (i as f64 + 0.5) * step).collect() };
    let (xs, xc, ys, yc) = (faces(nx, 40.0), centres(nx, 40.0), faces(ny, 4.0), centres(ny, 4.0));
    let (zs, zc) = (faces(nz, 4.0), centres(nz, 4.0));
    // The file's y runs against the scene's: its origin is at y = 500 m, x = -120 m.
    let moved = |[x, y, z]: [f64; 3]| vortex(-1.0)([x - 120.0, y - 500.0, z]);
    let geopotential: Vec<f64> = zs.iter().flat_map(|z| vec![9.81 * (z + 55.0); nx * ny]).collect();
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
            ("U", ["Time", "bottom_top", "south_north", "west_east_stag"], sampled([&xs, &yc, &zc], 0, moved)),
            ("V", ["Time", "bottom_top", "south_north_stag", "west_east"], sampled([&xc, &ys, &zc], 1, moved)),
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

#[test]
fn winds_add_up_each_from_its_own_start() {
    let text = SCENE
        .replace(
            "ADDED",
            "added_flows = [{ kind = \"linear\", velocity_m_s = [3.0, 2.0, 1.0] }, \
                  { kind = \"vortex_pair\", circulation_m2_s = 0.0 }]",
        )
        .replace("FLOW", LINEAR)
        .replace("SCAN", RHI)
        .replace("OUTPUTS", "");
    let file = SceneFile::parse(&text, Path::new("s.toml")).unwrap();
    let again = SceneFile::parse(&file.toml, Path::new("s.toml")).unwrap();
    assert_eq!((again.scene, again.hash), (file.scene.clone(), file.hash.clone()));
    let plan = Plan::new(file, Target::Map).unwrap();
    let mut out = [[0.0; 3]];
    plan.wind.wind().velocity_into(&[[10.0, 20.0, 30.0]], 0.0, &mut out).unwrap();
    let expected = linear([10.0, 20.0, 30.0]);
    for (found, (base, added)) in out[0].iter().zip(expected.iter().zip([3.0, 2.0, 1.0])) {
        assert!((found - base - added).abs() < 1e-12);
    }
}

/// Text of a variable of fixed length, up to its first NUL.
fn words(file: &mut FileReader, name: &str) -> Vec<String> {
    let bytes = file.read_var_u8(name).unwrap();
    let word = |part: &[u8]| String::from_utf8_lossy(part).trim_end_matches('\0').to_owned();
    bytes.chunks_exact(32).map(word).collect()
}

#[test]
fn each_kind_of_sweep_has_its_word_and_angle_in_files_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let sweeps = |out: &Path, name: &str| {
        let mut file = FileReader::open(out.join(name)).unwrap();
        (
            words(&mut file, "sweep_mode"),
            file.read_var_f32("fixed_angle").unwrap(),
            file.read_var_i32("sweep_end_ray_index").unwrap(),
        )
    };
    let outputs = "csv = false\nsvg = false\nflow = false";
    let run_in = |scan: &str| {
        let plan = plan_in(folder.path(), ["", scan, outputs], Target::Run).unwrap();
        let out = tempfile::tempdir().unwrap();
        write(&plan, &run(&plan, &Silent).unwrap(), out.path(), Existing::Own).unwrap();
        out
    };
    for (scan, mode, fixed, ends) in [
        (
            "pattern = { kind = \"ppi\", azimuth_step_rad = 1.0, elevations_rad = [0.1, 0.2] }",
            "azimuth_surveillance",
            0.1f64,
            vec![6, 13],
        ),
        ("pattern = { kind = \"ppi\", azimuth_max_rad = 1.0, azimuth_step_rad = 0.5 }", "sector", 0.05, vec![2]),
        ("pattern = { kind = \"stare\", lines = 4 }", "vertical_pointing", FRAC_PI_2, vec![3]),
        ("pattern = { kind = \"dbs\", elevation_rad = 1.0 }", "pointing", 1.0, vec![4]),
    ] {
        let out = run_in(scan);
        let (modes, angles, last) = sweeps(out.path(), "map.nc");
        assert!(modes.iter().all(|m| m == mode) && modes.len() == ends.len(), "{modes:?}");
        assert!((f64::from(angles[0]) - fixed.to_degrees()).abs() < 1e-4 && last == ends, "{angles:?} {last:?}");
    }
    let flying = "pattern = { kind = \"stare\", elevation_rad = 0.2, lines = 3 }\nlidar.velocity_m_s = [9.0, 0.0, 1.0]";
    for (scan, name, mobile, dims) in
        [("pattern = { kind = \"vad\" }", "azimuth_surveillance", "false", 0), (flying, "pointing", "true", 1)]
    {
        let out = run_in(scan);
        let file = FileReader::open(out.path().join("map.nc")).unwrap();
        let of = |name: &str| file.data_set().get_global_attr_as_string(name).unwrap();
        assert_eq!((of("scan_name"), of("platform_is_mobile")), (name.to_owned(), mobile.to_owned()));
        assert_eq!(file.data_set().get_var("latitude").unwrap().get_dims().len(), dims);
    }
    let list = "azimuth_rad,elevation_rad,pulses,sweep,mode\n1.5,0.1,4,0,rhi\n1.5,0.2,4,0,rhi\n0.5,0.3,9,1,pointing\n";
    std::fs::write(folder.path().join("list.csv"), list).unwrap();
    let out = run_in("pattern = { kind = \"list\", file = \"list.csv\" }");
    assert_eq!(sweeps(out.path(), "map_rhi.nc").0, ["rhi"]);
    assert_eq!(sweeps(out.path(), "map_pointing.nc").0, ["pointing"]);
    let mut file = FileReader::open(out.path().join("map_pointing.nc")).unwrap();
    assert_eq!(file.read_var_i32("n_samples").unwrap(), [9]);
}

#[test]
fn what_a_scan_cannot_be_is_refused_with_key_and_what_is_allowed() {
    let calm = "kind = \"calm\"";
    for (scan, wanted) in [
        ("pattern = { kind = \"ppi\", elevations_rad = [0.1, -0.1] }", "scan.pattern.elevations_rad = -0.1"),
        ("pattern = { kind = \"ppi\", elevations_rad = [] }", "a list of 1 to 1000 elevations"),
        ("pattern = { kind = \"ppi\", azimuth_max_rad = 7.0 }", "scan.pattern.azimuth_max_rad = 7.0"),
        ("pattern = { kind = \"vad\", beams = 2 }", "scan.pattern.beams = 2"),
        ("pattern = { kind = \"vad\" }\nhead.motion = \"continuous\"", "rhi, ppi and axial may be continuous"),
        ("head.motion = \"continuous\"", "scan.head.rate_rad_s = inf"),
        ("head.pointing_jitter_rad = [1e-3, 0.0]", "wind_of_pulses.kind = \"pulse\""),
        (
            "pattern.kind = \"stare\"\nelevation_max_rad = 0.2",
            "scan.elevation_max_rad = 0.2 is not allowed: scan.pattern.kind",
        ),
        ("pattern = { kind = \"stare\", elevation_rad = -0.2 }", "scan.below_ground.policy"),
        ("pattern = { kind = \"list\", file = \"nowhere.csv\" }", "nowhere.csv"),
        ("pattern = { kind = \"spiral\" }", "one of \"rhi\", \"ppi\""),
        ("head.sweeps = 100000", "at most 100000 lines"),
    ] {
        let message = refused(calm, scan);
        assert!(message.contains(wanted), "{scan}: {message}");
        assert!(message.contains("scene.toml:") || message.contains("nowhere"), "{message}");
    }
    let message = refused("kind = \"vortex_lines\"\nnodes_m = [[[0.0, 1.0, 2.0]]]\ncirculation_m2_s = [5.0]", RHI);
    assert!(message.contains("flow.nodes_m") && message.contains("2 of an endless vortex"), "{message}");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("l.csv"), "time_s,azimuth_rad,elevation_rad\n1.0,0,0.1\n0.5,0,0.1\n").unwrap();
    let scan = "pattern = { kind = \"list\", file = \"l.csv\" }";
    let message = plan_in(folder.path(), [calm, scan, ""], Target::Map).unwrap_err().to_string();
    assert!(message.contains("row 2: time_s = 0.5: at least"), "{message}");
}
