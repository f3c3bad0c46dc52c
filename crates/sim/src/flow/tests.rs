//! Case files, interrupted runs, wrong input.

use super::*;
use crate::progress::{Observer, Silent};
use std::collections::BTreeMap;
use std::fs;
use wakescope_les::SubgridModel;
use wakescope_les::cases::VortexPairCase;

/// The example with few cells and three steps.
fn tiny(name: &str, text: &str) -> String {
    let mut table: toml::Table = text.parse().unwrap();
    let case = table["case"].as_table_mut().unwrap();
    let few = |value: &mut toml::Value| match value {
        toml::Value::Array(cells) => {
            let n = cells.len();
            for (i, cell) in cells.iter_mut().enumerate() {
                *cell = toml::Value::Integer(if i + 1 == n { 24 } else { 8 });
            }
        }
        cell => *cell = toml::Value::Integer(16),
    };
    if let Some(cells) = case.get_mut("cells") {
        few(cells);
    }
    for axis in ["y", "z"] {
        if let Some(axis) = case.get_mut(axis) {
            few(&mut axis.as_table_mut().unwrap()["cells"]);
        }
    }
    let time = table["time"].as_table_mut().unwrap();
    time.insert("pause_after_steps".into(), 3.into());
    // Few cells allow longer steps than those of the example; the output of the start is among the files.
    if name == "wake" {
        // Its outputs are by age; one of each kind comes within three steps.
        let wake = table["wake"].as_table_mut().unwrap();
        for key in ["fields_tau", "planes_tau"] {
            wake.insert(
                key.into(),
                toml::Value::Array(vec![toml::Value::Float(0.0)]),
            );
        }
        return toml::to_string(&table).unwrap();
    }
    let output = table["output"].as_table_mut().unwrap();
    output.remove("every_s");
    output.insert(
        "times_s".into(),
        toml::Value::Array(vec![toml::Value::Float(0.0)]),
    );
    toml::to_string(&table).unwrap()
}

fn parse(text: &str) -> CaseFile {
    CaseFile::parse(text, Path::new("case.toml")).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn refused(text: &str) -> String {
    CaseFile::parse(text, Path::new("case.toml"))
        .unwrap_err()
        .to_string()
}

fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let file = |e: fs::DirEntry| {
        (
            e.file_name().into_string().unwrap(),
            fs::read(e.path()).unwrap(),
        )
    };
    fs::read_dir(folder)
        .unwrap()
        .map(|e| file(e.unwrap()))
        .collect()
}

#[test]
fn every_example_is_a_good_case_that_keeps_its_meaning_and_runs() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in EXAMPLES {
        let file = parse(text);
        assert_eq!(
            parse(&file.toml).content,
            file.content,
            "{name} written out and read again"
        );
        assert!(text.contains(&format!("kind = \"{name}\"")), "{name}");
        let out = folder.path().join(name);
        let outcome = run(&parse(&tiny(name, text)), &out, Begin::New, &Silent)
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!((outcome.steps, outcome.is_complete), (3, false), "{name}");
        assert!(
            outcome.relative_divergence < 1e-8,
            "{name}: {}",
            outcome.relative_divergence
        );
        assert!(outcome.files.iter().all(|path| path.exists()));
        let steps = fs::read_to_string(out.join("steps.csv")).unwrap();
        assert_eq!(
            steps.lines().filter(|l| !l.starts_with('#')).count(),
            4,
            "{name}: a header and three rows"
        );
    }
    assert!(example("wake").is_some() && example("none").is_none());
}

/// A pair between periodic sides with all outputs.
fn vortices(pause: Option<u64>) -> CaseFile {
    let pause = pause.map_or(String::new(), |steps| {
        format!("pause_after_steps = {steps}\n")
    });
    parse(&format!(
        "[case]\nkind = \"vortex_pair\"\ncells = [1, 12, 16]\ncore_radius = 0.5\nreynolds = 500.0\n\
         [time]\nend_s = 0.2\ncourant = 0.1\n{pause}\
         [output]\ntimes_s = [0.0, 0.1, 0.2]\nfields = [\"netcdf\", \"initial_netcdf\"]\nplanes_x_m = [0.5]\n\
         [checkpoint]\nevery_steps = 2\n"
    ))
}

