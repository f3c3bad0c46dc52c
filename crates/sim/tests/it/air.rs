//! Mean wind and turbulence of scenes, through plans and whole runs.

use std::path::Path;
use wakescope_les::Wind;
use wakescope_sim::measure::map::VelocityEstimates;
use wakescope_sim::plan::wind::SceneWind;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::progress::Silent;
use wakescope_sim::run::run;
use wakescope_sim::scene::SceneFile;

/// Few lines at 10 dB.
const SCAN: &str = r#"
[detector]
snr = { reference = "fixed", snr_db = 10.0 }
[scan]
elevation_min_rad = 0.05
elevation_max_rad = 0.075
elevation_step_rad = 5e-3
range_min_m = 300.0
range_max_m = 450.0
pulses_per_line = 8
"#;

const EDDIES: &str = "[[added_flows]]\nkind = \"eddies\"\ndissipation_m2_s3 = 1.45e-2\n";

fn file(text: &str) -> SceneFile {
    SceneFile::parse(text, Path::new("s.toml")).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn refusal(text: &str) -> String {
    SceneFile::parse(text, Path::new("s.toml"))
        .unwrap_err()
        .to_string()
}

fn map(text: &str) -> VelocityEstimates {
    let plan = Plan::new(file(text), Target::Map).unwrap();
    run(&plan, &Silent).unwrap().map.unwrap()
}

/// The bits of the numbers of a map.
fn bits(map: &VelocityEstimates) -> Vec<ndarray::Array2<u64>> {
    let fields = [
        &map.v_exact_m_s,
        &map.v_pulse_m_s,
        &map.v_gate_m_s,
        &map.v_scan_m_s,
        &map.v_mean_m_s,
        &map.rms_m_s,
        &map.snr_db,
    ];
    fields.map(|field| field.mapv(f64::to_bits)).to_vec()
}

fn scene_wind(text: &str) -> SceneWind {
    SceneWind::new(&file(text)).unwrap()
}

fn at(wind: &dyn Wind, point_m: [f64; 3], time_s: f64) -> [f64; 3] {
    let mut out = [[0.0; 3]];
    wind.velocity_into(&[point_m], time_s, &mut out).unwrap();
    out[0]
}

#[test]
fn a_dissipation_of_zero_gives_the_map_of_the_scene_without_eddies() {
    let none = EDDIES.replace("1.45e-2", "0.0");
    let each = format!("{none}realisations = \"each\"\n");
    let still = bits(&map(SCAN));
    assert_eq!(bits(&map(&format!("{SCAN}{none}"))), still);
    assert_eq!(bits(&map(&format!("{SCAN}{each}"))), still);
    assert_ne!(bits(&map(&format!("{SCAN}{EDDIES}"))), still);
}

#[test]
fn a_map_in_eddies_does_not_depend_on_the_number_of_threads() {
    let text = format!("{SCAN}{EDDIES}realisations = \"each\"\nground = \"blocked\"\n");
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| bits(&map(&text)))
    };
    assert_eq!(with_threads(1), with_threads(2));
}

#[test]
fn errors_of_each_realisation_are_against_its_own_air() {
    let flow = "[flow]\nkind = \"calm\"\n";
    let one = map(&format!("{flow}{SCAN}{EDDIES}"));
    let each = map(&format!("{flow}{SCAN}{EDDIES}realisations = \"each\"\n"));
    // The first realisation is the same, the others have air of their own.
    assert_eq!(one.v_pulse_m_s, each.v_pulse_m_s);
    assert_eq!(one.v_scan_m_s, each.v_scan_m_s);
    let [pulse_m_s, gate_m_s] = each.scans[1].own_truth_m_s.as_ref().unwrap();
    let apart = (pulse_m_s - &each.v_pulse_m_s)
        .mapv(|v| v * v)
        .mean()
        .unwrap();
    assert!(apart.sqrt() > 0.5, "{apart}");
    let filtered = (pulse_m_s - gate_m_s).mapv(|v| v * v).mean().unwrap();
    assert!(filtered < 0.1 * apart);
    assert!(one.scans.iter().all(|scan| scan.own_truth_m_s.is_none()));
    // Turbulence is no error.
    let rms = |map: &VelocityEstimates| map.rms_m_s.mean().unwrap();
    let ratio = rms(&each) / rms(&one);
    assert!((0.7..1.4).contains(&ratio), "{ratio}");
}

#[test]
fn the_mean_wind_of_components_blows_from_the_front_and_from_the_lidar() {
    let wind = scene_wind(
        "[flow]\nkind = \"wind\"\nprofile = \"power\"\nhead_wind_m_s = 4.0\ncross_wind_m_s = 3.0\n",
    );
    let found = at(wind.wind(), [0.0, 100.0, 10.0], 0.0);
    let expected = [-4.0, 3.0, 0.0];
    for d in 0..3 {
        assert!((found[d] - expected[d]).abs() < 1e-12, "{found:?}");
    }
    let speed = scene_wind("[flow]\nkind = \"wind\"\nspeed_m_s = 7.0\nreference_height_m = 20.0\n");
    let found = at(speed.wind(), [0.0, 100.0, 20.0], 0.0);
    assert!(found[0].abs() < 1e-12 && (found[1] - 7.0).abs() < 1e-12);
}

