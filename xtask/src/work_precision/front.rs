//! Error against run time: which of the measured settings are worth their time, and which of them reaches an error for the least.

/// A setting that was measured: what it takes, and how far off it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Measured {
    /// Processor time \[s\].
    pub(crate) core_s: f64,
    /// Relative error; NaN where the setting failed.
    pub(crate) error: f64,
    /// Its standard error; zero where the error is exact.
    pub(crate) standard_error: f64,
}

/// Whether no other setting is at least as good in error and in time and better in one of them; equal settings stay together,
/// and one that failed is never on the front.
pub(crate) fn on_front(settings: &[Measured]) -> Vec<bool> {
    let known = |s: &Measured| s.error.is_finite() && s.core_s.is_finite();
    let beats = |a: &Measured, b: &Measured| {
        a.error <= b.error && a.core_s <= b.core_s && (a.error < b.error || a.core_s < b.core_s)
    };
    settings.iter().map(|s| known(s) && !settings.iter().any(|other| known(other) && beats(other, s))).collect()
}

/// Place of the setting of least time whose error and two standard errors are at most `target`; none if no setting is so good.
pub(crate) fn cheapest(settings: &[Measured], target: f64) -> Option<usize> {
    let reaches = |s: &Measured| s.error + 2.0 * s.standard_error <= target && s.core_s.is_finite();
    let good = settings.iter().enumerate().filter(|(_, s)| reaches(s));
    good.min_by(|a, b| a.1.core_s.total_cmp(&b.1.core_s)).map(|(place, _)| place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn front_and_cheapest_settings_are_those_of_the_reference() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/reference/sim/cheapest.csv");
        let text = std::fs::read_to_string(path).unwrap();
        let rows: Vec<Vec<&str>> = text
            .lines()
            .filter(|line| !line.starts_with('#') && !line.starts_with("setting,"))
            .map(|line| line.split(',').collect())
            .collect();
        let number = |row: &[&str], column: usize| row[column].parse::<f64>().unwrap();
        let settings: Vec<Measured> = rows
            .iter()
            .map(|r| Measured { core_s: number(r, 1), error: number(r, 2), standard_error: number(r, 3) })
            .collect();
        let is = |column: usize| rows.iter().map(|r| r[column] == "true").collect::<Vec<bool>>();
        assert_eq!(settings.len(), 7);
        assert_eq!(on_front(&settings), is(4));
        for (column, target) in [(5, 0.10), (6, 0.03), (7, 0.01)] {
            let found = cheapest(&settings, target);
            assert_eq!((0..7).map(|place| Some(place) == found).collect::<Vec<_>>(), is(column), "{target}");
        }
    }

    #[test]
    fn settings_that_fail_and_targets_beyond_reach_give_none() {
        let of = |core_s, error, standard_error| Measured { core_s, error, standard_error };
        let settings = [of(1.0, f64::NAN, 0.0), of(2.0, 0.02, 0.01), of(2.0, 0.02, 0.01), of(f64::NAN, 0.0, 0.0)];
        assert_eq!(on_front(&settings), [false, true, true, false]);
        assert_eq!((cheapest(&settings, 0.05), cheapest(&settings, 0.03), cheapest(&[], 1.0)), (Some(1), None, None));
    }
}
