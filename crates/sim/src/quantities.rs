//! Numbers, times and amounts of memory as people read them.
//!
//! Check: each range of the units, and that they join without a gap.

use wakescope_estimate::Measured;

/// A number with so many digits behind the first.
pub(crate) fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.digits$e}").parse().unwrap_or(value)
}

/// A value with its standard deviation, if that is known, both with `digits` decimals.
pub(crate) fn measured(found: Measured, digits: usize) -> String {
    match found.std.is_finite() {
        true => format!("{:.digits$} +- {:.digits$}", found.value, found.std),
        false => format!("{:.digits$}", found.value),
    }
}

/// A time, s, in three digits or so.
pub(crate) fn seconds(s: f64) -> String {
    const HOUR_S: f64 = 3600.0;
    const DAY_S: f64 = 24.0 * HOUR_S;
    const YEAR_S: f64 = 365.25 * DAY_S;
    match s {
        s if s < 1e-3 => "< 1 ms".into(),
        s if s < 1.0 => format!("{:.0} ms", s * 1e3),
        s if s < 120.0 => format!("{s:.1} s"),
        s if s < 2.0 * HOUR_S => format!("{:.0} min", s / 60.0),
        s if s < 2.0 * DAY_S => format!("{:.1} h", s / HOUR_S),
        s if s < 2.0 * YEAR_S => format!("{:.1} days", s / DAY_S),
        s if s < 1e6 * YEAR_S => format!("{:.1} years", s / YEAR_S),
        s => format!("{:.1e} years", s / YEAR_S),
    }
}

/// An amount of memory, bytes.
pub(crate) fn bytes(b: f64) -> String {
    match b {
        b if b < 1e5 => format!("{:.1} kB", b / 1e3),
        b if b < 1e9 => format!("{:.1} MB", b / 1e6),
        b if b < 1e12 => format!("{:.1} GB", b / 1e9),
        b if b < 1e18 => format!("{:.1} TB", b / 1e12),
        b => format!("{:.1e} TB", b / 1e12),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_size_has_a_unit_that_people_read() {
        for (s, expected) in [
            (1e-9, "< 1 ms"),
            (0.25, "250 ms"),
            (90.0, "90.0 s"),
            (600.0, "10 min"),
            (36_000.0, "10.0 h"),
            (8.64e5, "10.0 days"),
            (35_959.6 * 3600.0, "4.1 years"),
            (1e20, "3.2e12 years"),
        ] {
            assert_eq!(seconds(s), expected);
        }
        for (b, expected) in [
            (50.0, "0.1 kB"),
            (2.5e6, "2.5 MB"),
            (3.1e10, "31.0 GB"),
            (317_904.6e9, "317.9 TB"),
            (1e20, "1.0e8 TB"),
        ] {
            assert_eq!(bytes(b), expected);
        }
    }
}