#[test]
fn eddies_are_carried_by_the_wind_at_their_height() {
    let mean = "[flow]\nkind = \"wind\"\nprofile = \"power\"\nexponent = 0.0\ntoward_rad = 0.0\nspeed_m_s = 6.0\n";
    let text = format!("{mean}{EDDIES}carried_at_m = 30.0\n");
    let wind = scene_wind(&text);
    let still = at(wind.wind(), [20.0, 300.0, 40.0], 0.0);
    let later = at(wind.wind(), [20.0 + 60.0, 300.0, 40.0], 10.0);
    for d in 0..3 {
        assert!((still[d] - later[d]).abs() < 1e-9, "{still:?} {later:?}");
    }
    assert_eq!(
        at(wind.without_eddies(), [20.0, 300.0, 40.0], 0.0),
        [6.0, 0.0, 0.0]
    );
}

/// Correlation of the velocity at a point with that at a later time, over seeds.
fn correlation(seeds: u64, dissipation_m2_s3: f64, outer_scale_m: f64, time_s: f64) -> f64 {
    let mut product = 0.0;
    let mut square = 0.0;
    for seed in 0..seeds {
        let wind = scene_wind(&format!(
            "seed = {seed}\n[flow]\nkind = \"eddies\"\ndissipation_m2_s3 = {dissipation_m2_s3}\n\
             outer_scale_m = {outer_scale_m:?}\nsmallest_m = 4.0\ndecorrelation = \"sweeping\"\n"
        ));
        let points_m: Vec<[f64; 3]> = (0..48)
            .map(|i| {
                [
                    311.0 * f64::from(i),
                    -273.0 * f64::from(i),
                    197.0 * f64::from(i),
                ]
            })
            .collect();
        let mut first = vec![[0.0; 3]; 48];
        let mut second = first.clone();
        wind.wind()
            .velocity_into(&points_m, 0.0, &mut first)
            .unwrap();
        wind.wind()
            .velocity_into(&points_m, time_s, &mut second)
            .unwrap();
        for (first, second) in first.as_flattened().iter().zip(second.as_flattened()) {
            product += first * second;
            square += 0.5 * (first * first + second * second);
        }
    }
    product / square
}

fn check_correlations(seeds: u64, tolerance: f64) {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/reference/air/time_correlation.csv"
    );
    let text = std::fs::read_to_string(path).unwrap();
    let mut rows = 0;
    for line in text.lines().filter(|line| !line.starts_with('#')).skip(1) {
        let row: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
        if row[2] < 3.0 {
            continue;
        }
        rows += 1;
        let found = correlation(seeds, row[0], row[1], row[2]);
        assert!((found - row[3]).abs() < tolerance, "{row:?}: {found}");
    }
    assert_eq!(rows, 12);
}

#[test]
fn sweeping_eddies_decorrelate_as_in_the_table() {
    check_correlations(24, 0.06);
}

#[test]
#[ignore = "400 seeds"]
fn sweeping_eddies_decorrelate_as_in_the_table_over_400_seeds() {
    check_correlations(400, 0.03);
}

