//! Scans of every pattern through whole runs: the bytes of an RHI, truths of linear winds, files.

use netcdf3::FileReader;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;
use wakescope_sim::io::Existing;
use wakescope_sim::measure::map::VelocityEstimates;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::scene::SceneFile;
use wakescope_sim::wind::{WindOptions, winds_of_map};
use wakescope_sim::write::{velocity_map, write};
use wakescope_sim::{Error, Silent, run};

/// A scene with few lines at 10 dB; the words in capitals are replaced.
pub(crate) const SCENE: &str = r#"
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

pub(crate) const RHI: &str = "elevation_max_rad = 0.02\nelevation_step_rad = 4e-3\n";

pub(crate) fn plan_in(
    folder: &Path,
    [flow, scan, outputs]: [&str; 3],
    target: Target,
) -> Result<Plan, Error> {
    let text = SCENE
        .replace("ADDED", "")
        .replace("FLOW", flow)
        .replace("SCAN", scan)
        .replace("OUTPUTS", outputs);
    Plan::new(SceneFile::parse(&text, &folder.join("scene.toml"))?, target)
}

fn plan(flow: &str, scan: &str) -> Plan {
    plan_in(Path::new(""), [flow, scan, ""], Target::Map).unwrap()
}

fn refused(flow: &str, scan: &str) -> String {
    plan_in(Path::new(""), [flow, scan, ""], Target::Map)
        .unwrap_err()
        .to_string()
}

pub(crate) fn map(plan: &Plan) -> VelocityEstimates {
    run(plan, &Silent).unwrap().map.unwrap()
}

/// Names and bytes of the files of a run.
fn files(scan: &str, threads: usize) -> Vec<(String, Vec<u8>)> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    let plan = plan_in(
        Path::new(""),
        ["", scan, "signals = true\nhpl = false"],
        Target::Run,
    )
    .unwrap();
    let folder = tempfile::tempdir().unwrap();
    let result = pool.install(|| run(&plan, &Silent)).unwrap();
    let paths = write(&plan, &result, folder.path(), Existing::Refuse).unwrap();
    let read = |path: &std::path::PathBuf| {
        (
            path.file_name().unwrap().to_string_lossy().into_owned(),
            std::fs::read(path).unwrap(),
        )
    };
    let mut all: Vec<_> = paths.iter().map(read).collect();
    all.sort();
    all
}

#[test]
fn an_rhi_has_the_same_bytes_however_it_is_said_and_with_any_number_of_threads() {
    let plain = files(RHI, 1);
    assert_eq!(plain.len(), 9);
    assert!(plain == files(RHI, 2));
    // Defaults that are stated are the defaults.
    assert!(
        plain
            == files(
                &format!(
                    "{RHI}pattern.kind = \"rhi\"\nhead.sweeps = 1\nwind_of_pulses.kind = \"line\"\n"
                ),
                2
            )
    );
    // Another azimuth is another label: numbers of the map and of the signals stay.
    let same = |a: &Plan, b: &Plan| {
        let [a, b] = [a, b].map(|plan| run(plan, &Silent).unwrap());
        assert!(
            a.signals_a.is_some()
                && a.signals_a == b.signals_a
                && a.line_velocity_m_s == b.line_velocity_m_s
        );
        let [a, b] = [a.map.unwrap(), b.map.unwrap()];
        assert_eq!(a.v_mean_m_s, b.v_mean_m_s);
        assert_eq!(
            (a.v_exact_m_s, a.v_pulse_m_s, a.v_gate_m_s),
            (b.v_exact_m_s, b.v_pulse_m_s, b.v_gate_m_s)
        );
        b.v_spread_m_s
    };
    let of = |scan: &str| {
        plan_in(
            Path::new(""),
            ["", &format!("{RHI}{scan}"), "signals = true"],
            Target::Run,
        )
        .unwrap()
    };
    let plain = of("");
    assert_eq!(same(&plain, &of("azimuth_rad = 1.0")), None);
    // Air that stands still is the same for each pulse, and each pulse looks at it through the general path.
    let spread = same(
        &plain,
        &of("azimuth_rad = 1.0\nwind_of_pulses.kind = \"pulse\""),
    )
    .unwrap();
    assert!(spread.iter().all(|s| *s == 0.0));
}

