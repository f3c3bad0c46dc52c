//! Runs that meet, that were killed early, that end elsewhere, that gain energy.

use super::*;
use crate::flow::WakePreset;
use crate::flow::files::CASE;
use crate::flow::plane_vortices_for_tests;
use crate::progress::Silent;
use std::fs;
use tempfile::TempDir;

/// Keeps what it is told.
#[derive(Default)]
struct Notes(std::sync::Mutex<Vec<String>>);

impl Observer for Notes {
    fn warn(&self, text: &str) {
        self.0.lock().unwrap().push(text.to_owned());
    }
}

fn parse(text: &str) -> CaseFile {
    CaseFile::parse(text, Path::new("case.toml")).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Vortices that turn for ever where nothing damps them.
fn vortices(field: &TempDir, viscosity_m2_s: f64, time: &str) -> CaseFile {
    let sections = format!("[time]\nlongest_step_s = 1.0\n{time}[checkpoint]\nevery_steps = 10\n");
    plane_vortices_for_tests::case(field, 16, viscosity_m2_s, &sections)
}

fn check(file: &CaseFile, folder: Option<&Path>, begin: Begin) -> Result<FlowForecast, Error> {
    let alone = Arc::new(Single) as Arc<dyn Ranks>;
    check_on(&alone, file, folder, begin, false)
}

#[test]
fn a_second_run_in_a_folder_is_refused_and_what_a_crashed_one_left_is_swept() {
    let folder = tempfile::tempdir().unwrap();
    let stage = folder.path().join(".wakescope-stage-1-0");
    fs::create_dir_all(stage.join("new")).unwrap();
    fs::create_dir_all(stage.join("old")).unwrap();
    fs::write(stage.join("lock"), "").unwrap();
    let field = plane_vortices_for_tests::folder();
    let case = vortices(&field, 0.01, "end_s = 0.05\n");
    let lock = FolderLock::take(folder.path()).unwrap();
    let error = run(&case, folder.path(), Begin::New, &Silent)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains(folder.path().to_str().unwrap()) && error.contains("another run"),
        "{error}"
    );
    drop(lock);
    assert!(
        run(&case, folder.path(), Begin::New, &Silent)
            .unwrap()
            .is_complete
    );
    assert!(!stage.exists() && fs::read_dir(folder.path()).unwrap().count() >= 3);
}

#[test]
fn a_run_killed_before_its_first_checkpoint_begins_anew_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    // What such a run leaves: the head of its table and half a row.
    let half = format!("# source: {}\nstep,time_s\n1,0.0", crate::PROGRAM);
    fs::write(folder.path().join("steps.csv"), half).unwrap();
    let field = plane_vortices_for_tests::folder();
    let case = vortices(&field, 0.01, "end_s = 0.05\n");
    let notes = Notes::default();
    let outcome = run(&case, folder.path(), Begin::Restart, &notes).unwrap();
    assert!(
        outcome.is_complete && notes.0.lock().unwrap()[0].contains("begins anew"),
        "{:?}",
        notes.0
    );
    let fresh = tempfile::tempdir().unwrap();
    run(&case, fresh.path(), Begin::New, &Silent).unwrap();
    let steps = |folder: &Path| fs::read(folder.join("steps.csv")).unwrap();
    assert!(steps(folder.path()) == steps(fresh.path()));
}

