//! Nominal set-ups of real lidars, as scenes: one table, `presets.csv`, and a text made of a line of it.
//!
//! Check: each is a good scene and says what the table says.

/// One lidar a line; what the columns are stands in the file.
const TABLE: &str = include_str!("presets.csv");

/// What a scene of each has, with the names of the columns, and of what follows from them, in braces.
const TEMPLATE: &str = include_str!("preset.txt");

fn cells(line: &'static str) -> Vec<&'static str> {
    line.split('|').collect()
}

fn rows() -> impl Iterator<Item = Vec<&'static str>> {
    TABLE
        .lines()
        .filter(|line| !line.starts_with('#'))
        .skip(1)
        .map(cells)
}

/// Names of the presets.
pub fn preset_names() -> impl Iterator<Item = &'static str> {
    rows().filter_map(|row| row.first().copied())
}

/// The scene of a preset: what differs from the defaults, with its sources as comments.
pub fn preset_toml(name: &str) -> Option<String> {
    let row = rows().find(|row| row.first() == Some(&name))?;
    let header = cells(TABLE.lines().find(|line| !line.starts_with('#'))?);
    let cell = |column: &str| {
        header
            .iter()
            .position(|name| *name == column)
            .and_then(|at| row.get(at).copied())
    };
    let number = |column: &str| cell(column)?.parse::<f64>().ok();
    let pair_m = number("pair_m")?;
    // As high above the pair as in the default scene, and as far before and behind it.
    let highest_rad = (0.2304 * 400.0 / pair_m * 1e4).round() / 1e4;
    // A little less than the last line takes, so that rounding does not lose it.
    let step_rad = ((highest_rad / (number("lines")? - 1.0)) * 1e6).floor() / 1e6;
    // The quadratures see almost all of what their rate can hold.
    let bandwidth = format!(
        "bandwidth_hz = {:?} # assumed\n",
        0.98 * number("sampling_hz")?
    );
    let blind_range = format!("blind_range_m = {}\n", cell("blind_range_m")?);
    let made = [
        ("highest_rad", format!("{highest_rad:?}")),
        ("step_rad", format!("{step_rad:?}")),
        ("first_m", format!("{:?}", pair_m - 120.0)),
        ("last_m", format!("{:?}", pair_m + 120.0)),
        (
            "gate_step",
            (number("window_samples")? * 5.0 / 64.0)
                .round()
                .max(1.0)
                .to_string(),
        ),
        (
            "bandwidth",
            if cell("signal")? == "baseband" {
                bandwidth
            } else {
                String::new()
            },
        ),
        (
            "blind_range",
            if cell("blind_range_m")? == "0" {
                String::new()
            } else {
                blind_range
            },
        ),
    ];
    let stated = header
        .iter()
        .copied()
        .zip(row.iter().map(|cell| (*cell).to_owned()));
    let fill =
        |text: String, (name, value): (&str, String)| text.replace(&format!("{{{name}}}"), &value);
    Some(stated.chain(made).fold(TEMPLATE.to_owned(), fill))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::bound::bound;
    use crate::measure::budget::{Budget, scan_ranges_m};
    use crate::plan::{Plan, Target};
    use crate::progress::Silent;
    use crate::run::run;
    use crate::scene::{Scene, SceneFile};
    use std::path::Path;

    #[test]
    fn every_preset_is_a_good_scene_with_the_numbers_of_its_line_and_a_budget_that_sums_to_its_profile()
     {
        assert_eq!(preset_names().count(), 13);
        for row in rows() {
            let text = preset_toml(row[0]).unwrap();
            assert!(text.contains("Nominal") && text.contains(row[17]), "{text}");
            let file = SceneFile::parse(&text, Path::new(row[0])).unwrap();
            let scene = file.content.clone();
            let found = [
                scene.laser.wavelength_m,
                scene.pulse.energy_j,
                scene.laser.pulse_repetition_hz,
                scene.pulse_width_s(),
                scene.telescope.aperture_radius_m,
                scene.telescope.beam_radius_m,
                scene.detector.sampling_hz,
            ];
            let stated: Vec<f64> = row[1..8].iter().map(|x| x.parse().unwrap()).collect();
            assert_eq!(found.to_vec(), stated, "{}", row[0]);
            assert_eq!(scene.estimator.window_samples.to_string(), row[9]);
            assert_eq!(scene.scan.pulses_per_line.to_string(), row[10]);
            let plan = Plan::new(file, Target::Run).unwrap();
            assert_eq!(
                plan.geometry.elevation_rad.len().to_string(),
                row[11],
                "{}",
                row[0]
            );
            let ranges_m = scan_ranges_m(&scene);
            let budget = Budget::new(&plan, &ranges_m, &Silent).unwrap();
            let mut at = scene;
            (
                at.outputs.profile_range_min_m,
                at.outputs.profile_range_max_m,
            ) = (ranges_m[0], ranges_m[2]);
            at.outputs.profile_points = 3;
            let plan = Plan::new(SceneFile::new(at).unwrap(), Target::Efficiency).unwrap();
            let profile = run(&plan, &Silent).unwrap().profile.unwrap();
            for (sum, snr_db) in budget.snr_db().iter().zip(&profile.snr_db) {
                assert!((sum - snr_db).abs() < 1e-9, "{}: {sum} {snr_db}", row[0]);
            }
        }
        let table2 = SceneFile::parse(&preset_toml("chapter_table2").unwrap(), Path::new("s"))
            .unwrap()
            .content;
        let same = Scene {
            scan: crate::scene::Scan {
                elevation_step_rad: 1.25e-3,
                ..table2.scan
            },
            ..table2
        };
        assert_eq!(same, Scene::default());
        assert_eq!(preset_toml("lidar"), None);
    }

    #[test]
    fn the_page_tells_how_far_presets_reach() {
        let page = include_str!("../../../../docs/src/budget.md");
        for row in rows() {
            let start = format!("| `{}` |", row[0]);
            let line = page.lines().rfind(|line| line.starts_with(&start)).unwrap();
            let cells: Vec<f64> = line
                .split('|')
                .skip(2)
                .take(3)
                .map(|cell| cell.trim().parse().unwrap())
                .collect();
            let mut file =
                SceneFile::parse(&preset_toml(row[0]).unwrap(), Path::new(row[0])).unwrap();
            let airs = [(1e-7, 7e-5), (1e-6, 1e-4)];
            for (reach_km, (backscatter_per_m_sr, extinction_per_m)) in cells[1..].iter().zip(airs)
            {
                let air = &mut file.content.atmosphere;
                (air.backscatter_per_m_sr, air.extinction_per_m) =
                    (backscatter_per_m_sr, extinction_per_m);
                let plan =
                    Plan::new(SceneFile::new(file.content.clone()).unwrap(), Target::Run).unwrap();
                // The ratio is told to 0.05 dB and the reach to 50 m.
                let budget = Budget::new(
                    &plan,
                    &[1e3 * reach_km - 51.0, 1e3 * reach_km + 51.0],
                    &Silent,
                )
                .unwrap();
                let around = budget.snr_db();
                assert!(
                    around[0] > cells[0] - 0.06 && around[1] < cells[0] + 0.06,
                    "{line}: {around:?}"
                );
            }
            let plan = Plan::new(file, Target::Run).unwrap();
            let root_of_pulses = (plan.scene().scan.pulses_per_line as f64).sqrt();
            let by_snr = bound(&plan, &Silent).unwrap().by_snr;
            // The first ratio of whole decibels at which the bound is small enough.
            let enough = by_snr
                .iter()
                .find(|p| p.window_m_s <= 0.5 * root_of_pulses)
                .unwrap()
                .snr_db;
            assert!(
                (enough - 1.06..enough + 0.06).contains(&cells[0]),
                "{line}: {enough}"
            );
        }
    }
}