/// Numbers of a NetCDF file by the names of their variables.
fn numbers(folder: &Path, name: &str) -> BTreeMap<String, Vec<f64>> {
    let mut file = netcdf3::FileReader::open(folder.join(name)).unwrap();
    let names = file.data_set().get_var_names();
    let mut values = BTreeMap::new();
    for variable in names {
        let wide = file.read_var_f64(&variable);
        let found = wide.or_else(|_| {
            let narrow = file.read_var_f32(&variable)?;
            Ok(narrow.into_iter().map(f64::from).collect())
        });
        found
            .map(|found| values.insert(variable, found))
            .unwrap_or_else(|e: netcdf3::ReadError| panic!("{name}: {e:?}"));
    }
    values
}

#[test]
fn an_interrupted_run_leaves_the_same_files_byte_for_byte_as_one_that_was_not() {
    let folder = tempfile::tempdir().unwrap();
    let [whole, parts] = ["whole", "parts"].map(|name| folder.path().join(name));
    let outcome = run(&vortices(None), &whole, Begin::New, &Silent).unwrap();
    assert!(outcome.is_complete && outcome.steps > 6, "{outcome:?}");
    run(&vortices(Some(3)), &parts, Begin::New, &Silent).unwrap();
    // As if the machine had failed behind the checkpoint: a row too many, and half of one.
    let mut steps = fs::read_to_string(parts.join("steps.csv")).unwrap();
    steps += "4,0.1,0.0";
    fs::write(parts.join("steps.csv"), steps).unwrap();
    run(&vortices(Some(5)), &parts, Begin::Restart, &Silent).unwrap();
    let last = run(&vortices(None), &parts, Begin::Restart, &Silent).unwrap();
    assert_eq!((last.steps, last.time_s), (outcome.steps, outcome.time_s));
    // Files of the start say that the run would pause: their numbers are compared.
    for number in 1..=3 {
        for stem in ["fields", "initial", "plane1"] {
            let name = format!("{stem}_{number:04}.nc");
            let found = numbers(&parts, &name);
            assert!(found.contains_key("v"), "{name}");
            assert!(numbers(&whole, &name) == found, "{name}");
        }
    }
    let whole = contents(&whole);
    let parts = contents(&parts);
    for name in ["flow.checkpoint", "steps.csv"] {
        assert!(whole[name] == parts[name], "{name}");
    }
}

/// A small wake with records, fields, planes and checkpoints.
fn small_wake(pause: Option<u64>) -> CaseFile {
    let pause = pause.map_or(String::new(), |steps| {
        format!("pause_after_steps = {steps}\n")
    });
    let format = "netcdf";
    parse(&format!(
        "[case]\nkind = \"wake\"\npair = {{ from = \"a340\" }}\ncells = [6, 32, 24]\ncross_wind_m_s = 0.5\n\
         [wake]\nend_tau = 0.2\nevery_tau = 0.04\nfields_tau = [0.1]\nplanes_tau = [0.0]\nseries_tau = [0.1, 0.2]\n\
         series_every_tau = 0.05\n[time]\n{pause}[output]\nfields = [\"{format}\"]\nplanes = [\"{format}\"]\n\
         [checkpoint]\nevery_steps = 5\n"
    ))
}