const PPI: &str = "pattern = { kind = \"ppi\", elevations_rad = [0.05, 0.08], azimuth_min_rad = 1.3, azimuth_max_rad = 1.5 }\n\
                   head = { motion = \"continuous\", rate_rad_s = 1.5, direction = \"alternate\" }\n\
                   wind_of_pulses.kind = \"pulse\"\n";

#[test]
fn a_moving_scan_with_winds_of_pulses_has_the_same_bytes_with_any_number_of_threads() {
    let files_of = files(PPI, 1);
    assert!(files_of == files(PPI, 2));
    let names: Vec<&str> = files_of.iter().map(|(name, _)| name.as_str()).collect();
    assert!(
        names.contains(&"scan.svg") && names.contains(&"map.svg"),
        "{names:?}"
    );
}

/// A wind that is linear in place, as scene and as function.
const LINEAR: &str = "kind = \"linear\"\nvelocity_m_s = [4.0, 1.0, -0.2]\ngradient_u_per_s = [0.004, 0.0, 0.03]\n\
                      gradient_v_per_s = [0.002, -0.003, -0.01]\ngradient_w_per_s = [0.001, 0.0, -0.002]\n";

fn linear(p: [f64; 3]) -> [f64; 3] {
    let dot = |g: [f64; 3]| g[0] * p[0] + g[1] * p[1] + g[2] * p[2];
    [
        4.0 + dot([0.004, 0.0, 0.03]),
        1.0 + dot([0.002, -0.003, -0.01]),
        -0.2 + dot([0.001, 0.0, -0.002]),
    ]
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
            let seen = |range_m: f64| {
                beam.direction
                    .radial_velocity_m_s(linear(beam.at_range_m(range_m)), [0.0; 3])
            };
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
            .map(|pulse| {
                schedule
                    .beam(line, f64::from(pulse))
                    .direction
                    .radial_velocity_m_s([-8.0, 3.0, 0.5], [0.0; 3])
            })
            .collect();
        let mean = seen.iter().sum::<f64>() / 8.0;
        let sd = (seen.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 8.0).sqrt();
        let spread = map.v_spread_m_s.as_ref().unwrap()[[line, 0]];
        assert!(
            (map.v_pulse_m_s[[line, 0]] - mean).abs() < 1e-9 && (spread - sd).abs() < 1e-9,
            "{spread} {sd}"
        );
        assert!(sd > 0.1);
    }
    // Without noise to speak of the estimates are that mean, not the wind at the middle of the line.
    let error = (&map.v_mean_m_s - &map.v_gate_m_s).mapv(f64::abs);
    assert!(error.mean().unwrap() < 0.6, "{error}");
}

