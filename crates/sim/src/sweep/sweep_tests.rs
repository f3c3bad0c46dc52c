//! The parts of a sweep against stored tables, and what cases share.

use super::front::front;
use super::*;
use crate::plan::Stage;
use crate::progress::Observer;
use crate::scene::{Scene, SceneFile, Weighting};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use std::path::Path;
use std::sync::Mutex;
use wakescope_signal::RangeFilter;

/// The rows of a stored table.
fn reference(name: &str) -> crate::io::csv_input::TextTable {
    let path = format!(
        "{}/../../tests/reference/sweep/{name}.csv",
        env!("CARGO_MANIFEST_DIR")
    );
    crate::io::csv_input::TextTable::read(Path::new(&path)).unwrap()
}

fn sweep(scene: &str, request: &Request) -> Result<Sweep, crate::Error> {
    Sweep::parse(scene, Path::new("s.toml"), request)
}

fn vary(words: &[&str]) -> Request {
    Request {
        vary: words.iter().map(|word| (*word).to_owned()).collect(),
        ..Request::default()
    }
}

#[test]
fn cases_are_the_stored_ones_to_the_last_bit() {
    let table = reference("sweep_cases");
    let mut compared = 0;
    for words in table
        .rows
        .iter()
        .map(|row| &row[0])
        .collect::<std::collections::BTreeSet<_>>()
    {
        let request = vary(&words.split(' ').collect::<Vec<_>>());
        let found = sweep("[estimator]\npadded_samples = 1024\n", &request).unwrap();
        for row in table.rows.iter().filter(|row| row[0] == *words) {
            let case = &found.cases[row[1].parse::<usize>().unwrap()];
            let place = found.keys().position(|key| key == row[2]).unwrap();
            let value: f64 = case.values[place].parse().unwrap();
            let expected: f64 = row[3].parse().unwrap();
            assert_eq!(value.to_bits(), expected.to_bits(), "{row:?}");
            compared += 1;
        }
        // The scene has the value, not only the table.
        let last = found.cases.last().unwrap();
        assert!(
            words.starts_with("laser") == (last.scene.content.laser.pulse_repetition_hz == 40e3)
        );
    }
    assert_eq!(compared, table.rows.len());
}

#[test]
fn constant_mean_power_gives_the_stored_energies_pulses_and_ratios() {
    let table = reference("mean_power");
    let request = Request {
        lets: vec![
            "pulse.energy_j = 1.5/laser.pulse_repetition_hz".into(),
            "scan.pulses_per_line = 0.05*laser.pulse_repetition_hz".into(),
        ],
        ..vary(&["laser.pulse_repetition_hz=400,1000,10e3,20e3,40e3"])
    };
    let found = sweep("", &request).unwrap();
    for (i, case) in found.cases.iter().enumerate() {
        let of = |name: &str| table.number(i, table.column(name).unwrap());
        let scene = &case.scene.content;
        assert_eq!(scene.pulse.energy_j.to_bits(), of("energy_j").to_bits());
        assert_eq!(scene.scan.pulses_per_line as f64, of("pulses"));
        let instrument = crate::plan::instrument::Instrument::new(scene).unwrap();
        let efficiency =
            wakescope_optics::theory::free_space_efficiency(&instrument.telescope, 400.0).unwrap();
        let back_per_m = instrument.return_per_m(400.0).unwrap() * efficiency;
        let snr_db = 10.0
            * instrument
                .receiver
                .slowly_varying_snr(scene.pulse.energy_j, back_per_m)
                .log10();
        assert!(
            (snr_db - of("snr_db")).abs() < 1e-3,
            "{snr_db} {}",
            of("snr_db")
        );
        let weak_db = snr_db + 5.0 * (scene.scan.pulses_per_line as f64).log10();
        assert!(
            (weak_db - of("weak_signal_figure_db")).abs() < 1e-3,
            "{weak_db}"
        );
    }
}

#[test]
fn shards_have_the_stored_cases() {
    let table = reference("shards");
    for row in &table.rows {
        let of = |place: usize| row[place].parse::<usize>().unwrap();
        let shard: Shard = format!("{}/{}", of(2), of(1)).parse().unwrap();
        let cases: Vec<String> = (0..of(0))
            .filter(|case| shard.has(*case))
            .map(|case| case.to_string())
            .collect();
        assert_eq!(cases.join(" "), row[3]);
    }
    for wrong in ["0/3", "4/3", "1", "1/0", "a/b", "-1/2"] {
        assert!(
            wrong.parse::<Shard>().unwrap_err().contains("e.g. 2/8"),
            "{wrong}"
        );
    }
}