#[test]
fn an_interrupted_wake_leaves_the_same_histories_fields_and_planes() {
    let folder = tempfile::tempdir().unwrap();
    let [whole, parts] = ["whole", "parts"].map(|name| folder.path().join(name));
    let outcome = run(&small_wake(None), &whole, Begin::New, &Silent).unwrap();
    assert!(outcome.is_complete && outcome.steps > 12, "{outcome:?}");
    run(&small_wake(Some(7)), &parts, Begin::New, &Silent).unwrap();
    let last = run(&small_wake(None), &parts, Begin::Restart, &Silent).unwrap();
    assert_eq!(last.steps, outcome.steps);
    let whole = contents(&whole);
    let parts = contents(&parts);
    let end = "nc";
    assert!(
        whole["wake.csv"] == parts["wake.csv"]
            && whole["flow.checkpoint"] == parts["flow.checkpoint"]
    );
    for name in ["plane1_0004", "fields_0001"].map(|stem| format!("{stem}.{end}")) {
        assert!(whole[&name] == parts[&name], "{name}");
    }
    assert!(whole["wake.nc"] == parts["wake.nc"]);
    let rows = String::from_utf8(whole["wake.csv"].clone()).unwrap();
    let rows = rows.lines().filter(|line| !line.starts_with('#')).count();
    assert_eq!(rows, 7, "a header and the ages 0, 0.04, ..., 0.2");
    let wake = FinishedWake::read(&folder.path().join("whole")).unwrap();
    let of = |row: usize, name: &str| wake.column(name).unwrap()[row - 1];
    // The A340's pair: b0 = pi b/4.
    let spacing_m = std::f64::consts::PI * 60.3 / 4.0;
    assert!((of(1, "y_right_m") / of(1, "y_right") - spacing_m).abs() < 1e-9);
    assert!((of(1, "y_left") + 0.5).abs() < 0.02 && (of(1, "z_right") - 1.0).abs() < 0.02);
    assert!(
        (of(6, "tau") - 0.2).abs() < 1e-12 && of(4, "z_left") < of(1, "z_left") - 0.03,
        "it sinks at first"
    );
    assert!(of(6, "gamma_5_15_left_m2_s") < 0.0 && of(6, "gamma_ratio_left") < 1.0);
}

#[test]
fn the_history_of_a_wake_opens_with_its_axes() {
    let folder = tempfile::tempdir().unwrap();
    run(&small_wake(None), folder.path(), Begin::New, &Silent).unwrap();
    let mut file = netcdf3::FileReader::open(folder.path().join("wake.nc")).unwrap();
    let [tau, radius, mode] =
        ["tau", "radius", "mode"].map(|name| file.read_var_f64(name).unwrap());
    assert_eq!((tau.len(), radius.len(), mode.len()), (6, 24, 4));
    let gamma = file.read_var_f64("gamma").unwrap();
    assert_eq!(gamma.len(), 6 * 2 * 24);
    let scales = PairScale::A340 {}.scales().unwrap();
    // At the start the right vortex has Gamma0 r^2/(r^2 + r_c^2); its sixteenth radius is 0.4 b0.
    let share = gamma[24 + 15] / scales.circulation_m2_s;
    assert!((share - 0.16 / 0.17).abs() < 0.03, "{share}");
    assert_eq!(file.read_var_f64("y_centre").unwrap().len(), 6 * 2 * 6);
    // Each column of the table is a variable: its name less the tag of its unit.
    let table = std::fs::read_to_string(folder.path().join("wake.csv")).unwrap();
    let mut rows = table
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split(',').collect::<Vec<_>>());
    let names = rows.next().unwrap();
    let last = rows.next_back().unwrap();
    assert!(names.contains(&"gamma_ratio_left") && names.contains(&"gamma_ratio_right"));
    for (name, cell) in names.iter().zip(last) {
        let tags = ["_m2_s", "_m", "_s", "_hz"];
        let bare = tags
            .iter()
            .find_map(|tag| name.strip_suffix(tag))
            .unwrap_or(name);
        let values = file
            .read_var_f64(bare)
            .or_else(|_| file.read_var_f64(name))
            .unwrap_or_else(|e| panic!("{name}: {e:?}"));
        let value = cell.parse::<f64>().unwrap_or(f64::NAN);
        assert!(
            values[5] == value || values[5].is_nan() && value.is_nan(),
            "{name}: {} and {cell}",
            values[5]
        );
    }
    let mut field = netcdf3::FileReader::open(folder.path().join("fields_0001.nc")).unwrap();
    let vorticity = field.read_var_f32("vorticity_magnitude").unwrap();
    let largest = vorticity.iter().fold(0.0_f32, |a, b| a.max(*b));
    assert!(
        f64::from(largest) > 10.0 / scales.time_unit_s(),
        "{largest}"
    );
}