#[test]
fn vad_and_dbs_of_a_scan_determine_the_wind_with_its_standard_errors() {
    let uniform = "kind = \"linear\"\nvelocity_m_s = [6.0, -3.0, 0.2]";
    // The flight is to the north.
    let wind = [-3.0, 6.0, 0.2];
    for (scan, beams) in [
        (
            "pattern = { kind = \"vad\", elevation_rad = 1.1, beams = 24 }\nhead.sweeps = 2",
            24.0,
        ),
        (
            "pattern = { kind = \"dbs\", elevation_rad = 1.1 }\nhead.sweeps = 2",
            4.0f64,
        ),
        (
            "pattern = { kind = \"vad\", elevation_rad = 1.1, beams = 24 }\nhead.sweeps = 2\nlidar.velocity_m_s = [5.0, 2.0, 0.0]",
            24.0,
        ),
    ] {
        let plan = plan(uniform, scan);
        let map = map(&plan);
        let found = winds_of_map(
            &plan,
            &velocity_map(&plan, &map),
            &WindOptions::of_scene(plan.scene()).unwrap(),
        );
        let winds = found.unwrap();
        assert_eq!(winds.rows.len(), 2 * map.range_m.len());
        // White noise on the beams of a cone, in the horizontal components.
        let sigma_m_s = map.std_m_s.mean().unwrap();
        let expected_m_s = sigma_m_s * (2.0 / beams).sqrt() / 1.1f64.cos();
        for (i, (row, true_m_s)) in winds.rows.iter().zip(&winds.true_m_s).enumerate() {
            let range_m = map.range_m[i % map.range_m.len()];
            assert!((row.height_m - range_m * 1.1f64.sin()).abs() < 1e-6);
            let found = [row.east_m_s, row.north_m_s, row.up_m_s];
            for (axis, found) in found.into_iter().enumerate() {
                assert!((true_m_s[axis] - wind[axis]).abs() < 1e-12);
                let error_m_s = (found.value - wind[axis]).abs();
                assert!(error_m_s < 6.0 * found.std.max(expected_m_s), "{row:?}");
            }
            let over = row.east_m_s.std / expected_m_s;
            assert!((0.1..10.0).contains(&over), "{over}: {row:?}");
        }
    }
}

#[test]
fn the_wake_begins_where_the_aircraft_is_when_the_scan_begins() {
    let pair = "kind = \"vortex_pair\"\nmotion = \"inviscid\"\n";
    let velocity = |plan: &Plan, x_m: f64| {
        let mut out = [[f64::NAN; 3]];
        plan.wind
            .wind()
            .velocity_into(&[[x_m, 410.0, 40.0]], plan.wind.start_s, &mut out)
            .unwrap();
        out[0]
    };
    let of = |aircraft: &str| plan(&format!("{pair}aircraft = {{ {aircraft} }}"), RHI);
    let coming = of("speed_m_s = 70.0, x_m = -300.0");
    assert_eq!(velocity(&coming, -299.0), [0.0; 3]);
    assert_ne!(velocity(&coming, -301.0), [0.0; 3]);
    // 700 m behind it the wake is 10 s old, and everywhere so is a pair of that age.
    let age_tau = 10.0 * 500.0 / (TAU * 47.0 * 47.0);
    let aged = plan(&format!("{pair}age_tau = {age_tau:?}"), RHI);
    for (found, expected) in velocity(&coming, -1000.0)
        .into_iter()
        .zip(velocity(&aged, 0.0))
    {
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }
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
    assert_eq!(
        (again.content, again.hash),
        (file.content.clone(), file.hash.clone())
    );
    let plan = Plan::new(file, Target::Map).unwrap();
    let mut out = [[0.0; 3]];
    plan.wind
        .wind()
        .velocity_into(&[[10.0, 20.0, 30.0]], 0.0, &mut out)
        .unwrap();
    let expected = linear([10.0, 20.0, 30.0]);
    for (found, (base, added)) in out[0].iter().zip(expected.iter().zip([3.0, 2.0, 1.0])) {
        assert!((found - base - added).abs() < 1e-12);
    }
}

