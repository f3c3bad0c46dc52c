//! From a simulated flow to a map: `wakescope flow` writes planes, a scene reads them, the map shows the flow that was sampled.

use netcdf3::FileReader;
use std::path::Path;
use wakescope_les::winds::{Edges, PlaneMesh, Side};
use wakescope_les::{GridSnapshot, Wind};
use wakescope_sim::flow::{Begin, CaseFile};
use wakescope_sim::measure::map::VelocityEstimates;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::progress::Silent;
use wakescope_sim::scene::SceneFile;
use wakescope_sim::{Error, run};

/// A pair over a sticky ground in the units of b0 and V0, three planes.
const CASE: &str = r#"
[case]
kind = "vortex_pair"
cells = [1, 48, 32]
size = [1.0, 4.0, 2.5]
ground_stretch = 1.0
height = 1.0
core_radius = 0.15
reynolds = 1000.0
perturbation = 0.0
[time]
end_s = 0.04
[output]
every_s = 0.02
planes_x_m = [0.5]
[checkpoint]
write = false
"#;

/// b0 and Gamma0/(2 pi b0) of the pair, where it stands, and how the lidar sees it.
const B0_M: f64 = 47.0;
const V0_M_S: f64 = 1.7;
const SCENE: &str = r#"
seed = 3
[flow]
kind = "simulated"
planes = "wake/plane1"
length_unit_m = 47.0
velocity_unit_m_s = 1.7
lateral_position_m = 400.0
MORE
[detector.snr]
reference = "fixed"
snr_db = 10.0
[scan]
elevation_min_rad = 0.0
elevation_max_rad = 0.15
elevation_step_rad = 0.01
range_min_m = 340.0
range_max_m = 460.0
pulses_per_line = 8
realisations = 1
SCAN
"#;

fn flow(folder: &Path) {
    let case = CaseFile::parse(CASE, Path::new("case.toml")).unwrap();
    wakescope_sim::flow::run(&case, &folder.join("wake"), Begin::New, &Silent).unwrap();
}

fn plan(folder: &Path, more: &str, scan: &str) -> Result<Plan, Error> {
    let text = SCENE.replace("MORE", more).replace("SCAN", scan);
    Plan::new(
        SceneFile::parse(&text, &folder.join("scene.toml"))?,
        Target::Map,
    )
}

fn map(plan: &Plan) -> VelocityEstimates {
    run::run(plan, &Silent).unwrap().map.unwrap()
}

/// The plane of one output, read anew, in the units of the flow, with the walls and periods that the case states.
fn snapshot(folder: &Path, index: usize) -> (f64, GridSnapshot) {
    let mut file = FileReader::open(folder.join(format!("wake/plane1_000{index}.nc"))).unwrap();
    let [y_m, z_m, time] = ["y", "z", "time"].map(|name| file.read_var_f64(name).unwrap());
    let [v, w] = ["v", "w"].map(|name| file.read_var_f32(name).unwrap());
    let ground = Side::NoSlipWall {
        position_m: 0.0,
        velocity_m_s: [0.0; 3],
    };
    let mesh = PlaneMesh {
        y_m,
        z_m,
        y_edges: Edges::Periodic { period_m: 4.0 },
        z_edges: Edges::Bounded {
            low: ground,
            high: Side::SlipWall { position_m: 2.5 },
        },
    };
    let velocity: Vec<[f64; 3]> = v
        .iter()
        .zip(&w)
        .map(|(v, w)| [0.0, f64::from(*v), f64::from(*w)])
        .collect();
    (time[0], GridSnapshot::new(&mesh, &velocity).unwrap())
}

/// Radial velocity of a snapshot at a place of the scan, m/s.
fn radial_m_s(snapshot: &GridSnapshot, range_m: f64, elevation_rad: f64) -> f64 {
    let (sin, cos) = elevation_rad.sin_cos();
    let mut out = [[0.0; 3]];
    let at = [0.0, (range_m * cos - 400.0) / B0_M, range_m * sin / B0_M];
    snapshot.velocity_into(&[at], 0.0, &mut out).unwrap();
    V0_M_S * (out[0][1] * cos + out[0][2] * sin)
}

