//! `wakescope accuracy`: settings of a scene and of a flow, threads, refusals.

use super::wakescope;
use std::path::Path;
use wakescope_sim::accuracy::keys::{GRID_POINTS, WINDOW_STEP};
use wakescope_sim::accuracy::keys::{GRID_SPACING, LAYERS, PADDED, PATHS, REALISATIONS};
use wakescope_sim::accuracy::metrics::Metric;
use wakescope_sim::accuracy::{Report, Request};
use wakescope_sim::{SceneFile, Silent};

const SCENE: &str = "seed = 5\n[detector.snr]\nreference = \"fixed\"\nsnr_db = 10.0\n[scan]\nelevation_min_rad = 0.1\n\
                     elevation_max_rad = 0.11\nelevation_step_rad = 2.5e-3\nrange_min_m = 350.0\nrange_max_m = 420.0\n\
                     pulses_per_line = 16\nrealisations = 8\n";

/// A collimated beam through weak turbulence that both paths share.
const TURBULENT: &str = "seed = 5\n[scan]\nelevation_min_rad = 0.1\nelevation_max_rad = 0.105\nelevation_step_rad = 2.5e-3\n\
                         range_min_m = 350.0\nrange_max_m = 420.0\npulses_per_line = 2\nrealisations = 8\n\
                         [atmosphere.turbulence]\nkind = \"refractive\"\ncn2_m_m23 = 1e-14\ngrid_points = 64\n\
                         grid_spacing_m = 0.004\nlayers = 8\nrealisations = 256\n[outputs]\nprofile_points = 2\n\
                         profile_range_min_m = 360.0\nprofile_range_max_m = 400.0\n";

/// A small wake, which cannot be right and is quick.
const WAKE: &str = "[case]\nkind = \"wake\"\ncells = [8, 24, 24]\ncore_radius = 0.3\n[wake]\nend_tau = 0.1\nevery_tau = 0.02\n";

fn report(scene: &str, within: f64, of: &[Metric]) -> Report {
    let file = SceneFile::parse(scene, Path::new("s.toml")).unwrap();
    let request = Request {
        within,
        of: of.to_vec(),
    };
    Report::of_scene(&file, &request, &Silent).unwrap()
}

#[test]
fn values_that_lose_gates_are_never_recommended() {
    let found = report(SCENE, 0.5, &[Metric::Rms]);
    let keys: Vec<&str> = found.settings.iter().map(|setting| setting.key).collect();
    assert_eq!(keys, [WINDOW_STEP, PADDED, REALISATIONS]);
    let step = &found.settings[0];
    let lossy = step.rows.iter().find(|row| row.lost > 0.0).unwrap();
    // The gates that are left have the same errors.
    assert!(
        lossy.shifts.iter().all(|(_, shift)| shift.bound() < 0.5),
        "{lossy:?}"
    );
    let cheapest = step.cheapest(0.5).unwrap();
    assert!(cheapest.lost == 0.0 && cheapest.value < lossy.value);
    assert!(found.text().contains("% of the gates"));
    // The standard error of the noise falls with the root of the number of realisations.
    let noise = &found.settings[2].rows;
    let errors: Vec<f64> = noise
        .iter()
        .map(|row| row.shift(Metric::Rms).unwrap().std)
        .collect();
    let values: Vec<f64> = noise.iter().map(|row| row.value).collect();
    assert_eq!(values, [16.0, 8.0, 4.0, 2.0]);
    assert!((errors[3] / errors[1] - 2.0).abs() < 1e-12 && errors[1] > 0.01);
}