/// Text of a variable of fixed length, up to its first NUL.
fn words(file: &mut FileReader, name: &str) -> Vec<String> {
    let bytes = file.read_var_u8(name).unwrap();
    let word = |part: &[u8]| {
        String::from_utf8_lossy(part)
            .trim_end_matches('\0')
            .to_owned()
    };
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
        write(
            &plan,
            &run(&plan, &Silent).unwrap(),
            out.path(),
            Existing::Refuse,
        )
        .unwrap();
        out
    };
    for (scan, mode, fixed, ends) in [
        (
            "pattern = { kind = \"ppi\", azimuth_step_rad = 1.0, elevations_rad = [0.1, 0.2] }",
            "azimuth_surveillance",
            0.1f64,
            vec![6, 13],
        ),
        (
            "pattern = { kind = \"ppi\", azimuth_max_rad = 1.0, azimuth_step_rad = 0.5 }",
            "sector",
            0.05,
            vec![2],
        ),
        (
            "pattern = { kind = \"stare\", lines = 4 }",
            "vertical_pointing",
            FRAC_PI_2,
            vec![3],
        ),
        (
            "pattern = { kind = \"dbs\", elevation_rad = 1.0 }",
            "pointing",
            1.0,
            vec![4],
        ),
    ] {
        let out = run_in(scan);
        let (modes, angles, last) = sweeps(out.path(), "map.nc");
        assert!(
            modes.iter().all(|m| m == mode) && modes.len() == ends.len(),
            "{modes:?}"
        );
        assert!(
            (f64::from(angles[0]) - fixed.to_degrees()).abs() < 1e-4 && last == ends,
            "{angles:?} {last:?}"
        );
    }
    let flying = "pattern = { kind = \"stare\", elevation_rad = 0.2, lines = 3 }\nlidar.velocity_m_s = [9.0, 0.0, 1.0]";
    for (scan, name, mobile, dims) in [
        (
            "pattern = { kind = \"vad\" }",
            "azimuth_surveillance",
            "false",
            0,
        ),
        (flying, "pointing", "true", 1),
    ] {
        let out = run_in(scan);
        let file = FileReader::open(out.path().join("map.nc")).unwrap();
        let of = |name: &str| file.data_set().get_global_attr_as_string(name).unwrap();
        assert_eq!(
            (of("scan_name"), of("platform_is_mobile")),
            (name.to_owned(), mobile.to_owned())
        );
        assert_eq!(
            file.data_set()
                .get_var("latitude")
                .unwrap()
                .get_dims()
                .len(),
            dims
        );
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
        (
            "pattern = { kind = \"ppi\", elevations_rad = [0.1, -0.1] }",
            "scan.pattern.elevations_rad = -0.1",
        ),
        (
            "pattern = { kind = \"ppi\", elevations_rad = [] }",
            "a list of 1 to 1000 elevations",
        ),
        (
            "pattern = { kind = \"ppi\", azimuth_max_rad = 7.0 }",
            "scan.pattern.azimuth_max_rad = 7.0",
        ),
        (
            "pattern = { kind = \"vad\", beams = 2 }",
            "scan.pattern.beams = 2",
        ),
        (
            "pattern = { kind = \"vad\" }\nhead.motion = \"continuous\"",
            "rhi, ppi and axial may be continuous",
        ),
        ("head.motion = \"continuous\"", "scan.head.rate_rad_s = inf"),
        (
            "pattern.kind = \"stare\"\nelevation_max_rad = 0.2",
            "scan.elevation_max_rad = 0.2 is not allowed: scan.pattern.kind",
        ),
        (
            "pattern = { kind = \"stare\", elevation_rad = -0.2 }",
            "scan.below_ground.policy",
        ),
        (
            "pattern = { kind = \"list\", file = \"nowhere.csv\" }",
            "nowhere.csv",
        ),
        ("pattern = { kind = \"spiral\" }", "one of \"rhi\", \"ppi\""),
        ("head.sweeps = 100000", "at most 100000 lines"),
    ] {
        let message = refused(calm, scan);
        assert!(message.contains(wanted), "{scan}: {message}");
        assert!(
            message.contains("scene.toml:") || message.contains("nowhere"),
            "{message}"
        );
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("l.csv"),
        "time_s,azimuth_rad,elevation_rad\n1.0,0,0.1\n0.5,0,0.1\n",
    )
    .unwrap();
    let scan = "pattern = { kind = \"list\", file = \"l.csv\" }";
    let message = plan_in(folder.path(), [calm, scan, ""], Target::Map)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("row 2: time_s = 0.5: at least"),
        "{message}"
    );
}