#[test]
fn presets_are_cases_of_the_solver_and_give_way_to_keys_of_a_file() {
    let coarse = CaseFile::parse_over(Some(WakePreset::Coarse), "", Path::new("preset")).unwrap();
    let text = example("wake").unwrap();
    let mut commented = parse(text).content;
    (commented.time.scheme, commented.time.courant) = (None, None);
    commented.checkpoint.every_steps = None;
    assert_eq!(
        commented, coarse.content,
        "the commented example is the preset"
    );
    let [coarse, wide] = [[24, 128, 80], [48, 240, 128]].map(|cells| VortexPairCase {
        cells,
        ..VortexPairCase::coarse()
    });
    let medium = VortexPairCase {
        size: [1.0, 5.0, 2.5],
        ..wide
    };
    let multiscale = SubgridModel::MULTISCALE_WALE;
    let fine = VortexPairCase {
        cells: [64, 256, 144],
        ground_stretch: 2.0,
        lateral_stretch: 0.45,
        core_radius: 0.05,
        reynolds: 2e4,
        subgrid: multiscale,
        ..medium.clone()
    };
    let chapter = VortexPairCase {
        cells: [128, 432, 224],
        size: [2.0, 6.0, 3.0],
        ground_stretch: 2.2,
        ..fine.clone()
    };
    for (preset, expected) in [
        (WakePreset::Coarse, coarse),
        (WakePreset::Medium, medium),
        (WakePreset::Fine, fine),
        (WakePreset::Chapter, chapter),
    ] {
        let file = CaseFile::parse_over(Some(preset), "", Path::new("preset")).unwrap();
        let CaseKind::Wake(flow) = &file.content.case else {
            panic!("{preset:?}")
        };
        let mut pair = flow.pair_case().unwrap();
        pair.subgrid = expected.subgrid;
        assert_eq!(pair, expected);
        let is_multiscale = file.content.solver.subgrid
            == Subgrid::MultiscaleWale {
                constant: None,
                order: None,
            };
        assert_eq!(is_multiscale, expected.subgrid == multiscale, "{preset:?}");
    }
    let own = "[case]\nkind = \"wake\"\nreynolds = 1e4\npair = { from = \"a320\" }\n[wake]\nend_tau = 1.0\n\
               fields_tau = []\nplanes_tau = []\n";
    let file = CaseFile::parse_over(Some(WakePreset::Medium), own, Path::new("case.toml")).unwrap();
    let CaseKind::Wake(flow) = &file.content.case else {
        panic!()
    };
    assert_eq!(
        (flow.cells, flow.reynolds, flow.pair),
        ([48, 240, 128], 1e4, PairScale::A320 {})
    );
    let over = |text: &str| {
        CaseFile::parse_over(Some(WakePreset::Coarse), text, Path::new("c.toml"))
            .unwrap_err()
            .to_string()
    };
    let message = over("[case]\nkind = \"wake\"\ncore_radius = -0.1\n");
    assert!(
        message.contains("c.toml:3") && message.contains("case.core_radius = -0.1"),
        "{message}"
    );
    let message = over("[case]\nkind = \"wake\"\n[wake]\nfields_tau = [9.0]\n");
    assert!(
        message.contains("wake.fields_tau") && message.contains("wake.end_tau"),
        "{message}"
    );
    let message = refused("[case]\nkind = \"vortex_pair\"\n[wake]\nevery_tau = 0.1\n");
    assert!(message.contains("case.kind = \"wake\""), "{message}");
    let message = refused("[case]\nkind = \"wake\"\n[output]\ntimes_s = [1.0]\n");
    assert!(message.contains("output.times_s"), "{message}");
}