#[test]
fn resolution_is_the_stored_one() {
    for row in &reference("resolution").rows {
        let number = |place: usize| row[place].parse::<f64>().unwrap();
        let mut scene = Scene::default();
        scene.pulse.shape = crate::scene::PulseShape::gaussian(number(0));
        scene.estimator.weighting = match row[3].as_str() {
            "rectangular" => Weighting::Rectangular,
            "hann" => Weighting::Hann,
            _ => Weighting::Gaussian,
        };
        let pulse = scene.pulse.simulated().unwrap();
        let window = scene.weighting().weights(number(1) as usize).unwrap();
        let filter = RangeFilter::gate(&pulse, &window, number(2), 0.3).unwrap();
        // The stored width is interpolated on a grid.
        for (found, expected, within) in [
            (filter.full_width_half_maximum_m(), number(5), 1e-5),
            (filter.standard_deviation_m(), number(6), 1e-13),
        ] {
            assert!((found / expected - 1.0).abs() < within, "{row:?}: {found}");
        }
    }
}

#[test]
fn fronts_are_the_stored_ones() {
    let table = reference("front");
    let sets: std::collections::BTreeSet<&String> = table.rows.iter().map(|row| &row[0]).collect();
    for set in sets {
        let rows: Vec<&Vec<String>> = table.rows.iter().filter(|row| row[0] == *set).collect();
        let senses: Vec<&str> = rows[0][3].split(' ').collect();
        let cost = |(i, sense): (usize, &&str)| {
            let sign = if *sense == "max" { -1.0 } else { 1.0 };
            let value = |row: &&Vec<String>| sign * row[4 + i].parse::<f64>().unwrap();
            rows.iter().map(value).collect()
        };
        let costs: Vec<Vec<f64>> = senses.iter().enumerate().map(cost).collect();
        for (row, is_on) in rows.iter().zip(front(&costs)) {
            assert_eq!(is_on, row[7] == "true", "{row:?}");
        }
    }
}

#[test]
fn the_front_of_1000_random_points_is_that_of_every_pair() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    // Few values, so that there are ties and duplicates; some are missing.
    let mut number = || match random.next_u64() % 41 {
        40 => f64::NAN,
        n => n as f64,
    };
    let points: Vec<[f64; 3]> = (0..1000).map(|_| [number(), number(), number()]).collect();
    let on_front = front(&[0, 1, 2].map(|k| points.iter().map(|p| p[k]).collect()));
    let mut on = 0;
    for (i, mine) in points.iter().enumerate() {
        let is_dominated = points.iter().enumerate().any(|(j, theirs)| {
            i != j && (0..3).all(|k| theirs[k] <= mine[k]) && (0..3).any(|k| theirs[k] < mine[k])
        });
        let expected = !is_dominated && mine.iter().all(|v| v.is_finite());
        assert_eq!(on_front[i], expected, "{mine:?}");
        on += usize::from(expected);
    }
    assert!((5..200).contains(&on), "{on}");
}

/// Counts what is computed.
#[derive(Default)]
struct Counter(Mutex<Vec<Stage>>);

impl Counter {
    fn count(&self, stage: Stage) -> usize {
        self.0
            .lock()
            .unwrap()
            .iter()
            .filter(|s| **s == stage)
            .count()
    }
}

impl Observer for Counter {
    fn begin(&self, stage: Stage, _: u64) {
        self.0.lock().unwrap().push(stage);
    }
}

/// A scene that runs in a moment.
const SMALL: &str = "[scan]\nelevation_min_rad = 0.1\nelevation_max_rad = 0.11\nelevation_step_rad = 2.5e-3\n\
                     range_min_m = 350.0\nrange_max_m = 420.0\npulses_per_line = 2\nrealisations = 3\n";

fn ran(scene: &str, request: &Request) -> (Counter, Summary, crate::io::csv_input::TextTable) {
    let temp = tempfile::tempdir().unwrap();
    let counter = Counter::default();
    let found = sweep(scene, request).unwrap();
    let summary = run(
        &found,
        temp.path(),
        Settings {
            no_circulation: true,
            ..Settings::default()
        },
        &counter,
    )
    .unwrap();
    (
        counter,
        summary,
        crate::io::csv_input::TextTable::read(&temp.path().join("results.csv")).unwrap(),
    )
}