#[test]
fn wrong_air_is_refused_with_a_value_that_passes() {
    let wind = |words: &str| format!("[flow]\nkind = \"wind\"\n{words}\n");
    let eddies = |words: &str| format!("[flow]\nkind = \"eddies\"\n{words}\n");
    let pair_in_wind = "[flow]\ncross_wind_m_s = 2.0\n[[added_flows]]\nkind = \"wind\"\n";
    let two = "[flow]\nkind = \"eddies\"\n[[added_flows]]\nkind = \"eddies\"\n";
    let table = "profile = \"table\"\nheight_m = [5.0, 5.0]\nspeeds_m_s = [1.0, 2.0]\ntowards_rad = [0.0, 0.0]";
    let short =
        "profile = \"table\"\nheight_m = [5.0, 9.0]\nspeeds_m_s = [1.0]\ntowards_rad = [0.0, 0.0]";
    for (text, wanted) in [
        (
            eddies("dissipation_m2_s3 = -1e-4"),
            "flow.dissipation_m2_s3 = -1e-4 is not allowed: a number from 0.0 to 10.0",
        ),
        (
            eddies("dissipation_m2_s3 = nan"),
            "flow.dissipation_m2_s3 = nan is not allowed",
        ),
        (
            eddies("outer_scale_m = 0.0"),
            "flow.outer_scale_m = 0.0 is not allowed: a number from 1.0",
        ),
        (
            eddies("smallest_m = -1.0"),
            "flow.smallest_m = -1.0 is not allowed: a number from 0.05",
        ),
        (
            eddies("smallest_m = 21.0"),
            "flow.smallest_m = 21.0 is not allowed: at most a fifth of flow.outer_scale_m, 20 m: 20 passes",
        ),
        (
            eddies("modes = 200"),
            "flow.modes = 200 is not allowed: at least 24 for each octave",
        ),
        (eddies("modes = 200"), "279 passes"),
        (
            eddies("carried_at_m = 30.0"),
            "flow.carried_at_m = 30.0 is not allowed: absent without a flow of kind \"wind\"",
        ),
        (
            two.into(),
            "added_flows[0].kind = \"eddies\" is not allowed",
        ),
        (
            pair_in_wind.into(),
            "flow.cross_wind_m_s = 2.0 is not allowed: 0 beside a flow of kind \"wind\"",
        ),
        (
            wind("exponent = 0.2"),
            "flow.exponent = 0.2 is not allowed: absent: this key is for flow.profile = \"power\"",
        ),
        (
            wind("toward_rad = 1.0\nhead_wind_m_s = 2.0"),
            "flow.toward_rad = 1.0 is not allowed: absent beside",
        ),
        (
            wind("friction_velocity_m_s = 0.3\nspeed_m_s = 2.0"),
            "flow.friction_velocity_m_s = 0.3 is not allowed: absent beside a speed",
        ),
        (
            wind("reference_height_m = 0.02"),
            "flow.reference_height_m = 0.02 is not allowed: above flow.displacement_m + flow.roughness_m, 0.03 m, such as 10.03",
        ),
        (
            wind(table),
            "flow.height_m[1] = 5.0 is not allowed: above the height before it, 5 m",
        ),
        (
            wind(short),
            "flow.speeds_m_s = 1 values is not allowed: one value for each of flow.height_m, 2",
        ),
        (
            wind("height_m = [5.0]"),
            "flow.height_m = 1 values is not allowed: absent",
        ),
        (
            wind("profile = \"table\""),
            "flow.height_m is missing: one value for each",
        ),
    ] {
        let found = refusal(&text);
        assert!(found.contains(wanted), "{found}\n{wanted}");
    }
    file(&eddies("modes = 279"));
    file(&eddies("smallest_m = 20.0"));
}

fn warnings(text: &str) -> Vec<String> {
    Plan::new(file(text), Target::Map).unwrap().warnings
}

#[test]
fn long_frozen_eddies_and_low_tables_are_warned_of() {
    let slow = "[laser]\npulse_repetition_hz = 0.1\n";
    let found = warnings(&format!("{slow}{SCAN}{EDDIES}"));
    assert!(
        found.iter().any(|text| text.contains("frozen")),
        "{found:?}"
    );
    let sweeping = warnings(&format!(
        "{slow}{SCAN}{EDDIES}decorrelation = \"sweeping\"\n"
    ));
    assert!(sweeping.iter().all(|text| !text.contains("frozen")));
    let table = |last_m: f64| {
        format!(
            "[flow]\nkind = \"wind\"\nprofile = \"table\"\nheight_m = [1.0, {last_m:?}]\nspeeds_m_s = [2.0, 3.0]\n\
             towards_rad = [1.0, 1.0]\n{SCAN}"
        )
    };
    let found = warnings(&table(10.0));
    assert!(
        found.iter().any(|text| text.contains("ends at 10 m")),
        "{found:?}"
    );
    assert!(
        warnings(&table(60.0))
            .iter()
            .all(|text| !text.contains("ends at"))
    );
}

#[test]
fn the_true_wind_of_a_vad_is_the_mean_wind() {
    let text = "[flow]\nkind = \"wind\"\nprofile = \"power\"\nexponent = 0.0\ntoward_rad = 0.0\nspeed_m_s = 6.0\n\
                [[added_flows]]\nkind = \"eddies\"\n[scan]\npattern = { kind = \"vad\", beams = 6 }\npulses_per_line = 2\n\
                realisations = 2\nrange_max_m = 330.0\n";
    let plan = Plan::new(file(text), Target::Map).unwrap();
    let map = run(&plan, &Silent).unwrap().map.unwrap();
    let map = wakescope_sim::write::velocity_map(&plan, &map);
    let options = wakescope_sim::wind::WindOptions::of_scene(plan.scene()).unwrap();
    let winds = wakescope_sim::wind::winds_of_map(&plan, &map, &options).unwrap();
    assert!(!winds.true_m_s.is_empty());
    // The flight is to the north, and so is the wind.
    for wind in winds.true_m_s {
        let apart = [wind[0], wind[1] - 6.0, wind[2]];
        assert!(apart.iter().all(|part| part.abs() < 1e-12), "{wind:?}");
    }
}

/// The scene of the page, with fewer lines.
#[test]
fn the_airport_of_the_page_runs() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/air.md");
    let page = std::fs::read_to_string(path).unwrap();
    let scene = page.split("```toml\n").nth(1).unwrap();
    let scene = scene.split("```").next().unwrap();
    let text =
        format!("{scene}elevation_max_rad = 0.03\nrange_max_m = 420.0\npulses_per_line = 4\n");
    let found = map(&text);
    let spread = found.v_pulse_m_s.std(0.0);
    assert!(
        spread > 0.5 && found.scans[1].own_truth_m_s.is_some(),
        "{spread}"
    );
    assert!(found.rms_m_s.iter().all(|rms_m_s| rms_m_s.is_finite()));
}