#[test]
fn a_checkpoint_is_not_lost_by_mistake_and_a_damaged_one_gives_way_to_the_one_before() {
    let folder = tempfile::tempdir().unwrap();
    run(&vortices(Some(5)), folder.path(), Begin::New, &Silent).unwrap();
    let error = run(&vortices(None), folder.path(), Begin::New, &Silent).unwrap_err();
    assert!(matches!(error, Error::CheckpointInTheWay { .. }), "{error}");
    let path = folder.path().join("flow.checkpoint");
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let outcome = run(&vortices(None), folder.path(), Begin::Restart, &Silent).unwrap();
    assert!(
        outcome.is_complete && outcome.warnings.iter().any(|text| text.contains("damaged")),
        "{outcome:?}"
    );
    let fresh = tempfile::tempdir().unwrap();
    run(&vortices(None), fresh.path(), Begin::New, &Silent).unwrap();
    let steps = |folder: &Path| fs::read(folder.join("steps.csv")).unwrap();
    assert!(steps(folder.path()) == steps(fresh.path()));
    run(&vortices(Some(1)), folder.path(), Begin::Overwrite, &Silent).unwrap();
    // Another flow does not continue this one.
    let other = parse(&vortices(None).toml.replace("12,", "14,"));
    let error = run(&other, folder.path(), Begin::Restart, &Silent)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("cells along y") && error.contains("12") && error.contains("14"),
        "{error}"
    );
}

#[test]
fn outputs_that_cannot_be_written_stop_the_run_and_leave_the_checkpoint() {
    /// Puts a folder where an output will go while the flow runs.
    struct Mischief(PathBuf);
    impl Observer for Mischief {
        fn reach(&self, _: &str) {
            fs::create_dir_all(&self.0).unwrap();
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let in_the_way = folder.path().join("fields_0002.nc");
    // Before the run it is found before any computing.
    fs::create_dir_all(&in_the_way).unwrap();
    let error = run(&vortices(None), folder.path(), Begin::New, &Silent)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("fields_0002.nc") && error.contains("folder"),
        "{error}"
    );
    fs::remove_dir(&in_the_way).unwrap();
    assert!(contents(folder.path()).is_empty(), "nothing was written");
    let mischief = Mischief(in_the_way);
    let error = run(&vortices(None), folder.path(), Begin::New, &mischief).unwrap_err();
    assert!(matches!(error, Error::NotWritten { .. }), "{error}");
    assert!(wakescope_les::solver::check_checkpoint(folder.path().join("flow.checkpoint")).is_ok());
    fs::remove_dir(folder.path().join("fields_0002.nc")).unwrap();
    assert!(
        run(&vortices(None), folder.path(), Begin::Restart, &Silent)
            .unwrap()
            .is_complete
    );
    assert!(folder.path().join("fields_0002.nc").is_file());
}

#[test]
fn a_flow_that_blows_up_names_step_and_place() {
    let folder = tempfile::tempdir().unwrap();
    let text =
        "[case]\nkind = \"vortex_pair\"\ncells = [1, 12, 16]\n[time]\nend_s = 1.0\nstep_s = 0.8\n";
    let error = run(&parse(text), folder.path(), Begin::New, &Silent)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("time.step_s = 0.8") && error.contains("Courant number"),
        "{error}"
    );
    // A force that brings the air to a speed that the step does not allow.
    let z = "[case.z]\ncells = 8\nlow_m = 0.0\nhigh_m = 8.0\n";
    let text = format!(
        "[case]\nkind = \"free\"\nviscosity_m2_s = 0.01\nforce_m_s2 = [0.0, 1.0, 0.0]\n[case.y]\ncells = 8\nlow_m = 0.0\nhigh_m = 8.0\n{z}\
         [case.initial]\nkind = \"uniform\"\nvelocity_m_s = [0.0, 0.1, 0.0]\n[time]\nend_s = 10.0\nstep_s = 0.2\nscheme = \"runge_kutta3\"\n"
    );
    let folder = tempfile::tempdir().unwrap();
    let error = run(&parse(&text), folder.path(), Begin::New, &Silent)
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("flow: step ") && error.contains("fastest is v"),
        "{error}"
    );
}

#[test]
fn a_mesh_that_does_not_resolve_core_and_boundary_layer_is_said_to() {
    let warnings = |keys: &str| {
        let folder = tempfile::tempdir().unwrap();
        let text = format!(
            "[case]\nkind = \"vortex_pair\"\n{keys}\n[time]\nend_s = 1e-3\nstep_s = 5e-4\n[checkpoint]\nwrite = false\n"
        );
        run(&parse(&text), folder.path(), Begin::New, &Silent)
            .unwrap()
            .warnings
    };
    let found = warnings("cells = [1, 96, 48]\nreynolds = 2e4");
    assert!(
        found
            .iter()
            .any(|text| text.contains("core radius along y has 2.40 cells, at least 2.5")),
        "{found:?}"
    );
    assert!(
        found
            .iter()
            .any(|text| text.contains("the boundary layer, across the wall,")),
        "{found:?}"
    );
    assert_eq!(warnings("cells = [1, 128, 80]"), Vec::<String>::new());
}