#[test]
fn what_cases_have_in_common_is_computed_once() {
    // Two estimators see the signals of each energy; all share the screens and the flow.
    let turbulent = "[atmosphere.turbulence]\nkind = \"refractive\"\ncn2_m_m23 = 1e-15\ngrid_points = 80\n\
                     grid_spacing_m = 0.003\nrealisations = 5\nlayers = 4\n[telescope]\nfocus_m = 400.0\n";
    let request = vary(&[
        "pulse.energy_j=50e-6,150e-6,600e-6",
        "estimator.radius_m=1,2",
    ]);
    let (counter, summary, table) = ran(&(SMALL.to_owned() + turbulent), &request);
    assert_eq!(
        (summary.flows, summary.efficiencies, summary.signals),
        (1, 1, 3)
    );
    // Counted where it is done.
    let counts = [Stage::PhaseScreens, Stage::LinesOfSight, Stage::Estimates]
        .map(|stage| counter.count(stage));
    assert_eq!(counts, [1, 3, 3]);
    // Each case is what it is by itself.
    for (row, (energy, radius)) in [
        ("5e-5", "1"),
        ("5e-5", "2"),
        ("1.5e-4", "1"),
        ("1.5e-4", "2"),
        ("6e-4", "1"),
        ("6e-4", "2"),
    ]
    .iter()
    .enumerate()
    {
        if row % 3 == 1 {
            let alone = vary(&[
                &format!("pulse.energy_j={energy}"),
                &format!("estimator.radius_m={radius}"),
            ]);
            let (_, _, one) = ran(&(SMALL.to_owned() + turbulent), &alone);
            assert_eq!(one.rows[0][1..], table.rows[row][1..]);
        }
    }
}

#[test]
fn seeds_share_an_efficiency_where_no_screens_are_drawn() {
    let turbulent = "[atmosphere.turbulence]\nkind = \"refractive\"\ncn2_m_m23 = 1e-15\ngrid_points = 80\n\
                     grid_spacing_m = 0.003\nrealisations = 5\nlayers = 4\n[telescope]\nfocus_m = 400.0\n";
    let of_seeds = |scene: &str| ran(scene, &vary(&["seed=1,2"])).1.efficiencies;
    assert_eq!(of_seeds(SMALL), 1);
    assert_eq!(of_seeds(&(SMALL.to_owned() + turbulent)), 2);
}

#[test]
fn keys_of_added_flows_vary_and_turbulence_follows_the_seed() {
    let eddies = format!("{SMALL}[[added_flows]]\nkind = \"eddies\"\n");
    let found = sweep(&eddies, &vary(&["added_flows.0.dissipation_m2_s3=0,1e-3"])).unwrap();
    let dissipations = found.cases.iter().map(|case| {
        let flow = &case.scene.content.added_flows[0];
        let crate::scene::Flow::Eddies(eddies) = flow else {
            panic!("{flow:?}")
        };
        eddies.dissipation_m2_s3
    });
    assert_eq!(dissipations.collect::<Vec<_>>(), [0.0, 1e-3]);
    assert!(sweep(&eddies, &vary(&["added_flows.1.dissipation_m2_s3=0,1e-3"])).is_err());
    let common = super::run::Common::default();
    let fastest_m_s = [1, 2].map(|seed| {
        let text = format!("seed = {seed}\n{eddies}");
        let file = SceneFile::parse(&text, Path::new("s.toml")).unwrap();
        let plan = common.plan(&file, crate::plan::Target::Map).unwrap();
        plan.fastest_m_s
    });
    assert!(fastest_m_s[0] != fastest_m_s[1]);
}

#[test]
fn maps_of_scenes_together_are_those_of_each_alone() {
    let scene = |text: &str| SceneFile::parse(text, Path::new("s.toml")).unwrap();
    let other = format!("seed = 2\n{SMALL}[estimator]\nradius_m = 1.0\n");
    let windy = format!(
        "added_flows = [{{ kind = \"uniform\", lateral_m_s = 3.0, vertical_m_s = 0.0 }}]\n{SMALL}"
    );
    let narrow = format!("{SMALL}[estimator]\nradius_m = 1.0\n");
    // Other gates, and other gates where pulses have airs of their own.
    let few = format!("{SMALL}[estimator]\nwindow_samples = 32\ngate_step_samples = 9\n");
    let moving = SMALL.replace("[scan]", "[scan]\nwind_of_pulses = { kind = \"pulse\" }");
    let moving_few = format!("{moving}[estimator]\nwindow_samples = 32\n");
    let scenes = [SMALL, &other, &narrow, &windy, &few, &moving, &moving_few].map(scene);
    let together = maps(&scenes, &crate::Silent).unwrap();
    for (scene, (plan, map)) in scenes.iter().zip(&together) {
        assert_eq!(plan.scene(), &scene.content);
        let alone = crate::plan::Plan::new(scene.clone(), crate::plan::Target::Map).unwrap();
        let alone = crate::run(&alone, &crate::Silent).unwrap().map.unwrap();
        let bits = |of: &crate::measure::map::VelocityEstimates| {
            let spread_m_s = of.v_spread_m_s.clone().unwrap_or_default();
            [&of.v_scan_m_s, &of.rms_m_s, &of.snr_db, &spread_m_s]
                .map(|values| values.mapv(f64::to_bits))
        };
        assert_eq!(bits(&alone), bits(map));
    }
}