#[test]
fn the_ages_of_outputs_follow_the_end_of_a_wake() {
    let wake = |keys: &str| {
        parse(&format!("[case]\nkind = \"wake\"\n[wake]\n{keys}"))
            .content
            .wake
            .unwrap()
    };
    let lists = |keys: &str| {
        let wake = wake(keys);
        (wake.fields_tau.unwrap(), wake.planes_tau.unwrap())
    };
    assert_eq!(
        lists(""),
        (vec![0.5, 1.0, 2.0, 3.0, 4.0, 5.0], vec![2.5, 5.0])
    );
    assert_eq!(lists("end_tau = 0.5\n"), (vec![0.5], vec![0.25, 0.5]));
    assert_eq!(
        lists("end_tau = 1.7\n"),
        (vec![0.5, 1.0, 1.7], vec![0.85, 1.7])
    );
    assert_eq!(
        lists("end_tau = 1.7\nfields_tau = []\n"),
        (vec![], vec![0.85, 1.7])
    );
    let own = "[case]\nkind = \"wake\"\n[wake]\nend_tau = 0.5\n";
    let over = CaseFile::parse_over(Some(WakePreset::Medium), own, Path::new("case.toml")).unwrap();
    assert_eq!(over.content.wake.unwrap().fields_tau, Some(vec![0.5]));
    // An end from the command line: lists of the case lose what lies behind it.
    let ended = |keys: &str, end: f64| {
        let file = parse(&format!("[case]\nkind = \"wake\"\n[wake]\n{keys}"))
            .with_end(end)
            .unwrap();
        assert_eq!(parse(&file.toml).content, file.content);
        let wake = file.content.wake.unwrap();
        assert_eq!(wake.end_tau, end);
        (
            wake.fields_tau.unwrap(),
            wake.planes_tau.unwrap(),
            wake.series_tau,
        )
    };
    assert_eq!(ended("", 1.5), (vec![0.5, 1.0, 1.5], vec![0.75, 1.5], None));
    // A list that is written out is the case's own, also where it is that of the old end.
    assert_eq!(
        ended("end_tau = 0.7\nplanes_tau = [0.35, 0.7]\n", 0.5),
        (vec![0.5], vec![0.35], None)
    );
    let own = "fields_tau = [0.2, 0.9]\nseries_tau = [0.1, 0.8]\n";
    assert_eq!(
        ended(own, 0.4),
        (vec![0.2], vec![0.2, 0.4], Some([0.1, 0.4]))
    );
    let field = plane_vortices_for_tests::folder();
    let plane = vortices(&field, 0.01, "end_s = 0.5\n")
        .with_end(0.25)
        .unwrap();
    assert_eq!(plane.content.time.end_s, Some(0.25));
    let refused = plane.with_end(-1.0).unwrap_err().to_string();
    assert!(
        refused.contains("--end = -1.0") && refused.contains("above 0"),
        "{refused}"
    );
}

#[test]
fn energy_from_nowhere_stops_a_run_whose_checkpoints_are_good() {
    let folder = tempfile::tempdir().unwrap();
    let field = plane_vortices_for_tests::folder();
    let case = vortices(
        &field,
        0.0,
        "end_s = 1000.0\nscheme = \"adams_bashforth2\"\ncourant = 0.4\n",
    );
    let notes = Notes::default();
    let error = run(&case, folder.path(), Begin::New, &notes).unwrap_err();
    assert!(
        matches!(error, Error::Flow(wakescope_les::Error::EnergyGrew { .. })),
        "{error}"
    );
    assert!(
        notes.0.lock().unwrap()[0].contains("runge_kutta3"),
        "{:?}",
        notes.0
    );
    let steps = fs::read_to_string(folder.path().join("steps.csv")).unwrap();
    let energies: Vec<f64> = steps
        .lines()
        .skip_while(|l| !l.starts_with("1,"))
        .map(|l| l.split(',').nth(4).unwrap().parse().unwrap())
        .collect();
    let last = energies.last().unwrap() / energies[0];
    assert!(
        (1.01..2.0).contains(&last),
        "stopped at {last} times the energy of the start"
    );
    // Where the case names no scheme, one is taken that loses energy, if anything.
    let long = vortices(&field, 0.0, "end_s = 20.0\ncourant = 0.35\n");
    let folder = tempfile::tempdir().unwrap();
    let outcome = run(&long, folder.path(), Begin::New, &Silent).unwrap();
    let kept = outcome.kinetic_energy_m5_s2 / energies[0];
    assert!(
        kept < 1.0 && kept > 0.99 && outcome.warnings.is_empty(),
        "{kept}, {:?}",
        outcome.warnings
    );
}

#[test]
fn a_run_goes_on_with_the_scheme_of_its_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    // Cells of Reynolds number 42: damped at a Courant number of 0.2, not at 0.35.
    let field = plane_vortices_for_tests::folder();
    let case = |time: &str| vortices(&field, 0.0015, time);
    let scheme = |file: &CaseFile| {
        Setup::new(&file.content, file.folder())
            .unwrap()
            .settings
            .scheme
    };
    let [slow, fast] = [
        "end_s = 0.1\ncourant = 0.2\n",
        "end_s = 0.2\ncourant = 0.35\n",
    ]
    .map(case);
    assert_eq!(
        [scheme(&slow), scheme(&fast)],
        [
            wakescope_les::TimeScheme::AdamsBashforth2,
            wakescope_les::TimeScheme::RungeKutta3
        ]
    );
    run(&slow, folder.path(), Begin::New, &Silent).unwrap();
    assert!(
        run(&fast, folder.path(), Begin::Restart, &Silent)
            .unwrap()
            .is_complete
    );
    // One that is named must be the same.
    let named = case("end_s = 0.3\nscheme = \"runge_kutta3\"\n");
    let error = run(&named, folder.path(), Begin::Restart, &Silent)
        .unwrap_err()
        .to_string();
    assert!(error.contains("time scheme"), "{error}");
}