#[test]
fn wrong_cases_are_refused_with_key_value_and_what_is_allowed() {
    let pair = |rest: &str| refused(&format!("[case]\nkind = \"vortex_pair\"\n{rest}"));
    for (message, wanted) in [
        (
            refused("[case]\nkind = \"tornado\"\n"),
            ["tornado", "vortex_pair"],
        ),
        (
            refused("[time]\nend_s = 1.0\n"),
            ["case.kind is missing", "one of"],
        ),
        (
            pair("reynolds = -5.0\n"),
            ["case.toml:3: case.reynolds = -5.0", "above 0"],
        ),
        (
            pair("viscosity = 1.0\n"),
            [
                "case.toml:3: case.viscosity = 1.0 is not allowed: there is no such key",
                "reynolds",
            ],
        ),
        (
            pair("cells = [1, 0, 4]\n"),
            ["case.cells = [1, 0, 4]", "1 to 100000"],
        ),
        (
            pair("[time]\nstep_s = 0.1\ncourant = 0.3\n"),
            ["time.step_s = 0.1", "absent"],
        ),
        (
            pair("[time]\nscheme = \"euler\"\n"),
            ["euler", "adams_bashforth2"],
        ),
        (
            pair("[solver]\npressure_tolerance = 2.0\n"),
            ["case.toml:4: solver.pressure_tolerance", "1e-15 to 0.1"],
        ),
        (
            pair("[solver]\nrotational = true\n"),
            ["case.toml:4: solver.rotational", "no such key"],
        ),
        (
            pair("[solver]\nsubgrid = { model = \"magic\" }\n"),
            ["magic", "multiscale_wale"],
        ),
        (
            pair("[output]\ntimes_s = [0.2, 0.1]\n"),
            ["output.times_s", "increasing"],
        ),
        (
            pair("[output]\nplanes = [\"initial_netcdf\"]\n"),
            ["output.planes", "whole field"],
        ),
        (
            pair("[checkpoint]\nevery_steps = 0\n"),
            ["checkpoint.every_steps", "above 0"],
        ),
        (
            refused("[case]\nkind = \"free\"\n[case.z]\ncells = 16\nlow_end = \"slip\"\n"),
            ["case.z.high_end", "periodic at both ends"],
        ),
        (
            refused(
                "[case]\nkind = \"free\"\n[case.y]\ncells = 16\nmapping = \"tanh_low\"\nstretch = 1.0\n",
            ),
            [
                "case.y.mapping = \"tanh_low\"",
                "sine or cluster in a periodic direction",
            ],
        ),
        (
            refused(
                "[case]\nkind = \"free\"\n[case.y]\ncells = 16\nmapping = \"sine\"\nplace = 0.5\n",
            ),
            ["case.y.place", "only with mapping = \"cluster\""],
        ),
    ] {
        for part in wanted {
            assert!(message.contains(part), "{part} is not in: {message}");
        }
    }
}

#[test]
fn what_only_the_mesh_tells_is_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let start = |text: &str| {
        run(&parse(text), &out, Begin::New, &Silent)
            .unwrap_err()
            .to_string()
    };
    let message = start("[case]\nkind = \"free\"\n");
    assert!(message.contains("time.end_s is missing"), "{message}");
    let walls = "[case]\nkind = \"free\"\n[case.x]\ncells = 8\nlow_end = \"slip\"\nhigh_end = \"slip\"\n\
                 [time]\nend_s = 1.0\n[output]\nplanes_x_m = [2.0]\n";
    let message = start(walls);
    assert!(
        message.contains("output.planes_x_m = 2.0") && message.contains("0.0 to 1.0 m"),
        "{message}"
    );
    let message =
        start("[case]\nkind = \"vortex_pair\"\ncells = [1, 16, 9]\nground_stretch = 0.0\n");
    assert!(
        message.contains("z direction: cells = 9") && message.contains("at least 12"),
        "{message}"
    );
    let message =
        start("[case]\nkind = \"vortex_pair\"\ncells = [1, 16, 16]\n[output]\nevery_s = 1e-6\n");
    assert!(
        message.contains("output.every_s = 1e-6") && message.contains("9999"),
        "{message}"
    );
    let message =
        start("[case]\nkind = \"vortex_pair\"\ncells = [1, 16, 16]\n[output]\ntimes_s = [7.0]\n");
    assert!(
        message.contains("output.times_s = 7.0") && message.contains("5.0"),
        "{message}"
    );
    assert!(!out.exists());
}