#[test]
fn results_are_those_of_the_map_of_the_case() {
    let (_, _, table) = ran(SMALL, &vary(&["pulse.energy_j=150e-6"]));
    let plan = crate::plan::Plan::new(
        SceneFile::parse(SMALL, Path::new("s.toml")).unwrap(),
        crate::plan::Target::Map,
    )
    .unwrap();
    let result = crate::run::run(&plan, &crate::Silent).unwrap();
    let of = |name: &str| table.number(0, table.column(name).unwrap());
    assert_eq!(of("snr_db"), result.middle.as_ref().unwrap().snr_db);
    // What both call a standard deviation, a root mean square error, is one number.
    for (line, column) in [("std_mean_m_s", "std_m_s"), ("rms_mean_m_s", "rms_m_s")] {
        let (_, _, told) = result
            .summary()
            .into_iter()
            .find(|(key, ..)| *key == line)
            .unwrap();
        assert!(
            (told - of(column)).abs() < 1e-12,
            "{line} {told}, {column} {}",
            of(column)
        );
    }
    let map = result.map.unwrap();
    let mean = |field: &ndarray::Array2<f64>| field.sum() / field.len() as f64;
    for (found, expected) in [
        (of("rms_m_s"), mean(&map.rms_m_s.mapv(|v| v * v)).sqrt()),
        (of("bias_m_s"), mean(&map.bias_m_s)),
        (of("std_m_s"), mean(&map.std_m_s.mapv(|v| v * v)).sqrt()),
        (of("flagged_fraction"), mean(&map.flagged)),
    ] {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
    // Each result has a value or a reason: nothing is inside of the vortices here but the nearest cells.
    assert!(
        of("bound_m_s") > 0.0 && of("rms_standard_error_m_s") > 0.0 && of("bad_fraction") >= 0.0
    );
    assert!((of("resolution_m") - 33.879).abs() < 1e-3);
}

#[test]
fn standard_errors_are_rough_with_few_outliers_or_few_estimates() {
    let energies = "pulse.energy_j=2e-6,4e-4,8e-4,1e-3,1.5e-3,2e-3";
    let (_, _, table) = ran(SMALL, &vary(&[energies]));
    // Lines, gates and realisations of the scene.
    let estimates = 165.0;
    let mut rough_cases = 0;
    for row in 0..table.rows.len() {
        let number = |name: &str| table.number(row, table.column(name).unwrap());
        let flagged = (number("flagged_fraction") * estimates).round();
        let is_rough = flagged > 0.0 && flagged < 20.0;
        rough_cases += usize::from(is_rough);
        let column = number("standard_errors_rough");
        assert_eq!(column, f64::from(u8::from(is_rough)), "{flagged} flagged");
    }
    assert!((1..6).contains(&rough_cases), "{rough_cases} of 6");
}

#[test]
fn seeds_are_shared_unless_each_case_is_to_have_its_own() {
    let same = sweep("seed = 7\n", &vary(&["pulse.energy_j=50e-6,150e-6"])).unwrap();
    assert!(same.cases.iter().all(|case| case.scene.content.seed == 7));
    let own = Request {
        independent: true,
        ..vary(&["pulse.energy_j=50e-6,150e-6"])
    };
    let own = sweep("seed = 7\n", &own).unwrap();
    let seeds: Vec<u64> = own
        .cases
        .iter()
        .map(|case| case.scene.content.seed)
        .collect();
    assert!(seeds[0] != seeds[1] && !seeds.contains(&7), "{seeds:?}");
    assert_eq!(own.keys().collect::<Vec<_>>(), ["pulse.energy_j", "seed"]);
    assert_eq!(own.cases[0].values[1], seeds[0].to_string());
}

#[test]
fn words_that_cannot_be_followed_say_what_is_allowed() {
    for (request, wanted) in [
        (
            vary(&["pulse.enrgy_j=1"]),
            "--vary: pulse.enrgy_j = 1 is not allowed: there is no such key; did you mean",
        ),
        (vary(&["pulse.energy_j="]), "at least one value is needed"),
        (vary(&["pulse.energy_j"]), "KEY=VALUES, e.g."),
        (vary(&["pulse.energy_j=1e-6,,2e-6"]), "a number, e.g."),
        (vary(&["pulse.energy_j=log:0:1:3"]), "log: above 0"),
        (
            vary(&["pulse.energy_j=lin:1e-6:1e-3:1"]),
            "a count from 2 to 10000",
        ),
        (
            vary(&["pulse.energy_j=lin:1e-6:1e-3:1000000000"]),
            "a count from 2 to 10000",
        ),
        (
            vary(&[
                "pulse.energy_j=lin:1e-6:1e-3:1000",
                "seed=lin:1:1e6:1000",
                "estimator.radius_m=lin:1:2:1000",
            ]),
            "number of cases = 1000000000.0 is not allowed: a sweep has 1 to 10000 cases",
        ),
        (vary(&["outputs.csv=true,false"]), "changes no result"),
        (
            vary(&["pulse.energy_j=1e-6", "pulse.energy_j=2e-6"]),
            "each key varies once",
        ),
        (vary(&["scan.pulses_per_line=lin:1:2:3"]), "a whole number"),
        (
            Request {
                lets: vec!["pulse.energy_j = 1e-6/flow.cross_wind_m_s".into()],
                ..vary(&["seed=1,2"])
            },
            "divides by zero",
        ),
        (
            Request {
                lets: vec!["pulse.energy_j = 1/colour".into()],
                ..vary(&["seed=1,2"])
            },
            "colour",
        ),
        (
            Request {
                conditions: vec!["seed > 2".into()],
                ..vary(&["seed=1,2"])
            },
            "none of the 2 cases is left",
        ),
        (
            Request {
                independent: true,
                ..vary(&["seed=1,2"])
            },
            "leave one of the two out",
        ),
        (
            vary(&["pulse.energy_j=150e-6,-1,-2"]),
            "case 1 of the sweep (pulse.energy_j = -1.0): ",
        ),
    ] {
        let message = sweep("", &request).unwrap_err().to_string();
        assert!(message.contains(wanted), "{message}");
    }
    // The scene itself is blamed with its line.
    let message = sweep("seed = 1\ncolour = 2\n", &vary(&["seed=1,2"]))
        .unwrap_err()
        .to_string();
    assert!(message.contains("s.toml:2: colour"), "{message}");
}

#[test]
fn conditions_and_lists_choose_the_cases() {
    let request = Request {
        conditions: vec!["pulse.energy_j*laser.pulse_repetition_hz <= 0.05".into()],
        ..vary(&[
            "pulse.energy_j=50e-6,150e-6",
            "laser.pulse_repetition_hz=100,400,1000",
        ])
    };
    let values: Vec<Vec<String>> = sweep("", &request)
        .unwrap()
        .cases
        .into_iter()
        .map(|case| case.values)
        .collect();
    assert_eq!(
        values,
        [
            ["5e-5", "100.0"],
            ["5e-5", "400.0"],
            ["5e-5", "1000.0"],
            ["0.00015", "100.0"]
        ]
    );
    let temp = tempfile::tempdir().unwrap();
    let list = temp.path().join("cases.csv");
    std::fs::write(
        &list,
        "# mine\nestimator.method.kind,estimator.radius_m\npulse_pair,1\nfirst_moment,2\n",
    )
    .unwrap();
    let request = Request {
        list: Some(list.clone()),
        ..vary(&["scan.pulses_per_line=1,2"])
    };
    let values: Vec<Vec<String>> = sweep("", &request)
        .unwrap()
        .cases
        .into_iter()
        .map(|case| case.values)
        .collect();
    assert_eq!(values[1], ["pulse_pair", "1.0", "2"]);
    assert_eq!(values[2], ["first_moment", "2.0", "1"]);
    std::fs::write(&list, "estimator.method.kind\npulse_par\n").unwrap();
    let message = sweep("", &request).unwrap_err().to_string();
    assert!(
        message.contains("cases.csv: estimator.method.kind = pulse_par")
            && message.contains("pulse_pair"),
        "{message}"
    );
}