#[test]
fn a_courant_number_is_checked_against_the_limit_of_its_scheme_mesh_and_viscosity() {
    let with = |case: &str, scheme: &str, courant: f64, model: &str| {
        let text = format!(
            "[case]\n{case}\n[time]\nend_s = 0.2\nscheme = \"{scheme}\"\ncourant = {courant:?}\nlongest_step_s = 10.0\n[solver]\n\
             subgrid = {{ model = \"{model}\" }}\n"
        );
        check(&parse(&text), None, Begin::New)
    };
    // A uniform flow through a periodic box of 12 cells along each direction.
    let uniform = |viscosity: &str| {
        let axis = "cells = 12, low_m = 0.0, high_m = 6.0, low_end = \"periodic\", high_end = \"periodic\"";
        format!(
            "kind = \"free\"\nviscosity_m2_s = {viscosity}\nx = {{ {axis} }}\ny = {{ {axis} }}\nz = {{ {axis} }}\n\
             initial = {{ kind = \"uniform\", velocity_m_s = [0.5, 0.5, 0.0] }}"
        )
    };
    let [thin, mean, thick] = ["1e-6", "0.02", "0.05"].map(uniform);
    let walls = "kind = \"vortex_pair\"\ncells = [1, 32, 32]\nreynolds = 1e6".to_owned();
    for (case, least, most) in [
        (thin, 1.092, 1.093),
        (mean, 1.2, 1.35),
        (thick, 1.3, 1.45),
        (walls, 1.484, 1.495),
    ] {
        let limit = with(&case, "runge_kutta3", 0.5, "none")
            .unwrap()
            .damped_courant;
        assert!(limit > least && limit < most, "{case}: {limit}");
        with(&case, "runge_kutta3", 0.999 * limit, "none").unwrap();
        let error = with(&case, "runge_kutta3", 1.001 * limit, "none")
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("case.toml:")
                && error.contains("time.courant")
                && error.contains("at most"),
            "{error}"
        );
        assert!(with(&case, "runge_kutta3", 2.0, "none").is_err());
    }
    // What a model will take does not count.
    let thin = uniform("1e-6");
    with(&thin, "adams_bashforth2", 0.4, "multiscale_wale").unwrap();
    let error = with(&thin, "adams_bashforth2", 0.45, "multiscale_wale")
        .unwrap_err()
        .to_string();
    assert!(error.contains("time.courant = 0.45"), "{error}");
    let own = parse(&format!(
        "[case]\n{thin}\n[time]\nend_s = 1.0\n[solver]\nsubgrid = {{ model = \"wale\", constant = 0.02 }}\n"
    ));
    let scheme = Setup::new(&own.content, Path::new(""))
        .unwrap()
        .settings
        .scheme;
    assert_eq!(scheme, wakescope_les::TimeScheme::RungeKutta3);
    // A note that a run would give is given by the check, too.
    let noted = with(&thin, "adams_bashforth2", 0.35, "none").unwrap_or_else(|e| panic!("{e}"));
    assert!(
        noted.notes.is_empty(),
        "too short a run for waves to grow: {:?}",
        noted.notes
    );
    let long = "[time]\nend_s = 10.0\nscheme = \"adams_bashforth2\"\n";
    let noted = check(&parse(&format!("[case]\n{thin}\n{long}")), None, Begin::New).unwrap();
    assert!(
        noted.notes.len() == 1 && noted.notes[0].contains("runge_kutta3"),
        "{:?}",
        noted.notes
    );
}

