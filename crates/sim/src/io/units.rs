//! Units of lengths, times, velocities and angles as files write them: udunits words, `km`, `cm s-1`, `m/s`, `km per hour`, `degrees`.
//!
//! Check: common spellings, and words that are no such unit.

/// Velocities that no air has, m/s: their unit is another one, or a fill value was not named.
pub(crate) const FASTEST_M_S: f64 = 500.0;

/// What is measured: powers of length, time and angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Quantity {
    Length,
    Time,
    Velocity,
    Angle,
}

impl Quantity {
    fn powers(self) -> [i32; 3] {
        match self {
            Self::Length => [1, 0, 0],
            Self::Time => [0, 1, 0],
            Self::Velocity => [1, -1, 0],
            Self::Angle => [0, 0, 1],
        }
    }

    /// SI units in `text`, which names a unit of this quantity; where it is empty 1, or a degree.
    ///
    /// # Errors
    /// What is allowed.
    pub(crate) fn si(self, text: &str) -> Result<f64, String> {
        let text = text
            .trim()
            .trim_matches(['[', ']', '(', ')'])
            .replace(['{', '}'], "");
        let factor = match text.trim() {
            "" if self == Self::Angle => Some(1f64.to_radians()),
            "" => Some(1.0),
            // Not "per millisecond".
            "ms-1" | "ms^-1" if self == Self::Velocity => Some(1.0),
            text => product(text)
                .filter(|(_, powers)| *powers == self.powers())
                .map(|(factor, _)| factor),
        };
        factor.ok_or_else(|| {
            match self {
                Self::Length => "a unit of length is needed, such as m, km or cm",
                Self::Time => "a unit of time is needed: s, ms, us, ns, minutes, hours or days",
                Self::Velocity => {
                    "a unit of velocity is needed, such as m s-1, cm s-1, km/h or knots"
                }
                Self::Angle => "a unit of angle is needed: degrees or radians",
            }
            .to_owned()
        })
    }
}

/// Whether a word names a unit of lengths, times, velocities or angles.
pub(crate) fn is_unit(text: &str) -> bool {
    let found = product(text);
    found.is_some_and(|(_, powers)| powers != [0; 3])
}

/// Units behind the names of columns, the longer ones first.
const UNITS_OF_NAMES: [(&str, &str); 25] = [
    ("_cm_s", "cm s-1"),
    ("_km_h", "km h-1"),
    ("_m_s", "m s-1"),
    ("_knots", "knots"),
    ("_kts", "kts"),
    ("_kn", "kn"),
    ("_degrees", "degrees"),
    ("_deg", "degrees"),
    ("_mrad", "mrad"),
    ("_rad", "rad"),
    ("_feet", "feet"),
    ("_ft", "ft"),
    ("_seconds", "s"),
    ("_hours", "hours"),
    ("_days", "days"),
    ("_ms", "ms"),
    ("_us", "us"),
    ("_ns", "ns"),
    ("_db", "dB"),
    ("_km", "km"),
    ("_cm", "cm"),
    ("_kt", "kt"),
    ("_m", "m"),
    ("_s", "s"),
    ("_h", "hours"),
];

/// The name of a column without its unit, and the unit: `range_km`, `range (km)` or `range [km]`.
pub(super) fn split_unit(column: &str) -> (&str, Option<&str>) {
    let column = column.trim();
    for (open, close) in [('(', ')'), ('[', ']')] {
        if let Some((name, unit)) = column.strip_suffix(close).and_then(|c| c.rsplit_once(open)) {
            return (name.trim_end(), Some(unit.trim()));
        }
    }
    for (suffix, unit) in UNITS_OF_NAMES {
        let Some(at) = column.len().checked_sub(suffix.len()) else {
            continue;
        };
        let is_there = column
            .get(at..)
            .is_some_and(|end| end.eq_ignore_ascii_case(suffix));
        if is_there && at > 0 {
            return (&column[..at], Some(unit));
        }
    }
    (column, None)
}

/// The unit of times and the text of the date from which they count: `days since 2024-01-31`.
pub(crate) fn split_date(units: &str) -> (&str, Option<&str>) {
    let lower = units.to_ascii_lowercase();
    let word = [" since ", " after ", " from ", " @ "]
        .into_iter()
        .find_map(|word| Some((lower.find(word)?, word.len())));
    match word {
        Some((at, length)) => (units[..at].trim(), Some(units[at + length..].trim())),
        None => (units.trim(), None),
    }
}