fn assert_shows(map: &VelocityEstimates, expected: impl Fn(usize, f64, f64) -> f64) {
    let mut fastest = 0.0_f64;
    for (line, &elevation_rad) in map.elevation_rad.iter().enumerate() {
        for (gate, &range_m) in map.range_m.iter().enumerate() {
            let (found, expected) = (
                map.v_exact_m_s[[line, gate]],
                expected(line, range_m, elevation_rad),
            );
            assert!(
                (found - expected).abs() < 1e-9,
                "line {line}, {range_m} m: {found}, {expected}"
            );
            fastest = fastest.max(found.abs());
        }
    }
    assert!(fastest > 5.0, "there is a wake: {fastest}");
}

#[test]
fn the_exact_map_of_a_frozen_flow_is_the_flow_as_sampled_at_the_requested_time() {
    let folder = tempfile::tempdir().unwrap();
    flow(folder.path());
    let (third, first) = (snapshot(folder.path(), 3).1, snapshot(folder.path(), 1).1);
    let late = plan(folder.path(), "motion = \"frozen\"\nage_tau = 0.04", "").unwrap();
    assert_eq!(late.wind.tau, 0.04);
    let late = map(&late);
    assert_shows(&late, |_, range_m, elevation_rad| {
        radial_m_s(&third, range_m, elevation_rad)
    });
    let moved = |range_m, elevation_rad| {
        radial_m_s(&first, range_m, elevation_rad) - radial_m_s(&third, range_m, elevation_rad)
    };
    assert!(
        late.range_m.iter().any(|&r| moved(r, 0.1_f64).abs() > 0.05),
        "the two times differ"
    );
    // At 10 dB the estimates follow the pulse-weighted velocity where the wind is smooth.
    let far = late.std_m_s.dim().1 - 1;
    let error = (&late.v_mean_m_s - &late.v_gate_m_s).mapv(f64::abs);
    assert!(
        error.column(far).mean().unwrap() < 2.0,
        "{}",
        error.column(far)
    );
}

#[test]
fn a_moving_flow_is_interpolated_in_time_line_by_line() {
    let folder = tempfile::tempdir().unwrap();
    flow(folder.path());
    let planes: Vec<_> = (1..=3).map(|i| snapshot(folder.path(), i)).collect();
    let moving = plan(folder.path(), "time_s = 0.3", "").unwrap();
    let after_s = moving.geometry.line_time_s.clone();
    assert_shows(&map(&moving), |line, range_m, elevation_rad| {
        let time = (0.3 + after_s[line]) * V0_M_S / B0_M;
        let at = planes.iter().rposition(|(t, _)| *t <= time).unwrap();
        let (before, after) = (&planes[at], &planes[at + 1]);
        let part = (time - before.0) / (after.0 - before.0);
        let [a, b] = [&before.1, &after.1].map(|s| radial_m_s(s, range_m, elevation_rad));
        a + part * (b - a)
    });
}

#[test]
fn scans_that_outlast_or_leave_the_flow_are_refused_masked_or_filled() {
    let folder = tempfile::tempdir().unwrap();
    flow(folder.path());
    let refused = |more: &str, scan: &str| {
        let plan = plan(folder.path(), more, scan);
        plan.and_then(|plan| run::run(&plan, &Silent).map(|_| ()))
            .unwrap_err()
            .to_string()
    };
    assert!(refused("time_s = 1.0", "").contains("the planes at 1.106 s"));
    assert!(refused("age_tau = 0.05", "").contains("from tau = 0.0 to 0.04"));
    let outside = "elevation_max_rad = 0.4";
    let leaves = SCENE
        .replace("elevation_max_rad = 0.15", outside)
        .replace("SCAN", "");
    let with = |policy: &str| {
        let text = leaves.replace("MORE", "motion = \"frozen\"") + policy;
        let file = SceneFile::parse(&text, &folder.path().join("scene.toml")).unwrap();
        Plan::new(file, Target::Map)
    };
    // The plan refuses it, before any computing.
    let message = with("").unwrap_err().to_string();
    assert!(
        message.contains("leaves the simulated flow")
            && message.contains("scan.outside_flow.policy"),
        "{message}"
    );
    let masked = map(&with("outside_flow = { policy = \"mask\" }\n").unwrap());
    let last = masked.elevation_rad.len() - 1;
    assert!(
        masked.v_exact_m_s.row(last).iter().all(|v| v.is_nan()),
        "the top line sees nothing"
    );
}