#[test]
fn phase_screens_are_assessed_by_theory_and_by_their_realisations() {
    let found = report(TURBULENT, 0.05, &[Metric::Efficiency, Metric::Rms]);
    let setting = |key: &str| {
        found
            .settings
            .iter()
            .find(|setting| setting.key == key)
            .unwrap()
    };
    for row in &setting(LAYERS).rows {
        let efficiency = row.shift(Metric::Efficiency).unwrap();
        assert!(
            efficiency.std == 0.0 && efficiency.bound() <= 2e-3,
            "{row:?}"
        );
        // The signal-to-noise ratio acts on the errors of the map less than in proportion.
        assert!(row.shift(Metric::Rms).unwrap().bound() < efficiency.bound() + 1e-3);
    }
    assert!(
        found.notes.iter().any(|note| note.contains("bistatic")),
        "{:?}",
        found.notes
    );
    let refused = setting(GRID_SPACING)
        .rows
        .iter()
        .find_map(|row| row.refused.as_ref());
    assert!(refused.is_some_and(|reason| !reason.is_empty()));
    let noise = setting(PATHS).given_row().unwrap();
    let noise = noise.shift(Metric::Efficiency).unwrap().std;
    let grids = &setting(GRID_POINTS).rows;
    let of_given = grids.iter().find(|row| row.value == 64.0).unwrap();
    assert!(of_given.shift(Metric::Efficiency).unwrap().std < 3.0 * noise);
    assert!(noise > 1e-4 && noise < 0.05, "{noise}");
}

/// The table without run times and what follows from them.
fn without_times(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    let mut out = String::new();
    for line in text.lines() {
        let kept = match line.starts_with('#') {
            true => line,
            false => line.rsplitn(4, ',').last().unwrap(),
        };
        out += kept;
        out += "\n";
    }
    assert!(out.contains("setting,value,metric,shift,standard_error,status\n"));
    out
}

#[test]
fn shifts_have_the_same_bytes_for_any_number_of_threads() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("s.toml"), SCENE).unwrap();
    std::fs::write(temp.path().join("c.toml"), WAKE).unwrap();
    for (file, metric, given) in [
        ("s.toml", "rms", "8 (given)"),
        ("c.toml", "height", "x 24 (given)"),
    ] {
        let mut tables = Vec::new();
        for threads in ["1", "2"] {
            let folder = format!("{file}-{threads}");
            let line = format!(
                "accuracy {file} --within 10% --of {metric} --out {folder} --threads {threads} --quiet"
            );
            let out = wakescope(temp.path(), &line.split(' ').collect::<Vec<_>>());
            let text = String::from_utf8_lossy(&out.stdout).into_owned();
            let error = String::from_utf8_lossy(&out.stderr);
            let is_reached = !text.contains("no value is within");
            assert_eq!(
                out.status.code(),
                Some(i32::from(!is_reached)),
                "{text}{error}"
            );
            assert!(
                text.contains(given) && text.contains("cheapest within"),
                "{text}"
            );
            let folder = temp.path().join(folder);
            assert_eq!(
                super::cli::names(&folder),
                ["accuracy.csv", "accuracy.png", "accuracy.svg"]
            );
            tables.push(without_times(&folder.join("accuracy.csv")));
        }
        assert!(tables[0] == tables[1], "{tables:?}");
    }
}

#[test]
fn wrong_options_are_refused_with_what_is_allowed() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("s.toml"), SCENE).unwrap();
    std::fs::write(temp.path().join("c.toml"), WAKE).unwrap();
    for (line, expected) in [
        ("s.toml --within 0", "from 0.001% to 50%"),
        ("s.toml --within 3%,4", "from 0.001% to 50%"),
        ("s.toml --within 3% --of colour", "possible values"),
        (
            "s.toml --within 3% --of u",
            "u is not a metric of this scene, which has: bias, std, rms",
        ),
        (
            "s.toml --within 3% --of height",
            "height is not a metric of this scene",
        ),
        (
            "c.toml --within 3% --of rms",
            "rms is not a metric of this case",
        ),
        ("s.toml --within 3% --budget 10", "--budget"),
    ] {
        let line = format!("accuracy {line} --out o");
        let out = wakescope(temp.path(), &line.split(' ').collect::<Vec<_>>());
        let error = String::from_utf8_lossy(&out.stderr);
        assert!(
            out.status.code() == Some(2) && error.contains(expected),
            "{line}: {error}"
        );
    }
    assert!(!temp.path().join("o").exists());
}
