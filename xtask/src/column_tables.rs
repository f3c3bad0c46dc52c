//! The columns of `map.csv` and variables of `map.nc` as a table for the book, from the map of a small scan.

use fixtures::failure::Failure;
use std::path::Path;
use wakescope_sim::io::VelocityMap;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::progress::Silent;
use wakescope_sim::scene::SceneFile;
use wakescope_sim::write::velocity_map;

/// One line of sight with few gates.
const SCENE: &str = "[scan]\nelevation_min_rad = 0.1\nelevation_max_rad = 0.1\nrange_max_m = 330.0\n\
                     pulses_per_line = 1\nrealisations = 2\n";

/// The table: column, variable, unit, meaning.
///
/// # Errors
/// Fails if the scan does.
pub(crate) fn page() -> Result<String, Failure> {
    let plan = Plan::new(
        SceneFile::parse(SCENE, Path::new("scene.toml"))?,
        Target::Map,
    )?;
    let result = wakescope_sim::run(&plan, &Silent)?;
    let map = result
        .map
        .ok_or_else(|| Failure::new("the scan has no map".into()))?;
    Ok(table(&velocity_map(&plan, &map)))
}

fn table(map: &VelocityMap) -> String {
    let mut page =
        "| column of `map.csv` | variable of `map.nc` | unit | meaning |\n|---|---|---|---|\n"
            .to_owned();
    for field in &map.fields {
        let cells = [&field.unit.label.to_owned(), &field.long_name];
        let [unit, meaning] = cells.map(|cell| cell.replace('|', "\\|"));
        page += &format!(
            "| `{}` | `{}` | {unit} | {meaning} |\n",
            field.column(),
            field.name
        );
    }
    page
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_estimate_its_deviation_and_its_errors_are_columns() {
        let page = super::page().unwrap();
        for row in [
            "| `v_mean_m_s` | `radial_velocity` | m/s |",
            "| `std_m_s` | `velocity_standard_deviation` | m/s |",
            "| `rms_m_s` | `rms` | m/s |",
        ] {
            assert!(page.contains(row), "{row} in\n{page}");
        }
    }
}