/// A wake that takes next to nothing.
fn tiny_wake(case: &str, wake: &str) -> CaseFile {
    parse(&format!(
        "[case]\nkind = \"wake\"\ncells = [1, 24, 16]\nheight = 1.2\n{case}[wake]\nend_tau = 0.2\nevery_tau = 0.1\n\
         fields_tau = []\nplanes_tau = []\n{wake}[checkpoint]\nevery_steps = 3\n"
    ))
}

#[test]
fn a_finished_wake_is_left_as_it_is_by_a_restart_and_refuses_an_earlier_end() {
    let folder = tempfile::tempdir().unwrap();
    let case = tiny_wake("", "");
    run(&case, folder.path(), Begin::New, &Silent).unwrap();
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    let kept = ["flow.checkpoint", "flow.checkpoint.previous", CASE].map(read);
    assert!(kept[0] != kept[1]);
    assert!(
        run(&case, folder.path(), Begin::Restart, &Silent)
            .unwrap()
            .is_complete
    );
    let error = run(
        &case.with_end(0.1).unwrap(),
        folder.path(),
        Begin::Restart,
        &Silent,
    )
    .unwrap_err()
    .to_string();
    assert!(
        error.contains("the end") && error.contains("tau = 0.2"),
        "{error}"
    );
    assert!(kept == ["flow.checkpoint", "flow.checkpoint.previous", CASE].map(read));
}

#[test]
fn a_seed_of_the_command_line_is_that_of_the_noise_and_of_the_files() {
    let seeded = tiny_wake("seed = 5\n", "").with_seed(7).unwrap();
    assert!(seeded.toml.contains("seed = 7\n") && seeded.provenance().seed == 7);
    assert_eq!(tiny_wake("", "").with_seed(7).unwrap().toml, seeded.toml);
    assert_eq!(tiny_wake("", "").provenance().seed, 0);
    let field = plane_vortices_for_tests::folder();
    let error = vortices(&field, 0.01, "end_s = 0.1\n")
        .with_seed(7)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("--seed = 7") && error.contains("no noise"),
        "{error}"
    );
}

#[test]
fn columns_and_texts_of_the_circulation_have_the_radii_of_the_case() {
    for (radii, name) in [
        ("[3.0, 9.0]", "gamma_3_9_left_m2_s"),
        ("[4.5, 15.0]", "gamma_4p5_15_left_m2_s"),
        ("[5.0, 15.0]", "gamma_5_15_left_m2_s"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let case = tiny_wake(&format!("circulation_radii_m = {radii}\n"), "");
        run(&case, folder.path(), Begin::New, &Silent).unwrap();
        let table = fs::read_to_string(folder.path().join("wake.csv")).unwrap();
        let names = table.lines().find(|line| line.starts_with("tau,")).unwrap();
        assert!(names.split(',').any(|column| column == name), "{names}");
        assert_eq!(
            names.matches("gamma_5_15").count(),
            if radii.starts_with("[5") { 2 } else { 0 }
        );
    }
}

#[test]
fn keys_that_do_nothing_are_told_of() {
    let notes = |case: &str, wake: &str| {
        check(&tiny_wake(case, wake), None, Begin::New)
            .unwrap()
            .notes
    };
    let before = notes("", "").len();
    for (case, wake, wanted) in [
        (
            "circulation_radii_m = [4.0, 60.0]\n",
            "",
            "circulation_radii_m",
        ),
        ("wind_roughness_m = 0.1\n", "", "wind_roughness_m"),
        ("seed = 3\nperturbation = 0.0\n", "", "case.seed"),
    ] {
        let found = notes(case, wake);
        assert!(
            found.len() == before + 1 && found.iter().any(|text| text.contains(wanted)),
            "{found:?}"
        );
    }
    let uneven = parse(
        "[case]\nkind = \"wake\"\ncells = [1, 24, 16]\n[wake]\nend_tau = 0.25\nevery_tau = 0.1\n",
    );
    let found = check(&uneven, None, Begin::New).unwrap().notes;
    assert!(
        found.iter().any(|text| text.contains("every_tau = 0.1")),
        "{found:?}"
    );
}

#[test]
fn an_age_comes_back_as_it_was_asked_for() {
    for tau_per_s in [0.049_514_871_3, 0.036_024_1, 1.0 / 27.759_2, 1.0 / 3.0] {
        for tau in (1..=50).map(|i| f64::from(i) / 10.0) {
            assert_eq!(age_tau(tau / tau_per_s, tau_per_s), tau);
        }
    }
}
