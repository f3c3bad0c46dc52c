//! Error against run time: which of the measured settings are worth their time, and which of them reaches an error for the least.

use super::Found;
use wakescope_sim::sweep::front::front;

/// Whether no other setting is at least as good in error and in time and better in one of them; equal settings stay together,
/// and one that failed is never on the front.
pub(super) fn on_front(settings: &[&Found]) -> Vec<bool> {
    let errors = settings.iter().map(|s| s.error).collect();
    let times_s = settings.iter().map(|s| s.cost.cpu_s).collect();
    front(&[errors, times_s])
}

/// Place of the setting of least time whose error and two standard errors are at most `target`; none if no setting is so good.
pub(super) fn cheapest(settings: &[&Found], target: f64) -> Option<usize> {
    let reaches =
        |s: &Found| s.error + 2.0 * s.standard_error <= target && s.cost.cpu_s.is_finite();
    let good = settings.iter().enumerate().filter(|(_, s)| reaches(s));
    good.min_by(|a, b| a.1.cost.cpu_s.total_cmp(&b.1.cost.cpu_s))
        .map(|(place, _)| place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::Cost;

    fn found(cpu_s: f64, error: f64, standard_error: f64) -> Found {
        let cost = Cost {
            cpu_s,
            wall_s: 0.0,
            peak_mem_bytes: 0.0,
        };
        Found {
            standard_error,
            ..Found::exact(error, cost)
        }
    }

    #[test]
    fn front_and_cheapest_settings_are_those_of_the_reference() {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../tests/reference/sim/cheapest.csv"
        );
        let text = std::fs::read_to_string(path).unwrap();
        let rows: Vec<Vec<&str>> = text
            .lines()
            .filter(|line| !line.starts_with('#') && !line.starts_with("setting,"))
            .map(|line| line.split(',').collect())
            .collect();
        let number = |row: &[&str], column: usize| row[column].parse::<f64>().unwrap();
        let settings: Vec<Found> = rows
            .iter()
            .map(|r| found(number(r, 1), number(r, 2), number(r, 3)))
            .collect();
        let settings: Vec<&Found> = settings.iter().collect();
        let is = |column: usize| {
            rows.iter()
                .map(|r| r[column] == "true")
                .collect::<Vec<bool>>()
        };
        assert_eq!(settings.len(), 7);
        assert_eq!(on_front(&settings), is(4));
        for (column, target) in [(5, 0.10), (6, 0.03), (7, 0.01)] {
            let found = cheapest(&settings, target);
            assert_eq!(
                (0..7).map(|place| Some(place) == found).collect::<Vec<_>>(),
                is(column),
                "{target}"
            );
        }
    }

    #[test]
    fn settings_that_fail_and_targets_beyond_reach_give_none() {
        let settings = [
            (1.0, f64::NAN, 0.0),
            (2.0, 0.02, 0.01),
            (2.0, 0.02, 0.01),
            (f64::NAN, 0.0, 0.0),
        ];
        let settings =
            settings.map(|(cpu_s, error, standard_error)| found(cpu_s, error, standard_error));
        let settings = settings.each_ref();
        assert_eq!(on_front(&settings), [false, true, true, false]);
        assert_eq!(
            (
                cheapest(&settings, 0.05),
                cheapest(&settings, 0.03),
                cheapest(&[], 1.0)
            ),
            (Some(1), None, None)
        );
    }
}