#[test]
fn a_field_written_by_a_run_starts_another_with_the_same_velocities() {
    let folder = tempfile::tempdir().unwrap();
    let case = |initial: &str, mesh: &str| {
        let text = format!(
            "[case]\nkind = \"free\"\nviscosity_m2_s = 0.01\n[case.initial]\n{initial}\n{mesh}[time]\nend_s = 0.05\n\
             step_s = 0.01\n[output]\ntimes_s = [0.0, 0.05]\nfields = [\"initial_netcdf\"]\n"
        );
        CaseFile::parse(&text, &folder.path().join("case.toml")).unwrap()
    };
    let mesh = |n: usize| {
        format!(
            "[case.y]\ncells = {n}\nlow_m = -4.0\nhigh_m = 4.0\n[case.z]\ncells = {n}\nlow_m = 0.0\nhigh_m = 4.0\n\
             low_end = \"no_slip\"\nhigh_end = \"slip\"\nmapping = \"tanh_low\"\nstretch = 1.0\n"
        )
    };
    let pair = "kind = \"vortex_pair\"\ncirculation_m2_s = 6.28\nspacing_m = 2.0\ncore_radius_m = 0.8\nheight_m = 2.0";
    run(
        &case(pair, &mesh(24)),
        &folder.path().join("a"),
        Begin::New,
        &Silent,
    )
    .unwrap();
    let again = "kind = \"netcdf\"\npath = \"a/initial_0001.nc\"";
    run(
        &case(again, &mesh(24)),
        &folder.path().join("b"),
        Begin::New,
        &Silent,
    )
    .unwrap();
    for output in ["initial_0001.nc", "initial_0002.nc"] {
        let [a, b] = ["a", "b"].map(|run| numbers(&folder.path().join(run), output));
        for component in ["u", "v", "w"] {
            let a = &a[component];
            let b = &b[component];
            assert_eq!(a.len(), 24 * 24);
            let worst = a
                .iter()
                .zip(b)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            assert!(worst < 1e-12, "{output}: {component} {worst}");
        }
    }
    // Also on a mesh of its own: both runs then differ by the error of the coarser one.
    let outcome = run(
        &case(again, &mesh(20)),
        &folder.path().join("c"),
        Begin::New,
        &Silent,
    )
    .unwrap();
    let energy = |folder_name: &str| {
        let text = fs::read_to_string(folder.path().join(folder_name).join("steps.csv")).unwrap();
        text.lines()
            .last()
            .unwrap()
            .split(',')
            .nth(4)
            .unwrap()
            .parse::<f64>()
            .unwrap()
    };
    assert!((outcome.kinetic_energy_m5_s2 / energy("a") - 1.0).abs() < 0.02);
    // What is no NetCDF, not there, or too small is refused by name.
    fs::write(folder.path().join("text.nc"), "no NetCDF").unwrap();
    for (path, mesh, wanted) in [
        ("text.nc", mesh(24), "NETCDF3_64BIT"),
        ("none.nc", mesh(24), "none.nc"),
        (
            "a/initial_0001.nc",
            mesh(24).replace("high_m = 4.0\nlow_end", "high_m = 9.0\nlow_end"),
            "not covered",
        ),
    ] {
        let file = case(&format!("kind = \"netcdf\"\npath = \"{path}\""), &mesh);
        let message = run(&file, &folder.path().join("d"), Begin::New, &Silent)
            .unwrap_err()
            .to_string();
        assert!(message.contains(wanted), "{wanted} is not in: {message}");
    }
}