/// The factor of a product of units in SI, and its powers of length, time and angle.
fn product(text: &str) -> Option<(f64, [i32; 3])> {
    // The direction in which an angle is counted.
    let text = text
        .trim_end_matches("_north")
        .trim_end_matches("_east")
        .trim_end_matches("_clockwise_from_north");
    let spaced = text
        .replace("**", "^")
        .replace('⁻', "-")
        .replace('¹', "1")
        .replace('/', " / ")
        .replace(['.', '*', '_', '·'], " ");
    let mut factor = 1.0_f64;
    let mut powers = [0; 3];
    let mut sign = 1;
    for word in spaced.split_whitespace() {
        if word == "/" || word == "per" {
            sign = -1;
            continue;
        }
        let end = word
            .find(|c: char| !(c.is_alphabetic() || c == '°'))
            .unwrap_or(word.len());
        let power = match word[end..].trim_start_matches('^') {
            "" => 1,
            power => power.parse::<i32>().ok().filter(|power| power.abs() < 10)?,
        };
        let (unit, own) = base(&word[..end])?;
        let power = sign * power;
        factor *= unit.powi(power);
        for (sum, own) in powers.iter_mut().zip(own) {
            *sum += power * own;
        }
        // A line divides by the unit behind it.
        sign = 1;
    }
    Some((factor, powers))
}

/// Units in SI, with their powers of length, time and angle.
const UNITS: &str = include_str!("units.csv");

/// One unit in SI, and its powers.
fn base(word: &str) -> Option<(f64, [i32; 3])> {
    let lower = word.to_lowercase();
    let row = UNITS
        .lines()
        .find_map(|row| row.split_once(',').filter(|(unit, _)| *unit == lower))?
        .1;
    let (factor, powers) = row.split_once(',')?;
    let powers: Option<Vec<i32>> = powers.split(',').map(|power| power.parse().ok()).collect();
    Some((factor.parse().ok()?, powers?.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn common_spellings_are_known_and_other_words_are_refused() {
        let close = |quantity: Quantity, text: &str, expected: f64| {
            let found = quantity.si(text).unwrap_or_else(|e| panic!("{text}: {e}"));
            assert!((found / expected - 1.0).abs() < 1e-14, "{text}: {found}");
        };
        for text in [
            "m s-1",
            "m/s",
            "m s^-1",
            "m.s-1",
            "meters per second",
            "metre second-1",
            "m s**-1",
            "",
            "m_s-1",
            "ms-1",
            "m s⁻¹",
            "[m/s]",
            "(m s^{-1})",
            "mps",
        ] {
            close(Quantity::Velocity, text, 1.0);
        }
        for (text, expected) in [
            ("cm s-1", 0.01),
            ("cm/s", 0.01),
            ("km h-1", 1.0 / 3.6),
            ("km/h", 1.0 / 3.6),
            ("knots", 0.514_444_444_444_444_4),
        ] {
            close(Quantity::Velocity, text, expected);
        }
        for (text, expected) in [
            ("m", 1.0),
            ("km", 1e3),
            ("Kilometers", 1e3),
            ("cm", 0.01),
            ("mm", 1e-3),
            ("metre", 1.0),
        ] {
            close(Quantity::Length, text, expected);
        }
        for (text, expected) in [
            ("days", 86_400.0),
            ("nanoseconds", 1e-9),
            ("milliseconds", 1e-3),
            ("seconds", 1.0),
            ("ms", 1e-3),
            ("hours", 3600.0),
        ] {
            close(Quantity::Time, text, expected);
        }
        for (text, expected) in [
            ("rad", 1.0),
            ("degrees", 1f64.to_radians()),
            ("degree_north", 1f64.to_radians()),
            ("deg", 1f64.to_radians()),
            ("°", 1f64.to_radians()),
            ("", 1f64.to_radians()),
        ] {
            close(Quantity::Angle, text, expected);
        }
        for (quantity, text) in [
            (Quantity::Velocity, "m"),
            (Quantity::Velocity, "m s-2"),
            (Quantity::Velocity, "furlongs"),
            (Quantity::Length, "degrees_east"),
            (Quantity::Length, "m s-1"),
            (Quantity::Length, "1"),
            (Quantity::Time, "months"),
            (Quantity::Time, "1e3 s"),
            (Quantity::Angle, "m"),
            (Quantity::Angle, "1"),
            (Quantity::Velocity, "deg s-1"),
        ] {
            assert!(quantity.si(text).is_err(), "{text}");
        }
    }
}
